//! Which formulas may have no value where their variables have one.

use super::Symbol;
use super::curve::Curve;
use super::domain::leaves_out;
use super::formula::Formula;
use super::operation::{Operation, Reduction};
use crate::interval::Interval;

/// Whether the formula may have no value while each variable has one within its range: a root of what may be negative, say.
/// Functions of the past are asked for their arguments only, and vectors for all that is done with their elements.
/// Complexity: O(nodes times levels).
pub(super) fn may_lack(formula: &Formula, range: &dyn Fn(Symbol) -> Option<Interval>) -> bool {
    let lacks = |argument: &Formula| may_lack(argument, range);
    match (formula.operation(), formula.arguments()) {
        (Operation::Index, _) => true,
        (Operation::Reduce(reduction), [list])
            if reduction.passes_over() && list.operation() == Operation::List =>
        {
            reduction != Reduction::Count && list.arguments().iter().all(lacks)
        }
        (Operation::Reduce(_), [vector]) if vector.operation() != Operation::List => true,
        (operation, arguments) => {
            let bounds =
                |at: usize| arguments.get(at).map_or(Interval::EMPTY, |it: &Formula| it.bounds(range));
            let points = formula.points();
            leaves_out(operation, bounds(0), bounds(1), Curve::new(&points)) || arguments.iter().any(lacks)
        }
    }
}

/// Whether the root passes over arguments of which it may be open whether they have a value.
pub(super) fn weighs_arguments(formula: &Formula) -> bool {
    let (Operation::Reduce(reduction), [list]) = (formula.operation(), formula.arguments()) else {
        return false;
    };
    match reduction {
        Reduction::Sum | Reduction::Norm => false,
        // Their hull holds all that the arguments may be, but for those of which one of two cases has no value.
        Reduction::Either | Reduction::OneOf => has_open_case(list),
        _ => may_lack(list, &|_| None),
    }
}

fn has_open_case(formula: &Formula) -> bool {
    matches!(formula.operation(), Operation::Select | Operation::Index)
        || formula.arguments().iter().any(has_open_case)
}
