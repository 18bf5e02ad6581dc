//! What many comparisons of two ways say together although each single one agrees: drift, scatter, skew in time.
//!
//! All figures are shares of the tolerance: half the sum of both widths. A difference of 1 is where the intervals part.

use crate::interval::Interval;
use crate::time::{Span, Time, Validity};

/// Settings of the detectors that go by many comparisons; the defaults are sound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrendOptions {
    /// A mean difference up to this share of the tolerance is no drift.
    pub allowance: f64,
    /// How long a difference of twice the allowance must last to be a drift, and
    pub span: Span,
    /// how many comparisons it must take at least.
    pub least: u32,
    /// The scatter from one comparison to the next, as a standard deviation, that is noise beyond the declared errors.
    pub scatter: f64,
    /// The root mean square difference that must be explained by a shift in time to be one.
    pub skew: f64,
}

impl Default for TrendOptions {
    fn default() -> TrendOptions {
        TrendOptions { allowance: 0.5, span: Span::from_millis(5_000), least: 16, scatter: 0.4, skew: 0.4 }
    }
}

/// Scatter shows at once, when there are enough comparisons.
const QUICK: Span = Span::from_millis(1_000);
/// Means go over so many times as many comparisons as a drift takes at least.
const MEMORY: f64 = 4.0;
/// Differences count at most so many tolerances, as one wild value is no trend.
const LARGEST: f64 = 1.5;
/// What has come so far towards an alarm may yet become one.
const OPEN: f64 = 0.25;
/// A drift that had come so far when comparisons began to disagree is why they do.
const BEGUN: f64 = 0.25;
/// An alarm about scatter or skew ends below this share of its limit.
const HYSTERESIS: f64 = 0.5;
/// The share of the differences' squares that a shift in time must explain.
const EXPLAINED: f64 = 0.8;
/// The share of the differences' squares that changes from one to the next, from which on they are noise.
const ALTERNATING: f64 = 0.5;

/// What has come together over many comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tendency {
    /// Nothing.
    Calm,
    /// Too little to count, but it may become more.
    Building,
    /// The mean difference lasts.
    Drift,
    /// Differences scatter.
    Noise,
    /// Differences go with the slope of the values.
    Skew,
}

/// The comparison before.
#[derive(Clone, Copy, Debug)]
struct Before {
    time: Time,
    /// The difference, clipped.
    share: f64,
    /// The middle of the other way's value, SI.
    other: f64,
}

/// Sums of many comparisons of two ways.
#[derive(Clone, Copy, Debug)]
pub struct Trend {
    options: TrendOptions,
    before: Option<Before>,
    /// Cumulative sums (CUSUM) of differences beyond the allowance, above and below; an alarm at 1.
    sums: [f64; 2],
    /// Since when one of the sums is above zero.
    onset: Time,
    /// Means, weighted exponentially: of differences, SI,
    mean: f64,
    /// of their squares, in shares of the tolerance; the same of the last second, and of half the squares of their
    /// changes (von Neumann),
    square: f64,
    recent: f64,
    scatter: f64,
    /// and of the other way's slope (1/s) with itself and with the difference, in the same shares.
    slope_slope: f64,
    slope_difference: f64,
    /// How much these means rest on: 1 when they are full.
    weight: f64,
    alarm: Tendency,
    /// The single comparisons are in conflict; what a drift had come to when that began.
    in_conflict: bool,
    drifted: f64,
}

impl Trend {
    /// Nothing compared yet.
    #[must_use]
    pub fn new(options: TrendOptions) -> Trend {
        Trend {
            options,
            before: None,
            sums: [0.0; 2],
            onset: Time::MIN,
            mean: 0.0,
            square: 0.0,
            recent: 0.0,
            scatter: 0.0,
            slope_slope: 0.0,
            slope_difference: 0.0,
            weight: 0.0,
            alarm: Tendency::Calm,
            in_conflict: false,
            drifted: 0.0,
        }
    }

    /// Forgets everything.
    pub fn forget(&mut self) {
        *self = Trend::new(self.options);
    }

    /// Takes a comparison in.
    pub fn record(&mut self, value: Interval, other: Interval, validity: Validity, now: Time) {
        let tolerance = 0.5 * (value.width() + other.width());
        let (difference, middle) = (value.midpoint() - other.midpoint(), other.midpoint());
        if !(tolerance > 0.0 && tolerance.is_finite() && difference.is_finite()) {
            return;
        }
        let share = difference / tolerance;
        let clipped = share.clamp(-LARGEST, LARGEST);
        let time = validity.to;
        let before = self.before.replace(Before { time, share: clipped, other: middle });
        let Some(before) = before.filter(|before| before.time < time) else { return };
        let elapsed = (time - before.time).seconds();
        self.accumulate(share, elapsed, now);
        let change = clipped - before.share;
        let quick = self.gain(elapsed, QUICK) / MEMORY;
        approach(&mut self.scatter, 0.5 * change * change, quick);
        approach(&mut self.recent, clipped * clipped, quick);
        let gain = self.gain(elapsed, self.options.span) / MEMORY;
        approach(&mut self.mean, difference, gain);
        approach(&mut self.square, clipped * clipped, gain);
        let slope = (middle - before.other) / (tolerance * elapsed);
        approach(&mut self.slope_slope, slope * slope, gain);
        approach(&mut self.slope_difference, slope * clipped, gain);
        approach(&mut self.weight, 1.0, gain);
        self.raise(now);
    }

    /// The share of a mean that a comparison replaces, and of an alarm that twice the allowance adds.
    fn gain(&self, elapsed: f64, span: Span) -> f64 {
        (elapsed / span.seconds()).min(1.0 / f64::from(self.options.least.max(1)))
    }

    /// Adds what exceeds the allowance; what disagrees outright is for the single comparisons to tell.
    fn accumulate(&mut self, share: f64, elapsed: f64, now: Time) {
        if share.abs() > 1.0 {
            return;
        }
        let (allowance, gain) = (self.options.allowance, self.gain(elapsed, self.options.span));
        let was_calm = self.sums == [0.0; 2];
        for (sum, share) in self.sums.iter_mut().zip([share, -share]) {
            *sum = (*sum + gain * (share - allowance) / allowance).clamp(0.0, 1.0);
        }
        if was_calm && self.sums != [0.0; 2] {
            self.onset = now;
        }
    }

    fn raise(&mut self, now: Time) {
        let TrendOptions { scatter, skew, .. } = self.options;
        let held = |alarm| if self.alarm == alarm { HYSTERESIS } else { 1.0 };
        let largest = self.largest_sum();
        let (noise, shifted) =
            (self.scatter / (scatter * scatter), self.shifted(held(Tendency::Skew)) / (skew * skew));
        let alarm = if largest >= 1.0 || (self.alarm == Tendency::Drift && largest > 0.0) {
            Tendency::Drift
        } else if shifted > held(Tendency::Skew) {
            Tendency::Skew
        } else if noise > held(Tendency::Noise) {
            Tendency::Noise
        } else if largest.max(noise).max(shifted) > OPEN {
            Tendency::Building
        } else {
            Tendency::Calm
        };
        if self.alarm == Tendency::Calm && alarm != Tendency::Calm && largest == 0.0 {
            self.onset = now;
        }
        self.alarm = alarm;
    }

    /// The mean square difference where a shift in time explains it; a mean over few comparisons is none.
    fn shifted(&self, held: f64) -> f64 {
        if self.weight > 0.5 && self.explained() > EXPLAINED * held { self.square } else { 0.0 }
    }

    /// Single comparisons disagree. While they are in conflict there is nothing to add.
    pub fn engage(&mut self, in_conflict: bool) {
        if !in_conflict {
            return;
        }
        if !self.in_conflict {
            self.drifted = self.largest_sum();
        }
        self.sums = [0.0; 2];
        self.in_conflict = true;
    }

    /// The single comparisons agree again: what was gathered during their conflict is over.
    pub fn relax(&mut self) {
        if self.in_conflict {
            self.forget();
        }
    }

    fn largest_sum(&self) -> f64 {
        let [above, below] = self.sums;
        above.max(below)
    }

    fn explained(&self) -> f64 {
        let squares = self.slope_slope * self.square;
        if squares > 0.0 { self.slope_difference * self.slope_difference / squares } else { 0.0 }
    }

    /// What has come together.
    #[must_use]
    pub fn tendency(&self) -> Tendency {
        self.alarm
    }

    /// How long an alarm may take after the first sign, for comparisons every `period`.
    #[must_use]
    pub fn latency(&self, period: Span) -> Span {
        self.options.span.max(period.times(i64::from(self.options.least)))
    }

    /// Since when it has come together.
    #[must_use]
    pub fn onset(&self) -> Time {
        self.onset
    }

    /// The mean difference of late, SI.
    #[must_use]
    pub fn mean(&self) -> f64 {
        if self.weight > 0.0 { self.mean / self.weight } else { 0.0 }
    }

    /// How much later than the other the first way tells what happens; `None` where no shift in time explains the
    /// differences.
    #[must_use]
    pub fn skew(&self) -> Option<Span> {
        let is_explained = self.slope_slope > 0.0 && self.explained() > EXPLAINED * HYSTERESIS;
        is_explained.then(|| Span::from_seconds(-self.slope_difference / self.slope_slope))
    }

    /// What the differences look like, for comparisons that are in conflict.
    #[must_use]
    pub fn character(&self) -> Tendency {
        if self.alarm == Tendency::Drift || self.drifted > BEGUN {
            Tendency::Drift
        } else if self.weight > 0.5 && self.explained() > EXPLAINED {
            Tendency::Skew
        } else if self.scatter > ALTERNATING * self.recent {
            Tendency::Noise
        } else {
            Tendency::Calm
        }
    }
}

/// Moves a mean towards a value.
fn approach(mean: &mut f64, value: f64, gain: f64) {
    *mean += gain * (value - *mean);
}
