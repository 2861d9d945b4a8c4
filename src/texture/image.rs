//! Pictures laid onto surfaces.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DAffine2, DAffine3, DVec2, DVec3};

use super::mipmap::{MipMap, Wrap};
use super::place::{Placement, Space, finite_f32};
use super::{BumpGradient, TexturePoint};
use crate::color::Rgb;

/// How a point on a surface becomes a point of a picture, whose u points right and v up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mapping {
    /// By the surface's own texture coordinates.
    #[default]
    Uv,
    /// Along the y axis: u = x, v = −z, so a floor shows the picture upright to who stands at +z and
    /// looks down.
    Planar,
    /// About the origin, as a globe: u goes round the y axis from −z over −x, +z (the picture's
    /// middle) and +x; v goes from the south pole (−y) to the north pole by latitude.
    Spherical,
    /// About the y axis, as a label on a tin: u as for [`Self::Spherical`], v = y.
    Cylindrical,
}

impl Mapping {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Uv, Self::Planar, Self::Spherical, Self::Cylindrical];

    /// The name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Uv => "uv",
            Self::Planar => "planar",
            Self::Spherical => "spherical",
            Self::Cylindrical => "cylindrical",
        }
    }
}

/// How pixels of a picture become a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TexelFilter {
    /// Linearly between pixels, and between the two levels of the pyramid that fit the footprint.
    #[default]
    Mip,
    /// Linearly between pixels, whatever the footprint.
    Bilinear,
    /// The pixel that the point lies in.
    Nearest,
}

impl TexelFilter {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Mip, Self::Bilinear, Self::Nearest];

    /// The name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mip => "mip",
            Self::Bilinear => "bilinear",
            Self::Nearest => "nearest",
        }
    }
}

/// A picture on a surface. Copies share the picture.
#[derive(Debug, Clone)]
pub struct ImageTexture {
    /// The picture and its smaller levels.
    pub image: Arc<MipMap>,
    /// How a point becomes texture coordinates.
    pub mapping: Mapping,
    /// What lies beyond the picture's edges.
    pub wrap: Wrap,
    /// How pixels become a colour.
    pub filter: TexelFilter,
    /// From the mapping's coordinates to the picture's: scale by 2 shows the picture twice a unit.
    pub image_from_uv: DAffine2,
    /// From object space to the space that the mappings by position speak of.
    pub texture_from_object: DAffine3,
}

/// A point of a picture.
struct Place {
    uv: DVec2,
    /// The footprint's width in pixels.
    texels: f64,
    /// Gradients of the mapping's own u and v: in object space, or for [`Mapping::Uv`] the first two
    /// axes.
    slopes: [DVec3; 2],
}

impl ImageTexture {
    /// A picture by the surface's texture coordinates, repeated, filtered.
    pub fn new(image: Arc<MipMap>) -> Self {
        Self {
            image,
            mapping: Mapping::default(),
            wrap: Wrap::default(),
            filter: TexelFilter::default(),
            image_from_uv: DAffine2::IDENTITY,
            texture_from_object: DAffine3::IDENTITY,
        }
    }

    /// The colour, averaged over the footprint where the filter does so.
    pub fn color(&self, point: &TexturePoint) -> Rgb {
        let place = self.place(point);
        match self.filter {
            TexelFilter::Mip => self.image.trilinear(place.uv, self.wrap, place.texels),
            TexelFilter::Bilinear => self.image.bilinear(place.uv, self.wrap),
            TexelFilter::Nearest => self.image.nearest(place.uv, self.wrap),
        }
    }

    /// See [`super::Texture::value_gradient`].
    pub fn value_gradient(&self, point: &TexturePoint) -> BumpGradient {
        let place = self.place(point);
        let texels = if self.filter == TexelFilter::Mip { place.texels } else { 0.0 };
        let slope = self.image.slope(place.uv, self.wrap, texels);
        let slope = self.image_from_uv.matrix2.transpose() * slope;
        let gradient = finite_f32(slope.x * place.slopes[0] + slope.y * place.slopes[1]);
        match self.mapping {
            Mapping::Uv => BumpGradient::Uv { du: gradient.x, dv: gradient.y },
            _ => BumpGradient::Position(gradient),
        }
    }

    fn place(&self, point: &TexturePoint) -> Place {
        let space = if self.mapping == Mapping::Uv { Space::Uv } else { Space::Position };
        let texture_from_object = match space {
            Space::Uv => DAffine3::IDENTITY,
            Space::Position => self.texture_from_object,
        };
        let region = Placement { space, texture_from_object }.region(point);
        let (p, reach) = (region.center, region.extent);
        let round = p.x.hypot(p.z);
        let turn = || 0.5 + p.x.atan2(p.z) / TAU;
        let turn_slope = || DVec3::new(p.z, 0.0, -p.x) / (TAU * round * round);
        // Coordinates, the footprint's extent along each, and their gradients.
        let (uv, extent, slopes) = match self.mapping {
            Mapping::Uv => (p.truncate(), reach.truncate(), [DVec3::X, DVec3::Y]),
            Mapping::Planar => {
                (DVec2::new(p.x, -p.z), DVec2::new(reach.x, reach.z), [DVec3::X, -DVec3::Z])
            }
            Mapping::Cylindrical => {
                let across = of_a_turn(reach.max_element() / (TAU * round));
                (DVec2::new(turn(), p.y), DVec2::new(across, reach.y), [turn_slope(), DVec3::Y])
            }
            Mapping::Spherical => {
                let far = p.length();
                let width = reach.max_element();
                let latitude = 0.5 + p.y.atan2(round) / PI;
                let slope = (DVec3::Y - p * (p.y / (far * far))) / (PI * round);
                let extent =
                    DVec2::new(of_a_turn(width / (TAU * round)), of_a_turn(width / (PI * far)));
                (DVec2::new(turn(), latitude), extent, [turn_slope(), slope])
            }
        };
        let matrix = self.image_from_uv.matrix2;
        let [width, height] = self.image.size().map(f64::from);
        let across = (matrix.row(0) * extent).length() * width;
        let up = (matrix.row(1) * extent).length() * height;
        Place {
            uv: self.image_from_uv.transform_point2(uv),
            texels: footprint(across, up),
            slopes: slopes.map(|s| {
                let slope = texture_from_object.matrix3.transpose() * s;
                if slope.is_finite() { slope } else { DVec3::ZERO }
            }),
        }
    }
}

/// The part of a turn that a footprint covers: all of it near the axis, none of it where the
/// footprint is a point.
fn of_a_turn(extent: f64) -> f64 {
    if extent.is_nan() { 0.0 } else { extent.min(1.0) }
}

/// One width for a footprint that extends over `across` × `up` pixels: that of the square of the
/// same area (as ray cones have it: Akenine-Möller et al., *Improved Shader and Texture Level of
/// Detail Using Ray Cones*, JCGT 2021), yet at least a quarter of the longer side.
fn footprint(across: f64, up: f64) -> f64 {
    (across * up).sqrt().max(across.max(up) / 4.0)
}
