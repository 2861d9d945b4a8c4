//! Pictures from files, for textures: PNG, JPEG, Radiance HDR and OpenEXR.
//!
//! The decoders know the formats; here is what does not depend on the format: which decoder, limits,
//! what was repaired. Colours are taken for Rec.709: gamma values, chromaticities and colour
//! profiles in files are not looked at. Alpha is ignored: PNG's colours are as they are stored, those
//! of OpenEXR are already multiplied by it.

mod exr;
mod jpeg;
mod png;
mod radiance;

use std::path::Path;

use super::error::ReadError;
use super::source::Source;
use crate::color::linear_from_srgb;
use crate::texture::{ImageData, Pixels};

/// What the numbers of a picture file mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// sRGB signals, as pictures of 8 and 16 bits mostly have.
    Srgb,
    /// What they say: light, heights, directions.
    Linear,
}

impl ColorSpace {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Srgb, Self::Linear];

    /// The name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::Linear => "linear",
        }
    }
}

/// A picture as read, with what the user should know about it.
#[derive(Debug, Clone)]
pub struct ImageFile {
    /// The picture: linear once its pixels are decoded.
    pub image: ImageData,
    /// What was ignored or repaired: one sentence each, without the file's name.
    pub warnings: Vec<String>,
}

/// Largest side of a picture, in pixels.
const MAX_SIDE: usize = 65_535;

/// Most pixels of a picture.
const MAX_PIXELS: usize = 1 << 28;

/// Reads a PNG, JPEG, Radiance HDR or OpenEXR file, told apart by its first bytes.
///
/// `space` says what the numbers mean; with `None` those of PNG and JPEG are sRGB signals, those of
/// Radiance HDR and OpenEXR linear. Normal and bump maps want [`ColorSpace::Linear`]. Values that are
/// NaN or infinite become 0, with a warning.
///
/// # Errors
/// If the file cannot be read, is of another kind, is damaged or cut short, or has more than 65,535
/// pixels a side or 2²⁸ in all.
pub fn read_image(path: &Path, space: Option<ColorSpace>) -> Result<ImageFile, ReadError> {
    let source = Source::open(path)?;
    // Other files may be of any size.
    let mut start = [0; 4];
    let known = source.len.min(4) as usize;
    source.read_at(&mut start[..known], 0)?;
    kind(path, &start)?;
    decode(path, &source.read_from(0)?, space)
}

/// What every PNG file begins with.
pub(super) const PNG_SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// The numbers of a PNG file as they are, 0 to 1, sRGB signals though they be.
pub(super) fn decode_png(path: &Path, bytes: &[u8]) -> Result<ImageData, ReadError> {
    let file = File { path, bytes };
    let Decoded { size, channels, pixels, .. } = png::decode(&file, ColorSpace::Linear)?;
    ImageData::new(size.map(|n| n as u32), channels, pixels)
        .ok_or_else(|| file.wrong("its pixels are fewer or more than its size says"))
}

/// The decoder for a file that begins with `start`, and what its numbers usually mean.
fn kind(path: &Path, start: &[u8]) -> Result<(Decoder, ColorSpace), ReadError> {
    match start {
        [0x89, b'P', b'N', b'G', ..] => Ok((png::decode, ColorSpace::Srgb)),
        [0xff, 0xd8, 0xff, ..] => Ok((jpeg::decode, ColorSpace::Srgb)),
        [b'#', b'?', ..] => Ok((radiance::decode, ColorSpace::Linear)),
        [0x76, 0x2f, 0x31, 0x01, ..] => Ok((exr::decode, ColorSpace::Linear)),
        _ => Err(ReadError::file(
            path,
            "not a picture of a known kind; accepted: PNG, JPEG, Radiance HDR, OpenEXR",
        )),
    }
}

fn decode(path: &Path, bytes: &[u8], space: Option<ColorSpace>) -> Result<ImageFile, ReadError> {
    let (decode, usual) = kind(path, bytes)?;
    let file = File { path, bytes };
    let Decoded { size, channels, pixels, mut warnings } = decode(&file, space.unwrap_or(usual))?;
    let image = ImageData::new(size.map(|n| n as u32), channels, pixels)
        .ok_or_else(|| file.wrong("its pixels are fewer or more than its size says"))?;
    if image.zeroed() > 0 {
        let values = if image.zeroed() == 1 { "value is" } else { "values are" };
        warnings.push(format!("{} {values} NaN or infinite and became 0", image.zeroed()));
    }
    Ok(ImageFile { image, warnings })
}

type Decoder = fn(&File, ColorSpace) -> Result<Decoded, ReadError>;

/// A file to decode.
struct File<'a> {
    path: &'a Path,
    bytes: &'a [u8],
}

/// What a decoder makes of a file.
struct Decoded {
    /// Width and height, checked by [`File::check`].
    size: [usize; 2],
    /// 1 or 3.
    channels: usize,
    pixels: Pixels,
    warnings: Vec<String>,
}

impl File<'_> {
    fn wrong(&self, message: impl Into<String>) -> ReadError {
        ReadError::file(self.path, message)
    }

    /// The decoder's own words.
    fn damaged(&self, kind: &str, error: impl std::fmt::Display) -> ReadError {
        self.wrong(format!("damaged or cut short, or not a {kind} file: {error}"))
    }

    /// Checks a claimed size, before memory is asked for: the limits, and that the file is long
    /// enough for so much. `expansion` is how many bytes of `bytes_per_pixel` a pixel the format
    /// can make of one byte of the file at most.
    fn check(
        &self,
        [width, height]: [usize; 2],
        bytes_per_pixel: usize,
        expansion: usize,
    ) -> Result<(), ReadError> {
        if width == 0 || height == 0 {
            return Err(self.wrong(format!("the picture has no pixels: {width} x {height}")));
        }
        if width > MAX_SIDE || height > MAX_SIDE || width * height > MAX_PIXELS {
            return Err(self.wrong(format!(
                "{width} x {height} pixels; at most {MAX_SIDE} a side and {MAX_PIXELS} in all are \
                 possible"
            )));
        }
        let needed = (width * height).saturating_mul(bytes_per_pixel) / expansion;
        if needed > self.bytes.len() {
            return Err(self.wrong(format!(
                "the file ends too early: {width} x {height} pixels need {needed} bytes or more, it \
                 has {}",
                self.bytes.len()
            )));
        }
        Ok(())
    }
}

/// Floats as [`Pixels`] of what they mean.
fn linear(space: ColorSpace, values: &mut [f32]) {
    if space == ColorSpace::Srgb {
        for x in values {
            *x = linear_from_srgb(x.abs()).copysign(*x);
        }
    }
}

#[cfg(test)]
mod tests;
