//! `[render]`.

use super::freeform::tolerance;
use crate::accel::{BuildQuality, Compact, Precision};
use crate::color::{VISIBLE_MAX, VISIBLE_MIN};
use crate::film::Filter;
use crate::io::document::{Node, Value};
use crate::io::fields::{Fields, Reader};
use crate::scene::{Epsilon, IntegratorKind, RenderSettings, Shadows};
use crate::texture::TexelFilter;

pub(super) fn settings(reader: &Reader<'_>, fields: Fields<'_, '_>) -> RenderSettings {
    let default = RenderSettings::default();
    let settings = RenderSettings {
        integrator: fields
            .choice("integrator", &IntegratorKind::ALL.map(|i| (i.name(), i)))
            .unwrap_or(default.integrator),
        samples: fields.integer("samples", 1, 1 << 24).unwrap_or(default.samples),
        max_depth: fields.integer("max_depth", 0, 1 << 20).unwrap_or(default.max_depth),
        precision: fields
            .choice("precision", &Precision::ALL.map(|p| (p.name(), p)))
            .unwrap_or(default.precision),
        prune: fields.fraction("prune").map_or(default.prune, |x| x as f32),
        roulette: fields.bool("roulette").unwrap_or(default.roulette),
        shadows: shadows(&fields).unwrap_or(default.shadows),
        shadow_samples: fields
            .integer("shadow_samples", 1, 1 << 16)
            .unwrap_or(default.shadow_samples),
        light_samples: fields.integer("light_samples", 1, 1 << 16).unwrap_or(default.light_samples),
        wavelength: fields.get("wavelength").and_then(|node| wavelength(reader, node)),
        ao_distance: fields
            .get("ao_distance")
            .and_then(|node| fields.positive(node, "ao_distance")),
        filter: fields
            .choice("filter", &Filter::ALL.map(|f| (f.name(), f)))
            .unwrap_or(default.filter),
        texture_filter: fields.choice("texture_filter", &TexelFilter::ALL.map(|f| (f.name(), f))),
        epsilon: match fields.get("epsilon") {
            None => default.epsilon,
            Some(node) => match &node.value {
                Value::String(text) if text == "auto" => Epsilon::Auto,
                Value::Integer(_) | Value::Float(_) => fields
                    .not_negative(node, "epsilon")
                    .map_or(default.epsilon, |e| Epsilon::Fixed(e as f32)),
                _ => {
                    reader.expected(node, "epsilon", "\"auto\" or a distance from 0 on");
                    default.epsilon
                }
            },
        },
        build_quality: fields
            .choice("build_quality", &BuildQuality::ALL.map(|q| (q.name(), q)))
            .unwrap_or(default.build_quality),
        compact: compact(&fields).unwrap_or(default.compact),
        tolerance: tolerance(&fields).unwrap_or(default.tolerance),
    };
    fields.finish();
    settings
}

fn compact(fields: &Fields<'_, '_>) -> Option<Compact> {
    let node = fields.get("compact")?;
    match &node.value {
        Value::Bool(true) => Some(Compact::On),
        Value::Bool(false) => Some(Compact::Off),
        Value::String(text) if text == "auto" => Some(Compact::Auto),
        _ => {
            fields.expected(node, "compact", "\"auto\", true or false");
            None
        }
    }
}

/// `true`, `false`, or what becomes of light that meets glass.
fn shadows(fields: &Fields<'_, '_>) -> Option<Shadows> {
    let node = fields.get("shadows")?;
    match &node.value {
        Value::Bool(true) => Some(Shadows::Opaque),
        Value::Bool(false) => Some(Shadows::None),
        Value::String(_) => fields.choose(node, "shadows", &Shadows::NAMED),
        _ => {
            let names = Shadows::NAMED.map(|(name, _)| format!("\"{name}\""));
            fields.expected(node, "shadows", &format!("true, false, {}", names.join(", ")));
            None
        }
    }
}

fn wavelength(reader: &Reader<'_>, node: &Node) -> Option<f64> {
    let nanometres = reader.number(node, "wavelength")?;
    if (f64::from(VISIBLE_MIN)..=f64::from(VISIBLE_MAX)).contains(&nanometres) {
        return Some(nanometres);
    }
    let expected = format!("a wavelength from {VISIBLE_MIN} to {VISIBLE_MAX} nm");
    reader.expected(node, "wavelength", &expected);
    None
}
