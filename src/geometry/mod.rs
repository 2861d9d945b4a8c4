//! What there is to hit: triangle meshes and analytic shapes, with bounds, exact intersection and
//! normals. No light, no colour, no acceleration: a shape is solved here, found elsewhere.

mod disk;
mod mesh;
mod sphere;
mod triangle;

pub use disk::Disk;
pub use mesh::{Positions, TriangleMesh};
pub use sphere::Sphere;
pub use triangle::{TriangleHit, intersect_triangle};

use glam::DVec3;

use crate::math::Bounds;

/// A shape that is solved as a whole.
pub trait AnalyticShape: Copy + Send + Sync + 'static {
    /// The box around it.
    fn bounds(&self) -> Bounds;

    /// The first hit at t in (`t_min`, `t_max`], in lengths of `direction`.
    fn intersect(&self, origin: DVec3, direction: DVec3, t_min: f64, t_max: f64) -> Option<f64>;
}
