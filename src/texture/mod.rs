//! Textures: colours, heights and normals that vary over a surface, filtered to the width of a ray.
//!
//! A texture is a function of a [`TexturePoint`] and knows no surface, material or file. Colours
//! are linear Rec.709 everywhere; what a picture file stores as sRGB is decoded where a texel is
//! read, so every average is one of light.
//!
//! Images are filtered by a pyramid ([`MipMap`]); the others in closed form, or by leaving out what
//! is finer than the footprint. No input, NaN and infinite coordinates included, makes a lookup
//! panic, hang or return what is not finite.

mod checker;
mod data;
mod image;
mod mipmap;
mod pattern;
mod place;
mod ramp;

pub use checker::Checker;
pub use data::{ImageData, Pixels};
pub use image::{ImageTexture, Mapping, TexelFilter};
pub use mipmap::{MipMap, Wrap};
pub use pattern::{Gradient, Marble, Noise};
pub use place::{Placement, Space};
pub use ramp::Ramp;

use glam::{DVec3, Vec2, Vec3};

use crate::color::Rgb;

/// Where a texture is asked.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TexturePoint {
    /// The point in object space; a texture applies its own transform to it.
    pub position: DVec3,
    /// The surface's texture coordinates; v points up in pictures.
    pub uv: Vec2,
    /// How wide the ray is there.
    pub footprint: Footprint,
}

/// The part of a surface that a ray stands for: a disc about the point. Zero everywhere asks for
/// the point itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Footprint {
    /// The disc's diameter in object space.
    pub width: f32,
    /// The disc's diameter in texture coordinates: `width` times the root of the ratio of a small
    /// patch's area in texture coordinates to its area in object space.
    pub uv_width: f32,
    /// Unit normal of the surface in object space; zero where it is not known, and the footprint is
    /// then taken for a ball. It tells textures in space that a flat floor has no thickness.
    pub normal: Vec3,
}

/// How a texture's value changes about a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BumpGradient {
    /// Of textures by [`TexturePoint::uv`]: the change per unit of u and of v.
    Uv {
        /// ∂h/∂u.
        du: f32,
        /// ∂h/∂v.
        dv: f32,
    },
    /// Of textures by [`TexturePoint::position`]: the change per unit of object space along each
    /// axis. Its part along the surface's normal is of no use to bump mapping.
    Position(Vec3),
}

/// The textures. Copies share what is large.
#[derive(Debug, Clone)]
pub enum Texture {
    /// A picture.
    Image(ImageTexture),
    /// Cubes (or squares) of two colours.
    Checker(Checker),
    /// Clouds: gradient noise in octaves.
    Noise(Noise),
    /// Bands that turbulence bends.
    Marble(Marble),
    /// Colours along an axis.
    Gradient(Gradient),
}

impl Texture {
    /// The colour at a point, averaged over its footprint.
    pub fn color(&self, point: &TexturePoint) -> Rgb {
        match self {
            Self::Image(t) => t.color(point),
            Self::Checker(t) => t.color(point),
            Self::Noise(t) => t.color(point),
            Self::Marble(t) => t.color(point),
            Self::Gradient(t) => t.color(point),
        }
    }

    /// The value at a point, averaged over its footprint: the one channel of a picture that has
    /// one, else the luminance of the colour.
    pub fn value(&self, point: &TexturePoint) -> f32 {
        self.color(point).luminance()
    }

    /// How [`Self::value`] changes about a point.
    ///
    /// Pictures give the exact slope of what their filter interpolates (those with
    /// [`TexelFilter::Nearest`], which have none, that of [`TexelFilter::Bilinear`]); other textures
    /// the slope between points on both sides, half a footprint away.
    pub fn value_gradient(&self, point: &TexturePoint) -> BumpGradient {
        match self {
            Self::Image(t) => t.value_gradient(point),
            Self::Checker(t) => t.value_gradient(point),
            Self::Noise(t) => t.value_gradient(point),
            Self::Marble(t) => t.value_gradient(point),
            Self::Gradient(t) => t.value_gradient(point),
        }
    }

    /// The unit normal that a normal map holds, in tangent space: x along u, y along v (up, as in
    /// OpenGL), z out of the surface. It is 2c − 1 of the colour, so the picture must have been read
    /// as linear. Where that is zero, the answer is +z.
    pub fn normal(&self, point: &TexturePoint) -> Vec3 {
        let c = self.color(point);
        (2.0 * Vec3::new(c.r, c.g, c.b) - 1.0).normalize_or(Vec3::Z)
    }
}

#[cfg(test)]
mod tests;
