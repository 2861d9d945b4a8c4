//! What there is to hit: triangle meshes and analytic shapes, with bounds, exact intersection and
//! normals. No light, no colour, no acceleration: a shape is solved here, found elsewhere.

mod mesh;
mod sphere;
mod triangle;

pub use mesh::{Positions, TriangleMesh};
pub use sphere::Sphere;
pub use triangle::{TriangleHit, intersect_triangle};
