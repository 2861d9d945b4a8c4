//! Scenes that are hardly any, or too much: the pixel in the middle against a closed form.

use std::f64::consts::PI;

use alhazen::color::Rgb;
use alhazen::geometry::TriangleMesh;
use alhazen::io::read_mesh;
use alhazen::light::Falloff;
use alhazen::material::{Dielectric, FresnelModel, Ior, Material};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{LightDesc, MaterialDesc, ObjectDesc, Reference, Scene, SceneDesc, ShapeDesc};
use glam::{DAffine3, DQuat, DVec3};

use super::{Cell, Rung, Table, add_copies, add_mesh, empty, look, power, row, sphere};

/// A disk of reflectance 0.5 under a sun straight above with irradiance π·`light`: radiance 0.5·`light`.
fn lit(light: f64) -> SceneDesc {
    let mut desc = empty();
    desc.camera = Some(look(DVec3::new(0.0, 5.0, 0.0), DVec3::ZERO, 0.2));
    let disk =
        ShapeDesc::Disk { center: DVec3::ZERO, normal: DVec3::Y, radius: 2.0, inner_radius: 0.0 };
    desc.objects.push(ObjectDesc::new(disk, Some("grey")));
    let irradiance = Rgb::splat((light * PI) as f32);
    desc.lights.push(LightDesc::Directional { direction: DVec3::NEG_Y, irradiance });
    desc
}

/// With a mesh read from a file, of which one triangle alone is sound.
fn with_file(vertices: &str, faces: &str) -> SceneDesc {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.obj");
    std::fs::write(&path, format!("{vertices}{faces}")).unwrap();
    let mesh = read_mesh(&path).unwrap().mesh;
    assert_eq!(mesh.triangles.len(), 1, "the others are left out");
    let mut desc = lit(1.0);
    add_mesh(&mut desc, mesh);
    desc
}

fn glass(ior: f64, absorption: f32) -> Material {
    Material::Dielectric(Dielectric {
        ior: Ior::Constant(ior),
        absorption: Rgb::splat(absorption),
        priority: 0,
        fresnel: FresnelModel::Exact,
    })
}

/// Scenes that are hardly any: each renders, and its middle is what it must be.
pub(super) fn odd_scenes() -> Table {
    let middle = |rung: Rung, desc: SceneDesc| -> [f32; 3] {
        let size = desc.image.size;
        let scene = rung.scene(desc);
        let film = render(&scene, &RenderJob::default(), &()).film;
        assert!(film.mean.iter().all(|c| c.is_finite()));
        film.pixel(size[0] / 2, size[1] / 2).unwrap().to_array()
    };
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
        add_mesh(&mut desc, TriangleMesh::new(xyz, triangles));
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
    // Far from the rest, so that something is left.
    let far = "v 50 0 0\nv 51 0 0\nv 50 0 1\n";
    let not_a_number = || {
        let vertices = format!("{far}v nan 1 0\nv inf 1 -1\nv -1 1 -1\nv 1 1 -1\nv 0 1 1\n");
        with_file(&vertices, "f 1 2 3\nf 6 7 4\nf 6 5 8\n")
    };
    add("coordinates that are NaN or infinite, left out", &not_a_number, 0.5, ROUNDED);
    add("nothing at all", &empty, 0.0, ROUNDED);
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
        "a sphere of size 10⁻³⁰ in the way",
        &|| {
            let mut desc = lit(1.0);
            desc.objects.push(ObjectDesc {
                transform: DAffine3::from_scale_rotation_translation(
                    DVec3::splat(1e-30),
                    DQuat::IDENTITY,
                    DVec3::Y,
                ),
                ..sphere(DVec3::ZERO, 1.0)
            });
            desc
        },
        0.5,
        ROUNDED,
    );
    let copied = |size: f64| {
        let mut desc = lit(1.0);
        let (scale, turn) = (DVec3::splat(size), DQuat::IDENTITY);
        let place = |y: f64| DAffine3::from_scale_rotation_translation(scale, turn, DVec3::Y * y);
        let places = (1..4).map(|i| place(f64::from(i))).collect();
        add_copies(&mut desc, sphere(DVec3::ZERO, 1.0), places);
        desc
    };
    add("instances of size 10⁻⁹ in the way", &|| copied(1e-9), 0.5, ROUNDED);
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
    // Straight at its wall: what passes, and what comes back through the middle again and again.
    let (passes, absorbed) = (0.96, (-0.5f64).exp());
    let seen = passes * absorbed / (1.0 - (1.0 - passes) * absorbed * absorbed);
    add(
        "a camera in a ball of glass that absorbs",
        &|| {
            let mut desc = empty();
            desc.materials.push(MaterialDesc::new("glass", glass(1.5, 0.5)));
            let ball = sphere(DVec3::ZERO, 1.0);
            desc.objects.push(ObjectDesc { material: Some(Reference::new("glass")), ..ball });
            desc.image.background = Some(Rgb::splat(1.0));
            desc.camera = Some(look(DVec3::ZERO, DVec3::Z, 1e-3));
            desc.settings.max_depth = 64;
            desc.settings.prune = 0.0;
            desc
        },
        seen,
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
            desc.materials.push(MaterialDesc::new("glass", glass(ior, 0.0)));
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
    for size in [1e-30, 0.0] {
        rows.push(row(format!("instances of size {}", power(size)), |rung| {
            let mut desc = copied(size);
            desc.settings.precision = rung.precision;
            let is_refused = Scene::build_quietly(desc, rung.kind).is_err();
            Cell::new(if is_refused { "refused" } else { "taken" }, !is_refused)
        }));
    }
    Table {
        title: "Odd scenes",
        what: "Each renders without a value that is not finite, and the pixel in the middle is what the closed form says, \
               within 10⁻⁴ (lights that are drawn: half a percent; the long sum: 10⁻⁶); what cannot be is refused. Red: it is not.",
        columns: Rung::columns(),
        rows,
    }
}
