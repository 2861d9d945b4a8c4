//! Intervals of f64 with outward rounding: every value that the numbers in the operands can give lies in
//! the result, rounding included.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::number::{Number, power};

/// The numbers from `lo` to `hi`, both included. Unbounded where a bound is infinite, empty where
/// `lo > hi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    /// Least number.
    pub lo: f64,
    /// Greatest number.
    pub hi: f64,
}

/// A number below the real one that was rounded to `x`.
///
/// Source: Rump, Zimmermann, Boldo, Melquiond, *Computing predecessor and successor in rounding to
/// nearest*, BIT 49 (2009): with φ = u(1 + 2u), x − (φ|x| + η) is at most x's predecessor.
#[inline]
pub(super) fn down(x: f64) -> f64 {
    const U: f64 = 0.5 * f64::EPSILON;
    let y = x - (U * (1.0 + 2.0 * U) * x.abs() + SMALLEST);
    if y.is_nan() { after_overflow(x) } else { y }
}

/// A number above the real one that was rounded to `x`.
#[inline]
pub(super) fn up(x: f64) -> f64 {
    -down(-x)
}

/// The least number above 0.
const SMALLEST: f64 = 5e-324;

/// `down` where ∞ − ∞ came of it.
#[cold]
fn after_overflow(x: f64) -> f64 {
    if x == f64::INFINITY { f64::MAX } else { f64::NEG_INFINITY }
}

/// Below what a function of the C library, right to one unit in the last place, rounded to `x`.
fn below(x: f64) -> f64 {
    down(x - x.abs() * (2.0 * f64::EPSILON))
}

/// Above it.
fn above(x: f64) -> f64 {
    -below(-x)
}

/// The lesser of two numbers that are not NaN; one instruction, where `f64::min` is three.
#[inline]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

impl Interval {
    /// No number.
    pub const EMPTY: Self = Self { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
    /// All numbers.
    pub const ENTIRE: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// From `lo` to `hi`.
    #[inline]
    pub const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// Whether it holds 0; so does what went wrong.
    #[inline]
    pub fn may_be_zero(self) -> bool {
        !(self.lo > 0.0 || self.hi < 0.0)
    }

    /// The greatest absolute value.
    #[inline]
    pub fn magnitude(self) -> f64 {
        let (lo, hi) = (self.lo.abs(), self.hi.abs());
        if lo > hi { lo } else { hi }
    }

    /// What lies in both.
    #[inline]
    pub fn and(self, other: Self) -> Self {
        Self {
            lo: if other.lo > self.lo { other.lo } else { self.lo },
            hi: if other.hi < self.hi { other.hi } else { self.hi },
        }
    }

    /// The least that holds these, none of which is NaN.
    #[inline]
    fn around(v: [f64; 4]) -> Self {
        let lo = least(least(v[0], v[1]), least(v[2], v[3]));
        let hi = -least(least(-v[0], -v[1]), least(-v[2], -v[3]));
        Self { lo, hi }
    }

    /// Moves both bounds out by one rounding.
    #[inline]
    pub fn outward(self) -> Self {
        Self { lo: down(self.lo), hi: up(self.hi) }
    }

    /// The products, rounded as they come.
    #[inline]
    pub fn product(self, other: Self) -> Self {
        let (a, b) = (self, other);
        let v = [a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi];
        // NaN comes of 0 · ∞, which is 0 here.
        if (v[0] + v[1] + v[2] + v[3]).is_nan() {
            return Self::around(v.map(|x| if x.is_nan() { 0.0 } else { x }));
        }
        Self::around(v)
    }

    /// A function that rises everywhere.
    fn rising(self, f: impl Fn(f64) -> f64) -> Self {
        Self { lo: below(f(self.lo)), hi: above(f(self.hi)) }
    }

    /// A cosine whose crests lie at `phase + 2πk`.
    fn wave(self, phase: f64, f: impl Fn(f64) -> f64) -> Self {
        // Beyond, whole turns are no longer told apart for certain.
        if !(self.hi - self.lo < TAU && self.magnitude() < 1e9) {
            return Self { lo: -1.0, hi: 1.0 };
        }
        // Doubtful crests count.
        let meets = |phase: f64| {
            let (from, to) = ((self.lo - phase) / TAU, (self.hi - phase) / TAU);
            let doubt = 1e-15 * (4.0 + 4.0 * from.abs().max(to.abs()));
            (to + doubt).floor() >= from - doubt
        };
        let (a, b) = (f(self.lo), f(self.hi));
        let lo = if meets(phase + PI) { -1.0 } else { below(f64::min(a, b)).max(-1.0) };
        let hi = if meets(phase) { 1.0 } else { above(f64::max(a, b)).min(1.0) };
        Self { lo, hi }
    }
}

impl Number for Interval {
    #[inline]
    fn constant(x: f64) -> Self {
        Self { lo: x, hi: x }
    }
    #[inline]
    fn add(self, other: Self) -> Self {
        Self { lo: down(self.lo + other.lo), hi: up(self.hi + other.hi) }
    }
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self { lo: down(self.lo - other.hi), hi: up(self.hi - other.lo) }
    }
    #[inline]
    fn mul(self, other: Self) -> Self {
        self.product(other).outward()
    }
    fn div(self, other: Self) -> Self {
        let (a, b) = (self, other);
        if b.may_be_zero() {
            return a.mul(b.recip());
        }
        let v = [a.lo / b.lo, a.lo / b.hi, a.hi / b.lo, a.hi / b.hi];
        // ∞/∞ lies between 0 and an infinity: the other quotients of these bounds.
        Self::around(v.map(|x| if x.is_nan() { 0.0 } else { x })).outward()
    }
    #[inline]
    fn shift(self, k: f64) -> Self {
        Self { lo: down(self.lo + k), hi: up(self.hi + k) }
    }
    #[inline]
    fn scale(self, k: f64) -> Self {
        let (a, b) = (self.lo * k, self.hi * k);
        if k < 0.0 { Self { lo: down(b), hi: up(a) } } else { Self { lo: down(a), hi: up(b) } }
    }
    fn recip(self) -> Self {
        if !self.may_be_zero() {
            Self { lo: down(1.0 / self.hi), hi: up(1.0 / self.lo) }
        } else if self.lo == 0.0 && self.hi == 0.0 {
            Self::EMPTY
        } else if self.lo == 0.0 {
            Self { lo: down(1.0 / self.hi), hi: f64::INFINITY }
        } else if self.hi == 0.0 {
            Self { lo: f64::NEG_INFINITY, hi: up(1.0 / self.lo) }
        } else {
            Self::ENTIRE
        }
    }
    #[inline]
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
    #[inline]
    fn square(self) -> Self {
        let a = Number::abs(self);
        Self { lo: down(a.lo * a.lo).max(0.0), hi: up(a.hi * a.hi) }
    }
    fn power(self, n: u32) -> Self {
        // One rounding for each factor, and what is lost below the least normal number.
        let slack = f64::EPSILON * f64::from(n);
        let lower = |x: f64| down(power(x, n) * (1.0 - slack) - 32.0 * SMALLEST).max(0.0);
        let upper = |x: f64| up(power(x, n) * (1.0 + slack) + 32.0 * SMALLEST);
        if n.is_multiple_of(2) {
            let a = Number::abs(self);
            return Self { lo: lower(a.lo), hi: upper(a.hi) };
        }
        let lo = if self.lo >= 0.0 { lower(self.lo) } else { -upper(-self.lo) };
        let hi = if self.hi >= 0.0 { upper(self.hi) } else { -lower(-self.hi) };
        Self { lo, hi }
    }
    fn sqrt(self) -> Self {
        if !(self.hi >= 0.0) {
            return Self::EMPTY;
        }
        Self { lo: down(self.lo.max(0.0).sqrt()).max(0.0), hi: up(self.hi.sqrt()) }
    }
    fn cbrt(self) -> Self {
        self.rising(f64::cbrt)
    }
    #[inline]
    fn abs(self) -> Self {
        if self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            Number::neg(self)
        } else {
            Self { lo: 0.0, hi: self.magnitude() }
        }
    }
    fn exp(self) -> Self {
        let e = self.rising(f64::exp);
        Self { lo: e.lo.max(0.0), ..e }
    }
    fn ln(self) -> Self {
        if self.hi == 0.0 {
            // What f64 makes of ln 0: below every number.
            return Self { lo: f64::NEG_INFINITY, hi: f64::MIN };
        }
        if !(self.hi > 0.0) {
            return Self::EMPTY;
        }
        Self { lo: self.lo.max(0.0), hi: self.hi }.rising(f64::ln)
    }
    fn sin(self) -> Self {
        self.wave(FRAC_PI_2, f64::sin)
    }
    fn cos(self) -> Self {
        self.wave(0.0, f64::cos)
    }
    fn atan(self) -> Self {
        self.rising(f64::atan)
    }
    fn min(self, other: Self) -> Self {
        Self { lo: f64::min(self.lo, other.lo), hi: f64::min(self.hi, other.hi) }
    }
    fn max(self, other: Self) -> Self {
        Self { lo: f64::max(self.lo, other.lo), hi: f64::max(self.hi, other.hi) }
    }
    fn is_undefined(self) -> bool {
        self.lo > self.hi
    }
}
