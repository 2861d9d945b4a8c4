//! What is kept of a render to go on from: checkpoints, and the parts of a divided one.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::units::Part;
use super::{Failure, warn};
use crate::film::PixelRect;
use crate::io::{
    Attribute, AttributeValue, StateFile, StateView, WriteError, read_state, write_state,
};
use crate::render::{RenderState, Rendered, Snapshot};
use crate::sampler::REPLICATES;

/// How often `--resume` keeps where `--checkpoint` does not say.
pub(super) const CHECKPOINT_EVERY: Duration = Duration::from_secs(60);

/// The file of the checkpoints of a render to `output`.
pub(super) fn checkpoint_path(output: &Path) -> PathBuf {
    output.with_extension("checkpoint.exr")
}

/// Which samples part `part` of `samples` takes; none where there are fewer samples than parts. Parts begin
/// where few nodes of the sums are open, so that they are small, and differ by an eighth at most.
pub(super) fn part_range(part: Part, samples: u32) -> Option<Range<u32>> {
    let each = samples / part.count;
    if each == 0 {
        return None;
    }
    let step = match each / REPLICATES {
        0 => 1,
        nodes => REPLICATES << (nodes / 8).checked_ilog2().unwrap_or(0),
    };
    let begin = |k: u32| {
        let exact = u64::from(samples) * u64::from(k) / u64::from(part.count);
        exact as u32 / step * step
    };
    let end = if part.number == part.count { samples } else { begin(part.number) };
    Some(begin(part.number - 1)..end)
}

/// What a part says of which it is.
pub(super) fn part_attributes(part: Part, samples: u32) -> [Attribute; 2] {
    let text = format!("{}/{}", part.number, part.count);
    [
        Attribute::new("alhazen.part", AttributeValue::Text(text)),
        Attribute::new("alhazen.partOf", AttributeValue::Text(samples.to_string())),
    ]
}

/// The first attribute that differs between the renders of two files, in words; none where they are of the
/// same.
pub(super) fn difference(
    a: (&str, &[Attribute]),
    b: (&str, &[Attribute]),
    is_compared: impl Fn(&str) -> bool,
) -> Option<String> {
    let value = |list: &[Attribute], name: &str| {
        let found = list.iter().find(|attribute| attribute.name == name);
        found.map_or("none".to_owned(), |attribute| match &attribute.value {
            AttributeValue::Text(text) => format!("`{text}`"),
            AttributeValue::Integer(i) => i.to_string(),
            AttributeValue::Float(x) => x.to_string(),
            AttributeValue::Vector(v) => format!("{v:?}"),
        })
    };
    let names = a.1.iter().chain(b.1).map(|attribute| attribute.name.as_str());
    names.filter(|name| is_compared(name)).find_map(|name| {
        let (x, y) = (value(a.1, name), value(b.1, name));
        (x != y).then(|| format!("{name} is {x} in {} and {y} in {}", a.0, b.0))
    })
}

/// Keeps checkpoints of a render.
pub(super) struct Keeper {
    path: PathBuf,
    /// What the render is, for the file's header.
    identity: Vec<Attribute>,
}

impl Keeper {
    pub(super) fn new(path: PathBuf, identity: Vec<Attribute>) -> Self {
        Self { path, identity }
    }

    /// Writes how far it is; that it cannot is no reason to stop.
    pub(super) fn keep(&self, snapshot: &Snapshot<'_>) {
        let view = StateView {
            film: snapshot.film,
            blocks: snapshot.blocks,
            first_sample: snapshot.first_sample,
            passed: snapshot.passed,
            rays: snapshot.rays,
            non_finite: snapshot.non_finite,
        };
        if let Err(error) = write_state(&self.path, &view, self.identity.clone()) {
            warn(&format!("no checkpoint: {error}"));
        }
    }

    /// The state that the file holds, where there is one, of the same render.
    pub(super) fn read(
        &self,
        first_sample: u32,
        window: PixelRect,
        size: [u32; 2],
    ) -> Result<Option<RenderState>, Failure> {
        if !self.path.exists() {
            return Ok(None);
        }
        let StateFile { state, attributes, size: of, .. } =
            read_state(&self.path).map_err(|e| Failure::BadInput(e.to_string()))?;
        let name = self.path.display().to_string();
        let refuse = |what: String| {
            let advice = "accepted: the same command as before, or another -o, or without --resume";
            Err(Failure::BadInput(format!("{name}: is of another render: {what}; {advice}")))
        };
        if let Some(what) =
            difference((&name, &attributes), ("this command", &self.identity), |_| true)
        {
            return refuse(what);
        }
        if of != size || state.window != window {
            let (w, whole) = (state.window, format!("{} x {}", of[0], of[1]));
            return refuse(format!("it is of {whole} pixels and holds {w:?}"));
        }
        if state.first_sample != first_sample {
            return refuse(format!("it begins at sample {}", state.first_sample));
        }
        Ok(Some(state))
    }

    /// The picture is there: nothing is left to go on with.
    pub(super) fn remove(&self) {
        if let Err(error) = std::fs::remove_file(&self.path)
            && error.kind() != std::io::ErrorKind::NotFound
        {
            warn(&format!("{}: cannot be removed: {error}", self.path.display()));
        }
    }
}

/// Writes the state that a render ended with.
pub(super) fn write_end(
    path: &Path,
    rendered: &Rendered,
    state: &RenderState,
    attributes: Vec<Attribute>,
) -> Result<(), WriteError> {
    let blocks: Vec<_> = state.blocks.iter().collect();
    let view = StateView {
        film: &rendered.film,
        blocks: &blocks,
        first_sample: state.first_sample,
        passed: state.passed,
        rays: &rendered.rays,
        non_finite: &rendered.non_finite,
    };
    write_state(path, &view, attributes)
}

/// The command that goes on with this one.
pub(super) fn resuming_command() -> String {
    let arguments: Vec<String> =
        std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
    let quoted = |text: &String| {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,=:+%@".contains(c);
        if !text.is_empty() && text.chars().all(is_plain) {
            text.clone()
        } else {
            format!("'{}'", text.replace('\'', "'\\''"))
        }
    };
    let mut command: Vec<String> = arguments.iter().map(quoted).collect();
    if !arguments.iter().any(|argument| argument == "--resume") {
        command.push("--resume".to_owned());
    }
    command.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_all_samples_once() {
        for samples in [1, 5, 16, 60, 64, 1000, 1 << 20] {
            for count in [1, 2, 3, 5, 8, 16] {
                let ranges: Vec<_> =
                    (1..=count).map(|number| part_range(Part { number, count }, samples)).collect();
                if count > samples {
                    assert!(ranges.iter().all(Option::is_none));
                    continue;
                }
                let mut at = 0;
                for range in ranges.into_iter().flatten() {
                    assert_eq!(range.start, at, "{samples} in {count}");
                    assert!(!range.is_empty(), "{samples} in {count}");
                    at = range.end;
                }
                assert_eq!(at, samples);
            }
        }
    }
}
