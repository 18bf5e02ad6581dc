//! What the judge is told from outside: what is forbidden, who is vouched for, and what was thought before a restart.

use super::{Component, ComponentState, Judge, Verdict};
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, RelationId, SignalId};
use crate::monitor::rests_on;
use crate::substitution::Way;
use crate::time::Time;
use alloc::vec::Vec;

/// What is thought of a signal or relation, as far as evidence alone does not bring it back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// Suspect or failed; `None` for what is trusted again and remembered for its relapses.
    pub verdict: Option<Verdict>,
    /// Whether it was the only one accused: it explains disagreements as a failed signal does.
    pub alone: bool,
    /// Whether its own readings have shown the fault: no comparison is needed to accuse it.
    pub failed_by_detector: bool,
    /// Whether only comparisons can clear it: they have contradicted it while its readings were where they could be.
    pub contradicted: bool,
    /// Whether it may serve, uncertain, where nothing else is left: for its probation nothing has spoken against it or for it.
    pub unproven: bool,
    /// When it was last trusted again.
    pub cleared: Option<Time>,
    /// How often it was accused again soon after it was trusted again, in a row; each doubles its probation.
    pub relapses: u32,
    /// What it said when it was accused, SI: while it says the same, it is the plant that came back to it, and nothing clears it.
    pub said: Option<Interval>,
}

impl Judge {
    /// Nothing may rest on a signal or relation from now on, and comparisons with it are no evidence about others.
    /// Whether that is new.
    pub fn forbid(&mut self, component: Component) -> bool {
        self.discounted.insert(component);
        self.forbidden.insert(component)
    }

    /// Takes [`Judge::forbid`] back; whether it was forbidden.
    pub fn allow(&mut self, component: Component) -> bool {
        let was_forbidden = self.forbidden.remove(&component);
        if self.accusation(component) != Some(Verdict::Failed) {
            self.discounted.remove(&component);
        }
        was_forbidden
    }

    /// What is forbidden, ascending.
    pub fn forbidden(&self) -> impl Iterator<Item = Component> + '_ {
        self.forbidden.iter().copied()
    }

    /// Whether a signal has failed by its verdict or is forbidden.
    #[must_use]
    pub fn is_discounted(&self, signal: SignalId) -> bool {
        self.discounted.contains(&Component::Signal(signal))
    }

    /// What is forbidden in a way, ascending: of what its signals come from, and of its relations.
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

    /// Whether neither a signal nor anything that it is derived from has failed or is forbidden: it may be right, though it may
    /// be suspect.
    #[must_use]
    pub fn may_be_right(&self, signal: SignalId) -> bool {
        self.foundations[signal].iter().all(|origin| !self.discounted.contains(&Component::Signal(origin)))
    }

    /// Relations that have failed or are forbidden, ascending.
    #[must_use]
    pub fn refuted_relations(&self) -> Vec<RelationId> {
        let relation = |component: &Component| match component {
            Component::Relation(relation) => Some(*relation),
            Component::Signal(_) | Component::Cause(_) => None,
        };
        self.discounted.iter().filter_map(relation).collect()
    }

    /// Whether something is suspect or failed.
    #[must_use]
    pub fn accuses(&self, component: Component) -> bool {
        self.accusation(component).is_some()
    }

    /// The operator vouches for something: it is not accused any more, whatever came before. Whether it was.
    ///
    /// A signal counts as healthy by this until it is accused again, or [falls silent](Judge::lapse).
    pub fn clear_by_operator(&mut self, component: Component) -> bool {
        let was_accused = self.accuses(component);
        if was_accused {
            self.put(component, ComponentState { cleared_by_operator: true, ..ComponentState::default() });
        }
        was_accused
    }

    /// A signal gives no value any more: nobody vouches for what comes after that.
    pub fn lapse(&mut self, signal: SignalId) {
        if let Some(state_of) = self.standings.get_mut(&Component::Signal(signal)) {
            state_of.cleared_by_operator = false;
        }
    }

    /// What is to be remembered of everything that was ever accused, by component.
    pub fn records(&self) -> impl Iterator<Item = (Component, Record)> + '_ {
        self.standings.iter().map(|(component, state_of)| (*component, state_of.record))
    }

    /// Goes on with what was thought before a restart: an accusation stands until evidence that is new speaks against it.
    pub fn recall(&mut self, component: Component, record: Record) {
        let record = Record { relapses: record.relapses.min(super::MOST_RELAPSES), ..record };
        self.put(component, ComponentState { record, ..ComponentState::default() });
    }
}
