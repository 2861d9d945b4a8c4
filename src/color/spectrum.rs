//! Light of one wavelength in a renderer of three bands: what a prism needs.
//!
//! A path that meets a dispersive material draws one wavelength, follows it alone, and multiplies its
//! throughput by [`Wavelength::rgb_weight`]. The weights average to exactly (1, 1, 1), so a scene without
//! dispersion looks the same, with more noise.
//!
//! How the weights come about: the colour of each wavelength in linear Rec.709, by the CIE 1931 2° observer;
//! what is negative (every pure colour is outside Rec.709) becomes 0; each channel is scaled to integrate
//! to 1 over the visible range; divided by the density that wavelengths are drawn with. The scaling makes
//! equal energy white, as a light of (1, 1, 1) is here, whatever spectrum it had.
//!
//! The density is proportional to the length √(r² + g² + b²) of the colour: of all densities it gives the
//! least variance summed over the channels, and no weight above [`MAX_WEIGHT`].

use std::sync::LazyLock;

use super::Rgb;

/// Where the visible range begins here, in nm.
pub const VISIBLE_MIN: f32 = 380.0;
/// Where the visible range ends here, in nm. Outside is less than 1/5000 of the response to equal energy.
pub const VISIBLE_MAX: f32 = 730.0;
/// No component of [`Wavelength::rgb_weight`] is larger.
pub const MAX_WEIGHT: f32 = 2.75;

/// Distance of the table's rows, in nm.
const STEP: f64 = 5.0;
const ROWS: usize = 71;

/// A wavelength in air, in nm.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Wavelength(f32);

impl Wavelength {
    /// From nanometres; visible or not.
    pub const fn from_nanometres(nanometres: f32) -> Self {
        Self(nanometres)
    }

    /// In nanometres.
    pub const fn nanometres(self) -> f32 {
        self.0
    }

    /// Draws a wavelength in [[`VISIBLE_MIN`], [`VISIBLE_MAX`]].
    ///
    /// `u`: in [0, 1). Larger `u`, longer wavelength: numbers that are stratified give wavelengths that are.
    pub fn sample(u: f32) -> Self {
        let table = &*TABLE;
        let u = f64::from(u);
        // The last row whose share does not exceed u; never the table's last.
        let row = table.cdf.partition_point(|&c| c <= u).clamp(1, ROWS - 1) - 1;
        let (p0, p1) = (table.density[row], table.density[row + 1]);
        // Within a row the density is p0 + (p1 − p0)·x, its integral p0·x + (p1 − p0)·x²/2 in units of
        // STEP. The root in the form that does not cancel, and is 0 where there is nothing to share out.
        let share = ((u - table.cdf[row]) / STEP).max(0.0);
        let root = (p0 * p0 + 2.0 * (p1 - p0) * share).max(0.0).sqrt();
        let x = if share > 0.0 { (2.0 * share / (p0 + root)).min(1.0) } else { 0.0 };
        let nanometres = f64::from(VISIBLE_MIN) + STEP * (row as f64 + x);
        Self(nanometres as f32)
    }

    /// What to multiply the throughput of a path by that carries this wavelength alone, drawn by
    /// [`sample`](Self::sample).
    ///
    /// No component is negative or above [`MAX_WEIGHT`], and the mean over the samples is (1, 1, 1). Black
    /// outside the visible range.
    pub fn rgb_weight(self) -> Rgb {
        let table = &*TABLE;
        let Some((row, x)) = row_at(f64::from(self.0)) else { return Rgb::BLACK };
        let mix = |a: f64, b: f64| a + (b - a) * x;
        let density = mix(table.density[row], table.density[row + 1]);
        let channel =
            |c: usize| (mix(table.response[row][c], table.response[row + 1][c]) / density) as f32;
        Rgb::new(channel(0), channel(1), channel(2))
    }

    /// Density with which [`sample`](Self::sample) draws this wavelength, per nm.
    pub fn density(self) -> f32 {
        let density = &TABLE.density;
        row_at(f64::from(self.0))
            .map_or(0.0, |(row, x)| density[row] + (density[row + 1] - density[row]) * x)
            as f32
    }
}

/// CIE 1931 2° colour matching functions x̄, ȳ, z̄ at a wavelength in nm, linear between the rows of the
/// table of 5 nm. Zero outside the visible range.
///
/// Source: CIE 15:2004, table T.4 (ISO 11664-1).
pub fn cie_1931(nanometres: f64) -> [f64; 3] {
    row_at(nanometres).map_or([0.0; 3], |(row, x)| {
        std::array::from_fn(|c| CIE_1931[row][c] + (CIE_1931[row + 1][c] - CIE_1931[row][c]) * x)
    })
}

/// CIE XYZ to linear Rec.709, white D65, unclipped. Source: the primaries and white of ITU-R BT.709-6 §1.
pub fn rec709_from_xyz([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_969_941_9 * x - 1.537_383_177_6 * y - 0.498_610_760_3 * z,
        -0.969_243_636_3 * x + 1.875_967_501_5 * y + 0.041_555_057_4 * z,
        0.055_630_079_7 * x - 0.203_976_958_9 * y + 1.056_971_514_2 * z,
    ]
}

/// The row of the tables at or below a wavelength and the fraction of the way to the next.
fn row_at(nanometres: f64) -> Option<(usize, f64)> {
    let place = (nanometres - f64::from(VISIBLE_MIN)) / STEP;
    if !(0.0..=(ROWS - 1) as f64).contains(&place) {
        return None;
    }
    let row = (place as usize).min(ROWS - 2);
    Some((row, place - row as f64))
}

/// What sampling needs, linear between rows.
struct Table {
    /// Colour of each wavelength, no channel negative, each integrating to 1.
    response: [[f64; 3]; ROWS],
    /// Density of the samples, per nm.
    density: [f64; ROWS],
    /// The density's integral up to each row: from 0 to 1.
    cdf: [f64; ROWS],
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let mut response = CIE_1931.map(|xyz| rec709_from_xyz(xyz).map(|c| c.max(0.0)));
    // What is linear between rows is integrated exactly by trapezia.
    let integral = |of: &dyn Fn(usize) -> f64| -> f64 {
        (1..ROWS).map(|i| 0.5 * STEP * (of(i - 1) + of(i))).sum()
    };
    let totals: [f64; 3] = std::array::from_fn(|c| integral(&|i| response[i][c]));
    for row in &mut response {
        *row = std::array::from_fn(|c| row[c] / totals[c]);
    }
    let mut density = response.map(|[r, g, b]| (r * r + g * g + b * b).sqrt());
    let total = integral(&|i| density[i]);
    density = density.map(|d| d / total);
    let mut cdf = [0.0; ROWS];
    for i in 1..ROWS {
        cdf[i] = cdf[i - 1] + 0.5 * STEP * (density[i - 1] + density[i]);
    }
    Table { response, density, cdf }
});

/// x̄, ȳ, z̄ from 380 nm in steps of 5 nm.
#[rustfmt::skip]
const CIE_1931: [[f64; 3]; ROWS] = [
    [0.001368, 0.000039, 0.006450],
    [0.002236, 0.000064, 0.010550],
    [0.004243, 0.000120, 0.020050],
    [0.007650, 0.000217, 0.036210],
    [0.014310, 0.000396, 0.067850],
    [0.023190, 0.000640, 0.110200],
    [0.043510, 0.001210, 0.207400],
    [0.077630, 0.002180, 0.371300],
    [0.134380, 0.004000, 0.645600],
    [0.214770, 0.007300, 1.039050],
    [0.283900, 0.011600, 1.385600],
    [0.328500, 0.016840, 1.622960],
    [0.348280, 0.023000, 1.747060],
    [0.348060, 0.029800, 1.782600],
    [0.336200, 0.038000, 1.772110],
    [0.318700, 0.048000, 1.744100],
    [0.290800, 0.060000, 1.669200],
    [0.251100, 0.073900, 1.528100],
    [0.195360, 0.090980, 1.287640],
    [0.142100, 0.112600, 1.041900],
    [0.095640, 0.139020, 0.812950],
    [0.057950, 0.169300, 0.616200],
    [0.032010, 0.208020, 0.465180],
    [0.014700, 0.258600, 0.353300],
    [0.004900, 0.323000, 0.272000],
    [0.002400, 0.407300, 0.212300],
    [0.009300, 0.503000, 0.158200],
    [0.029100, 0.608200, 0.111700],
    [0.063270, 0.710000, 0.078250],
    [0.109600, 0.793200, 0.057250],
    [0.165500, 0.862000, 0.042160],
    [0.225750, 0.914850, 0.029840],
    [0.290400, 0.954000, 0.020300],
    [0.359700, 0.980300, 0.013400],
    [0.433450, 0.994950, 0.008750],
    [0.512050, 1.000000, 0.005750],
    [0.594500, 0.995000, 0.003900],
    [0.678400, 0.978600, 0.002750],
    [0.762100, 0.952000, 0.002100],
    [0.842500, 0.915400, 0.001800],
    [0.916300, 0.870000, 0.001650],
    [0.978600, 0.816300, 0.001400],
    [1.026300, 0.757000, 0.001100],
    [1.056700, 0.694900, 0.001000],
    [1.062200, 0.631000, 0.000800],
    [1.045600, 0.566800, 0.000600],
    [1.002600, 0.503000, 0.000340],
    [0.938400, 0.441200, 0.000240],
    [0.854450, 0.381000, 0.000190],
    [0.751400, 0.321000, 0.000100],
    [0.642400, 0.265000, 0.000050],
    [0.541900, 0.217000, 0.000030],
    [0.447900, 0.175000, 0.000020],
    [0.360800, 0.138200, 0.000010],
    [0.283500, 0.107000, 0.000000],
    [0.218700, 0.081600, 0.000000],
    [0.164900, 0.061000, 0.000000],
    [0.121200, 0.044580, 0.000000],
    [0.087400, 0.032000, 0.000000],
    [0.063600, 0.023200, 0.000000],
    [0.046770, 0.017000, 0.000000],
    [0.032900, 0.011920, 0.000000],
    [0.022700, 0.008210, 0.000000],
    [0.015840, 0.005723, 0.000000],
    [0.011359, 0.004102, 0.000000],
    [0.008111, 0.002929, 0.000000],
    [0.005790, 0.002091, 0.000000],
    [0.004109, 0.001484, 0.000000],
    [0.002899, 0.001047, 0.000000],
    [0.002049, 0.000740, 0.000000],
    [0.001440, 0.000520, 0.000000],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Means over `u` of what a wavelength gives, by the midpoint rule.
    fn mean(f: impl Fn(Wavelength) -> [f64; 3]) -> [f64; 3] {
        let n = 1 << 20;
        let mut sums = [0.0; 3];
        for i in 0..n {
            let values = f(Wavelength::sample((i as f32 + 0.5) / n as f32));
            (0..3).for_each(|c| sums[c] += values[c]);
        }
        sums.map(|s| s / f64::from(n))
    }

    fn weight(nanometres: f32) -> Rgb {
        Wavelength::from_nanometres(nanometres).rgb_weight()
    }

    #[test]
    fn the_weights_average_to_white() {
        let white = mean(|w| w.rgb_weight().to_array().map(f64::from));
        assert!(white.iter().all(|c| (c - 1.0).abs() < 1e-5), "{white:?}");
    }

    #[test]
    fn no_weight_is_negative_or_large() {
        let mut largest = 0f32;
        for i in 0..=35_000u16 {
            let w = Wavelength::from_nanometres(VISIBLE_MIN + f32::from(i) * 0.01);
            let rgb = w.rgb_weight().to_array();
            assert!(rgb.iter().all(|c| (0.0..=MAX_WEIGHT).contains(c)), "{w:?}: {rgb:?}");
            largest = rgb.into_iter().fold(largest, f32::max);
        }
        assert!(largest > MAX_WEIGHT - 0.01, "{largest}");
        // The noise it brings: the variance of each channel's weight.
        let squares = mean(|w| w.rgb_weight().to_array().map(|c| f64::from(c * c)));
        for (square, expected) in squares.into_iter().zip([2.449, 2.427, 2.659]) {
            assert!((square - expected).abs() < 0.01, "{squares:?}");
        }
    }

    #[test]
    fn wavelengths_rise_with_u_at_their_density() {
        let (mut last, n) = (Wavelength::sample(0.0), 100_000);
        assert_eq!(last.nanometres(), VISIBLE_MIN);
        for i in 1..n {
            let w = Wavelength::sample(i as f32 / n as f32);
            assert!(w >= last, "{w:?} after {last:?}");
            // The step between two samples is 1/n over the density, but for the roundings of u and λ.
            let step = w.nanometres() - last.nanometres();
            let expected = 1.0 / (n as f32 * w.density());
            assert!((step - expected).abs() < 0.05 * expected + 2e-4, "{w:?}: {step}, {expected}");
            last = w;
        }
        let end = Wavelength::sample(1f32.next_down()).nanometres();
        assert!(end <= VISIBLE_MAX && end > VISIBLE_MAX - 0.5, "{end}");
    }

    #[test]
    fn the_order_of_a_rainbow() {
        let (violet, blue, cyan) = (weight(410.0), weight(450.0), weight(495.0));
        let (yellow, red) = (weight(575.0), weight(650.0));
        assert!(violet.r > 0.05 && violet.b > 5.0 * violet.r && violet.g == 0.0, "{violet:?}");
        assert!(blue.b > 5.0 * blue.r.max(blue.g), "{blue:?}");
        assert!(cyan.r == 0.0 && cyan.g > 0.3 && cyan.b > 0.3, "{cyan:?}");
        for nanometres in [530.0, 540.0, 550.0] {
            let green = weight(nanometres);
            assert!(green.g > 2.0 * green.r.max(green.b), "{nanometres}: {green:?}");
        }
        assert!(yellow.b < 0.01 && yellow.r > 0.5 && yellow.g > 0.5, "{yellow:?}");
        assert!(red.r > 2.0 && red.g == 0.0 && red.b < 0.01, "{red:?}");
        for outside in [379.9, 730.1, 0.0, -1.0, f32::INFINITY, f32::NAN] {
            assert!(weight(outside).is_black(), "{outside}");
        }
    }

    #[test]
    fn the_observer_and_the_matrix() {
        // Sums of the standard's columns from 360 to 830 nm are 21.3714, 21.3711, 21.3715.
        for (c, total) in [21.3714, 21.3711, 21.3715].into_iter().enumerate() {
            let sum: f64 = CIE_1931.iter().map(|row| row[c]).sum();
            assert!((sum / total - 1.0).abs() < 2e-4, "column {c}: {sum}");
        }
        assert_eq!(cie_1931(555.0), [0.512_05, 1.0, 0.005_75]);
        assert!((cie_1931(557.5)[1] - 0.9975).abs() < 1e-12);
        // D65, chromaticity (0.3127, 0.3290), is white.
        let white = rec709_from_xyz([0.3127 / 0.3290, 1.0, (1.0 - 0.3127 - 0.3290) / 0.3290]);
        assert!(white.iter().all(|c| (c - 1.0).abs() < 1e-8), "{white:?}");
    }
}
