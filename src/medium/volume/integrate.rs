//! Light along a ray through volumes that may overlap.
//!
//! The way is cut where any volume's piece begins or ends ([`super::pieces`]). In between, the sum of
//! extinctions is a cubic, so the optical depth τ is exact. Of the emission
//!
//! ∫ c(τ)·exp(−τ) dτ
//!
//! with c the mean colour by extinction, only c is approximated: as linear in τ over both halves of a
//! step, then extrapolated from one step and two halves (Richardson), which leaves an error of fourth
//! order in the step where c is smooth in τ. A step is halved until both differ by less than the
//! tolerance. Where the colour does not vary the result is exact.

use glam::DVec3;

use super::Volume;
use super::pieces::{Piece, Pieces};
use crate::geometry::grid::Cubic;

/// Steps are halved this often at most.
const MOST_HALVINGS: u32 = 10;

/// Where less than this is left of what is behind, a ray ends.
const OPAQUE: f64 = 1e-6;

/// A part of a ray within volumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slab {
    /// Where it begins, in lengths of the ray's direction.
    pub t0: f64,
    /// Where it ends.
    pub t1: f64,
    /// The share of light that passes all before it.
    pub before: f64,
    /// The share that passes all to its end.
    pub after: f64,
    /// The light that it adds at the ray's origin, dimmed by all before it.
    pub light: [f64; 3],
}

/// Tells each part of a ray, from its origin to `t_max`, on which there is something, in order.
pub fn march(
    volumes: &[Volume],
    origin: DVec3,
    direction: DVec3,
    t_max: f64,
    tell: impl FnMut(Slab),
) {
    let steps = Steps { tolerance: None, most_halvings: MOST_HALVINGS };
    march_by(volumes, origin, direction, t_max, steps, tell);
}

/// How long steps are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps {
    /// That of the volumes where not given.
    pub(super) tolerance: Option<f64>,
    pub(super) most_halvings: u32,
}

pub(super) fn march_by(
    volumes: &[Volume],
    origin: DVec3,
    direction: DVec3,
    t_max: f64,
    steps: Steps,
    tell: impl FnMut(Slab),
) {
    let (mut tolerance, mut brightest) = (f64::INFINITY, 0.0f64);
    let mut ways = Vec::new();
    for volume in volumes {
        let mut pieces = Pieces::new(volume, origin, direction, t_max);
        if let Some(first) = pieces.next() {
            ways.push((pieces, Some(first)));
            tolerance = tolerance.min(volume.tolerance);
            brightest = brightest.max(volume.transfer.brightest());
        }
    }
    if ways.is_empty() {
        return;
    }
    let tolerance = steps.tolerance.unwrap_or(tolerance) * brightest;
    let most_halvings = steps.most_halvings;
    March { length: direction.length(), tolerance, ways, most_halvings }.each(tell);
}

/// The way of a ray through volumes.
struct March<'v, P> {
    length: f64,
    tolerance: f64,
    /// The rest of each volume's pieces, and the one that the ray is in, or before.
    ways: Vec<(P, Option<Piece<'v>>)>,
    most_halvings: u32,
}

impl<'v, P: Iterator<Item = Piece<'v>>> March<'v, P> {
    fn each(mut self, mut tell: impl FnMut(Slab)) {
        let mut transmittance = 1.0;
        let mut here = Vec::with_capacity(self.ways.len());
        let mut t = f64::NEG_INFINITY;
        while transmittance > OPAQUE {
            // The next stretch in which no piece begins or ends.
            let starts = self.ways.iter().filter_map(|(_, piece)| piece.as_ref().map(|p| p.t0));
            t = starts.fold(f64::INFINITY, f64::min).max(t);
            let ends = self.ways.iter().filter_map(|(_, piece)| {
                piece.as_ref().map(|p| if p.t0 > t { p.t0 } else { p.t1 })
            });
            let end = ends.fold(f64::INFINITY, f64::min);
            if !(end < f64::INFINITY) {
                return;
            }
            here.clear();
            for (_, piece) in &self.ways {
                if let Some(piece) = piece.as_ref().filter(|p| p.t0 <= t) {
                    let at = |t: f64| (t - piece.t0) / (piece.t1 - piece.t0);
                    let from = if t == piece.t0 { 0.0 } else { at(t) };
                    let to = if end == piece.t1 { 1.0 } else { at(end) };
                    here.push((piece.value.part(from, to), piece.span));
                }
            }
            let stretch = Stretch { here: &here, tolerance: self.tolerance / transmittance };
            let (light, passed) = stretch.integrate((end - t) * self.length, self.most_halvings);
            let after = transmittance * passed;
            let light = light.map(|x| x * transmittance);
            tell(Slab { t0: t, t1: end, before: transmittance, after, light });
            transmittance = after;
            t = end;
            for (pieces, piece) in &mut self.ways {
                if piece.as_ref().is_some_and(|p| p.t1 <= t) {
                    *piece = pieces.next();
                }
            }
        }
    }
}

/// A stretch of a ray, and what each volume there does: its value, and the linear part of its transfer
/// function.
struct Stretch<'a, 'v> {
    here: &'a [(Cubic, &'v super::transfer::TransferSpan)],
    tolerance: f64,
}

impl Stretch<'_, '_> {
    /// The light of a stretch of this length, and what passes it.
    fn integrate(&self, length: f64, halvings: u32) -> ([f64; 3], f64) {
        let mut extinction = [0.0; 4];
        for (value, span) in self.here {
            let [a, b] = span.extinction;
            let one = value.mapped(a, b).0;
            extinction = std::array::from_fn(|i| extinction[i] + one[i]);
        }
        let ends = [self.color(0.0), self.color(1.0)];
        self.step(Cubic(extinction), [0.0, 1.0], ends, length, self.tolerance, halvings)
    }

    /// The colour at `s` in [0, 1]: the mean of all by their extinctions.
    #[inline]
    fn color(&self, s: f64) -> [f64; 3] {
        let of = |value: f64, line: &[[f64; 2]; 3]| line.map(|[a, b]| a + b * value);
        if let [(value, span)] = self.here {
            return of(value.at(s), &span.color);
        }
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for (value, span) in self.here {
            let value = value.at(s);
            // Never quite zero, so that a colour remains where nothing absorbs.
            let extinction = (span.extinction[0] + span.extinction[1] * value).max(1e-30);
            let color = of(value, &span.color);
            sum = std::array::from_fn(|i| sum[i] + extinction * color[i]);
            weight += extinction;
        }
        sum.map(|x| x / weight)
    }

    fn step(
        &self,
        extinction: Cubic,
        [from, to]: [f64; 2],
        [c0, c1]: [[f64; 3]; 2],
        length: f64,
        tolerance: f64,
        halvings: u32,
    ) -> ([f64; 3], f64) {
        let halves = extinction.split(0.5);
        let [d0, d1] = halves.map(|half| half.mean().max(0.0) * 0.5 * length);
        let middle = 0.5 * (from + to);
        let cm = self.color(middle);
        let (one, first, second) = (Weights::of(d0 + d1), Weights::of(d0), Weights::of(d1));
        let passed = first.passed * second.passed;
        let (mut light, mut off) = ([0.0; 3], 0.0f64);
        for i in 0..3 {
            let whole = one.light(c0[i], c1[i]);
            let both = first.light(c0[i], cm[i]) + first.passed * second.light(cm[i], c1[i]);
            off = off.max((both - whole).abs());
            light[i] = (both + (both - whole) / 3.0).max(0.0);
        }
        if off <= tolerance || halvings == 0 {
            return (light, passed);
        }
        let [near, far] = halves;
        let half = 0.5 * length;
        let (near, t0) = self.step(near, [from, middle], [c0, cm], half, tolerance, halvings - 1);
        let (far, t1) = self.step(far, [middle, to], [cm, c1], half, tolerance, halvings - 1);
        (std::array::from_fn(|i| near[i] + t0 * far[i]), t0 * t1)
    }
}

/// What the colours at both ends of a step count for, if they are linear in the optical depth Δ between:
/// ∫₀^Δ c(τ)·exp(−τ) dτ.
struct Weights {
    near: f64,
    far: f64,
    passed: f64,
}

impl Weights {
    #[inline]
    fn of(depth: f64) -> Self {
        let absorbed = -(-depth).exp_m1();
        if depth < 1e-6 {
            // The differences below would cancel.
            return Self { near: 0.5 * absorbed, far: 0.5 * absorbed, passed: 1.0 - absorbed };
        }
        let near = 1.0 - absorbed / depth;
        Self { near, far: absorbed - near, passed: 1.0 - absorbed }
    }

    #[inline]
    fn light(&self, near: f64, far: f64) -> f64 {
        self.near * near + self.far * far
    }
}
