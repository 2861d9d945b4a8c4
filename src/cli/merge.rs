//! `alhazen merge`: parts of a render to one picture, with the same bits as in one piece.

use std::time::Instant;

use super::args::MergeArgs;
use super::keep::{difference, part_range};
use super::outputs::{Output, check_format, check_targets, write_all};
use super::units::{Part, parse_part};
use super::{Failure, Outcome, job, print, report};
use crate::film::CenterLayers;
use crate::io::{Attribute, AttributeValue, StateFile, read_state};
use crate::render::{RenderState, Stop};

/// What a part says of itself beside what all have in common.
const OWN: [&str; 2] = ["alhazen.part", "alhazen.partOf"];

/// A part, by the file that it came from.
struct Piece {
    file: String,
    size: [u32; 2],
    state: RenderState,
    center: CenterLayers,
    attributes: Vec<Attribute>,
    part: Part,
    /// Samples of the whole.
    samples: u32,
}

pub(super) fn merge(args: &MergeArgs, start: Instant) -> Result<Outcome, Failure> {
    check_format(&args.format)?;
    let outputs: Vec<Output> =
        args.output.iter().cloned().map(Output::new).collect::<Result<_, _>>()?;
    check_targets(args.parts.iter().map(|p| p.as_path()), outputs.iter().map(|o| &o.path))?;
    let pool = job::thread_pool(args.threads)?;
    let bad = |message: String| Err(Failure::BadInput(message));

    // One part after the other, so that only two are in memory: the first pass looks at headers alone
    // where that were possible; states are joined in the order of their samples.
    let mut pieces = Vec::new();
    for path in &args.parts {
        let file =
            pool.install(|| read_state(path)).map_err(|e| Failure::BadInput(e.to_string()))?;
        pieces.push(piece(path.display().to_string(), file)?);
    }
    pieces.sort_by_key(|piece| (piece.state.first_sample, piece.part.number));
    let mut messages = Vec::new();
    let first = &pieces[0];
    for other in &pieces[1..] {
        let is_common = |name: &str| name != OWN[0];
        if let Some(what) = difference(
            (&first.file, &first.attributes),
            (&other.file, &other.attributes),
            is_common,
        ) {
            messages.push(format!("{}: is of another render: {what}", other.file));
        } else if first.size != other.size || first.state.window != other.state.window {
            messages
                .push(format!("{}: is of another size or crop than {}", other.file, first.file));
        }
    }
    if messages.is_empty() {
        messages = gaps(&pieces);
    }
    if !messages.is_empty() {
        return bad(messages.join("\n"));
    }

    let (size, common) = (first.size, first.attributes.clone());
    let mut pieces = pieces.into_iter();
    let Some(Piece { mut state, center, .. }) = pieces.next() else {
        return bad("no parts".to_owned());
    };
    for piece in pieces {
        let file = piece.file;
        let joined = pool.install(|| state.append(piece.state));
        joined
            .map_err(|_| Failure::BadInput(format!("{file}: does not follow the part before")))?;
    }
    let mut film = pool.install(|| state.film(size));
    film.layers.center = center;
    let samples = state.samples().end;
    let mut attributes: Vec<Attribute> =
        common.into_iter().filter(|a| !OWN.contains(&a.name.as_str())).collect();
    attributes.extend(report::outcome(&film, samples, Stop::Samples));
    if !args.quiet {
        let parts = args.parts.len();
        print(&format!("{:>10}  {parts} parts, {samples} samples per pixel", "merged"));
        print(&format!("{:>10}  {:.3} in all", "seconds", start.elapsed().as_secs_f64()));
    }
    pool.install(|| write_all(&outputs, &film, &attributes, &args.format, args.quiet))?;
    Ok(Outcome::Done)
}

fn piece(file: String, read: StateFile) -> Result<Piece, Failure> {
    let text = |name: &str| {
        let found = read.attributes.iter().find(|a| a.name == name);
        match found.map(|a| &a.value) {
            Some(AttributeValue::Text(text)) => Some(text.clone()),
            _ => None,
        }
    };
    let part = text(OWN[0]).and_then(|text| parse_part(&text).ok());
    let samples = text(OWN[1]).and_then(|text| text.parse().ok());
    let (Some(part), Some(samples)) = (part, samples) else {
        let message =
            "is a checkpoint of a whole render; accepted: files of `alhazen render --part`";
        return Err(Failure::BadInput(format!("{file}: {message}")));
    };
    let range = part_range(part, samples);
    let (has, complete) = (read.state.samples(), range.as_ref());
    let all_have = read.state.blocks.iter().all(|block| Some(block.sums.samples()) == complete);
    if Some(&has) != complete || !all_have {
        let message = format!(
            "{file}: part {}/{} is not finished; go on with it by --resume",
            part.number, part.count
        );
        return Err(Failure::BadInput(message));
    }
    let StateFile { size, state, center, attributes } = read;
    Ok(Piece { file, size, state, center, attributes, part, samples })
}

/// What is missing, and what is there twice.
fn gaps(pieces: &[Piece]) -> Vec<String> {
    let (count, samples) = (pieces[0].part.count, pieces[0].samples);
    let mut messages = Vec::new();
    let (mut at, mut before) = (0, None::<&Piece>);
    for piece in pieces {
        let range = piece.state.samples();
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
