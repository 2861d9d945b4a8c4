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
        let height = if self.two_sided { height.abs() } else { height };
        // Behind it or in its plane; also refuses NaN.
        if !(height > lift) {
            return None;
        }
        let [a, b, c] = low_distortion([rest, u[1]]);
        let target = corners[0] * a + corners[1] * b + corners[2] * c;
        let d = target.distance(p);
        // L·A·cos θ/d², cos θ = height/d.
        let irradiance = scaled(self.radiance, area / d * (height / d) / d);
        aim(p, target, d * (lift / height), irradiance)
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

#[cfg(test)]
mod tests {
    use super::super::Light;
    use super::super::oracle::{assert_vector_irradiance, errors, tell, vector_irradiance};
    use super::*;

    /// A wavy ceiling of n × n quads of different sizes, shining down.
    fn waves(n: u32) -> Vec<[DVec3; 3]> {
        let at = |i: u32, j: u32| {
            let (x, z) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
            DVec3::new(2.0 * x * x, 1.0 + 0.1 * (7.0 * x + 5.0 * z).sin(), 1.5 * z)
        };
        let quads = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        quads
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    /// The vector irradiance of those triangles that shine to `p`, or of all.
    fn expected(triangles: &[[DVec3; 3]], p: DVec3, two_sided: bool) -> DVec3 {
        let each = triangles.iter().map(|t| {
            let height = (p - t[0]).dot(cross(t));
            let vector = -vector_irradiance(t, p);
            if height > 0.0 {
                vector
            } else if two_sided {
                -vector
            } else {
                DVec3::ZERO
            }
        });
        each.sum()
    }

    #[test]
    fn samples_average_to_the_vector_irradiance() {
        let mut triangles = waves(9);
        // Without area, and beyond all numbers: neither is drawn.
        triangles.insert(0, [DVec3::ONE; 3]);
        triangles.insert(50, [DVec3::NAN; 3]);
        triangles.push([DVec3::ZERO, DVec3::ZERO, DVec3::X]);
        for two_sided in [false, true] {
            let light = MeshLight::new(triangles.as_slice().into(), Rgb::splat(1.0), two_sided);
            let shining = waves(9);
            for p in [
                DVec3::ZERO,
                DVec3::new(1.0, 0.5, 0.5),
                DVec3::new(1.0, 2.0, 0.5),
                DVec3::new(-3.0, 1.0, 0.5),
            ] {
                let expected = expected(&shining, p, two_sided);
                assert_vector_irradiance(&Light::Mesh(light.clone()), p, expected, 9);
            }
        }
    }

    #[test]
    fn every_triangle_gets_its_share() {
        let light = MeshLight::new(waves(5).into(), Rgb::splat(1.0), true);
        // From above the middle of each triangle, the point drawn by the middle of its share.
        for (index, corners) in light.triangles.iter().enumerate() {
            let before = if index == 0 { 0.0 } else { light.areas[index - 1] };
            for share in [1e-6, 0.5, 1.0 - 1e-6] {
                let area = light.areas[index] - before;
                let u = (before + share * area) / light.area();
                let n = cross(corners).normalize();
                let p = corners.iter().sum::<DVec3>() / 3.0 + n * 1e-3;
                let s = light.sample(p, [u, 0.3]).expect("in front of it");
                let target = p + s.direction.as_dvec3() * f64::from(s.distance);
                assert!((target - corners[0]).dot(n).abs() < 1e-5, "in its plane");
                let weights = [[0, 1, 2], [1, 2, 0], [2, 0, 1]].map(|[i, j, _]| {
                    (corners[j] - corners[i]).cross(target - corners[i]).dot(n) / (2.0 * area)
                });
                assert!(weights.iter().all(|w| (-1e-5..1.0 + 1e-5).contains(w)), "{weights:?}");
            }
        }
    }

    #[test]
    fn nothing_shines_without_area() {
        for triangles in [vec![], vec![[DVec3::ONE; 3]]] {
            let light = MeshLight::new(triangles.into(), Rgb::splat(1.0), true);
            assert_eq!(light.area(), 0.0);
            assert_eq!(light.sample(DVec3::ZERO, [0.5; 2]), None);
        }
    }

    #[test]
    fn stratified_numbers_pay() {
        let triangles = waves(6);
        let truth = expected(&triangles, DVec3::ZERO, false).y;
        let light = Light::Mesh(MeshLight::new(triangles.into(), Rgb::splat(1.0), false));
        let [many, many_even] = errors(&light, DVec3::ZERO, DVec3::Y, 1024, truth);
        tell(&format!("error of 1024 samples: random {many:.1e}, even {many_even:.1e}"));
        assert!(many_even < many / 5.0);
    }
}
