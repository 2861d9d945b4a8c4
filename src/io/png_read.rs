//! Reading PNG: sRGB values back to linear light.

use std::io::Cursor;
use std::path::Path;

use super::error::ReadError;
use super::picture::check_size;
use super::source::Source;
use crate::color::{Rgb, linear_from_srgb};
use crate::film::Picture;

/// What every PNG file begins with.
pub(super) const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// The most that deflate makes of one byte, rounded up: 1032.
const DEFLATE_RATIO: u128 = 1040;

/// Reads a PNG file of 1 to 16 bits a channel, in grey, colour or with a palette. Its values are taken as
/// sRGB, whatever the file says of its gamma; alpha is left out, and of an animation all but the first
/// picture.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, or is not a sound PNG file.
pub fn read_png(path: &Path) -> Result<Picture, ReadError> {
    decode(path, &Source::open(path)?.read_from(0)?)
}

pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<Picture, ReadError> {
    let bad = |e: png::DecodingError| ReadError::file(path, format!("not a sound PNG file: {e}"));
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(bad)?;
    let info = reader.info();
    let size = [info.width, info.height];
    let row_bits = u128::from(info.width) * info.bits_per_pixel() as u128;
    let unpacked = row_bits.div_ceil(8) * u128::from(info.height);
    let count = check_size(path, size, unpacked, bytes.len(), DEFLATE_RATIO)?;
    let too_large = || ReadError::file(path, "the picture does not fit into memory");
    let mut buffer = Vec::new();
    let needed = reader.output_buffer_size().ok_or_else(too_large)?;
    buffer.try_reserve_exact(needed).map_err(|_| too_large())?;
    buffer.resize(needed, 0);
    reader.next_frame(&mut buffer).map_err(bad)?;

    let (colour, depth) = reader.output_color_type();
    let channels = colour.samples();
    let is_grey = channels < 3;
    let wide = depth == png::BitDepth::Sixteen;
    let most: u16 = if wide { u16::MAX } else { 255 };
    let linear: Vec<f32> =
        (0..=most).map(|v| linear_from_srgb(f32::from(v) / f32::from(most))).collect();
    let width = if wide { 2 } else { 1 };
    let pixel = |values: &[u8]| {
        let value = |c: usize| {
            let v = match values[c * width..] {
                [high, low, ..] if wide => u16::from_be_bytes([high, low]),
                [v, ..] => u16::from(v),
                [] => 0,
            };
            linear[usize::from(v)]
        };
        if is_grey { Rgb::splat(value(0)) } else { Rgb::new(value(0), value(1), value(2)) }
    };
    let pixels: Vec<Rgb> = buffer.chunks_exact(channels * width).take(count).map(pixel).collect();
    if pixels.len() != count {
        return Err(ReadError::file(path, "not a sound PNG file: pixels are missing"));
    }
    Ok(Picture { size, extent: size, origin: None, pixels })
}
