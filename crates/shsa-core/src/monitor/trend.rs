//! What many comparisons of two ways say together although each single one agrees: drift, scatter, skew in time.
//!
//! All figures are shares of the tolerance: half the sum of both widths. A difference of 1 is where the intervals part. Where
//! the noise of both is known, they are multiples of its deviation.

mod recall;

pub use recall::TrendRecord;

use crate::interval::Interval;
use crate::time::{Span, Time, Validity};

/// Settings of the detectors that go by many comparisons; the defaults are sound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrendOptions {
    /// A difference, and its change since the beginning, up to this share of the tolerance is no drift.
    pub allowance: f64,
    /// How long a difference of twice the allowance must last to be a drift (at least two windows of a difference
    /// quotient, as it says the same for as long as one), and
    pub span: Span,
    /// how many comparisons it must take at least.
    pub least: u32,
    /// The scatter from one comparison to the next, as a standard deviation, that is noise beyond the declared errors.
    pub scatter: f64,
    /// The root mean square difference that must be explained by a shift in time to be one.
    pub skew: f64,
}

/// What the model says of the noise of two ways that are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Noise {
    /// Nothing, of one signal at least: all patterns within the bounds are sound, and what shows in them is a note.
    #[default]
    Unknown,
    /// It is declared of every signal, but not what becomes of it: the limits are shares of the tolerance.
    Declared,
    /// The standard deviation of the difference of both, SI.
    Known(f64),
}

impl Default for TrendOptions {
    fn default() -> TrendOptions {
        TrendOptions { allowance: 0.5, span: Span::from_millis(5_000), least: 64, scatter: 0.4, skew: 0.4 }
    }
}

/// Scatter shows at once, when there are enough comparisons.
const QUICK: Span = Span::from_millis(1_000);
/// So many comparisons are enough for that.
const FEW: f64 = 16.0;
/// Scatter of so many times the declared noise is beyond it: of white noise the estimate over the 64 comparisons that it goes
/// over at least is never so far off.
const BEYOND: f64 = 2.0;
/// Where the noise is declared, a difference that is further from what is usual than so many deviations comes together,
const STEP: f64 = 0.75;
/// to a drift when it is so many in all: white noise comes to that once in some hundred million comparisons (the average run
/// length of a cumulative sum, D. Siegmund, Sequential Analysis, 1985, doi:10.1007/978-1-4757-1862-1).
const ENOUGH: f64 = 12.0;
/// No single difference counts as more deviations than this: what is wild once is neither a drift nor scatter.
const WILD: f64 = 4.0;
/// A root mean square difference of so many deviations may be a shift in time, when that explains it.
const SHIFTED: f64 = 3.0;
/// Means go over so many times as many comparisons as a drift takes at least.
const MEMORY: f64 = 4.0;
/// Means that rest on less are none.
const FULL: f64 = 0.5;
/// Where the noise is declared, a quarter of them says early what is usual, as the noise says how wrong that may be.
const EARLY: f64 = 0.2;
/// Differences count at most so many tolerances, as one wild value is no trend.
const LARGEST: f64 = 1.5;
/// A drift that has come so far towards an alarm may yet become one, and scatter or skew from half of it on.
const OPEN: f64 = 0.25;
const HALF: f64 = 0.5;
/// A drift that had come so far when comparisons began to disagree is why they do.
const BEGUN: f64 = 0.25;
/// An alarm about scatter or skew ends below this share of its limit.
const HYSTERESIS: f64 = 0.5;
/// The share of the differences' squares that a shift in time must explain.
const EXPLAINED: f64 = 0.8;
/// The share of the differences' squares that changes from one to the next, from which on they are noise.
const ALTERNATING: f64 = 0.75;

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

/// What many comparisons say together and the declared bounds allow: it accuses nobody.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Note {
    /// The mean difference, SI, lasts; and how long it takes at this pace until the two ways part.
    Drift {
        /// The first minus the second.
        mean: f64,
        /// `None` where it does not grow.
        parts_in: Option<Span>,
    },
    /// The differences scatter.
    Scatter,
}

/// A value with what comparisons ask of it, found once however many there are.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// The value, SI.
    pub value: Interval,
    middle: f64,
    width: f64,
}

impl Measured {
    /// Finds the middle and the width.
    #[inline]
    #[must_use]
    pub fn of(value: Interval) -> Measured {
        Measured { value, middle: value.midpoint(), width: value.width() }
    }

    /// The same bounds around another best guess.
    pub(super) fn with_guess(self, guess: Option<f64>) -> Measured {
        Measured { middle: guess.unwrap_or(self.middle), ..self }
    }

    /// What it says with a margin on both sides: the middle is the same.
    #[inline]
    pub(super) fn widened(&self, margin: f64) -> Measured {
        let value = self.value.widened(margin);
        Measured { value, middle: self.middle, width: self.width + 2.0 * margin }
    }

    /// Its middle, SI.
    pub(super) fn middle(&self) -> f64 {
        self.middle
    }

    /// Its width, SI.
    pub(super) fn width(&self) -> f64 {
        self.width
    }
}

/// The comparison before.
#[derive(Clone, Copy, Debug)]
struct Before {
    time: Time,
    /// Half the sum of both widths, SI, and the difference as a share of that,
    tolerance: f64,
    share: f64,
    /// and in the unit of all figures, clipped.
    clipped: f64,
    /// The middle of the other way's value, SI.
    other: f64,
}

/// Sums of many comparisons of two ways.
#[derive(Clone, Copy, Debug)]
pub struct Trend {
    options: TrendOptions,
    noise: Noise,
    /// One over the deviation of the noise, where that is known.
    per_deviation: f64,
    /// The share of a mean that a second of comparisons replaces, and the most that one comparison does.
    gain_per_second: f64,
    most_gain: f64,
    /// Below these, scatter and squares come near to nothing.
    calm_scatter: f64,
    calm_square: f64,
    before: Option<Before>,
    /// Cumulative sums (CUSUM, E. S. Page, Continuous Inspection Schemes, 1954, doi:10.1093/biomet/41.1-2.100) of
    /// differences beyond the allowance, above and below; an alarm at 1.
    sums: [f64; 2],
    /// The mean difference at the beginning, SI: two sensors may differ for good within their errors.
    usual: Option<f64>,
    /// Since when that is known for good; until then it follows the mean once that rests on enough.
    settled: Option<Time>,
    enough: f64,
    /// When the alarm was raised.
    raised: Time,
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
    /// Whether a shift in time explained the differences until then.
    was_shifted: bool,
}

impl Trend {
    /// Nothing compared yet; each comparison tells about so long a window.
    #[must_use]
    pub fn new(options: TrendOptions, window: Span, noise: Noise) -> Trend {
        let span = options.span.max(window.times(2));
        Trend::empty(TrendOptions { span, ..options }, noise)
    }

    fn empty(options: TrendOptions, noise: Noise) -> Trend {
        let (options, per_deviation) = match noise {
            Noise::Known(deviation) => {
                (TrendOptions { scatter: BEYOND, skew: SHIFTED, ..options }, 1.0 / deviation)
            }
            Noise::Unknown | Noise::Declared => (options, 0.0),
        };
        Trend {
            options,
            noise,
            per_deviation,
            gain_per_second: 1.0 / options.span.seconds(),
            most_gain: 1.0 / f64::from(options.least.max(1)),
            calm_scatter: HALF * (options.scatter * options.scatter),
            calm_square: HALF * (options.skew * options.skew),
            before: None,
            sums: [0.0; 2],
            usual: None,
            settled: None,
            enough: if matches!(noise, Noise::Known(_)) { EARLY } else { FULL },
            raised: Time::MIN,
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
            was_shifted: false,
        }
    }

    /// Forgets everything but how the two usually differ.
    pub fn forget(&mut self) {
        // It is not learnt anew from what follows a fault.
        let settled = self.settled.or(self.usual.map(|_| Time::MIN));
        *self = Trend { usual: self.usual, settled, ..Trend::empty(self.options, self.noise) };
    }

    /// Forgets everything.
    pub(super) fn begin_anew(&mut self) {
        *self = Trend::empty(self.options, self.noise);
    }

    /// Whether it goes by the noise that is declared, and so by the best guess of both values.
    pub(super) fn goes_by_noise(&self) -> bool {
        matches!(self.noise, Noise::Known(_))
    }

    /// Takes a comparison in.
    // Once for every observation or comparison, from two places: by a hint alone it would be called.
    #[inline(always)]
    pub fn record(&mut self, value: &Measured, other: &Measured, validity: Validity, now: Time) {
        let tolerance = 0.5 * (value.width + other.width);
        let (difference, middle) = (value.middle - other.middle, other.middle);
        // Divisions are what this costs: one for all shares of the tolerance.
        let per_tolerance = 1.0 / tolerance;
        let share = difference * per_tolerance;
        // A tolerance that is infinite has none, and of one that is zero they are no numbers.
        if !(per_tolerance > 0.0 && share.abs() < f64::INFINITY) {
            return;
        }
        // A hull of neighbours is wider where the plant moves: noise is not.
        let (shares, largest) = match self.noise {
            Noise::Known(_) => (self.per_deviation, WILD),
            Noise::Unknown | Noise::Declared => (per_tolerance, LARGEST),
        };
        let clipped = (difference * shares).clamp(-largest, largest);
        let time = validity.to;
        let before = self.before.replace(Before { time, tolerance, share, clipped, other: middle });
        let Some(before) = before.filter(|before| before.time < time) else { return };
        let elapsed = (time - before.time).seconds();
        let gain = self.gain(elapsed);
        match self.noise {
            Noise::Known(_) => self.accumulate_beyond(difference, share),
            Noise::Unknown | Noise::Declared => self.accumulate(share, shares, gain),
        }
        let change = clipped - before.clipped;
        let quick = smaller(elapsed / QUICK.seconds(), 1.0 / FEW) / MEMORY;
        approach(&mut self.scatter, 0.5 * change * change, quick);
        approach(&mut self.recent, clipped * clipped, quick);
        let gain = gain / MEMORY;
        approach(&mut self.mean, difference, gain);
        approach(&mut self.weight, 1.0, gain);
        if !matches!(self.noise, Noise::Unknown) {
            // A shift in time may be many deviations wide.
            let apart = difference.clamp(-LARGEST * tolerance, LARGEST * tolerance) * shares;
            approach(&mut self.square, apart * apart, gain);
            let slope = (middle - before.other) * shares / elapsed;
            approach(&mut self.slope_slope, slope * slope, gain);
            approach(&mut self.slope_difference, slope * apart, gain);
        }
        if self.settled.is_none() && self.weight > self.enough {
            self.usual = Some(self.mean / self.weight);
            self.settled = (self.weight > FULL).then_some(time);
        }
        if !self.stays_calm() {
            self.raise(now);
        }
    }

    /// The share of a mean that a comparison replaces, and of an alarm that twice the allowance adds.
    fn gain(&self, elapsed: f64) -> f64 {
        smaller(elapsed * self.gain_per_second, self.most_gain)
    }

    /// Adds what exceeds the allowance; what disagrees outright is for the single comparisons to tell.
    #[inline]
    fn accumulate(&mut self, share: f64, shares: f64, gain: f64) {
        let allowance = self.options.allowance;
        let [above, below] = self.sums;
        if share.abs() <= allowance && above + below == 0.0 {
            // Most often: there is nothing to add, whatever is usual, and nothing to take from.
            return;
        }
        self.add_excess(share, shares, gain);
    }

    #[inline(never)]
    fn add_excess(&mut self, share: f64, shares: f64, gain: f64) {
        let allowance = self.options.allowance;
        let Some(usual) = self.usual.filter(|_| share.abs() <= 1.0) else { return };
        let share = common(share, share - usual * shares);
        for (sum, share) in self.sums.iter_mut().zip([share, -share]) {
            *sum = (*sum + gain * (share - allowance) / allowance).clamp(0.0, 1.0);
        }
    }

    /// Adds what exceeds the declared noise, from what is usual; what disagrees outright is for the single comparisons to tell.
    fn accumulate_beyond(&mut self, difference: f64, share: f64) {
        let Some(usual) = self.usual.filter(|_| share.abs() <= 1.0) else { return };
        let beyond = ((difference - usual) * self.per_deviation).clamp(-WILD, WILD);
        // What scatters more than it should comes together by chance.
        let step = STEP * self.scatter.max(1.0);
        for (sum, beyond) in self.sums.iter_mut().zip([beyond, -beyond]) {
            *sum = (*sum + (beyond - step) / ENOUGH).clamp(0.0, 1.0);
        }
    }

    /// Whether nothing has come together, and nothing comes near to it: most often, and quickly seen.
    fn stays_calm(&self) -> bool {
        let [above, below] = self.sums;
        self.alarm == Tendency::Calm
            && above <= OPEN
            && below <= OPEN
            && self.scatter <= self.calm_scatter
            && self.square <= self.calm_square
    }

    #[inline(never)]
    fn raise(&mut self, now: Time) {
        let scatter = self.options.scatter;
        let held = |alarm| if self.alarm == alarm { HYSTERESIS } else { 1.0 };
        let largest = self.largest_sum();
        let (noise, shifted) =
            (self.scatter / (scatter * scatter), self.shifted(held(Tendency::Skew)) / self.limit_of_skew());
        let alarm = if shifted > held(Tendency::Skew) {
            Tendency::Skew
        } else if largest >= 1.0 || (self.alarm == Tendency::Drift && largest > 0.0) {
            Tendency::Drift
        } else if noise > held(Tendency::Noise) {
            Tendency::Noise
        } else if largest > OPEN || noise.max(shifted) > HALF {
            Tendency::Building
        } else {
            Tendency::Calm
        };
        let is_raised = |tendency| !matches!(tendency, Tendency::Calm | Tendency::Building);
        if is_raised(alarm) && !is_raised(self.alarm) {
            self.raised = now;
        }
        self.alarm = alarm;
    }

    fn limit_of_skew(&self) -> f64 {
        self.options.skew * self.options.skew
    }

    /// The mean square difference where a shift in time explains it; a mean over few comparisons is none.
    fn shifted(&self, held: f64) -> f64 {
        if self.weight > self.enough && self.explained() > EXPLAINED * held { self.square } else { 0.0 }
    }

    /// Single comparisons are in conflict: while they are, there is nothing to add.
    pub fn engage(&mut self) {
        if !self.in_conflict {
            self.drifted = self.largest_sum();
            self.was_shifted =
                self.alarm == Tendency::Skew || self.shifted(HYSTERESIS) > HALF * self.limit_of_skew();
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

    /// What has come together that may accuse: nothing while the noise is not declared.
    #[must_use]
    pub fn tendency(&self) -> Tendency {
        if matches!(self.noise, Noise::Unknown) { Tendency::Calm } else { self.alarm }
    }

    /// What has come together where nothing of it may accuse.
    #[must_use]
    pub fn note(&self) -> Option<Note> {
        match self.alarm {
            _ if self.noise != Noise::Unknown => None,
            Tendency::Drift => Some(Note::Drift { mean: self.mean(), parts_in: self.parts_in() }),
            Tendency::Noise => Some(Note::Scatter),
            Tendency::Skew | Tendency::Building | Tendency::Calm => None,
        }
    }

    /// How long it takes until the mean difference is as large as the tolerance, at its pace since what is usual was learnt.
    fn parts_in(&self) -> Option<Span> {
        let (before, usual, settled) = (self.before?, self.usual?, self.settled?);
        let mean = self.mean();
        let pace = (mean - usual) / (before.time - settled).seconds();
        let seconds = (before.tolerance - mean.abs()) / (pace * mean.signum());
        (seconds.is_finite() && seconds > 0.0).then(|| Span::from_seconds(seconds))
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

    /// How far apart the two were at the last comparison.
    pub(super) fn last_share(&self) -> f64 {
        self.before.map_or(0.0, |before| before.share.abs())
    }

    /// When what has come together became enough.
    #[must_use]
    pub fn raised(&self) -> Time {
        self.raised
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
        } else if self.alarm == Tendency::Skew || self.was_shifted {
            Tendency::Skew
        } else if self.scatter > ALTERNATING * self.recent {
            Tendency::Noise
        } else {
            Tendency::Calm
        }
    }
}

/// What two numbers have in common: nothing when they have different signs, else the smaller one.
fn common(one: f64, other: f64) -> f64 {
    if one * other <= 0.0 {
        0.0
    } else if one.abs() < other.abs() {
        one
    } else {
        other
    }
}

/// The smaller of two numbers.
fn smaller(one: f64, other: f64) -> f64 {
    if one < other { one } else { other }
}

/// Moves a mean towards a value.
fn approach(mean: &mut f64, value: f64, gain: f64) {
    *mean += gain * (value - *mean);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PERIOD_S: f64 = 0.1;

    /// Compares a value of half-width 0.5 with another one; the differences are shares of the tolerance.
    fn after(
        count: usize,
        mut difference: impl FnMut(f64) -> f64,
        mut truth: impl FnMut(f64) -> f64,
    ) -> (Trend, f64) {
        let mut trend = Trend::new(TrendOptions::default(), Span::ZERO, Noise::Declared);
        for number in 0..count {
            let seconds = number as f64 * PERIOD_S;
            let now = Time::from_seconds(seconds);
            let around = |middle: f64| Interval::new(middle - 0.5, middle + 0.5);
            let validity = Validity { from: now, to: now };
            let (value, other) = (around(truth(seconds) + difference(seconds)), around(truth(seconds)));
            trend.record(&Measured::of(value), &Measured::of(other), validity, now);
            if !matches!(trend.tendency(), Tendency::Calm | Tendency::Building) {
                return (trend, seconds);
            }
        }
        (trend, f64::INFINITY)
    }

    /// Numbers in [-1, 1] from a simple generator.
    fn noise() -> impl FnMut() -> f64 {
        let mut state = 1u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
        }
    }

    #[test]
    fn a_slow_drift_is_found_while_single_comparisons_agree() {
        let mut noise = noise();
        let (trend, seconds) = after(10_000, |seconds| 0.01 * seconds + 0.3 * noise(), |_| 0.0);
        assert_eq!(trend.tendency(), Tendency::Drift);
        assert!((40.0..97.0).contains(&seconds), "{seconds}");
        assert!((0.4..0.85).contains(&trend.mean()), "{}", trend.mean());
        assert_eq!(trend.raised(), Time::from_seconds(seconds));
    }

    #[test]
    fn a_difference_that_has_always_been_there_is_no_drift() {
        let (_, seconds) = after(10_000, |_| 0.8, |_| 0.0);
        assert!(seconds.is_infinite());
    }

    #[test]
    fn noise_beyond_the_errors_is_found_and_within_them_not() {
        let mut large = noise();
        let (trend, seconds) = after(1_000, |_| 0.95 * large(), |_| 0.0);
        assert_eq!(trend.tendency(), Tendency::Noise);
        assert!(seconds < 20.0, "{seconds}");
        let mut small = noise();
        let (trend, seconds) = after(10_000, |_| 0.5 * small(), |_| 0.0);
        assert!(seconds.is_infinite(), "{trend:?}");
    }

    #[test]
    fn a_shift_in_time_is_found_with_its_length() {
        let truth = |seconds: f64| 2.0 * libm::sin(seconds);
        let (trend, _) = after(10_000, |seconds| truth(seconds - 0.4) - truth(seconds), truth);
        assert_eq!(trend.tendency(), Tendency::Skew);
        let skew = trend.skew().unwrap().seconds();
        assert!((0.3..0.5).contains(&skew), "{skew}");
    }

    #[test]
    fn a_jump_has_no_character_of_its_own() {
        let (trend, seconds) = after(1_000, |seconds| if seconds < 50.0 { 0.0 } else { 3.0 }, |_| 0.0);
        assert!(seconds.is_infinite());
        assert_eq!(trend.character(), Tendency::Calm);
    }

    #[test]
    fn a_drift_is_over_when_the_difference_is() {
        let (mut trend, _) = after(10_000, |seconds| 0.01 * seconds, |_| 0.0);
        for number in 0..100 {
            let now = Time::from_seconds(1e4 + PERIOD_S * f64::from(number));
            let value = Interval::new(-0.5, 0.5);
            trend.record(&Measured::of(value), &Measured::of(value), Validity { from: now, to: now }, now);
        }
        assert_eq!(trend.tendency(), Tendency::Calm);
    }

    proptest! {
        #[test]
        fn what_stays_within_the_allowance_is_calm(
            offset in -0.35..0.35_f64, own in proptest::collection::vec(-0.05..0.05_f64, 50..400),
        ) {
            let mut own = own.into_iter().cycle();
            let (trend, _) = after(2_000, |_| offset + own.next().unwrap(), |seconds| seconds);
            prop_assert!(trend.tendency() != Tendency::Drift && trend.tendency() != Tendency::Noise);
        }

        #[test]
        fn it_takes_anything(values in proptest::collection::vec((any::<f64>(), any::<f64>(), any::<i64>()), 0..60)) {
            let mut trend = Trend::new(TrendOptions::default(), Span::ZERO, Noise::Declared);
            for (one, other, time) in values {
                let moment = Validity { from: Time(time), to: Time(time) };
                let around = |value: f64| Interval::new(value - 1.0, value + 1.0);
                let (one, other) = (Measured::of(around(one)), Measured::of(around(other)));
                trend.record(&one, &other, moment, Time(time));
                prop_assert!(trend.mean().is_finite() || trend.mean().is_infinite());
            }
        }
    }
}
