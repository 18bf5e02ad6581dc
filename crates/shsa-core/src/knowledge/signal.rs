//! Signals: what carries a variable, how its readings become values, and what several of them share.

use super::ids::{SignalId, VariableId};
use super::properties::Properties;
use crate::interval::Interval;
use crate::time::Span;
use crate::unit::{Unit, enclosed};
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;

/// The error of a value: it lies within `[v + lo, v + hi]`, each widened by its share of `|v|`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ValueError {
    /// Lowest error, SI, at most 0 for a usual sensor.
    pub lo: f64,
    /// Highest error, SI.
    pub hi: f64,
    /// Plus-minus share of the magnitude of the value (0.02 is 2 %).
    pub relative: f64,
}

/// How the readings of a signal become values in its unit: `scale * reading + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Finite and not 0; below 0 it turns the direction round.
    pub scale: f64,
    /// Finite, in the signal's unit.
    pub offset: f64,
}

impl Scaling {
    /// The value of a reading, in the signal's unit.
    #[must_use]
    pub fn value(self, reading: f64) -> f64 {
        self.scale * reading + self.offset
    }

    /// The reading of a value in the signal's unit.
    #[must_use]
    pub fn reading(self, value: f64) -> f64 {
        (value - self.offset) / self.scale
    }

    /// The values, in the signal's unit, of all readings in an interval, rounded outward.
    #[must_use]
    pub fn values(self, readings: Interval) -> Interval {
        let scaled = if self.scale == 1.0 { readings } else { readings * enclosed(self.scale) };
        if self.offset == 0.0 { scaled } else { scaled + enclosed(self.offset) }
    }
}

/// What no reading of a sound signal goes beyond, its errors allowed for; `None` where nothing is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadingLimits {
    /// Possible values, SI: those of its variable, and within them its own. Of numbers, not of vectors.
    pub range: Option<Interval>,
    /// Largest rate of change, SI a second: its own, else its variable's. Of numbers, not of vectors.
    pub max_rate: Option<f64>,
    /// Longest time from the time stamp to the reception: as declared, else its delay and its timeout together where the
    /// model gives a delay.
    pub max_delay: Option<Span>,
    /// How long its readings may stay exactly the same while they keep coming.
    pub frozen_after: Option<Span>,
    /// The turn after which its variable's values are the same again, SI; see [`Variable::wraps`](super::Variable::wraps).
    pub turn: Option<f64>,
}

/// What the text that says where a signal is found tells of its measurement: ranges of that text's bytes.
///
/// How the text is written is for those to know who read recordings and middleware, and who make this of it. By default the
/// text is the name of one measurement: two signals with the same text are one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceParts {
    /// Under which name the messages come that have the measurement in them; the whole text when `None`.
    pub topic: Option<Range<usize>>,
    /// What is equal of two signals that carry the same measurement; the whole text when `None`.
    pub measurement: Option<Range<usize>>,
    /// What is equal to the measurements of which this one is an element, the innermost first.
    pub lists: Vec<Range<usize>>,
}

/// Something on the bus that carries a variable.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Unique in the model.
    pub name: String,
    /// What it carries.
    pub variable: VariableId,
    /// Where it is found, in the words of who reads recordings and middleware.
    pub source: String,
    /// What that tells of its measurement.
    pub source_parts: SourceParts,
    /// What its values come in: its own unit or else the variable's; `None` when the model gives neither.
    pub unit: Option<Unit>,
    /// How its readings become values in that unit; `None` when they are.
    pub scaling: Option<Scaling>,
    /// Observations a second; `None` when it comes when it comes.
    pub rate_hz: Option<f64>,
    /// Error of its values.
    pub value_error: ValueError,
    /// Standard deviation of the noise of its values, SI; `None` when nothing is known of it but the bounds of
    /// `value_error`: only what is declared here lets statistics over many comparisons accuse.
    pub noise: Option<f64>,
    /// Lowest and highest error of its time stamps.
    pub time_error: (Span, Span),
    /// How much older the content is than its time stamp says.
    pub delay: Span,
    /// How long a time each of its values is the mean over, half of it before and half after the moment that time stamp and
    /// delay say; zero of a value that is true at that moment.
    pub mean_over: Span,
    /// How long it may say nothing before it counts as silent; `None` when it is never silent.
    pub timeout: Option<Span>,
    /// Whether a value stands until the next one: it is asked for now and then, and what it says again between two answers is no
    /// new measurement.
    pub holds: bool,
    /// What its readings can be.
    pub limits: ReadingLimits,
    /// Signals that it is computed from: it is no independent witness about them.
    pub derived_from: Vec<SignalId>,
    /// Named numbers for the utility; `prior` is the probability that it is faulty.
    pub properties: Properties,
}

impl Signal {
    /// One of which nothing is known but what it carries.
    #[must_use]
    pub fn new(name: String, variable: VariableId) -> Signal {
        Signal {
            name,
            variable,
            source: String::new(),
            source_parts: SourceParts::default(),
            unit: None,
            scaling: None,
            rate_hz: None,
            value_error: ValueError::default(),
            noise: None,
            time_error: (Span::ZERO, Span::ZERO),
            delay: Span::ZERO,
            mean_over: Span::ZERO,
            timeout: None,
            holds: false,
            limits: ReadingLimits::default(),
            derived_from: Vec::new(),
            properties: Properties::new(),
        }
    }

    /// The time between its observations, as declared.
    #[must_use]
    pub fn period(&self) -> Option<Span> {
        self.rate_hz.map(|rate| Span::from_seconds(1.0 / rate))
    }

    /// Under which name the messages come that have its measurement in them.
    #[must_use]
    pub fn topic(&self) -> &str {
        self.part(self.source_parts.topic.as_ref())
    }

    /// The same text for all signals that carry the same measurement.
    pub(super) fn measurement(&self) -> &str {
        self.part(self.source_parts.measurement.as_ref())
    }

    /// The measurements of which its own is an element, the innermost first.
    pub(super) fn lists(&self) -> impl Iterator<Item = &str> {
        self.source_parts.lists.iter().map(|list| self.part(Some(list)))
    }

    /// A part of the text of its source; all of it where that has no such part.
    fn part(&self, range: Option<&Range<usize>>) -> &str {
        range.and_then(|range| self.source.get(range.clone())).unwrap_or(&self.source)
    }
}

/// What several signals share: a device, a clock, a power supply. When it fails, they all may be wrong at once
/// (a common cause failure).
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Unique in the model.
    pub name: String,
    /// Who shares it, ascending.
    pub signals: Vec<SignalId>,
    /// The probability that it is faulty.
    pub prior: f64,
}

/// The probability that a common cause is faulty when no signal gives one.
pub const CAUSE_PRIOR: f64 = 0.001;
