//! From the unit square to where samples are wanted: area-preserving, so that what is well distributed
//! stays so.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DVec2, Vec3};

/// The unit square to the unit disk, uniformly, by squares to rings.
///
/// Source: Shirley and Chiu, *A Low Distortion Map Between Disk and Square*, JGT 2(3) 1997.
pub fn concentric_disk([u, v]: [f64; 2]) -> DVec2 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return DVec2::ZERO;
    }
    let (r, angle) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * (a / b))
    };
    DVec2::from_angle(angle) * r
}

/// The unit square to directions around `n` (unit length), with a density of cos θ/π: the disk lifted to
/// the hemisphere (Malley). Without a branch, so that a loop over lanes becomes vector instructions.
#[inline(always)]
pub fn cosine_hemisphere(n: Vec3, [u, v]: [f32; 2]) -> Vec3 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    // As in `concentric_disk`: an angle of up to π/4 from the nearer axis.
    let is_x = a.abs() > b.abs();
    let (r, across) = if is_x { (a, b) } else { (b, a) };
    let angle = std::f32::consts::FRAC_PI_4 * if r == 0.0 { 0.0 } else { across / r };
    let (sin, cos) = sin_cos_of_eighth(angle);
    let (x, y) = if is_x { (r * cos, r * sin) } else { (r * sin, r * cos) };
    let z = (1.0 - r * r).max(0.0).sqrt();
    let (t, b) = n.any_orthonormal_pair();
    (t * x + b * y + n * z).normalize()
}

/// Sine and cosine of an angle of at most π/4, by their Taylor series as far as f32 shows.
#[inline(always)]
fn sin_cos_of_eighth(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = 1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0)));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40320.0))));
    (x * sin, cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_areas_stay_equal() {
        // Cells of the square, counted in rings and sectors of the disk of equal area.
        let n = 400;
        let mut counts = [[0u32; 8]; 4];
        for i in 0..n * n {
            let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
            let p = concentric_disk([at(i % n), at(i / n)]);
            assert!(p.length() <= 1.0);
            let ring = ((p.length_squared() * 4.0) as usize).min(3);
            let sector = ((p.to_angle() / std::f64::consts::TAU + 1.0) * 8.0) as usize % 8;
            counts[ring][sector] += 1;
        }
        let expected = f64::from(n * n) / 32.0;
        for count in counts.iter().flatten() {
            assert!((f64::from(*count) / expected - 1.0).abs() < 0.02, "{counts:?}");
        }
    }

    #[test]
    fn the_hemisphere_is_the_disk_lifted() {
        let n = Vec3::new(0.36, -0.48, 0.8);
        let (t, b) = n.any_orthonormal_pair();
        for i in 0..=64 {
            for j in 0..=64 {
                let [u, v] = [i, j].map(|k| k as f32 / 64.0);
                let p = concentric_disk([u.into(), v.into()]);
                let z = (1.0 - p.length_squared()).max(0.0).sqrt();
                let expected = t * p.x as f32 + b * p.y as f32 + n * z as f32;
                let found = cosine_hemisphere(n, [u, v]);
                // The root, where it starts from nothing, shows the rounding of what it is taken of.
                let bound = if z < 0.05 { 4e-4 } else { 1e-6 };
                assert!((found - expected).length() < bound, "{u} {v}: {found} {expected}");
            }
        }
    }

    #[test]
    fn directions_follow_the_cosine() {
        let n = Vec3::new(0.6, -0.48, 0.64);
        let steps = 300;
        let (mut mean, mut total) = (Vec3::ZERO, 0.0);
        for i in 0..steps * steps {
            let at = |k: i32| (k as f32 + 0.5) / steps as f32;
            let w = cosine_hemisphere(n, [at(i % steps), at(i / steps)]);
            assert!(w.dot(n) > -1e-6);
            mean += w;
            total += 1.0;
        }
        // The mean of cos θ under cos θ/π is 2/3.
        assert!((mean / total - n * (2.0 / 3.0)).length() < 1e-3, "{}", mean / total);
    }
}
