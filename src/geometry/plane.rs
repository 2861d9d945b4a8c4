//! Planes without end, solved in f64.

use glam::{DAffine3, DQuat, DVec2, DVec3};

use super::{AnalyticShape, Parameters, ShapeHit, ShapePoint};
use crate::math::Bounds;

/// A plane without end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// One of its points.
    pub point: DVec3,
    /// Unit normal of its front.
    pub normal: DVec3,
}

impl Plane {
    /// The same under a transform that is not singular.
    #[must_use]
    pub fn transformed(self, m: &DAffine3) -> Self {
        // By the inverse transpose, so that the front stays the front in a mirror.
        let normal = m.matrix3.inverse().transpose() * self.normal;
        Self { point: m.transform_point3(self.point), normal: normal.normalize() }
    }
}

impl AnalyticShape for Plane {
    /// It has an end only along an axis that it is across.
    fn bounds(&self) -> Bounds {
        let end = |i: usize, far: f64| {
            let is_across = self.normal.abs()[i] == 1.0;
            if is_across { self.point[i] } else { far }
        };
        let ends = |far: f64| DVec3::new(end(0, far), end(1, far), end(2, far));
        Bounds { min: ends(f64::NEG_INFINITY), max: ends(f64::INFINITY) }
    }

    /// A ray within it has no hit.
    #[inline]
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let t = (self.point - origin).dot(self.normal) / direction.dot(self.normal);
        (t > t_min && t <= t_max).then_some(ShapeHit::at(t))
    }

    fn surface_at(&self, p: DVec3, _part: u8) -> ShapePoint {
        let position = p - self.normal * (p - self.point).dot(self.normal);
        ShapePoint { position, normal: self.normal }
    }

    /// Lengths from its point: on a level plane u along +X and v along −Z; on others, as if that had been
    /// tilted the shortest way.
    fn parameters(&self, p: DVec3, _part: u8) -> Parameters {
        let turn = DQuat::from_rotation_arc(DVec3::Y, self.normal);
        let (dp_du, dp_dv) = (turn * DVec3::X, turn * DVec3::NEG_Z);
        let off = p - self.point;
        Parameters { uv: DVec2::new(off.dot(dp_du), off.dot(dp_dv)), dp_du, dp_dv }
    }

    fn curvature(&self, _p: DVec3, _part: u8) -> f64 {
        0.0
    }
}
