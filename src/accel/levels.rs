//! What the plain trees have in common: a tree over the primitives of each group, and one over the boxes
//! of the copies. A tree itself only knows numbered boxes.

use glam::{DAffine3, DVec3};

use super::primitive::{Found, Line, hit_primitive, primitive_bounds};
use super::world::{CopyRef, Geometry, Group, World, affine_from_rows};
use super::{AccelError, AccelInfo, Hit, RayQuery};
use crate::math::{Bounds, Ray};

/// Whether to go on with a build; asked from several threads.
pub(super) type GoOn<'a> = dyn Fn() -> bool + Sync + 'a;

/// A hierarchy over numbered boxes.
pub(super) trait BoxTree: Sync + Sized {
    /// What it is called in reports.
    const NAME: &'static str;

    /// Builds it, on the threads of the current rayon pool. Anything comes of a build that was not to go on.
    fn build(boxes: &[Bounds], go_on: &GoOn<'_>) -> Self;

    /// Calls `test` with at least those boxes that the ray meets before `t_max`, roughly from front to back and
    /// perhaps more than once; it returns how far to go on looking.
    fn visit(&self, ray: &Line, t_max: f64, test: impl FnMut(u32, f64) -> f64);

    /// Bytes held.
    fn bytes(&self) -> usize;
}

/// A tree for each group and one over all copies.
#[derive(Debug)]
pub(super) struct Levels<T> {
    root: GroupTree<T>,
    prototypes: Vec<GroupTree<T>>,
    copies: Vec<Copy>,
    copy_tree: T,
}

/// The primitives of a group: those with an end in a tree, the others in a list.
#[derive(Debug)]
struct GroupTree<T> {
    geometries: Vec<Geometry>,
    clear: Vec<bool>,
    /// Number of the first primitive of each geometry in the tree; of an endless one there are none.
    starts: Vec<u32>,
    tree: T,
}

/// One copy of a prototype.
#[derive(Debug)]
struct Copy {
    id: CopyRef,
    prototype: usize,
    object_from_world: DAffine3,
}

/// Where a ray was found to hit something.
struct Closest {
    found: Found,
    geometry: u32,
    primitive: u32,
    copy: Option<CopyRef>,
}

impl<T: BoxTree> Levels<T> {
    /// Builds all trees.
    ///
    /// # Errors
    /// [`AccelError::Interrupted`] where it is not to go on.
    pub(super) fn build(world: &World, go_on: &GoOn<'_>) -> Result<Self, AccelError> {
        let root = GroupTree::build(&world.root, go_on);
        let prototypes = world.prototypes.iter().map(|group| GroupTree::build(group, go_on));
        let prototypes: Vec<_> = prototypes.collect();
        let group_bounds: Vec<Bounds> = world.prototypes.iter().map(Group::bounds).collect();
        let mut copies = Vec::new();
        let mut boxes = Vec::new();
        for (set, s) in (0u32..).zip(&world.sets) {
            let prototype = s.prototype as usize;
            for (index, rows) in (0u32..).zip(s.transforms.iter()) {
                let world_from_object = affine_from_rows(rows);
                boxes.push(group_bounds[prototype].transformed(&world_from_object));
                copies.push(Copy {
                    id: CopyRef { set, index },
                    prototype,
                    object_from_world: world_from_object.inverse(),
                });
            }
        }
        let copy_tree = T::build(&padded(boxes), go_on);
        if go_on() {
            Ok(Self { root, prototypes, copies, copy_tree })
        } else {
            Err(AccelError::Interrupted)
        }
    }

    pub(super) fn info(&self) -> AccelInfo {
        let trees = self.prototypes.iter().chain([&self.root]).map(|group| group.tree.bytes());
        let copies = self.copy_tree.bytes() + size_of_val(&*self.copies);
        let bytes = trees.sum::<usize>() + copies;
        AccelInfo { name: T::NAME.into(), isa: "f64", packet_width: 1, bytes: bytes as u64 }
    }

    /// The closest hit, or with `any` the first one that is found.
    fn find(&self, ray: &Ray, any: bool, passes_clear: bool) -> Option<Closest> {
        let mut closest = None;
        let line = Line::new(ray);
        let mut t_max = f64::from(ray.t_max);
        let mut look = |group: &GroupTree<T>, line: &Line, t_max: f64, copy| {
            group.visit(line, t_max, passes_clear, |found, geometry, primitive| {
                closest = Some(Closest { found, geometry, primitive, copy });
                // Nothing is nearer than nothing: every further test fails at once.
                if any { f64::NEG_INFINITY } else { found.t }
            })
        };
        t_max = look(&self.root, &line, t_max, None);
        self.copy_tree.visit(&line, t_max, |i, t_max| {
            let copy = &self.copies[i as usize];
            let line = line.transformed(&copy.object_from_world);
            look(&self.prototypes[copy.prototype], &line, t_max, Some(copy.id))
        });
        closest
    }
}

impl<T: BoxTree> GroupTree<T> {
    fn build(group: &Group, go_on: &GoOn<'_>) -> Self {
        let mut starts = Vec::with_capacity(group.geometries.len());
        let mut boxes = Vec::new();
        for geometry in &group.geometries {
            starts.push(boxes.len() as u32);
            if !geometry.is_endless() {
                boxes.extend((0..geometry.len()).map(|i| primitive_bounds(geometry, i)));
            }
        }
        Self {
            geometries: group.geometries.clone(),
            clear: (0..group.geometries.len()).map(|i| group.is_clear(i)).collect(),
            starts,
            tree: T::build(&padded(boxes), go_on),
        }
    }

    /// Calls `found` with hits that come nearer and nearer, and returns how far to go on looking.
    fn visit(
        &self,
        ray: &Line,
        mut t_max: f64,
        passes_clear: bool,
        mut found: impl FnMut(Found, u32, u32) -> f64,
    ) -> f64 {
        let mut test = |geometry: usize, primitive: usize, t_max: f64| {
            if passes_clear && self.clear[geometry] {
                return t_max;
            }
            match hit_primitive(&self.geometries[geometry], primitive, ray, t_max) {
                Some(hit) => found(hit, geometry as u32, primitive as u32),
                None => t_max,
            }
        };
        let endless = self.geometries.iter().enumerate().filter(|(_, g)| g.is_endless());
        for (g, geometry) in endless {
            for i in 0..geometry.len() {
                t_max = test(g, i, t_max);
            }
        }
        self.tree.visit(ray, t_max, |i, limit| {
            let geometry = self.starts.partition_point(|&start| start <= i) - 1;
            t_max = test(geometry, (i - self.starts[geometry]) as usize, limit);
            t_max
        });
        t_max
    }
}

impl<T: BoxTree> RayQuery for Levels<T> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.find(ray, false, false)?;
        Some(hit.found.named(hit.geometry, hit.primitive, hit.copy))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.find(ray, true, false).is_some()
    }

    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.find(ray, true, true).is_some()
    }
}

/// The boxes, each larger by far more than rounding in f64 can move a ray that comes from within a million
/// sizes, and by far less than can be seen: what a ray meets is then found in every cell that the ray may
/// be thought to cross.
fn padded(boxes: Vec<Bounds>) -> Vec<Bounds> {
    let filled = boxes.iter().copied().filter(|b| !b.is_empty());
    let whole = filled.fold(Bounds::EMPTY, Bounds::union);
    if whole.is_empty() {
        return boxes;
    }
    let reach = whole.min.abs().max(whole.max.abs()).max_element();
    let pad = DVec3::splat(1e-9 * reach);
    boxes.into_iter().map(|b| Bounds { min: b.min - pad, max: b.max + pad }).collect()
}
