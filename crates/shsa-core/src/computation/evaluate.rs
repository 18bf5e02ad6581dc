//! Evaluates a computation: at a moment, over certain bounds, over chosen observations, or elsewhere as a task.

use super::input::{Input, Source, bring_back};
use super::{Body, Compiled, Computation, Computed, Item, Settled, Task};
use crate::alignment::{Known, Port, Sample};
use crate::expression::{Outcome, State, Value};
use crate::interval::Interval;
use crate::knowledge::{IdVec, Shape, SignalId};
use crate::time::Validity;
use alloc::vec::Vec;

/// More inputs than this need memory that is allocated for the evaluation.
const USUAL_INPUTS: usize = 16;

/// Why an input has no value.
enum Missing {
    /// The value of this input at the moment is not known yet.
    Later(SignalId),
    /// The input has no value.
    Never,
}

impl Compiled {
    /// Evaluates over the values that `find` gives for each input, by its place among the inputs.
    ///
    /// Allocates nothing for up to 16 inputs whose vectors are no longer than before.
    #[inline]
    fn over<'a>(
        &'a mut self,
        moment: Validity,
        last: Option<Validity>,
        find: impl Fn(usize, &Source) -> Result<Value<'a, Interval>, Missing>,
    ) -> Result<Outcome<'a, Interval>, Missing> {
        let Compiled { program, state, inputs, wrapping } = self;
        let mut usual = [Value::Scalar(Interval::EMPTY); USUAL_INPUTS];
        let mut many = Vec::new();
        let values = match usual.get_mut(..inputs.len()) {
            Some(values) => values,
            None => {
                many.resize(inputs.len(), Value::Scalar(Interval::EMPTY));
                many.as_mut_slice()
            }
        };
        for (at, (value, input)) in values.iter_mut().zip(inputs.iter()).enumerate() {
            *value = find(at, input)?;
        }
        if !bring_back(values, wrapping) {
            return Err(Missing::Never);
        }
        make_room(state, values);
        Ok(program.evaluate(state, values, moment, last))
    }
}

impl Computation {
    /// Evaluates at a moment; `None` when an input is missing there or the result has no value.
    ///
    /// `last` is the last value of the computed variable. No allocation for up to 16 inputs whose vectors are no longer than
    /// before.
    pub fn evaluate<'a>(
        &'a mut self,
        ports: &'a IdVec<SignalId, Port>,
        moment: Validity,
        last: Option<Sample>,
    ) -> Option<(Computed<'a>, Validity)> {
        let (value, validity) = match &mut self.body {
            Body::Direct(input) => (input.at(ports, moment)?, moment),
            Body::Computed(computed) => {
                let find = |_, input: &Source| input.at(ports, moment, last).ok_or(Missing::Never);
                let outcome = computed.over(moment, last.map(|last| last.validity), find).ok()?;
                (outcome.value, outcome.valid)
            }
        };
        usable(value).map(|value| (value, validity))
    }

    /// The task of [`Computation::evaluate`] at a moment, to be done elsewhere; `None` when an input is missing there, or there
    /// is nothing to compute. Time and memory: linear in the inputs.
    #[must_use]
    pub fn task(
        &self,
        ports: &IdVec<SignalId, Port>,
        moment: Validity,
        last: Option<Sample>,
    ) -> Option<Task> {
        let Body::Computed(computed) = &self.body else { return None };
        let listed = |value: Value<'_, Interval>| match value {
            Value::Scalar(value) => Vec::from([value]),
            Value::Vector(elements) => elements.to_vec(),
        };
        let value = |input: &Source| input.at(ports, moment, last).map(listed);
        let values = computed.inputs.iter().map(value).collect::<Option<_>>()?;
        Some(Task { values, moment, last: last.map(|last| last.validity) })
    }

    /// Does a task of a computation of the same way. `None` when the task has another shape, or the result has no value.
    pub fn carry_out<'a>(&'a mut self, task: &'a Task) -> Option<(Computed<'a>, Validity)> {
        let Body::Computed(computed) = &mut self.body else { return None };
        if computed.inputs.len() != task.values.len() {
            return None;
        }
        let find = |at: usize, input: &Source| {
            let given = task.values.get(at).ok_or(Missing::Never)?;
            match input {
                Source::Signal(Input { shape: Shape::Vector, .. }) => Ok(Value::Vector(given)),
                _ => given.first().copied().map(Value::Scalar).ok_or(Missing::Never),
            }
        };
        let outcome = computed.over(task.moment, task.last, find).ok()?;
        usable(outcome.value).map(|value| (value, outcome.valid))
    }

    /// Evaluates over one chosen observation for each source, in the order of the way's sources (`None` for a constant); for
    /// scalars only.
    pub fn evaluate_items(&mut self, items: &[Option<&Item>], moment: Validity) -> Option<Interval> {
        let item = |at: usize| items.get(at).copied().flatten();
        let computed = match &mut self.body {
            Body::Direct(_) => return item(0)?.values.first().copied(),
            Body::Computed(computed) => computed,
        };
        let signals = &self.way.signals;
        let chosen = |input: &Input| item(signals.iter().position(|signal| *signal == Some(input.signal))?);
        let find = |_, input: &Source| match input {
            Source::Signal(input) => Ok(chosen(input).ok_or(Missing::Never)?.value(input.shape)),
            Source::Constant(value) => Ok(Value::Scalar(*value)),
            Source::Last => Err(Missing::Never),
        };
        let value = computed.over(moment, None, find).ok()?.value.scalar();
        (!value.is_empty()).then_some(value)
    }

    /// Evaluates a scalar way over certain bounds at a moment, without its last value: nothing is extrapolated without a bound.
    #[inline]
    pub fn evaluate_settled(&mut self, ports: &IdVec<SignalId, Port>, moment: Validity) -> Settled {
        if let Body::Direct(input) = &self.body
            && input.shape == Shape::Scalar
        {
            // The most frequent case, without a value of a general type.
            return match input.scalar_at(ports, moment) {
                Some(value) if value.is_bounded() => Settled::Value(Sample { validity: moment, value }),
                _ => Settled::Nothing,
            };
        }
        self.evaluate_any(ports, moment)
    }

    #[inline(never)]
    fn evaluate_any(&mut self, ports: &IdVec<SignalId, Port>, moment: Validity) -> Settled {
        let Body::Computed(computed) = &mut self.body else { return Settled::Nothing };
        let find = |_, input: &Source| match input {
            Source::Signal(input) if input.shape == Shape::Scalar => {
                match input.scalar_about(ports, moment) {
                    Known::Value(value) => Ok(Value::Scalar(value)),
                    Known::Later => Err(Missing::Later(input.signal)),
                    Known::Never => Err(Missing::Never),
                }
            }
            input => input.at(ports, moment, None).ok_or(Missing::Never),
        };
        let outcome = match computed.over(moment, None, find) {
            Ok(outcome) => outcome,
            Err(Missing::Later(signal)) => return Settled::Later(signal),
            Err(Missing::Never) => return Settled::Nothing,
        };
        match usable(outcome.value) {
            Some(Computed::Scalar(value)) => Settled::Value(Sample { validity: outcome.valid, value }),
            _ => Settled::Nothing,
        }
    }

    /// The values of which the output is one, as of the last evaluation (see [`Program::alternatives`](crate::expression::Program::alternatives)).
    #[must_use]
    pub fn alternatives(&self) -> &[Interval] {
        match &self.body {
            Body::Direct(_) => &[],
            Body::Computed(computed) => computed.program.alternatives(&computed.state),
        }
    }

    /// The value of a way that rests on constants alone; `None` for all others.
    pub fn constant(&mut self) -> Option<Interval> {
        let Body::Computed(computed) = &mut self.body else { return None };
        if computed.program.is_stateful() {
            return None;
        }
        let find = |_, input: &Source| match input {
            Source::Constant(value) => Ok(Value::Scalar(*value)),
            Source::Signal(_) | Source::Last => Err(Missing::Never),
        };
        let value = computed.over(Validity::always(), None, find).ok()?.value.scalar();
        value.is_bounded().then_some(value)
    }
}

/// The value, if it is bounded and not empty.
fn usable(value: Value<'_, Interval>) -> Option<Computed<'_>> {
    match value {
        Value::Scalar(value) => value.is_bounded().then_some(Computed::Scalar(value)),
        Value::Vector(elements) => (!elements.is_empty()).then_some(Computed::Vector(elements)),
    }
}

/// Makes room for the vectors when the first ones come, and whenever they become longer.
fn make_room(state: &mut State<Interval>, values: &[Value<'_, Interval>]) {
    let length = |value: &Value<'_, Interval>| match value {
        Value::Vector(elements) => elements.len(),
        Value::Scalar(_) => 0,
    };
    state.make_room(values.iter().map(length).max().unwrap_or(0));
}
