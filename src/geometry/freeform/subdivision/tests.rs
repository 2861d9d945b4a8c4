//! The limit surface against closed forms, and against a second implementation that is refined further.

use std::collections::{BTreeMap, HashSet};

use glam::{DVec3, Vec3};

use super::*;
use crate::geometry::TriangleMesh;
use crate::geometry::freeform::tests::distance;
use crate::geometry::freeform::{FreeformSurface, MAX_TRIANGLES};

const CUBE: [[u32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

fn cube_corners() -> Vec<DVec3> {
    let sign = |i: usize, bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    (0..8).map(|i| DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect()
}

fn cube(creases: &[[u32; 2]]) -> SubdivisionSurface {
    SubdivisionSurface::new(cube_corners(), CUBE, creases).unwrap()
}

/// The edges of the faces z = −1 and z = 1.
const RIMS: [[u32; 2]; 8] = [[0, 1], [1, 3], [3, 2], [2, 0], [4, 5], [5, 7], [7, 6], [6, 4]];

/// A prism of `n` sides: quadrilaterals between two polygons.
fn prism(n: u32) -> SubdivisionSurface {
    let point = |i: u32, z: f64| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        DVec3::new(angle.cos(), angle.sin(), z)
    };
    let positions = (0..n).map(|i| point(i, -1.0)).chain((0..n).map(|i| point(i, 1.0))).collect();
    let sides = (0..n).map(|i| vec![i, (i + 1) % n, (i + 1) % n + n, i + n]);
    let faces = sides.chain([(0..n).rev().collect(), (n..2 * n).collect()]);
    SubdivisionSurface::new(positions, faces, &[]).unwrap()
}

fn sheet(n: u32, height: impl Fn(u32, u32) -> f64) -> SubdivisionSurface {
    let all = |m: u32| (0..m).flat_map(move |j| (0..m).map(move |i| (i, j)));
    let positions =
        all(n + 1).map(|(i, j)| DVec3::new(f64::from(i), f64::from(j), height(i, j))).collect();
    let faces = all(n).map(|(i, j)| {
        let at = |i: u32, j: u32| j * (n + 1) + i;
        [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
    });
    SubdivisionSurface::new(positions, faces, &[]).unwrap()
}

fn mesh_of(surface: &SubdivisionSurface, tolerance: f64) -> TriangleMesh {
    FreeformSurface::Subdivision(surface.clone()).tessellate(&|_| tolerance, MAX_TRIANGLES).unwrap()
}

fn edges(mesh: &TriangleMesh) -> BTreeMap<[[u32; 3]; 2], [u32; 2]> {
    let mut edges = BTreeMap::new();
    for i in 0..mesh.triangles.len() {
        let corners = mesh.corners(i).map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_insert([0, 0])[usize::from(a > b)] += 1;
        }
    }
    edges
}

/// Catmull-Clark as the paper has it, by maps and sums, with creases and without pinned vertices: the
/// points of the control mesh after some levels.
fn refined(surface: &SubdivisionSurface, levels: usize) -> Vec<DVec3> {
    let mut points = surface.positions().to_vec();
    let mut faces: Vec<Vec<usize>> =
        surface.faces().map(|f| f.iter().map(|&v| v as usize).collect()).collect();
    let mut creases: HashSet<(usize, usize)> =
        surface.creases().iter().map(|e| (e[0] as usize, e[1] as usize)).collect();
    for _ in 0..levels {
        let centers: Vec<DVec3> = faces
            .iter()
            .map(|f| f.iter().map(|&v| points[v]).sum::<DVec3>() / f.len() as f64)
            .collect();
        let mut around: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        for (i, f) in faces.iter().enumerate() {
            for k in 0..f.len() {
                let (a, b) = (f[k], f[(k + 1) % f.len()]);
                around.entry((a.min(b), a.max(b))).or_default().push(i);
            }
        }
        let mut next = points.clone();
        for (v, to) in next.iter_mut().enumerate() {
            let mine: Vec<_> = around.iter().filter(|((a, b), _)| *a == v || *b == v).collect();
            let sharp: Vec<_> = mine
                .iter()
                .filter(|(edge, f)| f.len() != 2 || creases.contains(edge))
                .map(|((a, b), _)| points[a + b - v])
                .collect();
            let touching: Vec<_> = (0..faces.len()).filter(|&f| faces[f].contains(&v)).collect();
            *to = match sharp.len() {
                0 | 1 => {
                    let n = mine.len() as f64;
                    let f = touching.iter().map(|&f| centers[f]).sum::<DVec3>() / n;
                    let r: DVec3 =
                        mine.iter().map(|((a, b), _)| 0.5 * (points[*a] + points[*b])).sum();
                    (f + 2.0 * r / n + (n - 3.0) * points[v]) / n
                }
                2 if touching.len() > 1 => (6.0 * points[v] + sharp[0] + sharp[1]) / 8.0,
                _ => points[v],
            };
        }
        let mut number = BTreeMap::new();
        for (edge, f) in &around {
            let (a, b) = *edge;
            number.insert(*edge, next.len());
            next.push(if f.len() != 2 || creases.contains(edge) {
                0.5 * (points[a] + points[b])
            } else {
                0.25 * (points[a] + points[b] + centers[f[0]] + centers[f[1]])
            });
        }
        creases = creases
            .iter()
            .flat_map(|&(a, b)| [(a, number[&(a, b)]), (b, number[&(a, b)])])
            .collect();
        let first = next.len();
        next.extend(&centers);
        let edge = |a: usize, b: usize| number[&(a.min(b), a.max(b))];
        faces = faces
            .iter()
            .enumerate()
            .flat_map(|(i, f)| {
                let n = f.len();
                (0..n).map(move |k| (i, f[k], f[(k + 1) % n], f[(k + n - 1) % n]))
            })
            .map(|(i, v, after, before)| vec![v, edge(v, after), first + i, edge(before, v)])
            .collect();
        points = next;
    }
    points
}

fn farthest(points: &[DVec3], mesh: &TriangleMesh) -> f64 {
    let all: Vec<[DVec3; 3]> =
        (0..mesh.triangles.len()).map(|i| mesh.corners(i).map(Vec3::as_dvec3)).collect();
    let nearest = |p: &DVec3| all.iter().map(|t| distance(*p, t)).fold(f64::INFINITY, f64::min);
    points.iter().map(nearest).fold(0.0, f64::max)
}

#[test]
fn the_corners_of_a_cube_go_to_a_half() {
    // (9 V + 4 ΣE + ΣF) / 24 with V = (1, 1, 1), ΣE = (1, 1, 1), ΣF = (−1, −1, −1).
    let mesh = mesh_of(&cube(&[]), 0.01);
    let normals = mesh.normals.as_ref().unwrap();
    for corner in cube_corners() {
        let p = (0.5 * corner).as_vec3();
        let at: Vec<_> = (0..mesh.positions.len())
            .filter(|&i| (mesh.positions.get(i) - p).length() < 1e-6)
            .collect();
        assert_eq!(at.len(), 1, "one vertex at {p}");
        let expected = corner.normalize();
        assert!((Vec3::from(normals[at[0]]).as_dvec3() - expected).length() < 1e-6);
    }
    // The middle of a face: of its first refinement, with four neighbours, all by symmetry.
    let first = refined(&cube(&[]), 12 / 3);
    let top = first.iter().map(|p| p.z).fold(0.0, f64::max);
    let highest = (0..mesh.positions.len()).map(|i| mesh.positions.get(i).z).fold(0.0, f32::max);
    assert!((f64::from(highest) - top).abs() < 0.01);
}

#[test]
fn surfaces_lie_within_the_tolerance() {
    let bumpy = sheet(3, |i, j| f64::from((i * 7 + j * 5) % 4) * 0.5);
    let open = SubdivisionSurface::new(cube_corners(), CUBE[1..].iter().copied(), &[]).unwrap();
    for (name, surface) in [
        ("cube", cube(&[])),
        ("rims", cube(&RIMS)),
        ("dart", cube(&[[0, 1], [1, 3]])),
        ("prism", prism(7)),
        ("tetrahedron", tetrahedron()),
        ("sheet", bumpy),
        ("open", open),
    ] {
        // Control points approach the limit as 4^-level.
        let points = refined(&surface, 4);
        let slack = 0.008;
        for tolerance in [0.2, 0.03] {
            let off = farthest(&points, &mesh_of(&surface, tolerance));
            assert!(off <= tolerance + slack, "{name}: {off} > {tolerance}");
        }
    }
}

fn tetrahedron() -> SubdivisionSurface {
    let positions = [0, 3, 5, 6].map(|i| cube_corners()[i]).to_vec();
    SubdivisionSurface::new(positions, [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], &[]).unwrap()
}

#[test]
fn closed_surfaces_have_no_cracks() {
    for surface in [cube(&[]), cube(&RIMS), prism(5), tetrahedron()] {
        let mesh = mesh_of(&surface, 0.005);
        assert!(edges(&mesh).values().all(|uses| *uses == [1, 1]));
        // From outside they turn anticlockwise.
        let volume: f64 = (0..mesh.triangles.len())
            .map(|i| mesh.corners(i).map(Vec3::as_dvec3))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        assert!(volume > 0.1);
    }
}

#[test]
fn normals_are_those_of_the_triangles() {
    let bumpy = sheet(3, |i, j| f64::from((i * 7 + j * 5) % 4) * 0.3);
    for (name, surface) in [
        ("cube", cube(&[])),
        ("rims", cube(&RIMS)),
        ("prism", prism(7)),
        ("tetrahedron", tetrahedron()),
        ("sheet", bumpy),
    ] {
        let mesh = mesh_of(&surface, 3e-3);
        let normals = mesh.normals.as_ref().unwrap();
        let mut sums = vec![DVec3::ZERO; normals.len()];
        for (i, t) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(i).map(Vec3::as_dvec3);
            t.iter().for_each(|&v| sums[v as usize] += (b - a).cross(c - a));
        }
        for (i, (normal, sum)) in normals.iter().zip(sums).enumerate() {
            let normal = Vec3::from(*normal).as_dvec3();
            assert!((normal.length() - 1.0).abs() < 1e-6);
            let off = normal.angle_between(sum.normalize());
            assert!(off < 0.35, "{name}: {off} at {}", mesh.positions.get(i));
        }
    }
}

#[test]
fn creases_are_cubic_splines() {
    // The rim of the cube: control points of a closed cubic B-spline, at (V₋ + 4 V + V₊) / 6.
    let mesh = mesh_of(&cube(&RIMS), 0.01);
    let expected = Vec3::new(2.0 / 3.0, 2.0 / 3.0, 1.0);
    let at: Vec<_> = (0..mesh.positions.len())
        .filter(|&i| (mesh.positions.get(i) - expected).length() < 1e-6)
        .collect();
    // A vertex for either side.
    assert_eq!(at.len(), 2);
    let normals = mesh.normals.as_ref().unwrap();
    let mut up: Vec<f32> = at.iter().map(|&i| normals[i][2]).collect();
    up.sort_by(f32::total_cmp);
    assert!(up[0].abs() < 0.5 && (up[1] - 1.0).abs() < 1e-6, "{up:?}");
    // The lid is flat.
    let lid = (0..mesh.positions.len()).filter(|&i| mesh.positions.get(i).z > 1.0 - 1e-6).count();
    assert!(lid > 20);
}

#[test]
fn all_creases_leave_the_cube_as_it_is() {
    let all: Vec<[u32; 2]> = RIMS.into_iter().chain([[0, 4], [1, 5], [2, 6], [3, 7]]).collect();
    let mesh = mesh_of(&cube(&all), 0.01);
    assert_eq!(mesh.triangles.len(), 12, "flat faces take two triangles");
    assert!(mesh.positions.as_flat().iter().all(|x| x.abs() == 1.0));
    assert_eq!(mesh.positions.len(), 24);
}

#[test]
fn a_flat_sheet_stays_a_square() {
    let mesh = mesh_of(&sheet(2, |_, _| 0.0), 0.01);
    let bounds = mesh.bounds();
    assert_eq!((bounds.min, bounds.max), (DVec3::ZERO, DVec3::new(2.0, 2.0, 0.0)));
    assert!(mesh.normals.unwrap().iter().all(|n| *n == [0.0, 0.0, 1.0]));
    let corner = |p: Vec3| (0..mesh.positions.len()).any(|i| mesh.positions.get(i) == p);
    assert!(corner(Vec3::ZERO) && corner(Vec3::new(2.0, 2.0, 0.0)));
}

#[test]
fn half_the_tolerance_takes_at_most_a_level_more() {
    let count = |t: f64| mesh_of(&cube(&[]), t).triangles.len();
    let counts = [0.016, 0.004, 0.001].map(count);
    for pair in counts.windows(2) {
        assert!((2..=17).contains(&(pair[1] / pair[0])), "{counts:?}");
    }
    assert!(count(0.001) < 20_000, "{counts:?}");
}

#[test]
fn what_is_no_manifold_is_accepted() {
    // Three faces at an edge; two fans at a vertex; faces that disagree; a Möbius strip.
    let p = cube_corners();
    let strip: Vec<DVec3> = (0..10)
        .map(|i| {
            let angle = std::f64::consts::TAU * f64::from(i / 2) / 5.0;
            let side = if i % 2 == 0 { 0.3 } else { -0.3 };
            let out = 1.0 + side * (0.5 * angle).cos();
            DVec3::new(out * angle.cos(), out * angle.sin(), side * (0.5 * angle).sin())
        })
        .collect();
    for (positions, faces) in [
        (p.clone(), vec![vec![0, 1, 3, 2], vec![0, 1, 5, 4], vec![0, 1, 7]]),
        (p.clone(), vec![vec![0, 1, 2], vec![0, 5, 6]]),
        (p, vec![vec![0, 1, 3, 2], vec![0, 1, 5, 4]]),
        (
            strip,
            vec![
                vec![0, 1, 3, 2],
                vec![2, 3, 5, 4],
                vec![4, 5, 7, 6],
                vec![6, 7, 9, 8],
                vec![8, 9, 0, 1],
            ],
        ),
    ] {
        let surface = SubdivisionSurface::new(positions, faces, &[]).unwrap();
        let mesh = mesh_of(&surface, 0.01);
        assert!(!mesh.triangles.is_empty());
        assert!(mesh.positions.as_flat().iter().all(|x| x.is_finite()));
        assert!(mesh.normals.unwrap().iter().flatten().all(|x| x.is_finite()));
    }
}

#[test]
fn bad_meshes_are_refused() {
    let try_with = |faces: Vec<Vec<u32>>, creases: &[[u32; 2]]| {
        SubdivisionSurface::new(cube_corners(), faces, creases).unwrap_err().to_string()
    };
    for (message, expected) in [
        (try_with(vec![vec![0, 1]], &[]), "face 0 (the first is 0) has 2 corners"),
        (
            try_with(vec![vec![0, 1, 2], vec![0, 1, 9]], &[]),
            "face 1 names vertex 9, but there are 8",
        ),
        (try_with(vec![vec![0, 1, 2, 1]], &[]), "face 0 (the first is 0) names vertex 1 twice"),
        (try_with(vec![vec![0, 1, 2]], &[[3, 0]]), "between the vertices 0 and 3"),
    ] {
        assert!(message.contains(expected), "{message}");
    }
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::new(0.0, f64::NAN, 0.0)];
    let error = SubdivisionSurface::new(positions, [[0, 1, 2]], &[]).unwrap_err();
    assert_eq!(error, ControlMeshError::NotFinite { vertex: 2 });
}

#[test]
fn too_small_a_tolerance_names_one_that_fits() {
    let surface = FreeformSurface::Subdivision(cube(&[]));
    let error = surface.tessellate(&|_| 1e-9, 10_000).unwrap_err();
    assert!(error.fits > 1e-6 && error.fits < 0.1, "{error}");
    assert!(surface.tessellate(&|_| error.fits, 10_000).is_ok());
}
