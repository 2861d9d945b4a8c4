//! Isosurfaces of grids: where the trilinear interpolant passes a level, exactly.

use std::sync::Arc;

use glam::{BVec3, DVec3};

use super::grid::{CellWalk, Cubic, Grid, Range};
use super::{AnalyticShape, Parameters, ShapeHit, ShapePoint};
use crate::math::Bounds;

/// Where the interpolant of a grid over an axis-aligned box passes a level. Inside are the values above
/// it, so normals point towards lower ones. Where the surface reaches the box it ends, open.
///
/// The surface is that of the interpolant, not a mesh: in each cell of third degree, continuous between
/// cells, with edges where it passes from one to the next. Rays meet it at roots of cubics that are
/// isolated and refined in f64 ([`Cubic`]).
#[derive(Debug, Clone)]
pub struct Isosurface {
    grid: Arc<Grid>,
    bounds: Bounds,
    level: f64,
    is_smooth: bool,
    /// Cells for each unit of length.
    scale: DVec3,
}

impl Isosurface {
    /// The surface of `level` of a grid whose first and last samples lie on the faces of `bounds`, which
    /// must have a volume. `is_smooth` asks for normals without the edges between cells:
    /// [`Grid::smooth_gradient`].
    pub fn new(grid: Arc<Grid>, bounds: Bounds, level: f64, is_smooth: bool) -> Self {
        let scale = grid.bounds().size() / bounds.size();
        Self { grid, bounds, level, is_smooth, scale }
    }

    /// The grid.
    pub fn grid(&self) -> &Arc<Grid> {
        &self.grid
    }

    /// A point in cell units.
    #[inline]
    fn to_grid(&self, p: DVec3) -> DVec3 {
        (p - self.bounds.min) * self.scale
    }

    /// Tells where the ray passes the surface, in order, as far as `tell` says to go on.
    #[inline]
    fn crossings(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
        mut tell: impl FnMut(f64) -> bool,
    ) {
        let level = self.level;
        let is_empty = |r: Range| f64::from(r.min) > level || f64::from(r.max) <= level;
        let (o, d) = (self.to_grid(origin), direction * self.scale);
        // Not cut within the last cell, so that a hit is the same whatever `t_max` is.
        let beyond = t_max + 2.0 / d.abs().max_element();
        let walk = CellWalk::new(&self.grid, o, d, t_min, beyond, is_empty);
        let base = walk.base();
        for span in walk {
            let corners = self.grid.corners(span.cell).map(|v| f64::from(v) - level);
            let above = corners.iter().filter(|&&v| v > 0.0).count();
            if above == 0 || above == 8 {
                continue;
            }
            let mut goes_on = true;
            Cubic::along(&corners, span.a, span.b).each_root(|s| {
                let t = base + (span.t0 + s * (span.t1 - span.t0));
                goes_on = !(t > t_min && t <= t_max) || tell(t);
                goes_on
            });
            if !goes_on {
                return;
            }
        }
    }

    /// The gradient of the interpolant, per unit of length.
    fn gradient(&self, p: DVec3) -> DVec3 {
        self.grid.gradient(self.to_grid(p)) * self.scale
    }
}

impl AnalyticShape for Isosurface {
    fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<ShapeHit> {
        let mut hit = None;
        self.crossings(origin, direction, t_min, t_max, |t| {
            hit = Some(ShapeHit::at(t));
            false
        });
        hit
    }

    /// By Newton's method along the gradient, as far as it comes nearer.
    fn surface_at(&self, p: DVec3, _part: u8) -> ShapePoint {
        /// Two or three are usual.
        const MOST_STEPS: usize = 16;
        let value = |p: DVec3| self.grid.value(self.to_grid(p)) - self.level;
        let Bounds { min, max } = self.bounds;
        let mut p = p.clamp(min, max);
        let (mut off, mut damping) = (value(p), 1.0);
        for _ in 0..MOST_STEPS {
            let gradient = self.gradient(p);
            let (cell, _) = self.grid.cell_at(self.to_grid(p));
            let cell = DVec3::from(cell.map(|i| i as f64));
            // Newton's step, without the axes along which `is_free` does not hold.
            let step = |is_free: BVec3| {
                let along = DVec3::select(is_free, gradient, DVec3::ZERO);
                -off / along.length_squared() * along
            };
            // Where the surface ends, along the face of the box.
            let whole = step(BVec3::TRUE);
            let inside = (p + whole).cmpge(min) & (p + whole).cmple(max);
            // The gradient is another in the next cell: then by a shorter step, or along the face.
            let to = self.to_grid(p + whole);
            let within = to.cmpge(cell) & to.cmple(cell + 1.0);
            let tries = [step(inside) * damping, step(inside & within) * damping];
            let better = tries.into_iter().find_map(|step| {
                let to = (p + step).clamp(min, max);
                let next = value(to);
                (next.abs() < off.abs()).then_some((to, next))
            });
            match better {
                Some((to, next)) => (p, off, damping) = (to, next, 1.0),
                None if off == 0.0 => break,
                None => damping *= 0.25,
            }
        }
        ShapePoint { position: p, normal: -self.gradient(p).normalize_or_zero() }
    }

    fn shading_normal(&self, p: DVec3, _part: u8) -> Option<DVec3> {
        let gradient = || self.grid.smooth_gradient(self.to_grid(p)) * self.scale;
        self.is_smooth.then(|| -gradient().normalize_or_zero())
    }

    /// None: it has no texture coordinates.
    fn parameters(&self, _p: DVec3, _part: u8) -> Parameters {
        Parameters::default()
    }

    /// That of the surface within its cell, at most. The edges between cells turn the normal at once.
    fn curvature(&self, p: DVec3, _part: u8) -> f64 {
        let [yz, zx, xy] = (self.grid.mixed_derivatives(self.to_grid(p)).abs()).to_array();
        let s = self.scale;
        let hessian = yz * s.y * s.z + zx * s.z * s.x + xy * s.x * s.y;
        let gradient = self.gradient(p).length();
        if gradient > 0.0 { hessian / gradient } else { 0.0 }
    }
}

#[cfg(test)]
mod tests;
