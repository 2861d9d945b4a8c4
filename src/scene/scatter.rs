//! Copies strewn over a mesh or in a box.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::geometry::TriangleMesh;
use crate::math::Bounds;

/// How copies are strewn.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// How many.
    pub count: u32,
    /// Another seed strews them otherwise.
    pub seed: u32,
    /// Least and greatest scale; each factor between is as likely as the next.
    pub scale: [f64; 2],
    /// How they are turned.
    pub turn: Turn,
    /// Whether up is the way that the mesh's surface looks, instead of +Y.
    pub follows_surface: bool,
}

/// How copies are turned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// Not at all.
    None,
    /// Around what is up.
    Up,
    /// Any way.
    Any,
}

impl Turn {
    /// All, by their names in scene files.
    pub const NAMED: [(&'static str, Self); 3] =
        [("none", Self::None), ("up", Self::Up), ("any", Self::Any)];
}

/// Steps of a sequence that fills the cube evenly however long it is. Source: Roberts, *The Unreasonable
/// Effectiveness of Quasirandom Sequences*, 2018: the powers of the inverse root of x⁴ = x + 1.
const STEPS: [f64; 3] = [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3];

impl Scatter {
    /// Copies strewn evenly in a box; flat along axes along which it is.
    pub fn in_box(&self, bounds: &Bounds) -> Vec<DAffine3> {
        let copy = |i| {
            let at = DVec3::from(self.place(i));
            self.copy(i, bounds.min + at * (bounds.max - bounds.min), DVec3::Y)
        };
        (0..self.count).map(copy).collect()
    }

    /// Copies strewn over a mesh, evenly by area. None where it has no area.
    pub fn on_mesh(&self, mesh: &TriangleMesh) -> Option<Vec<DAffine3>> {
        let corners = |i: usize| mesh.corners(i).map(|p| p.as_dvec3());
        let cross = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
        let areas = (0..mesh.triangles.len()).scan(0.0, |sum, i| {
            *sum += cross(corners(i)).length();
            Some(*sum)
        });
        let areas: Vec<f64> = areas.collect();
        let total = areas.last().copied().filter(|&area| area > 0.0 && area.is_finite())?;
        let copy = |i| {
            let [pick, u, v] = self.place(i);
            let triangle = areas.partition_point(|&sum| sum <= pick * total).min(areas.len() - 1);
            let [a, b, c] = corners(triangle);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let position = mesh.origin + a + (b - a) * u + (c - a) * v;
            let normal = cross([a, b, c]).normalize_or(DVec3::Y);
            self.copy(i, position, if self.follows_surface { normal } else { DVec3::Y })
        };
        Some((0..self.count).map(copy).collect())
    }

    /// A place in the unit cube.
    fn place(&self, i: u32) -> [f64; 3] {
        let mut random = self.random(u64::MAX);
        STEPS.map(|step| (random() + f64::from(i) * step).fract())
    }

    /// Numbers in [0, 1) that belong to one copy: SplitMix64 (Steele et al., OOPSLA 2014).
    fn random(&self, copy: u64) -> impl FnMut() -> f64 + use<> {
        let mut state = (u64::from(self.seed) << 32 ^ copy).wrapping_mul(0xd6e8_feb8_6659_fd93);
        move || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let x = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((x ^ x >> 31) >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    fn copy(&self, i: u32, position: DVec3, up: DVec3) -> DAffine3 {
        let mut random = self.random(u64::from(i));
        let [low, high] = self.scale;
        let scale = low * (high / low).powf(random());
        let upright = DQuat::from_rotation_arc(DVec3::Y, up);
        let turn = match self.turn {
            Turn::None => upright,
            Turn::Up => upright * DQuat::from_rotation_y(random() * TAU),
            Turn::Any => any_turn([random(), random(), random()]),
        };
        DAffine3 { matrix3: DMat3::from_quat(turn) * scale, translation: position }
    }
}

/// Every rotation as likely as the next. Source: Shoemake, *Uniform Random Rotations*, Graphics Gems III.
fn any_turn([u, v, w]: [f64; 3]) -> DQuat {
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    let ((sin_v, cos_v), (sin_w, cos_w)) = ((TAU * v).sin_cos(), (TAU * w).sin_cos());
    DQuat::from_xyzw(a * sin_v, a * cos_v, b * sin_w, b * cos_w).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scatter(count: u32) -> Scatter {
        Scatter { count, seed: 3, scale: [0.5, 2.0], turn: Turn::Up, follows_surface: true }
    }

    #[test]
    fn equal_areas_get_equal_shares() {
        // Two squares, one of four times the area, tilted.
        let xyz = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 0.0, -1.0],
            [1.0, 0.0, -1.0],
            [5.0, 0.0, 0.0],
            [7.0, 0.0, 0.0],
            [5.0, 2.0, 0.0],
            [7.0, 2.0, 0.0],
        ];
        let xyz = xyz.as_flattened().to_vec();
        let mesh = TriangleMesh::new(xyz, vec![[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]]);
        let copies = scatter(10_000).on_mesh(&mesh).unwrap();
        let on_small = copies.iter().filter(|m| m.translation.x <= 1.0).count();
        assert!((1900..2100).contains(&on_small), "{on_small}");
        // Quarters of the larger square are as full.
        let quarter = |m: &&DAffine3| m.translation.x > 6.0 && m.translation.y > 1.0;
        let in_quarter = copies.iter().filter(quarter).count();
        assert!((1900..2100).contains(&in_quarter), "{in_quarter}");
        for m in &copies {
            let up = if m.translation.x <= 1.0 { DVec3::Y } else { DVec3::Z };
            let scale = m.matrix3.y_axis.length();
            assert!((m.matrix3.y_axis / scale - up).length() < 1e-12);
            assert!((0.5..2.0 + 1e-12).contains(&scale));
            assert!((m.matrix3.determinant() - scale.powi(3)).abs() < 1e-9);
        }
        let below_one = copies.iter().filter(|m| m.matrix3.determinant() < 1.0).count();
        assert!((4800..5200).contains(&below_one), "{below_one}");
    }

    #[test]
    fn a_box_may_be_flat() {
        let bounds = Bounds { min: DVec3::new(-1.0, 2.0, -1.0), max: DVec3::new(1.0, 2.0, 3.0) };
        let copies = scatter(1000).in_box(&bounds);
        assert!(copies.iter().all(|m| m.translation.y == 2.0));
        let half = copies.iter().filter(|m| m.translation.z < 1.0).count();
        assert!((490..510).contains(&half), "{half}");
        let other = Scatter { seed: 4, ..scatter(1000) }.in_box(&bounds);
        assert_ne!(copies, other);
    }

    #[test]
    fn nothing_lies_on_what_has_no_area() {
        let mesh = TriangleMesh::new(vec![0.0; 9], vec![[0, 1, 2]]);
        assert_eq!(scatter(5).on_mesh(&mesh), None);
    }
}
