//! Transforms: as a list of steps in a scene file, and as a CSV of twelve numbers a row (3 × 4,
//! row-major), one transform each.

use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};

use super::document::{Node, Value};
use super::error::ReadError;
use super::fields::Reader;

/// Reads a `.csv` of transforms. Blank lines and lines that start with `#` are skipped.
///
/// # Errors
/// If the file cannot be read, or a line does not hold twelve finite numbers.
pub(super) fn read_transforms(path: &Path) -> Result<Vec<DAffine3>, ReadError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    if extension != "csv" {
        return Err(ReadError::file(path, "transforms are read from .csv files"));
    }
    let bytes = std::fs::read(path).map_err(|e| ReadError::io(path, "read", e))?;
    let mut transforms = Vec::new();
    for (number, line) in (1..).zip(bytes.split(|&b| b == b'\n')) {
        let line = String::from_utf8_lossy(line);
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let mut m = [0.0; 12];
        let mut count = 0;
        for word in line.split(',').map(str::trim) {
            let value = word.parse::<f64>().ok().filter(|x| x.is_finite());
            let Some(value) = value else {
                let message = format!("`{word}` is no finite number");
                return Err(ReadError::line(path, number, message));
            };
            if count < 12 {
                m[count] = value;
            }
            count += 1;
        }
        if count != 12 {
            let message = format!("expected 12 numbers (3 rows of 4), found {count}");
            return Err(ReadError::line(path, number, message));
        }
        transforms.push(affine(&m));
    }
    Ok(transforms)
}

/// A list of steps, applied in the order written.
pub(super) fn transform(reader: &Reader<'_>, node: &Node, name: &str) -> Option<DAffine3> {
    let Value::Array(steps) = &node.value else {
        reader.expected(
            node,
            name,
            "a list of steps: { scale = … }, { rotate = … }, { translate = … }, { matrix = … }",
        );
        return None;
    };
    let mut total = DAffine3::IDENTITY;
    for step in steps {
        total = transform_step(reader, step)? * total;
    }
    Some(total)
}

fn transform_step(reader: &Reader<'_>, step: &Node) -> Option<DAffine3> {
    let Value::Table(entries) = &step.value else {
        reader.expected(step, "transform", "a list of tables such as { scale = 2.0 }");
        return None;
    };
    let [entry] = entries.as_slice() else {
        reader.mistake(
            step.span,
            "a step of a transform has one field: scale, rotate, translate or matrix",
        );
        return None;
    };
    let node = &entry.node;
    match entry.key.as_str() {
        "scale" => {
            let scale = match &node.value {
                Value::Array(_) => DVec3::from(reader.numbers::<3>(node, "scale")?),
                _ => DVec3::splat(reader.number(node, "scale")?),
            };
            Some(DAffine3::from_scale(scale))
        }
        "translate" => {
            Some(DAffine3::from_translation(reader.numbers::<3>(node, "translate")?.into()))
        }
        "rotate" => {
            let Value::Table(parts) = &node.value else {
                reader.expected(node, "rotate", "{ axis = [x, y, z], degrees = angle }");
                return None;
            };
            let find = |name: &str| parts.iter().find(|e| e.key == name).map(|e| &e.node);
            let (Some(axis), Some(degrees), 2) = (find("axis"), find("degrees"), parts.len())
            else {
                reader
                    .mistake(node.span, "`rotate` has the fields `axis` and `degrees`, no others");
                return None;
            };
            let Some(direction) = DVec3::from(reader.numbers::<3>(axis, "axis")?).try_normalize()
            else {
                reader.mistake(axis.span, "the `axis` of a rotation must not be zero");
                return None;
            };
            let angle = reader.number(degrees, "degrees")?.to_radians();
            Some(DAffine3::from_quat(DQuat::from_axis_angle(direction, angle)))
        }
        "matrix" => {
            let m = reader.numbers::<16>(node, "matrix")?;
            if m[12..] != [0.0, 0.0, 0.0, 1.0] {
                reader.mistake(node.span, "the last row of a `matrix` must be 0, 0, 0, 1");
                return None;
            }
            let mut rows = [0.0; 12];
            rows.copy_from_slice(&m[..12]);
            Some(affine(&rows))
        }
        other => {
            let message = format!(
                "unknown field `{other}` in a step of a transform; accepted: scale, rotate, translate, matrix"
            );
            reader.mistake(entry.key_span, message);
            None
        }
    }
}

/// Three rows of four numbers as a transform.
pub(super) fn affine(m: &[f64; 12]) -> DAffine3 {
    DAffine3::from_cols_array(&[
        m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10], m[3], m[7], m[11],
    ])
}
