//! Shapes by two programs: where POV-Ray has the same shape, it and Alhazen look at it through the same
//! camera, a ray through the middle of each pixel, and are compared in what each ray hits, how far away,
//! and in the normal there.
//!
//! POV-Ray renders two pictures of each shape. In the first the surface gives off the inverse of its
//! distance, as two channels that together have 24 bits; in the second it is lit by three parallel lights of
//! a channel each. Ours are taken from the ray queries themselves.
#![allow(missing_docs, clippy::print_stderr, reason = "a test program")]

#[path = "povray/program.rs"]
mod program;

use std::fmt::Write as _;

use alhazen::accel::{Accel, AccelKind, RayQuery as _};
use alhazen::color::Rgb;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::math::Ray;
use alhazen::scene::Scene;
use glam::{DVec2, DVec3, dvec3};

const SIZE: [u32; 2] = [96, 72];
/// Vertical angle of view.
const FOV: f64 = 36.0;
const EYE: DVec3 = dvec3(1.7, 2.3, 4.6);
/// Leaning, so that no edge runs along rows or columns.
const UP: DVec3 = dvec3(0.2, 1.0, 0.1);
/// From where the lights come, one for each channel: together they light nearly all that the camera sees.
const LIGHTS: [DVec3; 3] = [dvec3(3.0, 0.5, 3.0), dvec3(-2.0, 1.5, 3.0), dvec3(0.5, 4.0, 1.0)];

/// How many steps of the fine channel of inverse distance go into one of the coarse one.
const FINE: f64 = 256.0;
/// What the fine channel resolves of the inverse distance: a step, as it is not known how POV-Ray rounds.
const STEP: f64 = 1.0 / (65535.0 * FINE);

/// A ray that meets a surface at less than this cosine is at an outline: what is said here of errors no
/// longer holds, and a wrong normal must not excuse a wrong distance.
const GRAZING: f64 = 0.02;

/// One shape, in the words of both programs.
#[derive(Clone, Copy)]
struct Case<'a> {
    name: &'a str,
    /// The fields of our object.
    ours: &'a str,
    theirs: &'a str,
    /// Where both place it: the rows of an affine map.
    frame: Option<[[f64; 4]; 3]>,
    accepted: Accepted,
}

/// How far the programs may be apart.
#[derive(Clone, Copy)]
struct Accepted {
    /// How far the surfaces are from each other, where both are hit.
    off: f64,
    /// The length by which normals differ.
    turned: f64,
    /// Pixels at outlines that may be on either side of them.
    edge: usize,
}

/// Both solve the shape itself. Our rays are of 32 bits: the directions, the distances and the origin are each
/// off by up to 6e-8 of a distance of 6 or so. Normals are off by what 16 bits leave of the cosine to each
/// of the lights. Measured: 2.7e-7, 1.2e-5, and no pixel at an outline.
const EXACT: Accepted = Accepted { off: 5e-7, turned: 3e-5, edge: 2 };

/// A map that turns, stretches, shears and moves.
const FRAME: [[f64; 4]; 3] =
    [[0.9, 0.35, -0.2, 0.1], [-0.25, 0.7, 0.4, -0.1], [0.3, -0.1, 1.1, 0.2]];

const fn case<'a>(name: &'a str, ours: &'a str, theirs: &'a str) -> Case<'a> {
    Case { name, ours, theirs, frame: None, accepted: EXACT }
}

impl Case<'_> {
    const fn framed(self) -> Self {
        Self { frame: Some(FRAME), ..self }
    }

    const fn accept(self, off: f64, turned: f64) -> Self {
        Self { accepted: Accepted { off, turned, edge: EXACT.edge }, ..self }
    }
}

/// What the ray of a pixel sees.
#[derive(Clone, Copy)]
struct Seen {
    distance: f64,
    /// Cosines of the normal on the viewer's side to the three lights; 0 where it turns from them.
    lit: DVec3,
    /// Cosine of the normal to the ray; at least [`GRAZING`].
    facing: f64,
}

fn ours(case: &Case<'_>) -> Vec<Option<Seen>> {
    let [w, h] = SIZE;
    let list = |v: DVec3| format!("{:?}", v.to_array());
    let mut text = format!(
        "[image]\nsize = [{w}, {h}]\n[camera]\neye = {}\ntarget = [0, 0, 0]\nup = {}\nfov = {FOV}\n\
         [[objects]]\n{}\n",
        list(EYE),
        list(UP),
        case.ours
    );
    if let Some(rows) = case.frame {
        let numbers = rows.as_flattened();
        writeln!(text, "transform = [{{ matrix = [{}, 0, 0, 0, 1] }}]", joined(numbers)).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, &text).unwrap();
    let loaded =
        load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let scene = Scene::build_quietly(loaded.scene, AccelKind::default())
        .unwrap_or_else(|e| panic!("{e:?}\n{text}"));
    let intersect = |ray: &Ray| match &scene.accel {
        #[cfg(feature = "embree")]
        Accel::Embree(accel) => accel.intersect(ray),
        Accel::Bvh(accel) => accel.intersect(ray),
        Accel::Brute(accel) => accel.intersect(ray),
    };
    let seen = |x: u32, y: u32| {
        let film = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let (_, direction) = scene.camera.ray_f64(film);
        let ray = scene.camera.ray(film, [0.5; 2])?;
        let point = scene.surface(&ray, &intersect(&ray)?);
        let distance = (point.position.as_dvec3() + scene.center - EYE).length();
        let normal = point.normal.as_dvec3();
        let lit = LIGHTS.map(|light| normal.dot(light.normalize()).max(0.0));
        Some(Seen { distance, lit: lit.into(), facing: (-normal.dot(direction)).max(GRAZING) })
    };
    (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| seen(x, y)).collect()
}

/// What POV-Ray renders: all numbers as they are, in a right-handed space.
fn theirs(case: &Case<'_>) -> String {
    let [w, h] = SIZE.map(f64::from);
    // POV-Ray's angle is the horizontal one.
    let angle = 2.0 * ((0.5 * FOV).to_radians().tan() * w / h).atan().to_degrees();
    let vector = |v: DVec3| format!("<{}>", joined(&v.to_array()));
    let [x, y, z] = EYE.to_array();
    let place = case.frame.map_or_else(String::new, |rows| {
        // Column by column.
        let columns = [0, 1, 2, 3].map(|i| joined(&rows.map(|row| row[i])));
        format!("matrix <{}>", columns.join(", "))
    });
    let mut text = format!(
        "#version 3.7;
global_settings {{ assumed_gamma 1.0 }}
background {{ rgb 0 }}
camera {{ perspective location {} right -x*{} up y sky {} angle {angle} look_at 0 }}
#declare Inverse = function {{ 1/sqrt(pow(x - {x}, 2) + pow(y - {y}, 2) + pow(z - {z}, 2)) }}
",
        vector(EYE),
        w / h,
        vector(UP),
    );
    for (light, color) in LIGHTS.into_iter().zip(["x", "y", "z"]) {
        let at = vector(light * 1e3);
        writeln!(text, "light_source {{ {at} rgb {color} parallel point_at 0 shadowless }}")
            .unwrap();
    }
    // A pattern counts modulo 1, and the colours of an average are each a third.
    write!(
        text,
        "object {{ {} {place}
#if (frame_number = 1)
  pigment {{ average pigment_map {{
    [1 function {{ Inverse(x, y, z) }} color_map {{ [0 rgb 0] [1 rgb 3*x] }}]
    [1 function {{ {FINE}*Inverse(x, y, z) }} color_map {{ [0 rgb 0] [1 rgb 3*y] }}]
    [1 rgb 3*z]
  }} }}
  finish {{ emission 1 ambient 0 diffuse 0 }}
#else
  pigment {{ rgb 1 }}
  finish {{ ambient 0 diffuse 1 }}
#end
}}
",
        case.theirs
    )
    .unwrap();
    text
}

fn joined(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
}

/// Distance, and the cosines to the lights.
fn read(inverse: Rgb, lit: Rgb) -> Option<(f64, DVec3)> {
    let [coarse, fine, hit] = inverse.to_array().map(f64::from);
    let turns = (coarse * FINE - fine).round();
    let lit = DVec3::from_array(lit.to_array().map(f64::from));
    (hit > 0.5).then(|| (FINE / (turns + fine), lit))
}

/// The worst of all pixels.
#[derive(Default)]
struct Worst {
    hits: usize,
    off: f64,
    turned: f64,
    edge: usize,
}

/// Compares every pixel. One that differs must be at an outline, of the whole or of a part: what we see must
/// not be beyond what POV-Ray sees around it.
fn compare(case: &Case<'_>) -> Worst {
    let frames = program::pictures(&theirs(case), SIZE, 2);
    let theirs: Vec<_> = frames[0].iter().zip(&frames[1]).map(|(a, b)| read(*a, *b)).collect();
    let Case { name, accepted, .. } = *case;
    let [w, h] = SIZE.map(|side| side as usize);
    let mut worst = Worst::default();
    let far = |pixel: Option<f64>| pixel.unwrap_or(f64::INFINITY);
    for (i, seen) in ours(case).into_iter().enumerate() {
        if let (Some(seen), Some((distance, lit))) = (seen, theirs[i]) {
            let gap = (seen.distance - distance).abs() - STEP * distance * distance;
            // Across the surface, as a ray that grazes it goes on along it; and nearer for the rays of
            // what is far away.
            let off = gap.max(0.0) * seen.facing / (distance / EYE.length()).max(1.0);
            if off <= accepted.off {
                worst.hits += 1;
                worst.off = worst.off.max(off);
                let turned = (seen.lit - lit).length() * seen.facing;
                worst.turned = worst.turned.max(turned);
                continue;
            }
        } else if seen.is_none() && theirs[i].is_none() {
            continue;
        }
        worst.edge += 1;
        let (x, y) = (i % w, i / w);
        let rows = y.saturating_sub(1)..(y + 2).min(h);
        let around =
            rows.flat_map(|y| (x.saturating_sub(1)..(x + 2).min(w)).map(move |x| y * w + x));
        let around = around.filter(|&j| j != i).map(|j| far(theirs[j].map(|(d, _)| d)));
        let [near, end] = around.fold([f64::INFINITY, 0.0], |[a, b], d| [d.min(a), d.max(b)]);
        let (mine, other) = (far(seen.map(|s| s.distance)), far(theirs[i].map(|(d, _)| d)));
        let within = (near..=end).contains(&mine);
        assert!(
            within,
            "{name}: at {x}, {y} we see {mine}, POV-Ray {other}, around {near} to {end}"
        );
    }
    let Worst { hits, off, turned, edge } = worst;
    eprintln!("{name}: {hits} pixels, off {off:.1e}, normals {turned:.1e}, {edge} at edges");
    worst
}

/// Compares every shape; POV-Ray mostly waits, so all at once.
fn check(cases: &[Case<'_>]) {
    if !program::povray() {
        return;
    }
    let found: Vec<Worst> = std::thread::scope(|scope| {
        let started: Vec<_> = cases.iter().map(|case| scope.spawn(|| compare(case))).collect();
        started.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for (case, worst) in cases.iter().zip(found) {
        let Accepted { turned, edge, .. } = case.accepted;
        assert!(worst.hits > 400, "{}: {} pixels", case.name, worst.hits);
        assert!(worst.turned <= turned, "{}: normals {}", case.name, worst.turned);
        assert!(worst.edge <= edge, "{}: {} pixels", case.name, worst.edge);
    }
}

#[test]
fn spheres() {
    let unit = case("ellipsoid", "shape = \"sphere\"\nradius = 1", "sphere { 0, 1 }");
    check(&[
        case(
            "sphere",
            "shape = \"sphere\"\ncenter = [0.1, -0.2, 0.3]\nradius = 1.1",
            "sphere { <0.1, -0.2, 0.3>, 1.1 }",
        ),
        unit.framed(),
    ]);
}

#[test]
fn boxes() {
    let plain = case(
        "box",
        "shape = \"box\"\nmin = [-0.9, -0.8, -0.5]\nmax = [0.7, 0.6, 1.0]",
        "box { <-0.9, -0.8, -0.5>, <0.7, 0.6, 1.0> }",
    );
    check(&[plain, Case { name: "sheared box", ..plain }.framed()]);
}

#[test]
fn cylinders_and_cones() {
    let ends = "from = [-0.8, -0.7, 0.2]\nto = [0.6, 0.9, 0.4]";
    let [from, to] = ["<-0.8, -0.7, 0.2>", "<0.6, 0.9, 0.4>"];
    let ours = |kind: &str, rest: &str| format!("shape = \"{kind}\"\n{ends}\n{rest}");
    let cylinder = ours("cylinder", "radius = 0.6");
    let pipe = ours("cylinder", "radius = 0.6\ncaps = false");
    let cone = ours("cone", "radius = 0.8");
    let truncated = ours("cone", "radii = [0.3, 0.8]");
    let funnel = ours("cone", "radii = [0.4, 0.9]\ncaps = false");
    let [their_cylinder, their_pipe] =
        ["", "open"].map(|open| format!("cylinder {{ {from}, {to}, 0.6 {open} }}"));
    let [their_cone, their_truncated, their_funnel] =
        [("0.8", "0", ""), ("0.3", "0.8", ""), ("0.4", "0.9", "open")]
            .map(|(a, b, open)| format!("cone {{ {from}, {a}, {to}, {b} {open} }}"));
    let sheared = Case { name: "sheared cone", ..case("", &truncated, &their_truncated) };
    check(&[
        case("cylinder", &cylinder, &their_cylinder),
        case("open cylinder", &pipe, &their_pipe),
        case("cone", &cone, &their_cone),
        case("truncated cone", &truncated, &their_truncated),
        case("open truncated cone", &funnel, &their_funnel),
        sheared.framed(),
    ]);
}

/// Solved by Sturm's chains there.
#[test]
fn tori() {
    let torus = case(
        "torus",
        "shape = \"torus\"\nmajor_radius = 1.0\nminor_radius = 0.35",
        "torus { 1.0, 0.35 sturm }",
    );
    let spindle = case(
        "spindle torus",
        "shape = \"torus\"\nmajor_radius = 0.4\nminor_radius = 0.7",
        "torus { 0.4, 0.7 sturm }",
    );
    check(&[torus, Case { name: "sheared torus", ..torus }.framed(), spindle]);
}

#[test]
fn flat_shapes() {
    let outline = "[-1, -1, 0], [1.1, -0.9, 0], [0.9, 0.8, 0], [0.1, 0.2, 0], [-0.8, 1, 0]";
    let hole = "[-0.6, -0.6, 0], [0.5, -0.5, 0], [-0.4, 0.2, 0]";
    let polygon = format!("shape = \"polygon\"\npoints = [{outline}]\nholes = [[{hole}]]");
    check(&[
        case(
            "ring",
            "shape = \"disk\"\ncenter = [0.1, 0, 0]\nnormal = [0.3, 1, 0.4]\nradius = 1.3\ninner_radius = 0.4",
            "disc { <0.1, 0, 0>, <0.3, 1, 0.4>, 1.3, 0.4 }",
        ),
        // Up to the horizon, which is in the picture.
        case(
            "plane",
            "shape = \"plane\"\npoint = [0, -0.5, 0]\nnormal = [0.1, 1, -0.25]",
            "plane { <0.1, 1, -0.25>, 0 translate <0, -0.5, 0> }",
        ),
        case(
            "polygon",
            &polygon,
            "polygon { 10, <-1, -1>, <1.1, -0.9>, <0.9, 0.8>, <0.1, 0.2>, <-0.8, 1>, <-1, -1>, \
             <-0.6, -0.6>, <0.5, -0.5>, <-0.4, 0.2>, <-0.6, -0.6> }",
        )
        .framed(),
    ]);
}

/// Cut by a box in both.
#[test]
fn quadrics() {
    let kinds = [
        ("hyperboloid", [1.0, -0.5, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.2]),
        ("two sheets", [1.0, -1.2, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1]),
        // Without y² POV-Ray 3.7 loses most hits of this one: 117 pixels of 889.
        ("paraboloid", [1.0, 1e-9, 1.0, 0.0, 0.0, 0.0, 0.0, -0.8, 0.0, -0.5]),
        ("saddle", [1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0]),
        ("mixed quadric", [0.9, 0.4, -0.7, 0.5, -0.3, 0.8, 0.2, -0.1, 0.3, -0.3]),
    ];
    let texts = kinds.map(|(name, c)| {
        let ours = format!(
            "shape = \"quadric\"\ncoefficients = [{}]\nbounds = [[-1, -0.9, -0.8], [1, 0.9, 0.8]]",
            joined(&c)
        );
        let theirs = format!(
            "quadric {{ <{}>, <{}>, <{}>, {} clipped_by {{ box {{ <-1, -0.9, -0.8>, <1, 0.9, 0.8> }} }} }}",
            joined(&c[..3]),
            joined(&c[3..6]),
            joined(&c[6..9]),
            c[9]
        );
        (name, ours, theirs)
    });
    let mut cases: Vec<_> =
        texts.iter().map(|(name, ours, theirs)| case(name, ours, theirs)).collect();
    cases.push(Case { name: "sheared quadric", ..cases[0] }.framed());
    check(&cases);
}

/// POV-Ray halves intervals until they are as short as `accuracy`.
#[test]
fn implicit_surfaces() {
    let ours = |expression: &str, size: f64| {
        format!(
            "shape = \"implicit\"\nexpression = \"{expression}\"\nbounds = [[-{size}, -{size}, -{size}], [{size}, {size}, {size}]]"
        )
    };
    let theirs = |function: &str, size: f64, gradient: f64| {
        format!(
            "isosurface {{ function {{ {function} }} threshold 0 accuracy 1e-6 max_gradient {gradient} \
             contained_by {{ box {{ -{size}, {size} }} }} open }}"
        )
    };
    let gyroid = ours("sin(4*x)*cos(4*y) + sin(4*y)*cos(4*z) + sin(4*z)*cos(4*x)", 1.0);
    let their_gyroid =
        theirs("sin(4*x)*cos(4*y) + sin(4*y)*cos(4*z) + sin(4*z)*cos(4*x)", 1.0, 12.0);
    let tangle = ours("(x^4 + y^4 + z^4)*16 - 5*(x^2 + y^2 + z^2)*4 + 11.8", 1.3);
    let their_tangle =
        theirs("(pow(x,4) + pow(y,4) + pow(z,4))*16 - 5*(x*x + y*y + z*z)*4 + 11.8", 1.3, 200.0);
    // Its roundness is 0.5 and 1.6.
    let superellipsoid =
        ours("(abs(x)^(2/0.5) + abs(y)^(2/0.5))^(0.5/1.6) + abs(z)^(2/1.6) - 1", 1.01);
    // Densities of three balls, each (1 − d²/r²)².
    let balls = [([-0.5, -0.3, 0.2], 1.0), ([0.6, 0.1, -0.1], 0.9), ([0.0, 0.7, 0.3], 0.8)];
    let density = |([x, y, z], r): ([f64; 3], f64)| {
        format!("max(0, 1 - ((x - {x})^2 + (y - {y})^2 + (z - {z})^2)/{})^2", r * r)
    };
    let ball = |(c, r): ([f64; 3], f64)| format!("sphere {{ <{}>, {r}, 1 }}", joined(&c));
    let blob = ours(&format!("0.4 - {}", balls.map(density).join(" - ")), 1.6);
    let their_blob = format!("blob {{ threshold 0.4 {} sturm }}", balls.map(ball).join(" "));
    check(&[
        case("gyroid", &gyroid, &their_gyroid).accept(1e-6, 3e-5),
        case("tangle", &tangle, &their_tangle).accept(1e-6, 3e-5),
        case("superellipsoid", &superellipsoid, "superellipsoid { <0.5, 1.6> }").accept(1e-6, 3e-5),
        case("blob", &blob, &their_blob),
    ]);
}

/// Triangles in both programs, but not the same ones. POV-Ray makes up to 256 × 256 cells: with half as many
/// along each side it is four times as far off, and ours of a tolerance of 1e-4 m is no farther.
#[test]
fn patches() {
    let points = [
        [-1.2, -1.0, 0.1],
        [-0.4, -1.1, 0.6],
        [0.4, -1.0, 0.9],
        [1.1, -0.9, 0.0],
        [-1.1, -0.3, 0.7],
        [-0.4, -0.4, 1.4],
        [0.5, -0.3, -0.6],
        [1.2, -0.4, 0.5],
        [-1.0, 0.4, 0.4],
        [-0.3, 0.5, -0.8],
        [0.4, 0.3, 1.2],
        [1.0, 0.4, 0.3],
        [-1.1, 1.0, 0.0],
        [-0.5, 1.1, 0.4],
        [0.3, 1.0, -0.3],
        [1.2, 1.1, 0.2],
    ];
    let ours = format!("shape = \"patches\"\npoints = {points:?}\ntolerance = \"0.0001 m\"");
    let listed = points.map(|p| format!("<{}>", joined(&p))).join(", ");
    let theirs = format!("bicubic_patch {{ type 1 flatness 0 u_steps 8 v_steps 8 {listed} }}");
    check(&[case("Bézier patch", &ours, &theirs).accept(1e-4, 2e-4)]);
}

/// A quarter of a cylinder, finely: triangles that are too narrow would be hit far off.
#[test]
fn nurbs() {
    let ours =
        "shape = \"nurbs\"\ndegree = [2, 1]\nknots_u = [0, 0, 0, 1, 1, 1]\nknots_v = [0, 0, 1, 1]
points = [[[1, 0, -1], [1, 1, -1], [0, 1, -1]], [[1, 0, 1], [1, 1, 1], [0, 1, 1]]]
weights = [[1, 0.7071067811865476, 1], [1, 0.7071067811865476, 1]]
tolerance = \"0.0001 m\"";
    let theirs = "cylinder { -z, z, 1 open clipped_by { box { <0, 0, -2>, <2, 2, 2> } } }";
    check(&[case("NURBS", ours, theirs).accept(1.2e-4, 1e-3)]);
}

#[test]
fn meshes() {
    let corners =
        [[0.0, 1.2, 0.1], [1.0, -0.5, 0.4], [-0.9, -0.6, 0.7], [0.1, -0.4, -1.1], [0.3, 0.5, 1.2]];
    let faces = [[0, 2, 4], [4, 2, 1], [0, 4, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let ours = format!("shape = \"mesh\"\npositions = {corners:?}\ntriangles = {faces:?}");
    let corner = |i: usize| format!("<{}>", joined(&corners[i]));
    let triangles = faces.map(|face| format!("triangle {{ {} }}", face.map(corner).join(", ")));
    let theirs = format!("mesh {{ {} }}", triangles.join(" "));
    check(&[case("mesh", &ours, &theirs)]);
}
