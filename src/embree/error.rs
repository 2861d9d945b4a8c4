//! Embree's errors, with the text that its error callback gave.

use super::sys;

/// Why a call into Embree failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EmbreeError {
    /// Embree itself reports an error.
    #[error("Embree cannot {doing}: {code}{}", if .text.is_empty() { String::new() } else { format!(" ({text})") })]
    Native {
        /// What was tried: "commit the scene".
        doing: &'static str,
        /// Embree's code.
        code: ErrorCode,
        /// Embree's own words; may be empty.
        text: String,
    },
    /// The progress callback asked for an end.
    #[error("the build was interrupted")]
    Cancelled,
    /// A buffer has not the size that Embree would read.
    #[error("{what}: expected {expected}, got {got}")]
    Size {
        /// Which buffer.
        what: &'static str,
        /// What its length must be.
        expected: String,
        /// Its length.
        got: usize,
    },
    /// A scene that holds instances cannot be instanced in turn: Debian's Embree has one level.
    #[error("a scene that holds instances cannot be instanced")]
    NestedInstances,
    /// A geometry or an instanced scene belongs to another device than its scene.
    #[error("geometry and scene belong to different Embree devices")]
    ForeignDevice,
    /// Geometry is to be hidden from some rays, which this Embree cannot.
    #[error("this Embree was built without ray masks (EMBREE_RAY_MASK)")]
    NoRayMasks,
}

/// Embree's error codes (`RTCError`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorCode(pub(super) sys::RTCError);

impl ErrorCode {
    /// Embree ran out of memory, or the memory limit of the device was reached.
    pub const OUT_OF_MEMORY: Self = Self(sys::RTC_ERROR_OUT_OF_MEMORY);
    /// An argument is wrong.
    pub const INVALID_ARGUMENT: Self = Self(sys::RTC_ERROR_INVALID_ARGUMENT);
    /// A call is not allowed for this object.
    pub const INVALID_OPERATION: Self = Self(sys::RTC_ERROR_INVALID_OPERATION);
    /// This processor is not supported.
    pub const UNSUPPORTED_CPU: Self = Self(sys::RTC_ERROR_UNSUPPORTED_CPU);
}

impl std::fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = match self.0 {
            sys::RTC_ERROR_INVALID_ARGUMENT => "invalid argument",
            sys::RTC_ERROR_INVALID_OPERATION => "invalid operation",
            sys::RTC_ERROR_OUT_OF_MEMORY => "out of memory",
            sys::RTC_ERROR_UNSUPPORTED_CPU => "unsupported processor",
            sys::RTC_ERROR_CANCELLED => "cancelled",
            sys::RTC_ERROR_UNKNOWN => "unknown error",
            code => return write!(f, "error {code}"),
        };
        f.write_str(name)
    }
}
