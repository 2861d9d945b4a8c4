//! Flat disks, solved in f64.

use glam::DVec3;

use super::AnalyticShape;
use crate::math::Bounds;

/// A flat disk, in the space of its group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disk {
    /// Centre.
    pub center: DVec3,
    /// Unit normal of its front.
    pub normal: DVec3,
    /// Radius, > 0.
    pub radius: f64,
}

impl AnalyticShape for Disk {
    /// The box around it: along each axis it reaches r·√(1 − n²).
    fn bounds(&self) -> Bounds {
        let reach = (DVec3::ONE - self.normal * self.normal).max(DVec3::ZERO);
        let reach = reach.map(f64::sqrt) * self.radius;
        Bounds { min: self.center - reach, max: self.center + reach }
    }

    /// The hit, if it is at t in (`t_min`, `t_max`]. A ray within its plane has none.
    #[inline]
    fn intersect(&self, origin: DVec3, direction: DVec3, t_min: f64, t_max: f64) -> Option<f64> {
        let to_center = self.center - origin;
        let t = to_center.dot(self.normal) / direction.dot(self.normal);
        let off = direction * t - to_center;
        // Also refuses NaN.
        let is_hit = t > t_min && t <= t_max && off.length_squared() <= self.radius * self.radius;
        is_hit.then_some(t)
    }
}

impl Disk {
    /// The point of its plane nearest to `p`.
    pub fn nearest(&self, p: DVec3) -> DVec3 {
        p - self.normal * (p - self.center).dot(self.normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_outside_and_along() {
        let disk = Disk { center: DVec3::new(1.0, 2.0, 3.0), normal: DVec3::Y, radius: 0.5 };
        let hit = |o: [f64; 3], d: [f64; 3]| disk.intersect(o.into(), d.into(), 0.0, 10.0);
        assert_eq!(hit([1.4, 4.0, 3.0], [0.0, -2.0, 0.0]), Some(1.0));
        assert_eq!(hit([1.4, 0.0, 3.0], [0.0, 1.0, 0.0]), Some(2.0), "from behind");
        assert_eq!(hit([1.6, 4.0, 3.0], [0.0, -1.0, 0.0]), None, "beside it");
        assert_eq!(hit([0.0, 2.0, 3.0], [1.0, 0.0, 0.0]), None, "within its plane");
        assert_eq!(hit([1.0, 14.0, 3.0], [0.0, -1.0, 0.0]), None, "too far");
    }

    #[test]
    fn the_box_touches_the_rim() {
        let normal = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let disk = Disk { center: DVec3::new(5.0, 0.0, 1.0), normal, radius: 2.0 };
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
