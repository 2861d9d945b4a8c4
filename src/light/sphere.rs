//! Spheres, sampled by the cone that they fill.

use std::f64::consts::PI;

use glam::DVec3;

use super::LightSample;
use super::aim::{aim, concentric, lift, scaled};
use super::bounds::{Cone, LightBounds, strength};
use crate::color::Rgb;
use crate::math::Bounds;

/// A sphere of constant radiance that shines outward. There is no light from it inside.
#[derive(Debug, Clone, PartialEq)]
pub struct SphereLight {
    /// Centre, relative to the scene's centre.
    pub center: DVec3,
    /// Radius, m.
    pub radius: f64,
    /// Radiance L, W·m⁻²·sr⁻¹.
    pub radiance: Rgb,
}

impl SphereLight {
    /// Area, m².
    pub fn area(&self) -> f64 {
        4.0 * PI * self.radius * self.radius
    }

    /// Uniform in the cone of directions that meet the sphere.
    ///
    /// With s = sin²θ_max = r²/d², 1 − cosθ_max = s/(1 + cosθ_max): no difference of near-equal numbers
    /// however small the sphere looks. The rest follows pbrt 4ed §6.2.4.
    #[inline]
    pub(super) fn sample(&self, p: DVec3, u: [f64; 2]) -> Option<LightSample> {
        let to_center = self.center - p;
        let d = to_center.length();
        let z = to_center / d;
        let size = self.center.abs().max_element() + self.radius;
        // Not along the normal that is to be drawn, but along the worst.
        let worst = DVec3::splat(1.0 / 3f64.sqrt());
        let lift = lift(size, to_center.abs().max_element() + self.radius, worst);
        // Inside, on it, or without a size; also refuses NaN.
        if !(d > self.radius + lift && self.radius > 0.0) {
            return None;
        }
        let sin_max = self.radius / d;
        let sin2_max = sin_max * sin_max;
        let cos_max = ((1.0 - sin_max) * (1.0 + sin_max)).sqrt();
        let cap = sin2_max / (1.0 + cos_max);

        // Squared distances from the centre of the unit disk are uniform in [0, 1).
        let [a, b] = concentric(u);
        let v = a * a + b * b;
        let (cos_phi, sin_phi) = if v > 0.0 { (a / v.sqrt(), b / v.sqrt()) } else { (1.0, 0.0) };
        let below = cap * v;
        let (cos, sin2) = (1.0 - below, below * (2.0 - below));
        // The angle at the sphere's centre between p and the nearer point on that line.
        let cos_alpha = sin2 / sin_max + cos * (1.0 - sin2 / sin2_max).max(0.0).sqrt();
        let sin_alpha = (1.0 - cos_alpha * cos_alpha).max(0.0).sqrt();
        let (x, y) = z.any_orthonormal_pair();
        let n = (x * cos_phi + y * sin_phi) * sin_alpha - z * cos_alpha;
        let target = self.center + n * (self.radius + lift);
        aim(p, target, scaled(self.radiance, 2.0 * PI * cap))
    }

    pub(super) fn bounds(&self) -> LightBounds {
        let half = DVec3::splat(self.radius);
        LightBounds {
            bounds: Bounds { min: self.center - half, max: self.center + half },
            radius: self.radius,
            cone: Cone::ALL,
            falloff: 0.0,
            intensity: strength(self.radiance) * 0.25 * self.area(),
        }
    }
}
