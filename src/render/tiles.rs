//! Tiles of the picture, and the blocks of pixels in them: camera rays in, sums of samples out.

use std::ops::Range;

use glam::DVec2;

use super::{NON_FINITE_TOLD, NonFinite, Observer};
use crate::accel::{LANES, RayBlock, RayQuery};
use crate::film::{BLOCK_LANES, BlockAccumulator, BlockPixels, BlockSums, FilterTable, PixelRect};
use crate::integrator::{CameraBlock, Integrator, RayCounts};
use crate::sampler::{Dimensions, PixelSampler, REPLICATES, Sampler};
use crate::scene::Scene;

/// Pixels of a tile's side: a multiple of the block's 4.
const TILE: u32 = 32;

/// Samples of a block between two looks at whether to stop.
const STOP_EVERY: u32 = 256;

const _: () = assert!(LANES == BLOCK_LANES, "a block of rays is a block of pixels");

/// The tiles that touch `window`, in rows, at absolute positions: multiples of [`TILE`].
pub(super) fn tiles(window: &PixelRect) -> Vec<Tile> {
    let span = |from: u32, to: u32| (from / TILE..to.div_ceil(TILE)).map(|i| i * TILE);
    span(window.y0, window.y1)
        .flat_map(|y0| {
            span(window.x0, window.x1).map(move |x0| {
                let at = PixelRect { x0, y0, x1: x0 + TILE, y1: y0 + TILE };
                Tile { at, sums: Vec::new() }
            })
        })
        .collect()
}

/// A tile, and what the samples of its blocks add up to as far as they are taken.
pub(super) struct Tile {
    pub(super) at: PixelRect,
    /// In the order of the blocks; empty before the first pass, and where there is only one.
    sums: Vec<BlockSums>,
}

/// Samples of every pixel that are taken in one go.
pub(super) struct Pass {
    pub(super) samples: Range<u32>,
    /// Whether others follow.
    pub(super) goes_on: bool,
}

pub(super) struct TileRenderer<'a, Q, I> {
    pub(super) scene: &'a Scene,
    pub(super) query: &'a Q,
    pub(super) integrator: &'a I,
    pub(super) filter: FilterTable,
    pub(super) seed: u64,
    pub(super) window: PixelRect,
}

/// What a thread works with; reused from tile to tile.
pub(super) struct Workspace {
    sums: BlockAccumulator,
    pub(super) output: TileOutput,
}

impl Workspace {
    pub(super) fn new() -> Self {
        Self { sums: BlockAccumulator::new(REPLICATES), output: TileOutput::default() }
    }
}

/// What came of a tile.
#[derive(Default)]
pub(super) struct TileOutput {
    pub(super) blocks: Vec<BlockPixels>,
    pub(super) rays: RayCounts,
    pub(super) non_finite: NonFinite,
    /// Pixels of the window that were finished.
    pub(super) pixels: u64,
}

impl TileOutput {
    /// Forgets the last tile; memory for blocks stays.
    fn restart(&mut self) {
        self.blocks.clear();
        self.rays = RayCounts::default();
        self.non_finite = NonFinite::default();
        self.pixels = 0;
    }
}

impl<Q: RayQuery, I: Integrator> TileRenderer<'_, Q, I> {
    /// Renders a pass of the blocks of a tile that touch the window; whole blocks, as a packet's hits at
    /// shared edges may depend on its neighbours, and a crop must not. All of them are finished unless the
    /// observer ends it.
    pub(super) fn render(
        &self,
        tile: &mut Tile,
        pass: &Pass,
        workspace: &mut Workspace,
        observer: &dyn Observer,
    ) {
        let Workspace { sums, output } = workspace;
        output.restart();
        let mut number = 0;
        for y in (tile.at.y0..tile.at.y1).step_by(4) {
            for x in (tile.at.x0..tile.at.x1).step_by(4) {
                let block = PixelRect { x0: x, y0: y, x1: x + 4, y1: y + 4 };
                let block = block.intersection(&self.window);
                if block.area() == 0 {
                    continue;
                }
                if pass.goes_on && tile.sums.len() == number {
                    tile.sums.push(BlockSums::default());
                }
                let kept = tile.sums.get_mut(number);
                match &kept {
                    Some(kept) => sums.resume(kept),
                    None => sums.restart(0),
                }
                if !self.render_block([x, y], &block, pass, sums, output, observer) {
                    return;
                }
                if let Some(kept) = kept {
                    sums.store(kept);
                }
                output.pixels += block.area() as u64;
                number += 1;
            }
        }
    }

    /// Renders the block at `origin`, of which `wanted` is inside the window, on top of `sums`. False where
    /// the observer ended it; the pass over the block is then discarded.
    fn render_block(
        &self,
        origin: [u32; 2],
        wanted: &PixelRect,
        pass: &Pass,
        sums: &mut BlockAccumulator,
        output: &mut TileOutput,
        observer: &dyn Observer,
    ) -> bool {
        let pixel = |lane: usize| [origin[0] + lane as u32 % 4, origin[1] + lane as u32 / 4];
        let whole = PixelRect::whole(self.scene.size);
        let inside = (0..LANES)
            .filter(|&lane| {
                let [x, y] = pixel(lane);
                whole.contains(x, y)
            })
            .fold(0u16, |bits, lane| bits | 1 << lane);

        let is_all = pass.samples == (0..1) && !pass.goes_on;
        let pixels: [PixelSampler; LANES] =
            std::array::from_fn(|lane| PixelSampler::new(self.seed, pixel(lane)));
        for sample in pass.samples.clone() {
            if sample % STOP_EVERY == 0 && observer.stop() {
                return false;
            }
            let samplers = pixels.map(|pixel| pixel.sample(sample));
            let (rays, weights) = self.camera_rays(origin, inside, &samplers);
            output.rays.camera += u64::from(rays.active().count_ones());
            let hits = self.query.intersect_block(&rays);
            let camera = CameraBlock { rays: &rays, hits: &hits, samplers: &samplers };
            let mut radiance =
                self.integrator.shade(self.scene, self.query, &camera, &mut output.rays);
            for (value, weight) in radiance.iter_mut().zip(weights) {
                *value *= weight;
            }
            let dropped = if is_all {
                let (pixels, dropped) = BlockPixels::of_one_sample(origin, inside, &radiance);
                output.blocks.push(pixels);
                dropped
            } else {
                sums.add(sample, inside, &radiance)
            };
            for lane in (0..LANES).filter(|lane| dropped >> lane & 1 == 1) {
                let [x, y] = pixel(lane);
                if !wanted.contains(x, y) {
                    continue;
                }
                output.non_finite.count += 1;
                if output.non_finite.first.len() < NON_FINITE_TOLD {
                    output.non_finite.first.push(([x, y], sample));
                }
            }
        }
        if !is_all {
            output.blocks.push(sums.finish(origin));
        }
        true
    }

    /// The camera rays of one sample of the pixels of a block that are `inside` the picture, and what the
    /// filter makes of what they see.
    #[inline]
    fn camera_rays(
        &self,
        [x0, y0]: [u32; 2],
        inside: u16,
        samplers: &[Sampler; LANES],
    ) -> (RayBlock, [f32; LANES]) {
        let camera = &self.scene.camera;
        let (u, v, lens) = if camera.has_lens() {
            let [u, v, lens_u, lens_v] = Sampler::numbers(samplers, Dimensions::Camera);
            (u, v, [lens_u, lens_v])
        } else {
            let [u, v] = Sampler::numbers(samplers, Dimensions::Camera);
            (u, v, [[0.5; LANES]; 2])
        };
        let [dx, dy, weights] = self.filter.sample_lanes(&u, &v);
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            x[lane] = f64::from(x0 + lane as u32 % 4) + 0.5 + f64::from(dx[lane]);
            y[lane] = f64::from(y0 + lane as u32 / 4) + 0.5 + f64::from(dy[lane]);
        }
        let mut rays = RayBlock::empty();
        if let Some((eye, directions)) = camera.pinhole_rays(&x, &y) {
            rays.org_x = [eye.x; LANES];
            rays.org_y = [eye.y; LANES];
            rays.org_z = [eye.z; LANES];
            (rays.dir_x, rays.dir_y, rays.dir_z) = (directions.x, directions.y, directions.z);
            rays.t_max = [f32::INFINITY; LANES];
            rays.activate(inside);
            return (rays, weights);
        }
        for lane in (0..LANES).filter(|lane| inside >> lane & 1 == 1) {
            let film = DVec2::new(x[lane], y[lane]);
            if let Some(ray) = camera.ray(film, lens.map(|numbers| numbers[lane])) {
                rays.set(lane, &ray);
            }
        }
        (rays, weights)
    }
}
