//! Materials: how a surface answers light. Each model with its formula; no lights, no rays.

pub mod fresnel;
mod ior;
mod metals;
mod phong;
mod specular;

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

pub use ior::{GLASSES, Ior, LINE_C, LINE_D, LINE_E, LINE_F, LINE_G, glass};
pub use metals::{METALS, Metal, metal};
pub use phong::{Phong, PhongModel};
pub use specular::{Conductor, Dielectric, FresnelModel, FresnelPower, MirrorFresnel};

use crate::color::Rgb;

/// How a surface scatters light.
#[derive(Debug, Clone, PartialEq)]
pub enum Material {
    /// Lambert's: the same radiance in all directions.
    Diffuse {
        /// Fraction of light that leaves again, in [0, 1].
        reflectance: Rgb,
    },
    /// The lecture's shading equation.
    Phong(Phong),
    /// A perfect mirror.
    Mirror {
        /// Fraction of light that is reflected, in [0, 1].
        reflectance: Rgb,
        /// How that depends on the angle; not at all where not given.
        fresnel: Option<MirrorFresnel>,
    },
    /// A smooth metal.
    Conductor(Conductor),
    /// Smooth glass.
    Dielectric(Dielectric),
}

impl Material {
    /// Radiance that leaves towards `wo` for each unit of irradiance on a plane facing `wi`, in 1/sr.
    /// The cosine of the angle of incidence is included.
    ///
    /// - `n`: shading normal; `wo`, `wi`: towards viewer and light. All of unit length, all on the
    ///   same side of the surface; zero where `wi` is behind `n`.
    #[inline]
    pub fn response(&self, n: Vec3, wo: Vec3, wi: Vec3) -> Rgb {
        let cos_theta = n.dot(wi);
        // Also refuses NaN.
        if !(cos_theta > 0.0) {
            return Rgb::BLACK;
        }
        match self {
            Self::Diffuse { reflectance } => *reflectance * (cos_theta * FRAC_1_PI),
            Self::Phong(phong) => phong.response(n, wo, wi, cos_theta),
            Self::Mirror { .. } | Self::Conductor(_) | Self::Dielectric(_) => Rgb::BLACK,
        }
    }

    /// What ambient light of radiance 1 from everywhere leaves as. Smooth surfaces show their
    /// surroundings instead.
    #[inline]
    pub fn ambient(&self) -> Rgb {
        match self {
            Self::Diffuse { reflectance } => *reflectance,
            Self::Phong(phong) => phong.ambient,
            Self::Mirror { .. } | Self::Conductor(_) | Self::Dielectric(_) => Rgb::BLACK,
        }
    }

    /// The colour of the surface without light: what the `flat` integrator shows.
    pub fn albedo(&self) -> Rgb {
        match self {
            Self::Diffuse { reflectance } | Self::Mirror { reflectance, .. } => *reflectance,
            Self::Phong(phong) => phong.diffuse,
            Self::Conductor(metal) => metal.reflectance(1.0),
            Self::Dielectric(_) => Rgb::splat(1.0),
        }
    }

    /// The share of what the mirrored ray sees, at `cos_i` = n·v. Glass, which reflects by the media on
    /// either side, is not asked.
    #[inline]
    pub fn mirrored(&self, cos_i: f32) -> Rgb {
        let by_angle = |share: Rgb, fresnel: &Option<MirrorFresnel>| match fresnel {
            None => share,
            Some(fresnel) => share * fresnel.reflectance(cos_i),
        };
        match self {
            Self::Diffuse { .. } | Self::Dielectric(_) => Rgb::BLACK,
            Self::Phong(phong) if phong.mirror.is_black() => Rgb::BLACK,
            Self::Phong(phong) => by_angle(phong.mirror, &phong.fresnel),
            Self::Mirror { reflectance, fresnel } => by_angle(*reflectance, fresnel),
            Self::Conductor(metal) => metal.reflectance(cos_i),
        }
    }

    /// Whether lights and ambient light show on it, by [`Material::response`].
    #[inline]
    pub fn is_lit(&self) -> bool {
        matches!(self, Self::Diffuse { .. } | Self::Phong(_))
    }

    /// The reflectance where [`Material::response`] is nothing but Lambert's law: that, over π, times the
    /// cosine.
    #[inline]
    pub fn lambertian(&self) -> Option<Rgb> {
        match self {
            Self::Diffuse { reflectance } => Some(*reflectance),
            Self::Phong(phong) => phong.specular.is_black().then_some(phong.diffuse),
            Self::Mirror { .. } | Self::Conductor(_) | Self::Dielectric(_) => None,
        }
    }

    /// Whether light passes it.
    #[inline]
    pub fn is_glass(&self) -> bool {
        matches!(self, Self::Dielectric(_))
    }

    /// Whether it sends rays on.
    #[inline]
    pub fn is_specular(&self) -> bool {
        match self {
            Self::Diffuse { .. } => false,
            Self::Phong(phong) => !phong.mirror.is_black(),
            Self::Mirror { .. } | Self::Conductor(_) | Self::Dielectric(_) => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    fn phong(model: PhongModel) -> Material {
        Material::Phong(Phong {
            ambient: Rgb::splat(0.1),
            diffuse: Rgb::splat(0.5),
            specular: Rgb::splat(0.25),
            shininess: 8.0,
            model,
            ..Phong::default()
        })
    }

    #[test]
    fn the_lectures_equation() {
        // Light 60° from the normal, viewer 30° on the other side: mirrored light and viewer are 30°
        // apart, the half vector is 15° off the normal.
        let at =
            |degrees: f32| Vec3::new(degrees.to_radians().sin(), degrees.to_radians().cos(), 0.0);
        let (n, l, v) = (Vec3::Y, at(60.0), at(-30.0));
        let cos = |degrees: f32| degrees.to_radians().cos();
        for (model, alpha) in [(PhongModel::Phong, 30.0), (PhongModel::BlinnPhong, 15.0)] {
            let expected = (0.5 * cos(60.0) + 0.25 * cos(alpha).powi(8)) / PI;
            let got = phong(model).response(n, v, l).r;
            assert!((got - expected).abs() < 1e-6, "{model:?}: {got} against {expected}");
        }
        assert!(phong(PhongModel::Phong).response(n, v, -l).is_black(), "light from behind");
    }

    #[test]
    fn a_diffuse_surface_returns_its_reflectance() {
        // The integral of the response over the hemisphere of viewers, times cos: reflectance · cos θi.
        let material = Material::Diffuse { reflectance: Rgb::splat(0.8) };
        let steps = 2000;
        let wi = Vec3::new(0.6, 0.8, 0.0);
        let flux: f64 = (0..steps)
            .map(|i| {
                let theta = (f64::from(i) + 0.5) / f64::from(steps) * std::f64::consts::FRAC_PI_2;
                let wo = Vec3::new(theta.sin() as f32, theta.cos() as f32, 0.0);
                let radiance = f64::from(material.response(Vec3::Y, wo, wi).r);
                radiance * theta.cos() * theta.sin() * 2.0 * std::f64::consts::PI
            })
            .sum::<f64>()
            * std::f64::consts::FRAC_PI_2
            / f64::from(steps);
        assert!((flux - 0.8 * 0.8).abs() < 1e-5, "{flux}");
    }
}
