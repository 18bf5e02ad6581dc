//! The operations of a resolved formula, and of a program.

use core::cmp::Ordering;

use super::Symbol;
use crate::interval::Interval;
use crate::time::Span;

/// The operation of a node of a resolved formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Operation {
    /// A number in SI, possibly uncertain.
    Constant(Constant),
    /// The value of a named constant that is uncertain, SI: one number in all its places.
    Known(Symbol, Constant),
    /// `true` or `false`.
    Truth(bool),
    /// The value of a variable.
    Symbol(Symbol),
    /// The value that a variable had at the previous evaluation.
    Previous(Symbol),
    /// The seconds since the previous evaluation.
    Elapsed,
    /// One number to one number, or element by element.
    Unary(Unary),
    /// Two numbers to one, or element by element.
    Binary(Binary),
    /// Two numbers to a truth.
    Compare(Comparison),
    /// Both are true.
    And,
    /// At least one is true.
    Or,
    /// It is not true.
    Not,
    /// The second argument where the first is true, the third where it is false; both when it is unknown.
    Select,
    /// The first argument through a piecewise linear curve; the others are its points, each an argument and its value.
    Table,
    /// Numbers to a vector.
    List,
    /// A vector to a number.
    Reduce(Reduction),
    /// An element of a vector, counted from 0; the index is rounded down.
    Index,
    /// The elements from the first place to before the second; `u32::MAX` is the end.
    Slice(u32, u32),
    /// The part within the bounds of the constant; missing when there is none.
    Within(Constant),
    /// The mean rate of change over a span.
    Derivative(Span),
    /// The integral over time since the first evaluation.
    Integral,
    /// The value a span ago.
    Delay(Span),
    /// The mean of the values within the last span.
    MovingMean(Span),
    /// Of 1 where a condition holds and 0 where it does not: 1 where it has held throughout the last span.
    Held(Span),
    /// Of 0 where a response holds, 2 where a trigger holds without it, else 1: 0 where a trigger is older than the span and has had
    /// no response since, else 1.
    Answered(Span),
}

/// Functions of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unary {
    /// The negative.
    Neg,
    /// The magnitude.
    Abs,
    /// The largest whole number that is not larger.
    Floor,
    /// The square.
    Sqr,
    /// The square root.
    Sqrt,
    /// A whole power other than 1 and 2.
    Power(i32),
    /// A root of degree three or more; odd roots of negative numbers are negative.
    Root(i32),
    /// The exponential function.
    Exp,
    /// The natural logarithm.
    Ln,
    /// Sine of radians.
    Sin,
    /// Cosine of radians.
    Cos,
    /// Tangent of radians.
    Tan,
    /// Inverse sine.
    Asin,
    /// Inverse cosine.
    Acos,
    /// Inverse tangent.
    Atan,
}

/// Functions of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Binary {
    /// The sum.
    Add,
    /// The difference.
    Sub,
    /// The product.
    Mul,
    /// The quotient.
    Div,
    /// A real power; of a negative base for whole exponents.
    Pow,
    /// The smaller one.
    Min,
    /// The greater one.
    Max,
    /// The angle of the point (second, first) to the first axis.
    Atan2,
    /// The same for a value that wraps: around the negative axis it continues beyond pi instead of becoming all angles.
    Bearing,
    /// The length of the hypotenuse.
    Hypot,
}

/// Comparisons of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `==`
    Equal,
}

/// Functions of a vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reduction {
    /// The smallest of the elements that have a value.
    Min,
    /// The greatest of the elements that have a value.
    Max,
    /// The sum; missing when an element has no value.
    Sum,
    /// The mean of the elements that have a value.
    Mean,
    /// The root of the sum of squares; missing when an element has no value.
    Norm,
    /// The median of the elements that have a value; the mean of the middle two when their number is even.
    Median,
    /// The number of elements that have a value.
    Count,
    /// The hull of the elements that have a value; over plain numbers the only such element, else missing.
    Either,
    /// The same of values of which one holds; they are told apart where they are compared.
    OneOf,
}

impl Reduction {
    /// Whether it is a function of the elements that have a value.
    #[must_use]
    pub fn passes_over(self) -> bool {
        !matches!(self, Reduction::Sum | Reduction::Norm)
    }
}

/// A number in SI: a nominal value for plain numbers, and bounds for intervals.
#[derive(Clone, Copy, Debug)]
pub struct Constant {
    /// The nominal value, within the bounds.
    pub value: f64,
    /// The bounds.
    pub bounds: Interval,
}

impl Constant {
    /// Exactly this number.
    #[must_use]
    pub fn exact(value: f64) -> Constant {
        Constant { value, bounds: Interval::point(value) }
    }

    /// A number between the bounds; their middle over plain numbers.
    #[must_use]
    pub fn between(bounds: Interval) -> Constant {
        Constant { value: bounds.midpoint(), bounds }
    }

    /// Whether the bounds are no wider than rounding makes them.
    #[must_use]
    pub fn is_certain(self) -> bool {
        self.bounds.width() <= 1e-12 * self.value.abs()
    }

    /// Whether it is exactly this number.
    #[must_use]
    pub fn is(self, value: f64) -> bool {
        self.bounds == Interval::point(value)
    }

    fn parts(self) -> [f64; 3] {
        [self.value, self.bounds.lo(), self.bounds.hi()]
    }
}

// Compared bit by bit, so that constants can be keys; numerically equal constants may differ.
impl Ord for Constant {
    fn cmp(&self, other: &Constant) -> Ordering {
        let pairs = self.parts().into_iter().zip(other.parts());
        pairs.map(|(own, its)| own.total_cmp(&its)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    }
}

impl PartialOrd for Constant {
    fn partial_cmp(&self, other: &Constant) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Constant {
    fn eq(&self, other: &Constant) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Constant {}
