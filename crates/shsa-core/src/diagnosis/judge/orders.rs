//! What operators order about components (forbid, allow, clear), and the records that outlast a restart.

use super::{Component, ComponentState, ConflictPair, Judge, Verdict};
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, RelationId, SignalId};
use crate::monitor::{WayIndex, rests_on};
use crate::substitution::Way;
use crate::time::Time;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// The stored verdict on a signal or relation, with what the evidence alone would not give again after a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// Suspect or failed; `None` for a component that is trusted again and kept for its relapses.
    pub verdict: Option<Verdict>,
    /// Whether the component was the only one accused: then it explains disagreements as a failed component does.
    pub alone: bool,
    /// Whether the readings of the signal itself have shown the fault: no comparison is needed to accuse it.
    pub failed_by_detector: bool,
    /// Whether only comparisons can clear the signal: they have contradicted it while its readings were plausible.
    pub contradicted: bool,
    /// Whether the component may serve, uncertain, where nothing else is left: for its probation no evidence has accused or
    /// supported it.
    pub unproven: bool,
    /// When the component was last trusted again.
    pub cleared: Option<Time>,
    /// How often in a row the component was accused again soon after it was trusted again; each time doubles its probation.
    pub relapses: u32,
    /// The value with which the signal was accused, SI. While the signal repeats it, an agreement means that the plant has come
    /// back to the value, and the signal is not cleared.
    pub latest_value: Option<Interval>,
}

impl Judge {
    /// Forbids a signal or relation: nothing may rest on it, and comparisons with it are no evidence about others. Returns
    /// whether that is new.
    pub fn forbid(&mut self, component: Component) -> bool {
        self.discounted.insert(component);
        self.forbidden.insert(component)
    }

    /// Takes [`Judge::forbid`] back; returns whether the component was forbidden.
    pub fn allow(&mut self, component: Component) -> bool {
        let was_forbidden = self.forbidden.remove(&component);
        if self.accusation(component) != Some(Verdict::Failed) {
            self.discounted.remove(&component);
        }
        was_forbidden
    }

    /// Whether a relation is neither suspect nor failed nor forbidden.
    #[must_use]
    pub fn trusts_relation(&self, relation: RelationId) -> bool {
        self.may_use(Component::Relation(relation))
    }

    /// The forbidden components, ascending.
    pub fn forbidden(&self) -> impl Iterator<Item = Component> + '_ {
        self.forbidden.iter().copied()
    }

    /// Whether a signal has failed by its verdict or is forbidden.
    #[must_use]
    pub fn is_discounted(&self, signal: SignalId) -> bool {
        self.discounted.contains(&Component::Signal(signal))
    }

    /// The forbidden components of a way, ascending: among the origins of its signals, and among its relations.
    #[must_use]
    pub fn forbidden_in(&self, knowledge: &KnowledgeBase, way: &Way) -> Vec<Component> {
        if self.forbidden.is_empty() {
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

    /// Whether neither a signal nor its origins have failed or are forbidden: the signal may be right, though it may be suspect.
    #[must_use]
    pub fn may_be_right(&self, signal: SignalId) -> bool {
        self.foundations[signal].iter().all(|origin| !self.discounted.contains(&Component::Signal(origin)))
    }

    /// The relations that have failed or are forbidden, ascending.
    #[must_use]
    pub fn refuted_relations(&self) -> Vec<RelationId> {
        let relation = |component: &Component| match component {
            Component::Relation(relation) => Some(*relation),
            Component::Signal(_) | Component::Cause(_) => None,
        };
        self.discounted.iter().filter_map(relation).collect()
    }

    /// Whether a component is suspect or failed.
    #[must_use]
    pub fn accuses(&self, component: Component) -> bool {
        self.accusation(component).is_some()
    }

    /// Clears a component because the operator vouches for it, whatever the evidence was. Returns whether it was accused.
    ///
    /// The signal counts as healthy until it is accused again, or [falls silent](Judge::lapse).
    pub fn clear_by_operator(&mut self, component: Component) -> bool {
        let was_accused = self.accuses(component);
        if was_accused {
            self.put(component, ComponentState { cleared_by_operator: true, ..ComponentState::default() });
        }
        was_accused
    }

    /// Ends the operator's voucher for a signal that gives no value any more.
    pub fn lapse(&mut self, signal: SignalId) {
        if let Some(state) = self.states.get_mut(&Component::Signal(signal)) {
            state.cleared_by_operator = false;
        }
    }

    /// The records of all components that were ever accused, by component.
    pub fn records(&self) -> impl Iterator<Item = (Component, Record)> + '_ {
        self.states.iter().map(|(component, state)| (*component, state.record))
    }

    /// Restores a record from before a restart. Its accusation stands until new evidence clears it.
    pub fn recall(&mut self, component: Component, record: Record) {
        let record = Record { relapses: record.relapses.min(super::MOST_RELAPSES), ..record };
        self.put(component, ComponentState { record, ..ComponentState::default() });
    }

    /// The comparisons that have disagreed with an accused component, by their two ways; none for any other.
    pub fn conflicts_of(&self, component: Component) -> impl Iterator<Item = (WayIndex, WayIndex)> + '_ {
        self.conflicts.get(&component).into_iter().flatten().copied()
    }

    /// Restores the comparisons that have disagreed with an accused component before a restart.
    pub fn recall_conflicts(
        &mut self,
        component: Component,
        conflicts: impl Iterator<Item = (WayIndex, WayIndex)>,
    ) {
        let conflicts: BTreeSet<ConflictPair> = conflicts.collect();
        if self.accuses(component) && !conflicts.is_empty() {
            self.conflicts.insert(component, conflicts);
        }
    }
}
