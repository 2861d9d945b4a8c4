//! How much of the picture a mesh covers, about, before anything is built over it.

use glam::{DVec2, DVec3};

use crate::camera::Camera;
use crate::geometry::TriangleMesh;
use crate::math::Bounds;

/// Cells along each axis of the box around the mesh, of which those count that have a corner of a triangle.
const CELLS: usize = 32;

/// Triangles that are asked, evenly spread over the list: several for each cell of a closed surface.
const TRIANGLES: usize = 1 << 15;

/// Rays along each axis of the picture.
const RAYS: usize = 48;

/// The share of the camera's rays that hit a mesh: those that pass a cell of a coarse grid in which it has corners.
/// A millisecond or two, however large the mesh. Rims come out wider by about a cell, and triangles larger than a
/// cell have holes.
pub(super) fn coverage(mesh: &TriangleMesh, camera: &Camera, size: [u32; 2]) -> f64 {
    let bounds = mesh.bounds();
    let extent = bounds.size();
    // What is flat has one layer of cells.
    let scale =
        DVec3::from_array(extent.to_array().map(|d| if d > 0.0 { CELLS as f64 / d } else { 0.0 }));
    let cell = |p: DVec3| {
        let place = ((p - bounds.min) * scale).to_array();
        let [x, y, z] = place.map(|c| (c.max(0.0) as usize).min(CELLS - 1));
        (z * CELLS + y) * CELLS + x
    };
    let mut is_taken = vec![false; CELLS * CELLS * CELLS];
    let step = mesh.triangles.len().div_ceil(TRIANGLES).max(1);
    for index in (0..mesh.triangles.len()).step_by(step) {
        for corner in mesh.corners(index) {
            is_taken[cell(mesh.origin + corner.as_dvec3())] = true;
        }
    }
    let is_hit = |x: usize, y: usize| {
        let [x, y] = [x, y].map(|i| (i as f64 + 0.5) / RAYS as f64);
        let film = DVec2::new(x * f64::from(size[0]), y * f64::from(size[1]));
        meets(&bounds, scale, camera.ray_f64(film), |p| is_taken[cell(p)])
    };
    let hits = (0..RAYS * RAYS).filter(|i| is_hit(i % RAYS, i / RAYS)).count();
    hits as f64 / (RAYS * RAYS) as f64
}

/// Whether a ray passes a cell that is taken, looked at in steps of a third of a cell.
fn meets(
    bounds: &Bounds,
    scale: DVec3,
    (origin, direction): (DVec3, DVec3),
    is_taken: impl Fn(DVec3) -> bool,
) -> bool {
    let Some((enter, exit)) = bounds.clip(origin, direction) else { return false };
    let enter = enter.max(0.0);
    let steps = ((direction * scale).length() * (exit - enter) * 3.0).max(0.0);
    if !steps.is_finite() {
        return true;
    }
    let steps = steps.min(6.0 * CELLS as f64).ceil();
    let at = |i: usize| origin + direction * (enter + (exit - enter) * (i as f64 / steps.max(1.0)));
    (exit >= enter) && (0..=steps as usize).any(|i| is_taken(at(i)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::AccelKind;
    use crate::camera::Projection;
    use crate::geometry::generate::{GeneratedKind, GeneratedMesh};
    use crate::scene::{
        CameraDesc, IntegratorKind, Location, ObjectDesc, PlaceDesc, Scene, SceneDesc, ShapeDesc,
    };

    fn mesh(kind: GeneratedKind) -> TriangleMesh {
        let mesh = GeneratedMesh::new(kind, 200_000, 3).unwrap();
        let positions = (0..mesh.vertex_count()).flat_map(|i| mesh.vertex(i)).collect();
        TriangleMesh::new(positions, (0..mesh.triangle_count()).map(|i| mesh.triangle(i)).collect())
    }

    fn scene(mesh: &TriangleMesh, eye: DVec3, target: DVec3, fov: f64) -> Scene {
        let mut desc = SceneDesc { meshes: vec![mesh.clone()], ..SceneDesc::default() };
        desc.image.size = [160, 90];
        desc.settings.integrator = IntegratorKind::Flat;
        desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), None));
        desc.camera = Some(CameraDesc {
            at: Location::default(),
            projection: Projection::Perspective { fov: fov.to_radians() },
            place: Some(PlaceDesc::LookAt { eye, target, up: DVec3::new(0.1, 0.9, 0.2) }),
            lens: None,
        });
        Scene::build_quietly(desc, AccelKind::default()).unwrap()
    }

    /// Against the rays of every pixel.
    #[test]
    fn the_share_is_about_that_of_the_rays_that_hit() {
        let mut shares = Vec::new();
        for kind in [GeneratedKind::Terrain, GeneratedKind::Blobs] {
            let mesh = mesh(kind);
            let bounds = mesh.bounds();
            let (center, r) = (bounds.center(), bounds.size().length() / 2.0);
            for (eye, fov) in [
                (DVec3::new(-0.7, 0.9, 1.1), 45.0),
                (DVec3::new(2.0, 3.0, 1.0), 60.0),
                (DVec3::new(0.1, 0.05, 0.1), 70.0),
                (DVec3::new(9.0, 2.0, 5.0), 8.0),
                (DVec3::new(-3.0, 0.4, -3.0), 50.0),
            ] {
                let scene = scene(&mesh, center + eye * r, center, fov);
                let query = scene.accel.query();
                let pixels = (0..90).flat_map(|y| (0..160).map(move |x| [x, y]));
                let hits = pixels.filter(|&[x, y]| {
                    let film = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    scene.camera.ray(film, [0.5; 2]).is_some_and(|ray| query.occluded(&ray))
                });
                let share = hits.count() as f64 / (160.0 * 90.0);
                let told = coverage(&mesh, &scene.camera, scene.size);
                assert!((told - share).abs() < 0.06 + 0.1 * share, "{eye}: {told} by {share}");
                shares.push(share);
            }
        }
        // Small pictures of it, and full ones.
        assert!(shares.iter().any(|s| *s < 0.25) && shares.iter().any(|s| *s > 0.9), "{shares:?}");
    }

    #[test]
    fn what_is_behind_flat_or_far_off_is_no_trouble() {
        let mut flat = mesh(GeneratedKind::Terrain);
        let up = DVec3::new(0.0, 1e-9, 1.0);
        let away = scene(&flat, DVec3::new(0.0, 90.0, 90.0), DVec3::new(0.0, 180.0, 180.0), 40.0);
        assert_eq!(coverage(&flat, &away.camera, away.size), 0.0);
        flat.positions.as_flat_mut().chunks_exact_mut(3).for_each(|p| p[1] = 0.25);
        let above = scene(&flat, DVec3::new(0.0, 30.0, 1.0), up, 20.0);
        assert_eq!(coverage(&flat, &above.camera, above.size), 1.0);
        flat.positions.as_flat_mut().iter_mut().for_each(|p| *p *= 1e9);
        let far = scene(&flat, DVec3::new(0.0, 30.0, 1.0) * 1e9, up, 20.0);
        assert!(coverage(&flat, &far.camera, far.size) > 0.9);
    }
}
