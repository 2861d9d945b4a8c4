//! What several commands begin with: a scene loaded with the flags that stand for its fields, memory that
//! suffices, threads, accelerators built.

use super::args::{AccelArgs, SceneArgs};
use super::progress::{Progress, interrupted};
use super::{Failure, tell, warn};
use crate::accel::{AccelError, BuildOptions, Compact};
use crate::film::PixelRect;
use crate::io::{LoadOptions, LoadedScene, available_memory, load_scene};
use crate::scene::{RenderSettings, Scene, SceneError};

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

/// Refuses a picture that does not fit into memory, before the machine starts to swap.
pub(super) fn check_memory([width, height]: [u32; 2], film: u64) -> Result<(), Failure> {
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

/// Builds the scene, showing progress; leaves `film` bytes free for the picture. `rays` are expected, or as many
/// as the scene's settings say.
pub(super) fn build(
    args: &SceneArgs,
    accel: &AccelArgs,
    loaded: LoadedScene,
    film: u64,
    rays: Option<u64>,
) -> Result<Scene, Failure> {
    let options = BuildOptions {
        expected_rays: rays,
        kind: accel.kind,
        single_rays: accel.single_rays,
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
