//! Fog: haze that dims what is seen through it and adds light of its own, in closed form along a ray.
//!
//! Along a ray of length s, with the extinction σ_t = σ_s + σ_a times the density ρ of the profile,
//!
//! T = exp(−σ_t ∫₀ˢ ρ dt),  L = T·L₀ + (1 − T)·(σ_s/σ_t)·L_f
//!
//! where L₀ is the radiance of what is behind and L_f the radiance that reaches the fog from all around
//! (single scattering of uniform light).

use crate::color::Rgb;
use crate::math::Ray;

/// A scattering and absorbing haze around all objects.
#[derive(Debug, Clone, PartialEq)]
pub struct Fog {
    /// Scattering coefficient σ_s, 1/m.
    pub scattering: Rgb,
    /// Absorption coefficient σ_a, 1/m.
    pub absorption: Rgb,
    /// Radiance L_f that the fog scatters.
    pub radiance: Rgb,
    /// Where it is how dense.
    pub profile: FogProfile,
    /// Whether the light of lamps is dimmed on its way to a surface. That of directional lights, whose
    /// irradiance is meant at the surface, never is.
    pub dims_lights: bool,
}

/// How dense fog is, relative to its coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FogProfile {
    /// Everywhere the same: ρ = 1.
    Homogeneous,
    /// Thinning out upwards: ρ = exp(−(y − base)/height) above the base, 1 below it.
    Height {
        /// Where it begins to thin out: y, relative to the scene's centre.
        base: f64,
        /// Rise over which the density falls to 1/e, > 0.
        height: f64,
    },
    /// The cue for distance of textbooks: by the distance s alone, T = (end − s)/(end − start), held
    /// within [0, 1], whatever the coefficients; they give the colour only.
    Distance {
        /// Up to here there is none.
        start: f64,
        /// From here on there is nothing else, > start.
        end: f64,
    },
}

impl Fog {
    /// Share of light that comes through the first `distance` of `ray`, which may be infinite.
    pub fn transmittance(&self, ray: &Ray, distance: f32) -> Rgb {
        let s = f64::from(distance);
        let depth = match self.profile {
            FogProfile::Distance { start, end } => {
                return Rgb::splat(((end - s) / (end - start)).clamp(0.0, 1.0) as f32);
            }
            FogProfile::Homogeneous => s,
            FogProfile::Height { base, height } => {
                let y = f64::from(ray.origin.y) - base;
                height_integral(y, f64::from(ray.direction.y), s, height)
            }
        };
        let extinction = self.scattering + self.absorption;
        extinction
            .map(|sigma| if sigma == 0.0 { 1.0 } else { (-f64::from(sigma) * depth).exp() as f32 })
    }

    /// The same where `before` of the ray's way is already accounted for: fog by distance goes on there.
    pub fn transmittance_after(&self, before: f32, ray: &Ray, distance: f32) -> Rgb {
        if before > 0.0 && matches!(self.profile, FogProfile::Distance { .. }) {
            let so_far = self.transmittance(ray, before);
            let all = self.transmittance(ray, before + distance);
            return all.zip(so_far, |all, so_far| if so_far > 0.0 { all / so_far } else { 0.0 });
        }
        self.transmittance(ray, distance)
    }

    /// What is seen through the first `distance` of `ray` where `behind` is there.
    pub fn seen_through(&self, ray: &Ray, distance: f32, behind: Rgb) -> Rgb {
        let t = self.transmittance(ray, distance);
        behind * t + self.in_scattered(t)
    }

    /// The light of the fog itself along a ray of transmittance `t`: (1 − T)·(σ_s/σ_t)·L_f.
    pub fn in_scattered(&self, t: Rgb) -> Rgb {
        let albedo = self.scattering.zip(self.scattering + self.absorption, |s, total| {
            if total == 0.0 { 0.0 } else { s / total }
        });
        self.radiance * albedo * t.map(|t| 1.0 - t)
    }
}

/// ∫₀ˢ ρ(y + d·t) dt with ρ(y) = exp(−y/h) for y > 0 and 1 below: in closed form, in two parts where
/// the ray passes y = 0.
fn height_integral(y: f64, d: f64, s: f64, h: f64) -> f64 {
    // Distance to the base, where the ray passes it.
    let to_base = if d == 0.0 { f64::INFINITY } else { -y / d };
    // From its lower end upwards, so that nothing overflows: exp(−y/h)·h/|d|·(1 − exp(−|d|·s/h)), by
    // expm1 as it cancels for small d.
    let above = |y: f64, s: f64| {
        let lower = if d < 0.0 { (y + d * s).max(0.0) } else { y };
        let density = (-lower.max(0.0) / h).exp();
        let x = d.abs() / h;
        // The density is constant to the last digit.
        if x == 0.0 || x * s < 1e-12 { density * s } else { density * (-(-x * s).exp_m1() / x) }
    };
    let is_above = y > 0.0 || (y == 0.0 && d > 0.0);
    match (is_above, to_base > 0.0 && to_base < s) {
        (true, false) => above(y, s),
        (true, true) => above(y, to_base) + (s - to_base),
        (false, false) => s,
        (false, true) => to_base + above(0.0, s - to_base),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn fog(profile: FogProfile) -> Fog {
        Fog {
            scattering: Rgb::new(0.2, 0.1, 0.0),
            absorption: Rgb::new(0.1, 0.3, 0.0),
            radiance: Rgb::splat(0.9),
            profile,
            dims_lights: true,
        }
    }

    #[test]
    fn homogeneous_fog_is_exponential() {
        let fog = fog(FogProfile::Homogeneous);
        let ray = Ray::new(Vec3::ZERO, Vec3::X);
        let t = fog.transmittance(&ray, 2.5);
        assert!((t.r - (-0.75f32).exp()).abs() < 1e-7 && (t.g - (-1.0f32).exp()).abs() < 1e-7);
        assert_eq!(t.b, 1.0);
        let far = fog.seen_through(&ray, f32::INFINITY, Rgb::splat(5.0));
        // Albedo · radiance, and what is behind where there is no fog.
        assert!((far.r - 0.6).abs() < 1e-6 && (far.g - 0.225).abs() < 1e-6 && far.b == 5.0);
    }

    #[test]
    fn height_fog_is_the_integral_of_its_density() {
        // Oracle: the trapezoid rule.
        let (base, height) = (1.0, 0.7);
        let density = |y: f64| if y > base { (-(y - base) / height).exp() } else { 1.0 };
        for (y, d, s) in [
            (3.0, 0.6, 4.0),
            (3.0, -0.6, 8.0),
            (0.2, 0.6, 3.0),
            (0.2, -1.0, 3.0),
            (2.0, 0.0, 5.0),
            (2.0, 1e-9, 5.0),
            (1.0, 0.5, 2.0),
            (1.0, -0.5, 2.0),
            (0.2, 0.9, 0.5),
        ] {
            let n = 400_000;
            let at = |i: i32| density(y + d * s * f64::from(i) / f64::from(n));
            let sum: f64 = (1..n).map(at).sum::<f64>() + 0.5 * (at(0) + at(n));
            let expected = sum * s / f64::from(n);
            let got = height_integral(y - base, d, s, height);
            assert!((got - expected).abs() < 1e-7 * expected.max(1.0), "{y} {d}: {got} {expected}");
        }
        // Upwards to infinity it ends; downwards it does not.
        assert!(
            (height_integral(1.0, 0.5, f64::INFINITY, 2.0) - (-0.5f64).exp() * 4.0).abs() < 1e-12
        );
        assert_eq!(height_integral(1.0, -0.5, f64::INFINITY, 2.0), f64::INFINITY);
        assert_eq!(height_integral(1.0, 0.0, f64::INFINITY, 2.0), f64::INFINITY);
        // From high above thin fog: h of it, seen straight down.
        assert!((height_integral(8.0, -1.0, 8.0, 0.01) - 0.01).abs() < 1e-12);
        // Far below, where the exponential alone would overflow.
        assert_eq!(height_integral(-1e6, 0.0, 3.0, 1e-3), 3.0);
    }

    #[test]
    fn distance_fog_is_linear() {
        let fog = fog(FogProfile::Distance { start: 2.0, end: 6.0 });
        let ray = Ray::new(Vec3::ZERO, Vec3::X);
        let at = |s: f32| fog.transmittance(&ray, s).r;
        assert_eq!(
            [at(1.0), at(2.0), at(3.0), at(6.0), at(f32::INFINITY)],
            [1.0, 1.0, 0.75, 0.0, 0.0]
        );
    }
}
