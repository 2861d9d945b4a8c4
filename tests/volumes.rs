//! Volumes in the ray tree against closed forms: a constant grid, of which everything is known.
#![allow(missing_docs, reason = "a test program")]

use alhazen::accel::AccelKind;
use alhazen::color::Rgb;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{Scene, Variant};

/// What the middle of the picture shows along −Z from (0, 0, 5), where a box of constant extinction 0.5/m and
/// colour (0.2, 0.6, 1) lies from z = −1 to 1 and the background is 0.8.
fn seen(rest: &str) -> Rgb {
    seen_from(5.0, rest)
}

fn seen_from(z: f64, rest: &str) -> Rgb {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("one.raw"), [1; 65 * 3 * 3]).unwrap();
    let path = folder.path().join("scene.toml");
    let text = format!(
        r#"
[image]
size = [8, 8]
background = 0.8
[camera]
eye = [0, 0, {z}]
target = [0, 0, 0]
projection = "orthographic"
height = 0.5
{rest}
[[volumes]]
grid = "one.raw"
size = [3, 3, 65]
format = "u8"
bounds = [[-1, -1, -1], [1, 1, 1]]
transfer = [{{ value = 1, color = [0.2, 0.6, 1.0], extinction = 0.5 }}]
"#
    );
    std::fs::write(&path, text).unwrap();
    let loaded = load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let scene = Scene::build_quietly(loaded.scene, AccelKind::Brute)
        .unwrap_or_else(|errors| panic!("{errors:?}"));
    assert_eq!(scene.requirements.volumes, 1);
    assert_eq!(scene.requirements.variant, Variant::Everything);
    render(&scene, &RenderJob::default(), &()).film.pixel(4, 4).unwrap()
}

const COLOR: Rgb = Rgb::new(0.2, 0.6, 1.0);

/// `behind` through `length` of the volume.
fn through(length: f32, behind: Rgb) -> Rgb {
    let t = (-0.5 * length).exp();
    behind * t + COLOR * (1.0 - t)
}

#[track_caller]
fn near(found: Rgb, expected: Rgb, tolerance: f32) {
    let off = found.zip(expected, |a, b| (a - b).abs()).max_component();
    assert!(off <= tolerance, "{found:?} is not {expected:?}");
}

const BACKGROUND: Rgb = Rgb::new(0.8, 0.8, 0.8);

#[test]
fn the_background_is_dimmed_by_beers_law() {
    near(seen(""), through(2.0, BACKGROUND), 2e-6);
    // From far away, where rays begin at the scene's box, and from within.
    near(seen_from(1e5, ""), through(2.0, BACKGROUND), 2e-5);
    near(seen_from(0.25, ""), through(1.25, BACKGROUND), 2e-6);
}

#[test]
fn a_surface_ends_the_way() {
    let glowing = "[materials.glow]\ntype = \"diffuse\"\nreflectance = 0\nemission = [2, 1, 0]\n\
        [[objects]]\nshape = \"sphere\"\nradius = 1e3\ncenter = [0, 0, -999.5]\nmaterial = \"glow\"\n";
    near(seen(glowing), through(0.5, Rgb::new(2.0, 1.0, 0.0)), 1e-4);
}

#[test]
fn mirrors_show_it_again() {
    let mirror = "[materials.m]\ntype = \"mirror\"\nreflectance = 0.5\n\
        [[objects]]\nshape = \"plane\"\npoint = [0, 0, -3]\nnormal = [0, 0, 1]\nmaterial = \"m\"\n";
    near(seen(mirror), through(2.0, through(2.0, BACKGROUND) * 0.5), 1e-5);
}

#[test]
fn it_dims_lamps_behind_it() {
    let floor = |shadows: &str| {
        format!(
            "[render]\nshadows = {shadows}\nintegrator = \"direct\"\n[materials.m]\ntype = \"diffuse\"\n\
             reflectance = 0.5\n[[objects]]\nshape = \"plane\"\npoint = [0, 0, -2]\nnormal = [0, 0, 1]\n\
             material = \"m\"\n[[lights]]\ntype = \"directional\"\ndirection = [0, 0, -1]\n\
             irradiance = 3.1415927\n"
        )
    };
    let lit = Rgb::splat(0.5);
    near(seen(&floor("\"opaque\"")), through(2.0, lit * (-1.0f32).exp()), 1e-5);
    near(seen(&floor("false")), through(2.0, lit), 1e-5);
}

/// ∫ of both media together; the volume's pieces take the fog in their middles.
#[test]
fn fog_and_volume_share_the_way() {
    let fog = "[medium]\ntype = \"fog\"\nscattering = 0.2\nabsorption = 0.1\nradiance = 0.5\n";
    let (sf, sv) = (0.3f64, 0.5f64);
    let along = |s: f64, length: f64| (-s * length).exp();
    // The way: 4 m of fog, 2 m of both, then fog without end.
    let before = along(sf, 4.0);
    let both = (1.0 - along(sf + sv, 2.0)) / (sf + sv);
    let source = 0.5 * 0.2;
    let haze = source / sf * (1.0 - before)
        + before * source * both
        + before * along(sf + sv, 2.0) * source / sf;
    let expected = COLOR * (before * sv * both) as f32 + Rgb::splat(haze as f32);
    near(seen(fog), expected, 1e-4);
}

/// Coloured glass around all of it: an endless half-space that the ray enters 1 m before the volume.
#[test]
fn glass_dims_it() {
    let glass = "[materials.g]\ntype = \"dielectric\"\nior = 1.0\nabsorption = 0.4\n\
        [[objects]]\nshape = \"plane\"\npoint = [0, 0, 2]\nnormal = [0, 0, 1]\nmaterial = \"g\"\n";
    let both = (1.0 - (-0.9f32 * 2.0).exp()) / 0.9;
    near(seen(glass), COLOR * ((-0.4f32).exp() * 0.5 * both), 1e-4);
}
