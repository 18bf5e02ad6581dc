//! Tests of values at a moment, and of the ring.

use super::*;
use crate::alignment::Known;
use proptest::prelude::*;

fn sample(from: i64, to: i64, value: f64) -> Sample {
    Sample { validity: Validity { from: Time(from), to: Time(to) }, value: Interval::point(value) }
}

const REACH: Reach = Reach { max_rate: 0.0, max_gap: Span(10), stands: false };

#[test]
fn the_port_reads_the_nearest_value_and_its_uncertainty_grows() {
    let mut history = History::new(4);
    for time in [0, 10, 20] {
        history.push(sample(time, time, time as f64));
    }
    let reach = Reach { max_rate: 1e9, max_gap: Span(5), stands: false };
    let reading = history.at(Validity::at(Time(23)), reach).unwrap();
    assert_eq!(reading.gap, Span(3));
    assert!(reading.value.contains(17.0) && reading.value.contains(23.0) && !reading.value.contains(16.9));
    assert_eq!(history.at(Validity::at(Time(26)), reach), None);
    assert_eq!(history.at(Validity::at(Time(10)), reach).unwrap().value, Interval::point(10.0));
    let between = history.at(Validity { from: Time(9), to: Time(21) }, reach).unwrap();
    // The newest value is up to 11 away from some point of the moment.
    assert!(between.value.contains(9.0) && between.value.contains(31.0) && between.value.width() < 22.1);
    let unrated = Reach { max_rate: 0.0, ..reach };
    assert_eq!(
        history.at(Validity { from: Time(9), to: Time(21) }, unrated).unwrap().value,
        Interval::new(10.0, 20.0)
    );
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
    let mean =
        |from, to| history.mean_over(Validity { from: Time(from), to: Time(to) }, Course::ANY, Span::MAX);
    // 0 for 5, 10 for 10, 20 for 25, 60 for 25, 70 for 5.
    let expected = (100.0 + 500.0 + 1500.0 + 350.0) / 70.0;
    assert!((mean(0, 70).unwrap().midpoint() - expected).abs() < 1e-9);
    // The last sample counts for the time without one.
    let expected = (60.0 * 5.0 + 70.0 * 35.0) / 40.0;
    assert!((mean(60, 100).unwrap().midpoint() - expected).abs() < 1e-9);
    // Of a straight line it holds the truth, although the last sample stands for a time without one.
    assert!(mean(0, 80).unwrap().contains(40.0));
    assert_eq!(mean(15, 25), None);
    assert_eq!(mean(20, 20), None);
    // A mean with more than a quarter missing at its begin is unknown.
    assert!(mean(-23, 70).is_some());
    assert_eq!(mean(-24, 70), None);
}

#[test]
fn between_the_middles_of_two_means_a_value_is_in_proportion() {
    let mut history = History::new(4);
    let gap = Span(40);
    assert_eq!(history.centred_at(Validity::at(Time(5)), Span::ZERO, gap), None);
    [(0, 10, 1.0), (10, 20, 2.0), (50, 60, 4.0)].into_iter().for_each(|(from, to, value)| {
        history.push(sample(from, to, value));
    });
    let at = |from, to| {
        history
            .centred_at(Validity { from: Time(from), to: Time(to) }, Span::ZERO, gap)
            .map(|(value, _)| value.lo())
    };
    // Middles are 5, 15 and 55; only the middle of the requested moment counts.
    assert_eq!([at(55, 55), at(0, 90), at(0, 10), at(8, 12)], [Some(4.0), Some(3.5), Some(1.0), Some(1.5)]);
    let (unsure, _) = history.centred_at(Validity::at(Time(15)), Span(10), gap).unwrap();
    assert_eq!((unsure.lo(), unsure.hi()), (1.0, 2.5));
    // Between samples too far apart, too far from the newest one, and before all of them.
    let near = |time: i64| {
        history.centred_at(Validity::at(Time(time)), Span::ZERO, Span(12)).map(|(value, _)| value.lo())
    };
    assert_eq!([10, 15, 25, 67, 68, 4].map(near), [Some(1.5), Some(2.0), None, Some(4.0), None, None]);
}

proptest! {
    /// The middle of a mean lies within its samples, and the mean of a constant is exact but for rounding.
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
        let mean = history.mean_over(stretch, Course::ANY, Span::MAX);
        prop_assert!(mean.is_none() || inside.len() >= 2);
        if let Some((value, _)) = history.centred_at(stretch, Span(3), Span(20)) {
            prop_assert!(value.lo() >= -3.0 - 1e-9 && value.hi() <= 2.0 + 1e-9 && !value.is_empty());
        }
        if let Some(mean) = mean {
            let (lo, hi) = (
                inside.iter().copied().fold(f64::INFINITY, f64::min),
                inside.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            );
            prop_assert!(lo - 1e-9 <= mean.midpoint() && mean.midpoint() <= hi + 1e-9 && !mean.is_empty());
            prop_assert!(lo < hi || mean.width() < 1e-9);
        }
    }

    /// With integrals that are kept, a mean is as wide as without, but for rounding, whatever comes late, is dropped, or makes room.
    #[test]
    fn kept_integrals_change_no_mean(
        samples in proptest::collection::vec((0i64..60, -3i32..4), 1..40), unsure in 0i64..4, from in -5i64..60, length in 1i64..40,
        room in 1usize..8, more in 0usize..8, max_rate in 0.1..3.0_f64, begun in 0usize..20, is_ranged: bool,
    ) {
        let range = if is_ranged { Interval::new(-4.0, 3.5) } else { Interval::ENTIRE };
        let course = Course { max_rate: max_rate * 1e9, range, ..Course::ANY };
        let (mut plain, mut keeping) = (History::new(room), History::new(room));
        for (number, (from, value)) in samples.into_iter().enumerate() {
            let next = match value {
                // Nothing is known, as of a quotient whose divisor may be 0.
                3 => Sample { value: Interval::ENTIRE, ..sample(from, from + unsure, 0.0) },
                value => sample(from, from + unsure, f64::from(value)),
            };
            assert_eq!(plain.push(next), keeping.push(next));
            if number == begun {
                keeping.keep_areas(course);
            }
            if number == 12 {
                plain.make_room(room + more);
                keeping.make_room(room + more);
            }
        }
        let stretch = Validity { from: Time(from), to: Time(from + length) };
        let mean = |history: &History| history.possible_mean(stretch, course, Span::MAX, |length| length);
        let (one, other) = (mean(&plain), mean(&keeping));
        prop_assert_eq!(one.is_some(), other.is_some());
        if let (Some(one), Some(other)) = (one, other) {
            prop_assert!((one.lo() - other.lo()).abs() < 1e-9 && (one.hi() - other.hi()).abs() < 1e-9, "{one:?} {other:?}");
        }
    }

    /// The fast test of the newest sample alone gives the result of the full one.
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
        let reach = Reach { max_rate: 0.0, max_gap: Span::MAX, stands: false };
        prop_assert_eq!(history.at(moment, reach), Some(Reading { value, gap }));
    }

    /// Once there is a sample after a moment, nothing is waited for.
    #[test]
    fn what_lies_in_the_past_is_known_or_never_known(
        samples in proptest::collection::vec((0i64..100, 0i64..12), 1..8), from in -5i64..110, length in 0i64..12,
        max_gap in 0i64..60, max_rate in prop_oneof![Just(0.0), Just(1e9)],
    ) {
        let mut history = History::new(16);
        for (from, length) in &samples {
            history.push(sample(*from, from + length, 1.0));
        }
        let moment = Validity { from: Time(from), to: Time(from + length) };
        let reach = Reach { max_rate, max_gap: Span(max_gap), stands: false };
        let is_past = samples.iter().any(|(from, _)| Time(*from) > moment.to);
        prop_assert!(!is_past || history.about(moment, reach) != Known::Later);
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
