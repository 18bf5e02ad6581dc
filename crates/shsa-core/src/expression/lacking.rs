//! Which formulas may have no value where their variables have one.

use super::Symbol;
use super::curve::Curve;
use super::domain::leaves_out;
use super::formula::Formula;
use super::operation::{Operation, Reduction};
use crate::interval::Interval;

impl Formula {
    /// Whether the formula may have no value while each variable has one within its range: a root of what may be negative, say.
    /// Functions of the past are asked for their arguments only, and vectors for all that is done with their elements.
    /// Complexity: O(nodes times levels).
    pub(super) fn may_lack(&self, range: &dyn Fn(Symbol) -> Option<Interval>) -> bool {
        let lacks = |argument: &Formula| argument.may_lack(range);
        match (self.operation(), self.arguments()) {
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
                let points = self.points();
                leaves_out(operation, bounds(0), bounds(1), Curve::new(&points))
                    || arguments.iter().any(lacks)
            }
        }
    }

    /// Whether the root passes over arguments of which it may be open whether they have a value.
    pub(super) fn weighs_arguments(&self) -> bool {
        let (Operation::Reduce(reduction), [list]) = (self.operation(), self.arguments()) else {
            return false;
        };
        match reduction {
            Reduction::Sum | Reduction::Norm => false,
            // Their hull holds all that the arguments may be, but for those of which one of two cases has no value.
            Reduction::Either | Reduction::OneOf => list.has_open_case(),
            _ => list.may_lack(&|_| None),
        }
    }

    fn has_open_case(&self) -> bool {
        matches!(self.operation(), Operation::Select | Operation::Index)
            || self.arguments().iter().any(Formula::has_open_case)
    }
}
