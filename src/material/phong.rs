//! The lecture's shading equation.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::MirrorFresnel;
use crate::color::Rgb;

/// Ambient, diffuse and specular coefficients of the lecture's shading equation, and its mirror:
///
/// I = k_a·I_a + Σ_lights (k_d·(n·l) + k_s·cosⁿα)·I + k_r·F·I_r
///
/// Empirical: it is neither reciprocal nor bounded in energy.
/// Source: Phong, *Illumination for Computer Generated Pictures*, CACM 18(6) 1975; Blinn, SIGGRAPH
/// 1977; Whitted, *An Improved Illumination Model for Shaded Display*, CACM 23(6) 1980.
#[derive(Debug, Clone, PartialEq)]
pub struct Phong {
    /// k_a.
    pub ambient: Rgb,
    /// k_d.
    pub diffuse: Rgb,
    /// k_s.
    pub specular: Rgb,
    /// n, the sharpness of the highlight, ≥ 0.
    pub shininess: f32,
    /// What the highlight's angle α is measured between.
    pub model: PhongModel,
    /// k_r, the share of what the mirrored ray sees.
    pub mirror: Rgb,
    /// F, by which that share depends on the angle; 1 where not given.
    pub fresnel: Option<MirrorFresnel>,
}

impl Default for Phong {
    fn default() -> Self {
        Self {
            ambient: Rgb::splat(0.6),
            diffuse: Rgb::splat(0.6),
            specular: Rgb::BLACK,
            shininess: 32.0,
            model: PhongModel::default(),
            mirror: Rgb::BLACK,
            fresnel: None,
        }
    }
}

/// The two ways to measure a highlight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PhongModel {
    /// cos α = n·h, h half-way between light and viewer (Blinn).
    #[default]
    BlinnPhong,
    /// cos α = r·v, r the mirrored direction of the light (Phong).
    Phong,
}

impl Phong {
    /// Radiance towards `wo` for each unit of irradiance on a plane facing `wi`, `cos_theta` = n·wi > 0.
    #[inline]
    pub(super) fn response(&self, n: Vec3, wo: Vec3, wi: Vec3, cos_theta: f32) -> Rgb {
        let diffuse = self.diffuse * (cos_theta * FRAC_1_PI);
        if self.specular.is_black() {
            return diffuse;
        }
        let cos_alpha = match self.model {
            PhongModel::BlinnPhong => n.dot((wi + wo).normalize_or_zero()),
            PhongModel::Phong => (n * (2.0 * cos_theta) - wi).dot(wo),
        };
        let highlight = cos_alpha.clamp(0.0, 1.0).powf(self.shininess);
        diffuse + self.specular * (highlight * FRAC_1_PI)
    }
}
