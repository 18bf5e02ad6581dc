//! The exact search: substitutions in the order of their utility, as many as are asked for, without finding all.
//!
//! A* over partial substitutions (Hart, Nilsson, Raphael 1968, doi:10.1109/TSSC.1968.300136). The variables that
//! a partial substitution needs are decided breadth first, so each substitution is built in exactly one way; the
//! bound is what the decided relations weigh plus what the undecided places must weigh at least
//! ([`Scope`] says why). On trees the bound is exact, and the first answer is found without a detour. On graphs
//! with shared variables the best substitution is NP-hard to find (it is the delete relaxation of planning:
//! Bylander 1994, doi:10.1016/0004-3702(94)90081-7), hence the limits.

use super::frontier::{Frontier, StateId};
use super::graph::{Graph, Options, View};
use super::greedy;
use super::limits::{Limits, StopReason};
use super::scope::{Marks, Place, Rules, Scope};
use super::trail::Trail;
use crate::knowledge::{RelationId, VariableId};
use crate::substitution::Substitution;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// A search that gives one substitution after another, best first.
///
/// Ties are broken by fewer relations, then by file order: of the first variables, breadth first from the root,
/// that two substitutions know in different ways, the one whose relation stands earlier in the model is first
/// (and a variable's own signals are before its relations).
#[derive(Debug)]
pub struct BestFirst {
    root: VariableId,
    scope: Scope,
    trail: Trail,
    frontier: Frontier,
    limits: Limits,
    expanded: u64,
    found: usize,
    stop: Option<StopReason>,
    /// Sets of relations that were given and could appear again with other outputs.
    given: BTreeSet<Vec<RelationId>>,
    /// The states that the trail stands on, from depth 1 on.
    line: Vec<StateId>,
    path: Vec<StateId>,
}

impl BestFirst {
    /// Starts a search for ways of knowing `root`. Complexity: O(part of the graph that can be reached).
    #[must_use]
    pub fn new(graph: &Graph, root: VariableId, options: &Options, limits: Limits) -> BestFirst {
        BestFirst::with_marks(&mut Marks::default(), graph, root, options, limits)
    }

    /// As [`BestFirst::new`]; many searches that share their marks do not set them up anew.
    #[must_use]
    pub fn with_marks(
        marks: &mut Marks,
        graph: &Graph,
        root: VariableId,
        options: &Options,
        limits: Limits,
    ) -> BestFirst {
        marks.fit(graph.variables(), graph.relations());
        let rules =
            Rules { substitute_provided: options.substitute_provided, without_empty: options.without_empty };
        let scope = Scope::new(&View::new(graph, options), root, rules, marks);
        let trail = Trail::new(&scope);
        let frontier = Frontier::new(trail.bound());
        BestFirst {
            root,
            trail,
            frontier,
            limits,
            expanded: 0,
            found: 0,
            stop: BestFirst::refusal(graph, &scope),
            given: BTreeSet::new(),
            line: Vec::new(),
            path: Vec::new(),
            scope,
        }
    }

    fn refusal(graph: &Graph, scope: &Scope) -> Option<StopReason> {
        if !graph.is_monotone() {
            return Some(StopReason::NotMonotone);
        }
        scope.root().is_none().then_some(StopReason::Complete)
    }

    /// Why the last call of `next` gave nothing; [`StopReason::Found`] while there may be more.
    #[must_use]
    pub fn stop(&self) -> StopReason {
        self.stop.unwrap_or(StopReason::Found(self.found))
    }

    /// How many decisions were taken, those that were taken up again after a jump included.
    #[must_use]
    pub fn expanded(&self) -> u64 {
        self.expanded
    }

    /// No substitution that is still to come has a higher utility; 0 when none can come.
    #[must_use]
    pub fn bound(&self) -> f64 {
        match self.stop {
            Some(StopReason::Complete) => 0.0,
            Some(StopReason::NotMonotone) => 1.0,
            _ => self.frontier.open_bound().map_or(0.0, |bound| bound.utility()),
        }
    }

    /// A substitution that is valid, but perhaps not the best: for when a limit leaves nothing better.
    ///
    /// It is the best one on trees. Complexity: O(n log n) for n inputs that can be reached.
    #[must_use]
    pub fn any(&mut self) -> Option<(Substitution, f64)> {
        if self.stop == Some(StopReason::NotMonotone) {
            return None;
        }
        self.back_to(0);
        let choices = greedy::choices(&self.scope);
        let mut decisions = 0;
        while let Some(choice) = self.trail.next().and_then(|place| choices[place]) {
            self.trail.take(&self.scope, choice);
            decisions += 1;
        }
        let complete = decisions > 0 && self.trail.next().is_none();
        let answer = complete.then(|| self.answer());
        for _ in 0..decisions {
            self.trail.back(&self.scope);
        }
        answer
    }

    fn answer(&self) -> (Substitution, f64) {
        (self.trail.substitution(&self.scope, self.root), self.trail.bound().utility())
    }

    /// Moves the trail to a state, over the last state that both have in common.
    fn go_to(&mut self, target: StateId) {
        let mut state = target;
        loop {
            let depth = self.frontier.depth(state);
            if depth == 0 || self.line.get(depth - 1) == Some(&state) {
                self.back_to(depth);
                break;
            }
            self.path.push(state);
            state = self.frontier.last(state).1;
        }
        self.expanded += self.path.len().saturating_sub(1) as u64;
        while let Some(state) = self.path.pop() {
            self.trail.take(&self.scope, self.frontier.last(state).0);
            self.line.push(state);
        }
    }

    fn back_to(&mut self, depth: usize) {
        while self.line.len() > depth {
            self.trail.back(&self.scope);
            self.line.pop();
        }
    }

    /// Opens a state for each way of deciding the next place.
    fn expand(&mut self, state: StateId, place: Place) {
        self.expanded += 1;
        self.trail.look_up_from(&self.scope, place);
        for choice in self.scope.choices(place).rev() {
            if !self.trail.closes_cycle(&self.scope, choice) {
                let bound = self.trail.bound_after(&self.scope, place, choice);
                self.frontier.push(state, choice, bound);
            }
        }
    }

    fn limit(&self) -> Option<StopReason> {
        if self.expanded >= self.limits.expansions {
            return Some(StopReason::LimitExpansions);
        }
        (self.frontier.len() >= self.limits.states).then_some(StopReason::LimitStates)
    }

    /// Whether the substitution that the trail stands at was not given before, with other outputs.
    fn is_new(&mut self) -> bool {
        self.trail.ambiguous_relations(&self.scope).is_none_or(|relations| self.given.insert(relations))
    }
}

impl Iterator for BestFirst {
    type Item = (Substitution, f64);

    /// The next best substitution and its utility; `None` tells that [`BestFirst::stop`] has a reason.
    fn next(&mut self) -> Option<Self::Item> {
        while self.stop.is_none() {
            let Some(state) = self.frontier.pop() else {
                self.stop = Some(StopReason::Complete);
                break;
            };
            if let Some(limit) = self.limit() {
                self.frontier.put_back(state);
                self.stop = Some(limit);
                break;
            }
            self.go_to(state);
            match self.trail.next() {
                Some(place) => self.expand(state, place),
                None if self.is_new() => {
                    self.found += 1;
                    return Some(self.answer());
                }
                None => {}
            }
        }
        None
    }
}
