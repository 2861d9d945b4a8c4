//! Lights that are geometry: the shadow rays of their samples must end before the light's own surface,
//! near and far, steep and grazing, with each accelerator.
#![allow(missing_docs, reason = "a test program")]
use alhazen::accel::{Accel, AccelKind, BuildOptions, Geometry, Group, RayQuery, World};
use alhazen::color::Rgb;
use alhazen::geometry::{Disk, Shapes, Sphere, TriangleMesh};
use alhazen::light::{DiskLight, Light, MeshLight, RectangleLight, ShapeLight, SphereLight};
use alhazen::math::Ray;
use glam::{DAffine3, DVec3, Vec3};

mod common;
use common::Random;

/// The geometry that a renderer makes of these triangles.
fn mesh(triangles: &[[DVec3; 3]]) -> Geometry {
    let xyz = triangles.iter().flatten().flat_map(|p| p.as_vec3().to_array()).collect();
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    Geometry::Mesh(TriangleMesh::new(xyz, indices.collect()))
}

/// A light of one of five kinds around `at`, and what is to be seen of it.
fn light(random: &mut Random, at: DVec3, size: f64) -> (Light, Geometry) {
    let radiance = Rgb::splat(1.0);
    let u = random.direction() * size * random.between(0.1, 1.0);
    let v = random.direction().cross(u).normalize() * size * random.between(0.1, 1.0);
    match random.below(5) {
        0 => {
            let triangles = [[at, at + u, at + u + v], [at, at + u + v, at + v]];
            let light = RectangleLight { corner: at, edge_u: u, edge_v: v, radiance };
            (Light::Rectangle(light), mesh(&triangles))
        }
        1 => {
            let normal = random.direction();
            let (x, y) = normal.any_orthonormal_pair();
            let rim = |i: u32| {
                let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 64.0).sin_cos();
                at + (x * cos + y * sin) * size
            };
            let fan: Vec<_> = (0..64).map(|i| [at, rim(i), rim(i + 1)]).collect();
            (Light::Disk(DiskLight { center: at, normal, radius: size, radiance }), mesh(&fan))
        }
        2 => {
            let sphere = Sphere { center: at, radius: size };
            let light = SphereLight { center: at, radius: size, radiance };
            (Light::Sphere(light), Geometry::Shapes(vec![sphere].into()))
        }
        3 => {
            let normal = random.direction();
            let ring = Disk { center: at, normal, radius: size, inner_radius: 0.4 * size };
            shape_light(vec![ring].into())
        }
        _ => {
            let triangles = [[at, at + u, at + v]];
            let light = MeshLight::new(triangles.as_slice().into(), radiance, true);
            (Light::Mesh(light), mesh(&triangles))
        }
    }
}

fn shape_light(shapes: Shapes) -> (Light, Geometry) {
    let light = ShapeLight::new(&shapes, 0, DAffine3::IDENTITY, Rgb::splat(1.0));
    (Light::Shape(light.expect("it can shine")), Geometry::Shapes(shapes))
}

#[test]
fn a_light_does_not_block_itself() {
    let rounds = if common::verify() { 40_000 } else { 4000 };
    let mut random = Random(11);
    let (mut rays, mut blocked) = (0u64, Vec::new());
    for round in 0..rounds {
        let size = 10f64.powf(random.between(-3.0, 3.0));
        let at = random.in_cube() * size * 10f64.powf(random.between(-1.0, 3.0));
        let (light, geometry) = light(&mut random, at, size);
        let world = World {
            root: Group { geometries: vec![geometry], ..Group::default() },
            ..World::default()
        };
        let kind = AccelKind::ALL[round % AccelKind::ALL.len()];
        let options = BuildOptions { kind, ..BuildOptions::default() };
        let accel = Accel::build(&world, &options, &|_| true).expect("a sound world");
        for _ in 0..64 {
            let u = [random.unit() as f32, random.unit() as f32];
            let away = random.direction() * size * 10f64.powf(random.between(-3.0, 4.0));
            let p: Vec3 = (at + away).as_vec3();
            let Some(s) = light.sample(p, u) else { continue };
            let ray = Ray { origin: p, direction: s.direction, t_min: 0.0, t_max: s.distance };
            let is_blocked = match &accel {
                #[cfg(feature = "embree")]
                Accel::Embree(accel) => accel.occluded(&ray),
                Accel::Bvh(accel) => accel.occluded(&ray),
                Accel::Brute(accel) => accel.occluded(&ray),
            };
            rays += 1;
            if is_blocked {
                blocked.push((light.clone(), p, u, s, kind));
            }
        }
    }
    assert!(rays > 64 * rounds as u64 / 4, "{rays} rays are too few to tell");
    assert!(blocked.is_empty(), "{} of {rays}, such as {:?}", blocked.len(), blocked[0]);
}
