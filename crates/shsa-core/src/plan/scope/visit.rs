//! The walk that finds a scope.

use super::{Choice, ChoiceId, Place, Scope};
use crate::knowledge::{Id, IdVec, RelationId, VariableId};
use crate::plan::graph::{Producer, View};
use crate::plan::utility::Weight;
use alloc::vec::Vec;

/// Which variables may be substituted.
#[derive(Clone, Copy, Debug)]
pub(in crate::plan) struct Rules {
    /// Provided variables below the root, too.
    pub(in crate::plan) substitute_provided: bool,
    /// The root's own signals are no answer.
    pub(in crate::plan) without_empty: bool,
}

/// What was noted about a variable or relation in one round; an earlier round's note counts as none.
#[derive(Clone, Copy, Debug, Default)]
struct Mark {
    round: u32,
    value: u32,
}

/// Marks on the variables and relations of a graph, by rounds, so that searches that share them cost nothing in the
/// size of the graph.
#[derive(Clone, Debug, Default)]
pub struct Marks {
    round: u32,
    places: IdVec<VariableId, Mark>,
    relations: IdVec<RelationId, Mark>,
}

impl Marks {
    /// Marks for a graph of so many variables and relations.
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
    }

    fn place(&self, variable: VariableId) -> Option<Place> {
        let mark = self.places[variable];
        (mark.round == self.round).then_some(Place(mark.value))
    }

    fn set_place(&mut self, variable: VariableId, place: Place) {
        self.places[variable] = Mark { round: self.round, value: place.0 };
    }

    /// Counts a use of a relation; how many there were before.
    fn use_relation(&mut self, relation: RelationId) -> u32 {
        let mark = &mut self.relations[relation];
        let before = if mark.round == self.round { mark.value } else { 0 };
        *mark = Mark { round: self.round, value: before + 1 };
        before
    }
}

/// A breadth-first walk from the root over everything that may be needed.
///
/// It first assumes a tree: then what stands above a place is known, and a choice that needs one of those is
/// left out at once (a relation that is usable in all directions would lead up again). Is a place reached from
/// two sides, the walk is repeated without this assumption.
pub(super) struct Visit<'a, 'b> {
    view: &'a View<'b>,
    rules: Rules,
    /// Provided variables are places, too, as using them has a weight.
    weigh_sources: bool,
    marks: &'a mut Marks,
    scope: Scope,
    above: Vec<Place>,
}

/// How far up a walk looks for a variable that would be needed for itself.
const LOOK_UP: usize = 64;

impl<'a, 'b> Visit<'a, 'b> {
    pub(super) fn new(
        view: &'a View<'b>,
        root: VariableId,
        rules: Rules,
        marks: &'a mut Marks,
        tree: bool,
    ) -> Self {
        marks.begin();
        let scope = Scope { tree, ..Scope::empty(view) };
        let weigh_sources = view.graph().rates_signals();
        let mut visit = Visit { view, rules, weigh_sources, marks, scope, above: Vec::new() };
        visit.discover(root, Place(0));
        visit
    }

    /// `None` when the part turns out to be no tree.
    pub(super) fn run(mut self) -> Option<Scope> {
        let mut next = 0;
        while next < self.scope.len() {
            if !self.visit(Place::from_index(next)) {
                return None;
            }
            next += 1;
        }
        self.scope.ambiguous.sort_unstable();
        self.scope.ambiguous.dedup();
        Some(self.scope)
    }

    fn discover(&mut self, variable: VariableId, above: Place) -> Place {
        let place = self.scope.variables.push(variable);
        self.above.push(above);
        self.marks.set_place(variable, place);
        place
    }

    fn visit(&mut self, place: Place) -> bool {
        let view = self.view;
        let variable = self.scope.variables[place];
        let is_root = place.index() == 0;
        let status = view.status(variable);
        if status.provided && !(self.rules.without_empty && is_root) {
            self.add_choice(None, status.weight, self.scope.inputs.len());
        }
        if !status.provided || is_root || self.rules.substitute_provided {
            for producer in view.producers(variable) {
                if !self.leads_up(place, variable, producer.relation)
                    && !self.visit_producer(place, variable, producer)
                {
                    return false;
                }
            }
        }
        self.scope.starts.push(self.scope.choices.len() as u32);
        true
    }

    fn needs(
        &self,
        variable: VariableId,
        relation: RelationId,
    ) -> impl Iterator<Item = VariableId> + use<'b> {
        let inputs: &'b [VariableId] = self.view.graph().inputs(relation);
        inputs.iter().copied().filter(move |&input| input != variable)
    }

    /// Whether a relation surely needs what it would be used for.
    fn leads_up(&self, place: Place, variable: VariableId, relation: RelationId) -> bool {
        self.needs(variable, relation).any(|input| match self.marks.place(input) {
            Some(Place(0)) => true,
            Some(needed) => self.scope.tree && self.is_above(needed, place),
            None => false,
        })
    }

    fn is_above(&self, upper: Place, place: Place) -> bool {
        let above = |place: &Place| self.above.get(place.index()).copied();
        let up = core::iter::successors(Some(place), above);
        up.take(LOOK_UP).take_while(|&place| place >= upper).any(|place| place == upper)
    }

    fn visit_producer(&mut self, place: Place, variable: VariableId, producer: Producer) -> bool {
        let view = self.view;
        let inputs = self.scope.inputs.len();
        for input in self.needs(variable, producer.relation) {
            if !self.weigh_sources && !self.rules.substitute_provided && view.status(input).provided {
                continue;
            }
            let needed = match self.marks.place(input) {
                Some(needed) if self.scope.tree && self.above.get(needed.index()) != Some(&place) => {
                    return false;
                }
                Some(needed) => needed,
                None => self.discover(input, place),
            };
            self.scope.inputs.push(needed);
        }
        if view.graph().has_several_outputs(producer.relation)
            && self.marks.use_relation(producer.relation) > 0
        {
            self.scope.ambiguous.push(producer.relation);
        }
        self.add_choice(Some(producer.relation), view.weight(producer, variable), inputs);
        true
    }

    fn add_choice(&mut self, relation: Option<RelationId>, weight: Weight, inputs: usize) -> ChoiceId {
        self.scope.choices.push(Choice { relation, weight, inputs: inputs as u32 })
    }
}
