//! The walk that finds a subproblem.

use super::{Choice, Node, Place, Subproblem};
use crate::knowledge::{Id, IdVec, RelationId, VariableId};
use crate::plan::graph::{Producer, View};
use crate::plan::utility::Weight;
use alloc::vec::Vec;

/// The rules for which variables may be substituted.
#[derive(Clone, Copy, Debug)]
pub(in crate::plan) struct Rules {
    /// Whether provided variables below the root may be substituted, too.
    pub(in crate::plan) substitute_provided: bool,
    /// Whether the root's own signals are no answer.
    pub(in crate::plan) without_empty: bool,
}

/// A note about a variable or relation, valid in one round.
#[derive(Clone, Copy, Debug, Default)]
struct Mark {
    round: u32,
    value: u32,
}

/// Marks on the variables and relations of a graph, by rounds: searches that share them pay nothing in the size of the graph.
#[derive(Clone, Debug, Default)]
pub(in crate::plan) struct Marks {
    round: u32,
    places: IdVec<VariableId, Mark>,
    relations: IdVec<RelationId, Mark>,
    /// The place that first needed each place.
    above: Vec<Above>,
}

/// A place that needs another, and the relation that reads it; the root has itself.
#[derive(Clone, Copy, Debug)]
struct Above {
    place: Place,
    relation: Option<RelationId>,
}

impl Marks {
    /// Fits the marks to the variables and relations of a graph.
    #[inline]
    pub(in crate::plan) fn fit(&mut self, variables: usize, relations: usize) {
        if self.places.len() != variables || self.relations.len() != relations {
            self.round = 0;
            self.places = IdVec::filled(variables, |_| Mark::default());
            self.relations = IdVec::filled(relations, |_| Mark::default());
        }
    }

    /// Forgets all marks.
    fn begin(&mut self) {
        if self.round == u32::MAX {
            self.places.iter_mut().chain(self.relations.iter_mut()).for_each(|mark| mark.round = 0);
            self.round = 0;
        }
        self.round += 1;
        self.above.clear();
    }

    fn place(&self, variable: VariableId) -> Option<Place> {
        let mark = self.places[variable];
        (mark.round == self.round).then_some(Place(mark.value))
    }

    fn set_place(&mut self, variable: VariableId, place: Place) {
        self.places[variable] = Mark { round: self.round, value: place.0 };
    }

    fn forget_place(&mut self, variable: VariableId) {
        self.places[variable].round = 0;
    }

    /// Counts a use of a relation; returns how many there were before.
    fn use_relation(&mut self, relation: RelationId) -> u32 {
        let mark = &mut self.relations[relation];
        let before = if mark.round == self.round { mark.value } else { 0 };
        *mark = Mark { round: self.round, value: before + 1 };
        before
    }
}

/// A breadth-first walk from the root over everything that may be needed.
///
/// It first assumes a tree: then the places above a place are known, and a choice that needs one of them is left out at once (a
/// relation that is usable in all directions would lead up again). If a place is reached from two sides, the walk is repeated
/// without this assumption.
pub(super) struct Visit<'a, 'b> {
    view: &'a View<'b>,
    root: VariableId,
    rules: Rules,
    /// Whether provided variables are places, too: they may be substituted, or their use has a weight.
    provided_places: bool,
    marks: &'a mut Marks,
    subproblem: &'a mut Subproblem,
}

/// How far up a walk tests whether a variable would depend on itself.
const LOOK_UP: usize = 64;

impl<'a, 'b> Visit<'a, 'b> {
    pub(super) fn new(
        view: &'a View<'b>,
        root: VariableId,
        rules: Rules,
        marks: &'a mut Marks,
        subproblem: &'a mut Subproblem,
        tree: bool,
    ) -> Self {
        marks.begin();
        subproblem.clear(view.graph().scale());
        subproblem.tree = tree;
        let provided_places = rules.substitute_provided || view.graph().rates_signals();
        Visit { view, root, rules, provided_places, marks, subproblem }
    }

    /// Returns `false` when the part turns out to be no tree.
    pub(super) fn run(mut self) -> bool {
        self.discover(self.root, Above { place: Place(0), relation: None });
        let mut next = 0;
        while next < self.subproblem.len() {
            if !self.visit(Place::from_index(next)) {
                return false;
            }
            next += 1;
        }
        if !self.subproblem.ambiguous.is_empty() {
            self.subproblem.ambiguous.sort_unstable();
            self.subproblem.ambiguous.dedup();
        }
        true
    }

    fn discover(&mut self, variable: VariableId, above: Above) -> Place {
        let place = self.subproblem.nodes.push(Node::of(variable));
        self.marks.above.push(above);
        self.marks.set_place(variable, place);
        place
    }

    fn visit(&mut self, place: Place) -> bool {
        let view = self.view;
        let variable = self.subproblem.variable(place);
        let first = self.subproblem.choices.len() as u32;
        let is_root = place.index() == 0;
        // Below the root, a provided variable is a place only if its use must be decided.
        let provided = (is_root || self.provided_places) && view.is_provided(variable);
        if provided && !(self.rules.without_empty && is_root) {
            self.add_choice(None, view.status(variable).weight, self.subproblem.inputs.len());
        }
        if !provided || is_root || self.rules.substitute_provided {
            let above = self.above(place).and_then(|above| above.relation).filter(|_| self.subproblem.tree);
            for producer in view.producers(variable) {
                if producer.facts.exclusive && Some(producer.relation) == above {
                    // The relation would need its own output.
                    continue;
                }
                match self.find_inputs(place, variable, producer) {
                    Found::Inputs(start) => self.add_relation(producer, variable, start),
                    Found::Itself => {}
                    Found::NoTree => return false,
                }
            }
        }
        self.subproblem.nodes[place].choices = (first, self.subproblem.choices.len() as u32);
        true
    }

    /// Appends the places that a relation needs to the inputs, unless it would need its own output.
    fn find_inputs(&mut self, place: Place, variable: VariableId, producer: &Producer) -> Found {
        let (start, known) = (self.subproblem.inputs.len(), self.subproblem.len());
        let inputs = self.view.graph().inputs_of(producer);
        let mut shared = false;
        for &input in inputs.iter().filter(|&&input| input != variable) {
            if !self.provided_places && input != self.root && self.view.is_provided(input) {
                continue;
            }
            let needed = match self.marks.place(input) {
                Some(needed) if self.leads_up(needed, place) => {
                    self.forget(start, known);
                    return Found::Itself;
                }
                Some(needed) => {
                    shared |= self.above(needed).is_none_or(|above| above.place != place);
                    needed
                }
                None => self.discover(input, Above { place, relation: Some(producer.relation) }),
            };
            self.subproblem.inputs.push(needed);
        }
        if shared && self.subproblem.tree { Found::NoTree } else { Found::Inputs(start) }
    }

    fn above(&self, place: Place) -> Option<Above> {
        self.marks.above.get(place.index()).copied()
    }

    /// Takes back the inputs and places after the given numbers of them.
    fn forget(&mut self, inputs: usize, places: usize) {
        self.subproblem.inputs.truncate(inputs);
        self.marks.above.truncate(places);
        while self.subproblem.len() > places
            && let Some(node) = self.subproblem.nodes.pop()
        {
            self.marks.forget_place(node.variable);
        }
    }

    /// Whether a place surely depends on another.
    fn leads_up(&self, needed: Place, place: Place) -> bool {
        needed == Place(0) || (self.subproblem.tree && self.is_above(needed, place))
    }

    fn is_above(&self, upper: Place, place: Place) -> bool {
        let above = |place: &Place| self.above(*place).map(|above| above.place);
        let up = core::iter::successors(Some(place), above);
        up.take(LOOK_UP).take_while(|&place| place >= upper).any(|place| place == upper)
    }

    fn add_relation(&mut self, producer: &Producer, variable: VariableId, inputs: usize) {
        let Producer { relation, facts, .. } = *producer;
        // In a tree, nothing needs an output of an exclusive relation but the place that it is used for.
        let may_be_used_twice = facts.several_outputs && !(facts.exclusive && self.subproblem.tree);
        if may_be_used_twice && self.marks.use_relation(relation) > 0 {
            self.subproblem.ambiguous.push(relation);
        }
        self.add_choice(Some(relation), self.view.weight(producer, variable), inputs);
    }

    fn add_choice(&mut self, relation: Option<RelationId>, weight: Weight, inputs: usize) {
        let inputs = (inputs as u32, self.subproblem.inputs.len() as u32);
        self.subproblem.choices.push(Choice { relation, weight, inputs });
    }
}

/// The inputs of a relation.
enum Found {
    /// The places from this input on.
    Inputs(usize),
    /// The relation would need its own output.
    Itself,
    /// Another place needs an input, too.
    NoTree,
}
