//! How far a picture is from a reference: error metrics over pixels, and FLIP (`flip.rs`). Sums are in
//! f64. That part knows pictures, not files, and not how they were made. And how fast and how right
//! accelerators are on a scene's own rays ([`mod@bench`]), and what speed costs in accuracy
//! ([`mod@trade`]).

pub mod bench;
mod channel;
mod flip;
mod html;
pub mod trade;

use rayon::prelude::*;

use channel::Sums;
pub use channel::{ChannelComparison, compare_channel, compare_layer, count_differing};
pub use flip::{Exposures, PIXELS_PER_DEGREE, flip, hdr_flip};

use crate::color::{Rgb, linear_from_srgb};
use crate::film::Picture;

/// What [`compare`] finds. Means run over pixels and channels; every number is NaN where no pixel is
/// finite in both pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Pixels that are NaN or infinite in one of the pictures at least. They are left out of all the
    /// numbers below, and count as black in both where FLIP looks at the surroundings of others.
    pub non_finite: u64,
    /// Mean of (a − b)².
    pub mse: f64,
    /// Mean of |a − b|.
    pub mae: f64,
    /// Mean of (a − b)² / (b² + 0.01), where b is the reference.
    pub rel_mse: f64,
    /// 10 log₁₀(1 / mean squared error) in decibels, of both pictures clipped to [0, 1]; infinite where
    /// they are then equal.
    pub psnr: f64,
    /// The largest |a − b|.
    pub largest: f64,
    /// The pixel that it is at, right of and below the first.
    pub largest_at: [u32; 2],
    /// Mean of [`flip()`], on a display that clips to [0, 1].
    pub flip: f64,
    /// Mean of [`hdr_flip`] and its exposures, where it was asked for.
    pub hdr_flip: Option<(f64, Exposures)>,
    /// [`flip()`] of each pixel, row by row; NaN where one of the pictures is not finite.
    pub flip_map: Vec<f32>,
}

/// How to compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompareOptions {
    /// How large pixels look to FLIP's viewer, in pixels per degree.
    pub pixels_per_degree: f32,
    /// Whether to find HDR-FLIP too, which takes two to thirty times as long as FLIP: the longer the more
    /// exposures the reference asks for, the most where half of it is black.
    pub hdr_flip: bool,
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self { pixels_per_degree: PIXELS_PER_DEGREE, hdr_flip: false }
    }
}

/// Two pictures do not show the same pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unequal {
    /// One has more pixels, or others in a row.
    #[error("{}x{} and {}x{} pixels", .0[0], .0[1], .1[0], .1[1])]
    Size([u32; 2], [u32; 2]),
    /// They are different parts of a larger picture.
    #[error("parts of a whole that begin at {},{} and at {},{}", .0[0], .0[1], .1[0], .1[1])]
    Origin([i32; 2], [i32; 2]),
}

/// Whether two pictures show the same pixels, so that they can be compared.
///
/// # Errors
/// [`Unequal`] where they do not. A picture that does not say where it lies may lie anywhere.
pub fn check_same_pixels(a: &Picture, b: &Picture) -> Result<(), Unequal> {
    if a.extent != b.extent {
        return Err(Unequal::Size(a.extent, b.extent));
    }
    match (a.origin, b.origin) {
        (Some(a), Some(b)) if a != b => Err(Unequal::Origin(a, b)),
        _ => Ok(()),
    }
}

/// Compares the picture `a` with the reference `b`. The result does not depend on the number of threads.
///
/// # Errors
/// [`Unequal`] where they do not show the same pixels.
pub fn compare(a: &Picture, b: &Picture, options: &CompareOptions) -> Result<Comparison, Unequal> {
    check_same_pixels(a, b)?;
    let size = a.extent;
    let width = size[0].max(1) as usize;
    let rows: Vec<Sums> = a
        .pixels
        .par_chunks(width)
        .zip(b.pixels.par_chunks(width))
        .enumerate()
        .map(|(y, (a, b))| {
            let mut sums = Sums::NONE;
            for (x, (a, b)) in
                a.iter().zip(b).enumerate().filter(|(_, (a, b))| a.is_finite() && b.is_finite())
            {
                for (a, b) in a.to_array().into_iter().zip(b.to_array()) {
                    sums.add(y * width + x, a, b);
                }
            }
            sums
        })
        .collect();
    // One after the other, so that rounding is the same on any number of threads.
    let sums = rows.into_iter().fold(Sums::NONE, Sums::join);
    let total = a.pixels.len().min(b.pixels.len()) as u64;
    let pixels = sums.count / 3;
    let values = sums.compared(total - pixels, size[0]);

    let sound = |i: usize| a.pixels[i].is_finite() && b.pixels[i].is_finite();
    let all_sound = pixels == total;
    let blackened = |pixels: &[Rgb]| -> Vec<Rgb> {
        let value = |(i, &c): (usize, &Rgb)| if sound(i) { c } else { Rgb::BLACK };
        pixels.iter().enumerate().map(value).collect()
    };
    let copies = (!all_sound).then(|| [blackened(&a.pixels), blackened(&b.pixels)]);
    let [test, reference] = match &copies {
        Some([a, b]) => [a, b],
        None => [&a.pixels, &b.pixels],
    };
    let map_mean = |map: &[f32]| {
        let values = map.iter().enumerate().filter(|&(i, _)| all_sound || sound(i));
        values.map(|(_, &x)| f64::from(x)).sum::<f64>() / pixels as f64
    };
    let mut flip_map = flip(test, reference, size, options.pixels_per_degree);
    let flip_mean = map_mean(&flip_map);
    if !all_sound {
        flip_map
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| !sound(*i))
            .for_each(|(_, x)| *x = f32::NAN);
    }
    let hdr_flip = options.hdr_flip.then(|| {
        let (map, exposures) = hdr_flip(test, reference, size, options.pixels_per_degree);
        (map_mean(&map), exposures)
    });
    Ok(Comparison {
        size,
        non_finite: values.non_finite,
        mse: values.mse,
        mae: values.mae,
        rel_mse: values.rel_mse,
        psnr: values.psnr,
        largest: values.largest,
        largest_at: values.largest_at,
        flip: flip_mean,
        hdr_flip,
        flip_map,
    })
}

/// |a − b| of each pixel and channel; NaN and infinite values stay visible.
///
/// # Errors
/// [`Unequal`] where they do not show the same pixels.
pub fn absolute_difference(a: &Picture, b: &Picture) -> Result<Picture, Unequal> {
    check_same_pixels(a, b)?;
    let difference =
        |(a, b): (&Rgb, &Rgb)| Rgb::new((a.r - b.r).abs(), (a.g - b.g).abs(), (a.b - b.b).abs());
    Ok(Picture { pixels: a.pixels.iter().zip(&b.pixels).map(difference).collect(), ..*b })
}

/// A value from 0 (black) to 1 (light yellow) as a linear colour; NaN is cyan, which the map lacks.
///
/// The colour map is *magma* by van der Walt and Smith (CC0): each sixteenth of its colours, linear
/// between them, at most 0.012 off in sRGB.
pub fn magma(value: f32) -> Rgb {
    if value.is_nan() {
        return Rgb::new(0.0, 1.0, 1.0);
    }
    let x = value.clamp(0.0, 1.0) * (MAGMA.len() - 1) as f32;
    let i = (x as usize).min(MAGMA.len() - 2);
    let (low, high, t) = (MAGMA[i], MAGMA[i + 1], x - i as f32);
    [0, 1, 2].map(|c| linear_from_srgb(low[c] + t * (high[c] - low[c]))).into()
}

/// sRGB values at 0, 15/255, 30/255 … 1.
const MAGMA: [[f32; 3]; 18] = [
    [0.001, 0.000, 0.014],
    [0.036, 0.028, 0.125],
    [0.103, 0.063, 0.258],
    [0.191, 0.065, 0.396],
    [0.291, 0.065, 0.475],
    [0.384, 0.098, 0.501],
    [0.476, 0.135, 0.508],
    [0.569, 0.167, 0.504],
    [0.665, 0.198, 0.489],
    [0.761, 0.231, 0.460],
    [0.852, 0.276, 0.419],
    [0.926, 0.347, 0.375],
    [0.970, 0.447, 0.360],
    [0.989, 0.558, 0.392],
    [0.997, 0.668, 0.456],
    [0.997, 0.777, 0.541],
    [0.992, 0.884, 0.640],
    [0.987, 0.991, 0.750],
];

#[cfg(test)]
mod tests;
