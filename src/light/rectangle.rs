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
        let (s, t, irradiance) = match self.spherical(to_corner, n) {
            Some(spherical) => {
                let [s, t] = spherical.sample(u);
                (s, t, scaled(self.radiance, spherical.solid_angle))
            }
            None => {
                let d2 = (to_corner + self.edge_u * u[0] + self.edge_v * u[1]).length_squared();
                // cos θ = height/d.
                (u[0], u[1], scaled(self.radiance, area / d2 * (height / d2.sqrt())))
            }
        };
        let on_light = self.corner + self.edge_u * s + self.edge_v * t;
        aim(p, on_light + n * lift, irradiance)
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
            let length = s.hypot(z);
            (s / length, (z / length).abs())
        };
        let n = [normal(-y[0]), normal(x[1]), normal(y[1]), normal(-x[0])];
        // The angle whose cosine is −sᵢ·sⱼ; its sine² is 1 − sᵢ²sⱼ² = cᵢ² + sᵢ²·cⱼ².
        let angle = |i: usize, j: usize| {
            let ((si, ci), (sj, cj)) = (n[i], n[j]);
            ci.hypot(si * cj).atan2(-si * sj)
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
        let cu = 1f64.copysign(f) / f.hypot(self.b[0]);
        let cu = cu.clamp(-1.0, 1.0);
        let x = -(cu * self.z) / ((1.0 - cu) * (1.0 + cu)).sqrt();
        let x = x.clamp(x0, x1);

        let d = x.hypot(self.z);
        let [h0, h1] = [y0, y1].map(|y| y / y.hypot(d));
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
