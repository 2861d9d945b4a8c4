//! The unit of work: 4 × 4 rays, traced together where that pays.

use glam::Vec3;

use super::Hit;
use crate::math::Ray;

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

/// The lanes whose flag is set, as bits.
#[inline]
pub(crate) fn lanes_where(flags: &[bool; LANES]) -> u16 {
    (0..LANES).fold(0, |bits, lane| bits | u16::from(flags[lane]) << lane)
}

/// The hits of a block.
#[derive(Debug, Clone)]
pub struct HitBlock {
    hits: [Option<Hit>; LANES],
}

impl HitBlock {
    /// Asks `hit` for each lane in `active`.
    #[inline]
    pub fn from_fn(active: u16, mut hit: impl FnMut(usize) -> Option<Hit>) -> Self {
        Self {
            hits: std::array::from_fn(
                |lane| if active >> lane & 1 == 1 { hit(lane) } else { None },
            ),
        }
    }

    /// Sets the hit of a lane.
    #[inline]
    pub fn set(&mut self, lane: usize, hit: Option<Hit>) {
        self.hits[lane] = hit;
    }

    /// The hit of a lane, if any.
    #[inline]
    pub fn get(&self, lane: usize) -> Option<&Hit> {
        self.hits[lane].as_ref()
    }
}
