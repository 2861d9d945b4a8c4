//! The plain trees of `alhazen bench` against brute force. Both solve the same equations in f64, so they must
//! give the same distances, to the last bit.
#![allow(missing_docs, reason = "a test program")]

use std::sync::Arc;

use alhazen::accel::{
    BruteForce, Geometry, Group, InstanceSet, KdTree, Octree, RayQuery, World, rows_from_affine,
};
use alhazen::geometry::{Cone, Cuboid, Framed, Plane, Sphere, Torus, TriangleMesh};
use alhazen::math::{Bounds, Ray};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use proptest::prelude::*;

mod common;
use common::Random;

/// Triangles of all sizes, some of them slivers, some in planes along the axes, some without an area.
fn soup(random: &mut Random, n: usize, scale: f64) -> TriangleMesh {
    let mut xyz = Vec::new();
    for i in 0..n {
        let center = random.in_cube() * 3.0;
        let size = 10f64.powf(random.between(-2.0, 0.5));
        let mut corners = [0; 3].map(|_| center + random.in_cube() * size);
        match i % 4 {
            0 => corners[2] = corners[0].lerp(corners[1], 0.4) + random.in_cube() * 1e-5,
            1 => corners.iter_mut().for_each(|p| p[i / 4 % 3] = (center[i / 4 % 3] * 2.0).round()),
            2 if i % 16 == 2 => corners[2] = corners[1],
            _ => {}
        }
        xyz.extend(corners.into_iter().flat_map(|p| (p * scale).as_vec3().to_array()));
    }
    TriangleMesh::new(xyz, (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

fn affine(random: &mut Random) -> DAffine3 {
    let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
    let scale = DVec3::new(random.between(0.2, 2.0), -1.0, random.between(0.2, 2.0));
    DAffine3::from_scale_rotation_translation(scale, turn, random.in_cube() * 5.0)
}

fn group(random: &mut Random, n: usize, scale: f64) -> Group {
    let place = |random: &mut Random| DAffine3::from_scale(DVec3::splat(scale)) * affine(random);
    let cuboid = Cuboid { bounds: Bounds { min: DVec3::splat(-0.5), max: DVec3::splat(0.4) } };
    let cone = Cone { height: 1.0, radii: [0.5, 0.2], has_caps: true };
    let torus = Torus { major_radius: 0.6, minor_radius: 0.2 };
    let spheres: Vec<Sphere> = (0..n / 3)
        .map(|_| Sphere {
            center: random.in_cube() * 3.0 * scale,
            radius: scale * 10f64.powf(random.between(-3.0, 0.5)),
        })
        .collect();
    let geometries = vec![
        Geometry::Mesh(soup(random, n, scale)),
        Geometry::Shapes(spheres.into()),
        Geometry::Mesh(TriangleMesh::new(Vec::new(), Vec::new())),
        Geometry::Shapes(vec![Framed::new(cuboid, place(random))].into()),
        Geometry::Shapes(vec![Framed::new(cone, place(random))].into()),
        Geometry::Shapes(vec![Framed::new(torus, place(random))].into()),
        Geometry::Mesh(soup(random, n / 4, scale)),
    ];
    let clear = (0..geometries.len()).map(|i| i % 3 == 1).collect();
    Group { geometries, clear }
}

/// A world with copies and, now and then, a plane without end.
fn world(random: &mut Random, scale: f64) -> World {
    let n = 10 + random.below(300);
    let mut root = group(random, n, scale);
    if random.unit() < 0.3 {
        let plane = Plane { point: DVec3::NEG_Y * scale, normal: DVec3::Y };
        root.geometries.insert(1, Geometry::Shapes(vec![plane].into()));
        root.clear.insert(1, true);
    }
    let prototypes = vec![group(random, 12, scale), group(random, 40, scale)];
    let sets = (0..2).map(|prototype| {
        let mut place = || {
            let mut m = affine(random);
            m.translation *= scale;
            rows_from_affine(&m)
        };
        InstanceSet { prototype, transforms: Arc::new((0..5).map(|_| place()).collect()) }
    });
    World { root, prototypes, sets: sets.collect() }
}

/// Any ray, one along an axis, one through a vertex, one within a plane of triangles.
fn ray(random: &mut Random, world: &World, scale: f64) -> Ray {
    let Geometry::Mesh(mesh) = &world.root.geometries[0] else { unreachable!("see group") };
    let vertex = mesh.positions.get(random.below(mesh.positions.len()));
    let origin = (random.in_cube() * 8.0 * scale).as_vec3();
    let axis = Vec3::AXES[random.below(3)] * if random.unit() < 0.5 { 1.0 } else { -1.0 };
    let mut ray = match random.below(5) {
        0 => Ray::new(vertex - axis * 5.0 * scale as f32, axis),
        1 => Ray::new(origin, (vertex - origin).normalize()),
        // In a plane of triangles, perhaps along one of their edges.
        2 => {
            let d = random.in_cube().as_vec3() * (Vec3::ONE - axis.abs());
            Ray::new(vertex - d.normalize_or(Vec3::X) * scale as f32, d.normalize_or(Vec3::X))
        }
        3 => Ray::new(vertex, random.direction().as_vec3()),
        _ => Ray::new(origin, random.direction().as_vec3() * random.between(0.1, 9.0) as f32),
    };
    if random.unit() < 0.2 {
        ray.t_max = (scale * random.between(0.1, 9.0)) as f32;
    }
    if random.unit() < 0.2 {
        ray.t_min = (scale * random.between(0.0, 3.0)) as f32;
    }
    ray
}

fn check(tree: &dyn RayQuery, brute: &BruteForce, ray: &Ray) -> Result<(), TestCaseError> {
    let (expected, got) = (brute.intersect(ray), tree.intersect(ray));
    prop_assert_eq!(expected.map(|h| h.t), got.map(|h| h.t), "{:?}: {:?} {:?}", ray, expected, got);
    prop_assert_eq!(brute.occluded(ray), tree.occluded(ray), "{:?}", ray);
    prop_assert_eq!(brute.occluded_by_opaque(ray), tree.occluded_by_opaque(ray), "{:?}", ray);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if common::verify() { 2000 } else { 60 }))]

    #[test]
    fn trees_hit_what_brute_force_hits(seed in any::<u64>(), log_scale in -6f64..6.0) {
        let scale = 10f64.powf(log_scale);
        let mut random = Random(seed);
        let world = world(&mut random, scale);
        let brute = BruteForce::new(&world);
        let octree = Octree::build(&world, &|| true).unwrap();
        let kdtree = KdTree::build(&world, &|| true).unwrap();
        for _ in 0..60 {
            let ray = ray(&mut random, &world, scale);
            check(&octree, &brute, &ray)?;
            check(&kdtree, &brute, &ray)?;
        }
    }
}

#[test]
fn an_empty_world_is_missed() {
    let world = World::default();
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    let trees: [&dyn RayQuery; 2] =
        [&Octree::build(&world, &|| true).unwrap(), &KdTree::build(&world, &|| true).unwrap()];
    for tree in trees {
        assert!(tree.intersect(&ray).is_none() && !tree.occluded(&ray));
    }
}

/// Coincident triangles cannot be parted; the build ends all the same, and soon.
#[test]
fn what_cannot_be_parted_ends_up_in_one_leaf() {
    let xyz = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mesh = TriangleMesh::new(xyz, vec![[0, 1, 2]; 5000]);
    let root = Group { geometries: vec![Geometry::Mesh(mesh)], ..Group::default() };
    let world = World { root, ..World::default() };
    let octree = Octree::build(&world, &|| true).unwrap();
    let kdtree = KdTree::build(&world, &|| true).unwrap();
    let ray = Ray::new(Vec3::new(0.2, 0.2, 3.0), Vec3::NEG_Z);
    assert_eq!(octree.intersect(&ray).unwrap().t, 3.0);
    assert_eq!(kdtree.intersect(&ray).unwrap().t, 3.0);
    assert!(octree.info().bytes < 10_000_000 && kdtree.info().bytes < 10_000_000);
}

#[test]
fn a_build_can_be_interrupted() {
    let mut random = Random(1);
    let world = world(&mut random, 1.0);
    assert!(Octree::build(&world, &|| false).is_err());
    assert!(KdTree::build(&world, &|| false).is_err());
}
