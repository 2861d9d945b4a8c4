//! OpenEXR: the channels R, G, B or Y of the first layer that has them, at full resolution.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{
    Compression, ReadChannels, ReadLayers, ReadSpecificChannel, SampleType, Vec2, read,
};

use super::{ColorSpace, Decoded, File, linear};
use crate::io::error::ReadError;
use crate::texture::Pixels;

/// Bytes of pixels that a byte of the file can stand for: PXR24 leaves a byte in four out before
/// deflate makes one of 1032; the others do less.
const EXPANSION: usize = 2048;

/// The same for DWA, which leaves out what does not change over 8 × 8 pixels.
const DWA_EXPANSION: usize = 64 * EXPANSION;

/// Decodes an OpenEXR file. Deep pictures are not read.
pub(super) fn decode(file: &File, space: ColorSpace) -> Result<Decoded, ReadError> {
    let failed = |error: exr::error::Error| file.damaged("OpenEXR", error);
    let meta = MetaData::read_from_buffered(Cursor::new(file.bytes), false).map_err(failed)?;
    for header in &meta.headers {
        check(file, header)?;
    }
    let (header, names) = choose(file, &meta.headers)?;
    let mut warnings = Vec::new();
    if header.data_window() != header.shared_attributes.display_window {
        warnings.push("its data window is not its display window; it was taken for all".to_owned());
    }
    let half = names.iter().all(|&name| sample_type(header, name) == Some(SampleType::F16));
    let Layer { size, mut values } = if names.len() == 1 {
        read_grey(file.bytes).map_err(failed)?
    } else {
        read_colors(file.bytes).map_err(failed)?
    };
    linear(space, &mut values);
    let pixels = if half { Pixels::half_or_float(values) } else { Pixels::Float(values) };
    Ok(Decoded { size: [size.0, size.1], channels: names.len(), pixels, warnings })
}

/// Checks what a layer claims before anything is decoded: the reader makes room for all of it.
fn check(file: &File, header: &Header) -> Result<(), ReadError> {
    let expansion = match header.compression {
        Compression::DWAA(_) | Compression::DWAB(_) => DWA_EXPANSION,
        _ => EXPANSION,
    };
    let size = [header.layer_size.width(), header.layer_size.height()];
    file.check(size, header.channels.bytes_per_pixel, expansion)?;
    if header.chunk_count > file.bytes.len() / 8 {
        return Err(file.wrong(format!(
            "the file ends too early: it claims {} blocks and has {} bytes",
            header.chunk_count,
            file.bytes.len()
        )));
    }
    Ok(())
}

const COLORS: [&str; 3] = ["R", "G", "B"];

/// The layer to read and its channels.
fn choose<'a>(
    file: &File,
    headers: &'a [Header],
) -> Result<(&'a Header, &'static [&'static str]), ReadError> {
    for names in [&COLORS[..], &["Y"]] {
        let has_all = |header: &&Header| {
            !header.deep && names.iter().all(|&name| sample_type(header, name).is_some())
        };
        if let Some(header) = headers.iter().find(has_all) {
            let whole = |c: &exr::meta::attribute::ChannelDescription| c.sampling == Vec2(1, 1);
            if !header.channels.list.iter().all(whole) {
                return Err(file.wrong("its channels are of different resolutions"));
            }
            return Ok((header, names));
        }
    }
    let mut found: Vec<String> = headers
        .iter()
        .filter(|header| !header.deep)
        .flat_map(|header| header.channels.list.iter().map(|c| c.name.to_string()))
        .take(16)
        .collect();
    if found.is_empty() {
        found.push("none that are not deep".to_owned());
    }
    Err(file.wrong(format!("no channels R, G, B or Y; it has: {}", found.join(", "))))
}

fn sample_type(header: &Header, name: &str) -> Option<SampleType> {
    header.channels.list.iter().find(|c| c.name == *name).map(|c| c.sample_type)
}

/// The values of a layer, rows from the top.
struct Layer {
    size: Vec2<usize>,
    values: Vec<f32>,
}

impl Layer {
    fn new(size: Vec2<usize>, channels: usize) -> Self {
        Self { size, values: vec![0.0; size.area() * channels] }
    }
}

fn read_colors(bytes: &[u8]) -> exr::error::Result<Layer> {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size, _| Layer::new(size, 3),
            |layer: &mut Layer, at, (r, g, b): (f32, f32, f32)| {
                let i = 3 * (at.y() * layer.size.width() + at.x());
                layer.values[i..i + 3].copy_from_slice(&[r, g, b]);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    Ok(image.layer_data.channel_data.pixels)
}

fn read_grey(bytes: &[u8]) -> exr::error::Result<Layer> {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("Y")
        .collect_pixels(
            |size, _| Layer::new(size, 1),
            |layer: &mut Layer, at, (y,): (f32,)| {
                layer.values[at.y() * layer.size.width() + at.x()] = y;
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    Ok(image.layer_data.channel_data.pixels)
}
