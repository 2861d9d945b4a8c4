//! Pictures that the tests write themselves, whole, cut short and damaged.

use std::io::Cursor;

use ::exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage,
    f16,
};

use super::*;
use crate::color::{Rgb, linear_from_srgb};

fn read(bytes: &[u8], space: Option<ColorSpace>) -> Result<ImageFile, ReadError> {
    decode(Path::new("picture"), bytes, space)
}

fn message(bytes: &[u8]) -> String {
    read(bytes, None).err().map_or_else(|| "no error".to_owned(), |e| e.to_string())
}

fn write_png(
    size: [u32; 2],
    color: ::png::ColorType,
    depth: ::png::BitDepth,
    bytes: &[u8],
    palette: Option<&[u8]>,
) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut file, size[0], size[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if let Some(palette) = palette {
        encoder.set_palette(palette.to_vec());
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(bytes).unwrap();
    writer.finish().unwrap();
    file
}

fn srgb(bytes: [u8; 3]) -> Rgb {
    Rgb::from(bytes.map(|b| linear_from_srgb(f32::from(b) / 255.0)))
}

fn small_png() -> Vec<u8> {
    use ::png::{BitDepth::Eight, ColorType::Rgb};
    write_png([2, 2], Rgb, Eight, &[255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 99, 188], None)
}

#[test]
fn png_of_every_kind() {
    use ::png::{BitDepth, ColorType};
    let file = read(&small_png(), None).unwrap();
    assert_eq!(file.image.size(), [2, 2]);
    assert!(file.warnings.is_empty());
    assert_eq!(file.image.texel(0, 0), Rgb::new(1.0, 0.0, 0.0));
    assert_eq!(file.image.texel(1, 1), srgb([9, 99, 188]));
    let file = read(&small_png(), Some(ColorSpace::Linear)).unwrap();
    assert_eq!(file.image.texel(1, 1).g, 99.0 / 255.0);

    // Fewer bits are stretched to the whole range.
    for (depth, byte) in [(BitDepth::One, 0x40), (BitDepth::Two, 0x30), (BitDepth::Four, 0x0f)] {
        let bytes = write_png([2, 1], ColorType::Grayscale, depth, &[byte], None);
        let file = read(&bytes, None).unwrap();
        assert_eq!(file.image.channels(), 1);
        assert_eq!(file.image.texel(0, 0), Rgb::BLACK);
        assert_eq!(file.image.texel(1, 0), Rgb::splat(1.0));
    }

    let palette = [1, 2, 3, 40, 50, 60];
    let bytes = write_png([2, 1], ColorType::Indexed, BitDepth::Eight, &[1, 0], Some(&palette));
    let file = read(&bytes, None).unwrap();
    assert_eq!([0, 1].map(|x| file.image.texel(x, 0)), [srgb([40, 50, 60]), srgb([1, 2, 3])]);

    let words: Vec<u8> = [0_u16, 12_345, 65_535].iter().flat_map(|w| w.to_be_bytes()).collect();
    let bytes = write_png([1, 1], ColorType::Rgb, BitDepth::Sixteen, &words, None);
    let expected = 12_345.0 / 65_535.0;
    let texel = read(&bytes, Some(ColorSpace::Linear)).unwrap().image.texel(0, 0);
    assert!((texel.g - expected).abs() < 1e-7 && texel.b == 1.0);
    let texel = read(&bytes, None).unwrap().image.texel(0, 0);
    let expected = linear_from_srgb(expected);
    assert!((texel.g - expected).abs() < expected / 2000.0 && texel.b == 1.0);
}

#[test]
fn alpha_is_ignored_and_told() {
    use ::png::{BitDepth, ColorType};
    let bytes = [10, 20, 30, 255, 40, 50, 60, 128];
    let file =
        read(&write_png([2, 1], ColorType::Rgba, BitDepth::Eight, &bytes, None), None).unwrap();
    assert_eq!([0, 1].map(|x| file.image.texel(x, 0)), [srgb([10, 20, 30]), srgb([40, 50, 60])]);
    assert_eq!(file.warnings, ["its alpha channel was ignored"]);
    let opaque = [0x12, 0x34, 255, 255];
    let bytes = write_png([1, 1], ColorType::GrayscaleAlpha, BitDepth::Sixteen, &opaque, None);
    let file = read(&bytes, Some(ColorSpace::Linear)).unwrap();
    assert!(file.warnings.is_empty());
    assert!((file.image.texel(0, 0).r - f32::from(0x1234_u16) / 65535.0).abs() < 1e-7);
}

fn from_hex(text: &str) -> Vec<u8> {
    let digit = |b: u8| (b as char).to_digit(16).unwrap() as u8;
    text.as_bytes().as_chunks::<2>().0.iter().map(|&[a, b]| digit(a) << 4 | digit(b)).collect()
}

#[test]
fn jpeg_of_every_kind() {
    let near = |a: Rgb, bytes: [u8; 3]| {
        let error = (0..3).map(|i| (a.to_array()[i] - srgb(bytes).to_array()[i]).abs());
        assert!(error.fold(0.0, f32::max) < 0.04, "{a:?} {bytes:?}");
    };
    for text in [BASELINE, PROGRESSIVE] {
        let image = read(&from_hex(text), None).unwrap().image;
        assert_eq!((image.size(), image.channels()), ([20, 12], 3));
        near(image.texel(3, 3), [220, 40, 30]);
        near(image.texel(16, 8), [20, 60, 200]);
    }
    let image = read(&from_hex(GREY), None).unwrap().image;
    assert_eq!((image.size(), image.channels()), ([20, 12], 1));
    near(image.texel(3, 3), [93; 3]);
}

const HDR_HEADER: &str = "#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\n\n";

fn hdr(header: &str, pixels: &[u8]) -> Vec<u8> {
    [header.as_bytes(), pixels].concat()
}

/// 9 × 2 pixels: a run and single bytes in each row.
fn small_hdr() -> Vec<u8> {
    let mut row = vec![2, 2, 0, 9];
    // Red 128 eight times and 64; green counts; blue nothing; exponent 129.
    row.extend([136, 128, 1, 64]);
    row.extend([9, 0, 1, 2, 3, 4, 5, 6, 7, 8]);
    row.extend([137, 0, 137, 129]);
    hdr(&format!("{HDR_HEADER}-Y 2 +X 9\n"), &row.repeat(2))
}

#[test]
fn radiance_of_every_kind() {
    let image = read(&small_hdr(), None).unwrap().image;
    assert_eq!(image.size(), [9, 2]);
    for y in 0..2 {
        assert_eq!(image.texel(7, y), Rgb::new(1.0, 7.0 / 128.0, 0.0));
        assert_eq!(image.texel(8, y), Rgb::new(0.5, 8.0 / 128.0, 0.0));
    }
    // Without runs; exponent 0 is black.
    let plain = [128, 0, 0, 129, 0, 128, 0, 130, 9, 9, 9, 0, 0, 0, 64, 128];
    let colors = |header: &str| {
        let image = read(&hdr(&format!("{HDR_HEADER}{header}\n"), &plain), None).unwrap().image;
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| image.texel(x, y))
    };
    let [red, green, black, blue] =
        [Rgb::new(1.0, 0.0, 0.0), Rgb::new(0.0, 2.0, 0.0), Rgb::BLACK, Rgb::new(0.0, 0.0, 0.25)];
    assert_eq!(colors("-Y 2 +X 2"), [red, green, black, blue]);
    assert_eq!(colors("-Y 2 -X 2"), [green, red, blue, black]);
    assert_eq!(colors("+Y 2 +X 2"), [black, blue, red, green]);
    // Runs of the old kind: one pixel, then 1 + 256 of it.
    let old = [128, 0, 0, 129, 1, 1, 1, 1, 1, 1, 1, 1];
    let image = read(&hdr(&format!("{HDR_HEADER}-Y 1 +X 258\n"), &old), None).unwrap().image;
    assert!((0..258).all(|x| image.texel(x, 0) == red));
    // Exposures are undone.
    let header = HDR_HEADER.replace("# made by hand", "EXPOSURE=4\nEXPOSURE= 0.5");
    let file = read(&hdr(&format!("{header}-Y 1 +X 1\n"), &plain[..4]), None).unwrap();
    assert_eq!(file.image.texel(0, 0).r, 0.5);
    assert_eq!(file.warnings, ["its values were divided by its exposure of 2"]);
}

fn write_exr(size: [usize; 2], channels: Vec<(&str, FlatSamples)>, encoding: Encoding) -> Vec<u8> {
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples));
    let channels = AnyChannels::sort(channels.collect());
    let attributes = LayerAttributes::default();
    let layer = Layer::new((size[0], size[1]), attributes, encoding, channels);
    let mut file = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut file).unwrap();
    file.into_inner()
}

fn exr_encodings() -> [Encoding; 4] {
    use ::exr::prelude::{Blocks, Compression, Vec2};
    let tiled = Encoding {
        compression: Compression::PIZ,
        blocks: Blocks::Tiles(Vec2(3, 2)),
        ..Encoding::UNCOMPRESSED
    };
    let zip = Encoding { compression: Compression::ZIP16, ..Encoding::UNCOMPRESSED };
    [Encoding::UNCOMPRESSED, Encoding::FAST_LOSSLESS, zip, tiled]
}

fn small_exr(encoding: Encoding) -> Vec<u8> {
    let values = |k: usize| (0..20).map(move |i| (i * 3 + k) as f32 / 8.0);
    let halves = |k| FlatSamples::F16(values(k).map(f16::from_f32).collect());
    let depth = FlatSamples::F32(vec![f32::NAN; 20]);
    write_exr(
        [5, 4],
        vec![("R", halves(0)), ("G", halves(1)), ("B", halves(2)), ("Z", depth)],
        encoding,
    )
}

#[test]
fn exr_of_every_kind() {
    for encoding in exr_encodings() {
        let file = read(&small_exr(encoding), None).unwrap();
        assert_eq!((file.image.size(), file.image.channels()), ([5, 4], 3));
        assert!(matches!(file.image.pixels(), Pixels::Half(_)));
        assert!(file.warnings.is_empty(), "{:?}", file.warnings);
        for i in 0..20 {
            let [r, g, b] = [0, 1, 2].map(|k| (i * 3 + k) as f32 / 8.0);
            assert_eq!(file.image.texel(i % 5, i / 5), Rgb::new(r, g, b));
        }
    }
    let values = FlatSamples::F32(vec![1e6, f32::NAN, -0.25, f32::INFINITY]);
    let bytes = write_exr([4, 1], vec![("Y", values)], Encoding::UNCOMPRESSED);
    let file = read(&bytes, None).unwrap();
    assert_eq!([0, 1, 2, 3].map(|x| file.image.texel(x, 0).r), [1e6, 0.0, -0.25, 0.0]);
    assert_eq!(file.warnings, ["2 values are NaN or infinite and became 0"]);
    let depth = FlatSamples::F32(vec![1.0]);
    let bytes = write_exr([1, 1], vec![("Z", depth)], Encoding::UNCOMPRESSED);
    let expected = "picture: no colours: it has the channels `Z`; accepted: R, G and B, or Y alone";
    assert_eq!(message(&bytes), expected);
}

/// One file of each kind.
fn samples() -> Vec<Vec<u8>> {
    let mut samples =
        vec![small_png(), from_hex(BASELINE), from_hex(PROGRESSIVE), from_hex(GREY), small_hdr()];
    samples.extend(exr_encodings().map(small_exr));
    samples
}

#[test]
fn files_cut_short_are_errors() {
    for (i, bytes) in samples().into_iter().enumerate() {
        for len in 0..bytes.len() {
            let text = message(&bytes[..len]);
            assert!(text.starts_with("picture: "), "{i}: {len} of {}: {text}", bytes.len());
        }
    }
}

#[test]
fn damaged_files_do_not_panic() {
    for bytes in samples() {
        for i in 0..bytes.len() {
            let mut damaged = bytes.clone();
            for byte in [0, 1, 0x7f, 0x80, 0xff, !bytes[i], bytes[i] ^ 1, bytes[i] ^ 0x10] {
                damaged[i] = byte;
                if let Err(error) = read(&damaged, None) {
                    assert!(error.to_string().starts_with("picture: "));
                }
            }
        }
    }
}

#[test]
fn claims_beyond_the_file_are_refused_before_memory_is_asked_for() {
    // A PNG header alone, with a right checksum: 60000 x 4000 of four channels of 16 bits.
    let mut bytes = small_png();
    bytes[16..20].copy_from_slice(&60_000_u32.to_be_bytes());
    bytes[20..24].copy_from_slice(&4000_u32.to_be_bytes());
    let crc = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(
        message(&bytes).contains("the file ends too early: 60000 x 4000"),
        "{}",
        message(&bytes)
    );
    bytes[16..20].copy_from_slice(&70_000_u32.to_be_bytes());
    let crc = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(message(&bytes).contains("at most 65535 a side"), "{}", message(&bytes));

    let mut bytes = from_hex(BASELINE);
    let frame = bytes.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    bytes[frame + 5..frame + 9].copy_from_slice(&[0x7f, 0xff, 0x20, 0]);
    assert!(message(&bytes).contains("8192 x 32767 pixels need"), "{}", message(&bytes));

    let bytes = hdr(&format!("{HDR_HEADER}-Y 60000 +X 4000\n"), &[2, 2, 0, 9]);
    assert!(message(&bytes).contains("4000 x 60000 pixels need"), "{}", message(&bytes));

    // The data window's right and lower ends.
    for encoding in exr_encodings() {
        let mut bytes = small_exr(encoding);
        let window = bytes.windows(10).position(|w| w == b"dataWindow").unwrap() + 21;
        bytes[window + 8..window + 10].copy_from_slice(&16_000_u16.to_le_bytes());
        bytes[window + 12..window + 14].copy_from_slice(&16_000_u16.to_le_bytes());
        assert!(
            message(&bytes).contains("bytes is too short for a picture of "),
            "{}",
            message(&bytes)
        );
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| c >> 1 ^ (0xedb8_8320 & (c & 1).wrapping_neg()))
    })
}

#[test]
fn other_files_are_named_with_what_is_accepted() {
    let expected =
        "picture: not a picture of a known kind; accepted: PNG, JPEG, Radiance HDR, OpenEXR";
    assert_eq!(message(b"ply\nformat ascii 1.0\n"), expected);
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n";
    let expected = "picture: at byte 11: format `32-bit_rle_xyze`; accepted: 32-bit_rle_rgbe";
    assert_eq!(message(header.as_bytes()), expected);
    assert!(read_image(Path::new("/nowhere.png"), None).is_err());
    let path = std::env::temp_dir().join(format!("alhazen-{}-picture", std::process::id()));
    std::fs::write(&path, small_png()).unwrap();
    assert_eq!(read_image(&path, None).unwrap().image.size(), [2, 2]);
    std::fs::write(&path, "x").unwrap();
    assert!(read_image(&path, None).is_err());
    std::fs::remove_file(&path).unwrap();
}

/// 20 × 12 pixels, the left half (220, 40, 30), the right half (20, 60, 200), in hexadecimal.
const BASELINE: &str = "\
    ffd8ffe000104a46494600010100000100010000ffdb0043000503040404030504040405050506070c080707\
    07070f0b0b090c110f1212110f111113161c1713141a1511111821181a1d1d1f1f1f13172224221e241c1e1f\
    1effdb0043010505050706070e08080e1e1411141e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e\
    1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1effc0001108000c0014030111000211010311\
    01ffc4001500010100000000000000000000000000000604ffc4001a10000105010000000000000000000000\
    00000103053581b1ffc4001501010100000000000000000000000000000806ffc4001c110001040301000000\
    000000000000000000020682b203043536ffda000c03010002110311003f000e438920e4cd93b9c410cc6e0e\
    095d41b1ff00e83623449215a470b8260c40e4cd93b9c410cc6e0e095d41b1ff00e83623449215a471ffd9";

/// The same, progressive, with a quarter of the colours.
const PROGRESSIVE: &str = "\
    ffd8ffe000104a46494600010100000100010000ffdb0043000503040404030504040405050506070c080707\
    07070f0b0b090c110f1212110f111113161c1713141a1511111821181a1d1d1f1f1f13172224221e241c1e1f\
    1effdb0043010505050706070e08080e1e1411141e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e\
    1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1e1effc2001108000c0014030122000211010311\
    01ffc400160001010100000000000000000000000000050003ffc40015010101000000000000000000000000\
    00000603ffda000c030100021003100000010cd48daa4caa700bffc400171000030100000000000000000000\
    00000000033310ffda00080101000105021d4c750fffc4001a11000007000000000000000000000000000102\
    06103472c1ffda0008010301013f0154c42db05bffc4001a1100000700000000000000000000000000010206\
    103472c1ffda0008010201013f014d4a35741bffc400161001010100000000000000000000000000011000ff\
    da0008010100063f02cd67ffc40014100100000000000000000000000000000020ffda0008010100013f2149\
    7fffda000c03010002000300000010582fffc40015110101000000000000000000000000000010a1ffda0008\
    010301013f10883fffc40015110101000000000000000000000000000010a1ffda0008010201013f10b81fff\
    c400171001010101000000000000000000000000b1011000ffda0008010100013f10e2934a4cffd9";

/// The same in grey: 93 on the left.
const GREY: &str = "\
    ffd8ffe000104a46494600010100000100010000ffdb0043000503040404030504040405050506070c080707\
    07070f0b0b090c110f1212110f111113161c1713141a1511111821181a1d1d1f1f1f13172224221e241c1e1f\
    1effc0000b08000c001401011100ffc4001500010100000000000000000000000000000604ffc4001a100001\
    0501000000000000000000000000000103053581b1ffda0008010100003f000e1c99b277388482e0e4cd93b9\
    c4243fffd9";
