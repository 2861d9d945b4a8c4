//! Boxes around turned copies, nearly as tight as if every vertex had been looked at.

use glam::{DAffine3, DVec3};

use super::world::{Geometry, Group};
use crate::geometry::{AnalyticShape, with_shapes};
use crate::math::Bounds;

/// How far a group reaches along the 26 directions from the middle of a cube to its faces, edges and
/// corners: a 26-DOP (Klosowski et al., *Efficient Collision Detection Using Bounding Volume Hierarchies of
/// k-DOPs*, IEEE TVCG 4(1) 1998).
#[derive(Debug, Clone)]
pub(super) struct Reach {
    /// The largest dot product of a point with (i − 1, j − 1, k − 1), at 9 i + 3 j + k.
    table: [f64; 27],
}

impl Reach {
    /// Looks at every vertex, and at what every shape says of itself. None where there is nothing, or
    /// where it has no end.
    pub(super) fn of(group: &Group) -> Option<Self> {
        let mut table = [f64::NEG_INFINITY; 27];
        let direction = |i: usize| {
            let at = |i: usize| (i % 3) as f64 - 1.0;
            DVec3::new(at(i / 9), at(i / 3), at(i))
        };
        for geometry in &group.geometries {
            match geometry {
                Geometry::Mesh(mesh) => {
                    for first in (0..27).step_by(4) {
                        let directions = std::array::from_fn(|k| direction((first + k).min(26)));
                        let far = mesh.support(directions);
                        for (reach, far) in table[first..].iter_mut().zip(far) {
                            *reach = reach.max(far);
                        }
                    }
                }
                Geometry::Shapes(shapes) => with_shapes!(shapes, list => {
                    for shape in list.iter() {
                        for (i, reach) in table.iter_mut().enumerate() {
                            *reach = reach.max(shape.reach(direction(i)));
                        }
                    }
                }),
            }
        }
        table[13] = 0.0;
        table.iter().all(|x| x.is_finite()).then_some(Self { table })
    }

    /// A bound on the dot product of `direction` with any point. The direction is a sum, with weights that
    /// are not negative, of three of the 26; so is the bound.
    fn along(&self, direction: DVec3) -> f64 {
        let mut axes = [0, 1, 2];
        let size = direction.abs().to_array();
        axes.sort_unstable_by(|a, b| size[*b].total_cmp(&size[*a]));
        let step = |axis: usize| {
            let weight = [9, 3, 1][axis];
            if direction[axis] < 0.0 { -weight } else { weight }
        };
        // To the face, from there to the edge, from there to the corner.
        let face = 13 + step(axes[0]);
        let edge = face + step(axes[1]);
        let corner = edge + step(axes[2]);
        let [x, y, z] = axes.map(|axis| size[axis]);
        let at = |i: i32| self.table[i as usize];
        (x - y) * at(face) + (y - z) * at(edge) + z * at(corner)
    }

    /// A box around the group under a transform.
    pub(super) fn bounds(&self, m: &DAffine3) -> Bounds {
        let rows = m.matrix3.transpose();
        let rows = [rows.x_axis, rows.y_axis, rows.z_axis];
        Bounds {
            min: m.translation - DVec3::from(rows.map(|row| self.along(-row))),
            max: m.translation + DVec3::from(rows.map(|row| self.along(row))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriangleMesh;
    use proptest::prelude::*;

    fn ball() -> Group {
        let n = 40;
        let at = |i: u32| std::f64::consts::PI * f64::from(i) / f64::from(n);
        let xyz = (0..=n)
            .flat_map(|i| (0..2 * n).map(move |j| (at(i), at(j))))
            .flat_map(|(a, b)| [a.sin() * b.cos(), a.cos(), a.sin() * b.sin()].map(|x| x as f32));
        let last = (n + 1) * 2 * n;
        let triangles = (0..last - 2).map(|i| [i, i + 1, i + 2]).collect();
        let mesh = TriangleMesh::new(xyz.collect(), triangles);
        Group { geometries: vec![Geometry::Mesh(mesh)], clear: Vec::new() }
    }

    proptest! {
        #[test]
        fn boxes_hold_all_vertices_and_are_tight(
            m in prop::array::uniform9(-2.0..2.0), t in prop::array::uniform3(-9.0..9.0)
        ) {
            let group = ball();
            let m = DAffine3 { matrix3: glam::DMat3::from_cols_array(&m), translation: t.into() };
            let bounds = Reach::of(&group).unwrap().bounds(&m);
            let Geometry::Mesh(mesh) = &group.geometries[0] else { unreachable!() };
            let mut exact = Bounds::EMPTY;
            for i in 0..mesh.positions.len() {
                let p = m.transform_point3(mesh.positions.get(i).as_dvec3());
                exact = exact.union(Bounds { min: p, max: p });
            }
            let slack = 1e-9;
            prop_assert!((bounds.min - slack).cmple(exact.min).all());
            prop_assert!((bounds.max + slack).cmpge(exact.max).all());
            // Of a ball the three directions' reaches are at most 1.13 of the true one.
            let over = bounds.size() / exact.size().max(DVec3::splat(1e-9));
            prop_assert!(over.max_element() < 1.15, "{over}");
        }
    }

    #[test]
    fn what_is_empty_or_endless_has_none() {
        assert!(Reach::of(&Group::default()).is_none());
    }
}
