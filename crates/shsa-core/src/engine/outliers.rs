//! Reports what changes neither trust nor a source: single wrong readings, refused ones and those that comparisons prove wrong; and
//! counters that begin anew.

use super::message::{Event, EventKind, Output};
use super::{Engine, events};
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, SignalId};
use crate::monitor::{Evidence, Monitor, Outlier, Symptom, WayIndex};
use crate::reason::{Joint, Range, Reason, Reasons};
use crate::time::Time;
use crate::trust::Component;

impl Engine {
    /// Reports a refused reading of a signal that is trusted.
    pub(super) fn report_refused(
        &mut self,
        signal: SignalId,
        symptom: Symptom,
        evidence: Evidence,
        now: Time,
    ) {
        if self.ledger.trusts(signal) && self.monitor.note_outlier(signal, now) {
            let event = refused_event(&self.knowledge, signal, symptom, evidence, now);
            self.outputs.push_back(Output::Event(event));
        }
    }

    /// A counter has begun anew: what is computed from it does so, too.
    #[cold]
    pub(super) fn begin_anew(&mut self, signal: SignalId, last: Interval, first: Interval, now: Time) {
        self.providers.iter_mut().for_each(|provider| provider.begin_anew(signal));
        let range = |value| Range::of(&self.knowledge, self.knowledge.signals()[signal].variable, value);
        let because = Reason::CountsAnew { from: range(first), last: range(last) };
        let about = Component::Signal(signal);
        let event = events::event(&self.knowledge, EventKind::Restarted, about, because, now);
        self.outputs.push_back(Output::Event(event));
    }

    /// Reports readings that comparisons prove wrong, of signals that are trusted.
    pub(super) fn report_outliers(&mut self, now: Time) {
        loop {
            let found = self.monitor.outliers(now).find(|it| self.ledger.trusts(it.signal));
            let Some(outlier) = found else { return };
            self.monitor.refute(&outlier);
            if self.monitor.note_outlier(outlier.signal, outlier.sample.validity.to) {
                let event = outlier_event(&self.knowledge, &self.monitor, &outlier, now);
                self.outputs.push_back(Output::Event(event));
            }
        }
    }
}

/// A reading that was refused, of a signal that is trusted.
fn refused_event(
    knowledge: &KnowledgeBase,
    signal: SignalId,
    symptom: Symptom,
    evidence: Evidence,
    now: Time,
) -> Event {
    let because = events::shown(knowledge, signal, evidence);
    let about = Component::Signal(signal);
    Event { symptom: Some(symptom), ..events::event(knowledge, EventKind::Outlier, about, because, now) }
}

/// A reading that comparisons prove wrong, of a signal that is trusted.
fn outlier_event(knowledge: &KnowledgeBase, monitor: &Monitor, outlier: &Outlier, now: Time) -> Event {
    let variable = knowledge.signals()[outlier.signal].variable;
    let contradicts = |(way, expected): (WayIndex, Interval)| {
        Some(Reason::Disagree {
            one: knowledge.signals()[outlier.signal].name.clone(),
            value: Range::of(knowledge, variable, outlier.sample.value),
            other: monitor.way(way)?.computation.way().describe(knowledge),
            expected: Range::of(knowledge, variable, expected),
            bad: 1,
            of: 1,
        })
    };
    let because = outlier.against.into_iter().filter_map(contradicts);
    let because = because.fold(Reasons::default(), |all, reason| all.then(Joint::Next, reason));
    let about = Component::Signal(outlier.signal);
    let event = events::event(knowledge, EventKind::Outlier, about, because, now);
    Event { symptom: Some(Symptom::Inconsistent), ..event }
}
