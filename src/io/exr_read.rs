//! Reading OpenEXR: the colours of one layer as linear light, or all channels as they are.
//!
//! Headers and compressions are the `exr` crate's; finding the blocks in the file is ours, so that
//! nothing is allocated for what a file merely claims, other layers cost nothing, and several threads
//! decode at once.

use std::collections::HashSet;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::block::chunk::{
    Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates,
};
use exr::meta::attribute::AttributeValue as ExrValue;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{Compression, SampleType, Vec2, f16};
use rayon::prelude::*;

use super::error::ReadError;
use super::output::{Attribute, AttributeValue};
use super::picture::check_size;
use super::source::Source;
use crate::color::Rgb;
use crate::film::Picture;

/// What every EXR file begins with.
pub(super) const SIGNATURE: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Blocks that are decoded at once.
const BATCH: usize = 64;

/// Reads the channels R, G and B of an EXR file, or Y as grey, in half, float or whole numbers; of
/// several parts the first that has them. Other channels (alpha among them), other layers and smaller
/// levels are left out. Values are taken as linear Rec.709, whatever primaries the file states.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, is not a sound EXR file, or lacks such channels.
pub fn read_exr(path: &Path) -> Result<Picture, ReadError> {
    decode(path, &Source::open(path)?.read_from(0)?)
}

pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<Picture, ReadError> {
    // The decoders of the `exr` crate assert things that a broken file may violate. What can be checked
    // before is; the rest must not end the program.
    let decoded = catch_unwind(AssertUnwindSafe(|| decode_layer(path, bytes)));
    decoded.unwrap_or_else(|_| Err(unsound(path, "its blocks cannot be decoded")))
}

fn unsound(path: &Path, detail: impl std::fmt::Display) -> ReadError {
    ReadError::file(path, format!("not a sound EXR file: {detail}"))
}

fn decode_layer(path: &Path, bytes: &[u8]) -> Result<Picture, ReadError> {
    let parts = Parts::read(path, bytes)?;
    let (part, channels) = find_colours(path, &parts.meta.headers)?;
    let (extent, count) = parts.check(part)?;
    let mut pixels = reserve(path, count, Rgb::BLACK)?;
    parts.decode(part, &channels, |first, k, kind, values| {
        let size = kind.bytes_per_sample();
        let row = &mut pixels[first..first + values.len() / size];
        for (pixel, value) in row.iter_mut().zip(values.chunks_exact(size)) {
            *[&mut pixel.r, &mut pixel.g, &mut pixel.b][k] = sample(kind, value);
        }
    })?;
    let (size, origin) = windows(&parts.meta.headers[part]);
    Ok(Picture { size, extent, origin: Some(origin), pixels })
}

/// All channels of a picture, by name.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureChannels {
    /// The pixels that it holds, across and down.
    pub extent: [u32; 2],
    /// Where the first of them lies in the whole, if that is said.
    pub origin: Option<[i32; 2]>,
    /// Names and values, row by row from the top; whole numbers as the nearest float.
    pub channels: Vec<(String, Vec<f32>)>,
    /// What the header of an EXR file says of it, by name.
    pub attributes: Vec<Attribute>,
}

/// All channels of the only part of an EXR file: half, float and whole numbers.
pub(super) fn decode_channels(path: &Path, bytes: &[u8]) -> Result<PictureChannels, ReadError> {
    only_part(path, bytes, |parts| {
        let (head, count) = head(parts)?;
        let list = &parts.meta.headers[0].channels.list;
        let mut channels = Vec::new();
        for channel in list {
            channels.push((channel.name.to_string(), reserve(path, count, 0.0f32)?));
        }
        let all: Vec<usize> = (0..list.len()).collect();
        parts.decode(0, &all, |first, k, kind, values| {
            let size = kind.bytes_per_sample();
            let row = &mut channels[k].1[first..first + values.len() / size];
            for (to, value) in row.iter_mut().zip(values.chunks_exact(size)) {
                *to = sample(kind, value);
            }
        })?;
        let ExrHead { extent, origin, attributes, .. } = head;
        Ok(PictureChannels { extent, origin: Some(origin), channels, attributes })
    })
}

/// The names of the channels of the only part of an EXR file.
pub(super) fn decode_channel_names(path: &Path, bytes: &[u8]) -> Result<Vec<String>, ReadError> {
    only_part(path, bytes, |parts| {
        let list = &parts.meta.headers[0].channels.list;
        Ok(list.iter().map(|channel| channel.name.to_string()).collect())
    })
}

/// What the header of the only part of a file says.
pub(super) struct ExrHead {
    /// Size of the whole picture.
    pub(super) size: [u32; 2],
    /// The pixels that it holds, across and down.
    pub(super) extent: [u32; 2],
    /// Where the first of them lies in the whole.
    pub(super) origin: [i32; 2],
    /// What else it says, by name.
    pub(super) attributes: Vec<Attribute>,
}

/// Names and bits of channels of 32 bits a pixel, row by row.
pub(super) type WideChannels = Vec<(String, Vec<u32>)>;

/// What the header of an EXR file says beside what every header does, by name.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, is not a sound EXR file, or has several parts.
pub fn read_attributes(path: &Path) -> Result<Vec<Attribute>, ReadError> {
    Ok(read_head(path)?.attributes)
}

/// Reads the header of an EXR file alone.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, is not a sound EXR file, or has several parts.
pub(super) fn read_head(path: &Path) -> Result<ExrHead, ReadError> {
    with_only_part(path, |parts| Ok(head(parts)?.0))
}

/// Reads the header and all channels of 32 bits of an EXR file.
///
/// # Errors
/// [`ReadError`] where the file cannot be read, is not a sound EXR file, or has several parts.
pub(super) fn read_channels(path: &Path) -> Result<(ExrHead, WideChannels), ReadError> {
    with_only_part(path, |parts| {
        let (head, count) = head(parts)?;
        let list = &parts.meta.headers[0].channels.list;
        let is_wide = |kind: SampleType| kind.bytes_per_sample() == 4;
        let wanted: Vec<usize> =
            (0..list.len()).filter(|&i| is_wide(list[i].sample_type)).collect();
        let mut channels = WideChannels::new();
        for &index in &wanted {
            channels.push((list[index].name.to_string(), reserve(path, count, 0u32)?));
        }
        parts.decode(0, &wanted, |first, k, _, values| {
            let row = &mut channels[k].1[first..first + values.len() / 4];
            for (to, value) in row.iter_mut().zip(values.as_chunks::<4>().0) {
                *to = u32::from_ne_bytes(*value);
            }
        })?;
        Ok((head, channels))
    })
}

fn with_only_part<T>(
    path: &Path,
    read: impl FnOnce(&Parts<'_>) -> Result<T, ReadError>,
) -> Result<T, ReadError> {
    let bytes = Source::open(path)?.read_from(0)?;
    if !bytes.starts_with(&SIGNATURE) {
        return Err(ReadError::file(path, "not an EXR file"));
    }
    only_part(path, &bytes, read)
}

fn only_part<T>(
    path: &Path,
    bytes: &[u8],
    read: impl FnOnce(&Parts<'_>) -> Result<T, ReadError>,
) -> Result<T, ReadError> {
    let decoded = catch_unwind(AssertUnwindSafe(|| {
        let parts = Parts::read(path, bytes)?;
        match parts.meta.headers.as_slice() {
            [header] if header.deep => {
                Err(ReadError::file(path, "it holds deep data; accepted: one value a pixel"))
            }
            [_] => read(&parts),
            _ => Err(ReadError::file(path, "it has several parts; accepted: one")),
        }
    }));
    decoded.unwrap_or_else(|_| Err(unsound(path, "its blocks cannot be decoded")))
}

/// What the header of the first part says, and how many pixels it holds.
fn head(parts: &Parts<'_>) -> Result<(ExrHead, usize), ReadError> {
    let (extent, count) = parts.check(0)?;
    let header = &parts.meta.headers[0];
    let attributes = header.own_attributes.other.iter().filter_map(|(name, value)| {
        let value = match value {
            ExrValue::Text(text) => AttributeValue::Text(text.to_string()),
            ExrValue::I32(i) => AttributeValue::Integer(*i),
            ExrValue::F64(x) => AttributeValue::Float(*x),
            ExrValue::FloatVec3((x, y, z)) => AttributeValue::Vector([*x, *y, *z]),
            _ => return None,
        };
        Some(Attribute::new(name.to_string(), value))
    });
    let mut attributes: Vec<Attribute> = attributes.collect();
    attributes.sort_unstable_by(|a, b| a.name.cmp(&b.name));
    let (size, origin) = windows(header);
    Ok((ExrHead { size, extent, origin, attributes }, count))
}

/// The size of the whole picture, and where a part's first pixel lies in it.
fn windows(header: &Header) -> ([u32; 2], [i32; 2]) {
    let whole = header.shared_attributes.display_window;
    let [data, display] = [header.own_attributes.layer_position, whole.position];
    let size = [whole.size.0, whole.size.1].map(|x| u32::try_from(x).unwrap_or(u32::MAX));
    (size, [data.0.saturating_sub(display.0), data.1.saturating_sub(display.1)])
}

fn reserve<T: Clone>(path: &Path, count: usize, value: T) -> Result<Vec<T>, ReadError> {
    let mut values = Vec::new();
    let reserved = values.try_reserve_exact(count);
    reserved.map_err(|_| ReadError::file(path, "the picture does not fit into memory"))?;
    values.resize(count, value);
    Ok(values)
}

/// A file whose headers are read.
struct Parts<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    meta: MetaData,
    /// Where the tables of blocks begin.
    tables: u64,
}

impl<'a> Parts<'a> {
    fn read(path: &'a Path, bytes: &'a [u8]) -> Result<Self, ReadError> {
        let mut cursor = Cursor::new(bytes);
        let meta = MetaData::read_from_buffered(&mut cursor, false).map_err(|e| bad(path, e))?;
        Ok(Self { path, bytes, meta, tables: cursor.position() })
    }

    /// The pixels across and down of a part, and their number.
    fn check(&self, part: usize) -> Result<([u32; 2], usize), ReadError> {
        let headers = &self.meta.headers;
        let checked = headers[part].validate(headers.len() > 1, &mut false, false);
        checked.map_err(|e| bad(self.path, e))?;
        check_header(self.path, &headers[part], self.bytes.len())
    }

    /// Hands the values of `channels` (by their number in the header) to `put`, line by line of each
    /// block: the number of the first pixel, which of the channels, its type and the values' bytes. The
    /// part must have been checked.
    fn decode(
        &self,
        part: usize,
        channels: &[usize],
        mut put: impl FnMut(usize, usize, SampleType, &[u8]),
    ) -> Result<(), ReadError> {
        let (path, bytes, meta) = (self.path, self.bytes, &self.meta);
        let header = &meta.headers[part];
        let (extent, count) = check_header(path, header, bytes.len())?;
        // Where the blocks of each part begin: eight bytes each, part by part.
        let before = |n: usize| meta.headers[..n].iter().map(|h| h.chunk_count as u128).sum();
        let [from, to] =
            [part, part + 1].map(before).map(|n: u128| u128::from(self.tables) + 8 * n);
        let table = match (usize::try_from(from), usize::try_from(to)) {
            (Ok(from), Ok(to)) => bytes.get(from..to),
            _ => None,
        };
        let table = table.ok_or_else(|| unsound(path, "it ends too early"))?;
        let mut placed = Placed { seen: HashSet::new(), pixels: 0 };
        for offsets in table.chunks(8 * BATCH) {
            let blocks: Vec<Option<UncompressedBlock>> = offsets
                .par_chunks_exact(8)
                .map(|offset| {
                    let offset = offset.try_into().map_or(u64::MAX, u64::from_le_bytes);
                    let chunk = find_block(path, bytes, offset, meta, part)?;
                    let decode = |c| UncompressedBlock::decompress_chunk(c, meta, false);
                    chunk.map(decode).transpose().map_err(|e| bad(path, e))
                })
                .collect::<Result<_, _>>()?;
            for block in blocks.into_iter().flatten() {
                let put = placed.put(&block, header, channels, extent, &mut put);
                put.ok_or_else(|| unsound(path, "a block is not where or what it should be"))?;
            }
        }
        if placed.pixels != count {
            return Err(unsound(path, "blocks are missing"));
        }
        Ok(())
    }
}

fn bad(path: &Path, error: exr::error::Error) -> ReadError {
    match error {
        exr::error::Error::Io(_) => unsound(path, "it ends too early"),
        other => unsound(path, other),
    }
}

/// The part that has colours, and where among its channels red, green and blue are.
fn find_colours(path: &Path, parts: &[Header]) -> Result<(usize, [usize; 3]), ReadError> {
    let find = |header: &Header, names: [&str; 3]| {
        let list = &header.channels.list;
        let at = names.map(|name| list.iter().position(|c| c.name.eq(name)));
        Some([at[0]?, at[1]?, at[2]?]).filter(|_| !header.deep)
    };
    let colours = parts.iter().enumerate().find_map(|(i, h)| Some((i, find(h, ["R", "G", "B"])?)));
    let grey = || {
        // With chromaticities beside it, it is not grey.
        let is_grey = |h: &Header| !h.channels.list.iter().any(|c| c.name.eq("RY"));
        let mut all = parts.iter().enumerate().filter(|(_, h)| is_grey(h));
        all.find_map(|(i, h)| Some((i, find(h, ["Y"; 3])?)))
    };
    if let Some(found) = colours.or_else(grey) {
        return Ok(found);
    }
    const SHOWN: usize = 12;
    let names = parts.iter().flat_map(|h| &h.channels.list).map(|c| format!("`{}`", c.name));
    let mut names: Vec<String> = names.take(SHOWN + 1).collect();
    if names.len() > SHOWN {
        names[SHOWN] = "more".to_owned();
    }
    let kind = if parts.iter().any(|h| h.deep) { "deep data and " } else { "" };
    let message = format!(
        "no colours: it has {kind}the channels {}; accepted: R, G and B, or Y alone",
        names.join(", ")
    );
    Err(ReadError::file(path, message))
}

/// The pixels across and down of a part, and their number. Refuses what cannot be in a file of
/// `length` bytes.
fn check_header(
    path: &Path,
    header: &Header,
    length: usize,
) -> Result<([u32; 2], usize), ReadError> {
    let side = |x: usize| u32::try_from(x).map_err(|_| unsound(path, "its size is impossible"));
    let extent = [side(header.layer_size.0)?, side(header.layer_size.1)?];
    if header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1)) {
        let message = "some channels have fewer values than pixels; accepted: one for each pixel";
        return Err(ReadError::file(path, message));
    }
    let pixel = header.channels.bytes_per_pixel as u128;
    let unpacked = u128::from(extent[0]) * u128::from(extent[1]) * pixel;
    let ratio = match header.compression {
        // A constant picture is 64 times smaller as cosines, before it is deflated.
        Compression::DWAA(_) | Compression::DWAB(_) => 1 << 16,
        // Deflate makes 1032 bytes of one, and PXR24 four of three.
        _ => 2048,
    };
    let count = check_size(path, extent, unpacked, length, ratio)?;
    // The length of a block is an i32 in the file.
    if let BlockDescription::Tiles(tiles) = header.blocks {
        let block = tiles.tile_size.0 as u128 * tiles.tile_size.1 as u128 * pixel;
        if block == 0 || block > i32::MAX as u128 {
            return Err(unsound(path, "its tiles have an impossible size"));
        }
    }
    Ok((extent, count))
}

/// The block at `offset`, still compressed; none where it belongs to a smaller level.
fn find_block(
    path: &Path,
    bytes: &[u8],
    offset: u64,
    meta: &MetaData,
    part: usize,
) -> Result<Option<Chunk>, ReadError> {
    let bad = || ReadError::byte(path, offset, "not a sound EXR file: no block of the picture");
    let start = usize::try_from(offset).map_err(|_| bad())?;
    let mut rest = bytes.get(start..).ok_or_else(bad)?;
    let mut number = || {
        let (head, tail) = rest.split_first_chunk::<4>()?;
        rest = tail;
        Some(i32::from_le_bytes(*head))
    };
    if meta.requirements.has_multiple_layers
        && usize::try_from(number().ok_or_else(bad)?) != Ok(part)
    {
        return Err(bad());
    }
    let tiled = matches!(meta.headers[part].blocks, BlockDescription::Tiles(_));
    let mut place = [0; 4];
    for x in &mut place[..if tiled { 4 } else { 1 }] {
        *x = number().ok_or_else(bad)?;
    }
    let length = number().and_then(|n| usize::try_from(n).ok()).ok_or_else(bad)?;
    let compressed_pixels_le = rest.get(..length).ok_or_else(bad)?.to_vec();
    let compressed_block = if tiled {
        if place[2..] != [0, 0] {
            return Ok(None);
        }
        let [x, y] = [place[0], place[1]].map(usize::try_from);
        let tile_index = Vec2(x.map_err(|_| bad())?, y.map_err(|_| bad())?);
        let coordinates = TileCoordinates { tile_index, level_index: Vec2(0, 0) };
        CompressedBlock::Tile(CompressedTileBlock { coordinates, compressed_pixels_le })
    } else {
        let y_coordinate = place[0];
        CompressedBlock::ScanLine(CompressedScanLineBlock { y_coordinate, compressed_pixels_le })
    };
    Ok(Some(Chunk { layer_index: part, compressed_block }))
}

/// What has been put into the picture.
struct Placed {
    /// First pixels of the blocks.
    seen: HashSet<(usize, usize)>,
    /// Pixels in all.
    pixels: usize,
}

impl Placed {
    /// Hands a decoded block over: line by line, of each channel by channel. None where it lies outside,
    /// has another length than its pixels need, or was there before.
    fn put(
        &mut self,
        block: &UncompressedBlock,
        header: &Header,
        channels: &[usize],
        [width, height]: [u32; 2],
        put: &mut impl FnMut(usize, usize, SampleType, &[u8]),
    ) -> Option<()> {
        let (Vec2(x, y), Vec2(columns, rows)) =
            (block.index.pixel_position, block.index.pixel_size);
        let fits =
            |at: usize, n: usize, most: u32| at.checked_add(n).is_some_and(|e| e <= most as usize);
        let whole = fits(x, columns, width) && fits(y, rows, height) && columns > 0;
        let line_bytes = columns.checked_mul(header.channels.bytes_per_pixel)?;
        if !whole || block.data.len() != line_bytes.checked_mul(rows)? || !self.seen.insert((x, y))
        {
            return None;
        }
        let list = &header.channels.list;
        let size = |c: usize| list[c].sample_type.bytes_per_sample();
        let starts: Vec<usize> =
            channels.iter().map(|c| columns * (0..*c).map(size).sum::<usize>()).collect();
        for (row, line) in block.data.chunks_exact(line_bytes).enumerate() {
            let first = (y + row) * width as usize + x;
            for (k, (&channel, &start)) in channels.iter().zip(&starts).enumerate() {
                let values = &line[start..start + columns * size(channel)];
                put(first, k, list[channel].sample_type, values);
            }
        }
        self.pixels += columns * rows;
        Some(())
    }
}

/// The value that `bytes` begin with.
fn sample(kind: SampleType, bytes: &[u8]) -> f32 {
    match (kind, bytes) {
        (SampleType::F16, &[a, b, ..]) => f16::from_ne_bytes([a, b]).to_f32(),
        (SampleType::F32, &[a, b, c, d, ..]) => f32::from_ne_bytes([a, b, c, d]),
        (SampleType::U32, &[a, b, c, d, ..]) => u32::from_ne_bytes([a, b, c, d]) as f32,
        _ => f32::NAN,
    }
}
