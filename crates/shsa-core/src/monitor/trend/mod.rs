//! Trends over many comparisons of two ways that each agree: drift, scatter, skew in time.
//!
//! Each of the three has a detector of its own; this module combines them and chooses the alarm.
//!
//! All figures are shares of the tolerance, which is half the sum of both widths: at a difference of 1 the intervals part. Where
//! the noise of both is known, figures are multiples of its deviation.

mod options;
mod measured;
mod drift;
mod scatter;
mod skew;
mod recall;
#[cfg(test)]
mod tests;

pub use measured::Measured;
pub use options::{Noise, TrendOptions};
pub use recall::TrendRecord;

use crate::numbers::{AT_ONCE, BEYOND_NOISE, HALF, SURELY, TREND_MEMORY, WILD};
use crate::time::{Span, Time, Validity};
use drift::Drift;
use scatter::Scatter;
use skew::Skew;

/// The present trend of many comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tendency {
    /// No trend.
    Calm,
    /// A trend that is no alarm but may become one.
    Building,
    /// The mean difference has left its usual value for long.
    Drift,
    /// Differences scatter too much.
    Noise,
    /// Differences are proportional to the slope of the values.
    Skew,
}

impl Tendency {
    /// Whether the trend is an alarm, which accuses.
    pub(super) fn is_alarm(self) -> bool {
        !matches!(self, Tendency::Calm | Tendency::Building)
    }
}

/// A trend within the declared bounds: the trend accuses no component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Note {
    /// The mean difference lasts.
    Drift {
        /// The mean of the first value minus the second, SI.
        mean: f64,
        /// The time until the two ways part at this pace; `None` where the difference does not grow.
        parts_in: Option<Span>,
    },
    /// The differences scatter.
    Scatter,
}

/// The previous comparison.
#[derive(Clone, Copy, Debug)]
struct Before {
    time: Time,
    /// Half the sum of both widths, SI, and the difference as a share of that.
    tolerance: f64,
    share: f64,
    /// The clipped difference, in the unit of all figures.
    clipped: f64,
    /// The middle of the other way's value, SI.
    other: f64,
}

/// The trend of many comparisons of two ways.
#[derive(Clone, Copy, Debug)]
pub struct Trend {
    options: TrendOptions,
    noise: Noise,
    /// The reciprocal of the noise's deviation, where that is known.
    per_deviation: f64,
    /// The weight of a second of comparisons in a mean, and the largest weight of one comparison.
    gain_per_second: f64,
    most_gain: f64,
    before: Option<Before>,
    drift: Drift,
    scatter: Scatter,
    skew: Skew,
    alarm: Tendency,
    /// When the last alarm was raised.
    raised: Time,
    /// Whether single comparisons are in conflict.
    in_conflict: bool,
}

impl Trend {
    /// The trend before the first comparison; each comparison covers a window of this length.
    #[must_use]
    pub fn new(options: TrendOptions, window: Span, noise: Noise) -> Trend {
        let span = options.span.max(window.times(2));
        Trend::empty(TrendOptions { span, ..options }, noise)
    }

    fn empty(options: TrendOptions, noise: Noise) -> Trend {
        let (options, per_deviation) = match noise {
            Noise::Known(deviation) => {
                (TrendOptions { scatter: BEYOND_NOISE, skew: SURELY, ..options }, 1.0 / deviation)
            }
            Noise::Declared(share) => {
                (TrendOptions { scatter: options.scatter.max(BEYOND_NOISE * share), ..options }, 0.0)
            }
            Noise::Unknown => (options, 0.0),
        };
        Trend {
            options,
            noise,
            per_deviation,
            gain_per_second: 1.0 / options.span.seconds(),
            most_gain: 1.0 / f64::from(options.least.max(1)),
            before: None,
            drift: Drift::new(&options, noise),
            scatter: Scatter::new(&options),
            skew: Skew::new(&options),
            alarm: Tendency::Calm,
            raised: Time::MIN,
            in_conflict: false,
        }
    }

    /// Forgets everything but the usual difference.
    pub fn forget(&mut self) {
        let before = self.drift;
        self.begin_anew();
        self.drift.keep_usual(&before);
    }

    /// Forgets everything.
    pub(super) fn begin_anew(&mut self) {
        *self = Trend::empty(self.options, self.noise);
    }

    /// The usual difference, SI; 0 until it is known.
    pub(super) fn usual(&self) -> f64 {
        self.drift.usual()
    }

    /// The largest deviation of the differences by declared noise, SI; 0 where no noise is declared.
    pub(super) fn deviation(&self, tolerance: f64) -> f64 {
        match self.noise {
            Noise::Known(deviation) => deviation,
            Noise::Declared(share) => share * tolerance,
            Noise::Unknown => 0.0,
        }
    }

    /// Takes in a comparison.
    // Called with every comparison from two places: `inline` alone would not inline it.
    #[inline(always)]
    pub fn record(&mut self, value: &Measured, other: &Measured, validity: Validity, now: Time) {
        let tolerance = 0.5 * (value.width() + other.width());
        let (difference, middle) = (value.middle() - other.middle(), other.middle());
        // Divisions are the main cost: one serves for all shares of the tolerance.
        let per_tolerance = 1.0 / tolerance;
        let share = difference * per_tolerance;
        // An infinite tolerance has no shares, and shares of a zero tolerance are not numbers.
        if !(per_tolerance > 0.0 && share.abs() < f64::INFINITY) {
            return;
        }
        // The tolerance grows where the plant moves, as it includes a hull of neighbours; noise does not.
        let (shares, largest) = match self.noise {
            Noise::Known(_) => (self.per_deviation, WILD),
            Noise::Unknown | Noise::Declared(_) => (per_tolerance, AT_ONCE),
        };
        let clipped = (difference * shares).clamp(-largest, largest);
        let time = validity.to;
        let before = self.before.replace(Before { time, tolerance, share, clipped, other: middle });
        let Some(before) = before.filter(|before| before.time < time) else { return };
        let elapsed = (time - before.time).seconds();
        let gain = self.gain(elapsed);
        match self.noise {
            Noise::Known(_) => {
                let (per_deviation, scatter) = (self.per_deviation, self.scatter.variance);
                self.drift.accumulate_beyond(difference, share, per_deviation, scatter);
            }
            Noise::Unknown | Noise::Declared(_) => self.drift.accumulate(difference, share, shares, gain),
        }
        self.scatter.record(clipped, before.clipped, elapsed);
        let gain = gain / TREND_MEMORY;
        self.drift.average(difference, gain);
        if !matches!(self.noise, Noise::Unknown) {
            // Clipped by the tolerance: a shift in time may be many deviations wide.
            let apart = difference.clamp(-AT_ONCE * tolerance, AT_ONCE * tolerance) * shares;
            let slope = (middle - before.other) * shares / elapsed;
            self.skew.record(apart, slope, gain);
        }
        if self.drift.settled.is_none() && !self.in_conflict {
            self.drift.learn(time);
        }
        if !self.stays_calm() {
            self.raise(now);
        }
    }

    /// The weight of a comparison in a mean, and the share of an alarm that twice the allowance adds.
    fn gain(&self, elapsed: f64) -> f64 {
        smaller(elapsed * self.gain_per_second, self.most_gain)
    }

    /// Whether there is no alarm and none is near: the most frequent case, tested quickly.
    fn stays_calm(&self) -> bool {
        self.alarm == Tendency::Calm
            && self.drift.stays_calm()
            && self.scatter.stays_calm()
            && self.skew.stays_calm()
    }

    #[inline(never)]
    fn raise(&mut self, now: Time) {
        let held = |alarm| if self.alarm == alarm { HALF } else { 1.0 };
        let drift = self.drift.nearness();
        let noise = self.scatter.nearness();
        let skew = if self.drift.rests_on_enough() { self.skew.nearness(held(Tendency::Skew)) } else { 0.0 };
        let alarm = if skew > held(Tendency::Skew) {
            Tendency::Skew
        } else if drift >= 1.0 || (self.alarm == Tendency::Drift && drift > 0.0) {
            Tendency::Drift
        } else if noise > held(Tendency::Noise) {
            Tendency::Noise
        } else if self.drift.is_open() || noise.max(skew) > HALF {
            Tendency::Building
        } else {
            Tendency::Calm
        };
        if alarm.is_alarm() && !self.alarm.is_alarm() {
            self.raised = now;
        }
        self.alarm = alarm;
    }

    /// Notes a conflict of single comparisons: while it lasts, the trend is not evaluated.
    pub fn engage(&mut self) {
        if !self.in_conflict {
            self.drift.settle();
            self.drift.note();
            self.skew.note(self.alarm == Tendency::Skew, self.drift.rests_on_enough());
        }
        self.drift.sums = [0.0; 2];
        self.in_conflict = true;
    }

    /// Notes that single comparisons agree: means gathered during a conflict are forgotten.
    pub fn relax(&mut self) {
        if self.in_conflict {
            self.forget();
        }
    }

    /// The present trend; [`Tendency::Calm`] where the noise is not declared, as the trend may not accuse then.
    #[must_use]
    pub fn tendency(&self) -> Tendency {
        if matches!(self.noise, Noise::Unknown) { Tendency::Calm } else { self.alarm }
    }

    /// The present trend where it may not accuse, as the noise is not declared.
    #[must_use]
    pub fn note(&self) -> Option<Note> {
        match self.alarm {
            _ if self.noise != Noise::Unknown => None,
            Tendency::Drift => Some(Note::Drift { mean: self.mean(), parts_in: self.parts_in() }),
            Tendency::Noise => Some(Note::Scatter),
            Tendency::Skew | Tendency::Building | Tendency::Calm => None,
        }
    }

    /// The time until the mean difference reaches the tolerance, at its pace since the usual difference was final.
    fn parts_in(&self) -> Option<Span> {
        let before = self.before?;
        self.drift.parts_in(before.tolerance, before.time)
    }

    /// How long a difference must last to be a drift.
    #[must_use]
    pub fn span(&self) -> Span {
        self.options.span
    }

    /// How long an alarm may take after the first sign, for comparisons every `period`.
    #[must_use]
    pub fn latency(&self, period: Span) -> Span {
        self.options.span.max(period.times(i64::from(self.options.least)))
    }

    /// The last difference as a share of the tolerance.
    pub(super) fn last_share(&self) -> f64 {
        self.before.map_or(0.0, |before| before.share.abs())
    }

    /// When the trend became an alarm.
    #[must_use]
    pub fn raised(&self) -> Time {
        self.raised
    }

    /// The recent mean difference, SI.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.drift.mean()
    }

    /// How late the first way is beside the other; `None` where no shift in time explains the differences.
    #[must_use]
    pub fn skew(&self) -> Option<Span> {
        self.skew.late()
    }

    /// The character of the differences, for comparisons that are in conflict.
    #[must_use]
    pub fn character(&self) -> Tendency {
        if self.alarm == Tendency::Drift || self.drift.had_begun() {
            Tendency::Drift
        } else if self.alarm == Tendency::Skew || self.skew.was_shifted() {
            Tendency::Skew
        } else if self.scatter.alternates() {
            Tendency::Noise
        } else {
            Tendency::Calm
        }
    }
}

/// The smaller of two numbers.
#[inline]
fn smaller(one: f64, other: f64) -> f64 {
    if one < other { one } else { other }
}

/// Moves a mean towards a value.
#[inline]
fn approach(mean: &mut f64, value: f64, gain: f64) {
    *mean += gain * (value - *mean);
}
