//! Numbers in [0, 1) as a pure function of (seed, pixel, sample, dimension): no state, so any sample
//! can be drawn again, on any thread and in any part of a render.
//!
//! Sample `i` of a pixel belongs to replicate `i mod R`. Each replicate is an Owen-scrambled Sobol
//! sequence of its own (Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4) 2020), independent
//! of the others: from the spread of the replicates' means follows an error that is true, where the
//! spread of single samples would overstate it many times (see [`crate::film`]).

mod lanes;

/// Replicates of a pixel. Fewer cost less convergence, more give a surer error.
pub const REPLICATES: u32 = 4;

/// The generator's longest sequence; beyond it a new one starts.
const SEQUENCE: u32 = 1 << 16;

/// What a number is used for. Each use has its own four dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimensions {
    /// Position in the pixel (first two) and on the lens (last two).
    Camera,
    /// Wavelength (the first).
    Spectrum,
    /// Whether a branch of the ray tree goes on (the first).
    Roulette,
    /// Position on a light (first two), or which light (the third).
    Light,
    /// A direction (first two).
    Direction,
}

/// The numbers of one sample of one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampler {
    /// Hash of seed, pixel and replicate.
    stream: u32,
    /// Index within the replicate's sequence.
    index: u32,
}

/// The samples of one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelSampler {
    /// Hash of seed and pixel.
    hash: u64,
}

impl PixelSampler {
    /// Those of the pixel at absolute coordinates `(x, y)`.
    #[inline]
    pub fn new(seed: u64, [x, y]: [u32; 2]) -> Self {
        let pixel = u64::from(x) | u64::from(y) << 32;
        Self { hash: mix(mix(seed ^ 0x9e37_79b9_7f4a_7c15) ^ pixel) }
    }

    /// The sampler of one of them.
    #[inline]
    pub fn sample(self, sample: u32) -> Sampler {
        let (replicate, index) = (sample % REPLICATES, sample / REPLICATES);
        let stream = u64::from(replicate) | u64::from(index / SEQUENCE) << 32;
        let hash = mix(self.hash ^ stream);
        Sampler { stream: (hash >> 32) as u32, index: index % SEQUENCE }
    }
}

impl Sampler {
    /// The sampler of sample `sample` of the pixel at absolute coordinates `(x, y)`.
    #[inline]
    pub fn new(seed: u64, pixel: [u32; 2], sample: u32) -> Self {
        PixelSampler::new(seed, pixel).sample(sample)
    }

    /// Four numbers in [0, 1) for one use, well distributed over the samples of a replicate, the first two
    /// best: together they fill the square evenly.
    ///
    /// Each use takes the first four Sobol dimensions, in an order and with a scramble of its own, as
    /// later dimensions fill their squares less evenly (Burley's padding).
    #[inline]
    pub fn four(&self, dimensions: Dimensions) -> [f32; 4] {
        sobol_burley::sample_4d(self.index, 0, self.stream_of(dimensions))
    }

    /// The seed of the sequence of one use.
    #[inline]
    fn stream_of(&self, dimensions: Dimensions) -> u32 {
        match dimensions {
            Dimensions::Camera => self.stream,
            other => self.branch(!(other as u32)).stream,
        }
    }

    /// The sampler of one of several branches, independent of its siblings and of this one: a node of
    /// the ray tree, a light of many.
    #[inline]
    #[must_use]
    pub fn branch(&self, key: u32) -> Self {
        let hash = mix(u64::from(self.stream) << 32 | u64::from(key.wrapping_add(1)));
        Self { stream: (hash >> 32) as u32, index: self.index }
    }

    /// Sample `k` of `n` that one node draws at once: consecutive points of the same sequence, so the
    /// samples of a pixel together are as well distributed as n times as many would be.
    #[inline]
    #[must_use]
    pub fn split(&self, k: u32, n: u32) -> Self {
        let index = u64::from(self.index) * u64::from(n) + u64::from(k);
        let (block, index) = (index / u64::from(SEQUENCE), index % u64::from(SEQUENCE));
        let stream =
            if block == 0 { self.stream } else { self.branch(!(block as u32) ^ (1 << 29)).stream };
        Self { stream, index: index as u32 }
    }
}

/// A bijection of 64 bits that spreads every bit over all (the finaliser of SplitMix64, Steele et al.,
/// OOPSLA 2014).
#[inline]
fn mix(mut x: u64) -> u64 {
    x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_replicate_fills_the_square_evenly() {
        for replicate in 0..REPLICATES {
            let mut cells = [0; 64];
            for i in 0..64 {
                let sampler = Sampler::new(5, [17, 3], replicate + REPLICATES * i);
                let [x, y, ..] = sampler.four(Dimensions::Camera);
                cells[(x * 8.0) as usize + 8 * (y * 8.0) as usize] += 1;
            }
            assert_eq!(cells, [1; 64], "a (0, 6, 2)-net has one point in each cell");
        }
    }

    #[test]
    fn splitting_a_sample_goes_on_in_its_sequence() {
        let sampler = |i: u32| Sampler::new(5, [17, 3], REPLICATES * i).branch(7);
        let mut cells = [0; 64];
        for i in 0..16 {
            for k in 0..4 {
                let [x, y, ..] = sampler(i).split(k, 4).four(Dimensions::Light);
                cells[(x * 8.0) as usize + 8 * (y * 8.0) as usize] += 1;
            }
        }
        assert_eq!(cells, [1; 64]);
        let last = Sampler::new(5, [17, 3], REPLICATES * (SEQUENCE - 1));
        assert_ne!(last.split(0, 9), last.split(1, 9));
        assert_ne!(last.branch(0), last.branch(1));
    }

    #[test]
    fn pixels_replicates_and_seeds_differ() {
        let first =
            |seed, pixel, sample| Sampler::new(seed, pixel, sample).four(Dimensions::Camera);
        let base = first(0, [0, 0], 0);
        for other in [
            first(1, [0, 0], 0),
            first(0, [1, 0], 0),
            first(0, [0, 1], 0),
            first(0, [0, 0], 1),
            first(0, [0, 0], REPLICATES * SEQUENCE),
        ] {
            assert_ne!(base, other);
        }
    }
}
