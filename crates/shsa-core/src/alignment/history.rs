//! The recent past of one input, bounded, and what it says about a moment.

use crate::interval::Interval;
use crate::time::{Span, Time, Validity};
use alloc::vec::Vec;

/// One value with the time in which it was true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// When it was true.
    pub validity: Validity,
    /// The value, never empty.
    pub value: Interval,
}

/// What is known at a moment, and how far away the knowledge is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The value, grown by the rate of change over the gap.
    pub value: Interval,
    /// Time between the moment and the value that was read; zero when they overlap.
    pub gap: Span,
}

/// How an input is brought to a moment at which it was not observed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Largest rate of change, a second; zero when the model gives none.
    pub max_rate: f64,
    /// The largest gap over which a value still says something.
    pub max_gap: Span,
}

/// Two readings that cannot be joined at the largest rate of change, errors in value and time allowed for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// The earlier reading, SI.
    pub from: Interval,
    /// The later one, SI.
    pub to: Interval,
    /// The longest time that may lie between them.
    pub within: Span,
    /// The largest rate of change, SI a second.
    pub max_rate: f64,
}

/// Why a reading is no value at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Defect {
    /// A list where a number is expected, the other way round, an empty list, or one that is too long.
    Shape,
    /// Not a number, or a list without a number.
    NotANumber,
    /// Infinite, or too large to compute with.
    Infinite,
    /// A lower bound above the upper one.
    Bounds,
}

/// What became of an observation that was offered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Acceptance {
    /// Kept, and the newest.
    Newest,
    /// Kept among older ones: it came out of order.
    Reordered,
    /// Dropped: the same value with the same validity is there.
    Duplicate,
    /// Dropped: older than everything that is kept, stamped in the future, or without a value.
    Dropped,
    /// Refused: no value.
    Invalid(Defect),
    /// Refused: a value, SI, that is not possible.
    OutOfRange(Interval),
    /// Refused: a value that could not have followed the one before it.
    TooFast(Jump),
}

impl Acceptance {
    /// Whether the value was taken in.
    #[must_use]
    pub fn is_kept(self) -> bool {
        matches!(self, Acceptance::Newest | Acceptance::Reordered)
    }

    /// Whether the value was one that the signal can have.
    #[must_use]
    pub fn is_possible(self) -> bool {
        !matches!(self, Acceptance::Invalid(_) | Acceptance::OutOfRange(_))
    }
}

/// The recent past of one input: a ring of at most `capacity` samples in the order of time.
#[derive(Clone, Debug)]
pub struct History {
    samples: Vec<Sample>,
    capacity: usize,
    /// Where the oldest sample stands once the ring is full.
    start: usize,
    /// The newest sample once more and the end of the one before it, even if that has given way, as these are what is read;
    /// where there is none, nothing at the earliest time.
    top: Sample,
    before: Time,
}

/// In the place of the newest sample where there is none.
const NOTHING: Sample =
    Sample { validity: Validity { from: Time::MIN, to: Time::MIN }, value: Interval::EMPTY };

impl History {
    /// Room for `capacity` samples (at least one), allocated now.
    #[must_use]
    pub fn new(capacity: usize) -> History {
        let capacity = capacity.max(1);
        let samples = Vec::with_capacity(capacity);
        History { samples, capacity, start: 0, top: NOTHING, before: Time::MIN }
    }

    /// How many samples are kept.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether nothing is kept.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.samples.clear();
        self.start = 0;
        self.look_at_top();
    }

    /// Makes room for at least `capacity` samples and keeps those that are there. Complexity: O(samples).
    pub fn make_room(&mut self, capacity: usize) {
        if capacity > self.capacity {
            let oldest = self.start.min(self.samples.len());
            self.samples.rotate_left(oldest);
            self.start = 0;
            self.capacity = capacity;
            self.samples.reserve_exact(capacity.saturating_sub(self.samples.len()));
        }
    }

    /// How many samples it has room for.
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

    /// The same out of the ring.
    fn kept(&self, back: usize) -> Option<&Sample> {
        let from_oldest = self.samples.len().checked_sub(back.checked_add(1)?)?;
        self.samples.get(self.place(from_oldest))
    }

    /// Finds the newest sample and the one before it again.
    fn look_at_top(&mut self) {
        self.top = self.kept(0).copied().unwrap_or(NOTHING);
        self.before = self.kept(1).map_or(Time::MIN, |before| before.validity.to);
    }

    /// All samples in two parts, the newer ones first; in each of them the oldest is the first.
    #[inline]
    pub(super) fn newer_and_older(&self) -> (&[Sample], &[Sample]) {
        self.samples.split_at_checked(self.start).unwrap_or((&[], &self.samples))
    }

    /// All samples, newest first.
    pub fn newest_first(&self) -> impl Iterator<Item = &Sample> {
        let (newer, older) = self.newer_and_older();
        newer.iter().rev().chain(older.iter().rev())
    }

    /// What a sample of this validity comes next to: the newest that ends no later, else the oldest.
    #[must_use]
    pub fn before(&self, validity: Validity) -> Option<&Sample> {
        let before = self.newest_first().find(|kept| kept.validity.to <= validity.to);
        before.or_else(|| self.kept(self.samples.len().checked_sub(1)?))
    }

    /// Keeps a sample in the order of time; the oldest gives way when the ring is full.
    ///
    /// Complexity: O(1) for samples in order, O(capacity) for late ones. No allocation.
    #[inline]
    pub fn push(&mut self, sample: Sample) -> Acceptance {
        if sample.value.is_empty() {
            return Acceptance::Dropped;
        }
        if self.top.validity.to < sample.validity.to {
            self.append(sample);
            (self.before, self.top) = (self.top.validity.to, sample);
            return Acceptance::Newest;
        }
        self.insert(sample)
    }

    /// Keeps a sample that is not newer than all others.
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
        self.look_at_top();
        if later == 0 { Acceptance::Newest } else { Acceptance::Reordered }
    }

    /// What is known at `moment`: the hull of all samples that overlap it, else the nearest one within reach.
    ///
    /// Complexity: O(samples newer than the moment, and those that overlap it).
    #[must_use]
    pub fn at(&self, moment: Validity, reach: Reach) -> Option<Reading> {
        if let Some(value) = self.alone_at(moment) {
            return Some(Reading { value, gap: Span::ZERO });
        }
        let (gap, value) = match self.newest(0)? {
            newest if newest.validity.to < moment.from => (moment.from - newest.validity.to, newest.value),
            _ => self.nearest(moment),
        };
        if gap > reach.max_gap || value.is_empty() {
            return None;
        }
        let value = if gap == Span::ZERO { value } else { value.widened(gap.seconds() * reach.max_rate) };
        Some(Reading { value, gap })
    }

    /// The newest sample; an empty one at the earliest time where there is none.
    #[inline]
    pub(super) fn top(&self) -> &Sample {
        &self.top
    }

    /// The end of the sample before the newest; the earliest time where there is none.
    #[inline]
    pub(super) fn end_before(&self) -> Time {
        self.before
    }

    /// Whether the newest two samples end at the same time.
    #[inline]
    pub(super) fn is_repeated(&self) -> bool {
        self.before == self.top.validity.to
    }

    /// The newest value, if it is the only one that overlaps a moment: as it is most often, where there is one. At the earliest
    /// time that there is, it is not seen that it is the only one.
    #[inline]
    #[must_use]
    pub fn alone_at(&self, moment: Validity) -> Option<Interval> {
        let newest = &self.top;
        let is_at_it = newest.validity.from <= moment.to && moment.from <= newest.validity.to;
        // All others end no later than that before it.
        (is_at_it && self.before < moment.from).then_some(newest.value)
    }

    /// The least time between a moment and a sample, and the hull of all samples that are so near.
    fn nearest(&self, moment: Validity) -> (Span, Interval) {
        let mut nearest = Nearest { moment, gap: Span::MAX, value: Interval::EMPTY };
        let (newer, older) = self.newer_and_older();
        // Two loops: one over a chain of both is twice as slow.
        if newer.iter().rev().all(|sample| nearest.take(sample)) {
            older.iter().rev().all(|sample| nearest.take(sample));
        }
        (nearest.gap, nearest.value)
    }

    /// The mean over a stretch of time, each sample in it for the time to which its middle is the nearest; `None` with fewer
    /// than two of them, or where they begin after more than a quarter of it.
    ///
    /// A difference quotient over a window is the mean of the derivative over it, so this is what it compares with. Were
    /// all samples worth the same, those that lie at the ends, or have not come yet, would move the mean while it changes.
    /// Complexity: O(samples since the stretch began).
    #[must_use]
    pub fn mean_over(&self, stretch: Validity) -> Option<Interval> {
        let mut mean = Weighted::new(stretch);
        let (newer, older) = self.newer_and_older();
        // Two loops: one over a chain of both is twice as slow.
        if newer.iter().rev().all(|sample| mean.take(sample)) {
            older.iter().rev().all(|sample| mean.take(sample));
        }
        mean.result()
    }

    /// What samples that are true in their middles, but for `error` to either side, say of the middle of a moment: the hull of
    /// what is in proportion between two of them, or what the newest says; `None` where the nearest one is farther away than
    /// `max_gap`.
    ///
    /// So a mean is compared with one over the same time, and not with a mean of means. Complexity: O(samples newer than it).
    #[must_use]
    pub fn centred_at(&self, moment: Validity, error: Span, max_gap: Span) -> Option<Interval> {
        let wanted = moment.centre();
        let value = self.between_centres(wanted, max_gap)?;
        if error == Span::ZERO {
            return Some(value);
        }
        let ends = [wanted - error, wanted + error];
        let ends = ends.into_iter().filter_map(|end| self.between_centres(end, max_gap + error));
        Some(ends.fold(value, Interval::hull))
    }

    fn between_centres(&self, wanted: Time, max_gap: Span) -> Option<Interval> {
        let mut later: Option<&Sample> = None;
        for sample in self.newest_first() {
            let from = sample.validity.centre();
            if from <= wanted {
                let since = wanted - from;
                let until = later.map(|later| later.validity.centre() - wanted);
                let is_near = since.min(until.unwrap_or(Span::MAX)) <= max_gap;
                let share = until.map_or(0.0, |until| since.seconds() / (since + until).seconds());
                return is_near.then(|| between(sample.value, later.unwrap_or(sample).value, share));
            }
            later = Some(sample);
        }
        None
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

    fn place(&self, from_oldest: usize) -> usize {
        let place = self.start + from_oldest;
        if place < self.capacity { place } else { place - self.capacity }
    }

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

    /// Moves the sample just appended behind the `later` ones that are newer.
    fn sink_newest(&mut self, later: usize) {
        let newest = self.samples.len() - 1;
        for at in (newest - later.min(newest)..newest).rev() {
            let (one, other) = (self.place(at), self.place(at + 1));
            self.samples.swap(one, other);
        }
    }
}

/// The integral over a stretch of time, from its end backwards: numbers of nanoseconds before that, and one division when all
/// is summed, as this is what a mean costs.
struct Weighted {
    stretch: Validity,
    length: f64,
    /// What comes after this is in the sums.
    until: f64,
    /// The value and the middle of the sample that was taken last, and when it began.
    later: Interval,
    centre: f64,
    began: Time,
    count: u32,
    lo: f64,
    hi: f64,
}

impl Weighted {
    fn new(stretch: Validity) -> Weighted {
        let length = stretch.length().0 as f64;
        let (later, began) = (Interval::EMPTY, Time::MAX);
        Weighted { stretch, length, until: 0.0, later, centre: 0.0, began, count: 0, lo: 0.0, hi: 0.0 }
    }

    /// Takes the next older sample; whether one before it may be in the stretch, too.
    #[inline]
    fn take(&mut self, sample: &Sample) -> bool {
        let Validity { from, to } = sample.validity;
        if to < self.stretch.from {
            return false;
        }
        if from > self.stretch.to {
            return true;
        }
        let end = self.stretch.to;
        let centre = 0.5 * ((end - from).0 as f64 + (end - to).0 as f64);
        if self.count > 0 {
            // Each counts from halfway between its middle and that of the one before it.
            self.add(0.5 * (self.centre + centre));
        }
        (self.later, self.centre, self.began) = (sample.value, centre, from);
        self.count += 1;
        true
    }

    /// Adds the value that was taken last, which counts from so long before the end.
    #[inline]
    fn add(&mut self, since: f64) {
        let most = if since < self.length { since } else { self.length };
        let since = if most > self.until { most } else { self.until };
        let length = since - self.until;
        self.lo += self.later.lo() * length;
        self.hi += self.later.hi() * length;
        self.until = since;
    }

    fn result(mut self) -> Option<Interval> {
        let is_whole = self.began <= self.stretch.from + Span(self.stretch.length().0 / 4);
        if self.count < 2 || !is_whole || self.length <= 0.0 {
            return None;
        }
        self.add(self.length);
        Some(Interval::new(self.lo / self.length, self.hi / self.length))
    }
}

/// A part of the way from one value to another.
fn between(one: Interval, other: Interval, share: f64) -> Interval {
    let part = |one: f64, other: f64| one * (1.0 - share) + other * share;
    Interval::new(part(one.lo(), other.lo()), part(one.hi(), other.hi()))
}

/// The hull of the samples that are nearest to a moment so far.
struct Nearest {
    moment: Validity,
    gap: Span,
    value: Interval,
}

impl Nearest {
    /// Takes the next older sample; whether one before it may be as near.
    #[inline]
    fn take(&mut self, sample: &Sample) -> bool {
        let gap = sample.validity.gap(self.moment);
        if gap < self.gap || self.value.is_empty() {
            (self.gap, self.value) = (gap, sample.value);
        } else if gap == self.gap {
            self.value = self.value.hull(sample.value);
        }
        sample.validity.to >= self.moment.from
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample(from: i64, to: i64, value: f64) -> Sample {
        Sample { validity: Validity { from: Time(from), to: Time(to) }, value: Interval::point(value) }
    }

    const REACH: Reach = Reach { max_rate: 0.0, max_gap: Span(10) };

    #[test]
    fn the_port_reads_the_nearest_value_and_its_uncertainty_grows() {
        let mut history = History::new(4);
        for time in [0, 10, 20] {
            history.push(sample(time, time, time as f64));
        }
        let reach = Reach { max_rate: 1e9, max_gap: Span(5) };
        let reading = history.at(Validity::at(Time(23)), reach).unwrap();
        assert_eq!(reading.gap, Span(3));
        assert!(
            reading.value.contains(17.0) && reading.value.contains(23.0) && !reading.value.contains(16.9)
        );
        assert_eq!(history.at(Validity::at(Time(26)), reach), None);
        assert_eq!(history.at(Validity::at(Time(10)), reach).unwrap().value, Interval::point(10.0));
        let between = history.at(Validity { from: Time(9), to: Time(21) }, reach).unwrap();
        assert_eq!(between.value, Interval::new(10.0, 20.0));
    }

    #[test]
    fn late_and_duplicate_samples_are_accepted_or_dropped_by_rule() {
        let mut history = History::new(3);
        assert_eq!(history.push(sample(10, 10, 1.0)), Acceptance::Newest);
        assert_eq!(history.push(sample(20, 20, 2.0)), Acceptance::Newest);
        assert_eq!(history.push(sample(15, 15, 3.0)), Acceptance::Reordered);
        assert_eq!(history.push(sample(20, 20, 2.0)), Acceptance::Duplicate);
        assert_eq!(history.push(sample(5, 5, 9.0)), Acceptance::Dropped);
        let values: std::vec::Vec<f64> = history.newest_first().map(|kept| kept.value.lo()).collect();
        assert_eq!(values, [2.0, 3.0, 1.0]);
        let nothing = Sample { value: Interval::EMPTY, ..sample(30, 30, 0.0) };
        assert_eq!(history.push(nothing), Acceptance::Dropped);
    }

    #[test]
    fn in_a_mean_each_sample_counts_for_the_time_around_it() {
        let mut history = History::new(8);
        [0, 10, 20, 60, 70].into_iter().for_each(|time| {
            history.push(sample(time, time, time as f64));
        });
        let mean = |from, to| history.mean_over(Validity { from: Time(from), to: Time(to) });
        // 0 for 5, 10 for 10, 20 for 25, 60 for 25, 70 for 5.
        let expected = (100.0 + 500.0 + 1500.0 + 350.0) / 70.0;
        assert!((mean(0, 70).unwrap().lo() - expected).abs() < 1e-9);
        // The last one stands for what has not come yet.
        let expected = (60.0 * 5.0 + 70.0 * 35.0) / 40.0;
        assert!((mean(60, 100).unwrap().hi() - expected).abs() < 1e-9);
        assert_eq!(mean(15, 25), None);
        assert_eq!(mean(20, 20), None);
        // What began after more than a quarter says nothing about the whole.
        assert!(mean(-23, 70).is_some());
        assert_eq!(mean(-24, 70), None);
    }

    #[test]
    fn between_the_middles_of_two_means_a_value_is_in_proportion() {
        let mut history = History::new(4);
        let gap = Span(12);
        assert_eq!(history.centred_at(Validity::at(Time(5)), Span::ZERO, gap), None);
        [(0, 10, 1.0), (10, 20, 2.0), (50, 60, 4.0)].into_iter().for_each(|(from, to, value)| {
            history.push(sample(from, to, value));
        });
        let at = |from, to| {
            history
                .centred_at(Validity { from: Time(from), to: Time(to) }, Span::ZERO, gap)
                .map(|value| value.lo())
        };
        // Middles are 5, 15 and 55; only the middle of what is asked counts.
        assert_eq!(
            [at(55, 55), at(0, 90), at(0, 10), at(8, 12)],
            [Some(4.0), Some(3.5), Some(1.0), Some(1.5)]
        );
        let unsure = history.centred_at(Validity::at(Time(15)), Span(10), gap).unwrap();
        assert_eq!((unsure.lo(), unsure.hi()), (1.0, 2.5));
        // Too far from any, and before all.
        assert_eq!(
            [at(25, 25), at(28, 28), at(67, 67), at(68, 68), at(4, 4)],
            [Some(2.5), None, Some(4.0), None, None]
        );
    }

    proptest! {
        /// A mean lies within what its samples say, and that of what never changes is exact but for rounding.
        #[test]
        fn means_lie_within_their_samples(
            samples in proptest::collection::vec((0i64..40, 0i64..12, -3i32..3), 1..8), from in -5i64..60, length in 1i64..40,
        ) {
            let mut history = History::new(6);
            for (from, length, value) in samples {
                history.push(sample(from, from + length, f64::from(value)));
            }
            let stretch = Validity { from: Time(from), to: Time(from + length) };
            let inside: std::vec::Vec<f64> = history.overlapping(stretch).map(|sample| sample.value.lo()).collect();
            let mean = history.mean_over(stretch);
            prop_assert!(mean.is_none() || inside.len() >= 2);
            if let Some(value) = history.centred_at(stretch, Span(3), Span(20)) {
                prop_assert!(value.lo() >= -3.0 - 1e-9 && value.hi() <= 2.0 + 1e-9 && !value.is_empty());
            }
            if let Some(mean) = mean {
                let (lo, hi) = (
                    inside.iter().copied().fold(f64::INFINITY, f64::min),
                    inside.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                );
                prop_assert!(lo - 1e-9 <= mean.lo() && mean.lo() <= mean.hi() && mean.hi() <= hi + 1e-9);
            }
        }

        /// Reading the newest sample alone is reading all.
        #[test]
        fn what_is_read_at_a_glance_is_what_a_look_at_all_says(
            samples in proptest::collection::vec((0i64..40, 0i64..12), 1..8), from in -5i64..60, length in 0i64..12,
            capacity in 1usize..5,
        ) {
            let mut history = History::new(capacity);
            for (at, (from, length)) in samples.into_iter().enumerate() {
                history.push(sample(from, from + length, at as f64));
            }
            let moment = Validity { from: Time(from), to: Time(from + length) };
            let (gap, value) = history.nearest(moment);
            let reach = Reach { max_rate: 0.0, max_gap: Span::MAX };
            prop_assert_eq!(history.at(moment, reach), Some(Reading { value, gap }));
        }

        #[test]
        fn order_of_arrival_does_not_matter(mut times in proptest::collection::vec(0i64..1000, 1..12)) {
            times.sort_unstable();
            times.dedup();
            let mut forward = History::new(16);
            let mut backward = History::new(16);
            times.iter().for_each(|&t| { forward.push(sample(t, t + 3, t as f64)); });
            times.iter().rev().for_each(|&t| { backward.push(sample(t, t + 3, t as f64)); });
            prop_assert!(forward.newest_first().eq(backward.newest_first()));
            let moment = Validity { from: Time(400), to: Time(410) };
            prop_assert_eq!(forward.at(moment, REACH), backward.at(moment, REACH));
        }
    }
}
