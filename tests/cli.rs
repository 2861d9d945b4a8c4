//! The built program in a fresh folder: what it writes, says and returns.
#![allow(missing_docs, reason = "a test program")]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use alhazen::io::{AttributeValue, read_attributes};

mod common;
use common::{alhazen, stderr, stdout};

const SCENE: &str = r#"
[image]
size = [80, 60]
background = [0.2, 0.3, 0.4]
[render]
samples = 4
[camera]
eye = [0, 1, 5]
target = [0, 0, 0]
[cameras.side]
eye = [5, 1, 0]
target = [0, 0, 0]
[materials.red]
type = "phong"
diffuse = [0.8, 0.1, 0.1]
specular = 0.4
[[objects]]
shape = "sphere"
radius = 1.0
material = "red"
[[objects]]
shape = "mesh"
positions = [[-9, -1, -9], [9, -1, -9], [9, -1, 9], [-9, -1, 9]]
triangles = [[0, 2, 1], [0, 3, 2]]
[[lights]]
type = "point"
position = [3, 4, 3]
intensity = 90
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

/// Runs and expects success.
fn run(folder: &Path, arguments: &[&str]) -> String {
    let output = alhazen(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    stdout(&output)
}

/// The linear pixels and the offset of an EXR.
fn read_exr(path: &Path) -> (Vec<[f32; 3]>, [usize; 2], [i32; 2]) {
    use exr::prelude::*;
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| (vec![[0.0f32; 3]; size.area()], size),
        |(pixels, size), position, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels[position.y() * size.width() + position.x()] = [r, g, b];
        },
    )
    .unwrap();
    let layer = image.layer_data;
    let (pixels, size) = layer.channel_data.pixels;
    let position = layer.attributes.layer_position;
    (pixels, [size.width(), size.height()], [position.x(), position.y()])
}

#[test]
fn render_writes_every_output_and_a_table() {
    let folder = folder();
    let table =
        run(folder.path(), &["render", "scene.toml", "-o", "a.exr", "-o", "b.png", "-o", "c.EXR"]);
    for word in
        ["80 x 60", "seconds", "camera", "shadow", "Mrays/s", "memory", "error", "a.exr", "b.png"]
    {
        assert!(table.contains(word), "{word} is not in:\n{table}");
    }
    let (a, size, _) = read_exr(&folder.path().join("a.exr"));
    assert_eq!(size, [80, 60]);
    assert_eq!(a[0][2], 0.39990234, "the background, as half");
    assert!(a.iter().any(|p| p[0] > 2.0 * p[1]), "something red");
    assert_eq!(a, read_exr(&folder.path().join("c.EXR")).0);
    let png = std::fs::read(folder.path().join("b.png")).unwrap();
    assert_eq!(&png[..4], b"\x89PNG");
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 4, "no temporary file is left");
}

#[test]
fn png_is_srgb_after_exposure() {
    let folder = folder();
    // The corner shows the background, (0.2, 0.3, 0.4).
    let corner = |arguments: &[&str]| {
        let mut all = vec!["render", "scene.toml", "-o", "e.png"];
        all.extend(arguments);
        run(folder.path(), &all);
        let file = std::fs::File::open(folder.path().join("e.png")).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
        assert!(reader.info().srgb.is_some(), "the file says that it is sRGB");
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        [bytes[0], bytes[1], bytes[2]]
    };
    // IEC 61966-2-1: 255 (1.055 x^(1/2.4) − 0.055).
    assert_eq!(corner(&[]), [124, 149, 170]);
    assert_eq!(corner(&["--exposure", "1"]), [170, 203, 231]);
    assert_eq!(corner(&["--exposure", "-1"]), [89, 108, 124]);
    assert_eq!(corner(&["--exposure", "9"]), [255, 255, 255]);
}

#[test]
fn without_an_output_the_scenes_name_is_used() {
    let folder = folder();
    run(folder.path(), &["render", "scene.toml", "--quiet", "--size", "8x8"]);
    assert_eq!(read_exr(&folder.path().join("scene.exr")).1, [8, 8]);
}

#[test]
fn quiet_prints_nothing() {
    let folder = folder();
    let output = alhazen(folder.path(), &["render", "scene.toml", "-o", "a.exr", "--quiet"]);
    assert_eq!((stdout(&output), stderr(&output)), (String::new(), String::new()));
}

#[test]
fn the_picture_does_not_depend_on_threads() {
    let folder = folder();
    for threads in ["1", "2", "7"] {
        let name = format!("t{threads}.exr");
        run(
            folder.path(),
            &["render", "scene.toml", "-o", &name, "--threads", threads, "--seed", "3"],
        );
    }
    let file = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(file("t1.exr") == file("t2.exr"), "byte for byte");
    assert!(file("t1.exr") == file("t7.exr"), "byte for byte");
    run(folder.path(), &["render", "scene.toml", "-o", "other.exr", "--seed", "4"]);
    let [a, b] = ["t1.exr", "other.exr"].map(|name| read_exr(&folder.path().join(name)).0);
    assert_ne!(a, b, "another seed, another picture");
}

#[test]
fn a_crop_is_that_part_of_the_whole() {
    let folder = folder();
    run(folder.path(), &["render", "scene.toml", "-o", "whole.exr"]);
    run(folder.path(), &["render", "scene.toml", "-o", "crop.exr", "--crop", "13,6,62,43"]);
    let (whole, ..) = read_exr(&folder.path().join("whole.exr"));
    let (crop, size, position) = read_exr(&folder.path().join("crop.exr"));
    assert_eq!((size, position), ([49, 37], [13, 6]));
    for y in 0..37 {
        for x in 0..49 {
            assert_eq!(crop[y * 49 + x], whole[(y + 6) * 80 + x + 13], "{x},{y}");
        }
    }
}

#[test]
fn stats_are_json_with_the_documented_fields() {
    let folder = folder();
    run(
        folder.path(),
        &["render", "scene.toml", "-o", "a.exr", "--stats", "s.json", "--samples", "2"],
    );
    let text = std::fs::read_to_string(folder.path().join("s.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
    for phase in ["read", "build", "render", "write", "total"] {
        assert!(stats["seconds"][phase].as_f64().unwrap() >= 0.0, "{phase}");
    }
    assert_eq!(stats["rays"]["camera"], 80 * 60 * 2);
    assert!(stats["rays"]["shadow"].as_u64().unwrap() > 1000);
    for kind in ["reflection", "refraction", "diffuse"] {
        assert_eq!(stats["rays"][kind], 0);
    }
    assert!(stats["memory"]["peak_bytes"].as_u64().unwrap() > 1 << 20);
    assert!(stats["memory"]["accelerator_bytes"].is_u64());
    assert_eq!((&stats["samples"], &stats["stop"]), (&2.into(), &"samples".into()));
    assert!(stats["error"].as_f64().unwrap() > 0.0);
}

#[test]
fn set_and_flags_change_the_scene() {
    let folder = folder();
    let render = |name: &str, more: &[&str]| {
        let mut arguments = vec!["render", "scene.toml", "--size", "16x16", "-o", name];
        arguments.extend(more);
        run(folder.path(), &arguments);
        read_exr(&folder.path().join(name)).0
    };
    let base = render("base.exr", &[]);
    assert_ne!(base, render("side.exr", &["--camera", "side"]));
    assert_ne!(base, render("blue.exr", &["--set", "materials.red.diffuse=[0, 0, 1]"]));
    assert_ne!(base, render("small.exr", &["--set", "objects.0.radius=0.5"]));
    let flat = render("flat.exr", &["--integrator", "flat", "--filter", "box"]);
    let flat_too =
        render("too.exr", &["--set", "render.integrator=flat", "--set", "render.filter=box"]);
    assert_eq!(flat, flat_too);
}

#[test]
fn the_brute_force_picture_is_embrees() {
    let folder = folder();
    run(folder.path(), &["render", "scene.toml", "-o", "brute.exr", "--accel", "brute"]);
    run(folder.path(), &["render", "scene.toml", "-o", "default.exr"]);
    let (a, ..) = read_exr(&folder.path().join("brute.exr"));
    let (b, ..) = read_exr(&folder.path().join("default.exr"));
    let different =
        a.iter().zip(&b).filter(|(a, b)| (a[0] - b[0]).abs() > 2e-3 * a[0].max(0.1)).count();
    assert!(different <= 3, "{different} of 4800 pixels");
}

#[test]
fn exr_types_and_compressions_hold_the_same_picture() {
    let folder = folder();
    run(folder.path(), &["render", "scene.toml", "-o", "half.exr"]);
    run(folder.path(), &["render", "scene.toml", "-o", "float.exr", "--exr-type", "float"]);
    let (half, ..) = read_exr(&folder.path().join("half.exr"));
    let (float, ..) = read_exr(&folder.path().join("float.exr"));
    for (h, f) in half.iter().flatten().zip(float.iter().flatten()) {
        assert!((h - f).abs() <= f.abs() * 1e-3);
    }
    for compression in ["none", "rle", "zips", "zip", "piz"] {
        let name = format!("{compression}.exr");
        run(
            folder.path(),
            &["render", "scene.toml", "-o", &name, "--exr-compression", compression],
        );
        assert_eq!(half, read_exr(&folder.path().join(&name)).0, "{compression} is lossless");
    }
}

#[test]
fn what_half_cannot_hold_is_written_as_float() {
    let folder = folder();
    let arguments = [
        "render",
        "scene.toml",
        "-o",
        "bright.exr",
        "--set",
        "lights.0.intensity=1e9",
        "--size",
        "20x20",
    ];
    let output = alhazen(folder.path(), &arguments);
    assert!(output.status.success());
    assert!(stderr(&output).contains("bright.exr: written as float, as half ends at 65504"));
    assert!(read_exr(&folder.path().join("bright.exr")).0.iter().any(|p| p[0] > 65504.0));
}

#[test]
fn bad_input_is_exit_code_2_and_nothing_is_written() {
    let folder = folder();
    std::fs::write(folder.path().join("bad.toml"), "[camera]\nfow = 3\n").unwrap();
    std::fs::write(folder.path().join("old.exr"), "old").unwrap();
    std::fs::write(folder.path().join("empty.ply"), "").unwrap();
    let cases: &[(&[&str], &str)] = &[
        (&["render", "missing.toml"], "alhazen: missing.toml: cannot read: No such file"),
        (
            &["render", "bad.toml", "-o", "old.exr"],
            "bad.toml:2:1: unknown field `fow` in [camera] (did you mean `fov`?)",
        ),
        (
            &["render", "scene.toml", "-o", "x.jpg"],
            "x.jpg: unknown kind of picture; accepted: .exr, .hdr, .png",
        ),
        (
            &["render", "scene.toml", "-o", "nowhere/x.exr"],
            "nowhere/x.exr: cannot create a file in its folder",
        ),
        (&["render", "empty.ply"], "alhazen: empty.ply: the file is empty"),
        (
            &["render", "scene.txt"],
            "scene.txt: unknown kind of scene; accepted: .toml, .ply, .obj, .stl",
        ),
        (
            &["render", "scene.toml", "--crop", "0,0,81,60"],
            "--crop 0,0,81,60 reaches beyond the picture of 80x60",
        ),
        (&["render", "scene.toml", "--crop", "5,5,5,9"], "expected X0 < X1 and Y0 < Y1"),
        (&["render", "scene.toml", "--size", "0x10"], "expected WIDTHxHEIGHT"),
        (&["render", "scene.toml", "--samples", "0"], "0 is not in 1..=16777216"),
        (&["render", "scene.toml", "--camera", "top"], "unknown camera `top`; accepted: side"),
        (
            &["render", "scene.toml", "--set", "camera.fov=200"],
            "--set camera.fov=200: `fov` must be an angle between 0 and 180 degrees, not the number 200",
        ),
        (&["render", "scene.toml", "--accel", "octree"], "invalid value 'octree'"),
        (&["render"], "required arguments"),
        (&["paint"], "unrecognized subcommand"),
        (&["inspect", "bad.toml"], "unknown field `fow`"),
    ];
    for (arguments, message) in cases {
        let output = alhazen(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(message), "{arguments:?}: {}", stderr(&output));
        assert!(stdout(&output).is_empty());
    }
    assert_eq!(std::fs::read(folder.path().join("old.exr")).unwrap(), b"old");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
}

#[test]
#[cfg(feature = "embree")]
fn a_memory_limit_is_an_error_not_a_crash() {
    let folder = folder();
    let mut obj = String::new();
    for i in 0..200 {
        for j in 0..200 {
            obj += &format!("v {i} {} {j}\n", (i * j) % 7);
        }
    }
    for i in 0..199 {
        for j in 0..199 {
            let a = 200 * i + j + 1;
            obj += &format!("f {a} {} {} {}\n", a + 1, a + 201, a + 200);
        }
    }
    std::fs::write(folder.path().join("grid.obj"), obj).unwrap();
    let output =
        alhazen(folder.path(), &["render", "grid.obj", "-o", "x.exr", "--memory-limit", "1M"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    let said = "takes about 7 MB of memory (5 MB compact), and 1 MB is the limit";
    assert!(stderr(&output).contains(said), "{}", stderr(&output));
    assert!(!folder.path().join("x.exr").exists());
    run(
        folder.path(),
        &["render", "grid.obj", "-o", "x.exr", "--memory-limit", "1G", "--size", "32x32"],
    );
}

/// How well a hierarchy is built goes by the whole picture, so that parts of it fit together.
#[test]
fn auto_builds_a_large_mesh_quickly_for_few_rays() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &["generate", "terrain", "-n", "150k", "-o", "t.ply", "-q"]);
    let quality_of = |scene: &str, more: &[&str]| {
        let all: Vec<&str> = ["inspect", scene].iter().chain(more).copied().collect();
        let text = run(folder.path(), &all);
        let (_, rest) = text.split_once(", quality ").unwrap_or_else(|| panic!("{text}"));
        rest.split(';').next().unwrap_or_default().to_owned()
    };
    let quality = |more: &[&str]| quality_of("t.ply", more);
    let few = ["--size", "640x480", "--samples", "1"];
    let low = if cfg!(feature = "embree") { "low" } else { "medium" };
    assert_eq!(quality(&few), low);
    assert_eq!(quality(&["--size", "640x480", "--samples", "256"]), "medium");
    // Rays that run close together hardly suffer.
    assert_eq!(quality(&["--size", "640x480", "--samples", "8"]), low);
    let ao = ["--size", "640x480", "--integrator", "ao", "--samples"];
    assert_eq!(quality(&[&ao[..], &["1"]].concat()), low);
    assert_eq!(quality(&[&ao[..], &["8"]].concat()), "medium");
    // Nor do rays that miss it.
    let far = "[camera]\neye = [0, 0, 900]\ntarget = [0, 0, 0]\nfov = 40\n[[objects]]\nmesh = \"t.ply\"\n";
    std::fs::write(folder.path().join("far.toml"), far).unwrap();
    assert_eq!(quality_of("far.toml", &[&ao[..], &["8"]].concat()), low);
    for more in [["--accel", "bvh"], ["--precision", "exact"], ["--build-quality", "medium"]] {
        assert_eq!(quality(&[&few[..], &more].concat()), "medium");
    }
    let bytes = |name: &str, more: &[&str]| {
        let fixed = ["render", "t.ply", "--size", "96x64", "-o", name, "-q"];
        run(folder.path(), &[&fixed[..], more].concat());
        std::fs::read(folder.path().join(name)).unwrap()
    };
    let one = bytes("a.png", &["--samples", "1", "--threads", "1"]);
    assert!(one == bytes("b.png", &["--samples", "1", "--threads", "3"]));
    // Nor does one see how it was built.
    assert!(one == bytes("c.png", &["--samples", "1", "--build-quality", "medium"]));
}

#[test]
fn inspect_says_what_there_is() {
    let folder = folder();
    let text = run(folder.path(), &["inspect", "scene.toml"]);
    for word in
        ["2 triangles, 1 sphere", "1 point light", "shadow rays", "80 x 60", "read", "build"]
    {
        assert!(text.contains(word), "{word} is not in:\n{text}");
    }
}

#[test]
fn help_teaches() {
    let folder = folder();
    let text = run(folder.path(), &["--help"]);
    for word in ["render", "inspect", "alhazen render bunny.ply", "Exit codes"] {
        assert!(text.contains(word), "{word} is not in:\n{text}");
    }
    let text = run(folder.path(), &["render", "--help"]);
    for flag in
        ["--size", "--samples", "--crop", "--threads", "--seed", "--stats", "--precision", "--set"]
    {
        assert!(text.contains(flag), "{flag}");
    }
    assert!(run(folder.path(), &["--version"]).starts_with("alhazen 0."));
}

/// Ctrl-C in the middle: exit code 130, and a picture that opens.
#[test]
fn an_interrupt_leaves_a_valid_picture() {
    let folder = folder();
    let child = Command::new(env!("CARGO_BIN_EXE_alhazen"))
        .current_dir(folder.path())
        .args(["render", "scene.toml", "-o", "cut.exr", "--samples", "50000", "--stats", "s.json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Until it catches the signal (number 2), which it does before it reads the scene.
    let status = format!("/proc/{}/status", child.id());
    let catches = || {
        let status = std::fs::read_to_string(&status).unwrap_or_default();
        let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:")).map(str::trim);
        mask.and_then(|m| u64::from_str_radix(m, 16).ok()).is_some_and(|m| m & 2 != 0)
    };
    let start = Instant::now();
    while !catches() && start.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(5));
    }
    // And until it renders: reading and building two objects is a matter of milliseconds.
    std::thread::sleep(Duration::from_millis(700));
    let start = Instant::now();
    // The shell's own `kill`: a bare system has no other.
    let kill = format!("kill -INT {}", child.id());
    let killed = Command::new("sh").args(["-c", &kill]).status().unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert!(start.elapsed() < Duration::from_secs(30), "{:?}", start.elapsed());
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(stderr(&output).contains("interrupted"));
    assert_eq!(read_exr(&folder.path().join("cut.exr")).1, [80, 60]);
    let stats = std::fs::read_to_string(folder.path().join("s.json")).unwrap();
    assert!(stats.contains("\"stop\": \"interrupted\""), "{stats}");
}

/// The header names what shifts the picture, as far as the scene has what it acts on, and nothing else.
#[test]
fn the_header_names_what_shifts_the_picture() {
    let folder = folder();
    let bias = |scene: &str, arguments: &[&str]| -> String {
        std::fs::write(folder.path().join("bias.toml"), scene).unwrap();
        let quick =
            ["render", "bias.toml", "-q", "-o", "bias.exr", "--samples", "1", "--size", "8x6"];
        run(folder.path(), &quick.iter().chain(arguments).copied().collect::<Vec<_>>());
        let attributes = read_attributes(&folder.path().join("bias.exr")).unwrap();
        let found = attributes.into_iter().find(|a| a.name == "alhazen.bias").unwrap();
        let AttributeValue::Text(text) = found.value else { panic!("no text") };
        text
    };
    let plain = "[[objects]]\nshape = \"sphere\"\nradius = 1\n";
    assert_eq!(bias(plain, &[]), "precision=robust");
    let ao = ["--integrator", "ao", "--set", "render.ao_distance=0.5"];
    assert_eq!(bias(plain, &ao), "precision=robust ao_distance=0.5");

    run(folder.path(), &["render", "bias.toml", "-q", "-o", "texels.png", "--samples", "1"]);
    let all = "[medium]\ntype = \"fog\"\nscattering = 0.05\ndims_lights = false\n\
        [materials.glass]\ntype = \"dielectric\"\nior = { abbe = [1.5, 30] }\nfresnel = \"schlick\"\n\
        [materials.gold]\ntype = \"conductor\"\nmetal = \"gold\"\n\
        fresnel = { offset = 0.4, scale = 0.6, power = 5 }\n\
        [materials.paper]\ntype = \"diffuse\"\n\
        reflectance = { image = \"texels.png\", mapping = \"planar\" }\n\
        [[lights]]\ntype = \"point\"\nposition = [0, 9, 0]\nintensity = 9\n\
        [[objects]]\nshape = \"sphere\"\nradius = 1\nmaterial = \"glass\"\n\
        [[objects]]\nshape = \"sphere\"\nradius = 1\ncenter = [2, 0, 0]\nmaterial = \"gold\"\n\
        [[objects]]\nshape = \"disk\"\nradius = 9\ncenter = [0, -1, 0]\nnormal = [0, 1, 0]\nmaterial = \"paper\"\n";
    assert_eq!(
        bias(all, &["--set", "render.wavelength=550", "--set", "render.prune=0.1"]),
        "precision=robust max_depth=8 prune=0.1 shadows=opaque fresnel=power,schlick \
         texture_filter=mip wavelength=550 dims_lights=false"
    );
    let bilinear = ["--set", "render.texture_filter=bilinear", "--integrator", "direct"];
    let found = bias(all, &bilinear);
    assert!(!found.contains("texture_filter") && !found.contains("max_depth"), "{found}");

    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let smoke = format!(
        "[[volumes]]\ngrid = \"{}\"\nbounds = [[-1, -1, -1], [1, 1, 1]]\ntolerance = 0.02\n\
         transfer = [{{ value = 0, color = 0, extinction = 0 }}, {{ value = 1, color = 1, extinction = 8 }}]\n",
        scenes.join("grids/smoke.npy").display()
    );
    assert_eq!(bias(&smoke, &[]), "precision=robust volume_tolerance=0.02");
    let teapot = scenes.join("teapot.toml");
    let teapot = teapot.to_str().unwrap();
    run(
        folder.path(),
        &["render", teapot, "-q", "-o", "bias.exr", "--samples", "1", "--size", "8x6"],
    );
    let attributes = read_attributes(&folder.path().join("bias.exr")).unwrap();
    let found = attributes.iter().find(|a| a.name == "alhazen.bias").unwrap();
    let AttributeValue::Text(text) = &found.value else { panic!("no text") };
    assert!(text.contains("tolerance=0.5px"), "{text}");
}
