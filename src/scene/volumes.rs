//! Grids that glow and absorb, from what was written to what is integrated.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::build::SceneError;
use super::desc::Location;
use super::place::check_transform;
use crate::geometry::grid::Grid;
use crate::math::Bounds;
use crate::medium::volume::{TransferFunction, Volume};

/// A grid that glows and absorbs.
#[derive(Debug, Clone)]
pub struct VolumeDesc {
    /// Where it was written.
    pub at: Location,
    /// Its samples.
    pub grid: Arc<Grid>,
    /// The box whose faces the first and last samples lie on; it must have a volume.
    pub bounds: Bounds,
    /// World from the space of that box.
    pub transform: DAffine3,
    /// What the samples look like.
    pub transfer: Arc<TransferFunction>,
    /// How much of its brightest colour a step along a ray may be off by before it is halved, > 0.
    pub tolerance: f64,
}

impl VolumeDesc {
    /// The box around it in the world.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds.transformed(&self.transform)
    }
}

/// Transforms that cannot be inverted.
pub(super) fn check_volumes(volumes: &[VolumeDesc]) -> impl Iterator<Item = SceneError> {
    volumes.iter().filter_map(|v| check_transform(&v.transform, "transform", &v.at).err())
}

/// Volumes in the scene's own coordinates.
pub(super) fn placed_volumes(volumes: &[VolumeDesc], center: DVec3) -> Vec<Volume> {
    let placed = |v: &VolumeDesc| {
        let m = DAffine3::from_translation(-center) * v.transform;
        Volume::new(v.grid.clone(), v.bounds, m, v.transfer.clone(), v.tolerance)
    };
    volumes.iter().map(placed).collect()
}
