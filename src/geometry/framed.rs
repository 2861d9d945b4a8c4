//! Shapes under an affine transform, inverted in f64: turned, stretched, sheared, mirrored.

use glam::{DAffine3, DVec2, DVec3};

use super::shape::cofactors;
use super::{AnalyticShape, Parameters, SampledPoint, ShapeHit, ShapePoint};
use crate::math::Bounds;

/// A shape that is described in a space of its own.
#[derive(Debug, Clone)]
pub struct Framed<S> {
    shape: S,
    outer_from_inner: DAffine3,
    inner_from_outer: DAffine3,
}

impl<S: Clone> Framed<S> {
    /// `shape` as seen through `outer_from_inner`, which must not be singular.
    pub fn new(shape: S, outer_from_inner: DAffine3) -> Self {
        Self { shape, outer_from_inner, inner_from_outer: outer_from_inner.inverse() }
    }

    /// The shape in its own space.
    pub fn shape(&self) -> &S {
        &self.shape
    }

    /// From its own space.
    pub fn outer_from_inner(&self) -> &DAffine3 {
        &self.outer_from_inner
    }

    /// The same under a further transform.
    #[must_use]
    pub fn transformed(&self, m: &DAffine3) -> Self {
        Self::new(self.shape.clone(), *m * self.outer_from_inner)
    }
}

impl<S: AnalyticShape> AnalyticShape for Framed<S> {
    /// As tight as the shape knows its reach.
    fn bounds(&self) -> Bounds {
        let reach = |d: DVec3| self.reach(d);
        Bounds {
            min: -DVec3::new(reach(DVec3::NEG_X), reach(DVec3::NEG_Y), reach(DVec3::NEG_Z)),
            max: DVec3::new(reach(DVec3::X), reach(DVec3::Y), reach(DVec3::Z)),
        }
    }

    #[inline]
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let m = &self.inner_from_outer;
        let (o, d) = (m.transform_point3(origin), m.transform_vector3(direction));
        self.shape.intersect(o, d, t_min, t_max)
    }

    #[inline]
    fn occluded(&self, origin: DVec3, direction: DVec3, t_min: f64, t_max: f64) -> bool {
        let m = &self.inner_from_outer;
        let (o, d) = (m.transform_point3(origin), m.transform_vector3(direction));
        self.shape.occluded(o, d, t_min, t_max)
    }

    fn surface_at(&self, p: DVec3, part: u8) -> ShapePoint {
        let inner = self.shape.surface_at(self.inner_from_outer.transform_point3(p), part);
        // By the inverse transpose, so that outward stays outward in a mirror.
        let normal = self.inner_from_outer.matrix3.transpose() * inner.normal;
        ShapePoint {
            position: self.outer_from_inner.transform_point3(inner.position),
            normal: normal.normalize_or_zero(),
        }
    }

    #[inline]
    fn shading_normal(&self, p: DVec3, part: u8) -> Option<DVec3> {
        let inner = self.shape.shading_normal(self.inner_from_outer.transform_point3(p), part)?;
        Some((self.inner_from_outer.matrix3.transpose() * inner).normalize_or_zero())
    }

    fn parameters(&self, p: DVec3, part: u8) -> Parameters {
        let inner = self.shape.parameters(self.inner_from_outer.transform_point3(p), part);
        let m = &self.outer_from_inner.matrix3;
        Parameters { uv: inner.uv, dp_du: *m * inner.dp_du, dp_dv: *m * inner.dp_dv }
    }

    fn curvature(&self, p: DVec3, part: u8) -> f64 {
        let inner = self.shape.curvature(self.inner_from_outer.transform_point3(p), part);
        inner / self.outer_from_inner.matrix3.determinant().abs().cbrt()
    }

    fn sampled_parts(&self) -> u8 {
        self.shape.sampled_parts()
    }

    fn sample_at(&self, part: u8, place: DVec2) -> Option<SampledPoint> {
        let m = &self.outer_from_inner;
        let inner = self.shape.sample_at(part, place)?;
        Some(inner.transformed(m, &cofactors(&m.matrix3)))
    }

    fn reach(&self, direction: DVec3) -> f64 {
        let m = &self.outer_from_inner;
        self.shape.reach(m.matrix3.transpose() * direction) + m.translation.dot(direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Sphere;

    #[test]
    fn an_ellipsoid_is_a_stretched_sphere() {
        let ball = Sphere { center: DVec3::ZERO, radius: 1.0 };
        let m = DAffine3::from_translation(DVec3::new(5.0, 0.0, 0.0))
            * DAffine3::from_scale(DVec3::new(3.0, -2.0, 1.0));
        let ellipsoid = Framed::new(ball, m);
        let expected = Bounds { min: DVec3::new(2.0, -2.0, -1.0), max: DVec3::new(8.0, 2.0, 1.0) };
        assert_eq!(ellipsoid.bounds(), expected);
        let hit = ellipsoid.intersect(DVec3::new(5.0, 9.0, 0.0), DVec3::NEG_Y, 0.0, 100.0);
        assert_eq!(hit, Some(ShapeHit::at(7.0)));
        // The normal is the gradient of (x/3)² + (y/2)² + z².
        let p = DVec3::new(3.0 * 0.6, -2.0 * 0.8, 0.0);
        let at = ellipsoid.surface_at(p + m.translation, 0);
        let gradient = DVec3::new(p.x / 9.0, p.y / 4.0, 0.0).normalize();
        assert!((at.normal - gradient).length() < 1e-14 && (at.position.x - 6.8).abs() < 1e-14);
    }
}
