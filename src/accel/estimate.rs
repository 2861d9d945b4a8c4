//! What a structure will take, before it is built.

use super::world::{Geometry, World};
use super::{AccelKind, BuildOptions, BuildQuality};

/// Expected bytes of an acceleration structure, beyond the arrays that it shares with the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MemoryEstimate {
    /// At the height of the build.
    pub peak: u64,
    /// When it is built.
    pub kept: u64,
}

/// Bytes a primitive.
struct Rate {
    peak: u64,
    kept: u64,
}

impl MemoryEstimate {
    /// For building over `world`; all of it as one structure, so many small ones come out lower.
    ///
    /// The rates were measured with Embree 4.3.3 on meshes of one to ten million triangles, and of a
    /// million spheres; they vary by a few percent with the mesh.
    pub fn of(world: &World, options: &BuildOptions) -> Self {
        if options.kind == AccelKind::Brute {
            return Self::default();
        }
        let triangles = |quality| match (options.compact, quality) {
            (true, BuildQuality::Low) => Rate { peak: 100, kept: 62 },
            (true, _) => Rate { peak: 68, kept: 36 },
            (false, BuildQuality::Low) => Rate { peak: 102, kept: 94 },
            (false, BuildQuality::High) => Rate { peak: 108, kept: 69 },
            (false, BuildQuality::Auto | BuildQuality::Medium) => Rate { peak: 99, kept: 67 },
        };
        // Boxes and callbacks.
        const SHAPE: Rate = Rate { peak: 120, kept: 85 };
        const COPY: Rate = Rate { peak: 210, kept: 165 };

        let mut total = Self::default();
        let mut add = |count: usize, rate: &Rate| {
            total.peak += count as u64 * rate.peak;
            total.kept += count as u64 * rate.kept;
        };
        for group in world.prototypes.iter().chain([&world.root]) {
            let triangles = triangles(options.quality_of(world, group));
            for geometry in &group.geometries {
                let rate = if matches!(geometry, Geometry::Mesh(_)) { &triangles } else { &SHAPE };
                add(geometry.len(), rate);
            }
        }
        for set in &world.sets {
            add(set.transforms.len(), &COPY);
        }
        total
    }
}
