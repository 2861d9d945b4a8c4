//! Our own scene format: tables become a [`SceneDesc`]. The format is described in `docs/scene.md`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat4, DVec3};

use super::document::{Document, Node, Value};
use super::fields::{Fields, Reader};
use super::mesh::read_mesh;
use super::mistakes::Mistakes;
use super::transforms::{affine, read_transforms, transform};
use crate::accel::{BuildQuality, Precision};
use crate::camera::Projection;
use crate::color::Rgb;
use crate::film::Filter;
use crate::geometry::TriangleMesh;
use crate::light::Falloff;
use crate::material::{Material, Phong, PhongModel};
use crate::scene::{
    CameraDesc, Epsilon, ImageDesc, IntegratorKind, LightDesc, MaterialDesc, ObjectDesc, PlaceDesc,
    PrototypeDesc, Reference, RenderSettings, SceneDesc, ShapeDesc,
};

/// Most pixels on a side.
const MAX_SIDE: u32 = 65_535;

/// What a document says, and what should be told about it.
pub(super) struct Interpreted {
    pub(super) scene: SceneDesc,
    pub(super) warnings: Vec<String>,
}

/// Makes a scene of a document. File names in it are relative to `folder`; `camera` chooses among
/// several cameras.
pub(super) fn interpret(
    document: &Document,
    folder: &Path,
    camera: Option<&str>,
) -> Result<Interpreted, Mistakes> {
    let reader = Reader::new(document);
    let mut scene = Interpreter {
        reader: &reader,
        folder,
        scene: SceneDesc::default(),
        warnings: Vec::new(),
        meshes: HashMap::new(),
    };
    scene.root(camera);
    let Interpreter { scene, warnings, .. } = scene;
    reader.finish()?;
    Ok(Interpreted { scene, warnings })
}

struct Interpreter<'d, 'r> {
    reader: &'r Reader<'d>,
    folder: &'r Path,
    scene: SceneDesc,
    warnings: Vec<String>,
    /// Mesh files by path: read once, however often they are named.
    meshes: HashMap<PathBuf, Option<usize>>,
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
        self.cameras(&root, camera);
        if let Some(fields) = self.table(&root, "materials", "[materials]") {
            for (name, node) in fields.all() {
                let what = format!("[materials.{name}]");
                if let Some(fields) = self.reader.table(node, &what)
                    && let Some(material) = material(fields)
                {
                    self.scene.materials.push(MaterialDesc { name: name.to_owned(), material });
                }
            }
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
        } else {
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
        nodes
            .iter()
            .filter_map(|node| self.reader.table(node, "[[objects]]"))
            .filter_map(|fields| self.object(fields))
            .collect()
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
        let transform = fields.get("transform").and_then(|node| transform(self.reader, node));
        fields.finish();
        let transform = transform.unwrap_or(DAffine3::IDENTITY);
        desc.map(|shape| ObjectDesc { at, shape, material, transform })
    }

    fn shape(&mut self, fields: &Fields<'d, 'r>, kind: ShapeKind) -> Option<ShapeDesc> {
        match kind {
            ShapeKind::Sphere => {
                fields.is("a sphere");
                let center = fields.vector("center").unwrap_or(DVec3::ZERO);
                let radius = fields.require("radius");
                let radius = radius.and_then(|node| fields.positive(node, "radius"))?;
                Some(ShapeDesc::Sphere { center, radius })
            }
            ShapeKind::Triangle => {
                fields.is("a triangle");
                let node = fields.require("points")?;
                let xyz = self.points(node, "points")?;
                if xyz.len() != 9 {
                    self.reader.expected(node, "points", "three points");
                    return None;
                }
                self.scene.meshes.push(inline_mesh(&xyz, vec![[0, 1, 2]]));
                Some(ShapeDesc::Mesh(self.scene.meshes.len() - 1))
            }
            ShapeKind::Mesh => {
                fields.is("a mesh");
                let positions = fields.require("positions");
                let triangles = fields.require("triangles");
                let xyz = self.points(positions?, "positions")?;
                let triangles = self.triangles(triangles?, xyz.len() / 3)?;
                self.scene.meshes.push(inline_mesh(&xyz, triangles));
                Some(ShapeDesc::Mesh(self.scene.meshes.len() - 1))
            }
        }
    }

    fn points(&self, node: &'d Node, name: &str) -> Option<Vec<f64>> {
        if !matches!(node.value, Value::Array(_)) {
            self.reader.expected(node, name, "a list of points");
            return None;
        }
        let points = self.reader.list(node, name).iter();
        let numbers: Option<Vec<[f64; 3]>> =
            points.map(|point| self.reader.numbers::<3>(point, name)).collect();
        let xyz: Vec<f64> = numbers?.into_iter().flatten().collect();
        if let Some(x) = xyz.iter().find(|x| x.abs() > 1e18) {
            self.reader.mistake(node.span, format!("`{name}` must lie within 1e18, not {x}"));
            return None;
        }
        Some(xyz)
    }

    fn triangles(&self, node: &'d Node, vertices: usize) -> Option<Vec<[u32; 3]>> {
        let mut triangles = Vec::new();
        for item in self.reader.list(node, "triangles") {
            let corners = self.reader.numbers::<3>(item, "triangles")?;
            if let Some(bad) =
                corners.iter().find(|&&i| i < 0.0 || i.fract() != 0.0 || i >= vertices as f64)
            {
                let message = format!(
                    "triangle {} names vertex {bad}, but there are {vertices} (the first is 0)",
                    triangles.len()
                );
                self.reader.mistake(item.span, message);
                return None;
            }
            triangles.push(corners.map(|i| i as u32));
        }
        Some(triangles)
    }

    fn mesh_file(&mut self, fields: &Fields<'d, 'r>, node: &'d Node) -> Option<usize> {
        let name = fields.text(node, "mesh")?;
        let path = self.folder.join(name);
        // One file under two names is read once.
        let key = path.canonicalize().unwrap_or_else(|_| path.clone());
        if let Some(known) = self.meshes.get(&key) {
            return *known;
        }
        let index = match read_mesh(&path) {
            Ok(file) => {
                let warnings = file.warnings.iter().map(|w| format!("{}: {w}", path.display()));
                self.warnings.extend(warnings);
                self.scene.meshes.push(file.mesh);
                Some(self.scene.meshes.len() - 1)
            }
            Err(error) => {
                self.reader.mistake(node.span, error.to_string());
                None
            }
        };
        self.meshes.insert(key, index);
        index
    }

    fn instance(&mut self, fields: &Fields<'d, 'r>, node: &'d Node) -> Option<ShapeDesc> {
        let name = fields.text(node, "instance")?;
        let prototype = Reference { name: name.to_owned(), at: self.reader.locate(node.span) };
        let transforms = match fields.get("transforms") {
            None => vec![DAffine3::IDENTITY],
            Some(node) => match &node.value {
                Value::String(file) => {
                    let path = self.folder.join(file);
                    match read_transforms(&path) {
                        Ok(transforms) => transforms,
                        Err(error) => {
                            self.reader.mistake(node.span, error.to_string());
                            return None;
                        }
                    }
                }
                Value::Array(rows) => rows
                    .iter()
                    .map(|row| match &row.value {
                        // Twelve numbers, or a list of steps as in `transform`.
                        Value::Array(items)
                            if items.iter().all(|i| matches!(i.value, Value::Table(_))) =>
                        {
                            transform(self.reader, row)
                        }
                        Value::Array(items) if items.len() == 12 => {
                            self.reader.numbers::<12>(row, "transforms").map(|m| affine(&m))
                        }
                        _ => {
                            let expected = "a list of copies, each 12 numbers or a list of steps \
                                such as [{ translate = [1, 0, 0] }]";
                            self.reader.expected(row, "transforms", expected);
                            None
                        }
                    })
                    .collect::<Option<_>>()?,
                _ => {
                    self.reader.expected(node, "transforms", "a file name or a list");
                    return None;
                }
            },
        };
        Some(ShapeDesc::Instances { prototype, transforms })
    }
}

/// The values of `shape`.
#[derive(Clone, Copy)]
enum ShapeKind {
    Sphere,
    Triangle,
    Mesh,
}

impl ShapeKind {
    const ALL: [(&'static str, Self); 3] =
        [("sphere", Self::Sphere), ("triangle", Self::Triangle), ("mesh", Self::Mesh)];
}

/// A mesh from numbers in the scene file, which are f64.
fn inline_mesh(xyz: &[f64], triangles: Vec<[u32; 3]>) -> TriangleMesh {
    let (origin, xyz) = super::mesh::place(xyz);
    TriangleMesh { origin, ..TriangleMesh::new(xyz, triangles) }
}

fn image(fields: Fields<'_, '_>) -> ImageDesc {
    let mut image = ImageDesc::default();
    if let Some(node) = fields.get("size") {
        match &node.value {
            Value::Array(sides) => match sides.as_slice() {
                [Node { value: Value::Integer(w), .. }, Node { value: Value::Integer(h), .. }]
                    if [w, h].iter().all(|x| (1..=i64::from(MAX_SIDE)).contains(x)) =>
                {
                    image.size = [*w as u32, *h as u32];
                }
                _ => fields.expected(node, "size", &size_expected()),
            },
            _ => fields.expected(node, "size", &size_expected()),
        }
    }
    image.background = fields.color("background");
    fields.finish();
    image
}

fn size_expected() -> String {
    format!("[width, height] in pixels, whole numbers from 1 to {MAX_SIDE}")
}

fn settings(reader: &Reader<'_>, fields: Fields<'_, '_>) -> RenderSettings {
    let default = RenderSettings::default();
    let settings = RenderSettings {
        integrator: fields
            .choice("integrator", &IntegratorKind::ALL.map(|i| (i.name(), i)))
            .unwrap_or(default.integrator),
        samples: fields.integer("samples", 1, 1 << 24).unwrap_or(default.samples),
        max_depth: fields.integer("max_depth", 0, 1 << 20).unwrap_or(default.max_depth),
        precision: fields
            .choice("precision", &Precision::ALL.map(|p| (p.name(), p)))
            .unwrap_or(default.precision),
        shadows: fields.bool("shadows").unwrap_or(default.shadows),
        filter: fields
            .choice("filter", &Filter::ALL.map(|f| (f.name(), f)))
            .unwrap_or(default.filter),
        epsilon: match fields.get("epsilon") {
            None => default.epsilon,
            Some(node) => match &node.value {
                Value::String(text) if text == "auto" => Epsilon::Auto,
                Value::Integer(_) | Value::Float(_) => fields
                    .not_negative(node, "epsilon")
                    .map_or(default.epsilon, |e| Epsilon::Fixed(e as f32)),
                _ => {
                    reader.expected(node, "epsilon", "\"auto\" or a distance from 0 on");
                    default.epsilon
                }
            },
        },
        build_quality: fields
            .choice("build_quality", &BuildQuality::ALL.map(|q| (q.name(), q)))
            .unwrap_or(default.build_quality),
    };
    fields.finish();
    settings
}

fn camera(reader: &Reader<'_>, fields: Fields<'_, '_>) -> CameraDesc {
    let at = fields.location();
    let kinds = [("perspective", false), ("orthographic", true)];
    let is_parallel = fields.choice("projection", &kinds).unwrap_or(false);
    let projection = if is_parallel {
        let node = fields.get("height");
        if node.is_none() && (fields.has("eye") || fields.has("transform")) {
            reader.mistake(fields.span(), "an orthographic camera that is placed needs a `height`");
        }
        let height = node.and_then(|node| fields.positive(node, "height"));
        // 0: as high as the scene, with the place.
        Projection::Orthographic { height: height.unwrap_or(0.0) }
    } else {
        let mut fov = 40.0;
        if let Some(node) = fields.get("fov")
            && let Some(degrees) = reader.number(node, "fov")
        {
            if degrees > 0.0 && degrees < 180.0 {
                fov = degrees;
            } else {
                reader.expected(node, "fov", "an angle between 0 and 180 degrees");
            }
        }
        Projection::Perspective { fov: fov.to_radians() }
    };
    let place = match fields.get("transform") {
        Some(node) => {
            let matrix = transform(reader, node).map(|m| PlaceDesc::Matrix(DMat4::from(m)));
            for name in ["eye", "target", "up"] {
                if let Some(node) = fields.get(name) {
                    let message = format!("`{name}` and `transform` exclude each other");
                    reader.mistake(node.span, message);
                }
            }
            matrix
        }
        None => {
            let (eye, target) = (fields.vector("eye"), fields.vector("target"));
            let up = fields.vector("up").unwrap_or(DVec3::Y);
            match (eye, target) {
                (Some(eye), target) => {
                    // Straight ahead where only the place is given.
                    let target = target.unwrap_or(eye - DVec3::Z * (1.0 + eye.length()));
                    Some(PlaceDesc::LookAt { eye, target, up })
                }
                (None, None) if !fields.has("up") => None,
                (None, _) if fields.has("eye") => None,
                (None, _) => {
                    reader
                        .mistake(fields.span(), "a camera with a `target` or `up` needs an `eye`");
                    None
                }
            }
        }
    };
    fields.finish();
    CameraDesc { at, projection, place }
}

fn material(fields: Fields<'_, '_>) -> Option<Material> {
    let kinds = [("diffuse", false), ("phong", true)];
    let is_phong = fields.require("type").and_then(|node| fields.choose(node, "type", &kinds));
    let material = match is_phong {
        // Without its type, nothing can be said of the other fields.
        None => return None,
        Some(false) => {
            let reflectance = match fields.get("reflectance") {
                Some(node) => fields.reflectance(node, "reflectance").unwrap_or_default(),
                None => Rgb::splat(0.6),
            };
            Material::Diffuse { reflectance }
        }
        Some(true) => {
            let diffuse = fields.color("diffuse").unwrap_or(Rgb::splat(0.6));
            let ambient = fields.color("ambient").unwrap_or(diffuse);
            let specular = fields.color("specular").unwrap_or(Rgb::BLACK);
            let shininess = match fields.get("shininess") {
                Some(node) => fields.not_negative(node, "shininess").unwrap_or(1.0),
                None => 32.0,
            };
            let models = [("blinn-phong", PhongModel::BlinnPhong), ("phong", PhongModel::Phong)];
            let model = fields.choice("model", &models).unwrap_or_default();
            let shininess = shininess as f32;
            Material::Phong(Phong { ambient, diffuse, specular, shininess, model })
        }
    };
    fields.finish();
    Some(material)
}

fn light(reader: &Reader<'_>, fields: Fields<'_, '_>) -> Option<LightDesc> {
    let kinds = [("point", false), ("directional", true)];
    let node = fields.require("type")?;
    let is_directional = fields.choose(node, "type", &kinds)?;
    let light = if is_directional {
        let direction = fields.require_vector("direction");
        let irradiance = fields.require_color("irradiance");
        let direction = direction.filter(|d| {
            let is_zero = d.length() < 1e-30;
            if is_zero {
                let node = fields.get("direction");
                let span = node.map_or(fields.span(), |node| node.span);
                reader.mistake(span, "the `direction` of a light must not be zero");
            }
            !is_zero
        });
        direction
            .zip(irradiance)
            .map(|(direction, irradiance)| LightDesc::Directional { direction, irradiance })
    } else {
        let position = fields.require_vector("position");
        let intensity = fields.require_color("intensity");
        let falloffs = [("inverse-square", Falloff::InverseSquare), ("none", Falloff::None)];
        let falloff = fields.choice("falloff", &falloffs).unwrap_or_default();
        position.zip(intensity).map(|(position, intensity)| LightDesc::Point {
            position,
            intensity,
            falloff,
        })
    };
    fields.finish();
    light
}
