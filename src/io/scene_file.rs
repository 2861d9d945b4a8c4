//! Loading whatever a user names as a scene: our TOML, or a bare mesh.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use super::document::Document;
use super::error::ReadError;
use super::mesh::NonFinite;
use super::mistakes::Mistakes;
use super::scene_toml::{Interpreted, interpret};
use crate::geometry::freeform::FreeformSurface;
use crate::scene::{ObjectDesc, SceneDesc, ShapeDesc};

/// What the command line adds to a scene file.
#[derive(Debug, Clone, Default)]
pub struct LoadOptions {
    /// `path.to.field=value`, applied in order.
    pub set: Vec<String>,
    /// Which of several cameras.
    pub camera: Option<String>,
    /// What becomes of triangles that are not finite, where an object does not say.
    pub non_finite: NonFinite,
}

/// A scene as loaded.
#[derive(Debug)]
pub struct LoadedScene {
    /// What was written.
    pub scene: SceneDesc,
    /// What a user should know.
    pub warnings: Vec<String>,
    /// Hash of everything that was read.
    pub hash: u64,
}

/// Why a scene cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It has mistakes.
    #[error(transparent)]
    Mistakes(#[from] Mistakes),
}

/// Loads a scene (`.toml`) or a bare mesh (`.ply`, `.obj`, `.stl`), with every file that it names.
///
/// # Errors
/// [`LoadError`] with every mistake of a scene file at once.
pub fn load_scene(path: &Path, options: &LoadOptions) -> Result<LoadedScene, LoadError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let (mut document, folder, text) = match extension.as_str() {
        "toml" => {
            let bytes = std::fs::read(path).map_err(|e| ReadError::io(path, "read", e))?;
            let text = String::from_utf8(bytes).map_err(|e| {
                let offset = e.utf8_error().valid_up_to() as u64;
                ReadError::byte(path, offset, "not UTF-8, as TOML must be")
            })?;
            let document = Document::parse(&path.to_string_lossy(), &text)?;
            (document, path.parent().unwrap_or(Path::new("")), text)
        }
        "ply" | "obj" | "stl" => {
            let name = path
                .to_str()
                .ok_or_else(|| ReadError::file(path, "the name of a mesh file must be UTF-8"))?;
            (Document::of_mesh(name), Path::new(""), String::new())
        }
        _ => {
            let message = "unknown kind of scene; accepted: .toml, .ply, .obj, .stl";
            return Err(ReadError::file(path, message).into());
        }
    };
    let mistakes: Vec<_> = options.set.iter().filter_map(|set| document.set(set).err()).collect();
    if !mistakes.is_empty() {
        return Err(Mistakes(mistakes).into());
    }
    let Interpreted { scene, warnings } = interpret(&document, folder, options)?;
    let hash = hash(&scene, &text, options);
    Ok(LoadedScene { scene, warnings, hash })
}

/// Hash of the text, the options, and all meshes and transforms, whatever file they came from.
/// Every part goes in with its length, so that no two lists of parts look alike.
fn hash(scene: &SceneDesc, text: &str, options: &LoadOptions) -> u64 {
    const PART: usize = 1 << 20;
    let mut total = Xxh3::new();
    for text in
        [text].into_iter().chain(options.set.iter().chain(&options.camera).map(String::as_str))
    {
        total.update(&(text.len() as u64).to_le_bytes());
        total.update(text.as_bytes());
    }
    let objects = scene.prototypes.iter().flat_map(|p| &p.objects).chain(&scene.objects);
    for object in objects {
        if let ShapeDesc::Instances { transforms, .. } = &object.shape {
            for transform in transforms {
                total.update(bytemuck::cast_slice(&transform.to_cols_array()));
            }
        }
        if let ShapeDesc::Freeform(freeform) = &object.shape {
            hash_surface(&freeform.surface, &mut total);
        }
    }
    // Pictures, in the order of the materials that name them; the text says the rest.
    for image in scene.materials.iter().flat_map(|m| m.maps.images()) {
        let picture = &image.levels()[0];
        total.update(bytemuck::cast_slice(&picture.size()));
        total.update(picture.pixels().as_bytes());
    }
    // Grids; objects in their order, then volumes.
    let surfaces = scene.prototypes.iter().flat_map(|p| &p.objects).chain(&scene.objects);
    let of_surface = |object: &ObjectDesc| match &object.shape {
        ShapeDesc::Isosurface(surface) => Some(surface.grid().clone()),
        _ => None,
    };
    let mut known = HashMap::new();
    for grid in surfaces.filter_map(of_surface).chain(scene.volumes.iter().map(|v| v.grid.clone()))
    {
        // Once, however often it is used.
        let hash = *known.entry(Arc::as_ptr(&grid)).or_insert_with(|| {
            let samples: &[u8] = bytemuck::cast_slice(grid.samples());
            let parts: Vec<u64> = samples.par_chunks(PART).map(xxh3_64).collect();
            xxh3_64(bytemuck::cast_slice(&parts))
        });
        total.update(bytemuck::cast_slice(&grid.size().map(|n| n as u64)));
        total.update(&hash.to_le_bytes());
    }
    for mesh in &scene.meshes {
        let mut add = |bytes: &[u8]| {
            let parts: Vec<u64> = bytes.par_chunks(PART).map(xxh3_64).collect();
            total.update(&(bytes.len() as u64).to_le_bytes());
            parts.iter().for_each(|part| total.update(&part.to_le_bytes()));
        };
        add(bytemuck::cast_slice(mesh.positions.as_flat()));
        add(bytemuck::cast_slice(&mesh.triangles));
        add(bytemuck::cast_slice(mesh.normals.as_deref().map_or(&[][..], |n| n)));
        add(bytemuck::cast_slice(mesh.uvs.as_deref().map_or(&[][..], |uv| uv)));
        add(bytemuck::cast_slice(&mesh.origin.to_array()));
    }
    total.digest()
}

/// Adds the control points and faces of a surface; the text says the rest.
fn hash_surface(surface: &FreeformSurface, total: &mut Xxh3) {
    total.update(&(surface.len() as u64).to_le_bytes());
    match surface {
        FreeformSurface::Patches(patches) => {
            for point in patches.iter().flat_map(|patch| patch.control()) {
                total.update(bytemuck::cast_slice(&point.to_array()));
            }
        }
        FreeformSurface::Subdivision(surface) => {
            for point in surface.positions() {
                total.update(bytemuck::cast_slice(&point.to_array()));
            }
            for face in surface.faces() {
                total.update(&(face.len() as u64).to_le_bytes());
                total.update(bytemuck::cast_slice(face));
            }
        }
    }
}
