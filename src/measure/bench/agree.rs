//! Whether two structures find the same hits, and if not, in what they differ.

use std::ops::AddAssign;

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::rays::RayKind;
use super::structures::{Contestant, Packets, Singles};
use crate::accel::{Geometry, Hit, LANES, RayBlock, RayQuery, affine_from_rows};
use crate::math::Ray;
use crate::scene::Scene;

/// How answers differ from those of a reference, in rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Agreement {
    /// Rays compared.
    pub rays: u64,
    /// Another primitive at the same distance, within the tolerance: surfaces that touch or coincide.
    pub ties: u64,
    /// Rays so close to an edge that the reference gives this answer too if they are moved aside by the
    /// tolerance: either is right.
    pub edges: u64,
    /// The reference hits something, this does not.
    pub missing: u64,
    /// The reference hits nothing, this does.
    pub extra: u64,
    /// Both hit, at different distances.
    pub differing: u64,
}

impl Agreement {
    /// Answers that are wrong, whichever way.
    pub const fn wrong(&self) -> u64 {
        self.missing + self.extra + self.differing
    }
}

impl AddAssign for Agreement {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.ties += other.ties;
        self.edges += other.edges;
        self.missing += other.missing;
        self.extra += other.extra;
        self.differing += other.differing;
    }
}

/// Answers of the reference to a block.
pub(super) struct Known {
    hits: [Option<Hit>; LANES],
    occluded: u16,
}

/// Asks the reference.
pub(super) fn known(reference: &dyn Contestant, kind: RayKind, blocks: &[&RayBlock]) -> Vec<Known> {
    let ask = |block: &&RayBlock| {
        if kind == RayKind::Shadow {
            return Known { hits: [None; LANES], occluded: reference.occluded(block) };
        }
        let hits = reference.closest(block);
        Known { hits: std::array::from_fn(|lane| hits.get(lane)), occluded: 0 }
    };
    blocks.par_iter().map(ask).collect()
}

/// Compares the answers of `row` with those that are known of `reference`.
pub(super) fn compare(
    scene: &Scene,
    reference: &dyn Contestant,
    row: &dyn Contestant,
    kind: RayKind,
    blocks: &[&RayBlock],
    known: &[Known],
) -> Agreement {
    let judge = Judge { scene, reference, kind, reach: reach(scene) };
    let sum = |mut a: Agreement, b: Agreement| {
        a += b;
        a
    };
    blocks
        .par_iter()
        .zip(known)
        .map(|(block, known)| judge.block(row, block, known))
        .reduce(Agreement::default, sum)
}

/// Compares the answers of `row`, one by one and in blocks, with those of a reference one by one: what is
/// hit first, and whether anything is. `rays` and all counts are over the four comparisons.
pub fn agreement(
    scene: &Scene,
    reference: &dyn RayQuery,
    row: &dyn RayQuery,
    blocks: &[RayBlock],
) -> Agreement {
    let reference = Singles(reference);
    let blocks: Vec<&RayBlock> = blocks.iter().collect();
    let mut sum = Agreement::default();
    for kind in [RayKind::Camera, RayKind::Shadow] {
        let known = known(&reference, kind, &blocks);
        let ways: [&dyn Contestant; 2] = [&Singles(row), &Packets(row)];
        for way in ways {
            sum += compare(scene, &reference, way, kind, &blocks, &known);
        }
    }
    sum
}

struct Judge<'a> {
    scene: &'a Scene,
    reference: &'a dyn Contestant,
    kind: RayKind,
    /// How far the scene reaches, in metres.
    reach: f32,
}

/// What differs.
enum Verdict {
    Same,
    Tie,
    Missing,
    Extra,
    Differing,
}

impl Judge<'_> {
    fn block(&self, row: &dyn Contestant, block: &RayBlock, known: &Known) -> Agreement {
        let mut sum = Agreement::default();
        let (hits, bits) = if self.kind == RayKind::Shadow {
            (None, row.occluded(block))
        } else {
            (Some(row.closest(block)), 0)
        };
        for lane in block.lanes() {
            sum.rays += 1;
            let ray = block.get(lane);
            let expected = known.hits[lane].as_ref();
            let (verdict, got) = match &hits {
                None => match (known.occluded >> lane & 1, bits >> lane & 1) {
                    (1, 0) => (Verdict::Missing, None),
                    (0, 1) => (Verdict::Extra, closest(row, &ray)),
                    _ => (Verdict::Same, None),
                },
                Some(hits) => {
                    let got = hits.get(lane);
                    (self.verdict(&ray, expected, got.as_ref()), got)
                }
            };
            let count = match verdict {
                Verdict::Same => continue,
                Verdict::Tie => &mut sum.ties,
                _ if self.is_at_edge(&ray, &verdict, expected, got.as_ref()) => &mut sum.edges,
                Verdict::Missing => &mut sum.missing,
                Verdict::Extra => &mut sum.extra,
                Verdict::Differing => &mut sum.differing,
            };
            *count += 1;
        }
        sum
    }

    fn verdict(&self, ray: &Ray, expected: Option<&Hit>, got: Option<&Hit>) -> Verdict {
        match (expected, got) {
            (None, None) => Verdict::Same,
            (Some(_), None) => Verdict::Missing,
            (None, Some(_)) => Verdict::Extra,
            (Some(a), Some(b)) => {
                if !((a.t - b.t).abs() <= self.tolerance(ray, a, 0.0)) {
                    Verdict::Differing
                } else if who(a) == who(b) {
                    Verdict::Same
                } else {
                    Verdict::Tie
                }
            }
        }
    }

    /// How far apart distances to one surface may be: four times the error that a hit point is known to
    /// have, and sixteen roundings of where the ray comes from and how far it goes; by the cosine, as a
    /// ray that grazes a surface meets it far off. More where the rays are `aside` of each other.
    fn tolerance(&self, ray: &Ray, hit: &Hit, aside: f32) -> f32 {
        let point = self.scene.surface(ray, hit);
        let cosine = point.geometric_normal.dot(ray.direction).abs().max(1e-5);
        let way = ray.origin.abs().max_element() + hit.t;
        (4.0 * point.error + 16.0 * f32::EPSILON * way + aside) / cosine
    }

    /// Whether the reference gives the answer too for one of four rays close by, or missed a triangle, a
    /// needle perhaps, by so little that a hit is right too; or the ray begins on what it is said
    /// to hit.
    fn is_at_edge(
        &self,
        ray: &Ray,
        verdict: &Verdict,
        expected: Option<&Hit>,
        got: Option<&Hit>,
    ) -> bool {
        let by = 32.0 * f32::EPSILON * (ray.origin.abs().max_element() + self.reach);
        if let Some(got) = got
            && expected.is_none_or(|expected| got.t < expected.t)
            && (self.begins_on(ray, got)
                || self.passes(ray, got).is_some_and(|distance| distance <= f64::from(by)))
        {
            return true;
        }
        let (a, b) = ray.direction.any_orthonormal_pair();
        let mut block = RayBlock::empty();
        for (lane, side) in [a, -a, b, -b].into_iter().enumerate() {
            block.set(lane, &Ray { origin: ray.origin + side * by, ..*ray });
        }
        if self.kind == RayKind::Shadow {
            let bits = self.reference.occluded(&block);
            let is_extra = matches!(verdict, Verdict::Extra);
            return if is_extra { bits != 0 } else { bits != block.active() };
        }
        let hits = self.reference.closest(&block);
        block.lanes().any(|lane| match (hits.get(lane), got) {
            (None, None) => true,
            (Some(a), Some(b)) => (a.t - b.t).abs() <= self.tolerance(ray, &a, by),
            _ => false,
        })
    }

    /// Whether the origin of a ray lies on the very surface that it is said to hit, to the last bit or two:
    /// nearer than rays start that leave a surface.
    fn begins_on(&self, ray: &Ray, hit: &Hit) -> bool {
        let point = self.scene.surface(ray, hit);
        let lift = (ray.origin - point.position).dot(point.geometric_normal).abs();
        lift <= f32::EPSILON * ray.origin.abs().max_element() && hit.t <= 1e-3 * self.reach
    }

    /// How far the ray passes from the rim of the triangle that it is said to hit, where it crosses the plane
    /// of it, in f64. None where it does not cross it between its ends, as for a false hit of the surface
    /// that it leaves, and for other shapes.
    fn passes(&self, ray: &Ray, hit: &Hit) -> Option<f64> {
        let world = self.scene.world();
        let group = world.group(hit.copy);
        let Geometry::Mesh(mesh) = &group.geometries[hit.geometry as usize] else { return None };
        let mut corners = mesh.corners(hit.primitive as usize).map(|p| p.as_dvec3());
        if let Some(copy) = hit.copy {
            let world_from_object = affine_from_rows(world.transform(copy));
            corners = corners.map(|p| world_from_object.transform_point3(p));
        }
        let [a, b, c] = corners;
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let n = (b - a).cross(c - a);
        // A triangle without area is all rim.
        if n.length_squared() == 0.0 {
            return Some(0.0);
        }
        let t = n.dot(a - o) / n.dot(d);
        if !(t > f64::from(ray.t_min) && t <= f64::from(ray.t_max)) {
            return None;
        }
        let p = o + d * t;
        let to_edge = |a: DVec3, b: DVec3| {
            let (along, to) = (b - a, p - a);
            let place = (to.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            to.distance(along * place)
        };
        Some(to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a)))
    }
}

/// The closest hit of one ray.
fn closest(row: &dyn Contestant, ray: &Ray) -> Option<Hit> {
    let mut block = RayBlock::empty();
    block.set(0, ray);
    row.closest(&block).get(0)
}

fn who(hit: &Hit) -> (Option<crate::accel::CopyRef>, u32, u32) {
    (hit.copy, hit.geometry, hit.primitive)
}

fn reach(scene: &Scene) -> f32 {
    let b = &scene.bounds;
    if b.is_finite() { b.min.abs().max(b.max.abs()).max_element() as f32 } else { 1.0 }
}
