//! The memory of the time operators: samples of their argument, of a bounded number.
//!
//! A sample that follows the last kept one too closely is not kept, so that the memory covers the whole window at any rate.
//! Samples without a value are not kept. Evaluations at the time of the last one or before it change nothing.
//!
//! Where the rate of change of the argument is bounded, a mean, an integral and a delayed value hold all that the argument can have
//! been between its samples. Without such a bound, a time in which a condition failed on which the argument depends, or which is
//! longer than the times between samples usually are, is a gap: a mean or an integral over it holds all values in the argument's range, and
//! what would have to look into it otherwise has no value.

mod between;

use alloc::vec::Vec;

use super::number::Number;
use super::operation::{Binary, Constant, Operation};
use super::program::Remembered;
use super::temporal::{self, as_number};
use crate::interval::{Course, Interval};
use crate::time::{Span, Time, Validity};

/// What is so many times as long as the usual time between two samples is a gap: single samples may be missing.
const USUAL_STEPS: i64 = 3;

/// The most samples that one operator keeps.
const MAX_SAMPLES: usize = 2048;

#[derive(Clone, Copy, Debug)]
struct Sample<N> {
    at: Validity,
    value: N,
    /// Whether there is a gap before it.
    follows_gap: bool,
}

/// The memory of one time operator.
#[derive(Clone, Debug)]
pub(super) struct History<N> {
    operation: Operation,
    /// What bounds the argument between two samples.
    course: Course,
    /// A ring: the oldest sample is at `start` once the ring is full.
    samples: Vec<Sample<N>>,
    start: usize,
    room: usize,
    spacing: Span,
    /// How many samples were before the window of the last evaluation: mostly there is one more now, or none.
    before: usize,
    /// Whether a condition has failed since the last sample, and the time of the last sample after a gap.
    is_interrupted: bool,
    last_gap: Time,
    /// The integral so far.
    sum: N,
    /// What a condition over time needs of the past.
    seen: temporal::Memory,
}

/// The result of a time operator, and since when it is valid.
pub(super) struct Recalled<N> {
    pub(super) value: N,
    pub(super) since: Option<Time>,
}

/// The middle of a validity, as the time of a sample.
#[inline]
pub(super) fn middle(at: Validity) -> Time {
    Time(at.from.0.midpoint(at.to.0))
}

/// The seconds from one validity to a later one: between their middles, with the least and largest possible time.
pub(super) fn elapsed(from: Validity, to: Validity) -> Constant {
    let at_least = (to.from - from.to).seconds().max(0.0);
    let at_most = (to.to - from.from).seconds().max(0.0);
    let value = (middle(to) - middle(from)).seconds();
    // the conversion from nanoseconds to floating-point seconds rounds twice
    let bounds = Interval::new(at_least.next_down().next_down().max(0.0), at_most.next_up().next_up());
    Constant { value, bounds: Interval::hull(bounds, Interval::point(value)) }
}

/// Half the length of a validity in seconds, on both sides of zero.
fn uncertainty(at: Validity) -> Constant {
    let half = (at.length().seconds() / 2.0).next_up();
    let half = if at.from == at.to { 0.0 } else { half };
    Constant { value: 0.0, bounds: Interval::new(-half, half) }
}

impl<N: Number> History<N> {
    /// Allocates the memory for samples at up to `rate` per second.
    pub(super) fn new(Remembered { operation, course, .. }: Remembered, rate: f64) -> History<N> {
        let window = match operation {
            Operation::Derivative(window) | Operation::Delay(window) | Operation::MovingMean(window) => {
                window
            }
            _ => Span::ZERO,
        };
        let wanted = libm::ceil(2.0 * window.seconds() * rate.max(0.0)) as usize;
        let room = wanted.saturating_add(4).min(MAX_SAMPLES);
        History {
            operation,
            course,
            samples: Vec::with_capacity(room),
            start: 0,
            room,
            spacing: Span(window.0 / (room as i64 - 2)),
            before: 0,
            is_interrupted: false,
            last_gap: Time::MIN,
            sum: N::MISSING,
            seen: temporal::Memory::default(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.samples.clear();
        self.start = 0;
        self.before = 0;
        (self.is_interrupted, self.last_gap) = (false, Time::MIN);
        self.sum = N::MISSING;
        self.seen = temporal::Memory::default();
    }

    /// The operator's result for its argument's present value; stores the value when it is newer than the last. `is_there`: whether
    /// the conditions hold without which the argument has no value.
    pub(super) fn recall(&mut self, value: N, is_there: bool, at: Validity, is_new: bool) -> Recalled<N> {
        self.is_interrupted |= is_new && !is_there;
        let now = Sample { at, value, follows_gap: self.is_after_gap(at) };
        let recalled = match self.operation {
            Operation::Derivative(window) => self.derivative(value, at, window),
            Operation::Delay(span) => Recalled { value: self.delay(now, span), since: None },
            Operation::MovingMean(window) => {
                // A mean is valid over its window, like a difference quotient.
                Recalled { value: self.moving_mean(now, window), since: Some(at.from - window) }
            }
            Operation::Held(_) | Operation::Answered(_) => {
                Recalled { value: self.verdict(value, at, is_new), since: None }
            }
            _ => Recalled { value: self.integral(now, is_new), since: None },
        };
        if is_new && !value.is_missing() {
            self.keep(now);
        }
        recalled
    }

    fn keep(&mut self, sample: Sample<N>) {
        let is_close = |last: &Sample<N>| middle(sample.at) - middle(last.at) < self.spacing;
        let newest = self.samples.len().checked_sub(1).and_then(|number| self.numbered(number));
        if newest.is_some_and(is_close) {
            return;
        }
        self.is_interrupted = false;
        if sample.follows_gap {
            self.last_gap = middle(sample.at);
        }
        if self.samples.len() < self.room {
            self.samples.push(sample);
        } else if let Some(oldest) = self.samples.get_mut(self.start) {
            *oldest = sample;
            self.start = (self.start + 1) % self.room;
            self.before = self.before.saturating_sub(1);
        }
    }

    /// The samples from the oldest to the newest, in two parts.
    fn parts(&self) -> (&[Sample<N>], &[Sample<N>]) {
        let (newer, older) = self.samples.split_at_checked(self.start).unwrap_or((&[], &self.samples));
        (older, newer)
    }

    /// The samples with these numbers, counted from the oldest as 0.
    fn range(&self, from: usize, to: usize) -> impl Iterator<Item = &Sample<N>> + Clone {
        let (older, newer) = self.parts();
        let count = older.len();
        let older = older.get(from.min(count)..to.min(count)).unwrap_or(&[]);
        let newer = newer.get(from.saturating_sub(count)..to.saturating_sub(count)).unwrap_or(&[]);
        older.iter().chain(newer)
    }

    /// How many of the oldest samples meet a condition that no sample meets after one that does not. Complexity: O(log d), d
    /// samples from the guess.
    fn first_ones(&self, guess: usize, is_so: impl Fn(&Sample<N>) -> bool) -> usize {
        let count = self.samples.len();
        let is_so = |number: usize| self.numbered(number).is_some_and(&is_so);
        let guess = guess.min(count);
        // The answer is at least `from` and at most `to`.
        let (mut from, mut to, mut step) = (0, guess, 1);
        if is_so(guess) {
            from = guess + 1;
            loop {
                let next = from + step - 1;
                if !is_so(next) {
                    to = next.min(count);
                    break;
                }
                (from, step) = (next + 1, step * 2);
            }
        } else {
            while to > 0 {
                let next = to.saturating_sub(step);
                if is_so(next) {
                    from = next + 1;
                    break;
                }
                (to, step) = (next, step * 2);
            }
        }
        while from < to {
            let middle = from.midpoint(to);
            if is_so(middle) { from = middle + 1 } else { to = middle }
        }
        from
    }

    /// How many samples are before a time: mostly all of them.
    fn count_before(&self, time: Time) -> usize {
        let count = self.samples.len();
        let newest = count.checked_sub(1).and_then(|number| self.numbered(number));
        match newest {
            Some(newest) if middle(newest.at) >= time => {
                self.first_ones(count, |sample| middle(sample.at) < time)
            }
            _ => count,
        }
    }

    /// The sample of a number, counted from the oldest as 0.
    fn numbered(&self, number: usize) -> Option<&Sample<N>> {
        let place = self.start + number;
        let count = self.samples.len();
        self.samples.get(if place < count { place } else { place - count }).filter(|_| number < count)
    }

    /// The time that usually passes between two samples: the middle one of the last three times.
    fn usual_step(&self, now: Time) -> Span {
        let kept = (1..=3).map_while(|back| self.numbered(self.samples.len().checked_sub(back)?));
        let mut later = now;
        let mut steps = [Span::MAX; 3];
        for (step, sample) in steps.iter_mut().zip(kept) {
            *step = later - middle(sample.at);
            later = middle(sample.at);
        }
        let [one, other, third] = steps;
        one.min(other).max(one.max(other).min(third))
    }

    /// Whether a time within which there is no sample is longer than the usual ones.
    fn is_gap(&self, length: Span, now: Time) -> bool {
        length > self.usual_step(now).times(USUAL_STEPS)
    }

    /// The last sample.
    fn newest(&self) -> Option<&Sample<N>> {
        self.samples.len().checked_sub(1).and_then(|number| self.numbered(number))
    }

    /// The mean rate of change since the sample whose age is nearest to the window, and at least half of it.
    fn derivative(&mut self, value: N, at: Validity, window: Span) -> Recalled<N> {
        let now = middle(at);
        let age = |sample: &Sample<N>| now - middle(sample.at);
        let is_old = |sample: &&Sample<N>| age(sample) > Span::ZERO && age(sample) >= Span(window.0 / 2);
        let older = self.first_ones(self.before, |sample| age(sample) >= window);
        self.before = older;
        let candidates = [older.checked_sub(1), Some(older)];
        let candidates = candidates.into_iter().flatten().filter_map(|number| self.numbered(number));
        let old = candidates.filter(is_old).min_by_key(|sample| (age(sample) - window).abs());
        let is_near = |sample: &&Sample<N>| {
            let beyond = age(sample) - window;
            beyond <= Span(window.0 / 2) || !self.is_gap(beyond, now)
        };
        let Some(old) = old.filter(is_near) else { return Recalled { value: N::MISSING, since: None } };
        let time = elapsed(old.at, at);
        let (mut value, mut before) = (value, old.value);
        if self.course.offset.is_some() {
            let offset = self.course.offset.throughout(time.bounds.hi());
            (value, before) = (value.without(offset), before.without(offset));
        }
        let change = value.binary(Binary::Sub, before);
        let time = N::constant(time);
        Recalled { value: change.binary(Binary::Div, time), since: Some(old.at.from) }
    }

    /// The value a span ago: what it can be between the samples before and after that time.
    fn delay(&mut self, now: Sample<N>, span: Span) -> N {
        if self.course.is_rated() {
            return self.rated_delay(now, span);
        }
        let (at, value) = (now.at, now.value);
        self.before = self.first_ones(self.before, |sample| middle(sample.at) <= at.from - span);
        let kept = self.count_before(middle(at));
        let count = kept + usize::from(!value.is_missing());
        // The present sample comes after the kept ones.
        let numbered = |number: usize| if number < kept { self.numbered(number) } else { Some(&now) };
        let (earliest, moment, latest) = (at.from - span, middle(at) - span, at.to - span);
        let found = match self.before {
            older if older < kept => older,
            _ if count > kept && middle(at) <= earliest => count,
            _ => kept,
        };
        let Some(before) = found.checked_sub(1) else { return N::MISSING };
        // The others are at most a few samples later.
        let time = |number: usize| numbered(number).map_or(Time::MAX, |sample| middle(sample.at));
        let from = if time(before) < latest { found } else { self.count_before(latest).min(kept) };
        let after = (from..count).find(|number| time(*number) >= latest);
        let nominal = (found..count).take_while(|number| time(*number) <= moment).last().unwrap_or(before);
        let Some(after) = after else { return N::MISSING };
        let Some(nominal) = numbered(nominal) else { return N::MISSING };
        if (found..=after).filter_map(numbered).any(|sample| sample.follows_gap) {
            return N::MISSING;
        }
        (before..=after).filter_map(numbered).fold(nominal.value, |hull, sample| hull.covering(sample.value))
    }

    /// The mean over the time of the window, linear between samples; missing before the first window is over, and where nothing
    /// bounds a part of it. Complexity: O(samples within the window).
    fn moving_mean(&mut self, now: Sample<N>, window: Span) -> N {
        let at = middle(now.at);
        let age = |sample: &Sample<N>| at - middle(sample.at);
        let is_over = self.numbered(0).is_some_and(|oldest| age(oldest) >= window);
        if now.value.is_missing() || !is_over {
            return N::MISSING;
        }
        self.before = self.first_ones(self.before, |sample| age(sample) >= window);
        let numbers = self.before.saturating_sub(1)..self.count_before(at);
        match self.course.is_rated() || now.follows_gap || self.last_gap > at - window {
            true => self.bounded_mean(&now, window, numbers),
            false => self.linear_mean(&now, window, numbers),
        }
    }

    /// The verdict of a condition over time at a sample.
    fn verdict(&mut self, value: N, at: Validity, is_new: bool) -> N {
        let last = self.samples.len().checked_sub(1).and_then(|number| self.numbered(number));
        let last = last.map(|sample| middle(sample.at));
        let unseen_since = last.filter(|last| self.is_gap(middle(at) - *last, middle(at)));
        let sample = temporal::Sample { value: value.bounds(), at, unseen_since };
        let (seen, verdict) = self.seen.after(self.operation, sample);
        if is_new {
            self.seen = seen;
        }
        as_number(verdict)
    }

    /// The sum of the trapezoids since the first value. Over intervals, the value between two samples is all that it can have been:
    /// in their hull, where the rate of change is not bounded. The lengths are those between the middles of the times; the uncertainty
    /// of the first and the last time counts with the values there.
    fn integral(&mut self, now: Sample<N>, is_new: bool) -> N {
        if now.value.is_missing() {
            return N::MISSING;
        }
        let at_end = now.value.binary(Binary::Mul, N::constant(uncertainty(now.at)));
        let Some(last) = self.newest().copied() else {
            self.sum = if is_new { at_end } else { N::MISSING };
            return self.sum;
        };
        if is_new {
            let length = elapsed(Validity::at(middle(last.at)), Validity::at(middle(now.at)));
            let area = match self.course.is_rated() || now.follows_gap {
                true => {
                    let (one, other) = (last.value.bounds().midpoint(), now.value.bounds().midpoint());
                    let value = one.midpoint(other) * length.value;
                    N::constant(Constant { value, bounds: self.area(&last, &now, Time::MIN) })
                }
                false => last.value.between(now.value).binary(Binary::Mul, N::constant(length)),
            };
            self.sum = self.sum.binary(Binary::Add, area);
        }
        self.sum.binary(Binary::Add, at_end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_first_ones_are_found_from_any_guess(
            kept in 0..40_usize,
            guess in 0..50_usize,
            asked in -1..45_i64,
        ) {
            let window = Span(10);
            let remembered = Remembered { operation: Operation::Delay(window), course: Course::ANY, guards: (0, 0) };
            let mut history = History::<f64>::new(remembered, 0.0);
            history.room = 20;
            history.spacing = Span(0);
            for time in 0..kept {
                history.keep(Sample { at: Validity::at(Time(time as i64)), value: 0.0, follows_gap: false });
            }
            let is_so = |sample: &Sample<f64>| middle(sample.at) <= Time(asked);
            let (older, newer) = history.parts();
            let expected = older.iter().chain(newer).take_while(|sample| is_so(sample)).count();
            prop_assert_eq!(history.first_ones(guess, is_so), expected);
        }
    }
}
