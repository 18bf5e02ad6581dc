//! Tests of conditions over time.

use super::*;
use crate::interval::Interval;
use crate::time::{Time, Validity};
use proptest::prelude::*;
use std::vec::Vec;

/// The verdicts of a condition over samples of `x` and `y`, each as all that it may be: `T`, `F` or `?`.
fn verdicts(condition: &str, samples: &[(f64, Interval, Interval)]) -> std::string::String {
    let model = Model::new().variable("x", "m", None).variable("y", "m", None);
    let formula = model.formula(&std::format!("if({condition}, 1, 0)"));
    let program =
        Program::compile(&[Assignment { symbol: Symbol(9), formula: &formula, condition: None }]).unwrap();
    let mut state = program.new_state(0, 10.0);
    let mut verdict = |(time, x, y): &(f64, Interval, Interval)| {
        let value = |input: &Input| Value::Scalar(if input.symbol == Symbol(0) { *x } else { *y });
        let inputs: Vec<_> = program.inputs().iter().map(value).collect();
        let at = Validity::at(Time::from_seconds(*time));
        match program.evaluate(&mut state, &inputs, at, None).value.scalar() {
            value if value == Interval::point(1.0) => 'T',
            value if value == Interval::point(0.0) => 'F',
            value => {
                assert_eq!(value, Interval::new(0.0, 1.0));
                '?'
            }
        }
    };
    samples.iter().map(&mut verdict).collect()
}

/// Samples every second: `1` is certainly more than a half, `0` certainly not, `?` may be either.
fn seconds(x: &str, y: &str) -> Vec<(f64, Interval, Interval)> {
    let value = |word| match word {
        '1' => Interval::point(1.0),
        '0' => Interval::point(0.0),
        '?' => Interval::new(0.0, 1.0),
        _ => Interval::EMPTY,
    };
    x.chars().zip(y.chars()).enumerate().map(|(at, (x, y))| (at as f64, value(x), value(y))).collect()
}

#[track_caller]
fn check(condition: &str, [x, y]: [&str; 2], expected: &str) {
    assert_eq!(verdicts(condition, &seconds(x, y)), expected, "{condition}");
}

#[test]
fn a_condition_has_to_hold_throughout() {
    let y = "000000000000";
    check("always(x > 0.5 m, 2 s)", ["111101111111", y], "??TTFFFTTTTT");
    check("always(x > 0.5 m, 2 s)", ["1111?1111111", y], "??TT???TTTTT");
    check("always(x > 0.5 m, 2 s)", ["0000-0000000", y], "FFFFFFFFFFFF");
    check("not always(x > 0.5 m, 2 s)", ["111101111111", y], "??FFTTTFFFFF");
}

#[test]
fn a_condition_has_to_hold_once() {
    let y = "00000000000";
    check("once(x > 0.5 m, 2 s)", ["00001000000", y], "??FFTTTFFFF");
    check("once(x > 0.5 m, 2 s)", ["0000?000000", y], "??FF???FFFF");
}

#[test]
fn a_trigger_has_to_be_answered_in_time() {
    let answered = "answered(x > 0.5 m, y > 0.5 m, 3 s)";
    check(answered, ["0100000000", "0000100000"], "TTTTTTTTTT");
    check(answered, ["0100000000", "0000000100"], "TTTTFFFTTT");
    // The trigger lasts, and with it the answer has to.
    check(answered, ["0111111111", "0011100000"], "TTTTTTTTFF");
    // An answer that may have come, and a trigger that may not have been.
    check(answered, ["0100000000", "00?0000000"], "TTTT??????");
    check(answered, ["0?00000000", "0000000100"], "TTTT???TTT");
    // Nothing is known while there is no value.
    check(answered, ["0100000000", "000-000000"], "TTTT??????");
    check(answered, ["000-000000", "0000000000"], "TTTTTT????");
}

#[test]
fn a_gap_leaves_verdicts_open() {
    let mut x = seconds("1111111111", "0000000000");
    for (time, ..) in &mut x[6..] {
        *time += 20.0;
    }
    assert_eq!(verdicts("always(x > 0.5 m, 2 s)", &x), "??TTTT??TT");
    let mut triggered = seconds("0100000000", "0000000000");
    for (time, ..) in &mut triggered[3..] {
        *time += 20.0;
    }
    assert_eq!(verdicts("answered(x > 0.5 m, y > 0.5 m, 3 s)", &triggered)[..4].chars().last(), Some('?'));
}

#[test]
fn conditions_over_time_are_shown_as_they_are_written() {
    let model = Model::new().variable("x", "m", None);
    for text in ["if(always(1 < x, 2 s), 1, 0)", "if(answered(1 < x, x < 0, 0.5 s), 1, 0)"] {
        let written = text.replace("1 <", "1 m <").replace("< 0", "< 0 m");
        assert_eq!(model.text(&model.formula(&written)), text);
    }
}

#[test]
fn conditions_over_time_take_conditions_and_spans() {
    let problems = |text: &str| Model::new().variable("x", "m", None).problems(text);
    assert!(!problems("if(always(x, 2 s), 1, 0)").is_empty());
    assert!(!problems("if(once(x > 1 m, 0 s), 1, 0)").is_empty());
    assert!(!problems("if(answered(x > 1 m, x < 0 m), 1, 0)").is_empty());
}

/// Every way in which a word with `?` may be meant.
fn meanings(word: &str) -> Vec<std::string::String> {
    let Some((before, after)) = word.split_once('?') else { return Vec::from([word.into()]) };
    ["0", "1"].iter().flat_map(|meant| meanings(&std::format!("{before}{meant}{after}"))).collect()
}

proptest! {
    /// A verdict that is certain is that of every meaning of the samples that are not.
    #[test]
    fn certain_verdicts_are_those_of_all_meanings(
        x in "[01?]{9}", y in "[01?]{9}",
        condition in prop::sample::select(std::vec![
            "always(x > 0.5 m, 2 s)", "once(x > 0.5 m, 3 s)", "answered(x > 0.5 m, y > 0.5 m, 2 s)",
        ]),
    ) {
        prop_assume!(x.matches('?').count() + y.matches('?').count() <= 8);
        let found = verdicts(condition, &seconds(&x, &y));
        for x in meanings(&x) {
            for y in meanings(&y) {
                let meant = verdicts(condition, &seconds(&x, &y));
                for (open, certain) in found.chars().zip(meant.chars()) {
                    prop_assert!(open == '?' || open == certain, "{condition} of {x}, {y}: {found} and {meant}");
                }
            }
        }
    }
}
