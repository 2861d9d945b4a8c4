//! Shadow rays: what of a light's sample arrives.

use super::{Features, Node, Walk};
use crate::accel::{RayBlock, RayQuery};
use crate::color::Rgb;
use crate::material::{Material, fresnel};
use crate::math::Ray;
use crate::medium::beer_lambert;
use crate::scene::{Scene, Shadows};

/// Surfaces of glass that one shadow ray passes at most.
const MAX_SURFACES: u32 = 1 << 12;

impl<Q: RayQuery, F: Features> Walk<'_, Q, F> {
    /// Whether glass dims light on its way to a surface, neither hiding it nor letting all of it pass.
    #[inline]
    pub(super) fn is_tinted(&self) -> bool {
        let requirements = &self.scene.requirements;
        F::EVERYTHING && requirements.transparent_shadows && !requirements.clear_shadows
    }

    /// Which shadow rays of a block are blocked, where they are so or not at all.
    #[inline]
    pub(super) fn blocked(scene: &Scene, query: &Q, rays: &RayBlock) -> u16 {
        if scene.requirements.clear_shadows {
            return query.occluded_by_opaque_block(rays);
        }
        query.occluded_block(rays)
    }

    /// The share of light that comes along a shadow ray of `node`'s hit; none where something opaque
    /// is in between.
    #[inline]
    pub(super) fn arrives(&mut self, ray: &Ray, node: &Node) -> Option<Rgb> {
        self.counts.shadow += 1;
        if self.is_tinted() {
            return self.through_glass(ray, node);
        }
        let is_blocked = if self.scene.requirements.clear_shadows {
            self.query.occluded_by_opaque(ray)
        } else {
            self.query.occluded(ray)
        };
        (!is_blocked).then_some(Rgb::splat(1.0))
    }

    /// The share of light that passes all glass along a straight shadow ray: dimmed by absorption, and
    /// by what the surfaces reflect where the user asked for it. Bending is left out: a lens casts its
    /// tint, not its caustic.
    fn through_glass(&mut self, ray: &Ray, node: &Node) -> Option<Rgb> {
        let scene = self.scene;
        let by_fresnel = scene.settings.shadows == Shadows::Fresnel;
        let mut share = Rgb::splat(1.0);
        let mut interior = node.interior;
        let mut ray = *ray;
        for _ in 0..MAX_SURFACES {
            let hit = self.query.intersect(&ray);
            let distance = hit.as_ref().map_or(ray.t_max, |hit| hit.t);
            if let Some(medium) = scene.medium(interior)
                && !medium.absorption.is_black()
            {
                share *= beer_lambert(medium.absorption, distance);
            }
            let Some(hit) = hit else { return Some(share) };
            let point = scene.surface(&ray, &hit);
            let Material::Dielectric(glass) = point.material else { return None };
            let crossing = scene.crossing(interior, point.material_index, point.is_front);
            if by_fresnel && !crossing.is_same() {
                let [n_i, n_t] = crossing.indices(scene, node.wavelength);
                // A shading normal that faces away says nothing of the angle.
                let faces = point.normal.dot(ray.direction) < 0.0;
                let n = if faces { point.normal } else { point.geometric_normal };
                // The straight way keeps the angle outside, so both faces of a pane are met at the
                // same one: that in the thinner medium, from where the share is the same.
                let (thin, dense) = (n_i.min(n_t), n_i.max(n_t));
                if let Some(bent) = fresnel::refract(ray.direction, n, dense / thin) {
                    let reflected = glass.fresnel.dielectric(bent.cos_i, bent.cos_t, thin, dense);
                    share *= 1.0 - reflected;
                }
            }
            if share.max_component() == 0.0 {
                return None;
            }
            interior = crossing.beyond;
            self.counts.shadow += 1;
            // What is left of the way to the very end of the ray that was asked for: the new origin has
            // moved by the hit's distance and by its own offset.
            let next = scene.spawn(&point, ray.direction, f32::INFINITY);
            let moved =
                (next.origin.as_dvec3() - ray.origin.as_dvec3()).dot(ray.direction.as_dvec3());
            let left = (f64::from(ray.t_max) - moved) as f32;
            if left <= 0.0 {
                return Some(share);
            }
            ray = Ray { t_max: left * (1.0 - 4.0 * f32::EPSILON), ..next };
        }
        None
    }
}
