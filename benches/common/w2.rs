//! A field of spheres: 2,000 of them, a third each of mirror, glass and diffuse, over a checkered floor,
//! under two point lights; and the same for other renderers.

use alhazen::accel::AccelKind;
use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::film::Filter;
use alhazen::geometry::TriangleMesh;
use alhazen::light::Falloff;
use alhazen::material::{Dielectric, FresnelModel, Ior, Material};
use alhazen::scene::{
    CameraDesc, LightDesc, Location, MaterialDesc, ObjectDesc, PlaceDesc, Scene, SceneDesc,
    ShapeDesc,
};
use glam::DVec3;

pub const EYE: [f64; 3] = [0.0, -9.5, 4.2];
pub const TARGET: [f64; 3] = [0.0, -0.6, 0.7];
pub const FOV: f64 = 42.0;
/// Position and intensity.
pub const LIGHTS: [([f64; 3], [f64; 3]); 2] =
    [([-6.0, -6.0, 9.0], [220.0, 220.0, 220.0]), ([7.0, -4.0, 7.0], [110.0, 100.0, 80.0])];
pub const TILES: [f64; 2] = [0.75, 0.12];
/// The floor reaches this far to each side.
pub const HALF: i32 = 20;
pub const COLORS: [[f64; 3]; 4] =
    [[0.7, 0.2, 0.15], [0.2, 0.6, 0.25], [0.2, 0.3, 0.7], [0.7, 0.6, 0.2]];

pub struct Ball {
    pub center: [f64; 3],
    pub radius: f64,
    /// 0 is a mirror, 1 glass, from 2 on [`COLORS`].
    pub kind: usize,
}

/// PCG64 (O'Neill 2014, XSL-RR 128/64), in the state of NumPy's `default_rng(7)`: the workload was
/// defined there.
struct Pcg64 {
    state: u128,
    increment: u128,
}

impl Pcg64 {
    fn unit(&mut self) -> f64 {
        const MULTIPLIER: u128 = 0x2360_ed05_1fc6_5da4_4385_df64_9fcc_f645;
        self.state = self.state.wrapping_mul(MULTIPLIER).wrapping_add(self.increment);
        let folded = (self.state >> 64) as u64 ^ self.state as u64;
        let bits = folded.rotate_right((self.state >> 122) as u32);
        (bits >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Balls thrown at random that do not overlap.
pub fn balls() -> Vec<Ball> {
    const COUNT: usize = 2000;
    let mut random = Pcg64 {
        state: 208_745_520_555_909_116_978_795_849_195_383_758_904,
        increment: 261_136_684_632_268_670_825_940_853_076_396_136_793,
    };
    let mut found: Vec<(DVec3, f64)> = Vec::with_capacity(COUNT);
    while found.len() < COUNT {
        let radius = random.between(0.07, 0.2);
        let (x, y) = (random.between(-5.5, 5.5), random.between(-5.5, 5.5));
        let z = if random.unit() < 0.35 { radius } else { random.between(radius, 2.2) };
        let p = DVec3::new(x, y, z);
        // Cells of ½, as the original looks no further than the next.
        let is_near = |q: DVec3| ((p / 0.5).floor() - (q / 0.5).floor()).abs().max_element() <= 1.0;
        let touches = |(q, r): &(DVec3, f64)| is_near(*q) && (p - *q).length() < r + radius + 0.01;
        if !found.iter().any(touches) {
            found.push((p, radius));
        }
    }
    let kind = |i: usize, u: f64| match u {
        u if u < 1.0 / 3.0 => 0,
        u if u < 2.0 / 3.0 => 1,
        _ => 2 + i % 4,
    };
    let balls = found.into_iter().enumerate().map(|(i, (p, radius))| Ball {
        center: p.as_vec3().as_dvec3().to_array(),
        radius: f64::from(radius as f32),
        kind: kind(i, random.unit()),
    });
    balls.collect()
}

/// The scene, at 4 samples a pixel and 8 bounces, with the default accelerator.
pub fn scene(change: impl FnOnce(&mut SceneDesc)) -> Scene {
    scene_in(AccelKind::default(), change)
}

/// With one of the caller's choice.
pub fn scene_in(kind: AccelKind, change: impl FnOnce(&mut SceneDesc)) -> Scene {
    let mut desc = SceneDesc::default();
    desc.image.size = super::SIZE;
    desc.settings.samples = 4;
    desc.settings.filter = Filter::Box;
    desc.camera = Some(CameraDesc {
        at: Location::default(),
        projection: Projection::Perspective { fov: FOV.to_radians() },
        place: Some(PlaceDesc::LookAt { eye: EYE.into(), target: TARGET.into(), up: DVec3::Z }),
        lens: None,
    });
    desc.ambient = Some(Rgb::BLACK);
    for (position, intensity) in LIGHTS {
        let (position, intensity) = (position.into(), rgb(intensity));
        let falloff = Falloff::InverseSquare;
        desc.lights.push(LightDesc::Point { position, intensity, falloff });
    }
    let glass = Dielectric {
        ior: Ior::Constant(1.5),
        absorption: Rgb::BLACK,
        priority: 0,
        fresnel: FresnelModel::Exact,
    };
    let mirror = Material::Mirror { reflectance: Rgb::splat(1.0), fresnel: None };
    let diffuse = |color| Material::Diffuse { reflectance: rgb(color) };
    let kinds = [mirror, Material::Dielectric(glass)].into_iter().chain(COLORS.map(diffuse));
    for (i, material) in kinds.enumerate() {
        desc.materials.push(MaterialDesc::new(format!("kind{i}"), material));
    }
    for (i, grey) in TILES.into_iter().enumerate() {
        desc.materials.push(MaterialDesc::new(format!("tile{i}"), diffuse([grey; 3])));
        desc.meshes.push(tiles(i as i32));
        desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(i), Some(&format!("tile{i}"))));
    }
    for ball in balls() {
        let shape = ShapeDesc::Sphere { center: ball.center.into(), radius: ball.radius };
        desc.objects.push(ObjectDesc::new(shape, Some(&format!("kind{}", ball.kind))));
    }
    change(&mut desc);
    Scene::build_quietly(desc, kind).expect("a sound scene")
}

/// Every other tile of the floor.
fn tiles(parity: i32) -> TriangleMesh {
    let cells = (-HALF..HALF).flat_map(|i| (-HALF..HALF).map(move |j| (i, j)));
    let corners = cells
        .filter(|(i, j)| (i + j) & 1 == parity)
        .flat_map(|(i, j)| [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]);
    let xyz: Vec<f32> = corners.flat_map(|(x, y)| [x as f32, y as f32, 0.0]).collect();
    let triangles = (0..xyz.len() as u32 / 12).map(|q| 4 * q);
    let triangles = triangles.flat_map(|a| [[a, a + 1, a + 2], [a, a + 2, a + 3]]);
    TriangleMesh::new(xyz, triangles.collect())
}

fn rgb(color: [f64; 3]) -> Rgb {
    Rgb::from(color.map(|c| c as f32))
}
