//! Radiance HDR (`.hdr`, `.pic`): four bytes a pixel, three mantissas and the exponent they share.
//!
//! Source: Ward, *Real Pixels*, Graphics Gems II, 1991, and the Radiance reference manual ("Picture
//! file format"). A mantissa m with exponent e is m · 2^(e − 136), as most programs have it, without
//! Radiance's own half a step more.

use super::{ColorSpace, Decoded, File, linear};
use crate::io::error::ReadError;
use crate::texture::Pixels;

/// Pixels that a byte of the file can stand for: 8 bytes repeat one up to 65,535 times.
const EXPANSION: usize = 8192;

/// Decodes a Radiance picture of type `32-bit_rle_rgbe`, whose rows may run upwards or to the left.
///
/// Values are divided by the header's exposures, which makes them the scene's own again.
pub(super) fn decode(file: &File, space: ColorSpace) -> Result<Decoded, ReadError> {
    let mut input = Input { file, at: 0 };
    let mut warnings = Vec::new();
    let exposure = header(&mut input)?;
    if exposure != 1.0 {
        warnings.push(format!("its values were divided by its exposure of {exposure}"));
    }
    let Resolution { size: [width, height], flip } = resolution(&mut input)?;
    file.check([width, height], 1, EXPANSION)?;
    let mut values: Vec<f32> = Vec::new();
    let mut row = Vec::new();
    for _ in 0..height {
        read_row(&mut input, width, &mut row)?;
        if flip[0] {
            row.reverse();
        }
        values.extend(row.iter().flat_map(|&[r, g, b, e]| {
            // Exponent 0 is black.
            let unit = if e == 0 { 0.0 } else { (f32::from(e) - 136.0).exp2() / exposure };
            [r, g, b].map(|m| f32::from(m) * unit)
        }));
    }
    if flip[1] {
        let rows = values.chunks(3 * width).rev().flatten();
        values = rows.copied().collect();
    }
    linear(space, &mut values);
    let pixels = Pixels::half_or_float(values);
    Ok(Decoded { size: [width, height], channels: 3, pixels, warnings })
}

/// A file being read from its start.
struct Input<'a> {
    file: &'a File<'a>,
    at: usize,
}

impl<'a> Input<'a> {
    fn wrong(&self, message: impl Into<String>) -> ReadError {
        ReadError::byte(self.file.path, self.at as u64, message)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let bytes = self.file.bytes[self.at..].first_chunk();
        let bytes = *bytes.ok_or_else(|| self.wrong("the file ends too early"))?;
        self.at += N;
        Ok(bytes)
    }

    /// A line of the header, without its end.
    fn line(&mut self) -> Result<&'a [u8], ReadError> {
        let rest = &self.file.bytes[self.at..];
        let Some(len) = rest.iter().position(|&b| b == b'\n') else {
            return Err(self.wrong("the file ends within its header"));
        };
        self.at += len + 1;
        Ok(rest[..len].trim_ascii())
    }
}

/// Reads the header up to its empty line; returns the product of its exposures.
fn header(input: &mut Input) -> Result<f32, ReadError> {
    let mut exposure = 1.0_f32;
    loop {
        let start = input.at;
        let line = input.line()?;
        if line.is_empty() {
            return Ok(exposure);
        }
        let wrong = |message: String| Err(ReadError::byte(input.file.path, start as u64, message));
        let text = String::from_utf8_lossy(line);
        match text.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
            Some(("FORMAT", "32-bit_rle_rgbe")) => {}
            Some(("FORMAT", other)) => {
                return wrong(format!("format `{other}`; accepted: 32-bit_rle_rgbe"));
            }
            Some(("EXPOSURE", value)) => match value.parse::<f32>() {
                Ok(x) if x.is_finite() && x > 0.0 => exposure *= x,
                _ => return wrong(format!("exposure `{value}`; accepted: numbers above 0")),
            },
            _ => {}
        }
        if !exposure.is_normal() {
            return wrong("exposures whose product is no number".to_owned());
        }
    }
}

/// The line after the header.
struct Resolution {
    /// Width and height.
    size: [usize; 2],
    /// Whether rows run to the left, and whether they follow upwards.
    flip: [bool; 2],
}

fn resolution(input: &mut Input) -> Result<Resolution, ReadError> {
    let start = input.at;
    let line = String::from_utf8_lossy(input.line()?);
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    if let [y @ ("-Y" | "+Y"), height, x @ ("+X" | "-X"), width] = words[..]
        && let (Ok(width), Ok(height)) = (width.parse(), height.parse())
    {
        return Ok(Resolution { size: [width, height], flip: [x == "-X", y == "+Y"] });
    }
    let shown: String = line.chars().take(40).collect();
    let message = format!("resolution `{shown}`; accepted: `-Y <height> +X <width>`, with + or -");
    Err(ReadError::byte(input.file.path, start as u64, message))
}

/// Reads the `width` pixels of a row, run-length coded in the new or in the old way or not at all.
fn read_row(input: &mut Input, width: usize, row: &mut Vec<[u8; 4]>) -> Result<(), ReadError> {
    row.clear();
    let start = input.at;
    let first: [u8; 4] = input.take()?;
    if (8..=0x7fff).contains(&width) && first[..2] == [2, 2] && first[2] < 128 {
        if usize::from(u16::from_be_bytes([first[2], first[3]])) != width {
            let message = format!("a row that is not {width} pixels wide");
            return Err(ReadError::byte(input.file.path, start as u64, message));
        }
        row.resize(width, [0; 4]);
        return (0..4).try_for_each(|component| read_component(input, component, row));
    }
    input.at = start;
    // Pixels 1 1 1 n repeat the one before; several in a row are digits of one number, the lowest
    // first.
    let mut shift = 0;
    while row.len() < width {
        let pixel: [u8; 4] = input.take()?;
        if pixel[..3] != [1, 1, 1] {
            row.push(pixel);
            shift = 0;
            continue;
        }
        let count = usize::from(pixel[3]) << shift;
        let Some(&last) = row.last().filter(|_| shift <= 16 && count <= width - row.len()) else {
            return Err(input.wrong("a run that does not fit its row"));
        };
        row.resize(row.len() + count, last);
        shift += 8;
    }
    Ok(())
}

/// Reads one component of a row in the new way: above 128 a run, else so many single bytes.
fn read_component(
    input: &mut Input,
    component: usize,
    row: &mut [[u8; 4]],
) -> Result<(), ReadError> {
    let mut x = 0;
    while x < row.len() {
        let [code] = input.take()?;
        let count = usize::from(if code > 128 { code - 128 } else { code });
        if count == 0 || count > row.len() - x {
            return Err(input.wrong("a run that does not fit its row"));
        }
        let run = if code > 128 { Some(input.take::<1>()?[0]) } else { None };
        for pixel in &mut row[x..x + count] {
            pixel[component] = match run {
                Some(value) => value,
                None => input.take::<1>()?[0],
            };
        }
        x += count;
    }
    Ok(())
}
