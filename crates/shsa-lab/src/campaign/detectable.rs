//! A model calibrated on the first half of each session, and the smallest faults that are seen there.

use super::grid::{Detectable, Kind, Recorded};
use super::parallel::Progress;
use super::smallest::{self, Smallest};
use crate::LabError;
use crate::calibration::{Options, Session, calibrate};
use shsa_core::knowledge::{Id, KnowledgeBase, Severity, SignalId, build};
use shsa_core::observation::Observation;
use shsa_core::time::Span;
use shsa_format::model::live::Live;
use shsa_format::recording::Sample;
use std::num::NonZeroUsize;

/// What is wanted of the search for the smallest faults.
pub struct HalfSpec<'a> {
    /// The kinds of faults.
    pub kinds: &'a [Kind],
    /// The signals that are to be broken.
    pub signals: &'a [SignalId],
    /// How many moments each fault begins at.
    pub onsets: usize,
    /// How many seeds a fault with chance in it is run with.
    pub seeds: u64,
    /// How long a fault lasts; a quarter of the recording when not given.
    pub duration: Option<Span>,
    /// How many threads; `None`: as many as there are cores.
    pub threads: Option<NonZeroUsize>,
    /// Who hears how far it is.
    pub progress: &'a dyn Progress,
}

/// Calibrates as `shsa calibrate` does without further options: to the first half of each session.
///
/// # Errors
/// When nothing in the recording can be compared.
pub fn calibrated(
    live: &Live,
    sessions: &[Recorded<'_>],
    spec: &HalfSpec<'_>,
) -> Result<(KnowledgeBase, Detectable), LabError> {
    let halves: Vec<Span> = sessions.iter().map(|session| Span(session.length().0 / 2)).collect();
    let (fitted, unseen): (Vec<Session>, Vec<Session>) = (sessions.iter().zip(&halves))
        .map(|(session, half)| observed(session.samples).split(session.span().0 + *half))
        .unzip();
    let options = Options { finds_steps: false, ..Options::default() };
    let found = calibrate(live.draft(), &fitted, &unseen, &options)?;
    let (knowledge, remarks) = build(&found.draft);
    if let Some(error) = remarks.into_iter().find(|it| it.severity == Severity::Error) {
        return Err(LabError::Unfit(format!("the calibrated model has an error: {}", error.message)));
    }
    let early: Vec<Recorded<'_>> =
        sessions.iter().zip(&halves).map(|(session, half)| beginning(*session, *half)).collect();
    let longest = halves.iter().copied().max().unwrap_or_default();
    // What a value that sticks is compared with is always looked for.
    let mut kinds = spec.kinds.to_vec();
    kinds.extend([Kind::Bias, Kind::Drift].into_iter().filter(|kind| !spec.kinds.contains(kind)));
    let spec = smallest::SearchSpec {
        kinds: &kinds,
        signals: spec.signals,
        onsets: spec.onsets,
        seeds: spec.seeds,
        duration: spec.duration.unwrap_or(Span(longest.0 / 2)),
        unhealthy: found.unhealthy.iter().map(|it| (it.from, it.to)).collect(),
        threads: spec.threads,
        progress: spec.progress,
    };
    let smallest = Smallest::find(&knowledge, &early, &spec)?;
    Ok((knowledge, Detectable { from: halves, smallest }))
}

/// So much of a session.
fn beginning(session: Recorded<'_>, length: Span) -> Recorded<'_> {
    let end = session.span().0 + length;
    let early = session.samples.partition_point(|sample| sample.received < end);
    Recorded { samples: session.samples.get(..early).unwrap_or_default(), ..session }
}

fn observed(samples: &[Sample]) -> Session {
    let observation = |sample: &Sample| Observation {
        signal: SignalId::from_index(sample.wanted),
        stamp: sample.time,
        received: sample.received,
        value: sample.value.clone(),
    };
    Session::new(samples.iter().map(observation).collect(), &[])
}
