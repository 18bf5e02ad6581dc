//! `shsa-demos`: simulated systems that break and heal, shown as it happens.

#[path = "../../../crates/shsa/src/bus.rs"]
mod bus;
mod command;

use clap::Parser;
use command::Command;
use std::process::ExitCode;

/// Shows simulated systems that break and heal.
#[derive(Parser)]
#[command(version, after_help = "Example: shsa-demos rover --bus mqtt://127.0.0.1", max_term_width = 110)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// How a demonstration has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// As it should.
    Done,
    /// Something was not healed, or named wrongly.
    No,
}

/// Exit statuses are those of `shsa`: 0 done, 1 the answer is no, 2 bad input or usage.
fn main() -> ExitCode {
    match command::run(Arguments::parse().command) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::No) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
