//! What shapes and copies cost: a million spheres, ten thousand tori and a million copies of a large mesh,
//! beside Embree's own spheres and fine tessellations; and each kind of shape beside spheres.
//!
//! `cargo bench --bench shapes` prints the tables; with `ALHAZEN_DOCS=1` they are written into
//! `docs/shapes.md`. All rows of a table are measured by turns in one run.
#![allow(clippy::print_stdout, missing_docs, reason = "a benchmark prints")]

mod common;

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::hint::black_box;
use std::sync::Arc;

use alhazen::accel::{
    BuildOptions, EmbreeAccel, Geometry, Group, Hit, InstanceSet, LANES, RayBlock, RayQuery, World,
    rows_from_affine,
};
use alhazen::embree;
use alhazen::geometry::grid::Grid;
use alhazen::geometry::{
    Cone, Cuboid, Disk, Expression, Framed, Implicit, Isosurface, Polygon, Quadric, Shapes, Sphere,
    Torus, TriangleMesh,
};
use alhazen::math::{Bounds, Ray};
use common::{median, seconds};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use rayon::prelude::*;

/// Interleaved rounds of each measurement.
const ROUNDS: usize = 5;

/// Camera rays along each side of the picture, and rays of random directions.
const SIDE: usize = 512;
const RANDOM_RAYS: usize = 1 << 18;

/// Random numbers: SplitMix64.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ x >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn in_cube(&mut self) -> DVec3 {
        2.0 * DVec3::new(self.unit(), self.unit(), self.unit()) - 1.0
    }

    fn direction(&mut self) -> DVec3 {
        self.in_cube().normalize_or(DVec3::X)
    }

    /// Somewhere in the cube, turned any way, of this size.
    fn place(&mut self, size: f64) -> DAffine3 {
        let turn = DQuat::from_axis_angle(self.direction(), self.unit() * TAU);
        DAffine3::from_scale_rotation_translation(DVec3::splat(size), turn, self.in_cube())
    }
}

/// A structure to be measured, and what it is called.
struct Row<'a> {
    name: String,
    query: Box<dyn Query + 'a>,
    build: f64,
    /// Bytes of the structure and of what it refers to.
    bytes: u64,
    count: usize,
}

/// Queries in whole batches, so that what is measured is compiled for its structure.
trait Query: Sync {
    fn camera(&self, blocks: &[RayBlock]);
    fn packets(&self, blocks: &[RayBlock]);
    fn random(&self, rays: &[Ray]);
    fn occlusion(&self, rays: &[Ray]);
}

impl<Q: RayQuery> Query for Q {
    fn camera(&self, blocks: &[RayBlock]) {
        blocks.par_iter().for_each(|b| {
            b.lanes().for_each(|lane| {
                black_box(self.intersect(&b.get(lane)));
            });
        });
    }

    fn packets(&self, blocks: &[RayBlock]) {
        blocks.par_iter().for_each(|b| {
            black_box(self.intersect_block(b));
        });
    }

    fn random(&self, rays: &[Ray]) {
        rays.par_chunks(256).for_each(|rays| {
            rays.iter().for_each(|ray| {
                black_box(self.intersect(ray));
            });
        });
    }

    fn occlusion(&self, rays: &[Ray]) {
        rays.par_chunks(256).for_each(|rays| {
            rays.iter().for_each(|ray| {
                black_box(self.occluded(ray));
            });
        });
    }
}

/// An Embree scene as it is.
struct Bare(embree::Scene);

fn native(ray: &Ray) -> embree::Ray {
    embree::Ray {
        origin: ray.origin.to_array(),
        direction: ray.direction.to_array(),
        t_min: ray.t_min,
        t_max: ray.t_max,
    }
}

impl RayQuery for Bare {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.0.intersect(&native(ray))?;
        let (t, u, v) = (hit.t, hit.u, hit.v);
        Some(Hit { t, u, v, primitive: hit.primitive, geometry: hit.geometry, copy: None })
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.0.occluded(&native(ray))
    }

    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.occluded(ray)
    }
}

/// The cube seen from the front, in blocks of 4 × 4 pixels.
fn camera() -> Vec<RayBlock> {
    let eye = Vec3::new(0.3, 0.4, 4.0);
    let ray = |x: usize, y: usize| {
        let at = |i: usize| (i as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0;
        Ray::new(eye, (Vec3::new(at(x), at(y), 1.0) - eye).normalize())
    };
    let corners = (0..SIDE).step_by(4).flat_map(|y| (0..SIDE).step_by(4).map(move |x| (x, y)));
    corners
        .map(|(x, y)| {
            let mut block = RayBlock::empty();
            (0..LANES).for_each(|lane| block.set(lane, &ray(x + lane % 4, y + lane / 4)));
            block
        })
        .collect()
}

fn random_rays() -> Vec<Ray> {
    let mut random = Random(1);
    let ray = |_| Ray::new(random.in_cube().as_vec3(), random.direction().as_vec3());
    (0..RANDOM_RAYS).map(ray).collect()
}

/// Our own structure over a world.
fn ours(name: &str, world: &World, count: usize, bytes: usize) -> Row<'static> {
    let mut accel = None;
    let build = seconds_once(|| {
        let built = EmbreeAccel::build(world, &BuildOptions::default(), &|_| true);
        accel = Some(built.expect("it can be built"));
    });
    let accel = accel.expect("it was built");
    let bytes = accel.info().bytes + bytes as u64;
    Row { name: name.to_owned(), query: Box::new(accel), build, bytes, count }
}

fn seconds_once(work: impl FnOnce()) -> f64 {
    let start = std::time::Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

fn bare(
    name: &str,
    count: usize,
    bytes: usize,
    attach: impl FnOnce(&embree::Device, &mut embree::SceneBuilder),
) -> Row<'static> {
    let device = embree::Device::new(&embree::DeviceConfig::default()).expect("a device");
    let mut scene = None;
    let build = seconds_once(|| {
        let (flags, quality) = (embree::SceneFlags::ROBUST, embree::Quality::Medium);
        let mut builder = embree::SceneBuilder::new(&device, flags, quality).expect("a scene");
        attach(&device, &mut builder);
        scene = Some(builder.commit().expect("it can be built"));
    });
    let query = Box::new(Bare(scene.expect("it was built")));
    let bytes = device.memory().current + bytes as u64;
    Row { name: name.to_owned(), query, build, bytes, count }
}

/// Measures rows by turns and prints the table: the first is what the others are compared with.
fn table(title: &str, rows: &[Row<'_>]) -> String {
    let (camera, random) = (camera(), random_rays());
    let mut times = vec![[const { Vec::new() }; 4]; rows.len()];
    for round in 0..=ROUNDS {
        for (row, times) in rows.iter().zip(&mut times) {
            let queries: [&dyn Fn(); 4] = [
                &|| row.query.camera(&camera),
                &|| row.query.packets(&camera),
                &|| row.query.random(&random),
                &|| row.query.occlusion(&random),
            ];
            for (work, times) in queries.iter().zip(times) {
                let time = seconds(work);
                // The first warms caches up.
                if round > 0 {
                    times.push(time);
                }
            }
        }
    }
    let rays = [SIDE * SIDE, SIDE * SIDE, RANDOM_RAYS, RANDOM_RAYS].map(|n| n as f64);
    let mut text = format!(
        "| {title} | build, s | bytes each | camera rays | in packets | random rays | occlusion |\n\
         |---|---|---|---|---|---|---|\n"
    );
    for (i, row) in rows.iter().enumerate() {
        let cell = |kind: usize| {
            let speed = rays[kind] / median(times[i][kind].clone()) / 1e6;
            if i == 0 {
                return format!("{speed:.2} M/s");
            }
            let ratios = times[0][kind].iter().zip(&times[i][kind]).map(|(a, b)| a / b);
            format!("× {:.2}", median(ratios.collect()))
        };
        let each = row.bytes / row.count as u64;
        let cells = [0, 1, 2, 3].map(cell).join(" | ");
        writeln!(text, "| {} | {:.2} | {each} | {cells} |", row.name, row.build).expect("a string");
    }
    println!("{text}");
    text
}

/// A mesh of the points of a rectangular patch, as triangles.
fn patch(columns: u32, rows: u32, at: impl Fn(f64, f64) -> DVec3) -> TriangleMesh {
    let points = (0..=rows).flat_map(|j| (0..=columns).map(move |i| (i, j)));
    let xyz = points.flat_map(|(i, j)| {
        at(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows)).as_vec3().to_array()
    });
    let quads = (0..rows).flat_map(|j| (0..columns).map(move |i| j * (columns + 1) + i));
    let triangles = quads.flat_map(|a| {
        let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
        [[a, b, c], [a, c, d]]
    });
    TriangleMesh::new(xyz.collect(), triangles.collect())
}

fn around(angle: f64, rho: f64, y: f64) -> DVec3 {
    let (sin, cos) = (TAU * angle).sin_cos();
    DVec3::new(rho * sin, y, rho * cos)
}

fn ball(columns: u32) -> TriangleMesh {
    patch(columns, columns / 2, |u, v| {
        let (sin, cos) = (0.5 * TAU * v).sin_cos();
        around(u, sin, cos)
    })
}

/// Copies of a mesh, or of whatever a group is.
fn copies(group: Geometry, places: &[DAffine3]) -> World {
    let transforms = Arc::new(places.iter().map(rows_from_affine).collect());
    World {
        prototypes: vec![Group { geometries: vec![group], ..Group::default() }],
        sets: vec![InstanceSet { prototype: 0, transforms }],
        ..World::default()
    }
}

fn list(shapes: impl Into<Shapes>) -> World {
    let geometries = vec![Geometry::Shapes(shapes.into())];
    World { root: Group { geometries, ..Group::default() }, ..World::default() }
}

fn spheres() -> String {
    const COUNT: usize = 1_000_000;
    let mut random = Random(2);
    let balls: Vec<Sphere> = (0..COUNT)
        .map(|_| Sphere { center: random.in_cube(), radius: 0.002 + 0.004 * random.unit() })
        .collect();
    let points: Vec<[f32; 4]> =
        balls.iter().map(|b| b.center.extend(b.radius).as_vec4().to_array()).collect();
    let places: Vec<DAffine3> = balls
        .iter()
        .map(|b| {
            DAffine3::from_scale_rotation_translation(
                DVec3::splat(b.radius),
                DQuat::IDENTITY,
                b.center,
            )
        })
        .collect();
    let mesh = ball(24);
    let triangles = mesh.triangles.len();
    let rows = [
        ours("spheres, in 64 bits", &list(balls), COUNT, COUNT * size_of::<Sphere>()),
        bare("Embree's own, in 32 bits", COUNT, COUNT * 16, |device, builder| {
            let points = embree::Geometry::sphere_points(device, Arc::new(points));
            builder.attach(points.expect("they can be set up"));
        }),
        ours(
            &format!("copies of {triangles} triangles"),
            &copies(Geometry::Mesh(mesh), &places),
            COUNT,
            COUNT * 48,
        ),
    ];
    table("1,000,000 spheres", &rows)
}

fn tori() -> String {
    const COUNT: usize = 10_000;
    let mut random = Random(3);
    let torus = Torus { major_radius: 1.0, minor_radius: 0.35 };
    let at = |u: f64, v: f64| {
        let (sin, cos) = (TAU * v).sin_cos();
        around(u, 1.0 + 0.35 * cos, 0.35 * sin)
    };
    let places: Vec<DAffine3> = (0..COUNT).map(|_| random.place(0.03)).collect();
    let tori: Vec<_> = places.iter().map(|m| Framed::new(torus, *m)).collect();
    let mut merged: (Vec<f32>, Vec<[u32; 3]>) = Default::default();
    let coarse = patch(24, 12, at);
    for m in &places {
        let first = (merged.0.len() / 3) as u32;
        let moved = |i| m.transform_point3(coarse.positions.get(i).as_dvec3()).as_vec3().to_array();
        merged.0.extend((0..coarse.positions.len()).flat_map(moved));
        merged.1.extend(coarse.triangles.iter().map(|t| t.map(|i| i + first)));
    }
    let merged = TriangleMesh::new(merged.0, merged.1);
    let merged_bytes = 4 * merged.positions.as_flat().len() + 12 * merged.triangles.len();
    let geometries = vec![Geometry::Mesh(merged)];
    let mesh = World { root: Group { geometries, ..Group::default() }, ..World::default() };
    let fine = patch(64, 32, at);
    let rows = [
        ours("tori, in 64 bits", &list(tori), COUNT, COUNT * size_of::<Framed<Torus>>()),
        ours("copies of 4,096 triangles", &copies(Geometry::Mesh(fine), &places), COUNT, 0),
        ours("a mesh of 576 triangles each", &mesh, COUNT, merged_bytes),
    ];
    table("10,000 tori", &rows)
}

fn instances() -> String {
    const COUNT: usize = 1_000_000;
    let mut random = Random(4);
    let mesh = ball(316);
    let places: Vec<DAffine3> = (0..COUNT).map(|_| random.place(0.004)).collect();
    let array = copies(Geometry::Mesh(mesh.clone()), &places);
    let rows = [
        ours("ours, in boxes that fit", &array, COUNT, COUNT * 48),
        bare("Embree's instances", COUNT, 0, |device, builder| {
            let (flags, quality) = (embree::SceneFlags::ROBUST, embree::Quality::Medium);
            let triangles = Arc::clone(&mesh.triangles);
            let positions = mesh.positions.shared();
            let mesh = embree::Geometry::triangles(device, positions, triangles, quality);
            let mut prototype = embree::SceneBuilder::new(device, flags, quality).expect("a scene");
            prototype.attach(mesh.expect("it can be set up"));
            let prototype = prototype.commit().expect("it can be built");
            for m in &places {
                let rows = rows_from_affine(m);
                let copy = embree::Geometry::instance(device, &prototype, &rows);
                builder.attach(copy.expect("it can be set up"));
            }
        }),
    ];
    // The same copies, so the same hits.
    let title = format!("1,000,000 copies of {} triangles", mesh.triangles.len());
    table(&title, &rows)
}

/// As many shapes of each kind, of about the same size and turned any way.
fn kinds() -> String {
    const COUNT: usize = 20_000;
    let mut random = Random(5);
    let places: Vec<DAffine3> = (0..COUNT).map(|_| random.place(0.02)).collect();
    let unit = Bounds { min: DVec3::splat(-0.6), max: DVec3::splat(0.6) };
    let row = |name: &str, world: &World, each: usize| ours(name, world, COUNT, COUNT * each);
    macro_rules! framed {
        ($name:literal, $shape:expr) => {{
            let shape = $shape;
            let each = size_of_val(&shape) + size_of::<[DAffine3; 2]>();
            let framed = places.iter().map(|m| Framed::new(shape.clone(), *m));
            row($name, &list(framed.collect::<Vec<_>>()), each)
        }};
    }
    let ball = |m: &DAffine3| Sphere { center: m.translation, radius: 0.016 };
    let ring = |m: &DAffine3| Disk {
        center: m.translation,
        normal: m.transform_vector3(DVec3::Y).normalize(),
        radius: 0.02,
        inner_radius: 0.005,
    };
    let star = |m: &DAffine3| {
        let corner = |i: i32| {
            let rho = if i % 2 == 0 { 1.0 } else { 0.5 };
            m.transform_point3(around(f64::from(i) / 12.0, rho, 0.0))
        };
        Polygon::new(vec![(0..12).map(corner).collect()]).expect("flat")
    };
    let text = "(sqrt(x^2 + z^2) - 0.6)^2 + y^2 - 0.06";
    let torus = Arc::new(Expression::parse(text).expect("it is one"));
    let grid = Grid::from_fn([33; 3], |i, j, k| {
        let p = DVec3::new(i as f64, j as f64, k as f64) / 16.0 - 1.0;
        (0.8 - p.length()) as f32
    });
    let grid = Arc::new(grid.expect("finite"));
    let straight = |m: &DAffine3| Cuboid {
        bounds: unit.transformed(&DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.02),
            DQuat::IDENTITY,
            m.translation,
        )),
    };
    let size = Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE };
    let rows = [
        row("spheres", &list(places.iter().map(ball).collect::<Vec<_>>()), size_of::<Sphere>()),
        framed!("ellipsoids", Sphere { center: DVec3::ZERO, radius: 0.8 }),
        row("boxes", &list(places.iter().map(straight).collect::<Vec<_>>()), size_of::<Cuboid>()),
        framed!("turned boxes", Cuboid { bounds: unit }),
        framed!("cones", Cone { height: 1.4, radii: [0.8, 0.2], has_caps: true }),
        framed!("tori", Torus { major_radius: 0.6, minor_radius: 0.24 }),
        row("rings", &list(places.iter().map(ring).collect::<Vec<_>>()), size_of::<Disk>()),
        row("polygons of 12 corners", &list(places.iter().map(star).collect::<Vec<_>>()), 320),
        framed!(
            "quadrics",
            Quadric::new([1.0, 2.0, 1.5, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, -0.6], size)
        ),
        framed!("implicit tori", Implicit::new(Arc::clone(&torus), size)),
        framed!("isosurfaces of 33³ samples", Isosurface::new(grid, size, 0.0, false)),
    ];
    table("20,000 shapes", &rows)
}

fn main() {
    println!("{} threads", rayon::current_num_threads());
    let tables = [spheres(), tori(), instances(), kinds()];
    if std::env::var_os("ALHAZEN_DOCS").is_some_and(|value| value == "1") {
        fill(&tables.join("\n"));
    }
}

/// Writes the tables between their marks.
fn fill(tables: &str) {
    const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/shapes.md");
    const MARKS: [&str; 2] = ["<!-- COSTS -->\n", "<!-- COSTS END -->"];
    let page = std::fs::read_to_string(PAGE).expect("the page is there");
    let [start, end] = MARKS.map(|mark| page.find(mark).expect("the marks are there"));
    let page = format!("{}{tables}{}", &page[..start + MARKS[0].len()], &page[end..]);
    std::fs::write(PAGE, page).expect("it can be written");
}
