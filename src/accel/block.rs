//! The unit of work: 4 × 4 rays, traced together where that pays.

use glam::Vec3;

use super::Hit;
use super::world::CopyRef;
use crate::math::{Ray, lanes_where};

/// Rays of a block.
pub const LANES: usize = 16;

/// Sixteen rays side by side, of which the active ones are traced.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
#[expect(missing_docs, reason = "the fields of `Ray`, a lane each")]
pub struct RayBlock {
    pub org_x: [f32; LANES],
    pub org_y: [f32; LANES],
    pub org_z: [f32; LANES],
    pub t_min: [f32; LANES],
    pub dir_x: [f32; LANES],
    pub dir_y: [f32; LANES],
    pub dir_z: [f32; LANES],
    pub t_max: [f32; LANES],
    active: u16,
}

impl RayBlock {
    /// No ray.
    pub const fn empty() -> Self {
        const NOTHING: [f32; LANES] = [0.0; LANES];
        Self {
            org_x: NOTHING,
            org_y: NOTHING,
            org_z: NOTHING,
            t_min: NOTHING,
            dir_x: NOTHING,
            dir_y: NOTHING,
            dir_z: NOTHING,
            t_max: NOTHING,
            active: 0,
        }
    }

    /// The rays of all lanes, of which `lanes` are active.
    #[inline(always)]
    pub fn from_fn(lanes: u16, ray: impl Fn(usize) -> Ray) -> Self {
        // By themselves, not in the block: then nothing is zeroed first.
        const NOTHING: [f32; LANES] = [0.0; LANES];
        let (mut org_x, mut org_y, mut org_z, mut t_min) = (NOTHING, NOTHING, NOTHING, NOTHING);
        let (mut dir_x, mut dir_y, mut dir_z, mut t_max) = (NOTHING, NOTHING, NOTHING, NOTHING);
        for i in 0..LANES {
            let ray = ray(i);
            [org_x[i], org_y[i], org_z[i]] = ray.origin.to_array();
            [dir_x[i], dir_y[i], dir_z[i]] = ray.direction.to_array();
            (t_min[i], t_max[i]) = (ray.t_min, ray.t_max);
        }
        Self { org_x, org_y, org_z, t_min, dir_x, dir_y, dir_z, t_max, active: lanes }
    }

    /// Makes lanes active whose rays were written side by side, and others not.
    #[inline]
    pub const fn activate(&mut self, lanes: u16) {
        self.active = lanes;
    }

    /// Puts a ray into a lane and makes it active.
    #[inline]
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        [self.org_x[lane], self.org_y[lane], self.org_z[lane]] = ray.origin.to_array();
        [self.dir_x[lane], self.dir_y[lane], self.dir_z[lane]] = ray.direction.to_array();
        (self.t_min[lane], self.t_max[lane]) = (ray.t_min, ray.t_max);
        self.active |= 1 << lane;
    }

    /// The ray of a lane; meaningless where it is not active.
    #[inline]
    pub fn get(&self, lane: usize) -> Ray {
        Ray {
            origin: Vec3::new(self.org_x[lane], self.org_y[lane], self.org_z[lane]),
            direction: Vec3::new(self.dir_x[lane], self.dir_y[lane], self.dir_z[lane]),
            t_min: self.t_min[lane],
            t_max: self.t_max[lane],
        }
    }

    /// The active lanes, as bits.
    #[inline]
    pub const fn active(&self) -> u16 {
        self.active
    }

    /// Where all active rays have the same direction, to the last bit: one that has it.
    #[inline(always)]
    pub(crate) fn common_direction(&self) -> Option<usize> {
        let first = self.active.trailing_zeros() as usize % LANES;
        let differ = |d: &[f32; LANES], i: usize| d[i].to_bits() ^ d[first].to_bits();
        let mut is_other = [false; LANES];
        for (i, is_other) in is_other.iter_mut().enumerate() {
            let [x, y, z] = [&self.dir_x, &self.dir_y, &self.dir_z].map(|d| differ(d, i));
            *is_other = x | y | z != 0;
        }
        (lanes_where(&is_other) & self.active == 0).then_some(first)
    }

    /// The active lanes, in order.
    #[inline]
    pub fn lanes(&self) -> impl Iterator<Item = usize> + use<> {
        lanes_of(self.active)
    }
}

/// The set bits, in order.
#[inline]
pub(crate) fn lanes_of(mut bits: u16) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (bits != 0).then(|| {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            lane
        })
    })
}

/// The hits of a block: the fields of [`Hit`], a lane each.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub struct HitBlock {
    t: [f32; LANES],
    u: [f32; LANES],
    v: [f32; LANES],
    primitive: [u32; LANES],
    geometry: [u32; LANES],
    copy: [CopyRef; LANES],
    lanes: u16,
    /// Those of them that hit a copy.
    copies: u16,
}

impl HitBlock {
    /// No hit.
    pub const NONE: Self = Self {
        t: [0.0; LANES],
        u: [0.0; LANES],
        v: [0.0; LANES],
        primitive: [0; LANES],
        geometry: [0; LANES],
        copy: [CopyRef { set: 0, index: 0 }; LANES],
        lanes: 0,
        copies: 0,
    };

    /// Asks `hit` for each lane in `active`.
    #[inline]
    pub fn from_fn(active: u16, mut hit: impl FnMut(usize) -> Option<Hit>) -> Self {
        let mut hits = Self::NONE;
        for lane in lanes_of(active) {
            hits.set(lane, hit(lane));
        }
        hits
    }

    /// Hits of the root group in `N` lanes from `start` on, by field as [`Hit`] has them: those whose bits are set.
    #[inline]
    pub(super) fn set_lanes<const N: usize>(
        &mut self,
        start: usize,
        bits: u16,
        [t, u, v]: [&[f32; N]; 3],
        [primitive, geometry]: [&[u32; N]; 2],
    ) {
        let lanes = start..start + N;
        self.t[lanes.clone()].copy_from_slice(t);
        self.u[lanes.clone()].copy_from_slice(u);
        self.v[lanes.clone()].copy_from_slice(v);
        self.primitive[lanes.clone()].copy_from_slice(primitive);
        self.geometry[lanes].copy_from_slice(geometry);
        self.lanes |= bits << start;
    }

    /// Sets the hit of a lane.
    #[inline]
    pub const fn set(&mut self, lane: usize, hit: Option<Hit>) {
        let bit = 1 << lane;
        self.lanes &= !bit;
        self.copies &= !bit;
        let Some(hit) = hit else { return };
        self.lanes |= bit;
        (self.t[lane], self.u[lane], self.v[lane]) = (hit.t, hit.u, hit.v);
        (self.primitive[lane], self.geometry[lane]) = (hit.primitive, hit.geometry);
        if let Some(copy) = hit.copy {
            self.copies |= bit;
            self.copy[lane] = copy;
        }
    }

    /// The hit of a lane, if any.
    #[inline]
    pub const fn get(&self, lane: usize) -> Option<Hit> {
        if self.lanes >> lane & 1 == 0 {
            return None;
        }
        Some(Hit {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
            primitive: self.primitive[lane],
            geometry: self.geometry[lane],
            copy: if self.copies >> lane & 1 == 1 { Some(self.copy[lane]) } else { None },
        })
    }

    /// The lanes that hit something, as bits.
    #[inline]
    pub const fn lanes(&self) -> u16 {
        self.lanes
    }

    /// Barycentric weights by lane, as [`Hit`] has them; without meaning where nothing was hit.
    #[inline]
    pub const fn weights(&self) -> [&[f32; LANES]; 2] {
        [&self.u, &self.v]
    }

    /// Indices within the geometry, by lane; likewise.
    #[inline]
    pub const fn primitives(&self) -> &[u32; LANES] {
        &self.primitive
    }

    /// The one geometry of the root group that all hits are of; none where there are several, or no hit.
    #[inline]
    pub fn only_geometry(&self) -> Option<u32> {
        if self.lanes == 0 || self.copies != 0 {
            return None;
        }
        let first = self.geometry[self.lanes.trailing_zeros() as usize % LANES];
        let is_other = |lane: usize| (self.geometry[lane] != first) & (self.lanes >> lane & 1 == 1);
        let others = (0..LANES).fold(false, |any, lane| any | is_other(lane));
        (!others).then_some(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(number: u32, copy: Option<CopyRef>) -> Hit {
        let t = number as f32 + 0.5;
        Hit { t, u: 0.25, v: 0.5, primitive: 100 + number, geometry: number % 3, copy }
    }

    #[test]
    fn hits_are_what_was_set_last() {
        let copy = Some(CopyRef { set: 3, index: 7 });
        let mut hits = HitBlock::from_fn(0b1010_0000_0000_0110, |lane| {
            (lane != 2).then(|| hit(lane as u32, if lane == 13 { copy } else { None }))
        });
        assert_eq!(hits.lanes(), 0b1010_0000_0000_0010);
        assert_eq!((hits.get(0), hits.get(2)), (None, None));
        assert_eq!((hits.get(1), hits.get(13)), (Some(hit(1, None)), Some(hit(13, copy))));
        hits.set(13, Some(hit(4, None)));
        hits.set(1, None);
        assert_eq!((hits.get(1), hits.get(13)), (None, Some(hit(4, None))));
        hits.set_lanes(4, 0b101, [&[9.0; 4], &[0.1; 4], &[0.2; 4]], [&[1, 2, 3, 4], &[5, 6, 7, 8]]);
        assert_eq!((hits.lanes(), hits.get(5)), (0b1010_0000_0101_0000, None));
        let expected = Hit { t: 9.0, u: 0.1, v: 0.2, primitive: 3, geometry: 7, copy: None };
        assert_eq!(hits.get(6), Some(expected));
    }

    #[test]
    fn one_geometry_is_told_from_several() {
        let of = |lanes: &[(usize, u32)], copy| {
            let mut hits = HitBlock::NONE;
            for (lane, geometry) in lanes {
                hits.set(*lane, Some(Hit { geometry: *geometry, ..hit(0, copy) }));
            }
            hits.only_geometry()
        };
        assert_eq!(of(&[], None), None);
        assert_eq!(of(&[(3, 2)], None), Some(2));
        assert_eq!(of(&[(3, 2), (15, 2)], None), Some(2));
        assert_eq!(of(&[(3, 2), (15, 0)], None), None);
        assert_eq!(of(&[(3, 2), (15, 2)], Some(CopyRef { set: 0, index: 0 })), None);
    }
}
