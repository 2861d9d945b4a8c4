//! Lights without size: points, cones, and parallel light.

use glam::{DVec3, Vec3};

use super::LightSample;
use super::aim::{aim, aimed, scaled};
use super::bounds::{Cone, LightBounds, strength};
use crate::color::Rgb;
use crate::math::Bounds;

/// How a point light's irradiance depends on the distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Falloff {
    /// With the inverse square, as light does.
    #[default]
    InverseSquare,
    /// Not at all: the lecture's light. An intensity I gives the irradiance π·I everywhere, so that a
    /// diffuse surface shows k_d·I·(n·l).
    None,
}

/// A light that shines from a point into all directions.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLight {
    /// Where, relative to the scene's centre.
    pub position: DVec3,
    /// Radiant intensity, W/sr.
    pub intensity: Rgb,
    /// Dependence on the distance.
    pub falloff: Falloff,
}

/// A light that shines from a point into a cone, with the inverse square.
///
/// At the angle θ from the axis its intensity is I·s(t), t = (cos θ − cos_outer)/(cos_inner − cos_outer)
/// clamped to [0, 1], s(t) = t²·(3 − 2t). Source: pbrt 4ed §12.2.1 (`SpotLight`).
#[derive(Debug, Clone, PartialEq)]
pub struct SpotLight {
    /// Where, relative to the scene's centre.
    pub position: DVec3,
    /// The cone's axis, the way the light travels, unit length.
    pub direction: DVec3,
    /// Radiant intensity I within the inner cone, W/sr.
    pub intensity: Rgb,
    /// Cosine of the angle from the axis beyond which there is no light, in [−1, 1).
    pub cos_outer: f64,
    /// Cosine of the angle up to which the light is full, in [`cos_outer`, 1]; an edge where they are
    /// equal.
    pub cos_inner: f64,
}

/// A light so far away that its rays are parallel.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionalLight {
    /// The way the light travels, unit length.
    pub direction: Vec3,
    /// Irradiance on a plane that faces the light, W/m².
    pub irradiance: Rgb,
}

impl PointLight {
    #[inline]
    pub(super) fn sample(&self, p: DVec3) -> Option<LightSample> {
        let (sample, is_any) = self.sample_always(p);
        is_any.then_some(sample)
    }

    /// What arrives at `p`, found without a branch; and whether any does.
    #[inline(always)]
    pub(crate) fn sample_always(&self, p: DVec3) -> (LightSample, bool) {
        let k = match self.falloff {
            Falloff::InverseSquare => 1.0 / p.distance_squared(self.position),
            Falloff::None => std::f64::consts::PI,
        };
        aimed(p, self.position, 0.0, scaled(self.intensity, k))
    }

    pub(super) fn bounds(&self) -> Option<LightBounds> {
        (self.falloff == Falloff::InverseSquare).then(|| LightBounds {
            bounds: Bounds::of([self.position]),
            radius: 0.0,
            cone: Cone::ALL,
            falloff: 0.0,
            intensity: strength(self.intensity),
        })
    }
}

impl SpotLight {
    #[inline]
    pub(super) fn sample(&self, p: DVec3) -> Option<LightSample> {
        let cos = (p - self.position).try_normalize()?.dot(self.direction);
        let profile = self.profile(cos);
        // Also refuses NaN.
        if !(profile > 0.0) {
            return None;
        }
        let full = inverse_square(self.intensity, p, self.position)?;
        aim(p, self.position, 0.0, scaled(full, profile))
    }

    /// Intensity at an angle of cosine `cos` from the axis, relative to that on the axis.
    #[inline]
    fn profile(&self, cos: f64) -> f64 {
        if cos <= self.cos_outer {
            return 0.0;
        }
        if cos >= self.cos_inner {
            return 1.0;
        }
        let t = (cos - self.cos_outer) / (self.cos_inner - self.cos_outer);
        t * t * (3.0 - 2.0 * t)
    }

    /// The integral of the profile over the cosine: half of the smooth part, by its symmetry.
    pub(super) fn mean_cap(&self) -> f64 {
        let inner = self.cos_inner.max(self.cos_outer);
        1.0 - inner + 0.5 * (inner - self.cos_outer)
    }

    pub(super) fn bounds(&self) -> LightBounds {
        let outer = self.cos_outer.clamp(-1.0, 1.0).acos();
        let inner = self.cos_inner.clamp(-1.0, 1.0).acos().min(outer);
        // Emission beyond the cone is weighed by its cosine: no further than a quarter turn.
        let half_angle = inner.max(outer - std::f64::consts::FRAC_PI_2);
        LightBounds {
            bounds: Bounds::of([self.position]),
            radius: 0.0,
            cone: Cone { axis: self.direction, half_angle },
            falloff: outer - half_angle,
            intensity: strength(self.intensity),
        }
    }
}

impl DirectionalLight {
    #[inline]
    pub(super) fn sample(&self) -> LightSample {
        LightSample {
            direction: -self.direction,
            distance: f32::INFINITY,
            irradiance: self.irradiance,
        }
    }
}

/// Irradiance at `p` on a plane that faces `position`; none where they are one.
#[inline]
fn inverse_square(intensity: Rgb, p: DVec3, position: DVec3) -> Option<Rgb> {
    let d2 = p.distance_squared(position);
    (d2 > 0.0).then(|| scaled(intensity, 1.0 / d2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    #[test]
    fn irradiance_follows_the_falloff() {
        let mut light = PointLight {
            position: DVec3::new(0.0, 3.0, 0.0),
            intensity: Rgb::splat(18.0),
            falloff: Falloff::InverseSquare,
        };
        let s = light.sample(DVec3::ZERO).unwrap();
        assert_eq!((s.direction, s.distance, s.irradiance), (Vec3::Y, 3.0, Rgb::splat(2.0)));
        light.falloff = Falloff::None;
        assert_eq!(light.sample(DVec3::ZERO).unwrap().irradiance, Rgb::splat(18.0 * PI));
        assert_eq!(light.sample(DVec3::new(0.0, 3.0, 0.0)), None);
    }

    #[test]
    fn a_spot_fades_between_its_cones() {
        let (outer, inner) = (40f64.to_radians(), 20f64.to_radians());
        let mut light = SpotLight {
            position: DVec3::new(1.0, 2.0, 3.0),
            direction: DVec3::NEG_Y,
            intensity: Rgb::splat(8.0),
            cos_outer: outer.cos(),
            cos_inner: inner.cos(),
        };
        let at = |light: &SpotLight, degrees: f64| {
            let angle = degrees.to_radians();
            let p = light.position + 2.0 * DVec3::new(angle.sin(), -angle.cos(), 0.0);
            light.sample(p).map_or(0.0, |s| s.irradiance.r)
        };
        for degrees in [0.0, 10.0, 19.9] {
            assert_eq!(at(&light, degrees), 2.0, "{degrees}");
        }
        for degrees in [40.1, 90.0, 180.0] {
            assert_eq!(at(&light, degrees), 0.0, "{degrees}");
        }
        // Half-way in the cosine the smooth step is one half; a quarter of the way it is 5/32.
        for (t, step) in [(0.5, 0.5), (0.25, 5.0 / 32.0)] {
            let degrees = (outer.cos() + t * (inner.cos() - outer.cos())).acos().to_degrees();
            assert!((at(&light, degrees) - 2.0 * step).abs() < 1e-6);
        }
        assert_eq!(light.sample(light.position), None);
        light.cos_inner = light.cos_outer;
        assert_eq!((at(&light, 39.9), at(&light, 40.1)), (2.0, 0.0), "an edge");
    }
}
