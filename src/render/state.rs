//! How far a render is, block by block: what a checkpoint or a part holds, and a render goes on from.

use std::ops::Range;

use super::NonFinite;
use super::tiles::{Tile, blocks, tiles};
use crate::film::{Aov, BlockAccumulator, BlockSums, Film, Layers, PixelRect, Shares, add_share};
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
    /// The same samples, of each layer that is a mean over them ([`Layers::means_of`]).
    pub layers: Vec<BlockSums>,
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
    /// The layers that it has.
    pub layers: Vec<Aov>,
    /// Cryptomattes: by pixel of the window, the ids that it shows.
    pub mattes: Vec<(Aov, Vec<Shares>)>,
}

/// The first pixels of all blocks that touch `window`, in the order in which they are kept: tile by tile.
pub fn block_origins(window: &PixelRect) -> impl Iterator<Item = [u32; 2]> {
    tiles(window).flat_map(|tile| blocks(&tile, window).collect::<Vec<_>>())
}

impl RenderState {
    /// The state before sample number `first_sample`.
    pub fn before(first_sample: u32, window: PixelRect, layers: &[Aov]) -> Self {
        let layers = Layers::new(layers, window.area());
        let block = |origin| {
            let sums = BlockSums::starting_at(first_sample);
            let layers = vec![sums.clone(); layers.means.len()];
            BlockState { origin, target: first_sample, sums, layers }
        };
        Self {
            window,
            first_sample,
            passed: first_sample,
            blocks: block_origins(&window).map(block).collect(),
            rays: RayCounts::default(),
            non_finite: NonFinite::default(),
            mattes: layers.mattes,
            layers: layers.wanted,
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
        film.layers = Layers::new(&self.layers, self.window.area());
        film.layers.mattes.clone_from(&self.mattes);
        let mut sums = BlockAccumulator::new(REPLICATES);
        for block in self.blocks.iter().filter(|block| !block.sums.samples().is_empty()) {
            sums.resume(&block.sums);
            film.put(&sums.finish(block.origin));
            for (layer, kept) in block.layers.iter().enumerate() {
                sums.resume(kept);
                film.put_layer(layer, block.origin, &sums.finish(block.origin).mean);
            }
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
            || next.layers != self.layers
            || mine.end != other.start
            || !is_even(self)
            || !is_even(&next)
        {
            return Err(Box::new(next));
        }
        let mut sums = BlockAccumulator::new(REPLICATES);
        for (block, next) in self.blocks.iter_mut().zip(&next.blocks) {
            let layers = block.layers.iter_mut().zip(&next.layers);
            for (kept, next) in [(&mut block.sums, &next.sums)].into_iter().chain(layers) {
                sums.resume(kept);
                sums.append(next);
                sums.store(kept);
            }
            block.target = next.target;
        }
        for ((_, mine), (_, next)) in self.mattes.iter_mut().zip(&next.mattes) {
            for (mine, next) in mine.iter_mut().zip(next) {
                next.iter().for_each(|(id, count)| add_share(mine, *id, *count));
            }
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
