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

use rayon::prelude::*;

use crate::color::Rgb;

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
        let plane = || rayon::iter::repeat_n(Rgb::BLACK, window.area()).collect();
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
        for (lane, (&mean, &error)) in block.mean.iter().zip(&block.standard_error).enumerate() {
            let [x, y] = [block.origin[0] + lane as u32 % 4, block.origin[1] + lane as u32 / 4];
            if let Some(i) = self.index(x, y) {
                self.mean[i] = mean;
                if let Some(plane) = &mut self.standard_error {
                    plane[i] = error;
                }
                if let Some(samples) = self.layers.samples.get_mut(i) {
                    *samples = block.samples[lane];
                }
            }
        }
    }

    /// Writes the pixels of a block of a layer, by its place among the layers' means.
    pub fn put_layer(&mut self, layer: usize, origin: [u32; 2], values: &[Rgb; BLOCK_LANES]) {
        for (lane, value) in values.iter().enumerate() {
            if let Some(i) = self.index(origin[0] + lane as u32 % 4, origin[1] + lane as u32 / 4) {
                self.layers.means[layer].1[i] = *value;
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

    fn index(&self, x: u32, y: u32) -> Option<usize> {
        let w = &self.window;
        w.contains(x, y).then(|| (y - w.y0) as usize * w.width() as usize + (x - w.x0) as usize)
    }

    /// The relative sampling error of the picture: the root of the mean over pixels and channels of
    /// Var\[mean\] / (mean² + ε), with ε = 0.01 · (mean luminance)². None where no pixel shows an error.
    pub fn relative_error(&self) -> Option<f64> {
        let errors = self.standard_error.as_ref()?;
        // In parts of fixed size, for the same bits on any number of threads.
        const PART: usize = 1 << 14;
        let n = self.mean.len().max(1) as f64;
        let luminances = self.mean.par_chunks(PART);
        let luminances: Vec<f64> = luminances
            .map(|part| part.iter().map(|c| f64::from(c.luminance())).sum::<f64>())
            .collect();
        let luminance = luminances.into_iter().sum::<f64>() / n;
        let epsilon = 0.01 * luminance * luminance;
        let add = |(sum, count): (f64, u64), (m, e): (f32, f32)| {
            let (m, e) = (f64::from(m), f64::from(e));
            // A black picture has no error, rather than 0/0.
            let share = if e == 0.0 { 0.0 } else { e * e / (m * m + epsilon) };
            if e.is_nan() { (sum, count) } else { (sum + share, count + 1) }
        };
        let shares = |(means, errors): (&[Rgb], &[Rgb])| {
            let channels = |(m, e): (&Rgb, &Rgb)| m.to_array().into_iter().zip(e.to_array());
            means.iter().zip(errors).flat_map(channels).fold((0.0, 0), add)
        };
        let parts = self.mean.par_chunks(PART).zip(errors.par_chunks(PART));
        let parts: Vec<(f64, u64)> = parts.map(shares).collect();
        let (sum, count) = parts.into_iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        (count > 0).then(|| (sum / count as f64).sqrt())
    }
}
