//! Real roots of polynomials up to the fourth degree, by isolation.

/// A polynomial of the fourth degree or less: coefficients by rising power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quartic(pub [f64; 5]);

/// Up to four numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Roots {
    values: [f64; 4],
    len: usize,
}

impl std::ops::Deref for Roots {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        &self.values[..self.len]
    }
}

impl Roots {
    #[inline]
    fn push(&mut self, x: f64) {
        // A root at the end of one bracket may be found again at the start of the next.
        if self.len < 4 && (self.len == 0 || x > self.values[self.len - 1]) {
            self.values[self.len] = x;
            self.len += 1;
        }
    }
}

impl Quartic {
    /// Its roots in [`from`, `to`], rising. Roots of even order, where it touches zero without crossing it,
    /// are found if rounding makes it cross or touch.
    ///
    /// Between two neighbouring roots of its derivative a polynomial is monotonic and has at most one root,
    /// which its signs at both ends tell; so degree after degree, from the second up. There is no formula
    /// whose terms could cancel.
    pub fn roots_in(&self, from: f64, to: f64) -> Roots {
        if !(from <= to) {
            return Roots::default();
        }
        let [_, c1, c2, c3, c4] = self.0;
        let quadratic = [2.0 * c2, 6.0 * c3, 12.0 * c4];
        let cubic = [c1, 2.0 * c2, 3.0 * c3, 4.0 * c4];
        let turns = quadratic_roots(quadratic, from, to);
        let extremes = monotonic_roots(&cubic, &turns, from, to);
        monotonic_roots(&self.0, &extremes, from, to)
    }
}

/// Roots in the interval of a·x² + b·x + c, given as [c, b, a].
#[inline]
fn quadratic_roots([c, b, a]: [f64; 3], from: f64, to: f64) -> Roots {
    let mut roots = Roots::default();
    let half = 0.5 * b;
    let disc = half * half - a * c;
    if disc >= 0.0 {
        let q = -(half + disc.sqrt().copysign(half));
        let (x, y) = (q / a, c / q);
        // NaN and infinity are no roots within.
        let mut both = [x, y];
        if x > y {
            both.swap(0, 1);
        }
        both.into_iter().filter(|x| (from..=to).contains(x)).for_each(|x| roots.push(x));
    }
    roots
}

/// Roots in the interval of a polynomial that is monotonic between the `extremes`.
#[inline]
fn monotonic_roots<const N: usize>(c: &[f64; N], extremes: &Roots, from: f64, to: f64) -> Roots {
    let mut roots = Roots::default();
    let mut low = (from, value(c, from));
    for &x in extremes.iter().chain([&to]) {
        let high = (x, value(c, x));
        if low.1 == 0.0 {
            roots.push(low.0);
        } else if (low.1 < 0.0) != (high.1 < 0.0) && high.1 != 0.0 {
            roots.push(bracketed_root(c, low, high.0));
        }
        low = high;
    }
    if low.1 == 0.0 {
        roots.push(low.0);
    }
    roots
}

/// The polynomial's value, by Horner's rule.
#[inline]
fn value<const N: usize>(c: &[f64; N], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// The root between `low` (place and value) and `high`, where the sign is another: by Newton's method, or
/// by halves where that would leave the bracket or is slow. Source: Press et al., *Numerical Recipes*,
/// §9.4 (`rtsafe`).
#[inline]
fn bracketed_root<const N: usize>(c: &[f64; N], low: (f64, f64), high: f64) -> f64 {
    /// Halving alone needs 64 for any bracket near 1; Newton's method four or five.
    const STEPS: usize = 100;
    let (mut a, mut b) = (low.0, high);
    let falls = low.1 > 0.0;
    let mut x = 0.5 * (a + b);
    let mut last = b - a;
    for _ in 0..STEPS {
        let (mut f, mut slope) = (0.0, 0.0);
        for c in c.iter().rev() {
            slope = slope * x + f;
            f = f * x + c;
        }
        if (f > 0.0) == falls {
            a = x;
        } else {
            b = x;
        }
        let mut step = -f / slope;
        let newton = x + step;
        // Also refuses NaN.
        if !(newton > a && newton < b && step.abs() < 0.5 * last.abs()) {
            step = 0.5 * (a + b) - x;
        }
        last = step;
        let next = x + step;
        if next == x || step.abs() <= f64::EPSILON * x.abs() {
            return next;
        }
        x = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Coefficients of (x − r₀)(x − r₁)(x − r₂)(x − r₃).
    fn with_roots(roots: [f64; 4]) -> Quartic {
        let mut c = [1.0, 0.0, 0.0, 0.0, 0.0];
        for r in roots {
            for i in (0..5).rev() {
                c[i] = if i == 0 { 0.0 } else { c[i - 1] } - r * c[i];
            }
        }
        Quartic(c)
    }

    proptest! {
        /// Roots that are apart are found, all of them, and no others.
        #[test]
        fn distinct_roots_are_found(
            first in -2f64..-1.0,
            gaps in prop::array::uniform3(0.05f64..1.0),
        ) {
            let mut r = [first; 4];
            for i in 1..4 {
                r[i] = r[i - 1] + gaps[i - 1];
            }
            let found = with_roots(r).roots_in(-10.0, 10.0);
            prop_assert_eq!(found.len(), 4);
            for (found, r) in found.iter().zip(r) {
                prop_assert!((found - r).abs() < 1e-11, "{found} is not {r}");
            }
            let middle = 0.5 * (r[1] + r[2]);
            prop_assert_eq!(with_roots(r).roots_in(middle, 10.0).len(), 2, "those after {}", middle);
        }
    }

    #[test]
    fn lesser_degrees_are_quartics_too() {
        let near = |c: [f64; 5], expected: &[f64]| {
            let roots = Quartic(c).roots_in(0.0, 10.0);
            assert_eq!(roots.len(), expected.len());
            let off = |(root, expected): (&f64, &f64)| (root - expected).abs() < 1e-14;
            assert!(roots.iter().zip(expected).all(off), "{roots:?} {expected:?}");
        };
        near([-6.0, 3.0, 0.0, 0.0, 0.0], &[2.0]);
        near([2.0, -3.0, 1.0, 0.0, 0.0], &[1.0, 2.0]);
        assert!(Quartic([1.0, 0.0, 0.0, 0.0, 0.0]).roots_in(0.0, 10.0).is_empty());
        assert!(Quartic([1.0, 0.0, 2.0, 0.0, 1.0]).roots_in(-10.0, 10.0).is_empty());
        assert!(Quartic([f64::NAN; 5]).roots_in(-10.0, 10.0).is_empty());
    }
}
