//! The film: what samples add up to. Sums in f64 by a fixed tree, the error that follows from them,
//! and the reconstruction filter. It knows pixels and samples, not scenes, and no file formats.

mod accumulate;
mod cryptomatte;
mod filter;
mod layers;
mod picture;

pub use accumulate::{BLOCK_LANES, BlockAccumulator, BlockPixels, BlockSums, SumNode};
pub use cryptomatte::{cryptomatte_id, cryptomatte_key};
pub use filter::{Filter, FilterSample, FilterTable};
pub use layers::{Aov, CenterLayers, Layers, Shares, add_share};
pub use picture::Picture;

use std::ops::Range;

use rayon::prelude::*;

use crate::color::{Rgb, RgbLanes};
use crate::pages::prefer_large;
use crate::sampler::REPLICATES;

/// A rectangle of pixels: `x0 ≤ x < x1`, `y0 ≤ y < y1`, y down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "said above")]
pub struct PixelRect {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}

impl PixelRect {
    /// The whole picture of `width` × `height`.
    pub const fn whole([width, height]: [u32; 2]) -> Self {
        Self { x0: 0, y0: 0, x1: width, y1: height }
    }

    /// Pixels across.
    pub const fn width(&self) -> u32 {
        self.x1.saturating_sub(self.x0)
    }

    /// Pixels down.
    pub const fn height(&self) -> u32 {
        self.y1.saturating_sub(self.y0)
    }

    /// Pixels in all.
    pub const fn area(&self) -> usize {
        self.width() as usize * self.height() as usize
    }

    /// Whether the pixel `(x, y)` is inside.
    #[inline]
    pub const fn contains(&self, x: u32, y: u32) -> bool {
        self.x0 <= x && x < self.x1 && self.y0 <= y && y < self.y1
    }

    /// What both cover.
    pub fn intersection(&self, other: &Self) -> Self {
        Self {
            x0: self.x0.max(other.x0),
            y0: self.y0.max(other.y0),
            x1: self.x1.min(other.x1),
            y1: self.y1.min(other.y1),
        }
    }
}

/// A finished picture: the mean radiance of every pixel, and how sure it is.
#[derive(Debug, Clone)]
pub struct Film {
    /// Size of the whole picture, in pixels.
    pub size: [u32; 2],
    /// The part of it that this film holds (the crop).
    pub window: PixelRect,
    /// Mean radiance, row by row over the window.
    pub mean: Vec<Rgb>,
    /// Estimated standard error of that mean, in the same order, NaN where a pixel's samples show none;
    /// no plane where one sample a pixel shows it nowhere.
    pub standard_error: Option<Vec<Rgb>>,
    /// What it holds beside colours.
    pub layers: Layers,
}

impl Film {
    /// A black film; with a plane for errors where `with_error`.
    pub fn new(size: [u32; 2], window: PixelRect, with_error: bool) -> Self {
        // On all threads: most of the time goes into asking the system for the memory.
        let plane = || {
            let mut plane = Vec::with_capacity(window.area());
            prefer_large(&mut plane);
            plane.par_extend(rayon::iter::repeat_n(Rgb::BLACK, window.area()));
            plane
        };
        Self {
            size,
            window,
            mean: plane(),
            standard_error: with_error.then(plane),
            layers: Layers::default(),
        }
    }

    /// Writes the pixels of a block that lie inside the window.
    pub fn put(&mut self, block: &BlockPixels) {
        for (row, y) in (0..4).zip(block.origin[1]..) {
            // Of most blocks all is inside.
            let Some((first, lanes)) = self.row(block.origin[0], y) else { continue };
            let (from, to) = (4 * row + lanes.start, 4 * row + lanes.end);
            let places = first..first + lanes.len();
            let set = |plane: &mut [Rgb], values: &RgbLanes<BLOCK_LANES>| {
                for (pixel, lane) in plane.iter_mut().zip(from..to) {
                    *pixel = values.get(lane);
                }
            };
            set(&mut self.mean[places.clone()], &block.mean);
            if let Some(plane) = &mut self.standard_error {
                set(&mut plane[places.clone()], &block.standard_error);
            }
            if let Some(samples) = self.layers.samples.get_mut(places) {
                samples.copy_from_slice(&block.samples[from..to]);
            }
        }
    }

    /// Writes the pixels of a block of a layer, by its place among the layers' means.
    pub fn put_layer(&mut self, layer: usize, origin: [u32; 2], values: &RgbLanes<BLOCK_LANES>) {
        for lane in 0..BLOCK_LANES {
            if let Some(i) = self.index(origin[0] + lane as u32 % 4, origin[1] + lane as u32 / 4) {
                self.layers.means[layer].1[i] = values.get(lane);
            }
        }
    }

    /// Adds what the pixels of a block show to a Cryptomatte, by its place among them.
    pub fn add_shares(&mut self, matte: usize, origin: [u32; 2], shares: &[Shares; BLOCK_LANES]) {
        for (lane, shares) in shares.iter().enumerate() {
            if let Some(i) = self.index(origin[0] + lane as u32 % 4, origin[1] + lane as u32 / 4) {
                for (id, count) in shares {
                    add_share(&mut self.layers.mattes[matte].1[i], *id, *count);
                }
            }
        }
    }

    /// The mean of the pixel at absolute coordinates; none outside the window.
    pub fn pixel(&self, x: u32, y: u32) -> Option<Rgb> {
        self.index(x, y).map(|i| self.mean[i])
    }

    /// What of four pixels from `x` on lies in the window: the place of the first, and which of the four.
    #[inline]
    fn row(&self, x: u32, y: u32) -> Option<(usize, Range<usize>)> {
        let w = &self.window;
        let (from, to) = (x.max(w.x0), (x + 4).min(w.x1));
        if from >= to {
            return None;
        }
        Some((self.index(from, y)?, (from - x) as usize..(to - x) as usize))
    }

    fn index(&self, x: u32, y: u32) -> Option<usize> {
        let w = &self.window;
        w.contains(x, y).then(|| (y - w.y0) as usize * w.width() as usize + (x - w.x0) as usize)
    }

    /// The relative sampling error of the picture: see [`Film::sampling_error`]. None where no pixel
    /// shows an error.
    pub fn relative_error(&self) -> Option<f64> {
        self.sampling_error().map(|error| error.value)
    }

    /// The relative sampling error of the picture, and between which bounds the true one lies in 95 of 100
    /// renders: the root of the mean over pixels and channels of Var\[mean\] / (b² + ε), with
    /// ε = 0.01 · (mean luminance)². b is how bright the channel is around the pixel: the mean of its cell
    /// of 8 × 8 pixels. With the pixel's own mean for it, of the same few samples as its variance, the
    /// estimate would be too low, by a fifth at four samples. None where no pixel shows an error.
    ///
    /// The true error of a render is the root of the mean of dᵢ² / (b² + ε), dᵢ being what each pixel is off
    /// by. Where the variance is vᵢ, dᵢ² is vᵢ·χ²₁ and its estimate from R replicates vᵢ·χ²ᵣ₋₁/(R − 1),
    /// independent of it; the difference of their means then has the variance Σ (2 + 2/(R − 1))·vᵢ²/n², and
    /// the mean of the estimates' squares is vᵢ²·(1 + 2/(R − 1)).
    pub fn sampling_error(&self) -> Option<SamplingError> {
        self.standard_error.as_ref()?;
        let luminance = self.mean_luminance();
        let epsilon = 0.01 * luminance * luminance;
        // Sums in rows of cells, for the same bits on any number of threads.
        let rows: Vec<ErrorSums> = self
            .rows_of_cells()
            .map(|row| row.map(|cell| self.error_of_cell(&cell, epsilon)).sum())
            .collect();
        let ErrorSums { sum, squares, pixels } = rows.into_iter().sum();
        if pixels == 0 {
            return None;
        }
        let n = pixels as f64;
        let square = sum / n;
        let degrees = f64::from(REPLICATES - 1);
        let spread = (2.0 + 2.0 / degrees) / (1.0 + 2.0 / degrees) * squares;
        let off = 1.96 * spread.sqrt() / n;
        Some(SamplingError {
            value: square.sqrt(),
            low: (square - off).max(0.0).sqrt(),
            high: (square + off).sqrt(),
        })
    }

    /// The shares in the squared error of [`Film::sampling_error`], by blocks of 4 × 4 pixels; none where
    /// no pixel shows an error.
    pub fn block_shares(&self) -> Option<BlockShares> {
        let errors = self.standard_error.as_ref()?;
        let luminance = self.mean_luminance();
        let epsilon = 0.01 * luminance * luminance;
        let PixelRect { x0, y0, x1, y1 } = self.window;
        let first = [x0 / 4, y0 / 4];
        let size = [x1.div_ceil(4) - first[0], y1.div_ceil(4) - first[1]];
        // Sum over pixels, and their number.
        let mut sums = vec![(0.0, 0u32); (size[0] * size[1]) as usize];
        for cell in self.rows_of_cells().flat_map_iter(|row| row).collect::<Vec<_>>() {
            let scale = self.cell_scale(&cell, epsilon);
            let pixels = (cell.y0..cell.y1).flat_map(|y| (cell.x0..cell.x1).map(move |x| (x, y)));
            for ((x, y), i) in pixels.zip(self.pixels_of(&cell)) {
                let channels = errors[i].to_array().into_iter().zip(scale);
                let share = channels.map(|(e, s)| f64::from(e).powi(2) * s).sum::<f64>() / 3.0;
                let block = (y / 4 - first[1]) * size[0] + x / 4 - first[0];
                if share.is_finite() {
                    let (sum, count) = &mut sums[block as usize];
                    *sum += share;
                    *count += 1;
                }
            }
        }
        Some(BlockShares { first, size, sums })
    }

    /// The error by which this picture differs from what it should be, as [`Film::sampling_error`] estimates
    /// it: relative to how bright the reference is around each pixel. Both must be of the same pixels.
    pub fn error_against(&self, reference: &Self) -> f64 {
        let luminance = reference.mean_luminance();
        let epsilon = 0.01 * luminance * luminance;
        let rows: Vec<f64> = reference
            .rows_of_cells()
            .map(|row| {
                row.map(|cell| {
                    let scale = reference.cell_scale(&cell, epsilon);
                    let share = |i: usize| {
                        let off =
                            self.mean[i].to_array().into_iter().zip(reference.mean[i].to_array());
                        let off = off.zip(scale);
                        off.map(|((a, b), s)| (f64::from(a) - f64::from(b)).powi(2) * s)
                            .sum::<f64>()
                    };
                    reference.pixels_of(&cell).map(share).sum::<f64>()
                })
                .sum()
            })
            .collect();
        (rows.into_iter().sum::<f64>() / (3 * self.mean.len()).max(1) as f64).sqrt()
    }

    fn mean_luminance(&self) -> f64 {
        const PART: usize = 1 << 14;
        let parts = self.mean.par_chunks(PART);
        let parts: Vec<f64> =
            parts.map(|part| part.iter().map(|c| f64::from(c.luminance())).sum::<f64>()).collect();
        parts.into_iter().sum::<f64>() / self.mean.len().max(1) as f64
    }

    /// Cells of 8 × 8 pixels at multiples of 8 of the whole picture, as far as they lie in the window.
    fn rows_of_cells(
        &self,
    ) -> impl IndexedParallelIterator<Item = impl Iterator<Item = PixelRect> + use<>> + use<> {
        const CELL: u32 = 8;
        let window = self.window;
        (window.y0 / CELL..window.y1.div_ceil(CELL)).into_par_iter().map(move |y| {
            (window.x0 / CELL..window.x1.div_ceil(CELL)).map(move |x| {
                let (x0, y0) = (x * CELL, y * CELL);
                PixelRect { x0, y0, x1: x0 + CELL, y1: y0 + CELL }.intersection(&window)
            })
        })
    }

    /// The places of the pixels of a cell.
    fn pixels_of(&self, cell: &PixelRect) -> impl Iterator<Item = usize> + use<> {
        let (PixelRect { x0, y0, x1, y1 }, window) = (*cell, self.window);
        let width = window.width() as usize;
        (y0..y1).flat_map(move |y| {
            let first = (y - window.y0) as usize * width + (x0 - window.x0) as usize;
            first..first + (x1 - x0) as usize
        })
    }

    /// By channel, what a square of an error counts for in a cell: 1 / (b² + ε).
    fn cell_scale(&self, cell: &PixelRect, epsilon: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for i in self.pixels_of(cell) {
            for (sum, x) in sum.iter_mut().zip(self.mean[i].to_array()) {
                *sum += f64::from(x);
            }
        }
        let scale = sum.map(|sum| 1.0 / ((sum / cell.area() as f64).powi(2) + epsilon));
        // A black picture has no error, rather than 0 · ∞.
        scale.map(|scale| if scale.is_finite() { scale } else { 0.0 })
    }

    fn error_of_cell(&self, cell: &PixelRect, epsilon: f64) -> ErrorSums {
        let mut sums = ErrorSums::default();
        let Some(errors) = &self.standard_error else { return sums };
        let scale = self.cell_scale(cell, epsilon);
        for i in self.pixels_of(cell) {
            let channels = errors[i].to_array().into_iter().zip(scale);
            let share = channels.map(|(e, scale)| f64::from(e).powi(2) * scale).sum::<f64>() / 3.0;
            if !share.is_nan() {
                sums.sum += share;
                sums.squares += share * share;
                sums.pixels += 1;
            }
        }
        sums
    }
}

/// Of pixels that show an error: the sums of their shares of it and of the squares of these.
#[derive(Debug, Clone, Copy, Default)]
struct ErrorSums {
    sum: f64,
    squares: f64,
    pixels: u64,
}

impl std::iter::Sum for ErrorSums {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |a, b| Self {
            sum: a.sum + b.sum,
            squares: a.squares + b.squares,
            pixels: a.pixels + b.pixels,
        })
    }
}

/// Shares in the error of a picture, by blocks of 4 × 4 pixels.
#[derive(Debug)]
pub struct BlockShares {
    /// Column and row of the first block.
    first: [u32; 2],
    /// Blocks across and down.
    size: [u32; 2],
    /// By block, the sum over pixels and how many.
    sums: Vec<(f64, u32)>,
}

impl BlockShares {
    /// The mean over the pixels of the block at `origin` and its neighbours: by itself a block has too few
    /// to tell.
    pub fn around(&self, origin: [u32; 2]) -> f64 {
        let [column, row] = [0, 1].map(|axis| origin[axis] / 4 - self.first[axis]);
        let near = |at: u32, size: u32| at.saturating_sub(1)..(at + 2).min(size);
        let (mut sum, mut count) = (0.0, 0);
        for y in near(row, self.size[1]) {
            for x in near(column, self.size[0]) {
                let (share, pixels) = self.sums[(y * self.size[0] + x) as usize];
                sum += share;
                count += pixels;
            }
        }
        sum / f64::from(count.max(1))
    }
}

/// The relative sampling error of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SamplingError {
    /// The estimate.
    pub value: f64,
    /// The true error lies above this in 97.5 of 100 renders.
    pub low: f64,
    /// And below this.
    pub high: f64,
}
