//! The one seam for ray queries: what there is to hit goes in, hits come out. Behind it are Embree, a
//! hierarchy of our own and a brute-force loop in f64, with the same answers; and plain trees to compare
//! them with.
//!
//! It owns how rays are found to hit something, and decides which query suits which ray. It does not
//! know what a hit looks like: materials, lights and normals are the scene's.

mod block;
mod brute;
mod bvh;
#[cfg(feature = "crates")]
mod crates;
#[cfg(feature = "embree")]
mod embree;
mod estimate;
mod kdtree;
mod levels;
mod octree;
mod primitive;
#[cfg(feature = "embree")]
mod reach;
mod world;

use std::fmt;

pub(crate) use block::lanes_of;
pub use block::{HitBlock, LANES, RayBlock};
pub use brute::BruteForce;
pub use bvh::BvhAccel;
#[cfg(feature = "crates")]
pub use crates::{BvhCrate, CannotFlatten, Flat, ObvhsBvh2, ObvhsCwBvh};
#[cfg(feature = "embree")]
pub use embree::EmbreeAccel;
pub use estimate::MemoryEstimate;
pub use kdtree::KdTree;
pub use octree::Octree;
pub use world::{
    CopyRef, Geometry, Group, InstanceSet, Transform3x4, World, affine_from_rows, rows_from_affine,
};

use crate::math::Ray;

/// Closest hit and visibility: all that light transport asks of an acceleration structure.
pub trait RayQuery: Sync {
    /// The closest hit at t in (`t_min`, `t_max`].
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// Whether there is any such hit.
    fn occluded(&self, ray: &Ray) -> bool;

    /// Whether anything is hit that light does not pass ([`Group::clear`]).
    fn occluded_by_opaque(&self, ray: &Ray) -> bool;

    /// The closest hits of rays that run close together.
    fn intersect_block(&self, rays: &RayBlock) -> HitBlock {
        HitBlock::from_fn(rays.active(), |lane| self.intersect(&rays.get(lane)))
    }

    /// Which active rays of a block that run close together are blocked, as bits.
    fn occluded_block(&self, rays: &RayBlock) -> u16 {
        rays.lanes()
            .filter(|&lane| self.occluded(&rays.get(lane)))
            .fold(0, |bits, lane| bits | 1 << lane)
    }

    /// Which active rays of such a block are blocked by what light does not pass, as bits.
    fn occluded_by_opaque_block(&self, rays: &RayBlock) -> u16 {
        rays.lanes()
            .filter(|&lane| self.occluded_by_opaque(&rays.get(lane)))
            .fold(0, |bits, lane| bits | 1 << lane)
    }
}

/// A hit, in ids of the [`World`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f32,
    /// Barycentric weight of a triangle's second corner, in [0, 1]. Of another shape, which of its parts
    /// was hit: see [`Hit::part`].
    pub u: f32,
    /// Barycentric weight of its third corner; 0 for other shapes.
    pub v: f32,
    /// Index within the geometry.
    pub primitive: u32,
    /// Index within the group.
    pub geometry: u32,
    /// The copy that was hit; none in the root group.
    pub copy: Option<CopyRef>,
}

impl Hit {
    /// Barycentric weights of the second and the third corner within their bounds: they are rounded, and where the
    /// origin is far Embree's robust traversal leaves them a little outside.
    #[inline(always)]
    const fn weights(u: f32, v: f32) -> (f32, f32) {
        let u = u.clamp(0.0, 1.0);
        (u, v.clamp(0.0, 1.0 - u))
    }

    /// Which part of a shape was hit; not for triangles.
    #[inline]
    pub const fn part(&self) -> u8 {
        (self.u * 256.0) as u8
    }

    /// The part of a shape in the place of `u`: below 1, and exact.
    #[inline]
    pub(crate) const fn u_of_part(part: u8) -> f32 {
        part as f32 / 256.0
    }
}

/// How far a build may go to make hits exact: from less to more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Precision {
    /// Embree's defaults: some rays are lost at edges and far from the origin.
    Fast,
    /// Watertight at edges (Embree's not quite at vertices), accurate far from the origin.
    #[default]
    Robust,
    /// Watertight at edges and vertices. Embree has no such queries: those of our own hierarchy are.
    Exact,
}

impl Precision {
    /// All rungs of the ladder.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Robust, Self::Exact];

    /// The name in scene files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Robust => "robust",
            Self::Exact => "exact",
        }
    }
}

/// How much work goes into building the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BuildQuality {
    /// Low where that pays, as far as it comes out the same on any number of threads; else medium. See
    /// [`BuildOptions::quality_of`].
    #[default]
    Auto,
    /// Fast to build. Embree's may come out different from run to run where several threads build over
    /// more than one mesh, and so may which of two coincident surfaces is hit.
    Low,
    /// Between the two.
    Medium,
    /// Fast to trace; differs from medium only in Embree's, with `precision = "fast"`.
    High,
}

impl BuildQuality {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Auto, Self::Low, Self::Medium, Self::High];

    /// The name in scene files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
        }
    }
}

/// Whether the hierarchy takes half the memory, for rays that are 1.4 to 1.8 times slower.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compact {
    /// Where the memory does not suffice otherwise.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// The acceleration structures that can be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AccelKind {
    /// Embree 4.
    #[cfg(feature = "embree")]
    Embree,
    /// Our own hierarchy, eight wide.
    Bvh,
    /// Every ray against every primitive, in f64: the oracle, for small scenes.
    Brute,
}

impl AccelKind {
    /// Those that this build holds, the default first.
    pub const ALL: &[Self] = &[
        #[cfg(feature = "embree")]
        Self::Embree,
        Self::Bvh,
        Self::Brute,
    ];

    /// The name in scene files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree => "embree",
            Self::Bvh => "bvh",
            Self::Brute => "brute",
        }
    }
}

impl Default for AccelKind {
    fn default() -> Self {
        Self::ALL[0]
    }
}

/// What a build is asked for.
#[derive(Debug, Clone, Default)]
pub struct BuildOptions {
    /// Which structure.
    pub kind: AccelKind,
    /// How exact.
    pub precision: Precision,
    /// How much work.
    pub quality: BuildQuality,
    /// Rays that will be traced and hit something, which [`BuildQuality::Auto`] goes by: those that run close
    /// together count a twelfth, as a worse hierarchy hardly slows them. Many where not given.
    pub expected_rays: Option<u64>,
    /// Threads of the build; all where not given.
    pub threads: Option<usize>,
    /// Whether the hierarchy takes half the memory, and longer to trace. Embree only.
    pub compact: bool,
    /// Whether rays that run close together are traced one by one all the same: to see what packets bring.
    pub single_rays: bool,
    /// Bytes that the structure may hold.
    pub memory_limit: Option<u64>,
    /// Bytes that there are for it.
    pub free: Option<u64>,
}

/// What was built, for reports and file headers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AccelInfo {
    /// Name and version.
    pub name: String,
    /// The instruction set that queries use; hits may differ in their last bits between two.
    pub isa: &'static str,
    /// Rays traced at once where they run close together.
    pub packet_width: usize,
    /// Bytes held.
    pub bytes: u64,
}

/// Why nothing was built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AccelError {
    /// Embree refused.
    #[cfg(feature = "embree")]
    #[error(transparent)]
    Embree(#[from] crate::embree::EmbreeError),
    /// The build was interrupted.
    #[error("the build was interrupted")]
    Interrupted,
    /// The structure is expected not to fit.
    #[error(
        "building the hierarchy takes about {} MB of memory ({} MB compact), and {} MB {}; accepted: {}",
        .needed / 1_000_000,
        .compact / 1_000_000,
        .room / 1_000_000,
        if *.is_limit { "is the limit" } else { "are free" },
        if *.is_limit { "a higher --memory-limit, or a smaller scene" } else { "a smaller scene" }
    )]
    NoRoom {
        /// Bytes that it takes at its height.
        needed: u64,
        /// Bytes that it would take in the compact form.
        compact: u64,
        /// Bytes that there are.
        room: u64,
        /// Whether that is a limit that was asked for.
        is_limit: bool,
    },
    /// The structure would exceed the memory limit.
    #[error("building the hierarchy needs more than the memory limit of {limit} bytes")]
    MemoryLimit {
        /// The limit.
        limit: u64,
    },
    /// More than can be numbered.
    #[error(
        "a group of more than 2³² − 2 triangles, or of 2³⁰ shapes and copies, cannot be built over"
    )]
    TooMany,
}

/// An acceleration structure that was built. Match on it once, outside the loop over rays.
#[derive(Debug)]
pub enum Accel {
    /// Embree 4.
    #[cfg(feature = "embree")]
    Embree(EmbreeAccel),
    /// Our own hierarchy.
    Bvh(BvhAccel),
    /// Every ray against every primitive.
    Brute(BruteForce),
}

/// Runs one expression over whichever structure was built, compiled for each.
macro_rules! with_accel {
    ($accel:expr, $query:ident => $body:expr) => {
        match $accel {
            #[cfg(feature = "embree")]
            $crate::accel::Accel::Embree($query) => $body,
            $crate::accel::Accel::Bvh($query) => $body,
            $crate::accel::Accel::Brute($query) => $body,
        }
    };
}
pub(crate) use with_accel;
/// Triangles of a mesh from which on it matters how it is built.
const LARGE: u64 = 1 << 17;

/// So many rays for each triangle take as much longer as [`BuildQuality::Low`] saves: those without order 1.3 to 3.5,
/// those that run close together 13 and more, by the mesh.
// Measured by `cargo bench --bench limits`.
const FEW_RAYS: f64 = 2.4;

impl BuildOptions {
    /// The quality that a group of the world is built with: [`BuildQuality::Auto`], decided. Embree takes low
    /// for a group of one large mesh by itself, where few rays are expected for so many triangles. Over more
    /// than that, it would not come out the same on any number of threads. Our own hierarchy gains nothing.
    pub fn quality_of(&self, world: &World, group: &Group) -> BuildQuality {
        match self.quality {
            BuildQuality::Auto if self.is_low(world, group, self.expected_rays) => {
                BuildQuality::Low
            }
            BuildQuality::Auto => BuildQuality::Medium,
            quality => quality,
        }
    }

    /// Whether that would be another, were fewer rays expected.
    pub fn rays_decide(&self, world: &World, group: &Group) -> bool {
        self.expected_rays.is_some()
            && self.quality_of(world, group) == BuildQuality::Medium
            && self.quality == BuildQuality::Auto
            && self.is_low(world, group, Some(0))
    }

    /// Whether [`BuildQuality::Auto`] is low where so many rays are expected.
    fn is_low(&self, world: &World, group: &Group, rays: Option<u64>) -> bool {
        #[cfg(feature = "embree")]
        let gains = self.built_kind() == AccelKind::Embree && !self.compact;
        #[cfg(not(feature = "embree"))]
        let gains = false;
        let is_alone = world.sets.is_empty() || !std::ptr::eq(group, &world.root);
        let [Geometry::Mesh(mesh)] = group.geometries.as_slice() else { return false };
        let triangles = mesh.triangles.len() as u64;
        let is_few = rays.is_some_and(|n| (n as f64) < FEW_RAYS * triangles as f64);
        gains && is_alone && triangles >= LARGE && is_few
    }

    /// The structure that is built: Embree's loses some rays that meet a vertex, so that
    /// [`Precision::Exact`] is for our own.
    pub fn built_kind(&self) -> AccelKind {
        match self.kind {
            #[cfg(feature = "embree")]
            AccelKind::Embree if self.precision == Precision::Exact => AccelKind::Bvh,
            kind => kind,
        }
    }

    /// Decides by what a structure is expected to take whether it will be `compact`, and refuses what
    /// does not fit into [`BuildOptions::memory_limit`] or [`BuildOptions::free`] either way.
    ///
    /// # Errors
    /// [`AccelError::NoRoom`].
    pub fn fit(&mut self, world: &World, compact: Compact) -> Result<MemoryEstimate, AccelError> {
        let of = |options: &Self, compact| {
            MemoryEstimate::of(world, &Self { compact, ..options.clone() })
        };
        let room = [self.memory_limit, self.free].into_iter().flatten().min().unwrap_or(u64::MAX);
        if of(self, false).peak > room {
            // What is quick to build takes more.
            self.expected_rays = None;
        }
        let (normal, small) = (of(self, false), of(self, true));
        self.compact = match compact {
            Compact::On => true,
            Compact::Off => false,
            Compact::Auto => normal.peak > room && small.peak <= room,
        };
        let estimate = if self.compact { small } else { normal };
        if estimate.peak > room {
            return Err(AccelError::NoRoom {
                needed: normal.peak,
                compact: small.peak,
                room,
                is_limit: self.memory_limit == Some(room),
            });
        }
        Ok(estimate)
    }
}

impl Accel {
    /// Builds the structure over `world`. `progress` hears of it from 0 to 1, perhaps on several
    /// threads at once, and ends the build by returning false.
    ///
    /// # Errors
    /// [`AccelError`] where memory runs out or the build is interrupted.
    pub fn build(
        world: &World,
        options: &BuildOptions,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Self, AccelError> {
        match options.built_kind() {
            #[cfg(feature = "embree")]
            AccelKind::Embree => EmbreeAccel::build(world, options, progress).map(Self::Embree),
            AccelKind::Bvh => BvhAccel::build(world, options, progress).map(Self::Bvh),
            AccelKind::Brute if !progress(0.0) => Err(AccelError::Interrupted),
            AccelKind::Brute => Ok(Self::Brute(BruteForce::new(world))),
        }
    }

    /// It behind dynamic dispatch, for tools and tests; a loop over rays that is to be fast matches once.
    pub fn query(&self) -> &dyn RayQuery {
        with_accel!(self, accel => accel)
    }

    /// What was built.
    pub fn info(&self) -> AccelInfo {
        with_accel!(self, accel => accel.info())
    }
}

impl fmt::Display for AccelInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, packets of {})", self.name, self.isa, self.packet_width)
    }
}
