//! Grids of samples: NumPy's `.npy`, and raw samples whose size and type the user says.
//!
//! Source: NumPy Enhancement Proposal 1, *A Simple File Format for NumPy Arrays*, and
//! `numpy.lib.format`. An array's axes are x, y and z, in this order, in either memory order.

pub(super) mod npy;

use std::path::Path;

use rayon::prelude::*;

use super::error::ReadError;
use super::source::{CHUNK, Source};
use crate::geometry::grid::{Grid, SampleOrder};

/// The type of a file's samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SampleType {
    /// Unsigned bytes.
    U8,
    /// Signed bytes.
    I8,
    /// Unsigned, of 16 bits.
    U16,
    /// Signed, of 16 bits.
    I16,
    /// Unsigned, of 32 bits.
    U32,
    /// Signed, of 32 bits.
    I32,
    /// Floating point, of 32 bits.
    F32,
    /// Floating point, of 64 bits.
    F64,
}

impl SampleType {
    /// All, by their names in scene files.
    pub const NAMED: [(&'static str, Self); 8] = [
        ("u8", Self::U8),
        ("i8", Self::I8),
        ("u16", Self::U16),
        ("i16", Self::I16),
        ("u32", Self::U32),
        ("i32", Self::I32),
        ("f32", Self::F32),
        ("f64", Self::F64),
    ];

    /// Bytes a sample.
    pub const fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Decodes samples, rounding to f32 what it cannot hold.
    fn decode(self, bytes: &[u8], is_big_endian: bool, to: &mut [f32]) {
        macro_rules! decode {
            ($type:ty) => {{
                let (parts, _) = bytes.as_chunks::<{ size_of::<$type>() }>();
                let from =
                    if is_big_endian { <$type>::from_be_bytes } else { <$type>::from_le_bytes };
                for (to, part) in to.iter_mut().zip(parts) {
                    *to = from(*part) as f32;
                }
            }};
        }
        match self {
            Self::U8 => decode!(u8),
            Self::I8 => decode!(i8),
            Self::U16 => decode!(u16),
            Self::I16 => decode!(i16),
            Self::U32 => decode!(u32),
            Self::I32 => decode!(i32),
            Self::F32 => decode!(f32),
            Self::F64 => decode!(f64),
        }
    }
}

/// How samples lie in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SampleLayout {
    /// Samples along x, y and z.
    pub size: [usize; 3],
    /// Their type.
    pub kind: SampleType,
    /// Whether the most significant byte comes first.
    pub is_big_endian: bool,
    /// Which axis runs fastest.
    pub order: SampleOrder,
}

/// Reads a `.npy` file of three axes, which are x, y and z: versions 1 to 3, integers of 8 to 32 bits and
/// floats of 32 and 64 bits, of either byte order, in C or in Fortran order.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, is not such an array or is cut short, or where a sample is
/// not finite (as an f32).
pub fn read_npy(path: &Path) -> Result<Grid, ReadError> {
    let source = Source::open(path)?;
    let npy::Header { shape, kind, is_big_endian, order, start } = npy::header(&source)?;
    let size: [usize; 3] = shape.try_into().map_err(|shape: Vec<_>| {
        let message = format!("an array of {} axes; accepted: 3 (x, y, z)", shape.len());
        ReadError::file(path, message)
    })?;
    read_samples(&source, &SampleLayout { size, kind, is_big_endian, order }, start)
}

/// Reads a file of nothing but samples.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, or is not just as long as `layout` says, or where a sample is
/// not finite (as an f32).
pub fn read_raw(path: &Path, layout: &SampleLayout) -> Result<Grid, ReadError> {
    read_samples(&Source::open(path)?, layout, 0)
}

fn read_samples(source: &Source<'_>, layout: &SampleLayout, start: u64) -> Result<Grid, ReadError> {
    let &SampleLayout { size, kind, is_big_endian, order } = layout;
    let [nx, ny, nz] = size;
    let of_file = |message: String| ReadError::file(source.path, message);
    if size.iter().any(|&n| n < 2) {
        let message =
            format!("a grid needs at least 2 samples along each axis, not {nx} x {ny} x {nz}");
        return Err(of_file(message));
    }
    // What the file claims against what it holds, before anything is allocated.
    let found = source.len.saturating_sub(start);
    let bytes = size.iter().try_fold(kind.bytes() as u64, |n, &m| n.checked_mul(m as u64));
    if bytes != Some(found) {
        let expected =
            bytes.map_or("more bytes than a file can have".to_owned(), |n| format!("{n} bytes"));
        return Err(of_file(format!(
            "{nx} x {ny} x {nz} samples of {} bytes are {expected}, but the file holds {found}",
            kind.bytes()
        )));
    }
    let count = usize::try_from(found / kind.bytes() as u64)
        .map_err(|_| of_file("the grid does not fit into memory".to_owned()))?;
    let mut samples = vec![0.0f32; count];
    let part = CHUNK / kind.bytes();
    samples.par_chunks_mut(part).enumerate().try_for_each_init(Vec::new, |buffer, (i, to)| {
        let offset = start + (i * part * kind.bytes()) as u64;
        let bytes = source.read_into(buffer, to.len() * kind.bytes(), offset)?;
        kind.decode(bytes, is_big_endian, to);
        Ok::<_, ReadError>(())
    })?;
    Grid::new(size, order, samples).map_err(|error| of_file(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads `bytes` from a file of this name; the error without the name of its folder.
    pub(super) fn with_file<T>(
        name: &str,
        bytes: &[u8],
        read: impl FnOnce(&Path) -> Result<T, ReadError>,
    ) -> Result<T, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        read(&path).map_err(|e| e.to_string().replace(&format!("{}/", folder.path().display()), ""))
    }

    #[test]
    fn raw_samples_of_all_types() {
        let layout = |kind, is_big_endian| SampleLayout {
            size: [2, 3, 2],
            kind,
            is_big_endian,
            order: SampleOrder::XFastest,
        };
        for big in [false, true] {
            for (name, kind) in SampleType::NAMED {
                let mut bytes = Vec::new();
                for i in 0..12i8 {
                    let v = if name.starts_with('u') { i } else { i - 6 };
                    let part: Vec<u8> = match kind {
                        SampleType::U8 | SampleType::I8 => v.to_be_bytes().to_vec(),
                        SampleType::U16 | SampleType::I16 => i16::from(v).to_be_bytes().to_vec(),
                        SampleType::U32 | SampleType::I32 => i32::from(v).to_be_bytes().to_vec(),
                        SampleType::F32 => f32::from(v).to_be_bytes().to_vec(),
                        SampleType::F64 => f64::from(v).to_be_bytes().to_vec(),
                    };
                    bytes.extend(part.iter().copied().take(if big { 8 } else { 0 }));
                    if !big {
                        bytes.extend(part.iter().rev());
                    }
                }
                let grid = with_file("a.raw", &bytes, |p| read_raw(p, &layout(kind, big))).unwrap();
                let first = if name.starts_with('u') { 0.0 } else { -6.0 };
                // x runs fastest: 1 + 2·(2 + 3·0).
                assert_eq!(grid.sample([1, 2, 0]), first + 5.0, "{name} {big}");
                assert_eq!(grid.sample([0, 0, 1]), first + 6.0, "{name} {big}");
            }
        }
    }

    #[test]
    fn raw_files_of_another_length_are_told() {
        let layout = |size, kind| SampleLayout {
            size,
            kind,
            is_big_endian: false,
            order: SampleOrder::XFastest,
        };
        let read = |bytes: &[u8], size, kind| {
            with_file("a.raw", bytes, |p| read_raw(p, &layout(size, kind)).map(drop)).unwrap_err()
        };
        assert_eq!(
            read(&[0; 17], [2, 2, 2], SampleType::U16),
            "a.raw: 2 x 2 x 2 samples of 2 bytes are 16 bytes, but the file holds 17"
        );
        assert_eq!(
            read(&[0; 17], [1 << 40, 1 << 20, 1 << 9], SampleType::F64),
            "a.raw: 1099511627776 x 1048576 x 512 samples of 8 bytes are more bytes than a file can \
             have, but the file holds 17"
        );
        assert_eq!(
            read(&[0; 17], [17, 1, 1], SampleType::U8),
            "a.raw: a grid needs at least 2 samples along each axis, not 17 x 1 x 1"
        );
        // A double that is finite, but not as a float.
        let mut bytes = [0; 64];
        bytes[24..32].copy_from_slice(&1e300f64.to_le_bytes());
        assert_eq!(
            read(&bytes, [2, 2, 2], SampleType::F64),
            "a.raw: sample [1, 1, 0] (x, y, z, counted from 0) is inf; accepted: finite numbers"
        );
        assert_eq!(read(&[], [2, 2, 2], SampleType::F64), "a.raw: the file is empty");
    }
}
