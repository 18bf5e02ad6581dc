//! Höftberger's search: depth first through the relations, all substitutions or the first one.
//!
//! Höftberger, Obermaisser, "Ontology-based runtime reconfiguration of distributed embedded real-time systems", ISORC 2013,
//! doi:10.1109/ISORC.2013.6913214, as Ratasich describes it ("Self-Healing Cyber-Physical Systems", TU Wien 2019, ch. 6). From a
//! variable it follows each of its relations to their inputs, until all that is read is provided.
//!
//! The public program of the thesis combines the answers of the inputs as if they were trees. Here decisions are made one after
//! another and taken back, and so
//! * the search ends on cycles: a relation that reads a variable under computation is no choice for that variable;
//! * a variable that is needed twice is decided once: never two relations for one variable;
//! * no answer comes twice: the order of decisions follows from those before, so each substitution is reached in one way
//!   only; of several that differ only in the outputs of a relation, the best stays.

use super::Plan;
use super::choices::{Before, Choice, Choices, Chosen, Load};
use super::exhaustive::{Answer, in_order};
use super::graph::{Graph, Options};
use super::limits::{Limits, StopReason, states};
use super::utility::Weight;
use crate::knowledge::{IdVec, VariableId};
use alloc::vec::Vec;

/// Which substitutions a depth-first search returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Take {
    /// The first that is found, which need not be the best.
    First,
    /// All of them, then sorted.
    All,
}

/// The substitutions of `root`, found depth first; with [`Take::All`] in the order of [`exhaustive`](super::exhaustive()).
///
/// When a limit is reached, the plan has the substitutions found so far, and [`Plan::bound`] is an upper bound of the utility in
/// the remaining branches. [`Limits::states`] counts the present decisions and those of the kept answers. Complexity:
/// exponential.
#[must_use]
pub fn depth_first(graph: &Graph, root: VariableId, options: &Options, take: Take, limits: Limits) -> Plan {
    let choices = Choices::new(graph, root, options);
    if let Some(refusal) = choices.refusal() {
        return refusal;
    }
    Search::new(choices).run(take, limits)
}

/// The state of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Unknown,
    /// A relation is chosen, and its inputs are being decided.
    Open,
    /// The variable and all that it needs are decided.
    Known,
}

/// The next task, in a list that several branches share.
#[derive(Clone, Copy, Debug)]
struct Task {
    variable: VariableId,
    /// Whether the variable's inputs are known now, and so is the variable.
    close: bool,
    next: Option<u32>,
}

/// A decision, and the state to restore when it is taken back.
#[derive(Debug)]
struct Frame {
    variable: VariableId,
    choices: Vec<Choice>,
    /// The next choice to try.
    next: usize,
    taken: Option<(Choice, Before)>,
    /// The task after this variable.
    after: Option<u32>,
    tasks: usize,
    known: usize,
    weight: Weight,
}

struct Search<'a> {
    choices: Choices<'a>,
    states: IdVec<VariableId, State>,
    chosen: Chosen,
    load: Load,
    frames: Vec<Frame>,
    tasks: Vec<Task>,
    /// The present task.
    now: Option<u32>,
    /// The variables that have become known, in order.
    known: Vec<VariableId>,
    answers: Vec<Answer>,
    expanded: u64,
    /// The size of the answers in [`Limits::states`].
    kept: usize,
}

impl<'a> Search<'a> {
    fn new(choices: Choices<'a>) -> Search<'a> {
        let count = choices.variables();
        let root = Task { variable: choices.root(), close: false, next: None };
        Search {
            load: Load::new(choices.scale()),
            choices,
            states: IdVec::filled(count, |_| State::Unknown),
            chosen: IdVec::filled(count, |_| None),
            frames: Vec::new(),
            tasks: Vec::from([root]),
            now: Some(0),
            known: Vec::new(),
            answers: Vec::new(),
            expanded: 0,
            kept: 0,
        }
    }

    fn run(mut self, take: Take, limits: Limits) -> Plan {
        loop {
            if let Some(limit) = self.limit(limits) {
                return self.plan(limit, true);
            }
            let goes_on = match self.task() {
                Some(task) => self.work(task),
                None => {
                    self.answer();
                    if take == Take::First {
                        return self.plan(StopReason::Found(1), false);
                    }
                    self.try_next()
                }
            };
            if !goes_on {
                return self.plan(StopReason::Complete, false);
            }
        }
    }

    fn limit(&self, limits: Limits) -> Option<StopReason> {
        if self.expanded >= limits.expansions {
            return Some(StopReason::LimitExpansions);
        }
        (self.kept + self.frames.len() >= limits.states).then_some(StopReason::LimitStates)
    }

    fn plan(self, stop: StopReason, branch_is_open: bool) -> Plan {
        let scale = self.choices.scale();
        let bound = self.bound(branch_is_open).map_or(scale.worst(), |weight| scale.utility(weight));
        Plan { substitutions: in_order(scale, self.answers), stop, expanded: self.expanded, bound }
    }

    /// A lower bound of the weight of the remaining substitutions: they continue the open branch, or take a choice that was not
    /// tried.
    fn bound(&self, branch_is_open: bool) -> Option<Weight> {
        let scale = self.choices.scale();
        let untried = |frame: &Frame| {
            let left = frame.choices.get(frame.next..).unwrap_or_default().iter();
            left.map(|choice| scale.join(frame.weight, choice.least)).min()
        };
        let branch = branch_is_open.then(|| self.load.weight());
        self.frames.iter().filter_map(untried).chain(branch).min()
    }

    fn task(&self) -> Option<Task> {
        self.now.and_then(|now| self.tasks.get(now as usize)).copied()
    }

    /// Does one task; returns `false` when everything has been tried.
    fn work(&mut self, task: Task) -> bool {
        let variable = task.variable;
        if !task.close && self.states[variable] == State::Unknown {
            self.open(task);
            return self.try_next();
        }
        if task.close {
            self.states[variable] = State::Known;
            self.known.push(variable);
        }
        self.now = task.next;
        true
    }

    fn open(&mut self, task: Task) {
        self.states[task.variable] = State::Open;
        self.frames.push(Frame {
            variable: task.variable,
            choices: self.choices.of(task.variable).collect(),
            next: 0,
            taken: None,
            after: task.next,
            tasks: self.tasks.len(),
            known: self.known.len(),
            weight: self.load.weight(),
        });
    }

    /// Takes the next choice of the last decision that has one left; returns `false` when none has.
    fn try_next(&mut self) -> bool {
        while let Some(mut frame) = self.frames.pop() {
            self.take_back(&mut frame);
            while let Some(&choice) = frame.choices.get(frame.next) {
                frame.next += 1;
                self.expanded += 1;
                if !self.closes_cycle(frame.variable, choice) {
                    self.take(frame, choice);
                    return true;
                }
            }
            self.states[frame.variable] = State::Unknown;
        }
        false
    }

    /// Open variables are those on the path from the root to here; a known variable depends on none of these.
    fn closes_cycle(&self, variable: VariableId, choice: Choice) -> bool {
        self.choices.opened(variable, choice.relation).any(|input| self.states[input] == State::Open)
    }

    fn take(&mut self, mut frame: Frame, choice: Choice) {
        self.chosen[frame.variable] = choice.relation;
        frame.taken = Some((choice, self.load.add(choice)));
        let mut now = self.add(Task { variable: frame.variable, close: true, next: frame.after });
        let inputs: Vec<_> = self.choices.opened(frame.variable, choice.relation).rev().collect();
        for variable in inputs {
            now = self.add(Task { variable, close: false, next: now });
        }
        self.now = now;
        self.frames.push(frame);
    }

    fn add(&mut self, task: Task) -> Option<u32> {
        self.tasks.push(task);
        u32::try_from(self.tasks.len() - 1).ok()
    }

    fn take_back(&mut self, frame: &mut Frame) {
        let Some((choice, before)) = frame.taken.take() else { return };
        for variable in self.known.drain(frame.known..) {
            self.states[variable] = State::Open;
        }
        self.tasks.truncate(frame.tasks);
        self.load.take_back(choice, before);
        self.chosen[frame.variable] = None;
    }

    fn answer(&mut self) {
        let substitution = self.choices.substitution(&self.chosen);
        let order = self.choices.file_order(&self.chosen);
        self.kept += states(order.len() + substitution.steps.len() + substitution.sources.len());
        self.answers.push(Answer { weight: self.load.weight(), order, substitution });
    }
}
