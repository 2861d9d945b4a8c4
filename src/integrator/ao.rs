//! Ambient occlusion: how much of its surroundings a point sees. A cheap look at shapes, without lights.

use super::{CameraBlock, Integrator, RayCounts};
use crate::accel::{LANES, RayQuery};
use crate::color::Rgb;
use crate::math::cosine_hemisphere;
use crate::sampler::Dimensions;
use crate::scene::Scene;

/// 1 where a ray drawn in proportion to the cosine meets nothing within `ao_distance`, 0 where it does:
/// on average the share (1/π)·∫ V cos θ dω.
#[derive(Debug, Clone, Copy)]
pub struct Ao;

impl Integrator for Ao {
    fn shade<Q: RayQuery>(
        &self,
        scene: &Scene,
        query: &Q,
        camera: &CameraBlock<'_>,
        counts: &mut RayCounts,
    ) -> [Rgb; LANES] {
        let distance = scene.settings.ao_distance.map_or(f32::INFINITY, |d| d as f32);
        std::array::from_fn(|lane| {
            let Some(hit) = camera.hits.get(lane) else { return scene.background };
            let point = scene.surface(&camera.rays.get(lane), hit);
            let [u, v, ..] = camera.samplers[lane].four(Dimensions::Direction);
            let direction = cosine_hemisphere(point.normal, [u, v]);
            // Below the surface, whatever its shading normal says.
            if direction.dot(point.geometric_normal) <= 0.0 {
                return Rgb::BLACK;
            }
            counts.diffuse += 1;
            let blocked = query.occluded(&scene.spawn(&point, direction, distance));
            if blocked { Rgb::BLACK } else { Rgb::splat(1.0) }
        })
    }
}
