//! What the flags of `render` mean together: conflicts found before any work, then load, build,
//! render, write.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::args::{RenderArgs, SceneArgs};
use super::progress::{Progress, catch_interrupts, interrupted};
use super::{Failure, Outcome, print, report, tell};
use crate::accel::{AccelError, AccelKind, BuildOptions, Compact};
use crate::film::PixelRect;
use crate::io::{
    ExrOptions, LoadOptions, LoadedScene, PixelType, WriteError, available_memory, check_writable,
    load_scene, write_exr, write_png,
};
use crate::render::{RenderJob, Rendered, Stop, StopRules, render as run_render};
use crate::scene::{Scene, SceneError};

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

/// A file to write.
struct Output {
    path: PathBuf,
    format: Format,
}

enum Format {
    Exr,
    Png,
}

/// `alhazen render`.
pub(super) fn render(args: &RenderArgs, start: Instant) -> Result<Outcome, Failure> {
    let quiet = args.scene.quiet;
    let outputs = outputs(args)?;
    if !args.exposure.is_finite() {
        return Err(Failure::BadInput("--exposure must be a finite number".to_owned()));
    }
    check_targets(&args.scene.scene, outputs.iter().map(|o| &o.path).chain(&args.stats))?;
    catch_interrupts();
    let mut phases = Phases::default();
    let clock = Instant::now();
    let pool = thread_pool(args.scene.threads)?;
    let loaded = pool.install(|| load(&args.scene))?;
    phases.read = clock.elapsed().as_secs_f64();
    let hash = loaded.hash;
    let size = loaded.scene.image.size;
    let crop = args.crop.map(|crop| check_crop(crop, size)).transpose()?;
    let goes_on = args.error.is_some() || args.time.is_some();
    let film = film_bytes(&crop.unwrap_or(PixelRect::whole(size)), goes_on);
    check_memory(size, film)?;

    let clock = Instant::now();
    let scene = pool.install(|| build(&args.scene, args.accel.kind, loaded, film))?;
    phases.build = clock.elapsed().as_secs_f64();

    let job = RenderJob {
        crop,
        seed: args.seed,
        variant: None,
        stop: stop_rules(args, start, &crop.unwrap_or(PixelRect::whole(size))),
    };
    let clock = Instant::now();
    let progress = Progress::new(quiet, "render");
    let rendered = pool.install(|| run_render(&scene, &job, &progress));
    progress.finish();
    phases.render = clock.elapsed().as_secs_f64();

    let clock = Instant::now();
    let accel = scene.accel.info();
    let attributes = report::attributes(&scene, hash, &job, &rendered, &accel);
    for output in &outputs {
        let path = &output.path;
        let failed = |e: WriteError| Failure::Failed(e.to_string());
        match output.format {
            Format::Exr => {
                let options =
                    ExrOptions { pixel_type: args.exr_type, compression: args.exr_compression };
                let used = pool
                    .install(|| write_exr(path, &rendered.film, &attributes, &options))
                    .map_err(failed)?;
                if used != args.exr_type && !quiet {
                    warn(&format!(
                        "{}: written as {}, as half ends at 65504",
                        path.display(),
                        PixelType::Float.name()
                    ));
                }
            }
            Format::Png => write_png(path, &rendered.film, args.exposure).map_err(failed)?,
        }
    }
    phases.write = clock.elapsed().as_secs_f64();
    phases.total = start.elapsed().as_secs_f64();

    if let Some(path) = &args.stats {
        report::write_stats(path, &phases, &rendered, &accel)?;
    }
    if !quiet {
        tell_non_finite(&rendered);
        report::print_table(&phases, &rendered, &accel);
        for output in &outputs {
            print(&format!("{:>10}  {}", "wrote", output.path.display()));
        }
    }
    if rendered.stop == Stop::Interrupted {
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
    let said = format!("{:016x} {:?} {:?}", loaded.hash, scene.image, scene.settings);
    loaded.hash = xxhash_rust::xxh3::xxh3_64(said.as_bytes());
    Ok(loaded)
}

/// Finds out before any work that every file could be written, and that none is written twice or over
/// the scene.
pub(super) fn check_targets<'a>(
    scene: &Path,
    targets: impl Iterator<Item = &'a PathBuf>,
) -> Result<(), Failure> {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let mut taken = vec![real(scene)];
    for path in targets {
        check_writable(path).map_err(|e| Failure::BadInput(e.to_string()))?;
        // A file that is not there yet is told by its folder.
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let place = path
            .canonicalize()
            .unwrap_or_else(|_| real(folder).join(path.file_name().unwrap_or_default()));
        if taken.contains(&place) {
            let message = format!("{}: would be written twice, or over the scene", path.display());
            return Err(Failure::BadInput(message));
        }
        taken.push(place);
    }
    Ok(())
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
    let paths = if args.output.is_empty() {
        let mut name =
            args.scene.scene.file_stem().unwrap_or_else(|| "picture".as_ref()).to_owned();
        name.push(".exr");
        vec![PathBuf::from(name)]
    } else {
        args.output.clone()
    };
    let output = |path: PathBuf| {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let format = match extension.as_str() {
            "exr" => Format::Exr,
            "png" => Format::Png,
            _ => {
                let message =
                    format!("{}: unknown kind of picture; accepted: .exr, .png", path.display());
                return Err(Failure::BadInput(message));
            }
        };
        Ok(Output { path, format })
    };
    paths.into_iter().map(output).collect()
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
