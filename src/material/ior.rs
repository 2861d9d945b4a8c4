//! How the index of refraction depends on the wavelength, and the indices of real materials.
//!
//! Wavelengths are in nm and in air, as catalogues have them. Indices are over air of 20 °C where the
//! source says nothing else (vacuum's are 0.03 % larger).

/// Fraunhofer's line C, of hydrogen, in nm.
pub const LINE_C: f64 = 656.2725;
/// Line d, of helium, in nm: the index of a glass is told for it.
pub const LINE_D: f64 = 587.5618;
/// Line e, of mercury, in nm.
pub const LINE_E: f64 = 546.0740;
/// Line F, of hydrogen, in nm.
pub const LINE_F: f64 = 486.1327;
/// Line g, of mercury, in nm.
pub const LINE_G: f64 = 435.8343;

/// Index of refraction by wavelength λ, which is in µm in the formulas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ior {
    /// The same for every wavelength.
    Constant(f64),
    /// n = a + b/λ² + c/λ⁴ (Cauchy).
    Cauchy {
        /// a.
        a: f64,
        /// b, in µm².
        b: f64,
        /// c, in µm⁴; often 0.
        c: f64,
    },
    /// n² = 1 + Σ bᵢλ²/(λ² − cᵢ) (Sellmeier).
    Sellmeier {
        /// bᵢ; 0 for a term that is not needed.
        b: [f64; 3],
        /// cᵢ, the squares of resonances, in µm².
        c: [f64; 3],
    },
    /// Sellmeier's formula with four terms.
    Sellmeier4 {
        /// bᵢ.
        b: [f64; 4],
        /// cᵢ, in µm².
        c: [f64; 4],
    },
}

impl Ior {
    /// Cauchy's formula with the index `n_d` and the Abbe number `v_d` (> 0).
    pub fn from_abbe(n_d: f64, v_d: f64) -> Self {
        let inverse_square = |nanometres: f64| (1e3 / nanometres).powi(2);
        let b = (n_d - 1.0) / (v_d * (inverse_square(LINE_F) - inverse_square(LINE_C)));
        Self::Cauchy { a: n_d - b * inverse_square(LINE_D), b, c: 0.0 }
    }

    /// Index at a wavelength in nm. See [`is_sound`](Self::is_sound) for when it is a sensible number.
    pub fn at(&self, nanometres: f64) -> f64 {
        let square = (nanometres * 1e-3).powi(2);
        match self {
            Self::Constant(n) => *n,
            Self::Cauchy { a, b, c } => a + (b + c / square) / square,
            Self::Sellmeier { b, c } => sellmeier(b, c, square),
            Self::Sellmeier4 { b, c } => sellmeier(b, c, square),
        }
    }

    /// Whether the index differs between wavelengths.
    pub fn is_dispersive(&self) -> bool {
        let varies = |b: &[f64], c: &[f64]| b.iter().zip(c).any(|(b, c)| *b != 0.0 && *c != 0.0);
        match self {
            Self::Constant(_) => false,
            Self::Cauchy { b, c, .. } => *b != 0.0 || *c != 0.0,
            Self::Sellmeier { b, c } => varies(b, c),
            Self::Sellmeier4 { b, c } => varies(b, c),
        }
    }

    /// The index at line d: what stands for all wavelengths where one number must.
    pub fn n_d(&self) -> f64 {
        self.at(LINE_D)
    }

    /// The Abbe number (n_d − 1)/(n_F − n_C): the larger, the less colours part. None where they do not.
    pub fn abbe(&self) -> Option<f64> {
        self.is_dispersive().then(|| (self.n_d() - 1.0) / (self.at(LINE_F) - self.at(LINE_C)))
    }

    /// Whether the index is positive and finite for every wavelength between the two, in nm.
    pub fn is_sound(&self, from: f64, to: f64) -> bool {
        // Between the resonances the formulas are smooth; a resonance among the wavelengths is a pole.
        let has_pole = |b: &[f64], c: &[f64]| {
            let range = (from * 1e-3).powi(2)..=(to * 1e-3).powi(2);
            b.iter().zip(c).any(|(b, c)| *b != 0.0 && range.contains(c))
        };
        let pole = match self {
            Self::Constant(_) | Self::Cauchy { .. } => false,
            Self::Sellmeier { b, c } => has_pole(b, c),
            Self::Sellmeier4 { b, c } => has_pole(b, c),
        };
        const STEPS: u16 = 256;
        let sound = |i| {
            let n = self.at(from + (to - from) * f64::from(i) / f64::from(STEPS));
            n.is_finite() && n > 0.0
        };
        !pole && (0..=STEPS).all(sound)
    }
}

/// Sellmeier's formula. NaN where n² would be negative.
fn sellmeier(b: &[f64], c: &[f64], square: f64) -> f64 {
    let sum: f64 = b.iter().zip(c).map(|(b, c)| b * square / (square - c)).sum();
    (1.0 + sum).sqrt()
}

/// A material by its name in [`GLASSES`], in lower case.
pub fn glass(name: &str) -> Option<Ior> {
    GLASSES.iter().find(|(known, _)| *known == name).map(|(_, ior)| *ior)
}

/// Materials that light passes, by name.
///
/// | name | what, and where the coefficients come from |
/// |---|---|
/// | `bk7`, `f2`, `sf6`, `sf10`, `sf11` | Schott N-BK7, F2, SF6, SF10, SF11: catalogue of January 2017 |
/// | `baf10`, `lasf9`, `sk16` | Schott N-BAF10, N-LASF9, N-SK16 (free of lead): the same |
/// | `fused-silica` | Malitson, J. Opt. Soc. Am. 55, 1205 (1965), 20 °C |
/// | `sapphire` | ordinary ray: Malitson & Dodge 1972, in *Handbook of Laser Science and Technology* IV, 1986 |
/// | `diamond` | Peter, Z. Phys. 15, 358 (1923) |
/// | `water` | Daimon & Masumura, Appl. Opt. 46, 3811 (2007), 20.0 °C, over vacuum |
/// | `pmma` | acrylic: fit of Cauchy's formula over 420–730 nm, off by 5·10⁻⁵ at most, to the polynomial of Beadie et al., Appl. Opt. 54, F139 (2015) |
/// | `polycarbonate` | one-term fit of the measurements of Sultanova et al., Acta Phys. Pol. A 116, 585 (2009) |
pub const GLASSES: &[(&str, Ior)] = &[
    (
        "bk7",
        Ior::Sellmeier {
            b: [1.03961212, 0.231792344, 1.01046945],
            c: [0.00600069867, 0.0200179144, 103.560653],
        },
    ),
    (
        "f2",
        Ior::Sellmeier {
            b: [1.34533359, 0.209073176, 0.937357162],
            c: [0.00997743871, 0.0470450767, 111.886764],
        },
    ),
    (
        "sf6",
        Ior::Sellmeier {
            b: [1.72448482, 0.390104889, 1.04572858],
            c: [0.0134871947, 0.0569318095, 118.557185],
        },
    ),
    (
        "sf10",
        Ior::Sellmeier {
            b: [1.61625977, 0.259229334, 1.07762317],
            c: [0.0127534559, 0.0581983954, 116.60768],
        },
    ),
    (
        "sf11",
        Ior::Sellmeier {
            b: [1.73848403, 0.311168974, 1.17490871],
            c: [0.0136068604, 0.0615960463, 121.922711],
        },
    ),
    (
        "baf10",
        Ior::Sellmeier {
            b: [1.5851495, 0.143559385, 1.08521269],
            c: [0.00926681282, 0.0424489805, 105.613573],
        },
    ),
    (
        "lasf9",
        Ior::Sellmeier {
            b: [2.00029547, 0.298926886, 1.80691843],
            c: [0.0121426017, 0.0538736236, 156.530829],
        },
    ),
    (
        "sk16",
        Ior::Sellmeier {
            b: [1.34317774, 0.241144399, 0.994317969],
            c: [0.00704687339, 0.0229005, 92.7508526],
        },
    ),
    (
        "fused-silica",
        Ior::Sellmeier {
            b: [0.6961663, 0.4079426, 0.8974794],
            c: squared([0.0684043, 0.1162414, 9.896161]),
        },
    ),
    (
        "sapphire",
        Ior::Sellmeier {
            b: [1.4313493, 0.65054713, 5.3414021],
            c: squared([0.0726631, 0.1193242, 18.028251]),
        },
    ),
    ("diamond", Ior::Sellmeier { b: [0.3306, 4.3356, 0.0], c: squared([0.1750, 0.1060, 0.0]) }),
    (
        "water",
        Ior::Sellmeier4 {
            b: [0.5684027565, 0.1726177391, 0.02086189578, 0.1130748688],
            c: [0.005101829712, 0.01821153936, 0.02620722293, 10.69792721],
        },
    ),
    ("pmma", Ior::Cauchy { a: 1.48053506, b: 3.95323438e-3, c: 6.25226799e-5 }),
    ("polycarbonate", Ior::Sellmeier { b: [1.4182, 0.0, 0.0], c: [0.021304, 0.0, 0.0] }),
];

/// Some sources print resonances, not their squares.
const fn squared([a, b, c]: [f64; 3]) -> [f64; 3] {
    [a * a, b * b, c * c]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schotts_catalogue() {
        // n_d, n_e to 5 digits, Abbe number to 2, as the catalogue prints them.
        for (name, n_d, n_e, v_d) in [
            ("bk7", 1.51680, 1.51872, 64.17),
            ("f2", 1.62004, 1.62408, 36.37),
            ("sf6", 1.80518, 1.81265, 25.43),
            ("sf10", 1.72825, 1.73430, 28.41),
            ("sf11", 1.78472, 1.79190, 25.76),
            ("baf10", 1.67003, 1.67341, 47.11),
            ("lasf9", 1.85025, 1.85650, 32.17),
            ("sk16", 1.62041, 1.62286, 60.32),
        ] {
            let glass = glass(name).unwrap();
            let (d, e, v) = (glass.n_d(), glass.at(LINE_E), glass.abbe().unwrap());
            assert!((d - n_d).abs() < 0.6e-5 && (e - n_e).abs() < 0.6e-5, "{name}: {d} {e}");
            assert!((v - v_d).abs() < 0.006, "{name}: {v}");
        }
        let bk7 = glass("bk7").unwrap();
        for (line, n) in [(LINE_F, 1.52238), (LINE_C, 1.51432), (LINE_G, 1.52668)] {
            assert!((bk7.at(line) - n).abs() < 0.6e-5, "{line}: {}", bk7.at(line));
        }
    }

    #[test]
    fn other_materials() {
        for (name, n_d, bound, v_d) in [
            ("fused-silica", 1.45846, 0.6e-5, 67.82),
            ("sapphire", 1.76817, 0.6e-5, 72.31),
            ("diamond", 2.4175, 0.6e-4, 55.30),
            // Over vacuum; 1.3330 over air.
            ("water", 1.33340, 0.6e-5, 55.76),
            ("pmma", 1.4925, 0.6e-4, 59.1),
            // Data sheets: 1.586.
            ("polycarbonate", 1.585, 1e-3, 27.9),
        ] {
            let material = glass(name).unwrap();
            assert!((material.n_d() - n_d).abs() < bound, "{name}: {}", material.n_d());
            let v = material.abbe().unwrap();
            assert!((v - v_d).abs() < 0.05, "{name}: {v}");
        }
        // Over air, at the sodium lines: 1.3330 (IAPWS, 20 °C).
        assert!((glass("water").unwrap().at(589.29) / 1.000_272 - 1.33299).abs() < 1e-5);
        for (name, ior) in GLASSES {
            assert!(ior.is_sound(380.0, 730.0) && ior.is_dispersive(), "{name}");
            // Normal dispersion: blue is bent more.
            let indices = (0..=70).map(|i| ior.at(380.0 + 5.0 * f64::from(i)));
            assert!(indices.is_sorted_by(|a, b| a > b), "{name}");
        }
        assert_eq!(glass("unobtainium"), None);
    }

    #[test]
    fn what_a_person_writes() {
        let glass = Ior::from_abbe(1.6, 36.0);
        assert!((glass.n_d() - 1.6).abs() < 1e-12);
        assert!((glass.abbe().unwrap() - 36.0).abs() < 1e-9);
        let constant = Ior::Constant(1.5);
        assert_eq!((constant.n_d(), constant.abbe(), constant.is_dispersive()), (1.5, None, false));
        assert!(!Ior::Cauchy { a: 1.5, b: 0.0, c: 0.0 }.is_dispersive());
        // λ = 0.5 µm: 1.5 + 0.01/0.25 + 0.001/0.0625.
        let cauchy = Ior::Cauchy { a: 1.5, b: 0.01, c: 0.001 };
        assert!((cauchy.at(500.0) - 1.556).abs() < 1e-12);
    }

    #[test]
    fn indices_that_are_no_numbers() {
        let resonance = |c| Ior::Sellmeier { b: [1.0, 0.0, 0.0], c: [c, 0.0, 0.0] };
        assert!(resonance(0.01).is_sound(380.0, 730.0));
        assert!(!resonance(0.3).is_sound(380.0, 730.0), "a pole at 548 nm");
        assert!(!Ior::Constant(f64::NAN).is_sound(380.0, 730.0));
        assert!(!Ior::Constant(0.0).is_sound(380.0, 730.0));
        assert!(!Ior::Cauchy { a: 1.0, b: -0.5, c: 0.0 }.is_sound(380.0, 730.0));
    }
}
