//! OBJ files (Wavefront, "Object Files (.obj)", appendix B1 of the Advanced Visualizer manual):
//! polygons with normals and texture coordinates. Materials, groups, points, lines and curves are
//! passed over.
//!
//! The file is read whole and cut at line ends into pieces. A first pass counts the vertices of
//! each piece, so that in the second, which parses them in parallel, relative indices are known.

mod assemble;
mod lines;

use std::path::Path;

use rayon::prelude::*;

use self::lines::{Line, Lines, Words};
use super::error::ReadError;
use super::mesh::{MeshFile, PolygonFile, Tally, check_count};
use super::source::Source;
use super::text::{parse_integer, parse_number, quoted};

/// Bytes that one task parses at a time.
const PIECE: usize = 1 << 20;

/// Stands for "none" among indices.
const NONE: u32 = u32::MAX;

/// Statements without bearing on the triangles.
const IGNORED: [&[u8]; 15] = [
    b"p",
    b"l",
    b"g",
    b"o",
    b"s",
    b"mg",
    b"usemtl",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"shadow_obj",
];

/// Reads an OBJ file; see [`super::mesh::read_mesh`].
pub(super) fn read(path: &Path) -> Result<MeshFile, ReadError> {
    let bytes = lines::normalize(Source::open(path)?.read_from(0)?);
    let parsed = parse(path, &bytes, PIECE)?;
    drop(bytes);
    assemble::mesh(path, parsed)
}

/// Reads the faces of an OBJ file as they are; see [`super::mesh::read_polygons`].
pub(super) fn read_polygons(path: &Path) -> Result<PolygonFile, ReadError> {
    let bytes = lines::normalize(Source::open(path)?.read_from(0)?);
    let Parsed { v, corners, face_sizes, .. } = parse(path, &bytes, PIECE)?;
    if face_sizes.is_empty() {
        return Err(ReadError::file(path, "no faces"));
    }
    let positions = v.as_chunks::<3>().0.iter().map(|&p| p.into()).collect();
    Ok(PolygonFile { positions, corners, face_sizes })
}

/// How many of each there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts {
    lines: usize,
    v: usize,
    vt: usize,
    vn: usize,
}

impl Counts {
    fn of(text: &[u8]) -> Self {
        let mut counts = Self::default();
        let mut lines = Lines::new(text, 0);
        for line in lines.by_ref() {
            match line.keyword {
                b"v" => counts.v += 1,
                b"vt" => counts.vt += 1,
                b"vn" => counts.vn += 1,
                _ => {}
            }
        }
        counts.lines = lines.passed();
        counts
    }
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.lines += other.lines;
        self.v += other.v;
        self.vt += other.vt;
        self.vn += other.vn;
    }
}

/// The corners' indices into one of the lists, from 0; all of them, or `NONE` where there is none.
#[derive(Debug, Default)]
struct Links {
    /// Empty until the first that is not `NONE`; then one a corner.
    of_corner: Vec<u32>,
    /// The first that names something which is not there: the line and what to say of it.
    first_bad: Option<(usize, String)>,
}

impl Links {
    /// Sets the index of the corner after the first `before`.
    fn push(&mut self, before: usize, index: u32) {
        if !self.of_corner.is_empty() || index != NONE {
            self.of_corner.resize(before, NONE);
            self.of_corner.push(index);
        }
    }

    /// Appends those of `corners` later corners.
    fn append(&mut self, before: usize, later: Self, corners: usize) {
        if !(self.of_corner.is_empty() && later.of_corner.is_empty()) {
            self.of_corner.resize(before, NONE);
            self.of_corner.extend(later.of_corner);
            self.of_corner.resize(before + corners, NONE);
        }
        self.first_bad = self.first_bad.take().or(later.first_bad);
    }
}

/// What a file, or a piece of it, says.
#[derive(Debug, Default)]
struct Parsed {
    /// 3 numbers a vertex.
    v: Vec<f64>,
    vt: Vec<[f32; 2]>,
    vn: Vec<[f32; 3]>,
    /// Vertices of the corners of all faces, from 0.
    corners: Vec<u32>,
    corner_vt: Links,
    corner_vn: Links,
    /// Corners of each face, 3 or more.
    face_sizes: Vec<u32>,
    /// Lines of the faces that are no triangles, in order.
    polygon_lines: Vec<usize>,
    small_faces: Tally,
    /// The first line that is not understood.
    first_unknown: Option<(usize, String)>,
    /// Lines that are understood, ignored or not.
    known: usize,
}

/// Parses a file in pieces of about `size` bytes.
fn parse(path: &Path, bytes: &[u8], size: usize) -> Result<Parsed, ReadError> {
    let pieces = lines::chunks(bytes, size);
    let counts: Vec<Counts> = pieces.par_iter().map(|piece| Counts::of(piece)).collect();
    let mut total = Counts::default();
    let tasks: Vec<(&[u8], Counts, Counts)> = pieces
        .into_iter()
        .zip(counts)
        .map(|(piece, own)| {
            let before = total;
            total += own;
            (piece, before, own)
        })
        .collect();
    check_count(path, total.v as u64, "vertices")?;
    check_count(path, total.vt as u64, "texture coordinates")?;
    check_count(path, total.vn as u64, "normals")?;

    let parts: Vec<Result<Parsed, ReadError>> = tasks
        .into_par_iter()
        .map(|(text, before, own)| Parser::new(path, before, own, total).parse(text))
        .collect();
    // In the order of the file, so that the first mistake is the one reported.
    let mut parts = parts.into_iter();
    let Some(mut all) = parts.next().transpose()? else { return Ok(Parsed::default()) };
    all.v.reserve_exact(3 * total.v - all.v.len());
    for part in parts {
        all.append(part?);
    }
    Ok(all)
}

impl Parsed {
    fn append(&mut self, later: Self) {
        let (before, corners) = (self.corners.len(), later.corners.len());
        self.v.extend(later.v);
        self.vt.extend(later.vt);
        self.vn.extend(later.vn);
        self.corners.extend(later.corners);
        self.corner_vt.append(before, later.corner_vt, corners);
        self.corner_vn.append(before, later.corner_vn, corners);
        self.face_sizes.extend(later.face_sizes);
        self.polygon_lines.extend(later.polygon_lines);
        self.small_faces.append(later.small_faces);
        self.first_unknown = self.first_unknown.take().or(later.first_unknown);
        self.known += later.known;
    }
}

/// Parses a piece of a file.
struct Parser<'a> {
    path: &'a Path,
    /// What there is in the pieces before this and in it up to the current line.
    so_far: Counts,
    /// What there is in the whole file.
    total: Counts,
    out: Parsed,
}

impl<'a> Parser<'a> {
    fn new(path: &'a Path, before: Counts, own: Counts, total: Counts) -> Self {
        let out = Parsed {
            v: Vec::with_capacity(3 * own.v),
            vt: Vec::with_capacity(own.vt),
            vn: Vec::with_capacity(own.vn),
            ..Parsed::default()
        };
        Self { path, so_far: before, total, out }
    }

    fn parse(mut self, text: &[u8]) -> Result<Parsed, ReadError> {
        for Line { number, keyword, mut words } in Lines::new(text, self.so_far.lines) {
            self.out.known += 1;
            match keyword {
                b"v" => {
                    let p = self.numbers::<3>(number, &mut words, 3)?;
                    self.out.v.extend(p);
                    self.so_far.v += 1;
                }
                b"vt" => {
                    let uv = self.numbers::<2>(number, &mut words, 1)?;
                    self.out.vt.push(uv.map(|c| c as f32));
                    self.so_far.vt += 1;
                }
                b"vn" => {
                    let n = self.numbers::<3>(number, &mut words, 3)?;
                    self.out.vn.push(n.map(|c| c as f32));
                    self.so_far.vn += 1;
                }
                // "fo" is what old files say for "f".
                b"f" | b"fo" => self.face(number, words)?,
                _ if IGNORED.contains(&keyword) => {}
                _ => {
                    self.out.known -= 1;
                    self.out.first_unknown.get_or_insert_with(|| (number, quoted(keyword)));
                }
            }
        }
        Ok(self.out)
    }

    /// The next `N` numbers, of which the last may be missing after `least`.
    fn numbers<const N: usize>(
        &self,
        line: usize,
        words: &mut Words,
        least: usize,
    ) -> Result<[f64; N], ReadError> {
        let mut numbers = [0.0; N];
        for (i, number) in numbers.iter_mut().enumerate() {
            let Some(word) = words.next() else {
                if i >= least {
                    break;
                }
                let message = format!("{i} of at least {least} numbers");
                return Err(ReadError::line(self.path, line, message));
            };
            *number = parse_number(word).ok_or_else(|| {
                ReadError::line(self.path, line, format!("{} is not a number", quoted(word)))
            })?;
        }
        Ok(numbers)
    }

    fn face(&mut self, line: usize, words: Words) -> Result<(), ReadError> {
        let before = self.out.corners.len();
        for word in words {
            let mut parts = word.split(|&b| b == b'/');
            let v = self.index(line, word, parts.next(), self.so_far.v)?;
            let vt = self.index(line, word, parts.next(), self.so_far.vt)?;
            let vn = self.index(line, word, parts.next(), self.so_far.vn)?;
            if parts.next().is_some() {
                return Err(bad_corner(self.path, line, word));
            }
            let vertex = v.and_then(|i| i.resolve(self.total.v)).ok_or_else(|| {
                let named = v.map_or("none".into(), |i| i.written.to_string());
                let message = format!(
                    "the face names vertex {named}, but the number of vertices is {} (the first is \
                     1, the last -1)",
                    self.total.v
                );
                ReadError::line(self.path, line, message)
            })?;
            let at = self.out.corners.len();
            self.out.corners.push(vertex);
            self.out.corner_vt.push(at, link(vt, self.total.vt));
            self.out.corner_vn.push(at, link(vn, self.total.vn));
            // Without normals or texture coordinates there is still a shape: no reason to stop.
            for (index, count, links) in [
                (vt, self.total.vt, &mut self.out.corner_vt),
                (vn, self.total.vn, &mut self.out.corner_vn),
            ] {
                if let Some(i) = index.filter(|i| i.resolve(count).is_none()) {
                    let fault = || (line, format!("{} of {count}", i.written));
                    links.first_bad.get_or_insert_with(fault);
                }
            }
        }
        let n = self.out.corners.len() - before;
        if n < 3 {
            self.out.corners.truncate(before);
            self.out.corner_vt.of_corner.truncate(before);
            self.out.corner_vn.of_corner.truncate(before);
            self.out.small_faces.add(|| format!("in line {line}"));
            return Ok(());
        }
        let too_many = |_| ReadError::line(self.path, line, format!("a face of {n} corners"));
        self.out.face_sizes.push(u32::try_from(n).map_err(too_many)?);
        if n > 3 {
            self.out.polygon_lines.push(line);
        }
        Ok(())
    }

    /// Part of a corner such as "1/-2/3"; `None` if it is missing or empty.
    fn index(
        &self,
        line: usize,
        word: &[u8],
        part: Option<&[u8]>,
        so_far: usize,
    ) -> Result<Option<Index>, ReadError> {
        let Some(part) = part.filter(|part| !part.is_empty()) else { return Ok(None) };
        let written = parse_integer(part).ok_or_else(|| bad_corner(self.path, line, word))?;
        let from_zero =
            if written < 0 { written.saturating_add(so_far as i64) } else { written - 1 };
        Ok(Some(Index { written, from_zero }))
    }
}

/// An index of a corner.
#[derive(Clone, Copy)]
struct Index {
    written: i64,
    /// Below zero if there is no such thing.
    from_zero: i64,
}

impl Index {
    /// The index from 0, if it is one of `count`.
    fn resolve(self, count: usize) -> Option<u32> {
        u32::try_from(self.from_zero).ok().filter(|&i| (i as usize) < count)
    }
}

fn link(index: Option<Index>, count: usize) -> u32 {
    index.and_then(|i| i.resolve(count)).unwrap_or(NONE)
}

fn bad_corner(path: &Path, line: usize, word: &[u8]) -> ReadError {
    let message = format!(
        "{} is not a corner of a face; accepted: v, v/vt, v//vn, v/vt/vn, each a whole number",
        quoted(word)
    );
    ReadError::line(path, line, message)
}

#[cfg(test)]
mod tests;
