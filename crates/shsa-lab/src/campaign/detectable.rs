//! A model calibrated on the first half of each session, and the smallest faults that it detects there.

use super::kind::{Kind, What};
use super::onset::Recorded;
use super::parallel::Progress;
use super::size::numbers;
use super::smallest::{self, Smallest};
use crate::LabError;
use crate::calibration::{Options, Session, calibrate};
use shsa_core::knowledge::Scaling;
use shsa_core::knowledge::{Id, KnowledgeBase, Severity, SignalId, build};
use shsa_core::observation::Observation;
use shsa_core::time::Span;
use shsa_core::time::Time;
use shsa_format::fault::{Fault, FaultKind};
use shsa_model::live::Live;
use shsa_recording::Sample;
use std::num::NonZeroUsize;

/// The settings of the search for the smallest faults.
pub struct HalfSpec<'a> {
    /// The kinds of faults.
    pub kinds: &'a [Kind],
    /// The signals with faults.
    pub signals: &'a [SignalId],
    /// The number of moments at which each fault begins.
    pub onsets: usize,
    /// The number of seeds for a random fault.
    pub seeds: u64,
    /// The duration of a fault; a quarter of the recording if not given.
    pub duration: Option<Span>,
    /// The number of threads; `None`: one for each core.
    pub threads: Option<NonZeroUsize>,
    /// The receiver of progress.
    pub progress: &'a dyn Progress,
}

/// A drift must reach this many smallest detectable biases when amounts are multiples of detectable ones, so that it can be
/// detected before its end.
pub const DRIFT_REACHES: f64 = 3.0;

/// A stuck value must deviate by this many smallest biases and drifts.
const STUCK_BY: f64 = 2.0;

/// The smallest faults that a calibrated model detects.
pub struct Detectable {
    /// Where the unseen part of each session begins, from the session's beginning; no fault begins before.
    pub from: Vec<Span>,
    /// The smallest faults that are detected in the part before.
    pub smallest: Smallest,
}

impl Detectable {
    /// The amount to inject, as a multiple of the smallest detected one: `None` if none is detected, `Some(None)` for a kind
    /// without an amount.
    pub(super) fn amount(&self, what: What, signal: SignalId, duration: Span) -> Option<Option<f64>> {
        let Some(by) = what.multiple else { return Some(None) };
        let (seen, _) = self.smallest.seen(signal, what.kind)?;
        Some(Some(match what.kind {
            Kind::Drift => by * seen.abs().max(self.reaching(signal, duration).unwrap_or(0.0) / by.abs()),
            Kind::Scale => 1.0 + by * seen,
            _ => by * seen,
        }))
    }

    /// The drift that reaches three smallest biases within a duration.
    fn reaching(&self, signal: SignalId, duration: Span) -> Option<f64> {
        let (bias, _) = self.smallest.seen(signal, Kind::Bias)?;
        Some(DRIFT_REACHES * bias / duration.seconds())
    }

    /// Whether the signal changes too little for its stuck value to be detected: it never deviates from that value, on one side
    /// and for the latency of the smallest bias, by twice the smallest bias and twice the smallest drift since then.
    pub(super) fn is_below(
        &self,
        fault: &Fault,
        signal: SignalId,
        own: &[&Sample],
        scaling: Option<Scaling>,
        end: Time,
    ) -> bool {
        if fault.kind != FaultKind::Stuck(None) {
            return false;
        }
        let seen = |kind| self.smallest.seen(signal, kind);
        // If no bias or drift is ever detected, nothing shows that the fault is too small: the run counts.
        let Some(((bias, within), (drift, _))) = seen(Kind::Bias).zip(seen(Kind::Drift)) else {
            return false;
        };
        let number = |sample: &Sample| numbers(&sample.value, scaling).first().copied();
        let onset = end - fault.to.map_or(Span::ZERO, |to| to - fault.from);
        let begin = own.partition_point(|sample| sample.received < onset);
        let Some(held) = begin.checked_sub(1).and_then(|at| number(own.get(at)?)) else { return true };
        let mut away: Option<(Time, bool)> = None;
        for sample in own.iter().skip(begin).take_while(|sample| sample.received < end) {
            let Some(value) = number(sample) else { continue };
            let (left, needed) = (value - held, bias.max(drift * (sample.received - onset).seconds()));
            away = match away.filter(|(_, above)| *above == (left > 0.0)) {
                _ if left.abs() < STUCK_BY * needed => None,
                Some((since, _)) if sample.received - since >= within => return false,
                same => same.or(Some((sample.received, left > 0.0))),
            };
        }
        true
    }
}

/// Calibrates as `shsa calibrate` does by default: on the first half of each session.
///
/// # Errors
/// When no comparison is possible in the recording.
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
    // A stuck value is compared with the smallest bias and drift, which are therefore always searched for.
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

/// The first part of a session.
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
