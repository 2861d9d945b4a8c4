//! Triangles by themselves: meshes that must be closed, surfaces on each other, slivers.

use alhazen::accel::{AccelKind, BruteForce, Geometry, Group, RayBlock, World};
use alhazen::geometry::TriangleMesh;
use alhazen::math::Ray;
use alhazen::measure::bench::agreement;
use alhazen::scene::Scene;
use glam::{DAffine3, DVec3, Vec3};

use super::{Cell, Rung, Table, add_mesh, ball, empty, per_million, power, row, sphere};
use crate::common::Random;

fn world_of(mesh: TriangleMesh) -> World {
    let root = Group { geometries: vec![Geometry::Mesh(mesh)], ..Group::default() };
    World { root, ..World::default() }
}

/// The same mesh with every vertex as often as triangles have it, as a file that does not share them.
fn with_own_corners(mesh: &TriangleMesh) -> TriangleMesh {
    let corners = (0..mesh.triangles.len()).flat_map(|i| mesh.corners(i));
    let xyz = corners.flat_map(|p| p.to_array()).collect();
    let n = mesh.triangles.len() as u32;
    TriangleMesh::new(xyz, (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// From inside a closed mesh every ray must hit.
pub(super) fn leaks(n: usize) -> Table {
    let places = [
        (0.0, 1.0, true),
        (0.0, 1.0, false),
        (1e3, 1.0, true),
        (1e5, 1.0, true),
        (1e6, 1.0, true),
        (0.0, 1e-6, true),
        (0.0, 1e6, true),
        (1e6, 1e3, true),
    ];
    let rows = places.map(|(offset, scale, is_welded)| {
        let center = DVec3::new(offset, -0.7 * offset, 0.4 * offset);
        let ball = ball(160, center, scale);
        let mesh = if is_welded { ball } else { with_own_corners(&ball) };
        let world = world_of(mesh.clone());
        let apart = if is_welded { "" } else { ", each triangle with vertices of its own" };
        row(format!("offset {}, scale {}{apart}", power(offset), power(scale)), |rung| {
            let accel = rung.accel(&world);
            let query = accel.query();
            let mut random = Random(5);
            let lost = [1, 2, 3].map(|corners| {
                let escapes = (0..n / 4).filter(|_| {
                    let c = mesh.corners(random.below(mesh.triangles.len()));
                    let weights = [1.0, random.unit(), random.unit()].map(|w| w as f32);
                    let sum: f32 = weights[..corners].iter().sum();
                    let target =
                        (0..corners).fold(Vec3::ZERO, |p, i| p + c[i] * (weights[i] / sum));
                    let origin = (center + random.in_cube() * 0.1 * scale).as_vec3();
                    query.intersect(&Ray::new(origin, (target - origin).normalize())).is_none()
                });
                escapes.count()
            });
            let [vertex, edge, face] = lost;
            let is_red = (rung.is_robust() && edge + face > 0) || (rung.is_exact() && vertex > 0);
            Cell::new(lost.map(|x| per_million(x, n / 4)).join(" / "), is_red)
        })
    });
    Table {
        title: "Rays that leak",
        what: "A closed ball of 102,000 triangles in f32 coordinates, rays from within aimed at vertices / edges / \
               faces: how many of a million escape. Red: any at edges or faces from `robust` on, any at vertices at \
               `exact`.",
        columns: Rung::columns(),
        rows: rows.into(),
    }
}

/// What leaves a closed, convex mesh through an edge or a vertex meets none of its triangles again.
pub(super) fn double_hits(n: usize) -> Table {
    let rows = [(0.0, 1.0), (0.0, 1e-6), (0.0, 1e6), (1e3, 1.0), (2e4, 10.0)].map(
        |(offset, scale): (f64, f64)| {
            let center = DVec3::new(offset, -offset, 0.5 * offset);
            let mesh = ball(60, DVec3::ZERO, scale);
            row(format!("offset {}, scale {}", power(offset), power(scale)), |rung| {
                let mut desc = empty();
                add_mesh(&mut desc, mesh.clone());
                desc.objects[0].transform = DAffine3::from_translation(center);
                if offset != 0.0 {
                    // Keeps the world from being recentred on the ball.
                    desc.objects.push(sphere(DVec3::ZERO, 1e-3 * scale));
                }
                let scene = rung.scene(desc);
                let query = scene.accel.query();
                let center = center - scene.center;
                let mut random = Random(7);
                let twice = [1, 2].map(|corners| {
                    let again = (0..n / 4).filter(|_| {
                        let c = mesh.corners(random.below(mesh.triangles.len()));
                        let u = random.unit() as f32;
                        let target = if corners == 1 { c[0] } else { c[0].lerp(c[1], u) };
                        let target = target.as_dvec3() + center;
                        let origin = center + random.in_cube() * 0.3 * scale;
                        let direction = (target - origin).normalize().as_vec3();
                        let ray = Ray::new(origin.as_vec3(), direction);
                        let Some(hit) = query.intersect(&ray) else { return false };
                        let point = scene.surface(&ray, &hit);
                        query.intersect(&scene.spawn(&point, direction, f32::INFINITY)).is_some()
                    });
                    again.count()
                });
                let is_red = rung.is_robust() && twice != [0, 0];
                Cell::new(twice.map(|x| per_million(x, n / 4)).join(" / "), is_red)
            })
        },
    );
    Table {
        title: "Rays that hit twice",
        what: "A ball of 14,000 triangles, rays from within aimed at vertices / edges, that go straight on from where they hit: \
               how many of a million hit another triangle, or the same once more. Red: any from `robust` on.",
        columns: Rung::columns(),
        rows: rows.into(),
    }
}

/// Two squares on or nearly on each other: the nearer one is hit, and always the same of two that coincide.
pub(super) fn stacked(n: usize) -> Table {
    let rows = [0.0, 1e-7, 1e-6, 1e-5, 1e-3].map(|gap: f64| {
        row(format!("two squares, {} apart", power(gap)), |rung| {
            let square = |y: f64| {
                let xyz = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0f32]];
                let xyz = xyz.iter().flat_map(|[x, z]| [*x, y as f32, *z]).collect();
                Geometry::Mesh(TriangleMesh::new(xyz, vec![[0, 2, 1], [0, 3, 2]]))
            };
            let root = Group { geometries: vec![square(0.0), square(gap)], ..Group::default() };
            let world = World { root, ..World::default() };
            let accel = rung.accel(&world);
            let query = accel.query();
            let mut random = Random(2);
            let (mut lost, mut wrong) = (0, 0);
            let mut first = None;
            let n = n / 4;
            for _ in 0..n {
                let target = Vec3::new(
                    random.between(-0.8, 0.8) as f32,
                    gap as f32,
                    random.between(-0.8, 0.8) as f32,
                );
                let origin = Vec3::new(random.unit() as f32, 1.0, random.unit() as f32);
                match query.intersect(&Ray::new(origin, (target - origin).normalize())) {
                    None => lost += 1,
                    Some(hit) if gap > 0.0 => wrong += usize::from(hit.geometry != 1),
                    Some(hit) => {
                        wrong += usize::from(*first.get_or_insert(hit.geometry) != hit.geometry)
                    }
                }
            }
            // Distances of about 1 are told apart from some 1e-7 on.
            let is_red = lost > 0 || (gap >= 1e-5 && wrong > 0);
            Cell::new(
                format!("{} lost, {} other", per_million(lost, n), per_million(wrong, n)),
                is_red,
            )
        })
    });
    Table {
        title: "Surfaces on each other",
        what: "Of each million rays from a distance of about 1: those that miss both squares, and those that hit the farther \
               one, or, of two that coincide, another than the first ray did. Red: any lost, any wrong from 10⁻⁵ on.",
        columns: Rung::columns(),
        rows: rows.into(),
    }
}

/// Triangles up to a million times as long as wide.
pub(super) fn slivers(n: usize) -> Table {
    const TRIANGLES: u32 = 300;
    let rows = [1e-3, 1e-4, 1e-5, 2e-6].map(|width: f64| {
        let mut random = Random(6);
        let mut xyz = Vec::new();
        for _ in 0..TRIANGLES {
            let (a, d) = (random.in_cube(), random.direction());
            let across = d.cross(random.direction()).normalize() * width;
            for p in [a - d, a + d, a + d + across] {
                xyz.extend(p.as_vec3().to_array());
            }
        }
        let corners = (0..TRIANGLES).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(xyz, corners);
        let mut desc = empty();
        add_mesh(&mut desc, mesh.clone());
        let scene = Scene::build_quietly(desc, AccelKind::default()).unwrap();
        let brute = BruteForce::new(scene.world());
        // Aimed within their width, so that some hit.
        let mut block = || {
            let mut block = RayBlock::empty();
            let i = random.below(TRIANGLES as usize);
            for lane in 0..16 {
                let [a, b, c] = mesh.corners(i).map(|p| p.as_dvec3() - scene.center);
                let (u, v) = (random.unit(), random.unit());
                let target = a + (b - a) * u + (c - b) * (u * v);
                let origin = random.direction() * 3.0;
                let ray = Ray::new(origin.as_vec3(), (target - origin).normalize().as_vec3());
                block.set(lane, &ray);
            }
            block
        };
        let blocks: Vec<RayBlock> = (0..n / 320).map(|_| block()).collect();
        row(format!("2 long, {} wide", power(width)), |rung| {
            let accel = rung.accel(scene.world());
            let a = agreement(&scene, &brute, accel.query(), &blocks);
            let [wrong, edges] = [a.missing + a.extra + a.differing, a.edges];
            let [wrong, edges] = [wrong, edges].map(|x| 100.0 * x as f64 / a.rays as f64);
            let text = format!("{} lost, {wrong:.2} % wrong, {edges:.1} % at edges", a.missing);
            Cell::new(text, (rung.is_robust() && a.missing > 0) || (rung.is_exact() && wrong > 0.1))
        })
    });
    Table {
        title: "Slivers",
        what: "300 triangles, rays aimed within their width from a distance of 3, against brute force in f64: rays that \
               meet none though they should, answers that are wrong, and those that brute force gives too when the ray is moved aside by a few roundings. In f32 a position \
               is rounded to some 10⁻⁷ here, so that ever more rays meet an edge, and slivers that cross are told apart no \
               better. Red: any lost from `robust` on, more than 0.1 % wrong at `exact`.",
        columns: Rung::columns(),
        rows: rows.into(),
    }
}
