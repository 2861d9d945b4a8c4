//! Rectangles, sampled by the solid angle that they fill.

use glam::DVec3;

use super::LightSample;
use super::aim::{aim, lift, scaled};
use super::bounds::{Cone, LightBounds, strength};
use crate::color::Rgb;
use crate::math::Bounds;

/// A rectangle (or parallelogram) of constant radiance that shines to one side.
#[derive(Debug, Clone, PartialEq)]
pub struct RectangleLight {
    /// One corner, relative to the scene's centre.
    pub corner: DVec3,
    /// From the corner along one edge.
    pub edge_u: DVec3,
    /// From the corner along the other. Light leaves to the side of `edge_u` × `edge_v`.
    pub edge_v: DVec3,
    /// Radiance L, W·m⁻²·sr⁻¹.
    pub radiance: Rgb,
}

/// Below this solid angle (sr) points are drawn by area instead: rounding shows in the spherical map,
/// and a light that small varies little in distance and angle.
const SMALL: f64 = 1e-6;

/// Edges whose angle has no greater cosine than this are at right angles.
const RIGHT_ANGLE: f64 = 1e-9;

impl RectangleLight {
    /// Area, m².
    pub fn area(&self) -> f64 {
        self.edge_u.cross(self.edge_v).length()
    }

    #[inline]
    pub(super) fn sample(&self, p: DVec3, u: [f64; 2]) -> Option<LightSample> {
        let cross = self.edge_u.cross(self.edge_v);
        let area = cross.length();
        let n = cross / area;
        let to_corner = self.corner - p;
        let height = -to_corner.dot(n);
        let edges = self.edge_u.abs() + self.edge_v.abs();
        let size = (self.corner.abs() + edges).max_element();
        let reach = (to_corner.abs() + edges).max_element();
        let lift = lift(size, reach, n);
        // Behind it or in its plane; also where it has no area, and for NaN.
        if !(height > lift) {
            return None;
        }
        let on_light = |s: f64, t: f64| self.corner + self.edge_u * s + self.edge_v * t;
        let (target, irradiance) = match self.spherical(to_corner, n) {
            Some(spherical) => {
                let [s, t] = spherical.sample(u);
                (on_light(s, t), scaled(self.radiance, spherical.solid_angle))
            }
            None => {
                let target = on_light(u[0], u[1]);
                let d = target.distance(p);
                // L·A·cos θ/d², cos θ = height/d.
                (target, scaled(self.radiance, area / d * (height / d) / d))
            }
        };
        aim(p, target, target.distance(p) * (lift / height), irradiance)
    }

    /// The rectangle as seen from the point that `to_corner` starts at, if it is one and not small.
    #[inline]
    fn spherical(&self, to_corner: DVec3, n: DVec3) -> Option<SphericalRectangle> {
        let (a, b) = (self.edge_u.length(), self.edge_v.length());
        let (x, y) = (self.edge_u / a, self.edge_v / b);
        if !(x.dot(y).abs() <= RIGHT_ANGLE) {
            return None;
        }
        let corner = DVec3::new(to_corner.dot(x), to_corner.dot(y), to_corner.dot(n));
        let spherical = SphericalRectangle::new(corner, a, b);
        (spherical.solid_angle >= SMALL).then_some(spherical)
    }

    pub(super) fn bounds(&self) -> LightBounds {
        let (u, v) = (self.edge_u, self.edge_v);
        let half = 0.5 * (u + v).length().max((u - v).length());
        LightBounds {
            bounds: Bounds::of(
                [0.0, 1.0].into_iter().flat_map(|s| [self.corner + u * s, self.corner + u * s + v]),
            ),
            radius: half,
            cone: Cone { axis: u.cross(v).normalize_or(DVec3::Y), half_angle: 0.0 },
            falloff: std::f64::consts::FRAC_PI_2,
            intensity: strength(self.radiance) * self.area(),
        }
    }
}

/// √(a² + b²); squares of lengths that f32 can hold fit f64.
#[inline]
fn length(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

/// A rectangle projected to the unit sphere around the origin: points of it uniform in solid angle.
///
/// Source: Ureña, Fajardo, King, *An Area-Preserving Parametrization for Spherical Rectangles*, EGSR
/// 2013. The angles at its corners come from their sines and cosines, as the arc cosine alone loses
/// half of the digits where the origin is close to the rectangle's plane.
struct SphericalRectangle {
    /// From the origin to the near corner and the far one, in the rectangle's own axes.
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// The z components of the normals of the planes through the origin and the edges at y₀ and y₁.
    b: [f64; 2],
    /// The paper's k.
    k: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// Of side lengths `a` and `b` from `corner` on, along the first two axes; z < 0.
    #[inline]
    fn new(corner: DVec3, a: f64, b: f64) -> Self {
        let (x, y, z) = ([corner.x, corner.x + a], [corner.y, corner.y + b], corner.z);
        // Normals of the edges' planes: their z component, and the length of the rest.
        let normal = |s: f64| {
            let l = length(s, z);
            (s / l, (z / l).abs())
        };
        let n = [normal(-y[0]), normal(x[1]), normal(y[1]), normal(-x[0])];
        // The angle whose cosine is −sᵢ·sⱼ; its sine² is 1 − sᵢ²sⱼ² = cᵢ² + sᵢ²·cⱼ².
        let angle = |i: usize, j: usize| {
            let ((si, ci), (sj, cj)) = (n[i], n[j]);
            length(ci, si * cj).atan2(-si * sj)
        };
        let k = std::f64::consts::TAU - angle(2, 3) - angle(3, 0);
        let solid_angle = angle(0, 1) + angle(1, 2) - k;
        Self { x, y, z, b: [n[0].0, n[2].0], k, solid_angle }
    }

    /// The point for `u`, as fractions of the two edges.
    #[inline]
    fn sample(&self, u: [f64; 2]) -> [f64; 2] {
        let ([x0, x1], [y0, y1]) = (self.x, self.y);
        let (sin, cos) = (u[0] * self.solid_angle + self.k).sin_cos();
        let f = (cos * self.b[0] - self.b[1]) / sin;
        let cu = 1f64.copysign(f) / length(f, self.b[0]);
        let cu = cu.clamp(-1.0, 1.0);
        let x = -(cu * self.z) / ((1.0 - cu) * (1.0 + cu)).sqrt();
        let x = x.clamp(x0, x1);

        let d = length(x, self.z);
        let [h0, h1] = [y0, y1].map(|y| y / length(y, d));
        let h = h0 + u[1] * (h1 - h0);
        let y = (h * d / ((1.0 - h) * (1.0 + h)).sqrt()).clamp(y0, y1);
        // 0/0 on the sphere's great circles: anywhere will do there.
        let fraction = |x: f64, low: f64, high: f64, u: f64| {
            let s = (x - low) / (high - low);
            if s.is_nan() { u } else { s }
        };
        [fraction(x, x0, x1, u[0]), fraction(y, y0, y1, u[1])]
    }
}

#[cfg(test)]
mod tests {
    use super::super::oracle::{
        Estimate, Random, assert_vector_irradiance, errors, tell, vector_irradiance,
    };
    use super::super::{Light, MeshLight};
    use super::*;
    use std::f64::consts::PI;
    use std::sync::Arc;

    fn corners(light: &RectangleLight) -> [DVec3; 4] {
        let (c, u, v) = (light.corner, light.edge_u, light.edge_v);
        // As seen from the side that it shines to, turned: the vector points towards it.
        [c, c + v, c + u + v, c + u]
    }

    fn rectangle(corner: DVec3, edge_u: DVec3, edge_v: DVec3) -> RectangleLight {
        RectangleLight { corner, edge_u, edge_v, radiance: Rgb::splat(1.0) }
    }

    /// A unit-radiance rectangle 2 × 1.5 at height 1, shining down, skewed by `skew`.
    fn ceiling(skew: f64) -> RectangleLight {
        let (u, v) = (DVec3::new(2.0, 0.0, 0.0), DVec3::new(skew, 0.0, 1.5));
        rectangle(DVec3::new(0.0, 1.0, 0.0), u, v)
    }

    #[test]
    fn a_parallel_plane_below_a_corner() {
        // The form factor of a rectangle a × b at distance c, opposite a corner: Howell, *A Catalog of
        // Radiation Heat Transfer Configuration Factors*, B-4.
        for (a, b, c) in [(2.0, 1.5, 1.0), (2.0, 1.5, 0.01), (0.1, 3.0, 50.0), (1e-3, 1e-3, 2.0)] {
            let (x, y): (f64, f64) = (a / c, b / c);
            let term = |x: f64, y: f64| x / x.hypot(1.0) * (y / x.hypot(1.0)).atan();
            let expected = PI * (term(x, y) + term(y, x)) / (2.0 * PI);
            let light =
                Light::Rectangle(rectangle(DVec3::new(0.0, c, 0.0), DVec3::X * a, DVec3::Z * b));
            let mut random = Random::new(1);
            let estimate = Estimate::of(50_000, |_| {
                let s = light.sample(glam::Vec3::ZERO, random.square()).expect("in front of it");
                f64::from(s.irradiance.r * s.direction.y)
            });
            assert!(estimate.agrees_with(expected), "{a} {b} {c}: {estimate:?}, not {expected}");
        }
    }

    #[test]
    fn samples_average_to_the_vector_irradiance() {
        for light in [ceiling(0.0), ceiling(0.7)] {
            for p in [
                DVec3::ZERO,
                DVec3::new(1.0, 0.9, 0.5),
                DVec3::new(1.0, 0.9999, 0.5),
                DVec3::new(-0.5, 0.99, 0.5),
                DVec3::new(-3.0, 0.9, 5.0),
                DVec3::new(40.0, -300.0, 5.0),
                DVec3::new(400.0, -1600.0, 5.0),
                DVec3::new(4000.0, -30000.0, 5.0),
            ] {
                // By area, little but rare bright samples arrive so close.
                if p.y > 0.95 && light.edge_v.x != 0.0 {
                    continue;
                }
                let p = p.as_vec3().as_dvec3();
                let expected = vector_irradiance(&corners(&light), p);
                assert_vector_irradiance(&Light::Rectangle(light.clone()), p, expected, 5);
            }
            let above = Light::Rectangle(light).sample(glam::Vec3::new(1.0, 1.1, 0.5), [0.5; 2]);
            assert_eq!(above, None, "behind it");
        }
    }

    #[test]
    fn solid_angle_varies_less_than_area() {
        let light = ceiling(0.0);
        let [a, b, c, d] = corners(&light);
        let triangles = Arc::from([[a, d, c], [a, c, b]]);
        let by_area = Light::Mesh(MeshLight::new(triangles, light.radiance, false));
        let by_angle = Light::Rectangle(light);
        for (p, gain) in [
            (DVec3::ZERO, 2.0),
            (DVec3::new(1.0, 0.5, 0.7), 5.0),
            (DVec3::new(1.0, 0.9, 0.7), 50.0),
            (DVec3::new(-0.5, 0.0, 0.7), 3.0),
        ] {
            let variance = |light: &Light| {
                let mut random = Random::new(2);
                let estimate = Estimate::of(50_000, |_| {
                    let s = light.sample(p.as_vec3(), random.square()).expect("in front of it");
                    f64::from(s.irradiance.r * s.direction.y)
                });
                estimate.variance
            };
            let ratio = variance(&by_area) / variance(&by_angle);
            tell(&format!("at {p}: {ratio:.1} times less variance"));
            assert!(ratio > gain, "{p}: {ratio}");
        }
    }

    #[test]
    fn stratified_numbers_pay() {
        let light = ceiling(0.0);
        let p = DVec3::new(0.25, 0.5, 0.25);
        let truth = vector_irradiance(&corners(&light), p).y;
        let light = Light::Rectangle(light);
        let [[few, few_even], [many, many_even]] =
            [16, 1024].map(|count| errors(&light, p, DVec3::Y, count, truth));
        tell(&format!(
            "error, 16 to 1024 samples: random {few:.1e} to {many:.1e}, even {few_even:.1e} to {many_even:.1e}"
        ));
        assert!(few / many < 12.0, "the square root of 64 is 8");
        assert!(few_even / many_even > 24.0);
        assert!(many_even < many / 10.0);
    }
}
