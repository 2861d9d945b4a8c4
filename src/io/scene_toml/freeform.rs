//! Freeform surfaces: patches, NURBS, subdivision; and how near their triangles shall be.

use std::sync::Arc;

use glam::DVec3;

use super::super::bpt::read_patches;
use super::super::document::{Node, Value};
use super::super::fields::Fields;
use super::super::mesh::read_polygons;
use super::Interpreter;
use crate::geometry::freeform::{BezierPatch, FreeformSurface, NurbsSurface, SubdivisionSurface};
use crate::scene::{FreeformDesc, ShapeDesc, Tolerance};

/// `tolerance`: a number of pixels, or a text with a unit.
pub(super) fn tolerance(fields: &Fields<'_, '_>) -> Option<Tolerance> {
    const EXPECTED: &str =
        "pixels above 0, such as 0.5 or \"0.5 px\", or metres, such as \"0.01 m\"";
    let node = fields.get("tolerance")?;
    let parsed = match &node.value {
        Value::Integer(_) | Value::Float(_) => {
            return fields.positive(node, "tolerance").map(Tolerance::Pixels);
        }
        Value::String(text) => {
            let number = |text: &str| {
                let number: f64 = text.trim().parse().ok()?;
                (number > 0.0 && number <= 1e30).then_some(number)
            };
            match (text.strip_suffix("px"), text.strip_suffix('m')) {
                (Some(text), _) => number(text).map(Tolerance::Pixels),
                (None, Some(text)) => number(text).map(Tolerance::Meters),
                _ => None,
            }
        }
        _ => None,
    };
    if parsed.is_none() {
        fields.expected(node, "tolerance", EXPECTED);
    }
    parsed
}

/// Points, faces, and the node that says where they are.
type ControlMesh<'d> = (Vec<DVec3>, Vec<Vec<u32>>, &'d Node);

impl<'d, 'r> Interpreter<'d, 'r> {
    /// Bézier patches from a file, from points, or from points by number.
    pub(super) fn patches(&self, fields: &Fields<'d, 'r>) -> Option<ShapeDesc> {
        let patches = match (fields.get("file"), fields.get("points")) {
            (Some(file), None) => self.patch_file(fields, file),
            (None, Some(points)) => self.patch_points(fields, points),
            (file, _) => {
                let span = file.map_or(fields.span(), |node| node.span);
                let message = "an object of patches has either a `file` or `points`";
                self.reader.mistake(span, message);
                None
            }
        };
        let tolerance = tolerance(fields);
        let surface = FreeformSurface::Patches(patches?);
        Some(ShapeDesc::Freeform(Arc::new(FreeformDesc { surface, tolerance })))
    }

    fn patch_file(&self, fields: &Fields<'d, 'r>, node: &'d Node) -> Option<Vec<BezierPatch>> {
        let path = self.folder.join(fields.text(node, "file")?);
        let patches = read_patches(&path);
        patches.map_err(|e| self.reader.mistake(node.span, e.to_string())).ok()
    }

    fn patch_points(&self, fields: &Fields<'d, 'r>, node: &'d Node) -> Option<Vec<BezierPatch>> {
        let patches = fields.get("patches");
        let points = self.vectors(node, "points")?;
        let Some(patches) = patches else {
            let (patches, rest) = points.as_chunks::<16>();
            if !rest.is_empty() || patches.is_empty() {
                let expected =
                    "16 points for each patch, or any number with `patches` to tell which";
                self.reader.expected(node, "points", expected);
                return None;
            }
            return Some(patches.iter().map(BezierPatch::bicubic).collect());
        };
        let patch = |(i, node): (usize, &'d Node)| {
            let numbers = self.reader.numbers::<16>(node, "patches")?;
            let numbers = self.vertices(node, &numbers, points.len(), &format!("patch {i}"))?;
            let corners = std::array::from_fn(|k| points[numbers[k] as usize]);
            Some(BezierPatch::bicubic(&corners))
        };
        self.reader.list(patches, "patches").iter().enumerate().map(patch).collect()
    }

    /// A NURBS surface of rows of points.
    pub(super) fn nurbs(&self, fields: &Fields<'d, 'r>) -> Option<ShapeDesc> {
        let degree = fields.require("degree").and_then(|node| {
            let numbers = self.reader.numbers::<2>(node, "degree")?;
            if numbers.iter().any(|n| n.fract() != 0.0 || !(0.0..100.0).contains(n)) {
                self.reader.expected(node, "degree", "two whole numbers, along u and along v");
                return None;
            }
            Some(numbers.map(|n| n as usize))
        });
        let knots_u = fields.require("knots_u").and_then(|node| self.reals(node, "knots_u"));
        let knots_v = fields.require("knots_v").and_then(|node| self.reals(node, "knots_v"));
        let rows = fields.require("points");
        let weight_rows = fields.get("weights");
        let tolerance = tolerance(fields);
        let rows_node = rows?;
        let rows = self.reader.list(rows_node, "points").iter();
        let rows = rows.map(|row| self.vectors(row, "points")).collect::<Option<Vec<_>>>()?;
        let columns = rows.first().map_or(0, Vec::len);
        if let Some(row) = rows.iter().position(|row| row.len() != columns) {
            let message = format!(
                "`points` must have rows of the same length; row {row} (the first is 0) has {} points, \
                 not {columns}",
                rows[row].len()
            );
            self.reader.mistake(rows_node.span, message);
            return None;
        }
        let weights = match weight_rows {
            None => None,
            Some(node) => {
                let lists = self.reader.list(node, "weights").iter();
                let lists = lists.map(|row| self.reals(row, "weights"));
                let lists = lists.collect::<Option<Vec<_>>>()?;
                if lists.len() != rows.len() || lists.iter().any(|row| row.len() != columns) {
                    let message = format!(
                        "`weights` must have {} rows of {columns} numbers, as `points` has",
                        rows.len()
                    );
                    self.reader.mistake(node.span, message);
                    return None;
                }
                Some(lists.concat())
            }
        };
        let count = [columns, rows.len()];
        let knots = [knots_u?, knots_v?];
        let surface = NurbsSurface::new(degree?, knots, count, &rows.concat(), weights.as_deref());
        let surface =
            surface.map_err(|e| self.reader.mistake(fields.span(), e.to_string())).ok()?;
        let surface = FreeformSurface::Patches(surface.to_bezier());
        Some(ShapeDesc::Freeform(Arc::new(FreeformDesc { surface, tolerance })))
    }

    /// A subdivision surface of a mesh from a file, or of points and faces.
    pub(super) fn subdivision(&self, fields: &Fields<'d, 'r>) -> Option<ShapeDesc> {
        let mesh = match fields.get("file") {
            Some(node) => self.control_file(fields, node),
            None => {
                let positions = fields.require("positions");
                let faces = fields.require("faces");
                let positions = positions.and_then(|node| self.vectors(node, "positions"));
                positions.zip(faces).and_then(|(positions, node)| {
                    let count = positions.len();
                    let face = |(i, node): (usize, &'d Node)| {
                        let numbers = self.reals(node, "faces")?;
                        self.vertices(node, &numbers, count, &format!("face {i}"))
                    };
                    let faces = self.reader.list(node, "faces").iter().enumerate().map(face);
                    Some((positions, faces.collect::<Option<Vec<_>>>()?, node))
                })
            }
        };
        let creases = fields.get("creases");
        let tolerance = tolerance(fields);
        let (positions, faces, node) = mesh?;
        let mut edges = Vec::new();
        for item in creases.map_or(&[][..], |node| self.reader.list(node, "creases")) {
            let ends = self.reader.numbers::<2>(item, "creases")?;
            let ends = self.vertices(item, &ends, positions.len(), "a crease")?;
            edges.push([ends[0], ends[1]]);
        }
        let surface = SubdivisionSurface::new(positions, faces, &edges);
        let surface = surface.map_err(|e| self.reader.mistake(node.span, e.to_string())).ok()?;
        let surface = FreeformSurface::Subdivision(surface);
        Some(ShapeDesc::Freeform(Arc::new(FreeformDesc { surface, tolerance })))
    }

    fn control_file(&self, fields: &Fields<'d, 'r>, node: &'d Node) -> Option<ControlMesh<'d>> {
        let path = self.folder.join(fields.text(node, "file")?);
        let polygons = read_polygons(&path);
        let polygons = polygons.map_err(|e| self.reader.mistake(node.span, e.to_string())).ok()?;
        let mut rest = polygons.corners.as_slice();
        let mut faces = Vec::with_capacity(polygons.face_sizes.len());
        for &size in &polygons.face_sizes {
            let (face, after) = rest.split_at(size as usize);
            faces.push(face.to_vec());
            rest = after;
        }
        Some((polygons.positions, faces, node))
    }

    fn vectors(&self, node: &'d Node, name: &str) -> Option<Vec<DVec3>> {
        let xyz = self.points(node, name)?;
        Some(xyz.as_chunks::<3>().0.iter().map(|&p| p.into()).collect())
    }

    fn reals(&self, node: &'d Node, name: &str) -> Option<Vec<f64>> {
        if !matches!(node.value, Value::Array(_)) {
            self.reader.expected(node, name, "a list of numbers");
            return None;
        }
        self.reader.list(node, name).iter().map(|node| self.reader.number(node, name)).collect()
    }

    /// `numbers` as vertices, of which there are `count`.
    fn vertices(
        &self,
        node: &'d Node,
        numbers: &[f64],
        count: usize,
        what: &str,
    ) -> Option<Vec<u32>> {
        let is_bad = |n: &&f64| **n < 0.0 || n.fract() != 0.0 || **n >= count as f64;
        if let Some(bad) = numbers.iter().find(is_bad) {
            let message =
                format!("{what} names point {bad}, but there are {count} (the first is 0)");
            self.reader.mistake(node.span, message);
            return None;
        }
        Some(numbers.iter().map(|&n| n as u32).collect())
    }
}
