//! Colours along a line.

use std::sync::Arc;

use glam::DVec3;

use crate::color::Rgb;

/// Colours at places along a line, linear between them and constant beyond them. Two colours at one
/// place are a sharp edge.
#[derive(Debug, Clone, PartialEq)]
pub struct Ramp {
    /// In order; never empty.
    stops: Arc<[Stop]>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Stop {
    at: f64,
    color: DVec3,
}

impl Ramp {
    /// From places and colours in any order; those at one place keep theirs.
    ///
    /// `None` where there are none, or where a number is NaN or infinite.
    pub fn new(stops: &[(f32, Rgb)]) -> Option<Self> {
        if stops.is_empty() || !stops.iter().all(|(at, color)| at.is_finite() && color.is_finite())
        {
            return None;
        }
        let stop = |&(at, color): &(f32, Rgb)| Stop {
            at: f64::from(at),
            color: DVec3::from_array(color.to_array().map(f64::from)),
        };
        let mut stops: Vec<Stop> = stops.iter().map(stop).collect();
        stops.sort_by(|a, b| a.at.total_cmp(&b.at));
        Some(Self { stops: stops.into() })
    }

    /// Colours at equal distances from 0 to 1; `None` as for [`Self::new`].
    pub fn even(colors: &[Rgb]) -> Option<Self> {
        let last = (colors.len().max(2) - 1) as f32;
        let stops = colors.iter().enumerate().map(|(i, &color)| (i as f32 / last, color));
        Self::new(&stops.collect::<Vec<_>>())
    }

    /// The colour at `t`, averaged over `width`.
    pub(super) fn color(&self, t: f64, width: f64) -> Rgb {
        Rgb::from(self.mean(t, width).as_vec3().to_array())
    }

    /// The luminance at `t`, averaged over `width`, in f64 for differences.
    pub(super) fn luminance(&self, t: f64, width: f64) -> f64 {
        luminance(self.mean(t, width))
    }

    fn mean(&self, t: f64, width: f64) -> DVec3 {
        if !(width > 1e-9) {
            return self.at(t);
        }
        let (low, high) = (t - width / 2.0, t + width / 2.0);
        // Each piece is linear, so it has the mean of its middle.
        let piece = |from: f64, to: f64, value: &dyn Fn(f64) -> DVec3| {
            let (from, to) = (from.max(low), to.min(high));
            if from < to { value((from + to) / 2.0) * (to - from) } else { DVec3::ZERO }
        };
        let (first, last) = (self.stops[0], self.stops[self.stops.len() - 1]);
        let mut sum =
            piece(low, first.at, &|_| first.color) + piece(last.at, high, &|_| last.color);
        for pair in self.stops.windows(2) {
            sum += piece(pair[0].at, pair[1].at, &|t| between(pair[0], pair[1], t));
        }
        sum / (high - low)
    }

    fn at(&self, t: f64) -> DVec3 {
        let after = self.stops.partition_point(|stop| stop.at <= t);
        match (after.checked_sub(1), self.stops.get(after)) {
            (Some(before), Some(&after)) => between(self.stops[before], after, t),
            (Some(before), None) => self.stops[before].color,
            (None, _) => self.stops[0].color,
        }
    }
}

/// Between two stops at different places.
fn between(a: Stop, b: Stop, t: f64) -> DVec3 {
    a.color.lerp(b.color, (t - a.at) / (b.at - a.at))
}

/// Luminance as [`Rgb::luminance`] has it.
pub(super) fn luminance(color: DVec3) -> f64 {
    DVec3::new(0.2126, 0.7152, 0.0722).dot(color)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_between_constant_beyond() {
        let ramp = Ramp::new(&[(3.0, Rgb::splat(1.0)), (1.0, Rgb::new(0.2, 0.4, 0.6))]).unwrap();
        assert_eq!(ramp.color(-5.0, 0.0), Rgb::new(0.2, 0.4, 0.6));
        assert_eq!(ramp.color(1.0, 0.0), Rgb::new(0.2, 0.4, 0.6));
        assert!((ramp.color(2.0, 0.0).g - 0.7).abs() < 1e-6);
        assert_eq!(ramp.color(3.0, 0.0), Rgb::splat(1.0));
        assert_eq!(ramp.color(f64::INFINITY, 0.0), Rgb::splat(1.0));
        assert!((ramp.luminance(9.0, 0.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn means_are_those_of_many_points() {
        let grey = |at, x| (at, Rgb::splat(x));
        let stops =
            [grey(0.0, 0.1), grey(0.5, 0.9), grey(0.5, 0.0), grey(0.8, 0.0), grey(1.0, 2.0)];
        let ramp = Ramp::new(&stops).unwrap();
        for (t, width) in [(0.5, 0.3), (-1.0, 0.5), (0.9, 4.0), (0.2, 0.01), (2.0, 0.1)] {
            let n = 20_000;
            let point = |i| t + width * ((f64::from(i) + 0.5) / f64::from(n) - 0.5);
            let sum: f64 = (0..n).map(|i| ramp.luminance(point(i), 0.0)).sum();
            let mean = ramp.luminance(t, width);
            assert!((mean - sum / f64::from(n)).abs() < 1e-4, "{t} {width}: {mean}");
        }
    }

    #[test]
    fn even_spacing_and_refusals() {
        let [a, b, c] = [0.0, 0.5, 0.3].map(Rgb::splat);
        let ramp = Ramp::even(&[a, b, c]).unwrap();
        assert_eq!([0.0, 0.5, 1.0].map(|t| ramp.color(t, 0.0)), [a, b, c]);
        assert_eq!(Ramp::even(&[b]).unwrap().color(0.3, 0.0), b);
        assert!(Ramp::even(&[]).is_none());
        assert!(Ramp::new(&[(f32::NAN, a)]).is_none());
    }
}
