//! Common parts of the searches of the thesis: the choices of a variable, the weight of decisions, and their substitution.

use super::Plan;
use super::graph::{Graph, Options, View};
use super::limits::StopReason;
use super::utility::{Scale, Weight};
use crate::knowledge::{IdVec, RelationId, VariableId};
use crate::substitution::{Step, Substitution};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

/// A relation above a variable, or (`None`) the variable's own signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Choice {
    pub(super) relation: Option<RelationId>,
    /// The weight, if the relation is not used already.
    pub(super) weight: Weight,
    /// The smallest weight: a relation that is used already for another output may be counted there.
    pub(super) least: Weight,
}

/// The chosen relation of each variable; `None` where none is chosen (yet).
pub(super) type Chosen = IdVec<VariableId, Option<RelationId>>;

/// The choices of every variable in a search from one root.
#[derive(Clone, Debug)]
pub(super) struct Choices<'a> {
    view: View<'a>,
    root: VariableId,
    substitute_provided: bool,
    without_empty: bool,
}

impl<'a> Choices<'a> {
    pub(super) fn new(graph: &'a Graph, root: VariableId, options: &Options) -> Choices<'a> {
        Choices {
            view: View::new(graph, options),
            root,
            substitute_provided: options.substitute_provided,
            without_empty: options.without_empty,
        }
    }

    pub(super) fn root(&self) -> VariableId {
        self.root
    }

    pub(super) fn variables(&self) -> usize {
        self.view.graph().variables()
    }

    pub(super) fn scale(&self) -> Scale {
        self.view.graph().scale()
    }

    /// The answer for a graph that must not be searched.
    pub(super) fn refusal(&self) -> Option<Plan> {
        let bound = self.scale().best();
        let plan = Plan { substitutions: Vec::new(), stop: StopReason::NotMonotone, expanded: 0, bound };
        (!self.view.graph().is_monotone()).then_some(plan)
    }

    /// The choices of a variable: its own signals first, then relations in file order. Relations that read the root are left out,
    /// as the root would depend on itself.
    pub(super) fn of(&self, variable: VariableId) -> impl Iterator<Item = Choice> + '_ {
        let is_root = variable == self.root;
        let status = self.view.status(variable);
        let as_it_comes = status.provided && !(is_root && self.without_empty);
        let expand = is_root || self.substitute_provided || !status.provided;
        let own = Choice { relation: None, weight: status.weight, least: status.weight };
        let producers = self.view.producers(variable).filter(move |_| expand);
        let producers =
            producers.filter(move |producer| self.needs(variable, producer.relation).all(|n| n != self.root));
        let relations = producers.map(move |producer| {
            let weight = self.view.weight(producer, variable);
            let least = if self.is_shared(producer.relation) { Weight::ZERO } else { weight };
            Choice { relation: Some(producer.relation), weight, least }
        });
        as_it_comes.then_some(own).into_iter().chain(relations)
    }

    /// Whether a variable below the root must be decided: the use of a provided one is a decision only where it has a weight.
    fn is_open(&self, variable: VariableId) -> bool {
        self.substitute_provided || self.view.graph().rates_signals() || !self.view.is_provided(variable)
    }

    /// Whether a relation may be used for several outputs in one substitution.
    fn is_shared(&self, relation: RelationId) -> bool {
        self.view.graph().has_several_outputs(relation) && !self.view.graph().is_exclusive(relation)
    }

    fn needs(&self, output: VariableId, relation: RelationId) -> impl Iterator<Item = VariableId> + use<'a> {
        let inputs: &'a [VariableId] = self.view.graph().inputs(relation);
        inputs.iter().copied().filter(move |&input| input != output)
    }

    /// The variables to decide after a choice for `output`, in the order of the relation's inputs.
    pub(super) fn opened(
        &self,
        output: VariableId,
        relation: Option<RelationId>,
    ) -> impl DoubleEndedIterator<Item = VariableId> + '_ {
        let inputs: &[VariableId] = relation.map_or(&[], |relation| self.view.graph().inputs(relation));
        inputs.iter().copied().filter(move |&input| input != output && self.is_open(input))
    }

    /// Whether other substitutions could use a relation for another output.
    pub(super) fn has_several_outputs(&self, relation: RelationId) -> bool {
        self.view.graph().has_several_outputs(relation)
    }

    /// The substitution of the root from complete decisions: a depth-first walk that lists a step after those that it reads.
    /// Complexity: O(s log s) for s inputs of its relations.
    pub(super) fn substitution(&self, chosen: &Chosen) -> Substitution {
        let mut steps = Vec::new();
        let mut done = BTreeSet::new();
        let mut stack = Vec::from([(self.root, false)]);
        while let Some((variable, left)) = stack.pop() {
            let Some(relation) = chosen[variable] else { continue };
            if left {
                steps.push(Step { relation, output: variable });
            } else if done.insert(variable) {
                stack.push((variable, true));
                let first = stack.len();
                stack.extend(self.needs(variable, relation).map(|input| (input, false)));
                stack.get_mut(first..).unwrap_or_default().reverse();
            }
        }
        self.view.graph().substitution(self.root, steps)
    }

    /// The weight of complete decisions.
    pub(super) fn weight(&self, chosen: &Chosen) -> Weight {
        let mut load = Load::new(self.scale());
        let mut needed = Vec::from([self.root]);
        let mut seen = BTreeSet::from([self.root]);
        while let Some(variable) = needed.pop() {
            let choice = self.of(variable).find(|choice| choice.relation == chosen[variable]);
            choice.map(|choice| load.add(choice));
            needed.extend(self.opened(variable, chosen[variable]).filter(|&input| seen.insert(input)));
        }
        load.weight()
    }

    /// The decisions breadth first from the root, each variable where it is first needed; for breaking ties.
    pub(super) fn file_order(&self, chosen: &Chosen) -> Vec<Option<RelationId>> {
        let mut needed = Vec::from([self.root]);
        let mut seen = BTreeSet::from([self.root]);
        let mut order = Vec::new();
        while let Some(&variable) = needed.get(order.len()) {
            needed.extend(self.opened(variable, chosen[variable]).filter(|&input| seen.insert(input)));
            order.push(chosen[variable]);
        }
        order
    }
}

/// The weight of decisions. A relation that is used for several outputs counts once, with its worst rating.
#[derive(Clone, Debug)]
pub(super) struct Load {
    scale: Scale,
    weight: Weight,
    charged: BTreeMap<RelationId, Weight>,
}

/// A load before a choice was added.
#[derive(Clone, Copy, Debug)]
pub(super) struct Before {
    weight: Weight,
    charged: Option<Weight>,
}

impl Load {
    pub(super) fn new(scale: Scale) -> Load {
        Load { scale, weight: Weight::ZERO, charged: BTreeMap::new() }
    }

    pub(super) fn weight(&self) -> Weight {
        self.weight
    }

    pub(super) fn add(&mut self, choice: Choice) -> Before {
        let shared = choice.relation.filter(|_| choice.least < choice.weight);
        let charged = shared.and_then(|relation| self.charged.get(&relation).copied());
        let before = Before { weight: self.weight, charged };
        let paid = charged.unwrap_or(Weight::ZERO);
        self.weight = self.scale.join(self.weight, self.scale.extra(choice.weight, paid));
        if let Some(relation) = shared {
            self.charged.insert(relation, paid.max(choice.weight));
        }
        before
    }

    /// Takes back the choice that was added last.
    pub(super) fn take_back(&mut self, choice: Choice, before: Before) {
        self.weight = before.weight;
        let Some(relation) = choice.relation.filter(|_| choice.least < choice.weight) else { return };
        match before.charged {
            Some(charged) => self.charged.insert(relation, charged),
            None => self.charged.remove(&relation),
        };
    }
}
