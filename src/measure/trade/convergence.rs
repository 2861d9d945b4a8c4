//! How the error falls with the number of samples.

use serde::Serialize;

use super::Point;

/// The power of a fit.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Slope {
    /// Of the squared error by the number of samples: −1 for independent samples.
    pub power: f64,
    /// Half the width of its 95 % interval.
    pub plus_minus: f64,
}

/// Numbers of samples beside the scene's own: powers of four, as far as the reference tells them apart.
pub(super) fn numbers_of_samples(own: u32, reference: u32) -> Vec<u32> {
    let powers = (0..12).map(|power| 1u32 << (2 * power));
    powers
        .take_while(|n| *n <= (reference / 4).max(own).min(64 * own))
        .filter(|n| *n != own)
        .collect()
}

/// A line through the logarithms of squared error and number of samples; none with fewer than three points.
pub(super) fn slope<'a>(points: impl Iterator<Item = &'a Point>) -> Option<Slope> {
    // Without what a bias holds back.
    let known = points.filter(|p| p.error > 0.0 && p.bias.is_none());
    fit(&known.map(|p| [f64::from(p.samples), p.error.powi(2)]).collect::<Vec<_>>())
}

/// Of samples and squared errors.
fn fit(points: &[[f64; 2]]) -> Option<Slope> {
    let points: Vec<[f64; 2]> = points.iter().map(|p| p.map(f64::ln)).collect();
    let n = points.len() as f64;
    if points.len() < 3 {
        return None;
    }
    let mean = [0, 1].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / n);
    let sum = |a: usize, b: usize| {
        points.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>()
    };
    let power = sum(0, 1) / sum(0, 0);
    let residual = (sum(1, 1) - power * sum(0, 1)).max(0.0) / (n - 2.0);
    Some(Slope { power, plus_minus: student(points.len() - 2) * (residual / sum(0, 0)).sqrt() })
}

/// Student's t for a two-sided 95 % interval.
fn student(degrees: usize) -> f64 {
    const TABLE: [f64; 10] = [12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];
    TABLE.get(degrees.wrapping_sub(1)).copied().unwrap_or(2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_is_found_and_its_interval_is_that_of_the_scatter() {
        let points: Vec<[f64; 2]> =
            [1.0f64, 4.0, 16.0, 64.0].iter().map(|n| [*n, 0.3 * n.powf(-1.2)]).collect();
        let found = fit(&points).unwrap();
        assert!((found.power + 1.2).abs() < 1e-12 && found.plus_minus < 1e-6, "{found:?}");
        assert!(fit(&points[..2]).is_none());

        // By hand: x = 0, 1, 2 and y = 0, -2, -2 in logarithms. The slope is -1, residuals are -1/3, 2/3,
        // -1/3; their squares sum to 2/3, of one degree of freedom, and those of x to 2.
        let points = [[0.0f64, 0.0], [1.0, -2.0], [2.0, -2.0]].map(|p| p.map(f64::exp));
        let found = fit(&points).unwrap();
        let expected = 12.71 * (2.0f64 / 3.0 / 2.0).sqrt();
        assert!((found.power + 1.0).abs() < 1e-12, "{found:?}");
        assert!((found.plus_minus - expected).abs() < 1e-9, "{found:?} {expected}");
    }

    #[test]
    fn numbers_of_samples_end_where_the_reference_cannot_tell() {
        assert_eq!(numbers_of_samples(16, 256), [1, 4, 64]);
        assert_eq!(numbers_of_samples(3, 1024), [1, 4, 16, 64]);
    }
}
