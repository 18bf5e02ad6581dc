//! Evaluates programs without allocation, in a time bounded by the program's size and the longest vector.

use alloc::vec;
use core::ops::Range;

use super::extremes::Workspace;
use super::history::{History, elapsed, middle};
use super::number::Number;
use super::operation::Operation;
use super::presence::Presences;
use super::program::{Instruction, Program, Register};
use super::registers::{Operand, Vectors, each, each_two, get, set};
use super::state::{Moment, State};
use crate::interval::Truth;
use crate::time::Validity;

/// An input or output of a program. A vector without elements counts as missing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a, N> {
    /// One number, or `MISSING`.
    Scalar(N),
    /// Several numbers.
    Vector(&'a [N]),
}

impl<N: Number> Value<'_, N> {
    /// Whether the value is missing.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        match self {
            Value::Scalar(number) => number.is_missing(),
            Value::Vector(numbers) => numbers.is_empty(),
        }
    }

    /// The number; missing for a vector.
    #[must_use]
    pub fn scalar(&self) -> N {
        match self {
            Value::Scalar(number) => *number,
            Value::Vector(_) => N::MISSING,
        }
    }
}

/// The result of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome<'a, N> {
    /// The output; missing when an input of it is missing or a condition is not certainly true.
    pub value: Value<'a, N>,
    /// The validity of the output: the time of the evaluation, back to the oldest sample of a `derivative` or the begin of a
    /// `moving_mean`.
    pub valid: Validity,
}

impl Program {
    /// A new state, allocated once: for vectors of up to `max_vector_len` elements (longer ones count as missing) and up to
    /// `max_rate` evaluations a second (of more, the time operators skip some).
    #[must_use]
    pub fn new_state<N: Number>(&self, max_vector_len: usize, max_rate: f64) -> State<N> {
        let stride = if self.vector_count > 0 { max_vector_len.max(self.longest_list) } else { 0 };
        let vectors = Vectors {
            elements: vec![N::MISSING; stride.saturating_mul(self.vector_count as usize)],
            lengths: vec![0; self.vector_count as usize],
            stride,
        };
        let mut state = State {
            scalars: vec![N::MISSING; self.scalar_count as usize],
            truths: vec![Truth::Unknown; self.truth_count as usize],
            vectors,
            histories: self.memories.iter().map(|memory| History::new(*memory, max_rate)).collect(),
            scratch: vec![0.0; stride.saturating_mul(2)],
            max_vector_len,
            last: None,
            presences: if N::IS_INTERVAL { Presences::new(self, stride) } else { Presences::default() },
            workspace: if N::IS_INTERVAL {
                Workspace::new(self.examined.iter().map(|examined| &examined.tape))
            } else {
                Workspace::default()
            },
        };
        for (place, constant) in &self.constants {
            set(&mut state.scalars, *place, N::constant(*constant));
        }
        for (place, truth) in &self.truths {
            set(&mut state.truths, *place, Truth::from(*truth));
        }
        state
    }

    /// Evaluates the program on its inputs (see [`Program::inputs`]) at a time; an input that is not given, or has another shape,
    /// counts as missing.
    ///
    /// `previous_at` is when the inputs of kind `Previous` were valid: `dt` is then their age. In a program without such inputs,
    /// `dt` is the time since its last evaluation. A `dt` that is not positive is missing. An evaluation at the time of the last
    /// one, or before it (by the middles of the validities), changes no memory.
    ///
    /// Time: bounded by the number of operations times the longest vector (medians: times its logarithm); time operators read at
    /// most 2048 samples each. Allocates nothing.
    pub fn evaluate<'s, N: Number>(
        &self,
        state: &'s mut State<N>,
        inputs: &[Value<'_, N>],
        at: Validity,
        previous_at: Option<Validity>,
    ) -> Outcome<'s, N> {
        let is_new = state.last.is_none_or(|last| middle(last) < middle(at));
        let mut moment = Moment { at, is_new, since: at.from };
        self.retained.iter().for_each(|retained| state.copy(retained.kept, retained.seen));
        self.load(state, inputs);
        let since = if self.takes_previous() { previous_at } else { state.last };
        self.load_elapsed(state, since, at);
        self.run(state, &mut moment);
        if is_new {
            self.retained.iter().for_each(|retained| state.copy(retained.current, retained.kept));
            state.last = Some(at);
        }
        let has_output = !self.is_weighed || !N::IS_INTERVAL || state.has_output(self.output);
        let is_allowed = has_output
            && self.conditions.iter().all(|condition| match condition {
                Register::Truth(place) => get(&state.truths, *place, Truth::Unknown).is_true(),
                _ => false,
            });
        let valid = Validity { from: moment.since.min(at.from), to: at.to };
        Outcome { value: self.output(state, is_allowed), valid }
    }

    /// Executes all instructions; examines the formulas that are to be examined as soon as their values are known.
    fn run<N: Number>(&self, state: &mut State<N>, moment: &mut Moment) {
        let mut done = 0;
        if N::IS_INTERVAL {
            for examined in &self.examined {
                self.execute_all(state, done..examined.after, moment);
                state.examine(examined);
                done = examined.after;
            }
        }
        self.execute_all(state, done..self.instructions.len(), moment);
    }

    fn execute_all<N: Number>(&self, state: &mut State<N>, range: Range<usize>, moment: &mut Moment) {
        let instructions = self.instructions.get(range).unwrap_or(&[]);
        if N::IS_INTERVAL && self.is_weighed {
            for instruction in instructions {
                let hidden = state.hide(instruction);
                self.execute(state, instruction, moment);
                state.show(instruction, hidden);
                state.weigh(self, instruction, moment);
            }
            return;
        }
        for instruction in instructions {
            self.execute(state, instruction, moment);
        }
    }

    fn load<N: Number>(&self, state: &mut State<N>, inputs: &[Value<'_, N>]) {
        for (place, register) in self.input_registers.iter().enumerate() {
            match (register, inputs.get(place)) {
                (Register::Scalar(to), Some(Value::Scalar(number))) => {
                    set(&mut state.scalars, *to, number.admitted())
                }
                (Register::Scalar(to), _) => set(&mut state.scalars, *to, N::MISSING),
                (Register::Vector(to), Some(Value::Vector(numbers)))
                    if numbers.len() <= state.max_vector_len =>
                {
                    state.vectors.fill(*to, numbers.iter().map(|number| number.admitted()));
                }
                (Register::Vector(to), _) => state.vectors.set_length(*to, 0),
                (Register::Truth(_), _) => {}
            }
        }
    }

    fn load_elapsed<N: Number>(&self, state: &mut State<N>, since: Option<Validity>, at: Validity) {
        let Some(place) = self.elapsed else { return };
        let constant = since.map(|since| elapsed(since, at)).filter(|elapsed| elapsed.value > 0.0);
        set(&mut state.scalars, place, constant.map_or(N::MISSING, N::constant));
    }

    fn output<'s, N: Number>(&self, state: &'s mut State<N>, is_allowed: bool) -> Value<'s, N> {
        match self.output {
            Register::Vector(place) if is_allowed => Value::Vector(state.vectors.get(place)),
            Register::Vector(_) => Value::Vector(&[]),
            Register::Scalar(place) if is_allowed => {
                Value::Scalar(get(&state.scalars, place, N::MISSING).admitted())
            }
            _ => Value::Scalar(N::MISSING),
        }
    }

    fn execute<N: Number>(&self, state: &mut State<N>, instruction: &Instruction, moment: &mut Moment) {
        let [first, second, third] = instruction.arguments;
        match (instruction.operation, instruction.result) {
            (Operation::Unary(unary), Register::Scalar(to)) => {
                let number = state.scalar(first).unary(unary);
                set(&mut state.scalars, to, number);
            }
            (Operation::Binary(binary), Register::Scalar(to)) => {
                let number = state.scalar(first).binary(binary, state.scalar(second));
                set(&mut state.scalars, to, number);
            }
            (Operation::Within(constant), Register::Scalar(to)) => {
                let number = state.scalar(first).within(constant.bounds);
                set(&mut state.scalars, to, number);
            }
            (Operation::Table, Register::Scalar(to)) => {
                let number = state.scalar(first).along(self.curve(second, third));
                set(&mut state.scalars, to, number);
            }
            (Operation::Select, Register::Scalar(to)) => {
                let number = state.select(first, second, third);
                set(&mut state.scalars, to, number);
            }
            (Operation::Reduce(reduction), Register::Scalar(to)) => {
                let number = state.reduce(reduction, first);
                set(&mut state.scalars, to, number);
            }
            (Operation::Index, Register::Scalar(to)) => {
                let number = state.element(first, second);
                set(&mut state.scalars, to, number);
            }
            (operation, Register::Scalar(to)) if operation.recalls() => {
                let number = state.recall(first, second, self.guards(second), moment);
                set(&mut state.scalars, to, number);
            }
            (operation, Register::Truth(to)) => {
                let truth = state.truth_of(operation, first, second);
                set(&mut state.truths, to, truth);
            }
            (operation, Register::Vector(to)) => {
                self.execute_vector(state, operation, instruction.arguments, to);
            }
            _ => {}
        }
    }

    fn execute_vector<N: Number>(
        &self,
        state: &mut State<N>,
        operation: Operation,
        [first, second, third]: [Register; 3],
        to: u32,
    ) {
        let State { scalars, vectors, .. } = state;
        vectors.compute(to, |below, own| match operation {
            Operation::Unary(unary) => each(own, below.operand(first, scalars), |number| number.unary(unary)),
            Operation::Table => {
                let curve = self.curve(second, third);
                each(own, below.operand(first, scalars), |number| number.along(curve))
            }
            Operation::Within(constant) => {
                each(own, below.operand(first, scalars), |number| number.within(constant.bounds))
            }
            Operation::Binary(binary) => {
                each_two(own, below.operand(first, scalars), below.operand(second, scalars), binary)
            }
            Operation::Slice(from, to) => {
                let Register::Vector(place) = first else { return 0 };
                let vector = below.get(place);
                let to = if to == u32::MAX { vector.len() } else { to as usize };
                each(own, Operand::Vector(vector.get(from as usize..to).unwrap_or(&[])), |number| number)
            }
            Operation::List => {
                let (Register::Scalar(start), Register::Scalar(count)) = (first, second) else { return 0 };
                let listed = self.listed.get(start as usize..start as usize + count as usize).unwrap_or(&[]);
                for (element, register) in own.iter_mut().zip(listed) {
                    *element = below.operand(*register, scalars).at(0);
                }
                listed.len()
            }
            _ => 0,
        });
    }
}
