//! Ray and triangle in f64: what the brute-force accelerator does, and what the tests believe.

use glam::DVec3;

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleHit {
    /// Distance in lengths of the direction.
    pub t: f64,
    /// Weight of the second corner.
    pub u: f64,
    /// Weight of the third corner.
    pub v: f64,
}

/// The hit of a ray with a two-sided triangle at t in (`t_min`, `t_max`].
///
/// Edge functions are volumes spanned by the direction and two corners seen from the origin; an edge
/// that two triangles share gives them the same number with opposite sign, so a ray that meets it
/// hits at least one of them. Source: Davidovič, Engelhardt, Georgiev, Slusallek, Dachsbacher,
/// *3D Rasterization: A Bridge between Rasterization and Ray Casting*, GI 2012.
#[inline]
pub fn intersect_triangle(
    [a, b, c]: [DVec3; 3],
    origin: DVec3,
    direction: DVec3,
    t_min: f64,
    t_max: f64,
) -> Option<TriangleHit> {
    let (a, b, c) = (a - origin, b - origin, c - origin);
    let wa = direction.dot(c.cross(b));
    let wb = direction.dot(a.cross(c));
    let wc = direction.dot(b.cross(a));
    if !((wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0)) {
        return None;
    }
    let sum = wa + wb + wc;
    if sum == 0.0 {
        return None;
    }
    // The plane's own equation gives t with less error than the weighted corners.
    let n = (b - a).cross(c - a);
    let t = n.dot(a) / n.dot(direction);
    (t > t_min && t <= t_max).then(|| TriangleHit { t, u: wb / sum, v: wc / sum })
}

/// Distance of a point from a triangle (Ericson, *Real-Time Collision Detection*, §5.1.5).
pub fn distance_to_triangle(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let inside = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(normal) >= 0.0;
    if normal != DVec3::ZERO && inside(a, b) && inside(b, c) && inside(c, a) {
        return (p - a).dot(normal).abs() / normal.length();
    }
    let to_edge = |from: DVec3, to: DVec3| {
        let along = to - from;
        let t = (p - from).dot(along) / along.length_squared();
        let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 };
        (p - (from + along * t)).length()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)];

    #[test]
    fn hits_from_both_sides() {
        let hit = |x, y, z: f64| {
            let d = DVec3::Z * -z.signum();
            intersect_triangle(CORNERS, DVec3::new(x, y, z), d, 0.0, 1e30)
        };
        assert_eq!(hit(0.5, 1.0, 3.0), Some(TriangleHit { t: 3.0, u: 0.25, v: 0.5 }));
        assert_eq!(hit(0.5, 1.0, -3.0), Some(TriangleHit { t: 3.0, u: 0.25, v: 0.5 }));
        assert_eq!(hit(1.5, 1.0, 3.0), None);
        assert!(hit(0.0, 1.0, 3.0).is_some(), "on an edge");
    }

    #[test]
    fn a_degenerate_triangle_is_never_hit() {
        let line = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        let o = DVec3::new(0.5, 0.0, 1.0);
        assert_eq!(intersect_triangle(line, o, DVec3::NEG_Z, 0.0, 1e30), None);
    }
}
