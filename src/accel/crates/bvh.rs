//! The crate `bvh`: a binary hierarchy by the surface area heuristic.

use ::bvh::aabb::{Aabb, Bounded};
use ::bvh::bounding_hierarchy::{BHShape, BoundingHierarchy};
use ::bvh::bvh::{Bvh, BvhNode};
use ::bvh::ray::Ray as BvhRay;
use nalgebra::{Point3, Vector3};

use super::{Flat, Names, info};
use crate::accel::{AccelInfo, Hit, RayQuery};
use crate::math::Ray;

/// Nodes that the crate's iterator can hold; it panics beyond.
const ITERATOR_HOLDS: usize = 32;

/// The crate's hierarchy, with its own ray and triangle test.
#[derive(Debug)]
pub struct BvhCrate {
    bvh: Bvh<f32, 3>,
    triangles: Vec<Triangle>,
    names: Names,
    is_deep: bool,
}

#[derive(Debug, Clone)]
struct Triangle {
    corners: [Point3<f32>; 3],
    index: u32,
    node: usize,
}

impl BvhCrate {
    /// Builds on the threads of the current rayon pool.
    pub fn build(flat: &Flat) -> Self {
        let triangles = (0u32..).zip(&flat.triangles).map(|(index, corners)| {
            let corners = corners.map(|[x, y, z]| Point3::new(x, y, z));
            Triangle { corners, index, node: 0 }
        });
        let mut triangles: Vec<Triangle> = triangles.collect();
        let bvh = Bvh::build_par(&mut triangles);
        let is_deep = levels(&bvh) > ITERATOR_HOLDS;
        Self { bvh, triangles, names: flat.names.clone(), is_deep }
    }

    /// Name and sizes, for reports.
    pub fn info(&self) -> AccelInfo {
        info("bvh", size_of_val(&*self.bvh.nodes) + size_of_val(&*self.triangles))
    }

    /// Every triangle whose box the ray meets, in no order: the crate has no search that ends at the
    /// closest hit.
    fn any<'a>(&'a self, ray: &'a BvhRay<f32, 3>, mut test: impl FnMut(&'a Triangle) -> bool) {
        if self.is_deep {
            let _ = self.bvh.traverse(ray, &self.triangles).into_iter().any(test);
        } else {
            let _ = self.bvh.traverse_iterator(ray, &self.triangles).any(&mut test);
        }
    }
}

impl RayQuery for BvhCrate {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let line = native(ray);
        let mut closest: Option<(f32, u32)> = None;
        self.any(&line, |triangle| {
            let t = triangle.test(&line);
            let limit = closest.map_or(ray.t_max, |(t, _)| t);
            if t > ray.t_min && t <= limit && t < f32::INFINITY {
                closest = Some((t, triangle.index));
            }
            false
        });
        closest.map(|(t, i)| self.names.hit(t, i))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let line = native(ray);
        let mut found = false;
        self.any(&line, |triangle| {
            let t = triangle.test(&line);
            found = t > ray.t_min && t <= ray.t_max && t < f32::INFINITY;
            found
        });
        found
    }

    /// It knows no clear geometry.
    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.occluded(ray)
    }
}

impl Triangle {
    /// The crate's own test; infinite where there is no hit.
    fn test(&self, ray: &BvhRay<f32, 3>) -> f32 {
        let [a, b, c] = &self.corners;
        ray.intersects_triangle(a, b, c).distance
    }
}

impl Bounded<f32, 3> for Triangle {
    fn aabb(&self) -> Aabb<f32, 3> {
        let [a, b, c] = &self.corners;
        Aabb::empty().grow(a).grow(b).grow(c)
    }
}

impl BHShape<f32, 3> for Triangle {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// Nodes on the longest way from the root to a leaf.
fn levels(bvh: &Bvh<f32, 3>) -> usize {
    let mut deepest = 0;
    let mut waiting = vec![(0, 1)];
    while let Some((node, level)) = waiting.pop() {
        deepest = deepest.max(level);
        if let Some(&BvhNode::Node { child_l_index, child_r_index, .. }) = bvh.nodes.get(node) {
            waiting.extend([child_l_index, child_r_index].map(|child| (child, level + 1)));
        }
    }
    deepest
}

fn native(ray: &Ray) -> BvhRay<f32, 3> {
    let [o, d] = [ray.origin, ray.direction].map(|v| v.to_array());
    BvhRay::new(Point3::from(o), Vector3::from(d))
}
