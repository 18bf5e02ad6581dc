//! Intervals of random formulas hold the values at points of their inputs: with partial functions, repeated variables, functions
//! that pass over arguments without a value, and vectors with elements that have none.

use super::evaluation::value;
use super::oracle::At;
use super::*;
use proptest::prelude::*;
use std::format;
use std::vec::Vec;

fn model() -> Model {
    Model::new()
        .variable("x", "", None)
        .variable("y", "", None)
        .variable("z", "", None)
        .vector("v", "")
        .constant("k", "interval(0, 1)")
        .define("twice(a)", "a + a")
}

fn formula() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        4 => prop::sample::select(vec!["x", "y", "z", "k", "x", "y"]).prop_map(String::from),
        1 => prop::sample::select(vec!["mean(v)", "median(v)", "max(sqrt(v))", "mean(ln(v))", "v[0]", "count(sqrt(v))", "median(sqrt(v))"])
            .prop_map(String::from),
        2 => (-24..24_i32).prop_map(|number| format!("({})", f64::from(number) / 8.0)),
    ];
    leaf.prop_recursive(5, 32, 4, |inner| {
        let unary = prop::sample::select(vec!["-", "sqrt", "ln", "abs", "exp", "sqrt", "floor", "twice", "asin", "sin"]);
        let infix = prop::sample::select(vec!["+", "-", "*", "/", "+", "-", "*", "^"]);
        let several = prop::sample::select(vec!["mean", "median", "either", "min", "max", "count", "hypot", "sum"]);
        let compare = prop::sample::select(vec!["<", "<=", ">", ">=", "==", "!="]);
        prop_oneof![
            3 => (unary, inner.clone()).prop_map(|(name, of)| match name {
                "asin" => format!("(asin({of}) / 1 rad)"),
                "sin" => format!("sin(({of}) * 1 rad)"),
                _ => format!("{name}({of})"),
            }),
            5 => (inner.clone(), infix, inner.clone()).prop_map(|(left, infix, right)| format!("({left} {infix} {right})")),
            3 => (several, inner.clone(), inner.clone(), inner.clone()).prop_map(|(name, one, two, three)| match name {
                "hypot" | "mean" => format!("{name}({one}, {two})"),
                _ => format!("{name}({one}, {two}, {three})"),
            }),
            1 => (inner.clone(), -4..8_i32).prop_map(|(of, lo)| format!("within({of}, {}, 2)", f64::from(lo) / 4.0)),
            1 => inner.clone().prop_map(|index| format!("v[{index}]")),
            2 => (inner.clone(), compare, inner.clone(), inner).prop_map(|(left, compare, right, then)| {
                format!("if({left} {compare} {right}, {then}, {right} - 1)")
            }),
        ]
    })
}

/// Bounds with some room for the rounding of the oracle.
fn roomy(interval: Interval) -> Interval {
    let size = interval.lo().abs().max(interval.hi().abs());
    if size.is_finite() { interval.widened(1e-9 * (1.0 + size)) } else { interval }
}

/// Points of an interval: its bounds, its middle, and 0 where it is inside.
fn points(over: Interval, share: f64) -> impl Iterator<Item = f64> {
    let inside = over.lo() + share * over.width();
    [over.lo(), over.hi(), over.midpoint(), inside, 0.0]
        .into_iter()
        .filter(move |point| over.contains(*point))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases.max(3000)))]

    /// `PROPTEST_CASES=100000` for more.
    #[test]
    fn an_interval_holds_each_case(
        text in formula(),
        lows in prop::array::uniform3(-12..8_i32),
        widths in prop::array::uniform3(0..8_i32),
        elements in prop::collection::vec((0..4_i32, -4..6_i32, 0..4_i32), 1..5),
        shares in prop::array::uniform4((0..8_u8).prop_map(|eighths| f64::from(eighths) / 8.0)),
        picks in prop::collection::vec(prop::array::uniform4(0..5_usize), 12),
    ) {
        let model = model();
        let expression = parse_expression(&text).unwrap();
        if check(&expression, &model).formula.is_none() {
            return Ok(());
        }
        let around: [Interval; 3] = core::array::from_fn(|at| {
            let lo = f64::from(lows[at]) / 4.0;
            Interval::new(lo, lo + f64::from(widths[at]) / 4.0)
        });
        let vector: Vec<Interval> = elements.iter().map(|(is_there, lo, width)| {
            let lo = f64::from(*lo) / 2.0;
            if *is_there > 0 { Interval::new(lo, lo + f64::from(*width) / 4.0) } else { Interval::EMPTY }
        }).collect();
        let wide = value(&model, &text, around, &vector, &[])[0];
        for pick in picks {
            let at = |over: Interval, place: usize| {
                let all: Vec<f64> = points(over, shares[place]).collect();
                all[pick[place] % all.len()]
            };
            let names = [("x", at(around[0], 0)), ("y", at(around[1], 1)), ("z", at(around[2], 2)), ("k", at(Interval::new(0.0, 1.0), 3))];
            let elements: Vec<Option<f64>> = vector.iter().map(|over| (!over.is_empty()).then(|| at(*over, 3))).collect();
            let Ok(Some(plain)) = (At { whole: &expression, names: &names, vector: &elements }).number(&expression) else { continue };
            // Where it is open whether a branch without a value holds, or an index is out of range, there is no value at all.
            let is_open = wide.is_empty() && (text.contains("if(") || text.contains("v["));
            prop_assert!(is_open || roomy(wide).contains(plain), "{text} in {around:?}, {vector:?} at {names:?}, {elements:?}: {plain} outside of {wide:?}");
        }
    }
}

/// The interval of a formula over these intervals of x, y and z.
#[track_caller]
fn check_interval(text: &str, over: [(f64, f64); 3], expected: (f64, f64)) {
    let found = value(&model(), text, over.map(|(lo, hi)| Interval::new(lo, hi)), &[], &[])[0];
    let is_near = |one: f64, other: f64| (one - other).abs() <= 1e-9 * (1.0 + other.abs());
    assert!(
        is_near(found.lo(), expected.0) && is_near(found.hi(), expected.1),
        "{text}: {found:?}, not {expected:?}"
    );
}

#[test]
fn arguments_that_may_have_no_value_are_there_or_not() {
    let over = [(-1.0, 1.0), (10.0, 10.0), (50.0, 50.0)];
    check_interval("mean(sqrt(x), y)", over, (5.0, 10.0));
    check_interval("median(sqrt(x), y, z)", over, (10.0, 30.0));
    check_interval("median(sqrt(x), ln(x), y, z)", over, (5.0, 30.0));
    check_interval("either(if(x > 0, sqrt(-1), z), y)", over, (10.0, 50.0));
    check_interval("mean(y, if(x > 0, sqrt(-1), z))", over, (10.0, 30.0));
    check_interval("min(sqrt(x) + 20, y)", over, (10.0, 10.0));
    check_interval("max(sqrt(x) + 20, y)", over, (10.0, 21.0));
    check_interval("count(sqrt(x), y)", over, (1.0, 2.0));
    check_interval("mean(sqrt(x), sqrt(x))", over, (0.0, 1.0));
    check_interval("mean(1 / x, z)", [(0.5, 1.0), (0.0, 0.0), (4.0, 4.0)], (2.5, 3.0));
    check_interval(
        "mean(within(x, 0, 1), ln(x), asin(x) / 1 rad + 9, z)",
        [(2.0, 3.0), (0.0, 0.0), (4.0, 4.0)],
        ((4.0 + 2.0_f64.ln()) / 2.0, (4.0 + 3.0_f64.ln()) / 2.0),
    );
}

#[test]
fn a_negative_base_has_powers_where_the_exponent_may_be_whole() {
    check_interval("x ^ y", [(-1.0, 1.0), (1.0, 1.2), (0.0, 0.0)], (-1.0, 1.0));
    check_interval("x ^ y", [(-2.0, -1.0), (1.5, 3.5), (0.0, 0.0)], (-8.0, 4.0));
    check_interval("x ^ y", [(-2.0, 0.0), (2.0, 2.0), (0.0, 0.0)], (0.0, 4.0));
    let none = value(
        &model(),
        "x ^ y",
        [Interval::new(-2.0, -1.0), Interval::new(1.1, 1.9), Interval::EMPTY],
        &[],
        &[],
    )[0];
    assert!(none.is_empty());
    assert_eq!(value(&model(), "x ^ y", [-2.0, 3.0, 0.0], &[], &[]), [-8.0]);
    assert!(value(&model(), "x ^ y", [-2.0, 0.5, 0.0], &[], &[])[0].is_nan());
}

#[test]
fn what_needs_an_open_case_has_no_value() {
    for text in
        ["if(x > 0, sqrt(-1), z)", "1 + if(x > 0, sqrt(-1), z)", "either(if(x > 0, sqrt(-1), z), sqrt(-1))"]
    {
        let found = value(
            &model(),
            text,
            [Interval::new(-1.0, 1.0), Interval::point(1.0), Interval::point(2.0)],
            &[],
            &[],
        );
        assert!(found[0].is_empty(), "{text}: {found:?}");
    }
}
