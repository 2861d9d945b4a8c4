//! Tiles of the picture, and the blocks of pixels in them: camera rays in, sums of samples out.

use std::ops::Range;

use glam::DVec2;

use super::state::BlockState;
use super::{NON_FINITE_TOLD, NonFinite, Observer};
use crate::accel::{LANES, RayBlock, RayQuery, lanes_of};
use crate::color::RgbLanes;
use crate::film::{
    Aov, BLOCK_LANES, BlockAccumulator, BlockPixels, FilterTable, Layers, PixelRect, Shares,
    add_share, cryptomatte_id,
};
use crate::integrator::{CameraBlock, FirstHits, Integrator, RayCounts};
use crate::sampler::{Dimensions, PixelSampler, REPLICATES, Sampler};
use crate::scene::Scene;

/// Pixels of a tile's side: a multiple of the block's 4.
const TILE: u32 = 32;

/// Samples of a block between two looks at whether to stop.
const STOP_EVERY: u32 = 256;

const _: () = assert!(LANES == BLOCK_LANES, "a block of rays is a block of pixels");

/// The tiles that touch `window`, in rows, at absolute positions: multiples of [`TILE`].
pub(super) fn tiles(window: &PixelRect) -> impl Iterator<Item = PixelRect> + use<> {
    let span = |from: u32, to: u32| (from / TILE..to.div_ceil(TILE)).map(|i| i * TILE);
    let columns = span(window.x0, window.x1);
    span(window.y0, window.y1).flat_map(move |y0| {
        columns.clone().map(move |x0| PixelRect { x0, y0, x1: x0 + TILE, y1: y0 + TILE })
    })
}

/// The first pixels of the blocks of `tile` that touch `window`, in rows.
pub(super) fn blocks(tile: &PixelRect, window: &PixelRect) -> impl Iterator<Item = [u32; 2]> {
    let touches = |[x, y]: &[u32; 2]| block_in(window, [*x, *y]).area() > 0;
    let (x, y) = ((tile.x0..tile.x1).step_by(4), (tile.y0..tile.y1).step_by(4));
    y.flat_map(move |y| x.clone().map(move |x| [x, y])).filter(touches)
}

/// What of the block at `origin` lies in `window`.
pub(super) fn block_in(window: &PixelRect, [x, y]: [u32; 2]) -> PixelRect {
    PixelRect { x0: x, y0: y, x1: x + 4, y1: y + 4 }.intersection(window)
}

/// A tile, and what the samples of its blocks add up to as far as they are taken.
pub(super) struct Tile {
    pub(super) at: PixelRect,
    /// In the order of [`blocks`]; none where sums are not kept.
    pub(super) blocks: Vec<BlockState>,
    /// Number of the sample at which the last pass over it ended.
    pub(super) done: u32,
}

pub(super) struct TileRenderer<'a, Q, I> {
    pub(super) scene: &'a Scene,
    pub(super) query: &'a Q,
    pub(super) integrator: &'a I,
    pub(super) filter: FilterTable,
    pub(super) seed: u64,
    pub(super) window: PixelRect,
    pub(super) layers: SampledLayers,
}

/// What a thread works with; reused from tile to tile.
pub(super) struct Workspace {
    sums: BlockSampling,
    pub(super) output: TileOutput,
}

impl Workspace {
    pub(super) fn new(layers: &SampledLayers) -> Self {
        Self { sums: BlockSampling::new(layers), output: TileOutput::default() }
    }
}

/// What the samples of a block add up to.
struct BlockSampling {
    radiance: BlockAccumulator,
    /// Of each layer that is a mean.
    means: Vec<BlockAccumulator>,
    /// Of each Cryptomatte, what each pixel shows.
    mattes: Vec<[Shares; BLOCK_LANES]>,
}

impl BlockSampling {
    fn new(layers: &SampledLayers) -> Self {
        let sums = || BlockAccumulator::new(REPLICATES);
        Self {
            radiance: sums(),
            means: layers.means.iter().map(|_| sums()).collect(),
            mattes: layers.mattes.iter().map(|_| Default::default()).collect(),
        }
    }

    /// Goes on from what a block has, or from nothing.
    fn begin(&mut self, block: Option<&BlockState>) {
        match block {
            None => {
                self.radiance.restart(0);
                self.means.iter_mut().for_each(|sums| sums.restart(0));
            }
            Some(block) => {
                self.radiance.resume(&block.sums);
                for (sums, kept) in self.means.iter_mut().zip(&block.layers) {
                    sums.resume(kept);
                }
            }
        }
        self.mattes.iter_mut().flatten().for_each(Shares::clear);
    }

    fn store(&self, block: &mut BlockState) {
        self.radiance.store(&mut block.sums);
        for (sums, kept) in self.means.iter().zip(&mut block.layers) {
            sums.store(kept);
        }
    }
}

/// The layers that samples add to.
pub(super) struct SampledLayers {
    pub(super) means: Vec<Aov>,
    pub(super) mattes: Vec<Aov>,
    has_direct: bool,
    has_first_hits: bool,
    /// The ids of objects and of materials, where a matte asks for them.
    object_ids: Vec<u32>,
    material_ids: Vec<u32>,
}

impl SampledLayers {
    pub(super) fn new(scene: &Scene, wanted: &[Aov]) -> Self {
        let (means, mattes) = (Layers::means_of(wanted), Layers::mattes_of(wanted));
        let ids = |aov, names: &[String]| {
            let wanted: &[String] = if mattes.contains(&aov) { names } else { &[] };
            wanted.iter().map(|name| cryptomatte_id(name)).collect()
        };
        Self {
            has_direct: means.contains(&Aov::Direct),
            has_first_hits: means.iter().any(|aov| *aov != Aov::Direct),
            object_ids: ids(Aov::CryptoObject, scene.object_names()),
            material_ids: ids(Aov::CryptoMaterial, scene.material_names()),
            means,
            mattes,
        }
    }

    fn are_none(&self) -> bool {
        self.means.is_empty() && self.mattes.is_empty()
    }

    /// Adds a sample of the pixels of a block.
    #[expect(clippy::too_many_arguments, reason = "all that a sample is")]
    fn add(
        &self,
        scene: &Scene,
        sample: u32,
        inside: u16,
        camera: &CameraBlock<'_>,
        direct: &RgbLanes<LANES>,
        weights: &[f32; LANES],
        sums: &mut BlockSampling,
    ) {
        let first = self.has_first_hits.then(|| FirstHits::of(scene, camera));
        for (aov, sums) in self.means.iter().zip(&mut sums.means) {
            let of_first = first.as_ref().and_then(|first| first.values(*aov));
            sums.add(sample, inside, &of_first.unwrap_or(direct).weighed(weights));
        }
        for (aov, pixels) in self.mattes.iter().zip(&mut sums.mattes) {
            for lane in lanes_of(inside) {
                let id = camera.hits.get(lane).map_or(0, |hit| match aov {
                    Aov::CryptoObject => self.object_ids[scene.object_index(&hit) as usize],
                    _ => self.material_ids[scene.material_index(&hit) as usize],
                });
                let count = if weights[lane] < 0.0 { -1 } else { 1 };
                add_share(&mut pixels[lane], id, count);
            }
        }
    }
}

/// What came of a tile.
#[derive(Default)]
pub(super) struct TileOutput {
    pub(super) blocks: Vec<BlockPixels>,
    /// Of each block in turn, the mean of each layer.
    pub(super) means: Vec<RgbLanes<BLOCK_LANES>>,
    /// Of each block in turn, the shares of each Cryptomatte.
    pub(super) mattes: Vec<[Shares; BLOCK_LANES]>,
    pub(super) rays: RayCounts,
    pub(super) non_finite: NonFinite,
    /// Samples of pixels of the window that were taken.
    pub(super) samples: u64,
}

impl TileOutput {
    /// Forgets the last tile; memory for blocks stays.
    fn restart(&mut self) {
        self.blocks.clear();
        self.means.clear();
        self.mattes.clear();
        self.rays = RayCounts::default();
        self.non_finite = NonFinite::default();
        self.samples = 0;
    }
}

impl<Q: RayQuery, I: Integrator> TileRenderer<'_, Q, I> {
    /// Renders the blocks of a tile that touch the window, each up to its target or to sample number
    /// `limit`; whole blocks, as a packet's hits at shared edges may depend on its neighbours, and a crop
    /// must not. False where the observer ended it before all were finished.
    pub(super) fn render(
        &self,
        tile: &mut Tile,
        limit: u32,
        workspace: &mut Workspace,
        observer: &dyn Observer,
    ) -> bool {
        let Workspace { sums, output } = workspace;
        output.restart();
        if tile.blocks.is_empty() {
            return blocks(&tile.at, &self.window).all(|origin| {
                sums.begin(None);
                self.render_block(origin, 0..limit, false, sums, output, observer)
            });
        }
        tile.blocks.iter_mut().filter(|block| block.is_behind(limit)).all(|block| {
            let to = block.target.min(limit);
            sums.begin(Some(block));
            let samples = block.sums.samples().end..to;
            let done = self.render_block(block.origin, samples, true, sums, output, observer);
            if done {
                sums.store(block);
            }
            done
        })
    }

    /// Renders samples of the block at `origin` on top of `sums`. False where the observer ended it; they
    /// are then discarded.
    fn render_block(
        &self,
        origin: [u32; 2],
        samples: Range<u32>,
        is_kept: bool,
        sums: &mut BlockSampling,
        output: &mut TileOutput,
        observer: &dyn Observer,
    ) -> bool {
        let wanted = block_in(&self.window, origin);
        let pixel = |lane: usize| [origin[0] + lane as u32 % 4, origin[1] + lane as u32 / 4];
        let whole = PixelRect::whole(self.scene.size);
        let inside = (0..LANES)
            .filter(|&lane| {
                let [x, y] = pixel(lane);
                whole.contains(x, y)
            })
            .fold(0u16, |bits, lane| bits | 1 << lane);

        let is_all = samples == (0..1) && !is_kept && self.layers.are_none();
        let taken = samples.len() as u64;
        // What is discarded does not count: a render that goes on counts as one without a pause.
        let (counted, found) =
            (output.rays, [output.non_finite.count, output.non_finite.first.len() as u64]);
        let pixels: [PixelSampler; LANES] =
            std::array::from_fn(|lane| PixelSampler::new(self.seed, pixel(lane)));
        let mut rays = RayBlock::empty();
        for sample in samples {
            if sample % STOP_EVERY == 0 && observer.stop() {
                output.rays = counted;
                output.non_finite.count = found[0];
                output.non_finite.first.truncate(found[1] as usize);
                return false;
            }
            let samplers = pixels.map(|pixel| pixel.sample(sample));
            let weights = self.camera_rays(origin, inside, &samplers, &mut rays);
            output.rays.camera += u64::from(rays.active().count_ones());
            let hits = self.query.intersect_block(&rays);
            let camera = CameraBlock { rays: &rays, hits: &hits, samplers: &samplers };
            let (radiance, direct) = if self.layers.has_direct {
                self.integrator.shade_split(self.scene, self.query, &camera, &mut output.rays)
            } else {
                let radiance =
                    self.integrator.shade(self.scene, self.query, &camera, &mut output.rays);
                (radiance, RgbLanes::BLACK)
            };
            let radiance = radiance.weighed(&weights);
            if !self.layers.are_none() {
                self.layers.add(self.scene, sample, inside, &camera, &direct, &weights, sums);
            }
            let dropped = if is_all {
                let (pixels, dropped) = BlockPixels::of_one_sample(origin, inside, &radiance);
                output.blocks.push(pixels);
                dropped
            } else {
                sums.radiance.add(sample, inside, &radiance)
            };
            for lane in lanes_of(dropped) {
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
            output.blocks.push(sums.radiance.finish(origin));
        }
        output.means.extend(sums.means.iter_mut().map(|sums| sums.finish(origin).mean));
        output.mattes.extend(sums.mattes.iter_mut().map(std::mem::take));
        output.samples += taken * wanted.area() as u64;
        true
    }

    /// Writes the camera rays of one sample of the pixels of a block that are `inside` the picture; what the
    /// filter makes of what they see.
    #[inline]
    fn camera_rays(
        &self,
        [x0, y0]: [u32; 2],
        inside: u16,
        samplers: &[Sampler; LANES],
        rays: &mut RayBlock,
    ) -> [f32; LANES] {
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
        if let Some((eye, directions)) = camera.pinhole_rays(&x, &y) {
            rays.org_x = [eye.x; LANES];
            rays.org_y = [eye.y; LANES];
            rays.org_z = [eye.z; LANES];
            (rays.dir_x, rays.dir_y, rays.dir_z) = (directions.x, directions.y, directions.z);
            (rays.t_min, rays.t_max) = ([0.0; LANES], [f32::INFINITY; LANES]);
            rays.activate(inside);
            return weights;
        }
        rays.activate(0);
        for lane in lanes_of(inside) {
            let film = DVec2::new(x[lane], y[lane]);
            if let Some(ray) = camera.ray(film, lens.map(|numbers| numbers[lane])) {
                rays.set(lane, &ray);
            }
        }
        weights
    }
}
