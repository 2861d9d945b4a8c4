//! Triangles that share nothing, strewn about a cube.

use glam::DVec3;

/// A number in [0, 1) that depends on its three arguments alone.
///
/// Source: the finaliser of SplitMix64 (Steele, Lea, Flood 2014), over a counter.
pub(super) fn random(seed: u32, i: u64, dimension: u64) -> f64 {
    let mut h = i
        .wrapping_mul(16)
        .wrapping_add(dimension)
        .wrapping_add(u64::from(seed).wrapping_mul(0xa076_1d64_78bd_642f))
        .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    h ^= h >> 31;
    (h >> 11) as f64 * f64::powi(2.0, -53)
}

/// Triangles of their own.
#[derive(Debug, Clone)]
pub(super) struct Scattered {
    count: u64,
    seed: u32,
    form: Form,
}

#[derive(Debug, Clone, Copy)]
enum Form {
    /// Long and thin.
    Sliver,
    /// Three points in a cube of this side.
    Any { side: f64 },
}

impl Scattered {
    pub(super) const fn slivers(count: u64, seed: u32) -> Self {
        Self { count, seed, form: Form::Sliver }
    }

    pub(super) fn soup(count: u64, seed: u32) -> Self {
        // Each has eight times its share of the room: rays meet some, and none is alone.
        let side = 4.0 / (count as f64).cbrt();
        Self { count, seed, form: Form::Any { side: side.min(2.0) } }
    }

    pub(super) const fn count(&self) -> u64 {
        self.count
    }

    pub(super) fn vertex(&self, i: u64) -> DVec3 {
        let (triangle, corner) = (i / 3, i % 3);
        let numbers = |first: u64| {
            let number = |k| random(self.seed, triangle, first + k) * 2.0 - 1.0;
            DVec3::new(number(0), number(1), number(2))
        };
        let center = numbers(0);
        match self.form {
            Form::Any { side } => center + numbers(3 + 3 * corner) * (side / 2.0),
            Form::Sliver => {
                let axis = numbers(3).normalize_or(DVec3::X);
                let side = axis.cross(numbers(6)).normalize_or(axis.any_orthonormal_vector());
                let along = axis * ((3.5 + 2.5 * numbers(9).x) / 2.0);
                let offset = match corner {
                    0 => -along - side * 0.002,
                    1 => -along + side * 0.002,
                    _ => along,
                };
                center * 50.0 + offset
            }
        }
    }
}
