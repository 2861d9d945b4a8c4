//! From what was written to what is rendered: names resolved, everything checked, the world recentred
//! and built. Nothing changes afterwards.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use super::coverage::coverage;
use super::desc::{
    CameraDesc, IntegratorKind, LensDesc, Location, PlaceDesc, Reference, RenderSettings,
    SceneDesc, Tolerance,
};
use super::draft::{GeometryLooks, Look};
use super::hollow::{Hollows, SphereId};
use super::lights::{
    Emission, add_surfaces, default_lights, glowing_objects, is_hidden, written_lights,
};
use super::maps::Maps;
use super::place::{CopyObjects, Placed, place};
use super::requirements::{Contents, Requirements, has_clear_shadows};
use super::surface::SurfacePoint;
use super::tessellate::{Tessellation, tessellate};
use super::volumes::{check_volumes, placed_volumes};
use crate::accel::{
    Accel, AccelError, AccelKind, BuildOptions, BuildQuality, Geometry, Hit, MemoryEstimate, World,
};
use crate::camera::{Camera, Lens, Pose, Projection};
use crate::color::Rgb;
use crate::light::{Light, LightTree};
use crate::material::{FresnelModel, Material, Phong};
use crate::math::Bounds;
use crate::medium::volume::Volume;
use crate::medium::{Fog, FogProfile, Interior};
use crate::texture::TexelFilter;

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
    /// Where there are more than a point can ask: from which to draw those that matter to it.
    pub light_tree: Option<LightTree>,
    /// Fog around everything.
    pub fog: Option<Fog>,
    /// Grids that glow and absorb.
    pub volumes: Vec<Volume>,
    /// The media that the camera stands in.
    pub camera_interior: Interior,
    /// How to render.
    pub settings: RenderSettings,
    /// What it requires of a renderer.
    pub requirements: Requirements,
    /// What became of freeform surfaces.
    pub tessellations: Vec<Tessellation>,
    /// What was subtracted from the coordinates of the files, in f64.
    pub center: DVec3,
    /// The box around everything.
    pub bounds: Bounds,
    /// The structure that answers ray queries.
    pub accel: Accel,
    /// What it was expected to take.
    pub memory_estimate: MemoryEstimate,
    /// How much work went into the hierarchy over the world's root: [`BuildQuality::Auto`], decided.
    pub build_quality: BuildQuality,
    /// Whether it is of the compact form.
    pub is_compact: bool,
    /// Spheres of glass within which a ray needs no query.
    pub hollows: Hollows,
    pub(super) world: World,
    pub(super) materials: Vec<Material>,
    /// What each material gives off; none where none does.
    emissions: Vec<Emission>,
    /// Textures of each material; none where none has any.
    pub(super) maps: Vec<Maps>,
    pub(super) frames: Vec<DAffine3>,
    pub(super) root_looks: Vec<GeometryLooks>,
    prototype_looks: Vec<Vec<GeometryLooks>>,
    copy_objects: Vec<CopyObjects>,
    object_names: Vec<String>,
    material_names: Vec<String>,
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
    #[error("{at}: the {what} of this object is not finite")]
    TransformNotFinite {
        /// The object.
        at: Location,
        /// Which of its fields.
        what: &'static str,
    },
    /// A transform flattens space.
    #[error(
        "{at}: the {what} of this object is singular: it flattens the object to a plane, a line or a point"
    )]
    TransformSingular {
        /// The object.
        at: Location,
        /// Which of its fields.
        what: &'static str,
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
    /// The place of a glass in the list of materials is part of what a ray remembers.
    #[error("glass `{name}` is material {index} of the scene; at most {limit} may come before it")]
    TooManyMaterials {
        /// The material.
        name: String,
        /// Its number.
        index: usize,
        /// How many may come before.
        limit: usize,
    },
    /// More triangles that glow than can be sampled.
    #[error("objects with `emission` have more than {limit} triangles in all, copies counted each")]
    TooManyGlowing {
        /// The limit.
        limit: u64,
    },
    /// A shape cannot be sampled as a light.
    #[error(
        "{at}: this object cannot give off light; accepted with `emission`: meshes, and all shapes but `plane`, `quadric`, `implicit` and `isosurface`"
    )]
    CannotGlow {
        /// The object; that of a copy is not known.
        at: Location,
    },
    /// A texture by texture coordinates lies on an object that has none.
    #[error(
        "{at}: the texture of material `{material}` needs texture coordinates, which this object does not have; accepted: one with them, or a texture by position (for images `mapping` = \"planar\", \"spherical\" or \"cylindrical\")"
    )]
    NoTextureCoordinates {
        /// The object.
        at: Location,
        /// The material.
        material: String,
    },
    /// A tolerance asks for more triangles than there may be.
    #[error(
        "{at}: with a tolerance of {tolerance} this object takes more than {limit} triangles; {fits} would fit"
    )]
    TooManyTriangles {
        /// The object.
        at: Location,
        /// Its tolerance.
        tolerance: Tolerance,
        /// How many there may be.
        limit: u64,
        /// A tolerance that does not take more.
        fits: Tolerance,
    },
    /// The acceleration structure could not be built.
    #[error(transparent)]
    Accel(#[from] AccelError),
}

fn did_you_mean(name: &Option<String>) -> String {
    name.as_ref().map(|n| format!(" (did you mean `{n}`?)")).unwrap_or_default()
}

fn list(names: &[&String]) -> String {
    if names.is_empty() {
        return "none is defined".to_owned();
    }
    const SHOWN: usize = 12;
    let mut text = names.iter().take(SHOWN).map(|n| n.as_str()).collect::<Vec<_>>().join(", ");
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
    pub(super) fn new(names: impl IntoIterator<Item = String>) -> Self {
        let names: Vec<String> = names.into_iter().collect();
        let indices = (0u32..).zip(&names).map(|(i, n)| (n.clone(), i)).collect();
        Self { indices, names }
    }

    pub(super) fn name(&self, index: u32) -> &str {
        &self.names[index as usize]
    }

    pub(super) fn find(
        &self,
        reference: &Reference,
        kind: &'static str,
    ) -> Result<u32, SceneError> {
        self.indices.get(&reference.name).copied().ok_or_else(|| {
            let distance = |name: &&String| strsim::damerau_levenshtein(name, &reference.name);
            let named: Vec<&String> = self.names.iter().filter(|name| !is_hidden(name)).collect();
            let similar = named.iter().copied().min_by_key(distance).filter(|n| distance(n) <= 2);
            SceneError::UnknownName(Box::new(UnknownName {
                at: reference.at.clone(),
                kind,
                name: reference.name.clone(),
                similar: similar.cloned(),
                accepted: list(&named),
            }))
        })
    }
}

impl Scene {
    /// Checks a description and makes it ready. `options` say how to build; precision and quality are
    /// taken from the scene's settings, and how many rays to expect where that is not given. `progress` hears of
    /// the build from 0 to 1, perhaps on several threads at once, and ends it by returning false.
    ///
    /// # Errors
    /// Every mistake that was found.
    pub fn build(
        mut desc: SceneDesc,
        options: &BuildOptions,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Self, Vec<SceneError>> {
        add_surfaces(&mut desc);
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
        // Index 0 is the neutral default.
        let mut maps = vec![Maps::default()];
        maps.extend(desc.materials.iter().map(|material| material.maps.clone()));
        if let Some(filter) = desc.settings.texture_filter {
            maps.iter_mut().for_each(|maps| maps.filter_pictures(filter));
        }
        errors.extend(check_materials(&desc));
        errors.extend(check_volumes(&desc.volumes));
        let glows: Vec<bool> = [false]
            .into_iter()
            .chain(desc.materials.iter().map(|m| !m.emission.is_black()))
            .collect();
        let default_projection = Projection::Perspective { fov: DEFAULT_FOV.to_radians() };
        let tessellations = tessellate(&mut desc, &prototype_names, pose, default_projection)
            .unwrap_or_else(|more| {
                errors.extend(more);
                Vec::new()
            });
        let mut clear = Vec::new();
        if has_clear_shadows(&desc.settings, desc.materials.iter().map(|m| &m.material)) {
            clear.push(false);
            clear.extend(desc.materials.iter().map(|m| m.material.is_glass()));
        }
        let object_names = desc.objects.iter().map(|object| object.name.clone()).collect();
        let placed = place(&mut desc, &material_names, &prototype_names, &maps, &glows, &clear);
        let placed = match placed {
            Ok(placed) if errors.is_empty() => placed,
            Ok(_) => return Err(errors),
            Err(more) => {
                errors.extend(more);
                return Err(errors);
            }
        };

        let mut emissions = vec![Emission::NONE];
        emissions.extend(desc.materials.iter().map(Emission::of));
        if emissions.iter().all(|e| e.radiance.is_black()) {
            emissions.clear();
        }
        let glowing = glowing_objects(&placed, &emissions).map_err(|e| vec![e])?;
        let has_own_light =
            !desc.lights.is_empty() || desc.ambient.is_some() || !glowing.is_empty();
        let Placed { world, root_looks, prototype_looks, copy_objects, frames, center } = placed;

        let volumes = placed_volumes(&desc.volumes, center);
        let bounds = volumes.iter().map(Volume::bounds).fold(world.bounds(), Bounds::union);
        let size = desc.image.size;
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let mut projection = desc.camera.as_ref().map_or(default_projection, |c| c.projection);
        let pose = match pose {
            Some(pose) => pose.translated(-center),
            None => {
                let support = |directions: [DVec3; 4]| {
                    let corners = volumes.iter().flat_map(Volume::corners);
                    corners.fold(world.support(directions), |reach, p| {
                        std::array::from_fn(|i| reach[i].max(directions[i].dot(p)))
                    })
                };
                let (pose, height) =
                    Camera::frame(support, DVec3::new(-0.6, -0.45, -1.0), projection, aspect);
                if let Projection::Orthographic { height: h @ 0.0 } = &mut projection {
                    *h = height;
                }
                pose
            }
        };
        let lens = desc.camera.as_ref().and_then(|camera| lens(camera, &pose, center, &bounds));
        // Rays of a far camera start at the scene's box, if all that they may hit is in it.
        let start = if world.is_endless() { Bounds::EMPTY } else { bounds };
        let mut camera = Camera::new(pose, projection, lens, size, start);
        if desc.fog.is_some() {
            camera.keep_all_rays();
        }

        // A scene without light of its own is lit from the camera's side.
        let lights = if has_own_light {
            let mut lights = written_lights(&desc.lights, center);
            lights.extend(glowing);
            lights
        } else {
            default_lights(&pose)
        };
        let ambient = desc.ambient.unwrap_or(Rgb::splat(if has_own_light { 0.0 } else { 0.15 }));
        let default_background = if has_own_light { Rgb::BLACK } else { Rgb::splat(0.06) };
        let light_tree = Some(LightTree::new(&lights))
            .filter(|tree| tree.len() > desc.settings.light_samples as usize);

        let material_names = ["default".to_owned()]
            .into_iter()
            .chain(desc.materials.iter().map(|m| m.name.clone()))
            .collect();
        let mut materials = vec![Material::Diffuse { reflectance: Rgb::splat(0.6) }];
        materials.extend(desc.materials.into_iter().map(|m| m.material));
        if maps.iter().all(Maps::is_empty) {
            maps.clear();
        }
        let fog = desc.fog.map(|fog| recentred(fog, center));
        let requirements = Requirements::of(&Contents {
            world: &world,
            materials: &materials,
            maps: &maps,
            lights: &lights,
            picks_lights: light_tree.is_some(),
            glows: !emissions.is_empty(),
            fog: fog.is_some(),
            volumes: volumes.len(),
            lens: lens.is_some(),
            settings: &desc.settings,
            lit_automatically: !has_own_light,
        });

        let mut options = BuildOptions {
            precision: desc.settings.precision,
            quality: desc.settings.build_quality,
            ..options.clone()
        };
        if options.expected_rays.is_none() {
            let rays = requirements.expected_rays(size, &desc.settings);
            options.expected_rays = Some(rays);
            if let [Geometry::Mesh(mesh)] = world.root.geometries.as_slice()
                && options.rays_decide(&world, &world.root)
            {
                let share = coverage(mesh, &camera, size);
                options.expected_rays = Some((rays as f64 * share) as u64);
            }
        }
        let memory_estimate =
            options.fit(&world, desc.settings.compact).map_err(|e| vec![e.into()])?;
        let accel = Accel::build(&world, &options, progress).map_err(|e| vec![e.into()])?;
        let mut scene = Self {
            size,
            background: desc.image.background.unwrap_or(default_background),
            ambient,
            camera,
            lights,
            light_tree,
            fog,
            volumes,
            camera_interior: Interior::OUTSIDE,
            settings: desc.settings,
            requirements,
            tessellations,
            center,
            bounds,
            accel,
            memory_estimate,
            build_quality: options.quality_of(&world, &world.root),
            is_compact: options.compact,
            hollows: Hollows::default(),
            world,
            materials,
            emissions,
            maps,
            frames,
            root_looks,
            prototype_looks,
            copy_objects,
            object_names,
            material_names,
        };
        if scene.requirements.dielectrics > 0 {
            scene.camera_interior = scene.interior_at(scene.camera.pose().eye);
        }
        if scene.settings.integrator == IntegratorKind::Whitted
            && scene.requirements.dielectrics > 0
        {
            let is_glass = |id: SphereId| {
                let look = scene.root_looks[id.geometry as usize].of(id.primitive);
                matches!(scene.materials[look.material as usize], Material::Dielectric(_))
            };
            scene.hollows = Hollows::of(&scene.world, is_glass);
        }
        Ok(scene)
    }

    /// As [`Scene::build`] with the default structure and no progress: for tests and small programs.
    ///
    /// # Errors
    /// As [`Scene::build`].
    pub fn build_quietly(desc: SceneDesc, kind: AccelKind) -> Result<Self, Vec<SceneError>> {
        Self::build(desc, &BuildOptions { kind, ..BuildOptions::default() }, &|_| true)
    }

    /// The looks of what was hit.
    #[inline]
    pub(super) fn look(&self, hit: &Hit) -> Look {
        let looks = match hit.copy {
            None => &self.root_looks,
            Some(copy) => {
                &self.prototype_looks[self.world.sets[copy.set as usize].prototype as usize]
            }
        };
        looks[hit.geometry as usize].of(hit.primitive)
    }

    /// The number of the object that was hit, among [`Scene::object_names`]: of a copy, the one that
    /// placed it, however deep it is nested.
    pub fn object_index(&self, hit: &Hit) -> u32 {
        match hit.copy {
            None => self.look(hit).object,
            Some(copy) => self.copy_objects[copy.set as usize].of(copy.index),
        }
    }

    /// The number of the material that was hit, among [`Scene::material_names`].
    pub fn material_index(&self, hit: &Hit) -> u32 {
        self.look(hit).material
    }

    /// The names of the scene's objects; several may be called the same.
    pub fn object_names(&self) -> &[String] {
        &self.object_names
    }

    /// The names of its materials, of which the first is the neutral default.
    pub fn material_names(&self) -> &[String] {
        &self.material_names
    }

    /// The material of what was hit.
    #[inline]
    pub fn material(&self, hit: &Hit) -> &Material {
        &self.materials[self.look(hit).material as usize]
    }

    /// The radiance that a surface gives off towards the viewer.
    #[inline]
    pub fn emission(&self, point: &SurfacePoint<'_>) -> Rgb {
        match self.emissions.get(point.material_index as usize) {
            Some(emission) if point.is_front || emission.is_two_sided => emission.radiance,
            _ => Rgb::BLACK,
        }
    }

    /// Whether any material has textures.
    #[inline]
    pub fn has_maps(&self) -> bool {
        !self.maps.is_empty()
    }

    /// How textures that are pictures are filtered, each.
    pub fn texture_filters(&self) -> impl Iterator<Item = TexelFilter> {
        self.maps.iter().flat_map(Maps::texture_filters)
    }

    /// By which law each material reflects that reflects by one.
    pub fn fresnel_models(&self) -> impl Iterator<Item = FresnelModel> {
        self.materials.iter().filter_map(|material| match material {
            Material::Dielectric(glass) => Some(glass.fresnel),
            Material::Conductor(metal) => Some(metal.fresnel),
            Material::Mirror { fresnel, .. } | Material::Phong(Phong { fresnel, .. }) => {
                fresnel.map(|law| law.model)
            }
            Material::Diffuse { .. } => None,
        })
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

/// The lens of a camera, in focus at its target where nothing else is said; without a target, at the
/// middle of the scene.
fn lens(camera: &CameraDesc, pose: &Pose, center: DVec3, bounds: &Bounds) -> Option<Lens> {
    let LensDesc { radius, focus_distance } = camera.lens?;
    let along_view = |p: DVec3| (p - pose.eye).dot(pose.forward);
    let default = match camera.place {
        Some(PlaceDesc::LookAt { target, .. }) => along_view(target - center),
        _ => along_view(bounds.center()),
    };
    let default = if default > 0.0 { default } else { 1.0 };
    Some(Lens { radius, focus_distance: focus_distance.unwrap_or(default) })
}

/// Fog in the scene's own coordinates.
fn recentred(mut fog: Fog, center: DVec3) -> Fog {
    if let FogProfile::Height { base, .. } = &mut fog.profile {
        *base -= center.y;
    }
    fog
}

/// Mistakes that only the list of materials as a whole shows.
fn check_materials(desc: &SceneDesc) -> Option<SceneError> {
    let limit = usize::from(u16::MAX) - 1;
    let (index, last) = desc.materials.iter().enumerate().rfind(|(_, m)| m.material.is_glass())?;
    let name = last.name.clone();
    (index >= limit).then_some(SceneError::TooManyMaterials { name, index, limit })
}
