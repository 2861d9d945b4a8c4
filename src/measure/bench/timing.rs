//! Rays per second, in rounds in which every row has its turn.

use std::ops::Range;
use std::time::Instant;

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use serde::Serialize;

use super::rays::{RayKind, Rays, spread};
use super::structures::Contestant;
use super::{BenchError, BenchOptions, Progress};
use crate::accel::RayBlock;
use crate::render::Observer;

/// Blocks that one thread traces before it looks for more, at most.
const RUN: usize = 64;

/// How fast rays of a kind are answered.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Speed {
    /// The kind.
    pub kind: RayKind,
    /// Threads.
    pub threads: usize,
    /// Millions of rays per second: the median of the rounds.
    pub mrays: f64,
    /// The same as a multiple of the baseline's in the same round: the median of the rounds.
    pub ratio: f64,
    /// Rays of each round: fewer where they take long.
    pub rays: u64,
    /// Rounds.
    pub rounds: usize,
}

/// One thread, and all of them.
pub(super) struct Pools {
    one: Option<ThreadPool>,
    pub(super) all: ThreadPool,
}

impl Pools {
    pub(super) fn new(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let pool = |threads| ThreadPoolBuilder::new().num_threads(threads).build();
        let one = (threads > 1).then(|| pool(1)).transpose()?;
        Ok(Self { one, all: pool(threads)? })
    }

    /// Fewest threads first.
    pub(super) fn each(&self) -> impl Iterator<Item = &ThreadPool> {
        self.one.iter().chain([&self.all])
    }
}

/// The speed of every row on one kind of rays.
pub(super) fn race(
    contestants: &[&dyn Contestant],
    kind: RayKind,
    blocks: &[RayBlock],
    pool: &ThreadPool,
    options: &BenchOptions,
    work: &mut Progress<'_>,
) -> Result<Vec<Speed>, BenchError> {
    let threads = pool.current_num_threads();
    let cells = RayKind::ALL.len() * if options.threads > 1 { 2 } else { 1 };
    let seconds = options.seconds / cells as f64;
    let lane = |contestant: &&dyn Contestant| {
        let per_block = probe(*contestant, kind, blocks, pool, work.observer);
        let wanted = (seconds / options.rounds as f64 / per_block) as usize;
        let wanted = wanted.max(threads);
        // Many short runs, as some parts of a picture cost a hundred times as much as others.
        let length = (wanted / 256).clamp(1, RUN);
        let runs = spread(blocks.len(), wanted, length);
        let rays = runs.iter().map(|run| Rays::count(&blocks[run.clone()])).sum();
        Lane { runs, rays, rates: Vec::new(), seconds: 0.0 }
    };
    let mut lanes: Vec<Lane> = contestants.iter().map(lane).collect();
    for round in 0..options.rounds {
        // Each comes first and last by turns. The baseline takes part in all rounds, others as long as
        // they have time.
        let mut order: Vec<usize> = (0..lanes.len()).collect();
        if round % 2 == 1 {
            order.reverse();
        }
        for i in order {
            let lane = &mut lanes[i];
            if i > 0 && lane.seconds > 1.5 * seconds {
                continue;
            }
            let time = trace(contestants[i], kind, blocks, &lane.runs, pool, work.observer);
            lane.rates.push(lane.rays as f64 / time);
            lane.seconds += time;
        }
        if work.observer.stop() {
            return Err(BenchError::Interrupted);
        }
        work.step(1);
    }
    let base = lanes[0].rates.clone();
    let speed = |lane: Lane| {
        let ratios = lane.rates.iter().zip(&base).map(|(rate, base)| rate / base).collect();
        Speed {
            kind,
            threads,
            rays: lane.rays,
            rounds: lane.rates.len(),
            mrays: median(lane.rates) / 1e6,
            ratio: median(ratios),
        }
    };
    Ok(lanes.into_iter().map(speed).collect())
}

/// What a row traces in each round, and how fast it was.
struct Lane {
    runs: Vec<Range<usize>>,
    rays: u64,
    /// Rays per second of each round, the first rounds of all where there was no time for more.
    rates: Vec<f64>,
    seconds: f64,
}

/// Seconds that a block takes, roughly: more and more blocks are tried until that can be told.
pub(super) fn probe(
    contestant: &dyn Contestant,
    kind: RayKind,
    blocks: &[RayBlock],
    pool: &ThreadPool,
    observer: &dyn Observer,
) -> f64 {
    const ENOUGH: f64 = 3e-3;
    let mut wanted = pool.current_num_threads();
    loop {
        let runs = spread(blocks.len(), wanted, (wanted / 64).clamp(1, RUN));
        let count: usize = runs.iter().map(ExactSizeIterator::len).sum();
        let time = trace(contestant, kind, blocks, &runs, pool, observer);
        if time >= ENOUGH || count >= blocks.len() || observer.stop() {
            return time.max(1e-9) / count.max(1) as f64;
        }
        wanted *= 4;
    }
}

fn trace(
    contestant: &dyn Contestant,
    kind: RayKind,
    blocks: &[RayBlock],
    runs: &[Range<usize>],
    pool: &ThreadPool,
    observer: &dyn Observer,
) -> f64 {
    pool.install(|| {
        let clock = Instant::now();
        runs.par_iter().with_max_len(1).for_each(|run| {
            if !observer.stop() {
                contestant.trace(kind, &blocks[run.clone()]);
            }
        });
        clock.elapsed().as_secs_f64()
    })
}

pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
    }
}
