//! Freeform surfaces from the scene file to triangles: how fine they become, and what is refused.
#![allow(missing_docs, reason = "a test program")]

use alhazen::accel::AccelKind;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::scene::{Scene, Tessellation};

/// Builds a scene called f.toml; the error is every mistake, a line each.
fn build(text: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.toml");
    std::fs::write(&path, text).unwrap();
    std::fs::write(folder.path().join("cage.obj"), CAGE).unwrap();
    std::fs::write(folder.path().join("short.bpt"), "1\n3 3\n0 0 0\n").unwrap();
    let result = match load_scene(&path, &LoadOptions::default()) {
        Ok(loaded) => Scene::build_quietly(loaded.scene, AccelKind::Brute)
            .map_err(|errors| errors.iter().map(|e| format!("{e}\n")).collect()),
        Err(error) => Err(error.to_string()),
    };
    result.map_err(|text: String| text.replace(&format!("{}/", folder.path().display()), ""))
}

/// A pyramid: four triangles and a quadrilateral.
const CAGE: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 2 0\n\
                    f 1 2 3 4\nf 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 4 5\n";

const DOME: &str = "shape = \"patches\"\npoints = [[0, 0, 0], [1, 0, 1], [2, 0, 1], [3, 0, 0], [0, 1, 1], [1, 1, 2], \
                    [2, 1, 2], [3, 1, 1], [0, 2, 1], [1, 2, 2], [2, 2, 2], [3, 2, 1], [0, 3, 0], [1, 3, 1], \
                    [2, 3, 1], [3, 3, 0]]\n";

fn made(text: &str) -> Tessellation {
    let mut made = build(text).unwrap_or_else(|e| panic!("{e}\n{text}")).tessellations;
    assert_eq!(made.len(), 1);
    made.remove(0)
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b
}

#[test]
fn pixels_are_those_of_the_nearest_point() {
    // 90° over 100 pixels from 10 m above the highest control points: 0.2 m each.
    let camera = |z: f64| {
        format!(
            "[image]\nsize = [100, 100]\n[camera]\nfov = 90\neye = [1.5, 1.5, {z}]\nup = [0, 1, 0]\ntarget = [1.5, 1.5, 0]\n"
        )
    };
    let object = |rest: &str| format!("[[objects]]\n{DOME}{rest}");
    let at = |z: f64, rest: &str| made(&(camera(z) + &object(rest)));
    assert!(near(at(12.0, "tolerance = 0.5").distance, 0.1));
    assert!(near(at(12.0, "").distance, 0.1), "the default");
    assert!(near(at(22.0, "tolerance = \"0.5px\"").distance, 0.2));
    assert!(near(at(22.0, "tolerance = \" 0.02 m\"").distance, 0.02));
    let scaled = at(12.0, "tolerance = \"0.02 m\"\ntransform = [{ scale = [1, 4, 2] }]");
    assert!(near(scaled.distance, 0.005), "{scaled:?}");
    let render = format!("[render]\ntolerance = \"0.03 m\"\n{}{}", camera(12.0), object(""));
    assert!(near(made(&render).distance, 0.03));
    // Finer when nearer, also where the camera is placed by itself or stands within.
    assert!(at(4.0, "").triangles > 2 * at(40.0, "").triangles);
    assert!(made(&object("")).triangles > 20);
    assert!(at(1.0, "").triangles > 100);
}

#[test]
fn copies_are_as_fine_as_the_nearest_needs() {
    let scene = |z: &str| {
        format!(
            "[image]\nsize = [100, 100]\n[camera]\nfov = 90\neye = [1.5, 1.5, 12]\ntarget = [1.5, 1.5, 0]\n\
             [[prototypes.p.objects]]\n{DOME}[[prototypes.q.objects]]\ninstance = \"p\"\n\
             [[objects]]\ninstance = \"q\"\ntransforms = [[{{ translate = [0, 0, -50] }}], [{{ translate = [0, 0, {z}] }}]]\n"
        )
    };
    assert!(near(made(&scene("0")).distance, 0.1));
    assert!(near(made(&scene("-10")).distance, 0.2));
}

#[test]
fn surfaces_of_every_kind_become_triangles() {
    let cage = made("[[objects]]\nshape = \"subdivision\"\nfile = \"cage.obj\"\n");
    assert_eq!((cage.patches, cage.kind[1]), (5, "faces"));
    assert!(cage.triangles >= 2 * 16);
    let creased = "[[objects]]\nshape = \"subdivision\"\nfile = \"cage.obj\"\ncreases = [[0, 1], [1, 2], [2, 3], [3, 0]]\ntolerance = \"0.01 m\"\n";
    assert!(made(creased).triangles > 100);
    let shared =
        DOME.to_owned() + "patches = [[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]]\n";
    let (shared, plain) =
        (made(&format!("[[objects]]\n{shared}")), made(&format!("[[objects]]\n{DOME}")));
    assert_eq!(shared.triangles, plain.triangles);
}

#[test]
fn mistakes_are_told_with_their_place() {
    let nurbs = |rest: &str| {
        format!(
            "\"nurbs\"\ndegree = [1, 1]\npoints = [[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]]]\nknots_v = [0, 0, 1, 1]\n{rest}"
        )
    };
    let cube = "\"subdivision\"\npositions = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n";
    for (shape, expected) in [
        ("\"patches\"".to_owned(), "f.toml:1:1: an object of patches has either a `file` or `points`"),
        (
            "\"patches\"\npoints = [[0, 0, 0]]".into(),
            "f.toml:3:10: `points` must be 16 points for each patch, or any number with `patches` to tell which, not a list of 1",
        ),
        (
            "\"patches\"\npoints = [[0, 0, 0]]\npatches = [[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]]".into(),
            "f.toml:4:12: patch 0 names point 1, but there are 1 (the first is 0)",
        ),
        (
            "\"patches\"\nfile = \"short.bpt\"".into(),
            "f.toml:3:8: short.bpt: the file ends before patch 0 (the first is 0) of 1 is complete",
        ),
        (
            "\"patches\"\nfile = \"short.bpt\"\ntolerance = 0".into(),
            "f.toml:3:8: short.bpt: the file ends before patch 0 (the first is 0) of 1 is complete\n\
             f.toml:4:13: `tolerance` must be above 0, not 0",
        ),
        (
            nurbs("knots_u = [0, 1, 0, 1]\ntolerance = \"-1 m\""),
            "f.toml:1:1: `knots_u` must not decrease, as number 2 (the first is 0) does\n\
             f.toml:7:13: `tolerance` must be pixels above 0, such as 0.5 or \"0.5 px\", or metres, such as \"0.01 m\", not the text \"-1 m\"",
        ),
        (
            nurbs("knots_u = [0, 0, 1]"),
            "f.toml:1:1: `knots_u` must have 4 numbers, for 2 control points of degree 1, not 3",
        ),
        (
            nurbs("knots_u = [0, 0, 1, 1]\nweights = [[1, 1]]"),
            "f.toml:7:11: `weights` must have 2 rows of 2 numbers, as `points` has",
        ),
        (
            nurbs("knots_u = [0, 0, 1, 1]\nweights = [[1, 1], [1, -1]]"),
            "f.toml:1:1: weights must be above 0, unlike number 3 (the first is 0), -1",
        ),
        (
            format!("{cube}faces = [[0, 1, 3]]"),
            "f.toml:4:10: face 0 names point 3, but there are 3 (the first is 0)",
        ),
        (
            format!("{cube}faces = [[0, 1]]"),
            "f.toml:4:9: face 0 (the first is 0) has 2 corners; at least 3 are needed",
        ),
        (
            format!("{cube}faces = [[0, 1, 2]]\ntolerance = \"1e-9 m\""),
            "",
        ),
        (
            "\"subdivision\"\nfile = \"cage.ply\"".into(),
            "f.toml:3:8: cage.ply: faces of any number of corners are read from: .obj",
        ),
    ] {
        let text = format!("[[objects]]\nshape = {shape}\n");
        match build(&text) {
            Ok(_) => assert_eq!(expected, "", "{text}"),
            Err(error) => assert_eq!(error.trim(), expected, "{text}"),
        }
    }
    let error = build(&format!("[[objects]]\n{DOME}tolerance = \"1e-12 m\"\n")).unwrap_err();
    let start = "f.toml:1:1: with a tolerance of 1.0e-12 m this object takes more than 100000000 triangles; ";
    assert!(error.starts_with(start) && error.trim().ends_with(" m would fit"), "{error}");
}
