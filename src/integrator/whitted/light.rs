//! Direct light at the hits: which lights, where on them, and whether it arrives.

use super::{Features, Hits, Node, Walk};
use crate::accel::{LANES, RayBlock, RayQuery};
use crate::color::Rgb;
use crate::light::{Light, LightSample};
use crate::math::Ray;
use crate::sampler::Dimensions;
use crate::scene::SurfacePoint;

/// Branches of a node's sampler: lights of a loop take their own index.
const CHOICE: u32 = 1 << 31;

impl<Q: RayQuery, F: Features> Walk<'_, Q, F> {
    /// What a surface sends towards the ray of the light of lamps without size, where the scene has no others.
    #[inline]
    pub(super) fn lamps(&mut self, node: &Node, point: &SurfacePoint<'_>) -> Rgb {
        let scene = self.scene;
        let mut light = Rgb::BLACK;
        for lamp in &scene.lights {
            let Some(sample) = lamp.sample(point.position, [0.5; 2]) else { continue };
            if sample.direction.dot(point.geometric_normal) <= 0.0 {
                continue;
            }
            let response =
                point.material.response(point.normal, -node.ray.direction, sample.direction);
            if response.is_black() {
                continue;
            }
            let ray = scene.spawn(point, sample.direction, sample.distance);
            if !scene.settings.shadows.are_cast() || self.arrives(&ray, node).is_some() {
                light += response * sample.irradiance;
            }
        }
        light
    }

    /// Adds the light that arrives at the hits from all lights.
    #[inline]
    pub(super) fn light<const N: usize>(&mut self, hits: &Hits<'_, N>, nodes: &[Node; N]) {
        let is_lit = |lane: &usize| hits.get(*lane).is_some_and(|(_, m)| m.is_lit());
        let lit = (0..N).filter(is_lit).fold(0u16, |bits, lane| bits | 1 << lane);
        if lit == 0 {
            return;
        }
        let scene = self.scene;
        // Where there is a tree, those that are everywhere alike stand outside.
        let count = scene.light_tree.as_ref().map_or(scene.lights.len(), |t| t.always().len());
        for i in 0..count {
            let index = scene.light_tree.as_ref().map_or(i as u32, |tree| tree.always()[i]);
            let light = &scene.lights[index as usize];
            if light.is_delta() {
                self.cast::<N>(lit, hits, nodes, true, |lane| {
                    light.sample(hits.points[lane].as_ref()?.position, [0.5; 2])
                });
                continue;
            }
            let n = scene.settings.shadow_samples;
            for k in 0..n {
                self.cast::<N>(lit, hits, nodes, false, |lane| {
                    let sampler = nodes[lane].sampler.branch(index).split(k, n);
                    let [u, v, ..] = sampler.four(Dimensions::Light);
                    let origin = scene.departure(hits.points[lane].as_ref()?);
                    Some(scaled(light.sample(origin, [u, v])?, 1.0 / n as f32))
                });
            }
        }
        let Some(tree) = &scene.light_tree else { return };
        let n = scene.settings.light_samples;
        for k in 0..n {
            self.cast::<N>(lit, hits, nodes, false, |lane| {
                let point = hits.points[lane].as_ref()?;
                let sampler = nodes[lane].sampler.branch(CHOICE).split(k, n);
                let [u, v, which, _] = sampler.four(Dimensions::Light);
                let picked = tree.sample(point.position, Some(point.normal), which)?;
                let light: &Light = &scene.lights[picked.index as usize];
                let origin = scene.departure(point);
                let sample = light.sample(origin, [u, v])?;
                Some(scaled(sample, 1.0 / (n as f32 * picked.probability)))
            });
        }
    }

    /// Adds one light sample for each of the `lit` lanes, if nothing is in between. `is_coherent` says
    /// that the shadow rays of neighbours run close together.
    #[inline]
    fn cast<const N: usize>(
        &mut self,
        lit: u16,
        hits: &Hits<'_, N>,
        nodes: &[Node; N],
        is_coherent: bool,
        sample: impl Fn(usize) -> Option<LightSample>,
    ) {
        let scene = self.scene;
        let in_packets = N == LANES && is_coherent && !self.is_tinted();
        let mut packet = in_packets.then(RayBlock::empty);
        let mut shadow_rays = [const { Ray::new(glam::Vec3::ZERO, glam::Vec3::ZERO) }; N];
        let mut unshadowed = [Rgb::BLACK; N];
        let mut waiting = 0u16;
        for lane in (0..N).filter(|lane| lit >> lane & 1 == 1) {
            let Some((point, material)) = hits.get(lane) else { continue };
            let Some(sample) = sample(lane) else { continue };
            // Light from behind the surface itself, whatever its shading normal says.
            if sample.direction.dot(point.geometric_normal) <= 0.0 {
                continue;
            }
            let node = &nodes[lane];
            let response = material.response(point.normal, -node.ray.direction, sample.direction);
            if response.is_black() {
                continue;
            }
            let ray = scene.spawn(point, sample.direction, sample.distance);
            let mut light = response * sample.irradiance * hits.weights[lane];
            if let Some(fog) = &scene.fog
                && fog.dims_lights
                && sample.distance.is_finite()
                && node.interior.is_outside()
            {
                light *= fog.transmittance(&ray, sample.distance);
            }
            if !scene.volumes.is_empty() && scene.settings.shadows.are_cast() {
                // Also where a packet says what is occluded.
                shadow_rays[lane] = ray;
            }
            unshadowed[lane] = light;
            waiting |= 1 << lane;
            match &mut packet {
                Some(packet) => packet.set(lane, &ray),
                None => shadow_rays[lane] = ray,
            }
        }
        if waiting == 0 {
            return;
        }
        let casts_shadows = scene.settings.shadows.are_cast();
        let mut occluded = 0;
        if casts_shadows && let Some(packet) = &packet {
            self.counts.shadow += u64::from(waiting.count_ones());
            occluded = Self::blocked(scene, self.query, packet);
        }
        for lane in (0..N).filter(|lane| waiting >> lane & 1 == 1) {
            let to = nodes[lane].lane as usize;
            if packet.is_some() || !casts_shadows {
                if occluded >> lane & 1 == 0 {
                    self.radiance[to] += unshadowed[lane] * self.passes_volumes(&shadow_rays[lane]);
                }
            } else if let Some(transmittance) = self.arrives(&shadow_rays[lane], &nodes[lane]) {
                self.radiance[to] +=
                    unshadowed[lane] * transmittance * self.passes_volumes(&shadow_rays[lane]);
            }
        }
    }
}

fn scaled(sample: LightSample, by: f32) -> LightSample {
    LightSample { irradiance: sample.irradiance * by, ..sample }
}
