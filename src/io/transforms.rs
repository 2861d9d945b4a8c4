//! Transforms: as a list of steps in a scene file, as a CSV of twelve numbers a row (3 × 4, row-major), one
//! transform each, and as a NumPy array of such.

use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};

use super::document::{Node, Value};
use super::error::ReadError;
use super::fields::Reader;
use super::grid::SampleType;
use super::grid::npy::{Header, header};
use super::source::Source;
use crate::geometry::grid::SampleOrder;

/// Reads a file of transforms, by its extension: `.csv` or `.npy`.
///
/// # Errors
/// If the file cannot be read, or a transform is not twelve finite numbers.
pub(super) fn read_transforms(path: &Path) -> Result<Vec<DAffine3>, ReadError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "csv" => read_csv(path),
        "npy" => read_npy(path),
        _ => Err(ReadError::file(path, "transforms are read from .csv and .npy files")),
    }
}

/// An array of n × 12, n × 3 × 4 or n × 4 × 4 floats, in C order. Of a 4 × 4 matrix the last row must be
/// 0, 0, 0, 1.
fn read_npy(path: &Path) -> Result<Vec<DAffine3>, ReadError> {
    let source = Source::open(path)?;
    let Header { shape, kind, is_big_endian, order, start } = header(&source)?;
    let of_file = |message: String| ReadError::file(path, message);
    let width = match shape[..] {
        [_, 12] | [_, 3, 4] => 12,
        [_, 4, 4] => 16,
        _ => {
            let message = format!("an array of {shape:?}; accepted: (n, 12), (n, 3, 4), (n, 4, 4)");
            return Err(of_file(message));
        }
    };
    if order != SampleOrder::ZFastest {
        return Err(of_file("an array in Fortran order; accepted: C order".to_owned()));
    }
    let number: fn(&[u8], bool) -> f64 = match kind {
        SampleType::F32 => |bytes, is_big| f32::from_bits(bits(bytes, is_big) as u32).into(),
        SampleType::F64 => |bytes, is_big| f64::from_bits(bits(bytes, is_big)),
        _ => return Err(of_file("an array of integers; accepted: f4, f8".to_owned())),
    };
    // What the file claims against what it holds, before anything is allocated.
    let row = width * kind.bytes();
    let found = source.len.saturating_sub(start);
    if (shape[0] as u64).checked_mul(row as u64) != Some(found) {
        let message = format!("{} transforms of {row} bytes, but the file holds {found}", shape[0]);
        return Err(of_file(message));
    }
    let bytes = source.read_from(start)?;
    let transform = |(index, bytes): (usize, &[u8])| {
        let mut numbers = bytes.chunks_exact(kind.bytes()).map(|b| number(b, is_big_endian));
        let m: [f64; 12] = std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN));
        if !m.iter().all(|x| x.is_finite()) {
            let message =
                format!("transform {index} (counted from 0) has a number that is not finite");
            return Err(of_file(message));
        }
        let last: Vec<f64> = numbers.collect();
        if width == 16 && last != [0.0, 0.0, 0.0, 1.0] {
            let message = format!(
                "transform {index} (counted from 0) has {last:?} in the place of 0, 0, 0, 1"
            );
            return Err(of_file(message));
        }
        Ok(affine(&m))
    };
    bytes.chunks_exact(row).enumerate().map(transform).collect()
}

/// The bits of a number of up to eight bytes.
fn bits(bytes: &[u8], is_big_endian: bool) -> u64 {
    let add = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
    if is_big_endian { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) }
}

/// Blank lines and lines that start with `#` are skipped.
fn read_csv(path: &Path) -> Result<Vec<DAffine3>, ReadError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let header =
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn read(bytes: &[u8]) -> Result<Vec<DAffine3>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        std::fs::write(&path, bytes).unwrap();
        let told =
            |e: ReadError| e.to_string().replace(&format!("{}/", folder.path().display()), "");
        read_transforms(&path).map_err(told)
    }

    #[test]
    fn arrays_are_read_as_lists_are() {
        let rows: Vec<f64> = (0..24).map(f64::from).collect();
        let expected: Vec<DAffine3> =
            rows.chunks_exact(12).map(|m| affine(&m.try_into().unwrap())).collect();
        let little: Vec<u8> = rows.iter().flat_map(|x| x.to_le_bytes()).collect();
        let big: Vec<u8> = rows.iter().flat_map(|x| (*x as f32).to_be_bytes()).collect();
        assert_eq!(read(&npy("<f8", "(2, 12)", &little)).unwrap(), expected);
        assert_eq!(read(&npy(">f4", "(2, 3, 4)", &big)).unwrap(), expected);
        let square: Vec<u8> = rows
            .chunks_exact(12)
            .flat_map(|m| [m, &[0.0, 0.0, 0.0, 1.0]].concat())
            .flat_map(f64::to_le_bytes)
            .collect();
        assert_eq!(read(&npy("<f8", "(2, 4, 4)", &square)).unwrap(), expected);
        assert_eq!(read(&npy("<f8", "(0, 12)", &[])).unwrap(), []);
    }

    #[test]
    fn each_mistake_is_told() {
        let told =
            |descr: &str, shape: &str, data: &[u8]| read(&npy(descr, shape, data)).unwrap_err();
        assert_eq!(
            told("<f8", "(2, 9)", &[]),
            "a.npy: an array of [2, 9]; accepted: (n, 12), (n, 3, 4), (n, 4, 4)"
        );
        assert_eq!(
            told("<i4", "(1, 12)", &[0; 48]),
            "a.npy: an array of integers; accepted: f4, f8"
        );
        assert_eq!(
            told("<f8", "(4000000000000, 12)", &[0; 96]),
            "a.npy: 4000000000000 transforms of 96 bytes, but the file holds 96"
        );
        let nan: Vec<u8> = (0..12).flat_map(|i| (0.0 / f64::from(i)).to_le_bytes()).collect();
        assert_eq!(
            told("<f8", "(1, 12)", &nan),
            "a.npy: transform 0 (counted from 0) has a number that is not finite"
        );
        assert_eq!(
            told("<f8", "(1, 4, 4)", &[0; 128]),
            "a.npy: transform 0 (counted from 0) has [0.0, 0.0, 0.0, 0.0] in the place of 0, 0, 0, 1"
        );
    }
}
