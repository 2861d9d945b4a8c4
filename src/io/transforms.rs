//! Lists of transforms: a CSV of twelve numbers a row (3 × 4, row-major).

use std::path::Path;

use glam::DAffine3;

use super::error::ReadError;
use super::scene_toml::affine;

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
