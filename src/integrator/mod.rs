//! How light travels: one file per algorithm. Scene, rays, hits and sampler in, radiance out; no
//! threads, no files, no film.

mod direct;
mod flat;

pub use direct::Direct;
pub use flat::Flat;

use crate::accel::{HitBlock, LANES, RayBlock, RayQuery};
use crate::color::Rgb;
use crate::scene::Scene;

/// An algorithm that finds the radiance along camera rays.
pub trait Integrator: Sync {
    /// The radiance that arrives along each camera ray of a block whose closest hits are known; rays
    /// that are not active, and rays without a hit, see the background.
    fn shade<Q: RayQuery>(
        &self,
        scene: &Scene,
        query: &Q,
        rays: &RayBlock,
        hits: &HitBlock,
        counts: &mut RayCounts,
    ) -> [Rgb; LANES];
}

/// Rays traced, by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Towards a light.
    pub shadow: u64,
}

impl RayCounts {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.camera + self.shadow
    }

    /// Adds those of another part of the picture.
    pub fn add(&mut self, other: &Self) {
        self.camera += other.camera;
        self.shadow += other.shadow;
    }
}
