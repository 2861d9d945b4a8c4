//! The recursive ray tree: the lecture's shading equation at every hit, and from mirrors and glass one
//! or two rays more.
//!
//! Source: Whitted, *An Improved Illumination Model for Shaded Display*, CACM 23(6) 1980.
//!
//! The tree is walked with a stack of its own, so no depth overflows the thread's. First hits are
//! shaded as a block: their shadow rays towards one light run close together and are traced in packets.
//! So are the rays that a block sends off a flat mirror or through a flat pane. Where it is known what rays
//! come to, they stay a block as well. Other rays off curved surfaces spread, and are traced one by one, depth
//! first: put into blocks of any that wait, they were shaded sooner, but queries took as much longer.
//!
//! It is compiled three times ([`Features`]), so that a scene without mirrors, or with nothing but
//! mirrors, glass and lamps, runs code that knows of nothing else.

mod direct;
mod fork;
mod light;
mod scatter;
mod shadow;
mod volume;

use std::marker::PhantomData;

use super::{CameraBlock, Integrator, RayCounts};
use crate::accel::{Hit, HitBlock, LANES, RayBlock, RayQuery};
use crate::color::{Rgb, RgbLanes};
use crate::material::Material;
use crate::math::Ray;
use crate::medium::{Interior, beer_lambert};
use crate::sampler::Sampler;
use crate::scene::{Cone, FarSide, Scene, SurfacePoint};
use direct::direct_light;
use scatter::{MIN_PACKET, Way};

/// What a compiled variant knows of.
pub trait Features: Send + Sync + 'static {
    /// Mirrored and refracted rays.
    const TREE: bool;
    /// Textures, area lights, many lights, glowing surfaces, fog, light dimmed by glass, dispersion.
    const EVERYTHING: bool;
}

/// Lamps, diffuse and shiny surfaces: camera and shadow rays.
#[derive(Debug, Clone, Copy)]
pub struct Local;

/// With mirrors and glass.
#[derive(Debug, Clone, Copy)]
pub struct Tree;

/// With all there is.
#[derive(Debug, Clone, Copy)]
pub struct Everything;

impl Features for Local {
    const TREE: bool = false;
    const EVERYTHING: bool = false;
}

impl Features for Tree {
    const TREE: bool = true;
    const EVERYTHING: bool = false;
}

impl Features for Everything {
    const TREE: bool = true;
    const EVERYTHING: bool = true;
}

/// The ray tree, in the variant `F`.
#[derive(Debug, Clone, Copy)]
pub struct Whitted<F> {
    max_depth: Option<u32>,
    features: PhantomData<F>,
}

impl<F> Whitted<F> {
    /// A tree of at most `max_depth` bounces: 0 is the camera ray and its direct light. None for local
    /// illumination, which knows of no bounces that it would miss.
    pub const fn new(max_depth: Option<u32>) -> Self {
        Self { max_depth, features: PhantomData }
    }
}

/// Rays that wait, for which there is room at the start: two of each lane of a block.
const STACK: usize = 2 * LANES;

/// A ray of the tree.
#[derive(Debug, Clone, Copy)]
struct Node {
    ray: Ray,
    /// What its radiance counts for in the pixel.
    throughput: Rgb,
    /// The media that it is inside of.
    interior: Interior,
    /// Numbers for this node alone.
    sampler: Sampler,
    /// How wide it is, for textures.
    cone: Cone,
    /// The one wavelength that it carries, in nm; 0 while it carries all.
    wavelength: f32,
    /// Bounces before it.
    depth: u32,
    /// Surfaces between equal media that it has passed straight.
    passed: u16,
    /// Which pixel of the block it belongs to.
    lane: u8,
    /// How it left its parent.
    way: Way,
    /// What it comes to, where no query is needed to know it.
    known: Option<FarSide>,
    /// What of its way lies before its origin, where it did not begin there.
    before: f32,
}

/// Rays of several lanes that run close together, and what they hit.
struct Block {
    /// By lane.
    nodes: [Node; LANES],
    rays: RayBlock,
    hits: HitBlock,
}

/// The surfaces that up to `N` rays hit, by lane, with all there is.
struct Hits<'s, const N: usize> {
    points: [Option<SurfacePoint<'s>>; N],
    /// What light that leaves the surface towards the ray counts for in the pixel.
    weights: [Rgb; N],
    /// How wide the ray is there, and the material if textures changed it.
    textured: [(Cone, Option<Material>); N],
}

impl<'s, const N: usize> Hits<'s, N> {
    #[inline]
    fn none() -> Self {
        let textured = std::array::from_fn(|_| (Cone::default(), None));
        Self { points: [const { None }; N], weights: [Rgb::BLACK; N], textured }
    }

    /// Point and material of a lane that hit something.
    #[inline]
    fn get(&self, lane: usize) -> Option<(&SurfacePoint<'s>, &Material)> {
        let point = self.points[lane].as_ref()?;
        Some((point, self.textured[lane].1.as_ref().unwrap_or(point.material)))
    }
}

/// The walk through the trees of a block.
struct Walk<'a, Q, F> {
    scene: &'a Scene,
    query: &'a Q,
    max_depth: Option<u32>,
    camera: &'a CameraBlock<'a>,
    counts: &'a mut RayCounts,
    /// Single rays to be traced.
    stack: Vec<Node>,
    /// Blocks that have been traced, to be shaded.
    blocks: Vec<Block>,
    /// Room for rays that left one block.
    gathered: Vec<Node>,
    radiance: [Rgb; LANES],
    features: PhantomData<F>,
}

impl<F: Features> Integrator for Whitted<F> {
    fn shade<Q: RayQuery>(
        &self,
        scene: &Scene,
        query: &Q,
        camera: &CameraBlock<'_>,
        counts: &mut RayCounts,
    ) -> RgbLanes<LANES> {
        self.trace(scene, query, camera, counts, None)
    }

    fn shade_split<Q: RayQuery>(
        &self,
        scene: &Scene,
        query: &Q,
        camera: &CameraBlock<'_>,
        counts: &mut RayCounts,
    ) -> (RgbLanes<LANES>, RgbLanes<LANES>) {
        let mut direct = RgbLanes::BLACK;
        let radiance = self.trace(scene, query, camera, counts, Some(&mut direct));
        (radiance, direct)
    }
}

impl<F: Features> Whitted<F> {
    /// The radiance along camera rays, and the part of it that is `direct` where that is asked for.
    #[inline]
    fn trace<Q: RayQuery>(
        &self,
        scene: &Scene,
        query: &Q,
        camera: &CameraBlock<'_>,
        counts: &mut RayCounts,
        direct: Option<&mut RgbLanes<LANES>>,
    ) -> RgbLanes<LANES> {
        if !F::TREE {
            let radiance = local(scene, query, camera, counts);
            if let Some(direct) = direct {
                *direct = radiance;
            }
            return radiance;
        }
        let mut walk = Walk::<Q, F> {
            scene,
            query,
            max_depth: self.max_depth,
            camera,
            counts,
            stack: Vec::with_capacity(STACK),
            blocks: Vec::new(),
            gathered: Vec::new(),
            radiance: [Rgb::BLACK; LANES],
            features: PhantomData,
        };
        let mut nodes: [Node; LANES] = std::array::from_fn(|lane| {
            let ray = camera.rays.get(lane);
            Node {
                cone: if F::EVERYTHING { Cone::of_pixel(scene, &ray) } else { Cone::default() },
                ray,
                throughput: Rgb::splat(1.0),
                interior: scene.camera_interior,
                sampler: camera.samplers[lane],
                wavelength: 0.0,
                depth: 0,
                passed: 0,
                lane: lane as u8,
                way: Way::Refracted,
                known: None,
                before: if F::EVERYTHING { way_before(scene, &ray) } else { 0.0 },
            }
        });
        if F::EVERYTHING && scene.fog.is_some() {
            walk.before_the_scene(&mut nodes);
        }
        walk.shade_block(camera.rays, camera.hits, &nodes);
        for lane in (0..LANES).filter(|lane| camera.rays.active() >> lane & 1 == 0) {
            walk.radiance[lane] = scene.background;
        }
        // All that follows has bounced.
        if let Some(direct) = direct {
            *direct = RgbLanes::from_fn(|lane| walk.radiance[lane]);
        }
        walk.run();
        RgbLanes::from_fn(|lane| walk.radiance[lane])
    }
}

impl<Q: RayQuery, F: Features> Walk<'_, Q, F> {
    /// Traces and shades what is left, depth first.
    fn run(&mut self) {
        loop {
            while let Some(node) = self.stack.pop() {
                let hit = match node.known {
                    Some(side) => Some(side.hit(&node.ray)),
                    None => self.query.intersect(&node.ray),
                };
                self.shade_one(&node, hit.as_ref());
            }
            let Some(Block { nodes, rays, hits }) = self.blocks.pop() else { return };
            self.shade_block(&rays, &hits, &nodes);
        }
    }

    /// Shades what one ray hit.
    #[inline]
    fn shade_one(&mut self, node: &Node, hit: Option<&Hit>) {
        if F::EVERYTHING {
            self.shade(1, std::array::from_ref(node), |_| hit.copied());
            return;
        }
        let scene = self.scene;
        let weight = self.through_media(node, hit.map_or(f32::INFINITY, |hit| hit.t));
        let Some(hit) = hit else {
            self.counts.ends.miss += 1;
            self.radiance[node.lane as usize] += weight * scene.background;
            return;
        };
        let point = scene.surface(&node.ray, hit);
        let material = point.material;
        if material.is_lit() {
            let light = material.ambient() * scene.ambient + self.lamps(node, &point);
            self.radiance[node.lane as usize] += weight * light;
        }
        if self.max_depth.is_none() {
            return;
        }
        if material.is_specular() {
            self.children(node, &point, material, weight, Cone::default());
        } else {
            self.counts.ends.diffuse += 1;
        }
    }

    /// Shades the hits of a block of rays that run close together.
    fn shade_block(&mut self, rays: &RayBlock, hits: &HitBlock, nodes: &[Node; LANES]) {
        if F::EVERYTHING {
            self.shade(rays.active(), nodes, |lane| hits.get(lane));
            return;
        }
        let scene = self.scene;
        let points = scene.surfaces(rays, hits);
        let query = self.query;
        let blocked = |rays: &RayBlock| Self::blocked(scene, query, rays);
        let light = direct_light(scene, rays, &points, self.counts, blocked);
        let mut weights = [Rgb::BLACK; LANES];
        for lane in rays.lanes() {
            let node = &nodes[lane];
            let hit = hits.get(lane);
            weights[lane] = self.through_media(node, hit.map_or(f32::INFINITY, |hit| hit.t));
            let seen = match hit {
                Some(_) => light.get(lane),
                None => scene.background,
            };
            self.counts.ends.miss += u64::from(hit.is_none());
            self.radiance[node.lane as usize] += weights[lane] * seen;
        }
        if self.max_depth.is_none() {
            return;
        }
        let before = self.stack.len();
        self.fork(rays, hits, &points, nodes, &weights);
        if self.stack.len() - before >= MIN_PACKET {
            self.gather(before);
        }
    }

    /// Adds the light of the hits of up to `N` rays to their pixels, with all there is, and sends their children
    /// on.
    #[inline]
    fn shade<const N: usize>(
        &mut self,
        active: u16,
        nodes: &[Node; N],
        hit: impl Fn(usize) -> Option<Hit>,
    ) {
        let scene = self.scene;
        let mut hits = Hits::<N>::none();
        for lane in (0..N).filter(|lane| active >> lane & 1 == 1) {
            let node = &nodes[lane];
            let hit = hit(lane);
            let weight = self.through_media(node, hit.map_or(f32::INFINITY, |hit| hit.t));
            let Some(hit) = &hit else {
                self.counts.ends.miss += 1;
                self.radiance[node.lane as usize] += weight * scene.background;
                continue;
            };
            hits.weights[lane] = weight;
            let point = hits.points[lane].insert(scene.surface(&node.ray, hit));
            if scene.has_maps() {
                let cone = scene.widened(node.cone, hit, point.position);
                hits.textured[lane] = (cone, scene.apply_maps(hit, cone.width, point));
            }
            self.radiance[node.lane as usize] += weight * scene.emission(point);
            if let Some((_, material)) = hits.get(lane)
                && material.is_lit()
            {
                self.radiance[node.lane as usize] += weight * material.ambient() * scene.ambient;
            }
        }
        self.light(&hits, nodes);
        if self.max_depth.is_some() {
            self.scatter(&hits, nodes);
        }
    }

    /// Takes from each camera ray what fog takes of its light between the scene and a far camera, where
    /// rays do not start at it; the fog's own light is added to the pixels.
    fn before_the_scene(&mut self, nodes: &mut [Node; LANES]) {
        for lane in self.camera.rays.lanes() {
            let node = &mut nodes[lane];
            if node.before <= 0.0 {
                continue;
            }
            let (o, d) = (node.ray.origin.as_dvec3(), node.ray.direction.as_dvec3());
            let start = (o - d * f64::from(node.before)).as_vec3();
            let ray = Ray::new(start, node.ray.direction);
            node.throughput = self.through_media(&Node { ray, before: 0.0, ..*node }, node.before);
        }
    }

    /// The throughput of a ray after `distance`, in the media that it runs through; fog's own light is
    /// added to the pixel.
    #[inline]
    fn through_media(&mut self, node: &Node, distance: f32) -> Rgb {
        let mut throughput = node.throughput;
        if F::EVERYTHING && !self.scene.volumes.is_empty() {
            return self.through_volumes(node, distance);
        }
        if !node.interior.is_outside() {
            if self.scene.requirements.absorbing > 0
                && let Some(medium) = self.scene.medium(node.interior)
            {
                throughput *= beer_lambert(medium.absorption, distance);
            }
        } else if F::EVERYTHING
            && let Some(fog) = &self.scene.fog
        {
            let transmittance = fog.transmittance_after(node.before, &node.ray, distance);
            self.radiance[node.lane as usize] += throughput * fog.in_scattered(transmittance);
            throughput *= transmittance;
        }
        throughput
    }
}

/// The radiance along each camera ray of a block, without a tree.
fn local<Q: RayQuery>(
    scene: &Scene,
    query: &Q,
    camera: &CameraBlock<'_>,
    counts: &mut RayCounts,
) -> RgbLanes<LANES> {
    let points = scene.surfaces(camera.rays, camera.hits);
    counts.ends.miss += u64::from((camera.rays.active() & !points.hit()).count_ones());
    let blocked = |rays: &RayBlock| query.occluded_block(rays);
    let mut radiance = direct_light(scene, camera.rays, &points, counts, blocked);
    for (values, background) in radiance.0.iter_mut().zip(scene.background.to_array()) {
        for (lane, value) in values.iter_mut().enumerate() {
            let is_hit = points.hit() >> lane & 1 == 1;
            *value = if is_hit { *value } else { background };
        }
    }
    radiance
}

/// How far a far camera's ray has come when it starts at the scene's box.
fn way_before(scene: &Scene, ray: &Ray) -> f32 {
    if !scene.camera.is_far() {
        return 0.0;
    }
    let from_eye = ray.origin.as_dvec3() - scene.camera.pose().eye;
    from_eye.dot(ray.direction.as_dvec3()).max(0.0) as f32
}
