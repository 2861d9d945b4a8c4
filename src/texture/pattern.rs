//! Textures that make a number of a place and a colour of the number.

use std::f64::consts::PI;

use glam::DVec3;

use super::place::{Placement, Region};
use super::ramp::Ramp;
use super::{BumpGradient, TexturePoint};
use crate::color::Rgb;
use crate::math::noise::{fbm, turbulence};

/// Clouds: gradient noise in octaves, through colours.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Colours from 0 (deepest hollows) to 1 (highest hills); most of the noise lies between 0.2 and
    /// 0.8, evenly about 0.5.
    pub ramp: Ramp,
    /// The size of the largest lumps in the texture's own space, above 0.
    pub scale: f64,
    /// How many noises, each twice as fine as the one before, are added: 1 to 16.
    pub octaves: u32,
    /// How strong each is compared with the one before: 0 to 1, 0.5 looks natural.
    pub gain: f64,
    /// Different seeds give different clouds.
    pub seed: u32,
    /// How the clouds lie in the object.
    pub placement: Placement,
}

impl Noise {
    /// The colour, without what is finer than the footprint.
    pub fn color(&self, point: &TexturePoint) -> Rgb {
        self.ramp.color(self.height(&self.placement.region(point)), 0.0)
    }

    /// See [`super::Texture::value_gradient`].
    pub fn value_gradient(&self, point: &TexturePoint) -> BumpGradient {
        let value = |region: &Region| self.ramp.luminance(self.height(region), 0.0);
        let finest = self.scale / f64::from(1_u32 << self.octaves.min(15));
        self.placement.gradient(&self.placement.region(point), finest, value)
    }

    fn height(&self, region: &Region) -> f64 {
        let (p, width) = scaled(region, self.scale);
        0.5 + 0.5 * fbm(p, width, self.octaves, self.gain, self.seed)
    }
}

/// Marble: bands across the x axis, bent by turbulence.
///
/// Source: Perlin, *An Image Synthesizer*, SIGGRAPH 1985.
#[derive(Debug, Clone, PartialEq)]
pub struct Marble {
    /// Colours from 0 (one side of a band) to 1 (the other).
    pub ramp: Ramp,
    /// From band to band along x in the texture's own space, above 0.
    pub scale: f64,
    /// How far turbulence bends the bands, in distances between them: 0 is straight, 1 is marble, 4 is wild.
    pub turbulence: f64,
    /// How many noises, each twice as fine as the one before, are in the turbulence: 1 to 16.
    pub octaves: u32,
    /// Different seeds give different stones.
    pub seed: u32,
    /// How the bands lie in the object.
    pub placement: Placement,
}

impl Marble {
    /// The colour; bands and bends that are finer than the footprint fade to the middle colour.
    pub fn color(&self, point: &TexturePoint) -> Rgb {
        self.ramp.color(self.height(&self.placement.region(point)), 0.0)
    }

    /// See [`super::Texture::value_gradient`].
    pub fn value_gradient(&self, point: &TexturePoint) -> BumpGradient {
        let value = |region: &Region| self.ramp.luminance(self.height(region), 0.0);
        let finest = self.scale / f64::from(1_u32 << self.octaves.min(15));
        self.placement.gradient(&self.placement.region(point), finest, value)
    }

    fn height(&self, region: &Region) -> f64 {
        let (p, width) = scaled(region, self.scale);
        let bend = self.turbulence * turbulence(p, width, self.octaves, self.seed);
        // A sine averaged over a width is the sine times a sinc.
        let phase = PI * (region.extent.x / self.scale).abs();
        let strength = if phase > 1e-4 { (phase.sin() / phase).max(0.0) } else { 1.0 };
        let wave = strength * (2.0 * PI * (p.x + bend)).sin();
        if wave.is_finite() { 0.5 + 0.5 * wave } else { 0.5 }
    }
}

/// Colours along an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// From the origin of the texture's own space, where the ramp is at 0, to where it is at 1.
    pub axis: DVec3,
    /// The colours.
    pub ramp: Ramp,
    /// How the axis lies in the object.
    pub placement: Placement,
}

impl Gradient {
    /// The colour, averaged over the footprint's extent along the axis.
    pub fn color(&self, point: &TexturePoint) -> Rgb {
        let (t, width) = self.along(&self.placement.region(point));
        self.ramp.color(t, width)
    }

    /// See [`super::Texture::value_gradient`].
    pub fn value_gradient(&self, point: &TexturePoint) -> BumpGradient {
        let value = |region: &Region| {
            let (t, width) = self.along(region);
            self.ramp.luminance(t, width)
        };
        self.placement.gradient(&self.placement.region(point), self.axis.length(), value)
    }

    /// The place along the axis and the footprint's extent there; the start where there is no axis.
    fn along(&self, region: &Region) -> (f64, f64) {
        let per_length = self.axis / self.axis.length_squared();
        let (t, width) = (region.center.dot(per_length), region.extent.dot(per_length.abs()));
        if t.is_finite() && width.is_finite() { (t, width) } else { (0.0, 0.0) }
    }
}

/// A region's centre and its largest extent, in units of `scale`; the origin where that is not
/// possible.
fn scaled(region: &Region, scale: f64) -> (DVec3, f64) {
    let p = region.center / scale;
    let width = (region.extent.max_element() / scale).abs();
    if p.is_finite() && width.is_finite() { (p, width) } else { (DVec3::ZERO, f64::MAX) }
}
