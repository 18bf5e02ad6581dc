//! What a formula can be, by the ranges of its variables, and how much of its arguments it leaves open.

use super::Symbol;
use super::curve::Curve;
use super::formula::Formula;
use super::number::Number;
use super::operation::{Binary, Operation, Reduction};
use crate::interval::Interval;
use alloc::vec::Vec;

const NOT_NEGATIVE: Interval = Interval::new(0.0, f64::INFINITY);

/// The declared range of a variable, SI; `None` where every value is possible.
type Range<'r> = &'r dyn Fn(Symbol) -> Option<Interval>;

impl Formula {
    /// An interval that holds the value for all values within the ranges of the variables. Complexity: O(nodes).
    #[must_use]
    pub fn bounds(&self, range: Range<'_>) -> Interval {
        let below: Vec<Interval> = self.arguments().iter().map(|argument| argument.bounds(range)).collect();
        match (self.operation(), below.as_slice()) {
            (Operation::Constant(constant) | Operation::Known(_, constant), _) => constant.bounds,
            (Operation::Symbol(symbol) | Operation::Previous(symbol), _) => {
                range(symbol).unwrap_or(Interval::ENTIRE)
            }
            (Operation::Unary(unary), [of]) => of.unary(unary),
            (Operation::Binary(binary), [left, right]) => left.binary(binary, *right),
            (Operation::Within(bounds), [of]) => of.intersection(bounds.bounds),
            (Operation::Table, [of, ..]) => Curve::new(&self.points()).over(*of),
            (Operation::Reduce(Reduction::Either | Reduction::OneOf), [of]) => *of,
            (Operation::List, all) => all.iter().copied().fold(Interval::EMPTY, Interval::hull),
            (Operation::Held(_) | Operation::Answered(_), _) => Interval::new(0.0, 1.0),
            (Operation::Select, [_, then, other]) => Interval::hull(*then, *other),
            (Operation::Reduce(Reduction::Norm), _) | (Operation::Elapsed, _) => NOT_NEGATIVE,
            (Operation::Index, [of, _]) | (Operation::Delay(_) | Operation::Slice(..), [of]) => *of,
            (
                Operation::Reduce(Reduction::Min | Reduction::Max | Reduction::Mean | Reduction::Median),
                [of],
            ) => *of,
            _ => Interval::ENTIRE,
        }
    }

    /// In how many places exact arguments may leave the value open: between several values (`either`, `one_of`), or by a division by
    /// what may be zero. Complexity: O(nodes times levels).
    #[must_use]
    pub fn open_places(&self, range: Range<'_>) -> usize {
        let is_open = match (self.operation(), self.arguments()) {
            (Operation::Reduce(Reduction::Either | Reduction::OneOf), _) => true,
            (Operation::Binary(Binary::Div), [_, divisor]) => divisor.bounds(range).contains(0.0),
            _ => false,
        };
        let below = self.arguments().iter().map(|argument| argument.open_places(range));
        usize::from(is_open) + below.sum::<usize>()
    }

    /// Whether exact arguments may leave several values: of several inverses, say. Complexity: O(nodes).
    #[must_use]
    pub fn has_branches(&self) -> bool {
        matches!(self.operation(), Operation::Reduce(Reduction::Either | Reduction::OneOf))
            || self.arguments().iter().any(Formula::has_branches)
    }

    /// Whether one of several values is chosen in it, and which one is not known (`one_of`). Complexity: O(nodes).
    #[must_use]
    pub fn has_choice(&self) -> bool {
        self.operation() == Operation::Reduce(Reduction::OneOf)
            || self.arguments().iter().any(Formula::has_choice)
    }

    /// Whether the present value of a variable is used, and in derivatives alone, which an offset leaves as they are.
    /// Complexity: O(nodes).
    #[must_use]
    pub fn only_differentiates(&self, symbol: Symbol) -> bool {
        self.occurrences(symbol) > 0 && !self.takes(symbol)
    }

    /// Whether the present value of a variable is used outside of derivatives.
    fn takes(&self, symbol: Symbol) -> bool {
        match self.operation() {
            Operation::Derivative(_) => false,
            Operation::Symbol(used) => used == symbol,
            _ => self.arguments().iter().any(|argument| argument.takes(symbol)),
        }
    }
}
