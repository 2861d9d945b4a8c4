//! Sixteen rays that run close together through a tree.
//!
//! A node's eight boxes are tested at once against all that the rays could be: intervals of origins and
//! reciprocal directions. Source: Wald, Boulos, Shirley, *Ray tracing deformable scenes using dynamic
//! bounding volume hierarchies*, TOG 26(1), 2007. The box of a leaf is tested against the sixteen rays; those that
//! meet it are tested as a single ray is, two at a time: with the same results to the last bit.

use super::super::block::{LANES, RayBlock, lanes_of};
use super::node::{Content, Node, Tree, WIDTH};
use super::ray::{RaySetup, ShearRay, Slopes, turned};
use super::simd::{Floats, Simd, Sixteen, Stack};
use super::traverse::{Found, Items, STACK, ask};
use crate::math::lanes_where;

/// The rays of a block, the fields of [`RaySetup`], a lane each. They are traversed together where their directions
/// have the same signs. Aligned, so that what is loaded side by side lies in one line of the cache.
#[repr(C, align(64))]
pub(super) struct Packet {
    origin: [[f32; LANES]; 3],
    far_origin: [[f32; LANES]; 3],
    near: [[f32; LANES]; 3],
    far: [[f32; LANES]; 3],
    t_min: [f32; LANES],
    /// Negative infinity where nothing is looked for (any more).
    t_max: [f32; LANES],
    last: [u32; LANES],
    shear: [[f32; LANES]; 3],
    active: u16,
    /// By axis, for the plane that is entered first and then for the other: the end of the interval of
    /// origins that counts, and both ends of that of reciprocals.
    intervals: [[[f32; 3]; 2]; 3],
    sign: [usize; 3],
    least_t: f32,
    /// Whether directions have the same signs.
    pub(super) has_one_sign: bool,
}

impl Packet {
    /// See [`Self::has_one_sign`] before anything is asked of it.
    #[inline(always)]
    pub(super) fn new<S: Simd, const ROBUST: bool>(simd: S, block: &RayBlock) -> Self {
        // By themselves, not in the packet: then nothing is zeroed first.
        const NOTHING: [f32; LANES] = [0.0; LANES];
        let (mut origin, mut far_origin) = ([NOTHING; 3], [NOTHING; 3]);
        let (mut near, mut far, mut shear) = ([NOTHING; 3], [NOTHING; 3], [NOTHING; 3]);
        let (mut t_min, mut t_max) = (NOTHING, NOTHING);
        let (mut last, mut is_ray) = ([0; LANES], [false; LANES]);
        let slopes =
            |i: usize| Slopes::of::<ROBUST>([block.dir_x[i], block.dir_y[i], block.dir_z[i]]);
        // As those that go to one light far away.
        let shared = block.common_direction().map(slopes);
        for i in 0..LANES {
            let o = [block.org_x[i], block.org_y[i], block.org_z[i]];
            let slopes = match shared {
                Some(slopes) => slopes,
                None => slopes(i),
            };
            let (ray, is) = RaySetup::new(o, &slopes, [block.t_min[i], block.t_max[i]]);
            is_ray[i] = is;
            for axis in 0..3 {
                origin[axis][i] = ray.origin[axis];
                far_origin[axis][i] = ray.far_origin[axis];
                near[axis][i] = ray.near[axis];
                far[axis][i] = ray.far[axis];
                shear[axis][i] = ray.shear[axis];
            }
            (t_min[i], t_max[i], last[i]) = (ray.t_min, ray.t_max, ray.last);
        }
        let active = block.active() & lanes_where(&is_ray);
        // Lanes without a ray repeat one that is there, and look for nothing.
        let first = active.trailing_zeros() as usize % LANES;
        for lane in lanes_of(!active) {
            for axis in 0..3 {
                origin[axis][lane] = origin[axis][first];
                far_origin[axis][lane] = far_origin[axis][first];
                near[axis][lane] = near[axis][first];
                far[axis][lane] = far[axis][first];
            }
            t_min[lane] = t_min[first];
            t_max[lane] = f32::NEG_INFINITY;
        }
        let (mut intervals, mut sign) = ([[[0.0; 3]; 2]; 3], [0; 3]);
        let mut has_one_sign = true;
        for axis in 0..3 {
            let (origin, far_origin) = (ends(simd, &origin[axis]), ends(simd, &far_origin[axis]));
            let ([low, high], far) = (ends(simd, &near[axis]), ends(simd, &far[axis]));
            has_one_sign &= low >= 0.0 || high < 0.0;
            sign[axis] = usize::from(low < 0.0);
            // The last origin at planes that are entered, the first at those that are left.
            let (enter, leave) = (origin[1 - sign[axis]], far_origin[sign[axis]]);
            intervals[axis] = [[enter, low, high], [leave, far[0], far[1]]];
        }
        let least_t = simd.load16(&t_min).least();
        Self {
            origin,
            far_origin,
            near,
            far,
            t_min,
            t_max,
            last,
            shear,
            active,
            intervals,
            sign,
            least_t,
            has_one_sign,
        }
    }

    /// Calls `visit` with the rays of `lanes` for triangles, two at a time: of which lanes they are. One that is left
    /// over is both.
    #[inline(always)]
    fn each_pair<S: Simd>(
        &self,
        simd: S,
        lanes: u16,
        mut visit: impl FnMut(ShearRay<S::F16>, [usize; 2]),
    ) {
        let mut left = lanes;
        while left != 0 {
            let a = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let mut b = a;
            let next = left.trailing_zeros() as usize % LANES;
            if left != 0 && self.last[next] == self.last[a] {
                b = next;
                left &= left - 1;
            }
            let of = |values: &[f32; LANES]| simd.load16(values).halves(a, b);
            let axes = turned([0, 1, 2], self.last[a]);
            let [x, y, along] = &self.shear;
            let ray = ShearRay {
                origin: axes.map(|axis| of(&self.origin[axis])),
                shear: [of(x), of(y)],
                axes,
                along: of(along),
                t_min: of(&self.t_min),
            };
            visit(ray, [a, b]);
        }
    }

    /// The ray of a lane, for spheres.
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
        // Rays that run close together mostly meet all boxes that their intervals meet. So nodes are visited for that
        // alone, but where it was in vain more often than not.
        let mut in_vain = 0i32;
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
            // One child alone need not wait on the stack.
            let is_one = bits != 0 && bits & (bits - 1) == 0;
            let mut next = is_one.then(|| index * WIDTH + bits.trailing_zeros() as usize);
            if bits == 0 {
                in_vain += 1;
            } else if !is_one {
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
                let slot = match next.take() {
                    Some(slot) => slot,
                    None => {
                        let Some(entry) = stack.pop() else { return };
                        if f32::from_bits((entry >> 32) as u32) > furthest {
                            continue;
                        }
                        entry as u32 as usize
                    }
                };
                let (node, lane) = (&tree.nodes[slot / WIDTH], slot % WIDTH);
                let content = node.children[lane].content();
                if let Content::Node(index) = content
                    && in_vain <= 0
                {
                    break index;
                }
                let lanes = self.lanes_that_meet(simd, node, lane, t_max);
                if lanes == 0 {
                    in_vain += 1;
                    continue;
                }
                if let Content::Node(index) = content {
                    break index;
                }
                in_vain -= 1;
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

/// The least and the greatest of numbers; of no matter what where one is NaN, as in a packet without rays.
#[inline(always)]
fn ends<S: Simd>(simd: S, numbers: &[f32; LANES]) -> [f32; 2] {
    let (lanes, first) = (simd.load16(numbers), simd.splat16(numbers[0]));
    // Of rays from one point, or in one direction, it is one number, which is sooner told.
    if lanes.le(first) & first.le(lanes) == 0xffff {
        return [numbers[0]; 2];
    }
    [lanes.least(), lanes.greatest()]
}

/// What the rays of a packet hit, as [`Found`] has it, a lane each.
#[repr(C, align(64))]
pub(super) struct FoundLanes {
    pub(super) t: [f32; LANES],
    pub(super) u: [f32; LANES],
    pub(super) v: [f32; LANES],
    pub(super) id: [u32; LANES],
    copy: [u32; LANES],
}

impl FoundLanes {
    #[inline(always)]
    pub(super) const fn get(&self, lane: usize) -> Found {
        let Self { t, u, v, id, copy } = self;
        Found { t: t[lane], u: u[lane], v: v[lane], id: id[lane], copy: copy[lane] }
    }

    #[inline(always)]
    const fn set(&mut self, lane: usize, found: Found) {
        (self.t[lane], self.u[lane], self.v[lane]) = (found.t, found.u, found.v);
        (self.id[lane], self.copy[lane]) = (found.id, found.copy);
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
) -> FoundLanes {
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
) -> FoundLanes {
    let nothing = Found::nothing(0.0);
    let mut best = FoundLanes {
        t: packet.t_max,
        u: [nothing.u; LANES],
        v: [nothing.v; LANES],
        id: [nothing.id; LANES],
        copy: [nothing.copy; LANES],
    };
    let asked = if tree.endless.is_empty() { 0 } else { packet.active };
    for lane in lanes_of(asked) {
        let mut found = best.get(lane);
        for &item in &tree.endless {
            ask(simd, items, item, &block.get(lane), &mut found);
        }
        best.set(lane, found);
        packet.t_max[lane] = found.t;
    }
    packet.traverse(simd, tree, |content, lanes, t_max| {
        let mut is_changed = false;
        if let Content::Triangles(index) = content {
            let block = &tree.blocks[index];
            packet.each_pair(simd, lanes, |ray, [a, b]| {
                let ends = t_max.halves(a, b);
                ray.each_hit::<ROBUST>(block, ends, |i, hit| {
                    let lane = if i < WIDTH { a } else { b };
                    let found = Found::triangle(hit, block.ids[i % WIDTH]);
                    if found.is_before(&best.get(lane)) {
                        best.set(lane, found);
                        items.foresee(found.id);
                        *t_max = t_max.choose(1 << lane, simd.splat16(found.t));
                        is_changed = true;
                    }
                    false
                });
            });
            return is_changed;
        }
        for lane in lanes_of(lanes) {
            let lane = lane % LANES;
            let mut found = best.get(lane);
            match content {
                Content::Spheres(index) if !TRIANGLES => {
                    let shear = packet.shear_ray(simd, lane);
                    shear.closest_sphere(simd, &tree.spheres[index], &block.get(lane), &mut found);
                }
                Content::Item(item) if !TRIANGLES => {
                    ask(simd, items, item, &block.get(lane), &mut found);
                }
                Content::Node(_)
                | Content::Triangles(_)
                | Content::Spheres(_)
                | Content::Item(_) => {}
            }
            if found.t < best.t[lane] {
                *t_max = t_max.choose(1 << lane, simd.splat16(found.t));
                is_changed = true;
            }
            best.set(lane, found);
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
    let asked = if tree.endless.is_empty() { 0 } else { packet.active };
    for lane in lanes_of(asked) {
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
        if let Content::Triangles(index) = content {
            let block = &tree.blocks[index];
            packet.each_pair(simd, lanes, |ray, [a, b]| {
                let ends = t_max.halves(a, b);
                if OPAQUE {
                    ray.each_hit::<ROBUST>(block, ends, |i, _| {
                        let lane = if i < WIDTH { a } else { b };
                        hits |= u16::from(!items.is_clear(block.ids[i % WIDTH])) << lane;
                        false
                    });
                } else {
                    let met = ray.meets_triangle::<ROBUST>(block, ends);
                    hits |= u16::from(met & 0xff != 0) << a | u16::from(met >> 8 != 0) << b;
                }
            });
        }
        for lane in lanes_of(lanes).filter(|_| !TRIANGLES) {
            let lane = lane % LANES;
            let mut is_hit = false;
            match content {
                Content::Spheres(index) if !TRIANGLES => {
                    let counts = |id| !(OPAQUE && items.is_clear(id));
                    let (shear, spheres) = (packet.shear_ray(simd, lane), &tree.spheres[index]);
                    is_hit = shear.meets_sphere(simd, spheres, &block.get(lane), counts);
                }
                Content::Item(item) if !TRIANGLES => {
                    is_hit = items.occluded::<S, OPAQUE>(simd, item, &block.get(lane));
                }
                Content::Node(_)
                | Content::Triangles(_)
                | Content::Spheres(_)
                | Content::Item(_) => {}
            }
            hits |= u16::from(is_hit) << lane;
        }
        occluded |= hits;
        *t_max = t_max.choose(hits.into(), simd.splat16(f32::NEG_INFINITY));
        hits != 0
    });
    occluded
}
