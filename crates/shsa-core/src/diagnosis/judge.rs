//! The verdict on each signal and relation over time: suspect, failed, and trusted again.
//!
//! * A component has **failed** when it belongs to every explanation that is probable enough beside the best one, whatever the
//!   comparisons will say that are still undecided or only just agree.
//! * A component of some of these explanations is **suspect**, once the comparisons that may still decide have had their time,
//!   which is bounded.
//! * Signals with a common cause are blamed together where the cause explains the conflicts. A component that shares a cause
//!   with one that has just failed is blamed before others.
//! * A conflict that a failed component explains is no evidence about other components.
//! * [`recovery`] is how a component is trusted again.
//! * Without a comparison there is no verdict: unknown is not healthy.

mod testimony;
mod verdict;
mod evidence;
mod case;
mod orders;
mod recovery;
mod accusation;

use super::candidates::Component;
use crate::interval::Interval;
use crate::knowledge::{CauseId, IdVec, KnowledgeBase, Lineage, RelationId, SignalId, SignalSet};
use crate::monitor::{Inheritance, ResidualState, WatchedWay, WayIndex};
use crate::time::{Span, Time};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::sync::Arc;
use alloc::vec::Vec;
use evidence::Priors;

pub use evidence::rests_on;
pub use orders::Record;
pub use testimony::Testimony;
pub use verdict::{Blame, Decision, JudgeOptions, Proof, Verdict};

/// Probation doubles at most so often: with 5 s, to 5 minutes.
const MOST_RELAPSES: u32 = 6;

/// A signal that is accused again within this many of its probations has relapsed.
const RELAPSE_PROBATIONS: i64 = 4;

/// A decision changes what the evidence means for others: the evidence is taken in again, at most so often at one moment.
const MOST_ROUNDS: usize = 4;

/// A comparison, by its slower and its faster way.
type Ground = (WayIndex, WayIndex);

#[derive(Clone, Copy, Debug, Default)]
struct ComponentState {
    /// What outlasts a restart.
    record: Record,
    /// Since when all evidence speaks for it.
    clean_since: Option<Time>,
    /// Since when nothing speaks against it.
    quiet_since: Option<Time>,
    /// When it was accused, and for which common cause.
    accused: Option<Time>,
    cause: Option<CauseId>,
    /// The operator vouches for it.
    cleared_by_operator: bool,
}

/// Decides on signals and relations from what it is [told](Testimony) of the comparisons.
#[derive(Debug)]
pub struct Judge {
    options: JudgeOptions,
    priors: Arc<Priors>,
    /// What stands for each signal and all that it is derived from.
    origins: IdVec<SignalId, SignalSet>,
    /// What stands for each signal and all without which it is lost.
    foundations: IdVec<SignalId, SignalSet>,
    /// Of everything that was ever accused.
    standings: BTreeMap<Component, ComponentState>,
    /// The comparisons that have spoken against what is accused, by their two ways.
    grounds: BTreeMap<Component, BTreeSet<Ground>>,
    /// What nothing may rest on, by order.
    forbidden: BTreeSet<Component>,
    /// What has failed by its verdict or is forbidden: comparisons with it say nothing about others.
    discounted: BTreeSet<Component>,
    /// Signals whose own readings have shown a fault since the last review, ascending.
    failed_by_detector: BTreeSet<Component>,
    /// When to look again without a change of evidence.
    next_review: Option<Time>,
    /// The comparisons that a suspicion waits for.
    awaited: Vec<Awaited>,
}

/// A comparison that may yet decide, by its place among all pairs.
#[derive(Clone, Copy, Debug)]
struct Awaited {
    pair: usize,
    /// How often the pair had been compared when the judge began to wait.
    made: u64,
}

impl Judge {
    /// For the signals and relations of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, options: JudgeOptions) -> Judge {
        Judge {
            options,
            priors: Arc::new(Priors::new(knowledge, &options)),
            origins: IdVec::filled(knowledge.signals().len(), |signal| {
                knowledge.as_witnesses(knowledge.origins(signal))
            }),
            foundations: IdVec::filled(knowledge.signals().len(), |signal| {
                knowledge.as_witnesses(knowledge.foundations(signal))
            }),
            standings: BTreeMap::new(),
            grounds: BTreeMap::new(),
            forbidden: BTreeSet::new(),
            discounted: BTreeSet::new(),
            failed_by_detector: BTreeSet::new(),
            next_review: None,
            awaited: Vec::new(),
        }
    }

    /// Goes on with the verdicts before a change of the knowledge base. `inheritance` says which comparisons
    /// go on: a verdict that no such comparison could ever clear is dropped, and so is that on a signal which means
    /// something else now. That on a relation goes on while there are comparisons that rest on it. Gives whose verdicts
    /// were dropped, and whether each is described anew.
    pub fn inherit(
        &mut self,
        old: &Judge,
        evidence: &impl Testimony,
        lineage: &Lineage,
        inheritance: &Inheritance,
    ) -> Vec<(Component, bool)> {
        self.next_review = old.next_review;
        // The pairs have other places now: any evidence makes the review that finds the awaited ones again.
        self.awaited.extend(old.awaited.first().map(|it| Awaited { pair: usize::MAX, ..*it }));
        let mut dropped = Vec::new();
        for (&component, state_of) in &old.standings {
            let id = match component {
                Component::Signal(id) => id,
                Component::Relation(id) => {
                    let Some(same) = lineage.relation(id).map(Component::Relation) else { continue };
                    match evidence.pairs().iter().any(|pair| rests_on(evidence, pair, same)) {
                        true => self.put(same, *state_of),
                        false if state_of.record.verdict.is_some() => dropped.push((same, false)),
                        false => {}
                    }
                    continue;
                }
                Component::Cause(_) => continue,
            };
            let Some(namesake) = lineage.namesake(id) else { continue };
            match lineage.signal(id) {
                Some(signal)
                    if state_of.record.verdict.is_none()
                        || state_of.record.failed_by_detector
                        || inheritance.compared.contains(signal) =>
                {
                    self.put(Component::Signal(signal), *state_of);
                    if state_of.record.failed_by_detector && !inheritance.is_whole {
                        // What contradicted it may be gone.
                        self.next_review = Some(Time::MIN);
                    }
                }
                same if state_of.record.verdict.is_some() => {
                    dropped.push((Component::Signal(namesake), same.is_none()));
                }
                _ => {}
            }
        }
        self.inherit_grounds(old, lineage, inheritance);
        dropped
    }

    fn inherit_grounds(&mut self, old: &Judge, lineage: &Lineage, inheritance: &Inheritance) {
        let same = |&(way, other): &Ground| Some((inheritance.way(way)?, inheritance.way(other)?));
        for (component, grounds) in &old.grounds {
            let renamed = match *component {
                Component::Signal(signal) => lineage.signal(signal).map(Component::Signal),
                Component::Relation(relation) => lineage.relation(relation).map(Component::Relation),
                Component::Cause(_) => None,
            };
            if let Some(renamed) = renamed.filter(|it| self.accuses(*it)) {
                self.grounds.insert(renamed, grounds.iter().filter_map(same).collect());
            }
        }
    }

    /// When [`Judge::review`] must be called although no relationship has changed.
    #[must_use]
    pub fn next_review(&self) -> Option<Time> {
        self.next_review
    }

    /// Whether a comparison that a suspicion waits for has been made since the last review: [`Judge::review`] must be called,
    /// although no relationship has changed. Complexity: O(comparisons that are waited for), none in most systems.
    #[must_use]
    pub fn has_heard(&self, evidence: &impl Testimony) -> bool {
        let pairs = evidence.pairs();
        self.awaited.iter().any(|it| pairs.get(it.pair).is_none_or(|pair| pair.made != it.made))
    }

    /// Whether neither a signal nor anything that it is derived from is suspect, failed or forbidden; an estimator leaves out what
    /// is.
    #[must_use]
    pub fn trusts(&self, signal: SignalId) -> bool {
        self.trusts_all()
            || self.foundations[signal].iter().all(|origin| self.may_use(Component::Signal(origin)))
    }

    /// Whether a signal may serve where nothing else is left: it and all that it is derived from are trusted, or at least
    /// nothing speaks against them any more.
    #[must_use]
    pub fn tolerates(&self, signal: SignalId) -> bool {
        let is_tolerable = |origin: SignalId| {
            let component = Component::Signal(origin);
            self.may_use(component)
                || self.state_of(component).record.unproven && !self.forbidden.contains(&component)
        };
        self.trusts_all() || self.foundations[signal].iter().all(is_tolerable)
    }

    /// Whether a way rests on nothing that is suspect, failed or forbidden.
    #[must_use]
    pub fn trusts_way(&self, way: &WatchedWay) -> bool {
        let mut steps = way.computation.way().substitution.steps.iter();
        self.trusts_all()
            || way.computation.way().inputs().all(|signal| self.trusts(signal))
                && steps.all(|step| self.may_use(Component::Relation(step.relation)))
    }

    fn trusts_all(&self) -> bool {
        self.standings.is_empty() && self.forbidden.is_empty()
    }

    fn may_use(&self, component: Component) -> bool {
        self.accusation(component).is_none() && !self.forbidden.contains(&component)
    }

    /// Relations that are suspect, failed or forbidden, ascending: nothing may rest on them. When `tolerant`, without those
    /// that nothing speaks against any more.
    #[must_use]
    pub fn distrusted_relations(&self, tolerant: bool) -> Vec<RelationId> {
        let is_accused = |state_of: &ComponentState| {
            state_of.record.verdict.is_some() && !(tolerant && state_of.record.unproven)
        };
        let accused = self.standings.iter().filter(|(_, state_of)| is_accused(state_of));
        let all: BTreeSet<Component> =
            accused.map(|(component, _)| *component).chain(self.forbidden.iter().copied()).collect();
        let relation = |component| match component {
            Component::Relation(relation) => Some(relation),
            Component::Signal(_) | Component::Cause(_) => None,
        };
        all.into_iter().filter_map(relation).collect()
    }

    /// Whether a signal has failed by its verdict.
    #[must_use]
    pub fn has_failed(&self, signal: SignalId) -> bool {
        self.accusation(Component::Signal(signal)) == Some(Verdict::Failed)
    }

    /// Since when all evidence has spoken for a signal that is suspect or failed.
    #[must_use]
    pub fn clean_since(&self, signal: SignalId) -> Option<Time> {
        self.state_of(Component::Signal(signal)).clean_since
    }

    fn state_of(&self, component: Component) -> ComponentState {
        self.standings.get(&component).copied().unwrap_or_default()
    }

    fn put(&mut self, component: Component, state_of: ComponentState) {
        self.standings.insert(component, state_of);
        if state_of.record.verdict.is_none() {
            self.grounds.remove(&component);
        }
        match state_of.record.verdict == Some(Verdict::Failed) || self.forbidden.contains(&component) {
            true => self.discounted.insert(component),
            false => self.discounted.remove(&component),
        };
    }

    /// Suspect or failed.
    fn accusation(&self, component: Component) -> Option<Verdict> {
        self.standings.get(&component).and_then(|state_of| state_of.record.verdict)
    }

    /// How long all evidence must speak for a signal before it is trusted again; each relapse doubles it.
    #[must_use]
    pub fn probation_of(&self, signal: SignalId) -> Span {
        self.probation(self.state_of(Component::Signal(signal)).record.relapses)
    }

    fn probation(&self, relapses: u32) -> Span {
        self.options.probation.times(1 << relapses.min(MOST_RELAPSES))
    }

    /// How often in a row something has been accused soon after it was trusted again, when it is accused now.
    fn relapses(&self, component: Component, now: Time) -> u32 {
        let before = self.state_of(component);
        let soon =
            |cleared: Time| now - cleared <= self.probation(before.record.relapses).times(RELAPSE_PROBATIONS);
        match (before.record.verdict, before.record.cleared) {
            (Some(_), _) => before.record.relapses,
            (None, Some(cleared)) if soon(cleared) => (before.record.relapses + 1).min(MOST_RELAPSES),
            _ => 0,
        }
    }

    /// What is thought of a signal now.
    #[must_use]
    pub fn verdict(&self, signal: SignalId, evidence: &impl Testimony, now: Time) -> Verdict {
        let witnessed = || {
            evidence.pairs_of(signal).any(|pair| {
                pair.relationship(now) == ResidualState::Agree
                    && self.bears_witness(evidence, pair, Component::Signal(signal))
            })
        };
        match self.accusation(Component::Signal(signal)) {
            Some(_) if self.state_of(Component::Signal(signal)).record.unproven => Verdict::Unknown,
            Some(verdict) => verdict,
            None if self.state_of(Component::Signal(signal)).cleared_by_operator || witnessed() => {
                Verdict::Healthy
            }
            None => Verdict::Unknown,
        }
    }

    /// A signal's own readings show that it is faulty, so that what it is compared with is not to blame. It is trusted again
    /// after its readings and every comparison with it have spoken for it for the probation time. Whether that is news.
    pub fn fail_by_detector(&mut self, signal: SignalId, now: Time) -> bool {
        let component = Component::Signal(signal);
        let before = self.state_of(component);
        if before.record.verdict == Some(Verdict::Failed) {
            let record = Record { unproven: false, ..before.record };
            let (clean_since, quiet_since) = (None, None);
            self.put(
                component,
                ComponentState { record, clean_since, quiet_since, accused: Some(now), ..before },
            );
            return before.record.unproven;
        }
        let record = Record {
            verdict: Some(Verdict::Failed),
            alone: true,
            relapses: self.relapses(component, now),
            cleared: before.record.cleared,
            failed_by_detector: true,
            contradicted: before.record.verdict.is_some(),
            ..Record::default()
        };
        self.put(component, ComponentState { record, accused: Some(now), ..ComponentState::default() });
        self.failed_by_detector.insert(component);
        true
    }

    /// Takes all evidence in. Complexity: O(restless pairs) while nothing is in conflict and nobody is accused; else that of
    /// [`explain`](super::candidates::explain), and of [`probabilities`](super::candidates::probabilities) for each part in
    /// which something is decided; both again, a few times at most, after a decision.
    pub fn review(&mut self, evidence: &impl Testimony, now: Time) -> Vec<Decision> {
        self.next_review = None;
        let mut review = Review { judge: self, evidence, now, decisions: Vec::new() };
        for _ in 0..MOST_ROUNDS {
            let before = review.decisions.len();
            review.judge.awaited.clear();
            review.accuse();
            review.clear();
            if review.decisions.len() == before {
                return review.decisions;
            }
        }
        review.judge.look_again(now);
        review.decisions
    }

    /// Asks for a review at a moment.
    pub fn look_again(&mut self, at: Time) {
        self.next_review = Some(self.next_review.map_or(at, |earlier| earlier.min(at)));
    }
}

/// The judge at work: all evidence of one moment, and what is decided by it.
struct Review<'e, T> {
    judge: &'e mut Judge,
    evidence: &'e T,
    now: Time,
    decisions: Vec<Decision>,
}

/// What a signal says now, when it is a number.
fn said(evidence: &impl Testimony, component: Component) -> Option<Interval> {
    let Component::Signal(signal) = component else { return None };
    evidence.said(signal)
}
