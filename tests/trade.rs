//! `alhazen trade` through the command line: what it recommends reaches what was asked for, it turns only
//! what matters, and its knobs do what their flags do.
#![allow(missing_docs, reason = "a test program")]

use std::collections::BTreeSet;
use std::path::Path;

use alhazen::film::{Film, PixelRect};
use alhazen::io::read_picture;
use serde_json::Value;

mod common;
use common::{alhazen, stderr, stdout};

/// A mirror, a ball of glass, and a lamp with an area.
const SCENE: &str = r#"
[image]
size = [64, 48]
[render]
samples = 16
[camera]
eye = [0, 1.5, 6]
target = [0, 0.8, 0]
[materials.mirror]
type = "mirror"
[materials.glass]
type = "dielectric"
[[objects]]
shape = "sphere"
center = [-0.9, 0.8, 0]
radius = 0.8
material = "mirror"
[[objects]]
shape = "sphere"
center = [0.9, 0.8, 0.4]
radius = 0.7
material = "glass"
[[objects]]
shape = "box"
min = [-0.4, 0, -2]
max = [0.6, 1.6, -1.2]
[[objects]]
shape = "disk"
center = [0, 0, 0]
normal = [0, 1, 0]
radius = 20
[[lights]]
type = "disk"
center = [2, 5, 3]
normal = [-0.3, -1, -0.4]
radius = 1.0
radiance = 9
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> String {
    let output = alhazen(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    stdout(&output)
}

fn report(folder: &Path, arguments: &[&str]) -> Value {
    let all = ["trade", "scene.toml", "--rounds", "1", "--json", "trade.json", "-q"];
    let all: Vec<&str> = all.iter().chain(arguments).copied().collect();
    run(folder, &all);
    serde_json::from_str(&std::fs::read_to_string(folder.join("trade.json")).unwrap()).unwrap()
}

/// All points that flags make of the scene.
fn points(report: &Value) -> Vec<&Value> {
    let knobs = report["knobs"].as_array().unwrap();
    let turned = knobs.iter().flat_map(|knob| knob["points"].as_array().unwrap());
    turned.chain(report["convergence"].as_array().unwrap()).collect()
}

fn words(flags: &Value) -> Vec<&str> {
    flags.as_array().unwrap().iter().map(|word| word.as_str().unwrap()).collect()
}

/// What is recommended for an error has it, against a reference that the measurement has not seen; and the
/// error that is told is that of the picture which `render` makes of the flags.
#[test]
fn what_is_recommended_for_an_error_reaches_it() {
    let folder = folder();
    let folder = folder.path();
    let found = report(
        folder,
        &["--error", "6%", "--error", "3%", "--cache", "kept", "--reference-samples", "1024"],
    );
    // Other random numbers, and no roulette.
    run(
        folder,
        &[
            "render",
            "scene.toml",
            "-q",
            "-o",
            "other.exr",
            "--exr-type",
            "float",
            "--samples",
            "2048",
            "--seed",
            "77",
            "--max-depth",
            "24",
            "--set",
            "render.prune=1e-5",
        ],
    );
    let recommended = found["recommendations"].as_array().unwrap();
    assert_eq!(recommended.len(), 2);
    let mut samples = Vec::new();
    for (found, target) in recommended.iter().zip([0.06, 0.03]) {
        assert_eq!(found["is_reached"], true, "{found}");
        let told = found["error"].as_f64().unwrap();
        assert!(told <= target, "{found}");
        let flags = words(&found["flags"]);
        let start = ["render", "scene.toml", "-q", "-o", "this.exr", "--exr-type", "float"];
        let all: Vec<&str> = start.iter().chain(&flags).copied().collect();
        run(folder, &all);
        let measured = error(&folder.join("this.exr"), &folder.join("other.exr"));
        assert!(measured <= 1.1 * target, "{measured} against {target}: {flags:?}");
        samples.push(flags.join(" "));
    }
    assert_ne!(samples[0], samples[1], "half the error takes more");
    // The reference was kept, and is used.
    let kept: Vec<_> = std::fs::read_dir(folder.join("kept")).unwrap().collect();
    assert_eq!(kept.len(), 1);
}

/// The command that is told is all that there is to it: of a larger scene, with other fields and another
/// accelerator, it renders the picture that was measured, and in about the time that was asked for.
#[test]
fn what_is_recommended_for_a_time_is_a_whole_command() {
    let folder = folder();
    let folder = folder.path();
    // Four times as wide as is measured: were the size not told, it would take sixteen times as long.
    std::fs::write(folder.join("scene.toml"), SCENE.replace("[64, 48]", "[1280, 960]")).unwrap();
    let given = ["--accel", "bvh", "--set", "camera.fov=30", "--samples", "2"];
    let start = ["--time", "1.5s", "--no-cache", "--reference-samples", "64"];
    let all: Vec<&str> = start.into_iter().chain(given).collect();
    let found = report(folder, &all);
    let found = &found["recommendations"][0];
    let flags = words(&found["flags"]);
    for pair in [["--size", "320x240"], ["--set", "camera.fov=30"]] {
        assert!(flags.windows(2).any(|words| words == pair), "{pair:?}: {flags:?}");
    }
    // The one that was given, or a better one; without Embree it is the default.
    assert_eq!(flags.contains(&"--accel"), cfg!(feature = "embree"), "{flags:?}");
    assert_eq!(flags.iter().filter(|flag| **flag == "--samples").count(), 1, "{flags:?}");
    let start = ["render", "scene.toml", "-q", "-o", "this.exr", "--stats", "stats.json"];
    let all: Vec<&str> = start.into_iter().chain(flags.iter().copied()).collect();
    run(folder, &all);
    let stats = std::fs::read_to_string(folder.join("stats.json")).unwrap();
    let stats: Value = serde_json::from_str(&stats).unwrap();
    let seconds = stats["seconds"]["total"].as_f64().unwrap();
    // Machines are busy at times; sixteen times as long is no such time.
    assert!(seconds < 12.0, "{seconds}: {flags:?}");
    assert_eq!(read_picture(&folder.join("this.exr")).unwrap().extent, [320, 240]);
}

/// The relative error of a picture against another.
fn error(picture: &Path, reference: &Path) -> f64 {
    let film = |path: &Path| {
        let picture = read_picture(path).unwrap();
        let mut film = Film::new(picture.size, PixelRect::whole(picture.size), false);
        film.mean = picture.pixels;
        film
    };
    film(picture).error_against(&film(reference))
}

/// A kept reference gives the same report as a new one; another scene does not use it.
#[test]
fn references_are_kept_by_what_they_depend_on() {
    let folder = folder();
    let folder = folder.path();
    let errors = |report: &Value| -> Vec<f64> {
        points(report).iter().map(|p| p["error"].as_f64().unwrap()).collect()
    };
    let arguments = ["--cache", "kept", "--reference-samples", "64", "--samples", "4"];
    let made = report(folder, &arguments);
    let first = errors(&made);
    let again = report(folder, &arguments);
    assert_eq!(errors(&again), first);
    // It says how it was made, not where it is kept.
    assert!(made["reference"].as_str().unwrap().starts_with("alhazen render "), "{made}");
    assert_eq!(again["reference"], made["reference"]);
    let count = || std::fs::read_dir(folder.join("kept")).unwrap().count();
    assert_eq!(count(), 1);
    let other: Vec<&str> = arguments.iter().chain(&["--set", "camera.fov=30"]).copied().collect();
    report(folder, &other);
    assert_eq!(count(), 2);
    // One that is broken is made again.
    for file in std::fs::read_dir(folder.join("kept")).unwrap() {
        std::fs::write(file.unwrap().path(), "no picture").unwrap();
    }
    assert_eq!(errors(&report(folder, &arguments)), first);
}

/// Only what the scene has is turned, and what is turned is what its flags make of the scene.
#[test]
fn knobs_are_those_that_matter_and_do_what_their_flags_do() {
    let folder = folder();
    let folder = folder.path();
    // With a picture on the floor, and glass that disperses.
    run(folder, &"render scene.toml -q -o floor.png --samples 1".split(' ').collect::<Vec<_>>());
    let scene =
        SCENE.replace("type = \"dielectric\"", "type = \"dielectric\"\nior = { abbe = [1.5, 30] }");
    let floor = "radius = 20\nmaterial = \"floor\"\n[materials.floor]\ntype = \"diffuse\"\n\
                 reflectance = { image = \"floor.png\", mapping = \"planar\" }\n";
    std::fs::write(folder.join("scene.toml"), scene.replace("radius = 20\n", floor)).unwrap();
    let quick = ["--no-cache", "--reference-samples", "16", "--samples", "2", "--size", "24x16"];
    let names = |report: &Value| -> BTreeSet<String> {
        let knobs = report["knobs"].as_array().unwrap();
        knobs.iter().map(|knob| knob["name"].as_str().unwrap().to_owned()).collect()
    };
    let all = report(folder, &quick);
    let found = names(&all);
    for name in [
        "max_depth",
        "prune",
        "roulette",
        "shadow_samples",
        "shadows",
        "epsilon",
        "precision",
        "texture_filter",
        "wavelength",
    ] {
        assert!(found.contains(name), "{name}: {found:?}");
    }
    // The picture on the floor is blurred for speed, but not in what is taken for the truth.
    let reference = all["reference"].as_str().unwrap();
    assert!(reference.contains("render.texture_filter=bilinear"), "{reference}");
    let adaptive = all["knobs"].as_array().unwrap().iter().find(|knob| knob["name"] == "adaptive");
    let stated = |i: usize| adaptive.unwrap()["points"][i]["sampling_error"].as_f64().unwrap();
    let own = all["base"]["sampling_error"].as_f64().unwrap();
    assert!(stated(0) < 0.75 * own && stated(2) < 0.55 * own && stated(3) < 0.55 * own, "{own}");
    for kind in ["half", "float"] {
        let cost = &all["half"][kind];
        assert!(cost["seconds"].as_f64().unwrap() > 0.0, "{cost}");
        assert!(cost["bytes"].as_u64().unwrap() > 300, "{cost}");
    }
    assert!(!found.contains("light_samples") && !found.contains("tolerance"), "{found:?}");
    std::fs::write(
        folder.join("flat.toml"),
        "[render]\nintegrator = \"flat\"\n[[objects]]\nshape = \"sphere\"\nradius = 1\n",
    )
    .unwrap();
    let mut flat = vec!["trade", "flat.toml", "-q", "--rounds", "1", "--json", "flat.json"];
    flat.extend(quick);
    run(folder, &flat);
    let flat = std::fs::read_to_string(folder.join("flat.json")).unwrap();
    let flat = names(&serde_json::from_str(&flat).unwrap());
    for name in [
        "max_depth",
        "prune",
        "roulette",
        "shadow_samples",
        "shadows",
        "epsilon",
        "texture_filter",
        "wavelength",
    ] {
        assert!(!flat.contains(name), "{name}: {flat:?}");
    }

    // With its flags a render is the picture that was measured.
    let reference =
        "render scene.toml -q -o ref.exr --exr-type float --samples 16 --size 24x16 --seed 3";
    run(folder, &reference.split(' ').collect::<Vec<_>>());
    let mut quick: Vec<&str> = quick.into_iter().filter(|word| *word != "16").collect();
    quick.retain(|word| !["--no-cache", "--reference-samples"].contains(word));
    quick.extend(["--reference", "ref.exr"]);
    let all = report(folder, &quick);
    let mut seen = 0;
    for point in points(&all) {
        let flags = words(&point["flags"]);
        let mut render = vec!["render", "scene.toml", "-q", "-o", "one.exr", "--exr-type", "float"];
        render.extend(["--size", "24x16"]);
        // An error takes as many samples as it does.
        if !flags.iter().any(|flag| ["--error", "--samples"].contains(flag)) {
            render.extend(["--samples", "2"]);
        }
        render.extend(&flags);
        run(folder, &render);
        run(folder, &["compare", "one.exr", "ref.exr", "-q", "--json", "one.json"]);
        let one = std::fs::read_to_string(folder.join("one.json")).unwrap();
        let one: Value = serde_json::from_str(&one).unwrap();
        let [one, measured] = [&one["relmse"], &point["relmse"]].map(|x| x.as_f64().unwrap());
        assert!((one - measured).abs() <= 1e-9 * measured, "{flags:?}: {one} {measured}");
        seen += 1;
    }
    assert!(seen > 25, "{seen}");
}

/// The page and the table are there, whole, and ask the network for nothing.
#[test]
fn pages_and_tables_are_written() {
    let folder = folder();
    let folder = folder.path();
    let text = run(
        folder,
        &[
            "trade",
            "scene.toml",
            "--no-cache",
            "--reference-samples",
            "32",
            "--samples",
            "2",
            "--size",
            "32x24",
            "--rounds",
            "1",
            "--html",
            "page.html",
            "--csv",
            "table.csv",
            "--time",
            "1s",
        ],
    );
    assert!(text.contains("for 1 s") && text.contains("alhazen render scene.toml"), "{text}");
    let page = std::fs::read_to_string(folder.join("page.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    let outside = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!outside.contains("http") && page.contains("data:image/png;base64,"));
    // Error by seconds, error by samples, memory by seconds (`compact` halves it).
    assert_eq!(page.matches("<svg ").count(), if cfg!(feature = "embree") { 3 } else { 2 });
    let table = std::fs::read_to_string(folder.join("table.csv")).unwrap();
    assert!(table.contains("\nrecommended,\"1 s"), "{table}");
    let mut lines = table.lines();
    let columns = lines.next().unwrap().split(',').count();
    for line in lines {
        // Labels and flags may hold commas, within quotes.
        let parts: Vec<&str> = line.split('"').collect();
        let commas: usize = parts.iter().step_by(2).map(|part| part.matches(',').count()).sum();
        assert_eq!(commas + 1, columns, "{line}");
    }
}

#[test]
fn what_cannot_be_measured_is_told_before_any_work() {
    let folder = folder();
    let folder = folder.path();
    let refused = |arguments: &[&str]| {
        let output = alhazen(folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        stderr(&output)
    };
    let small =
        ["render", "scene.toml", "-q", "-o", "small.exr", "--size", "8x6", "--samples", "1"];
    run(folder, &small);
    let message = refused(&["trade", "scene.toml", "-q", "--reference", "small.exr"]);
    assert!(message.contains("8 x 6 pixels") && message.contains("64 x 48"), "{message}");
    let message = refused(&["trade", "scene.toml", "-q", "--html", "scene.toml"]);
    assert!(message.contains("over an input"), "{message}");
    let message = refused(&["trade", "scene.toml", "--error", "0"]);
    assert!(message.contains("--error"), "{message}");
}
