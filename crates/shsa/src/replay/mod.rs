//! `shsa replay`: the whole loop over recordings, with faults injected if wanted.

mod drive;
mod reload;
mod report;
pub(crate) mod written;

use crate::outcome::Outcome;
use crate::plan::find_signal;
use crate::show;
use crate::watch::Watching;
use anyhow::{Context, bail};
use drive::drive;
use reload::{Reload, Stage};
use shsa_core::engine::{Input, Options};
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};
use shsa_format::drive::{Era, Run};
use shsa_format::fault::Fault;
use shsa_format::journal::{self, JournalWriter};
use shsa_format::model::live::Live;
use shsa_format::recording::{self, ReadOptions, Recording, Wanted, parse_span};
use std::collections::BTreeMap;
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
Times count from the first observation; FROM and TO may be left out. Amounts are in the signal's unit.

--reload FILE@TIME changes the model while it is in use. A file with the key `shsa` is a whole model and takes the \
place of the old one. Any other is a change: its entries are added, or replace those of the same name, and null \
removes, as in `relations: { turn: null, double: \"y = 2 * x\" }`. A file with errors changes nothing (exit status 3).")]
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
    /// A file that changes the model at this time, such as new.yaml@20s; may be given several times.
    #[arg(long, value_name = "FILE@TIME")]
    reload: Vec<Reload>,
    #[command(flatten)]
    watching: Watching,
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
    let live = show::load_live(&arguments.model)?;
    let source = read(arguments, live)?;
    let reloads = arguments.reload.iter().map(|reload| &reload.path);
    let read: Vec<&PathBuf> = arguments.recordings.iter().chain([&arguments.model]).chain(reloads).collect();
    let [journal, output] =
        written::open([arguments.journal.as_deref(), arguments.output.as_deref()], &read)?;
    let began = Instant::now();
    let options = Options { watch: arguments.watching.budget(), ..Options::default() };
    let run = play(&source, options, journal)?;
    let elapsed = began.elapsed();
    let clean =
        source.clean.as_ref().map(|eras| drive(eras, source.span, options, |_| Ok(()))).transpose()?;
    if let Some(output) = output {
        report::write_values(&run, output)?;
    }
    let report = report::Report::new(&run, clean.as_ref(), &source);
    report.print(arguments.json, elapsed)?;
    Ok(match (report.all_met(), source.degraded) {
        (false, _) => Outcome::No,
        (true, true) => Outcome::Degraded,
        (true, false) => Outcome::Done,
    })
}

/// What is to be replayed.
struct Source {
    eras: Vec<Era>,
    /// The same without the injected faults, to compare with.
    clean: Option<Vec<Era>>,
    /// When the recording begins and ends, even if a fault has taken its first or last observations away.
    span: Option<(Time, Time)>,
    /// Rows without a value, by the names of signals.
    missing: BTreeMap<String, usize>,
    degraded: bool,
}

fn read(arguments: &Arguments, live: Live) -> anyhow::Result<Source> {
    match arguments.recordings.as_slice() {
        [only] if is_journal(only) => read_journal(only, arguments, live),
        _ => read_recordings(arguments, live),
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

fn read_journal(path: &Path, arguments: &Arguments, live: Live) -> anyhow::Result<Source> {
    if !arguments.inject.is_empty() || !arguments.reload.is_empty() {
        bail!("a journal is replayed as it was; faults and other models are for recordings only");
    }
    let file = File::open(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let journal = journal::read_journal(BufReader::new(file), live)
        .with_context(|| format!("{} cannot be replayed", path.display()))?;
    if let Some((line, reason)) = &journal.damage {
        show::warn(format_args!("{}:{line}: {reason}; what comes before is replayed", path.display()));
    }
    Ok(Source {
        eras: journal.eras,
        clean: None,
        span: None,
        missing: BTreeMap::new(),
        degraded: journal.damage.is_some(),
    })
}

fn read_recordings(arguments: &Arguments, live: Live) -> anyhow::Result<Source> {
    let (stages, is_refused) = reload::stages(live, &arguments.reload)?;
    let mut wanted: Vec<Wanted> = Vec::new();
    for one in stages.iter().flat_map(|stage| self::wanted(&stage.knowledge)) {
        if !wanted.contains(&one) {
            wanted.push(one);
        }
    }
    let options = ReadOptions { time_column: arguments.time_column.clone(), time_scale: arguments.time_unit };
    let targets: Vec<Vec<usize>> = arguments
        .inject
        .iter()
        .map(|fault| targets(&stages, &wanted, fault))
        .collect::<anyhow::Result<_>>()?;
    let mut recording = recording::read(&arguments.recordings, &wanted, &options)?;
    recording.warnings.iter().for_each(show::warn);
    if recording.samples.is_empty() {
        bail!(
            "none of the model's signals is in the recording; `source` in the model says where each is found"
        );
    }
    let received = |sample: &recording::Sample| sample.received;
    let span = recording.samples.first().map(received).zip(recording.samples.last().map(received));
    let (first, end) = span.unwrap_or_default();
    let stages = reload::until(stages, end - first);
    let clean = (!arguments.inject.is_empty()).then(|| eras(&stages, &recording, &wanted, first));
    for (number, (fault, targets)) in arguments.inject.iter().zip(&targets).enumerate() {
        if !targets.iter().any(|&target| strikes(fault, &recording, target, first)) {
            show::warn(format_args!(
                "the fault of {} changes nothing: no observation of it in that time",
                fault.signal
            ));
        }
        for &target in targets {
            fault.inject(&mut recording.samples, target, first, arguments.seed.wrapping_add(number as u64));
        }
    }
    let missing =
        recording.found.iter().zip(&wanted).map(|(found, wanted)| (wanted.signal.clone(), found.missing));
    Ok(Source {
        eras: eras(&stages, &recording, &wanted, first),
        clean,
        span,
        missing: missing.collect(),
        degraded: recording.degraded || is_refused,
    })
}

/// What a fault changes: the signal of its name, from whichever sources the models read it.
fn targets(stages: &[Stage], wanted: &[Wanted], fault: &Fault) -> anyhow::Result<Vec<usize>> {
    let of_name = wanted.iter().enumerate().filter(|(_, wanted)| wanted.signal == fault.signal);
    let targets: Vec<usize> = of_name.map(|(at, _)| at).collect();
    if let (true, Some(stage)) = (targets.is_empty(), stages.first()) {
        find_signal(&stage.knowledge, &fault.signal).context("no fault can be injected")?;
    }
    Ok(targets)
}

/// Whether there is an observation that the fault can change.
fn strikes(fault: &Fault, recording: &Recording, target: usize, first: Time) -> bool {
    let hit = |sample: &recording::Sample| {
        let since = sample.received - first;
        sample.wanted == target && since >= fault.from && fault.to.is_none_or(|to| since < to)
    };
    recording.samples.iter().any(hit)
}

/// The observations under each knowledge base; those of signals that it does not have, or finds elsewhere, are left out.
fn eras(stages: &[Stage], recording: &Recording, wanted: &[Wanted], first: Time) -> Vec<Era> {
    let mut eras = Vec::new();
    let mut rest = recording.samples.as_slice();
    for (number, stage) in stages.iter().enumerate() {
        let until = stages
            .get(number + 1)
            .map_or(rest.len(), |next| rest.partition_point(|sample| sample.received < first + next.at));
        let (own, later) = rest.split_at(until);
        rest = later;
        let known = self::wanted(&stage.knowledge);
        let ids: BTreeMap<(&str, &str), SignalId> = known
            .iter()
            .zip(stage.knowledge.signals().ids())
            .map(|(known, id)| ((known.signal.as_str(), known.source.as_str()), id))
            .collect();
        let signals: Vec<Option<SignalId>> = wanted
            .iter()
            .map(|wanted| ids.get(&(wanted.signal.as_str(), wanted.source.as_str())).copied())
            .collect();
        let input = |sample: &recording::Sample| {
            Some(Input::Observation(Observation {
                signal: signals.get(sample.wanted).copied().flatten()?,
                stamp: sample.time,
                received: sample.received,
                value: sample.value.clone(),
            }))
        };
        eras.push(Era {
            from: first + stage.at,
            knowledge: stage.knowledge.clone(),
            change: stage.change.clone(),
            inputs: own.iter().filter_map(input).collect(),
        });
    }
    eras
}

fn play(source: &Source, options: Options, journal: Option<BufWriter<File>>) -> anyhow::Result<Run> {
    let Source { eras, span, .. } = source;
    let (Some(journal), Some(first)) = (journal, eras.first()) else {
        return drive(eras, *span, options, |_| Ok(()));
    };
    let mut journal = JournalWriter::new(journal, &first.knowledge)?;
    let run = drive(eras, *span, options, |given| Ok(journal.record(given)?))?;
    journal.flush()?;
    Ok(run)
}
