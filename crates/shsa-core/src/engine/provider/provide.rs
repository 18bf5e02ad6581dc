//! Publishes the value of a need at a moment: of its source, of a stand-in, or of the candidates; and reports changes.

use super::super::message::{Event, EventKind, Output, Publication, PublishedValue, Quality};
use super::episode::{Episode, Fault};
use super::reported::News;
use super::settings::Given;
use super::turn::Turn;
use super::{Provider, Server};
use crate::alignment::Sample;
use crate::assurance::Admitted;
use crate::interval::Interval;
use crate::knowledge::KnowledgeBase;
use crate::monitor::{Monitor, WatchedWay, WayIndex};
use crate::reason::{Joint, Reason, Reasons, ServedBy};
use crate::time::Time;
use crate::trust::Ledger;
use alloc::collections::VecDeque;

/// Reports an event where there is one. Most often there is none, and extending a list by nothing costs more.
#[inline]
pub(super) fn report(outputs: &mut VecDeque<Output>, event: Option<Event>) {
    if let Some(event) = event {
        outputs.push_back(Output::Event(event));
    }
}

impl Provider {
    /// Publishes the value of this moment.
    pub(in super::super) fn provide(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        ledger: &Ledger,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        self.started.get_or_insert(now);
        if self.refusals.is_open() {
            let because = self.refusals.report(knowledge);
            report(outputs, Some(self.event(knowledge, EventKind::Refused, because, now)));
        }
        if self.contracts.is_demanding() {
            report(outputs, self.report_not_admitted(knowledge, now));
        }
        self.refusals.follow(&self.settings, monitor, now);
        if !self.sources.is_unrivalled {
            match self.better() {
                Some(_) => report(outputs, self.go_back(knowledge, monitor, now)),
                None => self.sources.is_unrivalled = self.state.serving().is_some() && self.forced.is_none(),
            }
        }
        debug_assert!(
            !self.sources.is_unrivalled || self.better().is_none(),
            "what was found of the sources is out of date"
        );
        let trusts = |way: &WatchedWay| ledger.trusts_way(way);
        let mut doubted = None;
        let given = self.given(knowledge, monitor, now, outputs);
        let given = self.in_turn(given, now);
        let is_unfit = self.state.serving().is_some_and(|serving| serving.unfit_since.is_some());
        let fault = match given {
            Some((PublishedValue::Scalar(value), validity)) => {
                let sample = Sample { validity, value };
                let (fault, is_usable) = self.weigh(monitor, sample, is_unfit, trusts);
                self.look_for_witnesses(knowledge, monitor, now);
                doubted = is_usable.then_some(sample);
                if fault.is_none() {
                    return self.publish_own(knowledge, monitor, sample, now, outputs);
                }
                fault
            }
            Some((vector, validity)) if !is_unfit => {
                let Some(admitted) = self.admitted() else { return };
                let turn = self.own_turn();
                self.blend.pass_to(turn.server);
                let validity = self.following(validity);
                return self.publish(knowledge, (vector, validity), turn, admitted, now, outputs);
            }
            Some(_) => None,
            None => self.is_late(now).then_some(Fault::Late),
        };
        if let Some(fault) = fault
            && let Some((sample, way, turn)) =
                self.stand_in(knowledge, monitor, trusts, now, fault == Fault::Late)
        {
            if !self.may_follow(turn, sample.validity, now) {
                return report(outputs, self.check_age(knowledge, monitor, now));
            }
            self.state.end_unsure();
            self.name_stand_in(knowledge, monitor, way);
            report(outputs, self.note_stand_in(knowledge, monitor, way, fault, now));
            if let Some(admitted) = self.admitted_stand_in(monitor, way) {
                self.publish_sample(knowledge, sample, turn, admitted, now, outputs);
            }
            return;
        }
        if let Some(sample) = doubted {
            return self.publish_own(knowledge, monitor, sample, now, outputs);
        }
        if let Some(fault) = fault {
            self.doubt(knowledge, monitor.ports(), fault, now);
        }
        self.provide_uncertain(knowledge, monitor, now, outputs);
    }

    /// The next value of the source; where it falls short of the need's demands and another source's does not, the value of that
    /// one.
    fn given(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) -> Option<Given> {
        let given = self.computed(monitor, outputs)?;
        let serving = self.state.serving_mut()?;
        serving.pace.step(now);
        if self.settings.is_met_by(&given, serving.service.timing(), now) {
            serving.unfit_since = None;
            return Some(given);
        }
        let width = self.settings.width(&given, serving.service.timing());
        let left = self.leave_unfit(knowledge, monitor, &given, now);
        if left.is_none() {
            let is_wide_only = now - given.1.to <= self.settings.max_age && width.is_some();
            if !(self.settings.is_any_width_usable && is_wide_only) {
                self.state.serving_mut()?.unfit_since.get_or_insert(now);
            }
            return Some(given);
        }
        report(outputs, left);
        let given = self.computed(monitor, outputs)?;
        let serving = self.state.serving_mut()?;
        let is_fit = self.settings.is_met_by(&given, serving.service.timing(), now);
        serving.unfit_since = if is_fit { None } else { Some(now) };
        Some(given)
    }

    /// The next value of the source, computed here or by another process.
    fn computed(&mut self, monitor: &Monitor, outputs: &mut VecDeque<Output>) -> Option<Given> {
        let last = self.last.map(|(_, sample)| sample);
        let serving = self.state.serving_mut()?;
        self.delegate.next(&mut serving.service, self.settings.need, monitor.ports(), last, outputs)
    }

    /// The fault of a value of the source, and whether the value may still be published where nothing better is there.
    fn weigh(
        &mut self,
        monitor: &Monitor,
        sample: Sample,
        is_unfit: bool,
        trusts: impl Fn(&WatchedWay) -> bool,
    ) -> (Option<Fault>, bool) {
        let Some(serving) = self.state.serving_mut() else { return (None, false) };
        let votes = monitor.votes(self.settings.variable, &serving.rests_on, sample, trusts);
        serving.is_confirmed |= votes.supporting > 0;
        let fault = match is_unfit {
            true => Some(Fault::Unfit),
            false if self.forced.is_some() => None,
            false => votes.is_doubted().then_some(Fault::Contradicted),
        };
        (fault, !is_unfit && !votes.is_contradicted())
    }

    /// Whether a stand-in shall serve now because the source gives no value.
    fn is_late(&self, now: Time) -> bool {
        self.last_served().is_some_and(|served| now > self.state.late_after(served, &self.settings))
    }

    /// The value of a stand-in: of the best proven trusted way that is not contradicted and has a value of this moment, or one
    /// newer than the last published value; with its turn.
    fn stand_in(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        trusts: impl Fn(&WatchedWay) -> bool + Copy,
        now: Time,
        is_late: bool,
    ) -> Option<(Sample, WayIndex, Turn)> {
        if self.forced.is_some() {
            return None;
        }
        if !matches!(self.blend.server(), Some(Server::StandIn(_))) {
            self.sources.rank(knowledge, monitor, Some(now));
        }
        let rests_otherwise = |way: &WatchedWay| match self.state.serving() {
            Some(serving) => way.rests_on != serving.rests_on,
            None => !way.rests_on.is_empty(),
        };
        let usable = |index: WayIndex| {
            let way = monitor.way(index)?;
            let sample = self.news(monitor, index, way, now)?;
            let turn = self.turn_of(knowledge, index, way);
            let is_fit = || self.settings.is_fit(&self.settings.stated(sample, turn.timing), now);
            let usable = trusts(way) && rests_otherwise(way) && is_fit();
            let votes =
                usable.then(|| monitor.votes(self.settings.variable, &way.rests_on, sample, trusts))?;
            (!votes.is_contradicted()).then_some(((sample, index, turn), votes.is_doubted()))
        };
        // A doubted value is taken only where the source gives no value: it does not replace another doubted value.
        let mut doubted = None;
        for way in self.sources.ways() {
            match monitor.find(way).and_then(usable) {
                Some((found, false)) => return Some(found),
                Some((found, true)) if is_late => doubted = doubted.or(Some(found)),
                _ => {}
            }
        }
        doubted
    }

    /// The value of a way, if it is newer than the last published value.
    fn news(&self, monitor: &Monitor, index: WayIndex, way: &WatchedWay, now: Time) -> Option<Sample> {
        let fresh = monitor.fresh().find(|(fresh, _)| *fresh == index);
        let is_newer =
            |sample: &Sample| self.last.is_none_or(|(_, last)| sample.validity.to > last.validity.to);
        fresh.map(|(_, sample)| sample).or_else(|| way.latest(now).filter(is_newer))
    }

    /// Notes a value of a stand-in, and reports when the way has stood in for a while.
    fn note_stand_in(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        way: WayIndex,
        fault: Fault,
        now: Time,
    ) -> Option<Event> {
        let serving = self.state.serving_mut()?;
        let episode = serving.episode.get_or_insert(Episode::new(way, now));
        let lasted = episode.note_stand_in(way, self.settings.max_age, now)?;
        let source = serving.service.way().describe(knowledge);
        let stands_in = monitor.way(way)?.computation.way().describe(knowledge);
        let because = Reasons::from(fault.reason(source))
            .then(Joint::Next, Reason::StoodIn { way: stands_in.clone(), lasted });
        let event = self.event(knowledge, EventKind::Substituted, because, now);
        Some(Event { substitution: Some(ServedBy::Way(stands_in)), ..event })
    }

    /// Notes a value of the source itself, and reports when the source gives values again.
    fn note_own(&mut self, knowledge: &KnowledgeBase, monitor: &Monitor, now: Time) -> Option<Event> {
        let serving = self.state.serving_mut()?;
        let episode = serving.episode.as_mut()?;
        if !episode.note_own(&self.settings, now) {
            return None;
        }
        let last_reported = episode.reported();
        serving.episode = None;
        let before = monitor.way(last_reported?).map(|way| way.computation.way().describe(knowledge));
        let before = before.map_or(Reason::BeforeNothing, |source| Reason::Before { source });
        let because = Reasons::from(Reason::GivesAgain).then(Joint::Next, before);
        Some(self.event(knowledge, EventKind::Restored, because, now))
    }

    /// Publishes the source's own value of this moment.
    fn publish_own(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        sample: Sample,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        self.state.end_unsure();
        if self.state.serving().is_some_and(|serving| serving.episode.is_some()) {
            report(outputs, self.note_own(knowledge, monitor, now));
        }
        let Some(sample) = self.with_doubts(knowledge, sample, now) else {
            return report(outputs, self.check_age(knowledge, monitor, now));
        };
        report(outputs, self.report_postponed(knowledge, now));
        self.name_next(knowledge, monitor);
        if let Some(admitted) = self.admitted() {
            self.publish_sample(knowledge, sample, self.own_turn(), admitted, now, outputs);
        }
    }

    /// Reports a switch to a source without a value so far.
    fn report_postponed(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        let because = self.state.serving_mut()?.unreported.take()?;
        Some(self.event(knowledge, EventKind::Substituted, because, now))
    }

    /// Publishes what a value says of its moment; what goes on from it later goes on from the value itself.
    fn publish_sample(
        &mut self,
        knowledge: &KnowledgeBase,
        sample: Sample,
        turn: Turn,
        admitted: Admitted,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        let last = self.last.map(|(_, last)| last);
        let own = self.blend.apply(sample, turn, last, &self.settings, now);
        let validity = self.following(own.validity);
        if !self.settings.is_bounded_at(own.validity, validity, turn.timing) {
            return;
        }
        let stated = self.settings.stated_for(own, turn.timing, validity);
        let given = (PublishedValue::Scalar(stated.value), stated.validity);
        self.publish(knowledge, given, turn, admitted, now, outputs);
        self.last.iter_mut().for_each(|(_, last)| last.value = own.value);
    }

    pub(super) fn publish(
        &mut self,
        knowledge: &KnowledgeBase,
        (value, validity): Given,
        turn: Turn,
        admitted: Admitted,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        let scalar = match value {
            PublishedValue::Scalar(value) => value,
            PublishedValue::Vector(_) => Interval::EMPTY,
        };
        self.statistics.count(self.last.map(|(time, _)| now - time), scalar.width());
        report(outputs, self.report_served(knowledge, now));
        self.last = Some((now, Sample { validity, value: scalar }));
        self.last_period = turn.period;
        let quality = self.quality(turn.server, now);
        if quality != Quality::Uncertain {
            self.trusted = self.last.map(|(_, sample)| sample);
        }
        let value = self.settings.shown(value);
        let stands_in = matches!(turn.server, Server::StandIn(_));
        let source = self.name_of(knowledge, turn.server);
        outputs.push_back(Output::Publication(Publication {
            need: self.settings.need,
            time: now,
            validity,
            value,
            quality,
            source,
            admitted,
            delegated: self.delegate.has_given() && !stands_in,
        }));
    }

    /// Reports that the need is served again, or by a trusted source again.
    fn report_served(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        let is_certain = self.blend.server() != Some(Server::Unsure) && !self.sources.is_unproven();
        let is_break = self.last.is_none_or(|(last, _)| now - last > self.settings.max_age);
        let because =
            match self.reported.serve(is_certain, is_break, self.settings.switching.probation, now)? {
                News::TrustedAgain => Reason::TrustedAgain,
                News::ServedAgain if is_certain => Reason::ServedAgain,
                News::ServedAgain => Reason::ServedAgainUncertain,
            };
        Some(self.event(knowledge, EventKind::Restored, because, now))
    }
}
