//! Resolved formulas: trees over symbols, in coherent SI units, simplified.

use alloc::vec;
use alloc::vec::Vec;

use super::Symbol;
use super::curve::Point;
use super::operation::{Binary, Comparison, Constant, Operation, Reduction, Unary};

/// What kind of value a formula has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Shape {
    /// One number.
    Scalar,
    /// Several numbers; how many is known only at the evaluation.
    Vector,
    /// True, false or unknown.
    Truth,
}

/// The largest number of nodes of a formula, with the model's functions expanded.
pub const MAX_NODES: usize = 10_000;
/// The largest number of nodes from the root to a leaf.
pub const MAX_LEVELS: usize = 200;

/// A formula over symbols in SI.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Formula {
    operation: Operation,
    shape: Shape,
    /// The number of nodes, and of nodes on the longest path to a leaf.
    size: usize,
    levels: usize,
    arguments: Vec<Formula>,
}

impl Formula {
    /// The value of a variable.
    #[must_use]
    pub fn symbol(symbol: Symbol, shape: Shape) -> Formula {
        Formula { operation: Operation::Symbol(symbol), shape, size: 1, levels: 1, arguments: Vec::new() }
    }

    /// A number in SI.
    #[must_use]
    pub fn constant(constant: Constant) -> Formula {
        Formula::node(Operation::Constant(constant), Vec::new())
    }

    pub(super) fn number(value: f64) -> Formula {
        Formula::constant(Constant::exact(value))
    }

    pub(super) fn previous(symbol: Symbol, shape: Shape) -> Formula {
        Formula { operation: Operation::Previous(symbol), ..Formula::symbol(symbol, shape) }
    }

    pub(super) fn unary(unary: Unary, of: Formula) -> Formula {
        Formula::node(Operation::Unary(unary), vec![of])
    }

    pub(super) fn binary(binary: Binary, left: Formula, right: Formula) -> Formula {
        Formula::node(Operation::Binary(binary), vec![left, right])
    }

    pub(super) fn compare(comparison: Comparison, left: Formula, right: Formula) -> Formula {
        Formula::node(Operation::Compare(comparison), vec![left, right])
    }

    /// A node of an operation other than a symbol; the shape follows from the arguments, which the caller has checked.
    pub(super) fn node(operation: Operation, arguments: Vec<Formula>) -> Formula {
        let is_vector = arguments.iter().any(|argument| argument.shape == Shape::Vector);
        let shape = match operation {
            Operation::Truth(_) | Operation::Compare(_) | Operation::And | Operation::Or | Operation::Not => {
                Shape::Truth
            }
            Operation::List | Operation::Slice(..) => Shape::Vector,
            Operation::Unary(_) | Operation::Binary(_) | Operation::Within(_) | Operation::Table
                if is_vector =>
            {
                Shape::Vector
            }
            _ => Shape::Scalar,
        };
        let size = arguments.iter().fold(1_usize, |sum, argument| sum.saturating_add(argument.size));
        let levels = 1 + arguments.iter().map(|argument| argument.levels).max().unwrap_or(0);
        Formula { operation, shape, size, levels, arguments }
    }

    /// The formula for a value that wraps after a whole turn: its `atan2` continues beyond pi.
    #[must_use]
    pub fn around(self) -> Formula {
        match self.operation {
            Operation::Binary(Binary::Atan2) => {
                Formula::node(Operation::Binary(Binary::Bearing), self.arguments)
            }
            Operation::Binary(Binary::Add | Binary::Sub) | Operation::Unary(Unary::Neg) => {
                let operation = self.operation;
                let arguments = self.arguments.into_iter().map(Formula::around).collect();
                Formula::node(operation, arguments)
            }
            _ => self,
        }
    }

    /// Several scalars as one vector, in this order.
    #[must_use]
    pub fn list(elements: Vec<Formula>) -> Formula {
        Formula::node(Operation::List, elements)
    }

    /// The formula with the elapsed time (`dt`) as a variable, for callers that know this time better than a program.
    #[must_use]
    pub fn with_elapsed(self, symbol: Symbol) -> Formula {
        if self.operation == Operation::Elapsed {
            return Formula::symbol(symbol, Shape::Scalar);
        }
        let arguments = self.arguments.iter().map(|argument| argument.clone().with_elapsed(symbol));
        self.with_arguments(arguments.collect())
    }

    /// A number through the lines between points, which ascend in their arguments.
    pub(super) fn table(of: Formula, points: &[Point]) -> Formula {
        let constants = points.iter().flat_map(|point| [point.at, point.value]).map(Formula::constant);
        Formula::node(Operation::Table, core::iter::once(of).chain(constants).collect())
    }

    /// The points of a table; empty for other operations.
    #[must_use]
    pub fn points(&self) -> Vec<Point> {
        if self.operation != Operation::Table {
            return Vec::new();
        }
        let pairs = self.arguments.get(1..).unwrap_or(&[]).chunks_exact(2);
        let point = |pair: &[Formula]| match pair {
            [at, value] => Some(Point { at: at.as_constant()?, value: value.as_constant()? }),
            _ => None,
        };
        pairs.filter_map(point).collect()
    }

    /// The same operation on other arguments of the same shapes.
    pub(super) fn with_arguments(&self, arguments: Vec<Formula>) -> Formula {
        if self.arguments.is_empty() { self.clone() } else { Formula::node(self.operation, arguments) }
    }

    /// The arguments of the root, for another formula.
    pub(super) fn into_arguments(self) -> Vec<Formula> {
        self.arguments
    }

    /// The operation of the root.
    #[must_use]
    pub fn operation(&self) -> Operation {
        self.operation
    }

    /// The arguments of the root.
    #[must_use]
    pub fn arguments(&self) -> &[Formula] {
        &self.arguments
    }

    /// The kind of the value.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// The number of nodes.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// The number of nodes on the longest path to a leaf.
    pub(super) fn levels(&self) -> usize {
        self.levels
    }

    /// Whether the formula is within [`MAX_NODES`] and [`MAX_LEVELS`].
    pub(super) fn is_bounded(&self) -> bool {
        self.size <= MAX_NODES && self.levels <= MAX_LEVELS
    }

    /// The value in SI, if the formula is a constant.
    #[must_use]
    pub fn as_constant(&self) -> Option<Constant> {
        match self.operation {
            Operation::Constant(constant) | Operation::Known(_, constant) => Some(constant),
            _ => None,
        }
    }

    /// The formula with each place of a named constant as a number of its own.
    pub(super) fn with_loose_constants(&self) -> Formula {
        match self.operation {
            Operation::Known(_, constant) => Formula::constant(constant),
            _ => self.with_arguments(self.arguments.iter().map(Formula::with_loose_constants).collect()),
        }
    }

    /// Whether it is a number without an uncertainty beyond rounding.
    pub(super) fn is_certain(&self) -> bool {
        self.as_constant().is_some_and(|constant| constant.is_certain() || constant.is(0.0))
    }

    /// Whether a variable or an uncertain constant occurs in both of two formulas.
    #[must_use]
    pub fn shares(&self, other: &Formula) -> bool {
        let mut found = false;
        self.visit(&mut |node| {
            let is_shared = matches!(
                node.operation,
                Operation::Symbol(_) | Operation::Previous(_) | Operation::Known(..)
            );
            found |= is_shared && other.contains(node.operation);
        });
        found
    }

    fn contains(&self, operation: Operation) -> bool {
        self.operation == operation || self.arguments.iter().any(|argument| argument.contains(operation))
    }

    /// Whether the formula is exactly this number.
    pub(super) fn is(&self, value: f64) -> bool {
        self.as_constant().is_some_and(|constant| constant.is(value))
    }

    /// The variables whose present value the formula uses, each once, in the order of their first use.
    #[must_use]
    pub fn symbols(&self) -> Vec<Symbol> {
        let mut symbols = Vec::new();
        self.visit(&mut |node| {
            if let Operation::Symbol(symbol) = node.operation
                && !symbols.contains(&symbol)
            {
                symbols.push(symbol);
            }
        });
        symbols
    }

    /// The variables whose previous value the formula uses, each once, in the order of their first use.
    #[must_use]
    pub fn previous_symbols(&self) -> Vec<Symbol> {
        let mut symbols = Vec::new();
        self.visit(&mut |node| {
            if let Operation::Previous(symbol) = node.operation
                && !symbols.contains(&symbol)
            {
                symbols.push(symbol);
            }
        });
        symbols
    }

    /// Whether the value depends on more than the present values of its symbols.
    #[must_use]
    pub fn is_stateful(&self) -> bool {
        let mut found = false;
        self.visit(&mut |node| found |= node.operation.is_stateful());
        found
    }

    /// Whether the formula compares the present value of a variable, or a term with it.
    #[must_use]
    pub fn compares(&self, symbol: Symbol) -> bool {
        let mut found = false;
        self.visit(&mut |node| {
            found |= matches!(node.operation, Operation::Compare(_)) && node.occurrences(symbol) > 0;
        });
        found
    }

    /// How often the present value of a variable is used.
    #[must_use]
    pub fn occurrences(&self, symbol: Symbol) -> usize {
        let mut count = 0;
        self.visit(&mut |node| count += usize::from(node.operation == Operation::Symbol(symbol)));
        count
    }

    /// Whether the formula contains a number that is uncertain beyond rounding, or a choice, so that two copies of it may differ
    /// in value.
    pub(super) fn is_uncertain(&self) -> bool {
        let mut found = false;
        self.visit(&mut |node| {
            found |= matches!(node.operation, Operation::Constant(_)) && !node.is_certain();
            found |= node.operation == Operation::Reduce(Reduction::OneOf);
        });
        found
    }

    fn visit(&self, see: &mut dyn FnMut(&Formula)) {
        see(self);
        for argument in &self.arguments {
            argument.visit(see);
        }
    }
}

/// A whole power in its tightest form.
pub(super) fn whole_power(base: Formula, exponent: i32) -> Formula {
    match exponent {
        1 => base,
        2 => Formula::unary(Unary::Sqr, base),
        _ => Formula::unary(Unary::Power(exponent), base),
    }
}

impl Operation {
    /// Whether the value depends on more than the arguments' present values.
    pub(super) fn is_stateful(self) -> bool {
        matches!(self, Operation::Previous(_) | Operation::Elapsed) || self.recalls()
    }

    /// Whether the operation keeps samples of its argument.
    pub(super) fn recalls(self) -> bool {
        matches!(
            self,
            Operation::Derivative(_)
                | Operation::Integral
                | Operation::Delay(_)
                | Operation::MovingMean(_)
                | Operation::Held(_)
                | Operation::Answered(_)
        )
    }
}
