//! What every light's sample needs: finite irradiance, directions rounded once, and a target that a
//! ray query cannot take for an obstacle.

use glam::DVec3;

use super::LightSample;
use crate::color::Rgb;
use crate::math::gamma;

/// No irradiance exceeds this, W/m²: at a light without size it has no bound, and sums must be finite.
const BRIGHTEST: f64 = 1e30;

/// `color` times `k`, as far as that is finite. In f64, as the square of a distance need not fit f32.
#[inline]
pub(super) fn scaled(color: Rgb, k: f64) -> Rgb {
    let component = |c: f32| (f64::from(c) * k).min(BRIGHTEST) as f32;
    Rgb::new(component(color.r), component(color.g), component(color.b))
}

/// The sample that aims from `p` at `target`, as far as `short` of it. None where nothing is left and
/// there is no direction.
#[inline]
pub(super) fn aim(p: DVec3, target: DVec3, short: f64, irradiance: Rgb) -> Option<LightSample> {
    let (sample, is_any) = aimed(p, target, short, irradiance);
    is_any.then_some(sample)
}

/// As [`aim`], without a branch; and whether there is any.
#[inline(always)]
pub(super) fn aimed(p: DVec3, target: DVec3, short: f64, irradiance: Rgb) -> (LightSample, bool) {
    let to_target = target - p;
    let length = to_target.length();
    let distance = (length - short).min(f64::from(f32::MAX)) as f32;
    let direction = (to_target * (1.0 / length)).as_vec3();
    // Also refuses NaN.
    (LightSample { direction, distance, irradiance }, distance > 0.0)
}

/// How far off a light's surface a shadow ray must end, so that the surface does not block it.
///
/// - `size`: a bound on the surface's coordinates;
/// - `reach`: a bound on the distance, along any axis, from the ray's origin to the surface's corners;
/// - `n`: unit normal.
///
/// The surface is traced with corners rounded to f32: γ(1)·`size`, with room for a few operations on
/// the way there. A query subtracts the ray's origin from the corners, whose plane is then off by a few
/// roundings of `reach`, and so is the end of a ray whose direction is rounded. Both bound each
/// coordinate, hence the sum over the normal's, as in [`crate::math::offset_ray_origin`].
///
/// The end is where the ray meets the surface that is lifted so far: it stays aimed at the light itself.
#[inline]
pub(super) fn lift(size: f64, reach: f64, n: DVec3) -> f64 {
    (f64::from(gamma(8)) * size + f64::from(gamma(16)) * reach) * n.abs().element_sum()
}
