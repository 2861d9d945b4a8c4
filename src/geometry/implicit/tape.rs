//! Expressions as a list of operations, each on results of earlier ones.

use std::collections::HashMap;

use super::number::{Number, power};

/// One operation. Operands are places in the tape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Op {
    /// The coordinate along an axis.
    Coordinate(u8),
    /// A number.
    Constant(f64),
    /// a + b
    Add(u32, u32),
    /// a − b
    Sub(u32, u32),
    /// a · b
    Mul(u32, u32),
    /// a / b
    Div(u32, u32),
    /// The lesser.
    Min(u32, u32),
    /// The greater.
    Max(u32, u32),
    /// a + k
    Shift(u32, f64),
    /// a · k
    Scale(u32, f64),
    /// aⁿ, n ≥ 3
    Power(u32, u32),
    /// A function of one argument.
    Unary(Unary, u32),
}

/// Functions of one argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]

pub(super) enum Unary {
    Neg,
    Recip,
    Square,
    Sqrt,
    Cbrt,
    Abs,
    Exp,
    Ln,
    Sin,
    Cos,
    Atan,
}

impl Unary {
    /// The function of a number.
    #[inline]
    fn of<N: Number>(self, a: N) -> N {
        match self {
            Self::Neg => a.neg(),
            Self::Recip => a.recip(),
            Self::Square => a.square(),
            Self::Sqrt => a.sqrt(),
            Self::Cbrt => a.cbrt(),
            Self::Abs => a.abs(),
            Self::Exp => a.exp(),
            Self::Ln => a.ln(),
            Self::Sin => a.sin(),
            Self::Cos => a.cos(),
            Self::Atan => a.atan(),
        }
    }
}

/// A list of operations; the last one's result is the expression's.
#[derive(Debug, Clone)]
pub(super) struct Tape {
    ops: Box<[Op]>,
}

impl Tape {
    /// Number of operations.
    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.ops.len()
    }

    /// The value at a point, in any kind of number. `registers` holds at least as many as the tape is
    /// long. Where a part of the expression has no value, the whole has none.
    #[inline]
    pub fn evaluate<N: Number>(&self, xyz: [N; 3], registers: &mut [N]) -> N {
        let registers = &mut registers[..self.ops.len()];
        let mut last = xyz[0];
        for (i, op) in self.ops.iter().enumerate() {
            let at = |j: u32| registers[j as usize];
            last = match *op {
                Op::Coordinate(axis) => xyz[usize::from(axis)],
                Op::Constant(x) => N::constant(x),
                Op::Add(a, b) => at(a).add(at(b)),
                Op::Sub(a, b) => at(a).sub(at(b)),
                Op::Mul(a, b) => at(a).mul(at(b)),
                Op::Div(a, b) => {
                    let ratio = at(a).div(at(b));
                    if ratio.is_undefined() {
                        return ratio;
                    }
                    ratio
                }
                Op::Min(a, b) => at(a).min(at(b)),
                Op::Max(a, b) => at(a).max(at(b)),
                Op::Shift(a, k) => at(a).shift(k),
                Op::Scale(a, k) => at(a).scale(k),
                Op::Power(a, n) => at(a).power(n),
                Op::Unary(f, a) => {
                    let value = f.of(at(a));
                    if value.is_undefined() {
                        return value;
                    }
                    value
                }
            };
            registers[i] = last;
        }
        last
    }

    /// Calls `f` with registers for this tape: on the stack, unless the tape is long.
    #[inline]
    pub fn with_registers<N: Number, R>(&self, f: impl FnOnce(&mut [N]) -> R) -> R {
        let zero = N::constant(0.0);
        match self.ops.len() {
            0..=24 => f(&mut [zero; 24]),
            25..=96 => f(&mut [zero; 96]),
            n => f(&mut vec![zero; n]),
        }
    }
}

/// A part of an expression that is being built: a number that is known, or a place in the tape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Term {
    /// A number that does not depend on the point.
    Known(f64),
    /// The result of an operation.
    At(u32),
}

/// What makes two operations the same.
#[derive(PartialEq, Eq, Hash)]
enum Key {
    Coordinate(u8),
    Constant(u64),
    Pair(u8, u32, u32),
    WithConstant(u8, u32, u64),
    Unary(Unary, u32),
}

/// Builds a tape: numbers are computed at once, and what was said twice is computed once.
#[derive(Default)]
pub(super) struct Builder {
    ops: Vec<Op>,
    known: HashMap<Key, u32>,
}

impl Builder {
    /// The tape that ends in `term`; none where it does not depend on the point.
    pub fn finish(self, term: Term) -> Option<Tape> {
        let Term::At(last) = term else { return None };
        // Only what the result depends on: folding leaves operations behind that nothing uses.
        let mut used = vec![false; last as usize + 1];
        used[last as usize] = true;
        for i in (0..=last as usize).rev() {
            if used[i] {
                self.ops[i].operands(|a| used[a as usize] = true);
            }
        }
        let mut place = vec![0; used.len()];
        let mut ops = Vec::new();
        for i in (0..used.len()).filter(|&i| used[i]) {
            place[i] = ops.len() as u32;
            ops.push(self.ops[i].moved(|a| place[a as usize]));
        }
        Some(Tape { ops: ops.into() })
    }

    fn push(&mut self, op: Op) -> Term {
        let key = match op {
            Op::Coordinate(axis) => Key::Coordinate(axis),
            Op::Constant(x) => Key::Constant(x.to_bits()),
            Op::Add(a, b) => Key::Pair(0, a.min(b), a.max(b)),
            Op::Mul(a, b) => Key::Pair(1, a.min(b), a.max(b)),
            Op::Min(a, b) => Key::Pair(2, a.min(b), a.max(b)),
            Op::Max(a, b) => Key::Pair(3, a.min(b), a.max(b)),
            Op::Sub(a, b) => Key::Pair(4, a, b),
            Op::Div(a, b) => Key::Pair(5, a, b),
            Op::Power(a, n) => Key::Pair(6, a, n),
            Op::Shift(a, k) => Key::WithConstant(0, a, k.to_bits()),
            Op::Scale(a, k) => Key::WithConstant(1, a, k.to_bits()),
            Op::Unary(f, a) => Key::Unary(f, a),
        };
        let next = self.ops.len() as u32;
        let place = *self.known.entry(key).or_insert(next);
        if place == next {
            self.ops.push(op);
        }
        Term::At(place)
    }

    /// A term as a place in the tape.
    fn place(&mut self, term: Term) -> u32 {
        let term = match term {
            Term::Known(x) => self.push(Op::Constant(x)),
            at @ Term::At(_) => at,
        };
        match term {
            Term::At(place) => place,
            Term::Known(_) => unreachable!("pushed above"),
        }
    }

    /// The coordinate along an axis.
    pub fn coordinate(&mut self, axis: u8) -> Term {
        self.push(Op::Coordinate(axis))
    }

    /// a + b
    pub fn add(&mut self, a: Term, b: Term) -> Term {
        match (a, b) {
            (Term::Known(a), Term::Known(b)) => Term::Known(a + b),
            (Term::At(a), Term::Known(k)) | (Term::Known(k), Term::At(a)) => self.shift(a, k),
            (Term::At(a), Term::At(b)) if a == b => self.scale(a, 2.0),
            (Term::At(a), Term::At(b)) => self.push(Op::Add(a, b)),
        }
    }

    /// a − b
    pub fn sub(&mut self, a: Term, b: Term) -> Term {
        match (a, b) {
            (Term::At(a), Term::At(b)) => self.push(Op::Sub(a, b)),
            (a, b) => {
                let b = self.unary(Unary::Neg, b);
                self.add(a, b)
            }
        }
    }

    /// a · b
    pub fn mul(&mut self, a: Term, b: Term) -> Term {
        match (a, b) {
            (Term::Known(a), Term::Known(b)) => Term::Known(a * b),
            (Term::At(a), Term::Known(k)) | (Term::Known(k), Term::At(a)) => self.scale(a, k),
            // Products of equals as powers, whose bounds are tighter.
            (Term::At(i), Term::At(j)) => {
                let (a, n) = self.as_power(i);
                let (b, m) = self.as_power(j);
                if a == b && n + m <= MAX_POWER {
                    return self.power(Term::At(a), n + m);
                }
                self.push(Op::Mul(i, j))
            }
        }
    }

    /// A place as a power of another.
    fn as_power(&self, i: u32) -> (u32, u32) {
        match self.ops[i as usize] {
            Op::Unary(Unary::Square, a) => (a, 2),
            Op::Power(a, n) => (a, n),
            _ => (i, 1),
        }
    }

    /// a / b
    pub fn div(&mut self, a: Term, b: Term) -> Term {
        match (a, b) {
            (Term::Known(a), Term::Known(b)) => Term::Known(a / b),
            // A division rounds once, a product with the reciprocal twice, unless that is exact.
            (Term::At(a), Term::Known(k)) if is_power_of_two(k) => self.scale(a, 1.0 / k),
            (Term::Known(1.0), b) => self.unary(Unary::Recip, b),
            (a, b) => {
                let (a, b) = (self.place(a), self.place(b));
                self.push(Op::Div(a, b))
            }
        }
    }

    /// The lesser of two.
    pub fn min(&mut self, a: Term, b: Term) -> Term {
        match (a, b) {
            (Term::Known(a), Term::Known(b)) => Term::Known(Number::min(a, b)),
            _ => {
                let (a, b) = (self.place(a), self.place(b));
                self.push(Op::Min(a, b))
            }
        }
    }

    /// The greater of two.
    pub fn max(&mut self, a: Term, b: Term) -> Term {
        match (a, b) {
            (Term::Known(a), Term::Known(b)) => Term::Known(Number::max(a, b)),
            _ => {
                let (a, b) = (self.place(a), self.place(b));
                self.push(Op::Max(a, b))
            }
        }
    }

    fn shift(&mut self, a: u32, k: f64) -> Term {
        if k == 0.0 { Term::At(a) } else { self.push(Op::Shift(a, k)) }
    }

    fn scale(&mut self, a: u32, k: f64) -> Term {
        if k == 1.0 {
            Term::At(a)
        } else if k == -1.0 {
            self.unary(Unary::Neg, Term::At(a))
        } else {
            self.push(Op::Scale(a, k))
        }
    }

    /// aⁿ
    fn power(&mut self, a: Term, n: u32) -> Term {
        match (a, n) {
            (_, 0) => Term::Known(1.0),
            (_, 1) => a,
            (Term::Known(x), _) => Term::Known(power(x, n)),
            (_, 2) => self.unary(Unary::Square, a),
            (Term::At(a), _) => self.push(Op::Power(a, n)),
        }
    }

    /// a to the power b: by multiplication where b is a whole number, so that a may be negative;
    /// otherwise e^(b·ln a), which is undefined for a < 0.
    pub fn raise(&mut self, a: Term, b: Term) -> Term {
        if let Term::Known(exponent) = b {
            if exponent == 0.5 {
                return self.unary(Unary::Sqrt, a);
            }
            if exponent.fract() == 0.0 && exponent.abs() <= f64::from(MAX_POWER) {
                let power = self.power(a, exponent.abs() as u32);
                return if exponent < 0.0 { self.unary(Unary::Recip, power) } else { power };
            }
            if let Term::Known(base) = a {
                return Term::Known(base.powf(exponent));
            }
        }
        let ln = self.unary(Unary::Ln, a);
        let product = self.mul(b, ln);
        self.unary(Unary::Exp, product)
    }

    /// A function of one argument.
    pub fn unary(&mut self, f: Unary, a: Term) -> Term {
        match a {
            Term::Known(x) => Term::Known(f.of(x)),
            Term::At(a) => match (f, self.ops[a as usize]) {
                (Unary::Neg, Op::Unary(Unary::Neg, inner)) => Term::At(inner),
                _ => self.push(Op::Unary(f, a)),
            },
        }
    }
}

/// The greatest power that is computed by multiplication.
const MAX_POWER: u32 = 1024;

fn is_power_of_two(k: f64) -> bool {
    k.is_normal() && k.to_bits() << 12 == 0 && (1.0 / k).is_normal()
}

impl Op {
    fn operands(self, mut f: impl FnMut(u32)) {
        self.moved(|a| {
            f(a);
            a
        });
    }

    /// The same with its operands elsewhere.
    fn moved(self, mut to: impl FnMut(u32) -> u32) -> Self {
        match self {
            Self::Coordinate(_) | Self::Constant(_) => self,
            Self::Add(a, b) => Self::Add(to(a), to(b)),
            Self::Sub(a, b) => Self::Sub(to(a), to(b)),
            Self::Mul(a, b) => Self::Mul(to(a), to(b)),
            Self::Div(a, b) => Self::Div(to(a), to(b)),
            Self::Min(a, b) => Self::Min(to(a), to(b)),
            Self::Max(a, b) => Self::Max(to(a), to(b)),
            Self::Shift(a, k) => Self::Shift(to(a), k),
            Self::Scale(a, k) => Self::Scale(to(a), k),
            Self::Power(a, n) => Self::Power(to(a), n),
            Self::Unary(f, a) => Self::Unary(f, to(a)),
        }
    }
}
