//! Hierarchies of other crates, as rows of `alhazen bench`: as they are, with the ray and triangle test that
//! each brings, and with the hits that these lose. Triangles only; copies are written out.

mod bvh;
mod obvhs;

use super::world::{CopyRef, Geometry, Group, World, affine_from_rows};
use super::{AccelInfo, Hit};

pub use bvh::BvhCrate;
pub use obvhs::{ObvhsBvh2, ObvhsCwBvh};

/// All triangles of a world in one list, in world space.
#[derive(Debug, Clone, Default)]
pub struct Flat {
    /// Corners.
    pub triangles: Vec<[[f32; 3]; 3]>,
    names: Names,
}

/// Why a world cannot be made one list of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CannotFlatten {
    /// There is something else in it.
    #[error("knows triangles alone")]
    Shapes,
    /// The copies would be too many.
    #[error("has no copies, and {0} triangles are too many to write out")]
    Triangles(u64),
    /// There is none.
    #[error("needs a triangle")]
    Empty,
}

/// Which triangles of the list belong to what.
#[derive(Debug, Clone, Default)]
struct Names(Vec<Part>);

#[derive(Debug, Clone, Copy)]
struct Part {
    /// Number of its first triangle in the list.
    first: u32,
    geometry: u32,
    copy: Option<CopyRef>,
}

impl Flat {
    /// Writes out the triangles of a world and of its copies, at most `limit`.
    ///
    /// # Errors
    /// [`CannotFlatten`] where there are shapes, too many triangles, or none.
    pub fn new(world: &World, limit: u64) -> Result<Self, CannotFlatten> {
        let copies = || {
            (0u32..).zip(&world.sets).flat_map(|(set, s)| {
                let group = &world.prototypes[s.prototype as usize];
                let rows = (0u32..).zip(s.transforms.iter());
                rows.map(move |(index, rows)| (group, Some((CopyRef { set, index }, rows))))
            })
        };
        let groups = || std::iter::once((&world.root, None)).chain(copies());
        let mut count = 0;
        for (group, _) in groups() {
            if group.geometries.iter().any(|g| matches!(g, Geometry::Shapes(_))) {
                return Err(CannotFlatten::Shapes);
            }
            count += group.geometries.iter().map(Geometry::len).sum::<usize>() as u64;
        }
        match count {
            0 => return Err(CannotFlatten::Empty),
            n if n > limit => return Err(CannotFlatten::Triangles(n)),
            _ => {}
        }
        let mut flat = Self { triangles: Vec::with_capacity(count as usize), ..Self::default() };
        for (group, copy) in groups() {
            match copy {
                None => flat.add(group, None, |corner| corner),
                Some((copy, rows)) => {
                    let m = affine_from_rows(rows);
                    flat.add(group, Some(copy), |corner| {
                        m.transform_point3(corner.as_dvec3()).as_vec3()
                    });
                }
            }
        }
        Ok(flat)
    }

    fn add(
        &mut self,
        group: &Group,
        copy: Option<CopyRef>,
        place: impl Fn(glam::Vec3) -> glam::Vec3,
    ) {
        for (geometry, mesh) in (0u32..).zip(&group.geometries) {
            let Geometry::Mesh(mesh) = mesh else { continue };
            self.names.0.push(Part { first: self.triangles.len() as u32, geometry, copy });
            let corners = (0..mesh.triangles.len()).map(|i| mesh.corners(i));
            self.triangles.extend(corners.map(|c| c.map(|p| place(p).to_array())));
        }
    }
}

impl Names {
    /// The hit with triangle `i` of the list. Its weights are not asked for.
    fn hit(&self, t: f32, i: u32) -> Hit {
        let part = self.0[self.0.partition_point(|part| part.first <= i) - 1];
        let Part { first, geometry, copy } = part;
        Hit { t, u: 0.0, v: 0.0, primitive: i - first, geometry, copy }
    }
}

fn info(name: &str, bytes: usize) -> AccelInfo {
    AccelInfo { name: name.into(), isa: "f32", packet_width: 1, bytes: bytes as u64 }
}
