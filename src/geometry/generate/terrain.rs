//! Fractal hills over a grid.

use glam::DVec3;

use crate::math::noise::fbm;

/// One cell of the grid.
pub(super) const LEAST: u64 = 2;

/// Side of the square, in metres.
const SIDE: f64 = 100.0;

/// Hills along a side.
const HILLS: f64 = 4.0;

/// Metres from the mean to the highest a summit can be.
const HEIGHT: f64 = 20.0;

/// Hills over `columns` × `rows` cells, each cut into two triangles; row by row.
#[derive(Debug, Clone)]
pub(super) struct Terrain {
    columns: u64,
    rows: u64,
    octaves: u32,
    seed: u32,
}

impl Terrain {
    pub(super) fn new(triangles: u64, seed: u32) -> Self {
        let cells = triangles / 2;
        let columns = cells.isqrt();
        // Down to hills four cells wide.
        let octaves = (columns / 16).max(1).ilog2() + 1;
        Self { columns, rows: cells / columns, octaves, seed }
    }

    pub(super) const fn vertex_count(&self) -> u64 {
        (self.columns + 1) * (self.rows + 1)
    }

    pub(super) const fn triangle_count(&self) -> u64 {
        2 * self.columns * self.rows
    }

    pub(super) fn vertex(&self, i: u64) -> DVec3 {
        let (column, row) = (i % (self.columns + 1), i / (self.columns + 1));
        let (u, v) = (column as f64 / self.columns as f64, row as f64 / self.rows as f64);
        let height = fbm(DVec3::new(u, 0.0, v) * HILLS, 0.0, self.octaves, 0.5, self.seed);
        DVec3::new((u - 0.5) * SIDE, height * HEIGHT, (v - 0.5) * SIDE)
    }

    pub(super) const fn triangle(&self, i: u64) -> [u64; 3] {
        let (cell, half) = (i / 2, i % 2);
        let (column, row) = (cell % self.columns, cell / self.columns);
        let corner = row * (self.columns + 1) + column;
        let below = corner + self.columns + 1;
        if half == 0 { [corner, below, below + 1] } else { [corner, below + 1, corner + 1] }
    }
}
