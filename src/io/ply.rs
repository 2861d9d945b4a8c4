//! PLY files (Greg Turk, "The PLY Polygon File Format", 1994): text or bytes of either order.
//!
//! The header may declare any elements and properties; what is not a position, normal, texture
//! coordinate, face or triangle strip is read over. Binary files whose vertices have no lists and
//! whose faces are all triangles are read by all threads at once ([`parallel`]); others one record
//! at a time ([`values`]).

mod header;
mod parallel;
mod values;

use std::path::Path;

use glam::DVec3;

use self::header::{Element, Format, Header};
use self::values::{Ascii, Binary, Values};
use super::error::ReadError;
use super::memory::check_memory;
use super::mesh::{Draft, MeshFile, check_count, place};
use super::polygon::Cutter;
use super::source::Source;

/// Names of the list of corners.
const INDEX_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads a PLY file; see [`super::mesh::read_mesh`].
pub(super) fn read(path: &Path) -> Result<MeshFile, ReadError> {
    let source = Source::open(path)?;
    let header = header::read(&source)?;
    match header.format {
        Format::Ascii => {
            let mut values = Ascii::new(&source, header.body, header.lines)?;
            read_body(path, &header, &mut values)
        }
        Format::Little => read_body(path, &header, &mut Binary::<false>::new(&source, header.body)),
        Format::Big => read_body(path, &header, &mut Binary::<true>::new(&source, header.body)),
    }
}

/// Which properties of a vertex are what.
struct VertexLayout {
    xyz: [usize; 3],
    normal: Option<[usize; 3]>,
    uv: Option<[usize; 2]>,
}

impl VertexLayout {
    fn new(path: &Path, element: &Element) -> Result<Self, ReadError> {
        let find = |name| element.find(&[name]).filter(|&p| element.properties[p].count.is_none());
        let all =
            |names: [&'static str; 3]| Some([find(names[0])?, find(names[1])?, find(names[2])?]);
        let pair = |(u, v)| Some([find(u)?, find(v)?]);
        let xyz = all(["x", "y", "z"]).ok_or_else(|| {
            ReadError::file(path, "element `vertex` lacks one of the properties x, y, z")
        })?;
        let names =
            [("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texture_s", "texture_t")];
        Ok(Self { xyz, normal: all(["nx", "ny", "nz"]), uv: names.into_iter().find_map(pair) })
    }
}

/// What the vertices hold.
#[derive(Default)]
struct Vertices {
    origin: DVec3,
    xyz: Vec<f32>,
    normals: Option<Vec<[f32; 3]>>,
    uvs: Option<Vec<[f32; 2]>>,
}

fn read_body<V: Values>(
    path: &Path,
    header: &Header,
    values: &mut V,
) -> Result<MeshFile, ReadError> {
    let is_faces = |e: &Element| matches!(e.name.as_str(), "face" | "tristrips");
    let is_vertices = |e: &Element| e.name == "vertex";
    // What follows the last element of use is not looked at.
    let used = header.elements.iter().rposition(|e| is_faces(e) || is_vertices(e));
    let has_vertices = header.elements.iter().any(is_vertices);

    // Faces may stand before the vertices, which it takes to cut polygons: they wait.
    let mut draft: Option<Draft> = None;
    let mut waiting = Vec::new();
    for element in header.elements.iter().take(used.map_or(0, |last| last + 1)) {
        match &mut draft {
            None if is_vertices(element) => {
                check_memory(path, array_bytes(header, values.left()))?;
                let Vertices { origin, xyz, normals, uvs } = read_vertices(path, element, values)?;
                draft = Some(Draft { origin, xyz, normals, uvs, ..Draft::default() });
            }
            Some(draft) if is_faces(element) => read_faces(path, element, values, draft)?,
            None if is_faces(element) && has_vertices => {
                waiting.push((element, values.position()));
                values.skip_element(element)?;
            }
            None if is_faces(element) && element.count > 0 => {
                return Err(ReadError::file(path, "the header has faces but no element `vertex`"));
            }
            _ => values.skip_element(element)?,
        }
    }
    let mut draft = draft.unwrap_or_default();
    for (element, position) in waiting {
        values.seek(position);
        read_faces(path, element, values, &mut draft)?;
    }
    Ok(draft.finish())
}

/// Bytes of the arrays of all vertices and triangles, if faces are triangles; never out of proportion
/// to the `left` bytes of the file, whatever the header claims.
fn array_bytes(header: &Header, left: u64) -> u64 {
    let count = |name| header.elements.iter().filter(move |e| e.name == name).map(|e| e.count);
    let sum = |name: &'static str| count(name).fold(0, u64::saturating_add);
    // A vertex takes three bytes of a file at least, a face four.
    12 * (sum("vertex").min(left / 3) + sum("face").min(left / 4))
}

fn read_vertices<V: Values>(
    path: &Path,
    element: &Element,
    values: &mut V,
) -> Result<Vertices, ReadError> {
    check_count(path, element.count, "vertices")?;
    if element.count == 0 {
        return Ok(Vertices::default());
    }
    let layout = VertexLayout::new(path, element)?;
    values.check_room(element)?;
    if let Some(vertices) = values.vertices_at_once(element, &layout)? {
        return Ok(vertices);
    }

    // One by one; all positions as f64, since text may give more digits than an f32 holds.
    let n = element.count as usize;
    let mut xyz = Vec::with_capacity(3 * n);
    let mut normals = layout.normal.map(|slots| (slots, Vec::with_capacity(n)));
    let mut uvs = layout.uv.map(|slots| (slots, Vec::with_capacity(n)));
    let mut record = vec![0.0; element.properties.len()];
    for _ in 0..n {
        for (value, property) in record.iter_mut().zip(&element.properties) {
            match property.count {
                None => *value = values.number(property.item)?,
                Some(ty) => {
                    let len = values.list_len(ty)?;
                    values.skip(property.item, len)?;
                }
            }
        }
        xyz.extend(layout.xyz.map(|p| record[p]));
        if let Some((slots, normals)) = &mut normals {
            normals.push(slots.map(|p| record[p] as f32));
        }
        if let Some((slots, uvs)) = &mut uvs {
            uvs.push(slots.map(|p| record[p] as f32));
        }
    }
    let is_wide = layout.xyz.iter().any(|&p| element.properties[p].item.is_wide());
    let (origin, xyz) =
        if is_wide { place(&xyz) } else { (DVec3::ZERO, super::mesh::to_f32(&xyz)) };
    Ok(Vertices { origin, xyz, normals: normals.map(|n| n.1), uvs: uvs.map(|n| n.1) })
}

/// Appends the triangles of `element`, a table of faces or of strips, to `draft`.
fn read_faces<V: Values>(
    path: &Path,
    element: &Element,
    values: &mut V,
    draft: &mut Draft,
) -> Result<(), ReadError> {
    check_count(path, element.count, "faces")?;
    if element.count == 0 {
        return Ok(());
    }
    let (list, count_type, index_type) = element
        .find(&INDEX_NAMES)
        .and_then(|p| Some((p, element.properties[p].count?, element.properties[p].item)))
        .filter(|(.., ty)| ty.is_integer())
        .ok_or_else(|| {
            let message = format!(
                "element `{}` lacks a list of whole numbers called vertex_indices or vertex_index",
                element.name
            );
            ReadError::file(path, message)
        })?;
    values.check_room(element)?;
    let is_strips = element.name == "tristrips";
    let vertex_count = draft.xyz.len() / 3;
    if !is_strips
        && draft.triangles.is_empty()
        && let Some(triangles) = values.triangles_at_once(element, list, vertex_count)?
    {
        draft.triangles = triangles;
        return Ok(());
    }

    // One by one. A face of n corners gives n - 2 triangles.
    let corners = values.expected_items(element, index_type);
    let expected = if is_strips { corners } else { corners.saturating_sub(2 * element.count) };
    draft.triangles.reserve(expected.min(u64::from(u32::MAX)) as usize);
    let mut polygons = Polygons::new(draft);
    let mut indices = Vec::new();
    for face in 0..element.count {
        let at = values.position();
        for (p, property) in element.properties.iter().enumerate() {
            match property.count {
                None => values.skip(property.item, 1)?,
                Some(_) if p == list => {
                    let n = values.list_len(count_type)?;
                    values.integers(index_type, n, &mut indices)?;
                }
                Some(ty) => {
                    let n = values.list_len(ty)?;
                    values.skip(property.item, n)?;
                }
            }
        }
        let added = if is_strips {
            polygons.add_strips(&indices)
        } else {
            polygons.add_face(face, &indices)
        };
        added.map_err(|index| values.error(at, bad_index(face, index, vertex_count)))?;
        check_count(path, polygons.draft.triangles.len() as u64, "triangles")?;
    }
    Ok(())
}

/// The message for a face that names a vertex which is not there.
fn bad_index(face: u64, index: i64, vertex_count: usize) -> String {
    format!(
        "face {face} names vertex {index}, but the number of vertices is {vertex_count} (the first \
         is 0)"
    )
}

/// Cuts faces into triangles and appends them to a draft.
struct Polygons<'a> {
    draft: &'a mut Draft,
    cutter: Cutter,
    corners: Vec<DVec3>,
    cuts: Vec<[u32; 3]>,
}

impl<'a> Polygons<'a> {
    fn new(draft: &'a mut Draft) -> Self {
        Self { draft, cutter: Cutter::default(), corners: Vec::new(), cuts: Vec::new() }
    }

    /// `index` as a vertex; it is the error itself if there is no such vertex.
    fn vertex(&self, index: i64) -> Result<u32, i64> {
        let is_there = |&i: &u32| (i as usize) < self.draft.xyz.len() / 3;
        u32::try_from(index).ok().filter(is_there).ok_or(index)
    }

    /// Adds a polygon; the error is an index that names no vertex.
    fn add_face(&mut self, face: u64, indices: &[i64]) -> Result<(), i64> {
        if let &[a, b, c] = indices {
            let triangle = [self.vertex(a)?, self.vertex(b)?, self.vertex(c)?];
            self.draft.triangles.push(triangle);
            return Ok(());
        }
        self.corners.clear();
        for &index in indices {
            let v = 3 * self.vertex(index)? as usize;
            let p = &self.draft.xyz[v..v + 3];
            self.corners.push(DVec3::new(p[0].into(), p[1].into(), p[2].into()));
        }
        if indices.len() < 3 {
            self.draft.small_faces.add(|| format!("face {face}"));
            return Ok(());
        }
        self.cuts.clear();
        if !self.cutter.cut(&self.corners, &mut self.cuts) {
            self.draft.guessed_faces.add(|| format!("face {face}"));
        }
        // In range: all of them were looked up above.
        let vertices = |cut: &[u32; 3]| cut.map(|corner| indices[corner as usize] as u32);
        self.draft.triangles.extend(self.cuts.iter().map(vertices));
        Ok(())
    }

    /// Adds triangle strips, one after another with -1 in between. Every other triangle of a strip
    /// turns the other way; those that name a vertex twice only join two strips and are left out.
    fn add_strips(&mut self, indices: &[i64]) -> Result<(), i64> {
        for strip in indices.split(|&i| i == -1) {
            for &index in strip {
                self.vertex(index)?;
            }
            for (i, t) in strip.windows(3).enumerate() {
                if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
                    continue;
                }
                let [a, b, c] = [t[0] as u32, t[1] as u32, t[2] as u32];
                self.draft.triangles.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
