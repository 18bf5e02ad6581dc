//! The inputs of a computation: signals, constants and its own last value, each brought to a moment.

use crate::alignment::{Known, Port, Reach, Sample};
use crate::circle;
use crate::expression::Value;
use crate::interval::Interval;
use crate::knowledge::{Access, IdVec, KnowledgeBase, Lineage, Shape, SignalId};
use crate::time::{Span, Validity};

/// The source of a program's input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Source {
    Signal(Input),
    Constant(Interval),
    /// The last value of the computed variable.
    Last,
}

/// A wrapping input, by its place: the first one is brought into one turn, the others next to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wrapping {
    pub(super) at: usize,
    pub(super) turn: f64,
    pub(super) begins: f64,
    /// Whether a condition reads the place within the turn, which is unknown for a value across the turn's end.
    pub(super) is_asked: bool,
}

/// A signal as an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Input {
    pub(super) signal: SignalId,
    pub(super) shape: Shape,
    max_rate: f64,
    /// The largest gap over which a value counts; `None` learns it from the spacing of the observations.
    max_gap: Option<Span>,
    delay: Span,
    /// Whether a value stands until the next one.
    stands: bool,
    /// What is taken for the value after the latest one.
    access: Access,
    /// Whether the observations of this input set the moments at which the way is evaluated; the input is then read at its own
    /// moments.
    pub(super) is_trigger: bool,
}

impl Input {
    pub(super) fn new(knowledge: &KnowledgeBase, signal: SignalId, trigger: Option<SignalId>) -> Input {
        let description = &knowledge.signals()[signal];
        let max_rate =
            knowledge.variables()[description.variable].max_rate.filter(|_| !description.is_ageless());
        let max_gap =
            period(knowledge, signal).map(|period| period.times(2) + description.delay.max(Span::ZERO));
        let shape = knowledge.variables()[description.variable].shape;
        let (delay, stands, access) = (description.delay, description.holds, description.access);
        // What only repeats the value that stands is no observation to look up.
        let is_trigger = trigger == Some(signal) && !stands;
        let max_rate = max_rate.unwrap_or(0.0);
        Input { signal, shape, max_rate, max_gap, delay, stands, access, is_trigger }
    }

    pub(super) fn succeeded(self, lineage: &Lineage) -> Option<Input> {
        Some(Input { signal: lineage.signal(self.signal)?, ..self })
    }

    fn max_gap(&self, port: &Port) -> Span {
        self.max_gap.or_else(|| port.spacing().map(|spacing| spacing.times(2))).unwrap_or(Span::MAX)
    }

    pub(super) fn at<'a>(
        &self,
        ports: &'a IdVec<SignalId, Port>,
        moment: Validity,
    ) -> Option<Value<'a, Interval>> {
        match self.shape {
            Shape::Vector => {
                let port = &ports[self.signal];
                port.vector_at(moment, self.max_gap(port)).map(Value::Vector)
            }
            Shape::Scalar => self.scalar_at(ports, moment).map(Value::Scalar),
        }
    }

    /// The value of a scalar.
    #[inline]
    pub(super) fn scalar_at(&self, ports: &IdVec<SignalId, Port>, moment: Validity) -> Option<Interval> {
        let port = &ports[self.signal];
        if self.is_trigger {
            return port.scalar_exactly_at(moment);
        }
        // Where the rate of change is bounded, what overlaps has an age, too.
        let alone = if self.max_rate > 0.0 { None } else { port.scalar_alone_at(moment) };
        alone.or_else(|| self.scalar_near(port, moment))
    }

    /// Whether the value changes between observations, and none is of this very moment.
    pub(super) fn lags(&self, ports: &IdVec<SignalId, Port>, moment: Validity) -> bool {
        let changes = self.shape == Shape::Scalar && !(self.stands && self.max_rate == 0.0);
        changes && !self.is_trigger && ports[self.signal].scalar_exactly_at(moment).is_none()
    }

    /// The certain bound of a scalar; see [`Known`].
    pub(super) fn scalar_about(&self, ports: &IdVec<SignalId, Port>, moment: Validity) -> Known {
        let port = &ports[self.signal];
        if self.is_trigger {
            return Known::or_never(port.scalar_exactly_at(moment));
        }
        // An input that is reported late is waited for.
        port.scalar_about(moment, self.reach(self.max_gap(port) - self.delay.max(Span::ZERO)))
    }

    #[inline(never)]
    fn scalar_near(&self, port: &Port, moment: Validity) -> Option<Interval> {
        let reading = port.scalar_at(moment, self.reach(self.max_gap(port)))?;
        let is_fresh = match self.access {
            Access::Port => true,
            Access::Estimate => false,
            Access::Both => port.spacing().is_none_or(|spacing| reading.gap.times(2) <= spacing),
        };
        let estimate = if is_fresh { None } else { port.scalar_ahead(moment, self.max_rate) };
        Some(estimate.unwrap_or(reading.value))
    }

    fn reach(&self, max_gap: Span) -> Reach {
        Reach { max_rate: self.max_rate, max_gap, stands: self.stands }
    }
}

impl Source {
    /// The value at a moment; `last` is the last value of the computed variable.
    #[inline]
    pub(super) fn at<'a>(
        &self,
        ports: &'a IdVec<SignalId, Port>,
        moment: Validity,
        last: Option<Sample>,
    ) -> Option<Value<'a, Interval>> {
        match self {
            Source::Signal(input) => input.at(ports, moment),
            Source::Constant(value) => Some(Value::Scalar(*value)),
            Source::Last => last.map(|last| Value::Scalar(last.value)),
        }
    }

    pub(super) fn succeeded(self, lineage: &Lineage) -> Option<Source> {
        match self {
            Source::Signal(input) => input.succeeded(lineage).map(Source::Signal),
            Source::Constant(_) | Source::Last => Some(self),
        }
    }
}

/// The declared time between observations of a signal.
pub(super) fn period(knowledge: &KnowledgeBase, signal: SignalId) -> Option<Span> {
    knowledge.signals()[signal].period()
}

/// Brings wrapping inputs into one turn: conditions read them as shown, and differences and means of two go the shorter way
/// round. Returns false where a condition reads an unknown place.
#[inline]
pub(super) fn bring_back(values: &mut [Value<'_, Interval>], wrapping: &[Wrapping]) -> bool {
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
