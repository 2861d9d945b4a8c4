//! One ray through a tree.

use super::build::MAX_DEPTH;
use super::node::{Child, Content, Node, Tree, WIDTH};
use super::ray::LoneRay;
use super::simd::{Floats, Simd, Stack};
use super::triangle::TriangleHit;
use crate::accel::Hit;
use crate::geometry::ShapeHit;
use crate::math::Ray;

/// Every level leaves seven children to come back to.
pub(super) const STACK: usize = MAX_DEPTH * (WIDTH - 1) + 1;

/// A hit, in ids of a tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    pub(super) t: f32,
    pub(super) u: f32,
    pub(super) v: f32,
    /// Number of the primitive in its tree.
    pub(super) id: u32,
    /// Number of the copy; [`Found::NO_COPY`] in the root group.
    pub(super) copy: u32,
}

impl Found {
    pub(super) const NO_COPY: u32 = !0;
    /// The number of none.
    pub(super) const NOTHING: u32 = u32::MAX;

    /// None yet at t ≤ `t_max`: any comes before it.
    #[inline(always)]
    pub(super) const fn nothing(t_max: f32) -> Self {
        Self { t: t_max, u: 0.0, v: 0.0, id: Self::NOTHING, copy: u32::MAX }
    }

    #[inline(always)]
    pub(super) const fn triangle(hit: TriangleHit, id: u32) -> Self {
        Self { t: hit.t, u: hit.u, v: hit.v, id, copy: Self::NO_COPY }
    }

    /// A sphere, or another shape.
    #[inline(always)]
    pub(super) const fn shape(hit: ShapeHit, id: u32) -> Self {
        let (t, u) = (hit.t as f32, Hit::u_of_part(hit.part));
        Self { t, u, v: 0.0, id, copy: Self::NO_COPY }
    }

    #[inline(always)]
    pub(super) fn if_any(self) -> Option<Self> {
        (self.id != Self::NOTHING).then_some(self)
    }

    /// Whether it comes before `other`. What is equally far is told apart by number: so neither the order
    /// of the tree nor that of rays is seen in a hit.
    #[inline(always)]
    pub(super) fn is_before(&self, other: &Self) -> bool {
        self.t < other.t || (self.t == other.t && (self.copy, self.id) < (other.copy, other.id))
    }
}

/// What is in a tree besides triangles.
pub(super) trait Items: Copy {
    /// The closest hit of an item at t in (`t_min`, `t_max`].
    fn intersect<S: Simd>(self, simd: S, item: u32, ray: &Ray) -> Option<Found>;

    /// Whether there is one. `OPAQUE` asks for those alone that light does not pass.
    fn occluded<S: Simd, const OPAQUE: bool>(self, simd: S, item: u32, ray: &Ray) -> bool;

    /// Whether light passes a primitive without loss.
    fn is_clear(self, id: u32) -> bool;

    /// Has the processor bring what will be asked of a triangle, which was hit and perhaps is the closest.
    fn foresee(self, id: u32);
}

/// A child that is yet to be visited, and where the ray enters it: the nearer, the smaller the number.
#[inline(always)]
fn entry(t: f32, child: Child) -> u64 {
    u64::from(t.to_bits()) << 32 | u64::from(child.0)
}

#[inline(always)]
fn child_of(entry: u64) -> Child {
    Child(entry as u32)
}

#[inline(always)]
fn t_of(entry: u64) -> f32 {
    f32::from_bits((entry >> 32) as u32)
}

/// The closest hit. Of several equally far, the one with the least number.
#[inline(always)]
pub(super) fn closest<S: Simd, const ROBUST: bool>(
    simd: S,
    tree: &Tree,
    items: impl Items,
    ray: &Ray,
) -> Option<Found> {
    if tree.is_of_triangles {
        closest_in::<S, ROBUST, true>(simd, tree, items, ray)
    } else {
        closest_in::<S, ROBUST, false>(simd, tree, items, ray)
    }
}

/// `TRIANGLES`: there is nothing else. The compiler would work out for every ray what spheres ask of it.
#[inline(always)]
fn closest_in<S: Simd, const ROBUST: bool, const TRIANGLES: bool>(
    simd: S,
    tree: &Tree,
    items: impl Items,
    ray: &Ray,
) -> Option<Found> {
    let LoneRay { slabs, shear, t_max } = LoneRay::new::<S, ROBUST>(simd, ray)?;
    let mut best = Found::nothing(t_max);
    for &item in &tree.endless {
        ask(simd, items, item, ray, &mut best);
    }
    if tree.nodes.is_empty() {
        return best.if_any();
    }
    let mut stack = Stack::<STACK>::new();
    let mut current = Child::node(0);
    let mut t_far = simd.splat8(best.t);
    'visit: loop {
        match current.content() {
            Content::Node(index) => {
                let node = &tree.nodes[index];
                let (bits, enter) = slabs.meets::<S, ROBUST>(simd, &node.planes, t_far);
                if bits != 0 {
                    current = nearest(tree, &mut stack, node, bits, enter);
                    continue 'visit;
                }
            }
            Content::Triangles(index) => {
                let block = &tree.blocks[index];
                shear.each_hit::<ROBUST>(block, t_far, |lane, hit| {
                    let found = Found::triangle(hit, block.ids[lane % WIDTH]);
                    if found.is_before(&best) {
                        best = found;
                    }
                    false
                });
                t_far = simd.splat8(best.t);
            }
            Content::Spheres(index) if !TRIANGLES => {
                shear.closest_sphere(simd, &tree.spheres[index], ray, &mut best);
                t_far = simd.splat8(best.t);
            }
            Content::Item(item) if !TRIANGLES => {
                ask(simd, items, item, ray, &mut best);
                t_far = simd.splat8(best.t);
            }
            Content::Spheres(_) | Content::Item(_) => {}
        }
        loop {
            let Some(entry) = stack.pop() else { break 'visit };
            if t_of(entry) <= best.t {
                current = child_of(entry);
                break;
            }
        }
    }
    best.if_any()
}

/// Asks an item for a hit that comes before `best`.
#[inline(always)]
pub(super) fn ask<S: Simd>(simd: S, items: impl Items, item: u32, ray: &Ray, best: &mut Found) {
    let ray = Ray { t_max: best.t, ..*ray };
    if let Some(found) = items.intersect(simd, item, &ray)
        && found.is_before(best)
    {
        *best = found;
    }
}

/// Puts all children that are hit on the stack, the nearest last, but for that one, which it returns.
#[inline(always)]
fn nearest<F: Floats<Array = [f32; 8]>>(
    tree: &Tree,
    stack: &mut Stack<STACK>,
    node: &Node,
    bits: u32,
    enter: F,
) -> Child {
    let first = bits.trailing_zeros() as usize & 7;
    let bits = bits & (bits - 1);
    if bits == 0 {
        return node.children[first];
    }
    let enter = enter.to_array();
    let second = bits.trailing_zeros() as usize & 7;
    let mut bits = bits & (bits - 1);
    let a = entry(enter[first], node.children[first]);
    let b = entry(enter[second], node.children[second]);
    let (mut near, far) = (a.min(b), a.max(b));
    tree.prefetch(child_of(far));
    if bits == 0 {
        stack.push(far);
        return child_of(near);
    }
    let start = stack.len();
    stack.push(far);
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize & 7;
        bits &= bits - 1;
        let next = entry(enter[lane], node.children[lane]);
        tree.prefetch(node.children[lane]);
        stack.push(near.max(next));
        near = near.min(next);
    }
    sort(stack.since(start));
    child_of(near)
}

/// Sorts a few numbers, the largest first.
#[inline(always)]
pub(super) fn sort(entries: &mut [u64]) {
    for i in 1..entries.len() {
        let entry = entries[i];
        let mut j = i;
        while j > 0 && entries[j - 1] < entry {
            entries[j] = entries[j - 1];
            j -= 1;
        }
        entries[j] = entry;
    }
}

/// Whether there is any hit; with `OPAQUE`, of what light does not pass.
#[inline(always)]
pub(super) fn any<S: Simd, const ROBUST: bool, const OPAQUE: bool>(
    simd: S,
    tree: &Tree,
    items: impl Items,
    ray: &Ray,
) -> bool {
    if tree.is_of_triangles {
        any_in::<S, ROBUST, OPAQUE, true>(simd, tree, items, ray)
    } else {
        any_in::<S, ROBUST, OPAQUE, false>(simd, tree, items, ray)
    }
}

#[inline(always)]
fn any_in<S: Simd, const ROBUST: bool, const OPAQUE: bool, const TRIANGLES: bool>(
    simd: S,
    tree: &Tree,
    items: impl Items,
    ray: &Ray,
) -> bool {
    let Some(LoneRay { slabs, shear, t_max }) = LoneRay::new::<S, ROBUST>(simd, ray) else {
        return false;
    };
    if tree.endless.iter().any(|&item| items.occluded::<S, OPAQUE>(simd, item, ray)) {
        return true;
    }
    if tree.nodes.is_empty() {
        return false;
    }
    let t_far = simd.splat8(t_max);
    let mut stack = Stack::<STACK>::new();
    let mut current = Child::node(0);
    loop {
        match current.content() {
            Content::Node(index) => {
                let node = &tree.nodes[index];
                let (mut bits, _) = slabs.meets::<S, ROBUST>(simd, &node.planes, t_far);
                if bits != 0 {
                    current = node.children[bits.trailing_zeros() as usize & 7];
                    bits &= bits - 1;
                    while bits != 0 {
                        let child = node.children[bits.trailing_zeros() as usize & 7];
                        tree.prefetch(child);
                        stack.push(child.0.into());
                        bits &= bits - 1;
                    }
                    continue;
                }
            }
            Content::Triangles(index) => {
                let block = &tree.blocks[index];
                let mut is_hit = false;
                if OPAQUE {
                    shear.each_hit::<ROBUST>(block, t_far, |lane, _| {
                        is_hit = !items.is_clear(block.ids[lane % WIDTH]);
                        is_hit
                    });
                } else {
                    is_hit = shear.meets_triangle::<ROBUST>(block, t_far) != 0;
                }
                if is_hit {
                    return true;
                }
            }
            Content::Spheres(index) if !TRIANGLES => {
                let counts = |id| !(OPAQUE && items.is_clear(id));
                if shear.meets_sphere(simd, &tree.spheres[index], ray, counts) {
                    return true;
                }
            }
            Content::Item(item) if !TRIANGLES => {
                if items.occluded::<S, OPAQUE>(simd, item, ray) {
                    return true;
                }
            }
            Content::Spheres(_) | Content::Item(_) => {}
        }
        match stack.pop() {
            Some(entry) => current = child_of(entry),
            None => return false,
        }
    }
}
