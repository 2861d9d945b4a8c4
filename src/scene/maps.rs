//! What varies over a surface: textures, mapped normals and bumps, as wide as the ray that sees them.

use glam::{DMat3, DVec3, Vec2, Vec3};

use super::build::Scene;
use super::draft::Look;
use super::surface::SurfacePoint;
use crate::accel::{Geometry, Hit, affine_from_rows};
use crate::geometry::{AnalyticShape, Parameters, Shapes, Sphere, with_shapes};
use crate::material::Material;
use crate::math::Ray;
use crate::texture::{
    BumpGradient, Footprint, Mapping, MipMap, Space, TexelFilter, Texture, TexturePoint,
};

/// The textures of a material. What has none keeps the material's own value.
#[derive(Debug, Clone, Default)]
pub struct Maps {
    /// `reflectance` of `diffuse`, `diffuse` of `phong`.
    pub color: Option<Texture>,
    /// Whether that is the answer to ambient light too.
    pub colors_ambient: bool,
    /// `specular` of `phong`.
    pub specular: Option<Texture>,
    /// `mirror` of `phong`, `reflectance` of `mirror`.
    pub mirror: Option<Texture>,
    /// Normals, in tangent space, and how strongly they bend.
    pub normal: Option<(Texture, f32)>,
    /// Heights, and how many metres 1 is.
    pub bump: Option<(Texture, f32)>,
}

impl Maps {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.all().next().is_none()
    }

    /// Whether any of them is laid out by texture coordinates.
    pub fn needs_uv(&self) -> bool {
        self.normal.is_some() || self.all().any(needs_uv)
    }

    /// The pictures among them, in a fixed order.
    pub fn images(&self) -> impl Iterator<Item = &MipMap> {
        self.all().filter_map(|texture| match texture {
            Texture::Image(texture) => Some(texture.image.as_ref()),
            _ => None,
        })
    }

    /// How each of these is filtered.
    pub(super) fn texture_filters(&self) -> impl Iterator<Item = TexelFilter> {
        self.all().filter_map(|texture| match texture {
            Texture::Image(texture) => Some(texture.filter),
            _ => None,
        })
    }

    /// Filters all pictures among them like this.
    pub(super) fn filter_pictures(&mut self, filter: TexelFilter) {
        let relief = self.normal.iter_mut().chain(&mut self.bump).map(|(texture, _)| texture);
        let colors = self.color.iter_mut().chain(&mut self.specular).chain(&mut self.mirror);
        for texture in colors.chain(relief) {
            if let Texture::Image(texture) = texture {
                texture.filter = filter;
            }
        }
    }

    fn all(&self) -> impl Iterator<Item = &Texture> {
        let relief = self.normal.iter().chain(&self.bump).map(|(texture, _)| texture);
        self.color.iter().chain(&self.specular).chain(&self.mirror).chain(relief)
    }
}

/// Whether a texture is laid out by texture coordinates.
fn needs_uv(texture: &Texture) -> bool {
    let placement = match texture {
        Texture::Image(t) => return t.mapping == Mapping::Uv,
        Texture::Checker(t) => &t.placement,
        Texture::Noise(t) => &t.placement,
        Texture::Marble(t) => &t.placement,
        Texture::Gradient(t) => &t.placement,
    };
    placement.space == Space::Uv
}

/// How wide a ray is. Source: Akenine-Möller et al., *Texture Level of Detail Strategies for Real-Time
/// Ray Tracing*, Ray Tracing Gems ch. 20.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cone {
    /// Width at the ray's origin, in world units.
    pub width: f32,
    /// What is added to it for each unit of distance.
    pub spread: f32,
    /// How far the normal of the surface that it starts at turns across its width: by how much more a
    /// mirrored or refracted ray spreads depends on the way it takes.
    pub turn: f32,
}

/// Many samples share a pixel: each needs to see less of it, but not so little that few samples alias. The
/// same for any number of samples: what ends by its error, or goes on later, is the picture of so many.
const SHARE: f32 = 0.25;

impl Cone {
    /// The cone of one of a pixel's samples.
    pub fn of_pixel(scene: &Scene, ray: &Ray) -> Self {
        let (width, spread) = scene.camera.pixel_cone();
        let (width, spread) = (width * SHARE, spread * SHARE);
        // Rays of a far camera do not start at it.
        let from_camera = (ray.origin.as_dvec3() - scene.camera.pose().eye).length() as f32;
        Self { width: width + spread * from_camera, spread, turn: 0.0 }
    }

    /// The cone of a ray that leaves the surface, whose direction turns `times` as far as the normal.
    #[inline]
    #[must_use]
    pub fn turned(self, times: f32) -> Self {
        Self { spread: self.spread + times * self.turn, turn: 0.0, ..self }
    }
}

/// Where on a surface textures are asked, and how the surface lies there.
struct Site {
    point: TexturePoint,
    /// Texture space from the world, without translation.
    texture_from_world: DMat3,
    /// Change of the position in the world with u and v; zero where there are no coordinates.
    dp_du: DVec3,
    dp_dv: DVec3,
}

impl Scene {
    /// The cone of a ray at its hit, at `p`, with which its children start.
    pub fn widened(&self, cone: Cone, hit: &Hit, p: Vec3) -> Cone {
        let width = cone.width + cone.spread * hit.t;
        Cone { width, spread: cone.spread, turn: self.curvature(hit, p) * width }
    }

    /// Bends the normal of a hit by its material's maps, and returns the material as its textures make
    /// it there; none where no texture changes it. `width` is that of the ray at the hit.
    pub fn apply_maps(
        &self,
        hit: &Hit,
        width: f32,
        point: &mut SurfacePoint<'_>,
    ) -> Option<Material> {
        let look = self.look(hit);
        let maps = &self.maps[look.material as usize];
        if maps.is_empty() {
            return None;
        }
        let site = self.site(hit, look, width, point);
        if let Some((texture, strength)) = &maps.normal {
            point.normal = mapped_normal(texture.normal(&site.point), *strength, &site, point);
        }
        if let Some((texture, height)) = &maps.bump {
            point.normal =
                bumped_normal(texture.value_gradient(&site.point), *height, &site, point);
        }
        // A picture of linear values may hold negative ones.
        let color = |texture: &Option<Texture>| {
            texture.as_ref().map(|t| t.color(&site.point).map(|c| c.max(0.0)))
        };
        let at_most_one = |color: crate::color::Rgb| color.map(|c| c.min(1.0));
        match point.material {
            Material::Diffuse { .. } => {
                let reflectance = at_most_one(color(&maps.color)?);
                Some(Material::Diffuse { reflectance })
            }
            Material::Mirror { fresnel, .. } => {
                let reflectance = at_most_one(color(&maps.mirror)?);
                Some(Material::Mirror { reflectance, fresnel: *fresnel })
            }
            Material::Phong(phong) => {
                let mut phong = phong.clone();
                if let Some(diffuse) = color(&maps.color) {
                    phong.diffuse = diffuse;
                    if maps.colors_ambient {
                        phong.ambient = diffuse;
                    }
                }
                phong.specular = color(&maps.specular).unwrap_or(phong.specular);
                phong.mirror = color(&maps.mirror).unwrap_or(phong.mirror);
                Some(Material::Phong(phong))
            }
            Material::Conductor(_) | Material::Dielectric(_) => None,
        }
    }

    /// The texture coordinates of a hit; zero where the surface has none.
    pub fn texture_coordinates(&self, hit: &Hit, point: &SurfacePoint<'_>) -> Vec2 {
        self.site(hit, self.look(hit), 0.0, point).point.uv
    }

    fn site(&self, hit: &Hit, look: Look, width: f32, point: &SurfacePoint<'_>) -> Site {
        let world_from_group =
            hit.copy.map(|copy| affine_from_rows(self.world.transform(copy))).unwrap_or_default();
        let frame = &self.frames[look.frame as usize];
        let texture_from_world_affine = *frame * world_from_group.inverse();
        let texture_from_world = texture_from_world_affine.matrix3;
        let position = texture_from_world_affine.transform_point3(point.position.as_dvec3());

        let geometry = &self.world.group(hit.copy).geometries[hit.geometry as usize];
        let primitive = hit.primitive as usize;
        let (uv, dp_du, dp_dv) = match geometry {
            Geometry::Mesh(mesh) => match &mesh.uvs {
                None => (Vec2::ZERO, DVec3::ZERO, DVec3::ZERO),
                Some(uvs) => {
                    let uvs = mesh.triangles[primitive].map(|i| Vec2::from(uvs[i as usize]));
                    let corners = mesh.corners(primitive).map(Vec3::as_dvec3);
                    let (du, dv) = partials(corners, uvs);
                    let [a, b, c] = uvs;
                    let uv = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
                    let m = &world_from_group.matrix3;
                    (uv, *m * du, *m * dv)
                }
            },
            Geometry::Shapes(shapes) => {
                // A globe lies in texture space, where it may have been turned.
                let globe = |center: DVec3| {
                    let globe = Sphere { center: frame.transform_point3(center), radius: 1.0 };
                    let inverse = texture_from_world.inverse();
                    let Parameters { uv, dp_du, dp_dv } = globe.parameters(position, 0);
                    Parameters { uv, dp_du: inverse * dp_du, dp_dv: inverse * dp_dv }
                };
                let Parameters { uv, dp_du, dp_dv } = match shapes {
                    Shapes::Spheres(list) => globe(list[primitive].center),
                    Shapes::Ellipsoids(list) => {
                        let ellipsoid = &list[primitive];
                        let center = ellipsoid.shape().center;
                        globe(ellipsoid.outer_from_inner().transform_point3(center))
                    }
                    _ => with_shapes!(shapes, list => {
                        let group_from_world = world_from_group.inverse();
                        let p = group_from_world.transform_point3(point.position.as_dvec3());
                        let Parameters { uv, dp_du, dp_dv } =
                            list[primitive].parameters(p, hit.part());
                        let m = &world_from_group.matrix3;
                        Parameters { uv, dp_du: *m * dp_du, dp_dv: *m * dp_dv }
                    }),
                };
                (uv.as_vec2(), dp_du, dp_dv)
            }
        };
        let scale = texture_from_world.determinant().abs().cbrt();
        let per_uv = dp_du.cross(dp_dv).length().sqrt();
        let uv_width = if per_uv > 0.0 { f64::from(width) / per_uv } else { 0.0 };
        let normal = texture_from_world.inverse().transpose() * point.geometric_normal.as_dvec3();
        let footprint = Footprint {
            width: (f64::from(width) * scale) as f32,
            uv_width: uv_width as f32,
            normal: normal.normalize_or_zero().as_vec3(),
        };
        let point = TexturePoint { position, uv, footprint };
        Site { point, texture_from_world, dp_du, dp_dv }
    }

    /// About how much the normal turns for each unit of distance along the surface.
    fn curvature(&self, hit: &Hit, p: Vec3) -> f32 {
        let geometry = &self.world.group(hit.copy).geometries[hit.geometry as usize];
        let primitive = hit.primitive as usize;
        let in_group = match geometry {
            Geometry::Shapes(Shapes::Spheres(spheres)) => 1.0 / spheres[primitive].radius as f32,
            Geometry::Shapes(shapes) => {
                let world_from_group = hit.copy.map(|copy| self.world.transform(copy));
                let p = match world_from_group {
                    None => p.as_dvec3(),
                    Some(rows) => affine_from_rows(rows).inverse().transform_point3(p.as_dvec3()),
                };
                with_shapes!(shapes, list => list[primitive].curvature(p, hit.part())) as f32
            }
            Geometry::Mesh(mesh) => match &mesh.normals {
                None => 0.0,
                Some(normals) => {
                    let [a, b, c] = mesh.corners(primitive);
                    let [na, nb, nc] = mesh.triangles[primitive]
                        .map(|i| Vec3::from(normals[i as usize]).normalize_or_zero());
                    let turn = |m: Vec3, n: Vec3, p: Vec3, q: Vec3| {
                        let distance = (p - q).length();
                        if distance > 0.0 { (m - n).length() / distance } else { 0.0 }
                    };
                    turn(na, nb, a, b).max(turn(nb, nc, b, c)).max(turn(nc, na, c, a))
                }
            },
        };
        match hit.copy {
            None => in_group,
            Some(copy) => {
                let m = affine_from_rows(self.world.transform(copy)).matrix3;
                in_group / m.determinant().abs().cbrt() as f32
            }
        }
    }
}

/// ∂p/∂u and ∂p/∂v of a triangle; zero where its texture coordinates span no area.
fn partials([a, b, c]: [DVec3; 3], [s, t, r]: [Vec2; 3]) -> (DVec3, DVec3) {
    let (e, f) = (b - a, c - a);
    let ([u1, v1], [u2, v2]) = ((t - s).to_array(), (r - s).to_array());
    let [u1, v1, u2, v2] = [u1, v1, u2, v2].map(f64::from);
    let determinant = u1 * v2 - u2 * v1;
    if determinant == 0.0 {
        return (DVec3::ZERO, DVec3::ZERO);
    }
    ((e * v2 - f * v1) / determinant, (f * u1 - e * u2) / determinant)
}

/// The normal of tangent space `n` on the surface, on the viewer's side.
fn mapped_normal(n: Vec3, strength: f32, site: &Site, point: &SurfacePoint<'_>) -> Vec3 {
    let side = if point.is_front { 1.0 } else { -1.0 };
    let outward = point.normal * side;
    let (du, dv) = (site.dp_du.as_vec3(), site.dp_dv.as_vec3());
    let tangent = du.reject_from_normalized(outward).normalize_or_zero();
    if tangent == Vec3::ZERO {
        return point.normal;
    }
    let across = outward.cross(tangent);
    // Mirrored texture coordinates turn the other way.
    let bitangent = if dv.dot(across) < 0.0 { -across } else { across };
    let bent = tangent * (n.x * strength) + bitangent * (n.y * strength) + outward * n.z;
    bent.normalize_or(outward) * side
}

/// The normal of a surface that is raised by `height` times the texture: n − ∇h along the surface.
///
/// Source: Blinn, *Simulation of Wrinkled Surfaces*, SIGGRAPH 1978; pbrt 4ed §10.5.3.
fn bumped_normal(
    gradient: BumpGradient,
    height: f32,
    site: &Site,
    point: &SurfacePoint<'_>,
) -> Vec3 {
    let side = if point.is_front { 1.0 } else { -1.0 };
    let outward = (point.normal * side).as_dvec3();
    let slope = match gradient {
        BumpGradient::Position(g) => site.texture_from_world.transpose() * g.as_dvec3(),
        BumpGradient::Uv { du, dv } => {
            let area = site.dp_du.cross(site.dp_dv).dot(outward);
            if area == 0.0 {
                return point.normal;
            }
            let across = site.dp_dv.cross(outward) * f64::from(du);
            (across + outward.cross(site.dp_du) * f64::from(dv)) / area
        }
    };
    let along = slope.reject_from_normalized(outward) * f64::from(height);
    (outward - along).normalize_or(outward).as_vec3() * side
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partials_follow_the_texture_coordinates() {
        let place = |u: f64, v: f64| DVec3::new(2.0 * u + 0.5 * v, v, 1.0 - 3.0 * u);
        let uvs = [Vec2::new(0.1, 0.2), Vec2::new(0.7, 0.1), Vec2::new(0.3, 0.9)];
        let (du, dv) = partials(uvs.map(|t| place(t.x.into(), t.y.into())), uvs);
        assert!((du - DVec3::new(2.0, 0.0, -3.0)).length() < 1e-6);
        assert!((dv - DVec3::new(0.5, 1.0, 0.0)).length() < 1e-6);
        assert_eq!(partials([DVec3::ZERO, DVec3::X, DVec3::Y], [Vec2::ZERO; 3]).0, DVec3::ZERO);
    }
}
