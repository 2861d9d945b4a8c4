//! What a ray brings along to boxes and triangles, worked out once.

use std::hint::select_unpredictable;

use glam::Vec4;

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

/// The largest where slabs are not exact.
const MOST: f32 = 1e24;

/// What boxes and triangles want of a ray's direction: the same for all rays that run along it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slopes {
    direction: [f32; 3],
    near: [f32; 3],
    far: [f32; 3],
    last: u32,
    shear: [f32; 3],
    /// Along the slabs of which axes it runs.
    is_along: [bool; 3],
    /// How far short of the origin such a slab is left, at least.
    least: f32,
    /// Whether it is one: finite, and not zero.
    is_direction: bool,
}

impl Slopes {
    /// Without branches, so that the compiler makes a loop over several rays one over lanes.
    #[inline(always)]
    pub(super) fn of<const ROBUST: bool>(d: [f32; 3]) -> Self {
        // Zero times a finite number is zero; any other is NaN.
        let [x, y, z] = d.map(|d| d * 0.0 == 0.0);
        let size = d.map(f32::abs);
        let longest = if size[0] > size[1] { size[0] } else { size[1] };
        let longest = if longest > size[2] { longest } else { size[2] };
        let last = if size[0] == longest { 0 } else { 1 + u32::from(size[1] != longest) };
        let along = 1.0 / turned(d, last)[2];
        let [first, second, _] = turned(d, last);
        let margin = if ROBUST { MARGIN } else { 0.0 };
        let (mut near, mut far, mut is_along) = ([0.0; 3], [0.0; 3], [false; 3]);
        for axis in 0..3 {
            // Along a slab the reciprocal is huge, but finite, so that nothing is NaN.
            is_along[axis] = size[axis] < longest * 1e-18;
            let r = 1.0 / d[axis];
            let r = if is_along[axis] | (r.abs() > HUGE) { HUGE.copysign(d[axis]) } else { r };
            near[axis] = r * (1.0 - margin);
            far[axis] = r * (1.0 + margin);
        }
        Self {
            direction: d,
            near,
            far,
            last,
            shear: [first * along, second * along, along],
            is_along,
            least: 1e-24 / if longest < 1.0 { longest } else { 1.0 },
            is_direction: x & y & z & (longest > 0.0),
        }
    }
}

impl RaySetup {
    /// Whether anything can be hit, and if so, with what. Without branches, likewise.
    #[inline(always)]
    pub(super) fn new(o: [f32; 3], slopes: &Slopes, [t_min, t_max]: [f32; 2]) -> (Self, bool) {
        let Slopes { direction, near, far, last, shear, is_along, least, is_direction } = *slopes;
        let [x, y, z] = o.map(|o| o * 0.0 == 0.0);
        let t_max = if t_max < f32::MAX { t_max } else { f32::MAX };
        let is_ray = is_direction & x & y & z & (t_min < t_max);
        let mut far_origin = o;
        for axis in 0..3 {
            // A slab along which the ray runs is left a little behind the origin, so that a ray in the very plane
            // of a face is inside for as long as any ray goes (10¹³ units).
            let shift = o[axis].abs() * f32::EPSILON;
            let shift = if shift > least { shift } else { least }.copysign(direction[axis]);
            far_origin[axis] = if is_along[axis] { o[axis] - shift } else { o[axis] };
        }
        let t_min = t_min + 0.0;
        (Self { origin: o, far_origin, near, far, t_min, t_max, last, shear }, is_ray)
    }
}

/// What belongs to the axes, that of `last` last: 0, 1, 2 or 1, 2, 0 or 2, 0, 1.
#[inline(always)]
pub(super) fn turned<T: Copy>([x, y, z]: [T; 3], last: u32) -> [T; 3] {
    // The axis differs from ray to ray, so that branches would go wrong.
    let of = |first, second, third| {
        select_unpredictable(last == 0, first, select_unpredictable(last == 1, second, third))
    };
    [of(y, z, x), of(z, x, y), of(x, y, z)]
}

/// One ray, against boxes and against what is in leaves.
pub(super) struct LoneRay<F> {
    pub(super) slabs: SlabRay<F>,
    pub(super) shear: ShearRay<F>,
    /// Finite.
    pub(super) t_max: f32,
}

impl<F: Floats<Array = [f32; 8]>> LoneRay<F> {
    /// None where nothing can be hit: a number is not finite, the direction is zero, the ray has no length.
    ///
    /// The numbers are those of [`RaySetup::new`], which lays out many rays side by side; here it is the three axes that
    /// are.
    #[inline(always)]
    pub(super) fn new<S: Simd<F8 = F>, const ROBUST: bool>(simd: S, ray: &Ray) -> Option<Self> {
        let (o, d) = (ray.origin.extend(0.0), ray.direction.extend(0.0));
        let t_max = if ray.t_max < f32::MAX { ray.t_max } else { f32::MAX };
        let size = d.abs();
        let longest = size.max_element();
        let is_finite = (o * 0.0 + d * 0.0).cmpeq(Vec4::ZERO).all();
        if !(is_finite && longest > 0.0 && ray.t_min < t_max) {
            return None;
        }
        let is_along = size.cmplt(Vec4::splat(longest * 1e-18));
        let r = d.recip();
        let is_huge = is_along | r.abs().cmpgt(Vec4::splat(HUGE));
        let r = Vec4::select(is_huge, Vec4::splat(HUGE).copysign(d), r);
        let sides = if ROBUST {
            let least = 1e-24 / if longest < 1.0 { longest } else { 1.0 };
            let shift = (o.abs() * f32::EPSILON).max(Vec4::splat(least)).copysign(d);
            let far_origin = Vec4::select(is_along, o - shift, o);
            [[o, r * (1.0 - MARGIN)], [far_origin, r * (1.0 + MARGIN)]]
        } else {
            // Where a product is huge its rounding is too, and the slab is widened by it.
            let most = Vec4::splat(MOST);
            let r = r.max(-most).min(most);
            let product = -o * r;
            let wider = product.abs() * f32::EPSILON + 1e15;
            let wider = Vec4::select(r.abs().cmpeq(most), wider, Vec4::ZERO);
            [[product - wider, r], [product + wider, r]]
        };
        let splat = |v: Vec4| [v.x, v.y, v.z].map(|x| simd.splat8(x));
        let upper = sides[0][1].cmplt(Vec4::ZERO).bitmask() as usize;
        let t_min = ray.t_min + 0.0;
        let slabs = SlabRay {
            origins: sides.map(|[origin, _]| splat(origin)),
            reciprocals: sides.map(|[_, reciprocal]| splat(reciprocal)),
            t_min: simd.splat8(t_min),
            sign: [upper & 1, upper >> 1 & 1, upper >> 2 & 1],
        };
        let last = size.cmpeq(Vec4::splat(longest)).bitmask().trailing_zeros();
        let [first, second, third] = turned([0, 1, 2], last);
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let along = 1.0 / d[third];
        let shear = ShearRay {
            origin: [first, second, third].map(|axis| simd.splat8(o[axis])),
            shear: [simd.splat8(d[first] * along), simd.splat8(d[second] * along)],
            axes: [first, second, third],
            along: simd.splat8(along),
            t_min: simd.splat8(t_min),
        };
        Some(Self { slabs, shear, t_max })
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
/// that it runs along an axis. Or, in sixteen lanes, two rays for which that is the same axis.
#[derive(Clone, Copy)]
pub(super) struct ShearRay<F> {
    /// In the order of `axes`, of which the direction is longest along the last.
    pub(super) origin: [F; 3],
    pub(super) shear: [F; 2],
    pub(super) axes: [usize; 3],
    /// Length along the last axis to distance.
    pub(super) along: F,
    pub(super) t_min: F,
}

impl<F: Floats> ShearRay<F> {
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
            along: simd.splat8(along),
            t_min: simd.splat8(t_min),
        }
    }

    /// Points as seen from the origin. They are given by coordinate, in the order of `axes`.
    #[inline(always)]
    pub(super) fn seen(&self, points: [&[f32; 8]; 3]) -> [F; 3] {
        let [x, y, z] = points.map(|p| self.along.eights(p));
        [x.sub(self.origin[0]), y.sub(self.origin[1]), z.sub(self.origin[2])]
    }

    /// Such points, sheared.
    #[inline(always)]
    pub(super) fn sheared(&self, [x, y, z]: [F; 3]) -> [F; 3] {
        [self.shear[0].neg_mul_add(z, x), self.shear[1].neg_mul_add(z, y), z]
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::simd::Portable;
    use super::*;

    fn check<const ROBUST: bool>(ray: &Ray) -> bool {
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let slopes = Slopes::of::<ROBUST>(d);
        let (setup, is_ray) = RaySetup::new(o, &slopes, [ray.t_min, ray.t_max]);
        let lone = LoneRay::new::<_, ROBUST>(Portable, ray);
        assert_eq!(lone.is_some(), is_ray, "{ray:?}");
        let Some(LoneRay { slabs, shear, t_max }) = lone else { return false };
        let bits = |lanes: &[f32]| lanes.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let first = |lanes: [<Portable as Simd>::F8; 3]| lanes.map(|f| f.to_array()[0]);
        let same = |a: &[f32], b: &[f32]| assert_eq!(bits(a), bits(b), "{ray:?}: {a:?} and {b:?}");
        if ROBUST {
            same(&first(slabs.origins[0]), &setup.origin);
            same(&first(slabs.origins[1]), &setup.far_origin);
            same(&first(slabs.reciprocals[0]), &setup.near);
            same(&first(slabs.reciprocals[1]), &setup.far);
        } else {
            let clamped = setup.near.map(|r| r.clamp(-MOST, MOST));
            for reciprocals in slabs.reciprocals {
                same(&first(reciprocals), &clamped);
            }
            for axis in 0..3 {
                let product = -o[axis] * clamped[axis];
                let [enter, exit] = slabs.origins.map(|origin| first(origin)[axis]);
                // No scene is as large.
                if o[axis].abs() > 1e13 {
                    continue;
                }
                assert!(enter <= product && product <= exit, "{ray:?}");
                assert_eq!(enter < exit, clamped[axis].abs() == MOST, "{ray:?}");
            }
        }
        assert_eq!(slabs.sign, setup.near.map(|r| usize::from(r < 0.0)));
        let turns = ShearRay::of(Portable, setup.origin, setup.shear, setup.last, setup.t_min);
        assert_eq!(shear.axes, turns.axes);
        same(&first(shear.origin), &first(turns.origin));
        same(&shear.shear.map(|f| f.to_array()[0]), &turns.shear.map(|f| f.to_array()[0]));
        same(&shear.along.to_array(), &turns.along.to_array());
        same(&shear.t_min.to_array(), &turns.t_min.to_array());
        same(&[t_max], &[setup.t_max]);
        same(&[slabs.t_min.to_array()[0]], &[setup.t_min]);
        true
    }

    /// A ray by itself and one among many are the same, whatever numbers they have.
    #[test]
    fn a_lone_ray_is_set_up_as_one_of_many() {
        let special = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            1e-44,
            -1e-40,
            1e-30,
            1e-20,
            3e-19,
            -7e-18,
            1e-6,
            1e9,
            -1e20,
            3e38,
            f32::MIN_POSITIVE,
            f32::MAX,
            f32::INFINITY,
            f32::NAN,
        ];
        let mut state = 1u32;
        let mut next = |n: usize| {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 9) as usize % n
        };
        let mut rays = 0;
        for round in 0..200_000 {
            let mut number = || match (round % 3, next(4)) {
                (0, _) | (1, 0) => special[next(special.len())],
                (1, _) => special[next(15)],
                _ => next(1 << 20) as f32 / (1 << 19) as f32 - 1.0,
            };
            let [origin, direction] = [(); 2].map(|()| Vec3::new(number(), number(), number()));
            let [t_min, t_max] = [(); 2].map(|()| number().abs());
            let ray = Ray { t_min, t_max, ..Ray::new(origin, direction) };
            let is_ray = check::<true>(&ray);
            assert_eq!(is_ray, check::<false>(&ray));
            rays += u32::from(is_ray);
        }
        assert!((40_000..160_000).contains(&rays), "{rays}");
    }
}
