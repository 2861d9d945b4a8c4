//! When a render is over: after so many samples, at an error, or at a time; and the counts of samples at
//! which that is asked.

use std::time::{Duration, Instant};

use crate::sampler::REPLICATES;

/// The rules that end a render; whichever holds first does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopRules {
    /// Samples of every pixel.
    pub samples: u32,
    /// Relative sampling error of the picture, as [`crate::film::Film::relative_error`] estimates it.
    pub error: Option<f64>,
    /// When the last sample must have been taken. The first sample of every pixel is taken in any case.
    pub deadline: Option<Instant>,
}

/// Which rule ended a render.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// All samples were taken.
    Samples,
    /// The error is as small as it was to be.
    Error,
    /// The next samples would have come too late.
    Time,
    /// The observer ended it.
    Interrupted,
}

impl Stop {
    /// The name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Error => "error",
            Self::Time => "time",
            Self::Interrupted => "interrupted",
        }
    }
}

/// Fewest samples that an error is believed of: two of each replicate. With one, a small light that no
/// sample has met yet looks like a picture without noise.
const LEAST_FOR_ERROR: u32 = 2 * REPLICATES;

impl StopRules {
    /// Whether anything but the number of samples can end it.
    pub(super) fn look_at_the_film(&self) -> bool {
        self.error.is_some() || self.deadline.is_some()
    }

    /// The count of samples at which rules are asked next: half way to where it is likely to end, as each
    /// pass over the picture costs, but no further than twice as far. Without a deadline it follows from
    /// the picture alone, so that where a render stops by its error does not depend on the machine.
    pub(super) fn next(&self, so_far: &SoFar) -> u32 {
        if !self.look_at_the_film() {
            return self.samples;
        }
        let done = so_far.samples;
        let by_error = match (self.error, so_far.expected_by_error(self.error)) {
            (None, _) => f64::INFINITY,
            (Some(_), n) => n.unwrap_or(0.0),
        };
        let goal = by_error.min(so_far.expected_by_time(self.deadline).unwrap_or(f64::INFINITY));
        let most = (0.5 * (f64::from(done) + goal)).min(2.0 * f64::from(done));
        last_barrier(done, most).min(self.samples)
    }

    /// How far to go on the way to `target` before the next look at the clock: as many samples as
    /// `pass_time` allows.
    pub(super) fn limit(&self, so_far: &SoFar, target: u32, pass_time: Option<Duration>) -> u32 {
        let (done, per_sample) = (so_far.samples, so_far.per_sample.as_secs_f64());
        let most = match pass_time {
            // Of a render that goes on nothing is known yet.
            _ if per_sample == 0.0 && (pass_time.is_some() || self.deadline.is_some()) => 0.0,
            Some(time) => f64::from(done) + time.as_secs_f64() / per_sample,
            None => return target,
        };
        last_barrier(done, most).min(target)
    }

    /// The rule that ends a render, if one does.
    pub(super) fn end(&self, so_far: &SoFar) -> Option<Stop> {
        let done = so_far.samples;
        if let Some((wanted, error)) = self.error.zip(so_far.believed_error())
            && error <= wanted
        {
            return Some(Stop::Error);
        }
        if done >= self.samples {
            return Some(Stop::Samples);
        }
        self.is_late(so_far).then_some(Stop::Time)
    }

    /// Whether not even the next few samples can be taken in time.
    pub(super) fn is_late(&self, so_far: &SoFar) -> bool {
        let least = f64::from(barrier_after(so_far.samples).min(self.samples));
        so_far.expected_by_time(self.deadline).is_some_and(|n| n < least)
    }

    /// How many samples it will be, as far as can be told.
    pub(super) fn expected(&self, so_far: &SoFar) -> f64 {
        let by_error = so_far.expected_by_error(self.error);
        let rules = [by_error, so_far.expected_by_time(self.deadline)].into_iter().flatten();
        rules.fold(f64::from(self.samples), f64::min).max(f64::from(so_far.samples))
    }
}

/// How far a render is.
#[derive(Debug, Clone, Copy)]
pub(super) struct SoFar {
    /// Samples that every pixel has.
    pub(super) samples: u32,
    /// The error of the picture, where a rule asks for it and it shows one.
    pub(super) error: Option<f64>,
    /// What a sample of all pixels took lately.
    pub(super) per_sample: Duration,
}

impl SoFar {
    pub(super) const NOTHING: Self =
        Self { samples: 0, error: None, per_sample: Duration::from_secs(0) };

    fn believed_error(&self) -> Option<f64> {
        self.error.filter(|_| self.samples >= LEAST_FOR_ERROR)
    }

    /// Errors fall with the root of the number of samples.
    fn expected_by_error(&self, wanted: Option<f64>) -> Option<f64> {
        let (wanted, error) = wanted.zip(self.believed_error())?;
        Some(f64::from(self.samples) * (error / wanted).powi(2))
    }

    /// A tenth is kept back, as samples do not all take equally long.
    fn expected_by_time(&self, deadline: Option<Instant>) -> Option<f64> {
        let left = deadline?.saturating_duration_since(Instant::now()).as_secs_f64();
        Some(f64::from(self.samples) + left / (1.1 * self.per_sample.as_secs_f64().max(1e-9)))
    }
}

/// 1, 2, 4, and from there on multiples of the replicates, an eighth of the last power of two apart: few
/// nodes of the tree of sums are then open.
pub(super) fn barrier_after(done: u32) -> u32 {
    let each = done / REPLICATES;
    if each == 0 {
        return (2 * done).clamp(1, REPLICATES);
    }
    let step = (1 << each.ilog2() >> 3).max(1);
    (each / step + 1) * step * REPLICATES
}

/// The last such count that is not above `most`; at least the next one.
pub(super) fn last_barrier(done: u32, most: f64) -> u32 {
    let mut to = barrier_after(done);
    loop {
        let further = barrier_after(to);
        if f64::from(further) > most {
            return to;
        }
        to = further;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn barriers_are_close_and_few() {
        let mut counts = vec![0];
        while counts[counts.len() - 1] < 1 << 20 {
            counts.push(barrier_after(counts[counts.len() - 1]));
        }
        assert_eq!(counts[..8], [0, 1, 2, 4, 8, 12, 16, 20]);
        for pair in counts.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            assert!(a < b, "{a} {b}");
            if a >= REPLICATES {
                assert!(b.is_multiple_of(REPLICATES));
                assert!(b - a <= (a / 8).max(REPLICATES), "{a} {b}");
            }
            assert!((b / REPLICATES).count_ones() <= 4, "{b}");
        }
    }

    #[test]
    fn the_first_rule_that_holds_ends_it() {
        let rules = StopRules { samples: 64, error: Some(0.01), deadline: None };
        let so_far = |samples, error, per_sample| SoFar {
            samples,
            error,
            per_sample: Duration::from_secs(per_sample),
        };
        assert_eq!(rules.end(&so_far(32, Some(0.02), 0)), None);
        assert_eq!(rules.end(&so_far(32, Some(0.01), 0)), Some(Stop::Error));
        assert_eq!(rules.end(&so_far(4, Some(0.0), 0)), None, "too few to tell");
        assert_eq!(rules.end(&so_far(32, None, 0)), None);
        assert_eq!(rules.end(&so_far(64, Some(0.5), 0)), Some(Stop::Samples));
        let in_ten = Instant::now() + Duration::from_secs(10);
        let rules = StopRules { error: None, deadline: Some(in_ten), ..rules };
        // Four more samples are the least: of two seconds each they fit, of three they do not.
        assert_eq!(rules.end(&so_far(32, None, 2)), None);
        assert_eq!(rules.end(&so_far(32, None, 3)), Some(Stop::Time));
    }

    #[test]
    fn passes_go_half_the_way() {
        let rules = StopRules { samples: 1 << 20, error: Some(0.01), deadline: None };
        let next = |samples, error| rules.next(&SoFar { samples, error, ..SoFar::NOTHING });
        assert_eq!([next(0, None), next(1, None), next(4, Some(0.5))], [1, 2, 8]);
        // A hundred times as many: twice as far. Four times: there too. 1.5 times: a quarter further.
        assert_eq!(next(32, Some(0.1)), 64);
        assert_eq!(next(32, Some(0.02)), 64);
        assert_eq!(next(32, Some(0.01 * 1.5f64.sqrt())), 40);
        // Nearly there: the least step.
        assert_eq!(next(32, Some(0.0101)), 36);
        assert_eq!(
            StopRules { samples: 50, ..rules }.next(&SoFar {
                samples: 32,
                error: Some(0.1),
                ..SoFar::NOTHING
            }),
            50
        );
        let deadline = Some(Instant::now() + Duration::from_secs(1000));
        let rules = StopRules { samples: 1 << 20, error: None, deadline };
        let so_far = SoFar { samples: 64, error: None, per_sample: Duration::from_secs(10) };
        // Some 90 samples fit: 45 of them.
        assert_eq!(rules.next(&so_far), 104);
    }
}
