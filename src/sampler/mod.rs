//! Numbers in [0, 1) as a pure function of (seed, pixel, sample, dimension): no state, so any sample
//! can be drawn again, on any thread and in any part of a render.
//!
//! Sample `i` of a pixel belongs to replicate `i mod R`. Each replicate is an Owen-scrambled Sobol
//! sequence of its own (Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4) 2020), independent
//! of the others: from the spread of the replicates' means follows an error that is true, where the
//! spread of single samples would overstate it many times (see [`crate::film`]).

/// Replicates of a pixel. Fewer cost less convergence, more give a surer error.
pub const REPLICATES: u32 = 4;

/// The generator's longest sequence; beyond it a new one starts.
const SEQUENCE: u32 = 1 << 16;

/// What a number is used for. Each use has its own four dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimensions {
    /// Position in the pixel (first two) and on the lens (last two).
    Camera,
}

/// The numbers of one sample of one pixel.
#[derive(Debug, Clone, Copy)]
pub struct Sampler {
    /// Hash of seed, pixel and replicate.
    stream: u32,
    /// Index within the replicate's sequence.
    index: u32,
}

impl Sampler {
    /// The sampler of sample `sample` of the pixel at absolute coordinates `(x, y)`.
    #[inline]
    pub fn new(seed: u64, [x, y]: [u32; 2], sample: u32) -> Self {
        let (replicate, index) = (sample % REPLICATES, sample / REPLICATES);
        let pixel = u64::from(x) | u64::from(y) << 32;
        let stream = u64::from(replicate) | u64::from(index / SEQUENCE) << 32;
        let hash = mix(mix(mix(seed ^ 0x9e37_79b9_7f4a_7c15) ^ pixel) ^ stream);
        Self { stream: (hash >> 32) as u32, index: index % SEQUENCE }
    }

    /// Four numbers in [0, 1) for one use, well distributed over the samples of a replicate.
    #[inline]
    pub fn four(&self, dimensions: Dimensions) -> [f32; 4] {
        sobol_burley::sample_4d(self.index, dimensions as u32, self.stream)
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
