//! Our own hierarchy behind the seam: eight boxes to a node, eight triangles or spheres to a leaf, each tested
//! at once with the widest instructions that the processor has.
//!
//! It owns how the tree is built and traversed. Triangles and spheres are copied into leaves, in the order of
//! lanes; other shapes are solved by themselves, in f64, as are spheres that a ray may hit.

mod build;
mod collapse;
mod group;
mod node;
mod packet;
mod ray;
mod simd;
mod sphere;
#[cfg(test)]
mod tests;
mod traverse;
mod triangle;
mod watch;

use rayon::prelude::*;

use super::block::{HitBlock, LANES, RayBlock};
use super::world::{CopyRef, World};
use super::{AccelError, AccelInfo, BuildOptions, BuildQuality, Hit, Precision, RayQuery};
use crate::math::{Ray, lanes_where};
use group::{Copy, GroupTree, RootItems};
use packet::{FoundLanes, Packet};
use simd::{Isa, Kernel, Simd};
use traverse::Found;
use watch::Watch;

/// A hierarchy over a world.
#[derive(Debug)]
pub struct BvhAccel {
    root: GroupTree,
    prototypes: Vec<GroupTree>,
    copies: Vec<Copy>,
    isa: Isa,
    is_robust: bool,
    single_rays: bool,
}

impl BvhAccel {
    /// Builds prototypes first, then the world around them. The tree does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// [`AccelError`] where the memory limit would be exceeded, `progress` returns false, or there are too
    /// many primitives to number.
    pub fn build(
        world: &World,
        options: &BuildOptions,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Self, AccelError> {
        let build = || Self::build_here(world, options, progress);
        // Where there is no pool to be had, with what threads there are.
        match options.threads.map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build()) {
            Some(Ok(pool)) => pool.install(build),
            _ => build(),
        }
    }

    fn build_here(
        world: &World,
        options: &BuildOptions,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Self, AccelError> {
        let bins = |group| match options.quality_of(world, group) {
            BuildQuality::Low => 8,
            BuildQuality::Auto | BuildQuality::Medium | BuildQuality::High => 32,
        };
        let groups = world.prototypes.iter().chain([&world.root]);
        let primitives = groups.flat_map(|group| &group.geometries).map(|g| g.len() as u64).sum();
        let watch = Watch::new(primitives, options.memory_limit, progress);
        watch.check()?;
        let prototypes = world.prototypes.par_iter().map(|group| {
            let built = GroupTree::build(group, &[], bins(group), &watch)?;
            watch.hold(built.tree.bytes())?;
            Ok(built)
        });
        let prototypes = prototypes.collect::<Result<Vec<_>, AccelError>>()?;

        let count: u64 = world.sets.iter().map(|set| set.transforms.len() as u64).sum();
        watch.hold(count * size_of::<Copy>() as u64)?;
        let copies: Vec<_> = (0u32..)
            .zip(&world.sets)
            .flat_map(|(set, s)| {
                let ids = (0..s.transforms.len() as u32).map(move |index| CopyRef { set, index });
                ids.zip(std::iter::repeat(s.prototype))
            })
            .filter_map(|(id, prototype)| Copy::new(id, prototype, world, &prototypes))
            .collect();
        let root = GroupTree::build(&world.root, &copies, bins(&world.root), &watch)?;
        watch.hold(root.tree.bytes())?;
        Ok(Self {
            root,
            prototypes,
            copies: copies.into_iter().map(|(copy, _)| copy).collect(),
            isa: Isa::detect(),
            is_robust: options.precision != Precision::Fast,
            single_rays: options.single_rays,
        })
    }

    /// Name, instruction set and memory, for reports and file headers.
    pub fn info(&self) -> AccelInfo {
        let trees = self.prototypes.iter().chain([&self.root]).map(|group| group.tree.bytes());
        AccelInfo {
            name: "BVH".into(),
            isa: self.isa.name(),
            packet_width: if self.single_rays { 1 } else { LANES },
            bytes: trees.sum::<u64>() + (self.copies.len() * size_of::<Copy>()) as u64,
        }
    }

    /// Our ids for those of the trees.
    #[inline(always)]
    fn hit(&self, found: &Found) -> Hit {
        let (copy, group) = match found.copy {
            Found::NO_COPY => (None, &self.root),
            index => {
                let copy = &self.copies[index as usize];
                (Some(copy.id), &self.prototypes[copy.prototype as usize])
            }
        };
        let (_, geometry, primitive) = group.primitive(found.id);
        let (u, v) = Hit::weights(found.u, found.v);
        Hit { t: found.t, u, v, primitive, geometry, copy }
    }

    /// The same for a block.
    #[inline(always)]
    fn hits(&self, active: u16, found: &FoundLanes) -> HitBlock {
        if !self.root.is_one_mesh() {
            return HitBlock::from_fn(active, |lane| {
                found.get(lane).if_any().map(|found| self.hit(&found))
            });
        }
        // Its primitives are numbered as those of the tree.
        let (mut u, mut v, mut is_hit) = ([0.0; LANES], [0.0; LANES], [false; LANES]);
        for i in 0..LANES {
            (u[i], v[i]) = Hit::weights(found.u[i], found.v[i]);
            is_hit[i] = found.id[i] != Found::NOTHING;
        }
        let mut hits = HitBlock::NONE;
        let bits = lanes_where(&is_hit) & active;
        hits.set_lanes(0, bits, [&found.t, &u, &v], [&found.id, &[0; LANES]]);
        hits
    }

    fn items<const ROBUST: bool>(&self) -> RootItems<'_, ROBUST> {
        RootItems { root: &self.root, prototypes: &self.prototypes, copies: &self.copies }
    }

    #[inline(always)]
    fn any<const OPAQUE: bool>(&self, ray: &Ray) -> bool {
        if self.is_robust {
            self.isa.run(Any::<true, OPAQUE> { accel: self, ray })
        } else {
            self.isa.run(Any::<false, OPAQUE> { accel: self, ray })
        }
    }

    #[inline(always)]
    fn any_of_block<const OPAQUE: bool>(&self, rays: &RayBlock) -> u16 {
        if self.single_rays {
            let is_hit = |lane: &usize| self.any::<OPAQUE>(&rays.get(*lane));
            return rays.lanes().filter(is_hit).fold(0, |bits, lane| bits | 1 << lane);
        }
        if self.is_robust {
            self.isa.run(AnyOfBlock::<true, OPAQUE> { accel: self, rays })
        } else {
            self.isa.run(AnyOfBlock::<false, OPAQUE> { accel: self, rays })
        }
    }
}

impl RayQuery for BvhAccel {
    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let found = if self.is_robust {
            self.isa.run(Closest::<true> { accel: self, ray })
        } else {
            self.isa.run(Closest::<false> { accel: self, ray })
        };
        found.map(|found| self.hit(&found))
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        self.any::<false>(ray)
    }

    #[inline]
    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.any::<true>(ray)
    }

    #[inline]
    fn intersect_block(&self, rays: &RayBlock) -> HitBlock {
        if self.single_rays {
            return HitBlock::from_fn(rays.active(), |lane| self.intersect(&rays.get(lane)));
        }
        if self.is_robust {
            self.isa.run(ClosestOfBlock::<true> { accel: self, rays })
        } else {
            self.isa.run(ClosestOfBlock::<false> { accel: self, rays })
        }
    }

    #[inline]
    fn occluded_block(&self, rays: &RayBlock) -> u16 {
        self.any_of_block::<false>(rays)
    }

    #[inline]
    fn occluded_by_opaque_block(&self, rays: &RayBlock) -> u16 {
        self.any_of_block::<true>(rays)
    }
}

struct Closest<'a, const ROBUST: bool> {
    accel: &'a BvhAccel,
    ray: &'a Ray,
}

impl<const ROBUST: bool> Kernel for Closest<'_, ROBUST> {
    type Output = Option<Found>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Option<Found> {
        let items = self.accel.items::<ROBUST>();
        traverse::closest::<S, ROBUST>(simd, &self.accel.root.tree, items, self.ray)
    }
}

struct Any<'a, const ROBUST: bool, const OPAQUE: bool> {
    accel: &'a BvhAccel,
    ray: &'a Ray,
}

impl<const ROBUST: bool, const OPAQUE: bool> Kernel for Any<'_, ROBUST, OPAQUE> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let items = self.accel.items::<ROBUST>();
        traverse::any::<S, ROBUST, OPAQUE>(simd, &self.accel.root.tree, items, self.ray)
    }
}

struct ClosestOfBlock<'a, const ROBUST: bool> {
    accel: &'a BvhAccel,
    rays: &'a RayBlock,
}

impl<const ROBUST: bool> Kernel for ClosestOfBlock<'_, ROBUST> {
    type Output = HitBlock;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> HitBlock {
        let Self { accel, rays } = self;
        let mut packet = Packet::new::<S, ROBUST>(simd, rays);
        if !packet.has_one_sign {
            return HitBlock::from_fn(rays.active(), |lane| {
                let ray = &rays.get(lane);
                simd.run(Closest::<ROBUST> { accel, ray }).map(|found| accel.hit(&found))
            });
        }
        let tree = &accel.root.tree;
        let best =
            packet::closest::<S, ROBUST>(simd, tree, accel.items::<ROBUST>(), rays, &mut packet);
        accel.hits(rays.active(), &best)
    }
}

struct AnyOfBlock<'a, const ROBUST: bool, const OPAQUE: bool> {
    accel: &'a BvhAccel,
    rays: &'a RayBlock,
}

impl<const ROBUST: bool, const OPAQUE: bool> Kernel for AnyOfBlock<'_, ROBUST, OPAQUE> {
    type Output = u16;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> u16 {
        let Self { accel, rays } = self;
        let mut packet = Packet::new::<S, ROBUST>(simd, rays);
        if !packet.has_one_sign {
            return rays
                .lanes()
                .filter(|lane| {
                    let ray = &rays.get(*lane);
                    simd.run(Any::<ROBUST, OPAQUE> { accel, ray })
                })
                .fold(0, |bits, lane| bits | 1 << lane);
        }
        let (tree, items) = (&accel.root.tree, accel.items::<ROBUST>());
        packet::any::<S, ROBUST, OPAQUE>(simd, tree, items, rays, &mut packet)
    }
}
