//! Reading pictures back, of either kind.

use std::path::Path;

use super::error::ReadError;
use super::source::Source;
use super::{exr_read, png_read};
use crate::film::Picture;

/// Most pixels of a picture that is read: a file of some kilobytes may truly hold more, all black.
const MOST_PIXELS: u64 = 1 << 28;

/// Reads an EXR or a PNG file, whichever its first bytes say it is, as [`super::read_exr`] and
/// [`super::read_png`] do.
///
/// # Errors
/// [`ReadError`] where it cannot be read, is neither, or is not sound.
pub fn read_picture(path: &Path) -> Result<Picture, ReadError> {
    let bytes = Source::open(path)?.read_from(0)?;
    if bytes.starts_with(&exr_read::SIGNATURE) {
        exr_read::decode(path, &bytes)
    } else if bytes.starts_with(&png_read::SIGNATURE) {
        png_read::decode(path, &bytes)
    } else {
        Err(ReadError::file(path, "unknown kind of picture; accepted: EXR, PNG"))
    }
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
