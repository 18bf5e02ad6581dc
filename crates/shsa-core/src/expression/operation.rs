//! The operations of a resolved formula, and of a program.

use core::cmp::Ordering;

use super::Symbol;
use crate::interval::Interval;
use crate::time::Span;

/// What a node of a resolved formula does with its arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Operation {
    /// A number in SI, possibly uncertain.
    Constant(Constant),
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
    /// The second where the first is true, else the third; both when that is unknown.
    Select,
    /// Numbers to a vector.
    List,
    /// A vector to a number.
    Reduce(Reduction),
    /// An element of a vector, counted from 0; the index is rounded down.
    Index,
    /// The elements from the first place to before the second; `u32::MAX` is the end.
    Slice(u32, u32),
    /// The part within the bounds of the constant; nothing when there is none.
    Within(Constant),
    /// The mean rate of change over a span.
    Derivative(Span),
    /// The integral over time since the first evaluation.
    Integral,
    /// The value a span ago.
    Delay(Span),
    /// The mean of the values within the last span.
    MovingMean(Span),
}

/// Functions of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unary {
    /// The negative.
    Neg,
    /// Without the sign.
    Abs,
    /// The greatest whole number that is not greater.
    Floor,
    /// The square.
    Sqr,
    /// The square root.
    Sqrt,
    /// A whole power other than 1 and 2.
    Power(i32),
    /// A root of degree three or more; odd roots of negative numbers are negative.
    Root(i32),
    /// e to its power.
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
    /// A real power; the base is not negative.
    Pow,
    /// The smaller one.
    Min,
    /// The greater one.
    Max,
    /// The angle of the point (second, first) to the first axis.
    Atan2,
    /// The same for what wraps: around the negative axis it goes on beyond pi instead of being all angles.
    Bearing,
    /// The length of the hypotenuse.
    Hypot,
}

/// Questions about two numbers.
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
    /// The sum; nothing when an element has no value.
    Sum,
    /// The mean of the elements that have a value.
    Mean,
    /// The root of the sum of squares; nothing when an element has no value.
    Norm,
    /// The median of the elements that have a value; the mean of the middle two when their number is even.
    Median,
    /// The number of elements that have a value.
    Count,
    /// The hull of the elements that have a value; over plain numbers the only one that has, else nothing.
    Either,
}

/// A number in SI: the value to compute with over plain numbers, and the bounds to compute with over intervals.
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

    /// Some number between the bounds; its middle over plain numbers.
    #[must_use]
    pub fn between(bounds: Interval) -> Constant {
        Constant { value: bounds.midpoint(), bounds }
    }

    /// Whether its bounds are one number, or nearly: no wider than rounding makes them.
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

// Compared bit by bit, so that constants can be keys; what is numerically equal but written otherwise may differ.
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
