//! The pixels of a picture, as compact as its file holds them.

use std::sync::LazyLock;

use crate::color::{Rgb, linear_from_srgb};

/// Values of pixels, channel by channel: r, g, b, r, … or one value a pixel.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// 0 to 255 is an sRGB signal from 0 to 1.
    Srgb8(Vec<u8>),
    /// 0 to 255 is 0 to 1, linearly.
    Linear8(Vec<u8>),
    /// 0 to 65535 is 0 to 1, linearly.
    Linear16(Vec<u16>),
    /// Bits of IEEE 754 half floats; see [`Pixels::half_or_float`].
    Half(Vec<u16>),
    /// Floats.
    Float(Vec<f32>),
}

impl Pixels {
    /// Half floats, where none of `values` is beyond their range (±65504), else floats.
    ///
    /// The values keep eleven bits; those of magnitude below 6·10⁻⁵ keep multiples of 6·10⁻⁸.
    pub fn half_or_float(values: Vec<f32>) -> Self {
        if values.iter().any(|x| x.is_finite() && x.abs() > MAX_HALF) {
            return Self::Float(values);
        }
        Self::Half(values.into_iter().map(half_from_float).collect())
    }

    /// The number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::Srgb8(v) | Self::Linear8(v) => v.len(),
            Self::Linear16(v) | Self::Half(v) => v.len(),
            Self::Float(v) => v.len(),
        }
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of memory that the values take.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Srgb8(v) | Self::Linear8(v) => v.len(),
            Self::Linear16(v) | Self::Half(v) => 2 * v.len(),
            Self::Float(v) => 4 * v.len(),
        }
    }

    /// The values as they are in memory.
    pub fn as_bytes(&self) -> &[u8] {
        match self {
            Self::Srgb8(v) | Self::Linear8(v) => v,
            Self::Linear16(v) | Self::Half(v) => bytemuck::cast_slice(v),
            Self::Float(v) => bytemuck::cast_slice(v),
        }
    }

    /// Sets what is NaN or infinite to 0; returns how many values that were.
    fn zero_non_finite(&mut self) -> usize {
        fn zero<T: Copy + Default>(values: &mut [T], bad: impl Fn(T) -> bool) -> usize {
            let mut count = 0;
            for x in values.iter_mut().filter(|x| bad(**x)) {
                *x = T::default();
                count += 1;
            }
            count
        }
        match self {
            Self::Srgb8(_) | Self::Linear8(_) | Self::Linear16(_) => 0,
            Self::Half(v) => zero(v, |h| h & 0x7c00 == 0x7c00),
            Self::Float(v) => zero(v, |x| !x.is_finite()),
        }
    }
}

/// A picture in memory: one or three channels, the rows from the top down as files have them.
#[derive(Debug, Clone)]
pub struct ImageData {
    size: [u32; 2],
    channels: usize,
    pixels: Pixels,
    zeroed: usize,
    /// What each byte means, for pixels of 8 bits.
    bytes: &'static [f32; 256],
}

impl ImageData {
    /// Makes a picture `size` = [width, height] of `channels` (1 or 3); values that are NaN or
    /// infinite become 0.
    ///
    /// `None` where a side is 0, the number of channels is another, or the number of values is not
    /// what these say.
    pub fn new(size: [u32; 2], channels: usize, mut pixels: Pixels) -> Option<Self> {
        let [width, height] = size.map(|n| n as usize);
        let count = width.checked_mul(height)?.checked_mul(channels)?;
        if count == 0 || !matches!(channels, 1 | 3) || count != pixels.len() {
            return None;
        }
        let zeroed = pixels.zero_non_finite();
        let bytes = if matches!(pixels, Pixels::Srgb8(_)) { &*SRGB } else { &*LINEAR };
        Some(Self { size, channels, pixels, zeroed, bytes })
    }

    /// Width and height in pixels, at least 1.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The number of channels: 1 or 3.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The values as they are stored.
    pub fn pixels(&self) -> &Pixels {
        &self.pixels
    }

    /// How many values were NaN or infinite and became 0.
    pub fn zeroed(&self) -> usize {
        self.zeroed
    }

    /// The linear colour of the pixel in column `x` of row `y`, counted from the top left; beyond
    /// the edges that of the nearest pixel. The one channel of a grey picture is all three.
    #[inline]
    pub fn texel(&self, x: usize, y: usize) -> Rgb {
        let [width, height] = self.size.map(|n| n as usize);
        let i = (y.min(height - 1) * width + x.min(width - 1)) * self.channels;
        if self.channels == 1 {
            return Rgb::splat(self.value(i));
        }
        Rgb::new(self.value(i), self.value(i + 1), self.value(i + 2))
    }

    /// The linear value at index `i` of the pixels.
    #[inline]
    pub(super) fn value(&self, i: usize) -> f32 {
        match &self.pixels {
            Pixels::Srgb8(v) | Pixels::Linear8(v) => self.bytes[usize::from(v[i])],
            Pixels::Linear16(v) => f32::from(v[i]) * (1.0 / 65535.0),
            Pixels::Half(v) => float_from_half(v[i]),
            Pixels::Float(v) => v[i],
        }
    }
}

/// What a byte means as an sRGB signal.
static SRGB: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// What a byte means as it is.
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| i as f32 / 255.0));

/// The largest half float.
const MAX_HALF: f32 = 65504.0;

/// The float that the bits of a finite half float stand for.
#[inline]
fn float_from_half(half: u16) -> f32 {
    // Exponent and mantissa moved to where a float has them; the biases differ by 112. Exact.
    let magnitude = f32::from_bits(u32::from(half & 0x7fff) << 13) * TWO_TO_112;
    f32::from_bits(magnitude.to_bits() | u32::from(half & 0x8000) << 16)
}

/// The bits of the half float nearest to `x`, ties to even; what is not finite stays so.
pub(super) fn half_from_float(x: f32) -> u16 {
    let sign = (x.to_bits() >> 16) as u16 & 0x8000;
    if !x.is_finite() {
        return sign | 0x7c00 | u16::from(x.is_nan());
    }
    let bits = (x.abs().min(MAX_HALF) / TWO_TO_112).to_bits();
    sign | ((bits + 0xfff + (bits >> 13 & 1)) >> 13) as u16
}

/// 2¹¹².
const TWO_TO_112: f32 = f32::from_bits((112 + 127) << 23);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_floats_are_those_of_ieee_754() {
        for (bits, value) in [
            (0x0000, 0.0),
            (0x0001, 2.0_f32.powi(-24)),
            (0x03ff, 1023.0 * 2.0_f32.powi(-24)),
            (0x0400, 2.0_f32.powi(-14)),
            (0x3c00, 1.0),
            (0x3c01, 1.0 + 1.0 / 1024.0),
            (0xc000, -2.0),
            (0x7bff, MAX_HALF),
        ] {
            assert_eq!(float_from_half(bits), value, "{bits:#06x}");
        }
        // All that are finite come back.
        for bits in (0..=u16::MAX).filter(|h| h & 0x7c00 != 0x7c00) {
            assert_eq!(half_from_float(float_from_half(bits)), bits, "{bits:#06x}");
        }
        // Halfway between two: to the even one.
        assert_eq!(half_from_float(1.0 + 1.0 / 2048.0), 0x3c00);
        assert_eq!(half_from_float(1.0 + 3.0 / 2048.0), 0x3c02);
        assert_eq!(half_from_float(f32::INFINITY), 0x7c00);
        assert_eq!(half_from_float(f32::NAN) & 0x7fff, 0x7c01);
    }

    #[test]
    fn values_are_decoded_as_their_kind_says() {
        let value = |pixels| ImageData::new([1, 1], 1, pixels).map(|d| d.texel(0, 0).r);
        assert_eq!(value(Pixels::Srgb8(vec![255])), Some(1.0));
        assert_eq!(value(Pixels::Srgb8(vec![188])), Some(linear_from_srgb(188.0 / 255.0)));
        assert_eq!(value(Pixels::Linear8(vec![51])), Some(0.2));
        assert_eq!(value(Pixels::Linear16(vec![65535])), Some(1.0));
        assert_eq!(value(Pixels::half_or_float(vec![0.375])), Some(0.375));
        assert_eq!(value(Pixels::half_or_float(vec![1e6])), Some(1e6));
    }

    #[test]
    fn what_is_not_finite_becomes_zero_and_is_counted() {
        let values = vec![f32::NAN, 0.5, f32::NEG_INFINITY];
        for pixels in [Pixels::Float(values.clone()), Pixels::half_or_float(values)] {
            let data = ImageData::new([1, 1], 3, pixels).unwrap();
            assert_eq!(data.texel(0, 0), Rgb::new(0.0, 0.5, 0.0));
            assert_eq!(data.zeroed(), 2);
        }
    }

    #[test]
    fn sizes_must_agree() {
        let new = |size, channels, n| ImageData::new(size, channels, Pixels::Linear8(vec![0; n]));
        assert!(new([2, 3], 1, 6).is_some() && new([2, 3], 3, 18).is_some());
        assert!(new([2, 3], 1, 5).is_none() && new([2, 3], 2, 12).is_none());
        assert!(new([0, 3], 1, 0).is_none());
        assert!(new([u32::MAX; 2], 3, 4).is_none());
    }
}
