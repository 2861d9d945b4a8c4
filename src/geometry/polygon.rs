//! Flat polygons, non-convex and with holes, by the odd-even rule.

use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};

use super::{AnalyticShape, Parameters, SampledPoint, ShapeHit, ShapePoint};
use crate::math::Bounds;

/// A flat polygon: what lies within an odd number of its loops.
///
/// It holds its corners as they lie in its group, so that polygons with corners in common have them bit by
/// bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    loops: Arc<[Box<[DVec3]>]>,
    /// Unit normal; from its side the first loop runs counter-clockwise.
    normal: DVec3,
}

/// Why corners make no polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoPolygon {
    /// The first loop has no area.
    Flat,
    /// A corner (of which loop, and which) is off the plane of the first loop by a distance.
    OffPlane {
        /// Which loop: 0 is the outline.
        ring: usize,
        /// Which of its corners.
        corner: usize,
        /// How far off it is.
        distance: f64,
        /// How far off it may be.
        allowed: f64,
    },
}

impl Polygon {
    /// A corner may be this far off the plane, in sizes of the polygon.
    pub const FLATNESS: f64 = 1e-5;

    /// A polygon of an outline and of holes, each with three corners or more.
    ///
    /// # Errors
    /// [`NoPolygon`] if the outline has no area, or a corner is not in its plane.
    pub fn new(loops: Vec<Vec<DVec3>>) -> Result<Self, NoPolygon> {
        let bounds = Bounds::of(loops.iter().flatten().copied());
        let size = bounds.size().max_element();
        let outline = loops.first().map(Vec::as_slice).unwrap_or_default();
        let normal = area_vector(outline);
        if !(normal.length() > 1e-12 * size * size) {
            return Err(NoPolygon::Flat);
        }
        let normal = normal.normalize();
        let middle = outline.iter().sum::<DVec3>() / outline.len() as f64;
        let allowed = Self::FLATNESS * size;
        for (ring, corners) in loops.iter().enumerate() {
            for (corner, p) in corners.iter().enumerate() {
                let distance = (*p - middle).dot(normal).abs();
                if distance > allowed {
                    return Err(NoPolygon::OffPlane { ring, corner, distance, allowed });
                }
            }
        }
        Ok(Self { loops: loops.into_iter().map(Vec::into_boxed_slice).collect(), normal })
    }

    /// The same under a transform that is not singular.
    #[must_use]
    pub fn transformed(&self, m: &DAffine3) -> Self {
        let moved = |ring: &[DVec3]| ring.iter().map(|p| m.transform_point3(*p)).collect();
        let normal = m.matrix3.inverse().transpose() * self.normal;
        Self {
            loops: self.loops.iter().map(|ring| moved(ring)).collect(),
            normal: normal.normalize(),
        }
    }

    /// The outline and the holes.
    pub fn loops(&self) -> &[Box<[DVec3]>] {
        &self.loops
    }

    /// Unit normal of its front.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    fn point(&self) -> DVec3 {
        self.loops[0][0]
    }

    /// Whether the line through the origin along `direction` passes through it.
    ///
    /// Corners are sheared so that the ray becomes an axis, and edges are counted that cross to one side
    /// of it. A corner's place depends on the corner and the ray alone, and an edge's answer not on its
    /// sense: of polygons that share edges, whatever planes they are in, a ray that passes through the
    /// surface that they make passes through exactly one. Source of the shear: Woop, Benthin, Wald,
    /// *Watertight Ray/Triangle Intersection*, JCGT 2(1) 2013.
    #[inline]
    fn is_crossed(&self, origin: DVec3, direction: DVec3) -> bool {
        let size = direction.abs();
        let along = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let (x, y) = ((along + 1) % 3, (along + 2) % 3);
        let shear = DVec2::new(direction[x] / direction[along], direction[y] / direction[along]);
        let sheared = |p: DVec3| {
            let p = p - origin;
            DVec2::new(p[x], p[y]) - shear * p[along]
        };
        let mut is_inside = false;
        for ring in self.loops.iter() {
            let Some(last) = ring.last() else { continue };
            let mut a = sheared(*last);
            for p in ring.iter() {
                let b = sheared(*p);
                if (a.y > 0.0) != (b.y > 0.0) {
                    let side = a.x * b.y - a.y * b.x;
                    // The crossing lies at side/(b.y − a.y); one at 0 is not beyond, for both neighbours.
                    is_inside ^= if b.y > a.y { side > 0.0 } else { side < 0.0 };
                }
                a = b;
            }
        }
        is_inside
    }
}

/// The area of a loop along its normal, twice. Source: Newell; Sutherland, Sproull, Schumacker 1974.
fn area_vector(ring: &[DVec3]) -> DVec3 {
    let Some(&first) = ring.first() else { return DVec3::ZERO };
    let pairs = ring.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first));
    pairs.sum()
}

impl AnalyticShape for Polygon {
    fn bounds(&self) -> Bounds {
        Bounds::of(self.loops.iter().flatten().copied())
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
        let t = (self.point() - origin).dot(self.normal) / direction.dot(self.normal);
        if !(t > t_min && t <= t_max) {
            return None;
        }
        self.is_crossed(origin, direction).then_some(ShapeHit::at(t))
    }

    fn surface_at(&self, p: DVec3, _part: u8) -> ShapePoint {
        let position = p - self.normal * (p - self.point()).dot(self.normal);
        ShapePoint { position, normal: self.normal }
    }

    /// Lengths from the first corner: u along the first edge, v across it.
    fn parameters(&self, p: DVec3, _part: u8) -> Parameters {
        let edge = self.loops[0][1] - self.point();
        let fallback = self.normal.any_orthonormal_vector();
        let dp_du = edge.reject_from_normalized(self.normal).normalize_or(fallback);
        let dp_dv = self.normal.cross(dp_du);
        let off = p - self.point();
        Parameters { uv: DVec2::new(off.dot(dp_du), off.dot(dp_dv)), dp_du, dp_dv }
    }

    fn curvature(&self, _p: DVec3, _part: u8) -> f64 {
        0.0
    }

    fn sampled_parts(&self) -> u8 {
        1
    }

    /// Onto the smallest rectangle along its first edge that holds it; none beside the polygon.
    fn sample_at(&self, _part: u8, place: DVec2) -> Option<SampledPoint> {
        let Parameters { dp_du, dp_dv, .. } = self.parameters(self.point(), 0);
        let corner = |p: &DVec3| {
            let off = *p - self.point();
            DVec2::new(off.dot(dp_du), off.dot(dp_dv))
        };
        let corners = || self.loops[0].iter().map(corner);
        let low = corners().fold(DVec2::INFINITY, DVec2::min);
        let size = corners().fold(DVec2::NEG_INFINITY, DVec2::max) - low;
        let at = low + place * size;
        let position = self.point() + dp_du * at.x + dp_dv * at.y;
        let area = self.normal * (size.x * size.y);
        // Looked at from the front.
        let eye = position + self.normal * size.max_element();
        self.is_crossed(eye, -self.normal).then_some(SampledPoint { position, area })
    }
}
