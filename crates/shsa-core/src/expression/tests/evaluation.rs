//! Tests of programs over numbers and intervals.

use super::*;
use crate::time::{Time, Validity};

const NOW: Validity = Validity::at(Time(0));

fn bench() -> Model {
    Model::new()
        .variable("x", "", None)
        .variable("y", "", None)
        .variable("z", "", None)
        .vector("v", "")
        .vector("w", "")
}

/// The value of a formula where x, y, z, v, w have these values, over any kind of number.
pub(super) fn value<N: Number>(
    model: &Model,
    text: &str,
    scalars: [N; 3],
    v: &[N],
    w: &[N],
) -> std::vec::Vec<N> {
    let formula = model.formula(text);
    let assignment = Assignment { symbol: Symbol(99), formula: &formula, condition: None };
    let program = Program::compile(&[assignment]).unwrap();
    let mut state = program.new_state(6, 100.0);
    let given = |input: &Input| match input.symbol.0 {
        3 => Value::Vector(v),
        4 => Value::Vector(w),
        place => Value::Scalar(scalars[place as usize]),
    };
    let inputs: std::vec::Vec<_> = program.inputs().iter().map(given).collect();
    match program.evaluate(&mut state, &inputs, NOW, None).value {
        Value::Scalar(number) => vec![number],
        Value::Vector(numbers) => numbers.to_vec(),
    }
}

/// With x = 3, y = -4, z = 0.5, v = [1, 2, 5], w = [4, -3, 2, 1].
#[track_caller]
fn check(text: &str, expected: &[f64]) {
    let (v, w) = ([1.0, 2.0, 5.0], [4.0, -3.0, 2.0, 1.0]);
    let found = value(&bench(), text, [3.0, -4.0, 0.5], &v, &w);
    assert_eq!(std::format!("{found:?}"), std::format!("{expected:?}"), "{text} over numbers");
    let point = Interval::point;
    let intervals = value(&bench(), text, [3.0, -4.0, 0.5].map(point), &v.map(point), &w.map(point));
    assert_eq!(intervals.len(), expected.len(), "{text} over intervals");
    for (found, expected) in intervals.iter().zip(expected) {
        let is_tight = found.contains(*expected) && found.width() <= 1e-13 * (1.0 + expected.abs());
        assert!(is_tight || expected.is_nan() && found.is_empty(), "{text} is {found:?}, not {expected}");
    }
}

#[test]
fn tables_and_choices() {
    check("table(x, [0, 1], [2, 5], [4, 6])", &[5.5]);
    check("table(v, [0, 1], [2, 5], [4, 6])", &[3.0, 5.0, f64::NAN]);
    check("table(z, [1, 1], [2, 5])", &[f64::NAN]);
    check("table(0.5, [0, 1], [2, 5])", &[2.0]);
    check("one_of(x, 3)", &[3.0]);
    check("one_of(x, sqrt(y))", &[3.0]);
    let point = Interval::point;
    let chosen = value(&bench(), "one_of(x, z, 5)", [3.0, -4.0, 0.5].map(point), &[], &[]);
    assert_eq!(chosen, [Interval::new(0.5, 5.0)]);
    assert!(value(&bench(), "one_of(x, z)", [3.0, -4.0, 0.5], &[], &[])[0].is_nan());
    let twice = value(&bench(), "one_of(1, 2) - one_of(1, 2)", [0.0; 3].map(point), &[], &[]);
    assert_eq!(twice, [Interval::new(-1.0, 1.0)]);
}

#[test]
fn functions_of_numbers() {
    check("sqrt(x^2 + y^2) / z", &[10.0]);
    check("if(x > y and not z == 1, x, y)", &[3.0]);
    check("if(x <= y or false, x, y)", &[-4.0]);
    check("if(x != 3, x, y)", &[-4.0]);
    check("hypot(x, y) + abs(y) + floor(z) + min(x, y, z) + max(x, y)", &[8.0]);
    check("x^3 + y^-2 + x^y + root(y * 2, 3)", &[27.0 + 1.0 / 16.0 + 1.0 / 81.0 - 2.0]);
    check("exp(x - 3) + ln(x - 2)", &[1.0]);
    check("sin(z * 1 rad)^2 + cos(z * 1 rad)^2", &[1.0]);
    check("tan(atan2(y, x)) - y / x", &[tan_of_atan2()]);
    check(
        "norm(x, y) + mean(x, y) + sum(x, y, z) + median(x, y, z) + count(x, y)",
        &[5.0 - 0.5 - 0.5 + 0.5 + 2.0],
    );
    check("within(x, 0, 2)", &[f64::NAN]);
    check("within(x, 0, inf) + within(y, -inf, 3)", &[-1.0]);
    check("either(within(x, 0, 2), within(y, -5, 2))", &[-4.0]);
    check("ln(y) + 1", &[f64::NAN]);
    check("sqrt(y)", &[f64::NAN]);
    check("x / (z - 0.5)", &[f64::NAN]);
}

fn tan_of_atan2() -> f64 {
    libm::tan(libm::atan2(-4.0, 3.0)) + 4.0 / 3.0
}

#[test]
fn functions_of_vectors() {
    check(
        "min(v) + max(w) + sum(v) + mean(w) + norm(w[0..2]) + median(v) + median(w) + count(v)",
        &[1.0 + 4.0 + 8.0 + 1.0 + 5.0 + 2.0 + 1.5 + 3.0],
    );
    check("2 * v + x", &[5.0, 7.0, 13.0]);
    check("v * w[0..3]", &[4.0, -6.0, 10.0]);
    check("x - v", &[2.0, 1.0, -2.0]);
    check("-v[1..]", &[-2.0, -5.0]);
    check("sqrt(v[..1])", &[1.0]);
    check("v[0] + v[floor(z)] + w[x]", &[3.0]);
    check("v + w", &[]);
    check("sum(v + w)", &[f64::NAN]);
    check("v[3]", &[f64::NAN]);
    check("v[y]", &[f64::NAN]);
    check("v[1..4]", &[]);
    check("count(v[1..4])", &[f64::NAN]);
    check("max(v[1..]) - v[2]", &[0.0]);
}

#[test]
fn missing_inputs_give_missing_outputs() {
    let nan = f64::NAN;
    let number =
        |text: &str| value(&bench(), text, [nan, 1.0, f64::INFINITY], &[1.0, nan, 3.0], &[0.0; 7])[0];
    for text in [
        "x",
        "z",
        "x * 0",
        "x - x",
        "x^0",
        "min(x, y)",
        "max(y, x)",
        "hypot(x, z)",
        "if(x > 1, 1, 2)",
        "1^x",
        "min(w)",
        "sum(v)",
        "norm(v)",
        "v[x]",
        "v[1]",
        "either(x, x)",
    ] {
        assert!(number(text).is_nan(), "{text} is {}", number(text));
    }
    assert_eq!(number("min(v) + max(v) + mean(v) + median(v) + count(v)"), 1.0 + 3.0 + 2.0 + 2.0 + 2.0);
    assert_eq!(number("if(x > 1, y, y)"), 1.0);
}

#[test]
fn intervals_stay_tight_and_take_both_branches() {
    let model = bench();
    let interval = |text: &str| {
        let [x, y, z] = [Interval::new(-1.0, 2.0), Interval::new(1.0, 3.0), Interval::point(0.5)];
        value(
            &model,
            text,
            [x, y, z],
            &[Interval::new(1.0, 4.0), Interval::new(2.0, 3.0)],
            &[Interval::EMPTY],
        )[0]
    };
    assert_eq!(interval("x - x"), Interval::point(0.0));
    assert_eq!(interval("x * x"), Interval::new(0.0, 4.0));
    assert_eq!(interval("y / y"), Interval::point(1.0));
    assert_eq!(interval("if(x > 0, x, y)"), Interval::new(-1.0, 3.0));
    assert_eq!(interval("if(x > -2, x, y)"), Interval::new(-1.0, 2.0));
    assert_eq!(interval("y + plusminus(0.5)"), Interval::new(0.5, 3.5));
    assert_eq!(interval("y * interval(1, 2)"), Interval::new(1.0, 6.0));
    assert_eq!(interval("v[x - 1 + x]"), Interval::EMPTY);
    assert_eq!(interval("v[(x + 1) / 3]"), Interval::new(1.0, 4.0));
    assert_eq!(interval("min(v)"), Interval::new(1.0, 3.0));
    assert_eq!(interval("count(w)"), Interval::point(0.0));
    assert_eq!(interval("min(w)"), Interval::EMPTY);
    let median = interval("median(v)");
    assert!(median.contains(1.5) && median.contains(3.5) && median.width() < 2.0 + 1e-9);
}

#[test]
fn solved_branches_over_numbers_and_intervals() {
    let model = Model::new().variable("y", "", None).variable("r", "", Some((-2.0, 5.0)));
    let formula = solve(&parse_equation("r^2 = y").unwrap(), Symbol(1), &model).unwrap();
    let program =
        Program::compile(&[Assignment { symbol: Symbol(1), formula: &formula, condition: None }]).unwrap();
    let mut state = program.new_state(0, 1.0);
    let mut number = |y: f64| program.evaluate(&mut state, &[Value::Scalar(y)], NOW, None).value.scalar();
    assert_eq!(number(9.0), 3.0);
    assert_eq!(number(0.0), 0.0);
    assert!(number(1.0).is_nan() && number(49.0).is_nan() && number(-1.0).is_nan());
    let mut state = program.new_state(0, 1.0);
    let mut interval = |lo, hi| {
        let y = Value::Scalar(Interval::new(lo, hi));
        program.evaluate(&mut state, &[y], NOW, None).value.scalar()
    };
    assert_eq!(interval(9.0, 16.0), Interval::new(3.0, 4.0));
    assert_eq!(interval(1.0, 9.0), Interval::new(-2.0, 3.0));
    assert_eq!(interval(36.0, 49.0), Interval::EMPTY);
}

#[test]
fn assignments_conditions_and_shared_terms() {
    let model = bench();
    let [x, y] = [Symbol(0), Symbol(1)];
    let of_x = model.formula("sqrt(z + 1) * 2");
    let of_y = model.formula("x + sqrt(z + 1) * 2 + sqrt(1 + z)");
    let condition = model.formula("y < 100 and x > 0");
    let assignments = [
        Assignment { symbol: x, formula: &of_x, condition: None },
        Assignment { symbol: y, formula: &of_y, condition: Some(&condition) },
    ];
    let program = Program::compile(&assignments).unwrap();
    assert_eq!(program.inputs(), [Input { symbol: Symbol(2), kind: InputKind::Current }]);
    let mut state = program.new_state(0, 1.0);
    let mut run = |z: f64| program.evaluate(&mut state, &[Value::Scalar(z)], NOW, None).value.scalar();
    assert_eq!(run(3.0), 10.0);
    assert!(run(1e6).is_nan());
    assert!(!program.is_stateful() && program.len() < 12);
    let error = |assignments: &[Assignment<'_>]| Program::compile(assignments).unwrap_err().message;
    assert_eq!(error(&[]), "a program computes nothing");
    let [first, second] = assignments;
    assert_eq!(error(&[second, first]), "a program uses a variable before it has computed it");
    assert_eq!(error(&[first, first]), "a program computes a variable twice");
    assert_eq!(
        error(&[Assignment { formula: &condition, ..first }]),
        "a program uses a variable before it has computed it"
    );
    assert_eq!(
        error(&[Assignment { symbol: Symbol(7), formula: &condition, condition: None }]),
        "a program computes true or false, not a value"
    );
}

#[test]
fn inputs_of_the_wrong_shape_or_length_are_missing() {
    let model = bench();
    let formula = model.formula("min(v) + x");
    let program =
        Program::compile(&[Assignment { symbol: Symbol(9), formula: &formula, condition: None }]).unwrap();
    let mut state = program.new_state::<f64>(2, 1.0);
    let mut run = |inputs: &[Value<'_, f64>]| program.evaluate(&mut state, inputs, NOW, None).value.scalar();
    assert_eq!(run(&[Value::Vector(&[4.0, 5.0]), Value::Scalar(1.0)]), 5.0);
    assert!(run(&[Value::Vector(&[4.0, 5.0, 6.0]), Value::Scalar(1.0)]).is_nan());
    assert!(run(&[Value::Scalar(4.0), Value::Scalar(1.0)]).is_nan());
    assert!(run(&[Value::Vector(&[4.0, 5.0]), Value::Vector(&[1.0])]).is_nan());
    assert!(run(&[Value::Vector(&[4.0, 5.0])]).is_nan());
    assert!(run(&[Value::Vector(&[]), Value::Scalar(1.0)]).is_nan());
    assert_eq!(run(&[Value::Vector(&[4.0, 5.0]), Value::Scalar(1.0)]), 5.0);
}
