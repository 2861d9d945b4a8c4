//! The report as a page: settings, a chart of error by seconds, a table and pictures for each knob.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::{KnobReport, Point, Recommendation, Target, TradeReport};
use crate::color::Rgb;
use crate::film::Picture;
use crate::measure::html::{escaped, page};
use crate::measure::magma;

/// Most pixels across of the pictures in the page.
const THUMBNAIL: u32 = 320;

/// Colours of knobs in the chart.
const COLOURS: [&str; 10] = [
    "#2f6cad", "#c4572e", "#3d8a4e", "#8b5fb0", "#a08b1d", "#c2447f", "#2b9b9b", "#7a5a3a",
    "#5a6b7b", "#d08a2c",
];

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
    body += &chart(report);
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
    let mut samples: Vec<&Point> = report.convergence.iter().chain([&report.base]).collect();
    samples.sort_by_key(|point| point.samples);
    body += &table("samples", samples.into_iter(), None);
    for knob in &report.knobs {
        body += &section(report, knob, png);
    }
    let _ = writeln!(
        body,
        "<h2>Half or float</h2>\n<p>Rounding to half adds a relative error of {}; {} pixels are beyond what half \
         holds.</p>",
        percent(report.half.error),
        report.half.beyond
    );
    page(&format!("alhazen trade: {scene}"), &body)
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

fn percent(x: f64) -> String {
    match 100.0 * x {
        0.0 => "0 %".to_owned(),
        x if x >= 10.0 => format!("{x:.1} %"),
        x if x >= 0.01 => format!("{x:.3} %"),
        x => format!("{x:.1e} %"),
    }
}

/// Points of the chart: label, colour, and the point.
fn chart_points(report: &TradeReport) -> Vec<(String, &'static str, &Point)> {
    let own = std::iter::once(&report.base).chain(&report.convergence);
    let own = own.map(|point| (format!("{} samples", point.samples), "#1b1f24", point));
    let shown = report.knobs.iter().filter(|knob| knob.effect != "look");
    let turned = shown.zip(COLOURS.iter().cycle()).flat_map(|(knob, colour)| {
        let points = knob.points.iter();
        points.map(move |point| (format!("{} {}", knob.name, point.label), *colour, point))
    });
    own.chain(turned).filter(|(_, _, p)| p.error > 0.0 && p.seconds > 0.0).collect()
}

/// Error over seconds, both in decades.
fn chart(report: &TradeReport) -> String {
    const SIZE: [f64; 2] = [900.0, 460.0];
    const MARGIN: [f64; 4] = [64.0, 150.0, 12.0, 40.0];
    let points = chart_points(report);
    let range = |value: &dyn Fn(&Point) -> f64| {
        let logs = points.iter().map(|(_, _, p)| value(p).log10());
        let (low, high) = logs.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        let pad = 0.05 * (high - low).max(0.5);
        (low - pad, high + pad)
    };
    if points.is_empty() {
        return String::new();
    }
    let (x0, x1) = range(&|p| p.seconds);
    let (y0, y1) = range(&|p| 100.0 * p.error);
    let x = |seconds: f64| {
        MARGIN[0] + (seconds.log10() - x0) / (x1 - x0) * (SIZE[0] - MARGIN[0] - MARGIN[1])
    };
    let y = |percent: f64| {
        MARGIN[2] + (y1 - percent.log10()) / (y1 - y0) * (SIZE[1] - MARGIN[2] - MARGIN[3])
    };
    let (left, right) = (MARGIN[0], SIZE[0] - MARGIN[1]);
    let (top, bottom) = (MARGIN[2], SIZE[1] - MARGIN[3]);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\">\n",
        SIZE[0], SIZE[1]
    );
    for value in ticks(x0, x1) {
        let at = x(value);
        let _ = writeln!(
            svg,
            "<line x1=\"{at:.1}\" y1=\"{top}\" x2=\"{at:.1}\" y2=\"{bottom}\" stroke=\"#e3e6e9\"/>\
             <text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\" class=\"faint\">{value} s</text>",
            bottom + 16.0
        );
    }
    for value in ticks(y0, y1) {
        let at = y(value);
        let _ = writeln!(
            svg,
            "<line x1=\"{left}\" y1=\"{at:.1}\" x2=\"{right}\" y2=\"{at:.1}\" stroke=\"#e3e6e9\"/>\
             <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\" class=\"faint\">{value} %</text>",
            left - 6.0,
            at + 4.0
        );
    }
    let mut own: Vec<&Point> =
        points.iter().filter(|(_, colour, _)| *colour == "#1b1f24").map(|(_, _, p)| *p).collect();
    own.sort_by_key(|p| p.samples);
    let line: Vec<String> =
        own.iter().map(|p| format!("{:.1},{:.1}", x(p.seconds), y(100.0 * p.error))).collect();
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#1b1f24\" stroke-width=\"1.5\"/>",
        line.join(" ")
    );
    // Names keep off each other.
    let mut lowest = f64::NEG_INFINITY;
    let mut named: Vec<_> = points.iter().filter(|(_, _, p)| p.is_on_front).collect();
    named.sort_by(|a, b| b.2.error.total_cmp(&a.2.error));
    let mut names = Vec::new();
    for (name, colour, point) in named {
        let at = (y(100.0 * point.error) + 4.0).max(lowest + 13.0);
        lowest = at;
        names.push((name, colour, x(point.seconds), at));
    }
    for (name, colour, point) in &points {
        let (cx, cy) = (x(point.seconds), y(100.0 * point.error));
        let ring = if point.is_on_front { " stroke=\"#1b1f24\" stroke-width=\"2\"" } else { "" };
        let _ = writeln!(
            svg,
            "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"4.5\" fill=\"{colour}\"{ring}><title>{}: {} in {:.3} \
             s</title></circle>",
            escaped(name),
            percent(point.error),
            point.seconds
        );
    }
    for (name, colour, at_x, at_y) in names {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{at_y:.1}\" class=\"name\" style=\"fill:{colour}\">{}</text>",
            at_x + 9.0,
            escaped(name)
        );
    }
    svg += "</svg>\n";
    svg
}

/// 1, 2 and 5 of each decade between two powers of ten; of many decades the powers alone.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let steps: &[f64] = if high - low > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let decades = low.floor() as i32..=high.ceil() as i32;
    let all = decades.flat_map(|d| steps.iter().map(move |s| (s, d)));
    // Written out, so that they read as they are.
    let values = all.filter_map(|(s, d)| format!("{s}e{d}").parse::<f64>().ok());
    values.filter(|v| (low..=high).contains(&v.log10())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        assert_eq!(ticks(-1.1, 0.35), [0.1, 0.2, 0.5, 1.0, 2.0]);
        assert_eq!(ticks(-2.0, 1.0), [0.01, 0.1, 1.0, 10.0]);
    }

    #[test]
    fn pictures_shrink_by_means() {
        let size = [2 * THUMBNAIL, 2];
        let pixels = (0..4 * THUMBNAIL).map(|i| Rgb::splat((i % 2) as f32)).collect();
        let small = shrunk(&Picture::whole(size, pixels));
        assert_eq!(small.extent, [THUMBNAIL, 1]);
        assert!(small.pixels.iter().all(|c| *c == Rgb::splat(0.5)));
    }
}
