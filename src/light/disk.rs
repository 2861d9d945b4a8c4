//! Disks.

use glam::DVec3;

use super::LightSample;
use super::aim::{aim, concentric, lift, scaled};
use super::bounds::{Cone, LightBounds, strength};
use crate::color::Rgb;
use crate::math::Bounds;

/// A disk of constant radiance that shines to one side.
#[derive(Debug, Clone, PartialEq)]
pub struct DiskLight {
    /// Centre, relative to the scene's centre.
    pub center: DVec3,
    /// The side that light leaves to, unit length.
    pub normal: DVec3,
    /// Radius, m.
    pub radius: f64,
    /// Radiance L, W·m⁻²·sr⁻¹.
    pub radiance: Rgb,
}

impl DiskLight {
    /// Area, m².
    pub fn area(&self) -> f64 {
        std::f64::consts::PI * self.radius * self.radius
    }

    /// Uniform by area.
    #[inline]
    pub(super) fn sample(&self, p: DVec3, u: [f64; 2]) -> Option<LightSample> {
        let n = self.normal;
        let to_center = self.center - p;
        let height = -to_center.dot(n);
        let size = self.center.abs().max_element() + self.radius;
        let lift = lift(size, to_center.abs().max_element() + self.radius, n);
        // Behind it or in its plane; also refuses NaN.
        if !(height > lift) {
            return None;
        }
        let (x, y) = n.any_orthonormal_pair();
        let [s, t] = concentric(u);
        let offset = (x * s + y * t) * self.radius;
        let d2 = (to_center + offset).length_squared();
        // cos θ = height/d.
        let irradiance = scaled(self.radiance, self.area() / d2 * (height / d2.sqrt()));
        aim(p, self.center + offset + n * lift, irradiance)
    }

    pub(super) fn bounds(&self) -> LightBounds {
        let half = (DVec3::ONE - self.normal * self.normal).max(DVec3::ZERO);
        let half = half.map(f64::sqrt) * self.radius;
        LightBounds {
            bounds: Bounds { min: self.center - half, max: self.center + half },
            radius: self.radius,
            cone: Cone { axis: self.normal, half_angle: 0.0 },
            falloff: std::f64::consts::FRAC_PI_2,
            intensity: strength(self.radiance) * self.area(),
        }
    }
}
