//! Regular grids of samples, and what lies between them: the trilinear interpolant.
//!
//! A grid is known here in **cell units**: the sample (i, j, k) lies at the point (i, j, k), so each cell
//! is a unit cube between eight samples, and a grid of n samples along an axis ends at n − 1. Whoever owns
//! a grid places it in space.

mod cubic;
mod hierarchy;
mod walk;

use std::fmt;

use glam::DVec3;

use crate::math::Bounds;
pub use cubic::Cubic;
use hierarchy::Hierarchy;
pub use walk::{CellSpan, CellWalk};

/// A grid of f32 samples in three dimensions, interpolated trilinearly.
pub struct Grid {
    size: [usize; 3],
    strides: [usize; 3],
    samples: Vec<f32>,
    hierarchy: Hierarchy,
}

/// Least and greatest value of a part of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Least value.
    pub min: f32,
    /// Greatest value.
    pub max: f32,
}

impl Range {
    /// The range of nothing.
    const EMPTY: Self = Self { min: f32::INFINITY, max: f32::NEG_INFINITY };

    #[inline]
    fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// That of values, which are not NaN.
    #[inline]
    pub fn of(values: impl IntoIterator<Item = f32>) -> Self {
        let join = |r: Self, v: f32| Self { min: r.min.min(v), max: r.max.max(v) };
        values.into_iter().fold(Self::EMPTY, join)
    }
}

/// In which order samples follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SampleOrder {
    /// x runs fastest, z slowest.
    XFastest,
    /// z runs fastest, x slowest.
    ZFastest,
}

/// Why samples are no grid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// There is no cell.
    #[error("a grid needs at least 2 samples along each axis, not {} x {} x {}", .size[0], .size[1], .size[2])]
    TooFew {
        /// Samples along x, y and z.
        size: [usize; 3],
    },
    /// The number of samples is not what the size says.
    #[error("{} x {} x {} samples are expected, not {found}", .size[0], .size[1], .size[2])]
    Count {
        /// Samples along x, y and z.
        size: [usize; 3],
        /// How many there are.
        found: usize,
    },
    /// A sample cannot be interpolated.
    #[error("sample [{}, {}, {}] (x, y, z, counted from 0) is {value}; accepted: finite numbers", .at[0], .at[1], .at[2])]
    NotFinite {
        /// Its place.
        at: [usize; 3],
        /// Its value.
        value: f32,
    },
}

impl Grid {
    /// A grid of `size` samples along x, y and z.
    ///
    /// # Errors
    /// [`GridError`] where there are fewer than two samples along an axis, not as many as `size` says, or
    /// some that are not finite.
    pub fn new(size: [usize; 3], order: SampleOrder, samples: Vec<f32>) -> Result<Self, GridError> {
        if size.iter().any(|&n| n < 2) {
            return Err(GridError::TooFew { size });
        }
        let count = size[0].checked_mul(size[1]).and_then(|n| n.checked_mul(size[2]));
        if count != Some(samples.len()) {
            return Err(GridError::Count { size, found: samples.len() });
        }
        let strides = match order {
            SampleOrder::XFastest => [1, size[0], size[0] * size[1]],
            SampleOrder::ZFastest => [size[1] * size[2], size[2], 1],
        };
        if let Some(i) = samples.iter().position(|s| !s.is_finite()) {
            let at = [0, 1, 2].map(|axis| i / strides[axis] % size[axis]);
            return Err(GridError::NotFinite { at, value: samples[i] });
        }
        let mut grid = Self { size, strides, samples, hierarchy: Hierarchy::default() };
        grid.hierarchy = Hierarchy::new(&grid);
        Ok(grid)
    }

    /// A grid of the values of a function, which is asked for each (i, j, k).
    ///
    /// # Errors
    /// As [`Grid::new`].
    pub fn from_fn(
        size: [usize; 3],
        mut value: impl FnMut(usize, usize, usize) -> f32,
    ) -> Result<Self, GridError> {
        let mut samples = Vec::with_capacity(size.iter().product());
        for k in 0..size[2] {
            for j in 0..size[1] {
                samples.extend((0..size[0]).map(|i| value(i, j, k)));
            }
        }
        Self::new(size, SampleOrder::XFastest, samples)
    }

    /// Samples along x, y and z, at least 2 each.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// The samples, in the order that they were given in.
    pub fn samples(&self) -> &[f32] {
        &self.samples
    }

    /// Least and greatest sample.
    pub fn range(&self) -> Range {
        self.hierarchy.whole()
    }

    /// The box from the first sample to the last, in cell units.
    pub fn bounds(&self) -> Bounds {
        Bounds { min: DVec3::ZERO, max: self.size.map(|n| (n - 1) as f64).into() }
    }

    /// The sample (i, j, k).
    ///
    /// # Panics
    /// Beyond the last sample.
    #[inline]
    pub fn sample(&self, at: [usize; 3]) -> f32 {
        debug_assert!((0..3).all(|axis| at[axis] < self.size[axis]));
        self.samples[self.index(at)]
    }

    #[inline]
    fn index(&self, at: [usize; 3]) -> usize {
        at[0] * self.strides[0] + at[1] * self.strides[1] + at[2] * self.strides[2]
    }

    /// The samples at the corners of a cell: x changes first, z last.
    #[inline]
    pub fn corners(&self, cell: [usize; 3]) -> [f32; 8] {
        let [dx, dy, dz] = self.strides;
        let at = self.index(cell);
        // One check for all.
        let s = &self.samples[at..=at + dx + dy + dz];
        [0, dx, dy, dx + dy, dz, dx + dz, dy + dz, dx + dy + dz].map(|offset| s[offset])
    }

    /// The cell that a point in cell units lies in, or the nearest one, and the point relative to it, in
    /// [0, 1]³.
    #[inline]
    pub fn cell_at(&self, p: DVec3) -> ([usize; 3], DVec3) {
        let last = self.size.map(|n| (n - 2) as f64);
        let cell = p.floor().clamp(DVec3::ZERO, last.into());
        (cell.to_array().map(|i| i as usize), (p - cell).clamp(DVec3::ZERO, DVec3::ONE))
    }

    /// The interpolated value at a point in cell units; beyond the grid, that of its boundary.
    pub fn value(&self, p: DVec3) -> f64 {
        let (cell, p) = self.cell_at(p);
        let c = self.corners(cell).map(f64::from);
        let edge = |i: usize| lerp(c[i], c[i + 1], p.x);
        lerp(lerp(edge(0), edge(2), p.y), lerp(edge(4), edge(6), p.y), p.z)
    }

    /// The gradient of the interpolant in the cell of a point, per cell.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        let (cell, p) = self.cell_at(p);
        let c = self.corners(cell).map(f64::from);
        let [x, y, z] = p.to_array();
        // Of values over a face, by two weights.
        let face = |v: [f64; 4], s: f64, t: f64| lerp(lerp(v[0], v[1], s), lerp(v[2], v[3], s), t);
        DVec3::new(
            face([c[1] - c[0], c[3] - c[2], c[5] - c[4], c[7] - c[6]], y, z),
            face([c[2] - c[0], c[3] - c[1], c[6] - c[4], c[7] - c[5]], x, z),
            face([c[4] - c[0], c[5] - c[1], c[6] - c[2], c[7] - c[3]], x, y),
        )
    }

    /// Its mixed second derivatives there, by yz, zx and xy; the others are zero.
    pub fn mixed_derivatives(&self, p: DVec3) -> DVec3 {
        let (cell, p) = self.cell_at(p);
        let c = self.corners(cell).map(f64::from);
        let twist = |a: usize, b: usize, d: usize, e: usize| c[a] - c[b] - c[d] + c[e];
        DVec3::new(
            lerp(twist(0, 2, 4, 6), twist(1, 3, 5, 7), p.x),
            lerp(twist(0, 1, 4, 5), twist(2, 3, 6, 7), p.y),
            lerp(twist(0, 1, 2, 3), twist(4, 5, 6, 7), p.z),
        )
    }

    /// Central differences of the samples (one-sided at the boundary), interpolated: continuous, and not
    /// quite the gradient of the interpolant. Per cell.
    pub fn smooth_gradient(&self, p: DVec3) -> DVec3 {
        let (cell, p) = self.cell_at(p);
        let mut sum = DVec3::ZERO;
        for corner in 0..8 {
            let step = [corner & 1, corner >> 1 & 1, corner >> 2];
            let at = [0, 1, 2].map(|axis| cell[axis] + step[axis]);
            let weight: f64 =
                (0..3).map(|axis| if step[axis] == 1 { p[axis] } else { 1.0 - p[axis] }).product();
            if weight > 0.0 {
                sum += weight * self.central_difference(at);
            }
        }
        sum
    }

    fn central_difference(&self, at: [usize; 3]) -> DVec3 {
        let along = |axis: usize| {
            let (mut below, mut above) = (at, at);
            below[axis] = at[axis].saturating_sub(1);
            above[axis] = (at[axis] + 1).min(self.size[axis] - 1);
            let difference = f64::from(self.sample(above)) - f64::from(self.sample(below));
            difference / (above[axis] - below[axis]) as f64
        };
        DVec3::new(along(0), along(1), along(2))
    }
}

/// Without its samples.
impl fmt::Debug for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (size, range) = (self.size(), self.range());
        f.debug_struct("Grid").field("size", &size).field("range", &range).finish_non_exhaustive()
    }
}

/// Between `a` at 0 and `b` at 1. In this form it never leaves [a, b] to the other side of zero, and has
/// exactly their values at the ends.
#[inline]
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    (1.0 - t) * a + t * b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interpolant_and_its_derivatives_are_those_of_a_trilinear_function() {
        // 1 + 2x + 3y + 4z + 5xy + 6yz + 7zx + 8xyz is its own interpolant.
        let f = |p: DVec3| {
            let [x, y, z] = p.to_array();
            1.0 + 2.0 * x
                + 3.0 * y
                + 4.0 * z
                + 5.0 * x * y
                + 6.0 * y * z
                + 7.0 * z * x
                + 8.0 * x * y * z
        };
        let at = |i, j, k| f(DVec3::new(i as f64, j as f64, k as f64)) as f32;
        let grid = Grid::from_fn([4, 3, 5], at).unwrap();
        // The same samples in the other order.
        let mut samples = Vec::new();
        for i in 0..4 {
            for j in 0..3 {
                samples.extend((0..5).map(|k| at(i, j, k)));
            }
        }
        let other = Grid::new([4, 3, 5], SampleOrder::ZFastest, samples).unwrap();
        assert_eq!(grid.range(), Range { min: 1.0, max: at(3, 2, 4) });
        for p in [DVec3::new(0.3, 1.7, 2.2), DVec3::new(3.0, 0.0, 4.0), DVec3::new(2.0, 2.0, 0.5)] {
            let [x, y, z] = p.to_array();
            let gradient = DVec3::new(
                2.0 + 5.0 * y + 7.0 * z + 8.0 * y * z,
                3.0 + 5.0 * x + 6.0 * z + 8.0 * z * x,
                4.0 + 6.0 * y + 7.0 * x + 8.0 * x * y,
            );
            let mixed = DVec3::new(6.0 + 8.0 * x, 7.0 + 8.0 * y, 5.0 + 8.0 * z);
            for grid in [&grid, &other] {
                assert!((grid.value(p) - f(p)).abs() < 1e-12 * f(p));
                assert!((grid.gradient(p) - gradient).length() < 1e-12 * gradient.length());
                assert!((grid.smooth_gradient(p) - gradient).length() < 1e-12 * gradient.length());
                assert!((grid.mixed_derivatives(p) - mixed).length() < 1e-11);
            }
        }
        // Beyond the grid, the nearest value.
        assert_eq!(grid.value(DVec3::new(-1.0, 9.0, -3.0)), 7.0);
    }

    #[test]
    fn what_is_no_grid_is_told() {
        let new = |size, samples| Grid::new(size, SampleOrder::ZFastest, samples).unwrap_err();
        assert_eq!(new([2, 1, 2], vec![0.0; 4]), GridError::TooFew { size: [2, 1, 2] });
        assert_eq!(new([2, 2, 2], vec![0.0; 7]), GridError::Count { size: [2, 2, 2], found: 7 });
        assert!(matches!(new([usize::MAX, 2, 2], vec![0.0; 7]), GridError::Count { .. }));
        let mut samples = vec![0.0; 12];
        samples[7] = f32::INFINITY;
        let error = new([2, 2, 3], samples);
        assert_eq!(
            error.to_string(),
            "sample [1, 0, 1] (x, y, z, counted from 0) is inf; accepted: finite numbers"
        );
    }
}
