//! Other renderers on the field of spheres: POV-Ray, and Mitsuba 3 by a script of its own.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use super::w2::{Ball, COLORS, EYE, FOV, HALF, LIGHTS, TARGET, TILES, balls};

/// Bounces, and the camera ray.
const LEVELS: u32 = 9;
const PRUNE: f64 = 0.004;

/// The field as a `.pov` file. Lights with `fade_power` 2 give 2·c / (1 + (d / f)²) at the distance d: for a
/// small f this is the inverse square of the intensity 2·c·f². Its surfaces show no 1/π.
pub fn pov(size: [u32; 2]) -> String {
    const FADE: f64 = 0.01;
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let angle = 2.0 * (aspect * (0.5 * FOV.to_radians()).tan()).atan().to_degrees();
    let vector = |[x, y, z]: [f64; 3]| format!("<{x}, {y}, {z}>");
    let diffuse =
        |color| format!("pigment {{ rgb {} }} finish {{ ambient 0 diffuse 1 }}", vector(color));
    let mut text = format!(
        "#version 3.7;\nglobal_settings {{ assumed_gamma 1 max_trace_level {LEVELS} adc_bailout {PRUNE} }}\n\
         background {{ rgb 0 }}\n\
         camera {{ perspective location {} sky z up z right -{aspect}*x angle {angle} look_at {} }}\n\
         #declare Kind0 = texture {{ pigment {{ rgb 1 }} finish {{ ambient 0 diffuse 0 reflection {{ 1 }} }} }}\n\
         #declare Kind1 = texture {{ pigment {{ rgbt 1 }} finish {{ ambient 0 diffuse 0 reflection {{ 0, 1 fresnel on }} conserve_energy }} }}\n",
        vector(EYE),
        vector(TARGET)
    );
    for (i, color) in (2..).zip(COLORS) {
        writeln!(text, "#declare Kind{i} = texture {{ {} }}", diffuse(color)).expect("text grows");
    }
    for (position, intensity) in LIGHTS {
        let scale = 1.0 / (std::f64::consts::PI * 2.0 * FADE * FADE);
        let (at, color) = (vector(position), vector(intensity.map(|i| i * scale)));
        writeln!(text, "light_source {{ {at} rgb {color} fade_distance {FADE} fade_power 2 }}")
            .expect("text grows");
    }
    for (parity, grey) in (0..).zip(TILES) {
        text += "mesh {\n";
        for (i, j) in (-HALF..HALF).flat_map(|i| (-HALF..HALF).map(move |j| (i, j))) {
            if (i + j) & 1 == parity {
                let (k, l) = (i + 1, j + 1);
                writeln!(
                    text,
                    "triangle {{ <{i},{j},0>, <{k},{j},0>, <{k},{l},0> }} triangle {{ <{i},{j},0>, <{k},{l},0>, <{i},{l},0> }}"
                )
                .expect("text grows");
            }
        }
        writeln!(text, "{} }}", diffuse([grey; 3])).expect("text grows");
    }
    for Ball { center, radius, kind } in balls() {
        let interior = if kind == 1 { " interior { ior 1.5 }" } else { "" };
        writeln!(
            text,
            "sphere {{ {}, {radius} texture {{ Kind{kind} }}{interior} }}",
            vector(center)
        )
        .expect("text grows");
    }
    text
}

/// Seconds that POV-Ray says it traced for; none where it is not installed or does not say.
///
/// # Errors
/// Why there is no number.
pub fn time_pov(file: &Path, size: [u32; 2]) -> Result<f64, String> {
    let output = Command::new("povray")
        .arg(format!("+I{}", file.display()))
        .args([format!("+W{}", size[0]), format!("+H{}", size[1])])
        .arg(format!("+WT{}", rayon::current_num_threads()))
        .args(["-A", "-D", "-F", "+BM1"])
        .stdin(Stdio::null())
        .output()
        .map_err(|_| "`povray` was not found".to_owned())?;
    let said = String::from_utf8_lossy(&output.stderr);
    // Trace Time: 0 hours 0 minutes 4 seconds (4.012 seconds)
    let seconds = said.lines().filter(|line| line.contains("Trace Time:")).find_map(|line| {
        let (_, rest) = line.rsplit_once('(')?;
        rest.split_whitespace().next()?.parse().ok()
    });
    seconds.ok_or_else(|| {
        format!("`povray` gave no time: {}", said.lines().last().unwrap_or_default())
    })
}

/// What Mitsuba answered.
pub struct Mitsuba {
    pub version: String,
    /// Of a frame of 4 samples.
    pub seconds: f64,
    /// Of 4 samples against `reference_samples`, at half the size; 0 where it was not asked for.
    pub rel_mse: f64,
    pub reference_samples: u32,
}

/// Renders the field with Mitsuba 3.
///
/// # Errors
/// Why it could not.
pub fn run_mitsuba(variant: &str, size: [u32; 2], with_error: bool) -> Result<Mitsuba, String> {
    let python = std::env::var("ALHAZEN_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let balls: Vec<_> = balls().iter().map(|b| (b.center, b.radius, b.kind)).collect();
    let scene = serde_json::json!({
        "variant": variant, "size": size, "with_error": with_error, "levels": LEVELS,
        "eye": EYE, "target": TARGET, "fov": FOV, "lights": LIGHTS, "tiles": TILES,
        "half": HALF, "colors": COLORS, "balls": balls,
    });
    let mut child = Command::new(&python)
        .args(["-c", SCRIPT])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|_| format!("`{python}` was not found"))?;
    if let Some(stdin) = child.stdin.take() {
        // It may have ended already: its exit code tells.
        let _ = { stdin }.write_all(scene.to_string().as_bytes());
    }
    let output = child.wait_with_output().map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&output.stderr);
    let reason = || said.lines().last().unwrap_or("no reason given").to_owned();
    if !output.status.success() {
        return Err(reason());
    }
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).map_err(|_| reason())?;
    let number = |name: &str| answer[name].as_f64().ok_or_else(reason);
    Ok(Mitsuba {
        version: answer["version"].as_str().unwrap_or_default().to_owned(),
        seconds: number("seconds")?,
        rel_mse: number("rel_mse")?,
        reference_samples: number("reference_samples")? as u32,
    })
}

/// Reads the scene from its standard input, and writes what it measured to its standard output.
const SCRIPT: &str = r#"
import json, sys, time
import numpy as np
import mitsuba as mi

given = json.load(sys.stdin)
mi.set_variant(given["variant"])
T = mi.ScalarTransform4f

def scene(size):
    rgb = lambda c: {"type": "rgb", "value": list(c)}
    d = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": given["levels"], "rr_depth": 1000},
        "sensor": {
            "type": "perspective", "fov_axis": "y", "fov": given["fov"],
            "to_world": T().look_at(origin=given["eye"], target=given["target"], up=[0, 0, 1]),
            "film": {"type": "hdrfilm", "width": size[0], "height": size[1],
                     "rfilter": {"type": "box"}, "pixel_format": "rgb",
                     "component_format": "float32"},
            "sampler": {"type": "independent", "sample_count": 4},
        },
        "kind0": {"type": "conductor", "material": "none"},
        "kind1": {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0},
    }
    for i, color in enumerate(given["colors"]):
        d[f"kind{i + 2}"] = {"type": "diffuse", "reflectance": rgb(color)}
    for i, (position, intensity) in enumerate(given["lights"]):
        d[f"light{i}"] = {"type": "point", "position": position, "intensity": rgb(intensity)}
    tiles = [rgb([g] * 3) for g in given["tiles"]]
    half = given["half"]
    d["floor"] = {
        "type": "rectangle", "to_world": T().scale([half, half, 1]),
        "bsdf": {"type": "diffuse", "reflectance": {
            "type": "checkerboard", "color0": tiles[0], "color1": tiles[1],
            "to_uv": T().scale([half, half, 1])}},
    }
    for i, (center, radius, kind) in enumerate(given["balls"]):
        d[f"ball{i}"] = {"type": "sphere", "center": center, "radius": radius,
                         "bsdf": {"type": "ref", "id": f"kind{kind}"}}
    return mi.load_dict(d)

def frame(scene, spp, seed):
    # As numbers in memory: nothing is left to be computed.
    return np.array(mi.render(scene, spp=spp, seed=seed)).astype(np.float64)

full = scene(given["size"])
times = []
for i in range(4):
    start = time.perf_counter()
    frame(full, 4, i)
    times.append(time.perf_counter() - start)
seconds = min(times[1:])

rel_mse, samples = 0.0, 0
if given["with_error"]:
    half = scene([x // 2 for x in given["size"]])
    samples = 1024 if seconds < 0.5 else 256
    part = 16
    reference = sum(frame(half, part, 1000 + i) for i in range(samples // part)) / (samples // part)
    a = frame(half, 4, 1)
    rel_mse = float(np.mean((a - reference) ** 2 / (reference ** 2 + 0.01)))
json.dump({"version": mi.__version__, "seconds": seconds, "rel_mse": rel_mse,
           "reference_samples": samples}, sys.stdout)
"#;
