//! The workers of [`property_guided`](super::property_guided()), and their order.

use super::choices::Choice;
use super::combinations::{Change, Round};
use super::utility::{Scale, Weight};
use crate::knowledge::{Id, IdVec};
use alloc::boxed::Box;
use alloc::collections::BinaryHeap;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::cmp::{Ordering, Reverse};

/// A worker, numbered in the order of making.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct WorkerId(u32);

impl Id for WorkerId {
    fn from_index(index: usize) -> Self {
        WorkerId(index as u32)
    }
    fn index(self) -> usize {
        self.0 as usize
    }
}

/// The state of a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// The combination is not yet decided: its weight is a lower bound.
    Potential,
    /// The decisions are made, and leave variables open.
    Open,
    /// No variable is open: the worker is an answer.
    Done,
}

/// A combination of choices, after the decisions of another worker.
#[derive(Clone, Debug)]
struct Worker {
    before: WorkerId,
    /// An earlier worker, such that any earlier one can be found in O(log depth) (Myers, "An applicative random-access stack",
    /// 1983, doi:10.1016/0020-0190(83)90106-0).
    far_before: WorkerId,
    depth: u32,
    /// The changes by ascending position.
    changes: Vec<Change>,
    /// The last turn with a changed position.
    turn: Option<u32>,
    state: State,
    /// The next decisions, once the worker is expanded.
    round: Option<Box<Round>>,
}

/// All workers of a search, and which of them are open: the lightest comes first, among equals the one whose decisions come first
/// in file order.
#[derive(Clone, Debug)]
pub(super) struct Workers {
    scale: Scale,
    workers: IdVec<WorkerId, Worker>,
    waiting: BinaryHeap<Reverse<(Weight, WorkerId)>>,
    /// The open workers of the current weight, the first one last.
    current: Vec<WorkerId>,
    weight: Weight,
    kept: usize,
}

impl Workers {
    /// The workers at the start: one without decisions.
    pub(super) fn new(scale: Scale) -> Workers {
        let start = WorkerId(0);
        let first = Worker {
            before: start,
            far_before: start,
            depth: 0,
            changes: Vec::new(),
            turn: None,
            state: State::Open,
            round: None,
        };
        let mut workers = IdVec::new();
        let current = Vec::from([workers.push(first)]);
        Workers { scale, workers, waiting: BinaryHeap::new(), current, weight: Weight::ZERO, kept: 1 }
    }

    /// The number of workers, and of their choices and changes.
    pub(super) fn kept(&self) -> usize {
        self.kept
    }

    /// The number of open workers.
    pub(super) fn open_count(&self) -> usize {
        self.current.len() + self.waiting.len()
    }

    /// The `at`-th share of the open workers, dealt out lightest first.
    pub(super) fn share(&self, at: usize, shares: usize) -> Workers {
        let mut open: Vec<_> = self.current.iter().map(|&worker| (self.weight, worker)).collect();
        open.extend(self.waiting.iter().map(|Reverse(waiting)| *waiting));
        open.sort_unstable();
        let waiting = open.into_iter().skip(at).step_by(shares.max(1)).map(Reverse).collect();
        Workers { waiting, current: Vec::new(), weight: Weight::ZERO, ..self.clone() }
    }

    /// The weight of the first open worker; `None` when none is open.
    pub(super) fn lightest(&self) -> Option<Weight> {
        let waiting = || self.waiting.peek().map(|Reverse((weight, _))| *weight);
        if self.current.is_empty() { waiting() } else { Some(self.weight) }
    }

    /// Takes the first open worker, with its weight.
    pub(super) fn pop(&mut self) -> Option<(WorkerId, Weight)> {
        if self.current.is_empty() {
            self.refill();
        }
        self.current.pop().map(|worker| (worker, self.weight))
    }

    fn refill(&mut self) {
        let Some(weight) = self.lightest() else { return };
        self.weight = weight;
        let mut current = Vec::new();
        while let Some(&Reverse((next, worker))) = self.waiting.peek()
            && next == weight
        {
            self.waiting.pop();
            current.push(worker);
        }
        current.sort_unstable_by(|&a, &b| self.order(b, a));
        self.current = current;
    }

    /// Opens a worker, which must not be lighter than the one taken last.
    fn put(&mut self, worker: WorkerId, weight: Weight) {
        if weight > self.weight {
            self.waiting.push(Reverse((weight, worker)));
            return;
        }
        let at = self.current.partition_point(|&open| self.order(open, worker) == Ordering::Greater);
        self.current.insert(at, worker);
    }

    /// Takes the first finished worker, wherever it is in the queue.
    pub(super) fn pop_done(&mut self) -> Option<WorkerId> {
        let is_done = |worker: WorkerId| self.workers[worker].state == State::Done;
        if let Some(at) = self.current.iter().rposition(|&worker| is_done(worker)) {
            return Some(self.current.remove(at));
        }
        let done = self.waiting.iter().map(|Reverse(open)| open).filter(|(_, worker)| is_done(*worker));
        let first = done.min_by(|a, b| a.0.cmp(&b.0).then_with(|| self.file_order(a.1, b.1)))?.1;
        self.waiting.retain(|Reverse((_, worker))| *worker != first);
        Some(first)
    }

    pub(super) fn state(&self, worker: WorkerId) -> State {
        self.workers[worker].state
    }

    /// Puts a potential worker whose decisions have been made back into the queue, with its exact weight.
    pub(super) fn make(&mut self, worker: WorkerId, weight: Weight, state: State) {
        self.workers[worker].state = state;
        self.put(worker, weight);
    }

    /// The worker before the last combination of a worker.
    pub(super) fn before(&self, worker: WorkerId) -> WorkerId {
        self.workers[worker].before
    }

    /// The number of combinations that lead to a worker.
    pub(super) fn depth(&self, worker: WorkerId) -> usize {
        self.workers[worker].depth as usize
    }

    /// The combination of a worker.
    pub(super) fn combination(&self, worker: WorkerId) -> impl Iterator<Item = Choice> {
        let Worker { before, changes, .. } = &self.workers[worker];
        let mut changes = changes.iter().peekable();
        let round = self.workers[*before].round.as_deref();
        round.into_iter().flat_map(Round::positions).filter_map(move |position| {
            let change = changes.next_if(|change| change.position == position);
            round?.choice(position, change.map_or(0, |change| change.index))
        })
    }

    /// Opens the lightest combination of choices after a worker of some weight; `own` is the number of choices that belong to no
    /// other worker.
    pub(super) fn expand(
        &mut self,
        worker: WorkerId,
        weight: Weight,
        choices: Vec<Arc<[Choice]>>,
        own: usize,
    ) {
        self.kept += choices.len() + own;
        let round = Round::new(self.scale, choices);
        let least = round.positions().map(|position| round.least(position, 0));
        let weight = self.scale.join_all(least.chain([weight]));
        self.workers[worker].round = Some(Box::new(round));
        self.add(worker, Vec::new(), None, weight);
    }

    fn add(&mut self, before: WorkerId, changes: Vec<Change>, turn: Option<u32>, weight: Weight) {
        let depth = |worker: WorkerId| self.workers[worker].depth;
        let far = self.workers[before].far_before;
        let farther = self.workers[far].far_before;
        let jump = depth(before) - depth(far) == depth(far) - depth(farther);
        let far_before = if jump { farther } else { before };
        let depth = depth(before) + 1;
        self.kept += 1 + changes.len();
        let worker =
            Worker { before, far_before, depth, changes, turn, state: State::Potential, round: None };
        let worker = self.workers.push(worker);
        self.put(worker, weight);
    }

    /// Opens the combinations after one of some weight: with those that follow them, each combination of the round comes exactly
    /// once, after a lighter one.
    pub(super) fn follow(&mut self, worker: WorkerId, weight: Weight) {
        let before = self.workers[worker].before;
        let Some(round) = &self.workers[before].round else { return };
        let following = round.following(&self.workers[worker].changes, self.workers[worker].turn, weight);
        for (changes, turn, weight) in following {
            self.add(before, changes, Some(turn), weight);
        }
    }

    /// The order of open workers of the same weight.
    fn order(&self, a: WorkerId, b: WorkerId) -> Ordering {
        // With a maximum, a successor of an equally heavy combination may come before it in file order: so such combinations are
        // made first.
        let comes_later = |worker: WorkerId| self.workers[worker].state != State::Potential;
        let first =
            if self.scale.is_additive() { Ordering::Equal } else { comes_later(a).cmp(&comes_later(b)) };
        first.then_with(|| self.file_order(a, b))
    }

    /// Compares the first decisions that differ, breadth first. Of two open workers, none continues the other.
    fn file_order(&self, a: WorkerId, b: WorkerId) -> Ordering {
        let depth = self.workers[a].depth.min(self.workers[b].depth);
        let (mut a, mut b) = (self.at_depth(a, depth), self.at_depth(b, depth));
        while a != b {
            let (x, y) = (&self.workers[a], &self.workers[b]);
            if x.before == y.before {
                return self.compare(x, y);
            }
            let far = x.far_before != y.far_before;
            (a, b) = if far { (x.far_before, y.far_before) } else { (x.before, y.before) };
        }
        Ordering::Equal
    }

    fn at_depth(&self, mut worker: WorkerId, depth: u32) -> WorkerId {
        while self.workers[worker].depth > depth {
            let Worker { before, far_before, .. } = &self.workers[worker];
            worker = if self.workers[*far_before].depth >= depth { *far_before } else { *before };
        }
        worker
    }

    /// Compares two combinations of one round.
    fn compare(&self, a: &Worker, b: &Worker) -> Ordering {
        let equal = a.changes.iter().zip(&b.changes).take_while(|(a, b)| a == b).count();
        let (x, y) = (a.changes.get(equal), b.changes.get(equal));
        let Some(position) = x.into_iter().chain(y).map(|change| change.position).min() else {
            return Ordering::Equal;
        };
        let round = self.workers[a.before].round.as_deref();
        let relation = |change: Option<&Change>| {
            let index = change.filter(|change| change.position == position).map_or(0, |change| change.index);
            round.and_then(|round| round.choice(position, index)).map(|choice| choice.relation)
        };
        relation(x).cmp(&relation(y))
    }
}
