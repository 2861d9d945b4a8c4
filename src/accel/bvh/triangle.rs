//! One ray against eight triangles.
//!
//! Source: Woop, Benthin, Wald, *Watertight ray/triangle intersection*, JCGT 2(1), 2013. Corners are seen
//! from the ray's origin and sheared so that the ray runs along an axis; edge functions are then areas in
//! a plane. They are differences of products (Kahan's, with an error of 1.5 units in the last place), so
//! that they have the right sign, or are zero, and an edge gives its two triangles opposite signs; and so
//! that slivers, whose corners are nearly in line with the ray, are hit where they are. Zero counts as
//! inside: a ray that meets a closed mesh at an edge or a vertex hits at least one triangle there.

use super::node::TriangleBlock;
use super::ray::ShearRay;
use super::simd::{Floats, Simd};

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

impl<F: Floats<Array = [f32; 8]>> ShearRay<F> {
    #[inline(always)]
    fn candidates<S: Simd<F8 = F>, const ROBUST: bool>(
        &self,
        simd: S,
        block: &TriangleBlock,
    ) -> Candidates<F> {
        let [xs, ys, zs] = self.axes.map(|axis| &block.corners[axis]);
        let [ax, ay, az] = self.sheared(self.seen(simd, [&xs[0], &ys[0], &zs[0]]));
        let [bx, by, bz] = self.sheared(self.seen(simd, [&xs[1], &ys[1], &zs[1]]));
        let [cx, cy, cz] = self.sheared(self.seen(simd, [&xs[2], &ys[2], &zs[2]]));
        let u = cross::<F, ROBUST>(cx, cy, bx, by);
        let v = cross::<F, ROBUST>(ax, ay, cx, cy);
        let w = cross::<F, ROBUST>(bx, by, ax, ay);
        let zero = simd.splat8(0.0);
        let bits = zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero);
        Candidates {
            bits,
            edges: [u, v, w],
            sum: u.add(v).add(w),
            sheared: [[ax, bx, cx], [ay, by, cy], [az, bz, cz]],
        }
    }

    /// Calls `found` with every triangle hit at t in (`t_min`, `t_max`], until it returns true.
    #[inline(always)]
    pub(super) fn each_hit<S: Simd<F8 = F>, const ROBUST: bool>(
        &self,
        simd: S,
        block: &TriangleBlock,
        t_max: f32,
        mut found: impl FnMut(usize, TriangleHit) -> bool,
    ) {
        let candidates = self.candidates::<S, ROBUST>(simd, block);
        if candidates.bits == 0 {
            return;
        }
        let Candidates { mut bits, edges: [u, v, w], sum, sheared } = candidates;
        let [az, bz, cz] = sheared[2];
        let inverse = simd.splat8(1.0).div(sum);
        let t = u.mul_add(az, v.mul_add(bz, w.mul(cz))).mul(inverse).mul(simd.splat8(self.along));
        // What is not a number stays: it is asked again.
        let is_outside = t.le(simd.splat8(self.t_min)) | simd.splat8(t_max).lt(t);
        bits &= !is_outside;
        if bits == 0 {
            return;
        }
        let is_inside = |t: f32| t > self.t_min && t <= t_max;
        let zero = simd.splat8(0.0);
        let mut unclear = if ROBUST { bits & zero.le(sum) & sum.le(zero) } else { 0 };
        if unclear != 0 {
            // Apart from the others: for those nothing has to be written to memory.
            bits &= !unclear;
            let sheared = sheared.map(|axis| axis.map(F::to_array));
            while unclear != 0 {
                let lane = unclear.trailing_zeros() as usize & 7;
                unclear &= unclear - 1;
                let corners = sheared.map(|axis| axis.map(|lanes| lanes[lane]));
                if let Some(hit) = exact_hit(&corners, self.along)
                    && is_inside(hit.t)
                    && found(lane, hit)
                {
                    return;
                }
            }
        }
        let (us, vs) = (v.mul(inverse).to_array(), w.mul(inverse).to_array());
        let ts = t.to_array();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            let hit = TriangleHit { t: ts[lane], u: us[lane], v: vs[lane] };
            if is_inside(hit.t) && found(lane, hit) {
                return;
            }
        }
    }
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
