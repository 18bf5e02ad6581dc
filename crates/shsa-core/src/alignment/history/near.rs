//! Accumulators over samples: the mean over a stretch of time, and the hull of the samples nearest to a moment.

use super::Sample;
use crate::interval::Interval;
use crate::numbers::BENDS_MORE;
use crate::time::{Span, Time, Validity};

/// The integral over a stretch of time, from its end backwards. Times are numbers of nanoseconds, and only the sum is divided, as
/// divisions are the main cost of a mean.
pub(super) struct Weighted {
    stretch: Validity,
    length: f64,
    /// The time before the end up to which the sums are complete.
    until: f64,
    /// The value and the middle of the sample taken last, and when it began.
    later: Interval,
    centre: f64,
    began: Time,
    count: u32,
    /// The middle of the sample looked at last, and the longest time between two that matter.
    seen: f64,
    widest: f64,
    /// The largest slope between two in the stretch, and the middle of the newest one there.
    steepest: f64,
    newest: f64,
    /// Whether a sample from before the stretch has been looked at.
    is_before: bool,
    lo: f64,
    hi: f64,
}

impl Weighted {
    pub(super) fn new(stretch: Validity) -> Weighted {
        let length = stretch.length().0 as f64;
        let (later, began) = (Interval::EMPTY, Time::MAX);
        Weighted {
            stretch,
            length,
            until: 0.0,
            later,
            centre: 0.0,
            began,
            count: 0,
            seen: f64::INFINITY,
            widest: 0.0,
            steepest: 0.0,
            newest: 0.0,
            is_before: false,
            lo: 0.0,
            hi: 0.0,
        }
    }

    /// Takes the next older sample; returns whether a still older one may be in the stretch, too.
    #[inline]
    pub(super) fn take(&mut self, sample: &Sample) -> bool {
        let Validity { from, to } = sample.validity;
        let end = self.stretch.to;
        let centre = 0.5 * ((end - from).0 as f64 + (end - to).0 as f64);
        let step = centre - self.seen;
        self.seen = centre;
        if from > end {
            return true;
        }
        if step > self.widest {
            self.widest = step;
        }
        if to < self.stretch.from {
            self.is_before = true;
            return false;
        }
        if self.count > 0 {
            // Each sample counts from halfway between its middle and that of the one before.
            self.add(0.5 * (self.centre + centre));
            let change =
                0.5 * ((sample.value.lo() - self.later.lo()) + (sample.value.hi() - self.later.hi()));
            let apart = centre - self.centre;
            if apart > 0.0 && change.abs() > self.steepest * apart {
                self.steepest = change.abs() / apart;
            }
        } else {
            self.newest = centre;
        }
        (self.later, self.centre, self.began) = (sample.value, centre, from);
        self.count += 1;
        true
    }

    /// Adds the sample taken last, which counts back to this time before the end.
    #[inline]
    fn add(&mut self, since: f64) {
        let most = if since < self.length { since } else { self.length };
        let since = if most > self.until { most } else { self.until };
        let length = since - self.until;
        self.lo += self.later.lo() * length;
        self.hi += self.later.hi() * length;
        self.until = since;
    }

    /// Whether two samples that matter are further apart than that, or the first one is as far from the begin.
    pub(super) fn has_gap(&self, max_gap: Span) -> bool {
        let most = max_gap.0 as f64;
        self.widest > most || (!self.is_before && self.length - self.seen > most)
    }

    pub(super) fn result(mut self) -> Option<Interval> {
        let is_whole = self.began <= self.stretch.from + Span(self.stretch.length().0 / 4);
        if self.count < 2 || !is_whole || self.length <= 0.0 {
            return None;
        }
        self.add(self.length);
        // Between the outermost samples and the ends, the value may go on as steeply as anywhere in the stretch. Between two samples
        // it curves: the trapezoids are off by a twelfth of the change of the slope times the square of the step.
        let (end, begin, step) = (self.newest, self.length - self.centre, self.widest);
        let margin = BENDS_MORE * self.steepest * (0.5 * (end * end + begin * begin) + step * step / 6.0);
        Some(Interval::new((self.lo - margin) / self.length, (self.hi + margin) / self.length))
    }
}

/// The linear interpolation between two values.
pub(super) fn between(one: Interval, other: Interval, share: f64) -> Interval {
    let part = |one: f64, other: f64| one * (1.0 - share) + other * share;
    Interval::new(part(one.lo(), other.lo()), part(one.hi(), other.hi()))
}

/// The hull of the samples found nearest to a moment.
pub(super) struct Nearest {
    pub(super) moment: Validity,
    pub(super) gap: Span,
    pub(super) value: Interval,
}

impl Nearest {
    /// Takes the next older sample; returns whether a still older one may be as near.
    #[inline]
    pub(super) fn take(&mut self, sample: &Sample) -> bool {
        let gap = sample.validity.gap(self.moment);
        if gap < self.gap || self.value.is_empty() {
            (self.gap, self.value) = (gap, sample.value);
        } else if gap == self.gap {
            self.value = self.value.hull(sample.value);
        }
        sample.validity.to >= self.moment.from
    }
}
