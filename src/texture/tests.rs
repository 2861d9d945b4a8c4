//! All kinds of textures: slopes against differences, odd input, footprints.

use std::sync::Arc;

use glam::{DAffine2, DAffine3, DMat2, DVec2};

use super::*;

fn ramp() -> Ramp {
    Ramp::even(&[Rgb::new(0.1, 0.2, 0.3), Rgb::new(0.9, 0.7, 0.2), Rgb::splat(0.5)]).unwrap()
}

/// A smooth picture that repeats: waves along both axes.
fn waves(size: u32) -> Arc<MipMap> {
    let wave = |i: u32| (std::f32::consts::TAU * (i as f32 + 0.5) / size as f32).sin();
    let value = |i: u32| 0.5 + 0.2 * wave(i % size) + 0.15 * wave(i / size);
    let values = (0..size * size).map(value).collect();
    Arc::new(MipMap::new(ImageData::new([size, size], 1, Pixels::Float(values)).unwrap()))
}

fn placements() -> [Placement; 2] {
    let texture_from_object = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7)
        * DAffine3::from_scale(DVec3::new(1.5, 0.7, 2.0))
        * DAffine3::from_translation(DVec3::new(0.1, 0.2, 0.3));
    [Space::Position, Space::Uv].map(|space| Placement { space, texture_from_object })
}

fn textures() -> Vec<Texture> {
    let mut textures = Vec::new();
    for placement in placements() {
        let (ramp, scale, seed) = (ramp(), 0.8, 3);
        textures.extend([
            Texture::Checker(Checker {
                colors: [Rgb::splat(0.2), Rgb::new(0.8, 0.3, 0.4)],
                scale,
                placement,
            }),
            Texture::Noise(Noise {
                ramp: ramp.clone(),
                scale,
                octaves: 3,
                gain: 0.5,
                seed,
                placement,
            }),
            Texture::Marble(Marble {
                ramp: ramp.clone(),
                scale,
                turbulence: 0.5,
                octaves: 2,
                seed,
                placement,
            }),
            Texture::Gradient(Gradient { axis: DVec3::new(1.0, 2.0, -0.5), ramp, placement }),
        ]);
    }
    for mapping in Mapping::ALL {
        for filter in TexelFilter::ALL {
            textures.push(Texture::Image(ImageTexture {
                mapping,
                filter,
                image_from_uv: DAffine2::from_mat2_translation(
                    DMat2::from_angle(0.4) * DMat2::from_diagonal(DVec2::new(1.5, 0.8)),
                    DVec2::new(0.2, 0.7),
                ),
                texture_from_object: placements()[0].texture_from_object,
                ..ImageTexture::new(waves(128))
            }));
        }
    }
    textures
}

/// A number from −1 to 1 without pattern.
fn number(i: u32) -> f64 {
    let x = (i.wrapping_mul(0x9e37_79b9) ^ 0x5bd1_e995).wrapping_mul(0x2c1b_3c6d);
    f64::from(x ^ (x >> 13)) / f64::from(u32::MAX) * 2.0 - 1.0
}

fn point(i: u32) -> TexturePoint {
    let [x, y, z, u, v] = [0, 1, 2, 3, 4].map(|k| number(5 * i + k));
    TexturePoint {
        position: 2.0 * DVec3::new(x, y, z),
        uv: Vec2::new(u as f32, v as f32),
        footprint: Footprint { width: 0.0, uv_width: 0.0, normal: Vec3::Y },
    }
}

#[test]
fn slopes_are_those_of_small_steps() {
    for texture in textures() {
        if matches!(&texture, Texture::Image(t) if t.filter == TexelFilter::Nearest) {
            continue;
        }
        // Differences in f32 are noisy and a few straddle an edge; most must agree.
        let (mut agreed, n) = (0, 200);
        for i in 0..n {
            let at = point(i);
            let h = 2e-3;
            let difference = |a: TexturePoint, b: TexturePoint| {
                (f64::from(texture.value(&a)) - f64::from(texture.value(&b))) / (2.0 * h)
            };
            let error = match texture.value_gradient(&at) {
                BumpGradient::Position(slope) => {
                    let moved = |d| TexturePoint { position: at.position + d, ..at };
                    let step = |axis: DVec3| difference(moved(h * axis), moved(-h * axis));
                    let expected = DVec3::new(step(DVec3::X), step(DVec3::Y), step(DVec3::Z));
                    (slope.as_dvec3() - expected).length() / (0.1 + expected.length())
                }
                BumpGradient::Uv { du, dv } => {
                    let moved = |d: DVec2| TexturePoint { uv: at.uv + d.as_vec2(), ..at };
                    let step = |axis: DVec2| difference(moved(h * axis), moved(-h * axis));
                    let expected = DVec2::new(step(DVec2::X), step(DVec2::Y));
                    let slope = Vec2::new(du, dv).as_dvec2();
                    (slope - expected).length() / (0.1 + expected.length())
                }
            };
            agreed += u32::from(error < 0.05);
        }
        assert!(agreed * 10 >= n * 9, "{agreed} of {n}: {texture:?}");
    }
}

#[test]
fn any_input_gives_a_finite_answer() {
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1e30, 1e-320, 0.0, -0.0];
    for texture in textures() {
        for (i, &a) in odd.iter().enumerate() {
            for (j, &b) in odd.iter().enumerate() {
                let c = odd[(i + j) % odd.len()];
                let point = TexturePoint {
                    position: DVec3::new(a, b, c),
                    uv: Vec2::new(a as f32, b as f32),
                    footprint: Footprint {
                        width: c as f32,
                        uv_width: b as f32,
                        normal: Vec3::splat(a as f32),
                    },
                };
                assert!(texture.color(&point).is_finite(), "{point:?}: {texture:?}");
                assert!(texture.value(&point).is_finite());
                assert!(texture.normal(&point).is_normalized());
                match texture.value_gradient(&point) {
                    BumpGradient::Position(slope) => assert!(slope.is_finite()),
                    BumpGradient::Uv { du, dv } => assert!(du.is_finite() && dv.is_finite()),
                }
            }
        }
    }
}

#[test]
fn wide_footprints_leave_nothing_but_the_mean() {
    let wide = Footprint { width: 1e4, uv_width: 1e4, normal: Vec3::ZERO };
    for texture in textures() {
        let flat = match &texture {
            Texture::Image(t) => t.filter == TexelFilter::Mip,
            // Its ends go on for ever.
            Texture::Gradient(_) => false,
            _ => true,
        };
        if flat {
            let values =
                (0..50).map(|i| texture.value(&TexturePoint { footprint: wide, ..point(i) }));
            let (low, high) = values.fold((f32::MAX, f32::MIN), |(a, b), x| (a.min(x), b.max(x)));
            assert!(high - low < 1e-3, "{low} to {high}: {texture:?}");
        }
    }
}

/// A picture whose value is that of its pixel's number: 4 × 2, the upper row first.
fn numbered(mapping: Mapping) -> Texture {
    let values = (0..8).map(|i| i as f32).collect();
    let image = Arc::new(MipMap::new(ImageData::new([4, 2], 1, Pixels::Float(values)).unwrap()));
    let filter = TexelFilter::Nearest;
    Texture::Image(ImageTexture { mapping, filter, ..ImageTexture::new(image) })
}

#[test]
fn mappings_by_position() {
    let value = |mapping, x: f64, y: f64, z: f64| {
        let position = DVec3::new(x, y, z);
        numbered(mapping).value(&TexturePoint { position, ..TexturePoint::default() }).round()
    };
    // A floor seen from above: right is +x, up in the picture is −z.
    assert_eq!(value(Mapping::Planar, 0.1, 7.0, -0.1), 4.0);
    assert_eq!(value(Mapping::Planar, 0.9, 7.0, -0.1), 7.0);
    assert_eq!(value(Mapping::Planar, 0.1, 7.0, -0.9), 0.0);
    // Who looks along −z at a globe has the picture's middle in front and its right half at right.
    assert_eq!(value(Mapping::Spherical, 0.1, 0.5, 1.0), 2.0);
    assert_eq!(value(Mapping::Spherical, -0.1, 0.5, 1.0), 1.0);
    assert_eq!(value(Mapping::Spherical, 0.1, -0.5, 1.0), 6.0);
    assert_eq!(value(Mapping::Spherical, 0.1, 0.5, -1.0), 3.0);
    assert_eq!(value(Mapping::Spherical, -0.1, 0.5, -1.0), 0.0);
    assert_eq!(value(Mapping::Cylindrical, 0.1, 0.9, 1.0), 2.0);
    assert_eq!(value(Mapping::Cylindrical, 0.1, 0.1, 1.0), 6.0);
}

#[test]
fn transforms_of_coordinates() {
    let Texture::Image(mut texture) = numbered(Mapping::Uv) else { unreachable!() };
    texture.image_from_uv = DAffine2::from_scale(DVec2::new(2.0, 2.0));
    let at = |u, v| TexturePoint { uv: Vec2::new(u, v), ..TexturePoint::default() };
    assert_eq!(texture.color(&at(0.45, 0.1)).r, 7.0);
    assert_eq!(texture.color(&at(0.55, 0.1)).r, 4.0);
}

#[test]
fn normals_are_decoded_and_of_unit_length() {
    let normal = |bytes: [u8; 3]| {
        let data = ImageData::new([1, 1], 3, Pixels::Linear8(bytes.to_vec())).unwrap();
        let texture = Texture::Image(ImageTexture::new(Arc::new(MipMap::new(data))));
        texture.normal(&TexturePoint::default())
    };
    assert!((normal([128, 128, 255]) - Vec3::Z).length() < 6e-3);
    assert!((normal([255, 128, 128]) - Vec3::X).length() < 6e-3);
    assert!((normal([128, 255, 128]) - Vec3::Y).length() < 6e-3);
    assert!(normal([0, 0, 0]).is_normalized());
}

#[test]
fn the_footprint_chooses_the_level() {
    // One pixel in two is white; a footprint two pixels wide sees grey.
    let pixels = Pixels::Linear8((0..64 * 64).map(|i| if i % 2 == 0 { 255 } else { 0 }).collect());
    let image = Arc::new(MipMap::new(ImageData::new([64, 64], 1, pixels).unwrap()));
    let texture = Texture::Image(ImageTexture::new(image));
    let value = |uv_width| {
        let footprint = Footprint { uv_width, ..Footprint::default() };
        texture.value(&TexturePoint { uv: Vec2::new(0.5 / 64.0, 0.5), footprint, ..point(0) })
    };
    assert!((value(0.0) - 1.0).abs() < 1e-5);
    assert!((value(1.0 / 64.0) - 1.0).abs() < 1e-5);
    assert!((value(2.0 / 64.0) - 0.5).abs() < 1e-4);
}
