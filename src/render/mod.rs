//! Cuts the film into tiles, runs an integrator over them on all threads, pass by pass, adds the samples
//! up, and stops where it is told to. It owns threads and order; it knows neither files nor terminals, and
//! tells whoever asks through an [`Observer`].

mod stop;
mod tiles;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;

use self::stop::SoFar;
pub use self::stop::{Stop, StopRules};
use self::tiles::{Pass, TileRenderer, Workspace, tiles};
use crate::accel::{RayQuery, with_accel};
use crate::film::{Film, FilterTable, PixelRect};
use crate::integrator::{Ao, Everything, Flat, Integrator, Local, RayCounts, Tree, Whitted};
use crate::scene::{IntegratorKind, Scene, Variant};

/// Non-finite samples that are told one by one; further ones are only counted.
const NON_FINITE_TOLD: usize = 8;

/// What to render of a scene.
#[derive(Debug, Clone, Default)]
pub struct RenderJob {
    /// The part of the picture; all of it where not given.
    pub crop: Option<PixelRect>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// The variant of the ray tree, where it is not to be the least that the scene needs; a lesser one
    /// leaves out what it does not know. For comparisons: the picture is the same from that one on.
    pub variant: Option<Variant>,
    /// When it is over; without it, after the samples that the scene says.
    pub stop: Option<StopRules>,
}

/// Hears how a render goes, and ends it. Called from all threads.
pub trait Observer: Sync {
    /// A share of the work is done, from 0 to 1.
    fn progress(&self, done: f64, rays: u64) {
        let _ = (done, rays);
    }

    /// Whether to end the render after the blocks that are being worked on.
    fn stop(&self) -> bool {
        false
    }
}

/// Hears nothing.
impl Observer for () {}

/// What came of a render.
#[derive(Debug)]
pub struct Rendered {
    /// The picture. Blocks that were not reached are black.
    pub film: Film,
    /// Samples that every pixel has; some have more where the observer ended it.
    pub samples: u32,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples that were NaN or infinite and left out.
    pub non_finite: NonFinite,
    /// What ended it.
    pub stop: Stop,
}

/// Samples that came out as NaN or infinite.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NonFinite {
    /// How many.
    pub count: u64,
    /// Pixel and sample number of a few of them, in the picture's order.
    pub first: Vec<([u32; 2], u32)>,
}

/// Renders a scene on the threads of the current rayon pool. The picture depends on scene, job and
/// instruction set alone, not on the number of threads or their order (but for surfaces that coincide
/// in a hierarchy built at low quality).
pub fn render(scene: &Scene, job: &RenderJob, observer: &dyn Observer) -> Rendered {
    // Static dispatch from here on: one loop of those that are compiled is run.
    with_accel!(&scene.accel, query => choose(scene, query, job, observer))
}

fn choose<Q: RayQuery>(
    scene: &Scene,
    query: &Q,
    job: &RenderJob,
    observer: &dyn Observer,
) -> Rendered {
    let depth = match scene.settings.integrator {
        IntegratorKind::Flat => return run(scene, query, &Flat, job, observer),
        IntegratorKind::Ao => return run(scene, query, &Ao, job, observer),
        IntegratorKind::Direct => None,
        IntegratorKind::Whitted => Some(scene.settings.max_depth),
    };
    match job.variant.unwrap_or(scene.requirements.variant) {
        Variant::Local => run(scene, query, &Whitted::<Local>::new(depth), job, observer),
        Variant::Tree => run(scene, query, &Whitted::<Tree>::new(depth), job, observer),
        Variant::Everything => run(scene, query, &Whitted::<Everything>::new(depth), job, observer),
    }
}

fn run<Q: RayQuery, I: Integrator>(
    scene: &Scene,
    query: &Q,
    integrator: &I,
    job: &RenderJob,
    observer: &dyn Observer,
) -> Rendered {
    let whole = PixelRect::whole(scene.size);
    let window = job.crop.map_or(whole, |crop| crop.intersection(&whole));
    let samples = scene.settings.samples;
    let rules = job.stop.unwrap_or(StopRules { samples, error: None, deadline: None });
    // Sums are kept only where it may go on from there.
    let goes_on = rules.look_at_the_film();
    let film = Mutex::new(Film::new(scene.size, window, goes_on || rules.samples > 1));
    let totals = Mutex::new((RayCounts::default(), NonFinite::default()));
    let rays_done = AtomicU64::new(0);
    let mut tiles = tiles(&window);
    let filter = FilterTable::new(scene.settings.filter);
    let renderer = TileRenderer { scene, query, integrator, filter, seed: job.seed, window };

    let mut so_far = SoFar::NOTHING;
    let stop = loop {
        let done = so_far.samples;
        let to = if goes_on { rules.next(&so_far) } else { rules.samples };
        let expected = if done > 0 { rules.expected(&so_far) } else { f64::from(rules.samples) };
        let pass = Pass { samples: done..to, goes_on };
        let (clock, taken) = (Instant::now(), to - done);
        let pixels_done = AtomicU64::new(0);
        tiles.par_iter_mut().for_each_init(Workspace::new, |workspace, tile| {
            renderer.render(tile, &pass, workspace, observer);
            let output = &mut workspace.output;
            {
                let mut film = film.lock().unwrap_or_else(PoisonError::into_inner);
                output.blocks.iter().for_each(|block| film.put(block));
            }
            {
                let mut totals = totals.lock().unwrap_or_else(PoisonError::into_inner);
                totals.0.add(&output.rays);
                totals.1.count += output.non_finite.count;
                totals.1.first.append(&mut output.non_finite.first);
            }
            let pixels = pixels_done.fetch_add(output.pixels, Ordering::Relaxed) + output.pixels;
            let traced = output.rays.total();
            let rays = rays_done.fetch_add(traced, Ordering::Relaxed) + traced;
            let share = pixels as f64 / window.area() as f64;
            let samples = f64::from(done) + share * f64::from(taken);
            observer.progress((samples / expected).min(1.0), rays);
        });
        // A stop that was asked for with the last block cut nothing off.
        if pixels_done.into_inner() < window.area() as u64 {
            break Stop::Interrupted;
        }
        let film = film.lock().unwrap_or_else(PoisonError::into_inner);
        let error = rules.error.and_then(|_| film.relative_error());
        so_far = SoFar { samples: to, error, per_sample: clock.elapsed() / taken };
        if let Some(stop) = rules.end(&so_far) {
            break stop;
        }
    };

    let (rays, mut non_finite) = totals.into_inner().unwrap_or_default();
    // Threads finish in any order; what is told does not depend on it.
    non_finite.first.sort_unstable_by_key(|([x, y], sample)| (*y, *x, *sample));
    non_finite.first.truncate(NON_FINITE_TOLD);
    let mut film = film.into_inner().unwrap_or_else(PoisonError::into_inner);
    let samples = if goes_on { so_far.samples.max(1) } else { rules.samples };
    if samples == 1 {
        film.standard_error = None;
    }
    Rendered { film, samples, rays, non_finite, stop }
}
