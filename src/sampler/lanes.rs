//! The numbers of several pixels at once, side by side: loops over lanes, which the compiler turns into
//! vector instructions.

use std::sync::LazyLock;

use sobol_burley::parts::{hash, owen_scramble_rev, sobol_rev, u32_to_f32_norm};

use super::{Dimensions, Sampler};

/// What the two highest bytes of an index, bits reversed, add to the third and the fourth dimension, by their
/// values: the Sobol matrices. They are linear, so the generator itself tells the parts; it takes no lower bits.
static TABLES: LazyLock<[[[u32; 2]; 256]; 2]> = LazyLock::new(|| {
    let entry = |bits: u32| std::array::from_fn(|d| sobol_rev(bits, 2 + d as u32));
    [24, 16].map(|shift| std::array::from_fn(|byte| entry((byte as u32) << shift)))
});

/// The second dimension, bits reversed, of an index of sixteen bits. As polynomials over GF(2), highest powers last,
/// column i of its matrix is (1 + x)ⁱ: the index with 1 + x in the place of x, half by half.
#[inline(always)]
const fn second_rev(index: u32) -> u32 {
    let mut x = index;
    x ^= x >> 8 & 0x00ff_00ff;
    x ^= x >> 4 & 0x0f0f_0f0f;
    x ^= x >> 2 & 0x3333_3333;
    x ^ x >> 1 & 0x5555_5555
}

impl Sampler {
    /// The first `D` of [`Sampler::four`] for `N` samplers, by dimension.
    #[inline(always)]
    pub fn numbers<const D: usize, const N: usize>(
        samplers: &[Self; N],
        dimensions: Dimensions,
    ) -> [[f32; N]; D] {
        // The algorithm of `sobol_burley::sample`, whose scrambles these are.
        const SCRAMBLES: [u32; 4] = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8];
        // In a loop of its own: one that picks fields out of structures does not become vector instructions.
        let (mut seeds, mut index) = ([0; N], [0; N]);
        for (i, sampler) in samplers.iter().enumerate() {
            (seeds[i], index[i]) = (sampler.stream_of(dimensions), sampler.index);
        }
        for i in 0..N {
            index[i] = owen_scramble_rev(index[i].reverse_bits(), hash(seeds[i] ^ 0x79c6_8e4a));
        }
        let mut sobol = [[0u32; N]; D];
        // The first two without a table: their matrices are those of a reversal and of Pascal's triangle.
        let low: [u32; N] = std::array::from_fn(|i| (index[i] & 0xffff_0000).reverse_bits());
        for (d, sobol) in sobol.iter_mut().enumerate().take(2) {
            for i in 0..N {
                sobol[i] = if d == 0 { low[i] } else { second_rev(low[i]) };
            }
        }
        if D > 2 {
            let [high, low] = &*TABLES;
            for i in 0..N {
                let [a, b, ..] = index[i].to_be_bytes();
                let (a, b) = (&high[a as usize], &low[b as usize]);
                for d in 2..D {
                    sobol[d][i] = a[d - 2] ^ b[d - 2];
                }
            }
        }
        let mut numbers = [[0.0; N]; D];
        for d in 0..D {
            for i in 0..N {
                let scramble = hash(seeds[i].wrapping_mul(0x9c8f_2d3b) ^ SCRAMBLES[d]);
                let scrambled = owen_scramble_rev(sobol[d][i], scramble);
                numbers[d][i] = u32_to_f32_norm(scrambled.reverse_bits());
            }
        }
        numbers
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_the_numbers_of_each() {
        for sample in [0, 1, 5, 77, 4096, 262_143, 262_144] {
            for dimensions in [Dimensions::Camera, Dimensions::Light] {
                let samplers: [Sampler; 16] =
                    std::array::from_fn(|i| Sampler::new(9, [3 * i as u32, 7 + i as u32], sample));
                let numbers = Sampler::numbers::<4, 16>(&samplers, dimensions);
                let two = Sampler::numbers::<2, 16>(&samplers, dimensions);
                for (i, sampler) in samplers.iter().enumerate() {
                    assert_eq!(numbers.map(|n| n[i]), sampler.four(dimensions));
                    assert_eq!(two.map(|n| n[i]), sampler.four(dimensions)[..2]);
                }
            }
        }
    }
}
