//! Embree behind the seam: which query for which ray (measured: see ARCHITECTURE.md), and how
//! Embree's ids become ours.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use glam::DVec3;
use rayon::prelude::*;

use super::block::{HitBlock, LANES, RayBlock, lanes_of};
use super::reach::Reach;
use super::world::{
    CopyRef, Geometry, Group, InstanceSet, Transform3x4, World, affine_from_rows, rows_from_affine,
};
use super::{AccelError, AccelInfo, BuildOptions, BuildQuality, Hit, Precision, RayQuery};
use crate::embree::{
    self, BuildProgress, Coherence, Device, DeviceConfig, EmbreeError, ErrorCode, INVALID_ID,
    PacketMask, Quality, RayHitPacket, RayPacket, Scene, SceneBuilder, SceneFlags, UserBounds,
    UserGeometry, UserHit,
};
use crate::geometry::{AnalyticShape, with_shapes};
use crate::math::{Bounds, Ray};

/// Masks of geometries, and of the rays that see them: a copy has Embree's default, that of what is
/// opaque, so such rays enter it.
const OPAQUE: u32 = 1;
const CLEAR: u32 = 2;
const ALL: u32 = !0;

/// A committed Embree scene.
#[derive(Debug)]
pub struct EmbreeAccel {
    scene: Scene,
    packet_width: usize,
    coherence: Coherence,
    /// Which instance set each id above those of the root's geometries stands for.
    sets: Vec<u32>,
    first_set: u32,
    /// Bytes of what the copies refer to, which Embree does not count.
    copies_bytes: u64,
}

impl EmbreeAccel {
    /// Builds prototypes first, then the world around them.
    ///
    /// # Errors
    /// [`AccelError`] where memory runs out or `progress` returns false.
    pub fn build(
        world: &World,
        options: &BuildOptions,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Self, AccelError> {
        let config = DeviceConfig {
            threads: options.threads,
            isa: None,
            memory_limit: options.memory_limit,
        };
        let device = Device::new(&config)?;
        Self::build_on(&device, world, options, progress).map_err(|e| {
            match (e, options.memory_limit) {
                (EmbreeError::Cancelled, _) => AccelError::Interrupted,
                (EmbreeError::Native { code: ErrorCode::OUT_OF_MEMORY, .. }, Some(limit)) => {
                    AccelError::MemoryLimit { limit }
                }
                (e, _) => AccelError::Embree(e),
            }
        })
    }

    /// As [`EmbreeAccel::build`], on a device of the caller's.
    ///
    /// # Errors
    /// As Embree reports them.
    pub fn build_on(
        device: &Device,
        world: &World,
        options: &BuildOptions,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Self, EmbreeError> {
        let quality = |group| match options.quality_of(world, group) {
            BuildQuality::Low => Quality::Low,
            BuildQuality::High => Quality::High,
            BuildQuality::Auto | BuildQuality::Medium => Quality::Medium,
        };
        let flags = match options.precision {
            Precision::Fast => SceneFlags::NONE,
            Precision::Robust | Precision::Exact => SceneFlags::ROBUST,
        };
        let flags = if options.compact { flags | SceneFlags::COMPACT } else { flags };
        // Every group counts by its primitives towards the progress.
        let size = |group: &Group| group.geometries.iter().map(Geometry::len).sum::<usize>().max(1);
        let sizes = world.prototypes.iter().chain([&world.root]).map(size);
        let total = sizes.sum::<usize>() as f64;
        let mut done = 0.0;
        let mut commit = |builder: SceneBuilder, size: usize| {
            let share = size as f64 / total;
            let scene = commit_watched(builder, &|x| progress(done + share * x))?;
            done += share;
            Ok::<_, EmbreeError>(scene)
        };

        let mut prototypes = Vec::with_capacity(world.prototypes.len());
        for group in &world.prototypes {
            let mut builder = SceneBuilder::new(device, flags, quality(group))?;
            attach_group(&mut builder, device, group, quality(group))?;
            prototypes.push(commit(builder, size(group))?);
        }
        let root_quality = quality(&world.root);
        let mut builder = SceneBuilder::new(device, flags, root_quality)?;
        attach_group(&mut builder, device, &world.root, root_quality)?;
        let reaches: Vec<_> = world.prototypes.iter().map(Reach::of).collect();
        let first_set = world.root.geometries.len() as u32;
        let mut sets = Vec::with_capacity(world.sets.len());
        let mut copies_bytes = 0;
        for (index, set) in (0u32..).zip(&world.sets) {
            let prototype = set.prototype as usize;
            // Copies of nothing are nothing.
            let Some(reach) = &reaches[prototype] else { continue };
            let copies = copies(device, &prototypes[prototype], set, reach)?;
            assert_eq!(
                builder.attach(copies),
                first_set + sets.len() as u32,
                "Embree numbers geometries in order"
            );
            sets.push(index);
            let each = size_of::<Transform3x4>() + size_of::<UserBounds>();
            copies_bytes += (set.transforms.len() * each) as u64;
        }
        let scene = commit(builder, size(&world.root))?;
        Ok(Self {
            scene,
            packet_width: if options.single_rays { 1 } else { device.packet_width() },
            coherence: coherence(world),
            sets,
            first_set,
            copies_bytes,
        })
    }

    /// Name, version, instruction set and memory, for reports and file headers.
    pub fn info(&self) -> AccelInfo {
        let device = self.scene.device();
        AccelInfo {
            name: format!("Embree {}", device.version()),
            isa: device.isa().name(),
            packet_width: self.packet_width,
            bytes: device.memory().current + self.copies_bytes,
        }
    }

    /// Our ids for Embree's.
    #[inline]
    fn hit(&self, hit: &embree::Hit) -> Option<Hit> {
        // Huge coordinates can give a hit without a distance.
        if !hit.t.is_finite() {
            return None;
        }
        let copy = if hit.instance == INVALID_ID {
            None
        } else {
            let set = self.sets[(hit.instance - self.first_set) as usize];
            Some(CopyRef { set, index: hit.instance_primitive })
        };
        let (u, v) = Hit::weights(hit.u, hit.v);
        Some(Hit { t: hit.t, u, v, primitive: hit.primitive, geometry: hit.geometry, copy })
    }

    fn intersect_packets<const N: usize>(&self, rays: &RayBlock) -> HitBlock {
        let mut hits = HitBlock::NONE;
        for start in (0..LANES).step_by(N) {
            let bits = lane_bits::<N>(rays.active(), start);
            if bits == 0 {
                continue;
            }
            let mut packet = RayHitPacket::new(load::<N>(rays, start));
            self.scene.intersect_packet(&PacketMask::from_bits(bits), &mut packet, self.coherence);
            let (ray, hit) = (&packet.ray, &packet.hit);
            // As in `hit`, side by side.
            let (mut u, mut v, mut is_hit) = ([0.0; N], [0.0; N], [false; N]);
            let mut is_copy = false;
            for i in 0..N {
                is_hit[i] = (hit.geometry[i] != INVALID_ID) & ray.t_max[i].is_finite();
                is_copy |= is_hit[i] & (hit.instance[i] != INVALID_ID);
                (u[i], v[i]) = Hit::weights(hit.u[i], hit.v[i]);
            }
            let bits = (0..N).fold(0, |bits, i| bits | u16::from(is_hit[i]) << i) & bits as u16;
            if !is_copy {
                let ids = [&hit.primitive, &hit.geometry];
                hits.set_lanes(start, bits, [&ray.t_max, &u, &v], ids);
                continue;
            }
            for i in lanes_of(bits) {
                hits.set(
                    start + i,
                    self.hit(&embree::Hit {
                        t: ray.t_max[i],
                        u: hit.u[i],
                        v: hit.v[i],
                        ng: [0.0; 3],
                        primitive: hit.primitive[i],
                        geometry: hit.geometry[i],
                        instance: hit.instance[i],
                        instance_primitive: hit.instance_primitive[i],
                    }),
                );
            }
        }
        hits
    }

    /// Which active rays are blocked by geometry of a mask.
    #[inline]
    fn occluded_in_packets(&self, rays: &RayBlock, mask: u32) -> u16 {
        match self.packet_width {
            16 => self.occluded_packets::<16>(rays, mask),
            8 => self.occluded_packets::<8>(rays, mask),
            4 => self.occluded_packets::<4>(rays, mask),
            _ => rays
                .lanes()
                .filter(|&lane| self.scene.occluded_by(&native(&rays.get(lane)), mask))
                .fold(0, |bits, lane| bits | 1 << lane),
        }
    }

    fn occluded_packets<const N: usize>(&self, rays: &RayBlock, mask: u32) -> u16 {
        let mut occluded = 0;
        for start in (0..LANES).step_by(N) {
            let bits = lane_bits::<N>(rays.active(), start);
            if bits == 0 {
                continue;
            }
            let mut packet = load::<N>(rays, start);
            packet.mask = [mask; N];
            self.scene.occluded_packet(&PacketMask::from_bits(bits), &mut packet, self.coherence);
            for i in lanes_of(bits as u16).filter(|&i| packet.is_occluded(i)) {
                occluded |= 1 << (start + i);
            }
        }
        occluded
    }
}

impl RayQuery for EmbreeAccel {
    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.scene.intersect(&native(ray)).and_then(|hit| self.hit(&hit))
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        self.scene.occluded(&native(ray))
    }

    #[inline]
    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.scene.occluded_by(&native(ray), OPAQUE)
    }

    #[inline]
    fn intersect_block(&self, rays: &RayBlock) -> HitBlock {
        match self.packet_width {
            16 => self.intersect_packets::<16>(rays),
            8 => self.intersect_packets::<8>(rays),
            4 => self.intersect_packets::<4>(rays),
            _ => HitBlock::from_fn(rays.active(), |lane| self.intersect(&rays.get(lane))),
        }
    }

    #[inline]
    fn occluded_block(&self, rays: &RayBlock) -> u16 {
        self.occluded_in_packets(rays, ALL)
    }

    #[inline]
    fn occluded_by_opaque_block(&self, rays: &RayBlock) -> u16 {
        self.occluded_in_packets(rays, OPAQUE)
    }
}

/// The active lanes among the `N` from `start` on.
#[inline]
fn lane_bits<const N: usize>(active: u16, start: usize) -> u32 {
    u32::from(active) >> start & ((1 << N) - 1)
}

/// Lanes `start .. start + N` as Embree's packet.
#[inline]
fn load<const N: usize>(rays: &RayBlock, start: usize) -> RayPacket<N> {
    let mut packet = RayPacket::empty();
    for (to, from) in [
        (&mut packet.org_x, &rays.org_x),
        (&mut packet.org_y, &rays.org_y),
        (&mut packet.org_z, &rays.org_z),
        (&mut packet.t_min, &rays.t_min),
        (&mut packet.dir_x, &rays.dir_x),
        (&mut packet.dir_y, &rays.dir_y),
        (&mut packet.dir_z, &rays.dir_z),
        (&mut packet.t_max, &rays.t_max),
    ] {
        to.copy_from_slice(&from[start..start + N]);
    }
    packet
}

#[inline]
fn native(ray: &Ray) -> embree::Ray {
    embree::Ray {
        origin: ray.origin.to_array(),
        direction: ray.direction.to_array(),
        t_min: ray.t_min,
        t_max: ray.t_max,
    }
}

/// How packets of camera rays and of their shadow rays run. Through one mesh they stay together: it takes
/// them 0.8 of the time. Among many copies, whose boxes overlap, they part: on 10,000 copies of a mesh of
/// 100,000 triangles it takes them 0.7 of the time to be led apart, from wherever one looks.
fn coherence(world: &World) -> Coherence {
    const FEW: usize = 64;
    let copies: usize = world.sets.iter().map(|set| set.transforms.len()).sum();
    if copies <= FEW { Coherence::Coherent } else { Coherence::Incoherent }
}

fn attach_group(
    builder: &mut SceneBuilder,
    device: &Device,
    group: &Group,
    quality: Quality,
) -> Result<(), EmbreeError> {
    for (index, geometry) in (0u32..).zip(&group.geometries) {
        let mut geometry = match geometry {
            Geometry::Mesh(mesh) => embree::Geometry::triangles(
                device,
                mesh.positions.shared(),
                Arc::clone(&mesh.triangles),
                quality,
            )?,
            Geometry::Shapes(shapes) => with_shapes!(shapes, list => user_geometry(device, list))?,
        };
        if group.is_clear(index as usize) {
            geometry = geometry.masked(CLEAR)?;
        }
        let id = builder.attach(geometry);
        // Hits are told apart by these ids: ours are Embree's.
        assert_eq!(id, index, "Embree numbers geometries in order");
    }
    Ok(())
}

/// The copies of a set, each in a box that fits it. Of turned solids Embree's own instances, in the box of
/// a turned box, are entered by twice as many rays.
fn copies(
    device: &Device,
    prototype: &Scene,
    set: &InstanceSet,
    reach: &Reach,
) -> Result<embree::Geometry, EmbreeError> {
    let place = |rows: &Transform3x4| {
        let world_from_object = affine_from_rows(rows);
        let object_from_world = rows_from_affine(&world_from_object.inverse());
        let bounds = reach.bounds(&world_from_object);
        // What the inverse, rounded, may move.
        let pad = 8.0 * f64::from(f32::EPSILON) * bounds.min.abs().max(bounds.max.abs());
        (object_from_world, outer_bounds(&Bounds { min: bounds.min - pad, max: bounds.max + pad }))
    };
    let (inverses, bounds) = set.transforms.par_iter().with_min_len(1024).map(place).unzip();
    embree::Geometry::copies(device, prototype, inverses, bounds)
}

/// Builds while `progress` is told, now and then and on a thread of its own, how far it is.
fn commit_watched(
    builder: SceneBuilder,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Scene, EmbreeError> {
    const EVERY: Duration = Duration::from_millis(20);
    let state = BuildProgress::default();
    if !progress(0.0) {
        return Err(EmbreeError::Cancelled);
    }
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        let watcher = scope.spawn(|| {
            thread::park_timeout(EVERY);
            while !is_over.load(Ordering::Acquire) {
                if !progress(state.done()) {
                    state.stop();
                }
                thread::park_timeout(EVERY);
            }
        });
        let scene = builder.commit_with(&state);
        is_over.store(true, Ordering::Release);
        watcher.thread().unpark();
        scene
    })
}

fn user_geometry<S: AnalyticShape>(
    device: &Device,
    shapes: &Arc<Vec<S>>,
) -> Result<embree::Geometry, EmbreeError> {
    let bounds = shapes.iter().map(|shape| outer_bounds(&shape.bounds())).collect();
    embree::Geometry::user(device, bounds, Arc::new(Shapes(Arc::clone(shapes))))
}

/// A box, rounded outward to f32.
fn outer_bounds(b: &Bounds) -> UserBounds {
    /// Where things without end are taken to end: areas of boxes stay far from overflow.
    const END: f32 = 1e15;
    let down = |p: DVec3| p.as_vec3().to_array().map(|x| x.next_down().max(-END));
    let up = |p: DVec3| p.as_vec3().to_array().map(|x| x.next_up().min(END));
    UserBounds { lower: down(b.min), upper: up(b.max) }
}

/// Shapes of one kind as Embree's callbacks see them: solved in f64.
struct Shapes<S>(Arc<Vec<S>>);

// Always inlined: Embree's callback is nothing but this, and is called two or three times a ray.
impl<S: AnalyticShape> UserGeometry for Shapes<S> {
    #[inline(always)]
    fn intersect(&self, primitive: u32, ray: &embree::Ray) -> Option<UserHit> {
        let shape = self.0.get(primitive as usize)?;
        let (origin, direction, t_min, t_max) = widened(ray);
        let hit = shape.intersect(origin, direction, t_min, t_max)?;
        Some(UserHit { t: hit.t as f32, u: Hit::u_of_part(hit.part), v: 0.0 })
    }

    #[inline(always)]
    fn occluded(&self, primitive: u32, ray: &embree::Ray) -> bool {
        let Some(shape) = self.0.get(primitive as usize) else { return false };
        let (origin, direction, t_min, t_max) = widened(ray);
        shape.occluded(origin, direction, t_min, t_max)
    }
}

/// Origin, direction and ends of a ray in f64.
#[inline]
fn widened(ray: &embree::Ray) -> (DVec3, DVec3, f64, f64) {
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    (wide(ray.origin), wide(ray.direction), ray.t_min.into(), ray.t_max.into())
}
