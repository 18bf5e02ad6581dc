//! Signals: the observations of a variable, their scaling, and common causes of several signals.

use super::ids::{SignalId, VariableId};
use super::properties::Properties;
use crate::interval::{Interval, Offset};
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

impl ValueError {
    /// The error of a value that may be off by an amount besides.
    #[must_use]
    pub fn widened(self, by: f64) -> ValueError {
        ValueError { lo: self.lo - by, hi: self.hi + by, ..self }
    }
}

/// How far the difference of two readings is from the difference of the true values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChangeError {
    /// Plus-minus, of two readings at any time, SI.
    pub most: f64,
    /// Plus-minus for each second between them, SI.
    pub drift: f64,
}

/// How the readings of a signal become values in its unit: `scale * reading + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Finite and not 0; a negative scale reverses the direction.
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

/// What is computed from a signal at a moment after its latest value takes for its value then.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Access {
    /// The latest value.
    #[default]
    Port,
    /// An estimate from its recent values.
    Estimate,
    /// The latest value for half a period, then the estimate.
    Both,
}

impl Access {
    /// Every access and its name in models.
    pub const NAMES: [(&str, Access); 3] =
        [("port", Access::Port), ("estimate", Access::Estimate), ("both", Access::Both)];
}

/// The ends of what a sensor can show: a reading at one of them says that the value is there or beyond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saturation {
    /// The lowest and the highest reading that is a measurement, SI; infinite where there is no such end.
    pub ends: Interval,
    /// What the variable can be, SI, as far as one of the ends leaves it open.
    pub beyond: Interval,
}

impl Saturation {
    /// What a reading says, whose errors make it a value: from the end that it may be at, within its errors, to all that is beyond.
    #[must_use]
    pub fn opened(&self, reading: Interval, value: Interval) -> Interval {
        let errors = (value.lo() - reading.lo(), value.hi() - reading.hi());
        let (mut lo, mut hi) = (value.lo(), value.hi());
        if value.lo() <= self.ends.lo() {
            (lo, hi) = (lo.min(self.beyond.lo()), hi.max((self.ends.lo() + errors.1).next_up()));
        }
        if value.hi() >= self.ends.hi() {
            (lo, hi) = (lo.min((self.ends.hi() + errors.0).next_down()), hi.max(self.beyond.hi()));
        }
        Interval::new(lo, hi)
    }

    /// The width that a reading at an end has at least.
    #[must_use]
    pub fn least_width(&self) -> f64 {
        (self.ends.lo() - self.beyond.lo()).min(self.beyond.hi() - self.ends.hi())
    }

    /// Whether a value is one that a reading at an end gives.
    #[must_use]
    pub fn is_one_sided(&self, value: Interval) -> bool {
        let is_open = value.lo() <= self.beyond.lo() || value.hi() >= self.beyond.hi();
        is_open && value.width() >= self.least_width()
    }
}

/// The limits of a sound signal's readings, including its errors; `None` where no limit is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadingLimits {
    /// Possible values, SI: within the range of the variable and the signal's own. For scalars only.
    pub range: Option<Interval>,
    /// Where its readings are bounds only; `None` where each is a measurement.
    pub saturation: Option<Saturation>,
    /// Largest rate of change, SI a second: the signal's own, else the variable's. For scalars only.
    pub max_rate: Option<f64>,
    /// Longest time from the time stamp to the reception: as declared, else delay and timeout together where the model gives a
    /// delay.
    pub max_delay: Option<Span>,
    /// How long readings may stay exactly the same while they keep coming.
    pub frozen_after: Option<Span>,
    /// The value, SI, at which readings may stay the same for `rests_for` instead, as a speed does at rest.
    pub rests_at: Option<f64>,
    /// How long readings may stay at `rests_at`; `None`: for any time.
    pub rests_for: Option<Span>,
    /// Whether it only counts up, but for beginning anew. For scalars only.
    pub counts: bool,
    /// The turn after which the variable's values repeat, SI; see [`Variable::wraps`](super::Variable::wraps).
    pub turn: Option<f64>,
}

impl ReadingLimits {
    /// Whether a value is one that a reading at the end of what the signal can show gives.
    #[inline]
    #[must_use]
    pub fn is_at_end(&self, value: Interval) -> bool {
        self.saturation.is_some_and(|saturation| saturation.is_one_sided(value))
    }
}

/// The parts of a source's text, as ranges of its bytes.
///
/// Only the readers of recordings and middleware know the notation; they make these parts. By default the text names one
/// measurement: two signals with the same text are one measurement.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceParts {
    /// The name of the messages that contain the measurement; the whole text when `None`.
    pub topic: Option<Range<usize>>,
    /// The part that is equal for two signals of the same measurement; the whole text when `None`.
    pub measurement: Option<Range<usize>>,
    /// The measurements that contain this one as an element, the innermost first.
    pub lists: Vec<Range<usize>>,
}

/// A signal on the bus that carries a variable.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Unique in the model.
    pub name: String,
    /// The variable that the signal carries.
    pub variable: VariableId,
    /// Where the signal is found, in the notation of the readers of recordings and middleware.
    pub source: String,
    /// The parts of `source`.
    pub source_parts: SourceParts,
    /// The unit of the values: the signal's own, else the variable's; `None` when the model gives neither.
    pub unit: Option<Unit>,
    /// The scaling from readings to values; `None` when readings are values.
    pub scaling: Option<Scaling>,
    /// Observations a second; `None` for an irregular signal.
    pub rate_hz: Option<f64>,
    /// The error of the values, the dead band included.
    pub value_error: ValueError,
    /// The error of a difference of two values, where it is smaller than that of two values: most of the error is an offset.
    pub change_error: Option<ChangeError>,
    /// Standard deviation of the noise of the values, SI; `None` where only the bounds of `value_error` are known. Trends over
    /// many comparisons accuse only where this is declared.
    pub noise: Option<f64>,
    /// Lowest and highest error of the time stamps.
    pub time_error: (Span, Span),
    /// How much older the content is than the time stamp; below zero where stamps are of the begin of what was measured.
    pub delay: Span,
    /// How long a time each value is the mean over, half of it before and half after the moment of the value; zero for a value of
    /// one moment.
    pub mean_over: Span,
    /// How long a silence counts as absence; `None` when no silence does.
    pub timeout: Option<Span>,
    /// Whether a value stands until the next one: it is asked for now and then, and what it says again between two answers is no
    /// new measurement.
    pub holds: bool,
    /// The change, SI, at which a signal whose value stands is sent again: so far off the value may be, however old it is. 0 where
    /// it is sent by another rule: then its bounds grow by the variable's rate of change.
    pub dead_band: f64,
    /// What is computed from it later takes for its value.
    pub access: Access,
    /// What its readings can be.
    pub limits: ReadingLimits,
    /// The signals that this signal is computed from: it is no independent witness about them.
    pub derived_from: Vec<SignalId>,
    /// Named numbers for the utility; `prior` is the probability of a fault.
    pub properties: Properties,
}

impl Signal {
    /// A signal with default settings.
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
            change_error: None,
            noise: None,
            time_error: (Span::ZERO, Span::ZERO),
            delay: Span::ZERO,
            mean_over: Span::ZERO,
            timeout: None,
            holds: false,
            dead_band: 0.0,
            access: Access::Port,
            limits: ReadingLimits::default(),
            derived_from: Vec::new(),
            properties: Properties::new(),
        }
    }

    /// The part of the error that all its values have alike.
    pub(crate) fn offset(&self) -> Offset {
        let Some(change) = self.change_error else { return Offset::NONE };
        // A reading at an end of what can be shown is off in its own way, and so is what stands within a dead band.
        let own = 0.5 * change.most + self.dead_band;
        let (lo, hi) = (self.value_error.lo + own, self.value_error.hi - own);
        let is_some = lo < hi && self.limits.saturation.is_none();
        if is_some { Offset { lo, hi, drift: change.drift } } else { Offset::NONE }
    }

    /// Whether what it says holds at any age, by its declarations.
    pub(crate) fn is_ageless(&self) -> bool {
        self.holds && self.dead_band > 0.0
    }

    /// The time between its observations, as declared.
    #[must_use]
    pub fn period(&self) -> Option<Span> {
        self.rate_hz.map(|rate| Span::from_seconds(1.0 / rate))
    }

    /// The declared period, where the timeout follows from it.
    pub(crate) fn paced_by(&self) -> Option<Span> {
        let usual = self.rate_hz.map(usual_timeout);
        self.period().filter(|_| self.timeout.is_some() && self.timeout == usual)
    }

    /// Under which name the messages come that have its measurement in them.
    #[must_use]
    pub fn topic(&self) -> &str {
        self.part(self.source_parts.topic.as_ref())
    }

    /// The text that all signals of the same measurement share.
    pub(super) fn measurement(&self) -> &str {
        self.part(self.source_parts.measurement.as_ref())
    }

    /// The measurements that contain this signal's as an element, the innermost first.
    pub(super) fn lists(&self) -> impl Iterator<Item = &str> {
        self.source_parts.lists.iter().map(|list| self.part(Some(list)))
    }

    /// A part of the source's text; the whole text without such a part.
    fn part(&self, range: Option<&Range<usize>>) -> &str {
        range.and_then(|range| self.source.get(range.clone())).unwrap_or(&self.source)
    }
}

/// A rated signal is silent after this many periods: on every real bus, one or two readings are lost or late.
const SILENT_PERIODS: f64 = 5.0;
/// No signal is silent earlier: the scheduling of a busy machine delays a fast signal by tens of milliseconds.
const SILENT_AT_LEAST: Span = Span::from_millis(100);

/// How long a silence counts as absence where the model says nothing else.
pub(super) fn usual_timeout(rate_hz: f64) -> Span {
    Span::from_seconds(SILENT_PERIODS / rate_hz).max(SILENT_AT_LEAST)
}

/// A common cause that several signals share: a device, a clock, a power supply. When it fails, all of them may be wrong at once
/// (a common cause failure).
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Unique in the model.
    pub name: String,
    /// The signals that share the cause, ascending.
    pub signals: Vec<SignalId>,
    /// The probability that the cause is faulty.
    pub prior: f64,
}

/// The probability that a common cause is faulty when no signal gives one.
pub const CAUSE_PRIOR: f64 = 0.001;
