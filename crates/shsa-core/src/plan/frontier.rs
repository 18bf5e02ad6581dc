//! The open states of a search, and their order.
//!
//! Partial substitutions form a tree of decisions. The lightest bound comes first; among equal bounds, the one whose decisions
//! come first in file order. The states of the current bound are a stack that is walked depth first, which is exactly that order;
//! heavier ones wait in a heap.

use super::subproblem::ChoiceId;
use super::utility::Weight;
use crate::knowledge::{Id, IdVec};
use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::{Ordering, Reverse};

/// A partial substitution: a decision after those of another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct StateId(u32);

impl Id for StateId {
    fn from_index(index: usize) -> Self {
        StateId(index as u32)
    }
    fn index(self) -> usize {
        self.0 as usize
    }
}

#[derive(Clone, Copy, Debug)]
struct State {
    before: StateId,
    /// An earlier state, such that any earlier one can be found in O(log depth) (Myers, "An applicative random-access stack",
    /// 1983, doi:10.1016/0020-0190(83)90106-0).
    far_before: StateId,
    depth: u32,
    choice: ChoiceId,
}

/// All states of a search, and which of them are open.
#[derive(Debug)]
pub(super) struct Frontier {
    states: IdVec<StateId, State>,
    waiting: BinaryHeap<Reverse<(Weight, StateId)>>,
    current: Vec<StateId>,
    bound: Weight,
}

impl Frontier {
    /// The frontier with only the state before the first decision.
    pub(super) fn new(bound: Weight) -> Frontier {
        let mut states = IdVec::new();
        let start = StateId(0);
        let open = states.push(State {
            before: start,
            far_before: start,
            depth: 0,
            choice: ChoiceId::from_index(0),
        });
        Frontier { states, waiting: BinaryHeap::new(), current: Vec::from([open]), bound }
    }

    /// Distributes the open states to several frontiers, the lightest first.
    pub(super) fn deal(self, parts: usize) -> Vec<Frontier> {
        let mut open: Vec<(Weight, StateId)> =
            self.current.iter().map(|&state| (self.bound, state)).collect();
        open.extend(self.waiting.into_iter().map(|Reverse(waiting)| waiting));
        open.sort_unstable();
        let share =
            |part: usize| open.iter().skip(part).step_by(parts.max(1)).copied().map(Reverse).collect();
        let frontier = |part| Frontier {
            states: self.states.clone(),
            waiting: share(part),
            current: Vec::new(),
            bound: Weight::ZERO,
        };
        (0..parts).map(frontier).collect()
    }

    /// The number of open states.
    pub(super) fn open_count(&self) -> usize {
        self.current.len() + self.waiting.len()
    }

    /// The number of states, open or not.
    pub(super) fn len(&self) -> usize {
        self.states.len()
    }

    /// The lightest bound of an open state; `None` when none is open.
    pub(super) fn open_bound(&self) -> Option<Weight> {
        let waiting = || self.waiting.peek().map(|Reverse((bound, _))| *bound);
        if self.current.is_empty() { waiting() } else { Some(self.bound) }
    }

    /// Takes the first open state.
    pub(super) fn pop(&mut self) -> Option<StateId> {
        if self.current.is_empty() {
            self.refill();
        }
        self.current.pop()
    }

    /// Opens a state; successors of one state must come in reverse file order.
    pub(super) fn push(&mut self, before: StateId, choice: ChoiceId, bound: Weight) {
        let far = self.states[before].far_before;
        let farther = self.states[far].far_before;
        let depth = |state: StateId| self.states[state].depth;
        let jump = depth(before) - depth(far) == depth(far) - depth(farther);
        let far_before = if jump { farther } else { before };
        let state = self.states.push(State { before, far_before, depth: depth(before) + 1, choice });
        // A bound below the current one occurs because an earlier lower bound was tighter.
        if bound <= self.bound {
            self.current.push(state);
        } else {
            self.waiting.push(Reverse((bound, state)));
        }
    }

    fn refill(&mut self) {
        let Some(&Reverse((bound, _))) = self.waiting.peek() else { return };
        self.bound = bound;
        while let Some(&Reverse((next, state))) = self.waiting.peek()
            && next == bound
        {
            self.waiting.pop();
            self.current.push(state);
        }
        let mut current = core::mem::take(&mut self.current);
        if current.len() > 1 {
            current.sort_unstable_by(|&a, &b| self.file_order(b, a));
        }
        self.current = current;
    }

    /// The number of decisions of a state.
    pub(super) fn depth(&self, state: StateId) -> usize {
        self.states[state].depth as usize
    }

    /// The last decision of a state, and the state before it.
    pub(super) fn last(&self, state: StateId) -> (ChoiceId, StateId) {
        (self.states[state].choice, self.states[state].before)
    }

    /// Compares the first decisions that differ. O(log depth).
    fn file_order(&self, a: StateId, b: StateId) -> Ordering {
        let depth = self.states[a].depth.min(self.states[b].depth);
        let (mut a, mut b) = (self.at_depth(a, depth), self.at_depth(b, depth));
        while a != b {
            let (x, y) = (self.states[a], self.states[b]);
            if x.before == y.before {
                return x.choice.cmp(&y.choice);
            }
            let far = x.far_before != y.far_before;
            (a, b) = if far { (x.far_before, y.far_before) } else { (x.before, y.before) };
        }
        Ordering::Equal
    }

    fn at_depth(&self, mut state: StateId, depth: u32) -> StateId {
        while self.states[state].depth > depth {
            let State { before, far_before, .. } = self.states[state];
            state = if self.states[far_before].depth >= depth { far_before } else { before };
        }
        state
    }
}
