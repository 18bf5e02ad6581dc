//! What is replayed: recordings with faults injected, under one model after the other, or a journal.

use super::reload::{self, Reload, Stage};
use crate::plan::find_signal;
use crate::show;
use anyhow::{Context, bail};
use shsa_core::engine::Input;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};
use shsa_format::drive::Era;
use shsa_format::fault::Fault;
use shsa_format::journal;
use shsa_format::model::live::Live;
use shsa_format::recording::{self, ReadOptions, Recording, Wanted, parse_span};
use shsa_format::story::Story;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// How recordings are read, and what is changed in them.
#[derive(clap::Args)]
pub(crate) struct SourceArguments {
    /// A fault to inject; may be given several times.
    #[arg(long, value_name = "FAULT")]
    pub(super) inject: Vec<Fault>,
    /// Seed of what is random in faults.
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// The column with the time, where a CSV file's header does not tell.
    #[arg(long, value_name = "NAME")]
    pub(super) time_column: Option<String>,
    /// What one step of the time column is: s, ms, us, ns or a span such as 5s.
    #[arg(long, value_name = "UNIT", value_parser = parse_span)]
    pub(super) time_unit: Option<Span>,
    /// A file that changes the model at this time, such as new.yaml@20s; may be given several times.
    #[arg(long, value_name = "FILE@TIME")]
    pub(super) reload: Vec<Reload>,
}

impl SourceArguments {
    /// Whether anything is changed in what is replayed.
    pub(crate) fn changes(&self) -> bool {
        !self.inject.is_empty() || !self.reload.is_empty()
    }
}

/// What is to be replayed.
pub(crate) struct Source {
    pub(crate) eras: Vec<Era>,
    /// The same without the injected faults, to compare with.
    pub(super) clean: Option<Vec<Era>>,
    /// When the recording begins and ends, even if a fault has taken its first or last observations away.
    pub(crate) span: Option<(Time, Time)>,
    /// Rows without a value, by the names of signals.
    pub(super) missing: BTreeMap<String, usize>,
    pub(crate) degraded: bool,
}

impl Source {
    /// What goes into the run of a story.
    pub(crate) fn of_story(story: &Story) -> Source {
        let eras = story.journal();
        let last = eras.iter().flat_map(|era| &era.inputs).map(Input::time).max();
        Source {
            eras,
            clean: None,
            span: Some((Time(0), last.unwrap_or_default())),
            missing: BTreeMap::new(),
            degraded: false,
        }
    }
}

/// Reads recordings with the faults injected, or a journal.
///
/// # Errors
/// When there is nothing to replay, or a fault is about a signal that the model does not have.
pub(crate) fn read(
    recordings: &[PathBuf],
    arguments: &SourceArguments,
    live: Live,
) -> anyhow::Result<Source> {
    match recordings {
        [only] if is_journal(only) => read_journal(only, arguments, live),
        _ => read_recordings(recordings, arguments, live),
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

fn read_journal(path: &Path, arguments: &SourceArguments, live: Live) -> anyhow::Result<Source> {
    if arguments.changes() {
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

fn read_recordings(
    recordings: &[PathBuf],
    arguments: &SourceArguments,
    live: Live,
) -> anyhow::Result<Source> {
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
    let mut recording = recording::read(recordings, &wanted, &options)?;
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
