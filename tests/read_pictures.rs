//! Pictures of other kinds than we write, and broken ones, through the library.
#![allow(missing_docs, reason = "a test program")]

use std::io::Cursor;
use std::path::Path;

use alhazen::color::{Rgb, linear_from_srgb};
use alhazen::film::{Film, PixelRect};
use alhazen::io::{ExrCompression, ExrOptions, PixelType, read_picture, read_png, write_exr};
use exr::prelude::*;

mod common;
use common::{Random, verify};

/// A file of one part with these channels, 5 × 3.
fn with_channels(channels: Vec<AnyChannel<FlatSamples>>, encoding: Encoding) -> Vec<u8> {
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let attributes = LayerAttributes::named("main");
    bytes(&Image::from_layer(Layer::new((5, 3), attributes, encoding, channels)))
}

fn bytes<L>(image: &Image<L>) -> Vec<u8>
where
    L: for<'s> exr::image::write::layers::WritableLayers<'s> + Sync,
{
    let mut bytes = Vec::new();
    image.write().non_parallel().to_buffered(Cursor::new(&mut bytes)).unwrap();
    bytes
}

fn floats(name: &str, first: f32) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, FlatSamples::F32((0..15).map(|i| first + i as f32).collect()))
}

fn read(bytes: &[u8]) -> std::result::Result<alhazen::film::Picture, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p");
    std::fs::write(&path, bytes).unwrap();
    let text = |e: alhazen::io::ReadError| {
        e.to_string().replace(folder.path().to_str().unwrap_or_default(), "")
    };
    read_picture(&path).map_err(text)
}

#[test]
fn channels_of_every_type_and_order() {
    let half = (0..15).map(|i| f16::from_f32(100.0 + i as f32)).collect();
    let file = with_channels(
        vec![
            floats("R", 0.0),
            AnyChannel::new("G", FlatSamples::F16(half)),
            AnyChannel::new("B", FlatSamples::U32((200..215).collect())),
            floats("A", 0.5),
            floats("Z", -7.0),
            floats("diffuse.R", -8.0),
        ],
        Encoding::FAST_LOSSLESS,
    );
    let picture = read(&file).unwrap();
    assert_eq!((picture.extent, picture.origin), ([5, 3], Some([0, 0])));
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let i = i as f32;
        assert_eq!(*pixel, Rgb::new(i, 100.0 + i, 200.0 + i));
    }
}

#[test]
fn luminance_is_grey() {
    let picture = read(&with_channels(vec![floats("Y", 3.0)], Encoding::UNCOMPRESSED)).unwrap();
    assert_eq!(picture.pixels[4], Rgb::splat(7.0));
}

#[test]
fn without_colours_the_channels_are_named() {
    let file = with_channels(vec![floats("Z", 0.0), floats("R", 0.0)], Encoding::UNCOMPRESSED);
    let message = read(&file).unwrap_err();
    assert!(
        message.ends_with(
            "no colours: it has the channels `R`, `Z`; accepted: R, G and B, or Y alone"
        ),
        "{message}"
    );
    let chroma = vec![floats("Y", 0.0), floats("RY", 0.0), floats("BY", 0.0)];
    assert!(read(&with_channels(chroma, Encoding::UNCOMPRESSED)).unwrap_err().contains("`RY`"));
}

#[test]
fn the_first_part_with_plain_colours_is_read() {
    let part = |name: &str, channels: [&str; 3], first: f32, size: (usize, usize)| {
        let values = |x: f32| FlatSamples::F32(vec![x; size.0 * size.1]);
        let channels = (0..3).map(|i| AnyChannel::new(channels[i], values(first + i as f32)));
        let channels = AnyChannels::sort(channels.collect());
        let mut attributes = LayerAttributes::named(name);
        attributes.layer_position = Vec2(-3, 2);
        Layer::new(size, attributes, Encoding::FAST_LOSSLESS, channels)
    };
    let display = IntegerBounds::new((-1, 1), (10, 10));
    let layers = [
        part("normals", ["N.X", "N.Y", "N.Z"], 0.0, (70, 70)),
        part("beauty", ["R", "G", "B"], 10.0, (6, 40)),
        part("other", ["R", "G", "B"], 20.0, (9, 9)),
    ];
    let image = Image::from_layers(ImageAttributes::new(display), layers.as_slice());
    let picture = read(&bytes(&image)).unwrap();
    assert_eq!((picture.size, picture.extent), ([10, 10], [6, 40]));
    assert_eq!(picture.origin, Some([-2, 1]));
    assert!(picture.pixels.iter().all(|&p| p == Rgb::new(10.0, 11.0, 12.0)));
}

#[test]
fn tiles_are_put_together() {
    for line_order in [LineOrder::Increasing, LineOrder::Unspecified] {
        let encoding = Encoding {
            compression: Compression::RLE,
            blocks: Blocks::Tiles(Vec2(2, 2)),
            line_order,
        };
        let channels = ["R", "G", "B"].map(|name| floats(name, 1.0)).to_vec();
        let picture = read(&with_channels(channels, encoding)).unwrap();
        for (i, pixel) in picture.pixels.iter().enumerate() {
            assert_eq!(*pixel, Rgb::splat(1.0 + i as f32));
        }
    }
}

fn png(colour: png::ColorType, depth: png::BitDepth, palette: &[u8], data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if !palette.is_empty() {
        encoder.set_palette(palette);
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn pngs_of_every_kind() {
    use png::{BitDepth, ColorType};
    let linear = |x: f32, most: f32| linear_from_srgb(x / most);
    let rgb = |r: u8, g: u8, b: u8| Rgb::from([r, g, b].map(|x| linear(x.into(), 255.0)));
    let check = |file: Vec<u8>, first: Rgb, second: Rgb| {
        let picture = read(&file).unwrap();
        assert_eq!((picture.size, picture.extent, picture.origin), ([2, 1], [2, 1], None));
        assert_eq!(picture.pixels, [first, second]);
    };
    let (two, six) = (rgb(1, 128, 255), rgb(4, 5, 6));
    check(png(ColorType::Rgb, BitDepth::Eight, &[], &[1, 128, 255, 4, 5, 6]), two, six);
    check(png(ColorType::Rgba, BitDepth::Eight, &[], &[1, 128, 255, 0, 4, 5, 6, 9]), two, six);
    check(png(ColorType::Indexed, BitDepth::One, &[1, 128, 255, 4, 5, 6], &[0x40]), two, six);
    let grey = |x: u8| rgb(x, x, x);
    check(png(ColorType::Grayscale, BitDepth::Eight, &[], &[7, 200]), grey(7), grey(200));
    check(png(ColorType::Grayscale, BitDepth::Four, &[], &[0x1f]), grey(17), grey(255));
    check(png(ColorType::GrayscaleAlpha, BitDepth::Eight, &[], &[7, 1, 9, 2]), grey(7), grey(9));
    let wide = Rgb::new(linear(258.0, 65535.0), 0.0, 1.0);
    check(
        png(ColorType::Rgb, BitDepth::Sixteen, &[], &[1, 2, 0, 0, 255, 255, 0, 0, 0, 0, 0, 0]),
        wide,
        Rgb::BLACK,
    );
}

#[test]
fn broken_pngs_are_errors() {
    let good = png(png::ColorType::Rgb, png::BitDepth::Eight, &[], &[1, 128, 255, 4, 5, 6]);
    for length in 1..good.len() - 12 {
        assert!(read(&good[..length]).is_err(), "{length} bytes");
    }
    // A header alone may claim four thousand million pixels.
    let mut huge = good.clone();
    huge[16..24].copy_from_slice(&[0, 0, 255, 255, 0, 0, 255, 255]);
    let crc = crc(&huge[12..29]).to_be_bytes();
    huge[29..33].copy_from_slice(&crc);
    let message = read(&huge).unwrap_err();
    assert!(
        message.contains("65535 x 65535 pixels; at most 65535 a side and 268435456 in all"),
        "{message}"
    );
    huge[16..24].copy_from_slice(&[0, 0, 8, 0, 0, 0, 8, 0]);
    let crc = self::crc(&huge[12..29]).to_be_bytes();
    huge[29..33].copy_from_slice(&crc);
    let message = read(&huge).unwrap_err();
    assert!(message.contains("the file ends too early: 2048 x 2048 pixels"), "{message}");
    assert!(read_png(Path::new("/nowhere.png")).is_err());
}

/// The checksum of a PNG chunk. Source: PNG specification, annex D.
fn crc(bytes: &[u8]) -> u32 {
    let step = |c: u32| if c & 1 == 1 { 0xedb8_8320 ^ c >> 1 } else { c >> 1 };
    !bytes.iter().fold(!0, |c, &b| (0..8).fold(c ^ u32::from(b), |c, _| step(c)))
}

fn small_exr(compression: ExrCompression, pixel_type: PixelType) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.exr");
    let size = [9, 40];
    let mut film = Film::new(size, PixelRect::whole(size), false);
    for (i, pixel) in film.mean.iter_mut().enumerate() {
        *pixel = Rgb::new(i as f32 / 3.0, (i as f32).sin(), 0.5);
    }
    write_exr(&path, &film, &[], &ExrOptions { pixel_type, compression, ..ExrOptions::default() })
        .unwrap();
    std::fs::read(&path).unwrap()
}

/// Where the value of an attribute of a header begins.
fn value_of(file: &[u8], name: &str, kind: &str) -> usize {
    let text = format!("{name}\0{kind}\0");
    file.windows(text.len()).position(|w| w == text.as_bytes()).unwrap() + text.len() + 4
}

#[test]
fn exrs_that_claim_too_much_are_errors() {
    let good = small_exr(ExrCompression::Zip, PixelType::Half);
    let sized = |width: i32, height: i32| {
        let mut file = good.clone();
        let at = value_of(&file, "dataWindow", "box2i");
        file[at + 8..at + 12].copy_from_slice(&(width - 1).to_le_bytes());
        file[at + 12..at + 16].copy_from_slice(&(height - 1).to_le_bytes());
        read(&file).unwrap_err()
    };
    assert!(sized(1_000_000, 1_000_000).contains("accepted: at most 268435456 in all"));
    assert!(sized(9000, 9000).contains("is too short for a picture of 9000 x 9000 pixels"));
    assert!(sized(9, 400).contains("not a sound EXR file"));
    for (width, height) in [(0, 40), (-5, 40), (i32::MIN + 1, 1), (i32::MAX, i32::MAX)] {
        assert!(sized(width, height).contains(": "));
    }
    assert!(read(&good).is_ok());
    for length in 5..good.len() {
        assert!(read(&good[..length]).is_err(), "{length} bytes");
    }
}

/// Tiled ones, one of several parts, and the cosines of DWA, which we do not write.
fn foreign_exrs() -> Vec<Vec<u8>> {
    let channels = || ["R", "G", "B"].map(|name| floats(name, 1.0)).to_vec();
    let blocks = Blocks::Tiles(Vec2(2, 3));
    let tiled = |compression| {
        let line_order = LineOrder::Increasing;
        with_channels(channels(), Encoding { compression, blocks, line_order })
    };
    let part = |name: &str| {
        let channels = AnyChannels::sort(channels().into_iter().collect());
        Layer::new((5, 3), LayerAttributes::named(name), Encoding::FAST_LOSSLESS, channels)
    };
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((5, 3)));
    let parts = bytes(&Image::from_layers(attributes, [part("a"), part("b")].as_slice()));
    let scan_lines =
        Encoding { compression: Compression::DWAA(None), ..Encoding::SMALL_FAST_LOSSLESS };
    let half = |name: &str| {
        let values = (0..15).map(|i| f16::from_f32(i as f32 / 15.0)).collect();
        AnyChannel::new(name, FlatSamples::F16(values))
    };
    let dwa = with_channels(["R", "G", "B"].map(half).to_vec(), scan_lines);
    vec![tiled(Compression::ZIP16), tiled(Compression::PIZ), parts, dwa]
}

/// Bytes changed at random: never a panic that ends the program, never much memory.
#[test]
fn broken_exrs_are_errors_or_pictures() {
    let rounds = if verify() { 5000 } else { 400 };
    let mut random = Random(1);
    let mut files = foreign_exrs();
    for compression in ExrCompression::ALL {
        files.extend(PixelType::ALL.map(|kind| small_exr(compression, kind)));
    }
    for good in files {
        assert!(read(&good).is_ok(), "before it is broken");
        for _ in 0..rounds {
            let mut file = good.clone();
            for _ in 0..1 + random.below(4) {
                let at = 4 + random.below(file.len() - 4);
                file[at] = random.bits() as u8;
            }
            if random.below(4) == 0 {
                file.truncate(4 + random.below(good.len() - 4));
            }
            if let Ok(picture) = read(&file) {
                let [w, h] = picture.extent;
                assert_eq!(picture.pixels.len(), w as usize * h as usize);
                assert!(picture.pixels.len() < 1_000_000);
            }
        }
    }
}
