//! The rays of a scene: from the camera, and one of each further kind from every first hit, in blocks and
//! in the order in which the renderer traces them.

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;
use serde::Serialize;

use crate::accel::{LANES, RayBlock, RayQuery};
use crate::film::FilterTable;
use crate::math::cosine_hemisphere;
use crate::sampler::{Dimensions, Sampler};
use crate::scene::Scene;

/// What a ray is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RayKind {
    /// From the camera: the closest hit.
    Camera,
    /// From a first hit to a light: whether anything is in between.
    Shadow,
    /// From a first hit, mirrored at the shading normal: the closest hit.
    Reflection,
    /// From a first hit, at random in proportion to the cosine: the closest hit.
    Diffuse,
}

impl RayKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Camera, Self::Shadow, Self::Reflection, Self::Diffuse];

    /// The name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Shadow => "shadow",
            Self::Reflection => "reflection",
            Self::Diffuse => "diffuse",
        }
    }
}

/// Pixels of the side of a tile and of a block, as in [`crate::render`].
const TILE: u32 = 32;
const BLOCK: u32 = 4;

/// The rays of each kind.
#[derive(Debug, Clone)]
pub struct Rays(pub [Vec<RayBlock>; 4]);

impl Rays {
    /// Traces the camera rays of one sample of the picture, or of as many of its tiles as have `limit`
    /// pixels, and makes the others from what they hit.
    pub fn record<Q: RayQuery>(scene: &Scene, query: &Q, limit: usize) -> Self {
        let tiles = tiles(scene.size, limit);
        let filter = FilterTable::new(scene.settings.filter);
        let block = |origin: [u32; 2]| Self::of_block(scene, query, &filter, origin);
        let blocks: Vec<[RayBlock; 4]> =
            tiles.into_par_iter().flat_map_iter(blocks_of).map(block).collect();
        let mut kinds: [Vec<RayBlock>; 4] = std::array::from_fn(|_| Vec::new());
        for block in blocks {
            for (rays, block) in kinds.iter_mut().zip(block) {
                if block.active() != 0 {
                    rays.push(block);
                }
            }
        }
        Self(kinds)
    }

    /// The blocks of a kind.
    pub fn blocks(&self, kind: RayKind) -> &[RayBlock] {
        &self.0[kind as usize]
    }

    /// The number of rays in some blocks.
    pub fn count(blocks: &[RayBlock]) -> u64 {
        blocks.iter().map(|b| u64::from(b.active().count_ones())).sum()
    }

    fn of_block<Q: RayQuery>(
        scene: &Scene,
        query: &Q,
        filter: &FilterTable,
        [x0, y0]: [u32; 2],
    ) -> [RayBlock; 4] {
        let [mut camera, mut shadow, mut reflection, mut diffuse] =
            [const { RayBlock::empty() }; 4];
        let [width, height] = scene.size;
        let pixel = |lane: usize| [x0 + lane as u32 % BLOCK, y0 + lane as u32 / BLOCK];
        let samplers: [Sampler; LANES] =
            std::array::from_fn(|lane| Sampler::new(0, pixel(lane), 0));
        for (lane, sampler) in samplers.iter().enumerate() {
            let [x, y] = pixel(lane);
            if x >= width || y >= height {
                continue;
            }
            let [u, v, lens_u, lens_v] = sampler.four(Dimensions::Camera);
            let [dx, dy] = filter.sample([u, v]).offset.map(f64::from);
            let film = DVec2::new(f64::from(x) + 0.5 + dx, f64::from(y) + 0.5 + dy);
            if let Some(ray) = scene.camera.ray(film, [lens_u, lens_v]) {
                camera.set(lane, &ray);
            }
        }
        // A block looks at one light, as the renderer looks at one after the other.
        let light = match scene.lights.len() {
            0 => None,
            n => Some(&scene.lights[(x0 / BLOCK + y0 / BLOCK) as usize % n]),
        };
        let hits = query.intersect_block(&camera);
        for lane in camera.lanes() {
            let Some(hit) = hits.get(lane) else { continue };
            let ray = camera.get(lane);
            let point = scene.surface(&ray, &hit);
            let leaves = |direction: glam::Vec3| direction.dot(point.geometric_normal) > 0.0;
            let further = |d| (leaves(d)).then(|| scene.spawn(&point, d, f32::INFINITY));
            let [u, v, ..] = samplers[lane].four(Dimensions::Light);
            let sample = light.and_then(|light| light.sample(scene.departure(&point), [u, v]));
            if let Some(s) = sample.filter(|s| leaves(s.direction)) {
                shadow.set(lane, &scene.spawn(&point, s.direction, s.distance));
            }
            let d = ray.direction;
            if let Some(ray) = further(d - point.normal * (2.0 * d.dot(point.normal))) {
                reflection.set(lane, &ray);
            }
            let [u, v, ..] = samplers[lane].four(Dimensions::Direction);
            if let Some(ray) = further(cosine_hemisphere(point.normal, [u, v])) {
                diffuse.set(lane, &ray);
            }
        }
        [camera, shadow, reflection, diffuse]
    }
}

/// Tiles of the picture in its order, evenly spread where not all fit.
fn tiles([width, height]: [u32; 2], limit: usize) -> Vec<[u32; 2]> {
    let all: Vec<[u32; 2]> = (0..height)
        .step_by(TILE as usize)
        .flat_map(|y| (0..width).step_by(TILE as usize).map(move |x| [x, y]))
        .collect();
    let wanted = (limit / (TILE * TILE) as usize).max(1);
    spread(all.len(), wanted, 1).into_iter().map(|run| all[run.start]).collect()
}

/// The blocks of a tile in the renderer's order.
fn blocks_of([x0, y0]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    let side = || (0..TILE).step_by(BLOCK as usize);
    side().flat_map(move |y| side().map(move |x| [x0 + x, y0 + y]))
}

/// About `wanted` of `n` things in runs of `length`, evenly spread; all of them where there are no more.
pub(super) fn spread(n: usize, wanted: usize, length: usize) -> Vec<Range<usize>> {
    let length = length.clamp(1, n.max(1));
    if wanted >= n {
        return (0..n).step_by(length).map(|start| start..(start + length).min(n)).collect();
    }
    let runs = (wanted / length).max(1);
    // In the middle of equal parts: the first alone would show the sky.
    let aside = (n / runs).saturating_sub(length) / 2;
    (0..runs).map(|i| i * n / runs + aside).map(|start| start..(start + length).min(n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_spread_without_overlap() {
        assert_eq!(spread(10, 100, 4), [0..4, 4..8, 8..10]);
        assert_eq!(spread(100, 20, 5), [10..15, 35..40, 60..65, 85..90]);
        assert_eq!(spread(7, 3, 1), [0..1, 2..3, 4..5]);
        assert_eq!(spread(100, 2, 1), [24..25, 74..75]);
        assert!(spread(0, 5, 4).is_empty());
    }

    #[test]
    fn a_large_picture_is_looked_at_in_tiles_all_over() {
        assert_eq!(tiles([64, 33], usize::MAX), [[0, 0], [32, 0], [0, 32], [32, 32]]);
        let some = tiles([3200, 3200], 100 * 1024);
        assert_eq!(some.len(), 100);
        assert!(some.iter().any(|[_, y]| *y > 3000));
    }
}
