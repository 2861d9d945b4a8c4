//! How far a render is, block by block: what a checkpoint or a part holds, and a render goes on from.

use std::ops::Range;

use super::NonFinite;
use super::tiles::{Tile, blocks, tiles};
use crate::film::{BlockAccumulator, BlockPixels, BlockSums, Film, PixelRect};
use crate::integrator::RayCounts;
use crate::sampler::REPLICATES;

/// A block of 4 × 4 pixels, as far as it is.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockState {
    /// Absolute coordinates of its first pixel; multiples of 4.
    pub origin: [u32; 2],
    /// Number of the sample at which the pass that is under way ends.
    pub target: u32,
    /// The samples that it has.
    pub sums: BlockSums,
}

impl BlockState {
    /// Whether a pass up to `limit` has samples for it.
    pub(super) fn is_behind(&self, limit: u32) -> bool {
        self.sums.samples().end < self.target.min(limit)
    }
}

/// How far a render is.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderState {
    /// The part of the picture that it renders.
    pub window: PixelRect,
    /// Number of the first sample of every pixel.
    pub first_sample: u32,
    /// Number of the sample at which the last finished pass of all blocks ended.
    pub passed: u32,
    /// All blocks that touch the window, in the order of [`block_origins`].
    pub blocks: Vec<BlockState>,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples that were left out.
    pub non_finite: NonFinite,
}

/// The first pixels of all blocks that touch `window`, in the order in which they are kept: tile by tile.
pub fn block_origins(window: &PixelRect) -> impl Iterator<Item = [u32; 2]> {
    tiles(window).flat_map(|tile| blocks(&tile, window).collect::<Vec<_>>())
}

impl RenderState {
    /// The state before sample number `first_sample`.
    pub fn before(first_sample: u32, window: PixelRect) -> Self {
        let block = |origin| {
            let sums = BlockSums::starting_at(first_sample);
            BlockState { origin, target: first_sample, sums }
        };
        Self {
            window,
            first_sample,
            passed: first_sample,
            blocks: block_origins(&window).map(block).collect(),
            rays: RayCounts::default(),
            non_finite: NonFinite::default(),
        }
    }

    /// The samples that every pixel has.
    pub fn samples(&self) -> Range<u32> {
        let end = self.blocks.iter().map(|block| block.sums.samples().end).min();
        self.first_sample..end.unwrap_or(self.first_sample)
    }

    /// The picture of the samples so far.
    pub fn film(&self, size: [u32; 2]) -> Film {
        let mut film = Film::new(size, self.window, true);
        let mut sums = BlockAccumulator::new(REPLICATES);
        for block in self.blocks.iter().filter(|block| !block.sums.samples().is_empty()) {
            film.put(&pixels(&mut sums, block));
        }
        film
    }

    /// Adds the samples of a state of the same window that follow those that this one has: the next part.
    /// Where they do not follow, or not of all blocks, it is handed back.
    ///
    /// # Errors
    /// The state that could not be added.
    pub fn append(&mut self, next: Self) -> Result<(), Box<Self>> {
        let [mine, other] = [self.samples(), next.samples()];
        let is_even = |state: &Self| {
            let range = state.samples();
            state.blocks.iter().all(|block| *block.sums.samples() == range)
        };
        if next.window != self.window
            || mine.end != other.start
            || !is_even(self)
            || !is_even(&next)
        {
            return Err(Box::new(next));
        }
        let mut sums = BlockAccumulator::new(REPLICATES);
        for (block, next) in self.blocks.iter_mut().zip(&next.blocks) {
            sums.resume(&block.sums);
            sums.append(&next.sums);
            sums.store(&mut block.sums);
            block.target = next.target;
        }
        self.passed = next.passed;
        self.rays.add(&next.rays);
        self.non_finite.add(next.non_finite);
        Ok(())
    }

    /// Its blocks as tiles.
    pub(super) fn take_tiles(&mut self) -> Vec<Tile> {
        let mut states = std::mem::take(&mut self.blocks).into_iter();
        let tile = |at: PixelRect| {
            let count = blocks(&at, &self.window).count();
            Tile { at, blocks: states.by_ref().take(count).collect(), done: 0 }
        };
        tiles(&self.window).map(tile).collect()
    }
}

/// The pixels of a block as its sums have them.
fn pixels(sums: &mut BlockAccumulator, block: &BlockState) -> BlockPixels {
    sums.resume(&block.sums);
    sums.finish(block.origin)
}
