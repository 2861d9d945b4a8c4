//! How far f32 arithmetic can be off, and how a ray leaves a surface in spite of it.

use glam::Vec3;

/// Bound on the relative error of `n` f32 operations in a row: nε/(1 − nε) with ε = 2⁻²⁴.
///
/// Source: Higham, *Accuracy and Stability of Numerical Algorithms*, §3.1; pbrt 4ed §6.8.1.
pub const fn gamma(n: u32) -> f32 {
    let ne = n as f32 * (f32::EPSILON * 0.5);
    ne / (1.0 - ne)
}

/// Moves the origin of a new ray off the surface it leaves, to where the surface cannot be.
///
/// - `p`: the hit point, of which every coordinate is off by at most `error`;
/// - `n`: geometric normal, unit length, either side;
/// - `w`: direction of the new ray.
///
/// The result lies on the side of `n` that `w` points to, outside the box of half-width `error`
/// around `p`. Source: pbrt 4ed §6.8.6 (`OffsetRayOrigin`). Instead of rounding every coordinate away
/// from the surface, the way is lengthened by what rounding may take back: half an ulp of each
/// coordinate of the result, taken twice.
#[inline(always)]
pub fn offset_ray_origin(p: Vec3, error: f32, n: Vec3, w: Vec3) -> Vec3 {
    let rounding = f32::EPSILON * p.abs().max_element();
    let distance = (error * (1.0 + 4.0 * f32::EPSILON) + rounding) * n.abs().element_sum();
    p + n * distance.copysign(w.dot(n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// In f64, the new origin is beyond every plane through the error box.
        #[test]
        fn the_origin_is_outside_the_error_box(
            p in prop::array::uniform3(-1e6f32..1e6),
            n in prop::array::uniform3(-1f32..1.0),
            w in prop::array::uniform3(-1f32..1.0),
            error in 1e-6f32..1.0,
        ) {
            prop_assume!(Vec3::from(n).length() > 0.1);
            let (p, n, w) = (Vec3::from(p), Vec3::from(n).normalize(), Vec3::from(w));
            let o = offset_ray_origin(p, error, n, w);
            let side = if w.dot(n) < 0.0 { -1.0 } else { 1.0 };
            let moved = (o.as_dvec3() - p.as_dvec3()).dot(n.as_dvec3()) * side;
            let reach = f64::from(error) * n.as_dvec3().abs().element_sum();
            prop_assert!(moved >= reach * (1.0 - 1e-6), "{moved} < {reach}");
        }
    }

    #[test]
    fn gamma_of_seven() {
        assert!((gamma(7) - 4.1723e-7).abs() < 1e-11);
    }
}
