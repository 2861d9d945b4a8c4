//! Lights: where light comes from and how much of it arrives. What a surface does with it is
//! [`crate::material`]'s to know; whether something stands between is [`crate::accel`]'s.

use glam::{DVec3, Vec3};

use crate::color::Rgb;

/// A light source.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// A point.
    Point(PointLight),
    /// Parallel light from far away.
    Directional(DirectionalLight),
}

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

/// A light so far away that its rays are parallel.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionalLight {
    /// The way the light travels, unit length.
    pub direction: Vec3,
    /// Irradiance on a plane that faces the light, W/m².
    pub irradiance: Rgb,
}

/// What arrives at a point from one light, if nothing is in between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Distance to the light.
    pub distance: f32,
    /// Irradiance on a plane that faces the light, W/m².
    pub irradiance: Rgb,
}

impl Light {
    /// What arrives at `p`. None at the light itself, where no direction is defined.
    #[inline]
    pub fn sample(&self, p: Vec3) -> Option<LightSample> {
        match self {
            Self::Point(light) => light.sample(p),
            Self::Directional(light) => Some(LightSample {
                direction: -light.direction,
                distance: f32::INFINITY,
                irradiance: light.irradiance,
            }),
        }
    }
}

impl PointLight {
    fn sample(&self, p: Vec3) -> Option<LightSample> {
        let to_light = self.position - p.as_dvec3();
        let distance = to_light.length();
        if distance == 0.0 {
            return None;
        }
        let irradiance = match self.falloff {
            Falloff::InverseSquare => self.intensity * ((1.0 / (distance * distance)) as f32),
            Falloff::None => self.intensity * std::f32::consts::PI,
        };
        let direction = (to_light / distance).as_vec3();
        Some(LightSample { direction, distance: distance as f32, irradiance })
    }
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
        let s = light.sample(Vec3::ZERO).unwrap();
        assert_eq!((s.direction, s.distance, s.irradiance), (Vec3::Y, 3.0, Rgb::splat(2.0)));
        light.falloff = Falloff::None;
        assert_eq!(light.sample(Vec3::ZERO).unwrap().irradiance, Rgb::splat(18.0 * PI));
        assert_eq!(light.sample(Vec3::new(0.0, 3.0, 0.0)), None);
    }
}
