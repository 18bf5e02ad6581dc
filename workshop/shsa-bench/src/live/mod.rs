//! `shsa-bench live`: the costs of healing on the wire, measured with real components.

mod awake;
mod model;
mod times;
mod middleware;
mod plain;
mod subject;
mod traffic;
mod gate;
mod reaction;
mod throughput;
mod pages;
mod browser;
mod soak;
mod report;

use crate::Outcome;
use awake::Awake;
use gate::Gate;
use middleware::{Kind, Middleware};
use pages::Pages;
use reaction::Reaction;
use serde_json::Value;
use shsa_core::time::Span;
use soak::Soak;
use std::io::{Write, stdout};
use std::path::PathBuf;
use throughput::Throughput;

/// Arguments of `shsa-bench live`.
#[derive(clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    disable_help_subcommand = true,
    after_help = "Example: shsa-bench live --bus mqtt --part reaction
         shsa-bench live --bus mqtt --soak '1 h' --out workshop/measured

A broker (Mosquitto, which must be installed), a router of Zenoh and `shsa run` are started on free ports of 127.0.0.1, and \
ended. Other work on the machine shows in every figure."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    plain: Option<plain::Arguments>,
    /// On which middleware.
    #[arg(long, value_name = "BUS", value_delimiter = ',', value_enum, default_values = ["memory", "mqtt", "zenoh"])]
    bus: Vec<Kind>,
    /// What to measure.
    #[arg(long, value_name = "PART", value_delimiter = ',', value_enum, default_values = ["gate", "reaction", "throughput"])]
    part: Vec<Part>,
    /// How many seconds the gate is measured on each middleware, and again with the processors kept awake; a tenth of that
    /// each rate.
    #[arg(long, value_name = "SECONDS", default_value_t = 45.0, value_parser = turn)]
    seconds: f64,
    /// How many faults of each kind are made.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    faults: u32,
    /// Run for so long at an even rate instead, as `1 h`, and look at memory and latency; written to the same document, in a
    /// section of its own.
    #[arg(long, value_name = "TIME", value_parser = shsa_message::span::parse_span)]
    soak: Option<Span>,
    /// A Python with the package `playwright`: during the soak, the page of 200 signals is open in Chromium.
    #[arg(long, value_name = "PYTHON", requires = "soak")]
    browser: Option<PathBuf>,
    /// Messages a second of that.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    rate: u32,
    /// Write live.md, its plots and the raw results there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each measurement instead of tables.
    #[arg(long)]
    json: bool,
}

/// One of the measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// What passing a value through costs at 1 kHz.
    Gate,
    /// How soon a substitute is on the wire.
    Reaction,
    /// How many messages a second go through one instance.
    Throughput,
    /// What open pages cost the gate, not over memory.
    Pages,
}

fn turn(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("'{text}' is no number of seconds"))?;
    if (1.0..=3_600.0).contains(&seconds) { Ok(seconds) } else { Err("1 to 3600 seconds".to_owned()) }
}

/// All results except those of a soak.
#[derive(Default)]
struct Found {
    gates: Vec<Gate>,
    reactions: Vec<Reaction>,
    throughputs: Vec<Throughput>,
    pages: Vec<Pages>,
}

/// Measures.
///
/// # Errors
/// When a middleware is not installed, or a measurement fails.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match (&arguments.plain, arguments.soak) {
        (Some(plain), _) => plain::run(plain),
        (None, Some(length)) => soak(arguments, length),
        (None, None) => measure(arguments),
    }
}

fn measure(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut found = Found::default();
    for kind in &arguments.bus {
        for part in &arguments.part {
            found.add(arguments, *kind, *part)?;
        }
    }
    if !arguments.json {
        writeln!(stdout().lock(), "{}", report::text(&found))?;
    }
    if let Some(folder) = &arguments.out {
        report::write(folder, arguments, &found)?;
    }
    Ok(Outcome::Done)
}

impl Found {
    fn add(&mut self, arguments: &Arguments, kind: Kind, part: Part) -> anyhow::Result<()> {
        if part == Part::Pages && kind == Kind::Memory {
            crate::notice("memory, pages: left out, as no page is served within one process");
            return Ok(());
        }
        let middleware = Middleware::start(kind)?;
        crate::notice(&format!("{}, {part:?} ...", kind.name()).to_lowercase());
        let print = |line: Value| match arguments.json {
            true => writeln!(stdout().lock(), "{line}"),
            false => Ok(()),
        };
        match part {
            Part::Gate => {
                self.gates.push(gate::measure(&middleware, arguments.seconds, false)?);
                match Awake::keep() {
                    Ok(_awake) => self.gates.push(gate::measure(&middleware, arguments.seconds, true)?),
                    Err(why) => {
                        crate::notice(&format!("processors may not be kept awake ({why}): not measured"))
                    }
                }
                self.gates
                    .iter()
                    .filter(|gate| gate.kind == kind)
                    .try_for_each(|gate| print(gate.to_json()))?;
            }
            Part::Reaction => {
                for reaction in reaction::measure(&middleware, arguments.faults as usize)? {
                    print(reaction.to_json())?;
                    self.reactions.push(reaction);
                }
            }
            Part::Pages => {
                let pages = pages::measure(&middleware, arguments.seconds)?;
                print(pages.to_json())?;
                self.pages.push(pages);
            }
            Part::Throughput => {
                for step in throughput::climb(&middleware, arguments.seconds / 10.0)? {
                    print(step.to_json())?;
                    self.throughputs.push(step);
                }
            }
        }
        Ok(())
    }

    /// The results, one JSON object each.
    fn lines(&self) -> impl Iterator<Item = Value> {
        let gates = self.gates.iter().map(Gate::to_json);
        let reactions = self.reactions.iter().map(Reaction::to_json);
        gates
            .chain(reactions)
            .chain(self.throughputs.iter().map(Throughput::to_json))
            .chain(self.pages.iter().map(Pages::to_json))
    }
}

/// Soaks the chosen middleware if there is exactly one, else MQTT.
fn soak(arguments: &Arguments, length: Span) -> anyhow::Result<Outcome> {
    let kind = match arguments.bus.as_slice() {
        [only] => *only,
        _ => Kind::Mqtt,
    };
    let middleware = Middleware::start(kind)?;
    let soak = soak::measure(
        &middleware,
        length.seconds().max(2.0),
        f64::from(arguments.rate),
        arguments.browser.as_deref(),
    )?;
    match arguments.json {
        true => writeln!(stdout().lock(), "{}", soak.to_json())?,
        false => writeln!(stdout().lock(), "{}", report::soak_text(&soak))?,
    }
    if let Some(folder) = &arguments.out {
        report::write_soak(folder, arguments, &soak)?;
    }
    Ok(if soak.tally.lost() == 0 { Outcome::Done } else { Outcome::No })
}

/// The command line that repeats a soak.
fn soak_command(arguments: &Arguments, soak: &Soak) -> String {
    let bus = soak.kind.name().to_lowercase();
    format!(
        "shsa-bench live --bus {bus} --soak '{} s' --rate {} --out workshop/measured",
        soak.seconds, arguments.rate
    )
}
