//! Spheres of glass that nothing else reaches into: what a ray within one comes to is its far side, and no
//! query is needed to know it.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::accel::{Geometry, Hit, World, affine_from_rows};
use crate::geometry::{AnalyticShape, Shapes, Sphere, distance_to_triangle, with_shapes};
use crate::math::{Bounds, Ray};

/// Cells of the grid along an axis, at most.
const MOST_CELLS: usize = 64;

/// What is nearer to the centre than this much of the radius reaches in. What touches does not, as far as f64
/// tells.
const REACH: f64 = 1.0 - 1e-9;

/// Which spheres of the world's root are hollow. Empty where none was looked for.
#[derive(Debug, Clone, Default)]
pub struct Hollows {
    /// By geometry and primitive.
    lists: Vec<Vec<bool>>,
}

/// The number of a sphere that is no copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SphereId {
    pub(super) geometry: u32,
    pub(super) primitive: u32,
}

/// A sphere that a ray is known to come to at its `t_max`, just after the hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FarSide(pub(super) SphereId);

impl FarSide {
    /// The hit, as a query would find it.
    #[inline(always)]
    pub fn hit(self, ray: &Ray) -> Hit {
        let SphereId { geometry, primitive } = self.0;
        Hit { t: ray.t_max.next_down(), u: 0.0, v: 0.0, primitive, geometry, copy: None }
    }
}

impl Hollows {
    /// Looks at all spheres of the root that `is_wanted`, and at all that may reach into them.
    pub(super) fn of(world: &World, is_wanted: impl Fn(SphereId) -> bool) -> Self {
        let mut ids = Vec::new();
        let mut spheres = Vec::new();
        for (geometry, list) in (0u32..).zip(&world.root.geometries) {
            let Geometry::Shapes(Shapes::Spheres(list)) = list else { continue };
            for (primitive, sphere) in (0u32..).zip(list.iter()) {
                let id = SphereId { geometry, primitive };
                if is_wanted(id) {
                    ids.push(id);
                    spheres.push(*sphere);
                }
            }
        }
        if spheres.is_empty() {
            return Self::default();
        }
        let grid = Grid::new(&spheres);
        world.root.geometries.iter().for_each(|geometry| grid.add_geometry(geometry));
        let prototypes: Vec<Bounds> = world.prototypes.iter().map(|group| group.bounds()).collect();
        for set in &world.sets {
            let bounds = &prototypes[set.prototype as usize];
            if !bounds.is_empty() {
                let copies = set.transforms.par_iter();
                copies.for_each(|rows| grid.add_box(&bounds.transformed(&affine_from_rows(rows))));
            }
        }
        let mut lists = vec![Vec::new(); world.root.geometries.len()];
        for (id, is_reached) in ids.into_iter().zip(grid.reached) {
            let list = &mut lists[id.geometry as usize];
            list.resize(world.root.geometries[id.geometry as usize].len(), false);
            list[id.primitive as usize] = !is_reached.into_inner();
        }
        Self { lists }
    }

    /// Whether nothing reaches into a sphere.
    #[inline(always)]
    pub(super) fn holds(&self, id: SphereId) -> bool {
        let list = self.lists.get(id.geometry as usize);
        list.and_then(|list| list.get(id.primitive as usize)).is_some_and(|is_hollow| *is_hollow)
    }

    /// How many are hollow.
    pub fn len(&self) -> usize {
        self.lists.iter().flatten().filter(|is_hollow| **is_hollow).count()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Spheres by where they are, and whether anything is known to reach into each.
struct Grid<'a> {
    spheres: &'a [Sphere],
    reached: Vec<AtomicBool>,
    bounds: Bounds,
    /// Cells by metre, and how many there are, along each axis.
    scale: DVec3,
    size: [usize; 3],
    /// The spheres whose boxes overlap each cell.
    cells: Vec<Vec<u32>>,
}

impl<'a> Grid<'a> {
    fn new(spheres: &'a [Sphere]) -> Self {
        let bounds = spheres.iter().map(Sphere::bounds).fold(Bounds::EMPTY, Bounds::union);
        let along = ((2 * spheres.len()) as f64).cbrt().ceil() as usize;
        let size = [along.min(MOST_CELLS); 3];
        let scale = DVec3::splat(size[0] as f64) / bounds.size();
        let reached = spheres.iter().map(|_| AtomicBool::new(false)).collect();
        let cells = vec![Vec::new(); size.iter().product()];
        let mut grid = Self { spheres, reached, bounds, scale, size, cells };
        for (i, sphere) in (0u32..).zip(spheres) {
            let [from, to] = grid.range(&sphere.bounds());
            for cell in cells_between(from, to, size) {
                grid.cells[cell].push(i);
            }
        }
        grid
    }

    /// The first and the last cell that a box overlaps, along each axis.
    fn range(&self, bounds: &Bounds) -> [[usize; 3]; 2] {
        [bounds.min, bounds.max].map(|p| {
            let at = ((p - self.bounds.min) * self.scale).to_array();
            std::array::from_fn(|axis| (at[axis].max(0.0) as usize).min(self.size[axis] - 1))
        })
    }

    /// Marks the spheres near a box that `reaches` says something reaches into.
    fn mark(&self, bounds: &Bounds, reaches: impl Fn(&Sphere) -> bool) {
        let near =
            self.bounds.min.cmple(bounds.max).all() & bounds.min.cmple(self.bounds.max).all();
        if !near {
            return;
        }
        let look = |i: usize| {
            let sphere = &self.spheres[i];
            let is_known = self.reached[i].load(Ordering::Relaxed);
            if !is_known
                && distance_to_box(sphere.center, bounds) < REACH * sphere.radius
                && reaches(sphere)
            {
                self.reached[i].store(true, Ordering::Relaxed);
            }
        };
        let [from, to] = self.range(bounds);
        let count: usize = (0..3).map(|axis| to[axis] - from[axis] + 1).product();
        if count >= self.spheres.len() {
            (0..self.spheres.len()).for_each(look);
        } else {
            let cells = cells_between(from, to, self.size);
            cells.for_each(|cell| self.cells[cell].iter().for_each(|&i| look(i as usize)));
        }
    }

    /// What is known of something is a box around it.
    fn add_box(&self, bounds: &Bounds) {
        self.mark(bounds, |_| true);
    }

    fn add_geometry(&self, geometry: &Geometry) {
        match geometry {
            Geometry::Mesh(mesh) => {
                (0..mesh.triangles.len()).into_par_iter().with_min_len(1 << 12).for_each(|i| {
                    let corners = mesh.corners(i).map(|p| p.as_dvec3());
                    self.mark(&Bounds::of(corners), |sphere| {
                        distance_to_triangle(sphere.center, &corners) < REACH * sphere.radius
                    });
                })
            }
            Geometry::Shapes(Shapes::Spheres(others)) => others.par_iter().for_each(|other| {
                self.mark(&other.bounds(), |sphere| {
                    let apart = sphere.center.distance(other.center);
                    // Neither beside it nor around it; and it does not reach into itself.
                    sphere != other
                        && apart < other.radius + REACH * sphere.radius
                        && apart + REACH * sphere.radius > other.radius
                });
            }),
            Geometry::Shapes(Shapes::Planes(planes)) => planes.iter().for_each(|plane| {
                self.mark(&plane.bounds(), |sphere| {
                    (sphere.center - plane.point).dot(plane.normal).abs() < REACH * sphere.radius
                });
            }),
            Geometry::Shapes(shapes) => with_shapes!(shapes, list => {
                list.iter().for_each(|shape| self.add_box(&shape.bounds()));
            }),
        }
    }
}

fn cells_between(
    from: [usize; 3],
    to: [usize; 3],
    size: [usize; 3],
) -> impl Iterator<Item = usize> {
    let along = move |axis: usize| from[axis]..=to[axis];
    along(0).flat_map(move |x| {
        along(1).flat_map(move |y| along(2).map(move |z| (x * size[1] + y) * size[2] + z))
    })
}

/// 0 within the box.
fn distance_to_box(p: DVec3, bounds: &Bounds) -> f64 {
    (bounds.min - p).max(p - bounds.max).max(DVec3::ZERO).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::AccelKind;
    use crate::geometry::TriangleMesh;
    use crate::material::{Dielectric, FresnelModel, Ior, Material};
    use crate::scene::{
        Location, MaterialDesc, ObjectDesc, PrototypeDesc, Reference, Scene, SceneDesc, ShapeDesc,
    };
    use glam::{DAffine3, Vec3};

    /// Numbers in [-1, 1).
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    fn glass() -> MaterialDesc {
        let glass = Dielectric {
            ior: Ior::Constant(1.5),
            absorption: crate::color::Rgb::BLACK,
            priority: 0,
            fresnel: FresnelModel::Exact,
        };
        MaterialDesc::new("glass".to_owned(), Material::Dielectric(glass))
    }

    fn ball(center: DVec3, radius: f64) -> ObjectDesc {
        ObjectDesc::new(ShapeDesc::Sphere { center, radius }, Some("glass"))
    }

    /// What a ray within a hollow sphere is said to come to is what every query of a ray without end finds;
    /// and the spheres that rays find something else in are not hollow.
    #[test]
    fn what_is_known_is_what_a_query_finds() {
        let (mut hollow, mut reached) = (0, 0);
        for seed in 1..=6 {
            let mut next = numbers(seed);
            let mut desc = SceneDesc { materials: vec![glass()], ..SceneDesc::default() };
            let mut point = || DVec3::new(next(), next(), next());
            for i in 0..60 {
                let radius = if i % 20 == 0 { 0.3 } else { 0.08 };
                desc.objects.push(ball(point(), radius));
            }
            let corners = (0..3 * 40).flat_map(|i| {
                // Small ones, and some that are as large as the scene.
                let p = if i % 12 < 9 { DVec3::splat(0.4) + point() * 0.1 } else { point() };
                p.as_vec3().to_array()
            });
            let mesh = TriangleMesh::new(
                corners.collect(),
                (0..40).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            );
            desc.meshes.push(mesh);
            desc.objects.push(ObjectDesc::new(ShapeDesc::Mesh(0), None));
            let low = ShapeDesc::Plane { point: DVec3::new(0.0, -0.8, 0.0), normal: DVec3::Y };
            desc.objects.push(ObjectDesc::new(low, None));
            let small = ShapeDesc::Sphere { center: DVec3::ZERO, radius: 0.05 };
            desc.prototypes.push(PrototypeDesc {
                at: Location::default(),
                name: "copy".to_owned(),
                objects: vec![ObjectDesc::new(small, None)],
            });
            let transforms: Vec<_> = (0..5).map(|_| DAffine3::from_translation(point())).collect();
            let copies = ShapeDesc::Instances { prototype: Reference::new("copy"), transforms };
            desc.objects.push(ObjectDesc::new(copies, None));
            for &kind in AccelKind::ALL {
                let scene = Scene::build_quietly(desc.clone(), kind).unwrap();
                let mut next = numbers(100 + seed);
                let mut unit =
                    || DVec3::new(next(), next(), next()).normalize_or(DVec3::X).as_vec3();
                let query = scene.accel.query();
                let mut was_reached = std::collections::HashSet::new();
                for _ in 0..20_000 {
                    let from = Ray::new(unit() * 3.0, Vec3::ZERO);
                    let ray = Ray { direction: (unit() - from.origin).normalize(), ..from };
                    let Some(hit) = query.intersect(&ray) else { continue };
                    let point = scene.surface(&ray, &hit);
                    let Some((_, id)) = point.sphere.filter(|_| point.is_front) else { continue };
                    let inward = (unit() * 0.99 - point.geometric_normal).normalize();
                    let (bounded, side) = scene.spawn_on(&point, inward);
                    let endless = Ray { t_max: f32::INFINITY, ..bounded };
                    let found = query.intersect(&endless);
                    if let Some(side) = side {
                        assert_eq!(Some(side.hit(&bounded)), found, "{kind:?} {id:?}");
                        hollow += 1;
                    } else if found.is_some_and(|hit| {
                        (hit.geometry, hit.primitive) != (id.geometry, id.primitive)
                    }) {
                        was_reached.insert((id.geometry, id.primitive));
                    }
                }
                reached += was_reached.len();
                assert!(was_reached.iter().all(|&(geometry, primitive)| {
                    !scene.hollows.holds(SphereId { geometry, primitive })
                }));
            }
        }
        assert!(hollow > 10_000 && reached > 50, "{hollow} {reached}");
    }

    /// What touches does not reach in, what is around does not either; what is within does.
    #[test]
    fn what_touches_does_not_reach_in() {
        let count = |objects: Vec<ObjectDesc>| {
            let desc = SceneDesc { materials: vec![glass()], objects, ..SceneDesc::default() };
            Scene::build_quietly(desc, AccelKind::default()).unwrap().hollows.len()
        };
        let floor = |height: f64| {
            let shape = ShapeDesc::Plane { point: DVec3::new(0.0, height, 0.0), normal: DVec3::Y };
            ObjectDesc::new(shape, None)
        };
        let unit = || ball(DVec3::ZERO, 1.0);
        assert_eq!(count(vec![unit(), floor(-1.0)]), 1);
        assert_eq!(count(vec![unit(), floor(-0.999_999)]), 0);
        assert_eq!(count(vec![unit(), ball(DVec3::new(3.0, 0.0, 0.0), 2.0)]), 2);
        assert_eq!(count(vec![unit(), ball(DVec3::new(2.999, 0.0, 0.0), 2.0)]), 0);
        assert_eq!(count(vec![unit(), ball(DVec3::new(0.2, 0.0, 0.0), 0.5)]), 1);
        let boxed = |min: f64| {
            let shape = ShapeDesc::Box(Bounds { min: DVec3::splat(min), max: DVec3::splat(2.0) });
            ObjectDesc::new(shape, None)
        };
        assert_eq!(count(vec![unit(), boxed(0.58)]), 1);
        assert_eq!(count(vec![unit(), boxed(0.57)]), 0);
        let matt = ObjectDesc::new(ShapeDesc::Sphere { center: DVec3::ZERO, radius: 1.0 }, None);
        assert_eq!(count(vec![matt]), 0);
    }
}
