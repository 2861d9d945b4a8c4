//! Writing generated meshes as binary PLY or STL, in pieces: what is held is some chunks, whatever the
//! size of the mesh.

use std::io::Write;
use std::path::Path;

use glam::Vec3;
use rayon::prelude::*;

use super::error::WriteError;
use super::output::write_whole;
use crate::geometry::generate::GeneratedMesh;

/// Vertices or triangles that one task makes at a time.
const CHUNK: u64 = 1 << 14;

/// Writes `mesh` to a `.ply` or `.stl` file (binary, little-endian), whole or not at all. Triangles of
/// an STL hold their corners and normals. `progress` hears of it from 0 to 1 and ends it by returning
/// false.
///
/// # Errors
/// [`WriteError`] where the extension is another, the file cannot be written, or `progress` ended it;
/// the old file is then untouched.
pub fn write_mesh(
    path: &Path,
    mesh: &GeneratedMesh,
    progress: &dyn Fn(f64) -> bool,
) -> Result<(), WriteError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let is_ply = match extension.as_str() {
        "ply" => true,
        "stl" => false,
        _ => return Err(WriteError::format(path, "unknown kind of mesh; accepted: .ply, .stl")),
    };
    let (vertices, triangles) = (mesh.vertex_count(), mesh.triangle_count());
    write_whole(path, |file| {
        let failed = |e| WriteError::io(path, "write", e);
        let mut out =
            Chunks { path, progress, total: if is_ply { vertices } else { 0 } + triangles };
        let title = format!("alhazen generate {} --seed {}", mesh.kind().name(), mesh.seed());
        if is_ply {
            file.write_all(ply_header(&title, vertices, triangles).as_bytes()).map_err(failed)?;
            out.write(file, 0, vertices, |i, bytes| {
                mesh.vertex(i).iter().for_each(|x| bytes.extend(x.to_le_bytes()));
            })?;
            out.write(file, vertices, triangles, |i, bytes| {
                bytes.push(3);
                mesh.triangle(i).iter().for_each(|v| bytes.extend(v.to_le_bytes()));
            })
        } else {
            let mut header = [b' '; 80];
            header[..title.len()].copy_from_slice(title.as_bytes());
            file.write_all(&header).map_err(failed)?;
            file.write_all(&(triangles as u32).to_le_bytes()).map_err(failed)?;
            out.write(file, 0, triangles, |i, bytes| {
                let corners = mesh.triangle(i).map(|v| Vec3::from(mesh.vertex(v.into())));
                let [a, b, c] = corners;
                let normal = (b - a).cross(c - a).normalize_or_zero();
                for p in [normal, a, b, c] {
                    p.to_array().iter().for_each(|x| bytes.extend(x.to_le_bytes()));
                }
                bytes.extend([0, 0]);
            })
        }
    })
}

fn ply_header(title: &str, vertices: u64, triangles: u64) -> String {
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment {title}\n\
         element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {triangles}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
}

/// Things that are made in parallel and written in order.
struct Chunks<'a> {
    path: &'a Path,
    progress: &'a dyn Fn(f64) -> bool,
    /// Things in the whole file.
    total: u64,
}

impl Chunks<'_> {
    /// Writes `count` things, `before` of others being done, each as the bytes that `make` appends.
    fn write(
        &mut self,
        file: &mut impl Write,
        before: u64,
        count: u64,
        make: impl Fn(u64, &mut Vec<u8>) + Sync,
    ) -> Result<(), WriteError> {
        let chunks = count.div_ceil(CHUNK);
        // Some chunks a thread, so that one that takes longer holds nobody up.
        let mut buffers = vec![Vec::new(); 4 * rayon::current_num_threads()];
        let step = buffers.len() as u64;
        for first in (0..chunks).step_by(buffers.len()) {
            if !(self.progress)((before + first * CHUNK) as f64 / self.total as f64) {
                return Err(WriteError::Interrupted);
            }
            let batch = step.min(chunks - first) as usize;
            buffers[..batch].par_iter_mut().enumerate().for_each(|(k, bytes)| {
                bytes.clear();
                let start = (first + k as u64) * CHUNK;
                (start..count.min(start + CHUNK)).for_each(|i| make(i, bytes));
            });
            for bytes in &buffers[..batch] {
                file.write_all(bytes).map_err(|e| WriteError::io(self.path, "write", e))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::generate::GeneratedKind;
    use crate::io::read_mesh;

    #[test]
    fn what_is_written_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        for kind in GeneratedKind::ALL {
            let mesh = GeneratedMesh::new(kind, 40_000, 3).unwrap();
            let ply = folder.path().join("a.PLY");
            write_mesh(&ply, &mesh, &|_| true).unwrap();
            let read = read_mesh(&ply).unwrap();
            assert!(read.warnings.is_empty(), "{:?}", read.warnings);
            assert_eq!(read.mesh.triangles.len() as u64, mesh.triangle_count());
            assert_eq!(read.mesh.positions.len() as u64, mesh.vertex_count());
            for i in 0..mesh.triangle_count() {
                assert_eq!(read.mesh.triangles[i as usize], mesh.triangle(i));
            }
            for i in 0..mesh.vertex_count() {
                assert_eq!(read.mesh.positions.get(i as usize).to_array(), mesh.vertex(i));
            }

            let stl = folder.path().join("a.stl");
            write_mesh(&stl, &mesh, &|_| true).unwrap();
            let read = read_mesh(&stl).unwrap().mesh;
            assert_eq!(read.triangles.len() as u64, mesh.triangle_count());
            for i in (0..mesh.triangle_count()).step_by(17) {
                let corners = mesh.triangle(i).map(|v| Vec3::from(mesh.vertex(v.into())));
                assert_eq!(read.corners(i as usize), corners);
            }
        }
    }

    #[test]
    fn interrupted_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        std::fs::write(&path, "old").unwrap();
        let mesh = GeneratedMesh::new(GeneratedKind::Terrain, 1_000_000, 0).unwrap();
        let result = write_mesh(&path, &mesh, &|done| done < 0.5);
        assert!(matches!(result, Err(WriteError::Interrupted)));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
