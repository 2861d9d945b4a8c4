//! What the middles of pixels show: one ray each, through the middle of the lens, whatever the samples are.

use glam::DVec2;
use rayon::prelude::*;

use crate::accel::{Hit, RayQuery};
use crate::film::{Aov, CenterLayers, PixelRect};
use crate::math::Ray;
use crate::scene::Scene;

/// What [`Aov::Depth`] says of a ray that meets nothing: beyond all that compositors look at, and a sound
/// number.
const NOTHING: f32 = 1e10;

/// What one pixel shows.
struct Center {
    depth: f32,
    position: [f32; 3],
    uv: [f32; 2],
    object_id: f32,
    material_id: f32,
}

impl Center {
    const EMPTY: Self =
        Self { depth: NOTHING, position: [0.0; 3], uv: [0.0; 2], object_id: 0.0, material_id: 0.0 };

    fn of(scene: &Scene, ray: &Ray, hit: &Hit, has_uv: bool) -> Self {
        let point = scene.surface(ray, hit);
        let pose = scene.camera.pose();
        let position = point.position.as_dvec3();
        Self {
            depth: (position - pose.eye).dot(pose.forward) as f32,
            position: (position + scene.center).as_vec3().to_array(),
            uv: if has_uv { scene.texture_coordinates(hit, &point).to_array() } else { [0.0; 2] },
            object_id: (scene.object_index(hit) + 1) as f32,
            material_id: (scene.material_index(hit) + 1) as f32,
        }
    }
}

/// The layers of the middles of pixels that are `wanted`; nothing is traced where none is.
pub(super) fn center_layers(
    scene: &Scene,
    query: &impl RayQuery,
    window: &PixelRect,
    wanted: &[Aov],
) -> CenterLayers {
    if !wanted.iter().any(|aov| aov.is_of_center()) {
        return CenterLayers::default();
    }
    let has = |aov| wanted.contains(&aov);
    let width = window.width();
    let pixel = |index: usize| {
        let (x, y) = (window.x0 + index as u32 % width, window.y0 + index as u32 / width);
        let film = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let ray = scene.camera.ray(film, [0.5; 2])?;
        let hit = query.intersect(&ray)?;
        Some(Center::of(scene, &ray, &hit, has(Aov::Uv)))
    };
    let pixels: Vec<Center> = (0..window.area())
        .into_par_iter()
        .with_min_len(1 << 10)
        .map(|index| pixel(index).unwrap_or(Center::EMPTY))
        .collect();
    fn plane<T>(is_wanted: bool, pixels: &[Center], value: impl Fn(&Center) -> T) -> Vec<T> {
        if is_wanted { pixels.iter().map(value).collect() } else { Vec::new() }
    }
    CenterLayers {
        depth: plane(has(Aov::Depth), &pixels, |p| p.depth),
        position: plane(has(Aov::Position), &pixels, |p| p.position),
        uv: plane(has(Aov::Uv), &pixels, |p| p.uv),
        object_id: plane(has(Aov::ObjectId), &pixels, |p| p.object_id),
        material_id: plane(has(Aov::MaterialId), &pixels, |p| p.material_id),
    }
}
