//! Grids that glow and absorb: direct volume rendering by the emission-absorption model.
//!
//! Along a ray the radiance changes by
//!
//! dL/dt = −σ(s)·L + σ(s)·c(s)
//!
//! where s(t) is the trilinear interpolant of a grid and the [`TransferFunction`] gives to each value an
//! extinction σ, in 1/m, and a colour c: the radiance of what is so thick that nothing is seen through it.
//! Where volumes overlap, their extinctions and their emissions σ·c add up.
//!
//! Source: Max, *Optical Models for Direct Volume Rendering*, IEEE TVCG 1(2) 1995, §4.

mod integrate;
mod pieces;
mod transfer;

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::color::Rgb;
use crate::geometry::grid::Grid;
use crate::math::Bounds;
pub use integrate::{Slab, march};
use pieces::Pieces;
pub use transfer::{TransferError, TransferFunction, TransferNode};

/// A grid in space, and what its values look like.
#[derive(Debug, Clone)]
pub struct Volume {
    grid: Arc<Grid>,
    world_from_grid: DAffine3,
    grid_from_world: DAffine3,
    transfer: Arc<TransferFunction>,
    tolerance: f64,
}

impl Volume {
    /// How much of its brightest colour a step may be off by before it is halved.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// `grid` with its first and last samples on the faces of `bounds`, seen through `world_from_object`,
    /// which must not be singular. `tolerance` is how much of the brightest colour a step may be off by
    /// before it is halved, > 0.
    pub fn new(
        grid: Arc<Grid>,
        bounds: Bounds,
        world_from_object: DAffine3,
        transfer: Arc<TransferFunction>,
        tolerance: f64,
    ) -> Self {
        let cell = bounds.size() / grid.bounds().size();
        let object_from_grid = DAffine3::from_translation(bounds.min) * DAffine3::from_scale(cell);
        let world_from_grid = world_from_object * object_from_grid;
        let grid_from_world = world_from_grid.inverse();
        Self { grid, world_from_grid, grid_from_world, transfer, tolerance }
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        self.grid.bounds().transformed(&self.world_from_grid)
    }

    /// Its corners.
    pub fn corners(&self) -> [DVec3; 8] {
        self.grid.bounds().corners().map(|p| self.world_from_grid.transform_point3(p))
    }

    /// The integral of the extinction along a ray from its origin to `t_max`, in lengths of its direction.
    /// Exact but for rounding: within each piece of a cell it is that of a cubic.
    pub fn optical_depth(&self, origin: DVec3, direction: DVec3, t_max: f64) -> f64 {
        let length = direction.length();
        let pieces = Pieces::new(self, origin, direction, t_max);
        let depth: f64 =
            pieces.map(|p| p.extinction().mean().max(0.0) * (p.t1 - p.t0) * length).sum();
        // Infinity would be so thick that nothing passes.
        if depth.is_nan() { f64::INFINITY } else { depth }
    }
}

/// The share of light that all `volumes` leave of what comes along a ray.
pub fn transmittance_through(
    volumes: &[Volume],
    origin: DVec3,
    direction: DVec3,
    t_max: f64,
) -> f64 {
    let depth: f64 = volumes.iter().map(|v| v.optical_depth(origin, direction, t_max)).sum();
    (-depth).exp()
}

/// What `volumes` add to a ray as far as `t_max`, and what they leave of what is behind.
pub fn seen(volumes: &[Volume], origin: DVec3, direction: DVec3, t_max: f64) -> (Rgb, f32) {
    let mut light = [0.0; 3];
    let mut transmittance = 1.0;
    march(volumes, origin, direction, t_max, |slab| {
        light = std::array::from_fn(|i| light[i] + slab.light[i]);
        transmittance = slab.after;
    });
    (Rgb::from(light.map(|x| x as f32)), transmittance as f32)
}

#[cfg(test)]
mod tests;
