//! Snell's law and Fresnel's equations where they hardly turn light, and where none passes.

use alhazen::material::fresnel::refract;
use glam::Vec3;

use super::{Cell, Row, Table};
use crate::common::Random;

/// Snell's law where it hardly turns light, and where it ceases to let any pass.
pub(super) fn refraction(n: usize) -> Table {
    let mut rows = Vec::new();
    let mut add = |case: String, text: String, is_red| {
        rows.push(Row { case, cells: vec![Cell::new(text, is_red)] });
    };
    for (name, step) in [("one ulp below", -1), ("at", 0), ("one ulp above", 1)] {
        let (mut cases, mut wrong) = (0, 0);
        for i in 0..n as u32 / 64 {
            let eta = 0.05 + 0.9 * (i as f32 + 0.5) / (n as f32 / 64.0);
            let sine = f32::from_bits(eta.to_bits().wrapping_add_signed(step));
            let cosine = (1.0 - f64::from(sine).powi(2)).sqrt() as f32;
            let passes = refract(Vec3::new(sine, -cosine, 0.0), Vec3::Y, eta).is_some();
            // eta²·|d|² − sine², in whole numbers: multiples of 2⁻³⁰ all three, but for digits of `sine` and
            // `eta` below 0.06 that are not.
            let [s, c, e] = [sine, cosine, eta].map(|x| f64::from(x) * 2f64.powi(30));
            if [s, c, e].iter().any(|x| x.fract() != 0.0) {
                continue;
            }
            let [s, c, e] = [s, c, e].map(|x| x as i128);
            let exact = e * e * (s * s + c * c) - ((s * s) << 60);
            // Nearer to zero than f64 tells apart, either answer is right.
            if exact.unsigned_abs() > 1 << (120 - 49) {
                cases += 1;
                wrong += usize::from(passes != (exact > 0));
            }
        }
        let text = format!("{wrong} of {cases} decided wrongly");
        add(format!("critical angle, {name}"), text, wrong > 0 || cases < n / 200);
    }
    for eta in [1.0, 1.0 + 1e-6f32, 1.0 - 1e-6, 1f32.next_up(), 1f32.next_down()] {
        let mut random = Random(12);
        let (mut turned, mut off) = (0.0f64, 0.0f64);
        for _ in 0..n / 16 {
            let normal = random.direction().as_vec3();
            let mut d = random.direction();
            if random.unit() < 0.25 {
                d -= normal.as_dvec3() * d.dot(normal.as_dvec3()) * random.between(0.99, 1.0);
            }
            let d = d.normalize().as_vec3();
            let (i, m, e) =
                (d.as_dvec3().normalize(), normal.as_dvec3().normalize(), f64::from(eta));
            let cos_i = i.dot(m);
            let tangent = (i - m * cos_i) / e;
            let sine = tangent.length();
            // Total reflection begins 1e-3 off grazing at most.
            if sine > 1.0 - 1e-5 {
                continue;
            }
            let cos_t = ((1.0 - sine) * (1.0 + sine)).sqrt();
            let Some(found) = refract(d, normal, eta) else {
                turned = f64::INFINITY;
                continue;
            };
            let truth = tangent + m * cos_t.copysign(cos_i);
            turned = turned.max((found.direction.as_dvec3() - truth).length());
            let cos_i = cos_i.abs();
            // Fresnel's equations by sines of sums, as tan and sin of θi − θt, which do not cancel.
            let gap = (cos_t * cos_t - cos_i * cos_i) / (cos_t + cos_i);
            let s = (cos_i * (1.0 - e) - e * gap) / (cos_i + e * cos_t);
            let p = (cos_i * (e - 1.0) - gap) / (e * cos_i + cos_t);
            let reflectance = 0.5 * (s * s + p * p);
            off = off.max((f64::from(found.reflectance()) - reflectance).abs());
        }
        let text = format!("turned by {turned:.0e} rad, reflectance off by {off:.0e}");
        let is_red = turned > 1e-6 || off > 1e-6;
        add(format!("index {eta}"), text, is_red);
    }
    Table {
        title: "Refraction",
        what: "Whether light passes at the sine of the critical angle and its neighbours in f32, over indices from 0.05 to 0.95, \
               against whole numbers; and with indices near 1, one in four rays nearly grazing, how far a direction and a \
               reflectance are from Snell's and Fresnel's in f64. Red: a wrong decision, or more than 10⁻⁶.",
        columns: vec!["found".into()],
        rows,
    }
}
