//! The computation of a way of knowing: its inputs are brought to one moment, and its program is evaluated.

mod input;
mod compile;
mod evaluate;

use crate::alignment::{Port, Sample};
use crate::expression::{InputKind, Program, State, Symbol, Value};
use crate::interval::Interval;
use crate::knowledge::{Id, IdVec, KnowledgeBase, Lineage, Shape, SignalId, VariableId};
use crate::substitution::{Substitution, Way};
use crate::time::{Span, Validity};
use alloc::vec::Vec;
use compile::{computed, lateness, program, trigger};
use input::{Input, Source, Wrapping, period};

/// The evaluations a second of a way without a declared rate, for the room of its time operators.
const USUAL_RATE_HZ: f64 = 100.0;

/// The relation of a way to time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Time between outputs; `None` when the rate is not declared.
    pub period: Option<Span>,
    /// The age of an output when it comes.
    pub lag: Span,
    /// The longest window of its difference quotients and means: an output is valid over all of it.
    pub window: Span,
    /// The time over which an output is a mean: that window, else the `mean_over` of the signals. Zero for an output that is true
    /// at a moment.
    pub mean_over: Span,
    /// The time error of an output that is true over a window, and of the begin of the window: the length of the time in which
    /// each of them lies. Zero for an output that is true at a moment, whose validity is that time.
    pub time_error: Span,
}

impl Timing {
    /// How far from the middle of its validity, of this length, an output may be true, in time: for an output that is a mean, the mean distance. The
    /// value at the middle is off by no more than the largest rate of change times this.
    #[must_use]
    pub fn off(&self, length: Span) -> Span {
        let (mean, error) = match self.window > Span::ZERO {
            true => (length - self.time_error, self.time_error),
            false => (self.mean_over, length),
        };
        Span(mean.0.max(0) / 4 + error.0 / 2)
    }

    /// How long after an event an output contains all of it.
    #[must_use]
    pub fn complete_after(&self) -> Span {
        self.lag + self.window.max(Span(self.mean_over.0 / 2))
    }
}

/// The output of a computation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Computed<'a> {
    /// A number within an interval.
    Scalar(Interval),
    /// A list of numbers, each within an interval.
    Vector(&'a [Interval]),
}

/// An observation as an input: a scalar has one value.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// When the observation was true.
    pub validity: Validity,
    /// The values in SI.
    pub values: Vec<Interval>,
}

/// A way of knowing, ready to be evaluated.
#[derive(Debug)]
pub struct Computation {
    way: Way,
    trigger: Option<SignalId>,
    timing: Timing,
    /// Whether it contains a difference quotient.
    is_rate: bool,
    body: Body,
}

/// The result of an evaluation over bounds that are certain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Settled {
    /// The output.
    Value(Sample),
    /// The value of this input at the moment is not known yet.
    Later(SignalId),
    /// There is no output.
    Nothing,
}

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "most ways are programs, and none is moved after it is made")]
enum Body {
    /// The signal's own values.
    Direct(Input),
    /// A formula of the signals' values.
    Computed(Compiled),
}

/// A program with its memory and the sources of its inputs.
#[derive(Debug)]
struct Compiled {
    program: Program,
    state: State<Interval>,
    inputs: Vec<Source>,
    /// Wrapping inputs, if the program keeps no memory of inputs.
    wrapping: Vec<Wrapping>,
}

/// An evaluation to be done elsewhere: the inputs of a program, brought to a moment. Apart from the program and its memory, the
/// task holds everything that the evaluation needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// The inputs of the program in their order, SI; a scalar is a list of one.
    pub values: Vec<Vec<Interval>>,
    /// The moment.
    pub moment: Validity,
    /// When the last value of the computed variable was true, where that is an input.
    pub last: Option<Validity>,
}

impl Item {
    fn value(&self, shape: Shape) -> Value<'_, Interval> {
        match shape {
            Shape::Vector => Value::Vector(&self.values),
            Shape::Scalar => Value::Scalar(self.values.first().copied().unwrap_or(Interval::EMPTY)),
        }
    }
}

/// Which of two inputs triggers a way: returns whether the first goes before the second.
pub type Precedence = fn(&KnowledgeBase, SignalId, SignalId) -> bool;

impl Computation {
    /// The slowest input triggers: all inputs of each output are new.
    pub fn slowest_input(knowledge: &KnowledgeBase, one: SignalId, other: SignalId) -> bool {
        lateness(knowledge, one) >= lateness(knowledge, other)
    }

    /// The fastest input triggers: outputs come as often as possible.
    pub fn fastest_input(knowledge: &KnowledgeBase, one: SignalId, other: SignalId) -> bool {
        lateness(knowledge, one) < lateness(knowledge, other)
    }

    /// Whether a way can be computed: none of its relations is structure only, and none but the last goes on from its own last
    /// value.
    #[must_use]
    pub fn can_run(knowledge: &KnowledgeBase, way: &Way) -> bool {
        way.direct().is_some() || program(knowledge, way, None).is_some()
    }

    /// The age of a way's outputs when they come.
    #[must_use]
    pub fn lag(knowledge: &KnowledgeBase, way: &Way, goes_before: Precedence) -> Span {
        trigger(knowledge, way, goes_before).map_or(Span::ZERO, |signal| knowledge.signals()[signal].delay)
    }

    /// The outputs a second: as declared, else the usual rate; 0 for a way that rests on constants only.
    #[must_use]
    pub fn rate_hz(knowledge: &KnowledgeBase, way: &Way, goes_before: Precedence) -> f64 {
        let rate = |signal: SignalId| knowledge.signals()[signal].rate_hz.unwrap_or(USUAL_RATE_HZ);
        trigger(knowledge, way, goes_before).map_or(0.0, rate)
    }

    /// Prepares a way; `None` when it cannot run.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, way: Way, goes_before: Precedence) -> Option<Computation> {
        let trigger = trigger(knowledge, &way, goes_before);
        let (body, window) = match way.direct() {
            Some(signal) => (Body::Direct(Input::new(knowledge, signal, trigger)), Span::ZERO),
            None => computed(knowledge, &way, trigger)?,
        };
        let is_rate = matches!(&body, Body::Computed(computed) if computed.program.is_rate());
        let mean_over = |signal: SignalId| knowledge.signals()[signal].mean_over;
        let time_error = |signal: SignalId| {
            let (lowest, highest) = knowledge.signals()[signal].time_error;
            highest - lowest
        };
        let timing = Timing {
            period: trigger.and_then(|signal| period(knowledge, signal)),
            lag: Computation::lag(knowledge, &way, goes_before),
            window,
            mean_over: if window > Span::ZERO {
                window
            } else {
                way.inputs().map(mean_over).max().unwrap_or(Span::ZERO)
            },
            time_error: trigger.filter(|_| window > Span::ZERO).map_or(Span::ZERO, time_error),
        };
        Some(Computation { way, trigger, timing, is_rate, body })
    }

    /// The range of a variable as a computation of it, which rests on nothing; `None` where the range is empty.
    #[must_use]
    pub fn of_range(variable: VariableId, range: Interval) -> Option<Computation> {
        let substitution = Substitution { sink: variable, steps: Vec::new(), sources: Vec::new() };
        let way = Way { substitution, signals: Vec::new() };
        let body = Body::Computed(compile::constant(variable, range)?);
        Some(Computation { way, trigger: None, timing: Timing::default(), is_rate: false, body })
    }

    /// Whether it is a [range](Computation::of_range).
    #[must_use]
    pub fn is_range(&self) -> bool {
        self.way.signals.is_empty() && self.way.substitution.steps.is_empty()
    }

    /// Takes over the memory of a computation from before a change of the knowledge base. Returns whether it does: only when both
    /// compute the same from the same signals in the same rhythm.
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
            (Body::Computed(own), Body::Computed(old)) => {
                let succeeded = old.inputs.iter().map(|input| input.succeeded(lineage));
                let is_same = own.program.is_renamed(&old.program, rename)
                    && succeeded.eq(own.inputs.iter().copied().map(Some));
                if is_same {
                    core::mem::swap(&mut own.state, &mut old.state);
                }
                is_same
            }
            _ => false,
        }
    }

    /// Forgets what it has seen, where it reads a signal that has begun anew. Returns whether it does.
    pub fn begin_anew(&mut self, signal: SignalId) -> bool {
        let reads = self.way.inputs().any(|input| input == signal);
        if let (true, Body::Computed(Compiled { program, state, .. })) = (reads, &mut self.body) {
            state.reset(program);
        }
        reads
    }

    /// Sets the present value of a constant that is learned.
    pub fn set_constant(&mut self, variable: VariableId, value: Interval) {
        if let Body::Computed(computed) = &mut self.body {
            let inputs = computed.program.inputs().iter().zip(&mut computed.inputs);
            for (input, source) in inputs.filter(|(input, _)| input.symbol == variable.symbol()) {
                if let (InputKind::Current, Source::Constant(present)) = (input.kind, source) {
                    *present = value;
                }
            }
        }
    }

    /// The computed way.
    #[must_use]
    pub fn way(&self) -> &Way {
        &self.way
    }

    /// The signal whose observations trigger the computation; `None` when it rests on constants only.
    #[must_use]
    pub fn trigger(&self) -> Option<SignalId> {
        self.trigger
    }

    /// The relation to time.
    #[must_use]
    pub fn timing(&self) -> Timing {
        self.timing
    }

    /// Whether each output of the way holds until the next output: this is so if all its inputs hold.
    #[must_use]
    pub fn stands(&self, knowledge: &KnowledgeBase) -> bool {
        self.trigger.is_some_and(|signal| knowledge.signals()[signal].holds) && !self.is_windowed()
    }

    /// Whether its output is a difference quotient, or made of one: a change over a window.
    #[must_use]
    pub fn is_rate(&self) -> bool {
        self.is_rate
    }

    /// Whether an output is true of a window, and not of a moment.
    #[inline]
    #[must_use]
    pub fn is_windowed(&self) -> bool {
        self.timing.window > Span::ZERO
    }

    /// How far back the inputs of an output reach: this long after a change, an output rests only on later inputs.
    #[must_use]
    pub fn looks_back(&self) -> Span {
        match &self.body {
            Body::Direct(_) => Span::ZERO,
            Body::Computed(computed) => computed.program.looks_back(),
        }
    }

    /// Whether an input changes between its observations and has none of this very moment: then the middle of the value lags or leads.
    /// Complexity: O(inputs and their samples that are newer).
    #[must_use]
    pub fn lags(&self, ports: &IdVec<SignalId, Port>, moment: Validity) -> bool {
        let inputs = match &self.body {
            Body::Direct(_) => &[],
            Body::Computed(computed) => computed.inputs.as_slice(),
        };
        inputs.iter().any(|input| matches!(input, Source::Signal(input) if input.lags(ports, moment)))
    }

    /// The signals read beside the trigger: their values at the trigger's moments may be known only later.
    pub fn joined(&self) -> impl Iterator<Item = SignalId> + '_ {
        let inputs = match &self.body {
            Body::Direct(_) => &[],
            Body::Computed(computed) => computed.inputs.as_slice(),
        };
        inputs.iter().filter_map(|input| match input {
            Source::Signal(input) if !input.is_trigger && input.shape == Shape::Scalar => Some(input.signal),
            _ => None,
        })
    }
}
