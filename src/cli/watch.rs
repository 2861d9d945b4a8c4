//! Watching a render: progress, checkpoints, a picture in tev, a preview on disk.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::keep::Keeper;
use super::progress::{Progress, interrupted};
use super::warn;
use crate::film::Film;
use crate::io::{TevImage, ToneMap, write_png};
use crate::render::{Observer, Snapshot};

/// How often tev is shown the picture.
pub(super) const TEV_EVERY: Duration = Duration::from_secs(1);

/// A clock that says when something is due, again and again.
pub(super) struct Schedule {
    every: Duration,
    start: Instant,
    /// In milliseconds from the start.
    due: AtomicU64,
}

impl Schedule {
    pub(super) fn new(every: Duration) -> Self {
        Self { every, start: Instant::now(), due: AtomicU64::new(every.as_millis() as u64) }
    }

    fn now(&self) -> u64 {
        self.start.elapsed().as_millis() as u64
    }

    fn is_due(&self) -> bool {
        self.now() >= self.due.load(Ordering::Relaxed)
    }

    /// Does it if it is due. Not more than about a tenth of the time goes into it.
    fn run(&self, what: impl FnOnce()) {
        if self.is_due() {
            let clock = Instant::now();
            what();
            let pause = self.every.max(10 * clock.elapsed());
            self.due.store(self.now() + pause.as_millis() as u64, Ordering::Relaxed);
        }
    }
}

/// A picture that is shown while it becomes.
pub(super) enum View {
    Tev {
        /// None once the viewer is gone.
        image: Mutex<Option<TevImage>>,
    },
    Preview {
        path: PathBuf,
        exposure: f32,
        tone_map: ToneMap,
    },
}

impl View {
    /// Shows how far it is.
    pub(super) fn show(&self, film: &Film) {
        match self {
            Self::Tev { image } => {
                let mut image = image.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some(shown) = image.as_mut()
                    && let Err(error) = shown.update(film)
                {
                    warn(&format!("tev: {error}; the render goes on without it"));
                    *image = None;
                }
            }
            Self::Preview { path, exposure, tone_map } => {
                if let Err(error) = write_png(path, film, *exposure, *tone_map) {
                    warn(&format!("no preview: {error}"));
                }
            }
        }
    }
}

/// Watches a render.
pub(super) struct Watch {
    pub(super) progress: Progress,
    pub(super) keeper: Option<(Schedule, Keeper)>,
    pub(super) views: Vec<(Schedule, View)>,
}

impl Observer for Watch {
    fn progress(&self, done: f64, rays: u64) {
        self.progress.report(done, rays);
    }

    fn error(&self, error: f64) {
        self.progress.report_error(error);
    }

    fn stop(&self) -> bool {
        interrupted()
    }

    fn wants_look(&self) -> bool {
        let schedules = self.keeper.iter().map(|(schedule, _)| schedule);
        schedules.chain(self.views.iter().map(|(schedule, _)| schedule)).any(Schedule::is_due)
    }

    fn look(&self, snapshot: &Snapshot<'_>) {
        if let Some((schedule, keeper)) = &self.keeper {
            schedule.run(|| keeper.keep(snapshot));
        }
        for (schedule, view) in &self.views {
            schedule.run(|| view.show(snapshot.film));
        }
    }
}
