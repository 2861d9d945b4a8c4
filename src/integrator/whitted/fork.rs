//! From the hits of a block to the next rays of the tree, lanes side by side: as scatter.rs has it hit by hit,
//! which is still asked where there is more to a surface than mirrored and refracted light. The loops over lanes
//! are without branches, for the compiler to turn into vector instructions.

use super::scatter::{Branch, Way, mirror_normal, mirrored_direction};
use super::{Features, Node, Walk};
use crate::accel::{HitBlock, LANES, RayBlock, RayQuery, lanes_of};
use crate::color::Rgb;
use crate::material::{FresnelModel, Material, fresnel};
use crate::math::{Vec3Lanes, lanes_where};
use crate::medium::Interior;
use crate::scene::{Cone, SurfaceBlock};

/// Indices of refraction on the near and the far side, by lane.
type Indices = [[f32; LANES]; 2];

/// Light that is mirrored.
struct Mirrored {
    direction: Vec3Lanes<LANES>,
    /// Normals on the ray's side, by which it is.
    normal: Vec3Lanes<LANES>,
    /// Cosine of the angle of incidence.
    cos_i: [f32; LANES],
}

/// Light that enters the far side.
struct Refracted {
    direction: Vec3Lanes<LANES>,
    /// Share that does not: all of it under total reflection.
    reflected: [f32; LANES],
    /// Where any does.
    lanes: u16,
    /// Where all this is right.
    is_right: u16,
}

impl<Q: RayQuery, F: Features> Walk<'_, Q, F> {
    /// Puts the rays that go on from the hits of a block on the stack. `weights` say what light that leaves a
    /// surface towards the ray counts for in the pixel.
    pub(super) fn fork(
        &mut self,
        rays: &RayBlock,
        hits: &HitBlock,
        points: &SurfaceBlock,
        nodes: &[Node; LANES],
        weights: &[Rgb; LANES],
    ) {
        let scene = self.scene;
        let (mut mirrors, mut glass, mut others) = (0u16, 0u16, 0u16);
        let mut indices: Indices = [[1.0; LANES]; 2];
        let mut beyond = [Interior::OUTSIDE; LANES];
        for lane in lanes_of(points.hit()) {
            let material = points.material(scene, lane);
            if !material.is_specular() {
                self.counts.ends.diffuse += 1;
                continue;
            }
            let Material::Dielectric(dielectric) = material else {
                mirrors |= 1 << lane;
                continue;
            };
            let crossing = points.crossing(scene, nodes[lane].interior, lane);
            let [n_i, n_t] = crossing.indices(scene, 0.0);
            if n_i == n_t || dielectric.fresnel != FresnelModel::Exact {
                others |= 1 << lane;
                continue;
            }
            glass |= 1 << lane;
            (indices[0][lane], indices[1][lane]) = (n_i, n_t);
            beyond[lane] = crossing.beyond;
        }
        if mirrors | glass != 0 {
            let mirrored = mirrored(rays, points);
            let refracted = (glass != 0).then(|| refracted(rays, points, &mirrored, &indices));
            if let Some(refracted) = &refracted {
                others |= glass & !refracted.is_right;
                glass &= refracted.is_right;
            }
            let lanes = mirrors | glass;
            let (next, known) = scene.spawn_block_on(points, hits, &mirrored.direction, lanes);
            for lane in lanes_of(lanes) {
                let share = match &refracted {
                    Some(refracted) if glass >> lane & 1 == 1 => {
                        Rgb::splat(refracted.reflected[lane])
                    }
                    _ => points.material(scene, lane).mirrored(mirrored.cos_i[lane]),
                };
                let Node { interior, cone, wavelength, .. } = nodes[lane];
                let (throughput, way) = (weights[lane] * share, Way::Mirrored);
                let branch = Branch { throughput, interior, way, cone, wavelength };
                self.child(&nodes[lane], branch, |_| (next.get(lane), known[lane]));
            }
            if let Some(refracted) = &refracted {
                let lanes = glass & refracted.lanes;
                let (next, known) = scene.spawn_block_on(points, hits, &refracted.direction, lanes);
                for lane in lanes_of(lanes) {
                    let Node { cone, wavelength, .. } = nodes[lane];
                    let throughput = weights[lane] * (1.0 - refracted.reflected[lane]);
                    let (interior, way) = (beyond[lane], Way::Refracted);
                    let branch = Branch { throughput, interior, way, cone, wavelength };
                    self.child(&nodes[lane], branch, |_| (next.get(lane), known[lane]));
                }
            }
        }
        for lane in lanes_of(others) {
            if let Some(hit) = &hits.get(lane) {
                let (point, material) =
                    (points.point(scene, hit, lane), points.material(scene, lane));
                self.children(&nodes[lane], &point, material, weights[lane], Cone::default());
            }
        }
    }
}

// Neither of the two is inlined: the compiler sees best by itself that nothing here overlaps.

#[inline(never)]
fn mirrored(rays: &RayBlock, points: &SurfaceBlock) -> Mirrored {
    let mut mirrored =
        Mirrored { direction: Vec3Lanes::ZERO, normal: Vec3Lanes::ZERO, cos_i: [0.0; LANES] };
    for i in 0..LANES {
        let d = rays.get(i).direction;
        let geometric = points.geometric_normal.get(i);
        let n = mirror_normal(d, points.normal.get(i), geometric);
        mirrored.direction.set(i, mirrored_direction(d, n, geometric));
        mirrored.normal.set(i, n);
        mirrored.cos_i[i] = -d.dot(n);
    }
    mirrored
}

#[inline(never)]
fn refracted(
    rays: &RayBlock,
    points: &SurfaceBlock,
    mirrored: &Mirrored,
    [n_i, n_t]: &Indices,
) -> Refracted {
    let mut direction = Vec3Lanes::ZERO;
    let mut reflected = [1.0; LANES];
    let (mut any, mut right) = ([false; LANES], [false; LANES]);
    for i in 0..LANES {
        let eta = n_t[i] / n_i[i];
        let d = rays.get(i).direction;
        let (bent, is_any, is_right) = fresnel::refract_always(d, mirrored.normal.get(i), eta);
        let share = fresnel::dielectric(bent.cos_i, bent.cos_t, eta);
        reflected[i] = if is_any { share } else { 1.0 };
        direction.set(i, bent.direction);
        any[i] = is_any;
        // Not where a shading normal sends it out of the surface.
        let is_in = bent.direction.dot(points.geometric_normal.get(i)) < 0.0;
        right[i] = is_right & (is_in | !is_any);
    }
    let (lanes, is_right) = (lanes_where(&any), lanes_where(&right));
    Refracted { direction, reflected, lanes, is_right }
}
