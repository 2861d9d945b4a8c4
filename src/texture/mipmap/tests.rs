//! Pyramids against plain averages, and lookups against what pictures hold.

use super::*;

/// A number from 0 to 1 without pattern.
fn number(i: usize) -> f32 {
    let mut x = (i as u32).wrapping_mul(0x9e37_79b9) ^ 0x5bd1_e995;
    x = (x ^ (x >> 15)).wrapping_mul(0x2c1b_3c6d);
    (x ^ (x >> 13)) as f32 / u32::MAX as f32
}

fn all_kinds(n: usize) -> [Pixels; 5] {
    let bytes: Vec<u8> = (0..n).map(|i| (number(i) * 255.0) as u8).collect();
    let words = (0..n).map(|i| (number(i) * 65535.0) as u16).collect();
    let floats: Vec<f32> = (0..n).map(|i| number(i) * 10.0).collect();
    [
        Pixels::Srgb8(bytes.clone()),
        Pixels::Linear8(bytes),
        Pixels::Linear16(words),
        Pixels::half_or_float(floats.clone()),
        Pixels::Float(floats),
    ]
}

fn mean(level: &ImageData) -> f64 {
    let n = level.pixels().len();
    (0..n).map(|i| f64::from(level.value(i))).sum::<f64>() / n as f64
}

#[test]
fn every_level_has_the_pictures_mean() {
    for size in [[64, 64], [37, 53], [1, 100], [255, 3], [5, 5]] {
        for channels in [1, 3] {
            for pixels in all_kinds((size[0] * size[1]) as usize * channels) {
                let tolerance = match pixels {
                    Pixels::Half(_) => 1e-3,
                    _ => 5e-5,
                };
                let map = MipMap::new(ImageData::new(size, channels, pixels).unwrap());
                let expected = mean(&map.levels()[0]);
                for level in map.levels() {
                    let error = (mean(level) - expected).abs() / expected;
                    assert!(error < tolerance, "{size:?}: {:?}: {error}", level.size());
                }
                assert_eq!(map.levels().last().unwrap().size(), [1, 1]);
            }
        }
    }
}

#[test]
fn odd_sizes_share_the_middle_by_area() {
    // Five pixels to two: each new one is two old ones and half of the middle.
    let pixels = Pixels::Float(vec![1.0, 2.0, 4.0, 8.0, 16.0]);
    let map = MipMap::new(ImageData::new([5, 1], 1, pixels).unwrap());
    let level = &map.levels()[1];
    assert_eq!(level.size(), [2, 1]);
    assert!((level.texel(0, 0).r - (1.0 + 2.0 + 2.0) / 2.5).abs() < 1e-6);
    assert!((level.texel(1, 0).r - (2.0 + 8.0 + 16.0) / 2.5).abs() < 1e-6);
}

#[test]
fn a_fine_checker_from_afar_is_half_the_light() {
    let bytes = (0..64 * 64 * 3).map(|i| if (i / 3 + i / 192) % 2 == 0 { 255 } else { 0 });
    let data = ImageData::new([64, 64], 3, Pixels::Srgb8(bytes.collect())).unwrap();
    let map = MipMap::new(data);
    for texels in [2.0, 3.7, 64.0, 1e9, f64::INFINITY] {
        let color = map.trilinear(DVec2::new(0.3, 0.6), Wrap::Repeat, texels);
        assert!((color.g - 0.5).abs() < 1e-5, "{texels}: {color:?}");
    }
}

/// 2 × 2: 1 2 above 3 4.
fn numbered() -> MipMap {
    MipMap::new(ImageData::new([2, 2], 1, Pixels::Float(vec![1.0, 2.0, 3.0, 4.0])).unwrap())
}

#[test]
fn v_points_up_and_centres_are_exact() {
    let map = numbered();
    for (u, v, expected) in [(0.25, 0.25, 3.0), (0.75, 0.25, 4.0), (0.25, 0.75, 1.0)] {
        for wrap in Wrap::ALL {
            assert_eq!(map.bilinear(DVec2::new(u, v), wrap).r, expected);
            assert_eq!(map.nearest(DVec2::new(u, v), wrap).r, expected);
            assert_eq!(map.trilinear(DVec2::new(u, v), wrap, 1.0).r, expected);
        }
    }
    assert_eq!(map.bilinear(DVec2::new(0.5, 0.5), Wrap::Repeat).r, 2.5);
    assert_eq!(map.trilinear(DVec2::new(0.25, 0.25), Wrap::Repeat, 2.0).r, 2.5);
    let half_way = map.trilinear(DVec2::new(0.25, 0.25), Wrap::Repeat, 2.0_f64.sqrt()).r;
    assert!((half_way - 2.75).abs() < 1e-6);
}

#[test]
fn centres_are_exact_at_any_size() {
    let size = [37, 23];
    let values: Vec<f32> = (0..37 * 23).map(number).collect();
    let map = MipMap::new(ImageData::new(size, 1, Pixels::Float(values)).unwrap());
    for y in 0..23 {
        for x in 0..37 {
            let u = (f64::from(x) + 0.5) / 37.0;
            let v = 1.0 - (f64::from(y) + 0.5) / 23.0;
            let expected = map.levels()[0].texel(x as usize, y as usize).r;
            for (u, v) in [(u, v), (u + 3.0, v - 2.0)] {
                let uv = DVec2::new(u, v);
                assert!((map.bilinear(uv, Wrap::Repeat).r - expected).abs() < 1e-6);
                assert_eq!(map.nearest(uv, Wrap::Repeat).r, expected);
            }
        }
    }
}

#[test]
fn beyond_the_edges() {
    let map = numbered();
    let row = |wrap| {
        [-0.75, -0.25, 0.25, 0.75, 1.25, 1.75, 2.25].map(|u| {
            let uv = DVec2::new(u, 0.75);
            assert_eq!(map.bilinear(uv, wrap), map.nearest(uv, wrap));
            map.bilinear(uv, wrap).r
        })
    };
    assert_eq!(row(Wrap::Repeat), [1.0, 2.0, 1.0, 2.0, 1.0, 2.0, 1.0]);
    assert_eq!(row(Wrap::Clamp), [1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0]);
    assert_eq!(row(Wrap::Mirror), [2.0, 1.0, 1.0, 2.0, 2.0, 1.0, 1.0]);
    // Edges: half of each neighbour where it repeats, the edge's own pixel otherwise.
    let edge = |wrap| map.bilinear(DVec2::new(0.0, 0.75), wrap).r;
    assert_eq!(Wrap::ALL.map(edge), [1.5, 1.0, 1.0]);
    // The upper edge belongs to the bottom row of the next copy.
    assert_eq!(map.nearest(DVec2::new(0.25, 1.0), Wrap::Repeat).r, 3.0);
    assert_eq!(map.nearest(DVec2::new(0.25, 1.0), Wrap::Clamp).r, 1.0);
    assert_eq!(map.nearest(DVec2::new(0.25, 1.0), Wrap::Mirror).r, 1.0);
}

#[test]
fn any_coordinates_are_taken() {
    let map = numbered();
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 1e18, -1e-300];
    for u in odd {
        for v in odd {
            for wrap in Wrap::ALL {
                let uv = DVec2::new(u, v);
                assert!((1.0..=4.0).contains(&map.nearest(uv, wrap).r));
                for texels in odd {
                    assert!((1.0..=4.0).contains(&map.trilinear(uv, wrap, texels).r));
                    assert!(map.slope(uv, wrap, texels).is_finite());
                }
            }
        }
    }
}

#[test]
fn slopes_are_those_of_small_steps() {
    let size = [37, 23];
    let values: Vec<f32> = (0..37 * 23).map(number).collect();
    let map = MipMap::new(ImageData::new(size, 1, Pixels::Float(values)).unwrap());
    for wrap in Wrap::ALL {
        for texels in [0.0, 1.7, 5.0] {
            for i in 0..50 {
                let uv = DVec2::new(f64::from(number(i)) * 4.0 - 2.0, f64::from(number(i + 99)));
                let h = 2e-6;
                let value = |uv| f64::from(map.trilinear(uv, wrap, texels).luminance());
                let step = |axis: DVec2| (value(uv + h * axis) - value(uv - h * axis)) / (2.0 * h);
                let slope = map.slope(uv, wrap, texels);
                let error = (slope - DVec2::new(step(DVec2::X), step(DVec2::Y))).abs();
                assert!(error.max_element() < 0.3, "{wrap:?} {texels} {uv}: {error}");
            }
        }
    }
}

#[test]
fn large_pictures_are_compact() {
    let n = 4096;
    let data = ImageData::new([n, n], 3, Pixels::Srgb8(vec![9; (n * n * 3) as usize])).unwrap();
    let map = MipMap::new(data);
    let per_pixel = map.bytes() as f64 / f64::from(n * n);
    assert!(per_pixel < 5.01, "{per_pixel}");
}
