//! What the ray tree costs beyond its ray queries: the field of spheres, rendered whole and replayed as
//! bare queries; and compared with other renderers where they are installed.
//!
//! `make bench` prints medians over interleaved rounds. POV-Ray is compared where `povray` is found,
//! Mitsuba 3 where the Python of `ALHAZEN_PYTHON` (or `python3`) has it.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

mod common;

use alhazen::accel::{Accel, AccelKind, RayQuery};
use alhazen::film::Picture;
use alhazen::integrator::{Tree, Whitted};
use alhazen::measure::{CompareOptions, compare};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{Hollows, Scene, SceneDesc, Shadows};
use common::record::{Query, record};
use common::{median, peers, seconds, w2};
use rayon::prelude::*;

const ROUNDS: usize = 5;

fn main() {
    let scene = w2::scene(|_| ());
    println!(
        "field of 2,000 spheres, {} x {}, {} samples, {} bounces, {} threads, {}",
        scene.size[0],
        scene.size[1],
        scene.settings.samples,
        scene.settings.max_depth,
        rayon::current_num_threads(),
        scene.accel.info()
    );
    let ours = w2::scene_in(AccelKind::Bvh, |_| ());
    match &scene.accel {
        Accel::Embree(query) => measure(&scene, query, &ours),
        _ => unreachable!("Embree is the default"),
    }
    against_pov(&scene);
    against_mitsuba(&scene);
}

/// Times of POV-Ray and ours by turns. Light passes clear glass there, which it does here with
/// `shadows = "tinted"`; by default, glass hides. It renders 2 × 2 pixels for each of ours.
fn against_pov(opaque: &Scene) {
    const PEER_ROUNDS: usize = 3;
    let size = opaque.size.map(|x| 2 * x);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("field.pov");
    std::fs::write(&file, peers::pov(size)).expect("the folder is ours");
    let lets_through = |desc: &mut SceneDesc| desc.settings.shadows = Shadows::Tinted;
    let (tinted, by_bvh) = (w2::scene(lets_through), w2::scene_in(AccelKind::Bvh, lets_through));
    let ours = |scene: &Scene| {
        seconds(&|| drop(std::hint::black_box(render(scene, &RenderJob::default(), &()))))
    };
    let mut rounds = Vec::new();
    for _ in 0..PEER_ROUNDS {
        match peers::time_pov(&file, size) {
            Ok(theirs) => rounds.push([theirs, ours(&tinted), ours(opaque), ours(&by_bvh)]),
            Err(reason) => return println!("no comparison with POV-Ray: {reason}"),
        }
    }
    let time = |i: usize| median(rounds.iter().map(|r| r[i]).collect());
    let ratio = |i: usize| median(rounds.iter().map(|r| r[0] / r[i]).collect());
    println!("POV-Ray traces for {:.2} s", time(0));
    println!(
        "POV-Ray / ours, glass lets light through: {:.2} ({:.2} s); target 5",
        ratio(1),
        time(1)
    );
    println!("POV-Ray / ours by bvh, glass lets light through: {:.2} ({:.2} s)", ratio(3), time(3));
    println!("POV-Ray / ours, our glass hides: {:.2} ({:.2} s)", ratio(2), time(2));
}

/// Mitsuba follows one ray at each surface of glass, and light between diffuse surfaces: what can be
/// compared is the time for 4 samples, and that for an equal error, each against its own reference.
fn against_mitsuba(scene: &Scene) {
    let mut best: Option<(&str, peers::Mitsuba)> = None;
    for variant in ["llvm_ad_rgb", "scalar_rgb"] {
        // The estimator is the same.
        match peers::run_mitsuba(variant, scene.size, best.is_none()) {
            Ok(theirs) => {
                println!(
                    "Mitsuba {} {variant}: {:.2} s for 4 samples",
                    theirs.version, theirs.seconds
                );
                if best.as_ref().is_none_or(|(_, known)| theirs.seconds < known.seconds) {
                    let known = best.map(|(_, known)| (known.rel_mse, known.reference_samples));
                    let (rel_mse, reference_samples) =
                        known.unwrap_or((theirs.rel_mse, theirs.reference_samples));
                    best = Some((variant, peers::Mitsuba { rel_mse, reference_samples, ..theirs }));
                }
            }
            Err(reason) => println!("no comparison with Mitsuba's {variant}: {reason}"),
        }
    }
    let Some((variant, theirs)) = best else { return };
    let rendered = |samples, seed| -> Picture {
        let scene = w2::scene(|desc| {
            desc.image.size = scene.size.map(|x| x / 2);
            desc.settings.samples = samples;
        });
        render(&scene, &RenderJob { seed, ..RenderJob::default() }, &()).film.into()
    };
    let reference = rendered(theirs.reference_samples, 1);
    let error = compare(&rendered(4, 0), &reference, &CompareOptions::default());
    let error = error.expect("the same pixels").rel_mse;
    let ours = (0..3).map(|_| {
        seconds(&|| drop(std::hint::black_box(render(scene, &RenderJob::default(), &()))))
    });
    let ours = ours.fold(f64::INFINITY, f64::min);
    println!(
        "relMSE of 4 samples against {} of the same renderer: ours {error:.3e}, Mitsuba's {:.3e}",
        theirs.reference_samples, theirs.rel_mse
    );
    println!(
        "Mitsuba {variant} / ours, 4 samples each: {:.2}; for our error (relMSE falls as 1 / samples): \
         {:.1} s, {:.1} times as long",
        theirs.seconds / ours,
        theirs.seconds * theirs.rel_mse / error,
        theirs.seconds * theirs.rel_mse / error / ours
    );
}

/// Whole renders, by Embree and by our own hierarchy (`other`), and what Embree takes for the queries alone.
fn measure<Q: RayQuery>(scene: &Scene, query: &Q, other: &Scene) {
    let whitted = Whitted::<Tree>::new(Some(scene.settings.max_depth));
    // As whoever asks for every ray of the tree, those within spheres too.
    let mut asking = w2::scene(|_| ());
    asking.hollows = Hollows::default();
    let (queries, counts) = record(&asking, query, &whitted);
    println!(
        "{} camera, {} shadow, {} reflection, {} refraction rays; {:.1} % in packets; {} balls are hollow",
        counts.camera,
        counts.shadow,
        counts.reflection,
        counts.refraction,
        100.0 * queries.iter().map(Query::in_packet).sum::<u64>() as f64 / counts.total() as f64,
        scene.hollows.len()
    );
    let whole = || {
        std::hint::black_box(render(scene, &RenderJob::default(), &()));
    };
    let replay = || {
        queries.par_chunks(4096).for_each(|queries| queries.iter().for_each(|q| q.run(query)));
    };
    let singles = || {
        queries
            .par_chunks(4096)
            .for_each(|queries| queries.iter().for_each(|q| q.run_single(query)));
    };
    let whole_of_ours = || {
        std::hint::black_box(render(other, &RenderJob::default(), &()));
    };
    let whole_by_asking = || {
        std::hint::black_box(render(&asking, &RenderJob::default(), &()));
    };
    let mut asking_ours = w2::scene_in(AccelKind::Bvh, |_| ());
    asking_ours.hollows = Hollows::default();
    let whole_of_ours_by_asking = || {
        std::hint::black_box(render(&asking_ours, &RenderJob::default(), &()));
    };
    let works: [(&str, &dyn Fn()); 6] = [
        ("whole render", &whole),
        ("its queries", &replay),
        ("one by one", &singles),
        ("whole by bvh", &whole_of_ours),
        ("whole by asking for every ray", &whole_by_asking),
        ("by bvh, asking for every ray", &whole_of_ours_by_asking),
    ];
    let rounds: Vec<[f64; 6]> =
        (0..=ROUNDS).map(|_| works.map(|(_, work)| seconds(work))).skip(1).collect();
    for (i, (name, _)) in works.iter().enumerate() {
        let time = median(rounds.iter().map(|r| r[i]).collect());
        let speed = counts.total() as f64 / time / 1e6;
        println!("{name:>30}  {time:6.2} s  {speed:6.1} Mrays/s");
    }
    let ratio = |i: usize, j: usize| median(rounds.iter().map(|r| r[i] / r[j]).collect());
    println!("whole render / its queries: {:.2}; target 1.3", ratio(0, 1));
    println!("whole render by bvh / its queries by Embree: {:.2}; target 1.3", ratio(3, 1));
    println!(
        "whole render / one that asks for rays within hollow balls too: {:.2}, by bvh {:.2}",
        ratio(0, 4),
        ratio(3, 5)
    );
    println!("one by one / in packets where it traces packets: {:.2}", ratio(2, 1));
}
