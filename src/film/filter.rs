//! Reconstruction by filter importance sampling: a sample's position is drawn in proportion to the
//! filter, so a sample touches its own pixel only, and tiles, crops and parts are exact.
//!
//! Source: Ernst, Stamminger, Greiner, *Filter Importance Sampling*, IEEE RT 2006; pbrt 4ed §8.8.

/// The reconstruction filters, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Filter {
    /// One pixel wide, constant.
    Box,
    /// Two pixels wide, linear.
    Triangle,
    /// Three pixels wide, σ = 0.5 pixel, falling to 0 at its end.
    Gaussian,
    /// Mitchell and Netravali (1988) with B = C = 1/3: four pixels wide, with negative lobes.
    Mitchell,
    /// Three pixels wide: smooth, nothing negative, low side lobes.
    #[default]
    BlackmanHarris,
}

/// A position drawn from a filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterSample {
    /// Offset from the pixel's centre, in pixels.
    pub offset: [f32; 2],
    /// What the sample's value is multiplied by: 1, but for filters with negative lobes.
    pub weight: f32,
}

impl Filter {
    /// All filters, in the order of documentation.
    pub const ALL: [Self; 5] =
        [Self::Box, Self::Triangle, Self::Gaussian, Self::Mitchell, Self::BlackmanHarris];

    /// The name in scene files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Triangle => "triangle",
            Self::Gaussian => "gaussian",
            Self::Mitchell => "mitchell",
            Self::BlackmanHarris => "blackman-harris",
        }
    }

    /// Half its width, in pixels.
    pub const fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Triangle => 1.0,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
            Self::Mitchell => 2.0,
        }
    }

    /// The filter along one axis, not normalised; zero outside its radius.
    pub fn value(self, x: f64) -> f64 {
        let r = self.radius();
        let x = x.abs();
        if x > r {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Triangle => 1.0 - x,
            Self::Gaussian => (-2.0 * x * x).exp() - (-2.0 * r * r).exp(),
            // B = C = 1/3 in (8) of the paper, times 6.
            Self::Mitchell if x < 1.0 => 7.0 * x.powi(3) - 12.0 * x * x + 16.0 / 3.0,
            Self::Mitchell => -7.0 / 3.0 * x.powi(3) + 12.0 * x * x - 20.0 * x + 32.0 / 3.0,
            // Harris (1978), the four-term window.
            Self::BlackmanHarris => {
                let phase = std::f64::consts::PI * (x / r + 1.0);
                0.35875 - 0.48829 * phase.cos() + 0.14128 * (2.0 * phase).cos()
                    - 0.01168 * (3.0 * phase).cos()
            }
        }
    }
}

/// Cells of the inverse distribution.
const CELLS: usize = 512;

/// A filter made ready for sampling.
#[derive(Debug, Clone)]
pub struct FilterTable {
    /// Position by cumulated share; entry i is where i/CELLS of |f| lies to the left. Empty for the
    /// box, which needs no table.
    inverse: Vec<f32>,
    /// Where the filter is negative: outside ±this.
    zero: f32,
    /// ∫|f| / ∫f along one axis, as the table has it.
    scale: f32,
}

impl FilterTable {
    /// Tabulates `filter`.
    pub fn new(filter: Filter) -> Self {
        if filter == Filter::Box {
            return Self { inverse: Vec::new(), zero: 0.5, scale: 1.0 };
        }
        // ∫|f| by the midpoint rule, much finer than the table.
        let (steps, r) = (64 * CELLS, filter.radius());
        let width = 2.0 * r / steps as f64;
        let values: Vec<f64> =
            (0..steps).map(|i| filter.value(-r + (i as f64 + 0.5) * width)).collect();
        let total: f64 = values.iter().map(|v| v.abs()).sum();
        let mut inverse = Vec::with_capacity(CELLS + 1);
        let mut below = 0.0;
        for (i, v) in values.iter().enumerate() {
            let above = below + v.abs();
            while inverse.len() <= CELLS {
                let target = inverse.len() as f64 / CELLS as f64 * total;
                if target > above {
                    break;
                }
                let within = if above > below { (target - below) / (above - below) } else { 0.0 };
                inverse.push((-r + (i as f64 + within) * width) as f32);
            }
            below = above;
        }
        inverse.resize(CELLS + 1, r as f32);
        let zero = if filter == Filter::Mitchell { mitchell_zero() } else { r } as f32;
        // From the table itself, so that weights average to exactly 1 and a constant stays as it is.
        let negative = |cell: &[f32]| {
            let (a, b) = (f64::from(cell[0]), f64::from(cell[1]));
            let outside =
                (f64::from(-zero) - a).clamp(0.0, b - a) + (b - f64::from(zero)).clamp(0.0, b - a);
            if b > a { outside / (b - a) } else { 0.0 }
        };
        let share = inverse.windows(2).map(negative).sum::<f64>() / CELLS as f64;
        Self { inverse, zero, scale: (1.0 / (1.0 - 2.0 * share)) as f32 }
    }

    /// Draws a position from two numbers in [0, 1).
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> FilterSample {
        if self.inverse.is_empty() {
            return FilterSample { offset: u.map(|u| u - 0.5), weight: 1.0 };
        }
        let offset = u.map(|u| {
            let x = u * CELLS as f32;
            let i = (x as usize).min(CELLS - 1);
            let (a, b) = (self.inverse[i], self.inverse[i + 1]);
            a + (b - a) * (x - i as f32)
        });
        let weight = offset.map(|x| if x.abs() > self.zero { -self.scale } else { self.scale });
        FilterSample { offset, weight: weight[0] * weight[1] }
    }
}

impl FilterTable {
    /// [`FilterTable::sample`] of `N` pairs of numbers: offsets across, offsets down, weights.
    #[inline(always)]
    pub fn sample_lanes<const N: usize>(&self, u: &[f32; N], v: &[f32; N]) -> [[f32; N]; 3] {
        let (mut x, mut y, mut weight) = ([0.0; N], [0.0; N], [1.0; N]);
        if self.inverse.is_empty() {
            // For the compiler to turn into vector instructions.
            for i in 0..N {
                (x[i], y[i]) = (u[i] - 0.5, v[i] - 0.5);
            }
            return [x, y, weight];
        }
        for i in 0..N {
            let sample = self.sample([u[i], v[i]]);
            ([x[i], y[i]], weight[i]) = (sample.offset, sample.weight);
        }
        [x, y, weight]
    }
}

/// Where the Mitchell filter crosses zero, by bisection between 1 and 1.5.
fn mitchell_zero() -> f64 {
    let (mut positive, mut negative) = (1.0, 1.5);
    for _ in 0..60 {
        let middle = 0.5 * (positive + negative);
        if Filter::Mitchell.value(middle) > 0.0 { positive = middle } else { negative = middle }
    }
    positive
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weighted moments of drawn positions against moments of the filter by numerical integration.
    #[test]
    fn samples_follow_the_filter() {
        for filter in Filter::ALL {
            let table = FilterTable::new(filter);
            let (n, r) = (1 << 16, filter.radius());
            let mut drawn = [0.0; 3];
            for i in 0..n {
                let u = (i as f32 + 0.5) / n as f32;
                let s = table.sample([u, 0.5]);
                let lanes = table.sample_lanes(&[0.2, u], &[0.7, 0.5]).map(|lane| lane[1]);
                assert_eq!(lanes, [s.offset[0], s.offset[1], s.weight]);
                // The second axis is drawn at its centre, where the filter is positive.
                let (x, w) = (f64::from(s.offset[0]), f64::from(s.weight / table.scale));
                for (k, d) in drawn.iter_mut().enumerate() {
                    *d += w * x.abs().powi(k as i32) / f64::from(n);
                }
            }
            let mut exact = [0.0; 3];
            let steps = 200_000;
            for i in 0..steps {
                let x = -r + (f64::from(i) + 0.5) * 2.0 * r / f64::from(steps);
                for (k, e) in exact.iter_mut().enumerate() {
                    *e += filter.value(x) * x.abs().powi(k as i32);
                }
            }
            for k in 0..3 {
                let (d, e) = (drawn[k], exact[k] / exact[0]);
                assert!((d - e).abs() < 2e-3, "{} moment {k}: {d} against {e}", filter.name());
            }
        }
    }

    #[test]
    fn weights_average_to_one() {
        for filter in Filter::ALL {
            let table = FilterTable::new(filter);
            let n = 1 << 20;
            let sum: f64 = (0..n)
                .map(|i| f64::from(table.sample([(i as f32 + 0.5) / n as f32, 0.5]).weight))
                .sum();
            // The second axis is drawn at its centre, where the weight is the positive one.
            let mean = sum / f64::from(n) / f64::from(table.scale);
            assert!((mean - 1.0).abs() < 1e-5, "{}: {mean}", filter.name());
        }
    }

    #[test]
    fn one_half_is_the_centre() {
        for filter in Filter::ALL {
            let s = FilterTable::new(filter).sample([0.5, 0.5]);
            assert!(s.offset.iter().all(|x| x.abs() < 1e-3), "{}: {s:?}", filter.name());
        }
    }
}
