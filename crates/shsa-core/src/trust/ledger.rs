//! The table of standings, and all that changes it.

use super::standing::{Return, State};
use super::{Accusation, Accused, By, Component, MOST_CONFLICTS, Record, Standing, Support, Trust, Verdict};
use crate::knowledge::{IdVec, KnowledgeBase, Lineage, RelationId, SignalId, SignalSet};
use crate::monitor::{WatchedWay, WayIndex, rests_on};
use crate::numbers::{DOUBLINGS, RELAPSE_PROBATIONS};
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::boxed::Box;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;
use core::ops::Bound;

/// A comparison that has disagreed with an accused component, by its slower and its faster way.
pub type ConflictPair = (WayIndex, WayIndex);

/// The trust in all components: a [`Standing`] for each that was ever accused, is forbidden, or returns after a silence.
#[derive(Clone, Debug)]
pub struct Ledger {
    standings: BTreeMap<Component, Standing>,
    /// How many components are suspect, failed, forbidden or unproven: in most moments none.
    distrusted: usize,
    /// When the first probation of a returning signal ends.
    first_return: Time,
    /// The components that have failed by their verdicts or are forbidden: comparisons with them are no evidence about others.
    discounted: BTreeSet<Component>,
    /// For each signal, the signals without which it is lost, and its own, each by its witness and by itself.
    foundations: IdVec<SignalId, Foundations>,
    /// The signals whose own readings have shown a fault since the judge has asked, ascending.
    newly_failed: BTreeSet<Component>,
    probation: Span,
}

#[derive(Clone, Debug)]
struct Foundations {
    witnesses: SignalSet,
    signals: SignalSet,
}

impl Ledger {
    /// The ledger of a knowledge base in which everything is trusted. `probation` is how long all evidence must support a
    /// component before it is trusted again.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, probation: Span) -> Ledger {
        let foundations = |signal| {
            let signals = knowledge.foundations(signal);
            Foundations { witnesses: knowledge.as_witnesses(signals.clone()), signals }
        };
        Ledger {
            standings: BTreeMap::new(),
            distrusted: 0,
            first_return: Time::MAX,
            discounted: BTreeSet::new(),
            foundations: IdVec::filled(knowledge.signals().len(), foundations),
            newly_failed: BTreeSet::new(),
            probation,
        }
    }

    /// How far a component may be relied on.
    #[must_use]
    pub fn trust(&self, component: Component) -> Trust {
        self.standings.get(&component).map_or(Trust::Trusted, Standing::trust)
    }

    /// How far a signal may be relied on: no further than any signal without which it is lost.
    #[must_use]
    pub fn trust_in(&self, signal: SignalId) -> Trust {
        if self.standings.is_empty() {
            return Trust::Trusted;
        }
        let Foundations { witnesses, signals } = &self.foundations[signal];
        let accused = witnesses.iter().map(|witness| self.trust(Component::Signal(witness)));
        let returning = signals.iter().filter(|it| self.is_returning(*it)).map(|_| Trust::Returning);
        accused.chain(returning).max().unwrap_or_default()
    }

    /// Whether neither a signal nor one without which it is lost is suspect, failed or forbidden. An estimator leaves out the
    /// inputs that are.
    #[must_use]
    pub fn trusts(&self, signal: SignalId) -> bool {
        self.trusts_all() || self.trust_in(signal) <= Trust::Returning
    }

    /// Whether no component is suspect, failed, forbidden or unproven.
    #[inline]
    #[must_use]
    pub fn trusts_all(&self) -> bool {
        self.distrusted == 0
    }

    /// Whether a way rests on no component that is suspect, failed or forbidden.
    #[must_use]
    pub fn trusts_way(&self, way: &WatchedWay) -> bool {
        let mut steps = way.computation.way().substitution.steps.iter();
        self.trusts_all()
            || way.computation.way().inputs().all(|signal| self.trusts(signal))
                && steps.all(|step| self.trust(Component::Relation(step.relation)) <= Trust::Returning)
    }

    /// The relations that may be relied on less than this, ascending.
    #[must_use]
    pub fn relations_below(&self, least: Trust) -> Vec<RelationId> {
        let below = self.standings.iter().filter(|(_, standing)| standing.trust() > least);
        below.filter_map(|(component, _)| relation_of(*component)).collect()
    }

    /// The standing of a component; `None` for one that was never accused.
    #[must_use]
    pub fn standing(&self, component: Component) -> Option<&Standing> {
        self.standings.get(&component)
    }

    /// All standings, by component.
    pub fn standings(&self) -> impl Iterator<Item = (Component, &Standing)> {
        self.standings.iter().map(|(component, standing)| (*component, standing))
    }

    /// The accusation of a component that is suspect or failed.
    #[must_use]
    pub fn accused(&self, component: Component) -> Option<&Accused> {
        self.standings.get(&component)?.accused()
    }

    /// The accused components, ascending.
    pub fn all_accused(&self) -> impl Iterator<Item = (Component, &Accused)> {
        self.standings().filter_map(|(component, standing)| Some((component, standing.accused()?)))
    }

    /// The first accused component after another one, ascending.
    #[must_use]
    pub fn next_accused(&self, after: Option<Component>) -> Option<Component> {
        let after = after.map_or(Bound::Unbounded, Bound::Excluded);
        let mut all = self.standings.range((after, Bound::Unbounded));
        all.find(|(_, standing)| standing.accused().is_some()).map(|(component, _)| *component)
    }

    /// Whether a component is suspect or failed.
    #[must_use]
    pub fn accuses(&self, component: Component) -> bool {
        self.accused(component).is_some()
    }

    /// Whether a signal has failed by its verdict.
    #[must_use]
    pub fn has_failed(&self, signal: SignalId) -> bool {
        self.accused(Component::Signal(signal)).is_some_and(|it| it.verdict == Verdict::Failed)
    }

    /// Whether the operator vouches for a component.
    #[must_use]
    pub fn is_vouched_for(&self, component: Component) -> bool {
        self.standing(component)
            .is_some_and(|it| matches!(it.state, State::Sound { is_vouched_for: true, .. }))
    }

    /// The components that were accused and are sound again, each since when.
    pub fn recovered(&self) -> impl Iterator<Item = (Component, Time)> {
        self.standings().filter_map(|(component, standing)| match standing.state {
            State::Sound { since, .. } => Some((component, since?)),
            State::Accused(_) => None,
        })
    }

    /// The components that have failed or are forbidden, ascending: comparisons with them are no evidence about others.
    #[must_use]
    pub fn discounted(&self) -> &BTreeSet<Component> {
        &self.discounted
    }

    /// How long all evidence must support a component that has never relapsed before it is trusted again.
    #[must_use]
    pub fn probation(&self) -> Span {
        self.probation
    }

    /// How long all evidence must support a component before it is trusted again; each relapse doubles the time.
    #[must_use]
    pub fn probation_of(&self, component: Component) -> Span {
        self.probation_after(self.standing(component).map_or(0, |it| it.relapses))
    }

    fn probation_after(&self, relapses: u32) -> Span {
        self.probation.times(1 << relapses.min(DOUBLINGS))
    }

    /// How often in a row a component was accused soon after it was trusted again, counting an accusation now.
    #[must_use]
    pub fn relapses(&self, component: Component, now: Time) -> u32 {
        let Some(before) = self.standing(component) else { return 0 };
        let soon =
            |cleared: Time| now - cleared <= self.probation_after(before.relapses).times(RELAPSE_PROBATIONS);
        match (before.accused(), before.cleared) {
            (Some(_), _) => before.relapses,
            (None, Some(cleared)) if soon(cleared) => (before.relapses + 1).min(DOUBLINGS),
            _ => 0,
        }
    }

    /// Changes the standing of a component; nothing else does. A standing that says nothing is no row.
    fn change<T>(&mut self, component: Component, change: impl FnOnce(&mut Standing) -> T) -> T {
        let standing = self.standings.entry(component).or_default();
        let was_distrusted = standing.trust() > Trust::Returning;
        let result = change(standing);
        let is_distrusted = standing.trust() > Trust::Returning;
        self.distrusted = self.distrusted + usize::from(is_distrusted) - usize::from(was_distrusted);
        match standing.is_discounted() {
            true => self.discounted.insert(component),
            false => self.discounted.remove(&component),
        };
        if *standing == Standing::default() {
            self.standings.remove(&component);
        }
        result
    }

    fn change_accused(&mut self, component: Component, change: impl FnOnce(&mut Accused)) {
        self.change(component, |standing| standing.accused_mut().map(change));
    }

    /// Accuses a component.
    pub fn accuse(&mut self, component: Component, accused: Accused, now: Time) {
        let relapses = self.relapses(component, now);
        self.change(component, |standing| {
            let mut accused = Accused { since: Some(now), ..accused };
            if let Some(before) = standing.accused_mut() {
                (accused.reported, accused.awaits_value) = (before.reported.take(), before.awaits_value);
            }
            (standing.state, standing.relapses) = (State::Accused(Box::new(accused)), relapses);
        });
    }

    /// Fails a signal whose own readings show a fault, so that its comparisons blame no other component. The signal is trusted
    /// again after its readings and all its comparisons have supported it for the probation time. `absent_since`: where it may be that
    /// the sensor only has nothing to show, since when at the earliest. Returns whether the verdict is new.
    pub fn fail_by_readings(&mut self, signal: SignalId, absent_since: Option<Time>, now: Time) -> bool {
        let component = Component::Signal(signal);
        let before = self.accused(component);
        if self.has_failed(signal) {
            return self.change(component, |standing| {
                let Some(accused) = standing.accused_mut() else { return false };
                accused.since = Some(now);
                core::mem::replace(&mut accused.support, Support::Against).is_unproven()
            });
        }
        let by = By::Readings { contradicted: before.is_some() };
        let conflicts = before.map(|it| it.conflicts.clone()).unwrap_or_default();
        let accused =
            Accused { is_alone: true, absent_since, conflicts, ..Accused::new(Verdict::Failed, by) };
        self.accuse(component, accused, now);
        self.newly_failed.insert(component);
        true
    }

    /// The signals whose own readings have shown a fault since the last call, ascending.
    pub fn take_newly_failed(&mut self) -> BTreeSet<Component> {
        core::mem::take(&mut self.newly_failed)
    }

    /// Notes that evidence accuses a component again, and the comparison that does. `is_back`: the reading is where the last sound
    /// one was; while it is not, a contradiction shows nothing new. Returns whether the component was unproven.
    pub fn contradict(
        &mut self,
        component: Component,
        conflict: Option<ConflictPair>,
        is_back: bool,
    ) -> bool {
        self.change(component, |standing| {
            let Some(accused) = standing.accused_mut() else { return false };
            let was_unproven = accused.support.is_unproven();
            let Some(conflict) = conflict else {
                accused.support = if was_unproven { Support::Unproven(None) } else { Support::Against };
                return false;
            };
            accused.support = Support::Against;
            if let By::Readings { contradicted } = &mut accused.by {
                *contradicted |= is_back;
            }
            if accused.conflicts.len() < MOST_CONFLICTS {
                accused.conflicts.insert(conflict);
            }
            was_unproven
        })
    }

    /// Notes whether comparisons with a failed component are evidence about others again.
    pub fn hear(&mut self, component: Component, bears_witness: bool) {
        self.change_accused(component, |accused| accused.bears_witness = bears_witness);
    }

    /// Notes that no evidence accuses a component, and none supports it; returns since when.
    pub fn fall_silent(&mut self, component: Component, now: Time) -> Time {
        self.change(component, |standing| {
            let Some(accused) = standing.accused_mut() else { return now };
            let (support, since) = match accused.support {
                Support::Against => (Support::Silent(now), now),
                Support::Silent(since) | Support::Supported(_, since) => (Support::Silent(since), since),
                Support::Unproven(_) => (Support::Unproven(None), now),
            };
            accused.support = support;
            since
        })
    }

    /// Lets a component serve where nothing else is left, after a silence of its probation.
    pub fn leave_unproven(&mut self, component: Component) {
        self.change_accused(component, |accused| accused.support = Support::Unproven(None));
    }

    /// Notes that all evidence supports a component, since a moment or earlier.
    pub fn support(&mut self, component: Component, since: Time) {
        self.change_accused(component, |accused| {
            accused.support = match accused.support {
                Support::Against => Support::Supported(since, since),
                Support::Silent(quiet) | Support::Supported(_, quiet) => Support::Supported(since, quiet),
                Support::Unproven(_) => Support::Unproven(Some(since)),
            };
        });
    }

    /// Makes a component trusted again.
    pub fn acquit(&mut self, component: Component, now: Time) {
        self.change(component, |standing| {
            let since = standing.accused().and_then(|it| it.support.clean_since());
            standing.state = State::Sound { since, is_vouched_for: false };
            standing.cleared = Some(now);
        });
    }

    /// Clears a component because the operator vouches for it, whatever the evidence was. Returns whether it was accused or had
    /// only just come back.
    ///
    /// The signal counts as healthy until it is accused again, or [falls silent](Ledger::interrupt).
    pub fn clear_by_operator(&mut self, component: Component) -> bool {
        let had_returned = self.end_return(component);
        self.change(component, |standing| {
            let was_accused = standing.accused().is_some();
            if was_accused {
                standing.state = State::Sound { since: None, is_vouched_for: true };
                (standing.relapses, standing.cleared) = (0, None);
            }
            was_accused || had_returned
        })
    }

    /// Ends the operator's voucher for a signal that falls silent or comes back, and an earlier return; returns whether there was
    /// one.
    pub fn interrupt(&mut self, signal: SignalId) -> bool {
        self.change(Component::Signal(signal), |standing| {
            if let State::Sound { is_vouched_for, .. } = &mut standing.state {
                *is_vouched_for = false;
            }
        });
        self.end_return(Component::Signal(signal))
    }

    /// Notes that a signal gives values again after a silence. `is_first`: it has given none before.
    pub fn come_back(&mut self, signal: SignalId, since: Time, is_first: bool) {
        self.end_return(Component::Signal(signal));
        self.change(Component::Signal(signal), |standing| {
            standing.returning = Some(Return { since, is_first });
        });
        self.first_return = self.first_return.min(since + self.probation);
    }

    /// Ends the probation of a returning signal; returns whether there was one.
    fn end_return(&mut self, component: Component) -> bool {
        let ended = self.change(component, |standing| standing.returning.take());
        if ended.is_some_and(|it| it.since + self.probation <= self.first_return) {
            self.find_first_return();
        }
        ended.is_some()
    }

    fn find_first_return(&mut self) {
        self.first_return = self.returns().map(|(_, at)| at).min().unwrap_or(Time::MAX);
    }

    /// Whether a signal has come back after a silence and its probation is not over.
    #[must_use]
    pub fn is_returning(&self, signal: SignalId) -> bool {
        let standing = self.standing(Component::Signal(signal));
        standing.and_then(|it| it.returning).is_some_and(|it| !it.is_first)
    }

    /// When the first probation of a returning signal ends; [`Time::MAX`] where none returns.
    #[inline]
    #[must_use]
    pub fn first_return(&self) -> Time {
        self.first_return
    }

    /// When the probation of each returning signal ends.
    fn returns(&self) -> impl Iterator<Item = (SignalId, Time)> {
        self.standings().filter_map(|(component, standing)| {
            Some((signal_of(component)?, standing.returning?.since + self.probation))
        })
    }

    /// Ends the probations that are over; returns their signals, ascending.
    pub fn end_returns(&mut self, now: Time) -> Vec<SignalId> {
        let over: Vec<SignalId> = self.returns().filter(|(_, at)| *at <= now).map(|(id, _)| id).collect();
        over.iter().for_each(|id| self.change(Component::Signal(*id), |standing| standing.returning = None));
        self.find_first_return();
        over
    }

    /// Forbids a signal or relation: nothing may rest on it, and comparisons with it are no evidence about others. Returns
    /// whether that is new.
    pub fn forbid(&mut self, component: Component) -> bool {
        !self.change(component, |standing| core::mem::replace(&mut standing.is_forbidden, true))
    }

    /// Takes [`Ledger::forbid`] back; returns whether the component was forbidden.
    pub fn allow(&mut self, component: Component) -> bool {
        self.change(component, |standing| core::mem::take(&mut standing.is_forbidden))
    }

    /// The forbidden components, ascending.
    pub fn forbidden(&self) -> impl Iterator<Item = Component> {
        self.standings().filter(|(_, standing)| standing.is_forbidden).map(|(component, _)| component)
    }

    /// The forbidden components of a way, ascending: among the origins of its signals, and among its relations.
    #[must_use]
    pub fn forbidden_in(&self, knowledge: &KnowledgeBase, way: &Way) -> Vec<Component> {
        if self.discounted.is_empty() {
            return Vec::new();
        }
        let signals = rests_on(knowledge, way);
        let relations = way.substitution.relations();
        let is_in = |component: &Component| match component {
            Component::Signal(signal) => signals.contains(*signal),
            Component::Relation(relation) => relations.contains(relation),
            Component::Cause(_) => false,
        };
        self.forbidden().filter(is_in).collect()
    }

    /// Keeps the words in which an event has reported an accusation.
    pub fn note_report(&mut self, component: Component, accusation: Accusation) {
        self.change_accused(component, |accused| accused.reported = Some(accusation));
    }

    /// Restores a record from before a restart. Its accusation stands until new evidence clears it.
    pub fn recall(&mut self, component: Component, record: Record) {
        let relapses = record.relapses.min(DOUBLINGS);
        let mut recalled = Standing { relapses, ..Standing::from(record) };
        if let Some(accused) = recalled.accused_mut() {
            accused.awaits_value = signal_of(component).is_some();
        }
        self.change(component, |standing| {
            (recalled.is_forbidden, recalled.returning) = (standing.is_forbidden, standing.returning);
            if let (Some(before), Some(recalled)) = (standing.accused_mut(), recalled.accused_mut()) {
                recalled.conflicts = core::mem::take(&mut before.conflicts);
                recalled.reported = before.reported.take();
            }
            *standing = recalled;
        });
    }

    /// Restores the comparisons that have disagreed with an accused component before a restart.
    pub fn recall_conflicts(&mut self, component: Component, conflicts: BTreeSet<ConflictPair>) {
        if !conflicts.is_empty() {
            self.change_accused(component, |accused| accused.conflicts = conflicts);
        }
    }

    /// Notes a value of a signal; returns whether it is the first one of a signal that was accused before a restart.
    pub fn note_value(&mut self, witness: SignalId) -> bool {
        let accused = self.standings.get_mut(&Component::Signal(witness)).and_then(Standing::accused_mut);
        accused.is_some_and(|accused| core::mem::take(&mut accused.awaits_value))
    }

    /// Takes over the returns of signals from before a change of the knowledge base.
    pub fn inherit_returns(&mut self, old: &Ledger, lineage: &Lineage) {
        for (component, standing) in old.standings() {
            let source = signal_of(component).and_then(|signal| lineage.source(signal));
            if let (Some(signal), Some(returning)) = (source, standing.returning) {
                self.come_back(signal, returning.since, returning.is_first);
            }
        }
    }

    /// Takes over the verdict on a component, and its history, from before a change of the knowledge base. `renamed` gives the
    /// comparisons that go on.
    pub fn inherit(
        &mut self,
        component: Component,
        old: &Standing,
        renamed: impl Fn(&ConflictPair) -> Option<ConflictPair>,
    ) {
        self.change(component, |standing| {
            (standing.relapses, standing.cleared) = (old.relapses, old.cleared);
            standing.state = old.state.clone();
            if let Some(accused) = standing.accused_mut() {
                accused.conflicts = accused.conflicts.iter().filter_map(&renamed).collect();
            }
        });
    }
}

fn signal_of(component: Component) -> Option<SignalId> {
    match component {
        Component::Signal(signal) => Some(signal),
        Component::Relation(_) | Component::Cause(_) => None,
    }
}

fn relation_of(component: Component) -> Option<RelationId> {
    match component {
        Component::Relation(relation) => Some(relation),
        Component::Signal(_) | Component::Cause(_) => None,
    }
}
