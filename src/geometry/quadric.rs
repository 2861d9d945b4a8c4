//! Quadrics: ellipsoids, hyperboloids, paraboloids, saddles and whatever else ten coefficients say.

use glam::{DMat3, DVec3};

use super::shape::Stretch;
use super::{AnalyticShape, Parameters, ShapeHit, ShapePoint};
use crate::math::Bounds;

/// The surface on which p·A p + b·p + c = 0, as far as it lies in a box. Inside is where that is negative.
/// It is cut open by the box, and has no texture coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quadric {
    /// A, symmetric.
    matrix: DMat3,
    /// b.
    vector: DVec3,
    /// c.
    constant: f64,
    bounds: Bounds,
}

impl Quadric {
    /// The coefficients are those of x², y², z², xy, xz, yz, x, y, z and 1.
    pub fn new(coefficients: [f64; 10], bounds: Bounds) -> Self {
        let [xx, yy, zz, xy, xz, yz, x, y, z, constant] = coefficients;
        let [xy, xz, yz] = [0.5 * xy, 0.5 * xz, 0.5 * yz];
        let matrix = DMat3::from_cols(
            DVec3::new(xx, xy, xz),
            DVec3::new(xy, yy, yz),
            DVec3::new(xz, yz, zz),
        );
        Self { matrix, vector: DVec3::new(x, y, z), constant, bounds }
    }

    #[inline]
    fn value(&self, p: DVec3) -> f64 {
        (self.matrix * p + self.vector).dot(p) + self.constant
    }

    #[inline]
    fn gradient(&self, p: DVec3) -> DVec3 {
        2.0 * (self.matrix * p) + self.vector
    }
}

impl AnalyticShape for Quadric {
    fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Where the ray enters the box the equation is a·t² + 2b·t + c = 0 of moderate terms; its roots are
    /// q/a and c/q, without a difference of near-equal numbers, and the discriminant loses nothing to the
    /// rounding of its products.
    #[inline]
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let Stretch { start, origin: o, length } =
            Stretch::within(&self.bounds, origin, direction)?;
        let along = self.matrix * direction;
        let a = along.dot(direction);
        let b = along.dot(o) + 0.5 * self.vector.dot(direction);
        let c = self.value(o);
        let disc = difference_of_products(b, b, a, c);
        if !(disc >= 0.0) {
            return None;
        }
        let q = -(b + disc.sqrt().copysign(b));
        let (x, y) = (q / a, c / q);
        let both = if x < y { [x, y] } else { [y, x] };
        // NaN is in no range.
        let mut hits = both.into_iter().filter(|t| (0.0..=length).contains(t)).map(|t| start + t);
        hits.find(|&t| t > t_min && t <= t_max).map(ShapeHit::at)
    }

    /// By Newton's method along the gradient.
    fn surface_at(&self, p: DVec3, _part: u8) -> ShapePoint {
        let mut position = p;
        for _ in 0..3 {
            let gradient = self.gradient(position);
            let step = gradient * (self.value(position) / gradient.length_squared());
            // At the tip of a cone there is no gradient, and no step.
            if step.is_finite() {
                position -= step;
            }
        }
        ShapePoint { position, normal: self.gradient(position).normalize_or_zero() }
    }

    fn parameters(&self, _p: DVec3, _part: u8) -> Parameters {
        Parameters::default()
    }

    /// The second derivatives over the first: a bound where the surface is not flatter than it seems.
    fn curvature(&self, p: DVec3, _part: u8) -> f64 {
        let m = &self.matrix;
        let second = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length_squared);
        let slope = self.gradient(p).length();
        let curvature = 2.0 * second.iter().sum::<f64>().sqrt() / slope;
        if curvature.is_finite() { curvature } else { 0.0 }
    }
}

/// a·b − c·d to within two roundings of the result. Source: Kahan; Jeannerod, Louvet and Muller, *Further
/// Analysis of Kahan's Algorithm for the Accurate Computation of 2 × 2 Determinants*, 2013.
#[inline]
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    let error = (-c).mul_add(d, cd);
    a.mul_add(b, -cd) + error
}
