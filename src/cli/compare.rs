//! `alhazen compare`: how far a picture is from a reference, and whether that is near enough.

use std::path::Path;

use serde::Serialize;

use super::args::CompareArgs;
use super::outputs::check_targets;
use super::units::grouped;
use super::{Failure, Outcome, print};
use crate::film::{Film, Layers, Picture, PixelRect};
use crate::io::{
    ExrOptions, PictureChannels, PixelType, ToneMap, WriteError, read_picture,
    read_picture_channels, write_exr, write_png, write_text,
};
use crate::measure::{
    CompareOptions, Comparison, absolute_difference, check_same_pixels, compare as measure,
    compare_channel, magma,
};

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
    /// Where they were asked for.
    channels: Option<Vec<Channel>>,
    /// Whether no limit was exceeded.
    passed: bool,
}

/// A channel by itself.
#[derive(Debug, Clone, Serialize)]
struct Channel {
    name: String,
    mse: f64,
    mae: f64,
    relmse: f64,
    max: f64,
    max_at: [u32; 2],
    non_finite: u64,
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
    let read = |path: &Path| read_picture(path).map_err(|e| Failure::BadInput(e.to_string()));
    let (a, b) = (read(&args.picture)?, read(&args.reference)?);
    let unequal = |e| {
        let (a, b) = (args.picture.display(), args.reference.display());
        Failure::BadInput(format!("{a} and {b} do not show the same pixels: {e}"))
    };
    check_same_pixels(&a, &b).map_err(unequal)?;
    let options = CompareOptions {
        hdr_flip: args.hdr_flip || args.max_hdr_flip.is_some(),
        ..CompareOptions::default()
    };
    let channels = args.channels.then(|| channels(args)).transpose()?;
    let found = measure(&a, &b, &options).map_err(unequal)?;
    let exceeded = exceeded(args, &found);

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
        write_json(path, args, &found, channels.clone(), exceeded.is_empty())?;
    }
    if !args.quiet {
        print_table(args, &found);
        print_channels(channels.as_deref().unwrap_or_default());
        for path in args.difference.iter().chain(&args.json) {
            print(&format!("{:>10}  {}", "wrote", path.display()));
        }
    }
    if exceeded.is_empty() { Ok(Outcome::Done) } else { Err(Failure::Failed(exceeded.join("\n"))) }
}

/// Every channel of both files.
fn channels(args: &CompareArgs) -> Result<Vec<Channel>, Failure> {
    let read =
        |path: &Path| read_picture_channels(path).map_err(|e| Failure::BadInput(e.to_string()));
    let (a, b) = (read(&args.picture)?, read(&args.reference)?);
    // Their pixels are the same: that was looked at before.
    let lacking = |of: &PictureChannels, other: &PictureChannels, path: &Path| {
        let has = |name: &str| of.channels.iter().any(|(n, _)| n == name);
        let names = other.channels.iter().map(|(name, _)| name).filter(|name| !has(name));
        let names: Vec<&str> = names.map(String::as_str).collect();
        (!names.is_empty()).then(|| format!("{} lacks {}", path.display(), names.join(", ")))
    };
    let lacks: Vec<String> = [lacking(&a, &b, &args.picture), lacking(&b, &a, &args.reference)]
        .into_iter()
        .flatten()
        .collect();
    if !lacks.is_empty() {
        let message =
            format!("--channels: {}; accepted: files of the same channels", lacks.join("; "));
        return Err(Failure::BadInput(message));
    }
    let channel = |(name, values): &(String, Vec<f32>)| {
        let (_, other) = b.channels.iter().find(|(n, _)| n == name)?;
        let found = compare_channel(values, other, a.extent[0]);
        Some(Channel {
            name: name.clone(),
            mse: found.mse,
            mae: found.mae,
            relmse: found.rel_mse,
            max: found.largest,
            max_at: found.largest_at,
            non_finite: found.non_finite,
        })
    };
    Ok(a.channels.iter().filter_map(channel).collect())
}

fn print_channels(channels: &[Channel]) {
    if channels.is_empty() {
        return;
    }
    print(&format!(
        "\n{:>22}{:>14}{:>14}{:>14}{:>14}{:>12}",
        "channel", "mse", "mae", "relmse", "max", "non-finite"
    ));
    for c in channels {
        print(&format!(
            "{:>22}{:>14}{:>14}{:>14}{:>14}{:>12}",
            c.name,
            digits(c.mse),
            digits(c.mae),
            digits(c.relmse),
            digits(c.max),
            c.non_finite
        ));
    }
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

/// A line for each limit that the pictures exceed. A metric that is undefined exceeds any.
fn exceeded(args: &CompareArgs, found: &Comparison) -> Vec<String> {
    let limits = [
        ("mse", found.mse, args.max_mse),
        ("mae", found.mae, args.max_mae),
        ("relmse", found.rel_mse, args.max_relmse),
        ("flip", found.flip, args.max_flip),
        ("hdr-flip", found.hdr_flip.map_or(f64::NAN, |(mean, _)| mean), args.max_hdr_flip),
    ];
    let given = || limits.iter().filter_map(|&(name, value, limit)| Some((name, value, limit?)));
    let mut lines: Vec<String> = given()
        .filter(|&(_, value, limit)| !(value <= limit))
        .map(|(name, value, limit)| {
            let (value, limit) = (digits(value), digits(limit));
            format!("{}: {name} is {value}, more than {limit}", args.picture.display())
        })
        .collect();
    if found.non_finite > 0 && given().next().is_some() {
        lines.push(format!(
            "{} or {}: {} pixels are NaN or infinite, more than 0",
            args.picture.display(),
            args.reference.display(),
            grouped(found.non_finite)
        ));
    }
    lines
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

fn print_table(args: &CompareArgs, found: &Comparison) {
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
}

fn write_json(
    path: &Path,
    args: &CompareArgs,
    found: &Comparison,
    channels: Option<Vec<Channel>>,
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
        channels,
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
