//! Rays.

use glam::Vec3;

/// A ray segment in world space (relative to the scene's centre).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Origin.
    pub origin: Vec3,
    /// Direction; of unit length where a camera or an integrator makes it.
    pub direction: Vec3,
    /// Hits at or before this distance are none.
    pub t_min: f32,
    /// Hits beyond this distance are none.
    pub t_max: f32,
}

impl Ray {
    /// The whole half-line from `origin`.
    #[inline]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The point at distance `t`. For display and tests: a hit point is found on its surface, not by this.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}
