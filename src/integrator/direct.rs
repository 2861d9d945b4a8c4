//! Local illumination: the lecture's shading equation at the first hit, with hard shadows.

use super::{Integrator, RayCounts};
use crate::accel::{HitBlock, LANES, RayBlock, RayQuery};
use crate::color::Rgb;
use crate::scene::Scene;

/// I = k_a·I_a + Σ_lights V·(k_d·(n·l) + k_s·cosⁿα)·I, V = 0 where something stands in between.
#[derive(Debug, Clone, Copy)]
pub struct Direct;

impl Integrator for Direct {
    fn shade<Q: RayQuery>(
        &self,
        scene: &Scene,
        query: &Q,
        rays: &RayBlock,
        hits: &HitBlock,
        counts: &mut RayCounts,
    ) -> [Rgb; LANES] {
        let points: [_; LANES] = std::array::from_fn(|lane| {
            hits.get(lane).map(|hit| scene.surface(&rays.get(lane), hit))
        });
        let mut radiance = points.each_ref().map(|point| match point {
            Some(point) => point.material.ambient() * scene.ambient,
            None => scene.background,
        });

        for light in &scene.lights {
            let mut shadow_rays = RayBlock::empty();
            let mut unshadowed = [Rgb::BLACK; LANES];
            for (lane, point) in points.iter().enumerate() {
                let Some(point) = point else { continue };
                let Some(sample) = light.sample(point.position, [0.5, 0.5]) else { continue };
                // Light from behind the surface itself, whatever its shading normal says.
                if sample.direction.dot(point.geometric_normal) <= 0.0 {
                    continue;
                }
                let wo = -rays.get(lane).direction;
                let response = point.material.response(point.normal, wo, sample.direction);
                if response.is_black() {
                    continue;
                }
                unshadowed[lane] = response * sample.irradiance;
                if scene.settings.shadows {
                    shadow_rays.set(lane, &scene.spawn(point, sample.direction, sample.distance));
                }
            }
            // The shadow rays of neighbours run close together: one packet.
            let occluded = if shadow_rays.active() == 0 {
                0
            } else {
                counts.shadow += u64::from(shadow_rays.active().count_ones());
                query.occluded_block(&shadow_rays)
            };
            for lane in 0..LANES {
                if occluded >> lane & 1 == 0 {
                    radiance[lane] += unshadowed[lane];
                }
            }
        }
        radiance
    }
}
