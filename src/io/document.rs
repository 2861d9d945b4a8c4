//! A TOML document whose every value knows where it was written, on which the options of the command
//! line (`--set path=value`) have already been laid.

use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::mistakes::{Mistake, Mistakes};
use crate::scene::Location;

/// A piece of text that values were read from: the file, or one `--set`.
#[derive(Debug)]
struct Source {
    name: Arc<str>,
    /// The text, for columns; none where a value's place is the source as a whole.
    text: Option<String>,
    /// Offsets at which its lines start.
    lines: Vec<usize>,
}

impl Source {
    fn new(name: &str, text: Option<&str>) -> Self {
        let ends = text.unwrap_or("").bytes().enumerate().filter(|(_, b)| *b == b'\n');
        let lines = std::iter::once(0).chain(ends.map(|(i, _)| i + 1)).collect();
        Self { name: name.into(), text: text.map(str::to_owned), lines }
    }
}

/// Where a value stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    source: usize,
    start: usize,
}

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) value: Value,
    pub(super) span: Span,
}

/// TOML's values.
#[derive(Debug, Clone)]
pub(super) enum Value {
    Table(Vec<Entry>),
    Array(Vec<Node>),
    String(String),
    Integer(i64),
    Float(f64),
    Bool(bool),
    /// Dates, which no field takes.
    Other,
}

/// A field of a table.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) key: String,
    pub(super) key_span: Span,
    pub(super) node: Node,
}

impl Value {
    fn is_number(&self) -> bool {
        matches!(self, Self::Integer(_) | Self::Float(_))
    }

    fn number_text(&self) -> String {
        match self {
            Self::Integer(number) => number.to_string(),
            // As it could be typed: 1e200, not 201 digits; 2.5, not 2.5e0.
            Self::Float(number) if *number != 0.0 && !(1e-4..1e9).contains(&number.abs()) => {
                format!("{number:e}")
            }
            Self::Float(number) => number.to_string(),
            _ => String::new(),
        }
    }

    /// What a person would call it.
    pub(super) fn kind(&self) -> String {
        match self {
            Self::Table(_) => "a table".into(),
            Self::Array(items) if items.len() <= 4 && items.iter().all(|i| i.value.is_number()) => {
                let items: Vec<String> = items.iter().map(|i| i.value.number_text()).collect();
                format!("[{}]", items.join(", "))
            }
            Self::Array(items) => format!("a list of {}", items.len()),
            Self::String(text) => format!("the text \"{text}\""),
            Self::Integer(_) | Self::Float(_) => format!("the number {}", self.number_text()),
            Self::Bool(value) => format!("{value}"),
            Self::Other => "a date".into(),
        }
    }
}

/// A document and its sources.
#[derive(Debug)]
pub(super) struct Document {
    pub(super) root: Node,
    sources: Vec<Source>,
}

impl Document {
    /// Parses `text`, the content of the file `name`.
    pub(super) fn parse(name: &str, text: &str) -> Result<Self, Mistakes> {
        let (table, errors) = DeTable::parse_recoverable(text);
        let mut document = Self {
            root: Node { value: Value::Table(Vec::new()), span: Span { source: 0, start: 0 } },
            sources: vec![Source::new(name, Some(text))],
        };
        if !errors.is_empty() {
            let mistakes = errors.iter().map(|error| {
                let start = error.span().map_or(0, |span| span.start);
                Mistake {
                    at: document.locate(Span { source: 0, start }),
                    message: error.message().trim().replace('\n', ", "),
                }
            });
            let mut mistakes: Vec<Mistake> = mistakes.collect();
            mistakes.sort_by_key(|m| m.at.position);
            return Err(Mistakes(mistakes));
        }
        document.root = Node { value: table_value(table.get_ref(), 0), ..document.root };
        Ok(document)
    }

    /// A document with one object: a bare mesh.
    pub(super) fn of_mesh(path: &str) -> Self {
        let span = Span { source: 0, start: 0 };
        let node = |value| Node { value, span };
        let table = |key: &str, node: Node| {
            Value::Table(vec![Entry { key: key.into(), key_span: span, node }])
        };
        let object = table("mesh", node(Value::String(path.into())));
        let objects = node(Value::Array(vec![node(object)]));
        Self { root: node(table("objects", objects)), sources: vec![Source::new(path, None)] }
    }

    /// Lays one `path.to.field=value` over the document. The path may pass through lists by number
    /// (`objects.0.radius`) and makes tables where there are none; the value is TOML, or plain text.
    pub(super) fn set(&mut self, assignment: &str) -> Result<(), Mistake> {
        let source = self.sources.len();
        self.sources.push(Source::new(&format!("--set {assignment}"), None));
        let span = Span { source, start: 0 };
        let mistake =
            |document: &Self, message: String| Mistake { at: document.locate(span), message };
        let Some((path, text)) = assignment.split_once('=') else {
            return Err(mistake(self, "expected path.to.field=value".into()));
        };
        let text = text.trim();
        let value = match DeValue::parse(text) {
            Ok(value) => convert(&value, source).value,
            Err(_) => Value::String(text.to_owned()),
        };
        let keys: Vec<&str> = path.trim().split('.').map(str::trim).collect();
        if keys.iter().any(|key| key.is_empty()) {
            return Err(mistake(
                self,
                format!("`{path}` is no path; expected names with dots between"),
            ));
        }
        let mut node = &mut self.root;
        for key in keys {
            // A value of the wrong kind on the way gives way to a table.
            if !matches!(node.value, Value::Table(_) | Value::Array(_)) {
                node.value = Value::Table(Vec::new());
            }
            node = match &mut node.value {
                Value::Array(items) => {
                    let count = items.len();
                    match key.parse::<usize>().ok().filter(|&i| i < count) {
                        Some(i) => &mut items[i],
                        None => {
                            let message =
                                format!("`{key}` in `{path}` is no item of a list of {count}");
                            return Err(mistake(self, message));
                        }
                    }
                }
                Value::Table(entries) => {
                    let index = entries.iter().position(|e| e.key == key).unwrap_or_else(|| {
                        let node = Node { value: Value::Table(Vec::new()), span };
                        entries.push(Entry { key: key.into(), key_span: span, node });
                        entries.len() - 1
                    });
                    &mut entries[index].node
                }
                _ => unreachable!("made a table above"),
            };
        }
        *node = Node { value, span };
        Ok(())
    }

    /// Where the byte `at` of a text stands. In a text with escapes this is the place of the text.
    pub(super) fn span_within(&self, node: &Node, at: usize) -> Span {
        let Span { source, start } = node.span;
        let found = || {
            let Value::String(text) = &node.value else { return None };
            let written = self.sources[source].text.as_ref()?.get(start..)?;
            let quote = written.get(..1)?;
            let triple = quote.repeat(3);
            let opening = if written.starts_with(&triple) { triple.as_str() } else { quote };
            let mut content = written.strip_prefix(opening)?;
            // A line break that follows three quotes is no part of the text.
            if opening.len() == 3 {
                let rest = content.strip_prefix('\r').unwrap_or(content);
                content = rest.strip_prefix('\n').unwrap_or(content);
            }
            content
                .starts_with(text.get(..at)?)
                .then_some(start + written.len() - content.len() + at)
        };
        Span { source, start: found().unwrap_or(start) }
    }

    /// File, line and column of a place.
    pub(super) fn locate(&self, span: Span) -> Location {
        let source = &self.sources[span.source];
        let position = source.text.as_ref().map(|text| {
            let at = span.start.min(text.len());
            let line = source.lines.partition_point(|&start| start <= at);
            let before = &text.as_bytes()[source.lines[line - 1]..at];
            let column = String::from_utf8_lossy(before).chars().count() + 1;
            (line, column)
        });
        Location { source: Arc::clone(&source.name), position }
    }
}

fn table_value(table: &DeTable<'_>, source: usize) -> Value {
    let entries = table.iter().map(|(key, value)| Entry {
        key: key.get_ref().to_string(),
        key_span: Span { source, start: key.span().start },
        node: convert(value, source),
    });
    Value::Table(entries.collect())
}

fn convert(node: &Spanned<DeValue<'_>>, source: usize) -> Node {
    let value = match node.get_ref() {
        DeValue::String(text) => Value::String(text.to_string()),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(integer) => Value::Integer(integer),
            // Beyond 64 bits, but a number all the same.
            Err(_) => Value::Float(number.as_str().parse().unwrap_or(f64::INFINITY)),
        },
        DeValue::Float(number) => Value::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(value) => Value::Bool(*value),
        DeValue::Datetime(_) => Value::Other,
        DeValue::Array(items) => {
            Value::Array(items.iter().map(|item| convert(item, source)).collect())
        }
        DeValue::Table(table) => table_value(table, source),
    };
    Node { value, span: Span { source, start: node.span().start } }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn get<'a>(node: &'a Node, path: &str) -> &'a Value {
        let step = |node: &'a Node, key: &str| match &node.value {
            Value::Table(entries) => &entries.iter().find(|e| e.key == key).unwrap().node,
            Value::Array(items) => &items[key.parse::<usize>().unwrap()],
            other => panic!("{other:?}"),
        };
        &path.split('.').fold(node, step).value
    }

    #[test]
    fn options_are_laid_over_the_file() {
        let mut document =
            Document::parse("f.toml", "[camera]\nfov = 40\n[[objects]]\nradius = 1.0\n").unwrap();
        for set in
            ["camera.fov=50.5", "objects.0.radius = 2", "image.size=[3, 4]", "render.filter=box"]
        {
            document.set(set).unwrap();
        }
        let root = &document.root;
        assert!(matches!(get(root, "camera.fov"), Value::Float(x) if *x == 50.5));
        assert!(matches!(get(root, "objects.0.radius"), Value::Integer(2)));
        assert!(matches!(get(root, "image.size.1"), Value::Integer(4)));
        assert!(matches!(get(root, "render.filter"), Value::String(s) if s == "box"));
        for (set, message) in [
            (
                "objects.7.radius=1",
                "--set objects.7.radius=1: `7` in `objects.7.radius` is no item of a list of 1",
            ),
            ("camera", "--set camera: expected path.to.field=value"),
            ("a..b=1", "--set a..b=1: `a..b` is no path; expected names with dots between"),
        ] {
            assert_eq!(document.set(set).unwrap_err().to_string(), message);
        }
    }

    #[test]
    fn places_are_lines_and_columns() {
        let text = "a = 1\n  ü = [\n 2, 3]\n";
        let document = Document::parse("f.toml", "x = 1").unwrap();
        let document = Document { sources: vec![Source::new("f.toml", Some(text))], ..document };
        let at = |start| document.locate(Span { source: 0, start }).to_string();
        assert_eq!(at(0), "f.toml:1:1");
        assert_eq!(at(text.find('[').unwrap()), "f.toml:2:7");
        assert_eq!(at(text.find('3').unwrap()), "f.toml:3:5");
        assert_eq!(at(1000), "f.toml:4:1");
    }
}
