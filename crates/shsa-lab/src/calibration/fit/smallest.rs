//! The smallest step of a signal that the whole loop detects, found by trying.

use super::edit;
use super::edit::Trial;
use super::parts::number;
use super::{Fit, Parameter, Problem};
use crate::calibration::session::Session;
use crate::campaign::parallel::side_by_side;
use shsa_core::engine::{self, EventKind, Input, Output, Ticks};
use shsa_core::knowledge::{Draft, Id, IdVec, KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};

/// The number of moments at which a step is tried.
const ONSETS: i64 = 2;
/// The most doublings, and the number of halvings of the interval after them.
const DOUBLINGS: usize = 12;
const HALVINGS: usize = 3;
/// A step counts as detected within this many seconds, and within this many periods of its signal.
const WITHIN_S: f64 = 10.0;
const WITHIN_PERIODS: f64 = 100.0;
/// The least number of observations before the end of a trial.
const BEFORE: usize = 10_000;
/// The most observations of a trial.
const MOST_OBSERVATIONS: usize = 40_000;

/// The smallest step of each signal, in its unit, that is detected in both directions and at each of some moments of the longest
/// stretch; `None` where none is, or none is looked for. The search begins at the chosen errors. Time: some dozen runs of the engine for each signal.
pub(super) fn smallest_steps(
    fit: &Fit<'_>,
    draft: &Draft,
    chosen: &Trial,
) -> Result<IdVec<SignalId, Option<f64>>, Problem> {
    let (sessions, options) = (fit.sessions, fit.options);
    let knowledge = edit::built(draft)?;
    let first = IdVec::filled(knowledge.signals().len(), |signal: SignalId| {
        let number = fit.parameters.iter().position(|it| *it == Parameter::Signal(signal));
        number.and_then(|at| chosen.errors[at]).filter(|it| *it > 0.0).unwrap_or(1.0)
    });
    if !options.finds_steps {
        return Ok(IdVec::filled(first.len(), |_: SignalId| None));
    }
    let longest = sessions.iter().flat_map(Session::stretches).max_by_key(|it| it.len());
    let all = longest.map_or(&[][..], Vec::as_slice);
    let tried = Tried { knowledge: &knowledge, all: &all[..all.len().min(MOST_OBSERVATIONS)] };
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    let mut found = IdVec::filled(signals.len(), |_: SignalId| None);
    for chunk in signals.chunks(options.threads.max(1)) {
        let smallest = |at: usize| tried.smallest(chunk[at], first[chunk[at]]);
        let detected: Vec<Option<f64>> =
            side_by_side(chunk.len(), smallest).into_iter().map(Option::flatten).collect();
        chunk.iter().zip(detected).for_each(|(signal, it)| found[*signal] = it);
        (options.progress)();
    }
    Ok(found)
}

struct Tried<'a> {
    knowledge: &'a KnowledgeBase,
    all: &'a [Observation],
}

impl Tried<'_> {
    fn smallest(&self, signal: SignalId, first: f64) -> Option<f64> {
        let mut high = first.max(1e-12);
        let is_detected = |step: f64| self.is_detected(signal, step) && self.is_detected(signal, -step);
        (0..DOUBLINGS).find(|_| {
            let detected = is_detected(high);
            high *= if detected { 1.0 } else { 2.0 };
            detected
        })?;
        let mut low = 0.5 * high;
        if high <= first.max(1e-12) {
            low = 0.0;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if is_detected(middle) { &mut high } else { &mut low }) = middle;
        }
        Some(high)
    }

    fn is_detected(&self, signal: SignalId, step: f64) -> bool {
        let Some((begin, end)) = self.all.first().zip(self.all.last()) else { return false };
        let lasts = end.received - begin.received;
        // The signal may be slower than declared.
        let count = self.all.iter().filter(|it| it.signal == signal).count().max(1);
        let declared = self.knowledge.signals()[signal].rate_hz.map_or(0.0, f64::recip);
        let period = declared.max(lasts.seconds() / count as f64);
        let within = Span::from_seconds(WITHIN_S.max(WITHIN_PERIODS * period)).min(Span(lasts.0 / 2));
        let onsets = (0..ONSETS).map(|at| begin.received + Span(lasts.0 * (at + 1) / (2 * ONSETS + 1)));
        onsets.into_iter().all(|onset| self.is_detected_at(signal, step, onset, within))
    }

    fn is_detected_at(&self, signal: SignalId, step: f64, onset: Time, within: Span) -> bool {
        // Values long before the step have no influence, but the engine must know the usual ones: a run begins some time before
        // the step.
        let to = self.all.partition_point(|it| it.received < onset + within);
        let from = self.all.partition_point(|it| it.received < onset - within).min(to.saturating_sub(BEFORE));
        let mut engine = shsa_estimate::node::engine(self.knowledge.clone(), engine::Options::default());
        let scaling = self.knowledge.signals()[signal].scaling;
        let step = scaling.map_or(step, |it| step / it.scale);
        for observation in self.all.get(from..to).unwrap_or_default() {
            let mut observation = observation.clone();
            if observation.signal == signal
                && observation.received >= onset
                && number(&observation.value, scaling).is_some()
            {
                match &mut observation.value {
                    RawValue::Number(value) => *value += step,
                    RawValue::Interval { lo, hi } => (*lo, *hi) = (*lo + step, *hi + step),
                    RawValue::Vector(_) => {}
                }
            }
            engine.pass(Ticks::before(observation.received));
            engine.handle(Input::Observation(observation));
            while let Some(output) = engine.poll() {
                let Output::Event(event) = output else { continue };
                let is_alarm = matches!(event.kind, EventKind::Failed | EventKind::Suspected);
                if is_alarm
                    && event.time >= onset
                    && event.signal.is_some_and(|it| it.index() == signal.index())
                {
                    return true;
                }
            }
        }
        false
    }
}
