//! What a scene requires of a renderer: what is absent is not allocated, not tested, not traced.

use crate::accel::{Geometry, World};
use crate::light::{Falloff, Light};
use crate::material::Material;
use crate::scene::desc::{IntegratorKind, RenderSettings};

/// The things that a scene really has.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Requirements {
    /// Triangles stored, in all groups.
    pub triangles: u64,
    /// Spheres stored.
    pub spheres: u64,
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
    /// Point lights with inverse-square falloff.
    pub point_lights: u64,
    /// Point lights without falloff.
    pub lecture_lights: u64,
    /// Directional lights.
    pub directional_lights: u64,
    /// Spot lights.
    pub spot_lights: u64,
    /// Lights of some size.
    pub area_lights: u64,
    /// Whether the scene has no light of its own and is lit from the camera's side.
    pub lit_automatically: bool,
    /// Whether shadow rays are traced.
    pub shadow_rays: bool,
}

impl Requirements {
    pub(super) fn of(
        world: &World,
        materials: &[Material],
        lights: &[Light],
        settings: &RenderSettings,
        lit_automatically: bool,
    ) -> Self {
        let mut r = Self { lit_automatically, ..Self::default() };
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
                Geometry::Spheres(spheres) => r.spheres += spheres.len() as u64,
            }
        }
        r.prototypes = world.prototypes.len() as u64;
        r.drawn_primitives = primitives(&world.root);
        for set in &world.sets {
            let copies = set.transforms.len() as u64;
            r.copies += copies;
            r.drawn_primitives += copies * primitives(&world.prototypes[set.prototype as usize]);
        }
        for material in materials {
            if let Material::Phong(phong) = material {
                r.specular_materials += u64::from(!phong.specular.is_black());
            }
        }
        for light in lights {
            match light {
                Light::Point(light) if light.falloff == Falloff::None => r.lecture_lights += 1,
                Light::Point(_) => r.point_lights += 1,
                Light::Directional(_) => r.directional_lights += 1,
                Light::Spot(_) => r.spot_lights += 1,
                Light::Rectangle(_) | Light::Disk(_) | Light::Sphere(_) | Light::Mesh(_) => {
                    r.area_lights += 1;
                }
            }
        }
        r.shadow_rays =
            settings.shadows && settings.integrator != IntegratorKind::Flat && !lights.is_empty();
        r
    }
}
