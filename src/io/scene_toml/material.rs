//! `[materials.NAME]`.

use super::texture::{Textures, Varying};
use crate::color::{Rgb, VISIBLE_MAX, VISIBLE_MIN};
use crate::io::document::{Node, Value};
use crate::io::fields::{Fields, Reader};
use crate::material::{
    Conductor, Dielectric, FresnelModel, FresnelPower, GLASSES, Ior, METALS, Material,
    MirrorFresnel, Phong, PhongModel, glass, metal,
};
use crate::scene::{Maps, MaterialDesc};

/// The values of `type`.
#[derive(Clone, Copy)]
enum Kind {
    Diffuse,
    Phong,
    Mirror,
    Conductor,
    Dielectric,
}

impl Kind {
    const ALL: [(&'static str, Self); 5] = [
        ("diffuse", Self::Diffuse),
        ("phong", Self::Phong),
        ("mirror", Self::Mirror),
        ("conductor", Self::Conductor),
        ("dielectric", Self::Dielectric),
    ];
}

pub(super) fn material<'d>(
    reader: &Reader<'d>,
    textures: &mut Textures<'d, '_>,
    name: &str,
    fields: Fields<'d, '_>,
) -> Option<MaterialDesc> {
    // Without its type, nothing can be said of the other fields.
    let kind = fields.require("type").and_then(|node| fields.choose(node, "type", &Kind::ALL))?;
    let mut maps = Maps::default();
    let material = match kind {
        Kind::Diffuse => {
            let reflectance = textures.reflectance(&fields, "reflectance", Rgb::splat(0.6));
            maps.color = reflectance.texture;
            Material::Diffuse { reflectance: reflectance.color }
        }
        Kind::Phong => phong(reader, textures, &fields, &mut maps),
        Kind::Mirror => {
            let reflectance = textures.reflectance(&fields, "reflectance", Rgb::splat(1.0));
            maps.mirror = reflectance.texture;
            let fresnel = mirror_fresnel(reader, &fields);
            Material::Mirror { reflectance: reflectance.color, fresnel }
        }
        Kind::Conductor => {
            let (eta, k) = metal_indices(reader, &fields);
            let fresnel = fresnel(reader, &fields).unwrap_or_default();
            Material::Conductor(Conductor { eta, k, fresnel })
        }
        Kind::Dielectric => {
            let node = fields.get("ior");
            let ior = node.and_then(|node| ior(reader, node)).unwrap_or(Ior::Constant(1.5));
            Material::Dielectric(Dielectric {
                ior,
                absorption: fields.color("absorption").unwrap_or(Rgb::BLACK),
                priority: fields.signed("priority", -1000, 1000).unwrap_or(0),
                fresnel: fresnel(reader, &fields).unwrap_or_default(),
            })
        }
    };
    let emission = fields.color("emission").unwrap_or(Rgb::BLACK);
    textures.relief(&fields, &mut maps);
    fields.finish();
    Some(MaterialDesc { name: name.to_owned(), material, emission, maps })
}

fn phong<'d>(
    reader: &Reader<'d>,
    textures: &mut Textures<'d, '_>,
    fields: &Fields<'d, '_>,
    maps: &mut Maps,
) -> Material {
    let diffuse = textures.color(fields, "diffuse", Rgb::splat(0.6));
    let ambient = fields.color("ambient");
    // Ambient light shows the diffuse colour where nothing else is said.
    maps.colors_ambient = ambient.is_none();
    let specular = textures.color(fields, "specular", Rgb::BLACK);
    let shininess = match fields.get("shininess") {
        Some(node) => fields.not_negative(node, "shininess").unwrap_or(1.0),
        None => 32.0,
    };
    let models = [("blinn-phong", PhongModel::BlinnPhong), ("phong", PhongModel::Phong)];
    let model = fields.choice("model", &models).unwrap_or_default();
    let mirror: Varying = textures.color(fields, "mirror", Rgb::BLACK);
    let fresnel = mirror_fresnel(reader, fields);
    maps.color = diffuse.texture;
    maps.specular = specular.texture;
    maps.mirror = mirror.texture;
    Material::Phong(Phong {
        ambient: ambient.unwrap_or(diffuse.color),
        diffuse: diffuse.color,
        specular: specular.color,
        shininess: shininess as f32,
        model,
        mirror: mirror.color,
        fresnel,
    })
}

/// `fresnel` and, for the two laws that have use for it, `ior`.
fn mirror_fresnel(reader: &Reader<'_>, fields: &Fields<'_, '_>) -> Option<MirrorFresnel> {
    let model = fresnel(reader, fields);
    let ior = fields.get("ior").and_then(|node| index(reader, node, "ior"));
    model.map(|model| MirrorFresnel { model, ior: ior.unwrap_or(1.5) as f32 })
}

fn fresnel(reader: &Reader<'_>, fields: &Fields<'_, '_>) -> Option<FresnelModel> {
    const EXPECTED: &str =
        "\"exact\", \"schlick\", or a table such as { offset = 0.05, scale = 0.95, power = 5.0 }";
    let node = fields.get("fresnel")?;
    match &node.value {
        Value::String(_) => {
            let models = [("exact", FresnelModel::Exact), ("schlick", FresnelModel::Schlick)];
            fields.choose(node, "fresnel", &models)
        }
        Value::Table(_) => {
            let law = reader.table(node, "fresnel")?;
            let number = |name: &'static str, default: f64| match law.get(name) {
                Some(node) => law.not_negative(node, name).unwrap_or(default) as f32,
                None => default as f32,
            };
            let (offset, scale, power) =
                (number("offset", 0.0), number("scale", 1.0), number("power", 5.0));
            law.finish();
            Some(FresnelModel::Power(FresnelPower { offset, scale, power }))
        }
        _ => {
            reader.expected(node, "fresnel", EXPECTED);
            None
        }
    }
}

/// Indices of refraction that matter has, and some that it has not.
const INDICES: std::ops::RangeInclusive<f64> = 0.1..=10.0;

fn index(reader: &Reader<'_>, node: &Node, name: &str) -> Option<f64> {
    let n = reader.number(node, name)?;
    if INDICES.contains(&n) {
        return Some(n);
    }
    reader.expected(node, name, "an index of refraction from 0.1 to 10");
    None
}

/// An index of refraction: a number, a law or the name of a glass.
fn ior(reader: &Reader<'_>, node: &Node) -> Option<Ior> {
    const EXPECTED: &str = "an index of refraction, { cauchy = [A, B] }, \
        { sellmeier = [B1, B2, B3, C1, C2, C3] }, { abbe = [n_d, V_d] } or { glass = \"bk7\" }";
    let ior = match &node.value {
        Value::Integer(_) | Value::Float(_) => {
            return index(reader, node, "ior").map(Ior::Constant);
        }
        Value::Table(entries) => match entries.as_slice() {
            [entry] if entry.key == "cauchy" => {
                // The third term is for those who have it.
                let is_long = matches!(&entry.node.value, Value::Array(a) if a.len() == 3);
                let [a, b, c] = if is_long {
                    reader.numbers::<3>(&entry.node, "cauchy")?
                } else {
                    let [a, b] = reader.numbers::<2>(&entry.node, "cauchy")?;
                    [a, b, 0.0]
                };
                Ior::Cauchy { a, b, c }
            }
            [entry] if entry.key == "abbe" => {
                let [n_d, v_d] = reader.numbers::<2>(&entry.node, "abbe")?;
                if !(n_d > 1.0 && v_d > 0.0) {
                    reader.expected(&entry.node, "abbe", "[n_d, V_d], n_d above 1 and V_d above 0");
                    return None;
                }
                Ior::from_abbe(n_d, v_d)
            }
            [entry] if entry.key == "sellmeier" => {
                let [b1, b2, b3, c1, c2, c3] = reader.numbers::<6>(&entry.node, "sellmeier")?;
                Ior::Sellmeier { b: [b1, b2, b3], c: [c1, c2, c3] }
            }
            [entry] if entry.key == "glass" => {
                let names: Vec<&str> = GLASSES.iter().map(|(name, _)| *name).collect();
                return named(reader, &entry.node, "glass", &names).and_then(glass);
            }
            _ => {
                reader.expected(node, "ior", EXPECTED);
                return None;
            }
        },
        _ => {
            reader.expected(node, "ior", EXPECTED);
            return None;
        }
    };
    if !ior.is_sound(f64::from(VISIBLE_MIN), f64::from(VISIBLE_MAX)) {
        let message = "this law gives no positive index of refraction for all visible light \
            (its wavelengths are in micrometres)";
        reader.mistake(node.span, message);
        return None;
    }
    Some(ior)
}

/// The name of something that we know by name, whatever its case.
fn named<'n>(reader: &Reader<'_>, node: &Node, kind: &str, names: &[&'n str]) -> Option<&'n str> {
    let Value::String(text) = &node.value else {
        reader.expected(node, kind, "a name");
        return None;
    };
    let found = names.iter().find(|name| name.eq_ignore_ascii_case(text));
    if found.is_none() {
        let message = format!("unknown {kind} `{text}`; accepted: {}", names.join(", "));
        reader.mistake(node.span, message);
    }
    found.copied()
}

/// η and k, measured or as numbers.
fn metal_indices(reader: &Reader<'_>, fields: &Fields<'_, '_>) -> (Rgb, Rgb) {
    let default = (Rgb::splat(1.0), Rgb::splat(1.0));
    let (by_name, eta, k) = (fields.get("metal"), fields.get("eta"), fields.get("k"));
    match (by_name, eta, k) {
        (Some(node), None, None) => {
            let names: Vec<&str> = METALS.iter().map(|(name, _)| *name).collect();
            let found = named(reader, node, "metal", &names).and_then(metal);
            found.map_or(default, |metal| (metal.eta, metal.k))
        }
        (None, Some(eta), Some(k)) => {
            let eta_value = reader.color(eta, "eta").unwrap_or(default.0);
            if eta_value.to_array().contains(&0.0) {
                reader.mistake(eta.span, "`eta` must be above 0");
            }
            (eta_value, reader.color(k, "k").unwrap_or(default.1))
        }
        _ => {
            let message = "a conductor has either `metal`, or both `eta` and `k`";
            reader.mistake(fields.span(), message);
            default
        }
    }
}
