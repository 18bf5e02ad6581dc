//! The command `shsa`: arguments, subcommands, exit statuses.

mod analyze;
mod assure;
mod bus;
mod calibrate;
mod campaign;
mod check;
mod columns;
mod complete;
mod contingency;
mod convert;
mod demo;
mod doctor;
mod draft;
mod explain;
mod fmt;
mod help;
mod init;
mod info;
mod learn;
mod log;
mod man;
mod monitor;
mod outcome;
mod parts;
mod patch;
mod plan;
mod progress;
mod reading;
mod replay;
mod requirements;
mod run;
mod scan;
mod schema;
mod service;
mod service_manager;
mod show;
mod story;
mod top;
mod watch;
mod written;

use clap::{Parser, Subcommand};
use outcome::Outcome;
use std::process::ExitCode;

/// Heals the information that flows through robots, vehicles, buildings and plants.
///
/// From one knowledge base (variables, relations, signals, needs) it detects a signal that is wrong or silent, names it, and
/// provides the needed values from the other signals.
#[derive(Parser)]
#[command(version, after_help = STATUSES, max_term_width = 110, disable_help_subcommand = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const STATUSES: &str =
    "Exit status: 0 done; 1 the answer is no; 2 bad input or usage, nothing done; 3 done but degraded;
4 not reachable.
Reference: shsa help model, formulas, recordings, events, json.
Example: shsa demo rover --fast";

#[derive(Subcommand)]
enum Command {
    /// Load and check a knowledge base; report every problem with its place.
    Check(check::Arguments),
    /// Find substitutions for a variable, best first.
    Plan(plan::Arguments),
    /// Find which faults can be detected, isolated and healed, and which additions would help.
    Analyze(analyze::Arguments),
    /// Compose safety contracts: which sources may serve each need, at which level, why not higher; write the assurance case.
    Assure(assure::Arguments),
    /// Compare all ways of knowing a variable over recorded observations.
    Monitor(monitor::Arguments),
    /// List the content of recordings: topics, fields, units, rates, gaps, damages; or draft the signals of a model.
    Info(info::Arguments),
    /// Run the whole loop over recordings, optionally with injected faults.
    Replay(replay::Arguments),
    /// Heal a running system: read its bus, and publish the needed values.
    Run(run::Arguments),
    /// Show a running instance in the terminal: needs, signals, decisions.
    Top(top::Arguments),
    /// List the content of a bus: topics, fields, rates, and the signals of a model; or draft a model.
    Scan(scan::Arguments),
    /// Compute one value from others, as messages come: inputs, a formula, outputs.
    Service(service::Arguments),
    /// Explain why a signal was suspected: the evidence, the other candidates, what would have cleared it.
    Explain(explain::Arguments),
    /// Find what is wrong in recordings, without a model: which signals contradict the others, when, by how much.
    Doctor(doctor::Arguments),
    /// Draft a model from recordings: which columns are signals, which of them measure the same, with which numbers.
    Draft(draft::Arguments),
    /// Make a first model from recordings, with the answers to a few questions.
    Init(init::Arguments),
    /// Learn relations between the signals of recordings: fitted to one part of the time, kept where they hold in another.
    Learn(learn::Arguments),
    /// Learn errors, delays and offsets from healthy recordings, and test them on the later part.
    Calibrate(calibrate::Arguments),
    /// Try a grid of faults on recordings: which are detected, isolated, healed.
    Campaign(campaign::Arguments),
    /// Run stories: print the decisions with their reasons, and check the expectations.
    Story(story::Arguments),
    /// Watch a simulated system break and heal.
    Demo(demo::DemoArgs),
    /// Write a knowledge base in another form: YAML, JSON, Prolog, a drawing.
    Convert(convert::Arguments),
    /// Join the knowledge bases of subsystems.
    Join(parts::JoinArguments),
    /// Extract a part of a knowledge base, with all that it refers to.
    Part(parts::PartArguments),
    /// Format a knowledge base, with the comments kept.
    Fmt(fmt::Arguments),
    /// Apply a change to the file of a knowledge base, with the comments kept.
    Patch(patch::Arguments),
    /// Print the JSON Schema of models, for editors.
    Schema(schema::Arguments),
    /// Compute a substitute for `shsa run`, which starts it: tasks on standard input, answers on standard output.
    #[command(hide = true)]
    Substitute(run::SubstituteArguments),
    /// Print completions for a shell.
    Completions(complete::Arguments),
    /// Write a manual page for each command.
    Man(man::Arguments),
    /// Print the help of a command, or a page of the reference: model, formulas, recordings, events, json.
    Help(help::Arguments),
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = match arguments.command {
        Command::Check(arguments) => check::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Analyze(arguments) => analyze::run(&arguments),
        Command::Assure(arguments) => assure::run(&arguments),
        Command::Monitor(arguments) => monitor::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Run(arguments) => run::run(&arguments),
        Command::Top(arguments) => top::run(&arguments),
        Command::Scan(arguments) => scan::run(&arguments),
        Command::Service(arguments) => service::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Draft(arguments) => draft::run(&arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Learn(arguments) => learn::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Campaign(arguments) => campaign::run(&arguments),
        Command::Story(arguments) => story::run(&arguments),
        Command::Demo(arguments) if arguments.is_live() => run::run(&run::Arguments::of_the_robot()),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Join(arguments) => parts::join(&arguments),
        Command::Part(arguments) => parts::part(&arguments),
        Command::Substitute(arguments) => run::compute(&arguments),
        Command::Fmt(arguments) => fmt::run(&arguments),
        Command::Patch(arguments) => patch::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Completions(arguments) => complete::run(&arguments),
        Command::Man(arguments) => man::run(&arguments),
        Command::Help(arguments) => help::run(&arguments),
    };
    Outcome::from_result(outcome).into()
}
