//! Direct light of a block from lights without size, lanes side by side: all that the variant without a tree
//! has, and what that with mirrors and glass has at each of its blocks. The loops over lanes are without
//! branches, for the compiler to turn into vector instructions.

#![expect(clippy::needless_range_loop, reason = "lanes of several arrays side by side")]

use super::super::RayCounts;
use crate::accel::{LANES, RayBlock, lanes_of};
use crate::color::{Rgb, RgbLanes};
use crate::light::{Light, PointLight};
use crate::math::{Vec3Lanes, lanes_where};
use crate::scene::{Scene, SurfaceBlock};

/// The light that arrives from one lamp, by lane.
struct Arriving {
    direction: Vec3Lanes<LANES>,
    distance: [f32; LANES],
    irradiance: RgbLanes<LANES>,
    /// Where any does.
    lanes: u16,
}

/// What the materials of a block leave of light.
struct Looks {
    /// Reflectance of those that scatter as Lambert's law says; black elsewhere.
    lambertian: RgbLanes<LANES>,
    /// Lanes of other materials that are lit.
    others: u16,
    /// Of all that are lit.
    lit: u16,
}

/// What the surfaces that the rays of a block hit show of ambient light and lamps. `blocked` tells which shadow
/// rays of a block are.
#[inline]
pub(super) fn direct_light(
    scene: &Scene,
    rays: &RayBlock,
    points: &SurfaceBlock,
    counts: &mut RayCounts,
    blocked: impl Fn(&RayBlock) -> u16,
) -> RgbLanes<LANES> {
    let mut radiance = RgbLanes::BLACK;
    let looks = looks(scene, points, &mut radiance);
    for light in scene.lights.iter().filter(|_| looks.lit != 0) {
        let arriving = arriving(light, points, looks.lit);
        let (light, lanes) = reflected(scene, rays, points, &looks, &arriving);
        if lanes == 0 {
            continue;
        }
        let mut passes = lanes;
        if scene.settings.shadows.are_cast() {
            counts.shadow += u64::from(lanes.count_ones());
            passes &= !blocked(&scene.spawn_block(
                points,
                &arriving.direction,
                &arriving.distance,
                lanes,
            ));
        }
        for (sum, light) in radiance.0.iter_mut().zip(&light.0) {
            for i in 0..LANES {
                sum[i] += if passes >> i & 1 == 1 { light[i] } else { 0.0 };
            }
        }
    }
    radiance
}

/// What is lit and how; their ambient light is added to `radiance`.
#[inline]
fn looks(scene: &Scene, points: &SurfaceBlock, radiance: &mut RgbLanes<LANES>) -> Looks {
    let mut looks = Looks { lambertian: RgbLanes::BLACK, others: 0, lit: 0 };
    // Material by material: mostly there is but one.
    let mut left = points.hit();
    while left != 0 {
        let first = left.trailing_zeros() as usize % LANES;
        let lanes = points.lanes_like(first) & left;
        left &= !lanes;
        let material = points.material(scene, first);
        if !material.is_lit() {
            continue;
        }
        looks.lit |= lanes;
        let lambertian = material.lambertian();
        looks.others |= if lambertian.is_none() { lanes } else { 0 };
        let ambient = material.ambient() * scene.ambient;
        let reflectance = lambertian.unwrap_or(Rgb::BLACK);
        if lanes == points.hit() {
            *radiance = RgbLanes::splat(ambient);
            looks.lambertian = RgbLanes::splat(reflectance);
            break;
        }
        let (ambient, reflectance) = (ambient.to_array(), reflectance.to_array());
        for c in 0..3 {
            for i in 0..LANES {
                let is_of_it = lanes >> i & 1 == 1;
                radiance.0[c][i] = if is_of_it { ambient[c] } else { radiance.0[c][i] };
                let own = looks.lambertian.0[c][i];
                looks.lambertian.0[c][i] = if is_of_it { reflectance[c] } else { own };
            }
        }
    }
    looks
}

/// What a lamp without size sends to the points of `lanes`.
#[inline]
fn arriving(light: &Light, points: &SurfaceBlock, lanes: u16) -> Arriving {
    let alike = |direction, distance, irradiance: Rgb| Arriving {
        direction: Vec3Lanes::splat(direction),
        distance: [distance; LANES],
        irradiance: RgbLanes::splat(irradiance),
        lanes,
    };
    if let Light::Directional(sun) = light {
        return alike(-sun.direction, f32::INFINITY, sun.irradiance);
    }
    if let Light::Point(point) = light {
        return arriving_from(point, &points.position, lanes);
    }
    let mut arriving = Arriving { lanes: 0, ..alike(glam::Vec3::ZERO, 0.0, Rgb::BLACK) };
    for lane in lanes_of(lanes) {
        let Some(sample) = light.sample(points.position.get(lane), [0.5; 2]) else { continue };
        arriving.lanes |= 1 << lane;
        arriving.direction.set(lane, sample.direction);
        arriving.distance[lane] = sample.distance;
        arriving.irradiance.set(lane, sample.irradiance);
    }
    arriving
}

/// What a point sends.
// Not inlined: the compiler sees best by itself that nothing here overlaps.
#[inline(never)]
fn arriving_from(light: &PointLight, positions: &Vec3Lanes<LANES>, lanes: u16) -> Arriving {
    let mut direction = Vec3Lanes::ZERO;
    let mut distance = [0.0; LANES];
    let mut irradiance = RgbLanes::BLACK;
    let mut is_any = [false; LANES];
    for i in 0..LANES {
        let (sample, any) = light.sample_always(positions.get(i).as_dvec3());
        direction.set(i, sample.direction);
        distance[i] = sample.distance;
        irradiance.set(i, sample.irradiance);
        is_any[i] = any;
    }
    Arriving { direction, distance, irradiance, lanes: lanes & lanes_where(&is_any) }
}

/// What leaves towards the rays if nothing stands between, and where that is anything.
#[inline]
fn reflected(
    scene: &Scene,
    rays: &RayBlock,
    points: &SurfaceBlock,
    looks: &Looks,
    arriving: &Arriving,
) -> (RgbLanes<LANES>, u16) {
    let mut light = RgbLanes::BLACK;
    let mut is_reflected = [false; LANES];
    for i in 0..LANES {
        let l = arriving.direction.get(i);
        let cos = points.normal.get(i).dot(l);
        // Not from behind the surface itself, whatever its shading normal says.
        let is_before = (l.dot(points.geometric_normal.get(i)) > 0.0) & (cos > 0.0);
        let share = cos * std::f32::consts::FRAC_1_PI;
        let mut is_black = true;
        for c in 0..3 {
            let response = looks.lambertian.0[c][i] * share;
            is_black &= response == 0.0;
            light.0[c][i] = response * arriving.irradiance.0[c][i];
        }
        is_reflected[i] = is_before & !is_black;
    }
    let mut lanes = lanes_where(&is_reflected);
    for lane in lanes_of(looks.others & arriving.lanes) {
        let (material, l) = (points.material(scene, lane), arriving.direction.get(lane));
        let response = material.response(points.normal.get(lane), -rays.get(lane).direction, l);
        if l.dot(points.geometric_normal.get(lane)) > 0.0 && !response.is_black() {
            light.set(lane, response * arriving.irradiance.get(lane));
            lanes |= 1 << lane;
        }
    }
    (light, lanes & arriving.lanes)
}
