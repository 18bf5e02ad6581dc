//! The recent past of one input, bounded, and its value at a moment.

mod near;
mod possible;

use super::reception::Acceptance;
use crate::interval::{Course, Interval};
use crate::time::{Span, Time, Validity};
use alloc::vec::Vec;
use near::{Nearest, Weighted, between};
use possible::Areas;

/// A value and the time in which it was true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// When it was true.
    pub validity: Validity,
    /// The value, never empty.
    pub value: Interval,
}

/// The value at a moment, and the distance to the sample behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The value, grown by the rate of change over the gap.
    pub value: Interval,
    /// The time between the moment and the sample; zero when they overlap.
    pub gap: Span,
}

/// How far a value counts beyond its own time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Largest rate of change, a second; zero when the model gives none.
    pub max_rate: f64,
    /// The largest gap over which a value still counts.
    pub max_gap: Span,
    /// Whether a value stands until the next one, however long that is: `max_gap` does not count then.
    pub stands: bool,
}

/// The recent past of one input: a ring of at most `capacity` samples in the order of time.
#[derive(Clone, Debug)]
pub struct History {
    samples: Vec<Sample>,
    capacity: usize,
    /// The place of the oldest sample in a full ring.
    start: usize,
    /// A copy of the newest sample, and the end of the one before it, even if that has been dropped, as these are read most;
    /// without samples, an empty value at the earliest time.
    top: Sample,
    before: Time,
    areas: Areas,
}

/// Stands for the newest sample of an empty history.
const NOTHING: Sample =
    Sample { validity: Validity { from: Time::MIN, to: Time::MIN }, value: Interval::EMPTY };

impl History {
    /// Room for `capacity` samples (at least one), allocated now.
    #[must_use]
    pub fn new(capacity: usize) -> History {
        let capacity = capacity.max(1);
        let samples = Vec::with_capacity(capacity);
        History { samples, capacity, start: 0, top: NOTHING, before: Time::MIN, areas: Areas::NONE }
    }

    /// The number of samples kept.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether no sample is kept.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Removes all samples.
    pub fn clear(&mut self) {
        self.samples.clear();
        self.start = 0;
        self.areas.clear();
        self.look_at_top();
    }

    /// Makes room for at least `capacity` samples and keeps those present. Complexity: O(samples).
    pub fn make_room(&mut self, capacity: usize) {
        if capacity > self.capacity {
            let oldest = self.start.min(self.samples.len());
            self.samples.rotate_left(oldest);
            self.start = 0;
            self.capacity = capacity;
            self.samples.reserve_exact(capacity.saturating_sub(self.samples.len()));
            self.areas.make_room(capacity);
            self.sum_up_anew();
        }
    }

    /// The largest number of samples.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// The sample that is `back` before the newest (0 is the newest).
    #[inline]
    #[must_use]
    pub fn newest(&self, back: usize) -> Option<&Sample> {
        if back == 0 {
            return (!self.samples.is_empty()).then_some(&self.top);
        }
        self.kept(back)
    }

    /// The same sample, read from the ring.
    fn kept(&self, back: usize) -> Option<&Sample> {
        self.numbered(self.samples.len().checked_sub(back.checked_add(1)?)?)
    }

    /// Reads the newest sample and the end of the one before it again.
    fn look_at_top(&mut self) {
        self.top = self.kept(0).copied().unwrap_or(NOTHING);
        self.before = self.kept(1).map_or(Time::MIN, |before| before.validity.to);
    }

    /// All samples in two parts, the newer part first; each part starts with its oldest sample.
    #[inline]
    pub(super) fn newer_and_older(&self) -> (&[Sample], &[Sample]) {
        self.samples.split_at_checked(self.start).unwrap_or((&[], &self.samples))
    }

    /// All samples, newest first.
    pub fn newest_first(&self) -> impl Iterator<Item = &Sample> {
        let (newer, older) = self.newer_and_older();
        newer.iter().rev().chain(older.iter().rev())
    }

    /// The neighbour of a sample of this validity: the newest that ends no later, else the oldest.
    #[must_use]
    pub fn before(&self, validity: Validity) -> Option<&Sample> {
        let before = self.newest_first().find(|kept| kept.validity.to <= validity.to);
        before.or_else(|| self.kept(self.samples.len().checked_sub(1)?))
    }

    /// Keeps a sample in the order of time; a full ring drops the oldest.
    ///
    /// Complexity: O(1) for samples in order, O(capacity) for late ones. No allocation.
    #[inline]
    pub fn push(&mut self, sample: Sample) -> Acceptance {
        if sample.value.is_empty() {
            return Acceptance::Dropped;
        }
        if self.top.validity.to < sample.validity.to {
            self.append(sample);
            self.sum_up_newest();
            (self.before, self.top) = (self.top.validity.to, sample);
            return Acceptance::Newest;
        }
        self.insert(sample)
    }

    /// Inserts a sample that is not newer than all others.
    fn insert(&mut self, sample: Sample) -> Acceptance {
        let later = self.newest_first().take_while(|kept| kept.validity.to > sample.validity.to).count();
        let same = self.newest_first().skip(later).take_while(|kept| kept.validity.to == sample.validity.to);
        if same.into_iter().any(|kept| *kept == sample) {
            return Acceptance::Duplicate;
        }
        if later == self.capacity {
            return Acceptance::Dropped;
        }
        self.append(sample);
        self.sink_newest(later);
        self.sum_up_anew();
        self.look_at_top();
        if later == 0 { Acceptance::Newest } else { Acceptance::Reordered }
    }

    /// The value at `moment`: the hull of all samples that overlap it, else the nearest one within reach; where the rate of change
    /// is bounded, the nearest one with its growth.
    ///
    /// Complexity: O(samples that are newer than the moment or overlap it).
    #[must_use]
    pub fn at(&self, moment: Validity, reach: Reach) -> Option<Reading> {
        if reach.max_rate > 0.0 {
            return self.rated_reading(moment, reach);
        }
        if let Some(value) = self.alone_at(moment) {
            return Some(Reading { value, gap: Span::ZERO });
        }
        if reach.stands {
            return self.held_reading(moment);
        }
        let (gap, value) = match self.newest(0)? {
            newest if newest.validity.to < moment.from => (moment.from - newest.validity.to, newest.value),
            _ => self.nearest(moment),
        };
        if gap > reach.max_gap || value.is_empty() {
            return None;
        }
        Some(Reading { value, gap })
    }

    /// The same where the rate of change is bounded: the certainly nearest sample, grown by the longest time in between, as both may
    /// be true at any moment of their validities.
    fn rated_reading(&self, moment: Validity, reach: Reach) -> Option<Reading> {
        let newest = self.top();
        let (away, sample) = match self.is_certainly_newest(moment) {
            true => (farthest(newest.validity, moment), newest),
            false => self.certainly_nearest(moment)?,
        };
        let gap = sample.validity.gap(moment);
        let is_after_first =
            || self.kept(self.len() - 1).is_some_and(|first| first.validity.from <= moment.to);
        let is_within = if reach.stands { is_after_first() } else { gap <= reach.max_gap };
        is_within.then(|| Reading { value: sample.value.widened(away.seconds() * reach.max_rate), gap })
    }

    /// The newest sample; without samples an empty one at the earliest time.
    #[inline]
    pub(super) fn top(&self) -> &Sample {
        &self.top
    }

    /// The end of the sample before the newest; without one the earliest time.
    #[inline]
    pub(super) fn end_before(&self) -> Time {
        self.before
    }

    /// Whether the newest two samples end at the same time.
    #[inline]
    pub(super) fn is_repeated(&self) -> bool {
        self.before == self.top.validity.to
    }

    /// The newest value, if it is the only one that overlaps a moment, which is the most frequent case. At the earliest possible
    /// time, a sole sample is not recognised.
    #[inline]
    #[must_use]
    pub fn alone_at(&self, moment: Validity) -> Option<Interval> {
        let newest = &self.top;
        let is_at_it = newest.validity.from <= moment.to && moment.from <= newest.validity.to;
        // All other samples end no later than `before`.
        (is_at_it && self.before < moment.from).then_some(newest.value)
    }

    /// The smallest gap between a moment and a sample, and the hull of all samples with this gap.
    fn nearest(&self, moment: Validity) -> (Span, Interval) {
        let mut nearest = Nearest { moment, gap: Span::MAX, value: Interval::EMPTY };
        let (newer, older) = self.newer_and_older();
        // Two loops: one over a chain of both is twice as slow.
        if newer.iter().rev().all(|sample| nearest.take(sample)) {
            older.iter().rev().all(|sample| nearest.take(sample));
        }
        (nearest.gap, nearest.value)
    }

    /// The mean over a stretch of time; each sample in it counts for the time to which its middle is the nearest. `None` with
    /// fewer than two samples, or where they begin after more than a quarter of the stretch. Where samples that matter are further
    /// apart than `max_gap`, the value in between may be any in the range of the course: `None` where that has none.
    ///
    /// A difference quotient over a window is compared with this mean of the derivative. With equal weights, samples at the ends,
    /// or missing ones, would shift the mean while it changes. Complexity: O(samples since the stretch began).
    #[must_use]
    pub fn mean_over(&self, stretch: Validity, course: Course, max_gap: Span) -> Option<Interval> {
        let mut mean = Weighted::new(stretch);
        let (newer, older) = self.newer_and_older();
        // Two loops: one over a chain of both is twice as slow.
        if newer.iter().rev().all(|sample| mean.take(sample)) {
            older.iter().rev().all(|sample| mean.take(sample));
        }
        match mean.has_gap(max_gap) {
            true => self.possible_mean(stretch, course, max_gap, |_| Span::ZERO),
            false => mean.result(),
        }
    }

    /// The value at the middle of a moment, from samples that are true at their middles, with a time `error` to either side: the
    /// hull of linear interpolations between two samples, or of the newest sample. `None` where both samples are further apart than
    /// `max_gap`, or the newest one is farther away.
    ///
    /// So a mean is compared with one over the same time, and not with a mean of means. The second result is the time between the
    /// two samples, or from the newest one; zero at a sample. Complexity: O(samples newer than the
    /// moment).
    #[must_use]
    pub fn centred_at(&self, moment: Validity, error: Span, max_gap: Span) -> Option<(Interval, Span)> {
        let wanted = moment.centre();
        let (value, step) = self.between_centres(wanted, max_gap)?;
        if error == Span::ZERO {
            return Some((value, step));
        }
        let ends = [wanted - error, wanted + error];
        let ends = ends.into_iter().filter_map(|end| self.between_centres(end, max_gap + error));
        Some((ends.fold(value, |hull, (value, _)| hull.hull(value)), step))
    }

    pub(super) fn between_centres(&self, wanted: Time, max_gap: Span) -> Option<(Interval, Span)> {
        let mut later: Option<&Sample> = None;
        for sample in self.newest_first() {
            let from = sample.validity.centre();
            if from <= wanted {
                let since = wanted - from;
                if since == Span::ZERO {
                    return Some((sample.value, Span::ZERO));
                }
                let until = later.map(|later| later.validity.centre() - wanted);
                let step = since + until.unwrap_or(Span::ZERO);
                let share = until.map_or(0.0, |_| since.seconds() / step.seconds());
                let value = || between(sample.value, later.unwrap_or(sample).value, share);
                return (step <= max_gap).then(|| (value(), step));
            }
            later = Some(sample);
        }
        None
    }

    /// The sample whose middle is the nearest to a time. Complexity: O(samples newer than the time).
    #[must_use]
    pub fn nearest_middle(&self, time: Time) -> Option<&Sample> {
        let away = |sample: &Sample| (sample.validity.centre() - time).abs();
        let mut nearest = self.newest(0)?;
        for sample in self.newest_first() {
            if away(sample) < away(nearest) {
                nearest = sample;
            }
            if sample.validity.centre() <= time {
                break;
            }
        }
        Some(nearest)
    }

    /// The time that usually passes between two samples: the middle one of the last three times; with fewer samples the last
    /// time. `None` before the second sample.
    #[must_use]
    pub fn usual_step(&self) -> Option<Span> {
        let end = |back: usize| self.newest(back).map(|sample| sample.validity.to);
        let step = |back: usize| Some(end(back)? - end(back + 1)?);
        let last = step(0)?;
        let Some((one, other)) = step(1).zip(step(2)) else { return Some(last) };
        Some(last.min(one).max(last.max(one).min(other)))
    }

    /// All samples whose validity overlaps `moment`, newest first.
    pub fn overlapping(&self, moment: Validity) -> impl Iterator<Item = &Sample> {
        self.newest_first().filter(move |sample| sample.validity.intersection(moment).is_some())
    }

    /// The end of the newest validity.
    #[must_use]
    pub fn latest(&self) -> Option<Time> {
        self.newest(0).map(|newest| newest.validity.to)
    }

    /// The sample of a number, counted from the oldest as 0.
    fn numbered(&self, from_oldest: usize) -> Option<&Sample> {
        if from_oldest < self.samples.len() { self.samples.get(self.place(from_oldest)) } else { None }
    }

    fn place(&self, from_oldest: usize) -> usize {
        let place = self.start + from_oldest;
        if place < self.capacity { place } else { place - self.capacity }
    }

    #[inline]
    fn append(&mut self, sample: Sample) {
        if self.samples.len() < self.capacity {
            self.samples.push(sample);
            return;
        }
        if let Some(oldest) = self.samples.get_mut(self.start) {
            *oldest = sample;
        }
        self.start = if self.start + 1 < self.capacity { self.start + 1 } else { 0 };
    }

    /// Moves the appended sample behind the `later` newer ones.
    fn sink_newest(&mut self, later: usize) {
        let newest = self.samples.len() - 1;
        for at in (newest - later.min(newest)..newest).rev() {
            let (one, other) = (self.place(at), self.place(at + 1));
            self.samples.swap(one, other);
        }
    }
}

/// The longest time between points of two validities.
#[inline]
pub(super) fn farthest(one: Validity, other: Validity) -> Span {
    (one.to - other.from).max(other.to - one.from)
}

#[cfg(test)]
mod tests;
