use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::BvhAccel;
use super::node::Child;
#[cfg(target_arch = "x86_64")]
use super::simd::{Avx2, Avx512};
use super::simd::{Floats, Isa, Portable, Simd, Sixteen};
use crate::accel::{
    AccelError, BruteForce, BuildOptions, Geometry, Group, Hit, InstanceSet, LANES, Precision,
    RayBlock, RayQuery, World, rows_from_affine,
};
use crate::geometry::{Plane, Sphere, TriangleMesh};
use crate::math::Ray;

fn numbers(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// Every operation, compared with plain arithmetic; fused ones by bounds.
fn check<F: Floats<Array = [f32; N]>, const N: usize>(load: impl Fn(&[f32; N]) -> F) {
    let mut next = numbers(N as u32);
    for _ in 0..200 {
        let [a, b, c]: [[f32; N]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| next()));
        let same = |f: F, expected: &dyn Fn(usize) -> f32| {
            assert_eq!(f.to_array(), std::array::from_fn(expected));
        };
        let (x, y, z) = (load(&a), load(&b), load(&c));
        same(x.add(y), &|i| a[i] + b[i]);
        same(x.sub(y), &|i| a[i] - b[i]);
        same(x.mul(y), &|i| a[i] * b[i]);
        same(x.div(y), &|i| a[i] / b[i]);
        same(x.min(y), &|i| a[i].min(b[i]));
        same(x.max(y), &|i| a[i].max(b[i]));
        let near = |f: F, expected: &dyn Fn(usize) -> f32| {
            for (i, x) in f.to_array().into_iter().enumerate() {
                assert!((x - expected(i)).abs() <= 2.4e-7, "{x} and {}", expected(i));
            }
        };
        near(x.mul_add(y, z), &|i| a[i] * b[i] + c[i]);
        near(x.mul_sub(y, z), &|i| a[i] * b[i] - c[i]);
        near(x.neg_mul_add(y, z), &|i| c[i] - a[i] * b[i]);
        let le = (0..N).fold(0, |bits, i| bits | u32::from(a[i] <= b[i]) << i);
        assert_eq!(x.le(y), le);
        assert_eq!(x.le(x), (1 << N) - 1);
        assert_eq!(x.lt(y), (0..N).fold(0, |bits, i| bits | u32::from(a[i] < b[i]) << i));
        assert_eq!(x.lt(x), 0);
        let bits = le.rotate_left(3) & ((1 << N) - 1);
        same(x.choose(bits, y), &|i| if bits >> i & 1 == 1 { b[i] } else { a[i] });
        assert_eq!(x.least(), a.into_iter().fold(f32::INFINITY, f32::min));
        assert_eq!(x.greatest(), a.into_iter().fold(f32::NEG_INFINITY, f32::max));
        same(x.all(c[1]), &|_| c[1]);
        let eight = std::array::from_fn(|i| c[i]);
        same(x.eights(&eight), &|i| c[i % 8]);
    }
    let nan = load(&[f32::NAN; N]);
    assert_eq!((nan.le(nan), nan.lt(nan)), (0, 0));
}

fn check_isa(simd: impl Simd) {
    check(|x| simd.load8(x));
    check(|x| simd.load16(x));
    assert_eq!(simd.splat8(2.5).to_array(), [2.5; 8]);
    assert_eq!(simd.splat16(2.5).to_array(), [2.5; 16]);
    let numbers = std::array::from_fn(|i| i as f32);
    for (a, b) in (0..16).flat_map(|a| (0..16).map(move |b| (a, b))) {
        let expected = std::array::from_fn(|i| if i < 8 { a as f32 } else { b as f32 });
        assert_eq!(simd.load16(&numbers).halves(a, b).to_array(), expected);
    }
}

/// Each instruction set that the processor has.
#[test]
fn lanes_do_what_numbers_do() {
    check_isa(Portable);
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(avx2) = Avx2::detect() {
            check_isa(avx2);
        }
        if let Some(avx512) = Avx512::detect() {
            check_isa(avx512);
        }
    }
}

/// All instruction sets that there are here.
fn isas() -> Vec<Isa> {
    let mut all = vec![Isa::Portable(Portable)];
    #[cfg(target_arch = "x86_64")]
    {
        all.extend(Avx2::detect().map(Isa::Avx2));
        all.extend(Avx512::detect().map(Isa::Avx512));
    }
    all
}

fn world(mesh: TriangleMesh) -> World {
    let root = Group { geometries: vec![Geometry::Mesh(mesh)], ..Group::default() };
    World { root, ..World::default() }
}

/// A wavy field of 2 n² triangles over [−1, 1]², scaled and moved.
fn field(n: u32, scale: f32, offset: Vec3) -> TriangleMesh {
    let at = |i: u32| 2.0 * i as f32 / n as f32 - 1.0;
    let point = |i: u32, j: u32| {
        let (x, z) = (at(i), at(j));
        offset + scale * Vec3::new(x, 0.2 * (7.0 * x).sin() * (5.0 * z).cos(), z)
    };
    let xyz = (0..=n).flat_map(|j| (0..=n).flat_map(move |i| point(i, j).to_array())).collect();
    let quads = (0..n).flat_map(|j| (0..n).map(move |i| j * (n + 1) + i));
    TriangleMesh::new(
        xyz,
        quads.flat_map(|a| [[a, a + n + 1, a + n + 2], [a, a + n + 2, a + 1]]).collect(),
    )
}

fn built(world: &World, isa: Option<Isa>, threads: Option<usize>) -> BvhAccel {
    let options = BuildOptions { threads, ..BuildOptions::default() };
    let mut accel = BvhAccel::build(world, &options, &|_| true).unwrap();
    accel.isa = isa.unwrap_or(accel.isa);
    accel
}

/// 80,000 triangles: enough for boxes that several threads split.
#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let world = world(field(200, 1.0, Vec3::ZERO));
    let [one, four] = [1, 4].map(|n| built(&world, None, Some(n)).root.tree);
    assert_eq!(format!("{:?}", one.nodes), format!("{:?}", four.nodes));
    let ids = |tree: &super::node::Tree| tree.blocks.iter().flat_map(|b| b.ids).collect::<Vec<_>>();
    assert_eq!(ids(&one), ids(&four));
    let mut all = ids(&one);
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), 80_000, "every triangle is in a leaf");
}

/// Scales and offsets; the portable code as well as what is detected.
#[test]
fn hits_are_the_oracles_at_any_scale() {
    for (scale, offset) in
        [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e3), (10.0, 1e6), (1e-6, 1e-3)]
    {
        let offset = Vec3::splat(offset);
        let world = world(field(24, scale, offset));
        let oracle = BruteForce::new(&world);
        for isa in [Some(Isa::Portable(Portable)), None] {
            let accel = built(&world, isa, None);
            let mut next = numbers(3);
            for _ in 0..400 {
                let target = offset + scale * 0.9 * Vec3::new(next(), 0.0, next());
                let origin = target + scale * Vec3::new(next(), 1.0, next());
                let ray = Ray::new(origin, target - origin);
                let (expected, hit) = (oracle.intersect(&ray), accel.intersect(&ray));
                // An ulp of the offset may put the ray beside a slope's edge, not beside the field.
                let (Some(e), Some(h)) = (expected, hit) else {
                    panic!("{scale} {offset}: {ray:?}")
                };
                assert!((e.t - h.t).abs() < 2e-5, "{scale} {offset}: {e:?} {h:?}");
                assert!(accel.occluded(&ray));
            }
        }
    }
}

/// Of several rays at once each has the answer that it has alone, to the last bit: through a mesh by itself, two of
/// them, and spheres between; rays that run together and that spread, with several longest axes, at vertices and
/// along edges, with lanes left out and with ends.
#[test]
fn packets_are_as_their_rays() {
    let n = 40;
    let one = || Geometry::Mesh(field(n, 1.0, Vec3::ZERO));
    let balls: Vec<_> = (0..30)
        .map(|i| Sphere {
            center: DVec3::new(f64::from(i % 6) * 0.3 - 0.8, 0.3, f64::from(i / 6) * 0.4 - 0.8),
            radius: 0.1,
        })
        .collect();
    let other = field(9, 0.7, Vec3::new(0.1, -0.2, 0.05));
    let geometries = [
        vec![one()],
        vec![one(), Geometry::Mesh(other)],
        vec![one(), Geometry::Shapes(balls.into())],
    ];
    for geometries in geometries {
        let world = World { root: Group { geometries, ..Group::default() }, ..World::default() };
        for isa in isas() {
            let accel = built(&world, Some(isa), None);
            let mut next = numbers(5);
            let (mut hit, mut missed, mut packets) = (0, 0, 0);
            for round in 0..1500 {
                let spread = [0.02, 0.3, 1.0][round % 3];
                let mut any = |by: f32| Vec3::new(next(), next(), next()) * by;
                // Of all lengths along the axes, or much the same along two.
                let forward = [any(1.0), Vec3::new(0.7, -0.7, 0.1), Vec3::NEG_Y][round / 3 % 3];
                let eye = -2.0 * forward + any(0.3);
                let mut block = RayBlock::empty();
                for lane in (0..LANES).filter(|lane| round % 5 == 0 || (round * lane) % 4 != 1) {
                    let mut target = any(spread);
                    if round % 7 == 0 {
                        // At a vertex, or along an edge of the grid.
                        let cell = ((target + 1.0) * 0.5 * n as f32).round();
                        let at = 2.0 * cell / n as f32 - 1.0;
                        target =
                            Vec3::new(at.x, 0.2 * (7.0 * at.x).sin() * (5.0 * at.z).cos(), at.z);
                    }
                    let origin = if round % 2 == 0 { eye } else { eye + any(spread) };
                    let t_max = if lane % 6 == 5 { 1.0 } else { f32::INFINITY };
                    block.set(lane, &Ray { t_max, ..Ray::new(origin, target - origin) });
                }
                let (hits, occluded) =
                    (accel.intersect_block(&block), accel.occluded_block(&block));
                let by_opaque = accel.occluded_by_opaque_block(&block);
                packets += usize::from(hits.lanes() != 0);
                for lane in 0..LANES {
                    let (ray, is_active) = (block.get(lane), block.active() >> lane & 1 == 1);
                    let expected = accel.intersect(&ray).filter(|_| is_active);
                    assert_eq!(hits.get(lane), expected, "{isa:?}, {round}: {ray:?}");
                    for bits in [occluded, by_opaque] {
                        assert_eq!(bits >> lane & 1 == 1, expected.is_some(), "{isa:?}, {round}");
                    }
                    hit += usize::from(expected.is_some());
                    missed += usize::from(is_active && expected.is_none());
                }
            }
            assert!(hit > 5000 && missed > 2000 && packets > 800, "{hit} {missed} {packets}");
        }
    }
}

/// Straight down on vertices and along cell borders within a mesh (on its outermost border a ray that runs
/// along a box may still be lost): no box is lost to 0 · ∞.
#[test]
fn rays_along_the_axes_hit() {
    let n = 32;
    let flat = {
        let mut mesh = field(n, 1.0, Vec3::ZERO);
        mesh.positions.as_flat_mut().iter_mut().skip(1).step_by(3).for_each(|y| *y = 0.0);
        mesh
    };
    let world = world(flat);
    for precision in Precision::ALL {
        let options = BuildOptions { precision, ..BuildOptions::default() };
        let accel = BvhAccel::build(&world, &options, &|_| true).unwrap();
        for i in 0..=2 * n {
            for j in 0..=2 * n {
                let [x, z] = [i, j].map(|i| i as f32 / n as f32 - 1.0);
                for direction in [Vec3::NEG_Y, Vec3::new(-0.0, -1.0, -0.0)] {
                    let hit = accel.intersect(&Ray::new(Vec3::new(x, 2.0, z), direction));
                    assert_eq!(hit.map(|h| h.t), Some(2.0), "{precision:?}: {x} {z}");
                }
            }
        }
    }
}

#[test]
fn senseless_rays_and_triangles_miss() {
    let mut mesh = field(8, 1.0, Vec3::ZERO);
    mesh.positions.as_flat_mut()[3 * 40] = f32::NAN;
    mesh.positions.as_flat_mut()[3 * 41 + 1] = f32::INFINITY;
    let accel = built(&world(mesh), None, None);
    let down = Ray::new(Vec3::new(0.77, 2.0, 0.77), Vec3::NEG_Y);
    assert!(accel.intersect(&down).is_some());
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let origin = Ray { origin: Vec3::new(bad, 2.0, 0.0), ..down };
        let direction = Ray { direction: Vec3::new(0.0, bad, 0.0), ..down };
        for ray in [origin, direction] {
            assert!(accel.intersect(&ray).is_none() && !accel.occluded(&ray), "{ray:?}");
        }
    }
    let t_nan = Ray { t_max: f32::NAN, ..down };
    let zero = Ray { direction: Vec3::ZERO, ..down };
    let empty = Ray { t_min: 3.0, t_max: 1.0, ..down };
    for ray in [zero, empty, Ray { t_min: f32::NAN, ..down }] {
        assert!(accel.intersect(&ray).is_none() && !accel.occluded(&ray), "{ray:?}");
    }
    let _ = accel.intersect(&t_nan);
}

/// Triangles whose sizes grow geometrically, and many in one place, end neither stack nor build.
#[test]
fn trees_stay_shallow() {
    let mut xyz = Vec::new();
    for i in 0..1200 {
        let s = (if i < 240 { (i as f32 - 120.0) * 0.5 } else { 1.0 }).exp2();
        xyz.extend([0.0, 0.0, 0.0, s, 0.0, 0.0, 0.0, s, 0.0]);
    }
    let mesh = TriangleMesh::new(xyz, (0..1200).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    let accel = built(&world(mesh), None, None);
    fn depth(nodes: &[super::node::Node], child: Child) -> usize {
        let super::node::Content::Node(i) = child.content() else { return 0 };
        let node = &nodes[i];
        let below =
            (0..8).filter(|&lane| node.is_set(lane)).map(|lane| depth(nodes, node.children[lane]));
        1 + below.max().unwrap_or(0)
    }
    assert!(depth(&accel.root.tree.nodes, Child::node(0)) <= super::build::MAX_DEPTH);
    let hit = accel.intersect(&Ray::new(Vec3::new(0.1, 0.1, 1.0), Vec3::NEG_Z)).unwrap();
    assert!((hit.t - 1.0).abs() < 1e-6);
}

/// Spheres are the oracle's to the last bit, as it solves them by the same arithmetic: what finds them side by
/// side loses none. At any scale, seen from far away, from inside and from the surface, grazing half of the
/// time, whatever the length of the direction.
#[test]
fn spheres_are_the_oracles() {
    for (scale, offset) in
        [(1.0, 0.0), (1e-9, 0.0), (1e11, 0.0), (1.0, 1e3), (1e-3, 1e4), (1e-2, 1e6)]
    {
        let mut next = numbers(11);
        let mut random = || f64::from(next());
        let spheres: Vec<Sphere> = (0..300)
            .map(|i| {
                let center = DVec3::new(random(), random(), random()) * scale + offset;
                let radius = if i % 50 == 0 { 0.3 } else { 0.05 * random().abs().powi(3) + 1e-4 };
                Sphere { center, radius: radius * scale }
            })
            .collect();
        let [clear, opaque] =
            [0, 150].map(|i| Geometry::Shapes(spheres[i..i + 150].to_vec().into()));
        let root = Group { geometries: vec![clear, opaque], clear: vec![true, false] };
        let world = World { root, ..World::default() };
        let oracle = BruteForce::new(&world);
        let rays: Vec<Ray> = (0..4000)
            .map(|i| {
                let sphere = &spheres[i % spheres.len()];
                let n = DVec3::new(random(), random(), random()).normalize();
                let aside = n.any_orthonormal_vector();
                let distance = [0.0, 0.5, 1.0, 3.0, 1e2, 1e5][i % 6];
                let origin = sphere.center + n * (sphere.radius * distance);
                // Half of them past the rim, by a little more or less than f32 can tell.
                let rim = 1.0 + 1e-6 * random();
                let aim = if i % 2 == 0 { rim } else { random() };
                let target = sphere.center + aside * (sphere.radius * aim);
                let length = [1.0, 1e-9, 1e9][i % 3];
                let d = (target - origin).normalize_or(aside) * length;
                let reach = if i % 7 == 0 { scale / length } else { f64::INFINITY };
                Ray { t_max: reach as f32, ..Ray::new(origin.as_vec3(), d.as_vec3()) }
            })
            .collect();
        for isa in [Some(Isa::Portable(Portable)), None] {
            let accel = built(&world, isa, None);
            let mut hits = 0;
            for ray in &rays {
                let expected = oracle.intersect(ray);
                let hit = accel.intersect(ray);
                assert_eq!(hit, expected, "{scale} {offset}: {ray:?}");
                assert_eq!(accel.occluded(ray), expected.is_some(), "{scale} {offset}: {ray:?}");
                let opaque = (accel.occluded_by_opaque(ray), oracle.occluded_by_opaque(ray));
                assert_eq!(opaque.0, opaque.1, "{scale} {offset}: {ray:?}");
                hits += usize::from(hit.is_some());
            }
            assert!(hits > 300, "{scale} {offset}: {hits} of {}", rays.len());
        }
    }
}

/// Spheres among triangles get leaves of their own, and one that fits no box of f32 is met all the same.
#[test]
fn spheres_stand_beside_triangles() {
    let sphere = |radius: f64| Sphere { center: DVec3::new(0.0, 1.0, 0.0), radius };
    let spheres = Geometry::Shapes(vec![sphere(0.25), sphere(1e39)].into());
    let mesh = Geometry::Mesh(field(2, 1.0, Vec3::ZERO));
    let root = Group { geometries: vec![mesh, spheres], ..Group::default() };
    let accel = built(&World { root, ..World::default() }, None, None);
    let from = |y: f32, d: Vec3| accel.intersect(&Ray::new(Vec3::new(0.1, y, 0.1), d)).unwrap();
    let ids = |hit: Hit| (hit.geometry, hit.primitive);
    assert_eq!(ids(from(3.0, Vec3::NEG_Y)), (1, 0));
    assert_eq!(from(0.5, Vec3::NEG_Y).geometry, 0);
    // Beyond the largest f32, but not of f64.
    let out = accel.intersect(&Ray::new(Vec3::new(5.0, 1.0, 0.0), Vec3::X * 1e3)).unwrap();
    assert_eq!(ids(out), (1, 1));
}

/// Copies above a mesh, so many of both that several threads build the tree: none forgets that there are copies.
#[test]
fn copies_stand_beside_triangles_in_large_trees() {
    let n = 100;
    let places =
        (0..n * n).map(|i| DVec3::new(f64::from(i % n), 2.0, f64::from(i / n)) * 0.02 - 1.0);
    let rows = places.map(|at| {
        rows_from_affine(&DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.005),
            glam::DQuat::IDENTITY,
            at,
        ))
    });
    let transforms: Vec<_> = rows.collect();
    let mesh = |n, offset| Geometry::Mesh(field(n, 1.0, offset));
    let group = |geometry| Group { geometries: vec![geometry], ..Group::default() };
    let world = World {
        root: group(mesh(100, Vec3::NEG_Y * 3.0)),
        prototypes: vec![group(mesh(1, Vec3::ZERO))],
        sets: vec![InstanceSet { prototype: 0, transforms: Arc::new(transforms) }],
    };
    let accel = built(&world, None, Some(2));
    for i in (0..n * n).step_by(37) {
        // A little beside the middle, where two triangles meet.
        let at = Vec3::new((i % n) as f32, 0.0, (i / n) as f32) * 0.02 - Vec3::new(0.999, 0.0, 1.0);
        let down = Ray::new(at + Vec3::Y * 3.0, Vec3::NEG_Y);
        let copy = accel.intersect(&down).and_then(|hit| hit.copy);
        assert_eq!(copy.map(|copy| copy.index), Some(i as u32));
        let up = Ray::new(at - Vec3::Y * 5.0, Vec3::Y);
        assert!(accel.intersect(&up).is_some_and(|hit| hit.copy.is_none()));
    }
}

/// Planes without end, in the root and in a copy, in front of and behind a mesh.
#[test]
fn planes_without_end_are_hit() {
    let plane =
        |y: f64| Geometry::Shapes(vec![Plane { point: DVec3::Y * y, normal: DVec3::Y }].into());
    let mesh = Geometry::Mesh(field(8, 1.0, Vec3::ZERO));
    let row = rows_from_affine(&DAffine3::from_translation(DVec3::Y * -5.0));
    let world = World {
        root: Group { geometries: vec![mesh, plane(-3.0)], clear: vec![false, true] },
        prototypes: vec![Group { geometries: vec![plane(0.0)], ..Group::default() }],
        sets: vec![InstanceSet { prototype: 0, transforms: Arc::new(vec![row]) }],
    };
    let accel = built(&world, None, None);
    let down = |y: f32| Ray::new(Vec3::new(1e6, y, 0.3), Vec3::NEG_Y);
    let hit = accel.intersect(&down(1.0)).unwrap();
    assert_eq!((hit.t, hit.geometry, hit.copy), (4.0, 1, None));
    let below = accel.intersect(&down(-4.0)).unwrap();
    assert_eq!((below.t, below.copy.is_some()), (1.0, true));
    assert!(!accel.occluded_by_opaque(&Ray { t_max: 5.0, ..down(1.0) }));
    assert!(accel.occluded_by_opaque(&down(1.0)));
}

#[test]
fn a_build_is_interrupted_or_refused() {
    let world = world(field(100, 1.0, Vec3::ZERO));
    let build = |limit, go: &(dyn Fn(f64) -> bool + Sync)| {
        let options = BuildOptions { memory_limit: limit, ..BuildOptions::default() };
        BvhAccel::build(&world, &options, go).map(|_| ())
    };
    assert!(matches!(build(None, &|_| false), Err(AccelError::Interrupted)));
    assert!(matches!(build(None, &|x| x < 0.5), Err(AccelError::Interrupted)));
    assert!(matches!(
        build(Some(100_000), &|_| true),
        Err(AccelError::MemoryLimit { limit: 100_000 })
    ));
    assert!(build(Some(10_000_000), &|_| true).is_ok());
}
