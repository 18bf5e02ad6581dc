//! What a formula can be, by the ranges of its variables, and how much of its arguments it leaves open.

use super::Symbol;
use super::formula::Formula;
use super::number::Number;
use super::operation::{Binary, Operation, Reduction};
use crate::interval::Interval;
use alloc::vec::Vec;

/// What holds several inverses.
const EITHER: Operation = Operation::Reduce(Reduction::Either);

const NOT_NEGATIVE: Interval = Interval::new(0.0, f64::INFINITY);

/// The declared range of a variable, SI; `None` where every value is possible.
type Range<'r> = &'r dyn Fn(Symbol) -> Option<Interval>;

impl Formula {
    /// An interval that holds the value for all values within the ranges of the variables. Complexity: O(nodes).
    #[must_use]
    pub fn bounds(&self, range: Range<'_>) -> Interval {
        let below: Vec<Interval> = self.arguments().iter().map(|argument| argument.bounds(range)).collect();
        match (self.operation(), below.as_slice()) {
            (Operation::Constant(constant), _) => constant.bounds,
            (Operation::Symbol(symbol) | Operation::Previous(symbol), _) => {
                range(symbol).unwrap_or(Interval::ENTIRE)
            }
            (Operation::Unary(unary), [of]) => of.unary(unary),
            (Operation::Binary(binary), [left, right]) => left.binary(binary, *right),
            (Operation::Within(bounds), [of]) => of.intersection(bounds.bounds),
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

    /// In how many places exact arguments may leave the value open: between several inverses (`either`), or by a division by
    /// what may be zero. Complexity: O(nodes times levels).
    #[must_use]
    pub fn open_places(&self, range: Range<'_>) -> usize {
        let is_open = match (self.operation(), self.arguments()) {
            (EITHER, _) => true,
            (Operation::Binary(Binary::Div), [_, divisor]) => divisor.bounds(range).contains(0.0),
            _ => false,
        };
        let below = self.arguments().iter().map(|argument| argument.open_places(range));
        usize::from(is_open) + below.sum::<usize>()
    }

    /// Whether exact arguments may leave several values: of several inverses, say. Complexity: O(nodes).
    #[must_use]
    pub fn has_branches(&self) -> bool {
        self.operation() == EITHER || self.arguments().iter().any(Formula::has_branches)
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
