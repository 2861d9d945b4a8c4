//! Triangle meshes, in the memory layout that a ray query can share without a copy.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::math::Bounds;

/// Vertex positions: xyz packed, followed by one float of padding.
///
/// Embree reads the last vertex with a 16-byte load, 4 bytes past its end; the padding makes that
/// a read of our own memory. The buffer is reference-counted, so that the accelerator can hold it
/// while the scene goes on reading it.
#[derive(Clone, Debug)]
pub struct Positions(Arc<Vec<f32>>);

impl Positions {
    /// Takes `xyz` (3 floats a vertex) and appends the padding.
    ///
    /// # Panics
    /// If the length is not a multiple of 3.
    pub fn from_flat(mut xyz: Vec<f32>) -> Self {
        assert!(xyz.len().is_multiple_of(3), "positions come in threes");
        xyz.push(0.0);
        Self(Arc::new(xyz))
    }

    /// Number of vertices.
    #[inline]
    pub fn len(&self) -> usize {
        self.0.len() / 3
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position of vertex `i`.
    #[inline]
    pub fn get(&self, i: usize) -> Vec3 {
        Vec3::from_slice(&self.0[3 * i..3 * i + 3])
    }

    /// All positions, without the padding: 3 floats a vertex.
    #[inline]
    pub fn as_flat(&self) -> &[f32] {
        &self.0[..3 * self.len()]
    }

    /// The same, to be changed in place; copies first if the buffer is shared.
    pub fn as_flat_mut(&mut self) -> &mut [f32] {
        let n = 3 * self.len();
        &mut Arc::make_mut(&mut self.0)[..n]
    }

    /// The padded buffer itself (3 n + 1 floats), to be shared with an accelerator.
    pub fn shared(&self) -> Arc<Vec<f32>> {
        Arc::clone(&self.0)
    }
}

/// A triangle mesh with optional normals and texture coordinates per vertex.
///
/// Invariants, which the readers establish and [`crate::scene`] relies on: every index is below
/// the number of vertices, and `normals` and `uvs`, where present, have one entry a vertex.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    /// Where the mesh is: the true position of vertex `i` is `origin + positions[i]`. Zero unless
    /// the file's coordinates are far from the origin compared with their extent and would lose
    /// digits as f32.
    pub origin: DVec3,
    /// Positions relative to `origin`.
    pub positions: Positions,
    /// Three vertex indices a triangle, counter-clockwise seen from outside.
    pub triangles: Arc<Vec<[u32; 3]>>,
    /// Shading normals, one a vertex; need not be of unit length.
    pub normals: Option<Arc<Vec<[f32; 3]>>>,
    /// Texture coordinates, one a vertex.
    pub uvs: Option<Arc<Vec<[f32; 2]>>>,
}

impl TriangleMesh {
    /// A mesh of bare positions (3 floats a vertex) and triangles, at the origin.
    ///
    /// # Panics
    /// If the number of floats is not a multiple of 3 or an index is out of range.
    pub fn new(xyz: Vec<f32>, triangles: Vec<[u32; 3]>) -> Self {
        let n = (xyz.len() / 3) as u64;
        assert!(triangles.iter().flatten().all(|&i| u64::from(i) < n), "an index is out of range");
        Self {
            origin: DVec3::ZERO,
            positions: Positions::from_flat(xyz),
            triangles: Arc::new(triangles),
            normals: None,
            uvs: None,
        }
    }

    /// The corners of triangle `i`, relative to `origin`.
    #[inline]
    pub fn corners(&self, i: usize) -> [Vec3; 3] {
        self.triangles[i].map(|v| self.positions.get(v as usize))
    }

    /// The box around the vertices that triangles use, relative to `origin`.
    pub fn bounds(&self) -> Bounds {
        let (min, max) = self.fold_vertices(
            (Vec3::INFINITY, Vec3::NEG_INFINITY),
            |b, p| (b.0.min(p), b.1.max(p)),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        );
        Bounds { min: min.as_dvec3(), max: max.as_dvec3() }
    }

    /// The largest dot products of those vertices with each of four directions.
    pub fn support(&self, directions: [DVec3; 4]) -> [f64; 4] {
        let larger = |a: [f64; 4], b: [f64; 4]| std::array::from_fn(|i| a[i].max(b[i]));
        let dots = |p: Vec3| directions.map(|d| d.dot(p.as_dvec3()));
        self.fold_vertices([f64::NEG_INFINITY; 4], |a, p| larger(a, dots(p)), larger)
    }

    /// Folds over the vertices that triangles use, in parallel and in no particular order.
    fn fold_vertices<T: Copy + Send + Sync>(
        &self,
        start: T,
        add: impl Fn(T, Vec3) -> T + Sync,
        join: impl Fn(T, T) -> T + Sync + Send,
    ) -> T {
        let triangle = |value: T, t: &[u32; 3]| {
            t.iter().fold(value, |value, &i| add(value, self.positions.get(i as usize)))
        };
        self.triangles
            .par_iter()
            .with_min_len(1 << 14)
            .fold(|| start, triangle)
            .reduce(|| start, &join)
    }
}
