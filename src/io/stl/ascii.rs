//! STL as text: words separated by white space, in either case.

use glam::DVec3;

use super::{key, number_all, positions};
use crate::io::distinct::Distinct;
use crate::io::error::ReadError;
use crate::io::mesh::{Draft, MeshFile, check_count, place};
use crate::io::polygon::Cutter;
use crate::io::source::Source;
use crate::io::text::{parse_number, quoted};

/// Whether a file that begins like this is text. Many binary files begin with "solid" as well.
pub(super) fn is_ascii(start: &[u8]) -> bool {
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start).trim_ascii_start();
    let starts = |text: &[u8], word: &[u8]| {
        text.get(..word.len()).is_some_and(|t| t.eq_ignore_ascii_case(word))
    };
    let has = |word: &[u8]| start.windows(word.len()).any(|w| w.eq_ignore_ascii_case(word));
    starts(start, b"solid") && !start.contains(&0) && (has(b"facet") || has(b"endsolid"))
}

/// Reads a text file.
pub(super) fn read(source: &Source) -> Result<MeshFile, ReadError> {
    let bytes = source.read_from(0)?;
    let mut draft = Draft::default();
    let corners = parse(source, &bytes, &mut draft)?;
    drop(bytes);
    check_count(source.path, corners.len() as u64 / 9, "triangles")?;
    // Text may have more digits than an f32: choose the origin first, then weld what is the same.
    let (origin, xyz) = place(&corners);
    drop(corners);
    let places: Vec<[u32; 3]> = xyz.as_chunks::<3>().0.iter().map(|p| p.map(key)).collect();
    drop(xyz);
    let mut vertices = Distinct::with_capacity(places.len() / 6 + 16);
    let ids = number_all(source.path, &mut vertices, &places)?;
    draft.origin = origin;
    draft.triangles = ids.as_chunks::<3>().0.to_vec();
    draft.xyz = positions(vertices);
    Ok(draft.finish())
}

/// Where in a file we are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Inside {
    Nothing,
    Solid,
    Facet,
    Loop,
}

/// The coordinates of all triangles, 9 numbers each.
fn parse(source: &Source, bytes: &[u8], draft: &mut Draft) -> Result<Vec<f64>, ReadError> {
    // A triangle takes some 200 bytes; the least possible is less than half.
    let mut corners = Vec::with_capacity(bytes.len() / 200 * 9);
    let mut words = Words { bytes, at: 0, start: 0 };
    if bytes.starts_with(b"\xef\xbb\xbf") {
        words.at = 3;
    }
    let mut cutter = Cutter::default();
    let (mut facet, mut cuts) = (Vec::new(), Vec::new());
    let mut inside = Inside::Nothing;
    let mut facets = 0_u64;
    while let Some(word) = words.next() {
        let is = |name: &[u8]| word.eq_ignore_ascii_case(name);
        match inside {
            _ if is(b"vertex") && inside == Inside::Loop => {
                let mut p = [0.0; 3];
                for c in &mut p {
                    let word = words.next().ok_or_else(|| words.too_early(source))?;
                    *c = parse_number(word).ok_or_else(|| {
                        words.error(source, format!("{} is not a number", quoted(word)))
                    })?;
                }
                facet.push(DVec3::from(p));
            }
            Inside::Nothing if is(b"solid") => {
                words.skip_line();
                inside = Inside::Solid;
            }
            Inside::Solid if is(b"endsolid") || is(b"end") => {
                words.skip_line();
                inside = Inside::Nothing;
            }
            // The start of another solid without the end of this one.
            Inside::Solid if is(b"solid") => words.skip_line(),
            Inside::Nothing | Inside::Solid if is(b"facet") => {
                facet.clear();
                inside = Inside::Facet;
            }
            Inside::Facet if is(b"normal") => {
                for _ in 0..3 {
                    words.next();
                }
            }
            // Some programs write the colour of a solid or facet in a line of its own.
            Inside::Solid | Inside::Facet if is(b"color") => words.skip_line(),
            Inside::Facet if is(b"outer") => {
                words.next();
                inside = Inside::Loop;
            }
            Inside::Loop if is(b"endloop") => inside = Inside::Facet,
            Inside::Facet if is(b"endfacet") => {
                if facet.len() < 3 {
                    draft.small_faces.add(|| format!("facet {facets}"));
                } else {
                    cuts.clear();
                    if !cutter.cut(&facet, &mut cuts) {
                        draft.guessed_faces.add(|| format!("facet {facets}"));
                    }
                    let points = cuts.iter().flatten().map(|&i| facet[i as usize]);
                    corners.extend(points.flat_map(|p| p.to_array()));
                }
                facets += 1;
                inside = Inside::Solid;
            }
            _ => {
                let accepted = match inside {
                    Inside::Nothing => "solid, facet",
                    Inside::Solid => "facet, endsolid",
                    Inside::Facet => "outer loop, endfacet",
                    Inside::Loop => "vertex, endloop",
                };
                let message = format!("{} out of place; accepted: {accepted}", quoted(word));
                return Err(words.error(source, message));
            }
        }
    }
    match inside {
        Inside::Facet | Inside::Loop => Err(words.too_early(source)),
        Inside::Solid => {
            draft.warnings.push("no `endsolid` at the end: the file may be cut short".into());
            Ok(corners)
        }
        Inside::Nothing => Ok(corners),
    }
}

/// The words of a text.
struct Words<'a> {
    bytes: &'a [u8],
    /// Behind the last word.
    at: usize,
    /// Where the last word starts.
    start: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let rest = &rest[start..];
        let len = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.start = self.at + start;
        self.at = self.start + len;
        Some(&rest[..len])
    }

    /// Leaves out what is left of the line.
    fn skip_line(&mut self) {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r'));
        self.at += end.unwrap_or(rest.len());
    }

    /// An error at the last word.
    #[cold]
    fn error(&self, source: &Source, message: String) -> ReadError {
        let line = self.bytes[..self.start].iter().filter(|&&b| b == b'\n').count() + 1;
        ReadError::line(source.path, line, message)
    }

    #[cold]
    fn too_early(&self, source: &Source) -> ReadError {
        self.error(source, "the file ends inside a facet".into())
    }
}
