//! The ray tree: its stop rules, light and shadow through fog and glass, against closed forms and sums.
#![allow(missing_docs, reason = "a test program")]

mod common;

use alhazen::accel::AccelKind;
use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::film::Filter;
use alhazen::light::Falloff;
use alhazen::material::{
    Conductor, Dielectric, FresnelModel, Material, MirrorFresnel, glass as known_glass, metal,
};
use alhazen::medium::{Fog, FogProfile};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{
    LensDesc, LightDesc, MaterialDesc, ObjectDesc, PrototypeDesc, Reference, Scene, SceneDesc,
    Shadows, ShapeDesc,
};
use common::Random;
use common::optics::{
    add_material, add_mesh, add_sphere, block, fresnel, glass, mean, one_ray, parallel, picture,
    picture_of_seed, quad, seen,
};
use glam::{DAffine3, DVec3};

fn white(desc: &mut SceneDesc) {
    add_material(desc, "white", Material::Diffuse { reflectance: Rgb::splat(1.0) });
}

fn floor(half: f64) -> alhazen::geometry::TriangleMesh {
    quad(DVec3::new(-half, 0.0, half), DVec3::X * 2.0 * half, DVec3::NEG_Z * 2.0 * half)
}

/// Light between two mirrors that glow: e·(1 + ρ + ρ² + …), to any depth, without a stack to overflow.
#[test]
fn infinite_mirrors_are_a_geometric_series() {
    for (depth, rho) in [(0, 0.9), (1, 0.9), (7, 0.9), (60, 0.5), (20_000, 0.999), (200_000, 1.0)] {
        let mut desc = one_ray(DVec3::new(0.0, 1.0, 0.0), DVec3::ZERO);
        desc.settings.max_depth = depth;
        let emission = Rgb::splat(0.01);
        let mirror = Material::Mirror { reflectance: Rgb::splat(rho), fresnel: None };
        desc.materials.push(MaterialDesc { emission, ..MaterialDesc::new("mirror", mirror) });
        add_mesh(&mut desc, floor(2.0), "mirror");
        let above = DVec3::new(-2.0, 2.0, -2.0);
        add_mesh(&mut desc, quad(above, DVec3::X * 4.0, DVec3::Z * 4.0), "mirror");
        let (rho, n) = (f64::from(rho), f64::from(depth) + 1.0);
        let sum = if rho == 1.0 { n } else { (1.0 - rho.powf(n)) / (1.0 - rho) };
        let got = f64::from(seen(&desc).r);
        // The throughput is a product of as many factors, each rounded.
        assert!((got / (0.01 * sum) - 1.0).abs() < 3e-3, "{depth}: {got} {}", 0.01 * sum);
    }
}

/// In a surrounding that is white everywhere nothing looks brighter than white; what neither absorbs
/// nor ends early is white itself.
#[test]
fn no_material_makes_light() {
    let gold = metal("gold").unwrap();
    let law = |model| Some(MirrorFresnel { model, ior: 1.5 });
    let mirror = |fresnel| Material::Mirror { reflectance: Rgb::splat(1.0), fresnel };
    let dielectric = |d| Material::Dielectric(d);
    let cases = [
        ("diffuse", Material::Diffuse { reflectance: Rgb::splat(1.0) }, true),
        ("mirror", mirror(None), true),
        ("coated", mirror(law(FresnelModel::Exact)), false),
        (
            "gold",
            Material::Conductor(Conductor {
                eta: gold.eta,
                k: gold.k,
                fresnel: FresnelModel::Exact,
            }),
            false,
        ),
        ("glass", dielectric(glass(1.5)), true),
        ("schlick", dielectric(Dielectric { fresnel: FresnelModel::Schlick, ..glass(1.5) }), true),
        (
            "diamond",
            dielectric(Dielectric { ior: known_glass("diamond").unwrap(), ..glass(1.0) }),
            true,
        ),
        ("bubble", dielectric(glass(0.7)), true),
    ];
    for (name, material, is_white) in cases {
        let mut desc = parallel(24, 2.4, DVec3::Z * 5.0, DVec3::ZERO);
        desc.image.background = Some(Rgb::splat(1.0));
        desc.ambient = Some(Rgb::splat(1.0));
        desc.settings.max_depth = 24;
        let is_spectral = name == "diamond";
        desc.settings.samples = if is_spectral { 64 } else { 4 };
        add_material(&mut desc, "material", material);
        add_sphere(&mut desc, DVec3::ZERO, 0.7, "material");
        add_mesh(
            &mut desc,
            block(DVec3::new(-1.1, -1.1, -1.0), DVec3::new(-0.2, -0.3, -0.8)),
            "material",
        );
        let film = picture(&desc);
        let brightest = film.mean.iter().map(|c| c.max_component()).fold(0.0, f32::max);
        let mean = mean(&film);
        // One wavelength a sample is noise; its mean is not.
        assert!(is_spectral || brightest < 1.0 + 1e-5, "{name}: {brightest}");
        assert!(mean < 1.0 + 2e-3, "{name}: {mean}");
        if is_white {
            assert!(mean > 1.0 - 2e-3, "{name}: {mean}");
        }
    }
}

/// Mean and standard error over seeds.
fn over_seeds(desc: &SceneDesc, seeds: u64) -> (f64, f64) {
    let means: Vec<f64> = (0..seeds).map(|seed| mean(&picture_of_seed(desc, seed))).collect();
    let n = seeds as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

fn glass_balls() -> SceneDesc {
    let mut desc = parallel(24, 3.0, DVec3::new(1.0, 2.0, 5.0), DVec3::ZERO);
    desc.image.background = Some(Rgb::new(0.6, 0.8, 1.0));
    desc.settings.max_depth = 30;
    desc.settings.filter = Filter::Box;
    add_material(&mut desc, "glass", Material::Dielectric(glass(1.5)));
    add_material(
        &mut desc,
        "mirror",
        Material::Mirror { reflectance: Rgb::splat(0.9), fresnel: None },
    );
    for (x, material) in [(-0.8, "glass"), (0.2, "mirror"), (1.0, "glass")] {
        add_sphere(&mut desc, DVec3::new(x, 0.3 * x, 0.2), 0.45, material);
    }
    desc
}

/// Roulette has the mean of the whole tree; pruning alone has not, and errs downwards.
#[test]
fn roulette_is_unbiased_and_pruning_is_not() {
    let mut desc = glass_balls();
    desc.settings.samples = 4;
    let seeds = if common::verify() { 400 } else { 60 };
    let (whole, whole_error) = over_seeds(&desc, seeds);
    desc.settings.prune = 0.3;
    let (pruned, _) = over_seeds(&desc, 8);
    desc.settings.roulette = true;
    let (roulette, error) = over_seeds(&desc, seeds);
    let z = (roulette - whole) / error.hypot(whole_error);
    assert!(z.abs() < 4.0, "z = {z}: {roulette} {whole}");
    assert!(pruned < whole - 20.0 * whole_error.max(1e-4), "{pruned} {whole}");
}

/// Every rule counts the branches that it ends, and together they end all.
#[test]
fn every_branch_ends_by_a_rule() {
    let mut desc = glass_balls();
    desc.settings.samples = 2;
    let counts = |desc: &SceneDesc| {
        let scene = Scene::build_quietly(desc.clone(), AccelKind::default()).unwrap();
        render(&scene, &RenderJob::default(), &()).rays
    };
    for (prune, roulette, depth) in
        [(0.0, false, 30), (0.05, false, 30), (0.05, true, 30), (0.0, false, 2)]
    {
        desc.settings.prune = prune;
        desc.settings.roulette = roulette;
        desc.settings.max_depth = depth;
        let rays = counts(&desc);
        let ends = rays.ends;
        assert_eq!(ends.prune > 0, prune > 0.0 && !roulette);
        assert_eq!(ends.roulette > 0, roulette);
        // Light that is mirrored within glass fades, but never to nothing.
        assert!(ends.depth > 0 || prune > 0.0);
        // Each ray ends at nothing, at something diffuse, or has children, each of which was sent or
        // ended: no ray is lost.
        let traced = rays.camera + rays.reflection + rays.refraction;
        assert!(ends.miss > 0 && ends.miss < traced);
        assert_eq!(ends.diffuse, 0);
    }
}

/// T = exp(−σ s) along a camera ray, and again along the ray that a mirror sends on.
#[test]
fn fog_dims_every_ray_of_the_tree() {
    let fog = |profile| Fog {
        scattering: Rgb::new(0.3, 0.1, 0.0),
        absorption: Rgb::new(0.0, 0.2, 0.0),
        radiance: Rgb::splat(0.5),
        profile,
        dims_lights: false,
    };
    // Down onto a mirror at 45°, then along x to a white wall.
    let (first, second) = (3.0, 4.0);
    let mut desc = one_ray(DVec3::new(0.0, first, 0.0), DVec3::ZERO);
    desc.ambient = Some(Rgb::splat(1.0));
    white(&mut desc);
    add_material(
        &mut desc,
        "mirror",
        Material::Mirror { reflectance: Rgb::splat(1.0), fresnel: None },
    );
    let (u, v) = (DVec3::new(2.0, 2.0, 0.0), DVec3::Z * 2.0);
    add_mesh(&mut desc, quad(-0.5 * (u + v), u, v), "mirror");
    add_mesh(
        &mut desc,
        quad(DVec3::new(-second, -5.0, -5.0), DVec3::Y * 10.0, DVec3::Z * 10.0),
        "white",
    );
    desc.fog = Some(fog(FogProfile::Homogeneous));
    let got = seen(&desc).to_array().map(f64::from);
    for (got, (s, a)) in got.iter().zip([(0.3, 0.0), (0.1, 0.2), (0.0, 0.0)]) {
        let t = |d: f64| (-(s + a) * d).exp();
        let glow = if s + a > 0.0 { s / (s + a) * 0.5 } else { 0.0 };
        let through = |d: f64, behind: f64| t(d) * behind + (1.0 - t(d)) * glow;
        let expected = through(first, through(second, 1.0));
        assert!((got - expected).abs() < 1e-6, "{got} {expected}");
    }
    // Fog by distance is counted along each ray of the tree too.
    desc.fog = Some(fog(FogProfile::Distance { start: 1.0, end: 9.0 }));
    let t = |d: f64| (9.0 - d) / 8.0;
    let expected = t(first) * (t(second) + (1.0 - t(second)) * 0.5) + (1.0 - t(first)) * 0.5;
    let got = f64::from(seen(&desc).r);
    assert!((got - expected).abs() < 1e-6, "{got} {expected}");
    // A far camera looks through all of the fog, whether something is there or not.
    desc.fog = Some(fog(FogProfile::Distance { start: 0.0, end: 1e5 }));
    let camera = desc.camera.as_mut().unwrap();
    camera.projection = Projection::Perspective { fov: 1e-7 };
    let alhazen::scene::PlaceDesc::LookAt { eye, .. } = camera.place.as_mut().unwrap() else {
        unreachable!()
    };
    *eye = DVec3::Y * 5e4;
    let got = f64::from(seen(&desc).r);
    let expected = 0.5 + 0.5 * 0.5;
    assert!((got - expected).abs() < 1e-3, "{got} {expected}");
}

/// The light of a lamp on its way to a surface: 1/d², and exp(−σ d) where fog dims lights.
#[test]
fn fog_dims_lamps_where_it_is_told_to() {
    for dims_lights in [false, true] {
        let mut desc = one_ray(DVec3::new(0.0, 1.0, 0.0), DVec3::ZERO);
        white(&mut desc);
        add_mesh(&mut desc, floor(3.0), "white");
        let position = DVec3::new(0.0, 2.5, 0.0);
        let intensity = Rgb::splat(10.0);
        desc.lights.push(LightDesc::Point { position, intensity, falloff: Falloff::InverseSquare });
        desc.fog = Some(Fog {
            scattering: Rgb::BLACK,
            absorption: Rgb::splat(0.4),
            radiance: Rgb::BLACK,
            profile: FogProfile::Homogeneous,
            dims_lights,
        });
        let way = if dims_lights { 3.5 } else { 1.0 };
        let expected = 10.0 / (2.5 * 2.5) / std::f64::consts::PI * f64::exp(-0.4 * way);
        let got = f64::from(seen(&desc).r);
        assert!((got / expected - 1.0).abs() < 1e-5, "{got} {expected}");
    }
}

/// A pane between lamp and floor: nothing, exp(−σ d), or that times (1 − R)² arrives.
#[test]
fn light_passes_glass_as_the_user_chose() {
    let (sigma, thick) = (0.7, 0.4);
    for degrees in [0.0f64, 40.0, 70.0] {
        let theta = degrees.to_radians();
        let r = fresnel(1.0, 1.5, theta);
        let tint = (-sigma * thick / theta.cos()).exp();
        for (shadows, share) in [
            (Shadows::Opaque, 0.0),
            (Shadows::Tinted, tint),
            // The pane is passed straight: both faces are met at the angle outside.
            (Shadows::Fresnel, tint * (1.0 - r).powi(2)),
            (Shadows::None, 1.0),
        ] {
            let mut desc = one_ray(DVec3::new(0.0, 0.5, 0.0), DVec3::ZERO);
            desc.settings.shadows = shadows;
            white(&mut desc);
            add_mesh(&mut desc, floor(3.0), "white");
            let absorption = Rgb::splat(sigma as f32);
            add_material(
                &mut desc,
                "pane",
                Material::Dielectric(Dielectric { absorption, ..glass(1.5) }),
            );
            let pane = block(DVec3::new(-60.0, 1.0, -60.0), DVec3::new(60.0, 1.0 + thick, 60.0));
            add_mesh(&mut desc, pane, "pane");
            let direction = DVec3::new(theta.sin(), -theta.cos(), 0.0);
            let irradiance = Rgb::splat(std::f32::consts::PI);
            desc.lights.push(LightDesc::Directional { direction, irradiance });
            let expected = share * theta.cos();
            let got = f64::from(seen(&desc).r);
            // Rays start outside the error of the large pane's faces, which takes from the way inside.
            assert!((got - expected).abs() < 1e-4, "{degrees} {shadows:?}: {got} {expected}");
        }
    }
}

/// Where all glass is clear, shadow rays take no notice of it; they see what they would by passing it
/// surface by surface, as they do where any of it absorbs light, be it next to nothing.
#[test]
fn clear_glass_hides_nothing_however_it_is_passed() {
    let picture_with = |shadows, absorption: f32| {
        let mut desc = glass_balls();
        desc.settings.shadows = shadows;
        let absorption = Rgb::splat(absorption);
        let faint = Material::Dielectric(Dielectric { absorption, ..glass(1.3) });
        add_material(&mut desc, "faint", faint);
        add_sphere(&mut desc, DVec3::new(0.0, 1.2, 0.3), 0.3, "faint");
        let pane = block(DVec3::new(-2.0, 1.7, -2.0), DVec3::new(0.3, 1.8, 2.0));
        add_mesh(&mut desc, pane, "faint");
        white(&mut desc);
        add_sphere(&mut desc, DVec3::new(-0.3, 0.8, -0.4), 0.2, "white");
        add_mesh(&mut desc, floor(3.0), "white");
        let (direction, irradiance) = (DVec3::new(-0.3, -1.0, 0.2), Rgb::splat(2.0));
        desc.lights.push(LightDesc::Directional { direction, irradiance });
        picture(&desc).mean
    };
    let difference = |a: &[Rgb], b: &[Rgb]| {
        let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from((a.g - b.g).abs())).sum();
        sum / a.len() as f64
    };
    let clear = picture_with(Shadows::Tinted, 0.0);
    assert!(difference(&clear, &picture_with(Shadows::Tinted, 1e-12)) < 1e-5);
    assert!(difference(&clear, &picture_with(Shadows::Opaque, 0.0)) > 1e-2);
    assert!(difference(&clear, &picture_with(Shadows::None, 0.0)) > 1e-3);
}

/// Behind an edge at height h under a lamp of width w at height H, the penumbra is w·h/(H − h) wide, full
/// light on one side and none on the other.
#[test]
fn penumbras_are_as_wide_as_similar_triangles_say() {
    let (h, lamp_height, width) = (1.0, 5.0, 1.2);
    let penumbra = width * h / (lamp_height - h);
    let side = 96;
    let mut desc = parallel(side, 1.2, DVec3::new(0.0, 0.8, 0.0), DVec3::ZERO);
    desc.settings.samples = 64;
    white(&mut desc);
    add_mesh(&mut desc, floor(5.0), "white");
    // The edge lies above x = 0; the blocker is above the camera.
    let blocker = quad(DVec3::new(-30.0, h, 30.0), DVec3::X * 30.0, DVec3::NEG_Z * 60.0);
    add_mesh(&mut desc, blocker, "white");
    desc.lights.push(LightDesc::Rectangle {
        corner: DVec3::new(-0.5 * width, lamp_height, -0.05),
        edge_u: DVec3::X * width,
        edge_v: DVec3::Z * 0.1,
        radiance: Rgb::splat(40.0),
    });
    let film = picture(&desc);
    let mut open = desc.clone();
    open.objects.pop();
    let lit = picture(&open);
    for x in 0..side {
        let at = (f64::from(x) + 0.5) / f64::from(side) * 1.2 - 0.6;
        let share = film.pixel(x, side / 2).unwrap().r / lit.pixel(x, side / 2).unwrap().r;
        // The part of the lamp that is seen past the edge, from −w/2 at the penumbra's one end.
        let expected = (0.5 + at / penumbra).clamp(0.0, 1.0);
        let margin = 1.2 / f64::from(side) / penumbra;
        assert!((f64::from(share) - expected).abs() < margin + 0.04, "{at}: {share} {expected}");
        if at.abs() > 0.5 * penumbra + 0.02 {
            assert_eq!(share, expected as f32, "{at}");
        }
    }
}

/// Lamps with an area do not shadow themselves, wherever their shape comes from and however large the
/// floor below them is.
#[test]
fn glowing_things_are_not_in_their_own_light() {
    let area = 0.6 * 0.4;
    let height = 2.0;
    for (half, instanced) in [(3.0, false), (3.0, true), (5e3, false), (5e3, true)] {
        let mut desc = one_ray(DVec3::new(0.0, 1.0, 0.0), DVec3::ZERO);
        desc.settings.samples = 64;
        white(&mut desc);
        add_mesh(&mut desc, floor(half), "white");
        let black = Material::Diffuse { reflectance: Rgb::BLACK };
        let emission = Rgb::splat(5.0);
        desc.materials.push(MaterialDesc { emission, ..MaterialDesc::new("lamp", black) });
        let lamp = quad(DVec3::new(-0.3, height, -0.2), DVec3::X * 0.6, DVec3::Z * 0.4);
        if instanced {
            desc.meshes.push(lamp);
            let shape = ShapeDesc::Mesh(desc.meshes.len() - 1);
            let objects = vec![ObjectDesc::new(shape, Some("lamp"))];
            let at = Default::default();
            desc.prototypes.push(PrototypeDesc { name: "lamps".into(), at, objects });
            let transforms = vec![DAffine3::from_rotation_y(0.4)];
            let copies = ShapeDesc::Instances { prototype: Reference::new("lamps"), transforms };
            desc.objects.push(ObjectDesc::new(copies, None));
        } else {
            add_mesh(&mut desc, lamp, "lamp");
        }
        // Far enough for E ≈ L·A/d², less by what its extent makes of it: below 2 %.
        let expected = 5.0 * area / (height * height) / std::f64::consts::PI;
        let got = f64::from(seen(&desc).r);
        assert!((got / expected - 1.0).abs() < 0.03, "{half} {instanced}: {got} {expected}");
    }
}

/// Drawing a few of many lamps has the mean of asking each.
#[test]
fn many_lamps_are_drawn_without_bias() {
    let mut desc = parallel(12, 6.0, DVec3::new(0.0, 4.0, 0.0), DVec3::ZERO);
    desc.settings.samples = 2;
    white(&mut desc);
    add_mesh(&mut desc, floor(4.0), "white");
    add_sphere(&mut desc, DVec3::new(0.5, 0.4, 0.3), 0.4, "white");
    let mut random = Random(3);
    for i in 0..200 {
        let position = DVec3::new(
            random.between(-4.0, 4.0),
            random.between(0.2, 2.0),
            random.between(-4.0, 4.0),
        );
        let intensity = Rgb::splat(random.between(0.01, 0.3) as f32);
        desc.lights.push(if i % 10 == 0 {
            LightDesc::Sphere { center: position, radius: 0.02, radiance: intensity * 400.0 }
        } else {
            LightDesc::Point { position, intensity, falloff: Falloff::InverseSquare }
        });
    }
    desc.settings.light_samples = 1000;
    let (each, each_error) = over_seeds(&desc, 8);
    desc.settings.light_samples = 4;
    let (drawn, error) = over_seeds(&desc, if common::verify() { 200 } else { 40 });
    let z = (drawn - each) / error.hypot(each_error);
    assert!(z.abs() < 4.0 && error < 0.02 * each, "z = {z}: {drawn} ± {error}, {each}");
}

/// An edge behind the plane of focus is blurred over a circle of radius R·|z − f|/f.
#[test]
fn a_lens_blurs_by_its_circle_of_confusion() {
    let (radius, focus, distance) = (0.2, 2.0, 6.0);
    let confusion = radius * (distance - focus) / focus;
    let side = 64;
    let mut desc = parallel(side, 2.0, DVec3::ZERO, DVec3::NEG_Z);
    desc.settings.samples = 256;
    let camera = desc.camera.as_mut().unwrap();
    camera.lens = Some(LensDesc { radius, focus_distance: Some(focus) });
    desc.ambient = Some(Rgb::splat(1.0));
    white(&mut desc);
    // White where x > 0.
    let half_plane = quad(DVec3::new(0.0, -9.0, -distance), DVec3::X * 9.0, DVec3::Y * 18.0);
    add_mesh(&mut desc, half_plane, "white");
    let film = picture(&desc);
    for x in 0..side {
        let at = (f64::from(x) + 0.5) / f64::from(side) * 2.0 - 1.0;
        // The part of a disk beyond a line at the distance −at/confusion from its centre.
        let c = (-at / confusion).clamp(-1.0, 1.0);
        let expected = (c.acos() - c * (1.0 - c * c).sqrt()) / std::f64::consts::PI;
        let got = f64::from(film.pixel(x, side / 2).unwrap().r);
        assert!((got - expected).abs() < 0.04, "{at}: {got} {expected}");
    }
}

/// What a point sees of a hemisphere that a wall takes half of.
#[test]
fn ambient_occlusion_is_the_share_that_is_seen() {
    let mut desc = one_ray(DVec3::new(1e-3, 1.0, 0.0), DVec3::new(1e-3, 0.0, 0.0));
    desc.settings.integrator = alhazen::scene::IntegratorKind::Ao;
    desc.settings.samples = 4096;
    white(&mut desc);
    add_mesh(&mut desc, floor(50.0), "white");
    let wall = quad(DVec3::new(0.0, 0.0, -50.0), DVec3::Z * 100.0, DVec3::Y * 100.0);
    add_mesh(&mut desc, wall, "white");
    let got = f64::from(seen(&desc).r);
    assert!((got - 0.5).abs() < 0.005, "{got}");
    // Within a distance: the wall takes what is nearer than that.
    desc.settings.ao_distance = Some(1e-4);
    assert_eq!(seen(&desc).r, 1.0);
}

/// A turned copy of a glowing ball is a ball still, and lights a floor as E = L·A/d² at a distance.
#[test]
fn turned_copies_of_glowing_balls_shine() {
    let mut desc = one_ray(DVec3::new(0.0, 1.0, 0.0), DVec3::ZERO);
    desc.settings.samples = 16;
    white(&mut desc);
    add_mesh(&mut desc, floor(3.0), "white");
    let black = Material::Diffuse { reflectance: Rgb::BLACK };
    let emission = Rgb::splat(5.0);
    desc.materials.push(MaterialDesc { emission, ..MaterialDesc::new("lamp", black) });
    let ball = ShapeDesc::Sphere { center: DVec3::ZERO, radius: 0.1 };
    let objects = vec![ObjectDesc::new(ball, Some("lamp"))];
    let at = Default::default();
    desc.prototypes.push(PrototypeDesc { name: "lamps".into(), at, objects });
    let turn = DAffine3::from_rotation_x(0.3) * DAffine3::from_rotation_z(1.1);
    let transforms = vec![DAffine3::from_translation(DVec3::Y * 4.0) * turn];
    let copies = ShapeDesc::Instances { prototype: Reference::new("lamps"), transforms };
    desc.objects.push(ObjectDesc::new(copies, None));
    // Radiance of the floor: E/π = L·(r/d)².
    let expected = 5.0 * (0.1f64 / 4.0).powi(2);
    let got = f64::from(seen(&desc).r);
    assert!((got / expected - 1.0).abs() < 1e-3, "{got} {expected}");
}

/// Two panes between a lamp with an area and the floor do not make the lamp shadow itself.
#[test]
fn a_lamp_behind_panes_is_not_in_its_own_light() {
    let mut desc = one_ray(DVec3::new(0.0, 0.5, 0.0), DVec3::ZERO);
    desc.settings.samples = 64;
    desc.settings.shadows = Shadows::Tinted;
    white(&mut desc);
    add_mesh(&mut desc, floor(80.0), "white");
    add_material(&mut desc, "pane", Material::Dielectric(glass(1.5)));
    for y in [1.0, 1.3] {
        let pane = block(DVec3::new(-80.0, y, -80.0), DVec3::new(80.0, y + 0.1, 80.0));
        add_mesh(&mut desc, pane, "pane");
    }
    desc.lights.push(LightDesc::Rectangle {
        corner: DVec3::new(-0.1, 2.0, -0.1),
        edge_u: DVec3::X * 0.2,
        edge_v: DVec3::Z * 0.2,
        radiance: Rgb::splat(10.0),
    });
    let expected = 10.0 * 0.04 / 4.0 / std::f64::consts::PI;
    let got = f64::from(seen(&desc).r);
    assert!((got / expected - 1.0).abs() < 0.02, "{got} {expected}");
}
