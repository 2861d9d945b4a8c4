//! The layers of a picture as channels of an EXR file, under the names that compositors look for; and
//! Cryptomatte, by its specification.
//!
//! Source of the latter: Psyop, *Cryptomatte Specification* 1.2.0.

use super::exr::Channel;
use super::output::{Attribute, AttributeValue};
use crate::film::{Aov, CenterLayers, Film, Shares, cryptomatte_id, cryptomatte_key};

/// Ids of a Cryptomatte that a pixel can name: as many as is common.
pub const CRYPTOMATTE_RANKS: usize = 6;

/// The name of the layer of a Cryptomatte.
const fn matte_layer(aov: Aov) -> &'static str {
    match aov {
        Aov::CryptoMaterial => "CryptoMaterial",
        _ => "CryptoObject",
    }
}

/// All channels of a picture: R, G and B, and its layers.
pub fn film_channels(film: &Film) -> Vec<Channel<'_>> {
    let width = film.window.width();
    let rgb = |prefix: &str| ["R", "G", "B"].map(|c| format!("{prefix}{c}"));
    let xyz = |prefix: &str| ["X", "Y", "Z"].map(|c| format!("{prefix}{c}"));
    let mut channels = Vec::from(Channel::of_plane(rgb(""), &film.mean, width));
    let layers = &film.layers;
    for &aov in &layers.wanted {
        let prefix = format!("{}.", aov.name());
        match aov {
            Aov::Albedo | Aov::Direct => {
                let plane = layers.mean(aov).unwrap_or_default();
                channels.extend(Channel::of_plane(rgb(&prefix), plane, width));
            }
            Aov::Normal | Aov::ShadingNormal => {
                let plane = layers.mean(aov).unwrap_or_default();
                channels.extend(Channel::of_plane(xyz(&prefix), plane, width));
            }
            Aov::Indirect => {
                let direct = layers.mean(Aov::Direct).unwrap_or_default();
                channels.extend((0..3).zip(rgb(&prefix)).map(|(c, name)| {
                    let value =
                        move |i: usize| film.mean[i].to_array()[c] - direct[i].to_array()[c];
                    Channel::color(name, each_pixel(width, value))
                }));
            }
            Aov::Variance => {
                // Where one sample shows none, there is no such layer.
                let Some(error) = &film.standard_error else { continue };
                channels.extend((0..3).zip(rgb(&prefix)).map(|(c, name)| {
                    let value = move |i: usize| error[i].to_array()[c].powi(2);
                    Channel::float(name, each_pixel(width, value))
                }));
            }
            Aov::Samples => {
                let samples = &layers.samples;
                let name = format!("{prefix}Y");
                channels.push(Channel::float(name, each_pixel(width, |i| samples[i] as f32)));
            }
            Aov::CryptoObject | Aov::CryptoMaterial => {
                let found = layers.mattes.iter().find(|(of, _)| *of == aov);
                if let Some((_, shares)) = found {
                    channels.extend(matte_channels(matte_layer(aov), shares, width));
                }
            }
            Aov::Depth | Aov::Position | Aov::Uv | Aov::ObjectId | Aov::MaterialId => {}
        }
    }
    channels.extend(center_channels(&layers.center, width));
    channels
}

/// Rows of a function of the pixel's number.
fn each_pixel<'a>(
    width: u32,
    value: impl Fn(usize) -> f32 + Sync + 'a,
) -> impl Fn([u32; 2], &mut [f32]) + Sync + 'a {
    move |[x, y], out| {
        let first = y as usize * width as usize + x as usize;
        out.iter_mut().enumerate().for_each(|(i, out)| *out = value(first + i));
    }
}

/// The channels of what the middles of pixels show: as many as there are planes.
pub(super) fn center_channels(center: &CenterLayers, width: u32) -> Vec<Channel<'_>> {
    let CenterLayers { depth, position, uv, object_id, material_id } = center;
    let mut channels = Vec::new();
    // Depth has a name of its own in all that read EXR.
    for (name, plane) in [("Z", depth), ("object_id.Y", object_id), ("material_id.Y", material_id)]
    {
        if !plane.is_empty() {
            channels.push(Channel::float(name, each_pixel(width, |i| plane[i])));
        }
    }
    for (c, name) in ["position.X", "position.Y", "position.Z"].into_iter().enumerate() {
        if !position.is_empty() {
            channels.push(Channel::float(name, each_pixel(width, move |i| position[i][c])));
        }
    }
    for (c, name) in ["uv.U", "uv.V"].into_iter().enumerate() {
        if !uv.is_empty() {
            channels.push(Channel::float(name, each_pixel(width, move |i| uv[i][c])));
        }
    }
    channels
}

/// The planes of what the middles of pixels show, from channels by name.
pub(super) fn center_from<'c>(channel: impl Fn(&str) -> Option<&'c [u32]>) -> CenterLayers {
    let plane = |name: &str| -> Vec<f32> {
        channel(name).unwrap_or_default().iter().map(|bits| f32::from_bits(*bits)).collect()
    };
    let [x, y, z, u, v] = ["position.X", "position.Y", "position.Z", "uv.U", "uv.V"].map(plane);
    CenterLayers {
        depth: plane("Z"),
        position: x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]).collect(),
        uv: u.into_iter().zip(v).map(|(u, v)| [u, v]).collect(),
        object_id: plane("object_id.Y"),
        material_id: plane("material_id.Y"),
    }
}

/// The ids of a Cryptomatte and the share of the pixel that each covers, two ids to a layer of four
/// channels, the largest share first.
fn matte_channels<'a>(layer: &'a str, pixels: &'a [Shares], width: u32) -> Vec<Channel<'a>> {
    let channel = |rank: usize, is_id: bool| {
        let letter = [["R", "G"], ["B", "A"]][rank % 2][usize::from(!is_id)];
        let name = format!("{layer}{:02}.{letter}", rank / 2);
        let value = move |i: usize| {
            let shares = &pixels[i];
            let (id, count) = ranked(shares)[rank];
            if is_id {
                return f32::from_bits(id);
            }
            let all: i64 = shares.iter().map(|(_, count)| i64::from(*count)).sum();
            if all > 0 { (f64::from(count) / all as f64) as f32 } else { 0.0 }
        };
        Channel::float(name, each_pixel(width, value))
    };
    (0..CRYPTOMATTE_RANKS).flat_map(|rank| [channel(rank, true), channel(rank, false)]).collect()
}

/// The ids that a pixel shows most of and their counts, the largest first; 0 after the last.
fn ranked(shares: &Shares) -> [(u32, i32); CRYPTOMATTE_RANKS] {
    let mut ranked = [(0, 0); CRYPTOMATTE_RANKS];
    for &(id, count) in shares.iter().filter(|(id, count)| *id != 0 && *count > 0) {
        // Ids come in their order, so that of equal counts the lower id is first.
        let at = ranked.partition_point(|(_, other)| *other >= count);
        if at < CRYPTOMATTE_RANKS {
            ranked[at..].rotate_right(1);
            ranked[at] = (id, count);
        }
    }
    ranked
}

/// What the header says of a Cryptomatte: how its ids are made, and the names behind them.
pub fn matte_attributes(aov: Aov, names: &[String]) -> Vec<Attribute> {
    let layer = matte_layer(aov);
    let key = cryptomatte_key(layer);
    let text = |field: &str, value: String| {
        Attribute::new(format!("cryptomatte/{key}/{field}"), AttributeValue::Text(value))
    };
    let ids: serde_json::Map<String, serde_json::Value> = names
        .iter()
        .map(|name| (name.clone(), format!("{:08x}", cryptomatte_id(name)).into()))
        .collect();
    vec![
        text("name", layer.to_owned()),
        text("hash", "MurmurHash3_32".to_owned()),
        text("conversion", "uint32_to_float32".to_owned()),
        text("manifest", serde_json::Value::Object(ids).to_string()),
    ]
}
