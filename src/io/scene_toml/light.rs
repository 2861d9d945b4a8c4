//! `[[lights]]` and `[medium]`.

use crate::color::Rgb;
use crate::io::fields::{Fields, Reader};
use crate::light::Falloff;
use crate::medium::{Fog, FogProfile};
use crate::scene::LightDesc;

/// The values of `type`.
#[derive(Clone, Copy)]
enum Kind {
    Point,
    Spot,
    Directional,
    Rectangle,
    Disk,
    Sphere,
}

impl Kind {
    const ALL: [(&'static str, Self); 6] = [
        ("point", Self::Point),
        ("spot", Self::Spot),
        ("directional", Self::Directional),
        ("rectangle", Self::Rectangle),
        ("disk", Self::Disk),
        ("sphere", Self::Sphere),
    ];
}

pub(super) fn light(reader: &Reader<'_>, fields: Fields<'_, '_>) -> Option<LightDesc> {
    let node = fields.require("type")?;
    let kind = fields.choose(node, "type", &Kind::ALL)?;
    let light = match kind {
        Kind::Point => point(&fields),
        Kind::Spot => spot(reader, &fields),
        Kind::Directional => {
            let direction = fields.require_direction("direction");
            let irradiance = fields.require_color("irradiance");
            direction
                .zip(irradiance)
                .map(|(direction, irradiance)| LightDesc::Directional { direction, irradiance })
        }
        Kind::Rectangle => rectangle(reader, &fields),
        Kind::Disk => {
            let center = fields.require_vector("center");
            let normal = fields.require_direction("normal");
            let radius = fields.require_positive("radius");
            let radiance = fields.require_color("radiance");
            (|| {
                let (center, normal, radius) = (center?, normal?, radius?);
                Some(LightDesc::Disk { center, normal, radius, radiance: radiance? })
            })()
        }
        Kind::Sphere => {
            let center = fields.require_vector("center");
            let radius = fields.require_positive("radius");
            let radiance = fields.require_color("radiance");
            (|| Some(LightDesc::Sphere { center: center?, radius: radius?, radiance: radiance? }))()
        }
    };
    fields.finish();
    light
}

fn point(fields: &Fields<'_, '_>) -> Option<LightDesc> {
    let position = fields.require_vector("position");
    let intensity = fields.require_color("intensity");
    let falloffs = [("inverse-square", Falloff::InverseSquare), ("none", Falloff::None)];
    let falloff = fields.choice("falloff", &falloffs).unwrap_or_default();
    let (position, intensity) = position.zip(intensity)?;
    Some(LightDesc::Point { position, intensity, falloff })
}

fn spot(reader: &Reader<'_>, fields: &Fields<'_, '_>) -> Option<LightDesc> {
    let position = fields.require_vector("position");
    let direction = fields.require_direction("direction");
    let intensity = fields.require_color("intensity");
    let angle = |name: &'static str, default: f64, max: f64| match fields.get(name) {
        None => Some(default),
        Some(node) => {
            let degrees = reader.number(node, name)?;
            if (0.0..=max).contains(&degrees) && (degrees > 0.0 || name == "penumbra_angle") {
                return Some(degrees);
            }
            let least = if name == "penumbra_angle" { "from 0" } else { "above 0" };
            fields.expected(node, name, &format!("an angle {least} to {max} degrees"));
            None
        }
    };
    let cone_angle = angle("cone_angle", 30.0, 180.0);
    let widest = cone_angle.unwrap_or(180.0);
    let penumbra_angle = angle("penumbra_angle", widest.min(5.0), widest);
    Some(LightDesc::Spot {
        position: position?,
        direction: direction?,
        intensity: intensity?,
        cone_angle: cone_angle?.to_radians(),
        penumbra_angle: penumbra_angle?.to_radians(),
    })
}

fn rectangle(reader: &Reader<'_>, fields: &Fields<'_, '_>) -> Option<LightDesc> {
    let corner = fields.require_vector("corner");
    let edge_u = fields.require_vector("edge_u");
    let edge_v = fields.require_vector("edge_v");
    let radiance = fields.require_color("radiance");
    let (edge_u, edge_v) = edge_u.zip(edge_v)?;
    let area = edge_u.cross(edge_v).length();
    // Also refuses NaN.
    if !(area > 1e-9 * edge_u.length() * edge_v.length()) {
        let message = "`edge_u` and `edge_v` of a rectangle must span an area";
        reader.mistake(fields.span(), message);
        return None;
    }
    Some(LightDesc::Rectangle { corner: corner?, edge_u, edge_v, radiance: radiance? })
}

/// Fog: homogeneous, thinning out upwards, or by distance alone.
pub(super) fn fog(reader: &Reader<'_>, fields: Fields<'_, '_>) -> Option<Fog> {
    let node = fields.require("type")?;
    let kinds = [("fog", 0), ("height-fog", 1), ("distance-fog", 2)];
    let kind = fields.choose(node, "type", &kinds)?;
    let radiance = fields.color("radiance").unwrap_or(Rgb::splat(1.0));
    let mut fog = Fog {
        scattering: Rgb::splat(1.0),
        absorption: Rgb::BLACK,
        radiance,
        profile: FogProfile::Homogeneous,
        dims_lights: false,
    };
    if kind != 2 {
        let scattering = fields.color("scattering");
        let absorption = fields.color("absorption");
        if scattering.is_none() && absorption.is_none() {
            reader.mistake(fields.span(), "fog needs `scattering`, `absorption` or both");
        }
        fog.scattering = scattering.unwrap_or(Rgb::BLACK);
        fog.absorption = absorption.unwrap_or(Rgb::BLACK);
        fog.dims_lights = fields.bool("dims_lights").unwrap_or(true);
    }
    match kind {
        1 => {
            let number = |node| reader.number(node, "base");
            let base = fields.get("base").and_then(number).unwrap_or(0.0);
            let height = fields.require("height").and_then(|node| fields.positive(node, "height"));
            fog.profile = FogProfile::Height { base, height: height.unwrap_or(1.0) };
        }
        2 => {
            let start = fields.get("start");
            let start = start.and_then(|node| fields.not_negative(node, "start")).unwrap_or(0.0);
            let node = fields.require("end");
            let end = node.and_then(|node| fields.positive(node, "end")).unwrap_or(start + 1.0);
            if let Some(node) = node
                && end <= start
            {
                reader.mistake(node.span, format!("`end` must be beyond `start`, {start}"));
            }
            fog.profile = FogProfile::Distance { start, end };
        }
        _ => {}
    }
    fields.finish();
    Some(fog)
}
