//! The memory and the registers of programs, and the operations that need them.

use super::extremes::Workspace;
use super::history::{History, Recalled};
use super::number::Number;
use super::operation::{Binary, Constant, Operation, Reduction, Unary};
use super::presence::Presences;
use super::program::{Examined, Program, Register};
use super::registers::{Vectors, get, set};
use super::tape::Origin;
use crate::interval::Truth;
use crate::time::{Time, Validity};
use alloc::vec::Vec;

/// The memory and the registers of a program; made by [`Program::new_state`].
#[derive(Clone, Debug)]
pub struct State<N> {
    pub(super) scalars: Vec<N>,
    pub(super) truths: Vec<Truth>,
    pub(super) vectors: Vectors<N>,
    pub(super) histories: Vec<History<N>>,
    /// Working memory for medians: two numbers per element.
    pub(super) scratch: Vec<f64>,
    pub(super) max_vector_len: usize,
    pub(super) last: Option<Validity>,
    /// What may have no value; empty where it does not matter.
    pub(super) presences: Presences,
    pub(super) workspace: Workspace,
}

impl<N> State<N> {
    /// Makes room for vectors of this length, and keeps the contents. Allocates only when they are longer than all before, for
    /// the next power of two then.
    pub fn make_room(&mut self, vector_len: usize)
    where
        N: Number,
    {
        if vector_len > self.max_vector_len {
            self.max_vector_len = vector_len.checked_next_power_of_two().unwrap_or(vector_len);
            self.vectors.widen(self.max_vector_len);
            self.scratch.resize(self.vectors.stride.saturating_mul(2), 0.0);
            self.presences.widen(self.vectors.stride, self.vectors.lengths.len());
        }
    }

    /// Forgets all earlier evaluations, like a new state.
    pub fn reset(&mut self, program: &Program)
    where
        N: Number,
    {
        self.last = None;
        self.presences.clear();
        for history in &mut self.histories {
            history.clear();
        }
        for retained in &program.retained {
            match retained.kept {
                Register::Scalar(place) => set(&mut self.scalars, place, N::MISSING),
                Register::Vector(place) => self.vectors.set_length(place, 0),
                Register::Truth(_) => {}
            }
        }
    }
}

/// The times of an evaluation.
#[derive(Clone, Copy)]
pub(super) struct Moment {
    pub(super) at: Validity,
    pub(super) is_new: bool,
    pub(super) since: Time,
}

impl<N: Number> State<N> {
    pub(super) fn scalar(&self, register: Register) -> N {
        match register {
            Register::Scalar(place) => get(&self.scalars, place, N::MISSING),
            _ => N::MISSING,
        }
    }

    pub(super) fn truth(&self, register: Register) -> Truth {
        match register {
            Register::Truth(place) => get(&self.truths, place, Truth::Unknown),
            _ => Truth::Unknown,
        }
    }

    pub(super) fn vector(&self, register: Register) -> &[N] {
        match register {
            Register::Vector(place) => self.vectors.get(place),
            _ => &[],
        }
    }

    pub(super) fn copy(&mut self, from: Register, to: Register) {
        match (from, to) {
            (Register::Scalar(_), Register::Scalar(place)) => {
                let number = self.scalar(from);
                set(&mut self.scalars, place, number);
            }
            (Register::Vector(from), Register::Vector(to)) => self.vectors.copy(from, to),
            _ => {}
        }
    }

    pub(super) fn truth_of(&self, operation: Operation, first: Register, second: Register) -> Truth {
        match operation {
            Operation::Compare(comparison) => self.scalar(first).compare(comparison, self.scalar(second)),
            Operation::And => self.truth(first).and(self.truth(second)),
            Operation::Or => self.truth(first).or(self.truth(second)),
            Operation::Not => !self.truth(first),
            _ => Truth::Unknown,
        }
    }

    pub(super) fn select(&self, condition: Register, then: Register, other: Register) -> N {
        match self.truth(condition) {
            Truth::True => self.scalar(then),
            Truth::False => self.scalar(other),
            Truth::Unknown => self.scalar(then).hull(self.scalar(other)),
        }
    }

    /// The element at an index, rounded down; for an interval of indices the hull of the possible elements.
    pub(super) fn element(&self, vector: Register, index: Register) -> N {
        let (vector, index) = (self.vector(vector), self.scalar(index).bounds());
        if index.is_empty() || index.hi() < 0.0 {
            return N::MISSING;
        }
        let (first, last) = (libm::floor(index.lo()), libm::floor(index.hi()));
        if first < 0.0 || last >= vector.len() as f64 {
            return N::MISSING;
        }
        let elements = vector.get(first as usize..=last as usize).unwrap_or(&[]).iter().copied();
        elements.reduce(N::hull).unwrap_or(N::MISSING)
    }

    /// The result of an operation that keeps samples. Without one of the guards, its argument has no value.
    pub(super) fn recall(
        &mut self,
        argument: Register,
        memory: Register,
        guards: &[Register],
        moment: &mut Moment,
    ) -> N {
        let Register::Scalar(memory) = memory else { return N::MISSING };
        let is_there = guards.iter().all(|guard| self.truth(*guard).is_true());
        let value = if is_there { self.scalar(argument).admitted() } else { N::MISSING };
        let Some(history) = self.histories.get_mut(memory as usize) else { return N::MISSING };
        let Recalled { value, since } = history.recall(value, is_there, moment.at, moment.is_new);
        moment.since = since.unwrap_or(moment.since).min(moment.since);
        value
    }

    /// Narrows the value of an examined formula.
    pub(super) fn examine(&mut self, examined: &Examined) {
        let Examined { tape, result, .. } = examined;
        let State { scalars, workspace, .. } = self;
        let leaves = tape.leaves().iter().map(|leaf| match leaf.origin {
            Origin::Register(place) => get(scalars, place, N::MISSING).bounds(),
            Origin::Bounds(bounds) => bounds,
        });
        let natural = get(scalars, *result, N::MISSING);
        let bounds = workspace.enclose(tape, natural.bounds(), leaves);
        set(scalars, *result, natural.within(bounds));
    }

    pub(super) fn reduce(&mut self, reduction: Reduction, vector: Register) -> N {
        let Register::Vector(place) = vector else { return N::MISSING };
        let numbers = self.vectors.get(place);
        if numbers.is_empty() {
            return N::MISSING;
        }
        let present = numbers.iter().copied().filter(|number| !number.is_missing());
        let folded = |binary| {
            present.clone().reduce(|left: N, right| left.binary(binary, right)).unwrap_or(N::MISSING)
        };
        let all = |numbers: &[N], of: fn(N) -> N| {
            numbers.iter().map(|number| of(*number)).reduce(plus).unwrap_or(N::MISSING)
        };
        match reduction {
            Reduction::Min => folded(Binary::Min),
            Reduction::Max => folded(Binary::Max),
            Reduction::Sum => all(numbers, |number| number),
            Reduction::Norm => all(numbers, |number| number.unary(Unary::Sqr)).unary(Unary::Sqrt),
            Reduction::Mean => folded(Binary::Add).binary(Binary::Div, whole(present.clone().count())),
            Reduction::Count => whole(present.clone().count()),
            Reduction::Median => N::median(present, &mut self.scratch),
            Reduction::Either | Reduction::OneOf => N::either_of(present),
        }
    }
}

fn plus<N: Number>(left: N, right: N) -> N {
    left.binary(Binary::Add, right)
}

fn whole<N: Number>(count: usize) -> N {
    N::constant(Constant::exact(count as f64))
}
