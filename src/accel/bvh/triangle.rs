//! One ray against eight triangles, or two.
//!
//! Source: Woop, Benthin, Wald, *Watertight ray/triangle intersection*, JCGT 2(1), 2013. Corners are seen
//! from the ray's origin and sheared so that the ray runs along an axis; edge functions are then areas in
//! a plane. They are differences of products (Kahan's, with an error of 1.5 units in the last place), so
//! that they have the right sign, or are zero, and an edge gives its two triangles opposite signs; and so
//! that slivers, whose corners are nearly in line with the ray, are hit where they are. Zero counts as
//! inside: a ray that meets a closed mesh at an edge or a vertex hits at least one triangle there.

use super::node::TriangleBlock;
use super::ray::ShearRay;
use super::simd::Floats;

/// Where one triangle is hit.
#[derive(Debug, Clone, Copy)]
pub(super) struct TriangleHit {
    pub(super) t: f32,
    pub(super) u: f32,
    pub(super) v: f32,
}

/// Triangles that the line of a ray meets.
struct Candidates<F> {
    /// Lanes.
    bits: u32,
    /// The edge functions, and their sum.
    edges: [F; 3],
    sum: F,
    /// By axis, then corner: all that is needed to do it again in f64.
    sheared: [[F; 3]; 3],
}

/// Where a ray hits them.
struct Within<F> {
    /// Lanes, but for those of `unclear`.
    bits: u32,
    /// Lanes in which f32 does not tell.
    unclear: u32,
    t: F,
    /// One by the sum of the edge functions.
    inverse: F,
}

// A ray in eight lanes, or two of them in sixteen: then lane i is triangle i mod 8.
impl<F: Floats> ShearRay<F> {
    #[inline(always)]
    fn candidates<const ROBUST: bool>(&self, block: &TriangleBlock) -> Candidates<F> {
        let [xs, ys, zs] = self.axes.map(|axis| &block.corners[axis]);
        let [ax, ay, az] = self.sheared(self.seen([&xs[0], &ys[0], &zs[0]]));
        let [bx, by, bz] = self.sheared(self.seen([&xs[1], &ys[1], &zs[1]]));
        let [cx, cy, cz] = self.sheared(self.seen([&xs[2], &ys[2], &zs[2]]));
        let u = cross::<F, ROBUST>(cx, cy, bx, by);
        let v = cross::<F, ROBUST>(ax, ay, cx, cy);
        let w = cross::<F, ROBUST>(bx, by, ax, ay);
        let zero = u.all(0.0);
        let bits = zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero);
        Candidates {
            bits,
            edges: [u, v, w],
            sum: u.add(v).add(w),
            sheared: [[ax, bx, cx], [ay, by, cy], [az, bz, cz]],
        }
    }

    /// Those at t in (`t_min`, `t_max`].
    #[inline(always)]
    fn within<const ROBUST: bool>(&self, candidates: &Candidates<F>, t_max: F) -> Within<F> {
        let Candidates { bits, edges: [u, v, w], sum, sheared: [_, _, [az, bz, cz]] } = *candidates;
        let (zero, inverse) = (sum.all(0.0), sum.all(1.0).div(sum));
        let t = u.mul_add(az, v.mul_add(bz, w.mul(cz))).mul(inverse).mul(self.along);
        Within {
            // Where the sum is zero t is not a number, which is in no interval.
            bits: bits & self.t_min.lt(t) & t.le(t_max),
            unclear: if ROBUST { bits & zero.le(sum) & sum.le(zero) } else { 0 },
            t,
            inverse,
        }
    }

    /// Calls `found` with every triangle hit at t in (`t_min`, `t_max`], until it returns true.
    #[inline(always)]
    pub(super) fn each_hit<const ROBUST: bool>(
        &self,
        block: &TriangleBlock,
        t_max: F,
        mut found: impl FnMut(usize, TriangleHit) -> bool,
    ) {
        let candidates = self.candidates::<ROBUST>(block);
        if candidates.bits == 0 {
            return;
        }
        let Within { mut bits, unclear, t, inverse } = self.within::<ROBUST>(&candidates, t_max);
        // Apart from the others: for those nothing has to be written to memory.
        if unclear != 0 && self.each_unclear(&candidates, unclear, t_max, &mut found) {
            return;
        }
        if bits == 0 {
            return;
        }
        let [_, v, w] = candidates.edges;
        let [t, u, v] = [t, v.mul(inverse), w.mul(inverse)].map(F::to_array);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let [t, u, v] = [&t, &u, &v].map(|lanes| at(lanes, lane));
            if found(lane, TriangleHit { t, u, v }) {
                return;
            }
        }
    }

    /// The lanes with a triangle hit at t in (`t_min`, `t_max`], as bits.
    #[inline(always)]
    pub(super) fn meets_triangle<const ROBUST: bool>(
        &self,
        block: &TriangleBlock,
        t_max: F,
    ) -> u32 {
        let candidates = self.candidates::<ROBUST>(block);
        if candidates.bits == 0 {
            return 0;
        }
        let Within { mut bits, unclear, .. } = self.within::<ROBUST>(&candidates, t_max);
        if unclear != 0 {
            self.each_unclear(&candidates, unclear, t_max, &mut |lane, _| {
                bits |= 1 << lane;
                false
            });
        }
        bits
    }

    /// Asks lanes in f64; whether `found` returned true, which ends it.
    #[inline(always)]
    fn each_unclear(
        &self,
        candidates: &Candidates<F>,
        mut bits: u32,
        t_max: F,
        found: &mut impl FnMut(usize, TriangleHit) -> bool,
    ) -> bool {
        let sheared = candidates.sheared.map(|axis| axis.map(F::to_array));
        let [along, t_min, t_max] = [self.along, self.t_min, t_max].map(F::to_array);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let corners = sheared.map(|axis| axis.map(|lanes| at(&lanes, lane)));
            if let Some(hit) = exact_hit(&corners, at(&along, lane))
                && hit.t > at(&t_min, lane)
                && hit.t <= at(&t_max, lane)
                && found(lane, hit)
            {
                return true;
            }
        }
        false
    }
}

/// What is in a lane.
#[inline(always)]
fn at(lanes: &impl AsRef<[f32]>, lane: usize) -> f32 {
    let lanes = lanes.as_ref();
    lanes[lane % lanes.len()]
}

/// Twice the area that two corners span with the ray. Source: Jeannerod, Louvet, Muller, *Further analysis
/// of Kahan's algorithm for the accurate computation of 2 × 2 determinants*, Math. Comp. 82, 2013. Without
/// fused instructions both products are rounded, and the sign is right all the same.
#[inline(always)]
fn cross<F: Floats, const ROBUST: bool>(ax: F, ay: F, bx: F, by: F) -> F {
    let product = ay.mul(bx);
    let difference = ax.mul_sub(by, product);
    if ROBUST { difference.add(ay.neg_mul_add(bx, product)) } else { difference }
}

/// Where all edge functions are zero in f32, they are asked in f64, in which products of f32 are exact.
#[cold]
#[inline(never)]
fn exact_hit([x, y, z]: &[[f32; 3]; 3], along: f32) -> Option<TriangleHit> {
    let [x, y, z] = [x, y, z].map(|axis| axis.map(f64::from));
    let u = x[2] * y[1] - y[2] * x[1];
    let v = x[0] * y[2] - y[0] * x[2];
    let w = x[1] * y[0] - y[1] * x[0];
    if !((u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)) {
        return None;
    }
    let sum = u + v + w;
    if sum == 0.0 {
        return None;
    }
    let t = (u * z[0] + v * z[1] + w * z[2]) / sum * f64::from(along);
    Some(TriangleHit { t: t as f32, u: (v / sum) as f32, v: (w / sum) as f32 })
}
