//! Copies of prototypes: listed, in a file, or strewn.

use glam::{DAffine3, DVec3};

use super::super::document::{Node, Value};
use super::super::fields::Fields;
use super::super::transforms::{affine, read_transforms, transform};
use super::Interpreter;
use crate::math::Bounds;
use crate::scene::{Reference, Scatter, ShapeDesc, Turn};

impl<'d, 'r> Interpreter<'d, 'r> {
    /// An `instance` object.
    pub(super) fn instance(
        &mut self,
        fields: &Fields<'d, 'r>,
        node: &'d Node,
    ) -> Option<ShapeDesc> {
        let name = fields.text(node, "instance")?;
        let prototype = Reference { name: name.to_owned(), at: self.reader.locate(node.span) };
        let (listed, strewn) = (fields.get("transforms"), fields.get("scatter"));
        let transforms = match (listed, strewn) {
            (Some(_), Some(node)) => {
                let message = "an instance has either `transforms` or `scatter`";
                self.reader.mistake(node.span, message);
                return None;
            }
            (Some(node), None) => self.transforms(node)?,
            (None, Some(node)) => self.scatter(node)?,
            (None, None) => vec![DAffine3::IDENTITY],
        };
        Some(ShapeDesc::Instances { prototype, transforms })
    }

    /// A list of copies, or the name of a file of them.
    fn transforms(&self, node: &'d Node) -> Option<Vec<DAffine3>> {
        match &node.value {
            Value::String(file) => match read_transforms(&self.folder.join(file)) {
                Ok(transforms) => Some(transforms),
                Err(error) => {
                    self.reader.mistake(node.span, error.to_string());
                    None
                }
            },
            Value::Array(rows) => rows.iter().map(|row| self.copy(row)).collect(),
            _ => {
                self.reader.expected(node, "transforms", "a file name or a list");
                None
            }
        }
    }

    /// One copy: twelve numbers, or a list of steps as in `transform`.
    fn copy(&self, row: &'d Node) -> Option<DAffine3> {
        match &row.value {
            Value::Array(items) if items.iter().all(|i| matches!(i.value, Value::Table(_))) => {
                transform(self.reader, row, "transforms")
            }
            Value::Array(items) if items.len() == 12 => {
                self.reader.numbers::<12>(row, "transforms").map(|m| affine(&m))
            }
            _ => {
                let expected = "a list of copies, each 12 numbers or a list of steps such as \
                    [{ translate = [1, 0, 0] }]";
                self.reader.expected(row, "transforms", expected);
                None
            }
        }
    }

    /// Copies strewn over a mesh or in a box.
    fn scatter(&mut self, node: &'d Node) -> Option<Vec<DAffine3>> {
        /// More are refused where they are placed; so many are no mistake of typing.
        const MOST: u32 = 200_000_000;
        let fields = self.reader.table(node, "scatter")?;
        fields.require("count");
        let count = fields.integer("count", 0, MOST);
        let seed = fields.integer("seed", 0, u32::MAX).unwrap_or(0);
        let turn = fields.choice("turn", &Turn::NAMED).unwrap_or(Turn::Up);
        let scale = match fields.get("scale") {
            None => Some([1.0, 1.0]),
            Some(node) => self.range(node, "scale"),
        };
        let (over, within) = (fields.get("mesh"), fields.get("bounds"));
        let strewn = match (over, within) {
            (Some(over), None) => {
                let follows_surface = fields.bool("follow_surface").unwrap_or(false);
                let mesh = self.mesh_file(&fields, over);
                (|| {
                    let scatter =
                        Scatter { count: count?, seed, scale: scale?, turn, follows_surface };
                    let strewn = scatter.on_mesh(&self.scene.meshes[mesh?]);
                    if strewn.is_none() {
                        self.reader.mistake(over.span, "this mesh has no area to strew copies on");
                    }
                    strewn
                })()
            }
            (None, Some(within)) => {
                let bounds = self.flat_box(within);
                (|| {
                    let follows_surface = false;
                    let scatter =
                        Scatter { count: count?, seed, scale: scale?, turn, follows_surface };
                    Some(scatter.in_box(&bounds?))
                })()
            }
            _ => {
                let message = "`scatter` has one of the fields `mesh` and `bounds`";
                self.reader.mistake(node.span, message);
                None
            }
        };
        fields.finish();
        strewn
    }

    /// Two numbers above 0, the second not the lesser.
    fn range(&self, node: &'d Node, name: &str) -> Option<[f64; 2]> {
        let [low, high] = self.reader.numbers::<2>(node, name)?;
        if low > 0.0 && high >= low {
            return Some([low, high]);
        }
        let message = format!("`{name}` must be [least, greatest], both above 0");
        self.reader.mistake(node.span, message);
        None
    }

    /// A box that may be flat.
    fn flat_box(&self, node: &'d Node) -> Option<Bounds> {
        let corners = self.points(node, "bounds")?;
        if let [low, high] = corners.chunks_exact(3).map(DVec3::from_slice).collect::<Vec<_>>()[..]
            && low.cmple(high).all()
        {
            return Some(Bounds { min: low, max: high });
        }
        let message = "`bounds` must be [[least x, y, z], [greatest x, y, z]]";
        self.reader.mistake(node.span, message);
        None
    }
}
