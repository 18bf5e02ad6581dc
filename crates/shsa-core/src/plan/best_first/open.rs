//! The state of the exact search: the decisions made, and the open states.

use crate::knowledge::RelationId;
use crate::plan::decisions::Decisions;
use crate::plan::frontier::{Frontier, StateId};
use crate::plan::limits::{Limits, StopReason};
use crate::plan::subproblem::{ChoiceId, Place, Subproblem};
use crate::plan::utility::Weight;
use crate::substitution::Substitution;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// The state of the search.
#[derive(Debug)]
pub(in super::super) struct Open {
    pub(super) decisions: Decisions,
    pub(super) frontier: Frontier,
    pub(super) expanded: u64,
    pub(super) pruned: u64,
    /// Sets of relations of earlier answers that could appear again with other outputs.
    pub(super) given: BTreeSet<Vec<RelationId>>,
    /// The states of the decisions made, from depth 1 on.
    pub(super) line: Vec<StateId>,
    pub(super) path: Vec<StateId>,
    /// The substitution of complete decisions, where requirements were checked on it.
    pub(super) checked: Option<Substitution>,
}

impl Open {
    pub(super) fn new(subproblem: &Subproblem) -> Open {
        let decisions = Decisions::new(subproblem);
        let frontier = Frontier::new(decisions.bound());
        Open {
            decisions,
            frontier,
            expanded: 0,
            pruned: 0,
            given: BTreeSet::new(),
            line: Vec::new(),
            path: Vec::new(),
            checked: None,
        }
    }

    /// The number of decisions taken.
    pub(in super::super) fn expanded(&self) -> u64 {
        self.expanded
    }

    /// The number of partial substitutions kept.
    pub(in super::super) fn states(&self) -> usize {
        self.frontier.len()
    }

    /// The number of open partial substitutions.
    pub(in super::super) fn count(&self) -> usize {
        self.frontier.open_count()
    }

    /// The smallest weight of an open state; `None` when none is open.
    pub(in super::super) fn bound(&self) -> Option<Weight> {
        self.frontier.open_bound()
    }

    /// The weight of the present decisions, and the decisions.
    pub(in super::super) fn rank(&self) -> (Weight, Vec<ChoiceId>) {
        (self.decisions.bound(), self.decisions.decisions())
    }

    /// The reached limit, while something is open.
    pub(super) fn limit(&self, limits: Limits, kept: usize) -> Option<StopReason> {
        self.frontier.open_bound()?;
        if self.expanded >= limits.expansions {
            return Some(StopReason::LimitExpansions);
        }
        (self.frontier.len() + kept >= limits.states).then_some(StopReason::LimitStates)
    }

    /// Whether the substitution is no earlier answer with other outputs.
    pub(super) fn is_new(&mut self, subproblem: &Subproblem) -> bool {
        self.decisions.ambiguous_relations(subproblem).is_none_or(|relations| self.given.insert(relations))
    }

    /// Takes back and makes decisions until they lead to a state, over the last common state; returns how many decisions beyond
    /// one this takes.
    pub(super) fn go_to(&mut self, subproblem: &Subproblem, target: StateId) -> u64 {
        let mut state = target;
        loop {
            let depth = self.frontier.depth(state);
            if depth == 0 || self.line.get(depth - 1) == Some(&state) {
                self.back_to(subproblem, depth);
                break;
            }
            self.path.push(state);
            state = self.frontier.last(state).1;
        }
        let again = self.path.len().saturating_sub(1) as u64;
        while let Some(state) = self.path.pop() {
            self.decisions.take(subproblem, self.frontier.last(state).0);
            self.line.push(state);
        }
        again
    }

    fn back_to(&mut self, subproblem: &Subproblem, depth: usize) {
        while self.line.len() > depth {
            self.decisions.back(subproblem);
            self.line.pop();
        }
    }

    /// Opens a state for each choice of the next place.
    pub(super) fn expand(&mut self, subproblem: &Subproblem, state: StateId, place: Place) {
        self.decisions.look_up_from(subproblem, place);
        for choice in subproblem.choices(place).rev() {
            if !self.decisions.closes_cycle(subproblem, choice) {
                let bound = self.decisions.bound_after(subproblem, place, choice);
                if !bound.is_impossible() {
                    self.frontier.push(state, choice, bound);
                }
            }
        }
    }
}
