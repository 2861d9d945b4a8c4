//! What an expression can be computed in.

use glam::DVec3;

/// A kind of number that a tape is evaluated in.
pub(super) trait Number: Copy {
    /// A number that is known.
    fn constant(x: f64) -> Self;
    /// `self + other`.
    fn add(self, other: Self) -> Self;
    /// `self − other`.
    fn sub(self, other: Self) -> Self;
    /// `self · other`.
    fn mul(self, other: Self) -> Self;
    /// `self / other`.
    fn div(self, other: Self) -> Self;
    /// `self + k`.
    fn shift(self, k: f64) -> Self;
    /// `self · k`.
    fn scale(self, k: f64) -> Self;
    /// `1 / self`.
    fn recip(self) -> Self;
    /// `−self`.
    fn neg(self) -> Self;
    /// `self²`.
    fn square(self) -> Self;
    /// `selfⁿ` for n ≥ 3.
    fn power(self, n: u32) -> Self;
    /// Square root; undefined below 0.
    fn sqrt(self) -> Self;
    /// Cube root, odd.
    fn cbrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// e to this power.
    fn exp(self) -> Self;
    /// Natural logarithm; undefined below 0.
    fn ln(self) -> Self;
    /// Sine of an angle in radians.
    fn sin(self) -> Self;
    /// Cosine of an angle in radians.
    fn cos(self) -> Self;
    /// Arctangent, in radians.
    fn atan(self) -> Self;
    /// The lesser; undefined where either is.
    fn min(self, other: Self) -> Self;
    /// The greater; undefined where either is.
    fn max(self, other: Self) -> Self;
    /// Whether no value is possible: f has none there.
    fn is_undefined(self) -> bool;
}

/// xⁿ by squaring: at most n − 1 roundings' worth of error.
pub(super) fn power(x: f64, n: u32) -> f64 {
    let (mut result, mut square, mut n) = (1.0, x, n);
    while n > 0 {
        if n & 1 == 1 {
            result *= square;
        }
        square *= square;
        n >>= 1;
    }
    result
}

/// A quotient; not a number where the divisor is 0. f64 would give it the sign of that zero, while all the other
/// quotients by numbers of an interval that begins or ends at 0 may have the other.
#[inline]
fn quotient(x: f64, divisor: f64) -> f64 {
    if divisor == 0.0 { f64::NAN } else { x / divisor }
}

impl Number for f64 {
    #[inline]
    fn constant(x: f64) -> Self {
        x
    }
    #[inline]
    fn add(self, other: Self) -> Self {
        self + other
    }
    #[inline]
    fn sub(self, other: Self) -> Self {
        self - other
    }
    #[inline]
    fn mul(self, other: Self) -> Self {
        self * other
    }
    #[inline]
    fn div(self, other: Self) -> Self {
        quotient(self, other)
    }
    #[inline]
    fn shift(self, k: f64) -> Self {
        self + k
    }
    #[inline]
    fn scale(self, k: f64) -> Self {
        self * k
    }
    #[inline]
    fn recip(self) -> Self {
        quotient(1.0, self)
    }
    #[inline]
    fn neg(self) -> Self {
        -self
    }
    #[inline]
    fn square(self) -> Self {
        self * self
    }
    #[inline]
    fn power(self, n: u32) -> Self {
        power(self, n)
    }
    #[inline]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }
    #[inline]
    fn cbrt(self) -> Self {
        Self::cbrt(self)
    }
    #[inline]
    fn abs(self) -> Self {
        Self::abs(self)
    }
    #[inline]
    fn exp(self) -> Self {
        Self::exp(self)
    }
    #[inline]
    fn ln(self) -> Self {
        Self::ln(self)
    }
    #[inline]
    fn sin(self) -> Self {
        Self::sin(self)
    }
    #[inline]
    fn cos(self) -> Self {
        Self::cos(self)
    }
    #[inline]
    fn atan(self) -> Self {
        Self::atan(self)
    }
    // Not those of std, which pass over NaN.
    #[inline]
    fn min(self, other: Self) -> Self {
        if self <= other || self.is_nan() { self } else { other }
    }
    #[inline]
    fn max(self, other: Self) -> Self {
        if self >= other || self.is_nan() { self } else { other }
    }
    #[inline]
    fn is_undefined(self) -> bool {
        self.is_nan()
    }
}

/// A dual number: a value, and how it changes with x, y and z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dual {
    /// Value.
    pub value: f64,
    /// Gradient.
    pub gradient: DVec3,
}

impl Dual {
    /// By the chain rule: a function of this number, given its value and derivative.
    #[inline]
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self { value, gradient: self.gradient * derivative }
    }
}

impl Number for Dual {
    fn constant(x: f64) -> Self {
        Self { value: x, gradient: DVec3::ZERO }
    }
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, gradient: self.gradient + other.gradient }
    }
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, gradient: self.gradient - other.gradient }
    }
    fn mul(self, other: Self) -> Self {
        let gradient = self.gradient * other.value + other.gradient * self.value;
        Self { value: self.value * other.value, gradient }
    }
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, gradient: (self.gradient - other.gradient * value) / other.value }
    }
    fn shift(self, k: f64) -> Self {
        Self { value: self.value + k, ..self }
    }
    fn scale(self, k: f64) -> Self {
        self.chain(self.value * k, k)
    }
    fn recip(self) -> Self {
        let value = 1.0 / self.value;
        self.chain(value, -value * value)
    }
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
    fn square(self) -> Self {
        self.chain(self.value * self.value, 2.0 * self.value)
    }
    fn power(self, n: u32) -> Self {
        self.chain(power(self.value, n), f64::from(n) * power(self.value, n - 1))
    }
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        self.chain(value, 0.5 / value)
    }
    fn cbrt(self) -> Self {
        let value = self.value.cbrt();
        self.chain(value, 1.0 / (3.0 * value * value))
    }
    fn abs(self) -> Self {
        if self.value < 0.0 { self.neg() } else { self }
    }
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }
    fn ln(self) -> Self {
        self.chain(self.value.ln(), 1.0 / self.value)
    }
    fn sin(self) -> Self {
        let (sin, cos) = self.value.sin_cos();
        self.chain(sin, cos)
    }
    fn cos(self) -> Self {
        let (sin, cos) = self.value.sin_cos();
        self.chain(cos, -sin)
    }
    fn atan(self) -> Self {
        self.chain(self.value.atan(), 1.0 / (1.0 + self.value * self.value))
    }
    fn min(self, other: Self) -> Self {
        if self.value <= other.value || self.value.is_nan() { self } else { other }
    }
    fn max(self, other: Self) -> Self {
        if self.value >= other.value || self.value.is_nan() { self } else { other }
    }
    fn is_undefined(self) -> bool {
        self.value.is_nan()
    }
}
