//! Copies of a scene as user geometry: rays are taken to the prototype's space here and forwarded. Embree's
//! own instances stand in the box of their prototype's turned box; these stand in whatever box the caller
//! knows, which for a turned solid is a third to a half of that.

use super::geometry::Transform3x4;
use super::query::RayPacket;
use super::scene::Scene;
use super::sys;
use super::user::UserBounds;

/// What the callbacks of one geometry see.
pub(super) struct Copies {
    pub(super) prototype: Scene,
    /// Object from world, one a copy.
    pub(super) transforms: Vec<Transform3x4>,
    /// Boxes in the world, one a copy.
    pub(super) bounds: Vec<UserBounds>,
}

/// Fields of `RTCRayN`: arrays of N floats each.
const ORG: usize = 0;
const T_NEAR: usize = 3;
const DIR: usize = 4;

/// Copies the precomputed box of one copy.
pub(super) unsafe extern "C" fn bounds(args: *const sys::RTCBoundsFunctionArguments) {
    // SAFETY: Embree passes valid arguments; the user pointer is the `Copies` that `Geometry::copies`
    // registered together with this function and that the geometry keeps alive.
    let (args, copies) = unsafe { (&*args, &*(*args).geometryUserPtr.cast::<Copies>()) };
    if let Some(b) = copies.bounds.get(args.primID as usize) {
        // SAFETY: `bounds_o` points to an RTCBounds to be written.
        unsafe { args.bounds_o.write(b.to_native()) };
    }
}

/// Where `N` rays start in the space of one copy, and where they go: forwarding reads origins, directions
/// and t_min, and takes the rest from the ray that it came with.
///
/// # Safety
/// `rays` points to an `RTCRayN` (or `RTCRayHitN`) of width `N`.
#[inline(always)]
unsafe fn to_object<const N: usize>(rays: *const f32, m: &Transform3x4) -> RayPacket<N> {
    // SAFETY: fields 0 to 6 of the structure are arrays of N floats each.
    let field = |i: usize| unsafe { &*rays.add(i * N).cast::<[f32; N]>() };
    let [ox, oy, oz] = [field(ORG), field(ORG + 1), field(ORG + 2)];
    let [dx, dy, dz] = [field(DIR), field(DIR + 1), field(DIR + 2)];
    let mut packet = RayPacket::<N>::empty();
    packet.t_min = *field(T_NEAR);
    for i in 0..N {
        let turned = |row: usize, [x, y, z]: [f32; 3]| {
            m[4 * row] * x + m[4 * row + 1] * y + m[4 * row + 2] * z
        };
        let (origin, direction) = ([ox[i], oy[i], oz[i]], [dx[i], dy[i], dz[i]]);
        packet.org_x[i] = turned(0, origin) + m[3];
        packet.org_y[i] = turned(1, origin) + m[7];
        packet.org_z[i] = turned(2, origin) + m[11];
        packet.dir_x[i] = turned(0, direction);
        packet.dir_y[i] = turned(1, direction);
        packet.dir_z[i] = turned(2, direction);
    }
    packet
}

/// A single ray in the space of one copy.
///
/// # Safety
/// `ray` points to an `RTCRay` (or `RTCRayHit`).
#[inline(always)]
unsafe fn ray_to_object(ray: *const f32, m: &Transform3x4) -> sys::RTCRay {
    // SAFETY: a single ray is a packet of one.
    let packet = unsafe { to_object::<1>(ray, m) };
    sys::RTCRay {
        org_x: packet.org_x[0],
        org_y: packet.org_y[0],
        org_z: packet.org_z[0],
        tnear: packet.t_min[0],
        dir_x: packet.dir_x[0],
        dir_y: packet.dir_y[0],
        dir_z: packet.dir_z[0],
        time: 0.0,
        tfar: 0.0,
        mask: !0,
        id: 0,
        flags: 0,
    }
}

/// Forwards rays into one copy.
pub(super) unsafe extern "C" fn intersect(args: *const sys::RTCIntersectFunctionNArguments) {
    // SAFETY: as in `bounds`.
    let (a, copies) = unsafe { (&*args, &*(*args).geometryUserPtr.cast::<Copies>()) };
    let Some(m) = copies.transforms.get(a.primID as usize) else { return };
    let (rays, scene) = (a.rayhit.cast::<f32>().cast_const(), copies.prototype.raw());
    // SAFETY: `rayhit` is an RTCRayHitN of width N, which is 1 or that of the query; our packets have the
    // layout of Embree's (asserted in `query`). Forwarding is the last thing that the callback does.
    unsafe {
        match a.N {
            1 => {
                let mut ray = ray_to_object(rays, m);
                sys::rtcForwardIntersect1Ex(args, scene, &raw mut ray, a.geomID, a.primID);
            }
            4 => {
                let mut ray = to_object::<4>(rays, m);
                let ray = (&raw mut ray).cast();
                sys::rtcForwardIntersect4Ex(a.valid, args, scene, ray, a.geomID, a.primID);
            }
            8 => {
                let mut ray = to_object::<8>(rays, m);
                let ray = (&raw mut ray).cast();
                sys::rtcForwardIntersect8Ex(a.valid, args, scene, ray, a.geomID, a.primID);
            }
            _ => {
                let mut ray = to_object::<16>(rays, m);
                let ray = (&raw mut ray).cast();
                sys::rtcForwardIntersect16Ex(a.valid, args, scene, ray, a.geomID, a.primID);
            }
        }
    }
}

/// Forwards shadow rays into one copy.
pub(super) unsafe extern "C" fn occluded(args: *const sys::RTCOccludedFunctionNArguments) {
    // SAFETY: as in `bounds`.
    let (a, copies) = unsafe { (&*args, &*(*args).geometryUserPtr.cast::<Copies>()) };
    let Some(m) = copies.transforms.get(a.primID as usize) else { return };
    let (rays, scene) = (a.ray.cast::<f32>().cast_const(), copies.prototype.raw());
    // SAFETY: as in `intersect`.
    unsafe {
        match a.N {
            1 => {
                let mut ray = ray_to_object(rays, m);
                sys::rtcForwardOccluded1Ex(args, scene, &raw mut ray, a.geomID, a.primID);
            }
            4 => {
                let mut ray = to_object::<4>(rays, m);
                let ray = (&raw mut ray).cast();
                sys::rtcForwardOccluded4Ex(a.valid, args, scene, ray, a.geomID, a.primID);
            }
            8 => {
                let mut ray = to_object::<8>(rays, m);
                let ray = (&raw mut ray).cast();
                sys::rtcForwardOccluded8Ex(a.valid, args, scene, ray, a.geomID, a.primID);
            }
            _ => {
                let mut ray = to_object::<16>(rays, m);
                let ray = (&raw mut ray).cast();
                sys::rtcForwardOccluded16Ex(a.valid, args, scene, ray, a.geomID, a.primID);
            }
        }
    }
}
