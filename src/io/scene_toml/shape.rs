//! The shapes of `[[objects]]`.

use std::sync::Arc;

use glam::DVec3;

use super::super::document::{Node, Value};
use super::super::fields::Fields;
use super::Interpreter;
use crate::geometry::{Expression, Implicit, NoPolygon, Polygon, Quadric, TriangleMesh};
use crate::scene::ShapeDesc;

/// The values of `shape`.
#[derive(Clone, Copy)]
pub(super) enum ShapeKind {
    Sphere,
    Box,
    Cylinder,
    Cone,
    Torus,
    Disk,
    Plane,
    Quadric,
    Implicit,
    Isosurface,
    Polygon,
    Triangle,
    Mesh,
    Patches,
    Nurbs,
    Subdivision,
}

impl ShapeKind {
    pub(super) const ALL: [(&'static str, Self); 16] = [
        ("sphere", Self::Sphere),
        ("box", Self::Box),
        ("cylinder", Self::Cylinder),
        ("cone", Self::Cone),
        ("torus", Self::Torus),
        ("disk", Self::Disk),
        ("plane", Self::Plane),
        ("quadric", Self::Quadric),
        ("implicit", Self::Implicit),
        ("isosurface", Self::Isosurface),
        ("polygon", Self::Polygon),
        ("triangle", Self::Triangle),
        ("mesh", Self::Mesh),
        ("patches", Self::Patches),
        ("nurbs", Self::Nurbs),
        ("subdivision", Self::Subdivision),
    ];
}

impl<'d, 'r> Interpreter<'d, 'r> {
    /// The shape of that kind.
    pub(super) fn shape(&mut self, fields: &Fields<'d, 'r>, kind: ShapeKind) -> Option<ShapeDesc> {
        match kind {
            ShapeKind::Sphere => {
                fields.is("a sphere");
                let center = fields.vector("center").unwrap_or(DVec3::ZERO);
                let radius = fields.require_positive("radius")?;
                Some(ShapeDesc::Sphere { center, radius })
            }
            ShapeKind::Box => {
                fields.is("a box");
                fields.require_box("min", "max").map(ShapeDesc::Box)
            }
            ShapeKind::Cylinder => {
                fields.is("a cylinder");
                let ends = self.ends(fields);
                let radius = fields.require_positive("radius");
                let has_caps = fields.bool("caps").unwrap_or(true);
                let ([from, to], radius) = (ends?, radius?);
                Some(ShapeDesc::Cone { from, to, radii: [radius, radius], has_caps })
            }
            ShapeKind::Cone => {
                fields.is("a cone");
                let ends = self.ends(fields);
                let radii = self.radii(fields);
                let has_caps = fields.bool("caps").unwrap_or(true);
                let ([from, to], radii) = (ends?, radii?);
                Some(ShapeDesc::Cone { from, to, radii, has_caps })
            }
            ShapeKind::Torus => {
                fields.is("a torus");
                let center = fields.vector("center").unwrap_or(DVec3::ZERO);
                let axis = fields.direction("axis", DVec3::Y);
                let major = fields.require("major_radius");
                let major = major.and_then(|node| fields.not_negative(node, "major_radius"));
                let minor = fields.require_positive("minor_radius");
                let (axis, major_radius, minor_radius) = (axis?, major?, minor?);
                Some(ShapeDesc::Torus { center, axis, major_radius, minor_radius })
            }
            ShapeKind::Disk => {
                fields.is("a disk");
                let center = fields.vector("center").unwrap_or(DVec3::ZERO);
                let normal = fields.direction("normal", DVec3::Y);
                let radius = fields.require_positive("radius");
                let node = fields.get("inner_radius");
                let inner =
                    node.map_or(Some(0.0), |node| fields.not_negative(node, "inner_radius"));
                let (normal, radius, inner_radius) = (normal?, radius?, inner?);
                if let Some(node) = node
                    && inner_radius >= radius
                {
                    let message = format!("`inner_radius` must be less than `radius`, {radius}");
                    self.reader.mistake(node.span, message);
                    return None;
                }
                Some(ShapeDesc::Disk { center, normal, radius, inner_radius })
            }
            ShapeKind::Plane => {
                fields.is("a plane");
                let point = fields.vector("point").unwrap_or(DVec3::ZERO);
                let normal = fields.direction("normal", DVec3::Y)?;
                Some(ShapeDesc::Plane { point, normal })
            }
            ShapeKind::Quadric => {
                fields.is("a quadric");
                let node = fields.require("coefficients");
                let numbers = node.and_then(|n| self.reader.numbers::<10>(n, "coefficients"));
                let bounds = fields.require_bounds("bounds");
                let (node, coefficients) = (node?, numbers?);
                if coefficients[..9].iter().all(|&c| c == 0.0) {
                    let message = "`coefficients` are those of x², y², z², xy, xz, yz, x, y, z and 1, of \
                        which the first nine must not all be 0";
                    self.reader.mistake(node.span, message);
                    return None;
                }
                Some(ShapeDesc::Quadric(Quadric::new(coefficients, bounds?)))
            }
            ShapeKind::Implicit => {
                fields.is("an implicit surface");
                let node = fields.require("expression");
                let expression = node.and_then(|node| self.expression(fields, node));
                let bounds = fields.require_bounds("bounds");
                Some(ShapeDesc::Implicit(Implicit::new(expression?, bounds?)))
            }
            ShapeKind::Isosurface => {
                fields.is("an isosurface");
                self.isosurface(fields).map(ShapeDesc::Isosurface)
            }
            ShapeKind::Polygon => {
                fields.is("a polygon");
                self.polygon(fields).map(ShapeDesc::Polygon)
            }
            ShapeKind::Triangle => {
                fields.is("a triangle");
                let node = fields.require("points")?;
                let xyz = self.points(node, "points")?;
                if xyz.len() != 9 {
                    self.reader.expected(node, "points", "three points");
                    return None;
                }
                self.scene.meshes.push(inline_mesh(&xyz, vec![[0, 1, 2]]));
                Some(ShapeDesc::Mesh(self.scene.meshes.len() - 1))
            }
            ShapeKind::Mesh => {
                fields.is("a mesh");
                let positions = fields.require("positions");
                let triangles = fields.require("triangles");
                let xyz = self.points(positions?, "positions")?;
                let triangles = self.triangles(triangles?, xyz.len() / 3)?;
                self.scene.meshes.push(inline_mesh(&xyz, triangles));
                Some(ShapeDesc::Mesh(self.scene.meshes.len() - 1))
            }
            ShapeKind::Patches => {
                fields.is("an object of patches");
                self.patches(fields)
            }
            ShapeKind::Nurbs => {
                fields.is("a NURBS surface");
                self.nurbs(fields)
            }
            ShapeKind::Subdivision => {
                fields.is("a subdivision surface");
                self.subdivision(fields)
            }
        }
    }

    /// An expression; a mistake in it is told at its character.
    fn expression(&self, fields: &Fields<'d, 'r>, node: &'d Node) -> Option<Arc<Expression>> {
        let text = fields.text(node, "expression")?;
        match Expression::parse(text) {
            Ok(expression) => Some(Arc::new(expression)),
            Err(error) => {
                let message = format!("in `expression`: {}", error.message);
                self.reader.mistake_within(node, error.at, message);
                None
            }
        }
    }

    /// The two ends of a round body.
    fn ends(&self, fields: &Fields<'d, 'r>) -> Option<[DVec3; 2]> {
        let (from, to) = (fields.require_vector("from"), fields.require_vector("to"));
        let (from, to) = (from?, to?);
        // Also refuses what underflows.
        if (to - from).length() >= 1e-30 {
            return Some([from, to]);
        }
        let span = fields.get("to").map_or(fields.span(), |node| node.span);
        self.reader.mistake(span, "`to` must differ from `from`");
        None
    }

    /// `radius`, that at `from` with the tip at `to`; or `radii`, those at both ends.
    fn radii(&self, fields: &Fields<'d, 'r>) -> Option<[f64; 2]> {
        let Some(node) = fields.get("radii") else {
            return fields.require_positive("radius").map(|radius| [radius, 0.0]);
        };
        let radii = self.reader.numbers::<2>(node, "radii")?;
        if fields.has("radius") {
            let message = "a cone has either `radius` or `radii`";
            self.reader.mistake(fields.get("radius").map_or(node.span, |n| n.span), message);
            return None;
        }
        if radii.iter().any(|&r| r < 0.0) || radii == [0.0, 0.0] {
            let message = "`radii` must not be below 0, nor both be 0";
            self.reader.mistake(node.span, message);
            return None;
        }
        Some(radii)
    }

    /// A polygon of `points` and `holes`.
    fn polygon(&self, fields: &Fields<'d, 'r>) -> Option<Polygon> {
        let (node, holes) = (fields.require("points"), fields.get("holes"));
        let node = node?;
        let mut nodes = vec![node];
        let mut loops = vec![self.corners(node, "points")?];
        if let Some(holes) = holes {
            for hole in self.reader.list(holes, "holes") {
                loops.push(self.corners(hole, "holes")?);
                nodes.push(hole);
            }
        }
        let (at, message) = match Polygon::new(loops) {
            Ok(polygon) => return Some(polygon),
            Err(NoPolygon::Flat) => (node, "the `points` of a polygon span no area".to_owned()),
            Err(NoPolygon::OffPlane { ring, corner, distance, allowed }) => {
                let message = format!(
                    "point {corner} (counted from 0) is {distance:.3e} off the plane of the polygon; \
                     accepted: up to {allowed:.3e}"
                );
                (nodes[ring], message)
            }
        };
        self.reader.mistake(at.span, message);
        None
    }

    /// The corners of one loop.
    fn corners(&self, node: &'d Node, name: &str) -> Option<Vec<DVec3>> {
        let xyz = self.points(node, name)?;
        if xyz.len() < 9 {
            let message = format!("a polygon has three corners or more, not {}", xyz.len() / 3);
            self.reader.mistake(node.span, message);
            return None;
        }
        Some(xyz.chunks_exact(3).map(DVec3::from_slice).collect())
    }

    pub(super) fn points(&self, node: &'d Node, name: &str) -> Option<Vec<f64>> {
        if !matches!(node.value, Value::Array(_)) {
            self.reader.expected(node, name, "a list of points");
            return None;
        }
        let points = self.reader.list(node, name).iter();
        let numbers: Option<Vec<[f64; 3]>> =
            points.map(|point| self.reader.numbers::<3>(point, name)).collect();
        let xyz: Vec<f64> = numbers?.into_iter().flatten().collect();
        if let Some(x) = xyz.iter().find(|x| x.abs() > 1e18) {
            self.reader.mistake(node.span, format!("`{name}` must lie within 1e18, not {x}"));
            return None;
        }
        Some(xyz)
    }

    fn triangles(&self, node: &'d Node, vertices: usize) -> Option<Vec<[u32; 3]>> {
        let mut triangles = Vec::new();
        for item in self.reader.list(node, "triangles") {
            let corners = self.reader.numbers::<3>(item, "triangles")?;
            if let Some(bad) =
                corners.iter().find(|&&i| i < 0.0 || i.fract() != 0.0 || i >= vertices as f64)
            {
                let message = format!(
                    "triangle {} names vertex {bad}, but there are {vertices} (the first is 0)",
                    triangles.len()
                );
                self.reader.mistake(item.span, message);
                return None;
            }
            triangles.push(corners.map(|i| i as u32));
        }
        Some(triangles)
    }
}

/// A mesh from numbers in the scene file, which are f64.
fn inline_mesh(xyz: &[f64], triangles: Vec<[u32; 3]>) -> TriangleMesh {
    let (origin, xyz) = super::super::mesh::place(xyz);
    TriangleMesh { origin, ..TriangleMesh::new(xyz, triangles) }
}
