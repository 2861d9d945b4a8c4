//! A function of one parameter τ ∈ [−1, 1] enclosed by a strip around a line, and by an interval.
//!
//! Along a ray, intervals alone forget that x, y and z move together, and bound f with an error that falls
//! in proportion to the piece of the ray. A strip of slope s keeps that to first order, so its width falls
//! with the square of the piece: close to a simple root the strip cuts the axis in a piece that is as
//! small as one step of Newton's method would make it, and proves that no root lies elsewhere.
//!
//! Source: Knoll, Hijazi, Kensler, Schott, Hansen, Hagen, *Fast ray tracing of arbitrary implicit surfaces
//! with interval and affine arithmetic*, Computer Graphics Forum 28 (2009), whose reduced affine form this is
//! with the ray's parameter as its one symbol; rounding is accounted for in the width.

use super::interval::{Interval, up};
use super::number::{Number, power};

/// f(τ) for τ ∈ [−1, 1]: within `range`, and within `width` of `center + slope·τ`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Enclosure {
    /// Bounds of the value.
    pub range: Interval,
    /// Value of the line in the middle.
    pub center: f64,
    /// Change of the line over half the piece.
    pub slope: f64,
    /// Half the width of the strip; infinite where there is none.
    pub width: f64,
}

/// Bounds the roundings of a few operations, relative to the magnitudes that went in.
const ROUNDING: f64 = 2.0 * f64::EPSILON;
/// The same for functions of the C library, right to a unit in the last place, and their derivatives.
const LIBRARY: f64 = 8.0 * f64::EPSILON;
/// Bounds what is lost in numbers below the least normal one.
const TINY: f64 = f64::MIN_POSITIVE;
/// Makes up for the rounding of the width itself.
const GROW: f64 = 1.0 + 8.0 * f64::EPSILON;

impl Enclosure {
    /// `origin + t·direction` for t within `half` of `middle`.
    pub fn along(origin: f64, direction: f64, middle: f64, half: f64) -> Self {
        let step = middle * direction;
        let center = origin + step;
        Self::strip(
            Interval::ENTIRE,
            center,
            half * direction,
            ROUNDING * (step.abs() + center.abs() + (half * direction).abs()),
        )
    }

    /// What is known of a strip, and of a range whose bounds may each have been rounded once.
    #[inline]
    fn strip(range: Interval, center: f64, slope: f64, width: f64) -> Self {
        let width = (width + TINY) * GROW;
        let reach = (slope.abs() + width) * GROW;
        if !(reach < f64::INFINITY && center.abs() < f64::INFINITY) {
            return Self::within(range.outward());
        }
        let own = Interval::new(center - reach, center + reach);
        Self { range: range.and(own).outward(), center, slope, width }
    }

    /// All that an interval says.
    fn within(range: Interval) -> Self {
        let center = 0.5 * range.lo + 0.5 * range.hi;
        let width = up(f64::max(range.hi - center, center - range.lo));
        if width < f64::INFINITY {
            Self { range, center, slope: 0.0, width }
        } else {
            Self { range, center: 0.0, slope: 0.0, width: f64::INFINITY }
        }
    }

    /// φ of this, by its Taylor series: `at` is φ and φ′ at the center that [`Self::middle`] gives, and
    /// `off` the strip's half width about it. `range` bounds φ, and `second` φ″ over this range.
    #[inline]
    fn smooth(self, range: Interval, at: (f64, f64), off: f64, second: Interval) -> Self {
        let (value, derivative) = at;
        let reach = (self.slope.abs() + off) * GROW;
        // ½φ″δ² lies between these, as δ² does between 0 and reach².
        let half = 0.5 * reach * reach;
        let below = f64::min(second.lo, 0.0) * half;
        let above = f64::max(second.hi, 0.0) * half;
        let shift = 0.5 * (above + below);
        let width = 0.5 * (above - below)
            + derivative.abs() * off
            + LIBRARY * (value.abs() + derivative.abs() * reach + (above - below));
        Self::strip(range, value + shift, derivative * self.slope, width)
    }

    /// The strip's middle, moved into the range, and the strip's half width about it.
    #[inline]
    fn middle(&self) -> (f64, f64) {
        let center = if self.center < self.range.lo {
            self.range.lo
        } else if self.center > self.range.hi {
            self.range.hi
        } else {
            self.center
        };
        (center, (self.width + (center - self.center).abs()) * GROW)
    }

    /// Sine or cosine; `function` gives it and its derivative, `wide` its range over an interval.
    fn wave(
        self,
        function: impl Fn(f64) -> (f64, f64),
        wide: impl Fn(Interval) -> Interval,
    ) -> Self {
        let (center, off) = self.middle();
        let reach = (self.slope.abs() + off) * GROW;
        let at = function(center);
        // Over a short piece the function stays near its value, which is cheaper to say.
        let range = if reach < 0.5 && center.abs() < 1e9 {
            let far = (reach * f64::min(1.0, at.1.abs() + reach)) * GROW + LIBRARY;
            Interval::new(f64::max(at.0 - far, -1.0), f64::min(at.0 + far, 1.0))
        } else {
            wide(self.range)
        };
        self.smooth(range, at, off, Number::neg(range))
    }
}

impl Number for Enclosure {
    fn constant(x: f64) -> Self {
        Self { range: Interval::constant(x), center: x, slope: 0.0, width: 0.0 }
    }
    #[inline]
    fn add(self, other: Self) -> Self {
        let (center, slope) = (self.center + other.center, self.slope + other.slope);
        let width = self.width + other.width + ROUNDING * (center.abs() + slope.abs());
        let (a, b) = (self.range, other.range);
        Self::strip(Interval::new(a.lo + b.lo, a.hi + b.hi), center, slope, width)
    }
    #[inline]
    fn sub(self, other: Self) -> Self {
        let (center, slope) = (self.center - other.center, self.slope - other.slope);
        let width = self.width + other.width + ROUNDING * (center.abs() + slope.abs());
        let (a, b) = (self.range, other.range);
        Self::strip(Interval::new(a.lo - b.hi, a.hi - b.lo), center, slope, width)
    }
    #[inline]
    fn mul(self, other: Self) -> Self {
        // (a + bτ)(c + dτ) = ac + (ad + bc)τ + bd·τ², and τ² = ½ ± ½.
        let (ac, bd) = (self.center * other.center, self.slope * other.slope);
        let (ad, bc) = (self.center * other.slope, self.slope * other.center);
        let rounding = ac.abs() + bd.abs() + ad.abs() + bc.abs();
        let width = 0.5 * bd.abs()
            + self.width * other.range.magnitude()
            + other.width * (self.center.abs() + self.slope.abs())
            + ROUNDING * rounding;
        Self::strip(self.range.product(other.range), ac + 0.5 * bd, ad + bc, width)
    }
    fn div(self, other: Self) -> Self {
        let product = self.mul(other.recip());
        Self { range: product.range.and(self.range.div(other.range)), ..product }
    }
    #[inline]
    fn shift(self, k: f64) -> Self {
        let center = self.center + k;
        let width = self.width + ROUNDING * center.abs();
        let range = Interval::new(self.range.lo + k, self.range.hi + k);
        Self::strip(range, center, self.slope, width)
    }
    #[inline]
    fn scale(self, k: f64) -> Self {
        let (center, slope) = (self.center * k, self.slope * k);
        let width = self.width * k.abs() + ROUNDING * (center.abs() + slope.abs());
        let (a, b) = (self.range.lo * k, self.range.hi * k);
        let range = if k < 0.0 { Interval::new(b, a) } else { Interval::new(a, b) };
        Self::strip(range, center, slope, width)
    }
    fn recip(self) -> Self {
        let range = self.range.recip();
        if self.range.may_be_zero() {
            return Self::within(range);
        }
        let (x, off) = self.middle();
        self.smooth(range, (1.0 / x, -1.0 / (x * x)), off, range.power(3).scale(2.0))
    }
    #[inline]
    fn neg(self) -> Self {
        Self { range: self.range.neg(), center: -self.center, slope: -self.slope, ..self }
    }
    #[inline]
    fn square(self) -> Self {
        let (a, b) = (self.center, self.slope);
        let (aa, bb, ab) = (a * a, b * b, 2.0 * a * b);
        let reach = 2.0 * (a.abs() + b.abs()) + self.width;
        let width = 0.5 * bb + self.width * reach + ROUNDING * (aa + bb + ab.abs());
        let r = Number::abs(self.range);
        Self::strip(Interval::new(r.lo * r.lo, r.hi * r.hi), aa + 0.5 * bb, ab, width)
    }
    fn power(self, n: u32) -> Self {
        let order = f64::from(n);
        let curve = match n {
            3 => self.range,
            4 => self.range.square(),
            _ => self.range.power(n - 2),
        };
        let second = curve.scale(order * (order - 1.0));
        let (x, off) = self.middle();
        let at = (power(x, n), order * power(x, n - 1));
        let e = self.smooth(self.range.power(n), at, off, second);
        // Powers may lose more digits than functions of the library.
        let rounding = f64::EPSILON * order * (e.center.abs() + e.slope.abs());
        Self::strip(e.range, e.center, e.slope, e.width + rounding)
    }
    fn sqrt(self) -> Self {
        let range = self.range.sqrt();
        if !(self.range.lo > 0.0) {
            return Self::within(range);
        }
        // φ″ = −¼x^(−3/2), steepest at the low end.
        let second = Interval::new(-0.25 / (self.range.lo * range.lo) * GROW, 0.0);
        let (x, off) = self.middle();
        let root = x.sqrt();
        self.smooth(range, (root, 0.5 / root), off, second)
    }
    fn cbrt(self) -> Self {
        let range = self.range.cbrt();
        if self.range.may_be_zero() {
            return Self::within(range);
        }
        // φ″ = −2/(9φ⁵).
        let second = range.power(5).recip().scale(-2.0 / 9.0);
        let (x, off) = self.middle();
        let root = x.cbrt();
        self.smooth(range, (root, 1.0 / (3.0 * root * root)), off, second)
    }
    fn abs(self) -> Self {
        if self.range.lo >= 0.0 {
            self
        } else if self.range.hi <= 0.0 {
            self.neg()
        } else {
            Self::within(Number::abs(self.range))
        }
    }
    fn exp(self) -> Self {
        let range = self.range.exp();
        let (x, off) = self.middle();
        let value = x.exp();
        self.smooth(range, (value, value), off, range)
    }
    fn ln(self) -> Self {
        let range = self.range.ln();
        if !(self.range.lo > 0.0) {
            return Self::within(range);
        }
        let second = self.range.square().recip().neg();
        let (x, off) = self.middle();
        self.smooth(range, (x.ln(), 1.0 / x), off, second)
    }
    fn sin(self) -> Self {
        self.wave(f64::sin_cos, Interval::sin)
    }
    fn cos(self) -> Self {
        let function = |x: f64| {
            let (sin, cos) = x.sin_cos();
            (cos, -sin)
        };
        self.wave(function, Interval::cos)
    }
    fn atan(self) -> Self {
        // |φ″| = 2|x|/(1 + x²)² ≤ 9/(8√3).
        let second = Interval::new(-0.65, 0.65);
        let (x, off) = self.middle();
        self.smooth(self.range.atan(), (x.atan(), 1.0 / (1.0 + x * x)), off, second)
    }
    fn min(self, other: Self) -> Self {
        // min(a, b) = a + min(b − a, 0), and what is cut off lies between 0 and the least of b − a.
        let difference = other.sub(self);
        if difference.range.lo >= 0.0 {
            return self;
        } else if difference.range.hi <= 0.0 {
            return other;
        }
        let range = Number::min(self.range, other.range);
        let (near, least) = if -difference.range.lo <= difference.range.hi {
            (self, -difference.range.lo)
        } else {
            (other, difference.range.hi)
        };
        let half = 0.5 * least;
        let center = near.center - half;
        let width = near.width + half + ROUNDING * (center.abs() + half);
        Self::strip(range, center, near.slope, width)
    }
    fn max(self, other: Self) -> Self {
        self.neg().min(other.neg()).neg()
    }
    fn is_undefined(self) -> bool {
        self.range.is_undefined()
    }
}
