use std::collections::HashMap;

use glam::DVec3;

use super::*;

fn mesh(kind: GeneratedKind, triangles: u64, seed: u32) -> GeneratedMesh {
    GeneratedMesh::new(kind, triangles, seed).unwrap()
}

fn corners(mesh: &GeneratedMesh, i: u64) -> [DVec3; 3] {
    mesh.triangle(i).map(|v| DVec3::from(mesh.vertex(v.into()).map(f64::from)))
}

#[test]
fn as_many_as_asked_or_what_the_grid_allows() {
    for kind in GeneratedKind::ALL {
        for n in [10_000, 12_345, 1_000_000] {
            let mesh = mesh(kind, n, 0);
            let made = mesh.triangle_count();
            assert!(made <= n && made as f64 >= 0.92 * n as f64, "{kind:?} {n}: {made}");
            // Every vertex is used, and no other is.
            let mut is_used = vec![false; mesh.vertex_count() as usize];
            for i in 0..made {
                mesh.triangle(i).into_iter().for_each(|v| is_used[v as usize] = true);
            }
            assert!(is_used.iter().all(|&used| used), "{kind:?} {n}");
        }
    }
    assert_eq!(mesh(GeneratedKind::Soup, 12_345, 0).triangle_count(), 12_345);
    assert_eq!(mesh(GeneratedKind::Terrain, 2, 0).triangle_count(), 2);
    assert_eq!(mesh(GeneratedKind::Sphere, 12, 0).vertex_count(), 8);
}

#[test]
fn balls_are_closed_and_face_outward() {
    for (kind, n, balls) in [
        (GeneratedKind::Sphere, 12, 1),
        (GeneratedKind::Sphere, 5_000, 1),
        (GeneratedKind::Blobs, 1_212, 101),
        (GeneratedKind::Blobs, 20_000, 101),
    ] {
        let mesh = mesh(kind, n, 3);
        let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
        let mut volume = 0.0;
        for i in 0..mesh.triangle_count() {
            let t = mesh.triangle(i);
            for k in 0..3 {
                *edges.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
            }
            let [a, b, c] = corners(&mesh, i);
            assert!((b - a).cross(c - a).length() > 0.0, "{kind:?} {n}: triangle {i}");
            volume += a.dot(b.cross(c)) / 6.0;
        }
        // Every edge once in each direction.
        for (&(a, b), &count) in &edges {
            assert_eq!((count, edges.get(&(b, a))), (1, Some(&1)), "{kind:?} {n}: {a} {b}");
        }
        // Euler: V − E + F = 2 a ball.
        let (v, f) = (mesh.vertex_count() as i64, mesh.triangle_count() as i64);
        assert_eq!(v - edges.len() as i64 / 2 + f, 2 * balls, "{kind:?} {n}");
        assert!(volume > 0.0);
    }
}

#[test]
fn blobs_lie_within_their_shell() {
    let mesh = mesh(GeneratedKind::Blobs, 200_000, 7);
    let radius = |v: u64| DVec3::from(mesh.vertex(v).map(f64::from)).length();
    let farthest_within = (mesh.vertex_count() - 1000..mesh.vertex_count()).map(radius);
    assert!(farthest_within.fold(0.0, f64::max) < 8.1);
    let nearest_shell = (0..1000).map(radius).fold(f64::INFINITY, f64::min);
    assert!(nearest_shell > 8.4, "{nearest_shell}");
}

#[test]
fn terrain_faces_up_and_has_hills() {
    let mesh = mesh(GeneratedKind::Terrain, 20_000, 1);
    for i in 0..mesh.triangle_count() {
        let [a, b, c] = corners(&mesh, i);
        assert!((b - a).cross(c - a).y > 0.0);
    }
    let heights = (0..mesh.vertex_count()).map(|v| mesh.vertex(v)[1]);
    let (low, high) =
        heights.fold((f32::MAX, f32::MIN), |(low, high), y| (low.min(y), high.max(y)));
    assert!(high - low > 5.0 && high - low < 40.0, "{low} {high}");
}

#[test]
fn slivers_are_thin() {
    let mesh = mesh(GeneratedKind::Slivers, 1000, 2);
    for i in 0..1000 {
        let [a, b, c] = corners(&mesh, i);
        assert!(((b - a).length() - 0.004).abs() < 1e-4);
        assert!((0.99..6.01).contains(&(c - a).length()));
    }
}

#[test]
fn seeds_differ() {
    for kind in GeneratedKind::ALL {
        let vertices = |seed| {
            let mesh = mesh(kind, 5000, seed);
            (0..100).map(move |v| mesh.vertex(v)).collect::<Vec<_>>()
        };
        assert_eq!(vertices(4), vertices(4));
        assert_ne!(vertices(4), vertices(5), "{kind:?}");
    }
}

#[test]
fn numbers_that_cannot_be() {
    let text = |kind, n| GeneratedMesh::new(kind, n, 0).unwrap_err().to_string();
    assert_eq!(
        text(GeneratedKind::Terrain, 1),
        "1 triangles are too few for `terrain`; the least is 2"
    );
    assert_eq!(text(GeneratedKind::Soup, 0), "0 triangles are too few for `soup`; the least is 1");
    assert_eq!(
        text(GeneratedKind::Soup, 2_000_000_000),
        "2000000000 triangles are too many for `soup`; the most is 1431655764"
    );
    assert!(GeneratedMesh::new(GeneratedKind::Sphere, u64::MAX, 0).is_err());
    // The largest that is possible is numbered without a wrap.
    let mesh = mesh(GeneratedKind::Blobs, MAX_COUNT, 0);
    let last = mesh.triangle(mesh.triangle_count() - 1);
    assert!(last.iter().all(|&v| u64::from(v) < mesh.vertex_count()));
}
