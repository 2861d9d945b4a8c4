//! `alhazen compare`: how far a picture is from a reference, and whether that is near enough.

mod channels;
mod limits;

pub(super) use limits::{ChannelLimit, parse_channel_limit};

use std::path::Path;

use serde::Serialize;

use super::args::CompareArgs;
use super::outputs::check_targets;
use super::units::grouped;
use super::{Failure, Outcome, print};
use crate::film::{Film, Layers, Picture, PixelRect};
use crate::io::{
    ExrOptions, PictureFile, PixelType, ReadError, ToneMap, WriteError, write_exr, write_png,
    write_text,
};
use crate::measure::{
    CompareOptions, Comparison, absolute_difference, check_same_pixels, compare as measure, magma,
};
use channels::{Row, Rows, Unequal};

/// The fields of `--json`; their names are stable. A number that is infinite or undefined is null.
#[derive(Debug, Serialize)]
struct Report<'a> {
    picture: &'a Path,
    reference: &'a Path,
    size: [u32; 2],
    mse: f64,
    mae: f64,
    relmse: f64,
    /// Decibels, of the pictures clipped to [0, 1].
    psnr: f64,
    max: f64,
    max_at: [u32; 2],
    flip: f64,
    /// Where it was asked for.
    hdr_flip: Option<f64>,
    /// First and last, in stops.
    hdr_flip_exposures: Option<[f32; 2]>,
    non_finite: u64,
    /// Channels that one file alone has.
    only_in_picture: &'a [String],
    only_in_reference: &'a [String],
    /// Where they were asked for.
    channels: Option<&'a [Row]>,
    layers: Option<&'a [Row]>,
    /// Whether no limit was exceeded.
    passed: bool,
}

/// A picture of the difference.
enum Difference<'a> {
    /// |a − b|.
    Exr(&'a Path),
    /// FLIP in colours.
    Png(&'a Path),
}

/// Compares, prints, writes what was asked for.
pub(super) fn compare(args: &CompareArgs) -> Result<Outcome, Failure> {
    let difference = args.difference.as_deref().map(kind).transpose()?;
    let read = [args.picture.as_path(), args.reference.as_path()];
    check_targets(read, args.difference.iter().chain(&args.json))?;
    let bad = |e: ReadError| Failure::BadInput(e.to_string());
    let picture = PictureFile::read(&args.picture).map_err(bad)?;
    let reference = PictureFile::read(&args.reference).map_err(bad)?;
    let (a, b) = (picture.picture().map_err(bad)?, reference.picture().map_err(bad)?);
    let unequal = |e| {
        let (a, b) = (args.picture.display(), args.reference.display());
        Failure::BadInput(format!("{a} and {b} do not show the same pixels: {e}"))
    };
    check_same_pixels(&a, &b).map_err(unequal)?;
    let options = CompareOptions {
        hdr_flip: args.hdr_flip || args.max_hdr_flip.is_some(),
        ..CompareOptions::default()
    };
    let others = Unequal::of(&picture, &reference);
    let by_channel = args.channels || !args.limit.is_empty();
    let files = [&picture, &reference];
    let rows = by_channel.then(|| channels::compared(args, files, &others)).transpose()?;
    let found = measure(&a, &b, &options).map_err(unequal)?;
    let none = Rows::default();
    let exceeded = limits::exceeded(args, &found, rows.as_ref().unwrap_or(&none))?;

    let failed = |e: WriteError| Failure::Failed(e.to_string());
    match difference {
        Some(Difference::Exr(path)) => {
            let film = film(absolute_difference(&a, &b).map_err(unequal)?);
            // Differences of halves need not be halves.
            let options = ExrOptions { pixel_type: PixelType::Float, ..ExrOptions::default() };
            write_exr(path, &film, &[], &options).map_err(failed)?;
        }
        Some(Difference::Png(path)) => {
            let pixels = found.flip_map.iter().map(|&x| magma(x)).collect();
            write_png(path, &film(Picture { pixels, ..b }), 0.0, ToneMap::Srgb).map_err(failed)?;
        }
        None => {}
    }
    if let Some(path) = &args.json {
        write_json(path, args, &found, &others, rows.as_ref(), exceeded.is_empty())?;
    }
    if !args.quiet {
        print_table(args, &found, &others);
        channels::print_rows(rows.as_ref().unwrap_or(&none));
        for path in args.difference.iter().chain(&args.json) {
            print(&format!("{:>10}  {}", "wrote", path.display()));
        }
    }
    if exceeded.is_empty() { Ok(Outcome::Done) } else { Err(Failure::Failed(exceeded.join("\n"))) }
}

fn kind(path: &Path) -> Result<Difference<'_>, Failure> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "exr" => Ok(Difference::Exr(path)),
        "png" => Ok(Difference::Png(path)),
        _ => Err(Failure::BadInput(format!(
            "{}: unknown kind of picture; accepted: .exr, .png",
            path.display()
        ))),
    }
}

/// Six digits, and a power of ten where a plain number would be long.
fn digits(value: f64) -> String {
    if value.is_nan() {
        "undefined".to_owned()
    } else if value == 0.0 || value.is_infinite() || (1e-3..1e6).contains(&value.abs()) {
        format!("{value:.6}")
    } else {
        format!("{value:.5e}")
    }
}

fn print_table(args: &CompareArgs, found: &Comparison, others: &Unequal) {
    let line = |name: &str, value: String| print(&format!("{name:>10}  {value}"));
    let [width, height] = found.size;
    line(
        "compared",
        format!("{} with {}, {width} x {height}", args.picture.display(), args.reference.display()),
    );
    line("mse", digits(found.mse));
    line("mae", digits(found.mae));
    line("relmse", digits(found.rel_mse));
    let psnr = if found.psnr.is_nan() {
        digits(found.psnr)
    } else {
        format!("{:.2} dB, clipped to [0, 1]", found.psnr)
    };
    line("psnr", psnr);
    let [x, y] = found.largest_at;
    let at = if found.largest > 0.0 { format!(" at pixel {x},{y}") } else { String::new() };
    line("max", digits(found.largest) + &at);
    line("flip", digits(found.flip));
    if let Some((mean, e)) = found.hdr_flip {
        let exposures = format!(", exposures {:+.2} to {:+.2} EV", e.first, e.last);
        line("hdr-flip", digits(mean) + &exposures);
    }
    line("non-finite", format!("{} pixels", grouped(found.non_finite)));
    if let Some(told) = others.told(args) {
        line("channels", told);
    }
}

fn write_json(
    path: &Path,
    args: &CompareArgs,
    found: &Comparison,
    others: &Unequal,
    rows: Option<&Rows>,
    passed: bool,
) -> Result<(), Failure> {
    let report = Report {
        picture: &args.picture,
        reference: &args.reference,
        size: found.size,
        mse: found.mse,
        mae: found.mae,
        relmse: found.rel_mse,
        psnr: found.psnr,
        max: found.largest,
        max_at: found.largest_at,
        flip: found.flip,
        hdr_flip: found.hdr_flip.map(|(mean, _)| mean),
        hdr_flip_exposures: found.hdr_flip.map(|(_, e)| [e.first, e.last]),
        non_finite: found.non_finite,
        only_in_picture: &others.only_in_picture,
        only_in_reference: &others.only_in_reference,
        channels: rows.map(|rows| rows.channels.as_slice()),
        layers: rows.map(|rows| rows.layers.as_slice()),
        passed,
    };
    let text = serde_json::to_string_pretty(&report)
        .map_err(|e| Failure::Failed(format!("{}: {e}", path.display())))?;
    write_text(path, &(text + "\n")).map_err(|e| Failure::Failed(e.to_string()))
}

/// As the writers want it. A part that overhangs the whole is written as a whole of its own.
fn film(picture: Picture) -> Film {
    let [width, height] = picture.extent;
    let [x0, y0] = picture.origin.unwrap_or_default().map(|x| u32::try_from(x).ok());
    let inside = x0.zip(y0).filter(|&(x, y)| {
        x.checked_add(width).is_some_and(|x1| x1 <= picture.size[0])
            && y.checked_add(height).is_some_and(|y1| y1 <= picture.size[1])
    });
    let (size, window) = match inside {
        Some((x0, y0)) => (picture.size, PixelRect { x0, y0, x1: x0 + width, y1: y0 + height }),
        None => (picture.extent, PixelRect::whole(picture.extent)),
    };
    Film { size, window, mean: picture.pixels, standard_error: None, layers: Layers::default() }
}
