//! Scenes: built by a [`SceneBuilder`], then immutable and traced from any number of threads.

use std::ffi::c_void;
use std::ops::BitOr;
use std::ptr::{NonNull, null_mut};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::device::Device;
use super::error::{EmbreeError, ErrorCode};
use super::geometry::{Geometry, Quality};
use super::query::{Coherence, Hit, PacketMask, Ray, RayHitPacket, RayPacket};
use super::user::UserBounds;
use super::{INVALID_ID, sys};

/// How a scene is built and traced (`RTCSceneFlags`); combine with `|`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SceneFlags(sys::RTCSceneFlags);

impl SceneFlags {
    /// Embree's defaults: fastest single rays, some rays lost at edges and far from the origin.
    pub const NONE: Self = Self(sys::RTC_SCENE_FLAG_NONE);
    /// Watertight at edges, accurate far from the origin.
    pub const ROBUST: Self = Self(sys::RTC_SCENE_FLAG_ROBUST);
    /// Half the memory, a third slower to trace.
    pub const COMPACT: Self = Self(sys::RTC_SCENE_FLAG_COMPACT);
}

impl BitOr for SceneFlags {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// A scene that is still being put together.
#[derive(Debug)]
pub struct SceneBuilder {
    scene: Inner,
}

#[derive(Debug)]
struct Inner {
    raw: NonNull<sys::RTCSceneTy>,
    geometries: Vec<Geometry>,
    device: Device,
}

/// A committed scene. Clones share it.
#[derive(Debug, Clone)]
pub struct Scene(Arc<Inner>);

// SAFETY: the handle may be used from any thread (manual, "Thread safety"); what its geometries
// point to is Send + Sync.
unsafe impl Send for Inner {}
// SAFETY: queries on a committed scene may run concurrently, and through a shared reference only
// `Scene` reaches `Inner`, which has no method that modifies it; `SceneBuilder` modifies it by `&mut`.
unsafe impl Sync for Inner {}

impl SceneBuilder {
    /// An empty scene.
    ///
    /// # Errors
    /// [`EmbreeError::Native`] where Embree cannot make one.
    pub fn new(device: &Device, flags: SceneFlags, quality: Quality) -> Result<Self, EmbreeError> {
        // SAFETY: the device is live.
        let raw = unsafe { sys::rtcNewScene(device.raw()) };
        let Some(raw) = NonNull::new(raw) else {
            return Err(device.check("make a scene").err().unwrap_or(EmbreeError::Native {
                doing: "make a scene",
                code: ErrorCode(sys::RTC_ERROR_UNKNOWN),
                text: String::new(),
            }));
        };
        let scene = Inner { raw, geometries: Vec::new(), device: device.clone() };
        // SAFETY: the scene is live and ours alone.
        unsafe {
            sys::rtcSetSceneFlags(scene.raw.as_ptr(), flags.0);
            sys::rtcSetSceneBuildQuality(scene.raw.as_ptr(), quality.to_native());
        }
        device.check("set up a scene")?;
        Ok(Self { scene })
    }

    /// Adds a geometry and returns its id: 0, 1, 2 … in the order of the calls.
    ///
    /// # Panics
    /// If the geometry was made on another device.
    pub fn attach(&mut self, geometry: Geometry) -> u32 {
        assert!(geometry.device().is(&self.scene.device), "{}", EmbreeError::ForeignDevice);
        // SAFETY: both handles are live; Embree takes a reference of its own.
        let id = unsafe { sys::rtcAttachGeometry(self.scene.raw.as_ptr(), geometry.raw()) };
        self.scene.geometries.push(geometry);
        id
    }

    /// Builds the hierarchy. By value: after this nothing can be attached.
    ///
    /// # Errors
    /// [`EmbreeError::Native`], as when memory runs out.
    pub fn commit(self) -> Result<Scene, EmbreeError> {
        // SAFETY: the scene is live; `self` is owned, so no query can overlap the commit.
        unsafe { sys::rtcCommitScene(self.scene.raw.as_ptr()) };
        self.scene.device.check("build the hierarchy")?; // an early return drops, hence releases, the scene
        Ok(Scene(Arc::new(self.scene)))
    }

    /// As [`SceneBuilder::commit`], telling `progress` how far it is, and ending when that says so.
    ///
    /// # Errors
    /// [`EmbreeError::Cancelled`] where it was asked to stop, else as [`SceneBuilder::commit`].
    pub fn commit_with(self, progress: &BuildProgress) -> Result<Scene, EmbreeError> {
        let user = std::ptr::from_ref(progress).cast_mut().cast();
        let raw = self.scene.raw.as_ptr();
        // SAFETY: the scene is live; the callback only reads `progress`, which is made of atomics and
        // borrowed until the callback is taken off again below.
        unsafe { sys::rtcSetSceneProgressMonitorFunction(raw, Some(on_progress), user) };
        // SAFETY: as in `commit`. A build that is cancelled leaves the scene uncommitted, which may
        // be released like any other.
        unsafe { sys::rtcCommitScene(raw) };
        // SAFETY: the scene is live.
        unsafe { sys::rtcSetSceneProgressMonitorFunction(raw, None, null_mut()) };
        self.scene.device.check("build the hierarchy")?;
        Ok(Scene(Arc::new(self.scene)))
    }
}

/// How far a build is, and whether it should end; to be watched from another thread.
///
/// Not a closure: Embree calls back from its build threads with denormals flushed to zero, where
/// Rust's arithmetic is not what it says, so nothing runs there but a store and a load.
#[derive(Debug, Default)]
pub struct BuildProgress {
    /// From 0 to 1, as the bits of an f64.
    done: AtomicU64,
    stop: AtomicBool,
}

impl BuildProgress {
    /// The share that is done, from 0 to 1.
    pub fn done(&self) -> f64 {
        f64::from_bits(self.done.load(Ordering::Relaxed))
    }

    /// Asks the build to end.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Called by Embree during a build, perhaps on several threads at once.
unsafe extern "C" fn on_progress(user: *mut c_void, done: f64) -> bool {
    // SAFETY: `user` is the `&BuildProgress` of `commit_with`, which outlives the commit.
    let progress = unsafe { &*user.cast::<BuildProgress>() };
    progress.done.store(done.to_bits(), Ordering::Relaxed);
    !progress.stop.load(Ordering::Relaxed)
}

impl Scene {
    /// The closest hit of one ray.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut both = sys::RTCRayHit {
            ray: ray.to_native(),
            hit: sys::RTCHit {
                Ng_x: 0.0,
                Ng_y: 0.0,
                Ng_z: 0.0,
                u: 0.0,
                v: 0.0,
                primID: INVALID_ID,
                geomID: INVALID_ID,
                instID: [INVALID_ID],
                instPrimID: [INVALID_ID],
            },
        };
        // SAFETY: the scene is committed; `both` is aligned (checked in `sys`) and ours.
        unsafe { sys::rtcIntersect1(self.raw(), &raw mut both, null_mut()) };
        Hit::from_native(both.ray.tfar, &both.hit)
    }

    /// Whether anything blocks one ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_by(ray, !0)
    }

    /// Whether anything whose mask has a bit in common with `mask` blocks one ray.
    #[inline]
    pub fn occluded_by(&self, ray: &Ray, mask: u32) -> bool {
        let mut native = sys::RTCRay { mask, ..ray.to_native() };
        // SAFETY: as in `intersect`.
        unsafe { sys::rtcOccluded1(self.raw(), &raw mut native, null_mut()) };
        native.tfar == f32::NEG_INFINITY
    }

    /// The closest hits of the lanes in `mask`, of 4, 8 or 16 rays. Worth it at the native width for rays
    /// that run close together, and for nothing else: rays that spread are two to three times slower than
    /// one by one.
    #[inline]
    pub fn intersect_packet<const N: usize>(
        &self,
        mask: &PacketMask<N>,
        packet: &mut RayHitPacket<N>,
        coherence: Coherence,
    ) {
        const { assert!(N == 4 || N == 8 || N == 16, "Embree has packets of 4, 8 and 16") };
        let mut args = sys::RTCIntersectArguments {
            flags: coherence.flags(),
            feature_mask: sys::RTC_FEATURE_FLAG_ALL,
            context: null_mut(),
            filter: None,
            intersect: None,
        };
        let (valid, raw, args) = (mask.0.as_ptr(), self.raw(), &raw mut args);
        let packet = std::ptr::from_mut(packet);
        // SAFETY: the scene is committed; mask and packet have the layout and alignment of the C
        // structures of width N (asserted in `query`), and the packet is exclusively ours.
        unsafe {
            match N {
                4 => sys::rtcIntersect4(valid, raw, packet.cast(), args),
                8 => sys::rtcIntersect8(valid, raw, packet.cast(), args),
                _ => sys::rtcIntersect16(valid, raw, packet.cast(), args),
            }
        }
    }

    /// Whether anything blocks the lanes in `mask`; see [`RayPacket::is_occluded`].
    #[inline]
    pub fn occluded_packet<const N: usize>(
        &self,
        mask: &PacketMask<N>,
        packet: &mut RayPacket<N>,
        coherence: Coherence,
    ) {
        const { assert!(N == 4 || N == 8 || N == 16, "Embree has packets of 4, 8 and 16") };
        let mut args = sys::RTCOccludedArguments {
            flags: coherence.flags(),
            feature_mask: sys::RTC_FEATURE_FLAG_ALL,
            context: null_mut(),
            filter: None,
            occluded: None,
        };
        let (valid, raw, args) = (mask.0.as_ptr(), self.raw(), &raw mut args);
        let packet = std::ptr::from_mut(packet);
        // SAFETY: as in `intersect_packet`.
        unsafe {
            match N {
                4 => sys::rtcOccluded4(valid, raw, packet.cast(), args),
                8 => sys::rtcOccluded8(valid, raw, packet.cast(), args),
                _ => sys::rtcOccluded16(valid, raw, packet.cast(), args),
            }
        }
    }

    /// The box around everything; least above greatest where there is nothing.
    pub fn bounds(&self) -> UserBounds {
        let mut b = sys::RTCBounds {
            lower_x: 0.0,
            lower_y: 0.0,
            lower_z: 0.0,
            align0: 0.0,
            upper_x: 0.0,
            upper_y: 0.0,
            upper_z: 0.0,
            align1: 0.0,
        };
        // SAFETY: the scene is committed, and `b` has the layout and alignment of the C structure.
        unsafe { sys::rtcGetSceneBounds(self.raw(), &raw mut b) };
        UserBounds {
            lower: [b.lower_x, b.lower_y, b.lower_z],
            upper: [b.upper_x, b.upper_y, b.upper_z],
        }
    }

    pub(super) fn has_instances(&self) -> bool {
        self.0.geometries.iter().any(Geometry::is_instance)
    }

    /// The device that the scene was made on.
    pub fn device(&self) -> &Device {
        &self.0.device
    }

    pub(super) fn raw(&self) -> sys::RTCScene {
        self.0.raw.as_ptr()
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        // SAFETY: our own reference, released once; the geometries (and the buffers they keep) are
        // dropped after this, as fields are.
        unsafe { sys::rtcReleaseScene(self.raw.as_ptr()) };
    }
}
