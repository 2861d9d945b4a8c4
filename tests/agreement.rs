//! All accelerators find the same hits on every mesh of the assets and on slivers, within the tolerance of
//! `alhazen bench` (docs/bench.md): against brute force in f64 on small meshes; on larger ones against the
//! kd-tree, which `tests/trees.rs` holds to brute force.
#![allow(missing_docs, clippy::print_stderr, reason = "a test program")]

use alhazen::accel::{Accel, AccelKind, BuildOptions, KdTree, LANES, Octree, RayBlock, RayQuery};
use alhazen::geometry::TriangleMesh;
use alhazen::io::read_mesh;
use alhazen::math::Ray;
use alhazen::measure::bench::{Agreement, agreement};
use alhazen::scene::{ObjectDesc, Scene, SceneDesc, ShapeDesc};
use glam::{DVec3, Vec3};

mod common;
use common::Random;

/// Rays against brute force times triangles, for a mesh.
const TESTS: usize = 400_000;

/// A mesh of more triangles is looked at in `make verify`.
const LARGE: usize = 200_000;

fn scene(mesh: TriangleMesh) -> Scene {
    let mut desc = SceneDesc { meshes: vec![mesh], ..SceneDesc::default() };
    desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), None));
    Scene::build_quietly(desc, AccelKind::Brute).expect("a sound scene")
}

/// How rays are aimed.
#[derive(Debug, Clone, Copy)]
enum Aim {
    /// At random points of the box, from around it and from within.
    Box,
    /// At points of triangles.
    Surface,
    /// At vertices and edges, where hits may be lost.
    Edges,
    /// Along an axis, through vertices.
    Axes,
}

/// Blocks of rays that run close together, as packets are traced.
fn blocks(random: &mut Random, scene: &Scene, aim: Aim, n: usize) -> Vec<RayBlock> {
    let b = scene.bounds;
    let radius = 0.5 * b.size().length();
    let alhazen::accel::Geometry::Mesh(mesh) = &scene.world().root.geometries[0] else {
        unreachable!("it is one mesh")
    };
    let in_box = |random: &mut Random| b.center() + 0.5 * b.size() * random.in_cube();
    let block = |random: &mut Random| {
        let origin = match random.below(4) {
            0 => in_box(random),
            _ => b.center() + random.direction() * radius * random.between(1.1, 4.0),
        };
        let [p, q, r] = mesh.corners(random.below(mesh.triangles.len())).map(|p| p.as_dvec3());
        let mut block = RayBlock::empty();
        let target = in_box(random);
        for lane in 0..LANES {
            let target = match aim {
                Aim::Box => target + random.in_cube() * 0.02 * radius,
                Aim::Surface => {
                    let (u, v) = (random.unit(), random.unit());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    p + (q - p) * u + (r - p) * v
                }
                Aim::Edges => [p, q, p.lerp(q, random.unit())][lane % 3],
                Aim::Axes => [p, q, r][lane % 3],
            };
            let axis = Vec3::AXES[lane % 3];
            let (origin, direction) = match aim {
                Aim::Axes => ((target - 3.0 * radius * axis.as_dvec3()).as_vec3(), axis),
                _ => (origin.as_vec3(), (target - origin).normalize_or(DVec3::X).as_vec3()),
            };
            block.set(lane, &Ray::new(origin, direction));
        }
        block
    };
    (0..n).map(|_| block(random)).collect()
}

/// What each accelerator gets wrong on a mesh, by aim.
fn compared(mesh: TriangleMesh, seed: u64, check: impl Fn(&str, Aim, Agreement)) {
    let scene = scene(mesh);
    let world = scene.world();
    let triangles = world.root.geometries.first().map_or(0, alhazen::accel::Geometry::len);
    if triangles == 0 {
        return;
    }
    let build = |kind: AccelKind| {
        let options = BuildOptions { kind, ..BuildOptions::default() };
        Accel::build(world, &options, &|_| true).unwrap()
    };
    let brute = build(AccelKind::Brute);
    let kdtree = KdTree::build(world, &|| true).unwrap();
    let octree = Octree::build(world, &|| true).unwrap();
    let accels: Vec<Accel> =
        AccelKind::ALL.iter().filter(|k| **k != AccelKind::Brute).map(|k| build(*k)).collect();
    let mut rows: Vec<(&str, &dyn RayQuery)> = vec![("octree", &octree), ("bsp", &kdtree)];
    rows.extend(accels.iter().zip(AccelKind::ALL).map(|(a, kind)| (kind.name(), a.query())));

    let mut random = Random(seed);
    for aim in [Aim::Box, Aim::Surface, Aim::Edges, Aim::Axes] {
        let n = if common::verify() { 4000 } else { 200 };
        let exactly = (TESTS / LANES / triangles).min(n);
        let some = blocks(&mut random, &scene, aim, n);
        for (name, row) in &rows {
            let mut sum = agreement(&scene, brute.query(), *row, &some[..exactly]);
            if *name != "bsp" {
                sum += agreement(&scene, &kdtree, *row, &some[exactly..]);
            }
            check(name, aim, sum);
        }
    }
}

/// Wrong hits that are allowed: none of rays aimed anywhere, and none of the trees in f64. Of rays aimed at
/// vertices and edges, and of those through vertices along an axis, which look at many faces exactly edge-on,
/// f32 takes some faces to be met, or not, that f64 does not, or does.
fn allowed(name: &str, aim: Aim, rays: u64) -> u64 {
    match (aim, name) {
        _ if is_f64(name) => 0,
        (Aim::Edges, "bvh") => rays / 1000,
        (Aim::Edges, _) => rays / 250,
        (Aim::Axes, "bvh") => rays / 100,
        (Aim::Axes, _) => rays / 20,
        _ => 0,
    }
}

fn is_f64(name: &str) -> bool {
    ["octree", "bsp"].contains(&name)
}

#[test]
fn all_accelerators_agree_on_the_assets() {
    let Some(assets) = common::assets() else { return };
    let (mut meshes, mut faults) = (0, std::cell::RefCell::new(String::new()));
    for path in common::files(&assets.join("mesh"), &["ply", "obj", "stl"]) {
        let Ok(file) = read_mesh(&path) else { continue };
        if file.mesh.triangles.len() > LARGE && !common::verify() {
            continue;
        }
        meshes += usize::from(!file.mesh.triangles.is_empty());
        compared(file.mesh, meshes as u64, |name, aim, found| {
            if found.wrong() > allowed(name, aim, found.rays) {
                let path = path.display();
                *faults.borrow_mut() += &format!("{path}: {name}, aimed at {aim:?}: {found:?}\n");
            }
        });
    }
    eprintln!("{meshes} meshes");
    assert!(faults.get_mut().is_empty(), "{}", faults.get_mut());
    assert!(meshes > 20, "too few meshes for a test: {meshes}");
}

/// Long thin triangles all over, 1 to 6 long and 0.004 wide. Where a block of rays looks at the edge of one, its
/// plane is known in f32 too coarsely to tell how far off it is: one ray in a hundred may be wrong.
#[test]
fn all_accelerators_agree_on_slivers() {
    for seed in 0..if common::verify() { 40 } else { 2 } {
        let mut random = Random(seed);
        let mut xyz = Vec::new();
        let n = 500;
        let width = 4e-3;
        for _ in 0..n {
            let p = random.in_cube() * 10.0;
            let along = random.direction() * random.between(1.0, 6.0);
            let aside = random.direction() * width;
            for corner in [p, p + along, p + along * random.unit() + aside] {
                xyz.extend(corner.as_vec3().to_array());
            }
        }
        let triangles = (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        compared(TriangleMesh::new(xyz, triangles), seed, |name, aim, found| {
            if found.wrong() > 0 {
                eprintln!("slivers {width}: {name} {aim:?}: {found:?}");
            }
            assert!(
                found.wrong() <= if is_f64(name) { 0 } else { found.rays / 100 },
                "slivers of width {width}, seed {seed}: {name}, aimed at {aim:?}: {found:?}"
            );
        });
    }
}
