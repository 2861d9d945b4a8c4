//! Progress: a bar on a terminal, a line now and then elsewhere, nothing when asked to be quiet.

use std::borrow::Cow;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::render::Observer;

/// Set by Ctrl-C and SIGTERM.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Steps of the bar.
const STEPS: u64 = 1000;

/// Seconds between lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// From now on Ctrl-C and SIGTERM ask for an end; a second one ends the program at once.
pub(super) fn catch_interrupts() {
    let caught = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            crate::io::remove_unfinished();
            std::process::exit(130);
        }
    });
    if let Err(error) = caught {
        super::tell(&format!("warning: Ctrl-C will end the program at once: {error}"));
    }
}

/// Whether an end was asked for.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Shows how one phase of the work goes.
pub(super) struct Progress {
    display: Display,
    phase: Cow<'static, str>,
    start: Instant,
    /// The error of the picture so far, as bits; NaN where it is not known.
    error: AtomicU64,
}

enum Display {
    Quiet,
    Bar(ProgressBar),
    /// When the last line was written.
    Lines(Mutex<Instant>),
}

impl Progress {
    pub(super) fn new(quiet: bool, phase: impl Into<Cow<'static, str>>) -> Self {
        let phase = phase.into();
        let display = if quiet {
            Display::Quiet
        } else if std::io::stderr().is_terminal() {
            let style = ProgressStyle::with_template(
                "{prefix:>9} [{bar:32}] {percent:>3} %  {elapsed}, {eta} left  {msg}",
            )
            .unwrap_or_else(|_| ProgressStyle::default_bar());
            let bar = ProgressBar::new(STEPS)
                .with_style(style.progress_chars("=> "))
                .with_prefix(phase.clone());
            Display::Bar(bar)
        } else {
            Display::Lines(Mutex::new(Instant::now()))
        };
        Self { display, phase, start: Instant::now(), error: AtomicU64::new(f64::NAN.to_bits()) }
    }

    /// The error of the picture so far.
    pub(super) fn report_error(&self, error: f64) {
        self.error.store(error.to_bits(), Ordering::Relaxed);
    }

    /// A share of the phase is done.
    pub(super) fn report(&self, done: f64, rays: u64) {
        let seconds = self.start.elapsed().as_secs_f64();
        let rate = || {
            if rays == 0 {
                return String::new();
            }
            let rate = format!("{:.1} Mrays/s", rays as f64 / seconds / 1e6);
            match f64::from_bits(self.error.load(Ordering::Relaxed)) {
                error if error.is_nan() => rate,
                error => format!("{rate}, error {:.2} %", 100.0 * error),
            }
        };
        match &self.display {
            Display::Quiet => {}
            Display::Bar(bar) => {
                bar.set_position((done * STEPS as f64) as u64);
                bar.set_message(rate());
            }
            Display::Lines(last) => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if last.elapsed() > LINE_EVERY {
                    *last = Instant::now();
                    let left = match seconds / done - seconds {
                        left if left.is_finite() => format!(", {left:.0} s left"),
                        _ => String::new(),
                    };
                    let (phase, percent) = (&self.phase, 100.0 * done);
                    super::tell(&format!("{phase}: {percent:.0} %{left} {}", rate()));
                }
            }
        }
    }

    pub(super) fn finish(&self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

impl Observer for Progress {
    fn progress(&self, done: f64, rays: u64) {
        self.report(done, rays);
    }

    fn stop(&self) -> bool {
        interrupted()
    }
}
