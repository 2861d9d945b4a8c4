//! Our own scene format: tables become a [`SceneDesc`]. The format is described in `docs/scene.md`.

mod camera;
mod freeform;
mod instance;
mod light;
mod material;
mod settings;
mod shape;
mod texture;
mod volume;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DAffine3;

use super::document::{Document, Node, Value};
use super::fields::{Fields, Reader};
use super::grid::SampleLayout;
use super::mesh::{NonFinite, read_mesh};
use super::mistakes::Mistakes;
use super::scene_file::LoadOptions;
use super::transforms::transform;
use crate::geometry::grid::Grid;
use crate::scene::{ObjectDesc, PrototypeDesc, Reference, SceneDesc, ShapeDesc};
use camera::{camera, image};
use light::{fog, light};
use material::material;
use settings::settings;
use shape::ShapeKind;
use texture::Textures;

/// What a document says, and what should be told about it.
pub(super) struct Interpreted {
    pub(super) scene: SceneDesc,
    pub(super) warnings: Vec<String>,
}

/// Makes a scene of a document. File names in it are relative to `folder`.
pub(super) fn interpret(
    document: &Document,
    folder: &Path,
    options: &LoadOptions,
) -> Result<Interpreted, Mistakes> {
    let reader = Reader::new(document);
    let mut scene = Interpreter {
        reader: &reader,
        folder,
        scene: SceneDesc::default(),
        warnings: Vec::new(),
        non_finite: options.non_finite,
        meshes: HashMap::new(),
        grids: HashMap::new(),
    };
    scene.root(options.camera.as_deref());
    let Interpreter { scene, warnings, .. } = scene;
    reader.finish()?;
    Ok(Interpreted { scene, warnings })
}

struct Interpreter<'d, 'r> {
    reader: &'r Reader<'d>,
    folder: &'r Path,
    scene: SceneDesc,
    warnings: Vec<String>,
    /// What becomes of triangles that are not finite, where an object does not say.
    non_finite: NonFinite,
    /// Mesh files by path: read once, however often they are named.
    meshes: HashMap<PathBuf, Option<ReadMesh>>,
    /// Grids by path, and by layout where the file does not tell it.
    grids: HashMap<(PathBuf, Option<SampleLayout>), Option<Arc<Grid>>>,
}

/// A mesh file that was read.
#[derive(Clone)]
struct ReadMesh {
    /// Index into [`SceneDesc::meshes`].
    index: usize,
    /// See [`super::mesh::MeshFile::non_finite`].
    non_finite: Option<String>,
}

impl<'d, 'r> Interpreter<'d, 'r> {
    fn root(&mut self, camera: Option<&str>) {
        let root = self.reader.root();
        if let Some(fields) = self.table(&root, "image", "[image]") {
            self.scene.image = image(fields);
        }
        if let Some(fields) = self.table(&root, "render", "[render]") {
            self.scene.settings = settings(self.reader, fields);
        }
        if let Some(fields) = self.table(&root, "ambient", "[ambient]") {
            self.scene.ambient = fields.require_color("radiance");
            fields.finish();
        }
        if let Some(fields) = self.table(&root, "medium", "[medium]") {
            self.scene.fog = fog(self.reader, fields);
        }
        self.cameras(&root, camera);
        if let Some(fields) = self.table(&root, "materials", "[materials]") {
            let mut textures = Textures::new(self.reader, self.folder);
            for (name, node) in fields.all() {
                let what = format!("[materials.{name}]");
                if let Some(fields) = self.reader.table(node, &what) {
                    let material = material(self.reader, &mut textures, name, fields);
                    self.scene.materials.extend(material);
                }
            }
            self.warnings.append(&mut textures.warnings);
        }
        if let Some(node) = root.get("lights") {
            for node in self.reader.list(node, "lights") {
                if let Some(fields) = self.reader.table(node, "[[lights]]")
                    && let Some(light) = light(self.reader, fields)
                {
                    self.scene.lights.push(light);
                }
            }
        }
        if let Some(node) = root.get("volumes") {
            for node in self.reader.list(node, "volumes") {
                if let Some(fields) = self.reader.table(node, "[[volumes]]") {
                    let volume = self.volume(fields);
                    self.scene.volumes.extend(volume);
                }
            }
        }
        if let Some(fields) = self.table(&root, "prototypes", "[prototypes]") {
            for (name, node) in fields.all() {
                let what = format!("[prototypes.{name}]");
                let Some(fields) = self.reader.table(node, &what) else { continue };
                let at = fields.location();
                let objects = fields.require("objects").map(|node| self.objects(node));
                fields.finish();
                let objects = objects.unwrap_or_default();
                self.scene.prototypes.push(PrototypeDesc { name: name.to_owned(), at, objects });
            }
        }
        if let Some(node) = root.get("objects") {
            self.scene.objects = self.objects(node);
        } else if !root.has("volumes") {
            self.warnings.push("the scene has no objects".to_owned());
        }
        root.finish();
    }

    fn table(
        &self,
        root: &Fields<'d, 'r>,
        name: &'static str,
        what: &str,
    ) -> Option<Fields<'d, 'r>> {
        root.get(name).and_then(|node| self.reader.table(node, what))
    }

    fn cameras(&mut self, root: &Fields<'d, 'r>, wanted: Option<&str>) {
        let mut cameras = Vec::new();
        if let Some(fields) = self.table(root, "camera", "[camera]") {
            cameras.push((String::new(), camera(self.reader, fields)));
        }
        if let Some(fields) = self.table(root, "cameras", "[cameras]") {
            for (name, node) in fields.all() {
                let what = format!("[cameras.{name}]");
                if let Some(fields) = self.reader.table(node, &what) {
                    cameras.push((name.to_owned(), camera(self.reader, fields)));
                }
            }
        }
        self.scene.camera = match wanted {
            None => cameras.into_iter().next().map(|(_, camera)| camera),
            Some(wanted) => {
                let names: Vec<String> =
                    cameras.iter().map(|(n, _)| n.clone()).filter(|n| !n.is_empty()).collect();
                let found = cameras.into_iter().find(|(name, _)| name == wanted);
                if found.is_none() {
                    let accepted = if names.is_empty() {
                        "none is named".to_owned()
                    } else {
                        names.join(", ")
                    };
                    let message = format!("unknown camera `{wanted}`; accepted: {accepted}");
                    self.reader.mistake(root.span(), message);
                }
                found.map(|(_, camera)| camera)
            }
        };
    }

    fn objects(&mut self, node: &'d Node) -> Vec<ObjectDesc> {
        let nodes = self.reader.list(node, "objects");
        let tables = nodes.iter().filter_map(|node| self.reader.table(node, "[[objects]]"));
        let tables: Vec<Fields<'d, 'r>> = tables.collect();
        let mut named = HashMap::new();
        let objects = tables.into_iter().filter_map(|fields| {
            let is_named = fields.has("name");
            let mut object = self.object(fields)?;
            if !is_named {
                number_name(&mut object.name, &mut named);
            }
            Some(object)
        });
        objects.collect()
    }

    fn object(&mut self, fields: Fields<'d, 'r>) -> Option<ObjectDesc> {
        let at = fields.location();
        let kinds = ["shape", "mesh", "instance"].map(|kind| fields.has(kind).then_some(kind));
        let kinds: Vec<&'static str> = kinds.into_iter().flatten().collect();
        let &[kind] = kinds.as_slice() else {
            let message = "an object has one of the fields `shape`, `mesh`, `instance`";
            self.reader.mistake(fields.span(), message);
            return None;
        };
        let node = fields.get(kind)?;
        let desc = match kind {
            "shape" => {
                // Without its kind, nothing can be said of the other fields.
                let kind = fields.choose(node, "shape", &ShapeKind::ALL)?;
                self.shape(&fields, kind)
            }
            "mesh" => {
                fields.is("a mesh object");
                self.mesh_file(&fields, node).map(ShapeDesc::Mesh)
            }
            _ => {
                fields.is("an instance");
                self.instance(&fields, node)
            }
        };
        let material = match fields.get("material") {
            Some(node) if kind == "instance" => {
                let message = "an instance takes its materials from its prototype";
                self.reader.mistake(node.span, message);
                None
            }
            Some(node) => fields
                .text(node, "material")
                .map(|name| Reference { name: name.to_owned(), at: self.reader.locate(node.span) }),
            None => None,
        };
        let steps = |name: &'static str| {
            let transform = fields.get(name).and_then(|node| transform(self.reader, node, name));
            transform.unwrap_or(DAffine3::IDENTITY)
        };
        let name = match fields.get("name") {
            Some(node) => fields.text(node, "name").map(str::to_owned),
            None => Some(default_name(node)),
        };
        let own = steps("transform");
        // The objects of a prototype have theirs.
        let texture_transform =
            if kind == "instance" { DAffine3::IDENTITY } else { steps("texture_transform") };
        fields.finish();
        let transform = own;
        let name = name.unwrap_or_default();
        desc.map(|shape| ObjectDesc { at, name, shape, material, transform, texture_transform })
    }

    pub(super) fn mesh_file(&mut self, fields: &Fields<'d, 'r>, node: &'d Node) -> Option<usize> {
        let non_finite = fields
            .choice("non_finite", &NonFinite::ALL.map(|n| (n.name(), n)))
            .unwrap_or(self.non_finite);
        let name = fields.text(node, "mesh")?;
        let path = self.folder.join(name);
        // One file under two names is read once.
        let key = path.canonicalize().unwrap_or_else(|_| path.clone());
        if !self.meshes.contains_key(&key) {
            let read = self.read_mesh(&path, node);
            self.meshes.insert(key.clone(), read);
        }
        let mesh = self.meshes[&key].as_ref()?;
        match &mesh.non_finite {
            Some(which) if non_finite == NonFinite::Refuse => {
                self.reader.mistake(node.span, format!("{}: {which}", path.display()));
                None
            }
            _ => Some(mesh.index),
        }
    }

    fn read_mesh(&mut self, path: &Path, node: &'d Node) -> Option<ReadMesh> {
        match read_mesh(path) {
            Ok(file) => {
                let warnings = file.warnings.iter().map(|w| format!("{}: {w}", path.display()));
                self.warnings.extend(warnings);
                self.scene.meshes.push(file.mesh);
                let index = self.scene.meshes.len() - 1;
                Some(ReadMesh { index, non_finite: file.non_finite })
            }
            Err(error) => {
                self.reader.mistake(node.span, error.to_string());
                None
            }
        }
    }
}

/// What an object is called that has no name: as its shape, its prototype or its mesh's file.
fn default_name(kind: &Node) -> String {
    match &kind.value {
        Value::String(text) => {
            let stem = Path::new(text.as_str()).file_stem();
            stem.map_or_else(|| "object".to_owned(), |stem| stem.to_string_lossy().into_owned())
        }
        _ => "object".to_owned(),
    }
}

/// Tells names apart that several objects have: "sphere", "sphere.2", "sphere.3".
fn number_name(name: &mut String, named: &mut HashMap<String, u32>) {
    let count = named.entry(name.clone()).or_insert(0);
    *count += 1;
    if *count > 1 {
        *name = format!("{name}.{count}");
    }
}
