//! Cuts the film into tiles, runs an integrator over them on all threads, pass by pass, adds the samples
//! up, and stops where it is told to. It owns threads and order; it knows neither files nor terminals, and
//! tells whoever asks through an [`Observer`].

mod adaptive;
mod center;
mod state;
mod stop;
mod tiles;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use self::adaptive::{Budget, set_targets};
use self::center::center_layers;
pub use self::state::{BlockState, RenderState, block_origins};
use self::stop::SoFar;
pub use self::stop::{Stop, StopRules};
use self::tiles::{SampledLayers, Tile, TileOutput, TileRenderer, Workspace, tiles};
use crate::accel::{RayQuery, with_accel};
use crate::film::{Aov, Film, FilterTable, Layers, PixelRect, SamplingError};
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
    /// Number of the first sample of every pixel: 0, but for parts of a render.
    pub first_sample: u32,
    /// Whether what the samples add up to is kept, for [`Rendered::state`]: 100 to 400 bytes a pixel.
    pub keep_state: bool,
    /// About how long a pass over the picture should last, so that there is something to see or to keep
    /// as often; does not change the picture. It implies `keep_state`.
    pub pass_time: Option<Duration>,
    /// What the picture is to hold beside colours.
    pub layers: Vec<Aov>,
    /// Whether pixels have more samples where the error is, which takes a rule other than their number to
    /// end the render.
    pub is_adaptive: bool,
}

impl RenderJob {
    /// The part of the picture.
    fn window(&self, scene: &Scene) -> PixelRect {
        let whole = PixelRect::whole(scene.size);
        self.crop.map_or(whole, |crop| crop.intersection(&whole))
    }

    fn rules(&self, scene: &Scene) -> StopRules {
        let samples = self.first_sample + scene.settings.samples;
        self.stop.unwrap_or(StopRules { samples, error: None, deadline: None })
    }

    /// Whether sums are kept: only where something may go on from there.
    fn is_kept(&self, rules: &StopRules) -> bool {
        let goes_on = self.keep_state || self.pass_time.is_some() || self.first_sample > 0;
        goes_on || rules.look_at_the_film()
    }
}

/// Hears how a render goes, and ends it. Called from all threads.
pub trait Observer: Sync {
    /// A share of the work is done, from 0 to 1.
    fn progress(&self, done: f64, rays: u64) {
        let _ = (done, rays);
    }

    /// The error of the picture so far, where a rule asks for it.
    fn error(&self, error: f64) {
        let _ = error;
    }

    /// Whether to end the render after the blocks that are being worked on.
    fn stop(&self) -> bool {
        false
    }

    /// Whether [`Observer::look`] is to be called as soon as the tiles that are being worked on are done.
    fn wants_look(&self) -> bool {
        false
    }

    /// Sees how far the render is, while it stands still.
    fn look(&self, snapshot: &Snapshot<'_>) {
        let _ = snapshot;
    }
}

/// A render that stands still for a moment.
#[derive(Debug)]
pub struct Snapshot<'a> {
    /// The picture so far: blocks that were not reached are black.
    pub film: &'a Film,
    /// All blocks, where sums are kept; else none.
    pub blocks: &'a [&'a BlockState],
    /// The number of the first sample.
    pub first_sample: u32,
    /// Number of the sample at which the last finished pass of all blocks ended.
    pub passed: u32,
    /// Rays traced.
    pub rays: &'a RayCounts,
    /// Samples that were left out.
    pub non_finite: &'a NonFinite,
}

/// Hears nothing.
impl Observer for () {}

/// What came of a render.
#[derive(Debug)]
pub struct Rendered {
    /// The picture. Blocks that were not reached are black.
    pub film: Film,
    /// Samples that every pixel has, those before the first not counted; some have more where the
    /// observer ended it.
    pub samples: u32,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples that were NaN or infinite and left out.
    pub non_finite: NonFinite,
    /// What ended it.
    pub stop: Stop,
    /// The error by the samples of every pixel (on average) that it was asked after; only where a rule asks
    /// for it.
    pub errors: Vec<(u32, SamplingError)>,
    /// What to go on from, where it was to be kept.
    pub state: Option<RenderState>,
}

/// Samples that came out as NaN or infinite.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NonFinite {
    /// How many.
    pub count: u64,
    /// Pixel and sample number of a few of them, in the picture's order.
    pub first: Vec<([u32; 2], u32)>,
}

impl NonFinite {
    /// Adds those of another part; of which the first few are told does not depend on the order.
    fn add(&mut self, mut other: Self) {
        self.count += other.count;
        self.first.append(&mut other.first);
        self.first.sort_unstable_by_key(|([x, y], sample)| (*y, *x, *sample));
        self.first.truncate(NON_FINITE_TOLD);
    }
}

/// Renders a scene on the threads of the current rayon pool. The picture depends on scene, job and
/// instruction set alone, not on the number of threads or their order (but for surfaces that coincide
/// in a hierarchy built at low quality).
pub fn render(scene: &Scene, job: &RenderJob, observer: &dyn Observer) -> Rendered {
    render_from(Start::blank(scene, job), scene, job, observer)
}

/// What a render of a scene and a job begins with.
#[derive(Debug)]
pub struct Start(Beginning);

#[derive(Debug)]
enum Beginning {
    Blank(Film),
    State(RenderState),
}

impl Start {
    /// No sample, and a black film. Most of the time that it takes goes into asking the system for memory.
    pub fn blank(scene: &Scene, job: &RenderJob) -> Self {
        let window = job.window(scene);
        let rules = job.rules(scene);
        let mut film = Film::new(scene.size, window, rules.samples > 1 || job.is_kept(&rules));
        film.layers = Layers::new(&job.layers, window.area());
        Self(Beginning::Blank(film))
    }

    /// What another render of the same scene and job had come to: the picture will be what that would have become.
    pub const fn from_state(state: RenderState) -> Self {
        Self(Beginning::State(state))
    }
}

/// [`render`], from where it begins: a start of the same scene and job.
pub fn render_from(
    start: Start,
    scene: &Scene,
    job: &RenderJob,
    observer: &dyn Observer,
) -> Rendered {
    // Static dispatch from here on: one loop of those that are compiled is run.
    with_accel!(&scene.accel, query => choose(scene, query, job, start, observer))
}

fn choose<Q: RayQuery>(
    scene: &Scene,
    query: &Q,
    job: &RenderJob,
    start: Start,
    observer: &dyn Observer,
) -> Rendered {
    let depth = match scene.settings.integrator {
        IntegratorKind::Flat => return run(scene, query, &Flat, job, start, observer),
        IntegratorKind::Ao => return run(scene, query, &Ao, job, start, observer),
        IntegratorKind::Direct => None,
        IntegratorKind::Whitted => Some(scene.settings.max_depth),
    };
    match job.variant.unwrap_or(scene.requirements.variant) {
        Variant::Local => run(scene, query, &Whitted::<Local>::new(depth), job, start, observer),
        Variant::Tree => run(scene, query, &Whitted::<Tree>::new(depth), job, start, observer),
        Variant::Everything => {
            run(scene, query, &Whitted::<Everything>::new(depth), job, start, observer)
        }
    }
}

fn run<Q: RayQuery, I: Integrator>(
    scene: &Scene,
    query: &Q,
    integrator: &I,
    job: &RenderJob,
    start: Start,
    observer: &dyn Observer,
) -> Rendered {
    let (window, rules) = (job.window(scene), job.rules(scene));
    let (film, state, is_kept) = match start.0 {
        Beginning::Blank(film) => (film, None, job.is_kept(&rules)),
        Beginning::State(state) => (state.film(scene.size), Some(state), true),
    };
    let filter = FilterTable::new(scene.settings.filter);
    let layers = SampledLayers::new(scene, &job.layers);
    let renderer =
        TileRenderer { scene, query, integrator, filter, seed: job.seed, window, layers };
    let mut run = Run {
        renderer,
        observer,
        film: Mutex::new(film),
        tiles: Vec::new(),
        totals: Mutex::new((RayCounts::default(), NonFinite::default())),
        samples_done: AtomicU64::new(0),
        rays_done: AtomicU64::new(0),
        first_sample: job.first_sample,
        passed: job.first_sample,
        is_adaptive: job.is_adaptive && rules.look_at_the_film(),
        errors: Vec::new(),
    };
    if is_kept {
        let state =
            state.unwrap_or_else(|| RenderState::before(job.first_sample, window, &job.layers));
        run.restore(state);
    } else {
        run.tiles = tiles(&window).map(|at| Tile { at, blocks: Vec::new(), done: 0 }).collect();
    }
    let stop = run.until_it_is_over(&rules, is_kept, job.pass_time);
    let mut rendered = run.finish(stop, is_kept, rules.samples);
    rendered.film.layers.center = center_layers(scene, query, &window, &job.layers);
    rendered
}

/// A render under way.
struct Run<'a, Q, I> {
    renderer: TileRenderer<'a, Q, I>,
    observer: &'a dyn Observer,
    film: Mutex<Film>,
    tiles: Vec<Tile>,
    totals: Mutex<(RayCounts, NonFinite)>,
    /// Of pixels of the window.
    samples_done: AtomicU64,
    rays_done: AtomicU64,
    first_sample: u32,
    /// Number of the sample at which the last finished pass ended.
    passed: u32,
    is_adaptive: bool,
    /// What the error was at which number of samples.
    errors: Vec<(u32, SamplingError)>,
}

impl<Q: RayQuery, I: Integrator> Run<'_, Q, I> {
    fn restore(&mut self, mut state: RenderState) {
        let samples = state.blocks.iter().map(|block| {
            let area = tiles::block_in(&self.renderer.window, block.origin).area() as u64;
            area * block.sums.samples().len() as u64
        });
        self.samples_done = AtomicU64::new(samples.sum());
        self.rays_done = AtomicU64::new(state.rays.total());
        self.passed = state.passed;
        self.tiles = state.take_tiles();
        self.totals = Mutex::new((state.rays, state.non_finite));
    }

    fn blocks(&self) -> impl Iterator<Item = &BlockState> {
        self.tiles.iter().flat_map(|tile| &tile.blocks)
    }

    /// Takes samples, pass by pass, until one of the rules holds.
    fn until_it_is_over(
        &mut self,
        rules: &StopRules,
        is_kept: bool,
        pass_time: Option<Duration>,
    ) -> Stop {
        if !is_kept {
            let done = self.pass(rules.samples, f64::from(rules.samples));
            return if done { Stop::Samples } else { Stop::Interrupted };
        }
        let mut so_far = SoFar { samples: self.passed, ..SoFar::NOTHING };
        loop {
            if self.is_adaptive && self.passed >= adaptive::LEAST {
                return self.adaptively(rules, so_far);
            }
            // Where a pass was cut short, it goes to where it was to go, unless less is asked for now.
            let mut target = self.blocks().map(|block| block.target).max().unwrap_or(0);
            let most = self.blocks().map(|block| block.sums.samples().end).max().unwrap_or(0);
            target = target.min(rules.samples.max(most));
            if target <= self.passed {
                if self.passed > self.first_sample && rules.error.is_some() {
                    so_far.error = self.look_at_error();
                }
                if self.passed > self.first_sample
                    && let Some(stop) = rules.end(&so_far)
                {
                    return stop;
                }
                target = rules.next(&so_far);
                for block in self.tiles.iter_mut().flat_map(|tile| &mut tile.blocks) {
                    block.target = target;
                }
            }
            while so_far.samples < target {
                let limit = rules.limit(&so_far, target, pass_time);
                let expected = rules.expected(&so_far) - f64::from(self.first_sample);
                let (clock, before) = (Instant::now(), *self.samples_done.get_mut());
                if !self.pass(limit, expected) {
                    return Stop::Interrupted;
                }
                let taken = *self.samples_done.get_mut() - before;
                so_far.samples = limit;
                if taken > 0 {
                    let area = self.renderer.window.area() as f64;
                    so_far.per_sample = clock.elapsed().mul_f64(area / taken as f64);
                }
                if limit < target && rules.is_late(&so_far) {
                    self.passed = limit;
                    return Stop::Time;
                }
            }
            self.passed = target;
        }
    }

    /// From the first few samples on: goes on where the error is.
    fn adaptively(&mut self, rules: &StopRules, mut so_far: SoFar) -> Stop {
        let area = self.renderer.window.area() as f64;
        loop {
            if !self.blocks().any(|block| block.is_behind(u32::MAX)) {
                so_far.error = self.look_at_error();
                if let Some((wanted, error)) = rules.error.zip(so_far.error)
                    && error <= wanted
                {
                    return Stop::Error;
                }
                let film = self.film.get_mut().unwrap_or_else(PoisonError::into_inner);
                let Some(shares) = film.block_shares() else { return Stop::Samples };
                let left = rules.deadline.map(|at| at.saturating_duration_since(Instant::now()));
                let budget = Budget {
                    error: rules.error,
                    samples: rules.samples,
                    time: left.map(|left| (left, so_far.per_sample)),
                };
                let window = self.renderer.window;
                let blocks = self.tiles.iter_mut().flat_map(|tile| &mut tile.blocks);
                if !set_targets(blocks, &shares, &window, &budget) {
                    let is_full = self.blocks().all(|block| block.target >= rules.samples);
                    return if is_full { Stop::Samples } else { Stop::Time };
                }
            }
            let (clock, before) = (Instant::now(), *self.samples_done.get_mut());
            let to_come: u64 = self
                .blocks()
                .map(|block| {
                    let samples = u64::from(block.target - block.sums.samples().end);
                    samples * tiles::block_in(&self.renderer.window, block.origin).area() as u64
                })
                .sum();
            self.tiles.iter_mut().for_each(|tile| tile.done = 0);
            let expected = (before + to_come) as f64 / area;
            if !self.pass(u32::MAX, expected) {
                return Stop::Interrupted;
            }
            let taken = *self.samples_done.get_mut() - before;
            if taken > 0 {
                so_far.per_sample = clock.elapsed().mul_f64(area / taken as f64);
            }
            let least = self.blocks().map(|block| block.sums.samples().end).min();
            self.passed = least.unwrap_or(self.passed);
        }
    }

    /// The error of the picture so far, which is noted.
    fn look_at_error(&mut self) -> Option<f64> {
        let film = self.film.get_mut().unwrap_or_else(PoisonError::into_inner);
        let error = film.sampling_error()?;
        let samples = *self.samples_done.get_mut() as f64 / film.window.area() as f64;
        self.errors.push((samples.round() as u32, error));
        self.observer.error(error.value);
        Some(error.value)
    }

    /// Renders a pass: every block up to its target, or to sample number `limit`; stands still for a look
    /// now and then. `expected` is how many samples it will be in all. False where the observer ended it.
    fn pass(&mut self, limit: u32, expected: f64) -> bool {
        let mut tiles = std::mem::take(&mut self.tiles);
        let is_over = loop {
            let (ended, waits) = (AtomicBool::new(false), AtomicBool::new(false));
            let this = &*self;
            let left = tiles.par_iter_mut().filter(|tile| tile.done < limit);
            let workspace = || Workspace::new(&this.renderer.layers);
            left.for_each_init(workspace, |workspace, tile| {
                // Tiles that have begun are finished; the others come after the look.
                if waits.load(Ordering::Relaxed) || this.observer.wants_look() {
                    waits.store(true, Ordering::Relaxed);
                    return;
                }
                if this.renderer.render(tile, limit, workspace, this.observer) {
                    tile.done = limit;
                } else {
                    ended.store(true, Ordering::Relaxed);
                }
                this.collect(&mut workspace.output, expected);
            });
            if ended.into_inner() {
                break false;
            }
            if !waits.into_inner() {
                break true;
            }
            self.look(&tiles);
        };
        self.tiles = tiles;
        is_over
    }

    /// Puts what came of a tile to the rest.
    fn collect(&self, output: &mut TileOutput, expected: f64) {
        {
            let mut film = self.film.lock().unwrap_or_else(PoisonError::into_inner);
            let (means, mattes) = (&self.renderer.layers.means, &self.renderer.layers.mattes);
            for (number, block) in output.blocks.iter().enumerate() {
                film.put(block);
                let of = |n: usize| number * n..(number + 1) * n;
                for (layer, values) in output.means[of(means.len())].iter().enumerate() {
                    film.put_layer(layer, block.origin, values);
                }
                for (matte, shares) in output.mattes[of(mattes.len())].iter().enumerate() {
                    film.add_shares(matte, block.origin, shares);
                }
            }
        }
        {
            let mut totals = self.totals.lock().unwrap_or_else(PoisonError::into_inner);
            totals.0.add(&output.rays);
            totals.1.add(std::mem::take(&mut output.non_finite));
        }
        let add = |total: &AtomicU64, n| total.fetch_add(n, Ordering::Relaxed) + n;
        let samples = add(&self.samples_done, output.samples) as f64;
        let rays = add(&self.rays_done, output.rays.total());
        let share = samples / (expected * self.renderer.window.area() as f64);
        self.observer.progress(share.min(1.0), rays);
    }

    fn look(&mut self, tiles: &[Tile]) {
        let blocks: Vec<&BlockState> = tiles.iter().flat_map(|tile| &tile.blocks).collect();
        let (rays, non_finite) = self.totals.get_mut().unwrap_or_else(PoisonError::into_inner);
        self.observer.look(&Snapshot {
            film: self.film.get_mut().unwrap_or_else(PoisonError::into_inner),
            blocks: &blocks,
            first_sample: self.first_sample,
            passed: self.passed,
            rays,
            non_finite,
        });
    }

    fn finish(self, stop: Stop, is_kept: bool, samples: u32) -> Rendered {
        let (rays, non_finite) = self.totals.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut film = self.film.into_inner().unwrap_or_else(PoisonError::into_inner);
        let samples = if self.is_adaptive {
            // The mean over pixels.
            let all = self.samples_done.into_inner() as f64;
            (all / film.window.area() as f64).round().max(1.0) as u32
        } else if is_kept {
            (self.passed - self.first_sample).max(1)
        } else {
            samples
        };
        if samples == 1 {
            film.standard_error = None;
        }
        let state = is_kept.then(|| RenderState {
            window: film.window,
            first_sample: self.first_sample,
            passed: self.passed,
            blocks: self.tiles.into_iter().flat_map(|tile| tile.blocks).collect(),
            rays,
            non_finite: non_finite.clone(),
            layers: film.layers.wanted.clone(),
            mattes: film.layers.mattes.clone(),
        });
        Rendered { film, samples, rays, non_finite, stop, errors: self.errors, state }
    }
}
