//! Evaluates programs without allocation, in a time bounded by the program's size and the longest vector.

use alloc::vec;
use alloc::vec::Vec;

use super::history::{History, Recalled, elapsed, middle};
use super::number::Number;
use super::operation::{Binary, Operation, Reduction, Unary};
use super::program::{Instruction, Program, Register};
use super::registers::{Operand, Vectors, each, each_two, get, set};
use crate::interval::Truth;
use crate::time::{Time, Validity};

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

/// The memory and the registers of a program; made by [`Program::new_state`].
#[derive(Clone, Debug)]
pub struct State<N> {
    scalars: Vec<N>,
    truths: Vec<Truth>,
    vectors: Vectors<N>,
    histories: Vec<History<N>>,
    /// Working memory for medians: two numbers per element.
    scratch: Vec<f64>,
    max_vector_len: usize,
    last: Option<Validity>,
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
        }
    }

    /// Forgets all earlier evaluations, like a new state.
    pub fn reset(&mut self, program: &Program)
    where
        N: Number,
    {
        self.last = None;
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
struct Moment {
    at: Validity,
    is_new: bool,
    since: Time,
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
            histories: self.memories.iter().map(|operation| History::new(*operation, max_rate)).collect(),
            scratch: vec![0.0; stride.saturating_mul(2)],
            max_vector_len,
            last: None,
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
        for instruction in &self.instructions {
            self.execute(state, instruction, &mut moment);
        }
        if is_new {
            self.retained.iter().for_each(|retained| state.copy(retained.current, retained.kept));
            state.last = Some(at);
        }
        let is_allowed = self.conditions.iter().all(|condition| match condition {
            Register::Truth(place) => get(&state.truths, *place, Truth::Unknown).is_true(),
            _ => false,
        });
        let valid = Validity { from: moment.since.min(at.from), to: at.to };
        Outcome { value: self.output(state, is_allowed), valid }
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
                let number = state.recall(first, second, moment);
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

impl<N: Number> State<N> {
    fn scalar(&self, register: Register) -> N {
        match register {
            Register::Scalar(place) => get(&self.scalars, place, N::MISSING),
            _ => N::MISSING,
        }
    }

    fn truth(&self, register: Register) -> Truth {
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

    fn copy(&mut self, from: Register, to: Register) {
        match (from, to) {
            (Register::Scalar(_), Register::Scalar(place)) => {
                let number = self.scalar(from);
                set(&mut self.scalars, place, number);
            }
            (Register::Vector(from), Register::Vector(to)) => self.vectors.copy(from, to),
            _ => {}
        }
    }

    fn truth_of(&self, operation: Operation, first: Register, second: Register) -> Truth {
        match operation {
            Operation::Compare(comparison) => self.scalar(first).compare(comparison, self.scalar(second)),
            Operation::And => self.truth(first).and(self.truth(second)),
            Operation::Or => self.truth(first).or(self.truth(second)),
            Operation::Not => !self.truth(first),
            _ => Truth::Unknown,
        }
    }

    fn select(&self, condition: Register, then: Register, other: Register) -> N {
        match self.truth(condition) {
            Truth::True => self.scalar(then),
            Truth::False => self.scalar(other),
            Truth::Unknown => self.scalar(then).hull(self.scalar(other)),
        }
    }

    /// The element at an index, rounded down; for an interval of indices the hull of the possible elements.
    fn element(&self, vector: Register, index: Register) -> N {
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

    fn recall(&mut self, argument: Register, memory: Register, moment: &mut Moment) -> N {
        let (value, Register::Scalar(memory)) = (self.scalar(argument).admitted(), memory) else {
            return N::MISSING;
        };
        let Some(history) = self.histories.get_mut(memory as usize) else { return N::MISSING };
        let Recalled { value, since } = history.recall(value, moment.at, moment.is_new);
        moment.since = since.unwrap_or(moment.since).min(moment.since);
        value
    }

    fn reduce(&mut self, reduction: Reduction, vector: Register) -> N {
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
    N::constant(super::operation::Constant::exact(count as f64))
}
