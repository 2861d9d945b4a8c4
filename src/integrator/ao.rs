//! Ambient occlusion: how much of its surroundings a point sees. A cheap look at shapes, without lights.

use super::{CameraBlock, Integrator, RayCounts};
use crate::accel::{LANES, RayQuery};
use crate::color::{Rgb, RgbLanes};
use crate::math::{Vec3Lanes, cosine_hemisphere, lanes_where};
use crate::sampler::{Dimensions, Sampler};
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
    ) -> RgbLanes<LANES> {
        let distance = scene.settings.ao_distance.map_or(f32::INFINITY, |d| d as f32);
        let points = scene.surfaces(camera.rays, camera.hits);
        let [u, v] = Sampler::numbers(camera.samplers, Dimensions::Direction);
        let mut directions = Vec3Lanes::ZERO;
        let mut is_above = [false; LANES];
        for i in 0..LANES {
            let direction = cosine_hemisphere(points.normal.get(i), [u[i], v[i]]);
            directions.set(i, direction);
            // Not below the surface, whatever its shading normal says.
            is_above[i] = direction.dot(points.geometric_normal.get(i)) > 0.0;
        }
        let above = lanes_where(&is_above) & points.hit();
        counts.diffuse += u64::from(above.count_ones());
        let rays = scene.spawn_block(&points, &directions, &[distance; LANES], above);
        RgbLanes::from_fn(|lane| match (points.hit() >> lane & 1, above >> lane & 1) {
            (0, _) => scene.background,
            // They spread: packets would be slower.
            (_, 1) if !query.occluded(&rays.get(lane)) => Rgb::splat(1.0),
            _ => Rgb::BLACK,
        })
    }
}
