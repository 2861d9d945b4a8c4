//! Triangles that emit.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use glam::DVec3;

use super::LightSample;
use super::aim::{aim, lift, scaled};
use super::bounds::{Cone, LightBounds, angle_between, strength};
use crate::color::Rgb;
use crate::math::Bounds;

/// Triangles of constant radiance. A point is drawn uniformly by area, from a number of 24 bits: where
/// triangles are many (10⁵ and more), several lights with a part each are drawn from better.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshLight {
    triangles: Arc<[[DVec3; 3]]>,
    /// Area of the triangles up to and including each.
    areas: Arc<[f64]>,
    radiance: Rgb,
    two_sided: bool,
}

impl MeshLight {
    /// A light of `triangles`, relative to the scene's centre, each of radiance `radiance`
    /// (W·m⁻²·sr⁻¹) to the side from which its corners run counter-clockwise, or to both. Triangles
    /// without area, or with corners that are not finite, do not shine.
    pub fn new(triangles: Arc<[[DVec3; 3]]>, radiance: Rgb, two_sided: bool) -> Self {
        let areas = triangles.iter().scan(0.0, |sum, corners| {
            let area = 0.5 * cross(corners).length();
            *sum += if area.is_finite() { area } else { 0.0 };
            Some(*sum)
        });
        let areas = areas.collect();
        Self { triangles, areas, radiance, two_sided }
    }

    /// Area of all triangles, one side, m².
    pub fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// Radiance, W·m⁻²·sr⁻¹.
    pub fn radiance(&self) -> Rgb {
        self.radiance
    }

    /// Whether light leaves to both sides.
    pub fn two_sided(&self) -> bool {
        self.two_sided
    }

    /// The triangle is found by `u[0]`, whose place within the triangle's share is used again.
    #[inline]
    pub(super) fn sample(&self, p: DVec3, u: [f64; 2]) -> Option<LightSample> {
        let area = self.area();
        let target = u[0] * area;
        let index = self.areas.partition_point(|&sum| sum <= target);
        let corners = self.triangles.get(index)?;
        let before = if index == 0 { 0.0 } else { self.areas[index - 1] };
        let rest = (target - before) / (self.areas[index] - before);

        let n = cross(corners).normalize_or_zero();
        let to = corners.map(|c| c - p);
        let height = -to[0].dot(n);
        let size = corners.iter().fold(0f64, |m, c| m.max(c.abs().max_element()));
        let reach = to.iter().fold(0f64, |m, c| m.max(c.abs().max_element()));
        let lift = lift(size, reach, n);
        let (n, height) = if self.two_sided && height < 0.0 { (-n, -height) } else { (n, height) };
        // Behind it or in its plane; also refuses NaN.
        if !(height > lift) {
            return None;
        }
        let [a, b, c] = low_distortion([rest, u[1]]);
        let [on_light, to_light] = [corners, &to].map(|q| q[0] * a + q[1] * b + q[2] * c);
        let d2 = to_light.length_squared();
        // cos θ = height/d.
        let irradiance = scaled(self.radiance, area / d2 * (height / d2.sqrt()));
        aim(p, on_light + n * lift, irradiance)
    }

    pub(super) fn bounds(&self) -> LightBounds {
        let shines =
            |t: &&[DVec3; 3]| (f64::MIN_POSITIVE..f64::INFINITY).contains(&cross(t).length());
        let shining = || self.triangles.iter().filter(shines);
        let bounds = Bounds::of(shining().flatten().copied());
        let center = bounds.center();
        let radius = shining().flatten().fold(0f64, |r, &c| r.max(c.distance(center)));
        // The flux through a plane across the axis if no triangle faces away from it; but no less than
        // the mean over all directions, which is a quarter of the area seen from both sides.
        let sum = shining().map(|t| 0.5 * cross(t)).sum::<DVec3>();
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        let intensity = strength(self.radiance) * sum.length().max(0.25 * sides * self.area());
        let axis = sum.normalize_or_zero();
        let half_angle = if self.two_sided || axis == DVec3::ZERO {
            PI
        } else {
            shining().fold(0f64, |angle, t| angle.max(angle_between(axis, cross(t).normalize())))
        };
        let cone = if half_angle < PI { Cone { axis, half_angle } } else { Cone::ALL };
        LightBounds { bounds, radius, cone, falloff: FRAC_PI_2, intensity }
    }
}

/// Twice the area, along the normal.
#[inline]
fn cross([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// From the unit square to barycentric weights, areas kept. The square is folded along a diagonal, not
/// torn. Source: Heitz, *A Low-Distortion Map Between Triangle and Square*, 2019; pbrt 4ed §6.5.4.
#[inline]
fn low_distortion([u, v]: [f64; 2]) -> [f64; 3] {
    let (a, b) = if u < v { (0.5 * u, v - 0.5 * u) } else { (u - 0.5 * v, 0.5 * v) };
    [a, b, 1.0 - a - b]
}
