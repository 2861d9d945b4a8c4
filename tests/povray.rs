//! Pictures by two programs: scenes that Alhazen and POV-Ray both define are rendered by both, from
//! one description, and compared in linear light.
//!
//! POV-Ray's antialiasing, which is adaptive, is off; it renders more pixels, which are averaged down, as
//! our box filter averages samples. What is left at edges is the difference between a regular grid and
//! those samples. Shadow rays there leave out hits nearer than 0.001 units, so surfaces do not touch.
//!
//! Where nothing else is said of a bound, antialiasing at edges is all that is left, and the bound is
//! about twice of what was measured; larger pictures of more samples differ a quarter as much.
//! POV-Ray's ground fog is not compared: its density is 1/(1 + (y/h)²), ours exp(−y/h).
#![allow(missing_docs, clippy::print_stderr, reason = "a test program")]

mod common;
#[path = "povray/run.rs"]
mod run;
#[path = "povray/twin.rs"]
mod twin;

use alhazen::color::Rgb;
use alhazen::film::Picture;
use glam::DVec3;

use run::{Bound, check, ours, theirs};
use twin::{Glass, Lamp, Shape, Surface, Theirs, Twin, block, quad, turned};

const fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Compares both pictures of a twin.
fn compare(name: &str, twin: &Twin, bound: Bound) {
    check(name, &ours(twin), &theirs(twin), bound);
}

fn floor(y: f64, half: f64) -> Shape {
    let corner = |x: f64, z: f64| v(x * half, y, z * half);
    let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)];
    Shape::Triangles(quad(corners).to_vec())
}

/// Both shade by reflectance · light · cos, phong^n, and multiply mirrored light by a constant.
#[test]
fn mirrors() {
    if !run::povray() {
        return;
    }
    let mut twin = Twin::new(v(0.5, 1.0, 5.5), v(0.0, -0.5, 0.0), 60.0);
    twin.add_room(6.0, 8);
    twin.add(Shape::Sphere(v(-1.8, -0.4, 0.0), 1.5), Surface::Mirror([0.95, 0.9, 0.7]));
    let corner = v(0.8, -1.6, -1.5);
    let cube = turned(block(corner, corner + 2.2), corner + 1.1, 25.0);
    twin.add(Shape::Triangles(cube), Surface::Mirror([0.6, 0.8, 0.9]));
    let plastic = |diffuse, mirror, coat| Surface::Phong {
        diffuse,
        specular: 0.3,
        shininess: 40.0,
        mirror,
        coat,
    };
    twin.add(Shape::Sphere(v(1.0, -1.0, 2.0), 0.7), plastic([0.3, 0.2, 0.1], 0.25, None));
    twin.add(Shape::Sphere(v(-0.4, -1.6, 2.4), 0.5), plastic([0.1, 0.1, 0.3], 0.9, Some(1.6)));
    twin.ambient = 0.3;
    twin.lamps.push(Lamp::Point(v(2.0, 5.0, 4.0), [0.4, 0.35, 0.3]));
    twin.lamps.push(Lamp::Point(v(-4.0, 3.0, 3.0), [0.1, 0.15, 0.2]));
    for depth in [0, 1, 8] {
        twin.depth = depth;
        let bound = Bound { mae: 0.002, rel_mse: 4e-4, share: 0.035 };
        compare(&format!("mirrors-{depth}"), &twin, bound);
    }
}

/// The share that a coat mirrors, by Fresnel's equations, before a sky of one colour: no edges but the
/// outlines, and so a narrow bound.
#[test]
fn coats() {
    if !run::povray() {
        return;
    }
    let mut twin = Twin::new(v(0.0, 0.0, 6.0), DVec3::ZERO, 45.0);
    twin.background = [0.9, 0.7, 0.5];
    for (x, ior) in [(-1.6, 1.5), (1.6, 2.4)] {
        let (diffuse, specular, shininess) = ([0.1, 0.2, 0.3], 0.0, 1.0);
        let coat = Surface::Phong { diffuse, specular, shininess, mirror: 1.0, coat: Some(ior) };
        twin.add(Shape::Sphere(v(x, 0.0, 0.0), 1.5), coat);
    }
    twin.lamps.push(Lamp::Point(v(0.0, 8.0, 8.0), [0.3, 0.3, 0.3]));
    compare("coats", &twin, Bound { mae: 0.0003, rel_mse: 1e-5, share: 0.002 });
}

/// Both split rays by Fresnel's equations, and reflect totally; of media one in another, the inner one
/// fills the place.
///
/// Those reflect only where they must: POV-Ray takes the ray that leaves the inner one for one between
/// equal media when it asks for Fresnel's share (`Trace::ComputeRelativeIOR` of its source).
#[test]
fn glass() {
    if !run::povray() {
        return;
    }
    let mut twin = Twin::new(v(0.5, 1.5, 5.5), v(0.0, -0.2, 0.0), 55.0);
    twin.add_room(6.0, 8);
    twin.ambient = 1.0;
    twin.depth = 9;
    twin.add(Shape::Sphere(v(-1.7, -0.3, 0.0), 1.5), Surface::Glass(Glass::new(1.5)));
    let corner = v(0.6, -1.6, -1.0);
    let cube = turned(block(corner, corner + v(1.8, 2.6, 1.8)), corner + 0.9, 30.0);
    twin.add(Shape::Triangles(cube), Surface::Glass(Glass::new(1.33)));
    compare("glass", &twin, Bound { mae: 0.0025, rel_mse: 3e-4, share: 0.035 });

    let plain = |ior| Surface::Glass(Glass { reflects: false, ..Glass::new(ior) });
    for (_, surface) in &mut twin.objects {
        if let Surface::Glass(glass) = surface {
            glass.reflects = false;
        }
    }
    twin.add(Shape::Sphere(v(-1.5, -0.1, 0.2), 0.7), plain(1.0));
    twin.add(Shape::Sphere(corner + v(0.9, 1.2, 0.9), 0.6), plain(1.9));
    compare("nested-glass", &twin, Bound { mae: 0.0045, rel_mse: 8e-4, share: 0.08 });
}

/// Both absorb by Beer and Lambert, and let light through glass straight to what is behind.
///
/// Glass reflects only where it must, because POV-Ray does not absorb what glass reflects inside by
/// Fresnel's share on its way there (`Trace::ComputeLightedTexture` of its source multiplies what is
/// refracted and what is reflected totally).
#[test]
fn absorption() {
    if !run::povray() {
        return;
    }
    let mut twin = Twin::new(v(0.5, 1.5, 5.5), v(0.0, -0.4, 0.0), 55.0);
    twin.add_room(6.0, 8);
    twin.ambient = 0.35;
    twin.depth = 12;
    twin.lamps.push(Lamp::Point(v(1.0, 5.5, 2.0), [0.6, 0.6, 0.6]));
    let tinted =
        |ior, absorption| Surface::Glass(Glass { absorption, reflects: false, ..Glass::new(ior) });
    twin.add(Shape::Sphere(v(-1.8, -0.4, 0.0), 1.4), tinted(1.5, [0.7, 0.1, 0.05]));
    let corner = v(0.6, -1.6, -1.0);
    let cube = turned(block(corner, corner + v(1.8, 2.6, 1.8)), corner + 0.9, 30.0);
    twin.add(Shape::Triangles(cube), tinted(1.4, [0.0, 0.4, 0.9]));
    twin.add(floor(-2.5, 5.0), Surface::Diffuse([0.8, 0.8, 0.8]));
    compare("absorption", &twin, Bound { mae: 0.0013, rel_mse: 2.5e-4, share: 0.03 });
}

/// Both dim by exp(−distance/d), mirrored rays too, and add what the fog takes.
#[test]
fn fog() {
    if !run::povray() {
        return;
    }
    let mut twin = Twin::new(v(0.0, 1.0, 6.0), v(0.0, 0.3, 0.0), 50.0);
    twin.background = [0.1, 0.2, 0.6];
    twin.ambient = 0.2;
    twin.fog = Some((9.0, [0.55, 0.6, 0.65]));
    twin.lamps.push(Lamp::Point(v(5.0, 8.0, 6.0), [0.5, 0.4, 0.4]));
    twin.lamps.push(Lamp::Sun(v(-3.0, 4.0, 2.0), [0.3, 0.3, 0.2]));
    twin.add(floor(-1.0, 30.0), Surface::Diffuse([0.5, 0.3, 0.2]));
    for i in 0..6 {
        let i = f64::from(i);
        let at = v(2.5 * (1.7 * i).sin(), 0.05, 2.5 - 3.0 * i);
        twin.add(Shape::Sphere(at, 1.0), Surface::Diffuse([0.9, 0.15 * i, 0.1]));
    }
    let corners = [v(2.0, -0.9, -2.0), v(6.0, -0.9, -1.0), v(6.0, 3.0, -1.0), v(2.0, 3.0, -2.0)];
    twin.add(Shape::Triangles(quad(corners).to_vec()), Surface::Mirror([0.9, 0.9, 0.9]));
    compare("fog", &twin, Bound { mae: 0.0002, rel_mse: 1e-5, share: 0.001 });
}

/// A texture of cubes, and a cone of light whose rim both fade by 3t² − 2t³ of the cosine.
#[test]
fn checker_and_spot() {
    if !run::povray() {
        return;
    }
    let mut twin = Twin::new(v(1.0, 2.5, 5.0), v(0.0, -0.3, 0.0), 50.0);
    twin.ambient = 0.1;
    let colors = [[0.8, 0.7, 0.5], [0.2, 0.3, 0.5]];
    twin.add(floor(-1.0, 20.0), Surface::Checker(colors, 0.75));
    twin.add(Shape::Sphere(v(0.0, 0.1, 0.0), 1.0), Surface::Checker(colors, 0.4));
    let at = v(2.0, 5.0, 3.0);
    let towards = v(-0.3, -1.0, 0.0);
    twin.lamps.push(Lamp::Spot { at, towards, intensity: 90.0, cone: 24.0, penumbra: 11.0 });
    compare("checker-and-spot", &twin, Bound { mae: 0.0009, rel_mse: 2e-4, share: 0.015 });
}

const FLOOR: twin::Color = [0.8, 0.7, 0.6];

fn area_scene(light: DVec3, theirs: Theirs) -> Twin {
    let mut twin = Twin::new(v(1.0, 3.0, 7.0), v(0.0, 0.2, 0.0), 45.0);
    twin.add(floor(-1.0, 20.0), Surface::Diffuse(FLOOR));
    twin.add(Shape::Sphere(v(-1.3, 0.3, 0.0), 0.9), Surface::Diffuse([0.3, 0.5, 0.8]));
    let corner = v(0.6, -0.9, -1.0);
    let cube = turned(block(corner, corner + v(1.2, 2.0, 1.2)), corner + 0.6, 20.0);
    twin.add(Shape::Triangles(cube), Surface::Diffuse([0.7, 0.4, 0.3]));
    let (corner, u, v) = (v(-1.0, 6.0, -1.0) + light, v(2.0, 0.0, 0.0), v(0.0, 0.0, 2.0));
    twin.lamps.push(Lamp::Rectangle { corner, u, v, radiance: 18.0, theirs });
    (twin.pixels, twin.samples) = (twin.pixels / 2, 2 * twin.samples);
    twin
}

/// A rectangle here, 8 × 8 spot lights there that fade by the light's own cosine and the inverse
/// square: the radiance itself. What is left are the steps of 64 shadows, and our noise.
#[test]
fn area_light() {
    if !run::povray() {
        return;
    }
    let twin = area_scene(v(2.0, 0.0, 2.0), Theirs::Spots(8));
    compare("area-light", &twin, Bound { mae: 0.0005, rel_mse: 1.5e-4, share: 0.01 });
}

/// POV-Ray's own area light, which knows neither cosine nor inverse square: compared is the share of
/// the light that each point of the floor sees, which is the picture divided by that without shadows.
/// The light is far, so that all of it counts nearly the same to us too: within 8 % of the mean.
#[test]
fn penumbra() {
    if !run::povray() {
        return;
    }
    let mut twin = area_scene(v(0.0, 5.0, 0.0), Theirs::Area(16));
    let lit = [ours(&twin), theirs(&twin)];
    twin.shadows = false;
    let unshadowed = [ours(&twin), theirs(&twin)];
    // The floor has a colour of its own.
    let is_floor =
        |c: Rgb| c.g > 0.02 && (c.r / c.g - FLOOR[0] as f32 / FLOOR[1] as f32).abs() < 0.01;
    let share = |which: usize| {
        let (lit, all) = (&lit[which].pixels, &unshadowed[which].pixels);
        let of_floor = |i: usize| unshadowed.iter().all(|p| is_floor(p.pixels[i]));
        let ratio = |i: usize| if of_floor(i) { lit[i].g / all[i].g } else { 0.0 };
        Picture::whole(twin.size, (0..lit.len()).map(|i| Rgb::splat(ratio(i))).collect())
    };
    let [ours, theirs] = [share(0), share(1)];
    check("penumbra", &ours, &theirs, Bound { mae: 0.001, rel_mse: 3e-4, share: 0.012 });
    // Little of the floor is in the rim of the shadows, which is as wide as the light is large.
    let rim = |p: &Picture| p.pixels.iter().map(|c| f64::from(c.g * (1.0 - c.g))).sum::<f64>();
    let ratio = rim(&ours) / rim(&theirs);
    eprintln!("penumbra: {ratio:.4} as wide");
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}

/// A strip of white seen through a prism that bends by about 19° and spreads by 6°.
fn prism(glass: Glass) -> Twin {
    let mut twin = Twin::new(DVec3::ZERO, v(0.0, 0.0, -1.0), 0.2);
    twin.size = if common::verify() { [640, 8] } else { [320, 4] };
    twin.up = DVec3::Y;
    twin.ambient = 1.0;
    let [a, b] = [v(-3.0, 0.0, -2.0), v(3.0, 0.0, -2.0)];
    let [c, d] = [v(-3.0, 0.0, -2.2), v(3.0, 0.0, -2.2 - 6.0 * 30f64.to_radians().tan())];
    let (low, high) = (v(0.0, -1.0, 0.0), v(0.0, 1.0, 0.0));
    let faces = [[a + low, b + low, b + high, a + high], [d + low, c + low, c + high, d + high]];
    let sides = [[c + low, a + low, a + high, c + high], [b + low, d + low, d + high, b + high]];
    let ends = [[a + high, b + high, d + high, c + high], [c + low, d + low, b + low, a + low]];
    let triangles = [faces, sides, ends].into_iter().flatten().flat_map(quad).collect();
    twin.add(Shape::Triangles(triangles), Surface::Glass(Glass { reflects: false, ..glass }));
    let (left, right) = (9.2, 9.6);
    let corner = |x: f64, y: f64| v(x, y, -30.0);
    let corners = [corner(left, -9.0), corner(right, -9.0), corner(right, 9.0), corner(left, 9.0)];
    twin.add(Shape::Triangles(quad(corners).to_vec()), Surface::Diffuse([1.0; 3]));
    twin
}

/// The glass of the prism: POV-Ray's index is 1.5·1.1^((555 − λ)/350), ours by Cauchy's law equal to
/// it at 380 and at 730 nm.
fn dispersive() -> Glass {
    Glass { dispersion: 1.1, ..Glass::new(1.5) }
}

/// One wavelength here, at each end of the spectrum, is plain glass of that index there.
#[test]
fn one_wavelength() {
    if !run::povray() {
        return;
    }
    for nanometres in [twin::VIOLET, twin::RED] {
        let mut one = prism(dispersive());
        one.wavelength = Some(nanometres);
        let plain = prism(Glass::new(dispersive().index(nanometres)));
        let bound = Bound { mae: 0.0006, rel_mse: 4e-4, share: 0.008 };
        check(&format!("prism-{nanometres}"), &ours(&one), &theirs(&plain), bound);
    }
}

/// A channel of a picture along its rows, as sums over columns.
fn profile(picture: &Picture, channel: usize) -> Vec<f64> {
    let [w, _] = picture.extent.map(|side| side as usize);
    let row = |row: &[Rgb], x: usize| f64::from(row[x].to_array()[channel]);
    (0..w).map(|x| picture.pixels.chunks(w).map(|pixels| row(pixels, x)).sum()).collect()
}

/// The first and the last column in which a channel shows more than a thousandth of its most.
fn extent(picture: &Picture) -> [f64; 2] {
    let profiles = [0, 1, 2].map(|c| profile(picture, c));
    let shows = |x: &usize| {
        profiles.iter().any(|p| p[*x] > 1e-3 * p.iter().fold(0.0, |most: f64, &v| most.max(v)))
    };
    let columns = 0..profiles[0].len();
    let first = columns.clone().find(shows).expect("a spectrum");
    let last = columns.rev().find(shows).expect("a spectrum");
    [first as f64, last as f64]
}

/// The whole spectrum. The programs do not give a wavelength the same colour, nor the same index
/// between the ends: POV-Ray's colours are parabolas that reach 0 at 380 and 730 nm, ours are those of
/// the CIE. Compared is what both define:
///
/// - the ends of the spectrum: POV-Ray's are where our single wavelengths of 380 and 730 nm are, and
///   ours, which rise more slowly, are near them;
/// - the order of the colours, by the centroids of the channels: the same, and no further apart than a
///   fifth of the spectrum (red, green and blue are 0.05, 0.09 and 0.11 of it apart);
/// - white: each channel adds up to what the strip gives without dispersion, but for the prism's
///   magnification, which differs by 2 % between the ends.
#[test]
fn dispersion() {
    if !run::povray() {
        return;
    }
    let mut twin = prism(dispersive());
    twin.samples *= 8;
    let (white, pictures) = (ours(&prism(Glass::new(1.5))), [ours(&twin), theirs(&twin)]);
    run::keep("dispersion", &pictures[0], &pictures[1]);
    let single = |nanometres| {
        let mut one = prism(dispersive());
        one.wavelength = Some(nanometres);
        extent(&ours(&one))
    };
    let ([violet, _], [_, red]) = (single(twin::VIOLET), single(twin::RED));
    let [mine, other] = [0, 1].map(|i| extent(&pictures[i]));
    let width = other[1] - other[0];
    eprintln!("dispersion: from {mine:?}, {other:?}; ends of single wavelengths {violet}, {red}");
    assert!((other[0] - violet).abs() <= 1.0 && (other[1] - red).abs() <= 1.0, "{other:?}");
    for (mine, other) in mine.into_iter().zip(other) {
        assert!((mine - other).abs() <= 0.06 * width, "{mine} and {other} of {width} columns");
    }

    let profiles = |p: &Picture| [0, 1, 2].map(|c| profile(p, c));
    let sum = |profile: &Vec<f64>| profile.iter().sum::<f64>();
    let centroid = |profile: &Vec<f64>| {
        let moments = profile.iter().enumerate().map(|(x, v)| x as f64 * v);
        moments.sum::<f64>() / sum(profile)
    };
    let white = profiles(&white);
    let [mine, other] = [0, 1].map(|i| profiles(&pictures[i]));
    for c in 0..3 {
        let distance = (centroid(&mine[c]) - centroid(&other[c])) / width;
        let [mine, other] = [&mine, &other].map(|p| sum(&p[c]) / sum(&white[c]));
        eprintln!("channel {c}: {distance:.4} apart, {mine:.4} and {other:.4} of white");
        assert!(distance.abs() < 0.2, "channel {c}: {distance}");
        assert!((mine - 1.0).abs() < 0.025 && (other - 1.0).abs() < 0.025, "{mine}, {other}");
    }
    for profiles in [mine, other] {
        let [red, green, blue] = profiles.each_ref().map(centroid);
        assert!(red > green + 0.05 * width && green > blue + 0.05 * width, "{red} {green} {blue}");
    }
}
