//! One description of a scene, and what becomes of it here and in POV-Ray.

use std::f64::consts::PI;
use std::fmt::Write as _;

use alhazen::camera::Projection;
use alhazen::color::Rgb;
use alhazen::film::Filter;
use alhazen::geometry::TriangleMesh;
use alhazen::light::Falloff;
use alhazen::material::{
    Dielectric, FresnelModel, FresnelPower, Ior, Material, MirrorFresnel, Phong as PhongMaterial,
    PhongModel,
};
use alhazen::medium::{Fog, FogProfile};
use alhazen::scene::{
    CameraDesc, LightDesc, Location, MaterialDesc, ObjectDesc, PlaceDesc, SceneDesc, Shadows,
    ShapeDesc,
};
use alhazen::texture::{Checker, Placement, Texture};
use glam::DVec3;

pub type Color = [f64; 3];

pub enum Shape {
    Sphere(DVec3, f64),
    /// Outside is where the corners run counter-clockwise.
    Triangles(Vec<[DVec3; 3]>),
}

#[derive(Clone)]
pub enum Surface {
    Diffuse(Color),
    /// A texture, in cubes of this edge.
    Checker([Color; 2], f64),
    /// Diffuse, with a highlight and a share of what is mirrored; by Fresnel's equations where there is
    /// a coat of an index of refraction.
    Phong {
        diffuse: Color,
        specular: f64,
        shininess: f64,
        mirror: f64,
        coat: Option<f64>,
    },
    Mirror(Color),
    Glass(Glass),
}

#[derive(Clone)]
pub struct Glass {
    pub ior: f64,
    /// Ratio of the indices at 380 and at 730 nm, with that of `ior` at 555 nm.
    pub dispersion: f64,
    pub absorption: Color,
    /// Whether it reflects where it does not have to.
    pub reflects: bool,
}

/// POV-Ray's spectrum.
pub const VIOLET: f64 = 380.0;
pub const RED: f64 = 730.0;

impl Glass {
    pub fn new(ior: f64) -> Self {
        Self { ior, dispersion: 1.0, absorption: [0.0; 3], reflects: true }
    }

    /// The index at a wavelength in nm by POV-Ray's law, n·D^((555 − λ)/350) (`spectral.h` of its
    /// source).
    pub fn index(&self, nanometres: f64) -> f64 {
        self.ior * self.dispersion.powf((0.5 * (VIOLET + RED) - nanometres) / (RED - VIOLET))
    }

    /// Cauchy's law through the ends of the spectrum.
    fn law(&self) -> Ior {
        if self.dispersion == 1.0 {
            return Ior::Constant(self.ior);
        }
        let inverse_square = |nanometres: f64| (1000.0 / nanometres).powi(2);
        let b =
            (self.index(VIOLET) - self.index(RED)) / (inverse_square(VIOLET) - inverse_square(RED));
        Ior::Cauchy { a: self.index(RED) - b * inverse_square(RED), b, c: 0.0 }
    }
}

pub enum Lamp {
    /// Without falloff: of irradiance π times the colour.
    Point(DVec3, Color),
    /// Parallel light that comes from there, of irradiance π times the colour.
    Sun(DVec3, Color),
    /// With the inverse square, of this intensity; angles in degrees.
    Spot {
        at: DVec3,
        towards: DVec3,
        intensity: f64,
        cone: f64,
        penumbra: f64,
    },
    Rectangle {
        corner: DVec3,
        u: DVec3,
        v: DVec3,
        radiance: f64,
        theirs: Theirs,
    },
}

/// What stands for a rectangle in POV-Ray. All have n × n points in the middle of its cells.
#[derive(Clone, Copy)]
pub enum Theirs {
    /// Its own kind of area light, of brightness 1, with n a power of two: every point counts the
    /// same, without cosine or inverse square.
    Area(u32),
    /// Spot lights with the cosine of the light's side and the inverse square.
    Spots(u32),
}

/// A scene for both programs.
pub struct Twin {
    pub size: [u32; 2],
    pub eye: DVec3,
    pub target: DVec3,
    /// What is up in the picture: leaning, so that few edges run along rows or columns, where a
    /// regular grid of samples is at its worst.
    pub up: DVec3,
    /// Vertical, in degrees.
    pub fov: f64,
    pub background: Color,
    pub ambient: f64,
    pub depth: u32,
    pub shadows: bool,
    /// Samples a pixel here.
    pub samples: u32,
    /// Pixels along each side of a pixel there.
    pub pixels: u32,
    pub objects: Vec<(Shape, Surface)>,
    pub lamps: Vec<Lamp>,
    /// Mean free path and radiance.
    pub fog: Option<(f64, Color)>,
    /// The one wavelength to trace here.
    pub wavelength: Option<f64>,
}

impl Twin {
    pub fn new(eye: DVec3, target: DVec3, fov: f64) -> Self {
        let long = crate::common::verify();
        Self {
            size: if long { [320, 240] } else { [160, 120] },
            eye,
            target,
            up: DVec3::new(0.17, 1.0, 0.0),
            fov,
            background: [0.0; 3],
            ambient: 0.0,
            depth: 6,
            shadows: true,
            samples: if long { 144 } else { 64 },
            pixels: if long { 8 } else { 6 },
            objects: Vec::new(),
            lamps: Vec::new(),
            fog: None,
            wavelength: None,
        }
    }

    pub fn add(&mut self, shape: Shape, surface: Surface) {
        self.objects.push((shape, surface));
    }

    /// A room of ±`half` around the origin, its walls tiled in two colours each. The tiles are
    /// geometry, and so the same in both programs to the last edge.
    pub fn add_room(&mut self, half: f64, tiles: i32) {
        let colors: [[Color; 2]; 6] = [
            [[0.8, 0.15, 0.1], [0.35, 0.1, 0.3]],
            [[0.1, 0.6, 0.2], [0.7, 0.75, 0.3]],
            [[0.75, 0.7, 0.6], [0.25, 0.25, 0.3]],
            [[0.9, 0.9, 0.9], [0.5, 0.6, 0.8]],
            [[0.15, 0.2, 0.7], [0.85, 0.6, 0.2]],
            [[0.4, 0.8, 0.8], [0.6, 0.3, 0.15]],
        ];
        for (wall, pair) in colors.into_iter().enumerate() {
            let (axis, sign) = (wall / 2, if wall % 2 == 0 { 1.0 } else { -1.0 });
            let place = |u: f64, v: f64| {
                let mut p = [0.0; 3];
                p[axis] = half * sign;
                p[(axis + 1) % 3] = u;
                p[(axis + 2) % 3] = v;
                DVec3::from_array(p)
            };
            for (parity, color) in pair.into_iter().enumerate() {
                let mut triangles = Vec::new();
                for (i, j) in (0..tiles).flat_map(|i| (0..tiles).map(move |j| (i, j))) {
                    if (i + j) as usize % 2 == parity {
                        let at = |k: i32| half * (f64::from(2 * k) / f64::from(tiles) - 1.0);
                        let [a, b] = [place(at(i), at(j)), place(at(i + 1), at(j))];
                        let [c, d] = [place(at(i + 1), at(j + 1)), place(at(i), at(j + 1))];
                        triangles.extend(quad([a, b, c, d]));
                    }
                }
                self.add(Shape::Triangles(triangles), Surface::Diffuse(color));
            }
        }
    }

    /// What we render.
    pub fn ours(&self) -> SceneDesc {
        let mut desc = SceneDesc::default();
        desc.image.size = self.size;
        desc.image.background = Some(rgb(self.background));
        desc.ambient = Some(Rgb::splat(self.ambient as f32));
        desc.camera = Some(CameraDesc {
            at: Location::default(),
            projection: Projection::Perspective { fov: self.fov.to_radians() },
            place: Some(PlaceDesc::LookAt { eye: self.eye, target: self.target, up: self.up }),
            lens: None,
        });
        let settings = &mut desc.settings;
        settings.samples = self.samples;
        settings.filter = Filter::Box;
        settings.max_depth = self.depth;
        settings.prune = 0.0;
        settings.wavelength = self.wavelength;
        settings.shadows = if self.shadows { Shadows::Tinted } else { Shadows::None };
        desc.fog = self.fog.map(|(distance, color)| Fog {
            scattering: Rgb::splat(distance.recip() as f32),
            absorption: Rgb::BLACK,
            radiance: rgb(color),
            profile: FogProfile::Homogeneous,
            dims_lights: false,
        });
        for (i, (shape, surface)) in self.objects.iter().enumerate() {
            let name = i.to_string();
            let mut material = MaterialDesc::new(&*name, surface.ours());
            if let Surface::Checker(colors, scale) = surface {
                let (colors, placement) = (colors.map(rgb), Placement::default());
                let checker = Checker { colors, scale: *scale, placement };
                material.maps.color = Some(Texture::Checker(checker));
            }
            desc.materials.push(material);
            let shape = match shape {
                Shape::Sphere(center, radius) => {
                    ShapeDesc::Sphere { center: *center, radius: *radius }
                }
                Shape::Triangles(triangles) => {
                    let xyz = triangles.iter().flatten().flat_map(|p| p.as_vec3().to_array());
                    let indices =
                        (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
                    desc.meshes.push(TriangleMesh::new(xyz.collect(), indices.collect()));
                    ShapeDesc::Mesh(desc.meshes.len() - 1)
                }
            };
            desc.objects.push(ObjectDesc::new(shape, Some(&name)));
        }
        desc.lights = self.lamps.iter().map(Lamp::ours).collect();
        desc
    }

    /// What POV-Ray renders: all numbers as they are, in a right-handed space.
    pub fn theirs(&self) -> String {
        let [w, h] = self.size.map(f64::from);
        // POV-Ray's angle is the horizontal one.
        let angle = 2.0 * ((0.5 * self.fov).to_radians().tan() * w / h).atan().to_degrees();
        let mut text = format!(
            "#version 3.7;
global_settings {{ assumed_gamma 1.0 max_trace_level {} adc_bailout 0 ambient_light rgb {} }}
background {{ rgb {} }}
camera {{ perspective location {} right -x*{} up y sky {} angle {angle} look_at {} }}
",
            self.depth + 1,
            self.ambient,
            triple(self.background),
            vector(self.eye),
            w / h,
            vector(self.up),
            vector(self.target),
        );
        if let Some((distance, color)) = self.fog {
            let color = triple(color);
            writeln!(text, "fog {{ fog_type 1 distance {distance} color rgb {color} }}").unwrap();
        }
        for (shape, surface) in &self.objects {
            let look = surface.theirs();
            match shape {
                Shape::Sphere(center, radius) => {
                    writeln!(text, "sphere {{ {}, {radius} {look} }}", vector(*center)).unwrap();
                }
                Shape::Triangles(triangles) => {
                    text.push_str("mesh {\n");
                    for [a, b, c] in triangles.iter().map(|corners| corners.map(vector)) {
                        writeln!(text, "triangle {{ {a}, {b}, {c} }}").unwrap();
                    }
                    writeln!(text, "{look} }}").unwrap();
                }
            }
        }
        let shadows = if self.shadows { "" } else { "shadowless" };
        for lamp in &self.lamps {
            lamp.theirs(&mut text, shadows);
        }
        text
    }
}

impl Surface {
    fn ours(&self) -> Material {
        match self {
            Self::Diffuse(color) => Material::Diffuse { reflectance: rgb(*color) },
            Self::Checker(..) => Material::Diffuse { reflectance: Rgb::splat(0.5) },
            Self::Phong { diffuse, specular, shininess, mirror, coat } => {
                Material::Phong(PhongMaterial {
                    ambient: rgb(*diffuse),
                    diffuse: rgb(*diffuse),
                    specular: Rgb::splat(*specular as f32),
                    shininess: *shininess as f32,
                    model: PhongModel::Phong,
                    mirror: Rgb::splat(*mirror as f32),
                    fresnel: coat
                        .map(|ior| MirrorFresnel { model: FresnelModel::Exact, ior: ior as f32 }),
                })
            }
            Self::Mirror(color) => Material::Mirror { reflectance: rgb(*color), fresnel: None },
            Self::Glass(glass) => Material::Dielectric(Dielectric {
                ior: glass.law(),
                absorption: rgb(glass.absorption),
                priority: 0,
                fresnel: if glass.reflects {
                    FresnelModel::Exact
                } else {
                    FresnelModel::Power(FresnelPower { offset: 0.0, scale: 0.0, power: 1.0 })
                },
            }),
        }
    }

    fn theirs(&self) -> String {
        let matte = "finish { ambient 1 diffuse 1 }";
        match self {
            Self::Diffuse(color) => format!("pigment {{ rgb {} }} {matte}", triple(*color)),
            Self::Checker([a, b], scale) => {
                let [a, b] = [triple(*a), triple(*b)];
                format!("pigment {{ checker rgb {a}, rgb {b} scale {scale} }} {matte}")
            }
            Self::Phong { diffuse, specular, shininess, mirror, coat } => {
                let (reflection, interior) = match coat {
                    None => (format!("{mirror}"), String::new()),
                    Some(n) => {
                        (format!("0, {mirror} fresnel on"), format!("interior {{ ior {n} }}"))
                    }
                };
                format!(
                    "pigment {{ rgb {} }} finish {{ ambient 1 diffuse 1 phong {specular} \
                     phong_size {shininess} reflection {{ {reflection} }} }} {interior}",
                    triple(*diffuse)
                )
            }
            Self::Mirror(color) => format!(
                "pigment {{ rgb 0 }} finish {{ ambient 0 diffuse 0 reflection {{ rgb {} }} }}",
                triple(*color)
            ),
            Self::Glass(glass) => {
                let mut text = "pigment { rgbt 1 } finish { ambient 0 diffuse 0".to_owned();
                if glass.reflects {
                    text.push_str(" reflection { 0, 1 fresnel on } conserve_energy");
                }
                write!(text, " }} interior {{ ior {}", glass.ior).unwrap();
                if glass.dispersion != 1.0 {
                    let d = glass.dispersion;
                    write!(text, " dispersion {d} dispersion_samples 100").unwrap();
                }
                // With the power 1000 and above: exp(−(1 − c)·depth/d).
                let strongest = glass.absorption.into_iter().fold(0.0, f64::max);
                if strongest > 0.0 {
                    let color = triple(glass.absorption.map(|sigma| 1.0 - sigma / strongest));
                    let d = strongest.recip();
                    write!(text, " fade_distance {d} fade_power 1001 fade_color rgb {color}")
                        .unwrap();
                }
                text + " }"
            }
        }
    }
}

/// POV-Ray dims a light by 2/(1 + (r/d)²): with so small a distance d, by 2d²/r² to seven digits.
const FADE: f64 = 1e-3;

impl Lamp {
    fn ours(&self) -> LightDesc {
        match *self {
            Self::Point(position, color) => {
                LightDesc::Point { position, intensity: rgb(color), falloff: Falloff::None }
            }
            Self::Sun(from, color) => {
                LightDesc::Directional { direction: -from, irradiance: rgb(color.map(|c| PI * c)) }
            }
            Self::Spot { at, towards, intensity, cone, penumbra } => LightDesc::Spot {
                position: at,
                direction: towards - at,
                intensity: Rgb::splat(intensity as f32),
                cone_angle: cone.to_radians(),
                penumbra_angle: penumbra.to_radians(),
            },
            Self::Rectangle { corner, u, v, radiance, .. } => LightDesc::Rectangle {
                corner,
                edge_u: u,
                edge_v: v,
                radiance: Rgb::splat(radiance as f32),
            },
        }
    }

    fn theirs(&self, text: &mut String, shadows: &str) {
        // Radiance that leaves is colour · cos there, intensity/(π r²) · cos here.
        let fading = |intensity: f64| intensity / PI / (2.0 * FADE * FADE);
        match *self {
            Self::Point(at, color) => {
                let (at, color) = (vector(at), triple(color));
                writeln!(text, "light_source {{ {at} rgb {color} {shadows} }}").unwrap();
            }
            Self::Sun(from, color) => {
                let (from, color) = (vector(from * 1e3), triple(color));
                let parallel = "parallel point_at <0,0,0>";
                writeln!(text, "light_source {{ {from} rgb {color} {parallel} {shadows} }}")
                    .unwrap();
            }
            Self::Spot { at, towards, intensity, cone, penumbra } => writeln!(
                text,
                "light_source {{ {} rgb {} spotlight radius {} falloff {cone} tightness 0 \
                 point_at {} fade_distance {FADE} fade_power 2 {shadows} }}",
                vector(at),
                fading(intensity),
                cone - penumbra,
                vector(towards)
            )
            .unwrap(),
            Self::Rectangle { corner, u, v, radiance, theirs } => match theirs {
                Theirs::Area(n) => {
                    // The outer points of POV-Ray's grid lie on the edges of the area. Its
                    // sub-divisions end at 2 × 2 points once they may not end before.
                    let inner = f64::from(n - 1) / f64::from(n);
                    writeln!(
                        text,
                        "light_source {{ {} rgb 1 area_light {}, {}, {n}, {n} \
                         adaptive {} {shadows} }}",
                        vector(corner + 0.5 * (u + v)),
                        vector(u * inner),
                        vector(v * inner),
                        n.ilog2()
                    )
                    .unwrap();
                }
                Theirs::Spots(n) => {
                    let normal = u.cross(v);
                    let each = fading(radiance * normal.length() / f64::from(n * n));
                    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                        let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
                        let at = corner + u * middle(i) + v * middle(j);
                        // With the tightness 1, dimmed by the cosine to the axis.
                        writeln!(
                            text,
                            "light_source {{ {} rgb {each} spotlight radius 89.9 falloff 89.99 \
                             tightness 1 point_at {} fade_distance {FADE} fade_power 2 {shadows} }}",
                            vector(at),
                            vector(at + normal)
                        )
                        .unwrap();
                    }
                }
            },
        }
    }
}

pub fn rgb(color: Color) -> Rgb {
    color.map(|c| c as f32).into()
}

fn triple([r, g, b]: Color) -> String {
    format!("<{r},{g},{b}>")
}

fn vector(v: DVec3) -> String {
    triple(v.to_array())
}

pub fn quad([a, b, c, d]: [DVec3; 4]) -> [[DVec3; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// A box with its corners counter-clockwise from outside.
pub fn block(low: DVec3, high: DVec3) -> Vec<[DVec3; 3]> {
    let p = |x: i32, y: i32, z: i32| {
        let pick = |i: i32, low: f64, high: f64| if i == 0 { low } else { high };
        DVec3::new(pick(x, low.x, high.x), pick(y, low.y, high.y), pick(z, low.z, high.z))
    };
    [
        [p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)],
        [p(1, 0, 0), p(1, 1, 0), p(1, 1, 1), p(1, 0, 1)],
        [p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)],
        [p(0, 1, 0), p(0, 1, 1), p(1, 1, 1), p(1, 1, 0)],
        [p(0, 0, 0), p(0, 1, 0), p(1, 1, 0), p(1, 0, 0)],
        [p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)],
    ]
    .into_iter()
    .flat_map(quad)
    .collect()
}

/// Rotates about the vertical axis through `center`, by degrees.
pub fn turned(triangles: Vec<[DVec3; 3]>, center: DVec3, degrees: f64) -> Vec<[DVec3; 3]> {
    let turn = glam::DQuat::from_rotation_y(degrees.to_radians());
    triangles.into_iter().map(|t| t.map(|p| center + turn * (p - center))).collect()
}
