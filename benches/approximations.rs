//! What each approximation costs and buys: the table of docs/approximations.md.
//!
//! Each option is laid over a small scene at its accurate setting, and at others. Rendered by turns, the
//! median of the ratios of times says what an approximation buys; the difference of two pictures of many
//! samples with the same random numbers what it costs, and the ratio of the errors at a few samples,
//! against a picture with other random numbers, what becomes of the noise. With `ALHAZEN_DOCS=1` the table
//! is written into the page. Arguments are parts of the names of rows: these alone, and the page stays.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

mod common;

use std::fmt::Write as _;
use std::path::Path;

use alhazen::film::Picture;
use alhazen::measure::{CompareOptions, compare};
use alhazen::render::{RenderJob, render};
use alhazen::scene::Scene;
use common::still_life::{POINT, RECTANGLE, lamps, load, load_file, made_of, write_files};
use common::{interleaved, ratio};

/// Samples of the pictures that differences are found in, and of the reference for noise.
const MANY: u32 = 256;

/// Rounds that a ratio of times is the median of.
const ROUNDS: usize = 7;

#[derive(Clone, Copy, PartialEq)]
enum Effect {
    /// It shifts the picture: a difference that no number of samples takes away.
    Bias,
    /// The picture converges to the same.
    Noise,
}

/// An approximating option.
struct Row {
    /// As the page names it, with its default.
    name: &'static str,
    default: &'static str,
    effect: Effect,
    /// A scene of the repository; the still life where there is none.
    file: Option<&'static str>,
    /// What is written after the still life.
    more: String,
    /// Laid over the scene in any case.
    base: Vec<String>,
    accurate: (&'static str, Vec<&'static str>),
    choices: Vec<(&'static str, Vec<&'static str>)>,
}

impl Row {
    fn new(name: &'static str, default: &'static str, effect: Effect, base: &[&str]) -> Self {
        Self {
            name,
            default,
            effect,
            file: None,
            more: String::new(),
            base: base.iter().map(|&s| s.to_owned()).collect(),
            accurate: ("", Vec::new()),
            choices: Vec::new(),
        }
    }

    /// The accurate choice first, then others: what each is called, and what is laid over for it.
    fn choices(mut self, accurate: (&'static str, &[&'static str])) -> Self {
        self.accurate = (accurate.0, accurate.1.to_vec());
        self
    }

    fn or(mut self, name: &'static str, sets: &[&'static str]) -> Self {
        self.choices.push((name, sets.to_vec()));
        self
    }

    fn based(mut self, sets: impl IntoIterator<Item = String>) -> Self {
        self.base.extend(sets);
        self
    }

    fn scene(&self, folder: &Path, sets: &[&str], samples: u32) -> Scene {
        let owned = sets.iter().map(|&s| s.to_owned());
        let last = [format!("render.samples={samples}")];
        let sets: Vec<String> = self.base.iter().cloned().chain(owned).chain(last).collect();
        let scene = match self.file {
            Some(file) => load_file(
                &Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(file),
                &[&sets],
            ),
            None => load(folder, &self.more, &[&sets]),
        };
        scene.unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }
}

fn rows() -> Vec<Row> {
    use Effect::{Bias, Noise};
    // A third of the balls mirrors and glass each.
    let specular: &[&str] = &[
        POINT,
        r#"materials.ball0={ type = "mirror", reflectance = 0.95 }"#,
        r#"materials.ball1={ type = "dielectric", ior = 1.5 }"#,
    ];
    let small = "image.size=[120, 68]";
    let glass = made_of(r#"type = "dielectric", ior = 1.5"#, false);
    let glass_by = |fresnel: &str| {
        made_of(&format!(r#"type = "dielectric", ior = 1.5, fresnel = {fresnel}"#), false)
    };
    let image = |filter: &str| {
        let reflectance = format!(r#"{{ image = "colors.png", filter = "{filter}" }}"#);
        made_of(&format!(r#"type = "diffuse", reflectance = {reflectance}"#), true)
    };
    /// Settings that are made up on the way.
    fn leak(sets: Vec<String>) -> Vec<&'static str> {
        sets.into_iter().map(|set| &*set.leak()).collect()
    }
    let smoke = format!(
        "[[volumes]]\ngrid = \"{}/scenes/grids/smoke.npy\"\nbounds = [[-3, 0, -3], [3, 3, 3]]\n\
         tolerance = TOLERANCE\ntransfer = [{{ value = 0.05, color = [0.2, 0.3, 0.5], extinction = 0.0 }}, \
         {{ value = 1.0, color = [0.9, 0.8, 0.7], extinction = 8.0 }}]\n",
        env!("CARGO_MANIFEST_DIR")
    );
    let many_lights = format!("lights=[{}]", lamps(8, 8));

    let mut rows = vec![
        Row::new("`samples`", "16", Noise, &[POINT])
            .choices(("16", &["render.samples=16"]))
            .or("4", &["render.samples=4"])
            .or("64", &["render.samples=64"]),
        Row::new("`integrator`", "`\"whitted\"`", Bias, specular)
            .choices(("`\"whitted\"`", &[]))
            .or("`\"direct\"`", &["render.integrator=direct"]),
        Row::new("`max_depth`", "8", Bias, specular)
            .based(["render.prune=0.0005".to_owned()])
            .choices(("32", &["render.max_depth=32"]))
            .or("8", &["render.max_depth=8"])
            .or("4", &["render.max_depth=4"])
            .or("2", &["render.max_depth=2"]),
        Row::new("`prune`", "0.004", Bias, specular)
            .choices(("0", &["render.prune=0.0"]))
            .or("0.004", &["render.prune=0.004"])
            .or("0.02", &["render.prune=0.02"])
            .or("0.1", &["render.prune=0.1"]),
        Row::new("`roulette` below `prune`", "`false`", Noise, specular)
            .choices(("`prune = 0`", &["render.prune=0.0"]))
            .or("0.004", &["render.roulette=true", "render.prune=0.004"])
            .or("0.1", &["render.roulette=true", "render.prune=0.1"])
            .or("0.5", &["render.roulette=true", "render.prune=0.5"]),
        Row::new("`shadows`, at glass", "`\"opaque\"`", Bias, specular)
            .choices(("`\"fresnel\"`", &["render.shadows=fresnel"]))
            .or("`\"tinted\"`", &["render.shadows=tinted"])
            .or("`\"opaque\"`", &["render.shadows=opaque"])
            .or("`false`", &["render.shadows=false"]),
        Row::new("`shadow_samples`", "1", Noise, &[RECTANGLE])
            .choices(("4", &["render.shadow_samples=4"]))
            .or("1", &["render.shadow_samples=1"])
            .or("16", &["render.shadow_samples=16"]),
        Row::new("`light_samples`, of 64 lights", "16", Noise, &[small])
            .based([many_lights])
            .choices(("64", &["render.light_samples=64"]))
            .or("16", &["render.light_samples=16"])
            .or("4", &["render.light_samples=4"]),
        Row::new("`precision`", "`\"robust\"`", Bias, specular)
            .choices(("`\"exact\"`", &["render.precision=exact"]))
            .or("`\"robust\"`", &["render.precision=robust"])
            .or("`\"fast\"`", &["render.precision=fast"]),
        Row::new("`epsilon`, in a scene 9 m wide", "`\"auto\"`", Bias, specular)
            .choices(("`\"auto\"`", &[]))
            .or("1e-6", &["render.epsilon=1e-6"])
            .or("1e-4", &["render.epsilon=1e-4"])
            .or("1e-2", &["render.epsilon=1e-2"]),
        Row::new("`filter`, of pixels", "`\"blackman-harris\"`", Bias, specular)
            .choices(("`\"blackman-harris\"`", &["render.filter=blackman-harris"]))
            .or("`\"box\"`", &["render.filter=box"])
            .or("`\"triangle\"`", &["render.filter=triangle"])
            .or("`\"gaussian\"`", &["render.filter=gaussian"])
            .or("`\"mitchell\"`", &["render.filter=mitchell"]),
        Row::new("`ao_distance`, in a scene 9 m wide", "without end", Bias, &[POINT])
            .based(["render.integrator=ao".to_owned()])
            .choices(("without end", &[]))
            .or("3 m", &["render.ao_distance=3.0"])
            .or("0.5 m", &["render.ao_distance=0.5"]),
        Row::new("`fresnel`, of glass", "`\"exact\"`", Bias, &[POINT])
            .choices(("`\"exact\"`", &[]))
            .or("`\"schlick\"`", &[])
            .or("`{ offset = 0.04, scale = 0.96, power = 5 }`", &[]),
        Row::new("`filter`, of a texture", "`\"mip\"`", Bias, &[POINT])
            .choices(("`\"bilinear\"`", &[]))
            .or("`\"mip\"`", &[])
            .or("`\"nearest\"`", &[]),
        Row::new("`wavelength`, at glass that disperses", "all", Bias, &[POINT])
            .based(made_of(r#"type = "dielectric", ior = { abbe = [1.5, 30.0] }"#, false))
            .choices(("all", &[]))
            .or("587 nm", &["render.wavelength=587"]),
        Row::new("`dims_lights`, of fog", "`true`", Bias, &[POINT])
            .based([r#"medium={ type = "fog", scattering = 0.05, radiance = [0.6, 0.65, 0.7] }"#
                .to_owned()])
            .choices(("`true`", &[]))
            .or("`false`", &["medium.dims_lights=false"]),
        Row {
            file: Some("teapot.toml"),
            ..Row::new(
                "`tolerance`, of freeform surfaces",
                "0.5 px",
                Bias,
                &["image.size=[240, 135]"],
            )
        }
        .choices(("0.05 px", &["render.tolerance=0.05"]))
        .or("0.5 px", &["render.tolerance=0.5"])
        .or("2 px", &["render.tolerance=2"])
        .or("8 px", &["render.tolerance=8"]),
    ];
    for row in &mut rows {
        if row.name.starts_with("`fresnel`") {
            row.accurate.1 = leak(glass.clone());
            row.choices[0].1 = leak(glass_by(r#""schlick""#));
            row.choices[1].1 = leak(glass_by("{ offset = 0.04, scale = 0.96, power = 5.0 }"));
        }
        if row.name.starts_with("`filter`, of a texture") {
            row.accurate.1 = leak(image("bilinear"));
            row.choices[0].1 = leak(image("mip"));
            row.choices[1].1 = leak(image("nearest"));
        }
    }
    let volume =
        Row { more: smoke, ..Row::new("`tolerance`, of volumes", "0.001", Bias, &[POINT]) }
            .choices(("1e-5", &["volumes.0.tolerance=1e-5"]))
            .or("0.001", &["volumes.0.tolerance=0.001"])
            .or("0.02", &["volumes.0.tolerance=0.02"])
            .or("0.2", &["volumes.0.tolerance=0.2"]);
    rows.push(Row { more: volume.more.replace("TOLERANCE", "0.001"), ..volume });
    rows
}

fn picture(scene: &Scene, seed: u64) -> Picture {
    render(scene, &RenderJob { seed, ..RenderJob::default() }, &()).film.into()
}

/// The root of relMSE.
fn difference(a: &Picture, b: &Picture) -> f64 {
    compare(a, b, &CompareOptions::default()).expect("the same size").rel_mse.sqrt()
}

fn percent(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let percent = 100.0 * x;
    match percent {
        10.0.. => format!("{percent:.0} %"),
        1.0.. => format!("{percent:.1} %"),
        0.001.. => {
            let places = (1.0 - percent.log10().floor()) as usize;
            format!("{percent:.places$} %")
        }
        _ => format!("{percent:.0e} %"),
    }
}

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    write_files(folder);
    let mut table = String::from(
        "| option | default | from | to | time | picture differs | error at 4 samples |\n\
         |---|---|---|---|---|---|---|\n",
    );
    print!("{table}");
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let is_wanted = |row: &Row| wanted.is_empty() || wanted.iter().any(|w| row.name.contains(w));
    for row in rows().into_iter().filter(is_wanted) {
        let is_samples = row.name == "`samples`";
        let (from, accurate) = (row.accurate.0, &row.accurate.1);
        let few = if is_samples { 16 } else { 4 };
        let a = row.scene(folder, accurate, few);
        let many = picture(&row.scene(folder, accurate, MANY), 0);
        let truth = picture(&row.scene(folder, accurate, MANY), 1);
        let error = difference(&picture(&a, 2), &truth);
        for (to, sets) in &row.choices {
            // Its samples are what it is about.
            let samples = if is_samples { to.parse().expect("a number") } else { few };
            let b = row.scene(folder, sets, samples);
            let run = |scene: &Scene| {
                std::hint::black_box(render(scene, &RenderJob::default(), &()));
            };
            let rounds = interleaved(&|| run(&b), &|| run(&a), ROUNDS);
            let (time, _) = ratio(&rounds);
            let differs = match row.effect {
                Effect::Bias => {
                    percent(difference(&picture(&row.scene(folder, sets, MANY), 0), &many))
                }
                Effect::Noise => "no".to_owned(),
            };
            let mut line = String::new();
            let _ = writeln!(
                line,
                "| {} | {} | {from} | {to} | {time:.2} | {differs} | × {:.2} |",
                row.name,
                row.default,
                difference(&picture(&b, 2), &truth) / error,
            );
            print!("{line}");
            table.push_str(&line);
        }
    }
    if wanted.is_empty() && std::env::var_os("ALHAZEN_DOCS").is_some_and(|value| value == "1") {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/approximations.md");
        let page = std::fs::read_to_string(&path).expect("the page exists");
        let (head, rest) = page.split_once("<!-- TABLE -->\n").expect("it has a mark");
        let (_, tail) = rest.split_once("<!-- TABLE END -->").expect("it has a mark");
        let page = format!("{head}<!-- TABLE -->\n{table}<!-- TABLE END -->{tail}");
        std::fs::write(&path, page).expect("the page can be written");
    }
}
