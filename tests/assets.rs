//! Pictures of real meshes, and what becomes of broken ones, through the program. Runs where the assets
//! are; says in one line that it did not where they are not.
#![allow(missing_docs, clippy::print_stderr, reason = "a test program")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

mod common;
use common::{assets, files, stderr, verify};

const MESHES: [&str; 3] = ["ply", "obj", "stl"];

/// Runs the program with a time limit and, by the kernel, an address space of 8 GB.
fn limited(arguments: &[&str], seconds: u64) -> Output {
    let script = "ulimit -v 8000000; exec \"$0\" \"$@\"";
    let mut child = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_alhazen")])
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(seconds) {
            child.kill().unwrap();
            panic!("{arguments:?} did not end within {seconds} s");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

fn in_parallel(paths: &[PathBuf], check: impl Fn(&Path) -> Option<String> + Sync) {
    let failures = Mutex::new(Vec::new());
    let next = std::sync::atomic::AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(path) =
                    paths.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed))
                {
                    if let Some(failure) = check(path) {
                        failures.lock().unwrap().push(format!("{}: {failure}", path.display()));
                    }
                }
            });
        }
    });
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Mean luminance and share of pixels that differ from the background, from a PNG of ours.
fn look_at(path: &Path) -> (f64, f64) {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    let background = &bytes[..3].to_owned();
    let n = bytes.len() / 3;
    let covered = bytes.chunks(3).filter(|p| p != background).count();
    let mean = bytes.iter().map(|&b| f64::from(b)).sum::<f64>() / bytes.len() as f64;
    (mean, covered as f64 / n as f64)
}

#[test]
fn every_mesh_gives_a_framed_lit_picture() {
    let Some(root) = assets() else { return };
    let mut meshes = files(&root.join("mesh"), &MESHES);
    if cfg!(not(feature = "embree")) {
        // Brute force is for small scenes.
        meshes.retain(|path| path.metadata().is_ok_and(|m| m.len() < 20_000));
    }
    assert!(meshes.len() > 40, "{}", meshes.len());
    let out = tempfile::tempdir().unwrap();
    let size = if verify() { "320x240" } else { "96x72" };
    in_parallel(&meshes, |path| {
        let name =
            format!("{:x}.png", xxhash_rust::xxh3::xxh3_64(path.to_string_lossy().as_bytes()));
        let png = out.path().join(name);
        let arguments =
            ["render", path.to_str()?, "-o", png.to_str()?, "--size", size, "--samples", "4"];
        let output = limited(&arguments, 60);
        let text = stderr(&output);
        if !output.status.success() {
            return Some(format!("{:?}: {text}", output.status));
        }
        // The corner shows the background, whatever the size.
        let (mean, covered) = look_at(&png);
        if text.contains("no triangle") {
            return (covered > 0.0).then(|| "a picture of nothing shows something".to_owned());
        }
        let framed = (0.02..0.98).contains(&covered);
        let lit = (30.0..230.0).contains(&mean);
        (!framed || !lit)
            .then(|| format!("mean {mean:.1}, {:.1} % covered: {text}", 100.0 * covered))
    });
}

#[test]
fn every_broken_mesh_is_told_or_rendered() {
    let Some(root) = assets() else { return };
    let meshes = files(&root.join("malformed"), &MESHES);
    assert!(meshes.len() > 20, "{}", meshes.len());
    let out = tempfile::tempdir().unwrap();
    in_parallel(&meshes, |path| {
        let name = path.file_name()?.to_string_lossy().into_owned() + ".png";
        let png = out.path().join(name);
        let arguments =
            ["render", path.to_str()?, "-o", png.to_str()?, "--size", "32x24", "--samples", "1"];
        let output = limited(&arguments, 10);
        let text = stderr(&output);
        match output.status.code() {
            Some(0) if png.exists() => None,
            // One clear error that names the file.
            Some(2) if text.lines().count() == 1 && text.contains(path.to_str()?) => {
                png.exists().then(|| "a picture in spite of the error".to_owned())
            }
            code => Some(format!("exit {code:?}: {text}")),
        }
    });
}

/// The main job on a real mesh: 1.5 million triangles, full HD.
#[test]
fn the_house_is_rendered() {
    let Some(root) = assets() else { return };
    let house = root.join("mesh/ply/victorian_house_1.5M.ply");
    let out = tempfile::tempdir().unwrap();
    let [exr, png, stats] = ["h.exr", "h.png", "h.json"].map(|n| out.path().join(n));
    let arguments = [
        "render",
        house.to_str().unwrap(),
        "-o",
        exr.to_str().unwrap(),
        "-o",
        png.to_str().unwrap(),
        "--stats",
        stats.to_str().unwrap(),
        "--size",
        "1920x1080",
        "--samples",
        "1",
    ];
    if cfg!(not(feature = "embree")) {
        eprintln!("not run: brute force is for small scenes");
        return;
    }
    let output = limited(&arguments, 120);
    assert!(output.status.success(), "{}", stderr(&output));
    let stats: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(stats).unwrap()).unwrap();
    assert_eq!(stats["rays"]["camera"], 1920 * 1080);
    // The file's arrays (30 MB), Embree's build peak (99 B a triangle), the film (24 MB), and what
    // the encoders need.
    let peak = stats["memory"]["peak_bytes"].as_u64().unwrap();
    assert!(peak < 300_000_000, "{peak}");
    let (mean, covered) = look_at(&png);
    assert!((0.3..0.95).contains(&covered) && mean > 60.0, "{mean} {covered}");
}
