//! `alhazen bench`: what it prints, writes and refuses.
#![allow(missing_docs, reason = "a test program")]

use std::path::Path;

use serde_json::Value;

mod common;
use common::{alhazen, stderr, stdout};

/// Triangles, a shape and copies, so that everything is asked.
const SCENE: &str = r#"
[image]
size = [96, 64]
[camera]
eye = [0, 2, 6]
target = [0, 0, 0]
[[objects]]
shape = "sphere"
radius = 0.7
[[objects]]
shape = "mesh"
positions = [[-9, -1, -9], [9, -1, -9], [9, -1, 9], [-9, -1, 9]]
triangles = [[0, 2, 1], [0, 3, 2]]
[prototypes.pair]
objects = [
  { shape = "mesh", positions = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] },
  { shape = "sphere", center = [0.2, 0.2, 1.2], radius = 0.3 },
]
[[objects]]
instance = "pair"
transforms = [[1, 0, 0, 1.2, 0, 1, 0, -1, 0, 0, 1, 0], [1, 0, 0, -2.2, 0, 1, 0, -1, 0, 0, 1, 0]]
[[lights]]
type = "point"
position = [3, 4, 3]
intensity = 90
"#;

const QUICK: [&str; 6] = ["--seconds", "0.1", "--rounds", "3", "--threads", "2"];

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

fn bench(folder: &Path, arguments: &[&str]) -> (String, Value) {
    let mut all = vec!["bench", "scene.toml", "--json", "out.json"];
    all.extend(QUICK);
    all.extend(arguments);
    let output = alhazen(folder, &all);
    assert!(output.status.success(), "{}", stderr(&output));
    let text = std::fs::read_to_string(folder.join("out.json")).unwrap();
    (stdout(&output), serde_json::from_str(&text).unwrap())
}

fn rows(report: &Value) -> &Vec<Value> {
    report["rows"].as_array().unwrap()
}

#[test]
fn every_accelerator_is_measured_and_agrees() {
    let folder = folder();
    let (table, report) = bench(folder.path(), &["--html", "out.html"]);
    assert_eq!(report["primitives"], 8);
    assert_eq!(report["copies"], 2);
    assert_eq!(report["threads"], 2);
    assert_eq!(report["baseline"], rows(&report)[0]["name"]);
    let rays: Vec<u64> =
        report["rays"].as_array().unwrap().iter().map(|r| r["rays"].as_u64().unwrap()).collect();
    assert_eq!(rays[0], 96 * 64);
    assert!(rays[1..].iter().all(|&n| n > 1000 && n < rays[0]), "{rays:?}");

    let names: Vec<&str> = rows(&report).iter().map(|r| r["name"].as_str().unwrap()).collect();
    for name in ["octree", "bsp", "brute"] {
        assert!(names.contains(&name), "{names:?}");
    }
    #[cfg(feature = "embree")]
    assert_eq!(names[..2], ["embree", "embree packets"]);
    for row in rows(&report) {
        let name = row["name"].as_str().unwrap();
        assert!(table.contains(name), "{name} is not in\n{table}");
        if let Some(reason) = row["not_measured"].as_str() {
            // Other crates know triangles alone, and say so.
            assert!(table.contains(reason) && reason.contains("triangles"), "{reason}");
            continue;
        }
        let speeds = row["speeds"].as_array().unwrap();
        assert_eq!(speeds.len(), 8, "{name}: four kinds at one and two threads");
        for speed in speeds {
            assert!(speed["mrays"].as_f64().unwrap() > 0.0, "{name}: {speed}");
            assert!(speed["ratio"].as_f64().unwrap() > 0.0, "{name}: {speed}");
            assert!(speed["rays"].as_u64().unwrap() > 0, "{name}: {speed}");
        }
        for against in ["against_f64", "against_baseline"] {
            for compared in row[against].as_array().unwrap() {
                assert!(compared["rays"].as_u64().unwrap() > 0, "{name}: {compared}");
                for wrong in ["missing", "extra", "differing"] {
                    assert_eq!(compared[wrong], 0, "{name} {against}: {compared}");
                }
            }
        }
        let is_packets = name.ends_with("packets");
        assert_eq!(row["bytes"].is_null(), is_packets);
        let builds = if is_packets || name == "brute" { 0 } else { 2 };
        assert_eq!(row["builds"].as_array().unwrap().len(), builds, "{name}");
    }

    let page = std::fs::read_to_string(folder.path().join("out.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    assert_eq!(page.matches("<svg").count(), 6, "four kinds, build and memory");
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
    assert!(names.iter().all(|name| page.contains(name)));
    for outside in ["src=", "href=", "@import", "url("] {
        assert!(!page.contains(outside), "the page asks for something outside: {outside}");
    }
}

/// All names of fields, however deep.
fn keys(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                found.push(key.clone());
                keys(value, found);
            }
        }
        Value::Array(list) => list.iter().for_each(|value| keys(value, found)),
        _ => {}
    }
}

#[test]
fn every_field_is_documented() {
    let folder = folder();
    let (_, report) = bench(folder.path(), &["--accel", "bsp"]);
    let mut found = Vec::new();
    keys(&report, &mut found);
    assert!(found.iter().any(|key| key == "differing"), "{found:?}");
    let page = include_str!("../docs/bench.md");
    for key in found {
        assert!(page.contains(&format!("`{key}`")), "docs/bench.md does not name `{key}`");
    }
    for name in ["embree", "bsp", "octree", "brute", "obvhs-bvh2", "obvhs-cwbvh", "crate-bvh"] {
        assert!(page.contains(&format!("`{name}`")), "docs/bench.md does not name `{name}`");
    }
}

#[test]
fn rows_can_be_chosen() {
    let folder = folder();
    let (_, report) = bench(folder.path(), &["--accel", "bsp"]);
    let names: Vec<&str> = rows(&report).iter().map(|r| r["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"bsp") && !names.contains(&"octree"), "{names:?}");
    assert_eq!(report["baseline"], names[0], "it is measured even if it is not chosen");
}

#[test]
fn quiet_says_nothing() {
    let folder = folder();
    let (table, _) = bench(folder.path(), &["--quiet", "--accel", "bsp"]);
    assert_eq!(table, "");
}

fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = alhazen(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    stderr(&output)
}

#[test]
fn nothing_to_hit_is_said() {
    let folder = folder();
    std::fs::write(
        folder.path().join("empty.toml"),
        "[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n",
    )
    .unwrap();
    let message = refused(folder.path(), &["bench", "empty.toml"]);
    assert!(message.contains("nothing in the scene to hit"), "{message}");
    let away = ["bench", "scene.toml", "--set", "camera.target=[0, 9, 90]"];
    let message = refused(folder.path(), &away);
    assert!(message.contains("no ray of the camera hits anything"), "{message}");
}

#[test]
fn wrong_names_and_targets_are_refused_before_any_work() {
    let folder = folder();
    let message = refused(folder.path(), &["bench", "scene.toml", "--accel", "grid"]);
    assert!(message.contains("octree") && message.contains("bsp"), "{message}");
    let same = ["bench", "scene.toml", "--json", "x", "--html", "x"];
    assert!(refused(folder.path(), &same).contains("written twice"));
    let over = ["bench", "scene.toml", "--json", "scene.toml"];
    assert!(refused(folder.path(), &over).contains("over an input"));
    assert!(refused(folder.path(), &["bench", "missing.ply"]).contains("missing.ply"));
}
