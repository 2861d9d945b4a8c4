//! Which glasses and liquids a ray is inside of, and what they take from its light.

use crate::color::Rgb;

/// Media that a ray can be inside of at once; beyond, the one entered first is forgotten.
pub const MAX_NESTED: usize = 8;

/// The media that a ray is inside of, the one entered last first: the caller's indices plus 1, of 16
/// bits each.
///
/// Source: Schmidt and Budge, *Simple Nested Dielectrics in Ray Traced Images*, JGT 7(2) 2002.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Interior(u128);

const SLOT: u32 = 16;
const _: () = assert!(MAX_NESTED * SLOT as usize == u128::BITS as usize);

impl Interior {
    /// Inside nothing.
    pub const OUTSIDE: Self = Self(0);

    /// Whether it is inside nothing.
    #[inline]
    pub const fn is_outside(self) -> bool {
        self.0 == 0
    }

    /// After passing into medium `index`.
    #[inline]
    #[must_use]
    pub const fn entered(self, index: u16) -> Self {
        debug_assert!(index < u16::MAX);
        Self(self.0 << SLOT | (index as u128 + 1))
    }

    /// After passing out of medium `index`; the same where it was not inside.
    #[inline]
    #[must_use]
    pub const fn left(self, index: u16) -> Self {
        let id = index + 1;
        // Nearly always it is inside of nothing else.
        if self.0 == id as u128 {
            return Self::OUTSIDE;
        }
        let mut shift = 0;
        while shift < u128::BITS {
            if (self.0 >> shift) as u16 == id {
                let below = self.0 & ((1 << shift) - 1);
                // Two shifts, as one by 128 bits would overflow.
                let above = self.0 >> shift >> SLOT << shift;
                return Self(above | below);
            }
            if self.0 >> shift == 0 {
                break;
            }
            shift += SLOT;
        }
        self
    }

    /// The medium that fills the place: the one of highest priority, among equals the one entered
    /// last. None outside.
    #[inline]
    pub fn current(self, priority: impl Fn(u16) -> i32) -> Option<u16> {
        // Nearly always there is one at most.
        if self.0 >> SLOT == 0 { (self.0 as u16).checked_sub(1) } else { self.highest(priority) }
    }

    /// The one of highest priority, among equals the one entered last.
    #[cold]
    fn highest(self, priority: impl Fn(u16) -> i32) -> Option<u16> {
        let mut best: Option<u16> = None;
        let mut rest = self.0;
        while rest != 0 {
            let index = rest as u16 - 1;
            if best.is_none_or(|b| priority(index) > priority(b)) {
                best = Some(index);
            }
            rest >>= SLOT;
        }
        best
    }
}

/// Share of light that is left after `distance` in a medium of absorption coefficient σ:
/// exp(−σ·distance) (Beer and Lambert). Zero for an infinite distance in what absorbs.
#[inline]
pub fn beer_lambert(absorption: Rgb, distance: f32) -> Rgb {
    absorption.map(|sigma| if sigma == 0.0 { 1.0 } else { (-sigma * distance).exp() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_entered_of_the_highest_priority_fills_the_place() {
        let at = |interior: Interior| interior.current(|i| [0, 0, 5, -1][usize::from(i)]);
        let outside = Interior::OUTSIDE;
        assert_eq!(at(outside), None);
        let a = outside.entered(0);
        assert_eq!(at(a), Some(0));
        assert_eq!(at(a.entered(1)), Some(1), "a bubble within glass");
        assert_eq!(at(a.entered(2).entered(1)), Some(2), "the higher priority wins");
        assert_eq!(at(a.entered(3)), Some(0), "the lower one does not displace");
        assert_eq!(at(a.entered(1).left(0)), Some(1), "left in another order than entered");
        assert_eq!(a.entered(1).left(1), a);
        assert_eq!(a.left(0), outside);
        assert_eq!(a.left(3), a, "what it is not inside of cannot be left");
        assert_eq!(a.entered(0).left(0), a, "twice inside, once out");
    }

    #[test]
    fn the_ninth_forgets_the_first() {
        let deep = (0..9).fold(Interior::OUTSIDE, Interior::entered);
        assert_eq!(deep.left(0), deep);
        let out = (1..9).rev().fold(deep, Interior::left);
        assert!(out.is_outside());
        assert!((1..9).fold(deep, Interior::left).is_outside());
    }

    #[test]
    fn light_fades_exponentially() {
        let t = beer_lambert(Rgb::new(0.0, 0.5, 2.0), 3.0);
        assert_eq!(t.r, 1.0);
        assert!((t.g - (-1.5f32).exp()).abs() < 1e-7 && (t.b - (-6.0f32).exp()).abs() < 1e-8);
        assert_eq!(beer_lambert(Rgb::new(0.0, 1.0, 1.0), f32::INFINITY), Rgb::new(1.0, 0.0, 0.0));
    }
}
