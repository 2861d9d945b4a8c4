//! Building the tree: from the top by where lights are, then bounds from the bottom.

use glam::Vec3;

use super::super::bounds::LightBounds;
use super::node::Node;

/// Cells along each axis whose borders are tried as splits. Source: pbrt 4ed §12.6.3.
const CELLS: usize = 12;

/// So few lights are halved along the longest axis: a better split is not worth the search.
const FEW: usize = 4;

/// What the choice of a split needs of a light; f32 will do.
#[derive(Debug, Clone, Copy)]
struct Item {
    center: Vec3,
    radius: f32,
    /// Intensity times the mean direction of its cone.
    moment: Vec3,
    intensity: f32,
    /// Index of the light.
    index: u32,
}

/// Nodes, depth first, and the parent of each, over the lights of `bounds` that emit something.
pub(super) fn build(bounds: &[Option<LightBounds>]) -> (Vec<Node>, Vec<u32>) {
    let lights = (0..).zip(bounds).filter_map(|(i, b)| b.as_ref().map(|b| (i, b)));
    // Also refuses NaN.
    let lights = lights.filter(|(_, b)| b.intensity > 0.0);
    let mut items: Vec<Item> = lights.map(|(i, b)| Item::new(i, b)).collect();
    if items.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let size = 2 * items.len() - 1;
    let (mut nodes, mut parents) = (vec![Node::default(); size], vec![0; size]);
    let branch =
        Branch { bounds, items: &mut items, nodes: &mut nodes, parents: &mut parents, root: 0 };
    branch.grow(JOINS);
    (nodes, parents)
}

/// Levels of the tree whose children may be built by two threads.
const JOINS: u32 = 10;

/// Branches of fewer lights are built by one thread.
const GRAIN: usize = 1 << 12;

/// A part of the tree, with what is its own of each array. A branch over n lights has 2n − 1 nodes, so
/// where each begins is known before it is made.
struct Branch<'a> {
    bounds: &'a [Option<LightBounds>],
    items: &'a mut [Item],
    nodes: &'a mut [Node],
    parents: &'a mut [u32],
    /// Index of its first node in the whole tree.
    root: u32,
}

impl Branch<'_> {
    /// Makes its nodes, and tells the bound of all. Recursion ends after `joins` levels.
    fn grow(self, joins: u32) -> LightBounds {
        if joins == 0 || self.items.len() <= GRAIN {
            return self.grow_alone();
        }
        let left = split(self.items);
        let right_root = 2 * left;
        let (items, right_items) = self.items.split_at_mut(left);
        let (nodes, right_nodes) = self.nodes.split_at_mut(right_root);
        let (parents, right_parents) = self.parents.split_at_mut(right_root);
        let root = self.root;
        (parents[1], right_parents[0]) = (root, root);
        let (node, nodes) = nodes.split_first_mut().expect("it has two children");
        let parents = &mut parents[1..];
        let left = Self { bounds: self.bounds, items, nodes, parents, root: root + 1 };
        let right = Self {
            bounds: self.bounds,
            items: right_items,
            nodes: right_nodes,
            parents: right_parents,
            root: root + right_root as u32,
        };
        let right_root = right.root;
        let (left, right) = rayon::join(|| left.grow(joins - 1), || right.grow(joins - 1));
        let bounds = left.union(&right);
        *node = Node::inner(&bounds, right_root);
        bounds
    }

    /// The same on one thread and without recursion: trees may be deep.
    fn grow_alone(self) -> LightBounds {
        // First and number of the items of each node.
        let mut parts = vec![(0, 0); self.nodes.len()];
        let mut open = vec![(0, 0, self.items.len())];
        while let Some((node, first, count)) = open.pop() {
            parts[node] = (first, count);
            if count > 1 {
                let left = split(&mut self.items[first..first + count]);
                let children =
                    [(node + 1, first, left), (node + 2 * left, first + left, count - left)];
                for child in children {
                    self.parents[child.0] = self.root + node as u32;
                    open.push(child);
                }
            }
        }
        // Backwards: children come before their parent, the left one last.
        let mut done: Vec<LightBounds> = Vec::new();
        for (node, &(first, count)) in parts.iter().enumerate().rev() {
            let children = if count > 1 { done.pop().zip(done.pop()) } else { None };
            let (compact, bounds) = match children {
                None => {
                    let light = self.items[first].index;
                    let bounds = self.bounds[light as usize].expect("it has bounds");
                    (Node::leaf(&bounds, light), bounds)
                }
                Some((left, right)) => {
                    let bounds = left.union(&right);
                    let right = node + 2 * parts[node + 1].1;
                    (Node::inner(&bounds, self.root + right as u32), bounds)
                }
            };
            self.nodes[node] = compact;
            done.push(bounds);
        }
        done.pop().expect("the root's")
    }
}

/// Sorts items into two parts, neither empty, and tells how many are in the first.
fn split(items: &mut [Item]) -> usize {
    let centers = items.iter().fold(Cell::default(), |cell, item| cell.with_center(item.center));
    let size = centers.max - centers.min;
    let longest = size.max_element();
    // All at one place (or not finite in f32).
    if !(longest > 0.0 && longest.is_finite()) {
        return items.len() / 2;
    }
    if items.len() <= FEW {
        let axis = size.to_array().iter().position(|&s| s == longest).unwrap_or(0);
        items.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
        return items.len() / 2;
    }
    let cell_of = |item: &Item, axis: usize| {
        let along = (item.center[axis] - centers.min[axis]) / size[axis];
        ((along * CELLS as f32) as usize).min(CELLS - 1)
    };
    let mut cells = [[Cell::default(); CELLS]; 3];
    let axes = [0, 1, 2].into_iter().filter(|&axis| size[axis] > 0.0);
    for item in &*items {
        for axis in axes.clone() {
            let cell = &mut cells[axis][cell_of(item, axis)];
            *cell = cell.with(item);
        }
    }
    let (mut best, mut least) = (None, f32::INFINITY);
    for axis in axes {
        let cells = &cells[axis];
        let mut above = [Cell::default(); CELLS];
        for i in (1..CELLS).rev() {
            above[i - 1] = above[i].union(&cells[i]);
        }
        let mut below = Cell::default();
        for i in 0..CELLS - 1 {
            below = below.union(&cells[i]);
            // Thin slabs bound badly.
            let cost = (below.cost() + above[i].cost()) * (longest / size[axis]);
            if below.count > 0 && above[i].count > 0 && cost < least {
                (best, least) = (Some((axis, i)), cost);
            }
        }
    }
    let Some((axis, last)) = best else { return items.len() / 2 };
    let mut left = 0;
    for i in 0..items.len() {
        if cell_of(&items[i], axis) <= last {
            items.swap(left, i);
            left += 1;
        }
    }
    left
}

impl Item {
    fn new(index: u32, bounds: &LightBounds) -> Self {
        let intensity = bounds.intensity.min(1e30);
        // Of directions spread evenly over a cone.
        let mean_cos = 0.5 * (1.0 + bounds.cone.half_angle.cos());
        Self {
            center: bounds.bounds.center().as_vec3(),
            radius: bounds.radius as f32,
            moment: (bounds.cone.axis * (mean_cos * intensity)).as_vec3(),
            intensity: intensity as f32,
            index,
        }
    }
}

/// Sums over the lights of a cell.
#[derive(Debug, Clone, Copy)]
struct Cell {
    min: Vec3,
    max: Vec3,
    moment: Vec3,
    intensity: f32,
    count: u32,
}

impl Default for Cell {
    fn default() -> Self {
        Self {
            min: Vec3::INFINITY,
            max: Vec3::NEG_INFINITY,
            moment: Vec3::ZERO,
            intensity: 0.0,
            count: 0,
        }
    }
}

impl Cell {
    fn with_center(self, p: Vec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p), ..self }
    }

    #[inline]
    fn with(&self, item: &Item) -> Self {
        Self {
            min: self.min.min(item.center - item.radius),
            max: self.max.max(item.center + item.radius),
            moment: self.moment + item.moment,
            intensity: self.intensity + item.intensity,
            count: self.count + 1,
        }
    }

    #[inline]
    fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            moment: self.moment + other.moment,
            intensity: self.intensity + other.intensity,
            count: self.count + other.count,
        }
    }

    /// Intensity times size² times how much of the sphere of directions is shone to.
    ///
    /// Conty Estevez and Kulla take the surface of the box, which is none for lights in a row, hence the
    /// diagonal; and for the directions the measure of a cone, which is π for one normal and 4π for
    /// all: in between we take the length of the mean direction, which needs no cone to be found.
    #[inline]
    fn cost(&self) -> f32 {
        let spread = 4.0 - 3.0 * self.moment.length() / self.intensity.max(f32::MIN_POSITIVE);
        self.intensity * spread * (self.max - self.min).length_squared()
    }
}
