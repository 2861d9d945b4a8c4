//! Boxes along the axes, solved in f64.

use glam::{DVec2, DVec3};

use super::{AnalyticShape, Parameters, SampledPoint, ShapeHit, ShapePoint};
use crate::math::Bounds;

/// A box whose edges are parallel to the axes. Part 2·axis is the face at the least coordinate,
/// 2·axis + 1 that at the greatest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid {
    /// The box; its sides are longer than 0.
    pub bounds: Bounds,
}

impl AnalyticShape for Cuboid {
    fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// By slabs. Source: Kay and Kajiya, *Ray Tracing Complex Scenes*, SIGGRAPH 1986; each bound minus the
    /// origin first, as the product form cancels far away.
    #[inline]
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let (mut enter, mut exit) = (ShapeHit::at(f64::NEG_INFINITY), ShapeHit::at(f64::INFINITY));
        for axis in 0..3 {
            let (o, d) = (origin[axis], direction[axis]);
            let [low, high] = [self.bounds.min[axis] - o, self.bounds.max[axis] - o];
            if d == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let part = 2 * axis as u8;
            let (near, far) = if d > 0.0 { (low, high) } else { (high, low) };
            let (near_part, far_part) = if d > 0.0 { (part, part + 1) } else { (part + 1, part) };
            let (near, far) = (near / d, far / d);
            if near > enter.t {
                enter = ShapeHit { t: near, part: near_part };
            }
            if far < exit.t {
                exit = ShapeHit { t: far, part: far_part };
            }
        }
        if !(enter.t <= exit.t) {
            return None;
        }
        [enter, exit].into_iter().find(|hit| hit.t > t_min && hit.t <= t_max)
    }

    fn surface_at(&self, p: DVec3, part: u8) -> ShapePoint {
        let (axis, is_high) = face(part);
        let b = &self.bounds;
        let mut position = p.clamp(b.min, b.max);
        position[axis] = if is_high { b.max[axis] } else { b.min[axis] };
        let mut normal = DVec3::ZERO;
        normal[axis] = if is_high { 1.0 } else { -1.0 };
        ShapePoint { position, normal }
    }

    /// The whole of [0, 1]² on each face: seen from outside, u runs to the right and v up; on the top and
    /// the bottom, u runs along +X.
    fn parameters(&self, p: DVec3, part: u8) -> Parameters {
        let (axis, is_high) = face(part);
        let size = self.bounds.size();
        let (right, up) = match (axis, is_high) {
            (0, true) => (DVec3::NEG_Z, DVec3::Y),
            (0, false) => (DVec3::Z, DVec3::Y),
            (1, true) => (DVec3::X, DVec3::NEG_Z),
            (1, false) => (DVec3::X, DVec3::Z),
            (_, true) => (DVec3::X, DVec3::Y),
            (_, false) => (DVec3::NEG_X, DVec3::Y),
        };
        let from_center = p - self.bounds.center();
        let [width, height] = [right, up].map(|d| d.abs().dot(size));
        let uv = DVec2::new(from_center.dot(right) / width, from_center.dot(up) / height);
        Parameters { uv: uv + 0.5, dp_du: right * width, dp_dv: up * height }
    }

    fn curvature(&self, _p: DVec3, _part: u8) -> f64 {
        0.0
    }

    fn sampled_parts(&self) -> u8 {
        6
    }

    fn sample_at(&self, part: u8, place: DVec2) -> Option<SampledPoint> {
        let (axis, _) = face(part);
        let size = self.bounds.size();
        let mut offset = DVec3::ZERO;
        offset[(axis + 1) % 3] = place.x;
        offset[(axis + 2) % 3] = place.y;
        let ShapePoint { position, normal } =
            self.surface_at(self.bounds.min + offset * size, part);
        let area = size[(axis + 1) % 3] * size[(axis + 2) % 3];
        Some(SampledPoint { position, area: normal * area })
    }
}

/// The axis that a face is across, and whether it is that at the greatest coordinate.
fn face(part: u8) -> (usize, bool) {
    (usize::from(part / 2).min(2), part % 2 == 1)
}
