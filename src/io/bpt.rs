//! Bicubic Bézier patches from text: the `.bpt` format in which the teapot is spread. The number of
//! patches, then for each its degrees, `3 3`, and 16 control points in rows of four. `#` begins a
//! comment.

use std::path::Path;

use glam::DVec3;

use super::error::ReadError;
use super::mesh::MAX_COORDINATE;
use super::source::Source;
use super::text::{parse_integer, parse_number, quoted};
use crate::geometry::freeform::BezierPatch;

/// Reads the patches of a file.
pub(super) fn read_patches(path: &Path) -> Result<Vec<BezierPatch>, ReadError> {
    let bytes = Source::open(path)?.read_from(0)?;
    let lines = (1..).zip(bytes.split(|&b| b == b'\n'));
    let mut words = lines.flat_map(|(line, text)| {
        let text = text.split(|&b| b == b'#').next().unwrap_or_default();
        let words = text.split(|b| b.is_ascii_whitespace() || *b == b',');
        words.filter(|word| !word.is_empty()).map(move |word| (line, word))
    });
    let mut next = |what: &str| {
        words.next().ok_or_else(|| ReadError::file(path, format!("the file ends before {what}")))
    };
    let (line, word) = next("the number of patches")?;
    let count = parse_integer(word).and_then(|n| usize::try_from(n).ok()).ok_or_else(|| {
        let message = format!("{} is not a number of patches", quoted(word));
        ReadError::line(path, line, message)
    })?;
    // No more room than the file can fill: a patch takes 100 bytes and more.
    let mut patches = Vec::with_capacity(count.min(bytes.len() / 100));
    for patch in 0..count {
        let what = format!("patch {patch} (the first is 0) of {count} is complete");
        for _ in 0..2 {
            let (line, word) = next(&what)?;
            if parse_integer(word) != Some(3) {
                let message =
                    format!("patch {patch} has degree {}; accepted: 3 3, bicubic", quoted(word));
                return Err(ReadError::line(path, line, message));
            }
        }
        let mut points = [DVec3::ZERO; 16];
        for point in &mut points {
            for axis in 0..3 {
                let (line, word) = next(&what)?;
                let number = parse_number(word).filter(|x| x.abs() <= MAX_COORDINATE);
                point[axis] = number.ok_or_else(|| {
                    let message = format!("{} is not a coordinate within 1e18", quoted(word));
                    ReadError::line(path, line, message)
                })?;
            }
        }
        patches.push(BezierPatch::bicubic(&points));
    }
    if let Ok((line, word)) = next("") {
        let message = format!("{} follows after the last of {count} patches", quoted(word));
        return Err(ReadError::line(path, line, message));
    }
    Ok(patches)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<usize, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bpt");
        std::fs::write(&path, text).unwrap();
        let patches = read_patches(&path).map(|patches| patches.len());
        patches.map_err(|e| e.to_string().replace(&format!("{}", path.display()), "a.bpt"))
    }

    #[test]
    fn patches_and_mistakes() {
        let points = "1 2 3\n".repeat(16);
        assert_eq!(read(&format!("# one\n1\n3 3 # bicubic\n{points}")), Ok(1));
        assert_eq!(read(&format!("2\r\n3 3\n{points}3 3\n{points}\n")), Ok(2));
        for (text, expected) in [
            ("x\n".to_owned(), "a.bpt:1: `x` is not a number of patches"),
            (
                format!("1\n2 3\n{points}"),
                "a.bpt:2: patch 0 has degree `2`; accepted: 3 3, bicubic",
            ),
            (
                format!("2\n3 3\n{points}"),
                "a.bpt: the file ends before patch 1 (the first is 0) of 2 is complete",
            ),
            (format!("1\n3 3\n{points}4"), "a.bpt:19: `4` follows after the last of 1 patches"),
            ("1\n3 3\n1 2 nan".to_owned(), "a.bpt:3: `nan` is not a coordinate within 1e18"),
            (
                "999999999999\n".to_owned(),
                "a.bpt: the file ends before patch 0 (the first is 0) of 999999999999 is complete",
            ),
        ] {
            assert_eq!(read(&text).unwrap_err(), expected);
        }
    }
}
