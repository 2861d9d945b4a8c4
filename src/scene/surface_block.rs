//! The surface points of a block side by side: what [`Scene::surface`] finds for each lane, in loops over
//! lanes that the compiler turns into vector instructions.

#![expect(clippy::needless_range_loop, reason = "lanes of several arrays side by side")]

use glam::{DVec3, Vec3};

use super::build::Scene;
use super::draft::GeometryLooks;
use super::hollow::{FarSide, SphereId};
use super::media::Crossing;
use super::surface::{
    Local, SurfacePoint, as_far_as, facing, on_sphere, on_triangle, smooth_normal, spawn, to_world,
};
use crate::accel::{Geometry, Hit, HitBlock, LANES, RayBlock, lanes_of};
use crate::geometry::{Sphere, TriangleMesh};
use crate::material::Material;
use crate::math::{Vec3Lanes, lanes_where};
use crate::medium::Interior;

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
    /// None where no sphere is hit: most blocks need not carry that much.
    spheres: Option<Spheres>,
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

    /// The lanes whose material is that of `lane`, as bits; also some of those that hit nothing.
    #[inline]
    pub fn lanes_like(&self, lane: usize) -> u16 {
        lanes_where(&self.material.map(|material| material == self.material[lane]))
    }

    /// The passage of a ray of a lane that is inside of `interior` through its surface.
    #[inline]
    pub fn crossing(&self, scene: &Scene, interior: Interior, lane: usize) -> Crossing {
        scene.crossing(interior, self.material[lane], self.is_front[lane])
    }

    /// The point of the `hit` of a lane by itself.
    #[inline]
    pub fn point<'s>(&self, scene: &'s Scene, hit: &Hit, lane: usize) -> SurfacePoint<'s> {
        SurfacePoint {
            position: self.position.get(lane),
            error: self.error[lane],
            geometric_normal: self.geometric_normal.get(lane),
            normal: self.normal.get(lane),
            is_front: self.is_front[lane],
            material: self.material(scene, lane),
            material_index: self.material[lane],
            sphere: scene.sphere(hit),
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
            hit: hits.lanes(),
            spheres: None,
        };
        if let Some((mesh, looks)) = self.only_flat_mesh(hits) {
            for lane in lanes_of(block.hit) {
                block.material[lane] = looks.of(hits.primitives()[lane]).material;
            }
            let mut corners = [Vec3Lanes::ZERO; 3];
            corners_of(mesh, hits, &mut corners);
            let SurfaceBlock { position, error, geometric_normal, is_front, normal, .. } =
                &mut block;
            let [u, v] = hits.weights();
            on_triangles(&corners, u, v, position, error, geometric_normal);
            *normal = *geometric_normal;
            face(rays, geometric_normal, normal, is_front);
            return block;
        }
        // Triangles are gathered, first their indices and then their corners, so that memory is asked for
        // all that it takes a while to bring at once; what else there is follows one by one.
        let mut faces: [Option<(&TriangleMesh, [u32; 3])>; LANES] = [None; LANES];
        let mut corners = [Vec3Lanes::<LANES>::ZERO; 3];
        let mut smooth = Vec3Lanes::<LANES>::ZERO;
        let mut is_smooth = [false; LANES];
        let (mut triangles, mut others, mut copies) = (0u16, 0u16, 0u16);
        for lane in lanes_of(block.hit) {
            let Some(hit) = &hits.get(lane) else { continue };
            let geometry = &self.world.group(hit.copy).geometries[hit.geometry as usize];
            let Geometry::Mesh(mesh) = geometry else {
                match self.sphere(hit) {
                    Some((sphere, _)) => {
                        block.material[lane] = self.look(hit).material;
                        let spheres = block.spheres.get_or_insert(Spheres::NONE);
                        spheres.set(lane, sphere, hit.t);
                    }
                    None => others |= 1 << lane,
                }
                continue;
            };
            triangles |= 1 << lane;
            block.material[lane] = self.look(hit).material;
            copies |= u16::from(hit.copy.is_some()) << lane;
            faces[lane] = Some((mesh, mesh.triangles[hit.primitive as usize]));
            if let Some(normal) = smooth_normal(mesh, hit) {
                smooth.set(lane, normal);
                is_smooth[lane] = true;
            }
        }

        for lane in lanes_of(triangles) {
            let Some((mesh, face)) = faces[lane] else { continue };
            for (corners, vertex) in corners.iter_mut().zip(face) {
                corners.set(lane, mesh.positions.get(vertex as usize));
            }
        }

        if triangles != 0 {
            let SurfaceBlock { position, error, geometric_normal, .. } = &mut block;
            let [u, v] = hits.weights();
            on_triangles(&corners, u, v, position, error, geometric_normal);
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
        }
        others |= on_spheres(rays, &mut block);
        if triangles != 0 || block.spheres.is_some() {
            let SurfaceBlock { geometric_normal, normal, is_front, .. } = &mut block;
            face(rays, geometric_normal, normal, is_front);
        }
        for lane in lanes_of(others) {
            if let Some(hit) = hits.get(lane) {
                block.set(lane, &self.surface(&rays.get(lane), &hit));
            }
        }
        block
    }

    /// The one mesh of the root group that all of the hits are of, if it has no normals, and its looks: what most
    /// blocks of a scene of one mesh see, and nothing is left to be told apart.
    #[inline]
    fn only_flat_mesh(&self, hits: &HitBlock) -> Option<(&TriangleMesh, &GeometryLooks)> {
        let geometry = hits.only_geometry()? as usize;
        match &self.world.root.geometries[geometry] {
            Geometry::Mesh(mesh) if mesh.normals.is_none() => {
                Some((mesh, &self.root_looks[geometry]))
            }
            _ => None,
        }
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
        let epsilon = self.settings.epsilon;
        RayBlock::from_fn(lanes, |i| {
            let (p, n) = (points.position.get(i), points.geometric_normal.get(i));
            spawn(epsilon, p, points.error[i], n, directions.get(i), distances[i])
        })
    }

    /// The rays that leave the `hits` of `lanes` into `directions` (unit length) for whatever comes, and what they
    /// are known to come to; see [`Scene::spawn_on`].
    pub fn spawn_block_on(
        &self,
        points: &SurfaceBlock,
        hits: &HitBlock,
        directions: &Vec3Lanes<LANES>,
        lanes: u16,
    ) -> (RayBlock, [Option<FarSide>; LANES]) {
        let mut rays = self.spawn_block(points, directions, &[f32::INFINITY; LANES], lanes);
        let mut known = [None; LANES];
        let Some(spheres) = &points.spheres else { return (rays, known) };
        let within = spheres.lanes & lanes & inward(points, directions);
        if within == 0 {
            return (rays, known);
        }
        let (far, is_right) = far_sides(spheres, &rays);
        for lane in lanes_of(within) {
            let Some(hit) = &hits.get(lane) else { continue };
            if is_right[lane] {
                rays.t_max[lane] = as_far_as(far[lane]);
                let &Hit { geometry, primitive, .. } = hit;
                let id = SphereId { geometry, primitive };
                known[lane] = self.hollows.holds(id).then_some(FarSide(id));
            } else {
                let ray;
                (ray, known[lane]) =
                    self.spawn_on(&points.point(self, hit, lane), directions.get(lane));
                rays.set(lane, &ray);
            }
        }
        (rays, known)
    }
}

/// The lanes whose direction is into what they hit.
#[inline(never)]
fn inward(points: &SurfaceBlock, directions: &Vec3Lanes<LANES>) -> u16 {
    let mut is_inward = [false; LANES];
    for i in 0..LANES {
        let is_beyond = directions.get(i).dot(points.geometric_normal.get(i)) < 0.0;
        is_inward[i] = is_beyond == points.is_front[i];
    }
    lanes_where(&is_inward)
}

/// Where rays within spheres come out, and whether they are within.
#[inline(never)]
fn far_sides(spheres: &Spheres, rays: &RayBlock) -> ([f64; LANES], [bool; LANES]) {
    let (mut far, mut is_right) = ([0.0; LANES], [false; LANES]);
    for i in 0..LANES {
        let ray = rays.get(i);
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let (t, is_within) = spheres.get(i).far_side(o, d);
        far[i] = t;
        is_right[i] = is_within & (t > f64::from(ray.t_min));
    }
    (far, is_right)
}

/// Writes the corners of the triangles that were hit, all of one mesh: first all indices are read, then all
/// positions, so that memory is asked at once for all that it takes a while to bring.
#[inline(never)]
fn corners_of(mesh: &TriangleMesh, hits: &HitBlock, corners: &mut [Vec3Lanes<LANES>; 3]) {
    let mut faces = [[0; 3]; LANES];
    for lane in lanes_of(hits.lanes()) {
        faces[lane] = mesh.triangles[hits.primitives()[lane] as usize];
    }
    for lane in lanes_of(hits.lanes()) {
        for (corners, vertex) in corners.iter_mut().zip(faces[lane]) {
            corners.set(lane, mesh.positions.get(vertex as usize));
        }
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

/// The spheres that lanes hit, but for copies, and where along their rays.
#[derive(Debug, Clone)]
struct Spheres {
    center: [[f64; LANES]; 3],
    radius: [f64; LANES],
    t: [f32; LANES],
    is_sphere: [bool; LANES],
    lanes: u16,
}

impl Spheres {
    const NONE: Self = Self {
        center: [[0.0; LANES]; 3],
        radius: [1.0; LANES],
        t: [0.0; LANES],
        is_sphere: [false; LANES],
        lanes: 0,
    };

    #[inline(always)]
    const fn get(&self, lane: usize) -> Sphere {
        let [x, y, z] = &self.center;
        Sphere { center: DVec3::new(x[lane], y[lane], z[lane]), radius: self.radius[lane] }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, sphere: &Sphere, t: f32) {
        for (axis, c) in sphere.center.to_array().into_iter().enumerate() {
            self.center[axis][lane] = c;
        }
        (self.radius[lane], self.t[lane], self.is_sphere[lane]) = (sphere.radius, t, true);
        self.lanes |= 1 << lane;
    }
}

/// Position, error and normal of points on spheres; of the other lanes nothing is changed. Returns the lanes
/// that did not come close enough to theirs for it to be right.
#[inline(never)]
fn on_spheres(rays: &RayBlock, block: &mut SurfaceBlock) -> u16 {
    let SurfaceBlock { position, error, geometric_normal, normal, spheres, .. } = block;
    let Some(spheres) = spheres else { return 0 };
    let mut is_right = [false; LANES];
    for i in 0..LANES {
        let (local, is_close) = on_sphere(&spheres.get(i), &rays.get(i), spheres.t[i]);
        let is_sphere = spheres.is_sphere[i];
        let chosen = |new: Vec3, old: Vec3| if is_sphere { new } else { old };
        position.set(i, chosen(local.position, position.get(i)));
        error[i] = if is_sphere { local.error } else { error[i] };
        geometric_normal.set(i, chosen(local.geometric_normal, geometric_normal.get(i)));
        normal.set(i, chosen(local.normal, normal.get(i)));
        is_right[i] = is_close;
    }
    spheres.lanes & !lanes_where(&is_right)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::AccelKind;
    use crate::geometry::TriangleMesh;
    use crate::material::{Dielectric, FresnelModel, Ior};
    use crate::math::{Bounds, Ray};
    use crate::scene::{
        Epsilon, Location, MaterialDesc, ObjectDesc, PrototypeDesc, Reference, SceneDesc, ShapeDesc,
    };
    use glam::DAffine3;

    /// Numbers in [−1, 1).
    fn numbers(mut state: u32) -> impl FnMut() -> f64 {
        move || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            f64::from(state >> 8) / f64::from(1 << 23) - 1.0
        }
    }

    /// Glass balls, of which some overlap, flat and smooth triangles, boxes, and copies.
    fn scene(kind: AccelKind, epsilon: Epsilon) -> Scene {
        let mut next = numbers(11);
        let mut point = || DVec3::new(next(), next(), next());
        let glass = Dielectric {
            ior: Ior::Constant(1.5),
            absorption: crate::color::Rgb::BLACK,
            priority: 0,
            fresnel: FresnelModel::Exact,
        };
        let glass = MaterialDesc::new("glass".to_owned(), Material::Dielectric(glass));
        let mut desc = SceneDesc { materials: vec![glass], ..SceneDesc::default() };
        desc.settings.epsilon = epsilon;
        let object = |shape| ObjectDesc::new(shape, Some("glass"));
        for _ in 0..40 {
            desc.objects.push(object(ShapeDesc::Sphere { center: point(), radius: 0.15 }));
        }
        // The rest to one side, so that some of the balls are hollow.
        let mut point = || point() * 0.5 + DVec3::X * 0.6;
        for is_smooth in [false, true] {
            let corners: Vec<f32> = (0..40).flat_map(|_| point().as_vec3().to_array()).collect();
            let triangles = (0..38).map(|i| [i, i + 1, i + 2]).collect();
            let mut mesh = TriangleMesh::new(corners, triangles);
            mesh.normals = is_smooth.then(|| {
                let normals: Vec<_> = (0..40).map(|_| point().as_vec3().to_array()).collect();
                normals.into()
            });
            let index = desc.meshes.len();
            desc.meshes.push(mesh);
            desc.objects.push(object(ShapeDesc::Mesh(index)));
        }
        let corner = point();
        let bounds = Bounds { min: corner, max: corner + 0.3 };
        desc.objects.push(object(ShapeDesc::Box(bounds)));
        let ball = ShapeDesc::Sphere { center: DVec3::ZERO, radius: 0.2 };
        desc.prototypes.push(PrototypeDesc {
            at: Location::default(),
            name: "copy".to_owned(),
            objects: vec![object(ball), object(ShapeDesc::Mesh(0))],
        });
        let copy = |at: DVec3| {
            let squeeze = DAffine3::from_scale(DVec3::new(0.3, -0.4, 0.5));
            DAffine3::from_translation(at) * squeeze
        };
        let transforms = (0..10).map(|_| copy(point())).collect();
        let copies = ShapeDesc::Instances { prototype: Reference::new("copy"), transforms };
        desc.objects.push(ObjectDesc::new(copies, None));
        Scene::build_quietly(desc, kind).unwrap()
    }

    /// Side by side all is as it is one by one, to the last bit: points, and the rays that leave them.
    #[test]
    fn blocks_are_as_their_lanes() {
        // By itself, or by hand so short that rounding decides on which side rays start, or so long that they
        // start beyond the far side.
        let epsilons = [Epsilon::Auto, Epsilon::Fixed(1e-7), Epsilon::Fixed(0.1)];
        let scenes = epsilons.map(|epsilon| scene(AccelKind::default(), epsilon));
        let mut next = numbers(12);
        let mut unit = || DVec3::new(next(), next(), next()).normalize_or(DVec3::X).as_vec3();
        let (mut on_spheres, mut on_others, mut known, mut bounded) = (0, 0, 0, 0);
        for round in 0..4500 {
            let scene = &scenes[round / 1500];
            // From without, where all rays hit much the same, from within, and from afar.
            let eye = unit() * [1.5, 0.5, 1e5][round % 3];
            let mut rays = RayBlock::empty();
            for lane in (0..LANES).filter(|lane| (round >> 2) % 5 != lane % 5) {
                let aim = unit() * if round % 2 == 0 { 0.9 } else { 0.1 };
                let direction = (aim - eye).normalize();
                rays.set(lane, &Ray::new(eye, direction));
            }
            let query = scene.accel.query();
            let hits = HitBlock::from_fn(rays.active(), |lane| query.intersect(&rays.get(lane)));
            let block = scene.surfaces(&rays, &hits);
            // Some graze what they leave.
            let mut directions = Vec3Lanes::ZERO;
            for lane in 0..LANES {
                let (any, n) = (unit(), block.geometric_normal.get(lane));
                let along = n.cross(any).normalize_or(any) - n * (any.x * 1e-6);
                directions.set(lane, if lane % 3 == 0 { along.normalize() } else { any });
            }
            let (next, sides) = scene.spawn_block_on(&block, &hits, &directions, block.hit());
            for lane in rays.lanes() {
                let Some(hit) = &hits.get(lane) else {
                    assert_eq!(block.hit() >> lane & 1, 0);
                    continue;
                };
                let expected = scene.surface(&rays.get(lane), hit);
                let point = block.point(scene, hit, lane);
                assert_eq!(format!("{point:?}"), format!("{expected:?}"));
                let (ray, side) = scene.spawn_on(&expected, directions.get(lane));
                assert_eq!((next.get(lane), sides[lane]), (ray, side));
                on_spheres += usize::from(point.sphere.is_some());
                on_others += usize::from(point.sphere.is_none());
                known += usize::from(side.is_some());
                bounded += usize::from(ray.t_max < 1e3 && side.is_none());
            }
        }
        let counts = [on_spheres, on_others, known, bounded];
        assert!(counts.iter().all(|&n| n > 500), "{counts:?}");
    }

    /// So it is where all that is hit is one flat mesh, which is looked up once for all lanes.
    #[test]
    fn blocks_of_one_mesh_are_as_their_lanes() {
        let mut next = numbers(13);
        let mut point = || DVec3::new(next(), next(), next());
        let corners = (0..60).flat_map(|_| point().as_vec3().to_array()).collect();
        let triangles = (0..58).map(|i| [i, i + 1, i + 2]).collect();
        let mut desc = SceneDesc::default();
        desc.meshes.push(TriangleMesh::new(corners, triangles));
        desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), None));
        let scene = Scene::build_quietly(desc, AccelKind::default()).unwrap();
        let (mut found, mut missed) = (0, 0);
        for round in 0..500 {
            let eye = point() * 4.0;
            let mut rays = RayBlock::empty();
            for lane in (0..LANES).filter(|lane| round % 4 == 0 || (round + lane) % 3 != 0) {
                let direction = (point() - eye).normalize().as_vec3();
                rays.set(lane, &Ray::new(eye.as_vec3(), direction));
            }
            let hits = scene.accel.query().intersect_block(&rays);
            assert_eq!(hits.only_geometry().is_some(), hits.lanes() != 0);
            let block = scene.surfaces(&rays, &hits);
            assert_eq!(block.hit(), hits.lanes());
            missed += (rays.active() & !hits.lanes()).count_ones();
            for lane in lanes_of(hits.lanes()) {
                let hit = hits.get(lane).unwrap();
                let expected = scene.surface(&rays.get(lane), &hit);
                let point = block.point(&scene, &hit, lane);
                assert_eq!(format!("{point:?}"), format!("{expected:?}"));
                found += 1;
            }
        }
        assert!(found > 500 && missed > 500, "{found} {missed}");
    }
}
