//! What each option costs: the tables "What things cost" of docs/*.md, row by row.
//!
//! `make bench` renders a baseline and the same with the option by turns and prints the median of the
//! ratios within each round, with the interval that holds the true median in 96 % of cases. Where an
//! option changes the estimate, the error of both follows, against a converged reference. With
//! `ALHAZEN_DOCS=1` the ratios are written into the tables.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

mod common;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use alhazen::accel::AccelKind;
use alhazen::film::{Picture, PixelRect};
use alhazen::io::{LoadOptions, load_scene};
use alhazen::measure::{CompareOptions, compare};
use alhazen::render::{RenderJob, render};
use alhazen::scene::Scene;
use common::{ROUNDS, interleaved, median, ratio};

/// A still life: balls in rows on an uneven floor, all of it in the picture.
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

const POINT: &str =
    r#"lights=[{ type = "point", position = [2.0, 4.0, 3.0], intensity = [60.0, 57.0, 50.0] }]"#;
const RECTANGLE: &str = r#"lights=[{ type = "rectangle", corner = [1.5, 4.0, 2.5], edge_u = [1.0, 0.0, 0.0], edge_v = [0.0, 0.0, 1.0], radiance = [60.0, 57.0, 50.0] }]"#;

/// The same lamp as a mesh that glows.
const GLOWING: &str = r#"
[materials.lamp]
type = "diffuse"
reflectance = 0.0
emission = [60.0, 57.0, 50.0]

[[objects]]
shape = "mesh"
positions = [[1.5, 4.0, 2.5], [2.5, 4.0, 2.5], [2.5, 4.0, 3.5], [1.5, 4.0, 3.5]]
triangles = [[0, 1, 2], [0, 2, 3]]
material = "lamp"
"#;

/// Samples of the references for errors, which are found in the middle of the picture.
const REFERENCE_SAMPLES: u32 = 256;

/// An option: what is laid over the still life for the baseline, and what for the option on top of that.
struct Row {
    /// The name of the cell.
    name: &'static str,
    baseline: Vec<String>,
    option: Vec<String>,
    /// What is written after the still life with the option.
    more: &'static str,
    /// What makes the estimate converge to the right picture, where the option changes it.
    truth: Option<Vec<String>>,
}

impl Row {
    fn new(name: &'static str, baseline: &[&[&str]], option: &[&str]) -> Self {
        let owned = |list: &[&str]| list.iter().map(|&s| s.to_owned()).collect::<Vec<_>>();
        Self {
            name,
            baseline: owned(&baseline.concat()),
            option: owned(option),
            more: "",
            truth: None,
        }
    }

    fn truth(mut self, truth: &[&str]) -> Self {
        self.truth = Some(truth.iter().map(|&s| s.to_owned()).collect());
        self
    }

    /// Whether pictures have to be read.
    fn reads_pictures(&self) -> bool {
        self.baseline.iter().chain(&self.option).any(|set| set.contains(".png"))
    }
}

/// All balls, and with `floor` the floor too, of one material.
fn made_of(material: &str, floor: bool) -> Vec<String> {
    let names: &[&str] =
        if floor { &["floor", "ball0", "ball1", "ball2"] } else { &["ball0", "ball1", "ball2"] };
    names.iter().map(|name| format!("materials.{name}={{ {material} }}")).collect()
}

/// A row about the material of all balls, or of everything.
fn material(name: &'static str, floor: bool, baseline: &str, option: &str) -> Row {
    let mut row = Row::new(name, &[&[POINT]], &[]);
    row.baseline.extend(made_of(baseline, floor));
    row.option = made_of(option, floor);
    row
}

fn rows() -> Vec<Row> {
    let lit: &[&str] = &[POINT];
    // A third of the balls each.
    let specular: &[&str] = &[
        POINT,
        r#"materials.ball0={ type = "mirror", reflectance = 0.95 }"#,
        r#"materials.ball1={ type = "dielectric", ior = 1.5 }"#,
    ];
    let direct = "render.integrator=direct";
    let whitted = "render.integrator=whitted";
    // Unbiased, and deep enough.
    let whole_tree: &[&str] = &["render.max_depth=64", "render.prune=0.01", "render.roulette=true"];
    let small: &[&str] = &["image.size=[120, 68]"];
    let lights = |lights: &str| format!("lights=[{lights}]");
    let owned = |mut row: Row, baseline: String, option: String| {
        row.baseline.push(baseline);
        row.option.push(option);
        row
    };
    let lamp = |kind: &str| format!("lights=[{{ type = {kind} }}]");
    let second = format!(
        "{}, {} ]",
        POINT.trim_end_matches(']'),
        r#"{ type = "point", position = [-3.0, 5.0, 2.0], intensity = [20.0, 22.0, 30.0] }"#
    );
    let (few, many) = (lights(&lamps(4, 4)), lights(&lamps(25, 40)));
    let fog = |rest: &str| format!("medium={{ type = {rest}, radiance = [0.6, 0.65, 0.7] }}");
    let plain = |name, option: &[&str]| Row::new(name, &[lit], option);
    let with = |name, option: String| {
        let mut row = Row::new(name, &[lit], &[]);
        row.option.push(option);
        row
    };
    let diffuse = r#"type = "diffuse""#;
    let glass = r#"type = "dielectric", ior = 1.5"#;
    let textured = |texture: &str| format!("{diffuse}, reflectance = {texture}");
    let color = textured("[0.6, 0.5, 0.4]");
    let image = |more: &str| textured(&format!(r#"{{ image = "colors.png"{more} }}"#));
    let mip = image(r#", filter = "mip""#);

    vec![
        // docs/scene.md
        Row::new("whitted without mirrors", &[lit, &[direct]], &[whitted]),
        Row::new("whitted", &[specular, &[direct]], &[whitted]),
        Row::new("flat", &[lit, &[direct]], &["render.integrator=flat"]),
        Row::new("ao", &[lit, &[direct]], &["render.integrator=ao"]),
        Row::new("max_depth", &[specular], &["render.max_depth=16"]).truth(whole_tree),
        Row::new("prune", &[specular], &["render.prune=0.0"]).truth(whole_tree),
        Row::new("roulette", &[specular], &["render.roulette=true"]).truth(whole_tree),
        plain("lens", &["camera.lens_radius=0.05"]),
        Row::new("precision", &[lit, &["render.precision=fast"]], &["render.precision=robust"]),
        // docs/lights.md
        with("second light", second),
        with(
            "spot",
            lamp(
                r#""spot", position = [2.0, 4.0, 3.0], direction = [-0.4, -1.0, -0.6], intensity = [60.0, 57.0, 50.0], cone_angle = 80.0"#,
            ),
        ),
        plain("rectangle", &[RECTANGLE]),
        with(
            "disk",
            lamp(
                r#""disk", center = [2.0, 4.0, 3.0], normal = [0.0, -1.0, 0.0], radius = 0.56, radiance = [60.0, 57.0, 50.0]"#,
            ),
        ),
        with(
            "sphere",
            lamp(
                r#""sphere", center = [2.0, 4.0, 3.0], radius = 0.56, radiance = [60.0, 57.0, 50.0]"#,
            ),
        ),
        Row::new("shadow_samples", &[&[RECTANGLE]], &["render.shadow_samples=4"]).truth(&[]),
        // Costly enough for a smaller picture.
        owned(Row::new("many lights", &[small], &[]), few, many.clone()),
        owned(Row::new("light_samples", &[small], &[]), many, "render.light_samples=4".to_owned())
            .truth(&[]),
        plain("no shadows", &["render.shadows=false"]),
        Row::new("tinted", &[specular], &["render.shadows=tinted"]),
        Row::new("fresnel shadows", &[specular], &["render.shadows=fresnel"]),
        with("fog", fog(r#""fog", scattering = 0.05"#)),
        with("height-fog", fog(r#""height-fog", scattering = 0.1, height = 1.0"#)),
        with("distance-fog", fog(r#""distance-fog", start = 4.0, end = 20.0"#)),
        owned(
            plain("dims_lights", &[]),
            fog(r#""fog", scattering = 0.05"#),
            "medium.dims_lights=false".to_owned(),
        ),
        // docs/materials.md
        material(
            "phong mirror",
            false,
            r#"type = "phong", specular = 0.5"#,
            r#"type = "phong", specular = 0.5, mirror = 0.5"#,
        ),
        material("mirror", false, diffuse, r#"type = "mirror", reflectance = 0.95"#),
        material("dielectric", false, diffuse, glass),
        material("schlick", false, glass, &format!(r#"{glass}, fresnel = "schlick""#)),
        material(
            "power law",
            false,
            glass,
            &format!("{glass}, fresnel = {{ offset = 0.04, scale = 0.96, power = 5.0 }}"),
        ),
        material("absorption", false, glass, &format!("{glass}, absorption = [1.0, 0.3, 0.8]")),
        material(
            "dispersion",
            false,
            glass,
            r#"type = "dielectric", ior = { abbe = [1.5, 50.0] }"#,
        ),
        material("image mip", true, &color, &mip),
        material("image bilinear", true, &mip, &image(r#", filter = "bilinear""#)),
        material("image nearest", true, &mip, &image(r#", filter = "nearest""#)),
        material("checker", true, &color, &textured("{ checker = [0.7, 0.2], scale = 0.2 }")),
        material("noise", true, &color, &textured("{ noise = [0.2, 0.7], scale = 0.5 }")),
        material("marble", true, &color, &textured("{ marble = [0.2, 0.7], scale = 0.5 }")),
        material("gradient", true, &color, &textured("{ gradient = [0.2, 0.7] }")),
        material("normal map", true, &color, &format!(r#"{color}, normal_map = "normals.png""#)),
        material(
            "bump image",
            true,
            &color,
            &format!(r#"{color}, bump = {{ image = "colors.png", height = 0.02 }}"#),
        ),
        material(
            "bump noise",
            true,
            &color,
            &format!("{color}, bump = {{ noise = [0.0, 1.0], scale = 0.2, height = 0.02 }}"),
        ),
        Row { more: GLOWING, ..Row::new("emission", &[&[RECTANGLE]], &["lights=[]"]) },
    ]
}

/// Point lights in a grid above everything, of the same intensity in all.
fn lamps(columns: u32, rows: u32) -> String {
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

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    write_files(folder);
    let rows = rows();
    let probe = rows.iter().find(|row| row.name == "image mip").expect("it is there");
    let can_read = load(folder, probe, &[&probe.baseline, &probe.option]).is_ok();

    println!(
        "a still life of 54 balls, 240 x 136, 4 samples, {} threads, {ROUNDS} rounds\n",
        rayon::current_num_threads()
    );
    println!("| option | ratio | interval |");
    println!("|---|---|---|");
    let mut found = BTreeMap::new();
    let mut times = Vec::new();
    let mut errors = Vec::new();
    for row in &rows {
        if row.reads_pictures() && !can_read {
            println!("| {} | not measured: pictures cannot be read | |", row.name);
            continue;
        }
        let built = |sets: &[&Vec<String>]| {
            load(folder, row, sets).unwrap_or_else(|error| panic!("{}: {error}", row.name))
        };
        let (a, b) = (built(&[&row.baseline]), built(&[&row.baseline, &row.option]));
        let run = |scene: &Scene| {
            std::hint::black_box(render(scene, &RenderJob::default(), &()));
        };
        let rounds = interleaved(&|| run(&b), &|| run(&a), ROUNDS);
        let (ratio, [from, to]) = ratio(&rounds);
        println!("| {} | {ratio:.2} | {from:.2}–{to:.2} |", row.name);
        times.push(median(rounds.iter().map(|(_, a)| *a).collect()));
        found.insert(row.name, format!("{ratio:.2}"));
        if let Some(truth) = &row.truth {
            let samples = vec![format!("render.samples={REFERENCE_SAMPLES}")];
            let reference = picture(&built(&[&row.baseline, truth, &samples]), 1);
            let error = |scene| rel_mse(&picture(scene, 0), &reference);
            errors.push((row.name, error(&a), error(&b), ratio));
        }
    }
    println!("\na baseline takes {:.0} ms in the median", 1e3 * median(times));
    println!(
        "\nwhere an option changes the estimate: relMSE against {REFERENCE_SAMPLES} samples\n"
    );
    println!("| option | of the baseline | with it | ratio of errors × ratio of times |");
    println!("|---|---|---|---|");
    for (name, a, b, ratio) in errors {
        println!("| {name} | {a:.3e} | {b:.3e} | {:.2} |", b / a * ratio);
    }
    if std::env::var_os("ALHAZEN_DOCS").is_some_and(|value| value == "1") {
        fill_tables(&found);
    }
}

fn load(folder: &Path, row: &Row, sets: &[&Vec<String>]) -> Result<Scene, String> {
    let path = folder.join("scene.toml");
    // What belongs to the option alone comes with its settings.
    let more = if sets.len() > 1 { row.more } else { "" };
    std::fs::write(&path, format!("{STILL_LIFE}{}{more}", balls())).map_err(|e| e.to_string())?;
    let set = sets.iter().flat_map(|sets| sets.iter().cloned()).collect();
    let options = LoadOptions { set, ..LoadOptions::default() };
    let loaded = load_scene(&path, &options).map_err(|error| error.to_string())?;
    Scene::build_quietly(loaded.scene, AccelKind::default())
        .map_err(|errors| errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
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
fn write_files(folder: &Path) {
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

/// The middle quarter of the picture.
fn picture(scene: &Scene, seed: u64) -> Picture {
    let [width, height] = scene.size;
    let crop = PixelRect { x0: width / 4, y0: height / 4, x1: 3 * width / 4, y1: 3 * height / 4 };
    let job = RenderJob { crop: Some(crop), seed, ..RenderJob::default() };
    render(scene, &job, &()).film.into()
}

fn rel_mse(a: &Picture, b: &Picture) -> f64 {
    compare(a, b, &CompareOptions::default()).expect("the same crop").rel_mse
}

/// Writes what was found into the cells of the tables: all that stands before their markers.
fn fill_tables(found: &BTreeMap<&str, String>) {
    for page in ["scene", "lights", "materials"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("docs/{page}.md"));
        let text = std::fs::read_to_string(&path).expect("the page exists");
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        for (name, ratio) in found {
            let marker = format!("<!-- COST: {name} -->");
            for line in &mut lines {
                let Some((before, after)) = line.split_once(&marker) else { continue };
                let Some((cells, _)) = before.rsplit_once('|') else { continue };
                *line = format!("{cells}| {ratio} {marker}{after}");
            }
        }
        std::fs::write(&path, lines.join("\n") + "\n").expect("the page can be written");
        println!("filled {}", path.display());
    }
}
