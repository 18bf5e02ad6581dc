//! Formulas compiled to one program, which is evaluated over numbers, over duals, and over many numbers at once.

use crate::Error;
use crate::dual::{Dual, WIDTH};
use crate::lanes::{LANES, Lanes};
use shsa_core::expression::{Assignment, Formula, Number, Program, Shape, State, Symbol, Value};
use shsa_core::time::Validity;

/// The arguments of a model's formulas: states, then control inputs, then `dt`.
#[derive(Clone, Copy)]
pub(crate) struct Arguments<'a> {
    /// One state vector, or many: element i of all of them in a row, before element i + 1.
    pub(crate) states: &'a [f64],
    /// The number of state vectors.
    pub(crate) many: usize,
    /// The length of a state vector.
    pub(crate) state_len: usize,
    /// The control inputs; absent ones are 0.
    pub(crate) controls: &'a [f64],
    pub(crate) control_count: usize,
    pub(crate) dt: f64,
}

impl<'a> Arguments<'a> {
    /// The number in a slot, of the state vector at a place.
    #[inline]
    fn get(&self, slot: usize, place: usize) -> f64 {
        match slot.checked_sub(self.state_len) {
            None => self.states.get(slot * self.many + place).copied().unwrap_or(f64::NAN),
            Some(control) => self.common(control),
        }
    }

    /// A control input or `dt`.
    #[inline]
    fn common(&self, control: usize) -> f64 {
        let is_control = control < self.control_count;
        if is_control { self.controls.get(control).copied().unwrap_or(0.0) } else { self.dt }
    }

    /// The numbers in a slot for the state vectors from a place on; missing beyond the last.
    #[inline]
    fn lanes(&self, slot: usize, place: usize) -> Lanes {
        if let Some(control) = slot.checked_sub(self.state_len) {
            return Lanes([self.common(control); LANES]);
        }
        let own = self.states.get(slot * self.many..(slot + 1) * self.many);
        let rest = own.and_then(|own| own.get(place..)).unwrap_or(&[]);
        if let Some(whole) = rest.first_chunk() {
            return Lanes(*whole);
        }
        let mut lanes = Lanes::MISSING;
        lanes.0.iter_mut().zip(rest).for_each(|(lane, number)| *lane = *number);
        lanes
    }
}

/// A program over states, controls and `dt`, with memory to run it.
#[derive(Clone, Debug)]
pub(crate) struct Compiled {
    program: Program,
    /// For each input, its place among states, controls and `dt`.
    slots: Vec<usize>,
    numbers: Run<f64>,
    duals: Run<Dual>,
    lanes: Run<Lanes>,
    /// The last results; empty at first.
    found: Vec<f64>,
    is_branch_free: bool,
}

/// The memory of evaluations over one kind of number.
#[derive(Clone, Debug)]
struct Run<N: 'static> {
    state: State<N>,
    inputs: Vec<Value<'static, N>>,
}

impl<N: Number + 'static> Run<N> {
    fn new(program: &Program) -> Run<N> {
        let inputs = vec![Value::Scalar(N::MISSING); program.inputs().len()];
        Run { state: program.new_state(0, 1.0), inputs }
    }

    #[inline]
    fn evaluate(&mut self, program: &Program) -> &[N] {
        let outcome = program.evaluate(&mut self.state, &self.inputs, Validity::always(), None);
        match outcome.value {
            Value::Vector(numbers) => numbers,
            Value::Scalar(_) => &[],
        }
    }
}

impl Compiled {
    /// Compiles formulas over `count` symbols of which the last is `dt`, to one vector.
    ///
    /// # Errors
    /// A formula that has a memory, is not a single number, or uses other symbols.
    pub(crate) fn new(what: &str, formulas: Vec<Formula>, count: usize) -> Result<Compiled, Error> {
        let wrong = |reason: &str| Error::Formula { what: what.to_owned(), reason: reason.to_owned() };
        let elapsed = Symbol(count as u32 - 1);
        let formulas: Vec<Formula> = formulas.into_iter().map(|it| it.with_elapsed(elapsed)).collect();
        if formulas.iter().any(|formula| formula.shape() != Shape::Scalar) {
            return Err(wrong("is not one number"));
        }
        if formulas.iter().any(Formula::is_stateful) {
            return Err(wrong("remembers earlier values: make what it remembers a state"));
        }
        let found = Vec::with_capacity(formulas.len());
        let list = Formula::list(formulas);
        let assignment = Assignment { symbol: Symbol(u32::MAX), formula: &list, condition: None };
        let program = Program::compile(&[assignment]).map_err(|problem| wrong(&problem.to_string()))?;
        let slots: Vec<usize> = program.inputs().iter().map(|input| input.symbol.0 as usize).collect();
        if slots.iter().any(|slot| *slot >= count) {
            return Err(wrong("uses what is neither state nor control input"));
        }
        Ok(Compiled {
            numbers: Run::new(&program),
            duals: Run::new(&program),
            lanes: Run::new(&program),
            is_branch_free: program.is_branch_free(),
            program,
            slots,
            found,
        })
    }

    /// The values for one state vector. Unchanged inputs are not evaluated again, as noise often depends on `dt` only.
    #[inline]
    pub(crate) fn evaluate(&mut self, arguments: Arguments<'_>) -> &[f64] {
        self.evaluate_at(arguments, 0)
    }

    fn evaluate_at(&mut self, arguments: Arguments<'_>, place: usize) -> &[f64] {
        let mut is_known = !self.found.is_empty();
        for (input, slot) in self.numbers.inputs.iter_mut().zip(&self.slots) {
            let number = arguments.get(*slot, place);
            is_known &= input.scalar().to_bits() == number.to_bits();
            *input = Value::Scalar(number);
        }
        if !is_known {
            let found = self.numbers.evaluate(&self.program);
            self.found.clear();
            self.found.extend_from_slice(found);
        }
        &self.found
    }

    /// The values for one state vector with their derivatives by the elements from `first` on, as many as a dual has directions.
    pub(crate) fn differentiate(&mut self, arguments: Arguments<'_>, first: usize) -> &[Dual] {
        for (input, slot) in self.duals.inputs.iter_mut().zip(&self.slots) {
            let direction = slot.checked_sub(first).filter(|_| *slot < arguments.state_len);
            let dual = Dual::variable(arguments.get(*slot, 0), direction.unwrap_or(WIDTH));
            *input = Value::Scalar(dual);
        }
        self.duals.evaluate(&self.program)
    }

    /// The values for many state vectors, in the same order; not-a-number for a missing value.
    pub(crate) fn evaluate_many(&mut self, arguments: Arguments<'_>, to: &mut [f64]) {
        to.fill(f64::NAN);
        if self.is_branch_free {
            (0..arguments.many).step_by(LANES).for_each(|place| self.evaluate_lanes(arguments, place, to));
            return;
        }
        for place in 0..arguments.many {
            let found = self.evaluate_at(arguments, place);
            for (own, number) in to.chunks_mut(arguments.many).zip(found) {
                own.iter_mut().skip(place).take(1).for_each(|own| *own = *number);
            }
        }
    }

    fn evaluate_lanes(&mut self, arguments: Arguments<'_>, place: usize, to: &mut [f64]) {
        for (input, slot) in self.lanes.inputs.iter_mut().zip(&self.slots) {
            *input = Value::Scalar(arguments.lanes(*slot, place));
        }
        let found = self.lanes.evaluate(&self.program);
        for (own, lanes) in to.chunks_mut(arguments.many).zip(found) {
            let rest = own.get_mut(place..).unwrap_or(&mut []);
            rest.iter_mut().zip(lanes.0).for_each(|(own, lane)| *own = lane);
        }
    }
}
