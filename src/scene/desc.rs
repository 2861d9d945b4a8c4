//! What a person wrote, whatever the format: plain data, with the place it was written at.

use std::fmt;
use std::sync::Arc;

use glam::{DAffine3, DMat4, DVec3};

use super::maps::Maps;
use super::volumes::VolumeDesc;
use crate::accel::{BuildQuality, Compact, Precision};
use crate::camera::Projection;
use crate::color::Rgb;
use crate::film::Filter;
use crate::geometry::freeform::FreeformSurface;
use crate::geometry::{Implicit, Isosurface, Polygon, Quadric, TriangleMesh};
use crate::light::Falloff;
use crate::material::Material;
use crate::math::Bounds;
use crate::medium::Fog;
use crate::texture::TexelFilter;

/// Where something was written: `scene.toml:12:3`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// File, or the option of the command line.
    pub source: Arc<str>,
    /// Line and column, from 1; none where the source has no lines.
    pub position: Option<(usize, usize)>,
}

impl Default for Location {
    fn default() -> Self {
        Self { source: "scene".into(), position: None }
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.position {
            Some((line, column)) => write!(f, "{}:{line}:{column}", self.source),
            None => f.write_str(&self.source),
        }
    }
}

/// A name that stands for something defined elsewhere in the scene.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The name.
    pub name: String,
    /// Where it is used.
    pub at: Location,
}

impl Reference {
    /// A reference from nowhere in particular.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), at: Location::default() }
    }
}

/// A whole scene as it was written.
#[derive(Debug, Clone, Default)]
pub struct SceneDesc {
    /// Size and background.
    pub image: ImageDesc,
    /// The camera in use; the scene is framed automatically where there is none.
    pub camera: Option<CameraDesc>,
    /// How to render.
    pub settings: RenderSettings,
    /// Ambient radiance I_a; none where the scene does not say.
    pub ambient: Option<Rgb>,
    /// Materials by name.
    pub materials: Vec<MaterialDesc>,
    /// Meshes that objects refer to by index.
    pub meshes: Vec<TriangleMesh>,
    /// What is in the scene.
    pub objects: Vec<ObjectDesc>,
    /// What is only copied.
    pub prototypes: Vec<PrototypeDesc>,
    /// Lights. Where there are none, nothing that glows and no ambient light either, a scene is lit from
    /// the camera's side.
    pub lights: Vec<LightDesc>,
    /// Fog around everything, with heights in world coordinates.
    pub fog: Option<Fog>,
    /// Grids that glow and absorb.
    pub volumes: Vec<VolumeDesc>,
}

impl SceneDesc {
    /// How each texture that is a picture is filtered, if `texture_filter` does not say otherwise.
    pub fn texture_filters(&self) -> impl Iterator<Item = TexelFilter> {
        self.materials.iter().flat_map(|material| material.maps.texture_filters())
    }
}

/// The picture.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageDesc {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Radiance where nothing is hit; where not given, black, or grey for a scene that lights itself.
    pub background: Option<Rgb>,
}

impl Default for ImageDesc {
    fn default() -> Self {
        Self { size: [1280, 720], background: None }
    }
}

/// A camera.
#[derive(Debug, Clone)]
pub struct CameraDesc {
    /// Where it was written.
    pub at: Location,
    /// Perspective or parallel. A parallel picture of height 0 is as high as the scene, where the
    /// camera is framed automatically.
    pub projection: Projection,
    /// Where it stands; framed automatically where not given.
    pub place: Option<PlaceDesc>,
    /// A lens with depth of field; a pinhole where not given.
    pub lens: Option<LensDesc>,
}

/// A thin lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensDesc {
    /// Radius of the aperture, > 0.
    pub radius: f64,
    /// Distance of the plane in focus, along the view, > 0; that of the `target` where not given.
    pub focus_distance: Option<f64>,
}

/// Where a camera stands and looks.
#[derive(Debug, Clone, Copy)]
pub enum PlaceDesc {
    /// From one point to another.
    LookAt {
        /// The camera.
        eye: DVec3,
        /// What is in the middle of the picture.
        target: DVec3,
        /// What is up.
        up: DVec3,
    },
    /// Camera to world, looking along −Z.
    Matrix(DMat4),
}

/// How to render.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderSettings {
    /// The algorithm.
    pub integrator: IntegratorKind,
    /// Samples a pixel, ≥ 1.
    pub samples: u32,
    /// Bounces: 0 is the camera ray and its direct light. `flat`, `direct` and `ao` have none.
    pub max_depth: u32,
    /// A branch of the ray tree ends where its weight (largest component) falls below this.
    pub prune: f32,
    /// Whether it ends there only with a probability that keeps the picture unbiased.
    pub roulette: bool,
    /// How exact ray queries are.
    pub precision: Precision,
    /// What things cast shadows.
    pub shadows: Shadows,
    /// Shadow rays from each point to each light that has an area, ≥ 1.
    pub shadow_samples: u32,
    /// Where a scene has more lights, each point draws this many of them by what they contribute; ≥ 1.
    pub light_samples: u32,
    /// The one wavelength to trace, in nm; all of the visible ones where not given.
    pub wavelength: Option<f64>,
    /// How far `ao` looks; without end where not given.
    pub ao_distance: Option<f64>,
    /// The reconstruction filter.
    pub filter: Filter,
    /// How all textures that are pictures are filtered; as each says where not given.
    pub texture_filter: Option<TexelFilter>,
    /// How rays leave surfaces.
    pub epsilon: Epsilon,
    /// Work put into the hierarchy.
    pub build_quality: BuildQuality,
    /// Whether it takes half the memory, and longer to trace.
    pub compact: Compact,
    /// How far triangles may be from the freeform surfaces that they stand for.
    pub tolerance: Tolerance,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            integrator: IntegratorKind::Whitted,
            samples: 16,
            max_depth: 8,
            prune: 0.004,
            roulette: false,
            precision: Precision::default(),
            shadows: Shadows::Opaque,
            shadow_samples: 1,
            light_samples: 16,
            wavelength: None,
            ao_distance: None,
            filter: Filter::default(),
            texture_filter: None,
            epsilon: Epsilon::Auto,
            build_quality: BuildQuality::default(),
            compact: Compact::default(),
            tolerance: Tolerance::Pixels(0.5),
        }
    }
}

/// How far triangles may be from the surface that they stand for; above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// In pixels, where the surface is nearest to the camera.
    Pixels(f64),
    /// In metres of the world.
    Meters(f64),
}

impl Tolerance {
    /// Another one, that many times as large.
    pub fn times(self, factor: f64) -> Self {
        match self {
            Self::Pixels(count) => Self::Pixels(count * factor),
            Self::Meters(meters) => Self::Meters(meters * factor),
        }
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (number, unit) = match *self {
            Self::Pixels(count) => (count, "px"),
            Self::Meters(meters) => (meters, "m"),
        };
        if (1e-3..1e6).contains(&number) {
            return write!(f, "{} {unit}", (number * 1e4).round() / 1e4);
        }
        write!(f, "{number:.1e} {unit}")
    }
}

/// The algorithms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IntegratorKind {
    /// The colour of what is hit, without light.
    Flat,
    /// Local illumination: ambient, diffuse and specular light of each source, with shadows.
    Direct,
    /// The same at every hit of a tree of mirrored and refracted rays.
    Whitted,
    /// Ambient occlusion: the share of the surroundings that a point sees.
    Ao,
}

impl IntegratorKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Flat, Self::Direct, Self::Whitted, Self::Ao];

    /// The name in scene files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Direct => "direct",
            Self::Whitted => "whitted",
            Self::Ao => "ao",
        }
    }
}

/// What casts shadows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shadows {
    /// Nothing.
    None,
    /// Everything, glass too.
    Opaque,
    /// Everything but glass, which light passes straight, dimmed by absorption.
    Tinted,
    /// The same, dimmed also by what each of the glass's surfaces reflects.
    Fresnel,
}

impl Shadows {
    /// Whether there are any.
    pub const fn are_cast(self) -> bool {
        !matches!(self, Self::None)
    }

    /// The name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "false",
            Self::Opaque => "opaque",
            Self::Tinted => "tinted",
            Self::Fresnel => "fresnel",
        }
    }

    /// Those with a name in scene files; `true` and `false` stand for `opaque` and none.
    pub const NAMED: [(&str, Self); 3] =
        [("opaque", Self::Opaque), ("tinted", Self::Tinted), ("fresnel", Self::Fresnel)];
}

/// How a ray that leaves a surface is kept from hitting it again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Epsilon {
    /// It starts outside the error bound of the hit point.
    Auto,
    /// Hits nearer than this are none: the lecture's fixed ε, in world units.
    Fixed(f32),
}

/// A named material.
#[derive(Debug, Clone)]
pub struct MaterialDesc {
    /// Its name.
    pub name: String,
    /// How it scatters light.
    pub material: Material,
    /// Radiance that it gives off, on both sides.
    pub emission: Rgb,
    /// What varies over the surface.
    pub maps: Maps,
}

impl MaterialDesc {
    /// A material that is the same everywhere and does not glow.
    pub fn new(name: impl Into<String>, material: Material) -> Self {
        Self { name: name.into(), material, emission: Rgb::BLACK, maps: Maps::default() }
    }
}

/// Something in the scene.
#[derive(Debug, Clone)]
pub struct ObjectDesc {
    /// Where it was written.
    pub at: Location,
    /// What it is called in Cryptomatte; several may be called the same.
    pub name: String,
    /// What it is.
    pub shape: ShapeDesc,
    /// Its material; a neutral grey where not given.
    pub material: Option<Reference>,
    /// World (or prototype) from object.
    pub transform: DAffine3,
    /// Moves the textures on it, in the object's own space.
    pub texture_transform: DAffine3,
}

impl ObjectDesc {
    /// An object from nowhere in particular, not transformed.
    pub fn new(shape: ShapeDesc, material: Option<&str>) -> Self {
        Self {
            at: Location::default(),
            name: "object".to_owned(),
            shape,
            material: material.map(Reference::new),
            transform: DAffine3::IDENTITY,
            texture_transform: DAffine3::IDENTITY,
        }
    }
}

/// The kinds of objects.
#[derive(Debug, Clone)]
pub enum ShapeDesc {
    /// A mesh, by index into [`SceneDesc::meshes`].
    Mesh(usize),
    /// A sphere.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Radius, > 0.
        radius: f64,
    },
    /// A flat disk.
    Disk {
        /// Centre.
        center: DVec3,
        /// Axis, any length but zero; it points to the front.
        normal: DVec3,
        /// Radius, > 0.
        radius: f64,
        /// Radius of the hole, ≥ 0 and less than `radius`.
        inner_radius: f64,
    },
    /// A box along the axes.
    Box(Bounds),
    /// A cylinder, a cone or a truncated cone.
    Cone {
        /// Middle of its bottom.
        from: DVec3,
        /// Middle of its top, elsewhere.
        to: DVec3,
        /// Radius at the bottom and at the top, ≥ 0, not both 0.
        radii: [f64; 2],
        /// Whether it is closed at both ends.
        has_caps: bool,
    },
    /// A torus.
    Torus {
        /// Centre.
        center: DVec3,
        /// Axis, any length but zero.
        axis: DVec3,
        /// Radius of the ring, ≥ 0.
        major_radius: f64,
        /// Radius of the tube, > 0.
        minor_radius: f64,
    },
    /// A plane without end.
    Plane {
        /// One of its points.
        point: DVec3,
        /// Normal of its front, any length but zero.
        normal: DVec3,
    },
    /// A quadric.
    Quadric(Quadric),
    /// A surface that an expression describes.
    Implicit(Implicit),
    /// An isosurface of a grid.
    Isosurface(Isosurface),
    /// A flat polygon.
    Polygon(Polygon),
    /// A freeform surface, which becomes a mesh once it is known from where it is seen.
    Freeform(Arc<FreeformDesc>),
    /// Copies of a prototype, one a transform.
    Instances {
        /// Which prototype.
        prototype: Reference,
        /// World from prototype.
        transforms: Vec<DAffine3>,
    },
}

/// A freeform surface and how near its triangles shall be.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeformDesc {
    /// The surface.
    pub surface: FreeformSurface,
    /// Where not given, that of [`RenderSettings`].
    pub tolerance: Option<Tolerance>,
}

/// Objects that are only copied.
#[derive(Debug, Clone)]
pub struct PrototypeDesc {
    /// Its name.
    pub name: String,
    /// Where it was written.
    pub at: Location,
    /// What it holds.
    pub objects: Vec<ObjectDesc>,
}

/// A light, in world coordinates.
#[derive(Debug, Clone, PartialEq)]
pub enum LightDesc {
    /// A point.
    Point {
        /// Where.
        position: DVec3,
        /// Radiant intensity, W/sr.
        intensity: Rgb,
        /// Dependence on the distance.
        falloff: Falloff,
    },
    /// A point that shines into a cone.
    Spot {
        /// Where.
        position: DVec3,
        /// The way its axis points; any length but zero.
        direction: DVec3,
        /// Radiant intensity on the axis, W/sr.
        intensity: Rgb,
        /// Angle between the axis and where the light ends, in radians.
        cone_angle: f64,
        /// Width of the rim within it over which the light fades, in radians, ≤ `cone_angle`.
        penumbra_angle: f64,
    },
    /// Parallel light.
    Directional {
        /// The way the light travels; any length but zero.
        direction: DVec3,
        /// Irradiance on a plane that faces it, W/m².
        irradiance: Rgb,
    },
    /// A parallelogram that shines to one side, that of `edge_u` × `edge_v`.
    Rectangle {
        /// One of its corners.
        corner: DVec3,
        /// From there along one edge.
        edge_u: DVec3,
        /// From there along the other.
        edge_v: DVec3,
        /// Radiance, the same in all directions.
        radiance: Rgb,
    },
    /// A disk that shines to one side.
    Disk {
        /// Centre.
        center: DVec3,
        /// The side it shines to; any length but zero.
        normal: DVec3,
        /// Radius, > 0.
        radius: f64,
        /// Radiance, the same in all directions.
        radiance: Rgb,
    },
    /// A sphere.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Radius, > 0.
        radius: f64,
        /// Radiance, the same in all directions.
        radiance: Rgb,
    },
}
