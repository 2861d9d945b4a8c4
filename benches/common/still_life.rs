//! A still life to lay options over: balls in rows on an uneven floor, all of it in the picture.

use std::fmt::Write as _;
use std::path::Path;

use alhazen::accel::AccelKind;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::scene::Scene;

const STILL_LIFE: &str = r#"
[image]
size = [240, 136]
background = [0.3, 0.4, 0.6]

[camera]
eye = [0.0, 3.2, 7.0]
target = [0.0, 0.3, 0.3]
fov = 38.0

[render]
samples = 4
filter = "box"

[ambient]
radiance = 0.1

[materials.floor]
type = "diffuse"
reflectance = [0.5, 0.45, 0.4]

[materials.ball0]
type = "diffuse"
reflectance = [0.7, 0.2, 0.15]

[materials.ball1]
type = "diffuse"
reflectance = [0.2, 0.6, 0.25]

[materials.ball2]
type = "diffuse"
reflectance = [0.2, 0.3, 0.7]

[[objects]]
mesh = "floor.ply"
material = "floor"
"#;

pub const POINT: &str =
    r#"lights=[{ type = "point", position = [2.0, 4.0, 3.0], intensity = [60.0, 57.0, 50.0] }]"#;
pub const RECTANGLE: &str = r#"lights=[{ type = "rectangle", corner = [1.5, 4.0, 2.5], edge_u = [1.0, 0.0, 0.0], edge_v = [0.0, 0.0, 1.0], radiance = [60.0, 57.0, 50.0] }]"#;

/// All balls, and with `floor` the floor too, of one material.
pub fn made_of(material: &str, floor: bool) -> Vec<String> {
    let names: &[&str] =
        if floor { &["floor", "ball0", "ball1", "ball2"] } else { &["ball0", "ball1", "ball2"] };
    names.iter().map(|name| format!("materials.{name}={{ {material} }}")).collect()
}

/// The still life, and `more` after it, with `sets` laid over. Its [files](write_files) are in `folder`.
pub fn load(folder: &Path, more: &str, sets: &[&[String]]) -> Result<Scene, String> {
    let path = folder.join("scene.toml");
    std::fs::write(&path, format!("{STILL_LIFE}{}{more}", balls())).map_err(|e| e.to_string())?;
    load_file(&path, sets)
}

/// A scene file with `sets` laid over.
pub fn load_file(path: &Path, sets: &[&[String]]) -> Result<Scene, String> {
    let options = LoadOptions { set: sets.concat(), ..LoadOptions::default() };
    let loaded = load_scene(path, &options).map_err(|error| error.to_string())?;
    Scene::build_quietly(loaded.scene, AccelKind::default())
        .map_err(|errors| errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}

/// Point lights in a grid above everything, of the same intensity in all.
pub fn lamps(columns: u32, rows: u32) -> String {
    let mut text = String::new();
    let intensity = 90.0 / f64::from(columns * rows);
    for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
        let x = (f64::from(i) + 0.5) / f64::from(columns) * 8.0 - 4.0;
        let z = (f64::from(j) + 0.5) / f64::from(rows) * 7.0 - 3.5;
        write!(
            text,
            r#"{{ type = "point", position = [{x:.4}, 2.5, {z:.4}], intensity = {intensity} }}, "#
        )
        .expect("text grows");
    }
    text
}

/// Nine columns and six rows of balls, of the three materials by turns.
fn balls() -> String {
    let mut text = String::new();
    for (i, j) in (0..6).flat_map(|j| (0..9).map(move |i| (i, j))) {
        let (x, z) = (f64::from(i) - 4.0 + 0.3 * f64::from(j % 2), f64::from(j) - 2.5);
        let radius = 0.25 + 0.05 * f64::from((3 * i + 5 * j) % 4);
        write!(
            text,
            "[[objects]]\nshape = \"sphere\"\ncenter = [{}, {:.3}, {z}]\nradius = {radius:.3}\n\
             material = \"ball{}\"\n",
            0.9 * x,
            radius + 0.06,
            (i + 2 * j) % 3
        )
        .expect("text grows");
    }
    text
}

/// What the scenes name: the floor, and two pictures.
pub fn write_files(folder: &Path) {
    const CELLS: u32 = 160;
    let at = |i: u32| f64::from(i) / f64::from(CELLS);
    let height = |x: f64, z: f64| 0.03 * ((2.1 * x).sin() * (1.7 * z).cos() + (5.3 * x + z).sin());
    let mut floor = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nproperty float u\nproperty float v\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        (CELLS + 1) * (CELLS + 1),
        2 * CELLS * CELLS
    );
    for (i, j) in (0..=CELLS).flat_map(|j| (0..=CELLS).map(move |i| (i, j))) {
        let (u, v) = (at(i), at(j));
        let (x, z) = (60.0 * u - 30.0, 60.0 * v - 50.0);
        writeln!(floor, "{x:.5} {:.5} {z:.5} {:.5} {:.5}", height(x, z), 20.0 * u, 20.0 * v)
            .expect("text grows");
    }
    for a in (0..CELLS).flat_map(|j| (0..CELLS).map(move |i| j * (CELLS + 1) + i)) {
        let below = a + CELLS + 1;
        writeln!(floor, "3 {a} {below} {}\n3 {a} {} {}", below + 1, below + 1, a + 1)
            .expect("text grows");
    }
    std::fs::write(folder.join("floor.ply"), floor).expect("the folder is ours");

    let wave = |x: u32, y: u32, f: f64| {
        let t = f64::from(x) * f / 512.0 * std::f64::consts::TAU;
        (t.sin() * (f64::from(y) * f / 512.0 * std::f64::consts::TAU).cos() * 0.5 + 0.5) * 255.0
    };
    let colors = |x, y| [wave(x, y, 7.0) as u8, wave(x, y, 23.0) as u8, wave(y, x, 11.0) as u8];
    write_picture(&folder.join("colors.png"), colors);
    let slope = |x, y, f| (128.0 + 0.2 * (wave(x, y, f) - 127.5)) as u8;
    write_picture(&folder.join("normals.png"), |x, y| [slope(x, y, 9.0), slope(y, x, 9.0), 250]);
}

fn write_picture(path: &Path, color: impl Fn(u32, u32) -> [u8; 3]) {
    const SIZE: u32 = 512;
    let file = std::fs::File::create(path).expect("the folder is ours");
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), SIZE, SIZE);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let data: Vec<u8> = (0..SIZE)
        .flat_map(|y| (0..SIZE).map(move |x| (x, y)))
        .flat_map(|(x, y)| color(x, y))
        .collect();
    let mut writer = encoder.write_header().expect("the folder is ours");
    writer.write_image_data(&data).expect("the folder is ours");
}
