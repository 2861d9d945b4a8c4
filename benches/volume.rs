//! Grids: how fast isosurfaces are met and volumes are integrated, and how far off the latter are.
//!
//! ```text
//! cargo bench --bench volume
//! ```
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use std::sync::Arc;
use std::time::Instant;

use alhazen::geometry::grid::Grid;
use alhazen::geometry::{AnalyticShape, Isosurface};
use alhazen::math::Bounds;
use alhazen::medium::volume::{
    TransferFunction, TransferNode, Volume, march, transmittance_through,
};
use glam::{DAffine3, DVec3};

/// A value for each point of space.
type Field = fn(DVec3) -> f64;

const SIZE: usize = 256;
const BOX: Bounds = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };

/// Rays of a parallel camera that looks at the box along a diagonal, row by row.
fn rays(n: usize) -> Vec<(DVec3, DVec3)> {
    let forward = DVec3::new(-0.6, -0.45, -1.0).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let at = |i: usize| 1.6 * (2.0 * (i as f64 + 0.5) / n as f64 - 1.0);
    let ray = |i: usize, j: usize| (-5.0 * forward + at(i) * right + at(j) * up, forward);
    (0..n * n).map(|k| ray(k % n, k / n)).collect()
}

/// Runs it three times; million rays a second of the best.
fn mrays(count: usize, mut run: impl FnMut()) -> f64 {
    let seconds = (0..3).map(|_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    });
    count as f64 / seconds.fold(f64::INFINITY, f64::min) / 1e6
}

fn gyroid(p: DVec3) -> f64 {
    let [x, y, z] = (12.0 * p).to_array();
    x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()
}

fn noise(p: DVec3) -> f64 {
    let mut h = (p.x.to_bits() ^ p.y.to_bits().rotate_left(17) ^ p.z.to_bits().rotate_left(41))
        .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    h = (h ^ h >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (h >> 40) as f64 / (1u64 << 23) as f64 - 1.0
}

fn main() {
    let rays = rays(512);
    println!("{SIZE}³ samples, {} parallel rays, one thread", rays.len());
    let fields: [(&str, f64, Field); 3] = [
        ("sphere", 0.0, |p| 0.9 - p.length()),
        ("gyroid", 0.0, gyroid),
        ("noise, level 0.9", 0.9, noise),
    ];
    println!("\n| isosurface | hits | grid built, s | Mrays/s |\n|---|---|---|---|");
    for (name, level, field) in fields {
        let at = |i: usize| 2.0 * i as f64 / (SIZE - 1) as f64 - 1.0;
        let start = Instant::now();
        let value = |i, j, k| field(DVec3::new(at(i), at(j), at(k))) as f32;
        let grid = Grid::from_fn([SIZE; 3], value).expect("a sound grid");
        let built = start.elapsed().as_secs_f64();
        let surface = Isosurface::new(Arc::new(grid), BOX, level, false);
        let mut hits = 0;
        let rate = mrays(rays.len(), || {
            let hit = |(o, d): &&(DVec3, DVec3)| surface.occluded(*o, *d, 0.0, f64::INFINITY);
            hits = rays.iter().filter(hit).count();
        });
        println!("| {name} | {hits} | {built:.2} | {rate:.2} |");
    }

    let cloud = |i: usize, j: usize, k: usize| {
        let p = DVec3::new(i as f64, j as f64, k as f64) / (SIZE - 1) as f64 * 2.0 - 1.0;
        (1.0 - p.length() + 0.2 * gyroid(p)) as f32
    };
    let grid = Arc::new(Grid::from_fn([SIZE; 3], cloud).expect("a sound grid"));
    let nodes = [(0.1, [0.2, 0.4, 1.0], 0.0), (0.5, [1.0, 0.3, 0.1], 4.0), (1.2, [1.0; 3], 9.0)];
    let nodes = nodes.map(|(value, color, extinction)| TransferNode { value, color, extinction });
    let transfer = Arc::new(TransferFunction::new(nodes.to_vec()).expect("a sound function"));
    let volume = |tolerance| {
        [Volume::new(grid.clone(), BOX, DAffine3::IDENTITY, transfer.clone(), tolerance)]
    };
    let light = |volumes: &[Volume], (o, d): &(DVec3, DVec3)| {
        let mut light = [0.0; 3];
        march(volumes, *o, *d, f64::INFINITY, |slab| {
            light = std::array::from_fn(|i| light[i] + slab.light[i]);
        });
        light
    };
    let rays: Vec<_> = rays.into_iter().step_by(16).collect();
    let exact: Vec<_> = rays.iter().map(|ray| light(&volume(1e-12), ray)).collect();
    println!("\n| volume, tolerance | largest error | Mrays/s |\n|---|---|---|");
    for tolerance in [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
        let volumes = volume(tolerance);
        let mut found = Vec::new();
        let rate = mrays(rays.len(), || {
            found = rays.iter().map(|ray| light(&volumes, ray)).collect();
        });
        let off = found.iter().flatten().zip(exact.iter().flatten()).map(|(a, b)| (a - b).abs());
        println!("| {tolerance} | {:.1e} | {rate:.3} |", off.fold(0.0, f64::max));
    }
    let volumes = volume(1e-3);
    let rate = mrays(rays.len(), || {
        let passed =
            |(o, d): &(DVec3, DVec3)| transmittance_through(&volumes, *o, *d, f64::INFINITY);
        std::hint::black_box(rays.iter().map(passed).sum::<f64>());
    });
    println!("| transmittance alone | | {rate:.3} |");
}
