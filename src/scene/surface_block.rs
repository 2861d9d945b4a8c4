//! The surface points of a block side by side: what [`Scene::surface`] finds for each lane, in loops over
//! lanes that the compiler turns into vector instructions.

#![expect(clippy::needless_range_loop, reason = "lanes of several arrays side by side")]

use glam::Vec3;

use super::build::Scene;
use super::surface::{Local, SurfacePoint, facing, on_triangle, smooth_normal, spawn, to_world};
use crate::accel::{Geometry, HitBlock, LANES, RayBlock, lanes_of};
use crate::geometry::TriangleMesh;
use crate::material::Material;
use crate::math::Vec3Lanes;

/// Points on surfaces, by lane; see [`SurfacePoint`].
#[derive(Debug, Clone)]
pub struct SurfaceBlock {
    /// Positions in the scene's space.
    pub position: Vec3Lanes<LANES>,
    /// Bounds on how far coordinates are off.
    pub error: [f32; LANES],
    /// Unit geometric normals on the viewer's side.
    pub geometric_normal: Vec3Lanes<LANES>,
    /// Unit shading normals on the viewer's side.
    pub normal: Vec3Lanes<LANES>,
    is_front: [bool; LANES],
    material: [u32; LANES],
    hit: u16,
}

impl SurfaceBlock {
    /// The lanes that hit something, as bits.
    #[inline]
    pub fn hit(&self) -> u16 {
        self.hit
    }

    /// What a lane's surface is made of.
    #[inline]
    pub fn material<'s>(&self, scene: &'s Scene, lane: usize) -> &'s Material {
        &scene.materials[self.material[lane] as usize]
    }

    /// One point by itself.
    #[inline]
    pub fn point<'s>(&self, scene: &'s Scene, lane: usize) -> SurfacePoint<'s> {
        SurfacePoint {
            position: self.position.get(lane),
            error: self.error[lane],
            geometric_normal: self.geometric_normal.get(lane),
            normal: self.normal.get(lane),
            is_front: self.is_front[lane],
            material: self.material(scene, lane),
            material_index: self.material[lane],
            sphere: None,
        }
    }

    fn set(&mut self, lane: usize, point: &SurfacePoint<'_>) {
        self.position.set(lane, point.position);
        self.error[lane] = point.error;
        self.geometric_normal.set(lane, point.geometric_normal);
        self.normal.set(lane, point.normal);
        self.is_front[lane] = point.is_front;
        self.material[lane] = point.material_index;
    }
}

impl Scene {
    /// The points that the rays of a block hit.
    pub fn surfaces(&self, rays: &RayBlock, hits: &HitBlock) -> SurfaceBlock {
        let mut block = SurfaceBlock {
            position: Vec3Lanes::ZERO,
            error: [0.0; LANES],
            geometric_normal: Vec3Lanes::ZERO,
            normal: Vec3Lanes::ZERO,
            is_front: [false; LANES],
            material: [0; LANES],
            hit: 0,
        };
        // Triangles are gathered, first their indices and then their corners, so that memory is asked for
        // all that it takes a while to bring at once; what else there is follows one by one.
        let mut faces: [Option<(&TriangleMesh, [u32; 3])>; LANES] = [None; LANES];
        let mut corners = [Vec3Lanes::<LANES>::ZERO; 3];
        let (mut u, mut v) = ([0.0; LANES], [0.0; LANES]);
        let mut smooth = Vec3Lanes::<LANES>::ZERO;
        let (mut is_smooth, mut others, mut copies) = ([false; LANES], 0u16, 0u16);
        for lane in rays.lanes() {
            let Some(hit) = hits.get(lane) else { continue };
            block.hit |= 1 << lane;
            let geometry = &self.world.group(hit.copy).geometries[hit.geometry as usize];
            let Geometry::Mesh(mesh) = geometry else {
                others |= 1 << lane;
                continue;
            };
            block.material[lane] = self.look(hit).material;
            copies |= u16::from(hit.copy.is_some()) << lane;
            faces[lane] = Some((mesh, mesh.triangles[hit.primitive as usize]));
            (u[lane], v[lane]) = (hit.u, hit.v);
            if let Some(normal) = smooth_normal(mesh, hit) {
                smooth.set(lane, normal);
                is_smooth[lane] = true;
            }
        }

        for lane in lanes_of(block.hit & !others) {
            let Some((mesh, face)) = faces[lane] else { continue };
            for (corners, vertex) in corners.iter_mut().zip(face) {
                corners.set(lane, mesh.positions.get(vertex as usize));
            }
        }

        if others != block.hit {
            let SurfaceBlock { position, error, geometric_normal, .. } = &mut block;
            on_triangles(&corners, &u, &v, position, error, geometric_normal);
            block.normal = block.geometric_normal;
            if is_smooth.contains(&true) {
                for i in 0..LANES {
                    let normal = smooth.get(i).normalize_or_zero();
                    let flat = block.geometric_normal.get(i);
                    block.normal.set(i, if is_smooth[i] { normal } else { flat });
                }
            }
            for lane in lanes_of(copies) {
                if let Some(copy) = hits.get(lane).and_then(|hit| hit.copy) {
                    let placed = to_world(&block.local(lane), self.world.transform(copy));
                    block.position.set(lane, placed.position);
                    block.error[lane] = placed.error;
                    block.geometric_normal.set(lane, placed.geometric_normal);
                    block.normal.set(lane, placed.normal);
                }
            }
            let SurfaceBlock { geometric_normal, normal, is_front, .. } = &mut block;
            face(rays, geometric_normal, normal, is_front);
        }
        for lane in lanes_of(others) {
            if let Some(hit) = hits.get(lane) {
                block.set(lane, &self.surface(&rays.get(lane), hit));
            }
        }
        block
    }

    /// The rays that leave the points of `lanes` into `directions` (unit length), as far as `distances`;
    /// see [`Scene::spawn`].
    #[inline]
    pub fn spawn_block(
        &self,
        points: &SurfaceBlock,
        directions: &Vec3Lanes<LANES>,
        distances: &[f32; LANES],
        lanes: u16,
    ) -> RayBlock {
        let mut rays = RayBlock::empty();
        let epsilon = self.settings.epsilon;
        for i in 0..LANES {
            let (p, n) = (points.position.get(i), points.geometric_normal.get(i));
            let ray = spawn(epsilon, p, points.error[i], n, directions.get(i), distances[i]);
            [rays.org_x[i], rays.org_y[i], rays.org_z[i]] = ray.origin.to_array();
            [rays.dir_x[i], rays.dir_y[i], rays.dir_z[i]] = ray.direction.to_array();
            (rays.t_min[i], rays.t_max[i]) = (ray.t_min, ray.t_max);
        }
        rays.activate(lanes);
        rays
    }
}

/// Position, error and normal of points on triangles.
// Not inlined: the compiler sees best by itself that nothing here overlaps.
#[inline(never)]
fn on_triangles(
    corners: &[Vec3Lanes<LANES>; 3],
    u: &[f32; LANES],
    v: &[f32; LANES],
    position: &mut Vec3Lanes<LANES>,
    error: &mut [f32; LANES],
    normal: &mut Vec3Lanes<LANES>,
) {
    for i in 0..LANES {
        let corners = [corners[0].get(i), corners[1].get(i), corners[2].get(i)];
        let local = on_triangle(corners, u[i], v[i], None);
        position.set(i, local.position);
        error[i] = local.error;
        normal.set(i, local.geometric_normal);
    }
}

/// Turns the normals to the side that the rays come from.
#[inline(never)]
fn face(
    rays: &RayBlock,
    geometric_normal: &mut Vec3Lanes<LANES>,
    normal: &mut Vec3Lanes<LANES>,
    is_front: &mut [bool; LANES],
) {
    for i in 0..LANES {
        let direction = Vec3::new(rays.dir_x[i], rays.dir_y[i], rays.dir_z[i]);
        let facing = facing(geometric_normal.get(i), normal.get(i), direction);
        geometric_normal.set(i, facing.geometric_normal);
        normal.set(i, facing.normal);
        is_front[i] = facing.is_front;
    }
}

impl SurfaceBlock {
    #[inline(always)]
    fn local(&self, lane: usize) -> Local {
        Local {
            position: self.position.get(lane),
            error: self.error[lane],
            geometric_normal: self.geometric_normal.get(lane),
            normal: self.normal.get(lane),
        }
    }
}
