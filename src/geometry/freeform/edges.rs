//! The edges of patches: which of them are the same curve, and the points on each, computed once.

use std::collections::HashMap;

use glam::{DVec3, DVec4};

use super::bezier::{BezierPatch, de_casteljau, project};

/// Edges nearer than this share of the surface's size are the same.
const SAME: f64 = 1e-10;

/// A side of a patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    /// Which edge.
    edge: u32,
    /// Whether the patch runs along it from its end to its start.
    is_reversed: bool,
}

/// All edges of a surface.
#[derive(Debug, Default)]
pub(super) struct Edges {
    edges: Vec<Edge>,
    /// Edges between two corners, the lower number first.
    between: HashMap<[u32; 2], Vec<u32>>,
    corners: Corners,
}

#[derive(Debug)]
struct Edge {
    control: Vec<DVec4>,
    /// Start and end.
    ends: [DVec3; 2],
    /// Number of pieces, the largest that one of its patches asks for.
    count: u32,
    /// count + 1 of them.
    points: Vec<DVec3>,
    /// Whether it has shrunk to a point.
    is_pole: bool,
}

impl Edges {
    /// The edges of `patches`, each found once, and the four sides of each patch (see
    /// [`BezierPatch::edge`]). `counts` are the pieces that each patch asks for along u and v.
    pub(super) fn new(
        patches: &[BezierPatch],
        counts: &[[u32; 2]],
        size: f64,
    ) -> (Self, Vec<[Side; 4]>) {
        let mut edges = Self::default();
        edges.corners.cell = 4.0 * SAME * size;
        let sides = patches
            .iter()
            .zip(counts)
            .map(|(patch, count)| {
                std::array::from_fn(|side| {
                    edges.add(patch.edge(side), count[side % 2], SAME * size)
                })
            })
            .collect();
        (edges, sides)
    }

    fn add(&mut self, control: Vec<DVec4>, count: u32, near: f64) -> Side {
        let [first, last] = [control[0], control[control.len() - 1]].map(project);
        let [start, end] = [first, last].map(|p| self.corners.find(p, near));
        let is_pole = control.iter().all(|c| (project(*c) - first).length() <= near);
        let candidates = self.between.entry([start.min(end), start.max(end)]).or_default();
        for &edge in candidates.iter() {
            let known = &mut self.edges[edge as usize];
            let Some(is_reversed) = direction(&known.control, &control, near) else { continue };
            known.count = known.count.max(count);
            return Side { edge, is_reversed };
        }
        let edge = self.edges.len() as u32;
        candidates.push(edge);
        let ends = [start, end].map(|corner| self.corners.points[corner as usize]);
        self.edges.push(Edge { control, ends, count, points: Vec::new(), is_pole });
        Side { edge, is_reversed: false }
    }

    /// Computes the points of all edges.
    pub(super) fn divide(&mut self) {
        for edge in &mut self.edges {
            let mut scratch = edge.control.clone();
            let mut point = |k: u32| {
                if edge.is_pole || k == 0 {
                    return edge.ends[0];
                }
                if k == edge.count {
                    return edge.ends[1];
                }
                scratch.copy_from_slice(&edge.control);
                project(de_casteljau(&mut scratch, f64::from(k) / f64::from(edge.count))[0])
            };
            edge.points = (0..=edge.count).map(&mut point).collect();
        }
    }

    /// The points along a side of a patch. A side that has shrunk to a point is cut into `at_pole` pieces
    /// of no length.
    pub(super) fn points(&self, side: Side, at_pole: u32) -> Vec<DVec3> {
        let edge = &self.edges[side.edge as usize];
        if edge.is_pole {
            return vec![edge.ends[0]; at_pole as usize + 1];
        }
        let mut points = edge.points.clone();
        if side.is_reversed {
            points.reverse();
        }
        points
    }
}

/// Whether two curves are the same: `Some(true)` where they run opposite ways.
fn direction(a: &[DVec4], b: &[DVec4], near: f64) -> Option<bool> {
    // The same weights up to a common factor.
    let same = |a: &DVec4, b: &DVec4, scale: f64| {
        (project(*a) - project(*b)).length() <= near && (a.w - b.w * scale).abs() <= 1e-10 * a.w
    };
    if a.len() != b.len() {
        return None;
    }
    let n = a.len() - 1;
    if a.iter().zip(b).all(|(x, y)| same(x, y, a[0].w / b[0].w)) {
        return Some(false);
    }
    let is_reversed = a.iter().zip(b.iter().rev()).all(|(x, y)| same(x, y, a[0].w / b[n].w));
    is_reversed.then_some(true)
}

/// Points that are the same where they are nearly so.
#[derive(Debug, Default)]
struct Corners {
    points: Vec<DVec3>,
    /// Points by cell.
    cells: HashMap<[i64; 3], Vec<u32>>,
    /// Side of a cell, above twice the distance within which points are the same.
    cell: f64,
}

impl Corners {
    /// The number of the point, a new one where there is none within `near`.
    fn find(&mut self, p: DVec3, near: f64) -> u32 {
        let cell_of = |p: DVec3| (p / self.cell).floor().to_array().map(|x| x as i64);
        let r = DVec3::splat(near);
        let (low, high) = (cell_of(p - r), cell_of(p + r));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let found = self.cells.get(&[x, y, z]).into_iter().flatten().copied();
                    let mut found =
                        found.filter(|&i| (self.points[i as usize] - p).length() <= near);
                    if let Some(i) = found.next() {
                        return i;
                    }
                }
            }
        }
        let number = self.points.len() as u32;
        self.cells.entry(cell_of(p)).or_default().push(number);
        self.points.push(p);
        number
    }
}
