//! What a substitution is worth: a factor for each relation, added up as exact weights.

use crate::knowledge::{KnowledgeBase, RelationId, SignalId, Utility, VariableId};
use alloc::vec::Vec;
use core::fmt;
use core::ops::{Add, Sub};

/// What a utility may know about a relation that is used for one output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
    /// How many variables it needs.
    pub inputs: usize,
    /// How many of them are not provided.
    pub unprovided: usize,
    /// Its property `cost`, 1 without.
    pub cost: f64,
    /// The product of the accuracies of those inputs that have one.
    pub accuracy: f64,
}

/// The factor of a relation, in (0, 1] for a model without [`check`]ed problems.
pub(super) fn factor(utility: &Utility, facts: &Facts) -> f64 {
    match utility {
        Utility::Norm => norm(facts),
    }
}

fn norm(facts: &Facts) -> f64 {
    let few_inputs = 0.3 / facts.inputs.max(1) as f64;
    let few_unprovided = 0.1 / (facts.unprovided as f64 + 1.0);
    (few_inputs + 0.5 / facts.cost + few_unprovided + 0.5 * facts.accuracy) / 1.4
}

/// A number in a model that would let the utility rise with more relations, or fall below zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Problem {
    /// A relation's `cost` is below 1.
    Cost(RelationId, f64),
    /// A variable's `accuracy` is outside [0, 1].
    VariableAccuracy(VariableId, f64),
    /// A signal's `accuracy` is outside [0, 1].
    SignalAccuracy(SignalId, f64),
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Problem::Cost(_, value) => write!(f, "the cost {value} is below 1"),
            Problem::VariableAccuracy(_, value) | Problem::SignalAccuracy(_, value) => {
                write!(f, "the accuracy {value} is outside 0 to 1")
            }
        }
    }
}

/// Everything for which the utility is not a product of factors in (0, 1]. Complexity: O(model).
///
/// The searches refuse such a model with [`StopReason::NotMonotone`](super::StopReason::NotMonotone).
#[must_use]
pub fn check(knowledge: &KnowledgeBase) -> Vec<Problem> {
    let costs = knowledge.relations().enumerate().filter_map(|(id, relation)| {
        let cost = relation.properties.get("cost").copied()?;
        (cost < 1.0 || cost.is_nan()).then_some(Problem::Cost(id, cost))
    });
    let variables = knowledge.variables().enumerate().filter_map(|(id, variable)| {
        let accuracy = variable.properties.get("accuracy").copied()?;
        (!is_share(accuracy)).then_some(Problem::VariableAccuracy(id, accuracy))
    });
    let signals = knowledge.signals().enumerate().filter_map(|(id, signal)| {
        let accuracy = signal.properties.get("accuracy").copied()?;
        (!is_share(accuracy)).then_some(Problem::SignalAccuracy(id, accuracy))
    });
    costs.chain(variables).chain(signals).collect()
}

fn is_share(value: f64) -> bool {
    (0.0..=1.0).contains(&value)
}

/// How many bits of a weight count relations.
const COUNT_BITS: u32 = 32;
/// Weights are multiples of this share of a neper, so that their sums are exact in any order.
const STEPS_PER_NEPER: f64 = (1_u64 << 50) as f64;
/// The weight of a factor of 0, which is as good as infinite and can still be added up.
const HEAVIEST: f64 = (1_u128 << 80) as f64;

/// The minus logarithm of a utility, and below it the number of relations: what is smaller is better.
///
/// A whole number, since sums of floating-point logarithms (or products of factors) depend on their order, and
/// then substitutions that are equally good would be told apart by rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Weight(u128);

impl Weight {
    /// No relation: utility 1.
    pub(super) const ZERO: Weight = Weight(0);
    /// Heavier than any sum.
    pub(super) const MAX: Weight = Weight(u128::MAX);

    /// The weight of one relation with a factor in (0, 1]; rounded by at most 2^-51 of a neper.
    pub(super) fn of_factor(factor: f64) -> Weight {
        let steps = libm::round(-libm::log(factor) * STEPS_PER_NEPER).clamp(0.0, HEAVIEST);
        Weight(((steps as u128) << COUNT_BITS) | 1)
    }

    /// The utility, rounded to 12 significant digits; a heavier weight never has a higher one.
    pub(super) fn utility(self) -> f64 {
        let nepers = (self.0 >> COUNT_BITS) as f64 / STEPS_PER_NEPER;
        rounded(libm::exp(-nepers))
    }
}

impl Add for Weight {
    type Output = Weight;
    fn add(self, other: Weight) -> Weight {
        Weight(self.0.saturating_add(other.0))
    }
}

/// What is left, or nothing.
impl Sub for Weight {
    type Output = Weight;
    fn sub(self, part: Weight) -> Weight {
        Weight(self.0.saturating_sub(part.0))
    }
}

impl core::iter::Sum for Weight {
    fn sum<I: Iterator<Item = Weight>>(weights: I) -> Weight {
        weights.fold(Weight::ZERO, Add::add)
    }
}

/// A number in [0, 1] to 12 significant digits, so that 0.9 is shown as 0.9.
fn rounded(value: f64) -> f64 {
    let mut scale = 1e12;
    while value * scale < 1e11 && scale < 1e300 {
        scale *= 10.0;
    }
    libm::round(value * scale) / scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check_norm(inputs: usize, unprovided: usize, cost: f64, accuracy: f64, expected: f64) {
        let factor = factor(&Utility::Norm, &Facts { inputs, unprovided, cost, accuracy });
        assert!((factor - expected).abs() < 1e-12, "{factor}");
    }

    #[test]
    fn norm_as_in_the_thesis() {
        check_norm(1, 0, 1.0, 1.0, 1.0);
        check_norm(0, 0, 1.0, 1.0, 1.0);
        check_norm(2, 1, 1.0, 1.0, 1.2 / 1.4);
        check_norm(3, 0, 2.0, 0.5, 0.7 / 1.4);
        check_norm(1, 0, f64::INFINITY, 0.0, 0.4 / 1.4);
    }

    #[test]
    fn a_utility_is_shown_as_people_write_it() {
        assert_eq!(Weight::ZERO.utility(), 1.0);
        for factor in [1.0, 0.9, 0.85, 0.3, 0.001, 1e-9, 0.0] {
            assert_eq!(Weight::of_factor(factor).utility(), factor);
        }
    }

    #[test]
    fn a_factor_that_rounding_put_above_one_is_one() {
        assert_eq!(Weight::of_factor(1.0 + f64::EPSILON), Weight::of_factor(1.0));
    }

    #[test]
    fn more_relations_are_heavier_at_the_same_utility() {
        let one = Weight::of_factor(1.0);
        assert!(one + one > one && (one + one).utility() == 1.0);
    }

    proptest! {
        #[test]
        fn weights_add_up_to_the_product(factors in prop::collection::vec(0.05..=1.0_f64, 0..40)) {
            let weight: Weight = factors.iter().map(|&factor| Weight::of_factor(factor)).sum();
            let product: f64 = factors.iter().product();
            prop_assert!((weight.utility() - product).abs() <= 6e-12 * product, "{} {product}", weight.utility());
        }

        #[test]
        fn a_heavier_weight_has_no_higher_utility(a in 0.0..=1.0_f64, step in 0..100_u32) {
            let heavy = Weight::of_factor(a.max(1e-300));
            let heavier = heavy + Weight(u128::from(step) << COUNT_BITS);
            prop_assert!(heavier.utility() <= heavy.utility());
        }
    }
}
