//! Ontology-based runtime reconfiguration (ORR): the first relation that leads to provided inputs, one answer.
//!
//! Höftberger, Obermaisser, "Ontology-based runtime reconfiguration of distributed embedded real-time systems", ISORC 2013,
//! doi:10.1109/ISORC.2013.6913214. The search ignores properties: the answer is a substitution, not the best one.
//!
//! The public program of the thesis takes relations in the order of a hash set, stops with an exception when a nested search
//! fails, and never tries a variable a second time, even if it failed only because it was needed for itself. Here relations are
//! tried in file order, the next relation is tried when the inputs of one cannot be provided, and a failure that may have such a
//! reason is forgotten: so there is an answer whenever there is a substitution.

use super::Plan;
use super::choices::{Choice, Choices, Chosen};
use super::graph::{Graph, Options};
use super::limits::{Limits, StopReason};
use super::utility::Weight;
use crate::knowledge::{IdVec, VariableId};
use crate::substitution::Substitution;
use alloc::vec::Vec;

/// One substitution of `root`: for every variable the first relation in file order whose inputs can be provided.
///
/// [`Plan::bound`] is the utility of the best relation of the root alone: no substitution is better. Complexity: O(v r) for v
/// variables and r inputs of relations; O(r) without cycles.
#[must_use]
pub fn ontology(graph: &Graph, root: VariableId, options: &Options, limits: Limits) -> Plan {
    let choices = Choices::new(graph, root, options);
    if let Some(refusal) = choices.refusal() {
        return refusal;
    }
    let mut search = Search::new(choices);
    let stop = search.run(limits);
    let scale = search.choices.scale();
    let found = (stop == StopReason::Found(1)).then(|| search.choices.substitution(&search.chosen));
    let bound = search.bound(stop, found.as_ref()).map_or(scale.worst(), |weight| scale.utility(weight));
    let utility = scale.utility(search.choices.weight(&search.chosen));
    let substitutions = found.into_iter().map(|found| (found, utility)).collect();
    Plan { substitutions, stop, expanded: search.expanded, bound }
}

/// The state of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Unknown,
    Open,
    Known,
    /// Not computable while the present variables are open.
    Failed,
}

/// A variable that is being searched.
#[derive(Debug)]
struct Frame {
    variable: VariableId,
    choices: Vec<Choice>,
    /// The choice under trial.
    at: usize,
    /// The inputs of that choice, the next one last.
    inputs: Vec<VariableId>,
    /// The number of failures before.
    failed: usize,
}

struct Search<'a> {
    choices: Choices<'a>,
    states: IdVec<VariableId, State>,
    chosen: Chosen,
    frames: Vec<Frame>,
    /// The failed variables that may have failed because of an open one, in order.
    failed: Vec<VariableId>,
    expanded: u64,
}

impl<'a> Search<'a> {
    fn new(choices: Choices<'a>) -> Search<'a> {
        let count = choices.variables();
        let mut search = Search {
            states: IdVec::filled(count, |_| State::Unknown),
            chosen: IdVec::filled(count, |_| None),
            frames: Vec::new(),
            failed: Vec::new(),
            expanded: 0,
            choices,
        };
        search.open(search.choices.root());
        search
    }

    fn run(&mut self, limits: Limits) -> StopReason {
        while let Some(frame) = self.frames.pop() {
            if self.expanded >= limits.expansions {
                return StopReason::LimitExpansions;
            }
            if self.frames.len() >= limits.states {
                return StopReason::LimitStates;
            }
            self.step(frame);
        }
        match self.states[self.choices.root()] {
            State::Known => StopReason::Found(1),
            _ => StopReason::Complete,
        }
    }

    /// Visits the next input of the last open variable.
    fn step(&mut self, mut frame: Frame) {
        let Some(&choice) = frame.choices.get(frame.at) else { return self.fail(frame.variable) };
        let Some(&input) = frame.inputs.last() else { return self.succeed(&frame, choice) };
        match self.states[input] {
            State::Known => {
                frame.inputs.pop();
                self.frames.push(frame);
            }
            State::Unknown => {
                self.frames.push(frame);
                self.open(input);
            }
            State::Open | State::Failed => {
                frame.at += 1;
                self.begin(frame);
            }
        }
    }

    fn open(&mut self, variable: VariableId) {
        self.states[variable] = State::Open;
        let choices = self.choices.of(variable).collect();
        self.begin(Frame { variable, choices, at: 0, inputs: Vec::new(), failed: self.failed.len() });
    }

    /// Begins with the present choice of a frame.
    fn begin(&mut self, mut frame: Frame) {
        frame.inputs.clear();
        if let Some(choice) = frame.choices.get(frame.at) {
            self.expanded += 1;
            frame.inputs.extend(self.choices.opened(frame.variable, choice.relation).rev());
        }
        self.frames.push(frame);
    }

    /// A failure is valid while every variable that was open then is open or has failed.
    fn fail(&mut self, variable: VariableId) {
        self.states[variable] = State::Failed;
        self.failed.push(variable);
    }

    /// Variables that failed since this one was opened may have failed because of it, and can be tried again.
    fn succeed(&mut self, frame: &Frame, choice: Choice) {
        self.states[frame.variable] = State::Known;
        self.chosen[frame.variable] = choice.relation;
        for variable in self.failed.drain(frame.failed..) {
            self.states[variable] = State::Unknown;
        }
    }

    /// A lower bound of the weight of every substitution other than the found one.
    fn bound(&self, stop: StopReason, found: Option<&Substitution>) -> Option<Weight> {
        if stop == StopReason::Complete {
            return None;
        }
        let empty = found.is_some_and(|found| found.steps.is_empty());
        let others =
            self.choices.of(self.choices.root()).filter(|choice| !empty || choice.relation.is_some());
        others.map(|choice| choice.least).min()
    }
}
