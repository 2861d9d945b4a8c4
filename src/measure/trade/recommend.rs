//! Settings that reach an error or keep to a time: put together from what each knob was measured to do,
//! then rendered and measured themselves.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::{
    Choice, Measured, Point, Trade, TradeError, TradeReport, build, reference_choice, three_digits,
};
use crate::scene::SceneDesc;

/// What settings are to reach.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// A relative error, bias included.
    Error(f64),
    /// Seconds from start to file written.
    Time(f64),
}

/// Settings for a target.
#[derive(Debug, Clone, Serialize)]
pub struct Recommendation {
    /// What for.
    pub target: Target,
    /// Flags of `alhazen render` beside the scene: those that were given, its size in pixels among them, and
    /// what the scene as it stands is to be changed by.
    pub flags: Vec<String>,
    /// Relative error against the reference, as measured with them.
    pub error: f64,
    /// Seconds in all, as measured with them.
    pub seconds: f64,
    /// Whether that reaches the target.
    pub is_reached: bool,
    /// How many settings were tried.
    pub tries: u32,
}

/// A choice of a knob, by what it does to the scene as it stands.
struct Turn<'a> {
    knob: &'static str,
    point: &'a Point,
    /// Seconds of the render, and squared sampling error, by those of the base.
    time: f64,
    noise: f64,
    /// Squared bias beyond the base's.
    bias: f64,
    /// Seconds of the build beyond the base's.
    build: f64,
}

/// The scene as it stands, in the same terms.
struct Model {
    samples: f64,
    seconds: f64,
    /// Seconds that do not depend on the samples.
    fixed: f64,
    /// Squared errors.
    noise: f64,
    bias: f64,
    /// Squared error by samples: minus the slope.
    power: f64,
}

impl Model {
    /// Samples for a squared error with some turns, and seconds in all; none where the bias alone is more.
    fn for_error(&self, squared: f64, turns: &[&Turn<'_>]) -> Option<(f64, f64)> {
        let left = squared - self.bias - turns.iter().map(|turn| turn.bias).sum::<f64>();
        // Half of it at least is for noise: a bias that is known badly must not decide.
        if left < 0.5 * squared {
            return None;
        }
        let noise = self.noise * turns.iter().map(|turn| turn.noise).product::<f64>();
        let samples = (self.samples * (noise / left).powf(1.0 / self.power)).max(1.0);
        Some((samples, self.seconds_of(samples, turns)))
    }

    fn seconds_of(&self, samples: f64, turns: &[&Turn<'_>]) -> f64 {
        let time = self.seconds * turns.iter().map(|turn| turn.time).product::<f64>();
        let build = turns.iter().map(|turn| turn.build).sum::<f64>();
        self.fixed + build + time * samples / self.samples
    }

    /// The squared error that can be reached in a time, and with how many samples.
    fn in_time(&self, seconds: f64, turns: &[&Turn<'_>]) -> Option<(f64, f64)> {
        let spare = seconds - self.seconds_of(0.0, turns);
        let per_sample = self.seconds_of(1.0, turns) - self.seconds_of(0.0, turns);
        let samples = (spare / per_sample).floor();
        if samples < 1.0 {
            return None;
        }
        let noise = self.noise * turns.iter().map(|turn| turn.noise).product::<f64>();
        let bias = self.bias + turns.iter().map(|turn| turn.bias).sum::<f64>();
        Some((samples, noise * (samples / self.samples).powf(-self.power) + bias))
    }
}

/// Most settings that are tried for a target.
const MOST_TRIES: u32 = 10;

/// What is aimed at, of an error: one render's differs from another's.
const AIM: f64 = 0.93;

/// What is aimed at, of a time.
const AIM_OF_TIME: f64 = 0.9;

/// What gains less than measurements scatter is not worth a flag.
const GAIN: f64 = 0.94;

/// Finds settings for a target, and tries them.
pub(super) fn recommend(
    trade: &Trade<'_>,
    report: &TradeReport,
    target: Target,
) -> Result<Recommendation, TradeError> {
    trade.observer.now("what is recommended");
    let base = &report.base;
    let model = Model {
        samples: f64::from(base.samples),
        seconds: base.seconds,
        fixed: base.build_seconds + trade.options.read_and_write,
        noise: base.sampling_error.unwrap_or(base.error).powi(2).max(1e-16),
        bias: base.bias.unwrap_or(0.0).powi(2),
        power: report.slope.map_or(1.0, |slope| -slope.power).clamp(0.5, 2.0),
    };
    let all = turns(report);
    let chosen = choose(&model, &all, target);
    let mut choice = base.choice.clone();
    for turn in &chosen {
        combine(&mut choice, turn);
    }
    // What to fall back on where a bias shows that no knob by itself had.
    let mut safer = vec![safest(trade.desc, report)];
    if !chosen.is_empty() {
        safer.push(base.choice.clone());
    }
    let first = match target {
        Target::Error(error) => model.for_error((AIM * error).powi(2), &chosen).map(|x| x.0),
        Target::Time(seconds) => model.in_time(AIM_OF_TIME * seconds, &chosen).map(|x| x.0),
    };
    let mut search = Search {
        target,
        power: model.power,
        // Not far beyond what was measured: the model is of small renders, whose times scatter.
        samples: first.unwrap_or(1.0).clamp(1.0, 8.0 * most_measured(report)),
        too_few: 0.0,
        enough: f64::INFINITY,
    };
    // Samples where the error is, where that was measured to pay: until the error that as many samples
    // everywhere are expected to have.
    let noise = model.noise * chosen.iter().map(|turn| turn.noise).product::<f64>();
    let is_adaptive = matches!(target, Target::Error(_)) && is_adaptive_cheaper(report);
    let mut best: Option<Recommendation> = None;
    for tries in 1..=MOST_TRIES {
        let samples = search.samples.clamp(1.0, f64::from(super::MOST_SAMPLES));
        if is_adaptive {
            let expected = noise * (samples / model.samples).powf(-model.power);
            (choice.error, choice.is_adaptive) = (Some(three_digits(expected.sqrt())), true);
        } else {
            choice.settings.samples = samples.ceil() as u32;
        }
        let (found, is_biased, taken) = attempt(trade, &choice, &base.choice, target, tries)?;
        if matches!(target, Target::Time(_)) {
            search.samples = f64::from(taken);
        }
        let (error, seconds, is_reached) = (found.error, found.seconds, found.is_reached);
        let is_better = best.as_ref().is_none_or(|best| match target {
            _ if best.is_reached != is_reached => is_reached,
            Target::Error(_) if is_reached => found.seconds < best.seconds,
            Target::Time(_) if !is_reached => found.seconds < best.seconds,
            _ => found.error < best.error,
        });
        if is_better {
            best = Some(found);
        }
        if is_biased
            && !is_reached
            && let Some(next) = safer.pop()
        {
            choice = next;
        } else if !search.step(error, seconds, is_reached) {
            break;
        }
    }
    Ok(best.expect("one try at least"))
}

/// A search for the least samples that reach an error, or the most that keep to a time.
struct Search {
    target: Target,
    power: f64,
    samples: f64,
    /// Known not to reach the error, or known to keep to the time.
    too_few: f64,
    /// The other way round.
    enough: f64,
}

impl Search {
    /// Goes on from what `samples` came to; false where nothing is left to gain.
    fn step(&mut self, error: f64, seconds: f64, is_reached: bool) -> bool {
        let now = self.samples;
        let next = match self.target {
            Target::Error(target) => {
                let factor = (error / (AIM * target)).powf(2.0 / self.power);
                if is_reached { now * factor.max(0.3) } else { now * factor.clamp(1.2, 8.0) }
            }
            Target::Time(target) => {
                let factor = AIM_OF_TIME * target / seconds;
                if is_reached { now * factor.min(3.0) } else { (now * factor.min(0.9)).floor() }
            }
        };
        let reaches_with_more = matches!(self.target, Target::Error(_));
        if is_reached == reaches_with_more {
            self.enough = self.enough.min(now);
        } else {
            self.too_few = self.too_few.max(now);
        }
        self.samples = next;
        // Within a tenth it is not worth another render.
        let is_new = next > 1.1 * self.too_few && next < 0.9 * self.enough;
        let is_needed = !is_reached || (next / now).ln().abs() > 0.2;
        next >= 1.0 && is_new && is_needed
    }
}

/// Renders and measures a choice; and whether it is bias, not noise, that is too much.
fn attempt(
    trade: &Trade<'_>,
    choice: &Choice,
    base: &Choice,
    target: Target,
    tries: u32,
) -> Result<(Recommendation, bool, u32), TradeError> {
    let start = Instant::now();
    let built = build(trade.desc, choice)?;
    // What takes longer than it may need not be waited for.
    let deadline = match target {
        Target::Time(most) => Some(start + Duration::from_secs_f64(1.5 * most)),
        Target::Error(_) => None,
    };
    let Measured { film, samples, .. } = trade.render_until(&built, deadline)?;
    let seconds = start.elapsed().as_secs_f64() + trade.options.read_and_write;
    let reference = trade.reference;
    let squared = (film.error_against(&reference.film).powi(2) - reference.error.powi(2)).max(0.0);
    let error = squared.sqrt();
    let (is_reached, is_biased) = match target {
        Target::Error(most) => {
            let noise = film.sampling_error().map_or(squared, |stated| stated.high.powi(2));
            (error <= most, squared - noise > 0.3 * most * most)
        }
        Target::Time(most) => (seconds <= most && samples >= choice.settings.samples, false),
    };
    let flags = with_given(&trade.options.given, choice.flags(base));
    Ok((Recommendation { target, flags, error, seconds, is_reached, tries }, is_biased, samples))
}

/// Flags of a choice beside those that were given, of which it replaces some.
fn with_given(given: &[Vec<String>], flags: Vec<String>) -> Vec<String> {
    let is_replaced = |name: &String| {
        // Samples that were given would end a render before it has an error.
        let replaced = |flag: &String| flag == name || (flag == "--error" && name == "--samples");
        // Of fields the last counts.
        name != "--set" && flags.iter().any(replaced)
    };
    let kept = given.iter().filter(|words| !words.first().is_some_and(is_replaced));
    kept.flatten().cloned().chain(flags.iter().cloned()).collect()
}

/// The scene as it stands with what its reference has of the knobs that matter to it.
fn safest(desc: &SceneDesc, report: &TradeReport) -> Choice {
    let mut choice = report.base.choice.clone();
    let from = reference_choice(desc, &choice).settings;
    let matters = |name: &str| report.knobs.iter().any(|knob| knob.name == name);
    let to = &mut choice.settings;
    if matters("max_depth") {
        to.max_depth = from.max_depth;
        (to.prune, to.roulette) = (from.prune, from.roulette);
    }
    if matters("tolerance") {
        to.tolerance = from.tolerance;
    }
    to.texture_filter = from.texture_filter;
    (to.precision, to.epsilon) = (from.precision, from.epsilon);
    choice
}

/// The most samples that anything was measured with.
fn most_measured(report: &TradeReport) -> f64 {
    let points = report.convergence.iter().chain([&report.base]);
    f64::from(points.map(|point| point.samples).max().unwrap_or(1))
}

/// Whether the same errors were reached in less time with samples where the error is.
fn is_adaptive_cheaper(report: &TradeReport) -> bool {
    let knob = report.knobs.iter().find(|knob| knob.name == "adaptive");
    let (pairs, _) = knob.map_or(&[][..], |knob| &knob.points).as_chunks::<2>();
    let is_cheaper = |[uniform, adaptive]: &[Point; 2]| {
        adaptive.bias.is_none() && adaptive.seconds < 0.9 * uniform.seconds
    };
    !pairs.is_empty() && pairs.iter().all(is_cheaper)
}

/// What each choice does, where it may be recommended.
fn turns(report: &TradeReport) -> Vec<Turn<'_>> {
    let base = &report.base;
    let noise_of = |point: &Point| point.sampling_error.map(|error| error.powi(2).max(1e-16));
    let mut turns = Vec::new();
    for knob in report.knobs.iter().filter(|knob| knob.effect != "look") {
        for point in knob.points.iter().filter(|point| point.choice.error.is_none()) {
            let (Some(noise), Some(own)) = (noise_of(point), noise_of(base)) else { continue };
            let bias = point.bias.unwrap_or(0.0).powi(2) - base.bias.unwrap_or(0.0).powi(2);
            turns.push(Turn {
                knob: knob.name,
                point,
                time: point.ratio,
                noise: noise / own,
                bias,
                build: point.build_seconds - base.build_seconds,
            });
        }
    }
    turns
}

/// The best turn of each knob by itself, together as far as the target allows.
fn choose<'t, 'a>(model: &Model, all: &'t [Turn<'a>], target: Target) -> Vec<&'t Turn<'a>> {
    // The smaller the better.
    let cost = |turns: &[&Turn<'_>]| match target {
        Target::Error(error) => {
            let found = model.for_error((AIM * error).powi(2), turns);
            found.map_or(f64::INFINITY, |(_, seconds)| seconds)
        }
        Target::Time(seconds) => {
            let found = model.in_time(0.9 * seconds, turns);
            found.map_or(f64::INFINITY, |(_, squared)| squared)
        }
    };
    let mut chosen: Vec<&Turn<'_>> = Vec::new();
    // The tree's pruning and roulette are one field, and a high build is one of fast queries.
    let group = |turn: &Turn<'_>| match turn.knob {
        "roulette" => "prune",
        "build_quality" => "precision",
        knob => knob,
    };
    loop {
        let now = cost(&chosen);
        let free = all.iter().filter(|turn| chosen.iter().all(|c| group(c) != group(turn)));
        let with = |turn: &'t Turn<'a>| {
            let mut turns = chosen.clone();
            turns.push(turn);
            (cost(&turns), turn)
        };
        let best = free.map(with).min_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((cost, turn)) if cost < GAIN * now || (now.is_infinite() && cost.is_finite()) => {
                chosen.push(turn);
            }
            _ => return chosen,
        }
    }
}

/// Turns a knob of `choice` as a measured one was.
fn combine(choice: &mut Choice, turn: &Turn<'_>) {
    let (to, from) = (&mut choice.settings, &turn.point.choice.settings);
    match turn.knob {
        "max_depth" => to.max_depth = from.max_depth,
        "prune" | "roulette" => (to.prune, to.roulette) = (from.prune, from.roulette),
        "shadow_samples" => to.shadow_samples = from.shadow_samples,
        "light_samples" => to.light_samples = from.light_samples,
        "tolerance" => to.tolerance = from.tolerance,
        "texture_filter" => to.texture_filter = from.texture_filter,
        "precision" => to.precision = from.precision,
        "epsilon" => to.epsilon = from.epsilon,
        "build_quality" => {
            (to.build_quality, to.precision) = (from.build_quality, from.precision);
        }
        "compact" => to.compact = from.compact,
        "accel" => choice.kind = turn.point.choice.kind,
        "packets" => choice.single_rays = turn.point.choice.single_rays,
        knob => debug_assert!(matches!(knob, "adaptive"), "{knob} is measured but never turned"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn flags_that_were_given_stay_unless_they_are_replaced() {
        let given: Vec<_> = [
            "--set camera.fov=30",
            "--size 64x48",
            "--samples 4",
            "--accel bvh",
            "--set render.prune=0.1",
        ]
        .map(words)
        .into();
        let joined = |flags: &str| with_given(&given, words(flags)).join(" ");
        assert_eq!(
            joined("--samples 9 --set render.prune=0"),
            "--set camera.fov=30 --size 64x48 --accel bvh --set render.prune=0.1 --samples 9 --set \
             render.prune=0"
        );
        assert_eq!(
            joined("--accel embree --error 0.01 --adaptive"),
            "--set camera.fov=30 --size 64x48 --set render.prune=0.1 --accel embree --error 0.01 --adaptive"
        );
        assert_eq!(with_given(&[], words("--samples 2")), words("--samples 2"));
    }
}
