//! What the argument of a time operator can have been between two samples.

use super::super::number::Number;
use super::super::operation::{Binary, Constant, Operation};
use super::{History, Sample, middle};
use crate::interval::Interval;
use crate::time::{Span, Time, Validity};
use core::ops::Range;

impl<N: Number> History<N> {
    /// Whether there is a gap between the last sample and this time that only the range bounds.
    pub(super) fn is_after_gap(&self, at: Validity) -> bool {
        let looks_between =
            matches!(self.operation, Operation::Delay(_) | Operation::MovingMean(_) | Operation::Integral);
        if !looks_between || self.course.is_rated() {
            return false;
        }
        let is_long = |last: &Sample<N>| self.is_gap(middle(at) - middle(last.at), middle(at));
        self.is_interrupted || self.newest().is_some_and(is_long)
    }

    /// What is known of the argument at the middle of a sample's time, and that time.
    fn known(&self, sample: &Sample<N>) -> (Time, Interval) {
        let (value, half) = (sample.value.bounds(), sample.at.length().seconds() / 2.0);
        let is_moved = half > 0.0 && self.course.is_rated();
        (middle(sample.at), if is_moved { self.course.away(value, half) } else { value })
    }

    /// The integral of the argument from `since` on, which is not before the first sample, to the second one.
    pub(super) fn area(&self, one: &Sample<N>, other: &Sample<N>, since: Time) -> Interval {
        let ((first, before), (last, after)) = (self.known(one), self.known(other));
        let from = first.max(since);
        // The conversion from nanoseconds rounds twice.
        let seconds = (last - from).seconds().next_up().next_up();
        if !self.course.is_rated() && !other.follows_gap {
            return before.hull(after) * Interval::point(seconds);
        }
        let until = (last - from).seconds();
        let at_begin = match from > first {
            true => self.course.between((before, (from - first).seconds()), (after, until)),
            false => before,
        };
        self.course.integral(at_begin, after, seconds)
    }

    /// Where the rate of change is bounded: the value a span before the middle of the present time.
    pub(super) fn rated_delay(&mut self, now: Sample<N>, span: Span) -> N {
        let moment = middle(now.at) - span;
        self.before = self.first_ones(self.before, |sample| middle(sample.at) <= moment);
        let before = self.before.checked_sub(1).and_then(|number| self.numbered(number));
        let after = self.numbered(self.before).unwrap_or(&now);
        let Some(before) = before.filter(|_| !after.value.is_missing()) else { return N::MISSING };
        let ((since, one), (until, other)) = (self.known(before), self.known(after));
        let bounds =
            self.course.between((one, (moment - since).seconds()), (other, (until - moment).seconds()));
        N::constant(Constant { value: before.value.bounds().midpoint(), bounds })
    }

    /// The mean over the window of all that the argument can have been, from the last sample before it on.
    pub(super) fn bounded_mean(&self, now: &Sample<N>, window: Span, numbers: Range<usize>) -> N {
        let since = middle(now.at) - window;
        let mut area = Interval::point(0.0);
        let mut samples = self.range(numbers.start, numbers.end).chain([now]);
        let Some(mut before) = samples.next() else { return N::MISSING };
        for sample in samples {
            area = area + self.area(before, sample, since);
            before = sample;
        }
        let bounds = area / Interval::point(window.seconds());
        let value = bounds.midpoint();
        if bounds.is_bounded() { N::constant(Constant { value, bounds }) } else { N::MISSING }
    }

    /// The mean over the window of the lines between samples, from the last one before it on. Each sample counts for half of the lines
    /// to its neighbours.
    pub(super) fn linear_mean(&self, now: &Sample<N>, window: Span, numbers: Range<usize>) -> N {
        let (at, count) = (middle(now.at), numbers.len());
        let since = at - window;
        let half = |from: Time, to: Time| 0.5 * (to - from.max(since)).0 as f64;
        let Some(first) = self.numbered(numbers.start) else { return N::MISSING };
        let second = self.numbered(numbers.start + 1).filter(|_| count > 1).unwrap_or(now);
        let (start, end) = (middle(first.at), middle(second.at));
        // Of the first line, which begins before the window, less belongs to its begin.
        let less = half(start, end) * (since - start).0.max(0) as f64 / (end - start).0 as f64;
        let next = self.range(numbers.start + 1, numbers.end).chain([now]).map(|it| middle(it.at));
        let samples = self.range(numbers.start, numbers.end).map(|it| it.value);
        let lines = samples.zip(next).scan((start, -less, less), |(before, own, of_next), (value, next)| {
            let line = half(*before, next);
            let weight = *own + line;
            (*before, *own, *of_next) = (next, line + *of_next, 0.0);
            Some((value, weight))
        });
        let newest = self.numbered(numbers.end.saturating_sub(1)).map_or(at, |newest| middle(newest.at));
        let last = half(newest, at) + if count > 1 { 0.0 } else { less };
        let length = window.0 as f64;
        let length = N::constant(Constant { value: length, bounds: Interval::point(length) });
        N::weighted(lines.chain([(now.value, last)])).binary(Binary::Div, length)
    }
}
