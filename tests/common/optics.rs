//! Scenes for tests of optics: a camera of parallel rays, panes and screens whose colour tells where a
//! ray landed.

use alhazen::accel::AccelKind;
use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::film::{Film, Filter};
use alhazen::geometry::TriangleMesh;
use alhazen::material::{Dielectric, FresnelModel, Ior, Material};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{
    CameraDesc, Location, Maps, MaterialDesc, ObjectDesc, PlaceDesc, Scene, SceneDesc, ShapeDesc,
};
use alhazen::texture::{Gradient, Placement, Ramp, Texture};
use glam::DVec3;

/// A scene of `size` pixels seen by parallel rays from `eye` to `target`, `height` high; no light but
/// what surfaces are given, no pruning, one sample in the middle of each pixel.
pub fn parallel(size: u32, height: f64, eye: DVec3, target: DVec3) -> SceneDesc {
    let mut desc = SceneDesc::default();
    desc.image.size = [size, size];
    desc.settings.samples = 1;
    desc.settings.filter = Filter::Box;
    desc.settings.prune = 0.0;
    desc.ambient = Some(Rgb::BLACK);
    let up = if (target - eye).normalize().y.abs() > 0.9 { DVec3::NEG_Z } else { DVec3::Y };
    desc.camera = Some(CameraDesc {
        at: Location::default(),
        projection: Projection::Orthographic { height },
        place: Some(PlaceDesc::LookAt { eye, target, up }),
        lens: None,
    });
    desc
}

/// Glass that reflects nothing but by Fresnel's equations.
pub fn glass(ior: f64) -> Dielectric {
    Dielectric {
        ior: Ior::Constant(ior),
        absorption: Rgb::BLACK,
        priority: 0,
        fresnel: FresnelModel::Exact,
    }
}

pub fn add_material(desc: &mut SceneDesc, name: &str, material: Material) {
    desc.materials.push(MaterialDesc::new(name, material));
}

pub fn add_mesh(desc: &mut SceneDesc, mesh: TriangleMesh, material: &str) {
    desc.meshes.push(mesh);
    desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(desc.meshes.len() - 1), Some(material)));
}

pub fn add_sphere(desc: &mut SceneDesc, center: DVec3, radius: f64, material: &str) {
    desc.objects.push(ObjectDesc::new(ShapeDesc::Sphere { center, radius }, Some(material)));
}

/// A parallelogram; its front is the side from which its corners run anticlockwise.
pub fn quad(corner: DVec3, u: DVec3, v: DVec3) -> TriangleMesh {
    let corners = [corner, corner + u, corner + u + v, corner + v];
    let xyz = corners.iter().flat_map(|p| p.as_vec3().to_array()).collect();
    TriangleMesh::new(xyz, vec![[0, 1, 2], [0, 2, 3]])
}

/// A closed body between a polygon in the plane z = `near` and the same in z = `far` > `near`. The
/// polygon is convex and runs anticlockwise seen from +z.
pub fn extruded(outline: &[[f64; 2]], near: f64, far: f64) -> TriangleMesh {
    let n = outline.len() as u32;
    let ring = |z: f64| outline.iter().flat_map(move |[x, y]| [*x as f32, *y as f32, z as f32]);
    let xyz: Vec<f32> = ring(near).chain(ring(far)).collect();
    let caps = (1..n - 1).flat_map(|i| [[0, i + 1, i], [n, n + i, n + i + 1]]);
    let sides = (0..n).flat_map(|i| {
        let j = (i + 1) % n;
        [[i, j, n + j], [i, n + j, n + i]]
    });
    TriangleMesh::new(xyz, caps.chain(sides).collect())
}

/// A box.
pub fn block(min: DVec3, max: DVec3) -> TriangleMesh {
    let outline = [[min.x, min.y], [max.x, min.y], [max.x, max.y], [min.x, max.y]];
    extruded(&outline, min.z, max.z)
}

/// A screen that shows where a ray landed: its radiance is 0 at `from`, 1 at `from + axis`, linear
/// between. The scene's ambient light becomes 1.
pub fn add_ruler(desc: &mut SceneDesc, mesh: TriangleMesh, from: DVec3, axis: DVec3) {
    desc.ambient = Some(Rgb::splat(1.0));
    let mut placement = Placement::default();
    placement.texture_from_object.translation = -from;
    let ramp = Ramp::even(&[Rgb::BLACK, Rgb::splat(1.0)]).unwrap();
    let texture = Texture::Gradient(Gradient { axis, ramp, placement });
    let white = Material::Diffuse { reflectance: Rgb::splat(1.0) };
    desc.materials.push(MaterialDesc {
        maps: Maps { color: Some(texture), colors_ambient: true, ..Maps::default() },
        ..MaterialDesc::new("ruler", white)
    });
    add_mesh(desc, mesh, "ruler");
}

pub fn picture(desc: &SceneDesc) -> Film {
    picture_of_seed(desc, 0)
}

pub fn picture_of_seed(desc: &SceneDesc, seed: u64) -> Film {
    let scene = Scene::build_quietly(desc.clone(), AccelKind::default()).expect("a sound scene");
    let film = render(&scene, &RenderJob { seed, ..RenderJob::default() }, &()).film;
    assert!(film.mean.iter().all(|c| c.is_finite()));
    film
}

/// A scene of one pixel of vanishing size: what one ray sees.
pub fn one_ray(eye: DVec3, target: DVec3) -> SceneDesc {
    parallel(1, 1e-6, eye, target)
}

/// What the ray of a scene of one pixel sees.
pub fn seen(desc: &SceneDesc) -> Rgb {
    picture(desc).mean[0]
}

/// Mean of all pixels and channels.
pub fn mean(film: &Film) -> f64 {
    let sum: f64 = film.mean.iter().flat_map(|c| c.to_array()).map(f64::from).sum();
    sum / (3.0 * film.mean.len() as f64)
}

/// Fresnel's reflectance of unpolarised light, in f64, by the angles' sines and tangents: another form
/// than the program's.
pub fn fresnel(n_i: f64, n_t: f64, theta: f64) -> f64 {
    if theta == 0.0 {
        return ((n_i - n_t) / (n_i + n_t)).powi(2);
    }
    let beyond = theta.sin() * n_i / n_t;
    if beyond >= 1.0 {
        return 1.0;
    }
    let t = beyond.asin();
    let s = ((theta - t).sin() / (theta + t).sin()).powi(2);
    let p = ((theta - t).tan() / (theta + t).tan()).powi(2);
    0.5 * (s + p)
}
