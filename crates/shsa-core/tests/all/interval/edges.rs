//! Definitions at the edges, by tables.

use core::f64::consts::{FRAC_PI_2, PI};
use shsa_core::interval::{Interval, Truth};

const EMPTY: Interval = Interval::EMPTY;
const ENTIRE: Interval = Interval::ENTIRE;
const INF: f64 = f64::INFINITY;
const MAX: f64 = f64::MAX;
const TINY: f64 = 5e-324;

fn i(lo: f64, hi: f64) -> Interval {
    Interval::new(lo, hi)
}

fn p(value: f64) -> Interval {
    Interval::point(value)
}

#[track_caller]
fn check(result: Interval, expected: Interval) {
    assert_eq!(result, expected);
}

/// Checks equality up to two steps outward.
#[track_caller]
fn check_near(result: Interval, lo: f64, hi: f64) {
    let near = i(lo.next_down().next_down().next_down(), hi.next_up().next_up().next_up());
    assert!(result.encloses(i(lo, hi)) && near.encloses(result), "{result:?} is not near [{lo}, {hi}]");
}

#[test]
fn what_is_no_interval_is_empty() {
    for (lo, hi) in [(f64::NAN, 1.0), (1.0, f64::NAN), (2.0, 1.0), (INF, INF), (-INF, -INF)] {
        check(i(lo, hi), EMPTY);
    }
    assert!(!ENTIRE.contains(INF) && !ENTIRE.contains(f64::NAN) && ENTIRE.contains(MAX));
}

#[test]
fn exact_results_stay_points() {
    check(p(2.0) * p(5.0), p(10.0));
    check(p(1.0) + p(2.0), p(3.0));
    check(p(1.0) - p(1.0), p(0.0));
    check(p(10.0) / p(-4.0), p(-2.5));
    check(p(3.0).powi(5), p(243.0));
    check(p(0.5).powi(-3), p(8.0));
    check(p(9.0).sqrt(), p(3.0));
    check(p(3.0).hypot(p(-4.0)), p(5.0));
    check(p(3e200).hypot(p(4e200)), p(3e200).hypot(p(-4e200)));
    check(p(TINY) * p(2.0), p(2.0 * TINY));
    check(p(0.0).exp(), p(1.0));
    check(p(1.0).ln(), p(0.0));
    check(p(0.0).cos(), p(1.0));
    check(p(1.0).acos(), p(0.0));
    check(p(1.0).atan2(p(0.0)).floor(), p(1.0));
    for zero in [p(0.0).sin(), p(0.0).tan(), p(0.0).asin(), p(-0.0).atan(), p(-0.0).atan2(p(3.0))] {
        check(zero, p(0.0));
    }
}

#[test]
fn inexact_results_are_one_step_wide() {
    check(p(0.1) + p(0.2), i(0.3, 0.1 + 0.2));
    check(p(0.1) * p(10.0), i(1.0, 1f64.next_up()));
    check(p(1.0) / p(3.0), i(1.0 / 3.0, (1f64 / 3.0).next_up()));
    check(p(2.0).sqrt(), i(2f64.sqrt().next_down(), 2f64.sqrt()));
    check(p(1.0) + p(TINY), i(1.0, 1f64.next_up()));
    check(p(TINY) * p(-0.5), i(-TINY, 0.0));
}

#[test]
fn overflow_gives_unbounded() {
    check(p(MAX) + p(MAX), i(MAX, INF));
    check(p(-MAX) - p(MAX), i(-INF, -MAX));
    check(p(MAX) * p(-2.0), i(-INF, -MAX));
    check(p(1.0) / p(TINY), i(MAX, INF));
    check(i(1.0, 1e10).exp().intersection(i(MAX, INF)), i(MAX, INF));
    check(p(1e200).powi(2), i(MAX, INF));
}

#[test]
fn zero_times_everything_is_zero() {
    check(p(0.0) * ENTIRE, p(0.0));
    check(ENTIRE * p(-0.0), p(0.0));
    check(i(0.0, 1.0) * i(2.0, INF), i(0.0, INF));
    check(i(-2.0, 3.0) * i(-5.0, 4.0), i(-15.0, 12.0));
    check(i(-2.0, -1.0) * i(-5.0, -4.0), i(4.0, 10.0));
}

#[test]
fn division_through_zero() {
    check(p(1.0) / p(0.0), EMPTY);
    check(p(0.0) / p(0.0), EMPTY);
    check(p(0.0) / i(0.0, 1.0), p(0.0));
    check(p(0.0) / ENTIRE, p(0.0));
    check(i(1.0, 2.0) / i(0.0, 4.0), i(0.25, INF));
    check(i(1.0, 2.0) / i(-4.0, 0.0), i(-INF, -0.25));
    check(i(-2.0, -1.0) / i(0.0, 4.0), i(-INF, -0.25));
    check(i(-2.0, -1.0) / i(-4.0, 0.0), i(0.25, INF));
    check(i(0.0, 2.0) / i(0.0, 4.0), i(0.0, INF));
    check(i(1.0, 2.0) / i(-1.0, 1.0), ENTIRE);
    check(i(-1.0, 2.0) / i(0.0, 1.0), ENTIRE);
    check(i(1.0, INF) / i(1.0, INF), i(0.0, INF));
    check(i(0.0, 4.0).recip(), i(0.25, INF));
}

#[test]
fn powers() {
    check(i(-2.0, 3.0).powi(2), i(0.0, 9.0));
    check(i(-2.0, 3.0).sqr(), i(0.0, 9.0));
    check(i(-2.0, 3.0).powi(3), i(-8.0, 27.0));
    check(i(-2.0, 3.0).powi(0), p(1.0));
    check(p(0.0).powi(0), p(1.0));
    check(p(0.0).powi(-1), EMPTY);
    check(i(-2.0, 4.0).powi(-1), ENTIRE);
    check(i(-2.0, 4.0).powi(-2), i(0.0625, INF));
    check(ENTIRE.powi(i32::MIN), i(0.0, INF));
    check(i(-2.0, 3.0).powf(p(2.0)), i(0.0, 9.0));
    check(i(-2.0, 0.0).powf(p(0.5)), p(0.0));
    check(i(-2.0, -1.0).powf(p(0.5)), EMPTY);
    check(p(0.0).powf(i(-1.0, -0.5)), EMPTY);
    check(p(0.0).powf(i(-1.0, 0.0)), p(1.0));
    check(p(0.0).powf(i(-1.0, 0.5)), i(0.0, 1.0));
    check(p(0.0).powf(i(0.5, INF)), p(0.0));
    check(i(-0.0, 1.0).powf(i(-1.0, 1.0)), i(0.0, INF));
    check_near(i(2.0, 4.0).powf(i(0.5, 1.5)), 2f64.sqrt().next_up(), 8.0);
    check_near(i(0.25, 4.0).powf(i(-0.5, 1.5)), 0.125, 8.0);
    check(i(0.0, 0.5).powf(i(1.0, INF)).intersection(i(0.0, 0.5)), i(0.0, 0.5));
}

#[test]
fn domains_restrict() {
    check(i(-4.0, 9.0).sqrt(), i(0.0, 3.0));
    check(i(-4.0, -1.0).sqrt(), EMPTY);
    check(i(-4.0, 1.0).ln(), i(-INF, 0.0));
    check(i(-4.0, 0.0).ln(), EMPTY);
    check(i(0.0, INF).ln(), ENTIRE);
    check(i(1.5, 2.0).asin(), EMPTY);
    check(i(-3.0, -1.5).acos(), EMPTY);
    check(ENTIRE.asin(), i(-FRAC_PI_2.next_up(), FRAC_PI_2.next_up()));
    check(ENTIRE.acos(), i(0.0, PI.next_up()));
    check(ENTIRE.atan(), i(-FRAC_PI_2.next_up(), FRAC_PI_2.next_up()));
}

#[test]
fn ranges_hold() {
    check(ENTIRE.exp(), i(0.0, INF));
    check(p(-1e4).exp().intersection(i(-1.0, 0.0)), p(0.0));
    check(i(0.0, 2.0 * PI).sin(), i(-1.0, 1.0));
    check(i(-1e300, 1e300).cos(), i(-1.0, 1.0));
    check(ENTIRE.sin(), i(-1.0, 1.0));
    check_near(i(0.0, 2.0).sin(), 0.0, 1.0);
    check_near(i(1.0, 2.0).sin(), 1f64.sin(), 1.0);
    check_near(i(4.0, 5.0).sin(), -1.0, 4f64.sin());
    check_near(i(-1.0, 2.0).cos(), 2f64.cos(), 1.0);
    check_near(i(101.0, 102.0).cos(), 102f64.cos(), 101f64.cos());
    check(i(1.5, 1.6).tan(), ENTIRE);
    check(i(-1.6, -1.5).tan(), ENTIRE);
    check_near(i(-1.5, 1.5).tan(), (-1.5f64).tan(), 1.5f64.tan());
    check_near(i(2.0, 4.0).tan(), 2f64.tan(), 4f64.tan());
}

#[test]
fn angles() {
    let half = FRAC_PI_2;
    check(p(0.0).atan2(p(0.0)), EMPTY);
    check_near(p(0.0).atan2(p(-1.0)), PI, PI);
    check(p(-0.0).atan2(p(-1.0)), p(0.0).atan2(p(-1.0)));
    check(p(0.0).atan2(i(0.0, 1.0)), p(0.0));
    check(p(0.0).atan2(i(-1.0, 1.0)), i(0.0, PI.next_up()));
    check_near(i(-1.0, 0.0).atan2(p(0.0)), -half, -half);
    check_near(i(0.0, 1.0).atan2(i(-1.0, 0.0)), half, PI);
    check_near(i(-1.0, 1.0).atan2(i(0.0, 1.0)), -half, half);
    check_near(i(1.0, 2.0).atan2(i(-1.0, 1.0)), half / 2.0, 1.5 * half);
    check_near(i(-2.0, -1.0).atan2(i(-1.0, 1.0)), -1.5 * half, -half / 2.0);
    let all = i(-PI.next_up(), PI.next_up());
    check(i(-1.0, 0.0).atan2(i(-2.0, -1.0)), all);
    check(i(-1.0, 1.0).atan2(i(-1.0, 1.0)), all);
    check(ENTIRE.atan2(ENTIRE), all);
}

#[test]
fn measures() {
    assert_eq!(p(3.0).width(), 0.0);
    assert_eq!(EMPTY.width(), 0.0);
    assert_eq!(i(-MAX, MAX).width(), INF);
    assert_eq!(i(0.1, 1.0).width(), 0.9);
    assert!(EMPTY.midpoint().is_nan() && EMPTY.magnitude().is_nan() && EMPTY.mignitude().is_nan());
    assert_eq!(ENTIRE.midpoint(), 0.0);
    assert_eq!(i(1.0, INF).midpoint(), MAX);
    assert_eq!(i(-INF, 1.0).midpoint(), -MAX);
    assert_eq!(p(MAX).midpoint(), MAX);
    assert_eq!(p(TINY).midpoint(), TINY);
    assert_eq!(i(-3.0, 2.0).mignitude(), 0.0);
    assert_eq!(i(-3.0, -2.0).mignitude(), 2.0);
    assert_eq!(i(-3.0, 2.0).magnitude(), 3.0);
    assert_eq!(i(0.0, 1.0).distance(i(3.0, 4.0)), 2.0);
    assert_eq!(i(0.0, 1.0).distance(EMPTY), INF);
    check(p(1.0).widened(0.5), i(0.5, 1.5));
    check(p(1.0).widened(-0.5), EMPTY);
    check(p(1.0).widened(f64::NAN), EMPTY);
    check(p(1.0).widened(INF), ENTIRE);
    check(EMPTY.widened(1.0), EMPTY);
}

#[test]
fn steps() {
    check(i(-1.5, 2.5).floor(), i(-2.0, 2.0));
    check(i(-1.5, 2.5).ceil(), i(-1.0, 3.0));
    check(i(-1.5, 2.5).round(), i(-2.0, 3.0));
    check(i(-1.5, 2.5).sign(), i(-1.0, 1.0));
    check(i(-0.0, 2.5).sign(), i(0.0, 1.0));
    check(ENTIRE.floor(), ENTIRE);
    check(i(-3.0, 2.0).abs(), i(0.0, 3.0));
    check(i(1.0, 4.0).min(i(2.0, 3.0)), i(1.0, 3.0));
    check(i(1.0, 4.0).max(i(2.0, 3.0)), i(2.0, 4.0));
}

#[test]
fn comparisons() {
    use Truth::{False, True, Unknown};
    let (low, high, both) = (i(0.0, 1.0), i(1.0, 2.0), i(0.5, 1.5));
    assert_eq!([low.lt(high), low.le(high), low.gt(high), low.ge(high)], [Unknown, True, False, Unknown]);
    assert_eq!([low.lt(both), low.eq(both), low.lt(i(3.0, 4.0))], [Unknown, Unknown, True]);
    assert_eq!([p(1.0).eq(p(1.0)), p(1.0).eq(p(2.0)), low.eq(low)], [True, False, Unknown]);
    assert_eq!([EMPTY.lt(low), low.ge(EMPTY), EMPTY.eq(EMPTY)], [Unknown; 3]);
    assert_eq!([!True, !Unknown, !False], [False, Unknown, True]);
    assert_eq!(
        [True.and(Unknown), False.and(Unknown), True.or(Unknown), False.or(Unknown)],
        [Unknown, False, True, Unknown]
    );
    assert_eq!([Truth::from(true), Truth::from(false)], [True, False]);
}
