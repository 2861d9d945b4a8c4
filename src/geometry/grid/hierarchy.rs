//! Least and greatest values of bricks of cells, and of bricks of bricks, so that a ray passes over what
//! holds nothing.

use rayon::prelude::*;

use super::{Grid, Range};

/// The smallest bricks have 2² cells along each axis, and each larger one as many bricks: a 32nd of the
/// samples' memory, and little in a brick that is looked at in vain.
pub(super) const SHIFT: u32 = 2;

/// One size of bricks.
#[derive(Debug)]
struct Level {
    /// A cell's brick is its index shifted by this.
    shift: u32,
    /// Bricks along x, and along y.
    row: [usize; 2],
    ranges: Vec<Range>,
}

/// All sizes of bricks, the largest, which holds the whole grid, first.
#[derive(Debug, Default)]
pub(super) struct Hierarchy {
    levels: Vec<Level>,
}

impl Hierarchy {
    pub(super) fn new(grid: &Grid) -> Self {
        let cells = grid.size().map(|n| n - 1);
        let mut levels = vec![Level::of_cells(grid, cells)];
        while levels[0].ranges.len() > 1 {
            let next = levels[0].above(cells);
            levels.insert(0, next);
        }
        Self { levels }
    }

    /// The range of the whole grid.
    pub(super) fn whole(&self) -> Range {
        self.levels.first().map_or(Range::EMPTY, |level| level.ranges[0])
    }

    /// The shift of the largest brick around `cell` that need not be entered; none where all must be.
    /// Those that hold `entered` as well are known not to be.
    #[inline]
    pub(super) fn skipped(
        &self,
        cell: [usize; 3],
        entered: Option<[usize; 3]>,
        is_empty: impl Fn(Range) -> bool,
    ) -> Option<u32> {
        // The bits in which the cells differ: above them they share their brick.
        let differ =
            entered.map_or(usize::MAX, |e| (cell[0] ^ e[0]) | (cell[1] ^ e[1]) | (cell[2] ^ e[2]));
        if differ >> SHIFT == 0 {
            return None;
        }
        for level in &self.levels {
            if differ >> level.shift == 0 {
                continue;
            }
            let [x, y, z] = cell.map(|i| i >> level.shift);
            if is_empty(level.ranges[x + level.row[0] * (y + level.row[1] * z)]) {
                return Some(level.shift);
            }
        }
        None
    }
}

/// Bricks along an axis of `n` cells.
fn bricks(n: usize, shift: u32) -> usize {
    ((n - 1) >> shift) + 1
}

impl Level {
    /// The smallest bricks. Those that touch share samples.
    fn of_cells(grid: &Grid, cells: [usize; 3]) -> Self {
        let count = cells.map(|n| bricks(n, SHIFT));
        let samples = |brick: usize, axis: usize| {
            let first = brick << SHIFT;
            first..=(first + (1 << SHIFT)).min(cells[axis])
        };
        let range = |index: usize| {
            let [x, y, z] =
                [index % count[0], index / count[0] % count[1], index / count[0] / count[1]];
            let mut range = Range::EMPTY;
            for k in samples(z, 2) {
                for j in samples(y, 1) {
                    let row = samples(x, 0).map(|i| grid.sample([i, j, k]));
                    range = range.union(Range::of(row));
                }
            }
            range
        };
        let ranges = (0..count.iter().product()).into_par_iter().map(range).collect();
        Self { shift: SHIFT, row: [count[0], count[1]], ranges }
    }

    /// The next larger bricks.
    fn above(&self, cells: [usize; 3]) -> Self {
        let shift = self.shift + SHIFT;
        let count = cells.map(|n| bricks(n, shift));
        let row = [count[0], count[1]];
        let mut ranges = vec![Range::EMPTY; count.iter().product()];
        for (i, &range) in self.ranges.iter().enumerate() {
            let [x, y, z] =
                [i % self.row[0], i / self.row[0] % self.row[1], i / self.row[0] / self.row[1]]
                    .map(|i| i >> SHIFT);
            let at = &mut ranges[x + row[0] * (y + row[1] * z)];
            *at = at.union(range);
        }
        Self { shift, row, ranges }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_hold_the_values_of_their_cells() {
        // One sample stands out, shared by bricks on both sides.
        let grid =
            Grid::from_fn([70, 9, 6], |i, j, k| if [i, j, k] == [16, 4, 3] { 5.0 } else { 1.0 })
                .unwrap();
        let skipped = |cell, entered| grid.hierarchy.skipped(cell, entered, |r| r.max < 2.0);
        assert_eq!(grid.hierarchy.whole(), Range { min: 1.0, max: 5.0 });
        for cell in [[15, 3, 2], [16, 4, 3], [12, 7, 0], [19, 0, 0]] {
            assert_eq!(skipped(cell, None), None, "{cell:?}");
        }
        assert_eq!(skipped([20, 3, 2], None), Some(2));
        assert_eq!(skipped([11, 3, 2], Some([12, 3, 2])), Some(2));
        assert_eq!(skipped([40, 3, 2], None), Some(4));
        assert_eq!(skipped([64, 0, 0], None), Some(6));
    }
}
