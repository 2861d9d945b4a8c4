//! What a render costs beyond its ray queries, and what packets gain: ratios within one run.
//!
//! `make bench` prints, for a terrain of a million triangles lit by a sun, medians over interleaved
//! rounds of: the whole render; its camera and shadow queries replayed in packets, without shading;
//! the same queries one ray at a time.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

use std::time::Instant;

use alhazen::accel::{AccelKind, LANES, RayBlock, RayQuery};
use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::film::{Filter, FilterTable};
use alhazen::geometry::TriangleMesh;
use alhazen::render::{RenderJob, render};
use alhazen::sampler::{Dimensions, Sampler};
use alhazen::scene::{
    CameraDesc, LightDesc, Location, ObjectDesc, PlaceDesc, Scene, SceneDesc, ShapeDesc,
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

const SIZE: [u32; 2] = [1280, 720];
const ROUNDS: usize = 15;

fn main() {
    let scene = terrain(708);
    println!(
        "terrain of {} triangles, {} x {}, 1 sample, {} threads, {}",
        scene.requirements.triangles,
        SIZE[0],
        SIZE[1],
        rayon::current_num_threads(),
        scene.accel.info()
    );
    match &scene.accel {
        alhazen::accel::Accel::Embree(query) => measure(&scene, query),
        _ => unreachable!("Embree is the default"),
    }
}

fn measure<Q: RayQuery>(scene: &Scene, query: &Q) {
    let camera = camera_blocks(scene);
    let shadow = shadow_blocks(scene, query, &camera);
    let rays = |blocks: &[RayBlock]| blocks.iter().map(|b| b.active().count_ones()).sum::<u32>();
    println!("{} camera rays, {} shadow rays", rays(&camera), rays(&shadow));

    let whole = || {
        std::hint::black_box(render(scene, &RenderJob::default(), &()));
    };
    let packets = || {
        camera.par_iter().for_each(|b| {
            std::hint::black_box(query.intersect_block(b));
        });
        shadow.par_iter().for_each(|b| {
            std::hint::black_box(query.occluded_block(b));
        });
    };
    let singles = || {
        camera.par_iter().for_each(|b| {
            b.lanes().for_each(|lane| {
                std::hint::black_box(query.intersect(&b.get(lane)));
            });
        });
        shadow.par_iter().for_each(|b| {
            b.lanes().for_each(|lane| {
                std::hint::black_box(query.occluded(&b.get(lane)));
            });
        });
    };
    let seconds = |work: &dyn Fn()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    let mut rounds: Vec<[f64; 3]> = Vec::new();
    for round in 0..=ROUNDS {
        let times = [seconds(&whole), seconds(&packets), seconds(&singles)];
        // The first warms caches up.
        if round > 0 {
            rounds.push(times);
        }
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let time = |i: usize| median(rounds.iter().map(|r| r[i]).collect());
    let ratio = |i: usize, j: usize| median(rounds.iter().map(|r| r[i] / r[j]).collect());
    let total = f64::from(rays(&camera) + rays(&shadow));
    for (i, name) in ["whole render", "queries, packets", "queries, single"].iter().enumerate() {
        println!("{name:>18}  {:7.1} ms  {:6.1} Mrays/s", 1e3 * time(i), total / time(i) / 1e6);
    }
    println!("render / packet queries: {:.2}", ratio(0, 1));
    println!("single / packet queries: {:.2}", ratio(2, 1));
}

/// A fractal height field of 2·cells² triangles over [−1, 1]², seen from above, under a low sun.
fn terrain(cells: u32) -> Scene {
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
    });
    let (direction, irradiance) = (DVec3::new(0.75, -0.45, 0.42), Rgb::splat(3.0));
    desc.lights.push(LightDesc::Directional { direction, irradiance });
    Scene::build_quietly(desc, AccelKind::default()).expect("a sound scene")
}

/// The camera rays that `render` traces for seed 0, block by block.
fn camera_blocks(scene: &Scene) -> Vec<RayBlock> {
    let filter = FilterTable::new(scene.settings.filter);
    let origins =
        (0..SIZE[1]).step_by(4).flat_map(|y| (0..SIZE[0]).step_by(4).map(move |x| [x, y]));
    let block = |[x0, y0]: [u32; 2]| {
        let mut block = RayBlock::empty();
        for lane in 0..LANES {
            let [x, y] = [x0 + lane as u32 % 4, y0 + lane as u32 / 4];
            let [u, v, ..] = Sampler::new(0, [x, y], 0).four(Dimensions::Camera);
            let [dx, dy] = filter.sample([u, v]).offset.map(f64::from);
            let film = DVec2::new(f64::from(x) + 0.5 + dx, f64::from(y) + 0.5 + dy);
            if let Some(ray) = scene.camera.ray(film) {
                block.set(lane, &ray);
            }
        }
        block
    };
    origins.map(block).collect()
}

/// The shadow rays towards the first light that follow from them.
fn shadow_blocks<Q: RayQuery>(scene: &Scene, query: &Q, camera: &[RayBlock]) -> Vec<RayBlock> {
    let block = |rays: &RayBlock| {
        let hits = query.intersect_block(rays);
        let mut block = RayBlock::empty();
        for lane in rays.lanes() {
            let Some(hit) = hits.get(lane) else { continue };
            let point = scene.surface(&rays.get(lane), hit);
            let light = scene.lights[0].sample(point.position, [0.5, 0.5]).expect("a sun");
            if light.direction.dot(point.geometric_normal) > 0.0 {
                block.set(lane, &scene.spawn(&point, light.direction, light.distance));
            }
        }
        block
    };
    camera.iter().map(block).collect()
}
