//! Formulas with commas inside `{ }`, which YAML takes for the end of a value.

use super::super::check;

#[test]
fn a_comma_in_braces_is_explained_once_for_each_formula() {
    check(
        "variables: { speed: { unit: m/s }, b: { unit: m/s }, c: { unit: m/s } }
signals: { a: { variable: speed, value_error: 0.1 } }
functions: { f(x, y): max(x, y), g(x): x }
relations:
  r: { equation: b = max(speed, g(2 m/s)), when: f(3 m/s, 2 m/s) > 0 m/s }
  s: { equation: \"c = min(speed, 2 m/s)\" }
needs: { b: {}, c: {} }",
        "4:14 error: inside `{ }` a comma ends a value, also within parentheses (put it in quotes: `\"f(x, y)\": \"max(x, y)\"`)
         6:18 error: inside `{ }` a comma ends a value, also within parentheses (put it in quotes: `\"b = max(speed, g(2 m/s))\"`)
         6:26 note: this relation is not solved for `speed`: max has no inverse (the other argument may be the result; where it is meant so, `for` names what it is solved for)
         6:50 error: inside `{ }` a comma ends a value, also within parentheses (put it in quotes: `\"f(3 m/s, 2 m/s) > 0 m/s\"`)
         7:27 note: this relation is not solved for `speed`: min has no inverse (the other argument may be the result; where it is meant so, `for` names what it is solved for)",
    );
}

#[test]
fn what_cannot_be_read_after_a_comma_in_braces_is_explained() {
    check(
        "variables: { x: { unit: m }, y: { unit: V } }
relations: { r: { equation: y = table(x, [0 m, 1 V], [2 m, 3 V]) } }",
        "3:29 error: inside `{ }` a comma ends a value, also within parentheses (put the whole value in quotes: `key: \"max(a, b)\"`)",
    );
}

#[test]
fn other_parentheses_that_do_not_close_stay_what_they_are() {
    check(
        "variables: { b: {} }\nrelations: { r: { equation: b = (2, when: b > 0 } }",
        "3:35 error: a `)` is missing at the end",
    );
}
