//! A way of knowing at work: its inputs brought to one moment, its program evaluated.

use crate::alignment::{Known, Port, Reach, Sample};
use crate::circle;
use crate::expression::{Assignment, InputKind, Program, State, Symbol, Value};
use crate::interval::Interval;
use crate::knowledge::{Id, IdVec, KnowledgeBase, Lineage, Shape, SignalId, VariableId};
use crate::substitution::Way;
use crate::time::{Span, Validity};
use alloc::vec::Vec;

/// More inputs than this are read into memory allocated for the evaluation.
const USUAL_INPUTS: usize = 16;

/// Evaluations a second of a way whose rate is not declared, for the room of its time operators.
const USUAL_RATE_HZ: f64 = 100.0;

/// How a way relates to time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Time between outputs; `None` when the rate is not declared.
    pub period: Option<Span>,
    /// How old an output is when it comes.
    pub lag: Span,
    /// The longest window of its difference quotients and means: its output is true of all that time.
    pub window: Span,
    /// How long a time an output is the mean over: that window, else what the signals are that it reads; zero of what is true
    /// at a moment.
    pub mean_over: Span,
}

impl Timing {
    /// How long after an event all of it is in an output.
    #[must_use]
    pub fn tells_all_after(&self) -> Span {
        self.lag + self.window.max(Span(self.mean_over.0 / 2))
    }
}

/// What a computation gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Computed<'a> {
    /// A number within an interval.
    Scalar(Interval),
    /// A list of them.
    Vector(&'a [Interval]),
}

/// One observation as an input: a scalar has one value.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// When it was true.
    pub validity: Validity,
    /// Its values in SI.
    pub values: Vec<Interval>,
}

/// A way of knowing, ready to be evaluated.
#[derive(Debug)]
pub struct Computation {
    way: Way,
    trigger: Option<SignalId>,
    timing: Timing,
    /// Whether a difference quotient is in it.
    is_rate: bool,
    body: Body,
}

/// What an evaluation over what is certain gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Settled {
    /// The output.
    Value(Sample),
    /// What this input was at that moment is not known yet.
    Later(SignalId),
    /// There is no output.
    Nothing,
}

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "most ways are programs, and none is moved after it is made")]
enum Body {
    /// The signal's own values.
    Direct(Input),
    /// A program over inputs.
    Computed {
        program: Program,
        state: State<Interval>,
        inputs: Vec<Source>,
        /// Inputs that wrap, where nothing is remembered of them.
        wrapping: Vec<Wrapping>,
    },
}

/// Where an input of a program comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    Signal(Input),
    Constant(Interval),
    /// The last value of the variable that is computed.
    Last,
}

/// An input that wraps, by its place: the first one is brought back into one turn, the others beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wrapping {
    at: usize,
    turn: f64,
    begins: f64,
    /// Whether a condition asks where in its turn it is: that is not known of what lies on both sides of its end.
    is_asked: bool,
}

/// A signal as an input.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Input {
    signal: SignalId,
    shape: Shape,
    max_rate: f64,
    /// Over which gap a value still counts; `None` learns it from the spacing of the observations.
    max_gap: Option<Span>,
    delay: Span,
    /// Whether its observations are the moments at which the way is evaluated.
    is_trigger: bool,
}

impl Input {
    fn new(knowledge: &KnowledgeBase, signal: SignalId, trigger: Option<SignalId>) -> Input {
        let description = &knowledge.signals()[signal];
        let max_rate = knowledge.variables()[description.variable].max_rate.unwrap_or(0.0);
        let max_gap = period(knowledge, signal).map(|period| period.times(2) + description.delay);
        let shape = knowledge.variables()[description.variable].shape;
        let is_trigger = trigger == Some(signal);
        Input { signal, shape, max_rate, max_gap, delay: description.delay, is_trigger }
    }

    fn succeeded(self, lineage: &Lineage) -> Option<Input> {
        Some(Input { signal: lineage.signal(self.signal)?, ..self })
    }

    fn max_gap(&self, port: &Port) -> Span {
        self.max_gap.or_else(|| port.spacing().map(|spacing| spacing.times(2))).unwrap_or(Span::MAX)
    }

    fn at<'a>(&self, ports: &'a IdVec<SignalId, Port>, moment: Validity) -> Option<Value<'a, Interval>> {
        match self.shape {
            Shape::Vector => {
                let port = &ports[self.signal];
                port.vector_at(moment, self.max_gap(port)).map(Value::Vector)
            }
            Shape::Scalar => self.scalar_at(ports, moment).map(Value::Scalar),
        }
    }

    /// The value of a number.
    #[inline]
    fn scalar_at(&self, ports: &IdVec<SignalId, Port>, moment: Validity) -> Option<Interval> {
        let port = &ports[self.signal];
        if self.is_trigger {
            return port.scalar_exactly_at(moment);
        }
        port.scalar_alone_at(moment).or_else(|| self.scalar_near(port, moment))
    }

    /// What is certain about the value of a number; see [`Known`].
    fn scalar_about(&self, ports: &IdVec<SignalId, Port>, moment: Validity) -> Known {
        let port = &ports[self.signal];
        if self.is_trigger {
            return Known::or_never(port.scalar_exactly_at(moment));
        }
        // An input that is told late is waited for.
        let max_gap = self.max_gap(port) - self.delay;
        port.scalar_about(moment, Reach { max_rate: self.max_rate, max_gap })
    }

    #[inline(never)]
    fn scalar_near(&self, port: &Port, moment: Validity) -> Option<Interval> {
        let reach = Reach { max_rate: self.max_rate, max_gap: self.max_gap(port) };
        port.scalar_at(moment, reach).map(|reading| reading.value)
    }
}

/// One evaluation that is yet to be done: the inputs of a program, brought to a moment. It holds all that the evaluation
/// needs beside the program and its memory, so that it can be done elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// The inputs of the program in their order, SI; a number is a list of one.
    pub values: Vec<Vec<Interval>>,
    /// The moment.
    pub moment: Validity,
    /// When the last value of the variable that is computed was true, where that is an input.
    pub last: Option<Validity>,
}

impl Source {
    fn succeeded(self, lineage: &Lineage) -> Option<Source> {
        match self {
            Source::Signal(input) => input.succeeded(lineage).map(Source::Signal),
            Source::Constant(_) | Source::Last => Some(self),
        }
    }
}

impl Item {
    fn value(&self, shape: Shape) -> Value<'_, Interval> {
        match shape {
            Shape::Vector => Value::Vector(&self.values),
            Shape::Scalar => Value::Scalar(self.values.first().copied().unwrap_or(Interval::EMPTY)),
        }
    }
}

/// Which of two inputs makes a way compute: whether the first goes before the second.
pub type Precedence = fn(&KnowledgeBase, SignalId, SignalId) -> bool;

impl Computation {
    /// Computes when its slowest input delivers: every output is from inputs that are all new.
    pub fn slowest_input(knowledge: &KnowledgeBase, one: SignalId, other: SignalId) -> bool {
        lateness(knowledge, one) >= lateness(knowledge, other)
    }

    /// Computes when its fastest input delivers: outputs come as often as possible.
    pub fn fastest_input(knowledge: &KnowledgeBase, one: SignalId, other: SignalId) -> bool {
        lateness(knowledge, one) < lateness(knowledge, other)
    }

    /// Whether a way can be made ready: none of its relations is structure only, and none but the last goes on from
    /// its own last value.
    #[must_use]
    pub fn can_run(knowledge: &KnowledgeBase, way: &Way) -> bool {
        way.direct().is_some() || program(knowledge, way, None).is_some()
    }

    /// How old the outputs of a way are when they come.
    #[must_use]
    pub fn lag(knowledge: &KnowledgeBase, way: &Way, goes_before: Precedence) -> Span {
        trigger(knowledge, way, goes_before).map_or(Span::ZERO, |signal| knowledge.signals()[signal].delay)
    }

    /// How often a way gives an output in a second: as declared, else as is usual; 0 when it rests on constants only.
    #[must_use]
    pub fn rate_hz(knowledge: &KnowledgeBase, way: &Way, goes_before: Precedence) -> f64 {
        let rate = |signal: SignalId| knowledge.signals()[signal].rate_hz.unwrap_or(USUAL_RATE_HZ);
        trigger(knowledge, way, goes_before).map_or(0.0, rate)
    }

    /// Makes a way ready; `None` when it cannot run.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, way: Way, goes_before: Precedence) -> Option<Computation> {
        let trigger = trigger(knowledge, &way, goes_before);
        let (body, window) = match way.direct() {
            Some(signal) => (Body::Direct(Input::new(knowledge, signal, trigger)), Span::ZERO),
            None => computed(knowledge, &way, trigger)?,
        };
        let is_rate = matches!(&body, Body::Computed { program, .. } if program.is_rate());
        let mean_over = |signal: SignalId| knowledge.signals()[signal].mean_over;
        let timing = Timing {
            period: trigger.and_then(|signal| period(knowledge, signal)),
            lag: Computation::lag(knowledge, &way, goes_before),
            window,
            mean_over: if window > Span::ZERO {
                window
            } else {
                way.inputs().map(mean_over).max().unwrap_or(Span::ZERO)
            },
        };
        Some(Computation { way, trigger, timing, is_rate, body })
    }

    /// Goes on from what an earlier computation remembers, which was made from the knowledge base before a change; whether
    /// it does: only when both compute the same from the same signals in the same rhythm.
    pub fn inherit(&mut self, old: &mut Computation, lineage: &Lineage) -> bool {
        let rename = |symbol: Symbol| {
            lineage.variable(VariableId::from_index(symbol.0 as usize)).map(VariableId::symbol)
        };
        if self.timing != old.timing || self.trigger != old.trigger.and_then(|signal| lineage.signal(signal))
        {
            return false;
        }
        match (&mut self.body, &mut old.body) {
            (Body::Direct(own), Body::Direct(input)) => input.succeeded(lineage) == Some(*own),
            (
                Body::Computed { program, state, inputs, .. },
                Body::Computed { program: old_program, state: old_state, inputs: old_inputs, .. },
            ) => {
                let is_same = program.is_renamed(old_program, rename)
                    && old_inputs
                        .iter()
                        .map(|input| input.succeeded(lineage))
                        .eq(inputs.iter().copied().map(Some));
                if is_same {
                    core::mem::swap(state, old_state);
                }
                is_same
            }
            _ => false,
        }
    }

    /// What is computed.
    #[must_use]
    pub fn way(&self) -> &Way {
        &self.way
    }

    /// The signal whose observations make it compute; `None` when it rests on constants only.
    #[must_use]
    pub fn trigger(&self) -> Option<SignalId> {
        self.trigger
    }

    /// How it relates to time.
    #[must_use]
    pub fn timing(&self) -> Timing {
        self.timing
    }

    /// Whether its output is a difference quotient, or made of one: it tells how something changes, over a window.
    #[must_use]
    pub fn is_rate(&self) -> bool {
        self.is_rate
    }

    /// Whether its output is true of a window, and not of a moment.
    #[inline]
    #[must_use]
    pub fn is_windowed(&self) -> bool {
        self.timing.window > Span::ZERO
    }

    /// Over which time what is computed from is spread: so long after a change an output is all of what came after it.
    #[must_use]
    pub fn looks_back(&self) -> Span {
        match &self.body {
            Body::Direct(_) => Span::ZERO,
            Body::Computed { program, .. } => program.looks_back(),
        }
    }

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

    /// The signals that it reads beside its trigger: what they were at the trigger's moments may be known later only.
    pub fn joined(&self) -> impl Iterator<Item = SignalId> + '_ {
        let inputs = match &self.body {
            Body::Direct(_) => &[],
            Body::Computed { inputs, .. } => inputs.as_slice(),
        };
        inputs.iter().filter_map(|input| match input {
            Source::Signal(input) if !input.is_trigger && input.shape == Shape::Scalar => Some(input.signal),
            _ => None,
        })
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

fn trigger(knowledge: &KnowledgeBase, way: &Way, goes_before: Precedence) -> Option<SignalId> {
    way.inputs().reduce(|best, next| if goes_before(knowledge, next, best) { next } else { best })
}

/// Time between the observations of a signal, as declared.
fn period(knowledge: &KnowledgeBase, signal: SignalId) -> Option<Span> {
    knowledge.signals()[signal].rate_hz.map(|rate| Span::from_seconds(1.0 / rate))
}

/// How long after an event a signal tells of it, at the latest.
fn lateness(knowledge: &KnowledgeBase, signal: SignalId) -> Span {
    period(knowledge, signal).unwrap_or(Span::ZERO) + knowledge.signals()[signal].delay
}

/// The program of a way with its memory and the sources of its inputs, and its longest window.
fn computed(knowledge: &KnowledgeBase, way: &Way, trigger: Option<SignalId>) -> Option<(Body, Span)> {
    let (program, inputs) = program(knowledge, way, trigger)?;
    let rate_hz = trigger.and_then(|signal| knowledge.signals()[signal].rate_hz).unwrap_or(USUAL_RATE_HZ);
    let state = program.new_state(0, rate_hz);
    let window = program.longest_window();
    let wrapping = wrapping(knowledge, way, &inputs);
    Some((Body::Computed { program, state, inputs, wrapping }, window))
}

/// The inputs that wrap; none where something is remembered of inputs, which must go on without a step then.
fn wrapping(knowledge: &KnowledgeBase, way: &Way, inputs: &[Source]) -> Vec<Wrapping> {
    let is_stateful = |step: &crate::substitution::Step| {
        let relation = &knowledge.relations()[step.relation];
        let formulas = relation.formula(step.output).into_iter().chain(&relation.condition);
        formulas.into_iter().any(crate::expression::Formula::is_stateful)
    };
    if way.substitution.steps.iter().any(is_stateful) {
        return Vec::new();
    }
    let wraps = |(at, source): (usize, &Source)| {
        let Source::Signal(input) = source else { return None };
        let variable = &knowledge.variables()[knowledge.signals()[input.signal].variable];
        let symbol = knowledge.signals()[input.signal].variable.symbol();
        let is_asked = way.substitution.steps.iter().any(|step| {
            let relation = &knowledge.relations()[step.relation];
            let mut formulas = relation.formula(step.output).into_iter().chain(&relation.condition);
            formulas.any(|formula| formula.compares(symbol))
        });
        Some(Wrapping { at, turn: variable.wraps?, begins: variable.turn_begins(), is_asked })
    };
    inputs.iter().enumerate().filter_map(wraps).collect()
}

/// Brings inputs that wrap into one turn: conditions read them as they are shown, and differences and means of two are those
/// of the shorter way round. False where a condition asks what is not known.
#[inline]
fn bring_back(values: &mut [Value<'_, Interval>], wrapping: &[Wrapping]) -> bool {
    let mut first: Option<(f64, Interval)> = None;
    for Wrapping { at, turn, begins, is_asked } in wrapping {
        let Some(Value::Scalar(value)) = values.get_mut(*at) else { continue };
        *value = match first {
            Some((same, beside)) if same == *turn => circle::nearest(*value, beside, *turn),
            _ => circle::brought_back(*value, *begins, *turn),
        };
        if *is_asked {
            *value = circle::brought_back(*value, *begins, *turn);
            if value.lo() < *begins || value.hi() >= begins + turn {
                return false;
            }
        }
        first = first.or(Some((*turn, *value)));
    }
    true
}

/// The program of a way with the sources of its inputs.
fn program(
    knowledge: &KnowledgeBase,
    way: &Way,
    trigger: Option<SignalId>,
) -> Option<(Program, Vec<Source>)> {
    let steps = &way.substitution.steps;
    let assignment = |step: &crate::substitution::Step| {
        let relation = &knowledge.relations()[step.relation];
        Some(Assignment {
            symbol: step.output.symbol(),
            formula: relation.formula(step.output)?,
            condition: relation.condition.as_ref(),
        })
    };
    let assignments = steps.iter().map(assignment).collect::<Option<Vec<_>>>()?;
    let program = Program::compile(&assignments).ok()?;
    let source = |input: &crate::expression::Input| source(knowledge, (way, trigger), input);
    let inputs = program.inputs().iter().map(source).collect::<Option<Vec<_>>>()?;
    Some((program, inputs))
}

/// Vectors are as long as their observations: room is made when the first ones come, and whenever they are longer.
fn make_room(state: &mut State<Interval>, values: &[Value<'_, Interval>]) {
    let length = |value: &Value<'_, Interval>| match value {
        Value::Vector(elements) => elements.len(),
        Value::Scalar(_) => 0,
    };
    state.make_room(values.iter().map(length).max().unwrap_or(0));
}

fn source(
    knowledge: &KnowledgeBase,
    (way, trigger): (&Way, Option<SignalId>),
    input: &crate::expression::Input,
) -> Option<Source> {
    if input.kind == InputKind::Previous {
        return (input.symbol == way.substitution.sink.symbol()).then_some(Source::Last);
    }
    let at = way.substitution.sources.iter().position(|source| source.symbol() == input.symbol)?;
    match (way.signals.get(at)?, way.substitution.sources.get(at)?) {
        (Some(signal), _) => Some(Source::Signal(Input::new(knowledge, *signal, trigger))),
        (None, variable) => knowledge.variables()[*variable].constant.map(Source::Constant),
    }
}
