//! What a ray brings along to boxes and triangles, worked out once.

use super::simd::{Floats, Simd};
use crate::math::Ray;

/// A ray, as boxes and triangles want it.
#[derive(Debug, Clone, Copy)]
pub(super) struct RaySetup {
    pub(super) origin: [f32; 3],
    /// The origin for where a slab is left: where the ray runs along the slab, short of it.
    pub(super) far_origin: [f32; 3],
    /// Reciprocals of the direction, for where a slab is entered and where it is left; finite.
    pub(super) near: [f32; 3],
    pub(super) far: [f32; 3],
    /// Which plane of a slab is entered first, by axis: 0 the lower, 1 the upper.
    pub(super) sign: [usize; 3],
    pub(super) t_min: f32,
    /// Finite.
    pub(super) t_max: f32,
    /// The axes, the one along which the direction is longest last.
    pub(super) axes: [usize; 3],
    /// By how much the first two grow along that one, and its reciprocal.
    pub(super) shear: [f32; 3],
    /// The origin in the order of `axes`.
    pub(super) pivot: [f32; 3],
}

/// How far slabs are widened, relative to the distance of their planes: three roundings in the plane's
/// distance, and about as many in what a triangle takes the ray and its corners to be. Source: Ize,
/// *Robust BVH ray traversal*, JCGT 2(2), 2013.
const MARGIN: f32 = 4.0 * f32::EPSILON;

/// The largest reciprocal.
const HUGE: f32 = f32::MAX / 4.0;

impl RaySetup {
    /// No ray.
    pub(super) const NOTHING: Self = Self {
        origin: [0.0; 3],
        far_origin: [0.0; 3],
        near: [0.0; 3],
        far: [0.0; 3],
        sign: [0; 3],
        t_min: 0.0,
        t_max: 0.0,
        axes: [0, 1, 2],
        shear: [0.0; 3],
        pivot: [0.0; 3],
    };

    /// None where nothing can be hit: a number is not finite, the direction is zero, the ray has no length.
    #[inline(always)]
    pub(super) fn new<const ROBUST: bool>(ray: &Ray) -> Option<Self> {
        let (o, d) = (ray.origin, ray.direction);
        // Zero times a finite number is zero; any other is NaN.
        let sum = (o.x + o.y + o.z + d.x + d.y + d.z) * 0.0;
        let t_max = ray.t_max.min(f32::MAX);
        let size = d.abs();
        let longest = size.max_element();
        if sum != 0.0 || !(longest > 0.0) || !(ray.t_min < t_max) {
            return None;
        }
        let z = if size.x == longest { 0 } else { 1 + usize::from(size.y != longest) };
        // 0, 1, 2 → 1, 2, 0 → 2, 0, 1.
        let x = if z == 2 { 0 } else { z + 1 };
        let y = if z == 0 { 2 } else { z - 1 };
        let pivot = o.to_array();
        let (o, d) = ([o.x, o.y, o.z], d.to_array());
        let along = 1.0 / d[z];
        // Along a slab the reciprocal is huge, but finite, so that nothing is NaN; and the slab is left a
        // little behind the origin, so that a ray in the very plane of a face is inside for as long as any
        // ray goes (10¹³ units).
        let mut far_origin = o;
        let mut r = d.map(|d| (1.0 / d).clamp(-HUGE, HUGE));
        for axis in 0..3 {
            if d[axis].abs() < longest * 1e-18 {
                r[axis] = HUGE.copysign(d[axis]);
                let shift = (o[axis].abs() * f32::EPSILON).max(1e-24 / longest.min(1.0));
                far_origin[axis] -= shift.copysign(d[axis]);
            }
        }
        let margin = if ROBUST { MARGIN } else { 0.0 };
        Some(Self {
            origin: o,
            far_origin,
            near: r.map(|r| r * (1.0 - margin)),
            far: r.map(|r| r * (1.0 + margin)),
            sign: r.map(|r| usize::from(r < 0.0)),
            t_min: ray.t_min + 0.0,
            t_max,
            axes: [x, y, z],
            shear: [d[x] * along, d[y] * along, along],
            pivot: [pivot[x], pivot[y], pivot[z]],
        })
    }
}

/// The ray in every lane, against eight boxes.
#[derive(Clone, Copy)]
pub(super) struct SlabRay<F> {
    /// For planes that are entered and planes that are left by. If not robust: times the reciprocal and
    /// negated.
    origins: [[F; 3]; 2],
    reciprocals: [[F; 3]; 2],
    t_min: F,
    sign: [usize; 3],
}

impl<F: Floats> SlabRay<F> {
    #[inline(always)]
    pub(super) fn new<S: Simd<F8 = F>, const ROBUST: bool>(simd: S, ray: &RaySetup) -> Self {
        let splat = |[x, y, z]: [f32; 3]| [simd.splat8(x), simd.splat8(y), simd.splat8(z)];
        let mut origins = [ray.origin, ray.far_origin];
        let mut reciprocals = [ray.near, ray.far];
        if !ROBUST {
            // Where a product is huge its rounding is too, and the slab is widened by it.
            const MOST: f32 = 1e24;
            for axis in 0..3 {
                let r = ray.near[axis].clamp(-MOST, MOST);
                let product = -ray.origin[axis] * r;
                let wider = if r.abs() == MOST { product.abs() * f32::EPSILON + 1e15 } else { 0.0 };
                (origins[0][axis], origins[1][axis]) = (product - wider, product + wider);
                (reciprocals[0][axis], reciprocals[1][axis]) = (r, r);
            }
        }
        Self {
            origins: [splat(origins[0]), splat(origins[1])],
            reciprocals: [splat(reciprocals[0]), splat(reciprocals[1])],
            t_min: simd.splat8(ray.t_min),
            sign: ray.sign,
        }
    }

    /// In which boxes the ray is somewhere before `t_max`, as bits, and where it enters them.
    #[inline(always)]
    pub(super) fn meets<S: Simd<F8 = F>, const ROBUST: bool>(
        &self,
        simd: S,
        planes: &[[[f32; 8]; 2]; 3],
        t_max: F,
    ) -> (u32, F) {
        let near = self.times::<S, ROBUST>(simd, planes, 0);
        let far = self.times::<S, ROBUST>(simd, planes, 1);
        let enter = near[0].max(near[1]).max(near[2].max(self.t_min));
        let exit = far[0].min(far[1]).min(far[2].min(t_max));
        (enter.le(exit), enter)
    }

    /// Where the ray passes the planes that are entered (`side` 0) or left (1) by, by axis.
    #[inline(always)]
    fn times<S: Simd<F8 = F>, const ROBUST: bool>(
        &self,
        simd: S,
        planes: &[[[f32; 8]; 2]; 3],
        side: usize,
    ) -> [F; 3] {
        let (origins, reciprocals) = (&self.origins[side], &self.reciprocals[side]);
        let mut times = *reciprocals;
        for axis in 0..3 {
            let plane = simd.load8(&planes[axis][self.sign[axis] & 1 ^ side]);
            let (origin, reciprocal) = (origins[axis], reciprocals[axis]);
            times[axis] = if ROBUST {
                plane.sub(origin).mul(reciprocal)
            } else {
                plane.mul_add(reciprocal, origin)
            };
        }
        times
    }
}
