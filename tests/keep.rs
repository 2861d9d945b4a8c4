//! That no work is lost: checkpoints, kills, parts and merging, and files that cannot be written.
#![allow(missing_docs, clippy::print_stderr, reason = "a test program")]

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

mod common;
use common::{alhazen, stderr, stdout, verify};

/// Soft shadows of a large lamp.
const SCENE: &str = r#"
[image]
size = [150, 101]
[render]
samples = 60
[camera]
eye = [0, 2, 6]
target = [0, 0.5, 0]
[materials.grey]
type = "diffuse"
reflectance = 0.6
[[objects]]
shape = "sphere"
center = [0, 0.8, 0]
radius = 0.8
material = "grey"
[[objects]]
shape = "plane"
point = [0, 0, 0]
normal = [0, 1, 0]
material = "grey"
[[lights]]
type = "disk"
center = [2, 5, 2]
normal = [-0.3, -1, -0.3]
radius = 1.5
radiance = 6
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

/// Renders with these further arguments, which must go well.
fn render(folder: &Path, arguments: &str) -> String {
    let all: Vec<&str> = ["render", "scene.toml"].into_iter().chain(arguments.split(' ')).collect();
    let output = alhazen(folder, &all);
    assert!(output.status.success(), "{arguments}: {}", stderr(&output));
    stdout(&output)
}

/// The message of a command that must be refused.
fn refused(folder: &Path, arguments: &str) -> String {
    let output = alhazen(folder, &arguments.split(' ').collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(2), "{arguments}: {}", stderr(&output));
    stderr(&output)
}

fn same(folder: &Path, a: &str, b: &str) {
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert!(read(a) == read(b), "{a} and {b} differ");
}

fn start(folder: &Path, arguments: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_alhazen"))
        .args(["render", "scene.toml"].into_iter().chain(arguments.split(' ')))
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits until a file is there.
fn wait_for(path: &Path, child: &mut Child) {
    let start = Instant::now();
    while !path.exists() && child.try_wait().unwrap().is_none() {
        assert!(start.elapsed() < Duration::from_secs(60), "{} does not come", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn parts_on_any_threads_merge_to_the_same_file() {
    let folder = folder();
    let folder = folder.path();
    for (name, threads) in [("one", 1), ("two", 2), ("seven", 7)] {
        render(folder, &format!("-q -o {name}.exr --threads {threads}"));
    }
    same(folder, "one.exr", "two.exr");
    same(folder, "one.exr", "seven.exr");
    for part in 1..=5 {
        render(folder, &format!("-q --part {part}/5 --threads {}", part % 3 + 1));
    }
    let parts: Vec<String> = [3, 1, 5, 2, 4].map(|k| format!("scene.part{k}of5.exr")).into();
    let mut arguments = vec!["merge", "-q", "-o", "merged.exr", "-o", "merged.png"];
    arguments.extend(parts.iter().map(String::as_str));
    let output = alhazen(folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    same(folder, "one.exr", "merged.exr");
    // So do layers.
    render(folder, "-q -o layers.exr --layers all");
    for part in 1..=3 {
        render(folder, &format!("-q --part {part}/3 -o l{part}.exr --layers all"));
    }
    let output = alhazen(folder, &["merge", "l3.exr", "l1.exr", "l2.exr", "-q", "-o", "all.exr"]);
    assert!(output.status.success(), "{}", stderr(&output));
    same(folder, "layers.exr", "all.exr");
    // Crops keep their window.
    render(folder, "-q -o crop.exr --crop 31,7,90,64");
    for part in 1..=2 {
        render(folder, &format!("-q --part {part}/2 -o crop{part}.exr --crop 31,7,90,64"));
    }
    let output = alhazen(folder, &["merge", "crop2.exr", "crop1.exr", "-q", "-o", "crops.exr"]);
    assert!(output.status.success(), "{}", stderr(&output));
    same(folder, "crop.exr", "crops.exr");
}

#[test]
fn merge_refuses_what_does_not_belong_together() {
    let folder = folder();
    let folder = folder.path();
    for part in 1..=3 {
        render(folder, &format!("-q --part {part}/3 -o p{part}.exr"));
    }
    let merge = |parts: &str| refused(folder, &format!("merge -o out.exr {parts}"));
    assert!(merge("p1.exr p3.exr").contains("parts are missing: 2/3 (samples 20 to 39)"));
    assert!(merge("p1.exr p2.exr p3.exr p2.exr").contains("a part is given twice"));
    assert!(merge("p1.exr scene.toml").contains("scene.toml: not an EXR file"));
    for (other, named) in [
        ("--seed 1", "alhazen.seed is `0` in p1.exr and `1` in other.exr"),
        ("--set camera.fov=41", "alhazen.scene is"),
        ("--size 80x50", "alhazen.scene is"),
        ("--samples 61", "alhazen.partOf is `60` in p1.exr and `61` in other.exr"),
        ("--accel bvh", "alhazen.accel is"),
        ("--crop 0,0,50,50", "other.exr: is of another size or crop than p1.exr"),
    ] {
        if !cfg!(feature = "embree") && other == "--accel bvh" {
            // There it is the default.
            continue;
        }
        render(folder, &format!("-q --part 2/3 -o other.exr {other}"));
        let message = merge("p1.exr other.exr p3.exr");
        assert!(message.contains(named), "{other}: {message}");
    }
    render(folder, "-q -o whole.exr");
    assert!(merge("whole.exr").contains("whole.exr: not a part or checkpoint of a render"));
    assert!(!folder.join("out.exr").exists());
    assert!(refused(folder, "render scene.toml --part 3/2").contains("K from 1 to N"));
    assert!(refused(folder, "render scene.toml --part 1/61").contains("at most 60 parts"));
    assert!(refused(folder, "render scene.toml --part 1/2 -o a.png").contains("single .exr"));
}

#[test]
fn broken_states_are_errors() {
    let folder = folder();
    let folder = folder.path();
    render(folder, "-q --size 16x16 --part 1/2 -o part.exr");
    let whole = std::fs::read(folder.join("part.exr")).unwrap();
    // Cut short, and with single bytes changed all over.
    let mut broken: Vec<Vec<u8>> = (1..8).map(|i| whole[..whole.len() * i / 8].to_vec()).collect();
    for at in (8..whole.len()).step_by(whole.len() / 60) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0xff;
        broken.push(bytes);
    }
    for bytes in broken {
        std::fs::write(folder.join("broken.exr"), bytes).unwrap();
        // A changed value may go unseen; then the other part is missing.
        let message = refused(folder, "merge -o out.exr broken.exr");
        assert!(message.contains("broken.exr") || message.contains("missing"), "{message}");
    }
}

#[test]
fn kills_lose_nothing_but_time() {
    let kills = if verify() { 30 } else { 3 };
    // Stops by the number of samples and by the error are the same as without a pause.
    for rule in ["--samples 600 --layers all", "--samples 100000 --error 0.8%"] {
        let folder = folder();
        let folder = folder.path();
        render(folder, &format!("-q -o whole.exr {rule}"));
        let arguments = format!("-q -o killed.exr {rule} --checkpoint 0.05s --resume");
        let mut kept = 0;
        for kill in 0..kills {
            let mut child = start(folder, &arguments);
            // Some before the first checkpoint, most at any moment after one.
            let wait = 37 * (kill * kill + 3 * kill) % 400;
            std::thread::sleep(Duration::from_millis(wait));
            if child.try_wait().unwrap().is_some() {
                // It came to its end: from the start again.
                std::fs::remove_file(folder.join("killed.exr")).unwrap();
                continue;
            }
            if kill % 3 == 2 {
                wait_for(&folder.join("killed.checkpoint.exr"), &mut child);
            }
            child.kill().unwrap();
            child.wait().unwrap();
            kept += u32::from(folder.join("killed.checkpoint.exr").exists());
        }
        assert!(kept > 0, "no kill came after a checkpoint");
        render(folder, &arguments);
        same(folder, "whole.exr", "killed.exr");
        assert!(!folder.join("killed.checkpoint.exr").exists(), "it is of no more use");
    }
}

#[test]
fn an_interrupted_render_says_how_to_go_on() {
    for signal in ["INT", "TERM"] {
        let folder = folder();
        let folder = folder.path();
        render(folder, "-q -o whole.exr --samples 900");
        let mut child = start(folder, "-q -o out.exr --samples 900 --checkpoint 0.05s");
        wait_for(&folder.join("out.checkpoint.exr"), &mut child);
        let pid = child.id().to_string();
        assert!(Command::new("kill").args(["-s", signal, &pid]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let message = stderr(&output);
        if output.status.success() {
            // It was done before the signal came.
            same(folder, "whole.exr", "out.exr");
            continue;
        }
        assert_eq!(output.status.code(), Some(130), "{message}");
        assert!(message.contains("to go on:") && message.contains("--resume"), "{message}");
        // The picture so far is valid.
        let compared = alhazen(folder, &["compare", "out.exr", "whole.exr"]);
        assert!(compared.status.success(), "{}", stderr(&compared));
        // Another render's checkpoint is refused, and stays.
        let message =
            refused(folder, "render scene.toml -o out.exr --samples 900 --resume --seed 2");
        assert!(message.contains("alhazen.seed is `0` in out.checkpoint.exr"), "{message}");
        let said = render(folder, "-o out.exr --samples 900 --resume");
        assert!(said.contains("goes on"), "{said}");
        same(folder, "whole.exr", "out.exr");
    }
}

/// The file of a part is whole or not there, so that a job that is requeued can go by it.
#[test]
fn an_interrupted_part_leaves_a_checkpoint_alone() {
    let folder = folder();
    let folder = folder.path();
    render(folder, "-q -o whole.exr --part 1/2 --samples 1800");
    for arguments in ["", " --checkpoint 0.05s"] {
        let mut child =
            start(folder, &format!("-q -o out.exr --part 1/2 --samples 1800{arguments}"));
        std::thread::sleep(Duration::from_millis(400));
        let status = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
        assert!(status.unwrap().success());
        let code = child.wait().unwrap().code();
        if code == Some(0) {
            // It had been faster.
            std::fs::remove_file(folder.join("out.exr")).unwrap();
            continue;
        }
        assert_eq!(code, Some(130));
        assert!(!folder.join("out.exr").exists());
        assert!(folder.join("out.checkpoint.exr").exists());
        render(folder, "-q -o out.exr --part 1/2 --samples 1800 --resume");
        same(folder, "whole.exr", "out.exr");
        assert!(!folder.join("out.checkpoint.exr").exists());
        std::fs::remove_file(folder.join("out.exr")).unwrap();
    }
}

#[test]
fn more_samples_go_on_from_fewer() {
    let folder = folder();
    let folder = folder.path();
    render(folder, "-q -o whole.exr --samples 900");
    let mut child = start(folder, "-q -o out.exr --samples 600 --checkpoint 0.05s");
    wait_for(&folder.join("out.checkpoint.exr"), &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    // Of a pass that was to go further, only as far as is now asked for.
    let said = render(folder, "-o fewer.exr --samples 1");
    assert!(said.contains("1 sample per pixel"), "{said}");
    std::fs::copy(folder.join("out.checkpoint.exr"), folder.join("fewer.checkpoint.exr")).unwrap();
    let said = render(folder, "-o fewer.exr --samples 1 --resume");
    assert!(!said.contains("600 samples"), "{said}");
    let said = render(folder, "-o out.exr --samples 900 --resume");
    assert!(said.contains("900 samples per pixel"), "{said}");
    same(folder, "whole.exr", "out.exr");
}

#[test]
fn a_folder_that_vanishes_does_not_take_the_picture_along() {
    let folder = folder();
    let folder = folder.path();
    render(folder, "-q -o whole.exr --samples 900");
    std::fs::create_dir(folder.join("gone")).unwrap();
    std::fs::create_dir(folder.join("tmp")).unwrap();
    let child = Command::new(env!("CARGO_BIN_EXE_alhazen"))
        .args("render scene.toml -q -o gone/out.exr --samples 900".split(' '))
        .current_dir(folder)
        .env("TMPDIR", folder.join("tmp"))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(150));
    std::fs::remove_dir_all(folder.join("gone")).unwrap();
    let output = child.wait_with_output().unwrap();
    let message = stderr(&output);
    if output.status.code() == Some(2) {
        // It had not even begun.
        return;
    }
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("gone/out.exr: cannot"), "{message}");
    assert!(message.contains("the picture was written to"), "{message}");
    let rescued = std::fs::read_dir(folder.join("tmp")).unwrap().next().unwrap().unwrap().path();
    assert!(std::fs::read(rescued).unwrap() == std::fs::read(folder.join("whole.exr")).unwrap());
}

/// Runs a script of the shell in `folder`, where `disk` is a file system of its own of `kilobytes`, and
/// rescued pictures go to `tmp`; nothing, and a line that says so, where the system does not let us mount.
fn on_a_small_disk(folder: &Path, kilobytes: u32, script: &str) -> Option<Output> {
    let run = |script: &str| {
        Command::new("unshare")
            .args(["--map-root-user", "--mount", "sh", "-c", script])
            .current_dir(folder)
            .env("ALHAZEN", env!("CARGO_BIN_EXE_alhazen"))
            .env("TMPDIR", folder.join("tmp"))
            .output()
    };
    for name in ["disk", "tmp"] {
        std::fs::create_dir_all(folder.join(name)).unwrap();
    }
    let mount = format!("mount -t tmpfs -o size={kilobytes}k none disk");
    if !run(&mount).is_ok_and(|output| output.status.success()) {
        eprintln!("not run: no file systems may be mounted here");
        return None;
    }
    Some(run(&format!("{mount} && {script}")).unwrap())
}

/// The only file in `folder`.
fn only_file(folder: &Path) -> Vec<u8> {
    let files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    let [file] = files.as_slice() else { panic!("{files:?}") };
    std::fs::read(file).unwrap()
}

#[test]
fn a_full_disk_leaves_the_old_file_and_takes_no_work() {
    let folder = folder();
    let folder = folder.path();
    render(folder, "-q -o whole.exr --exr-compression none");
    render(folder, "-q -o part.exr --part 1/2");
    std::fs::write(folder.join("old.exr"), "the old picture").unwrap();
    for (arguments, whole) in [
        ("--exr-compression none", "whole.exr"),
        ("-o disk/out.png --exr-compression none", "whole.exr"),
        ("--part 1/2", "part.exr"),
    ] {
        let script = format!(
            "cp old.exr disk/out.exr; $ALHAZEN render scene.toml -q -o disk/out.exr {arguments}; \
             code=$?; cat disk/out.exr; ls disk | tr '\n' ' '; exit $code"
        );
        let Some(output) = on_a_small_disk(folder, 52, &script) else { return };
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments}: {message}");
        assert!(message.contains("disk/out.exr: cannot write: No space left"), "{message}");
        assert!(message.contains("the picture was written to"), "{message}");
        // The smaller picture beside it was written; of the other nothing is left.
        let files = if arguments.contains("png") { "out.exr out.png " } else { "out.exr " };
        assert_eq!(stdout(&output), format!("the old picture{files}"));
        let rescued = only_file(&folder.join("tmp"));
        assert!(rescued == std::fs::read(folder.join(whole)).unwrap(), "{arguments}");
        std::fs::remove_dir_all(folder.join("tmp")).unwrap();
    }
}

#[test]
fn a_disk_too_full_for_checkpoints_does_not_end_the_render() {
    let folder = folder();
    let folder = folder.path();
    render(folder, "-q -o whole.exr --samples 600");
    let script = "$ALHAZEN render scene.toml -q -o disk/out.exr --samples 600 --checkpoint 0.05s; \
                  code=$?; cp disk/out.exr .; ls disk | tr '\n' ' '; exit $code";
    let Some(output) = on_a_small_disk(folder, 120, script) else { return };
    assert!(output.status.success(), "{}", stderr(&output));
    let message = stderr(&output);
    assert!(message.contains("no checkpoint: disk/out.checkpoint.exr: cannot write"), "{message}");
    assert_eq!(stdout(&output), "out.exr ");
    same(folder, "whole.exr", "out.exr");
}

#[test]
fn a_read_only_folder_is_told_at_once_and_takes_no_work_later() {
    let folder = folder();
    let folder = folder.path();
    render(folder, "-q -o whole.exr --samples 900");
    std::fs::write(folder.join("old.exr"), "the old picture").unwrap();
    // Before the render.
    let script = "cp old.exr disk/out.exr; mount -o remount,ro disk; \
                  $ALHAZEN render scene.toml -q -o disk/out.exr; code=$?; cat disk/out.exr; exit $code";
    let Some(output) = on_a_small_disk(folder, 500, script) else { return };
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    let expected = "disk/out.exr: cannot create a file in its folder: Read-only file system";
    assert!(message.contains(expected), "{message}");
    assert_eq!(stdout(&output), "the old picture");
    // While it renders.
    let script = "cp old.exr disk/out.exr; \
                  $ALHAZEN render scene.toml -q -o disk/out.exr --samples 900 --checkpoint 0.02s & \
                  while ! [ -f disk/out.checkpoint.exr ]; do sleep 0.01; done; \
                  mount -o remount,ro disk || mount -o remount,ro disk || kill $!; \
                  wait $!; code=$?; cat disk/out.exr; exit $code";
    let Some(output) = on_a_small_disk(folder, 9000, script) else { return };
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("disk/out.exr: cannot"), "{message}");
    assert!(message.contains("the picture was written to"), "{message}");
    assert_eq!(stdout(&output), "the old picture");
    assert!(only_file(&folder.join("tmp")) == std::fs::read(folder.join("whole.exr")).unwrap());
}
