//! Cutting polygons into triangles.
//!
//! A polygon of n corners always gives n - 2 triangles that use all its corners, also those on a
//! straight edge: a neighbour may have a corner there, and leaving ours out would open a crack.
//! A fan from corner 0 where that covers the polygon, which is so for every convex one; the other
//! diagonal for concave quads; ears for the rest (Meisters, "Polygons have ears", 1975).

use glam::{DVec2, DVec3};

/// Point-in-triangle tests that a [`Cutter`] spends on polygons which need many: 2 seconds or so.
/// Beyond it, ears are taken on trust, so that no file can hold us up for long.
const BUDGET: u64 = 400_000_000;

/// Tests a corner that are not counted: all that polygons of ordinary shape and size need.
const FREE_TESTS: u64 = 64;

/// Cuts polygons; use one for a whole file, for it keeps its memory and its budget.
#[derive(Default)]
pub(super) struct Cutter {
    points: Vec<DVec2>,
    previous: Vec<u32>,
    next: Vec<u32>,
    /// Corners at which an ear may not be cut yet, and which may lie in another's ear.
    reflex: Vec<u32>,
    is_reflex: Vec<bool>,
    /// What of [`BUDGET`] is gone.
    spent: u64,
}

impl Cutter {
    /// Appends the triangles of the polygon with these `corners` (3 or more) to `out`, as numbers
    /// of corners, turning the way the polygon does. Returns `false` if the triangles are a guess,
    /// for the outline crosses itself, seen along its normal, or is too intricate.
    pub fn cut(&mut self, corners: &[DVec3], out: &mut Vec<[u32; 3]>) -> bool {
        let n = corners.len() as u32;
        if n == 3 {
            out.push([0, 1, 2]);
            return true;
        }
        if let &[a, b, c, d] = corners {
            // Along the diagonal that keeps both triangles on one side, the first if both do, or
            // if none does: then the quad is bent like a saddle.
            let is_split_fair = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| {
                (b - a).cross(c - a).dot((c - a).cross(d - a)) >= 0.0
            };
            let other = !is_split_fair(a, b, c, d) && is_split_fair(b, c, d, a);
            fan(u32::from(other), 4, out);
            return true;
        }
        let is_outline = match self.project(corners) {
            Some(normal_to_parts) => normal_to_parts >= 1e-12,
            None => {
                fan(0, n, out);
                return true;
            }
        };
        if !is_outline || self.is_fan(0) {
            fan(0, n, out);
            return is_outline;
        }
        self.cut_ears(out)
    }

    /// Flattens the corners along the axis nearest the normal, so that they turn anticlockwise.
    /// Returns the normal's length relative to its parts', about zero for outlines that turn as
    /// much one way as the other, like an 8; `None` if all area is zero or not a number.
    fn project(&mut self, corners: &[DVec3]) -> Option<f64> {
        // Newell's normal, relative to the first corner: far from zero it would cancel.
        let from_first = |p: DVec3| p - corners[0];
        let (mut normal, mut sum) = (DVec3::ZERO, 0.0);
        for (&a, &b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let part = from_first(a).cross(from_first(b));
            normal += part;
            sum += part.abs().max_element();
        }
        let axis = normal.abs().max_position();
        let (mut x, mut y) = ((axis + 1) % 3, (axis + 2) % 3);
        if normal[axis] < 0.0 {
            (x, y) = (y, x);
        }
        self.points.clear();
        self.points.extend(corners.iter().map(|&p| {
            let p = from_first(p);
            DVec2::new(p[x], p[y])
        }));
        Some(normal.abs().max_element() / sum).filter(|ratio| ratio.is_finite())
    }

    /// Twice the signed area of a triangle of corners.
    #[inline]
    fn turn(&self, a: u32, b: u32, c: u32) -> f64 {
        let [a, b, c] = [a, b, c].map(|i| self.points[i as usize]);
        (b - a).perp_dot(c - a)
    }

    /// Whether no triangle of the fan from corner `from` is turned over: then they cover the
    /// polygon once, for the angles at that corner are all positive and sum to its own.
    fn is_fan(&self, from: u32) -> bool {
        let n = self.points.len() as u32;
        (1..n - 1).all(|i| self.turn(from, (from + i) % n, (from + i + 1) % n) >= 0.0)
    }

    fn cut_ears(&mut self, out: &mut Vec<[u32; 3]>) -> bool {
        let n = self.points.len() as u32;
        self.previous.clear();
        self.previous.extend((0..n).map(|i| (i + n - 1) % n));
        self.next.clear();
        self.next.extend((0..n).map(|i| (i + 1) % n));
        self.is_reflex.clear();
        for i in 0..n {
            let turn = self.turn((i + n - 1) % n, i, (i + 1) % n);
            self.is_reflex.push(turn <= 0.0);
        }
        self.reflex.clear();
        self.reflex.extend((0..n).filter(|&i| self.is_reflex[i as usize]));

        let (mut left, mut at, mut refused) = (n, 0, 0);
        let free = FREE_TESTS * u64::from(n);
        let most = free + (BUDGET - self.spent);
        let (mut tests, mut is_sound) = (0, true);
        while left > 3 {
            let (before, after) = (self.previous[at as usize], self.next[at as usize]);
            // After a round without an ear, take a straight corner if there is one (its triangle
            // has no area); after a second round, the outline crosses itself: take any.
            tests += 1;
            let is_ear = if tests > most || refused >= 2 * left {
                true
            } else if self.is_reflex[at as usize] {
                refused >= left && self.turn(before, at, after) == 0.0
            } else {
                self.is_free(before, at, after, &mut tests)
            };
            if !is_ear {
                refused += 1;
                at = after;
                continue;
            }
            is_sound &= refused < 2 * left && tests <= most;
            out.push([before, at, after]);
            self.next[before as usize] = after;
            self.previous[after as usize] = before;
            self.is_reflex[at as usize] = false;
            left -= 1;
            refused = 0;
            // A neighbour's angle has shrunk: it may have become an ear, never the reverse.
            for i in [before, after] {
                if self.is_reflex[i as usize] {
                    let turn = self.turn(self.previous[i as usize], i, self.next[i as usize]);
                    self.is_reflex[i as usize] = turn <= 0.0;
                }
            }
            // Skipping a corner spreads the cuts round the outline instead of fanning from one.
            at = self.next[after as usize];
        }
        self.spent = BUDGET.min(self.spent + tests.saturating_sub(free));
        let (before, after) = (self.previous[at as usize], self.next[at as usize]);
        out.push([before, at, after]);
        is_sound && self.turn(before, at, after) >= 0.0
    }

    /// Whether no other corner lies in the triangle or on its edges. Corners in the same place as
    /// one of the three do not count: outlines with a hole visit the ends of the slit twice.
    fn is_free(&mut self, a: u32, b: u32, c: u32, tests: &mut u64) -> bool {
        let [pa, pb, pc] = [a, b, c].map(|i| self.points[i as usize]);
        let mut i = 0;
        while i < self.reflex.len() {
            let r = self.reflex[i];
            if !self.is_reflex[r as usize] {
                self.reflex.swap_remove(i);
                continue;
            }
            i += 1;
            *tests += 1;
            let p = self.points[r as usize];
            if p == pa || p == pb || p == pc {
                continue;
            }
            if (pb - pa).perp_dot(p - pa) >= 0.0
                && (pc - pb).perp_dot(p - pb) >= 0.0
                && (pa - pc).perp_dot(p - pc) >= 0.0
            {
                return false;
            }
        }
        true
    }
}

fn fan(from: u32, n: u32, out: &mut Vec<[u32; 3]>) {
    out.extend((1..n - 1).map(|i| [from, (from + i) % n, (from + i + 1) % n]));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(corners: &[DVec3]) -> (Vec<[u32; 3]>, bool) {
        let mut out = Vec::new();
        let is_sound = Cutter::default().cut(corners, &mut out);
        assert_eq!(out.len(), corners.len() - 2);
        (out, is_sound)
    }

    fn vector_area(corners: &[DVec3]) -> DVec3 {
        (1..corners.len() - 1)
            .map(|i| 0.5 * (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]))
            .sum()
    }

    /// No triangle turned over and the areas sum to the polygon's: for a plane outline, that is
    /// to cover it once.
    fn assert_covers(corners: &[DVec3]) {
        let (triangles, is_sound) = cut(corners);
        assert!(is_sound);
        let whole = vector_area(corners);
        let mut sum = 0.0;
        for t in &triangles {
            let part = vector_area(&t.map(|i| corners[i as usize]));
            assert!(part.dot(whole) >= -1e-12 * whole.length_squared(), "turned over: {t:?}");
            sum += part.length();
        }
        assert!((sum - whole.length()).abs() < 1e-9 * sum, "{sum} against {whole}");
        let mut used = vec![false; corners.len()];
        triangles.iter().flatten().for_each(|&i| used[i as usize] = true);
        assert!(used.iter().all(|&u| u), "a corner is left out");
    }

    /// The outline in the planes of all axes, turning either way, and started at every corner.
    fn assert_covers_every_way(outline: &[(f64, f64)]) {
        type Plane = fn((f64, f64)) -> DVec3;
        let planes: [Plane; 5] = [
            |(x, y)| DVec3::new(x, y, 5.0),
            |(x, y)| DVec3::new(-3.0, x, y),
            |(x, y)| DVec3::new(y, 1e3, x),
            |(x, y)| DVec3::new(x, y, 0.3 * x - 0.9 * y),
            |(x, y)| DVec3::new(2.0 * x + y, x, y),
        ];
        for plane in planes {
            let mut corners: Vec<DVec3> = outline.iter().map(|&p| plane(p)).collect();
            for _ in 0..corners.len() {
                corners.rotate_left(1);
                assert_covers(&corners);
                corners.reverse();
                assert_covers(&corners);
            }
        }
    }

    #[test]
    fn convex_is_a_fan() {
        let quad =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        assert_eq!(cut(&quad).0, [[0, 1, 2], [0, 2, 3]]);
        let circle: Vec<_> =
            (0..100).map(|i| DVec2::from_angle(f64::from(i) * 0.06).extend(1.0)).collect();
        assert_eq!(cut(&circle).0[97], [0, 98, 99]);
        assert_covers(&circle);
    }

    #[test]
    fn concave_quad_is_cut_at_its_dent() {
        assert_covers_every_way(&[(0.0, 0.0), (4.0, 0.0), (1.0, 1.0), (0.0, 4.0)]);
    }

    #[test]
    fn bent_quad_keeps_both_sides() {
        let quad =
            [(0.0, 0.0, 0.0), (1.0, 0.0, 0.3), (1.0, 1.0, 0.0), (0.0, 1.0, 0.3)].map(DVec3::from);
        assert_eq!(cut(&quad).0, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn concave_outlines() {
        assert_covers_every_way(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (0.0, 4.0)]);
        // A comb, whose corners are in straight lines.
        let mut comb = vec![(0.0, -1.0), (8.0, -1.0)];
        comb.extend((0..9).rev().map(|i| (f64::from(i), f64::from(i % 2) * 3.0)));
        assert_covers_every_way(&comb);
        // Rectilinear, with corners in the middle of straight edges.
        assert_covers_every_way(&[
            (0.0, 0.0),
            (2.0, 0.0),
            (4.0, 0.0),
            (4.0, 2.0),
            (4.0, 4.0),
            (3.0, 4.0),
            (3.0, 1.0),
            (2.0, 1.0),
            (1.0, 1.0),
            (1.0, 4.0),
            (0.0, 4.0),
            (0.0, 2.0),
        ]);
    }

    #[test]
    fn outline_with_a_hole_and_a_slit() {
        assert_covers_every_way(&[
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 4.0),
            (0.0, 4.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (3.0, 3.0),
            (3.0, 1.0),
            (1.0, 1.0),
        ]);
    }

    #[test]
    fn spirals_and_stars_of_many_corners() {
        let spiral = |n: u32, out: f64| {
            (0..n).map(move |i| {
                let a = 0.1 * f64::from(i);
                DVec2::from_angle(a).extend(0.0) * (1.0 + out + a)
            })
        };
        let mut corners: Vec<_> = spiral(500, 1.0).collect();
        corners.extend(spiral(500, 0.0).collect::<Vec<_>>().iter().rev());
        assert_covers(&corners);
        let star: Vec<_> = (0..5000)
            .map(|i| {
                DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 5000.0).extend(0.0)
                    * if i % 2 == 0 { 1.0 } else { 0.5 + 0.3 * (f64::from(i) * 0.7).sin() }
            })
            .collect();
        assert_covers(&star);
    }

    #[test]
    fn nonsense_still_ends() {
        let crossing = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.2)];
        let (_, is_sound) = cut(&crossing.map(|(x, y)| DVec3::new(x, y, 0.0)));
        assert!(!is_sound);
        cut(&[DVec3::NAN; 12]);
        cut(&[DVec3::ONE; 12]);
        cut(&[DVec3::splat(1e300), DVec3::ZERO, DVec3::X, DVec3::INFINITY, DVec3::Y]);
    }
}
