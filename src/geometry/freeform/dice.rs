//! Triangles on patches.
//!
//! Over any triangle of the parameter plane that reaches a along u and b along v, linear interpolation
//! is off by at most ⅛ (a² M_uu + 2ab M_uv + b² M_vv), where the M bound the second derivatives: by
//! Taylor's formula at the vertices, whose variance about the point is at most a²/4 along u and b²/4
//! along v (Filip, Magedson and Markot, *Surface algorithms using bounds on derivatives*, 1986, for
//! right triangles). So a patch that needs m × n cells gets a grid of that many, and may have more
//! points on its sides, as many as the neighbour there needs: a rim of triangles joins them to the grid,
//! none of which reaches farther than a cell. An edge has the points that its curve alone has at equal
//! steps, so neighbours have the same.

use glam::DVec3;
use rayon::prelude::*;

use super::bezier::BezierPatch;
use super::edges::{Edges, Side};
use super::{Facets, TooManyTriangles};
use crate::math::Bounds;

/// Dices all patches; see [`super::FreeformSurface::tessellate`].
pub(super) fn dice(
    patches: &[BezierPatch],
    tolerance: &(dyn Fn(&Bounds) -> f64 + Sync),
    limit: u64,
) -> Result<Facets, TooManyTriangles> {
    let bounds = patches.iter().map(BezierPatch::bounds).fold(Bounds::EMPTY, Bounds::union);
    let size = bounds.size().max_element();
    if !(size > 0.0) {
        return Ok(Facets::default());
    }
    let needs: Vec<Need> = patches
        .par_iter()
        .map(|patch| Need {
            second: patch.second_derivatives(),
            lengths: patch.lengths(),
            tolerance: tolerance(&patch.bounds()),
        })
        .collect();
    let counts = count_cells(&needs, limit)?;
    let (mut edges, sides) = Edges::new(patches, &counts, size);
    edges.divide();
    let pieces: Vec<Facets> = patches
        .par_iter()
        .zip(counts.par_iter().zip(&sides))
        .map(|(patch, (&count, sides))| Piece::new(patch, count).dice(sides, &edges))
        .collect();
    let mut all = Facets::default();
    for piece in pieces {
        let first = all.positions.len() as u32;
        all.positions.extend(piece.positions);
        all.normals.extend(piece.normals);
        all.uvs.extend(piece.uvs);
        all.triangles.extend(piece.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    Ok(all)
}

/// What decides how fine a patch must be.
#[derive(Debug, Clone, Copy)]
struct Need {
    /// Bounds of |S_uu|, |S_uv|, |S_vv|.
    second: [f64; 3],
    /// Lengths along u and v.
    lengths: [f64; 2],
    tolerance: f64,
}

/// Cells this many times as long as wide count double.
const LONG: f64 = 256.0;

impl Need {
    /// The least number of cells along u and v, as whole numbers, if each tolerance is `factor` times
    /// as large.
    fn cells(&self, factor: f64) -> [f64; 2] {
        let [m_uu, m_uv, m_vv] = self.second;
        let allowed = 8.0 * self.tolerance * factor;
        // With x and y the sides of a cell, M_uu x² + 2 M_uv x y + M_vv y² = allowed. The largest cell
        // has M_uu x² = M_vv y²; where that makes y more than 1, y = 1.
        let along_u = |y: f64| {
            let rest = allowed - m_vv * y * y;
            let half = m_uv * y;
            // The root of M_uu x² + 2 half x = rest, in a form that holds for M_uu = 0.
            rest / (half + (half * half + m_uu * rest).max(0.0).sqrt())
        };
        let cells = |side: f64| if side >= 1.0 { 1.0 } else { (1.0 / side).ceil() };
        let ideal = (2.0 * (m_vv + m_uv * (m_vv / m_uu).sqrt()) / allowed).sqrt();
        let ideal = if ideal.is_finite() { ideal.ceil().max(1.0) } else { 1.0 };
        // 0 / 0 where nothing bends: one cell.
        let least = (m_vv / allowed).sqrt().floor() + 1.0;
        // Where twist alone decides, any m × n of the same product will do: then square cells.
        let [length_u, length_v] = self.lengths;
        let square = (2.0 * m_uv / allowed * (length_v / length_u)).sqrt();
        let square = if square.is_finite() { square.ceil().max(least) } else { least };
        let rows = [1.0, least, ideal - 1.0, ideal, ideal + 1.0, square];
        let rows = rows.into_iter().filter(|&n| n >= least);
        let rows = rows.map(|n| [cells(along_u(1.0 / n)), n]);
        // Slivers are hit at places that are off by more than 32 bits say.
        let cost = |[m, n]: [f64; 2]| {
            let aspect = (length_u * n) / (length_v * m);
            let aspect = aspect.max(aspect.recip());
            let aspect = if aspect.is_finite() { aspect } else { 1.0 };
            m * n * (1.0 + aspect / LONG)
        };
        let better = |a: [f64; 2], b: [f64; 2]| if cost(b) < cost(a) { b } else { a };
        rows.reduce(better).unwrap_or([1.0, 1.0])
    }
}

/// The cells of each patch along u and v.
fn count_cells(needs: &[Need], limit: u64) -> Result<Vec<[u32; 2]>, TooManyTriangles> {
    let total = |factor: f64| -> f64 {
        needs.par_iter().map(|need| need.cells(factor)).map(|[u, v]| 2.0 * u * v).sum()
    };
    let limit_f = limit as f64;
    if !(total(1.0) <= limit_f) {
        let tolerance = needs.iter().map(|need| need.tolerance).fold(f64::INFINITY, f64::min);
        let mut factor = 1.0;
        // Rims take some more; the sum halves about as the tolerance doubles.
        while !(total(factor) <= 0.8 * limit_f) && factor < 1e30 {
            factor *= 1.5;
        }
        return Err(TooManyTriangles { tolerance, limit, fits: tolerance * factor });
    }
    Ok(needs.iter().map(|need| need.cells(1.0).map(|n| n as u32)).collect())
}

/// A vertex on a line of the parameter plane.
type Link = (u32, f64);

/// A patch that is being diced.
struct Piece<'a> {
    patch: &'a BezierPatch,
    count: [u32; 2],
    facets: Facets,
}

impl<'a> Piece<'a> {
    fn new(patch: &'a BezierPatch, count: [u32; 2]) -> Self {
        Self { patch, count, facets: Facets::default() }
    }

    fn dice(mut self, sides: &[Side; 4], edges: &Edges) -> Facets {
        let chains = self.rim(sides, edges);
        // Without points on two opposite sides, the others are joined directly.
        let is_bare = |side: usize| chains[side].len() == 2;
        if self.count[1] == 1 && is_bare(1) && is_bare(3) {
            self.stitch(&chains[0], &chains[2]);
            return self.facets;
        }
        if self.count[0] == 1 && is_bare(0) && is_bare(2) {
            self.stitch(&chains[1], &chains[3]);
            return self.facets;
        }
        let [m, n] = self.count.map(|n| n.max(2));
        let step = |k: u32, n: u32| f64::from(k) / f64::from(n);
        let first = self.facets.positions.len() as u32;
        for j in 1..n {
            for i in 1..m {
                let (u, v) = (step(i, m), step(j, n));
                self.vertex(self.patch.evaluate(u, v).position, u, v);
            }
        }
        let inner = |i: u32, j: u32| first + (j - 1) * (m - 1) + (i - 1);
        for j in 1..n - 1 {
            for i in 1..m - 1 {
                let corners = [inner(i, j), inner(i + 1, j), inner(i + 1, j + 1), inner(i, j + 1)];
                self.cell(corners);
            }
        }
        // The rim, anticlockwise: each side with the line of the grid that is nearest to it.
        let row = |j: u32| -> Vec<Link> { (1..m).map(|i| (inner(i, j), step(i, m))).collect() };
        let column = |i: u32| -> Vec<Link> { (1..n).map(|j| (inner(i, j), step(j, n))).collect() };
        let back = |chain: &[Link]| -> Vec<Link> {
            chain.iter().rev().map(|&(vertex, t)| (vertex, 1.0 - t)).collect()
        };
        self.stitch(&chains[0], &row(1));
        self.stitch(&chains[1], &column(m - 1));
        self.stitch(&back(&chains[2]), &back(&row(n - 1)));
        self.stitch(&back(&chains[3]), &back(&column(1)));
        self.facets
    }

    /// The vertices on the four sides, along growing u or v. Corners are shared, unless a side that has
    /// shrunk to a point joins them: then it has as many vertices as the grid, each with its own normal.
    fn rim(&mut self, sides: &[Side; 4], edges: &Edges) -> [Vec<Link>; 4] {
        let mut corners: [Option<u32>; 4] = [None; 4];
        std::array::from_fn(|side| {
            let at = |t: f64| match side {
                0 => (t, 0.0),
                1 => (1.0, t),
                2 => (t, 1.0),
                _ => (0.0, t),
            };
            let positions = edges.points(sides[side], self.count[side % 2]);
            let count = positions.len() as u32 - 1;
            // Corners are numbered (0, 0), (1, 0), (1, 1), (0, 1).
            let (start, end) = [(0, 1), (1, 2), (3, 2), (0, 3)][side];
            (0..=count)
                .zip(positions)
                .map(|(k, position)| {
                    let t = f64::from(k) / f64::from(count);
                    let (u, v) = at(t);
                    let corner = match k {
                        0 => Some(start),
                        k if k == count => Some(end),
                        _ => None,
                    };
                    let known = corner.and_then(|corner: usize| corners[corner]);
                    let vertex = known.unwrap_or_else(|| self.vertex(position, u, v));
                    if let Some(corner) = corner {
                        corners[corner] = Some(vertex);
                    }
                    (vertex, t)
                })
                .collect()
        })
    }

    fn vertex(&mut self, position: DVec3, u: f64, v: f64) -> u32 {
        let facets = &mut self.facets;
        facets.positions.push(position);
        facets.normals.push(self.patch.normal(u, v));
        facets.uvs.push(self.patch.uv(u, v));
        facets.positions.len() as u32 - 1
    }

    /// Two triangles, cut along the shorter diagonal.
    fn cell(&mut self, [a, b, c, d]: [u32; 4]) {
        let p = |v: u32| self.facets.positions[v as usize];
        let is_ac = (p(c) - p(a)).length_squared() <= (p(d) - p(b)).length_squared();
        let two = if is_ac { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        self.facets.triangles.extend(two);
    }

    /// Joins two lines of vertices that run the same way, `inner` to the left of `outer`. Each piece of
    /// one gets the vertex of the other that is nearest to its middle.
    fn stitch(&mut self, outer: &[Link], inner: &[Link]) {
        let (mut i, mut j) = (0, 0);
        let middle = |chain: &[Link], k: usize| Some(0.5 * (chain.get(k)?.1 + chain.get(k + 1)?.1));
        loop {
            let is_outer = match (middle(outer, i), middle(inner, j)) {
                (Some(a), Some(b)) => a <= b,
                (Some(_), None) => true,
                (None, Some(_)) => false,
                (None, None) => break,
            };
            if is_outer {
                self.facets.triangles.push([outer[i].0, outer[i + 1].0, inner[j].0]);
                i += 1;
            } else {
                self.facets.triangles.push([outer[i].0, inner[j + 1].0, inner[j].0]);
                j += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_keep_the_bound_and_no_fewer_would() {
        for second in [
            [1.0, 1.0, 1.0],
            [5.0, 0.0, 0.0],
            [0.0, 0.0, 7.0],
            [0.0, 3.0, 0.0],
            [100.0, 3.0, 0.01],
            [0.02, 30.0, 4.0],
            [0.0, 0.0, 0.0],
        ] {
            for tolerance in [1.0, 0.1, 1e-3, 1e-5] {
                let [m, n] = Need { second, lengths: [1.0, 1.0], tolerance }.cells(1.0);
                let off = |m: f64, n: f64| {
                    let [uu, uv, vv] = second;
                    0.125 * (uu / (m * m) + 2.0 * uv / (m * n) + vv / (n * n))
                };
                assert!(m >= 1.0 && n >= 1.0 && off(m, n) <= tolerance * (1.0 + 1e-12));
                assert!(m == 1.0 || off(m - 1.0, n) > tolerance, "{second:?} {tolerance}: {m} {n}");
                // Of all grids of up to 200 rows none has many fewer cells.
                for rows in 1..200 {
                    let rows = f64::from(rows);
                    let columns = (1..400).map(f64::from).find(|&m| off(m, rows) <= tolerance);
                    if let Some(columns) = columns {
                        assert!(columns * rows >= 0.75 * m * n - 3.0, "{second:?} {tolerance}");
                    }
                }
            }
        }
    }

    #[test]
    fn limits_tell_what_would_fit() {
        let need = Need { second: [1.0, 1.0, 1.0], lengths: [1.0, 1.0], tolerance: 1e-9 };
        let TooManyTriangles { fits, .. } = count_cells(&[need; 10], 1000).unwrap_err();
        let need = Need { tolerance: fits, ..need };
        assert!(count_cells(&[need; 10], 1000).is_ok());
        assert!(fits < 0.1, "{fits}");
    }
}
