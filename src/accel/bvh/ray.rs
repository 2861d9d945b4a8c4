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
    pub(super) t_min: f32,
    /// Finite.
    pub(super) t_max: f32,
    /// The axis along which the direction is longest: the last, as [`turned`] has them.
    pub(super) last: u32,
    /// By how much the other two grow along that one, and its reciprocal.
    pub(super) shear: [f32; 3],
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
        t_min: 0.0,
        t_max: 0.0,
        last: 2,
        shear: [0.0; 3],
    };

    /// None where nothing can be hit: a number is not finite, the direction is zero, the ray has no length.
    #[inline(always)]
    pub(super) fn new<const ROBUST: bool>(ray: &Ray) -> Option<Self> {
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let (setup, is_ray) = Self::of::<ROBUST>(o, d, [ray.t_min, ray.t_max]);
        is_ray.then_some(setup)
    }

    /// Whether anything can be hit, and if so, with what. Without branches, so that the compiler makes a
    /// loop over several rays one over lanes.
    #[inline(always)]
    pub(super) fn of<const ROBUST: bool>(
        o: [f32; 3],
        d: [f32; 3],
        [t_min, t_max]: [f32; 2],
    ) -> (Self, bool) {
        // Zero times a finite number is zero; any other is NaN.
        let sum = (o[0] + o[1] + o[2] + d[0] + d[1] + d[2]) * 0.0;
        let t_max = if t_max < f32::MAX { t_max } else { f32::MAX };
        let size = d.map(f32::abs);
        let longest = if size[0] > size[1] { size[0] } else { size[1] };
        let longest = if longest > size[2] { longest } else { size[2] };
        let is_ray = (sum == 0.0) & (longest > 0.0) & (t_min < t_max);

        let last = if size[0] == longest { 0 } else { 1 + u32::from(size[1] != longest) };
        let along = 1.0 / turned(d, last)[2];
        let [x, y, _] = turned(d, last);
        // Along a slab the reciprocal is huge, but finite, so that nothing is NaN; and the slab is left a
        // little behind the origin, so that a ray in the very plane of a face is inside for as long as any
        // ray goes (10¹³ units).
        let least = 1e-24 / if longest < 1.0 { longest } else { 1.0 };
        let margin = if ROBUST { MARGIN } else { 0.0 };
        let mut setup = Self { t_min: t_min + 0.0, t_max, last, ..Self::NOTHING };
        for axis in 0..3 {
            let (o, d) = (o[axis], d[axis]);
            let is_along = d.abs() < longest * 1e-18;
            let r = 1.0 / d;
            let r = if is_along | (r.abs() > HUGE) { HUGE.copysign(d) } else { r };
            let shift = o.abs() * f32::EPSILON;
            let shift = if shift > least { shift } else { least }.copysign(d);
            setup.origin[axis] = o;
            setup.far_origin[axis] = if is_along { o - shift } else { o };
            setup.near[axis] = r * (1.0 - margin);
            setup.far[axis] = r * (1.0 + margin);
        }
        setup.shear = [x * along, y * along, along];
        (setup, is_ray)
    }

    /// Which plane of a slab is entered first, by axis: 0 the lower, 1 the upper.
    #[inline(always)]
    pub(super) fn sign(&self) -> [usize; 3] {
        self.near.map(|r| usize::from(r < 0.0))
    }
}

/// What belongs to the axes, that of `last` last: 0, 1, 2 or 1, 2, 0 or 2, 0, 1.
#[inline(always)]
pub(super) fn turned<T: Copy>([x, y, z]: [T; 3], last: u32) -> [T; 3] {
    if last == 0 {
        [y, z, x]
    } else if last == 1 {
        [z, x, y]
    } else {
        [x, y, z]
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
            sign: ray.sign(),
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

/// The ray in every lane, against eight triangles or spheres: they are seen from its origin, and sheared so
/// that it runs along an axis.
#[derive(Clone, Copy)]
pub(super) struct ShearRay<F> {
    /// In the order of `axes`, of which the direction is longest along the last.
    pub(super) origin: [F; 3],
    pub(super) shear: [F; 2],
    pub(super) axes: [usize; 3],
    /// Length along the last axis to distance.
    pub(super) along: f32,
    pub(super) t_min: f32,
}

impl<F: Floats<Array = [f32; 8]>> ShearRay<F> {
    #[inline(always)]
    pub(super) fn new<S: Simd<F8 = F>>(simd: S, ray: &RaySetup) -> Self {
        Self::of(simd, ray.origin, ray.shear, ray.last, ray.t_min)
    }

    /// By the parts of a [`RaySetup`].
    #[inline(always)]
    pub(super) fn of<S: Simd<F8 = F>>(
        simd: S,
        origin: [f32; 3],
        [x, y, along]: [f32; 3],
        last: u32,
        t_min: f32,
    ) -> Self {
        Self {
            origin: turned(origin, last).map(|o| simd.splat8(o)),
            shear: [simd.splat8(x), simd.splat8(y)],
            axes: turned([0, 1, 2], last),
            along,
            t_min,
        }
    }

    /// Points as seen from the origin. They are given by coordinate, in the order of `axes`.
    #[inline(always)]
    pub(super) fn seen<S: Simd<F8 = F>>(&self, simd: S, points: [&[f32; 8]; 3]) -> [F; 3] {
        let [x, y, z] = points.map(|p| simd.load8(p));
        [x.sub(self.origin[0]), y.sub(self.origin[1]), z.sub(self.origin[2])]
    }

    /// Such points, sheared.
    #[inline(always)]
    pub(super) fn sheared(&self, [x, y, z]: [F; 3]) -> [F; 3] {
        [self.shear[0].neg_mul_add(z, x), self.shear[1].neg_mul_add(z, y), z]
    }
}
