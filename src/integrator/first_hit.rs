//! What camera rays see first, for the layers of a picture that hold no light.

use super::CameraBlock;
use crate::accel::{LANES, lanes_of};
use crate::color::{Rgb, RgbLanes};
use crate::film::Aov;
use crate::math::Vec3Lanes;
use crate::scene::{Cone, Scene};

/// First surfaces, by lane; all is zero where a ray meets nothing.
#[derive(Debug)]
pub struct FirstHits {
    albedo: RgbLanes<LANES>,
    normal: RgbLanes<LANES>,
    shading_normal: RgbLanes<LANES>,
}

impl FirstHits {
    /// Those of a block.
    pub fn of(scene: &Scene, camera: &CameraBlock<'_>) -> Self {
        let points = scene.surfaces(camera.rays, camera.hits);
        let mut found = Self {
            albedo: RgbLanes::BLACK,
            normal: RgbLanes::BLACK,
            shading_normal: RgbLanes::BLACK,
        };
        let vector = |vectors: &Vec3Lanes<LANES>, lane| Rgb::from(vectors.get(lane).to_array());
        for lane in lanes_of(points.hit()) {
            found.normal.set(lane, vector(&points.geometric_normal, lane));
            if !scene.has_maps() {
                found.albedo.set(lane, points.material(scene, lane).albedo());
                found.shading_normal.set(lane, vector(&points.normal, lane));
            } else if let Some(hit) = &camera.hits.get(lane) {
                let mut point = points.point(scene, hit, lane);
                let cone = Cone::of_pixel(scene, &camera.rays.get(lane));
                let cone = scene.widened(cone, hit, point.position);
                let textured = scene.apply_maps(hit, cone.width, &mut point);
                let material = textured.as_ref().unwrap_or(point.material);
                found.albedo.set(lane, material.albedo());
                found.shading_normal.set(lane, Rgb::from(point.normal.to_array()));
            }
        }
        found
    }

    /// The values of a layer; none of one that is not of the first hit.
    pub fn values(&self, aov: Aov) -> Option<&RgbLanes<LANES>> {
        match aov {
            Aov::Albedo => Some(&self.albedo),
            Aov::Normal => Some(&self.normal),
            Aov::ShadingNormal => Some(&self.shading_normal),
            _ => None,
        }
    }
}
