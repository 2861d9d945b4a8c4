//! Grids: as isosurfaces among the objects, and as `[[volumes]]`.

use std::path::Path;
use std::sync::Arc;

use glam::DAffine3;

use super::super::document::{Node, Value};
use super::super::fields::Fields;
use super::super::grid::{SampleLayout, SampleType, read_npy, read_raw};
use super::super::transforms::transform;
use super::Interpreter;
use crate::geometry::Isosurface;
use crate::geometry::grid::{Grid, SampleOrder};
use crate::medium::volume::{TransferFunction, TransferNode};
use crate::scene::VolumeDesc;

/// Where nothing else is said, a step may be off by this much of the brightest colour.
const DEFAULT_TOLERANCE: f64 = 1e-3;

impl<'d, 'r> Interpreter<'d, 'r> {
    pub(super) fn isosurface(&mut self, fields: &Fields<'d, 'r>) -> Option<Isosurface> {
        let grid = self.grid(fields);
        let bounds = fields.require_bounds("bounds");
        let level = fields.require("level").and_then(|node| self.reader.number(node, "level"));
        let normals = [("exact", false), ("smooth", true)];
        let is_smooth = fields.choice("normals", &normals).unwrap_or(false);
        let (grid, bounds, level) = (grid?, bounds?, level?);
        let range = grid.range();
        if !(f64::from(range.min) <= level && level < f64::from(range.max)) {
            let at = self.reader.locate(fields.span());
            let (min, max) = (range.min, range.max);
            self.warnings.push(format!(
                "{at}: this isosurface is empty: its grid has values from {min} to {max}"
            ));
        }
        Some(Isosurface::new(grid, bounds, level, is_smooth))
    }

    pub(super) fn volume(&mut self, fields: Fields<'d, 'r>) -> Option<VolumeDesc> {
        let at = fields.location();
        let grid = self.grid(&fields);
        let bounds = fields.require_bounds("bounds");
        let steps = fields.get("transform");
        let steps = steps.map(|node| transform(self.reader, node, "transform"));
        let transfer = fields.require("transfer").and_then(|node| self.transfer(node));
        let tolerance = fields.get("tolerance");
        let tolerance = tolerance.and_then(|node| fields.positive(node, "tolerance"));
        fields.finish();
        Some(VolumeDesc {
            at,
            grid: grid?,
            bounds: bounds?,
            transform: steps.unwrap_or(Some(DAffine3::IDENTITY))?,
            transfer: Arc::new(transfer?),
            tolerance: tolerance.unwrap_or(DEFAULT_TOLERANCE),
        })
    }

    fn transfer(&self, node: &'d Node) -> Option<TransferFunction> {
        let mut nodes = Vec::new();
        let mut is_sound = true;
        for item in self.reader.list(node, "transfer") {
            let Some(fields) = self.reader.table(item, "transfer") else {
                is_sound = false;
                continue;
            };
            fields.is("a node of `transfer`");
            let value = fields.require("value").and_then(|n| self.reader.number(n, "value"));
            let color = fields.color("color").unwrap_or_default();
            let extinction = fields.require("extinction");
            let extinction = extinction.and_then(|n| fields.not_negative(n, "extinction"));
            fields.finish();
            match (value, extinction) {
                (Some(value), Some(extinction)) => {
                    let color = color.to_array().map(f64::from);
                    nodes.push(TransferNode { value, color, extinction });
                }
                _ => is_sound = false,
            }
        }
        if !is_sound || !matches!(node.value, Value::Array(_)) {
            return None;
        }
        match TransferFunction::new(nodes) {
            Ok(transfer) => Some(transfer),
            Err(error) => {
                self.reader.mistake(node.span, error.to_string());
                None
            }
        }
    }

    /// The grid of a `.npy` file, or of a `.raw` file with fields that tell what is in it.
    fn grid(&mut self, fields: &Fields<'d, 'r>) -> Option<Arc<Grid>> {
        let node = fields.require("grid")?;
        let name = fields.text(node, "grid")?;
        let extension = Path::new(name).extension().unwrap_or_default();
        let layout = match extension.to_string_lossy().to_ascii_lowercase().as_str() {
            "npy" => None,
            "raw" => Some(self.layout(fields)?),
            _ => {
                self.reader.mistake(node.span, "`grid` must be the name of a .npy or .raw file");
                return None;
            }
        };
        let path = self.folder.join(name);
        // One file under two names is read once.
        let key = path.canonicalize().unwrap_or_else(|_| path.clone());
        if let Some(known) = self.grids.get(&(key.clone(), layout)) {
            return known.clone();
        }
        let read = match &layout {
            None => read_npy(&path),
            Some(layout) => read_raw(&path, layout),
        };
        let grid = read.map(Arc::new).map_err(|e| self.reader.mistake(node.span, e.to_string()));
        let grid = grid.ok();
        self.grids.insert((key, layout), grid.clone());
        grid
    }

    /// How samples lie in a raw file: x runs fastest, as nearly all have it.
    fn layout(&self, fields: &Fields<'d, 'r>) -> Option<SampleLayout> {
        let size = fields.require("size").and_then(|node| {
            let size = self.reader.numbers::<3>(node, "size")?;
            // What is read as a float is exact that far.
            let is_count = |&n: &f64| n.fract() == 0.0 && (2.0..=4294967296.0).contains(&n);
            if size.iter().all(is_count) {
                return Some(size.map(|n| n as usize));
            }
            let message = "`size` must be three whole numbers from 2 on: samples along x, y and z";
            self.reader.mistake(node.span, message);
            None
        });
        let kind = fields.require("format");
        let kind = kind.and_then(|node| fields.choose(node, "format", &SampleType::NAMED));
        let orders = [("little", false), ("big", true)];
        let is_big_endian = fields.choice("byte_order", &orders).unwrap_or(false);
        Some(SampleLayout { size: size?, kind: kind?, is_big_endian, order: SampleOrder::XFastest })
    }
}
