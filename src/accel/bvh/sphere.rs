//! One ray against eight spheres: those that it may hit are found side by side in f32, and solved one by one
//! in f64.
//!
//! From the ray's origin, with L to a centre and e = d / d_z (z the axis along which d is longest), the line
//! passes the centre at a distance whose square is |L × e|² / e². The components of L × e are those of the
//! sheared centre, as triangles have them, and one more. f32 has them wrong by less than 16 ε |L| |e|
//! ([`OFF`]), for which the radius is made larger: (r + s)² ≤ (1 + δ) r² + (1 + 1/δ) s², and with it the
//! stretch of the ray that may be inside.

use super::node::{SphereBlock, WIDTH};
use super::ray::ShearRay;
use super::simd::{Floats, Simd};
use super::traverse::Found;
use crate::geometry::{AnalyticShape, Sphere};
use crate::math::Ray;

/// By how much the square of a radius is made larger, δ above.
const SPREAD: f32 = 1.0 / 256.0;

/// By how much more, for each square of the distance.
const OFF: f32 = {
    let off = 16.0 * f32::EPSILON / 2.0;
    (1.0 + 1.0 / SPREAD) * off * off
};

/// Where squares are so small that they have no digits left, every sphere may be hit.
const LEAST: f32 = 1e-36;

/// Where places without a sphere are: beyond all that may be in a scene, and their squares are finite.
const NOWHERE: f32 = 1e18;

impl SphereBlock {
    /// With the first `len` of the spheres.
    pub(super) fn new(len: usize, spheres: [Sphere; WIDTH], ids: [u32; WIDTH]) -> Self {
        let mut rounded = [[NOWHERE; WIDTH], [NOWHERE; WIDTH], [NOWHERE; WIDTH], [0.0; WIDTH]];
        for (lane, sphere) in spheres.iter().enumerate().take(len) {
            let center = sphere.center.as_vec3();
            for axis in 0..3 {
                rounded[axis][lane] = center[axis];
            }
            let off = (center.as_dvec3() - sphere.center).length();
            rounded[3][lane] = ((sphere.radius + off) as f32).next_up();
        }
        Self { rounded, spheres, ids }
    }
}

impl<F: Floats<Array = [f32; 8]>> ShearRay<F> {
    /// The spheres that may be hit at t in (`t_min`, `t_max`], as bits, and where at the earliest.
    #[inline(always)]
    fn near_spheres<S: Simd<F8 = F>>(
        &self,
        simd: S,
        block: &SphereBlock,
        t_max: f32,
    ) -> (u32, [f32; WIDTH]) {
        let [x, y, z] = self.seen(self.axes.map(|axis| &block.rounded[axis]));
        let [across_x, across_y, _] = self.sheared([x, y, z]);
        let [shear_x, shear_y] = self.shear;
        let third = across_x.mul_sub(shear_y, across_y.mul(shear_x));
        let passes = third.mul_add(third, across_x.mul_add(across_x, across_y.mul(across_y)));
        let distance = z.mul_add(z, x.mul_add(x, y.mul(y)));
        let e = shear_x.mul_add(shear_x, shear_y.mul_add(shear_y, simd.splat8(1.0)));
        let radius = simd.load8(&block.rounded[3]);
        let larger = radius
            .mul(radius)
            .mul_add(simd.splat8(1.0 + SPREAD), simd.splat8(LEAST))
            .add(distance.mul(simd.splat8(OFF)));
        let inside = e.mul_sub(larger, passes);
        // Where along the ray the centre is, and how far from there the sphere reaches at most.
        let along = self.along.div(e);
        let middle = x.mul_add(shear_x, y.mul_add(shear_y, z)).mul(along);
        let zero = simd.splat8(0.0);
        let half = inside.max(zero).sqrt().mul(along.max(zero.sub(along)));
        let (enter, exit) = (middle.sub(half), middle.add(half));
        // What is not a number may be hit.
        let passed = inside.le(zero) | exit.le(self.t_min) | simd.splat8(t_max).le(enter);
        (!passed & ((1 << WIDTH) - 1), enter.to_array())
    }

    /// Puts the closest hit in the place of `best`, if it comes before it.
    #[inline(always)]
    pub(super) fn closest_sphere<S: Simd<F8 = F>>(
        &self,
        simd: S,
        block: &SphereBlock,
        ray: &Ray,
        best: &mut Found,
    ) {
        let (mut bits, enter) = self.near_spheres(simd, block, best.t);
        while bits != 0 {
            // The nearest first: it may hide the others.
            let mut lane = bits.trailing_zeros() as usize & 7;
            let mut rest = bits & (bits - 1);
            while rest != 0 {
                let other = rest.trailing_zeros() as usize & 7;
                rest &= rest - 1;
                lane = if enter[other] < enter[lane] { other } else { lane };
            }
            bits &= !(1 << lane);
            if enter[lane] >= best.t {
                continue;
            }
            let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let hit = block.spheres[lane].intersect(o, d, ray.t_min.into(), best.t.into());
            if let Some(hit) = hit {
                let found = Found::shape(hit, block.ids[lane]);
                if found.is_before(best) {
                    *best = found;
                }
            }
        }
    }

    /// Whether any sphere is hit that `counts`, by its number.
    #[inline(always)]
    pub(super) fn meets_sphere<S: Simd<F8 = F>>(
        &self,
        simd: S,
        block: &SphereBlock,
        ray: &Ray,
        counts: impl Fn(u32) -> bool,
    ) -> bool {
        let (mut bits, _) = self.near_spheres(simd, block, ray.t_max);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            if block.spheres[lane].occluded(o, d, ray.t_min.into(), ray.t_max.into())
                && counts(block.ids[lane])
            {
                return true;
            }
        }
        false
    }
}
