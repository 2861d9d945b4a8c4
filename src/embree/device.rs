//! The device: Embree's threads, its settings, its errors and its memory count.

use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr::{NonNull, null};
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::ThreadId;

use super::error::{EmbreeError, ErrorCode};
use super::sys;

/// What a device is made with.
#[derive(Debug, Clone, Default)]
pub struct DeviceConfig {
    /// Threads that build hierarchies; all of them where not given.
    pub threads: Option<usize>,
    /// The instruction set to use at most; the widest that processor and library share where not given.
    pub isa: Option<Isa>,
    /// Bytes that Embree may hold; a build that needs more fails with [`ErrorCode::OUT_OF_MEMORY`].
    pub memory_limit: Option<u64>,
}

/// The instruction sets that Debian's Embree is built for. Hits may differ in their last bits
/// between them, so a picture records which one it was made with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Isa {
    /// 4-wide, the floor of x86-64.
    Sse2,
    /// 4-wide.
    Sse42,
    /// 8-wide floats, 4-wide integers.
    Avx,
    /// 8-wide, with fused multiply-add.
    Avx2,
    /// 16-wide.
    Avx512,
}

impl Isa {
    /// The name that Embree's configuration uses.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sse2 => "sse2",
            Self::Sse42 => "sse4.2",
            Self::Avx => "avx",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

/// What Embree holds, as it reports to the memory monitor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryUse {
    /// Bytes held now.
    pub current: u64,
    /// The most that was held at once.
    pub peak: u64,
}

/// An Embree device. Clones share it; keep one for the whole process, as several compete for threads.
#[derive(Clone, Debug)]
pub struct Device(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    raw: NonNull<sys::RTCDeviceTy>,
    isa: Option<Isa>,
    /// Boxed: the callbacks hold its address.
    monitor: Box<Monitor>,
}

// SAFETY: Embree's device functions may be called from any thread (manual, "Thread safety"); the
// monitor that the callbacks write is made of atomics and a mutex.
unsafe impl Send for Inner {}
// SAFETY: as above.
unsafe impl Sync for Inner {}

#[derive(Debug, Default)]
struct Monitor {
    /// Errors not yet asked for, with the thread whose call raised them.
    errors: Mutex<Vec<(ThreadId, ErrorCode, String)>>,
    bytes: AtomicI64,
    peak: AtomicI64,
    limit: Option<i64>,
}

impl Device {
    /// Makes a device.
    ///
    /// # Errors
    /// [`EmbreeError::Native`] where Embree refuses the configuration or the processor.
    pub fn new(config: &DeviceConfig) -> Result<Self, EmbreeError> {
        let mut text = String::from("verbose=0");
        if let Some(threads) = config.threads {
            text += &format!(",threads={threads}");
        }
        if let Some(isa) = config.isa {
            text += &format!(",isa={}", isa.name());
        }
        Self::with_text(&text, config)
    }

    fn with_text(text: &str, config: &DeviceConfig) -> Result<Self, EmbreeError> {
        let text = CString::new(text).expect("the configuration holds no NUL");
        // SAFETY: `text` is NUL-terminated and lives through the call.
        let raw = unsafe { sys::rtcNewDevice(text.as_ptr()) };
        let Some(raw) = NonNull::new(raw) else {
            // SAFETY: without a device the call returns the error of this thread's last rtcNewDevice.
            let code = unsafe { sys::rtcGetDeviceError(std::ptr::null_mut()) };
            let text = text.to_string_lossy().into_owned();
            return Err(EmbreeError::Native {
                doing: "make a device",
                code: ErrorCode(code),
                text,
            });
        };
        let limit = config.memory_limit.map(|n| i64::try_from(n).unwrap_or(i64::MAX));
        let inner = Inner {
            raw,
            isa: config.isa,
            monitor: Box::new(Monitor { limit, ..Monitor::default() }),
        };
        let monitor: *const Monitor = &*inner.monitor;
        // SAFETY: the monitor is boxed in `inner`, whose drop unregisters both callbacks before it
        // frees the box; the callbacks only read it through a shared reference.
        unsafe {
            sys::rtcSetDeviceErrorFunction(raw.as_ptr(), Some(on_error), monitor.cast_mut().cast());
            sys::rtcSetDeviceMemoryMonitorFunction(
                raw.as_ptr(),
                Some(on_memory),
                monitor.cast_mut().cast(),
            );
        }
        let device = Self(Arc::new(inner));
        device.check("set up the device")?;
        Ok(device)
    }

    /// Embree's version, as in "4.3.3".
    pub fn version(&self) -> String {
        let [major, minor, patch] = [
            sys::RTC_DEVICE_PROPERTY_VERSION_MAJOR,
            sys::RTC_DEVICE_PROPERTY_VERSION_MINOR,
            sys::RTC_DEVICE_PROPERTY_VERSION_PATCH,
        ]
        .map(|property| self.property(property));
        format!("{major}.{minor}.{patch}")
    }

    /// The widest packet that this processor traces as a packet: 16, 8, 4, or 1 where none is.
    /// A wider one would be taken apart into single rays.
    pub fn packet_width(&self) -> usize {
        [
            (16, sys::RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED),
            (8, sys::RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED),
            (4, sys::RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED),
        ]
        .into_iter()
        .find(|&(_, property)| self.property(property) != 0)
        .map_or(1, |(width, _)| width)
    }

    /// Whether rays may be masked from geometry.
    pub(super) fn has_ray_masks(&self) -> bool {
        self.property(sys::RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) != 0
    }

    /// The instruction set that queries run with. Embree has no property for it: it follows from the
    /// native packet width, the processor and the configuration.
    pub fn isa(&self) -> Isa {
        let at_most = self.0.isa.unwrap_or(Isa::Avx512);
        #[cfg(target_arch = "x86_64")]
        let (avx2, sse42) = (is_x86_feature_detected!("avx2"), is_x86_feature_detected!("sse4.2"));
        // Elsewhere Embree maps its SSE4.2 and AVX2 paths onto the processor's own vectors.
        #[cfg(not(target_arch = "x86_64"))]
        let (avx2, sse42) = (true, true);
        let widest = match self.packet_width() {
            16 => Isa::Avx512,
            8 if avx2 => Isa::Avx2,
            8 => Isa::Avx,
            _ if sse42 => Isa::Sse42,
            _ => Isa::Sse2,
        };
        widest.min(at_most)
    }

    /// Bytes that Embree holds and held at most.
    pub fn memory(&self) -> MemoryUse {
        let monitor = &self.0.monitor;
        let read = |counter: &AtomicI64| counter.load(Ordering::Relaxed).max(0).unsigned_abs();
        MemoryUse { current: read(&monitor.bytes), peak: read(&monitor.peak) }
    }

    fn property(&self, property: sys::RTCDeviceProperty) -> isize {
        // SAFETY: the device is live, the property one of the header's.
        unsafe { sys::rtcGetDeviceProperty(self.raw(), property) }
    }

    pub(super) fn raw(&self) -> sys::RTCDevice {
        self.0.raw.as_ptr()
    }

    pub(super) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Returns the first error that this thread's calls raised since it last asked.
    pub(super) fn check(&self, doing: &'static str) -> Result<(), EmbreeError> {
        // Clears the code that Embree keeps beside what the callback was told.
        // SAFETY: the device is live.
        let code = unsafe { sys::rtcGetDeviceError(self.raw()) };
        let me = std::thread::current().id();
        let mut first = None;
        let mut errors = self.0.monitor.errors.lock().unwrap_or_else(PoisonError::into_inner);
        errors.retain(|(thread, code, text)| {
            if *thread == me && first.is_none() {
                first = Some((*code, text.clone()));
            }
            *thread != me
        });
        drop(errors);
        match first {
            Some((ErrorCode(sys::RTC_ERROR_CANCELLED), _)) => Err(EmbreeError::Cancelled),
            Some((code, text)) => Err(EmbreeError::Native { doing, code, text }),
            None if code == sys::RTC_ERROR_CANCELLED => Err(EmbreeError::Cancelled),
            None if code != sys::RTC_ERROR_NONE => {
                Err(EmbreeError::Native { doing, code: ErrorCode(code), text: String::new() })
            }
            None => Ok(()),
        }
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        // SAFETY: `raw` is live and this is our only reference. Every scene and geometry of ours holds
        // a `Device`, so none is left and no callback can be running; they are taken off all the same
        // before the monitor that they point to is freed.
        unsafe {
            sys::rtcSetDeviceErrorFunction(self.raw.as_ptr(), None, std::ptr::null_mut());
            sys::rtcSetDeviceMemoryMonitorFunction(self.raw.as_ptr(), None, std::ptr::null_mut());
            sys::rtcReleaseDevice(self.raw.as_ptr());
        }
    }
}

/// Called by Embree on the thread whose call failed.
unsafe extern "C" fn on_error(user: *mut c_void, code: sys::RTCError, text: *const c_char) {
    if user == null::<c_void>().cast_mut() {
        return;
    }
    // SAFETY: `user` is the Monitor boxed in `Inner`, which unregisters this function before it ends.
    let monitor = unsafe { &*user.cast::<Monitor>() };
    let text = if text.is_null() {
        String::new()
    } else {
        // SAFETY: Embree passes a NUL-terminated string that is valid for this call.
        unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
    };
    let error = (std::thread::current().id(), ErrorCode(code), text);
    monitor.errors.lock().unwrap_or_else(PoisonError::into_inner).push(error);
}

/// Called by Embree before it allocates and after it frees, perhaps from several build tasks at once.
unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, post: bool) -> bool {
    if user == null::<c_void>().cast_mut() {
        return true;
    }
    // SAFETY: as in `on_error`.
    let monitor = unsafe { &*user.cast::<Monitor>() };
    let now = monitor.bytes.fetch_add(bytes as i64, Ordering::Relaxed) + bytes as i64;
    // What is already allocated (`post`) can only be counted.
    if !post && bytes > 0 && monitor.limit.is_some_and(|limit| now > limit) {
        monitor.bytes.fetch_sub(bytes as i64, Ordering::Relaxed);
        return false;
    }
    monitor.peak.fetch_max(now, Ordering::Relaxed);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_configuration_is_an_error() {
        let error = Device::with_text("threads=,isa=avx1024", &DeviceConfig::default());
        match error {
            Err(EmbreeError::Native { doing: "make a device", text, .. }) => {
                assert!(text.contains("avx1024"), "{text}");
            }
            other => panic!("accepted: {other:?}"),
        }
    }

    #[test]
    fn version_and_width_are_known() {
        let device = Device::new(&DeviceConfig::default()).unwrap();
        assert!(device.version().starts_with("4."), "{}", device.version());
        assert!([4, 8, 16].contains(&device.packet_width()));
    }

    #[test]
    fn the_instruction_set_can_be_pinned() {
        let config = DeviceConfig { isa: Some(Isa::Sse42), ..DeviceConfig::default() };
        let device = Device::new(&config).unwrap();
        assert_eq!((device.isa(), device.packet_width()), (Isa::Sse42, 4));
    }

    #[test]
    fn an_error_reaches_the_thread_that_caused_it() {
        let device = Device::new(&DeviceConfig::default()).unwrap();
        // SAFETY: a null scene is an error that Embree catches and reports.
        unsafe { sys::rtcCommitScene(std::ptr::null_mut()) };
        // SAFETY: 99999 is no geometry type; Embree reports it and returns null.
        let raw = unsafe { sys::rtcNewGeometry(device.raw(), 99_999) };
        assert!(raw.is_null());
        let other = device.clone();
        std::thread::spawn(move || other.check("do nothing").unwrap()).join().unwrap();
        assert!(matches!(
            device.check("make a geometry"),
            Err(EmbreeError::Native { code: ErrorCode(_), .. })
        ));
        device.check("ask again").unwrap();
    }
}
