//! The first root of f along a ray, none skipped.
//!
//! The piece of the ray that lies in the box is narrowed from the near end. What an [`Enclosure`] proves to
//! be without a root is dropped; where its strip cuts the axis in less than half of the piece, that is what
//! remains; otherwise the piece is halved. So pieces are dropped only by proof, a feature of any thickness
//! is found, and close to a simple root the width of a piece falls with its square.
//!
//! A piece so small that it is not narrowed further, of which f cannot be proven to be free, is a hit: f
//! changes its sign there, or touches 0, or comes so close that the enclosure over a millionth of a
//! millionth of the ray does not tell (a ball of 1 m is hit by rays that pass it at some 10⁻¹⁵ m). So is a
//! larger piece on which f is 0 as far as its rounding lets it be known. A ray that lies in the surface
//! hits it where it begins. A pole, where f changes sign through infinity, is no surface.

use super::enclosure::Enclosure;
use super::interval::up;
use super::tape::Tape;

/// Part of the ray's length in the box at which a piece is not halved any further.
const FINEST: f64 = 1e-12;

/// Evaluations after which what is left of a ray is only looked at for changes of sign between the ends
/// of its pieces.
const MAX_EVALUATIONS: u32 = 8192;

/// A ray through the box, from t = 0 to `length`.
pub(super) struct Segment {
    /// Where it enters.
    pub origin: [f64; 3],
    /// Direction, of any length.
    pub direction: [f64; 3],
    /// Where it leaves, in lengths of the direction.
    pub length: f64,
}

/// What a search has done, for measurements.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Effort {
    /// Enclosures computed.
    pub evaluations: u32,
}

struct Search<'a> {
    tape: &'a Tape,
    ray: &'a Segment,
    registers: &'a mut [Enclosure],
    evaluations: u32,
}

/// The first root that `accept` takes.
pub(super) fn first_root(
    tape: &Tape,
    ray: &Segment,
    accept: impl Fn(f64) -> bool,
    effort: &mut Effort,
) -> Option<f64> {
    tape.with_registers(|registers| {
        let mut search = Search { tape, ray, registers, evaluations: 0 };
        let root = search.run(accept);
        effort.evaluations += search.evaluations;
        root
    })
}

/// What is known of f's sign at a point.
#[derive(Clone, Copy, PartialEq)]
enum Sign {
    Negative,
    Positive,
    /// Near 0, or none.
    Unknown,
}

impl Search<'_> {
    fn run(&mut self, accept: impl Fn(f64) -> bool) -> Option<f64> {
        let length = self.ray.length;
        let finest = FINEST * length;
        // Halving pushes one piece, and no piece is halved more often than FINEST allows.
        let mut later = [(0.0, 0.0); 64];
        let mut waiting = 0;
        let (mut from, mut to) = (0.0, length);
        loop {
            let root = loop {
                if self.evaluations >= MAX_EVALUATIONS {
                    break self.sign_change(from, to);
                }
                let middle = 0.5 * (from + to);
                let half = up(f64::max(to - middle, middle - from));
                let f = self.enclosure(middle, half);
                if !f.range.may_be_zero() || f.range.lo > f.range.hi {
                    break None;
                }
                // What the strip leaves: |center + slope·τ| ≤ width.
                let (mut a, mut b) = (from, to);
                let cut = f.slope != 0.0 && f.width < f64::INFINITY;
                if cut {
                    let (near, far) =
                        ((-f.center - f.width) / f.slope, (f.width - f.center) / f.slope);
                    let (near, far) = if near < far { (near, far) } else { (far, near) };
                    let doubt = 4.0 * f64::EPSILON;
                    a = f64::max(a, middle + (near - doubt * near.abs() - doubt) * half);
                    b = f64::min(b, middle + (far + doubt * far.abs() + doubt) * half);
                    // By more than t itself may be rounded.
                    if a > b + 4.0 * f64::EPSILON * to {
                        break None;
                    }
                }
                let narrowed = b - a < 0.5 * (to - from);
                // No number lies between, or none that matters.
                if to - from <= f64::max(finest, 4.0 * f64::EPSILON * to) {
                    break if narrowed { Some(0.5 * (a + b)) } else { self.judge(from, to) };
                }
                if narrowed {
                    (from, to) = (f64::min(a, b), f64::max(a, b));
                    continue;
                }
                if to - from < 1e-5 * length && self.is_flat(&f, middle) {
                    break Some(middle);
                }
                let middle = 0.5 * (a + b);
                if waiting == later.len() {
                    break self.judge(from, to);
                }
                later[waiting] = (middle, b);
                waiting += 1;
                (from, to) = (a, middle);
            };
            if let Some(t) = root
                && accept(t)
            {
                return Some(t);
            }
            if waiting == 0 {
                return None;
            }
            waiting -= 1;
            (from, to) = later[waiting];
        }
    }

    /// f for t within `half` of `middle`.
    #[inline]
    fn enclosure(&mut self, middle: f64, half: f64) -> Enclosure {
        self.evaluations += 1;
        let (o, d) = (&self.ray.origin, &self.ray.direction);
        let xyz = std::array::from_fn(|i| Enclosure::along(o[i], d[i], middle, half));
        self.tape.evaluate(xyz, self.registers)
    }

    /// Whether f is 0 all over a piece, as far as its rounding in the middle lets it be known.
    fn is_flat(&mut self, f: &Enclosure, middle: f64) -> bool {
        let point = self.enclosure(middle, 0.0);
        f.range.magnitude() <= 4.0 * point.width
    }

    fn sign(&mut self, t: f64) -> Sign {
        let f = self.enclosure(t, 0.0);
        if f.range.lo > f.range.hi {
            Sign::Unknown
        } else if f.range.lo > 0.0 {
            Sign::Positive
        } else if f.range.hi < 0.0 {
            Sign::Negative
        } else {
            Sign::Unknown
        }
    }

    /// The hit in a piece that is not narrowed any further, unless f has a pole there.
    fn judge(&mut self, from: f64, to: f64) -> Option<f64> {
        self.sign_change(from, to).or_else(|| {
            let middle = 0.5 * (from + to);
            self.is_bounded(middle, 0.5 * (to - from)).then_some(middle)
        })
    }

    /// Where f changes sign, if it certainly has opposite signs at the ends of a piece.
    fn sign_change(&mut self, from: f64, to: f64) -> Option<f64> {
        match (self.sign(from), self.sign(to)) {
            (Sign::Positive, Sign::Negative) | (Sign::Negative, Sign::Positive) => {
                let root = self.bracketed(from, to);
                self.is_bounded(root, 4.0 * f64::EPSILON * to).then_some(root)
            }
            _ => None,
        }
    }

    /// Whether f has bounds around a root, and so no pole there.
    fn is_bounded(&mut self, root: f64, half: f64) -> bool {
        self.enclosure(root, half).width < f64::INFINITY
    }

    /// The root between two points where f has opposite signs, to the last digit: the secant's, halving
    /// the stake of the end that stays (Illinois), or the middle where that is slow.
    fn bracketed(&mut self, from: f64, to: f64) -> f64 {
        let (mut a, mut b) = (from, to);
        let (mut fa, mut fb) = (self.enclosure(a, 0.0).center, self.enclosure(b, 0.0).center);
        for step in 0..120 {
            let middle = 0.5 * (a + b);
            if !(b - a > 2.0 * f64::EPSILON * b) || middle <= a || middle >= b {
                break;
            }
            let secant = a + (b - a) * (fa / (fa - fb));
            let t = if step % 4 < 3 && secant > a && secant < b { secant } else { middle };
            let f = self.enclosure(t, 0.0).center;
            if f == 0.0 {
                return t;
            }
            if (f < 0.0) == (fa < 0.0) {
                (a, fa, fb) = (t, f, 0.5 * fb);
            } else {
                (b, fb, fa) = (t, f, 0.5 * fa);
            }
        }
        0.5 * (a + b)
    }
}
