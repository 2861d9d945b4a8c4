//! When a render ends: at an error, at a time, after samples; and that it is then the picture of so many.
#![allow(missing_docs, reason = "a test program")]

use std::path::Path;

use alhazen::accel::AccelKind;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::render::{RenderJob, Rendered, Stop, StopRules, render};
use alhazen::scene::Scene;

mod common;
use common::{alhazen, stderr, verify};

/// Soft shadows of a large lamp on a plane of tiles.
const SCENE: &str = r#"
[image]
size = [64, 48]
[render]
samples = 16
[camera]
eye = [0, 2, 6]
target = [0, 0.5, 0]
[materials.grey]
type = "diffuse"
reflectance = 0.6
[materials.tiles]
type = "diffuse"
reflectance = { checker = [0.65, 0.55], scale = 0.3 }
[[objects]]
shape = "sphere"
center = [0, 0.8, 0]
radius = 0.8
material = "grey"
[[objects]]
shape = "plane"
point = [0, 0, 0]
normal = [0, 1, 0]
material = "tiles"
[[lights]]
type = "disk"
center = [2, 5, 2]
normal = [-0.3, -1, -0.3]
radius = 1.5
radiance = 6
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

fn scene() -> Scene {
    let folder = folder();
    let loaded = load_scene(&folder.path().join("scene.toml"), &LoadOptions::default()).unwrap();
    Scene::build_quietly(loaded.scene, AccelKind::default()).unwrap()
}

fn rendered(scene: &Scene, seed: u64, stop: StopRules) -> Rendered {
    render(scene, &RenderJob { seed, stop: Some(stop), ..RenderJob::default() }, &())
}

#[test]
fn an_error_that_is_asked_for_is_reached_and_true() {
    let scene = scene();
    let many = StopRules { samples: 4096, error: None, deadline: None };
    let reference = rendered(&scene, 1000, many).film;
    for wanted in [0.04, 0.01] {
        let seeds = if verify() { 50 } else { 6 };
        let (mut stated, mut shown) = (0.0, 0.0);
        for seed in 0..seeds {
            let rules = StopRules { samples: 1 << 20, error: Some(wanted), deadline: None };
            let found = rendered(&scene, seed, rules);
            assert_eq!(found.stop, Stop::Error);
            let error = found.film.relative_error().unwrap();
            assert!(error <= wanted, "{error} of {wanted}");
            assert!((8..4096).contains(&found.samples), "{}", found.samples);
            stated += error * error;
            shown += found.film.error_against(&reference).powi(2);
        }
        let ratio: f64 = (stated / shown).sqrt();
        assert!((0.85..1.18).contains(&ratio), "stated by shown at {wanted}: {ratio}");
    }
}

#[test]
fn a_render_in_passes_is_that_of_its_samples() {
    let mut scene = scene();
    let rules = StopRules { samples: 1 << 20, error: Some(0.03), deadline: None };
    let passes = rendered(&scene, 7, rules);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = one_thread.install(|| rendered(&scene, 7, rules));
    scene.settings.samples = passes.samples;
    let whole = render(&scene, &RenderJob { seed: 7, ..RenderJob::default() }, &());
    assert_eq!(whole.stop, Stop::Samples);
    for other in [&whole, &alone] {
        assert_eq!((other.samples, other.rays), (passes.samples, passes.rays));
        assert_eq!(other.film.mean, passes.film.mean);
        assert_eq!(other.film.standard_error, passes.film.standard_error);
        assert_eq!(other.film.relative_error(), passes.film.relative_error());
    }
}

#[test]
fn adaptive_samples_depend_on_nothing_but_the_scene() {
    let scene = scene();
    let rules = StopRules { samples: 1 << 14, error: Some(0.02), deadline: None };
    let job = RenderJob { seed: 3, stop: Some(rules), is_adaptive: true, ..RenderJob::default() };
    let found = render(&scene, &job, &());
    assert_eq!(found.stop, Stop::Error);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = one_thread.install(|| render(&scene, &job, &()));
    assert_eq!((alone.samples, alone.film.mean), (found.samples, found.film.mean));
    let state = found.state.unwrap();
    let counts = state.blocks.iter().map(|block| block.sums.samples().len());
    let (least, most) = (counts.clone().min().unwrap(), counts.max().unwrap());
    assert!(least >= 16 && 2 * least < most, "{least} {most}");
    assert!((least..most).contains(&(found.samples as usize)));
    // No block is left far behind.
    assert!(8 * (least + 4) >= most / 2, "{least} {most}");
}

#[test]
fn the_first_rule_ends_it() {
    let folder = folder();
    let stats = |arguments: &[&str]| {
        let mut all = vec!["render", "scene.toml", "-o", "a.exr", "--stats", "s.json"];
        all.extend(arguments);
        let output = alhazen(folder.path(), &all);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        read_json(&folder.path().join("s.json"))
    };
    let found = stats(&["--error", "0.0001%", "--samples", "12"]);
    assert_eq!((&found["samples"], &found["stop"]), (&12.into(), &"samples".into()));
    let found = stats(&["--error", "5%", "--time", "10m"]);
    assert_eq!(found["stop"], "error");
    assert!(found["error"].as_f64().unwrap() <= 0.05);
    assert!(found["samples"].as_u64().unwrap() != 16, "the scene's own number counts no more");
    let found = stats(&["--time", "1500ms", "--error", "0.0001%"]);
    assert_eq!(found["stop"], "time");
    assert!(found["samples"].as_u64().unwrap() > 16);
    // The limit keeps a tenth of a pass back; a machine that is busy may still take a little longer.
    assert!(found["seconds"]["total"].as_f64().unwrap() < 3.0, "{found}");
    // Too short for anything: one sample.
    let found = stats(&["--time", "1ms"]);
    assert_eq!((&found["samples"], &found["stop"]), (&1.into(), &"time".into()));
    assert!(found["error"].is_null());
}

#[test]
fn what_cannot_be_asked_for_is_refused() {
    let folder = folder();
    for (arguments, says) in [
        (vec!["--error", "0"], "1% or 0.01"),
        (vec!["--error", "little"], "1% or 0.01"),
        (vec!["--time", "soon"], "30s"),
        (vec!["--time", "0s"], "30s"),
        (vec!["--error", "1%", "--crop", "0,0,8,8"], "--crop"),
    ] {
        let mut all = vec!["render", "scene.toml", "-o", "a.exr"];
        all.extend(&arguments);
        let output = alhazen(folder.path(), &all);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains(says), "{arguments:?}: {}", stderr(&output));
        assert!(!folder.path().join("a.exr").exists());
    }
}

fn read_json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}
