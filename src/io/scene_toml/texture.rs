//! Textures of materials: colours that vary, normal maps, bumps.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine2, DAffine3, DVec2, DVec3};

use crate::color::Rgb;
use crate::io::document::{Node, Value};
use crate::io::fields::{Fields, Reader};
use crate::io::image::{ColorSpace, read_image};
use crate::io::transforms::transform;
use crate::scene::Maps;
use crate::texture::{
    Checker, Gradient, ImageTexture, Mapping, Marble, MipMap, Noise, Placement, Ramp, Space,
    TexelFilter, Texture, Wrap,
};

/// A colour, or a texture in its place.
pub(super) struct Varying {
    pub(super) color: Rgb,
    pub(super) texture: Option<Texture>,
}

/// Reads textures and the pictures that they name, each file once.
pub(super) struct Textures<'d, 'r> {
    reader: &'r Reader<'d>,
    folder: &'r Path,
    images: HashMap<(PathBuf, Option<ColorSpace>), Option<Arc<MipMap>>>,
    /// What should be told.
    pub(super) warnings: Vec<String>,
}

/// What a texture is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    Color,
    /// Numbers, not colours: pictures are read as they are.
    Data,
}

/// The fields that tell what a texture is.
const KINDS: [&str; 5] = ["image", "checker", "noise", "marble", "gradient"];

impl<'d, 'r> Textures<'d, 'r> {
    pub(super) fn new(reader: &'r Reader<'d>, folder: &'r Path) -> Self {
        Self { reader, folder, images: HashMap::new(), warnings: Vec::new() }
    }

    /// A colour that a surface can reflect, or a texture.
    pub(super) fn reflectance(
        &mut self,
        fields: &Fields<'d, '_>,
        name: &'static str,
        default: Rgb,
    ) -> Varying {
        self.varying(fields, name, default, |fields, node| fields.reflectance(node, name))
    }

    /// A colour or a texture.
    pub(super) fn color(
        &mut self,
        fields: &Fields<'d, '_>,
        name: &'static str,
        default: Rgb,
    ) -> Varying {
        let reader = self.reader;
        self.varying(fields, name, default, |_, node| reader.color(node, name))
    }

    fn varying<'f>(
        &mut self,
        fields: &Fields<'d, 'f>,
        name: &'static str,
        default: Rgb,
        color: impl Fn(&Fields<'d, 'f>, &'d Node) -> Option<Rgb>,
    ) -> Varying {
        let Some(node) = fields.get(name) else { return Varying { color: default, texture: None } };
        if !is_texture(node) {
            let color = color(fields, node).unwrap_or(default);
            return Varying { color, texture: None };
        }
        // The texture's own colour is not known before it is asked; what only looks at the material
        // sees the default.
        Varying { color: Rgb::splat(0.5), texture: self.texture(node, name, Use::Color, |_| ()) }
    }

    /// `normal_map` and `bump`.
    pub(super) fn relief(&mut self, fields: &Fields<'d, '_>, maps: &mut Maps) {
        let reader = self.reader;
        if let Some(node) = fields.get("normal_map") {
            let mut strength = 1.0;
            let texture = self.texture(node, "normal_map", Use::Data, |fields| {
                if let Some(node) = fields.get("strength") {
                    strength = fields.not_negative(node, "strength").unwrap_or(strength);
                }
            });
            match texture {
                Some(texture @ Texture::Image(_)) => maps.normal = Some((texture, strength as f32)),
                Some(_) => reader.mistake(node.span, "a `normal_map` must be an image"),
                None => {}
            }
        }
        if let Some(node) = fields.get("bump") {
            let mut height = 0.01;
            let texture = self.texture(node, "bump", Use::Data, |fields| {
                if let Some(node) = fields.get("height") {
                    height = reader.number(node, "height").unwrap_or(height);
                }
            });
            maps.bump = texture.map(|texture| (texture, height as f32));
        }
    }

    /// A texture: the name of a picture, or a table. `more` asks for what its use adds.
    fn texture(
        &mut self,
        node: &'d Node,
        name: &'static str,
        used: Use,
        mut more: impl FnMut(&Fields<'d, '_>),
    ) -> Option<Texture> {
        let reader = self.reader;
        if let Value::String(file) = &node.value {
            let image = self.image(node, file, color_space(None, used))?;
            return Some(Texture::Image(ImageTexture::new(image)));
        }
        let fields = reader.table(node, name)?;
        let kinds: Vec<&'static str> = KINDS.into_iter().filter(|kind| fields.has(kind)).collect();
        let &[kind] = kinds.as_slice() else {
            let message =
                format!("`{name}` must be a colour or a texture, with one of {}", KINDS.join(", "));
            reader.mistake(node.span, message);
            return None;
        };
        fields.is(&format!("the texture `{kind}`"));
        let value = fields.get(kind)?;
        let texture = match kind {
            "image" => self.image_texture(&fields, value, used),
            "checker" => checker(reader, &fields, value),
            "noise" => noise(reader, &fields, value),
            "marble" => marble(reader, &fields, value),
            _ => gradient(reader, &fields, value),
        };
        more(&fields);
        fields.finish();
        texture
    }

    fn image_texture(
        &mut self,
        fields: &Fields<'d, '_>,
        node: &'d Node,
        used: Use,
    ) -> Option<Texture> {
        let file = fields.text(node, "image")?;
        let spaces = ColorSpace::ALL.map(|space| (space.name(), space));
        let space = color_space(fields.choice("color_space", &spaces), used);
        let mapping = fields.choice("mapping", &Mapping::ALL.map(|m| (m.name(), m)));
        let wrap = fields.choice("wrap", &Wrap::ALL.map(|w| (w.name(), w)));
        let filter = fields.choice("filter", &TexelFilter::ALL.map(|f| (f.name(), f)));
        let scale = positive(fields, "scale", 1.0);
        let place = inverse_transform(self.reader, fields);
        let image = self.image(node, file, space)?;
        let mapping = mapping.unwrap_or_default();
        let (mut image_from_uv, mut texture_from_object) = (DAffine2::IDENTITY, DAffine3::IDENTITY);
        if mapping == Mapping::Uv {
            // The steps as far as they lie in the plane of the coordinates.
            let (x, y) = (place.matrix3.x_axis.truncate(), place.matrix3.y_axis.truncate());
            image_from_uv = DAffine2::from_cols(x, y, place.translation.truncate());
        } else {
            texture_from_object = place;
        }
        Some(Texture::Image(ImageTexture {
            mapping,
            wrap: wrap.unwrap_or_default(),
            filter: filter.unwrap_or_default(),
            image_from_uv: DAffine2::from_scale(DVec2::splat(1.0 / scale)) * image_from_uv,
            texture_from_object,
            ..ImageTexture::new(image)
        }))
    }

    /// A picture file, read and filtered down once for each way of reading it.
    fn image(&mut self, node: &Node, file: &str, space: Option<ColorSpace>) -> Option<Arc<MipMap>> {
        let path = self.folder.join(file);
        let (reader, warnings) = (self.reader, &mut self.warnings);
        let image = self.images.entry((path, space)).or_insert_with_key(|(path, space)| {
            match read_image(path, *space) {
                Ok(file) => {
                    let told = file.warnings.iter().map(|w| format!("{}: {w}", path.display()));
                    warnings.extend(told);
                    Some(Arc::new(MipMap::new(file.image)))
                }
                Err(error) => {
                    reader.mistake(node.span, error.to_string());
                    None
                }
            }
        });
        image.clone()
    }
}

/// Data are read as they are, whatever the kind of file.
fn color_space(said: Option<ColorSpace>, used: Use) -> Option<ColorSpace> {
    said.or((used == Use::Data).then_some(ColorSpace::Linear))
}

/// Whether a value is a texture rather than a colour.
fn is_texture(node: &Node) -> bool {
    match &node.value {
        Value::Table(_) => true,
        Value::String(text) => !text.starts_with('#'),
        _ => false,
    }
}

fn checker<'d>(reader: &Reader<'d>, fields: &Fields<'d, '_>, node: &'d Node) -> Option<Texture> {
    let colors = colors(reader, node, "checker");
    let (scale, placement) = (positive(fields, "scale", 1.0), placement(reader, fields));
    let &[a, b] = colors?.as_slice() else {
        reader.expected(node, "checker", "a list of two colours");
        return None;
    };
    Some(Texture::Checker(Checker { colors: [a, b], scale, placement }))
}

fn noise<'d>(reader: &Reader<'d>, fields: &Fields<'d, '_>, node: &'d Node) -> Option<Texture> {
    let ramp = ramp(reader, node, "noise");
    let noise = Noise {
        scale: positive(fields, "scale", 1.0),
        octaves: fields.integer("octaves", 1, 16).unwrap_or(5),
        gain: fields.fraction("gain").unwrap_or(0.5),
        seed: fields.integer("seed", 0, u32::MAX).unwrap_or(0),
        placement: placement(reader, fields),
        ramp: ramp?,
    };
    Some(Texture::Noise(noise))
}

fn marble<'d>(reader: &Reader<'d>, fields: &Fields<'d, '_>, node: &'d Node) -> Option<Texture> {
    let ramp = ramp(reader, node, "marble");
    let turbulence = fields.get("turbulence");
    let marble = Marble {
        scale: positive(fields, "scale", 1.0),
        turbulence: turbulence.and_then(|n| fields.not_negative(n, "turbulence")).unwrap_or(2.0),
        octaves: fields.integer("octaves", 1, 16).unwrap_or(6),
        seed: fields.integer("seed", 0, u32::MAX).unwrap_or(0),
        placement: placement(reader, fields),
        ramp: ramp?,
    };
    Some(Texture::Marble(marble))
}

fn gradient<'d>(reader: &Reader<'d>, fields: &Fields<'d, '_>, node: &'d Node) -> Option<Texture> {
    let ramp = ramp(reader, node, "gradient");
    let axis = fields.direction("axis", DVec3::Y).unwrap_or(DVec3::Y);
    let placement = placement(reader, fields);
    Some(Texture::Gradient(Gradient { axis, ramp: ramp?, placement }))
}

/// A list of colours.
fn colors<'d>(reader: &Reader<'d>, node: &'d Node, name: &str) -> Option<Vec<Rgb>> {
    let list = reader.list(node, name);
    list.iter().map(|node| reader.color(node, name)).collect()
}

/// A list of colours at equal distances, or of `{ at = …, color = … }`.
fn ramp<'d>(reader: &Reader<'d>, node: &'d Node, name: &str) -> Option<Ramp> {
    let list = reader.list(node, name);
    let is_table = |node: &Node| matches!(node.value, Value::Table(_));
    let ramp = if list.iter().any(is_table) {
        let stop = |node| {
            let fields = reader.table(node, name)?;
            let at = fields.require("at").and_then(|node| reader.number(node, "at"));
            let color = fields.require_color("color");
            fields.finish();
            at.map(|at| at as f32).zip(color)
        };
        Ramp::new(&list.iter().map(stop).collect::<Option<Vec<_>>>()?)
    } else {
        Ramp::even(&colors(reader, node, name)?)
    };
    if ramp.is_none() {
        reader.expected(node, name, "a list of at least one colour");
    }
    ramp
}

fn positive(fields: &Fields<'_, '_>, name: &'static str, default: f64) -> f64 {
    fields.get(name).and_then(|node| fields.positive(node, name)).unwrap_or(default)
}

fn placement<'d>(reader: &Reader<'d>, fields: &Fields<'d, '_>) -> Placement {
    let spaces = [("position", Space::Position), ("uv", Space::Uv)];
    Placement {
        space: fields.choice("space", &spaces).unwrap_or_default(),
        texture_from_object: inverse_transform(reader, fields),
    }
}

/// `transform` moves the texture, as it moves an object: lookups go the other way.
fn inverse_transform<'d>(reader: &Reader<'d>, fields: &Fields<'d, '_>) -> DAffine3 {
    let Some(node) = fields.get("transform") else { return DAffine3::IDENTITY };
    let Some(transform) = transform(reader, node, "transform") else { return DAffine3::IDENTITY };
    let inverse = transform.inverse();
    if !inverse.is_finite() {
        reader.mistake(node.span, "the `transform` of a texture must not flatten it");
        return DAffine3::IDENTITY;
    }
    inverse
}
