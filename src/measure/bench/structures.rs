//! What is compared: every accelerator that can render, the plain trees, and other crates' hierarchies.

use std::hint::black_box;

use super::rays::RayKind;
use crate::accel::{
    Accel, AccelError, AccelInfo, AccelKind, BruteForce, BuildOptions, HitBlock, KdTree, Octree,
    RayBlock, RayQuery,
};
#[cfg(feature = "crates")]
use crate::accel::{BvhCrate, Flat, ObvhsBvh2, ObvhsCwBvh};
use crate::scene::Scene;

/// Most triangles that are written out for hierarchies that have no copies.
#[cfg(feature = "crates")]
const MOST_TRIANGLES: u64 = 20_000_000;

/// Which structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StructureKind {
    /// One that can render.
    Accel(AccelKind),
    /// Spatial subdivision in eights.
    Octree,
    /// A kd-tree.
    Bsp,
    /// `obvhs`, two children.
    #[cfg(feature = "crates")]
    ObvhsBvh2,
    /// `obvhs`, eight children, compressed.
    #[cfg(feature = "crates")]
    ObvhsCwBvh,
    /// `bvh`.
    #[cfg(feature = "crates")]
    BvhCrate,
}

impl StructureKind {
    /// All of them, brute force last, as the first that can render is what the others are compared with.
    pub fn all() -> Vec<Self> {
        let fast = AccelKind::ALL.iter().copied().filter(|kind| *kind != AccelKind::Brute);
        let mut all: Vec<Self> = fast.map(Self::Accel).collect();
        #[cfg(feature = "crates")]
        all.extend([Self::ObvhsBvh2, Self::ObvhsCwBvh, Self::BvhCrate]);
        all.extend([Self::Bsp, Self::Octree, Self::Accel(AccelKind::Brute)]);
        all
    }

    /// The name on the command line and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Accel(kind) => kind.name(),
            Self::Octree => "octree",
            Self::Bsp => "bsp",
            #[cfg(feature = "crates")]
            Self::ObvhsBvh2 => "obvhs-bvh2",
            #[cfg(feature = "crates")]
            Self::ObvhsCwBvh => "obvhs-cwbvh",
            #[cfg(feature = "crates")]
            Self::BvhCrate => "crate-bvh",
        }
    }

    /// Builds it on `threads`, which the current rayon pool has too.
    pub(super) fn build(
        self,
        scene: &Scene,
        threads: usize,
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Structure, NotBuilt> {
        let world = scene.world();
        Ok(match self {
            Self::Accel(kind) => {
                let options = BuildOptions {
                    kind,
                    precision: scene.settings.precision,
                    quality: scene.settings.build_quality,
                    threads: Some(threads),
                    ..BuildOptions::default()
                };
                Structure::Accel(Accel::build(world, &options, &|_| go_on())?)
            }
            Self::Octree => Structure::Octree(Octree::build(world, go_on)?),
            Self::Bsp => Structure::Bsp(KdTree::build(world, go_on)?),
            #[cfg(feature = "crates")]
            Self::ObvhsBvh2 => {
                Structure::ObvhsBvh2(ObvhsBvh2::build(&Flat::new(world, MOST_TRIANGLES)?))
            }
            #[cfg(feature = "crates")]
            Self::ObvhsCwBvh => {
                Structure::ObvhsCwBvh(ObvhsCwBvh::build(&Flat::new(world, MOST_TRIANGLES)?))
            }
            #[cfg(feature = "crates")]
            Self::BvhCrate => {
                Structure::BvhCrate(BvhCrate::build(&Flat::new(world, MOST_TRIANGLES)?))
            }
        })
    }
}

/// Why there is no structure.
pub(super) enum NotBuilt {
    Interrupted,
    Because(String),
}

impl From<AccelError> for NotBuilt {
    fn from(error: AccelError) -> Self {
        match error {
            AccelError::Interrupted => Self::Interrupted,
            error => Self::Because(error.to_string()),
        }
    }
}

#[cfg(feature = "crates")]
impl From<crate::accel::CannotFlatten> for NotBuilt {
    fn from(error: crate::accel::CannotFlatten) -> Self {
        Self::Because(error.to_string())
    }
}

/// One that was built.
pub(super) enum Structure {
    Accel(Accel),
    Octree(Octree),
    Bsp(KdTree),
    #[cfg(feature = "crates")]
    ObvhsBvh2(ObvhsBvh2),
    #[cfg(feature = "crates")]
    ObvhsCwBvh(ObvhsCwBvh),
    #[cfg(feature = "crates")]
    BvhCrate(BvhCrate),
}

/// Runs one expression over whichever structure it is, compiled for each.
macro_rules! with_structure {
    ($structure:expr, $query:ident => $body:expr) => {
        match $structure {
            Structure::Accel(accel) => $crate::accel::with_accel!(accel, $query => $body),
            Structure::Octree($query) => $body,
            Structure::Bsp($query) => $body,
            #[cfg(feature = "crates")]
            Structure::ObvhsBvh2($query) => $body,
            #[cfg(feature = "crates")]
            Structure::ObvhsCwBvh($query) => $body,
            #[cfg(feature = "crates")]
            Structure::BvhCrate($query) => $body,
        }
    };
}
pub(super) use with_structure;

impl Structure {
    pub(super) fn info(&self) -> AccelInfo {
        with_structure!(self, query => query.info())
    }

    /// Its rays one by one.
    pub(super) fn singles(&self) -> Box<dyn Contestant + '_> {
        with_structure!(self, query => Box::new(Singles(query)))
    }

    /// Its rays in packets, where it has them.
    pub(super) fn packets(&self) -> Option<Box<dyn Contestant + '_>> {
        let has_packets = self.info().packet_width > 1;
        has_packets.then(|| -> Box<dyn Contestant + '_> {
            with_structure!(self, query => Box::new(Packets(query)))
        })
    }
}

/// A structure and a way to ask it. Dynamic dispatch is by many blocks, not by rays.
pub(super) trait Contestant: Sync {
    fn closest(&self, block: &RayBlock) -> HitBlock;

    fn occluded(&self, block: &RayBlock) -> u16;

    /// The queries of a kind for many blocks, for the time that they take.
    fn trace(&self, kind: RayKind, blocks: &[RayBlock]);
}

pub(super) struct Singles<'a, Q: ?Sized>(pub(super) &'a Q);

pub(super) struct Packets<'a, Q: ?Sized>(pub(super) &'a Q);

impl<Q: RayQuery + ?Sized> Contestant for Singles<'_, Q> {
    fn closest(&self, block: &RayBlock) -> HitBlock {
        HitBlock::from_fn(block.active(), |lane| self.0.intersect(&block.get(lane)))
    }

    fn occluded(&self, block: &RayBlock) -> u16 {
        let lanes = block.lanes().filter(|&lane| self.0.occluded(&block.get(lane)));
        lanes.fold(0, |bits, lane| bits | 1 << lane)
    }

    fn trace(&self, kind: RayKind, blocks: &[RayBlock]) {
        for block in blocks {
            for lane in block.lanes() {
                let ray = block.get(lane);
                if kind == RayKind::Shadow {
                    black_box(self.0.occluded(&ray));
                } else {
                    black_box(self.0.intersect(&ray));
                }
            }
        }
    }
}

impl<Q: RayQuery + ?Sized> Contestant for Packets<'_, Q> {
    fn closest(&self, block: &RayBlock) -> HitBlock {
        self.0.intersect_block(block)
    }

    fn occluded(&self, block: &RayBlock) -> u16 {
        self.0.occluded_block(block)
    }

    fn trace(&self, kind: RayKind, blocks: &[RayBlock]) {
        for block in blocks {
            if kind == RayKind::Shadow {
                black_box(self.0.occluded_block(block));
            } else {
                black_box(self.0.intersect_block(block));
            }
        }
    }
}

/// The oracle.
pub(super) fn oracle(scene: &Scene) -> Structure {
    Structure::Accel(Accel::Brute(BruteForce::new(scene.world())))
}
