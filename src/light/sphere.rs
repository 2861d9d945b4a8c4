//! Spheres, sampled by the cone that they fill.

use std::f64::consts::PI;

use glam::DVec3;

use super::LightSample;
use super::aim::{aim, lift, scaled};
use super::bounds::{Cone, LightBounds, strength};
use crate::color::Rgb;
use crate::math::Bounds;
use crate::math::concentric_disk;

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
        // The normal is yet to be drawn: the worst.
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
        let [a, b] = concentric_disk(u).to_array();
        let v = a * a + b * b;
        let (cos_phi, sin_phi) = if v > 0.0 { (a / v.sqrt(), b / v.sqrt()) } else { (1.0, 0.0) };
        let below = cap * v;
        let (cos, sin2) = (1.0 - below, below * (2.0 - below));
        // The angle at the sphere's centre between p and the nearer point on that line.
        let cos_alpha = sin2 / sin_max + cos * (1.0 - sin2 / sin2_max).max(0.0).sqrt();
        let sin_alpha = (1.0 - cos_alpha * cos_alpha).max(0.0).sqrt();
        let (x, y) = z.any_orthonormal_pair();
        let n = (x * cos_phi + y * sin_phi) * sin_alpha - z * cos_alpha;
        let target = self.center + n * self.radius;
        // From the lifted sphere to the target: x² + 2·x·r·cos θ = (r + lift)² − r².
        let rise = lift * (2.0 * self.radius + lift);
        let along = (p - target).normalize_or_zero().dot(n).max(0.0) * self.radius;
        let short = rise / (along + (along * along + rise).sqrt());
        aim(p, target, short, scaled(self.radiance, 2.0 * PI * cap))
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

#[cfg(test)]
mod tests {
    use super::super::Light;
    use super::super::oracle::{Random, assert_vector_irradiance, errors, tell};
    use super::*;

    fn lamp(radius: f64) -> SphereLight {
        SphereLight { center: DVec3::new(1.0, -2.0, 0.5), radius, radiance: Rgb::splat(1.0) }
    }

    #[test]
    fn irradiance_is_pi_times_the_squared_sine() {
        for radius in [1.0, 1e-3, 1e-7] {
            let light = lamp(radius);
            let mut random = Random::new(4);
            for distance in [1.001, 1.1, 3.0, 100.0, 1e6] {
                let away = random.direction();
                let p = (light.center + away * radius * distance).as_vec3().as_dvec3();
                let d = p.distance(light.center);
                // Close to a small sphere, p is within its own rounding of the surface.
                if d < radius * 1.0001 + 1e-5 {
                    continue;
                }
                let s = radius / d;
                let expected = (light.center - p) / d * PI * s * s;
                assert_vector_irradiance(&Light::Sphere(light.clone()), p, expected, 7);
            }
        }
    }

    #[test]
    fn samples_lie_on_the_side_that_is_seen() {
        let light = lamp(0.5);
        let mut random = Random::new(8);
        for _ in 0..10_000 {
            let p =
                light.center + random.direction() * (0.5 + 10f64.powf(random.between(-4.0, 3.0)));
            let s = light.sample(p, random.square().map(f64::from)).expect("outside");
            let target = p + s.direction.as_dvec3() * f64::from(s.distance);
            let off = target.distance(light.center) - light.radius;
            let d = p.distance(light.center);
            assert!(off > 0.0 && off < 1e-5 * (1.0 + d), "{off} at {d}");
            assert!((target - light.center).dot(p - target) >= -1e-5 * (1.0 + d), "seen from {p}");
        }
        assert_eq!(light.sample(light.center + DVec3::X * 0.4, [0.5; 2]), None, "inside");
        assert_eq!(light.sample(light.center, [0.5; 2]), None, "at the centre");
    }

    #[test]
    fn stratified_numbers_pay() {
        let light = lamp(1.0);
        let p = DVec3::new(0.25, 0.0, 0.5);
        let to_center = light.center - p;
        let s2 = 1.0 / to_center.length_squared();
        let n = (to_center.normalize() + DVec3::X * 0.3).normalize();
        let truth = PI * s2 * n.dot(to_center.normalize());
        let [many, many_even] = errors(&Light::Sphere(light), p, n, 1024, truth);
        tell(&format!("error of 1024 samples: random {many:.1e}, even {many_even:.1e}"));
        assert!(many_even < many / 10.0);
    }
}
