//! Grids of data along the rays of the tree.

use super::{Features, Node, Walk};
use crate::accel::RayQuery;
use crate::color::Rgb;
use crate::math::Ray;
use crate::medium::beer_lambert;
use crate::medium::volume::{march, transmittance_through};

impl<Q: RayQuery, F: Features> Walk<'_, Q, F> {
    /// As [`Walk::through_media`] where there are volumes: what they add is dimmed by fog or coloured glass
    /// before it, and they dim the fog's light. Both are taken as constant over each part of the way between
    /// faces of cells, in the middle of it.
    pub(super) fn through_volumes(&mut self, node: &Node, distance: f32) -> Rgb {
        let scene = self.scene;
        let (o, d) = (node.ray.origin.as_dvec3(), node.ray.direction.as_dvec3());
        let glass = scene.medium(node.interior).map(|glass| glass.absorption);
        let fog = scene.fog.as_ref().filter(|_| node.interior.is_outside());
        let white = Rgb::splat(1.0);
        // What glass and fog leave of the light of a place.
        let of_media = |t: f64| {
            let t = t as f32;
            let glass = glass.map_or(white, |absorption| beer_lambert(absorption, t));
            glass * fog.map_or(white, |fog| fog.transmittance_after(node.before, &node.ray, t))
        };
        // The fog's light between places that leave `near` and `far`.
        let haze = |near: Rgb, far: Rgb| {
            let between = near.zip(far, |near, far| near - far);
            fog.map_or(Rgb::BLACK, |fog| fog.in_scattered(between.map(|x| 1.0 - x)))
        };
        let has_media = fog.is_some() || glass.is_some_and(|absorption| !absorption.is_black());
        let (mut light, mut passed, mut near) = (Rgb::BLACK, 1.0, white);
        march(&scene.volumes, o, d, f64::from(distance), |slab| {
            let glow = Rgb::from(slab.light.map(|x| x as f32));
            passed = slab.after as f32;
            if !has_media {
                light += glow;
                return;
            }
            let [from, middle, to] = [slab.t0, 0.5 * (slab.t0 + slab.t1), slab.t1].map(of_media);
            light += glow * middle + haze(near, from) * slab.before as f32;
            light += haze(from, to) * (0.5 * (slab.before + slab.after)) as f32;
            near = to;
        });
        if has_media {
            let end = of_media(f64::from(distance));
            light += haze(near, end) * passed;
            near = end;
        }
        self.radiance[node.lane as usize] += node.throughput * light;
        node.throughput * near * passed
    }

    /// The share of a light's sample that volumes leave on its way along a shadow ray.
    #[inline]
    pub(super) fn passes_volumes(&self, ray: &Ray) -> f32 {
        if !F::EVERYTHING
            || self.scene.volumes.is_empty()
            || !self.scene.settings.shadows.are_cast()
        {
            return 1.0;
        }
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        transmittance_through(&self.scene.volumes, o, d, f64::from(ray.t_max)) as f32
    }
}
