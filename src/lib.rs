//! Alhazen renders scenes and bare meshes to HDR EXR on Embree 4: fast, with a known error.
//!
//! The program is `alhazen` (see `alhazen --help` and the README); this is the library it is made of.
//!
//! ```
//! use alhazen::accel::AccelKind;
//! use alhazen::render::{RenderJob, render};
//! use alhazen::scene::{ObjectDesc, Scene, SceneDesc, ShapeDesc};
//! use glam::DVec3;
//!
//! // A sphere, framed and lit by itself.
//! let sphere = ShapeDesc::Sphere { center: DVec3::ZERO, radius: 1.0 };
//! let mut desc = SceneDesc { objects: vec![ObjectDesc::new(sphere, None)], ..SceneDesc::default() };
//! desc.image.size = [64, 64];
//! let scene = Scene::build_quietly(desc, AccelKind::default()).expect("a sound scene");
//! let film = render(&scene, &RenderJob::default(), &()).film;
//! assert!(film.pixel(32, 32).unwrap().luminance() > 0.2);
//! ```
//!
//! # Rooms
//! From the top; imports point down only, and rooms on one line do not know each other.
//!
//! | room | what it owns |
//! |---|---|
//! | [`cli`] | flags as typed, then what they mean together; progress, reports, exit codes |
//! | [`measure`] | how far a picture is from a reference: error metrics and FLIP |
//! | [`render`] · [`io`] | tiles, threads and stopping · files: scenes, meshes and pictures in, pictures out |
//! | [`integrator`] | one file per algorithm: rays in, radiance out |
//! | [`scene`] | what was written, and the immutable, query-ready scene made of it |
//! | [`accel`] · [`light`] · [`material`] · [`medium`] · [`camera`] | the seam for ray queries · emission · scattering · fog and nested glass · viewing rays |
//! | `embree` · [`geometry`] · [`film`] · [`sampler`] · [`texture`] | native handles · meshes and shapes · sums and filters · numbers in [0, 1) · what varies over a surface |
//! | [`math`] · [`color`] | the floor: rays, boxes, rounding · linear Rec.709 and sRGB |
//!
//! Units are metres, radians and seconds; radiance is in W·m⁻²·sr⁻¹ per Rec.709 band; space is
//! right-handed with +Y up. ARCHITECTURE.md tells why things are as they are.

pub mod accel;
pub mod camera;
pub mod cli;
pub mod color;
#[cfg(feature = "embree")]
pub mod embree;
pub mod film;
pub mod geometry;
pub mod integrator;
pub mod io;
pub mod light;
pub mod material;
pub mod math;
pub mod measure;
pub mod medium;
#[path = "embree/pages.rs"]
mod pages;
pub mod render;
pub mod sampler;
pub mod scene;
pub mod texture;
