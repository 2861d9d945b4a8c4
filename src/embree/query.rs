//! Rays as they travel to Embree and hits as they come back: one at a time, and in packets.

use std::mem::{offset_of, size_of};

use super::{INVALID_ID, sys};

/// One ray segment. The direction need not be of unit length; `t` counts in its lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Origin.
    pub origin: [f32; 3],
    /// Direction, not zero.
    pub direction: [f32; 3],
    /// Hits at or before this are none; not negative.
    pub t_min: f32,
    /// Hits beyond this are none.
    pub t_max: f32,
}

impl Ray {
    /// The whole half-line from `origin`.
    pub const fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    pub(super) fn to_native(self) -> sys::RTCRay {
        let ([org_x, org_y, org_z], [dir_x, dir_y, dir_z]) = (self.origin, self.direction);
        sys::RTCRay {
            org_x,
            org_y,
            org_z,
            tnear: self.t_min,
            dir_x,
            dir_y,
            dir_z,
            time: 0.0,
            tfar: self.t_max,
            mask: !0,
            id: 0,
            flags: 0,
        }
    }
}

/// The closest hit of one ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the direction. May be non-finite where coordinates are huge: check.
    pub t: f32,
    /// Barycentric weight of the second corner (for user geometry: what it reported). Rounding may
    /// leave it a little outside [0, 1].
    pub u: f32,
    /// Barycentric weight of the third corner.
    pub v: f32,
    /// Geometric normal of a triangle in the space of its own scene, not of unit length. In robust
    /// scenes its error grows with the distance of the ray's origin: recompute it from the corners.
    pub ng: [f32; 3],
    /// Index of the primitive in its geometry.
    pub primitive: u32,
    /// Id of the geometry in its scene.
    pub geometry: u32,
    /// Id of the instance (array) that was entered, or [`INVALID_ID`].
    pub instance: u32,
    /// Index within the instance array (0 for a single instance), or [`INVALID_ID`].
    pub instance_primitive: u32,
}

impl Hit {
    pub(super) fn from_native(t: f32, hit: &sys::RTCHit) -> Option<Self> {
        (hit.geomID != INVALID_ID).then_some(Self {
            t,
            u: hit.u,
            v: hit.v,
            ng: [hit.Ng_x, hit.Ng_y, hit.Ng_z],
            primitive: hit.primID,
            geometry: hit.geomID,
            instance: hit.instID[0],
            instance_primitive: hit.instPrimID[0],
        })
    }
}

/// Which lanes of a packet are traced: −1 for yes, 0 for no.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct PacketMask<const N: usize>(pub(super) [i32; N]);

impl<const N: usize> PacketMask<N> {
    /// Lane `i` is traced where bit `i` is set.
    #[inline]
    pub fn from_bits(bits: u32) -> Self {
        Self(std::array::from_fn(|i| -((bits >> i & 1) as i32)))
    }
}

/// How the rays of a packet are led through the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coherence {
    /// Together (`RTC_RAY_QUERY_FLAG_COHERENT`): for camera rays, and shadow rays from what they hit.
    Coherent,
    /// Each for itself as soon as few are left that go the same way (`RTC_RAY_QUERY_FLAG_INCOHERENT`).
    Incoherent,
}

impl Coherence {
    pub(super) const fn flags(self) -> sys::RTCRayQueryFlags {
        match self {
            Self::Coherent => sys::RTC_RAY_QUERY_FLAG_COHERENT,
            Self::Incoherent => sys::RTC_RAY_QUERY_FLAG_INCOHERENT,
        }
    }
}

/// `N` rays side by side (`RTCRay4`, `RTCRay8`, `RTCRay16`).
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
#[expect(missing_docs, reason = "the fields of `Ray`, a lane each")]
pub struct RayPacket<const N: usize> {
    pub org_x: [f32; N],
    pub org_y: [f32; N],
    pub org_z: [f32; N],
    pub t_min: [f32; N],
    pub dir_x: [f32; N],
    pub dir_y: [f32; N],
    pub dir_z: [f32; N],
    time: [f32; N],
    pub t_max: [f32; N],
    /// Geometry whose mask has no bit in common is not seen.
    pub mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
}

impl<const N: usize> RayPacket<N> {
    /// A packet to be filled in; lanes that stay as they are must be left out by the mask.
    #[inline]
    pub const fn empty() -> Self {
        Self {
            org_x: [0.0; N],
            org_y: [0.0; N],
            org_z: [0.0; N],
            t_min: [0.0; N],
            dir_x: [0.0; N],
            dir_y: [0.0; N],
            dir_z: [0.0; N],
            time: [0.0; N],
            t_max: [0.0; N],
            mask: [!0; N],
            id: [0; N],
            flags: [0; N],
        }
    }

    /// Whether an occlusion query found lane `i` blocked.
    #[inline]
    pub fn is_occluded(&self, i: usize) -> bool {
        // Embree writes −∞; "negative" would not do, as a caller's own t_max may be that.
        self.t_max[i] == f32::NEG_INFINITY
    }
}

/// `N` hits side by side (`RTCHit4`, `RTCHit8`, `RTCHit16`), of the same fields as [`Hit`]. A lane
/// without a hit has `geometry` = [`INVALID_ID`].
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
#[expect(missing_docs, reason = "the fields of `Hit`, a lane each")]
pub struct HitPacket<const N: usize> {
    pub ng_x: [f32; N],
    pub ng_y: [f32; N],
    pub ng_z: [f32; N],
    pub u: [f32; N],
    pub v: [f32; N],
    pub primitive: [u32; N],
    pub geometry: [u32; N],
    pub instance: [u32; N],
    pub instance_primitive: [u32; N],
}

/// `N` rays and the places for their hits. After a query `ray.t_max` is the distance of the hit.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct RayHitPacket<const N: usize> {
    /// The rays.
    pub ray: RayPacket<N>,
    /// Their hits.
    pub hit: HitPacket<N>,
}

impl<const N: usize> RayHitPacket<N> {
    /// Rays that have hit nothing yet.
    #[inline]
    pub const fn new(ray: RayPacket<N>) -> Self {
        let hit = HitPacket {
            ng_x: [0.0; N],
            ng_y: [0.0; N],
            ng_z: [0.0; N],
            u: [0.0; N],
            v: [0.0; N],
            primitive: [INVALID_ID; N],
            geometry: [INVALID_ID; N],
            instance: [INVALID_ID; N],
            instance_primitive: [INVALID_ID; N],
        };
        Self { ray, hit }
    }
}

// Our packets are Embree's: every field stands where the C structure has it, in a place that is at
// least as large and as aligned. (`sys` compares the C side with the C compiler.)
macro_rules! same_layout {
    ($n:literal, $ray:ident, $hit:ident, $both:ident) => {
        const _: () = {
            assert!(size_of::<RayPacket<$n>>() >= size_of::<sys::$ray>());
            assert!(size_of::<RayHitPacket<$n>>() >= size_of::<sys::$both>());
            assert!(align_of::<RayPacket<$n>>() >= align_of::<sys::$both>());
            assert!(align_of::<PacketMask<$n>>() >= align_of::<sys::$both>());
            assert!(offset_of!(RayPacket<$n>, t_min) == offset_of!(sys::$ray, tnear));
            assert!(offset_of!(RayPacket<$n>, dir_x) == offset_of!(sys::$ray, dir_x));
            assert!(offset_of!(RayPacket<$n>, t_max) == offset_of!(sys::$ray, tfar));
            assert!(offset_of!(RayPacket<$n>, flags) == offset_of!(sys::$ray, flags));
            assert!(offset_of!(RayHitPacket<$n>, hit) == offset_of!(sys::$both, hit));
            assert!(offset_of!(HitPacket<$n>, u) == offset_of!(sys::$hit, u));
            assert!(offset_of!(HitPacket<$n>, primitive) == offset_of!(sys::$hit, primID));
            assert!(offset_of!(HitPacket<$n>, geometry) == offset_of!(sys::$hit, geomID));
            assert!(offset_of!(HitPacket<$n>, instance) == offset_of!(sys::$hit, instID));
            assert!(
                offset_of!(HitPacket<$n>, instance_primitive) == offset_of!(sys::$hit, instPrimID)
            );
        };
    };
}
same_layout!(4, RTCRay4, RTCHit4, RTCRayHit4);
same_layout!(8, RTCRay8, RTCHit8, RTCRayHit8);
same_layout!(16, RTCRay16, RTCHit16, RTCRayHit16);
