//! The header of a PLY file: which elements there are, and what each record holds.

use crate::io::error::ReadError;
use crate::io::source::Source;
use crate::io::text::quoted;

/// Longest header that is looked for: comments can be long, but not this long.
const MAX_HEADER: u64 = 16 << 20;

/// How the numbers after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// As text.
    Ascii,
    /// As bytes, least significant first.
    Little,
    /// As bytes, most significant first.
    Big,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one in a binary file.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Whether it is a whole number, fit for counts and indices.
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// Whether it can hold digits that an f32 cannot.
    pub fn is_wide(self) -> bool {
        matches!(self, Self::I32 | Self::U32 | Self::F64)
    }
}

/// A named part of each record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    /// For a list, the type of the number of items in front of them.
    pub count: Option<Scalar>,
    /// The type of the number, or of a list's items.
    pub item: Scalar,
}

/// A table of records.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Bytes of a record in a binary file if all lists have `list_len` items.
    pub fn record_size(&self, list_len: usize) -> usize {
        let size = |p: &Property| match p.count {
            None => p.item.size(),
            Some(count) => count.size() + list_len * p.item.size(),
        };
        self.properties.iter().map(size).sum()
    }

    /// Whether all records are of one size.
    pub fn is_fixed(&self) -> bool {
        self.properties.iter().all(|p| p.count.is_none())
    }

    /// The position of the first property called one of `names`.
    pub fn find(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|p| names.contains(&p.name.as_str()))
    }
}

/// What stands in front of the data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Where the data begins, in bytes from the start of the file.
    pub body: u64,
    /// Lines of the header.
    pub lines: usize,
}

/// Reads and understands the header.
pub(super) fn read(source: &Source) -> Result<Header, ReadError> {
    let mut bytes = Vec::new();
    let limit = source.len.min(MAX_HEADER);
    let mut want = 4096;
    loop {
        let have = bytes.len();
        let n = limit.min(want) as usize;
        bytes.resize(n, 0);
        source.read_at(&mut bytes[have..], have as u64)?;
        if have == 0 && !bytes.starts_with(b"ply") {
            return Err(ReadError::file(
                source.path,
                "not a ply file: it does not begin with `ply`",
            ));
        }
        if let Some(header) = parse(source, &bytes, n as u64 == source.len)? {
            return Ok(header);
        }
        if n as u64 == limit {
            let message = "the header has no line `end_header`";
            return Err(ReadError::file(source.path, message));
        }
        want *= 4;
    }
}

/// The header at the start of `bytes`; `None` if it goes on behind them.
fn parse(source: &Source, bytes: &[u8], is_all: bool) -> Result<Option<Header>, ReadError> {
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    let (mut at, mut line) = (0, 0);
    // How the first line ends tells whether a line feed after `end_header`'s carriage return
    // belongs to the header or is the first byte of the data.
    let mut is_cr_only = false;
    while let Some(len) = bytes[at..].iter().position(|b| matches!(b, b'\n' | b'\r')) {
        let text = &bytes[at..at + len];
        at += len + 1;
        if bytes[at - 1] == b'\r' {
            match bytes.get(at) {
                // The next byte decides, and it is not here yet.
                None if !is_all => return Ok(None),
                Some(b'\n') if line == 0 || !is_cr_only => at += 1,
                _ => is_cr_only |= line == 0,
            }
        }
        line += 1;
        let error = |message: String| ReadError::line(source.path, line, message);
        let words: Vec<&[u8]> =
            text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
        match words[..] {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"ply"] if line == 1 => {}
            [b"format", name, ..] => {
                format = Some(match name {
                    b"ascii" => Format::Ascii,
                    b"binary_little_endian" => Format::Little,
                    b"binary_big_endian" => Format::Big,
                    _ => {
                        return Err(error(format!(
                            "unknown ply format {}; accepted: ascii, binary_little_endian, \
                             binary_big_endian",
                            quoted(name)
                        )));
                    }
                });
            }
            [b"element", name, count] => {
                let count =
                    str::from_utf8(count).ok().and_then(|c| c.parse().ok()).ok_or_else(|| {
                        error(format!("{} is not a number of records", quoted(count)))
                    })?;
                elements.push(Element { name: readable(name), count, properties: Vec::new() });
            }
            [b"property", ref rest @ ..] => {
                let property = parse_property(rest).map_err(error)?;
                let Some(element) = elements.last_mut() else {
                    return Err(error("a property before the first `element`".into()));
                };
                element.properties.push(property);
            }
            [b"end_header", ..] => {
                let format = format.ok_or_else(|| error("the header has no `format`".into()))?;
                return Ok(Some(Header { format, elements, body: at as u64, lines: line }));
            }
            [word, ..] => {
                return Err(error(format!(
                    "{} in the header; accepted: format, comment, obj_info, `element` with name \
                     and count, property, end_header",
                    quoted(word)
                )));
            }
        }
    }
    Ok(None)
}

/// What follows the word `property`.
fn parse_property(words: &[&[u8]]) -> Result<Property, String> {
    let scalar = |word: &[u8]| {
        Scalar::parse(word).ok_or_else(|| {
            format!(
                "unknown type {}; accepted: char, uchar, short, ushort, int, uint, float, double, \
                 int8, uint8, int16, uint16, int32, uint32, float32, float64",
                quoted(word)
            )
        })
    };
    match *words {
        [b"list", count, item, name] => {
            let count_type = scalar(count)?;
            if !count_type.is_integer() {
                return Err(format!("a list's length cannot be of type {}", quoted(count)));
            }
            Ok(Property { name: readable(name), count: Some(count_type), item: scalar(item)? })
        }
        [item, name] => Ok(Property { name: readable(name), count: None, item: scalar(item)? }),
        _ => Err("a property needs a type and a name, or `list`, two types and a name".into()),
    }
}

/// A name fit for messages. Those of interest are short and plain, and stay as they are.
fn readable(name: &[u8]) -> String {
    name[..name.len().min(80)].escape_ascii().to_string()
}
