//! Files: scenes, meshes and pictures in, pictures out. One file per format and direction.
//!
//! It turns whatever a person wrote into a [`crate::scene::SceneDesc`], reading every file that a
//! scene names, and writes a finished [`crate::film::Film`]; what it wrote it reads back as a
//! [`crate::film::Picture`]. It never sees an integrator, and prints
//! nothing: what should be told comes back as data.
//!
//! Numbers from files are suspects: nothing is allocated in proportion to a number that a file merely
//! claims. A file that is written appears whole under its name, or not at all.

mod bpt;
mod distinct;
mod document;
mod error;
mod exr;
mod exr_read;
mod fields;
mod grid;
mod image;
mod layers;
mod memory;
mod mesh;
mod mesh_write;
mod mistakes;
mod obj;
mod output;
mod picture;
mod ply;
mod png;
mod polygon;
mod radiance;
mod scene_file;
mod scene_toml;
mod source;
mod state;
mod stl;
mod tev;
mod text;
mod transforms;

pub use error::{ReadError, WriteError};
pub use exr::{
    Channel, ChannelValues, ExrCompression, ExrLayout, ExrOptions, PixelType, Row, write_channels,
    write_exr,
};
pub use exr_read::{PictureChannels, read_attributes, read_exr};
pub use grid::{SampleLayout, SampleType, read_npy, read_raw};
pub use image::{ColorSpace, ImageFile, read_image};
pub use layers::{CRYPTOMATTE_RANKS, film_channels, matte_attributes};
pub use memory::available_memory;
pub use mesh::{MeshFile, NonFinite, read_mesh};
pub use mesh_write::write_mesh;
pub use mistakes::{Mistake, Mistakes};
pub use output::{Attribute, AttributeValue, check_writable, remove_unfinished, write_text};
pub use picture::{PictureFile, read_picture, read_png};
pub use png::{ToneMap, png_bytes, write_png};
pub use radiance::write_hdr;
pub use scene_file::{LoadError, LoadOptions, LoadedScene, load_scene};
pub use state::{StateFile, StateHead, StateView, read_state, read_state_head, write_state};
pub use tev::TevImage;
