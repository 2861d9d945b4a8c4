//! Safe owners of Embree's native handles: the only room with C in it.
//!
//! It owns the device, geometries and scenes of Embree 4, the memory that they share with us, and
//! the queries for one ray and for packets of 4, 8 and 16. It knows floats and ids; what a geometry
//! is made of, what a hit means and which query suits which ray is [`crate::accel`]'s to know.
//!
//! Invariants:
//! - Embree counts references. Every wrapper owns one reference and the memory that Embree reads
//!   through it, so a wrapper may be dropped in any order and there is no lifetime to thread through.
//! - State is in types: [`SceneBuilder::commit`] consumes the builder and yields a [`Scene`] that
//!   has no method to modify it, so it may be traced from any number of threads.
//! - What the manual says in prose (padding, alignment, packet masks) is a type or a check here.
//!
//! The bindings come from the headers that are installed (`build.rs`), not from the crate
//! `embree4-sys`: that carries Embree 4.2's headers, whose `RTCRayHit` is 80 bytes, where Debian's
//! 4.3.3 (built with instance arrays) writes 96. A test compares our layout with C's own.
//!
//! ```
//! # use std::sync::Arc;
//! use alhazen::embree::{Device, DeviceConfig, Geometry, Quality, Ray, SceneBuilder, SceneFlags};
//!
//! # fn main() -> Result<(), alhazen::embree::EmbreeError> {
//! let device = Device::new(&DeviceConfig::default())?;
//! let xyz = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, /* padding */ 0.0];
//! let triangle =
//!     Geometry::triangles(&device, Arc::new(xyz), Arc::new(vec![[0, 1, 2]]), Quality::Medium)?;
//! let mut builder = SceneBuilder::new(&device, SceneFlags::ROBUST, Quality::Medium)?;
//! builder.attach(triangle);
//! let scene = builder.commit()?;
//! let hit = scene.intersect(&Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0])).unwrap();
//! assert!((hit.t - 1.0).abs() < 1e-6);
//! # Ok(())
//! # }
//! ```
//!
//! A scene that is being traced cannot be modified; this does not compile:
//! ```compile_fail,E0382
//! # use std::sync::Arc;
//! # use alhazen::embree::{Device, DeviceConfig, Geometry, Quality, SceneBuilder, SceneFlags};
//! # fn main() -> Result<(), alhazen::embree::EmbreeError> {
//! # let device = Device::new(&DeviceConfig::default())?;
//! # let xyz = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
//! # let triangle = Geometry::triangles(&device, Arc::new(xyz), Arc::new(vec![[0, 1, 2]]), Quality::Medium)?;
//! let mut builder = SceneBuilder::new(&device, SceneFlags::ROBUST, Quality::Medium)?;
//! let scene = builder.commit()?;
//! builder.attach(triangle); // `commit` took the builder
//! # Ok(())
//! # }
//! ```
#![expect(unsafe_code, reason = "the one room that calls C")]

mod copies;
mod device;
mod error;
mod geometry;
mod query;
mod scene;
mod sys;
mod user;

pub use device::{Device, DeviceConfig, Isa, MemoryUse};
pub use error::{EmbreeError, ErrorCode};
pub use geometry::{Geometry, Quality, Transform3x4};
pub use query::{Coherence, Hit, HitPacket, PacketMask, Ray, RayHitPacket, RayPacket};
pub use scene::{BuildProgress, Scene, SceneBuilder, SceneFlags};
pub use user::{UserBounds, UserGeometry, UserHit};

/// The id that Embree returns where there is no geometry or instance.
pub const INVALID_ID: u32 = u32::MAX;
