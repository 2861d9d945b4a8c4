//! The lecture's first picture: the colour of what is hit, and no light at all.

use super::{Integrator, RayCounts};
use crate::accel::{HitBlock, LANES, RayBlock, RayQuery};
use crate::color::Rgb;
use crate::scene::Scene;

/// Shows the albedo of the first surface.
#[derive(Debug, Clone, Copy)]
pub struct Flat;

impl Integrator for Flat {
    fn shade<Q: RayQuery>(
        &self,
        scene: &Scene,
        _query: &Q,
        _rays: &RayBlock,
        hits: &HitBlock,
        _counts: &mut RayCounts,
    ) -> [Rgb; LANES] {
        std::array::from_fn(|lane| match hits.get(lane) {
            Some(hit) => scene.material(hit).albedo(),
            None => scene.background,
        })
    }
}
