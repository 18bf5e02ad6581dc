//! The requirements along substitutions, as a search checks them.

use super::cost::Cost;
use super::{Requirements, usable};
use crate::knowledge::{KnowledgeBase, SignalSet, VariableId};
use crate::plan::graph::Options;
use crate::plan::subproblem::{ChoiceId, Place, Subproblem};
use crate::substitution::{Step, Substitution, Way};
use alloc::collections::BTreeMap;

/// The number of rounds that improve lower bounds where places need each other in a cycle.
const ROUNDS: usize = 4;

/// The requirements along substitutions, as a search checks them.
#[derive(Debug)]
pub(in super::super) struct Paths<'a> {
    knowledge: &'a KnowledgeBase,
    options: Options,
    requirements: Requirements,
    /// The least cost of each variable of the subproblem, over all choices.
    least: BTreeMap<VariableId, Cost>,
}

impl<'a> Paths<'a> {
    /// The check for a subproblem with the same, narrowed options. Complexity: O(subproblem).
    pub(in super::super) fn new(
        knowledge: &'a KnowledgeBase,
        requirements: Requirements,
        options: Options,
        subproblem: &Subproblem,
    ) -> Paths<'a> {
        let mut paths = Paths { knowledge, options, requirements, least: BTreeMap::new() };
        paths.least.extend(subproblem.places().map(|place| (subproblem.variable(place), Cost::NONE)));
        // Starts from below, so that the bounds are valid after every round; for a tree one round is enough.
        for _ in 0..ROUNDS {
            for place in subproblem.places().rev() {
                let costs = subproblem.choices(place).map(|choice| paths.cost(subproblem, place, choice));
                let least = costs.fold(Cost::MAX, Cost::least);
                paths.least.insert(subproblem.variable(place), least);
            }
        }
        paths
    }

    fn cost(&self, subproblem: &Subproblem, place: Place, choice: ChoiceId) -> Cost {
        let output = subproblem.variable(place);
        match subproblem.choice(choice).relation {
            Some(relation) => {
                Cost::of_step(self.knowledge, Step { relation, output }, |input| self.least(input))
            }
            None => self.source(output),
        }
    }

    fn source(&self, variable: VariableId) -> Cost {
        Cost::of_source(self.knowledge, variable, usable(self.knowledge, &self.options, variable))
    }

    fn least(&self, variable: VariableId) -> Cost {
        self.least.get(&variable).copied().unwrap_or_else(|| self.source(variable))
    }

    /// Whether some completion of these steps, in their order of computation, may meet the requirements.
    ///
    /// Complexity: O(n log n) for n inputs of the steps.
    pub(in super::super) fn allow(&self, root: VariableId, steps: &[Step]) -> bool {
        let mut known: BTreeMap<VariableId, Cost> = BTreeMap::new();
        for step in steps {
            let of = |input| known.get(&input).copied().unwrap_or_else(|| self.least(input));
            known.insert(step.output, Cost::of_step(self.knowledge, *step, of));
        }
        let cost = known.get(&root).copied().unwrap_or_else(|| self.least(root));
        self.requirements.allow(cost)
    }

    /// Whether a complete substitution meets the requirements.
    pub(in super::super) fn admit(&self, substitution: &Substitution) -> bool {
        let Paths { knowledge, options, requirements, .. } = self;
        let is_short = |way: &Way| !requirements.shortfalls_of_way(knowledge, way).is_empty();
        requirements.allow(Cost::along(knowledge, substitution, |source| self.source(source)))
            && !requirements.ways(knowledge, options, &SignalSet::new(), substitution).iter().all(is_short)
    }
}
