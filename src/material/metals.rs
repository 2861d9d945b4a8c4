//! Measured metals for a renderer of three bands.
//!
//! A metal's index η + ik is known by wavelength. Averaging η and k themselves over a band would not give
//! the band's reflectance, so the three η and k here are chosen for what they reflect:
//!
//! 1. Reflectance F(λ, θ) by Fresnel's equations for unpolarised light, from the measured η and k, linear
//!    between their wavelengths, every 5 nm from 380 to 730 nm.
//! 2. For every angle, its linear Rec.709: Σ F·D65·(r̄, ḡ, b̄) / Σ D65·(r̄, ḡ, b̄), with D65 the CIE
//!    illuminant (Rec.709's white) and (r̄, ḡ, b̄) the CIE 1931 2° observer's functions through the matrix from
//!    XYZ. So a perfect mirror is (1, 1, 1). Where a channel is above the largest F of all wavelengths at that
//!    angle, it becomes that: gold's red (1.05) and tungsten's (0.506 to 0.504) are outside Rec.709.
//! 3. For each channel, k as a function of η such that the reflectance straight on is the one of step 2:
//!    k² = (R(η + 1)² − (η − 1)²)/(1 − R). Then the η whose reflectances at 0°, 2.5°, … 87.5° are nearest to
//!    those of step 2, in least squares. At no such angle are they more than 0.004 apart.
//!
//! So η and k here are not the ones measured at any wavelength. Polished and clean metals; most real ones
//! are duller.

use super::fresnel;
use crate::color::Rgb;

/// A metal as a renderer of three bands sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metal {
    /// Real part of the index of refraction.
    pub eta: Rgb,
    /// Imaginary part: the extinction coefficient.
    pub k: Rgb,
}

impl Metal {
    /// Reflectance from air for unpolarised light. `cos_i`: cosine of the angle of incidence, in [0, 1].
    #[inline]
    pub fn reflectance(&self, cos_i: f32) -> Rgb {
        fresnel::conductor(cos_i, self.eta, self.k)
    }
}

/// A metal by its name in [`METALS`], in lower case.
pub fn metal(name: &str) -> Option<Metal> {
    METALS.iter().find(|(known, _)| *known == name).map(|(_, metal)| *metal)
}

/// Metals by name.
///
/// | name | measured by |
/// |---|---|
/// | `gold` | McPeak et al., ACS Photonics 2, 326 (2015) |
/// | `silver`, `chromium`, `nickel`, `platinum`, `tungsten` | Rakić et al., Appl. Opt. 37, 5271 (1998): Brendel-Bormann model of several measurements |
/// | `copper` | Hagemann, Gudat & Kunz, J. Opt. Soc. Am. 65, 742 (1975) |
/// | `aluminium` | Rakić, Appl. Opt. 34, 4755 (1995) |
/// | `iron`, `brass` | Querry, *Optical Constants*, CRDC-CR-85034 (1985); brass of 70 % copper, 30 % zinc |
/// | `titanium` | Mash & Motulevich, Sov. Phys. JETP 36, 516 (1973) |
/// | `stainless-steel` | Karlsson & Ribbing, J. Appl. Phys. 53, 6340 (1982): austenitic |
/// | `palladium`, `cobalt` | Johnson & Christy, Phys. Rev. B 9, 5056 (1974) |
///
/// Measurements differ by more than the conversion does, with how a film was made: of silver by 0.06 in the
/// blue (fresh and smooth: 0.98), of chromium by 0.1, of iron and titanium by 0.05. Of several, these are the
/// ones near to what renderers commonly use, but for chromium, which has the reflectance of the bulk.
pub const METALS: &[(&str, Metal)] = &[
    ("gold", metal_of([0.0969, 0.3804, 1.6136], [4.5958, 2.2647, 1.7290])),
    ("silver", metal_of([0.1600, 0.1451, 0.1356], [3.9351, 3.1706, 2.3250])),
    ("copper", metal_of([0.2098, 0.9720, 1.2120], [4.0585, 2.6246, 2.3594])),
    ("aluminium", metal_of([1.4977, 0.9847, 0.6049], [7.6431, 6.5476, 5.3459])),
    ("iron", metal_of([2.4405, 2.1736, 1.7058], [3.3326, 3.1642, 2.8774])),
    ("chromium", metal_of([3.4292, 2.7446, 1.9670], [4.2829, 4.1881, 3.8240])),
    ("nickel", metal_of([2.0526, 1.8021, 1.6104], [3.7510, 3.2446, 2.6498])),
    ("titanium", metal_of([2.5063, 2.2421, 1.8715], [3.0999, 2.9280, 2.5975])),
    ("platinum", metal_of([2.3585, 2.0680, 1.8270], [4.2548, 3.6792, 3.0919])),
    ("palladium", metal_of([1.7963, 1.6218, 1.3958], [4.3654, 3.8119, 3.2127])),
    ("brass", metal_of([0.4670, 0.5231, 1.1255], [4.3042, 2.6679, 1.8115])),
    ("stainless-steel", metal_of([2.4152, 2.0215, 1.6527], [4.1900, 3.6418, 3.0701])),
    ("cobalt", metal_of([2.2575, 2.0353, 1.7133], [4.2280, 3.7946, 3.2381])),
    ("tungsten", metal_of([3.6541, 3.4917, 3.2974], [2.7952, 2.7520, 2.5950])),
];

const fn metal_of([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> Metal {
    Metal { eta: Rgb::new(a, b, c), k: Rgb::new(x, y, z) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Step 2 of the method at 0°, 45° and 75°.
    const SPECTRAL: &[(&str, [[f32; 3]; 3])] = &[
        ("gold", [[0.9826, 0.7837, 0.3427], [0.9818, 0.7841, 0.3510], [0.9765, 0.8330, 0.4867]]),
        ("silver", [[0.9620, 0.9489, 0.9190], [0.9604, 0.9473, 0.9182], [0.9539, 0.9476, 0.9363]]),
        ("copper", [[0.9532, 0.6392, 0.5365], [0.9500, 0.6374, 0.5376], [0.9444, 0.6852, 0.6135]]),
        (
            "aluminium",
            [[0.9073, 0.9159, 0.9223], [0.9029, 0.9119, 0.9188], [0.8525, 0.8716, 0.8903]],
        ),
        ("iron", [[0.5745, 0.5671, 0.5626], [0.5687, 0.5621, 0.5593], [0.5551, 0.5619, 0.5851]]),
        (
            "chromium",
            [[0.6387, 0.6522, 0.6641], [0.6305, 0.6444, 0.6573], [0.5704, 0.5954, 0.6294]],
        ),
        ("nickel", [[0.6490, 0.6078, 0.5344], [0.6422, 0.6026, 0.5327], [0.6159, 0.6037, 0.5775]]),
        (
            "titanium",
            [[0.5423, 0.5301, 0.5007], [0.5373, 0.5261, 0.4992], [0.5337, 0.5380, 0.5428]],
        ),
        (
            "platinum",
            [[0.6789, 0.6395, 0.5836], [0.6712, 0.6329, 0.5791], [0.6249, 0.6096, 0.5888]],
        ),
        (
            "palladium",
            [[0.7327, 0.6969, 0.6524], [0.7253, 0.6903, 0.6474], [0.6826, 0.6663, 0.6536]],
        ),
        ("brass", [[0.9097, 0.7783, 0.4228], [0.9051, 0.7756, 0.4325], [0.8849, 0.8058, 0.5768]]),
        (
            "stainless-steel",
            [[0.6694, 0.6389, 0.5984], [0.6617, 0.6324, 0.5941], [0.6154, 0.6112, 0.6072]],
        ),
        ("cobalt", [[0.6830, 0.6552, 0.6160], [0.6755, 0.6484, 0.6109], [0.6312, 0.6208, 0.6132]]),
        (
            "tungsten",
            [[0.5041, 0.4967, 0.4766], [0.4985, 0.4915, 0.4724], [0.4768, 0.4758, 0.4691]],
        ),
    ];

    fn largest_difference(a: Rgb, b: [f32; 3]) -> f32 {
        a.to_array().into_iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn reflectances_by_angle() {
        assert_eq!(SPECTRAL.len(), METALS.len());
        for (name, expected) in SPECTRAL {
            let metal = metal(name).unwrap();
            for ((degrees, bound), expected) in
                [(0f32, 2e-4), (45.0, 2e-3), (75.0, 5e-3)].into_iter().zip(*expected)
            {
                let got = metal.reflectance(degrees.to_radians().cos());
                assert!(largest_difference(got, expected) < bound, "{name} at {degrees}°: {got:?}");
            }
        }
    }

    #[test]
    fn reflectances_known_from_elsewhere() {
        // Straight on, as renderers commonly have it: Lagarde, *Feeding a physically based lighting model*,
        // 2011; iron as in tables since.
        for (name, expected) in [
            ("gold", [1.00, 0.77, 0.34]),
            ("silver", [0.97, 0.96, 0.92]),
            ("copper", [0.95, 0.64, 0.54]),
            ("aluminium", [0.91, 0.92, 0.92]),
            ("iron", [0.56, 0.57, 0.58]),
            ("nickel", [0.66, 0.61, 0.53]),
            ("platinum", [0.67, 0.64, 0.59]),
            ("cobalt", [0.66, 0.65, 0.63]),
        ] {
            let got = metal(name).unwrap().reflectance(1.0);
            assert!(largest_difference(got, expected) < 0.03, "{name}: {got:?}");
        }
        assert_eq!(metal("wood"), None);
    }

    #[test]
    fn every_metal_is_one() {
        for (name, metal) in METALS {
            for cos in [0.0, 1e-4, 0.5, 1.0] {
                let f = metal.reflectance(cos).to_array();
                assert!(f.iter().all(|c| (0.3..=1.0).contains(c)), "{name} at {cos}: {f:?}");
            }
            assert!(metal.reflectance(0.0).to_array().iter().all(|c| *c == 1.0), "{name}");
        }
    }
}
