//! What the flags of `render` mean together: conflicts found before any work, then load, build,
//! render, write.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::args::{LayerName, RenderArgs, SceneArgs};
use super::keep::{
    CHECKPOINT_EVERY, Keeper, checkpoint_path, part_attributes, part_range, resuming_command,
    write_end,
};
use super::outputs::{Output, check_format, check_targets, write_all};
use super::progress::{Progress, catch_interrupts, interrupted};
use super::units::Part;
use super::watch::{Schedule, TEV_EVERY, View, Watch};
use super::{Failure, Outcome, print, report, tell};
use crate::accel::{AccelError, AccelKind, BuildOptions, Compact};
use crate::film::{Aov, PixelRect};
use crate::io::{ExrCompression, LoadOptions, LoadedScene, TevImage, available_memory, load_scene};
use crate::render::{RenderJob, Rendered, Stop, StopRules, resume};
use crate::scene::{RenderSettings, Scene, SceneError};

/// Samples at which a render ends that was to reach an error or a time.
const MOST_SAMPLES: u32 = 1 << 24;

/// Seconds of each phase; `total` counts from the start of the program.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub(super) struct Phases {
    pub(super) read: f64,
    pub(super) build: f64,
    pub(super) render: f64,
    pub(super) write: f64,
    pub(super) total: f64,
}

/// `alhazen render`.
pub(super) fn render(args: &RenderArgs, start: Instant) -> Result<Outcome, Failure> {
    let quiet = args.scene.quiet;
    let outputs = outputs(args)?;
    check_format(&args.format)?;
    if args.adaptive && args.error.is_none() && args.time.is_none() {
        let message = "--adaptive needs something to reach; accepted with --error or --time";
        return Err(Failure::BadInput(message.to_owned()));
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
    catch_interrupts();
    let mut phases = Phases::default();
    let clock = Instant::now();
    let pool = thread_pool(args.scene.threads)?;
    let loaded = pool.install(|| load(&args.scene))?;
    phases.read = clock.elapsed().as_secs_f64();
    let hash = loaded.hash;
    let size = loaded.scene.image.size;
    let samples = loaded.scene.settings.samples;
    let crop = args.crop.map(|crop| check_crop(crop, size)).transpose()?;
    let window = crop.unwrap_or(PixelRect::whole(size));
    let part = args.part.map(|part| Ok((part, check_part(part, samples)?))).transpose()?;
    let looks = args.tev.is_some() || args.preview.is_some() || checkpoint.is_some();
    let is_kept = args.error.is_some() || args.time.is_some() || part.is_some() || looks;
    let film = film_bytes(&window, is_kept);
    check_memory(size, film)?;
    let views = views(args, &outputs, size)?;

    let clock = Instant::now();
    let scene = pool.install(|| build(&args.scene, args.accel.kind, loaded, film))?;
    phases.build = clock.elapsed().as_secs_f64();

    let every = args.checkpoint.unwrap_or(CHECKPOINT_EVERY);
    let stop = match &part {
        Some((_, range)) => Some(StopRules { samples: range.end, error: None, deadline: None }),
        None => stop_rules(args, start, &window),
    };
    let job = RenderJob {
        crop,
        seed: args.seed,
        variant: None,
        stop,
        first_sample: part.as_ref().map_or(0, |(_, range)| range.start),
        keep_state: is_kept,
        pass_time: [
            checkpoint.as_ref().map(|_| every),
            args.tev.as_ref().map(|_| TEV_EVERY),
            args.preview.as_ref().map(|_| args.preview_every),
        ]
        .into_iter()
        .flatten()
        .min(),
        is_adaptive: args.adaptive,
        layers,
    };
    let mut identity = report::identity(&scene, hash, args.seed, args.adaptive);
    identity.extend(report::of_layers(&scene, &job.layers));
    if let Some((part, _)) = part {
        identity.extend(part_attributes(part, samples));
    }
    let keeper = checkpoint.map(|path| (Schedule::new(every), Keeper::new(path, identity.clone())));
    let state = match keeper.as_ref().filter(|_| args.resume) {
        Some((_, keeper)) => pool.install(|| keeper.read(job.first_sample, window, size))?,
        None => None,
    };
    if let Some(state) = state.as_ref().filter(|_| !quiet) {
        let samples = state.samples().len();
        print(&format!("{:>10}  from {samples} samples of every pixel", "goes on"));
    }
    let clock = Instant::now();
    let watch = Watch { progress: Progress::new(quiet, "render"), keeper, views };
    let mut rendered = pool.install(|| resume(&scene, &job, state, &watch));
    watch.progress.finish();
    phases.render = clock.elapsed().as_secs_f64();

    let clock = Instant::now();
    watch.views.iter().for_each(|(_, view)| view.show(&rendered.film));
    let is_interrupted = rendered.stop == Stop::Interrupted;
    if let Some((_, keeper)) = watch.keeper.as_ref().filter(|_| is_interrupted) {
        // The picture is written all the same.
        match pool.install(|| keeper.keep_end(&rendered)) {
            Ok(()) => tell(&format!("to go on: {}", resuming_command())),
            Err(error) => warn(&format!("no checkpoint: {error}")),
        }
    }
    let state = rendered.state.take();
    let accel = scene.accel.info();
    let written = match (part, state) {
        (Some(_), Some(state)) => {
            let attributes = identity;
            let path = &outputs[0].path;
            let written = pool.install(|| write_end(path, &rendered, &state, attributes));
            written.map_err(|e| Failure::Failed(e.to_string())).map(|()| {
                if !quiet {
                    print(&format!("{:>10}  {}", "wrote", path.display()));
                }
            })
        }
        _ => {
            let mut attributes = identity;
            attributes.extend(report::outcome(&rendered.film, rendered.samples, rendered.stop));
            pool.install(|| write_all(&outputs, &rendered.film, &attributes, &args.format, quiet))
        }
    };
    phases.write = clock.elapsed().as_secs_f64();
    phases.total = start.elapsed().as_secs_f64();
    written?;
    if let Some((_, keeper)) = watch.keeper.as_ref().filter(|_| !is_interrupted) {
        keeper.remove();
    }

    if let Some(path) = &args.stats {
        report::write_stats(path, &phases, &rendered, &accel)?;
    }
    if !quiet {
        tell_non_finite(&rendered);
        report::print_table(&phases, &rendered, &accel);
    }
    if is_interrupted {
        tell("interrupted; the picture holds what was finished, the rest is black");
        return Ok(Outcome::Interrupted);
    }
    Ok(Outcome::Done)
}

/// Loads the scene and applies the flags that stand for its fields. Warnings are printed.
pub(super) fn load(args: &SceneArgs) -> Result<LoadedScene, Failure> {
    let options = LoadOptions {
        set: args.set.clone(),
        camera: args.camera.clone(),
        non_finite: args.non_finite,
    };
    let mut loaded =
        load_scene(&args.scene, &options).map_err(|e| Failure::BadInput(e.to_string()))?;
    if !args.quiet {
        loaded.warnings.iter().for_each(|warning| warn(warning));
    }
    let scene = &mut loaded.scene;
    let settings = &mut scene.settings;
    scene.image.size = args.size.unwrap_or(scene.image.size);
    settings.samples = args.samples.unwrap_or(settings.samples);
    settings.max_depth = args.max_depth.unwrap_or(settings.max_depth);
    settings.integrator = args.integrator.unwrap_or(settings.integrator);
    settings.precision = args.precision.unwrap_or(settings.precision);
    settings.build_quality = args.build_quality.unwrap_or(settings.build_quality);
    settings.filter = args.filter.unwrap_or(settings.filter);
    if args.compact {
        settings.compact = Compact::On;
    }
    // Flags and fields that say the same are the same scene.
    // More samples go on with the same picture.
    let settings = RenderSettings { samples: 0, ..scene.settings.clone() };
    let said = format!("{:016x} {:?} {settings:?}", loaded.hash, scene.image);
    loaded.hash = xxhash_rust::xxh3::xxh3_64(said.as_bytes());
    Ok(loaded)
}

/// Bytes that a picture takes: mean and error of a pixel, and what the encoders need beside them; with the
/// sums of its samples where it may go on from there.
pub(super) fn film_bytes(window: &PixelRect, goes_on: bool) -> u64 {
    window.area() as u64 * if goes_on { 500 } else { 40 }
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

/// Refuses a picture that does not fit into memory, before the machine starts to swap.
fn check_memory([width, height]: [u32; 2], film: u64) -> Result<(), Failure> {
    match available_memory() {
        Some(free) if film > free => Err(Failure::BadInput(format!(
            "a picture of {width} x {height} pixels needs {:.0} GB, and {:.0} GB of memory are free; \
             accepted: a smaller --size, or a part of it by --crop",
            film as f64 / 1e9,
            free as f64 / 1e9
        ))),
        _ => Ok(()),
    }
}

/// Builds the scene, showing progress; leaves `film` bytes free for the picture.
pub(super) fn build(
    args: &SceneArgs,
    kind: AccelKind,
    loaded: LoadedScene,
    film: u64,
) -> Result<Scene, Failure> {
    let options = BuildOptions {
        kind,
        threads: args.threads.map(usize::from),
        memory_limit: args.memory_limit,
        free: available_memory().map(|free| free.saturating_sub(film)),
        ..BuildOptions::default()
    };
    if interrupted() {
        return Err(Failure::Interrupted);
    }
    let progress = Progress::new(args.quiet, "build");
    let go_on = |done| {
        progress.report(done, 0);
        !interrupted()
    };
    let scene = Scene::build(loaded.scene, &options, &go_on);
    progress.finish();
    if let Ok(scene) = &scene
        && scene.is_compact
        && scene.settings.compact == Compact::Auto
        && !args.quiet
    {
        tell("the hierarchy is compact, as memory does not suffice otherwise: rays take longer");
    }
    scene.map_err(|errors| match errors.as_slice() {
        [SceneError::Accel(AccelError::Interrupted)] => Failure::Interrupted,
        [SceneError::Accel(error @ AccelError::NoRoom { .. })] => {
            Failure::BadInput(error.to_string())
        }
        [SceneError::Accel(error)] => Failure::Failed(error.to_string()),
        errors => {
            const SHOWN: usize = 50;
            let mut lines: Vec<String> =
                errors.iter().take(SHOWN).map(ToString::to_string).collect();
            if errors.len() > SHOWN {
                lines.push(format!("and {} more", errors.len() - SHOWN));
            }
            Failure::BadInput(lines.join("\n"))
        }
    })
}

/// The threads that everything runs on.
pub(super) fn thread_pool(threads: Option<u16>) -> Result<rayon::ThreadPool, Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.map_or(0, usize::from))
        .build()
        .map_err(|e| Failure::Failed(format!("cannot start threads: {e}")))
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

/// The ways in which the picture is shown while it becomes.
fn views(
    args: &RenderArgs,
    outputs: &[Output],
    size: [u32; 2],
) -> Result<Vec<(Schedule, View)>, Failure> {
    let mut views = Vec::new();
    if let Some(address) = &args.tev {
        let name = outputs[0].path.display().to_string();
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

pub(super) fn warn(text: &str) {
    tell(&format!("warning: {text}"));
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
