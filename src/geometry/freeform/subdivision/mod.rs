//! Catmull-Clark subdivision surfaces.
//!
//! The mesh is refined as a whole, level by level, until its triangles between limit points are near
//! enough to the limit surface (`flatness`): every vertex is shared, so there are no cracks, and limit
//! points and normals are exact (`limit`). Embree's own subdivision geometry was not taken: it needs
//! Embree, its hits depend on a tessellation rate and not on a distance, and it would give the pure-Rust
//! accelerator, lights and normals another surface than the one that Embree traces.
//!
//! Sources: Catmull and Clark 1978; DeRose, Kass and Truong 1998 for creases; Biermann, Levin and Zorin
//! 2000 for boundaries.

mod flatness;
mod limit;
mod refine;
#[cfg(test)]
mod tests;

use glam::DVec3;

use super::{Facets, TooManyTriangles};
use refine::{Topology, refine};

/// A control mesh whose faces are polygons.
///
/// Edges of one face are boundaries, and stay sharp, as do creases, edges of more than two faces and
/// edges whose two faces run along them in the same direction. A boundary vertex of a single face is a
/// corner and stays in its place, as does a vertex of three sharp edges or more.
#[derive(Debug, Clone, PartialEq)]
pub struct SubdivisionSurface {
    mesh: Polygons,
}

/// What is wrong with a control mesh.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ControlMeshError {
    /// A face is no polygon.
    #[error("face {face} (the first is 0) has {corners} corners; at least 3 are needed")]
    SmallFace {
        /// Its index.
        face: usize,
        /// Its corners.
        corners: usize,
    },
    /// A face names a vertex that is not there.
    #[error("face {face} names vertex {vertex}, but there are {count} (the first is 0)")]
    NoSuchVertex {
        /// Its index.
        face: usize,
        /// The vertex.
        vertex: u32,
        /// How many there are.
        count: usize,
    },
    /// A face comes to a vertex twice.
    #[error("face {face} (the first is 0) names vertex {vertex} twice")]
    RepeatedVertex {
        /// Its index.
        face: usize,
        /// The vertex.
        vertex: u32,
    },
    /// A crease is no edge of the mesh.
    #[error("no face has an edge between the vertices {} and {}, which a crease names", .edge[0], .edge[1])]
    NoSuchEdge {
        /// Its ends.
        edge: [u32; 2],
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} (the first is 0) is not finite")]
    NotFinite {
        /// Its index.
        vertex: usize,
    },
}

/// Polygons between numbered points.
#[derive(Debug, Clone, Default, PartialEq)]
struct Polygons {
    positions: Vec<DVec3>,
    /// Vertices of all faces, one face after the other.
    corners: Vec<u32>,
    /// Where each face starts in `corners`, and where the last one ends.
    starts: Vec<u32>,
    /// Edges that are sharp by wish, the lower vertex first, in order.
    creases: Vec<[u32; 2]>,
    /// Vertices that stay where they are, in order.
    pinned: Vec<u32>,
}

impl Polygons {
    fn face_count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    fn face(&self, i: usize) -> &[u32] {
        &self.corners[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    fn faces(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.face_count()).map(|i| self.face(i))
    }
}

impl SubdivisionSurface {
    /// A surface of a control mesh. `faces` are lists of vertices, anticlockwise seen from the front;
    /// `creases` are pairs of vertices of an edge.
    ///
    /// # Errors
    /// [`ControlMeshError`], the first that is found.
    pub fn new<F: AsRef<[u32]>>(
        positions: Vec<DVec3>,
        faces: impl IntoIterator<Item = F>,
        creases: &[[u32; 2]],
    ) -> Result<Self, ControlMeshError> {
        let mut mesh = Polygons { positions, starts: vec![0], ..Polygons::default() };
        let count = mesh.positions.len();
        for (face, corners) in faces.into_iter().enumerate() {
            let corners = corners.as_ref();
            if corners.len() < 3 {
                return Err(ControlMeshError::SmallFace { face, corners: corners.len() });
            }
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= count) {
                return Err(ControlMeshError::NoSuchVertex { face, vertex, count });
            }
            let mut sorted = corners.to_vec();
            sorted.sort_unstable();
            if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
                return Err(ControlMeshError::RepeatedVertex { face, vertex: pair[0] });
            }
            mesh.corners.extend_from_slice(corners);
            mesh.starts.push(mesh.corners.len() as u32);
        }
        if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
            return Err(ControlMeshError::NotFinite { vertex });
        }
        mesh.creases = creases.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
        mesh.creases.sort_unstable();
        mesh.creases.dedup();
        let topology = Topology::new(&mesh);
        let is_edge = |edge: &&[u32; 2]| topology.edge(**edge).is_some();
        if let Some(&edge) = mesh.creases.iter().find(|edge| !is_edge(edge)) {
            return Err(ControlMeshError::NoSuchEdge { edge });
        }
        mesh.pinned = topology.corners(&mesh);
        Ok(Self { mesh })
    }

    /// The control points.
    pub fn positions(&self) -> &[DVec3] {
        &self.mesh.positions
    }

    /// The faces of the control mesh.
    pub fn faces(&self) -> impl Iterator<Item = &[u32]> {
        self.mesh.faces()
    }

    /// How many there are.
    pub fn face_count(&self) -> usize {
        self.mesh.face_count()
    }

    /// Its creases, the lower vertex first.
    pub fn creases(&self) -> &[[u32; 2]] {
        &self.mesh.creases
    }

    /// Triangles between limit points.
    pub(super) fn facets(&self, tolerance: f64, limit: u64) -> Result<Facets, TooManyTriangles> {
        let too_many = |fits| TooManyTriangles { tolerance, limit, fits };
        let mut mesh = self.mesh.clone();
        loop {
            let topology = Topology::new(&mesh);
            // Limit points are known of quadrilaterals alone; the first level makes them of anything.
            if mesh.faces().all(|face| face.len() == 4) {
                let surface = limit::Limit::new(&mesh, &topology);
                if flatness::is_near(&mesh, &topology, &surface, tolerance) {
                    return Ok(surface.facets(&mesh));
                }
                // Each corner becomes a face of two triangles.
                if 2 * mesh.corners.len() as u64 > limit {
                    return Err(too_many(flatness::deviation(&mesh, &topology, &surface)));
                }
            } else if 2 * mesh.corners.len() as u64 > limit {
                return Err(too_many(f64::INFINITY));
            }
            mesh = refine(&mesh, &topology);
        }
    }
}
