//! Triangle meshes from files: the choice of reader, and what all readers do at the end.
//!
//! The readers (`ply`, `obj`, `stl`) know the formats and check every
//! index, since they can name the place in the file. Here is what does not depend on the format:
//! coordinates that are not finite, the origin of far-away data, the warnings.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::error::ReadError;
use super::{obj, ply, stl};
use crate::geometry::{Positions, TriangleMesh};
use crate::math::Bounds;
use crate::pages::prefer_large;

/// A mesh as read, with what the user should know about it.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// The mesh; it may have no triangles, which `warnings` then says.
    pub mesh: TriangleMesh,
    /// What was dropped, repaired or not understood: one sentence each, without the file's name.
    pub warnings: Vec<String>,
    /// Which triangles were dropped for a coordinate that is not finite: the beginning of a sentence.
    pub non_finite: Option<String>,
}

/// What becomes of triangles with a coordinate that is NaN, infinite or beyond use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum NonFinite {
    /// They are left out, with a warning.
    #[default]
    Drop,
    /// The mesh is refused.
    Refuse,
}

impl NonFinite {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Drop, Self::Refuse];

    /// The name in scene files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drop => "drop",
            Self::Refuse => "refuse",
        }
    }
}

/// Reads a mesh from a `.ply`, `.obj` or `.stl` file, told apart by the extension in either case.
///
/// Polygons are cut into triangles. Triangles with a NaN or infinite coordinate (or one beyond
/// 10¹⁸) are dropped with a warning; triangles without area are kept. Numbers of faces, triangles
/// and vertices in messages count from 0, lines from 1.
///
/// # Errors
/// If the file cannot be read, is not what its extension says, is cut short, or has a face that
/// names a vertex it lacks.
pub fn read_mesh(path: &Path) -> Result<MeshFile, ReadError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    match extension.to_ascii_lowercase().as_str() {
        "ply" => ply::read(path),
        "obj" => obj::read(path),
        "stl" => stl::read(path),
        "" => Err(ReadError::file(path, "no file extension; accepted: .ply, .obj, .stl")),
        _ => Err(ReadError::file(
            path,
            format!("unknown mesh file extension `.{extension}`; accepted: .ply, .obj, .stl"),
        )),
    }
}

/// A mesh whose faces are polygons.
#[derive(Clone, Debug, Default)]
pub(super) struct PolygonFile {
    /// The vertices.
    pub positions: Vec<DVec3>,
    /// Vertices of all faces, one face after the other.
    pub corners: Vec<u32>,
    /// Corners of each face, 3 or more.
    pub face_sizes: Vec<u32>,
}

/// Reads the faces of an `.obj` file whole, with the vertices as they are numbered there. Normals and
/// texture coordinates are passed over.
///
/// # Errors
/// As [`read_mesh`], and where a coordinate cannot be used.
pub(super) fn read_polygons(path: &Path) -> Result<PolygonFile, ReadError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    if extension != "obj" {
        return Err(ReadError::file(path, "faces of any number of corners are read from: .obj"));
    }
    let polygons = obj::read_polygons(path)?;
    let is_usable = |p: &DVec3| p.abs().cmple(DVec3::splat(MAX_COORDINATE)).all();
    if let Some(vertex) = polygons.positions.iter().position(|p| !is_usable(p)) {
        let message = format!("vertex {} has a coordinate that is not within 1e18", vertex + 1);
        return Err(ReadError::file(path, message));
    }
    Ok(polygons)
}

/// Most vertices, and most triangles, that a mesh may have: ids are u32 and the last is taken.
const MAX_COUNT: u64 = u32::MAX as u64 - 1;

/// Largest coordinate that is taken for one; beyond it, squared distances overflow an f32.
pub(super) const MAX_COORDINATE: f64 = 1e18;

/// Checks a number of `what` ("vertices", "triangles") against what ids can name.
pub(super) fn check_count(path: &Path, n: u64, what: &str) -> Result<(), ReadError> {
    if n > MAX_COUNT {
        return Err(ReadError::file(path, format!("{n} {what}; at most {MAX_COUNT} are possible")));
    }
    Ok(())
}

/// Zeroed positions for `n` vertices, with room for the padding of [`Positions::from_flat`].
pub(super) fn zeroed_positions(n: usize) -> Vec<f32> {
    // Zeroed memory from the system is touched first by the threads that fill it.
    let mut xyz = vec![0.0; 3 * n + 1];
    prefer_large(&mut xyz);
    xyz.truncate(3 * n);
    xyz
}

/// Whether a triangle's corners are not on a line.
fn has_area(xyz: &[f32], triangle: &[u32; 3]) -> bool {
    let corner = |i: u32| {
        let at = 3 * i as usize;
        DVec3::new(xyz[at].into(), xyz[at + 1].into(), xyz[at + 2].into())
    };
    let [a, b, c] = triangle.map(corner);
    (b - a).cross(c - a) != DVec3::ZERO
}

/// `bounds` grown to hold `p`, unless `p` is not finite or absurdly far.
#[inline]
pub(super) fn include(bounds: &mut Bounds, p: DVec3) {
    if p.abs().cmple(DVec3::splat(MAX_COORDINATE)).all() {
        *bounds = bounds.including(p);
    }
}

/// The f32 of coordinate `value` relative to `origin`; NaN if it is beyond use.
#[inline]
pub(super) fn to_relative(value: f64, origin: f64) -> f32 {
    if value.abs() <= MAX_COORDINATE { (value - origin) as f32 } else { f32::NAN }
}

/// Chooses an origin for `xyz` (3 numbers a vertex) and converts them; for data given as f64.
pub(super) fn place(xyz: &[f64]) -> (DVec3, Vec<f32>) {
    const PART: usize = 3 << 16;
    let bounds = xyz
        .par_chunks(PART)
        .map(|part| {
            let mut bounds = Bounds::EMPTY;
            part.as_chunks::<3>().0.iter().for_each(|&p| include(&mut bounds, p.into()));
            bounds
        })
        .reduce(|| Bounds::EMPTY, Bounds::union);
    let origin = bounds.far_center();
    let mut relative = zeroed_positions(xyz.len() / 3);
    relative.par_chunks_mut(PART).zip(xyz.par_chunks(PART)).for_each(|(to, from)| {
        for (to, from) in to.as_chunks_mut::<3>().0.iter_mut().zip(from.as_chunks::<3>().0) {
            *to = [0, 1, 2].map(|k| to_relative(from[k], origin[k]));
        }
    });
    (origin, relative)
}

/// Converts `xyz` without a change of origin; for data of no more digits than an f32 has.
pub(super) fn to_f32(xyz: &[f64]) -> Vec<f32> {
    let mut out = zeroed_positions(xyz.len() / 3);
    for (to, &from) in out.iter_mut().zip(xyz) {
        *to = to_relative(from, 0.0);
    }
    out
}

/// What a reader has found, before the common checks.
#[derive(Default)]
pub(super) struct Draft {
    /// See [`TriangleMesh::origin`].
    pub origin: DVec3,
    /// Positions, 3 floats a vertex, best from [`zeroed_positions`].
    pub xyz: Vec<f32>,
    /// Every index is below the number of vertices.
    pub triangles: Vec<[u32; 3]>,
    /// None, or one a vertex.
    pub normals: Option<Vec<[f32; 3]>>,
    /// None, or one a vertex.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Faces left out for having fewer than 3 corners.
    pub small_faces: Tally,
    /// Polygons that were cut up by guess.
    pub guessed_faces: Tally,
    /// Warnings so far.
    pub warnings: Vec<String>,
}

/// Counts faces with a fault and remembers the first.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    /// How many.
    pub count: u64,
    /// The first one's place: "face 3", "line 12".
    pub first: String,
}

impl Tally {
    /// One more, at `place`.
    pub fn add(&mut self, place: impl FnOnce() -> String) {
        if self.count == 0 {
            self.first = place();
        }
        self.count += 1;
    }

    /// Adds the count of a later part of the file.
    pub fn append(&mut self, later: Self) {
        if self.count == 0 {
            self.first = later.first;
        }
        self.count += later.count;
    }
}

impl Draft {
    /// Drops what is not finite and makes the mesh.
    pub fn finish(mut self) -> MeshFile {
        debug_assert!(
            self.triangles.iter().flatten().all(|&i| (i as usize) < self.xyz.len() / 3),
            "readers check indices"
        );
        let Tally { count, first } = &self.small_faces;
        if *count > 0 {
            self.warnings.push(format!(
                "{} with fewer than 3 corners {} skipped; the first is {first}",
                counted(*count, "face"),
                was(*count),
            ));
        }
        let Tally { count, first } = &self.guessed_faces;
        if *count > 0 {
            self.warnings.push(format!(
                "{} whose outline crosses itself or is far from plane {} cut by guess; the first is {first}",
                counted(*count, "polygon"),
                was(*count),
            ));
        }
        let non_finite = self.drop_unusable_positions();
        if let Some(normals) = &mut self.normals {
            zero_unless_finite(normals);
        }
        if let Some(uvs) = &mut self.uvs {
            zero_unless_finite(uvs);
        }
        if self.triangles.is_empty() {
            let points = counted(self.xyz.len() as u64 / 3, "point");
            self.warnings.push(format!("no triangles ({points})"));
        // The first triangle that has an area ends the search.
        } else if !self.triangles.iter().any(|t| has_area(&self.xyz, t)) {
            self.warnings.push("no triangle has an area: there is nothing to see".to_owned());
        }
        // Growth by doubling may have left much unused; the mesh lives as long as the scene.
        if self.triangles.capacity() > self.triangles.len() + self.triangles.len() / 8 {
            self.triangles.shrink_to_fit();
        }
        let mesh = TriangleMesh {
            origin: self.origin,
            positions: Positions::from_flat(self.xyz),
            triangles: Arc::new(self.triangles),
            normals: self.normals.map(Arc::new),
            uvs: self.uvs.map(Arc::new),
        };
        MeshFile { mesh, warnings: self.warnings, non_finite }
    }

    /// Moves vertices with an unusable coordinate to the origin and drops their triangles.
    fn drop_unusable_positions(&mut self) -> Option<String> {
        let usable = |v: &f32| v.abs() <= MAX_COORDINATE as f32;
        if self.xyz.par_chunks(1 << 16).all(|part| part.iter().all(usable)) {
            return None;
        }
        // Mark them first: their coordinates are about to be zero.
        let mut is_bad = vec![false; self.xyz.len() / 3];
        for (p, is_bad) in self.xyz.as_chunks_mut::<3>().0.iter_mut().zip(&mut is_bad) {
            if !p.iter().all(usable) {
                *is_bad = true;
                *p = [0.0; 3];
            }
        }
        let touches = |t: &[u32; 3]| t.iter().any(|&v| is_bad[v as usize]);
        let first = self.triangles.iter().position(touches)?;
        let before = self.triangles.len();
        self.triangles.retain(|t| !touches(t));
        let dropped = (before - self.triangles.len()) as u64;
        self.warnings.push(format!(
            "{} with a NaN or infinite coordinate {} dropped; the first is triangle {first}",
            counted(dropped, "triangle"),
            was(dropped),
        ));
        let has = if dropped == 1 { "has" } else { "have" };
        let triangles = counted(dropped, "triangle");
        Some(format!(
            "{triangles} {has} a NaN or infinite coordinate; the first is triangle {first}"
        ))
    }
}

/// "1 face", "7 faces".
pub(super) fn counted(n: u64, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// The verb for `n` things.
pub(super) fn was(n: u64) -> &'static str {
    if n == 1 { "was" } else { "were" }
}

/// Sets each vector with a NaN or infinite component to zero, which stands for "none".
fn zero_unless_finite<const N: usize>(vectors: &mut [[f32; N]]) {
    vectors.par_chunks_mut(1 << 16).for_each(|part| {
        for v in part {
            if !v.iter().all(|c| c.is_finite()) {
                *v = [0.0; N];
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extension_decides() {
        for (name, expected) in [
            ("/nowhere/a.xyz", "unknown mesh file extension `.xyz`; accepted: .ply, .obj, .stl"),
            ("/nowhere/a", "no file extension; accepted: .ply, .obj, .stl"),
            ("/nowhere/a.PLY", "cannot open"),
            ("/nowhere/a.Obj", "cannot open"),
            ("/nowhere/a.STL", "cannot open"),
        ] {
            let text = read_mesh(Path::new(name)).unwrap_err().to_string();
            assert!(text.contains(expected), "{text}");
        }
    }

    #[test]
    fn near_data_keeps_the_origin() {
        let (origin, xyz) = place(&[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
        assert_eq!((origin, xyz), (DVec3::ZERO, vec![0.0, 0.0, 0.0, 1.0, 2.0, 3.0]));
        assert_eq!(place(&[]).0, DVec3::ZERO);
        assert_eq!(place(&[f64::NAN; 3]).0, DVec3::ZERO);
    }

    #[test]
    fn far_data_keeps_its_digits() {
        // Map coordinates in metres, a millimetre apart: as f32 they would be one point.
        let far = [471_234.001, 5_812_345.002, 33.0, 471_234.002, 5_812_346.0, 34.0];
        let (origin, xyz) = place(&far);
        assert_ne!(origin, DVec3::ZERO);
        for (i, (&exact, &relative)) in far.iter().zip(&xyz).enumerate() {
            assert!((origin[i % 3] + f64::from(relative) - exact).abs() < 1e-7);
        }
        // Few digits: a multiple of the power of two above the extent (here 0.998, so 1).
        assert_eq!(origin.fract(), DVec3::ZERO);
    }

    #[test]
    fn a_single_far_point_keeps_its_place() {
        let (origin, xyz) = place(&[1e6, -2e6, 0.1]);
        assert_eq!((origin, xyz), (DVec3::new(1e6, -2e6, 0.0), vec![0.0, 0.0, 0.1]));
    }

    #[test]
    fn unusable_coordinates_drop_their_triangles_once() {
        let mut xyz = vec![0.0_f32; 15];
        (xyz[3], xyz[10], xyz[14]) = (f32::NAN, f32::INFINITY, 2e18);
        let draft = Draft {
            xyz,
            triangles: vec![[0, 2, 2], [0, 1, 2], [2, 3, 4], [0, 0, 2]],
            normals: Some(vec![[1.0, f32::NAN, 0.0]; 5]),
            uvs: Some(vec![[f32::INFINITY, 0.0]; 5]),
            ..Draft::default()
        };
        let MeshFile { mesh, warnings, non_finite } = draft.finish();
        assert_eq!(
            non_finite.as_deref(),
            Some("2 triangles have a NaN or infinite coordinate; the first is triangle 1")
        );
        assert_eq!(*mesh.triangles, [[0, 2, 2], [0, 0, 2]]);
        assert!(mesh.positions.as_flat().iter().all(|v| v.is_finite()));
        assert_eq!(
            warnings,
            [
                "2 triangles with a NaN or infinite coordinate were dropped; the first is triangle 1",
                "no triangle has an area: there is nothing to see"
            ]
        );
        assert_eq!(mesh.normals.unwrap()[0], [0.0; 3]);
        assert_eq!(mesh.uvs.unwrap()[0], [0.0; 2]);
    }
}
