//! `alhazen merge`: parts of a render to one picture, with the same bits as in one piece.

use std::path::Path;
use std::time::Instant;

use super::args::MergeArgs;
use super::keep::{difference, part_range};
use super::outputs::{Output, check_format, check_targets, write_all};
use super::prepare::thread_pool;
use super::units::{Part, parse_part};
use super::{Failure, Outcome, print, report};
use crate::film::CenterLayers;
use crate::io::{Attribute, AttributeValue, StateFile, StateHead, read_state, read_state_head};
use crate::render::{BlockState, RenderState, Stop};

/// What a part says of itself beside what all have in common.
const OWN: [&str; 2] = ["alhazen.part", "alhazen.partOf"];

/// A part, as its file says.
struct Piece<'a> {
    path: &'a Path,
    file: String,
    head: StateHead,
    part: Part,
    /// Samples of the whole.
    samples: u32,
}

pub(super) fn merge(args: &MergeArgs, start: Instant) -> Result<Outcome, Failure> {
    check_format(&args.format)?;
    let outputs: Vec<Output> =
        args.output.iter().cloned().map(Output::new).collect::<Result<_, _>>()?;
    check_targets(args.parts.iter().map(|p| p.as_path()), outputs.iter().map(|o| &o.path))?;
    let pool = thread_pool(args.threads)?;

    // What they say is looked at before any sums are read, so that only two parts are ever in memory.
    let mut pieces: Vec<Piece<'_>> =
        args.parts.iter().map(|path| pool.install(|| piece(path))).collect::<Result<_, _>>()?;
    pieces.sort_by_key(|piece| (piece.head.samples.start, piece.part.number));
    let mut messages = strangers(&pieces);
    if messages.is_empty() {
        messages = gaps(&pieces);
    }
    if !messages.is_empty() {
        return Err(Failure::BadInput(messages.join("\n")));
    }

    let (first, others) = pieces.split_first().expect("the command line asks for one at least");
    let (mut state, center) = pool.install(|| sums(first))?;
    for piece in others {
        let (next, _) = pool.install(|| sums(piece))?;
        let joined = pool.install(|| state.append(next));
        joined.map_err(|_| {
            Failure::BadInput(format!("{}: does not follow the part before", piece.file))
        })?;
    }
    let mut film = pool.install(|| state.film(first.head.size));
    film.layers.center = center;
    let samples = state.samples().end;
    let common = first.head.attributes.iter().filter(|a| !OWN.contains(&a.name.as_str()));
    let mut attributes: Vec<Attribute> = common.cloned().collect();
    attributes.extend(report::outcome(&film, samples, Stop::Samples));
    if !args.quiet {
        let parts = args.parts.len();
        print(&format!("{:>10}  {parts} parts, {samples} samples per pixel", "merged"));
        print(&format!("{:>10}  {:.3} in all", "seconds", start.elapsed().as_secs_f64()));
    }
    pool.install(|| write_all(&outputs, &film, &attributes, &args.format, args.quiet))?;
    Ok(Outcome::Done)
}

fn piece(path: &Path) -> Result<Piece<'_>, Failure> {
    let file = path.display().to_string();
    let head = read_state_head(path).map_err(|e| Failure::BadInput(e.to_string()))?;
    let text = |name: &str| {
        let found = head.attributes.iter().find(|a| a.name == name);
        match found.map(|a| &a.value) {
            Some(AttributeValue::Text(text)) => Some(text.as_str()),
            _ => None,
        }
    };
    let part = text(OWN[0]).and_then(|text| parse_part(text).ok());
    let samples = text(OWN[1]).and_then(|text| text.parse().ok());
    let (Some(part), Some(samples)) = (part, samples) else {
        let message =
            "is a checkpoint of a whole render; accepted: files of `alhazen render --part`";
        return Err(Failure::BadInput(format!("{file}: {message}")));
    };
    let piece = Piece { path, file, head, part, samples };
    if part_range(part, samples).as_ref() == Some(&piece.head.samples) {
        Ok(piece)
    } else {
        Err(unfinished(&piece))
    }
}

fn unfinished(piece: &Piece<'_>) -> Failure {
    let Piece { file, part: Part { number, count }, .. } = piece;
    let message = "is not finished; go on with it by --resume";
    Failure::BadInput(format!("{file}: part {number}/{count} {message}"))
}

/// The sums of a part, and what the middles of its pixels show.
fn sums(piece: &Piece<'_>) -> Result<(RenderState, CenterLayers), Failure> {
    let StateFile { state, center, .. } =
        read_state(piece.path).map_err(|e| Failure::BadInput(e.to_string()))?;
    let has_all = |block: &BlockState| *block.sums.samples() == piece.head.samples;
    if state.blocks.iter().all(has_all) { Ok((state, center)) } else { Err(unfinished(piece)) }
}

/// Which parts are of another render than the first.
fn strangers(pieces: &[Piece<'_>]) -> Vec<String> {
    let Some((first, others)) = pieces.split_first() else { return Vec::new() };
    let message = |other: &Piece<'_>| {
        let is_common = |name: &str| name != OWN[0];
        let [a, b] = [first, other].map(|p| (p.file.as_str(), p.head.attributes.as_slice()));
        if let Some(what) = difference(a, b, is_common) {
            Some(format!("{}: is of another render: {what}", other.file))
        } else if (first.head.size, first.head.window) != (other.head.size, other.head.window) {
            Some(format!("{}: is of another size or crop than {}", other.file, first.file))
        } else {
            None
        }
    };
    others.iter().filter_map(message).collect()
}

/// What is missing, and what is there twice.
fn gaps(pieces: &[Piece<'_>]) -> Vec<String> {
    let (count, samples) = (pieces[0].part.count, pieces[0].samples);
    let mut messages = Vec::new();
    let (mut at, mut before) = (0, None::<&Piece<'_>>);
    for piece in pieces {
        let range = &piece.head.samples;
        if piece.part.count != count {
            let (file, of) = (&piece.file, piece.part.count);
            messages.push(format!("{file}: is of {of} parts, and {} of {count}", pieces[0].file));
        }
        if let Some(before) = before.filter(|_| range.start < at) {
            messages.push(format!(
                "{}: has samples {} to {} as {} has: a part is given twice",
                piece.file,
                range.start,
                at.min(range.end) - 1,
                before.file
            ));
        }
        at = at.max(range.end);
        before = Some(piece);
    }
    if !messages.is_empty() {
        return messages;
    }
    let there = |number| pieces.iter().any(|piece| piece.part.number == number);
    let missing: Vec<String> = (1..=count)
        .filter(|number| !there(*number))
        .filter_map(|number| {
            let range = part_range(Part { number, count }, samples)?;
            Some(format!("{number}/{count} (samples {} to {})", range.start, range.end - 1))
        })
        .collect();
    if !missing.is_empty() {
        messages.push(format!("parts are missing: {}", missing.join(", ")));
    }
    messages
}
