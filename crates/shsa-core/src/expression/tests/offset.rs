//! Tests of differences of values that share an offset.

use super::*;
use crate::interval::{Course, Offset};
use crate::time::{Time, Validity};
use proptest::prelude::*;
use std::vec::Vec;

/// What the derivative is of, and the same computed with a factor from 0.8 to 1.2, or from -3 to -2.
type Case = (&'static str, fn(f64, f64) -> f64);

const CASES: [Case; 8] = [
    ("x", |x, _| x),
    ("3 * x - 2 m", |x, _| 3.0 * x - 2.0),
    ("2 m - x / 4", |x, _| 2.0 - x / 4.0),
    ("interval(0.8, 1.2) * x", |x, share| (1.0 + 0.2 * share) * x),
    ("x * interval(-3, -2)", |x, share| (0.5 * share - 2.5) * x),
    ("x / interval(-3, -2)", |x, share| x / (0.5 * share - 2.5)),
    ("x - (2 * x - 1 m)", |x, _| x - (2.0 * x - 1.0)),
    ("abs(x) + x", |x, _| x.abs() + x),
];

proptest! {
    /// Readings are off by an offset that drifts, and by a rest: the rate of the truth is in the derivative.
    #[test]
    fn a_difference_leaves_out_what_both_values_are_off_by(
        case in 0..CASES.len(),
        (least, size, rest, drift) in (-5.0..5.0_f64, 0.0..10.0_f64, 0.0..1.0_f64, 0.0..2.0_f64),
        (start, share) in (0.0..1.0_f64, -1.0..1.0_f64),
        steps in prop::collection::vec((0.05..0.6_f64, -1.0..1.0_f64, -1.0..1.0_f64, -4.0..4.0_f64), 4..30),
    ) {
        let (text, right) = CASES[case];
        let formula = Model::new().variable("x", "m", None).formula(&std::format!("derivative({text}, 1 s)"));
        let offset = Offset { lo: least, hi: least + size, drift };
        let assignment = Assignment { symbol: Symbol(9), formula: &formula, condition: None };
        let program = Program::compile_within(&[assignment], &|_| Course { offset, ..Course::ANY }).unwrap();
        let plain = Program::compile(&[assignment]).unwrap();
        let (mut state, mut beside) = (program.new_state(0, 20.0), plain.new_state(0, 20.0));
        let (mut now, mut truth, mut off) = (0.0, 10.0, least + start * size);
        let mut all: Vec<(f64, f64)> = Vec::new();
        for (step, moved, noise, rate) in steps {
            now += step;
            truth += rate * step;
            off = (off + moved * drift * step).clamp(least, least + size);
            let reading = truth - off - noise * rest;
            let said = Interval::new(reading + least - rest, reading + least + size + rest);
            let time = Time::from_seconds(now);
            let (inputs, at) = ([Value::Scalar(said)], Validity::at(time));
            let outcome = program.evaluate(&mut state, &inputs, at, None);
            let (found, since) = (outcome.value.scalar(), outcome.valid.from);
            let wide = plain.evaluate(&mut beside, &inputs, at, None).value.scalar();
            all.push((time.seconds(), truth));
            prop_assert_eq!(found.is_empty(), wide.is_empty());
            let old = all.iter().find(|(at, _)| (at - since.seconds()).abs() < 1e-6);
            let Some((at, old)) = old.filter(|_| !found.is_empty()) else { continue };
            let rate = (right(truth, share) - right(*old, share)) / (time.seconds() - at);
            prop_assert!(found.widened(1e-6).contains(rate), "{text}: {found:?} is without {rate}");
            prop_assert!(found.intersection(wide.widened(1e-6)) == found, "{text}: {found:?} beyond {wide:?}");
            // What is left is the rest and the drift.
            let left = (4.0 * rest + 2.0 * drift * (time.seconds() - at)) / (time.seconds() - at);
            let most = found.width() <= left.min(wide.width()) + 1e-6;
            prop_assert!(case != 0 || most, "{found:?} is wider than {left}");
        }
    }
}
