//! The crate `obvhs`: a binary hierarchy and a compressed one of eight children, preset `fast`.

use std::time::Duration;

use ::obvhs::bvh2::Bvh2;
use ::obvhs::bvh2::builder::build_bvh2_from_tris;
use ::obvhs::cwbvh::CwBvh;
use ::obvhs::cwbvh::builder::build_cwbvh_from_tris;
use ::obvhs::ray::{Ray as ObvhsRay, RayHit};
use ::obvhs::triangle::Triangle;
use ::obvhs::{BvhBuildParams, cwbvh};

use super::{Flat, Names, info};
use crate::accel::{AccelInfo, Hit, RayQuery};
use crate::math::Ray;

/// Triangles in the order of a hierarchy's leaves.
#[derive(Debug)]
struct Leaves {
    triangles: Vec<Triangle>,
    /// Their numbers in the flattened world.
    indices: Vec<u32>,
    names: Names,
}

/// Its binary hierarchy.
pub struct ObvhsBvh2 {
    bvh: Bvh2,
    leaves: Leaves,
}

/// Its compressed hierarchy of eight children.
pub struct ObvhsCwBvh {
    bvh: CwBvh,
    leaves: Leaves,
}

impl ObvhsBvh2 {
    /// Builds on the threads of the current rayon pool.
    pub fn build(flat: &Flat) -> Self {
        let triangles = triangles(flat);
        let params = BvhBuildParams::fast_build();
        let mut bvh = build_bvh2_from_tris(&triangles, params, &mut Duration::default());
        let leaves = Leaves::new(&triangles, std::mem::take(&mut bvh.primitive_indices), flat);
        Self { bvh, leaves }
    }

    /// Name and sizes, for reports.
    pub fn info(&self) -> AccelInfo {
        info("obvhs BVH2", size_of_val(&*self.bvh.nodes) + self.leaves.bytes())
    }
}

impl ObvhsCwBvh {
    /// Builds on the threads of the current rayon pool.
    pub fn build(flat: &Flat) -> Self {
        let triangles = triangles(flat);
        let params = BvhBuildParams::fast_build();
        let mut bvh = build_cwbvh_from_tris(&triangles, params, &mut Duration::default());
        let leaves = Leaves::new(&triangles, std::mem::take(&mut bvh.primitive_indices), flat);
        Self { bvh, leaves }
    }

    /// Name and sizes, for reports.
    pub fn info(&self) -> AccelInfo {
        let nodes = self.bvh.nodes.len() * size_of::<cwbvh::node::CwBvhNode>();
        info("obvhs CWBVH", nodes + self.leaves.bytes())
    }
}

impl Leaves {
    fn new(triangles: &[Triangle], indices: Vec<u32>, flat: &Flat) -> Self {
        let triangles = indices.iter().map(|&i| triangles[i as usize]).collect();
        Self { triangles, indices, names: flat.names.clone() }
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.triangles) + size_of_val(&*self.indices)
    }

    /// The crate's own test.
    #[inline(always)]
    fn test(&self, ray: &ObvhsRay, i: usize) -> f32 {
        self.triangles[i].intersect(ray)
    }

    fn hit(&self, hit: &RayHit) -> Hit {
        self.names.hit(hit.t, self.indices[hit.primitive_id as usize])
    }
}

impl RayQuery for ObvhsBvh2 {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut hit = RayHit::none();
        let found = self.bvh.ray_traverse(native(ray), &mut hit, |ray, i| self.leaves.test(ray, i));
        found.then(|| self.leaves.hit(&hit))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        !self.bvh.ray_traverse_miss(native(ray), |ray, i| self.leaves.test(ray, i))
    }

    /// It knows no clear geometry.
    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.occluded(ray)
    }
}

impl RayQuery for ObvhsCwBvh {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut hit = RayHit::none();
        let found = self.bvh.ray_traverse(native(ray), &mut hit, |ray, i| self.leaves.test(ray, i));
        found.then(|| self.leaves.hit(&hit))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        !self.bvh.ray_traverse_miss(native(ray), |ray, i| self.leaves.test(ray, i))
    }

    /// It knows no clear geometry.
    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.occluded(ray)
    }
}

fn triangles(flat: &Flat) -> Vec<Triangle> {
    let triangle =
        |[a, b, c]: &[[f32; 3]; 3]| Triangle { v0: (*a).into(), v1: (*b).into(), v2: (*c).into() };
    flat.triangles.iter().map(triangle).collect()
}

fn native(ray: &Ray) -> ObvhsRay {
    ObvhsRay::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max)
}
