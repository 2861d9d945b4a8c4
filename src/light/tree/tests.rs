//! The tree against all of its lights, one by one.

use std::sync::Arc;

use super::super::oracle::{Estimate, Random, tell};
use super::super::{
    DirectionalLight, DiskLight, Falloff, MeshLight, PointLight, RectangleLight, SphereLight,
    SpotLight,
};
use super::*;
use crate::color::Rgb;

fn point(random: &mut Random, at: DVec3) -> Light {
    let intensity = Rgb::splat(10f64.powf(random.between(-1.0, 1.0)) as f32);
    Light::Point(PointLight { position: at, intensity, falloff: Falloff::InverseSquare })
}

fn spot(random: &mut Random, at: DVec3) -> Light {
    let outer = random.between(0.1, std::f64::consts::PI);
    let inner = outer * random.between(0.0, 1.0);
    Light::Spot(SpotLight {
        position: at,
        direction: random.direction(),
        intensity: Rgb::new(0.0, 0.0, 10f64.powf(random.between(-1.0, 1.0)) as f32),
        cos_outer: outer.cos(),
        cos_inner: inner.cos(),
    })
}

fn sphere(random: &mut Random, at: DVec3, size: f64) -> Light {
    let radius = size * random.between(0.01, 1.0);
    Light::Sphere(SphereLight { center: at, radius, radiance: Rgb::splat(2.0) })
}

/// A light of any kind that has a place.
fn any(random: &mut Random, at: DVec3, size: f64) -> Light {
    let radiance = Rgb::splat(1.0);
    let edge_u = random.in_cube() * size;
    let edge_v = random.in_cube().cross(edge_u.normalize()) * size;
    match (random.unit() * 6.0) as u32 {
        0 => point(random, at),
        1 => spot(random, at),
        2 => sphere(random, at, size),
        3 => Light::Rectangle(RectangleLight { corner: at, edge_u, edge_v, radiance }),
        4 => Light::Disk(DiskLight {
            center: at,
            normal: random.direction(),
            radius: size,
            radiance,
        }),
        _ => {
            let corner = |random: &mut Random| at + random.in_cube() * size;
            let triangles: Arc<[_]> = (0..3).map(|_| [(); 3].map(|()| corner(random))).collect();
            Light::Mesh(MeshLight::new(triangles, radiance, random.unit() < 0.5))
        }
    }
}

/// What a plane of normal `n` at `p` receives of a light.
fn received(light: &Light, p: Vec3, n: Vec3, u: [f32; 2]) -> f64 {
    light.sample(p, u).map_or(0.0, |s| {
        let mean = f64::from(s.irradiance.r + s.irradiance.g + s.irradiance.b) / 3.0;
        mean * f64::from(s.direction.dot(n).max(0.0))
    })
}

#[test]
fn what_contributes_may_be_drawn() {
    let mut random = Random::new(20);
    for round in 0..150 {
        let spread = 10f64.powf(random.between(-3.0, 3.0));
        let at = random.in_cube() * 10f64.powf(random.between(-2.0, 4.0));
        let lights: Vec<Light> = (0..1 + round % 40)
            .map(|_| {
                let at = at + random.in_cube() * spread;
                let size = spread * random.between(0.001, 1.0);
                any(&mut random, at, size)
            })
            .collect();
        let tree = LightTree::new(&lights);
        assert_eq!(tree.len(), lights.len());
        for _ in 0..60 {
            let p = at + random.in_cube() * spread * 10f64.powf(random.between(-2.0, 2.0));
            let (p, n) = (p.as_vec3(), random.direction().as_vec3());
            for (index, light) in (0..).zip(&lights) {
                for _ in 0..4 {
                    let Some(s) = light.sample(p, random.square()) else { continue };
                    assert!(tree.probability(p, None, index) > 0.0, "{light:?} at {p}");
                    if s.direction.dot(n) > 0.0 {
                        assert!(tree.probability(p, Some(n), index) > 0.0, "{light:?} {p} {n}");
                    }
                }
            }
        }
    }
}

#[test]
fn probabilities_sum_to_one_less_what_leads_nowhere() {
    const STEPS: u32 = 1 << 14;
    let mut random = Random::new(21);
    for round in 0..40 {
        let lights: Vec<Light> = (0..100)
            .map(|_| {
                let at = random.in_cube() * 10.0;
                if round % 2 == 0 { point(&mut random, at) } else { any(&mut random, at, 1.0) }
            })
            .collect();
        let tree = LightTree::new(&lights);
        let p = (random.in_cube() * 15.0).as_vec3();
        let n = (round % 4 >= 2).then(|| random.direction().as_vec3());
        let probabilities: Vec<f64> =
            (0..100).map(|i| f64::from(tree.probability(p, n, i))).collect();
        let sum: f64 = probabilities.iter().sum();
        let mut shares = [0.0; 100];
        let mut nothing = 0.0;
        for i in 0..STEPS {
            match tree.sample(p, n, (i as f32 + 0.5) / STEPS as f32) {
                None => nothing += 1.0 / f64::from(STEPS),
                Some(picked) => {
                    let expected = probabilities[picked.index as usize] as f32;
                    assert!((picked.probability - expected).abs() <= 1e-5 * expected);
                    assert!((0.0..1.0).contains(&picked.u));
                    shares[picked.index as usize] += 1.0 / f64::from(STEPS);
                }
            }
        }
        // Each light is drawn by one interval of u, which starts and ends between two steps.
        for (share, probability) in shares.iter().zip(&probabilities) {
            assert!((share - probability).abs() <= 1.1 / f64::from(STEPS));
        }
        assert!((sum + nothing - 1.0).abs() < 100.0 / f64::from(STEPS), "{sum} and {nothing}");
        if round % 4 == 0 {
            assert!((sum - 1.0).abs() < 1e-5 && nothing == 0.0, "points reach everywhere: {sum}");
        }
    }
}

#[test]
fn estimates_agree_with_the_sum_and_vary_little() {
    let mut random = Random::new(22);
    type Make = fn(&mut Random, DVec3) -> Light;
    let kinds: [(&str, Make); 3] =
        [("points", point), ("spots", spot), ("spheres", |random, at| sphere(random, at, 0.05))];
    for (name, make) in kinds {
        let lights: Vec<Light> = (0..5000)
            .map(|_| {
                let at = random.in_cube() * DVec3::new(20.0, 5.0, 20.0);
                make(&mut random, at)
            })
            .collect();
        let tree = LightTree::new(&lights);
        let (mut gains, mut worst) = (Vec::new(), f64::INFINITY);
        for _ in 0..10 {
            let p = (random.in_cube() * DVec3::new(20.0, 5.0, 20.0)).as_vec3();
            let n = random.direction().as_vec3();
            // Of spheres the mean over points of each, as some are cut by the horizon.
            let samples = if name == "spheres" { 200 } else { 1 };
            let mut points = Random::new(1);
            let truth = Estimate::of(samples, |_| {
                let u = points.square();
                lights.iter().map(|light| received(light, p, n, u)).sum()
            });
            let truth = truth.mean;
            let by_tree = Estimate::of(40_000, |_| {
                let picked = tree.sample(p, Some(n), random.unit());
                picked.map_or(0.0, |picked| {
                    let u = [picked.u, random.unit()];
                    received(&lights[picked.index as usize], p, n, u)
                        / f64::from(picked.probability)
                })
            });
            assert!(
                by_tree.agrees_with(truth) || (by_tree.mean / truth - 1.0).abs() < 1e-4,
                "{name}: {by_tree:?}, not {truth}"
            );
            // The variance of drawing uniformly, by its definition.
            let squares: f64 =
                lights.iter().map(|light| received(light, p, n, [0.5; 2]).powi(2)).sum();
            let gain = (squares * 5000.0 - truth * truth) / by_tree.variance;
            worst = worst.min(gain);
            gains.push(gain);
        }
        gains.sort_by(f64::total_cmp);
        tell(&format!(
            "{name}: {:.0} times less variance than uniform (median), {worst:.0} at worst",
            gains[5]
        ));
        assert!(worst > 5.0, "{name}: {gains:?}");
    }
}

#[test]
fn what_is_left_of_u_is_uniform() {
    let mut random = Random::new(23);
    let lights: Vec<Light> = (0..300)
        .map(|_| {
            let at = random.in_cube() * 4.0;
            any(&mut random, at, 0.3)
        })
        .collect();
    let tree = LightTree::new(&lights);
    let (p, n) = (Vec3::new(0.3, -0.2, 1.0), Vec3::Y);
    let mut bins = [0u32; 32];
    for _ in 0..64_000 {
        if let Some(picked) = tree.sample(p, Some(n), random.unit()) {
            bins[(picked.u * 32.0) as usize] += 1;
        }
    }
    let expected = f64::from(bins.iter().sum::<u32>()) / 32.0;
    let chi2: f64 = bins.iter().map(|&b| (f64::from(b) - expected).powi(2) / expected).sum();
    // 31 degrees of freedom: 65 is exceeded with a chance of 4·10⁻⁴.
    assert!(chi2 < 65.0, "{chi2}: {bins:?}");
}

#[test]
fn light_without_a_place_is_always_evaluated() {
    let sun = Light::Directional(DirectionalLight {
        direction: Vec3::NEG_Y,
        irradiance: Rgb::splat(1.0),
    });
    let lecture =
        PointLight { position: DVec3::ONE, intensity: Rgb::splat(1.0), falloff: Falloff::None };
    let lamp = PointLight { falloff: Falloff::InverseSquare, ..lecture.clone() };
    let dark = PointLight { intensity: Rgb::BLACK, ..lamp.clone() };
    let lights = [sun, Light::Point(dark), Light::Point(lecture), Light::Point(lamp)];
    let tree = LightTree::new(&lights);
    assert_eq!((tree.always(), tree.len()), (&[0, 2][..], 1));
    let probabilities = [0, 1, 2, 3].map(|i| tree.probability(Vec3::ZERO, None, i));
    assert_eq!(probabilities, [1.0, 0.0, 1.0, 1.0]);
    let picked = tree.sample(Vec3::ZERO, None, 0.75).unwrap();
    assert_eq!(picked, PickedLight { index: 3, probability: 1.0, u: 0.75 });
    assert_eq!(tree.sample(Vec3::ZERO, Some(Vec3::NEG_Y), 0.75), None, "below the horizon");
    let empty = LightTree::new(&lights[..3]);
    assert!(empty.is_empty() && empty.sample(Vec3::ZERO, None, 0.5).is_none());
}

#[test]
fn odd_places_are_no_matter() {
    let mut random = Random::new(24);
    let same = |_: i32| DVec3::ONE;
    let row = |i: i32| DVec3::X * f64::from(i);
    // Each a hundred times as far as the one before: as deep a tree as there is.
    let series = |i: i32| DVec3::Z * 10f64.powi(i % 70 - 35);
    let places: [&dyn Fn(i32) -> DVec3; 3] = [&same, &row, &series];
    for place in places {
        let lights: Vec<Light> = (0..2000).map(|i| point(&mut random, place(i))).collect();
        let tree = LightTree::new(&lights);
        assert_eq!(tree.len(), 2000);
        for p in [Vec3::ZERO, Vec3::ONE, Vec3::splat(1e30), Vec3::splat(f32::MAX)] {
            let sum: f32 = (0..2000).map(|i| tree.probability(p, None, i)).sum();
            assert!((sum - 1.0).abs() < 1e-3, "{sum} at {p}");
            for u in [0.0, 0.5, 1f32.next_down()] {
                let picked = tree.sample(p, None, u).expect("points reach everywhere");
                assert!(picked.probability > 0.0 && picked.u < 1.0);
            }
        }
    }
}

#[test]
fn a_hundred_thousand_lights() {
    let mut random = Random::new(25);
    let lights: Vec<Light> = (0..100_000)
        .map(|i| {
            let at = random.in_cube() * 100.0;
            if i % 2 == 0 { point(&mut random, at) } else { spot(&mut random, at) }
        })
        .collect();
    let start = std::time::Instant::now();
    let tree = LightTree::new(&lights);
    let built = start.elapsed();
    assert_eq!(tree.len(), lights.len());
    let start = std::time::Instant::now();
    let mut sum = 0.0;
    for _ in 0..100_000 {
        let p = (random.in_cube() * 100.0).as_vec3();
        sum += tree.sample(p, Some(Vec3::Y), random.unit()).map_or(0.0, |s| s.u);
    }
    tell(&format!(
        "100,000 lights: built in {built:.1?}, 100,000 drawn in {:.1?}, {sum}",
        start.elapsed()
    ));
}
