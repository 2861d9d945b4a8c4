//! `alhazen compare`, and the readers of pictures below it.
#![allow(missing_docs, reason = "a test program")]

use std::path::Path;

use alhazen::color::Rgb;
use alhazen::film::{Film, Picture, PixelRect};
use alhazen::io::{
    ExrCompression, ExrLayout, ExrOptions, PixelType, ToneMap, read_exr, read_png, write_exr,
    write_png,
};

mod common;
use common::{alhazen, stderr, stdout};

fn film(size: [u32; 2], colour: impl Fn(u32, u32) -> [f32; 3]) -> Film {
    let mut film = Film::new(size, PixelRect::whole(size), false);
    for (i, pixel) in film.mean.iter_mut().enumerate() {
        *pixel = colour(i as u32 % size[0], i as u32 / size[0]).into();
    }
    film
}

/// Something smooth within [0, 1], and no half exactly.
fn gradient(size: [u32; 2]) -> Film {
    film(size, |x, y| [x as f32 / 50.0, y as f32 / 60.0, 0.1 + (x * y % 7) as f32 / 10.0])
}

const FLOAT: ExrOptions = ExrOptions {
    pixel_type: PixelType::Float,
    compression: ExrCompression::Zip,
    layout: ExrLayout::Scanline,
};

fn save(folder: &Path, name: &str, film: &Film) {
    write_exr(&folder.join(name), film, &[], &FLOAT).unwrap();
}

/// A folder with `ref.exr` and, 0.25 brighter in red in the left half, `test.exr`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    save(folder.path(), "ref.exr", &film([8, 4], |_, _| [0.5, 0.25, 1.0]));
    let test = film([8, 4], |x, _| [if x < 4 { 0.75 } else { 0.5 }, 0.25, 1.0]);
    save(folder.path(), "test.exr", &test);
    folder
}

/// Exit code, standard output and standard error of `alhazen compare`.
fn compare(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let mut all = vec!["compare"];
    all.extend(arguments);
    let output = alhazen(folder, &all);
    (output.status.code().unwrap_or(-1), stdout(&output), stderr(&output))
}

fn json(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let mut all = arguments.to_vec();
    all.extend(["--json", "m.json", "--quiet"]);
    let (code, out, error) = compare(folder, &all);
    assert_eq!((code, out.as_str(), error.as_str()), (0, "", ""));
    serde_json::from_str(&std::fs::read_to_string(folder.join("m.json")).unwrap()).unwrap()
}

#[test]
fn metrics_are_those_computed_by_hand() {
    let folder = folder();
    let found = json(folder.path(), &["test.exr", "ref.exr"]);
    // Half of the pixels, one channel of three.
    let near = |name: &str, value: f64| {
        let ours = found[name].as_f64().unwrap();
        assert!((ours - value).abs() < 1e-9, "{name}: {ours} is not {value}");
    };
    near("mse", 0.0625 / 6.0);
    near("mae", 0.25 / 6.0);
    near("relmse", 0.0625 / (0.25 + 0.01) / 6.0);
    near("psnr", 10.0 * (6.0f64 / 0.0625).log10());
    near("max", 0.25);
    assert_eq!(found["max_at"], serde_json::json!([0, 0]));
    assert_eq!(found["size"], serde_json::json!([8, 4]));
    assert_eq!((&found["non_finite"], &found["passed"]), (&0.into(), &true.into()));
    assert_eq!(found["picture"], "test.exr");
    assert!(found["flip"].as_f64().unwrap() > 0.01 && found["hdr_flip"].is_null());
    let hdr = json(folder.path(), &["test.exr", "ref.exr", "--hdr-flip"]);
    assert!(hdr["hdr_flip"].as_f64().unwrap() > 0.01, "{hdr}");
    assert!(hdr["hdr_flip_exposures"][1].is_f64(), "{hdr}");

    let (code, table, error) = compare(folder.path(), &["test.exr", "ref.exr"]);
    assert!(!table.contains("hdr-flip"), "it takes long and was not asked for:\n{table}");
    assert_eq!((code, error.as_str()), (0, ""));
    let (code, table, error) = compare(folder.path(), &["test.exr", "ref.exr", "--hdr-flip"]);
    assert_eq!((code, error.as_str()), (0, ""));
    for line in [
        "  compared  test.exr with ref.exr, 8 x 4",
        "       mse  0.010417",
        "       mae  0.041667",
        "    relmse  0.040064",
        "      psnr  19.82 dB, clipped to [0, 1]",
        "       max  0.250000 at pixel 0,0",
        "      flip  0.",
        "  hdr-flip  0.",
        "non-finite  0 pixels",
    ] {
        assert!(table.contains(line), "`{line}` is not in:\n{table}");
    }
}

#[test]
fn the_reference_is_the_second_picture() {
    let folder = folder();
    let forth = json(folder.path(), &["test.exr", "ref.exr"]);
    let back = json(folder.path(), &["ref.exr", "test.exr"]);
    assert_eq!(forth["mse"], back["mse"]);
    assert_ne!(forth["relmse"], back["relmse"]);
}

#[test]
fn limits_are_exit_code_1_with_a_line_for_each() {
    let folder = folder();
    let pair = ["test.exr", "ref.exr"];
    let within = ["--max-mse", "0.011", "--max-mae", "0.042", "--max-relmse", "0.041"];
    let looks = ["--max-flip", "1", "--max-hdr-flip", "1"];
    assert_eq!(compare(folder.path(), &[&pair[..], &within, &looks].concat()).0, 0);

    assert_eq!(compare(folder.path(), &[&pair[..], &["--min-psnr", "19.8"]].concat()).0, 0);
    assert_eq!(compare(folder.path(), &["ref.exr", "ref.exr", "--min-psnr", "900"]).0, 0);
    let (code, _, error) = compare(folder.path(), &[&pair[..], &["--min-psnr", "19.9"]].concat());
    assert_eq!(code, 1);
    assert_eq!(error, "alhazen: test.exr: psnr is 19.822712, less than 19.900000\n");

    let beyond = ["--max-mse", "0.01", "--max-mae", "0.042", "--max-relmse=1e-9", "--max-flip=0"];
    let (code, table, error) = compare(folder.path(), &[&pair[..], &beyond].concat());
    assert_eq!(code, 1, "{error}");
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(lines.len(), 3, "{error}");
    assert_eq!(lines[0], "alhazen: test.exr: mse is 0.010417, more than 0.010000");
    assert_eq!(lines[1], "alhazen: test.exr: relmse is 0.040064, more than 1.00000e-9");
    assert!(lines[2].starts_with("alhazen: test.exr: flip is 0."), "{error}");
    assert!(table.contains("mse"), "the table is printed nevertheless");

    let (code, out, error) = compare(
        folder.path(),
        &[&pair[..], &["--quiet", "--max-mae", "0", "--json", "j"]].concat(),
    );
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(error.contains("mae is 0.041667, more than 0.000000"), "{error}");
    assert!(
        std::fs::read_to_string(folder.path().join("j")).unwrap().contains("\"passed\": false")
    );

    let all_zero: Vec<String> = ["mse", "mae", "relmse", "flip", "hdr-flip"]
        .map(|name| format!("--max-{name}=0"))
        .into_iter()
        .collect();
    let all_zero: Vec<&str> = all_zero.iter().map(String::as_str).collect();
    assert_eq!(compare(folder.path(), &[&["ref.exr", "ref.exr"], &all_zero[..]].concat()).0, 0);
}

#[test]
fn non_finite_pixels_fail_only_where_there_is_a_limit() {
    let folder = folder();
    let nan = film([8, 4], |x, y| if (x, y) == (3, 2) { [f32::NAN; 3] } else { [0.5, 0.25, 1.0] });
    save(folder.path(), "nan.exr", &nan);
    let (code, table, _) = compare(folder.path(), &["nan.exr", "ref.exr"]);
    assert_eq!(code, 0);
    assert!(table.contains("non-finite  1 pixels"), "{table}");
    assert!(table.contains("mse  0.000000"), "{table}");
    let limited = ["nan.exr", "ref.exr", "--max-mse", "1"];
    let (code, _, error) = compare(folder.path(), &limited);
    assert_eq!(code, 1);
    assert_eq!(error, "alhazen: nan.exr or ref.exr: 1 pixels are NaN or infinite, more than 0\n");
    save(folder.path(), "all.exr", &film([8, 4], |_, _| [f32::INFINITY; 3]));
    let (code, table, error) = compare(folder.path(), &["all.exr", "ref.exr", "--max-flip", "1"]);
    assert_eq!(code, 1);
    assert!(table.contains("psnr  undefined"), "{table}");
    assert!(error.contains("flip is undefined, more than 1.000000"), "{error}");
}

#[test]
fn bad_input_is_exit_code_2() {
    let folder = folder();
    save(folder.path(), "wide.exr", &film([4, 8], |_, _| [0.0; 3]));
    let mut crop = film([8, 4], |_, _| [0.0; 3]);
    (crop.size, crop.window) = ([20, 20], PixelRect { x0: 2, y0: 3, x1: 10, y1: 7 });
    save(folder.path(), "crop.exr", &crop);
    std::fs::write(folder.path().join("text.exr"), "not a picture").unwrap();
    std::fs::write(folder.path().join("empty.exr"), "").unwrap();
    let cases: &[(&[&str], &str)] = &[
        (
            &["wide.exr", "ref.exr"],
            "wide.exr and ref.exr do not show the same pixels: 4x8 and 8x4 pixels",
        ),
        (
            &["crop.exr", "ref.exr"],
            "crop.exr and ref.exr do not show the same pixels: parts of a whole that begin at 2,3 \
             and at 0,0",
        ),
        (&["none.exr", "ref.exr"], "none.exr: cannot open: No such file"),
        (&["text.exr", "ref.exr"], "text.exr: unknown kind of picture; accepted: EXR, PNG"),
        (&["ref.exr", "empty.exr"], "empty.exr: the file is empty"),
        (&["ref.exr", "."], ".: not a regular file"),
        (&["ref.exr"], "required arguments"),
        (&["ref.exr", "ref.exr", "--max-mse", "-1"], "unexpected argument"),
        (&["ref.exr", "ref.exr", "--max-mse=-1"], "expected a number that is not negative"),
        (&["ref.exr", "ref.exr", "--max-flip", "NaN"], "expected a number that is not negative"),
        (
            &["ref.exr", "test.exr", "--difference", "d.jpg"],
            "d.jpg: unknown kind of picture; accepted: .exr, .png",
        ),
        (
            &["ref.exr", "test.exr", "--difference", "./test.exr"],
            "./test.exr: would be written twice, or over an input",
        ),
        (&["ref.exr", "test.exr", "--json", "no/where"], "no/where: cannot create a file"),
    ];
    for (arguments, message) in cases {
        let (code, out, error) = compare(folder.path(), arguments);
        assert_eq!(code, 2, "{arguments:?}: {error}");
        assert!(error.contains(message), "{arguments:?}: {error}");
        assert!(out.is_empty());
    }
}

#[test]
fn differences_are_written_as_pictures() {
    let folder = folder();
    let arguments = ["test.exr", "ref.exr", "--difference", "d.exr"];
    let (code, table, _) = compare(folder.path(), &arguments);
    assert!(code == 0 && table.contains("wrote  d.exr"), "{table}");
    let d = read_exr(&folder.path().join("d.exr")).unwrap();
    assert_eq!((d.pixels[0], d.pixels[5]), (Rgb::new(0.25, 0.0, 0.0), Rgb::BLACK));

    assert_eq!(compare(folder.path(), &["ref.exr", "ref.exr", "--difference", "same.png"]).0, 0);
    let same = read_png(&folder.path().join("same.png")).unwrap();
    assert!(same.pixels.iter().all(|p| p.luminance() < 0.01), "magma begins with black");
    assert_eq!(compare(folder.path(), &["test.exr", "ref.exr", "--difference", "d.png"]).0, 0);
    let d = read_png(&folder.path().join("d.png")).unwrap();
    assert_eq!(d.extent, [8, 4]);
    assert!(d.pixels[0].r > same.pixels[0].r, "brighter where the pictures differ");

    // A part of a larger picture stays where it is.
    let mut crop = film([8, 4], |x, _| [x as f32, 0.0, 0.0]);
    (crop.size, crop.window) = ([20, 20], PixelRect { x0: 2, y0: 3, x1: 10, y1: 7 });
    save(folder.path(), "crop.exr", &crop);
    assert_eq!(compare(folder.path(), &["crop.exr", "crop.exr", "--difference", "e.exr"]).0, 0);
    let e = read_exr(&folder.path().join("e.exr")).unwrap();
    assert_eq!((e.size, e.extent, e.origin), ([20, 20], [8, 4], Some([2, 3])));
}

#[test]
fn a_png_is_compared_with_an_exr_in_linear_light() {
    let folder = tempfile::tempdir().unwrap();
    let picture = gradient([40, 30]);
    save(folder.path(), "p.exr", &picture);
    write_png(&folder.path().join("p.png"), &picture, 0.0, ToneMap::Srgb).unwrap();
    let found = json(folder.path(), &["p.png", "p.exr"]);
    // Half a step of 255 in sRGB is at most 0.0045 in linear light.
    assert!(found["max"].as_f64().unwrap() < 0.0046, "{found}");
    assert!(found["max"].as_f64().unwrap() > 1e-4, "{found}");
    assert!(found["flip"].as_f64().unwrap() < 0.02, "{found}");
    assert!(found["psnr"].as_f64().unwrap() > 50.0, "{found}");
    let found = json(folder.path(), &["p.png", "p.exr", "--channels"]);
    let names = found["channels"].as_array().unwrap().iter().map(|c| c["name"].as_str().unwrap());
    assert_eq!(names.collect::<Vec<_>>(), ["R", "G", "B"]);
    assert!(found["channels"][0]["max"].as_f64().unwrap() < 0.0046, "{found}");
}

#[test]
fn renders_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "[[objects]]\nshape = \"sphere\"\nradius = 1.0\n";
    std::fs::write(folder.path().join("s.toml"), scene).unwrap();
    for (name, seed) in [("a.exr", "1"), ("b.exr", "1"), ("c.exr", "2")] {
        let arguments = ["render", "s.toml", "--size", "24x24", "-q", "-o", name, "--seed", seed];
        assert!(alhazen(folder.path(), &arguments).status.success());
    }
    let same = compare(folder.path(), &["a.exr", "b.exr", "--max-mse", "0", "--max-flip", "0"]);
    assert_eq!(same.0, 0, "{}", same.2);
    assert_eq!(compare(folder.path(), &["a.exr", "c.exr", "--max-mse", "0"]).0, 1);
    assert_eq!(compare(folder.path(), &["a.exr", "c.exr", "--max-mse", "0.01"]).0, 0);
}

#[test]
fn what_is_written_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.exr");
    let mut picture = gradient([43, 37]);
    picture.mean[5] = Rgb::new(-3.0, 1e-5, 60000.0);
    (picture.size, picture.window) = ([100, 90], PixelRect { x0: 7, y0: 9, x1: 50, y1: 46 });
    for pixel_type in PixelType::ALL {
        for compression in ExrCompression::ALL {
            let options = ExrOptions { pixel_type, compression, ..ExrOptions::default() };
            write_exr(&path, &picture, &[], &options).unwrap();
            let read = read_exr(&path).unwrap();
            assert_eq!((read.size, read.extent, read.origin), ([100, 90], [43, 37], Some([7, 9])));
            let lossy = matches!(compression, ExrCompression::B44 | ExrCompression::B44a)
                && pixel_type == PixelType::Half;
            let off = match (pixel_type, compression) {
                _ if lossy => 0.1,
                (PixelType::Half, _) => 5e-4,
                (PixelType::Float, ExrCompression::Pxr24) => 1e-4,
                (PixelType::Float, _) => 0.0,
            };
            for (i, (a, b)) in read.pixels.iter().zip(&picture.mean).enumerate() {
                for (a, b) in a.to_array().into_iter().zip(b.to_array()) {
                    // The block of the extreme pixel is beyond a lossy compression.
                    let near = lossy && i % 43 < 8 && i / 43 < 4;
                    assert!(
                        near || (a - b).abs() <= off * b.abs().max(0.1),
                        "{compression:?} {i} {a} {b}"
                    );
                }
            }
        }
    }
    assert_eq!(Picture::from(picture.clone()).origin, Some([7, 9]));
}

/// Layers are compared channel by channel, halves and floats; what only one has is named.
#[test]
fn channels_are_compared_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scene = "[image]\nsize = [16, 12]\n[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n\
                 [[objects]]\nshape = \"disk\"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nradius = 50\n";
    std::fs::write(folder.join("s.toml"), scene).unwrap();
    for (name, more) in [("a.exr", "camera.eye=[0,0,5]"), ("b.exr", "camera.eye=[0,0,5.5]")] {
        let all = ["render", "s.toml", "-q", "-o", name, "--layers", "depth,normal", "--set", more];
        assert!(alhazen(folder, &all).status.success());
    }
    let report = json(folder, &["a.exr", "b.exr", "--channels"]);
    let channels = report["channels"].as_array().unwrap();
    let by_name = |name: &str| channels.iter().find(|c| c["name"] == name).unwrap();
    // Half a metre farther, and seen the same way.
    assert!((by_name("Z")["mae"].as_f64().unwrap() - 0.5).abs() < 1e-5, "{channels:?}");
    assert_eq!(by_name("normal.Z")["max"], 0.0);
    assert_eq!(channels.len(), 7);
    let (code, out, _) = compare(folder, &["a.exr", "b.exr", "--channels"]);
    assert!(code == 0 && out.contains("normal.Z") && out.contains("relmse"), "{out}");

    let all = ["render", "s.toml", "-q", "-o", "c.exr", "--layers", "normal"];
    assert!(alhazen(folder, &all).status.success());
    let (code, _, error) = compare(folder, &["a.exr", "c.exr", "--channels"]);
    assert!(code == 2 && error.contains("c.exr lacks Z"), "{error}");
    // Colours alone are the same question as ever, and what else there is is named.
    let (code, out, _) = compare(folder, &["a.exr", "c.exr"]);
    assert!(code == 0 && out.contains("  channels  c.exr lacks Z\n"), "{out}");
    assert!(!compare(folder, &["a.exr", "b.exr"]).1.contains("channels"));
    let report = json(folder, &["c.exr", "a.exr"]);
    assert_eq!(report["only_in_picture"], serde_json::json!([]));
    assert_eq!(report["only_in_reference"], serde_json::json!(["Z"]));
    assert!(report["channels"].is_null() && report["layers"].is_null());
}

/// Layers have rows of their own: what their channels come to together, and of colours how they look.
#[test]
fn layers_are_compared_whole() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scene = "[image]\nsize = [16, 12]\n[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n\
                 [materials.paint]\ntype = \"diffuse\"\nreflectance = [0.5, 0.25, 0.75]\n\
                 [[objects]]\nshape = \"disk\"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nradius = 50\n\
                 material = \"paint\"\n";
    std::fs::write(folder.join("s.toml"), scene).unwrap();
    let lighter = "materials.paint.reflectance=[0.75,0.25,0.75]";
    for (name, more) in [("a.exr", "image.size=[16,12]"), ("b.exr", lighter)] {
        let layers = ["--layers", "albedo,normal", "--set", more];
        let all = [&["render", "s.toml", "-q", "-o", name][..], &layers].concat();
        assert!(alhazen(folder, &all).status.success());
    }
    let report = json(folder, &["a.exr", "b.exr", "--channels"]);
    let layers = report["layers"].as_array().unwrap();
    let by_name = |name: &str| layers.iter().find(|c| c["name"] == name).unwrap();
    let albedo = by_name("albedo");
    let near = |value: &serde_json::Value, expected: f64| {
        assert!((value.as_f64().unwrap() - expected).abs() < 1e-3 * expected, "{value} {expected}");
    };
    // One channel of three is off by a quarter.
    near(&albedo["mse"], 0.0625 / 3.0);
    near(&albedo["mae"], 0.25 / 3.0);
    near(&albedo["relmse"], 0.0625 / (0.75 * 0.75 + 0.01) / 3.0);
    near(&albedo["psnr"], 10.0 * (3.0f64 / 0.0625).log10());
    near(&albedo["max"], 0.25);
    assert!(albedo["flip"].as_f64().unwrap() > 0.01, "{albedo}");
    assert!(by_name("normal")["flip"].is_null() && by_name("normal")["max"] == 0.0);
    let channels = report["channels"].as_array().unwrap();
    let red = channels.iter().find(|c| c["name"] == "albedo.R").unwrap();
    near(&red["psnr"], 10.0 * (1.0f64 / 0.0625).log10());

    let pair = ["a.exr", "b.exr", "-q"];
    let limited = |limits: &[&str]| compare(folder, &[&pair[..], limits].concat());
    let within =
        ["--limit", "albedo.R:mae=0.251", "--limit", "albedo:psnr=16", "--limit=normal:max=0"];
    assert_eq!(limited(&within), (0, String::new(), String::new()));
    let (code, _, error) = limited(&["--limit", "albedo.R:mae=0.249", "--limit", "albedo:psnr=17"]);
    assert_eq!(code, 1);
    let lines: Vec<&str> = error.lines().collect();
    assert!(lines[0].starts_with("alhazen: a.exr: albedo.R: mae is 0.2"), "{error}");
    assert_eq!(lines[1], "alhazen: a.exr: albedo: psnr is 16.812412, less than 17.000000");
    for (limit, message) in [
        ("Z:mae=1", "--limit: no channel or layer `Z`; there are: B, G, R, albedo.B"),
        ("normal:flip=1", "--limit: normal has no flip; accepted: mse, mae, relmse, max"),
        ("normal:far=1", "expected CHANNEL:METRIC=X"),
        ("normal:mse=-1", "expected a number that is not negative"),
        ("normal", "expected CHANNEL:METRIC=X"),
    ] {
        let (code, _, error) = limited(&["--limit", limit]);
        assert!(code == 2 && error.contains(message), "{limit}: {error}");
    }
}

/// Ids of a Cryptomatte are the same or not; their values are no numbers.
#[test]
fn ids_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scene = |name: &str| {
        format!(
            "[image]\nsize = [16, 12]\n[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n\
             [[objects]]\nname = \"{name}\"\nshape = \"disk\"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\n\
             radius = 50\n"
        )
    };
    for (name, object) in [("a", "left"), ("b", "right")] {
        std::fs::write(folder.join(format!("{name}.toml")), scene(object)).unwrap();
        let (from, to) = (format!("{name}.toml"), format!("{name}.exr"));
        let all = ["render", &from, "-q", "-o", &to, "--layers", "crypto_object", "--samples", "4"];
        assert!(alhazen(folder, &all).status.success());
    }
    let report = json(folder, &["a.exr", "b.exr", "--channels"]);
    let row = |list: &str, name: &str| {
        let rows = report[list].as_array().unwrap();
        rows.iter().find(|c| c["name"] == name).unwrap().clone()
    };
    let ids = row("channels", "CryptoObject00.R");
    assert!(ids["differing"] == 16 * 12 && ids["mse"].is_null(), "{ids}");
    assert_eq!(row("channels", "CryptoObject00.G")["max"], 0.0, "shares are numbers");
    let layer = row("layers", "CryptoObject00");
    assert!(
        layer["differing"] == 16 * 12 && layer["max"] == 0.0 && layer["flip"].is_null(),
        "{layer}"
    );
    let limited =
        |a: &str| compare(folder, &[a, "b.exr", "-q", "--limit", "CryptoObject00:differing=0"]);
    assert_eq!(limited("b.exr").0, 0);
    let (code, _, error) = limited("a.exr");
    assert!(code == 1 && error.contains("differing is 192.000000, more than 0.000000"), "{error}");
}
