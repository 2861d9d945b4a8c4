//! Cuts the film into tiles, runs an integrator over them on all threads, adds the samples up, and
//! stops where it is told to. It owns threads and order; it knows neither files nor terminals, and
//! tells whoever asks through an [`Observer`].

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec2;
use rayon::prelude::*;

use crate::accel::{LANES, RayBlock, RayQuery, with_accel};
use crate::film::{BLOCK_LANES, BlockAccumulator, BlockPixels, Film, FilterTable, PixelRect};
use crate::integrator::{
    Ao, CameraBlock, Everything, Flat, Integrator, Local, RayCounts, Tree, Whitted,
};
use crate::sampler::{Dimensions, PixelSampler, REPLICATES, Sampler};
use crate::scene::{IntegratorKind, Scene, Variant};

/// Pixels of a tile's side: a multiple of the block's 4.
const TILE: u32 = 32;

/// Samples of a block between two looks at whether to stop.
const STOP_EVERY: u32 = 256;

const _: () = assert!(LANES == BLOCK_LANES, "a block of rays is a block of pixels");

/// Non-finite samples that are told one by one; further ones are only counted.
const NON_FINITE_TOLD: usize = 8;

/// What to render of a scene.
#[derive(Debug, Clone, Default)]
pub struct RenderJob {
    /// The part of the picture; all of it where not given.
    pub crop: Option<PixelRect>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// The variant of the ray tree, where it is not to be the least that the scene needs; a lesser one
    /// leaves out what it does not know. For comparisons: the picture is the same from that one on.
    pub variant: Option<Variant>,
}

/// Hears how a render goes, and ends it. Called from all threads.
pub trait Observer: Sync {
    /// A share of the work is done, from 0 to 1.
    fn progress(&self, done: f64, rays: u64) {
        let _ = (done, rays);
    }

    /// Whether to end the render after the blocks that are being worked on.
    fn stop(&self) -> bool {
        false
    }
}

/// Hears nothing.
impl Observer for () {}

/// What came of a render.
#[derive(Debug)]
pub struct Rendered {
    /// The picture. Blocks that were not reached are black.
    pub film: Film,
    /// Samples a pixel.
    pub samples: u32,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples that were NaN or infinite and left out.
    pub non_finite: NonFinite,
    /// Whether the observer ended it early.
    pub interrupted: bool,
}

/// Samples that came out as NaN or infinite.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NonFinite {
    /// How many.
    pub count: u64,
    /// Pixel and sample number of a few of them, in the picture's order.
    pub first: Vec<([u32; 2], u32)>,
}

/// Renders a scene on the threads of the current rayon pool. The picture depends on scene, job and
/// instruction set alone, not on the number of threads or their order (but for surfaces that coincide
/// in a hierarchy built at low quality).
pub fn render(scene: &Scene, job: &RenderJob, observer: &dyn Observer) -> Rendered {
    // Static dispatch from here on: one loop of those that are compiled is run.
    with_accel!(&scene.accel, query => choose(scene, query, job, observer))
}

fn choose<Q: RayQuery>(
    scene: &Scene,
    query: &Q,
    job: &RenderJob,
    observer: &dyn Observer,
) -> Rendered {
    let depth = match scene.settings.integrator {
        IntegratorKind::Flat => return run(scene, query, &Flat, job, observer),
        IntegratorKind::Ao => return run(scene, query, &Ao, job, observer),
        IntegratorKind::Direct => None,
        IntegratorKind::Whitted => Some(scene.settings.max_depth),
    };
    match job.variant.unwrap_or(scene.requirements.variant) {
        Variant::Local => run(scene, query, &Whitted::<Local>::new(depth), job, observer),
        Variant::Tree => run(scene, query, &Whitted::<Tree>::new(depth), job, observer),
        Variant::Everything => run(scene, query, &Whitted::<Everything>::new(depth), job, observer),
    }
}

fn run<Q: RayQuery, I: Integrator>(
    scene: &Scene,
    query: &Q,
    integrator: &I,
    job: &RenderJob,
    observer: &dyn Observer,
) -> Rendered {
    let whole = PixelRect::whole(scene.size);
    let window = job.crop.map_or(whole, |crop| crop.intersection(&whole));
    let samples = scene.settings.samples;
    let film = Mutex::new(Film::new(scene.size, window, samples > 1));
    let totals = Mutex::new((RayCounts::default(), NonFinite::default()));
    let (pixels_done, rays_done) = (AtomicU64::new(0), AtomicU64::new(0));
    let tiles = tiles(&window);
    let renderer = TileRenderer {
        scene,
        query,
        integrator,
        filter: FilterTable::new(scene.settings.filter),
        seed: job.seed,
        samples,
        whole,
    };

    let workspace = || (BlockAccumulator::new(REPLICATES), TileOutput::default());
    tiles.par_iter().for_each_init(workspace, |(sums, output), tile| {
        output.restart();
        let pixels = renderer.render(tile, &window, sums, output, observer);
        {
            let mut film = film.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            output.blocks.iter().for_each(|block| film.put(block));
        }
        {
            let mut totals = totals.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            totals.0.add(&output.rays);
            totals.1.count += output.non_finite.count;
            totals.1.first.append(&mut output.non_finite.first);
        }
        let pixels = pixels_done.fetch_add(pixels, Ordering::Relaxed) + pixels;
        let traced = output.rays.total();
        let rays = rays_done.fetch_add(traced, Ordering::Relaxed) + traced;
        observer.progress(pixels as f64 / window.area() as f64, rays);
    });

    let (rays, mut non_finite) = totals.into_inner().unwrap_or_default();
    // Threads finish in any order; what is told does not depend on it.
    non_finite.first.sort_unstable_by_key(|([x, y], sample)| (*y, *x, *sample));
    non_finite.first.truncate(NON_FINITE_TOLD);
    // A stop that was asked for with the last block cut nothing off.
    let interrupted = pixels_done.into_inner() < window.area() as u64;
    let film = film.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    Rendered { film, samples, rays, non_finite, interrupted }
}

/// The tiles that touch `window`, in rows, at absolute positions: multiples of [`TILE`].
fn tiles(window: &PixelRect) -> Vec<PixelRect> {
    let span = |from: u32, to: u32| (from / TILE..to.div_ceil(TILE)).map(|i| i * TILE);
    span(window.y0, window.y1)
        .flat_map(|y0| {
            span(window.x0, window.x1).map(move |x0| PixelRect {
                x0,
                y0,
                x1: x0 + TILE,
                y1: y0 + TILE,
            })
        })
        .collect()
}

struct TileRenderer<'a, Q, I> {
    scene: &'a Scene,
    query: &'a Q,
    integrator: &'a I,
    filter: FilterTable,
    seed: u64,
    samples: u32,
    whole: PixelRect,
}

#[derive(Default)]
struct TileOutput {
    blocks: Vec<BlockPixels>,
    rays: RayCounts,
    non_finite: NonFinite,
}

impl TileOutput {
    /// Forgets the last tile; memory for blocks stays.
    fn restart(&mut self) {
        self.blocks.clear();
        self.rays = RayCounts::default();
        self.non_finite = NonFinite::default();
    }
}

impl<Q: RayQuery, I: Integrator> TileRenderer<'_, Q, I> {
    /// Renders the blocks of a tile that touch the window; whole blocks, as a packet's hits at shared
    /// edges may depend on its neighbours, and a crop must not. Returns the pixels of the window that
    /// were finished: all of the tile's unless the observer ended it.
    fn render(
        &self,
        tile: &PixelRect,
        window: &PixelRect,
        sums: &mut BlockAccumulator,
        output: &mut TileOutput,
        observer: &dyn Observer,
    ) -> u64 {
        let mut pixels = 0;
        for y in (tile.y0..tile.y1).step_by(4) {
            for x in (tile.x0..tile.x1).step_by(4) {
                let block = PixelRect { x0: x, y0: y, x1: x + 4, y1: y + 4 }.intersection(window);
                if block.area() == 0 {
                    continue;
                }
                if !self.render_block([x, y], &block, sums, output, observer) {
                    return pixels;
                }
                pixels += block.area() as u64;
            }
        }
        pixels
    }

    /// Renders the block at `origin`, of which `wanted` is inside the window. False where the observer
    /// ended it; the block is then discarded.
    fn render_block(
        &self,
        origin: [u32; 2],
        wanted: &PixelRect,
        sums: &mut BlockAccumulator,
        output: &mut TileOutput,
        observer: &dyn Observer,
    ) -> bool {
        let pixel = |lane: usize| [origin[0] + lane as u32 % 4, origin[1] + lane as u32 / 4];
        let inside = (0..LANES)
            .filter(|&lane| {
                let [x, y] = pixel(lane);
                self.whole.contains(x, y)
            })
            .fold(0u16, |bits, lane| bits | 1 << lane);

        sums.restart(0);
        let pixels: [PixelSampler; LANES] =
            std::array::from_fn(|lane| PixelSampler::new(self.seed, pixel(lane)));
        for sample in 0..self.samples {
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
            let dropped = if self.samples == 1 {
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
        if self.samples != 1 {
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
