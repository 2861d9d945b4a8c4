//! The ray queries of a render, written down to be asked again without shading.

use std::sync::Mutex;

use alhazen::accel::{Hit, HitBlock, LANES, RayBlock, RayQuery};
use alhazen::integrator::{CameraBlock, Integrator, RayCounts};
use alhazen::math::Ray;
use alhazen::scene::Scene;
use rayon::prelude::*;

/// A query that was asked.
pub enum Query {
    Closest(Ray),
    Any(Ray),
    ClosestBlock(Box<RayBlock>),
    AnyBlock(Box<RayBlock>),
}

impl Query {
    pub fn in_packet(&self) -> u64 {
        match self {
            Self::Closest(_) | Self::Any(_) => 0,
            Self::ClosestBlock(rays) | Self::AnyBlock(rays) => rays.active().count_ones().into(),
        }
    }

    pub fn run(&self, query: &impl RayQuery) {
        match self {
            Self::Closest(ray) => drop(std::hint::black_box(query.intersect(ray))),
            Self::Any(ray) => _ = std::hint::black_box(query.occluded(ray)),
            Self::ClosestBlock(rays) => drop(std::hint::black_box(query.intersect_block(rays))),
            Self::AnyBlock(rays) => _ = std::hint::black_box(query.occluded_block(rays)),
        }
    }

    pub fn run_single(&self, query: &impl RayQuery) {
        match self {
            Self::Closest(_) | Self::Any(_) => self.run(query),
            Self::ClosestBlock(rays) => rays.lanes().for_each(|lane| {
                let _ = std::hint::black_box(query.intersect(&rays.get(lane)));
            }),
            Self::AnyBlock(rays) => rays.lanes().for_each(|lane| {
                let _ = std::hint::black_box(query.occluded(&rays.get(lane)));
            }),
        }
    }
}

/// Answers queries and writes them down: rays of the tree as they would be asked by whoever knows nothing of
/// where they end, though the tree bounds those within spheres.
struct Recorder<'a, Q> {
    query: &'a Q,
    asked: Mutex<Vec<Query>>,
}

impl<Q> Recorder<'_, Q> {
    fn note(&self, query: Query) {
        self.asked.lock().expect("no thread panicked").push(query);
    }
}

impl<Q: RayQuery> RayQuery for Recorder<'_, Q> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.note(Query::Closest(Ray { t_max: f32::INFINITY, ..*ray }));
        self.query.intersect(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.note(Query::Any(*ray));
        self.query.occluded(ray)
    }

    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.query.occluded_by_opaque(ray)
    }

    fn intersect_block(&self, rays: &RayBlock) -> HitBlock {
        let mut endless = Box::new(rays.clone());
        endless.t_max = [f32::INFINITY; LANES];
        self.note(Query::ClosestBlock(endless));
        self.query.intersect_block(rays)
    }

    fn occluded_block(&self, rays: &RayBlock) -> u16 {
        self.note(Query::AnyBlock(Box::new(rays.clone())));
        self.query.occluded_block(rays)
    }
}

/// All queries of a render by `integrator`, tile by tile in the order in which a thread asks them.
pub fn record<Q: RayQuery>(
    scene: &Scene,
    query: &Q,
    integrator: &impl Integrator,
) -> (Vec<Query>, RayCounts) {
    let mut all = Vec::new();
    let mut total = RayCounts::default();
    for sample in 0..scene.settings.samples {
        let blocks = super::camera_blocks(scene, sample);
        let parts: Vec<_> = blocks
            .par_chunks(64)
            .map(|blocks| {
                let recorder = Recorder { query, asked: Mutex::default() };
                let mut counts = RayCounts::default();
                for (rays, samplers) in blocks {
                    counts.camera += u64::from(rays.active().count_ones());
                    let hits = recorder.intersect_block(rays);
                    let camera = CameraBlock { rays, hits: &hits, samplers };
                    std::hint::black_box(integrator.shade(scene, &recorder, &camera, &mut counts));
                }
                (recorder.asked.into_inner().expect("no thread panicked"), counts)
            })
            .collect();
        for (queries, counts) in parts {
            all.extend(queries);
            total.add(&counts);
        }
    }
    (all, total)
}
