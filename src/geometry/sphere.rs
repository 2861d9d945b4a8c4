//! Spheres, solved in f64.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::shape::longitude;
use super::{AnalyticShape, Parameters, SampledPoint, ShapeHit, ShapePoint};
use crate::math::Bounds;

/// A sphere, in the space of its group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: DVec3,
    /// Radius, > 0.
    pub radius: f64,
}

impl AnalyticShape for Sphere {
    /// The box around it.
    fn bounds(&self) -> Bounds {
        let r = DVec3::splat(self.radius);
        Bounds { min: self.center - r, max: self.center + r }
    }

    /// The first hit at t in (`t_min`, `t_max`].
    ///
    /// With L from the origin to the centre, b = L·d and c = L² − r², the roots are c/q and q/d² with
    /// q = b + sign(b)·√disc: no difference of near-equal numbers. The discriminant comes from the
    /// line's distance to the centre, r²d² − |L × d|², which does not cancel far away, and takes no
    /// division where the line passes by.
    /// Source: Haines, Günther, Akenine-Möller, *Precision Improvements for Ray/Sphere
    /// Intersection*, Ray Tracing Gems ch. 7.
    #[inline]
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let l = self.center - origin;
        let d2 = direction.length_squared();
        let r2 = self.radius * self.radius;
        let disc = r2 * d2 - l.cross(direction).length_squared();
        // Also refuses NaN.
        if !(disc >= 0.0) {
            return None;
        }
        let b = l.dot(direction);
        let c = l.length_squared() - r2;
        // Outside and on the way from it, as rays are from the sphere that they just left.
        if b <= 0.0 && c > 0.0 && t_min >= 0.0 {
            return None;
        }
        let q = b + disc.sqrt().copysign(b);
        let hit = |t: f64| (t > t_min && t <= t_max).then(|| ShapeHit::at(t));
        // q = 0 only for a tangent ray that starts at the point of contact: c/q is NaN, and no hit.
        if b > 0.0 {
            hit(c / q).or_else(|| hit(q / d2))
        } else {
            hit(q / d2).or_else(|| hit(c / q))
        }
    }

    #[inline]
    fn surface_at(&self, p: DVec3, _part: u8) -> ShapePoint {
        let normal = self.normal_at(p);
        ShapePoint { position: self.center + normal * self.radius, normal }
    }

    /// Longitude and latitude, as `globe` has them.
    fn parameters(&self, p: DVec3, _part: u8) -> Parameters {
        globe(p - self.center)
    }

    fn curvature(&self, _p: DVec3, _part: u8) -> f64 {
        1.0 / self.radius
    }

    fn sampled_parts(&self) -> u8 {
        1
    }

    /// By longitude and height, which keeps areas (Archimedes).
    fn sample_at(&self, _part: u8, place: DVec2) -> Option<SampledPoint> {
        let y = 2.0 * place.y - 1.0;
        let (sin, cos) = (TAU * place.x).sin_cos();
        let across = (1.0 - y * y).max(0.0).sqrt();
        let n = DVec3::new(across * sin, y, across * cos);
        let area = 2.0 * TAU * self.radius * self.radius;
        Some(SampledPoint { position: self.center + n * self.radius, area: n * area })
    }

    fn reach(&self, direction: DVec3) -> f64 {
        direction.dot(self.center) + direction.length() * self.radius
    }
}

impl Sphere {
    /// The unit normal at the point of the surface nearest to `p`.
    #[inline]
    pub fn normal_at(&self, p: DVec3) -> DVec3 {
        let (normal, is_close) = self.normal_close_to(p);
        if is_close {
            return normal;
        }
        ((p - self.center) * (1.0 / self.radius)).normalize_or(DVec3::Y)
    }

    /// Where a ray from within comes out, at t > 0, to the last bit as [`AnalyticShape::intersect`] finds it; and
    /// whether it is from within. Without branches.
    #[inline(always)]
    pub(crate) fn far_side(&self, origin: DVec3, direction: DVec3) -> (f64, bool) {
        let l = self.center - origin;
        let d2 = direction.length_squared();
        let r2 = self.radius * self.radius;
        let disc = r2 * d2 - l.cross(direction).length_squared();
        let b = l.dot(direction);
        let c = l.length_squared() - r2;
        let q = b + disc.sqrt().copysign(b);
        // One root is behind, the other ahead.
        let t = if b > 0.0 { q / d2 } else { c / q };
        (t, (c < 0.0) & (disc >= 0.0) & (t > 0.0))
    }

    /// [`Sphere::normal_at`] without a root, and whether `p` is so close to the surface that it is right.
    #[inline(always)]
    pub(crate) fn normal_close_to(&self, p: DVec3) -> (DVec3, bool) {
        let m = (p - self.center) * (1.0 / self.radius);
        // Three terms of the series of 1/√(1 + off) have an error of 5/16·off³, below 10⁻¹⁵.
        let off = m.length_squared() - 1.0;
        (m * (1.0 - off * (0.5 - 0.375 * off)), off.abs() < 1e-5)
    }
}

/// Longitude and latitude of a point on a globe around +Y, each from 0 to 1: u = ½ on +Z, rising
/// towards +X; and the change of the point with them.
fn globe(m: DVec3) -> Parameters {
    use std::f64::consts::PI;
    let across = m.x.hypot(m.z);
    let (u, dp_du) = longitude(m);
    let v = 0.5 + m.y.atan2(across) / PI;
    // At the poles all meridians meet; any direction will do.
    let east = if across > 0.0 { DVec3::new(m.x, 0.0, m.z) / across } else { DVec3::X };
    let dp_dv = (DVec3::Y * across - east * m.y) * PI;
    Parameters { uv: DVec2::new(u, v), dp_du, dp_dv }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn inside_outside_and_past() {
        let s = Sphere { center: DVec3::ZERO, radius: 1.0 };
        let hit = |z: f64, d: f64| {
            s.intersect(DVec3::new(0.0, 0.0, z), DVec3::Z * d, 0.0, 1e30).map(|hit| hit.t)
        };
        assert_eq!(hit(-3.0, 1.0), Some(2.0));
        assert_eq!(hit(-3.0, 2.0), Some(1.0), "t counts in lengths of the direction");
        assert_eq!(hit(0.0, 1.0), Some(1.0), "from the centre");
        assert_eq!(hit(3.0, 1.0), None, "behind");
        assert_eq!(hit(1.0, 1.0), None, "on the surface, outward");
        assert_eq!(hit(1.0, -1.0), Some(2.0), "on the surface, inward");
    }

    #[test]
    fn a_globe_has_its_meridians_and_parallels() {
        let at = |p: DVec3| globe(p).uv;
        assert_eq!(at(DVec3::Z), DVec2::new(0.5, 0.5));
        assert_eq!(at(DVec3::X), DVec2::new(0.75, 0.5));
        assert_eq!(at(DVec3::Y).y, 1.0);
        // Partials against differences.
        let p = DVec3::new(0.3, 0.5, -0.7) * 2.0;
        let Parameters { uv, dp_du: du, dp_dv: dv } = globe(p);
        let place = |u: f64, v: f64| {
            let (longitude, latitude) = ((u - 0.5) * 2.0, v - 0.5);
            let (s, c) = (longitude * std::f64::consts::PI).sin_cos();
            let (y, across) = (latitude * std::f64::consts::PI).sin_cos();
            DVec3::new(s * across, y, c * across) * p.length()
        };
        let [u, v] = uv.to_array();
        let h = 1e-5;
        let by_u = (place(u + h, v) - place(u - h, v)) / (2.0 * h);
        let by_v = (place(u, v + h) - place(u, v - h)) / (2.0 * h);
        assert!((place(u, v) - p).length() < 1e-5);
        assert!((by_u - du).length() < 1e-3 && (by_v - dv).length() < 1e-3);
    }

    proptest! {
        /// What a query finds, to the last bit; and only outside, or within rounding of the surface, is it said
        /// not to be from within.
        #[test]
        fn rays_from_within_come_out_where_queries_say(
            from in prop::array::uniform3(-1.1f64..1.1),
            to in prop::array::uniform3(-1f64..1.0),
            log_radius in -6f64..6.0,
            is_at_surface in prop::bool::ANY,
        ) {
            let (from, to) = (DVec3::from(from), DVec3::from(to));
            prop_assume!(from.length() > 0.01 && to.length() > 0.01);
            let radius = 10f64.powf(log_radius);
            let s = Sphere { center: DVec3::new(3.0, -2.0, 7.0) * radius, radius };
            // As rays start that are refracted into it, or anywhere.
            let from = if is_at_surface { from.normalize() * (1.0 - 1e-6) } else { from };
            let (origin, direction) = (s.center + from * radius, to.normalize());
            let (t, is_within) = s.far_side(origin, direction);
            if is_within {
                let found = s.intersect(origin, direction, 0.0, f64::INFINITY);
                prop_assert_eq!(found.map(|hit| hit.t), Some(t));
            } else {
                prop_assert!(from.length() > 1.0 - 1e-13);
            }
        }

        /// The hit point, computed along the ray from nearby, is on the surface; and rays through the
        /// interior never miss, at any distance. The oracle is |o + t d − c| = r in f64, for which
        /// the ray is first moved towards the sphere.
        #[test]
        fn first_hits_lie_on_the_surface(
            unit in prop::array::uniform3(-1f64..1.0),
            aim in prop::array::uniform3(-0.55f64..0.55),
            log_distance in 0.1f64..6.0,
            log_radius in -3f64..3.0,
        ) {
            let unit = DVec3::from(unit);
            prop_assume!(unit.length() > 0.1);
            let radius = 10f64.powf(log_radius);
            let s = Sphere { center: DVec3::new(3.0, -2.0, 7.0) * radius, radius };
            let origin = s.center + unit.normalize() * radius * 10f64.powf(log_distance);
            let inner = s.center + DVec3::from(aim) * radius;
            let direction = (inner - origin).normalize();
            let t = s.intersect(origin, direction, 0.0, f64::INFINITY);
            let p = origin + direction * t.expect("aimed at a point inside").t;
            let off = ((p - s.center).length() - radius).abs() / radius;
            // One rounding of the origin's distance.
            prop_assert!(off < 4e-16 * 10f64.powf(log_distance) * 8.0 + 1e-14, "{off}");
        }
    }
}
