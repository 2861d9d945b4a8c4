//! The common case of a binary PLY file, at the speed of the disk: records of one size, read by
//! all threads at known offsets and converted straight into the final arrays.

use rayon::prelude::*;

use super::header::{Element, Scalar};
use super::values::{decode, decode_f32, decode_integer, decode_u32};
use super::{VertexLayout, Vertices};
use crate::io::error::ReadError;
use crate::io::mesh::{include, to_relative, zeroed_positions};
use crate::io::source::{CHUNK, Source};
use crate::math::Bounds;
use crate::pages::prefer_large;

/// The offset and type of a number in a record.
type Slot = (usize, Scalar);

/// Offsets of properties in a record whose lists before them have 3 items.
fn slot(element: &Element, property: usize) -> Slot {
    let before = Element { properties: element.properties[..property].to_vec(), ..element.clone() };
    (before.record_size(3), element.properties[property].item)
}

/// Reads the vertices, whose records are of one size and begin at `start`; the caller has checked
/// that the file holds them all.
pub(super) fn vertices<const BIG: bool>(
    source: &Source,
    start: u64,
    element: &Element,
    layout: &VertexLayout,
) -> Result<Vertices, ReadError> {
    let stride = element.record_size(0);
    let n = element.count as usize;
    let per_chunk = (CHUNK / stride).max(1);
    let offset = |chunk: usize| start + (chunk * per_chunk * stride) as u64;
    let xyz_slots = layout.xyz.map(|p| slot(element, p));

    // Numbers of more digits than an f32 has may need an origin, which takes a look at them all.
    let mut origin = glam::DVec3::ZERO;
    if xyz_slots.iter().any(|s| s.1.is_wide()) {
        origin = (0..n.div_ceil(per_chunk))
            .into_par_iter()
            .map_init(Vec::new, |buf, chunk| {
                let len = per_chunk.min(n - chunk * per_chunk) * stride;
                let bytes = source.read_into(buf, len, offset(chunk))?;
                let mut bounds = Bounds::EMPTY;
                for record in bytes.chunks_exact(stride) {
                    let xyz = xyz_slots.map(|(o, ty)| decode::<BIG>(ty, &record[o..]));
                    include(&mut bounds, xyz.into());
                }
                Ok::<_, ReadError>(bounds)
            })
            .try_reduce(|| Bounds::EMPTY, |a, b| Ok(a.union(b)))?
            .far_center();
    }

    let mut xyz = zeroed_positions(n);
    let mut normals = layout.normal.map(|p| (p.map(|p| slot(element, p)), vec![[0.0_f32; 3]; n]));
    let mut uvs = layout.uv.map(|p| (p.map(|p| slot(element, p)), vec![[0.0_f32; 2]; n]));

    // One task a chunk, with its part of each array.
    struct Task<'a> {
        xyz: &'a mut [f32],
        normals: Option<([Slot; 3], &'a mut [[f32; 3]])>,
        uvs: Option<([Slot; 2], &'a mut [[f32; 2]])>,
    }
    let mut normal_parts = normals.as_mut().map(|(slots, v)| (*slots, v.chunks_mut(per_chunk)));
    let mut uv_parts = uvs.as_mut().map(|(slots, v)| (*slots, v.chunks_mut(per_chunk)));
    let tasks: Vec<Task> = xyz
        .chunks_mut(3 * per_chunk)
        .map(|xyz| Task {
            xyz,
            normals: normal_parts.as_mut().and_then(|(slots, parts)| Some((*slots, parts.next()?))),
            uvs: uv_parts.as_mut().and_then(|(slots, parts)| Some((*slots, parts.next()?))),
        })
        .collect();
    tasks.into_par_iter().enumerate().try_for_each_init(Vec::new, |buf, (chunk, task)| {
        let bytes = source.read_into(buf, task.xyz.len() / 3 * stride, offset(chunk))?;
        positions::<BIG>(bytes, stride, xyz_slots, origin, task.xyz);
        if let Some((slots, out)) = task.normals {
            vectors::<BIG, 3>(bytes, stride, slots, out);
        }
        if let Some((slots, out)) = task.uvs {
            vectors::<BIG, 2>(bytes, stride, slots, out);
        }
        Ok::<_, ReadError>(())
    })?;
    Ok(Vertices { origin, xyz, normals: normals.map(|n| n.1), uvs: uvs.map(|n| n.1) })
}

/// Converts the positions in `bytes`.
fn positions<const BIG: bool>(
    bytes: &[u8],
    stride: usize,
    slots: [Slot; 3],
    origin: glam::DVec3,
    out: &mut [f32],
) {
    let out = out.as_chunks_mut::<3>().0.iter_mut();
    let records = bytes.chunks_exact(stride);
    let o = slots[0].0;
    if slots == [(o, Scalar::F32), (o + 4, Scalar::F32), (o + 8, Scalar::F32)] {
        for (out, record) in out.zip(records) {
            let b = &record[o..o + 12];
            *out = [&b[..4], &b[4..8], &b[8..]].map(decode_f32::<BIG>);
        }
        return;
    }
    let origin = origin.to_array();
    for (out, record) in out.zip(records) {
        *out = [0, 1, 2].map(|k| {
            let (o, ty) = slots[k];
            to_relative(decode::<BIG>(ty, &record[o..]), origin[k])
        });
    }
}

/// Converts normals or texture coordinates.
fn vectors<const BIG: bool, const N: usize>(
    bytes: &[u8],
    stride: usize,
    slots: [Slot; N],
    out: &mut [[f32; N]],
) {
    for (out, record) in out.iter_mut().zip(bytes.chunks_exact(stride)) {
        *out = slots.map(|(o, ty)| decode::<BIG>(ty, &record[o..]) as f32);
    }
}

/// Why a chunk of faces was not converted to its end.
enum Stop {
    /// A face is no triangle: this and all later records are not where they were looked for.
    Polygon,
    /// A face names a vertex that is not there.
    Index { face: usize, index: i64 },
    /// The file cannot be read.
    Read(ReadError),
}

/// Reads the faces, whose records begin at `start`, if all are triangles; `None` if they are not.
pub(super) fn triangles<const BIG: bool>(
    source: &Source,
    start: u64,
    element: &Element,
    list: usize,
    vertex_count: usize,
) -> Result<Option<Vec<[u32; 3]>>, ReadError> {
    // The indices must be the only list, or records would not be of one size.
    let (offset, index_type) = slot(element, list);
    let Some(count_type) = element.properties[list].count else { return Ok(None) };
    if element.properties.iter().filter(|p| p.count.is_some()).count() != 1 {
        return Ok(None);
    }
    let stride = element.record_size(3);
    let left = source.len.saturating_sub(start);
    if u128::from(element.count) * stride as u128 > u128::from(left) {
        return Ok(None);
    }
    let n = element.count as usize;
    let per_chunk = (CHUNK / stride).max(1);
    let indices_at = offset + count_type.size();
    let is_common = count_type == Scalar::U8 && index_type.size() == 4;

    let mut triangles = vec![[0_u32; 3]; n];
    prefer_large(&mut triangles);
    let stop = triangles
        .par_chunks_mut(per_chunk)
        .enumerate()
        .map_init(Vec::new, |buf, (chunk, out)| {
            let first = chunk * per_chunk;
            let bytes = source
                .read_into(buf, out.len() * stride, start + (first * stride) as u64)
                .map_err(Stop::Read)?;
            for (i, (out, record)) in out.iter_mut().zip(bytes.chunks_exact(stride)).enumerate() {
                if is_common {
                    let b = &record[offset..offset + 13];
                    if b[0] != 3 {
                        return Err(Stop::Polygon);
                    }
                    // An i32 below zero is a u32 above all indices.
                    *out = [&b[1..5], &b[5..9], &b[9..13]].map(decode_u32::<BIG>);
                    if out.iter().all(|&i| (i as usize) < vertex_count) {
                        continue;
                    }
                }
                if decode_integer::<BIG>(count_type, &record[offset..]) != 3 {
                    return Err(Stop::Polygon);
                }
                for (k, out) in out.iter_mut().enumerate() {
                    let at = indices_at + k * index_type.size();
                    let index = decode_integer::<BIG>(index_type, &record[at..]);
                    *out = u32::try_from(index)
                        .ok()
                        .filter(|&i| (i as usize) < vertex_count)
                        .ok_or(Stop::Index { face: first + i, index })?;
                }
            }
            Ok(())
        })
        // The first in the order of the file: after a polygon, nothing is what it seems.
        .find_map_first(Result::err);
    match stop {
        None => Ok(Some(triangles)),
        Some(Stop::Polygon) => Ok(None),
        Some(Stop::Read(error)) => Err(error),
        Some(Stop::Index { face, index }) => Err(ReadError::byte(
            source.path,
            start + (face * stride) as u64,
            super::bad_index(face as u64, index, vertex_count),
        )),
    }
}
