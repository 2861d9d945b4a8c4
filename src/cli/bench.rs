//! `alhazen bench`: accelerators side by side on the rays of a scene.

use serde::Serialize;

use super::args::{AccelArgs, BenchArgs};
use super::progress::{Progress, catch_interrupts};
use super::units::grouped;
use super::{Failure, Outcome, outputs, prepare, print};
use crate::accel::AccelKind;
use crate::measure::bench::{
    Agreement, BenchError, BenchOptions, BenchReport, RayKind, Row, StructureKind,
    bench as measure, html, total,
};

/// The fields of `--json`; their names are stable.
#[derive(Debug, Serialize)]
struct Report<'a> {
    scene: String,
    version: &'static str,
    /// Of the processor, as it calls itself.
    processor: String,
    #[serde(flatten)]
    report: &'a BenchReport,
}

/// Measures, prints, writes what was asked for.
pub(super) fn bench(args: &BenchArgs) -> Result<Outcome, Failure> {
    let scene_args = &args.scene;
    outputs::check_targets([scene_args.scene.as_path()], args.json.iter().chain(&args.html))?;
    catch_interrupts();
    let pool = prepare::thread_pool(scene_args.threads)?;
    let loaded = pool.install(|| prepare::load(scene_args))?;
    let brute = AccelArgs { kind: AccelKind::Brute, single_rays: false };
    // Nothing is built for the scene itself: Embree keeps the threads of the first build, which is to be
    // one with a single thread.
    let scene = pool.install(|| prepare::build(scene_args, &brute, loaded, 0, None))?;
    let options = BenchOptions {
        structures: if args.accel.is_empty() { StructureKind::all() } else { args.accel.clone() },
        threads: pool.current_num_threads(),
        seconds: args.seconds,
        rounds: args.rounds.into(),
        rays: args.rays as usize,
    };
    let progress = Progress::new(scene_args.quiet, "bench");
    let report = measure(&scene, &options, &progress);
    progress.finish();
    let name = scene_args.scene.display().to_string();
    let report = report.map_err(|error| match error {
        BenchError::Interrupted => Failure::Interrupted,
        BenchError::Empty | BenchError::NothingSeen => {
            Failure::BadInput(format!("{name}: {error}"))
        }
        error => Failure::Failed(error.to_string()),
    })?;

    if let Some(path) = &args.json {
        let version = env!("CARGO_PKG_VERSION");
        let json = Report { scene: name.clone(), version, processor: processor(), report: &report };
        let text = serde_json::to_string_pretty(&json)
            .map_err(|e| Failure::Failed(format!("{}: {e}", path.display())))?;
        crate::io::write_text(path, &(text + "\n")).map_err(|e| Failure::Failed(e.to_string()))?;
    }
    if let Some(path) = &args.html {
        crate::io::write_text(path, &html(&name, &report))
            .map_err(|e| Failure::Failed(e.to_string()))?;
    }
    if !scene_args.quiet {
        print_report(&name, &report);
        for path in args.json.iter().chain(&args.html) {
            print(&format!("wrote {}", path.display()));
        }
    }
    Ok(Outcome::Done)
}

fn print_report(scene: &str, report: &BenchReport) {
    let copies = match report.copies {
        0 => String::new(),
        n => format!(", {} copies", grouped(n)),
    };
    print(&format!("{scene}: {} primitives{copies}; {}", grouped(report.primitives), processor()));
    let rays: Vec<String> =
        report.rays.iter().map(|r| format!("{} {}", grouped(r.rays), r.kind.name())).collect();
    print(&format!("rays: {}; {} rounds", rays.join(", "), report.rounds));
    let threads = if report.threads > 1 { vec![1, report.threads] } else { vec![1] };
    print_builds(report, &threads);
    for &n in &threads {
        print_speeds(report, n);
    }
    let title = format!("hits against {}", report.baseline);
    print_agreement("hits against f64", report, |row| total(&row.against_f64));
    print_agreement(&title, report, |row| total(&row.against_baseline));
    for row in &report.rows {
        if let Some(reason) = &row.not_measured {
            print(&format!("{} was not measured: {reason}", row.name));
        }
    }
}

/// Rows that were measured.
fn measured(report: &BenchReport) -> impl Iterator<Item = &Row> {
    report.rows.iter().filter(|row| row.not_measured.is_none())
}

fn print_builds(report: &BenchReport, threads: &[usize]) {
    let heads = threads.iter().map(|n| format!("{:>11}", plural(*n)));
    let heads: String = heads.collect();
    print(&format!("\n{:<16}{heads}{:>14}", "build, seconds", "bytes/prim."));
    for row in measured(report).filter(|row| row.bytes.is_some()) {
        let time = |n: &usize| match row.builds.iter().find(|b| b.threads == *n) {
            Some(build) => format!("{:>11.3}", build.seconds),
            None => format!("{:>11}", "-"),
        };
        let times: String = threads.iter().map(time).collect();
        let bytes = row.bytes_per_primitive.unwrap_or_default();
        print(&format!("{:<16}{times}{bytes:>14.0}", row.name));
    }
}

fn print_speeds(report: &BenchReport, threads: usize) {
    let heads = RayKind::ALL.map(|kind| format!("{:>18}", kind.name())).concat();
    print(&format!("\n{:<16}{heads}   Mrays/s (x {})", plural(threads), report.baseline));
    for row in measured(report) {
        let speed = |kind| match row.speeds.iter().find(|s| s.kind == kind && s.threads == threads)
        {
            // Too few to tell much.
            Some(s) => {
                let mark = if s.rays < 1000 { "*" } else { "" };
                format!("{:>7}{mark:1} (x{:>6})", digits(s.mrays), digits(s.ratio))
            }
            None => "-".to_owned(),
        };
        let speeds = RayKind::ALL.map(|kind| format!("{:>18}", speed(kind))).concat();
        print(&format!("{:<16}{speeds}", row.name));
    }
}

fn print_agreement(title: &str, report: &BenchReport, sum: impl Fn(&Row) -> Agreement) {
    let heads = ["rays", "ties", "edges", "missing", "extra", "differing"];
    print(&format!("\n{title:<24}{}", heads.map(|head| format!("{head:>11}")).concat()));
    for row in measured(report) {
        let a = sum(row);
        let numbers = [a.rays, a.ties, a.edges, a.missing, a.extra, a.differing];
        print(&format!(
            "{:<24}{}",
            row.name,
            numbers.map(|n| format!("{:>11}", grouped(n))).concat()
        ));
    }
}

fn plural(threads: usize) -> String {
    if threads == 1 { "1 thread".to_owned() } else { format!("{threads} threads") }
}

/// Three digits, or the power of ten where there is no room.
fn digits(x: f64) -> String {
    match x {
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 10.0 => format!("{x:.1}"),
        x if x >= 0.01 => format!("{x:.2}"),
        x => format!("{x:.0e}"),
    }
}

/// The processor, from the kernel; unknown where it does not say.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = info.lines().find_map(|line| line.strip_prefix("model name"));
    line.map_or_else(
        || "unknown processor".to_owned(),
        |name| name.trim_start_matches([' ', '\t', ':']).to_owned(),
    )
}
