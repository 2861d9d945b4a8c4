//! `alhazen trade`: what speed costs in accuracy on a scene, knob by knob, and settings that reach a target.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::Serialize;

use super::args::{SceneArgs, TradeArgs};
use super::outputs::check_targets;
use super::prepare::{load, thread_pool};
use super::progress::{Progress, catch_interrupts, interrupted};
use super::units::megabytes;
use super::{Failure, Outcome, print, tell, warn};
use crate::accel::AccelKind;
use crate::film::{Film, Picture, PixelRect};
use crate::io::{
    Attribute, AttributeValue, ExrOptions, NonFinite, PixelType, png_bytes, read_attributes,
    read_picture, write_exr, write_text,
};
use crate::measure::trade::{
    Choice, Point, Reference, Target, TradeError, TradeObserver, TradeOptions, TradeReport, html,
    quoted, reference, reference_choice, trade as measure,
};
use crate::render::Observer;
use crate::scene::SceneDesc;

/// Pixels across of the pictures, where it is not said.
const WIDTH: u32 = 320;

/// The header's name of a picture's own relative error.
const ERROR: &str = "alhazen.error";

/// And of how a reference was made, in words.
const MADE: &str = "alhazen.made";

/// The fields of `--json`; their names are stable.
#[derive(Debug, Serialize)]
struct Report<'a> {
    scene: &'a str,
    version: &'static str,
    #[serde(flatten)]
    report: &'a TradeReport,
}

/// Shows what is being measured, and how far that is.
struct Shown {
    quiet: bool,
    progress: Mutex<Progress>,
}

impl Shown {
    fn with<T>(&self, f: impl FnOnce(&mut Progress) -> T) -> T {
        f(&mut self.progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }
}

impl Observer for Shown {
    fn progress(&self, done: f64, rays: u64) {
        self.with(|progress| progress.report(done, rays));
    }

    fn stop(&self) -> bool {
        interrupted()
    }
}

impl TradeObserver for Shown {
    fn now(&self, what: &str) {
        self.with(|progress| {
            progress.finish();
            *progress = Progress::new(self.quiet, what.to_owned());
        });
    }
}

/// Measures, prints, writes what was asked for.
pub(super) fn trade(args: &TradeArgs) -> Result<Outcome, Failure> {
    let scene_args = &args.scene;
    let quiet = scene_args.quiet;
    let targets = args.html.iter().chain(&args.json).chain(&args.csv);
    let read = [scene_args.scene.as_path()].into_iter().chain(args.reference.as_deref());
    check_targets(read, targets)?;
    catch_interrupts();
    let pool = thread_pool(scene_args.threads)?;
    let clock = std::time::Instant::now();
    let mut loaded = pool.install(|| load(scene_args))?;
    let read = clock.elapsed().as_secs_f64();
    if scene_args.size.is_none() {
        shrink(&mut loaded.scene, quiet);
    }
    let [width, height] = loaded.scene.image.size;
    let mut base = Choice::of(loaded.scene.settings.clone());
    (base.kind, base.single_rays) = (args.accel.kind, args.accel.single_rays);
    let samples = args.reference_samples.unwrap_or_else(|| {
        // A quarter of the scene's own error at most, in numbers that do not take all day.
        base.settings.samples.saturating_mul(16).clamp(256, 4096)
    });
    let shown = Shown { quiet, progress: Mutex::new(Progress::new(quiet, "reference")) };
    let reference = match &args.reference {
        Some(path) => given_reference(path)?,
        None => {
            let of = reference_choice(&loaded.scene, &base);
            let said = format!("{:016x} {width} {height} {samples} {of:?}", loaded.hash);
            let path = args.cache().map(|folder| cache_file(&folder, &said));
            let make = || reference(&loaded.scene, &base, samples, &shown);
            pool.install(|| cached(path.as_deref(), make))?
        }
    };
    let errors = args.error.iter().map(|error| Target::Error(*error));
    let times = args.time.iter().map(|time| Target::Time(time.as_secs_f64()));
    let options = TradeOptions {
        rounds: args.rounds.into(),
        reference_samples: samples,
        targets: errors.chain(times).collect(),
        // As `render` keeps back for a picture of half floats.
        read_and_write: read + 0.02 + 1e-7 * f64::from(width) * f64::from(height),
        given: given(args, [width, height]),
    };
    let report = pool.install(|| measure(&loaded.scene, &base, &reference, &options, &shown));
    shown.with(|progress| progress.finish());
    let report = report.map_err(failure)?;

    let name = scene_args.scene.display().to_string();
    let picture = Picture::from(reference.film);
    let failed = |e: crate::io::WriteError| Failure::Failed(e.to_string());
    if let Some(path) = &args.html {
        write_text(path, &html(&name, &report, &picture, &png_bytes)).map_err(failed)?;
    }
    if let Some(path) = &args.json {
        let json = Report { scene: &name, version: env!("CARGO_PKG_VERSION"), report: &report };
        let text = serde_json::to_string_pretty(&json)
            .map_err(|e| Failure::Failed(format!("{}: {e}", path.display())))?;
        write_text(path, &(text + "\n")).map_err(failed)?;
    }
    if let Some(path) = &args.csv {
        write_text(path, &csv(&report)).map_err(failed)?;
    }
    if !quiet {
        print_report(&name, &report);
        for path in args.html.iter().chain(&args.json).chain(&args.csv) {
            print(&format!("{:>10}  {}", "wrote", path.display()));
        }
    }
    let missed = report.recommendations.iter().filter(|found| !found.is_reached).count();
    if missed > 0 {
        return Err(Failure::Failed(format!(
            "{missed} of the targets were not reached; nearest settings are told"
        )));
    }
    Ok(Outcome::Done)
}

/// The flags of `render` that make what is measured, of pictures of `size`, of the scene's file.
fn given(args: &TradeArgs, [width, height]: [u32; 2]) -> Vec<Vec<String>> {
    // Whatever is added to these either shows in a picture or its time, or is left out by name.
    let SceneArgs {
        scene: _,
        set,
        camera,
        size: _,
        samples,
        integrator,
        max_depth,
        precision,
        build_quality,
        filter,
        threads,
        compact,
        non_finite,
        memory_limit,
        quiet: _,
    } = &args.scene;
    let mut given = Vec::new();
    let mut say = |name: &str, value: Option<String>| {
        given.extend(value.map(|value| vec![format!("--{name}"), value]));
    };
    set.iter().for_each(|field| say("set", Some(field.clone())));
    say("camera", camera.clone());
    say("size", Some(format!("{width}x{height}")));
    say("samples", samples.map(|n| n.to_string()));
    say("integrator", integrator.map(|kind| kind.name().to_owned()));
    say("max-depth", max_depth.map(|n| n.to_string()));
    say("precision", precision.map(|rung| rung.name().to_owned()));
    say("build-quality", build_quality.map(|quality| quality.name().to_owned()));
    say("filter", filter.map(|filter| filter.name().to_owned()));
    say("threads", threads.map(|n| n.to_string()));
    let is_said = *non_finite != NonFinite::ALL[0];
    say("non-finite", is_said.then(|| non_finite.name().to_owned()));
    say("memory-limit", memory_limit.map(|bytes| bytes.to_string()));
    let kind = args.accel.kind;
    say("accel", (kind != AccelKind::default()).then(|| kind.name().to_owned()));
    let switches = [("compact", *compact), ("single-rays", args.accel.single_rays)];
    given.extend(switches.iter().filter(|(_, is)| *is).map(|(name, _)| vec![format!("--{name}")]));
    given
}

fn failure(error: TradeError) -> Failure {
    match error {
        TradeError::Interrupted => Failure::Interrupted,
        error => Failure::BadInput(error.to_string()),
    }
}

/// A picture that is measured many times need not be large.
fn shrink(desc: &mut SceneDesc, quiet: bool) {
    let [width, height] = desc.image.size;
    if width > WIDTH {
        let scaled = f64::from(height) * f64::from(WIDTH) / f64::from(width);
        desc.image.size = [WIDTH, (scaled.round() as u32).max(1)];
        if !quiet {
            let [w, h] = desc.image.size;
            tell(&format!("measures {w} x {h} pixels; --size {width}x{height} all of them"));
        }
    }
}

/// A reference that the user brings, or one that is kept. Its own error, and how it was made, are what its
/// header says, if anything.
fn given_reference(path: &Path) -> Result<Reference, Failure> {
    let bad = |e: crate::io::ReadError| Failure::BadInput(e.to_string());
    let picture = read_picture(path).map_err(bad)?;
    let (mut error, mut made) = (0.0, path.display().to_string());
    for attribute in read_attributes(path).unwrap_or_default() {
        match (attribute.name.as_str(), attribute.value) {
            (ERROR, AttributeValue::Float(stated)) => error = stated,
            (MADE, AttributeValue::Text(words)) => made = words,
            _ => {}
        }
    }
    Ok(Reference { film: film(picture), error, made })
}

fn film(picture: Picture) -> Film {
    let mut film = Film::new(picture.extent, PixelRect::whole(picture.extent), false);
    film.mean = picture.pixels;
    film
}

/// The file that a reference is kept in: its name is a hash of all that it depends on, this program itself
/// among it.
fn cache_file(folder: &Path, scene: &str) -> PathBuf {
    let program = std::env::current_exe().and_then(std::fs::metadata);
    let program = program.and_then(|data| Ok((data.len(), data.modified()?))).ok();
    let said = format!("{} {program:?} {scene}", env!("CARGO_PKG_VERSION"));
    folder.join(format!("reference-{:016x}.exr", xxhash_rust::xxh3::xxh3_64(said.as_bytes())))
}

/// The reference that is kept, or else a new one, which is kept then.
fn cached(
    path: Option<&Path>,
    make: impl FnOnce() -> Result<Reference, TradeError>,
) -> Result<Reference, Failure> {
    if let Some(path) = path.filter(|path| path.exists())
        && let Ok(found) = given_reference(path)
    {
        return Ok(found);
    }
    let made = make().map_err(failure)?;
    if let Some(path) = path {
        let attributes = [
            Attribute::new(ERROR, AttributeValue::Float(made.error)),
            Attribute::new(MADE, AttributeValue::Text(made.made.clone())),
        ];
        let options = ExrOptions { pixel_type: PixelType::Float, ..ExrOptions::default() };
        let folder = path.parent().map_or(Ok(()), std::fs::create_dir_all);
        let written = folder.map_err(|e| e.to_string()).and_then(|()| {
            write_exr(path, &made.film, &attributes, &options).map_err(|e| e.to_string())
        });
        if let Err(error) = written {
            warn(&format!("the reference is not kept: {error}"));
        }
    }
    Ok(made)
}

/// A line for each point, those of samples with the slope, and one for each recommendation, which has
/// seconds in all.
fn csv(report: &TradeReport) -> String {
    let mut text = String::from(
        "knob,choice,samples,error,sampling_error,bias,difference,relmse,flip,seconds,ratio,build_seconds,bytes,\
         efficiency,front,flags,slope,slope_plus_minus\n",
    );
    let optional = |x: Option<f64>| x.map_or_else(String::new, |x| x.to_string());
    let words = |text: String| format!("\"{}\"", text.replace('"', "\"\""));
    let own = [("samples", std::slice::from_ref(&report.base)), ("samples", &report.convergence)];
    let knobs = report.knobs.iter().map(|knob| (knob.name, knob.points.as_slice()));
    for (knob, points) in own.into_iter().chain(knobs) {
        let slope = report.slope.filter(|_| knob == "samples");
        for p in points {
            let _ = writeln!(
                text,
                "{knob},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                words(p.label.clone()),
                p.samples,
                p.error,
                optional(p.sampling_error),
                optional(p.bias),
                optional(p.difference),
                p.relmse,
                p.flip,
                p.seconds,
                p.ratio,
                p.build_seconds,
                p.bytes,
                p.efficiency,
                u8::from(p.is_on_front),
                words(quoted(&p.flags)),
                optional(slope.map(|slope| slope.power)),
                optional(slope.map(|slope| slope.plus_minus)),
            );
        }
    }
    for found in &report.recommendations {
        let reached = if found.is_reached { "" } else { ", not reached" };
        let _ = writeln!(
            text,
            "recommended,{},,{},,,,,,{},,,,,,{},,",
            words(format!("{}{reached}", aim(found.target))),
            found.error,
            found.seconds,
            words(quoted(&found.flags))
        );
    }
    text
}

fn percent(x: f64) -> String {
    let x = 100.0 * x;
    if x == 0.0 || x >= 0.001 { format!("{x:.3} %") } else { format!("{x:.0e} %") }
}

/// What is aimed at, in words.
fn aim(target: Target) -> String {
    match target {
        Target::Error(error) => format!("an error of {}", percent(error)),
        Target::Time(seconds) => format!("{seconds} s"),
    }
}

fn print_report(scene: &str, report: &TradeReport) {
    let [width, height] = report.size;
    print(&format!(
        "{scene}: {width} x {height}, {} threads; reference: {}, error {}",
        report.threads,
        report.reference,
        percent(report.reference_error)
    ));
    let head = |name: &str| {
        print(&format!(
            "\n{name:<26}{:>8}{:>11}{:>11}{:>11}{:>11}{:>10}{:>8}{:>9}{:>8}{:>10}{:>11}",
            "samples",
            "error",
            "stated",
            "bias",
            "differs",
            "relMSE",
            "FLIP",
            "seconds",
            "x time",
            "memory",
            "efficiency"
        ));
    };
    let line = |p: &Point| {
        let optional = |x: Option<f64>| x.map_or("-".to_owned(), percent);
        let mark = if p.is_on_front { '*' } else { ' ' };
        print(&format!(
            "{mark} {:<24}{:>8}{:>11}{:>11}{:>11}{:>11}{:>10.2e}{:>8.4}{:>9.3}{:>8.2}{:>10}{:>11.2e}",
            p.label,
            p.samples,
            percent(p.error),
            optional(p.sampling_error),
            optional(p.bias),
            optional(p.difference),
            p.relmse,
            p.flip,
            p.seconds,
            p.ratio,
            megabytes(p.bytes),
            p.efficiency
        ));
    };
    head("samples");
    let mut samples: Vec<&Point> = report.convergence.iter().chain([&report.base]).collect();
    samples.sort_by_key(|p| p.samples);
    samples.into_iter().for_each(line);
    if let Some(slope) = report.slope {
        let (power, off) = (slope.power, slope.plus_minus);
        print(&format!("squared error by samples: to the power {power:.2} ± {off:.2}"));
    }
    for knob in &report.knobs {
        head(knob.name);
        knob.points.iter().for_each(line);
    }
    let half = report.half;
    print(&format!(
        "\nhalf instead of float adds an error of {}; {} pixels are beyond half{}",
        percent(half.error),
        half.beyond,
        half.half.zip(half.float).map_or_else(String::new, |(half, float)| format!(
            "; {:.4} s to write, {:.0} kB; float {:.4} s, {:.0} kB",
            half.seconds,
            half.bytes as f64 / 1e3,
            float.seconds,
            float.bytes as f64 / 1e3
        ))
    ));
    print("* nothing measured is both faster and better");
    for found in &report.recommendations {
        let what = aim(found.target);
        let not = if found.is_reached { "" } else { "NOT REACHED: " };
        let (error, flags) = (percent(found.error), quoted(&found.flags));
        print(&format!(
            "\nfor {what}: {not}{error} in {:.2} s with\n  alhazen render {scene} {flags}",
            found.seconds
        ));
    }
}
