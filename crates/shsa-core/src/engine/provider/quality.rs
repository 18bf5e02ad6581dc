//! How far a value is to be relied on, and what is added to a value of an unproven source.

use super::super::message::Quality;
use super::state::Backing;
use super::{Provider, Server};
use crate::alignment::Sample;
use crate::circle;
use crate::knowledge::{KnowledgeBase, SignalId};
use crate::monitor::Monitor;
use crate::numbers::BRIEF;
use crate::reason::Reason;
use crate::substitution::Way;
use crate::time::Time;

impl Provider {
    /// A value with all that cannot be excluded: where the source is unproven, also what the last trusted value can have become by
    /// now. `None` where that is wider than the need allows.
    pub(super) fn with_doubts(&self, knowledge: &KnowledgeBase, sample: Sample, now: Time) -> Option<Sample> {
        if !self.sources.is_unproven() {
            return Some(sample);
        }
        let variable = &knowledge.variables()[self.settings.variable];
        let direct = self.state.way().and_then(Way::direct).map(|signal| knowledge.signals()[signal].limits);
        let (range, max_rate) = match direct {
            Some(limits) => (limits.range, limits.max_rate),
            None => (variable.range, variable.max_rate),
        };
        let grown = |last: Sample| {
            let age = (now - last.validity.to).seconds().max(0.0);
            let value =
                variable.wraps.map_or(last.value, |turn| circle::nearest(last.value, sample.value, turn));
            value.widened(age * max_rate.unwrap_or(0.0))
        };
        let possible = match self.trusted {
            Some(last) => range.map_or(grown(last), |range| grown(last).intersection(range)),
            None => range.unwrap_or(sample.value),
        };
        let value = sample.value.hull(possible);
        let doubted = Sample { value, ..sample };
        let stated = || self.settings.stated(doubted, self.own_turn().timing);
        (value.is_bounded() && self.settings.is_fit(&stated(), now)).then_some(doubted)
    }

    pub(super) fn quality(&self, server: Server, now: Time) -> Quality {
        let is_preferred = || self.state.way() == self.sources.preferred.as_ref();
        let is_doubted = || self.forced.as_ref().is_some_and(|forced| forced.is_doubted);
        match server {
            Server::Unsure => Quality::Uncertain,
            Server::StandIn(_) => Quality::Substitute,
            _ if self.sources.is_unproven() || self.is_unconfirmed(now) => Quality::Uncertain,
            _ if is_preferred() && !is_doubted() => Quality::Good,
            _ => Quality::Substitute,
        }
    }

    /// Whether no other way has agreed with the source, which has just returned after a silence of all, or is left alone of several
    /// and was never confirmed: it may be faulty now.
    fn is_unconfirmed(&self, now: Time) -> bool {
        // Vectors are not compared element by element.
        let is_weighed = !self.settings.is_vector && self.forced.is_none();
        let serving = self.state.serving().filter(|serving| !serving.is_confirmed && is_weighed);
        serving.is_some_and(|serving| serving.backing == Backing::Alone || self.sources.are_returning(now))
    }

    /// The operator answers for the source that an order puts in the place of another.
    pub(super) fn answer_for(&mut self, order: Option<&Reason>) {
        if let Some(serving) = self.state.serving_mut().filter(|_| order.is_some()) {
            serving.backing = Backing::Known;
        }
    }

    /// Finds out whether anything has confirmed, or can confirm, the source.
    pub(super) fn look_for_witnesses(&mut self, knowledge: &KnowledgeBase, monitor: &Monitor, now: Time) {
        let Some(serving) = self.state.serving_mut().filter(|it| it.backing != Backing::Known) else {
            return;
        };
        let is_unknown = |signal| monitor.is_confirmed(signal) == Some(false);
        if !serving.service.way().inputs().any(is_unknown) {
            serving.backing = Backing::Known;
            return;
        }
        // What should speak is waited for as long as the need can wait for a value, or until it is silent.
        let patience = self.settings.max_age.max(BRIEF);
        let is_starting = self.started.is_some_and(|started| now - started < patience);
        let speaks = |signal: SignalId| {
            monitor.ports()[signal].received().is_some() || knowledge.signals()[signal].timeout.is_none()
        };
        let is_alone = self.sources.are_left_alone(|way| !is_starting || way.inputs().all(speaks));
        serving.backing = if is_alone { Backing::Alone } else { Backing::Beside };
    }
}
