//! From a hit to the point of the surface that it means: position with its error, normals, sides.

use glam::{DMat3, DVec3, Vec3};

use super::build::Scene;
use super::hollow::{FarSide, SphereId};
use crate::accel::{Geometry, Hit, Transform3x4, affine_from_rows};
use crate::geometry::{AnalyticShape, Shapes, Sphere, TriangleMesh, with_shapes};
use crate::material::Material;
use crate::math::{Ray, gamma, offset_ray_origin, unit_or_zero};
use crate::scene::desc::Epsilon;

/// A point on a surface, seen along a ray.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint<'a> {
    /// Position in the scene's space.
    pub position: Vec3,
    /// Every coordinate of the position is off by at most this, and what a ray query computes for the
    /// same surface is no further off.
    pub error: f32,
    /// Unit geometric normal on the viewer's side.
    pub geometric_normal: Vec3,
    /// Unit shading normal on the viewer's side.
    pub normal: Vec3,
    /// Whether the viewer is on the outside.
    pub is_front: bool,
    /// What the surface is made of.
    pub material: &'a Material,
    /// The scene's number of that material.
    pub material_index: u32,
    /// The sphere that it lies on, where that is no copy.
    pub(super) sphere: Option<(&'a Sphere, SphereId)>,
}

/// Position, error, outward geometric and shading normal (of unit length, or zero where there is none)
/// in one space.
#[derive(Clone, Copy)]
pub(super) struct Local {
    pub(super) position: Vec3,
    pub(super) error: f32,
    pub(super) geometric_normal: Vec3,
    pub(super) normal: Vec3,
}

/// The normals as seen from one side.
pub(super) struct Facing {
    pub(super) geometric_normal: Vec3,
    pub(super) normal: Vec3,
    pub(super) is_front: bool,
}

/// Geometric and shading normal, turned to the side that a ray into `direction` comes from.
#[inline(always)]
pub(super) fn facing(geometric_normal: Vec3, normal: Vec3, direction: Vec3) -> Facing {
    // A triangle of no area has no normal: any will do, as long as it faces the viewer.
    let outward = or_else(geometric_normal, -direction);
    let is_front = outward.dot(direction) <= 0.0;
    let side = if is_front { 1.0 } else { -1.0 };
    let normal = or_else(normal, outward);
    // An interpolated normal may point to the other side of its triangle; the geometric one decides.
    let normal = if normal.dot(outward) < 0.0 { -normal } else { normal };
    Facing { geometric_normal: outward * side, normal: normal * side, is_front }
}

impl Scene {
    /// The point that `ray` hit. It is found on the surface itself, not along the ray.
    #[inline(always)]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint<'_> {
        // The short way: no transform, and a normal that always is there.
        if let Some((sphere, id)) = self.sphere(hit) {
            let material_index = self.look(hit).material;
            let local = on_shape(sphere, ray, hit, None);
            let is_front = local.normal.dot(ray.direction) <= 0.0;
            let normal = if is_front { local.normal } else { -local.normal };
            return SurfacePoint {
                position: local.position,
                error: local.error,
                geometric_normal: normal,
                normal,
                is_front,
                material: &self.materials[material_index as usize],
                material_index,
                sphere: Some((sphere, id)),
            };
        }
        self.surface_of_any(ray, hit)
    }

    /// The sphere that was hit, where it is one and no copy.
    #[inline(always)]
    pub(super) fn sphere(&self, hit: &Hit) -> Option<(&Sphere, SphereId)> {
        let &Hit { geometry, primitive, .. } = hit;
        match &self.world.root.geometries[geometry as usize] {
            Geometry::Shapes(Shapes::Spheres(spheres)) if hit.copy.is_none() => {
                Some((&spheres[primitive as usize], SphereId { geometry, primitive }))
            }
            _ => None,
        }
    }

    /// The point of a surface of any kind, copies included.
    fn surface_of_any(&self, ray: &Ray, hit: &Hit) -> SurfacePoint<'_> {
        let geometry = &self.world.group(hit.copy).geometries[hit.geometry as usize];
        let material_index = self.look(hit).material;
        let transform = hit.copy.map(|copy| self.world.transform(copy));
        let local = match geometry {
            Geometry::Mesh(mesh) => {
                let smooth = smooth_normal(mesh, hit);
                on_triangle(mesh.corners(hit.primitive as usize), hit.u, hit.v, smooth)
            }
            Geometry::Shapes(shapes) => with_shapes!(shapes, list => {
                on_shape(&list[hit.primitive as usize], ray, hit, transform)
            }),
        };
        let placed = match transform {
            None => local,
            Some(rows) => to_world(&local, rows),
        };
        let Facing { geometric_normal, normal, is_front } =
            facing(placed.geometric_normal, placed.normal, ray.direction);
        SurfacePoint {
            position: placed.position,
            error: placed.error,
            geometric_normal,
            normal,
            is_front,
            material: &self.materials[material_index as usize],
            material_index,
            sphere: None,
        }
    }

    /// Where rays that leave `point` on the viewer's side start: from where a light is asked whose points
    /// differ in distance.
    #[inline]
    pub fn departure(&self, point: &SurfacePoint<'_>) -> Vec3 {
        self.spawn(point, point.geometric_normal, 0.0).origin
    }

    /// The ray that leaves `point` into `direction` (unit length), as far as `distance`.
    #[inline]
    pub fn spawn(&self, point: &SurfacePoint<'_>, direction: Vec3, distance: f32) -> Ray {
        let (p, n) = (point.position, point.geometric_normal);
        spawn(self.settings.epsilon, p, point.error, n, direction, distance)
    }

    /// The ray that leaves `point` into `direction` (unit length) for whatever comes. Within a sphere it will
    /// come to its far side, so that nothing beyond needs to be looked at: what it hits is the same. Where
    /// nothing can be in between either, it is known that it hits that side.
    #[inline(always)]
    pub fn spawn_on(&self, point: &SurfacePoint<'_>, direction: Vec3) -> (Ray, Option<FarSide>) {
        let mut ray = self.spawn(point, direction, f32::INFINITY);
        if let Some((sphere, id)) = point.sphere
            && (direction.dot(point.geometric_normal) < 0.0) == point.is_front
        {
            let (t, is_within) = sphere.far_side(ray.origin.as_dvec3(), direction.as_dvec3());
            let t = if is_within && t > f64::from(ray.t_min) { Some(t) } else { far(sphere, &ray) };
            if let Some(t) = t {
                ray.t_max = as_far_as(t);
                return (ray, self.hollows.holds(id).then_some(FarSide(id)));
            }
        }
        (ray, None)
    }
}

/// Where a ray comes out of a sphere that may not start within it, for all that rounding tells.
#[cold]
fn far(sphere: &Sphere, ray: &Ray) -> Option<f64> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    sphere.intersect(o, d, ray.t_min.into(), f64::INFINITY).map(|hit| hit.t)
}

/// The end of a ray that is to hit something at `t` there.
#[inline(always)]
pub(super) fn as_far_as(t: f64) -> f32 {
    (t as f32).next_up()
}

/// The ray that leaves the point `p` of a surface with the geometric normal `n`: see [`Scene::spawn`].
#[inline(always)]
pub(super) fn spawn(
    epsilon: Epsilon,
    p: Vec3,
    error: f32,
    n: Vec3,
    direction: Vec3,
    distance: f32,
) -> Ray {
    // Short of the target by a few times the error of a hit's distance, so that a light on a surface is
    // not hidden by it.
    let t_max = distance * (1.0 - 16.0 * f32::EPSILON);
    let (origin, t_min) = match epsilon {
        Epsilon::Auto => (offset_ray_origin(p, error, n, direction), 0.0),
        Epsilon::Fixed(epsilon) => (p, epsilon),
    };
    Ray { origin, direction, t_min, t_max }
}

/// A unit normal, or another where it is zero.
#[inline(always)]
fn or_else(normal: Vec3, other: Vec3) -> Vec3 {
    if normal == Vec3::ZERO { other } else { normal }
}

/// The interpolated normal of a hit on a mesh, not of unit length; none where the mesh has no normals.
#[inline]
pub(super) fn smooth_normal(mesh: &TriangleMesh, hit: &Hit) -> Option<Vec3> {
    let normals = mesh.normals.as_ref()?;
    let [i, j, k] = mesh.triangles[hit.primitive as usize].map(|i| Vec3::from(normals[i as usize]));
    Some(i * (1.0 - hit.u - hit.v) + j * hit.u + k * hit.v)
}

/// The point with barycentric weights (1 − u − v, u, v).
///
/// The bound on its position is γ(7)·Σ|bᵢ pᵢ| (pbrt 4ed §6.8.4). Added is what a query may see: it
/// subtracts the ray's origin from each corner, so its plane is off by a few roundings of the distance
/// to the farthest corner.
#[inline(always)]
pub(super) fn on_triangle([a, b, c]: [Vec3; 3], u: f32, v: f32, smooth: Option<Vec3>) -> Local {
    let w = 1.0 - u - v;
    let (pa, pb, pc) = (a * w, b * u, c * v);
    let position = pa + pb + pc;
    let sum = (pa.abs() + pb.abs() + pc.abs()).max_element();
    let reach = (a - position).abs().max((b - position).abs()).max((c - position).abs());
    // In f64: the square of an f32 cross product overflows from edges of 4·10⁹ on, and vanishes below
    // 2·10⁻¹¹.
    let (da, db, dc) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    let geometric_normal = unit_or_zero((db - da).cross(dc - da)).as_vec3();
    Local {
        position,
        error: gamma(7) * sum + gamma(8) * reach.max_element(),
        geometric_normal,
        normal: smooth.map_or(geometric_normal, Vec3::normalize_or_zero),
    }
}

/// The point of a shape near to where the ray says it hit, in f64, rounded once.
#[inline]
fn on_shape(
    shape: &impl AnalyticShape,
    ray: &Ray,
    hit: &Hit,
    transform: Option<&Transform3x4>,
) -> Local {
    let point = shape.surface_at(point_along(ray, hit.t, transform), hit.part());
    let normal = shape.shading_normal(point.position, hit.part()).unwrap_or(point.normal);
    rounded(point.position, point.normal, normal)
}

/// A point that was found in f64.
#[inline(always)]
fn rounded(position: DVec3, geometric_normal: DVec3, normal: DVec3) -> Local {
    let position = position.as_vec3();
    Local {
        position,
        error: gamma(2) * position.abs().max_element(),
        geometric_normal: geometric_normal.as_vec3(),
        normal: normal.as_vec3(),
    }
}

/// As [`on_shape`], of a sphere, without branches; and whether the ray came close enough to it for that.
#[inline(always)]
pub(super) fn on_sphere(sphere: &Sphere, ray: &Ray, t: f32) -> (Local, bool) {
    let (normal, is_close) = sphere.normal_close_to(point_along(ray, t, None));
    (rounded(sphere.center + normal * sphere.radius, normal, normal), is_close)
}

/// The point at distance `t` of a ray, in the space of its copy, in f64.
#[inline]
fn point_along(ray: &Ray, t: f32, transform: Option<&Transform3x4>) -> DVec3 {
    let (mut o, mut d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    if let Some(rows) = transform {
        let object_from_world = affine_from_rows(rows).inverse();
        o = object_from_world.transform_point3(o);
        d = object_from_world.transform_vector3(d);
    }
    o + d * f64::from(t)
}

/// From a copy's space to the world's.
///
/// The bound follows pbrt 4ed §6.8.5. Added is what a query may see: it takes the ray to the copy's
/// space by an inverse that is itself rounded, which shows in the world as |M|·|M⁻¹| times the
/// coordinates: little for a rotation, much for a squeeze.
pub(super) fn to_world(local: &Local, rows: &Transform3x4) -> Local {
    let row =
        |i: usize| (Vec3::new(rows[4 * i], rows[4 * i + 1], rows[4 * i + 2]), rows[4 * i + 3]);
    let m = [row(0), row(1), row(2)];
    let p = local.position;
    let position = Vec3::from(m.map(|(r, t)| r.dot(p) + t));
    let magnitude = Vec3::from(m.map(|(r, t)| r.abs().dot(p.abs()) + t.abs()));
    let stretch = Vec3::from(m.map(|(r, _)| r.abs().element_sum()));

    let affine = affine_from_rows(rows);
    let (x, y, z) = (affine.matrix3.x_axis, affine.matrix3.y_axis, affine.matrix3.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let determinant = x.dot(y.cross(z));
    let (forward, inverse) =
        (affine.matrix3.abs(), cofactors.transpose().abs() * (1.0 / determinant.abs()));
    let seen = forward * (inverse * (magnitude + position.abs()).as_dvec3());

    let error =
        stretch * local.error * (1.0 + gamma(3)) + magnitude * gamma(4) + seen.as_vec3() * gamma(8);
    // The inverse transpose up to a positive factor: cofactors, with their sign turned where the
    // transform mirrors, so that outward stays outward.
    let normal_matrix = cofactors * determinant.signum();
    let to_world = |n: Vec3| (normal_matrix * n.as_dvec3()).normalize_or_zero().as_vec3();
    Local {
        position,
        error: error.max_element(),
        geometric_normal: to_world(local.geometric_normal),
        normal: to_world(local.normal),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::rows_from_affine;
    use crate::geometry::Sphere;
    use glam::{DAffine3, DQuat};

    /// Numbers in [−1, 1).
    fn numbers(seed: u32) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            f64::from(state >> 8) / f64::from(1 << 23) - 1.0
        }
    }

    /// Positions are no further off than is stated, nor is much more stated than there may be.
    fn assert_bounded(what: &str, cases: impl Iterator<Item = (DVec3, Local)>, at_most: f64) {
        let mut worst = 0f64;
        for (truth, local) in cases {
            let off = (local.position.as_dvec3() - truth).abs().max_element();
            worst = worst.max(off / f64::from(local.error));
        }
        assert!(worst <= 1.0, "{what}: {worst} of the bound");
        assert!(worst >= 1.0 / at_most, "{what}: {worst} of the bound: it is needlessly wide");
    }

    /// A ray within a sphere is bounded by its far side, and hits what an endless one does, to the last bit:
    /// that far side, or what stands in between.
    #[test]
    fn bounds_within_spheres_hide_nothing() {
        use crate::accel::AccelKind;
        use crate::scene::{ObjectDesc, SceneDesc, ShapeDesc};

        let sphere = |center, radius| ObjectDesc::new(ShapeDesc::Sphere { center, radius }, None);
        for &kind in AccelKind::ALL {
            let mut desc = SceneDesc::default();
            desc.objects.push(sphere(DVec3::ZERO, 1.0));
            desc.objects.push(sphere(DVec3::new(0.4, 0.0, 0.0), 0.3));
            // Overlaps the first.
            desc.objects.push(sphere(DVec3::new(0.0, 1.0, 0.0), 0.2));
            let scene = Scene::build_quietly(desc, kind).unwrap();
            let mut next = numbers(3);
            let mut unit = || DVec3::new(next(), next(), next()).normalize_or(DVec3::X).as_vec3();
            let (mut bounded, mut short) = (0, 0);
            for i in 0..4000 {
                let towards = Ray::new(unit() * 3.0, Vec3::ZERO);
                let ray =
                    Ray { direction: (unit() * 0.99 - towards.origin).normalize(), ..towards };
                let query = scene.accel.query();
                let Some(hit) = query.intersect(&ray) else { continue };
                let point = scene.surface(&ray, &hit);
                let n = point.geometric_normal;
                // Inward, every third time nearly along the surface; or outward.
                let w = match i % 3 {
                    0 => (unit() - n).normalize_or(-n),
                    1 => (unit().cross(n).normalize_or(-n) - n * 1e-4).normalize(),
                    _ => (unit() + n * 1.1).normalize(),
                };
                let (on, _) = scene.spawn_on(&point, w);
                let endless = scene.spawn(&point, w, f32::INFINITY);
                assert_eq!((on.origin, on.t_min), (endless.origin, endless.t_min));
                assert_eq!(query.intersect(&on), query.intersect(&endless), "{kind:?}: {on:?}");
                bounded += usize::from(on.t_max < 3.0);
                short +=
                    usize::from(query.intersect(&on).is_some_and(|hit| hit.t < 0.9 * on.t_max));
            }
            assert!(bounded > 1000 && short > 100, "{kind:?}: {bounded}, {short}");
        }
    }

    #[test]
    fn positions_lie_within_their_bounds() {
        for offset in [0.0, 1.0, 1e4] {
            let mut next = numbers(1);
            let mut corner = || DVec3::new(next() + offset, next() - offset, next()).as_vec3();
            let corners: Vec<[Vec3; 3]> =
                (0..50_000).map(|_| [corner(), corner(), corner()]).collect();
            let mut next = numbers(2);
            let cases = corners.into_iter().map(|[a, b, c]| {
                let (u, v) = (0.5 + 0.5 * next(), 0.5 + 0.5 * next());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let (u, v) = (u as f32, v as f32);
                let w = 1.0 - f64::from(u) - f64::from(v);
                let weights = [w, f64::from(u), f64::from(v)];
                let parts = [a, b, c].into_iter().zip(weights).map(|(p, w)| p.as_dvec3() * w);
                (parts.sum(), on_triangle([a, b, c], u, v, None))
            });
            assert_bounded("triangle", cases, 6.5);
        }
    }

    /// Along the normal: where on the sphere a hit is meant to be is not known.
    #[test]
    fn shapes_lie_within_their_bounds() {
        let mut next = numbers(3);
        let mut worst = 0f64;
        for _ in 0..50_000 {
            let center = DVec3::new(1000.0 * next(), 1000.0 * next(), 1000.0 * next());
            let sphere = Sphere { center, radius: 1.0 };
            let direction = DVec3::new(next(), next(), next()).normalize();
            let ray = Ray::new((center - direction * 3.0).as_vec3(), direction.as_vec3());
            let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let found = sphere.intersect(o, d, 0.0, f64::INFINITY).unwrap();
            let hit =
                Hit { t: found.t as f32, u: 0.0, v: 0.0, primitive: 0, geometry: 0, copy: None };
            let local = on_shape(&sphere, &ray, &hit, None);
            let out = local.position.as_dvec3() - center;
            let reach = f64::from(local.error) * out.normalize().abs().element_sum();
            worst = worst.max((out.length() - 1.0).abs() / reach);
        }
        assert!((0.3..=1.0).contains(&worst), "{worst} of the bound");
    }

    /// What a query sees of a copy, which takes the ray to the copy's space by an inverse that is rounded to
    /// f32: the point itself, taken there and back.
    #[test]
    fn copies_lie_within_their_bounds() {
        let mut next = numbers(4);
        let mut cases = Vec::new();
        for _ in 0..20_000 {
            let turn = |next: &mut dyn FnMut() -> f64| {
                DMat3::from_quat(DQuat::from_xyzw(next(), next(), next(), next()).normalize())
            };
            let squeeze =
                DMat3::from_diagonal(DVec3::new(1.0, 10f64.powf(2.0 * next() - 2.0), 2.0));
            let linear = turn(&mut next) * squeeze * turn(&mut next);
            let translation = DVec3::new(next(), next(), next()) * 10.0;
            let rows = rows_from_affine(&DAffine3::from_mat3_translation(linear, translation));
            let p = DVec3::new(next(), next(), next()).as_vec3();
            let local =
                Local { position: p, error: 0.0, geometric_normal: Vec3::Y, normal: Vec3::Y };
            let placed = to_world(&local, &rows);
            let exact = affine_from_rows(&rows);
            let rounded = affine_from_rows(&rows_from_affine(&exact.inverse()));
            // Back by the true way: by how much the rounded inverse errs, as the world sees it.
            let there = rounded.transform_point3(placed.position.as_dvec3());
            let seen = exact.transform_point3(there);
            cases.push((seen, placed));
        }
        assert_bounded("copy", cases.into_iter(), 40.0);
    }
}
