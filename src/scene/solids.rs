//! Analytic shapes in their groups: which of them a transform keeps what they are, and which need a
//! frame of their own.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::desc::ShapeDesc;
use super::draft::{Draft, DraftLook};
use crate::geometry::{Cone, Cuboid, Disk, Framed, Plane, Sphere, Torus};
use crate::math::Bounds;

impl Draft {
    /// Adds a shape that is no mesh, group from object by `m`.
    pub(super) fn add_shape(&mut self, shape: &ShapeDesc, m: &DAffine3, look: DraftLook) {
        match *shape {
            ShapeDesc::Sphere { center, radius } => match uniform_scale(&m.matrix3, EVEN) {
                Some(scale) => {
                    let center = m.transform_point3(center);
                    self.add(Sphere { center, radius: radius * scale }, look);
                }
                None => self.add(Framed::new(Sphere { center, radius }, *m), look),
            },
            ShapeDesc::Disk { center, normal, radius, inner_radius } => {
                let disk = Disk { center, normal: normal.normalize(), radius, inner_radius };
                match uniform_scale(&m.matrix3, EVEN) {
                    Some(scale) => {
                        let plane = Plane { point: center, normal: disk.normal }.transformed(m);
                        let disk = Disk {
                            center: plane.point,
                            normal: plane.normal,
                            radius: radius * scale,
                            inner_radius: inner_radius * scale,
                        };
                        self.add(disk, look);
                    }
                    None => self.add(Framed::new(disk, *m), look),
                }
            }
            ShapeDesc::Box(bounds) => {
                let is_straight = m.matrix3 == DMat3::from_diagonal(m.matrix3.diagonal());
                if is_straight && m.matrix3.diagonal().min_element() > 0.0 {
                    let [min, max] = [bounds.min, bounds.max].map(|p| m.transform_point3(p));
                    self.add(Cuboid { bounds: Bounds { min, max } }, look);
                } else {
                    self.add(Framed::new(Cuboid { bounds }, *m), look);
                }
            }
            ShapeDesc::Cone { from, to, radii, has_caps } => {
                let height = (to - from).length();
                let cone = Cone { height, radii, has_caps };
                self.add(Framed::new(cone, *m * upright(from, to - from)), look);
            }
            ShapeDesc::Torus { center, axis, major_radius, minor_radius } => {
                let torus = Torus { major_radius, minor_radius };
                self.add(Framed::new(torus, *m * upright(center, axis)), look);
            }
            ShapeDesc::Plane { point, normal } => {
                let plane = Plane { point, normal: normal.normalize() };
                self.add(plane.transformed(m), look);
            }
            ShapeDesc::Quadric(quadric) => self.add(Framed::new(quadric, *m), look),
            ShapeDesc::Implicit(ref shape) => self.add(Framed::new(shape.clone(), *m), look),
            ShapeDesc::Isosurface(ref surface) => {
                self.add(Framed::new(surface.clone(), *m), look);
            }
            ShapeDesc::Polygon(ref polygon) => self.add(polygon.transformed(m), look),
            ShapeDesc::Mesh(_) | ShapeDesc::Freeform(_) | ShapeDesc::Instances { .. } => {}
        }
    }
}

/// From a space in which something stands upright at the origin to where it stands on `foot` along `axis`:
/// the shortest turn.
fn upright(foot: DVec3, axis: DVec3) -> DAffine3 {
    let turn = DQuat::from_rotation_arc(DVec3::Y, axis.normalize());
    DAffine3::from_rotation_translation(turn, foot)
}

/// How even the scales of an object's own transform must be.
pub(super) const EVEN: f64 = 1e-12;

/// The common factor of a transform that only rotates, mirrors and scales evenly, to within `tolerance`.
pub(super) fn uniform_scale(m: &DMat3, tolerance: f64) -> Option<f64> {
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let scale = x.length();
    let near = |value: f64, expected: f64| (value - expected).abs() <= tolerance * scale * scale;
    let even = near(y.length_squared(), scale * scale) && near(z.length_squared(), scale * scale);
    let square = near(x.dot(y), 0.0) && near(y.dot(z), 0.0) && near(z.dot(x), 0.0);
    (even && square).then_some(scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_scales_are_recognised() {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0);
        assert!((uniform_scale(&(turn * 3.0), EVEN).unwrap() - 3.0).abs() < 1e-12);
        let mirrored = turn * DMat3::from_diagonal(DVec3::new(-2.0, 2.0, 2.0));
        assert!((uniform_scale(&mirrored, EVEN).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(uniform_scale(&DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1.1)), EVEN), None);
    }
}
