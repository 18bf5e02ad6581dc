//! Reports changes of the trust in signals and relations at a moment: faults, silences, returns, verdicts.

use super::message::Output;
use super::{Engine, events};
use crate::diagnosis::Decision;
use crate::monitor::{Absence, Finding, Shown};
use crate::time::Time;
use crate::trust::Component;

impl Engine {
    /// Reports signals whose own readings show a fault; returns whether anything has changed.
    pub(super) fn report_findings(&mut self, now: Time) -> bool {
        let mut changed = false;
        for at in 0..self.monitor.detectors().findings().len() {
            let Some(&Finding { signal, shown }) = self.monitor.detectors().findings().get(at) else { break };
            let fault = match shown {
                Shown::Fault(fault) => fault,
                Shown::Over => {
                    changed = true;
                    continue;
                }
                Shown::Single(symptom, evidence) => {
                    self.report_refused(signal, symptom, evidence, now);
                    continue;
                }
            };
            changed = true;
            let absence = self.monitor.timeouts().absence(signal);
            let is_reported = matches!(absence, Some(Absence::Invalid | Absence::OutOfRange));
            if self.ledger.fail_by_readings(signal, fault.absent_for.map(|span| now - span), now) {
                let event = events::fault(&self.knowledge, signal, &fault, now);
                let accusation = events::accusation(&self.knowledge, &event);
                self.ledger.note_report(Component::Signal(signal), accusation);
                self.outputs.extend((!is_reported).then_some(Output::Event(event)));
            }
        }
        changed
    }

    /// Reports silences, and returns after their probation; returns whether there were any.
    pub(super) fn report_changes(&mut self, now: Time) -> bool {
        if self.changes.is_empty() && self.ledger.first_return() > now {
            return false;
        }
        let mut changed = false;
        for change in core::mem::take(&mut self.changes) {
            let was_returning = self.ledger.interrupt(change.signal);
            match change.absence {
                None => {
                    self.ledger.come_back(change.signal, now, change.is_first);
                    // A need that nothing serves takes the signal at once.
                    changed = true;
                }
                // The absence was reported before; ways that relied on the returning signal must change.
                Some(_) if was_returning => changed = true,
                // The signal has failed already: impossible values are no news.
                Some(Absence::Invalid | Absence::OutOfRange) if self.ledger.has_failed(change.signal) => {
                    changed = true
                }
                Some(absence) => {
                    let event = events::absence(&self.knowledge, &self.monitor, &change, absence, now);
                    self.outputs.push_back(Output::Event(event));
                    changed = true;
                }
            }
        }
        changed | self.report_returns(now)
    }

    fn report_returns(&mut self, now: Time) -> bool {
        let returned = self.ledger.end_returns(now);
        // The judge reports when an untrusted signal is trusted again.
        for &signal in returned.iter().filter(|signal| self.ledger.trusts(**signal)) {
            let event = events::returned(&self.knowledge, signal, self.ledger.probation(), now);
            self.outputs.push_back(Output::Event(event));
        }
        !returned.is_empty()
    }

    /// Lets the judge review all evidence, and reports the decisions; returns whether there were any.
    pub(super) fn review(&mut self, now: Time) -> bool {
        let decisions = self.judge.review(&mut self.ledger, &self.monitor, now);
        let Engine { knowledge, monitor, ledger, outputs, .. } = self;
        for decision in &decisions {
            // The events of the needs report this.
            if let Decision::Unproven(component, _) | Decision::Contradicted(component) = decision
                && !matches!(*component, Component::Signal(signal) if ledger.has_failed(signal))
            {
                continue;
            }
            let event = events::decision(&events::Scene { knowledge, monitor, ledger, now }, decision);
            if let Decision::Failed(blame) | Decision::Suspected(blame, _) = decision {
                ledger.note_report(blame.component, events::accusation(knowledge, &event));
            }
            outputs.push_back(Output::Event(event));
        }
        for decision in &decisions {
            match decision {
                Decision::Recovered(signal, ..) => self.monitor.trust_readings(*signal),
                Decision::Cleared(Component::Signal(signal))
                | Decision::RuledOut(Component::Signal(signal)) => self.monitor.trust_level(*signal),
                _ => {}
            }
        }
        self.report_outliers(now);
        !decisions.is_empty()
    }
}
