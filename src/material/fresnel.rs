//! What a smooth surface does with light: mirrors, Snell's law, Fresnel's equations, and two of the
//! approximations to them.
//!
//! Directions of light point along its way, towards the surface for what arrives. `eta` is the index of
//! refraction of the far side over that of the near side, from which the light comes; it is positive.
//!
//! Total reflection, the direction and the reflectance all come from one root, taken once in
//! [`refract`]: where there is a refracted ray there is a reflectance, and both agree.

use glam::{DVec3, Vec3};

use crate::color::Rgb;

/// The mirrored direction d − 2(d·n)n.
///
/// `n`: normal of unit length, either side.
#[inline]
pub fn reflect(d: Vec3, n: Vec3) -> Vec3 {
    d - n * (2.0 * d.dot(n))
}

/// Light that enters the far side of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refraction {
    /// Where it goes, unit length.
    pub direction: Vec3,
    /// Cosine of the angle of incidence, in [0, 1].
    pub cos_i: f32,
    /// Cosine of the angle of refraction, in [0, 1].
    pub cos_t: f32,
    /// Index of the far side over that of the near side.
    pub eta: f32,
}

/// The refracted direction by Snell's law; none where all light is reflected.
///
/// - `d`: direction of the light, `n`: normal, either side; both of unit length up to rounding, which the
///   result does not depend on;
/// - `eta`: index of the far side over that of the near side, positive.
///
/// f64 inside: total reflection is decided by the numbers given, not by how f32 rounds on the way.
/// cos²θt is written (cos²θi + (eta − 1)(eta + 1))/eta², which cancels neither at
/// grazing angles nor with eta near 1, where 1 − sin²θt loses its digits.
#[inline]
pub fn refract(d: Vec3, n: Vec3, eta: f32) -> Option<Refraction> {
    let (d, n) = (normalized(d.as_dvec3()), normalized(n.as_dvec3()));
    let (refraction, is_any) = refracted(d, n, eta);
    is_any.then_some(refraction)
}

/// As [`refract`], without branches: whether there is any comes second, and third whether it is right, as it is
/// for vectors of unit length up to the rounding of f32.
#[inline(always)]
pub fn refract_always(d: Vec3, n: Vec3, eta: f32) -> (Refraction, bool, bool) {
    let ((d, d_is_unit), (n, n_is_unit)) =
        (nearly_normalized(d.as_dvec3()), nearly_normalized(n.as_dvec3()));
    let (refraction, is_any) = refracted(d, n, eta);
    (refraction, is_any, d_is_unit & n_is_unit)
}

/// Both at unit length.
#[inline(always)]
fn refracted(d: DVec3, n: DVec3, eta: f32) -> (Refraction, bool) {
    let cos_i = -d.dot(n);
    let n = if cos_i < 0.0 { -n } else { n };
    let cos_i = cos_i.abs();
    let cos_i = if cos_i > 1.0 { 1.0 } else { cos_i };
    let e = f64::from(eta);
    let under_root = cos_i * cos_i + (e - 1.0) * (e + 1.0);
    let per_e = 1.0 / e;
    let cos_t = (under_root.sqrt() * per_e).min(1.0);
    let direction = (d + n * cos_i) * per_e - n * cos_t;
    let (cos_i, cos_t) = (cos_i as f32, cos_t as f32);
    // Also refuses NaN: the direction or the normal was zero.
    (Refraction { direction: direction.as_vec3(), cos_i, cos_t, eta }, under_root >= 0.0)
}

/// The direction of a vector. What is of unit length up to the rounding of f32 takes neither root nor
/// division: three terms of the series of 1/√(1 + off) have an error of 5/16·off³, below 10⁻¹⁸.
#[inline]
fn normalized(v: DVec3) -> DVec3 {
    let (unit, is_close) = nearly_normalized(v);
    if is_close { unit } else { v / v.length() }
}

/// As [`normalized`], and whether the vector was so close to unit length that it is right.
#[inline(always)]
fn nearly_normalized(v: DVec3) -> (DVec3, bool) {
    let off = v.length_squared() - 1.0;
    (v * (1.0 - off * (0.5 - 0.375 * off)), off.abs() < 1e-6)
}

impl Refraction {
    /// Share of unpolarised light that is reflected instead, in [0, 1]. See [`dielectric`].
    #[inline]
    pub fn reflectance(&self) -> f32 {
        dielectric(self.cos_i, self.cos_t, self.eta)
    }

    /// See [`schlick_dielectric`].
    #[inline]
    pub fn schlick(&self) -> f32 {
        schlick_dielectric(self.cos_i, self.cos_t, self.eta)
    }
}

/// [`schlick`]'s approximation to [`dielectric`], with the cosine on the side of the lower index: the only
/// one that reaches 0 where total reflection begins.
#[inline]
pub fn schlick_dielectric(cos_i: f32, cos_t: f32, eta: f32) -> f32 {
    let r = (1.0 - eta) / (1.0 + eta);
    schlick(r * r, if eta < 1.0 { cos_t } else { cos_i })
}

/// Fresnel's reflectance of a dielectric for unpolarised light, in [0, 1]. Under total reflection there is
/// no `cos_t`; it is 1.
///
/// `cos_i`, `cos_t`: cosines of the angles of incidence and refraction, as [`refract`] gives them.
#[inline(always)]
pub fn dielectric(cos_i: f32, cos_t: f32, eta: f32) -> f32 {
    let [s, p] = dielectric_polarized(cos_i, cos_t, eta);
    0.5 * (s + p)
}

/// As [`dielectric`], for light polarised across the plane of incidence (s) and in it (p).
///
/// Written so that nothing cancels, with eta near 1 or at grazing angles, but p's own zero at Brewster's
/// angle: s is (cos θi − eta·cos θt)/(cos θi + eta·cos θt) with the difference multiplied out by Snell's law,
/// p is s times cos(θi + θt)/cos(θi − θt).
/// Source: Born & Wolf, *Principles of Optics*, 7th ed., §1.5.2, (21) and (21a).
#[inline(always)]
pub fn dielectric_polarized(cos_i: f32, cos_t: f32, eta: f32) -> [f32; 2] {
    let step = (eta - 1.0) * (eta + 1.0);
    let sum = cos_i + eta * cos_t;
    let s = step / (sum * sum);
    let (cosines, sines) = (cos_i * cos_t, (1.0 - cos_i) * (1.0 + cos_i) / eta);
    // Straight on without a cos_t there is no angle to speak of.
    let turn = if cosines + sines > 0.0 { (cosines - sines) / (cosines + sines) } else { 1.0 };
    let p = s * turn;
    // Without a step there is no surface. At 90° the quotients would be 0/0.
    if step == 0.0 { [0.0; 2] } else { [(s * s).min(1.0), (p * p).min(1.0)] }
}

/// Fresnel's reflectance of a metal for unpolarised light, in [0, 1] per channel.
///
/// - `cos_i`: cosine of the angle of incidence, in [0, 1];
/// - `eta`, `k`: real and imaginary part of the metal's index over that of the near side, both ≥ 0.
///
/// Sums of squares over sums of squares: nothing cancels, and no result is above 1.
/// Source: Born & Wolf, *Principles of Optics*, 7th ed., §14.2, with (a + ib)² = (eta + ik)² − sin²θi.
#[inline]
pub fn conductor(cos_i: f32, eta: Rgb, k: Rgb) -> Rgb {
    let channel = |eta: f32, k: f32| {
        let c = cos_i.clamp(0.0, 1.0);
        let sin2 = (1.0 - c) * (1.0 + c);
        // a² and b² have the difference t and the product (eta·k)²: the larger by the root, the smaller
        // from the product.
        let t = (eta - k) * (eta + k) - sin2;
        let ab = eta * k;
        let larger = (0.5 * (t.abs() + (t * t + 4.0 * ab * ab).sqrt())).sqrt();
        let smaller = if larger > 0.0 { ab / larger } else { 0.0 };
        let (a, b) = if t >= 0.0 { (larger, smaller) } else { (smaller, larger) };
        let share = |x: f32, y: f32, z: f32| {
            let (minus, plus) = ((x - y) * (x - y) + z * z, (x + y) * (x + y) + z * z);
            // Zero over zero only where there is no surface at all.
            if plus > 0.0 { minus / plus } else { 0.0 }
        };
        let s = share(a, c, b);
        let p = s * share(a * c, sin2, b * c);
        0.5 * (s + p)
    };
    Rgb::new(channel(eta.r, k.r), channel(eta.g, k.g), channel(eta.b, k.b))
}

/// Schlick's approximation r0 + (1 − r0)·(1 − cos θ)⁵.
///
/// - `r0`: reflectance straight on;
/// - `cos`: cosine of the angle on the side of the *lower* index; see [`Refraction::schlick`].
///
/// Source: Schlick, *An Inexpensive BRDF Model for Physically-based Rendering*, Eurographics 1994, (15).
#[inline]
pub fn schlick(r0: f32, cos: f32) -> f32 {
    let grazing = (1.0 - cos).clamp(0.0, 1.0);
    let squared = grazing * grazing;
    r0 + (1.0 - r0) * (squared * squared * grazing)
}

/// [`schlick`] for each channel.
#[inline]
pub fn schlick_rgb(r0: Rgb, cos: f32) -> Rgb {
    Rgb::new(schlick(r0.r, cos), schlick(r0.g, cos), schlick(r0.b, cos))
}

/// The lecture's empirical reflectance: offset + scale·(1 + V·N)^power, clamped to [0, 1].
///
/// - `v_dot_n`: V is the direction of the light that *arrives*, N faces it: V·N = −cos θ, −1 straight on
///   and 0 at grazing angles;
/// - `power`: positive.
///
/// Source: Fernando & Kilgard, *The Cg Tutorial*, §7.4 (bias, scale, power).
#[inline]
pub fn empirical(offset: f32, scale: f32, power: f32, v_dot_n: f32) -> f32 {
    // Rounding may leave V·N a little below −1, of which powf would make NaN.
    (offset + scale * (1.0 + v_dot_n).max(0.0).powf(power)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use proptest::prelude::*;

    /// Light that arrives at an angle from the normal +Y, rounded to f32.
    fn at(theta: f64) -> Vec3 {
        DVec3::new(theta.sin(), -theta.cos(), 0.0).as_vec3()
    }

    /// Indices that matter: near 1 from both sides, and across the range.
    fn index() -> impl Strategy<Value = f32> {
        prop_oneof![
            Just(1.0f32),
            Just(1.0 + 1e-6),
            Just(1.0 - 1e-6),
            Just(1f32.next_up()),
            Just(1f32.next_down()),
            (-1000i16..=1000).prop_map(|i| 1.0 + f32::from(i) * 1e-6),
            0.25f32..4.0,
        ]
    }

    /// Unit vectors, up to a factor, that meet at every angle and at nearly grazing ones.
    fn meeting() -> impl Strategy<Value = (Vec3, Vec3)> {
        let angle = prop_oneof![
            0.0f64..std::f64::consts::PI,
            (-12.0f64..0.0).prop_map(|e| std::f64::consts::FRAC_PI_2 - 10f64.powf(e)),
            Just(std::f64::consts::FRAC_PI_2),
            Just(0.0),
        ];
        (angle, prop::array::uniform3(-1f64..1.0), -1e-3f64..1e-3, -1e-3f64..1e-3)
            .prop_filter("too short", |(_, n, ..)| DVec3::from(*n).length() > 0.1)
            .prop_map(|(angle, n, a, b)| {
                let n = DVec3::from(n).normalize();
                let d = n.any_orthonormal_vector() * angle.sin() - n * angle.cos();
                ((d * (1.0 + a)).as_vec3(), (n * (1.0 + b)).as_vec3())
            })
    }

    /// sin²θi and cos²θi in f64 by another way than `refract`'s.
    fn squares(d: Vec3, n: Vec3) -> (f64, f64) {
        let (d, n) = (d.as_dvec3(), n.as_dvec3());
        let scale = d.length_squared() * n.length_squared();
        (d.cross(n).length_squared() / scale, d.dot(n).powi(2) / scale)
    }

    /// Fresnel's equations as they are written, in f64.
    fn textbook(cos_i: f64, cos_t: f64, eta: f64) -> f64 {
        let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
        0.5 * (s * s + p * p)
    }

    /// (re, im) with the little arithmetic that the conductor's closed form needs.
    type Complex = (f64, f64);
    fn mul(a: Complex, b: Complex) -> Complex {
        (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
    }
    fn root(a: Complex) -> Complex {
        let r = a.0.hypot(a.1);
        (((r + a.0) / 2.0).max(0.0).sqrt(), ((r - a.0) / 2.0).max(0.0).sqrt())
    }
    fn ratio(a: Complex, b: Complex) -> f64 {
        ((a.0 - b.0).powi(2) + (a.1 - b.1).powi(2)) / ((a.0 + b.0).powi(2) + (a.1 + b.1).powi(2))
    }

    proptest! {
        #[test]
        fn refraction_obeys_snell((d, n) in meeting(), eta in index()) {
            let (sin2_i, cos2_i) = squares(d, n);
            let e = f64::from(eta);
            let under_root = cos2_i + (e - 1.0) * (e + 1.0);
            let Some(r) = refract(d, n, eta) else {
                prop_assert!(under_root < 1e-15, "refused: {under_root}");
                return Ok(());
            };
            prop_assert!(under_root > -1e-15, "passed: {under_root}");
            let t = r.direction.as_dvec3();
            prop_assert!((t.length() - 1.0).abs() < 1.2e-7);
            let (sin2_t, cos2_t) = squares(r.direction, n);
            prop_assert!((sin2_t.sqrt() * e - sin2_i.sqrt()).abs() < 3e-7 * e.max(1.0));
            prop_assert!((cos2_t.sqrt() - f64::from(r.cos_t)).abs() < 2e-7);
            // Cosines are good to the last digit, at grazing angles too.
            prop_assert!((f64::from(r.cos_i) - cos2_i.sqrt()).abs() <= 1e-7 * cos2_i.sqrt() + 1e-15);
            let exact = under_root.max(0.0).sqrt() / e;
            let bound = if under_root < 1e-8 { 1e-7 } else { 1e-7 * exact };
            prop_assert!((f64::from(r.cos_t) - exact).abs() <= bound);
            // In the plane of incidence, onward, through the surface.
            let (du, nu) = (d.as_dvec3().normalize(), n.as_dvec3().normalize());
            prop_assert!(t.dot(du.cross(nu)).abs() < 1e-6);
            let side = if du.dot(nu) > 0.0 { 1.0 } else { -1.0 };
            prop_assert!(t.dot(nu) * side > -1e-7);
            prop_assert!((t - nu * t.dot(nu)).dot(du) > -1e-7);
            if eta == 1.0 {
                prop_assert!((t - du).length() < 1.5e-7);
            }
        }

        /// To the last bit, wherever it says so: for all that is of unit length up to rounding.
        #[test]
        fn refraction_is_the_same_without_branches(
            (d, n) in meeting(),
            eta in index(),
            is_unit in prop::bool::ANY,
        ) {
            let (d, n) = if is_unit { (d.normalize(), n.normalize()) } else { (d, n) };
            let (always, is_any, is_right) = refract_always(d, n, eta);
            prop_assert!(is_right || !is_unit);
            if is_right {
                prop_assert_eq!(is_any.then_some(always), refract(d, n, eta));
            }
        }

        #[test]
        fn a_dielectric_reflects_as_the_textbook_says((d, n) in meeting(), eta in index()) {
            let (e, (_, cos2)) = (f64::from(eta), squares(d, n));
            let under_root = cos2 + (e - 1.0) * (e + 1.0);
            let Some(r) = refract(d, n, eta) else { return Ok(()) };
            let f = r.reflectance();
            prop_assert!((0.0..=1.0).contains(&f), "{f}");
            prop_assert!((0.0..=1.0).contains(&r.schlick()));
            if eta == 1.0 {
                prop_assert_eq!(f, 0.0);
            } else {
                let exact = textbook(cos2.sqrt(), under_root.max(0.0).sqrt() / e, e);
                prop_assert!((f64::from(f) - exact).abs() < 2e-6, "{f}, {exact}");
            }
        }

        #[test]
        fn light_goes_back_as_it_came(
            (d, n) in meeting(),
            // Nearer to 1, the rounding of 1/eta is seen.
            eta in prop_oneof![0.25f32..0.99, 1.01f32..4.0],
        ) {
            let Some(r) = refract(d, n, eta) else { return Ok(()) };
            let back = dielectric(r.cos_t, r.cos_i, 1.0 / eta);
            prop_assert!((back - r.reflectance()).abs() < 2e-5, "{back}, {}", r.reflectance());
            if r.cos_i.min(r.cos_t) > 0.01 {
                let returned = refract(-r.direction, n, 1.0 / eta).map(|b| b.direction);
                prop_assert!(returned.is_some_and(|b| (b + d.normalize()).length() < 1e-4));
            }
        }

        /// Whatever is given, unit length or not, grazing or zero.
        #[test]
        fn nothing_is_nan(
            d in prop::array::uniform3(-2f32..2.0),
            n in prop::array::uniform3(-2f32..2.0),
            zero in prop::array::uniform6(prop::bool::ANY),
            eta in index(),
            k in 0f32..20.0,
            cos in -0.01f32..1.01,
        ) {
            let keep = |x: f32, drop: bool| if drop { 0.0 } else { x };
            let d = Vec3::new(keep(d[0], zero[0]), keep(d[1], zero[1]), keep(d[2], zero[2]));
            let n = Vec3::new(keep(n[0], zero[3]), keep(n[1], zero[4]), keep(n[2], zero[5]));
            prop_assert!(reflect(d, n).is_finite());
            if let Some(r) = refract(d, n, eta) {
                prop_assert!(r.direction.is_finite() && r.cos_i.is_finite() && r.cos_t.is_finite());
                prop_assert!((0.0..=1.0).contains(&r.reflectance()));
            }
            prop_assert!((0.0..=1.0).contains(&dielectric(keep(cos.abs(), zero[0]), 0.0, eta)));
            for (eta, k) in [(eta, k), (eta, 0.0), (0.0, k), (0.0, 0.0), (1.0, 0.0)] {
                for cos in [cos, 0.0, 1.0] {
                    let f = conductor(cos, Rgb::splat(eta), Rgb::splat(k)).r;
                    prop_assert!((0.0..=1.0).contains(&f), "{f} for {eta} + {k}i at {cos}");
                }
            }
            prop_assert!((0.0..=1.0).contains(&schlick(0.04, cos)));
            prop_assert!((0.0..=1.0).contains(&empirical(0.1, k, eta, -cos)));
        }

        #[test]
        fn a_conductor_reflects_as_complex_arithmetic_says(
            cos in prop_oneof![0f32..=1.0, 0f32..1e-3],
            eta in 0.02f32..6.0,
            k in prop_oneof![0f32..10.0, Just(0.0)],
        ) {
            let (c, index) = (f64::from(cos), (f64::from(eta), f64::from(k)));
            let square = mul(index, index);
            let normal = root((square.0 - (1.0 - c * c), square.1));
            let s = ratio((c, 0.0), normal);
            let p = ratio(mul(square, (c, 0.0)), normal);
            let exact = 0.5 * (s + p);
            let got = conductor(cos, Rgb::splat(eta), Rgb::splat(k)).r;
            // Near the critical angle of k = 0 the root takes half of the digits.
            let bound = if k < 1e-2 { 2e-3 } else { 5e-6 };
            prop_assert!((f64::from(got) - exact).abs() < bound, "{got}, {exact}");
        }
    }

    #[test]
    fn the_critical_angle_to_the_last_place() {
        let (mut refused, mut passed) = (0, 0);
        for i in 25..400u16 {
            let eta = f32::from(i) / 400.0;
            let mut sine = eta.next_down().next_down().next_down();
            for _ in 0..7 {
                let cosine = (1.0 - f64::from(sine).powi(2)).sqrt() as f32;
                let refraction = refract(Vec3::new(sine, -cosine, 0.0), Vec3::Y, eta);
                // eta²·|d|² − sine², in whole numbers: all three are multiples of 2⁻²⁸.
                let [s, c, e] = [sine, cosine, eta].map(|x| (f64::from(x) * 2f64.powi(28)) as i128);
                let exact = e * e * (s * s + c * c) - ((s * s) << 56);
                // But for where it is within f64's rounding of zero.
                if exact.unsigned_abs() > 1 << (112 - 49) {
                    assert_eq!(refraction.is_some(), exact > 0, "{eta} {sine}");
                }
                match refraction {
                    Some(r) => {
                        passed += 1;
                        assert!(r.cos_t < 0.002 && r.reflectance() > 0.8, "{eta} {sine}: {r:?}");
                    }
                    None => refused += 1,
                }
                sine = sine.next_up();
            }
        }
        assert!(refused > 1000 && passed > 1000, "{refused} {passed}");
    }

    #[test]
    fn known_reflectances() {
        let straight = refract(at(0.0), Vec3::Y, 1.5).unwrap();
        assert!((straight.reflectance() - 0.04).abs() < 1e-7);
        assert!((straight.schlick() - 0.04).abs() < 1e-7);
        // 45° into 1.5: 5.02 % (9.20 % s, 0.85 % p).
        let slanted = refract(at(45f64.to_radians()), Vec3::Y, 1.5).unwrap();
        assert!((slanted.reflectance() - 0.050_240).abs() < 1e-6);
        // Aluminium at 550 nm, 0.958 + 6.69i: 92.1 %.
        let aluminium = conductor(1.0, Rgb::splat(0.958), Rgb::splat(6.69)).r;
        assert!((aluminium - 0.9211).abs() < 1e-3, "{aluminium}");
        // At Brewster's angle, tan θ = eta, nothing polarised in the plane comes back.
        for eta in [0.5f32, 0.9, 1.1, 1.333, 1.5, 2.4] {
            let r = refract(at(f64::from(eta).atan()), Vec3::Y, eta).unwrap();
            let [s, p] = dielectric_polarized(r.cos_i, r.cos_t, eta);
            assert!(p < 1e-12 && s > 0.005, "{eta}: {s} {p}");
        }
        // Grazing light comes back whole.
        let grazing = at(std::f64::consts::FRAC_PI_2 - 1e-6);
        for eta in [1.1, 1.5, 2.4] {
            assert!(refract(grazing, Vec3::Y, eta).unwrap().reflectance() > 0.9999);
            assert!(refract(grazing, Vec3::Y, 1.0 / eta).is_none());
        }
    }

    #[test]
    fn near_one_every_digit_counts() {
        // Reflectance straight on is ((eta − 1)/(eta + 1))²: 2.5e-13, of which nothing may be lost.
        for eta in [1.0 + 1e-6f32, 1.0 - 1e-6, 1f32.next_up(), 1f32.next_down()] {
            let e = f64::from(eta);
            let exact = ((e - 1.0) / (e + 1.0)).powi(2);
            let got = refract(at(0.0), Vec3::Y, eta).unwrap().reflectance();
            assert!((f64::from(got) / exact - 1.0).abs() < 1e-6, "{eta}: {got}, {exact}");
        }
        // 1e-3 off grazing, where the angle changes most.
        let d = Vec3::new(1.0, -1e-3, 0.0);
        let eta = 1.0 + 1e-6f32;
        let e = f64::from(eta);
        let cos_i = f64::from(1e-3f32) / (1.0 + f64::from(1e-3f32).powi(2)).sqrt();
        let cos_t = (cos_i * cos_i + (e - 1.0) * (e + 1.0)).sqrt() / e;
        let r = refract(d, Vec3::Y, eta).unwrap();
        assert!((f64::from(r.cos_t) / cos_t - 1.0).abs() < 1e-7);
        let exact = textbook(cos_i, cos_t, e);
        assert!((f64::from(r.reflectance()) / exact - 1.0).abs() < 2e-6);
    }

    #[test]
    fn schlick_follows_fresnel_on_both_sides() {
        for eta in [1.5f32, 1.0 / 1.5] {
            let mut worst = 0f32;
            for i in 0..900u16 {
                let d = at(f64::from(i).to_radians() / 10.0);
                let Some(r) = refract(d, Vec3::Y, eta) else { continue };
                worst = worst.max((r.schlick() - r.reflectance()).abs());
            }
            assert!(worst < 0.05, "{eta}: {worst}");
        }
        // Just before total reflection nearly all comes back.
        let r = refract(at((1f64 / 1.5).asin() - 1e-6), Vec3::Y, 1.0 / 1.5).unwrap();
        assert!(r.schlick() > 0.98 && r.reflectance() > 0.98, "{r:?}");
    }

    #[test]
    fn mirrors_and_the_lectures_formula() {
        assert_eq!(reflect(Vec3::new(1.0, -2.0, 3.0), Vec3::Y), Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(reflect(Vec3::NEG_Y, Vec3::NEG_Y), Vec3::Y);
        // Straight on the offset alone, at grazing angles offset + scale; never outside [0, 1].
        assert_eq!(empirical(0.1, 0.5, 5.0, -1.0), 0.1);
        assert_eq!(empirical(0.1, 0.5, 5.0, -1.000_001), 0.1);
        assert_eq!(empirical(0.1, 0.5, 5.0, 0.0), 0.6);
        assert_eq!(empirical(0.0, 1.0, 2.0, -0.5), 0.25);
        assert_eq!(empirical(0.5, 2.0, 1.0, 0.0), 1.0);
        assert_eq!(empirical(-0.5, 0.1, 1.0, -1.0), 0.0);
    }
}
