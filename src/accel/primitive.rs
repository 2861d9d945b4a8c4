//! One ray and one primitive, in f64: what brute force and the plain trees have in common.

use glam::{DAffine3, DVec3};

use super::Hit;
use super::world::{CopyRef, Geometry};
use crate::geometry::{AnalyticShape, TriangleMesh, intersect_triangle, with_shapes};
use crate::math::{Bounds, Ray};

/// A ray in f64, in whichever space it is asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    /// Hits at or before this distance are none.
    pub(super) t_min: f64,
}

/// Where a primitive was hit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    /// Distance, in lengths of the direction.
    pub(super) t: f64,
    /// As in [`Hit::u`].
    pub(super) u: f64,
    /// As in [`Hit::v`].
    pub(super) v: f64,
}

impl Line {
    pub(super) fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.as_dvec3(),
            direction: ray.direction.as_dvec3(),
            t_min: ray.t_min.into(),
        }
    }

    /// The same ray in another space: its distances stay what they are.
    pub(super) fn transformed(&self, m: &DAffine3) -> Self {
        Self {
            origin: m.transform_point3(self.origin),
            direction: m.transform_vector3(self.direction),
            t_min: self.t_min,
        }
    }
}

impl Found {
    /// The hit with the ids of what was hit.
    pub(super) fn named(&self, geometry: u32, primitive: u32, copy: Option<CopyRef>) -> Hit {
        let (t, u, v) = (self.t as f32, self.u as f32, self.v as f32);
        Hit { t, u, v, primitive, geometry, copy }
    }
}

/// The hit with a triangle, not beyond `t_max`.
#[inline]
pub(super) fn hit_triangle(mesh: &TriangleMesh, i: usize, ray: &Line, t_max: f64) -> Option<Found> {
    let corners = mesh.corners(i).map(|p| p.as_dvec3());
    let hit = intersect_triangle(corners, ray.origin, ray.direction, ray.t_min, t_max)?;
    Some(Found { t: hit.t, u: hit.u, v: hit.v })
}

/// The hit with a shape, not beyond `t_max`.
#[inline]
pub(super) fn hit_shape(shape: &impl AnalyticShape, ray: &Line, t_max: f64) -> Option<Found> {
    let hit = shape.intersect(ray.origin, ray.direction, ray.t_min, t_max)?;
    Some(Found { t: hit.t, u: Hit::u_of_part(hit.part).into(), v: 0.0 })
}

/// The hit with primitive `i` of a geometry, not beyond `t_max`.
#[inline]
pub(super) fn hit_primitive(
    geometry: &Geometry,
    i: usize,
    ray: &Line,
    t_max: f64,
) -> Option<Found> {
    match geometry {
        Geometry::Mesh(mesh) => hit_triangle(mesh, i, ray, t_max),
        Geometry::Shapes(shapes) => {
            with_shapes!(shapes, list => hit_shape(&list[i], ray, t_max))
        }
    }
}

/// The box around primitive `i` of a geometry.
pub(super) fn primitive_bounds(geometry: &Geometry, i: usize) -> Bounds {
    match geometry {
        Geometry::Mesh(mesh) => Bounds::of(mesh.corners(i).map(|p| p.as_dvec3())),
        Geometry::Shapes(shapes) => with_shapes!(shapes, list => list[i].bounds()),
    }
}
