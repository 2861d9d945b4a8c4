//! Cylinders, cones and truncated cones, solved in f64.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::shape::{Stretch, longitude, outward};
use super::{AnalyticShape, Parameters, SampledPoint, ShapeHit, ShapePoint};
use crate::math::Bounds;

/// A round body around +Y from the origin up; a cylinder, where both radii are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// Height, > 0.
    pub height: f64,
    /// Radius at the bottom and at the top, ≥ 0, not both 0.
    pub radii: [f64; 2],
    /// Whether it is closed at both ends.
    pub has_caps: bool,
}

/// The side of a [`Cone`].
const SIDE: u8 = 0;
/// Its caps: the bottom, and the top.
const CAPS: [u8; 2] = [1, 2];

/// By how much side and caps overlap where they meet, so that no ray slips between them.
const OVERLAP: f64 = 1e-14;

impl Cone {
    /// By how much its radius grows with y.
    #[inline]
    fn slope(&self) -> f64 {
        (self.radii[1] - self.radii[0]) / self.height
    }
}

impl AnalyticShape for Cone {
    fn bounds(&self) -> Bounds {
        let r = self.radii[0].max(self.radii[1]);
        Bounds { min: DVec3::new(-r, 0.0, -r), max: DVec3::new(r, self.height, r) }
    }

    /// With v and u the parts of origin and direction across the axis, w the radius at the origin's height
    /// and m how it changes along the ray, the equation is (u² − m²)t² + 2(u·v − m w)t + v² − w² = 0, whose
    /// discriminant is |w u − m v|² − (v × u)²: written so, it does not cancel for thin bodies.
    #[inline]
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let Stretch { start, origin: o, .. } = Stretch::within(&self.bounds(), origin, direction)?;
        let d = direction;
        let mut best: Option<ShapeHit> = None;
        let mut offer = |t: f64, part: u8| {
            let t = start + t;
            if t > t_min && t <= t_max && best.is_none_or(|b| t < b.t) {
                best = Some(ShapeHit { t, part });
            }
        };

        let (u, v) = (DVec2::new(d.x, d.z), DVec2::new(o.x, o.z));
        let (w, m) = (self.radii[0] + self.slope() * o.y, self.slope() * d.y);
        let disc = (w * u - m * v).length_squared() - v.perp_dot(u).powi(2);
        if disc >= 0.0 {
            let a = u.length_squared() - m * m;
            let b = u.dot(v) - m * w;
            let c = (v.length() - w) * (v.length() + w);
            let q = -(b + disc.sqrt().copysign(b));
            let margin = OVERLAP * self.height;
            for t in [q / a, c / q] {
                let y = o.y + t * d.y;
                // Within this range the radius is not negative: the other half of the double cone is out.
                if y >= -margin && y <= self.height + margin {
                    offer(t, SIDE);
                }
            }
        }
        if self.has_caps {
            for ((y, r), part) in [0.0, self.height].into_iter().zip(self.radii).zip(CAPS) {
                let t = (y - o.y) / d.y;
                if (v + u * t).length_squared() <= r * r * (1.0 + OVERLAP) {
                    offer(t, part);
                }
            }
        }
        best
    }

    fn surface_at(&self, p: DVec3, part: u8) -> ShapePoint {
        let out = outward(p);
        let rho = p.x.hypot(p.z);
        if part == SIDE {
            let k = self.slope();
            let off = (rho - self.radii[0] - k * p.y) / (1.0 + k * k);
            let y = (p.y + k * off).clamp(0.0, self.height);
            let position = out * (self.radii[0] + k * y) + DVec3::Y * y;
            return ShapePoint { position, normal: (out - DVec3::Y * k).normalize() };
        }
        let is_top = part == CAPS[1];
        let (y, radius, normal) = if is_top {
            (self.height, self.radii[1], DVec3::Y)
        } else {
            (0.0, self.radii[0], DVec3::NEG_Y)
        };
        ShapePoint { position: out * rho.min(radius) + DVec3::Y * y, normal }
    }

    /// u runs around the axis, v along the side from bottom to top, on a cap from its middle to its rim.
    fn parameters(&self, p: DVec3, part: u8) -> Parameters {
        let (u, dp_du) = longitude(p);
        let out = outward(p);
        if part == SIDE {
            let dp_dv = out * (self.radii[1] - self.radii[0]) + DVec3::Y * self.height;
            return Parameters { uv: DVec2::new(u, p.y / self.height), dp_du, dp_dv };
        }
        let radius = self.radii[usize::from(part == CAPS[1])];
        let v = if radius > 0.0 { p.x.hypot(p.z) / radius } else { 0.0 };
        Parameters { uv: DVec2::new(u, v), dp_du, dp_dv: out * radius }
    }

    fn curvature(&self, p: DVec3, part: u8) -> f64 {
        /// At the tip it has no bound, and nothing to be seen.
        const LEAST: f64 = 1e-3;
        if part != SIDE {
            return 0.0;
        }
        let least = LEAST * self.radii[0].max(self.radii[1]);
        1.0 / (p.x.hypot(p.z).max(least) * self.slope().hypot(1.0))
    }

    fn sampled_parts(&self) -> u8 {
        if self.has_caps { 3 } else { 1 }
    }

    fn sample_at(&self, part: u8, place: DVec2) -> Option<SampledPoint> {
        let (sin, cos) = (TAU * place.x).sin_cos();
        let out = DVec3::new(sin, 0.0, cos);
        if part == SIDE {
            let k = self.slope();
            let y = place.y * self.height;
            let rho = self.radii[0] + k * y;
            let area = (out - DVec3::Y * k) * (TAU * rho * self.height);
            return Some(SampledPoint { position: out * rho + DVec3::Y * y, area });
        }
        // A ring's area grows with its radius.
        let is_top = part == CAPS[1];
        let radius = self.radii[usize::from(is_top)];
        let (y, side) = if is_top { (self.height, 1.0) } else { (0.0, -1.0) };
        let position = out * (radius * place.y.sqrt()) + DVec3::Y * y;
        let area = DVec3::Y * (side * PI * radius * radius);
        Some(SampledPoint { position, area })
    }

    /// The farther of the two rims.
    fn reach(&self, d: DVec3) -> f64 {
        let across = d.x.hypot(d.z);
        (across * self.radii[0]).max(across * self.radii[1] + d.y * self.height)
    }
}
