//! The oracle: finds every substitution by trying everything; slow, simple, and independent of the other searches.

use super::Plan;
use super::graph::Options;
use super::limits::{Limits, StopReason, states};
use super::utility::{Scale, Weight};
use crate::knowledge::{ACCURACY, Inputs, KnowledgeBase, Numbers, RelationId, VariableId};
use crate::substitution::Substitution;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

/// The way in which each needed variable is known: by a relation, or (`None`) by its own signals.
type Decisions = BTreeMap<VariableId, Option<RelationId>>;

/// All substitutions of `root`, best first; ties as in [`BestFirst`](super::BestFirst).
///
/// At a limit it returns the substitutions found so far. Each step repeats all its decisions, which count again; a state counts
/// with its decisions. Complexity: exponential.
#[must_use]
pub fn exhaustive(knowledge: &KnowledgeBase, root: VariableId, options: &Options, limits: Limits) -> Plan {
    let scale = Scale(knowledge.utility().aggregate());
    if !knowledge.utility().check(knowledge).is_empty() {
        let bound = scale.best();
        return Plan { substitutions: Vec::new(), stop: StopReason::NotMonotone, expanded: 0, bound };
    }
    let search = Search { knowledge, root, options };
    let mut answers = Vec::new();
    let mut open = Vec::from([Decisions::new()]);
    let (mut expanded, mut kept) = (0, states(0));
    let mut stop = StopReason::Complete;
    while let Some(decisions) = open.pop() {
        kept -= states(decisions.len());
        if expanded >= limits.expansions || kept >= limits.states {
            stop = if expanded < limits.expansions {
                StopReason::LimitStates
            } else {
                StopReason::LimitExpansions
            };
            break;
        }
        expanded += 1 + decisions.len() as u64;
        let Some(substitution) = search.substitution(&decisions) else { continue };
        match search.undecided(&substitution, &decisions) {
            Some(variable) => {
                for way in search.ways(variable) {
                    kept += states(decisions.len() + 1);
                    open.push(with(&decisions, variable, way));
                }
            }
            None => {
                kept += states(2 * decisions.len() + substitution.sources.len());
                answers.push(search.answer(&decisions, substitution));
            }
        }
    }
    let bound = if stop == StopReason::Complete { scale.worst() } else { scale.best() };
    Plan { substitutions: in_order(scale, answers), stop, expanded, bound }
}

fn with(decisions: &Decisions, variable: VariableId, way: Option<RelationId>) -> Decisions {
    let mut decisions = decisions.clone();
    decisions.insert(variable, way);
    decisions
}

/// A substitution with all that its order depends on.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Answer {
    pub(super) weight: Weight,
    /// The decisions, breadth first from the root, each variable where it is first needed.
    pub(super) order: Vec<Option<RelationId>>,
    pub(super) substitution: Substitution,
}

/// Sorts answers, and keeps the first of those that use the same relations.
pub(super) fn in_order(scale: Scale, mut answers: Vec<Answer>) -> Vec<(Substitution, f64)> {
    answers.sort();
    let mut seen = BTreeSet::new();
    answers.retain(|answer| seen.insert(answer.substitution.relations()));
    answers.into_iter().map(|answer| (answer.substitution, scale.utility(answer.weight))).collect()
}

struct Search<'a> {
    knowledge: &'a KnowledgeBase,
    root: VariableId,
    options: &'a Options,
}

impl Search<'_> {
    /// The present decisions as a substitution whose undecided variables are sources; `None` when they are cyclic.
    fn substitution(&self, decisions: &Decisions) -> Option<Substitution> {
        let relations = decisions.iter().filter_map(|(&variable, &way)| Some((variable, way?))).collect();
        Substitution::from_choice(self.knowledge, self.root, &relations)
    }

    fn undecided(&self, substitution: &Substitution, decisions: &Decisions) -> Option<VariableId> {
        substitution.sources.iter().copied().find(|variable| !decisions.contains_key(variable))
    }

    fn ways(&self, variable: VariableId) -> impl Iterator<Item = Option<RelationId>> + '_ {
        let is_root = variable == self.root;
        let provided = self.is_provided(variable);
        let as_it_comes = provided && !(is_root && self.options.without_empty);
        let expand = !provided || is_root || self.options.substitute_provided;
        let allowed = |relation: &&RelationId| !self.options.forbidden_relations.contains(relation);
        let producers = self.knowledge.producers(variable).iter().filter(allowed).copied().map(Some);
        as_it_comes.then_some(None).into_iter().chain(producers.filter(move |_| expand))
    }

    fn usable(&self, variable: VariableId) -> impl Iterator<Item = crate::knowledge::SignalId> + '_ {
        self.knowledge.carriers(variable).iter().copied().filter(|signal| {
            self.knowledge.is_available(*signal) && !self.options.forbidden_signals.contains(signal)
        })
    }

    fn is_provided(&self, variable: VariableId) -> bool {
        self.knowledge.variables()[variable].constant.is_some() || self.usable(variable).next().is_some()
    }

    fn accuracy(&self, variable: VariableId) -> Option<f64> {
        let own = self.knowledge.variables()[variable].properties.get(ACCURACY).copied();
        let of_signal = |signal| self.knowledge.signals()[signal].properties.get(ACCURACY).copied();
        own.or_else(|| self.usable(variable).filter_map(of_signal).reduce(f64::max))
    }

    fn rating(&self, output: VariableId, relation: RelationId) -> f64 {
        let relation = &self.knowledge.relations()[relation];
        let of_output = &self.knowledge.variables()[output].properties;
        let inputs = Inputs {
            count: relation.needs(output).count() as f64,
            unprovided: relation.needs(output).filter(|&input| !self.is_provided(input)).count() as f64,
            accuracy: relation.needs(output).filter_map(|input| self.accuracy(input)).product(),
        };
        let utility = self.knowledge.utility();
        let (own, of_output) =
            (utility.numbers_of(&relation.properties), utility.numbers_of_output(of_output));
        utility.of_relation(Numbers { relation: &own, output: &of_output }, &inputs)
    }

    /// The weight of the best signal of a source; a constant weighs nothing.
    fn source(&self, scale: Scale, variable: VariableId) -> Weight {
        if self.knowledge.variables()[variable].constant.is_some() {
            return Weight::ZERO;
        }
        let rating = |signal| self.knowledge.utility().of_signal(self.knowledge, signal);
        self.usable(variable).map(|signal| scale.signal(rating(signal))).min().unwrap_or_default()
    }

    fn answer(&self, decisions: &Decisions, substitution: Substitution) -> Answer {
        let scale = Scale(self.knowledge.utility().aggregate());
        // A relation that is used for several outputs counts once, with its worst rating.
        let mut weights: BTreeMap<RelationId, Weight> = BTreeMap::new();
        for step in &substitution.steps {
            let weight = weights.entry(step.relation).or_default();
            *weight = (*weight).max(scale.relation(self.rating(step.output, step.relation)));
        }
        let sources = substitution.sources.iter().map(|&source| self.source(scale, source));
        let weight = scale.join_all(weights.into_values().chain(sources));
        Answer { weight, order: self.order(decisions), substitution }
    }

    fn order(&self, decisions: &Decisions) -> Vec<Option<RelationId>> {
        let mut needed = Vec::from([self.root]);
        let mut order = Vec::new();
        while let Some(&variable) = needed.get(order.len()) {
            let way = decisions.get(&variable).copied().flatten();
            if let Some(relation) = way {
                let inputs = self.knowledge.relations()[relation].needs(variable);
                let new: Vec<_> = inputs.filter(|input| !needed.contains(input)).collect();
                needed.extend(new);
            }
            order.push(way);
        }
        order
    }
}
