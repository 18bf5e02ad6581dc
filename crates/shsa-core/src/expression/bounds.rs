//! What a formula can be, by the ranges of its variables, and how much of its arguments it leaves open.

use super::Symbol;
use super::curve::Curve;
use super::formula::Formula;
use super::number::Number;
use super::operation::{Binary, Operation, Reduction, Unary};
use crate::interval::{Course, Interval, Offset};
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

    /// What bounds the value between two moments at which it is known, by what bounds the variables. Complexity: O(nodes times levels).
    #[must_use]
    pub fn course(&self, of: &dyn Fn(Symbol) -> Course) -> Course {
        let range = |symbol| Some(of(symbol).range);
        Course { max_rate: self.rate(of, &range), range: self.bounds(&range), offset: self.offset(of) }
    }

    /// What the formula makes of the offsets of its variables; none where another operation than a sum or a constant factor does.
    fn offset(&self, of: &dyn Fn(Symbol) -> Course) -> Offset {
        let argument = |at: usize| self.arguments().get(at);
        let below = |at: usize| argument(at).map_or(Offset::NONE, |it| it.offset(of));
        // Of a factor between bounds, the part that is the same is that of the smallest.
        let factor = |at: usize, least: bool| {
            let bounds = argument(at).and_then(Formula::as_constant)?.bounds;
            let size = if least { bounds.mignitude() } else { 1.0 / bounds.magnitude() };
            Some(if bounds.hi() < 0.0 { -size } else { size })
        };
        // The value of terms that share a variable is narrower than the sum of theirs.
        if argument(0).zip(argument(1)).is_some_and(|(one, other)| one.shares(other)) {
            return Offset::NONE;
        }
        match self.operation() {
            Operation::Symbol(symbol) => of(symbol).offset,
            Operation::Unary(Unary::Neg) => below(0).times(-1.0),
            Operation::Binary(Binary::Add) => below(0).and(below(1)),
            Operation::Binary(Binary::Sub) => below(0).and(below(1).times(-1.0)),
            Operation::Binary(Binary::Mul) => match (factor(0, true), factor(1, true)) {
                (Some(factor), _) => below(1).times(factor),
                (_, Some(factor)) => below(0).times(factor),
                _ => Offset::NONE,
            },
            Operation::Binary(Binary::Div) => {
                factor(1, false).map_or(Offset::NONE, |factor| below(0).times(factor))
            }
            _ => Offset::NONE,
        }
    }

    /// The largest rate of change, by the rates of the variables; infinite where the formula is not known to bound it.
    fn rate(&self, of: &dyn Fn(Symbol) -> Course, range: Range<'_>) -> f64 {
        let below = |at: usize| self.arguments().get(at).map_or(0.0, |argument| argument.rate(of, range));
        let most = |at: usize| {
            self.arguments().get(at).map_or(f64::INFINITY, |argument| argument.bounds(range).magnitude())
        };
        // What stands still changes by nothing, whatever its factor.
        let product = |rate: f64, factor: f64| if rate == 0.0 { 0.0 } else { (rate * factor).next_up() };
        match self.operation() {
            Operation::Constant(_) => 0.0,
            Operation::Symbol(symbol) => of(symbol).max_rate,
            Operation::Unary(Unary::Neg | Unary::Abs | Unary::Sin | Unary::Cos | Unary::Atan) => below(0),
            Operation::Unary(Unary::Sqr) => product(below(0), 2.0 * most(0)),
            Operation::Within(_) | Operation::Delay(_) | Operation::MovingMean(_) => below(0),
            Operation::Binary(Binary::Add | Binary::Sub | Binary::Hypot) => (below(0) + below(1)).next_up(),
            Operation::Binary(Binary::Min | Binary::Max) => below(0).max(below(1)),
            Operation::Binary(Binary::Mul) => product(below(0), most(1)) + product(below(1), most(0)),
            Operation::Binary(Binary::Div) if below(1) == 0.0 => {
                let divisor =
                    self.arguments().get(1).map_or(0.0, |divisor| divisor.bounds(range).mignitude());
                product(below(0), 1.0 / divisor)
            }
            _ => f64::INFINITY,
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
