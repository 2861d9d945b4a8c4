//! Test meshes of any size, for measuring: every vertex and every triangle is a function of its number
//! and a seed, so that a mesh can be written in pieces, by several threads, without ever being held.
//!
//! Nothing but arithmetic and square roots is used, so a seed means the same mesh on every machine.

mod ball;
mod scattered;
mod terrain;

use self::ball::Balls;
use self::scattered::Scattered;
use self::terrain::Terrain;

/// What can be generated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GeneratedKind {
    /// A square of fractal hills, 100 by 100 m, open at its edges.
    Terrain,
    /// A ball with a displaced surface, closed, of radius 1 m.
    Sphere,
    /// A displaced closed shell of radius 10 m about the origin with 100 displaced closed blobs in it:
    /// no ray from within misses.
    Blobs,
    /// Triangles of their own, 1 to 6 m long and 4 mm wide, in a cube of 100 m.
    Slivers,
    /// Triangles of their own, in a cube of 2 m; the more there are, the smaller.
    Soup,
}

impl GeneratedKind {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Terrain, Self::Sphere, Self::Blobs, Self::Slivers, Self::Soup];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Terrain => "terrain",
            Self::Sphere => "sphere",
            Self::Blobs => "blobs",
            Self::Slivers => "slivers",
            Self::Soup => "soup",
        }
    }
}

/// Why a mesh cannot be generated.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GenerateError {
    /// Its shape cannot be told with so few.
    #[error("{triangles} triangles are too few for `{kind}`; the least is {least}")]
    TooFew {
        /// What was asked for.
        triangles: u64,
        /// Name of the kind.
        kind: &'static str,
        /// How many it takes.
        least: u64,
    },
    /// Vertices and triangles are numbered by u32.
    #[error("{triangles} triangles are too many for `{kind}`; the most is {most}")]
    TooMany {
        /// What was asked for.
        triangles: u64,
        /// Name of the kind.
        kind: &'static str,
        /// How many there can be.
        most: u64,
    },
}

/// A mesh that is described, not held.
#[derive(Debug, Clone)]
pub struct GeneratedMesh {
    kind: GeneratedKind,
    seed: u32,
    shape: Shape,
}

#[derive(Debug, Clone)]
enum Shape {
    Terrain(Terrain),
    Balls(Balls),
    Scattered(Scattered),
}

/// Most vertices, and most triangles: the last u32 is no number of either, and readers take one less.
const MAX_COUNT: u64 = u32::MAX as u64 - 1;

impl GeneratedMesh {
    /// A mesh of `triangles` triangles. Kinds whose surface is a grid have as many as fit into a grid
    /// with sides of whole numbers: never more, and from 10,000 on at most 8 % fewer;
    /// [`GeneratedMesh::triangle_count`] says how many.
    ///
    /// # Errors
    /// [`GenerateError`] where there are too few for the kind, or more than u32 can number.
    pub fn new(kind: GeneratedKind, triangles: u64, seed: u32) -> Result<Self, GenerateError> {
        let (least, most) = match kind {
            GeneratedKind::Terrain => (terrain::LEAST, MAX_COUNT),
            GeneratedKind::Sphere => (ball::least(1), MAX_COUNT),
            GeneratedKind::Blobs => (ball::least(ball::BLOBS), MAX_COUNT),
            GeneratedKind::Slivers | GeneratedKind::Soup => (1, MAX_COUNT / 3),
        };
        if triangles < least {
            return Err(GenerateError::TooFew { triangles, kind: kind.name(), least });
        }
        if triangles > most {
            return Err(GenerateError::TooMany { triangles, kind: kind.name(), most });
        }
        let shape = match kind {
            GeneratedKind::Terrain => Shape::Terrain(Terrain::new(triangles, seed)),
            GeneratedKind::Sphere => Shape::Balls(Balls::one(triangles, seed)),
            GeneratedKind::Blobs => Shape::Balls(Balls::many(triangles, seed)),
            GeneratedKind::Slivers => Shape::Scattered(Scattered::slivers(triangles, seed)),
            GeneratedKind::Soup => Shape::Scattered(Scattered::soup(triangles, seed)),
        };
        Ok(Self { kind, seed, shape })
    }

    /// What it is.
    pub const fn kind(&self) -> GeneratedKind {
        self.kind
    }

    /// The seed that it was made with.
    pub const fn seed(&self) -> u32 {
        self.seed
    }

    /// How many vertices it has.
    pub fn vertex_count(&self) -> u64 {
        match &self.shape {
            Shape::Terrain(terrain) => terrain.vertex_count(),
            Shape::Balls(balls) => balls.vertex_count(),
            Shape::Scattered(scattered) => 3 * scattered.count(),
        }
    }

    /// How many triangles it has.
    pub fn triangle_count(&self) -> u64 {
        match &self.shape {
            Shape::Terrain(terrain) => terrain.triangle_count(),
            Shape::Balls(balls) => balls.triangle_count(),
            Shape::Scattered(scattered) => scattered.count(),
        }
    }

    /// Position of vertex `i`, below [`GeneratedMesh::vertex_count`].
    #[inline]
    pub fn vertex(&self, i: u64) -> [f32; 3] {
        match &self.shape {
            Shape::Terrain(terrain) => terrain.vertex(i),
            Shape::Balls(balls) => balls.vertex(i),
            Shape::Scattered(scattered) => scattered.vertex(i),
        }
        .as_vec3()
        .to_array()
    }

    /// Corners of triangle `i`, below [`GeneratedMesh::triangle_count`]: counter-clockwise seen from
    /// outside or above.
    #[inline]
    pub fn triangle(&self, i: u64) -> [u32; 3] {
        let corners = match &self.shape {
            Shape::Terrain(terrain) => terrain.triangle(i),
            Shape::Balls(balls) => balls.triangle(i),
            Shape::Scattered(_) => [3 * i, 3 * i + 1, 3 * i + 2],
        };
        corners.map(|corner| corner as u32)
    }
}

#[cfg(test)]
mod tests;
