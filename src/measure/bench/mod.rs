//! Accelerators side by side on the rays of one scene: what they cost to build and to hold, how fast they
//! answer, and whether they answer right. Speeds are ratios to one of them, taken in rounds in which each
//! has its turn, so that what disturbs the machine disturbs all alike.

mod agree;
mod page;
mod rays;
mod structures;
mod timing;

use std::time::Instant;

use rayon::ThreadPool;
use serde::Serialize;

use crate::accel::{AccelKind, Geometry, Group, RayBlock};
use crate::render::Observer;
use crate::scene::Scene;

pub use agree::{Agreement, agreement};
use agree::{compare, known};
pub use page::html;
use rays::spread;
pub use rays::{RayKind, Rays};
pub use structures::StructureKind;
use structures::{Contestant, NotBuilt, Structure, oracle, with_structure};
pub use timing::Speed;
use timing::{Pools, median, probe, race};

/// What to measure, and how long.
#[derive(Debug, Clone)]
pub struct BenchOptions {
    /// The structures; the first that can render is the baseline, and is measured even if it is not named.
    pub structures: Vec<StructureKind>,
    /// Threads of the threaded figures.
    pub threads: usize,
    /// Seconds that a row may trace rays for its speeds, about.
    pub seconds: f64,
    /// Rounds of each speed.
    pub rounds: usize,
    /// Rays of a kind, at most.
    pub rays: usize,
}

/// What was measured. Names of fields are stable, as it is written as JSON.
#[derive(Debug, Clone, Serialize)]
pub struct BenchReport {
    /// Threads of the threaded figures.
    pub threads: usize,
    /// Rounds of each speed.
    pub rounds: usize,
    /// Triangles and shapes stored, in all groups.
    pub primitives: u64,
    /// Copies of groups.
    pub copies: u64,
    /// Rays of each kind.
    pub rays: Vec<RayCount>,
    /// The row that ratios and agreement refer to.
    pub baseline: String,
    /// One for each structure and way to ask it, the baseline first.
    pub rows: Vec<Row>,
}

/// How many rays of a kind there are.
#[derive(Debug, Clone, Serialize)]
pub struct RayCount {
    /// The kind.
    pub kind: RayKind,
    /// How many.
    pub rays: u64,
}

/// What was found of one structure and way to ask it.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Its name on the command line, and "packets" where rays go in packets.
    pub name: String,
    /// What it is, with its version where it has one.
    pub what: String,
    /// Why it was not measured.
    pub not_measured: Option<String>,
    /// What it costs to build; nothing for packets, which share a structure.
    pub builds: Vec<Build>,
    /// Bytes held, without the world's own arrays.
    pub bytes: Option<u64>,
    /// The same for each primitive that is stored.
    pub bytes_per_primitive: Option<f64>,
    /// Rays per second.
    pub speeds: Vec<Speed>,
    /// Against the baseline.
    pub against_baseline: Vec<Compared>,
    /// Against brute force in f64.
    pub against_f64: Vec<Compared>,
}

/// The time of a build.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Build {
    /// Threads.
    pub threads: usize,
    /// Median of some builds, in seconds.
    pub seconds: f64,
    /// How many.
    pub builds: usize,
}

/// Agreement on rays of one kind.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Compared {
    /// The kind.
    pub kind: RayKind,
    /// What came of it.
    #[serde(flatten)]
    pub agreement: Agreement,
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// It was interrupted.
    #[error("interrupted")]
    Interrupted,
    /// No ray would hit anything.
    #[error("there is nothing in the scene to hit: it has no triangle and no shape")]
    Empty,
    /// The camera's rays hit nothing.
    #[error("no ray of the camera hits anything, so there is nothing to compare")]
    NothingSeen,
    /// The baseline cannot be built.
    #[error("{0}")]
    Baseline(String),
    /// No threads.
    #[error("cannot start threads: {0}")]
    Threads(String),
}

/// Builds, traces and compares. The scene itself is best built with brute force, so that the first builds with
/// one thread come before any other: Embree keeps the threads of the first.
///
/// # Errors
/// [`BenchError`].
pub fn bench(
    scene: &Scene,
    options: &BenchOptions,
    observer: &dyn Observer,
) -> Result<BenchReport, BenchError> {
    let primitives = primitives(scene);
    if primitives == 0 {
        return Err(BenchError::Empty);
    }
    let pools = Pools::new(options.threads).map_err(|e| BenchError::Threads(e.to_string()))?;
    let mut work = Progress::new(observer, options);
    let kinds = with_baseline(&options.structures);
    let built = build_all(scene, &kinds, &pools, options, &mut work)?;
    let entries: Vec<(usize, Entrant<'_>)> = built.iter().enumerate().flat_map(entrants).collect();

    let baseline = match built.first().map(|b| &b.structure) {
        Some(Ok(structure)) => structure,
        Some(Err(reason)) => return Err(BenchError::Baseline(reason.clone())),
        None => return Err(BenchError::Empty),
    };
    let rays = pools
        .all
        .install(|| with_structure!(baseline, query => Rays::record(scene, query, options.rays)));
    let kinds_there: Vec<RayKind> =
        RayKind::ALL.into_iter().filter(|&kind| !rays.blocks(kind).is_empty()).collect();
    if kinds_there.len() < 2 {
        return Err(BenchError::NothingSeen);
    }

    let mut rows = rows(&built, &entries, primitives);
    for &kind in &kinds_there {
        let contestants: Vec<&dyn Contestant> = entries.iter().map(|(_, e)| &*e.asks).collect();
        let blocks = rays.blocks(kind);
        for pool in pools.each() {
            let speeds = race(&contestants, kind, blocks, pool, options, &mut work)?;
            for ((row, _), speed) in rows_measured(&mut rows).zip(&entries).zip(speeds) {
                row.speeds.push(speed);
            }
        }
        pools.all.install(|| {
            agreements(scene, &contestants, kind, blocks, options, &pools.all, &mut rows, &mut work)
        })?;
    }
    let count = |kind| RayCount { kind, rays: Rays::count(rays.blocks(kind)) };
    Ok(BenchReport {
        threads: options.threads,
        rounds: options.rounds,
        primitives,
        copies: scene.world().sets.iter().map(|set| set.transforms.len() as u64).sum(),
        rays: RayKind::ALL.map(count).to_vec(),
        baseline: rows[0].name.clone(),
        rows,
    })
}

/// Triangles and shapes stored.
fn primitives(scene: &Scene) -> u64 {
    let world = scene.world();
    let in_group = |group: &Group| group.geometries.iter().map(Geometry::len).sum::<usize>() as u64;
    world.prototypes.iter().chain([&world.root]).map(in_group).sum()
}

/// The structures in the order of [`StructureKind::all`], and before them the first that can render.
fn with_baseline(chosen: &[StructureKind]) -> Vec<StructureKind> {
    let all = StructureKind::all();
    let baseline = all[0];
    all.into_iter().filter(|kind| *kind == baseline || chosen.contains(kind)).collect()
}

/// A structure with what its builds cost, or why there is none.
struct Built {
    kind: StructureKind,
    structure: Result<Structure, String>,
    builds: Vec<Build>,
}

/// One way to ask a structure.
struct Entrant<'a> {
    is_packets: bool,
    asks: Box<dyn Contestant + 'a>,
}

fn entrants<'a>((index, built): (usize, &'a Built)) -> Vec<(usize, Entrant<'a>)> {
    let Ok(structure) = &built.structure else { return Vec::new() };
    let singles = Entrant { is_packets: false, asks: structure.singles() };
    let packets = structure.packets().map(|asks| Entrant { is_packets: true, asks });
    std::iter::once(singles).chain(packets).map(|entrant| (index, entrant)).collect()
}

/// The rows, in the order of the structures; those that are measured are in the order of `entries`.
fn rows(built: &[Built], entries: &[(usize, Entrant<'_>)], primitives: u64) -> Vec<Row> {
    let empty = |built: &Built| Row {
        name: built.kind.name().to_owned(),
        what: String::new(),
        not_measured: None,
        builds: Vec::new(),
        bytes: None,
        bytes_per_primitive: None,
        speeds: Vec::new(),
        against_baseline: Vec::new(),
        against_f64: Vec::new(),
    };
    let mut rows = Vec::new();
    for (index, built) in built.iter().enumerate() {
        let structure = match &built.structure {
            Ok(structure) => structure,
            Err(reason) => {
                rows.push(Row { not_measured: Some(reason.clone()), ..empty(built) });
                continue;
            }
        };
        let info = structure.info();
        for (_, entrant) in entries.iter().filter(|(i, _)| *i == index) {
            let mut row = Row { what: format!("{} ({})", info.name, info.isa), ..empty(built) };
            if entrant.is_packets {
                row.name += " packets";
                row.what += &format!(", {} rays at once", info.packet_width);
            } else {
                row.builds.clone_from(&built.builds);
                row.bytes = Some(info.bytes);
                row.bytes_per_primitive = Some(info.bytes as f64 / primitives as f64);
            }
            rows.push(row);
        }
    }
    rows
}

fn rows_measured(rows: &mut [Row]) -> impl Iterator<Item = &mut Row> {
    rows.iter_mut().filter(|row| row.not_measured.is_none())
}

/// Builds all of them: with one thread first, then with all, which are kept.
fn build_all(
    scene: &Scene,
    kinds: &[StructureKind],
    pools: &Pools,
    options: &BenchOptions,
    work: &mut Progress<'_>,
) -> Result<Vec<Built>, BenchError> {
    let mut built: Vec<Built> = kinds
        .iter()
        .map(|&kind| Built { kind, structure: Err(String::new()), builds: Vec::new() })
        .collect();
    for pool in pools.each() {
        for entry in &mut built {
            let (structure, build) = build_some(scene, entry.kind, pool, options, work)?;
            entry.builds.extend(build);
            // One at a time is held: the former goes before the next is kept.
            entry.structure = Err(String::new());
            if pool.current_num_threads() == options.threads || structure.is_err() {
                entry.structure = structure;
            }
            work.step(1);
        }
    }
    Ok(built)
}

/// Builds a structure three times, or less often where that would take long.
fn build_some(
    scene: &Scene,
    kind: StructureKind,
    pool: &ThreadPool,
    options: &BenchOptions,
    work: &Progress<'_>,
) -> Result<(Result<Structure, String>, Option<Build>), BenchError> {
    let threads = pool.current_num_threads();
    let go_on = || !work.observer.stop();
    let mut times = Vec::new();
    loop {
        let clock = Instant::now();
        let structure = match pool.install(|| kind.build(scene, threads, &go_on)) {
            Ok(structure) => structure,
            Err(NotBuilt::Interrupted) => return Err(BenchError::Interrupted),
            Err(NotBuilt::Because(reason)) => return Ok((Err(reason), None)),
        };
        times.push(clock.elapsed().as_secs_f64());
        if times.len() == 3 || times.iter().sum::<f64>() * 2.0 > options.seconds {
            let builds = times.len();
            // Brute force builds nothing.
            let is_brute = kind == StructureKind::Accel(AccelKind::Brute);
            let build = Build { threads, seconds: median(times), builds };
            return Ok((Ok(structure), (!is_brute).then_some(build)));
        }
    }
}

/// Compares every row with the baseline, and with brute force on as many rays as there is time for.
#[expect(clippy::too_many_arguments, reason = "one call, of what it reads and what it fills")]
fn agreements(
    scene: &Scene,
    contestants: &[&dyn Contestant],
    kind: RayKind,
    blocks: &[RayBlock],
    options: &BenchOptions,
    pool: &ThreadPool,
    rows: &mut [Row],
    work: &mut Progress<'_>,
) -> Result<(), BenchError> {
    let seconds = options.seconds / 8.0;
    let sample = |contestant: &dyn Contestant| {
        let per_block = probe(contestant, kind, blocks, pool, work.observer);
        let wanted = (seconds / per_block) as usize;
        let runs = spread(blocks.len(), wanted.max(4), if wanted < 4096 { 1 } else { 64 });
        runs.into_iter().flat_map(|run| &blocks[run]).collect::<Vec<_>>()
    };
    let brute = oracle(scene);
    let brute = brute.singles();
    let checked = sample(&*brute);
    let truth = known(&*brute, kind, &checked);
    let baseline = contestants[0];
    for (row, &contestant) in rows_measured(rows).zip(contestants) {
        let agreement = compare(scene, &*brute, contestant, kind, &checked, &truth);
        row.against_f64.push(Compared { kind, agreement });
        let some = sample(contestant);
        let answers = known(baseline, kind, &some);
        let agreement = compare(scene, baseline, contestant, kind, &some, &answers);
        row.against_baseline.push(Compared { kind, agreement });
        if work.observer.stop() {
            return Err(BenchError::Interrupted);
        }
    }
    work.step(1);
    Ok(())
}

/// Over all kinds of rays.
pub fn total(compared: &[Compared]) -> Agreement {
    let mut sum = Agreement::default();
    compared.iter().for_each(|c| sum += c.agreement);
    sum
}

/// Steps of the work, as told to whoever looks.
struct Progress<'a> {
    observer: &'a dyn Observer,
    done: usize,
    total: usize,
}

impl<'a> Progress<'a> {
    fn new(observer: &'a dyn Observer, options: &BenchOptions) -> Self {
        let pools = if options.threads > 1 { 2 } else { 1 };
        let builds = with_baseline(&options.structures).len() * pools;
        let rounds = RayKind::ALL.len() * (pools * options.rounds + 1);
        Self { observer, done: 0, total: builds + rounds }
    }

    fn step(&mut self, steps: usize) {
        self.done += steps;
        self.observer.progress(self.done as f64 / self.total as f64, 0);
    }
}
