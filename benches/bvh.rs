//! Our own hierarchy against Embree: ratios within one run, with the targets beside them.
//!
//! `cargo bench --bench bvh` prints, for a terrain of a million triangles and for a closed shell with blobs
//! seen from within, at each rung of precision that both have, the median over interleaved rounds of
//! Embree's time by ours, for camera, shadow and diffuse rays. With `--features crates` it also prints what
//! the crates `obvhs` and `bvh` reach, with the hits that they get wrong.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

mod common;

use std::hint::black_box;
use std::time::Instant;

use alhazen::accel::{
    AccelKind, BuildOptions, BvhAccel, EmbreeAccel, Precision, RayBlock, RayQuery, World,
};
use alhazen::camera::Projection;
use alhazen::film::Filter;
use alhazen::geometry::TriangleMesh;
use alhazen::geometry::generate::{GeneratedKind, GeneratedMesh};
use alhazen::math::Ray;
use alhazen::scene::{CameraDesc, Location, ObjectDesc, PlaceDesc, Scene, SceneDesc, ShapeDesc};
use common::{ROUNDS, SIZE, camera_blocks, interleaved, median, ratio, terrain};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

fn main() {
    for (name, scene) in [("terrain", terrain(708)), ("blobs, from within", blobs())] {
        println!("\n{name}, {} triangles", scene.requirements.triangles);
        ours(&scene);
        #[cfg(feature = "crates")]
        crates(&scene);
    }
}

/// A displaced closed shell with displaced closed blobs in it, seen from within.
fn blobs() -> Scene {
    let mesh = GeneratedMesh::new(GeneratedKind::Blobs, 1_000_000, 0).expect("a sound number");
    let positions = (0..mesh.vertex_count()).flat_map(|i| mesh.vertex(i)).collect();
    let triangles = (0..mesh.triangle_count()).map(|i| mesh.triangle(i)).collect();
    let mesh = TriangleMesh::new(positions, triangles);
    let mut desc = SceneDesc { meshes: vec![mesh], ..SceneDesc::default() };
    desc.image.size = SIZE;
    desc.settings.filter = Filter::Box;
    desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), None));
    desc.camera = Some(CameraDesc {
        at: Location::default(),
        projection: Projection::Perspective { fov: 70f64.to_radians() },
        place: Some(PlaceDesc::LookAt {
            eye: DVec3::new(0.3, 0.2, 8.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
        }),
        lens: None,
    });
    Scene::build_quietly(desc, AccelKind::default()).expect("a sound scene")
}

/// Rows of other crates beside ours, as `alhazen bench` measures them, with one thread.
#[cfg(feature = "crates")]
fn crates(scene: &Scene) {
    use alhazen::measure::bench::{BenchOptions, RayKind, Row, StructureKind, bench, total};

    let structures = StructureKind::all();
    let is_wanted = |kind: &StructureKind| !["bsp", "octree", "brute"].contains(&kind.name());
    let options = BenchOptions {
        structures: structures.into_iter().filter(is_wanted).collect(),
        threads: 1,
        seconds: 2.0,
        rounds: 7,
        rays: 1 << 18,
    };
    let report = bench(scene, &options, &()).expect("a sound scene");
    println!(
        "accelerators and crates, robust where they know it, of Embree's single rays, and ours by a crate's with its \
         target; wrong hits:"
    );
    let ratio_of = |row: &Row, kind| row.speeds.iter().find(|s| s.kind == kind).map(|s| s.ratio);
    let ours = report.rows.iter().find(|row| row.name == "bvh").expect("it is always measured");
    for row in report.rows.iter().filter(|row| row.not_measured.is_none()) {
        let is_crate = row.name.starts_with("obvhs") || row.name.starts_with("crate");
        let ratio = |kind: RayKind| {
            let Some(ratio) = ratio_of(row, kind) else { return String::new() };
            let by_it = ratio_of(ours, kind).filter(|_| is_crate);
            let by_it = by_it.map_or_else(String::new, |ours| {
                format!(" (ours {:.1} of it; target 1)", ours / ratio)
            });
            format!("{} {ratio:.2}{by_it}  ", kind.name())
        };
        let wrong = total(&row.against_f64);
        println!(
            "{:>16}  {}{} of {} wrong",
            row.name,
            RayKind::ALL.map(ratio).concat(),
            wrong.wrong(),
            wrong.rays
        );
    }
}

fn ours(scene: &Scene) {
    let camera: Vec<RayBlock> = camera_blocks(scene, 0).into_iter().map(|(b, _)| b).collect();
    let world = scene.world();
    for precision in [Precision::Fast, Precision::Robust] {
        let options = |kind| BuildOptions { kind, precision, ..BuildOptions::default() };
        let embree = EmbreeAccel::build(world, &options(AccelKind::default()), &|_| true);
        let embree = embree.expect("a sound world");
        let bvh = BvhAccel::build(world, &options(AccelKind::Bvh), &|_| true);
        let bvh = bvh.expect("a sound world");
        println!("{}: {} against {}", precision.name(), bvh.info(), embree.info());
        let bytes = bvh.info().bytes as f64 / embree.info().bytes as f64;
        println!("{:>16}  {bytes:.2} of the bytes", "memory");
        builds(world, precision);
        let [shadow, diffuse] = secondary(&embree, &camera);
        for threads in [1, rayon::current_num_threads()] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.expect("threads");
            println!("on {threads} threads:");
            let print = |name: &str, target: &str, a: &(dyn Fn() + Sync), b: &(dyn Fn() + Sync)| {
                let rounds = interleaved(&|| pool.install(a), &|| pool.install(b), ROUNDS);
                let (x, [low, high]) = ratio(&rounds);
                println!("{name:>16}  {x:.2} ({low:.2} to {high:.2}) of Embree; target {target}");
            };
            print("camera single", "0.9", &|| closest(&embree, &camera), &|| {
                closest(&bvh, &camera)
            });
            print("shadow single", "0.9", &|| any(&embree, &shadow), &|| any(&bvh, &shadow));
            print("diffuse single", "0.9", &|| closest(&embree, &diffuse), &|| {
                closest(&bvh, &diffuse);
            });
            print("camera packets", "0.6", &|| packets(&embree, &camera), &|| {
                packets(&bvh, &camera)
            });
            print("shadow packets", "none", &|| shadows(&embree, &shadow), &|| {
                shadows(&bvh, &shadow);
            });
        }
    }
}

fn builds(world: &World, precision: Precision) {
    let time = |kind| {
        let options = BuildOptions { kind, precision, ..BuildOptions::default() };
        let start = Instant::now();
        black_box(alhazen::accel::Accel::build(world, &options, &|_| true).expect("a sound world"));
        start.elapsed().as_secs_f64()
    };
    let rounds: Vec<f64> =
        (0..5).map(|_| time(AccelKind::Bvh) / time(AccelKind::default())).collect();
    println!("{:>16}  {:.2} of the time", "build", median(rounds));
}

fn closest<Q: RayQuery>(query: &Q, blocks: &[RayBlock]) {
    blocks.par_iter().for_each(|b| {
        b.lanes().for_each(|lane| {
            black_box(query.intersect(&b.get(lane)));
        });
    });
}

fn any<Q: RayQuery>(query: &Q, blocks: &[RayBlock]) {
    blocks.par_iter().for_each(|b| {
        b.lanes().for_each(|lane| {
            black_box(query.occluded(&b.get(lane)));
        });
    });
}

fn packets<Q: RayQuery>(query: &Q, blocks: &[RayBlock]) {
    blocks.par_iter().for_each(|b| {
        black_box(query.intersect_block(b));
    });
}

fn shadows<Q: RayQuery>(query: &Q, blocks: &[RayBlock]) {
    blocks.par_iter().for_each(|b| {
        black_box(query.occluded_block(b));
    });
}

/// From what camera rays hit: rays to the sun, and rays spread about the vertical by the cosine.
fn secondary(embree: &EmbreeAccel, camera: &[RayBlock]) -> [Vec<RayBlock>; 2] {
    let sun = Vec3::new(-0.75, 0.45, -0.42).normalize();
    let mut state = 7u64;
    let mut unit = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let (mut shadow, mut diffuse) = (Vec::new(), Vec::new());
    for block in camera {
        let hits = embree.intersect_block(block);
        let [mut to_sun, mut spread] = [RayBlock::empty(), RayBlock::empty()];
        for lane in block.lanes() {
            let Some(hit) = hits.get(lane) else { continue };
            let origin = block.get(lane).at(hit.t * 0.99999);
            let (r, phi) = (unit().sqrt(), unit() * std::f32::consts::TAU);
            let up = Vec3::new(r * phi.cos(), (1.0 - r * r).max(0.0).sqrt(), r * phi.sin());
            let ray = |direction| Ray { t_min: 1e-4, ..Ray::new(origin, direction) };
            to_sun.set(lane, &ray(sun));
            spread.set(lane, &ray(up));
        }
        shadow.push(to_sun);
        diffuse.push(spread);
    }
    [shadow, diffuse]
}
