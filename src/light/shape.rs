//! Shapes that emit.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::LightSample;
use super::aim::{aim, lift, scaled};
use super::bounds::{Cone, LightBounds, strength};
use crate::color::Rgb;
use crate::geometry::{AnalyticShape, SampledPoint, Shapes, cofactors, with_shapes};
use crate::math::Bounds;

/// An analytic shape of constant radiance, on both sides.
///
/// Each of its parts is the image of a unit square, which is cut into cells: a cell is drawn by its area,
/// and a place within it uniformly. What the area of the image is there, is then known exactly, so the cells
/// need only be about right.
#[derive(Debug, Clone)]
pub struct ShapeLight {
    /// A list of which it is one, and which.
    shapes: Shapes,
    index: usize,
    /// World from the list's space.
    place: DAffine3,
    cofactors: DMat3,
    /// Area of the cells up to and including each: part after part, row after row.
    areas: Arc<[f64]>,
    bounds: Bounds,
    radiance: Rgb,
}

/// What a cell that is hardly there counts for, in means of those that are.
const LITTLE: f64 = 0.2;

/// Cells of a part along each side of its square.
const CELLS: usize = 16;

impl PartialEq for ShapeLight {
    /// Whether they shine alike from the same places.
    fn eq(&self, other: &Self) -> bool {
        self.areas == other.areas && self.bounds == other.bounds && self.radiance == other.radiance
    }
}

impl ShapeLight {
    /// A light of the shape `index` of a list, placed by `place` relative to the scene's centre, of radiance
    /// `radiance` (W·m⁻²·sr⁻¹) to both sides. None where points cannot be drawn on it.
    pub fn new(shapes: &Shapes, index: usize, place: DAffine3, radiance: Rgb) -> Option<Self> {
        let (parts, bounds) = with_shapes!(shapes, list => {
            (list[index].sampled_parts(), list[index].bounds().transformed(&place))
        });
        let empty = Arc::from([]);
        let shapes = shapes.clone();
        let cofactors = cofactors(&place.matrix3);
        let mut light = Self { shapes, index, place, cofactors, areas: empty, bounds, radiance };
        let count = usize::from(parts) * CELLS * CELLS;
        let area = |cell| light.at(cell, DVec2::splat(0.5)).map(|p| p.area.length());
        let areas: Vec<Option<f64>> = (0..count).map(area).collect();
        // Some of a cell may be there even if its middle is not.
        let known = areas.iter().flatten();
        let little = LITTLE * known.clone().sum::<f64>() / known.count().max(1) as f64;
        let sums = areas.iter().scan(0.0, |sum, area| {
            *sum += area.unwrap_or(little) / (CELLS * CELLS) as f64;
            Some(*sum)
        });
        light.areas = sums.collect();
        (parts > 0 && light.area().is_finite()).then_some(light)
    }

    /// The point that a place in a cell stands for.
    #[inline]
    fn at(&self, cell: usize, within: DVec2) -> Option<SampledPoint> {
        let (part, cell) = (cell / (CELLS * CELLS), cell % (CELLS * CELLS));
        let corner = DVec2::new((cell % CELLS) as f64, (cell / CELLS) as f64);
        let place = (corner + within) / CELLS as f64;
        let point = with_shapes!(&self.shapes, list => {
            list[self.index].sample_at(part as u8, place)
        })?;
        Some(point.transformed(&self.place, &self.cofactors))
    }

    /// Area of one side, m², as the cells have it.
    pub fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// Radiance, W·m⁻²·sr⁻¹.
    pub fn radiance(&self) -> Rgb {
        self.radiance
    }

    /// The cell is found by `u[0]`, whose place within the cell's share is used again.
    #[inline]
    pub(super) fn sample(&self, p: DVec3, u: [f64; 2]) -> Option<LightSample> {
        let area = self.area();
        let target = u[0] * area;
        let cell = self.areas.partition_point(|&sum| sum <= target);
        let before = if cell == 0 { 0.0 } else { self.areas[cell - 1] };
        let share = self.areas.get(cell)? - before;
        let point = self.at(cell, DVec2::new((target - before) / share, u[1]))?;

        let unit = point.area.length();
        let n = point.area / unit;
        let to = point.position - p;
        let height = to.dot(n).abs();
        let half = 0.5 * self.bounds.size().max_element();
        let size = point.position.abs().max_element();
        let lift = lift(size, to.abs().max_element() + half, n);
        // In its plane; also refuses NaN.
        if !(height > lift) {
            return None;
        }
        let d = to.length();
        // The density by area is share/area over what the cell's part of the square becomes here.
        let per_area = unit / (CELLS * CELLS) as f64 * (area / share);
        // L·cos θ/(pdf·d²), cos θ = height/d.
        let irradiance = scaled(self.radiance, per_area / d * (height / d) / d);
        aim(p, point.position, d * (lift / height), irradiance)
    }

    pub(super) fn bounds(&self) -> LightBounds {
        LightBounds {
            bounds: self.bounds,
            radius: 0.5 * self.bounds.size().length(),
            cone: Cone::ALL,
            falloff: FRAC_PI_2,
            intensity: strength(self.radiance) * 0.5 * self.area(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Light;
    use super::super::oracle::{assert_vector_irradiance, vector_irradiance};
    use super::*;
    use crate::geometry::{Cone as Frustum, Cuboid, Disk, Framed, Polygon, Sphere, Torus};
    use std::f64::consts::TAU;

    /// The vector irradiance of a surface on both sides, from small triangles of it.
    fn expected(surface: &[&dyn Fn(f64, f64) -> DVec3], p: DVec3) -> DVec3 {
        const STEPS: u32 = 240;
        let mut sum = DVec3::ZERO;
        for at in surface {
            let at = |i: u32, j: u32| at(f64::from(i) / 240.0, f64::from(j) / 240.0);
            for i in 0..STEPS {
                for j in 0..STEPS {
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    for t in [[a, b, c], [a, c, d]] {
                        let vector = vector_irradiance(&t, p);
                        let towards = (t[0] - p).dot(vector);
                        sum += if towards < 0.0 { -vector } else { vector };
                    }
                }
            }
        }
        sum
    }

    fn check(shape: impl Into<Shapes>, surface: &[&dyn Fn(f64, f64) -> DVec3]) {
        let m = DAffine3::from_translation(DVec3::new(0.5, 0.0, 0.1))
            * DAffine3::from_scale(DVec3::new(1.0, -1.5, 0.7));
        let light = ShapeLight::new(&shape.into(), 0, m, Rgb::splat(1.0)).expect("it can shine");
        let placed: Vec<Box<dyn Fn(f64, f64) -> DVec3>> = surface
            .iter()
            .map(|at| Box::new(move |u, v| m.transform_point3(at(u, v))) as Box<_>)
            .collect();
        let placed: Vec<&dyn Fn(f64, f64) -> DVec3> = placed.iter().map(AsRef::as_ref).collect();
        for p in [DVec3::new(3.0, 1.0, 0.5), DVec3::new(-1.0, -4.0, 2.0)] {
            let expected = expected(&placed, p);
            assert_vector_irradiance(&Light::Shape(light.clone()), p, expected, 9);
        }
    }

    fn round(u: f64, rho: f64, y: f64) -> DVec3 {
        let (sin, cos) = (TAU * u).sin_cos();
        DVec3::new(rho * cos, y, rho * sin)
    }

    #[test]
    fn samples_average_to_the_vector_irradiance() {
        check(
            vec![Sphere { center: DVec3::ONE, radius: 0.5 }],
            &[&|u, v| {
                let (sin, cos) = (0.5 * TAU * v).sin_cos();
                DVec3::ONE + 0.5 * round(u, sin, cos)
            }],
        );
        check(
            vec![Framed::new(Torus { major_radius: 1.0, minor_radius: 0.3 }, DAffine3::IDENTITY)],
            &[&|u, v| {
                let (sin, cos) = (TAU * v).sin_cos();
                round(u, 1.0 + 0.3 * cos, 0.3 * sin)
            }],
        );
        let cone = Frustum { height: 1.2, radii: [0.8, 0.2], has_caps: true };
        check(
            vec![Framed::new(cone, DAffine3::IDENTITY)],
            &[&|u, v| round(u, 0.8 - 0.6 * v, 1.2 * v), &|u, v| round(u, 0.8 * v, 0.0), &|u, v| {
                round(u, 0.2 * v, 1.2)
            }],
        );
        let ring = Disk { center: DVec3::ZERO, normal: DVec3::Y, radius: 1.0, inner_radius: 0.4 };
        check(vec![ring], &[&|u, v| round(u, 0.4 + 0.6 * v, 0.0)]);
        let bounds = Bounds { min: DVec3::ZERO, max: DVec3::new(1.0, 0.5, 2.0) };
        let face = |p: DVec3| bounds.min + p * bounds.size();
        check(
            vec![Cuboid { bounds }],
            &[
                &|u, v| face(DVec3::new(0.0, u, v)),
                &|u, v| face(DVec3::new(1.0, u, v)),
                &|u, v| face(DVec3::new(u, 0.0, v)),
                &|u, v| face(DVec3::new(u, 1.0, v)),
                &|u, v| face(DVec3::new(u, v, 0.0)),
                &|u, v| face(DVec3::new(u, v, 1.0)),
            ],
        );
        // A square with a square hole is four rectangles.
        let square = |half: f64| {
            [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]]
                .map(|[x, z]| DVec3::new(x * half, 0.0, z * half))
                .to_vec()
        };
        let frame = Polygon::new(vec![square(1.0), square(0.35)]).expect("flat");
        let rectangle = |x: [f64; 2], z: [f64; 2]| {
            move |u: f64, v: f64| {
                DVec3::new(x[0] + (x[1] - x[0]) * u, 0.0, z[0] + (z[1] - z[0]) * v)
            }
        };
        check(
            vec![frame],
            &[
                &rectangle([-1.0, -0.35], [-1.0, 1.0]),
                &rectangle([0.35, 1.0], [-1.0, 1.0]),
                &rectangle([-0.35, 0.35], [-1.0, -0.35]),
                &rectangle([-0.35, 0.35], [0.35, 1.0]),
            ],
        );
    }

    #[test]
    fn what_cannot_be_sampled_does_not_shine() {
        let plane = crate::geometry::Plane { point: DVec3::ZERO, normal: DVec3::Y };
        let light = ShapeLight::new(&vec![plane].into(), 0, DAffine3::IDENTITY, Rgb::splat(1.0));
        assert_eq!(light, None);
    }
}
