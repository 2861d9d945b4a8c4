//! Freeform surfaces, and triangles that lie within a tolerance of them.
//!
//! Patches, polynomial or rational, become [`BezierPatch`]es and are diced (`dice`): a grid on each,
//! as fine as its second derivatives ask for, and the points of an edge that two patches share computed
//! once. Subdivision surfaces ([`subdivision`]) are refined as meshes until they are near enough.
//! Everything is f64 until the mesh is made.

mod bezier;
mod dice;
mod edges;
mod nurbs;
pub mod subdivision;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{DVec2, DVec3};

pub use bezier::{BezierPatch, MAX_DEGREE};
pub use nurbs::{NurbsError, NurbsSurface};
pub use subdivision::SubdivisionSurface;

use super::{Positions, TriangleMesh};
use crate::math::Bounds;

/// A surface to be approximated by triangles.
#[derive(Debug, Clone, PartialEq)]
pub enum FreeformSurface {
    /// Bézier patches, such as those of a NURBS surface.
    Patches(Vec<BezierPatch>),
    /// The limit of Catmull-Clark subdivision.
    Subdivision(SubdivisionSurface),
}

/// Most triangles that one surface may become.
pub const MAX_TRIANGLES: u64 = 100_000_000;

/// A tolerance asks for more triangles than there may be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "a tolerance of {tolerance:.1e} m takes more than {limit} triangles; one of {fits:.1e} m would fit"
)]
pub struct TooManyTriangles {
    /// The tolerance.
    pub tolerance: f64,
    /// How many there may be.
    pub limit: u64,
    /// A tolerance that does not take more.
    pub fits: f64,
}

impl FreeformSurface {
    /// Number of patches, or of faces of the control mesh.
    pub fn len(&self) -> usize {
        match self {
            Self::Patches(patches) => patches.len(),
            Self::Subdivision(surface) => surface.face_count(),
        }
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A box around the surface: that of its control points.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Patches(patches) => {
                patches.iter().map(BezierPatch::bounds).fold(Bounds::EMPTY, Bounds::union)
            }
            Self::Subdivision(surface) => Bounds::of(surface.positions().iter().copied()),
        }
    }

    /// Whether its mesh has texture coordinates.
    pub fn has_uvs(&self) -> bool {
        matches!(self, Self::Patches(_))
    }

    /// Triangles from which no point of the surface is farther than the tolerance, with normals and, of
    /// patches, texture coordinates. The edges of neighbours have the same vertices, bit by bit.
    ///
    /// `tolerance` tells what is allowed to what lies within a box; it is above 0. The rounding of
    /// vertices to f32 comes on top. Of a subdivision surface see [`subdivision`] for what is bounded.
    ///
    /// # Errors
    /// Where there would be more than `limit` triangles.
    pub fn tessellate(
        &self,
        tolerance: &(dyn Fn(&Bounds) -> f64 + Sync),
        limit: u64,
    ) -> Result<TriangleMesh, TooManyTriangles> {
        let facets = match self {
            Self::Patches(patches) => dice::dice(patches, tolerance, limit)?,
            Self::Subdivision(surface) => surface.facets(tolerance(&self.bounds()), limit)?,
        };
        Ok(facets.into_mesh())
    }
}

/// Triangles in f64.
#[derive(Debug, Default)]
pub(super) struct Facets {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    /// None, or one a vertex.
    uvs: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
}

impl Facets {
    /// Rounds to f32, relative to an origin of its own where the surface is far from that of its space.
    /// Triangles that have two vertices in the same place are left out.
    fn into_mesh(self) -> TriangleMesh {
        let origin = Bounds::of(self.positions.iter().copied()).far_center();
        let mut xyz = Vec::with_capacity(3 * self.positions.len() + 1);
        xyz.extend(self.positions.iter().flat_map(|p| (*p - origin).as_vec3().to_array()));
        let place = |v: u32| &xyz[3 * v as usize..][..3];
        let mut triangles = self.triangles;
        triangles.retain(|&[a, b, c]| {
            place(a) != place(b) && place(b) != place(c) && place(c) != place(a)
        });
        let normals = self.normals.iter().map(|n| n.as_vec3().to_array()).collect();
        let uvs: Vec<_> = self.uvs.iter().map(|uv| uv.as_vec2().to_array()).collect();
        TriangleMesh {
            origin,
            positions: Positions::from_flat(xyz),
            triangles: Arc::new(triangles),
            normals: Some(Arc::new(normals)),
            uvs: (!uvs.is_empty()).then(|| Arc::new(uvs)),
        }
    }
}
