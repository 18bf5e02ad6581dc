//! Relations that are solved for a variable with intervals wider than its range.

use super::super::check;

const VARIABLES: &str = "variables: { a: { unit: degF, range: [0, 100] }, b: { unit: degF, range: [0, 100] }, m: { unit: degF, range: [0, 100] } }\n";

/// The warnings of a relation `r` for `m`, and of signals for `a`.
#[track_caller]
fn check_relation(equation: &str, error: &str, expected: &str) {
    let relation = format!("relations:\n  r: {{ equation: \"{equation}\", for: m }}\n");
    let signals =
        format!("signals: {{ /a: {{ variable: a, value_error: {error} }}, /b: {{ variable: b }} }}\n");
    check(&format!("{VARIABLES}{relation}{signals}"), expected);
}

#[test]
fn what_says_nothing_is_a_warning() {
    let warning = |width: &str| {
        format!(
            "4:3 warning: `m` follows from relation `r` within {width}, and its range is 100 degF wide: this says nothing (narrow what the relation computes with, or name in `for` what else it is solved for, without `m`)"
        )
    };
    check_relation("m = a + interval(-50 K, 50 K) + 0 * (b - a)", "1", &warning("180 degF"));
    check_relation("m = a + 0 * (b - a)", "51", &warning("102 degF"));
    check_relation("m = a + (b - a) / interval(-1, 1)", "1", &warning("no bounds"));
}

#[test]
fn what_says_something_is_none() {
    check_relation("m = a + interval(0, 1) * (b - a)", "1", "");
    check_relation("m = a + 0 * (b - a)", "49", "");
    check_relation("m = a + interval(-10 K, 10 K) + 0 * (b - a)", "1", "");
}
