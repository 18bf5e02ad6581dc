//! The value of a history at a moment without an observation, with a bound instead of a guess.
//!
//! Where the model bounds the rate of change, the sample with the nearest time gives the value, widened by the possible change in
//! between. Without such a bound, only moments between two samples have a value: the hull of both neighbours. A moment after the
//! newest sample has no value yet, and nothing is extrapolated. Where a value stands until the next one, the last value holds at
//! every moment.

use super::history::{History, Reach, Reading, Sample, farthest};
use super::line::{Line, bulge, turn};
use crate::interval::Interval;
use crate::numbers::FEWEST;
use crate::time::{Span, Time, Validity};

/// The knowledge about the value at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// An interval that holds the true value, SI.
    Value(Interval),
    /// Not known yet: a later sample may give the value.
    Later,
    /// Not known, and no later sample will give the value.
    Never,
}

impl Known {
    /// The value, where there is one.
    #[must_use]
    pub fn value(self) -> Option<Interval> {
        match self {
            Known::Value(value) => Some(value),
            Known::Later | Known::Never => None,
        }
    }

    /// The value; without one, [`Known::Never`].
    #[must_use]
    pub fn or_never(value: Option<Interval>) -> Known {
        value.map_or(Known::Never, Known::Value)
    }
}

impl History {
    /// The value at a moment; see the head of this file.
    ///
    /// The value may turn between two samples: the hull is grown by the curvature of these two samples and the one before.
    /// Complexity: O(samples that are newer than the moment or overlap it).
    #[inline]
    #[must_use]
    pub fn about(&self, moment: Validity, reach: Reach) -> Known {
        match self.newest_about(moment, reach) {
            Some(margin) => Known::Value(self.top().value.widened(margin)),
            None => self.about_any(moment, reach),
        }
    }

    /// The margin that the newest sample needs to hold the value at a moment, where it is certainly the nearest and near enough:
    /// the most frequent case, tested quickly.
    // Called with every comparison from two places: `inline` alone would not inline it.
    #[inline(always)]
    #[must_use]
    pub fn newest_about(&self, moment: Validity, reach: Reach) -> Option<f64> {
        if !self.is_certainly_newest(moment) {
            return None;
        }
        let newest = self.top().validity;
        let away = farthest(newest, moment);
        let is_near =
            away == Span::ZERO || (reach.max_rate > 0.0 && moment.from - newest.to <= reach.max_gap);
        is_near.then(|| away.seconds() * reach.max_rate)
    }

    /// Whether the newest sample is certainly the nearest to a moment: it ends no later than the moment, and after all others.
    #[inline(always)]
    pub(super) fn is_certainly_newest(&self, moment: Validity) -> bool {
        let newest = self.top().validity;
        newest.to <= moment.to && self.end_before() < newest.to
    }

    #[inline(never)]
    fn about_any(&self, moment: Validity, reach: Reach) -> Known {
        if reach.stands {
            let reading = self.at(moment, reach);
            reading.map_or(Known::Never, |reading| Known::Value(reading.value))
        } else if reach.max_rate > 0.0 {
            self.within_reach(moment, reach)
        } else {
            self.around(moment, reach.max_gap)
        }
    }

    /// What stands at a moment: the last value before it, and all that may have followed it by its end. `None` before the first
    /// one. Complexity: O(samples newer than the moment, and those that overlap it).
    #[must_use]
    pub fn held_reading(&self, moment: Validity) -> Option<Reading> {
        let mut value = Interval::EMPTY;
        for sample in self.newest_first().skip_while(|sample| sample.validity.from > moment.to) {
            value = value.hull(sample.value);
            if sample.validity.to <= moment.from {
                return Some(Reading { value, gap: moment.from - sample.validity.to });
            }
        }
        (!value.is_empty()).then_some(Reading { value, gap: Span::ZERO })
    }

    /// The value of the sample with this validity; of several, their hull. Complexity: O(samples that are newer).
    #[must_use]
    pub fn exactly_at(&self, moment: Validity) -> Option<Interval> {
        let newer = self.newest_first().skip_while(|sample| sample.validity.to > moment.to);
        let same = newer.take_while(|sample| sample.validity.to == moment.to);
        let same = same.filter(|sample| sample.validity.from == moment.from);
        same.map(|sample| sample.value).reduce(Interval::hull)
    }

    /// The certainly nearest sample, grown by the rate of change over the longest time in between: this bounds the effect of time
    /// errors.
    fn within_reach(&self, moment: Validity, reach: Reach) -> Known {
        match self.certainly_nearest(moment) {
            Some((away, sample)) if sample.validity.gap(moment) <= reach.max_gap => {
                Known::Value(sample.value.widened(away.seconds() * reach.max_rate))
            }
            // What comes after the newest sample is no nearer to a moment before it.
            _ if self.newest(0).is_some_and(|newest| newest.validity.to >= moment.from) => Known::Never,
            _ => Known::Later,
        }
    }

    /// The sample of which no point is as far from any point of a moment as with the others, and that longest time.
    #[inline(never)]
    pub(super) fn certainly_nearest<'h>(&'h self, moment: Validity) -> Option<(Span, &'h Sample)> {
        let mut least = Span::MAX;
        let mut nearest: Option<&Sample> = None;
        let mut take = |sample: &'h Sample| {
            let away = farthest(sample.validity, moment);
            let is_nearer = away <= least;
            if is_nearer {
                (least, nearest) = (away, Some(sample));
            }
            is_nearer
        };
        let (newer, older) = self.newer_and_older();
        // Two loops: one over a chain of both is twice as slow.
        if newer.iter().rev().all(&mut take) {
            older.iter().rev().all(&mut take);
        }
        nearest.map(|nearest| (least, nearest))
    }

    /// The hull of the samples from the last one that is certainly before a moment to the first one that is certainly after
    /// it, where these are not further apart than `max_gap`.
    #[must_use]
    pub fn around(&self, moment: Validity, max_gap: Span) -> Known {
        let mut after: Option<Sample> = None;
        let mut hull = Interval::EMPTY;
        let mut samples = self.newest_first();
        while let Some(&sample) = samples.next() {
            let Validity { from, to } = sample.validity;
            if from >= moment.to && to > moment.from {
                after = Some(sample);
                continue;
            }
            if from >= moment.to {
                // The sample is at the very moment: nothing lies in between.
                return Known::or_never(self.exactly_at(sample.validity));
            }
            let Some(later) = after else { return Known::Later };
            let is_next = hull.is_empty();
            hull = hull.hull(later.value).hull(sample.value);
            if to <= moment.from {
                let is_near = later.validity.from - to <= max_gap + moment.length();
                let turn = if is_next { turn(samples, &sample, &later) } else { 0.0 };
                return if is_near { Known::Value(hull.widened(turn)) } else { Known::Never };
            }
        }
        if after.is_some() { Known::Never } else { Known::Later }
    }

    /// How far the value at a moment, and those one and two steps before, are from a straight line: the magnitude of the second
    /// difference of their middles. `None` where one of them is not known. Complexity: O(samples since then).
    #[must_use]
    pub fn bend(&self, moment: Time, step: Span, max_gap: Span) -> Option<f64> {
        let middle = |at| self.between_centres(at, max_gap).map(|(value, _)| value.midpoint());
        Some((middle(moment)? - 2.0 * middle(moment - step)? + middle(moment - step.times(2))?).abs())
    }

    /// The best guess of the value at a moment between two samples: on the straight line through their middles. It is no bound,
    /// and used for statistics. Complexity: O(samples newer than the moment).
    #[must_use]
    pub fn line_at(&self, moment: Time) -> Option<Line> {
        let mut after: Option<&Sample> = None;
        let mut samples = self.newest_first();
        while let Some(sample) = samples.next() {
            let (time, value) = (sample.validity.centre(), sample.value.midpoint());
            if time > moment {
                after = Some(sample);
                continue;
            }
            let older = samples.next();
            let slope_to = |one: &Sample, other: &Sample| {
                let seconds = (other.validity.centre() - one.validity.centre()).seconds();
                (other.value.midpoint() - one.value.midpoint()) / seconds
            };
            let Some(later) = after.filter(|_| time < moment) else {
                let slope = older.or(after).map_or(0.0, |beside| slope_to(sample, beside));
                return (time == moment).then_some(Line {
                    value,
                    slope,
                    bulge: 0.0,
                    gap: Span::ZERO,
                    since: Span::ZERO,
                });
            };
            let slope = slope_to(sample, later);
            let bulge = older.map_or(0.0, |older| bulge(older, sample, later));
            let (gap, since) = (later.validity.centre() - time, moment - time);
            return Some(Line { value: value + slope * since.seconds(), slope, bulge, gap, since });
        }
        None
    }

    /// The hull of the samples that overlap a moment and the newest ones before it, grown by twice the spread of their middles:
    /// recent changes may go on. This is no proof, but enough to prefer another way. `None` where the newest sample is further
    /// away than `max_gap`, or there are too few.
    #[must_use]
    pub fn roughly_at(&self, moment: Validity, max_gap: Span) -> Option<Interval> {
        let newest = self.newest(0).filter(|newest| newest.validity.gap(moment) <= max_gap)?;
        self.newest((FEWEST as usize) - 1)?;
        let (mut hull, mut middles) = (newest.value, Interval::point(newest.value.midpoint()));
        for (number, sample) in self.newest_first().enumerate() {
            if number >= (FEWEST as usize) && sample.validity.intersection(moment).is_none() {
                break;
            }
            hull = hull.hull(sample.value);
            middles = middles.hull(Interval::point(sample.value.midpoint()));
        }
        Some(hull.widened(2.0 * middles.width()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SECOND: Span = Span(1_000_000_000);

    fn point(seconds: f64) -> Validity {
        Validity::at(Time::from_seconds(seconds))
    }

    fn history(samples: &[(f64, f64)]) -> History {
        let mut history = History::new(16);
        for &(seconds, value) in samples {
            history.push(Sample { validity: point(seconds), value: Interval::new(value - 0.1, value + 0.1) });
        }
        history
    }

    #[test]
    fn without_a_rate_of_change_nothing_is_said_after_the_newest_sample() {
        let reach = Reach { max_rate: 0.0, max_gap: SECOND.times(2), stands: false };
        let history = history(&[(0.0, 1.0), (1.0, 2.0)]);
        assert_eq!(history.about(point(1.5), reach), Known::Later);
        assert_eq!(history.about(point(-0.5), reach), Known::Never);
        assert_eq!(history.about(point(0.5), reach), Known::Value(Interval::new(0.9, 2.1)));
        assert_eq!(history.about(point(1.0), reach), Known::Value(Interval::new(1.9, 2.1)));
    }

    #[test]
    fn the_best_guess_lies_on_a_line() {
        let history = history(&[(0.0, 1.0), (1.0, 2.0), (2.0, 6.0)]);
        let check = |seconds: f64, expected: Option<f64>| {
            let line = history.line_at(Time::from_seconds(seconds));
            assert_eq!(line.map(|line| line.value), expected, "{seconds}");
        };
        check(0.5, Some(1.5));
        check(1.0, Some(2.0));
        check(1.25, Some(3.0));
        check(2.0, Some(6.0));
        check(2.5, None);
        check(-0.5, None);
    }

    #[test]
    fn too_far_apart_says_nothing() {
        let reach = Reach { max_rate: 0.0, max_gap: SECOND.times(2), stands: false };
        assert_eq!(history(&[(0.0, 1.0), (3.0, 2.0)]).about(point(1.5), reach), Known::Never);
    }

    #[test]
    fn with_a_rate_of_change_the_nearest_grows() {
        let reach = Reach { max_rate: 1.0, max_gap: SECOND.times(2), stands: false };
        let value = history(&[(0.0, 1.0), (1.0, 2.0)]).about(point(1.5), reach).value().unwrap();
        assert!((value.lo() - 1.4).abs() < 1e-9 && (value.hi() - 2.6).abs() < 1e-9, "{value:?}");
    }

    #[test]
    fn what_stands_is_known_until_the_next_value() {
        let history = history(&[(0.0, 1.0), (10.0, 5.0)]);
        let check = |seconds: f64, max_rate: f64, expected: Option<(f64, f64)>| {
            let reach = Reach { max_rate, max_gap: SECOND, stands: true };
            let expected = expected.map(|(lo, hi)| Interval::new(lo, hi));
            assert_eq!(history.about(point(seconds), reach).value(), expected, "{seconds}");
            assert_eq!(history.at(point(seconds), reach).map(|reading| reading.value), expected, "{seconds}");
        };
        check(-0.5, 0.0, None);
        check(0.0, 0.0, Some((0.9, 1.1)));
        check(9.5, 0.0, Some((0.9, 1.1)));
        check(1_000.0, 0.0, Some((4.9, 5.1)));
        check(2.0, 1.0, Some((0.9 - 2.0, 1.1 + 2.0)));
    }

    #[test]
    fn an_error_of_time_hides_no_outlier() {
        let wide = |seconds: f64| Validity {
            from: Time::from_seconds(seconds - 1.0),
            to: Time::from_seconds(seconds + 1.0),
        };
        let mut history = History::new(16);
        for (seconds, value) in
            [(0.0, 20.0), (0.5, 1020.0), (1.0, 20.0), (1.5, 20.0), (2.0, 20.0), (3.0, 20.0)]
        {
            history.push(Sample { validity: wide(seconds), value: Interval::point(value) });
        }
        assert_eq!(history.exactly_at(wide(0.5)), Some(Interval::point(1020.0)));
        let rated = Reach { max_rate: 0.1, max_gap: SECOND, stands: false };
        let value = history.about(wide(1.5), rated).value().unwrap();
        assert!(value.hi() < 21.0, "{value:?}");
    }

    proptest! {
        /// The known value holds the truth, for any smooth plant that does not turn faster than its samples show.
        #[test]
        fn what_is_said_holds_the_truth(
            amplitude in 0.1..10.0_f64, period in 12.0..60.0_f64, phase in 0.0..6.0_f64,
            at in 4.0..7.0_f64, is_rated: bool, error in 0.0..1.0_f64,
        ) {
            let truth = |seconds: f64| amplitude * libm::sin(seconds * 6.3 / period + phase);
            let samples: std::vec::Vec<(f64, f64)> = (0..9).map(|n| (f64::from(n), truth(f64::from(n)))).collect();
            let mut history = History::new(16);
            for (seconds, value) in samples {
                let off = if (seconds as i64) % 2 == 0 { error } else { -error };
                let value = Interval::new(value + 0.9 * off - error - 1e-9, value + 0.9 * off + error + 1e-9);
                history.push(Sample { validity: point(seconds), value });
            }
            let max_rate = if is_rated { amplitude * 6.3 / period } else { 0.0 };
            let reach = Reach { max_rate, max_gap: SECOND.times(2), stands: false };
            let value = history.about(point(at), reach).value().unwrap();
            let slack = 0.02 * amplitude;
            prop_assert!(value.widened(slack).contains(truth(at)), "{:?} {}", value, truth(at));
        }

        #[test]
        fn anything_may_come(samples in prop::collection::vec((any::<i64>(), 0..1000_i64, any::<f64>()), 0..20), at in any::<i64>(), long in 0..1000_i64) {
            let mut history = History::new(8);
            for (to, long, value) in samples {
                let validity = Validity { from: Time(to.saturating_sub(long)), to: Time(to) };
                history.push(Sample { validity, value: Interval::point(value) });
            }
            let moment = Validity { from: Time(at), to: Time(at.saturating_add(long)) };
            for max_rate in [0.0, 1.0] {
                _ = history.about(moment, Reach { max_rate, max_gap: Span(500), stands: false });
            }
            _ = history.roughly_at(moment, Span(500));
        }
    }
}
