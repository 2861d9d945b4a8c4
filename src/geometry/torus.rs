//! Tori, solved in f64.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::shape::{Stretch, longitude, outward};
use super::{AnalyticShape, Parameters, SampledPoint, ShapeHit, ShapePoint};
use crate::math::{Bounds, Quartic};

/// A torus around +Y at the origin. Where the tube is wider than the ring it is a spindle: both its apple
/// and the lemon within are surface, and the lemon's inside counts as outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torus {
    /// Radius of the ring, ≥ 0.
    pub major_radius: f64,
    /// Radius of the tube, > 0.
    pub minor_radius: f64,
}

impl Torus {
    /// The tube's equation, negative inside: (ρ − R)² + y² − r², or with `ring` = −R that of the lemon.
    #[inline]
    fn tube(&self, p: DVec3, ring: f64) -> f64 {
        let rho = p.x.hypot(p.z) - ring;
        // As a product, as squares of near-equal lengths cancel.
        let off = rho.hypot(p.y);
        (off - self.minor_radius) * (off + self.minor_radius)
    }

    /// The ring of that sheet of the surface which is nearer: R of the apple, −R of the lemon.
    #[inline]
    fn ring(&self, p: DVec3) -> f64 {
        let r = self.major_radius;
        if r < self.minor_radius && self.tube(p, -r).abs() < self.tube(p, r).abs() { -r } else { r }
    }

    /// One step of Newton's method along the ray, on the sheet that is near.
    #[inline]
    fn polished(&self, o: DVec3, d: DVec3, t: f64) -> f64 {
        let p = o + d * t;
        let ring = self.ring(p);
        let rho = p.x.hypot(p.z);
        let slope = 2.0 * ((1.0 - ring / rho) * (p.x * d.x + p.z * d.z) + p.y * d.y);
        let step = self.tube(p, ring) / slope;
        // A step that is not small comes of a slope that is no slope: the ray touches.
        if step.abs() < 1e-6 * self.minor_radius { t - step } else { t }
    }
}

impl AnalyticShape for Torus {
    fn bounds(&self) -> Bounds {
        let r = self.major_radius + self.minor_radius;
        let reach = DVec3::new(r, self.minor_radius, r);
        Bounds { min: -reach, max: reach }
    }

    /// The quartic is set up where the ray is nearest to the centre, in units of the torus' size, and its
    /// roots are isolated within the stretch that runs through the box; the first is polished on the
    /// tube's own equation.
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let stretch = Stretch::within(&self.bounds(), origin, direction)?;
        let size = self.major_radius + self.minor_radius;
        let speed = direction.length() / size;
        let d = direction / (size * speed);
        let to_middle = -stretch.origin.dot(d) / size;
        let o = stretch.origin / size + d * to_middle;
        // t = start + (s + to_middle) / speed.
        let t_of = |s: f64| stretch.start + (s + to_middle) / speed;
        let s_of = |t: f64| (t - stretch.start) * speed - to_middle;

        let unit =
            Self { major_radius: self.major_radius / size, minor_radius: self.minor_radius / size };
        let (ring, tube) = (unit.major_radius, unit.minor_radius);
        let four_r2 = 4.0 * ring * ring;
        let beta = o.dot(d);
        let gamma = o.length_squared() + (ring - tube) * (ring + tube);
        let quartic = Quartic([
            unit.tube(o, ring) * unit.tube(o, -ring),
            4.0 * beta * gamma - 2.0 * four_r2 * (o.x * d.x + o.z * d.z),
            2.0 * gamma + 4.0 * beta * beta - four_r2 * (d.x * d.x + d.z * d.z),
            4.0 * beta,
            1.0,
        ]);
        let from = s_of(t_min).max(-to_middle);
        let to = s_of(t_max).min(stretch.length * speed - to_middle);
        let t_of_root = |s: f64| t_of(unit.polished(o, d, s));
        let roots = quartic.roots_in(from, to);
        roots.iter().map(|&s| t_of_root(s)).find(|&t| t > t_min && t <= t_max).map(ShapeHit::at)
    }

    fn surface_at(&self, p: DVec3, _part: u8) -> ShapePoint {
        let ring = self.ring(p);
        let center = outward(p) * ring;
        let out = (p - center).normalize_or(DVec3::Y);
        let side = if ring < 0.0 { -1.0 } else { 1.0 };
        ShapePoint { position: center + out * self.minor_radius, normal: out * side }
    }

    /// u runs around the axis, v around the tube: ½ on the outside, rising towards +Y.
    fn parameters(&self, p: DVec3, _part: u8) -> Parameters {
        let (u, dp_du) = longitude(p);
        let from_ring = p.x.hypot(p.z) - self.ring(p);
        let v = 0.5 + p.y.atan2(from_ring) / TAU;
        let dp_dv = (DVec3::Y * from_ring - outward(p) * p.y) * TAU;
        Parameters { uv: DVec2::new(u, v), dp_du, dp_dv }
    }

    fn curvature(&self, _p: DVec3, _part: u8) -> f64 {
        1.0 / self.minor_radius
    }

    fn sampled_parts(&self) -> u8 {
        1
    }

    fn sample_at(&self, _part: u8, place: DVec2) -> Option<SampledPoint> {
        let (sin, cos) = (TAU * place.x).sin_cos();
        let out = DVec3::new(sin, 0.0, cos);
        let (up, along) = (TAU * place.y).sin_cos();
        let n = out * along + DVec3::Y * up;
        // Below zero on the lemon of a spindle, where the normal is another.
        let rho = self.major_radius + self.minor_radius * along;
        let position = out * self.major_radius + n * self.minor_radius;
        Some(SampledPoint { position, area: n * (TAU * TAU * rho * self.minor_radius) })
    }

    fn reach(&self, d: DVec3) -> f64 {
        self.major_radius * d.x.hypot(d.z) + self.minor_radius * d.length()
    }
}
