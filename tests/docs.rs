//! The documentation against the program: every scene in it loads and builds, every message in it is
//! the program's own, and every field that the program accepts is in the reference, and no other.
//!
//! A scene is a block that opens with exactly "```toml". One whose first line is `# mistake` must be
//! refused, with the words of the "```text" block that follows it. Meshes, pictures and lists of
//! transforms that a sound scene names are made; those that a mistaken one names do not exist.
#![allow(missing_docs, reason = "a test program")]

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path};

use alhazen::accel::AccelKind;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::light::Light;
use alhazen::material::{GLASSES, METALS};
use alhazen::scene::{Epsilon, ImageDesc, ObjectDesc, RenderSettings, Scene, SceneDesc, ShapeDesc};
use glam::DVec3;

const SCENE: &str = include_str!("../docs/scene.md");

/// The pages of the reference.
const REFERENCE: [(&str, &str); 6] = [
    ("docs/scene.md", SCENE),
    ("docs/shapes.md", include_str!("../docs/shapes.md")),
    ("docs/freeform.md", include_str!("../docs/freeform.md")),
    ("docs/grids.md", include_str!("../docs/grids.md")),
    ("docs/materials.md", include_str!("../docs/materials.md")),
    ("docs/lights.md", include_str!("../docs/lights.md")),
];

/// Pages with scenes and links beside the reference.
const OTHERS: [(&str, &str); 7] = [
    ("docs/approximations.md", include_str!("../docs/approximations.md")),
    ("docs/output.md", include_str!("../docs/output.md")),
    ("docs/numerics.md", include_str!("../docs/numerics.md")),
    ("docs/trade.md", include_str!("../docs/trade.md")),
    ("docs/bench.md", include_str!("../docs/bench.md")),
    ("README.md", include_str!("../README.md")),
    ("docs/lecture.md", include_str!("../docs/lecture.md")),
];

fn pages() -> impl Iterator<Item = (&'static str, &'static str)> {
    REFERENCE.into_iter().chain(OTHERS)
}

/// Whether a mistake is one of what the program cannot do yet, but the reference promises.
fn is_unfinished(mistake: &str) -> bool {
    (mistake.ends_with(": stub") && mistake.contains(".png"))
        || (METALS.is_empty() && mistake.contains("unknown metal"))
        || (GLASSES.is_empty() && mistake.contains("unknown glass"))
}

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
fn content(name: &str) -> Option<Cow<'static, [u8]>> {
    let (_, extension) = name.rsplit_once('.')?;
    let text = match extension {
        "png" => return Some(picture().into()),
        "npy" => return Some(array().into()),
        // Of the one that is described.
        "raw" => return Some(vec![0; 64 * 32 * 16].into()),
        "ply" => {
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\nproperty float u\nproperty float v\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n\
             0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n"
        }
        "obj" => "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "stl" => {
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
             endloop\nendfacet\nendsolid\n"
        }
        "bpt" => {
            let points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n".repeat(4);
            return Some(format!("1\n3 3\n{points}").into_bytes().into());
        }
        "csv" => {
            "# x, y, z and translation\n1,0,0,0, 0,1,0,0, 0,0,1,0\n\n1,0,0,3, 0,1,0,0, 0,0,1,0\n"
        }
        _ => return None,
    };
    Some(text.as_bytes().into())
}

/// A `.npy` file of one cell.
fn array() -> Vec<u8> {
    let header = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 2), }\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend([0; 8]);
    bytes
}

/// A PNG of one pixel.
fn picture() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&[128, 128, 255]).unwrap();
    bytes
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
    for (page, text) in pages() {
        let blocks = blocks(text);
        for (i, block) in blocks.iter().enumerate().filter(|(_, b)| b.info == "toml") {
            scenes += 1;
            let at = format!("{page}:{}", block.line);
            let is_mistake = block.text.lines().next() == Some("# mistake");
            match try_scene(&block.text, !is_mistake) {
                Ok(()) if is_mistake => faults += &format!("{at}: loads, but should not\n"),
                Ok(()) => {}
                Err(error) if !is_mistake => {
                    let lines = error.lines().filter(|line| !is_unfinished(line));
                    lines.for_each(|line| faults += &format!("{at}: {line}\n"));
                }
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
    assert!(scenes >= 50, "only {scenes} scenes were found");
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
    let blocks = blocks(SCENE);
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
        let options = LoadOptions { set, ..LoadOptions::default() };
        try_file(folder.path(), &words[2], &options).unwrap_or_else(|e| panic!("{line}: {e}"));
    }
    assert!(count >= 5, "only {count} were found");

    let options = LoadOptions { set: vec!["camera.fvo=30".into()], ..LoadOptions::default() };
    let error = try_file(folder.path(), "scene.toml", &options).unwrap_err();
    assert!(section(" Mistakes").contains(&format!("\n{error}\n")), "not documented: {error}");
}

/// The text below a heading of any page, as far as the next one of any level.
fn section(heading: &str) -> String {
    let below = |(_, page): (_, &'static str)| {
        let mut lines = page.lines().skip_while(|line| line.trim_start_matches('#') != heading);
        lines.next().map(|_| lines)
    };
    let mut found = REFERENCE.into_iter().filter_map(below);
    let lines = found.next().unwrap_or_else(|| panic!("no heading `{heading}`"));
    assert!(found.next().is_none(), "several pages have the heading `{heading}`");
    let is_heading = |line: &&str| line.starts_with("##");
    lines.take_while(|line| !is_heading(line)).map(|line| format!("{line}\n")).collect()
}

/// The rows of the tables of fields in a section: name, type, default, meaning.
fn rows(heading: &str) -> Vec<[String; 4]> {
    let section = section(heading);
    let cells = section.lines().filter_map(|row| {
        let row = row.strip_prefix("| `")?.strip_suffix(" |")?;
        let cells: Vec<&str> = row.splitn(4, " | ").collect();
        let [name, kind, default, meaning] = cells.try_into().ok()?;
        let name = name.strip_suffix('`')?;
        Some([name, kind, default, meaning].map(str::to_owned))
    });
    cells.collect()
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

/// A material with a table in the place of a value.
fn within(kind: &str, name: &str, fields: &[impl AsRef<str>]) -> String {
    let fields: Vec<&str> = fields.iter().map(AsRef::as_ref).collect();
    format!("[materials.a]\ntype = \"{kind}\"\n{name} = {{ {} }}", fields.join(", "))
}

/// A texture of diffuse reflectance, with one more field.
fn texture(kind: &str, field: &str) -> String {
    within("diffuse", "reflectance", &[kind, field])
}

/// The headings of shapes that are called so in scene files.
const SHAPES: [&str; 10] = [
    " Sphere",
    " Box",
    " Cylinder",
    " Cone",
    " Torus",
    " Disk",
    " Plane",
    " Quadric",
    " Polygon",
    " Triangle",
];

const TEXTURES: [(&str, &str); 5] = [
    (" `image`", "image = \"a.png\""),
    (" `checker`", "checker = [0, 1]"),
    (" `noise`", "noise = [0, 1]"),
    (" `marble`", "marble = [0, 1]"),
    (" `gradient`", "gradient = [0, 1]"),
];

#[test]
fn the_reference_has_every_field_and_no_other() {
    let object = |rest: &str| format!("[[objects]]\nzzz = 1\n{rest}");
    let material = |kind: &str| format!("[materials.a]\ntype = \"{kind}\"\nzzz = 1");
    let light = |kind: &str| format!("[[lights]]\ntype = \"{kind}\"\nzzz = 1");
    let fog = |kind: &str| format!("[medium]\ntype = \"{kind}\"\nzzz = 1");
    let mut cases = vec![
        (vec![" The tables"], vec!["[zzz]".to_owned()]),
        (vec![" `[image]`"], vec!["[image]\nzzz = 1".into()]),
        (
            vec![" `[camera]` and `[cameras.NAME]`"],
            vec![
                "[camera]\nzzz = 1".into(),
                "[cameras.a]\nprojection = \"orthographic\"\nzzz = 1".into(),
            ],
        ),
        (vec![" `[render]`"], vec!["[render]\nzzz = 1".into()]),
        (vec![" `[ambient]`"], vec!["[ambient]\nzzz = 1".into()]),
        (vec![" `[[objects]]`", " Implicit surface"], vec![object("shape = \"implicit\"")]),
        (
            vec![" `[[objects]]`", " Patches"],
            vec![object("shape = \"patches\"\npoints = [[0, 0, 0]]")],
        ),
        (vec![" `[[objects]]`", " NURBS"], vec![object("shape = \"nurbs\"")]),
        (
            vec![" `[[objects]]`", " Subdivision"],
            vec![
                object("shape = \"subdivision\""),
                object("shape = \"subdivision\"\nfile = \"a.obj\""),
            ],
        ),
        (vec![" `[[objects]]`", " Mesh in the scene file"], vec![object("shape = \"mesh\"")]),
        (vec![" `[[objects]]`", " Mesh from a file"], vec![object("mesh = \"a.ply\"")]),
        (vec![" `[[objects]]`", " Instance"], vec![object("instance = \"a\"")]),
        (
            vec![" Strewn copies"],
            ["mesh = \"a.ply\"", "bounds = [[0, 0, 0], [1, 1, 1]]"]
                .map(|over| {
                    let scatter = format!("{{ count = 1, {over}, zzz = 1 }}");
                    format!("[[objects]]\ninstance = \"a\"\nscatter = {scatter}")
                })
                .to_vec(),
        ),
        (
            vec![" `[[objects]]`", " Isosurface", " Grid files"],
            vec![object("shape = \"isosurface\"\ngrid = \"a.raw\"")],
        ),
        (
            vec![" `[[volumes]]`", " Grid files"],
            vec!["[[volumes]]\ngrid = \"a.raw\"\nzzz = 1".into()],
        ),
        (vec![" Transfer functions"], vec!["[[volumes]]\ntransfer = [{ zzz = 1 }]".into()]),
        (vec![" Transforms"], vec!["[camera]\ntransform = [{ zzz = 1 }]".into()]),
        (vec![" `[prototypes.NAME]`"], vec!["[prototypes.a]\nzzz = 1".into()]),
        (vec![" Colour ramps"], vec![texture("noise = [{ zzz = 1 }]", "seed = 1")]),
    ];
    for heading in SHAPES {
        let shape = object(&format!("shape = \"{}\"", heading.trim().to_lowercase()));
        cases.push((vec![" `[[objects]]`", heading], vec![shape]));
    }
    for kind in ["diffuse", "phong", "mirror", "conductor", "dielectric"] {
        cases.push((vec![" `[materials.NAME]`", heading(kind)], vec![material(kind)]));
    }
    for kind in ["point", "spot", "directional", "rectangle", "disk", "sphere"] {
        cases.push((vec![heading(kind)], vec![light(kind)]));
    }
    for kind in ["fog", "height-fog", "distance-fog"] {
        cases.push((vec![heading(kind)], vec![fog(kind)]));
    }
    cases.push((vec![" Fresnel"], vec![within("mirror", "fresnel", &["zzz = 1"])]));
    for (heading, kind) in TEXTURES {
        cases.push((vec![heading], vec![texture(kind, "zzz = 1")]));
        let bump = within("diffuse", "bump", &[kind, "zzz = 1"]);
        cases.push((vec![heading, " Bumps"], vec![bump]));
    }
    let normals = within("diffuse", "normal_map", &["image = \"a.png\"", "zzz = 1"]);
    cases.push((vec![" `image`", " Normal maps"], vec![normals]));

    for (headings, scenes) in cases {
        let mut documented: BTreeSet<String> =
            headings.iter().flat_map(|h| documented(h)).collect();
        let accepted: BTreeSet<String> = scenes.iter().flat_map(|s| accepted(s)).collect();
        // Of the formats of mesh files, the choices of some fields and the laws there are tables too.
        documented.retain(|name| !name.is_empty() && !name.starts_with(['"', '{']));
        if headings.contains(&" Instance") {
            assert!(documented.remove("texture_transform"), "the table of all objects has it");
        }
        assert_eq!(documented, accepted, "documented, and accepted, under {headings:?}");
    }
}

/// The heading of a type of material, light or fog.
fn heading(kind: &str) -> &'static str {
    let heading = format!(" `{kind}`");
    let all = REFERENCE.iter().flat_map(|(_, page)| page.lines());
    let mut all =
        all.filter(|line| line.starts_with("##")).map(|line| line.trim_start_matches('#'));
    all.find(|h| *h == heading).unwrap_or_else(|| panic!("no heading `{heading}`"))
}

#[test]
fn the_reference_has_every_choice() {
    let texture = |choice: &str| texture("image = \"a.png\"", choice);
    let material = |rest: &str| format!("[materials.a]\ntype = {rest}");
    for (heading, scene) in [
        (" `[camera]` and `[cameras.NAME]`", "[camera]\nprojection = \"zzz\"".to_owned()),
        (" `[render]`", "[render]\nintegrator = \"zzz\"".into()),
        (" Integrators", "[render]\nintegrator = \"zzz\"".into()),
        (" `[render]`", "[render]\nshadows = \"zzz\"".into()),
        (" Shadows", "[render]\nshadows = \"zzz\"".into()),
        (" `[render]`", "[render]\nprecision = \"zzz\"".into()),
        (" `[render]`", "[render]\nbuild_quality = \"zzz\"".into()),
        (" Filters", "[render]\nfilter = \"zzz\"".into()),
        (" `[materials.NAME]`", material("\"zzz\"")),
        (" `phong`", material("\"phong\"\nmodel = \"zzz\"")),
        (" `phong`", material("\"phong\"\nfresnel = \"zzz\"")),
        (" `mirror`", material("\"mirror\"\nfresnel = \"zzz\"")),
        (" `conductor`", material("\"conductor\"\nmetal = \"gold\"\nfresnel = \"zzz\"")),
        (" `dielectric`", material("\"dielectric\"\nfresnel = \"zzz\"")),
        (" Fresnel", material("\"dielectric\"\nfresnel = \"zzz\"")),
        (" `image`", texture("color_space = \"zzz\"")),
        (" `image`", texture("mapping = \"zzz\"")),
        (" `image`", texture("wrap = \"zzz\"")),
        (" `image`", texture("filter = \"zzz\"")),
        (" `checker`", self::texture("checker = [0, 1]", "space = \"zzz\"")),
        (" `noise`", self::texture("noise = [0, 1]", "space = \"zzz\"")),
        (" `marble`", self::texture("marble = [0, 1]", "space = \"zzz\"")),
        (" `gradient`", self::texture("gradient = [0, 1]", "space = \"zzz\"")),
        (" `[[lights]]`", "[[lights]]\ntype = \"zzz\"".into()),
        (" `point`", "[[lights]]\ntype = \"point\"\nfalloff = \"zzz\"".into()),
        (" `[medium]`", "[medium]\ntype = \"zzz\"".into()),
        (" Isosurface", "[[objects]]\nshape = \"isosurface\"\nnormals = \"zzz\"".into()),
        (" Grid files", "[[volumes]]\ngrid = \"a.raw\"\nformat = \"zzz\"".into()),
        (" Grid files", "[[volumes]]\ngrid = \"a.raw\"\nbyte_order = \"zzz\"".into()),
    ] {
        let section = section(heading);
        for choice in accepted(&scene) {
            assert!(section.contains(&format!("\"{choice}\"")), "{heading} lacks \"{choice}\"");
        }
    }
}

#[test]
fn the_reference_has_every_metal_and_glass() {
    let (metals, glasses) = (section(" `conductor`"), section(" Dispersion"));
    for (metal, _) in METALS {
        assert!(metals.contains(&format!("`{}`", metal)), "lacks {}", metal);
    }
    for (name, _) in GLASSES {
        assert!(glasses.contains(&format!("`{name}`")), "lacks {name}");
    }
}

/// What a scene says, without the places of its lines.
fn said(text: &str) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    make_files(folder.path(), text);
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let loaded = load_scene(&path, &LoadOptions::default()).map_err(|e| e.to_string())?;
    Ok(format!("{:?}", loaded.scene).replace(&*folder.path().to_string_lossy(), ""))
}

/// A default that is written out changes nothing; what is required cannot be left out.
#[test]
fn the_defaults_are_those_of_the_program() {
    let lines = |lines: &[&str]| lines.iter().map(|&line| line.to_owned()).collect::<Vec<_>>();
    // Headings, what opens the table, and its required fields.
    let cases: Vec<(&str, &str, Vec<String>)> = vec![
        (" `[image]`", "[image]", vec![]),
        (" `[camera]` and `[cameras.NAME]`", "[camera]", lines(&["eye = [0, 0, 9]"])),
        (" `[render]`", "[render]", vec![]),
        (" `[ambient]`", "[ambient]", lines(&["radiance = 0.5"])),
        (" `[materials.NAME]`", "[materials.a]", lines(&["type = \"diffuse\""])),
        (" `diffuse`", "[materials.a]", lines(&["type = \"diffuse\""])),
        (" `phong`", "[materials.a]", lines(&["type = \"phong\"", "fresnel = \"exact\""])),
        (" `mirror`", "[materials.a]", lines(&["type = \"mirror\"", "fresnel = \"exact\""])),
        (" `conductor`", "[materials.a]", lines(&["type = \"conductor\"", "eta = 1", "k = 2"])),
        (" `dielectric`", "[materials.a]", lines(&["type = \"dielectric\""])),
        (" Sphere", "[[objects]]", lines(&["shape = \"sphere\"", "radius = 1"])),
        (
            " `point`",
            "[[lights]]",
            lines(&["type = \"point\"", "position = [0, 0, 0]", "intensity = 1"]),
        ),
        (
            " `spot`",
            "[[lights]]",
            lines(&[
                "type = \"spot\"",
                "position = [0, 0, 0]",
                "direction = [0, 1, 0]",
                "intensity = 1",
            ]),
        ),
        (
            " `directional`",
            "[[lights]]",
            lines(&["type = \"directional\"", "direction = [0, 1, 0]", "irradiance = 1"]),
        ),
        (
            " `rectangle`",
            "[[lights]]",
            lines(&[
                "type = \"rectangle\"",
                "corner = [0, 0, 0]",
                "edge_u = [1, 0, 0]",
                "edge_v = [0, 1, 0]",
                "radiance = 1",
            ]),
        ),
        (
            " `disk`",
            "[[lights]]",
            lines(&[
                "type = \"disk\"",
                "center = [0, 0, 0]",
                "normal = [0, 1, 0]",
                "radius = 1",
                "radiance = 1",
            ]),
        ),
        (
            " `sphere`",
            "[[lights]]",
            lines(&["type = \"sphere\"", "center = [0, 0, 0]", "radius = 1", "radiance = 1"]),
        ),
        (
            " Isosurface",
            "[[objects]]",
            lines(&[
                "shape = \"isosurface\"",
                "grid = \"a.npy\"",
                "bounds = [[0, 0, 0], [1, 1, 1]]",
                "level = 1",
            ]),
        ),
        (
            " Grid files",
            "[[objects]]",
            lines(&[
                "grid = \"a.raw\"",
                "size = [64, 32, 16]",
                "format = \"u8\"",
                "shape = \"isosurface\"",
                "bounds = [[0, 0, 0], [1, 1, 1]]",
                "level = 1",
            ]),
        ),
        (
            " `[[volumes]]`",
            "[[volumes]]",
            lines(&[
                "grid = \"a.npy\"",
                "bounds = [[0, 0, 0], [1, 1, 1]]",
                "transfer = [{ value = 0, extinction = 1 }]",
            ]),
        ),
        (" `fog`", "[medium]", lines(&["type = \"fog\"", "scattering = 1"])),
        (
            " `height-fog`",
            "[medium]",
            lines(&["type = \"height-fog\"", "absorption = 1", "height = 1"]),
        ),
        (" `distance-fog`", "[medium]", lines(&["type = \"distance-fog\"", "end = 9"])),
    ];
    for (heading, opening, required) in cases {
        let scene = |fields: &[String]| format!("{opening}\n{}\n", fields.join("\n"));
        check_defaults(heading, &required, scene);
    }
    // Of what stands within a line.
    let one = |field: &str| vec![field.to_owned()];
    for (heading, kind) in TEXTURES {
        if heading == " `image`" && !reads_images() {
            continue;
        }
        check_defaults(heading, &one(kind), |f| within("diffuse", "reflectance", f));
    }
    check_defaults(" Fresnel", &[], |f| within("mirror", "fresnel", f));
    let node = ["value = 1".to_owned(), "extinction = 1".to_owned()];
    check_defaults(" Transfer functions", &node, |f| {
        let rest = "grid = \"a.npy\"\nbounds = [[0, 0, 0], [1, 1, 1]]";
        format!("[[volumes]]\n{rest}\ntransfer = [{{ {} }}]", f.join(", "))
    });
    check_defaults(" Bumps", &one("noise = [0, 1]"), |f| within("diffuse", "bump", f));
    if reads_images() {
        let image = one("image = \"a.png\"");
        check_defaults(" Normal maps", &image, |f| within("diffuse", "normal_map", f));
    }
}

/// Whether the program can read pictures.
fn reads_images() -> bool {
    let scene = within("diffuse", "reflectance", &["image = \"a.png\""]);
    !said(&scene).is_err_and(|error| error.lines().all(is_unfinished))
}

fn check_defaults(heading: &str, required: &[String], scene: impl Fn(&[String]) -> String) {
    let base = said(&scene(required)).unwrap_or_else(|e| panic!("{heading}: {e}"));
    for [name, _, default, _] in rows(heading) {
        if default == "required" {
            let rest: Vec<String> =
                required.iter().filter(|f| !f.starts_with(&format!("{name} "))).cloned().collect();
            assert!(rest.len() < required.len(), "{heading}: `{name}` is not among the required");
            assert!(said(&scene(&rest)).is_err(), "{heading}: `{name}` can be left out");
            continue;
        }
        // "`0`; one of the two is required", "black".
        let Some((value, _)) = default.strip_prefix('`').and_then(|d| d.split_once('`')) else {
            continue;
        };
        if required.iter().any(|f| f.starts_with(&format!("{name} "))) || value == "eta" {
            continue;
        }
        let mut fields = required.to_vec();
        fields.push(format!("{name} = {value}"));
        match said(&scene(&fields)) {
            Ok(said) => assert!(said == base, "{heading}: `{name}` is not {value} by default"),
            Err(error) => panic!("{heading}: {error}"),
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
        (" `[render]`", "prune", settings.prune.to_string()),
        (" `[render]`", "roulette", settings.roulette.to_string()),
        (" `[render]`", "shadows", settings.shadows.are_cast().to_string()),
        (" `[render]`", "shadow_samples", settings.shadow_samples.to_string()),
        (" `[render]`", "light_samples", settings.light_samples.to_string()),
        (" `[render]`", "filter", choice(settings.filter.name())),
        (" `[render]`", "precision", choice(settings.precision.name())),
        (" `[render]`", "build_quality", choice(settings.build_quality.name())),
        (" `[render]`", "compact", choice("auto")),
        (" `[render]`", "tolerance", "0.5".into()),
        (" `[render]`", "epsilon", choice("auto")),
    ] {
        let section = section(heading);
        let start = format!("| `{field}` |");
        let row = section.lines().find(|row| row.starts_with(&start)).unwrap();
        let cell = row.split(" | ").nth(2).unwrap();
        assert_eq!(cell, format!("`{default}`"), "{heading} {field}");
    }
    assert_eq!(settings.epsilon, Epsilon::Auto);
    assert_eq!((settings.wavelength, settings.ao_distance), (None, None));
    assert_eq!(settings.texture_filter, None);
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

/// The anchors of a page's headings, as code hosts make them.
fn anchors(page: &str) -> BTreeSet<String> {
    let mut is_code = false;
    let mut anchors = BTreeSet::new();
    for line in page.lines() {
        is_code ^= line.trim_start().starts_with("```");
        let text = line.trim_start_matches('#');
        if is_code || text.len() == line.len() || !text.starts_with(' ') {
            continue;
        }
        let kept = text.trim().to_lowercase();
        let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        let anchor: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        assert!(anchors.insert(anchor.clone()), "two headings make the anchor {anchor}");
    }
    anchors
}

/// The targets of the links of a page, code left out.
fn links(page: &str) -> Vec<String> {
    let prose = page.split("```").step_by(2);
    let targets = prose.flat_map(|text| text.split("](").skip(1));
    targets.filter_map(|rest| Some(rest.split_once(')')?.0.to_owned())).collect()
}

#[test]
fn every_link_points_at_something() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let anchors: BTreeMap<&str, BTreeSet<String>> =
        pages().map(|(name, page)| (name, anchors(page))).collect();
    let mut known: BTreeSet<String> = anchors.keys().map(|&name| name.to_owned()).collect();
    // A page that was forgotten here would be checked by nobody.
    for entry in std::fs::read_dir(root.join("docs")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let is_page = name.ends_with(".md");
        assert!(!is_page || known.remove(&format!("docs/{name}")), "docs/{name} is not tested");
    }
    let (mut count, mut faults) = (0, String::new());
    for (name, page) in pages() {
        let folder = Path::new(name).parent().unwrap();
        for link in links(page).iter().filter(|link| !link.contains("://")) {
            count += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { Path::new(name).into() } else { folder.join(file) };
            let is_there = root.join(&target).exists();
            let has_anchor = anchor.is_empty()
                || anchors.get(target.to_str().unwrap()).is_some_and(|all| all.contains(anchor));
            if !(is_there && has_anchor) {
                faults += &format!("{name}: nothing is at {link}\n");
            }
        }
    }
    assert!(faults.is_empty(), "\n{faults}");
    assert!(count >= 80, "only {count} links were found");
}
