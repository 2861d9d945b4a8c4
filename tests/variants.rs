//! The variants of the ray tree: from the least that a scene requires on, all trace the same rays and give the
//! same picture, but for the order in which the light of a pixel is summed.
#![allow(missing_docs, reason = "a test program")]

use std::fmt::Write as _;

use alhazen::accel::AccelKind;
use alhazen::integrator::{BranchEnds, RayCounts};
use alhazen::io::{LoadOptions, load_scene};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{Scene, Variant};

mod common;
use common::Random;

/// Materials that the variant needs at most.
const LOCAL: &[&str] = &[
    "type = \"diffuse\"\nreflectance = [0.7, 0.2, 0.1]",
    "type = \"phong\"\ndiffuse = [0.1, 0.3, 0.6]\nspecular = 0.8\nshininess = 20",
    "type = \"phong\"\nspecular = 0.5\nmodel = \"phong\"",
    "type = \"phong\"\ndiffuse = 0.0\nspecular = 0.9\nmodel = \"phong\"",
    "type = \"diffuse\"\nreflectance = 0.0",
];
const TREE: &[&str] = &[
    "type = \"mirror\"\nreflectance = [0.9, 0.8, 0.7]",
    "type = \"dielectric\"\nior = 1.5",
    "type = \"dielectric\"\nior = 1.33\nabsorption = [0.5, 2.0, 1.0]\npriority = 1",
    "type = \"conductor\"\neta = [0.2, 0.92, 1.1]\nk = [3.9, 2.45, 2.14]",
    "type = \"phong\"\ndiffuse = [0.25, 0.02, 0.02]\nmirror = 1.0\nfresnel = \"exact\"",
    "type = \"dielectric\"\nfresnel = \"schlick\"",
    "type = \"dielectric\"\nior = 1.0\nabsorption = [2.0, 0.3, 0.7]",
    "type = \"dielectric\"\nior = 0.7",
];

/// Balls, an ellipsoid, copies and a wall on a floor, under some of the lamps that need nothing.
fn random_scene(random: &mut Random, materials: &[&str]) -> String {
    let mut text = "[image]\nsize = [44, 33]\nbackground = [0.2, 0.3, 0.5]\n\
        [ambient]\nradiance = [0.1, 0.15, 0.2]\n"
        .to_owned();
    let pick = |random: &mut Random, from: &[&str]| from[random.below(from.len())].to_owned();
    let integrator = pick(random, &["whitted", "whitted", "whitted", "direct"]);
    let (shadows, roulette) =
        (pick(random, &["true", "true", "false"]), pick(random, &["true", "false"]));
    let lens = pick(random, &["0.0", "0.1"]);
    let depth = pick(random, &["1", "3", "8"]);
    write!(
        text,
        "[camera]\neye = [0, 2.5, 6]\ntarget = [0, 0.5, 0]\nlens_radius = {lens}\n\
         [render]\nsamples = 3\nintegrator = \"{integrator}\"\nshadows = {shadows}\n\
         roulette = {roulette}\nprune = 0.02\nmax_depth = {depth}\n"
    )
    .unwrap();
    for (i, material) in materials.iter().enumerate() {
        write!(text, "[materials.m{i}]\n{material}\n").unwrap();
    }
    // One hangs among the balls, one is off, one shines on the back of the wall.
    let lights = [
        "type = \"point\"\nposition = [0.2, 1.3, 0.1]\nintensity = 3",
        "type = \"point\"\nposition = [0, 4, 0]\nintensity = 0",
        "type = \"point\"\nposition = [3, 5, 4]\nintensity = 80",
        "type = \"point\"\nposition = [-3, 4, 2]\nintensity = 0.5\nfalloff = \"none\"",
        "type = \"directional\"\ndirection = [-0.6, -1.0, -0.5]\nirradiance = [2, 1.5, 1]",
        "type = \"directional\"\ndirection = [0.3, -0.6, 0.7]\nirradiance = 2",
        "type = \"spot\"\nposition = [0, 4, 2]\ndirection = [0, -1, -0.4]\nintensity = 60\ncone_angle = 40",
    ];
    for _ in 0..1 + random.below(3) {
        write!(text, "[[lights]]\n{}\n", pick(random, &lights)).unwrap();
    }
    let floor = random.below(materials.len());
    write!(
        text,
        "[[objects]]\nshape = \"mesh\"\npositions = [[-5, 0, -5], [5, 0, -5], [5, 0, 5], [-5, 0, 5]]\n\
         triangles = [[0, 2, 1], [0, 3, 2]]\nmaterial = \"m{floor}\"\n\
         [prototypes.p]\nobjects = [{{ shape = \"sphere\", radius = 0.3, material = \"m{}\" }}]\n\
         [[objects]]\ninstance = \"p\"\ntransforms = [[{{ translate = [-1, 0.3, 2] }}], [{{ scale = [1, 2, 1] }}, {{ translate = [1, 0.6, 2] }}]]\n",
        random.below(materials.len())
    )
    .unwrap();
    for _ in 0..10 {
        let (x, y, z) =
            (random.between(-2.5, 2.5), random.between(0.2, 1.5), random.between(-2.5, 1.5));
        write!(
            text,
            "[[objects]]\nshape = \"sphere\"\ncenter = [{x}, {y}, {z}]\nradius = {}\nmaterial = \"m{}\"\n",
            random.between(0.2, 0.7),
            random.below(materials.len())
        )
        .unwrap();
    }
    let wall = random.below(materials.len());
    write!(text, "[[objects]]\nmesh = \"wall.obj\"\nmaterial = \"m{wall}\"\n").unwrap();
    text
}

/// A wall that the camera sees at a flat angle, and whose shading normals lean far from it, some to its other side.
fn wall(random: &mut Random) -> String {
    let mut text = String::new();
    for i in 0..25u32 {
        let (z, y) = (f64::from(i % 5) - 2.5, 0.6 * f64::from(i / 5));
        let mut lean = |low: f64| random.between(low, 2.0);
        write!(text, "v -1.5 {y} {z}\nvn {} {} {}\n", lean(-0.6), lean(-2.0), lean(-2.0)).unwrap();
    }
    for i in (1..25u32).filter(|i| i % 5 != 0 && *i < 21) {
        let [a, b, c, d] = [i, i + 1, i + 6, i + 5];
        writeln!(text, "f {a}//{a} {b}//{b} {c}//{c} {d}//{d}").unwrap();
    }
    text
}

fn build(text: &str, wall: &str, kind: AccelKind) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    std::fs::write(&path, text).unwrap();
    std::fs::write(folder.path().join("wall.obj"), wall).unwrap();
    let loaded =
        load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}\n{text}"));
    Scene::build_quietly(loaded.scene, kind).unwrap()
}

/// All that must not depend on the variant: what ended branches is not counted where there are none.
fn picture(scene: &Scene, variant: Option<Variant>) -> (Vec<[f32; 3]>, RayCounts, BranchEnds) {
    let rendered = render(scene, &RenderJob { variant, ..RenderJob::default() }, &());
    assert_eq!(rendered.non_finite.count, 0);
    let pixels = rendered.film.mean.iter().map(|c| c.to_array()).collect();
    let rays = RayCounts { ends: BranchEnds::default(), ..rendered.rays };
    (pixels, rays, rendered.rays.ends)
}

/// Whether they differ by no more than sums of up to some hundred numbers do in f32, none of them below 0, by
/// their order; what is left of light behind much glass may be so little that f32 has few digits for it.
fn are_alike(a: &[[f32; 3]], b: &[[f32; 3]]) -> bool {
    let bound = |a: f32, b: f32| 1e-5 * a.max(b) + f32::MIN_POSITIVE;
    let values = a.iter().flatten().zip(b.iter().flatten());
    a.len() == b.len() && values.into_iter().all(|(a, b)| (a - b).abs() <= bound(*a, *b))
}

/// Greater variants than the least do what that does, and nothing more.
fn check(materials: &[&str], expected: Variant, seed: u64) {
    let mut random = Random(seed);
    let mut met = 0;
    for round in 0..if common::verify() { 400 } else { 60 } {
        let (text, wall) = (random_scene(&mut random, materials), wall(&mut random));
        for &kind in AccelKind::ALL {
            let scene = build(&text, &wall, kind);
            let least = scene.requirements.variant;
            assert!(least <= expected, "{least:?} for\n{text}");
            met += u32::from(least == expected);
            let chosen = picture(&scene, None);
            for variant in Variant::ALL.into_iter().filter(|v| *v >= least) {
                let forced = picture(&scene, Some(variant));
                let name =
                    format!("{} by `{}`, round {round}\n{text}", kind.name(), variant.name());
                assert!(are_alike(&chosen.0, &forced.0), "another picture with {name}");
                assert_eq!(chosen.1, forced.1, "other rays with {name}");
                if least > Variant::Local {
                    assert_eq!(chosen.2, forced.2, "other ends with {name}");
                }
            }
        }
    }
    assert!(met > 0, "no scene needed `{}`", expected.name());
}

#[test]
fn scenes_without_mirrors_look_the_same_in_all_variants() {
    check(LOCAL, Variant::Local, 1);
}

#[test]
fn scenes_with_mirrors_and_glass_look_the_same_in_greater_variants() {
    let all: Vec<&str> = LOCAL.iter().chain(TREE).copied().collect();
    check(&all, Variant::Tree, 2);
}
