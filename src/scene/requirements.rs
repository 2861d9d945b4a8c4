//! What a scene requires of a renderer: what is absent is not allocated, not tested, not traced.

use super::maps::Maps;
use crate::accel::{Geometry, World};
use crate::light::{Falloff, Light};
use crate::material::{Ior, Material};
use crate::scene::desc::{IntegratorKind, RenderSettings, Shadows};

/// The compiled variants of the ray tree, each with all of those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Variant {
    /// Lamps, diffuse and shiny surfaces.
    #[default]
    Local,
    /// And mirrors and glass.
    Tree,
    /// And textures, area lights, many lights, glowing surfaces, fog, volumes, light dimmed by glass,
    /// dispersion.
    Everything,
}

impl Variant {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Local, Self::Tree, Self::Everything];

    /// The name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Local => "local",
            Self::Tree => "tree",
            Self::Everything => "everything",
        }
    }
}

/// The things that a scene really has.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Requirements {
    /// Triangles stored, in all groups.
    pub triangles: u64,
    /// Other shapes stored: what one and what many are called, and how many.
    pub shapes: Vec<([&'static str; 2], u64)>,
    /// Meshes with shading normals.
    pub smooth_meshes: u64,
    /// Groups that are copied.
    pub prototypes: u64,
    /// Copies of them.
    pub copies: u64,
    /// Primitives that rays meet, copies counted each.
    pub drawn_primitives: u64,
    /// Materials with a highlight.
    pub specular_materials: u64,
    /// Materials that mirror: mirrors, metals, `phong` with a mirror coefficient.
    pub mirrors: u64,
    /// Materials of glass.
    pub dielectrics: u64,
    /// Those whose index of refraction depends on the wavelength.
    pub dispersive: u64,
    /// Those that absorb light.
    pub absorbing: u64,
    /// Materials with textures, normal or bump maps.
    pub textured_materials: u64,
    /// Point lights with inverse-square falloff.
    pub point_lights: u64,
    /// Point lights without falloff.
    pub lecture_lights: u64,
    /// Directional lights.
    pub directional_lights: u64,
    /// Spot lights.
    pub spot_lights: u64,
    /// Lights with an area, glowing objects included.
    pub area_lights: u64,
    /// Whether lights are drawn at random, as there are too many to ask each.
    pub picks_lights: bool,
    /// Whether any material glows.
    pub glows: bool,
    /// Whether there is fog.
    pub fog: bool,
    /// Grids that glow and absorb.
    pub volumes: u64,
    /// Whether the camera has a lens.
    pub lens: bool,
    /// Whether the scene has no light of its own and is lit from the camera's side.
    pub lit_automatically: bool,
    /// Whether shadow rays are traced.
    pub shadow_rays: bool,
    /// Whether light passes glass on its way to surfaces.
    pub transparent_shadows: bool,
    /// Whether it does so without loss, so that shadow rays need take no notice of glass.
    pub clear_shadows: bool,
    /// Which variant of the ray tree is run.
    pub variant: Variant,
}

/// Whether there is glass, and light passes all of it without loss on its way to surfaces.
pub(super) fn has_clear_shadows<'a>(
    settings: &RenderSettings,
    materials: impl IntoIterator<Item = &'a Material>,
) -> bool {
    let mut glasses = materials.into_iter().filter_map(|material| match material {
        Material::Dielectric(glass) => Some(glass),
        _ => None,
    });
    settings.shadows == Shadows::Tinted
        && glasses.next().is_some_and(|first| {
            first.absorption.is_black() && glasses.all(|glass| glass.absorption.is_black())
        })
}

/// What a scene is made of.
pub(super) struct Contents<'a> {
    pub(super) world: &'a World,
    pub(super) materials: &'a [Material],
    pub(super) maps: &'a [Maps],
    pub(super) lights: &'a [Light],
    pub(super) picks_lights: bool,
    pub(super) glows: bool,
    pub(super) fog: bool,
    pub(super) volumes: usize,
    pub(super) lens: bool,
    pub(super) settings: &'a RenderSettings,
    pub(super) lit_automatically: bool,
}

impl Requirements {
    pub(super) fn of(contents: &Contents<'_>) -> Self {
        let &Contents { world, materials, maps, lights, settings, .. } = contents;
        let mut r = Self {
            picks_lights: contents.picks_lights,
            glows: contents.glows,
            fog: contents.fog,
            volumes: contents.volumes as u64,
            lens: contents.lens,
            lit_automatically: contents.lit_automatically,
            ..Self::default()
        };
        let primitives = |group: &crate::accel::Group| {
            group.geometries.iter().map(|g| g.len() as u64).sum::<u64>()
        };
        for geometry in
            world.prototypes.iter().chain([&world.root]).flat_map(|group| &group.geometries)
        {
            match geometry {
                Geometry::Mesh(mesh) => {
                    r.triangles += mesh.triangles.len() as u64;
                    r.smooth_meshes += u64::from(mesh.normals.is_some());
                }
                Geometry::Shapes(shapes) => {
                    let (names, count) = (shapes.names(), shapes.len() as u64);
                    match r.shapes.iter_mut().find(|(known, _)| *known == names) {
                        Some((_, total)) => *total += count,
                        None => r.shapes.push((names, count)),
                    }
                }
            }
        }
        r.prototypes = world.prototypes.len() as u64;
        r.drawn_primitives = primitives(&world.root);
        for set in &world.sets {
            let copies = set.transforms.len() as u64;
            r.copies += copies;
            r.drawn_primitives += copies * primitives(&world.prototypes[set.prototype as usize]);
        }
        for (i, material) in materials.iter().enumerate() {
            match material {
                Material::Diffuse { .. } => {}
                Material::Phong(phong) => {
                    r.specular_materials += u64::from(!phong.specular.is_black());
                    // The coefficient may be nothing but a texture.
                    let is_mapped = maps.get(i).is_some_and(|maps| maps.mirror.is_some());
                    r.mirrors += u64::from(is_mapped || !phong.mirror.is_black());
                }
                Material::Mirror { .. } | Material::Conductor(_) => r.mirrors += 1,
                Material::Dielectric(glass) => {
                    r.dielectrics += 1;
                    r.dispersive += u64::from(Ior::is_dispersive(&glass.ior));
                    r.absorbing += u64::from(!glass.absorption.is_black());
                }
            }
        }
        r.textured_materials = maps.iter().filter(|maps| !maps.is_empty()).count() as u64;
        for light in lights {
            match light {
                Light::Point(light) if light.falloff == Falloff::None => r.lecture_lights += 1,
                Light::Point(_) => r.point_lights += 1,
                Light::Directional(_) => r.directional_lights += 1,
                Light::Spot(_) => r.spot_lights += 1,
                _ => r.area_lights += 1,
            }
        }
        let is_lit =
            matches!(settings.integrator, IntegratorKind::Direct | IntegratorKind::Whitted);
        r.shadow_rays = is_lit && settings.shadows != Shadows::None && !lights.is_empty();
        r.transparent_shadows = r.shadow_rays
            && r.dielectrics > 0
            && matches!(settings.shadows, Shadows::Tinted | Shadows::Fresnel);
        r.clear_shadows = r.transparent_shadows && has_clear_shadows(settings, materials);
        r.variant = r.variant(settings);
        r
    }

    /// About how many rays a picture of `size` takes with all its samples, if every camera ray hits something, for
    /// [`BuildOptions::expected_rays`]: those that run close together count a twelfth.
    ///
    /// [`BuildOptions::expected_rays`]: crate::accel::BuildOptions::expected_rays
    pub fn expected_rays(&self, size: [u32; 2], settings: &RenderSettings) -> u64 {
        const WHOLE: u64 = 12;
        // How many it really is, is known when they are traced.
        const OF_A_TREE: u64 = 4 * WHOLE;
        let points =
            self.lecture_lights + self.point_lights + self.directional_lights + self.spot_lights;
        let surfaces = self.area_lights * u64::from(settings.shadow_samples);
        let shadow = match (self.shadow_rays, self.picks_lights) {
            (false, _) => 0,
            (true, true) => WHOLE * u64::from(settings.light_samples),
            (true, false) => points + WHOLE * surfaces,
        };
        let of_a_sample = match settings.integrator {
            IntegratorKind::Flat => 1,
            IntegratorKind::Ao => 1 + WHOLE,
            IntegratorKind::Whitted if self.variant != Variant::Local => OF_A_TREE + 4 * shadow,
            IntegratorKind::Whitted | IntegratorKind::Direct => 1 + shadow,
        };
        let samples = u64::from(size[0]) * u64::from(size[1]);
        samples.saturating_mul(settings.samples.into()).saturating_mul(of_a_sample) / WHOLE
    }

    /// The least variant that knows of all there is.
    fn variant(&self, settings: &RenderSettings) -> Variant {
        let is_tree = settings.integrator == IntegratorKind::Whitted;
        if self.textured_materials > 0
            || self.area_lights > 0
            || self.picks_lights
            || self.glows
            || self.fog
            || self.volumes > 0
            || (self.transparent_shadows && !self.clear_shadows)
            || (is_tree && self.dispersive > 0)
        {
            return Variant::Everything;
        }
        // Even without bounces a camera may stand in glass.
        if self.dielectrics > 0 || (is_tree && self.mirrors > 0) {
            return Variant::Tree;
        }
        Variant::Local
    }
}
