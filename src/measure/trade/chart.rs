//! Charts of the page, all with logarithmic axes: error by seconds, error by samples, memory by seconds.

use std::fmt::Write;

use super::page::percent;
use super::{Point, TradeReport, counted};
use crate::measure::html::escaped;

const SIZE: [f64; 2] = [900.0, 460.0];

/// Left, right (with room for names), top, bottom.
const MARGIN: [f64; 4] = [64.0, 150.0, 12.0, 40.0];

/// Of marks.
const RADIUS: f64 = 4.5;

/// Width of a letter and height of a line of names, about.
const LETTER: f64 = 7.0;
const LINE: f64 = 14.0;

/// Colours of knobs.
const COLOURS: [&str; 10] = [
    "#2f6cad", "#c4572e", "#3d8a4e", "#8b5fb0", "#a08b1d", "#c2447f", "#2b9b9b", "#7a5a3a",
    "#5a6b7b", "#d08a2c",
];

/// That of the scene as it stands, at any number of samples.
const OWN: &str = "#1b1f24";

/// That of what is no measurement.
const GUIDE: &str = "#8a929a";

/// A point of a chart.
struct Mark {
    at: [f64; 2],
    colour: &'static str,
    /// What it is, when pointed at.
    title: String,
    /// What is written beside it, if anything.
    name: Option<String>,
    is_ringed: bool,
}

/// A line of a chart.
struct Line {
    points: Vec<[f64; 2]>,
    colour: &'static str,
    is_dashed: bool,
}

/// Marks and lines over two logarithmic axes.
struct Chart {
    /// What is written after the numbers of each axis.
    units: [&'static str; 2],
    marks: Vec<Mark>,
    lines: Vec<Line>,
}

/// A colour for each knob that may be chosen for speed, whatever of it a chart shows.
fn coloured(report: &TradeReport) -> impl Iterator<Item = (String, &'static str, &Point)> {
    let shown = report.knobs.iter().filter(|knob| knob.effect != "look");
    shown.zip(COLOURS.iter().cycle()).flat_map(|(knob, colour)| {
        let points = knob.points.iter();
        points.map(move |point| (format!("{} {}", knob.name, point.label), *colour, point))
    })
}

/// The scene as it stands with each number of samples, from few to many.
fn own(report: &TradeReport) -> Vec<&Point> {
    let mut own: Vec<&Point> = std::iter::once(&report.base).chain(&report.convergence).collect();
    own.sort_by_key(|point| point.samples);
    own
}

/// Error over seconds; what is on the front is ringed and named.
pub(super) fn error_by_seconds(report: &TradeReport) -> String {
    let at = |p: &Point| [p.seconds, 100.0 * p.error];
    let mark = |(name, colour, p): (String, _, &Point)| Mark {
        at: at(p),
        colour,
        title: format!("{name}: {} in {:.3} s", percent(p.error), p.seconds),
        name: p.is_on_front.then_some(name),
        is_ringed: p.is_on_front,
    };
    let own = own(report);
    let samples = own.iter().map(|p| (counted(p.samples), OWN, *p));
    let marks = samples.chain(coloured(report)).map(mark).collect();
    let line = Line { points: own.iter().map(|p| at(p)).collect(), colour: OWN, is_dashed: false };
    Chart { units: [" s", " %"], marks, lines: vec![line] }.svg()
}

/// Error over samples: measured, stated by the renders themselves, and as independent samples would have it;
/// and what turns of the knobs that trade noise come to.
pub(super) fn error_by_samples(report: &TradeReport) -> String {
    let own = own(report);
    let measured: Vec<[f64; 2]> =
        own.iter().map(|p| [f64::from(p.samples), 100.0 * p.error]).collect();
    let stated = own.iter().filter_map(|p| Some((p.samples, p.sampling_error?)));
    let stated = stated.map(|(samples, error)| [f64::from(samples), 100.0 * error]).collect();
    let mut lines = vec![
        Line { points: stated, colour: COLOURS[0], is_dashed: true },
        Line { points: measured.clone(), colour: OWN, is_dashed: false },
    ];
    if let (Some(first), Some(last)) = (measured.first(), measured.last()) {
        let independent = first[1] * (first[0] / last[0]).sqrt();
        let points = vec![*first, [last[0], independent]];
        lines.push(Line { points, colour: GUIDE, is_dashed: true });
    }
    let mark = |(name, colour, p): (String, _, &Point)| Mark {
        at: [f64::from(p.samples), 100.0 * p.error],
        colour,
        title: format!("{name}: {} with {} samples", percent(p.error), p.samples),
        name: (colour != OWN && p.samples != report.base.samples).then_some(name),
        is_ringed: false,
    };
    let noisy = report.knobs.iter().filter(|knob| knob.effect == "noise").map(|knob| knob.name);
    let noisy: Vec<&str> = noisy.collect();
    let turned =
        coloured(report).filter(|(name, ..)| noisy.iter().any(|knob| name.starts_with(knob)));
    let samples = own.iter().map(|p| ("as it stands".to_owned(), OWN, *p));
    Chart { units: ["", " %"], marks: samples.chain(turned).map(mark).collect(), lines }.svg()
}

/// Bytes of the accelerator over seconds, of what changes them; empty where nothing does.
pub(super) fn memory_by_seconds(report: &TradeReport) -> String {
    let base = &report.base;
    let mark = |(name, colour, p): (String, _, &Point)| Mark {
        at: [p.seconds, p.bytes as f64 / 1e6],
        colour,
        title: format!("{name}: {:.1} MB, {:.3} s", p.bytes as f64 / 1e6, p.seconds),
        name: Some(name),
        is_ringed: false,
    };
    // Embree's own differs by some percent from build to build.
    let differs = |p: &Point| p.bytes.abs_diff(base.bytes) as f64 > 0.05 * base.bytes as f64;
    let turned = coloured(report).filter(|(.., p)| p.samples == base.samples && differs(p));
    let turned: Vec<_> = turned.collect();
    if turned.is_empty() {
        return String::new();
    }
    let own = [("as it stands".to_owned(), OWN, base)];
    let marks = own.into_iter().chain(turned).map(mark).collect();
    Chart { units: [" s", " MB"], marks, lines: Vec::new() }.svg()
}

impl Chart {
    /// Lowest and highest logarithm along an axis, and some room.
    fn range(&self, axis: usize) -> (f64, f64) {
        let marks = self.marks.iter().map(|mark| mark.at);
        let all = marks.chain(self.lines.iter().flat_map(|line| line.points.iter().copied()));
        let (low, high) = all
            .map(|at| at[axis].log10())
            .fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        let pad = 0.05 * (high - low).max(0.5);
        (low - pad, high + pad)
    }

    /// As SVG; empty where there is nothing that a logarithm shows.
    fn svg(mut self) -> String {
        let is_shown = |at: &[f64; 2]| at.iter().all(|x| x.is_finite() && *x > 0.0);
        self.marks.retain(|mark| is_shown(&mark.at));
        self.lines.iter_mut().for_each(|line| line.points.retain(is_shown));
        if self.marks.is_empty() {
            return String::new();
        }
        let [(x0, x1), (y0, y1)] = [self.range(0), self.range(1)];
        let (left, right) = (MARGIN[0], SIZE[0] - MARGIN[1]);
        let (top, bottom) = (MARGIN[2], SIZE[1] - MARGIN[3]);
        let x = |value: f64| left + (value.log10() - x0) / (x1 - x0) * (right - left);
        let y = |value: f64| top + (y1 - value.log10()) / (y1 - y0) * (bottom - top);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\">\n",
            SIZE[0], SIZE[1]
        );
        let [unit_x, unit_y] = self.units;
        for value in ticks(x0, x1) {
            let at = x(value);
            let _ = writeln!(
                svg,
                "<line x1=\"{at:.1}\" y1=\"{top}\" x2=\"{at:.1}\" y2=\"{bottom}\" stroke=\"#e3e6e9\"/>\
                 <text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\" class=\"faint\">{value}{unit_x}</text>",
                bottom + 16.0
            );
        }
        for value in ticks(y0, y1) {
            let at = y(value);
            let _ = writeln!(
                svg,
                "<line x1=\"{left}\" y1=\"{at:.1}\" x2=\"{right}\" y2=\"{at:.1}\" stroke=\"#e3e6e9\"/>\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\" class=\"faint\">{value}{unit_y}</text>",
                left - 6.0,
                at + 4.0
            );
        }
        for Line { points, colour, is_dashed } in &self.lines {
            let places: Vec<String> =
                points.iter().map(|at| format!("{:.1},{:.1}", x(at[0]), y(at[1]))).collect();
            let dashes = if *is_dashed { " stroke-dasharray=\"5 4\"" } else { "" };
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"{dashes}/>",
                places.join(" ")
            );
        }
        let mut named: Vec<_> =
            self.marks.iter().filter_map(|mark| Some((mark, mark.name.as_ref()?))).collect();
        named.sort_by(|a, b| b.0.at[1].total_cmp(&a.0.at[1]));
        // Names keep off the marks and off each other.
        let circle = |mark: &Mark| {
            let [x, y] = [x(mark.at[0]), y(mark.at[1])];
            [x - RADIUS, y - RADIUS, x + RADIUS, y + RADIUS]
        };
        let mut taken: Vec<[f64; 4]> = self.marks.iter().map(circle).collect();
        for (mark, name) in named {
            let (place, is_left) = free_place([x(mark.at[0]), y(mark.at[1])], name, &taken);
            taken.push(place);
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\"{} class=\"name\" style=\"fill:{}\">{}</text>",
                if is_left { place[2] } else { place[0] },
                place[3] - 3.0,
                if is_left { " text-anchor=\"end\"" } else { "" },
                mark.colour,
                escaped(name)
            );
        }
        for mark in &self.marks {
            let ring = if mark.is_ringed { " stroke=\"#1b1f24\" stroke-width=\"2\"" } else { "" };
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{RADIUS}\" fill=\"{}\"{ring}><title>{}</title></circle>",
                x(mark.at[0]),
                y(mark.at[1]),
                mark.colour,
                escaped(&mark.title)
            );
        }
        svg + "</svg>\n"
    }
}

/// Where the name of a mark covers least of what is `taken`: its box, and whether it ends at the mark instead of
/// beginning there. Beside the mark if that is free, else above or below it.
fn free_place(mark: [f64; 2], name: &str, taken: &[[f64; 4]]) -> ([f64; 4], bool) {
    let width = LETTER * name.chars().count() as f64;
    let boxed = |(rise, is_left): (f64, bool)| {
        let left = if is_left { mark[0] - 2.0 * RADIUS - width } else { mark[0] + 2.0 * RADIUS };
        let bottom = mark[1] + 7.0 - rise;
        ([left, bottom - LINE, left + width, bottom], is_left)
    };
    let rises = [0.0, -LINE, LINE, -2.0 * LINE, 2.0 * LINE, -3.0 * LINE, 3.0 * LINE];
    let places = rises.into_iter().flat_map(|rise| [(rise, false), (rise, true)]).map(boxed);
    let covered = |[x0, y0, x1, y1]: &[f64; 4]| {
        let overlaps = |t: &&[f64; 4]| *x0 < t[2] && t[0] < *x1 && *y0 < t[3] && t[1] < *y1;
        let is_outside = *x0 < 0.0 || *y0 < 0.0 || *x1 > SIZE[0] || *y1 > SIZE[1];
        taken.iter().filter(overlaps).count() + usize::from(is_outside)
    };
    // The first of the best.
    places.min_by_key(|(place, _)| covered(place)).unwrap_or(boxed((0.0, false)))
}

/// 1, 2 and 5 of each decade between two powers of ten; of many decades the powers alone, of less than one
/// more.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let steps: &[f64] = match high - low {
        range if range > 2.5 => &[1.0],
        range if range > 0.9 => &[1.0, 2.0, 5.0],
        range if range > 0.35 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0],
        _ => &[1.0, 1.1, 1.2, 1.3, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
    };
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
    fn names_cover_neither_marks_nor_names() {
        let circle = |x: f64, y: f64| [x - RADIUS, y - RADIUS, x + RADIUS, y + RADIUS];
        let at = [300.0, 200.0];
        // Beside the mark; to its left, where another stands on the right; below, where one is on either side.
        let mut taken = vec![circle(at[0], at[1])];
        assert!(!free_place(at, "name", &taken).1);
        taken.push(circle(320.0, 201.0));
        let (left, is_left) = free_place(at, "name", &taken);
        assert!(is_left && left[2] < at[0], "{left:?}");
        taken.push(left);
        let (below, _) = free_place(at, "name", &taken);
        assert!(below[1] > at[1] + RADIUS, "{below:?}");
        // Nor does one leave the picture.
        let (inside, is_left) = free_place([SIZE[0] - 20.0, 100.0], "a long name", &[]);
        assert!(is_left && inside[2] < SIZE[0]);
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(ticks(-1.1, 0.35), [0.1, 0.2, 0.5, 1.0, 2.0]);
        assert_eq!(ticks(-2.0, 1.0), [0.01, 0.1, 1.0, 10.0]);
        assert_eq!(ticks(1.85, 2.25), [80.0, 100.0, 150.0]);
    }

    #[test]
    fn what_has_no_logarithm_is_left_out_and_decades_are_even() {
        let mark = |x: f64, y: f64| Mark {
            at: [x, y],
            colour: OWN,
            title: "a < b".to_owned(),
            name: None,
            is_ringed: false,
        };
        let marks = vec![mark(1.0, 1.0), mark(10.0, 10.0), mark(100.0, 100.0), mark(0.0, 1.0)];
        let svg = Chart { units: ["", ""], marks, lines: Vec::new() }.svg();
        let places: Vec<f64> = svg
            .split("cx=\"")
            .skip(1)
            .map(|rest| rest.split('"').next().unwrap().parse().unwrap())
            .collect();
        assert_eq!(places.len(), 3, "{svg}");
        assert!((places[2] - 2.0 * places[1] + places[0]).abs() < 0.2, "{places:?}");
        assert!(svg.contains("a &lt; b"));
        assert!(
            Chart { units: ["", ""], marks: vec![mark(0.0, 1.0)], lines: vec![] }.svg().is_empty()
        );
    }
}
