//! Disks.

use glam::DVec3;

use super::LightSample;
use super::aim::{aim, lift, scaled};
use super::bounds::{Cone, LightBounds, strength};
use crate::color::Rgb;
use crate::math::Bounds;
use crate::math::concentric_disk;

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
        let [s, t] = concentric_disk(u).to_array();
        let offset = (x * s + y * t) * self.radius;
        let target = self.center + offset;
        let d = target.distance(p);
        // L·A·cos θ/d², cos θ = height/d.
        let irradiance = scaled(self.radiance, self.area() / d * (height / d) / d);
        aim(p, target, d * (lift / height), irradiance)
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

#[cfg(test)]
mod tests {
    use super::super::Light;
    use super::super::oracle::{
        Estimate, Random, assert_vector_irradiance, errors, tell, vector_irradiance,
    };
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn ceiling() -> DiskLight {
        DiskLight {
            center: DVec3::new(0.5, 1.0, -0.25),
            normal: DVec3::NEG_Y,
            radius: 0.75,
            radiance: Rgb::splat(1.0),
        }
    }

    /// The vector irradiance of a polygon of so many corners that it differs by 10⁻⁷.
    fn expected(light: &DiskLight, p: DVec3) -> DVec3 {
        let corners: Vec<DVec3> = (0..8192)
            .map(|i| {
                let (sin, cos) = (TAU * f64::from(i) / 8192.0).sin_cos();
                light.center + DVec3::new(cos, 0.0, -sin) * light.radius
            })
            .collect();
        let vector = vector_irradiance(&corners, p);
        if vector.y < 0.0 { -vector } else { vector }
    }

    #[test]
    fn below_the_centre() {
        let light = ceiling();
        for distance in [0.05, 0.5, 1.0, 20.0] {
            let p = (light.center - DVec3::Y * distance).as_vec3();
            let mut random = Random::new(1);
            let estimate = Estimate::of(100_000, |_| {
                let s = light.sample(p.as_dvec3(), random.square().map(f64::from)).unwrap();
                f64::from(s.irradiance.r * s.direction.y)
            });
            let (r2, d2) = (light.radius * light.radius, distance * distance);
            let closed = PI * r2 / (r2 + d2);
            assert!(estimate.agrees_with(closed), "{distance}: {estimate:?}, not {closed}");
            assert!((expected(&light, p.as_dvec3()).y - closed).abs() < 1e-6 * closed);
        }
    }

    #[test]
    fn samples_average_to_the_vector_irradiance() {
        let light = ceiling();
        for p in [DVec3::ZERO, DVec3::new(2.0, 0.75, 1.0), DVec3::new(10.0, -50.0, 0.0)] {
            assert_vector_irradiance(&Light::Disk(light.clone()), p, expected(&light, p), 6);
        }
        assert_eq!(light.sample(DVec3::new(0.5, 1.5, 0.0), [0.5; 2]), None, "behind it");
        assert_eq!(light.sample(DVec3::new(5.0, 1.0, 0.0), [0.5; 2]), None, "in its plane");
    }

    #[test]
    fn stratified_numbers_pay() {
        let light = ceiling();
        let truth = expected(&light, DVec3::ZERO).y;
        let light = Light::Disk(light);
        let [many, many_even] = errors(&light, DVec3::ZERO, DVec3::Y, 1024, truth);
        tell(&format!("error of 1024 samples: random {many:.1e}, even {many_even:.1e}"));
        assert!(many_even < many / 10.0);
    }
}
