//! A node in 32 bytes, and how much may arrive from it.

use glam::{DVec3, Vec3};

use super::super::bounds::{LightBounds, angle_between};

/// A bound on a group of lights. What is rounded is rounded outward.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Node {
    center: Vec3,
    /// Every light is this near to the centre.
    radius: f32,
    /// As [`LightBounds::intensity`], > 0.
    intensity: f32,
    /// The cone's axis, folded to a square.
    axis: [i16; 2],
    /// The cosines of the cone's angle and of the falloff, from −1 (0) to 1 (65,535).
    cosines: [u16; 2],
    /// The right child; with the highest bit set, the light.
    link: u32,
}

const LEAF: u32 = 1 << 31;

impl Node {
    /// The leaf of light `index`.
    pub(super) fn leaf(bounds: &LightBounds, index: u32) -> Self {
        Self::new(bounds, index | LEAF)
    }

    /// The node whose right child is `right`; the left one follows it.
    pub(super) fn inner(bounds: &LightBounds, right: u32) -> Self {
        Self::new(bounds, right)
    }

    fn new(bounds: &LightBounds, link: u32) -> Self {
        let exact = bounds.bounds.center();
        let center = exact.as_vec3();
        let radius = bounds.radius * (1.0 + 1e-6) + exact.distance(center.as_dvec3());
        let intensity = bounds.intensity.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX));
        let axis = fold(bounds.cone.axis);
        let half_angle = bounds.cone.half_angle + angle_between(bounds.cone.axis, unfold(axis));
        Self {
            center,
            radius: (radius as f32).next_up(),
            intensity: intensity as f32,
            axis,
            cosines: [half_angle, bounds.falloff].map(cosine_below),
            link,
        }
    }

    /// The light, if it is a leaf.
    #[inline]
    pub(super) fn light(&self) -> Option<u32> {
        (self.link & LEAF != 0).then_some(self.link & !LEAF)
    }

    /// The right child of a node that is no leaf.
    #[inline]
    pub(super) fn right(&self) -> u32 {
        self.link
    }

    /// About the irradiance at `p`, on the side of `n` if given. Above zero, and finite, wherever a light
    /// of the node sends anything to.
    ///
    /// I·cosθ·cosθᵢ/d². The angle of emission θ is the least that the bound allows: from the axis, less
    /// that of the cone and that which the sphere around the lights fills. For the angle of incidence the
    /// cosine is the mean of the greatest and the least that the sphere allows, and 1/d² is a mean too:
    /// with the bounds alone, nodes that `p` is in or near would be drawn far too often.
    #[inline]
    pub(super) fn importance(&self, p: DVec3, n: Option<DVec3>) -> f64 {
        /// Directions are rounded: light from a little below the horizon counts.
        const SLACK: f64 = 1e-5;
        /// A grazing angle's weight: bounds are loose, and its light may be all there is.
        const LEAST: f64 = 1e-2;
        /// The cosine of incidence of lights all around, half of them below the horizon.
        const AROUND: f64 = 0.4;
        let to_center = self.center.as_dvec3() - p;
        let d2 = to_center.length_squared();
        let r2 = f64::from(self.radius) * f64::from(self.radius);
        let mut importance = f64::from(self.intensity) * mean_inverse_square(d2, 0.5 * r2);
        if d2 <= r2 {
            return if n.is_some() { importance * AROUND } else { importance };
        }
        let direction = to_center / d2.sqrt();
        let sphere = Angle { cos: (1.0 - r2 / d2).sqrt(), sin: (r2 / d2).sqrt() };
        let [cos_cone, cos_falloff] = self.cosines.map(cosine);
        if cos_cone > -1.0 {
            let from_axis = Angle::of_cos(-unfold(self.axis).dot(direction));
            let emission = from_axis.less(Angle::of_cos(cos_cone)).less(sphere);
            if emission.cos < cos_falloff - SLACK {
                return 0.0;
            }
            importance *= emission.cos.max(LEAST);
        }
        if let Some(n) = n {
            let incidence = Angle::of_cos(n.dot(direction));
            let greatest = incidence.less(sphere).cos;
            if greatest < -SLACK {
                return 0.0;
            }
            // Where it is below the horizon it is none, also past π.
            let least =
                if incidence.cos > 0.0 { incidence.cos_of_sum(sphere).max(0.0) } else { 0.0 };
            importance *= (0.5 * (greatest + least)).max(LEAST);
        }
        importance
    }
}

/// About the mean of 1/x² for distances x to points of a ball of squared radius `e2`, from a point at
/// the squared distance `d2` of its centre; exact to a tenth.
///
/// The mean is 3/(4e²)·(2 + (1 − s²)/s·ln|(1 + s)/(1 − s)|), s = d/e: 3/e² at the centre, 3/(2e²) at the
/// surface, and 1/d²·(1 + s⁻²/5…) outside.
#[inline]
fn mean_inverse_square(d2: f64, e2: f64) -> f64 {
    if d2 <= e2 {
        (3.0 - 1.5 * d2 / e2) / e2
    } else {
        let q = e2 / d2;
        (1.0 + 0.5 * q * q) / d2
    }
}

/// An angle in [0, π].
#[derive(Clone, Copy)]
struct Angle {
    cos: f64,
    sin: f64,
}

impl Angle {
    #[inline]
    fn of_cos(cos: f64) -> Self {
        let cos = cos.clamp(-1.0, 1.0);
        Self { cos, sin: ((1.0 - cos) * (1.0 + cos)).sqrt() }
    }

    /// The difference, or zero.
    #[inline]
    fn less(self, other: Self) -> Self {
        if self.cos >= other.cos {
            return Self { cos: 1.0, sin: 0.0 };
        }
        Self {
            cos: self.cos * other.cos + self.sin * other.sin,
            sin: self.sin * other.cos - self.cos * other.sin,
        }
    }

    #[inline]
    fn cos_of_sum(self, other: Self) -> f64 {
        self.cos * other.cos - self.sin * other.sin
    }
}

/// The cosine of an angle in 16 bits, rounded down: the angle becomes no smaller.
fn cosine_below(angle: f64) -> u16 {
    let cos = angle.clamp(0.0, std::f64::consts::PI).cos();
    ((cos + 1.0) * 0.5 * f64::from(u16::MAX)).floor() as u16
}

#[inline]
fn cosine(q: u16) -> f64 {
    f64::from(q) * (2.0 / f64::from(u16::MAX)) - 1.0
}

/// A unit vector as a point of a square: the octahedron |x| + |y| + |z| = 1, its lower half folded
/// outward. Source: Meyer, Süßmuth, Sußner, Stamminger, Greiner, *On Floating-Point Normal Vectors*,
/// EGSR 2010.
fn fold(v: DVec3) -> [i16; 2] {
    let v = v / v.abs().element_sum();
    let (x, y) = if v.z >= 0.0 {
        (v.x, v.y)
    } else {
        ((1.0 - v.y.abs()) * 1f64.copysign(v.x), (1.0 - v.x.abs()) * 1f64.copysign(v.y))
    };
    [x, y].map(|c| (c * f64::from(i16::MAX)).round() as i16)
}

#[inline]
fn unfold(square: [i16; 2]) -> DVec3 {
    let [x, y] = square.map(|c| f64::from(c) / f64::from(i16::MAX));
    let z = 1.0 - x.abs() - y.abs();
    let v = if z >= 0.0 {
        DVec3::new(x, y, z)
    } else {
        DVec3::new((1.0 - y.abs()) * 1f64.copysign(x), (1.0 - x.abs()) * 1f64.copysign(y), z)
    };
    v.normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_node_is_half_a_cache_line() {
        assert_eq!(size_of::<Node>(), 32);
    }

    #[test]
    fn the_mean_inverse_square_is_a_mean() {
        let exact = |s: f64| 0.75 * (2.0 + (1.0 - s * s) / s * ((1.0 + s) / (1.0 - s)).abs().ln());
        for i in 1..400 {
            let s = f64::from(i) / 100.0 + 0.005;
            let ratio = mean_inverse_square(s * s * 4.0, 4.0) * 4.0 / exact(s);
            assert!((ratio - 1.0).abs() < 0.1, "{ratio} at {s}");
        }
    }

    proptest! {
        #[test]
        fn a_folded_direction_is_nearly_itself(v in prop::array::uniform3(-1f64..1.0)) {
            let v = DVec3::from(v);
            prop_assume!(v.length() > 0.1);
            prop_assert!(angle_between(v.normalize(), unfold(fold(v.normalize()))) < 1e-4);
        }

        #[test]
        fn cosines_are_rounded_down(angle in 0f64..3.2) {
            let back = cosine(cosine_below(angle));
            let cos = angle.min(std::f64::consts::PI).cos();
            prop_assert!(back <= cos + 1e-15 && back > cos - 4e-5);
        }
    }
}
