//! An octree: space cut into eight equal parts, again and again where there is much. Plain, for
//! comparison in `alhazen bench`.
//!
//! Source: Glassner, *Space Subdivision for Fast Ray Tracing*, IEEE CG&A 4(10) 1984. Cells are walked from
//! front to back by the planes that halve them, where Glassner looks each cell up by a point in it.

use glam::DVec3;

use super::levels::{BoxTree, GoOn, Levels};
use super::primitive::Line;
use super::world::World;
use super::{AccelError, AccelInfo, Hit, RayQuery};
use crate::math::{Bounds, Ray};

/// Cells with at most this many boxes are not cut.
const FEW: usize = 8;

/// Cells so deep are not cut, whatever they hold.
const DEPTH: u32 = 20;

/// Cells are not cut where their parts would together hold this many times what they hold.
const COPIES: usize = 3;

/// From so many boxes on, parts are built on several threads.
const PARALLEL_FROM: usize = 1 << 13;

/// Octrees over the primitives of a world, answering in f64.
#[derive(Debug)]
pub struct Octree(Levels<Cells>);

impl Octree {
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

impl RayQuery for Octree {
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

/// The tree: each cell is `items[first..]` or eight parts, of which part i lies on the upper side of the
/// halving plane of axis k where bit k of i is set.
#[derive(Debug)]
struct Cells {
    bounds: Bounds,
    cells: Vec<Cell>,
    items: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
enum Cell {
    Leaf {
        first: u32,
        count: u32,
    },
    /// The first of eight cells in a row.
    Parts(u32),
}

/// A cell that is being built.
enum Draft {
    Leaf(Vec<u32>),
    Parts(Box<[Self; 8]>),
}

impl BoxTree for Cells {
    const NAME: &'static str = "octree";

    fn build(boxes: &[Bounds], go_on: &GoOn<'_>) -> Self {
        let filled = (0u32..).zip(boxes).filter(|(_, b)| !b.is_empty());
        let items: Vec<u32> = filled.map(|(i, _)| i).collect();
        let bounds = items.iter().fold(Bounds::EMPTY, |b, &i| b.union(boxes[i as usize]));
        let draft = Draft::build(&bounds, items, 0, boxes, go_on);
        let leaf = Cell::Leaf { first: 0, count: 0 };
        let mut tree = Self { bounds, cells: vec![leaf], items: Vec::new() };
        tree.put(0, draft);
        tree.cells.shrink_to_fit();
        tree.items.shrink_to_fit();
        tree
    }

    fn visit(&self, ray: &Line, t_max: f64, mut test: impl FnMut(u32, f64) -> f64) {
        let Some((enter, exit)) = self.bounds.clip(ray.origin, ray.direction) else { return };
        let span = [enter.max(ray.t_min), exit];
        self.walk(0, &self.bounds, ray, span, t_max, &mut test);
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.cells) + size_of_val(&*self.items)
    }
}

impl Draft {
    fn build(
        bounds: &Bounds,
        items: Vec<u32>,
        depth: u32,
        boxes: &[Bounds],
        go_on: &GoOn<'_>,
    ) -> Self {
        if items.len() <= FEW || depth == DEPTH || !go_on() {
            return Self::Leaf(items);
        }
        let parts: [Bounds; 8] = std::array::from_fn(|i| part(bounds, i));
        let touching = |part: &Bounds| {
            let touches = |&i: &u32| overlap(&boxes[i as usize], part);
            items.iter().copied().filter(touches).collect::<Vec<_>>()
        };
        let shares = parts.map(|part| touching(&part));
        if shares.iter().map(Vec::len).sum::<usize>() >= COPIES * items.len() {
            return Self::Leaf(items);
        }
        let is_large = items.len() >= PARALLEL_FROM;
        drop(items);
        let [a, b, c, d, e, f, g, h] = shares;
        let child =
            |i: usize, items: Vec<u32>| Self::build(&parts[i], items, depth + 1, boxes, go_on);
        let lower = move || [child(0, a), child(1, b), child(2, c), child(3, d)];
        let upper = move || [child(4, e), child(5, f), child(6, g), child(7, h)];
        let ([a, b, c, d], [e, f, g, h]) =
            if is_large { rayon::join(lower, upper) } else { (lower(), upper()) };
        Self::Parts(Box::new([a, b, c, d, e, f, g, h]))
    }
}

impl Cells {
    /// Writes a finished cell to its place, and what it holds behind all others.
    fn put(&mut self, at: usize, draft: Draft) {
        self.cells[at] = match draft {
            Draft::Leaf(items) => {
                let first = self.items.len() as u32;
                self.items.extend_from_slice(&items);
                Cell::Leaf { first, count: items.len() as u32 }
            }
            Draft::Parts(parts) => {
                let first = self.cells.len();
                self.cells.resize(first + 8, Cell::Leaf { first: 0, count: 0 });
                for (i, part) in parts.into_iter().enumerate() {
                    self.put(first + i, part);
                }
                Cell::Parts(first as u32)
            }
        };
    }

    /// Tests what lies in the cell, which the ray crosses from `enter` to `exit`.
    fn walk(
        &self,
        cell: usize,
        bounds: &Bounds,
        ray: &Line,
        [enter, exit]: [f64; 2],
        mut t_max: f64,
        test: &mut impl FnMut(u32, f64) -> f64,
    ) -> f64 {
        let first = match self.cells[cell] {
            Cell::Leaf { first, count } => {
                let items = &self.items[first as usize..][..count as usize];
                return items.iter().fold(t_max, |t_max, &i| test(i, t_max));
            }
            Cell::Parts(first) => first as usize,
        };
        // Where the ray crosses the three planes: at most four parts, from one crossing to the next.
        let middle = bounds.center();
        let crossings = (middle - ray.origin) / ray.direction;
        let mut from = enter;
        while from <= exit && from <= t_max {
            let next = [crossings.x, crossings.y, crossings.z].into_iter().filter(|t| *t > from);
            let to = next.fold(exit, f64::min);
            let i = part_between(middle, crossings, ray, from);
            t_max = self.walk(first + i, &part(bounds, i), ray, [from, to], t_max, test);
            if to >= exit {
                break;
            }
            from = to;
        }
        t_max
    }
}

/// The part in which the ray runs from `from` on, until it crosses the next plane.
fn part_between(middle: DVec3, crossings: DVec3, ray: &Line, from: f64) -> usize {
    let is_upper = |axis: usize| {
        if ray.direction[axis] == 0.0 {
            ray.origin[axis] > middle[axis]
        } else {
            // On the upper side behind a crossing upward, and before one downward.
            (crossings[axis] <= from) == (ray.direction[axis] > 0.0)
        }
    };
    (0..3).filter(|&axis| is_upper(axis)).fold(0, |i, axis| i | 1 << axis)
}

/// Part `i` of a cell.
fn part(bounds: &Bounds, i: usize) -> Bounds {
    let middle = bounds.center();
    let mut part = *bounds;
    for axis in 0..3 {
        let end = if i >> axis & 1 == 1 { &mut part.min } else { &mut part.max };
        end[axis] = middle[axis];
    }
    part
}

/// Whether two boxes have a point in common.
fn overlap(a: &Bounds, b: &Bounds) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}
