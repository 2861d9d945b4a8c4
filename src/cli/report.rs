//! What a render says at the end: a table for people, JSON for programs, attributes for the EXR.

use std::collections::BTreeSet;
use std::path::Path;

use serde::Serialize;

use super::units::{grouped, megabytes};
use super::{Failure, print, render::Phases};
use crate::accel::AccelInfo;
use crate::film::{Aov, Film, SamplingError};
use crate::io::{Attribute, AttributeValue, matte_attributes};
use crate::material::FresnelModel;
use crate::render::{Rendered, Stop};
use crate::scene::{Epsilon, IntegratorKind, Scene};
use crate::texture::TexelFilter;

/// The fields of `--stats`; their names are stable.
#[derive(Debug, Serialize)]
struct Stats<'a> {
    seconds: &'a Phases,
    rays: Rays,
    /// Where branches of the ray tree ended.
    ends: Branches,
    memory: Memory,
    samples: u32,
    /// Estimated relative sampling error; null at one sample a pixel.
    error: Option<f64>,
    /// Between which bounds the true one lies in 95 of 100 renders; null likewise.
    error_interval: Option<[f64; 2]>,
    /// What it was after how many samples, where a rule asked; the last is that of the picture.
    error_by_samples: Vec<ErrorAt>,
    /// Why the render ended: "samples", "error", "time" or "interrupted".
    stop: &'static str,
    non_finite_samples: u64,
    accelerator: String,
}

#[derive(Debug, Serialize)]
struct ErrorAt {
    samples: u32,
    error: f64,
    interval: [f64; 2],
}

#[derive(Debug, Serialize)]
struct Rays {
    camera: u64,
    shadow: u64,
    reflection: u64,
    refraction: u64,
    diffuse: u64,
}

/// Branches of the ray tree by the rule that ended them.
#[derive(Debug, Serialize)]
struct Branches {
    miss: u64,
    diffuse: u64,
    depth: u64,
    prune: u64,
    roulette: u64,
}

#[derive(Debug, Serialize)]
struct Memory {
    peak_bytes: u64,
    accelerator_bytes: u64,
}

/// Writes the statistics as JSON.
pub(super) fn write_stats(
    path: &Path,
    phases: &Phases,
    rendered: &Rendered,
    accel: &AccelInfo,
) -> Result<(), Failure> {
    let ends = rendered.rays.ends;
    let error = rendered.film.sampling_error();
    let mut errors = rendered.errors.clone();
    if let Some(error) = error.filter(|error| errors.last().is_none_or(|(_, e)| e != error)) {
        errors.push((rendered.samples, error));
    }
    let stats = Stats {
        seconds: phases,
        rays: Rays {
            camera: rendered.rays.camera,
            shadow: rendered.rays.shadow,
            reflection: rendered.rays.reflection,
            refraction: rendered.rays.refraction,
            diffuse: rendered.rays.diffuse,
        },
        ends: Branches {
            miss: ends.miss,
            diffuse: ends.diffuse,
            depth: ends.depth,
            prune: ends.prune,
            roulette: ends.roulette,
        },
        memory: Memory { peak_bytes: peak_bytes(), accelerator_bytes: accel.bytes },
        samples: rendered.samples,
        error: error.map(|e| e.value),
        error_interval: error.map(|e| [e.low, e.high]),
        error_by_samples: errors
            .into_iter()
            .map(|(samples, e)| ErrorAt { samples, error: e.value, interval: [e.low, e.high] })
            .collect(),
        stop: rendered.stop.name(),
        non_finite_samples: rendered.non_finite.count,
        accelerator: accel.to_string(),
    };
    let text = serde_json::to_string_pretty(&stats)
        .map_err(|e| Failure::Failed(format!("{}: {e}", path.display())))?;
    crate::io::write_text(path, &(text + "\n")).map_err(|e| Failure::Failed(e.to_string()))
}

/// Prints the closing table.
pub(super) fn print_table(phases: &Phases, rendered: &Rendered, accel: &AccelInfo) {
    let film = &rendered.film;
    let line = |name: &str, value: String| print(&format!("{name:>10}  {value}"));
    let (w, h) = (film.window.width(), film.window.height());
    let end = match rendered.stop {
        Stop::Samples | Stop::Interrupted => "",
        Stop::Error => ", enough for the error",
        Stop::Time => ", as many as the time allowed",
    };
    line("picture", format!("{w} x {h}, {} per pixel{end}", plural(rendered.samples, "sample")));
    line(
        "seconds",
        format!(
            "read {:.3}, build {:.3}, render {:.3}, write {:.3}, total {:.3}",
            phases.read, phases.build, phases.render, phases.write, phases.total
        ),
    );
    let rays = rendered.rays;
    let kinds = [
        (rays.camera, "camera"),
        (rays.shadow, "shadow"),
        (rays.reflection, "reflection"),
        (rays.refraction, "refraction"),
        (rays.diffuse, "ambient"),
    ];
    let speed = rays.total() as f64 / phases.render.max(1e-9) / 1e6;
    line("rays", format!("{}: {speed:.1} Mrays/s", listed(&kinds)));
    // Only a ray tree has branches.
    if rays.reflection + rays.refraction + rays.ends.depth > 0 {
        let ends = rays.ends;
        let rules = [
            (ends.miss, "met nothing"),
            (ends.diffuse, "met a surface that sends no rays on"),
            (ends.depth, "at max_depth"),
            (ends.prune, "by prune"),
            (ends.roulette, "by roulette"),
        ];
        line("branches", format!("ended: {}", listed(&rules)));
    }
    line(
        "memory",
        format!("{} at most, of it {} in {accel}", megabytes(peak_bytes()), megabytes(accel.bytes)),
    );
    line(
        "error",
        match film.sampling_error() {
            Some(SamplingError { value, low, high }) => format!(
                "{:.2} % of sampling (relative, root mean square), {:.2} to {:.2} % in 95 of 100",
                100.0 * value,
                100.0 * low,
                100.0 * high
            ),
            None => "unknown: one sample a pixel gives no estimate".to_owned(),
        },
    );
}

/// "3 camera, 1 shadow": what there is none of is left out.
fn listed(counts: &[(u64, &str)]) -> String {
    let there = counts.iter().filter(|(n, _)| *n > 0);
    let parts: Vec<String> = there.map(|(n, name)| format!("{} {name}", grouped(*n))).collect();
    if parts.is_empty() { "none".to_owned() } else { parts.join(", ") }
}

fn plural(n: u32, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// What the header of an EXR says of how the picture is made: renders of which all this is equal can be
/// joined. Nothing that changes from run to run.
pub(super) fn identity(
    scene: &Scene,
    scene_hash: u64,
    seed: u64,
    is_adaptive: bool,
) -> Vec<Attribute> {
    let text = |name, value| Attribute::new(name, AttributeValue::Text(value));
    let settings = &scene.settings;
    let accel = scene.accel.info();
    vec![
        text("alhazen.version", env!("CARGO_PKG_VERSION").to_owned()),
        text("alhazen.scene", format!("{scene_hash:016x}")),
        text("alhazen.seed", seed.to_string()),
        text("alhazen.integrator", settings.integrator.name().to_owned()),
        text("alhazen.filter", settings.filter.name().to_owned()),
        text("alhazen.precision", settings.precision.name().to_owned()),
        text("alhazen.accel", accel.name.clone()),
        text("alhazen.isa", accel.isa.to_owned()),
        Attribute::new(
            "alhazen.packetWidth",
            AttributeValue::Integer(i32::try_from(accel.packet_width).unwrap_or(i32::MAX)),
        ),
        text("alhazen.bias", biasing_options(scene, is_adaptive)),
        Attribute::new("alhazen.origin", AttributeValue::Vector(scene.center.as_vec3().to_array())),
    ]
}

/// What it says of its layers.
pub(super) fn of_layers(scene: &Scene, layers: &[Aov]) -> Vec<Attribute> {
    if layers.is_empty() {
        return Vec::new();
    }
    let names = layers.iter().map(|aov| aov.name()).collect::<Vec<_>>().join(" ");
    let mut list = vec![Attribute::new("alhazen.layers", AttributeValue::Text(names))];
    for aov in layers {
        match aov {
            Aov::CryptoObject => list.extend(matte_attributes(*aov, scene.object_names())),
            Aov::CryptoMaterial => list.extend(matte_attributes(*aov, scene.material_names())),
            _ => {}
        }
    }
    list
}

/// What it says of what came of it.
pub(super) fn outcome(film: &Film, samples: u32, stop: Stop) -> Vec<Attribute> {
    let samples = i32::try_from(samples).unwrap_or(i32::MAX);
    let mut list = vec![Attribute::new("alhazen.samples", AttributeValue::Integer(samples))];
    if let Some(SamplingError { value, low, high }) = film.sampling_error() {
        for (name, value) in
            [("alhazen.error", value), ("alhazen.errorLow", low), ("alhazen.errorHigh", high)]
        {
            list.push(Attribute::new(name, AttributeValue::Float(value)));
        }
    }
    if stop != Stop::Samples {
        list.push(Attribute::new("alhazen.stop", AttributeValue::Text(stop.name().to_owned())));
    }
    list
}

/// The options that shift the picture systematically, which the stated error does not cover.
fn biasing_options(scene: &Scene, is_adaptive: bool) -> String {
    let settings = &scene.settings;
    let mut list = vec![format!("precision={}", settings.precision.name())];
    if is_adaptive {
        list.push("adaptive=true".to_owned());
    }
    if let Epsilon::Fixed(epsilon) = settings.epsilon {
        list.push(format!("epsilon={epsilon}"));
    }
    if !settings.shadows.are_cast() {
        list.push("shadows=false".to_owned());
    }
    let r = &scene.requirements;
    if settings.integrator == IntegratorKind::Whitted && r.mirrors + r.dielectrics > 0 {
        list.push(format!("max_depth={}", settings.max_depth));
        if settings.prune > 0.0 && !settings.roulette {
            list.push(format!("prune={}", settings.prune));
        }
    }
    if r.dielectrics > 0 && r.shadow_rays {
        list.push(format!("shadows={}", settings.shadows.name()));
    }
    let mut say = |name: &str, values: Vec<String>| {
        let values: BTreeSet<String> = values.into_iter().map(|v| v.replace(' ', "")).collect();
        if !values.is_empty() {
            list.push(format!("{name}={}", Vec::from_iter(values).join(",")));
        }
    };
    if settings.integrator == IntegratorKind::Ao {
        say("ao_distance", settings.ao_distance.iter().map(ToString::to_string).collect());
    } else {
        let models = scene.fresnel_models().filter(|model| *model != FresnelModel::Exact);
        say("fresnel", models.map(|model| model.name().to_owned()).collect());
        let filters = scene.texture_filters().filter(|filter| *filter != TexelFilter::Bilinear);
        say("texture_filter", filters.map(|filter| filter.name().to_owned()).collect());
        let single = settings.wavelength.filter(|_| r.dispersive > 0);
        say("wavelength", single.iter().map(ToString::to_string).collect());
        if scene.fog.as_ref().is_some_and(|fog| !fog.dims_lights) {
            say("dims_lights", vec!["false".to_owned()]);
        }
    }
    say("tolerance", scene.tessellations.iter().map(|made| made.tolerance.to_string()).collect());
    say("volume_tolerance", scene.volumes.iter().map(|v| v.tolerance().to_string()).collect());
    list.join(" ")
}

/// The most memory that this process has held, from the kernel; 0 where it does not say.
pub(super) fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}
