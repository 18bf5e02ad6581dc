//! The workers of [`property_guided`](super::property_guided()): the order of workers, and the order of combinations.

use super::choices::Choice;
use super::utility::{Scale, Weight};
use crate::knowledge::{Id, IdVec};
use alloc::boxed::Box;
use alloc::collections::BinaryHeap;
use alloc::rc::Rc;
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

/// A variable of a step, counted from the first.
type Position = u32;

/// The choices of all variables of a step; a combination takes one for each.
#[derive(Debug)]
struct Round {
    scale: Scale,
    /// The choices of each position, lightest first.
    choices: Vec<Rc<[Choice]>>,
    /// The positions with several choices, in the order in which combinations leave the first one.
    turns: Vec<Position>,
}

impl Round {
    fn new(scale: Scale, choices: Vec<Rc<[Choice]>>) -> Round {
        let mut round = Round { scale, choices, turns: Vec::new() };
        round.find_turns();
        round
    }

    fn positions(&self) -> impl Iterator<Item = Position> + use<> {
        0..self.choices.len() as Position
    }

    fn choice(&self, position: Position, index: u32) -> Option<Choice> {
        self.choices.get(position as usize)?.get(index as usize).copied()
    }

    /// A lower bound of the weight of a choice and those after it: for a maximum, a heavier choice may be without a relation.
    fn least(&self, position: Position, index: u32) -> Weight {
        let choices = self.choices.get(position as usize).map_or(&[][..], |choices| choices);
        let after = choices.get(index as usize..).unwrap_or_default().iter().map(|choice| choice.least);
        let first = after.clone().next().unwrap_or(Weight::ZERO);
        if self.scale.is_additive() {
            first
        } else {
            after.fold(first, |all, one| self.scale.least(all, one))
        }
    }

    /// The weight of a combination with another choice at one position.
    fn exchanged(&self, weight: Weight, position: Position, old: u32, new: u32) -> Weight {
        let without = self.scale.without(weight, self.least(position, old));
        self.scale.join(without, self.least(position, new))
    }

    /// Orders the positions by the additional weight of the second choice. Among equals, a position comes first if its second
    /// choice is earlier in the file than its first. So each combination follows the combination that it is made from.
    fn find_turns(&mut self) {
        let mut turns: Vec<Position> =
            self.positions().filter(|&position| self.choice(position, 1).is_some()).collect();
        turns.sort_by_key(|&position| {
            let relation = |index| self.choice(position, index).map(|choice| choice.relation);
            let earlier = relation(1) < relation(0);
            let place = if earlier { position } else { Position::MAX - position };
            (self.scale.without(self.least(position, 1), self.least(position, 0)), !earlier, place)
        });
        self.turns = turns;
    }
}

/// A position where a combination does not take the first choice, with its choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Change {
    position: Position,
    index: u32,
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
#[derive(Debug)]
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
#[derive(Debug)]
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
        choices: Vec<Rc<[Choice]>>,
        own: usize,
    ) {
        let round = Round::new(self.scale, choices);
        let least = round.positions().map(|position| round.least(position, 0));
        let weight = self.scale.join_all(least.chain([weight]));
        self.kept += round.choices.len() + own;
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
        let following = round.following(&self.workers[worker], weight);
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

/// A following combination: its changes, its last turn, and its weight.
type Following = (Vec<Change>, u32, Weight);

impl Round {
    fn following(&self, worker: &Worker, weight: Weight) -> Vec<Following> {
        let last = worker.turn.and_then(|turn| Some((turn, *self.turns.get(turn as usize)?)));
        if self.scale.is_additive() {
            self.following_by_turns(worker, last, weight)
        } else {
            self.following_anywhere(worker, weight)
        }
    }

    /// A combination takes the next choice at its last changed position, or changes the next position, or changes the next
    /// position in place of the last one.
    fn following_by_turns(
        &self,
        Worker { changes, .. }: &Worker,
        last: Option<(u32, Position)>,
        weight: Weight,
    ) -> Vec<Following> {
        let mut following = Vec::new();
        let next = last.map_or(0, |(turn, _)| turn + 1);
        let next_position = self.turns.get(next as usize).copied();
        if let Some(position) = next_position {
            following.push((with(changes, position, 1), next, self.exchanged(weight, position, 0, 1)));
        }
        let Some((turn, position)) = last else { return following };
        let index = index_at(changes, position);
        if self.choice(position, index + 1).is_some() {
            let weight = self.exchanged(weight, position, index, index + 1);
            following.push((with(changes, position, index + 1), turn, weight));
        }
        if let (1, Some(next_position)) = (index, next_position) {
            let weight = self.exchanged(self.exchanged(weight, position, 1, 0), next_position, 0, 1);
            following.push((with(&with(changes, position, 0), next_position, 1), next, weight));
        }
        following
    }

    /// With a maximum, the first change is not known: a combination takes the next choice at any position from the last changed
    /// one on.
    fn following_anywhere(&self, Worker { changes, turn, .. }: &Worker, weight: Weight) -> Vec<Following> {
        let turns = self.turns.iter().zip(0..).skip(turn.unwrap_or(0) as usize);
        let follows = turns.map(|(&position, turn)| (position, turn, index_at(changes, position)));
        let exist = follows.filter(|&(position, _, index)| self.choice(position, index + 1).is_some());
        let follow = exist.map(|(position, turn, index)| {
            let weight = self.exchanged(weight, position, index, index + 1);
            (with(changes, position, index + 1), turn, weight)
        });
        follow.collect()
    }
}

fn index_at(changes: &[Change], position: Position) -> u32 {
    changes.iter().find(|change| change.position == position).map_or(0, |change| change.index)
}

/// The changes, with the choice `index` at a position.
fn with(changes: &[Change], position: Position, index: u32) -> Vec<Change> {
    let mut changes = changes.to_vec();
    match (changes.binary_search_by_key(&position, |change| change.position), index) {
        (Ok(at), 0) => drop(changes.remove(at)),
        (Ok(at), index) => changes.get_mut(at).into_iter().for_each(|change| change.index = index),
        (Err(_), 0) => {}
        (Err(at), index) => changes.insert(at, Change { position, index }),
    }
    changes
}
