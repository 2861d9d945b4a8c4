//! Vectors side by side.

use glam::{DVec3, Vec3};

/// `N` vectors by axis. Loops over its lanes without branches become vector instructions.
// Aligned, so that what they load lies in one line of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
#[expect(missing_docs, reason = "said above")]
pub struct Vec3Lanes<const N: usize> {
    pub x: [f32; N],
    pub y: [f32; N],
    pub z: [f32; N],
}

impl<const N: usize> Vec3Lanes<N> {
    /// Zero everywhere.
    pub const ZERO: Self = Self { x: [0.0; N], y: [0.0; N], z: [0.0; N] };

    /// One vector everywhere.
    #[inline(always)]
    pub const fn splat(v: Vec3) -> Self {
        Self { x: [v.x; N], y: [v.y; N], z: [v.z; N] }
    }

    /// The vector of a lane.
    #[inline(always)]
    pub const fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Sets the vector of a lane.
    #[inline(always)]
    pub const fn set(&mut self, lane: usize, v: Vec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }
}

/// The lanes, up to sixteen, whose flag is set, as bits.
#[inline(always)]
pub(crate) fn lanes_where<const N: usize>(flags: &[bool; N]) -> u16 {
    (0..N).fold(0, |bits, lane| bits | u16::from(flags[lane]) << lane)
}

/// The vector at unit length, or zero where it has no direction: [`DVec3::normalize_or_zero`] without a
/// branch, which would keep a loop over lanes from becoming vector instructions.
#[inline(always)]
pub fn unit_or_zero(v: DVec3) -> DVec3 {
    let scale = v.length_recip();
    // Neither infinite nor NaN.
    let is_direction = (scale > 0.0) & (scale <= f64::MAX);
    let of = |x: f64| if is_direction { x * scale } else { 0.0 };
    DVec3::new(of(v.x), of(v.y), of(v.z))
}
