//! What camera rays see first, for the layers of a picture that hold no light.

use super::CameraBlock;
use crate::accel::{LANES, lanes_of};
use crate::color::Rgb;
use crate::film::Aov;
use crate::math::Vec3Lanes;
use crate::scene::{Cone, Scene};

/// First surfaces, by lane; all is zero where a ray meets nothing.
#[derive(Debug)]
pub struct FirstHits {
    albedo: [Rgb; LANES],
    normal: [Rgb; LANES],
    shading_normal: [Rgb; LANES],
}

impl FirstHits {
    /// Those of a block.
    pub fn of(scene: &Scene, camera: &CameraBlock<'_>) -> Self {
        let points = scene.surfaces(camera.rays, camera.hits);
        let mut found = Self {
            albedo: [Rgb::BLACK; LANES],
            normal: [Rgb::BLACK; LANES],
            shading_normal: [Rgb::BLACK; LANES],
        };
        let vector = |vectors: &Vec3Lanes<LANES>, lane| Rgb::from(vectors.get(lane).to_array());
        for lane in lanes_of(points.hit()) {
            found.normal[lane] = vector(&points.geometric_normal, lane);
            if !scene.has_maps() {
                found.albedo[lane] = points.material(scene, lane).albedo();
                found.shading_normal[lane] = vector(&points.normal, lane);
            } else if let Some(hit) = camera.hits.get(lane) {
                let mut point = points.point(scene, hit, lane);
                let cone = Cone::of_pixel(scene, &camera.rays.get(lane));
                let cone = scene.widened(cone, hit, point.position);
                let textured = scene.apply_maps(hit, cone.width, &mut point);
                found.albedo[lane] = textured.as_ref().unwrap_or(point.material).albedo();
                found.shading_normal[lane] = Rgb::from(point.normal.to_array());
            }
        }
        found
    }

    /// The values of a layer; none of one that is not of the first hit.
    pub fn values(&self, aov: Aov) -> Option<&[Rgb; LANES]> {
        match aov {
            Aov::Albedo => Some(&self.albedo),
            Aov::Normal => Some(&self.normal),
            Aov::ShadingNormal => Some(&self.shading_normal),
            _ => None,
        }
    }
}
