//! Hits from afar and at grazing angles, and surfaces that must not hit themselves.

use std::f64::consts::TAU;

use alhazen::accel::{AccelKind, Hit, Precision};
use alhazen::geometry::TriangleMesh;
use alhazen::math::{Bounds, Ray};
use alhazen::scene::{Epsilon, ObjectDesc, Scene, SceneDesc, ShapeDesc};
use glam::{DAffine3, DVec2, DVec3};

use super::points::{add_copy, corners};
use super::{
    Cell, Row, Rung, Table, add_mesh, ball, ellipsoid, empty, enter, look, per_million, power, row,
    sphere,
};
use crate::common::Random;

/// A camera that sees a ball from afar: every ray at it hits, where it should.
pub(super) fn far_cameras(n: usize) -> Table {
    let cases = [1e1, 1e3, 1e5, 1e7].into_iter().flat_map(|d| [(d, false), (d, true)]);
    let rows = cases.map(|(distance, is_mesh)| {
        let eye = DVec3::new(0.36, 0.48, 0.8) * distance;
        let shape = if is_mesh { "mesh" } else { "sphere" };
        row(format!("{shape} from {} radii", power(distance)), |rung| {
            let mut desc = empty();
            if is_mesh {
                add_mesh(&mut desc, ball(400, DVec3::ZERO, 1.0));
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
pub(super) fn grazing(n: usize) -> Table {
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
                    add_mesh(&mut desc, TriangleMesh::new(xyz, vec![[0, 2, 1], [0, 3, 2]]));
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

/// A convex object of a kind, about as large as `scale`.
fn convex(desc: &mut SceneDesc, kind: &str, center: DVec3, scale: f64) {
    if let Some(kind) = kind.strip_prefix("copied ") {
        convex(desc, kind, DVec3::ZERO, scale);
        let object = desc.objects.pop().unwrap();
        return add_copy(desc, object, center);
    }
    let half = DVec3::new(0.8, 0.5, 0.6) * scale;
    let bounds = Bounds { min: center - half, max: center + half };
    let shape = match kind {
        "sphere" => ShapeDesc::Sphere { center, radius: scale },
        "box" => ShapeDesc::Box(bounds),
        "cylinder" => ShapeDesc::Cone {
            from: center - half,
            to: center + half,
            radii: [0.5 * scale; 2],
            has_caps: true,
        },
        "ellipsoid" => ellipsoid((half * half).recip(), center, bounds),
        _ => {
            add_mesh(desc, ball(60, DVec3::ZERO, scale));
            let object = desc.objects.last_mut().unwrap();
            object.transform = DAffine3::from_translation(center);
            return;
        }
    };
    desc.objects.push(ObjectDesc::new(shape, Some("grey")));
}

/// Whether no part of a triangle lies above the plane of another, which what leaves it then cannot hit.
fn is_below(scene: &Scene, found: &Hit, hit: &Hit, outward: DVec3) -> bool {
    let [a, b, c] = corners(scene, hit);
    let normal = (b - a).cross(c - a);
    let normal = normal * normal.dot(outward).signum();
    let heights = corners(scene, found).map(|p| (p - a).dot(normal));
    heights.into_iter().all(|h| h <= 0.0)
}

/// Of rays that leave a convex surface outward, how many hit it again, of how many.
fn hit_again(
    rung: Rung,
    epsilon: Epsilon,
    kind: &str,
    center: DVec3,
    scale: f64,
    n: usize,
) -> [usize; 2] {
    let mut desc = empty();
    convex(&mut desc, kind, center, scale);
    // Something at the origin keeps the world from being recentred on the object.
    desc.objects.push(sphere(DVec3::ZERO, 1e-3 * scale));
    desc.settings.epsilon = epsilon;
    let scene = rung.scene(desc);
    let query = scene.accel.query();
    let center = center - scene.center;
    let mut random = Random(9);
    let (mut rays, mut wrong) = (0, 0);
    while rays < n {
        let origin = center + random.direction() * 8.0 * scale;
        let target = center + random.in_cube() * 0.5 * scale;
        let ray = Ray::new(origin.as_vec3(), (target - origin).normalize().as_vec3());
        let Some(hit) = query.intersect(&ray) else { continue };
        let point = scene.surface(&ray, &hit);
        let normal = point.geometric_normal.as_dvec3();
        let d = random.outward(normal).as_vec3();
        if d.dot(point.geometric_normal) <= 0.0 {
            continue;
        }
        rays += 1;
        let found = query.intersect(&scene.spawn(&point, d, f32::INFINITY));
        // Rounded coordinates far away make a mesh rough: others of its facets may be in the way, if they
        // rise above this one's plane.
        wrong += usize::from(found.is_some_and(|found| {
            !kind.contains("mesh")
                || (found.geometry, found.primitive) == (hit.geometry, hit.primitive)
                || is_below(&scene, &found, &hit, normal)
        }));
    }
    [wrong, rays]
}

/// Rays that leave a convex surface outward hit nothing.
pub(super) fn self_hits(n: usize) -> Table {
    const KINDS: [&str; 7] =
        ["sphere", "box", "cylinder", "ellipsoid", "mesh", "copied box", "copied mesh"];
    let default = Rung { kind: AccelKind::default(), precision: Precision::Robust };
    let fixed = [1e-6, 1e-4, 1e-2].map(|epsilon| (default, Epsilon::Fixed(epsilon)));
    let rules = Rung::all().into_iter().map(|rung| (rung, Epsilon::Auto)).chain(fixed);
    let rules: Vec<(Rung, Epsilon)> = rules.collect();
    let mut rows = Vec::new();
    for (offset, scale) in [(0.0, 1.0), (0.0, 1e-4), (0.0, 1e4), (1e3, 1.0), (2e4, 10.0)] {
        for kind in KINDS {
            let center = DVec3::new(offset, -offset, 0.5 * offset);
            let cell = |&(rung, epsilon): &(Rung, Epsilon)| {
                let [wrong, rays] = hit_again(rung, epsilon, kind, center, scale, n / 8);
                Cell::new(per_million(wrong, rays), epsilon == Epsilon::Auto && wrong > 0)
            };
            let case = format!("{kind}, offset {}, size {}", power(offset), power(scale));
            rows.push(Row { case, cells: rules.iter().map(cell).collect() });
        }
    }
    let column = |(rung, epsilon): (Rung, Epsilon)| match epsilon {
        Epsilon::Auto => rung.name(),
        Epsilon::Fixed(x) => format!("`epsilon = {}`", power(f64::from(x))),
    };
    Table {
        title: "Surfaces that hit themselves",
        what: "Of each million rays that leave a convex shape outward, a quarter of them nearly grazing, those that hit it \
               again: by `epsilon = \"auto\"` at every rung, and by fixed distances at `robust`. Of a mesh, whose facets \
               rounding turns against each other far from the origin, only those count that hit their own facet, or one \
               that is nowhere above its plane. Red: any by `auto`.",
        columns: rules.into_iter().map(column).collect(),
        rows,
    }
}
