//! `shsa-bench`: repeatable measurements of this project, and comparisons with recorded answers of other programs.

mod processor;
mod program;
mod structure;
mod table;
mod voter;
mod in_loop;
mod alignment;
mod charge;
mod coverage;
mod day;
mod generic;
mod learning;
mod live;
mod monitor;
mod navigation;
mod oracle;
mod reading;
mod rover;
mod scale;
mod thesis;
mod truth;
mod worlds;

use clap::Parser;
use std::process::ExitCode;

/// Measures how fast `shsa` is, how it grows, and whether its promises hold.
#[derive(Parser)]
#[command(version, after_help = "Example: shsa-bench scale --sizes 1000,10000", max_term_width = 110)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// What an input is worth at the time of a computation: its latest value, or its extrapolation.
    Alignment(alignment::Arguments),
    /// The state of charge of a cell, by counting, by its curve, and by fusion.
    Charge(charge::Arguments),
    /// How often values of recorded systems exclude what an independent witness says, and how far off they are while a sensor lies.
    Coverage(coverage::Arguments),
    /// How long a day of data takes, and how much memory.
    Day(day::Arguments),
    /// The thesis's generic experiments of faults of value and time.
    Generic(generic::Arguments),
    /// How long drafts and relations of many signals take, and how much memory.
    Learning(learning::Arguments),
    /// What healing costs on the wire: the gate, reactions, throughput, an hour of soak.
    Live(live::Arguments),
    /// What the monitor costs for each observation.
    Monitor(monitor::Arguments),
    /// Position and speed of a rover, by all methods of fusion.
    Navigation(navigation::Arguments),
    /// Our answers beside those that others have recorded.
    Oracle(oracle::Arguments),
    /// How long recordings take, beside the readers in Python.
    Reading(reading::Arguments),
    /// How soon the rover of the thesis detects and heals faults, by settings.
    Rover(rover::Arguments),
    /// How time and memory grow with the model.
    Scale(scale::Arguments),
    /// The experiments of the thesis with all searches.
    Thesis(thesis::Arguments),
    /// Whether calibration keeps its promise, on random plants with known truth.
    Truth(truth::Arguments),
    /// What the engine says of random systems with known truth.
    Worlds(worlds::Arguments),
}

/// The outcome of a benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// Done.
    Done,
    /// Done, and the answer to the question is no.
    No,
}

/// Exit statuses are those of `shsa`: 0 done, 1 the answer is no, 2 bad input or usage.
fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::No) => ExitCode::from(1),
        Err(error) => {
            notice(&format!("error: {error:#}"));
            ExitCode::from(2)
        }
    }
}

/// Writes a line to standard error.
fn notice(line: &str) {
    eprintln!("{line}");
}

/// Runs one benchmark.
fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match &arguments.command {
        Command::Alignment(arguments) => alignment::run(arguments),
        Command::Charge(arguments) => charge::run(arguments),
        Command::Coverage(arguments) => coverage::run(arguments),
        Command::Day(arguments) => day::run(arguments),
        Command::Generic(arguments) => generic::run(arguments),
        Command::Learning(arguments) => learning::run(arguments),
        Command::Live(arguments) => live::run(arguments),
        Command::Monitor(arguments) => monitor::run(arguments),
        Command::Navigation(arguments) => navigation::run(arguments),
        Command::Oracle(arguments) => oracle::run(arguments),
        Command::Reading(arguments) => reading::run(arguments),
        Command::Rover(arguments) => rover::run(arguments),
        Command::Scale(arguments) => scale::run(arguments),
        Command::Thesis(arguments) => thesis::run(arguments),
        Command::Truth(arguments) => truth::run(arguments),
        Command::Worlds(arguments) => worlds::run(arguments),
    }
}
