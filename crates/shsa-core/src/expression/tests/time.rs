//! Tests of time operators: their memory, and the validity of their results.

use super::*;
use crate::time::{Span, Time, Validity};
use proptest::prelude::*;

fn clock() -> Model {
    Model::new().variable("x", "m", None).variable("y", "m/s", None).vector("v", "m")
}

fn compiled(text: &str, output: u32) -> Program {
    let formula = clock().formula(text);
    Program::compile(&[Assignment { symbol: Symbol(output), formula: &formula, condition: None }]).unwrap()
}

fn at(seconds: f64) -> Validity {
    Validity::at(Time::from_seconds(seconds))
}

/// The outputs for values of `x` at times, over numbers; each lies in the one over intervals.
#[track_caller]
fn check(text: &str, samples: &[(f64, f64)], expected: &[f64]) {
    let program = compiled(text, 9);
    let (mut numbers, mut intervals) = (program.new_state(0, 10.0), program.new_state(0, 10.0));
    let mut found = std::vec::Vec::new();
    for (time, x) in samples {
        let number: f64 =
            program.evaluate(&mut numbers, &[Value::Scalar(*x)], at(*time), None).value.scalar();
        let x = Value::Scalar(Interval::point(*x));
        let interval = program.evaluate(&mut intervals, &[x], at(*time), None).value.scalar();
        assert_eq!(number.is_nan(), interval.is_empty(), "{text} at {time}: {number} and {interval:?}");
        assert!(
            number.is_nan() || interval.contains(number),
            "{text} at {time}: {number} outside of {interval:?}"
        );
        found.push((number * 1e6).round() / 1e6);
    }
    assert_eq!(std::format!("{found:?}"), std::format!("{expected:?}"), "of {text}");
}

const N: f64 = f64::NAN;

#[test]
fn previous_and_elapsed() {
    let samples = [(0.0, 1.0), (0.5, 2.0), (1.5, 4.0), (2.0, N), (2.5, 5.0), (3.0, 7.0)];
    check("previous(x)", &samples, &[N, 1.0, 2.0, 4.0, N, 5.0]);
    check("dt + 0 * x / 1 m * 1 s", &samples, &[N, 0.5, 1.0, N, 0.5, 0.5]);
    check("(x - previous(x)) / dt", &samples, &[N, 2.0, 2.0, N, N, 4.0]);
    check("previous(x^2 + 1 m^2)", &samples, &[N, 2.0, 5.0, 17.0, N, 26.0]);
}

#[test]
fn the_last_trusted_value_comes_from_outside() {
    let program = compiled("previous(x) - y * dt", 0);
    let previous = Input { symbol: Symbol(0), kind: InputKind::Previous };
    assert_eq!(program.inputs(), [previous, Input { symbol: Symbol(1), kind: InputKind::Current }]);
    let mut state = program.new_state(0, 10.0);
    let inputs = [Value::Scalar(10.0), Value::Scalar(2.0)];
    let mut run = |now: f64, since: Option<f64>| {
        program.evaluate(&mut state, &inputs, at(now), since.map(at)).value.scalar()
    };
    assert_eq!(run(1.0, Some(0.5)), 9.0);
    assert_eq!(run(2.0, Some(0.0)), 6.0);
    assert!(run(3.0, None).is_nan() && run(4.0, Some(4.0)).is_nan() && run(4.0, Some(5.0)).is_nan());
}

#[test]
fn derivatives_look_back_over_their_window() {
    let ramp = [(0.0, 0.0), (0.2, 1.0), (0.4, 2.0), (1.0, 5.0), (1.5, 7.5), (1.6, N), (2.0, 20.0)];
    check(
        "derivative(x, 1 s)",
        &ramp,
        &[N, N, N, 5.0, (7.5 - 2.0) / 1.1, N, 15.0].map(|x: f64| (x * 1e6).round() / 1e6),
    );
    let program = compiled("derivative(x, 1 s)", 9);
    let mut state = program.new_state(0, 10.0);
    program.evaluate(
        &mut state,
        &[Value::Scalar(Interval::point(1.0))],
        Validity { from: Time(-100), to: Time(0) },
        None,
    );
    let now = Validity { from: Time(1_000_000_000), to: Time(1_100_000_000) };
    let outcome = program.evaluate(&mut state, &[Value::Scalar(Interval::point(2.0))], now, None);
    assert_eq!(outcome.valid, Validity { from: Time(-100), to: now.to });
    let rate = outcome.value.scalar();
    assert!(rate.contains(1.0 / 1.1) && rate.contains(1.0) && rate.width() < 0.091, "{rate:?}");
}

#[test]
fn integrals_sum_trapezoids() {
    check(
        "integral(x)",
        &[(0.0, 1.0), (1.0, 3.0), (1.5, N), (2.0, 5.0), (2.0, 9.0), (4.0, 5.0)],
        &[0.0, 2.0, N, 6.0, 6.0, 16.0],
    );
    let program = compiled("integral(x)", 9);
    let mut state = program.new_state(0, 10.0);
    for (second, x) in [(0.0, Interval::new(0.0, 1.0)), (2.0, Interval::new(3.0, 4.0))] {
        let sum = program.evaluate(&mut state, &[Value::Scalar(x)], at(second), None).value.scalar();
        assert!(
            second == 0.0 || sum.contains(0.0) && sum.contains(8.0) && sum.width() < 8.0 + 1e-9,
            "{sum:?}"
        );
    }
}

#[test]
fn delays_give_the_value_of_then() {
    let samples = [(0.0, 1.0), (0.5, 2.0), (1.0, 3.0), (1.2, 4.0), (1.7, 5.0), (2.2, 6.0), (2.3, N)];
    check("delay(x, 1 s)", &samples, &[N, N, 1.0, 1.0, 2.0, 4.0, 4.0]);
    let program = compiled("delay(x, 1 s)", 9);
    let mut state = program.new_state(0, 10.0);
    let mut run = |second: f64, x: f64| {
        program.evaluate(&mut state, &[Value::Scalar(Interval::point(x))], at(second), None).value.scalar()
    };
    run(0.0, 1.0);
    run(0.8, 5.0);
    assert_eq!(run(1.5, 9.0), Interval::new(1.0, 5.0));
    assert_eq!(run(1.8, 9.0), Interval::point(5.0));
}

#[test]
fn moving_means_forget_what_is_older_than_their_window() {
    let samples = [(0.0, 9.0), (0.5, 2.0), (1.0, 3.0), (1.2, 4.0), (1.3, N), (1.7, 5.0), (4.0, 7.0)];
    // The trapezoids from the begin of the window on, where the value lies on the line between two samples.
    check("moving_mean(x, 1 s)", &samples, &[N, N, 4.0, 3.18, N, 3.76, N]);
    let program = compiled("moving_mean(x, 1 s)", 9);
    let mut state = program.new_state(0, 10.0);
    let mut run = |second: f64, x: Interval| {
        program.evaluate(&mut state, &[Value::Scalar(x)], at(second), None).value.scalar()
    };
    run(0.0, Interval::point(50.0));
    run(0.5, Interval::new(1.0, 2.0));
    let both = run(1.0, Interval::new(3.0, 6.0));
    assert!(both.contains(13.75) && both.contains(15.0) && both.width() < 1.25 + 1e-9, "{both:?}");
}

/// The times at which an operator has a value, of a sample every 0.1 s but for those from 2 s to 8 s.
fn known_around_a_gap(text: &str) -> std::vec::Vec<f64> {
    let program = compiled(text, 9);
    let mut state = program.new_state(0, 10.0);
    let times = (0..=100).map(|step| f64::from(step) / 10.0).filter(|time| !(2.0..8.0).contains(time));
    let mut is_known = |time: f64| {
        program.evaluate(&mut state, &[Value::Scalar(time)], at(time), None).value.scalar() == time
    };
    let mut found: std::vec::Vec<f64> = times.filter(|&time| is_known(time)).collect();
    found.retain(|time| *time >= 8.0);
    found
}

#[test]
fn nothing_is_known_of_a_gap() {
    for (text, first) in [
        ("derivative(x, 1 s) * 0 s + x", 8.5),
        ("delay(x, 1 s) * 0 + x", 9.0),
        ("moving_mean(x, 1 s) * 0 + x", 9.0),
    ] {
        assert_eq!(known_around_a_gap(text).first(), Some(&first), "{text}");
    }
}

#[test]
fn single_missing_samples_are_no_gap() {
    for text in ["derivative(x, 1 s)", "delay(x, 1 s) / 1 s", "moving_mean(x, 1 s) / 1 s"] {
        let program = compiled(text, 9);
        let mut state = program.new_state(0, 1.0);
        for second in [0, 1, 2, 3, 5, 6, 7, 9, 10, 12] {
            let time = f64::from(second);
            let found: f64 =
                program.evaluate(&mut state, &[Value::Scalar(time)], at(time), None).value.scalar();
            assert_eq!(found.is_nan(), second == 0, "{text} at {time}");
        }
    }
}

#[test]
fn evaluations_out_of_order_change_nothing() {
    let texts = [
        "previous(x)",
        "derivative(x, 0.3 s)",
        "integral(x)",
        "delay(x, 0.3 s)",
        "moving_mean(x, 0.3 s)",
        "x + y * dt",
    ];
    for text in texts {
        let program = compiled(text, 9);
        let (mut plain, mut disturbed) = (program.new_state(0, 10.0), program.new_state(0, 10.0));
        for step in 0..20 {
            let x = [Value::Scalar(f64::from(step * step)), Value::Scalar(2.0)];
            let time = at(f64::from(step) * 0.1);
            let expected = std::format!("{:?}", program.evaluate(&mut plain, &x, time, None));
            assert_eq!(
                std::format!("{:?}", program.evaluate(&mut disturbed, &x, time, None)),
                expected,
                "{text}"
            );
            for late in [time, at(f64::from(step) * 0.1 - 0.25), Validity::at(Time::MIN)] {
                program.evaluate(&mut disturbed, &[Value::Scalar(1e9), Value::Scalar(1e9)], late, None);
            }
        }
        disturbed.reset(&program);
        let first =
            program.evaluate(&mut disturbed, &[Value::Scalar(1.0), Value::Scalar(2.0)], at(0.0), None).value;
        assert_eq!(first.is_missing(), text != "integral(x)", "{text}");
    }
}

#[test]
fn previous_vectors_are_kept() {
    let program = compiled("v - previous(v)", 9);
    let mut state = program.new_state(4, 10.0);
    let mut run = |second: f64, v: &[f64]| match program
        .evaluate(&mut state, &[Value::Vector(v)], at(second), None)
        .value
    {
        Value::Vector(difference) => difference.to_vec(),
        Value::Scalar(_) => vec![f64::NAN],
    };
    assert_eq!(run(0.0, &[1.0, 2.0]), [0.0; 0]);
    assert_eq!(run(1.0, &[3.0, 7.0]), [2.0, 5.0]);
    assert_eq!(run(2.0, &[3.0]), [0.0; 0]);
    assert_eq!(run(3.0, &[4.0]), [1.0]);
}

#[test]
fn memory_is_bounded_at_any_rate() {
    let program = compiled("derivative(x, 10 s) + delay(x, 10 s) / 1 s + integral(x) / 1 s^2", 9);
    let mut state = program.new_state(0, 2.0);
    for step in 0..50_000 {
        let time = f64::from(step) * 0.001;
        let rate: f64 = program.evaluate(&mut state, &[Value::Scalar(time)], at(time), None).value.scalar();
        let expected = 1.0 + (time - 10.0) + time * time / 2.0;
        assert!(time <= 10.0 || (rate - expected).abs() < 0.3, "{rate} for {expected} at {time}");
    }
    let far = program.evaluate(&mut state, &[Value::Scalar(1.0)], Validity::always(), None);
    assert!(far.value.is_missing() || far.value.scalar().is_finite());
    let extreme = Validity { from: Time::MAX, to: Time::MAX };
    program.evaluate(
        &mut state,
        &[Value::Scalar(1.0)],
        extreme,
        Some(Validity::at(Time::MIN).shifted(Span(-1))),
    );
}

proptest! {
    /// Numbers of very different magnitudes, whose sum fits into an integer exactly.
    #[test]
    fn a_sum_of_many_intervals_has_the_exact_one_within_it(numbers in prop::collection::vec((-(1_i64 << 52)..1 << 52, 0_i32..40), 1..400)) {
        let number = |(mantissa, shift): (i64, i32)| mantissa as f64 * libm::exp2(f64::from(-shift));
        let intervals: Vec<Interval> = numbers.iter().map(|&it| Interval::point(number(it))).collect();
        let exact: i128 = numbers.iter().map(|&(mantissa, shift)| i128::from(mantissa) << (40 - shift)).sum();
        let sum = Interval::weighted(intervals.iter().map(|it| (*it, 1.0)));
        let scale = libm::exp2(40.0);
        prop_assert!(libm::floor(sum.lo() * scale) as i128 <= exact, "{sum:?} {exact}");
        prop_assert!(exact <= libm::ceil(sum.hi() * scale) as i128, "{sum:?} {exact}");
        let size: f64 = intervals.iter().map(|it| it.magnitude()).sum();
        prop_assert!(sum.width() <= 1e-15 * size * (intervals.len() as f64 + 4.0), "{sum:?}");
    }

    /// However the samples of a line are spaced, their mean over a window is the value at its middle.
    #[test]
    fn the_mean_of_a_line_is_its_middle(steps in prop::collection::vec(60_i64..150, 20..60), slope in -5.0..5.0_f64) {
        let program = compiled("moving_mean(x, 1 s)", 9);
        let (mut state, mut time) = (program.new_state(0, 1000.0), 0);
        for step in steps {
            time += step;
            let seconds = time as f64 / 1000.0;
            let x = [Value::Scalar(Interval::point(slope * seconds))];
            let mean = program.evaluate(&mut state, &x, at(seconds), None).value.scalar();
            let middle = slope * (seconds - 0.5);
            prop_assert!(mean.is_empty() || (mean.midpoint() - middle).abs() < 1e-9, "{mean:?} {middle} at {seconds}");
            prop_assert!(!mean.is_empty() || seconds < 1.4, "nothing at {seconds}");
        }
    }
}
