//! Flat disks and rings, solved in f64.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec2, DVec3};

use super::shape::longitude;
use super::{AnalyticShape, Parameters, SampledPoint, ShapeHit, ShapePoint};
use crate::math::Bounds;

/// A flat disk, or the ring that is left of it without a smaller one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disk {
    /// Centre.
    pub center: DVec3,
    /// Unit normal of its front.
    pub normal: DVec3,
    /// Radius, > 0.
    pub radius: f64,
    /// Radius of the hole, ≥ 0.
    pub inner_radius: f64,
}

impl AnalyticShape for Disk {
    fn bounds(&self) -> Bounds {
        // Along each axis it reaches r·√(1 − n²).
        let reach = (DVec3::ONE - self.normal * self.normal).max(DVec3::ZERO);
        let reach = reach.map(f64::sqrt) * self.radius;
        Bounds { min: self.center - reach, max: self.center + reach }
    }

    /// A ray within its plane has no hit.
    #[inline]
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let to_center = self.center - origin;
        let t = to_center.dot(self.normal) / direction.dot(self.normal);
        let off = (direction * t - to_center).length_squared();
        // Also refuses NaN.
        let is_on =
            off <= self.radius * self.radius && off >= self.inner_radius * self.inner_radius;
        (t > t_min && t <= t_max && is_on).then_some(ShapeHit::at(t))
    }

    fn surface_at(&self, p: DVec3, _part: u8) -> ShapePoint {
        let position = p - self.normal * (p - self.center).dot(self.normal);
        ShapePoint { position, normal: self.normal }
    }

    /// u runs around the normal, v from the hole (or the centre) to the rim.
    fn parameters(&self, p: DVec3, _part: u8) -> Parameters {
        let turn = DQuat::from_rotation_arc(DVec3::Y, self.normal);
        let inner = turn.inverse() * (p - self.center);
        let (u, dp_du) = longitude(inner);
        let r = inner.x.hypot(inner.z);
        let width = self.radius - self.inner_radius;
        let outward = if r > 0.0 { DVec3::new(inner.x, 0.0, inner.z) / r } else { DVec3::Z };
        Parameters {
            uv: DVec2::new(u, (r - self.inner_radius) / width),
            dp_du: turn * dp_du,
            dp_dv: turn * outward * width,
        }
    }

    fn curvature(&self, _p: DVec3, _part: u8) -> f64 {
        0.0
    }

    fn sampled_parts(&self) -> u8 {
        1
    }

    fn sample_at(&self, _part: u8, place: DVec2) -> Option<SampledPoint> {
        let turn = DQuat::from_rotation_arc(DVec3::Y, self.normal);
        let (sin, cos) = (TAU * place.x).sin_cos();
        // A ring's area grows with its radius.
        let [inner, outer] = [self.inner_radius, self.radius].map(|r| r * r);
        let r = (inner + (outer - inner) * place.y).sqrt();
        let position = self.center + turn * DVec3::new(sin * r, 0.0, cos * r);
        Some(SampledPoint { position, area: self.normal * (PI * (outer - inner)) })
    }

    fn reach(&self, direction: DVec3) -> f64 {
        let across = direction.reject_from_normalized(self.normal).length();
        direction.dot(self.center) + across * self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_outside_and_along() {
        let center = DVec3::new(1.0, 2.0, 3.0);
        let disk = Disk { center, normal: DVec3::Y, radius: 0.5, inner_radius: 0.1 };
        let hit = |o: [f64; 3], d: [f64; 3]| {
            disk.intersect(o.into(), d.into(), 0.0, 10.0).map(|hit| hit.t)
        };
        assert_eq!(hit([1.4, 4.0, 3.0], [0.0, -2.0, 0.0]), Some(1.0));
        assert_eq!(hit([1.4, 0.0, 3.0], [0.0, 1.0, 0.0]), Some(2.0), "from behind");
        assert_eq!(hit([1.6, 4.0, 3.0], [0.0, -1.0, 0.0]), None, "beside it");
        assert_eq!(hit([1.05, 4.0, 3.05], [0.0, -1.0, 0.0]), None, "through the hole");
        assert_eq!(hit([0.0, 2.0, 3.0], [1.0, 0.0, 0.0]), None, "within its plane");
        assert_eq!(hit([1.0, 14.0, 3.0], [0.0, -1.0, 0.0]), None, "too far");
    }

    #[test]
    fn the_box_touches_the_rim() {
        let normal = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let center = DVec3::new(5.0, 0.0, 1.0);
        let disk = Disk { center, normal, radius: 2.0, inner_radius: 0.0 };
        let (a, b) = normal.any_orthonormal_pair();
        let rim = (0..10_000).map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 10_000.0).sin_cos();
            disk.center + (a * cos + b * sin) * disk.radius
        });
        let (found, expected) = (disk.bounds(), Bounds::of(rim));
        assert!((found.min - expected.min).abs().max_element() < 1e-6);
        assert!((found.max - expected.max).abs().max_element() < 1e-6);
    }
}
