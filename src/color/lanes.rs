//! Colours side by side.

use super::Rgb;

/// `N` colours by component, red first. Loops over its lanes without branches become vector instructions.
// Aligned, so that what they load lies in one line of the cache.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub struct RgbLanes<const N: usize>(pub [[f32; N]; 3]);

impl<const N: usize> RgbLanes<N> {
    /// Nothing everywhere.
    pub const BLACK: Self = Self([[0.0; N]; 3]);

    /// One colour everywhere.
    #[inline(always)]
    pub fn splat(color: Rgb) -> Self {
        Self(color.to_array().map(|c| [c; N]))
    }

    /// The colour that `of` gives for each lane.
    #[inline(always)]
    pub fn from_fn(mut of: impl FnMut(usize) -> Rgb) -> Self {
        let mut lanes = Self::BLACK;
        for lane in 0..N {
            lanes.set(lane, of(lane));
        }
        lanes
    }

    /// The colour of a lane.
    #[inline(always)]
    pub const fn get(&self, lane: usize) -> Rgb {
        let [r, g, b] = &self.0;
        Rgb::new(r[lane], g[lane], b[lane])
    }

    /// Sets the colour of a lane.
    #[inline(always)]
    pub const fn set(&mut self, lane: usize, color: Rgb) {
        let [r, g, b] = &mut self.0;
        (r[lane], g[lane], b[lane]) = (color.r, color.g, color.b);
    }

    /// The same with one factor for each lane.
    #[inline(always)]
    #[must_use]
    pub fn weighed(mut self, weights: &[f32; N]) -> Self {
        for c in &mut self.0 {
            c.iter_mut().zip(weights).for_each(|(value, weight)| *value *= weight);
        }
        self
    }
}
