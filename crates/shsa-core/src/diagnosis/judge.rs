//! The verdict on each signal and relation over time: suspect, failed, and trusted again.
//!
//! * A component has **failed** when it belongs to every explanation that is probable enough beside the best one. The comparisons
//!   that are undecided or only just agree cannot change that, whatever their outcome.
//! * A component of some of these explanations is **suspect**. The judge first waits, for a bounded time, for the comparisons
//!   that may still decide.
//! * Signals with a common cause are blamed together where the cause explains the conflicts. A component that shares a cause with
//!   one that has just failed is blamed before others.
//! * A conflict that a failed component explains is no evidence about other components.
//! * [`recovery`] describes how a component is trusted again.
//! * Without a comparison there is no verdict: unknown is not healthy.

mod evidence_view;
mod verdict;
mod power;
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
pub use evidence_view::EvidenceView;
pub use orders::Record;
pub use verdict::{Blame, Decision, JudgeOptions, Proof, Verdict};

/// How often the probation doubles at most: a probation of 5 s grows to 5 minutes.
const MOST_RELAPSES: u32 = 6;

/// A signal that is accused again within this many of its probations has relapsed.
const RELAPSE_PROBATIONS: i64 = 4;

/// How often the evidence of one moment is reviewed at most. A decision changes what the evidence means for other components.
const MOST_ROUNDS: usize = 4;

/// A comparison that has disagreed with an accused component, by its slower and its faster way.
type ConflictPair = (WayIndex, WayIndex);

#[derive(Clone, Copy, Debug, Default)]
struct ComponentState {
    /// The part of the state that outlasts a restart.
    record: Record,
    /// Since when all evidence supports the component.
    clean_since: Option<Time>,
    /// Since when no evidence accuses the component.
    quiet_since: Option<Time>,
    /// When the component was accused, and for which common cause.
    accused: Option<Time>,
    cause: Option<CauseId>,
    /// Since when the component, once accused, is sound again.
    sound_since: Option<Time>,
    /// Whether the operator vouches for the component.
    cleared_by_operator: bool,
}

/// Decides on signals and relations from a view of the [evidence](EvidenceView).
#[derive(Debug)]
pub struct Judge {
    options: JudgeOptions,
    priors: Arc<Priors>,
    /// For each signal, the witnesses of the signals that it is derived from, and its own.
    origins: IdVec<SignalId, SignalSet>,
    /// For each signal, the witnesses of the signals without which it is lost, and its own.
    foundations: IdVec<SignalId, SignalSet>,
    /// The state of each component that was ever accused.
    states: BTreeMap<Component, ComponentState>,
    /// The comparisons that have disagreed with an accused component, by their two ways.
    conflicts: BTreeMap<Component, BTreeSet<ConflictPair>>,
    /// The components that an operator has forbidden: nothing may rest on them.
    forbidden: BTreeSet<Component>,
    /// The components that have failed by their verdicts or are forbidden: comparisons with them are no evidence about others.
    discounted: BTreeSet<Component>,
    /// The signals whose own readings have shown a fault since the last review, ascending.
    failed_by_detector: BTreeSet<Component>,
    /// When the next review is due without a change of evidence.
    next_review: Option<Time>,
    /// The comparisons that a suspicion waits for.
    awaited: Vec<Awaited>,
}

/// A comparison that may still decide, by the index of its pair.
#[derive(Clone, Copy, Debug)]
struct Awaited {
    pair: usize,
    /// How often the pair had been compared when the judge began to wait.
    made: u64,
}

impl Judge {
    /// Makes a judge for the signals and relations of a knowledge base.
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
            states: BTreeMap::new(),
            conflicts: BTreeMap::new(),
            forbidden: BTreeSet::new(),
            discounted: BTreeSet::new(),
            failed_by_detector: BTreeSet::new(),
            next_review: None,
            awaited: Vec::new(),
        }
    }

    /// Takes over the verdicts from before a change of the knowledge base. `inheritance` says which comparisons go on. The
    /// verdict on a signal is dropped when no comparison that goes on could clear it, or when the signal has another meaning now.
    /// The verdict on a relation goes on while comparisons rest on the relation. Returns the components whose verdicts were
    /// dropped, each with whether its description has changed.
    pub fn inherit(
        &mut self,
        old: &Judge,
        evidence: &impl EvidenceView,
        lineage: &Lineage,
        inheritance: &Inheritance,
    ) -> Vec<(Component, bool)> {
        self.next_review = old.next_review;
        // The change gives pairs other indices. An index that no pair has makes the next evidence start a review, which finds the
        // awaited pairs again.
        self.awaited.extend(old.awaited.first().map(|it| Awaited { pair: usize::MAX, ..*it }));
        let mut dropped = Vec::new();
        for (&component, state) in &old.states {
            let id = match component {
                Component::Signal(id) => id,
                Component::Relation(id) => {
                    let Some(same) = lineage.relation(id).map(Component::Relation) else { continue };
                    match evidence.pairs().iter().any(|pair| rests_on(evidence, pair, same)) {
                        true => self.put(same, *state),
                        false if state.record.verdict.is_some() => dropped.push((same, false)),
                        false => {}
                    }
                    continue;
                }
                Component::Cause(_) => continue,
            };
            let Some(namesake) = lineage.namesake(id) else { continue };
            match lineage.signal(id) {
                Some(signal)
                    if state.record.verdict.is_none()
                        || state.record.failed_by_detector
                        || inheritance.compared.contains(signal) =>
                {
                    self.put(Component::Signal(signal), *state);
                    if state.record.failed_by_detector && !inheritance.is_whole {
                        // The comparison that contradicted the signal may be gone.
                        self.next_review = Some(Time::MIN);
                    }
                }
                same if state.record.verdict.is_some() => {
                    dropped.push((Component::Signal(namesake), same.is_none()));
                }
                _ => {}
            }
        }
        self.inherit_conflicts(old, lineage, inheritance);
        dropped
    }

    fn inherit_conflicts(&mut self, old: &Judge, lineage: &Lineage, inheritance: &Inheritance) {
        let same = |&(way, other): &ConflictPair| Some((inheritance.way(way)?, inheritance.way(other)?));
        for (component, conflicts) in &old.conflicts {
            let renamed = match *component {
                Component::Signal(signal) => lineage.signal(signal).map(Component::Signal),
                Component::Relation(relation) => lineage.relation(relation).map(Component::Relation),
                Component::Cause(_) => None,
            };
            if let Some(renamed) = renamed.filter(|it| self.accuses(*it)) {
                self.conflicts.insert(renamed, conflicts.iter().filter_map(same).collect());
            }
        }
    }

    /// When [`Judge::review`] must be called although no residual has changed its state.
    #[must_use]
    pub fn next_review(&self) -> Option<Time> {
        self.next_review
    }

    /// Whether a comparison that a suspicion waits for has been made since the last review. If so, [`Judge::review`] must be
    /// called although no residual has changed its state. Complexity: O(awaited comparisons), none in most systems.
    #[must_use]
    pub fn has_awaited_comparison(&self, evidence: &impl EvidenceView) -> bool {
        let pairs = evidence.pairs();
        self.awaited.iter().any(|it| pairs.get(it.pair).is_none_or(|pair| pair.made != it.made))
    }

    /// Whether neither a signal nor its origins are suspect, failed or forbidden. An estimator leaves out the inputs that are.
    #[must_use]
    pub fn trusts(&self, signal: SignalId) -> bool {
        self.trusts_all()
            || self.foundations[signal].iter().all(|origin| self.may_use(Component::Signal(origin)))
    }

    /// Whether a signal may serve where nothing else is left: the signal and its origins are trusted, or at least no evidence
    /// accuses them any more.
    #[must_use]
    pub fn tolerates(&self, signal: SignalId) -> bool {
        let is_tolerable = |origin: SignalId| {
            let component = Component::Signal(origin);
            self.may_use(component)
                || self.state_of(component).record.unproven && !self.forbidden.contains(&component)
        };
        self.trusts_all() || self.foundations[signal].iter().all(is_tolerable)
    }

    /// Whether a way rests on no component that is suspect, failed or forbidden.
    #[must_use]
    pub fn trusts_way(&self, way: &WatchedWay) -> bool {
        let mut steps = way.computation.way().substitution.steps.iter();
        self.trusts_all()
            || way.computation.way().inputs().all(|signal| self.trusts(signal))
                && steps.all(|step| self.may_use(Component::Relation(step.relation)))
    }

    fn trusts_all(&self) -> bool {
        self.states.is_empty() && self.forbidden.is_empty()
    }

    fn may_use(&self, component: Component) -> bool {
        self.accusation(component).is_none() && !self.forbidden.contains(&component)
    }

    /// The relations that are suspect, failed or forbidden, ascending: nothing may rest on them. When `tolerant`, without the
    /// unproven ones, which no evidence accuses any more.
    #[must_use]
    pub fn distrusted_relations(&self, tolerant: bool) -> Vec<RelationId> {
        let is_accused =
            |state: &ComponentState| state.record.verdict.is_some() && !(tolerant && state.record.unproven);
        let accused = self.states.iter().filter(|(_, state)| is_accused(state));
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

    /// Since when all evidence has supported a signal that is suspect or failed.
    #[must_use]
    pub fn clean_since(&self, signal: SignalId) -> Option<Time> {
        self.state_of(Component::Signal(signal)).clean_since
    }

    fn state_of(&self, component: Component) -> ComponentState {
        self.states.get(&component).copied().unwrap_or_default()
    }

    fn put(&mut self, component: Component, state: ComponentState) {
        self.states.insert(component, state);
        if state.record.verdict.is_none() {
            self.conflicts.remove(&component);
        }
        match state.record.verdict == Some(Verdict::Failed) || self.forbidden.contains(&component) {
            true => self.discounted.insert(component),
            false => self.discounted.remove(&component),
        };
    }

    /// The verdict on a component that is suspect or failed; `None` for any other.
    fn accusation(&self, component: Component) -> Option<Verdict> {
        self.states.get(&component).and_then(|state| state.record.verdict)
    }

    /// How long all evidence must support a signal before it is trusted again; each relapse doubles the time.
    #[must_use]
    pub fn probation_of(&self, signal: SignalId) -> Span {
        self.probation(self.state_of(Component::Signal(signal)).record.relapses)
    }

    fn probation(&self, relapses: u32) -> Span {
        self.options.probation.times(1 << relapses.min(MOST_RELAPSES))
    }

    /// How often in a row a component was accused soon after it was trusted again, counting an accusation now.
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

    /// The verdict on a signal now.
    #[must_use]
    pub fn verdict(&self, signal: SignalId, evidence: &impl EvidenceView, now: Time) -> Verdict {
        let witnessed = || {
            evidence.pairs_of(signal).any(|pair| {
                pair.residual_state(now) == ResidualState::Agree
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

    /// Fails a signal whose own readings show a fault, so that its comparisons blame no other component. The signal is trusted
    /// again after its readings and all its comparisons have supported it for the probation time. Returns whether the verdict is
    /// new.
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

    /// Reviews all evidence. Complexity: O(restless pairs) while no pair is in conflict and no component is accused. Else that of
    /// [`explain`](super::candidates::explain), and that of [`probabilities`](super::candidates::probabilities) for each part
    /// with a decision; both are repeated a few times at most, after a decision.
    pub fn review(&mut self, evidence: &impl EvidenceView, now: Time) -> Vec<Decision> {
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

/// A review in progress: all evidence of one moment, and the decisions so far.
struct Review<'e, T> {
    judge: &'e mut Judge,
    evidence: &'e T,
    now: Time,
    decisions: Vec<Decision>,
}

/// The current value of a signal, SI; `None` when it is no number, or the component is no signal.
fn latest_value(evidence: &impl EvidenceView, component: Component) -> Option<Interval> {
    let Component::Signal(signal) = component else { return None };
    evidence.latest_value(signal)
}
