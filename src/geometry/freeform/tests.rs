//! The triangles against the surfaces, evaluated in other ways.

use std::collections::HashMap;
use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DVec2, DVec3, DVec4, Vec3};
use proptest::prelude::*;

use super::*;

/// The 32 patches of the teapot.
fn teapot() -> Vec<BezierPatch> {
    let text = include_str!("../../../scenes/meshes/teapot.bpt");
    let numbers: Vec<Vec<f64>> =
        text.lines().map(|l| l.split(' ').map(|w| w.parse().unwrap()).collect()).collect();
    let points: Vec<DVec3> =
        numbers.iter().filter(|n| n.len() == 3).map(|n| DVec3::new(n[0], n[1], n[2])).collect();
    points.as_chunks::<16>().0.iter().map(BezierPatch::bicubic).collect()
}

/// Numbers as good as random ones.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

/// A sum of Bernstein polynomials over homogeneous control points.
fn bernstein(degree: [usize; 2], control: &[DVec4], u: f64, v: f64) -> DVec3 {
    let basis = |n: usize, i: usize, t: f64| {
        let choose = (0..i).fold(1.0, |c, k| c * (n - k) as f64 / (k + 1) as f64);
        choose * t.powi(i as i32) * (1.0 - t).powi((n - i) as i32)
    };
    let mut sum = DVec4::ZERO;
    for j in 0..=degree[1] {
        for i in 0..=degree[0] {
            let c = control[j * (degree[0] + 1) + i];
            sum += c * basis(degree[0], i, u) * basis(degree[1], j, v);
        }
    }
    sum.truncate() / sum.w
}

/// Distance of a point from a triangle: that of the weights of its corners that are nearest, by the
/// normal equations, or on a side where one of them would be negative.
pub(super) fn distance(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> f64 {
    let (u, v, w) = (b - a, c - a, p - a);
    let (uu, uv, vv, wu, wv) = (u.dot(u), u.dot(v), v.dot(v), w.dot(u), w.dot(v));
    let area = uu * vv - uv * uv;
    let (s, t) = ((vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area);
    if area > 1e-12 * uu * vv && s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return (w - u * s - v * t).length();
    }
    let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| {
        let k = ((p - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
        p.distance(from.lerp(to, k))
    });
    sides.into_iter().fold(f64::INFINITY, f64::min)
}

/// The corners of every triangle.
fn triangles(mesh: &TriangleMesh) -> Vec<[DVec3; 3]> {
    let corner = |p: Vec3| p.as_dvec3() + mesh.origin;
    (0..mesh.triangles.len()).map(|i| mesh.corners(i).map(corner)).collect()
}

fn farthest(points: impl Iterator<Item = DVec3>, triangles: &[[DVec3; 3]]) -> f64 {
    let nearest = |p: DVec3| triangles.iter().map(|t| distance(p, t)).fold(f64::INFINITY, f64::min);
    points.map(nearest).fold(0.0, f64::max)
}

/// Edges by the bits of their ends, with how often they are gone along upwards and downwards.
fn edges(mesh: &TriangleMesh) -> HashMap<[[u32; 3]; 2], [u32; 2]> {
    let mut edges = HashMap::new();
    for i in 0..mesh.triangles.len() {
        // Zero has two sets of bits.
        let corners = mesh.corners(i).map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_insert([0, 0])[usize::from(a > b)] += 1;
        }
    }
    edges
}

fn assert_closed(mesh: &TriangleMesh) {
    assert!(!mesh.triangles.is_empty());
    for (edge, uses) in edges(mesh) {
        assert_eq!(uses, [1, 1], "{:?}", edge.map(|p| p.map(f32::from_bits)));
    }
}

fn assert_sound(mesh: &TriangleMesh) {
    for n in mesh.normals.as_ref().unwrap().iter() {
        assert!((Vec3::from(*n).length() - 1.0).abs() < 1e-6, "{n:?}");
    }
    assert!(mesh.positions.as_flat().iter().all(|x| x.is_finite()));
}

fn mesh_of(patches: &[BezierPatch], tolerance: f64) -> TriangleMesh {
    let surface = FreeformSurface::Patches(patches.to_vec());
    surface.tessellate(&|_| tolerance, MAX_TRIANGLES).unwrap()
}

fn grid(n: u32) -> impl Iterator<Item = [f64; 2]> {
    (0..=n).flat_map(move |j| (0..=n).map(move |i| [i, j].map(|k| f64::from(k) / f64::from(n))))
}

fn bicubic_samples(patch: &BezierPatch, n: u32) -> impl Iterator<Item = DVec3> {
    grid(n).map(|[u, v]| bernstein([3, 3], patch.control(), u, v))
}

#[test]
fn the_teapot_is_symmetrical_and_its_patches_meet() {
    let patches = teapot();
    assert_eq!(patches.len(), 32);
    // Mirrored at y = 0 it has the same control points.
    let key = |p: DVec3| p.to_array().map(|x| (x * 1e6).round() as i64);
    let mut all: Vec<_> =
        patches.iter().flat_map(BezierPatch::control).map(|c| key(c.truncate())).collect();
    all.sort_unstable();
    let mut mirrored: Vec<_> = all.iter().map(|[x, y, z]| [*x, -y, *z]).collect();
    mirrored.sort_unstable();
    assert_eq!(all, mirrored);
    all.dedup();
    // 306 vertices as published, of which 4 are unused and 12 of the bottom repeat those of the body.
    assert_eq!(all.len(), 290);
    // Of the sides that have a length 16 are ends: four at the rim, the lid and the mouths of handle
    // and spout, two of each half.
    let mut sides: HashMap<Vec<[i64; 3]>, u32> = HashMap::new();
    for patch in &patches {
        for side in 0..4 {
            let curve: Vec<_> = patch.edge(side).iter().map(|c| key(c.truncate())).collect();
            let back: Vec<_> = curve.iter().rev().copied().collect();
            *sides.entry(curve.min(back)).or_default() += 1;
        }
    }
    let ends = sides.iter().filter(|(curve, n)| **n == 1 && curve[0] != curve[3]).count();
    assert_eq!(ends, 16);
    assert!(sides.values().all(|&n| n <= 2 || n == 4), "poles are shared by four");
}

#[test]
fn the_teapot_lies_within_the_tolerance() {
    let patches = teapot();
    for tolerance in [0.2, 0.02, 0.005] {
        for patch in &patches {
            let mesh = mesh_of(std::slice::from_ref(patch), tolerance);
            let off = farthest(bicubic_samples(patch, 14), &triangles(&mesh));
            assert!(off <= tolerance + 1e-6, "{off} > {tolerance}");
        }
    }
}

#[test]
fn the_teapot_has_no_cracks() {
    let patches = teapot();
    let mesh = mesh_of(&patches, 0.01);
    assert_sound(&mesh);
    // Each edge has two triangles, but for those on the ends of the surface.
    let mut ends: Vec<Vec<DVec3>> = Vec::new();
    for (i, patch) in patches.iter().enumerate() {
        for side in 0..4 {
            let curve = patch.edge(side);
            let back: Vec<DVec4> = curve.iter().rev().copied().collect();
            let others = patches.iter().enumerate().filter(|(j, _)| *j != i);
            let mut others = others.flat_map(|(_, p)| (0..4).map(|side| p.edge(side)));
            if !others.any(|other| other == curve || other == back) {
                ends.push(
                    (0..=3000)
                        .map(|k| bernstein([3, 0], &curve, f64::from(k) / 3e3, 0.0))
                        .collect(),
                );
            }
        }
    }
    let is_end = |p: [u32; 3]| {
        let p = Vec3::from(p.map(f32::from_bits)).as_dvec3();
        ends.iter().flatten().any(|q| (*q - p).length() < 2e-3)
    };
    let mut open = 0;
    for (edge, uses) in edges(&mesh) {
        if uses != [1, 1] {
            assert!(uses[0] + uses[1] == 1 && edge.into_iter().all(is_end), "{uses:?}");
            open += 1;
        }
    }
    assert!(open > 30);
}

/// The front of all patches is outside.
#[test]
fn the_teapot_is_right_side_out() {
    let mesh = mesh_of(&teapot(), 0.02);
    let normals = mesh.normals.as_ref().unwrap();
    for (corners, t) in triangles(&mesh).iter().zip(mesh.triangles.iter()) {
        let flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let smooth: DVec3 = t.iter().map(|&v| Vec3::from(normals[v as usize]).as_dvec3()).sum();
        assert!(flat.dot(smooth) > 0.5, "{corners:?} {flat} {smooth}");
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let is_body = middle.z < 2.3 && middle.truncate().length() > 1.2 && middle.y.abs() > 0.7;
        assert!(!is_body || flat.dot(middle - DVec3::Z) > 0.0);
    }
    // At the tip of the lid and under the bottom the derivatives vanish.
    let tip =
        (0..mesh.positions.len()).filter(|&i| mesh.positions.get(i) == Vec3::new(0.0, 0.0, 3.15));
    let bottom = (0..mesh.positions.len()).filter(|&i| mesh.positions.get(i) == Vec3::ZERO);
    for (poles, up) in [(tip.collect::<Vec<_>>(), 1.0), (bottom.collect(), -1.0)] {
        assert!(poles.len() >= 4);
        poles.iter().for_each(|&i| assert_eq!(normals[i], [0.0, 0.0, up]));
    }
}

#[test]
fn half_the_tolerance_takes_about_twice_the_triangles() {
    let patches = teapot();
    let counts =
        [0.01, 0.005, 0.0025, 0.00125].map(|t| mesh_of(&patches, t).triangles.len() as f64);
    for pair in counts.windows(2) {
        assert!((1.7..2.3).contains(&(pair[1] / pair[0])), "{counts:?}");
    }
}

#[test]
fn neighbours_that_need_little_follow_those_that_need_much() {
    // A flat patch beside a wavy one.
    let mut noise = Noise(5);
    let flat: [DVec3; 16] =
        std::array::from_fn(|k| DVec3::new((k % 4) as f64, (k / 4) as f64, 0.0));
    let wavy =
        flat.map(|p| DVec3::new(p.x + 3.0, p.y, if p.x > 1.0 { 6.0 * noise.next() } else { 0.0 }));
    let patches = [BezierPatch::bicubic(&flat), BezierPatch::bicubic(&wavy)];
    for tolerance in [0.3, 0.03, 0.003] {
        let mesh = mesh_of(&patches, tolerance);
        let all = triangles(&mesh);
        for patch in &patches {
            let off = farthest(bicubic_samples(patch, 40), &all);
            assert!(off <= tolerance, "{off} > {tolerance}");
        }
        let open = edges(&mesh).into_iter().filter(|(_, uses)| *uses != [1, 1]);
        for (edge, uses) in open {
            let [a, b] = edge.map(|p| p.map(f32::from_bits));
            let is_seam = a[0] == 3.0 && b[0] == 3.0;
            assert!(uses[0] + uses[1] == 1 && !is_seam, "{a:?} {b:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Any bicubic patch, however bent, and wherever it is.
    #[test]
    fn any_patch_lies_within_the_tolerance(seed: u64, far in 0.0..1e7_f64, tolerance in 0.003..0.5_f64) {
        let mut noise = Noise(seed);
        let points: [DVec3; 16] = std::array::from_fn(|_| noise.point() + DVec3::splat(far));
        let patch = BezierPatch::bicubic(&points);
        let mesh = mesh_of(std::slice::from_ref(&patch), tolerance);
        let off = farthest(bicubic_samples(&patch, 20), &triangles(&mesh));
        prop_assert!(off <= tolerance + 1e-6, "{off} > {tolerance}");
        for [u, v] in grid(6) {
            let there = patch.evaluate(u, v).position;
            let scale = 1.0 + far;
            prop_assert!((there - bernstein([3, 3], patch.control(), u, v)).length() < 1e-14 * scale);
        }
    }

    /// Bézier pieces of a NURBS surface against its Cox-de Boor basis functions.
    #[test]
    fn pieces_of_nurbs_are_the_surface(seed: u64, degree in prop::array::uniform2(1..5_usize)) {
        let mut noise = Noise(seed);
        let surface = some_nurbs(&mut noise, degree);
        let patches = surface.surface.to_bezier();
        for patch in &patches {
            for [a, b] in grid(5) {
                let uv = patch.uv(a, b);
                let there = patch.evaluate(a, b);
                let expected = surface.at(uv.x, uv.y);
                let off = (there.position - expected).length();
                prop_assert!(off < 1e-11, "{off} at {uv}");
            }
        }
        // Derivatives by differences, in the middle of the pieces.
        for patch in &patches {
            let h = 1e-5;
            let at = |u: f64, v: f64| patch.evaluate(u, v);
            let point = at(0.4, 0.6);
            let by_u = (at(0.4 + h, 0.6).position - at(0.4 - h, 0.6).position) / (2.0 * h);
            let by_v = (at(0.4, 0.6 + h).position - at(0.4, 0.6 - h).position) / (2.0 * h);
            let scale = 1.0 + point.second.map(DVec3::length).iter().sum::<f64>();
            prop_assert!((by_u - point.first[0]).length() < 1e-6 * scale);
            prop_assert!((by_v - point.first[1]).length() < 1e-6 * scale);
            for (i, by) in [[h, 0.0], [0.0, h]].into_iter().enumerate() {
                let (ahead, back) = (at(0.4 + by[0], 0.6 + by[1]), at(0.4 - by[0], 0.6 - by[1]));
                for k in 0..2 {
                    let second = (ahead.first[k] - back.first[k]) / (2.0 * h);
                    prop_assert!((second - point.second[i + k]).length() < 1e-4 * scale);
                }
            }
            // And their bounds.
            let bounds = patch.second_derivatives();
            for [u, v] in grid(9) {
                let second = at(u, v).second.map(DVec3::length);
                for (value, bound) in second.into_iter().zip(bounds) {
                    prop_assert!(value <= bound * (1.0 + 1e-9) + 1e-9, "{value} > {bound}");
                }
            }
        }
    }

    #[test]
    fn nurbs_lie_within_the_tolerance(seed: u64, tolerance in 0.02..0.5_f64) {
        let surface = some_nurbs(&mut Noise(seed), [2, 3]);
        let mesh = mesh_of(&surface.surface.to_bezier(), tolerance);
        let samples = grid(40).map(|[u, v]| surface.at(u, v));
        let off = farthest(samples, &triangles(&mesh));
        prop_assert!(off <= tolerance + 1e-6, "{off} > {tolerance}");
    }
}

/// A surface beside what it is made of.
struct SomeNurbs {
    surface: NurbsSurface,
    degree: [usize; 2],
    knots: [Vec<f64>; 2],
    points: Vec<DVec3>,
    weights: Vec<f64>,
    count: [usize; 2],
}

/// Uneven knots, some of them double; neither end is clamped.
fn some_nurbs(noise: &mut Noise, degree: [usize; 2]) -> SomeNurbs {
    let count = degree.map(|p| p + 3);
    let knots = degree.map(|p| {
        let mut t = -3.0;
        let mut step = || {
            t += if p > 1 && noise.next() < 0.2 { 0.0 } else { 0.2 + noise.next() };
            t
        };
        (0..2 * p + 4).map(|_| step()).collect::<Vec<f64>>()
    });
    let n = count[0] * count[1];
    let points: Vec<DVec3> = (0..n).map(|_| noise.point()).collect();
    let weights: Vec<f64> = (0..n).map(|_| 0.3 + 2.0 * noise.next()).collect();
    let surface = NurbsSurface::new(degree, knots.clone(), count, &points, Some(&weights));
    let surface = match surface {
        Ok(surface) => surface,
        // Three of a knot of degree 2, or no interval: another throw.
        Err(_) => return some_nurbs(noise, degree),
    };
    SomeNurbs { surface, degree, knots, points, weights, count }
}

impl SomeNurbs {
    /// The point where u and v go from 0 to 1, from the recursive definition of the basis functions.
    fn at(&self, u: f64, v: f64) -> DVec3 {
        fn basis(t: &[f64], i: usize, p: usize, x: f64, last: f64) -> f64 {
            if p == 0 {
                // The last interval holds its end.
                let is_in = if x == last {
                    t[i] < last && t[i + 1] == last
                } else {
                    t[i] <= x && x < t[i + 1]
                };
                return f64::from(u8::from(is_in));
            }
            let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
            ratio(x - t[i], t[i + p] - t[i]) * basis(t, i, p - 1, x, last)
                + ratio(t[i + p + 1] - x, t[i + p + 1] - t[i + 1]) * basis(t, i + 1, p - 1, x, last)
        }
        let values: [Vec<f64>; 2] = std::array::from_fn(|k| {
            let (t, p, n) = (&self.knots[k], self.degree[k], self.count[k]);
            let (low, high) = (t[p], t[n]);
            let x = (low + (high - low) * [u, v][k]).clamp(low, high);
            (0..n).map(|i| basis(t, i, p, x, high)).collect()
        });
        let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
        for (j, b) in values[1].iter().enumerate() {
            for (i, a) in values[0].iter().enumerate() {
                let k = j * self.count[0] + i;
                sum += a * b * self.weights[k] * self.points[k];
                weight += a * b * self.weights[k];
            }
        }
        sum / weight
    }
}

/// The nine control points of a circle about the origin, and their weights.
fn circle() -> ([DVec2; 9], [f64; 9], Vec<f64>) {
    let points = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]];
    let weights = std::array::from_fn(|i| if i % 2 == 0 { 1.0 } else { FRAC_1_SQRT_2 });
    let knots = vec![0.0, 0.0, 0.0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1.0, 1.0, 1.0];
    (points.map(|[x, y]| DVec2::new(f64::from(x), f64::from(y))), weights, knots)
}

/// A profile (radius, height) turned about an axis through `center`.
fn turned(profile: &[(DVec2, f64)], knots: Vec<f64>, center: DVec3) -> NurbsSurface {
    let (around, turn_weights, turn_knots) = circle();
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for (p, w) in profile {
        for (q, turn) in around.iter().zip(turn_weights) {
            points.push(center + DVec3::new(p.x * q.x, p.x * q.y, p.y));
            weights.push(w * turn);
        }
    }
    let count = [9, profile.len()];
    NurbsSurface::new([2, 2], [turn_knots, knots], count, &points, Some(&weights)).unwrap()
}

fn sphere(radius: f64, center: DVec3) -> NurbsSurface {
    let half = [[0, -1], [1, -1], [1, 0], [1, 1], [0, 1]];
    let weight = |i: usize| if i.is_multiple_of(2) { 1.0 } else { FRAC_1_SQRT_2 };
    let half = half.map(|[x, y]| DVec2::new(f64::from(x), f64::from(y)) * radius);
    let profile: Vec<_> = half.into_iter().enumerate().map(|(i, p)| (p, weight(i))).collect();
    turned(&profile, vec![0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.0], center)
}

fn torus(major: f64, minor: f64) -> NurbsSurface {
    let (around, weights, knots) = circle();
    let profile: Vec<_> = around
        .into_iter()
        .zip(weights)
        .map(|(p, w)| (DVec2::new(major + minor * p.x, minor * p.y), w))
        .collect();
    turned(&profile, knots, DVec3::ZERO)
}

#[test]
fn spheres_and_tori_are_exact_and_closed() {
    // A centre whose sums round, so that poles and seams are not the same numbers by themselves.
    let center = DVec3::new(0.1, 0.3, 0.7);
    let ball = sphere(1.3, center).to_bezier();
    for patch in &ball {
        for [u, v] in grid(16) {
            let p = patch.evaluate(u, v).position - center;
            assert!((p.length() - 1.3).abs() < 1e-12);
            // Also at the poles and on the seam.
            assert!((patch.normal(u, v) - p / 1.3).length() < 1e-9, "{} {p}", patch.normal(u, v));
        }
    }
    for tolerance in [0.3, 0.01, 0.003] {
        let mesh = mesh_of(&ball, tolerance);
        assert_closed(&mesh);
        assert_sound(&mesh);
        let samples =
            ball.iter().flat_map(|patch| grid(4).map(|[u, v]| patch.evaluate(u, v).position));
        let off = farthest(samples, &triangles(&mesh));
        assert!(off <= tolerance && off > 0.1 * tolerance, "{off} {tolerance}");
    }

    let ring = torus(2.0, 0.5).to_bezier();
    for patch in &ring {
        for [u, v] in grid(12) {
            let p = patch.evaluate(u, v).position;
            let out = p.truncate().length() - 2.0;
            assert!((out.hypot(p.z) - 0.5).abs() < 1e-12);
        }
    }
    let mesh = mesh_of(&ring, 0.01);
    assert_closed(&mesh);
    assert_sound(&mesh);
}

#[test]
fn parameters_become_texture_coordinates() {
    let mesh = mesh_of(&torus(2.0, 0.5).to_bezier(), 0.05);
    let uvs = mesh.uvs.unwrap();
    let range = |k: usize| {
        let all = uvs.iter().map(|uv| uv[k]);
        (all.clone().fold(f32::INFINITY, f32::min), all.fold(f32::NEG_INFINITY, f32::max))
    };
    assert_eq!((range(0), range(1)), ((0.0, 1.0), (0.0, 1.0)));
    for (i, uv) in uvs.iter().enumerate() {
        // A quarter turn is a quarter of u.
        let p = mesh.positions.get(i);
        let quarter = (p.y.atan2(p.x) / std::f32::consts::TAU).rem_euclid(1.0);
        let off = (quarter - uv[0]).rem_euclid(1.0);
        assert!(off.min(1.0 - off) < 0.02, "{quarter} {uv:?}");
    }
}

#[test]
fn far_surfaces_keep_their_digits() {
    let center = DVec3::new(4e6, -7e6, 2e6);
    let mesh = mesh_of(&sphere(1.0, center).to_bezier(), 0.001);
    assert!(mesh.origin.length() > 1e6);
    for corner in triangles(&mesh).iter().flatten() {
        assert!(((*corner - center).length() - 1.0).abs() < 1e-6);
    }
    assert_closed(&mesh);
}

#[test]
fn bad_surfaces_are_refused() {
    let knots = |k: &[f64]| k.to_vec();
    let line = knots(&[0.0, 0.0, 1.0, 1.0]);
    let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE];
    let try_with = |degree, knots: [Vec<f64>; 2], weights: Option<&[f64]>| {
        NurbsSurface::new(degree, knots, [2, 2], &points, weights).unwrap_err().to_string()
    };
    for (message, expected) in [
        (
            try_with([0, 1], [line.clone(), line.clone()], None),
            "the degree along u must be from 1 to 15",
        ),
        (try_with([1, 2], [line.clone(), line.clone()], None), "degree 2 along v takes at least 3"),
        (
            try_with([1, 1], [line.clone(), knots(&[0.0, 1.0])], None),
            "`knots_v` must have 4 numbers",
        ),
        (
            try_with([1, 1], [knots(&[0.0, 2.0, 1.0, 3.0]), line.clone()], None),
            "`knots_u` must not decrease, as number 2",
        ),
        (
            try_with([1, 1], [knots(&[1.0; 4]), line.clone()], None),
            "`knots_u` has 1 more than 2 times",
        ),
        (
            try_with([1, 1], [knots(&[0.0, 1.0, 1.0, 2.0]), line.clone()], None),
            "`knots_u` are all the same where the surface is",
        ),
        (
            try_with([1, 1], [line.clone(), line.clone()], Some(&[1.0; 3])),
            "one weight for each of the 4",
        ),
        (
            try_with([1, 1], [line.clone(), line.clone()], Some(&[1.0, 0.0, 1.0, 1.0])),
            "weights must be above 0, unlike number 1",
        ),
        (try_with([1, 1], [knots(&[0.0, 0.0, 1.0, f64::NAN]), line], None), "must be finite"),
    ] {
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn too_small_a_tolerance_names_one_that_fits() {
    let surface = FreeformSurface::Patches(teapot());
    let error = surface.tessellate(&|_| 1e-12, 50_000).unwrap_err();
    assert!(error.to_string().contains("a tolerance of 1.0e-12 m takes more than 50000 triangles"));
    let mesh = surface.tessellate(&|_| error.fits, 50_000).unwrap();
    assert!((10_000..50_000).contains(&mesh.triangles.len()), "{}", mesh.triangles.len());
}

#[test]
fn nothing_comes_of_what_has_no_area() {
    for points in [[DVec3::ONE; 16], std::array::from_fn(|i| DVec3::X * (i % 4) as f64)] {
        let mesh = mesh_of(&[BezierPatch::bicubic(&points)], 0.1);
        assert!(mesh.positions.as_flat().iter().all(|x| x.is_finite()));
    }
    assert!(mesh_of(&[], 0.1).triangles.is_empty());
}
