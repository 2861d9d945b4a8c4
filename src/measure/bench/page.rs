//! The report as a page: tables and bars, in one file that asks the network for nothing.

use std::fmt::Write;

use super::{BenchReport, Compared, RayKind, Row};
use crate::measure::html::{escaped, page};

/// Colours of the bars: one thread, all threads.
const COLOURS: [&str; 2] = ["#8fb3d9", "#2f6cad"];

/// A bar chart's row: a name and a bar for each series, with what stands beside it.
struct Bars {
    name: String,
    bars: Vec<(f64, String)>,
}

/// The report on `scene` as an HTML page.
pub fn html(scene: &str, report: &BenchReport) -> String {
    let mut body = String::new();
    let rays: Vec<String> =
        report.rays.iter().map(|r| format!("{} {}", r.rays, r.kind.name())).collect();
    let _ = write!(
        body,
        "<h1>{}</h1>\n<p>{} primitives, {} copies; rays: {}; {} rounds; ratios are to <b>{}</b> \
         in the same rounds.</p>\n",
        escaped(scene),
        report.primitives,
        report.copies,
        rays.join(", "),
        report.rounds,
        escaped(&report.baseline)
    );
    let series = threads(report);
    body += &legend(&series);
    body += "<h2>Speed, as a multiple of the baseline's (and Mrays/s)</h2>\n";
    for count in report.rays.iter().filter(|count| count.rays > 0) {
        body += &chart(count.kind.name(), &speeds(report, count.kind, &series));
    }
    body += "<h2>Build, seconds</h2>\n";
    let seconds = |row: &Row, n: usize| {
        let build = row.builds.iter().find(|b| b.threads == n)?;
        Some((build.seconds, format!("{:.3}", build.seconds)))
    };
    body += &chart("", &bars(report, &series, seconds));
    body += "<h2>Memory, bytes per stored primitive</h2>\n";
    let last = series.last().copied().into_iter().collect::<Vec<_>>();
    let bytes = |row: &Row, _| row.bytes_per_primitive.map(|b| (b, format!("{b:.0}")));
    body += &chart("", &bars(report, &last, bytes));
    body += "<h2>Agreement</h2>\n<p>Rays of all kinds. Ties name another primitive at the same distance; edges \
             are rays that the reference answers so too when moved aside by a few roundings. Missing, extra and \
             differing hits are wrong.</p>\n";
    body += &agreement("against brute force in f64, on a sample", report, |row| &row.against_f64);
    let title = format!("against {}", report.baseline);
    body += &agreement(&title, report, |row| &row.against_baseline);
    for row in &report.rows {
        if let Some(reason) = &row.not_measured {
            let _ = writeln!(body, "<p>{}: {}</p>", escaped(&row.name), escaped(reason));
        }
    }
    page(&format!("alhazen bench: {scene}"), &body)
}

/// Numbers of threads that were measured.
fn threads(report: &BenchReport) -> Vec<usize> {
    if report.threads > 1 { vec![1, report.threads] } else { vec![1] }
}

fn bars(
    report: &BenchReport,
    series: &[usize],
    value: impl Fn(&Row, usize) -> Option<(f64, String)>,
) -> Vec<Bars> {
    let rows = report.rows.iter().map(|row| Bars {
        name: row.name.clone(),
        bars: series.iter().filter_map(|&n| value(row, n)).collect(),
    });
    rows.filter(|row| !row.bars.is_empty()).collect()
}

fn speeds(report: &BenchReport, kind: RayKind, series: &[usize]) -> Vec<Bars> {
    bars(report, series, |row, n| {
        let speed = row.speeds.iter().find(|s| s.kind == kind && s.threads == n)?;
        Some((speed.ratio, format!("{} ({} M/s)", short(speed.ratio), short(speed.mrays))))
    })
}

/// Horizontal bars as SVG, from zero.
fn chart(title: &str, rows: &[Bars]) -> String {
    const WIDTH: f64 = 900.0;
    const LEFT: f64 = 150.0;
    const RIGHT: f64 = 150.0;
    const BAR: f64 = 12.0;
    const TOP: f64 = 4.0;
    let largest = rows.iter().flat_map(|r| &r.bars).map(|(x, _)| *x).fold(0.0, f64::max);
    let scale = (WIDTH - LEFT - RIGHT) / if largest > 0.0 { largest } else { 1.0 };
    let height: f64 = TOP + rows.iter().map(|r| r.bars.len() as f64 * BAR + 8.0).sum::<f64>();
    let mut svg = String::new();
    if !title.is_empty() {
        let _ = writeln!(svg, "<figure><figcaption>{title}</figcaption>");
    }
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\">"
    );
    let mut y = TOP;
    for row in rows {
        let middle = y + 0.5 * BAR * row.bars.len() as f64 + 4.0;
        let name = escaped(&row.name);
        let x = LEFT - 8.0;
        let _ = writeln!(svg, "<text x=\"{x}\" y=\"{middle}\" text-anchor=\"end\">{name}</text>");
        for (i, (value, label)) in row.bars.iter().enumerate() {
            let colour = COLOURS[if row.bars.len() == 1 { 1 } else { i.min(1) }];
            let width = value * scale;
            let (at, text) = (LEFT + width + 6.0, y + BAR - 2.0);
            let _ = writeln!(
                svg,
                "<rect x=\"{LEFT}\" y=\"{y}\" width=\"{width:.1}\" height=\"{}\" fill=\"{colour}\"/>\
                 <text x=\"{at:.1}\" y=\"{text}\" class=\"faint\">{label}</text>",
                BAR - 1.0
            );
            y += BAR;
        }
        y += 8.0;
    }
    svg += "</svg>\n";
    if !title.is_empty() {
        svg += "</figure>\n";
    }
    svg
}

fn legend(series: &[usize]) -> String {
    let colours = &COLOURS[COLOURS.len() - series.len()..];
    let entries = series.iter().zip(colours).map(|(n, colour)| {
        let threads = if *n == 1 { "thread" } else { "threads" };
        format!("<span style=\"color:{colour}\">&#9632;</span> {n} {threads}")
    });
    format!("<p>{}</p>\n", entries.collect::<Vec<_>>().join(" &nbsp; "))
}

fn agreement(
    title: &str,
    report: &BenchReport,
    compared: impl Fn(&Row) -> &Vec<Compared>,
) -> String {
    let title = escaped(title);
    let mut table = format!(
        "<table><tr><th>{title}</th><th>rays</th><th>ties</th><th>edges</th><th>missing</th><th>extra</th>\
         <th>differing</th></tr>\n"
    );
    for row in report.rows.iter().filter(|row| row.not_measured.is_none()) {
        let sum = super::total(compared(row));
        let _ = write!(table, "<tr><td>{}</td>", escaped(&row.name));
        for n in [sum.rays, sum.ties, sum.edges] {
            let _ = write!(table, "<td>{n}</td>");
        }
        for n in [sum.missing, sum.extra, sum.differing] {
            let class = if n > 0 { "wrong" } else { "none" };
            let _ = write!(table, "<td class=\"{class}\">{n}</td>");
        }
        table += "</tr>\n";
    }
    table + "</table>\n"
}

/// A number with three digits or so.
fn short(x: f64) -> String {
    match x {
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 0.1 => format!("{x:.2}"),
        x if x >= 0.001 => format!("{x:.3}"),
        x => format!("{x:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_what_they_stand_for() {
        let row = |name: &str, x: f64| Bars { name: name.into(), bars: vec![(x, String::new())] };
        let svg = chart("", &[row("a", 2.0), row("b", 1.0), row("c", 0.0)]);
        for width in ["600.0", "300.0", "0.0"] {
            assert!(svg.contains(&format!("width=\"{width}\"")), "{svg}");
        }
    }
}
