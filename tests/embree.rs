//! The wrappers around Embree, through their public face: every kind of geometry, one ray and packets,
//! and what happens when something is wrong.
#![cfg(feature = "embree")]
#![allow(missing_docs, reason = "a test program")]

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use alhazen::embree::{
    BuildProgress, Coherence, Device, DeviceConfig, EmbreeError, ErrorCode, Geometry, INVALID_ID,
    PacketMask, Quality, Ray, RayHitPacket, RayPacket, Scene, SceneBuilder, SceneFlags, UserBounds,
    UserGeometry, UserHit,
};

mod common;
use common::Random;

fn device() -> Device {
    Device::new(&DeviceConfig::default()).unwrap()
}

fn builder(device: &Device) -> SceneBuilder {
    SceneBuilder::new(device, SceneFlags::ROBUST, Quality::Medium).unwrap()
}

fn scene(device: &Device, geometries: impl IntoIterator<Item = Geometry>) -> Scene {
    let mut builder = builder(device);
    for (expected, geometry) in (0..).zip(geometries) {
        assert_eq!(builder.attach(geometry), expected, "ids count from 0");
    }
    builder.commit().unwrap()
}

/// The square [0, 1]² at height z, in two triangles.
fn square(device: &Device, z: f32) -> Geometry {
    let xyz = vec![0.0, 0.0, z, 1.0, 0.0, z, 1.0, 1.0, z, 0.0, 1.0, z, 0.0];
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    Geometry::triangles(device, Arc::new(xyz), Arc::new(triangles), Quality::Medium).unwrap()
}

fn down(x: f32, y: f32, z: f32) -> Ray {
    Ray::new([x, y, z], [0.0, 0.0, -1.0])
}

/// Boxes [i, i + 1] × [0, 1]² that are hit on their faces of constant z; counts its calls.
struct Slabs {
    calls: AtomicUsize,
    count: u32,
}

impl Slabs {
    fn geometry(device: &Device, count: u32) -> (Geometry, Arc<Self>) {
        let shapes = Arc::new(Self { calls: AtomicUsize::new(0), count });
        let bounds = (0..count)
            .map(|i| UserBounds { lower: [i as f32, 0.0, 0.0], upper: [i as f32 + 1.0, 1.0, 1.0] });
        let geometry = Geometry::user(device, bounds.collect(), Arc::clone(&shapes)).unwrap();
        (geometry, shapes)
    }
}

impl UserGeometry for Slabs {
    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<UserHit> {
        assert!(primitive < self.count);
        self.calls.fetch_add(1, Ordering::Relaxed);
        [1.0, 0.0].into_iter().find_map(|z| {
            let t = (z - ray.origin[2]) / ray.direction[2];
            let [x, y] = [0, 1].map(|i| ray.origin[i] + t * ray.direction[i]);
            let inside =
                (primitive as f32..primitive as f32 + 1.0).contains(&x) && (0.0..1.0).contains(&y);
            (inside && t > ray.t_min && t <= ray.t_max).then_some(UserHit {
                t,
                u: x - primitive as f32,
                v: y,
            })
        })
    }
}

#[test]
fn triangles_report_who_was_hit_and_where() {
    let device = device();
    let scene = scene(&device, [square(&device, 0.0), square(&device, 0.5)]);
    let hit = scene.intersect(&down(0.75, 0.25, 2.0)).unwrap();
    assert!((hit.t - 1.5).abs() < 1e-6);
    assert_eq!((hit.geometry, hit.primitive), (1, 0));
    assert_eq!((hit.instance, hit.instance_primitive), (INVALID_ID, INVALID_ID));
    // (0.75, 0.25) = 0.25 (0,0) + 0.5 (1,0) + 0.25 (1,1)
    assert!((hit.u - 0.5).abs() < 1e-6 && (hit.v - 0.25).abs() < 1e-6, "{hit:?}");
    assert!(hit.ng[2] > 0.0 && hit.ng[0] == 0.0);
    assert!(scene.occluded(&down(0.75, 0.25, 2.0)));
    assert!(scene.intersect(&down(1.75, 0.25, 2.0)).is_none());
    assert!(!scene.occluded(&down(1.75, 0.25, 2.0)));
    let short = Ray { t_max: 1.4, ..down(0.75, 0.25, 2.0) };
    assert!(scene.intersect(&short).is_none() && !scene.occluded(&short));
    let late = Ray { t_min: 1.6, ..down(0.75, 0.25, 2.0) };
    assert_eq!(scene.intersect(&late).unwrap().geometry, 0);
    let bounds = scene.bounds();
    assert_eq!((bounds.lower, bounds.upper), ([0.0; 3], [1.0, 1.0, 0.5]));
}

#[test]
fn a_negative_t_max_is_not_taken_for_occluded() {
    let device = device();
    let scene = scene(&device, [square(&device, 0.0)]);
    let ray = Ray { t_max: -1.0, ..down(0.5, 0.25, 2.0) };
    assert!(!scene.occluded(&ray));
    let nan = Ray { t_max: f32::NAN, ..down(0.5, 0.25, 2.0) };
    assert!(!scene.occluded(&nan) && scene.intersect(&nan).is_none());
}

#[test]
fn buffers_of_the_wrong_size_are_refused() {
    let device = device();
    let unpadded = Arc::new(vec![0.0; 9]);
    let error = Geometry::triangles(&device, unpadded, Arc::new(vec![[0, 1, 2]]), Quality::Medium);
    let error = error.unwrap_err();
    assert!(matches!(error, EmbreeError::Size { what: "vertex buffer", got: 9, .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "vertex buffer: expected 3 floats a vertex and 1 of padding, got 9"
    );
}

#[test]
fn bad_indices_and_vertices_are_left_out_and_nothing_else() {
    let device = device();
    let mut xyz = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    xyz.extend([f32::NAN, 0.0, 0.0, 0.0]);
    let triangles = vec![[0, 1, 77], [0, 1, 3], [0, 1, 2]];
    let mesh =
        Geometry::triangles(&device, Arc::new(xyz), Arc::new(triangles), Quality::Medium).unwrap();
    let scene = scene(&device, [mesh]);
    assert_eq!(scene.intersect(&down(0.2, 0.2, 1.0)).unwrap().primitive, 2);
}

#[test]
fn an_empty_scene_is_never_hit() {
    let device = device();
    let empty =
        Geometry::triangles(&device, Arc::new(vec![0.0]), Arc::new(Vec::new()), Quality::Medium);
    let scene = scene(&device, [empty.unwrap()]);
    assert!(scene.intersect(&down(0.0, 0.0, 1.0)).is_none());
    assert!(scene.bounds().lower[0] > scene.bounds().upper[0]);
}

#[test]
fn user_shapes_answer_single_rays() {
    let device = device();
    let (slabs, shapes) = Slabs::geometry(&device, 40);
    let scene = scene(&device, [square(&device, -1.0), slabs]);
    let hit = scene.intersect(&down(17.25, 0.5, 3.0)).unwrap();
    assert_eq!((hit.t, hit.u, hit.v), (2.0, 0.25, 0.5));
    assert_eq!((hit.geometry, hit.primitive, hit.instance), (1, 17, INVALID_ID));
    assert!(scene.occluded(&down(17.25, 0.5, 3.0)));
    assert!(!scene.occluded(&Ray { t_max: 1.5, ..down(17.25, 0.5, 3.0) }));
    assert!(shapes.calls.load(Ordering::Relaxed) > 0);
}

/// Meshes, user shapes, single and arrayed instances in one scene.
fn varied_scene(device: &Device) -> Scene {
    let (slabs, _) = Slabs::geometry(device, 8);
    let prototype = scene(device, [Slabs::geometry(device, 4).0, square(device, 0.25)]);
    let moved = |x: f32, z: f32| [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 1.0, z];
    let rows = Arc::new((0..5).map(|i| moved(4.0 * i as f32, 0.5 * i as f32)).collect::<Vec<_>>());
    let geometries = [
        square(device, -1.0),
        slabs,
        Geometry::instance(device, &prototype, &moved(20.0, 1.0)).unwrap(),
        Geometry::instance_array(device, &prototype, rows).unwrap(),
    ];
    scene(device, geometries)
}

fn compare_packets<const N: usize>(scene: &Scene, random: &mut Random) {
    for i in 0..400 {
        let x = random.between(-1.0, 26.0) as f32;
        let rays: [Ray; N] = std::array::from_fn(|_| Ray {
            origin: [x + 0.5 * random.unit() as f32, random.between(-0.5, 3.5) as f32, 9.0],
            direction: [0.1 * random.unit() as f32, 0.05 * random.unit() as f32, -1.0],
            t_min: 0.0,
            // Between the surfaces, of which all are at multiples of a quarter: whether a ray that ends on one meets
            // it, packets and single rays need not agree.
            t_max: if random.unit() < 0.1 { 7.4 } else { f32::INFINITY },
        });
        let bits = random.bits() as u32 & ((1 << N) - 1);
        let mut packet = RayPacket::<N>::empty();
        for (i, ray) in rays.iter().enumerate() {
            [packet.org_x[i], packet.org_y[i], packet.org_z[i]] = ray.origin;
            [packet.dir_x[i], packet.dir_y[i], packet.dir_z[i]] = ray.direction;
            (packet.t_min[i], packet.t_max[i]) = (ray.t_min, ray.t_max);
        }
        let mask = PacketMask::from_bits(bits);
        let mut both = RayHitPacket::new(packet);
        let coherence = [Coherence::Coherent, Coherence::Incoherent][i % 2];
        scene.intersect_packet(&mask, &mut both, coherence);
        scene.occluded_packet(&mask, &mut packet, coherence);
        for (i, ray) in rays.iter().enumerate() {
            if bits >> i & 1 == 0 {
                assert_eq!(both.hit.geometry[i], INVALID_ID, "a masked lane was touched");
                assert!(!packet.is_occluded(i));
                continue;
            }
            let alone = scene.intersect(ray);
            assert_eq!(packet.is_occluded(i), alone.is_some());
            match alone {
                None => assert_eq!(both.hit.geometry[i], INVALID_ID),
                Some(hit) => {
                    let in_packet = (
                        both.hit.geometry[i],
                        both.hit.primitive[i],
                        both.hit.instance[i],
                        both.hit.instance_primitive[i],
                    );
                    let expected =
                        (hit.geometry, hit.primitive, hit.instance, hit.instance_primitive);
                    assert_eq!(in_packet, expected, "{ray:?}");
                    assert!((both.ray.t_max[i] - hit.t).abs() < 1e-4);
                    assert!((both.hit.u[i] - hit.u).abs() < 1e-3, "{ray:?}");
                }
            }
        }
    }
}

#[test]
fn packets_of_every_width_agree_with_single_rays() {
    let device = device();
    let scene = varied_scene(&device);
    let mut random = Random(11);
    compare_packets::<4>(&scene, &mut random);
    compare_packets::<8>(&scene, &mut random);
    compare_packets::<16>(&scene, &mut random);
}

#[test]
fn instances_say_which_copy_was_hit() {
    let device = device();
    let scene = varied_scene(&device);
    // Array element 3 stands at x = 12, y = 2, z = 1.5; its slab 2 spans x 14..15.
    let hit = scene.intersect(&down(14.5, 2.5, 9.0)).unwrap();
    assert_eq!((hit.geometry, hit.primitive), (0, 2));
    assert_eq!((hit.instance, hit.instance_primitive), (3, 3));
    assert!((hit.t - 6.5).abs() < 1e-6, "{hit:?}");
    let single = scene.intersect(&down(22.5, 2.5, 9.0)).unwrap();
    assert_eq!((single.instance, single.instance_primitive), (2, 0));
}

#[test]
fn handles_may_be_dropped_in_any_order() {
    let device = device();
    let (prototype, xyz) = {
        let xyz = Arc::new(vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        let mesh =
            Geometry::triangles(&device, Arc::clone(&xyz), Arc::new(vec![[0, 1, 2]]), Quality::Low);
        (scene(&device, [mesh.unwrap()]), xyz)
    };
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let unused = Geometry::instance(&device, &prototype, &identity).unwrap();
    let instance = Geometry::instance(&device, &prototype, &identity).unwrap();
    let world = scene(&device, [instance]);
    assert!(Arc::strong_count(&xyz) > 1, "Embree's share is counted");
    drop(prototype);
    drop(device);
    let copy = world.clone();
    drop(world);
    assert!(copy.intersect(&down(0.2, 0.2, 1.0)).is_some());
    drop(copy);
    drop(unused);
    assert_eq!(Arc::strong_count(&xyz), 1, "nothing is kept once nothing uses it");
}

#[test]
fn a_build_reports_progress_and_can_be_cancelled() {
    let device = device();
    let mut random = Random(3);
    let triangles = 300_000u32;
    let mut xyz: Vec<f32> = (0..9 * triangles).map(|_| random.unit() as f32).collect();
    xyz.push(0.0);
    let indices: Vec<[u32; 3]> = (0..triangles).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let (xyz, indices) = (Arc::new(xyz), Arc::new(indices));
    let mesh = || {
        Geometry::triangles(&device, Arc::clone(&xyz), Arc::clone(&indices), Quality::Medium)
            .unwrap()
    };

    let mut full = builder(&device);
    full.attach(mesh());
    let progress = BuildProgress::default();
    full.commit_with(&progress).unwrap();
    assert!((0.9..=1.0).contains(&progress.done()), "{}", progress.done());

    let mut cancelled = builder(&device);
    cancelled.attach(mesh());
    let progress = BuildProgress::default();
    progress.stop();
    assert_eq!(cancelled.commit_with(&progress).unwrap_err(), EmbreeError::Cancelled);
    // The device goes on working.
    assert!(scene(&device, [square(&device, 0.0)]).intersect(&down(0.5, 0.2, 1.0)).is_some());
}

#[test]
fn memory_is_counted_and_limited() {
    let device = device();
    let before = device.memory().current;
    let scene = scene(&device, [square(&device, 0.0)]);
    assert!(device.memory().current > before && device.memory().peak >= device.memory().current);
    drop(scene);

    let small = DeviceConfig { memory_limit: Some(1 << 20), ..DeviceConfig::default() };
    let device = Device::new(&small).unwrap();
    let mut random = Random(5);
    let mut xyz: Vec<f32> = (0..900_000).map(|_| random.unit() as f32).collect();
    xyz.push(0.0);
    let indices = (0..100_000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh =
        Geometry::triangles(&device, Arc::new(xyz), Arc::new(indices), Quality::Medium).unwrap();
    let mut builder = builder(&device);
    builder.attach(mesh);
    match builder.commit() {
        Err(EmbreeError::Native { code: ErrorCode::OUT_OF_MEMORY, .. }) => {}
        other => panic!("not refused: {other:?}"),
    }
}

#[test]
#[should_panic(expected = "different Embree devices")]
fn a_geometry_of_another_device_is_refused() {
    let (one, other) = (device(), device());
    builder(&one).attach(square(&other, 0.0));
}

#[test]
fn an_instance_of_another_devices_scene_is_refused() {
    let (one, other) = (device(), device());
    let prototype = scene(&other, [square(&other, 0.0)]);
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let error = Geometry::instance(&one, &prototype, &identity).unwrap_err();
    assert_eq!(error, EmbreeError::ForeignDevice);
}

#[test]
fn a_scene_with_instances_is_not_instanced() {
    let device = device();
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let error = Geometry::instance(&device, &varied_scene(&device), &identity).unwrap_err();
    assert_eq!(error, EmbreeError::NestedInstances);
}

#[test]
fn a_scene_is_traced_from_many_threads() {
    let device = device();
    let scene = varied_scene(&device);
    let expected: Vec<_> =
        (0..1000).map(|i| scene.intersect(&down(0.025 * i as f32, 2.5, 9.0))).collect();
    std::thread::scope(|threads| {
        for _ in 0..8 {
            threads.spawn(|| {
                for (i, expected) in expected.iter().enumerate() {
                    assert_eq!(scene.intersect(&down(0.025 * i as f32, 2.5, 9.0)), *expected);
                }
            });
        }
    });
}

/// Embree's own spheres against the closed form, for what they are measured beside.
#[test]
fn sphere_points_are_spheres() {
    let device = device();
    let mut random = Random(8);
    let spheres: Vec<[f32; 4]> = (0..200)
        .map(|_| {
            let c = random.in_cube() * 4.0;
            c.extend(random.between(0.1, 0.5)).as_vec4().to_array()
        })
        .collect();
    let geometry = Geometry::sphere_points(&device, Arc::new(spheres.clone())).unwrap();
    let scene = scene(&device, [geometry]);
    let (mut hits, mut apart) = (0, 0);
    for _ in 0..5000 {
        let (o, d) = (random.in_cube() * 6.0, random.direction());
        let ray = Ray::new(o.as_vec3().to_array(), d.as_vec3().to_array());
        let expected = spheres
            .iter()
            .filter_map(|&[x, y, z, r]| {
                let l = glam::DVec3::new(x.into(), y.into(), z.into()) - o;
                let (b, r) = (l.dot(d), f64::from(r));
                let disc = r * r - (l - d * b).length_squared();
                // Neither grazing nor from close by: that is f32's.
                let root = disc.max(0.0).sqrt();
                [b - root, b + root].into_iter().find(|t| disc > 0.0 && *t > 0.0)
            })
            .fold(f64::INFINITY, f64::min);
        match scene.intersect(&ray) {
            Some(hit) if (f64::from(hit.t) - expected).abs() < 1e-3 => hits += 1,
            None if expected.is_infinite() => {}
            _ => apart += 1,
        }
    }
    // A ray that grazes one may fall either way.
    assert!(hits > 800 && apart <= 2, "{hits} as they should be, {apart} not");
}
