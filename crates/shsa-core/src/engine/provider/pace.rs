//! The usual time between the values of a source, and when its next value is late.

use crate::numbers::WILD;
use crate::time::{Span, Time};

/// The running mean of the time between two values, and its mean deviation, as TCP knows when to send a segment again
/// (V. Jacobson, Congestion avoidance and control, 1988, doi:10.1145/52324.52356; RFC 6298).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    last: Option<Time>,
    stamp: Time,
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

    /// Notes a value of the source that was true at `stamp`. Values that were held up come at once: they were true at their own
    /// times.
    pub(super) fn step(&mut self, stamp: Time, now: Time) {
        let before = core::mem::replace(&mut self.stamp, stamp);
        let Some(last) = self.last.replace(now) else { return };
        let gap = (now - last).max(stamp - before);
        match &mut self.mean {
            None => {
                self.mean = Some(gap);
                self.deviation = Span(gap.0 / 2);
            }
            Some(mean) => {
                // A single long silence hardly raises the mean; a source that has become slower does.
                let gap = gap.0.min(mean.0.saturating_mul(3));
                let off = gap - mean.0;
                mean.0 += off / 8;
                self.deviation.0 += (off.abs() - self.deviation.0) / 4;
            }
        }
    }

    /// Whether it has given a value.
    pub(super) fn has_begun(&self) -> bool {
        self.last.is_some()
    }

    /// The mean time between two values, no shorter than declared: a few values tell less than the declaration.
    fn usual(&self) -> Option<Span> {
        self.mean.map(|mean| mean.max(self.declared))
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
        let late = (self.last.unwrap_or(served) + patience).max(served + rest);
        // What the source gives may be older than what has gone out, and help nobody.
        late.min(served + most)
    }
}
