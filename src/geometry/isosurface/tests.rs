//! Against sums over corners by weights, bracketed densely along the ray.

use proptest::prelude::*;

use super::*;

const BOX: Bounds = Bounds { min: DVec3::new(-1.0, 0.5, 2.0), max: DVec3::new(1.5, 2.0, 4.0) };
const SIZE: [usize; 3] = [15, 9, 12];

/// The grids of the tests: in a box of cells from 0 to 1 along each axis.
fn grid(kind: usize) -> Arc<Grid> {
    let value = |i: usize, j: usize, k: usize| {
        let p = DVec3::new(
            i as f64 / (SIZE[0] - 1) as f64,
            j as f64 / (SIZE[1] - 1) as f64,
            k as f64 / (SIZE[2] - 1) as f64,
        );
        match kind {
            // The distance from a sphere.
            0 => 0.4 - p.distance(DVec3::splat(0.5)),
            // A gyroid.
            1 => {
                let [x, y, z] = (9.0 * p).to_array();
                x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()
            }
            // Noise; closed, and with samples of just the level.
            _ => {
                let at_end = [i, j, k].iter().zip(&SIZE).any(|(&i, &n)| i == 0 || i == n - 1);
                let mut h = ((i * 73_856_093) ^ (j * 19_349_663) ^ (k * 83_492_791)) as u32;
                h = (h ^ h >> 13).wrapping_mul(0x5bd1_e995);
                if at_end { -1.0 } else { f64::from(h >> 11 & 7) - 3.0 }
            }
        }
    };
    Arc::new(Grid::from_fn(SIZE, |i, j, k| value(i, j, k) as f32).unwrap())
}

fn surface(kind: usize) -> Isosurface {
    Isosurface::new(grid(kind), BOX, 0.0, false)
}

/// A point given in cells.
fn at_cell(p: DVec3) -> DVec3 {
    BOX.min + p * BOX.size() / DVec3::from(SIZE.map(|n| (n - 1) as f64))
}

/// The interpolant, from the samples by their weights.
fn value(surface: &Isosurface, p: DVec3) -> f64 {
    let last = DVec3::from(SIZE.map(|n| (n - 1) as f64));
    let p = ((p - BOX.min) / BOX.size() * last).clamp(DVec3::ZERO, last);
    let cell = p.floor().min(last - 1.0);
    let (f, mut sum) = (p - cell, 0.0);
    for corner in 0..8 {
        let step = [corner & 1, corner >> 1 & 1, corner >> 2];
        let weight: f64 = (0..3).map(|i| if step[i] == 1 { f[i] } else { 1.0 - f[i] }).product();
        let at = [0, 1, 2].map(|i| cell[i] as usize + step[i]);
        sum += weight * f64::from(surface.grid.sample(at));
    }
    sum
}

/// Where the ray passes the level, of those passages that are further apart than some step. Pairs that
/// rounding makes of a place where it touches are left out.
fn oracle(surface: &Isosurface, o: DVec3, d: DVec3) -> Vec<f64> {
    const STEPS: usize = 6000;
    let Some((enter, exit)) = BOX.clip(o, d) else { return Vec::new() };
    let enter = enter.max(0.0);
    let at = |t: f64| value(surface, o + t * d) > 0.0;
    let t = |i: usize| enter + (exit - enter) * i as f64 / STEPS as f64;
    let mut found = Vec::new();
    let mut above = at(t(0));
    for i in 0..STEPS {
        let next = at(t(i + 1));
        if above != next {
            let (mut lo, mut hi) = (t(i), t(i + 1));
            for _ in 0..60 {
                let middle = 0.5 * (lo + hi);
                if at(middle) == above { lo = middle } else { hi = middle }
            }
            found.push(0.5 * (lo + hi));
        }
        above = next;
    }
    apart(found)
}

/// Without pairs that rounding makes of a place where a ray touches the level.
fn apart(found: Vec<f64>) -> Vec<f64> {
    let mut apart: Vec<f64> = Vec::new();
    for t in found {
        if apart.last().is_some_and(|last| t - last < 1e-9 * t) {
            apart.pop();
        } else {
            apart.push(t);
        }
    }
    apart
}

fn all(surface: &Isosurface, o: DVec3, d: DVec3) -> Vec<f64> {
    let mut found = Vec::new();
    surface.crossings(o, d, 0.0, f64::INFINITY, |t| {
        found.push(t);
        true
    });
    found
}

/// A ray towards a point in the box from `distance` sizes of it; some from the inside, along axes, through
/// vertices and along edges.
fn rays() -> impl Strategy<Value = (DVec3, DVec3, f64)> {
    let unit = prop::array::uniform3(-1.0..1.0);
    let inside = prop::array::uniform3(0.0..1.0);
    let log_distance = prop_oneof![-3.0..0.5, 0.5..6.0f64];
    (unit, inside, log_distance, 0..6u8, 0.3..3.0).prop_map(|(d, p, log, kind, length)| {
        let cells = DVec3::from(SIZE.map(|n| (n - 1) as f64));
        let mut p = DVec3::from(p) * cells;
        let mut d = DVec3::from(d);
        match kind {
            // Through a vertex.
            0 => p = p.round(),
            // Parallel to an axis, within a face between cells, along an edge.
            1 => d = DVec3::X * d.x.signum(),
            2 => {
                p.y = p.y.round();
                d = DVec3::Z;
            }
            3 => {
                p = DVec3::new(p.x.round(), p.y, p.z.round());
                d = DVec3::NEG_Y;
            }
            _ => {}
        }
        let d = d.normalize_or(DVec3::X) * length;
        let distance = 10f64.powf(log);
        (at_cell(p) - d / length * distance * BOX.size().length(), d, distance)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn first_hits_are_those_of_dense_bracketing((o, d, distance) in rays(), kind in 0..3usize) {
        let surface = surface(kind);
        let expected = oracle(&surface, o, d);
        let hit = surface.intersect(o, d, 0.0, f64::INFINITY);
        let found = all(&surface, o, d);
        prop_assert_eq!(hit.map(|hit| hit.t), found.first().copied());
        prop_assert!(found.windows(2).all(|pair| pair[0] <= pair[1] + 1e-12 * (1.0 + distance)));
        // Both know where the ray is to within some roundings of how far it has come.
        let near = 4e-16 * (distance + 10.0) * BOX.size().length() * 8.0;
        for &t in &found {
            let off = value(&surface, o + t * d).abs();
            // No value changes by more than 12 a cell, and a cell is longer than 0.17.
            prop_assert!(off <= near * 12.0 / 0.17 + 1e-14, "{} off at {}", off, t);
        }
        // None of those that the oracle knows is lost, unless it only touches or runs within the level.
        for &t in &expected {
            let is_found = found.iter().any(|f| (f - t).abs() * d.length() < 1e-7 * (1.0 + distance));
            let probe = |t: f64| value(&surface, o + t * d).abs();
            let flat = probe(t - 1e-5 / d.length()).min(probe(t + 1e-5 / d.length())) < near * 80.0;
            prop_assert!(is_found || flat, "{} of {:?} not in {:?}", t, expected, found);
        }
        // Inside and outside take turns.
        if kind == 2 && BOX.clip(o, d).is_some_and(|(enter, _)| enter > 0.0) {
            prop_assert_eq!(found.len() % 2, 0, "{:?}", found);
        }
        // Cut short, and from beyond the first.
        if let Some(&first) = found.first() {
            prop_assert!(!surface.occluded(o, d, 0.0, first * (1.0 - 1e-9)));
            prop_assert!(surface.occluded(o, d, 0.0, first));
            // Beginning elsewhere in a cell may move a root by its rounding, or meet it again.
            let eps = near.max(1e-7) / d.length();
            let mut rest = Vec::new();
            surface.crossings(o, d, first, f64::INFINITY, |t| {
                rest.push(t);
                true
            });
            let later = |found: Vec<f64>| apart(found).into_iter().find(|t| t - first > eps);
            let (rest, next) = (later(rest), later(found));
            // Of two that nearly are one, both may be gone from so near; and a root of a grazing ray is as
            // uncertain as it is slow to pass.
            let is_steep = |t: f64| {
                let ahead = 1e-5 / d.length();
                let change = value(&surface, o + (t + ahead) * d) - value(&surface, o + (t - ahead) * d);
                change.abs() > 1e-6
            };
            let is_near = next.is_some_and(|t| t - first < 20.0 * eps);
            if is_near || distance > 100.0 || !is_steep(first) || !next.is_none_or(is_steep) {
                return Ok(());
            }
            match (rest, next) {
                (Some(a), Some(b)) => prop_assert!((a - b).abs() <= eps * 10.0, "{} {}", a, b),
                (a, b) => prop_assert_eq!(a, b),
            }
        }
    }

    #[test]
    fn points_are_on_the_surface_and_normals_point_to_lower_values(
        (o, d, distance) in rays(), kind in 0..3usize
    ) {
        if distance > 100.0 {
            return Ok(());
        }
        let surface = surface(kind);
        let Some(hit) = surface.intersect(o, d, 0.0, f64::INFINITY) else { return Ok(()) };
        // As f32 would have it.
        let rounded = o + d * f64::from(hit.t as f32);
        let point = surface.surface_at(rounded, hit.part);
        let moved = point.position.distance(rounded);
        let slope = surface.gradient(point.position).length();
        // Where the gradient vanishes nothing can be said.
        if slope < 1e-2 {
            return Ok(());
        }
        prop_assert!(moved <= 1e-5 * (1.0 + distance), "moved by {}", moved);
        let left = value(&surface, point.position).abs();
        // Far less than f32 could tell.
        prop_assert!(left < 1e-9 * slope, "{} of {}", left, value(&surface, rounded));
        prop_assert!((point.normal.length() - 1.0).abs() < 1e-12);
        // By differences within the cell; across a face the other side may answer.
        let h = 1e-6;
        let p = point.position;
        let inside = surface.to_grid(p);
        if (inside - inside.round()).abs().min_element() < 1e-4 {
            return Ok(());
        }
        let along = |axis: DVec3| value(&surface, p + h * axis) - value(&surface, p - h * axis);
        let gradient = DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)) / (2.0 * h);
        prop_assert!((point.normal + gradient / slope).length() < 1e-7 / slope.min(1.0));
        // About how fast the normal turns.
        let step = 1e-5 * DVec3::new(0.3, -0.7, 0.6).cross(point.normal);
        let turned = surface.gradient(p + step).normalize().distance(-point.normal);
        prop_assert!(turned <= 1.01 * surface.curvature(p, 0) * step.length() + 1e-9);
    }
}

/// Nothing slips through between cells: from a point inside, every way leads out.
#[test]
fn no_ray_leaves_a_closed_surface_unseen() {
    let surface = surface(2);
    let mut inside = 0;
    for i in 1..14u32 {
        for j in 1..8u32 {
            for k in 1..11u32 {
                // On vertices, edges and faces.
                let half = |n: u32| f64::from(n) + if (i + j + k) % 3 == n % 3 { 0.5 } else { 0.0 };
                let o = at_cell(DVec3::new(half(i), half(j), half(k)));
                if !(value(&surface, o) > 0.0) {
                    continue;
                }
                inside += 1;
                for d in [
                    DVec3::X,
                    DVec3::NEG_Y,
                    DVec3::Z,
                    DVec3::ONE * surface.scale.recip(),
                    DVec3::new(1.0, -1.0, 0.0) * surface.scale.recip(),
                    DVec3::new(0.3, 0.7, -0.2),
                ] {
                    assert_eq!(all(&surface, o, d).len() % 2, 1, "{o} {d}");
                    assert!(surface.occluded(o, d, 0.0, f64::INFINITY));
                }
            }
        }
    }
    assert!(inside > 300, "{inside}");
}

#[test]
fn a_sphere_of_distances_is_nearly_a_sphere() {
    let n = 41;
    let value = |i: usize, j: usize, k: usize| {
        let p = DVec3::new(i as f64, j as f64, k as f64) / 20.0 - 1.0;
        (0.8 - p.length()) as f32
    };
    let bounds = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };
    let grid = Arc::new(Grid::from_fn([n; 3], value).unwrap());
    let surface = Isosurface::new(grid, bounds, 0.0, true);
    for i in 0..200 {
        let a = f64::from(i);
        let from = DVec3::new((1.3 * a).sin(), (0.7 * a).cos(), (2.1 * a).sin()).normalize();
        let hit = surface.intersect(3.0 * from, -from, 0.0, 9.0).unwrap();
        assert!((hit.t - 2.2).abs() < 1e-3);
        let point = surface.surface_at(3.0 * from - hit.t * from, 0);
        assert!(point.normal.distance(from) < 0.08);
        let smooth = surface.shading_normal(point.position, 0).unwrap();
        assert!(smooth.distance(from) < 0.002, "{}", smooth.distance(from));
        // From the inside, the same surface.
        let inside = surface.intersect(DVec3::ZERO, from, 0.0, 9.0).unwrap();
        assert!((inside.t - (3.0 - hit.t)).abs() < 1e-14);
    }
    assert!(surface.intersect(DVec3::new(3.0, 0.9, 0.0), DVec3::NEG_X, 0.0, 9.0).is_none());
}
