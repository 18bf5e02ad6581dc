//! The inputs of a replay: recordings with injected faults, under one model after the other, or a journal.

use super::reload::{self, Reload, Stage};
use crate::plan::find_signal;
use crate::reading::ReadArguments;
use crate::show;
use anyhow::{Context, bail};
use shsa_core::engine::Input;
use shsa_core::knowledge::{KnowledgeBase, Scaling, SignalId};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};
use shsa_format::drive::Era;
use shsa_format::fault::{Fault, moment};
use shsa_format::journal;
use shsa_format::model::live::Live;
use shsa_format::recording::{self, Cuts, Recording, Sample, Session, Stretch, Wanted};
use shsa_report::Source;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
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
    #[command(flatten)]
    pub(super) reading: ReadArguments,
    /// A file that changes the model at this time, such as new.yaml@20s; may be given several times.
    #[arg(long, value_name = "FILE@TIME")]
    pub(super) reload: Vec<Reload>,
    /// Only the session of this number, where there are several; they are counted from 1.
    #[arg(long, value_name = "NUMBER", value_parser = show::at_least_one)]
    pub(super) session: Option<NonZeroUsize>,
}

impl SourceArguments {
    /// Whether the arguments change the inputs.
    pub(crate) fn changes(&self) -> bool {
        !self.inject.is_empty() || !self.reload.is_empty()
    }
}

/// What is left out of recordings.
#[derive(clap::Args)]
pub(crate) struct CutArguments {
    /// Leave out what comes before this time from the first observation on, such as 20s.
    #[arg(long, value_name = "TIME", value_parser = moment)]
    from: Option<Span>,
    /// Leave out what comes at this time and after it.
    #[arg(long, value_name = "TIME", value_parser = moment)]
    until: Option<Span>,
    /// Leave out this stretch, such as 20s..30s; may be given several times. After it a new session begins.
    #[arg(long, value_name = "FROM..TO")]
    skip: Vec<Stretch>,
}

impl CutArguments {
    pub(crate) fn cuts(&self) -> Cuts {
        Cuts { from: self.from, until: self.until, skip: self.skip.clone() }
    }

    /// The arguments as on the command line, with a space before each.
    pub(crate) fn shown(&self) -> String {
        let at = |name: &str, at: Option<Span>| {
            at.map_or(String::new(), |at| format!(" --{name} {}s", at.seconds()))
        };
        let end = |to: Span| if to == Span::MAX { String::new() } else { format!("{}s", to.seconds()) };
        let skip = self.skip.iter().map(|it| format!(" --skip {}s..{}", it.from.seconds(), end(it.to)));
        at("from", self.from) + &at("until", self.until) + &skip.collect::<String>()
    }
}

/// Reads recordings with the injected faults, or a journal, as sessions; returns at least one.
///
/// # Errors
/// When there is nothing to replay, or a fault names a signal that the model lacks.
pub(crate) fn read(
    recordings: &[PathBuf],
    arguments: &SourceArguments,
    cuts: &Cuts,
    live: Live,
) -> anyhow::Result<Vec<Source>> {
    match recordings {
        [only] if journal::is_journal_file(only) => Ok(vec![read_journal(only, arguments, cuts, live)?]),
        _ => read_recordings(recordings, arguments, cuts, live),
    }
}

/// Reads the inputs of one session.
///
/// # Errors
/// As [`read`], and when there are several sessions.
pub(crate) fn read_one(
    recordings: &[PathBuf],
    arguments: &SourceArguments,
    live: Live,
) -> anyhow::Result<Source> {
    let mut sources = read(recordings, arguments, &Cuts::default(), live)?;
    match (sources.pop(), sources.len()) {
        (Some(only), 0) => Ok(only),
        (_, more) => bail!("these are {} sessions; say which with --session NUMBER", more + 1),
    }
}

/// The fields to look for in recordings: every signal of the model except computed ones, which come last.
pub(crate) fn wanted(knowledge: &KnowledgeBase) -> Vec<Wanted> {
    let measured = knowledge.signals().enumerate().filter(|(id, _)| !knowledge.is_computed(*id));
    measured.map(|(_, signal)| Wanted::new(signal.name.clone(), signal.source.clone())).collect()
}

fn read_journal(path: &Path, arguments: &SourceArguments, cuts: &Cuts, live: Live) -> anyhow::Result<Source> {
    if arguments.changes() || arguments.session.is_some() || !cuts.is_empty() {
        bail!("a journal is replayed as it was; faults, other models and parts are for recordings only");
    }
    let journal =
        journal::read_file(path, live).with_context(|| format!("{} cannot be replayed", path.display()))?;
    if let Some((line, reason)) = &journal.damage {
        show::warn(format_args!("{}:{line}: {reason}; what comes before is replayed", path.display()));
    }
    Ok(Source { eras: journal.eras, degraded: journal.damage.is_some(), ..Source::default() })
}

fn read_recordings(
    recordings: &[PathBuf],
    arguments: &SourceArguments,
    cuts: &Cuts,
    live: Live,
) -> anyhow::Result<Vec<Source>> {
    let (stages, is_refused) = reload::stages(live, &arguments.reload)?;
    let mut wanted: Vec<Wanted> = Vec::new();
    for one in stages.iter().flat_map(|stage| self::wanted(&stage.knowledge)) {
        if !wanted.contains(&one) {
            wanted.push(one);
        }
    }
    let targets: Vec<Vec<Target>> = arguments
        .inject
        .iter()
        .map(|fault| targets(&stages, &wanted, fault))
        .collect::<anyhow::Result<_>>()?;
    let mut recording = recording::read(recordings, &wanted, &arguments.reading.options())?;
    show::recording(&recording);
    if let Some(cause) = recording.cause() {
        bail!("nothing of the recording can be read: {cause}");
    }
    if recording.samples.is_empty() {
        bail!(
            "none of the model's signals is in the recording; `source` in the model says where each is found"
        );
    }
    let broken: Option<Vec<Vec<Sample>>> = (!arguments.inject.is_empty()).then(|| {
        recording
            .by_session()
            .map(|(session, samples)| broken(session, samples, &targets, arguments))
            .collect()
    });
    recording.cut(cuts).iter().for_each(show::warn);
    only(&mut recording, arguments.session)?;
    report_idle(&recording, &targets, arguments);
    let longest = recording.sessions.iter().map(|it| it.span.1 - it.origin).max().unwrap_or_default();
    let stages = reload::until(stages, longest);
    let missing =
        recording.found.iter().zip(&wanted).map(|(found, wanted)| (wanted.signal.clone(), found.missing));
    let missing: BTreeMap<String, usize> = missing.collect();
    let source = |(session, clean): (&Session, &[Sample])| {
        let eras =
            |samples: &[Sample]| eras(reload::of_session(&stages, session), samples, &wanted, session.origin);
        let broken = broken.as_ref().and_then(|broken| broken.get(session.recording));
        let is_kept = |sample: &&Sample| session.part.holds(session.origin, sample);
        let broken = broken.map(|own| own.iter().filter(is_kept).cloned().collect::<Vec<_>>());
        Source {
            eras: eras(broken.as_deref().unwrap_or(clean)),
            clean: broken.is_some().then(|| eras(clean)),
            span: Some(session.span),
            origin: Some(session.origin),
            session: Some(session.clone()),
            missing: missing.clone(),
            degraded: recording.degraded || is_refused,
        }
    };
    Ok(recording.by_session().map(source).collect())
}

/// Keeps only the session with this number, or all if there is none.
///
/// # Errors
/// When there is no such session, or no session at all.
pub(crate) fn only(recording: &mut Recording, number: Option<NonZeroUsize>) -> anyhow::Result<()> {
    let count = recording.sessions.len();
    if count == 0 {
        bail!("nothing is left of the recording: --from, --until and --skip leave no observation");
    }
    let Some(number) = number else { return Ok(()) };
    let session = recording.sessions.get(number.get() - 1).cloned();
    let session = session.with_context(|| format!("there is no session {number}: there are {count}"))?;
    recording.sessions = vec![session];
    Ok(())
}

/// The samples of a session with the injected faults.
fn broken(
    session: &Session,
    samples: &[Sample],
    targets: &[Vec<Target>],
    arguments: &SourceArguments,
) -> Vec<Sample> {
    let mut samples = samples.to_vec();
    for (number, (fault, targets)) in arguments.inject.iter().zip(targets).enumerate() {
        let seed = arguments.seed.wrapping_add(number as u64);
        for &(wanted, scaling) in targets {
            fault.inject(&mut samples, wanted, scaling, session.origin, seed);
        }
    }
    samples
}

/// Tells which faults change nothing.
fn report_idle(recording: &Recording, targets: &[Vec<Target>], arguments: &SourceArguments) {
    for (fault, targets) in arguments.inject.iter().zip(targets) {
        let strikes = |(session, samples): (&Session, &[Sample])| {
            targets.iter().any(|&(target, _)| strikes(fault, samples, target, session.origin))
        };
        if !recording.by_session().any(strikes) {
            show::warn(format_args!(
                "the fault of {} changes nothing: no observation of it in that time",
                fault.signal
            ));
        }
    }
}

/// The number of a wanted field, and its scaling by the first model with the signal.
type Target = (usize, Option<Scaling>);

/// The targets of a fault: the fields of the signal, from every source that the models name.
fn targets(stages: &[Stage], wanted: &[Wanted], fault: &Fault) -> anyhow::Result<Vec<Target>> {
    let of_name = wanted.iter().enumerate().filter(|(_, wanted)| wanted.signal == fault.signal);
    let mut signals = stages.iter().flat_map(|stage| stage.knowledge.signals().iter());
    let scaling = signals.find(|signal| signal.name == fault.signal).and_then(|signal| signal.scaling);
    let targets: Vec<Target> = of_name.map(|(at, _)| (at, scaling)).collect();
    if let (true, Some(stage)) = (targets.is_empty(), stages.first()) {
        find_signal(&stage.knowledge, &fault.signal).context("no fault can be injected")?;
    }
    Ok(targets)
}

/// Whether the fault can change an observation.
fn strikes(fault: &Fault, samples: &[Sample], target: usize, first: Time) -> bool {
    let hit = |sample: &Sample| {
        let since = sample.received - first;
        sample.wanted == target && since >= fault.from && fault.to.is_none_or(|to| since < to)
    };
    samples.iter().any(hit)
}

/// The observations under each knowledge base, without those of signals that it lacks or reads from another source.
fn eras(stages: &[Stage], samples: &[Sample], wanted: &[Wanted], first: Time) -> Vec<Era> {
    let mut eras = Vec::new();
    let mut rest = samples;
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
        let input = |sample: &Sample| {
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
            change: stage.change.clone().filter(|_| number > 0),
            inputs: own.iter().filter_map(input).collect(),
        });
    }
    eras
}
