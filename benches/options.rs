//! What each option costs: the tables "What things cost" of docs/*.md, row by row.
//!
//! `make bench` renders a baseline and the same with the option by turns and prints the median of the
//! ratios within each round, with the interval that holds the true median in 96 % of cases. Where an
//! option changes the estimate, the error of both follows, against a converged reference. With
//! `ALHAZEN_DOCS=1` the ratios are written into the tables.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

mod common;

use alhazen::film::{Picture, PixelRect};
use std::collections::BTreeMap;
use std::path::Path;

use alhazen::measure::{CompareOptions, compare};
use alhazen::render::{RenderJob, render};
use alhazen::scene::Scene;
use common::still_life::{POINT, RECTANGLE, lamps, load, made_of, write_files};
use common::{ROUNDS, interleaved, median, ratio};

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

/// What belongs to the option alone comes with its settings.
fn load_row(folder: &Path, row: &Row, sets: &[&[String]]) -> Result<Scene, String> {
    load(folder, if sets.len() > 1 { row.more } else { "" }, sets)
}

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    write_files(folder);
    let rows = rows();
    let probe = rows.iter().find(|row| row.name == "image mip").expect("it is there");
    let can_read = load_row(folder, probe, &[&probe.baseline, &probe.option]).is_ok();

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
        let built = |sets: &[&[String]]| {
            load_row(folder, row, sets).unwrap_or_else(|error| panic!("{}: {error}", row.name))
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
