//! A flat program over registers, compiled from formulas and evaluated repeatedly.

use alloc::vec::Vec;

use super::Symbol;
use super::curve::{Curve, Point};
use super::formula::Formula;
use super::operation::{Constant, Operation, Reduction};
use super::tape::Tape;
use crate::interval::Course;
use crate::time::Span;

/// The largest program in operations.
pub const MAX_INSTRUCTIONS: usize = 50_000;

/// A variable that a program computes.
#[derive(Clone, Copy, Debug)]
pub struct Assignment<'a> {
    /// The variable.
    pub symbol: Symbol,
    /// The formula of its value, which may use the variables assigned before.
    pub formula: &'a Formula,
    /// The condition that must certainly be true for the program to have an output; it may use this variable and those before.
    pub condition: Option<&'a Formula>,
}

/// An input of a program, for every evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// The variable.
    pub symbol: Symbol,
    /// Which value of the variable.
    pub kind: InputKind,
}

/// Which value of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InputKind {
    /// The present value.
    Current,
    /// The last trusted value: the program computes the variable and uses its `previous(..)` value, which need not be the one
    /// that the program computed itself.
    Previous,
}

/// A register of one of the three kinds, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Register {
    Scalar(u32),
    Vector(u32),
    Truth(u32),
}

/// One operation on registers; unused arguments are `NONE`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instruction {
    pub(super) operation: Operation,
    pub(super) arguments: [Register; 3],
    pub(super) result: Register,
}

/// A value that the next evaluation uses as the previous one. It is stored apart from its register of use, so that an evaluation
/// can return it and a late evaluation does not change it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Retained {
    pub(super) current: Register,
    pub(super) kept: Register,
    pub(super) seen: Register,
}

/// A formula whose value interval arithmetic may overestimate.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Examined {
    pub(super) tape: Tape,
    /// After how many instructions its value is known, and the scalar register that holds it.
    pub(super) after: usize,
    pub(super) result: u32,
}

/// An operation that keeps samples of its argument, and what bounds the argument between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Remembered {
    pub(super) operation: Operation,
    pub(super) course: Course,
    /// Where the conditions stand without which the argument has no value, from the first to before the second of these places.
    pub(super) guards: (u32, u32),
}

pub(super) const NONE: Register = Register::Scalar(u32::MAX);

/// Compiled assignments; independent of the kind of number.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub(super) inputs: Vec<Input>,
    /// The registers of the inputs, in the same order.
    pub(super) input_registers: Vec<Register>,
    pub(super) constants: Vec<(u32, Constant)>,
    pub(super) truths: Vec<(u32, bool)>,
    pub(super) instructions: Vec<Instruction>,
    /// The elements of `List` instructions.
    pub(super) listed: Vec<Register>,
    /// The points of `Table` instructions.
    pub(super) points: Vec<Point>,
    /// The values to keep for the next evaluation.
    pub(super) retained: Vec<Retained>,
    /// The operations that keep samples of their argument; instructions name them by their place here.
    pub(super) memories: Vec<Remembered>,
    /// The conditions on which the arguments of these operations depend.
    pub(super) guards: Vec<Register>,
    pub(super) elapsed: Option<u32>,
    pub(super) conditions: Vec<Register>,
    pub(super) output: Register,
    /// The number of registers of each kind.
    pub(super) scalar_count: u32,
    pub(super) vector_count: u32,
    pub(super) truth_count: u32,
    pub(super) longest_list: usize,
    /// In the order of computation.
    pub(super) examined: Vec<Examined>,
    /// Whether a function passes over arguments that may have no value.
    pub(super) is_weighed: bool,
}

impl Program {
    /// The inputs of every evaluation, in this order.
    #[must_use]
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// Whether another program computes the same after `rename` gives its inputs other symbols: then both programs can use the
    /// same state. Time: linear in the programs.
    #[must_use]
    pub fn is_renamed(&self, other: &Program, rename: impl Fn(Symbol) -> Option<Symbol>) -> bool {
        let renamed = |input: &Input| rename(input.symbol).map(|symbol| Input { symbol, ..*input });
        let is_same = |(own, input): (&Input, &Input)| renamed(input) == Some(*own);
        self.inputs.len() == other.inputs.len()
            && self.inputs.iter().zip(&other.inputs).all(is_same)
            && *self == Program { inputs: self.inputs.clone(), ..other.clone() }
    }

    /// The number of operations of an evaluation; each takes bounded time per element of the longest vector.
    #[must_use]
    pub fn len(&self) -> usize {
        self.instructions.len()
    }

    /// Whether the program only passes on an input or a constant.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.instructions.is_empty()
    }

    /// Whether an evaluation depends on earlier ones.
    #[must_use]
    pub fn is_stateful(&self) -> bool {
        !self.retained.is_empty() || !self.memories.is_empty() || self.elapsed.is_some()
    }

    /// Whether the operations do not depend on the inputs: there is no condition, no choice between values, and no omission of
    /// missing elements. Then many inputs may be evaluated at once.
    #[must_use]
    pub fn is_branch_free(&self) -> bool {
        let is_plain = |instruction: &Instruction| match instruction.operation {
            Operation::Unary(_) | Operation::Binary(_) | Operation::Within(_) | Operation::Table => true,
            Operation::List | Operation::Slice(..) => true,
            Operation::Reduce(reduction) => matches!(reduction, Reduction::Sum | Reduction::Norm),
            _ => false,
        };
        self.conditions.is_empty() && self.instructions.iter().all(is_plain)
    }

    /// Whether the program contains a `derivative`: its output is a rate.
    #[must_use]
    pub fn is_rate(&self) -> bool {
        self.memories.iter().any(|memory| matches!(memory.operation, Operation::Derivative(_)))
    }

    /// The longest window of a `derivative` or `moving_mean` in the program; zero without one.
    #[must_use]
    pub fn longest_window(&self) -> Span {
        let windows = self.memories.iter().map(|memory| match memory.operation {
            Operation::Derivative(window) | Operation::MovingMean(window) => window,
            _ => Span::ZERO,
        });
        windows.max().unwrap_or(Span::ZERO)
    }

    /// How far back the time operators look at most: one may take the result of another, so their spans are added. Integrals,
    /// which never forget, do not count.
    #[must_use]
    pub fn looks_back(&self) -> Span {
        let spans = self.memories.iter().map(|memory| match memory.operation {
            Operation::Derivative(span) | Operation::Delay(span) | Operation::MovingMean(span) => span,
            Operation::Held(span) | Operation::Answered(span) => span,
            _ => Span::ZERO,
        });
        spans.fold(Span::ZERO, |sum, span| sum + span)
    }

    /// The conditions without which the argument of an operation that keeps samples has no value.
    pub(super) fn guards(&self, memory: Register) -> &[Register] {
        let Register::Scalar(place) = memory else { return &[] };
        let (first, end) = self.memories.get(place as usize).map_or((0, 0), |memory| memory.guards);
        self.guards.get(first as usize..end as usize).unwrap_or(&[])
    }

    /// The curve of a table, by the registers that hold the place of its first point and their number.
    pub(super) fn curve(&self, first: Register, count: Register) -> Curve<'_> {
        let (Register::Scalar(first), Register::Scalar(count)) = (first, count) else {
            return Curve::new(&[]);
        };
        Curve::new(self.points.get(first as usize..first.saturating_add(count) as usize).unwrap_or(&[]))
    }

    /// Whether an input is the last trusted value of a variable, so that `dt` is the age of that value.
    pub(super) fn takes_previous(&self) -> bool {
        self.inputs.iter().any(|input| input.kind == InputKind::Previous)
    }
}
