//! The command line: flags as typed (`args.rs`), then what they mean together (a file for each command), progress,
//! reports, exit codes. The only room that prints.
//!
//! Exit codes: 0 done, 1 the render failed or a comparison exceeded a limit, 2 bad input or usage, 130
//! interrupted with a valid picture on disk.

mod args;
mod bench;
mod compare;
mod generate;
mod inspect;
mod keep;
mod merge;
mod outputs;
mod prepare;
mod progress;
mod render;
mod report;
mod trade;
mod units;
mod watch;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;

use args::{Args, Command};

/// Why the program ends without having done what it was asked for.
#[derive(Debug, thiserror::Error)]
enum Failure {
    /// The user must change something: a file, a flag.
    #[error("{0}")]
    BadInput(String),
    /// The work failed.
    #[error("{0}")]
    Failed(String),
    /// The user interrupted it before there was anything to keep.
    #[error("interrupted")]
    Interrupted,
}

impl Failure {
    const fn exit_code(&self) -> u8 {
        match self {
            Self::Failed(_) => 1,
            Self::BadInput(_) => 2,
            Self::Interrupted => 130,
        }
    }
}

/// How a command ended.
enum Outcome {
    Done,
    /// Interrupted, with a valid picture on disk.
    Interrupted,
}

/// Prints a line to standard output. That nobody listens any more is not worth an error.
fn print(line: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

/// Says something to the user, on standard error.
fn tell(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "alhazen: {line}");
}

/// Says what the user may want to mend, and goes on.
fn warn(text: &str) {
    tell(&format!("warning: {text}"));
}

/// Runs the program on `arguments`, of which the first is its own name.
pub fn main(arguments: impl Iterator<Item = OsString>) -> ExitCode {
    let start = Instant::now();
    let args = match Args::try_parse_from(arguments) {
        Ok(args) => args,
        Err(error) => {
            // Help goes to stdout with code 0, mistakes to stderr with code 2. A closed pipe is no error.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let result = match args.command {
        Command::Render(args) => render::render(&args, start),
        Command::Merge(args) => merge::merge(&args, start),
        Command::Inspect(args) => inspect::inspect(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::Bench(args) => bench::bench(&args),
        Command::Trade(args) => trade::trade(&args),
        Command::Generate(args) => generate::generate(&args),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Interrupted) => ExitCode::from(130),
        Err(failure) => {
            for line in failure.to_string().lines() {
                tell(line);
            }
            ExitCode::from(failure.exit_code())
        }
    }
}
