//! PNG: 8 bits a channel in sRGB, for looking at. Exposure is applied, then values are clipped.

use std::path::Path;

use super::error::WriteError;
use super::output::write_whole;
use crate::color::{Rgb, srgb_from_linear};
use crate::film::Film;

/// Writes the film as an sRGB PNG. `exposure` is in stops: +1 doubles all values.
///
/// # Errors
/// [`WriteError`] where the file cannot be written; the old one is then untouched.
pub fn write_png(path: &Path, film: &Film, exposure: f32) -> Result<(), WriteError> {
    let scale = exposure.exp2();
    let byte = |x: f32| (srgb_from_linear((x * scale).clamp(0.0, 1.0)) * 255.0).round() as u8;
    let bytes: Vec<u8> = film.mean.iter().flat_map(|c: &Rgb| c.to_array().map(byte)).collect();
    write_whole(path, |writer| {
        let failed = |error: png::EncodingError| match error {
            png::EncodingError::IoError(e) => WriteError::io(path, "write", e),
            other => WriteError::format(path, other.to_string()),
        };
        let mut encoder = png::Encoder::new(writer, film.window.width(), film.window.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut encoder = encoder.write_header().map_err(failed)?;
        encoder.write_image_data(&bytes).map_err(failed)?;
        encoder.finish().map_err(failed)
    })
}
