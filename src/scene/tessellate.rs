//! Freeform surfaces become meshes: how fine, follows from where they are seen.
//!
//! A pixel is as large as at the point of the surface's bounds that is nearest to the camera: of each
//! patch where the object is in one place, of the whole object at the nearest of its copies where it is
//! in a prototype. A camera within the bounds counts as a hundredth of their diagonal away.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::build::{NameIndex, SceneError};
use super::desc::{FreeformDesc, Location, ObjectDesc, SceneDesc, ShapeDesc, Tolerance};
use crate::camera::{Pose, Projection};
use crate::geometry::freeform::{FreeformSurface, MAX_TRIANGLES, TooManyTriangles};
use crate::math::Bounds;

/// What became of a freeform surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Tessellation {
    /// Where the object was written.
    pub at: Location,
    /// What it is made of: one, and several.
    pub kind: [&'static str; 2],
    /// How many of these.
    pub patches: usize,
    /// The triangles they became.
    pub triangles: usize,
    /// What was asked for.
    pub tolerance: Tolerance,
    /// The least distance that this allowed, in metres of the object's own space.
    pub distance: f64,
}

/// How large a pixel is.
struct Pixels {
    pose: Option<Pose>,
    projection: Projection,
    size: [u32; 2],
}

impl Pixels {
    /// In metres, at the point of `bounds` that is nearest to the camera.
    fn at(&self, bounds: &Bounds) -> f64 {
        let diagonal = bounds.size().length();
        let [width, height] = self.size.map(f64::from);
        match (&self.pose, self.projection) {
            (Some(pose), Projection::Perspective { fov }) => {
                let nearest = pose.eye.clamp(bounds.min, bounds.max);
                let distance = (nearest - pose.eye).length().max(0.01 * diagonal);
                distance * 2.0 * (0.5 * fov).tan() / height
            }
            (Some(_), Projection::Orthographic { height: shown }) if shown > 0.0 => shown / height,
            // The camera will be placed so that all is seen: no object is larger than the picture, and
            // what is nearer than its middle is at most about twice as large.
            _ => bounds.size().max_element() / (2.0 * width.max(height)),
        }
    }
}

/// Makes a mesh of every freeform surface, adding it to the others.
pub(super) fn tessellate(
    desc: &mut SceneDesc,
    prototype_names: &NameIndex,
    pose: Option<Pose>,
    default_projection: Projection,
) -> Result<Vec<Tessellation>, Vec<SceneError>> {
    let all = desc.prototypes.iter().flat_map(|p| &p.objects).chain(&desc.objects);
    if !all.into_iter().any(|object| matches!(object.shape, ShapeDesc::Freeform(_))) {
        return Ok(Vec::new());
    }
    let projection = desc.camera.as_ref().map_or(default_projection, |c| c.projection);
    let pixels = Pixels { pose, projection, size: desc.image.size };
    let copies = Copies::of(desc, prototype_names);
    let mut done = Vec::new();
    let mut errors = Vec::new();
    let default = desc.settings.tolerance;
    let meshes = &mut desc.meshes;
    let mut replace = |object: &mut ObjectDesc, places: &[DAffine3]| {
        let ShapeDesc::Freeform(freeform) = &object.shape else { return };
        let freeform = Arc::clone(freeform);
        let tolerance = freeform.tolerance.unwrap_or(default);
        // What is wrong with a transform is told where objects are placed.
        let places = places.iter().map(|m| *m * object.transform).filter(DAffine3::is_finite);
        let places: Vec<DAffine3> = places.collect();
        match mesh(&freeform, tolerance, &places, &pixels) {
            Ok((mesh, distance)) => {
                let surface = &freeform.surface;
                done.push(Tessellation {
                    at: object.at.clone(),
                    kind: match surface {
                        FreeformSurface::Patches(_) => ["patch", "patches"],
                        FreeformSurface::Subdivision(_) => ["face", "faces"],
                    },
                    patches: surface.len(),
                    triangles: mesh.triangles.len(),
                    tolerance,
                    distance,
                });
                object.shape = ShapeDesc::Mesh(meshes.len());
                meshes.push(mesh);
            }
            Err(error) => errors.push(SceneError::TooManyTriangles {
                at: object.at.clone(),
                tolerance,
                limit: error.limit,
                fits: tolerance.times(error.fits / error.tolerance),
            }),
        }
    };
    for object in &mut desc.objects {
        replace(object, &[DAffine3::IDENTITY]);
    }
    for (prototype, places) in desc.prototypes.iter_mut().zip(&copies.places) {
        for object in &mut prototype.objects {
            replace(object, places);
        }
    }
    if errors.is_empty() { Ok(done) } else { Err(errors) }
}

/// The mesh of a surface that is in these places, and the least distance that was allowed.
fn mesh(
    freeform: &FreeformDesc,
    tolerance: Tolerance,
    places: &[DAffine3],
    pixels: &Pixels,
) -> Result<(crate::geometry::TriangleMesh, f64), TooManyTriangles> {
    let surface = &freeform.surface;
    let allowed = |bounds: &Bounds, place: &DAffine3| {
        let meters = match tolerance {
            Tolerance::Meters(meters) => meters,
            Tolerance::Pixels(count) => count * pixels.at(&bounds.transformed(place)),
        };
        let allowed = meters / largest_scale(&place.matrix3);
        // A transform that flattens, or patches that have shrunk to points.
        if allowed > 0.0 { allowed } else { f64::INFINITY }
    };
    let whole = surface.bounds();
    // What is nowhere is checked all the same.
    let least = places.iter().map(|place| allowed(&whole, place)).fold(f64::INFINITY, f64::min);
    let mesh = match places {
        [place] => surface.tessellate(&|bounds| allowed(bounds, place), MAX_TRIANGLES)?,
        _ => surface.tessellate(&|_| least, MAX_TRIANGLES)?,
    };
    Ok((mesh, least))
}

/// Where the prototypes are.
struct Copies {
    /// World from prototype, for each prototype that holds freeform surfaces.
    places: Vec<Vec<DAffine3>>,
}

/// More are refused when the scene is placed.
const MAX_COPIES: usize = 200_000_000;

impl Copies {
    fn of(desc: &SceneDesc, names: &NameIndex) -> Self {
        let count = desc.prototypes.len();
        // Of each prototype, its copies of others; names that stand for nothing are told later.
        let inner = |objects: &[ObjectDesc]| -> Vec<(usize, DAffine3)> {
            let mut inner = Vec::new();
            for object in objects {
                if let ShapeDesc::Instances { prototype, transforms } = &object.shape
                    && let Ok(index) = names.find(prototype, "prototype")
                {
                    let places = transforms.iter().map(|t| object.transform * *t);
                    inner.extend(places.map(|place| (index as usize, place)));
                }
            }
            inner
        };
        let of: Vec<_> = desc.prototypes.iter().map(|p| inner(&p.objects)).collect();
        // Whether a prototype holds freeform surfaces, itself or by what it copies.
        let is_freeform = |o: &ObjectDesc| matches!(o.shape, ShapeDesc::Freeform(_));
        let own: Vec<bool> =
            desc.prototypes.iter().map(|p| p.objects.iter().any(is_freeform)).collect();
        let mut holds = own.clone();
        for _ in 0..count {
            for i in 0..count {
                holds[i] |= of[i].iter().any(|(j, _)| holds[*j]);
            }
        }
        let mut places = vec![Vec::new(); count];
        let mut found = 0;
        // (prototype, world from it, depth).
        let mut pending: Vec<(usize, DAffine3, usize)> =
            inner(&desc.objects).into_iter().map(|(i, m)| (i, m, 1)).collect();
        while let Some((i, m, depth)) = pending.pop() {
            // Deeper than there are prototypes, one contains itself.
            if !holds[i] || depth > count || found >= MAX_COPIES {
                continue;
            }
            found += 1;
            if own[i] {
                places[i].push(m);
            }
            pending.extend(of[i].iter().map(|(j, inner)| (*j, m * *inner, depth + 1)));
        }
        Self { places }
    }
}

/// How much longer a matrix can make a vector: its largest singular value, the root of the largest
/// eigenvalue of MᵀM (Smith, *Eigenvalues of a symmetric 3 × 3 matrix*, 1961).
fn largest_scale(m: &DMat3) -> f64 {
    let a = m.transpose() * *m;
    let mean = (a.x_axis.x + a.y_axis.y + a.z_axis.z) / 3.0;
    let off = a - DMat3::from_diagonal(DVec3::splat(mean));
    let spread = off.to_cols_array().iter().map(|x| x * x).sum::<f64>();
    let p = (spread / 6.0).sqrt();
    if !(p > 1e-12 * mean) {
        return mean.sqrt();
    }
    let angle = (0.5 * (off * (1.0 / p)).determinant()).clamp(-1.0, 1.0).acos() / 3.0;
    (mean + 2.0 * p * angle.cos()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_the_largest() {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0);
        for scale in [DVec3::ONE, DVec3::new(3.0, -2.0, 0.5), DVec3::new(0.1, 0.1, 7.0)] {
            let m = turn * DMat3::from_diagonal(scale) * turn.transpose();
            assert!((largest_scale(&m) - scale.abs().max_element()).abs() < 1e-9);
        }
        // A shear: the golden ratio.
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Z);
        assert!((largest_scale(&shear) - 0.5 * (1.0 + 5f64.sqrt())).abs() < 1e-12);
    }

    #[test]
    fn pixels_grow_with_the_distance_of_what_is_nearest() {
        let pose = Pose::look_at(DVec3::new(0.0, 0.0, 10.0), DVec3::ZERO, DVec3::Y);
        let projection = Projection::Perspective { fov: 90f64.to_radians() };
        let pixels = Pixels { pose, projection, size: [300, 100] };
        let unit = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };
        assert!((pixels.at(&unit) - 9.0 * 2.0 / 100.0).abs() < 1e-12);
        assert!(pixels.at(&unit.translated(DVec3::Z * 10.0)) > 0.0);
        let parallel = Projection::Orthographic { height: 4.0 };
        assert_eq!(Pixels { projection: parallel, ..pixels }.at(&unit), 0.04);
    }
}
