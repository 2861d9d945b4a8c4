//! How near a large mesh comes to what Embree could do at best: ratios within one run, with their targets.
//!
//! `cargo bench --bench limits [-- TRIANGLES|MESH]...` (1 and 10 million) generates a terrain for each size
//! and prints, as medians over interleaved rounds,
//! - of a render of one sample a pixel under a sun, and one of ambient occlusion: which share of its time
//!   the bare queries of its own rays take, written down and asked again by calls of Embree alone, without
//!   shading;
//! - what packets gain over single rays;
//! - of a run of the program from its start to a picture of 64 x 36 pixels: reading by building, and all
//!   of it by a bare build of the same arrays;
//! - of whole renders, `exact` by `robust`;
//! - of builds with the renders after them, what `build_quality = "auto"` takes by the better of the fixed choices.
//!
//! The last two are all that it says of the file of a MESH, and of the house of 1.5 million triangles where the
//! assets are there.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

mod common;
#[path = "../tests/common/mod.rs"]
mod fixtures;

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use alhazen::accel::{Accel, AccelKind, BuildQuality, EmbreeAccel, Geometry, Precision, RayBlock};
use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::embree::{
    self, Coherence, Device, DeviceConfig, PacketMask, Quality, RayHitPacket, RayPacket,
    SceneBuilder, SceneFlags,
};
use alhazen::film::Filter;
use alhazen::geometry::TriangleMesh;
use alhazen::geometry::generate::{GeneratedKind, GeneratedMesh};
use alhazen::integrator::{Ao, Integrator, Local, Whitted};
use alhazen::io::{LoadOptions, load_scene, write_mesh};
use alhazen::math::Ray;
use alhazen::render::{RenderJob, render};
use alhazen::scene::{
    CameraDesc, IntegratorKind, LightDesc, Location, PlaceDesc, Scene, SceneDesc,
};
use common::record::{Query, record};
use common::{ROUNDS, interleaved, median, ratio, seconds};
use glam::DVec3;
use rayon::prelude::*;

fn main() {
    if let Ok(path) = std::env::var(BARE_BUILD) {
        return println!("{}", build_bare(Path::new(&path)));
    }
    let given: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let mut sizes: Vec<u64> = given.iter().filter_map(|a| a.parse().ok()).collect();
    let meshes = given.iter().filter(|a| a.parse::<u64>().is_err());
    let mut meshes: Vec<PathBuf> = meshes.map(PathBuf::from).collect();
    if given.is_empty() {
        sizes = vec![1_000_000, 10_000_000];
        let house = |root: PathBuf| root.join("mesh/ply/victorian_house_1.5M.ply");
        meshes.extend(fixtures::assets().map(house).filter(|path| path.exists()));
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for triangles in sizes {
        let path = folder.path().join(format!("terrain{triangles}.ply"));
        let mesh = GeneratedMesh::new(GeneratedKind::Terrain, triangles, 0).expect("enough");
        write_mesh(&path, &mesh, &|_| true).expect("the folder is ours");
        println!(
            "terrain of {} triangles, {} threads",
            mesh.triangle_count(),
            rayon::current_num_threads()
        );
        rays(&path);
        from_file(&path);
        let of_path = || desc(&path, IntegratorKind::Direct);
        ladder(&of_path);
        qualities(&of_path);
        std::fs::remove_file(&path).expect("it is there");
    }
    for path in meshes {
        println!("{}", path.display());
        let of_path = || load_scene(&path, &LoadOptions::default()).expect("a mesh").scene;
        ladder(&of_path);
        qualities(&of_path);
    }
}

/// What `exact` takes by `robust`, of a scene with shadows and of the open sky's light: builds, and renders
/// of 1280 x 720 pixels with 4 samples.
fn ladder(desc: &dyn Fn() -> SceneDesc) {
    for (name, integrator) in
        [("direct light", IntegratorKind::Direct), ("ambient occlusion", IntegratorKind::Ao)]
    {
        let build = |precision| {
            let mut desc = desc();
            desc.settings.precision = precision;
            desc.settings.build_quality = BuildQuality::Medium;
            desc.settings.integrator = integrator;
            desc.image.size = [1280, 720];
            desc.settings.samples = 4;
            let start = Instant::now();
            let scene = Scene::build_quietly(desc, AccelKind::default()).expect("a sound scene");
            (scene, start.elapsed().as_secs_f64())
        };
        let (robust, robust_build) = build(Precision::Robust);
        let (exact, exact_build) = build(Precision::Exact);
        let run = |scene: &Scene| drop(black_box(render(scene, &RenderJob::default(), &())));
        let rounds = interleaved(&|| run(&exact), &|| run(&robust), ROUNDS);
        let (time, [low, high]) = ratio(&rounds);
        println!(
            "  exact by robust, {name}: {time:.2} ({low:.2} to {high:.2}), its build {:.2}; target 1.3",
            exact_build / robust_build
        );
    }
}

/// Build and render at 1920 x 1080 by accelerator, integrator and number of samples, with each fixed quality: the one
/// that `auto` takes by the better of them. With `robust`, high is medium.
fn qualities(desc: &dyn Fn() -> SceneDesc) {
    const ROUNDS: usize = 5;
    let cases = [
        (AccelKind::Embree, IntegratorKind::Direct),
        (AccelKind::Embree, IntegratorKind::Ao),
        (AccelKind::Bvh, IntegratorKind::Direct),
    ];
    for ((kind, integrator), samples) in
        cases.into_iter().flat_map(|case| [1, 4, 16].map(|samples| (case, samples)))
    {
        let build = |build_quality| {
            let mut desc = desc();
            desc.settings.build_quality = build_quality;
            desc.settings.integrator = integrator;
            desc.image.size = [1920, 1080];
            desc.settings.samples = samples;
            let start = Instant::now();
            let scene = Scene::build_quietly(desc, kind).expect("a sound scene");
            (scene, start)
        };
        let run = |quality| {
            let (scene, start) = build(quality);
            drop(black_box(render(&scene, &RenderJob::default(), &())));
            start.elapsed().as_secs_f64()
        };
        let [mut low, mut medium] = [Vec::new(), Vec::new()];
        for round in 0..ROUNDS {
            // The one that comes second finds memory that the other has left.
            let mut turns = [(&mut low, BuildQuality::Low), (&mut medium, BuildQuality::Medium)];
            turns.rotate_left(round % 2);
            turns.into_iter().for_each(|(times, quality)| times.push(run(quality)));
        }
        let (low, medium) = (median(low), median(medium));
        let picked = build(BuildQuality::Auto).0.build_quality;
        let time = if picked == BuildQuality::Low { low } else { medium };
        println!(
            "  build and render, {}, {}, {samples} samples: low {low:.2} s, medium {medium:.2} s; auto takes {}, by \
             the better of them {:.2}; target 1.05",
            kind.name(),
            integrator.name(),
            picked.name(),
            time / low.min(medium)
        );
    }
}

/// The terrain of a file, seen from a corner under a low sun.
fn scene(path: &Path, integrator: IntegratorKind) -> Scene {
    Scene::build_quietly(desc(path, integrator), AccelKind::default()).expect("a sound scene")
}

fn desc(path: &Path, integrator: IntegratorKind) -> SceneDesc {
    let mut desc: SceneDesc = load_scene(path, &LoadOptions::default()).expect("ours").scene;
    desc.image.size = [1920, 1080];
    desc.settings.samples = 1;
    desc.settings.filter = Filter::Box;
    // As the bare scenes beside it.
    desc.settings.build_quality = BuildQuality::Medium;
    desc.settings.integrator = integrator;
    desc.camera = Some(CameraDesc {
        at: Location::default(),
        projection: Projection::Perspective { fov: 45f64.to_radians() },
        place: Some(PlaceDesc::LookAt {
            eye: DVec3::new(-28.0, 45.0, 48.0),
            target: DVec3::new(0.0, 0.0, -2.0),
            up: DVec3::Y,
        }),
        lens: None,
    });
    let (direction, irradiance) = (DVec3::new(0.75, -0.45, 0.42), Rgb::splat(3.0));
    desc.lights = vec![LightDesc::Directional { direction, irradiance }];
    desc
}

fn rays(path: &Path) {
    for kind in [IntegratorKind::Direct, IntegratorKind::Ao] {
        let scene = scene(path, kind);
        let Accel::Embree(query) = &scene.accel else { unreachable!("Embree is the default") };
        let bare = Bare::new(&scene);
        match kind {
            IntegratorKind::Ao => compare(&scene, query, &bare, &Ao, "ao", 0.8),
            _ => compare(&scene, query, &bare, &Whitted::<Local>::new(None), "direct light", 0.7),
        }
    }
}

fn compare(
    scene: &Scene,
    query: &EmbreeAccel,
    bare: &Bare,
    integrator: &impl Integrator,
    name: &str,
    target: f64,
) {
    let (queries, counts) = record(scene, query, integrator);
    let total = counts.total() as f64;
    println!(
        " {name}, {} x {}, 1 sample: {} camera, {} shadow, {} diffuse rays; {}",
        scene.size[0],
        scene.size[1],
        counts.camera,
        counts.shadow,
        counts.diffuse,
        query.info()
    );
    let whole = || drop(black_box(render(scene, &RenderJob::default(), &())));
    let rounds = interleaved(&|| bare.ask(&queries), &whole, ROUNDS);
    let mrays = |times: Vec<f64>| total / median(times) / 1e6;
    let (share, [low, high]) = ratio(&rounds);
    println!(
        "  {:.1} Mrays/s of {:.1} that bare queries reach: {share:.2} ({low:.2} to {high:.2}); target {target}",
        mrays(rounds.iter().map(|r| r.1).collect()),
        mrays(rounds.iter().map(|r| r.0).collect()),
    );
    let chunks = |run: fn(&Query, &EmbreeAccel)| {
        queries.par_chunks(64).for_each(|queries| queries.iter().for_each(|q| run(q, query)));
    };
    let rounds = interleaved(&|| chunks(Query::run_single), &|| chunks(Query::run), ROUNDS);
    let (gain, _) = ratio(&rounds);
    println!("  all rays one by one take {gain:.2} of the time of these queries");
}

/// Embree as its C interface has it, over the arrays of a scene's only mesh.
struct Bare {
    scene: embree::Scene,
    width: usize,
}

impl Bare {
    fn new(scene: &Scene) -> Self {
        let [Geometry::Mesh(mesh)] = scene.world().root.geometries.as_slice() else {
            unreachable!("one mesh")
        };
        Self::build(mesh)
    }

    fn build(mesh: &TriangleMesh) -> Self {
        let device = Device::new(&DeviceConfig::default()).expect("Embree");
        let mut builder = SceneBuilder::new(&device, SceneFlags::ROBUST, Quality::Medium);
        let (xyz, triangles) = (mesh.positions.shared(), Arc::clone(&mesh.triangles));
        let geometry = embree::Geometry::triangles(&device, xyz, triangles, Quality::Medium);
        builder.as_mut().expect("Embree").attach(geometry.expect("a sound mesh"));
        let scene = builder.expect("Embree").commit().expect("memory");
        Self { scene, width: device.packet_width() }
    }

    fn ask(&self, queries: &[Query]) {
        let all = |queries: &[Query]| queries.iter().for_each(|query| self.ask_one(query));
        queries.par_chunks(64).for_each(all);
    }

    fn ask_one(&self, query: &Query) {
        match (query, self.width) {
            (Query::Closest(ray), _) => drop(black_box(self.scene.intersect(&single(ray)))),
            (Query::Any(ray), _) => _ = black_box(self.scene.occluded(&single(ray))),
            (Query::ClosestBlock(rays), 16) => self.closest::<16>(rays),
            (Query::ClosestBlock(rays), 8) => self.closest::<8>(rays),
            (Query::ClosestBlock(rays), _) => self.closest::<4>(rays),
            (Query::AnyBlock(rays), 16) => self.any::<16>(rays),
            (Query::AnyBlock(rays), 8) => self.any::<8>(rays),
            (Query::AnyBlock(rays), _) => self.any::<4>(rays),
        }
    }

    fn closest<const N: usize>(&self, rays: &RayBlock) {
        for (mask, packet) in packets::<N>(rays) {
            let mut packet = RayHitPacket::new(packet);
            self.scene.intersect_packet(&mask, &mut packet, Coherence::Coherent);
            black_box(&packet);
        }
    }

    fn any<const N: usize>(&self, rays: &RayBlock) {
        for (mask, mut packet) in packets::<N>(rays) {
            self.scene.occluded_packet(&mask, &mut packet, Coherence::Coherent);
            black_box(&packet);
        }
    }
}

fn single(ray: &Ray) -> embree::Ray {
    embree::Ray {
        origin: ray.origin.to_array(),
        direction: ray.direction.to_array(),
        t_min: ray.t_min,
        t_max: ray.t_max,
    }
}

fn packets<const N: usize>(
    rays: &RayBlock,
) -> impl Iterator<Item = (PacketMask<N>, RayPacket<N>)> + '_ {
    (0..16).step_by(N).filter_map(|start| {
        let bits = u32::from(rays.active()) >> start & ((1 << N) - 1);
        let mut packet = RayPacket::empty();
        for (to, from) in [
            (&mut packet.org_x, &rays.org_x),
            (&mut packet.org_y, &rays.org_y),
            (&mut packet.org_z, &rays.org_z),
            (&mut packet.t_min, &rays.t_min),
            (&mut packet.dir_x, &rays.dir_x),
            (&mut packet.dir_y, &rays.dir_y),
            (&mut packet.dir_z, &rays.dir_z),
            (&mut packet.t_max, &rays.t_max),
        ] {
            to.copy_from_slice(&from[start..start + N]);
        }
        (bits != 0).then(|| (PacketMask::from_bits(bits), packet))
    })
}

/// Where this names a file, this program is run to build its mesh and nothing else.
const BARE_BUILD: &str = "ALHAZEN_BARE_BUILD";

/// Seconds of a bare build of the mesh of a file, once it is read.
fn build_bare(path: &Path) -> f64 {
    let desc = load_scene(path, &LoadOptions::default()).expect("ours").scene;
    let start = Instant::now();
    let bare = Bare::build(&desc.meshes[0]);
    let time = start.elapsed().as_secs_f64();
    drop(black_box(bare));
    time
}

/// The program from start to picture, against a bare build in a process of its own: in this one the second
/// would find memory that is mapped already.
fn from_file(path: &Path) {
    const ROUNDS: usize = 5;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (picture, stats) = (folder.path().join("first.exr"), folder.path().join("stats.json"));
    let program = std::env::current_exe().expect("a path");
    let mut reads = Vec::new();
    let mut firsts = Vec::new();
    for _ in 0..ROUNDS {
        let bare = Command::new(&program).env(BARE_BUILD, path).output().expect("the program runs");
        let bare: f64 = String::from_utf8_lossy(&bare.stdout).trim().parse().expect("seconds");
        let run = seconds(&|| {
            let status = Command::new(env!("CARGO_BIN_EXE_alhazen"))
                .args(["render", "--quiet", "--size", "64x36", "--samples", "1"])
                .arg(path)
                .arg("-o")
                .arg(&picture)
                .arg("--stats")
                .arg(&stats)
                .status();
            assert!(status.expect("the program runs").success());
        });
        let text = std::fs::read_to_string(&stats).expect("it was written");
        let told: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let phase = |name: &str| told["seconds"][name].as_f64().expect("documented");
        reads.push(phase("read") / phase("build"));
        firsts.push(run / bare);
    }
    println!("  reading the file takes {:.2} of building; target 0.3", median(reads));
    println!(
        "  from start to first picture takes {:.2} of a bare build; target 1.25",
        median(firsts)
    );
}
