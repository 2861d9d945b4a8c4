//! Sixteen rays that run close together through a tree.
//!
//! A node's eight boxes are tested at once against all that the rays could be: intervals of origins and
//! reciprocal directions. Source: Wald, Boulos, Shirley, *Ray tracing deformable scenes using dynamic
//! bounding volume hierarchies*, TOG 26(1), 2007. The box of what is visited next is tested against the
//! sixteen rays; at a leaf, each that meets it is tested as a single ray is: with the same results to the
//! last bit.

use super::super::block::{LANES, RayBlock, lanes_of, lanes_where};
use super::node::{Content, Node, Tree, WIDTH};
use super::ray::{RaySetup, ShearRay};
use super::simd::{Floats, Simd, Stack};
use super::traverse::{Found, Items, STACK, ask};

/// The rays of a block whose directions have the same signs: the fields of [`RaySetup`], a lane each.
pub(super) struct Packet {
    active: u16,
    origin: [[f32; LANES]; 3],
    far_origin: [[f32; LANES]; 3],
    near: [[f32; LANES]; 3],
    far: [[f32; LANES]; 3],
    t_min: [f32; LANES],
    /// Negative infinity where nothing is looked for (any more).
    t_max: [f32; LANES],
    last: [u32; LANES],
    shear: [[f32; LANES]; 3],
    /// By axis, for the plane that is entered first and then for the other: the end of the interval of
    /// origins that counts, and both ends of that of reciprocals.
    intervals: [[[f32; 3]; 2]; 3],
    sign: [usize; 3],
    least_t: f32,
}

impl Packet {
    /// None where signs differ.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "several arrays run along together")]
    pub(super) fn new<S: Simd, const ROBUST: bool>(simd: S, block: &RayBlock) -> Option<Self> {
        const NOTHING: [f32; LANES] = [0.0; LANES];
        let mut packet = Self {
            active: 0,
            origin: [NOTHING; 3],
            far_origin: [NOTHING; 3],
            near: [NOTHING; 3],
            far: [NOTHING; 3],
            t_min: NOTHING,
            t_max: NOTHING,
            last: [0; LANES],
            shear: [NOTHING; 3],
            intervals: [[[0.0; 3]; 2]; 3],
            sign: [0; 3],
            least_t: 0.0,
        };
        let mut is_ray = [false; LANES];
        for i in 0..LANES {
            let o = [block.org_x[i], block.org_y[i], block.org_z[i]];
            let d = [block.dir_x[i], block.dir_y[i], block.dir_z[i]];
            let (ray, is) = RaySetup::of::<ROBUST>(o, d, [block.t_min[i], block.t_max[i]]);
            is_ray[i] = is;
            for axis in 0..3 {
                packet.origin[axis][i] = ray.origin[axis];
                packet.far_origin[axis][i] = ray.far_origin[axis];
                packet.near[axis][i] = ray.near[axis];
                packet.far[axis][i] = ray.far[axis];
                packet.shear[axis][i] = ray.shear[axis];
            }
            packet.t_min[i] = ray.t_min;
            packet.t_max[i] = ray.t_max;
            packet.last[i] = ray.last;
        }
        packet.active = block.active() & lanes_where(&is_ray);
        // Lanes without a ray repeat one that is there, and look for nothing.
        let first = packet.active.trailing_zeros() as usize % LANES;
        for lane in lanes_of(!packet.active) {
            for axis in 0..3 {
                packet.origin[axis][lane] = packet.origin[axis][first];
                packet.far_origin[axis][lane] = packet.far_origin[axis][first];
                packet.near[axis][lane] = packet.near[axis][first];
                packet.far[axis][lane] = packet.far[axis][first];
            }
            packet.t_min[lane] = packet.t_min[first];
            packet.t_max[lane] = f32::NEG_INFINITY;
        }
        packet.least_t = simd.load16(&packet.t_min).least();
        for axis in 0..3 {
            let near = simd.load16(&packet.near[axis]);
            let (low, high) = (near.least(), near.greatest());
            if low < 0.0 && high >= 0.0 {
                return None;
            }
            packet.sign[axis] = usize::from(low < 0.0);
            let (origin, far_origin) =
                (simd.load16(&packet.origin[axis]), simd.load16(&packet.far_origin[axis]));
            let ends = if packet.sign[axis] == 0 {
                [origin.greatest(), far_origin.least()]
            } else {
                [origin.least(), far_origin.greatest()]
            };
            let far = simd.load16(&packet.far[axis]);
            packet.intervals[axis] =
                [[ends[0], low, high], [ends[1], far.least(), far.greatest()]];
        }
        Some(packet)
    }

    /// The ray of a lane, for triangles and spheres.
    #[inline(always)]
    fn shear_ray<S: Simd>(&self, simd: S, lane: usize) -> ShearRay<S::F8> {
        let of = |lanes: &[[f32; LANES]; 3]| [lanes[0][lane], lanes[1][lane], lanes[2][lane]];
        let (origin, shear) = (of(&self.origin), of(&self.shear));
        ShearRay::of(simd, origin, shear, self.last[lane], self.t_min[lane])
    }

    /// Calls `visit` for each leaf that rays meet, the nearest first, with their lanes and how far each ray
    /// looks; where it changed that, it returns true. Ends where none looks for anything any more.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "several arrays run along together")]
    fn traverse<S: Simd>(
        &self,
        simd: S,
        tree: &Tree,
        mut visit: impl FnMut(Content, u16, &mut S::F16) -> bool,
    ) {
        if tree.nodes.is_empty() || self.active == 0 {
            return;
        }
        let mut intervals = [[[simd.splat8(0.0); 3]; 2]; 3];
        for axis in 0..3 {
            for side in 0..2 {
                for end in 0..3 {
                    intervals[axis][side][end] = simd.splat8(self.intervals[axis][side][end]);
                }
            }
        }
        let least_t = simd.splat8(self.least_t);
        let sign = self.sign;
        // In a register, not in memory: what is written by lane cannot be read at once side by side.
        let mut t_max = simd.load16(&self.t_max);
        let mut furthest = t_max.greatest();
        let mut stack = Stack::<STACK>::new();
        let mut index = 0;
        loop {
            let node = &tree.nodes[index];
            let (mut near, mut far) = (least_t, simd.splat8(furthest));
            for axis in 0..3 {
                let [[origin, a, b], [far_origin, c, d]] = intervals[axis];
                let way = simd.load8(&node.planes[axis][sign[axis] & 1]).sub(origin);
                near = near.max(way.mul(a).min(way.mul(b)));
                let way = simd.load8(&node.planes[axis][sign[axis] & 1 ^ 1]).sub(far_origin);
                far = far.min(way.mul(c).max(way.mul(d)));
            }
            let mut bits = near.le(far);
            if bits != 0 {
                let near = near.to_array();
                let start = stack.len();
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize & 7;
                    bits &= bits - 1;
                    tree.prefetch(node.children[lane]);
                    let slot = (index * WIDTH + lane) as u64;
                    stack.push(u64::from(near[lane].to_bits()) << 32 | slot);
                }
                super::traverse::sort(stack.since(start));
            }
            // On to the next node, by way of leaves.
            index = loop {
                let Some(entry) = stack.pop() else { return };
                if f32::from_bits((entry >> 32) as u32) > furthest {
                    continue;
                }
                let (parent, lane) = ((entry as u32) as usize / WIDTH, entry as usize % WIDTH);
                let node = &tree.nodes[parent];
                let content = node.children[lane].content();
                let lanes = self.lanes_that_meet(simd, node, lane, t_max);
                if lanes == 0 {
                    continue;
                }
                if let Content::Node(index) = content {
                    break index;
                }
                if visit(content, lanes, &mut t_max) {
                    furthest = t_max.greatest();
                    if furthest == f32::NEG_INFINITY {
                        return;
                    }
                }
            };
        }
    }

    /// Where each ray passes the planes of a child that are entered (`side` 0) or left (1) by, by axis.
    #[inline(always)]
    fn lane_times<S: Simd>(&self, simd: S, node: &Node, child: usize, side: usize) -> [S::F16; 3] {
        let (origins, reciprocals) =
            if side == 0 { (&self.origin, &self.near) } else { (&self.far_origin, &self.far) };
        let mut times = [simd.splat16(0.0); 3];
        for axis in 0..3 {
            let plane = simd.splat16(node.planes[axis][self.sign[axis] & 1 ^ side][child]);
            let way = plane.sub(simd.load16(&origins[axis]));
            times[axis] = way.mul(simd.load16(&reciprocals[axis]));
        }
        times
    }

    /// The rays that meet the box of a child before `t_max`.
    #[inline(always)]
    fn lanes_that_meet<S: Simd>(&self, simd: S, node: &Node, child: usize, t_max: S::F16) -> u16 {
        let near = self.lane_times(simd, node, child, 0);
        let far = self.lane_times(simd, node, child, 1);
        let enter = near[0].max(near[1]).max(near[2].max(simd.load16(&self.t_min)));
        let exit = far[0].min(far[1]).min(far[2].min(t_max));
        enter.le(exit) as u16
    }
}

/// The closest hit of each ray, as [`super::traverse::closest`] finds it.
#[inline(always)]
pub(super) fn closest<S: Simd, const ROBUST: bool>(
    simd: S,
    tree: &Tree,
    items: impl Items,
    block: &RayBlock,
    packet: &mut Packet,
) -> [Found; LANES] {
    if tree.is_of_triangles {
        closest_in::<S, ROBUST, true>(simd, tree, items, block, packet)
    } else {
        closest_in::<S, ROBUST, false>(simd, tree, items, block, packet)
    }
}

/// `TRIANGLES`: there is nothing else.
#[inline(always)]
fn closest_in<S: Simd, const ROBUST: bool, const TRIANGLES: bool>(
    simd: S,
    tree: &Tree,
    items: impl Items,
    block: &RayBlock,
    packet: &mut Packet,
) -> [Found; LANES] {
    let mut best = [Found::nothing(0.0); LANES];
    for lane in lanes_of(packet.active) {
        best[lane] = Found::nothing(packet.t_max[lane]);
        for &item in &tree.endless {
            ask(simd, items, item, &block.get(lane), &mut best[lane]);
        }
        packet.t_max[lane] = best[lane].t;
    }
    packet.traverse(simd, tree, |content, lanes, t_max| {
        let mut is_changed = false;
        for lane in lanes_of(lanes) {
            let lane = lane % LANES;
            let best = &mut best[lane];
            let before = best.t;
            match content {
                Content::Triangles(index) => {
                    let triangles = &tree.blocks[index];
                    let ray = packet.shear_ray(simd, lane);
                    ray.each_hit::<S, ROBUST>(simd, triangles, before, |i, hit| {
                        let found = Found::triangle(hit, triangles.ids[i]);
                        if found.is_before(best) {
                            *best = found;
                        }
                        false
                    });
                }
                Content::Spheres(index) if !TRIANGLES => {
                    let shear = packet.shear_ray(simd, lane);
                    shear.closest_sphere(simd, &tree.spheres[index], &block.get(lane), best);
                }
                Content::Item(item) if !TRIANGLES => {
                    ask(simd, items, item, &block.get(lane), best);
                }
                Content::Node(_) | Content::Spheres(_) | Content::Item(_) => {}
            }
            if best.t < before {
                *t_max = t_max.choose(1 << lane, simd.splat16(best.t));
                is_changed = true;
            }
        }
        is_changed
    });
    best
}

/// Which rays hit anything, as [`super::traverse::any`] finds it.
#[inline(always)]
pub(super) fn any<S: Simd, const ROBUST: bool, const OPAQUE: bool>(
    simd: S,
    tree: &Tree,
    items: impl Items,
    block: &RayBlock,
    packet: &mut Packet,
) -> u16 {
    if tree.is_of_triangles {
        any_in::<S, ROBUST, OPAQUE, true>(simd, tree, items, block, packet)
    } else {
        any_in::<S, ROBUST, OPAQUE, false>(simd, tree, items, block, packet)
    }
}

#[inline(always)]
fn any_in<S: Simd, const ROBUST: bool, const OPAQUE: bool, const TRIANGLES: bool>(
    simd: S,
    tree: &Tree,
    items: impl Items,
    block: &RayBlock,
    packet: &mut Packet,
) -> u16 {
    let mut occluded = 0;
    for lane in lanes_of(packet.active).filter(|_| !tree.endless.is_empty()) {
        let ray = block.get(lane);
        if tree.endless.iter().any(|&item| items.occluded::<S, OPAQUE>(simd, item, &ray)) {
            occluded |= 1 << lane;
            packet.t_max[lane] = f32::NEG_INFINITY;
        }
    }
    if occluded == packet.active {
        return occluded;
    }
    packet.traverse(simd, tree, |content, lanes, t_max| {
        let mut hits = 0;
        for lane in lanes_of(lanes) {
            let lane = lane % LANES;
            let mut is_hit = false;
            match content {
                Content::Triangles(index) => {
                    let triangles = &tree.blocks[index];
                    let ray = packet.shear_ray(simd, lane);
                    ray.each_hit::<S, ROBUST>(simd, triangles, packet.t_max[lane], |i, _| {
                        is_hit = !(OPAQUE && items.is_clear(triangles.ids[i]));
                        is_hit
                    });
                }
                Content::Spheres(index) if !TRIANGLES => {
                    let counts = |id| !(OPAQUE && items.is_clear(id));
                    let (shear, spheres) = (packet.shear_ray(simd, lane), &tree.spheres[index]);
                    is_hit = shear.meets_sphere(simd, spheres, &block.get(lane), counts);
                }
                Content::Item(item) if !TRIANGLES => {
                    is_hit = items.occluded::<S, OPAQUE>(simd, item, &block.get(lane));
                }
                Content::Node(_) | Content::Spheres(_) | Content::Item(_) => {}
            }
            hits |= u16::from(is_hit) << lane;
        }
        occluded |= hits;
        *t_max = t_max.choose(hits.into(), simd.splat16(f32::NEG_INFINITY));
        hits != 0
    });
    occluded
}
