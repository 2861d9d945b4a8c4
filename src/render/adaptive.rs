//! Where the next samples do most: more of them for blocks that the error of the picture comes from.
//!
//! With n samples the share c of a block in the squared error falls as 1/n, so that another sample gains
//! c/n. The error falls fastest where all samples gain the same: n² ∝ c·n, of which neither side depends on
//! n. Decisions are made between passes from the whole film, so that they depend on nothing else.

use std::time::Duration;

use super::state::BlockState;
use super::stop::{barrier_after, last_barrier};
use super::tiles::block_in;
use crate::film::{BlockShares, PixelRect};
use crate::sampler::REPLICATES;

/// Samples of every pixel before shares are believed: four of each replicate.
pub(super) const LEAST: u32 = 16;

/// No block has fewer samples than this share of those of any other, whatever its share seems to be: a
/// small light that no sample has met looks like a picture without noise.
const LEAST_SHARE: f64 = 1.0 / 8.0;

/// A block, as far as this is concerned.
struct Candidate {
    /// Pixels in the window.
    area: f64,
    /// Samples that it has.
    samples: f64,
    /// Samples that it must have.
    least: f64,
    /// √(c·n).
    need: f64,
}

impl Candidate {
    /// Samples where another gains 1/`scale`², within `most` times as many as there are.
    fn samples_at(&self, scale: f64, most: f64) -> f64 {
        (self.need * scale).max(self.least).clamp(self.samples, most * self.samples)
    }
}

/// What limits the next pass.
pub(super) struct Budget {
    /// The error that is wanted.
    pub(super) error: Option<f64>,
    /// Most samples of a pixel.
    pub(super) samples: u32,
    /// How long it may take, and what a sample of all pixels takes.
    pub(super) time: Option<(Duration, Duration)>,
}

/// Sets where each block is to go next. False where there is nothing to do: all have as many samples as
/// they may, or the time does not suffice for a few more.
pub(super) fn set_targets<'b>(
    blocks: impl Iterator<Item = &'b mut BlockState>,
    shares: &BlockShares,
    window: &PixelRect,
    budget: &Budget,
) -> bool {
    let mut blocks: Vec<&mut BlockState> = blocks.collect();
    let end = |block: &BlockState| block.sums.samples().end;
    let most = blocks.iter().map(|block| end(block)).max().unwrap_or(0);
    let candidates: Vec<Candidate> = blocks
        .iter()
        .map(|block| {
            let samples = f64::from(end(block));
            Candidate {
                area: block_in(window, block.origin).area() as f64,
                samples,
                least: LEAST_SHARE * f64::from(most),
                need: (shares.around(block.origin) * samples).sqrt(),
            }
        })
        .collect();
    let all: f64 = candidates.iter().map(|c| c.area * c.samples).sum();
    let pixels: f64 = candidates.iter().map(|c| c.area).sum();
    let added = |scale: f64, most: f64| -> f64 {
        candidates.iter().map(|c| c.area * (c.samples_at(scale, most) - c.samples)).sum()
    };
    // As many again, but half the way to the error, as each pass teaches more.
    let mut room = all;
    if let Some(wanted) = budget.error {
        let error = |scale: f64| -> f64 {
            let share = |c: &Candidate| c.area * c.need * c.need / c.samples_at(scale, 1e9);
            candidates.iter().map(share).sum::<f64>() / pixels
        };
        let scale = bisect(|scale| error(scale) <= wanted * wanted);
        // Nor so few that passes cost more than samples.
        room = room.min((0.5 * added(scale, 1e9)).max(all / 16.0));
    }
    if let Some((left, per_sample)) = budget.time {
        let fits = pixels * left.as_secs_f64() / (1.1 * per_sample.as_secs_f64()).max(1e-9);
        if fits < f64::from(REPLICATES) * 0.05 * pixels {
            return false;
        }
        room = room.min(fits);
    }
    let scale = bisect(|scale| added(scale, 2.0) >= room);
    let mut is_any = false;
    for (block, candidate) in blocks.iter_mut().zip(&candidates) {
        let (from, to) = (end(block), candidate.samples_at(scale, 2.0));
        // Rounded to the nearest barrier, the present one included.
        let next = barrier_after(from);
        let half_way = 0.5 * (f64::from(from) + f64::from(next));
        block.target =
            if to < half_way { from } else { last_barrier(from, to).min(budget.samples.max(from)) };
        is_any |= block.target > from;
    }
    if is_any {
        return true;
    }
    // Nothing stands out: the ones that gain most go on.
    let gain = |c: &Candidate| c.need / c.samples;
    let top = candidates.iter().map(gain).fold(0.0, f64::max);
    for (block, candidate) in blocks.iter_mut().zip(&candidates) {
        if gain(candidate) >= 0.5 * top {
            let from = end(block);
            block.target = barrier_after(from).min(budget.samples.max(from));
            is_any |= block.target > from;
        }
    }
    is_any
}

/// The least scale, to within a thousandth, at which something holds that holds from some scale on.
fn bisect(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (1e-9f64, 1e18f64);
    if !holds(high) {
        return high;
    }
    while high / low > 1.001 {
        let middle = (low * high).sqrt();
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_found_by_halves() {
        for bound in [1e-6, 0.3, 7.0, 1e12] {
            let found = bisect(|x| x >= bound);
            assert!((found / bound - 1.0).abs() < 0.002, "{bound} {found}");
        }
    }

    #[test]
    fn samples_follow_the_root_of_the_variance() {
        let candidate = |need| Candidate { area: 16.0, samples: 16.0, least: 2.0, need };
        // Four times the variance, twice the samples.
        let (a, b) = (candidate(10.0), candidate(20.0));
        assert_eq!(2.0 * a.samples_at(3.0, 100.0), b.samples_at(3.0, 100.0));
        assert_eq!(candidate(1.0).samples_at(3.0, 100.0), 16.0, "none are taken back");
        assert_eq!(candidate(1e9).samples_at(3.0, 2.0), 32.0);
    }
}
