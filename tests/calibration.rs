//! That the sampling error that a picture states is true: over many seeds the true one lies within the
//! stated bounds about as often as they say.
#![allow(missing_docs, clippy::print_stderr, reason = "a test program that reports")]

use std::path::Path;

use alhazen::accel::AccelKind;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::render::{RenderJob, StopRules, render};
use alhazen::scene::Scene;

mod common;
#[allow(dead_code, reason = "what benchmarks tell other renderers")]
#[path = "../benches/common/w2.rs"]
mod w2;

use common::{alhazen, stderr, verify};

/// The size that the benchmark has.
const SIZE: [u32; 2] = [1280, 720];

/// Makes a scene, with what files it takes in a folder.
type Make = fn(&Path) -> Scene;

fn size() -> [u32; 2] {
    if verify() { [128, 96] } else { [64, 48] }
}

fn load(path: &Path, set: &[&str]) -> Scene {
    let set = set.iter().map(|s| (*s).to_owned()).collect();
    let options = LoadOptions { set, ..LoadOptions::default() };
    let mut loaded = load_scene(path, &options).unwrap_or_else(|e| panic!("{e}"));
    loaded.scene.image.size = size();
    Scene::build_quietly(loaded.scene, AccelKind::default()).unwrap_or_else(|e| panic!("{e:?}"))
}

fn showcase(_: &Path) -> Scene {
    load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/showcase.toml"), &[])
}

/// Two thousand spheres of mirror, glass and colours over a checkered floor.
fn spheres(_: &Path) -> Scene {
    w2::scene(|desc| desc.image.size = size())
}

fn soft_shadows(folder: &Path) -> Scene {
    let text = r#"
[camera]
eye = [0, 2, 6]
target = [0, 0.5, 0]
[[objects]]
shape = "sphere"
center = [0, 0.8, 0]
radius = 0.8
[[objects]]
shape = "plane"
point = [0, 0, 0]
normal = [0, 1, 0]
[[lights]]
type = "disk"
center = [2, 5, 2]
normal = [-0.3, -1, -0.3]
radius = 1.5
radiance = 6
"#;
    let path = folder.join("soft.toml");
    std::fs::write(&path, text).unwrap();
    load(&path, &[])
}

fn large_mesh(folder: &Path) -> Scene {
    let count = if verify() { "1M" } else { "50k" };
    let arguments = ["generate", "terrain", "-n", count, "-o", "terrain.ply", "-q"];
    let output = alhazen(folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    load(&folder.join("terrain.ply"), &[])
}

#[test]
fn the_true_error_lies_in_the_stated_interval() {
    let folder = tempfile::tempdir().unwrap();
    let scenes: [(&str, Make); 4] = [
        ("showcase", showcase),
        ("mirrors and glass", spheres),
        ("soft shadows", soft_shadows),
        ("large mesh", large_mesh),
    ];
    let (seeds, many) = if verify() { (50, 1 << 13) } else { (6, 1 << 11) };
    let mut wrong = Vec::new();
    // Inside, and of how many.
    let mut all = [0, 0];
    for (name, make) in scenes {
        let scene = make(folder.path());
        let render = |seed, rules| {
            let job = RenderJob { seed, stop: Some(rules), ..RenderJob::default() };
            render(&scene, &job, &())
        };
        let samples = |samples| StopRules { samples, error: None, deadline: None };
        let reference = render(1_000_000, samples(many)).film;
        let at_16 = render(999_999, samples(16)).film.relative_error().unwrap();
        let by_error = |error| StopRules { samples: 1 << 14, error: Some(error), deadline: None };
        for (rule, rules) in [
            ("4 samples", samples(4)),
            ("16 samples", samples(16)),
            ("64 samples", samples(64)),
            ("an error", by_error(0.7 * at_16)),
        ] {
            let (mut inside, mut stated, mut shown, mut width) = (0, 0.0, 0.0, 0.0);
            for seed in 0..seeds {
                let film = render(seed, rules).film;
                let error = film.sampling_error().unwrap();
                let truth = film.error_against(&reference);
                inside += u32::from((error.low..=error.high).contains(&truth));
                stated += error.value * error.value;
                shown += truth * truth;
                width += (error.high - error.low) / error.value / seeds as f64;
            }
            let ratio: f64 = (stated / shown).sqrt();
            let share = f64::from(inside) / seeds as f64;
            all = [all[0] + inside, all[1] + seeds as u32];
            eprintln!(
                "{name}, {rule}: true error {:.3} %, stated by true {ratio:.3}, interval {:.1} %, \
                 {inside} of {seeds} inside",
                100.0 * (shown / seeds as f64).sqrt(),
                100.0 * width
            );
            let expected = if verify() { 0.9..=1.0 } else { 0.7..=1.0 };
            if !expected.contains(&share) {
                wrong.push(format!("{name}, {rule}: {share}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
    let share = f64::from(all[0]) / f64::from(all[1]);
    eprintln!("{:.1} % inside in all", 100.0 * share);
    assert!((if verify() { 0.9..=0.99 } else { 0.8..=1.0 }).contains(&share), "{share}");
}

/// Samples where the error is: fewer in all for the same error, and what that does to the picture.
#[test]
fn adaptive_sampling_is_cheaper_and_nearly_unbiased() {
    let folder = tempfile::tempdir().unwrap();
    let scenes: [(&str, Make); 3] =
        [("showcase", showcase), ("mirrors and glass", spheres), ("soft shadows", soft_shadows)];
    let (seeds, many) = if verify() { (50, 1 << 13) } else { (4, 1 << 11) };
    for (name, make) in scenes {
        let scene = make(folder.path());
        let render = |seed, rules, is_adaptive| {
            let stop = Some(rules);
            render(&scene, &RenderJob { seed, stop, is_adaptive, ..RenderJob::default() }, &())
        };
        let samples = |samples| StopRules { samples, error: None, deadline: None };
        let reference = render(1_000_000, samples(many), false).film;
        let wanted = 0.5 * render(999_999, samples(16), false).film.relative_error().unwrap();
        let rules = StopRules { samples: 1 << 14, error: Some(wanted), deadline: None };
        let (mut uniform, mut adaptive, mut shown, mut stated) = (0, 0, 0.0, 0.0);
        let mut mean = vec![[0.0f64; 3]; reference.mean.len()];
        for seed in 0..seeds {
            uniform += render(seed, rules, false).samples;
            let found = render(seed, rules, true);
            adaptive += found.samples;
            shown += found.film.error_against(&reference).powi(2);
            stated += found.film.relative_error().unwrap().powi(2);
            for (sum, x) in mean.iter_mut().zip(&found.film.mean) {
                sum.iter_mut().zip(x.to_array()).for_each(|(sum, x)| *sum += f64::from(x));
            }
        }
        // What the pictures have in common that the reference does not: the mean picture's light.
        let light = |of: &mut dyn Iterator<Item = f64>| of.sum::<f64>();
        let found = light(&mut mean.iter().flatten().map(|x| x / f64::from(seeds as u32)));
        let expected = light(&mut reference.mean.iter().flat_map(|c| c.to_array().map(f64::from)));
        let shift = found / expected - 1.0;
        let ratio: f64 = (stated / shown).sqrt();
        eprintln!(
            "{name}: {:.2} of the samples, stated by true error {ratio:.3}, light off by {:.4} %",
            f64::from(adaptive) / f64::from(uniform),
            100.0 * shift
        );
        assert!(f64::from(adaptive) <= 1.02 * f64::from(uniform), "{name}: {adaptive} {uniform}");
        assert!((0.85..1.2).contains(&ratio), "{name}: {ratio}");
        assert!(shift.abs() < 0.004, "{name}: {shift}");
    }
}
