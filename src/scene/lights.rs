//! Lights of a scene: those that were written as lights, of which some are shapes that are seen, and
//! objects that glow.

use std::sync::Arc;

use glam::DVec3;

use super::build::SceneError;
use super::desc::{LightDesc, Location, MaterialDesc, ObjectDesc, Reference, SceneDesc, ShapeDesc};
use super::draft::GeometryLooks;
use super::place::Placed;
use super::solids::uniform_scale;
use crate::accel::{Geometry, affine_from_rows};
use crate::camera::Pose;
use crate::color::Rgb;
use crate::geometry::{Shapes, TriangleMesh};
use crate::light::{
    DirectionalLight, DiskLight, Light, MeshLight, PointLight, RectangleLight, ShapeLight,
    SphereLight, SpotLight,
};
use crate::material::Material;

/// Names that begin like this are ours: no person can write them.
const HIDDEN: char = '\0';

/// How even the scales of a copy must be: it is in f32.
const COPIES_ARE_EVEN: f64 = 1e-5;

/// Triangles of glowing objects in all, copies counted each.
const MAX_TRIANGLES: u64 = 20_000_000;

/// The light that a material gives off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Emission {
    pub(super) radiance: Rgb,
    /// Whether it glows on its back too.
    pub(super) is_two_sided: bool,
    /// Whether it is the surface of a light that stands among the lights already.
    is_light: bool,
}

impl Emission {
    pub(super) const NONE: Self =
        Self { radiance: Rgb::BLACK, is_two_sided: false, is_light: false };

    pub(super) fn of(material: &MaterialDesc) -> Self {
        let is_light = is_hidden(&material.name);
        Self { radiance: material.emission, is_two_sided: !is_light, is_light }
    }
}

/// Whether a name is one of ours.
pub(super) fn is_hidden(name: &str) -> bool {
    name.starts_with(HIDDEN)
}

/// Adds the surfaces of lights that have one to the objects: black, and glowing on their front.
pub(super) fn add_surfaces(desc: &mut SceneDesc) {
    for (index, light) in desc.lights.iter().enumerate() {
        let (shape, radiance) = match *light {
            LightDesc::Rectangle { corner, edge_u, edge_v, radiance } => {
                // Halves along the diagonal; in f64 until it is placed.
                let origin = corner + 0.5 * (edge_u + edge_v);
                let corners = [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v];
                let xyz = corners.iter().flat_map(|p| (*p - origin).as_vec3().to_array()).collect();
                let mesh = TriangleMesh::new(xyz, vec![[0, 1, 2], [0, 2, 3]]);
                desc.meshes.push(TriangleMesh { origin, ..mesh });
                (ShapeDesc::Mesh(desc.meshes.len() - 1), radiance)
            }
            LightDesc::Disk { center, normal, radius, radiance } => {
                (ShapeDesc::Disk { center, normal, radius, inner_radius: 0.0 }, radiance)
            }
            LightDesc::Sphere { center, radius, radiance } => {
                (ShapeDesc::Sphere { center, radius }, radiance)
            }
            _ => continue,
        };
        let name = format!("{HIDDEN}{index}");
        let black = Material::Diffuse { reflectance: Rgb::BLACK };
        let mut object = ObjectDesc::new(shape, None);
        object.name = format!("light.{index}");
        object.material = Some(Reference::new(name.clone()));
        desc.objects.push(object);
        desc.materials.push(MaterialDesc { emission: radiance, ..MaterialDesc::new(name, black) });
    }
}

/// The lights that were written, relative to the scene's centre.
pub(super) fn written_lights(descs: &[LightDesc], center: DVec3) -> Vec<Light> {
    let light = |desc: &LightDesc| match *desc {
        LightDesc::Point { position, intensity, falloff } => {
            Light::Point(PointLight { position: position - center, intensity, falloff })
        }
        LightDesc::Spot { position, direction, intensity, cone_angle, penumbra_angle } => {
            Light::Spot(SpotLight {
                position: position - center,
                direction: direction.normalize(),
                intensity,
                cos_outer: cone_angle.cos(),
                cos_inner: (cone_angle - penumbra_angle).max(0.0).cos(),
            })
        }
        LightDesc::Directional { direction, irradiance } => Light::Directional(DirectionalLight {
            direction: direction.normalize().as_vec3(),
            irradiance,
        }),
        LightDesc::Rectangle { corner, edge_u, edge_v, radiance } => {
            Light::Rectangle(RectangleLight { corner: corner - center, edge_u, edge_v, radiance })
        }
        LightDesc::Disk { center: c, normal, radius, radiance } => Light::Disk(DiskLight {
            center: c - center,
            normal: normal.normalize(),
            radius,
            radiance,
        }),
        LightDesc::Sphere { center: c, radius, radiance } => {
            Light::Sphere(SphereLight { center: c - center, radius, radiance })
        }
    };
    descs.iter().map(light).collect()
}

/// The lights that objects of glowing materials are, one for each object or copy.
pub(super) fn glowing_objects(
    placed: &Placed,
    emissions: &[Emission],
) -> Result<Vec<Light>, SceneError> {
    let mut lights = Vec::new();
    if emissions.iter().all(|e| e.is_light || e.radiance.is_black()) {
        return Ok(lights);
    }
    let mut triangles = 0u64;
    let world = &placed.world;
    let mut add = |geometry: &Geometry, looks: &GeometryLooks, rows: Option<&_>| {
        let glow = |primitive: usize| {
            let emission = emissions[looks.of(primitive as u32).material as usize];
            (!emission.is_light && !emission.radiance.is_black()).then_some(emission)
        };
        let m = rows.map(affine_from_rows).unwrap_or_default();
        match geometry {
            Geometry::Mesh(mesh) => {
                if mesh.triangles.is_empty() {
                    return Ok(());
                }
                let Some(emission) = glow(0) else { return Ok(()) };
                triangles += mesh.triangles.len() as u64;
                if triangles > MAX_TRIANGLES {
                    return Err(SceneError::TooManyGlowing { limit: MAX_TRIANGLES });
                }
                let corners = |i: usize| mesh.corners(i).map(|p| m.transform_point3(p.as_dvec3()));
                let all: Arc<[_]> = (0..mesh.triangles.len()).map(corners).collect();
                let light = MeshLight::new(all, emission.radiance, emission.is_two_sided);
                lights.push(Light::Mesh(light));
            }
            Geometry::Shapes(shapes) => {
                let scale = uniform_scale(&m.matrix3, COPIES_ARE_EVEN);
                for i in 0..shapes.len() {
                    let Some(Emission { radiance, .. }) = glow(i) else { continue };
                    // Spheres are sampled by the angle that they are seen at.
                    let light = match (shapes, scale) {
                        (Shapes::Spheres(spheres), Some(scale)) => {
                            let center = m.transform_point3(spheres[i].center);
                            let radius = spheres[i].radius * scale;
                            Light::Sphere(SphereLight { center, radius, radiance })
                        }
                        _ => {
                            let light = ShapeLight::new(shapes, i, m, radiance);
                            let at = Location::default();
                            Light::Shape(light.ok_or(SceneError::CannotGlow { at })?)
                        }
                    };
                    lights.push(light);
                }
            }
        }
        Ok(())
    };
    for (geometry, looks) in world.root.geometries.iter().zip(&placed.root_looks) {
        add(geometry, looks, None)?;
    }
    for set in &world.sets {
        let prototype = set.prototype as usize;
        let looks = &placed.prototype_looks[prototype];
        for rows in set.transforms.iter() {
            for (geometry, looks) in world.prototypes[prototype].geometries.iter().zip(looks) {
                add(geometry, looks, Some(rows))?;
            }
        }
    }
    Ok(lights)
}

/// A key light over the camera's left shoulder and a weaker fill from its right.
pub(super) fn default_lights(pose: &Pose) -> Vec<Light> {
    let towards = |right: f64, up: f64, forward: f64, irradiance: f32| {
        let direction = pose.right * right + pose.up * up + pose.forward * forward;
        Light::Directional(DirectionalLight {
            direction: direction.normalize().as_vec3(),
            irradiance: Rgb::splat(irradiance),
        })
    };
    vec![towards(0.55, -0.75, 1.0, 2.6), towards(-0.9, -0.25, 0.6, 1.0)]
}
