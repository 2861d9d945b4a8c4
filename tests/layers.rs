//! Layers beside the colours, against closed forms and against pictures of other scenes.
#![allow(missing_docs, reason = "a test program")]

use std::collections::HashMap;
use std::path::Path;
use std::process::Command;

use exr::prelude::{AttributeValue, read_first_flat_layer_from_file};

mod common;
use common::{alhazen, stderr};

/// A unit sphere in front of a plane, seen straight on; both mirror a little.
const SCENE: &str = r#"
[image]
size = [40, 32]
background = 0
[render]
samples = 16
[camera]
projection = "orthographic"
height = 3.2
eye = [0, 0, 10]
target = [0, 0, 0]
[materials.red]
type = "phong"
diffuse = [0.6, 0.1, 0.1]
mirror = 0.3
[materials.blue]
type = "diffuse"
reflectance = [0.1, 0.1, 0.7]
[[objects]]
shape = "sphere"
radius = 1
material = "red"
[[objects]]
name = "back \"wall\""
shape = "box"
min = [-1.5, -1.2, -3]
max = [1.5, 1.2, -2]
material = "blue"
[[objects]]
shape = "sphere"
center = [1.2, 0.8, 0.5]
radius = 0.25
material = "blue"
[[lights]]
type = "directional"
direction = [-1, -1, -2]
irradiance = 2
"#;

/// Channels by name, row by row, and the header's texts.
struct File {
    width: usize,
    channels: HashMap<String, Vec<f32>>,
    texts: HashMap<String, String>,
}

impl File {
    fn read(path: &Path) -> Self {
        let image = read_first_flat_layer_from_file(path).unwrap();
        let layer = image.layer_data;
        let list = layer.channel_data.list;
        let channels = list
            .into_iter()
            .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect::<Vec<f32>>()));
        let texts = layer.attributes.other.iter().filter_map(|(name, value)| match value {
            AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
            _ => None,
        });
        Self { width: layer.size.0, channels: channels.collect(), texts: texts.collect() }
    }

    fn at(&self, channel: &str, [x, y]: [usize; 2]) -> f32 {
        let plane = self.channels.get(channel).unwrap_or_else(|| panic!("no channel {channel}"));
        plane[y * self.width + x]
    }

    fn vector(&self, layer: &str, letters: &str, pixel: [usize; 2]) -> Vec<f32> {
        letters.chars().map(|c| self.at(&format!("{layer}.{c}"), pixel)).collect()
    }
}

fn render(folder: &Path, scene: &str, arguments: &str) -> File {
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    let kind = if arguments.contains("--exr-type") { "" } else { "--exr-type float" };
    let all = ["render", "scene.toml", "-q", "-o", "out.exr"];
    let further = arguments.split_whitespace().chain(kind.split_whitespace());
    let all: Vec<&str> = all.into_iter().chain(further).collect();
    let output = alhazen(folder, &all);
    assert!(output.status.success(), "{}", stderr(&output));
    File::read(&folder.join("out.exr"))
}

fn near(a: &[f32], b: &[f32]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5), "{a:?} {b:?}");
}

#[test]
fn middles_of_pixels_are_where_they_should_be() {
    let folder = tempfile::tempdir().unwrap();
    let file = render(folder.path(), SCENE, "--layers depth,position,uv,object_id,material_id");
    assert!(!file.channels.contains_key("albedo.R"), "only what was asked for");
    for y in 0..32 {
        for x in 0..40 {
            // A tenth of a metre to a pixel.
            let (px, py) = ((x as f32 - 19.5) * 0.1, (15.5 - y as f32) * 0.1);
            let pixel = [x, y];
            let small = (px - 1.2).powi(2) + (py - 0.8).powi(2);
            let (z, object, material) = if small < 0.25 * 0.25 {
                ((0.0625 - small).sqrt() + 0.5, 3.0, 3.0)
            } else if px * px + py * py < 1.0 {
                ((1.0 - px * px - py * py).sqrt(), 1.0, 2.0)
            } else if px.abs() < 1.5 && py.abs() < 1.2 {
                (-2.0, 2.0, 3.0)
            } else {
                assert_eq!(file.at("Z", pixel), 1e10);
                assert_eq!(file.at("object_id.Y", pixel), 0.0);
                near(&file.vector("position", "XYZ", pixel), &[0.0; 3]);
                continue;
            };
            near(&[file.at("Z", pixel)], &[10.0 - z]);
            near(&file.vector("position", "XYZ", pixel), &[px, py, z]);
            assert_eq!(file.at("object_id.Y", pixel), object);
            // Materials are numbered in alphabetical or written order, after the default one.
            let other = if material == 2.0 { [20, 16] } else { [5, 4] };
            assert_eq!(file.at("material_id.Y", pixel), file.at("material_id.Y", other));
        }
    }
}

#[test]
fn texture_coordinates_are_those_of_the_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.path().join("quad.obj"), mesh).unwrap();
    let scene = "[image]\nsize = [20, 20]\n[camera]\nprojection = \"orthographic\"\nheight = 2\n\
                 eye = [0, 0, 5]\ntarget = [0, 0, 0]\n[[objects]]\nmesh = \"quad.obj\"\n";
    let file = render(folder.path(), scene, "--layers uv,normal --samples 1");
    for (x, y) in [(0, 0), (7, 3), (19, 12)] {
        let expected = [(x as f32 + 0.5) / 20.0, 1.0 - (y as f32 + 0.5) / 20.0];
        near(&file.vector("uv", "UV", [x, y]), &expected);
    }
    near(&file.vector("normal", "XYZ", [10, 10]), &[0.0, 0.0, 1.0]);
}

#[test]
fn means_are_those_of_the_samples() {
    let folder = tempfile::tempdir().unwrap();
    let all = render(folder.path(), SCENE, "--layers all");
    // Albedo is the picture that `flat` makes, here with a black background.
    let flat = render(folder.path(), SCENE, "--integrator flat");
    // Direct light is what is left without bounces.
    let direct = render(folder.path(), SCENE, "--max-depth 0");
    let mut some_indirect = false;
    for y in 0..32 {
        for x in 0..40 {
            for c in ["R", "G", "B"] {
                let value = |file: &File, layer: &str| file.at(&format!("{layer}{c}"), [x, y]);
                near(&[value(&all, "albedo.")], &[value(&flat, "")]);
                near(&[value(&all, "direct.")], &[value(&direct, "")]);
                let sum = value(&all, "direct.") + value(&all, "indirect.");
                near(&[sum], &[value(&all, "")]);
                some_indirect |= value(&all, "indirect.") > 0.01;
                assert!(value(&all, "variance.") >= 0.0);
            }
            assert_eq!(all.at("samples.Y", [x, y]), 16.0);
        }
    }
    assert!(some_indirect);
    // The middle of the sphere faces the viewer.
    let middle = all.vector("normal", "XYZ", [20, 16]);
    assert!(middle[2] > 0.99, "{middle:?}");
    near(&middle, &all.vector("shading_normal", "XYZ", [20, 16]));
}

/// The share of the pixel that each id has.
fn shares(file: &File, layer: &str, pixel: [usize; 2]) -> HashMap<u32, f32> {
    let mut shares = HashMap::new();
    let mut last = f32::INFINITY;
    for rank in 0..3 {
        for [id, share] in [["R", "G"], ["B", "A"]] {
            let value = |c: &str| file.at(&format!("{layer}0{rank}.{c}"), pixel);
            let (id, share) = (value(id), value(share));
            assert!(share <= last, "the largest comes first");
            last = share;
            if share > 0.0 {
                assert!(id.is_normal());
                shares.insert(id.to_bits(), share);
            }
        }
    }
    shares
}

/// Names and ids from the header.
fn manifest(file: &File, layer: &str) -> HashMap<String, u32> {
    let name = file.texts.iter().find(|(k, v)| k.ends_with("/name") && *v == layer);
    let key = name.unwrap_or_else(|| panic!("no {layer}")).0.trim_end_matches("/name").to_owned();
    let text = |field: &str| file.texts[&format!("{key}/{field}")].clone();
    assert_eq!(text("hash"), "MurmurHash3_32");
    assert_eq!(text("conversion"), "uint32_to_float32");
    let map: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(&text("manifest")).unwrap();
    let id = |v: &serde_json::Value| u32::from_str_radix(v.as_str().unwrap(), 16).unwrap();
    map.iter().map(|(name, v)| (name.clone(), id(v))).collect()
}

#[test]
fn mattes_are_the_coverage_of_each_object() {
    for filter in ["blackman-harris", "mitchell"] {
        let folder = tempfile::tempdir().unwrap();
        let arguments = format!("--filter {filter} --layers crypto_object,crypto_material");
        let file = render(folder.path(), SCENE, &arguments);
        let objects = manifest(&file, "CryptoObject");
        let mut names: Vec<&str> = objects.keys().map(String::as_str).collect();
        names.sort_unstable();
        assert_eq!(names, ["back \"wall\"", "sphere", "sphere.2"]);
        let materials = manifest(&file, "CryptoMaterial");
        assert!(materials.contains_key("red") && materials.contains_key("blue"));

        // Coverage by another way: the picture in which one object is white and the others are black.
        let white = "\n[materials.white]\ntype = \"diffuse\"\nreflectance = 1\n\
                     [materials.black]\ntype = \"diffuse\"\nreflectance = 0\n";
        for (index, name) in ["sphere", "back \"wall\"", "sphere.2"].into_iter().enumerate() {
            let mut number = 0;
            let lines = SCENE.lines().map(|line| {
                if !line.starts_with("material = ") {
                    return line.to_owned();
                }
                number += 1;
                let color = if number == index + 1 { "white" } else { "black" };
                format!("material = \"{color}\"")
            });
            let scene = lines.collect::<Vec<_>>().join("\n") + white;
            let alone =
                render(folder.path(), &scene, &format!("--filter {filter} --integrator flat"));
            let (mut partial, mut difference) = (0, 0.0);
            for y in 0..32 {
                for x in 0..40 {
                    let all = shares(&file, "CryptoObject", [x, y]);
                    let expected = alone.at("R", [x, y]);
                    let share = all.get(&objects[name]).copied().unwrap_or(0.0);
                    partial += u32::from(share > 0.0 && share < 1.0);
                    let sum: f32 = all.values().sum();
                    assert!(sum <= 1.0 + 1e-5 || filter == "mitchell");
                    if filter == "blackman-harris" {
                        near(&[share], &[expected]);
                        // Of materials the same shares, put together.
                        let of_materials: f32 =
                            shares(&file, "CryptoMaterial", [x, y]).values().sum();
                        near(&[sum], &[of_materials]);
                    }
                    difference += (share - expected).abs() / (40.0 * 32.0);
                }
            }
            assert!(partial > 5, "{name} has edges");
            // With negative weights shares are of all weight that the pixel has, which pictures are not.
            assert!(difference < 0.05, "{name} {filter}: {difference}");
        }
    }
}

#[test]
fn other_programs_read_the_layers() {
    let folder = tempfile::tempdir().unwrap();
    render(folder.path(), SCENE, "--layers all --exr-type half");
    let run = |tool: &str, arguments: &[&str]| {
        let output = Command::new(tool).args(arguments).current_dir(folder.path()).output();
        let output =
            output.unwrap_or_else(|e| panic!("{tool}: {e}; `scripts/setup.sh test` installs it"));
        assert!(output.status.success(), "{tool} {arguments:?}: {}", stderr(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let header = run("exrheader", &["out.exr"]);
    for line in [
        "Z, 32-bit floating-point",
        "albedo.R, 16-bit floating-point",
        "position.X, 32-bit floating-point",
        "CryptoObject00.R, 32-bit floating-point",
        "CryptoMaterial02.A, 32-bit floating-point",
        "/conversion (type string): \"uint32_to_float32\"",
        "alhazen.layers (type string): \"albedo normal",
    ] {
        assert!(header.contains(line), "`{line}` is not in:\n{header}");
    }
    // Every ten names of OpenImageIO's list belong to channels that it found.
    let info = run("oiiotool", &["--info", "-v", "out.exr"]);
    assert!(info.contains("40 x   32") && info.contains("normal.X"), "{info}");
    let all = run("oiiotool", &["out.exr", "--stats"]);
    assert!(
        all.contains("NanCount: 0") || all.contains("Stats NaNs") || !all.contains("nan"),
        "{all}"
    );
}

#[test]
fn what_cannot_hold_layers_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    for (arguments, named) in [
        ("-o out.png --layers depth", "only EXR files hold layers"),
        ("-o out.exr --layers depth --exr-compression pxr24", "pxr24 would round layers"),
        ("-o out.exr --layers deepness", "invalid value 'deepness'"),
    ] {
        let all: Vec<&str> =
            ["render", "scene.toml"].into_iter().chain(arguments.split(' ')).collect();
        let output = alhazen(folder.path(), &all);
        assert_eq!(output.status.code(), Some(2), "{arguments}");
        assert!(stderr(&output).contains(named), "{}", stderr(&output));
        assert!(!folder.path().join("out.exr").exists());
    }
}
