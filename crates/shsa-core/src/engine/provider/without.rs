//! A need without a trusted source: candidates give uncertain values, or events tell that nothing serves it.

use super::super::message::{Event, EventKind, Output, PublishedValue};
use super::episode::Fault;
use super::provide::report;
use super::turn::Turn;
use super::unsure::{Unsure, hull_would_serve, independent};
use super::{Provider, Server, Situation, State, unserved};
use crate::alignment::Port;
use crate::computation::Timing;
use crate::knowledge::{IdVec, KnowledgeBase, SignalId, WhenUnsure};
use crate::monitor::Monitor;
use crate::reason::{Joint, Reason, Reasons};
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::collections::VecDeque;
use alloc::vec::Vec;

impl Provider {
    /// No trusted source can serve the need: goes on with the candidates, or reports that the need is not served.
    pub(super) fn do_without(
        &mut self,
        situation: &Situation<'_>,
        because: Option<Reasons>,
    ) -> Option<Event> {
        let Situation { knowledge, monitor, now, .. } = *situation;
        let before = self.state.take_unsure();
        let Some(ways) = self.candidates(situation) else {
            return self.report_unserved(knowledge, because, now);
        };
        if self.settings.when_unsure == WhenUnsure::Unstated {
            let because = because.map(|it| it.then(Joint::Next, hull_would_serve(knowledge, &ways)));
            return self.report_unserved(knowledge, because, now);
        }
        let ports = monitor.ports();
        let unsure = match before {
            Some(before) => before.goes_on(knowledge, ports, &self.contracts, ways, because),
            None => self.unsure(knowledge, ports, ways, because, now),
        };
        self.state.go_on_unsure(unsure);
        None
    }

    /// The candidates for uncertain values, where they are enough; where nothing is stated, those that would serve.
    fn candidates(&self, situation: &Situation<'_>) -> Option<Vec<Way>> {
        let Situation { knowledge, graph, ready_sources, .. } = *situation;
        let least = match self.settings.when_unsure {
            WhenUnsure::Withhold => return None,
            // No certificate covers a value without an observation now.
            WhenUnsure::Last if self.contracts.is_demanding() => return None,
            WhenUnsure::Last => 1,
            WhenUnsure::Hull | WhenUnsure::Unstated => 2,
        };
        if self.settings.is_vector {
            return None;
        }
        let sources = ready_sources.sources(knowledge, graph, self.settings.need, situation.possible());
        let mut ways = independent(knowledge, &sources);
        ways.retain(|way| self.contracts.admit(way).is_some());
        Some(ways).filter(|ways| ways.len() >= least)
    }

    /// No value of the source may go out, and nothing stands in for it: candidates serve when the need is about to be overdue. Those
    /// of a source that is contradicted are the trusted ones; where all of these are unfit, it is the suspects, too.
    pub(super) fn doubt(
        &mut self,
        knowledge: &KnowledgeBase,
        ports: &IdVec<SignalId, Port>,
        fault: Fault,
        now: Time,
    ) {
        let is_due = self.last_served().is_none_or(|last| now - last > self.settings.half_age());
        let is_hull = self.settings.when_unsure == WhenUnsure::Hull && !self.settings.is_vector;
        if self.state.unsure().is_some() || self.sources.is_alone || !is_due || !is_hull {
            return;
        }
        let (sources, why) = match fault {
            Fault::Contradicted => {
                let source = self.source_name(knowledge);
                (self.sources.all(), source.map(|source| Reason::Contradicted { source }.into()))
            }
            Fault::Unfit => (self.sources.suspected(), Some(unserved::unfit(&self.settings))),
            // It is trusted, and its next value may be in time.
            Fault::Late => return,
        };
        let mut ways = independent(knowledge, sources);
        ways.retain(|way| self.contracts.admit(way).is_some());
        self.sources.is_alone = ways.len() < 2;
        if !self.sources.is_alone {
            let unsure = self.unsure(knowledge, ports, ways, why, now);
            self.state.go_on_unsure(unsure);
        }
    }

    /// The uncertain service by these ways.
    fn unsure(
        &self,
        knowledge: &KnowledgeBase,
        ports: &IdVec<SignalId, Port>,
        ways: Vec<Way>,
        because: Option<Reasons>,
        now: Time,
    ) -> Unsure {
        let kind = self.settings.when_unsure;
        // A change of the model repeats no event: values may have been uncertain before the change.
        let is_reported = self.reported.is_uncertain();
        let last = self.trusted;
        let unsure = Unsure::new(knowledge, ports, &self.contracts, kind, ways, because, now);
        unsure.following(last, is_reported)
    }

    /// Publishes an uncertain value where nothing is trusted; else reports when the need has become unserved.
    pub(super) fn provide_uncertain(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        let unsure = self.state.unsure_mut();
        let sample = unsure.and_then(|unsure| unsure.value(knowledge, monitor.ports(), &self.settings, now));
        let period = self.state.unsure().map_or(Span::ZERO, |unsure| unsure.period(knowledge));
        let turn = Turn { server: Server::Unsure, period, timing: Timing::default() };
        let sample = sample.filter(|sample| self.may_follow(turn, sample.validity, now));
        let admitted = self.state.unsure().and_then(|unsure| unsure.admitted(&self.contracts));
        if let (Some(sample), Some(admitted)) = (sample, admitted) {
            self.blend.stop();
            report(outputs, self.report_uncertain(knowledge, now));
            let validity = self.following(sample.validity);
            let stated = self.settings.stated_for(sample, turn.timing, validity);
            let given = (PublishedValue::Scalar(stated.value), validity);
            return self.publish(knowledge, given, turn, admitted, now, outputs);
        }
        report(outputs, self.report_nothing_certain(knowledge, now));
        report(outputs, self.check_age(knowledge, monitor, now));
    }

    /// Reports once that values are uncertain from now on.
    fn report_uncertain(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        let is_decided = matches!(self.state, State::Unsure(_));
        let unsure = self.state.unsure_mut()?;
        let (served_by, reason) = unsure.report(knowledge, is_decided, self.settings.max_age, now)?;
        self.reported.doubt();
        if self.reported.is_unserved() {
            // The event that the need is served again reports the uncertainty, too.
            return None;
        }
        let because = reason.unwrap_or_default().then(Joint::Next, Reason::Uncertain { served_by });
        Some(self.event(knowledge, EventKind::Substituted, because, now))
    }

    /// Reports when no uncertain value is fit from the beginning, or the last trusted value has become too old.
    fn report_nothing_certain(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        // While there is a source, `check_age` reports.
        let State::Unsure(unsure) = &mut self.state else { return None };
        let because = unsure.report_nothing(knowledge, &self.settings, now)?;
        self.report_unserved(knowledge, Some(because), now)
    }
    /// Reports when the need has not been served for longer than a value may be old.
    pub(super) fn check_age(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        now: Time,
    ) -> Option<Event> {
        let age = now - self.last_served()?;
        if age <= self.settings.max_age || self.reported.is_unserved() {
            return None;
        }
        let because = unserved::reasons(self, knowledge, monitor, age, now);
        self.report_unserved(knowledge, Some(because), now)
    }
}
