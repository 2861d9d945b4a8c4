//! Every ray against every primitive, in f64: slow, plain, and what the others are compared with.

use glam::{DAffine3, DVec3};

use super::primitive::{Found, Line, hit_shape, hit_triangle};
use super::world::{CopyRef, Geometry, Group, World, affine_from_rows};
use super::{AccelInfo, Hit, RayQuery};
use crate::geometry::{AnalyticShape, with_shapes};
use crate::math::{Bounds, Ray};

/// The oracle: no hierarchy; boxes around whole geometries only.
#[derive(Debug)]
pub struct BruteForce {
    root: Vec<Part>,
    prototypes: Vec<Vec<Part>>,
    copies: Vec<Copy>,
}

/// One geometry and its box, a little enlarged.
#[derive(Debug)]
struct Part {
    geometry: Geometry,
    is_clear: bool,
    bounds: Bounds,
}

/// One copy of a prototype.
#[derive(Debug)]
struct Copy {
    id: CopyRef,
    prototype: usize,
    object_from_world: DAffine3,
}

impl BruteForce {
    /// Takes references to the geometry of `world`; nothing is built.
    pub fn new(world: &World) -> Self {
        let parts = |group: &Group| {
            let geometries = group.geometries.iter().enumerate();
            geometries.map(|(i, geometry)| Part::new(geometry, group.is_clear(i))).collect()
        };
        let copies = (0u32..).zip(&world.sets).flat_map(|(set, s)| {
            (0u32..).zip(s.transforms.iter()).map(move |(index, rows)| Copy {
                id: CopyRef { set, index },
                prototype: s.prototype as usize,
                object_from_world: affine_from_rows(rows).inverse(),
            })
        });
        Self {
            root: parts(&world.root),
            prototypes: world.prototypes.iter().map(parts).collect(),
            copies: copies.collect(),
        }
    }

    /// Name and sizes, for reports.
    pub fn info(&self) -> AccelInfo {
        let bytes = self.copies.len() * size_of::<Copy>();
        AccelInfo { name: "brute force".into(), isa: "f64", packet_width: 1, bytes: bytes as u64 }
    }

    /// Calls `found` with every hit in turn, but on parts that the ray passes; it returns how far to go
    /// on looking.
    fn visit(
        &self,
        ray: &Ray,
        passes: impl Fn(&Part) -> bool,
        mut found: impl FnMut(Found, [u32; 2], Option<CopyRef>) -> f64,
    ) {
        let mut t_max = f64::from(ray.t_max);
        let mut visit = |parts: &[Part], line: &Line, copy: Option<CopyRef>| {
            for (geometry, part) in (0u32..).zip(parts).filter(|(_, part)| !passes(part)) {
                part.visit(line, &mut t_max, |hit, primitive| {
                    found(hit, [geometry, primitive], copy)
                });
            }
        };
        let line = Line::new(ray);
        visit(&self.root, &line, None);
        for copy in &self.copies {
            let line = line.transformed(&copy.object_from_world);
            visit(&self.prototypes[copy.prototype], &line, Some(copy.id));
        }
    }
}

impl BruteForce {
    /// Whether the ray hits anything but parts that it passes.
    fn hits_any(&self, ray: &Ray, passes: impl Fn(&Part) -> bool) -> bool {
        let mut any = false;
        self.visit(ray, passes, |_, _, _| {
            any = true;
            // Nothing is nearer than nothing: every further test fails at once.
            f64::NEG_INFINITY
        });
        any
    }
}

impl Part {
    fn new(geometry: &Geometry, is_clear: bool) -> Self {
        let b = geometry.bounds();
        let pad = DVec3::splat(
            1e-9 * (b.size().max_element() + b.min.abs().max(b.max.abs()).max_element()),
        );
        let bounds = Bounds { min: b.min - pad, max: b.max + pad };
        Self { geometry: geometry.clone(), is_clear, bounds }
    }

    fn visit(&self, ray: &Line, t_max: &mut f64, mut found: impl FnMut(Found, u32) -> f64) {
        if self.bounds.clip(ray.origin, ray.direction).is_none() {
            return;
        }
        match &self.geometry {
            Geometry::Mesh(mesh) => {
                for i in 0..mesh.triangles.len() {
                    if let Some(hit) = hit_triangle(mesh, i, ray, *t_max) {
                        *t_max = found(hit, i as u32);
                    }
                }
            }
            Geometry::Shapes(shapes) => {
                with_shapes!(shapes, list => visit_each(list, ray, t_max, found));
            }
        }
    }
}

fn visit_each<S: AnalyticShape>(
    shapes: &[S],
    ray: &Line,
    t_max: &mut f64,
    mut found: impl FnMut(Found, u32) -> f64,
) {
    for (i, shape) in (0u32..).zip(shapes) {
        if let Some(hit) = hit_shape(shape, ray, *t_max) {
            *t_max = found(hit, i);
        }
    }
}

impl RayQuery for BruteForce {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut closest = None;
        self.visit(
            ray,
            |_| false,
            |hit, [geometry, primitive], copy| {
                closest = Some(hit.named(geometry, primitive, copy));
                hit.t
            },
        );
        closest
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.hits_any(ray, |_| false)
    }

    fn occluded_by_opaque(&self, ray: &Ray) -> bool {
        self.hits_any(ray, |part| part.is_clear)
    }
}
