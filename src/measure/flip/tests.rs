//! The oracle is the authors' own implementation, `flip-evaluator` 1.7, given the same pictures as
//! linear f32 arrays (`evaluate(reference, test, "LDR" or "HDR", inputsRGB=False)`); means were taken
//! in f64 over its maps.

use super::*;

const WIDTH: usize = 97;
const HEIGHT: usize = 61;
const SIZE: [u32; 2] = [WIDTH as u32, HEIGHT as u32];

fn picture(colour: impl Fn(f64, f64) -> [f64; 3]) -> Vec<Rgb> {
    let at = |i: usize| colour((i % WIDTH) as f64, (i / WIDTH) as f64).map(|x| x as f32).into();
    (0..WIDTH * HEIGHT).map(at).collect()
}

fn waves() -> Vec<Rgb> {
    picture(|x, y| {
        let step = ((x * 7.0 + y * 13.0) % 32.0) / 31.0;
        [0.5 + 0.5 * (0.13 * x + 0.07 * y).sin(), step, 0.5 + 0.5 * (0.005 * x * y).cos()]
    })
}

fn disturbed() -> Vec<Rgb> {
    let waves = waves();
    picture(|x, y| {
        let d = 0.2 * (0.9 * x).sin() * (0.7 * y).cos();
        let c = waves[y as usize * WIDTH + x as usize];
        [f64::from(c.r) + d, f64::from(c.g) - d, f64::from(c.b) + 0.5 * d]
            .map(|x| x.clamp(0.0, 1.0))
    })
}

fn checks() -> Vec<Rgb> {
    picture(|x, y| [((x / 8.0).floor() + (y / 8.0).floor()) % 2.0; 3])
}

fn bright(picture: &[Rgb]) -> Vec<Rgb> {
    let map = |x: f32| (0.02 * (6.0 * f64::from(x)).exp()) as f32;
    picture.iter().map(|c| c.to_array().map(map).into()).collect()
}

/// Mean, maximum, and the pixels (40, 30) and (0, 0).
fn summary(map: &[f32]) -> [f64; 4] {
    let mean = map.iter().map(|&x| f64::from(x)).sum::<f64>() / map.len() as f64;
    let largest = map.iter().fold(0.0, |a: f32, &b| a.max(b));
    [mean, largest.into(), map[30 * WIDTH + 40].into(), map[0].into()]
}

fn expect(map: &[f32], oracle: [f64; 4]) {
    let ours = summary(map);
    for (ours, oracle) in ours.into_iter().zip(oracle) {
        assert!((ours - oracle).abs() < 2e-5, "{ours} is not {oracle}");
    }
}

#[test]
fn agrees_with_the_authors_on_a_display() {
    let near = |test: &[Rgb], reference: &[Rgb]| flip(test, reference, SIZE, PIXELS_PER_DEGREE);
    let (waves, disturbed, checks) = (waves(), disturbed(), checks());
    let grey = vec![Rgb::splat(0.5); waves.len()];
    expect(&near(&disturbed, &waves), [0.200963322, 0.601146162, 0.221703842, 0.262765765]);
    expect(
        &flip(&disturbed, &waves, SIZE, 20.0),
        [0.370062405, 0.964160264, 0.458243519, 0.0637228489],
    );
    expect(&near(&grey, &checks), [0.766965186, 0.989823341, 0.591238856, 0.967311442]);
    expect(&near(&waves, &checks), [0.899675037, 0.993494272, 0.926603556, 0.984234989]);
}

#[test]
fn agrees_with_the_authors_on_bright_light() {
    let (reference, test) = (bright(&waves()), bright(&disturbed()));
    let (map, exposures) = hdr_flip(&test, &reference, SIZE, PIXELS_PER_DEGREE);
    assert!((exposures.first + 1.915_895).abs() < 1e-5, "{exposures:?}");
    assert!((exposures.last - 0.968_961_7).abs() < 1e-5, "{exposures:?}");
    assert_eq!(exposures.count, 3);
    expect(&map, [0.233321101, 0.630278826, 0.215486661, 0.252966553]);

    let dim: Vec<Rgb> = reference.iter().map(|&c| c * 0.01).collect();
    let brighter: Vec<Rgb> = dim.iter().map(|&c| c * 1.1).collect();
    let (map, exposures) = hdr_flip(&brighter, &dim, SIZE, PIXELS_PER_DEGREE);
    assert!((exposures.first - 4.727_961_5).abs() < 1e-5, "{exposures:?}");
    expect(&map, [0.103407861, 0.148871094, 0.0835482404, 0.111729063]);

    let grey = vec![Rgb::splat(0.5); reference.len()];
    let brighter = vec![Rgb::splat(0.75); reference.len()];
    let (map, exposures) = hdr_flip(&brighter, &grey, SIZE, PIXELS_PER_DEGREE);
    assert_eq!((exposures.first, exposures.count), (exposures.last, 2));
    expect(&map, [0.109181955; 4]);
}

/// More than half of the reference is black: its median counts as 2⁻²³.
#[test]
fn agrees_with_the_authors_on_a_mostly_black_picture() {
    let black = |mut picture: Vec<Rgb>| {
        picture[..45 * WIDTH].fill(Rgb::BLACK);
        picture
    };
    let (reference, test) = (black(bright(&waves())), black(bright(&disturbed())));
    let (map, exposures) = hdr_flip(&test, &reference, SIZE, PIXELS_PER_DEGREE);
    assert!((exposures.last - 24.083_298).abs() < 1e-5, "{exposures:?}");
    assert_eq!(exposures.count, 26);
    expect(&map, [0.0729491621, 0.615638733, 0.0, 0.0]);
}

#[test]
fn the_ends_of_the_scale() {
    let full = |r, g, b| vec![Rgb::new(r, g, b); WIDTH * HEIGHT];
    let (green, blue) = (full(0.0, 1.0, 0.0), full(0.0, 0.0, 1.0));
    expect(&flip(&blue, &green, SIZE, PIXELS_PER_DEGREE), [1.0; 4]);
    assert_eq!(summary(&flip(&waves(), &waves(), SIZE, PIXELS_PER_DEGREE)), [0.0; 4]);
    let (map, _) = hdr_flip(&waves(), &waves(), SIZE, PIXELS_PER_DEGREE);
    assert_eq!(summary(&map), [0.0; 4]);
}

#[test]
fn pictures_smaller_than_the_filters_and_extreme_values() {
    let one = [Rgb::splat(0.2)];
    let other = [Rgb::splat(0.8)];
    let map = flip(&one, &other, [1, 1], PIXELS_PER_DEGREE);
    assert!(map[0] > 0.1 && map[0] < 1.0, "{map:?}");
    assert!(flip(&[], &[], [0, 0], PIXELS_PER_DEGREE).is_empty());
    for value in [0.0, -1.0, 1e-38, f32::MAX, -f32::MAX] {
        let (map, exposures) = hdr_flip(&[Rgb::splat(value)], &other, [1, 1], PIXELS_PER_DEGREE);
        assert!((0.0..=1.0001).contains(&map[0]), "{value}: {map:?}");
        assert!(exposures.count <= 160);
        let (map, exposures) = hdr_flip(&other, &[Rgb::splat(value)], [1, 1], PIXELS_PER_DEGREE);
        assert!((0.0..=1.0001).contains(&map[0]), "{value}: {map:?}");
        assert!(exposures.count <= 160);
    }
}
