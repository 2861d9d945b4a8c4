//! Where a light is and where it shines to, for whole groups of lights.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use crate::color::Rgb;
use crate::math::Bounds;

/// A bound on the emission of one light or of many.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LightBounds {
    /// Where light leaves from.
    pub(super) bounds: Bounds,
    /// The same as a radius around the centre of `bounds`.
    pub(super) radius: f64,
    /// Normals of surfaces, axes of spots.
    pub(super) cone: Cone,
    /// The angle from a normal beyond which nothing is emitted, at most a quarter turn.
    pub(super) falloff: f64,
    /// About the radiant intensity, averaged over colours, where it is greatest, W/sr.
    pub(super) intensity: f64,
}

/// Directions around an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cone {
    /// Unit vector.
    pub(super) axis: DVec3,
    /// Angle from it, at most π.
    pub(super) half_angle: f64,
}

impl LightBounds {
    /// The bound of both.
    pub(super) fn union(&self, other: &Self) -> Self {
        let bounds = self.bounds.union(other.bounds);
        let center = bounds.center();
        let reach = |b: &Self| b.bounds.center().distance(center) + b.radius;
        Self {
            bounds,
            radius: reach(self).max(reach(other)).min(0.5 * bounds.size().length()),
            cone: self.cone.union(&other.cone),
            falloff: self.falloff.max(other.falloff).min(FRAC_PI_2),
            intensity: self.intensity + other.intensity,
        }
    }
}

impl Cone {
    /// All directions.
    pub(super) const ALL: Self = Self { axis: DVec3::Y, half_angle: PI };

    /// A cone around both: on the great circle of their axes, from the far edge of one to that of the
    /// other. Source: Conty Estevez, Kulla, *Importance Sampling of Many Lights with Adaptive Tree
    /// Splitting*, PACMCGIT 1(2) 2018, algorithm 1.
    pub(super) fn union(&self, other: &Self) -> Self {
        /// Far above what rounding may leave out, far below what matters.
        const SLACK: f64 = 1e-12;
        if self.half_angle >= PI || other.half_angle >= PI {
            return Self::ALL;
        }
        let between = angle_between(self.axis, other.axis);
        if between + other.half_angle <= self.half_angle {
            return *self;
        }
        if between + self.half_angle <= other.half_angle {
            return *other;
        }
        let half_angle = 0.5 * (self.half_angle + between + other.half_angle) + SLACK;
        let across = other.axis - self.axis * self.axis.dot(other.axis);
        match across.try_normalize() {
            Some(across) if half_angle < PI => {
                let (sin, cos) = (half_angle - self.half_angle).sin_cos();
                let axis = (self.axis * cos + across * sin).normalize();
                // What the turn by a rounded direction may leave out.
                let off = angle_between(axis, other.axis) + other.half_angle;
                let off = off.max(angle_between(axis, self.axis) + self.half_angle);
                Self { axis, half_angle: (off + SLACK).min(PI) }
            }
            _ => Self::ALL,
        }
    }
}

/// The angle between two unit vectors, to all digits at 0 and π too.
pub(super) fn angle_between(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

/// One number for a colour: the mean, as errors are counted in each channel alike.
pub(super) fn strength(color: Rgb) -> f64 {
    color.to_array().into_iter().map(f64::from).sum::<f64>() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Directions in either cone are in their union, which is no wider than it must be.
        #[test]
        fn a_union_of_cones_holds_both(
            axes in prop::array::uniform2(prop::array::uniform3(-1f64..1.0)),
            closeness in 0.0f64..12.0,
            angles in prop::array::uniform2(0.0f64..3.2),
            turn in 0.0f64..6.3,
        ) {
            let [a, b] = axes.map(DVec3::from);
            prop_assume!(a.length() > 0.1 && b.length() > 0.1);
            let a = a.normalize();
            let b = (a + b * 10f64.powf(-closeness)).normalize();
            let [a, b] = [(a, angles[0]), (b, angles[1])]
                .map(|(axis, angle)| Cone { axis, half_angle: angle.min(PI) });
            let union = a.union(&b);
            for cone in [a, b] {
                let (x, y) = cone.axis.any_orthonormal_pair();
                let (sin, cos) = cone.half_angle.sin_cos();
                let edge = cone.axis * cos + (x * turn.cos() + y * turn.sin()) * sin;
                prop_assert!(angle_between(union.axis, edge) <= union.half_angle + 1e-9);
            }
            let widest = a.half_angle + b.half_angle + angle_between(a.axis, b.axis);
            prop_assert!(union.half_angle == PI || union.half_angle <= widest + 1e-9);
        }
    }
}
