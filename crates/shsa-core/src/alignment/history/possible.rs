//! The mean over a stretch of time, as far as it is known: between two samples the value may be all that its course allows.

use super::{History, Sample};
use crate::interval::{Course, Interval};
use crate::time::{Span, Time, Validity};

/// A moment at which the value is known.
#[derive(Clone, Copy)]
struct Known {
    at: Time,
    value: Interval,
}

/// What bounds the value over a stretch of time.
#[derive(Clone, Copy)]
struct Stretch {
    from: Time,
    to: Time,
    course: Course,
    max_gap: Span,
}

impl History {
    /// The mean over a stretch of time. Where the rate of change is bounded, the value between two samples is all that it can have
    /// been; a sample may be true up to `off` from its middle, on average. Without such a bound each sample counts for the time to
    /// which its middle is the nearest, and between samples that are further apart than `max_gap` the value is any in the range.
    ///
    /// `None` where nothing bounds a part of the stretch, or without a sample. Complexity: O(samples since the stretch began).
    #[must_use]
    pub fn possible_mean(
        &self,
        Validity { from, to }: Validity,
        course: Course,
        max_gap: Span,
        off: impl Fn(Validity) -> Span,
    ) -> Option<Interval> {
        let stretch = Stretch { from, to, course, max_gap };
        let known = |sample: &Sample| {
            let margin =
                if course.is_rated() { course.max_rate * off(sample.validity).seconds() } else { 0.0 };
            Known { at: sample.validity.centre(), value: sample.value.widened(margin) }
        };
        let mut samples = self.newest_first().map(known);
        let mut later = samples.next()?;
        let mut area = if later.at < to { stretch.outside(later, to) } else { Interval::point(0.0) };
        for earlier in samples {
            if later.at <= from {
                break;
            }
            if earlier.at < to {
                area = area + stretch.between(earlier, later);
            }
            later = earlier;
        }
        if later.at > from {
            area = area + stretch.outside(later, from);
        }
        let mean = area / Interval::point((to - from).seconds());
        mean.is_bounded().then_some(mean)
    }
}

impl Stretch {
    /// The integral over the part of the stretch between two neighbours.
    fn between(&self, earlier: Known, later: Known) -> Interval {
        let (start, end) = (earlier.at.max(self.from), later.at.min(self.to));
        if !self.course.is_rated() && later.at - earlier.at <= self.max_gap {
            let half = earlier.at + Span((later.at - earlier.at).0 / 2);
            let part = |known: Known, from: Time, to: Time| {
                known.value * Interval::point((to - from).seconds().max(0.0))
            };
            return part(earlier, start, end.min(half)) + part(later, start.max(half), end);
        }
        let at = |moment: Time| {
            let (since, until) = ((moment - earlier.at).seconds(), (later.at - moment).seconds());
            self.course.between((earlier.value, since), (later.value, until))
        };
        let first = if start == earlier.at { earlier.value } else { at(start) };
        let last = if end == later.at { later.value } else { at(end) };
        self.course.integral(first, last, (end - start).seconds())
    }

    /// The integral from the outermost sample to an end of the stretch.
    fn outside(&self, outermost: Known, end: Time) -> Interval {
        let away = end.max(self.from).min(self.to) - outermost.at.max(self.from).min(self.to);
        let seconds = away.abs().seconds();
        if !self.course.is_rated() && away.abs() <= self.max_gap {
            return outermost.value * Interval::point(seconds);
        }
        let first = self.course.away(outermost.value, (outermost.at - end).abs().seconds() - seconds);
        self.course.integral(first, self.course.away(first, seconds), seconds)
    }
}
