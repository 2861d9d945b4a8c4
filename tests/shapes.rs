//! Every kind of shape against an oracle that shares no code with it: a function that is negative inside,
//! followed along the ray in small steps until it changes its sign.
//!
//! Rays are made around a point near the shape, from which the oracle works, and start up to a million
//! sizes away, from where the shape must work. `ALHAZEN_DOCS=1 cargo test --release --test shapes` uses
//! many rays and writes the worst errors into `docs/shapes.md`.
#![allow(missing_docs, clippy::print_stderr, reason = "a test program")]

mod common;

use std::f64::consts::TAU;
use std::sync::Arc;

use alhazen::geometry::grid::Grid;
use alhazen::geometry::{
    AnalyticShape, Cone, Cuboid, Disk, Expression, Framed, Implicit, Isosurface, Plane, Polygon,
    Quadric, Sphere, Torus,
};
use alhazen::math::Bounds;
use common::Random;
use glam::{DAffine3, DQuat, DVec3};

/// How far rays come from, in sizes of the shape.
const DISTANCES: [f64; 4] = [1e-3, 1.0, 1e3, 1e6];

/// A shape, and what is known of it without asking it.
struct Case<'a, S> {
    name: &'static str,
    shape: S,
    /// Negative inside, or on one side; its change across the surface tells of a hit.
    field: &'a dyn Fn(DVec3) -> f64,
    /// How far within its ends a point of the surface is; infinite where it has none.
    margin: &'a dyn Fn(DVec3) -> f64,
    center: DVec3,
    size: f64,
}

/// The worst of many rays from one distance.
#[derive(Debug, Clone, Copy, Default)]
struct Worst {
    /// Farthest from the surface, in sizes.
    off: f64,
    /// First hits that the shape did not give.
    lost: u32,
}

impl<S: AnalyticShape> Case<'_, S> {
    /// Distance to the surface, to first order.
    fn off(&self, p: DVec3) -> f64 {
        self.gradient(p).map_or(f64::NAN, |g| ((self.field)(p) / g.length()).abs()) / self.size
    }

    fn gradient(&self, p: DVec3) -> Option<DVec3> {
        let h = 1e-6 * self.size;
        let along = |d: DVec3| ((self.field)(p + d * h) - (self.field)(p - d * h)) / (2.0 * h);
        let g = DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z));
        (g.length() > 0.0).then_some(g)
    }

    /// The first crossing beyond `from` of the line through `p`, and how clear it is, in sizes: how far the
    /// field goes beyond zero there, or how far from the surface's end it is. A ray may or may not feel
    /// one that is nearly none.
    fn crossing(&self, p: DVec3, d: DVec3, from: f64) -> Option<(f64, f64)> {
        const STEPS: u32 = 600;
        // The line through a ball around the shape.
        let b = (self.center - p).dot(d);
        let beside = (self.center - p - d * b).length_squared();
        let half = ((1.05 * self.size).powi(2) - beside).max(0.0).sqrt();
        let (start, end) = ((b - half).max(from), b + half);
        if start >= end {
            return None;
        }
        let at = |i: u32| start + (end - start) * f64::from(i) / f64::from(STEPS);
        let value = |t: f64| (self.field)(p + d * t);
        let mut low = (start, value(start));
        for i in 1..=STEPS {
            let high = (at(i), value(at(i)));
            if (low.1 < 0.0) != (high.1 < 0.0) {
                let (mut a, mut b) = (low.0, high.0);
                while b - a > 1e-15 * (a.abs() + b.abs() + 1e-3 * self.size) {
                    let middle = 0.5 * (a + b);
                    if (value(middle) < 0.0) == (low.1 < 0.0) { a = middle } else { b = middle }
                }
                let margin = (self.margin)(p + d * b);
                if margin > 0.0 {
                    let depth = low.1.abs().min(high.1.abs());
                    let slope = self.gradient(p + d * b).map_or(1.0, DVec3::length);
                    return Some((b, (depth / slope).min(margin) / self.size));
                }
            }
            low = high;
        }
        None
    }

    /// Shoots rays that come from `distance` sizes away, and compares each with the oracle.
    fn check(&self, random: &mut Random, distance: f64, rays: u32) -> Worst {
        let mut worst = Worst::default();
        // What the ray itself is rounded to, on its way.
        let blur = 1e-11 + 8e-15 * distance;
        for i in 0..rays {
            let near = self.center + random.in_cube() * 1.2 * self.size;
            let mut d = random.direction();
            let mut p = near;
            if i % 4 == 1 {
                // Nearly grazing: from a point of the surface, along it.
                let Some((t, _)) = self.crossing(near, d, 0.0) else { continue };
                let Some(n) = self.gradient(near + d * t).map(DVec3::normalize) else { continue };
                p = near + d * t;
                let tilt = 10f64.powf(random.between(-9.0, -1.0));
                d = (random.direction().reject_from_normalized(n) + n * tilt).normalize();
            } else if i % 16 == 3 {
                // Along an axis.
                let axis = [DVec3::X, DVec3::Y, DVec3::Z][(random.bits() % 3) as usize];
                d = if random.unit() < 0.5 { axis } else { -axis };
            }
            let back = distance * self.size;
            let origin = p - d * back;
            // The oracle sees the same line from p on: what lies before is left out on both sides.
            let t_min = back + random.between(-0.5, 0.5) * self.size.min(back);
            // A direction of any length.
            let scale = 10f64.powf(random.between(-3.0, 3.0));
            let found = self
                .shape
                .intersect(origin, d * scale, t_min / scale, f64::INFINITY)
                .map(|hit| (hit.t * scale - back, hit.part));
            let any = self.shape.occluded(origin, d * scale, t_min / scale, f64::INFINITY);
            assert_eq!(any, found.is_some(), "{}: any hit", self.name);
            let expected = self.crossing(p, d, t_min - back);
            if let Some((t, part)) = found {
                let hit = p + d * t;
                let off = self.off(hit);
                assert!(
                    off < blur,
                    "{} from {distance:e}: hit {hit} is {off:e} off the surface",
                    self.name
                );
                let margin = (self.margin)(hit);
                // Where a grazing ray meets the surface is as uncertain as it is slow to come near.
                let slant = self.gradient(hit).map_or(1.0, |g| g.normalize().dot(d).abs());
                assert!(
                    margin > -blur * self.size / slant,
                    "{}: {hit} is {margin:e} past its end",
                    self.name
                );
                worst.off = worst.off.max(off);
                self.check_point(hit, part);
            }
            if let Some((t, depth)) = expected {
                // A grazing ray may meet the same place of the surface much later.
                let is_late = found.is_none_or(|(found, _)| {
                    let is_other = self.off(p + d * (0.5 * (found + t))) > blur;
                    found > t + blur * self.size && is_other
                });
                // What is within rounding of the start, or of just touching, may be either.
                let after_start = t - (t_min - back);
                if is_late && depth > blur && after_start > blur * self.size {
                    worst.lost += 1;
                    eprintln!(
                        "{} from {distance:e} sizes: lost the hit at {t} (found {found:?}, depth {depth:e}) \
                         p {p} d {d}",
                        self.name
                    );
                }
            }
        }
        worst
    }

    /// The point of the surface that a hit stands for, its normal and texture coordinates.
    fn check_point(&self, hit: DVec3, part: u8) {
        let name = self.name;
        // As a ray of f32 would see it.
        let near = hit + DVec3::new(1.0, -1.0, 0.5) * 3e-8 * self.size;
        let point = self.shape.surface_at(near, part);
        let off = self.off(point.position);
        let rounding = 1e-13 + 1e-15 * point.position.length() / self.size;
        assert!(off < rounding, "{name}: {} is {off:e} off the surface", point.position);
        assert!((point.position - near).length() < 1e-5 * self.size, "{name}: far from the hit");
        assert!((point.normal.length() - 1.0).abs() < 1e-14, "{name}: normal {}", point.normal);
        let along = 1e-4 * self.size;
        let (out, inside) =
            (point.position + point.normal * along, point.position - point.normal * along);
        // At an edge a step may lead past a neighbouring face.
        let g = self.gradient(point.position).unwrap_or(point.normal).normalize();
        if (self.field)(out) > 0.0 && (self.field)(inside) < 0.0 {
            let is_edge = self
                .gradient(out)
                .zip(self.gradient(inside))
                .is_none_or(|(a, b)| a.normalize().dot(b.normalize()) < 1.0 - 1e-6);
            let angle = g.angle_between(point.normal);
            assert!(is_edge || angle < 1e-5, "{name}: normal {} is off by {angle:e}", point.normal);
        }

        let q = self.shape.parameters(point.position, part);
        assert!(q.uv.is_finite() && q.dp_du.is_finite() && q.dp_dv.is_finite(), "{name}: {q:?}");
        // A step along ∂p/∂u changes u by as much, and v not; where the surface has coordinates, and is
        // not near an end of them.
        for (tangent, expected) in [(q.dp_du, [1.0, 0.0]), (q.dp_dv, [0.0, 1.0])] {
            let speed = tangent.length();
            let h = 1e-5 * self.size / speed;
            if speed == 0.0 || h > 1e-3 {
                continue;
            }
            let moved = self.shape.surface_at(point.position + tangent * h, part);
            if (moved.position - point.position - tangent * h).length() > 1e-2 * h * speed {
                continue;
            }
            let change = (self.shape.parameters(moved.position, part).uv - q.uv) / h;
            let is_seam = change.abs().max_element() > 0.1 / h;
            let error = (change.x - expected[0]).abs().max((change.y - expected[1]).abs());
            assert!(is_seam || error < 2e-2, "{name}: {q:?} changes by {change}, not {expected:?}");
        }
    }
}

/// Distances to the surface, in sizes, and lost hits, for each kind and distance.
fn survey(rays: u32) -> Vec<(&'static str, [Worst; 4])> {
    let mut rows = Vec::new();
    let random = &mut Random(11);
    let everywhere: &dyn Fn(DVec3) -> f64 = &|_| f64::INFINITY;
    macro_rules! case {
        ($name:literal, $shape:expr, $center:expr, $size:expr, $field:expr, $margin:expr) => {{
            let case = Case {
                name: $name,
                shape: $shape,
                field: &$field,
                margin: $margin,
                center: $center,
                size: $size,
            };
            rows.push(($name, DISTANCES.map(|distance| case.check(random, distance, rays))));
        }};
    }

    let c = DVec3::new(0.3, -1.2, 2.0);
    case!(
        "sphere",
        Sphere { center: c, radius: 1.5 },
        c,
        1.5,
        |p| (p - c).length() - 1.5,
        everywhere
    );
    let turn = DQuat::from_rotation_arc(DVec3::Y, DVec3::new(1.0, 2.0, -2.0) / 3.0);
    let m = DAffine3::from_rotation_translation(turn, c)
        * DAffine3::from_scale(DVec3::new(2.0, -0.7, 1.1));
    let inverse = m.inverse();
    case!(
        "ellipsoid",
        Framed::new(Sphere { center: DVec3::ZERO, radius: 1.0 }, m),
        c,
        2.0,
        |p| inverse.transform_point3(p).length() - 1.0,
        everywhere
    );
    let half = DVec3::new(1.0, 0.4, 0.1);
    let in_box = |p: DVec3| (p.abs() - half).max_element();
    let cuboid = Cuboid { bounds: Bounds { min: c - half, max: c + half } };
    case!("box", cuboid, c, half.length(), |p| in_box(p - c), everywhere);
    let at_origin = Cuboid { bounds: Bounds { min: -half, max: half } };
    case!(
        "sheared box",
        Framed::new(at_origin, m),
        c,
        2.2,
        |p| in_box(inverse.transform_point3(p)),
        everywhere
    );
    let upright = DAffine3::from_rotation_translation(turn, c);
    let from_upright = upright.inverse();
    // Convex bodies by their half-spaces and rounds.
    let round = |height: f64, [bottom, top]: [f64; 2], p: DVec3| {
        let k = (top - bottom) / height;
        let side = (p.x.hypot(p.z) - bottom - k * p.y) / k.hypot(1.0);
        side.max(-p.y).max(p.y - height)
    };
    for (name, radii, size) in [
        ("cylinder", [0.5, 0.5], 1.2),
        ("cone", [0.8, 0.0], 1.4),
        ("truncated cone", [0.2, 0.9], 1.4),
    ] {
        let cone = Cone { height: 2.0, radii, has_caps: true };
        let field = |p: DVec3| round(2.0, radii, from_upright.transform_point3(p));
        let center = upright.transform_point3(DVec3::Y);
        let case = Case {
            name,
            shape: Framed::new(cone, upright),
            field: &field,
            margin: everywhere,
            center,
            size,
        };
        rows.push((name, DISTANCES.map(|distance| case.check(random, distance, rays))));
    }
    let pipe = Cone { height: 2.0, radii: [1e-3, 1e-3], has_caps: false };
    case!(
        "thin open cylinder",
        pipe,
        DVec3::Y,
        1.0,
        |p: DVec3| p.x.hypot(p.z) - 1e-3,
        &|p: DVec3| p.y.min(2.0 - p.y)
    );
    let ring = |major: f64, minor: f64, p: DVec3| {
        let p = from_upright.transform_point3(p);
        (p.x.hypot(p.z) - major).hypot(p.y) - minor
    };
    for (name, major, minor) in
        [("torus", 1.0, 0.4), ("thin torus", 1.0, 1e-3), ("spindle torus", 0.5, 1.0)]
    {
        let torus = Torus { major_radius: major, minor_radius: minor };
        // Inside the apple but outside of the lemon.
        let field = |p: DVec3| ring(major, minor, p).max(-ring(-major, minor, p));
        let case = Case {
            name,
            shape: Framed::new(torus, upright),
            field: &field,
            margin: everywhere,
            center: c,
            size: major + minor,
        };
        rows.push((name, DISTANCES.map(|distance| case.check(random, distance, rays))));
    }
    let normal = turn * DVec3::Y;
    let plane = |p: DVec3| (p - c).dot(normal);
    let across = |p: DVec3| (p - c).reject_from_normalized(normal).length();
    case!(
        "disk",
        Disk { center: c, normal, radius: 1.0, inner_radius: 0.3 },
        c,
        1.0,
        plane,
        &|p: DVec3| (across(p) - 0.3).min(1.0 - across(p))
    );
    case!("plane", Plane { point: c, normal }, c, 1.0, plane, everywhere);
    // A star with a square hole.
    let star: Vec<DVec3> = (0..10)
        .map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / 10.0).sin_cos();
            DVec3::new(cos, 0.0, -sin) * if i % 2 == 0 { 1.0 } else { 0.45 }
        })
        .collect();
    let hole =
        [[0.1, 0.1], [0.1, -0.1], [-0.1, -0.1], [-0.1, 0.1]].map(|[x, z]| DVec3::new(x, 0.0, z));
    let placed =
        |ring: &[DVec3]| ring.iter().map(|p| upright.transform_point3(*p)).collect::<Vec<_>>();
    let polygon = Polygon::new(vec![placed(&star), placed(&hole)]).expect("flat");
    // Winding by the sum of angles, in the plane; and near an edge, by distance, all is allowed.
    let angles = |ring: &[DVec3], p: DVec3| -> f64 {
        let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
        pairs
            .map(|(a, b)| {
                let (a, b) = (*a - p, *b - p);
                (a.z * b.x - a.x * b.z).atan2(a.x * b.x + a.z * b.z)
            })
            .sum::<f64>()
            .abs()
    };
    let edge_distance = |ring: &[DVec3], p: DVec3| -> f64 {
        let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
        let to_edge = pairs.map(|(a, b)| {
            let along = ((p - *a).dot(*b - *a) / (*b - *a).length_squared()).clamp(0.0, 1.0);
            p.distance(a.lerp(*b, along))
        });
        to_edge.fold(f64::INFINITY, f64::min)
    };
    let in_star = |p: DVec3| {
        let p = from_upright.transform_point3(p);
        let distance = edge_distance(&star, p).min(edge_distance(&hole, p));
        if angles(&star, p) > 3.0 && angles(&hole, p) < 3.0 { distance } else { -distance }
    };
    case!("polygon", polygon, c, 1.0, plane, &in_star);
    let clip = Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
    let clipped = |p: DVec3| (p - clip.min).min(clip.max - p).min_element();
    for (name, q) in [
        ("quadric: saddle", [1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0]),
        ("quadric: hyperboloid", [1.0, -0.8, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.1]),
        ("quadric: two sheets", [1.0, -1.0, 1.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1]),
        ("quadric: paraboloid", [2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -0.3]),
        ("quadric: sheared", [1.0, 2.0, 3.0, 0.5, -0.7, 1.1, 0.1, 0.2, -0.3, -0.6]),
    ] {
        let field = |p: DVec3| {
            let terms = [
                p.x * p.x,
                p.y * p.y,
                p.z * p.z,
                p.x * p.y,
                p.x * p.z,
                p.y * p.z,
                p.x,
                p.y,
                p.z,
                1.0,
            ];
            terms.iter().zip(q).map(|(term, q)| term * q).sum()
        };
        let case = Case {
            name,
            shape: Quadric::new(q, clip),
            field: &field,
            margin: &clipped,
            center: DVec3::ZERO,
            size: 1.8,
        };
        rows.push((name, DISTANCES.map(|distance| case.check(random, distance, rays))));
    }
    let expression = Expression::parse("(sqrt(x^2 + z^2) - 1)^2 + y^2 - 0.16").expect("it is one");
    let bounds = Bounds { min: DVec3::new(-1.5, -0.5, -1.5), max: DVec3::new(1.5, 0.5, 1.5) };
    case!(
        "implicit torus",
        Implicit::new(Arc::new(expression), bounds),
        DVec3::ZERO,
        1.4,
        |p: DVec3| (p.x.hypot(p.z) - 1.0).hypot(p.y) - 0.4,
        everywhere
    );
    // A ball of samples, and what lies between them from the eight around.
    let sample = |i: usize, j: usize, k: usize| {
        let p = DVec3::new(i as f64, j as f64, k as f64) - 4.0;
        (2.9 - p.length() + 0.3 * (2.0 * p.x).sin()) as f32
    };
    let grid = Arc::new(Grid::from_fn([9; 3], sample).expect("finite"));
    let between = |p: DVec3| {
        let p = (p + 4.0).clamp(DVec3::ZERO, DVec3::splat(8.0));
        let cell = p.floor().min(DVec3::splat(7.0));
        let (f, [i, j, k]) = (p - cell, cell.to_array().map(|x| x as usize));
        let corner = |c: usize| {
            let [x, y, z] = [c & 1, c >> 1 & 1, c >> 2];
            let weight = |step: usize, f: f64| if step == 1 { f } else { 1.0 - f };
            weight(x, f.x)
                * weight(y, f.y)
                * weight(z, f.z)
                * f64::from(sample(i + x, j + y, k + z))
        };
        -(0..8).map(corner).sum::<f64>()
    };
    let bounds = Bounds { min: DVec3::splat(-4.0), max: DVec3::splat(4.0) };
    case!(
        "isosurface",
        Isosurface::new(grid, bounds, 0.0, false),
        DVec3::ZERO,
        3.4,
        between,
        everywhere
    );
    rows
}

#[test]
fn first_hits_are_those_of_the_field() {
    let rows = survey(if common::verify() { 20_000 } else { 1_500 });
    let lost: Vec<_> = rows.iter().filter(|(_, worst)| worst.iter().any(|w| w.lost > 0)).collect();
    assert!(lost.is_empty(), "{lost:#?}");
}

/// Fills the table of the documentation, where that is asked for.
#[test]
fn the_table_of_errors_is_in_the_documentation() {
    const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/shapes.md");
    const MARKS: [&str; 2] = ["<!-- ERRORS -->\n", "<!-- END -->"];
    let is_asked = std::env::var_os("ALHAZEN_DOCS").is_some_and(|value| value == "1");
    let page = std::fs::read_to_string(PAGE).expect("the page is there");
    let [start, end] = MARKS.map(|mark| page.find(mark).expect("the marks are there"));
    let start = start + MARKS[0].len();
    if is_asked {
        let rays = 100_000;
        let mut table = "| shape | 10⁻³ sizes away | 1 | 10³ | 10⁶ | lost, of ".to_owned()
            + &format!("{} rays |\n|---|---|---|---|---|---|\n", 4 * rays);
        for (name, worst) in survey(rays) {
            let cells = worst.map(|w| format!("{:.0e}", w.off)).join(" | ");
            let lost: u32 = worst.iter().map(|w| w.lost).sum();
            table += &format!("| {name} | {cells} | {lost} |\n");
        }
        let page = format!("{}{table}{}", &page[..start], &page[end..]);
        std::fs::write(PAGE, page).expect("it can be written");
        return;
    }
    // Every kind that is measured has its row.
    for (name, _) in survey(1) {
        assert!(page[start..end].contains(&format!("| {name} |")), "no row for {name}");
    }
}

/// A ray through a closed surface crosses it an even number of times, even at its edges and corners.
#[test]
fn polygons_that_share_edges_leave_no_gap() {
    let random = &mut Random(5);
    // A prism over a star, as its caps are not convex.
    let rim: Vec<DVec3> = (0..14)
        .map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / 14.0).sin_cos();
            DVec3::new(cos, 0.0, sin) * if i % 2 == 0 { 1.0 } else { 0.5 }
        })
        .collect();
    let turn = DQuat::from_rotation_arc(DVec3::Y, DVec3::new(1.0, 2.0, -2.0) / 3.0);
    let place = |p: DVec3| turn * p + DVec3::new(1.0, 5.0, -3.0);
    let bottom: Vec<DVec3> = rim.iter().map(|p| place(*p)).collect();
    let top: Vec<DVec3> = rim.iter().map(|p| place(*p + DVec3::Y)).collect();
    let mut loops = vec![bottom.clone(), top.iter().rev().copied().collect()];
    for i in 0..rim.len() {
        let j = (i + 1) % rim.len();
        loops.push(vec![bottom[j], bottom[i], top[i], top[j]]);
    }
    let faces: Vec<Polygon> =
        loops.into_iter().map(|ring| Polygon::new(vec![ring]).expect("flat")).collect();
    let corners: Vec<DVec3> = bottom.iter().chain(&top).copied().collect();
    let mut crossed = 0;
    for i in 0..60_000 {
        // At edges and corners, exactly as f64 can, and elsewhere.
        let a = corners[random.below(corners.len())];
        let j = random.below(rim.len());
        let (b, c) = (bottom[j], bottom[(j + 1) % rim.len()]);
        let target = match i % 3 {
            0 => a,
            1 => b.lerp(c, random.unit()),
            _ => place(random.in_cube()),
        };
        let origin = place(random.direction() * 10f64.powf(random.between(0.7, 4.0)));
        // Directions as rays have them, in f32.
        let direction = (target - origin).as_vec3().as_dvec3();
        let hits = faces
            .iter()
            .filter(|face| face.intersect(origin, direction, 0.0, f64::INFINITY).is_some())
            .count();
        assert!(hits % 2 == 0, "{hits} hits from {origin} along {direction}");
        crossed += hits;
    }
    assert!(crossed > 60_000, "{crossed}");
}

/// Rays aimed at the edges and corners of closed shapes, a billionth of the size within them: what lies there
/// is solid, so that one which passes has slipped through between two faces.
#[test]
fn no_ray_slips_through_an_edge() {
    let random = &mut Random(17);
    let bounds = Bounds { min: DVec3::new(-1.0, 0.2, 3.0), max: DVec3::new(0.5, 0.9, 3.4) };
    let cone = Cone { height: 0.7, radii: [0.6, 0.25], has_caps: true };
    let mut lost = [0; 2];
    for _ in 0..if common::verify() { 2_000_000 } else { 100_000 } {
        let origin = random.direction() * 10f64.powf(random.between(1.0, 3.0));
        // A point of an edge: two coordinates at an end, the third anywhere, a corner one time in four.
        let mut at = DVec3::new(random.unit(), random.unit(), random.unit());
        let free = if random.unit() < 0.25 { 3 } else { random.below(3) };
        (0..3).filter(|axis| *axis != free).for_each(|axis| at[axis] = at[axis].round());
        let edge = bounds.min + at * bounds.size();
        let target = edge + (bounds.center() - edge) * 1e-9;
        let ray = (origin, target - origin);
        let cuboid = Cuboid { bounds };
        lost[0] += u32::from(!cuboid.occluded(ray.0, ray.1, 0.0, f64::INFINITY));

        let (sin, cos) = (random.unit() * TAU).sin_cos();
        let (rho, y) = if random.unit() < 0.5 { (0.6, 0.0) } else { (0.25, 0.7) };
        let rim = DVec3::new(rho * sin, y, rho * cos);
        let target = rim + (DVec3::Y * 0.3 - rim) * 1e-9;
        let ray = (origin, target - origin);
        lost[1] += u32::from(!cone.occluded(ray.0, ray.1, 0.0, f64::INFINITY));
    }
    assert_eq!(lost, [0, 0]);
}
