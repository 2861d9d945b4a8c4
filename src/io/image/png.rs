//! PNG (ISO/IEC 15948): grey, palette and colour of 1 to 16 bits.

use std::io::Cursor;

use super::{ColorSpace, Decoded, File};
use crate::color::linear_from_srgb;
use crate::io::error::ReadError;
use crate::texture::Pixels;

/// A byte of a deflate stream stands for 1032 at most.
const EXPANSION: usize = 1032;

/// Decodes a PNG; of an animation the first picture.
pub(super) fn decode(file: &File, space: ColorSpace) -> Result<Decoded, ReadError> {
    let failed = |error: png::DecodingError| file.damaged("PNG", error);
    let mut decoder = png::Decoder::new(Cursor::new(file.bytes));
    // Palettes become colours, and fewer than 8 bits become 8.
    decoder.set_transformations(png::Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let info = decoder.read_header_info().map_err(failed)?;
    let size = [info.width as usize, info.height as usize];
    let bits = info.bits_per_pixel();
    file.check(size, 1, EXPANSION * 8 / bits)?;
    let mut reader = decoder.read_info().map_err(failed)?;
    let bytes = reader.output_buffer_size().ok_or_else(|| file.wrong("too many pixels"))?;
    let mut bytes = vec![0; bytes];
    let frame = reader.next_frame(&mut bytes).map_err(failed)?;
    if [frame.width as usize, frame.height as usize] != size {
        return Err(file.wrong("its first picture does not fill it"));
    }
    reader.finish().map_err(failed)?;
    let (channels, alpha) = match frame.color_type {
        png::ColorType::Grayscale => (1, false),
        png::ColorType::GrayscaleAlpha => (1, true),
        png::ColorType::Rgb => (3, false),
        png::ColorType::Rgba => (3, true),
        png::ColorType::Indexed => return Err(file.wrong("a palette without colours")),
    };
    let depth = if frame.bit_depth == png::BitDepth::Sixteen { 2 } else { 1 };
    let mut warnings = Vec::new();
    if alpha && without_alpha(&mut bytes, channels * depth, depth) {
        warnings.push("its alpha channel was ignored".to_owned());
    }
    let words = || bytes.as_chunks::<2>().0.iter().map(|&b| u16::from_be_bytes(b));
    let pixels = match (depth, space) {
        (1, ColorSpace::Srgb) => Pixels::Srgb8(bytes),
        (1, ColorSpace::Linear) => Pixels::Linear8(bytes),
        (_, ColorSpace::Linear) => Pixels::Linear16(words().collect()),
        // 16 bits in linear light are too few for dark signals.
        (_, ColorSpace::Srgb) => {
            let table: Vec<f32> =
                (0..=u16::MAX).map(|i| linear_from_srgb(f32::from(i) / 65535.0)).collect();
            Pixels::half_or_float(words().map(|i| table[usize::from(i)]).collect())
        }
    };
    Ok(Decoded { size, channels, pixels, warnings })
}

/// Drops the `alpha` bytes after every `color` bytes; says whether any of them was not opaque.
fn without_alpha(bytes: &mut Vec<u8>, color: usize, alpha: usize) -> bool {
    let step = color + alpha;
    let mut seen = false;
    for i in 0..bytes.len() / step {
        seen |= bytes[i * step + color..(i + 1) * step].iter().any(|&b| b != 255);
        bytes.copy_within(i * step..i * step + color, i * color);
    }
    bytes.truncate(bytes.len() / step * color);
    seen
}
