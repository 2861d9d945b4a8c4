//! What every shape that is solved as a whole can say of itself.

use std::f64::consts::TAU;
use std::fmt::Debug;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::math::Bounds;

/// A hit of a ray with a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeHit {
    /// Distance, in lengths of the ray's direction.
    pub t: f64,
    /// Which of the shape's parts was hit: a side, a cap.
    pub part: u8,
}

impl ShapeHit {
    /// A hit of a shape that has one part.
    #[inline]
    pub const fn at(t: f64) -> Self {
        Self { t, part: 0 }
    }
}

/// A point of a shape's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapePoint {
    /// Position.
    pub position: DVec3,
    /// Unit normal, pointing out.
    pub normal: DVec3,
}

/// Texture coordinates of a point, and how the position changes with them; zero where a shape has none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Parameters {
    /// Texture coordinates.
    pub uv: DVec2,
    /// Change of the position with u.
    pub dp_du: DVec3,
    /// Change of the position with v.
    pub dp_dv: DVec3,
}

/// A point that a place in the unit square is mapped to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledPoint {
    /// Position.
    pub position: DVec3,
    /// The outward normal, as long as the area that a unit of the square becomes there.
    pub area: DVec3,
}

impl SampledPoint {
    /// The same under a transform, of which `cofactors` are those of its linear part, by which areas go.
    #[inline]
    pub fn transformed(&self, m: &DAffine3, cofactors: &DMat3) -> Self {
        Self { position: m.transform_point3(self.position), area: *cofactors * self.area }
    }
}

/// The cofactors of a matrix that is not singular, outward kept outward where it mirrors.
pub fn cofactors(m: &DMat3) -> DMat3 {
    m.inverse().transpose() * m.determinant().abs()
}

/// A shape that is solved as a whole, in f64, in a space of its own.
///
/// What is said of a point (all but the intersection) is asked for points that a ray was found to hit, off
/// by as much as its distance is rounded.
pub trait AnalyticShape: Clone + Debug + Send + Sync + 'static {
    /// The box around it. Infinite along the axes along which the shape has no end.
    fn bounds(&self) -> Bounds;

    /// The first hit at t in (`t_min`, `t_max`]. The direction may have any length.
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit>;

    /// Whether there is any such hit.
    #[inline]
    fn occluded(&self, origin: DVec3, direction: DVec3, t_min: f64, t_max: f64) -> bool {
        self.intersect(origin, direction, t_min, t_max).is_some()
    }

    /// The point of the surface near `p`, on the part that was hit.
    fn surface_at(&self, p: DVec3, part: u8) -> ShapePoint;

    /// The unit normal that the surface is shaded by there, pointing out, where that is another.
    #[inline]
    fn shading_normal(&self, _p: DVec3, _part: u8) -> Option<DVec3> {
        None
    }

    /// The texture coordinates there.
    fn parameters(&self, p: DVec3, part: u8) -> Parameters;

    /// About how far the normal turns for each unit of distance along the surface, at most.
    fn curvature(&self, p: DVec3, part: u8) -> f64;

    /// Parts of the surface on which points can be drawn at random. Where there is none, the shape cannot be a
    /// light.
    fn sampled_parts(&self) -> u8 {
        0
    }

    /// A map from the unit square onto such a part. None at places that are off the surface.
    fn sample_at(&self, _part: u8, _place: DVec2) -> Option<SampledPoint> {
        None
    }

    /// How far it reaches: the largest dot product of one of its points with `direction`, which may have
    /// any length. By its box, where a shape does not know better.
    fn reach(&self, direction: DVec3) -> f64 {
        let b = self.bounds();
        // Per axis, as 0 · ∞ must be 0.
        let along = |i: usize| match direction[i] {
            0.0 => 0.0,
            d if d > 0.0 => d * b.max[i],
            d => d * b.min[i],
        };
        along(0) + along(1) + along(2)
    }
}

/// How far around +Y a point is, from 0 to 1: ½ on +Z, rising towards +X; and the change of the point with
/// it.
pub(super) fn longitude(p: DVec3) -> (f64, DVec3) {
    let u = 0.5 + p.x.atan2(p.z) / TAU;
    (u, DVec3::new(p.z, 0.0, -p.x) * TAU)
}

/// The unit vector away from the Y axis; any where `p` lies on it.
pub(super) fn outward(p: DVec3) -> DVec3 {
    DVec3::new(p.x, 0.0, p.z).normalize_or(DVec3::Z)
}

/// The stretch of a ray that runs through a box, as seen from where it begins: solved there, an equation
/// loses no digits to the distance that the ray has come.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    /// Distance from the ray's origin to that of the stretch.
    pub(super) start: f64,
    /// Where it begins; the ray's own origin, where that lies inside.
    pub(super) origin: DVec3,
    /// Its length, in lengths of the direction.
    pub(super) length: f64,
}

impl Stretch {
    /// None where the ray passes the box. The box counts as a little larger than it is, so that nothing
    /// on its faces is lost.
    #[inline]
    pub(super) fn within(bounds: &Bounds, origin: DVec3, direction: DVec3) -> Option<Self> {
        /// Many roundings, and no distance that could be seen.
        const MARGIN: f64 = 1e-12;
        let margin = DVec3::splat(MARGIN * (bounds.max - bounds.min).max_element());
        let bounds = Bounds { min: bounds.min - margin, max: bounds.max + margin };
        let (enter, exit) = bounds.clip(origin, direction)?;
        let start = enter.max(0.0);
        Some(Self { start, origin: origin + direction * start, length: exit - start })
    }
}
