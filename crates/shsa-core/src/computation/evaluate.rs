//! A computation is evaluated: at a moment, over what is certain about it, over chosen observations, or elsewhere as a task.

use super::input::{Input, Source, bring_back};
use super::{Body, Computation, Computed, Item, Settled, Task};
use crate::alignment::{Known, Port, Sample};
use crate::expression::{State, Value};
use crate::interval::Interval;
use crate::knowledge::{IdVec, Shape, SignalId};
use crate::time::Validity;
use alloc::vec::Vec;

/// More inputs than this are read into memory allocated for the evaluation.
const USUAL_INPUTS: usize = 16;

impl Computation {
    /// Evaluates at a moment; `None` when an input is missing there or the result has no value.
    ///
    /// `last` is the last value of the variable that is computed. No allocation for up to 16 inputs whose vectors
    /// are no longer than before.
    pub fn evaluate<'a>(
        &'a mut self,
        ports: &'a IdVec<SignalId, Port>,
        moment: Validity,
        last: Option<Sample>,
    ) -> Option<(Computed<'a>, Validity)> {
        let (value, validity) = match &mut self.body {
            Body::Direct(input) => (input.at(ports, moment)?, moment),
            Body::Computed { program, state, inputs, wrapping } => {
                let mut usual = [Value::Scalar(Interval::EMPTY); USUAL_INPUTS];
                let mut many = Vec::new();
                let values = match usual.get_mut(..inputs.len()) {
                    Some(values) => values,
                    None => {
                        many.resize(inputs.len(), Value::Scalar(Interval::EMPTY));
                        many.as_mut_slice()
                    }
                };
                for (value, input) in values.iter_mut().zip(inputs.iter()) {
                    *value = match input {
                        Source::Signal(input) => input.at(ports, moment)?,
                        Source::Constant(value) => Value::Scalar(*value),
                        Source::Last => Value::Scalar(last?.value),
                    };
                }
                if !bring_back(values, wrapping) {
                    return None;
                }
                make_room(state, values);
                let outcome = program.evaluate(state, values, moment, last.map(|last| last.validity));
                (outcome.value, outcome.valid)
            }
        };
        usable(value).map(|value| (value, validity))
    }

    /// What [`Computation::evaluate`] would evaluate at a moment, to be done elsewhere; `None` when an input is missing there,
    /// or nothing is computed. Time and memory: linear in the inputs.
    #[must_use]
    pub fn task(
        &self,
        ports: &IdVec<SignalId, Port>,
        moment: Validity,
        last: Option<Sample>,
    ) -> Option<Task> {
        let Body::Computed { inputs, .. } = &self.body else { return None };
        let listed = |value: Value<'_, Interval>| match value {
            Value::Scalar(value) => Vec::from([value]),
            Value::Vector(elements) => elements.to_vec(),
        };
        let value = |input: &Source| match input {
            Source::Signal(input) => input.at(ports, moment).map(listed),
            Source::Constant(value) => Some(Vec::from([*value])),
            Source::Last => last.map(|last| Vec::from([last.value])),
        };
        let values = inputs.iter().map(value).collect::<Option<_>>()?;
        Some(Task { values, moment, last: last.map(|last| last.validity) })
    }

    /// Does a task of a computation of the same way. `None` when it is of another shape, or the result has no value.
    pub fn carry_out(&mut self, task: &Task) -> Option<(Computed<'_>, Validity)> {
        let Body::Computed { program, state, inputs, wrapping } = &mut self.body else { return None };
        if inputs.len() != task.values.len() {
            return None;
        }
        let mut values = Vec::with_capacity(inputs.len());
        for (input, given) in inputs.iter().zip(&task.values) {
            values.push(match input {
                Source::Signal(Input { shape: Shape::Vector, .. }) => Value::Vector(given),
                _ => Value::Scalar(given.first().copied()?),
            });
        }
        if !bring_back(&mut values, wrapping) {
            return None;
        }
        make_room(state, &values);
        let outcome = program.evaluate(state, &values, task.moment, task.last);
        usable(outcome.value).map(|value| (value, outcome.valid))
    }

    /// Evaluates over one chosen observation for each source, in the order of the way's sources (`None` for a
    /// constant); for numbers only.
    pub fn evaluate_items(&mut self, items: &[Option<&Item>], moment: Validity) -> Option<Interval> {
        let item = |at: usize| items.get(at).copied().flatten();
        let (program, state, inputs) = match &mut self.body {
            Body::Direct(_) => return item(0)?.values.first().copied(),
            Body::Computed { program, state, inputs, .. } => (program, state, inputs),
        };
        let signals = &self.way.signals;
        let mut values = Vec::new();
        for input in inputs.iter() {
            values.push(match input {
                Source::Signal(input) => {
                    item(signals.iter().position(|signal| *signal == Some(input.signal))?)?.value(input.shape)
                }
                Source::Constant(value) => Value::Scalar(*value),
                Source::Last => return None,
            });
        }
        make_room(state, &values);
        let value = program.evaluate(state, &values, moment, None).value.scalar();
        (!value.is_empty()).then_some(value)
    }

    /// Evaluates a way of knowing a number over what is certain about a moment, without its last value: nothing is
    /// extrapolated that the model does not bound.
    #[inline]
    pub fn evaluate_settled(&mut self, ports: &IdVec<SignalId, Port>, moment: Validity) -> Settled {
        if let Body::Direct(input) = &self.body
            && input.shape == Shape::Scalar
        {
            // As most often, and not by way of a value of any kind.
            return match input.scalar_at(ports, moment) {
                Some(value) if value.is_bounded() => Settled::Value(Sample { validity: moment, value }),
                _ => Settled::Nothing,
            };
        }
        self.evaluate_any(ports, moment)
    }

    #[inline(never)]
    fn evaluate_any(&mut self, ports: &IdVec<SignalId, Port>, moment: Validity) -> Settled {
        let Body::Computed { program, state, inputs, wrapping } = &mut self.body else {
            return Settled::Nothing;
        };
        let mut usual = [Value::Scalar(Interval::EMPTY); USUAL_INPUTS];
        let mut many = Vec::new();
        let values = match usual.get_mut(..inputs.len()) {
            Some(values) => values,
            None => {
                many.resize(inputs.len(), Value::Scalar(Interval::EMPTY));
                many.as_mut_slice()
            }
        };
        for (value, input) in values.iter_mut().zip(inputs.iter()) {
            *value = match input {
                Source::Signal(input) if input.shape == Shape::Scalar => {
                    match input.scalar_about(ports, moment) {
                        Known::Value(value) => Value::Scalar(value),
                        Known::Later => return Settled::Later(input.signal),
                        Known::Never => return Settled::Nothing,
                    }
                }
                Source::Signal(input) => match input.at(ports, moment) {
                    Some(value) => value,
                    None => return Settled::Nothing,
                },
                Source::Constant(value) => Value::Scalar(*value),
                Source::Last => return Settled::Nothing,
            };
        }
        if !bring_back(values, wrapping) {
            return Settled::Nothing;
        }
        make_room(state, values);
        let outcome = program.evaluate(state, values, moment, None);
        match usable(outcome.value) {
            Some(Computed::Scalar(value)) => Settled::Value(Sample { validity: outcome.valid, value }),
            _ => Settled::Nothing,
        }
    }

    /// The value of a way that rests on constants alone; `None` of all others.
    pub fn constant(&mut self) -> Option<Interval> {
        let Body::Computed { program, state, inputs, .. } = &mut self.body else { return None };
        if program.is_stateful() {
            return None;
        }
        let value = |input: &Source| match input {
            Source::Constant(value) => Some(Value::Scalar(*value)),
            Source::Signal(_) | Source::Last => None,
        };
        let values = inputs.iter().map(value).collect::<Option<Vec<_>>>()?;
        make_room(state, &values);
        let value = program.evaluate(state, &values, Validity::always(), None).value.scalar();
        value.is_bounded().then_some(value)
    }
}

/// A value that says something.
fn usable(value: Value<'_, Interval>) -> Option<Computed<'_>> {
    match value {
        Value::Scalar(value) => value.is_bounded().then_some(Computed::Scalar(value)),
        Value::Vector(elements) => (!elements.is_empty()).then_some(Computed::Vector(elements)),
    }
}

/// Vectors are as long as their observations: room is made when the first ones come, and whenever they are longer.
fn make_room(state: &mut State<Interval>, values: &[Value<'_, Interval>]) {
    let length = |value: &Value<'_, Interval>| match value {
        Value::Vector(elements) => elements.len(),
        Value::Scalar(_) => 0,
    };
    state.make_room(values.iter().map(length).max().unwrap_or(0));
}
