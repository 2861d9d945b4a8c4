//! Where a texture that is a function of space lies on or in an object, and what of it a footprint
//! covers.

use glam::{DAffine3, DVec3, Vec3};

use super::{BumpGradient, TexturePoint};

/// The coordinates that a texture is a function of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Space {
    /// Object space: the object is carved out of the texture.
    #[default]
    Position,
    /// The surface's (u, v, 0).
    Uv,
}

/// How a texture that is a function of space is laid into an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// What is transformed.
    pub space: Space,
    /// From there to the texture's own space.
    pub texture_from_object: DAffine3,
}

impl Default for Placement {
    /// Object space as it is.
    fn default() -> Self {
        Self { space: Space::Position, texture_from_object: DAffine3::IDENTITY }
    }
}

/// A footprint in a texture's own space. All numbers are finite.
#[derive(Debug, Clone, Copy)]
pub(super) struct Region {
    /// Its centre.
    pub center: DVec3,
    /// How far it extends along each axis, both sides together.
    pub extent: DVec3,
}

/// Largest coordinate and footprint; beyond it there is only noise, and squares overflow.
const FAR: f64 = 1e100;

impl Placement {
    /// A footprint in the texture's own space.
    pub(super) fn region(&self, point: &TexturePoint) -> Region {
        let footprint = &point.footprint;
        let (position, normal, width) = match self.space {
            Space::Position => (point.position, footprint.normal.as_dvec3(), footprint.width),
            Space::Uv => (point.uv.extend(0.0).as_dvec3(), DVec3::Z, footprint.uv_width),
        };
        let center = finite(self.texture_from_object.transform_point3(position));
        let width = if width > 0.0 { f64::from(width) } else { 0.0 };
        // A disc of unit diameter across `normal` extends along a direction by the length of what
        // is left of the direction without its part along the normal; a ball by all of it.
        let normal = normal.normalize_or_zero();
        let matrix = self.texture_from_object.matrix3;
        let reach = |i| (matrix.row(i) - matrix.row(i).dot(normal) * normal).length();
        let extent = finite(width * DVec3::new(reach(0), reach(1), reach(2)));
        Region { center, extent }
    }

    /// The gradient of a texture's value, from values about the middle of `region`. `size` is that
    /// of the texture's smallest features in its own space.
    pub(super) fn gradient(
        &self,
        region: &Region,
        size: f64,
        value: impl Fn(&Region) -> f64,
    ) -> BumpGradient {
        let step = (region.extent.max_element() / 2.0).max(1e-4 * size.abs());
        let step = step.max(1e-9 * region.center.abs().max_element());
        let slope = |axis: DVec3| {
            let at = |side: f64| value(&Region { center: region.center + side * axis, ..*region });
            (at(step) - at(-step)) / (2.0 * step)
        };
        let slopes = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
        let gradient = if slopes.is_finite() { slopes } else { DVec3::ZERO };
        let gradient = self.texture_from_object.matrix3.transpose() * gradient;
        match self.space {
            Space::Position => BumpGradient::Position(finite_f32(gradient)),
            Space::Uv => {
                let Vec3 { x, y, .. } = finite_f32(gradient);
                BumpGradient::Uv { du: x, dv: y }
            }
        }
    }
}

/// Each component within ±10¹⁰⁰; 0 for NaN.
fn finite(v: DVec3) -> DVec3 {
    DVec3::from_array(v.to_array().map(|x| if x.is_nan() { 0.0 } else { x.clamp(-FAR, FAR) }))
}

/// In f32; zero where that cannot hold it.
pub(super) fn finite_f32(v: DVec3) -> Vec3 {
    let v = v.as_vec3();
    if v.is_finite() { v } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::Footprint;

    fn region(placement: &Placement, normal: Vec3, width: f32) -> Region {
        let footprint = Footprint { width, uv_width: 0.0, normal };
        placement.region(&TexturePoint { footprint, ..TexturePoint::default() })
    }

    #[test]
    fn a_disc_has_no_thickness_and_a_ball_has() {
        let placement = Placement::default();
        assert_eq!(region(&placement, Vec3::ZERO, 2.0).extent, DVec3::splat(2.0));
        assert_eq!(region(&placement, Vec3::Y, 2.0).extent, DVec3::new(2.0, 0.0, 2.0));
        let tilted = region(&placement, Vec3::new(0.6, 0.8, 0.0), 1.0).extent;
        assert!((tilted - DVec3::new(0.8, 0.6, 1.0)).length() < 1e-6, "{tilted}");
    }

    #[test]
    fn extents_follow_the_transform() {
        let texture_from_object = DAffine3::from_scale(DVec3::new(2.0, 3.0, 5.0));
        let placement = Placement { texture_from_object, ..Placement::default() };
        assert_eq!(region(&placement, Vec3::Z, 1.0).extent, DVec3::new(2.0, 3.0, 0.0));
    }

    #[test]
    fn gradients_are_in_object_space() {
        let texture_from_object =
            DAffine3::from_rotation_z(0.3) * DAffine3::from_scale(DVec3::splat(2.0));
        let slope = DVec3::new(0.3, -0.2, 0.7);
        let value = |region: &Region| slope.dot(region.center);
        for space in [Space::Position, Space::Uv] {
            let placement = Placement { space, texture_from_object };
            let expected = (texture_from_object.matrix3.transpose() * slope).as_vec3();
            let region = placement.region(&TexturePoint::default());
            match placement.gradient(&region, 1.0, value) {
                BumpGradient::Position(g) => assert!((g - expected).length() < 1e-6),
                BumpGradient::Uv { du, dv } => {
                    assert!((du - expected.x).abs() + (dv - expected.y).abs() < 1e-6);
                }
            }
        }
    }
}
