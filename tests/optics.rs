//! Mirrors and glass against the closed forms of geometrical optics.
#![allow(missing_docs, reason = "a test program")]

mod common;

use alhazen::color::Rgb;
use alhazen::material::{
    Conductor, Dielectric, FresnelModel, FresnelPower, Ior, Material, MirrorFresnel, Phong,
    glass as known_glass, metal,
};
use common::optics::{
    add_material, add_mesh, add_ruler, add_sphere, block, extruded, fresnel, glass, one_ray,
    picture, quad, seen,
};
use glam::{DVec2, DVec3};

/// The direction `degrees` from straight down, towards +x.
fn down(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin, -cos, 0.0)
}

fn floor(y: f64) -> alhazen::geometry::TriangleMesh {
    quad(DVec3::new(-50.0, y, 50.0), DVec3::X * 100.0, DVec3::NEG_Z * 100.0)
}

/// A slab displaces a ray by d·sin θ·(1 − cos θ/(n·cos θ')), and lets (1 − R)² through on the straight way.
#[test]
fn a_slab_displaces_a_ray_and_dims_it() {
    let (n, thick) = (1.5, 0.8);
    for degrees in [0.0, 20.0, 45.0, 70.0, 85.0] {
        let d = down(degrees);
        let mut desc = one_ray(DVec3::new(0.0, 2.0, 0.0) - 3.0 * d, DVec3::new(0.0, 2.0, 0.0));
        // In, out, and no further: inner reflections are left out.
        desc.settings.max_depth = 2;
        add_material(&mut desc, "glass", Material::Dielectric(glass(n)));
        let slab = block(DVec3::new(-40.0, 2.0 - thick, -40.0), DVec3::new(40.0, 2.0, 40.0));
        add_mesh(&mut desc, slab, "glass");
        add_ruler(&mut desc, floor(0.0), DVec3::new(-1.0, 0.0, 0.0), DVec3::X * 31.0);
        let theta = f64::to_radians(degrees);
        let inside = (theta.sin() / n).asin();
        let x = thick * inside.tan() + (2.0 - thick) * theta.tan();
        let r = fresnel(1.0, n, theta);
        let expected = (x + 1.0) / 31.0 * (1.0 - r).powi(2);
        let got = f64::from(seen(&desc).r);
        assert!((got - expected).abs() < 3e-6, "{degrees}: {got} {expected}");
    }
}

/// All inner reflections together: (1 − R)/(1 + R) goes through, 2R/(1 + R) comes back.
#[test]
fn the_inner_reflections_of_a_slab_add_up() {
    for degrees in [0.0, 30.0, 60.0, 80.0] {
        let d = down(degrees);
        let r = fresnel(1.0, 1.7, f64::to_radians(degrees));
        for (from_below, expected) in [(true, (1.0 - r) / (1.0 + r)), (false, 2.0 * r / (1.0 + r))]
        {
            let mut desc = one_ray(-3.0 * d, DVec3::ZERO);
            desc.settings.max_depth = 60;
            add_material(&mut desc, "glass", Material::Dielectric(glass(1.7)));
            add_mesh(
                &mut desc,
                block(DVec3::new(-40.0, -0.1, -40.0), DVec3::new(40.0, 0.0, 40.0)),
                "glass",
            );
            // What is white is either below or above.
            desc.ambient = Some(Rgb::splat(1.0));
            let white = Material::Diffuse { reflectance: Rgb::splat(1.0) };
            add_material(&mut desc, "white", white);
            add_mesh(&mut desc, floor(if from_below { -1.0 } else { 4.0 }), "white");
            let got = f64::from(seen(&desc).r);
            assert!((got - expected).abs() < 3e-6, "{degrees}: {got} {expected}");
        }
    }
}

/// Three mirrors at right angles send a ray back where it came from, displaced to the other side.
#[test]
fn a_corner_of_mirrors_sends_rays_back() {
    let d = DVec3::new(-0.5, -0.7, -0.6).normalize();
    for offset in [DVec3::new(0.1, 0.05, -0.08), DVec3::new(-0.03, 0.2, 0.1)] {
        let q = offset.reject_from_normalized(d);
        let eye = q - 4.0 * d;
        let mut desc = one_ray(eye, eye + d);
        let mirror = Material::Mirror { reflectance: Rgb::splat(0.9), fresnel: None };
        add_material(&mut desc, "mirror", mirror);
        let (x, y, z) = (DVec3::X * 9.0, DVec3::Y * 9.0, DVec3::Z * 9.0);
        for (u, v) in [(x, y), (y, z), (z, x)] {
            add_mesh(&mut desc, quad(DVec3::ZERO, u, v), "mirror");
        }
        // A screen behind the camera, across the view; it shows the offset along one direction.
        let (a, b) = d.any_orthonormal_pair();
        let at = -5.0 * d;
        add_ruler(&mut desc, quad(at - 2.0 * a - 2.0 * b, 4.0 * a, 4.0 * b), at - a, 2.0 * a);
        let expected = 0.9f64.powi(3) * (0.5 - 0.5 * q.dot(a));
        let got = f64::from(seen(&desc).r);
        assert!((got - expected).abs() < 3e-6, "{got} {expected}");
    }
}

/// A ball of glass brings rays near its axis together at n·r/(2(n − 1)) from its centre.
#[test]
fn a_ball_of_glass_focuses_where_it_should() {
    for n in [1.3, 1.5, 1.9] {
        let focus = n / (2.0 * (n - 1.0));
        let height = 1e-3;
        let eye = DVec3::new(0.0, height, 5.0);
        let mut desc = one_ray(eye, eye - DVec3::Z);
        add_material(&mut desc, "glass", Material::Dielectric(glass(n)));
        add_sphere(&mut desc, DVec3::ZERO, 1.0, "glass");
        // Rays of this height miss the focus by the height to the third power.
        let z = -(focus + 0.1);
        let screen = quad(DVec3::new(-1.0, -1.0, z), DVec3::X * 2.0, DVec3::Y * 2.0);
        desc.settings.max_depth = 2;
        add_ruler(&mut desc, screen, DVec3::new(0.0, -0.01, 0.0), DVec3::Y * 0.02);
        let through = (1.0 - fresnel(1.0, n, 0.0)).powi(2);
        let y = f64::from(seen(&desc).r) / through * 0.02 - 0.01;
        // Beyond the focus it is upside down, by similar triangles: y/h = −0.1/f.
        let expected = -height * 0.1 / focus;
        assert!((y - expected).abs() < 1e-3 * height, "{n}: {y} {expected}");
    }
}

/// exp(−σ·s) along every chord of a ball that does not bend light.
#[test]
fn absorption_follows_beer_and_lambert() {
    let mut desc = common::optics::parallel(32, 2.0, DVec3::Z * 5.0, DVec3::ZERO);
    desc.image.background = Some(Rgb::splat(1.0));
    let absorption = Rgb::new(0.5, 2.0, 0.0);
    add_material(&mut desc, "ink", Material::Dielectric(Dielectric { absorption, ..glass(1.0) }));
    add_sphere(&mut desc, DVec3::ZERO, 0.9, "ink");
    desc.settings.filter = alhazen::film::Filter::Box;
    desc.image.size = [1, 1];
    let camera = desc.camera.as_mut().unwrap();
    camera.projection = alhazen::camera::Projection::Orthographic { height: 1e-6 };
    for h in [0.0, 0.3, 0.6, 0.85, 0.95] {
        let eye = DVec3::new(h, 0.0, 5.0);
        let camera = desc.camera.as_mut().unwrap();
        camera.place =
            Some(alhazen::scene::PlaceDesc::LookAt { eye, target: eye - DVec3::Z, up: DVec3::Y });
        let chord = 2.0 * (0.81f64 - h * h).max(0.0).sqrt();
        let got = seen(&desc);
        for (got, sigma) in got.to_array().into_iter().zip(absorption.to_array()) {
            let expected = (-f64::from(sigma) * chord).exp();
            assert!((f64::from(got) - expected).abs() < 2e-6, "{h}: {got} {expected}");
        }
    }
}

/// The deviation of a prism of N-BK7 at the Fraunhofer lines, from the catalogue's own indices.
#[test]
fn a_prism_deviates_each_wavelength_by_its_index() {
    let apex = 60f64.to_radians();
    // Half of the prism's faces lean ±30° from the vertical y; it points up.
    let (s, c) = (0.5 * apex).sin_cos();
    let outline = [[-2.0 * s, -c], [2.0 * s, -c], [0.0, c]];
    let incidence = 50f64.to_radians();
    // The normal of the left face points to (−cos 30°, sin 30°); the ray comes from below it.
    let normal = DVec2::new(-c, s);
    let d = DVec2::from_angle(normal.to_angle() + std::f64::consts::PI + incidence);
    let hit = DVec2::new(-s, 0.0);
    for (line, n) in
        [(656.273, 1.51432), (587.562, 1.51680), (486.133, 1.52238), (435.835, 1.52668)]
    {
        let eye = (hit - 3.0 * d).extend(0.0);
        let mut desc = one_ray(eye, eye + d.extend(0.0));
        desc.settings.wavelength = Some(line);
        desc.settings.max_depth = 2;
        let bk7 = Dielectric { ior: known_glass("bk7").unwrap(), ..glass(1.0) };
        add_material(&mut desc, "prism", Material::Dielectric(bk7));
        add_mesh(&mut desc, extruded(&outline, -1.0, 1.0), "prism");

        // The closed form: refraction at both faces.
        let inside = (incidence.sin() / n).asin();
        let second = apex - inside;
        let out = (n * second.sin()).asin();
        let deviation = incidence + out - apex;
        // Where it leaves: along the inner direction from the point of incidence.
        let inner = DVec2::from_angle(d.to_angle() - (incidence - inside));
        let right = DVec2::new(c, s);
        let t = (DVec2::new(0.0, c) - hit).dot(right) / inner.dot(right);
        let leave = hit + inner * t;
        let direction = DVec2::from_angle(d.to_angle() - deviation);
        // A screen far to the right.
        let x = 40.0;
        let y = leave.y + direction.y / direction.x * (x - leave.x);
        let from = DVec3::new(x, y - 1.0, 0.0);
        let screen = quad(DVec3::new(x, -90.0, -2.0), DVec3::Z * 4.0, DVec3::Y * 180.0);
        add_ruler(&mut desc, screen, from, DVec3::Y * 2.0);
        let through = (1.0 - fresnel(1.0, n, incidence)) * (1.0 - fresnel(n, 1.0, second));
        let landed = f64::from(seen(&desc).g) / through * 2.0 - 1.0;
        // Five decimals of the index are 2·10⁻⁵ rad of deviation: 10⁻³ here. Blue and red land 0.9 apart.
        assert!(landed.abs() < 2e-3, "{line} nm lands {landed} off");
    }
}

/// What a surface mirrors of a white surrounding is its Fresnel term.
#[test]
fn mirrors_follow_the_three_laws() {
    let power = FresnelPower { offset: 0.05, scale: 0.4, power: 2.5 };
    for degrees in [0.0f64, 15.0, 40.0, 60.0, 75.0, 88.0] {
        let cos = degrees.to_radians().cos();
        let schlick = |r0: f64, cos: f64| r0 + (1.0 - r0) * (1.0 - cos).powi(5);
        for (model, expected) in [
            (FresnelModel::Exact, fresnel(1.0, 1.5, degrees.to_radians())),
            (FresnelModel::Schlick, schlick(0.04, cos)),
            (FresnelModel::Power(power), 0.05 + 0.4 * (1.0 - cos).powf(2.5)),
        ] {
            let law = Some(MirrorFresnel { model, ior: 1.5 });
            let coated = Phong {
                diffuse: Rgb::BLACK,
                ambient: Rgb::BLACK,
                mirror: Rgb::splat(0.8),
                fresnel: law,
                ..Phong::default()
            };
            let dark = Dielectric { absorption: Rgb::splat(1e4), fresnel: model, ..glass(1.5) };
            for (material, expected) in [
                (Material::Phong(coated), 0.8 * expected),
                (Material::Mirror { reflectance: Rgb::splat(0.5), fresnel: law }, 0.5 * expected),
                (Material::Dielectric(dark), expected),
            ] {
                let d = down(degrees);
                let mut desc = one_ray(-3.0 * d, DVec3::ZERO);
                desc.image.background = Some(Rgb::splat(1.0));
                let what = format!("{material:?} at {degrees}");
                add_material(&mut desc, "surface", material);
                add_mesh(
                    &mut desc,
                    block(DVec3::splat(-40.0), DVec3::new(40.0, 0.0, 40.0)),
                    "surface",
                );
                let got = f64::from(seen(&desc).r);
                assert!((got - expected).abs() < 2e-5, "{what}: {got} {expected}");
            }
        }
    }
}

/// Schlick from within: the angle is the one in the air, and beyond the critical one all is reflected.
#[test]
fn schlick_is_taken_on_the_right_side() {
    for degrees in [10.0f64, 30.0, 40.0, 45.0, 60.0] {
        let d = down(degrees);
        // The camera stands in glass whose upper face is y = 0, and looks up at it.
        let up = DVec3::new(d.x, -d.y, 0.0);
        let mut desc = one_ray(DVec3::new(0.0, -2.0, 0.0), DVec3::new(0.0, -2.0, 0.0) + up);
        desc.settings.max_depth = 1;
        desc.image.background = Some(Rgb::splat(1.0));
        let material = Dielectric { fresnel: FresnelModel::Schlick, ..glass(1.5) };
        add_material(&mut desc, "glass", Material::Dielectric(material));
        add_mesh(&mut desc, block(DVec3::splat(-40.0), DVec3::new(40.0, 0.0, 40.0)), "glass");
        let sin_t = 1.5 * degrees.to_radians().sin();
        let expected = if sin_t >= 1.0 {
            0.0
        } else {
            1.0 - (0.04 + 0.96 * (1.0 - (1.0 - sin_t * sin_t).sqrt()).powi(5))
        };
        let got = f64::from(seen(&desc).r);
        assert!((got - expected).abs() < 1e-5, "{degrees}: {got} {expected}");
    }
}

/// A conductor against |r|² of the complex amplitudes.
#[test]
fn metals_follow_fresnel_with_a_complex_index() {
    let gold = metal("gold").unwrap();
    for degrees in [0.0f64, 45.0, 80.0] {
        let d = down(degrees);
        let mut desc = one_ray(-3.0 * d, DVec3::ZERO);
        desc.image.background = Some(Rgb::splat(1.0));
        let conductor = Conductor { eta: gold.eta, k: gold.k, fresnel: FresnelModel::Exact };
        add_material(&mut desc, "gold", Material::Conductor(conductor));
        add_mesh(&mut desc, floor(0.0), "gold");
        let got = seen(&desc).to_array();
        for (i, got) in got.into_iter().enumerate() {
            let (n, k) = (f64::from(gold.eta.to_array()[i]), f64::from(gold.k.to_array()[i]));
            let (cos, sin2) = (degrees.to_radians().cos(), degrees.to_radians().sin().powi(2));
            // m·cos θt = √(m² − sin²θ) in complex numbers, m = n + ik.
            let (re, im) = (n * n - k * k - sin2, 2.0 * n * k);
            let modulus = (re * re + im * im).sqrt();
            let (a, b) = ((0.5 * (modulus + re)).sqrt(), (0.5 * (modulus - re)).sqrt());
            let square = |re: f64, im: f64| re * re + im * im;
            let s = square(cos - a, -b) / square(cos + a, b);
            // m²·cos θ
            let (mr, mi) = ((n * n - k * k) * cos, 2.0 * n * k * cos);
            let p = square(mr - a, mi - b) / square(mr + a, mi + b);
            let expected = 0.5 * (s + p);
            assert!((f64::from(got) - expected).abs() < 1e-5, "{degrees}: {got} {expected}");
        }
    }
}

/// Where two media overlap the one of higher priority counts, and its surface alone bends light.
#[test]
fn nested_media_follow_their_priorities() {
    let slab = |desc: &mut _, name: &str, ior: f64, priority: i32, top: f64, bottom: f64| {
        add_material(desc, name, Material::Dielectric(Dielectric { priority, ..glass(ior) }));
        add_mesh(desc, block(DVec3::new(-40.0, bottom, -40.0), DVec3::new(40.0, top, 40.0)), name);
    };
    let d = down(50.0);
    let (theta, depth) = (50f64.to_radians(), 6);
    let look = |fill: &dyn Fn(&mut alhazen::scene::SceneDesc)| {
        let mut desc = one_ray(DVec3::Y * 2.0 - 3.0 * d, DVec3::Y * 2.0);
        desc.settings.max_depth = depth;
        fill(&mut desc);
        add_ruler(&mut desc, floor(0.0), DVec3::new(-1.0, 0.0, 0.0), DVec3::X * 10.0);
        f64::from(seen(&desc).r)
    };
    // Glass from 2 to 1.5, water from 1.6 (overlapping) to 1.0: the glass fills the overlap.
    let nested = look(&|desc| {
        slab(desc, "glass", 1.5, 2, 2.0, 1.5);
        slab(desc, "water", 1.33, 1, 1.6, 1.0);
    });
    let x = 0.5 * (theta.sin() / 1.5).asin().tan()
        + 0.5 * (theta.sin() / 1.33).asin().tan()
        + theta.tan();
    let inside = |n: f64| (theta.sin() / n).asin();
    let through = (1.0 - fresnel(1.0, 1.5, theta))
        * (1.0 - fresnel(1.5, 1.33, inside(1.5)))
        * (1.0 - fresnel(1.33, 1.0, inside(1.33)));
    // Inner reflections add a little, landing further on: bounded by their weight.
    let expected = (x + 1.0) / 10.0 * through;
    assert!((nested - expected).abs() < 0.02 && nested >= expected - 1e-5, "{nested} {expected}");
    // With the priorities exchanged the water fills it, and the ray lands further on.
    let exchanged = look(&|desc| {
        slab(desc, "glass", 1.5, 1, 2.0, 1.5);
        slab(desc, "water", 1.33, 2, 1.6, 1.0);
    });
    let further = 0.1 * (inside(1.33).tan() - inside(1.5).tan()) / 10.0 * through;
    let got = exchanged - nested;
    assert!((got - further).abs() < 0.1 * further, "{got} {further}");

    // A block of the same medium inside changes nothing at all.
    let alone = look(&|desc| slab(desc, "water", 1.33, 0, 2.0, 1.0));
    let within = look(&|desc| {
        slab(desc, "water", 1.33, 0, 2.0, 1.0);
        slab(desc, "more", 1.33, 0, 1.8, 1.2);
    });
    assert!((alone - within).abs() < 2e-5, "{alone} {within}");
}

/// A camera in water sees out through the window that Snell's law leaves it.
#[test]
fn a_camera_in_water_knows_it() {
    for degrees in [0.0f64, 20.0, 40.0, 55.0] {
        let up = DVec3::new(degrees.to_radians().sin(), degrees.to_radians().cos(), 0.0);
        let eye = DVec3::new(0.0, -1.0, 0.0);
        let mut desc = one_ray(eye, eye + up);
        desc.settings.max_depth = 1;
        let absorption = Rgb::splat(0.3);
        let water = Dielectric { absorption, ..glass(1.33) };
        add_material(&mut desc, "water", Material::Dielectric(water));
        add_mesh(&mut desc, block(DVec3::splat(-40.0), DVec3::new(40.0, 0.0, 40.0)), "water");
        add_ruler(&mut desc, floor(2.0), DVec3::new(-1.0, 0.0, 0.0), DVec3::X * 40.0);
        let theta = degrees.to_radians();
        let sin_t = 1.33 * theta.sin();
        let expected = if sin_t >= 1.0 {
            0.0
        } else {
            let x = theta.tan() + 2.0 * sin_t.asin().tan();
            let dimmed = (-0.3 / theta.cos()).exp();
            (x + 1.0) / 40.0 * (1.0 - fresnel(1.33, 1.0, theta)) * dimmed
        };
        let got = f64::from(seen(&desc).r);
        assert!((got - expected).abs() < 1e-5, "{degrees}: {got} {expected}");
    }
}

/// Spectral sampling keeps white what does not part colours: a dispersive slab with parallel faces
/// before a white wall, and the share that it reflects.
#[test]
fn all_wavelengths_together_are_white() {
    let mut desc = common::optics::parallel(16, 0.1, DVec3::new(1.0, 3.0, 0.0), DVec3::ZERO);
    desc.settings.samples = 256;
    desc.settings.max_depth = 40;
    desc.image.background = Some(Rgb::splat(1.0));
    let flint = Dielectric { ior: Ior::Cauchy { a: 1.6, b: 0.03, c: 0.0 }, ..glass(1.0) };
    add_material(&mut desc, "flint", Material::Dielectric(flint));
    add_mesh(
        &mut desc,
        block(DVec3::new(-40.0, -0.5, -40.0), DVec3::new(40.0, 0.0, 40.0)),
        "flint",
    );
    let film = picture(&desc);
    let n = film.mean.len() as f64;
    for channel in 0..3 {
        let values: Vec<f64> = film.mean.iter().map(|c| f64::from(c.to_array()[channel])).collect();
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let z = (mean - 1.0) / (variance / n).sqrt().max(1e-6);
        assert!(z.abs() < 4.0 && (mean - 1.0).abs() < 0.01, "channel {channel}: {mean}, z = {z}");
    }
}
