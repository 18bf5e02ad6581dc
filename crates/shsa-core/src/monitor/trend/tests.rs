//! Tests of the trend detectors with made differences.

use super::*;
use crate::interval::Interval;
use proptest::prelude::*;

const PERIOD_S: f64 = 0.1;

/// Compares a value of half-width 0.5 with another one; the differences are shares of the tolerance.
fn after(
    count: usize,
    mut difference: impl FnMut(f64) -> f64,
    mut truth: impl FnMut(f64) -> f64,
) -> (Trend, f64) {
    let mut trend = Trend::new(TrendOptions::default(), Span::ZERO, Noise::Declared(0.0));
    for number in 0..count {
        let seconds = number as f64 * PERIOD_S;
        let now = Time::from_seconds(seconds);
        let around = |middle: f64| Interval::new(middle - 0.5, middle + 0.5);
        let validity = Validity { from: now, to: now };
        let (value, other) = (around(truth(seconds) + difference(seconds)), around(truth(seconds)));
        trend.record(&Measured::of(value), &Measured::of(other), validity, now);
        if !matches!(trend.tendency(), Tendency::Calm | Tendency::Building) {
            return (trend, seconds);
        }
    }
    (trend, f64::INFINITY)
}

/// Numbers in [-1, 1] from a simple generator.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 1u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }
}

#[test]
fn a_slow_drift_is_found_while_single_comparisons_agree() {
    let mut noise = noise();
    let (trend, seconds) = after(10_000, |seconds| 0.01 * seconds + 0.3 * noise(), |_| 0.0);
    assert_eq!(trend.tendency(), Tendency::Drift);
    assert!((40.0..97.0).contains(&seconds), "{seconds}");
    assert!((0.4..0.85).contains(&trend.mean()), "{}", trend.mean());
    assert_eq!(trend.raised(), Time::from_seconds(seconds));
}

#[test]
fn a_difference_that_has_always_been_there_is_no_drift() {
    let (_, seconds) = after(10_000, |_| 0.8, |_| 0.0);
    assert!(seconds.is_infinite());
}

#[test]
fn noise_beyond_the_errors_is_found_and_within_them_not() {
    let mut large = noise();
    let (trend, seconds) = after(1_000, |_| 0.95 * large(), |_| 0.0);
    assert_eq!(trend.tendency(), Tendency::Noise);
    assert!(seconds < 20.0, "{seconds}");
    let mut small = noise();
    let (trend, seconds) = after(10_000, |_| 0.5 * small(), |_| 0.0);
    assert!(seconds.is_infinite(), "{trend:?}");
}

#[test]
fn a_shift_in_time_is_found_with_its_length() {
    let truth = |seconds: f64| 2.0 * libm::sin(seconds);
    let (trend, _) = after(10_000, |seconds| truth(seconds - 0.4) - truth(seconds), truth);
    assert_eq!(trend.tendency(), Tendency::Skew);
    let skew = trend.skew().unwrap().seconds();
    assert!((0.3..0.5).contains(&skew), "{skew}");
}

#[test]
fn a_jump_has_no_character_of_its_own() {
    let (trend, seconds) = after(1_000, |seconds| if seconds < 50.0 { 0.0 } else { 3.0 }, |_| 0.0);
    assert!(seconds.is_infinite());
    assert_eq!(trend.character(), Tendency::Calm);
}

#[test]
fn a_drift_is_over_when_the_difference_is() {
    let (mut trend, _) = after(10_000, |seconds| 0.01 * seconds, |_| 0.0);
    for number in 0..100 {
        let now = Time::from_seconds(1e4 + PERIOD_S * f64::from(number));
        let value = Interval::new(-0.5, 0.5);
        trend.record(&Measured::of(value), &Measured::of(value), Validity { from: now, to: now }, now);
    }
    assert_eq!(trend.tendency(), Tendency::Calm);
}

/// What a fault shows while the usual difference is learnt is not taken for usual: when the fault is over, all is calm.
#[test]
fn a_fault_at_the_beginning_teaches_nothing() {
    for (fault, is_conflict) in [(0.9, false), (3.0, true)] {
        let mut trend = Trend::new(TrendOptions::default(), Span::ZERO, Noise::Known(0.2));
        let mut noise = noise();
        let mut accused = 0;
        for number in 0..2_000 {
            let is_faulty = (100..700).contains(&number);
            match is_faulty && is_conflict {
                true => trend.engage(),
                false => trend.relax(),
            }
            let now = Time::from_seconds(f64::from(number));
            let middle = 0.3 * noise() + if is_faulty { fault } else { 0.0 };
            let value = Interval::new(middle - 0.5, middle + 0.5);
            let other = Interval::new(-0.5, 0.5);
            trend.record(&Measured::of(value), &Measured::of(other), Validity { from: now, to: now }, now);
            accused += i32::from(is_faulty && trend.tendency() == Tendency::Drift);
            assert!(number < 800 || !trend.tendency().is_alarm(), "{fault} at {number}: {trend:?}");
        }
        assert!(is_conflict || accused > 500, "{accused}");
    }
}

proptest! {
    #[test]
    fn what_stays_within_the_allowance_is_calm(
        offset in -0.35..0.35_f64, own in proptest::collection::vec(-0.05..0.05_f64, 50..400),
    ) {
        let mut own = own.into_iter().cycle();
        let (trend, _) = after(2_000, |_| offset + own.next().unwrap(), |seconds| seconds);
        prop_assert!(trend.tendency() != Tendency::Drift && trend.tendency() != Tendency::Noise);
    }

    #[test]
    fn it_takes_anything(values in proptest::collection::vec((any::<f64>(), any::<f64>(), any::<i64>()), 0..60)) {
        let mut trend = Trend::new(TrendOptions::default(), Span::ZERO, Noise::Declared(0.0));
        for (one, other, time) in values {
            let moment = Validity { from: Time(time), to: Time(time) };
            let around = |value: f64| Interval::new(value - 1.0, value + 1.0);
            let (one, other) = (Measured::of(around(one)), Measured::of(around(other)));
            trend.record(&one, &other, moment, Time(time));
            prop_assert!(trend.mean().is_finite() || trend.mean().is_infinite());
        }
    }
}
