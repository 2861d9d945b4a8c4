//! Hit points and normals of every kind of surface, against its equation in f64.

use std::sync::Arc;

use alhazen::accel::{Geometry, Hit, affine_from_rows};
use alhazen::geometry::grid::Grid;
use alhazen::geometry::{Expression, Implicit, Isosurface, Polygon};
use alhazen::math::{Bounds, Ray};
use alhazen::scene::{ObjectDesc, Scene, SceneDesc, ShapeDesc};
use glam::{DAffine3, DQuat, DVec3, EulerRot};

use super::{Cell, Rung, Table, add_copies, add_mesh, ball, ellipsoid, empty, row, sphere};
use crate::common::Random;

/// A point's distance from one smooth part of a surface, to first order, and the normal there.
type Sheet = (f64, DVec3);

/// An equation of a surface of size 1 at the origin: the sheets that a point may lie on.
type Equation = fn(DVec3) -> Vec<Sheet>;

/// A kind of surface: size 1, at the origin.
struct Kind {
    name: &'static str,
    /// Its largest.
    curvature: f64,
    shape: fn(center: DVec3, scale: f64) -> ShapeDesc,
    equation: Equation,
}

/// From a function's value and its gradient.
fn sheet(value: f64, gradient: DVec3) -> Sheet {
    (value / gradient.length(), gradient.normalize())
}

/// The part in a cube about `center`, half of whose edge is `half`.
fn cube(center: DVec3, half: f64) -> Bounds {
    Bounds { min: center - half, max: center + half }
}

const AXIS: DVec3 = DVec3::new(1.0, 2.0, -2.0);

const KINDS: [Kind; 10] = [
    Kind {
        name: "sphere",
        curvature: 1.0,
        shape: |center, scale| ShapeDesc::Sphere { center, radius: scale },
        equation: |p| vec![sheet((p.length_squared() - 1.0) / 2.0, p)],
    },
    Kind {
        name: "disk",
        curvature: 0.0,
        shape: |center, scale| ShapeDesc::Disk {
            center,
            normal: AXIS,
            radius: scale,
            inner_radius: 0.0,
        },
        equation: |p| vec![sheet(p.dot(AXIS), AXIS)],
    },
    Kind {
        name: "box",
        curvature: 0.0,
        shape: |center, scale| ShapeDesc::Box(cube(center, 0.5 * scale)),
        equation: |p| {
            let face = |axis: DVec3| (p.dot(axis).abs() - 0.5, axis * p.dot(axis).signum());
            DVec3::AXES.map(face).into()
        },
    },
    Kind {
        name: "cone",
        curvature: 5.0,
        shape: |center, scale| ShapeDesc::Cone {
            from: center - AXIS * (scale / 6.0),
            to: center + AXIS * (scale / 6.0),
            radii: [0.7 * scale, 0.2 * scale],
            has_caps: true,
        },
        equation: |p| {
            let axis = AXIS / 3.0;
            let (along, across) = (p.dot(axis), p - axis * p.dot(axis));
            // From 0.7 to 0.2 over a length of 1.
            let side = sheet(across.length() - 0.45 + 0.5 * along, across.normalize() + 0.5 * axis);
            vec![side, (along.abs() - 0.5, axis * along.signum())]
        },
    },
    Kind {
        name: "torus",
        curvature: 4.0,
        shape: |center, scale| ShapeDesc::Torus {
            center,
            axis: AXIS,
            major_radius: 0.75 * scale,
            minor_radius: 0.25 * scale,
        },
        equation: |p| {
            let axis = AXIS / 3.0;
            let across = p - axis * p.dot(axis);
            let from_ring = p - across.normalize() * 0.75;
            vec![(from_ring.length() - 0.25, from_ring.normalize())]
        },
    },
    Kind {
        name: "ellipsoid (quadric)",
        curvature: 4.0,
        shape: |center, scale| {
            let k = DVec3::new(1.0, 2.0, 4.0) / (scale * scale);
            ellipsoid(k, center, cube(center, 2.0 * scale))
        },
        equation: |p| {
            let k = DVec3::new(1.0, 2.0, 4.0);
            vec![sheet((k * p).dot(p) - 1.0, 2.0 * k * p)]
        },
    },
    Kind {
        name: "x⁴ + y⁴ + z⁴ = 0.1 (implicit)",
        curvature: 10.0,
        shape: |center, scale| {
            let [x, y, z] = [("x", center.x), ("y", center.y), ("z", center.z)]
                .map(|(name, c)| format!("(({name} - ({c})) / {scale})^4"));
            let expression = Expression::parse(&format!("{x} + {y} + {z} - 0.1")).unwrap();
            ShapeDesc::Implicit(Implicit::new(Arc::new(expression), cube(center, scale)))
        },
        equation: |p| vec![sheet((p * p).length_squared() - 0.1, 4.0 * p * p * p)],
    },
    Kind {
        name: "isosurface of a grid",
        curvature: 8.0,
        shape: |center, scale| {
            // Of second and third degree, which trilinear interpolation meets exactly.
            let at = |i: usize| i as f32 / 4.0 - 0.5;
            let value = |i, j, k| at(i) * at(j) + 0.5 * at(k) + 2.0 * at(i) * at(j) * at(k);
            let grid = Grid::from_fn([5; 3], value).unwrap();
            let bounds = cube(center, 0.5 * scale);
            ShapeDesc::Isosurface(Isosurface::new(Arc::new(grid), bounds, 0.0, false))
        },
        equation: |DVec3 { x, y, z }| {
            let gradient = DVec3::new(y + 2.0 * y * z, x + 2.0 * x * z, 0.5 + 2.0 * x * y);
            vec![sheet(x * y + 0.5 * z + 2.0 * x * y * z, gradient)]
        },
    },
    Kind {
        name: "polygon",
        curvature: 0.0,
        shape: |center, scale| {
            let (u, v) = (DVec3::new(2.0, -1.0, 0.0), DVec3::new(2.0, 4.0, 5.0));
            let (u, v) = (u.normalize() * scale, v.normalize() * scale);
            let corners = [u, v, -u - v * 0.2, v * -0.5].map(|p| center + p);
            ShapeDesc::Polygon(Polygon::new(vec![corners.into()]).unwrap())
        },
        equation: |p| vec![sheet(p.dot(AXIS), AXIS)],
    },
    Kind {
        name: "plane",
        curvature: 0.0,
        shape: |center, _| ShapeDesc::Plane { point: center, normal: AXIS },
        equation: |p| vec![sheet(p.dot(AXIS), AXIS)],
    },
];

/// The corners of a triangle that was hit, where rays meet it.
pub(super) fn corners(scene: &Scene, hit: &Hit) -> [DVec3; 3] {
    let world = scene.world();
    let group = world.group(hit.copy);
    let Geometry::Mesh(mesh) = &group.geometries[hit.geometry as usize] else {
        panic!("a hit on no mesh");
    };
    let corners = mesh.corners(hit.primitive as usize).map(|p| p.as_dvec3());
    let place = hit.copy.map(|copy| affine_from_rows(world.transform(copy)));
    place.map_or(corners, |m| corners.map(|p| m.transform_point3(p)))
}

/// A copy in odd proportions of an object at the origin, moved to `center`.
pub(super) fn add_copy(desc: &mut SceneDesc, object: ObjectDesc, center: DVec3) {
    let turned = DQuat::from_euler(EulerRot::XYZ, 0.4, 1.1, -0.7);
    let stretch = DVec3::new(1.0, 2.0, 0.5);
    let place = DAffine3::from_scale_rotation_translation(stretch, turned, center);
    add_copies(desc, object, vec![place]);
}

/// What an object lies in: its centre, its size, and whether it is copied.
#[derive(Clone, Copy)]
struct Place {
    center: DVec3,
    scale: f64,
    is_copied: bool,
}

impl Place {
    const fn new(offset: f64, scale: f64, is_copied: bool) -> Self {
        Self { center: DVec3::new(offset, -offset, 0.5 * offset), scale, is_copied }
    }
}

const PLACES: [Place; 6] = [
    Place::new(0.0, 1.0, false),
    Place::new(0.0, 1e-4, false),
    Place::new(0.0, 1e4, false),
    Place::new(1e3, 1.0, false),
    Place::new(0.0, 1.0, true),
    Place::new(1e3, 1.0, true),
];

/// Of `n` rays from near and far: the largest distance of a hit from its surface, in bounds, and the largest
/// angle between its normal and one that the surface has within that bound.
fn worst(rung: Rung, kind: Option<&Kind>, place: Place, n: usize) -> [f64; 2] {
    let Place { center, scale, is_copied } = place;
    let mut desc = empty();
    let inner = if is_copied { DVec3::ZERO } else { center };
    match kind {
        Some(kind) => {
            desc.objects.push(ObjectDesc::new((kind.shape)(inner, scale), Some("grey")));
        }
        None => {
            add_mesh(&mut desc, ball(40, DVec3::ZERO, scale));
            desc.objects[0].transform = DAffine3::from_translation(inner);
        }
    }
    if is_copied {
        let object = desc.objects.pop().unwrap();
        add_copy(&mut desc, object, center);
    }
    // Something at the origin keeps the world from being recentred on the object.
    desc.objects.push(sphere(DVec3::ZERO, 1e-3 * scale));
    let scene = rung.scene(desc);
    let query = scene.accel.query();
    let mut random = Random(14);
    let (mut off, mut turned, mut hits) = (0.0f64, 0.0f64, 0);
    while hits < n {
        let distance = scale * 10f64.powf(random.between(0.5, 3.0));
        let origin = center - scene.center + random.direction() * distance;
        let target = center - scene.center + random.in_cube() * 0.9 * scale;
        let ray = Ray::new(origin.as_vec3(), (target - origin).normalize().as_vec3());
        let Some(hit) = query.intersect(&ray) else { continue };
        let point = scene.surface(&ray, &hit);
        let p = point.position.as_dvec3() + scene.center;
        // Not of the one at the origin, and of a plane no farther than asked for.
        if (p - center).length() > 4.0 * scale || p.length() < 2e-3 * scale {
            continue;
        }
        hits += 1;
        // In units of the object, where its equation holds; rays see copies as their transforms are rounded.
        let world_from_object = match hit.copy {
            Some(copy) => affine_from_rows(scene.world().transform(copy)),
            None => DAffine3::from_translation(center),
        } * DAffine3::from_scale(DVec3::splat(scale));
        let sheets: Vec<Sheet> = match kind {
            None => {
                let [a, b, c] = corners(&scene, &hit);
                let normal = (b - a).cross(c - a).normalize();
                vec![((p - scene.center - a).dot(normal), normal)]
            }
            Some(kind) => {
                let object_from_world = world_from_object.inverse();
                let normal_matrix = object_from_world.matrix3.transpose();
                let in_object = object_from_world.transform_point3(p);
                let placed = |(distance, normal): Sheet| {
                    let normal = normal_matrix * normal;
                    (distance / normal.length(), normal.normalize())
                };
                (kind.equation)(in_object).into_iter().map(placed).collect()
            }
        };
        let bound = f64::from(point.error);
        let nearest =
            sheets.iter().map(|(distance, _)| distance.abs()).fold(f64::INFINITY, f64::min);
        off = off.max(nearest / bound);
        // At an edge any of the sides that meet there is right.
        let normal = point.geometric_normal.as_dvec3();
        let there = sheets.iter().filter(|(distance, _)| distance.abs() <= nearest + 4.0 * bound);
        let angle = there.map(|(_, m)| (normal - m * m.dot(normal).signum()).length());
        // Within the bound of the position the normal turns by so much at most.
        let curvature = kind.map_or(0.0, |kind| kind.curvature) * if is_copied { 8.0 } else { 1.0 };
        let allowed = bound * curvature / scale;
        turned = turned.max(angle.fold(f64::INFINITY, f64::min) - allowed);
    }
    [off, turned]
}

/// Every kind of surface: where it is hit, and which way it faces there.
pub(super) fn points(n: usize) -> Table {
    let kinds = KINDS.iter().map(Some).chain([None]);
    let rows = kinds.flat_map(|kind| {
        let name = kind.map_or("mesh", |kind| kind.name);
        [false, true].map(|is_copied| {
            // Nothing that has no end is copied.
            if is_copied && name == "plane" {
                return None;
            }
            let case = if is_copied { format!("{name}, copied") } else { name.to_owned() };
            Some(row(case, |rung| {
                let places = PLACES.iter().filter(|place| place.is_copied == is_copied);
                let worst = places.map(|place| worst(rung, kind, *place, n / 32));
                let [off, turned] = worst.fold([0.0f64; 2], |[a, b], [c, d]| [a.max(c), b.max(d)]);
                let text = format!("{off:.2} bounds, {turned:.0e} rad");
                Cell::new(text, off > 4.0 || turned > 1e-6)
            }))
        })
    });
    Table {
        title: "Hit points and normals",
        what: "Shapes of size 1, 10⁻⁴ and 10⁴ at the origin and of size 1 at (1000, −1000, 500), and copies of them turned \
               and stretched, seen from 3 to 1000 times their size: the largest distance of a hit from the surface's \
               equation, in multiples of the bound that is stated with the hit, and the largest angle by which a normal is \
               off beyond what the surface turns within that bound. Red: more than 4 bounds, or more than 10⁻⁶.",
        columns: Rung::columns(),
        rows: rows.flatten().collect(),
    }
}
