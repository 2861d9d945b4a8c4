use super::*;

fn picture(size: [u32; 2], values: &[f32]) -> Picture {
    Picture::whole(size, values.iter().map(|&x| Rgb::splat(x)).collect())
}

const ALL: CompareOptions = CompareOptions { pixels_per_degree: PIXELS_PER_DEGREE, hdr_flip: true };

fn compared(a: &Picture, b: &Picture) -> Comparison {
    compare(a, b, &ALL).unwrap()
}

#[test]
fn metrics_as_by_hand() {
    // Differences 0.5 and 1.5, of them 0.5 and 0 after clipping.
    let a = picture([2, 1], &[0.5, 3.0]);
    let b = picture([2, 1], &[0.0, 1.5]);
    let c = compared(&a, &b);
    assert_eq!((c.size, c.non_finite), ([2, 1], 0));
    assert!((c.mse - (0.25 + 2.25) / 2.0).abs() < 1e-12, "{c:?}");
    assert!((c.mae - 1.0).abs() < 1e-12, "{c:?}");
    assert!((c.rel_mse - (0.25 / 0.01 + 2.25 / (2.25 + 0.01)) / 2.0).abs() < 1e-6, "{c:?}");
    assert!((c.psnr - 10.0 * (1.0f64 / 0.125).log10()).abs() < 1e-9, "{c:?}");
    assert_eq!((c.largest, c.largest_at), (1.5, [1, 0]));
    // One channel of three.
    let a = Picture::whole([1, 1], vec![Rgb::new(0.3, 0.0, 0.0)]);
    let c = compared(&a, &picture([1, 1], &[0.0]));
    assert!((c.mse - 0.03).abs() < 1e-8 && (c.mae - 0.1).abs() < 1e-8, "{c:?}");
}

#[test]
fn equal_pictures_have_no_error() {
    let a = picture([3, 2], &[0.0, 0.1, 0.5, 1.0, 7.0, -1.0]);
    let c = compared(&a, &a);
    assert_eq!([c.mse, c.mae, c.rel_mse, c.largest, c.flip, c.hdr_flip.unwrap().0], [0.0; 6]);
    assert_eq!(c.psnr, f64::INFINITY);
    assert_eq!(
        compare(&a, &a, &CompareOptions::default()).unwrap().hdr_flip,
        None,
        "not asked for"
    );
}

#[test]
fn non_finite_pixels_are_counted_and_left_out() {
    let a = picture([4, 1], &[0.5, f32::NAN, 0.25, 0.25]);
    let b = picture([4, 1], &[0.25, 1.0, f32::INFINITY, 0.25]);
    let c = compared(&a, &b);
    assert_eq!(c.non_finite, 2);
    assert!((c.mse - 0.0625 / 2.0).abs() < 1e-12, "{c:?}");
    assert!(c.flip.is_finite() && c.hdr_flip.unwrap().0.is_finite(), "{c:?}");
    assert_eq!(
        c.flip_map.iter().map(|x| x.is_nan()).collect::<Vec<_>>(),
        [false, true, true, false]
    );
    // The mean is over the other two.
    let mean = f64::from(c.flip_map[0] + c.flip_map[3]) / 2.0;
    assert!((c.flip - mean).abs() < 1e-6);
    let none = compared(&picture([1, 1], &[f32::NAN]), &picture([1, 1], &[0.0]));
    assert_eq!(none.non_finite, 1);
    let numbers = [none.mse, none.mae, none.rel_mse, none.psnr, none.largest, none.flip];
    assert!(numbers.iter().all(|x| x.is_nan()), "{none:?}");
}

#[test]
fn only_the_same_pixels_are_compared() {
    let a = picture([2, 1], &[0.0; 2]);
    let b = picture([1, 2], &[0.0; 2]);
    let error = compare(&a, &b, &CompareOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "2x1 and 1x2 pixels");
    let moved = Picture { origin: Some([-3, 4]), ..a.clone() };
    let error = compare(&a, &moved, &CompareOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "parts of a whole that begin at 0,0 and at -3,4");
    let unplaced = Picture { origin: None, ..a.clone() };
    assert!(check_same_pixels(&unplaced, &moved).is_ok());
}

#[test]
fn differences_stay_visible() {
    let a = picture([3, 1], &[0.5, f32::NAN, 1.0]);
    let b = picture([3, 1], &[0.75, 1.0, f32::INFINITY]);
    let d = absolute_difference(&a, &b).unwrap();
    assert_eq!(d.pixels[0], Rgb::splat(0.25));
    assert!(d.pixels[1].r.is_nan() && d.pixels[2].r == f32::INFINITY);
}

#[test]
fn the_result_does_not_depend_on_threads() {
    let values: Vec<f32> = (0..64 * 40).map(|i| (i % 97) as f32 / 50.0).collect();
    let a = picture([64, 40], &values);
    let b = picture([64, 40], &values.iter().map(|x| x * x).collect::<Vec<_>>());
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| compared(&a, &b))
    };
    assert_eq!(on(1), on(5));
}

#[test]
fn magma_goes_from_black_to_light_yellow() {
    let srgb = |x: f32| magma(x).to_array().map(crate::color::srgb_from_linear);
    let near = |x: f32, colour: [f32; 3]| {
        let ours = srgb(x);
        let off = [0, 1, 2].map(|i| (ours[i] - colour[i]).abs());
        assert!(off.iter().all(|&d| d < 0.012), "{x}: {ours:?} is not {colour:?}");
    };
    // Of the 256 colours of the original.
    near(0.0, [0.001_462, 0.000_466, 0.013_866]);
    near(7.0 / 255.0, [0.011_465, 0.009_828, 0.060_750]);
    near(85.0 / 255.0, [0.445_163, 0.122_724, 0.506_901]);
    near(128.0 / 255.0, [0.716_387, 0.214_982, 0.475_290]);
    near(1.0, [0.987_053, 0.991_438, 0.749_504]);
    near(7.0, [0.987_053, 0.991_438, 0.749_504]);
    assert_eq!(magma(f32::NAN), Rgb::new(0.0, 1.0, 1.0));
    let luminances: Vec<f32> = (0..=100).map(|i| magma(i as f32 / 100.0).luminance()).collect();
    assert!(luminances.is_sorted());
}
