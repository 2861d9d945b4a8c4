//! The documentation against the program: every scene in it loads and builds, every message in it is
//! the program's own, and every field that the program accepts is in the reference, and no other.
//!
//! A scene is a block that opens with exactly "```toml". One whose first line is `# mistake` must be
//! refused, with the words of the "```text" block that follows it. Meshes and lists of transforms that
//! a sound scene names are made; those that a mistaken one names do not exist.
#![allow(missing_docs, reason = "a test program")]

use std::collections::BTreeSet;
use std::path::{Component, Path};

use alhazen::accel::AccelKind;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::light::Light;
use alhazen::scene::{Epsilon, ImageDesc, ObjectDesc, RenderSettings, Scene, SceneDesc, ShapeDesc};
use glam::DVec3;

const REFERENCE: &str = include_str!("../docs/scene.md");
const README: &str = include_str!("../README.md");

/// A fenced block of a page.
struct Block {
    /// What follows the opening fence.
    info: String,
    /// Line of the opening fence, from 1.
    line: usize,
    text: String,
}

fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut open: Option<Block> = None;
    for (line, text) in (1..).zip(page.lines()) {
        match (&mut open, text.trim().strip_prefix("```")) {
            (None, Some(info)) => {
                open = Some(Block { info: info.to_owned(), line, text: String::new() });
            }
            (Some(_), Some(_)) => blocks.extend(open.take()),
            (Some(block), None) => {
                block.text += text;
                block.text.push('\n');
            }
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a block is not closed");
    blocks
}

/// The least that is a file of this kind; none where `name` is no name of a file that scenes read.
fn content(name: &str) -> Option<&'static str> {
    let (_, extension) = name.rsplit_once('.')?;
    Some(match extension {
        "ply" => {
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
             0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
        }
        "obj" => "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "stl" => {
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
             endloop\nendfacet\nendsolid\n"
        }
        "csv" => {
            "# x, y, z and translation\n1,0,0,0, 0,1,0,0, 0,0,1,0\n\n1,0,0,3, 0,1,0,0, 0,0,1,0\n"
        }
        _ => return None,
    })
}

/// Makes the files that a scene names in quotes.
fn make_files(folder: &Path, scene: &str) {
    for name in scene.lines().flat_map(|line| line.split('"')) {
        let Some(content) = content(name) else { continue };
        let path = Path::new(name);
        let is_inside = path.components().all(|c| matches!(c, Component::Normal(_)));
        assert!(is_inside, "`{name}` would be outside the test's folder");
        let path = folder.join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
}

/// Loads and builds a scene called scene.toml. The error is every mistake, a line each.
fn try_scene(text: &str, with_files: bool) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    if with_files {
        make_files(folder.path(), text);
    }
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    try_file(folder.path(), "scene.toml", &LoadOptions::default())
}

/// Loads and builds the scene `name` in `folder`.
fn try_file(folder: &Path, name: &str, options: &LoadOptions) -> Result<(), String> {
    let result = match load_scene(&folder.join(name), options) {
        Err(error) => Err(error.to_string()),
        Ok(loaded) => Scene::build_quietly(loaded.scene, AccelKind::Brute)
            .map(drop)
            .map_err(|errors| errors.iter().map(|e| format!("{e}\n")).collect()),
    };
    result.map_err(|text: String| text.replace(&format!("{}/", folder.display()), ""))
}

#[test]
fn every_scene_loads_and_every_mistake_is_told_as_documented() {
    let mut scenes = 0;
    let mut faults = String::new();
    for (page, text) in [("docs/scene.md", REFERENCE), ("README.md", README)] {
        let blocks = blocks(text);
        for (i, block) in blocks.iter().enumerate().filter(|(_, b)| b.info == "toml") {
            scenes += 1;
            let at = format!("{page}:{}", block.line);
            let is_mistake = block.text.lines().next() == Some("# mistake");
            match try_scene(&block.text, !is_mistake) {
                Ok(()) if is_mistake => faults += &format!("{at}: loads, but should not\n"),
                Ok(()) => {}
                Err(error) if !is_mistake => faults += &format!("{at}: {error}\n"),
                Err(error) => {
                    let expected = blocks.get(i + 1).filter(|b| b.info == "text");
                    let expected = expected.map_or("(no text block follows)", |b| &b.text);
                    if error.trim() != expected.trim() {
                        faults += &format!("{at}: the program says\n{error}\nnot\n{expected}\n");
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "\n{faults}");
    assert!(scenes >= 20, "only {scenes} scenes were found");
}

/// The words of a line as a shell sees them, as far as our examples need it.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut is_quoted = false;
    for c in line.chars() {
        match c {
            '\'' => is_quoted = !is_quoted,
            ' ' if !is_quoted => words.push(String::new()),
            c => words.last_mut().unwrap().push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[test]
fn every_set_on_a_command_line_fits_the_first_scene() {
    let blocks = blocks(REFERENCE);
    let scene = blocks.iter().find(|b| b.info == "toml").unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), &scene.text).unwrap();
    make_files(folder.path(), "\"bunny.ply\"");
    let lines = blocks.iter().filter(|b| b.info == "sh").flat_map(|b| b.text.lines());
    let mut count = 0;
    for line in lines {
        let words = words(line);
        let values = words.windows(2).filter(|pair| pair[0] == "--set");
        let set: Vec<String> = values.map(|pair| pair[1].clone()).collect();
        count += set.len();
        let options = LoadOptions { set, camera: None };
        try_file(folder.path(), &words[2], &options).unwrap_or_else(|e| panic!("{line}: {e}"));
    }
    assert!(count >= 5, "only {count} were found");

    let options = LoadOptions { set: vec!["camera.fvo=30".into()], camera: None };
    let error = try_file(folder.path(), "scene.toml", &options).unwrap_err();
    assert!(section(" Mistakes").contains(&format!("\n{error}\n")), "not documented: {error}");
}

/// The text below a heading, as far as the next one of any level.
fn section(heading: &str) -> String {
    let mut lines = REFERENCE.lines().skip_while(|line| line.trim_start_matches('#') != heading);
    assert!(lines.next().is_some(), "no heading `{heading}`");
    let is_heading = |line: &&str| line.starts_with("##");
    lines.take_while(|line| !is_heading(line)).map(|line| format!("{line}\n")).collect()
}

/// What the rows of the tables in a section are about: "| `fov` | …" and "| [`[image]`](…) | …".
fn documented(heading: &str) -> BTreeSet<String> {
    let rows = section(heading);
    let names = rows.lines().filter_map(|row| {
        let cell = row.strip_prefix("| ")?.trim_start_matches('[');
        let name = cell.strip_prefix('`')?.split_once('`')?.0;
        name.trim_start_matches('[').split(['.', ']']).next()
    });
    names.map(str::to_owned).collect()
}

/// What the program says would be accepted in the place of `zzz`.
fn accepted(scene: &str) -> BTreeSet<String> {
    let error = try_scene(scene, true).expect_err(scene);
    let line = error.lines().find(|line| line.contains("`zzz`")).unwrap_or_else(|| {
        panic!("not told that zzz is unknown, but: {error}\nin\n{scene}");
    });
    let (_, list) = line.rsplit_once("accepted: ").unwrap_or_else(|| panic!("no list in: {line}"));
    list.split(", ").map(str::to_owned).collect()
}

#[test]
fn the_reference_has_every_field_and_no_other() {
    let object = |rest: &str| format!("[[objects]]\nzzz = 1\n{rest}");
    for (headings, scenes) in [
        (&[" The tables"][..], vec!["[zzz]".to_owned()]),
        (&[" `[image]`"], vec!["[image]\nzzz = 1".into()]),
        (
            &[" `[camera]` and `[cameras.NAME]`"],
            vec![
                "[camera]\nzzz = 1".into(),
                "[cameras.a]\nprojection = \"orthographic\"\nzzz = 1".into(),
            ],
        ),
        (&[" `[render]`"], vec!["[render]\nzzz = 1".into()]),
        (&[" `[ambient]`"], vec!["[ambient]\nzzz = 1".into()]),
        (&[" `diffuse`"], vec!["[materials.a]\ntype = \"diffuse\"\nzzz = 1".into()]),
        (&[" `phong`"], vec!["[materials.a]\ntype = \"phong\"\nzzz = 1".into()]),
        (&[" `[[objects]]`", " Sphere"], vec![object("shape = \"sphere\"")]),
        (&[" `[[objects]]`", " Triangle"], vec![object("shape = \"triangle\"")]),
        (&[" `[[objects]]`", " Mesh in the scene file"], vec![object("shape = \"mesh\"")]),
        (&[" `[[objects]]`", " Mesh from a file"], vec![object("mesh = \"a.ply\"")]),
        (&[" `[[objects]]`", " Instance"], vec![object("instance = \"a\"")]),
        (&[" Transforms"], vec!["[camera]\ntransform = [{ zzz = 1 }]".into()]),
        (&[" `[prototypes.NAME]`"], vec!["[prototypes.a]\nzzz = 1".into()]),
        (&[" `point`"], vec!["[[lights]]\ntype = \"point\"\nzzz = 1".into()]),
        (&[" `directional`"], vec!["[[lights]]\ntype = \"directional\"\nzzz = 1".into()]),
    ] {
        let documented: BTreeSet<String> = headings.iter().flat_map(|h| documented(h)).collect();
        let accepted: BTreeSet<String> = scenes.iter().flat_map(|s| accepted(s)).collect();
        // Of the formats of mesh files there is a table too.
        let documented: BTreeSet<String> =
            documented.into_iter().filter(|name| !name.is_empty()).collect();
        assert_eq!(documented, accepted, "documented, and accepted, under {headings:?}");
    }
}

#[test]
fn the_reference_has_every_choice() {
    for (heading, scene) in [
        (" `[camera]` and `[cameras.NAME]`", "[camera]\nprojection = \"zzz\""),
        (" `[render]`", "[render]\nintegrator = \"zzz\""),
        (" `[render]`", "[render]\nprecision = \"zzz\""),
        (" `[render]`", "[render]\nbuild_quality = \"zzz\""),
        (" Filters", "[render]\nfilter = \"zzz\""),
        (" `phong`", "[materials.a]\ntype = \"phong\"\nmodel = \"zzz\""),
        (" `point`", "[[lights]]\ntype = \"point\"\nfalloff = \"zzz\""),
    ] {
        let section = section(heading);
        for choice in accepted(scene) {
            assert!(section.contains(&format!("\"{choice}\"")), "{heading} lacks \"{choice}\"");
        }
    }
}

#[test]
fn the_reference_has_the_defaults() {
    let settings = RenderSettings::default();
    let choice = |name: &str| format!("\"{name}\"");
    let [width, height] = ImageDesc::default().size;
    for (heading, field, default) in [
        (" `[image]`", "size", format!("[{width}, {height}]")),
        (" `[render]`", "integrator", choice(settings.integrator.name())),
        (" `[render]`", "samples", settings.samples.to_string()),
        (" `[render]`", "max_depth", settings.max_depth.to_string()),
        (" `[render]`", "shadows", settings.shadows.to_string()),
        (" `[render]`", "filter", choice(settings.filter.name())),
        (" `[render]`", "precision", choice(settings.precision.name())),
        (" `[render]`", "build_quality", choice(settings.build_quality.name())),
        (" `[render]`", "epsilon", choice("auto")),
    ] {
        let section = section(heading);
        let start = format!("| `{field}` |");
        let row = section.lines().find(|row| row.starts_with(&start)).unwrap();
        let cell = row.split(" | ").nth(2).unwrap();
        assert_eq!(cell, format!("`{default}`"), "{heading} {field}");
    }
    assert_eq!(settings.epsilon, Epsilon::Auto);
}

#[test]
fn the_reference_has_the_automatic_light() {
    let sphere = ShapeDesc::Sphere { center: DVec3::ZERO, radius: 1.0 };
    let objects = vec![ObjectDesc::new(sphere, None)];
    let desc = SceneDesc { objects, ..SceneDesc::default() };
    let scene = Scene::build_quietly(desc, AccelKind::Brute).unwrap();
    let lights = scene.lights.iter().map(|light| match light {
        Light::Directional(light) => light.irradiance.r,
        _ => panic!("the reference speaks of parallel light"),
    });
    let text = section(" Automatic lighting");
    for number in lights.chain([scene.ambient.r, scene.background.r]) {
        let mut words = text.split_whitespace().map(|word| word.trim_end_matches([',', '.']));
        assert!(words.any(|word| word == number.to_string()), "{number} is not in: {text}");
    }
    let image = section(" `[image]`");
    assert!(image.contains(&format!("grey, {}, in", scene.background.r)), "the background");
}
