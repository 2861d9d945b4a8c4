//! The command-line program. Everything is in [`alhazen::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    alhazen::cli::main(std::env::args_os())
}
