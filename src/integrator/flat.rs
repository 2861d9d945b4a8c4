//! The lecture's first picture: the colour of what is hit, and no light at all.

use super::{CameraBlock, Integrator, RayCounts};
use crate::accel::{LANES, RayQuery};
use crate::color::RgbLanes;
use crate::scene::{Cone, Scene};

/// Shows the albedo of the first surface.
#[derive(Debug, Clone, Copy)]
pub struct Flat;

impl Integrator for Flat {
    fn shade<Q: RayQuery>(
        &self,
        scene: &Scene,
        _query: &Q,
        camera: &CameraBlock<'_>,
        _counts: &mut RayCounts,
    ) -> RgbLanes<LANES> {
        RgbLanes::from_fn(|lane| match &camera.hits.get(lane) {
            None => scene.background,
            Some(hit) if !scene.has_maps() => scene.material(hit).albedo(),
            Some(hit) => {
                let ray = camera.rays.get(lane);
                let mut point = scene.surface(&ray, hit);
                let cone = scene.widened(Cone::of_pixel(scene, &ray), hit, point.position);
                match scene.apply_maps(hit, cone.width, &mut point) {
                    None => point.material.albedo(),
                    Some(material) => material.albedo(),
                }
            }
        })
    }
}
