//! PNG: 8 bits a channel in sRGB, for looking at. Exposure is applied, then a tone curve.

use std::io::Write;
use std::path::Path;

use super::error::WriteError;
use super::output::write_whole;
use crate::color::{Rgb, srgb_from_linear};
use crate::film::{Film, Picture};

/// How light becomes what a display shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ToneMap {
    /// As it is; what is brighter than 1 is clipped.
    #[default]
    Srgb,
    /// A film's curve, with a toe and a shoulder: Narkowicz' fit of the one of ACES.
    Filmic,
}

impl ToneMap {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Srgb, Self::Filmic];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::Filmic => "filmic",
        }
    }

    /// The share of the display's light for a linear value: in [0, 1].
    ///
    /// Source of `Filmic`: Narkowicz, *ACES Filmic Tone Mapping Curve*, 2016.
    pub fn apply(self, x: f32) -> f32 {
        match self {
            Self::Srgb => x.clamp(0.0, 1.0),
            Self::Filmic => {
                // Beyond that the curve has long been at 1, and its squares overflow.
                let x = x.clamp(0.0, 1e6);
                let y = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
                y.clamp(0.0, 1.0)
            }
        }
    }
}

/// Writes the film as an sRGB PNG. `exposure` is in stops: +1 doubles all values.
///
/// # Errors
/// [`WriteError`] where the file cannot be written; the old one is then untouched.
pub fn write_png(
    path: &Path,
    film: &Film,
    exposure: f32,
    tone_map: ToneMap,
) -> Result<(), WriteError> {
    let size = [film.window.width(), film.window.height()];
    write_whole(path, |writer| {
        encode(writer, size, &film.mean, exposure, tone_map).map_err(|error| match error {
            png::EncodingError::IoError(e) => WriteError::io(path, "write", e),
            other => WriteError::format(path, other.to_string()),
        })
    })
}

/// A picture as the bytes of an sRGB PNG; none where it is larger than PNG holds.
pub fn png_bytes(picture: &Picture) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoded = encode(&mut bytes, picture.extent, &picture.pixels, 0.0, ToneMap::Srgb);
    if encoded.is_ok() { bytes } else { Vec::new() }
}

fn encode(
    writer: impl Write,
    [width, height]: [u32; 2],
    pixels: &[Rgb],
    exposure: f32,
    tone_map: ToneMap,
) -> Result<(), png::EncodingError> {
    let scale = exposure.exp2();
    let byte = |x: f32| (srgb_from_linear(tone_map.apply(x * scale)) * 255.0).round() as u8;
    let bytes: Vec<u8> = pixels.iter().flat_map(|c| c.to_array().map(byte)).collect();
    let mut encoder = png::Encoder::new(writer, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut encoder = encoder.write_header()?;
    encoder.write_image_data(&bytes)?;
    encoder.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_as_published() {
        // By hand: (0.18·(2.51·0.18 + 0.03)) / (0.18·(2.43·0.18 + 0.59) + 0.14) = 0.086724 / 0.324932.
        assert!((ToneMap::Filmic.apply(0.18) - 0.266_899).abs() < 1e-5);
        // (2.51 + 0.03) / (2.43 + 0.59 + 0.14) = 2.54 / 3.16.
        assert!((ToneMap::Filmic.apply(1.0) - 0.803_797).abs() < 1e-5);
        assert_eq!(ToneMap::Filmic.apply(0.0), 0.0);
        assert_eq!(ToneMap::Filmic.apply(f32::INFINITY), 1.0);
        assert_eq!([-1.0, 0.25, 7.0].map(|x| ToneMap::Srgb.apply(x)), [0.0, 0.25, 1.0]);
    }
}
