//! The usual time between the values of a source, and when its next value is late.

use crate::time::{Span, Time};

/// How many mean deviations from its mean the time between two values may be.
const DEVIATIONS: i64 = 4;

/// The running mean of the time between two values, and its mean deviation, as TCP knows when to send a segment again
/// (V. Jacobson, Congestion avoidance and control, 1988, doi:10.1145/52324.52356; RFC 6298).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    last: Option<Time>,
    mean: Option<Span>,
    deviation: Span,
}

impl Pace {
    /// Notes a value of the source.
    pub(super) fn step(&mut self, now: Time) {
        let Some(last) = self.last.replace(now) else { return };
        let gap = now - last;
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

    /// How long after a value the next one is late: three quarters of a mean gap more than the mean, so that nobody waits for
    /// two, or what its jitter asks for.
    fn patience(&self) -> Option<Span> {
        let Span(mean) = self.mean?;
        let jitter = self.deviation.0.saturating_mul(DEVIATIONS);
        Some(Span(mean.saturating_add(mean.saturating_sub(mean / 4).max(jitter))))
    }

    /// From when on a stand-in serves because no value comes: when the source is late by its own pace, at most `most` after its
    /// last value; and half a mean gap after the last published value (`served`).
    pub(super) fn late_after(&self, served: Time, most: Span) -> Time {
        let patience = self.patience().map_or(most, |patience| patience.min(most));
        let rest = self.mean.map_or(most, |mean| Span(mean.0 / 2).min(most));
        (self.last.unwrap_or(served) + patience).max(served + rest)
    }
}
