//! Against closed forms, and against sums of very many small steps over the interpolant.

use super::integrate::{Steps, march_by};
use super::*;

const BOX: Bounds = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };

fn node(value: f64, color: [f64; 3], extinction: f64) -> TransferNode {
    TransferNode { value, color, extinction }
}

fn volume(grid: Grid, nodes: &[TransferNode]) -> Volume {
    let transfer = TransferFunction::new(nodes.to_vec()).unwrap();
    Volume::new(Arc::new(grid), BOX, DAffine3::IDENTITY, Arc::new(transfer), 1e-3)
}

fn noise(seed: u32) -> Grid {
    let hash = |i: usize, j: usize, k: usize| {
        let mut h = (i as u32).wrapping_mul(0x9e37_79b9) ^ (j as u32).wrapping_mul(0x85eb_ca6b);
        h = (h ^ (k as u32).wrapping_mul(0xc2b2_ae35) ^ seed).wrapping_mul(0x27d4_eb2f);
        h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
        (h ^ h >> 13) as f32 / u32::MAX as f32
    };
    Grid::from_fn([9, 12, 7], hash).unwrap()
}

/// A sum of `n` steps, each of constant extinction and colour.
fn oracle(volumes: &[Volume], o: DVec3, d: DVec3, t_max: f64, n: usize) -> ([f64; 3], f64) {
    let (mut light, mut transmittance) = ([0.0; 3], 1.0);
    let h = t_max / n as f64;
    for i in 0..n {
        let p = o + (i as f64 + 0.5) * h * d;
        let (mut emission, mut extinction) = ([0.0; 3], 0.0);
        for volume in volumes {
            let at = volume.grid_from_world.transform_point3(p);
            let b = volume.grid.bounds();
            if at.cmplt(b.min).any() || at.cmpgt(b.max).any() {
                continue;
            }
            let (color, sigma) = volume.transfer.at(volume.grid.value(at));
            emission = std::array::from_fn(|i| emission[i] + sigma * color[i]);
            extinction += sigma;
        }
        let passed = (-extinction * h * d.length()).exp();
        let scale = if extinction > 0.0 { (1.0 - passed) / extinction } else { 0.0 };
        light = std::array::from_fn(|i| light[i] + transmittance * scale * emission[i]);
        transmittance *= passed;
    }
    (light, transmittance)
}

/// Light and transmittance with steps of a given length.
fn with_steps(volumes: &[Volume], o: DVec3, d: DVec3, t_max: f64, steps: Steps) -> ([f64; 3], f64) {
    let (mut light, mut transmittance) = ([0.0; 3], 1.0);
    march_by(volumes, o, d, t_max, steps, |slab| {
        assert!(slab.before == transmittance && slab.t1 >= slab.t0);
        light = std::array::from_fn(|i| light[i] + slab.light[i]);
        transmittance = slab.after;
    });
    (light, transmittance)
}

const USUAL: Steps = Steps { tolerance: None, most_halvings: 10 };

#[test]
fn constant_extinction_is_beers_law() {
    let grid = Grid::from_fn([5, 4, 3], |_, _, _| 0.5).unwrap();
    let color = [1.0, 0.25, 3.0];
    let mut volumes = [volume(grid, &[node(0.0, color, 0.7)])];
    let (o, d) = (DVec3::new(-5.0, 0.1, 0.2), DVec3::X);
    let check = |volumes: &[Volume], d: DVec3, t_max: f64, length: f64| {
        let (light, t) = with_steps(volumes, o, d, t_max, USUAL);
        let expected = (-0.7 * length).exp();
        assert!((t - expected).abs() < 1e-14, "{t} {expected}");
        for i in 0..3 {
            assert!((light[i] - color[i] * (1.0 - expected)).abs() < 1e-14);
        }
        assert!((transmittance_through(volumes, o, d, t_max) - expected).abs() < 1e-14);
    };
    check(&volumes, d, 100.0, 2.0);
    check(&volumes, 4.0 * d, 100.0, 2.0);
    // A surface within, one before it.
    check(&volumes, d, 4.5, 0.5);
    check(&volumes, d, 4.0, 0.0);
    // Coefficients are those of the world, whatever the volume's own scale.
    let Volume { grid, transfer, .. } = volumes[0].clone();
    let m = DAffine3::from_scale(DVec3::new(-2.0, 3.0, 1.0));
    volumes[0] = Volume::new(grid, BOX, m, transfer, 1e-3);
    check(&volumes, d, 100.0, 4.0);
    let (light, t) = seen(&volumes, o, d, f64::INFINITY);
    assert!((t - (-2.8f32).exp()).abs() < 1e-7 && (light.b - 3.0 * (1.0 - t)).abs() < 1e-6);
}

#[test]
fn ramps_have_closed_forms() {
    // The value is x from 0 to 2 along the ray.
    let grid = || Grid::from_fn([9, 2, 2], |i, _, _| i as f32 / 4.0).unwrap();
    let (o, d) = (DVec3::new(-7.0, 0.3, -0.4), DVec3::X);
    // σ = k·x and one colour: the optical depth is k·L²/2.
    let k = 0.8;
    let ramp = [volume(grid(), &[node(0.0, [2.0; 3], 0.0), node(2.0, [2.0; 3], 2.0 * k)])];
    let (light, t) = with_steps(&ramp, o, d, 7.0, USUAL);
    let expected = (-0.5 * k * 1.0f64).exp();
    assert!((t - expected).abs() < 1e-14 && (light[0] - 2.0 * (1.0 - expected)).abs() < 1e-14);
    // σ = k and a colour that is x: ∫ k·x·exp(−k·x) dx = (1 − (1 + k·L)·exp(−k·L))/k.
    let ramp = [volume(grid(), &[node(0.0, [0.0; 3], k), node(2.0, [2.0; 3], k)])];
    let (light, _) = with_steps(&ramp, o, d, 100.0, USUAL);
    let expected = (1.0 - (1.0 + 2.0 * k) * (-2.0 * k).exp()) / k;
    assert!((light[1] - expected).abs() < 1e-14, "{} {expected}", light[1]);
}

#[test]
fn noise_is_the_sum_of_small_steps() {
    // A ramp, a plateau, a step and a gap, over two overlapping volumes.
    let one = volume(
        noise(1),
        &[
            node(0.3, [1.0, 0.0, 0.2], 0.0),
            node(0.6, [0.0, 1.0, 0.3], 4.0),
            node(0.6, [0.0, 1.0, 0.9], 1.0),
            node(0.8, [0.5, 0.5, 0.0], 0.0),
        ],
    );
    let two = volume(noise(2), &[node(0.4, [0.0, 0.2, 2.0], 0.0), node(1.0, [1.0; 3], 3.0)]);
    let m = DAffine3::from_rotation_y(0.7) * DAffine3::from_translation(DVec3::new(0.5, 0.2, 0.1));
    let two = Volume::new(two.grid, BOX, m, two.transfer, 1e-3);
    let volumes = [one, two];
    let mut worst = [0.0f64; 2];
    let fine = Steps { tolerance: Some(1e-7), most_halvings: 10 };
    for i in 0..24 {
        let angle = f64::from(i);
        let o = DVec3::new(4.0 * angle.cos(), 2.0 * (1.7 * angle).sin(), 4.0 * angle.sin());
        let d = DVec3::new(0.3 * (2.3 * angle).sin(), 0.1, 0.2 * (3.1 * angle).cos()) - 0.4 * o;
        let t_max = if i % 2 == 0 { 5.0 } else { 2.2 };
        for volumes in [&volumes[..1], &volumes[..]] {
            let (expected, expected_t) = oracle(volumes, o, d, t_max, 100_000);
            for (worst, steps) in worst.iter_mut().zip([fine, USUAL]) {
                let (light, t) = with_steps(volumes, o, d, t_max, steps);
                assert!((t - expected_t).abs() < 1e-4, "{i}: {t} {expected_t}");
                assert!((transmittance_through(volumes, o, d, t_max) - t).abs() < 1e-12);
                for c in 0..3 {
                    *worst = worst.max((light[c] - expected[c]).abs());
                }
            }
        }
    }
    // What the oracle's own steps are off by, and the tolerance times the brightest colour.
    assert!(worst[0] < 1e-4 && worst[1] < 2e-3, "{worst:?}");
}

/// Fourth order in the length of steps, where the colour is smooth in the optical depth.
#[test]
fn the_error_falls_with_the_fourth_power_of_the_step() {
    let grid = Grid::from_fn([3, 3, 3], |i, j, k| (i * i + 2 * j + k * k * j) as f32).unwrap();
    let nodes = [node(0.0, [0.0, 4.0, 9.0], 1.0), node(20.0, [9.0, 0.0, 1.0], 30.0)];
    let volumes = [volume(grid, &nodes)];
    let (o, d) = (DVec3::new(-3.0, -2.6, -2.8), DVec3::new(3.0, 2.9, 2.7));
    let at = |most_halvings| {
        with_steps(&volumes, o, d, 3.0, Steps { tolerance: Some(0.0), most_halvings }).0
    };
    let exact = at(10);
    let error = |halvings| {
        let found = at(halvings);
        (0..3).map(|i| (found[i] - exact[i]).abs()).fold(0.0, f64::max)
    };
    let errors: Vec<f64> = (0..6).map(error).collect();
    for pair in errors.windows(2).skip(1).take(3) {
        assert!(pair[0] / pair[1] > 10.0, "{errors:?}");
    }
    // And what the tolerance makes of it.
    let found = with_steps(&volumes, o, d, 3.0, USUAL).0;
    for i in 0..3 {
        assert!((found[i] - exact[i]).abs() < 1e-3 * 9.0);
    }
}

#[test]
fn two_in_one_place_are_one_of_both() {
    let nodes = |s: f64| [node(0.2, [1.0, 0.5, 0.0], 0.0), node(1.0, [0.0, 0.5, 1.0], s)];
    let twice = [volume(noise(3), &nodes(2.0)), volume(noise(3), &nodes(3.0))];
    let once = [volume(noise(3), &nodes(5.0))];
    let (o, d) = (DVec3::new(-3.0, 0.3, 0.1), DVec3::new(1.0, 0.05, 0.07));
    let (a, ta) = with_steps(&twice, o, d, 10.0, USUAL);
    let (b, tb) = with_steps(&once, o, d, 10.0, USUAL);
    assert!((ta - tb).abs() < 1e-12);
    for i in 0..3 {
        assert!((a[i] - b[i]).abs() < 1e-12);
    }
}
