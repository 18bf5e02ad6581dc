//! The alternatives of a formula with `one_of`: what it is for each choice, so that each is solved and compared by itself.

use super::formula::{Formula, Shape};
use super::operation::{Operation, Reduction};
use alloc::vec;
use alloc::vec::Vec;

/// How many alternatives [`alternatives`] gives. Complexity: O(nodes times levels).
pub(super) fn count(formula: &Formula) -> usize {
    if !formula.has_choice() || formula.shape() != Shape::Scalar || formula.operation().recalls() {
        return 1;
    }
    match (formula.operation(), formula.arguments()) {
        (Operation::Reduce(Reduction::OneOf), [list]) => {
            list.arguments().iter().map(count).fold(0, usize::saturating_add)
        }
        (_, arguments) => arguments.iter().map(count).fold(1, usize::saturating_mul),
    }
}

/// The formula for each choice of its `one_of`s, those of different places in every combination. What a time operator looks back
/// on is not taken apart, as the choice may have changed in the meantime; nor are vectors. Complexity: O(nodes times
/// alternatives), without any where nothing is to be chosen.
pub(super) fn alternatives(formula: &Formula) -> Vec<Formula> {
    if count(formula) == 1 {
        return vec![formula.clone()];
    }
    match (formula.operation(), formula.arguments()) {
        (Operation::Reduce(Reduction::OneOf), [list]) => {
            list.arguments().iter().flat_map(alternatives).collect()
        }
        (_, arguments) => {
            let combined = arguments.iter().fold(vec![Vec::new()], |begun, argument| {
                let own = alternatives(argument);
                begun.iter().flat_map(|begun| own.iter().map(|own| joined(begun, own))).collect()
            });
            combined.into_iter().map(|arguments| formula.with_arguments(arguments)).collect()
        }
    }
}

fn joined(begun: &[Formula], next: &Formula) -> Vec<Formula> {
    begun.iter().chain([next]).cloned().collect()
}

/// One of these formulas; those of several inverses are alternatives, too.
pub(super) fn one_of(formulas: Vec<Formula>) -> Formula {
    let flat = formulas.into_iter().flat_map(|formula| match (formula.operation(), formula.arguments()) {
        (Operation::Reduce(Reduction::Either), [list]) if list.operation() == Operation::List => {
            list.arguments().to_vec()
        }
        _ => vec![formula],
    });
    let list = Formula::node(Operation::List, flat.collect());
    Formula::node(Operation::Reduce(Reduction::OneOf), vec![list])
}
