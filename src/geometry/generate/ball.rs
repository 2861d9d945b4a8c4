//! Closed balls with a displaced surface: the faces of a cube in n × n cells, blown up.

use glam::DVec3;

use super::scattered::random;
use crate::math::noise::fbm;

/// Balls of `blobs`: the shell and what is in it.
pub(super) const BLOBS: u64 = 101;

/// Triangles of a cube whose faces are one cell each.
const CUBE: u64 = 12;

/// How far the surface strays, as a share of the radius.
const RELIEF: f64 = 0.15;

/// The least number of triangles of `balls` balls.
pub(super) const fn least(balls: u64) -> u64 {
    CUBE * balls
}

/// The points of a cube's surface with whole coordinates from 0 to n, numbered layer by layer.
#[derive(Debug, Clone, Copy)]
struct Lattice {
    n: u64,
}

impl Lattice {
    /// The finest with at most `triangles` triangles.
    const fn new(triangles: u64) -> Self {
        Self { n: (triangles / CUBE).isqrt() }
    }

    const fn vertex_count(self) -> u64 {
        6 * self.n * self.n + 2
    }

    const fn triangle_count(self) -> u64 {
        CUBE * self.n * self.n
    }

    /// Coordinates of point `i`: the bottom row by row, rings around the sides, the top.
    const fn point(self, i: u64) -> [u64; 3] {
        let n = self.n;
        let face = (n + 1) * (n + 1);
        let rings = 4 * n * (n - 1);
        if i < face {
            return [i % (n + 1), i / (n + 1), 0];
        }
        if i >= face + rings {
            let i = i - face - rings;
            return [i % (n + 1), i / (n + 1), n];
        }
        let i = i - face;
        let (layer, along) = (1 + i / (4 * n), i % (4 * n));
        let step = along % n;
        match along / n {
            0 => [step, 0, layer],
            1 => [n, step, layer],
            2 => [n - step, n, layer],
            _ => [0, n - step, layer],
        }
    }

    /// The number of a point on the surface.
    const fn index(self, [x, y, z]: [u64; 3]) -> u64 {
        let n = self.n;
        let face = (n + 1) * (n + 1);
        if z == 0 {
            return y * (n + 1) + x;
        }
        if z == n {
            return face + 4 * n * (n - 1) + y * (n + 1) + x;
        }
        let along = if y == 0 && x < n {
            x
        } else if x == n && y < n {
            n + y
        } else if y == n && x > 0 {
            2 * n + n - x
        } else {
            3 * n + n - y
        };
        face + (z - 1) * 4 * n + along
    }

    /// The point on the unit sphere for point `i`.
    ///
    /// Source: Nowell, *Mapping a Cube to a Sphere* (2005): cells differ less in size than by
    /// normalising, and their corners are unit vectors up to rounding.
    fn direction(self, i: u64) -> DVec3 {
        let p = self.point(i).map(|c| 2.0 * c as f64 / self.n as f64 - 1.0);
        let [x, y, z] = p.map(|c| c * c);
        let stretch = |a: f64, b: f64| (1.0 - a / 2.0 - b / 2.0 + a * b / 3.0).sqrt();
        DVec3::new(p[0] * stretch(y, z), p[1] * stretch(z, x), p[2] * stretch(x, y))
    }

    /// Corners of triangle `i`.
    fn triangle(self, i: u64) -> [u64; 3] {
        let n = self.n;
        let (face, i) = (i / (2 * n * n), i % (2 * n * n));
        let (cell, half) = (i / 2, i % 2);
        let (u, v) = (cell % n, cell / n);
        // Along the next axes, in turn: u × v points along the face's axis, outward at its far end.
        let axis = (face / 2) as usize;
        let is_far = face % 2 == 1;
        let corner = |u: u64, v: u64| {
            let mut p = [0; 3];
            p[axis] = if is_far { n } else { 0 };
            p[(axis + 1) % 3] = u;
            p[(axis + 2) % 3] = v;
            self.index(p)
        };
        let [a, b, c] = if half == 0 {
            [corner(u, v), corner(u + 1, v), corner(u + 1, v + 1)]
        } else {
            [corner(u, v), corner(u + 1, v + 1), corner(u, v + 1)]
        };
        if is_far { [a, b, c] } else { [a, c, b] }
    }
}

/// A ball, and where the noise on it is taken from.
#[derive(Debug, Clone)]
struct Ball {
    center: DVec3,
    radius: f64,
    noise: DVec3,
}

/// One ball, or one around many of another fineness.
#[derive(Debug, Clone)]
pub(super) struct Balls {
    outer: Lattice,
    inner: Lattice,
    balls: Vec<Ball>,
    seed: u32,
}

impl Balls {
    pub(super) fn one(triangles: u64, seed: u32) -> Self {
        let lattice = Lattice::new(triangles);
        let ball = Ball { center: DVec3::ZERO, radius: 1.0, noise: DVec3::ZERO };
        Self { outer: lattice, inner: lattice, balls: vec![ball], seed }
    }

    pub(super) fn many(triangles: u64, seed: u32) -> Self {
        let inner = Lattice::new(triangles / BLOBS);
        // What the blobs leave.
        let outer = Lattice::new(triangles - (BLOBS - 1) * inner.triangle_count());
        let mut balls = vec![Ball { center: DVec3::ZERO, radius: 10.0, noise: DVec3::ZERO }];
        balls.extend((1..BLOBS).map(|i| {
            let number = |k| random(seed, i, k);
            let toward = DVec3::new(number(0), number(1), number(2)) * 2.0 - 1.0;
            // The shell is nowhere nearer than 8.5, the farthest of a blob no farther than 8.
            let center = toward.normalize_or(DVec3::X) * (1.5 + 5.5 * number(3));
            let noise = DVec3::splat(16.0 * i as f64);
            Ball { center, radius: 0.3 + 0.55 * number(4), noise }
        }));
        Self { outer, inner, balls, seed }
    }

    pub(super) fn vertex_count(&self) -> u64 {
        self.outer.vertex_count() + (self.balls.len() as u64 - 1) * self.inner.vertex_count()
    }

    pub(super) fn triangle_count(&self) -> u64 {
        self.outer.triangle_count() + (self.balls.len() as u64 - 1) * self.inner.triangle_count()
    }

    /// The lattice, the number of the ball, and what remains of `i`, where the first ball has `first`
    /// things and each other one `other`.
    const fn find(&self, i: u64, first: u64, other: u64) -> (Lattice, u64, u64) {
        if i < first {
            return (self.outer, 0, i);
        }
        let i = i - first;
        (self.inner, 1 + i / other, i % other)
    }

    pub(super) fn vertex(&self, i: u64) -> DVec3 {
        let (lattice, ball, i) = self.find(i, self.outer.vertex_count(), self.inner.vertex_count());
        let Ball { center, radius, noise } = &self.balls[ball as usize];
        // Down to hills four cells wide; about two of the widest across a face.
        let octaves = (lattice.n / 8).max(1).ilog2() + 1;
        let direction = lattice.direction(i);
        let relief = fbm(direction + *noise, 0.0, octaves, 0.5, self.seed);
        *center + direction * (radius * (1.0 + RELIEF * relief))
    }

    pub(super) fn triangle(&self, i: u64) -> [u64; 3] {
        let (lattice, ball, i) =
            self.find(i, self.outer.triangle_count(), self.inner.triangle_count());
        let before = match ball {
            0 => 0,
            _ => self.outer.vertex_count() + (ball - 1) * lattice.vertex_count(),
        };
        lattice.triangle(i).map(|corner| before + corner)
    }
}
