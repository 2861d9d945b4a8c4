//! What several benchmarks share: scenes, rays, medians.
#![allow(dead_code, missing_docs, reason = "not every benchmark uses everything")]

pub mod peers;
pub mod record;
pub mod still_life;
pub mod w2;

use std::time::Instant;

use alhazen::accel::{AccelKind, LANES, RayBlock};
use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::film::{Filter, FilterTable};
use alhazen::geometry::TriangleMesh;
use alhazen::sampler::{Dimensions, Sampler};
use alhazen::scene::{
    CameraDesc, LightDesc, Location, ObjectDesc, PlaceDesc, Scene, SceneDesc, ShapeDesc,
};
use glam::{DVec2, DVec3};

pub const SIZE: [u32; 2] = [1280, 720];

/// Interleaved rounds of each measurement.
pub const ROUNDS: usize = 15;

pub fn seconds(work: &dyn Fn()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Median of the ratios of each round, and the interval that holds the true median in 96 % of cases:
/// between the fourth from either end of fifteen (binomial).
pub fn ratio(rounds: &[(f64, f64)]) -> (f64, [f64; 2]) {
    let mut ratios: Vec<f64> = rounds.iter().map(|(a, b)| a / b).collect();
    ratios.sort_by(f64::total_cmp);
    let n = ratios.len();
    let from_end = if n >= 15 { 3 + (n - 15) / 3 } else { 0 };
    (ratios[n / 2], [ratios[from_end], ratios[n - 1 - from_end]])
}

/// Rounds of two pieces of work by turns, each first in every other round; one more warms up.
pub fn interleaved(a: &dyn Fn(), b: &dyn Fn(), rounds: usize) -> Vec<(f64, f64)> {
    let round = |i: usize| {
        if i.is_multiple_of(2) {
            let a = seconds(a);
            (a, seconds(b))
        } else {
            let b = seconds(b);
            (seconds(a), b)
        }
    };
    (0..=rounds).map(round).skip(1).collect()
}

/// A fractal height field of 2·cells² triangles over [−1, 1]², seen from above, under a low sun.
pub fn terrain(cells: u32) -> Scene {
    let height = |x: f64, y: f64| {
        (0..8).fold(0.0, |sum, octave| {
            let f = 2.1f64.powi(octave) * 2.7;
            let wave = (f * x + f64::from(octave)).sin() * (f * y + 0.7 * f64::from(octave)).cos();
            sum + wave * 0.2 * 0.5f64.powi(octave)
        })
    };
    let n = cells + 1;
    let at = |i: u32| 2.0 * f64::from(i) / f64::from(cells) - 1.0;
    let xyz = (0..n)
        .flat_map(|j| (0..n).map(move |i| (at(i), at(j))))
        .flat_map(|(x, z)| [x as f32, height(x, z) as f32, z as f32]);
    let triangles = (0..cells)
        .flat_map(|j| (0..cells).map(move |i| j * n + i))
        .flat_map(|a| [[a, a + n, a + n + 1], [a, a + n + 1, a + 1]]);
    let mesh = TriangleMesh::new(xyz.collect(), triangles.collect());
    let mut desc = SceneDesc { meshes: vec![mesh], ..SceneDesc::default() };
    desc.image.size = SIZE;
    desc.settings.samples = 1;
    desc.settings.filter = Filter::Box;
    desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), None));
    desc.camera = Some(CameraDesc {
        at: Location::default(),
        projection: Projection::Perspective { fov: 45f64.to_radians() },
        place: Some(PlaceDesc::LookAt {
            eye: DVec3::new(-0.55, 0.9, 0.95),
            target: DVec3::new(0.0, 0.0, -0.05),
            up: DVec3::Y,
        }),
        lens: None,
    });
    let (direction, irradiance) = (DVec3::new(0.75, -0.45, 0.42), Rgb::splat(3.0));
    desc.lights.push(LightDesc::Directional { direction, irradiance });
    Scene::build_quietly(desc, AccelKind::default()).expect("a sound scene")
}

/// The camera rays of one sample that `render` traces for seed 0, block by block; tile by tile as there,
/// as neighbours in the picture find more in the caches.
pub fn camera_blocks(scene: &Scene, sample: u32) -> Vec<(RayBlock, [Sampler; LANES])> {
    let filter = FilterTable::new(scene.settings.filter);
    let [width, height] = scene.size;
    let steps = |from: u32, to: u32, step: usize| (from..to).step_by(step);
    let tiles = steps(0, height, 32).flat_map(|y| steps(0, width, 32).map(move |x| [x, y]));
    let origins = tiles.flat_map(|[x0, y0]| {
        let rows = steps(y0, height.min(y0 + 32), 4);
        rows.flat_map(move |y| steps(x0, width.min(x0 + 32), 4).map(move |x| [x, y]))
    });
    let block = |[x0, y0]: [u32; 2]| {
        let mut block = RayBlock::empty();
        let pixel = |lane: usize| [x0 + lane as u32 % 4, y0 + lane as u32 / 4];
        let samplers: [Sampler; LANES] =
            std::array::from_fn(|lane| Sampler::new(0, pixel(lane), sample));
        for (lane, sampler) in samplers.iter().enumerate() {
            let [x, y] = pixel(lane);
            let [u, v, lens_u, lens_v] = sampler.four(Dimensions::Camera);
            let [dx, dy] = filter.sample([u, v]).offset.map(f64::from);
            let film = DVec2::new(f64::from(x) + 0.5 + dx, f64::from(y) + 0.5 + dy);
            if let Some(ray) = scene.camera.ray(film, [lens_u, lens_v]) {
                block.set(lane, &ray);
            }
        }
        (block, samplers)
    };
    origins.map(block).collect()
}
