//! Reading a table field by field. Asking for a field makes its name known; what is left over at the
//! end is a mistake, with the known names as what would be accepted. So the list of accepted fields is
//! never written down twice, and depends on what came before (a sphere has a radius, a mesh has none).

use std::cell::RefCell;

use glam::DVec3;

use super::document::{Document, Entry, Node, Span, Value};
use super::mistakes::{Mistake, Mistakes};
use crate::color::{Rgb, linear_from_srgb};
use crate::math::Bounds;
use crate::scene::Location;

/// A document that is being read, and the mistakes found so far.
pub(super) struct Reader<'d> {
    document: &'d Document,
    mistakes: RefCell<Vec<(Span, String)>>,
}

/// A table that is being read.
pub(super) struct Fields<'d, 'r> {
    reader: &'r Reader<'d>,
    entries: &'d [Entry],
    span: Span,
    /// What the table is, for messages: `[camera]`, "a sphere".
    what: RefCell<String>,
    known: RefCell<Vec<&'static str>>,
}

impl<'d> Reader<'d> {
    pub(super) fn new(document: &'d Document) -> Self {
        Self { document, mistakes: RefCell::default() }
    }

    pub(super) fn mistake(&self, span: Span, message: impl Into<String>) {
        self.mistakes.borrow_mut().push((span, message.into()));
    }

    /// A mistake at a byte of a text.
    pub(super) fn mistake_within(&self, node: &Node, at: usize, message: String) {
        self.mistake(self.document.span_within(node, at), message);
    }

    pub(super) fn locate(&self, span: Span) -> Location {
        self.document.locate(span)
    }

    /// All mistakes in the order of the file; none where all is well.
    pub(super) fn finish(self) -> Result<(), Mistakes> {
        let mut list: Vec<Mistake> = self
            .mistakes
            .take()
            .into_iter()
            .map(|(span, message)| Mistake { at: self.document.locate(span), message })
            .collect();
        list.sort_by_key(|m| m.at.position);
        if list.is_empty() { Ok(()) } else { Err(Mistakes(list)) }
    }

    /// The document's root table.
    pub(super) fn root(&self) -> Fields<'d, '_> {
        let entries: &[Entry] = match &self.document.root.value {
            Value::Table(entries) => entries,
            _ => &[],
        };
        Fields {
            reader: self,
            entries,
            span: self.document.root.span,
            what: "the scene".to_owned().into(),
            known: RefCell::default(),
        }
    }

    /// `node` as a table; otherwise a mistake.
    pub(super) fn table<'r>(&'r self, node: &'d Node, what: &str) -> Option<Fields<'d, 'r>> {
        let Value::Table(entries) = &node.value else {
            self.expected(node, what, "a table");
            return None;
        };
        Some(Fields {
            reader: self,
            entries,
            span: node.span,
            what: what.to_owned().into(),
            known: RefCell::default(),
        })
    }

    /// `node` as a list; otherwise a mistake, and an empty list.
    pub(super) fn list(&self, node: &'d Node, name: &str) -> &'d [Node] {
        match &node.value {
            Value::Array(items) => items,
            _ => {
                self.expected(node, name, "a list");
                &[]
            }
        }
    }

    pub(super) fn expected(&self, node: &Node, name: &str, expected: &str) {
        let message = format!("`{name}` must be {expected}, not {}", node.value.kind());
        self.mistake(node.span, message);
    }

    /// `node` as a finite number.
    pub(super) fn number(&self, node: &Node, name: &str) -> Option<f64> {
        let number = usable(&node.value);
        if number.is_none() {
            self.expected(node, name, "a finite number (within 1e30)");
        }
        number
    }

    /// `node` as a list of `N` finite numbers.
    pub(super) fn numbers<const N: usize>(&self, node: &Node, name: &str) -> Option<[f64; N]> {
        let mut numbers = [0.0; N];
        match &node.value {
            Value::Array(items) if items.len() == N => {
                for (to, item) in numbers.iter_mut().zip(items) {
                    let Some(number) = usable(&item.value) else {
                        let expected = format!("a list of {N} finite numbers (within 1e30)");
                        self.expected(node, name, &expected);
                        return None;
                    };
                    *to = number;
                }
                Some(numbers)
            }
            _ => {
                self.expected(node, name, &format!("a list of {N} finite numbers"));
                None
            }
        }
    }

    /// `node` as a colour: a number (grey), three numbers, or "#rrggbb" in sRGB. Not negative.
    pub(super) fn color(&self, node: &Node, name: &str) -> Option<Rgb> {
        const EXPECTED: &str = "a colour: a number, three numbers, or \"#rrggbb\"";
        let color = match &node.value {
            Value::Integer(_) | Value::Float(_) => Rgb::splat(self.number(node, name)? as f32),
            Value::String(text) => match hex_color(text) {
                Some(color) => color,
                None => {
                    self.expected(node, name, EXPECTED);
                    return None;
                }
            },
            Value::Array(items) if items.len() == 3 => {
                Rgb::from(self.numbers::<3>(node, name)?.map(|x| x as f32))
            }
            _ => {
                self.expected(node, name, EXPECTED);
                return None;
            }
        };
        if color.to_array().iter().any(|&c| c < 0.0) {
            self.mistake(node.span, format!("`{name}` must not be negative"));
            return None;
        }
        Some(color)
    }
}

/// Numbers beyond this are no lengths, angles or amounts of light; their squares and cubes stay finite.
const MAX_NUMBER: f64 = 1e30;

/// A number that can be computed with.
fn usable(value: &Value) -> Option<f64> {
    let x = match *value {
        Value::Integer(i) => i as f64,
        Value::Float(x) => x,
        _ => return None,
    };
    (x.abs() <= MAX_NUMBER).then_some(x)
}

/// "#rrggbb", an sRGB signal, as linear light.
fn hex_color(text: &str) -> Option<Rgb> {
    let digits = text.strip_prefix('#')?;
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let channel = |i: usize| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).ok();
    let linear = |i| Some(linear_from_srgb(f32::from(channel(i)?) / 255.0));
    Some(Rgb::new(linear(0)?, linear(1)?, linear(2)?))
}

impl<'d, 'r> Fields<'d, 'r> {
    /// Where the table stands.
    pub(super) fn location(&self) -> Location {
        self.reader.locate(self.span)
    }

    pub(super) fn span(&self) -> Span {
        self.span
    }

    /// The names and values of a table whose names are free.
    pub(super) fn all(&self) -> impl Iterator<Item = (&'d str, &'d Node)> + use<'d> {
        self.entries.iter().map(|entry| (entry.key.as_str(), &entry.node))
    }

    /// Renames the table for messages, once it is known what it is.
    pub(super) fn is(&self, what: &str) {
        *self.what.borrow_mut() = what.to_owned();
    }

    /// The value of a field, if it is there.
    pub(super) fn get(&self, name: &'static str) -> Option<&'d Node> {
        self.known.borrow_mut().push(name);
        self.entries.iter().find(|entry| entry.key == name).map(|entry| &entry.node)
    }

    /// Whether a field is there; does not make it known.
    pub(super) fn has(&self, name: &str) -> bool {
        self.entries.iter().any(|entry| entry.key == name)
    }

    /// The value of a field; a mistake where it is missing.
    pub(super) fn require(&self, name: &'static str) -> Option<&'d Node> {
        let node = self.get(name);
        if node.is_none() {
            self.reader
                .mistake(self.span, format!("{} lacks the field `{name}`", self.what.borrow()));
        }
        node
    }

    /// Reports every field that was not asked for.
    pub(super) fn finish(self) {
        let known = self.known.into_inner();
        for entry in self.entries.iter().filter(|entry| !known.contains(&entry.key.as_str())) {
            let hint = suggestion(&entry.key, &known);
            let mut accepted = known.clone();
            accepted.dedup();
            let message = format!(
                "unknown field `{}` in {}{hint}; accepted: {}",
                entry.key,
                self.what.borrow(),
                accepted.join(", ")
            );
            self.reader.mistake(entry.key_span, message);
        }
    }

    pub(super) fn expected(&self, node: &Node, name: &str, expected: &str) {
        self.reader.expected(node, name, expected);
    }

    /// A number that must be above zero.
    pub(super) fn positive(&self, node: &Node, name: &str) -> Option<f64> {
        let x = self.reader.number(node, name)?;
        if x > 0.0 {
            return Some(x);
        }
        self.reader.mistake(node.span, format!("`{name}` must be above 0, not {x}"));
        None
    }

    /// A number from zero on.
    pub(super) fn not_negative(&self, node: &Node, name: &str) -> Option<f64> {
        let x = self.reader.number(node, name)?;
        if x >= 0.0 {
            return Some(x);
        }
        self.reader.mistake(node.span, format!("`{name}` must not be below 0, as {x} is"));
        None
    }

    pub(super) fn vector(&self, name: &'static str) -> Option<DVec3> {
        self.get(name).and_then(|node| self.reader.numbers(node, name)).map(DVec3::from)
    }

    pub(super) fn require_vector(&self, name: &'static str) -> Option<DVec3> {
        self.require(name).and_then(|node| self.reader.numbers(node, name)).map(DVec3::from)
    }

    /// A required number above zero.
    pub(super) fn require_positive(&self, name: &'static str) -> Option<f64> {
        self.require(name).and_then(|node| self.positive(node, name))
    }

    /// A required vector of any length but zero.
    pub(super) fn require_direction(&self, name: &'static str) -> Option<DVec3> {
        let direction = self.require_vector(name)?;
        self.check_direction(name, direction)
    }

    /// A vector of any length but zero.
    pub(super) fn direction(&self, name: &'static str, default: DVec3) -> Option<DVec3> {
        match self.get(name) {
            None => Some(default),
            Some(_) => self.vector(name).and_then(|d| self.check_direction(name, d)),
        }
    }

    fn check_direction(&self, name: &'static str, direction: DVec3) -> Option<DVec3> {
        if direction.length() >= 1e-30 {
            return Some(direction);
        }
        let span = self.get(name).map_or(self.span(), |node| node.span);
        self.reader.mistake(span, format!("`{name}` must not be zero"));
        None
    }

    /// Two required points, of which the second is greater along every axis.
    pub(super) fn require_box(&self, min: &'static str, max: &'static str) -> Option<Bounds> {
        let (low, high) = (self.require_vector(min), self.require_vector(max));
        let bounds = Bounds { min: low?, max: high? };
        let span = self.get(max).map_or(self.span(), |node| node.span);
        self.check_box(
            span,
            bounds,
            &format!("`{max}` must be greater than `{min}` along every axis"),
        )
    }

    /// A required box, as the list of its least and its greatest corner.
    pub(super) fn require_bounds(&self, name: &'static str) -> Option<Bounds> {
        let node = self.require(name)?;
        let Value::Array(corners) = &node.value else {
            self.expected(node, name, "[[least x, y, z], [greatest x, y, z]]");
            return None;
        };
        let [low, high] = corners.as_slice() else {
            self.expected(node, name, "[[least x, y, z], [greatest x, y, z]]");
            return None;
        };
        let corner = |node| self.reader.numbers::<3>(node, name).map(DVec3::from);
        let bounds = Bounds { min: corner(low)?, max: corner(high)? };
        let message = format!(
            "the second corner of `{name}` must be greater than the first along every axis"
        );
        self.check_box(node.span, bounds, &message)
    }

    fn check_box(&self, span: Span, bounds: Bounds, message: &str) -> Option<Bounds> {
        if bounds.min.cmplt(bounds.max).all() {
            return Some(bounds);
        }
        self.reader
            .mistake(span, format!("{message}; it is from {} to {}", bounds.min, bounds.max));
        None
    }

    pub(super) fn color(&self, name: &'static str) -> Option<Rgb> {
        self.get(name).and_then(|node| self.reader.color(node, name))
    }

    pub(super) fn require_color(&self, name: &'static str) -> Option<Rgb> {
        self.require(name).and_then(|node| self.reader.color(node, name))
    }

    /// A colour that a surface can reflect: no component above 1.
    pub(super) fn reflectance(&self, node: &Node, name: &str) -> Option<Rgb> {
        let color = self.reader.color(node, name)?;
        if color.to_array().iter().all(|&c| c <= 1.0) {
            return Some(color);
        }
        self.reader.mistake(
            node.span,
            format!(
                "`{name}` must lie in [0, 1]: a surface cannot reflect more light than it gets"
            ),
        );
        None
    }

    pub(super) fn bool(&self, name: &'static str) -> Option<bool> {
        let node = self.get(name)?;
        match node.value {
            Value::Bool(value) => Some(value),
            _ => {
                self.reader.expected(node, name, "true or false");
                None
            }
        }
    }

    /// A whole number within bounds.
    pub(super) fn integer(&self, name: &'static str, min: u32, max: u32) -> Option<u32> {
        let node = self.get(name)?;
        if let Value::Integer(i) = node.value
            && let Ok(i) = u32::try_from(i)
            && (min..=max).contains(&i)
        {
            return Some(i);
        }
        self.reader.expected(node, name, &format!("a whole number from {min} to {max}"));
        None
    }

    /// A whole number within bounds that may be negative.
    pub(super) fn signed(&self, name: &'static str, min: i32, max: i32) -> Option<i32> {
        let node = self.get(name)?;
        if let Value::Integer(i) = node.value
            && let Ok(i) = i32::try_from(i)
            && (min..=max).contains(&i)
        {
            return Some(i);
        }
        self.reader.expected(node, name, &format!("a whole number from {min} to {max}"));
        None
    }

    /// A number in [0, 1].
    pub(super) fn fraction(&self, name: &'static str) -> Option<f64> {
        let node = self.get(name)?;
        let x = self.reader.number(node, name)?;
        if (0.0..=1.0).contains(&x) {
            return Some(x);
        }
        self.reader.expected(node, name, "a number from 0 to 1");
        None
    }

    pub(super) fn text(&self, node: &'d Node, name: &str) -> Option<&'d str> {
        match &node.value {
            Value::String(text) => Some(text),
            _ => {
                self.reader.expected(node, name, "text");
                None
            }
        }
    }

    /// One of several names.
    pub(super) fn choice<T: Copy>(
        &self,
        name: &'static str,
        choices: &[(&'static str, T)],
    ) -> Option<T> {
        let node = self.get(name)?;
        self.choose(node, name, choices)
    }

    /// One of several names, given its node.
    pub(super) fn choose<T: Copy>(
        &self,
        node: &'d Node,
        name: &str,
        choices: &[(&'static str, T)],
    ) -> Option<T> {
        let text = self.text(node, name)?;
        if let Some((_, value)) = choices.iter().find(|(choice, _)| *choice == text) {
            return Some(*value);
        }
        let names: Vec<&'static str> = choices.iter().map(|(choice, _)| *choice).collect();
        let hint = suggestion(text, &names);
        let message = format!("unknown {name} `{text}`{hint}; accepted: {}", names.join(", "));
        self.reader.mistake(node.span, message);
        None
    }
}

/// " (did you mean `x`?)" where one of the names is close.
fn suggestion(name: &str, known: &[&str]) -> String {
    let distance = |k: &&str| strsim::damerau_levenshtein(&name.to_lowercase(), k);
    match known.iter().copied().min_by_key(distance) {
        Some(near) if distance(&near) <= 1 + near.len() / 4 => format!(" (did you mean `{near}`?)"),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_colors_are_srgb() {
        assert_eq!(hex_color("#ffffff"), Some(Rgb::splat(1.0)));
        let half = hex_color("#00bc00").unwrap();
        assert!(half.r == 0.0 && (half.g - 0.5029).abs() < 1e-3);
        for bad in ["ffffff", "#fff", "#12345g", "#é2345", ""] {
            assert_eq!(hex_color(bad), None, "{bad}");
        }
    }

    #[test]
    fn suggestions_are_close() {
        assert_eq!(suggestion("raduis", &["radius", "center"]), " (did you mean `radius`?)");
        assert_eq!(suggestion("Fov", &["fov"]), " (did you mean `fov`?)");
        assert_eq!(suggestion("banana", &["radius", "center"]), "");
    }
}
