//! A model calibrated on the first half of the recording, and the smallest faults that are seen there.

use super::grid::{Detectable, Kind, Recorded};
use super::smallest::{self, Smallest};
use anyhow::{anyhow, bail};
use shsa_core::knowledge::{Id, KnowledgeBase, Severity, SignalId, build};
use shsa_core::observation::Observation;
use shsa_core::time::Span;
use shsa_estimate::{Options, Session, calibrate};
use shsa_format::model::live::Live;
use shsa_format::recording::Sample;
use std::num::NonZeroUsize;

/// What is wanted of the search for the smallest faults.
pub(super) struct Wish<'a> {
    pub(super) kinds: &'a [Kind],
    pub(super) signals: &'a [SignalId],
    pub(super) onsets: usize,
    pub(super) seeds: u64,
    /// How long a fault lasts; a quarter of the recording when not given.
    pub(super) duration: Option<Span>,
    pub(super) threads: Option<NonZeroUsize>,
}

/// Calibrates as `shsa calibrate` does without further options.
///
/// # Errors
/// When there are several sessions, or nothing in the recording can be compared.
pub(super) fn calibrated(
    live: &Live,
    sessions: &[Recorded<'_>],
    wish: &Wish<'_>,
) -> anyhow::Result<(KnowledgeBase, Detectable)> {
    let [session] = sessions else {
        bail!(
            "what is detectable is found in one session, and these are {}; say which with --session",
            sessions.len()
        );
    };
    let ((first, last), samples) = (session.span(), session.samples);
    let half = Span((last - first).0 / 2);
    let observation = |sample: &Sample| Observation {
        signal: SignalId::from_index(sample.wanted),
        stamp: sample.time,
        received: sample.received,
        value: sample.value.clone(),
    };
    let observations: Vec<Observation> = samples.iter().map(observation).collect();
    let (fitted, unseen) = Session::new(observations, &[]).split(first + half);
    let options = Options { finds_steps: false, ..Options::default() };
    let found = calibrate(live.draft(), &[fitted], &[unseen], &options)?;
    let (knowledge, remarks) = build(&found.draft);
    if let Some(error) = remarks.into_iter().find(|it| it.severity == Severity::Error) {
        return Err(anyhow!("the calibrated model has an error: {}", error.message));
    }
    let early = samples.partition_point(|sample| sample.received < first + half);
    let early = Recorded { samples: samples.get(..early).unwrap_or_default(), ..*session };
    // What a value that sticks is compared with is always looked for.
    let mut kinds = wish.kinds.to_vec();
    kinds.extend([Kind::Bias, Kind::Drift].into_iter().filter(|kind| !wish.kinds.contains(kind)));
    let wish = smallest::Wish {
        kinds: &kinds,
        signals: wish.signals,
        onsets: wish.onsets,
        seeds: wish.seeds,
        duration: wish.duration.unwrap_or(Span(half.0 / 2)),
        unhealthy: found.unhealthy.iter().map(|it| (it.from, it.to)).collect(),
        threads: wish.threads,
    };
    let smallest = Smallest::find(&knowledge, &[early], &wish)?;
    Ok((knowledge, Detectable { from: half, smallest }))
}
