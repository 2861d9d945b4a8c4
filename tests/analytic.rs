//! Pictures whose pixels are known in closed form, through the public API, on every accelerator.
#![allow(missing_docs, reason = "a test program")]

use std::f64::consts::PI;

use alhazen::accel::AccelKind;
use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::film::{Film, Filter};
use alhazen::geometry::TriangleMesh;
use alhazen::light::Falloff;
use alhazen::material::{Material, Phong, PhongModel};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{
    CameraDesc, IntegratorKind, LightDesc, Location, MaterialDesc, ObjectDesc, PlaceDesc, Scene,
    SceneDesc, Shadows, ShapeDesc,
};
use glam::{DAffine3, DMat3, DVec3};

const SIDE: u32 = 32;

/// Looks straight down on the plane y = 0 from (0, 10, 0): an orthographic picture of [−2, 2]².
fn looking_down() -> SceneDesc {
    let mut desc = SceneDesc::default();
    desc.image.size = [SIDE, SIDE];
    desc.settings.samples = 1;
    desc.settings.filter = Filter::Box;
    desc.camera = Some(CameraDesc {
        at: Location::default(),
        projection: Projection::Orthographic { height: 4.0 },
        place: Some(PlaceDesc::LookAt {
            eye: DVec3::new(0.0, 10.0, 0.0),
            target: DVec3::ZERO,
            up: DVec3::NEG_Z,
        }),
        lens: None,
    });
    desc.ambient = Some(Rgb::BLACK);
    desc
}

fn square(half: f32) -> TriangleMesh {
    let xyz = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let xyz = xyz.iter().flat_map(|[x, z]| [*x, 0.0, *z]).collect();
    TriangleMesh::new(xyz, vec![[0, 2, 1], [0, 3, 2]])
}

fn add_material(desc: &mut SceneDesc, name: &str, material: Material) {
    desc.materials.push(MaterialDesc::new(name, material));
}

fn add_mesh(desc: &mut SceneDesc, mesh: TriangleMesh, material: &str) -> usize {
    desc.meshes.push(mesh);
    let shape = ShapeDesc::Mesh(desc.meshes.len() - 1);
    desc.objects.push(ObjectDesc::new(shape, Some(material)));
    desc.objects.len() - 1
}

fn diffuse(reflectance: f32) -> Material {
    Material::Diffuse { reflectance: Rgb::splat(reflectance) }
}

fn film_on(desc: SceneDesc, kind: AccelKind) -> Film {
    let scene = Scene::build_quietly(desc, kind).unwrap_or_else(|e| panic!("{e:?}"));
    let rendered = render(&scene, &RenderJob::default(), &());
    assert_eq!(rendered.non_finite.count, 0);
    rendered.film
}

/// Compares every pixel with `expected(x, z)`, allowing what changes within one pixel and rounding.
fn check(desc: &SceneDesc, relative: f64, expected: impl Fn(f64, f64) -> f64) {
    for &kind in AccelKind::ALL {
        let film = film_on(desc.clone(), kind);
        let step = 4.0 / f64::from(SIDE);
        for y in 0..SIDE {
            for x in 0..SIDE {
                let center = |i: u32| (f64::from(i) + 0.5) * step - 2.0;
                // The sample lies somewhere in the pixel.
                let around = [-0.5, 0.0, 0.5].map(|d| d * step);
                let values = around
                    .iter()
                    .flat_map(|dx| around.iter().map(move |dz| (center(x) + dx, center(y) + dz)));
                let (low, high) = values
                    .map(|(x, z)| expected(x, z))
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
                let got = f64::from(film.pixel(x, y).unwrap().g);
                assert!(
                    got >= low * (1.0 - relative) && got <= high * (1.0 + relative),
                    "{}, pixel {x},{y}: {got} is not in [{low}, {high}]",
                    kind.name()
                );
            }
        }
    }
}

#[test]
fn a_point_light_falls_off_with_the_square_and_the_cosine() {
    let mut desc = looking_down();
    add_material(&mut desc, "grey", diffuse(0.5));
    add_mesh(&mut desc, square(3.0), "grey");
    desc.lights.push(LightDesc::Point {
        position: DVec3::new(0.5, 2.0, -0.25),
        intensity: Rgb::splat(12.0),
        falloff: Falloff::InverseSquare,
    });
    check(&desc, 1e-3, |x, z| {
        let d2 = (x - 0.5).powi(2) + 4.0 + (z + 0.25).powi(2);
        0.5 / PI * 12.0 / d2 * (2.0 / d2.sqrt())
    });
}

#[test]
fn the_lectures_light_gives_its_equation_literally() {
    for (model, exponent) in [(PhongModel::Phong, 20.0), (PhongModel::BlinnPhong, 20.0)] {
        let mut desc = looking_down();
        let phong = Phong {
            ambient: Rgb::splat(0.3),
            diffuse: Rgb::splat(0.5),
            specular: Rgb::splat(0.8),
            shininess: exponent as f32,
            model,
            ..Phong::default()
        };
        add_material(&mut desc, "plastic", Material::Phong(phong));
        add_mesh(&mut desc, square(3.0), "plastic");
        desc.ambient = Some(Rgb::splat(0.2));
        desc.lights.push(LightDesc::Point {
            position: DVec3::new(-1.0, 3.0, 0.0),
            intensity: Rgb::splat(0.9),
            falloff: Falloff::None,
        });
        check(&desc, 2e-3, |x, z| {
            let l = (DVec3::new(-1.0, 3.0, 0.0) - DVec3::new(x, 0.0, z)).normalize();
            let (n, v) = (DVec3::Y, DVec3::Y);
            let cos_alpha = match model {
                PhongModel::Phong => (n * (2.0 * n.dot(l)) - l).dot(v),
                PhongModel::BlinnPhong => (l + v).normalize().dot(n),
            };
            0.3 * 0.2 + (0.5 * n.dot(l) + 0.8 * cos_alpha.max(0.0).powf(exponent)) * 0.9
        });
    }
}

#[test]
fn a_directional_light_on_a_sphere() {
    let mut desc = looking_down();
    add_material(&mut desc, "grey", diffuse(0.8));
    let ball = ShapeDesc::Sphere { center: DVec3::new(0.25, -1.0, 0.0), radius: 1.5 };
    desc.objects.push(ObjectDesc::new(ball, Some("grey")));
    let direction = DVec3::new(1.0, -2.0, 0.5);
    desc.lights.push(LightDesc::Directional { direction, irradiance: Rgb::splat(PI as f32) });
    check(&desc, 5e-3, |x, z| {
        let r2 = (x - 0.25).powi(2) + z * z;
        if r2 >= 1.5 * 1.5 {
            return 0.0;
        }
        let n = DVec3::new(x - 0.25, (2.25 - r2).sqrt(), z) / 1.5;
        0.8 * n.dot(-direction.normalize()).max(0.0)
    });
}

/// The shadow of a square plate under a point light is the plate, scaled from the light.
#[test]
fn hard_shadows_are_where_projection_puts_them() {
    for shadows in [true, false] {
        let mut desc = looking_down();
        desc.settings.shadows = if shadows { Shadows::Opaque } else { Shadows::None };
        add_material(&mut desc, "grey", diffuse(1.0));
        add_mesh(&mut desc, square(3.0), "grey");
        let plate = add_mesh(&mut desc, square(0.4), "grey");
        // Above the camera, which therefore does not see it.
        desc.objects[plate].transform = DAffine3::from_translation(DVec3::new(0.0, 12.0, 0.0));
        let light = DVec3::new(0.0, 16.0, 0.0);
        desc.lights.push(LightDesc::Point {
            position: light,
            intensity: Rgb::splat(256.0),
            falloff: Falloff::InverseSquare,
        });
        check(&desc, 2e-3, |x, z| {
            if shadows && x.abs() < 1.6 && z.abs() < 1.6 {
                return 0.0;
            }
            let d2 = x * x + 256.0 + z * z;
            256.0 / d2 * (16.0 / d2.sqrt()) / PI
        });
    }
}

#[test]
fn flat_shows_colours_and_background() {
    let mut desc = looking_down();
    desc.settings.integrator = IntegratorKind::Flat;
    desc.image.background = Some(Rgb::new(0.1, 0.2, 0.3));
    add_material(&mut desc, "grey", diffuse(0.7));
    add_mesh(&mut desc, square(1.0), "grey");
    check(&desc, 1e-6, |x, z| if x.abs() < 1.0 && z.abs() < 1.0 { 0.7 } else { 0.2 });
}

/// A mesh with normals, unevenly scaled and mirrored: its shading is that of the ellipsoid it
/// approximates, whether it is one object (baked) or a copy.
#[test]
fn normals_follow_the_inverse_transpose() {
    for copies in [1, 2] {
        let mut desc = looking_down();
        add_material(&mut desc, "white", diffuse(1.0));
        let mut mesh = sphere_mesh(96);
        let normals: Vec<[f32; 3]> =
            mesh.positions.as_flat().chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
        mesh.normals = Some(std::sync::Arc::new(normals));
        let object = add_mesh(&mut desc, mesh, "white");
        let m = DMat3::from_diagonal(DVec3::new(-1.8, 0.5, 1.0));
        desc.objects[object].transform = DAffine3::from_mat3(m);
        if copies == 2 {
            let mut far = desc.objects[object].clone();
            far.transform.translation = DVec3::new(50.0, 0.0, 0.0);
            desc.objects.push(far);
        }
        let to_light = DVec3::new(0.3, 0.9, -0.2).normalize();
        let irradiance = Rgb::splat(PI as f32);
        desc.lights.push(LightDesc::Directional { direction: -to_light, irradiance });
        check(&desc, 0.03, |x, z| {
            let (a, b) = (x / 1.8, z);
            if a * a + b * b > 0.98 {
                return if a * a + b * b > 1.0 { 0.0 } else { ellipsoid(a, b, to_light) };
            }
            ellipsoid(a, b, to_light)
        });
    }
}

/// n·l on the ellipsoid (1.8, 0.5, 1) above the point (1.8 a, b).
fn ellipsoid(a: f64, b: f64, to_light: DVec3) -> f64 {
    let height = (1.0 - a * a - b * b).max(0.0).sqrt();
    let n = DVec3::new(a / 1.8, height / 0.5, b).normalize();
    n.dot(to_light).max(0.0)
}

fn sphere_mesh(rings: u32) -> TriangleMesh {
    let sectors = 2 * rings;
    let mut xyz = Vec::new();
    for i in 0..=rings {
        for j in 0..sectors {
            let theta = PI * f64::from(i) / f64::from(rings);
            let phi = 2.0 * PI * f64::from(j) / f64::from(sectors);
            let p = [theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin()];
            xyz.extend(p.map(|x| x as f32));
        }
    }
    let at = |i: u32, j: u32| i * sectors + j % sectors;
    let triangles =
        (0..rings).flat_map(|i| (0..sectors).map(move |j| (i, j))).flat_map(|(i, j)| {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            [[a, b, c], [a, c, d]]
        });
    TriangleMesh::new(xyz, triangles.collect())
}

/// A scene 10⁷ units away gives the very picture that it gives at the origin.
#[test]
fn a_far_scene_is_the_same_picture() {
    let at = |offset: DVec3| {
        let mut desc = looking_down();
        add_material(&mut desc, "white", diffuse(1.0));
        // As a file of doubles would be read: an f64 origin and small f32 coordinates.
        let mut mesh = sphere_mesh(24);
        mesh.origin = offset;
        add_mesh(&mut desc, mesh, "white");
        let ball = ShapeDesc::Sphere { center: offset + DVec3::new(1.2, 0.0, 1.1), radius: 0.5 };
        desc.objects.push(ObjectDesc::new(ball, Some("white")));
        let mut floor = square(3.0);
        floor.origin = offset - DVec3::Y;
        add_mesh(&mut desc, floor, "white");
        let camera = desc.camera.as_mut().unwrap();
        camera.place = Some(PlaceDesc::LookAt {
            eye: offset + DVec3::new(0.0, 10.0, 0.0),
            target: offset,
            up: DVec3::NEG_Z,
        });
        desc.lights.push(LightDesc::Point {
            position: offset + DVec3::new(2.0, 5.0, 1.0),
            intensity: Rgb::splat(60.0),
            falloff: Falloff::InverseSquare,
        });
        desc.settings.samples = 16;
        desc
    };
    for &kind in AccelKind::ALL {
        let near = film_on(at(DVec3::ZERO), kind);
        let far = film_on(at(DVec3::new(1e7, -2e7, 3e7)), kind);
        let relative: f64 = near
            .mean
            .iter()
            .zip(&far.mean)
            .map(|(a, b)| {
                let (a, b) = (f64::from(a.g), f64::from(b.g));
                (a - b).powi(2) / (a * a + 0.01)
            })
            .sum::<f64>()
            / near.mean.len() as f64;
        assert!(relative < 1e-6, "{}: relMSE {relative}", kind.name());
        assert!(near.mean.iter().any(|c| c.g > 0.1));
    }
}

/// The error that the film states against the error that many seeds show.
#[test]
fn the_stated_error_is_the_true_one() {
    let mut desc = looking_down();
    desc.settings.samples = 16;
    add_material(&mut desc, "grey", diffuse(0.5));
    let ball = ShapeDesc::Sphere { center: DVec3::new(0.3, 0.0, 0.2), radius: 1.0 };
    desc.objects.push(ObjectDesc::new(ball, Some("grey")));
    desc.lights.push(LightDesc::Directional {
        direction: DVec3::new(1.0, -1.0, 0.2),
        irradiance: Rgb::splat(4.0),
    });
    let scene = Scene::build_quietly(desc, AccelKind::default()).unwrap();
    let films: Vec<Film> = (0..64)
        .map(|seed| render(&scene, &RenderJob { seed, ..RenderJob::default() }, &()).film)
        .collect();
    let n = films.len() as f64;
    let (mut stated, mut shown) = (0.0, 0.0);
    for i in 0..films[0].mean.len() {
        let values: Vec<f64> = films.iter().map(|f| f64::from(f.mean[i].g)).collect();
        let mean = values.iter().sum::<f64>() / n;
        shown += values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        stated += films
            .iter()
            .map(|f| f64::from(f.standard_error.as_ref().unwrap()[i].g).powi(2))
            .sum::<f64>()
            / n;
    }
    let ratio = stated / shown;
    assert!((0.8..1.25).contains(&ratio), "stated {stated}, shown {shown}: {ratio}");
}
