//! The usual time between the values of a source, and when its next value is late.

use crate::numbers::{BRIEF, WILD};
use crate::time::{Span, Time};

/// The weight of a usual gap in the mean (RFC 6298).
const NEWEST: f64 = 1.0 / 8.0;

/// The running mean of the time between two values, and its mean deviation, as TCP knows when to send a segment again
/// (V. Jacobson, Congestion avoidance and control, 1988, doi:10.1145/52324.52356; RFC 6298).
///
/// A gap that is shorter than half of the mean weighs only as much as it is long, as in a mean over time, not over values: the gaps of 0 in
/// a batch do not show how long the next batch takes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    begun: Option<Time>,
    last: Time,
    mean: Option<Span>,
    deviation: Span,
    /// The declared time between two values; zero without one.
    declared: Span,
}

impl Pace {
    /// The pace of a source that is declared to give a value in each period.
    pub(super) fn of(declared: Span) -> Pace {
        Pace { declared, ..Pace::default() }
    }

    /// The declared time between two values; zero without one.
    pub(super) fn declared(&self) -> Span {
        self.declared
    }

    /// Notes the arrival of a value.
    pub(super) fn step(&mut self, now: Time) {
        let Some(begun) = self.begun else {
            (self.begun, self.last) = (Some(now), now);
            return;
        };
        let (known, gap) = (self.last - begun, (now - self.last).max(Span::ZERO));
        self.last = self.last.max(now);
        let Some(mean) = self.mean.filter(|mean| *mean > Span::ZERO) else {
            self.mean = Some(gap);
            self.deviation = Span(gap.0 / 2);
            return;
        };
        let (gap, weight) = if known < BRIEF {
            (gap, share(gap, known + gap))
        } else {
            // A single long silence hardly raises the mean; a source that has become slower does.
            let gap = gap.min(mean.max(self.declared).times(3));
            (gap, NEWEST * share(gap.times(2), mean).min(1.0))
        };
        let off = gap - mean;
        self.mean = Some(mean + part(off, weight));
        self.deviation =
            self.deviation + part(Span(off.0.saturating_abs()) - self.deviation, (2.0 * weight).min(1.0));
    }

    /// Whether it has given a value.
    pub(super) fn has_begun(&self) -> bool {
        self.begun.is_some()
    }

    /// The mean time between two values, no shorter than declared: a few values tell less than the declaration.
    fn usual(&self) -> Option<Span> {
        self.mean.filter(|mean| *mean > Span::ZERO).map(|mean| mean.max(self.declared))
    }

    /// How long after a value the next one is late: three quarters of a mean gap more than the mean, so that nobody waits for
    /// two, or what its jitter asks for.
    fn patience(&self) -> Option<Span> {
        let Span(mean) = self.usual()?;
        let jitter = self.deviation.0.saturating_mul(WILD as i64);
        Some(Span(mean.saturating_add(mean.saturating_sub(mean / 4).max(jitter))))
    }

    /// From when on a stand-in serves because no value comes: when the source is late by its own pace, at most half of the age that
    /// the need allows after its last value; and half a mean gap after the last published value (`served`). A source whose mean gap is
    /// about half of that age has half a gap more, as far as a quarter of the age is left for the stand-in: it is not late each time.
    pub(super) fn late_after(&self, served: Time, max_age: Span) -> Time {
        let half = Span(max_age.0 / 2);
        let slow = self.usual().map_or(half, |mean| mean + Span(mean.0 / 2));
        let most = slow.min(Span(max_age.0 / 4 * 3)).max(half);
        let patience = self.patience().map_or(most, |patience| patience.min(most));
        let rest = self.usual().map_or(most, |mean| Span(mean.0 / 2).min(most));
        let late = (self.begun.map_or(served, |_| self.last) + patience).max(served + rest);
        // What the source gives may be older than what has gone out, and help nobody.
        late.min(served + most)
    }
}

/// A time as a share of another one.
fn share(part: Span, whole: Span) -> f64 {
    part.0 as f64 / (whole.0 as f64).max(1.0)
}

/// A share of a time.
fn part(time: Span, share: f64) -> Span {
    Span((time.0 as f64 * share) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recording may count its time from a trigger.
    #[test]
    fn a_source_is_late_by_its_pace_whatever_the_time_is() {
        let due = |begin: i64| {
            let (mut pace, begin) = (Pace::of(Span::ZERO), Time::from_seconds(begin as f64));
            (0..50).for_each(|at| pace.step(begin + Span::from_millis(100 * at)));
            pace.late_after(begin + Span::from_millis(4_900), Span::from_millis(2_000)) - begin
        };
        assert_eq!([due(-3_600), due(-2), due(1_000_000)], [due(0); 3]);
        assert!(due(0) > Span::from_millis(5_000) && due(0) < Span::from_millis(5_100), "{:?}", due(0));
    }
}
