//! The header of a `.npy` file: a Python dictionary of three entries, after some bytes that tell how long
//! it is.

use super::SampleType;
use crate::geometry::grid::SampleOrder;
use crate::io::error::ReadError;
use crate::io::source::Source;

const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// A header says three things; NumPy itself refuses longer ones.
const MOST: u64 = 10_000;

/// What a header says of the array.
#[derive(Debug)]
pub(in crate::io) struct Header {
    /// Its length along each axis.
    pub shape: Vec<usize>,
    /// The type of its samples.
    pub kind: SampleType,
    /// Whether the most significant byte comes first.
    pub is_big_endian: bool,
    /// Which axis runs fastest: the first, or the last.
    pub order: SampleOrder,
    /// Where in the file the samples start.
    pub start: u64,
}

/// Reads the header.
pub(in crate::io) fn header(source: &Source<'_>) -> Result<Header, ReadError> {
    let at = |offset, message: &str| ReadError::byte(source.path, offset, message);
    let mut start = [0; 12];
    let known = source.len.min(12) as usize;
    source.read_at(&mut start[..known], 0)?;
    if !start.starts_with(MAGIC) {
        return Err(at(0, "not a .npy file: it does not begin with \"\\x93NUMPY\""));
    }
    let (begin, length) = match start[6] {
        1 => (10, u64::from(u16::from_le_bytes([start[8], start[9]]))),
        2 | 3 => (12, u64::from(u32::from_le_bytes([start[8], start[9], start[10], start[11]]))),
        version => {
            let message = format!("version {version} of the .npy format; accepted: 1, 2, 3");
            return Err(at(6, &message));
        }
    };
    if source.len < begin || length > source.len - begin {
        return Err(at(8, "the file ends within its header"));
    }
    if length > MOST {
        return Err(at(8, &format!("a header of {length} bytes; accepted: at most {MOST}")));
    }
    let mut text = vec![0; length as usize];
    source.read_at(&mut text, begin)?;
    let mut parser = Parser { text: &text, at: 0 };
    let header = parser.header().map_err(|message| at(begin + parser.at as u64, &message))?;
    Ok(Header { start: begin + length, ..header })
}

/// Reads a Python literal of the few forms that occur.
struct Parser<'t> {
    text: &'t [u8],
    at: usize,
}

impl<'t> Parser<'t> {
    /// `{'descr': '<f4', 'fortran_order': False, 'shape': (64, 64, 64), }`, in any order.
    fn header(&mut self) -> Result<Header, String> {
        let (mut kind, mut order, mut shape) = (None, None, None);
        self.expect(b'{')?;
        while !self.skip(b'}') {
            let (name, from) = (self.quoted()?, self.at);
            self.expect(b':')?;
            match name {
                b"descr" => kind = Some(self.kind()?),
                b"fortran_order" => order = Some(self.order()?),
                b"shape" => shape = Some(self.shape()?),
                _ => {
                    self.at = from;
                    let name = String::from_utf8_lossy(name);
                    return Err(format!("unknown entry '{name}' in the header"));
                }
            }
            if !self.skip(b',') {
                self.expect(b'}')?;
                break;
            }
        }
        let (Some((kind, is_big_endian)), Some(order), Some(shape)) = (kind, order, shape) else {
            return Err("the header lacks one of 'descr', 'fortran_order', 'shape'".to_owned());
        };
        Ok(Header { shape, kind, is_big_endian, order, start: 0 })
    }

    /// Skips blanks, then `byte` if it is there.
    fn skip(&mut self, byte: u8) -> bool {
        while self.text.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        let is_there = self.text.get(self.at) == Some(&byte);
        self.at += usize::from(is_there);
        is_there
    }

    fn expect(&mut self, byte: u8) -> Result<(), String> {
        if self.skip(byte) {
            return Ok(());
        }
        Err(format!("expected `{}` in the header", char::from(byte)))
    }

    /// As long as `belongs` holds.
    fn word(&mut self, belongs: impl Fn(&u8) -> bool) -> &'t [u8] {
        let rest = &self.text[self.at..];
        let word = &rest[..rest.iter().take_while(|b| belongs(b)).count()];
        self.at += word.len();
        word
    }

    fn quoted(&mut self) -> Result<&'t [u8], String> {
        let quote = if self.skip(b'"') { b'"' } else { b'\'' };
        if quote == b'\'' {
            self.expect(b'\'')?;
        }
        let word = self.word(|&b| b != quote);
        self.expect(quote)?;
        Ok(word)
    }

    fn kind(&mut self) -> Result<(SampleType, bool), String> {
        const ACCEPTED: &str = "accepted: u1, i1, u2, i2, u4, i4, f4, f8";
        if self.skip(b'[') {
            return Err(format!("samples that are not single numbers; {ACCEPTED}"));
        }
        let from = self.at;
        let descr = self.quoted()?;
        let (order, name) = descr.split_first().unwrap_or((&b' ', &[]));
        let kind = match name {
            b"u1" => SampleType::U8,
            b"i1" => SampleType::I8,
            b"u2" => SampleType::U16,
            b"i2" => SampleType::I16,
            b"u4" => SampleType::U32,
            b"i4" => SampleType::I32,
            b"f4" => SampleType::F32,
            b"f8" => SampleType::F64,
            _ => {
                self.at = from;
                let descr = String::from_utf8_lossy(descr);
                return Err(format!("samples of type '{descr}'; {ACCEPTED}"));
            }
        };
        match order {
            b'<' | b'|' => Ok((kind, false)),
            b'>' => Ok((kind, true)),
            _ => {
                self.at = from;
                Err("the type's byte order must be one of '<', '>', '|'".to_owned())
            }
        }
    }

    fn order(&mut self) -> Result<SampleOrder, String> {
        self.skip(b' ');
        match self.word(u8::is_ascii_alphabetic) {
            b"True" => Ok(SampleOrder::XFastest),
            b"False" => Ok(SampleOrder::ZFastest),
            _ => Err("'fortran_order' must be True or False".to_owned()),
        }
    }

    fn shape(&mut self) -> Result<Vec<usize>, String> {
        self.expect(b'(')?;
        let mut shape = Vec::new();
        while !self.skip(b')') {
            let digits = self.word(u8::is_ascii_digit);
            let number = str::from_utf8(digits).ok().and_then(|text| text.parse().ok());
            shape.push(number.ok_or("'shape' must be whole numbers")?);
            if !self.skip(b',') {
                self.expect(b')')?;
                break;
            }
        }
        Ok(shape)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::with_file;
    use crate::geometry::grid::Grid;
    use crate::io::grid::read_npy;

    fn npy(version: u8, header: &str, samples: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        let length = header.len() as u32;
        bytes.extend(&length.to_le_bytes()[..if version == 1 { 2 } else { 4 }]);
        bytes.extend(header.as_bytes());
        bytes.extend(samples);
        bytes
    }

    fn read(bytes: &[u8]) -> Result<Grid, String> {
        with_file("a.npy", bytes, read_npy)
    }

    const HEADER: &str = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3, 4), }    \n";

    #[test]
    fn both_orders_and_all_versions() {
        let samples: Vec<u8> = (0..24).collect();
        for version in [1, 2, 3] {
            let grid = read(&npy(version, HEADER, &samples)).unwrap();
            // numpy.arange(24).reshape(2, 3, 4)[1, 2, 3], [1, 0, 0] and [0, 0, 1].
            let at = [[1, 2, 3], [1, 0, 0], [0, 0, 1]].map(|at| grid.sample(at));
            assert_eq!(at, [23.0, 12.0, 1.0]);
        }
        let fortran = HEADER.replace("False", "True");
        let grid = read(&npy(1, &fortran, &samples)).unwrap();
        let at = [[1, 2, 3], [1, 0, 0], [0, 0, 1]].map(|at| grid.sample(at));
        assert_eq!(at, [23.0, 1.0, 6.0]);
        assert_eq!(grid.size(), [2, 3, 4]);
    }

    #[test]
    fn headers_may_be_written_in_other_ways() {
        let samples: Vec<u8> = (0..8u8).flat_map(|i| f64::from(i).to_be_bytes()).collect();
        let header = "{\"shape\":(2,2,2),\"fortran_order\":True,\"descr\":\">f8\"}";
        assert_eq!(read(&npy(1, header, &samples)).unwrap().sample([0, 1, 1]), 6.0);
    }

    #[test]
    fn each_mistake_is_told() {
        let told = |bytes: &[u8]| read(bytes).unwrap_err();
        let of = |from: &str, to: &str| told(&npy(1, &HEADER.replace(from, to), &[0; 24]));
        assert_eq!(
            told(b"PK\x03\x04"),
            "a.npy: at byte 0: not a .npy file: it does not begin with \"\\x93NUMPY\""
        );
        assert_eq!(
            told(&npy(4, HEADER, &[])),
            "a.npy: at byte 6: version 4 of the .npy format; accepted: 1, 2, 3"
        );
        assert_eq!(
            told(b"\x93NUMPY\x01\x00\xff\xff{"),
            "a.npy: at byte 8: the file ends within its header"
        );
        assert_eq!(
            told(b"\x93NUMPY"),
            "a.npy: at byte 6: version 0 of the .npy format; accepted: 1, 2, 3"
        );
        assert_eq!(told(b"\x93NUMPY\x02"), "a.npy: at byte 8: the file ends within its header");
        let long = format!("{HEADER}{}", " ".repeat(20_000));
        assert_eq!(
            told(&npy(2, &long, &[0; 24])),
            "a.npy: at byte 8: a header of 20067 bytes; accepted: at most 10000"
        );
        assert_eq!(
            of("|u1", "<c8"),
            "a.npy: at byte 20: samples of type '<c8'; accepted: u1, i1, u2, i2, u4, i4, f4, f8"
        );
        assert!(of("'|u1'", "[('x', '<f4')]").contains("samples that are not single numbers"));
        assert!(of("|", "=").ends_with("the type's byte order must be one of '<', '>', '|'"));
        assert!(of("(2, 3, 4)", "(6, 4)").ends_with("an array of 2 axes; accepted: 3 (x, y, z)"));
        assert!(of("(2, 3, 4)", "(2, -3, 4)").ends_with("'shape' must be whole numbers"));
        assert!(of("(2, 3, 4)", "(2, 3, 99999999999999999999)").ends_with("whole numbers"));
        assert!(of("False", "Maybe").ends_with("'fortran_order' must be True or False"));
        assert!(of("shape", "form").ends_with("unknown entry 'form' in the header"));
        assert!(
            of("'shape': (2, 3, 4), ", "")
                .ends_with("lacks one of 'descr', 'fortran_order', 'shape'")
        );
        assert!(of("{", "").ends_with("expected `{` in the header"));
        assert_eq!(
            of("(2, 3, 4)", "(2, 3, 4000000)"),
            "a.npy: 2 x 3 x 4000000 samples of 1 bytes are 24000000 bytes, but the file holds 24"
        );
        // Cut anywhere, it is an error.
        let whole = npy(1, HEADER, &[0; 24]);
        for end in 0..whole.len() {
            assert!(read(&whole[..end]).is_err(), "{end}");
        }
        assert!(read(&whole).is_ok());
    }
}
