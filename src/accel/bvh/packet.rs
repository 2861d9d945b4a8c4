//! Sixteen rays that run close together through a tree.
//!
//! A node's eight boxes are tested at once against all that the rays could be: intervals of origins and
//! reciprocal directions. Source: Boulos et al., *Interval arithmetic for ray packets* (Wald, Boulos,
//! Shirley, *Ray tracing deformable scenes using dynamic bounding volume hierarchies*, TOG 26(1), 2007). At a
//! leaf, its box is tested against the sixteen rays, and each that meets it is tested as a single ray is:
//! with the same results to the last bit.

use super::super::block::{LANES, RayBlock, lanes_of};
use super::node::{Content, Node, Tree, WIDTH};
use super::ray::RaySetup;
use super::simd::{Floats, Simd, Stack};
use super::traverse::{Found, Items, STACK};
use super::triangle::ShearRay;
use crate::math::Ray;

/// The rays of a block whose directions have the same signs.
pub(super) struct Packet {
    rays: [RaySetup; LANES],
    active: u16,
    origin: [[f32; LANES]; 3],
    near: [[f32; LANES]; 3],
    far: [[f32; LANES]; 3],
    t_min: [f32; LANES],
    /// Negative infinity where nothing is looked for (any more).
    t_max: [f32; LANES],
    /// By axis, for the plane that is entered first and then for the other: the end of the interval of
    /// origins that counts, and both ends of that of reciprocals.
    intervals: [[[f32; 3]; 2]; 3],
    sign: [usize; 3],
    least_t: f32,
}

impl Packet {
    /// None where signs differ.
    #[inline(always)]
    pub(super) fn new<const ROBUST: bool>(block: &RayBlock) -> Option<Self> {
        let mut packet = Self {
            rays: [RaySetup::NOTHING; LANES],
            active: 0,
            origin: [[0.0; LANES]; 3],
            near: [[0.0; LANES]; 3],
            far: [[0.0; LANES]; 3],
            t_min: [0.0; LANES],
            t_max: [f32::NEG_INFINITY; LANES],
            intervals: [[[0.0; 3]; 2]; 3],
            sign: [0; 3],
            least_t: f32::INFINITY,
        };
        let mut sign = None;
        for lane in block.lanes() {
            let Some(setup) = RaySetup::new::<ROBUST>(&block.get(lane)) else { continue };
            if *sign.get_or_insert(setup.sign) != setup.sign {
                return None;
            }
            for axis in 0..3 {
                packet.origin[axis][lane] = setup.origin[axis];
                packet.near[axis][lane] = setup.near[axis];
                packet.far[axis][lane] = setup.far[axis];
            }
            packet.t_min[lane] = setup.t_min;
            packet.t_max[lane] = setup.t_max;
            packet.least_t = packet.least_t.min(setup.t_min);
            packet.active |= 1 << lane;
            packet.rays[lane] = setup;
        }
        packet.sign = sign.unwrap_or_default();
        let ends = |values: &[f32; LANES]| {
            lanes_of(packet.active).fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], lane| {
                [a.min(values[lane]), b.max(values[lane])]
            })
        };
        packet.intervals = [0, 1, 2].map(|axis| {
            let [lower, upper] = ends(&packet.origin[axis]);
            let ([a, b], [c, d]) = (ends(&packet.near[axis]), ends(&packet.far[axis]));
            match packet.sign[axis] {
                0 => [[upper, a, b], [lower, c, d]],
                _ => [[lower, a, b], [upper, c, d]],
            }
        });
        Some(packet)
    }

    /// The furthest that any ray goes.
    #[inline(always)]
    fn furthest(&self) -> f32 {
        self.t_max.iter().fold(f32::NEG_INFINITY, |a, &b| if a > b { a } else { b })
    }

    /// Calls `visit` for each child that may be met, nearest first, with the lanes that meet its box, until
    /// it returns false.
    #[inline(always)]
    fn traverse<S: Simd>(
        &mut self,
        simd: S,
        tree: &Tree,
        mut visit: impl FnMut(&mut Self, Content, u16) -> bool,
    ) {
        if tree.nodes.is_empty() || self.active == 0 {
            return;
        }
        let splat = |[x, y, z]: [f32; 3]| [simd.splat8(x), simd.splat8(y), simd.splat8(z)];
        let intervals = self.intervals.map(|[near, far]| [splat(near), splat(far)]);
        let least_t = simd.splat8(self.least_t);
        let sign = self.sign;
        let mut furthest = self.furthest();
        let mut stack = Stack::<STACK>::new();
        let mut index = 0;
        loop {
            let node = &tree.nodes[index];
            let enter = |axis: usize| {
                let [origin, a, b] = intervals[axis][0];
                let d = simd.load8(&node.planes[axis][sign[axis] & 1]).sub(origin);
                d.mul(a).min(d.mul(b))
            };
            let exit = |axis: usize| {
                let [origin, a, b] = intervals[axis][1];
                let d = simd.load8(&node.planes[axis][sign[axis] & 1 ^ 1]).sub(origin);
                d.mul(a).max(d.mul(b))
            };
            let near = enter(0).max(enter(1)).max(enter(2).max(least_t));
            let far = exit(0).min(exit(1)).min(exit(2).min(simd.splat8(furthest)));
            let mut bits = near.le(far);
            if bits != 0 {
                let near = near.to_array();
                let start = stack.len();
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize & 7;
                    bits &= bits - 1;
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
                if let Content::Node(index) = content {
                    break index;
                }
                let lanes = self.lanes_that_meet(simd, node, lane);
                if lanes != 0 {
                    if !visit(self, content, lanes) {
                        return;
                    }
                    furthest = self.furthest();
                }
            };
        }
    }

    /// The rays that meet the box of a child.
    #[inline(always)]
    fn lanes_that_meet<S: Simd>(&self, simd: S, node: &Node, child: usize) -> u16 {
        let near = |axis: usize| {
            let plane = simd.splat16(node.planes[axis][self.sign[axis] & 1][child]);
            plane.sub(simd.load16(&self.origin[axis])).mul(simd.load16(&self.near[axis]))
        };
        let far = |axis: usize| {
            let plane = simd.splat16(node.planes[axis][self.sign[axis] & 1 ^ 1][child]);
            plane.sub(simd.load16(&self.origin[axis])).mul(simd.load16(&self.far[axis]))
        };
        let enter = near(0).max(near(1)).max(near(2).max(simd.load16(&self.t_min)));
        let exit = far(0).min(far(1)).min(far(2).min(simd.load16(&self.t_max)));
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
    let mut best = [Found::nothing(0.0); LANES];
    let ask = |item: u32, lane: usize, packet: &mut Packet, best: &mut [Found; LANES]| {
        let ray = Ray { t_max: best[lane].t, ..block.get(lane) };
        if let Some(found) = items.intersect(simd, item, &ray)
            && found.is_before(&best[lane])
        {
            best[lane] = found;
            packet.t_max[lane] = found.t;
        }
    };
    for lane in lanes_of(packet.active) {
        best[lane] = Found::nothing(packet.t_max[lane]);
        for &item in &tree.endless {
            ask(item, lane, packet, &mut best);
        }
    }
    packet.traverse(simd, tree, |packet, content, lanes| {
        match content {
            Content::Triangles(index) => {
                let triangles = &tree.blocks[index];
                for lane in lanes_of(lanes) {
                    let lane = lane % LANES;
                    let shear = ShearRay::new(simd, &packet.rays[lane]);
                    let best = &mut best[lane];
                    shear.each_hit::<S, ROBUST>(simd, triangles, best.t, |i, hit| {
                        let found = Found::triangle(hit, triangles.ids[i]);
                        if found.is_before(best) {
                            *best = found;
                        }
                        false
                    });
                    packet.t_max[lane] = best.t;
                }
            }
            Content::Item(item) => {
                lanes_of(lanes).for_each(|lane| ask(item, lane, packet, &mut best));
            }
            Content::Node(_) => {}
        }
        true
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
    let mut occluded = 0;
    for lane in lanes_of(packet.active) {
        let ray = block.get(lane);
        if tree.endless.iter().any(|&item| items.occluded::<S, OPAQUE>(simd, item, &ray)) {
            occluded |= 1 << lane;
            packet.t_max[lane] = f32::NEG_INFINITY;
        }
    }
    if occluded == packet.active {
        return occluded;
    }
    packet.traverse(simd, tree, |packet, content, lanes| {
        for lane in lanes_of(lanes) {
            let lane = lane % LANES;
            let mut is_hit = false;
            match content {
                Content::Triangles(index) => {
                    let triangles = &tree.blocks[index];
                    let ray = &packet.rays[lane];
                    let shear = ShearRay::new(simd, ray);
                    shear.each_hit::<S, ROBUST>(simd, triangles, ray.t_max, |i, _| {
                        is_hit = !(OPAQUE && items.is_clear(triangles.ids[i]));
                        is_hit
                    });
                }
                Content::Item(item) => {
                    is_hit = items.occluded::<S, OPAQUE>(simd, item, &block.get(lane));
                }
                Content::Node(_) => {}
            }
            if is_hit {
                occluded |= 1 << lane;
                packet.t_max[lane] = f32::NEG_INFINITY;
            }
        }
        occluded != packet.active
    });
    occluded
}
