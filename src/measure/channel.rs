//! Two pictures channel by channel: for what is not a colour, layers of depth, normals, ids.

/// How far a channel, or a layer of several, is from that of a reference. Means run over values where both
/// are finite; every number is NaN where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelComparison {
    /// Values that are finite in both.
    pub count: u64,
    /// Values that are NaN or infinite in one of the two at least, and not the same infinity in both.
    pub non_finite: u64,
    /// Mean of (a − b)².
    pub mse: f64,
    /// Mean of |a − b|.
    pub mae: f64,
    /// Mean of (a − b)² / (b² + 0.01), where b is the reference.
    pub rel_mse: f64,
    /// 10 log₁₀(1 / mean squared error) in decibels, of both clipped to [0, 1]; infinite where they are then
    /// equal.
    pub psnr: f64,
    /// The largest |a − b|.
    pub largest: f64,
    /// The pixel that it is at, right of and below the first.
    pub largest_at: [u32; 2],
}

/// Sums over values that are finite in both.
#[derive(Clone, Copy)]
pub(super) struct Sums {
    pub(super) count: u64,
    square: f64,
    absolute: f64,
    relative: f64,
    /// Squared, of both clipped to [0, 1].
    clipped: f64,
    /// The largest difference and the index of its pixel.
    largest: (f64, usize),
}

impl Sums {
    pub(super) const NONE: Self = Self {
        count: 0,
        square: 0.0,
        absolute: 0.0,
        relative: 0.0,
        clipped: 0.0,
        largest: (0.0, 0),
    };

    /// Adds a value of the pixel `index` and that of the reference.
    pub(super) fn add(&mut self, index: usize, a: f32, b: f32) {
        let (a, b) = (f64::from(a), f64::from(b));
        let d = a - b;
        self.count += 1;
        self.square += d * d;
        self.absolute += d.abs();
        self.relative += d * d / (b * b + 0.01);
        self.clipped += (a.clamp(0.0, 1.0) - b.clamp(0.0, 1.0)).powi(2);
        if d.abs() > self.largest.0 {
            self.largest = (d.abs(), index);
        }
    }

    pub(super) fn join(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            square: self.square + other.square,
            absolute: self.absolute + other.absolute,
            relative: self.relative + other.relative,
            clipped: self.clipped + other.clipped,
            largest: if other.largest.0 > self.largest.0 { other.largest } else { self.largest },
        }
    }

    /// What they come to, row by row of `width` pixels.
    pub(super) fn compared(&self, non_finite: u64, width: u32) -> ChannelComparison {
        let mean = |sum: f64| sum / self.count as f64;
        ChannelComparison {
            count: self.count,
            non_finite,
            mse: mean(self.square),
            mae: mean(self.absolute),
            rel_mse: mean(self.relative),
            psnr: -10.0 * mean(self.clipped).log10(),
            largest: if self.count == 0 { f64::NAN } else { self.largest.0 },
            largest_at: pixel(self.largest.1, width),
        }
    }
}

/// Compares the values of a channel with those of a reference, row by row of `width` pixels.
pub fn compare_channel(a: &[f32], b: &[f32], width: u32) -> ChannelComparison {
    let (mut sums, mut non_finite) = (Sums::NONE, 0);
    for (i, (&a, &b)) in a.iter().zip(b).enumerate() {
        if a.is_finite() && b.is_finite() {
            sums.add(i, a, b);
        } else {
            non_finite += u64::from(a != b);
        }
    }
    sums.compared(non_finite, width)
}

/// What the channels of a layer come to together.
pub fn compare_layer(channels: &[ChannelComparison]) -> ChannelComparison {
    // An empty channel has nothing to say, and its means are NaN.
    let known = || channels.iter().filter(|c| c.count > 0);
    let count: u64 = known().map(|c| c.count).sum();
    let mean = |of: &dyn Fn(&ChannelComparison) -> f64| {
        known().map(|c| of(c) * c.count as f64).sum::<f64>() / count as f64
    };
    let largest = known().max_by(|a, b| a.largest.total_cmp(&b.largest));
    ChannelComparison {
        count,
        non_finite: channels.iter().map(|c| c.non_finite).sum(),
        mse: mean(&|c| c.mse),
        mae: mean(&|c| c.mae),
        rel_mse: mean(&|c| c.rel_mse),
        psnr: -10.0 * mean(&|c| 10f64.powf(-0.1 * c.psnr)).log10(),
        largest: largest.map_or(f64::NAN, |c| c.largest),
        largest_at: largest.map_or([0, 0], |c| c.largest_at),
    }
}

/// How many values are not the same to the last bit, and the first pixel where they are not: for ids, which
/// are names and not numbers.
pub fn count_differing(a: &[f32], b: &[f32], width: u32) -> (u64, [u32; 2]) {
    let mut differing =
        a.iter().zip(b).enumerate().filter(|(_, (a, b))| a.to_bits() != b.to_bits());
    let first = differing.next();
    let count = u64::from(first.is_some()) + differing.count() as u64;
    (count, pixel(first.map_or(0, |(i, _)| i), width))
}

fn pixel(index: usize, width: u32) -> [u32; 2] {
    let width = width.max(1) as usize;
    [(index % width) as u32, (index / width) as u32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_compared_where_both_are_finite() {
        let a = [1.0, 2.0, f32::NAN, f32::INFINITY, 0.5, 3.0];
        let b = [1.0, 1.0, 1.0, f32::INFINITY, 0.5, 5.0];
        let found = compare_channel(&a, &b, 3);
        // Of four pixels two differ, by 1 and by 2.
        assert_eq!((found.count, found.non_finite), (4, 1));
        assert_eq!((found.mse, found.mae), (5.0 / 4.0, 3.0 / 4.0));
        assert!((found.rel_mse - (1.0 / 1.01 + 4.0 / 25.01) / 4.0).abs() < 1e-12);
        assert_eq!((found.largest, found.largest_at), (2.0, [2, 1]));
        // Clipped to [0, 1] they are the same.
        assert_eq!(found.psnr, f64::INFINITY);
        assert!(compare_channel(&[f32::NAN], &[1.0], 1).mse.is_nan());
    }

    /// A layer is what one channel with the values of all of them would be.
    #[test]
    fn layers_are_their_channels_together() {
        let (a, b) = ([0.1, 0.9, f32::NAN, 0.3], [0.2, 0.5, 0.0, 0.3]);
        let (c, d) = ([5.0, f32::NAN, f32::NAN, f32::NAN], [4.0; 4]);
        let together = compare_layer(&[
            compare_channel(&a, &b, 2),
            compare_channel(&c, &d, 2),
            compare_channel(&[f32::NAN; 4], &d, 2),
        ]);
        let joined = |x: &[f32], y: &[f32]| [x, y, &[f32::NAN; 4]].concat();
        let whole = compare_channel(&joined(&a, &c), &joined(&b, &d), 2);
        assert_eq!((together.count, together.non_finite), (4, 8));
        assert_eq!((whole.count, whole.non_finite), (4, 4 + 4));
        for (x, y) in [
            (together.mse, whole.mse),
            (together.mae, whole.mae),
            (together.rel_mse, whole.rel_mse),
            (together.psnr, whole.psnr),
            (together.largest, whole.largest),
        ] {
            assert!((x - y).abs() < 1e-9, "{x} {y}");
        }
    }

    #[test]
    fn ids_are_the_same_or_not() {
        let a = [1.0, 2.0, 3.0, f32::NAN];
        assert_eq!(count_differing(&a, &a, 2), (0, [0, 0]));
        assert_eq!(count_differing(&a, &[1.0, 2.0, 3.0f32.next_up(), 0.0], 2), (2, [0, 1]));
    }
}
