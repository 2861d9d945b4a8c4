//! Meshes that lie: one clear error, exit code 2, and no memory for what a file merely claims.
#![allow(missing_docs, clippy::print_stderr, reason = "a test program")]

use std::path::Path;
use std::process::{Command, Output};

mod common;
use common::{alhazen, stderr};

const VERTEX: &str = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const FACE: &str = "property list uint uint vertex_indices\nend_header\n";

/// Runs with 1 GB of address space: what a file claims is more.
fn limited(folder: &Path, arguments: &[&str]) -> Output {
    Command::new("sh")
        .args(["-c", "ulimit -v 1000000; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_alhazen")])
        .args(arguments)
        .env("RAYON_NUM_THREADS", "2")
        .current_dir(folder)
        .output()
        .unwrap()
}

fn binary(header: &str, body: &[u8]) -> Vec<u8> {
    let mut bytes = format!("ply\nformat binary_little_endian 1.0\n{header}").into_bytes();
    bytes.extend(body);
    bytes
}

/// The three vertices, and then `rest`.
fn three_vertices(rest: &[u8]) -> Vec<u8> {
    let xyz = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    xyz.iter().flat_map(|x| x.to_le_bytes()).chain(rest.iter().copied()).collect()
}

fn words(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|w| w.to_le_bytes()).collect()
}

#[test]
fn files_that_lie_are_told_and_take_no_memory() {
    let folder = tempfile::tempdir().unwrap();
    let faces = |n: u64| format!("{VERTEX}element face {n}\n{FACE}");
    let many_vertices = VERTEX.replace(" 3\n", " 4000000000\n");
    let stl = |n: u32| [&[b' '; 80][..], &n.to_le_bytes(), &[0; 50]].concat();
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("empty.ply", vec![], "the file is empty"),
        ("empty.obj", vec![], "the file is empty"),
        ("empty.stl", vec![], "the file is empty"),
        ("vertices.ply", binary(&format!("{many_vertices}end_header\n"), &[0; 99]), "too early"),
        ("faces.ply", binary(&faces(4_000_000_000), &three_vertices(&[0; 16])), "too early"),
        ("ids.ply", binary(&faces(u64::MAX), &three_vertices(&[0; 16])), "at most 4294967294"),
        (
            "list.ply",
            binary(&faces(1), &three_vertices(&words(&[4_000_000_000, 0, 1, 2]))),
            "too early",
        ),
        (
            "index.ply",
            binary(&faces(1), &three_vertices(&words(&[3, 0, 1, 3]))),
            "face 0 names vertex 3, but the number of vertices is 3",
        ),
        ("cut.ply", binary(&faces(2), &three_vertices(&words(&[3, 0, 1, 2, 3, 0]))), "too early"),
        ("many.stl", stl(4_000_000_000), "4000000000 triangles need 200000000084 bytes"),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nf 1 2 4000000000\n".to_vec(), "index.obj:3"),
        ("word.obj", b"v 0 0 zero\n".to_vec(), "word.obj:1"),
        (
            "facet.stl",
            b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 2\n".to_vec(),
            "facet.stl",
        ),
    ];
    for (name, bytes, expected) in cases {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let output = limited(folder.path(), &["render", name, "-o", "x.png"]);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{name}: {said}");
        assert!(said.contains(name) && said.contains(expected), "{name}: {said}");
        assert_eq!(said.lines().count(), 1, "{name}: {said}");
    }
}

#[test]
fn a_folder_is_no_mesh() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.ply", "a.obj", "a.stl"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
        let output = alhazen(folder.path(), &["render", name, "-o", "x.png"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains("not a regular file"), "{}", stderr(&output));
    }
}

#[test]
fn no_permission_is_told() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    std::fs::write(&path, "ply\n").unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o0)).unwrap();
    if std::fs::File::open(&path).is_ok() {
        eprintln!("not run: root may read everything");
        return;
    }
    let output = alhazen(folder.path(), &["render", "a.ply", "-o", "x.png"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("cannot open: Permission denied"), "{}", stderr(&output));
}

#[test]
fn triangles_that_are_not_finite_are_dropped_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 2 3 4\nf 1 3 4\n";
    std::fs::write(folder.path().join("a.obj"), mesh).unwrap();
    let object = |field: &str| format!("[[objects]]\nmesh = \"a.obj\"\n{field}");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("says_nothing.toml", &object(""));
    write("drop.toml", &object("non_finite = \"drop\""));
    write("refuse.toml", &object("non_finite = \"refuse\""));
    // The file is read once, whoever is first; each object decides for itself.
    write("both.toml", &(object("non_finite = \"drop\"\n") + &object("non_finite = \"refuse\"")));
    let refused = "a.obj: 2 triangles have a NaN or infinite coordinate; the first is triangle 1";
    let dropped = "2 triangles with a NaN or infinite coordinate were dropped";
    for (scene, flag, code, expected) in [
        ("a.obj", None, 0, dropped),
        ("a.obj", Some("refuse"), 2, refused),
        ("says_nothing.toml", None, 0, dropped),
        ("says_nothing.toml", Some("refuse"), 2, refused),
        ("drop.toml", Some("refuse"), 0, dropped),
        ("refuse.toml", None, 2, refused),
        ("refuse.toml", Some("drop"), 2, refused),
        ("both.toml", None, 2, refused),
    ] {
        let mut arguments =
            vec!["render", scene, "--size", "8x8", "--accel", "brute", "-o", "x.png"];
        arguments.extend(flag.into_iter().flat_map(|flag| ["--non-finite", flag]));
        let output = alhazen(folder.path(), &arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{scene} {flag:?}: {said}");
        assert!(said.contains(expected), "{scene} {flag:?}: {said}");
    }
}

#[test]
#[cfg(feature = "embree")]
fn compact_where_it_must_be_or_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let output = alhazen(folder.path(), arguments);
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
        (common::stdout(&output), stderr(&output))
    };
    run(&["generate", "sphere", "-n", "200k", "-o", "s.ply", "-q"]);
    // 200,000 triangles take 20 MB, or 14 MB compact.
    let told = "the hierarchy is compact";
    let render = ["render", "s.ply", "--size", "32x32", "--samples", "1", "-o", "x.png"];
    let with = |more: &[&str]| run(&[&render[..], more].concat()).1;
    assert!(!with(&[]).contains(told));
    assert!(with(&["--memory-limit", "16M"]).contains(told));
    assert!(!with(&["--compact", "--memory-limit", "16M"]).contains(told), "it was asked for");
    for (more, limit) in [(&[][..], "10M"), (&["--set", "render.compact=false"], "16M")] {
        let arguments = [&render[..], more, &["--memory-limit", limit]].concat();
        let output = alhazen(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains("is the limit"), "{}", stderr(&output));
    }
    let (text, _) = run(&["inspect", "s.ply", "--compact"]);
    assert!(text.contains("while it is built") && text.contains(", compact"), "{text}");
}
