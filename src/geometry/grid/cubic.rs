//! The interpolant along a ray within a cell: a cubic polynomial, in Bernstein form.
//!
//! A trilinear function is linear in each coordinate, so it is its own polar form: the Bernstein
//! coefficients of its values from `a` to `b` are means of its values at points that take each coordinate
//! from one of both. They are found by interpolation alone, so they have the signs of the samples: where
//! no sample is above the level, no coefficient is, whatever was rounded.
//!
//! Roots are isolated by those of the derivative, as in Marmitt et al., *Fast and Accurate Ray-Voxel
//! Intersection Techniques for Iso-Surface Ray Tracing*, VMV 2004, and refined by Newton's method within
//! brackets.

use glam::DVec3;

use super::lerp;

/// A cubic polynomial over [0, 1], by its Bernstein coefficients; the first and the last are its values
/// at the ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic(pub [f64; 4]);

impl Cubic {
    /// The values of the trilinear interpolant of `corners` (x changes first, z last) from `a` to `b`, both
    /// within [0, 1]³.
    #[inline]
    pub fn along(corners: &[f64; 8], a: DVec3, b: DVec3) -> Self {
        let c = corners;
        // By x at a and at b, for each y and z; then by y, then by z.
        let x = |i: usize| [lerp(c[i], c[i + 1], a.x), lerp(c[i], c[i + 1], b.x)];
        let (x00, x10, x01, x11) = (x(0), x(2), x(4), x(6));
        let y = |i: usize, t: f64| [lerp(x00[i], x10[i], t), lerp(x01[i], x11[i], t)];
        let z = |v: [f64; 2], t: f64| lerp(v[0], v[1], t);
        let (aa, ba, ab, bb) = (y(0, a.y), y(1, a.y), y(0, b.y), y(1, b.y));
        Self([
            z(aa, a.z),
            (z(ba, a.z) + z(ab, a.z) + z(aa, b.z)) / 3.0,
            (z(bb, a.z) + z(ba, b.z) + z(ab, b.z)) / 3.0,
            z(bb, b.z),
        ])
    }

    /// Its value, by de Casteljau's algorithm.
    #[inline]
    pub fn at(&self, t: f64) -> f64 {
        let [a, b, c, d] = self.0;
        let (ab, bc, cd) = (lerp(a, b, t), lerp(b, c, t), lerp(c, d, t));
        lerp(lerp(ab, bc, t), lerp(bc, cd, t), t)
    }

    /// Its parts before and after `t`, each over [0, 1].
    #[inline]
    pub fn split(&self, t: f64) -> [Self; 2] {
        let [a, b, c, d] = self.0;
        let (ab, bc, cd) = (lerp(a, b, t), lerp(b, c, t), lerp(c, d, t));
        let (abc, bcd) = (lerp(ab, bc, t), lerp(bc, cd, t));
        let middle = lerp(abc, bcd, t);
        [Self([a, ab, abc, middle]), Self([middle, bcd, cd, d])]
    }

    /// Its part from `t0` to `t1`, over [0, 1].
    #[inline]
    pub fn part(&self, t0: f64, t1: f64) -> Self {
        let mut part = *self;
        if t1 < 1.0 {
            part = part.split(t1)[0];
        }
        if t0 > 0.0 {
            part = part.split(if t1 > 0.0 { t0 / t1 } else { 1.0 })[1];
        }
        part
    }

    /// ∫₀¹.
    #[inline]
    pub fn mean(&self) -> f64 {
        let [a, b, c, d] = self.0;
        0.25 * ((a + d) + (b + c))
    }

    /// a + b·cubic.
    #[inline]
    #[must_use]
    pub fn mapped(&self, a: f64, b: f64) -> Self {
        Self(self.0.map(|x| a + b * x))
    }

    /// Where it first passes from above zero to not above, or back.
    #[inline]
    pub fn first_root(&self) -> Option<f64> {
        let mut root = None;
        self.each_root(|t| {
            root = Some(t);
            false
        });
        root
    }

    /// Tells every place where it passes from above zero to not above or back, in order, until told to stop
    /// by false. A place where it touches zero is none.
    #[inline]
    pub fn each_root(&self, mut tell: impl FnMut(f64) -> bool) {
        // At most as many roots as there are changes of sign (variation diminishing).
        let [a, b, c, d] = self.0.map(|x| x > 0.0);
        let changes = u8::from(a != b) + u8::from(b != c) + u8::from(c != d);
        if changes == 0 {
            return;
        }
        if changes == 1 {
            tell(self.refine(0.0, 1.0, a));
            return;
        }
        // Between the extremes it is monotonic.
        let [e0, e1] = self.extremes();
        let stops = [0.0, e0, e1, 1.0];
        let above = [a, self.at(e0) > 0.0, self.at(e1) > 0.0, d];
        for i in 0..3 {
            if above[i] != above[i + 1] && !tell(self.refine(stops[i], stops[i + 1], above[i])) {
                return;
            }
        }
    }

    /// The roots of the derivative in order, those outside [0, 1] moved to its ends.
    fn extremes(&self) -> [f64; 2] {
        let [a, b, c, d] = self.0;
        // The derivative, over 3: p + 2·q·t + r·t², the last without cancellation where it has a small root.
        let p = b - a;
        let q = (c - b) - (b - a);
        let r = (d - c) - 2.0 * (c - b) + (b - a);
        let discriminant = q * q - p * r;
        if !(discriminant > 0.0) {
            return [0.0, 0.0];
        }
        let s = -(q + discriminant.sqrt().copysign(q));
        // One is s/r, the other p/s. Infinite where the derivative is linear; s is zero only with q and p·r.
        let inside = |t: f64| if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
        let (t0, t1) = (inside(s / r), inside(p / s));
        [t0.min(t1), t0.max(t1)]
    }

    /// The root between `lo` and `hi`, where it is monotonic and passes zero; `above` says on which side it
    /// is at `lo`.
    fn refine(&self, mut lo: f64, mut hi: f64, above: bool) -> f64 {
        /// Bisection alone would end before.
        const MOST: usize = 100;
        /// Below what matters in [0, 1].
        const TINY: f64 = 0.25 * f64::EPSILON;
        let [a, b, c, d] = self.0;
        let (c1, c2) = (3.0 * (b - a), 3.0 * ((c - b) - (b - a)));
        let c3 = (d - c) - 2.0 * (c - b) + (b - a);
        let mut t = 0.5 * (lo + hi);
        if lo == 0.0 && hi == 1.0 {
            // Where a line would pass.
            let guess = a / (a - d);
            if guess > 0.0 && guess < 1.0 {
                t = guess;
            }
        }
        let mut last_step = hi - lo;
        for _ in 0..MOST {
            let value = ((c3 * t + c2) * t + c1) * t + a;
            if (value > 0.0) == above {
                lo = t;
            } else {
                hi = t;
            }
            let slope = (3.0 * c3 * t + 2.0 * c2) * t + c1;
            let mut step = -value / slope;
            if value == 0.0 || step.abs() <= TINY {
                break;
            }
            // Newton's step, unless it leaves the bracket or does not even halve the last one.
            if !(t + step > lo && t + step < hi && 2.0 * step.abs() <= last_step.abs()) {
                step = 0.5 * (lo + hi) - t;
            }
            last_step = step;
            t += step;
            if step.abs() <= TINY {
                break;
            }
        }
        t.clamp(lo, hi)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The cubic of the given roots: (t − r₀)(t − r₁)(t − r₂).
    fn of_roots(r: [f64; 3]) -> Cubic {
        let f = |t: f64| (t - r[0]) * (t - r[1]) * (t - r[2]);
        // By the polar form: over all orders of the arguments, divided by 6.
        let polar = |x: [f64; 3]| {
            let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
            let product = |o: [usize; 3]| -> f64 { (0..3).map(|i| x[i] - r[o[i]]).product() };
            orders.map(product).iter().sum::<f64>() / 6.0
        };
        Cubic([f(0.0), polar([0.0, 0.0, 1.0]), polar([0.0, 1.0, 1.0]), f(1.0)])
    }

    fn roots(cubic: &Cubic) -> Vec<f64> {
        let mut roots = Vec::new();
        cubic.each_root(|t| {
            roots.push(t);
            true
        });
        roots
    }

    proptest! {
        #[test]
        fn roots_are_found_in_order(mut r in prop::array::uniform3(-1.0..2.0)) {
            r.sort_by(f64::total_cmp);
            prop_assume!(r[1] - r[0] > 1e-4 && r[2] - r[1] > 1e-4);
            prop_assume!(r.iter().all(|t| t.abs() > 1e-9 && (t - 1.0).abs() > 1e-9));
            let expected: Vec<f64> = r.into_iter().filter(|t| (0.0..=1.0).contains(t)).collect();
            let found = roots(&of_roots(r));
            prop_assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(&expected) {
                // The error grows as roots draw near.
                prop_assert!((found - expected).abs() < 1e-10, "{} {}", found, expected);
            }
            prop_assert_eq!(of_roots(r).first_root(), found.first().copied());
        }

        #[test]
        fn roots_are_as_many_as_changes_of_sign(c in prop::array::uniform4(-1.0..1.0)) {
            let cubic = Cubic(c);
            let found = roots(&cubic);
            prop_assert!(found.is_sorted());
            prop_assert_eq!(found.len() % 2 == 1, (c[0] > 0.0) != (c[3] > 0.0));
            for t in found {
                prop_assert!(cubic.at(t).abs() < 1e-14, "{}", cubic.at(t));
            }
        }

        #[test]
        fn along_a_segment_it_has_the_values_of_the_interpolant(
            c in prop::array::uniform8(-1.0..1.0),
            a in prop::array::uniform3(0.0..=1.0),
            b in prop::array::uniform3(0.0..=1.0),
        ) {
            let (a, b) = (DVec3::from(a), DVec3::from(b));
            let cubic = Cubic::along(&c, a, b);
            for t in [0.0, 0.2, 0.5, 0.9, 1.0] {
                let p = a + t * (b - a);
                let mut sum = 0.0;
                for (i, value) in c.iter().enumerate() {
                    let pick = |axis: usize| if i >> axis & 1 == 1 { p[axis] } else { 1.0 - p[axis] };
                    sum += value * pick(0) * pick(1) * pick(2);
                }
                prop_assert!((cubic.at(t) - sum).abs() < 1e-14);
                let [left, right] = cubic.split(t);
                prop_assert!((left.at(0.5) - cubic.at(0.5 * t)).abs() < 1e-14);
                prop_assert!((right.mean() * (1.0 - t) + left.mean() * t - cubic.mean()).abs() < 1e-14);
                prop_assert!((cubic.part(0.5 * t, t).at(0.5) - cubic.at(0.75 * t)).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn what_touches_zero_does_not_pass() {
        for cubic in
            [[0.0; 4], [1.0, 0.0, 0.0, 1.0], [-1.0, 0.0, 0.0, -1.0], [0.0, -1.0, -1.0, 0.0]]
        {
            assert_eq!(roots(&Cubic(cubic)).len() % 2, 0, "{cubic:?}");
        }
        // A root at the very end belongs to who is above zero.
        let at_end = roots(&Cubic([3.0, 2.0, 1.0, 0.0]));
        assert!(at_end.len() == 1 && at_end[0] > 1.0 - 1e-15);
        assert_eq!(roots(&Cubic([0.0, -1.0, -2.0, -3.0])), [0.0; 0]);
        let at_start = roots(&Cubic([0.0, 1.0, 2.0, 3.0]));
        assert!(at_start.len() == 1 && at_start[0] < 1e-15);
        assert_eq!(roots(&Cubic([-3.0, -2.0, -1.0, 0.0])), [0.0; 0]);
    }
}
