//! The cells that a ray passes, one after the other, empty bricks in one step.
//!
//! The cell is tracked by its index, and planes between cells are met at t = (k − o)/d, which is the same
//! number for the cells on both sides. So is the point of the face that the ray leaves one by and enters
//! the other: the coordinate across is exactly 0 or 1, the others are held within the face. Therefore both
//! cells compute the same value there, bit by bit, and no ray slips through between them.
//!
//! After Amanatides and Woo, *A Fast Voxel Traversal Algorithm for Ray Tracing*, Eurographics 1987, with
//! the distances computed anew at each plane, so that no error adds up.

use glam::{BVec3, DVec3};

use super::{Grid, Range};

/// A ray's way through a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellSpan {
    /// The cell.
    pub cell: [usize; 3],
    /// Where the ray enters, from [`CellWalk::base`].
    pub t0: f64,
    /// Where it leaves, ≥ `t0`.
    pub t1: f64,
    /// Where it enters, relative to the cell, in [0, 1]³.
    pub a: DVec3,
    /// Where it leaves.
    pub b: DVec3,
}

/// The cells along a ray whose bricks are not empty, in order.
#[derive(Debug)]
pub struct CellWalk<'g, E> {
    grid: &'g Grid,
    is_empty: E,
    base: f64,
    origin: DVec3,
    direction: DVec3,
    inverse: DVec3,
    /// Cells along each axis.
    cells: [usize; 3],
    cell: [usize; 3],
    t: f64,
    end: f64,
    /// The ray at `t`, relative to the cell.
    local: DVec3,
    /// The last cell that was not skipped.
    entered: Option<[usize; 3]>,
    is_done: bool,
}

impl<'g, E: Fn(Range) -> bool> CellWalk<'g, E> {
    /// The way of a ray in cell units from `t_min` to `t_max`, without bricks of which `is_empty` holds.
    /// The origin may be far away: it is moved to where the ray enters the grid.
    #[inline]
    pub fn new(
        grid: &'g Grid,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
        is_empty: E,
    ) -> Self {
        let cells = grid.size().map(|n| n - 1);
        let (enter, exit) =
            grid.bounds().clip(origin, direction).unwrap_or((0.0, f64::NEG_INFINITY));
        let base = enter.max(t_min);
        let origin = origin + base * direction;
        let mut walk = Self {
            grid,
            is_empty,
            base,
            origin,
            direction,
            inverse: direction.recip(),
            cells,
            cell: [0; 3],
            t: 0.0,
            end: exit.min(t_max) - base,
            local: DVec3::ZERO,
            entered: None,
            // Refuses NaN as well.
            is_done: !(exit.min(t_max) >= base && origin.is_finite()),
        };
        if !walk.is_done {
            (walk.cell, walk.local) = grid.cell_at(origin);
        }
        walk
    }

    /// What the distances count from, along the ray.
    #[inline]
    pub fn base(&self) -> f64 {
        self.base
    }

    /// Where the ray leaves the cells from `lo` to `hi`, and by which axis.
    #[inline]
    fn exit(&self, lo: DVec3, hi: DVec3) -> (f64, usize) {
        let forward = self.direction.cmpgt(DVec3::ZERO);
        let planes = DVec3::select(forward, hi, lo);
        let t = (planes - self.origin) * self.inverse;
        // Along an axis that it does not move along, it stays inside.
        let never = self.direction.cmpeq(DVec3::ZERO);
        let t = DVec3::select(never, DVec3::INFINITY, t);
        if t.x <= t.y && t.x <= t.z {
            (t.x, 0)
        } else if t.y <= t.z {
            (t.y, 1)
        } else {
            (t.z, 2)
        }
    }

    /// Goes on into the cell at `to`, beyond the plane across `axis`, which is met at `t`.
    #[inline]
    fn enter(&mut self, t: f64, axis: usize, to: Option<usize>) {
        match to.filter(|&i| i < self.cells[axis]) {
            Some(i) if t < self.end => {
                self.cell[axis] = i;
                self.t = t;
            }
            _ => self.is_done = true,
        }
    }
}

impl<E: Fn(Range) -> bool> Iterator for CellWalk<'_, E> {
    type Item = CellSpan;

    #[inline]
    fn next(&mut self) -> Option<CellSpan> {
        while !self.is_done {
            let cell = self.cell;
            let skipped = self.grid.hierarchy.skipped(cell, self.entered, &self.is_empty);
            if let Some(shift) = skipped {
                let lo = cell.map(|i| i >> shift << shift);
                let hi = [0, 1, 2].map(|i| (lo[i] + (1 << shift)).min(self.cells[i]));
                let as_vector = |v: [usize; 3]| DVec3::from(v.map(|i| i as f64));
                let (t, axis) = self.exit(as_vector(lo), as_vector(hi));
                let t = t.max(self.t);
                // Some cell next to the brick: the ray leaves it there, whatever rounding says.
                let p = self.origin + t * self.direction;
                let inside = p.floor().clamp(as_vector(lo), as_vector(hi) - 1.0);
                self.cell = inside.to_array().map(|i| i as usize);
                self.local = (p - inside).clamp(DVec3::ZERO, DVec3::ONE);
                let forward = self.direction[axis] > 0.0;
                let to = if forward { Some(hi[axis]) } else { lo[axis].checked_sub(1) };
                self.local[axis] = if forward { 0.0 } else { 1.0 };
                self.enter(t, axis, to);
                continue;
            }
            self.entered = Some(cell);
            let lo = DVec3::from(cell.map(|i| i as f64));
            let (t, axis) = self.exit(lo, lo + 1.0);
            let (t0, a) = (self.t, self.local);
            let t1 = t.max(t0).min(self.end);
            let mut b = (self.origin + t1 * self.direction - lo).clamp(DVec3::ZERO, DVec3::ONE);
            // A coordinate that does not change is not to change by rounding either.
            let still = BVec3::from_array(self.direction.to_array().map(|d| d == 0.0));
            b = DVec3::select(still, a, b);
            if t <= self.end {
                let forward = self.direction[axis] > 0.0;
                b[axis] = if forward { 1.0 } else { 0.0 };
                let to = if forward { Some(cell[axis] + 1) } else { cell[axis].checked_sub(1) };
                self.local = b;
                self.local[axis] = if forward { 0.0 } else { 1.0 };
                self.enter(t1, axis, to);
            } else {
                self.is_done = true;
            }
            return Some(CellSpan { cell, t0, t1, a, b });
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid(size: [usize; 3]) -> Grid {
        Grid::from_fn(size, |i, j, k| (i + j + k) as f32).unwrap()
    }

    #[test]
    fn cells_follow_one_another() {
        let grid = grid([5, 6, 7]);
        let o = DVec3::new(-1.0, 2.5, 3.5);
        let spans: Vec<_> = CellWalk::new(&grid, o, DVec3::X, 0.0, 100.0, |_| false).collect();
        let cells: Vec<_> = spans.iter().map(|s| s.cell).collect();
        assert_eq!(cells, [[0, 2, 3], [1, 2, 3], [2, 2, 3], [3, 2, 3]]);
        assert_eq!((spans[3].t0, spans[3].t1), (3.0, 4.0));
        assert_eq!(
            (spans[3].a, spans[3].b),
            (DVec3::new(0.0, 0.5, 0.5), DVec3::new(1.0, 0.5, 0.5))
        );
        // Backwards, cut at both ends.
        let o = DVec3::new(9.0, 2.5, 3.5);
        let walk = CellWalk::new(&grid, o, -2.0 * DVec3::X, 2.75, 3.0, |_| false);
        assert_eq!(walk.base(), 2.75);
        let spans: Vec<_> = walk.collect();
        assert_eq!(spans.len(), 1);
        assert_eq!((spans[0].cell, spans[0].t1), ([3, 2, 3], 0.25));
        assert_eq!((spans[0].a.x, spans[0].b.x), (0.5, 0.0));
        // Beside it, behind it, without a direction, and along an edge from vertex to vertex.
        let count = |o: [f64; 3], d: DVec3| {
            CellWalk::new(&grid, o.into(), d, 0.0, 100.0, |_| false).count()
        };
        assert_eq!(count([-1.0, 8.0, 0.0], DVec3::X), 0);
        assert_eq!(count([-1.0, 2.0, 0.0], -DVec3::X), 0);
        assert_eq!(count([1.0, 2.0, 3.0], DVec3::ZERO), 1);
        assert_eq!(count([-1.0, 5.0, 6.0], DVec3::X), 4);
        assert_eq!(count([-1.0, f64::NAN, 6.0], DVec3::X), 0);
    }

    proptest! {
        /// Spans join without gaps, and where one ends is where the next begins, on the shared face.
        #[test]
        fn spans_join(
            o in prop::array::uniform3(-20.0..30.0),
            to in prop::array::uniform3(0u32..=16),
            through_vertex: bool,
        ) {
            let grid = grid([14, 9, 17]);
            let o = if through_vertex { DVec3::from(o).round() } else { DVec3::from(o) };
            let to = DVec3::from(to.map(f64::from)) * DVec3::new(13.0, 8.0, 16.0) / 16.0;
            let d = to - o;
            prop_assume!(d != DVec3::ZERO);
            let spans: Vec<_> = CellWalk::new(&grid, o, d, 0.0, 1e9, |_| false).collect();
            let Some((enter, exit)) = grid.bounds().clip(o, d) else {
                return Ok(());
            };
            let base = enter.max(0.0);
            prop_assert_eq!(spans.first().map(|s| s.t0), Some(0.0));
            prop_assert!((spans[spans.len() - 1].t1 - (exit - base)).abs() < 1e-12);
            for pair in spans.windows(2) {
                prop_assert_eq!(pair[0].t1, pair[1].t0);
                let global = |s: &CellSpan, p: DVec3| p + DVec3::from(s.cell.map(|i| i as f64));
                let (end, start) = (global(&pair[0], pair[0].b), global(&pair[1], pair[1].a));
                prop_assert_eq!(end, start);
                let p = o + (base + pair[0].t1) * d;
                prop_assert!((p - end).length() < 1e-12 * (1.0 + o.length()));
            }
        }

        /// What is skipped is empty, and nothing else is.
        #[test]
        fn skipping_leaves_out_empty_bricks_only(
            seed in 0u32..1000,
            o in prop::array::uniform3(-9.0..40.0),
            to in prop::array::uniform3(0.0..30.0),
        ) {
            let hash = |i: usize, j: usize, k: usize| {
                (i as u32 * 73 + j as u32 * 179 + k as u32 * 283 + seed).wrapping_mul(0x9e37_79b9) >> 20
            };
            let grid = Grid::from_fn([31, 18, 27], |i, j, k| {
                if hash(i / 3, j / 3, k / 3).is_multiple_of(40) { 1.0 } else { 0.0 }
            }).unwrap();
            let (o, d) = (DVec3::from(o), DVec3::from(to) - DVec3::from(o));
            let holds = |span: &CellSpan| grid.corners(span.cell).iter().any(|&v| v > 0.5);
            let all: Vec<_> = CellWalk::new(&grid, o, d, 0.0, 1e9, |_| false).filter(holds).collect();
            let some: Vec<_> =
                CellWalk::new(&grid, o, d, 0.0, 1e9, |r| r.max < 0.5).filter(holds).collect();
            prop_assert_eq!(all.len(), some.len());
            for (all, some) in all.iter().zip(&some) {
                prop_assert_eq!(all.cell, some.cell);
                prop_assert!((all.a - some.a).length() < 1e-12 && (all.b - some.b).length() < 1e-12);
            }
        }
    }
}
