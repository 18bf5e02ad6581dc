//! SH-PGSA, self-healing by property-guided structural adaptation: workers that make one step at a time.
//!
//! Ratasich, Preindl, Selyunin, Grosu, "Self-healing by property-guided structural adaptation", ICPS 2018,
//! doi:10.1109/ICPHYS.2018.8387659, and Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien 2019, ch. 6. A worker holds a
//! partial substitution. In each round the worker with the best utility makes a step: it decides all variables that its last
//! relations need and that are not provided, by a combination of one relation for each; the other combinations become workers. A
//! worker without open variables is an answer. Open variables count with utility 1: only the decisions guide the search, where
//! [`BestFirst`](super::BestFirst) looks ahead.
//!
//! The public program of the thesis has errors:
//! * Its first answer is not always the best: when a step makes the first worker worse than another, the program compares the
//!   worker with itself and leaves it first; and a finished worker is returned even if an open one is better. Here all
//!   workers are in one queue, finished ones included, and utility only falls with further steps: when a finished worker
//!   comes first, no open one can become better.
//! * It misses answers when a variable that is not provided is needed at two depths, since a relation in use is no candidate
//!   a second time; and it can then choose two relations for that variable. Here a variable is decided once, when it is
//!   first needed.
//! * It makes a worker for every combination at once. Here the combinations of a round are made one by one, the next best
//!   first, and those that close a cycle are dropped.
//! * It breaks ties in the order of a hash set. Here the order is that of the other searches.

use super::Plan;
use super::choices::Choices;
use super::graph::{Graph, Options};
use super::limits::{Limits, StopReason, states};
use super::partial::Partial;
use super::utility::{Scale, Weight};
use super::workers::{State, WorkerId, Workers};
use crate::knowledge::{RelationId, VariableId};
use crate::substitution::Substitution;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

/// The `count` best substitutions of `root`, best first, in the order of [`exhaustive`](super::exhaustive()).
///
/// When a limit is reached before the first answer is proven, the plan has the best finished worker, if there is one.
/// [`Limits::states`] counts workers and their choices. Complexity: exponential; each combination costs O(log n) for n open
/// workers, and its decisions.
#[must_use]
pub fn property_guided(
    graph: &Graph,
    root: VariableId,
    options: &Options,
    count: usize,
    limits: Limits,
) -> Plan {
    search(graph, root, options, count, limits, None)
}

/// Searches as [`property_guided`], and passes on each step when it is made.
#[must_use]
pub fn property_guided_traced(
    graph: &Graph,
    root: VariableId,
    options: &Options,
    count: usize,
    limits: Limits,
    pass: &mut dyn FnMut(Step),
) -> Plan {
    search(graph, root, options, count, limits, Some(pass))
}

/// A step of the search: a worker decides all variables that are open after an earlier step.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The number of steps from the beginning to this one.
    pub depth: usize,
    /// The number of the step that it goes on from, counted from 1 in the order of making; `None` for a first step.
    pub after: Option<usize>,
    /// The decided variables, each with its relation; `None` where it is provided.
    pub decisions: Vec<(VariableId, Option<RelationId>)>,
    /// The utility of all decisions so far; an upper bound for a step that was dropped.
    pub utility: f64,
    /// What the step leads to.
    pub leaves: Leaves,
}

/// What a step of the search leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaves {
    /// Variables that are to be decided.
    Open,
    /// Nothing: the substitution is complete. It is an answer once no other worker is better.
    Complete,
    /// A cycle: the step is dropped.
    Cycle,
}

fn search(
    graph: &Graph,
    root: VariableId,
    options: &Options,
    count: usize,
    limits: Limits,
    pass: Option<&mut dyn FnMut(Step)>,
) -> Plan {
    let choices = Choices::new(graph, root, options);
    if let Some(refusal) = choices.refusal() {
        return refusal;
    }
    let trace = pass.map(|pass| Trace { pass, steps: 0, numbers: BTreeMap::new() });
    Search::new(choices, trace).run(count, limits)
}

/// Where steps are passed on.
struct Trace<'p> {
    pass: &'p mut dyn FnMut(Step),
    /// The number of steps made.
    steps: usize,
    /// The numbers of the workers' steps.
    numbers: BTreeMap<WorkerId, usize>,
}

/// A worker whose decisions are part of the present ones.
#[derive(Debug)]
struct Stand {
    worker: WorkerId,
    /// The number of decisions before its combination.
    decided: usize,
}

struct Search<'a, 'p> {
    scale: Scale,
    trace: Option<Trace<'p>>,
    partial: Partial<'a>,
    workers: Workers,
    /// The workers of the present partial substitution, from depth 1 on.
    line: Vec<Stand>,
    expanded: u64,
    /// Sets of relations of earlier answers that could appear again with other outputs.
    given: BTreeSet<Vec<RelationId>>,
    substitutions: Vec<(Substitution, f64)>,
    /// The size of these in [`Limits::states`].
    kept: usize,
}

impl<'a, 'p> Search<'a, 'p> {
    fn new(choices: Choices<'a>, trace: Option<Trace<'p>>) -> Search<'a, 'p> {
        Search {
            scale: choices.scale(),
            trace,
            workers: Workers::new(choices.scale()),
            partial: Partial::new(choices),
            line: Vec::new(),
            expanded: 0,
            given: BTreeSet::new(),
            substitutions: Vec::new(),
            kept: 0,
        }
    }

    fn run(mut self, count: usize, limits: Limits) -> Plan {
        let stop = loop {
            if self.substitutions.len() >= count {
                break StopReason::Found(self.substitutions.len());
            }
            if self.workers.lightest().is_none() {
                break StopReason::Complete;
            }
            if let Some(limit) = self.limit(limits) {
                self.take_done();
                break limit;
            }
            if let Some((worker, weight)) = self.workers.pop() {
                self.step(worker, weight);
            }
        };
        let open = self.workers.lightest();
        let bound = open.map_or(self.scale.worst(), |weight| self.scale.utility(weight));
        Plan { substitutions: self.substitutions, stop, expanded: self.expanded, bound }
    }

    fn limit(&self, limits: Limits) -> Option<StopReason> {
        if self.expanded >= limits.expansions {
            return Some(StopReason::LimitExpansions);
        }
        (self.workers.kept() + self.kept >= limits.states).then_some(StopReason::LimitStates)
    }

    fn step(&mut self, worker: WorkerId, weight: Weight) {
        match self.workers.state(worker) {
            State::Potential => {
                self.workers.follow(worker, weight);
                self.make(worker, weight);
            }
            State::Open => {
                self.go_to(worker);
                if let Some((choices, own)) = self.partial.round() {
                    self.workers.expand(worker, weight, choices, own);
                }
            }
            State::Done => self.answer(worker),
        }
    }

    /// Decides a combination; one that closes a cycle is dropped.
    fn make(&mut self, worker: WorkerId, least: Weight) {
        self.go_to(self.workers.before(worker));
        let open = if self.trace.is_some() { self.partial.open().to_vec() } else { Vec::new() };
        let (leaves, weight) = if !self.decide(worker) {
            (Leaves::Cycle, least)
        } else if self.partial.open().is_empty() {
            self.workers.make(worker, self.partial.weight(), State::Done);
            (Leaves::Complete, self.partial.weight())
        } else {
            self.workers.make(worker, self.partial.weight(), State::Open);
            (Leaves::Open, self.partial.weight())
        };
        self.pass_on(worker, &open, weight, leaves);
    }

    /// Passes on the step of a worker that decided these variables.
    fn pass_on(&mut self, worker: WorkerId, open: &[VariableId], weight: Weight, leaves: Leaves) {
        let Some(trace) = &mut self.trace else { return };
        trace.steps += 1;
        trace.numbers.insert(worker, trace.steps);
        let relations = self.workers.combination(worker).map(|choice| choice.relation);
        (trace.pass)(Step {
            depth: self.workers.depth(worker).saturating_sub(1),
            after: trace.numbers.get(&self.workers.before(worker)).copied(),
            decisions: open.iter().copied().zip(relations).collect(),
            utility: self.scale.utility(weight),
            leaves,
        });
    }

    /// Makes the decisions of a worker's combination, all or none.
    fn decide(&mut self, worker: WorkerId) -> bool {
        let decided = self.partial.decided();
        for choice in self.workers.combination(worker) {
            self.expanded += 1;
            if !self.partial.take(choice) {
                self.partial.back_to(decided);
                return false;
            }
        }
        self.line.push(Stand { worker, decided });
        true
    }

    /// Moves to the decisions of a made worker, over the last common worker.
    fn go_to(&mut self, target: WorkerId) {
        let mut path = Vec::new();
        let mut worker = target;
        loop {
            let depth = self.workers.depth(worker);
            let common = depth.checked_sub(1).is_none_or(|last| self.stands_on(last, worker));
            if common {
                self.back_to(depth);
                break;
            }
            path.push(worker);
            worker = self.workers.before(worker);
        }
        while let Some(worker) = path.pop() {
            self.decide(worker);
        }
    }

    fn stands_on(&self, at: usize, worker: WorkerId) -> bool {
        self.line.get(at).is_some_and(|stand| stand.worker == worker)
    }

    fn back_to(&mut self, depth: usize) {
        if let Some(stand) = self.line.get(depth) {
            self.partial.back_to(stand.decided);
            self.line.truncate(depth);
        }
    }

    /// Returns the substitution of a finished worker as an answer, unless an earlier one has the same relations.
    fn answer(&mut self, worker: WorkerId) {
        self.go_to(worker);
        let (substitution, ambiguous) = self.partial.substitution();
        let relations = if ambiguous { substitution.relations() } else { Vec::new() };
        let decisions = relations.len() + substitution.steps.len() + substitution.sources.len();
        if !ambiguous || self.given.insert(relations) {
            self.kept += states(decisions);
            self.substitutions.push((substitution, self.scale.utility(self.partial.weight())));
        }
    }

    /// Without a proven answer at a limit, returns the best finished worker.
    fn take_done(&mut self) {
        if self.substitutions.is_empty()
            && let Some(worker) = self.workers.pop_done()
        {
            self.answer(worker);
        }
    }
}
