//! The data of a PLY file as a stream of numbers, the same for text and bytes.

use super::header::{Element, Scalar};
use super::{VertexLayout, Vertices, parallel};
use crate::io::error::ReadError;
use crate::io::source::{CHUNK, Source};
use crate::io::text::{parse_integer, parse_number, quoted};

/// A stream of typed numbers that can be put back to an earlier place.
pub(super) trait Values {
    /// Where the stream is; only good for [`Self::seek`] and [`Self::error`].
    fn position(&self) -> u64;
    /// Goes on from `position`.
    fn seek(&mut self, position: u64);
    /// An error at `position`: a line or an offset.
    fn error(&self, position: u64, message: String) -> ReadError;
    /// Checks that what is left can hold the records of `element`, before anyone allocates.
    fn check_room(&self, element: &Element) -> Result<(), ReadError>;
    /// Bytes that are left.
    fn left(&self) -> u64;
    /// A guess, never out of proportion to the file, of how many items of type `ty` there are in
    /// the lists of `element`, which comes next.
    fn expected_items(&self, element: &Element, ty: Scalar) -> u64;
    /// The next number, of type `ty`.
    fn number(&mut self, ty: Scalar) -> Result<f64, ReadError>;
    /// The next whole number, of type `ty`.
    fn integer(&mut self, ty: Scalar) -> Result<i64, ReadError>;
    /// Replaces `out` by the next `n` whole numbers of type `ty`.
    fn integers(&mut self, ty: Scalar, n: u64, out: &mut Vec<i64>) -> Result<(), ReadError>;
    /// Leaves out the next `n` numbers of type `ty`.
    fn skip(&mut self, ty: Scalar, n: u64) -> Result<(), ReadError>;

    /// The length of a list, a number of type `ty`.
    fn list_len(&mut self, ty: Scalar) -> Result<u64, ReadError> {
        let at = self.position();
        let n = self.integer(ty)?;
        u64::try_from(n).map_err(|_| self.error(at, format!("a list of {n} items")))
    }

    /// Leaves out all records of `element`.
    fn skip_element(&mut self, element: &Element) -> Result<(), ReadError> {
        self.check_room(element)?;
        if element.properties.is_empty() {
            return Ok(());
        }
        skip_records(self, element)
    }

    /// All vertices at once, if there is a faster way than one by one; else stays where it is.
    fn vertices_at_once(
        &mut self,
        _: &Element,
        _: &VertexLayout,
    ) -> Result<Option<Vertices>, ReadError> {
        Ok(None)
    }

    /// All faces at once, if they are triangles and there is a faster way than one by one; else
    /// stays where it is. `list` is the property with the indices, all below `vertex_count`.
    fn triangles_at_once(
        &mut self,
        _: &Element,
        _list: usize,
        _vertex_count: usize,
    ) -> Result<Option<Vec<[u32; 3]>>, ReadError> {
        Ok(None)
    }
}

/// Leaves out the records of `element` one by one.
fn skip_records<V: Values + ?Sized>(values: &mut V, element: &Element) -> Result<(), ReadError> {
    for _ in 0..element.count {
        for property in &element.properties {
            let n = property.count.map_or(Ok(1), |ty| values.list_len(ty))?;
            values.skip(property.item, n)?;
        }
    }
    Ok(())
}

/// The message for data that ends early.
fn missing(element: &Element, left: u64) -> String {
    format!(
        "the file ends too early: {} records of element `{}` do not fit into {left} bytes",
        element.count, element.name
    )
}

/// Numbers written as text, separated by white space; line ends mean nothing.
pub(super) struct Ascii<'a> {
    source: &'a Source<'a>,
    bytes: Vec<u8>,
    at: usize,
    header_lines: usize,
}

impl<'a> Ascii<'a> {
    /// From `body` on, after `header_lines` lines.
    pub fn new(source: &'a Source, body: u64, header_lines: usize) -> Result<Self, ReadError> {
        Ok(Self { source, bytes: source.read_from(body)?, at: 0, header_lines })
    }

    /// The start and end of the next word.
    fn word(&mut self) -> Result<&[u8], ReadError> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace());
        let Some(start) = start else {
            self.at = self.bytes.len();
            return Err(self.error(self.at as u64, "the file ends too early".into()));
        };
        let rest = &rest[start..];
        let len = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += start + len;
        Ok(&rest[..len])
    }

    /// An error about the word before the current place.
    fn bad_word(&self, len: usize, what: &str) -> ReadError {
        let word = &self.bytes[self.at - len..self.at];
        self.error((self.at - len) as u64, format!("{} is not {what}", quoted(word)))
    }
}

impl Values for Ascii<'_> {
    fn position(&self) -> u64 {
        self.at as u64
    }

    fn seek(&mut self, position: u64) {
        self.at = position as usize;
    }

    fn error(&self, position: u64, message: String) -> ReadError {
        // A position before white space stands for the word behind it.
        let before = &self.bytes[..position as usize];
        let gap = self.bytes[before.len()..].iter().position(|b| !b.is_ascii_whitespace());
        let before = &self.bytes[..before.len() + gap.unwrap_or(0)];
        let feeds = before.iter().filter(|&&b| b == b'\n').count();
        ReadError::line(self.source.path, self.header_lines + feeds + 1, message)
    }

    fn check_room(&self, element: &Element) -> Result<(), ReadError> {
        // A number takes a digit and a separator, which the last may lack.
        let needed = u128::from(element.count) * 2 * element.properties.len() as u128;
        if needed > u128::from(self.left()) + 1 {
            return Err(self.error(self.at as u64, missing(element, self.left())));
        }
        Ok(())
    }

    fn left(&self) -> u64 {
        (self.bytes.len() - self.at) as u64
    }

    fn expected_items(&self, element: &Element, _: Scalar) -> u64 {
        (3 * element.count).min(self.left() / 2)
    }

    fn number(&mut self, _: Scalar) -> Result<f64, ReadError> {
        let word = self.word()?;
        let len = word.len();
        parse_number(word).ok_or_else(|| self.bad_word(len, "a number"))
    }

    fn integer(&mut self, _: Scalar) -> Result<i64, ReadError> {
        let word = self.word()?;
        let len = word.len();
        // Some programs write whole numbers as "3.0".
        let whole = |v: f64| (v.fract() == 0.0 && v.abs() < 1e15).then_some(v as i64);
        parse_integer(word)
            .or_else(|| parse_number(word).and_then(whole))
            .ok_or_else(|| self.bad_word(len, "a whole number"))
    }

    fn integers(&mut self, ty: Scalar, n: u64, out: &mut Vec<i64>) -> Result<(), ReadError> {
        out.clear();
        for _ in 0..n {
            out.push(self.integer(ty)?);
        }
        Ok(())
    }

    fn skip(&mut self, _: Scalar, n: u64) -> Result<(), ReadError> {
        for _ in 0..n {
            self.word()?;
        }
        Ok(())
    }
}

/// Numbers written as bytes, the most significant first if `BIG`.
pub(super) struct Binary<'a, const BIG: bool> {
    source: &'a Source<'a>,
    /// A window of the file that begins at `start`.
    window: Vec<u8>,
    start: u64,
    at: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    /// From offset `body` on.
    pub fn new(source: &'a Source, body: u64) -> Self {
        Self { source, window: Vec::new(), start: body, at: 0 }
    }

    /// The next `n` bytes.
    #[inline]
    fn take(&mut self, n: usize) -> Result<&[u8], ReadError> {
        if self.window.len() - self.at < n {
            self.refill(n)?;
        }
        self.at += n;
        Ok(&self.window[self.at - n..self.at])
    }

    #[cold]
    fn refill(&mut self, n: usize) -> Result<(), ReadError> {
        self.check_left(n as u64)?;
        self.start = self.position();
        self.at = 0;
        // The file has so many bytes, so this cannot grow out of proportion.
        let len = self.left().min(n.max(CHUNK) as u64) as usize;
        self.window.resize(len, 0);
        self.source.read_at(&mut self.window, self.start)
    }

    fn check_left(&self, n: u64) -> Result<(), ReadError> {
        if n > self.left() {
            let message =
                format!("the file ends too early: {n} bytes needed, {} left", self.left());
            return Err(self.error(self.position(), message));
        }
        Ok(())
    }
}

impl<const BIG: bool> Values for Binary<'_, BIG> {
    fn position(&self) -> u64 {
        self.start + self.at as u64
    }

    fn seek(&mut self, position: u64) {
        self.window.clear();
        (self.start, self.at) = (position, 0);
    }

    fn error(&self, position: u64, message: String) -> ReadError {
        ReadError::byte(self.source.path, position, message)
    }

    fn check_room(&self, element: &Element) -> Result<(), ReadError> {
        let needed = u128::from(element.count) * element.record_size(0) as u128;
        if needed > u128::from(self.left()) {
            return Err(self.error(self.position(), missing(element, self.left())));
        }
        Ok(())
    }

    fn left(&self) -> u64 {
        self.source.len.saturating_sub(self.position())
    }

    fn expected_items(&self, element: &Element, ty: Scalar) -> u64 {
        // Exact if this is the last element and the list is its only one.
        let others = element.count * element.record_size(0) as u64;
        self.left().saturating_sub(others) / ty.size() as u64
    }

    #[inline]
    fn number(&mut self, ty: Scalar) -> Result<f64, ReadError> {
        Ok(decode::<BIG>(ty, self.take(ty.size())?))
    }

    #[inline]
    fn integer(&mut self, ty: Scalar) -> Result<i64, ReadError> {
        Ok(decode_integer::<BIG>(ty, self.take(ty.size())?))
    }

    fn integers(&mut self, ty: Scalar, n: u64, out: &mut Vec<i64>) -> Result<(), ReadError> {
        self.check_left(n.saturating_mul(ty.size() as u64))?;
        let bytes = self.take(n as usize * ty.size())?;
        out.clear();
        out.extend(bytes.chunks_exact(ty.size()).map(|b| decode_integer::<BIG>(ty, b)));
        Ok(())
    }

    fn skip(&mut self, ty: Scalar, n: u64) -> Result<(), ReadError> {
        let n = n.saturating_mul(ty.size() as u64);
        self.check_left(n)?;
        if n <= (self.window.len() - self.at) as u64 {
            self.at += n as usize;
        } else {
            self.seek(self.position() + n);
        }
        Ok(())
    }

    fn skip_element(&mut self, element: &Element) -> Result<(), ReadError> {
        self.check_room(element)?;
        if element.is_fixed() {
            // Checked above: it fits into what is left.
            self.seek(self.position() + element.count * element.record_size(0) as u64);
            return Ok(());
        }
        skip_records(self, element)
    }

    fn vertices_at_once(
        &mut self,
        element: &Element,
        layout: &VertexLayout,
    ) -> Result<Option<Vertices>, ReadError> {
        if !element.is_fixed() {
            return Ok(None);
        }
        let start = self.position();
        self.skip_element(element)?;
        parallel::vertices::<BIG>(self.source, start, element, layout).map(Some)
    }

    fn triangles_at_once(
        &mut self,
        element: &Element,
        list: usize,
        vertex_count: usize,
    ) -> Result<Option<Vec<[u32; 3]>>, ReadError> {
        let start = self.position();
        let found = parallel::triangles::<BIG>(self.source, start, element, list, vertex_count)?;
        if found.is_some() {
            // It was all there, so this fits.
            self.seek(start + element.count * element.record_size(3) as u64);
        }
        Ok(found)
    }
}

/// The first `N` of `bytes`, of which there are at least that many.
#[inline]
fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(&bytes[..N]);
    array
}

/// The number of type `ty` at the start of `b`.
#[inline]
pub(super) fn decode<const BIG: bool>(ty: Scalar, b: &[u8]) -> f64 {
    match ty {
        Scalar::F32 => f64::from(decode_f32::<BIG>(b)),
        Scalar::F64 if BIG => f64::from_be_bytes(first(b)),
        Scalar::F64 => f64::from_le_bytes(first(b)),
        _ => decode_integer::<BIG>(ty, b) as f64,
    }
}

/// The f32 at the start of `b`.
#[inline]
pub(super) fn decode_f32<const BIG: bool>(b: &[u8]) -> f32 {
    if BIG { f32::from_be_bytes(first(b)) } else { f32::from_le_bytes(first(b)) }
}

/// The u32 at the start of `b`.
#[inline]
pub(super) fn decode_u32<const BIG: bool>(b: &[u8]) -> u32 {
    if BIG { u32::from_be_bytes(first(b)) } else { u32::from_le_bytes(first(b)) }
}

/// The whole number of type `ty` at the start of `b`; one of a floating-point type is cut off.
#[inline]
pub(super) fn decode_integer<const BIG: bool>(ty: Scalar, b: &[u8]) -> i64 {
    let u16_ = |b| if BIG { u16::from_be_bytes(first(b)) } else { u16::from_le_bytes(first(b)) };
    match ty {
        Scalar::I8 => i64::from(b[0] as i8),
        Scalar::U8 => i64::from(b[0]),
        Scalar::I16 => i64::from(u16_(b) as i16),
        Scalar::U16 => i64::from(u16_(b)),
        Scalar::I32 => i64::from(decode_u32::<BIG>(b) as i32),
        Scalar::U32 => i64::from(decode_u32::<BIG>(b)),
        Scalar::F32 | Scalar::F64 => decode::<BIG>(ty, b) as i64,
    }
}
