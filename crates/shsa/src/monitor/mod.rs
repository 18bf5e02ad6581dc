//! `shsa monitor`: compares all ways of a variable over recorded observations.

mod method;
mod printer;

use crate::outcome::Outcome;
use crate::plan::find_variable;
use crate::reading::ReadArguments;
use crate::show::{self};
use anyhow::bail;
use method::{Method, Thesis, Watching};
use printer::Printer;
use shsa_core::engine::{WatchBudget, can_be_watched, witnesses};
use shsa_core::knowledge::{Id, KnowledgeBase, Shape, SignalId, VariableId};
use shsa_core::observation::Observation;
use shsa_core::plan::Graph;
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time};
use shsa_format::journal::is_journal_file;
use shsa_format::recording::{self, Recording};
use shsa_message::span::parse_span;
use shsa_report::recorded::wanted;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// The most steps: more indicate a wrong period, or a wrong time stamp.
const MOST_STEPS: i64 = 10_000_000;

/// Arguments of `shsa monitor`.
#[derive(clap::Args)]
#[command(
    after_help = "Example: shsa monitor models/rover.yaml v_dmin --observations run.jsonl --mode thesis --period 1s"
)]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// The variable in which all ways of knowing are compared.
    variable: String,
    /// The observations: a recording of any format.
    #[arg(long, value_name = "FILE")]
    observations: PathBuf,
    #[command(flatten)]
    reading: ReadArguments,
    /// How often a step is made.
    #[arg(long, value_name = "SPAN", default_value = "1s", value_parser = parse_span)]
    period: Span,
    /// Thesis mode: steps whose observations are combined [default: 1].
    #[arg(long, value_name = "N", value_parser = show::at_least_one)]
    buffer: Option<NonZeroUsize>,
    /// Thesis mode: errors over which the average is taken [default: 1].
    #[arg(long, value_name = "N", value_parser = show::at_least_one)]
    average: Option<NonZeroUsize>,
    /// Thesis mode: averages over which the median is taken [default: 1].
    #[arg(long, value_name = "N", value_parser = show::at_least_one)]
    median: Option<NonZeroUsize>,
    /// The method.
    #[arg(long, value_enum, default_value_t = Mode::Default)]
    mode: Mode,
    /// Print one JSON object a step, as lines.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Mode {
    /// The product's: per observation, three-valued, down to the signal.
    Default,
    /// The published method: periodic, all pairs of all outputs.
    Thesis,
}

/// Compares over all complete steps; the answer is no if nothing knows the variable.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let knowledge = show::load_model(&arguments.model)?;
    let variable = find_variable(&knowledge, &arguments.variable)?;
    refuse_vector(&knowledge, variable)?;
    let recording = read(arguments, &knowledge)?;
    let steps = Steps::of(&recording, arguments.period)?;
    let most = WatchBudget::default().ways;
    let runs = |way: &Way| can_be_watched(&knowledge, way);
    let ways = witnesses(&knowledge, &Graph::new(&knowledge), variable, most, runs).ways;
    let mut method: Box<dyn Method> = match arguments.mode {
        Mode::Thesis => Box::new(Thesis::new(&knowledge, ways, arguments)),
        Mode::Default => Box::new(Watching::new(&knowledge, ways)),
    };
    let ways = method.ways();
    match ways.len() {
        0 => {
            show::warn(format_args!("nothing in the model knows {}", arguments.variable));
            return Ok(Outcome::No);
        }
        1 => show::warn(format_args!("{} is known in one way only: nothing to compare", arguments.variable)),
        _ => {}
    }
    let mut printer = Printer::new(&knowledge, variable, arguments, recording.first());
    printer.head(&ways)?;
    step_through(&recording, steps, &mut *method, &mut printer)?;
    printer.foot(&ways)?;
    Ok(if recording.degraded { Outcome::Degraded } else { Outcome::Done })
}

/// Refuses a vector: vectors are compared only by numbers computed from them.
fn refuse_vector(knowledge: &KnowledgeBase, variable: VariableId) -> anyhow::Result<()> {
    let variable = &knowledge.variables()[variable];
    match variable.shape {
        Shape::Scalar => Ok(()),
        Shape::Vector => bail!("'{}' is a vector; name a number that follows from it", variable.name),
    }
}

fn read(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Recording> {
    let file = &arguments.observations;
    if is_journal_file(file) {
        bail!("{} is the journal of a run; `shsa replay` reads it", file.display());
    }
    let set = [arguments.buffer, arguments.average, arguments.median];
    if arguments.mode == Mode::Default && set.iter().any(Option::is_some) {
        show::warn("--buffer, --average and --median are for --mode thesis and change nothing here");
    }
    let recording =
        recording::read(std::slice::from_ref(file), &wanted(knowledge), &arguments.reading.options())?;
    show::recording(&recording);
    if recording.samples.is_empty() {
        bail!(
            "none of the model's signals is in the recording; `source` in the model says where each is found"
        );
    }
    Ok(recording)
}

/// The times of steps: every multiple of the period that is followed by an observation.
#[derive(Clone, Copy)]
struct Steps {
    first: Time,
    period: Span,
}

impl Steps {
    fn of(recording: &Recording, period: Span) -> anyhow::Result<Steps> {
        let start = recording.first().unwrap_or_default();
        let end = recording.samples.last().map_or(start, |sample| sample.received);
        let count = (end - start).0 / period.0;
        if count > MOST_STEPS {
            let seconds = (end - start).seconds();
            bail!(
                "{count} steps in {seconds:.0} s are too many (at most {MOST_STEPS}); give a longer --period"
            );
        }
        let late = start.0.rem_euclid(period.0);
        let wait = if late == 0 { 0 } else { period.0 - late };
        Ok(Steps { first: start + Span(wait), period })
    }
}

fn step_through(
    recording: &Recording,
    steps: Steps,
    method: &mut dyn Method,
    printer: &mut Printer<'_>,
) -> anyhow::Result<()> {
    let mut due = steps.first;
    for sample in &recording.samples {
        while sample.received > due {
            printer.step(&method.step(due))?;
            due = due + steps.period;
        }
        method.observe(&Observation {
            signal: SignalId::from_index(sample.wanted),
            stamp: sample.time,
            received: sample.received,
            value: sample.value.clone(),
        });
    }
    Ok(())
}
