//! Lights: where light comes from and how much of it arrives. What a surface does with it is
//! [`crate::material`]'s to know; whether something stands between is [`crate::accel`]'s.
//!
//! [`Light::sample`] draws a direction towards one light; [`LightTree`] draws one light of many.

mod aim;
mod bounds;
mod delta;
mod disk;
mod mesh;
#[cfg(test)]
mod oracle;
mod rectangle;
mod shape;
mod sphere;
mod tree;

use glam::Vec3;

use self::aim::scaled;
use self::bounds::LightBounds;
use crate::color::Rgb;

pub use delta::{DirectionalLight, Falloff, PointLight, SpotLight};
pub use disk::DiskLight;
pub use mesh::MeshLight;
pub use rectangle::RectangleLight;
pub use shape::ShapeLight;
pub use sphere::SphereLight;
pub use tree::{LightTree, PickedLight};

/// A light source. Coordinates are relative to the scene's centre; colours are not negative.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// A point.
    Point(PointLight),
    /// A point that shines into a cone.
    Spot(SpotLight),
    /// Parallel light from far away.
    Directional(DirectionalLight),
    /// A rectangle that shines to one side.
    Rectangle(RectangleLight),
    /// A disk that shines to one side.
    Disk(DiskLight),
    /// A sphere that shines outward.
    Sphere(SphereLight),
    /// Triangles.
    Mesh(MeshLight),
    /// A shape that is neither.
    Shape(ShapeLight),
}

/// What arrives at a point from one light, if nothing is in between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Distance to the light, infinite for a directional one. A light of some size is itself geometry:
    /// the distance ends so far off its surface that a ray query cannot take the surface for something
    /// in between.
    pub distance: f32,
    /// Irradiance on a plane that faces `direction`, W/m². For a light of some size it is an estimate:
    /// L·cosθ/(pdf·d²) with the probability density by area, or L/pdf by solid angle. Averaged over u,
    /// `response(n, wo, direction) · irradiance` is what leaves towards the viewer.
    pub irradiance: Rgb,
}

impl Light {
    /// What arrives at `p` from a point of the light that `u`, uniform in [0, 1)², chooses. None where
    /// nothing arrives: behind a one-sided light, outside a cone, inside a sphere, at the light itself.
    ///
    /// Neighbouring `u` give neighbouring points, so that well-distributed ones stay so. Lights without
    /// size ignore it. Everything in the result is finite (but a directional light's distance), for
    /// any finite `p`.
    ///
    /// The shadow ray starts at `p`: where that is moved off a surface first, sample from there.
    #[inline]
    pub fn sample(&self, p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let (p, u) = (p.as_dvec3(), u.map(f64::from));
        match self {
            Self::Point(light) => light.sample(p),
            Self::Spot(light) => light.sample(p),
            Self::Directional(light) => Some(light.sample()),
            Self::Rectangle(light) => light.sample(p, u),
            Self::Disk(light) => light.sample(p, u),
            Self::Sphere(light) => light.sample(p, u),
            Self::Mesh(light) => light.sample(p, u),
            Self::Shape(light) => light.sample(p, u),
        }
    }

    /// Whether it has no size, so that all samples at a point are equal and no ray meets it by chance.
    pub fn is_delta(&self) -> bool {
        matches!(self, Self::Point(_) | Self::Spot(_) | Self::Directional(_))
    }

    /// Total flux, W. For light that does not thin out (parallel, or a point without falloff): what
    /// enters a sphere of radius `scene_radius`, facing it or around it.
    pub fn power(&self, scene_radius: f64) -> Rgb {
        use std::f64::consts::{PI, TAU};
        match self {
            Self::Point(light) => match light.falloff {
                Falloff::InverseSquare => scaled(light.intensity, 4.0 * PI),
                Falloff::None => {
                    scaled(light.intensity, PI * 4.0 * PI * scene_radius * scene_radius)
                }
            },
            Self::Spot(light) => scaled(light.intensity, TAU * light.mean_cap()),
            Self::Directional(light) => scaled(light.irradiance, PI * scene_radius * scene_radius),
            Self::Rectangle(light) => scaled(light.radiance, PI * light.area()),
            Self::Disk(light) => scaled(light.radiance, PI * light.area()),
            Self::Sphere(light) => scaled(light.radiance, PI * light.area()),
            Self::Mesh(light) => {
                let sides = if light.two_sided() { 2.0 } else { 1.0 };
                scaled(light.radiance(), sides * PI * light.area())
            }
            Self::Shape(light) => scaled(light.radiance(), TAU * light.area()),
        }
    }

    /// What bounds its emission in space and direction; none where it reaches everywhere alike.
    fn bounds(&self) -> Option<LightBounds> {
        match self {
            Self::Point(light) => light.bounds(),
            Self::Spot(light) => Some(light.bounds()),
            Self::Directional(_) => None,
            Self::Rectangle(light) => Some(light.bounds()),
            Self::Disk(light) => Some(light.bounds()),
            Self::Sphere(light) => Some(light.bounds()),
            Self::Mesh(light) => Some(light.bounds()),
            Self::Shape(light) => Some(light.bounds()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;
    use std::sync::Arc;

    use crate::geometry::{Framed, Torus};
    use glam::{DAffine3, DVec3};
    use proptest::prelude::*;

    /// One light of each kind, `scale` in size, around `at`.
    fn one_of_each(at: DVec3, scale: f64) -> Vec<Light> {
        let radiance = Rgb::new(1.0, 0.0, 2.0);
        let (u, v) = (DVec3::new(2.0, 0.0, 0.5) * scale, DVec3::new(-0.5, 0.0, 2.0) * scale);
        let triangles = Arc::from([[at, at + u, at + v], [at, at + v, at - u]]);
        let torus = vec![Framed::new(
            Torus { major_radius: 0.7, minor_radius: 0.3 },
            DAffine3::from_scale(DVec3::splat(scale.max(1e-9))),
        )];
        let place = DAffine3::from_translation(at);
        let position = at;
        let falloff = Falloff::InverseSquare;
        vec![
            Light::Point(PointLight { position, intensity: radiance, falloff }),
            Light::Spot(SpotLight {
                position,
                direction: DVec3::NEG_Y,
                intensity: radiance,
                cos_outer: 0.5,
                cos_inner: 0.9,
            }),
            Light::Directional(DirectionalLight { direction: Vec3::X, irradiance: radiance }),
            Light::Rectangle(RectangleLight { corner: at, edge_u: u, edge_v: v, radiance }),
            Light::Rectangle(RectangleLight { corner: at, edge_u: u, edge_v: u + v, radiance }),
            Light::Disk(DiskLight { center: at, normal: DVec3::NEG_Y, radius: scale, radiance }),
            Light::Sphere(SphereLight { center: at, radius: scale, radiance }),
            Light::Mesh(MeshLight::new(Arc::clone(&triangles), radiance, false)),
            Light::Mesh(MeshLight::new(triangles, radiance, true)),
            Light::Shape(ShapeLight::new(&torus.into(), 0, place, radiance).expect("it can shine")),
        ]
    }

    fn check(light: &Light, p: Vec3, u: [f32; 2]) {
        let Some(s) = light.sample(p, u) else { return };
        assert!((s.direction.length() - 1.0).abs() < 1e-6, "{light:?} at {p}: {s:?}");
        assert!(s.irradiance.is_finite() && s.irradiance.g == 0.0, "{light:?} at {p}: {s:?}");
        assert!(s.irradiance.r >= 0.0 && s.irradiance.b >= 0.0, "{light:?} at {p}: {s:?}");
        let is_directional = matches!(light, Light::Directional(_));
        assert_eq!(s.distance.is_finite(), !is_directional, "{light:?} at {p}: {s:?}");
        assert!(s.distance > 0.0, "{light:?} at {p}: {s:?}");
    }

    proptest! {
        /// On it, at its edge, within it, beside it, far from it; large and small, near the origin and
        /// away from it: always finite.
        #[test]
        fn samples_are_finite(
            at in prop::array::uniform3(-1f64..1.0),
            offset in prop::array::uniform3(-2f64..2.0),
            log_offset in -12f64..12.0,
            log_scale in -6f64..6.0,
            log_at in -6f64..6.0,
            u in prop::array::uniform2(0f32..1.0),
        ) {
            let scale = 10f64.powf(log_scale);
            let at = DVec3::from(at) * 10f64.powf(log_at);
            let offset = DVec3::from(offset);
            for light in one_of_each(at, scale) {
                for from in [DVec3::ZERO, DVec3::X, DVec3::NEG_Y, DVec3::new(2.0, 0.0, 0.5)] {
                    let near = at + from * scale + offset * scale * 10f64.powf(log_offset.min(0.0));
                    let edge = at + from * scale;
                    let far = at + offset * scale * 10f64.powf(log_offset);
                    for p in [near, edge, far] {
                        for u in [u, [0.0, 0.0], [u[0], 0.0], [0.999_999_94, 0.999_999_94]] {
                            check(&light, p.as_vec3(), u);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn samples_are_finite_at_the_ends_of_the_range() {
        for light in one_of_each(DVec3::new(0.1, -0.2, 0.3), 1.0) {
            for x in [0.0, 1e-38, -1e-45, 1e30, f32::MAX, -f32::MAX] {
                for p in [Vec3::splat(x), Vec3::new(x, -x, 0.0), Vec3::new(0.1, -0.2, x)] {
                    check(&light, p, [0.3, 0.8]);
                }
            }
        }
        for light in one_of_each(DVec3::ZERO, 0.0) {
            check(&light, Vec3::ZERO, [0.5, 0.5]);
            check(&light, Vec3::NEG_Y, [0.5, 0.5]);
        }
    }

    /// The flux through a sphere around the light, by samples on it.
    #[test]
    fn power_is_the_flux_through_a_sphere_around() {
        let mut random = oracle::Random::new(3);
        for light in one_of_each(DVec3::ZERO, 1.0) {
            if matches!(light, Light::Directional(_)) {
                continue;
            }
            let radius = 6.0;
            let estimate = oracle::Estimate::of(40_000, |_| {
                let n = random.direction();
                let arrives = light.sample((n * radius).as_vec3(), random.square());
                arrives.map_or(0.0, |s| {
                    let cos = -n.dot(s.direction.as_dvec3());
                    f64::from(s.irradiance.b) * cos * 4.0 * PI * radius * radius
                })
            });
            let power = f64::from(light.power(1.0).b);
            assert!(estimate.agrees_with(power), "{light:?}: {estimate:?}, not {power}");
        }
    }
}
