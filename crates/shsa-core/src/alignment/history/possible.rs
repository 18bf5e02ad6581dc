//! The mean over a stretch of time, as far as it is known: between two samples the value may be all that its course allows.

use super::{History, Sample};
use crate::interval::{Course, Interval};
use crate::time::{Span, Time, Validity};
use alloc::vec::Vec;

/// A moment at which the value is known.
#[derive(Clone, Copy)]
struct Known {
    at: Time,
    value: Interval,
}

impl From<&Sample> for Known {
    fn from(sample: &Sample) -> Known {
        Known { at: sample.validity.centre(), value: sample.value }
    }
}

/// What bounds the value over a stretch of time.
#[derive(Clone, Copy)]
struct Stretch {
    from: Time,
    to: Time,
    course: Course,
    max_gap: Span,
}

/// The integrals up to each sample, from what bounds the value between neighbours: kept where means are asked for again and again,
/// so that the time of a mean does not grow with its samples.
#[derive(Clone, Debug)]
pub(super) struct Areas {
    course: Option<Course>,
    /// The sums of the lowest and highest areas, by the places of the samples in the ring.
    sums: Vec<(f64, f64)>,
    /// The largest of all sums, and the longest validity, since sums began anew.
    largest: f64,
    longest: Span,
    /// The middle of the newest sample up to which an area has no bounds; the sums leave that area out.
    unbounded: Time,
}

impl Areas {
    pub(super) const NONE: Areas =
        Areas { course: None, sums: Vec::new(), largest: 0.0, longest: Span::ZERO, unbounded: Time::MIN };

    pub(super) fn clear(&mut self) {
        self.sums.clear();
        (self.largest, self.longest, self.unbounded) = (0.0, Span::ZERO, Time::MIN);
    }

    /// Makes room for the sums of so many samples, where any are kept.
    pub(super) fn make_room(&mut self, capacity: usize) {
        if self.course.is_some() {
            self.sums.reserve_exact(capacity.saturating_sub(self.sums.len()));
        }
    }

    /// Begins anew with the sums of the first place.
    fn begin(&mut self, lengths: impl Iterator<Item = Span>) {
        let Some(base) = self.sums.first().copied() else { return };
        self.largest = 0.0;
        for (lo, hi) in &mut self.sums {
            (*lo, *hi) = (*lo - base.0, *hi - base.1);
            self.largest = self.largest.max(lo.abs()).max(hi.abs());
        }
        self.longest = lengths.max().unwrap_or(Span::ZERO);
    }

    /// The areas between two places. The margin is more than all roundings: each sum has at most as many terms as there have been
    /// samples since the sums began anew, which are at most twice those kept.
    fn between(&self, one: usize, other: usize) -> Option<Interval> {
        let (one, other) = (self.sums.get(one)?, self.sums.get(other)?);
        let margin = 2.0 * (self.sums.len() as f64 + 1.0) * f64::EPSILON * self.largest;
        Some(Interval::new(other.0 - one.0 - margin, other.1 - one.1 + margin))
    }
}

impl History {
    /// Keeps the integrals between neighbours for means that are asked for with this course, whose rate of change is bounded.
    /// Complexity: O(samples) where it changes.
    pub fn keep_areas(&mut self, course: Course) {
        if self.areas.course != Some(course) {
            self.areas.course = Some(course);
            self.areas.make_room(self.capacity);
            self.sum_up_anew();
        }
    }

    /// Begins the sums anew with the oldest sample.
    pub(super) fn sum_up_anew(&mut self) {
        let Some(course) = self.areas.course else { return };
        self.areas.clear();
        self.areas.sums.resize(self.samples.len(), (0.0, 0.0));
        for number in 0..self.samples.len() {
            self.sum_up(number, course);
        }
    }

    /// Goes on with the newest sample. Each time that the ring begins anew, so do the sums, so that roundings do not grow.
    #[inline]
    pub(super) fn sum_up_newest(&mut self) {
        if let Some(course) = self.areas.course {
            self.go_on(course);
        }
    }

    #[inline(never)]
    fn go_on(&mut self, course: Course) {
        let newest = self.samples.len() - 1;
        if self.start == 0 && newest + 1 == self.capacity {
            self.areas.begin(self.samples.iter().map(|sample| sample.validity.length()));
        }
        if self.areas.sums.len() <= newest {
            self.areas.sums.push((0.0, 0.0));
        }
        self.sum_up(newest, course);
    }

    /// The sum up to a sample, counted from the oldest, from that before.
    fn sum_up(&mut self, number: usize, course: Course) {
        let place = self.place(number);
        let Some(sample) = self.numbered(number).copied() else { return };
        let mut sum = (0.0, 0.0);
        if let Some(earlier) = number.checked_sub(1)
            && let (Some(before), Some(up_to_it)) =
                (self.numbered(earlier), self.areas.sums.get(self.place(earlier)))
        {
            let seconds = (sample.validity.centre() - before.validity.centre()).seconds();
            let area = course.integral(before.value, sample.value, seconds);
            sum = *up_to_it;
            if area.is_bounded() {
                sum = (sum.0 + area.lo(), sum.1 + area.hi());
            } else {
                self.areas.unbounded = sample.validity.centre();
            }
        }
        let areas = &mut self.areas;
        areas.largest = areas.largest.max(sum.0.abs()).max(sum.1.abs());
        areas.longest = areas.longest.max(sample.validity.length());
        if let Some(kept) = areas.sums.get_mut(place) {
            *kept = sum;
        }
    }

    /// The mean over a stretch of time. Where the rate of change is bounded, the value between two samples is all that it can have
    /// been; a sample may be true up to `off` from its middle, on average, by the length of its validity. Without such a bound each
    /// sample counts for the time to which its middle is the nearest, and between samples that are further apart than `max_gap` the
    /// value is any in the range.
    ///
    /// `None` where nothing bounds a part of the stretch, or without a sample. Complexity: O(log samples) where integrals are kept
    /// for this course, else O(samples since the stretch began).
    #[must_use]
    pub fn possible_mean(
        &self,
        Validity { from, to }: Validity,
        course: Course,
        max_gap: Span,
        off: impl Fn(Span) -> Span,
    ) -> Option<Interval> {
        let stretch = Stretch { from, to, course, max_gap };
        let known = |number: usize| self.numbered(number).map(Known::from);
        let count = self.len();
        let mut after = count;
        while after > 0 && self.numbered(after - 1).is_some_and(|last| last.validity.centre() > to) {
            after -= 1;
        }
        let first = self.first_within(from, after);
        let end = if first < after { after - 1 } else { first.saturating_sub(1) };
        let mut area = match (after.checked_sub(1).and_then(known), known(after)) {
            (Some(last), Some(after)) => stretch.between(last, after),
            (Some(last), None) => stretch.outside(last, to),
            (None, Some(after)) => stretch.outside(after, from),
            (None, None) => return None,
        };
        if first < after {
            area = area + self.area_within(first, end, &stretch);
            let first_one = known(first)?;
            area = area
                + match first.checked_sub(1).and_then(known) {
                    Some(before) => stretch.between(before, first_one),
                    None => stretch.outside(first_one, from),
                };
        }
        let mut mean = area / Interval::point((to - from).seconds());
        if course.is_rated() {
            mean = course.away(mean, off(self.longest(course)).seconds());
        }
        mean.is_bounded().then_some(mean)
    }

    /// The longest validity, or a longer one before.
    fn longest(&self, course: Course) -> Span {
        match self.areas.course == Some(course) {
            true => self.areas.longest,
            false => self.newest_first().map(|sample| sample.validity.length()).max().unwrap_or(Span::ZERO),
        }
    }

    /// The number of the first sample whose middle is not before a time, of those before a number.
    fn first_within(&self, from: Time, after: usize) -> usize {
        let (mut low, mut high) = (0, after);
        while low < high {
            let middle = low.midpoint(high);
            let is_before = self.numbered(middle).is_some_and(|sample| sample.validity.centre() < from);
            if is_before { low = middle + 1 } else { high = middle }
        }
        low
    }

    /// The integral between two samples that lie within a stretch.
    fn area_within(&self, first: usize, last: usize, stretch: &Stretch) -> Interval {
        let is_bounded = |from: &Sample| from.validity.centre() >= self.areas.unbounded;
        if self.areas.course == Some(stretch.course)
            && self.numbered(first).is_some_and(is_bounded)
            && let Some(kept) = self.areas.between(self.place(first), self.place(last))
        {
            return kept;
        }
        let neighbours =
            |number: usize| Some((self.numbered(number)?.into(), self.numbered(number + 1)?.into()));
        let areas = (first..last).filter_map(neighbours).map(|(one, other)| stretch.between(one, other));
        areas.fold(Interval::point(0.0), |sum, area| sum + area)
    }
}

impl Stretch {
    /// The integral over the part of the stretch between two neighbours.
    fn between(&self, earlier: Known, later: Known) -> Interval {
        let (start, end) = (earlier.at.max(self.from), later.at.min(self.to));
        if start >= end {
            return Interval::point(0.0);
        }
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
