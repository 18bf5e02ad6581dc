//! Chooses the source of a need: the best one, a substitute when it is lost, a better one later, or the ordered one.

use super::super::message::{Event, EventKind};
use super::settings::Given;
use super::situation::{Situation, Succession};
use super::{Better, Forced, Provider};
use crate::alignment::{Port, Sample};
use crate::interval::Interval;
use crate::knowledge::{IdVec, KnowledgeBase, SignalId, VariableId, WhenUnsure};
use crate::monitor::{Monitor, WatchedWay};
use crate::order::Subject;
use crate::reason::{Amount, Joint, Reason, Reasons};
use crate::service::Service;
use crate::substitution::Way;
use crate::time::Time;
use alloc::string::String;
use alloc::vec::Vec;

impl Provider {
    /// Sets the present value of a constant that is learned.
    pub(in super::super) fn set_constant(&mut self, variable: VariableId, value: Interval) {
        if let Some(serving) = self.state.serving_mut() {
            serving.service.set_constant(variable, value);
        }
    }

    /// Finds the sources of the need again.
    pub(super) fn find_sources(&mut self, situation: &Situation<'_>) {
        let Situation { knowledge, graph, ready_sources, monitor, now, .. } = situation;
        let withholds = self.settings.when_unsure == WhenUnsure::Withhold;
        let lost = self.sources.find(self.settings.need, withholds, situation, &mut self.contracts);
        let is_left = self.state.way().is_some_and(|way| self.sources.contain(way));
        if self.forced.is_none() && !is_left {
            self.refusals.note(knowledge, graph, ready_sources, self.settings.need, lost);
        }
        self.sources.rank(knowledge, monitor, Some(*now));
    }

    /// Starts the best source; returns whether there is one.
    pub(super) fn start_best(&mut self, knowledge: &KnowledgeBase, ports: &IdVec<SignalId, Port>) -> bool {
        let best = self.sources.ways().next().cloned();
        self.start(knowledge, best, ports)
    }

    /// Starts the best source whose signals have all given values, else the best one; returns whether there is one.
    pub(super) fn start_with_inputs(&mut self, situation: &Situation<'_>) -> bool {
        let Situation { knowledge, monitor, .. } = *situation;
        let has_inputs = |way: &&Way| way.inputs().all(|signal| monitor.timeouts().has_given_value(signal));
        let found = self.sources.ways().find(has_inputs).cloned();
        let assured = found.and_then(|way| self.contracts.admit(way));
        let service = assured.and_then(|way| Service::start(knowledge, way, monitor.ports(), None));
        match service {
            Some(_) => {
                self.take_over(knowledge, service);
                true
            }
            None => self.start_best(knowledge, monitor.ports()),
        }
    }

    /// Starts the best source whose newest value is fit, else the best one, in the place of a lost source; returns whether there
    /// is one. Its known values newer than the last published one go out at once.
    fn replace_by_best(&mut self, knowledge: &KnowledgeBase, monitor: &Monitor, now: Time) -> bool {
        let best = self.fittest(monitor, now, None).or_else(|| self.sources.ways().next()).cloned();
        // Under contract, a value that was known before its admission is still to be published.
        let never = self.contracts.is_demanding().then_some(Time::MIN);
        let since = self.last.map(|(_, sample)| sample.validity.to).or(never);
        let assured = best.and_then(|way| self.contracts.admit(way));
        let service = assured.and_then(|way| Service::start(knowledge, way, monitor.ports(), since));
        self.take_over(knowledge, service);
        self.state.serving().is_some()
    }

    pub(super) fn start(
        &mut self,
        knowledge: &KnowledgeBase,
        way: Option<Way>,
        ports: &IdVec<SignalId, Port>,
    ) -> bool {
        let assured = way.and_then(|way| self.contracts.admit(way));
        let service = assured.and_then(|way| Service::start(knowledge, way, ports, None));
        self.take_over(knowledge, service);
        self.state.serving().is_some()
    }

    pub(super) fn take_over(&mut self, knowledge: &KnowledgeBase, service: Option<Service>) {
        self.state.take_over(knowledge, service);
        self.contracts.run(self.state.way());
        self.sources.is_unrivalled = false;
        self.names.forget();
        self.waiting = None;
        self.delegate.retire();
    }

    /// Chooses the source again after a change of trust, or an order.
    pub(in super::super) fn replan(&mut self, situation: &Situation<'_>) -> Option<Event> {
        let Situation { knowledge, monitor, now, .. } = *situation;
        let was_outdone = self.better().is_some();
        self.find_sources(situation);
        let is_ordered = situation.order.is_some() && self.better().is_some();
        if self.forced.is_some() {
            return self.stay_forced(situation);
        }
        if let Some(serving) = self.state.serving_mut().filter(|_| !was_outdone) {
            serving.better_by = match situation.is_about_contracts {
                _ if is_ordered => Better::Ordered,
                true => Better::Admitted,
                false => Better::Trusted,
            };
        }
        if self.state.way().is_some_and(|way| self.sources.contain(way)) {
            self.state.end_doubt_unless(|way| self.sources.may_be_right(way));
            return None;
        }
        let lost = self.source_name(knowledge);
        let refused = self.why_not_admitted(knowledge);
        let by_order = |order: &Reason, source| {
            Reasons::from(order.clone()).then(Joint::Namely, Reason::Left { source })
        };
        let order = situation.order.as_ref();
        if !self.replace_by_best(knowledge, monitor, now) {
            let because = lost.map(|source| match order {
                Some(order) => by_order(order, source).then(Joint::And, Reason::NothingElseTrusted),
                None => match refused {
                    Some(refused) => refused.then(Joint::And, Reason::NothingElseTrusted),
                    None => Reason::LostAlone { source }.into(),
                },
            });
            return self.do_without(situation, because);
        }
        self.switched = Some(now);
        self.answer_for(order);
        // After an unserved time, the first value causes the event that the need is served again.
        let why = match order {
            Some(order) => by_order(order, lost?),
            None => {
                let untrusted = lost.map(|source| Reason::NotTrusted { source }.into());
                refused.or(untrusted)?
            }
        };
        let because = why.then(Joint::Next, self.alternatives(knowledge));
        self.report_switch(knowledge, monitor, because, now)
    }

    /// Reports a switch: at once where the source has a value, else with its first one. What gives nothing takes nothing over.
    fn report_switch(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        because: Reasons,
        now: Time,
    ) -> Option<Event> {
        let serving = self.state.serving()?;
        if self.delivers(monitor, serving.service.way(), now) {
            return Some(self.event(knowledge, EventKind::Substituted, because, now));
        }
        self.state.serving_mut()?.unreported = Some(because);
        None
    }

    /// Replaces a source that a change of the model has taken away.
    pub(super) fn start_anew(&mut self, lost: Option<&Way>, change: &Succession<'_>) -> Option<Event> {
        let Situation { knowledge, monitor, now, .. } = change.situation;
        let is_served = self.start_with_inputs(&change.situation);
        let reason = lost.map(|way| Reasons::from(change.lost_by(way)));
        if !is_served {
            let because = reason.map(|reason| reason.then(Joint::And, Reason::NothingElseTrusted));
            return self.do_without(&change.situation, because);
        }
        self.switched = Some(now);
        let because = reason?.then(Joint::Next, self.alternatives(knowledge));
        self.report_switch(knowledge, monitor, because, now)
    }

    /// The chosen source and the next ones, with their utilities.
    pub(super) fn alternatives(&self, knowledge: &KnowledgeBase) -> Reasons {
        self.sources.alternatives(knowledge, self.settings.variable, self.state.way())
    }

    /// A source that is better than the one in use, where the need is not tied to one source.
    pub(super) fn better(&self) -> Option<&Way> {
        let active = self.state.way().filter(|_| self.forced.is_none())?;
        self.sources.better(active, self.settings.switching.hysteresis)
    }

    /// Until when the last switch is held.
    pub(super) fn held_until(&self) -> Option<Time> {
        self.switched.map(|at| at + self.settings.switching.hold)
    }

    /// Switches to a better source when the hold time is over.
    pub(super) fn go_back(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        now: Time,
    ) -> Option<Event> {
        let held = self.held_until().is_some_and(|until| now < until);
        let better = self.better().filter(|_| !held)?;
        if !self.delivers(monitor, better, now) || self.refusals.is_short(better, now) {
            return None;
        }
        let better = better.clone();
        let serving = self.state.serving()?;
        let (left, better_by) = (serving.service.way().describe(knowledge), serving.better_by);
        self.start(knowledge, Some(better), monitor.ports());
        self.switched = Some(now);
        let why = match better_by {
            Better::Changed => Reason::ModelHasBetter,
            Better::Ordered => Reason::BetterAllowed,
            Better::Trusted => Reason::BetterTrusted,
            Better::Admitted => Reason::BetterAdmitted,
        };
        let because = Reasons::from(why).then(Joint::Next, Reason::Before { source: left });
        Some(self.event(knowledge, EventKind::Restored, because, now))
    }

    /// Whether the newest value of a way is fit, as far as the way is watched.
    fn delivers(&self, monitor: &Monitor, way: &Way, now: Time) -> bool {
        let watched = monitor.find(way).and_then(|index| monitor.way(index));
        let fit = |watched: &WatchedWay, sample: Sample| {
            self.settings.is_fit(&self.settings.stated(sample, watched.computation.timing()), now)
        };
        watched.is_none_or(|watched| watched.latest(now).is_some_and(|sample| fit(watched, sample)))
    }

    /// The best source, not `left`, whose newest value is fit; a source that is not watched counts as fit.
    fn fittest(&self, monitor: &Monitor, now: Time, left: Option<&Way>) -> Option<&Way> {
        let fits = |way: &&Way| {
            left != Some(*way) && !self.refusals.is_short(way, now) && self.delivers(monitor, way, now)
        };
        self.sources.ways().find(fits)
    }

    /// Leaves a source whose value is impossible or too wide, or repeatedly too old, for the best source whose newest value is fit.
    pub(super) fn leave_unfit(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        given: &Given,
        now: Time,
    ) -> Option<Event> {
        let age = now - given.1.to;
        let width = self.settings.width(given, self.state.serving()?.service.timing());
        let max_width = self.settings.max_width;
        let is_narrow = width.is_some_and(|width| width <= max_width);
        let is_first = self.state.serving()?.unfit_since.is_none();
        if self.forced.is_some() || (is_first && is_narrow) {
            return None;
        }
        // Ranks in place, without allocation: this runs with every value while no source is fit.
        self.sources.rank(knowledge, monitor, Some(now));
        let next = self.fittest(monitor, now, self.state.way())?.clone();
        let current = self.state.way()?.clone();
        self.refusals.remember(&self.settings, monitor, &current, now);
        let owed = self.last.map(|(_, sample)| sample.validity.to);
        let service = Service::start(knowledge, self.contracts.admit(next)?, monitor.ports(), owed)?;
        self.take_over(knowledge, Some(service));
        self.switched = Some(now);
        let amount = |amount: f64| Amount::of(knowledge, self.settings.variable, amount);
        let source = current.describe(knowledge);
        let shortfall = match width {
            None => Reason::SourceImpossible { source },
            Some(width) if width > max_width => {
                Reason::SourceTooWide { source, width: amount(width), most: amount(max_width) }
            }
            Some(_) => Reason::SourceTooOld { source, age, most: self.settings.max_age },
        };
        let because = Reasons::from(shortfall).then(Joint::Next, self.alternatives(knowledge));
        Some(self.event(knowledge, EventKind::Substituted, because, now))
    }

    /// Ties the need to a source without a switch, for [`Provider::inherit`] and [`Provider::resume`].
    pub(in super::super) fn tie(&mut self, way: Way) {
        self.forced = Some(Forced { way, is_doubted: false });
        self.state.end_unsure();
    }

    /// Serves the need from one source from now on. Reports a switch, if the source is another one.
    pub(in super::super) fn force(&mut self, way: Way, situation: &Situation<'_>) -> Option<Event> {
        self.tie(way);
        self.stay_forced(situation)
    }

    /// Chooses the source again, as after a change of trust: a source that serves well stays until a better one may take over.
    pub(in super::super) fn release(&mut self, situation: &Situation<'_>) -> Option<Event> {
        self.forced = None;
        let event = self.replan(situation);
        let is_outdone = self.better().is_some();
        if let Some(serving) = self.state.serving_mut().filter(|_| is_outdone) {
            serving.better_by = Better::Ordered;
        }
        event
    }

    /// Checks whether the source that the need is tied to can serve it, and reports a change of that.
    pub(super) fn stay_forced(&mut self, situation: &Situation<'_>) -> Option<Event> {
        let Situation { knowledge, monitor, ledger, now, .. } = *situation;
        let forced = self.forced.as_mut()?;
        forced.is_doubted = !self.sources.contain(&forced.way);
        let way = forced.way.clone();
        let only = Reasons::from(Reason::OnlyByOrder { source: way.describe(knowledge) });
        let forbidden = ledger.forbidden_in(knowledge, &way);
        if !forbidden.is_empty() {
            self.take_over(knowledge, None);
            let subjects = forbidden.into_iter().map(|component| Subject::of(knowledge, component));
            let by_another = Reason::ForbiddenByAnother { subjects: subjects.collect() };
            let because = only.then(Joint::And, by_another);
            return self.report_unserved(knowledge, Some(because), now);
        }
        if let Err(refused) = self.admit_forced(situation) {
            self.take_over(knowledge, None);
            return self.report_unserved(knowledge, Some(only.then(Joint::And, refused)), now);
        }
        if self.state.way() != Some(&way) {
            let left = self.source_name(knowledge);
            self.start(knowledge, Some(way), monitor.ports());
            self.switched = Some(now);
            let before = left.map_or(Reason::BeforeNothing, |source| Reason::Before { source });
            let because = only.then(Joint::Next, before);
            let Some(absent) = self.absent(knowledge, monitor) else {
                let is_back = self.state.way() == self.sources.preferred.as_ref();
                let kind = if is_back { EventKind::Restored } else { EventKind::Substituted };
                return Some(self.event(knowledge, kind, because, now));
            };
            // The switch is reported even after an event that nothing serves the need.
            self.reported.lose(self.settings.switching.probation, now);
            return Some(self.event(knowledge, EventKind::Unhealable, because.then(Joint::And, absent), now));
        }
        let because = self.absent(knowledge, monitor).map(|absent| only.then(Joint::And, absent));
        self.report_unserved(knowledge, because, now)
    }

    /// The signals of the source that give no usable value.
    fn absent(&self, knowledge: &KnowledgeBase, monitor: &Monitor) -> Option<Reason> {
        let is_absent = |signal: &SignalId| monitor.timeouts().absence(*signal).is_some();
        let absent = self.state.serving()?.rests_on.iter().filter(is_absent);
        let signals: Vec<String> = absent.map(|signal| knowledge.signals()[signal].name.clone()).collect();
        (!signals.is_empty()).then_some(Reason::InputsAbsent { signals })
    }
}
