//! Speed against accuracy on a scene: what each knob that matters to it costs and buys, measured against a
//! reference; which settings nothing beats, and which reach an error or a time.
//!
//! Errors are relative as [`Film::sampling_error`] has them: what a render states of itself is what is
//! measured here, and beside it what its own estimate cannot know, the bias. Seconds are those of the
//! render of the scene as it stands, times the median ratio to it in interleaved rounds.

mod chart;
mod choice;
mod convergence;
mod files;
mod page;
mod recommend;

use std::time::Instant;

use serde::Serialize;

pub use choice::{Choice, Effect, Knob, knobs};
pub use convergence::Slope;
pub use files::{FileCost, HalfLoss};
pub use page::{html, quoted};
pub use recommend::{Recommendation, Target};

use choice::has_tree;
use convergence::{numbers_of_samples, slope};
use files::half_loss;

use super::{CompareOptions, compare};
use crate::accel::Precision;
use crate::film::{Film, Picture};
use crate::render::{Observer, RenderJob, Stop, StopRules, render};
use crate::scene::{Epsilon, IntegratorKind, Scene, SceneDesc, SceneError};
use crate::texture::TexelFilter;

/// Seed of the reference: not that of what is compared with it.
const REFERENCE_SEED: u64 = 0x1021_0000;

/// Samples at which a render ends that was to reach an error.
const MOST_SAMPLES: u32 = 1 << 24;

/// What is measured, and how well.
#[derive(Debug, Clone, PartialEq)]
pub struct TradeOptions {
    /// Interleaved rounds of which medians are taken; ≥ 1.
    pub rounds: u32,
    /// Samples of each pixel of the reference.
    pub reference_samples: u32,
    /// What settings are to be found for.
    pub targets: Vec<Target>,
    /// Seconds that reading the scene took, and writing a picture of that size takes.
    pub read_and_write: f64,
    /// Flags of `alhazen render` that make what is measured of the scene's file, value and all: what is
    /// recommended holds with them.
    pub given: Vec<Vec<String>>,
}

/// The picture that others are compared with.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The picture.
    pub film: Film,
    /// Its own relative error, as far as it is known; 0 where it counts as the truth.
    pub error: f64,
    /// How it was made, in words.
    pub made: String,
}

/// What was measured of a scene.
#[derive(Debug, Serialize)]
pub struct TradeReport {
    /// Pixels of the pictures.
    pub size: [u32; 2],
    /// Threads.
    pub threads: usize,
    /// Rounds of which medians were taken.
    pub rounds: u32,
    /// How the reference was made.
    pub reference: String,
    /// Its own relative error.
    pub reference_error: f64,
    /// The scene as it stands, first with its own number of samples.
    pub base: Point,
    /// The same with other numbers of samples, from few to many.
    pub convergence: Vec<Point>,
    /// How the squared error falls with the number of samples: that to this power.
    pub slope: Option<Slope>,
    /// Each knob that matters, and what became of its choices.
    pub knobs: Vec<KnobReport>,
    /// What half-float files lose and save.
    pub half: HalfLoss,
    /// Settings that reach what was asked for.
    pub recommendations: Vec<Recommendation>,
}

/// A knob and its choices.
#[derive(Debug, Serialize)]
pub struct KnobReport {
    /// Its name.
    pub name: &'static str,
    /// What it does: "noise", "bias" or "look".
    pub effect: &'static str,
    /// A point for each choice, beside the base's.
    pub points: Vec<Point>,
}

/// A way to render, measured.
#[derive(Debug, Clone, Serialize)]
pub struct Point {
    /// What it is called.
    pub label: String,
    /// The flags that make it of the scene.
    pub flags: Vec<String>,
    /// Samples of each pixel; a mean where they differ.
    pub samples: u32,
    /// Relative error against the reference, without the reference's own.
    pub error: f64,
    /// What it states of itself; null with one sample.
    pub sampling_error: Option<f64>,
    /// What is left of the error beside the sampling error, where that is more than chance.
    pub bias: Option<f64>,
    /// Relative difference from the scene as it stands, with the same random numbers; null where samples
    /// differ in number.
    pub difference: Option<f64>,
    /// Mean of (a − b)² / (b² + 0.01).
    pub relmse: f64,
    /// Mean FLIP.
    pub flip: f64,
    /// Seconds of the build.
    pub build_seconds: f64,
    /// Seconds of the render.
    pub seconds: f64,
    /// Those by the base's, median of rounds.
    pub ratio: f64,
    /// Bytes of the accelerator.
    pub bytes: u64,
    /// 1 / (relMSE · seconds).
    pub efficiency: f64,
    /// Whether nothing measured is both faster and better.
    pub is_on_front: bool,
    /// The picture, and FLIP of each pixel.
    #[serde(skip)]
    pub looks: (Picture, Vec<f32>),
    #[serde(skip)]
    choice: Choice,
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TradeError {
    /// The observer ended it.
    #[error("interrupted")]
    Interrupted,
    /// A scene cannot be built.
    #[error("{}", .0.first().map_or_else(String::new, ToString::to_string))]
    Scene(Vec<SceneError>),
    /// The reference is of other pixels.
    #[error("the reference is of {0} x {1} pixels, and the pictures of {2} x {3}")]
    Reference(u32, u32, u32, u32),
}

/// Hears how far a measurement is, and ends it.
pub trait TradeObserver: Observer {
    /// What is being rendered now.
    fn now(&self, what: &str);
}

/// A scene, built as a choice says.
struct Built {
    scene: Scene,
    choice: Choice,
    build_seconds: f64,
}

impl Built {
    fn job(&self) -> RenderJob {
        let Choice { settings, error, is_adaptive, .. } = &self.choice;
        let samples = if error.is_some() { MOST_SAMPLES } else { settings.samples };
        let stop = Some(StopRules { samples, error: *error, deadline: None });
        RenderJob { stop, is_adaptive: *is_adaptive, ..RenderJob::default() }
    }
}

/// What is the same for all that is measured.
struct Trade<'a> {
    desc: &'a SceneDesc,
    options: &'a TradeOptions,
    reference: &'a Reference,
    observer: &'a dyn TradeObserver,
}

/// The scene as it stands, beside which others are measured.
struct Beside<'a> {
    built: &'a Built,
    seconds: f64,
    film: &'a Film,
    samples: u32,
}

/// What a measured render came to.
struct Measured {
    film: Film,
    samples: u32,
    seconds: f64,
}

/// How much finer than what a scene says the steps through its volumes are, of a reference.
const FINER_VOLUMES: f64 = 0.1;

/// The settings of a reference of `desc`, which `base` renders: nothing cut short that costs accuracy.
pub fn reference_choice(desc: &SceneDesc, base: &Choice) -> Choice {
    let mut choice = base.clone();
    let settings = &mut choice.settings;
    settings.max_depth = settings.max_depth.max(32);
    if settings.integrator == IntegratorKind::Whitted {
        // Without bias, and without the tree's growing beyond all bounds.
        (settings.prune, settings.roulette) = (settings.prune.max(0.004), true);
    }
    settings.precision = settings.precision.max(Precision::Robust);
    settings.epsilon = Epsilon::Auto;
    settings.tolerance = settings.tolerance.times(0.25);
    let filters: Vec<TexelFilter> =
        desc.texture_filters().map(|own| settings.texture_filter.unwrap_or(own)).collect();
    // Texels that are to be seen as such stay.
    if filters.contains(&TexelFilter::Mip) && !filters.contains(&TexelFilter::Nearest) {
        settings.texture_filter = Some(TexelFilter::Bilinear);
    }
    (choice.error, choice.is_adaptive) = (None, false);
    choice
}

/// Renders the reference.
///
/// # Errors
/// [`TradeError`].
pub fn reference(
    desc: &SceneDesc,
    base: &Choice,
    samples: u32,
    observer: &dyn TradeObserver,
) -> Result<Reference, TradeError> {
    observer.now("reference");
    let mut choice = reference_choice(desc, base);
    choice.settings.samples = samples;
    let mut finer = desc.clone();
    finer.volumes.iter_mut().for_each(|volume| volume.tolerance *= FINER_VOLUMES);
    let scene = build(&finer, &choice)?.scene;
    let rendered =
        render(&scene, &RenderJob { seed: REFERENCE_SEED, ..RenderJob::default() }, observer);
    if rendered.stop == Stop::Interrupted {
        return Err(TradeError::Interrupted);
    }
    let error = rendered.film.relative_error().unwrap_or(0.0);
    // Told is what matters.
    let (told, own) = (&mut choice.settings, &base.settings);
    if scene.tessellations.is_empty() {
        told.tolerance = own.tolerance;
    }
    if !has_tree(&scene) {
        told.max_depth = own.max_depth;
        (told.prune, told.roulette) = (own.prune, own.roulette);
    }
    let flags = choice.flags(base).join(" ");
    let volumes =
        if desc.volumes.is_empty() { "" } else { ", and a tenth of the volumes' tolerance" };
    let made = format!("alhazen render {flags}{volumes}");
    Ok(Reference { film: rendered.film, error, made })
}

fn build(desc: &SceneDesc, choice: &Choice) -> Result<Built, TradeError> {
    let mut desc = desc.clone();
    desc.settings = choice.settings.clone();
    let start = Instant::now();
    let scene =
        Scene::build(desc, &choice.build_options(), &|_| true).map_err(TradeError::Scene)?;
    Ok(Built { scene, choice: choice.clone(), build_seconds: start.elapsed().as_secs_f64() })
}

/// Measures a scene.
///
/// # Errors
/// [`TradeError`].
pub fn trade(
    desc: &SceneDesc,
    base: &Choice,
    reference: &Reference,
    options: &TradeOptions,
    observer: &dyn TradeObserver,
) -> Result<TradeReport, TradeError> {
    let trade = Trade { desc, options, reference, observer };
    let built = build(desc, base)?;
    let window = reference.film.window;
    if [window.width(), window.height()] != built.scene.size {
        let [width, height] = built.scene.size;
        return Err(TradeError::Reference(window.width(), window.height(), width, height));
    }
    observer.now("the scene as it stands");
    // Once more than needed: the first warms up.
    let mut times = Vec::new();
    for _ in 0..=options.rounds {
        times.push(trade.render(&built)?.seconds);
    }
    let seconds = median(&times[1..]);
    let own = trade.render(&built)?;
    let base_point = trade.point("as it stands", &built, base, &own, seconds, 1.0);
    let beside = Beside { built: &built, seconds, film: &own.film, samples: own.samples };

    let mut convergence = Vec::new();
    for samples in numbers_of_samples(base.settings.samples, options.reference_samples) {
        let mut choice = base.clone();
        choice.settings.samples = samples;
        convergence.push(trade.measure(&counted(samples), &choice, &beside)?);
    }
    let slope = slope(convergence.iter().chain([&base_point]));

    let mut reports = Vec::new();
    let mut all = knobs(&built.scene, base);
    all.extend(adaptive(base, &base_point));
    for knob in all {
        let mut points = Vec::new();
        for (label, choice) in &knob.choices {
            let name = format!("{} {label}", knob.name);
            let mut point = trade.measure(&name, choice, &beside)?;
            point.label.clone_from(label);
            points.push(point);
        }
        let effect = match knob.effect {
            Effect::Noise => "noise",
            Effect::Bias => "bias",
            Effect::Look => "look",
        };
        reports.push(KnobReport { name: knob.name, effect, points });
    }
    let half = half_loss(&base_point.looks.0, &own.film, options.rounds);
    let mut report = TradeReport {
        size: built.scene.size,
        threads: rayon::current_num_threads(),
        rounds: options.rounds,
        reference: reference.made.clone(),
        reference_error: reference.error,
        base: base_point,
        convergence,
        slope,
        knobs: reports,
        half,
        recommendations: Vec::new(),
    };
    mark_front(&mut report);
    for target in &options.targets {
        let found = recommend::recommend(&trade, &report, *target)?;
        report.recommendations.push(found);
    }
    Ok(report)
}

impl Trade<'_> {
    fn render(&self, built: &Built) -> Result<Measured, TradeError> {
        self.render_until(built, None)
    }

    fn render_until(
        &self,
        built: &Built,
        deadline: Option<Instant>,
    ) -> Result<Measured, TradeError> {
        let start = Instant::now();
        let mut job = built.job();
        job.stop = job.stop.map(|rules| StopRules { deadline, ..rules });
        let rendered = render(&built.scene, &job, self.observer);
        if rendered.stop == Stop::Interrupted {
            return Err(TradeError::Interrupted);
        }
        let seconds = start.elapsed().as_secs_f64();
        Ok(Measured { film: rendered.film, samples: rendered.samples, seconds })
    }

    /// Builds and renders a choice in rounds with the base.
    fn measure(
        &self,
        name: &str,
        choice: &Choice,
        beside: &Beside<'_>,
    ) -> Result<Point, TradeError> {
        self.observer.now(name);
        let built = build(self.desc, choice)?;
        let mut ratios = Vec::new();
        let mut last = self.render(&built)?;
        // What takes far longer than the base needs no interleaving to tell.
        let rounds = if last.seconds > 10.0 * beside.seconds { 1 } else { self.options.rounds };
        for _ in 0..rounds {
            let by = self.render(beside.built)?.seconds;
            last = self.render(&built)?;
            ratios.push(last.seconds / by);
        }
        let ratio = median(&ratios);
        let base = &beside.built.choice;
        let mut point = self.point(name, &built, base, &last, ratio * beside.seconds, ratio);
        if last.samples == beside.samples && choice.error.is_none() {
            point.difference = Some(last.film.error_against(beside.film));
        }
        Ok(point)
    }

    fn point(
        &self,
        label: &str,
        built: &Built,
        base: &Choice,
        measured: &Measured,
        seconds: f64,
        ratio: f64,
    ) -> Point {
        let film = &measured.film;
        let stated = film.sampling_error();
        let squared =
            film.error_against(&self.reference.film).powi(2) - self.reference.error.powi(2);
        let bias = stated.and_then(|stated| {
            // More than the upper bound of what samples explain.
            let is_bias = squared > stated.high.powi(2);
            is_bias.then(|| (squared - stated.value.powi(2)).sqrt())
        });
        let picture = Picture::from(film.clone());
        let truth = Picture::from(self.reference.film.clone());
        let found = compare(&picture, &truth, &CompareOptions::default());
        let found = found.expect("their sizes were compared");
        Point {
            label: label.to_owned(),
            flags: built.choice.flags(base),
            samples: measured.samples,
            error: squared.max(0.0).sqrt(),
            sampling_error: stated.map(|error| error.value),
            bias,
            difference: None,
            relmse: found.rel_mse,
            flip: found.flip,
            build_seconds: built.build_seconds,
            seconds,
            ratio,
            bytes: built.scene.accel.info().bytes,
            efficiency: 1.0 / (found.rel_mse * seconds),
            is_on_front: false,
            looks: (picture, found.flip_map),
            choice: built.choice.clone(),
        }
    }
}

/// Until less than the error of the scene as it stands: with the same number everywhere, and then with more
/// where the error is.
fn adaptive(base: &Choice, point: &Point) -> Option<Knob> {
    let error = point.sampling_error.filter(|error| *error > 0.0)?;
    let until = |share: f64| {
        let error = three_digits(share * error);
        [false, true].map(|is_adaptive| {
            let label = if is_adaptive { "adaptive" } else { "uniform" };
            let choice = Choice { error: Some(error), is_adaptive, ..base.clone() };
            (format!("to {:.3} %, {label}", 100.0 * error), choice)
        })
    };
    // What twice and four times the samples are for.
    let choices = [std::f64::consts::FRAC_1_SQRT_2, 0.5].into_iter().flat_map(until).collect();
    Some(Knob { name: "adaptive", effect: Effect::Noise, choices })
}

/// Rounded down, for a flag.
fn three_digits(x: f64) -> f64 {
    let power = 10f64.powf(2.0 - x.log10().floor());
    (x * power).floor() / power
}

/// "1 sample", "4 samples".
fn counted(samples: u32) -> String {
    if samples == 1 { "1 sample".to_owned() } else { format!("{samples} samples") }
}

fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// All points, in the order of the report.
fn points(report: &mut TradeReport) -> Vec<&mut Point> {
    let knobs = report.knobs.iter_mut().filter(|knob| knob.effect != "look");
    let all = std::iter::once(&mut report.base).chain(&mut report.convergence);
    all.chain(knobs.flat_map(|knob| &mut knob.points)).collect()
}

/// Marks what nothing measured beats in both time and error: the Pareto front.
fn mark_front(report: &mut TradeReport) {
    let mut all = points(report);
    all.sort_by(|a, b| a.seconds.total_cmp(&b.seconds).then(a.error.total_cmp(&b.error)));
    let mut least = f64::INFINITY;
    for point in all {
        point.is_on_front = point.error < least;
        least = least.min(point.error);
    }
}
