//! FLIP: how different two pictures look to someone who flips between them, from 0 to 1 for each pixel.
//!
//! Both pictures are filtered as the eye does at the given distance (contrast sensitivity, one filter
//! for each opponent colour), and their colours are compared in a perceptually uniform space; edges and
//! points that only one of them shows make that difference count more. Sources: Andersson et al.,
//! *FLIP: A Difference Evaluator for Alternating Images*, 2020; for light beyond [0, 1], Andersson et
//! al., *Visualizing Errors in Rendered High Dynamic Range Images*, 2021. Filters are separated as in
//! the authors' note *Separated Convolutions*, which the tests' oracle does too.

use std::f32::consts::PI;

use rayon::prelude::*;

use crate::color::Rgb;

/// Pixels per degree of a viewer 0.7 m in front of a screen 0.7 m wide with 3840 pixels: the default of
/// FLIP's authors.
pub const PIXELS_PER_DEGREE: f32 = 0.7 * (3840.0 / 0.7) * (PI / 180.0);

/// The exponent of colour differences. This and the next four: table 1 of the paper.
const COLOUR_EXPONENT: f32 = 0.7;
/// The share of the largest colour difference that is mapped to [`KNEE`].
const KNEE_AT: f32 = 0.4;
/// See [`KNEE_AT`].
const KNEE: f32 = 0.95;
/// Width of the feature filters in degrees.
const FEATURE_WIDTH: f32 = 0.082;
/// The exponent of feature differences.
const FEATURE_EXPONENT: f32 = 0.5;

/// CIE XYZ of linear Rec.709, row by row, with the digits of the authors.
const XYZ_FROM_RGB: [[f32; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];
/// Its inverse.
const RGB_FROM_XYZ: [[f32; 3]; 3] = [
    [3.241_003_3, -1.537_399, -0.498_615_86],
    [-0.969_224_33, 1.875_93, 0.041_554_224],
    [0.055_639_423, -0.204_011_2, 1.057_148_9],
];
/// XYZ of white (D65).
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_3];

/// FLIP of each pixel of two pictures on a display: linear Rec.709, row by row, clipped to [0, 1].
///
/// The lists must have `size[0] · size[1]` pixels each, all finite. `pixels_per_degree` says how large
/// pixels look, as [`PIXELS_PER_DEGREE`].
pub fn flip(test: &[Rgb], reference: &[Rgb], size: [u32; 2], pixels_per_degree: f32) -> Vec<f32> {
    let clip = |x: f32| x.clamp(0.0, 1.0);
    seen_difference(
        &|i| test[i].to_array().map(clip),
        &|i| reference[i].to_array().map(clip),
        size,
        pixels_per_degree,
    )
}

/// The exposures of HDR-FLIP, in stops: the first maps the brightest pixel of the reference, the last
/// its median, to 0.85 of the display's white; as many between that two are at most one stop apart.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "said above")]
pub struct Exposures {
    pub first: f32,
    pub last: f32,
    pub count: u32,
}

impl Exposures {
    /// Those that suit a reference of linear radiances. Its luminances count as at least 2⁻²³, so that a
    /// black half needs no infinite exposure.
    pub fn of(reference: &[Rgb]) -> Self {
        let mut luminances: Vec<f32> = reference.par_iter().map(|c| c.luminance()).collect();
        let brightest = luminances.iter().fold(0.0, |a: f32, &b| a.max(b));
        let middle = luminances.len() / 2;
        let median = match luminances.get(middle) {
            Some(_) => *luminances.select_nth_unstable_by(middle, f32::total_cmp).1,
            None => 0.0,
        };
        // Where the tone mapping reaches 0.85: the larger root of a quadratic.
        let [a, b, c] = [0, 1, 2].map(|i| TONE_MAP[i] - 0.85 * TONE_MAP[i + 3]);
        let half = -0.5 * b / a;
        let white = (half + (half * half - c / a).sqrt()) as f32;
        let stops = |luminance: f32| (white / luminance.clamp(f32::EPSILON, f32::MAX)).log2();
        let (first, last) = (stops(brightest), stops(median));
        Self { first, last, count: (last - first).ceil().max(2.0) as u32 }
    }

    /// The exposure of each picture that is compared.
    fn stops(self) -> impl Iterator<Item = f32> {
        let step = (self.last - self.first) / (self.count - 1) as f32;
        (0..self.count).map(move |i| self.first + i as f32 * step)
    }
}

/// HDR-FLIP of each pixel of two pictures of linear radiance: the largest FLIP over the exposures that
/// suit the reference, after the tone mapping of ACES as fitted by Narkowicz. Negative values count as
/// black. Otherwise as [`flip`].
pub fn hdr_flip(
    test: &[Rgb],
    reference: &[Rgb],
    size: [u32; 2],
    pixels_per_degree: f32,
) -> (Vec<f32>, Exposures) {
    let exposures = Exposures::of(reference);
    let mut largest = vec![0.0f32; reference.len()];
    for stops in exposures.stops() {
        let scale = f64::from(stops).exp2();
        let show = |x: f32| tone_map(scale * f64::from(x));
        let map = seen_difference(
            &|i| test[i].to_array().map(show),
            &|i| reference[i].to_array().map(show),
            size,
            pixels_per_degree,
        );
        for (largest, value) in largest.iter_mut().zip(map) {
            *largest = largest.max(value);
        }
    }
    (largest, exposures)
}

/// Coefficients of x², x and 1 of the numerator, then of the denominator. Source: Narkowicz, *ACES
/// Filmic Tone Mapping Curve*, 2016, with its pre-exposure of 0.6 undone, as in HDR-FLIP.
const TONE_MAP: [f64; 6] = [0.36 * 2.51, 0.6 * 0.03, 0.0, 0.36 * 2.43, 0.6 * 0.59, 0.14];

/// A display value in [0, 1]. In f64, as the square of a bright f32 is infinite.
fn tone_map(x: f64) -> f32 {
    let x = x.max(0.0);
    let [a, b, c, d, e, f] = TONE_MAP;
    (((a * x + b) * x + c) / ((d * x + e) * x + f)).clamp(0.0, 1.0) as f32
}

/// Linear display values in [0, 1] of the pixel with an index.
trait Shown: Fn(usize) -> [f32; 3] + Sync {}
impl<F: Fn(usize) -> [f32; 3] + Sync> Shown for F {}

fn seen_difference(
    test: &impl Shown,
    reference: &impl Shown,
    size: [u32; 2],
    pixels_per_degree: f32,
) -> Vec<f32> {
    let filters = Filters::new(pixels_per_degree);
    let mut colours = filters.colours(reference, size);
    let largest = largest_colour_difference();
    let knee = KNEE_AT * largest;
    colours.par_iter_mut().zip(filters.colours(test, size)).for_each(|(a, b)| {
        let d = hyab(*a, b).powf(COLOUR_EXPONENT);
        // The first component is reused for the difference.
        a[0] = if d < knee {
            d * KNEE / knee
        } else {
            KNEE + (d - knee) / (largest - knee) * (1.0 - KNEE)
        };
    });
    let features = filters.features(reference, size).into_par_iter();
    features
        .zip(filters.features(test, size))
        .zip(colours)
        .map(|((a, b), [colour, ..])| {
            let [edge, point] = [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()];
            let feature = (edge.max(point) / 2f32.sqrt()).powf(FEATURE_EXPONENT);
            colour.powf(1.0 - feature)
        })
        .collect()
}

/// Weights of a filter, tap by tap; four values are filtered at once, each with weights of its own.
type Taps = Vec<[f32; 4]>;

/// The filters for one distance from the screen.
struct Filters {
    /// For luminance, red-green, and the two Gaussians of blue-yellow; along rows and along columns.
    contrast: Taps,
    /// Along rows: first and second derivative, Gaussian, Gaussian.
    feature_across: Taps,
    /// Along columns: Gaussian, Gaussian, first and second derivative.
    feature_down: Taps,
}

impl Filters {
    fn new(pixels_per_degree: f32) -> Self {
        // Contrast sensitivity as sums of Gaussians a √(π/b) exp(−π² x²/b), x in degrees: table 1 of the
        // paper. A product of two roots makes the third and fourth two-dimensional.
        let gaussian = |x: f32, b: f32| (-PI * PI * x * x / b).exp();
        let root = |a: f32, b: f32| (a * (PI / b).sqrt()).sqrt();
        let reach = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
        let mut contrast: Taps = (-reach..=reach)
            .map(|i| {
                let x = i as f32 / pixels_per_degree;
                [
                    gaussian(x, 0.0047),
                    gaussian(x, 0.0053),
                    root(34.1, 0.04) * gaussian(x, 0.04),
                    root(13.5, 0.025) * gaussian(x, 0.025),
                ]
            })
            .collect();
        let [y, cx, cz1, cz2] = sum(&contrast);
        // The sum over the plane of both products is 1.
        let cz = cz1.hypot(cz2);
        divide(&mut contrast, |_| [y, cx, cz, cz]);

        let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let reach = (3.0 * deviation).ceil() as i32;
        let mut derivatives: Taps = (-reach..=reach)
            .map(|i| {
                let x = i as f32;
                let g = (-x * x / (2.0 * deviation * deviation)).exp();
                [-x * g, (x * x / (deviation * deviation) - 1.0) * g, g, g]
            })
            .collect();
        // Positive weights sum to 1, negative ones to −1.
        let positive = sum(&derivatives.iter().map(|w| w.map(|x| x.max(0.0))).collect());
        let negative = sum(&derivatives.iter().map(|w| w.map(|x| (-x).max(0.0))).collect());
        divide(&mut derivatives, |w| {
            [0, 1, 2, 3].map(|i| if w[i] > 0.0 { positive[i] } else { negative[i] })
        });
        let feature_down = derivatives.iter().map(|&[d, dd, g, _]| [g, g, d, dd]).collect();
        Self { contrast, feature_across: derivatives, feature_down }
    }

    /// The colours that an eye tells apart: CIELAB with Hunt's adjustment.
    fn colours(&self, shown: &impl Shown, size: [u32; 2]) -> Vec<[f32; 3]> {
        let source = |i| {
            let [y, cx, cz] = opponent(shown(i));
            [y, cx, cz, cz]
        };
        convolve(size, source, &self.contrast, &self.contrast, |[y, cx, cz1, cz2]| {
            let y = (y + 16.0) / 116.0;
            let xyz = [y + cx / 500.0, y, y - (cz1 + cz2) / 200.0];
            let xyz = [0, 1, 2].map(|i| xyz[i] * WHITE[i]);
            hunted_lab(multiply(&RGB_FROM_XYZ, xyz).map(|x| x.clamp(0.0, 1.0)))
        })
    }

    /// How strong an edge, and how strong a point or line, each pixel lies on.
    fn features(&self, shown: &impl Shown, size: [u32; 2]) -> Vec<[f32; 2]> {
        let source = |i| [(opponent(shown(i))[0] + 16.0) / 116.0; 4];
        convolve(size, source, &self.feature_across, &self.feature_down, |[dx, ddx, dy, ddy]| {
            [(dx * dx + dy * dy).sqrt(), (ddx * ddx + ddy * ddy).sqrt()]
        })
    }
}

fn sum(taps: &Taps) -> [f32; 4] {
    taps.iter().fold([0.0; 4], |s, w| [0, 1, 2, 3].map(|i| s[i] + w[i]))
}

/// Divides every weight by what `by` says for it; zero weights stay zero.
fn divide(taps: &mut Taps, by: impl Fn([f32; 4]) -> [f32; 4]) {
    for w in taps {
        let by = by(*w);
        *w = [0, 1, 2, 3].map(|i| if w[i] == 0.0 { 0.0 } else { w[i] / by[i] });
    }
}

/// Filters along rows, then along columns; beyond its edges the picture repeats its outermost pixels.
fn convolve<T: Send>(
    [width, height]: [u32; 2],
    source: impl Fn(usize) -> [f32; 4] + Sync,
    across: &Taps,
    down: &Taps,
    finish: impl Fn([f32; 4]) -> T + Sync,
) -> Vec<T> {
    let [width, height] = [width as usize, height as usize];
    if width == 0 || height == 0 {
        return Vec::new();
    }
    let add = |sums: &mut [[f32; 4]], values: &[[f32; 4]], w: &[f32; 4]| {
        for (sum, v) in sums.iter_mut().zip(values) {
            for i in 0..4 {
                sum[i] += w[i] * v[i];
            }
        }
    };
    let mut rows = vec![[0.0f32; 4]; width * height];
    rows.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let reach = across.len() / 2;
        let inside = (0..width).map(|x| source(y * width + x));
        let mut padded = vec![[0.0; 4]; reach];
        padded.extend(inside);
        let [first, last] = [padded[reach], padded[reach + width - 1]];
        padded[..reach].fill(first);
        padded.resize(width + 2 * reach, last);
        for (i, w) in across.iter().enumerate() {
            add(row, &padded[i..], w);
        }
    });
    let reach = down.len() / 2;
    let row = |y: usize| {
        let mut sums = vec![[0.0f32; 4]; width];
        for (i, w) in down.iter().enumerate() {
            let y = (y + i).saturating_sub(reach).min(height - 1);
            add(&mut sums, &rows[y * width..(y + 1) * width], w);
        }
        sums
    };
    // By rows, which come back in their order.
    let rows: Vec<Vec<T>> =
        (0..height).into_par_iter().map(|y| row(y).into_iter().map(&finish).collect()).collect();
    rows.into_iter().flatten().collect()
}

fn multiply(matrix: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ of a linear colour, where white is (1, 1, 1).
fn relative_xyz(rgb: [f32; 3]) -> [f32; 3] {
    let xyz = multiply(&XYZ_FROM_RGB, rgb);
    [0, 1, 2].map(|i| xyz[i] / WHITE[i])
}

/// The linear opponent space YCxCz, in which contrast sensitivity is known.
fn opponent(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = relative_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// CIELAB, its chromaticities in proportion to lightness (Hunt: what is dark looks less colourful).
fn hunted_lab(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz(rgb).map(|t| {
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// A distance that also holds for large differences: along lightness plus across it.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + ((a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

/// Between green and blue, the two that are farthest apart.
fn largest_colour_difference() -> f32 {
    hyab(hunted_lab([0.0, 1.0, 0.0]), hunted_lab([0.0, 0.0, 1.0])).powf(COLOUR_EXPONENT)
}

#[cfg(test)]
mod tests;
