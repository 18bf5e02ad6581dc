//! Intervals of formulas in which variables occur more than once are as narrow as the values that they hold.

use super::evaluation::value;
use super::*;

fn model() -> Model {
    Model::new()
        .variable("x", "", None)
        .variable("y", "", None)
        .variable("z", "", None)
        .constant("share", "interval(0, 1)")
}

/// The least and the greatest value over a grid of points that holds the bounds.
fn sampled(model: &Model, text: &str, over: [Interval; 3]) -> Interval {
    const STEPS: i32 = 24;
    let point = |over: Interval, step: i32| over.lo() + over.width() * f64::from(step) / f64::from(STEPS);
    let steps = |over: Interval| if over.is_point() { 0..=0 } else { 0..=STEPS };
    let expression = parse_expression(text).unwrap();
    let mut found = Interval::EMPTY;
    for x in steps(over[0]) {
        for y in steps(over[1]) {
            for z in steps(over[2]) {
                for share in [0.0, 0.5, 1.0] {
                    let names = [
                        ("x", point(over[0], x)),
                        ("y", point(over[1], y)),
                        ("z", point(over[2], z)),
                        ("share", share),
                    ];
                    let at = super::oracle::At { whole: &expression, names: &names, vector: &[] };
                    if let Ok(Some(number)) = at.number(&expression) {
                        found = found.hull(Interval::point(number));
                    }
                }
            }
        }
    }
    let _ = model;
    found
}

/// No wider than 1.05 times the range of sampled values.
#[track_caller]
fn check(text: &str, over: [(f64, f64); 3]) {
    let (model, over) = (model(), over.map(|(lo, hi)| Interval::new(lo, hi)));
    let (found, range) = (value(&model, text, over, &[], &[])[0], sampled(&model, text, over));
    assert!(
        found.widened(1e-9 * found.magnitude()).encloses(range),
        "{text}: {found:?} does not hold {range:?}"
    );
    assert!(found.width() <= 1.05 * range.width() + 1e-9, "{text} over {over:?}: {found:?} of {range:?}");
}

const WIDE: [(f64, f64); 3] = [(30.0, 70.0), (20.0, 60.0), (0.0, 1.0)];
const SIGNED: [(f64, f64); 3] = [(-1.0, 2.0), (-2.0, 1.0), (-1.0, 3.0)];

#[test]
fn mixing() {
    check("x + share * (y - x)", [(70.0, 70.0), (30.0, 30.0), (0.0, 0.0)]);
    check("(1 - share) * x + share * y", WIDE);
    for over in [WIDE, [(70.0, 71.0), (30.0, 31.0), (0.0, 1.0)], [(290.0, 300.0), (310.0, 315.0), (0.2, 0.4)]]
    {
        check("x + z * (y - x)", over);
        check("(1 - z) * x + z * y", over);
        check("z * x + (1 - z) * y", over);
        check("(z * x + (1 - z) * y) / (z + 1)", over);
    }
}

#[test]
fn balances_of_heat_and_matter() {
    check("x / (x + y)", WIDE);
    check("(x - y) / (x + y)", WIDE);
    check("(x - y) / (x - z)", [(60.0, 90.0), (30.0, 50.0), (0.0, 20.0)]);
    check("x * y / (x + y)", WIDE);
    check("(x * z + y * (2 - z)) / 2", WIDE);
    check("x * (y - z) + z * (x - 3)", WIDE);
    check("(x * 4 + y * z) / (4 + z)", WIDE);
    check("1 - y / x + z * y / x", WIDE);
}

#[test]
fn bilinear_and_quadratic() {
    for over in [SIGNED, WIDE] {
        check("x * y + x", over);
        check("x * y - y * z", over);
        check("x * y + y * z + z * x", over);
        check("x * x - x", over);
        check("x * x + z * x + y", over);
        check("x - x^2 / 2", over);
        check("x * (1 - x)", over);
        check("x^3 - x", over);
        check("(x + y) * (x - y)", over);
    }
}

#[test]
fn motion() {
    let wheels = [(9.0, 10.0), (9.5, 11.0), (0.5, 0.55)];
    check("(y - x) / z * (y + x) / 2", wheels);
    check("(x + y) / 2 - (y - x) * z", wheels);
    check("x * sin(z * 1 rad) + y * sin(z * 1 rad)", [(1.0, 2.0), (-1.0, 1.0), (0.2, 1.2)]);
    check("x * z + y * z^2 / 2", [(-1.0, 2.0), (-2.0, -1.0), (0.0, 1.0)]);
    check("sqrt(x^2 + y^2) - x", [(1.0, 5.0), (-2.0, 3.0), (0.0, 0.0)]);
    check("x / sqrt(x^2 + y^2)", [(-1.0, 5.0), (0.5, 3.0), (0.0, 0.0)]);
    check("x * exp(-x)", [(0.0, 3.0), (0.0, 0.0), (0.0, 0.0)]);
    check("max(x, y) - min(x, y)", [(1.0, 3.0), (2.0, 5.0), (0.0, 0.0)]);
    check("abs(x - y) + x", [(1.0, 3.0), (2.0, 5.0), (0.0, 0.0)]);
}

#[test]
fn inside_of_other_functions() {
    check("if(x > 100, y, x + z * (y - x))", WIDE);
    check("if(x + z * (y - x) > 10, x, y + 500)", WIDE);
    check("within(x + z * (y - x), 0, 1000) + 3", WIDE);
}

#[test]
fn partly_outside_of_a_domain() {
    check("sqrt(x) - x", [(-1.0, 2.0), (0.0, 0.0), (0.0, 0.0)]);
    check("x - ln(x)", [(0.25, 4.0), (0.0, 0.0), (0.0, 0.0)]);
    check("sqrt(x - y) - x / 4", [(0.0, 4.0), (1.0, 2.0), (0.0, 0.0)]);
}

#[test]
fn what_is_uncertain_in_each_place_is_not_one_number() {
    let found =
        value(&model(), "x * interval(0, 1) - x * interval(0, 1)", [Interval::point(2.0); 3], &[], &[])[0];
    assert_eq!(found, Interval::new(-2.0, 2.0));
    let found = value(&model(), "x * share - x * share", [Interval::point(2.0); 3], &[], &[])[0];
    assert_eq!(found, Interval::point(0.0));
}

#[test]
fn a_mixture_of_temperatures_lies_between_them() {
    let model = Model::new()
        .variable("m", "degF", None)
        .variable("a", "degF", None)
        .variable("b", "degF", None)
        .constant("share", "interval(0, 1)");
    let formula = solve(&parse_equation("m = a + share * (b - a)").unwrap(), Symbol(0), &model).unwrap();
    let program =
        Program::compile(&[Assignment { symbol: Symbol(0), formula: &formula, condition: None }]).unwrap();
    let unit = Unit::parse("degF").unwrap();
    let given = |input: &Input| {
        Value::Scalar(unit.to_si_interval(Interval::point(if input.symbol.0 == 1 { 70.0 } else { 30.0 })))
    };
    let inputs: std::vec::Vec<_> = program.inputs().iter().map(given).collect();
    let mut state = program.new_state(0, 1.0);
    let found = program
        .evaluate(&mut state, &inputs, crate::time::Validity::at(crate::time::Time(0)), None)
        .value
        .scalar();
    let expected = unit.to_si_interval(Interval::new(30.0, 70.0));
    assert!(
        found.widened(1e-9).encloses(expected) && expected.widened(1e-9).encloses(found),
        "{found:?} of {expected:?}"
    );
}
