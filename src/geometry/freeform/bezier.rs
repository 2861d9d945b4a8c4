//! Rational Bézier patches.
//!
//! Sources: Farin, *Curves and Surfaces for CAGD*; Piegl and Tiller, *The NURBS Book*, §4.4 for the
//! derivatives of rational surfaces.

use glam::{DVec2, DVec3, DVec4};

use crate::math::Bounds;

/// Highest degree in either direction.
pub const MAX_DEGREE: usize = 15;

/// A tensor-product Bézier patch over (u, v) in the unit square. Its front is where S_u × S_v points.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierPatch {
    /// Along u and along v, 1 to [`MAX_DEGREE`] each.
    degree: [usize; 2],
    /// Homogeneous control points (w·x, w·y, w·z, w), those along u next to each other.
    control: Vec<DVec4>,
    /// Texture coordinates of the corners (0, 0) and (1, 1).
    uv: [DVec2; 2],
}

/// A point of a patch and its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct PatchPoint {
    /// S.
    pub position: DVec3,
    /// S_u and S_v.
    pub first: [DVec3; 2],
    /// S_uu, S_uv and S_vv.
    pub second: [DVec3; 3],
}

impl BezierPatch {
    /// A patch without weights: 16 control points in rows of four, u along the rows.
    pub fn bicubic(points: &[DVec3; 16]) -> Self {
        let control = points.iter().map(|p| p.extend(1.0)).collect();
        Self { degree: [3, 3], control, uv: [DVec2::ZERO, DVec2::ONE] }
    }

    /// A patch of homogeneous control points; see the fields. Weights are above 0.
    pub(super) fn rational(degree: [usize; 2], control: Vec<DVec4>, uv: [DVec2; 2]) -> Self {
        debug_assert_eq!(control.len(), (degree[0] + 1) * (degree[1] + 1));
        Self { degree, control, uv }
    }

    /// Homogeneous control points, for what must know all of a surface.
    pub fn control(&self) -> &[DVec4] {
        &self.control
    }

    /// The box around the control points, and so around the patch.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.control.iter().map(|c| project(*c)))
    }

    /// Upper bounds of how long its lines are along u and along v: the longest of its control polygons.
    pub(super) fn lengths(&self) -> [f64; 2] {
        let [p, q] = self.degree;
        let at = |i: usize, j: usize| project(self.control[j * (p + 1) + i]);
        let row = |j| (0..p).map(|i| at(i, j).distance(at(i + 1, j))).sum::<f64>();
        let column = |i| (0..q).map(|j| at(i, j).distance(at(i, j + 1))).sum::<f64>();
        [(0..=q).map(row).fold(0.0, f64::max), (0..=p).map(column).fold(0.0, f64::max)]
    }

    /// Texture coordinates at (u, v).
    pub(super) fn uv(&self, u: f64, v: f64) -> DVec2 {
        self.uv[0] + (self.uv[1] - self.uv[0]) * DVec2::new(u, v)
    }

    /// The control points of an edge: 0 is v = 0, 1 is u = 1, 2 is v = 1, 3 is u = 0; along growing u or
    /// v.
    pub(super) fn edge(&self, side: usize) -> Vec<DVec4> {
        let [p, q] = self.degree;
        let at = |i: usize, j: usize| self.control[j * (p + 1) + i];
        match side {
            0 => (0..=p).map(|i| at(i, 0)).collect(),
            1 => (0..=q).map(|j| at(p, j)).collect(),
            2 => (0..=p).map(|i| at(i, q)).collect(),
            _ => (0..=q).map(|j| at(0, j)).collect(),
        }
    }

    /// The point at (u, v), with derivatives.
    pub fn evaluate(&self, u: f64, v: f64) -> PatchPoint {
        let [p, q] = self.degree;
        // Value and two derivatives along u of each row, then those along v of the columns they make.
        let mut columns = [[DVec4::ZERO; MAX_DEGREE + 1]; 3];
        let mut row = [DVec4::ZERO; MAX_DEGREE + 1];
        for (j, from) in self.control.chunks_exact(p + 1).enumerate() {
            row[..=p].copy_from_slice(from);
            for (column, value) in columns.iter_mut().zip(de_casteljau(&mut row[..=p], u)) {
                column[j] = value;
            }
        }
        let [a, a_v, a_vv] = de_casteljau(&mut columns[0][..=q], v);
        let [a_u, a_uv, _] = de_casteljau(&mut columns[1][..=q], v);
        let [a_uu, ..] = de_casteljau(&mut columns[2][..=q], v);

        let position = a.truncate() / a.w;
        let s_u = (a_u.truncate() - a_u.w * position) / a.w;
        let s_v = (a_v.truncate() - a_v.w * position) / a.w;
        let s_uu = (a_uu.truncate() - 2.0 * a_u.w * s_u - a_uu.w * position) / a.w;
        let s_uv = (a_uv.truncate() - a_u.w * s_v - a_v.w * s_u - a_uv.w * position) / a.w;
        let s_vv = (a_vv.truncate() - 2.0 * a_v.w * s_v - a_vv.w * position) / a.w;
        PatchPoint { position, first: [s_u, s_v], second: [s_uu, s_uv, s_vv] }
    }

    /// The unit normal at (u, v); where the derivatives are parallel or vanish, as at a pole, its limit
    /// from inside the patch. Zero only where the patch has no area.
    pub fn normal(&self, u: f64, v: f64) -> DVec3 {
        let point = self.evaluate(u, v);
        let [s_u, s_v] = point.first;
        let [s_uu, s_uv, s_vv] = point.second;
        let scale = s_u.length_squared().max(s_v.length_squared());
        let normal = s_u.cross(s_v);
        if normal.length() > 1e-7 * scale {
            return normal.normalize();
        }
        // Along a step d into the patch, N grows as its derivative there does:
        // N'(d) = (S_uu d_u + S_uv d_v) × S_v + S_u × (S_uv d_u + S_vv d_v).
        // Towards the middle of the far edge, not of the patch: along the edge nothing is learned.
        let inwards = |t: f64| if t < 0.5 { 1.0 } else { -1.0 };
        let is_edge = |t: f64| t == 0.0 || t == 1.0;
        let (d_u, d_v) = match (is_edge(u), is_edge(v)) {
            (true, false) => (inwards(u), 0.0),
            (false, true) => (0.0, inwards(v)),
            // At a corner across the edge that has shrunk.
            _ if s_u.length_squared() < s_v.length_squared() => (0.0, inwards(v)),
            _ => (inwards(u), 0.0),
        };
        let growth = (s_uu * d_u + s_uv * d_v).cross(s_v) + s_u.cross(s_uv * d_u + s_vv * d_v);
        let scale = scale.max([s_uu, s_uv, s_vv].map(DVec3::length_squared).iter().sum());
        if growth.length() > 1e-7 * scale {
            return growth.normalize();
        }
        // Both vanish: as near as it can be told. A diagonal step leaves every edge.
        let step = |h: f64| {
            let (u, v) = (u + h * (0.5 - u), v + h * (0.5 - v));
            let [s_u, s_v] = self.evaluate(u, v).first;
            s_u.cross(s_v).try_normalize()
        };
        [1e-3, 1e-2, 0.1, 1.0].into_iter().find_map(step).unwrap_or(DVec3::ZERO)
    }

    /// Upper bounds of |S_uu|, |S_uv| and |S_vv| over the patch.
    pub(super) fn second_derivatives(&self) -> [f64; 3] {
        let weight = self.control[0].w;
        if self.control.iter().all(|c| c.w == weight) {
            return self.bound_second_derivatives();
        }
        // The bound of a quotient is the tighter the less the weights differ: that of sixteen parts.
        let halves = |patch: &Self| {
            let [a, b] = patch.halves_along_u();
            [a, b]
                .map(|half| half.transposed().halves_along_u().map(|quarter| quarter.transposed()))
        };
        let parts = halves(self).into_iter().flatten();
        let parts = parts.flat_map(|part| halves(&part)).flatten();
        parts.map(|part| part.bound_second_derivatives()).fold([0.0; 3], |worst, bound| {
            // Each part has a quarter of the patch's side, and derivatives by its own parameters.
            std::array::from_fn(|i| f64::max(worst[i], 16.0 * bound[i]))
        })
    }

    /// The same from the control points alone: a derivative is a Bézier patch of differences, and lies
    /// in the hull of its control points.
    fn bound_second_derivatives(&self) -> [f64; 3] {
        let [p, q] = self.degree;
        let center = self.bounds().center().extend(0.0);
        // Relative to the middle, so that a far patch has no greater bound.
        let local = |i: usize, j: usize| {
            let c = self.control[j * (p + 1) + i];
            c - center * c.w
        };
        let largest = |counts: [usize; 2], difference: &dyn Fn(usize, usize) -> DVec4| {
            let all = (0..counts[1]).flat_map(|j| (0..counts[0]).map(move |i| (i, j)));
            all.map(|(i, j)| difference(i, j))
                .fold([0.0_f64; 2], |[a, w], d| [a.max(d.truncate().length()), w.max(d.w.abs())])
        };
        let u = |i, j| local(i + 1, j) - local(i, j);
        let v = |i, j| local(i, j + 1) - local(i, j);
        let scaled = |[a, w]: [f64; 2], by: usize| [a * by as f64, w * by as f64];
        let w_least = self.control.iter().map(|c| c.w).fold(f64::INFINITY, f64::min);
        let [_, u1w] = scaled(largest([p, q + 1], &u), p);
        let [_, v1w] = scaled(largest([p + 1, q], &v), q);
        let [a_uu, w_uu] =
            scaled(largest([p - 1, q + 1], &|i, j| u(i + 1, j) - u(i, j)), p * (p - 1));
        let [a_vv, w_vv] =
            scaled(largest([p + 1, q - 1], &|i, j| v(i, j + 1) - v(i, j)), q * (q - 1));
        let [a_uv, w_uv] = scaled(largest([p, q], &|i, j| u(i, j + 1) - u(i, j)), p * q);
        if u1w == 0.0 && v1w == 0.0 {
            return [a_uu, a_uv, a_vv].map(|a| a / w_least);
        }
        let [a_u, w_u] = scaled(largest([p, q + 1], &u), p);
        let [a_v, w_v] = scaled(largest([p + 1, q], &v), q);
        let radius = largest([p + 1, q + 1], &|i, j| {
            let c = local(i, j);
            c / c.w
        })[0];
        let s_u = (a_u + w_u * radius) / w_least;
        let s_v = (a_v + w_v * radius) / w_least;
        [
            (a_uu + 2.0 * w_u * s_u + w_uu * radius) / w_least,
            (a_uv + w_u * s_v + w_v * s_u + w_uv * radius) / w_least,
            (a_vv + 2.0 * w_v * s_v + w_vv * radius) / w_least,
        ]
    }

    /// The halves u < ½ and u > ½, each over the unit square.
    fn halves_along_u(&self) -> [Self; 2] {
        let n = self.degree[0] + 1;
        let (mut low, mut high) = (self.clone(), self.clone());
        let rows = low.control.chunks_exact_mut(n).zip(high.control.chunks_exact_mut(n));
        for (low, high) in rows {
            // What has been halved k times: the first is of the lower half, the last of the upper.
            for (k, low) in low.iter_mut().enumerate().skip(1) {
                for i in 0..n - k {
                    high[i] = 0.5 * (high[i] + high[i + 1]);
                }
                *low = high[0];
            }
        }
        [low, high]
    }

    /// With u and v exchanged.
    fn transposed(&self) -> Self {
        let [p, q] = self.degree;
        let column = |i: usize| (0..=q).map(move |j| self.control[j * (p + 1) + i]);
        let control = (0..=p).flat_map(column).collect();
        Self { degree: [q, p], control, uv: self.uv.map(|uv| DVec2::new(uv.y, uv.x)) }
    }
}

/// The point of homogeneous coordinates.
pub(super) fn project(c: DVec4) -> DVec3 {
    c.truncate() / c.w
}

/// The point at `t` of the curve of these control points, and its first two derivatives, by repeated
/// linear interpolation; overwrites them.
pub(super) fn de_casteljau(points: &mut [DVec4], t: f64) -> [DVec4; 3] {
    let degree = points.len() - 1;
    let mut first = DVec4::ZERO;
    let mut second = DVec4::ZERO;
    for left in (1..=degree).rev() {
        if left == 2 {
            let factor = (degree * (degree - 1)) as f64;
            second = factor * ((points[2] - points[1]) - (points[1] - points[0]));
        }
        if left == 1 {
            first = degree as f64 * (points[1] - points[0]);
        }
        for i in 0..left {
            points[i] += (points[i + 1] - points[i]) * t;
        }
    }
    [points[0], first, second]
}
