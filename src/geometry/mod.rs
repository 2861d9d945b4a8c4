//! What there is to hit: triangle meshes and analytic shapes, with bounds, exact intersection and
//! normals. A new shape implements [`AnalyticShape`] and has a line in `shapes.rs`. No light, no colour, no acceleration: a shape is solved here, found elsewhere.

mod cone;
mod cuboid;
mod disk;
mod framed;
pub mod freeform;
pub mod generate;
pub mod grid;
mod implicit;
mod isosurface;
mod mesh;
mod plane;
mod polygon;
mod quadric;
mod shape;
mod shapes;
mod sphere;
mod torus;
mod triangle;

pub use cone::Cone;
pub use cuboid::Cuboid;
pub use disk::Disk;
pub use framed::Framed;
pub use implicit::{Expression, ExpressionError, Implicit};
pub use isosurface::Isosurface;
pub use mesh::{Positions, TriangleMesh};
pub use plane::Plane;
pub use polygon::{NoPolygon, Polygon};
pub use quadric::Quadric;
pub use shape::{AnalyticShape, Parameters, SampledPoint, ShapeHit, ShapePoint, cofactors};
pub(crate) use shapes::with_shapes;
pub use shapes::{PlacedShape, Shapes};
pub use sphere::Sphere;
pub use torus::Torus;
pub use triangle::{TriangleHit, distance_to_triangle, intersect_triangle};
