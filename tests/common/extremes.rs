//! Numerics at the extremes: each row a case, each cell a rung of precision of an accelerator, against
//! closed forms and f64. `benches/extremes.rs` prints them all; `tests/extremes.rs` asserts that none is
//! red.
#![allow(clippy::print_stderr, reason = "a test program")]

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::sync::Arc;
use std::time::Instant;

use alhazen::accel::{
    Accel, AccelKind, BruteForce, BuildOptions, Geometry, Group, Precision, RayBlock, World,
};
use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::film::Filter;
use alhazen::geometry::TriangleMesh;
use alhazen::geometry::grid::Grid;
use alhazen::light::Falloff;
use alhazen::material::fresnel::refract;
use alhazen::material::{Dielectric, FresnelModel, Ior, Material};
use alhazen::math::{Bounds, Ray};
use alhazen::measure::bench::agreement;
use alhazen::medium::volume::{TransferFunction, TransferNode};
use alhazen::medium::{Fog, FogProfile};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{
    CameraDesc, Epsilon, LensDesc, LightDesc, Location, MaterialDesc, ObjectDesc, PlaceDesc,
    PrototypeDesc, Reference, Scene, SceneDesc, ShapeDesc, VolumeDesc,
};
use glam::{DAffine3, DVec2, DVec3, Vec3};

use crate::common::Random;

/// What a rung of an accelerator came to.
pub struct Cell {
    pub text: String,
    pub is_red: bool,
}

impl Cell {
    fn new(text: impl Into<String>, is_red: bool) -> Self {
        Self { text: text.into(), is_red }
    }
}

/// A case; a cell for each column of its table.
pub struct Row {
    pub case: String,
    pub cells: Vec<Cell>,
}

/// Cases of one kind.
pub struct Table {
    pub title: &'static str,
    /// What is measured, and what is red.
    pub what: &'static str,
    pub columns: Vec<String>,
    pub rows: Vec<Row>,
}

/// Tables in Markdown.
pub fn markdown(tables: &[Table]) -> String {
    let mut text = String::new();
    for table in tables {
        let _ = writeln!(text, "## {}\n\n{}\n", table.title, table.what);
        let _ = writeln!(text, "| case | {} |", table.columns.join(" | "));
        let _ = writeln!(text, "|---|{}", "---|".repeat(table.columns.len()));
        for row in &table.rows {
            let _ = write!(text, "| {} |", row.case);
            for cell in &row.cells {
                let mark = if cell.is_red { "**RED** " } else { "" };
                let _ = write!(text, " {mark}{} |", cell.text);
            }
            text.push('\n');
        }
        text.push('\n');
    }
    text
}

/// A rung of an accelerator.
#[derive(Clone, Copy)]
struct Rung {
    kind: AccelKind,
    precision: Precision,
}

impl Rung {
    /// All that there are: `exact` is one for both.
    fn all() -> Vec<Self> {
        let kinds = AccelKind::ALL.iter().filter(|kind| **kind != AccelKind::Brute);
        let two = kinds.flat_map(|&kind| {
            [Precision::Fast, Precision::Robust].map(|precision| Self { kind, precision })
        });
        two.chain([Self { kind: AccelKind::default(), precision: Precision::Exact }]).collect()
    }

    fn name(self) -> String {
        match self.precision {
            Precision::Exact => "`exact`".to_owned(),
            precision => format!("{} `{}`", self.kind.name(), precision.name()),
        }
    }

    fn columns() -> Vec<String> {
        Self::all().into_iter().map(Self::name).collect()
    }

    fn accel(self, world: &World) -> Accel {
        let options =
            BuildOptions { kind: self.kind, precision: self.precision, ..BuildOptions::default() };
        Accel::build(world, &options, &|_| true).unwrap()
    }

    fn scene(self, mut desc: SceneDesc) -> Scene {
        desc.settings.precision = self.precision;
        Scene::build_quietly(desc, self.kind).unwrap()
    }

    /// Whether it promises that nothing is lost at edges.
    fn is_robust(self) -> bool {
        self.precision >= Precision::Robust
    }

    fn is_exact(self) -> bool {
        self.precision == Precision::Exact
    }
}

/// A row with a cell for each rung.
fn row(case: impl Into<String>, cell: impl Fn(Rung) -> Cell) -> Row {
    Row { case: case.into(), cells: Rung::all().into_iter().map(cell).collect() }
}

/// All tables, from `n` rays a case.
pub fn tables(n: usize) -> Vec<Table> {
    let all: [&dyn Fn() -> Table; 11] = [
        &|| leaks(n),
        &|| double_hits(n),
        &|| far_cameras(n),
        &|| grazing(n),
        &|| self_hits(n),
        &|| stacked(n),
        &|| slivers(n),
        &|| planet(n),
        &|| refraction(n),
        &moved_pictures,
        &odd_scenes,
    ];
    let table = |make: &&dyn Fn() -> Table| {
        let start = Instant::now();
        let table = make();
        eprintln!("{}: {:.1} s", table.title, start.elapsed().as_secs_f64());
        table
    };
    all.iter().map(table).collect()
}

fn per_million(count: usize, of: usize) -> String {
    let rate = 1e6 * count as f64 / of.max(1) as f64;
    if rate == 0.0 || rate >= 10.0 { format!("{rate:.0}") } else { format!("{rate:.1}") }
}

fn power(x: f64) -> String {
    if x == 0.0 || (0.01..1000.0).contains(&x.abs()) { format!("{x}") } else { format!("{x:.0e}") }
}

/// A closed, convex ball of triangles.
fn ball(rings: u32, center: DVec3, radius: f64) -> TriangleMesh {
    let sectors = 2 * rings;
    let mut xyz = Vec::new();
    for i in 0..=rings {
        for j in 0..sectors {
            let theta = PI * f64::from(i) / f64::from(rings);
            let phi = TAU * f64::from(j) / f64::from(sectors);
            let d = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            xyz.extend((center + d * radius).as_vec3().to_array());
        }
    }
    let at = |i: u32, j: u32| match i {
        0 => 0,
        i if i == rings => rings * sectors,
        i => i * sectors + j % sectors,
    };
    let quads = (0..rings).flat_map(|i| (0..sectors).map(move |j| (i, j)));
    let triangles = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, c, b], [a, d, c]]
    });
    let triangles = triangles.filter(|[a, b, c]| a != b && b != c && a != c);
    TriangleMesh::new(xyz, triangles.collect())
}

fn world_of(mesh: TriangleMesh) -> World {
    let root = Group { geometries: vec![Geometry::Mesh(mesh)], ..Group::default() };
    World { root, ..World::default() }
}

/// From inside a closed mesh every ray must hit; and from outside, having passed a corner, none again.
fn leaks(n: usize) -> Table {
    let places =
        [(0.0, 1.0), (1e3, 1.0), (1e5, 1.0), (1e6, 1.0), (0.0, 1e-6), (0.0, 1e6), (1e6, 1e3)];
    let rows = places.map(|(offset, scale)| {
        let center = DVec3::new(offset, -0.7 * offset, 0.4 * offset);
        let mesh = ball(160, center, scale);
        let world = world_of(mesh.clone());
        row(format!("offset {}, scale {}", power(offset), power(scale)), |rung| {
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
fn double_hits(n: usize) -> Table {
    let rows = [(0.0, 1.0), (0.0, 1e-6), (0.0, 1e6), (1e3, 1.0), (2e4, 10.0)].map(
        |(offset, scale): (f64, f64)| {
            let center = DVec3::new(offset, -offset, 0.5 * offset);
            let mesh = ball(60, DVec3::ZERO, scale);
            row(format!("offset {}, scale {}", power(offset), power(scale)), |rung| {
                let mut desc = empty();
                desc.meshes.push(mesh.clone());
                let object = ObjectDesc::new(ShapeDesc::Mesh(0), Some("grey"));
                let transform = DAffine3::from_translation(center);
                desc.objects.push(ObjectDesc { transform, ..object });
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

fn look(eye: DVec3, target: DVec3, fov: f64) -> CameraDesc {
    let up = if (target - eye).normalize().y.abs() > 0.9 { DVec3::Z } else { DVec3::Y };
    CameraDesc {
        at: Location::default(),
        projection: Projection::Perspective { fov },
        place: Some(PlaceDesc::LookAt { eye, target, up }),
        lens: None,
    }
}

fn sphere(center: DVec3, radius: f64) -> ObjectDesc {
    ObjectDesc::new(ShapeDesc::Sphere { center, radius }, Some("grey"))
}

fn empty() -> SceneDesc {
    let mut desc = SceneDesc::default();
    desc.image.size = [64, 64];
    desc.settings.samples = 1;
    desc.settings.filter = Filter::Box;
    let grey = Material::Diffuse { reflectance: Rgb::splat(0.5) };
    desc.materials.push(MaterialDesc::new("grey", grey));
    desc.ambient = Some(Rgb::BLACK);
    desc
}

/// Where a ray enters a sphere, in f64.
fn enter(origin: DVec3, direction: DVec3, center: DVec3, radius: f64) -> Option<DVec3> {
    let d = direction.normalize();
    // From the foot of the perpendicular, which is near the centre: no digits cancel.
    let along = (center - origin).dot(d);
    let foot = origin + d * along - center;
    let half = radius * radius - foot.length_squared();
    (half >= 0.0).then(|| center + foot - d * half.sqrt())
}

/// A camera that sees a ball from afar: every ray at it hits, where it should.
fn far_cameras(n: usize) -> Table {
    let cases = [1e1, 1e3, 1e5, 1e7].into_iter().flat_map(|d| [(d, false), (d, true)]);
    let rows = cases.map(|(distance, is_mesh)| {
        let eye = DVec3::new(0.36, 0.48, 0.8) * distance;
        let shape = if is_mesh { "mesh" } else { "sphere" };
        row(format!("{shape} from {} radii", power(distance)), |rung| {
            let mut desc = empty();
            if is_mesh {
                desc.meshes.push(ball(400, DVec3::ZERO, 1.0));
                desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), Some("grey")));
            } else {
                desc.objects.push(sphere(DVec3::ZERO, 1.0));
            }
            desc.camera = Some(look(eye, DVec3::ZERO, 2.0 * (1.0 / distance).asin()));
            let scene = rung.scene(desc);
            let query = scene.accel.query();
            let mut random = Random(3);
            let (mut lost, mut off, mut turned) = (0, 0.0f64, 0.0f64);
            let n = n / 4;
            for _ in 0..n {
                // Nine tenths of the radius: nothing is grazed.
                let (r, phi) = (0.9 * random.unit().sqrt(), TAU * random.unit());
                let film = DVec2::new(32.0 + 32.0 * r * phi.cos(), 32.0 + 32.0 * r * phi.sin());
                let ray = scene.camera.ray(film, [0.5, 0.5]).unwrap();
                let Some(hit) = query.intersect(&ray) else {
                    lost += 1;
                    continue;
                };
                let (origin, direction) = scene.camera.ray_f64(film);
                let point = scene.surface(&ray, &hit);
                let p = point.position.as_dvec3();
                let truth = enter(origin, direction, -scene.center, 1.0).unwrap();
                // Facets lie below the sphere, by up to 6e-5 at this slope.
                let facet = if is_mesh { 2e-4 } else { 0.0 };
                off = off.max(((p - truth).length() - facet).max(0.0));
                if !is_mesh {
                    let normal = point.geometric_normal.as_dvec3();
                    turned = turned.max((normal - (p + scene.center).normalize()).length());
                }
            }
            let is_red = rung.is_robust() && (lost > 0 || off > 1e-5 || turned > 1e-6);
            let turned = if is_mesh { String::new() } else { format!(", {turned:.0e} rad") };
            Cell::new(format!("{} lost, off {off:.0e}{turned}", per_million(lost, n)), is_red)
        })
    });
    Table {
        title: "Cameras far away",
        what: "A ball of radius 1 fills the picture: rays of a million that miss it; the largest distance of a hit from \
               that of the f64 ray, beyond the depth of a facet; the largest error of a sphere's normal. Red, from `robust` \
               on: a ray lost, a hit off by more than 10⁻⁵, a normal by more than 10⁻⁶.",
        columns: Rung::columns(),
        rows: rows.collect(),
    }
}

/// Rays that hardly touch: at a plane under small angles, and at a sphere's rim.
fn grazing(n: usize) -> Table {
    let mut rows = Vec::new();
    for degrees in [1.0, 1e-2, 1e-4, 1e-6] {
        let angle = f64::to_radians(degrees);
        for is_mesh in [false, true] {
            let what = if is_mesh { "square of triangles" } else { "disk" };
            rows.push(row(format!("{what} at 90° − {}°", power(degrees)), |rung| {
                let mut desc = empty();
                if is_mesh {
                    let xyz = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
                    let xyz = xyz.iter().flat_map(|[x, z]| [*x, 0.0, *z]).collect();
                    desc.meshes.push(TriangleMesh::new(xyz, vec![[0, 2, 1], [0, 3, 2]]));
                    desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), Some("grey")));
                } else {
                    let disk = ShapeDesc::Disk {
                        center: DVec3::ZERO,
                        normal: DVec3::Y,
                        radius: 1.0,
                        inner_radius: 0.0,
                    };
                    desc.objects.push(ObjectDesc::new(disk, Some("grey")));
                }
                let scene = rung.scene(desc);
                let query = scene.accel.query();
                let mut random = Random(8);
                let (mut lost, mut off) = (0, 0.0f64);
                let n = n / 8;
                for _ in 0..n {
                    let phi = TAU * random.unit();
                    let aim = DVec3::new(random.between(-0.3, 0.3), 0.0, random.between(-0.3, 0.3));
                    let d =
                        DVec3::new(angle.cos() * phi.cos(), -angle.sin(), angle.cos() * phi.sin());
                    let ray = Ray::new((aim - d * 2.0).as_vec3(), d.as_vec3());
                    let Some(hit) = query.intersect(&ray) else {
                        lost += 1;
                        continue;
                    };
                    let point = scene.surface(&ray, &hit);
                    // Off the plane y = 0, in bounds.
                    off = off.max(f64::from(point.position.y.abs() / point.error.max(1e-30)));
                }
                let is_red = (rung.is_robust() && lost > 0) || off > 4.0;
                Cell::new(format!("{} lost, off {off:.1} bounds", per_million(lost, n)), is_red)
            }));
        }
    }
    for share in [1e-2, 1e-4, 1e-6] {
        rows.push(row(format!("sphere at {} of its radius from the rim", power(share)), |rung| {
            let mut desc = empty();
            desc.objects.push(sphere(DVec3::ZERO, 1.0));
            let scene = rung.scene(desc);
            let query = scene.accel.query();
            let mut random = Random(8);
            let (mut lost, mut off) = (0, 0.0f64);
            let n = n / 8;
            for _ in 0..n {
                let d = random.direction();
                let across = d.cross(random.direction()).normalize();
                let ray = Ray::new((across * (1.0 - share) - d * 4.0).as_vec3(), d.as_vec3());
                // What is asked is the rounded ray.
                let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
                let truth = enter(o, d, DVec3::ZERO, 1.0);
                match (query.intersect(&ray), truth) {
                    (Some(hit), _) => {
                        let point = scene.surface(&ray, &hit);
                        let distance = (point.position.as_dvec3().length() - 1.0).abs();
                        off = off.max(distance / f64::from(point.error));
                    }
                    // At the rim itself either answer is right.
                    (None, Some(p)) if (p.dot(d) / d.length()).abs() > 1e-6 => lost += 1,
                    (None, _) => {}
                }
            }
            let is_red = (rung.is_robust() && lost > 0) || off > 4.0;
            Cell::new(format!("{} lost, off {off:.1} bounds", per_million(lost, n)), is_red)
        }));
    }
    Table {
        title: "Grazing rays",
        what: "Rays of a million that miss what f64 says they hit, and the largest distance of a hit from the surface, in \
               multiples of the bound that is stated with it. Red: a ray lost from `robust` on, or more than 4 bounds.",
        columns: Rung::columns(),
        rows,
    }
}

/// Rays that leave a convex surface outward hit nothing.
fn self_hits(n: usize) -> Table {
    let rules = ["auto", "1e-6", "1e-4", "1e-2"];
    let mut rows = Vec::new();
    for (offset, scale) in [(0.0, 1.0), (0.0, 1e-4), (0.0, 1e4), (1e3, 1.0), (2e4, 10.0)] {
        for shape in ["sphere", "box", "mesh"] {
            let center = DVec3::new(offset, -offset, 0.5 * offset);
            let cell = |rule: &&str| {
                let mut desc = empty();
                let object = match shape {
                    "sphere" => sphere(center, scale),
                    "box" => {
                        let half = DVec3::new(0.8, 0.5, 0.6) * scale;
                        let bounds = Bounds { min: center - half, max: center + half };
                        ObjectDesc::new(ShapeDesc::Box(bounds), Some("grey"))
                    }
                    _ => {
                        desc.meshes.push(ball(60, DVec3::ZERO, scale));
                        let mesh = ObjectDesc::new(ShapeDesc::Mesh(0), Some("grey"));
                        ObjectDesc { transform: DAffine3::from_translation(center), ..mesh }
                    }
                };
                // Something at the origin keeps the world from being recentred on the object.
                desc.objects.extend([object, sphere(DVec3::ZERO, 1e-3 * scale)]);
                if *rule != "auto" {
                    desc.settings.epsilon = Epsilon::Fixed(rule.parse().unwrap());
                }
                let rung = Rung { kind: AccelKind::default(), precision: Precision::Robust };
                let scene = rung.scene(desc);
                let query = scene.accel.query();
                let center = center - scene.center;
                let mut random = Random(9);
                let (mut rays, mut wrong) = (0, 0);
                while rays < n / 8 {
                    let origin = center + random.direction() * 8.0 * scale;
                    let target = center + random.in_cube() * 0.5 * scale;
                    let ray = Ray::new(origin.as_vec3(), (target - origin).normalize().as_vec3());
                    let Some(hit) = query.intersect(&ray) else { continue };
                    let point = scene.surface(&ray, &hit);
                    // One in four nearly grazing.
                    let normal = point.geometric_normal.as_dvec3();
                    let mut d = random.direction();
                    if random.unit() < 0.25 {
                        d -= normal * d.dot(normal) * random.between(0.999, 1.0);
                    }
                    let d = if d.dot(normal) < 0.0 { -d } else { d }.normalize().as_vec3();
                    if d.dot(point.geometric_normal) <= 0.0 {
                        continue;
                    }
                    rays += 1;
                    let new = scene.spawn(&point, d, f32::INFINITY);
                    // Rounded coordinates far away make a mesh rough: others of its facets are in the way.
                    wrong += usize::from(match (shape, query.intersect(&new)) {
                        ("mesh", found) => found.is_some_and(|found| {
                            (found.geometry, found.primitive) == (hit.geometry, hit.primitive)
                        }),
                        (_, found) => found.is_some(),
                    });
                }
                let is_red = *rule == "auto" && wrong > 0;
                Cell::new(per_million(wrong, rays), is_red)
            };
            let case = format!("{shape}, offset {}, size {}", power(offset), power(scale));
            rows.push(Row { case, cells: rules.iter().map(cell).collect() });
        }
    }
    Table {
        title: "Surfaces that hit themselves",
        what: "Of each million rays that leave a convex shape outward, a quarter of them nearly grazing, those that hit it \
               again, at `robust`; by the rule that lets them leave: `epsilon = \"auto\"`, or fixed distances. Red: any \
               by `auto`.",
        columns: rules.iter().map(|rule| format!("`{rule}`")).collect(),
        rows,
    }
}

/// Two squares on or nearly on each other: the nearer one is hit, and always the same of two that coincide.
fn stacked(n: usize) -> Table {
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
fn slivers(n: usize) -> Table {
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
        desc.meshes.push(mesh.clone());
        desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), Some("grey")));
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
            let text = format!("{wrong:.2} % wrong, {edges:.1} % at edges");
            Cell::new(text, rung.is_exact() && wrong > 0.1)
        })
    });
    Table {
        title: "Slivers",
        what: "300 triangles, rays aimed within their width from a distance of 3, against brute force in f64: answers that are \
               wrong, and those that brute force gives too when the ray is moved aside by a few roundings. In f32 a position \
               is rounded to some 10⁻⁷ here, so that ever more rays meet an edge, and slivers that cross are told apart no \
               better. Red: more than 0.1 % wrong at `exact`.",
        columns: Rung::columns(),
        rows: rows.into(),
    }
}

/// Of `n` rays from a metre (or a hundred radii, where that is more) away to a pebble that lies at `at` on a
/// planet, how many are lost, and how far off a hit is at most, in radii of the pebble.
fn pebble_seen(rung: Rung, planet: f64, radius: f64, at: DVec3, n: usize) -> [f64; 2] {
    let mut desc = empty();
    let pebble = at + DVec3::Y * radius;
    desc.objects.push(sphere(at - DVec3::Y * planet, planet));
    desc.objects.push(sphere(pebble, radius));
    let eye = at + DVec3::new(0.0, 0.3, 1.0) * (100.0 * radius).max(1.0);
    let fov = 2.0 * radius / (eye - pebble).length();
    desc.camera = Some(look(eye, pebble, fov));
    let scene = rung.scene(desc);
    let query = scene.accel.query();
    let mut random = Random(4);
    let (mut lost, mut off) = (0.0, 0.0f64);
    for _ in 0..n {
        let (r, phi) = (0.85 * random.unit().sqrt(), TAU * random.unit());
        let film = DVec2::new(32.0 + 29.0 * r * phi.cos(), 32.0 + 29.0 * r * phi.sin());
        let Some(ray) = scene.camera.ray(film, [0.5, 0.5]) else { continue };
        let (o, d) = scene.camera.ray_f64(film);
        let Some(truth) = enter(o, d, pebble - scene.center, radius) else { continue };
        match query.intersect(&ray) {
            Some(hit) => {
                let p = scene.surface(&ray, &hit).position.as_dvec3();
                off = off.max((p - truth).length() / radius);
            }
            None => lost += 1.0,
        }
    }
    [lost, off]
}

/// A pebble on a planet, and how small it may be where f32 does not tell its points apart.
fn planet(n: usize) -> Table {
    let mut rows = Vec::new();
    for radius in [6.4e3, 6.4e6] {
        rows.push(row(format!("pebble of 1 cm on a planet of {} m", power(radius)), |rung| {
            let n = n / 8;
            let [lost, off] = pebble_seen(rung, radius, 0.01, DVec3::ZERO, n);
            let text = format!("{} lost, off {off:.0e} radii", per_million(lost as usize, n));
            Cell::new(text, rung.is_robust() && lost > 0.0)
        }));
    }
    // Where f32 does not hold a pebble: the origin is elsewhere, and positions are rounded to the planet.
    rows.push(row("the origin in the middle of the planet: smallest pebble", |rung| {
        let planet = 6.4e6;
        let holds = |power: i32| {
            let pebble = planet * f64::exp2(f64::from(-power));
            let [lost, off] = pebble_seen(rung, planet, pebble, DVec3::Y * planet, n / 64);
            lost == 0.0 && off < 0.1
        };
        let power = (1..=40).take_while(|power| holds(*power)).last().unwrap_or(0);
        let ratio = f64::exp2(f64::from(-power));
        Cell::new(format!("{ratio:.0e} of it"), rung.is_robust() && power < 18)
    }));
    Table {
        title: "Huge and tiny in one scene",
        what: "A camera 1 m from the pebble, both near the file's origin: of each million rays those that miss it, and by \
               how much of its radius a hit is off. Red: a ray lost from `robust` on. There f32 has all its digits. \
               Elsewhere positions are rounded to 2⁻²⁴ of their distance from the origin, or, in a scene that is moved, \
               of its extent; the vertices of one mesh are rounded alike. The last row has the origin in the middle of the \
               planet, where a pebble of 1 cm is not held by any rung: it tells the smallest, by halves, to which no ray \
               is lost and whose hits are off by less than a tenth of its radius. Put the origin where the details are. \
               Red: larger than 4·10⁻⁶.",
        columns: Rung::columns(),
        rows,
    }
}

/// Snell's law where it hardly turns light, and where it ceases to let any pass.
fn refraction(n: usize) -> Table {
    let mut rows = Vec::new();
    let mut add = |case: String, text: String, is_red| {
        rows.push(Row { case, cells: vec![Cell::new(text, is_red)] });
    };
    for (name, step) in [("one ulp below", -1), ("at", 0), ("one ulp above", 1)] {
        let (mut cases, mut wrong) = (0, 0);
        for i in 0..n as u32 / 64 {
            let eta = 0.05 + 0.9 * (i as f32 + 0.5) / (n as f32 / 64.0);
            let sine = f32::from_bits(eta.to_bits().wrapping_add_signed(step));
            let cosine = (1.0 - f64::from(sine).powi(2)).sqrt() as f32;
            let passes = refract(Vec3::new(sine, -cosine, 0.0), Vec3::Y, eta).is_some();
            // eta²·|d|² − sine², in whole numbers: multiples of 2⁻³⁰ all three, but for digits of `sine` and
            // `eta` below 0.06 that are not.
            let [s, c, e] = [sine, cosine, eta].map(|x| f64::from(x) * 2f64.powi(30));
            if [s, c, e].iter().any(|x| x.fract() != 0.0) {
                continue;
            }
            let [s, c, e] = [s, c, e].map(|x| x as i128);
            let exact = e * e * (s * s + c * c) - ((s * s) << 60);
            // Nearer to zero than f64 tells apart, either answer is right.
            if exact.unsigned_abs() > 1 << (120 - 49) {
                cases += 1;
                wrong += usize::from(passes != (exact > 0));
            }
        }
        let text = format!("{wrong} of {cases} decided wrongly");
        add(format!("critical angle, {name}"), text, wrong > 0 || cases < n / 200);
    }
    for eta in [1.0, 1.0 + 1e-6f32, 1.0 - 1e-6, 1f32.next_up(), 1f32.next_down()] {
        let mut random = Random(12);
        let (mut turned, mut off) = (0.0f64, 0.0f64);
        for _ in 0..n / 16 {
            let normal = random.direction().as_vec3();
            let mut d = random.direction();
            if random.unit() < 0.25 {
                d -= normal.as_dvec3() * d.dot(normal.as_dvec3()) * random.between(0.99, 1.0);
            }
            let d = d.normalize().as_vec3();
            let (i, m, e) =
                (d.as_dvec3().normalize(), normal.as_dvec3().normalize(), f64::from(eta));
            let cos_i = i.dot(m);
            let tangent = (i - m * cos_i) / e;
            let sine = tangent.length();
            // Total reflection begins 1e-3 off grazing at most.
            if sine > 1.0 - 1e-5 {
                continue;
            }
            let cos_t = ((1.0 - sine) * (1.0 + sine)).sqrt();
            let Some(found) = refract(d, normal, eta) else {
                turned = f64::INFINITY;
                continue;
            };
            let truth = tangent + m * cos_t.copysign(cos_i);
            turned = turned.max((found.direction.as_dvec3() - truth).length());
            let cos_i = cos_i.abs();
            // Fresnel's equations by sines of sums, as tan and sin of θi − θt, which do not cancel.
            let gap = (cos_t * cos_t - cos_i * cos_i) / (cos_t + cos_i);
            let s = (cos_i * (1.0 - e) - e * gap) / (cos_i + e * cos_t);
            let p = (cos_i * (e - 1.0) - gap) / (e * cos_i + cos_t);
            let reflectance = 0.5 * (s * s + p * p);
            off = off.max((f64::from(found.reflectance()) - reflectance).abs());
        }
        let text = format!("turned by {turned:.0e} rad, reflectance off by {off:.0e}");
        let is_red = turned > 1e-6 || off > 1e-6;
        add(format!("index {eta}"), text, is_red);
    }
    Table {
        title: "Refraction",
        what: "Whether light passes at the sine of the critical angle and its neighbours in f32, over indices from 0.05 to 0.95, \
               against whole numbers; and with indices near 1, one in four rays nearly grazing, how far a direction and a \
               reflectance are from Snell's and Fresnel's in f64. Red: a wrong decision, or more than 10⁻⁶.",
        columns: vec!["found".into()],
        rows,
    }
}

/// Something of each kind, lit and shadowed, `scale` times as large and moved by `offset`.
fn still_life(scale: f64, offset: DVec3) -> SceneDesc {
    let at = |x: f64, y: f64, z: f64| offset + DVec3::new(x, y, z) * scale;
    let mut desc = empty();
    desc.image.size = [48, 32];
    desc.settings.samples = 4;
    let mut mesh = ball(24, DVec3::ZERO, 0.6 * scale);
    mesh.origin = at(-0.8, 0.6, 0.0);
    desc.meshes.push(mesh);
    desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), Some("grey")));
    desc.materials.push(MaterialDesc::new(
        "mirror",
        Material::Mirror { reflectance: Rgb::splat(0.9), fresnel: None },
    ));
    desc.objects.push(ObjectDesc {
        material: Some(Reference::new("mirror")),
        ..sphere(at(0.7, 0.5, 0.2), 0.5 * scale)
    });
    let floor = ShapeDesc::Disk {
        center: at(0.0, 0.0, 0.0),
        normal: DVec3::Y,
        radius: 4.0 * scale,
        inner_radius: 0.0,
    };
    desc.objects.push(ObjectDesc::new(floor, Some("grey")));
    // Copies, one of them turned.
    let ball = ObjectDesc::new(
        ShapeDesc::Box(Bounds { min: DVec3::splat(-0.2 * scale), max: DVec3::splat(0.2 * scale) }),
        Some("grey"),
    );
    let objects =
        vec![ObjectDesc { transform: DAffine3::from_translation(at(0.0, 0.25, 0.0)), ..ball }];
    let name = "boxes".to_owned();
    desc.prototypes.push(PrototypeDesc { name, at: Location::default(), objects });
    let moved = |x: f64, z: f64| DAffine3::from_translation(DVec3::new(x, 0.0, z) * scale);
    let turned = DAffine3::from_translation(offset)
        * moved(-1.3, 1.2)
        * DAffine3::from_rotation_y(0.6)
        * DAffine3::from_translation(-offset);
    let transforms = vec![moved(0.1, 1.2), turned];
    let copies = ShapeDesc::Instances { prototype: Reference::new("boxes"), transforms };
    desc.objects.push(ObjectDesc::new(copies, None));
    let camera = look(at(0.3, 1.6, 4.0), at(0.0, 0.5, 0.0), 0.7);
    let lens = Some(LensDesc { radius: 0.02 * scale, focus_distance: None });
    desc.camera = Some(CameraDesc { lens, ..camera });
    desc.fog = Some(Fog {
        scattering: Rgb::splat((0.05 / scale) as f32),
        absorption: Rgb::BLACK,
        radiance: Rgb::splat(0.3),
        profile: FogProfile::Height { base: offset.y + 0.3 * scale, height: scale },
        dims_lights: true,
    });

    // A cloud, denser to one side.
    let value = |i: usize, j: usize, _| i as f32 / 4.0 + j as f32 / 8.0;
    let node = |value: f64, extinction: f64| TransferNode {
        value,
        color: [0.4; 3],
        extinction: extinction / scale,
    };
    let transfer = TransferFunction::new(vec![node(0.0, 0.0), node(1.0, 4.0)]).unwrap();
    desc.volumes.push(VolumeDesc {
        at: Location::default(),
        grid: Arc::new(Grid::from_fn([4; 3], value).unwrap()),
        bounds: Bounds { min: DVec3::ZERO, max: DVec3::splat(0.6 * scale) },
        transform: DAffine3::from_translation(at(0.5, 0.0, 1.2)),
        transfer: Arc::new(transfer),
        tolerance: 1e-3,
    });

    let intensity = Rgb::splat((40.0 * scale * scale) as f32);
    let radiance = Rgb::splat(20.0);
    desc.lights.push(LightDesc::Point {
        position: at(2.0, 4.0, 3.0),
        intensity,
        falloff: Falloff::InverseSquare,
    });
    desc.lights.push(LightDesc::Spot {
        position: at(-3.0, 4.0, 2.0),
        direction: DVec3::new(2.5, -3.8, -1.5),
        intensity,
        cone_angle: 0.5,
        penumbra_angle: 0.2,
    });
    desc.lights.push(LightDesc::Rectangle {
        corner: at(-2.0, 3.0, -1.0),
        edge_u: DVec3::X * 0.5 * scale,
        edge_v: DVec3::Z * 0.5 * scale,
        radiance,
    });
    desc.lights.push(LightDesc::Disk {
        center: at(2.0, 3.0, -1.0),
        normal: DVec3::NEG_Y,
        radius: 0.3 * scale,
        radiance,
    });
    let center = at(0.0, 4.0, 2.0);
    desc.lights.push(LightDesc::Sphere { center, radius: 0.3 * scale, radiance });
    desc
}

fn moved_pictures() -> Table {
    let picture = |rung: Rung, scale: f64, offset: f64| {
        let offset = DVec3::new(offset, -2.0 * offset, 3.0 * offset);
        let scene = rung.scene(still_life(scale, offset));
        render(&scene, &RenderJob::default(), &()).film.mean
    };
    let cases = [
        (1e-6, 0.0),
        (1e-3, 0.0),
        (1e3, 0.0),
        (1e6, 0.0),
        (1.0, 1e2),
        (1.0, 1e4),
        (1.0, 1e6),
        (1.0, 1e8),
    ];
    let rows = cases.map(|(scale, offset)| {
        row(format!("scale {}, offset {}", power(scale), power(offset)), |rung| {
            let (a, b) = (picture(rung, scale, offset), picture(rung, 1.0, 0.0));
            let squares = a.iter().zip(&b).flat_map(|(a, b)| {
                let pairs = a.to_array().into_iter().zip(b.to_array());
                pairs.map(|(a, b)| (f64::from(a), f64::from(b)))
            });
            let sum: f64 = squares.map(|(a, b)| (a - b).powi(2) / (b * b + 0.01)).sum();
            let relmse = sum / (3 * b.len()) as f64;
            let is_lit = b.iter().any(|c| c.g > 0.1);
            Cell::new(format!("{relmse:.0e}"), !(relmse <= 1e-6) || !is_lit)
        })
    });
    Table {
        title: "Scenes of any size, anywhere",
        what: "A mesh, a mirror ball, copies of a box, a floor, a lamp of each kind, shadows, a lens, fog and a cloud, made larger and \
               moved as a whole: relMSE against the picture at the origin, with the same seed. Red: above 10⁻⁶.",
        columns: Rung::columns(),
        rows: rows.into(),
    }
}

/// Scenes that are hardly any: each renders, and its middle is what it must be.
fn odd_scenes() -> Table {
    let middle = |rung: Rung, desc: SceneDesc| -> [f32; 3] {
        let size = desc.image.size;
        let scene = rung.scene(desc);
        let film = render(&scene, &RenderJob::default(), &()).film;
        assert!(film.mean.iter().all(|c| c.is_finite()));
        film.pixel(size[0] / 2, size[1] / 2).unwrap().to_array()
    };
    /// A disk of reflectance 0.5 under a sun straight above with irradiance π·`light`: radiance 0.5·`light`.
    fn lit(light: f64) -> SceneDesc {
        let mut desc = empty();
        desc.camera = Some(look(DVec3::new(0.0, 5.0, 0.0), DVec3::ZERO, 0.2));
        let disk = ShapeDesc::Disk {
            center: DVec3::ZERO,
            normal: DVec3::Y,
            radius: 2.0,
            inner_radius: 0.0,
        };
        desc.objects.push(ObjectDesc::new(disk, Some("grey")));
        let irradiance = Rgb::splat((light * PI) as f32);
        desc.lights.push(LightDesc::Directional { direction: DVec3::NEG_Y, irradiance });
        desc
    }
    let near = |found: [f32; 3], expected: f64| {
        let off = found.map(|x| (f64::from(x) - expected).abs() / expected.abs().max(1e-38));
        off.into_iter().fold(0.0, f64::max)
    };
    let mut rows = Vec::new();
    const ROUNDED: f64 = 1e-4;
    const DRAWN: f64 = 5e-3;
    let mut add = |case: &str, make: &dyn Fn() -> SceneDesc, expected: f64, limit: f64| {
        rows.push(row(case, |rung| {
            let off = near(middle(rung, make()), expected);
            Cell::new(
                if off < limit { "right".into() } else { format!("off by {off:.1e}") },
                off >= limit,
            )
        }));
    };
    for light in [1e-30, 1.0, 1e30] {
        add(&format!("light of {light:.0e}"), &|| lit(light), 0.5 * light, ROUNDED);
    }
    let with_mesh = |xyz: Vec<f32>, triangles: Vec<[u32; 3]>| {
        let mut desc = lit(1.0);
        desc.meshes.push(TriangleMesh::new(xyz, triangles));
        desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), Some("grey")));
        desc
    };
    // Above the floor, in the way if they could be hit.
    let point = || with_mesh(vec![0.0, 1.0, 0.0], vec![[0, 0, 0]; 3]);
    add("triangles that are points", &point, 0.5, ROUNDED);
    let line = || with_mesh(vec![-1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0], vec![[0, 1, 2]]);
    add("a triangle that is a line", &line, 0.5, ROUNDED);
    let tiny = 1e-40;
    let denormal =
        || with_mesh(vec![0.3, 1.0, 0.0, 0.3 + tiny, 1.0, 0.0, 0.3, 1.0, tiny], vec![[0, 1, 2]]);
    add("a triangle of denormal size", &denormal, 0.5, ROUNDED);
    let nothing = || {
        let mut desc = empty();
        desc.image.background = Some(Rgb::splat(0.5));
        desc
    };
    add("nothing but a background", &nothing, 0.5, ROUNDED);
    add("a mesh without triangles", &|| with_mesh(vec![0.0, 1.0, 0.0], Vec::new()), 0.5, ROUNDED);
    let doubled = || {
        let xyz = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0f32]];
        let xyz: Vec<f32> = xyz.iter().chain(&xyz).flat_map(|[x, z]| [*x, 0.0, *z]).collect();
        with_mesh(xyz, vec![[0, 2, 1], [0, 3, 2], [4, 6, 5], [4, 7, 6], [0, 6, 1]])
    };
    add("a square twice in the floor", &doubled, 0.5, ROUNDED);
    add(
        "a copy of no size in the way",
        &|| {
            let mut desc = lit(1.0);
            desc.objects.push(ObjectDesc {
                transform: DAffine3::from_scale_rotation_translation(
                    DVec3::splat(1e-30),
                    glam::DQuat::IDENTITY,
                    DVec3::Y,
                ),
                ..sphere(DVec3::ZERO, 1.0)
            });
            desc
        },
        0.5,
        ROUNDED,
    );
    add(
        "a camera in a solid ball",
        &|| {
            let mut desc = empty();
            desc.objects.push(sphere(DVec3::ZERO, 1.0));
            desc.ambient = Some(Rgb::splat(1.0));
            desc.camera = Some(look(DVec3::ZERO, DVec3::Z, 0.5));
            desc
        },
        0.5,
        ROUNDED,
    );
    add(
        "a lamp on the floor, seen by it alone",
        &|| {
            let mut desc = lit(1.0);
            desc.lights.push(LightDesc::Point {
                position: DVec3::new(0.5, 0.0, 0.0),
                intensity: Rgb::splat(1.0),
                falloff: Falloff::InverseSquare,
            });
            desc
        },
        0.5,
        ROUNDED,
    );
    add(
        "one pixel",
        &|| {
            let mut desc = lit(1.0);
            desc.image.size = [1, 1];
            desc
        },
        0.5,
        ROUNDED,
    );
    add(
        "32768 × 64 pixels",
        &|| {
            let mut desc = lit(1.0);
            desc.image.size = [32768, 64];
            desc
        },
        0.5,
        ROUNDED,
    );
    add(
        "no lights, but ambient light",
        &|| {
            let mut desc = lit(1.0);
            desc.lights.clear();
            desc.ambient = Some(Rgb::splat(1.0));
            desc
        },
        0.5,
        ROUNDED,
    );
    add(
        "100,000 lamps",
        &|| {
            let mut desc = lit(1.0);
            let lamp = |i: u32| LightDesc::Point {
                position: DVec3::new(f64::from(i % 300) * 1e-3, 100.0, f64::from(i / 300) * 1e-3),
                intensity: Rgb::splat((0.1 * PI) as f32),
                falloff: Falloff::InverseSquare,
            };
            desc.lights = (0..100_000).map(lamp).collect();
            desc
        },
        0.5,
        DRAWN,
    );
    for ior in [1.0, 1.0 + 1e-6, 1.0 - 1e-6] {
        let through = || {
            let mut desc = lit(1.0);
            desc.lights.clear();
            desc.ambient = Some(Rgb::splat(1.0));
            let glass = Dielectric {
                ior: Ior::Constant(ior),
                absorption: Rgb::BLACK,
                priority: 0,
                fresnel: FresnelModel::Exact,
            };
            desc.materials.push(MaterialDesc::new("glass", Material::Dielectric(glass)));
            let ball = sphere(DVec3::new(0.1, 2.0, 0.0), 1.0);
            desc.objects.push(ObjectDesc { material: Some(Reference::new("glass")), ..ball });
            desc
        };
        add(&format!("seen through a ball of index {ior}"), &through, 0.5, ROUNDED);
    }
    let (share, depth) = (0.999f32, 10_000);
    let mirrors = || {
        let mut desc = empty();
        let mirror = Material::Mirror { reflectance: Rgb::splat(share), fresnel: None };
        let emission = Rgb::splat(0.01);
        desc.materials.push(MaterialDesc { emission, ..MaterialDesc::new("mirror", mirror) });
        for (y, normal) in [(0.0, DVec3::Y), (2.0, DVec3::NEG_Y)] {
            let center = DVec3::new(0.0, y, 0.0);
            let disk = ShapeDesc::Disk { center, normal, radius: 2.0, inner_radius: 0.0 };
            desc.objects.push(ObjectDesc::new(disk, Some("mirror")));
        }
        desc.camera = Some(look(DVec3::Y, DVec3::ZERO, 1e-6));
        desc.settings.max_depth = depth;
        desc.settings.prune = 0.0;
        desc
    };
    let share = f64::from(share);
    let series = 0.01 * (1.0 - share.powi(depth as i32 + 1)) / (1.0 - share);
    add("10,000 reflections between two mirrors", &mirrors, series, ROUNDED);
    let long = || {
        let mut desc = lit(0.2);
        desc.image.size = [1, 1];
        desc.settings.samples = 1_000_000;
        desc
    };
    add("a sum of a million samples", &long, 0.1, 1e-6);
    Table {
        title: "Odd scenes",
        what: "Each renders without a value that is not finite, and the pixel in the middle is what the closed form says, \
               within 10⁻⁴ (lights that are drawn: half a percent; the long sum: 10⁻⁶). Red: it is not.",
        columns: Rung::columns(),
        rows,
    }
}
