//! For the tests of lights: random numbers, means with their errors, and closed forms.

use glam::DVec3;

use super::Light;
use crate::sampler::{Dimensions, REPLICATES, Sampler};

/// A measured figure, for `--nocapture`.
#[allow(clippy::print_stdout, reason = "for those who ask")]
pub(super) fn tell(figure: &str) {
    println!("{figure}");
}

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

/// The integral of direction times radiance over a polygon of radiance 1, seen from `p`: its component
/// along a normal is the irradiance on that plane, if all of the polygon is above it. Counter-clockwise
/// as seen from `p`, the result points away from the polygon; clockwise, towards it.
///
/// Half the sum over edges of the angle that an edge fills, times the normal of its plane: Lambert,
/// *Photometria*, 1760.
pub(super) fn vector_irradiance(corners: &[DVec3], p: DVec3) -> DVec3 {
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).map(|(&a, &b)| {
        let (a, b) = (a - p, b - p);
        let cross = a.cross(b);
        let angle = cross.length().atan2(a.dot(b));
        cross.normalize_or_zero() * angle
    });
    0.5 * edges.sum::<DVec3>()
}

/// Whether samples of a light of radiance 1 average to `expected`, the vector irradiance at `p`, in each
/// component and in the sum that a slanted plane receives.
pub(super) fn assert_vector_irradiance(light: &Light, p: DVec3, expected: DVec3, seed: u64) {
    let p32 = p.as_vec3();
    for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, -0.48, 0.64)] {
        let mut random = Random::new(seed);
        let estimate = Estimate::of(60_000, |_| {
            let sample = light.sample(p32, random.square());
            sample.map_or(0.0, |s| f64::from(s.irradiance.g) * axis.dot(s.direction.as_dvec3()))
        });
        let slack = 3e-6 * expected.length();
        let expected = expected.dot(axis);
        assert!(
            estimate.agrees_with(expected) || (estimate.mean - expected).abs() < slack,
            "{light:?} at {p}: {estimate:?}, not {expected}, along {axis}"
        );
    }
}

/// Root mean square errors of means of `count` samples: of random numbers, and of well-distributed ones.
/// What is averaged is the irradiance at `p` on a plane of normal `n`.
pub(super) fn errors(light: &Light, p: DVec3, n: DVec3, count: u32, truth: f64) -> [f64; 2] {
    const RUNS: u32 = 64;
    let p = p.as_vec3();
    let value = |u| {
        let sample = light.sample(p, u);
        sample.map_or(0.0, |s| f64::from(s.irradiance.g) * n.dot(s.direction.as_dvec3()).max(0.0))
    };
    let mut random = Random::new(17);
    let rms = |mean: &mut dyn FnMut(u32) -> f64| {
        let squares: f64 = (0..RUNS).map(|run| (mean(run) - truth).powi(2)).sum();
        (squares / f64::from(RUNS)).sqrt()
    };
    let by_chance = rms(&mut |_| Estimate::of(count, |_| value(random.square())).mean);
    let stratified = rms(&mut |run| {
        let mean = Estimate::of(count, |i| {
            // One replicate of a pixel's samples.
            let [a, b, ..] = Sampler::new(9, [run, 0], i * REPLICATES).four(Dimensions::Camera);
            value([a, b])
        });
        mean.mean
    });
    [by_chance, stratified]
}
