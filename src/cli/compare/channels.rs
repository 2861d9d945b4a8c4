//! Every channel and layer of two pictures by itself.

use std::path::Path;

use serde::Serialize;

use super::digits;
use crate::cli::args::CompareArgs;
use crate::cli::{Failure, print};
use crate::color::Rgb;
use crate::film::Picture;
use crate::io::{Attribute, AttributeValue, PictureChannels, PictureFile};
use crate::measure::{
    ChannelComparison, CompareOptions, compare, compare_channel, compare_layer, count_differing,
};

/// A channel or a layer of several by itself. What says nothing of it is null: PSNR and FLIP are of colours, and
/// ids are the same or not.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Row {
    pub(super) name: String,
    pub(super) mse: Option<f64>,
    pub(super) mae: Option<f64>,
    pub(super) relmse: Option<f64>,
    /// Decibels, clipped to [0, 1].
    pub(super) psnr: Option<f64>,
    pub(super) flip: Option<f64>,
    pub(super) max: Option<f64>,
    /// Of ids: the first pixel that differs.
    max_at: Option<[u32; 2]>,
    pub(super) non_finite: u64,
    /// Ids that are not the same.
    pub(super) differing: Option<u64>,
}

/// What [`compared`] finds.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    pub(super) channels: Vec<Row>,
    /// Of those with a name.
    pub(super) layers: Vec<Row>,
}

/// Channels that one of two pictures lacks.
#[derive(Debug, Default)]
pub(super) struct Unequal {
    pub(super) only_in_picture: Vec<String>,
    pub(super) only_in_reference: Vec<String>,
}

impl Unequal {
    /// Of two files. Nothing is known of those that hold several parts.
    pub(super) fn of(picture: &PictureFile<'_>, reference: &PictureFile<'_>) -> Self {
        let (Ok(a), Ok(b)) = (picture.channel_names(), reference.channel_names()) else {
            return Self::default();
        };
        let only = |a: &[String], b: &[String]| {
            a.iter().filter(|name| !b.contains(name)).cloned().collect()
        };
        Self { only_in_picture: only(&a, &b), only_in_reference: only(&b, &a) }
    }

    /// In words; none where both have the same.
    pub(super) fn told(&self, args: &CompareArgs) -> Option<String> {
        let lacks = |path: &Path, names: &[String]| {
            (!names.is_empty()).then(|| format!("{} lacks {}", path.display(), names.join(", ")))
        };
        let both = [
            lacks(&args.picture, &self.only_in_reference),
            lacks(&args.reference, &self.only_in_picture),
        ];
        let both: Vec<String> = both.into_iter().flatten().collect();
        (!both.is_empty()).then(|| both.join("; "))
    }
}

/// Every channel and layer of both files, whose pixels are the same.
pub(super) fn compared(
    args: &CompareArgs,
    [picture, reference]: [&PictureFile<'_>; 2],
    unequal: &Unequal,
) -> Result<Rows, Failure> {
    if let Some(told) = unequal.told(args) {
        let message = format!("--channels: {told}; accepted: files of the same channels");
        return Err(Failure::BadInput(message));
    }
    let channels =
        |of: &PictureFile<'_>| of.channels().map_err(|e| Failure::BadInput(e.to_string()));
    let (a, b) = (channels(picture)?, channels(reference)?);
    let width = a.extent[0];
    let cryptomattes = cryptomattes(&b.attributes);
    let mut rows = Rows::default();
    // By layer, in the order of their first channels.
    let mut layers: Vec<Layer<'_>> = Vec::new();
    for (name, values) in &a.channels {
        let Some((_, other)) = b.channels.iter().find(|(n, _)| n == name) else { continue };
        let (layer, last) = name.rsplit_once('.').unwrap_or(("", name));
        let at = layers.iter().position(|l| l.name == layer).unwrap_or_else(|| {
            layers.push(Layer { name: layer, ..Layer::default() });
            layers.len() - 1
        });
        if is_id(&cryptomattes, layer, last) {
            let (count, first) = count_differing(values, other, width);
            let max_at = (count > 0).then_some(first);
            let name = name.clone();
            rows.channels.push(Row { name, differing: Some(count), max_at, ..Row::default() });
            layers[at].differing = Some(layers[at].differing.unwrap_or(0) + count);
        } else {
            let found = compare_channel(values, other, width);
            let is_colour = ["R", "G", "B", "A", "Y"].contains(&last);
            rows.channels.push(row(name, &found, is_colour));
            layers[at].channels.push(found);
        }
    }
    for layer in layers.into_iter().filter(|layer| !layer.name.is_empty()) {
        let looks = colours(&a, layer.name).zip(colours(&b, layer.name));
        let looks = looks.filter(|_| layer.differing.is_none());
        let mut found = row(layer.name, &compare_layer(&layer.channels), looks.is_some());
        if layer.channels.is_empty() {
            found = Row { name: layer.name.to_owned(), ..Row::default() };
        }
        found.differing = layer.differing;
        let compared = looks.map(|(a, b)| compare(&a, &b, &CompareOptions::default()));
        found.flip = compared.and_then(Result::ok).map(|looks| looks.flip);
        rows.layers.push(found);
    }
    Ok(rows)
}

/// Some channels of the same layer.
#[derive(Default)]
struct Layer<'a> {
    name: &'a str,
    channels: Vec<ChannelComparison>,
    differing: Option<u64>,
}

fn row(name: &str, found: &ChannelComparison, is_colour: bool) -> Row {
    Row {
        name: name.to_owned(),
        mse: Some(found.mse),
        mae: Some(found.mae),
        relmse: Some(found.rel_mse),
        psnr: is_colour.then_some(found.psnr),
        flip: None,
        max: Some(found.largest),
        max_at: Some(found.largest_at),
        non_finite: found.non_finite,
        differing: None,
    }
}

/// The layers that a header calls Cryptomattes.
fn cryptomattes(attributes: &[Attribute]) -> Vec<&str> {
    let names = attributes.iter().filter_map(|a| match &a.value {
        AttributeValue::Text(layer) => {
            let key = a.name.strip_prefix("cryptomatte/")?;
            key.ends_with("/name").then_some(layer.as_str())
        }
        _ => None,
    });
    names.collect()
}

/// Whether a channel holds ids: red and blue of the numbered layers of a Cryptomatte, green and alpha of which
/// are shares (specification 1.2.0).
fn is_id(cryptomattes: &[&str], layer: &str, channel: &str) -> bool {
    let is_numbered = |name: &&str| {
        let digits = layer.strip_prefix(name);
        digits.is_some_and(|d| !d.is_empty() && d.bytes().all(|c| c.is_ascii_digit()))
    };
    ["r", "b", "red", "blue"].contains(&channel.to_ascii_lowercase().as_str())
        && cryptomattes.iter().any(is_numbered)
}

/// The colours of a layer, where it has all three.
fn colours(of: &PictureChannels, layer: &str) -> Option<Picture> {
    let channel = |name: &str| {
        let name = format!("{layer}.{name}");
        of.channels.iter().find(|(n, _)| *n == name).map(|(_, values)| values)
    };
    let (r, g, b) = (channel("R")?, channel("G")?, channel("B")?);
    let pixels = r.iter().zip(g).zip(b).map(|((&r, &g), &b)| Rgb::new(r, g, b)).collect();
    Some(Picture::whole(of.extent, pixels))
}

/// A table of layers and one of channels.
pub(super) fn print_rows(rows: &Rows) {
    for (what, rows) in [("layer", &rows.layers), ("channel", &rows.channels)] {
        if rows.is_empty() {
            continue;
        }
        print(&format!(
            "\n{what:>22}{:>13}{:>13}{:>13}{:>10}{:>10}{:>13}{:>12}{:>11}",
            "mse", "mae", "relmse", "psnr", "flip", "max", "non-finite", "differing"
        ));
        for r in rows {
            let number = |x: Option<f64>| x.map_or("-".to_owned(), digits);
            let psnr = r.psnr.map_or("-".to_owned(), |x| format!("{x:.2}"));
            let differing = r.differing.map_or("-".to_owned(), |n| n.to_string());
            print(&format!(
                "{:>22}{:>13}{:>13}{:>13}{psnr:>10}{:>10}{:>13}{:>12}{differing:>11}",
                r.name,
                number(r.mse),
                number(r.mae),
                number(r.relmse),
                number(r.flip),
                number(r.max),
                r.non_finite,
            ));
        }
    }
}
