//! `alhazen generate`: the file, what is said of it, and what is refused.
#![allow(missing_docs, reason = "a test program")]

mod common;
use common::{alhazen, stderr, stdout};

#[test]
fn same_seed_same_bytes_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let make = |name: &str, threads: &str, seed: &str| {
        let arguments =
            ["generate", "blobs", "-n", "60k", "--seed", seed, "--threads", threads, "-o", name];
        let output = alhazen(folder.path(), &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(stdout(&output).contains(" triangles, "), "{}", stdout(&output));
        std::fs::read(folder.path().join(name)).unwrap()
    };
    let one = make("a.ply", "1", "5");
    assert!(one == make("b.ply", "3", "5"));
    assert!(one != make("c.ply", "1", "6"));
    assert!(make("a.stl", "1", "5") == make("b.STL", "4", "5"));
}

#[test]
fn a_generated_mesh_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["generate", "terrain", "--triangles", "5k", "-o", "t.ply", "-q"][..],
        &["render", "t.ply", "--size", "32x18", "--samples", "1", "-o", "t.png", "-q"],
    ] {
        let output = alhazen(folder.path(), arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(stdout(&output).is_empty() && stderr(&output).is_empty());
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, expected) in [
        (&["hills", "-o", "a.ply"][..], "terrain, sphere, blobs, slivers, soup"),
        (&["terrain"], "--output <FILE>"),
        (&["terrain", "-n", "0", "-o", "a.ply"], "0 triangles are too few for `terrain`"),
        (&["blobs", "-n", "1k", "-o", "a.ply"], "the least is 1212"),
        (&["sphere", "-n", "5G", "-o", "a.ply"], "the most is 4294967294"),
        (&["soup", "-n", "ten", "-o", "a.ply"], "expected a number such as 500k or 10M"),
        (&["soup", "-o", "a.obj"], "a.obj: unknown kind of mesh; accepted: .ply, .stl"),
        (&["soup", "-o", "no/a.ply"], "no/a.ply: cannot create a file in its folder"),
        (&["soup", "-o", "/"], "unknown kind of mesh"),
    ] {
        let output = alhazen(folder.path(), &[&["generate"], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
