//! The inputs of a replay: recordings with injected faults, under one model after the other, or a journal.

use super::reload::{self, Reload};
use crate::headings::{FAULTS, PARTS};
use crate::plan::find_signal;
use crate::reading::ReadArguments;
use crate::show;
use anyhow::{Context, bail};
use shsa_core::time::Span;
use shsa_format::fault::Fault;
use shsa_format::journal;
use shsa_model::live::Live;
use shsa_recording::{Cuts, Session, Stretch, Wanted, moment};
use shsa_report::Source;
use shsa_report::recorded::{Injection, Recorded, Stage, broken, wanted_by};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// What is changed in recordings, and which of their sessions is used.
#[derive(clap::Args)]
pub(crate) struct SourceArguments {
    /// A file that changes the model at this time, such as new.yaml@20s; may be given several times.
    #[arg(long, value_name = "FILE@TIME")]
    pub(super) reload: Vec<Reload>,
    /// Only the session of this number, where there are several; they are counted from 1.
    #[arg(long, value_name = "NUMBER", value_parser = show::at_least_one, help_heading = PARTS)]
    pub(super) session: Option<NonZeroUsize>,
    /// A fault to inject; may be given several times.
    #[arg(long, value_name = "FAULT", help_heading = FAULTS)]
    pub(super) inject: Vec<Fault>,
    /// Seed of what is random in faults.
    #[arg(long, default_value_t = 1, help_heading = FAULTS)]
    pub(super) seed: u64,
}

impl SourceArguments {
    /// Whether the arguments change the inputs.
    pub(crate) fn changes(&self) -> bool {
        !self.inject.is_empty() || !self.reload.is_empty()
    }

    /// The faults with what they strike.
    ///
    /// # Errors
    /// When the models have no such signal.
    pub(super) fn injections(
        &self,
        stages: &[Stage],
        wanted: &[Wanted],
    ) -> anyhow::Result<Vec<Injection<'_>>> {
        self.inject.iter().map(|fault| injection(fault, stages, wanted)).collect()
    }
}

/// What is left out of recordings.
#[derive(clap::Args)]
pub(crate) struct CutArguments {
    /// Leave out what comes before this time from the first observation on, such as 20s.
    #[arg(long, value_name = "TIME", value_parser = moment, help_heading = PARTS)]
    from: Option<Span>,
    /// Leave out what comes at this time and after it.
    #[arg(long, value_name = "TIME", value_parser = moment, help_heading = PARTS)]
    until: Option<Span>,
    /// Leave out this stretch, such as 20s..30s; may be given several times. After it a new session begins.
    #[arg(long, value_name = "FROM..TO", help_heading = PARTS)]
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
    reading: &ReadArguments,
    cuts: &Cuts,
    live: Live,
) -> anyhow::Result<Vec<Source>> {
    match recordings {
        [only] if journal::is_journal_file(only) => Ok(vec![read_journal(only, arguments, cuts, live)?]),
        _ => read_recordings(recordings, arguments, reading, cuts, live),
    }
}

/// Reads the inputs of one session.
///
/// # Errors
/// As [`read`], and when there are several sessions.
pub(crate) fn read_one(
    recordings: &[PathBuf],
    arguments: &SourceArguments,
    reading: &ReadArguments,
    live: Live,
) -> anyhow::Result<Source> {
    let mut sources = read(recordings, arguments, reading, &Cuts::default(), live)?;
    match (sources.pop(), sources.len()) {
        (Some(only), 0) => Ok(only),
        (_, more) => bail!("these are {} sessions; say which with --session NUMBER", more + 1),
    }
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
    reading: &ReadArguments,
    cuts: &Cuts,
    live: Live,
) -> anyhow::Result<Vec<Source>> {
    let (stages, is_refused) = reload::stages(live, &arguments.reload)?;
    let wanted = wanted_by(&stages);
    let injections = arguments.injections(&stages, &wanted)?;
    let mut recording = reading.read(recordings, &wanted)?;
    let broken = broken(&recording, &injections, arguments.seed);
    recording.cut(cuts).iter().for_each(show::warn);
    only(&mut recording.sessions, arguments.session)?;
    injections.iter().filter(|injection| !injection.strikes(&recording)).for_each(without_effect);
    let longest = recording.sessions.iter().map(|it| it.span.1 - it.origin).max().unwrap_or_default();
    let stages = reload::until(stages, longest);
    let (recording, broken) = (&recording, broken.as_deref());
    Ok(Recorded { stages: &stages, wanted: &wanted, recording, broken, degraded: is_refused }.sources())
}

/// Warns that a fault strikes nothing.
pub(super) fn without_effect(injection: &Injection<'_>) {
    let signal = &injection.fault.signal;
    show::warn(format_args!("the fault of {signal} changes nothing: no observation of it in that time"));
}

/// A fault with what it strikes.
///
/// # Errors
/// When the models have no such signal.
fn injection<'a>(fault: &'a Fault, stages: &[Stage], wanted: &[Wanted]) -> anyhow::Result<Injection<'a>> {
    let injection = Injection::new(fault, stages, wanted);
    if let (false, Some(stage)) = (injection.has_target(), stages.first()) {
        find_signal(&stage.knowledge, &fault.signal).context("no fault can be injected")?;
    }
    Ok(injection)
}

/// Keeps only the session with this number, or all if there is none.
///
/// # Errors
/// When there is no such session, or no session at all.
pub(crate) fn only(sessions: &mut Vec<Session>, number: Option<NonZeroUsize>) -> anyhow::Result<()> {
    let count = sessions.len();
    if count == 0 {
        bail!("nothing is left of the recording: --from, --until and --skip leave no observation");
    }
    let Some(number) = number else { return Ok(()) };
    let session = sessions.get(number.get() - 1).cloned();
    let session = session.with_context(|| format!("there is no session {number}: there are {count}"))?;
    *sessions = vec![session];
    Ok(())
}
