//! One test for each bug that was found, named for it.
#![allow(missing_docs, reason = "a test program")]

use std::fmt::Write as _;
use std::process::{Command, Stdio};

use alhazen::accel::AccelKind;
use alhazen::film::Filter;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::render::{RenderJob, render};
use alhazen::scene::Scene;

mod common;
use common::{alhazen, stderr};

fn load(text: &str, kind: AccelKind) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    std::fs::write(&path, text).unwrap();
    let loaded = load_scene(&path, &LoadOptions::default()).map_err(|e| e.to_string())?;
    Scene::build_quietly(loaded.scene, kind)
        .map_err(|errors| errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}

/// Luminance in the middle of an 8 × 8 picture.
fn middle(text: &str, kind: AccelKind) -> f32 {
    let text = format!("[image]\nsize = [8, 8]\n[render]\nsamples = 4\nfilter = \"box\"\n{text}");
    let scene = load(&text, kind).unwrap();
    render(&scene, &RenderJob::default(), &()).film.pixel(4, 4).unwrap().luminance()
}

/// The squared length of a normal over- or underflowed in f32, and the surface was lit face-on.
#[test]
fn tilted_triangles_are_shaded_alike_at_any_scale() {
    let scene = |s: f64| {
        format!(
            "[camera]\nprojection = \"orthographic\"\nheight = {0}\neye = [0, 0, {0}]\ntarget = [0, 0, 0]\n\
             [ambient]\nradiance = 0\n[[lights]]\ntype = \"directional\"\ndirection = [0, 0, -1]\nirradiance = 3\n\
             [[objects]]\nshape = \"triangle\"\npoints = [[-{1}, -{1}, -{1}], [{1}, -{1}, -{1}], [0, {1}, {1}]]\n",
            s,
            2.0 * s
        )
    };
    for &kind in AccelKind::ALL {
        let expected = middle(&scene(1.0), kind);
        assert!(expected > 0.1);
        for s in [1e-9, 1e-5, 1e5, 1e9, 1e10, 1e11] {
            let got = middle(&scene(s), kind);
            assert!((got - expected).abs() < 1e-4, "{} at {s}: {got}, not {expected}", kind.name());
        }
    }
}

/// Beyond what f32 queries hold, pictures were empty without a word.
#[test]
fn scenes_beyond_f32_are_refused() {
    let sphere = |radius: &str, more: &str| {
        format!("[[objects]]\nshape = \"sphere\"\nradius = {radius}\n{more}\n")
    };
    let scaled = |scale: &str| {
        let step = format!("transforms = [[{{ scale = [{scale}, {scale}, 0.1] }}]]");
        let ball = "[[prototypes.ball.objects]]\nshape = \"sphere\"\nradius = 1.0\n";
        format!("{ball}[[objects]]\ninstance = \"ball\"\n{step}\n")
    };
    for (text, message) in [
        (sphere("1e13", ""), "coordinates must lie within 1e12 of it"),
        (sphere("1e-11", ""), "below 1e-10 ray queries find nothing"),
        (sphere("1e200", ""), "`radius` must be a finite number (within 1e30)"),
        (scaled("1e10"), "accepted: 1e-9 to 1e9"),
        (scaled("1e-10"), "accepted: 1e-9 to 1e9"),
    ] {
        let error = load(&text, AccelKind::Brute).map(|_| ()).unwrap_err();
        assert!(error.contains(message), "{error}");
    }
}

/// The weights of the filter's negative lobes did not match the share in which they are drawn.
#[test]
fn no_filter_changes_a_constant() {
    for filter in Filter::ALL {
        let text = format!(
            "[image]\nsize = [8, 8]\nbackground = 0.5\n[render]\nsamples = 4096\nfilter = \"{}\"\n",
            filter.name()
        );
        let film = render(&load(&text, AccelKind::Brute).unwrap(), &RenderJob::default(), &()).film;
        let mean = film.mean.iter().map(|c| c.g).sum::<f32>() / film.mean.len() as f32;
        assert!((mean - 0.5).abs() < 3e-4, "{}: {mean}", filter.name());
    }
}

/// A chain of prototypes overflowed the stack; a tree of them filled the memory.
#[test]
fn nests_of_prototypes_are_bounded() {
    let mut chain =
        String::from("[prototypes.p0]\nobjects = [{ shape = \"sphere\", radius = 1 }]\n");
    for i in 1..5000 {
        writeln!(chain, "[prototypes.p{i}]\nobjects = [{{ instance = \"p{}\" }}]", i - 1).unwrap();
    }
    chain += "[[objects]]\ninstance = \"p4999\"\n";
    let error = load(&chain, AccelKind::Brute).map(|_| ()).unwrap_err();
    assert!(error.contains("prototypes are nested more than 64 deep"), "{error}");

    let mut tree =
        String::from("[prototypes.p0]\nobjects = [{ shape = \"sphere\", radius = 1 }]\n");
    for i in 1..13 {
        let copies = vec![format!("{{ instance = \"p{}\" }}", i - 1); 10].join(", ");
        writeln!(tree, "[prototypes.p{i}]\nobjects = [{copies}]").unwrap();
    }
    tree += "[[objects]]\ninstance = \"p12\"\n";
    let error = load(&tree, AccelKind::Brute).map(|_| ()).unwrap_err();
    assert!(
        error.contains("copies of prototypes in all; at most 200000000 are possible"),
        "{error}"
    );
}

/// A look for the line of every object counted the lines from the start of the file.
#[test]
fn many_objects_are_read_in_time_linear_in_their_number() {
    let seconds = |n: usize| {
        let mut text = String::new();
        for i in 0..n {
            writeln!(text, "[[objects]]\nshape = \"sphere\"\nradius = 0.1\ncenter = [{i}, 0, 0]")
                .unwrap();
        }
        let start = std::time::Instant::now();
        load(&text, AccelKind::Brute).unwrap();
        start.elapsed().as_secs_f64()
    };
    seconds(100);
    let (few, many) = (seconds(2_000), seconds(40_000));
    // 20 times the objects; the quadratic form took 400 times as long.
    assert!(many < 120.0 * few, "{few} s and {many} s");
}

/// The dot in a scene's name was taken for an extension.
#[test]
fn the_default_output_keeps_the_whole_name() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my.v2.toml"), "[image]\nsize = [4, 4]\n").unwrap();
    let output = alhazen(folder.path(), &["render", "my.v2.toml", "--quiet"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(folder.path().join("my.v2.exr").exists());
}

/// Statistics replaced the scene, or the picture.
#[test]
fn no_file_is_written_over_another() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), "[image]\nsize = [4, 4]\n").unwrap();
    for arguments in [
        &["--stats", "s.toml"][..],
        &["-o", "a.exr", "--stats", "a.exr"],
        &["-o", "a.exr", "-o", "./a.exr"],
    ] {
        let all: Vec<&str> = ["render", "s.toml"].iter().chain(arguments).copied().collect();
        let output = alhazen(folder.path(), &all);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains("would be written twice, or over an input"));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// The film was allocated first, and the program aborted.
#[test]
fn a_picture_larger_than_the_memory_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), "").unwrap();
    let output = alhazen(folder.path(), &["render", "s.toml", "--size", "65535x65535"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("a picture of 65535 x 65535 pixels needs 172 GB"));
}

/// A reader that had gone away was a panic.
#[test]
fn a_closed_pipe_is_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), "[image]\nsize = [4, 4]\n").unwrap();
    for command in ["inspect", "render"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_alhazen"))
            .current_dir(folder.path())
            .args([command, "s.toml"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{command}: {}", stderr(&output));
    }
}

/// Flags and fields that say the same gave different hashes, and different settings the same.
#[test]
fn the_hash_is_of_what_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), "[image]\nsize = [4, 4]\n").unwrap();
    let hash = |more: &[&str]| {
        let all: Vec<&str> = ["inspect", "s.toml"].iter().chain(more).copied().collect();
        let text = common::stdout(&alhazen(folder.path(), &all));
        text.lines().find(|l| l.contains("hash")).unwrap().to_owned()
    };
    assert_ne!(hash(&[]), hash(&["--integrator", "flat"]));
    assert_ne!(hash(&[]), hash(&["--max-depth", "5"]));
    assert_eq!(hash(&[]), hash(&["--samples", "5"]), "more of the same picture");
    assert_eq!(hash(&[]), hash(&["--integrator", "whitted"]), "the default, said aloud");
}
