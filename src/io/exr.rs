//! OpenEXR: linear light, half or float, with all that a reader should know in the header.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

use exr::meta::attribute::{AttributeValue as ExrValue, Chromaticities, IntegerBounds, Text};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, LineOrder, Vec2, WritableImage, f16,
};

use super::error::WriteError;
use super::output::{Attribute, AttributeValue, write_whole};
use crate::film::Film;

/// How channel values are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PixelType {
    /// 16 bits, three digits, up to 65504. A picture with larger values is written as float instead.
    #[default]
    Half,
    /// 32 bits.
    Float,
}

impl PixelType {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Half, Self::Float];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Half => "half",
            Self::Float => "float",
        }
    }
}

/// The compressions. All are lossless but `pxr24` (for float), `b44` and `b44a`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[expect(missing_docs, reason = "the names are OpenEXR's own")]
pub enum ExrCompression {
    None,
    Rle,
    Zips,
    #[default]
    Zip,
    Piz,
    Pxr24,
    B44,
    B44a,
}

impl ExrCompression {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::None,
        Self::Rle,
        Self::Zips,
        Self::Zip,
        Self::Piz,
        Self::Pxr24,
        Self::B44,
        Self::B44a,
    ];

    /// OpenEXR's name, as on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Rle => "rle",
            Self::Zips => "zips",
            Self::Zip => "zip",
            Self::Piz => "piz",
            Self::Pxr24 => "pxr24",
            Self::B44 => "b44",
            Self::B44a => "b44a",
        }
    }

    const fn native(self) -> Compression {
        match self {
            Self::None => Compression::Uncompressed,
            Self::Rle => Compression::RLE,
            Self::Zips => Compression::ZIP1,
            Self::Zip => Compression::ZIP16,
            Self::Piz => Compression::PIZ,
            Self::Pxr24 => Compression::PXR24,
            Self::B44 => Compression::B44,
            Self::B44a => Compression::B44A,
        }
    }
}

/// How to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExrOptions {
    /// Type of the colour channels.
    pub pixel_type: PixelType,
    /// Compression of the whole file.
    pub compression: ExrCompression,
}

/// Writes the film's mean as channels R, G, B. The data window is the film's window, the display
/// window the whole picture.
///
/// Returns the type that was used: float where half was asked for but cannot hold the largest value.
///
/// # Errors
/// [`WriteError`] where the file cannot be written; the old one is then untouched.
pub fn write_exr(
    path: &Path,
    film: &Film,
    attributes: &[Attribute],
    options: &ExrOptions,
) -> Result<PixelType, WriteError> {
    let largest = f16::MAX.to_f32();
    let fits = film.mean.iter().all(|c| c.to_array().iter().all(|x| x.abs() <= largest));
    let pixel_type = if fits { options.pixel_type } else { PixelType::Float };
    let channel = |name: &str, index: usize| {
        let values = film.mean.iter().map(|c| c.to_array()[index]);
        let samples = match pixel_type {
            PixelType::Half => FlatSamples::F16(values.map(f16::from_f32).collect()),
            PixelType::Float => FlatSamples::F32(values.collect()),
        };
        AnyChannel::new(name, samples)
    };
    let channels = AnyChannels::sort(
        [channel("B", 2), channel("G", 1), channel("R", 0)].into_iter().collect(),
    );

    let window = &film.window;
    let mut layer_attributes = LayerAttributes {
        layer_position: Vec2(window.x0 as i32, window.y0 as i32),
        software_name: Some(Text::from(concat!("alhazen ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for attribute in attributes {
        debug_assert!(attribute.name.len() <= 31, "{}", attribute.name);
        let value = match &attribute.value {
            AttributeValue::Text(text) => ExrValue::Text(text.as_str().into()),
            AttributeValue::Integer(i) => ExrValue::I32(*i),
            AttributeValue::Float(x) => ExrValue::F64(*x),
            AttributeValue::Vector([x, y, z]) => ExrValue::FloatVec3((*x, *y, *z)),
        };
        layer_attributes.other.insert(Text::from(attribute.name), value);
    }
    let size = (window.width() as usize, window.height() as usize);
    let encoding = Encoding {
        compression: options.compression.native(),
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut image = Image::from_layer(Layer::new(size, layer_attributes, encoding, channels));
    let [width, height] = film.size.map(|x| x as usize);
    image.attributes.display_window = IntegerBounds::from_dimensions((width, height));
    image.attributes.chromaticities = Some(REC_709);

    write_whole(path, |writer| {
        // The encoder starts a thread for every core, unless it is told not to.
        let encoder = if rayon::current_num_threads() == 1 {
            image.write().non_parallel()
        } else {
            image.write()
        };
        encoder.to_buffered(&mut *writer).map_err(|error| match error {
            exr::error::Error::Io(e) => WriteError::io(path, "write", e),
            other => WriteError::format(path, other.to_string()),
        })?;
        writer.flush().map_err(|e| WriteError::io(path, "write", e))?;
        sort_header(writer.get_ref()).map_err(|e| WriteError::io(path, "write", e))
    })?;
    Ok(pixel_type)
}

/// Puts the attributes of a single-part file's header into alphabetical order: the encoder takes our
/// own from a hash map, in another order every time, and the same picture must be the same bytes.
///
/// A header is a list of (name, NUL, type, NUL, size as i32, value) that ends with a NUL; its length
/// does not change. Source: *OpenEXR File Layout*, openexr.com.
fn sort_header(file: &File) -> io::Result<()> {
    const START: usize = 8;
    let mut bytes = vec![0; 1 << 16];
    let mut length = 0;
    while length < bytes.len() {
        match file.read_at(&mut bytes[length..], length as u64)? {
            0 => break,
            n => length += n,
        }
    }
    let corrupt = || io::Error::other("the encoder wrote a header that cannot be read");
    let text_end = |from: usize| {
        let length = bytes.get(from..length)?.iter().position(|&b| b == 0)?;
        Some(from + length)
    };
    let mut attributes = Vec::new();
    let mut at = START;
    loop {
        let name_end = text_end(at).ok_or_else(corrupt)?;
        if name_end == at {
            break;
        }
        let type_end = text_end(name_end + 1).ok_or_else(corrupt)?;
        let size = bytes.get(type_end + 1..type_end + 5).ok_or_else(corrupt)?;
        let size = i32::from_le_bytes(size.try_into().map_err(|_| corrupt())?);
        let end = type_end + 5 + usize::try_from(size).map_err(|_| corrupt())?;
        attributes.push(bytes.get(at..end).ok_or_else(corrupt)?);
        at = end;
    }
    attributes.sort_unstable();
    file.write_all_at(&attributes.concat(), START as u64)
}

/// The primaries and the white point (D65) of our colours. Source: ITU-R BT.709-6 §1.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};
