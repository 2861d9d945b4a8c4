//! Geometries: triangles, user shapes, instances. Each owns the memory that Embree reads through it.

use std::any::Any;
use std::ptr::NonNull;
use std::sync::Arc;

use super::copies;
use super::device::Device;
use super::error::EmbreeError;
use super::scene::Scene;
use super::sys;
use super::user::{self, UserBounds, UserGeometry};

/// How much work a build puts into its hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quality {
    /// Morton order: three to four times faster to build, up to a quarter slower to trace.
    Low,
    /// The surface area heuristic in bins.
    #[default]
    Medium,
    /// With spatial splits; has no effect in robust or compact scenes.
    High,
}

impl Quality {
    pub(super) const fn to_native(self) -> sys::RTCBuildQuality {
        match self {
            Self::Low => sys::RTC_BUILD_QUALITY_LOW,
            Self::Medium => sys::RTC_BUILD_QUALITY_MEDIUM,
            Self::High => sys::RTC_BUILD_QUALITY_HIGH,
        }
    }
}

/// An affine transform, object to world: three rows of four, row-major.
pub type Transform3x4 = [f32; 12];

/// A committed geometry, ready to be attached to one scene.
#[derive(Debug)]
pub struct Geometry {
    raw: NonNull<sys::RTCGeometryTy>,
    device: Device,
    is_instance: bool,
    /// What Embree reads through `raw`: buffers, callback context, instanced scene.
    _keep: Vec<Arc<dyn Any + Send + Sync>>,
}

// SAFETY: the native handle is only used through `&mut` or by a scene build, which Embree allows
// from any thread; what it points to is kept alive by `_keep` and is itself Send + Sync.
unsafe impl Send for Geometry {}
// SAFETY: no method changes the geometry through a shared reference.
unsafe impl Sync for Geometry {}

impl Geometry {
    /// Triangles over buffers that are shared, not copied.
    ///
    /// - `xyz`: 3 floats a vertex, and one float of padding behind the last (Embree reads 16 bytes).
    /// - `triangles`: three vertex indices each. A triangle with an index out of range or a vertex
    ///   that is not finite (or beyond 1.8·10¹⁸) is left out by Embree in silence.
    ///
    /// # Errors
    /// [`EmbreeError::Size`] where the padding is missing or there are more than 2³² − 1 items.
    pub fn triangles(
        device: &Device,
        xyz: Arc<Vec<f32>>,
        triangles: Arc<Vec<[u32; 3]>>,
        quality: Quality,
    ) -> Result<Self, EmbreeError> {
        if xyz.len() % 3 != 1 {
            let expected = "3 floats a vertex and 1 of padding".to_owned();
            return Err(EmbreeError::Size { what: "vertex buffer", expected, got: xyz.len() });
        }
        let vertices = xyz.len() / 3;
        for (what, count) in [("vertex buffer", vertices), ("triangle buffer", triangles.len())] {
            if u32::try_from(count).is_err() {
                let expected = "fewer than 2^32 items".to_owned();
                return Err(EmbreeError::Size { what, expected, got: count });
            }
        }
        let mut geometry = Self::new(device, sys::RTC_GEOMETRY_TYPE_TRIANGLE)?;
        // SAFETY: both buffers are kept by the geometry, from whose `_keep` no `&mut` is ever taken;
        // other owners of the Arcs share them with it, so nobody can move or change them. The sizes
        // are those of the vectors; the one read past the last vertex (4 bytes) falls into the padding
        // checked above. Embree itself checks indices against the vertex count.
        unsafe {
            sys::rtcSetSharedGeometryBuffer(
                geometry.raw(),
                sys::RTC_BUFFER_TYPE_VERTEX,
                0,
                sys::RTC_FORMAT_FLOAT3,
                xyz.as_ptr().cast(),
                0,
                12,
                vertices,
            );
            sys::rtcSetSharedGeometryBuffer(
                geometry.raw(),
                sys::RTC_BUFFER_TYPE_INDEX,
                0,
                sys::RTC_FORMAT_UINT3,
                triangles.as_ptr().cast(),
                0,
                12,
                triangles.len(),
            );
            sys::rtcSetGeometryBuildQuality(geometry.raw(), quality.to_native());
        }
        geometry._keep = vec![xyz, triangles];
        geometry.commit("set up a triangle mesh")
    }

    /// Embree's own spheres, over a buffer that is shared, not copied: centre and radius each, solved in
    /// f32. Not what scenes are made of, but what our own are measured against.
    ///
    /// # Errors
    /// [`EmbreeError::Size`] beyond 2³² − 1 spheres.
    pub fn sphere_points(
        device: &Device,
        spheres: Arc<Vec<[f32; 4]>>,
    ) -> Result<Self, EmbreeError> {
        if u32::try_from(spheres.len()).is_err() {
            let expected = "fewer than 2^32 items".to_owned();
            return Err(EmbreeError::Size { what: "sphere buffer", expected, got: spheres.len() });
        }
        let mut geometry = Self::new(device, sys::RTC_GEOMETRY_TYPE_SPHERE_POINT)?;
        // SAFETY: the buffer is kept by the geometry, from whose `_keep` no `&mut` is ever taken; other
        // owners of the Arc share it with it, so nobody can move or change it. An item has 16 bytes, so
        // nothing is read past the last.
        unsafe {
            sys::rtcSetSharedGeometryBuffer(
                geometry.raw(),
                sys::RTC_BUFFER_TYPE_VERTEX,
                0,
                sys::RTC_FORMAT_FLOAT4,
                spheres.as_ptr().cast(),
                0,
                16,
                spheres.len(),
            );
        }
        geometry._keep = vec![spheres];
        geometry.commit("set up sphere points")
    }

    /// Shapes that Rust intersects: one box each, and the code behind them.
    ///
    /// # Errors
    /// [`EmbreeError::Size`] beyond 2³² − 1 shapes.
    pub fn user<G: UserGeometry>(
        device: &Device,
        bounds: Vec<UserBounds>,
        shapes: Arc<G>,
    ) -> Result<Self, EmbreeError> {
        let Ok(count) = u32::try_from(bounds.len()) else {
            let expected = "fewer than 2^32 shapes".to_owned();
            return Err(EmbreeError::Size { what: "bounds", expected, got: bounds.len() });
        };
        let mut geometry = Self::new(device, sys::RTC_GEOMETRY_TYPE_USER)?;
        let context = Arc::new(user::Context { bounds, shapes });
        let pointer = Arc::as_ptr(&context).cast_mut();
        // SAFETY: the context is kept by the geometry, and the callbacks are instantiated for the
        // very type that the pointer has; they only read through it.
        unsafe {
            sys::rtcSetGeometryUserPrimitiveCount(geometry.raw(), count);
            sys::rtcSetGeometryUserData(geometry.raw(), pointer.cast());
            let bounds: sys::RTCBoundsFunction = Some(user::bounds::<G>);
            sys::rtcSetGeometryBoundsFunction(geometry.raw(), bounds, std::ptr::null_mut());
            sys::rtcSetGeometryIntersectFunction(geometry.raw(), Some(user::intersect::<G>));
            sys::rtcSetGeometryOccludedFunction(geometry.raw(), Some(user::occluded::<G>));
        }
        geometry._keep = vec![context];
        geometry.commit("set up user shapes")
    }

    /// One copy of a committed scene.
    ///
    /// # Errors
    /// [`EmbreeError::ForeignDevice`] where `scene` was made on another device,
    /// [`EmbreeError::NestedInstances`] where it holds instances itself.
    pub fn instance(
        device: &Device,
        scene: &Scene,
        world_from_object: &Transform3x4,
    ) -> Result<Self, EmbreeError> {
        let mut geometry = Self::new(device, sys::RTC_GEOMETRY_TYPE_INSTANCE)?;
        geometry.instanced_scene(scene)?;
        // SAFETY: Embree copies the 12 floats.
        unsafe {
            sys::rtcSetGeometryTransform(
                geometry.raw(),
                0,
                sys::RTC_FORMAT_FLOAT3X4_ROW_MAJOR,
                world_from_object.as_ptr().cast(),
            );
        }
        geometry.commit("set up an instance")
    }

    /// Many copies of a committed scene as one geometry, over transforms that are shared, not copied:
    /// a quarter of the memory of single instances, and a little slower to trace.
    ///
    /// # Errors
    /// As [`Geometry::instance`], and [`EmbreeError::Size`] beyond 2³² − 1 copies.
    pub fn instance_array(
        device: &Device,
        scene: &Scene,
        world_from_object: Arc<Vec<Transform3x4>>,
    ) -> Result<Self, EmbreeError> {
        if u32::try_from(world_from_object.len()).is_err() {
            let (what, expected) = ("transforms", "fewer than 2^32 copies".to_owned());
            return Err(EmbreeError::Size { what, expected, got: world_from_object.len() });
        }
        let mut geometry = Self::new(device, sys::RTC_GEOMETRY_TYPE_INSTANCE_ARRAY)?;
        geometry.instanced_scene(scene)?;
        // SAFETY: the transforms are kept by the geometry and cannot change; a row is one 16-byte
        // load, so nothing is read past the last.
        unsafe {
            sys::rtcSetSharedGeometryBuffer(
                geometry.raw(),
                sys::RTC_BUFFER_TYPE_TRANSFORM,
                0,
                sys::RTC_FORMAT_FLOAT3X4_ROW_MAJOR,
                world_from_object.as_ptr().cast(),
                0,
                48,
                world_from_object.len(),
            );
        }
        geometry._keep.push(world_from_object);
        geometry.commit("set up an instance array")
    }

    /// Many copies of a committed scene as one geometry, each in a box of its own: hits name the copy as
    /// those of an instance array do.
    ///
    /// - `object_from_world`: the inverse of each copy's transform.
    /// - `bounds`: a box around each copy, in the world.
    ///
    /// # Errors
    /// As [`Geometry::instance`], and [`EmbreeError::Size`] where the lists differ in length or hold more
    /// than 2³² − 1 copies.
    pub fn copies(
        device: &Device,
        scene: &Scene,
        object_from_world: Vec<Transform3x4>,
        bounds: Vec<UserBounds>,
    ) -> Result<Self, EmbreeError> {
        let count = u32::try_from(bounds.len()).ok();
        let Some(count) = count.filter(|_| object_from_world.len() == bounds.len()) else {
            let expected = "as many boxes, fewer than 2^32".to_owned();
            let got = object_from_world.len();
            return Err(EmbreeError::Size { what: "transforms", expected, got });
        };
        let mut geometry = Self::new(device, sys::RTC_GEOMETRY_TYPE_USER)?;
        geometry.check_prototype(scene)?;
        let transforms = object_from_world;
        let context = Arc::new(copies::Copies { prototype: scene.clone(), transforms, bounds });
        let pointer = Arc::as_ptr(&context).cast_mut();
        // SAFETY: the context, with the prototype in it, is kept by the geometry; the callbacks are those
        // for what the pointer points to, and only read through it.
        unsafe {
            sys::rtcSetGeometryUserPrimitiveCount(geometry.raw(), count);
            sys::rtcSetGeometryUserData(geometry.raw(), pointer.cast());
            let bounds: sys::RTCBoundsFunction = Some(copies::bounds);
            sys::rtcSetGeometryBoundsFunction(geometry.raw(), bounds, std::ptr::null_mut());
            sys::rtcSetGeometryIntersectFunction(geometry.raw(), Some(copies::intersect));
            sys::rtcSetGeometryOccludedFunction(geometry.raw(), Some(copies::occluded));
        }
        geometry._keep = vec![context];
        geometry.is_instance = true;
        geometry.commit("set up copies")
    }

    /// The same, seen only by rays whose mask has a bit in common with `mask`. Without this the mask of
    /// a geometry is 1.
    ///
    /// # Errors
    /// [`EmbreeError::NoRayMasks`] where Embree was built without them.
    pub fn masked(self, mask: u32) -> Result<Self, EmbreeError> {
        if !self.device.has_ray_masks() {
            return Err(EmbreeError::NoRayMasks);
        }
        // SAFETY: the geometry is live and ours alone.
        unsafe { sys::rtcSetGeometryMask(self.raw(), mask) };
        self.commit("set the mask of a geometry")
    }

    fn check_prototype(&self, scene: &Scene) -> Result<(), EmbreeError> {
        if !scene.device().is(&self.device) {
            return Err(EmbreeError::ForeignDevice);
        }
        if scene.has_instances() {
            return Err(EmbreeError::NestedInstances);
        }
        Ok(())
    }

    fn instanced_scene(&mut self, scene: &Scene) -> Result<(), EmbreeError> {
        self.check_prototype(scene)?;
        // SAFETY: both handles are live. Embree counts a reference to the scene; we keep the scene's
        // own buffers as well.
        unsafe { sys::rtcSetGeometryInstancedScene(self.raw(), scene.raw()) };
        self._keep.push(Arc::new(scene.clone()));
        self.is_instance = true;
        Ok(())
    }

    fn new(device: &Device, kind: sys::RTCGeometryType) -> Result<Self, EmbreeError> {
        // SAFETY: the device is live.
        let raw = unsafe { sys::rtcNewGeometry(device.raw(), kind) };
        match NonNull::new(raw) {
            // Owned from here on, so that no error path leaks.
            Some(raw) => {
                Ok(Self { raw, device: device.clone(), is_instance: false, _keep: Vec::new() })
            }
            None => Err(device.check("make a geometry").err().unwrap_or(EmbreeError::Native {
                doing: "make a geometry",
                code: super::ErrorCode(sys::RTC_ERROR_UNKNOWN),
                text: String::new(),
            })),
        }
    }

    fn commit(self, doing: &'static str) -> Result<Self, EmbreeError> {
        // SAFETY: the geometry is live and ours alone.
        unsafe { sys::rtcCommitGeometry(self.raw()) };
        self.device.check(doing)?;
        Ok(self)
    }

    pub(super) fn raw(&self) -> sys::RTCGeometry {
        self.raw.as_ptr()
    }

    pub(super) const fn is_instance(&self) -> bool {
        self.is_instance
    }

    pub(super) fn device(&self) -> &Device {
        &self.device
    }
}

impl Drop for Geometry {
    fn drop(&mut self) {
        // SAFETY: our own reference, released once. A scene that holds the geometry has its own, and
        // owns this wrapper as well, so `_keep` outlives every use.
        unsafe { sys::rtcReleaseGeometry(self.raw.as_ptr()) };
    }
}
