//! Sums over samples that do not depend on how the samples were divided up.
//!
//! The samples of each replicate are added along the fixed binary tree over their index: sample 2k
//! to 2k + 1, that pair to the next, and so on, in f64. Any contiguous range of samples is then a few
//! nodes of that tree, and joining ranges gives the same bits as one run. Rounding grows with the
//! logarithm of the count: a million samples lose no digit that f32 shows.
//!
//! The variance of a pixel's mean is estimated from its replicates' means. The spread of single
//! samples is not even kept: samples of one Owen-scrambled set are not independent, and it would
//! overstate the error 3 to 50 times.

use std::ops::Range;

use crate::color::RgbLanes;
use crate::math::lanes_where;

/// Pixels of a block: 4 × 4, in rows.
pub const BLOCK_LANES: usize = 16;

/// A node of the tree: for every pixel of a block the number of samples that counted, and their sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SumNode {
    /// Samples that counted: all but those that were not finite or outside the picture.
    pub count: [u32; BLOCK_LANES],
    /// Their sum, by channel.
    pub sum: [[f64; BLOCK_LANES]; 3],
}

impl SumNode {
    /// Of no samples.
    pub const EMPTY: Self = Self { count: [0; BLOCK_LANES], sum: [[0.0; BLOCK_LANES]; 3] };

    fn join(&mut self, later: &Self) {
        for lane in 0..BLOCK_LANES {
            self.count[lane] += later.count[lane];
            for c in 0..3 {
                self.sum[c][lane] += later.sum[c][lane];
            }
        }
    }
}

/// A contiguous range of one replicate's samples as nodes of the tree, earliest first.
#[derive(Debug, Default)]
struct Replicate {
    /// (level, node): a node of level l covers 2^l samples.
    nodes: Vec<(u32, SumNode)>,
    /// One past the last sample's index within the replicate.
    end: u32,
}

impl Replicate {
    /// Adds the next leaf, which `fill` writes.
    fn push(&mut self, fill: impl FnOnce(&mut SumNode)) {
        self.nodes.push((0, SumNode::EMPTY));
        if let Some((_, leaf)) = self.nodes.last_mut() {
            fill(leaf);
        }
        self.end += 1;
        self.join_pairs();
    }

    /// Adds a node that begins where the last one ends.
    fn append(&mut self, level: u32, node: SumNode) {
        self.nodes.push((level, node));
        self.end += 1 << level;
        self.join_pairs();
    }

    /// Makes every pair that the last node completes one node.
    fn join_pairs(&mut self) {
        while let [.., (left_level, left), (level, node)] = self.nodes.as_mut_slice()
            && *left_level == *level
            // A node's position on its level is odd where it completes a pair.
            && ((self.end >> *level) - 1) & 1 == 1
        {
            left.join(node);
            *left_level += 1;
            self.nodes.pop();
        }
    }

    /// The sum of all nodes, joined from the last backwards; none where there is none.
    fn total(&self) -> Option<SumNode> {
        let mut nodes = self.nodes.iter().rev().map(|(_, node)| node);
        let mut total = *nodes.next()?;
        for earlier in nodes {
            let later = std::mem::replace(&mut total, *earlier);
            total.join(&later);
        }
        Some(total)
    }
}

/// Adds up the samples of one block of 4 × 4 pixels. Reusable, so that a thread allocates once.
#[derive(Debug)]
pub struct BlockAccumulator {
    /// Number of the first sample.
    first: u32,
    replicates: Vec<Replicate>,
    /// Sums of the replicates that have any samples, while a block is finished.
    totals: Vec<SumNode>,
}

impl BlockAccumulator {
    /// For samples of which number i belongs to replicate i mod `replicates`.
    pub fn new(replicates: u32) -> Self {
        let replicates = (0..replicates).map(|_| Replicate::default()).collect();
        Self { first: 0, replicates, totals: Vec::new() }
    }

    /// Forgets everything; the next sample is number `first_sample`.
    pub fn restart(&mut self, first_sample: u32) {
        let replicates = self.replicates.len() as u32;
        self.first = first_sample;
        for (r, replicate) in (0u32..).zip(&mut self.replicates) {
            replicate.nodes.clear();
            replicate.end = samples_below(first_sample, r, replicates);
        }
    }

    /// Stores what was added so far, for [`BlockAccumulator::resume`].
    pub fn store(&self, sums: &mut BlockSums) {
        sums.samples = self.first..self.replicates.iter().map(|replicate| replicate.end).sum();
        sums.nodes.clear();
        sums.nodes.reserve_exact(self.replicates.iter().map(|r| r.nodes.len()).sum());
        for replicate in &self.replicates {
            sums.nodes.extend(replicate.nodes.iter().map(|(_, node)| *node));
        }
    }

    /// Goes on from what was stored of as many replicates.
    pub fn resume(&mut self, sums: &BlockSums) {
        self.restart(sums.samples.start);
        self.append(sums);
    }

    /// Adds the sums of the samples that follow the last one, of as many replicates. False, and nothing is
    /// added, where they begin elsewhere.
    pub fn append(&mut self, sums: &BlockSums) -> bool {
        let end: u32 = self.replicates.iter().map(|replicate| replicate.end).sum();
        if sums.samples.start != end {
            return false;
        }
        let replicates = self.replicates.len() as u32;
        let mut nodes = sums.nodes.iter();
        for (r, replicate) in (0u32..).zip(&mut self.replicates) {
            for (level, node) in levels(&sums.samples, r, replicates).zip(&mut nodes) {
                replicate.append(level, *node);
            }
        }
        true
    }

    /// Adds sample `index` of all pixels, which must follow the one before it.
    ///
    /// Lanes that `valid` leaves out count as not sampled. A value that is not finite is left out too;
    /// returned are the lanes where that happened, as bits.
    pub fn add(&mut self, index: u32, valid: u16, radiance: &RgbLanes<BLOCK_LANES>) -> u16 {
        let mut dropped = 0;
        let replicates = self.replicates.len() as u32;
        let replicate = &mut self.replicates[(index % replicates) as usize];
        debug_assert_eq!(replicate.end, index / replicates, "samples come in order");
        replicate.push(|leaf| {
            let counts = counting(valid, radiance);
            dropped = valid & !lanes_where(&counts);
            leaf.count = counts.map(u32::from);
            for (sum, values) in leaf.sum.iter_mut().zip(&radiance.0) {
                for lane in 0..BLOCK_LANES {
                    sum[lane] = if counts[lane] { values[lane].into() } else { 0.0 };
                }
            }
        });
        dropped
    }

    /// Mean of every pixel, and the standard error of the mean.
    pub fn finish(&mut self, origin: [u32; 2]) -> BlockPixels {
        self.totals.clear();
        self.totals.extend(self.replicates.iter().filter_map(Replicate::total));
        let totals = &self.totals;
        let mut pixels = BlockPixels {
            origin,
            mean: RgbLanes::BLACK,
            standard_error: RgbLanes([[f32::NAN; BLOCK_LANES]; 3]),
            samples: [0; BLOCK_LANES],
        };
        // Samples of each pixel, and replicates that have any.
        let (mut n, mut filled) = ([0.0; BLOCK_LANES], [0.0; BLOCK_LANES]);
        for total in totals {
            for lane in 0..BLOCK_LANES {
                n[lane] += f64::from(total.count[lane]);
                filled[lane] += f64::from(total.count[lane].min(1));
                pixels.samples[lane] += total.count[lane];
            }
        }
        // A single replicate shows no error.
        let shows_error = totals.len() > 1;
        // Channel by channel, all pixels side by side; what was not sampled comes out as NaN.
        let channels: [_; 3] = std::array::from_fn(|c| {
            let (mut mean, mut variance) = ([0.0; BLOCK_LANES], [0.0; BLOCK_LANES]);
            for total in totals {
                mean.iter_mut().zip(&total.sum[c]).for_each(|(mean, sum)| *mean += sum);
            }
            mean.iter_mut().zip(&n).for_each(|(mean, n)| *mean /= n);
            // Weighted by their counts, as the last replicates may be one sample short.
            for total in totals.iter().filter(|_| shows_error) {
                for lane in 0..BLOCK_LANES {
                    let k = f64::from(total.count[lane]);
                    let spread = k * (total.sum[c][lane] / k - mean[lane]).powi(2);
                    variance[lane] += if k > 0.0 { spread } else { 0.0 };
                }
            }
            for lane in 0..BLOCK_LANES {
                variance[lane] /= n[lane] * (filled[lane] - 1.0);
            }
            (mean, variance)
        });
        for lane in (0..BLOCK_LANES).filter(|lane| n[*lane] > 0.0) {
            let out = pixels.mean.0.iter_mut().zip(&mut pixels.standard_error.0);
            for ((mean, error), (sums, variances)) in out.zip(&channels) {
                mean[lane] = sums[lane] as f32;
                if filled[lane] > 1.0 {
                    error[lane] = variances[lane].sqrt() as f32;
                }
            }
        }
        pixels
    }
}

/// Samples of replicate `r` among those with numbers below `sample`.
const fn samples_below(sample: u32, r: u32, replicates: u32) -> u32 {
    sample / replicates + (r < sample % replicates) as u32
}

/// The levels of the nodes that the samples of replicate `r` in a range make, earliest first: from where
/// the range begins, each time the largest node that begins there and ends within it.
fn levels(samples: &Range<u32>, r: u32, replicates: u32) -> impl Iterator<Item = u32> + use<> {
    let end = samples_below(samples.end, r, replicates);
    let mut at = samples_below(samples.start, r, replicates);
    std::iter::from_fn(move || {
        let level = at.trailing_zeros().min(end.checked_sub(at)?.checked_ilog2()?);
        at += 1 << level;
        Some(level)
    })
}

/// The sums of a contiguous range of the samples of a block, to be gone on from or joined with others.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BlockSums {
    samples: Range<u32>,
    /// Of each replicate, earliest first.
    nodes: Vec<SumNode>,
}

impl BlockSums {
    /// Of no samples; the first to come is number `first`.
    pub const fn starting_at(first: u32) -> Self {
        Self { samples: first..first, nodes: Vec::new() }
    }

    /// From the nodes of the range: those of each replicate in turn, as many as
    /// [`BlockSums::nodes_of_replicate`] says. None where their number is another.
    pub fn from_nodes(samples: Range<u32>, replicates: u32, nodes: Vec<SumNode>) -> Option<Self> {
        let expected: usize =
            (0..replicates).map(|r| Self::nodes_of_replicate(&samples, r, replicates)).sum();
        (samples.start <= samples.end && nodes.len() == expected).then_some(Self { samples, nodes })
    }

    /// How many nodes the samples of replicate `r` in a range make.
    pub fn nodes_of_replicate(samples: &Range<u32>, r: u32, replicates: u32) -> usize {
        levels(samples, r, replicates).count()
    }

    /// The samples that are summed.
    pub const fn samples(&self) -> &Range<u32> {
        &self.samples
    }

    /// The nodes of each replicate in turn, earliest first.
    pub fn nodes(&self) -> &[SumNode] {
        &self.nodes
    }
}

/// The finished pixels of a block.
#[derive(Debug, Clone)]
pub struct BlockPixels {
    /// Absolute coordinates of the first pixel; multiples of 4.
    pub origin: [u32; 2],
    /// Mean radiance, in rows of 4.
    pub mean: RgbLanes<BLOCK_LANES>,
    /// Standard error of that mean; NaN where the samples do not show it: fewer than two replicates
    /// have any.
    pub standard_error: RgbLanes<BLOCK_LANES>,
    /// Samples that counted.
    pub samples: [u32; BLOCK_LANES],
}

impl BlockPixels {
    /// What [`BlockAccumulator`] makes of a single sample, and which lanes it dropped: most previews are
    /// no more than that.
    pub fn of_one_sample(
        origin: [u32; 2],
        valid: u16,
        radiance: &RgbLanes<BLOCK_LANES>,
    ) -> (Self, u16) {
        let mut pixels = Self {
            origin,
            mean: RgbLanes::BLACK,
            standard_error: RgbLanes([[f32::NAN; BLOCK_LANES]; 3]),
            samples: [0; BLOCK_LANES],
        };
        let counts = counting(valid, radiance);
        pixels.samples = counts.map(u32::from);
        for (mean, values) in pixels.mean.0.iter_mut().zip(&radiance.0) {
            for lane in 0..BLOCK_LANES {
                // From nothing, as sums begin: −0 becomes 0.
                mean[lane] = 0.0 + if counts[lane] { values[lane] } else { 0.0 };
            }
        }
        (pixels, valid & !lanes_where(&counts))
    }
}

/// Which values count: the `valid` ones that are finite.
#[inline(always)]
fn counting(valid: u16, radiance: &RgbLanes<BLOCK_LANES>) -> [bool; BLOCK_LANES] {
    let [r, g, b] = &radiance.0;
    std::array::from_fn(|lane| {
        let is_finite = r[lane].is_finite() & g[lane].is_finite() & b[lane].is_finite();
        (valid >> lane & 1 == 1) & is_finite
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;

    fn accumulate(n: u32, value: impl Fn(u32) -> f32) -> BlockPixels {
        let mut block = BlockAccumulator::new(4);
        block.restart(0);
        for i in 0..n {
            assert_eq!(block.add(i, u16::MAX, &RgbLanes::splat(Rgb::splat(value(i)))), 0);
        }
        block.finish([0, 0])
    }

    #[test]
    fn a_million_samples_lose_no_digit() {
        // 0.1 as f32, a million times: the mean is 0.1 to the last bit.
        let pixels = accumulate(1_000_000, |_| 0.1);
        assert_eq!(pixels.mean.get(5), Rgb::splat(0.1));
        assert_eq!(pixels.standard_error.get(5), Rgb::BLACK);
        // A huge sample among small ones: sum = 1e8 + 999,999 · 0.25, known exactly.
        let pixels = accumulate(1_000_000, |i| if i == 77 { 1e8 } else { 0.25 });
        assert_eq!(pixels.mean.get(0).r, ((1e8 + 999_999.0 * 0.25) / 1e6) as f32);
    }

    #[test]
    fn the_error_is_that_of_the_replicates() {
        // Replicate r is constant with value r, so the means are 0, 1, 2, 3: variance of their mean 5/12.
        let pixels = accumulate(64, |i| (i % 4) as f32);
        assert_eq!(pixels.mean.get(3).g, 1.5);
        assert!((pixels.standard_error.get(3).g - (5f32 / 12.0).sqrt()).abs() < 1e-6);
        // A single replicate shows nothing.
        assert!(accumulate(1, |_| 1.0).standard_error.get(3).g.is_nan());
    }

    #[test]
    fn values_that_are_not_finite_are_left_out() {
        let mut block = BlockAccumulator::new(4);
        block.restart(0);
        let mut radiance = RgbLanes::splat(Rgb::splat(2.0));
        radiance.set(3, Rgb::new(0.0, f32::NAN, 0.0));
        assert_eq!(block.add(0, u16::MAX, &radiance), 1 << 3);
        assert_eq!(block.add(1, u16::MAX, &RgbLanes::splat(Rgb::splat(4.0))), 0);
        let pixels = block.finish([0, 0]);
        assert_eq!((pixels.mean.get(3).r, pixels.mean.get(4).r), (4.0, 3.0));
    }

    #[test]
    fn what_is_stored_goes_on_to_the_same_bits() {
        let value = |i: u32| RgbLanes::splat(Rgb::new((i as f32).sin(), 1.0 / (i + 1) as f32, 0.1));
        let mut whole = BlockAccumulator::new(4);
        whole.restart(0);
        let mut parts = BlockAccumulator::new(4);
        parts.restart(0);
        let mut stored = BlockSums::default();
        for i in 0..300 {
            whole.add(i, u16::MAX, &value(i));
            parts.add(i, u16::MAX, &value(i));
            if i % 7 == 0 {
                parts.store(&mut stored);
                parts.restart(5);
                parts.resume(&stored);
                let (samples, nodes) = (stored.samples().clone(), stored.nodes().to_vec());
                assert_eq!(BlockSums::from_nodes(samples, 4, nodes), Some(stored.clone()));
            }
        }
        let (a, b) = (whole.finish([0, 0]), parts.finish([0, 0]));
        assert_eq!((a.mean, a.standard_error), (b.mean, b.standard_error));
    }

    #[test]
    fn parts_join_to_the_same_bits() {
        let value = |i: u32| RgbLanes::splat(Rgb::new((i as f32).sin(), 1.0 / (i + 1) as f32, 0.1));
        let sums = |range: Range<u32>| {
            let mut block = BlockAccumulator::new(4);
            block.restart(range.start);
            range.for_each(|i| assert_eq!(block.add(i, u16::MAX, &value(i)), 0));
            let mut sums = BlockSums::default();
            block.store(&mut sums);
            sums
        };
        let whole = sums(0..211);
        for cuts in [[0, 1, 2, 211], [0, 50, 100, 211], [0, 64, 128, 211], [0, 5, 205, 211]] {
            let mut joined = BlockAccumulator::new(4);
            joined.restart(0);
            let parts: Vec<_> = cuts.windows(2).map(|cut| sums(cut[0]..cut[1])).collect();
            assert!(!joined.append(&parts[1]), "not in order");
            assert!(parts.iter().all(|part| joined.append(part)));
            let mut stored = BlockSums::default();
            joined.store(&mut stored);
            assert_eq!(stored, whole, "{cuts:?}");
        }
    }

    #[test]
    fn one_sample_is_the_same_without_sums() {
        let mut radiance = RgbLanes::from_fn(|lane| Rgb::new(0.1, lane as f32, -0.0));
        radiance.set(5, Rgb::new(f32::INFINITY, 0.0, 0.0));
        radiance.set(15, Rgb::splat(f32::NAN));
        let mut block = BlockAccumulator::new(4);
        block.restart(0);
        let dropped = block.add(0, 0x7fff, &radiance);
        let (pixels, also) = BlockPixels::of_one_sample([8, 4], 0x7fff, &radiance);
        assert_eq!((also, dropped), (1 << 5, 1 << 5));
        let expected = block.finish([8, 4]);
        assert_eq!((pixels.origin, pixels.mean), (expected.origin, expected.mean));
        assert!(pixels.standard_error.0.iter().flatten().all(|e| e.is_nan()));
    }

    #[test]
    fn the_tree_depends_on_the_index_alone() {
        // The nodes of [0, 24) are those of [0, 24) cut anywhere: push the same samples, compare shapes.
        let mut whole = Replicate::default();
        for _ in 0..24 {
            whole.push(|_| ());
        }
        assert_eq!(whole.nodes.iter().map(|n| n.0).collect::<Vec<_>>(), [4, 3]);
        let mut late = Replicate { end: 10, ..Replicate::default() };
        for _ in 10..24 {
            late.push(|_| ());
        }
        assert_eq!(late.nodes.iter().map(|n| n.0).collect::<Vec<_>>(), [1, 2, 3]);
    }
}
