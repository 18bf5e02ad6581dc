//! `shsa replay --compare`: compares all ways of knowing a variable over recordings, step by step.

mod method;
mod printer;

use crate::headings::COMPARISON;
use crate::outcome::Outcome;
use crate::plan::find_variable;
use crate::reading::ReadArguments;
use crate::show;
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
use shsa_message::span::parse_span;
use shsa_recording::Recording;
use shsa_report::recorded::wanted;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// The most steps: more indicate a wrong period, or a wrong time stamp.
const MOST_STEPS: i64 = 10_000_000;

/// How the ways of one variable are compared.
#[derive(clap::Args)]
pub(crate) struct Settings {
    /// The method: `default`, the product's, judges each observation, down to the signal; `thesis` is the published one, periodic,
    /// over all pairs of all outputs.
    #[arg(
        long,
        value_enum,
        default_value_t = Mode::Default,
        hide_possible_values = true,
        requires = "compare",
        help_heading = COMPARISON
    )]
    mode: Mode,
    /// How often a step is made.
    #[arg(long, value_name = "SPAN", default_value = "1s", value_parser = parse_span, requires = "compare", help_heading = COMPARISON)]
    period: Span,
    /// Thesis mode: steps whose observations are combined [default: 1].
    #[arg(long, value_name = "N", value_parser = show::at_least_one, requires = "compare", help_heading = COMPARISON)]
    buffer: Option<NonZeroUsize>,
    /// Thesis mode: errors over which the average is taken [default: 1].
    #[arg(long, value_name = "N", value_parser = show::at_least_one, requires = "compare", help_heading = COMPARISON)]
    average: Option<NonZeroUsize>,
    /// Thesis mode: averages over which the median is taken [default: 1].
    #[arg(long, value_name = "N", value_parser = show::at_least_one, requires = "compare", help_heading = COMPARISON)]
    median: Option<NonZeroUsize>,
}

/// Arguments of `shsa monitor`, which `shsa replay --compare` replaces.
#[derive(clap::Args)]
pub(crate) struct OldArguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// The variable in which all ways of knowing are compared.
    #[arg(id = "compare", value_name = "VARIABLE")]
    variable: String,
    /// The observations: a recording of any format.
    #[arg(long, value_name = "FILE")]
    observations: PathBuf,
    /// Print one JSON object a step, as lines.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    reading: ReadArguments,
}

/// A comparison of all ways of knowing one variable over recordings.
pub(crate) struct Comparison<'a> {
    pub(crate) model: &'a Path,
    /// The name of the variable.
    pub(crate) variable: &'a str,
    pub(crate) recordings: &'a [PathBuf],
    pub(crate) settings: &'a Settings,
    pub(crate) reading: &'a ReadArguments,
    /// Whether each step is printed as one JSON object instead of text.
    pub(crate) json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Mode {
    /// The product's: per observation, three-valued, down to the signal.
    Default,
    /// The published method: periodic, all pairs of all outputs.
    Thesis,
}

/// Compares as `shsa monitor` did.
pub(crate) fn monitor(arguments: &OldArguments) -> anyhow::Result<Outcome> {
    let OldArguments { model, variable, observations, json, settings, reading } = arguments;
    let recordings = std::slice::from_ref(observations);
    run(&Comparison { model, variable, recordings, settings, reading, json: *json })
}

/// Compares over all complete steps; the answer is no if nothing knows the variable.
///
/// # Errors
/// When the model or the recordings cannot be read, or the variable is none, or a vector.
pub(crate) fn run(comparison: &Comparison<'_>) -> anyhow::Result<Outcome> {
    let Comparison { variable: name, settings, .. } = comparison;
    let knowledge = show::load_model(comparison.model)?;
    let variable = find_variable(&knowledge, name)?;
    refuse_vector(&knowledge, variable)?;
    let recording = read(comparison, &knowledge)?;
    let steps = Steps::of(&recording, settings.period)?;
    let most = WatchBudget::default().ways;
    let runs = |way: &Way| can_be_watched(&knowledge, way);
    let ways = witnesses(&knowledge, &Graph::new(&knowledge), variable, most, runs).ways;
    let mut method: Box<dyn Method> = match settings.mode {
        Mode::Thesis => Box::new(Thesis::new(&knowledge, ways, settings)),
        Mode::Default => Box::new(Watching::new(&knowledge, ways)),
    };
    let ways = method.ways();
    match ways.len() {
        0 => {
            show::warn(format_args!("nothing in the model knows {name}"));
            return Ok(Outcome::No);
        }
        1 => show::warn(format_args!("{name} is known in one way only: nothing to compare")),
        _ => {}
    }
    let mut printer = Printer::new(&knowledge, variable, comparison, recording.first());
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

fn read(comparison: &Comparison<'_>, knowledge: &KnowledgeBase) -> anyhow::Result<Recording> {
    let Comparison { recordings, settings, reading, .. } = comparison;
    if let Some(journal) = recordings.iter().find(|file| is_journal_file(file)) {
        bail!("{} is the journal of a run; `shsa replay` reads it", journal.display());
    }
    let set = [settings.buffer, settings.average, settings.median];
    if settings.mode == Mode::Default && set.iter().any(Option::is_some) {
        show::warn("--buffer, --average and --median are for --mode thesis and change nothing here");
    }
    let recording = shsa_recording::read(recordings, &wanted(knowledge), &reading.options())?;
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
