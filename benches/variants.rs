//! What a scene does not require costs nothing: the product against code in which nothing else exists,
//! and the variants of the ray tree against each other.
//!
//! `make bench` prints medians of the ratios within interleaved rounds, each with the interval that holds
//! the true median in 96 % of cases.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

mod common;

use alhazen::accel::{Accel, LANES, RayBlock, RayQuery};
use alhazen::color::{Rgb, RgbLanes};
use alhazen::film::Film;
use alhazen::integrator::{CameraBlock, Integrator, Local, RayCounts, Whitted};
use alhazen::render::{RenderJob, render};
use alhazen::sampler::Sampler;
use alhazen::scene::{Scene, Variant};
use common::{ROUNDS, camera_blocks, interleaved, median, ratio, terrain, w2};
use rayon::prelude::*;

/// For the first comparison, whose answer should be "none": enough to tell 1 %.
const MANY_ROUNDS: usize = 31;

fn main() {
    let scene = terrain(708);
    let threads = rayon::current_num_threads();
    println!("{threads} threads, {}", scene.accel.info());
    println!("terrain of {} triangles under one sun:", scene.requirements.triangles);
    assert_eq!(scene.requirements.variant, Variant::Local);
    match &scene.accel {
        Accel::Embree(query) => against_minimal(&scene, query),
        _ => unreachable!("Embree is the default"),
    }
    for more in [Variant::Tree, Variant::Everything] {
        forced(&scene, more);
    }

    let field = w2::scene(|desc| desc.image.size = [320, 180]);
    println!("field of 2,000 spheres, mirrors and glass:");
    assert_eq!(field.requirements.variant, Variant::Tree);
    forced(&field, Variant::Everything);
}

/// The product's integrator and a minimal one, over the same camera rays.
fn against_minimal<Q: RayQuery>(scene: &Scene, query: &Q) {
    let blocks = camera_blocks(scene, 0);
    let product = Whitted::<Local>::new(Some(scene.settings.max_depth));
    let minimal = Minimal;
    assert_eq!(
        shaded(scene, query, &product, &blocks),
        shaded(scene, query, &minimal, &blocks),
        "the same picture, bit for bit"
    );
    let a = || drop(std::hint::black_box(shaded(scene, query, &product, &blocks)));
    let b = || drop(std::hint::black_box(shaded(scene, query, &minimal, &blocks)));
    let rounds = interleaved(&a, &b, MANY_ROUNDS);
    let time = 1e3 * median(rounds.iter().map(|r| r.1).collect());
    let (ratio, [from, to]) = ratio(&rounds);
    println!("  the same picture as that of the minimal integrator ({time:.1} ms), bit for bit");
    println!("  product / minimal integrator: {ratio:.3} [{from:.3}, {to:.3}]");
    let verdict = match (from <= 1.0, to >= 1.0) {
        (true, true) => "the interval contains 1: what is absent costs nothing",
        (false, _) => "the interval is ABOVE 1: the product pays for what is absent",
        (_, false) => "the interval is below 1: the minimal integrator is the slower one",
    };
    println!("  {verdict}");
}

/// What the least variant saves over a greater one, on a scene that does not need it.
fn forced(scene: &Scene, variant: Variant) {
    let job = RenderJob { variant: Some(variant), ..RenderJob::default() };
    let chosen = render(scene, &RenderJob::default(), &());
    let greater = render(scene, &job, &());
    assert_eq!(bits(&chosen.film), bits(&greater.film), "the same picture, bit for bit");
    let a = || drop(std::hint::black_box(render(scene, &job, &())));
    let b = || drop(std::hint::black_box(render(scene, &RenderJob::default(), &())));
    let rounds = interleaved(&a, &b, ROUNDS);
    let (ratio, [from, to]) = ratio(&rounds);
    let name = scene.requirements.variant.name();
    println!("  `{}` / `{name}`: {ratio:.3} [{from:.3}, {to:.3}]", variant.name());
}

fn bits(film: &Film) -> Vec<[u32; 3]> {
    film.mean.iter().map(|c| c.to_array().map(f32::to_bits)).collect()
}

/// The radiance of all camera rays.
fn shaded<Q: RayQuery>(
    scene: &Scene,
    query: &Q,
    integrator: &impl Integrator,
    blocks: &[(RayBlock, [Sampler; LANES])],
) -> Vec<[[u32; LANES]; 3]> {
    let block = |(rays, samplers): &(RayBlock, [Sampler; LANES])| {
        let hits = query.intersect_block(rays);
        let camera = CameraBlock { rays, hits: &hits, samplers };
        let mut counts = RayCounts::default();
        let radiance = integrator.shade(scene, query, &camera, &mut counts);
        std::hint::black_box(counts);
        radiance.0.map(|values| values.map(f32::to_bits))
    };
    blocks.par_iter().with_min_len(16).map(block).collect()
}

/// Local illumination and nothing else, written as if nothing else existed: the same surfaces, lights and
/// materials, but no tree, media, textures, glow or lights with an area.
struct Minimal;

impl Integrator for Minimal {
    fn shade<Q: RayQuery>(
        &self,
        scene: &Scene,
        query: &Q,
        camera: &CameraBlock<'_>,
        counts: &mut RayCounts,
    ) -> RgbLanes<LANES> {
        let points: [_; LANES] = std::array::from_fn(|lane| {
            camera.hits.get(lane).map(|hit| scene.surface(&camera.rays.get(lane), &hit))
        });
        let mut radiance = points.each_ref().map(|point| match point {
            Some(point) => point.material.ambient() * scene.ambient,
            None => scene.background,
        });
        for light in &scene.lights {
            let mut packet = RayBlock::empty();
            let mut unshadowed = [Rgb::BLACK; LANES];
            for (lane, point) in points.iter().enumerate() {
                let Some(point) = point else { continue };
                let Some(sample) = light.sample(point.position, [0.5; 2]) else { continue };
                if sample.direction.dot(point.geometric_normal) <= 0.0 {
                    continue;
                }
                let wo = -camera.rays.get(lane).direction;
                let response = point.material.response(point.normal, wo, sample.direction);
                if response.is_black() {
                    continue;
                }
                unshadowed[lane] = response * sample.irradiance;
                if scene.settings.shadows.are_cast() {
                    packet.set(lane, &scene.spawn(point, sample.direction, sample.distance));
                }
            }
            let mut occluded = 0;
            if packet.active() != 0 {
                counts.shadow += u64::from(packet.active().count_ones());
                occluded = query.occluded_block(&packet);
            }
            for lane in (0..LANES).filter(|lane| occluded >> lane & 1 == 0) {
                radiance[lane] += unshadowed[lane];
            }
        }
        RgbLanes::from_fn(|lane| radiance[lane])
    }
}
