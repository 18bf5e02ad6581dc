//! The cost of watching a way of knowing: operations a second, by the declared rates.

use crate::computation::Computation;
use crate::expression::{Formula, Shape};
use crate::knowledge::KnowledgeBase;
use crate::monitor::{ALL_PAIRS, PARTNERS};
use crate::substitution::{Step, Way};

/// A comparison counts as this many operations: reading the other way's value at that moment, and storing the result.
const COMPARISON: f64 = 10.0;

/// A vector counts as this many elements: only its observations tell its length.
const USUAL_ELEMENTS: f64 = 256.0;

/// The cost of a watched way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cost {
    rate_hz: f64,
    operations: f64,
}

impl Cost {
    /// A signal without a declared rate counts as a usual one, a vector as 256 elements, a relation without a formula as one
    /// operation for each input.
    pub(super) fn of(knowledge: &KnowledgeBase, way: &Way) -> Cost {
        let operations = |step: &Step| {
            let relation = &knowledge.relations()[step.relation];
            let condition = relation.condition.as_ref().map_or(0.0, operations);
            let inputs = || relation.needs(step.output).count() as f64;
            condition + relation.formula(step.output).map_or_else(inputs, operations)
        };
        Cost {
            rate_hz: Computation::rate_hz(knowledge, way, Computation::slowest_input),
            operations: 1.0 + way.substitution.steps.iter().map(operations).sum::<f64>(),
        }
    }

    /// Operations a second for computing the way.
    pub(super) fn alone(self) -> f64 {
        self.rate_hz * self.operations
    }

    /// Operations a second for comparing the way with another, at the outputs of the slower one.
    pub(super) fn compared(self, other: Cost) -> f64 {
        COMPARISON * self.rate_hz.min(other.rate_hz)
    }
}

/// The operations of an evaluation.
fn operations(formula: &Formula) -> f64 {
    let is_vector = |formula: &Formula| formula.shape() == Shape::Vector;
    let reads_vector = is_vector(formula) || formula.arguments().iter().any(is_vector);
    let own = if reads_vector { USUAL_ELEMENTS } else { 1.0 };
    own + formula.arguments().iter().map(operations).sum::<f64>()
}

/// The cost that the last of some ways adds.
pub(super) fn added_cost(costs: &[Cost], places: impl DoubleEndedIterator<Item = usize>) -> f64 {
    let partners = if costs.len() > ALL_PAIRS { PARTNERS.len() } else { costs.len() };
    let mut costs = places.rev().filter_map(|at| costs.get(at));
    let Some(last) = costs.next() else { return 0.0 };
    last.alone() + costs.take(partners).map(|other| last.compared(*other)).sum::<f64>()
}
