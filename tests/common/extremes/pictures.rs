//! Whole pictures of a scene of any size, anywhere.

use std::sync::Arc;

use alhazen::color::Rgb;
use alhazen::geometry::grid::Grid;
use alhazen::light::Falloff;
use alhazen::material::Material;
use alhazen::math::Bounds;
use alhazen::medium::volume::{TransferFunction, TransferNode};
use alhazen::medium::{Fog, FogProfile};
use alhazen::render::{RenderJob, render};
use alhazen::scene::{
    CameraDesc, LensDesc, LightDesc, Location, MaterialDesc, ObjectDesc, PrototypeDesc, Reference,
    SceneDesc, ShapeDesc, VolumeDesc,
};
use glam::{DAffine3, DVec3};

use super::{Cell, Rung, Table, add_mesh, ball, empty, look, power, row, sphere};

/// Something of each kind, lit and shadowed, `scale` times as large and moved by `offset`.
fn still_life(scale: f64, offset: DVec3) -> SceneDesc {
    let at = |x: f64, y: f64, z: f64| offset + DVec3::new(x, y, z) * scale;
    let mut desc = empty();
    desc.image.size = [48, 32];
    desc.settings.samples = 4;
    let mut mesh = ball(24, DVec3::ZERO, 0.6 * scale);
    mesh.origin = at(-0.8, 0.6, 0.0);
    add_mesh(&mut desc, mesh);
    desc.materials.push(MaterialDesc::new(
        "mirror",
        Material::Mirror { reflectance: Rgb::splat(0.9), fresnel: None },
    ));
    desc.objects.push(ObjectDesc {
        material: Some(Reference::new("mirror")),
        ..sphere(at(0.7, 0.5, 0.2), 0.5 * scale)
    });
    let floor = ShapeDesc::Disk {
        center: at(0.0, 0.0, 0.0),
        normal: DVec3::Y,
        radius: 4.0 * scale,
        inner_radius: 0.0,
    };
    desc.objects.push(ObjectDesc::new(floor, Some("grey")));
    // Copies, one of them turned.
    let ball = ObjectDesc::new(
        ShapeDesc::Box(Bounds { min: DVec3::splat(-0.2 * scale), max: DVec3::splat(0.2 * scale) }),
        Some("grey"),
    );
    let objects =
        vec![ObjectDesc { transform: DAffine3::from_translation(at(0.0, 0.25, 0.0)), ..ball }];
    let name = "boxes".to_owned();
    desc.prototypes.push(PrototypeDesc { name, at: Location::default(), objects });
    let moved = |x: f64, z: f64| DAffine3::from_translation(DVec3::new(x, 0.0, z) * scale);
    let turned = DAffine3::from_translation(offset)
        * moved(-1.3, 1.2)
        * DAffine3::from_rotation_y(0.6)
        * DAffine3::from_translation(-offset);
    let transforms = vec![moved(0.1, 1.2), turned];
    let copies = ShapeDesc::Instances { prototype: Reference::new("boxes"), transforms };
    desc.objects.push(ObjectDesc::new(copies, None));
    let camera = look(at(0.3, 1.6, 4.0), at(0.0, 0.5, 0.0), 0.7);
    let lens = Some(LensDesc { radius: 0.02 * scale, focus_distance: None });
    desc.camera = Some(CameraDesc { lens, ..camera });
    desc.fog = Some(Fog {
        scattering: Rgb::splat((0.05 / scale) as f32),
        absorption: Rgb::BLACK,
        radiance: Rgb::splat(0.3),
        profile: FogProfile::Height { base: offset.y + 0.3 * scale, height: scale },
        dims_lights: true,
    });

    // A cloud, denser to one side.
    let value = |i: usize, j: usize, _| i as f32 / 4.0 + j as f32 / 8.0;
    let node = |value: f64, extinction: f64| TransferNode {
        value,
        color: [0.4; 3],
        extinction: extinction / scale,
    };
    let transfer = TransferFunction::new(vec![node(0.0, 0.0), node(1.0, 4.0)]).unwrap();
    desc.volumes.push(VolumeDesc {
        at: Location::default(),
        grid: Arc::new(Grid::from_fn([4; 3], value).unwrap()),
        bounds: Bounds { min: DVec3::ZERO, max: DVec3::splat(0.6 * scale) },
        transform: DAffine3::from_translation(at(0.5, 0.0, 1.2)),
        transfer: Arc::new(transfer),
        tolerance: 1e-3,
    });

    let intensity = Rgb::splat((40.0 * scale * scale) as f32);
    let radiance = Rgb::splat(20.0);
    desc.lights.push(LightDesc::Point {
        position: at(2.0, 4.0, 3.0),
        intensity,
        falloff: Falloff::InverseSquare,
    });
    desc.lights.push(LightDesc::Spot {
        position: at(-3.0, 4.0, 2.0),
        direction: DVec3::new(2.5, -3.8, -1.5),
        intensity,
        cone_angle: 0.5,
        penumbra_angle: 0.2,
    });
    desc.lights.push(LightDesc::Rectangle {
        corner: at(-2.0, 3.0, -1.0),
        edge_u: DVec3::X * 0.5 * scale,
        edge_v: DVec3::Z * 0.5 * scale,
        radiance,
    });
    desc.lights.push(LightDesc::Disk {
        center: at(2.0, 3.0, -1.0),
        normal: DVec3::NEG_Y,
        radius: 0.3 * scale,
        radiance,
    });
    let center = at(0.0, 4.0, 2.0);
    desc.lights.push(LightDesc::Sphere { center, radius: 0.3 * scale, radiance });
    desc
}

pub(super) fn moved_pictures() -> Table {
    let picture = |rung: Rung, scale: f64, offset: f64| {
        let offset = DVec3::new(offset, -2.0 * offset, 3.0 * offset);
        let scene = rung.scene(still_life(scale, offset));
        render(&scene, &RenderJob::default(), &()).film.mean
    };
    let cases = [
        (1e-6, 0.0),
        (1e-3, 0.0),
        (1e3, 0.0),
        (1e6, 0.0),
        (1.0, 1.0),
        (1.0, 10.0),
        (1.0, 30.0),
        (1.0, 1e2),
        (1.0, 1e4),
        (1.0, 1e6),
        (1.0, 1e8),
    ];
    let rows = cases.map(|(scale, offset)| {
        row(format!("scale {}, offset {}", power(scale), power(offset)), |rung| {
            let (a, b) = (picture(rung, scale, offset), picture(rung, 1.0, 0.0));
            let squares = a.iter().zip(&b).flat_map(|(a, b)| {
                let pairs = a.to_array().into_iter().zip(b.to_array());
                pairs.map(|(a, b)| (f64::from(a), f64::from(b)))
            });
            let sum: f64 = squares.map(|(a, b)| (a - b).powi(2) / (b * b + 0.01)).sum();
            let relmse = sum / (3 * b.len()) as f64;
            let is_lit = b.iter().any(|c| c.g > 0.1);
            Cell::new(format!("{relmse:.0e}"), !(relmse <= 1e-6) || !is_lit)
        })
    });
    Table {
        title: "Scenes of any size, anywhere",
        what: "A mesh, a mirror ball, copies of a box, a floor, a lamp of each kind, shadows, a lens, fog and a cloud, made larger and \
               moved as a whole: relMSE against the picture at the origin, with the same seed. Red: above 10⁻⁶.",
        columns: Rung::columns(),
        rows: rows.into(),
    }
}
