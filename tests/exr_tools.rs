//! Our EXR files as other programs read them: OpenEXR's `exrheader` and OpenImageIO's `oiiotool`,
//! which `make test` installs.
#![allow(missing_docs, reason = "a test program")]

use std::path::Path;
use std::process::Command;

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
