//! JPEG (ITU-T T.81): baseline and progressive, grey and colour.

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace as Kind;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::{ColorSpace, Decoded, File, MAX_SIDE};
use crate::io::error::ReadError;
use crate::texture::Pixels;

/// Pixels that a byte of the file can stand for. A component takes a bit or more for each of its
/// blocks of 8 × 8; the coarsest sampling that is possible, two components of 4 × 1 and 1 × 4 blocks
/// to 32 × 32 pixels, has 8 blocks for 1024 pixels.
const EXPANSION: usize = 1024;

const START_OF_SCAN: u8 = 0xda;
const END_OF_IMAGE: u8 = 0xd9;

/// Decodes a JPEG; what is damaged is an error, not grey.
pub(super) fn decode(file: &File, space: ColorSpace) -> Result<Decoded, ReadError> {
    let options = DecoderOptions::new_safe()
        .set_strict_mode(true)
        .set_max_width(MAX_SIDE)
        .set_max_height(MAX_SIDE);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file.bytes), options);
    decoder.decode_headers().map_err(|error| file.damaged("JPEG", error))?;
    let info = decoder.info().ok_or_else(|| file.wrong("a JPEG file without a picture"))?;
    let size = [usize::from(info.width), usize::from(info.height)];
    file.check(size, 1, EXPANSION)?;
    let grey = decoder.input_colorspace() == Some(Kind::Luma);
    let (channels, kind) = if grey { (1, Kind::Luma) } else { (3, Kind::RGB) };
    decoder.set_options(options.jpeg_set_out_colorspace(kind));
    // The decoder itself fills what is missing of the last blocks with grey.
    let last = |marker| file.bytes.windows(2).rposition(|pair| pair == [0xff, marker]);
    if last(END_OF_IMAGE) < last(START_OF_SCAN) {
        return Err(file.wrong("the file ends too early: the end of the picture is missing"));
    }
    let bytes = decoder.decode().map_err(|error| file.damaged("JPEG", error))?;
    let pixels = match space {
        ColorSpace::Srgb => Pixels::Srgb8(bytes),
        ColorSpace::Linear => Pixels::Linear8(bytes),
    };
    Ok(Decoded { size, channels, pixels, warnings: Vec::new() })
}
