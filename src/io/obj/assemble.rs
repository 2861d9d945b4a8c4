//! From the statements of an OBJ file to a mesh: vertices that carry all their attributes, and
//! triangles.

use std::path::Path;

use glam::DVec3;

use super::{Links, NONE, Parsed};
use crate::io::distinct::Distinct;
use crate::io::error::ReadError;
use crate::io::mesh::{Draft, MeshFile, check_count, place, zeroed_positions};
use crate::io::polygon::Cutter;

/// Makes the mesh.
pub(super) fn mesh(path: &Path, mut parsed: Parsed) -> Result<MeshFile, ReadError> {
    let mut draft =
        Draft { small_faces: std::mem::take(&mut parsed.small_faces), ..Draft::default() };
    if let Some((line, keyword)) = parsed.first_unknown.take() {
        if parsed.known == 0 {
            let message = format!("not an obj file: line {line} begins with {keyword}");
            return Err(ReadError::file(path, message));
        }
        draft.warnings.push(format!(
            "statements that are not understood were ignored; the first is {keyword} in line {line}"
        ));
    }
    let has_vt = is_complete(&parsed.corner_vt, "texture coordinates", &parsed, &mut draft);
    let has_vn = is_complete(&parsed.corner_vn, "normals", &parsed, &mut draft);
    if !has_vt {
        (parsed.vt, parsed.corner_vt) = Default::default();
    }
    if !has_vn {
        (parsed.vn, parsed.corner_vn) = Default::default();
    }
    (draft.origin, draft.xyz) = place(&parsed.v);
    parsed.v = Vec::new();

    if is_same(&parsed.corners, &parsed.corner_vt) && is_same(&parsed.corners, &parsed.corner_vn) {
        // A vertex has one of each: take the lists as they are, cut or filled up to one a vertex.
        let n = draft.xyz.len() / 3;
        if has_vt {
            parsed.vt.resize(n, [0.0; 2]);
            draft.uvs = Some(std::mem::take(&mut parsed.vt));
        }
        if has_vn {
            parsed.vn.resize(n, [0.0; 3]);
            draft.normals = Some(std::mem::take(&mut parsed.vn));
        }
        triangulate(path, &parsed, None, &mut draft)?;
        return Ok(draft.finish());
    }

    // Otherwise a vertex of the mesh is a combination that occurs.
    let mut distinct = Distinct::with_capacity(draft.xyz.len() / 3);
    let link = |links: &Links, at: usize| links.of_corner.get(at).copied().unwrap_or(0);
    let vertex_of_corner = parsed
        .corners
        .iter()
        .enumerate()
        .map(|(at, &v)| {
            distinct.number([v, link(&parsed.corner_vt, at), link(&parsed.corner_vn, at)])
        })
        .collect::<Option<Vec<u32>>>()
        .ok_or_else(|| ReadError::file(path, "too many vertices for 32-bit ids"))?;
    // Polygons are cut by the positions as they were.
    triangulate(path, &parsed, Some(&vertex_of_corner), &mut draft)?;
    let keys = distinct.into_keys();
    let mut xyz = zeroed_positions(keys.len());
    for (p, key) in xyz.as_chunks_mut::<3>().0.iter_mut().zip(&keys) {
        let v = 3 * key[0] as usize;
        p.copy_from_slice(&draft.xyz[v..v + 3]);
    }
    draft.xyz = xyz;
    draft.uvs = has_vt.then(|| keys.iter().map(|key| parsed.vt[key[1] as usize]).collect());
    draft.normals = has_vn.then(|| keys.iter().map(|key| parsed.vn[key[2] as usize]).collect());
    Ok(draft.finish())
}

/// Whether every corner has one of `what`; if only some have, a warning says that they are lost.
fn is_complete(links: &Links, what: &str, parsed: &Parsed, draft: &mut Draft) -> bool {
    if let Some((line, fault)) = &links.first_bad {
        draft.warnings.push(format!(
            "the {what} were dropped: indices are out of range, the first in line {line} ({fault})"
        ));
        return false;
    }
    if links.of_corner.is_empty() {
        return false;
    }
    // Those of the last corners may be missing from the list.
    let missing = links.of_corner.iter().filter(|&&i| i == NONE).count() + parsed.corners.len()
        - links.of_corner.len();
    if missing > 0 {
        draft.warnings.push(format!(
            "the {what} were dropped: {missing} of {} corners of faces have none",
            parsed.corners.len()
        ));
    }
    missing == 0
}

/// Whether the corners' links, if there are any, are the same as their vertices.
fn is_same(corners: &[u32], links: &Links) -> bool {
    links.of_corner.is_empty() || links.of_corner == corners
}

/// Cuts the faces into triangles of `vertex_of_corner`, or of the positions themselves.
fn triangulate(
    path: &Path,
    parsed: &Parsed,
    vertex_of_corner: Option<&[u32]>,
    draft: &mut Draft,
) -> Result<(), ReadError> {
    let vertices = vertex_of_corner.unwrap_or(&parsed.corners);
    let count = parsed.corners.len() - 2 * parsed.face_sizes.len();
    check_count(path, count as u64, "triangles")?;
    if parsed.polygon_lines.is_empty() {
        draft.triangles = vertices.as_chunks::<3>().0.to_vec();
        return Ok(());
    }
    draft.triangles.reserve_exact(count);
    let mut cutter = Cutter::default();
    let (mut points, mut cuts) = (Vec::new(), Vec::new());
    let mut polygon_lines = parsed.polygon_lines.iter();
    let mut at = 0;
    for &size in &parsed.face_sizes {
        let corners = at..at + size as usize;
        at = corners.end;
        let face = &vertices[corners.clone()];
        if let &[a, b, c] = face {
            draft.triangles.push([a, b, c]);
            continue;
        }
        let line = polygon_lines.next();
        points.clear();
        points.extend(parsed.corners[corners].iter().map(|&v| {
            let p = &draft.xyz[3 * v as usize..][..3];
            DVec3::new(p[0].into(), p[1].into(), p[2].into())
        }));
        cuts.clear();
        if !cutter.cut(&points, &mut cuts) {
            draft
                .guessed_faces
                .add(|| line.map_or(String::new(), |line| format!("in line {line}")));
        }
        draft.triangles.extend(cuts.iter().map(|cut| cut.map(|i| face[i as usize])));
    }
    Ok(())
}
