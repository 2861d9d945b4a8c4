//! Groups before they are moved and rounded: meshes, shapes and copies, each with its look.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

use crate::accel::{Geometry, Group};
use crate::geometry::{PlacedShape, Shapes, TriangleMesh};
use crate::math::Bounds;

/// What a primitive looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Look {
    /// Index of its material.
    pub(super) material: u32,
    /// Index of its texture space.
    pub(super) frame: u32,
    /// The scene's number of the object that it belongs to; means nothing in a prototype.
    pub(super) object: u32,
}

/// The looks of one geometry.
#[derive(Debug, Clone)]
pub(super) enum GeometryLooks {
    /// One for all primitives.
    One(Look),
    /// One for each primitive.
    Each(Vec<Look>),
}

impl GeometryLooks {
    #[inline]
    pub(super) fn of(&self, primitive: u32) -> Look {
        match self {
            Self::One(look) => *look,
            Self::Each(looks) => looks[primitive as usize],
        }
    }
}

/// What a group is made of before it is moved and rounded.
#[derive(Debug, Default)]
pub(super) struct Draft {
    /// (mesh, group from mesh).
    pub(super) meshes: Vec<(usize, DAffine3, DraftLook)>,
    /// Lists of shapes, one for each kind that there is, and what each shape looks like.
    pub(super) shapes: Vec<(Shapes, Vec<DraftLook>)>,
    /// Copies of other drafts, by index.
    pub(super) copies: Vec<DraftCopy>,
}

/// A copy of a draft.
#[derive(Debug, Clone, Copy)]
pub(super) struct DraftCopy {
    /// Which draft.
    pub(super) draft: usize,
    /// Where it is, in the space of what holds the copy.
    pub(super) transform: DAffine3,
    /// The scene's number of the object that it belongs to; means nothing in a prototype.
    pub(super) object: u32,
}

/// What a primitive will look like.
#[derive(Debug, Clone, Copy)]
pub(super) struct DraftLook {
    /// Index of its material.
    pub(super) material: u32,
    /// Where its textures lie: texture space from the group's; none where it has none.
    pub(super) frame: Option<DAffine3>,
    /// The scene's number of the object that it belongs to; means nothing in a prototype.
    pub(super) object: u32,
}

impl Draft {
    /// The box around its own meshes and shapes, before it is moved. A mesh counts by its own box.
    pub(super) fn bounds(&self, mesh_bounds: &[Bounds]) -> Bounds {
        let meshes = self.meshes.iter().map(|(mesh, m, _)| mesh_bounds[*mesh].transformed(m));
        let shapes =
            self.shapes.iter().map(|(shapes, _)| shapes.bounds()).filter(Bounds::is_finite);
        meshes.chain(shapes).fold(Bounds::EMPTY, Bounds::union)
    }

    /// Adds a shape to the list of its kind.
    pub(super) fn add<S: PlacedShape>(&mut self, shape: S, look: DraftLook) {
        for (shapes, looks) in &mut self.shapes {
            if let Some(list) = S::of(shapes) {
                list.push(shape);
                looks.push(look);
                return;
            }
        }
        self.shapes.push((shape.list(), vec![look]));
    }

    /// Takes out all shapes of one kind.
    pub(super) fn take<S: PlacedShape>(&mut self) -> Vec<(S, DraftLook)> {
        let is_of_kind = |shapes: &mut Shapes| S::of(shapes).is_some();
        let Some(at) = self.shapes.iter_mut().position(|(shapes, _)| is_of_kind(shapes)) else {
            return Vec::new();
        };
        let (mut shapes, looks) = self.shapes.remove(at);
        let list = S::of(&mut shapes).map(std::mem::take).unwrap_or_default();
        list.into_iter().zip(looks).collect()
    }

    /// Parts its lists of shapes into those of materials that are `clear` and those that are not.
    fn part(&mut self, clear: &[bool]) {
        let is_clear = |look: &DraftLook| clear[look.material as usize];
        let parts = self.shapes.drain(..).flat_map(|(shapes, looks)| {
            let [others, chosen] = shapes.split(|i| is_clear(&looks[i]));
            let (of_chosen, of_others) = looks.into_iter().partition(is_clear);
            [(others, of_others), (chosen, of_chosen)]
        });
        self.shapes = parts.filter(|(shapes, _)| !shapes.is_empty()).collect();
    }

    /// The group to be traced, relative to `origin`. A mesh's last use takes its buffers. Light passes
    /// what is of a material that is `clear`; none of them is where that is empty.
    pub(super) fn group(
        mut self,
        origin: DVec3,
        meshes: &mut [Option<TriangleMesh>],
        uses_left: &mut [u32],
        frames: &mut Vec<DAffine3>,
        clear: &[bool],
    ) -> (Group, Vec<GeometryLooks>) {
        if !clear.is_empty() {
            self.part(clear);
        }
        let (mut geometries, mut looks) = (Vec::new(), Vec::new());
        let mut look = |&DraftLook { material, frame, object }: &DraftLook| {
            let Some(frame) = frame else { return Look { material, frame: 0, object } };
            frames.push(frame * DAffine3::from_translation(origin));
            Look { material, frame: frames.len() as u32 - 1, object }
        };
        for (index, transform, draft_look) in &self.meshes {
            uses_left[*index] -= 1;
            let slot = &mut meshes[*index];
            let mesh = if uses_left[*index] == 0 { slot.take() } else { slot.clone() };
            let Some(mesh) = mesh else { continue };
            geometries.push(Geometry::Mesh(moved(mesh, transform, origin)));
            looks.push(GeometryLooks::One(look(draft_look)));
        }
        for (shapes, draft_looks) in self.shapes {
            geometries.push(Geometry::Shapes(shapes.translated(-origin)));
            looks.push(GeometryLooks::Each(draft_looks.iter().map(&mut look).collect()));
        }
        // Of one geometry all is clear or nothing.
        let is_clear = |looks: &GeometryLooks| clear[looks.of(0).material as usize];
        let clear =
            if clear.is_empty() { Vec::new() } else { looks.iter().map(is_clear).collect() };
        (Group { geometries, clear }, looks)
    }
}

/// The mesh in the space of its group: transformed and moved in f64, rounded once, in place.
fn moved(mut mesh: TriangleMesh, transform: &DAffine3, group_origin: DVec3) -> TriangleMesh {
    // group = transform · (origin + p) − group_origin
    let m = DAffine3::from_translation(-group_origin)
        * *transform
        * DAffine3::from_translation(mesh.origin);
    mesh.origin = DVec3::ZERO;
    if m == DAffine3::IDENTITY {
        return mesh;
    }
    mesh.positions.as_flat_mut().par_chunks_exact_mut(3).with_min_len(1 << 12).for_each(|p| {
        let world = m.transform_point3(DVec3::new(p[0].into(), p[1].into(), p[2].into()));
        p.copy_from_slice(&world.as_vec3().to_array());
    });
    if m.matrix3 != DMat3::IDENTITY {
        let normal_matrix = m.matrix3.inverse().transpose();
        if let Some(normals) = &mut mesh.normals {
            Arc::make_mut(normals).par_iter_mut().with_min_len(1 << 12).for_each(|n| {
                *n = (normal_matrix * DVec3::from(n.map(f64::from)))
                    .normalize_or_zero()
                    .as_vec3()
                    .to_array();
            });
        }
        // A mirrored mesh stays right side out: counter-clockwise seen from outside.
        if m.matrix3.determinant() < 0.0 {
            Arc::make_mut(&mut mesh.triangles).par_iter_mut().for_each(|t| t.swap(1, 2));
        }
    }
    mesh
}
