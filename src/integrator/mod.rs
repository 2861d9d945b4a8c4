//! How light travels: one file or folder per algorithm. Scene, rays, hits and samplers in, radiance
//! out; no threads, no files, no film.

mod ao;
mod first_hit;
mod flat;
mod whitted;

pub use ao::Ao;
pub use first_hit::FirstHits;
pub use flat::Flat;
pub use whitted::{Everything, Features, Local, Tree, Whitted};

use crate::accel::{HitBlock, LANES, RayBlock, RayQuery};
use crate::color::RgbLanes;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The camera rays of a block, what they hit, and the numbers that their samples may draw.
#[derive(Debug)]
pub struct CameraBlock<'a> {
    /// The rays, of which some may not be active.
    pub rays: &'a RayBlock,
    /// Their closest hits.
    pub hits: &'a HitBlock,
    /// The sampler of each lane.
    pub samplers: &'a [Sampler; LANES],
}

/// An algorithm that finds the radiance along camera rays.
pub trait Integrator: Sync {
    /// The radiance that arrives along each camera ray of a block; rays that are not active, and rays
    /// without a hit, see the background.
    fn shade<Q: RayQuery>(
        &self,
        scene: &Scene,
        query: &Q,
        camera: &CameraBlock<'_>,
        counts: &mut RayCounts,
    ) -> RgbLanes<LANES>;

    /// As [`Integrator::shade`]; beside it, what of that is the light of the first surface itself: its own,
    /// and what it has straight from lights.
    fn shade_split<Q: RayQuery>(
        &self,
        scene: &Scene,
        query: &Q,
        camera: &CameraBlock<'_>,
        counts: &mut RayCounts,
    ) -> (RgbLanes<LANES>, RgbLanes<LANES>) {
        let radiance = self.shade(scene, query, camera, counts);
        (radiance, radiance)
    }
}

/// Rays traced, by kind, and where branches of the ray tree ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Towards a light.
    pub shadow: u64,
    /// Mirrored.
    pub reflection: u64,
    /// Bent into or out of a medium, or passing straight where two media have the same.
    pub refraction: u64,
    /// Scattered in all directions: those that look for ambient light.
    pub diffuse: u64,
    /// Which rule ended how many branches.
    pub ends: BranchEnds,
}

/// Branches of the ray tree by the rule that ended them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BranchEnds {
    /// The ray hit nothing.
    pub miss: u64,
    /// It hit what sends no rays on.
    pub diffuse: u64,
    /// The next ray would have been deeper than `max_depth`.
    pub depth: u64,
    /// The next ray's weight was below `prune`.
    pub prune: u64,
    /// The same, at random.
    pub roulette: u64,
}

impl RayCounts {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.camera + self.shadow + self.reflection + self.refraction + self.diffuse
    }

    /// Adds those of another part of the picture.
    pub fn add(&mut self, other: &Self) {
        self.camera += other.camera;
        self.shadow += other.shadow;
        self.reflection += other.reflection;
        self.refraction += other.refraction;
        self.diffuse += other.diffuse;
        self.ends.miss += other.ends.miss;
        self.ends.diffuse += other.ends.diffuse;
        self.ends.depth += other.ends.depth;
        self.ends.prune += other.ends.prune;
        self.ends.roulette += other.ends.roulette;
    }
}
