//! `alhazen render`: what its flags mean together, with conflicts found before any work; then load,
//! build, render, write.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::args::{LayerName, RenderArgs};
use super::keep::{
    CHECKPOINT_EVERY, Keeper, checkpoint_path, part_attributes, part_range, resuming_command,
    write_end,
};
use super::outputs::{Output, check_format, check_targets, write_all, write_or_rescue};
use super::prepare::{build, check_memory, film_bytes, load, thread_pool};
use super::progress::{Progress, catch_interrupts};
use super::units::Part;
use super::watch::{Schedule, TEV_EVERY, View, Watch};
use super::{Failure, Outcome, print, report, tell, warn};
use crate::film::{Aov, PixelRect};
use crate::io::{Attribute, ExrCompression, TevImage};
use crate::render::{RenderJob, Rendered, Start, Stop, StopRules, render_from};
use crate::scene::Scene;

/// Samples at which a render ends that was to reach an error or a time.
const MOST_SAMPLES: u32 = 1 << 24;

/// Seconds of each phase; `total` counts from the start of the program.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub(super) struct Phases {
    pub(super) read: f64,
    /// Of what there must be before the first ray: hierarchies, lights, a blank film.
    pub(super) build: f64,
    pub(super) render: f64,
    pub(super) write: f64,
    pub(super) total: f64,
}

/// `alhazen render`.
pub(super) fn render(args: &RenderArgs, start: Instant) -> Result<Outcome, Failure> {
    let quiet = args.scene.quiet;
    let plan = Plan::new(args)?;
    catch_interrupts();
    let mut phases = Phases::default();
    let pool = thread_pool(args.scene.threads)?;
    let loaded = timed(&mut phases.read, || pool.install(|| load(&args.scene)))?;
    let hash = loaded.hash;
    let frame = Frame::new(args, loaded.scene.image.size, loaded.scene.settings.samples)?;
    let film = film_bytes(&frame.window, plan.keeps_state());
    check_memory(frame.size, film)?;
    let views = plan.views(frame.size)?;

    let build = || pool.install(|| build(&args.scene, &args.accel, loaded, film, plan.rays()));
    let scene = timed(&mut phases.build, build)?;
    let job = plan.job(&frame, start);
    let identity = plan.identity(&scene, hash, &frame);
    let every = args.checkpoint.unwrap_or(CHECKPOINT_EVERY);
    let keeper = plan.checkpoint.clone();
    let keeper = keeper.map(|path| (Schedule::new(every), Keeper::new(path, identity.clone())));
    let state = match keeper.as_ref().filter(|_| args.resume) {
        Some((_, keeper)) => {
            pool.install(|| keeper.read(job.first_sample, frame.window, frame.size))?
        }
        None => None,
    };
    if let Some(state) = state.as_ref().filter(|_| !quiet) {
        let samples = state.samples().len();
        print(&format!("{:>10}  from {samples} samples of every pixel", "goes on"));
    }
    let blank = || Start::blank(&scene, &job);
    let from = || pool.install(|| state.map_or_else(blank, Start::from_state));
    let from = timed(&mut phases.build, from);
    let watch = Watch { progress: Progress::new(quiet, "render"), keeper, views };
    let rendered = timed(&mut phases.render, || {
        let rendered = pool.install(|| render_from(from, &scene, &job, &watch));
        watch.progress.finish();
        rendered
    });
    timed(&mut phases.write, || pool.install(|| plan.write(&frame, &watch, identity, &rendered)))?;
    phases.total = start.elapsed().as_secs_f64();

    let accel = scene.accel.info();
    if let Some(path) = &args.stats {
        report::write_stats(path, &phases, &rendered, &accel)?;
    }
    if !quiet {
        tell_non_finite(&rendered);
        report::print_table(&phases, &rendered, &accel);
    }
    if rendered.stop == Stop::Interrupted {
        let what = if plan.args.part.is_some() { "checkpoint" } else { "picture" };
        tell(&format!("interrupted; the {what} holds what was finished, the rest is black"));
        return Ok(Outcome::Interrupted);
    }
    Ok(Outcome::Done)
}

/// Runs a phase, or a part of one, and adds its seconds.
fn timed<T>(seconds: &mut f64, phase: impl FnOnce() -> T) -> T {
    let clock = Instant::now();
    let result = phase();
    *seconds += clock.elapsed().as_secs_f64();
    result
}

/// What the flags mean, whatever the scene.
struct Plan<'a> {
    args: &'a RenderArgs,
    outputs: Vec<Output>,
    layers: Vec<Aov>,
    /// The file that checkpoints go to, where there are any.
    checkpoint: Option<PathBuf>,
}

impl<'a> Plan<'a> {
    /// Finds what cannot be done before any work.
    fn new(args: &'a RenderArgs) -> Result<Self, Failure> {
        let outputs = outputs(args)?;
        check_format(&args.format)?;
        if args.adaptive && args.error.is_none() && args.time.is_none() {
            let message =
                "--adaptive needs something to reach; accepted with --error or --time".to_owned();
            return Err(Failure::BadInput(message));
        }
        let layers = layers(args, &outputs)?;
        if args.preview.as_ref().is_some_and(|path| path.extension().is_none_or(|e| e != "png")) {
            return Err(Failure::BadInput("--preview must end in .png".to_owned()));
        }
        let checkpoint =
            (args.checkpoint.is_some() || args.resume).then(|| checkpoint_path(&outputs[0].path));
        let pictures = outputs.iter().map(|o| &o.path).chain(&args.preview);
        let targets = pictures.chain(&args.stats).chain(&checkpoint);
        check_targets([args.scene.scene.as_path()], targets)?;
        Ok(Self { args, outputs, layers, checkpoint })
    }

    /// Whether sums are kept after a tile is done: to go on from, or to look at.
    fn keeps_state(&self) -> bool {
        let args = self.args;
        let looks = args.tev.is_some() || args.preview.is_some() || self.checkpoint.is_some();
        args.error.is_some() || args.time.is_some() || args.part.is_some() || looks
    }

    /// How many rays to expect where the scene's settings do not tell: as many as it takes.
    fn rays(&self) -> Option<u64> {
        let goes_on = self.args.error.is_some() || self.args.time.is_some();
        (goes_on && self.args.scene.samples.is_none()).then_some(u64::MAX)
    }

    fn job(&self, frame: &Frame, start: Instant) -> RenderJob {
        let args = self.args;
        let stop = match &frame.part {
            Some((_, range)) => Some(StopRules { samples: range.end, error: None, deadline: None }),
            None => stop_rules(args, start, &frame.window),
        };
        let looks = [
            self.checkpoint.as_ref().map(|_| args.checkpoint.unwrap_or(CHECKPOINT_EVERY)),
            args.tev.as_ref().map(|_| TEV_EVERY),
            args.preview.as_ref().map(|_| args.preview_every),
        ];
        RenderJob {
            crop: frame.crop,
            seed: args.seed,
            variant: None,
            stop,
            first_sample: frame.part.as_ref().map_or(0, |(_, range)| range.start),
            keep_state: self.keeps_state(),
            pass_time: looks.into_iter().flatten().min(),
            is_adaptive: args.adaptive,
            layers: self.layers.clone(),
        }
    }

    /// What makes the picture what it is, for its header: the same for all its parts and checkpoints.
    fn identity(&self, scene: &Scene, hash: u64, frame: &Frame) -> Vec<Attribute> {
        let mut identity = report::identity(scene, hash, self.args.seed, self.args.adaptive);
        identity.extend(report::of_layers(scene, &self.layers));
        if let Some((part, _)) = frame.part {
            identity.extend(part_attributes(part, frame.samples));
        }
        identity
    }

    /// The ways in which the picture is shown while it becomes.
    fn views(&self, size: [u32; 2]) -> Result<Vec<(Schedule, View)>, Failure> {
        let args = self.args;
        let mut views = Vec::new();
        if let Some(address) = &args.tev {
            let name = self.outputs[0].path.display().to_string();
            let image = TevImage::create(address, &name, size).map_err(|error| {
                let advice = "accepted: HOST:PORT of a running tev, as in localhost:14158";
                Failure::BadInput(format!("--tev {address}: {error}; {advice}"))
            })?;
            let image = Mutex::new(Some(image));
            views.push((Schedule::new(TEV_EVERY), View::Tev { image }));
        }
        if let Some(path) = &args.preview {
            let (exposure, tone_map) = (args.format.exposure, args.format.tonemap);
            let view = View::Preview { path: path.clone(), exposure, tone_map };
            views.push((Schedule::new(args.preview_every), view));
        }
        Ok(views)
    }

    /// Shows and writes what was rendered; of an interrupted render also what to go on from.
    fn write(
        &self,
        frame: &Frame,
        watch: &Watch,
        mut attributes: Vec<Attribute>,
        rendered: &Rendered,
    ) -> Result<(), Failure> {
        watch.views.iter().for_each(|(_, view)| view.show(&rendered.film));
        let keeper = watch.keeper.as_ref().map(|(_, keeper)| keeper);
        let is_interrupted = rendered.stop == Stop::Interrupted;
        let quiet = self.args.scene.quiet;
        let kept = rendered.state.as_ref().filter(|_| keeper.is_some() || frame.part.is_some());
        if let Some(state) = kept.filter(|_| is_interrupted) {
            let path = checkpoint_path(&self.outputs[0].path);
            let write = |path: &Path| write_end(path, rendered, state, attributes.clone());
            if frame.part.is_some() {
                // The file of a part is whole, or not there: who waits for parts goes by that.
                write_or_rescue(&path, quiet, write)?;
                tell(&format!("to go on: {}", resuming_command()));
                return Ok(());
            }
            // The picture is written all the same.
            match write(&path) {
                Ok(()) => tell(&format!("to go on: {}", resuming_command())),
                Err(error) => warn(&format!("no checkpoint: {error}")),
            }
        }
        match (&frame.part, &rendered.state) {
            (Some(_), Some(state)) => write_or_rescue(&self.outputs[0].path, quiet, |path| {
                write_end(path, rendered, state, attributes.clone())
            })?,
            _ => {
                attributes.extend(report::outcome(&rendered.film, rendered.samples, rendered.stop));
                write_all(&self.outputs, &rendered.film, &attributes, &self.args.format, quiet)?;
            }
        }
        if let Some(keeper) = keeper.filter(|_| !is_interrupted) {
            keeper.remove();
        }
        Ok(())
    }
}

/// Which pixels and samples are rendered.
struct Frame {
    /// Of the whole picture.
    size: [u32; 2],
    crop: Option<PixelRect>,
    /// The crop, or the whole picture.
    window: PixelRect,
    /// Of the whole render, where it has parts.
    samples: u32,
    part: Option<(Part, Range<u32>)>,
}

impl Frame {
    fn new(args: &RenderArgs, size: [u32; 2], samples: u32) -> Result<Self, Failure> {
        let crop = args.crop.map(|crop| check_crop(crop, size)).transpose()?;
        let window = crop.unwrap_or(PixelRect::whole(size));
        let part = args.part.map(|part| Ok((part, check_part(part, samples)?))).transpose()?;
        Ok(Self { size, crop, window, samples, part })
    }
}

/// When the render is over, where anything but the scene's samples says so: its own number then counts no
/// more, only that of the command line.
fn stop_rules(args: &RenderArgs, start: Instant, window: &PixelRect) -> Option<StopRules> {
    if args.error.is_none() && args.time.is_none() {
        return None;
    }
    // Time counts until the file is written: a share is kept back, as measured for half and ZIP.
    let write = Duration::from_secs_f64(0.02 + 1e-7 * window.area() as f64);
    Some(StopRules {
        samples: args.scene.samples.unwrap_or(MOST_SAMPLES),
        error: args.error,
        deadline: args.time.map(|time| start + time.saturating_sub(write)),
    })
}

fn outputs(args: &RenderArgs) -> Result<Vec<Output>, Failure> {
    let mut outputs: Vec<Output> =
        args.output.iter().cloned().map(Output::new).collect::<Result<_, _>>()?;
    if outputs.is_empty() {
        let mut name =
            args.scene.scene.file_stem().unwrap_or_else(|| "picture".as_ref()).to_owned();
        if let Some(Part { number, count }) = args.part {
            name.push(format!(".part{number}of{count}"));
        }
        name.push(".exr");
        outputs.push(Output::new(PathBuf::from(name))?);
    }
    if args.part.is_some() && (outputs.len() > 1 || !outputs[0].is_exr()) {
        let message = "--part writes a single .exr file; pictures of other kinds are for `merge`";
        return Err(Failure::BadInput(message.to_owned()));
    }
    Ok(outputs)
}

/// What `--layers` asks for, in the order of [`Aov::ALL`].
fn layers(args: &RenderArgs, outputs: &[Output]) -> Result<Vec<Aov>, Failure> {
    if args.layers.is_empty() {
        return Ok(Vec::new());
    }
    if !outputs.iter().any(Output::is_exr) {
        let message = "--layers: only EXR files hold layers; accepted with an -o that ends in .exr";
        return Err(Failure::BadInput(message.to_owned()));
    }
    if args.format.exr_compression == ExrCompression::Pxr24 {
        let message = "--layers: pxr24 would round layers; accepted: another --exr-compression";
        return Err(Failure::BadInput(message.to_owned()));
    }
    let is_wanted = |aov: &Aov| {
        args.layers.iter().any(|name| *name == LayerName::All || *name == LayerName::One(*aov))
    };
    Ok(Aov::ALL.into_iter().filter(is_wanted).collect())
}

fn check_part(part: Part, samples: u32) -> Result<Range<u32>, Failure> {
    part_range(part, samples).ok_or_else(|| {
        let Part { number, count } = part;
        Failure::BadInput(format!(
            "--part {number}/{count}: {samples} samples make at most {samples} parts"
        ))
    })
}

fn check_crop(crop: PixelRect, size: [u32; 2]) -> Result<PixelRect, Failure> {
    if crop.x1 <= size[0] && crop.y1 <= size[1] {
        return Ok(crop);
    }
    let PixelRect { x0, y0, x1, y1 } = crop;
    Err(Failure::BadInput(format!(
        "--crop {x0},{y0},{x1},{y1} reaches beyond the picture of {}x{}",
        size[0], size[1]
    )))
}

fn tell_non_finite(rendered: &Rendered) {
    let found = &rendered.non_finite;
    if found.count > 0 {
        let first: Vec<String> = found
            .first
            .iter()
            .map(|([x, y], sample)| format!("sample {sample} of pixel {x},{y}"))
            .collect();
        warn(&format!(
            "{} samples were NaN or infinite and left out: {}",
            found.count,
            first.join("; ")
        ));
    }
}
