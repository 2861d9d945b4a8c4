//! A ray's way through a volume, in pieces in which everything is a polynomial: cut at the faces of cells
//! and where the value passes a node of the transfer function.

use glam::DVec3;

use super::Volume;
use super::transfer::TransferSpan;
use crate::geometry::grid::{CellSpan, CellWalk, Cubic, Range};

/// A piece of a ray in which the value is a cubic and the transfer function linear in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece<'v> {
    /// Where it begins, in lengths of the ray's direction.
    pub(super) t0: f64,
    /// Where it ends.
    pub(super) t1: f64,
    /// The grid's value from there to there.
    pub(super) value: Cubic,
    pub(super) span: &'v TransferSpan,
}

impl Piece<'_> {
    /// The extinction from its beginning to its end.
    #[inline]
    pub(super) fn extinction(&self) -> Cubic {
        let [a, b] = self.span.extinction;
        self.value.mapped(a, b)
    }
}

/// The pieces of a ray that are not clear, in order.
pub(super) struct Pieces<'v, E> {
    volume: &'v Volume,
    walk: CellWalk<'v, E>,
    /// The value along the last cell, where it is cut, and how far it has been told.
    cell: Option<(CellSpan, Cubic)>,
    /// In descending order.
    cuts: Vec<f64>,
    done: f64,
}

impl<'v> Pieces<'v, ()> {
    /// The way of a ray from its origin to `t_max`.
    pub(super) fn new(
        volume: &'v Volume,
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
    ) -> Pieces<'v, impl Fn(Range) -> bool> {
        let m = &volume.grid_from_world;
        let (o, d) = (m.transform_point3(origin), m.transform_vector3(direction));
        let is_clear = |range| volume.transfer.is_clear(range);
        let walk = CellWalk::new(&volume.grid, o, d, 0.0, t_max, is_clear);
        Pieces { volume, walk, cell: None, cuts: Vec::new(), done: 0.0 }
    }
}

impl<'v, E: Fn(Range) -> bool> Pieces<'v, E> {
    /// The next cell that is not clear.
    #[inline]
    fn next_cell(&mut self) -> Option<(CellSpan, Cubic)> {
        loop {
            let span = self.walk.next()?;
            let corners = self.volume.grid.corners(span.cell);
            let transfer = &self.volume.transfer;
            if !(span.t1 > span.t0) || transfer.is_clear(Range::of(corners)) {
                continue;
            }
            let value = Cubic::along(&corners.map(f64::from), span.a, span.b);
            let [a, b, c, d] = value.0;
            let (lo, hi) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
            self.cuts.clear();
            for bend in transfer.bends(lo, hi) {
                value.mapped(-bend, 1.0).each_root(|t| {
                    self.cuts.push(t);
                    true
                });
            }
            self.cuts.sort_unstable_by(|a, b| b.total_cmp(a));
            return Some((span, value));
        }
    }
}

impl<'v, E: Fn(Range) -> bool> Iterator for Pieces<'v, E> {
    type Item = Piece<'v>;

    #[inline]
    fn next(&mut self) -> Option<Piece<'v>> {
        loop {
            if self.cell.is_none() {
                self.cell = Some(self.next_cell()?);
                self.done = 0.0;
            }
            let (span, value) = self.cell?;
            let from = self.done;
            let to = match self.cuts.pop() {
                Some(cut) => cut,
                None => {
                    self.cell = None;
                    1.0
                }
            };
            if !(to > from) {
                continue;
            }
            self.done = to;
            let at = |s: f64| self.walk.base() + (span.t0 + s * (span.t1 - span.t0));
            let transfer = &self.volume.transfer;
            // A piece lies within one part of the transfer function: that of its middle.
            let part = transfer.span(value.at(0.5 * (from + to)));
            if part.extinction == [0.0; 2] {
                continue;
            }
            return Some(Piece {
                t0: at(from),
                t1: at(to),
                value: value.part(from, to),
                span: part,
            });
        }
    }
}
