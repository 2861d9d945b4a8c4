//! Reading pictures back, of either kind.

use std::path::Path;

use super::error::ReadError;
use super::exr_read::PictureChannels;
use super::source::Source;
use super::{exr_read, image};
use crate::color::linear_from_srgb;
use crate::film::Picture;

/// Most pixels of a picture that is read: a file of some kilobytes may truly hold more, all black.
const MOST_PIXELS: u64 = 1 << 28;

/// An EXR or a PNG file, whichever its first bytes say it is, read once.
pub struct PictureFile<'a> {
    path: &'a Path,
    bytes: Vec<u8>,
    is_exr: bool,
}

impl<'a> PictureFile<'a> {
    /// Reads it.
    ///
    /// # Errors
    /// [`ReadError`] where it cannot be read, or is neither.
    pub fn read(path: &'a Path) -> Result<Self, ReadError> {
        let bytes = Source::open(path)?.read_from(0)?;
        let is_exr = bytes.starts_with(&exr_read::SIGNATURE);
        if !is_exr && !bytes.starts_with(&image::PNG_SIGNATURE) {
            return Err(ReadError::file(path, "unknown kind of picture; accepted: EXR, PNG"));
        }
        Ok(Self { path, bytes, is_exr })
    }

    /// Its colours, as [`super::read_exr`] and [`read_png`] give them.
    ///
    /// # Errors
    /// [`ReadError`] where it is not sound.
    pub fn picture(&self) -> Result<Picture, ReadError> {
        if self.is_exr {
            exr_read::decode(self.path, &self.bytes)
        } else {
            decode_png(self.path, &self.bytes)
        }
    }

    /// All channels of an EXR file, or the three colours of a PNG file.
    ///
    /// # Errors
    /// [`ReadError`] where it is not sound, or is an EXR file of several parts.
    pub fn channels(&self) -> Result<PictureChannels, ReadError> {
        if self.is_exr {
            return exr_read::decode_channels(self.path, &self.bytes);
        }
        let Picture { extent, origin, pixels, .. } = self.picture()?;
        let values = |i: usize| pixels.iter().map(|c| c.to_array()[i]).collect();
        let colours = COLOURS.into_iter().enumerate();
        let channels = colours.map(|(i, name)| (name.to_owned(), values(i))).collect();
        Ok(PictureChannels { extent, origin, channels, attributes: Vec::new() })
    }

    /// The names of what [`PictureFile::channels`] gives.
    ///
    /// # Errors
    /// As it.
    pub fn channel_names(&self) -> Result<Vec<String>, ReadError> {
        if self.is_exr {
            exr_read::decode_channel_names(self.path, &self.bytes)
        } else {
            Ok(COLOURS.map(str::to_owned).into())
        }
    }
}

/// Reads the colours of an EXR or a PNG file.
///
/// # Errors
/// [`ReadError`] where it cannot be read, is neither, or is not sound.
pub fn read_picture(path: &Path) -> Result<Picture, ReadError> {
    PictureFile::read(path)?.picture()
}

/// The channels of a picture that has only colours.
const COLOURS: [&str; 3] = ["R", "G", "B"];

/// Reads a PNG file of 1 to 16 bits a channel, in grey, colour or with a palette. Its values are taken as
/// sRGB, whatever the file says of its gamma; alpha is left out, and of an animation all but the first
/// picture.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, or is not a sound PNG file.
pub fn read_png(path: &Path) -> Result<Picture, ReadError> {
    decode_png(path, &Source::open(path)?.read_from(0)?)
}

fn decode_png(path: &Path, bytes: &[u8]) -> Result<Picture, ReadError> {
    // As numbers first, which keeps all 16 bits of those that have them.
    let image = image::decode_png(path, bytes)?;
    let size = image.size();
    let [width, height] = size.map(|n| n as usize);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let pixels = pixels.map(|(x, y)| image.texel(x, y).map(linear_from_srgb)).collect();
    Ok(Picture { size, extent: size, origin: None, pixels })
}

/// Refuses pictures that are empty or beyond [`MOST_PIXELS`], and those whose `packed` bytes cannot hold
/// their `unpacked` ones, as the compression makes one of at most `ratio`. Returns the number of pixels.
pub(super) fn check_size(
    path: &Path,
    [width, height]: [u32; 2],
    unpacked: u128,
    packed: usize,
    ratio: u128,
) -> Result<usize, ReadError> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 {
        return Err(ReadError::file(path, "the picture has no pixels"));
    }
    if pixels > MOST_PIXELS {
        let message = format!("{width} x {height} pixels; accepted: at most {MOST_PIXELS} in all");
        return Err(ReadError::file(path, message));
    }
    // Something for headers that are smaller than what they describe.
    if unpacked > packed as u128 * ratio + (1 << 16) {
        let message = format!(
            "the file of {packed} bytes is too short for a picture of {width} x {height} pixels"
        );
        return Err(ReadError::file(path, message));
    }
    usize::try_from(pixels)
        .map_err(|_| ReadError::file(path, "the picture does not fit into memory"))
}
