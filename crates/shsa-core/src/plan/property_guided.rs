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
use super::progress::Progress;
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
    match Search::begin(graph, root, options) {
        Ok(search) => search.run(count, limits, &mut |_| {}),
        Err(refusal) => refusal,
    }
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
    match Search::begin(graph, root, options) {
        Ok(search) => Search { trace: Some(Trace::default()), ..search }.run(count, limits, pass),
        Err(refusal) => refusal,
    }
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

/// The numbers of the steps made.
#[derive(Clone, Debug, Default)]
struct Trace {
    /// The number of steps made.
    steps: usize,
    /// The numbers of the workers' steps.
    numbers: BTreeMap<WorkerId, usize>,
    /// The last step, until it is passed on.
    last: Option<Step>,
}

/// A worker whose decisions are part of the present ones.
#[derive(Clone, Debug)]
struct Stand {
    worker: WorkerId,
    /// The number of decisions before its combination.
    decided: usize,
}

/// The state of the search.
#[derive(Clone, Debug)]
pub(super) struct Search<'a> {
    scale: Scale,
    trace: Option<Trace>,
    partial: Partial<'a>,
    workers: Workers,
    /// The workers of the present partial substitution, from depth 1 on.
    line: Vec<Stand>,
    expanded: u64,
    /// Sets of relations of earlier answers that could appear again with other outputs.
    given: BTreeSet<Vec<RelationId>>,
    /// The size of these in [`Limits::states`].
    given_states: usize,
}

impl<'a> Search<'a> {
    /// A search before the first step; the answer instead for a graph that must not be searched.
    pub(super) fn begin(graph: &'a Graph, root: VariableId, options: &Options) -> Result<Search<'a>, Plan> {
        let choices = Choices::new(graph, root, options);
        if let Some(refusal) = choices.refusal() {
            return Err(refusal);
        }
        Ok(Search {
            scale: choices.scale(),
            trace: None,
            workers: Workers::new(choices.scale()),
            partial: Partial::new(choices),
            line: Vec::new(),
            expanded: 0,
            given: BTreeSet::new(),
            given_states: 0,
        })
    }

    fn run(mut self, count: usize, limits: Limits, pass: &mut dyn FnMut(Step)) -> Plan {
        let (mut substitutions, mut kept) = (Vec::new(), 0);
        let stop = loop {
            if substitutions.len() >= count {
                break StopReason::Found(substitutions.len());
            }
            if self.bound().is_none() {
                break StopReason::Complete;
            }
            if let Some(limit) = self.limit(limits, kept) {
                // Without a proven answer, the best finished worker has to do.
                let done = if substitutions.is_empty() { self.any() } else { None };
                substitutions.extend(done);
                break limit;
            }
            if self.advance() == Progress::Answer {
                let (substitution, utility) = self.answer();
                kept += states(substitution.steps.len() + substitution.sources.len());
                substitutions.push((substitution, utility));
            }
            self.trace.as_mut().and_then(|trace| trace.last.take()).into_iter().for_each(&mut *pass);
        };
        let open = self.bound();
        let bound = open.map_or(self.scale.worst(), |weight| self.scale.utility(weight));
        Plan { substitutions, stop, expanded: self.expanded, bound }
    }

    fn limit(&self, limits: Limits, kept: usize) -> Option<StopReason> {
        if self.expanded >= limits.expansions {
            return Some(StopReason::LimitExpansions);
        }
        (self.kept() + kept >= limits.states).then_some(StopReason::LimitStates)
    }

    /// Lets the first open worker make a step, or reaches an answer.
    pub(super) fn advance(&mut self) -> Progress {
        let Some((worker, weight)) = self.workers.pop() else { return Progress::End };
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
            State::Done => return self.finish(worker),
        }
        Progress::Decision
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
        self.note(worker, &open, weight, leaves);
    }

    /// Notes the step of a worker that decided these variables, to be passed on.
    fn note(&mut self, worker: WorkerId, open: &[VariableId], weight: Weight, leaves: Leaves) {
        let Some(trace) = &mut self.trace else { return };
        trace.steps += 1;
        trace.numbers.insert(worker, trace.steps);
        let relations = self.workers.combination(worker).map(|choice| choice.relation);
        trace.last = Some(Step {
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

    /// Goes to a finished worker: an answer, unless an earlier one has the same relations.
    fn finish(&mut self, worker: WorkerId) -> Progress {
        self.go_to(worker);
        let Some(relations) = self.partial.ambiguous_relations() else { return Progress::Answer };
        let size = states(relations.len());
        if !self.given.insert(relations) {
            return Progress::Decision;
        }
        self.given_states += size;
        Progress::Answer
    }

    /// The `at`-th share of the open workers, as a search of its own. Past decisions and answers are the first one's.
    pub(super) fn share(&self, at: usize, shares: usize) -> Search<'a> {
        let mut share = Search { workers: self.workers.share(at, shares), ..self.clone() };
        if at > 0 {
            (share.expanded, share.given_states) = (0, 0);
            share.given.clear();
        }
        share
    }

    /// The number of open workers.
    pub(super) fn open_count(&self) -> usize {
        self.workers.open_count()
    }

    /// The smallest weight of an open worker; `None` when none is open.
    pub(super) fn bound(&self) -> Option<Weight> {
        self.workers.lightest()
    }

    /// The number of decisions made, including repeated ones after a jump.
    pub(super) fn expanded(&self) -> u64 {
        self.expanded
    }

    /// The weight and the relations of the present decisions.
    pub(super) fn rank(&self) -> (Weight, impl Iterator<Item = Option<RelationId>>) {
        (self.partial.weight(), self.partial.relations())
    }

    /// The size of all that is kept in [`Limits::states`], without the answers.
    pub(super) fn kept(&self) -> usize {
        self.workers.kept() + self.given_states
    }

    /// The substitution of the present decisions, which are complete, and its utility.
    pub(super) fn answer(&self) -> (Substitution, f64) {
        (self.partial.substitution(), self.scale.utility(self.partial.weight()))
    }

    /// The best finished worker, although an open one may become better.
    pub(super) fn any(&mut self) -> Option<(Substitution, f64)> {
        let worker = self.workers.pop_done()?;
        self.go_to(worker);
        Some(self.answer())
    }
}
