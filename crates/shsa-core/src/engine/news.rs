//! Reports changes of the trust in signals and relations at a moment: faults, silences, returns, verdicts.

use super::message::Output;
use super::{Engine, events};
use crate::diagnosis::{Component, Decision};
use crate::knowledge::SignalId;
use crate::monitor::{Absence, Finding, Shown};
use crate::time::Time;
use alloc::vec::Vec;

/// A signal that gives values again after a silence. Until the end of its probation it serves only where nothing else can. A
/// signal that was silent before its first value needs no probation, as it has never failed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Return {
    pub(super) signal: SignalId,
    pub(super) since: Time,
    pub(super) is_first: bool,
}

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
            if self.judge.fail_by_detector(signal, now) {
                let event = events::fault(&self.knowledge, signal, &fault, now);
                self.accusations
                    .insert(Component::Signal(signal), events::accusation(&self.knowledge, &event));
                self.outputs.extend((!is_reported).then_some(Output::Event(event)));
            }
        }
        changed
    }

    /// Reports silences, and returns after their probation; returns whether there were any.
    pub(super) fn report_changes(&mut self, now: Time) -> bool {
        if self.changes.is_empty() && self.returning.is_empty() {
            return false;
        }
        let mut changed = false;
        for change in core::mem::take(&mut self.changes) {
            self.judge.lapse(change.signal);
            let until_now = self.returning.iter().position(|it| it.signal == change.signal);
            until_now.map(|at| self.returning.swap_remove(at));
            match change.absence {
                None => {
                    self.returning.push(Return {
                        signal: change.signal,
                        since: now,
                        is_first: change.is_first,
                    });
                    // A need that nothing serves takes the signal at once.
                    changed = true;
                }
                // The absence was reported before; ways that relied on the returning signal must change.
                Some(_) if until_now.is_some() => changed = true,
                // The signal has failed already: impossible values are no news.
                Some(Absence::Invalid | Absence::OutOfRange) if self.judge.has_failed(change.signal) => {
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
        let over = |it: &&Return| now - it.since >= self.probation;
        let mut returned: Vec<SignalId> = self.returning.iter().filter(over).map(|it| it.signal).collect();
        returned.sort_unstable();
        self.returning.retain(|it| !returned.contains(&it.signal));
        // The judge reports when an untrusted signal is trusted again.
        for &signal in returned.iter().filter(|signal| self.judge.trusts(**signal)) {
            let event = events::returned(&self.knowledge, signal, self.probation, now);
            self.outputs.push_back(Output::Event(event));
        }
        !returned.is_empty()
    }

    /// Lets the judge review all evidence, and reports the decisions; returns whether there were any.
    pub(super) fn review(&mut self, now: Time) -> bool {
        let decisions = self.judge.review(&self.monitor, now);
        let Engine { knowledge, monitor, judge, accusations, outputs, .. } = self;
        let scene = events::Scene { knowledge, monitor, judge, now };
        for decision in &decisions {
            // The events of the needs report this.
            if let Decision::Unproven(component, _) | Decision::Contradicted(component) = decision
                && !matches!(*component, Component::Signal(signal) if judge.has_failed(signal))
            {
                continue;
            }
            let event = events::decision(&scene, decision);
            match decision {
                Decision::Failed(blame) | Decision::Suspected(blame, _) => {
                    accusations.insert(blame.component, events::accusation(knowledge, &event));
                }
                Decision::Cleared(component) => _ = accusations.remove(component),
                Decision::Recovered(signal, ..) => _ = accusations.remove(&Component::Signal(*signal)),
                Decision::Unproven(..) | Decision::Contradicted(_) => {}
            }
            outputs.push_back(Output::Event(event));
        }
        for decision in &decisions {
            match decision {
                Decision::Recovered(signal, ..) => self.monitor.trust_readings(*signal),
                Decision::Cleared(Component::Signal(signal)) => self.monitor.trust_level(*signal),
                _ => {}
            }
        }
        self.report_outliers(now);
        !decisions.is_empty()
    }
}
