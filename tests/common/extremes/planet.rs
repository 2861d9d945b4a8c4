//! Huge next to tiny in one scene, and in one mesh.

use std::f64::consts::TAU;

use alhazen::geometry::TriangleMesh;
use glam::{DVec2, DVec3};

use super::{
    Cell, Rung, Table, add_mesh, ball, empty, enter, look, per_million, power, row, sphere,
};
use crate::common::Random;

/// Both in one mesh: a pebble whose facets lie within `FACET` of its radius below its sphere.
fn one_mesh(planet: f64, radius: f64, at: DVec3) -> TriangleMesh {
    // With a corner where the pebble lies.
    let large = ball(60, at - DVec3::Y * planet, planet);
    let small = ball(40, at + DVec3::Y * radius, radius);
    let first = large.positions.len() as u32;
    let xyz = [&large, &small]
        .into_iter()
        .flat_map(|mesh| (0..mesh.positions.len()).flat_map(|i| mesh.positions.get(i).to_array()));
    let shifted = small.triangles.iter().map(|corners| corners.map(|i| i + first));
    let triangles = large.triangles.iter().copied().chain(shifted).collect();
    TriangleMesh::new(xyz.collect(), triangles)
}

const FACET: f64 = 2e-3;

/// What a planet and a pebble are made of.
#[derive(Clone, Copy, PartialEq)]
enum Made {
    Spheres,
    OneMesh,
}

/// Of `n` rays from a metre (or a hundred radii, where that is more) away to a pebble that lies at `at` on a
/// planet, how many are lost, and how far off a hit is at most, in radii of the pebble.
fn pebble_seen(rung: Rung, made: Made, planet: f64, radius: f64, at: DVec3, n: usize) -> [f64; 2] {
    let mut desc = empty();
    let pebble = at + DVec3::Y * radius;
    let allowed = match made {
        Made::Spheres => {
            desc.objects.push(sphere(at - DVec3::Y * planet, planet));
            desc.objects.push(sphere(pebble, radius));
            0.0
        }
        Made::OneMesh => {
            add_mesh(&mut desc, one_mesh(planet, radius, at));
            FACET
        }
    };
    let eye = at + DVec3::new(0.0, 0.3, 1.0) * (100.0 * radius).max(1.0);
    let fov = 2.0 * radius / (eye - pebble).length();
    desc.camera = Some(look(eye, pebble, fov));
    let scene = rung.scene(desc);
    let query = scene.accel.query();
    let mut random = Random(4);
    let (mut lost, mut off) = (0.0, 0.0f64);
    for _ in 0..n {
        let (r, phi) = (0.85 * random.unit().sqrt(), TAU * random.unit());
        let film = DVec2::new(32.0 + 29.0 * r * phi.cos(), 32.0 + 29.0 * r * phi.sin());
        let Some(ray) = scene.camera.ray(film, [0.5, 0.5]) else { continue };
        let (o, d) = scene.camera.ray_f64(film);
        let Some(truth) = enter(o, d, pebble - scene.center, radius) else { continue };
        match query.intersect(&ray) {
            Some(hit) => {
                let p = scene.surface(&ray, &hit).position.as_dvec3();
                // A facet is hit that much deeper than a sphere, seen slantwise.
                let slope = (truth - (pebble - scene.center)).normalize().dot(d.normalize()).abs();
                let distance = (p - truth).length() / radius;
                off = off.max((distance - allowed / slope).max(0.0));
            }
            None => lost += 1.0,
        }
    }
    [lost, off]
}

/// A pebble on a planet, and how small it may be where f32 does not tell its points apart.
pub(super) fn planet(n: usize) -> Table {
    let mut rows = Vec::new();
    for made in [Made::Spheres, Made::OneMesh] {
        let what = if made == Made::Spheres { "spheres" } else { "one mesh" };
        for planet in [6.4e3, 6.4e6] {
            let case = format!("{what}: pebble of 1 cm on a planet of {} m", power(planet));
            rows.push(row(case, |rung| {
                let n = n / 8;
                let [lost, off] = pebble_seen(rung, made, planet, 0.01, DVec3::ZERO, n);
                let text = format!("{} lost, off {off:.0e} radii", per_million(lost as usize, n));
                Cell::new(text, rung.is_robust() && (lost > 0.0 || off > 1e-4))
            }));
        }
        // Where f32 does not hold a pebble: the origin is elsewhere, and positions are rounded to the planet.
        let case = format!("{what}, the origin in the middle of the planet: smallest pebble");
        rows.push(row(case, |rung| {
            let planet = 6.4e6;
            let holds = |power: i32| {
                let pebble = planet * f64::exp2(f64::from(-power));
                let at = DVec3::Y * planet;
                let [lost, off] = pebble_seen(rung, made, planet, pebble, at, n / 64);
                lost == 0.0 && off < 0.1
            };
            let power = (1..=40).take_while(|power| holds(*power)).last().unwrap_or(0);
            let ratio = f64::exp2(f64::from(-power));
            Cell::new(format!("{ratio:.0e} of it"), rung.is_robust() && power < 18)
        }));
    }
    Table {
        title: "Huge and tiny in one scene",
        what: "A camera 1 m from the pebble, both near the file's origin: of each million rays those that miss it, and by \
               how much of its radius a hit is off (beyond the depth of its facets, of a mesh). Red: a ray lost, or a hit \
               off by more than 10⁻⁴, from `robust` on. There f32 has all its digits. \
               Elsewhere positions are rounded to 2⁻²⁴ of their distance from the origin, or, in a scene that is moved, \
               of its extent; the vertices of one mesh are rounded alike. The rows with the origin in the middle of the \
               planet, where a pebble of 1 cm is not held by any rung, tell the smallest, by halves, to which no ray \
               is lost and whose hits are off by less than a tenth of its radius. Put the origin where the details are. \
               Red: larger than 4·10⁻⁶.",
        columns: Rung::columns(),
        rows,
    }
}
