//! Smooth surfaces, which send light on in single directions: mirrors, metals, glass.

use super::{Ior, fresnel};
use crate::color::Rgb;

/// How the share of reflected light depends on the angle: the user's choice.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum FresnelModel {
    /// Fresnel's equations.
    #[default]
    Exact,
    /// Schlick's approximation, on the side where it holds.
    Schlick,
    /// The lecture's empirical power law.
    Power(FresnelPower),
}

/// offset + scale·(1 + V·N)^power, V the incident direction: V·N = −cos θ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FresnelPower {
    /// Share at normal incidence.
    pub offset: f32,
    /// What is added at grazing incidence.
    pub scale: f32,
    /// How late it rises.
    pub power: f32,
}

impl FresnelModel {
    /// Its name in scene files; the power law has none there but its numbers.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Schlick => "schlick",
            Self::Power(_) => "power",
        }
    }

    /// Share of unpolarised light that is reflected where the cosines of the angles to the normal are
    /// `cos_i` on the side of index `n_i`, and `cos_t` beyond, on the side of index `n_t`.
    #[inline]
    pub fn dielectric(&self, cos_i: f32, cos_t: f32, n_i: f32, n_t: f32) -> f32 {
        match self {
            Self::Exact => fresnel::dielectric(cos_i, cos_t, n_t / n_i),
            Self::Schlick => fresnel::schlick_dielectric(cos_i, cos_t, n_t / n_i),
            Self::Power(p) => fresnel::empirical(p.offset, p.scale, p.power, -cos_i),
        }
    }
}

/// The dependence of a mirror's strength on the angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MirrorFresnel {
    /// By which law.
    pub model: FresnelModel,
    /// Index of refraction of the coat that reflects, relative to air. The power law has no use for it.
    pub ior: f32,
}

impl MirrorFresnel {
    /// The share that is reflected at `cos_i` = n·v from outside.
    #[inline]
    pub fn reflectance(&self, cos_i: f32) -> f32 {
        let sin2_t = (1.0 - cos_i * cos_i).max(0.0) / (self.ior * self.ior);
        // Inside an index below 1: total reflection.
        if sin2_t > 1.0 {
            return 1.0;
        }
        self.model.dielectric(cos_i, (1.0 - sin2_t).sqrt(), 1.0, self.ior)
    }
}

/// Glass, water, diamond: what is within a closed surface lets light through, bent.
#[derive(Debug, Clone, PartialEq)]
pub struct Dielectric {
    /// Index of refraction, by wavelength.
    pub ior: Ior,
    /// Absorption coefficient, 1/m.
    pub absorption: Rgb,
    /// Where several overlap, the highest fills the place; among equals the one entered last.
    pub priority: i32,
    /// How much is reflected.
    pub fresnel: FresnelModel,
}

/// A smooth metal, by its complex index of refraction η + ik.
#[derive(Debug, Clone, PartialEq)]
pub struct Conductor {
    /// η.
    pub eta: Rgb,
    /// k.
    pub k: Rgb,
    /// How the reflectance depends on the angle.
    pub fresnel: FresnelModel,
}

impl Conductor {
    /// The share that is reflected at `cos_i` = n·v.
    #[inline]
    pub fn reflectance(&self, cos_i: f32) -> Rgb {
        match self.fresnel {
            FresnelModel::Exact => fresnel::conductor(cos_i, self.eta, self.k),
            FresnelModel::Schlick => {
                fresnel::schlick_rgb(fresnel::conductor(1.0, self.eta, self.k), cos_i)
            }
            FresnelModel::Power(p) => {
                Rgb::splat(fresnel::empirical(p.offset, p.scale, p.power, -cos_i))
            }
        }
    }
}
