//! `[image]`, `[camera]` and `[cameras.NAME]`.

use glam::{DMat4, DVec3};

use crate::camera::Projection;
use crate::io::document::{Node, Value};
use crate::io::fields::{Fields, Reader};
use crate::io::transforms::transform;
use crate::scene::{CameraDesc, ImageDesc, LensDesc, PlaceDesc};

/// Most pixels on a side.
const MAX_SIDE: u32 = 65_535;

pub(super) fn image(fields: Fields<'_, '_>) -> ImageDesc {
    let mut image = ImageDesc::default();
    if let Some(node) = fields.get("size") {
        match &node.value {
            Value::Array(sides) => match sides.as_slice() {
                [Node { value: Value::Integer(w), .. }, Node { value: Value::Integer(h), .. }]
                    if [w, h].iter().all(|x| (1..=i64::from(MAX_SIDE)).contains(x)) =>
                {
                    image.size = [*w as u32, *h as u32];
                }
                _ => fields.expected(node, "size", &size_expected()),
            },
            _ => fields.expected(node, "size", &size_expected()),
        }
    }
    image.background = fields.color("background");
    fields.finish();
    image
}

fn size_expected() -> String {
    format!("[width, height] in pixels, whole numbers from 1 to {MAX_SIDE}")
}

pub(super) fn camera(reader: &Reader<'_>, fields: Fields<'_, '_>) -> CameraDesc {
    let at = fields.location();
    let kinds = [("perspective", false), ("orthographic", true)];
    let is_parallel = fields.choice("projection", &kinds).unwrap_or(false);
    let projection = if is_parallel {
        let node = fields.get("height");
        if node.is_none() && (fields.has("eye") || fields.has("transform")) {
            reader.mistake(fields.span(), "an orthographic camera that is placed needs a `height`");
        }
        let height = node.and_then(|node| fields.positive(node, "height"));
        // 0: as high as the scene, with the place.
        Projection::Orthographic { height: height.unwrap_or(0.0) }
    } else {
        let mut fov = 40.0;
        if let Some(node) = fields.get("fov")
            && let Some(degrees) = reader.number(node, "fov")
        {
            if degrees > 0.0 && degrees < 180.0 {
                fov = degrees;
            } else {
                reader.expected(node, "fov", "an angle between 0 and 180 degrees");
            }
        }
        Projection::Perspective { fov: fov.to_radians() }
    };
    let place = match fields.get("transform") {
        Some(node) => {
            let matrix =
                transform(reader, node, "transform").map(|m| PlaceDesc::Matrix(DMat4::from(m)));
            for name in ["eye", "target", "up"] {
                if let Some(node) = fields.get(name) {
                    let message = format!("`{name}` and `transform` exclude each other");
                    reader.mistake(node.span, message);
                }
            }
            matrix
        }
        None => {
            let (eye, target) = (fields.vector("eye"), fields.vector("target"));
            let up = fields.vector("up").unwrap_or(DVec3::Y);
            match (eye, target) {
                (Some(eye), target) => {
                    // Straight ahead where only the place is given.
                    let target = target.unwrap_or(eye - DVec3::Z * (1.0 + eye.length()));
                    Some(PlaceDesc::LookAt { eye, target, up })
                }
                (None, None) if !fields.has("up") => None,
                (None, _) if fields.has("eye") => None,
                (None, _) => {
                    reader
                        .mistake(fields.span(), "a camera with a `target` or `up` needs an `eye`");
                    None
                }
            }
        }
    };
    let lens = lens(&fields);
    fields.finish();
    CameraDesc { at, projection, place, lens }
}

/// A lens of radius 0 is a pinhole.
fn lens(fields: &Fields<'_, '_>) -> Option<LensDesc> {
    let radius =
        fields.get("lens_radius").and_then(|node| fields.not_negative(node, "lens_radius"));
    let focus = fields.get("focus_distance");
    let focus_distance = focus.and_then(|node| fields.positive(node, "focus_distance"));
    let radius = radius.filter(|radius| *radius > 0.0)?;
    Some(LensDesc { radius, focus_distance })
}
