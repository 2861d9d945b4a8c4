//! Gradient noise and its sums over octaves.
//!
//! Sources: Perlin, *Improving Noise*, SIGGRAPH 2002; octaves that fade as the footprint grows and
//! the sums after pbrt 3ed §10.6.

use glam::DVec3;

/// Most octaves; the finest is then 65,536 times finer than the coarsest.
pub(crate) const MAX_OCTAVES: u32 = 16;

/// Gradient noise: smooth, about one hill or hollow a unit cube, from −1 to 1 (by at most 4 %
/// beyond), 0 at the corners of the cubes. Different seeds are different noises.
pub(crate) fn noise(p: DVec3, seed: u32) -> f64 {
    let cell = p.floor();
    let t = p - cell;
    let [x, y, z] = cell.to_array().map(|c| c as i64);
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let corner = |i: i64, j: i64, k: i64| {
        let hash = hash([x.wrapping_add(i), y.wrapping_add(j), z.wrapping_add(k)], seed);
        slope(hash, t - DVec3::new(i as f64, j as f64, k as f64))
    };
    let edge = |j, k| mix(corner(0, j, k), corner(1, j, k), fade.x);
    let face = |k| mix(edge(0, k), edge(1, k), fade.y);
    mix(face(0), face(1), fade.z)
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// `p` along one of the twelve directions from a cube's centre to the middles of its edges.
fn slope(hash: u32, p: DVec3) -> f64 {
    let which = (u64::from(hash) * 12) >> 32;
    let (a, b) = match which / 4 {
        0 => (p.x, p.y),
        1 => (p.y, p.z),
        _ => (p.z, p.x),
    };
    (if which & 1 == 0 { a } else { -a }) + (if which & 2 == 0 { b } else { -b })
}

/// A number without pattern for a corner of the lattice: it stands for the permutation that others
/// look up in a table, and repeats only after millions of cells.
fn hash([x, y, z]: [i64; 3], seed: u32) -> u32 {
    // Odd constants without structure, then the finaliser of SplitMix64 (Steele et al. 2014).
    let mut h = (x as u64)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add((y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f))
        .wrapping_add((z as u64).wrapping_mul(0xd6e8_feb8_6659_fd93))
        .wrapping_add(u64::from(seed).wrapping_mul(0xa076_1d64_78bd_642f));
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((h ^ (h >> 31)) >> 32) as u32
}

/// How much of a noise with features of size 1 is left under a footprint: all below 0.3, nothing
/// above 0.41, smoothly between (and half a footprint is as fine as pixels can show).
fn left(width: f64) -> f64 {
    let t = ((-1.3 - width.log2()) / 0.4).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// What octave `i` is asked at: twice as fine as the one before, and moved so that the zeros at the
/// corners of all lattices do not meet, at the origin or in planes through it.
fn octave(p: DVec3, i: u32) -> DVec3 {
    // Steps without a short period: Roberts' R3 sequence.
    let shift = DVec3::new(0.819_172_513_4, 0.671_043_606_7, 0.549_700_477_9);
    p * f64::from(1_u32 << i) + f64::from(i + 1) * shift
}

/// Noise in octaves, each twice as fine as the one before and `gain` times as strong, from −1 to 1.
/// What is finer than the footprint is left out.
///
/// The sum is scaled so that its spread is that of a single octave, and cut off at ±1, which few
/// places reach.
pub(crate) fn fbm(p: DVec3, width: f64, octaves: u32, gain: f64, seed: u32) -> f64 {
    let mut sum = 0.0;
    let mut energy = 0.0;
    let mut strength = 1.0;
    for i in 0..octaves.clamp(1, MAX_OCTAVES) {
        energy += strength * strength;
        let left = left(width * f64::from(1_u32 << i));
        if left > 0.0 {
            sum += strength * left * noise(octave(p, i), seed.wrapping_add(i));
        }
        strength *= gain;
    }
    (sum / f64::sqrt(energy)).clamp(-1.0, 1.0)
}

/// The mean of |noise|.
const MEAN_ABS: f64 = 0.22;

/// The size of noise in octaves, each half as strong as the one before: creased, from 0 to 2. What
/// is finer than the footprint is replaced by its mean.
///
/// Source: Perlin, *An Image Synthesizer*, SIGGRAPH 1985.
pub(crate) fn turbulence(p: DVec3, width: f64, octaves: u32, seed: u32) -> f64 {
    let octaves = 0..octaves.clamp(1, MAX_OCTAVES);
    let octaves = octaves.map(|i| {
        let left = left(width * f64::from(1_u32 << i));
        let value =
            if left > 0.0 { noise(octave(p, i), seed.wrapping_add(i)).abs() } else { MEAN_ABS };
        0.5_f64.powi(i as i32) * (left * value + (1.0 - left) * MEAN_ABS)
    });
    octaves.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points without order, in a cube of edge 200 about the origin.
    fn points(n: u32) -> impl Iterator<Item = DVec3> {
        let number = |i: u32, k| f64::from(hash([i64::from(i), k, 7], 99)) / f64::from(u32::MAX);
        (0..n).map(move |i| DVec3::new(number(i, 0), number(i, 1), number(i, 2)) * 200.0 - 100.0)
    }

    fn mean_and_spread(n: u32, f: impl Fn(DVec3) -> f64) -> (f64, f64) {
        let values: Vec<f64> = points(n).map(f).collect();
        let mean = values.iter().sum::<f64>() / f64::from(n);
        let square = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
        (mean, (square / f64::from(n)).sqrt())
    }

    #[test]
    fn in_range_and_without_bias() {
        for p in points(50_000) {
            assert!(noise(p, 1).abs() < 1.04, "{p}");
            assert!(fbm(p, 0.0, 6, 0.6, 1).abs() <= 1.0);
            assert!((0.0..2.08).contains(&turbulence(p, 0.0, 6, 1)));
        }
        for (octaves, seed) in [(1, 0), (6, 3)] {
            let (mean, spread) = mean_and_spread(50_000, |p| fbm(p, 0.0, octaves, 0.5, seed));
            assert!(mean.abs() < 0.01, "{mean}");
            assert!((0.2..0.35).contains(&spread), "{spread}");
        }
        let (mean, _) = mean_and_spread(100_000, |p| noise(p, 5).abs());
        assert!((mean - MEAN_ABS).abs() < 0.005, "{mean}");
    }

    #[test]
    fn continuous_with_its_slope() {
        // Across faces of the lattice, values and slopes go on.
        for p in points(2000) {
            let p = DVec3::new(p.x.round(), p.y, p.z);
            let step = DVec3::X * 1e-4;
            let [a, b, c] = [p - step, p, p + step].map(|p| noise(p, 2));
            assert!((c - b).abs() < 1e-3 && (b - a).abs() < 1e-3);
            assert!(((c - b) - (b - a)).abs() < 1e-6, "{p}: {a} {b} {c}");
        }
    }

    #[test]
    fn seeds_differ_and_nothing_repeats_soon() {
        let (product, spread) = mean_and_spread(5000, |p| noise(p, 1) * noise(p, 2));
        assert!(product.abs() < 5.0 * spread / 5000_f64.sqrt());
        for period in [256.0, 1024.0, 65536.0] {
            let (product, spread) =
                mean_and_spread(5000, |p| noise(p, 1) * noise(p + DVec3::X * period, 1));
            assert!(product.abs() < 5.0 * spread / 5000_f64.sqrt(), "{period}");
        }
    }

    #[test]
    fn fades_under_wide_footprints() {
        let spread = |width| mean_and_spread(5000, |p| fbm(p, width, 8, 0.5, 1)).1;
        let spreads = [0.0, 0.02, 0.1, 0.35, 0.5].map(spread);
        assert!(spreads.is_sorted_by(|a, b| a >= b), "{spreads:?}");
        assert_eq!(spreads[4], 0.0);
        // Turbulence fades to its mean.
        let (mean, _) = mean_and_spread(20_000, |p| turbulence(p, 0.0, 8, 1));
        let (faded, spread) = mean_and_spread(100, |p| turbulence(p, 1.0, 8, 1));
        assert!((mean - faded).abs() < 0.02 && spread < 1e-12, "{mean} {faded}");
    }

    #[test]
    fn far_points_are_finite() {
        for x in [1e10, 1e30, -1e100] {
            assert!(fbm(DVec3::splat(x), 0.0, 20, 0.5, 1).is_finite());
        }
    }
}
