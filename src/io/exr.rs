//! OpenEXR: linear light, half or float, with all that a reader should know in the header.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::compression::ByteVec;
use exr::math::RoundingMode;
use exr::meta::attribute::{
    AttributeValue as ExrValue, Chromaticities, IntegerBounds, LevelMode, Text, TileDescription,
};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{ChannelDescription, Compression, LineOrder, SampleType, Vec2, f16};
use rayon::prelude::*;

use super::error::WriteError;
use super::layers::film_channels;
use super::output::{Attribute, AttributeValue, write_whole};
use crate::color::Rgb;
use crate::film::{Film, PixelRect};

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

/// How pixels are grouped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ExrLayout {
    /// Rows, as many at once as the compression takes.
    #[default]
    Scanline,
    /// Tiles of 64 × 64 pixels: a reader that wants a part of a large picture reads no more.
    Tiles,
}

impl ExrLayout {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Scanline, Self::Tiles];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scanline => "scanline",
            Self::Tiles => "tiles",
        }
    }

    const fn native(self) -> BlockDescription {
        match self {
            Self::Scanline => BlockDescription::ScanLines,
            Self::Tiles => BlockDescription::Tiles(TileDescription {
                tile_size: Vec2(64, 64),
                level_mode: LevelMode::Singular,
                rounding_mode: RoundingMode::Down,
            }),
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
    /// How pixels are grouped.
    pub layout: ExrLayout,
}

/// A channel of a file.
pub struct Channel<'a> {
    /// Its name: that of its layer and a dot, unless it is of the picture itself, and its own ("albedo.R").
    pub name: String,
    /// Its type and values.
    pub values: ChannelValues<'a>,
}

/// Writes the values of the pixels from (x, y) of the window on, to the right, into a slice of a row.
pub type Row<'a, T> = Box<dyn Fn([u32; 2], &mut [T]) + Sync + 'a>;

/// The values of a channel.
pub enum ChannelValues<'a> {
    /// Half or float, as [`ExrOptions::pixel_type`] says.
    Color(Row<'a, f32>),
    /// Always float.
    Float(Row<'a, f32>),
    /// Whole numbers of 32 bits.
    Uint(Row<'a, u32>),
}

impl<'a> Channel<'a> {
    /// Colour, or what else a half may hold.
    pub fn color(name: impl Into<String>, row: impl Fn([u32; 2], &mut [f32]) + Sync + 'a) -> Self {
        Self { name: name.into(), values: ChannelValues::Color(Box::new(row)) }
    }

    /// Floats, exactly.
    pub fn float(name: impl Into<String>, row: impl Fn([u32; 2], &mut [f32]) + Sync + 'a) -> Self {
        Self { name: name.into(), values: ChannelValues::Float(Box::new(row)) }
    }

    /// Whole numbers.
    pub fn uint(name: impl Into<String>, row: impl Fn([u32; 2], &mut [u32]) + Sync + 'a) -> Self {
        Self { name: name.into(), values: ChannelValues::Uint(Box::new(row)) }
    }

    /// The channels `names` of a plane of colours, row by row over a window of `width`.
    pub fn of_plane(names: [String; 3], plane: &'a [Rgb], width: u32) -> [Self; 3] {
        let mut index = 0;
        names.map(|name| {
            let c = index;
            index += 1;
            Self::color(name, move |[x, y], out| {
                let start = y as usize * width as usize + x as usize;
                out.iter_mut().zip(&plane[start..]).for_each(|(to, from)| *to = from.to_array()[c]);
            })
        })
    }

    fn sample_type(&self, color: PixelType) -> SampleType {
        match (&self.values, color) {
            (ChannelValues::Color(_), PixelType::Half) => SampleType::F16,
            (ChannelValues::Color(_) | ChannelValues::Float(_), _) => SampleType::F32,
            (ChannelValues::Uint(_), _) => SampleType::U32,
        }
    }

    /// Appends the values of a part of a row as the bytes of `kind`.
    fn append(&self, kind: SampleType, at: [u32; 2], scratch: &mut Scratch, bytes: &mut ByteVec) {
        match &self.values {
            ChannelValues::Color(row) | ChannelValues::Float(row) => {
                row(at, &mut scratch.floats);
                if kind == SampleType::F16 {
                    let halves = scratch.floats.iter().map(|x| f16::from_f32(*x).to_ne_bytes());
                    halves.for_each(|x| bytes.extend_from_slice(&x));
                } else {
                    bytes.extend_from_slice(bytemuck::cast_slice(&scratch.floats));
                }
            }
            ChannelValues::Uint(row) => {
                row(at, &mut scratch.numbers);
                bytes.extend_from_slice(bytemuck::cast_slice(&scratch.numbers));
            }
        }
    }
}

/// Part of a row, of either type.
struct Scratch {
    floats: Vec<f32>,
    numbers: Vec<u32>,
}

/// Writes the film: its mean as channels R, G, B, and its layers ([`film_channels`]). The data window is
/// the film's window, the display window the whole picture.
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
    write_channels(path, film.size, &film.window, film_channels(film), attributes, options)
}

/// Writes any channels of the `window` (the data window) of a picture of `size` (the display window).
/// Names must differ. Their rows are asked for on all threads, each once or, of colours, twice.
///
/// Returns the type of colours: float where half was asked for but cannot hold the largest value.
///
/// # Errors
/// [`WriteError`] where the file cannot be written, or would round whole numbers or floats that are to be
/// exact; the old file is then untouched.
pub fn write_channels(
    path: &Path,
    size: [u32; 2],
    window: &PixelRect,
    mut channels: Vec<Channel>,
    attributes: &[Attribute],
    options: &ExrOptions,
) -> Result<PixelType, WriteError> {
    let is_exact = |c: &Channel| !matches!(c.values, ChannelValues::Color(_));
    if options.compression == ExrCompression::Pxr24
        && let Some(channel) = channels.iter().find(|c| is_exact(c))
    {
        let message =
            format!("pxr24 would round the channel {}; accepted: the others", channel.name);
        return Err(WriteError::format(path, message));
    }
    // The order that the format asks for.
    channels.sort_unstable_by(|a, b| a.name.as_bytes().cmp(b.name.as_bytes()));
    let pixel_type =
        if fits_half(window, &channels) { options.pixel_type } else { PixelType::Float };

    let header = header(size, window, &channels, attributes, pixel_type, options);
    write_whole(path, |writer| {
        let encoded = exr::block::write(
            &mut *writer,
            [header].into_iter().collect(),
            false,
            |meta, chunks| write_blocks(&meta, chunks, &channels),
        );
        encoded.map_err(|error| match error {
            exr::error::Error::Io(e) => WriteError::io(path, "write", e),
            other => WriteError::format(path, other.to_string()),
        })?;
        writer.flush().map_err(|e| WriteError::io(path, "write", e))?;
        sort_header(writer.get_ref()).map_err(|e| WriteError::io(path, "write", e))
    })?;
    Ok(pixel_type)
}

/// Whether a half can hold all colours.
fn fits_half(window: &PixelRect, channels: &[Channel]) -> bool {
    let largest = f16::MAX.to_f32();
    let colors = channels.iter().filter_map(|channel| match &channel.values {
        ChannelValues::Color(row) => Some(row),
        _ => None,
    });
    let colors: Vec<_> = colors.collect();
    (0..window.height()).into_par_iter().all(|y| {
        let mut values = vec![0.0f32; window.width() as usize];
        colors.iter().all(|row| {
            row([0, y], &mut values);
            values.iter().all(|x| x.abs() <= largest)
        })
    })
}

fn header(
    [width, height]: [u32; 2],
    window: &PixelRect,
    channels: &[Channel],
    attributes: &[Attribute],
    pixel_type: PixelType,
    options: &ExrOptions,
) -> Header {
    let mut own = LayerAttributes {
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
        own.other.insert(Text::from(attribute.name.as_str()), value);
    }
    let display = IntegerBounds::from_dimensions((width as usize, height as usize));
    let shared = ImageAttributes { chromaticities: Some(REC_709), ..ImageAttributes::new(display) };
    let list = channels.iter().map(|channel| {
        // Lossy compressions keep ratios, not differences.
        ChannelDescription::new(channel.name.as_str(), channel.sample_type(pixel_type), false)
    });
    Header::new(Text::from(""), (window.width() as usize, window.height() as usize), list.collect())
        .with_encoding(options.compression.native(), options.layout.native(), LineOrder::Increasing)
        .with_shared_attributes(shared)
        .with_attributes(own)
}

/// Blocks that are compressed at once, for each thread.
const BATCH: usize = 8;

/// Compresses all blocks on all threads, some at a time, and writes them in order.
fn write_blocks<W: ChunksWriter>(
    meta: &MetaData,
    chunks: &mut W,
    channels: &[Channel],
) -> exr::error::UnitResult {
    let header = &meta.headers[0];
    let kinds: Vec<SampleType> = header.channels.list.iter().map(|c| c.sample_type).collect();
    let fill = |index: BlockIndex| {
        let (Vec2(x, y), Vec2(width, height)) = (index.pixel_position, index.pixel_size);
        let mut data = ByteVec::with_capacity(width * height * header.channels.bytes_per_pixel);
        let mut scratch = Scratch { floats: vec![0.0; width], numbers: vec![0; width] };
        for row in y..y + height {
            for (channel, kind) in channels.iter().zip(&kinds) {
                channel.append(*kind, [x as u32, row as u32], &mut scratch, &mut data);
            }
        }
        UncompressedBlock { index, data }
    };
    let mut blocks = exr::block::enumerate_ordered_header_block_indices(&meta.headers).peekable();
    while blocks.peek().is_some() {
        let batch: Vec<_> = blocks.by_ref().take(BATCH * rayon::current_num_threads()).collect();
        let done: Vec<_> = batch
            .into_par_iter()
            .map(|(number, index)| Ok((number, fill(index).compress_to_chunk(&meta.headers)?)))
            .collect::<exr::error::Result<_>>()?;
        for (number, chunk) in done {
            chunks.write_chunk(number, chunk)?;
        }
    }
    Ok(())
}

/// Puts the attributes of a single-part file's header into alphabetical order: the encoder takes our
/// own from a hash map, in another order every time, and the same picture must be the same bytes.
///
/// A header is a list of (name, NUL, type, NUL, size as i32, value) that ends with a NUL; its length
/// does not change. Source: *OpenEXR File Layout*, openexr.com.
fn sort_header(file: &File) -> io::Result<()> {
    const START: usize = 8;
    let length = file.metadata()?.len();
    let mut bytes = Vec::new();
    // Some thousand bytes, but for long manifests.
    for size in (16..).map(|power| 1 << power) {
        let from = bytes.len();
        bytes.resize(size.min(length as usize), 0);
        file.read_exact_at(&mut bytes[from..], from as u64)?;
        if let Some(mut attributes) = split_attributes(&bytes[START..]) {
            attributes.sort_unstable();
            return file.write_all_at(&attributes.concat(), START as u64);
        }
        if bytes.len() as u64 == length {
            break;
        }
    }
    Err(io::Error::other("the encoder wrote a header that cannot be read"))
}

/// The attributes that `bytes` begin with; none where they end before the header does.
fn split_attributes(bytes: &[u8]) -> Option<Vec<&[u8]>> {
    let text_end = |from: usize| Some(from + bytes.get(from..)?.iter().position(|&b| b == 0)?);
    let (mut attributes, mut at) = (Vec::new(), 0);
    loop {
        let name_end = text_end(at)?;
        if name_end == at {
            return Some(attributes);
        }
        let type_end = text_end(name_end + 1)?;
        let size = i32::from_le_bytes(*bytes.get(type_end + 1..)?.first_chunk()?);
        let end = type_end + 5 + usize::try_from(size).ok()?;
        attributes.push(bytes.get(at..end)?);
        at = end;
    }
}

/// The primaries and the white point (D65) of our colours. Source: ITU-R BT.709-6 §1.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};
