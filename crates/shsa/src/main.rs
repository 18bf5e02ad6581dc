//! The command `shsa`: arguments, subcommands, exit statuses.

mod analyze;
mod assure;
mod bus;
mod calibrate;
mod campaign;
mod check;
mod columns;
mod compare;
mod complete;
mod contingency;
mod demo;
mod doctor;
mod draft;
mod explain;
mod groups;
mod headings;
mod help;
mod info;
mod journal;
mod learn;
mod log;
mod maintenance;
mod man;
mod model;
mod old;
mod outcome;
mod plan;
mod progress;
mod reading;
mod replay;
mod requirements;
mod run;
mod scan;
mod service;
mod service_manager;
mod show;
mod studio;
mod test;
mod top;
mod watch;
mod written;

use clap::{FromArgMatches, Parser, Subcommand};
use outcome::Outcome;
use std::process::ExitCode;

/// Finds the sensor that lies, and computes its value from the others.
#[derive(Parser)]
#[command(version, after_help = CLOSING, max_term_width = 110, disable_help_subcommand = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const CLOSING: &str = "\
Help on a command: shsa help COMMAND. Also: shsa man FOLDER, shsa completions SHELL.
Reference: shsa help model, formulas, recordings, events, json, cookbook, learning, needs.
Exit status: 0 done; 1 the answer is no; 2 bad input or usage, nothing done; 3 done but degraded;
4 not reachable.
Example: shsa demo rover --fast";

#[derive(Subcommand)]
enum Command {
    /// Watch a simulated system break and heal.
    Demo(demo::DemoArgs),
    /// Find what is wrong in a recording, without a model.
    Doctor(doctor::Arguments),
    /// Serve a page for the browser on which one drops a recording.
    Studio(studio::Arguments),
    /// Draft a model from recordings or from a bus.
    Draft(draft::Arguments),
    /// Check a model, and report every problem with its place.
    Check(check::Arguments),
    /// Find which faults can be detected, isolated and healed.
    Analyze(analyze::Arguments),
    /// List the content of recordings: topics, fields, units, rates.
    Info(info::Arguments),
    /// Run the whole loop over recordings, with injected faults if wanted.
    Replay(replay::Arguments),
    /// Explain why a signal was suspected.
    Explain(explain::Arguments),
    /// Fit the errors and delays of a model to healthy recordings.
    Calibrate(calibrate::Arguments),
    /// Learn relations between the signals of recordings.
    Learn(learn::Arguments),
    /// Try a grid of faults: which are detected, isolated, healed.
    Campaign(campaign::Arguments),
    /// Heal a running system: read its bus, publish the needed values.
    Run(run::Arguments),
    /// Show a running instance in the terminal.
    Top(top::Arguments),
    /// List what is on a bus, and which signals of a model are missing.
    Scan(scan::Arguments),
    /// Find whether the journal of a run was changed.
    Journal(journal::Arguments),
    /// Say from the journal what to replace, and what drifts.
    Maintenance(maintenance::Arguments),
    /// Compute one value from others, message by message.
    Service(service::Arguments),
    /// Convert, join, format and patch models; print their schema.
    Model(model::Arguments),
    /// Run stories, and check their expectations.
    Test(test::Arguments),
    /// Find substitutions for a variable, best first.
    Plan(plan::Arguments),
    /// Compose safety contracts, and write the assurance case.
    Assure(assure::Arguments),
    /// Compute a substitute for `shsa run`, which starts it: tasks on standard input, answers on standard output.
    #[command(hide = true)]
    Substitute(run::SubstituteArguments),
    /// Print completions for a shell.
    Completions(complete::Arguments),
    /// Write a manual page for each command.
    Man(man::Arguments),
    /// Print the help of a command, or a page of the reference.
    Help(help::Arguments),
    // Old names, which `old` hides.
    /// Run stories, and check their expectations.
    Story(test::Arguments),
    /// Make a first model from recordings, with the answers to a few questions.
    Init(draft::OldArguments),
    /// Compare all ways of knowing a variable over recordings.
    Monitor(compare::OldArguments),
    #[command(flatten)]
    OfModel(model::Command),
}

fn main() -> ExitCode {
    let matches = groups::command().get_matches();
    matches.subcommand_name().into_iter().for_each(old::note_command);
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let outcome = match arguments.command {
        Command::Demo(arguments) if arguments.is_live() => run::run(&run::Arguments::of_the_robot()),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Studio(arguments) => studio::run(&arguments),
        Command::Draft(arguments) => draft::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Analyze(arguments) => analyze::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Maintenance(arguments) => maintenance::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Learn(arguments) => learn::run(&arguments),
        Command::Campaign(arguments) => campaign::run(&arguments),
        Command::Run(arguments) => run::run(&arguments),
        Command::Top(arguments) => top::run(&arguments),
        Command::Scan(arguments) => scan::run(&arguments),
        Command::Journal(arguments) => journal::run(&arguments),
        Command::Service(arguments) => service::run(&arguments),
        Command::Model(arguments) => model::run(&arguments),
        Command::Test(arguments) | Command::Story(arguments) => test::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Assure(arguments) => assure::run(&arguments),
        Command::Substitute(arguments) => run::compute(&arguments),
        Command::Completions(arguments) => complete::run(&arguments),
        Command::Man(arguments) => man::run(&arguments),
        Command::Help(arguments) => help::run(&arguments),
        Command::Init(arguments) => draft::init(&arguments),
        Command::Monitor(arguments) => compare::monitor(&arguments),
        Command::OfModel(command) => command.run(),
    };
    Outcome::from_result(outcome).into()
}
