//! Speed against accuracy on a scene: what each knob that matters to it costs and buys, measured against a
//! reference; which settings nothing beats, and which reach an error or a time.
//!
//! Errors are relative as [`Film::sampling_error`] has them: what a render states of itself is what is
//! measured here, and beside it what its own estimate cannot know, the bias. Seconds are those of the
//! render of the scene as it stands, times the median ratio to it in interleaved rounds.

mod choice;
mod page;
mod recommend;

use std::time::Instant;

use exr::prelude::f16;
use serde::Serialize;

pub use choice::{Choice, Effect, Knob, knobs};
pub use page::{html, quoted};
pub use recommend::{Recommendation, Target};

use super::{CompareOptions, compare};
use crate::accel::Precision;
use crate::color::Rgb;
use crate::film::{Film, Picture};
use crate::render::{Observer, RenderJob, Stop, StopRules, render};
use crate::scene::{Epsilon, IntegratorKind, Scene, SceneDesc, SceneError};

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
    /// What half-float files lose.
    pub half: HalfLoss,
    /// Settings that reach what was asked for.
    pub recommendations: Vec<Recommendation>,
}

/// The power of a fit.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Slope {
    /// Of the squared error by the number of samples: −1 for independent samples.
    pub power: f64,
    /// Half the width of its 95 % interval.
    pub plus_minus: f64,
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

/// What halves lose of a picture, beside what samples do.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct HalfLoss {
    /// Relative error by rounding to half alone.
    pub error: f64,
    /// Pixels that half cannot hold: the file is then written as float.
    pub beyond: u64,
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

/// The settings of a reference: nothing cut short that costs accuracy.
pub fn reference_choice(base: &Choice) -> Choice {
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
    let mut choice = reference_choice(base);
    choice.settings.samples = samples;
    let scene = build(desc, &choice)?.scene;
    let rendered =
        render(&scene, &RenderJob { seed: REFERENCE_SEED, ..RenderJob::default() }, observer);
    if rendered.stop == Stop::Interrupted {
        return Err(TradeError::Interrupted);
    }
    let error = rendered.film.relative_error().unwrap_or(0.0);
    let flags = choice.flags(base).join(" ");
    Ok(Reference { film: rendered.film, error, made: format!("alhazen render {flags}") })
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
        convergence.push(trade.measure(&format!("{samples} samples"), &choice, &beside)?);
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
    let half = half_loss(&base_point.looks.0);
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

/// Numbers of samples beside the scene's own: powers of four, as far as the reference tells them apart.
fn numbers_of_samples(own: u32, reference: u32) -> Vec<u32> {
    let powers = (0..12).map(|power| 1u32 << (2 * power));
    powers
        .take_while(|n| *n <= (reference / 4).max(own).min(64 * own))
        .filter(|n| *n != own)
        .collect()
}

/// Until half the error of the scene as it stands: the same number everywhere, or where the error is.
fn adaptive(base: &Choice, point: &Point) -> Option<Knob> {
    let error = point.sampling_error.filter(|error| *error > 0.0)?;
    // Three digits.
    let power = 10f64.powf(2.0 - (0.5 * error).log10().floor());
    let error = (0.5 * error * power).round() / power;
    let choices = [false, true].map(|is_adaptive| {
        let label = if is_adaptive { "adaptive" } else { "uniform" };
        let choice = Choice { error: Some(error), is_adaptive, ..base.clone() };
        (format!("to {:.3} %, {label}", 100.0 * error), choice)
    });
    Some(Knob { name: "adaptive", effect: Effect::Noise, choices: choices.into() })
}

/// What rounding to half does to a picture.
fn half_loss(picture: &Picture) -> HalfLoss {
    let film = |pixels: Vec<Rgb>| {
        let mut film = Film::new(picture.size, crate::film::PixelRect::whole(picture.size), false);
        film.mean = pixels;
        film
    };
    let round = |x: f32| f16::from_f32(x).to_f32();
    let rounded: Vec<Rgb> = picture.pixels.iter().map(|c| c.map(round)).collect();
    let beyond = rounded.iter().filter(|c| !c.is_finite()).count() as u64;
    let error = film(rounded).error_against(&film(picture.pixels.clone()));
    HalfLoss { error, beyond }
}

/// A line through the logarithms of squared error and number of samples; none with fewer than three points.
fn slope<'a>(points: impl Iterator<Item = &'a Point>) -> Option<Slope> {
    // Without what a bias holds back.
    let known = points.filter(|p| p.error > 0.0 && p.bias.is_none());
    let points: Vec<[f64; 2]> =
        known.map(|p| [f64::from(p.samples).ln(), 2.0 * p.error.ln()]).collect();
    let n = points.len() as f64;
    if points.len() < 3 {
        return None;
    }
    let mean = [0, 1].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / n);
    let sum = |a: usize, b: usize| {
        points.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>()
    };
    let power = sum(0, 1) / sum(0, 0);
    let residual = (sum(1, 1) - power * sum(0, 1)).max(0.0) / (n - 2.0);
    Some(Slope { power, plus_minus: student(points.len() - 2) * (residual / sum(0, 0)).sqrt() })
}

/// Student's t for a two-sided 95 % interval.
fn student(degrees: usize) -> f64 {
    const TABLE: [f64; 10] = [12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];
    TABLE.get(degrees.wrapping_sub(1)).copied().unwrap_or(2.0)
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
