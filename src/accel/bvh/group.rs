//! The trees of a world: one over each group, and copies as items of the root's.

use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

use super::super::AccelError;
use super::super::world::{CopyRef, Geometry, Group, World, affine_from_rows};
use super::build::{Kind, Primitives, Reference, build};
use super::node::{Child, Tree};
use super::simd::{Kernel, Simd, place, prefetch};
use super::traverse::{Found, Items, any, closest};
use super::watch::Watch;
use crate::geometry::{AnalyticShape, Shapes, Sphere, with_shapes};
use crate::math::{Bounds, Ray};
use crate::pages::prefer_large;

/// A group and the tree over it. Primitives are numbered through all its geometries; items are shapes,
/// numbered in the same way (spheres among them, though few are: most stand in blocks), and then copies.
#[derive(Debug)]
pub(super) struct GroupTree {
    pub(super) tree: Tree,
    geometries: Vec<Geometry>,
    /// The number of each geometry's first primitive, and one past the last.
    first_primitives: Vec<u32>,
    /// The number of each geometry's first item; meshes have none.
    first_items: Vec<u32>,
    clear: Vec<bool>,
}

/// A copy of a prototype.
#[derive(Debug)]
pub(super) struct Copy {
    pub(super) prototype: u32,
    pub(super) id: CopyRef,
    object_from_world: DAffine3,
}

impl GroupTree {
    /// Builds the tree over a group and `copies` of prototypes, of which the boxes are given.
    pub(super) fn build(
        group: &Group,
        copies: &[(Copy, Bounds)],
        bins: usize,
        watch: &Watch,
    ) -> Result<Self, AccelError> {
        let starts = |len: &dyn Fn(&Geometry) -> usize| {
            let mut next = 0u64;
            let mut starts = vec![0];
            for geometry in &group.geometries {
                next += len(geometry) as u64;
                starts.push(u32::try_from(next).map_err(|_| AccelError::TooMany)?);
            }
            Ok::<_, AccelError>(starts)
        };
        let first_primitives = starts(&Geometry::len)?;
        let first_items = starts(&|g| if matches!(g, Geometry::Mesh(_)) { 0 } else { g.len() })?;
        let items = first_items.last().map_or(0, |n| *n as usize) + copies.len();
        let primitives = first_primitives.last().map_or(0, |n| *n as usize);
        // Not quite that many: the last number means none.
        if items >= Child::LIMIT || primitives >= u32::MAX as usize {
            return Err(AccelError::TooMany);
        }
        let expected = (primitives + copies.len()) * size_of::<Reference>();
        watch.reserve(expected as u64)?;

        let mut refs = Vec::with_capacity(primitives + copies.len());
        prefer_large(&mut refs);
        let mut endless = Vec::new();
        let mut add = |kind: Kind, id: u32, item: u32, bounds: &Bounds| {
            if bounds.is_empty() {
                return None;
            }
            let [lower, upper] = outer(bounds);
            let reference = Reference::new(kind, id, lower, upper);
            if !reference.is_finite() {
                endless.push(item);
                return None;
            }
            Some(reference)
        };
        for (i, geometry) in group.geometries.iter().enumerate() {
            match geometry {
                Geometry::Mesh(mesh) => {
                    refs.par_extend((0..mesh.triangles.len()).into_par_iter().map(|t| {
                        Reference::triangle(first_primitives[i] + t as u32, mesh.corners(t))
                    }))
                }
                Geometry::Shapes(Shapes::Spheres(list)) => {
                    let spheres = (first_primitives[i]..).zip(first_items[i]..).zip(list.iter());
                    refs.extend(spheres.filter_map(|((id, item), sphere)| {
                        add(Kind::Sphere, id, item, &sphere.bounds())
                    }));
                }
                Geometry::Shapes(shapes) => with_shapes!(shapes, list => {
                    let boxes = (first_items[i]..).zip(list.iter());
                    refs.extend(boxes.filter_map(|(item, shape)| {
                        add(Kind::Item, item, item, &shape.bounds())
                    }));
                }),
            }
        }
        let copy_items = first_items.last().copied().unwrap_or(0)..;
        refs.extend(
            copy_items
                .zip(copies)
                .filter_map(|(item, (_, bounds))| add(Kind::Item, item, item, bounds)),
        );
        if !refs.par_iter().all(Reference::is_finite) {
            refs.retain(Reference::is_finite);
        }

        let mut group = Self {
            tree: Tree::default(),
            geometries: group.geometries.clone(),
            clear: (0..group.geometries.len()).map(|i| group.is_clear(i)).collect(),
            first_primitives,
            first_items,
        };
        group.tree = build(refs, endless, bins, &group, watch)?;
        Ok(group)
    }

    /// The box around everything; infinite where something has no end.
    pub(super) fn bounds(&self) -> Bounds {
        if !self.tree.endless.is_empty() {
            return Bounds { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
        }
        let Some(root) = self.tree.nodes.first() else { return Bounds::EMPTY };
        let corner = |side: usize, fold: fn(f32, f32) -> f32| {
            DVec3::from([0, 1, 2].map(|axis| {
                f64::from(root.planes[axis][side].into_iter().reduce(fold).unwrap_or(0.0))
            }))
        };
        Bounds { min: corner(0, f32::min), max: corner(1, f32::max) }
    }

    /// A primitive's geometry, the number of that and its own in it.
    #[inline(always)]
    pub(super) fn primitive(&self, id: u32) -> (&Geometry, u32, u32) {
        let geometry = match self.first_primitives.len() {
            2 => 0,
            _ => self.first_primitives.partition_point(|first| *first <= id) - 1,
        };
        (&self.geometries[geometry], geometry as u32, id - self.first_primitives[geometry])
    }

    /// Whether there is nothing but one mesh.
    #[inline]
    pub(super) fn is_one_mesh(&self) -> bool {
        let Tree { is_of_triangles, endless, .. } = &self.tree;
        *is_of_triangles && endless.is_empty() && self.geometries.len() == 1
    }

    /// Whether an item is a shape, not a copy; if so, of which geometry, and its number in that.
    #[inline]
    fn shape(&self, item: u32) -> Option<(usize, u32)> {
        let geometry = self.first_items.partition_point(|first| *first <= item) - 1;
        let is_shape = geometry < self.geometries.len();
        is_shape.then(|| (geometry, item - self.first_items[geometry]))
    }

    #[inline]
    fn first_copy(&self) -> u32 {
        self.first_items[self.geometries.len()]
    }
}

impl Primitives for GroupTree {
    fn corners(&self, id: u32) -> [Vec3; 3] {
        match self.primitive(id) {
            (Geometry::Mesh(mesh), _, index) => mesh.corners(index as usize),
            (Geometry::Shapes(_), ..) => unreachable!("a triangle is of a mesh"),
        }
    }

    fn sphere(&self, id: u32) -> Sphere {
        match self.primitive(id) {
            (Geometry::Shapes(Shapes::Spheres(list)), _, index) => list[index as usize],
            _ => unreachable!("a sphere is of a list of spheres"),
        }
    }
}

impl Copy {
    /// None where the transform is singular. With the box that it has in the world.
    pub(super) fn new(
        id: CopyRef,
        prototype: u32,
        world: &World,
        prototypes: &[GroupTree],
    ) -> Option<(Self, Bounds)> {
        let world_from_object = affine_from_rows(world.transform(id));
        let object_from_world = world_from_object.inverse();
        if !object_from_world.is_finite() {
            return None;
        }
        let b = prototypes[prototype as usize].bounds();
        let bounds = if b.is_finite() { b.transformed(&world_from_object) } else { b };
        Some((Self { prototype, id, object_from_world }, bounds))
    }

    /// The ray as the prototype sees it. Distances stay what they are.
    #[inline]
    fn moved(&self, ray: &Ray) -> Ray {
        let m = &self.object_from_world;
        Ray {
            origin: m.transform_point3(ray.origin.as_dvec3()).as_vec3(),
            direction: m.transform_vector3(ray.direction.as_dvec3()).as_vec3(),
            ..*ray
        }
    }
}

/// A box in f32, wider by some roundings: those of what is solved in f64 and of rays that are moved into
/// a copy.
fn outer(b: &Bounds) -> [Vec3; 2] {
    let reach = b.min.abs().max(b.max.abs()).max_element();
    let pad = if reach.is_finite() { DVec3::splat(reach * 2.5e-7) } else { DVec3::ZERO };
    let down = |p: DVec3| (p - pad).as_vec3().map(f32::next_down);
    let up = |p: DVec3| (p + pad).as_vec3().map(f32::next_up);
    [down(b.min), up(b.max)]
}

/// The items of a prototype: shapes.
#[derive(Clone, Copy)]
pub(super) struct ShapeItems<'a>(pub(super) &'a GroupTree);

/// The items of the root: shapes and copies.
#[derive(Clone, Copy)]
pub(super) struct RootItems<'a, const ROBUST: bool> {
    pub(super) root: &'a GroupTree,
    pub(super) prototypes: &'a [GroupTree],
    pub(super) copies: &'a [Copy],
}

impl Items for ShapeItems<'_> {
    #[inline(always)]
    fn intersect<S: Simd>(self, _simd: S, item: u32, ray: &Ray) -> Option<Found> {
        intersect_shape(self.0, item, ray)
    }

    #[inline(always)]
    fn occluded<S: Simd, const OPAQUE: bool>(self, _simd: S, item: u32, ray: &Ray) -> bool {
        shape_occludes(self.0, item, ray, OPAQUE)
    }

    #[inline(always)]
    fn is_clear(self, id: u32) -> bool {
        is_clear(self.0, id)
    }

    #[inline(always)]
    fn foresee(self, _id: u32) {}
}

impl<const ROBUST: bool> Items for RootItems<'_, ROBUST> {
    #[inline(always)]
    fn intersect<S: Simd>(self, simd: S, item: u32, ray: &Ray) -> Option<Found> {
        let Some(copy) = item.checked_sub(self.root.first_copy()) else {
            return intersect_shape(self.root, item, ray);
        };
        let kernel = ClosestInCopy::<ROBUST> {
            copy: &self.copies[copy as usize],
            prototypes: self.prototypes,
            ray,
        };
        // A function of its own: the loop around it is for triangles.
        simd.run(kernel).map(|found| Found { copy, ..found })
    }

    #[inline(always)]
    fn occluded<S: Simd, const OPAQUE: bool>(self, simd: S, item: u32, ray: &Ray) -> bool {
        let Some(copy) = item.checked_sub(self.root.first_copy()) else {
            return shape_occludes(self.root, item, ray, OPAQUE);
        };
        simd.run(AnyInCopy::<ROBUST, OPAQUE> {
            copy: &self.copies[copy as usize],
            prototypes: self.prototypes,
            ray,
        })
    }

    #[inline(always)]
    fn is_clear(self, id: u32) -> bool {
        is_clear(self.root, id)
    }

    #[inline(always)]
    fn foresee(self, id: u32) {
        if let [Geometry::Mesh(mesh)] = &self.root.geometries[..]
            && self.root.tree.is_large()
        {
            prefetch::<{ size_of::<[u32; 3]>() }>(place(&mesh.triangles[..], id as usize));
        }
    }
}

struct ClosestInCopy<'a, const ROBUST: bool> {
    copy: &'a Copy,
    prototypes: &'a [GroupTree],
    ray: &'a Ray,
}

impl<const ROBUST: bool> Kernel for ClosestInCopy<'_, ROBUST> {
    type Output = Option<Found>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Option<Found> {
        let group = &self.prototypes[self.copy.prototype as usize];
        let ray = self.copy.moved(self.ray);
        closest::<S, ROBUST>(simd, &group.tree, ShapeItems(group), &ray)
    }
}

struct AnyInCopy<'a, const ROBUST: bool, const OPAQUE: bool> {
    copy: &'a Copy,
    prototypes: &'a [GroupTree],
    ray: &'a Ray,
}

impl<const ROBUST: bool, const OPAQUE: bool> Kernel for AnyInCopy<'_, ROBUST, OPAQUE> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let group = &self.prototypes[self.copy.prototype as usize];
        let ray = self.copy.moved(self.ray);
        any::<S, ROBUST, OPAQUE>(simd, &group.tree, ShapeItems(group), &ray)
    }
}

fn is_clear(group: &GroupTree, id: u32) -> bool {
    group.clear[group.primitive(id).1 as usize]
}

#[inline(never)]
fn intersect_shape(group: &GroupTree, item: u32, ray: &Ray) -> Option<Found> {
    let (geometry, index) = group.shape(item)?;
    let Geometry::Shapes(shapes) = &group.geometries[geometry] else { return None };
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let hit = with_shapes!(shapes, list => {
        list[index as usize].intersect(o, d, ray.t_min.into(), ray.t_max.into())
    })?;
    Some(Found::shape(hit, group.first_primitives[geometry] + index))
}

#[inline(never)]
fn shape_occludes(group: &GroupTree, item: u32, ray: &Ray, opaque_alone: bool) -> bool {
    let Some((geometry, index)) = group.shape(item) else { return false };
    let Geometry::Shapes(shapes) = &group.geometries[geometry] else { return false };
    if opaque_alone && group.clear[geometry] {
        return false;
    }
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    with_shapes!(shapes, list => {
        list[index as usize].occluded(o, d, ray.t_min.into(), ray.t_max.into())
    })
}
