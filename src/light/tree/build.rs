//! Building the tree: from the top by where lights are, then bounds from the bottom.

use glam::Vec3;

use super::super::bounds::LightBounds;
use super::node::Node;

/// Cells along each axis whose borders are tried as splits. Source: pbrt 4ed §12.6.3.
const CELLS: usize = 12;

/// What the choice of a split needs of a light; f32 will do.
#[derive(Debug, Clone, Copy)]
struct Item {
    center: Vec3,
    radius: f32,
    /// Intensity times the mean direction of its cone.
    moment: Vec3,
    intensity: f32,
    /// Index into the bounded lights.
    index: u32,
}

/// A node's part of the items.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    first: u32,
    count: u32,
}

/// Nodes, depth first, and the parent of each, over (index, bound) of lights.
pub(super) fn build(lights: &[(u32, LightBounds)]) -> (Vec<Node>, Vec<u32>) {
    if lights.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let mut items: Vec<Item> = (0..).zip(lights).map(|(i, (_, b))| Item::new(i, b)).collect();
    // A subtree over n lights has 2n − 1 nodes, so where each begins is known before it is made.
    let mut parts = vec![Part::default(); 2 * lights.len() - 1];
    let mut parents = vec![0; parts.len()];
    let mut open = vec![(0, Part { first: 0, count: items.len() as u32 })];
    while let Some((node, part)) = open.pop() {
        parts[node as usize] = part;
        if part.count > 1 {
            let left = split(&mut items[part.first as usize..][..part.count as usize]) as u32;
            let right = Part { first: part.first + left, count: part.count - left };
            let children = [(node + 1, Part { count: left, ..part }), (node + 2 * left, right)];
            for (child, part) in children {
                parents[child as usize] = node;
                open.push((child, part));
            }
        }
    }
    (bounded_nodes(lights, &items, &parts), parents)
}

/// The nodes with their bounds. Backwards, children come before their parent, the left one last.
fn bounded_nodes(lights: &[(u32, LightBounds)], items: &[Item], parts: &[Part]) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(parts.len());
    let mut done: Vec<LightBounds> = Vec::new();
    for (node, part) in parts.iter().enumerate().rev() {
        let children = if part.count > 1 { done.pop().zip(done.pop()) } else { None };
        let bounds = match children {
            None => {
                let (light, bounds) = &lights[items[part.first as usize].index as usize];
                nodes.push(Node::leaf(bounds, *light));
                *bounds
            }
            Some((left, right)) => {
                let bounds = left.union(&right);
                let right = node as u32 + 2 * parts[node + 1].count;
                nodes.push(Node::inner(&bounds, right));
                bounds
            }
        };
        done.push(bounds);
    }
    nodes.reverse();
    nodes
}

/// Sorts items into two parts, neither empty, and tells how many are in the first.
fn split(items: &mut [Item]) -> usize {
    let centers = items.iter().fold(Cell::default(), |cell, item| cell.with_center(item.center));
    let size = centers.max - centers.min;
    let longest = size.max_element();
    // Two, or all at one place (or not finite in f32).
    if items.len() == 2 || !(longest > 0.0 && longest.is_finite()) {
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
