//! A kd-tree, that is a binary space partition by planes along the axes, chosen by the surface area
//! heuristic. Plain, for comparison in `alhazen bench`, where it is called `bsp`.
//!
//! Source: pbrt 3ed §4.4 (build, traversal); Shevtsov, Soupikov, Kapustin, *Highly Parallel Fast KD-tree
//! Construction for Interactive Ray Tracing of Dynamic Scenes*, CGF 26(3) 2007 (counting beginnings and
//! ends of boxes in bins, in place of sorting them).

use super::levels::{BoxTree, GoOn, Levels};
use super::primitive::Line;
use super::world::World;
use super::{AccelError, AccelInfo, Hit, RayQuery};
use crate::math::{Bounds, Ray};

/// Places along each axis where a cell may be cut, and one.
const BINS: usize = 32;

/// What a test of a primitive costs, in steps down the tree.
const TEST_COST: f64 = 4.0;

/// What is saved where one side of a cut is empty.
const EMPTY_BONUS: f64 = 0.5;

/// Cuts that cost more than they save, on one way down, before it ends.
const BAD_CUTS: u32 = 3;

/// From so many boxes on, the sides of a cut are built on two threads.
const PARALLEL_FROM: usize = 1 << 13;

/// Cells that wait on a way down; trees are no deeper.
const STACK: usize = 64;

/// kd-trees over the primitives of a world, answering in f64.
#[derive(Debug)]
pub struct KdTree(Levels<Nodes>);

impl KdTree {
    /// Builds on the threads of the current rayon pool; `go_on` is asked now and then and ends the build by
    /// returning false.
    ///
    /// # Errors
    /// [`AccelError::Interrupted`] where it did.
    pub fn build(world: &World, go_on: &(dyn Fn() -> bool + Sync)) -> Result<Self, AccelError> {
        Levels::build(world, go_on).map(Self)
    }

    /// Name and sizes, for reports.
    pub fn info(&self) -> AccelInfo {
        self.0.info()
    }
}

impl RayQuery for KdTree {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.0.intersect(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.0.occluded(ray)
    }

    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.0.occluded_by_opaque(ray)
    }
}

#[derive(Debug)]
struct Nodes {
    bounds: Bounds,
    nodes: Vec<Node>,
    items: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
enum Node {
    Leaf {
        first: u32,
        count: u32,
    },
    /// What lies below the plane is the next node.
    Cut {
        axis: u8,
        at: f32,
        above: u32,
    },
}

/// A node that is being built.
enum Draft {
    Leaf(Vec<u32>),
    Cut { axis: u8, at: f32, sides: Box<[Self; 2]> },
}

/// A plane along an axis.
struct Plane {
    axis: usize,
    at: f32,
    cost: f64,
}

/// What does not change on the way down.
struct Build<'a> {
    boxes: &'a [Bounds],
    go_on: &'a GoOn<'a>,
}

impl BoxTree for Nodes {
    const NAME: &'static str = "kd-tree";

    fn build(boxes: &[Bounds], go_on: &GoOn<'_>) -> Self {
        let filled = (0u32..).zip(boxes).filter(|(_, b)| !b.is_empty());
        let items: Vec<u32> = filled.map(|(i, _)| i).collect();
        let bounds = items.iter().fold(Bounds::EMPTY, |b, &i| b.union(boxes[i as usize]));
        // pbrt's rule of thumb.
        let depth = 8.0 + 1.3 * (items.len().max(1) as f64).log2();
        let build = Build { boxes, go_on };
        let draft = build.draft(&bounds, items, (depth as u32).min(STACK as u32), 0);
        let mut tree = Self { bounds, nodes: Vec::new(), items: Vec::new() };
        tree.push(draft);
        tree.nodes.shrink_to_fit();
        tree.items.shrink_to_fit();
        tree
    }

    fn visit(&self, ray: &Line, mut t_max: f64, mut test: impl FnMut(u32, f64) -> f64) {
        let Some((enter, exit)) = self.bounds.clip(ray.origin, ray.direction) else { return };
        let (mut enter, mut exit) = (enter.max(ray.t_min), exit);
        let mut stack = [(0u32, 0.0, 0.0); STACK];
        let mut waiting = 0;
        let mut node = 0;
        // What lies behind the closest hit is not looked at; all that waits lies further behind.
        while enter <= t_max {
            match self.nodes[node as usize] {
                Node::Cut { axis, at, above } => {
                    let axis = usize::from(axis);
                    let (o, d) = (ray.origin[axis], ray.direction[axis]);
                    let at = f64::from(at);
                    let is_below = o < at || (o == at && d <= 0.0);
                    let [near, far] = if is_below { [node + 1, above] } else { [above, node + 1] };
                    let t = (at - o) / d;
                    // Away from the plane, along it, or done before it: the near side alone.
                    if !(t > 0.0 && t <= exit) {
                        node = near;
                    } else if t < enter {
                        node = far;
                    } else {
                        stack[waiting] = (far, t, exit);
                        waiting += 1;
                        (node, exit) = (near, t);
                    }
                }
                Node::Leaf { first, count } => {
                    let items = &self.items[first as usize..][..count as usize];
                    t_max = items.iter().fold(t_max, |t_max, &i| test(i, t_max));
                    if waiting == 0 {
                        return;
                    }
                    waiting -= 1;
                    (node, enter, exit) = stack[waiting];
                }
            }
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.items)
    }
}

impl Nodes {
    /// Writes a finished node and all below it.
    fn push(&mut self, draft: Draft) {
        match draft {
            Draft::Leaf(items) => {
                let first = self.items.len() as u32;
                self.items.extend_from_slice(&items);
                self.nodes.push(Node::Leaf { first, count: items.len() as u32 });
            }
            Draft::Cut { axis, at, sides } => {
                let node = self.nodes.len();
                self.nodes.push(Node::Cut { axis, at, above: 0 });
                let [low, high] = *sides;
                self.push(low);
                let above = self.nodes.len() as u32;
                self.nodes[node] = Node::Cut { axis, at, above };
                self.push(high);
            }
        }
    }
}

impl Build<'_> {
    fn draft(&self, bounds: &Bounds, items: Vec<u32>, depth: u32, mut bad_cuts: u32) -> Draft {
        let leaf_cost = TEST_COST * items.len() as f64;
        if items.len() <= 1 || depth == 0 || !(self.go_on)() {
            return Draft::Leaf(items);
        }
        let Some(Plane { axis, at, cost }) = self.best_plane(bounds, &items) else {
            return Draft::Leaf(items);
        };
        if cost >= leaf_cost {
            bad_cuts += 1;
        }
        if bad_cuts == BAD_CUTS || (cost > 4.0 * leaf_cost && items.len() < 16) {
            return Draft::Leaf(items);
        }
        let plane = f64::from(at);
        let end = |i: &u32| &self.boxes[*i as usize];
        let low: Vec<u32> = items.iter().copied().filter(|i| end(i).min[axis] <= plane).collect();
        let high: Vec<u32> = items.iter().copied().filter(|i| end(i).max[axis] >= plane).collect();
        let is_large = items.len() >= PARALLEL_FROM;
        drop(items);
        let (mut below, mut above) = (*bounds, *bounds);
        below.max[axis] = plane;
        above.min[axis] = plane;
        let low = move || self.draft(&below, low, depth - 1, bad_cuts);
        let high = move || self.draft(&above, high, depth - 1, bad_cuts);
        let (low, high) = if is_large { rayon::join(low, high) } else { (low(), high()) };
        Draft::Cut { axis: axis as u8, at, sides: Box::new([low, high]) }
    }

    /// The cheapest plane by the surface area heuristic, if there is one within the cell.
    fn best_plane(&self, bounds: &Bounds, items: &[u32]) -> Option<Plane> {
        let size = bounds.size();
        let mut best: Option<Plane> = None;
        for axis in 0..3 {
            let (from, step) = (bounds.min[axis], size[axis] / BINS as f64);
            if !(step > 0.0) {
                continue;
            }
            // How many boxes begin, and end, in each bin.
            let (mut begins, mut ends) = ([0usize; BINS], [0usize; BINS]);
            let bin = |x: f64| (((x - from) / step).max(0.0) as usize).min(BINS - 1);
            for &i in items {
                let b = &self.boxes[i as usize];
                begins[bin(b.min[axis])] += 1;
                ends[bin(b.max[axis])] += 1;
            }
            let side = size[(axis + 1) % 3] * size[(axis + 2) % 3];
            let around = size[(axis + 1) % 3] + size[(axis + 2) % 3];
            let area = |along: f64| side + along * around;
            let (mut low, mut high) = (0, items.len());
            for cut in 1..BINS {
                low += begins[cut - 1];
                high -= ends[cut - 1];
                let at = (from + step * cut as f64) as f32;
                if !(f64::from(at) > bounds.min[axis] && f64::from(at) < bounds.max[axis]) {
                    continue;
                }
                let along = step * cut as f64;
                let [p_low, p_high] =
                    [along, size[axis] - along].map(|x| area(x) / area(size[axis]));
                let bonus = if low == 0 || high == 0 { EMPTY_BONUS } else { 0.0 };
                let tests = p_low * low as f64 + p_high * high as f64;
                let cost = 1.0 + (1.0 - bonus) * TEST_COST * tests;
                if best.as_ref().is_none_or(|b| cost < b.cost) {
                    best = Some(Plane { axis, at, cost });
                }
            }
        }
        best
    }
}
