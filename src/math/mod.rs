//! The floor of the house: rays, boxes, affine transforms and rounding bounds. Only `glam` and `std`.
//!
//! Conventions, here and everywhere: right-handed, +Y up, cameras look along −Z; column vectors,
//! `world_from_object * p`; metres and radians. f32 for rays inside the scene, f64 for what makes
//! them. Nothing here knows what is hit or how it looks.

mod bounds;
mod lanes;
pub(crate) mod noise;
mod quartic;
mod ray;
mod rounding;
mod warp;

pub use bounds::Bounds;
pub(crate) use lanes::lanes_where;
pub use lanes::{Vec3Lanes, unit_or_zero};
pub use quartic::Quartic;
pub use ray::Ray;
pub use rounding::{gamma, offset_ray_origin};
pub use warp::{concentric_disk, cosine_hemisphere};
