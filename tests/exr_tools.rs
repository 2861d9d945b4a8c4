//! Our EXR files as other programs read them: OpenEXR's `exrheader`, OpenImageIO's `oiiotool` and
//! `idiff`, and Python's package `OpenEXR`, which `make test` installs.
#![allow(missing_docs, clippy::print_stderr, reason = "a test program")]

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

mod common;
use common::{alhazen, stderr};

fn tool(name: &str, arguments: &[&str], folder: &Path) -> String {
    let output = Command::new(name).args(arguments).current_dir(folder).output();
    let output =
        output.unwrap_or_else(|e| panic!("{name}: {e}; `scripts/setup.sh test` installs it"));
    assert!(output.status.success(), "{name} {arguments:?}: {}", stderr(&output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Lines that every tool must show, in its own spelling.
fn expect(text: &str, lines: &[&str]) {
    for line in lines {
        assert!(text.contains(line), "`{line}` is not in:\n{text}");
    }
}

/// The files as Python's package `OpenEXR` reads them (`tests/read_exr.py`), in their order; nothing,
/// and a line that says so, where set-up could not install it.
fn python(files: &[String], folder: &Path) -> Option<Vec<Value>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = root.join(".python/bin/python");
    if !python.exists() {
        eprintln!("not run: Python's package OpenEXR is not installed");
        return None;
    }
    let script = root.join("tests/read_exr.py");
    let mut arguments = vec![script.to_str().unwrap()];
    arguments.extend(files.iter().map(String::as_str));
    let lines = tool(python.to_str().unwrap(), &arguments, folder);
    Some(lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect())
}

fn folder_with_pictures() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scene = "
[image]
size = [96, 64]
background = [0.25, 0.5, 1.0]
[render]
samples = 8
epsilon = 0.001
[camera]
eye = [0, 1, 5]
target = [0, 0, 0]
[[objects]]
shape = \"sphere\"
radius = 1.0
[[lights]]
type = \"point\"
position = [3, 4, 3]
intensity = 90
";
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    for arguments in [
        &["-o", "half.exr"][..],
        &["-o", "float.exr", "--exr-type", "float", "--exr-compression", "piz"],
        &["-o", "crop.exr", "--crop", "10,20,50,60", "--exr-compression", "none"],
    ] {
        let mut all = vec!["render", "scene.toml", "--quiet", "--seed", "42"];
        all.extend(arguments);
        let output = alhazen(folder.path(), &all);
        assert!(output.status.success(), "{}", stderr(&output));
    }
    folder
}

#[test]
fn exrheader_reads_every_attribute() {
    let folder = folder_with_pictures();
    let header = |name| tool("exrheader", &[name], folder.path());
    let half = header("half.exr");
    expect(
        &half,
        &[
            "B, 16-bit floating-point",
            "G, 16-bit floating-point",
            "R, 16-bit floating-point",
            "compression (type compression): zip, multi-scanline blocks",
            "dataWindow (type box2i): (0 0) - (95 63)",
            "displayWindow (type box2i): (0 0) - (95 63)",
            "chromaticities (type chromaticities):",
            "alhazen.version (type string): \"0.1.0\"",
            "alhazen.seed (type string): \"42\"",
            "alhazen.samples (type int): 8",
            "alhazen.integrator (type string): \"whitted\"",
            "alhazen.filter (type string): \"blackman-harris\"",
            "alhazen.precision (type string): \"robust\"",
            "alhazen.bias (type string): \"precision=robust epsilon=0.001\"",
            "alhazen.accel (type string):",
            "alhazen.isa (type string):",
            "alhazen.packetWidth (type int):",
            "alhazen.origin (type v3f): (0 0 0)",
            "alhazen.scene (type string):",
            "alhazen.error (type double):",
            "software (type string): \"alhazen 0.1.0\"",
        ],
    );
    let float = header("float.exr");
    expect(&float, &["R, 32-bit floating-point", "compression (type compression): piz"]);
    let crop = header("crop.exr");
    expect(
        &crop,
        &[
            "dataWindow (type box2i): (10 20) - (49 59)",
            "displayWindow (type box2i): (0 0) - (95 63)",
            "compression (type compression): none",
        ],
    );
}

#[test]
fn oiiotool_reads_the_same() {
    let folder = folder_with_pictures();
    let info = |name| tool("oiiotool", &["--info", "-v", "--stats", name], folder.path());
    let half = info("half.exr");
    expect(
        &half,
        &[
            "96 x   64, 3 channel, half openexr",
            "channel list: R, G, B",
            "compression: \"zip\"",
            "alhazen.version: \"0.1.0\"",
            "alhazen.seed: \"42\"",
            "alhazen.samples: 8",
            "alhazen.integrator: \"whitted\"",
            "alhazen.filter: \"blackman-harris\"",
            "alhazen.bias: \"precision=robust epsilon=0.001\"",
            "alhazen.origin: 0, 0, 0",
            "alhazen.error:",
            "Stats FiniteCount: 6144 6144 6144",
        ],
    );
    expect(&info("float.exr"), &["96 x   64, 3 channel, float openexr", "compression: \"piz\""]);
    let crop = info("crop.exr");
    expect(
        &crop,
        &[
            "40 x   40, 3 channel, half openexr",
            "pixel data origin: x=10, y=20",
            "full/display size: 96 x 64",
        ],
    );
}

#[test]
fn the_values_are_ours() {
    let folder = folder_with_pictures();
    // A corner of the background: the values of the scene file.
    tool("oiiotool", &["half.exr", "--cut", "1x1+0+0", "-o", "corner.exr"], folder.path());
    let corner = tool("oiiotool", &["--info", "--stats", "corner.exr"], folder.path());
    expect(&corner, &["Stats Min: 0.250000 0.500000 1.000000"]);
    // Half and float differ by half's rounding alone.
    let difference = tool(
        "oiiotool",
        &["half.exr", "float.exr", "--warn", "0.002", "--fail", "0.002", "--diff"],
        folder.path(),
    );
    assert!(difference.contains("PASS"), "{difference}");
}

/// Every kind of file is read by others as it was meant, and unchanged where nothing is lost.
#[test]
fn every_layout_compression_and_type_is_read() {
    let folder = folder_with_pictures();
    let render = |name: &str, arguments: &str| {
        let all = "render scene.toml --quiet --seed 42 --layers depth,crypto_object -o";
        let all: Vec<&str> = all.split(' ').chain([name]).chain(arguments.split(' ')).collect();
        let output = alhazen(folder.path(), &all);
        assert!(output.status.success(), "{arguments}: {}", stderr(&output));
    };
    for kind in ["half", "float"] {
        render("plain.exr", &format!("--exr-type {kind} --exr-compression none"));
        for layout in ["scanline", "tiles"] {
            for (compression, called) in [
                ("none", "none"),
                ("rle", "run-length encoding"),
                ("zips", "zip, individual scanlines"),
                ("zip", "zip, multi-scanline blocks"),
                ("piz", "piz"),
                ("b44", "b44"),
                ("b44a", "b44a"),
            ] {
                let arguments = format!(
                    "--exr-type {kind} --exr-compression {compression} --exr-layout {layout}"
                );
                render("this.exr", &arguments);
                let header = tool("exrheader", &["this.exr"], folder.path());
                let bits = if kind == "half" { "16-bit" } else { "32-bit" };
                let tiles = if layout == "tiles" {
                    "tile size 64 by 64 pixels"
                } else {
                    "lineOrder (type lineOrder): increasing y"
                };
                expect(
                    &header,
                    &[
                        &format!("R, {bits} floating-point"),
                        "Z, 32-bit floating-point",
                        "CryptoObject00.R, 32-bit floating-point",
                        &format!("compression (type compression): {called}"),
                        "displayWindow (type box2i): (0 0) - (95 63)",
                        "alhazen.seed (type string): \"42\"",
                        tiles,
                    ],
                );
                // Both round halves, and nothing else.
                let is_lossy = compression.starts_with("b44") && kind == "half";
                let limit = if is_lossy { "0.15" } else { "0" };
                tool(
                    "idiff",
                    &["-fail", limit, "-warn", limit, "this.exr", "plain.exr"],
                    folder.path(),
                );
            }
        }
    }
}

#[test]
fn hdr_files_are_read_with_three_digits() {
    let folder = folder_with_pictures();
    let arguments = "render scene.toml --quiet --seed 42 -o out.hdr -o same.exr --exr-type float";
    let output = alhazen(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    assert!(output.status.success(), "{}", stderr(&output));
    let info = tool("oiiotool", &["--info", "-v", "out.hdr"], folder.path());
    expect(&info, &["96 x   64, 3 channel"]);
    // A step is 1/256 of the brightest channel at least, and the picture ends at about 1.5.
    tool("idiff", &["-fail", "0.012", "-warn", "0.012", "out.hdr", "same.exr"], folder.path());
}

/// Python's `OpenEXR` reads every kind of file: the types, windows and attributes that were meant, and
/// of lossless ones the same values.
#[test]
fn python_reads_every_kind() {
    let folder = folder_with_pictures();
    let mut files = Vec::new();
    let mut meant = Vec::new();
    for kind in ["half", "float"] {
        for layout in ["scanline", "tiles"] {
            for compression in ["none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a"] {
                let name = format!("{kind}-{layout}-{compression}.exr");
                let mut arguments = vec!["render", "scene.toml", "--quiet", "--seed", "42"];
                arguments.extend(["--crop", "10,20,61,60", "-o", &name, "--exr-type", kind]);
                arguments.extend(["--exr-layout", layout, "--exr-compression", compression]);
                if compression != "pxr24" {
                    arguments.extend(["--layers", "all"]);
                }
                let output = alhazen(folder.path(), &arguments);
                assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
                files.push(name);
                meant.push((kind, layout, compression));
            }
        }
    }
    let Some(read) = python(&files, folder.path()) else { return };
    assert_eq!(read.len(), files.len());
    for ((file, (kind, layout, compression)), name) in read.iter().zip(meant).zip(&files) {
        let header = &file["header"];
        let storage = if layout == "tiles" { "tiledimage" } else { "scanlineimage" };
        assert_eq!(header["type"], format!("Storage.{storage}"), "{name}");
        let called = if compression == "none" { "no" } else { compression }.to_uppercase();
        let called = format!("Compression.{called}_COMPRESSION");
        assert_eq!(header["compression"], called, "{name}");
        assert_eq!(header["dataWindow"], json!([[10, 20], [60, 59]]), "{name}");
        assert_eq!(header["displayWindow"], json!([[0, 0], [95, 63]]), "{name}");
        assert_eq!(header["alhazen.seed"], "42", "{name}");
        assert_eq!(header["alhazen.samples"], 8, "{name}");
        assert_eq!(header["alhazen.origin"], json!([0.0, 0.0, 0.0]), "{name}");
        let white: Vec<f64> = serde_json::from_value(header["chromaticities"].clone()).unwrap();
        assert!((white[6] - 0.3127).abs() < 1e-6 && (white[7] - 0.329).abs() < 1e-6, "{name}");
        if compression != "pxr24" {
            let attributes = header.as_object().unwrap();
            let mut mattes: Vec<_> = attributes
                .iter()
                .filter(|(key, _)| key.starts_with("cryptomatte/") && key.ends_with("/name"))
                .map(|(_, value)| value.as_str().unwrap())
                .collect();
            mattes.sort_unstable();
            assert_eq!(mattes, ["CryptoMaterial", "CryptoObject"], "{name}");
        }

        // The reference: the same type without compression, in scanlines.
        let plain = files.iter().position(|f| *f == format!("{kind}-scanline-none.exr")).unwrap();
        let plain = &read[plain]["channels"];
        let channels = file["channels"].as_object().unwrap();
        let colours = if kind == "half" { "PixelType.HALF" } else { "PixelType.FLOAT" };
        assert_eq!(channels["R"]["type"], colours, "{name}");
        if compression != "pxr24" {
            assert_eq!(channels.len(), plain.as_object().unwrap().len(), "{name}");
            assert_eq!(channels["Z"]["type"], "PixelType.FLOAT", "{name}");
        }
        for (channel, is) in channels {
            assert_eq!(is["size"], json!([51, 40]), "{name}: {channel}");
            assert_eq!(is["type"], plain[channel]["type"], "{name}: {channel}");
            let rounds_halves = compression.starts_with("b44");
            let is_half = is["type"] == "PixelType.HALF";
            if if is_half { rounds_halves } else { compression == "pxr24" } {
                let mean = |v: &Value| v["mean"].as_f64().unwrap();
                let (is, was) = (mean(is), mean(&plain[channel]));
                let limit = if is_half { 0.02 } else { 1e-4 };
                assert!((is - was).abs() <= limit * was.abs().max(1.0), "{name}: {channel}: {is}");
            } else {
                assert_eq!(is["checksum"], plain[channel]["checksum"], "{name}: {channel}");
            }
        }
    }
    // The corner that the crop begins with is the background, as the scene has it.
    for (channel, value) in [("R", 0.25), ("G", 0.5), ("B", 1.0)] {
        assert_eq!(read[0]["channels"][channel]["first"], value);
    }
}

/// What a part and a checkpoint hold is read by Python's `OpenEXR` like any other file: whole numbers
/// beside the picture, which a merged file no longer has.
#[test]
fn python_reads_parts_and_what_they_merge_to() {
    let folder = folder_with_pictures();
    let run = |line: &str| {
        let output = alhazen(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{line}: {}", stderr(&output));
    };
    run("render scene.toml --quiet --seed 42 --layers depth -o whole.exr");
    run("render scene.toml --quiet --seed 42 --layers depth --part 1/2 -o 1.exr");
    run("render scene.toml --quiet --seed 42 --layers depth --part 2/2 -o 2.exr");
    run("merge 1.exr 2.exr -o merged.exr --quiet");
    let files = ["whole.exr", "1.exr", "merged.exr"].map(str::to_owned);
    let Some(read) = python(&files, folder.path()) else { return };
    let [whole, part, merged] = &read[..] else { panic!("three files") };
    assert_eq!(whole, merged);
    assert_eq!(part["header"]["alhazen.part"], "1/2");
    let channels = part["channels"].as_object().unwrap();
    let states: Vec<_> = channels.iter().filter(|(name, _)| name.starts_with("state.")).collect();
    assert!(states.len() > 10);
    for (name, state) in states {
        assert_eq!(state["type"], "PixelType.UINT", "{name}");
    }
    assert!(merged["channels"].as_object().unwrap().keys().all(|name| !name.contains("state")));
}
