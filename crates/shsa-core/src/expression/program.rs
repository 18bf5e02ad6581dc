//! A flat program over registers: what formulas are compiled to, and what is evaluated again and again.

use alloc::vec::Vec;

use super::Symbol;
use super::formula::Formula;
use super::operation::{Constant, Operation, Reduction};
use crate::time::Span;

/// The largest program in operations.
pub const MAX_INSTRUCTIONS: usize = 50_000;

/// A variable that a program computes.
#[derive(Clone, Copy, Debug)]
pub struct Assignment<'a> {
    /// The variable.
    pub symbol: Symbol,
    /// What it is computed by; it may use the variables assigned before.
    pub formula: &'a Formula,
    /// What must certainly be true for the program to give anything; it may use this variable and those before.
    pub condition: Option<&'a Formula>,
}

/// What a program must be given for every evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// The variable.
    pub symbol: Symbol,
    /// Which of its values.
    pub kind: InputKind,
}

/// Which value of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InputKind {
    /// Its present value.
    Current,
    /// Its last trusted value: the program computes the variable and refers to its `previous(..)` value, which need
    /// not be the one that the program has computed itself.
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

/// A value that the next evaluation sees as the previous one. It is kept apart from where it is seen, so that an
/// evaluation can give it out, and one that comes late does not change it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Retained {
    pub(super) current: Register,
    pub(super) kept: Register,
    pub(super) seen: Register,
}

pub(super) const NONE: Register = Register::Scalar(u32::MAX);

/// Assignments compiled for evaluation; independent of the kind of number.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub(super) inputs: Vec<Input>,
    /// Where the inputs go, in the same order.
    pub(super) input_registers: Vec<Register>,
    pub(super) constants: Vec<(u32, Constant)>,
    pub(super) truths: Vec<(u32, bool)>,
    pub(super) instructions: Vec<Instruction>,
    /// The elements of `List` instructions.
    pub(super) listed: Vec<Register>,
    /// The values to keep for the next evaluation.
    pub(super) retained: Vec<Retained>,
    /// The operations that keep samples of their argument; instructions name them by their place here.
    pub(super) memories: Vec<Operation>,
    pub(super) elapsed: Option<u32>,
    pub(super) conditions: Vec<Register>,
    pub(super) output: Register,
    /// How many registers of each kind there are.
    pub(super) scalar_count: u32,
    pub(super) vector_count: u32,
    pub(super) truth_count: u32,
    pub(super) longest_list: usize,
}

impl Program {
    /// What every evaluation must be given, in this order.
    #[must_use]
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// Whether another program computes the same from inputs that `rename` gives other symbols: then a state of that
    /// one is a state of this one. Time: linear in the programs.
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

    /// Whether it only passes an input or a constant on.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.instructions.is_empty()
    }

    /// Whether an evaluation depends on those before it.
    #[must_use]
    pub fn is_stateful(&self) -> bool {
        !self.retained.is_empty() || !self.memories.is_empty() || self.elapsed.is_some()
    }

    /// Whether it does the same operations whatever its inputs are: no condition, no choice between values, nothing left
    /// out of a vector because it is missing. Then it may be evaluated for many inputs at once.
    #[must_use]
    pub fn is_branch_free(&self) -> bool {
        let is_plain = |instruction: &Instruction| match instruction.operation {
            Operation::Unary(_) | Operation::Binary(_) | Operation::Within(_) => true,
            Operation::List | Operation::Slice(..) => true,
            Operation::Reduce(reduction) => matches!(reduction, Reduction::Sum | Reduction::Norm),
            _ => false,
        };
        self.conditions.is_empty() && self.instructions.iter().all(is_plain)
    }

    /// Whether a `derivative` is in it: the output tells how something changes.
    #[must_use]
    pub fn is_rate(&self) -> bool {
        self.memories.iter().any(|operation| matches!(operation, Operation::Derivative(_)))
    }

    /// The longest stretch of time that a `derivative` or a `moving_mean` in it is the mean over; zero without one.
    #[must_use]
    pub fn longest_window(&self) -> Span {
        let windows = self.memories.iter().map(|operation| match operation {
            Operation::Derivative(window) | Operation::MovingMean(window) => *window,
            _ => Span::ZERO,
        });
        windows.max().unwrap_or(Span::ZERO)
    }

    /// How far back its time operators look at most; integrals, which never forget, are not counted.
    #[must_use]
    pub fn looks_back(&self) -> Span {
        let spans = self.memories.iter().map(|operation| match operation {
            Operation::Derivative(span) | Operation::Delay(span) | Operation::MovingMean(span) => *span,
            _ => Span::ZERO,
        });
        spans.max().unwrap_or(Span::ZERO)
    }

    /// Whether it is given the last trusted value of a variable, so that `dt` is the age of that value.
    pub(super) fn takes_previous(&self) -> bool {
        self.inputs.iter().any(|input| input.kind == InputKind::Previous)
    }
}
