//! Two pictures channel by channel: for what is not a colour, layers of depth, normals, ids.

/// How far a channel is from that of a reference. Means run over pixels where both are finite; every number
/// is NaN where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelComparison {
    /// Pixels that are NaN or infinite in one of the two at least, and not the same infinity in both.
    pub non_finite: u64,
    /// Mean of (a − b)².
    pub mse: f64,
    /// Mean of |a − b|.
    pub mae: f64,
    /// Mean of (a − b)² / (b² + 0.01), where b is the reference.
    pub rel_mse: f64,
    /// The largest |a − b|.
    pub largest: f64,
    /// The pixel that it is at, right of and below the first.
    pub largest_at: [u32; 2],
}

/// Compares the values of a channel with those of a reference, row by row of `width` pixels.
pub fn compare_channel(a: &[f32], b: &[f32], width: u32) -> ChannelComparison {
    let (mut pixels, mut non_finite) = (0u64, 0u64);
    let (mut square, mut absolute, mut relative) = (0.0, 0.0, 0.0);
    let mut largest = (0.0f64, 0usize);
    for (i, (&a, &b)) in a.iter().zip(b).enumerate() {
        if !(a.is_finite() && b.is_finite()) {
            non_finite += u64::from(a != b);
            continue;
        }
        let (a, b) = (f64::from(a), f64::from(b));
        let d = a - b;
        pixels += 1;
        square += d * d;
        absolute += d.abs();
        relative += d * d / (b * b + 0.01);
        if d.abs() > largest.0 {
            largest = (d.abs(), i);
        }
    }
    let mean = |sum: f64| sum / pixels as f64;
    let width = width.max(1) as usize;
    ChannelComparison {
        non_finite,
        mse: mean(square),
        mae: mean(absolute),
        rel_mse: mean(relative),
        largest: if pixels == 0 { f64::NAN } else { largest.0 },
        largest_at: [(largest.1 % width) as u32, (largest.1 / width) as u32],
    }
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
        assert_eq!((found.mse, found.mae, found.non_finite), (5.0 / 4.0, 3.0 / 4.0, 1));
        assert!((found.rel_mse - (1.0 / 1.01 + 4.0 / 25.01) / 4.0).abs() < 1e-12);
        assert_eq!((found.largest, found.largest_at), (2.0, [2, 1]));
        assert!(compare_channel(&[f32::NAN], &[1.0], 1).mse.is_nan());
    }
}
