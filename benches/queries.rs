//! What a render costs beyond its ray queries, and what packets gain: ratios within one run.
//!
//! `make bench` prints, for a terrain of a million triangles lit by a sun, medians over interleaved
//! rounds of: the whole render; its camera and shadow queries replayed in packets, without shading;
//! the same queries one ray at a time.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

mod common;

use alhazen::accel::{RayBlock, RayQuery};
use alhazen::render::{RenderJob, render};
use alhazen::scene::Scene;
use common::{ROUNDS, SIZE, camera_blocks, median, seconds, terrain};
use rayon::prelude::*;

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
    let camera: Vec<RayBlock> = camera_blocks(scene, 0).into_iter().map(|(b, _)| b).collect();
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
    let mut rounds: Vec<[f64; 3]> = Vec::new();
    for round in 0..=ROUNDS {
        let times = [seconds(&whole), seconds(&packets), seconds(&singles)];
        // The first warms caches up.
        if round > 0 {
            rounds.push(times);
        }
    }
    let time = |i: usize| median(rounds.iter().map(|r| r[i]).collect());
    let ratio = |i: usize, j: usize| median(rounds.iter().map(|r| r[i] / r[j]).collect());
    let total = f64::from(rays(&camera) + rays(&shadow));
    for (i, name) in ["whole render", "queries, packets", "queries, single"].iter().enumerate() {
        println!("{name:>18}  {:7.1} ms  {:6.1} Mrays/s", 1e3 * time(i), total / time(i) / 1e6);
    }
    println!("render / packet queries: {:.2}", ratio(0, 1));
    println!("single / packet queries: {:.2}", ratio(2, 1));
}

/// The shadow rays towards the first light that follow from them.
fn shadow_blocks<Q: RayQuery>(scene: &Scene, query: &Q, camera: &[RayBlock]) -> Vec<RayBlock> {
    let block = |rays: &RayBlock| {
        let hits = query.intersect_block(rays);
        let mut block = RayBlock::empty();
        for lane in rays.lanes() {
            let Some(hit) = hits.get(lane) else { continue };
            let point = scene.surface(&rays.get(lane), hit);
            let light = scene.lights[0].sample(point.position, [0.5; 2]).expect("a sun");
            if light.direction.dot(point.geometric_normal) > 0.0 {
                block.set(lane, &scene.spawn(&point, light.direction, light.distance));
            }
        }
        block
    };
    camera.iter().map(block).collect()
}
