//! `shsa bench`: measurements that anyone can repeat.

mod processor;
mod day;
mod live;
mod monitor;
mod scale;
mod thesis;
mod truth;

use crate::outcome::Outcome;

/// Arguments of `shsa bench`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa bench scale --sizes 1000,10000")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// How long a day of data takes, and how much memory.
    Day(day::Arguments),
    /// What healing costs on the wire: the gate, reactions, throughput, an hour of soak.
    Live(live::Arguments),
    /// What the monitor costs for each observation.
    Monitor(monitor::Arguments),
    /// How time and memory grow with the model.
    Scale(scale::Arguments),
    /// The experiments of the thesis with all searches.
    Thesis(thesis::Arguments),
    /// Whether calibration keeps its promise, on random plants with known truth.
    Truth(truth::Arguments),
}

/// Runs one benchmark.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match &arguments.command {
        Command::Day(arguments) => day::run(arguments),
        Command::Live(arguments) => live::run(arguments),
        Command::Monitor(arguments) => monitor::run(arguments),
        Command::Scale(arguments) => scale::run(arguments),
        Command::Thesis(arguments) => thesis::run(arguments),
        Command::Truth(arguments) => truth::run(arguments),
    }
}
