//! For the tests of lights: random numbers, means with their errors, and quadrature over surfaces.

use glam::DVec3;

/// SplitMix64 (Steele et al., OOPSLA 2014).
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    /// Uniform in [0, 1), of 24 bits.
    pub(super) fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn square(&mut self) -> [f32; 2] {
        [self.unit(), self.unit()]
    }

    /// Uniform in [−1, 1)³.
    pub(super) fn in_cube(&mut self) -> DVec3 {
        DVec3::from(std::array::from_fn(|_| self.between(-1.0, 1.0)))
    }

    /// Uniform on the unit sphere.
    pub(super) fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube();
            if (0.01..1.0).contains(&v.length()) {
                return v.normalize();
            }
        }
    }
}

/// A mean and the spread of what it is a mean of.
#[derive(Debug)]
pub(super) struct Estimate {
    pub(super) mean: f64,
    pub(super) variance: f64,
    count: f64,
}

impl Estimate {
    pub(super) fn of(count: u32, mut value: impl FnMut(u32) -> f64) -> Self {
        let (mut mean, mut squares) = (0.0, 0.0);
        for i in 0..count {
            // Welford's recurrence.
            let x = value(i);
            let off = x - mean;
            mean += off / f64::from(i + 1);
            squares += off * (x - mean);
        }
        let count = f64::from(count);
        Self { mean, variance: squares / (count - 1.0), count }
    }

    /// Whether `expected` is within four standard errors, and the rounding of f32 samples. A chance of
    /// 6·10⁻⁵ to be wrong; seeds are fixed.
    pub(super) fn agrees_with(&self, expected: f64) -> bool {
        let error = (self.variance / self.count).sqrt();
        (self.mean - expected).abs() <= 4.0 * error + 1e-6 * expected.abs()
    }
}

/// Irradiance at `p` on a plane of normal `n` from a parallelogram of radiance 1 that shines to the
/// side of `u` × `v`: the midpoint rule over `steps`² points, L·cosθ·cosθᵢ·dA/d².
pub(super) fn irradiance_of_parallelogram(
    [corner, u, v]: [DVec3; 3],
    p: DVec3,
    n: DVec3,
    steps: u32,
) -> f64 {
    let area = u.cross(v);
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(steps);
    let points = (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j)));
    let sum: f64 = points
        .map(|(i, j)| {
            let d = corner + u * at(i) + v * at(j) - p;
            let d2 = d.length_squared();
            (-d.dot(area)).max(0.0) * d.dot(n).max(0.0) / (d2 * d2)
        })
        .sum();
    sum / f64::from(steps * steps)
}
