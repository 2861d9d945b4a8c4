//! How far pictures may be apart.

use super::channels::{Row, Rows};
use super::digits;
use crate::cli::Failure;
use crate::cli::args::{CompareArgs, parse_limit};
use crate::cli::units::grouped;
use crate::measure::Comparison;

/// Names of what `--limit` bounds; that of PSNR from below.
const METRICS: [&str; 7] = ["mse", "mae", "relmse", "psnr", "flip", "max", "differing"];

/// How far a channel or a layer may be off: `NAME:METRIC=X`.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::cli) struct ChannelLimit {
    /// Of which channel or layer.
    name: String,
    /// Which of [`METRICS`].
    metric: &'static str,
    /// The most, or of PSNR the least.
    limit: f64,
}

/// Reads a [`ChannelLimit`].
pub(in crate::cli) fn parse_channel_limit(text: &str) -> Result<ChannelLimit, String> {
    let all = METRICS.join(", ");
    let form = || format!("expected CHANNEL:METRIC=X, as in Z:mae=0.01; metrics: {all}");
    let (what, limit) = text.rsplit_once('=').ok_or_else(form)?;
    let (name, metric) = what.rsplit_once(':').ok_or_else(form)?;
    let metric = METRICS.into_iter().find(|known| *known == metric).ok_or_else(form)?;
    Ok(ChannelLimit { name: name.to_owned(), metric, limit: parse_limit(limit)? })
}

/// A metric beside what it may be.
struct Bounded {
    metric: &'static str,
    value: f64,
    limit: f64,
}

impl Bounded {
    /// How the limit is passed, in words. What is undefined passes any.
    fn passed(&self) -> Option<String> {
        let &Self { metric, value, limit } = self;
        let is_least = metric == "psnr";
        let is_within = if is_least { value >= limit } else { value <= limit };
        let word = if is_least { "less" } else { "more" };
        (!is_within)
            .then(|| format!("{metric} is {}, {word} than {}", digits(value), digits(limit)))
    }
}

/// A line for each limit that the pictures pass.
pub(super) fn exceeded(
    args: &CompareArgs,
    found: &Comparison,
    rows: &Rows,
) -> Result<Vec<String>, Failure> {
    let hdr_flip = found.hdr_flip.map_or(f64::NAN, |(mean, _)| mean);
    let whole = [
        ("mse", found.mse, args.max_mse),
        ("mae", found.mae, args.max_mae),
        ("relmse", found.rel_mse, args.max_relmse),
        ("psnr", found.psnr, args.min_psnr),
        ("flip", found.flip, args.max_flip),
        ("hdr-flip", hdr_flip, args.max_hdr_flip),
    ];
    let whole = whole
        .into_iter()
        .filter_map(|(metric, value, limit)| Some(Bounded { metric, value, limit: limit? }));
    let whole: Vec<Bounded> = whole.collect();
    let picture = args.picture.display();
    let lines = whole.iter().filter_map(Bounded::passed);
    let mut lines: Vec<String> = lines.map(|line| format!("{picture}: {line}")).collect();
    if found.non_finite > 0 && !whole.is_empty() {
        lines.push(format!(
            "{picture} or {}: {} pixels are NaN or infinite, more than 0",
            args.reference.display(),
            grouped(found.non_finite)
        ));
    }
    for limit in &args.limit {
        let row = row_of(limit, rows)?;
        let value = value_of(limit, row)?;
        let bounded = Bounded { metric: limit.metric, value, limit: limit.limit };
        lines.extend(bounded.passed().map(|line| format!("{picture}: {}: {line}", row.name)));
        if row.non_finite > 0 {
            lines.push(format!(
                "{picture}: {}: {} values are NaN or infinite, more than 0",
                row.name,
                grouped(row.non_finite)
            ));
        }
    }
    Ok(lines)
}

fn row_of<'a>(limit: &ChannelLimit, rows: &'a Rows) -> Result<&'a Row, Failure> {
    let all = || rows.channels.iter().chain(&rows.layers);
    all().find(|row| row.name == limit.name).ok_or_else(|| {
        let names: Vec<&str> = all().map(|row| row.name.as_str()).collect();
        let (name, names) = (&limit.name, names.join(", "));
        Failure::BadInput(format!("--limit: no channel or layer `{name}`; there are: {names}"))
    })
}

fn value_of(limit: &ChannelLimit, row: &Row) -> Result<f64, Failure> {
    let value = |metric: &str| match metric {
        "mse" => row.mse,
        "mae" => row.mae,
        "relmse" => row.relmse,
        "psnr" => row.psnr,
        "flip" => row.flip,
        "max" => row.max,
        _ => row.differing.map(|n| n as f64),
    };
    value(limit.metric).ok_or_else(|| {
        let known: Vec<&str> = METRICS.into_iter().filter(|m| value(m).is_some()).collect();
        let (metric, name, known) = (limit.metric, &row.name, known.join(", "));
        Failure::BadInput(format!("--limit: {name} has no {metric}; accepted: {known}"))
    })
}
