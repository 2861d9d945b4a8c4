//! What there is to hit, before anything is built over it.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use crate::geometry::{AnalyticShape, Shapes, TriangleMesh, with_shapes};
use crate::math::Bounds;

/// One geometry: many primitives of one kind.
#[derive(Debug, Clone)]
pub enum Geometry {
    /// Triangles; relative to the group's origin, so that the mesh's own `origin` is zero.
    Mesh(TriangleMesh),
    /// Shapes of one kind.
    Shapes(Shapes),
}

/// Geometries in one space.
#[derive(Debug, Clone, Default)]
pub struct Group {
    /// Addressed by [`super::Hit::geometry`].
    pub geometries: Vec<Geometry>,
    /// Which of them light passes without loss ([`super::RayQuery::occluded_by_opaque`]); none where
    /// nothing is said.
    pub clear: Vec<bool>,
}

/// An affine transform in f32: three rows of four, row-major, target from source.
pub type Transform3x4 = [f32; 12];

/// Copies of one prototype.
#[derive(Debug, Clone)]
pub struct InstanceSet {
    /// Index into [`World::prototypes`].
    pub prototype: u32,
    /// World from object, one a copy.
    pub transforms: Arc<Vec<Transform3x4>>,
}

/// One copy: which set, and which of its transforms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct CopyRef {
    /// Index into [`World::sets`].
    pub set: u32,
    /// Index into [`InstanceSet::transforms`].
    pub index: u32,
}

/// Everything that rays can hit: geometry in world space, and copies of prototypes.
#[derive(Debug, Clone, Default)]
pub struct World {
    /// Geometry in world space.
    pub root: Group,
    /// Groups that are only copied.
    pub prototypes: Vec<Group>,
    /// Their copies.
    pub sets: Vec<InstanceSet>,
}

impl Group {
    /// The box around everything in it that has an end.
    pub fn bounds(&self) -> Bounds {
        let bounds = self.geometries.iter().map(Geometry::bounds).filter(Bounds::is_finite);
        bounds.fold(Bounds::EMPTY, Bounds::union)
    }

    /// Whether light passes a geometry without loss.
    pub fn is_clear(&self, geometry: usize) -> bool {
        self.clear.get(geometry).is_some_and(|is_clear| *is_clear)
    }
}

impl Geometry {
    /// Number of primitives.
    pub fn len(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.triangles.len(),
            Self::Shapes(shapes) => shapes.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether some of it has no end.
    pub fn is_endless(&self) -> bool {
        matches!(self, Self::Shapes(shapes) if shapes.is_endless())
    }

    /// The box around all primitives. For a mesh: around the vertices that triangles use.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Mesh(mesh) => mesh.bounds(),
            Self::Shapes(shapes) => shapes.bounds(),
        }
    }
}

impl World {
    /// The box around everything that has an end, copies included.
    pub fn bounds(&self) -> Bounds {
        let prototypes: Vec<Bounds> = self.prototypes.iter().map(Group::bounds).collect();
        let copies = self.sets.iter().flat_map(|set| {
            let bounds = &prototypes[set.prototype as usize];
            set.transforms.iter().map(|m| bounds.transformed(&affine_from_rows(m)))
        });
        copies.fold(self.root.bounds(), Bounds::union)
    }

    /// Whether there is something without end in it.
    pub fn is_endless(&self) -> bool {
        self.root.geometries.iter().any(Geometry::is_endless)
    }

    /// How far the world reaches in each of four directions: the largest dot product of a point with
    /// it. Copies count by their boxes.
    pub fn support(&self, directions: [DVec3; 4]) -> [f64; 4] {
        let mut reach = [f64::NEG_INFINITY; 4];
        let mut add = |far: [f64; 4]| {
            reach = std::array::from_fn(|i| reach[i].max(far[i]));
        };
        for geometry in self.root.geometries.iter().filter(|g| !g.is_endless()) {
            match geometry {
                Geometry::Mesh(mesh) => add(mesh.support(directions)),
                Geometry::Shapes(shapes) => with_shapes!(shapes, list => {
                    list.iter().for_each(|shape| add(directions.map(|d| shape.reach(d))));
                }),
            }
        }
        let prototypes: Vec<Bounds> = self.prototypes.iter().map(Group::bounds).collect();
        for set in &self.sets {
            let bounds = &prototypes[set.prototype as usize];
            for rows in set.transforms.iter().filter(|_| !bounds.is_empty()) {
                let m = affine_from_rows(rows);
                bounds.corners().map(|p| m.transform_point3(p)).into_iter().for_each(|p| {
                    add(directions.map(|d| d.dot(p)));
                });
            }
        }
        reach
    }

    /// The transform of a copy, world from object.
    #[inline]
    pub fn transform(&self, copy: CopyRef) -> &Transform3x4 {
        &self.sets[copy.set as usize].transforms[copy.index as usize]
    }

    /// The group that a hit lies in.
    #[inline]
    pub fn group(&self, copy: Option<CopyRef>) -> &Group {
        match copy {
            None => &self.root,
            Some(copy) => &self.prototypes[self.sets[copy.set as usize].prototype as usize],
        }
    }
}

/// The transform in f64.
pub fn affine_from_rows(m: &Transform3x4) -> DAffine3 {
    let m = m.map(f64::from);
    DAffine3 {
        matrix3: DMat3::from_cols(
            DVec3::new(m[0], m[4], m[8]),
            DVec3::new(m[1], m[5], m[9]),
            DVec3::new(m[2], m[6], m[10]),
        ),
        translation: DVec3::new(m[3], m[7], m[11]),
    }
}

/// The transform rounded to f32, once.
pub fn rows_from_affine(m: &DAffine3) -> Transform3x4 {
    let (a, t) = (m.matrix3, m.translation);
    [
        a.x_axis.x, a.y_axis.x, a.z_axis.x, t.x, a.x_axis.y, a.y_axis.y, a.z_axis.y, t.y,
        a.x_axis.z, a.y_axis.z, a.z_axis.z, t.z,
    ]
    .map(|x| x as f32)
}
