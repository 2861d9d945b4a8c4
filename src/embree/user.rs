//! Shapes that are intersected by Rust: the safe side of Embree's callbacks.
//!
//! Embree calls back with one ray or with a packet of any width, on any thread. The functions here
//! turn that into one call of [`UserGeometry`] a ray, monomorphised for the kind of shape. They
//! allocate nothing; should a shape's own code panic, the process aborts (a panic does not cross C).

use std::sync::Arc;

use super::query::Ray;
use super::sys;

/// A set of shapes of one kind, addressed by index.
pub trait UserGeometry: Send + Sync + 'static {
    /// The closest hit of `ray` with shape `primitive` at t in (`t_min`, `t_max`].
    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<UserHit>;

    /// Whether there is any such hit.
    fn occluded(&self, primitive: u32, ray: &Ray) -> bool {
        self.intersect(primitive, ray).is_some()
    }
}

/// What a shape says of its closest hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UserHit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// First surface parameter, passed on as it is.
    pub u: f32,
    /// Second surface parameter.
    pub v: f32,
}

/// A box around a shape, computed before the build: Embree asks for it with denormals flushed to
/// zero, where Rust's arithmetic is not what it says, so the callback does nothing but copy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UserBounds {
    /// Least coordinates.
    pub lower: [f32; 3],
    /// Greatest coordinates.
    pub upper: [f32; 3],
}

impl UserBounds {
    #[inline]
    pub(super) const fn to_native(self) -> sys::RTCBounds {
        let ([lower_x, lower_y, lower_z], [upper_x, upper_y, upper_z]) = (self.lower, self.upper);
        sys::RTCBounds {
            lower_x,
            lower_y,
            lower_z,
            align0: 0.0,
            upper_x,
            upper_y,
            upper_z,
            align1: 0.0,
        }
    }
}

/// What the callbacks of one geometry see.
pub(super) struct Context<G> {
    pub(super) bounds: Vec<UserBounds>,
    pub(super) shapes: Arc<G>,
}

/// Copies the precomputed box of one shape.
pub(super) unsafe extern "C" fn bounds<G: UserGeometry>(
    args: *const sys::RTCBoundsFunctionArguments,
) {
    // SAFETY: Embree passes valid arguments; the user pointer is the Context<G> that `Geometry::user`
    // registered together with this function and that the geometry keeps alive.
    let (args, context) = unsafe { (&*args, &*(*args).geometryUserPtr.cast::<Context<G>>()) };
    if let Some(b) = context.bounds.get(args.primID as usize) {
        // SAFETY: `bounds_o` points to an RTCBounds to be written.
        unsafe { args.bounds_o.write(b.to_native()) };
    }
}

/// Fields of `RTCRayN` and, behind it, `RTCHitN`: arrays of N four-byte values each, in this order
/// (rtcore_ray.h, `RTCRayN_org_x` and its like).
mod field {
    pub(super) const ORG: usize = 0;
    pub(super) const T_NEAR: usize = 3;
    pub(super) const DIR: usize = 4;
    pub(super) const T_FAR: usize = 8;
    pub(super) const NG: usize = 12;
    pub(super) const U: usize = 15;
    pub(super) const V: usize = 16;
    pub(super) const PRIM_ID: usize = 17;
    pub(super) const GEOM_ID: usize = 18;
    pub(super) const INST_ID: usize = 19;
    pub(super) const INST_PRIM_ID: usize = 20;
}

/// Lane `lane` of `n` rays in Embree's N-wide layout.
///
/// # Safety
/// `rays` points to an `RTCRayN` (or `RTCRayHitN`) of width `n`, and `lane < n`.
#[inline]
unsafe fn load(rays: *const f32, n: usize, lane: usize) -> Ray {
    // SAFETY: the field index is below 12 and the lane below n: inside the structure.
    let at = |field: usize| unsafe { *rays.add(field * n + lane) };
    Ray {
        origin: [at(field::ORG), at(field::ORG + 1), at(field::ORG + 2)],
        direction: [at(field::DIR), at(field::DIR + 1), at(field::DIR + 2)],
        t_min: at(field::T_NEAR),
        t_max: at(field::T_FAR),
    }
}

/// Intersects the valid lanes with one shape and writes the hits that are closer.
pub(super) unsafe extern "C" fn intersect<G: UserGeometry>(
    args: *const sys::RTCIntersectFunctionNArguments,
) {
    // SAFETY: the arguments are Embree's, for one callback; each width is the one that they name, and
    // single rays, the most by far, get code of their own.
    unsafe {
        match (*args).N {
            1 => intersect_lanes::<G>(&*args, 1),
            n => intersect_lanes::<G>(&*args, n as usize),
        }
    }
}

/// # Safety
/// `args` are Embree's for one callback of width `n`.
#[inline(always)]
unsafe fn intersect_lanes<G: UserGeometry>(args: &sys::RTCIntersectFunctionNArguments, n: usize) {
    // SAFETY: as in `bounds`; the query context is never null inside a callback.
    let (shapes, query) =
        unsafe { (&*(*args.geometryUserPtr.cast::<Context<G>>()).shapes, &*args.context) };
    let rays = args.rayhit.cast::<f32>();
    for lane in 0..n {
        // SAFETY: `valid` holds n entries; `rayhit` is an RTCRayHitN of width n, exclusively ours.
        unsafe {
            if *args.valid.add(lane) != -1 {
                continue;
            }
            let ray = load(rays, n, lane);
            let Some(hit) = shapes.intersect(args.primID, &ray) else { continue };
            // A NaN distance fails the comparison, so it is no hit.
            if !(hit.t > ray.t_min && hit.t <= ray.t_max) {
                continue;
            }
            let put = |field: usize, value: f32| *rays.add(field * n + lane) = value;
            put(field::T_FAR, hit.t);
            put(field::NG, 0.0);
            put(field::NG + 1, 0.0);
            put(field::NG + 2, 0.0);
            put(field::U, hit.u);
            put(field::V, hit.v);
            let put_id = |field: usize, id: u32| *rays.cast::<u32>().add(field * n + lane) = id;
            put_id(field::PRIM_ID, args.primID);
            put_id(field::GEOM_ID, args.geomID);
            // Both, or a hit inside an instance array is filed under the wrong copy.
            put_id(field::INST_ID, query.instID[0]);
            put_id(field::INST_PRIM_ID, query.instPrimID[0]);
        }
    }
}

/// Marks the valid lanes that one shape blocks.
pub(super) unsafe extern "C" fn occluded<G: UserGeometry>(
    args: *const sys::RTCOccludedFunctionNArguments,
) {
    // SAFETY: as in `intersect`.
    unsafe {
        match (*args).N {
            1 => occluded_lanes::<G>(&*args, 1),
            n => occluded_lanes::<G>(&*args, n as usize),
        }
    }
}

/// # Safety
/// `args` are Embree's for one callback of width `n`.
#[inline(always)]
unsafe fn occluded_lanes<G: UserGeometry>(args: &sys::RTCOccludedFunctionNArguments, n: usize) {
    // SAFETY: as in `intersect_lanes`.
    let shapes = unsafe { &*(*args.geometryUserPtr.cast::<Context<G>>()).shapes };
    let rays = args.ray.cast::<f32>();
    for lane in 0..n {
        // SAFETY: `valid` holds n entries; `ray` is an RTCRayN of width n, exclusively ours.
        unsafe {
            if *args.valid.add(lane) == -1 && shapes.occluded(args.primID, &load(rays, n, lane)) {
                *rays.add(field::T_FAR * n + lane) = f32::NEG_INFINITY;
            }
        }
    }
}
