//! Scenes: what a person wrote ([`SceneDesc`], plain data from any file format), and what is made of
//! it ([`Scene`], checked, recentred, built, immutable).
//!
//! It owns the way from names to indices, from degrees to matrices, from a hit to the point of the
//! surface it means. It has no file formats and opens no file: tests build a [`SceneDesc`] in a few
//! lines. It does not know how light travels.

mod build;
mod coverage;
mod desc;
mod draft;
mod hollow;
mod lights;
mod maps;
mod media;
mod place;
mod requirements;
mod scatter;
mod solids;
mod surface;
mod surface_block;
mod tessellate;
mod volumes;

pub use build::{Scene, SceneError, UnknownName};
pub use desc::{
    CameraDesc, Epsilon, FreeformDesc, ImageDesc, IntegratorKind, LensDesc, LightDesc, Location,
    MaterialDesc, ObjectDesc, PlaceDesc, PrototypeDesc, Reference, RenderSettings, SceneDesc,
    Shadows, ShapeDesc, Tolerance,
};
pub use hollow::{FarSide, Hollows};
pub use maps::{Cone, Maps};
pub use media::Crossing;
pub use requirements::{Requirements, Variant};
pub use scatter::{Scatter, Turn};
pub use surface::SurfacePoint;
pub use surface_block::SurfaceBlock;
pub use tessellate::Tessellation;
pub use volumes::VolumeDesc;
