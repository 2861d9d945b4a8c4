//! A picture with its pyramid: each level half as wide and high as the one before, down to 1 × 1.
//!
//! Levels are averages over areas, made in linear light, so each has the picture's mean; a level of
//! odd width shares the column in the middle out by area. Source: Williams, *Pyramidal
//! Parametrics*, SIGGRAPH 1983.
//!
//! Pictures of 8 bits stay so; their smaller levels have 16, linearly. So 4096 × 4096 pixels of
//! three channels take 5 bytes a pixel, all levels included.

use glam::{DVec2, Vec2};
use rayon::prelude::*;

use super::data::{ImageData, Pixels, half_from_float};
use crate::color::Rgb;

/// What lies beyond the edges of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// The pixels of the edge.
    Clamp,
    /// The picture mirrored, then the picture again.
    Mirror,
}

impl Wrap {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Repeat, Self::Clamp, Self::Mirror];

    /// The name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Repeat => "repeat",
            Self::Clamp => "clamp",
            Self::Mirror => "mirror",
        }
    }

    /// A coordinate with the same picture, from 0 to 1 (or 2 where mirrored); 0 for what is not
    /// finite.
    fn reduce(self, t: f64) -> f64 {
        if !t.is_finite() {
            return 0.0;
        }
        match self {
            Self::Repeat => t - t.floor(),
            Self::Clamp => t.clamp(0.0, 1.0),
            Self::Mirror => t.rem_euclid(2.0),
        }
    }

    /// The pixel of `n` that stands at place `i`.
    fn index(self, i: i64, n: usize) -> usize {
        let n = n as i64;
        let i = match self {
            Self::Repeat => i.rem_euclid(n),
            Self::Clamp => i.clamp(0, n - 1),
            Self::Mirror => {
                let i = i.rem_euclid(2 * n);
                if i < n { i } else { 2 * n - 1 - i }
            }
        };
        i as usize
    }
}

/// A picture with its pyramid.
///
/// Lookups are by texture coordinates from 0 to 1: u to the right, v **up**, so v = 0 is the lower
/// edge of the bottom row, and pixel centres are half a pixel from the edges.
#[derive(Debug)]
pub struct MipMap {
    /// The picture itself first; never empty.
    levels: Vec<ImageData>,
}

/// Four neighbouring pixels and the place between them.
struct Patch {
    /// Left and right of the upper row, then of the lower one.
    texels: [[Rgb; 2]; 2],
    /// Rightwards and downwards, from 0 to 1.
    at: Vec2,
}

impl Patch {
    fn new(level: &ImageData, uv: DVec2, wrap: Wrap) -> Self {
        let [width, height] = level.size().map(|n| n as usize);
        let x = wrap.reduce(uv.x) * width as f64 - 0.5;
        let y = (1.0 - wrap.reduce(uv.y)) * height as f64 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let columns = [x0 as i64, x0 as i64 + 1].map(|i| wrap.index(i, width));
        let rows = [y0 as i64, y0 as i64 + 1].map(|i| wrap.index(i, height));
        let texels = rows.map(|row| columns.map(|column| level.texel(column, row)));
        Self { texels, at: DVec2::new(x - x0, y - y0).as_vec2() }
    }

    fn color(&self) -> Rgb {
        let [upper, lower] = self.texels.map(|[a, b]| mix(a, b, self.at.x));
        mix(upper, lower, self.at.y)
    }

    /// The slope of the luminance per pixel, rightwards and downwards.
    fn slope(&self) -> Vec2 {
        let [[a, b], [c, d]] = self.texels.map(|row| row.map(Rgb::luminance));
        let Vec2 { x, y } = self.at;
        Vec2::new((b - a) * (1.0 - y) + (d - c) * y, (c - a) * (1.0 - x) + (d - b) * x)
    }
}

fn mix(a: Rgb, b: Rgb, t: f32) -> Rgb {
    a * (1.0 - t) + b * t
}

impl MipMap {
    /// Builds the pyramid, on several threads.
    pub fn new(data: ImageData) -> Self {
        let mut levels = vec![data];
        while let Some(next) = levels.last().and_then(halved) {
            levels.push(next);
        }
        Self { levels }
    }

    /// The picture first, then its smaller levels.
    pub fn levels(&self) -> &[ImageData] {
        &self.levels
    }

    /// Width and height of the picture in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.levels[0].size()
    }

    /// Bytes of memory that all pixels take.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| level.pixels().bytes()).sum()
    }

    /// The pixel that `uv` lies in.
    pub fn nearest(&self, uv: DVec2, wrap: Wrap) -> Rgb {
        let level = &self.levels[0];
        let [width, height] = level.size().map(|n| n as usize);
        let x = wrap.reduce(uv.x) * width as f64;
        // Cells are closed below and on the left, so a row belongs to its lower edge.
        let y = height as f64 - 1.0 - (wrap.reduce(uv.y) * height as f64).floor();
        level.texel(wrap.index(x.floor() as i64, width), wrap.index(y as i64, height))
    }

    /// Between the four nearest pixels of the picture itself, linearly.
    pub fn bilinear(&self, uv: DVec2, wrap: Wrap) -> Rgb {
        Patch::new(&self.levels[0], uv, wrap).color()
    }

    /// Averaged over a footprint `texels` wide, in pixels of the picture: linearly between the two
    /// levels whose pixels are just finer and just coarser.
    pub fn trilinear(&self, uv: DVec2, wrap: Wrap, texels: f64) -> Rgb {
        let (level, t) = self.level(texels);
        let fine = Patch::new(&self.levels[level], uv, wrap).color();
        if t == 0.0 {
            return fine;
        }
        mix(fine, Patch::new(&self.levels[level + 1], uv, wrap).color(), t)
    }

    /// The slope of the luminance of [`Self::trilinear`], per unit of u and v; with `texels` = 0
    /// that of [`Self::bilinear`]. The derivative of what is looked up, not a difference.
    pub fn slope(&self, uv: DVec2, wrap: Wrap, texels: f64) -> DVec2 {
        let slope = |level: &ImageData| {
            let [width, height] = level.size().map(f64::from);
            Patch::new(level, uv, wrap).slope().as_dvec2() * DVec2::new(width, -height)
        };
        let (level, t) = self.level(texels);
        let fine = slope(&self.levels[level]);
        if t == 0.0 {
            return fine;
        }
        fine.lerp(slope(&self.levels[level + 1]), f64::from(t))
    }

    /// The finer of the levels that fit a footprint, and the weight of the coarser one; that is 0
    /// where there is none.
    fn level(&self, texels: f64) -> (usize, f32) {
        let last = self.levels.len() - 1;
        let level = texels.log2();
        if !(level > 0.0) {
            return (0, 0.0);
        }
        if level >= last as f64 {
            return (last, 0.0);
        }
        (level as usize, level.fract() as f32)
    }
}

/// The next level; `None` below a single pixel.
fn halved(from: &ImageData) -> Option<ImageData> {
    if from.size() == [1, 1] {
        return None;
    }
    let size = from.size().map(|n| (n / 2).max(1));
    let pixels = match from.pixels() {
        // 16 bits, as averages of bytes are finer than bytes.
        Pixels::Srgb8(_) | Pixels::Linear8(_) | Pixels::Linear16(_) => {
            Pixels::Linear16(shrink(from, size, |x| (x * 65535.0).round() as u16))
        }
        Pixels::Half(_) => Pixels::Half(shrink(from, size, half_from_float)),
        Pixels::Float(_) => Pixels::Float(shrink(from, size, |x| x)),
    };
    ImageData::new(size, from.channels(), pixels)
}

/// The values of a picture made smaller, rows first.
fn shrink<T: Copy + Default + Send>(
    from: &ImageData,
    size: [u32; 2],
    encode: impl Fn(f32) -> T + Sync,
) -> Vec<T> {
    let [old_width, old_height] = from.size().map(|n| n as usize);
    let [width, height] = size.map(|n| n as usize);
    let channels = from.channels();
    let columns: Vec<Share> = (0..width).map(|x| Share::new(x, old_width, width)).collect();
    let mut values = vec![T::default(); width * height * channels];
    values.par_chunks_mut(width * channels).enumerate().for_each_init(
        Vec::new,
        |sums, (y, out)| {
            let rows = Share::new(y, old_height, height);
            sums.clear();
            sums.resize(old_width * channels, 0.0_f32);
            for (row, weight) in rows.weights() {
                let start = row * old_width * channels;
                for (i, sum) in sums.iter_mut().enumerate() {
                    *sum += weight * from.value(start + i);
                }
            }
            for (pixel, column) in out.chunks_mut(channels).zip(&columns) {
                for (channel, value) in pixel.iter_mut().enumerate() {
                    let sum: f32 = column
                        .weights()
                        .map(|(x, weight)| weight * sums[x * channels + channel])
                        .sum();
                    *value = encode(sum);
                }
            }
        },
    );
    values
}

/// The old pixels, along one axis, of which a new one is the average: at most three, wholly or in
/// part.
struct Share {
    first: usize,
    weights: [f32; 3],
}

impl Share {
    /// Of new pixel `i` of `new`, where there were `old`, at most 2·`new` + 1.
    fn new(i: usize, old: usize, new: usize) -> Self {
        // In units of 1/new of an old pixel, so whole numbers: old pixel k is [k·new, (k + 1)·new).
        let (from, to) = (i * old, (i + 1) * old);
        let first = from / new;
        let weights = std::array::from_fn(|k| {
            let pixel = (first + k) * new;
            let shared = to.min(pixel + new).saturating_sub(from.max(pixel));
            shared as f32 / old as f32
        });
        Self { first, weights }
    }

    fn weights(&self) -> impl Iterator<Item = (usize, f32)> {
        let shares = self.weights.into_iter().enumerate();
        shares.filter(|&(_, w)| w > 0.0).map(|(k, w)| (self.first + k, w))
    }
}

#[cfg(test)]
mod tests;
