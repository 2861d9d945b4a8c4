//! Numerics at the extremes: each row a case, each cell a rung of precision of an accelerator, against
//! closed forms and f64. `benches/extremes.rs` prints them all; `tests/extremes.rs` asserts that none is
//! red.
#![allow(clippy::print_stderr, reason = "a test program")]

mod odd;
mod pictures;
mod planet;
mod points;
mod refraction;
mod surfaces;
mod triangles;

use std::fmt::Write;
use std::time::Instant;

use alhazen::accel::{Accel, AccelKind, BuildOptions, Precision, World};
use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::film::Filter;
use alhazen::geometry::{Quadric, TriangleMesh};
use alhazen::material::Material;
use alhazen::math::Bounds;
use alhazen::scene::{
    CameraDesc, Location, MaterialDesc, ObjectDesc, PlaceDesc, PrototypeDesc, Reference, Scene,
    SceneDesc, ShapeDesc,
};
use glam::{DAffine3, DVec3};

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
    let all: [&dyn Fn() -> Table; 12] = [
        &|| triangles::leaks(n),
        &|| triangles::double_hits(n),
        &|| surfaces::far_cameras(n),
        &|| surfaces::grazing(n),
        &|| points::points(n),
        &|| surfaces::self_hits(n),
        &|| triangles::stacked(n),
        &|| triangles::slivers(n),
        &|| planet::planet(n),
        &|| refraction::refraction(n),
        &pictures::moved_pictures,
        &odd::odd_scenes,
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
    crate::common::ball(rings, center, radius, 0.0)
}

/// An object made of a mesh.
fn add_mesh(desc: &mut SceneDesc, mesh: TriangleMesh) {
    desc.meshes.push(mesh);
    let shape = ShapeDesc::Mesh(desc.meshes.len() - 1);
    desc.objects.push(ObjectDesc::new(shape, Some("grey")));
}

/// Copies of an object.
fn add_copies(desc: &mut SceneDesc, object: ObjectDesc, transforms: Vec<DAffine3>) {
    let (name, at) = ("copied".to_owned(), Location::default());
    desc.prototypes.push(PrototypeDesc { name, at, objects: vec![object] });
    let shape = ShapeDesc::Instances { prototype: Reference::new("copied"), transforms };
    desc.objects.push(ObjectDesc::new(shape, None));
}

/// Where k·(p − `center`)² = 1, all of which lies in `bounds`.
fn ellipsoid(k: DVec3, center: DVec3, bounds: Bounds) -> ShapeDesc {
    let linear = k * center * -2.0;
    let constant = -0.5 * linear.dot(center) - 1.0;
    let [x, y, z] = linear.to_array();
    ShapeDesc::Quadric(Quadric::new([k.x, k.y, k.z, 0.0, 0.0, 0.0, x, y, z, constant], bounds))
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
