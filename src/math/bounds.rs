//! Axis-aligned boxes in f64.

use glam::{DAffine3, DVec3};

/// An axis-aligned box. Empty where a minimum exceeds its maximum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least coordinates.
    pub min: DVec3,
    /// Greatest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The smallest box around `points`.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::including)
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box around it and a point.
    #[inline]
    pub fn including(self, p: DVec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// Whether it holds nothing.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether it holds something, and has an end along every axis.
    pub fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// The middle; the origin for an empty box.
    pub fn center(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * (self.min + self.max) }
    }

    /// Side lengths; zero for an empty box.
    pub fn size(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { self.max - self.min }
    }

    /// The eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick =
                |axis: usize| if i >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
            DVec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// The smallest box around the transformed box.
    pub fn transformed(&self, m: &DAffine3) -> Self {
        if self.is_empty() {
            return *self;
        }
        Self::of(self.corners().map(|p| m.transform_point3(p)))
    }

    /// The box moved by `by`.
    pub fn translated(&self, by: DVec3) -> Self {
        Self { min: self.min + by, max: self.max + by }
    }

    /// What to subtract from coordinates in the box before they are rounded to f32: zero, unless they
    /// are far from the origin compared with their extent and would lose digits; then about the
    /// centre, rounded so coarsely that subtracting it from an f32 is exact.
    pub fn far_center(&self) -> DVec3 {
        /// Nearer than this many extents f32 loses four bits at most, and nothing is moved.
        const FAR: f64 = 16.0;
        if self.is_empty() {
            return DVec3::ZERO;
        }
        let extent = self.size().max_element();
        let reach = self.min.abs().max(self.max.abs()).max_element();
        if reach <= FAR * extent {
            return DVec3::ZERO;
        }
        let unit = extent.max(reach * f64::from(f32::EPSILON)).log2().ceil().exp2();
        // Denormal coordinates are as good as zero.
        if unit == 0.0 { DVec3::ZERO } else { (self.center() / unit).round() * unit }
    }

    /// Where the line `origin + t·direction` is inside: (t at entry, t at exit), if anywhere.
    /// Each slab is `(bound − origin)/direction`, subtracted first, as the product form cancels far
    /// from the origin. Along a face counts as inside.
    pub fn clip(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64)> {
        let (mut enter, mut exit) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            if direction[axis] == 0.0 {
                if origin[axis] < self.min[axis] || origin[axis] > self.max[axis] {
                    return None;
                }
                continue;
            }
            let a = (self.min[axis] - origin[axis]) / direction[axis];
            let b = (self.max[axis] - origin[axis]) / direction[axis];
            enter = enter.max(a.min(b));
            exit = exit.min(a.max(b));
        }
        (enter <= exit && exit >= 0.0).then_some((enter, exit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clip_finds_entry_and_exit() {
        let b = Bounds { min: DVec3::ZERO, max: DVec3::ONE };
        let at = |o: [f64; 3], d: [f64; 3]| b.clip(DVec3::from(o), DVec3::from(d));
        assert_eq!(at([-1.0, 0.5, 0.5], [1.0, 0.0, 0.0]), Some((1.0, 2.0)));
        assert_eq!(at([0.5, 0.5, 0.5], [0.0, 0.0, 2.0]), Some((-0.25, 0.25)));
        assert_eq!(at([-1.0, 2.0, 0.5], [1.0, 0.0, 0.0]), None);
        assert_eq!(at([2.0, 0.5, 0.5], [1.0, 0.0, 0.0]), None, "behind");
        // Along a face: inside, whatever the sign of zero.
        assert!(at([-1.0, 0.0, 1.0], [1.0, 0.0, -0.0]).is_some());
    }

    #[test]
    fn a_mirrored_box_stays_a_box() {
        let b = Bounds { min: DVec3::ZERO, max: DVec3::new(1.0, 2.0, 3.0) };
        let m = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 2.0));
        let expected = Bounds { min: DVec3::new(-1.0, 0.0, 0.0), max: DVec3::new(0.0, 2.0, 6.0) };
        assert_eq!(b.transformed(&m), expected);
        assert!(Bounds::EMPTY.transformed(&m).is_empty());
    }

    #[test]
    fn near_things_stay_where_they_are() {
        let near = Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(15.0) };
        assert_eq!(near.far_center(), DVec3::ZERO);
        let far = near.translated(DVec3::new(1e7, 0.0, -3e6));
        let center = far.far_center();
        assert!((far.center() - center).abs().max_element() <= 8.0);
        // Subtraction is exact for any f32 in the box.
        for x in [1e7f32 - 1.0, 1e7 + 3.0, 1e7 + 15.0] {
            let moved = f64::from(x) - center.x;
            assert_eq!(f64::from(moved as f32), moved);
        }
    }
}
