//! The lecture's scenes: each shows what its slide adds. Two renders of one scene draw the same camera rays, so
//! pictures are compared pixel by pixel.
#![cfg(feature = "embree")] // Brute force would take minutes for the knot.
#![allow(missing_docs, reason = "a test program")]

use std::path::{Path, PathBuf};

use alhazen::accel::AccelKind;
use alhazen::color::Rgb;
use alhazen::film::{Film, Filter};
use alhazen::io::{LoadOptions, load_scene};
use alhazen::material::{FresnelModel, FresnelPower, Ior, Material};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{
    IntegratorKind, LightDesc, Maps, ObjectDesc, PlaceDesc, Scene, SceneDesc, Shadows, ShapeDesc,
};
use glam::DVec3;

mod common;

const SIZE: [u32; 2] = [160, 100];

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

fn load(path: &Path) -> SceneDesc {
    let loaded = load_scene(path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(loaded.warnings.is_empty(), "{}: {:?}", path.display(), loaded.warnings);
    let mut desc = loaded.scene;
    desc.image.size = SIZE;
    desc.settings.samples = 1;
    desc.settings.filter = Filter::Box;
    desc
}

/// The scene of a slide, small, with one sample for each pixel.
fn slide(number: u32) -> SceneDesc {
    let prefix = format!("{number:02}-");
    let all = common::files(&scenes().join("lecture"), &["toml"]);
    let of_slide =
        |path: &&PathBuf| path.file_name().unwrap().to_string_lossy().starts_with(&prefix);
    load(all.iter().find(of_slide).unwrap_or_else(|| panic!("no slide {number}")))
}

/// With a change made to it.
fn with(desc: &SceneDesc, change: impl FnOnce(&mut SceneDesc)) -> SceneDesc {
    let mut desc = desc.clone();
    change(&mut desc);
    desc
}

fn film(desc: &SceneDesc) -> Film {
    let scene = Scene::build_quietly(desc.clone(), AccelKind::default());
    let rendered = render(&scene.unwrap_or_else(|e| panic!("{e:?}")), &RenderJob::default(), &());
    assert_eq!(rendered.non_finite.count, 0);
    rendered.film
}

fn pixels(desc: &SceneDesc) -> Vec<Rgb> {
    film(desc).mean
}

/// a − b by colour.
fn minus(a: Rgb, b: Rgb) -> Rgb {
    a + b * -1.0
}

/// The least and the largest of a − b over all pixels and colours.
fn range(a: &[Rgb], b: &[Rgb]) -> (f32, f32) {
    let all = a.iter().zip(b).flat_map(|(a, b)| minus(*a, *b).to_array());
    all.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// The share of pixels that differ by more than `by`.
fn changed(a: &[Rgb], b: &[Rgb], by: f32) -> f64 {
    let differs = |(a, b): &(&Rgb, &Rgb)| minus(**a, **b).to_array().iter().any(|d| d.abs() > by);
    a.iter().zip(b).filter(differs).count() as f64 / a.len() as f64
}

fn material<'d>(desc: &'d mut SceneDesc, name: &str) -> &'d mut Material {
    let found = desc.materials.iter_mut().find(|m| m.name == name);
    &mut found.unwrap_or_else(|| panic!("no material {name}")).material
}

fn is_of(object: &ObjectDesc, name: &str) -> bool {
    object.material.as_ref().is_some_and(|m| m.name == name)
}

/// Centre and radius of the sphere of a material.
fn sphere(desc: &SceneDesc, name: &str) -> (DVec3, f64) {
    let shape = |o: &ObjectDesc| match o.shape {
        ShapeDesc::Sphere { center, radius } if is_of(o, name) => Some((center, radius)),
        _ => None,
    };
    desc.objects.iter().find_map(shape).unwrap_or_else(|| panic!("no sphere of {name}"))
}

/// The pixels within `share` of the radius of a sphere's middle.
fn on_sphere(desc: &SceneDesc, name: &str, share: f64) -> Vec<usize> {
    let (center, radius) = sphere(desc, name);
    let camera = desc.camera.as_ref().unwrap();
    let Some(PlaceDesc::LookAt { eye, target, up }) = camera.place else { panic!("no place") };
    let forward = (target - eye).normalize();
    let right = forward.cross(up).normalize();
    let above = right.cross(forward);
    // fov = 30 in all of them.
    let scale = f64::from(SIZE[1]) / 2.0 / 15f64.to_radians().tan();
    let d = center - eye;
    let depth = d.dot(forward);
    let x = f64::from(SIZE[0]) / 2.0 + scale * d.dot(right) / depth;
    let y = f64::from(SIZE[1]) / 2.0 - scale * d.dot(above) / depth;
    let r = share * scale * radius / depth;
    let inside = |i: &usize| {
        let at = |k: usize| k as f64 + 0.5;
        let (px, py) = (at(i % SIZE[0] as usize), at(i / SIZE[0] as usize));
        (px - x).hypot(py - y) < r
    };
    (0..(SIZE[0] * SIZE[1]) as usize).filter(inside).collect()
}

#[test]
fn every_scene_renders_to_a_picture() {
    let mut all = common::files(&scenes().join("lecture"), &["toml"]);
    assert!(all.len() >= 15);
    all.extend(
        ["glass", "prism", "marbles", "primitives", "teapot"]
            .map(|name| scenes().join(name).with_extension("toml")),
    );
    for path in all {
        let mut desc = load(&path);
        desc.image.size = [96, 60];
        desc.settings.samples = 2;
        let pixels = pixels(&desc);
        let name = path.display();
        assert!(pixels.iter().all(|p| p.is_finite()), "{name}");
        assert!(pixels.iter().all(|p| p.to_array().iter().all(|&x| x >= 0.0)), "{name}: below 0");
        let lit = pixels.iter().filter(|p| p.luminance() > 0.01).count();
        let least = if name.to_string().ends_with("prism.toml") { 50 } else { pixels.len() / 2 };
        assert!(lit > least, "{name}: {lit} pixels are lit");
    }
}

#[test]
fn slide_01_shows_colours_without_light() {
    let desc = slide(1);
    let plain = pixels(&desc);
    let lit = with(&desc, |d| {
        d.ambient = Some(Rgb::splat(3.0));
        d.lights = slide(2).lights;
    });
    assert_eq!(plain, pixels(&lit));
    let Material::Diffuse { reflectance } = *material(&mut desc.clone(), "blue") else { panic!() };
    assert!(on_sphere(&desc, "blue", 0.9).iter().all(|&i| plain[i] == reflectance));
}

#[test]
fn slide_02_is_lit_in_proportion_to_the_light() {
    let desc = slide(2);
    let times = |factor: f32| {
        pixels(&with(&desc, |d| {
            let LightDesc::Directional { irradiance, .. } = &mut d.lights[0] else { panic!() };
            *irradiance *= factor;
        }))
    };
    let [none, once, twice] = [0.0, 1.0, 2.0].map(times);
    for ((a, b), c) in none.iter().zip(&once).zip(&twice) {
        assert!(minus(minus(*c, *b), minus(*b, *a)).to_array().iter().all(|x| x.abs() < 1e-5));
    }
    // Where slide 1 shows one colour, the cosine makes many.
    let ball = on_sphere(&desc, "blue", 0.9);
    let mut shades: Vec<u32> = ball.iter().map(|&i| once[i].b.to_bits()).collect();
    shades.sort_unstable();
    shades.dedup();
    assert!(shades.len() > ball.len() / 2);
}

#[test]
fn slide_03_adds_lights_up_and_shadows_take_away() {
    let desc = slide(3);
    assert_eq!(desc.lights.len(), 3);
    let all = pixels(&desc);
    let open = pixels(&with(&desc, |d| d.settings.shadows = Shadows::None));
    let (_, brighter) = range(&all, &open);
    assert!(brighter <= 0.0, "{brighter}");
    assert!(changed(&all, &open, 0.05) > 0.1);

    let dark = with(&desc, |d| d.lights.clear());
    let ambient = pixels(&dark);
    let mut sum = ambient.clone();
    for light in &desc.lights {
        let one = pixels(&with(&dark, |d| d.lights.push(light.clone())));
        sum.iter_mut().zip(one.iter().zip(&ambient)).for_each(|(s, (a, b))| *s += minus(*a, *b));
    }
    assert!(changed(&all, &sum, 1e-4) == 0.0);
}

#[test]
fn slide_04_adds_highlights() {
    let desc = slide(4);
    let matte = with(&desc, |d| {
        for m in &mut d.materials {
            if let Material::Phong(phong) = &mut m.material {
                phong.specular = Rgb::BLACK;
            }
        }
    });
    let (shiny, matte) = (pixels(&desc), pixels(&matte));
    let (darker, brighter) = range(&shiny, &matte);
    assert!(darker >= 0.0 && brighter > 0.3, "{darker} {brighter}");
    // With the same exponent Phong's highlight is the smaller one.
    let wide = |name: &str| {
        let ball = on_sphere(&desc, name, 1.0);
        let bright = ball.iter().filter(|&&i| shiny[i].r - matte[i].r > 0.2).count();
        bright as f64 / ball.len() as f64
    };
    assert!(wide("green") > 1.5 * wide("blue"), "{} {}", wide("green"), wide("blue"));
}

#[test]
fn slide_05_mirrors_add_light_bounce_by_bounce() {
    let desc = with(&slide(5), |d| d.settings.prune = 0.0);
    let depth = |n: u32| pixels(&with(&desc, |d| d.settings.max_depth = n));
    let [none, one, two] = [0, 1, 2].map(depth);
    assert!(on_sphere(&desc, "mirror", 0.9).iter().all(|&i| none[i].is_black()));
    assert!(on_sphere(&desc, "mirror", 0.9).iter().all(|&i| !two[i].is_black()));
    for (less, more, share) in [(&none, &one, 0.3), (&one, &two, 0.01)] {
        assert!(range(more, less).0 >= 0.0);
        assert!(changed(more, less, 0.01) > share);
    }
}

#[test]
fn slide_06_bends_light_and_index_1_does_not() {
    // Without the checker: what is seen through curved glass is looked up more coarsely.
    let desc = with(&slide(6), |d| d.materials.iter_mut().for_each(|m| m.maps = Maps::default()));
    let without = with(&desc, |d| d.objects.retain(|o| !is_of(o, "glass")));
    let index = |n: f64| {
        pixels(&with(&desc, |d| {
            let Material::Dielectric(glass) = material(d, "glass") else { panic!() };
            glass.ior = Ior::Constant(n);
        }))
    };
    let background = pixels(&without);
    // Rays start anew behind each surface: edges may move by a rounding.
    let disturbed = changed(&index(1.0), &background, 1e-3);
    assert!(disturbed < 0.002, "{disturbed}");
    assert!(changed(&index(1.5), &background, 0.02) > 0.1);
    // A ball of glass shows the world upside down: sky below.
    let glass = index(1.5);
    let ball = on_sphere(&desc, "glass", 0.6);
    let (upper, lower) = ball.split_at(ball.len() / 2);
    let blue = |part: &[usize]| {
        let is_sky = |i: &&usize| glass[**i].b > 1.3 * glass[**i].r;
        part.iter().filter(is_sky).count() as f64 / part.len() as f64
    };
    assert!(blue(lower) > 0.3 && blue(upper) < 0.1, "{} {}", blue(lower), blue(upper));
}

#[test]
fn slide_07_mirrors_less_the_higher_the_power() {
    let desc = with(&slide(7), |d| d.settings.prune = 0.0);
    let law = |model: FresnelModel| {
        pixels(&with(&desc, |d| {
            for m in d.materials.iter_mut().filter(|m| m.name.starts_with("power")) {
                let Material::Phong(phong) = &mut m.material else { panic!() };
                phong.fresnel.as_mut().unwrap().model = model;
            }
        }))
    };
    let power = |power| law(FresnelModel::Power(FresnelPower { offset: 0.02, scale: 0.5, power }));
    let rising = [10.0, 5.0, 2.0, 1.0, 0.5].map(power);
    for pair in rising.windows(2) {
        let (darker, brighter) = range(&pair[1], &pair[0]);
        assert!(darker > -1e-5 && brighter > 0.02, "{darker} {brighter}");
    }
    let (schlick, exact) = (law(FresnelModel::Schlick), law(FresnelModel::Exact));
    assert!(changed(&schlick, &exact, 0.05) < 0.01);
    assert!(changed(&schlick, &rising[4], 0.05) > 0.05);
}

#[test]
fn slide_08_has_a_copy_for_each_line_of_its_list() {
    let csv = std::fs::read_to_string(scenes().join("lecture/spiral.csv")).unwrap();
    let lines = csv.lines().filter(|line| !line.starts_with('#')).count();
    let desc = slide(8);
    let copies = desc.objects.iter().find_map(|o| match &o.shape {
        ShapeDesc::Instances { transforms, .. } => Some(transforms.len()),
        _ => None,
    });
    assert_eq!((copies, lines), (Some(1800), 1800));
    let alone = with(&desc, |d| {
        d.objects.retain(|o| !matches!(o.shape, ShapeDesc::Instances { .. }));
    });
    assert!(changed(&pixels(&desc), &pixels(&alone), 0.02) > 0.1);
}

#[test]
fn slide_09_fades_into_the_fog() {
    let desc = slide(9);
    let fog = desc.fog.as_ref().unwrap().radiance;
    let (hazy, clear) = (pixels(&desc), pixels(&with(&desc, |d| d.fog = None)));
    let away = |p: Rgb| minus(p, fog).to_array().iter().fold(0f32, |m, x| m.max(x.abs()));
    // The sky is infinitely far.
    assert!(hazy[..SIZE[0] as usize].iter().all(|p| away(*p) < 1e-4));
    // The floor is more like the fog the farther it is.
    let row = |y: u32, of: &[Rgb]| {
        let row = &of[(y * SIZE[0]) as usize..][..SIZE[0] as usize];
        row.iter().map(|p| away(*p)).sum::<f32>() / SIZE[0] as f32
    };
    let kept = |y: u32| row(y, &hazy) / row(y, &clear);
    let [far, near] = [40, 95].map(kept);
    assert!(far < 0.6 && near > far + 0.1, "{far} {near}");
}

#[test]
fn slide_10_has_penumbras_from_the_area_light_only() {
    let desc = with(&slide(10), |d| {
        d.settings.max_depth = 0;
        d.settings.shadow_samples = 64;
    });
    // How much of the light that each pixel would get arrives there.
    let shares = |light: &LightDesc| -> Vec<f32> {
        let one = with(&desc, |d| {
            d.lights = vec![light.clone()];
            d.ambient = Some(Rgb::BLACK);
            d.image.background = Some(Rgb::BLACK);
        });
        let open = pixels(&with(&one, |d| d.settings.shadows = Shadows::None));
        let shaded = pixels(&one);
        let both = shaded.iter().zip(&open);
        both.filter(|(_, o)| o.g > 0.02).map(|(s, o)| s.g / o.g).collect()
    };
    for light in &desc.lights {
        let shares = shares(light);
        let count = |from: f32, to: f32| {
            shares.iter().filter(|s| (from..to).contains(s)).count() as f64 / shares.len() as f64
        };
        let (umbra, penumbra, lit) = (count(-0.01, 0.01), count(0.2, 0.8), count(0.99, 1.01));
        let is_soft = matches!(light, LightDesc::Rectangle { .. });
        assert!(umbra > 0.01 && lit > 0.4, "{umbra} {lit}");
        assert!(if is_soft { penumbra > 0.02 } else { penumbra == 0.0 }, "{is_soft}: {penumbra}");
    }
}

#[test]
fn slide_11_is_sharp_where_the_lens_is_focused() {
    let desc = with(&slide(11), |d| d.settings.samples = 16);
    let lens = pixels(&desc);
    let pinhole = pixels(&with(&desc, |d| d.camera.as_mut().unwrap().lens = None));
    // The steepest step between rows: at the horizon, on the right where nothing stands before it.
    let step = |of: &[Rgb]| {
        let at = |y: u32| of[(y * SIZE[0] + SIZE[0] - 4) as usize].b;
        (25..45).map(|y| (at(y) - at(y + 1)).abs()).fold(0f32, f32::max)
    };
    assert!(step(&lens) < 0.6 * step(&pinhole), "{} {}", step(&lens), step(&pinhole));
    // The ball in focus stays as it was.
    let ball = on_sphere(&desc, "yellow", 0.7);
    let moved = |i: &usize| (lens[*i].r - pinhole[*i].r).abs();
    let mean = ball.iter().map(moved).sum::<f32>() / ball.len() as f32;
    assert!(mean < 0.03, "{mean}");
}

#[test]
fn slide_12_spreads_the_lamp_by_wavelength() {
    let desc = with(&slide(12), |d| d.settings.samples = 2);
    let Material::Dielectric(glass) = material(&mut desc.clone(), "glass").clone() else {
        panic!()
    };
    let Ior::Cauchy { a, b, .. } = glass.ior else { panic!("no dispersion") };
    // Where the lamp is seen through the prism, in the right half of the picture, by light of each of
    // three wavelengths.
    let place = |micrometres: f64| {
        let one = pixels(&with(&desc, |d| {
            let Material::Dielectric(glass) = material(d, "glass") else { panic!() };
            glass.ior = Ior::Constant(a + b / (micrometres * micrometres));
        }));
        let columns = (0..one.len()).filter(|i| one[*i].r > 3.0).map(|i| i as u32 % SIZE[0]);
        let columns: Vec<u32> = columns.filter(|x| *x > SIZE[0] / 2).collect();
        assert!(columns.len() > 5, "{micrometres}: the lamp is not seen");
        f64::from(columns.iter().sum::<u32>()) / columns.len() as f64
    };
    let [red, green, blue] = [0.65, 0.55, 0.45].map(place);
    assert!(red + 1.0 < green && green + 1.0 < blue, "{red} {green} {blue}");
    let all = pixels(&with(&desc, |d| d.settings.samples = 16));
    let is_vivid = |p: &&Rgb| {
        let least = p.r.min(p.g).min(p.b);
        p.max_component() > 0.5 && least < 0.4 * p.max_component()
    };
    assert!(all.iter().filter(is_vivid).count() > 100);
}

#[test]
fn slide_13_fills_the_glass_up_to_its_wall() {
    let desc = with(&slide(13), |d| d.settings.prune = 0.0);
    let wine = |change: fn(&mut alhazen::material::Dielectric)| {
        pixels(&with(&desc, |d| {
            let Material::Dielectric(wine) = material(d, "wine") else { panic!() };
            change(wine);
        }))
    };
    let (red, clear) = (pixels(&desc), wine(|wine| wine.absorption = Rgb::BLACK));
    // What absorbs only takes away, and of green the most.
    assert!(range(&red, &clear).1 < 1e-4);
    assert!(red.iter().filter(|p| p.r > 0.1 && p.r > 4.0 * p.g).count() > 200);
    // Where both are, the one of higher priority is.
    assert!(changed(&red, &wine(|wine| wine.priority = 2), 0.02) > 0.005);
}

#[test]
fn slide_14_varies_its_colours() {
    let flat = with(&slide(14), |d| d.settings.integrator = IntegratorKind::Flat);
    let textured = pixels(&flat);
    let plain = pixels(&with(&flat, |d| {
        d.materials.iter_mut().for_each(|m| m.maps = Maps::default());
    }));
    for (name, least) in [("marble", 100), ("sunset", 100), ("squares", 2)] {
        let ball = on_sphere(&flat, name, 0.8);
        let colours = |of: &[Rgb]| {
            let mut seen: Vec<_> =
                ball.iter().map(|&i| of[i].to_array().map(f32::to_bits)).collect();
            seen.sort_unstable();
            seen.dedup();
            seen.len()
        };
        assert_eq!(colours(&plain), 1, "{name}");
        assert!(colours(&textured) >= least, "{name}: {}", colours(&textured));
    }
}

#[test]
fn slide_15_darkens_what_is_hidden() {
    let desc = with(&slide(15), |d| d.settings.samples = 4);
    let within = |distance: f64| pixels(&with(&desc, |d| d.settings.ao_distance = Some(distance)));
    let (near, far) = (within(0.5), within(3.0));
    // The same directions: the farther they look, the more they meet.
    assert!(range(&far, &near).1 <= 1e-6);
    assert!(changed(&far, &near, 0.2) > 0.02);
    // The top of a ball is open; below, it faces the floor.
    let ball = on_sphere(&desc, "blue", 0.95);
    let mean = |part: &[usize]| part.iter().map(|&i| far[i].g).sum::<f32>() / part.len() as f32;
    let (top, bottom) = (mean(&ball[..ball.len() / 6]), mean(&ball[ball.len() * 5 / 6..]));
    assert!(top > 0.85 && bottom < 0.6, "{top} {bottom}");
}
