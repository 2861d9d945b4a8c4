//! From what was written to what is rendered: names resolved, everything checked, the world recentred
//! and built. Nothing changes afterwards.

use std::collections::HashMap;

use glam::DVec3;

use super::desc::{
    CameraDesc, LightDesc, Location, PlaceDesc, Reference, RenderSettings, SceneDesc,
};
use super::place::{GeometryMaterials, Placed, place};
use super::requirements::Requirements;
use crate::accel::{Accel, AccelError, AccelKind, BuildOptions, Hit, World};
use crate::camera::{Camera, Pose, Projection};
use crate::color::Rgb;
use crate::light::{DirectionalLight, Light, PointLight};
use crate::material::Material;
use crate::math::Bounds;

/// Vertical field of view where none is given.
const DEFAULT_FOV: f64 = 40.0;

/// A scene that is ready to be rendered. Immutable; coordinates are relative to [`Scene::center`].
#[derive(Debug)]
pub struct Scene {
    /// Size of the picture in pixels.
    pub size: [u32; 2],
    /// Radiance where nothing is hit.
    pub background: Rgb,
    /// Ambient radiance I_a.
    pub ambient: Rgb,
    /// The camera.
    pub camera: Camera,
    /// All lights.
    pub lights: Vec<Light>,
    /// How to render.
    pub settings: RenderSettings,
    /// What it requires of a renderer.
    pub requirements: Requirements,
    /// What was subtracted from the coordinates of the files, in f64.
    pub center: DVec3,
    /// The box around everything.
    pub bounds: Bounds,
    /// The structure that answers ray queries.
    pub accel: Accel,
    pub(super) world: World,
    materials: Vec<Material>,
    root_materials: Vec<GeometryMaterials>,
    prototype_materials: Vec<Vec<GeometryMaterials>>,
}

/// A name that stands for nothing.
#[derive(Debug, thiserror::Error)]
#[error("{at}: unknown {kind} `{name}`{}; accepted: {}", did_you_mean(.similar), .accepted)]
pub struct UnknownName {
    /// Where it is used.
    pub at: Location,
    /// "material", "prototype".
    pub kind: &'static str,
    /// The name.
    pub name: String,
    /// The defined name that it most resembles.
    pub similar: Option<String>,
    /// Names that are defined: the first few, and how many more there are.
    pub accepted: String,
}

/// Why a scene cannot be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A name stands for nothing.
    #[error(transparent)]
    UnknownName(Box<UnknownName>),
    /// A prototype contains itself.
    #[error("{at}: prototype `{name}` contains itself")]
    PrototypeCycle {
        /// Where the circle closes.
        at: Location,
        /// The prototype.
        name: String,
    },
    /// A transform has a NaN or infinite number.
    #[error("{at}: the transform of this object is not finite")]
    TransformNotFinite {
        /// The object.
        at: Location,
    },
    /// A transform flattens space.
    #[error(
        "{at}: the transform of this object is singular: it flattens the object to a plane, a line or a point"
    )]
    TransformSingular {
        /// The object.
        at: Location,
    },
    /// The scene reaches beyond what f32 ray queries can hold.
    #[error(
        "the scene reaches {reach:.0e} from its middle; coordinates must lie within 1e12 of it"
    )]
    TooLarge {
        /// The largest coordinate, from the middle.
        reach: f64,
    },
    /// The scene, or a prototype, is smaller than what f32 ray queries can hold.
    #[error(
        "{what} is only {extent:.0e} across; below 1e-10 ray queries find nothing: scale it up"
    )]
    TooSmall {
        /// "the scene", "a prototype".
        what: &'static str,
        /// Its largest side.
        extent: f64,
    },
    /// A copy's transform stretches or shrinks beyond f32.
    #[error(
        "{at}: transform {row} (counted from 0) of this object scales by {scale:.0e}; accepted: 1e-9 to 1e9"
    )]
    CopyScale {
        /// The object.
        at: Location,
        /// Which of its transforms.
        row: usize,
        /// The factor.
        scale: f64,
    },
    /// Prototypes that copy prototypes that copy prototypes …
    #[error("{at}: prototypes are nested more than {limit} deep")]
    NestedTooDeep {
        /// Where the limit is passed.
        at: Location,
        /// The limit.
        limit: usize,
    },
    /// More copies than can be held.
    #[error("the scene has {count} copies of prototypes in all; at most {limit} are possible")]
    TooManyCopies {
        /// How many there would be.
        count: u64,
        /// How many there may be.
        limit: u64,
    },
    /// One of a list of copies has a bad transform.
    #[error("{at}: transform {row} (counted from 0) of this object is singular or not finite")]
    CopySingular {
        /// The object.
        at: Location,
        /// Which of its transforms.
        row: usize,
    },
    /// A camera has no direction to look in.
    #[error(
        "{at}: the camera has no direction: `eye` and `target` must differ, and `up` must not be parallel to the view; a `transform` must not be singular or sheared"
    )]
    Camera {
        /// The camera.
        at: Location,
    },
    /// The acceleration structure could not be built.
    #[error(transparent)]
    Accel(#[from] AccelError),
}

fn did_you_mean(name: &Option<String>) -> String {
    name.as_ref().map(|n| format!(" (did you mean `{n}`?)")).unwrap_or_default()
}

fn list(names: &[String]) -> String {
    if names.is_empty() {
        return "none is defined".to_owned();
    }
    const SHOWN: usize = 12;
    let mut text = names.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN {
        text += &format!(" and {} more", names.len() - SHOWN);
    }
    text
}

/// Names and the indices they stand for.
#[derive(Debug)]
pub(super) struct NameIndex {
    indices: HashMap<String, u32>,
    names: Vec<String>,
}

impl NameIndex {
    fn new(names: impl IntoIterator<Item = String>) -> Self {
        let names: Vec<String> = names.into_iter().collect();
        let indices = (0u32..).zip(&names).map(|(i, n)| (n.clone(), i)).collect();
        Self { indices, names }
    }

    pub(super) fn find(
        &self,
        reference: &Reference,
        kind: &'static str,
    ) -> Result<u32, SceneError> {
        self.indices.get(&reference.name).copied().ok_or_else(|| {
            let distance = |name: &&String| strsim::damerau_levenshtein(name, &reference.name);
            let similar = self.names.iter().min_by_key(distance).filter(|n| distance(n) <= 2);
            SceneError::UnknownName(Box::new(UnknownName {
                at: reference.at.clone(),
                kind,
                name: reference.name.clone(),
                similar: similar.cloned(),
                accepted: list(&self.names),
            }))
        })
    }
}

impl Scene {
    /// Checks a description and makes it ready. `options` say how to build; precision and quality are
    /// taken from the scene's settings. `progress` hears of the build from 0 to 1, perhaps on several
    /// threads at once, and ends it by returning false.
    ///
    /// # Errors
    /// Every mistake that was found.
    pub fn build(
        mut desc: SceneDesc,
        options: &BuildOptions,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Self, Vec<SceneError>> {
        let material_names = NameIndex::new(desc.materials.iter().map(|m| m.name.clone()));
        let prototype_names = NameIndex::new(desc.prototypes.iter().map(|p| p.name.clone()));
        let mut errors = Vec::new();
        let pose = match &desc.camera {
            Some(camera) => camera_pose(camera).unwrap_or_else(|error| {
                errors.push(error);
                None
            }),
            None => None,
        };
        let placed = match place(&mut desc, &material_names, &prototype_names) {
            Ok(placed) if errors.is_empty() => placed,
            Ok(_) => return Err(errors),
            Err(more) => {
                errors.extend(more);
                return Err(errors);
            }
        };
        let Placed { world, root_materials, prototype_materials, center } = placed;

        let bounds = world.bounds();
        let size = desc.image.size;
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let default_projection = Projection::Perspective { fov: DEFAULT_FOV.to_radians() };
        let mut projection = desc.camera.as_ref().map_or(default_projection, |c| c.projection);
        let pose = match pose {
            Some(pose) => pose.translated(-center),
            None => {
                let support = |directions| world.support(directions);
                let (pose, height) =
                    Camera::frame(support, DVec3::new(-0.6, -0.45, -1.0), projection, aspect);
                if let Projection::Orthographic { height: h @ 0.0 } = &mut projection {
                    *h = height;
                }
                pose
            }
        };
        let camera = Camera::new(pose, projection, size, bounds);

        // A scene without light of its own is lit from the camera's side.
        let unlit = desc.lights.is_empty() && desc.ambient.is_none();
        let lights = if unlit { default_lights(&pose) } else { lights(&desc.lights, center) };
        let ambient = desc.ambient.unwrap_or(Rgb::splat(if unlit { 0.15 } else { 0.0 }));
        let default_background = if unlit { Rgb::splat(0.06) } else { Rgb::BLACK };

        let mut materials = vec![Material::Diffuse { reflectance: Rgb::splat(0.6) }];
        materials.extend(desc.materials.into_iter().map(|m| m.material));
        let requirements = Requirements::of(&world, &materials, &lights, &desc.settings, unlit);

        let options = BuildOptions {
            precision: desc.settings.precision,
            quality: desc.settings.build_quality,
            ..options.clone()
        };
        let accel = Accel::build(&world, &options, progress).map_err(|e| vec![e.into()])?;
        Ok(Self {
            size,
            background: desc.image.background.unwrap_or(default_background),
            ambient,
            camera,
            lights,
            settings: desc.settings,
            requirements,
            center,
            bounds,
            accel,
            world,
            materials,
            root_materials,
            prototype_materials,
        })
    }

    /// As [`Scene::build`] with the default structure and no progress: for tests and small programs.
    ///
    /// # Errors
    /// As [`Scene::build`].
    pub fn build_quietly(desc: SceneDesc, kind: AccelKind) -> Result<Self, Vec<SceneError>> {
        Self::build(desc, &BuildOptions { kind, ..BuildOptions::default() }, &|_| true)
    }

    /// The material of what was hit.
    #[inline]
    pub fn material(&self, hit: &Hit) -> &Material {
        let materials = match hit.copy {
            None => &self.root_materials,
            Some(copy) => {
                &self.prototype_materials[self.world.sets[copy.set as usize].prototype as usize]
            }
        };
        &self.materials[materials[hit.geometry as usize].of(hit.primitive) as usize]
    }

    /// What there is to hit.
    pub fn world(&self) -> &World {
        &self.world
    }
}

fn camera_pose(camera: &CameraDesc) -> Result<Option<Pose>, SceneError> {
    let Some(place) = &camera.place else { return Ok(None) };
    let pose = match place {
        PlaceDesc::LookAt { eye, target, up } => Pose::look_at(*eye, *target, *up),
        PlaceDesc::Matrix(m) => Pose::from_matrix(m),
    };
    pose.map(Some).ok_or_else(|| SceneError::Camera { at: camera.at.clone() })
}

fn lights(descs: &[LightDesc], center: DVec3) -> Vec<Light> {
    let light = |desc: &LightDesc| match desc {
        LightDesc::Point { position, intensity, falloff } => Light::Point(PointLight {
            position: *position - center,
            intensity: *intensity,
            falloff: *falloff,
        }),
        LightDesc::Directional { direction, irradiance } => Light::Directional(DirectionalLight {
            direction: direction.normalize().as_vec3(),
            irradiance: *irradiance,
        }),
    };
    descs.iter().map(light).collect()
}

/// A key light over the camera's left shoulder and a weaker fill from its right.
fn default_lights(pose: &Pose) -> Vec<Light> {
    let towards = |right: f64, up: f64, forward: f64, irradiance: f32| {
        let direction = pose.right * right + pose.up * up + pose.forward * forward;
        Light::Directional(DirectionalLight {
            direction: direction.normalize().as_vec3(),
            irradiance: Rgb::splat(irradiance),
        })
    };
    vec![towards(0.55, -0.75, 1.0, 2.6), towards(-0.9, -0.25, 0.6, 1.0)]
}
