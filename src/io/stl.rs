//! STL files (3D Systems, "Stereolithography Interface Specification", 1988), text and binary.
//!
//! STL gives three corners a triangle; those in one place are welded to one vertex. Facet normals
//! are not read: they say nothing that the corners do not, and are often wrong.

mod ascii;

use std::path::Path;

use rayon::prelude::*;

use super::distinct::Distinct;
use super::error::ReadError;
use super::memory::check_memory;
use super::mesh::{Draft, MeshFile, check_count, zeroed_positions};
use super::source::Source;
use crate::pages::prefer_large;

/// Bytes in front of the triangles of a binary file: 80 of comment and the number of triangles.
const HEADER: u64 = 84;

/// Bytes of a triangle of a binary file: normal, three corners, two bytes of anything.
const RECORD: usize = 50;

/// Triangles that one task reads and welds at a time: some 3 MB.
const PER_CHUNK: usize = 1 << 16;

/// Reads an STL file; see [`super::mesh::read_mesh`].
pub(super) fn read(path: &Path) -> Result<MeshFile, ReadError> {
    let source = Source::open(path)?;
    let mut start = vec![0; source.len.min(1 << 16) as usize];
    source.read_at(&mut start, 0)?;
    let declared = start.get(80..84).map(|b| b.iter().rev().fold(0, |n, &b| n << 8 | u64::from(b)));
    // The size decides first: many binary files begin with "solid" too.
    let binary_len = declared.map(|n| HEADER + n * RECORD as u64);
    if binary_len != Some(source.len) && ascii::is_ascii(&start) {
        return ascii::read(&source);
    }
    let (Some(count), Some(binary_len)) = (declared, binary_len) else {
        let message = "not an stl file: neither text that begins with `solid` and has facets, nor \
                       the 84 bytes that a binary file begins with";
        return Err(ReadError::file(path, message));
    };
    if binary_len > source.len {
        let message = format!(
            "the file ends too early: {count} triangles need {binary_len} bytes, it has {}",
            source.len
        );
        return Err(ReadError::byte(path, 80, message));
    }
    // Indices, and in a closed mesh half a vertex a triangle; welding takes some more.
    check_memory(path, count * 30)?;
    let mut draft = read_binary(&source, count)?;
    if source.len > binary_len {
        let message =
            format!("{} bytes after the last triangle were ignored", source.len - binary_len);
        draft.warnings.push(message);
    }
    Ok(draft.finish())
}

/// Part of a binary file, welded in itself.
struct Part {
    /// Corners in different places, as bits of f32.
    places: Vec<[u32; 3]>,
    /// Triangles of `places`.
    triangles: Vec<[u32; 3]>,
}

fn read_binary(source: &Source, count: u64) -> Result<Draft, ReadError> {
    check_count(source.path, count, "triangles")?;
    let n = count as usize;
    let mut triangles = vec![[0_u32; 3]; n];
    prefer_large(&mut triangles);
    // A closed mesh has half as many vertices as triangles.
    let mut vertices = Distinct::with_capacity(n / 2 + 16);
    let chunks = n.div_ceil(PER_CHUNK);
    let at_once = 4 * rayon::current_num_threads();
    for first in (0..chunks).step_by(at_once) {
        // Most corners have met by the end of a chunk, in a table small enough for the cache …
        let parts: Vec<Part> = (first..chunks.min(first + at_once))
            .into_par_iter()
            .map_init(Vec::new, |buf, chunk| {
                let from = chunk * PER_CHUNK;
                let len = PER_CHUNK.min(n - from) * RECORD;
                let offset = HEADER + (from * RECORD) as u64;
                Ok(weld_records(source.read_into(buf, len, offset)?))
            })
            .collect::<Result<_, ReadError>>()?;
        // … so that few are left to weld between chunks, in the order of the file.
        let done = &mut triangles[first * PER_CHUNK..];
        for (part, out) in parts.into_iter().zip(done.chunks_mut(PER_CHUNK)) {
            let ids = number_all(source.path, &mut vertices, &part.places)?;
            for (out, triangle) in out.iter_mut().zip(part.triangles) {
                *out = triangle.map(|v| ids[v as usize]);
            }
        }
    }
    let mut draft = Draft { triangles, ..Draft::default() };
    draft.xyz = positions(vertices);
    Ok(draft)
}

fn weld_records(bytes: &[u8]) -> Part {
    let mut places = Distinct::with_capacity(bytes.len() / RECORD / 2 + 16);
    let mut triangles = Vec::with_capacity(bytes.len() / RECORD);
    for record in bytes.as_chunks::<RECORD>().0 {
        let corners = record[12..48].as_chunks::<12>().0;
        triangles.push([0, 1, 2].map(|k| {
            let place = [0, 4, 8].map(|o| {
                let c = &corners[k][o..o + 4];
                key(f32::from_le_bytes([c[0], c[1], c[2], c[3]]))
            });
            // A chunk has far fewer corners than there are ids.
            places.number(place).unwrap_or(0)
        }));
    }
    Part { places: places.into_keys(), triangles }
}

/// The bits of a coordinate; the same for 0 and -0.
fn key(coordinate: f32) -> u32 {
    (coordinate + 0.0).to_bits()
}

fn number_all(
    path: &Path,
    vertices: &mut Distinct,
    places: &[[u32; 3]],
) -> Result<Vec<u32>, ReadError> {
    places
        .iter()
        .map(|&place| vertices.number(place))
        .collect::<Option<_>>()
        .ok_or_else(|| ReadError::file(path, "too many vertices for 32-bit ids"))
}

/// The places of welded vertices.
fn positions(vertices: Distinct) -> Vec<f32> {
    let keys = vertices.into_keys();
    let mut xyz = zeroed_positions(keys.len());
    for (p, key) in xyz.as_chunks_mut::<3>().0.iter_mut().zip(keys) {
        *p = key.map(f32::from_bits);
    }
    xyz
}

#[cfg(test)]
mod tests;
