//! `shsa model`: commands that read models and write models.

mod convert;
mod fmt;
mod parts;
mod same;
pub(crate) mod patch;
mod schema;

use crate::outcome::Outcome;
use clap::Subcommand;

/// Arguments of `shsa model`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa model convert models/rover.yaml -o rover.svg

The language of models: shsa help model, shsa help formulas.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// What is done with models.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Write a model in another form: YAML, JSON, Prolog, Turtle, or a drawing.
    Convert(convert::Arguments),
    /// Join the models of subsystems.
    Join(parts::JoinArguments),
    /// Extract a part of a model, with everything that it refers to.
    Part(parts::PartArguments),
    /// Format models; comments are kept.
    Fmt(fmt::Arguments),
    /// Apply a change to the file of a model; comments are kept.
    Patch(patch::Arguments),
    /// Print the JSON Schema of models, for editors.
    Schema(schema::Arguments),
}

/// Runs the command that was given.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    arguments.command.run()
}

impl Command {
    /// Runs it.
    pub(crate) fn run(&self) -> anyhow::Result<Outcome> {
        match self {
            Command::Convert(arguments) => convert::run(arguments),
            Command::Join(arguments) => parts::join(arguments),
            Command::Part(arguments) => parts::part(arguments),
            Command::Fmt(arguments) => fmt::run(arguments),
            Command::Patch(arguments) => patch::run(arguments),
            Command::Schema(arguments) => schema::run(arguments),
        }
    }
}
