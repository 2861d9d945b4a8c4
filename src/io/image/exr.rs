//! OpenEXR: the channels R, G, B or Y, as [`crate::io::read_exr`] reads them, and as compact as they are.

use super::{ColorSpace, Decoded, File, linear};
use crate::io::error::ReadError;
use crate::io::exr_read;
use crate::texture::Pixels;

/// Decodes an OpenEXR file: what it holds is taken for the whole picture.
pub(super) fn decode(file: &File, space: ColorSpace) -> Result<Decoded, ReadError> {
    let picture = exr_read::decode(file.path, file.bytes)?;
    let mut warnings = Vec::new();
    if picture.origin != Some([0, 0]) || picture.extent != picture.size {
        warnings.push("its data window is not its display window; it was taken for all".to_owned());
    }
    let size = picture.extent.map(|n| n as usize);
    let bits = |x: f32| x.to_bits();
    let is_grey = picture.pixels.iter().all(|c| bits(c.r) == bits(c.g) && bits(c.g) == bits(c.b));
    let mut values: Vec<f32> = if is_grey {
        picture.pixels.iter().map(|c| c.r).collect()
    } else {
        picture.pixels.iter().flat_map(|c| c.to_array()).collect()
    };
    linear(space, &mut values);
    // Halves stay halves; what needs more is kept as it is.
    let is_half =
        values.iter().all(|x| !x.is_finite() || exr::prelude::f16::from_f32(*x).to_f32() == *x);
    let pixels = if is_half { Pixels::half_or_float(values) } else { Pixels::Float(values) };
    Ok(Decoded { size, channels: if is_grey { 1 } else { 3 }, pixels, warnings })
}
