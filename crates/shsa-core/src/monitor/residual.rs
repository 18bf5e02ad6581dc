//! Residuals: two ways of knowing the same variable, and their recent comparisons.

mod bends;

use super::WatchedWay;
use super::trend::{Measured, Tendency, Trend};
use super::window::{ResidualState, Window};
use crate::alignment::Known;
use crate::interval::Interval;
use crate::knowledge::SignalSet;
use crate::numbers::MOSTLY;
use crate::time::{Span, Time, Validity};
use bends::Bends;

/// The index of a way of knowing in the monitor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WayIndex(pub u32);

/// The latest comparison in which two ways disagreed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement {
    /// When the ways disagreed.
    pub time: Time,
    /// The value of the slower way, SI.
    pub value: Interval,
    /// The value of the faster way at the same moment, SI.
    pub other: Interval,
    /// When the faster way's output ended, where this value rests on its newest one.
    pub(super) output: Option<Time>,
}

/// Two ways of knowing one variable.
#[derive(Clone, Debug)]
pub struct Residual {
    /// The slower way: a comparison is made when it delivers.
    pub way: WayIndex,
    /// The faster way, brought to the moment of the slower one.
    pub other: WayIndex,
    /// The signals that both ways rest on: one of these is faulty when the two disagree.
    pub signals: SignalSet,
    /// Whether a way is an inverse with several branches: it agrees barely also where nothing is wrong.
    pub has_branches: bool,
    /// Whether a value of one of both ways may be a bound only.
    pub(super) may_be_of_bounds: bool,
    /// Whether the trend goes by noise, so that outputs are compared with the line between both neighbours of the faster way: a
    /// comparison waits for the later one.
    pub(super) is_of_lines: bool,
    /// Until when the last line reached, and whether the newest comparison is with the same line again: statistics count it once, as
    /// its errors are the same.
    pub(super) line_ends: Time,
    pub(super) repeats: bool,
    /// How far the values are from these lines.
    pub(super) bends: Bends,
    /// The recent comparisons.
    pub window: Window,
    /// The trend over many comparisons.
    pub trend: Trend,
    /// The last disagreement.
    pub disagreement: Option<Disagreement>,
    /// The sum over time of the differences that disagreed, SI times seconds, and that of the tolerances meanwhile. Of two rates this
    /// is how far the level has moved that cannot have moved.
    pub(super) moved: (f64, f64),
    /// The first moment of the slower way for which the faster way has no value yet.
    pub(super) due: Option<Time>,
    /// The faster way's value at a moment of the slower one, kept for the consensus.
    pub(super) known: Option<(Validity, Measured)>,
    /// The number of comparisons made.
    pub made: u64,
    /// Whether the two have ever agreed.
    pub(super) has_agreed: bool,
    /// The number of comparisons that were possible before the pair was watched.
    pub(super) before: u64,
}

/// What a comparison changes in a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct ResidualRecord {
    /// Whether the relationship has changed or has become sure.
    pub(super) changed: bool,
    /// Whether the pair [is restless](Residual::is_restless), where that has changed.
    pub(super) restless: Option<bool>,
}

impl Residual {
    /// The faster way's value beside an output of the slower one; see [`WatchedWay::beside`].
    #[inline]
    pub(super) fn beside(&self, slower: &WatchedWay, faster: &WatchedWay, moment: Validity) -> Known {
        if self.is_of_lines && faster.ends_before(moment) {
            return Known::Later;
        }
        faster.beside(slower, moment)
    }

    /// The value beside an output, with the best guess as its middle where the trend goes by noise. Where nothing can be guessed, the
    /// difference is the usual one.
    #[inline]
    pub(super) fn guessed(
        &mut self,
        slower: &WatchedWay,
        faster: &WatchedWay,
        output: &Measured,
        known: Measured,
        moment: Validity,
    ) -> Measured {
        if !self.is_of_lines {
            return known;
        }
        let line = faster.line(moment, output.value).filter(|_| !slower.lags() && !faster.lags());
        let Some(line) = line else {
            self.repeats = false;
            return known.with_guess(output.middle() - self.trend.usual());
        };
        let ends = moment.centre() + line.until();
        self.repeats = ends <= self.line_ends;
        self.line_ends = ends;
        if !self.repeats {
            let deviation = self.trend.deviation(0.5 * (output.width() + known.width()));
            self.bends.take(line.bulge, deviation);
        }
        let usual = output.middle() - self.trend.usual();
        known.with_guess(faster.guess(&line, usual, moment, self.bends.most()))
    }

    /// Takes in a comparison. `output`: when the faster way's output ended, where the value rests on its newest one: where the next ones were
    /// refused, one wrong output disagrees with several of the slower way, and is evidence once.
    // Called with every comparison from two places: `inline` alone would not inline it.
    #[inline(always)]
    pub(super) fn record(
        &mut self,
        value: &Measured,
        other: &Measured,
        validity: Validity,
        now: Time,
        output: impl FnOnce() -> Option<Time>,
    ) -> ResidualRecord {
        self.made += 1;
        let disagrees = !value.value.overlaps(other.value);
        self.has_agreed |= !disagrees;
        let was_restless = self.is_restless();
        let (before, is_surer) = if disagrees || was_restless {
            let output = if disagrees { output() } else { None };
            if output.is_some() && self.disagreement.is_some_and(|last| last.output == output) {
                return ResidualRecord { changed: false, restless: None };
            }
            self.look_closely(disagrees, value, other, output, now)
        } else {
            // The most frequent case: no recent disagreement, and none now.
            self.trend.relax();
            (self.window.record(false, false, now), false)
        };
        if !self.repeats {
            self.trend.record(value, other, validity, now);
        }
        let tendency = self.trend.tendency();
        let is_restless = self.window.is_restless() || tendency != Tendency::Calm;
        ResidualRecord {
            changed: is_surer || before != together(self.window.latest_state(), tendency),
            restless: (was_restless != is_restless).then_some(is_restless),
        }
    }

    /// Takes in a comparison with a range, of which no trend can be seen.
    pub(super) fn record_apart(&mut self, value: &Measured, range: &Measured, now: Time) -> ResidualRecord {
        self.made += 1;
        let was_restless = self.is_restless();
        let (before, is_surer) =
            self.look_closely(!value.value.overlaps(range.value), value, range, None, now);
        let is_restless = self.window.is_restless();
        ResidualRecord {
            changed: is_surer || before != self.window.latest_state(),
            restless: (was_restless != is_restless).then_some(is_restless),
        }
    }

    /// Takes in a comparison where the values disagree, or did recently. Returns the relationship before, and whether it has
    /// become [sure](Residual::is_sure).
    #[inline(never)]
    fn look_closely(
        &mut self,
        disagrees: bool,
        value: &Measured,
        other: &Measured,
        output: Option<Time>,
        now: Time,
    ) -> (ResidualState, bool) {
        let was_sure = self.is_sure();
        let is_above = value.value.lo() > other.value.lo();
        let before = together(self.window.record(disagrees, is_above, now), self.trend.tendency());
        if disagrees {
            self.disagreement =
                Some(Disagreement { time: now, value: value.value, other: other.value, output });
            let seconds = self.window.period().seconds();
            self.moved.0 += seconds * (value.middle() - other.middle());
            self.moved.1 += 0.5 * seconds * (value.width() + other.width());
        }
        match self.window.latest_state() {
            ResidualState::Agree => self.trend.relax(),
            ResidualState::Conflict => {
                self.window.note_conflict(now, self.trend.span());
                self.trend.engage();
            }
            ResidualState::Undecided | ResidualState::Unknown => {}
        }
        (before, !was_sure && self.is_sure())
    }

    /// Whether a conflict cannot be chance: a value beyond its bound is a proof, but with noise two outliers may coincide.
    pub(crate) fn is_sure(&self) -> bool {
        self.window.is_sure() || self.trend.tendency().is_alarm()
    }

    /// The present relationship, from single comparisons and their trend.
    #[must_use]
    pub fn residual_state(&self, now: Time) -> ResidualState {
        together(self.window.residual_state(now), self.trend.tendency())
    }

    /// Whether a recent comparison disagrees, or a trend shows: without these the pair is neither undecided nor in conflict.
    pub(super) fn is_restless(&self) -> bool {
        self.window.is_restless() || self.trend.tendency() != Tendency::Calm
    }

    /// When the single disagreements began, or when the trend became an alarm.
    #[must_use]
    pub fn onset(&self, now: Time) -> Time {
        let single = self.window.residual_state(now);
        if single == self.residual_state(now) { self.window.onset() } else { self.trend.raised() }
    }

    /// The onset of the first of the recurrent conflicts that led to this one, where there were such; else [`Self::onset`].
    #[must_use]
    pub fn recurs_since(&self, now: Time) -> Time {
        match self.window.residual_state(now) {
            ResidualState::Conflict => self.window.recurs_since(),
            _ => self.onset(now),
        }
    }

    /// The sum over time of the differences that disagreed, and of their tolerances: SI times seconds.
    #[must_use]
    pub fn moved(&self) -> [f64; 2] {
        [self.moved.0, self.moved.1]
    }

    /// Goes on from remembered sums; numbers that are impossible are ignored.
    pub(super) fn recall_moved(&mut self, [sum, tolerance]: [f64; 2]) {
        if sum.is_finite() && tolerance.is_finite() {
            self.moved = (sum, tolerance);
        }
    }

    /// Whether the differences that disagreed have cancelled each other, within the tolerance. A level of which two rates are compared
    /// is then where it was before: it has come back, or it was left alone.
    #[must_use]
    pub fn has_moved_back(&self) -> bool {
        let (moved, tolerance) = self.moved;
        moved.abs() <= tolerance
    }

    /// Whether a trend shows that may become a conflict.
    #[must_use]
    pub fn is_building(&self) -> bool {
        self.trend.tendency() == Tendency::Building
    }

    /// Whether the last comparison agrees so barely that the next one may disagree.
    #[must_use]
    pub fn is_close(&self) -> bool {
        !self.has_branches && self.trend.last_share() > MOSTLY
    }

    /// Whether the conflict is of the present, and not one that has ended and is only remembered: the newest comparison disagrees, a
    /// trend is an alarm, or disagreements that recur came again lately.
    #[must_use]
    pub fn is_fresh(&self, now: Time) -> bool {
        let lately = self.window.lifetime().max(self.trend.span());
        let came_lately = self.disagreement.is_none_or(|last| now - last.time <= lately);
        self.trend.tendency().is_alarm()
            || self.window.disagrees_now()
            || (self.window.recurs() && came_lately)
    }

    /// How long a conflict takes to show after a fault has begun.
    #[must_use]
    pub fn latency(&self) -> Span {
        match self.trend.tendency() {
            Tendency::Building => self.trend.latency(self.window.period()).max(self.window.latency()),
            _ => self.window.latency(),
        }
    }
}

/// The relationship from single comparisons and the tendency of their trend.
#[inline]
fn together(single: ResidualState, tendency: Tendency) -> ResidualState {
    match (single, tendency) {
        (ResidualState::Unknown, _) => ResidualState::Unknown,
        (_, Tendency::Drift | Tendency::Noise | Tendency::Skew) => ResidualState::Conflict,
        (single, Tendency::Calm | Tendency::Building) => single,
    }
}
