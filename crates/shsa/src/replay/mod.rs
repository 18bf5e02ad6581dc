//! `shsa replay`: the whole loop over recordings, with faults injected if wanted.

mod drive;
mod report;
mod written;

use crate::outcome::Outcome;
use crate::plan::find_signal;
use crate::show;
use anyhow::{Context, bail};
use drive::drive;
use shsa_core::engine::Input;
use shsa_core::knowledge::{Id, KnowledgeBase, SignalId};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};
use shsa_format::drive::Run;
use shsa_format::fault::Fault;
use shsa_format::journal::{self, JournalWriter};
use shsa_format::recording::{self, ReadOptions, Recording, Wanted, parse_span};
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `shsa replay`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa replay models/car.yaml drive/ --inject bias=2:wheel_1@20s..

Faults: KIND[=AMOUNT]:SIGNAL@FROM..TO
  stuck, stuck=1.5  the value stays, or is this one
  bias=2            this is added
  drift=0.1         this is added for every second
  noise=0.5         up to plus or minus this is added
  spike=5           this is added to one value in ten
  scale=1.3         multiplied by this
  spoof=3           this comes instead
  delay=600ms       comes later, with its old time stamp
  drop              nothing comes
Times count from the first observation; FROM and TO may be left out. Amounts are in the signal's unit.")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Recordings: CSV, JSON lines, ROS 1 bags, folders of them; or the journal of an earlier run.
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// A fault to inject; may be given several times.
    #[arg(long, value_name = "FAULT")]
    inject: Vec<Fault>,
    /// Seed of what is random in faults.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The column with the time, where a CSV file's header does not tell.
    #[arg(long, value_name = "NAME")]
    time_column: Option<String>,
    /// What one step of the time column is: s, ms, us, ns or a span such as 5s.
    #[arg(long, value_name = "UNIT", value_parser = parse_span)]
    time_unit: Option<Span>,
    /// Write every input of the run as a journal that can be replayed.
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
    /// Write every value that the needs are served with, as JSON lines.
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Replays and reports; the answer is no when a need was unmet.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let knowledge = show::load_model(&arguments.model)?;
    let source = read(arguments, &knowledge)?;
    let read: Vec<&PathBuf> = arguments.recordings.iter().chain([&arguments.model]).collect();
    let [journal, output] =
        written::open([arguments.journal.as_deref(), arguments.output.as_deref()], &read)?;
    let began = Instant::now();
    let run = play(&knowledge, &source, journal)?;
    let elapsed = began.elapsed();
    let clean =
        source.clean.as_ref().map(|inputs| drive(&knowledge, inputs, source.span, |_| Ok(()))).transpose()?;
    if let Some(output) = output {
        report::write_values(&knowledge, &run, output)?;
    }
    let report = report::Report::new(&knowledge, &run, clean.as_ref(), &source);
    report.print(arguments.json, elapsed)?;
    Ok(match (report.all_met(), source.degraded) {
        (false, _) => Outcome::No,
        (true, true) => Outcome::Degraded,
        (true, false) => Outcome::Done,
    })
}

/// What is to be replayed.
struct Source {
    inputs: Vec<Input>,
    /// The same without the injected faults, to compare with.
    clean: Option<Vec<Input>>,
    /// When the recording begins and ends, even if a fault has taken its first or last observations away.
    span: Option<(Time, Time)>,
    /// Rows without a value, for each signal.
    missing: Vec<usize>,
    degraded: bool,
}

fn read(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Source> {
    match arguments.recordings.as_slice() {
        [only] if is_journal(only) => read_journal(only, arguments, knowledge),
        _ => read_recordings(arguments, knowledge),
    }
}

/// What is looked for in recordings: every signal of the model.
pub(crate) fn wanted(knowledge: &KnowledgeBase) -> Vec<Wanted> {
    knowledge.signals().iter().map(|signal| Wanted::new(signal.name.clone(), signal.source.clone())).collect()
}

/// Whether a file is the journal of a run.
pub(crate) fn is_journal(path: &Path) -> bool {
    let mut line = String::new();
    path.is_file()
        && File::open(path).is_ok_and(|file| {
            let limited = std::io::Read::take(file, 1 << 20);
            BufReader::new(limited).read_line(&mut line).is_ok() && journal::is_journal(&line)
        })
}

fn read_journal(path: &Path, arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Source> {
    if !arguments.inject.is_empty() {
        bail!("a journal is replayed as it was; faults can be injected into recordings only");
    }
    let file = File::open(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let journal = journal::read_journal(BufReader::new(file), knowledge)
        .with_context(|| format!("{} cannot be replayed", path.display()))?;
    if let Some((line, reason)) = &journal.damage {
        show::warn(format_args!("{}:{line}: {reason}; what comes before is replayed", path.display()));
    }
    let missing = vec![0; knowledge.signals().len()];
    Ok(Source {
        inputs: journal.inputs,
        clean: None,
        span: None,
        missing,
        degraded: journal.damage.is_some(),
    })
}

fn read_recordings(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Source> {
    let wanted = wanted(knowledge);
    let options = ReadOptions { time_column: arguments.time_column.clone(), time_scale: arguments.time_unit };
    let targets: Vec<usize> =
        arguments.inject.iter().map(|fault| target(knowledge, fault)).collect::<anyhow::Result<_>>()?;
    let mut recording = recording::read(&arguments.recordings, &wanted, &options)?;
    recording.warnings.iter().for_each(show::warn);
    if recording.samples.is_empty() {
        bail!(
            "none of the model's signals is in the recording; `source` in the model says where each is found"
        );
    }
    let received = |sample: &recording::Sample| sample.received;
    let span = recording.samples.first().map(received).zip(recording.samples.last().map(received));
    let first = span.map_or(Time(0), |(first, _)| first);
    let clean = (!arguments.inject.is_empty()).then(|| inputs(&recording));
    for (number, (fault, &target)) in arguments.inject.iter().zip(&targets).enumerate() {
        if !strikes(fault, &recording, target, first) {
            show::warn(format_args!(
                "the fault of {} changes nothing: no observation of it in that time",
                fault.signal
            ));
        }
        fault.inject(&mut recording.samples, target, first, arguments.seed.wrapping_add(number as u64));
    }
    let missing = recording.found.iter().map(|found| found.missing).collect();
    Ok(Source { inputs: inputs(&recording), clean, span, missing, degraded: recording.degraded })
}

fn target(knowledge: &KnowledgeBase, fault: &Fault) -> anyhow::Result<usize> {
    let signal = find_signal(knowledge, &fault.signal).context("no fault can be injected")?;
    Ok(signal.index())
}

/// Whether there is an observation that the fault can change.
fn strikes(fault: &Fault, recording: &Recording, target: usize, first: Time) -> bool {
    let hit = |sample: &recording::Sample| {
        let since = sample.received - first;
        sample.wanted == target && since >= fault.from && fault.to.is_none_or(|to| since < to)
    };
    recording.samples.iter().any(hit)
}

fn inputs(recording: &Recording) -> Vec<Input> {
    let observation = |sample: &recording::Sample| Observation {
        signal: SignalId::from_index(sample.wanted),
        stamp: sample.time,
        received: sample.received,
        value: sample.value.clone(),
    };
    let observations: Vec<Observation> = recording.samples.iter().map(observation).collect();
    observations.into_iter().map(Input::Observation).collect()
}

fn play(knowledge: &KnowledgeBase, source: &Source, journal: Option<BufWriter<File>>) -> anyhow::Result<Run> {
    let Source { inputs, span, .. } = source;
    let Some(journal) = journal else { return drive(knowledge, inputs, *span, |_| Ok(())) };
    let mut journal = JournalWriter::new(journal, knowledge)?;
    let run = drive(knowledge, inputs, *span, |input| Ok(journal.record(input)?))?;
    journal.flush()?;
    Ok(run)
}
