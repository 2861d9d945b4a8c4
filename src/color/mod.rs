//! Colour: linear Rec.709 triples, luminance, and the sRGB transfer curve at the edges (what a
//! person types as `#rrggbb`, what a PNG stores). Nothing in between is ever non-linear.

mod lanes;
mod spectrum;

use std::ops::{Add, AddAssign, Mul, MulAssign};

pub use lanes::RgbLanes;
pub use spectrum::{MAX_WEIGHT, VISIBLE_MAX, VISIBLE_MIN, Wavelength, cie_1931, rec709_from_xyz};

/// A linear Rec.709 triple: a reflectance, a radiance, an irradiance, as the name beside it says.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rgb {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

impl Rgb {
    /// Nothing.
    pub const BLACK: Self = Self::new(0.0, 0.0, 0.0);

    /// From its three components.
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self { r, g, b }
    }

    /// The same value in each component.
    pub const fn splat(value: f32) -> Self {
        Self::new(value, value, value)
    }

    /// As an array, red first.
    pub const fn to_array(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }

    /// Luminance, with the weights of Rec. ITU-R BT.709-6 §3.
    pub fn luminance(self) -> f32 {
        0.2126 * self.r + 0.7152 * self.g + 0.0722 * self.b
    }

    /// The largest component.
    #[inline]
    pub fn max_component(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    /// `f` of each component.
    #[inline]
    #[must_use]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self::new(f(self.r), f(self.g), f(self.b))
    }

    /// `f` of each component and its counterpart.
    #[inline]
    #[must_use]
    pub fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self::new(f(self.r, other.r), f(self.g, other.g), f(self.b, other.b))
    }

    /// Whether no component is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// Whether every component is zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self == Self::BLACK
    }
}

impl From<[f32; 3]> for Rgb {
    fn from([r, g, b]: [f32; 3]) -> Self {
        Self { r, g, b }
    }
}

impl Add for Rgb {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self::new(self.r + o.r, self.g + o.g, self.b + o.b)
    }
}

impl AddAssign for Rgb {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl Mul for Rgb {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self::new(self.r * o.r, self.g * o.g, self.b * o.b)
    }
}

impl Mul<f32> for Rgb {
    type Output = Self;
    #[inline]
    fn mul(self, k: f32) -> Self {
        Self::new(self.r * k, self.g * k, self.b * k)
    }
}

impl MulAssign for Rgb {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl MulAssign<f32> for Rgb {
    #[inline]
    fn mul_assign(&mut self, k: f32) {
        *self = *self * k;
    }
}

/// Linear light to an sRGB signal, both in [0, 1]. Source: IEC 61966-2-1, §4.2.
pub fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// An sRGB signal to linear light, both in [0, 1]. Source: IEC 61966-2-1, §4.2.
pub fn linear_from_srgb(x: f32) -> f32 {
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_srgb_curve_and_its_inverse_meet() {
        for i in 0..=255 {
            let signal = i as f32 / 255.0;
            assert!((srgb_from_linear(linear_from_srgb(signal)) - signal).abs() < 2e-6, "{i}");
        }
        // Mid grey: 18 % reflectance is 46.1 % signal.
        assert!((srgb_from_linear(0.18) - 0.4613).abs() < 1e-4);
    }

    #[test]
    fn white_has_luminance_one() {
        assert!((Rgb::splat(1.0).luminance() - 1.0).abs() < 1e-6);
    }
}
