//! Surfaces f(x, y, z) = 0, from an expression: read and compiled to a [tape](tape::Tape), solved along
//! rays by [enclosures](enclosure) that miss no root, with normals from dual numbers.

mod enclosure;
mod interval;
mod number;
mod parse;
mod solve;
mod tape;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::DVec3;

use super::{AnalyticShape, Parameters, ShapeHit, ShapePoint};
use crate::math::Bounds;
use number::Dual;
pub use parse::ExpressionError;
use solve::{Effort, Segment, first_root};
use tape::Tape;

/// A function of x, y and z.
///
/// Numbers, `x`, `y`, `z` and `pi` are joined by `+ - * /` and `^` (which binds from the right, and before a
/// sign: `-x^2` is −(x²)), parentheses, and the functions `sqrt`, `cbrt`, `abs`, `exp`, `log` or `ln`, `sin`,
/// `cos`, `tan`, `atan`, `min`, `max` (of two or more) and `pow`. Angles are in radians. Powers with a whole
/// number are products, defined for negative bases; other powers of negative numbers, their roots and
/// logarithms have no value, and where a part has none, the function has none.
#[derive(Debug, Clone)]
pub struct Expression {
    tape: Tape,
}

impl Expression {
    /// Reads an expression. The error tells the byte at which it is none.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        Ok(Self { tape: parse::parse(text)? })
    }

    /// The value at a point; NaN where there is none.
    pub fn value(&self, p: DVec3) -> f64 {
        self.tape.with_registers(|registers| self.tape.evaluate(p.to_array(), registers))
    }

    /// Value and gradient at a point.
    fn dual(&self, p: DVec3) -> Dual {
        let axis = |value, gradient| Dual { value, gradient };
        let xyz = [axis(p.x, DVec3::X), axis(p.y, DVec3::Y), axis(p.z, DVec3::Z)];
        self.tape.with_registers(|registers| self.tape.evaluate(xyz, registers))
    }
}

/// The surface f = 0 within a box, which cuts it off without a cap. Inside is f < 0.
#[derive(Debug, Clone)]
pub struct Implicit {
    expression: Arc<Expression>,
    bounds: Bounds,
}

/// By how much of its size the box counts as larger, so that nothing on its faces is lost.
const MARGIN: f64 = 1e-12;

impl Implicit {
    /// The part of `expression` = 0 in `bounds`, which must be finite and not empty.
    pub fn new(expression: Arc<Expression>, bounds: Bounds) -> Self {
        Self { expression, bounds }
    }

    /// The expression.
    pub fn expression(&self) -> &Expression {
        &self.expression
    }

    /// The first hit, and what it took.
    fn solve(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
        effort: &mut Effort,
    ) -> Option<f64> {
        if !(origin.is_finite() && direction.is_finite()) {
            return None;
        }
        let margin = DVec3::splat(MARGIN * self.bounds.size().max_element());
        let bounds = Bounds { min: self.bounds.min - margin, max: self.bounds.max + margin };
        let (enter, exit) = bounds.clip(origin, direction)?;
        let (enter, exit) = (enter.max(t_min), exit.min(t_max));
        if !(enter <= exit && enter.is_finite()) {
            return None;
        }
        // From here on t counts from where the ray enters.
        let ray = Segment {
            origin: std::array::from_fn(|i| moved(origin[i], direction[i], enter)),
            direction: direction.to_array(),
            length: exit - enter,
        };
        let accept = |t: f64| enter + t > t_min && enter + t <= t_max;
        first_root(&self.expression.tape, &ray, accept, effort).map(|t| enter + t)
    }

    /// The unit gradient, where there is one.
    fn gradient_direction(&self, p: DVec3) -> Option<DVec3> {
        self.expression.dual(p).gradient.try_normalize()
    }
}

/// `origin + t·direction`, rounded once or little more: a ray from far away cancels here, and the error of a
/// rounded product would move the surface.
fn moved(origin: f64, direction: f64, t: f64) -> f64 {
    // The product and the sum without error: Dekker 1971, Knuth's TwoSum.
    let split = |x: f64| {
        let c = 134_217_729.0 * x;
        let high = c - (c - x);
        (high, x - high)
    };
    let product = t * direction;
    let ((t1, t2), (d1, d2)) = (split(t), split(direction));
    let product_error = t2 * d2 - (((product - t1 * d1) - t2 * d1) - t1 * d2);
    let sum = origin + product;
    let back = sum - origin;
    let sum_error = (origin - (sum - back)) + (product - back);
    let exact = sum + (sum_error + product_error);
    if exact.is_finite() { exact } else { sum }
}

impl AnalyticShape for Implicit {
    fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let t = self.solve(origin, direction, t_min, t_max, &mut Effort::default())?;
        Some(ShapeHit::at(t))
    }

    /// By a few of Newton's steps along the gradient, which is also the normal, in the direction in which f
    /// grows. Where it vanishes, as at the tip of a cone or where f touches 0 all over, that of `p` before
    /// the steps counts, then the direction from the middle of the box.
    fn surface_at(&self, p: DVec3, _part: u8) -> ShapePoint {
        let start = self.expression.dual(p);
        let (mut at, mut position) = (start, p);
        // A hit is off by the rounding of its distance, not by more than a part of the box.
        let far = 0.01 * self.bounds.size().max_element();
        for _ in 0..4 {
            let step = at.gradient * (at.value / at.gradient.length_squared());
            let next = position - step;
            // Also refuses NaN: the gradient vanishes, or f has no value.
            if !(next.distance(p) <= far) {
                break;
            }
            let there = self.expression.dual(next);
            if !(there.value.abs() < at.value.abs()) {
                break;
            }
            (at, position) = (there, next);
        }
        let normal = at.gradient.try_normalize().or_else(|| start.gradient.try_normalize());
        let normal = normal
            .or_else(|| (position - self.bounds.center()).try_normalize())
            .unwrap_or(DVec3::Y);
        ShapePoint { position, normal }
    }

    /// Zero: such a surface has no coordinates of its own. Textures by position are meant for it.
    fn parameters(&self, _p: DVec3, _part: u8) -> Parameters {
        Parameters::default()
    }

    /// From normals at a small distance to each side: the root of the sum of squares of all their
    /// changes along the surface, which is no less than the greatest curvature.
    fn curvature(&self, p: DVec3, part: u8) -> f64 {
        let point = self.surface_at(p, part);
        let (u, v) = point.normal.any_orthonormal_pair();
        let distance = 1e-5 * self.bounds.size().max_element();
        let turn = |along: DVec3| {
            let ahead = self.gradient_direction(point.position + along * distance)?;
            let behind = self.gradient_direction(point.position - along * distance)?;
            Some((ahead - behind).length_squared() / (4.0 * distance * distance))
        };
        (turn(u).unwrap_or(0.0) + turn(v).unwrap_or(0.0)).sqrt()
    }
}
