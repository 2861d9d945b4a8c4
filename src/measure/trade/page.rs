//! The report as a page: settings, charts, a table and pictures for each knob.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::chart::{error_by_samples, error_by_seconds, memory_by_seconds};
use super::{HalfLoss, KnobReport, Point, Recommendation, Target, TradeReport};
use crate::color::Rgb;
use crate::film::Picture;
use crate::measure::html::{escaped, page};
use crate::measure::magma;

/// Most pixels across of the pictures in the page.
const THUMBNAIL: u32 = 320;

/// How pictures become PNG.
type Png<'a> = &'a dyn Fn(&Picture) -> Vec<u8>;

/// The report on `scene` as an HTML page. `png` makes a PNG of a picture.
pub fn html(scene: &str, report: &TradeReport, reference: &Picture, png: Png<'_>) -> String {
    let [width, height] = report.size;
    let mut body = format!(
        "<h1>{}</h1>\n<p>{width} × {height} pixels, {} threads, medians of {} rounds. Errors are relative, \
         bias included, against a reference with an error of {} of its own: <code>{}</code>. Pictures of \
         flags are those of <code>alhazen render {} FLAGS</code>.</p>\n",
        escaped(scene),
        report.threads,
        report.rounds,
        percent(report.reference_error),
        escaped(&report.reference),
        escaped(scene),
    );
    if !report.recommendations.is_empty() {
        body += "<h2>Recommended</h2>\n";
        report.recommendations.iter().for_each(|found| body += &recommended(scene, found));
    }
    body += "<h2>Error by seconds</h2>\n<p>The line joins the scene's own settings at several numbers of \
             samples; what nothing measured beats in both is ringed and named.</p>\n";
    body += &error_by_seconds(report);
    body += "<div class=\"strip\">";
    body += &figure("reference", reference, png);
    body += &figure("as it stands", &report.base.looks.0, png);
    body += &figure("its FLIP", &difference(&report.base), png);
    body += "</div>\n<h2>Samples</h2>\n";
    if let Some(slope) = report.slope {
        let _ = writeln!(
            body,
            "<p>The squared error falls with the number of samples to the power {:.2} ± {:.2}; −1 is that of \
             independent samples.</p>",
            slope.power, slope.plus_minus
        );
    }
    body += "<p>Black is what was measured, blue what the renders state of themselves, grey how independent \
             samples would go on from the first; coloured points are knobs that trade noise, named where they \
             took another number of samples.</p>\n";
    body += &error_by_samples(report);
    let mut samples: Vec<&Point> = report.convergence.iter().chain([&report.base]).collect();
    samples.sort_by_key(|point| point.samples);
    body += &table("samples", samples.into_iter(), None);
    let memory = memory_by_seconds(report);
    if !memory.is_empty() {
        let _ = writeln!(
            body,
            "<h2>Memory by seconds</h2>\n<p>The accelerator's, of what changes it.</p>\n{memory}"
        );
    }
    for knob in &report.knobs {
        body += &section(report, knob, png);
    }
    body += &half_or_float(&report.half);
    page(&format!("alhazen trade: {scene}"), &body)
}

fn half_or_float(half: &HalfLoss) -> String {
    let mut text = format!(
        "<h2>Half or float</h2>\n<p>Rounding to half adds a relative error of {}; {} pixels are beyond what half \
         holds.</p>\n",
        percent(half.error),
        half.beyond
    );
    if let (Some(a), Some(b)) = (half.half, half.float) {
        text += "<table><tr><th>file</th><th>seconds to write</th><th>size</th></tr>\n";
        for (name, cost) in [("half", a), ("float", b)] {
            let kilobytes = cost.bytes as f64 / 1e3;
            let _ = writeln!(
                text,
                "<tr><td>{name}</td><td>{:.4}</td><td>{kilobytes:.0} kB</td></tr>",
                cost.seconds
            );
        }
        text += "</table>\n";
    }
    text
}

fn recommended(scene: &str, found: &Recommendation) -> String {
    let what = match found.target {
        Target::Error(error) => format!("For an error of {}", percent(error)),
        Target::Time(seconds) => format!("For {seconds} s"),
    };
    let verdict =
        if found.is_reached { "measured" } else { "<b class=\"wrong\">not reached</b>, measured" };
    format!(
        "<p>{what}: {verdict} {} in {:.2} s.</p>\n<pre>alhazen render {} {}</pre>\n",
        percent(found.error),
        found.seconds,
        escaped(scene),
        escaped(&quoted(&found.flags))
    )
}

/// Words as a shell takes them.
pub fn quoted(words: &[String]) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_=./:,+%@".contains(c);
    let word = |word: &String| {
        if word.chars().all(is_plain) && !word.is_empty() {
            word.clone()
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    };
    words.iter().map(word).collect::<Vec<_>>().join(" ")
}

fn section(report: &TradeReport, knob: &KnobReport, png: Png<'_>) -> String {
    let what = match knob.effect {
        "noise" => "Changes time and noise, not the expected picture.",
        "look" => "Changes what the picture shows, if in few places: never recommended.",
        _ => "May change the picture for speed.",
    };
    let mut text = format!("<h2>{}</h2>\n<p>{what}</p>\n", escaped(knob.name));
    text +=
        &table(knob.name, std::iter::once(&report.base).chain(&knob.points), Some(&report.base));
    text += "<div class=\"strip\">";
    for point in &knob.points {
        text += &figure(&point.label, &point.looks.0, png);
        text += &figure("its FLIP", &difference(point), png);
    }
    text += "</div>\n";
    text
}

/// A row for each point; times by those of `base` where it is given.
fn table<'a>(first: &str, points: impl Iterator<Item = &'a Point>, base: Option<&Point>) -> String {
    let mut text = format!(
        "<table><tr><th>{}</th><th>samples</th><th>error</th><th>it states</th><th>bias</th><th>differs</th><th>relMSE</th>\
         <th>FLIP</th><th>seconds</th><th>× time</th><th>build</th><th>memory</th><th>efficiency</th></tr>\n",
        escaped(first)
    );
    for point in points {
        let efficiency = base.map_or(1.0, |base| base.efficiency);
        let efficiency = if base.is_some() {
            format!("× {:.2}", point.efficiency / efficiency)
        } else {
            format!("{:.3e}", point.efficiency)
        };
        let class = if point.is_on_front { " class=\"front\"" } else { "" };
        let optional = |x: Option<f64>| x.map_or("–".to_owned(), percent);
        let _ = writeln!(
            text,
            "<tr{class}><td title=\"{}\">{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.2e}</td>\
             <td>{:.4}</td><td>{:.3}</td><td>{:.2}</td><td>{:.3} s</td><td>{:.1} MB</td><td>{efficiency}</td></tr>",
            escaped(&quoted(&point.flags)),
            escaped(&point.label),
            point.samples,
            percent(point.error),
            optional(point.sampling_error),
            optional(point.bias),
            optional(point.difference),
            point.relmse,
            point.flip,
            point.seconds,
            point.ratio,
            point.build_seconds,
            point.bytes as f64 / 1e6,
        );
    }
    text += "</table>\n";
    text
}

/// FLIP of each pixel, in colours.
fn difference(point: &Point) -> Picture {
    let (picture, flip) = &point.looks;
    Picture { pixels: flip.iter().map(|&x| magma(x)).collect(), ..picture.clone() }
}

fn figure(caption: &str, picture: &Picture, png: Png<'_>) -> String {
    let small = shrunk(picture);
    let [width, height] = small.extent;
    format!(
        "<figure><img width=\"{width}\" height=\"{height}\" alt=\"{0}\" \
         src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>",
        escaped(caption),
        STANDARD.encode(png(&small))
    )
}

/// Not wider than a thumbnail: means of whole squares of pixels, of what a display shows of each.
fn shrunk(picture: &Picture) -> Picture {
    let factor = picture.extent[0].div_ceil(THUMBNAIL).max(1);
    let extent = picture.extent.map(|n| (n / factor).max(1));
    let pixel = |x: u32, y: u32| {
        let mut sum = Rgb::BLACK;
        let mut count = 0.0;
        for (dx, dy) in (0..factor).flat_map(|dy| (0..factor).map(move |dx| (dx, dy))) {
            let at = (y * factor + dy) * picture.extent[0] + x * factor + dx;
            if let Some(color) = picture.pixels.get(at as usize) {
                sum += color.map(|x| x.clamp(0.0, 1.0));
                count += 1.0;
            }
        }
        sum * (1.0 / count)
    };
    let places = (0..extent[1]).flat_map(|y| (0..extent[0]).map(move |x| (x, y)));
    Picture::whole(extent, places.map(|(x, y)| pixel(x, y)).collect())
}

pub(super) fn percent(x: f64) -> String {
    match 100.0 * x {
        0.0 => "0 %".to_owned(),
        x if x >= 10.0 => format!("{x:.1} %"),
        x if x >= 0.01 => format!("{x:.3} %"),
        x => format!("{x:.1e} %"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_shrink_by_means() {
        let size = [2 * THUMBNAIL, 2];
        let pixels = (0..4 * THUMBNAIL).map(|i| Rgb::splat((i % 2) as f32)).collect();
        let small = shrunk(&Picture::whole(size, pixels));
        assert_eq!(small.extent, [THUMBNAIL, 1]);
        assert!(small.pixels.iter().all(|c| *c == Rgb::splat(0.5)));
    }
}
