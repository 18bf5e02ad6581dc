//! The values of which the output of a program is one.

use super::number::Number;
use super::operation::{Operation, Reduction};
use super::program::Program;
use super::state::State;

impl Program {
    /// The values of which the output is one, as of the last evaluation: those of `one_of` and of several inverses, some of which may
    /// be missing. Empty where the output is one value.
    #[must_use]
    pub fn alternatives<'s, N: Number>(&self, state: &'s State<N>) -> &'s [N] {
        let last = self.instructions.iter().rev().find(|instruction| instruction.result == self.output);
        match last.map(|last| (last.operation, last.arguments)) {
            Some((Operation::Reduce(Reduction::OneOf | Reduction::Either), [list, ..])) => state.vector(list),
            _ => &[],
        }
    }
}
