//! Tests of parsing and checking: trees, places, messages, helps.

use super::*;

/// Checks that a formula reads back from its own text.
#[track_caller]
pub(super) fn check_text(text: &str, expected: &str) {
    let model = rover();
    let formula = model.formula(text);
    assert_eq!(model.text(&formula), expected, "of {text}");
}

#[track_caller]
pub(super) fn check_problems(text: &str, expected: &str) {
    assert_eq!(rover().problems(text), expected, "of {text}");
}

#[test]
fn operators_bind_as_usual() {
    check_text("1 + load * 2 ^ 3 ^ 2", "1 + load * 512");
    check_text("-load^2", "-load^2");
    check_text("2^-2", "0.25");
    check_text("load - (load - slip) - slip", "0 * load + 0 * slip");
    check_text("load / slip / dmin * 2", "load / slip / dmin * 2");
    check_text("load / (slip * dmin)", "load / (slip * dmin)");
    check_text("(load^slip)^2", "(load^slip)^2");
    check_text(
        "if(load < 1 and slip > 2 or not load == 3, 1, 2)",
        "if(load < 1 and 2 < slip or not load == 3, 1, 2)",
    );
    check_text("if(not (load < 1 and slip < 2), 1, 2)", "if(not (load < 1 and slip < 2), 1, 2)");
    check_text("if(load >= 1, 1, 2)", "if(1 <= load, 1, 2)");
    check_text("-(load + 1)", "-(load + 1)");
    check_text("+load - -slip", "load + slip");
    check_text("hypot(load, slip) * atan2(load, slip)", "hypot(load, slip) * atan2(load, slip)");
    check_text("distances[1..3][0] + distances[floor(load)]", "distances[1..3][0] + distances[floor(load)]");
    check_text("min(distances[..2]) + max(distances[2..])", "min(distances[0..2]) + max(distances[2..])");
    check_text(
        "root(load, 3) + load^5 + load^0.5 + load^1.5",
        "root(load, 3) + load^5 + sqrt(load) + load^1.5",
    );
}

#[test]
fn numbers_have_units() {
    check_text("2.67 m", "2.67");
    check_text("36 km/h", "10");
    check_text("9.81 m/s^2", "9.81");
    check_text("20 %", "0.2");
    check_text("20%", "0.2");
    check_text("90deg", "1.5707963267948966");
    check_text("20 degC", "293.15");
    check_text("-20 degC", "253.14999999999998");
    check_text("10 1/s", "10");
    check_text("5 N m", "5");
    check_text("4.15 kJ/(kg K)", "4150");
    check_text("2 1/(kg*K)", "2");
    check_text("6 W/(m^2 K)^2", "6");
    check_text("6 m/(2 + 1)", "2");
    check_text("4 m/(s)", "4 / s");
    check_text("2 min", "120");
    check_text("min(2, 3)", "min(2, 3)".replace("min(2, 3)", "2").as_str());
    check_text("3 / 4 m", "0.75");
    check_text("1e3 mm", "1");
    check_text(".5 m", "0.5");
    check_text("0.2 m/s * dt", "0.2 * dt");
    check_text("4 m / s", "4 / s");
    check_text("4 m^2", "4");
    check_text("(2 m)^2", "4");
    check_text("distances[0..2][1]", "distances[0..2][1]");
}

#[test]
fn a_unit_that_is_a_variable_too_is_pointed_out() {
    check_problems(
        "4 m/s",
        "warning: [4 m/s] `s` is read as a unit here, and there is a variable of this name -- write blanks around the operator before `s` if the variable is meant",
    );
    check_problems("4 m / s", "");
    check_problems("4 s", "");
}

#[test]
fn texts_that_are_no_formula() {
    check_problems("", "[] a number, a variable or a `(` is missing at the end");
    check_problems("1 +", "[] a number, a variable or a `(` is missing at the end");
    check_problems("(1", "[] a `)` is missing at the end");
    check_problems("1)", "[)] an opening bracket is missing before `)`");
    check_problems("a = b", "[=] an operator is missing before `=` -- compare with `==`");
    check_problems("load slip", "[slip] an operator is missing before `slip` -- a product is written `*`");
    check_problems(
        "5 kpa",
        "[kpa] an operator is missing before `kpa` -- if it is a unit, did you mean `kPa`? A product is written `*`",
    );
    check_problems(
        "load m",
        "[m] an operator is missing before `m` -- a unit stands behind a number only; a product is written `*`",
    );
    check_problems("1 & 2", "[&] `&` has no meaning in a formula -- write `and`");
    check_problems(
        "load % 2",
        "[%] `%` has no meaning in a formula -- `%` is a unit: write it behind a number",
    );
    check_problems("distances[]", "[]] a number, a variable or a `(` is missing before `]`");
    check_problems("1e999", "[1e999] this number is too large");
    check_problems("2 m^200", "[m^200] this exponent is no whole number up to 127: `m^200`");
    check_problems("and", "[and] a number, a variable or a `(` is missing before `and`");
}

#[test]
fn every_unknown_name_is_reported_with_the_nearest() {
    check_problems(
        "sped + clamp1(slop) * pie",
        "[sped] `sped` is not defined -- did you mean `speed`?\n\
         [clamp1] the function `clamp1` is not defined -- did you mean `clamp01`?\n\
         [pie] `pie` is not defined -- did you mean `pi`?",
    );
    check_problems("min + 1", "[min] `min` is a function -- write `min(vector) or min(x, y)`");
    check_problems(
        "2 A/(kN*speed)",
        "[kN] `kN` is not defined -- `kN` is a unit: write it behind a number and without parentheses, as in `2 m/s/A`",
    );
    check_problems("speed(2)", "[speed(2)] `speed` is no function -- a product is written `*`");
    check_problems("sqrt(1, 2)", "[sqrt(1, 2)] `sqrt` with 2 arguments -- write `sqrt(x)`");
    check_problems("clamp01()", "[clamp01()] `clamp01` with 0 arguments -- write `clamp01(x)`");
}

#[test]
fn angles_and_plain_numbers_do_not_mix() {
    check_problems(
        "heading + 3",
        "[heading + 3] `+` of an angle and a plain number -- write the number as an angle, such as `3 deg` or `3 rad`; divide the angle by `1 rad` for a plain number",
    );
    check_problems("heading + 3 deg", "");
    check_problems("if(heading > 0, heading / 1 rad, 3)", "");
    check_problems("sin(3)", "[3] `sin` takes an angle, not a plain number -- write `3 deg` or `3 rad`");
    check_problems(
        "cos(slip)",
        "[slip] `cos` takes an angle, not a plain number -- multiply by `1 rad` if it is in radians",
    );
    check_problems(
        "exp(heading)",
        "[heading] `exp` takes a plain number, not an angle -- divide by `1 rad` for a plain number",
    );
    check_problems("tan(asin(slip) + atan2(dmin, s))", "");
    check_problems("sin(load) + load", "");
    check_problems(
        "speed + yaw_rate * wheel_base",
        "warning: [speed + yaw_rate * wheel_base] `+` of m/s and m*rad/s, which differ by radians -- write `/ 1 rad` on the right side or `* 1 rad` on the left side",
    );
    check_problems("speed + yaw_rate * wheel_base / 1 rad", "");
}

#[test]
fn units_fit_at_every_node() {
    check_problems(
        "(speed + dmin) * max(s, speed, 3 kg)",
        "[speed + dmin] `+` of m/s and m -- both sides must have the same unit\n\
         [max(s, speed, 3 kg)] `max` of m and m/s -- both sides must have the same unit",
    );
    check_problems("speed + 0", "");
    check_problems("load + dmin * load", "");
    check_problems(
        "if(dmin < 2 s, dmin, 0)",
        "[dmin < 2 s] `<` of m and s -- both sides must have the same unit",
    );
    check_problems(
        "dmin^slip",
        "[dmin] the base of a power with a variable exponent takes a plain number, not m -- divide by `1 m` for a plain number",
    );
    check_problems(
        "2^dmin",
        "[dmin] an exponent takes a plain number, not m -- divide by `1 m` for a plain number",
    );
    check_problems("sqrt(dmin * s) + dmin + (dmin^3)^(1/3)", "");
    check_problems(
        "sqrt(dmin) + 1",
        "warning: [sqrt(dmin)] a root of m has no unit; units are not checked from here on -- take the root of a product that has one",
    );
    check_problems(
        "hypot(dmin, 1 s)",
        "[hypot(dmin, 1 s)] `hypot` of m and s -- both sides must have the same unit",
    );
    check_problems(
        "outside + 2 degC",
        "[outside + 2 degC] this is no temperature: the zero of the scale is in it 2 times -- for a difference write `2 K` instead of `2 degC`",
    );
    check_problems(
        "((dmin^100)^100)",
        "[(dmin^100)^100] the exponents of this unit leave their range -- exponents go up to 127",
    );
    check_problems("derivative(dmin, 0.5 s) + speed + integral(speed) / 1 s + delay(speed, 2)", "");
    check_problems("derivative(dmin, 2 m)", "[2 m] `derivative` takes s, not m -- write it in s");
    check_problems(
        "derivative(dmin, 0)",
        "[0] `derivative` takes a span of a microsecond to a million seconds -- write it with its unit, such as `0.5 s`",
    );
    check_problems(
        "delay(dmin, speed)",
        "[speed] `delay` takes a constant -- variables are not allowed here",
    );
}

#[test]
fn equations_have_two_sides_that_fit() {
    let check =
        |text: &str, expected: &str| assert_eq!(rover().equation_problems(text), expected, "of {text}");
    check("dmin = min(distances)", "");
    check("dmin + 1 m", "[] an `=` is missing at the end -- an equation is written `variable = formula`");
    check("dmin = speed", "[dmin = speed] `=` of m and m/s -- both sides must have the same unit");
    check("dmin = 0", "");
    check(
        "dmin = distances",
        "[dmin = distances] the left side is a number, the right side a vector -- both sides of an equation are numbers, or both are vectors",
    );
    check("distances = 2 * distances[0..3]", "");
    check(
        "sped = slop",
        "[sped] `sped` is not defined -- did you mean `speed`?\n[slop] `slop` is not defined -- did you mean `slip`?",
    );
}

#[test]
fn shapes_fit_at_every_node() {
    check_problems(
        "min(speed)",
        "[speed] `min` of one argument takes a vector, not a number -- only a variable with `shape: vector`, or a part of one, is a vector",
    );
    check_problems(
        "if(distances, 1, 2) + (1 < 2 < 3)",
        "[distances] `if` takes true or false, not a vector -- take one element, such as `v[0]`, or `min`, `max`, `mean`, `norm`, ... of it\n\
         [1 < 2] `<` takes a number, not true or false -- write `if(condition, then, else)` to make a number of it, `a < b and b < c` for a range",
    );
    check_problems(
        "distances[1 m]",
        "[1 m] an index takes a plain number, not m -- divide by `1 m` for a plain number",
    );
    check_problems(
        "distances[3..1]",
        "[distances[3..1]] no element lies from 3 to before 1 -- `v[a..b]` holds the elements from a to before b, counted from 0",
    );
    check_problems(
        "distances[0..load]",
        "[load] the end of a slice takes a constant -- variables are not allowed here",
    );
    check_problems("distances[0.5..]", "[0.5] the end of a slice is a whole number, not negative");
    check_problems("max(distances * weights) + mean(distances) + norm(distances - 1 m)", "");
    check_problems(
        "integral(distances)",
        "[distances] `integral` takes a number, not a vector -- take one element, such as `v[0]`, or `min`, `max`, `mean`, `norm`, ... of it",
    );
    check_problems(
        "previous(dt)",
        "[previous(dt)] `previous` of a time operator -- `previous(x)` takes variables and what is computed from them at one moment",
    );
}

#[test]
fn functions_of_the_model_are_written_out() {
    check_text("clamp01(load)", "min(max(load, 0), 1)");
    check_text("double(double(load))", "4 * load");
    check_text("nearest(distances)", "min(distances)");
    check_problems(
        "again(1)",
        "[again(1)] in `again`: the function `again` uses itself -- a function cannot use itself, not by way of others either",
    );
    check_problems(
        "ping(1)",
        "[ping(1)] in `ping`: the function `ping` uses itself -- a function cannot use itself, not by way of others either",
    );
    check_problems(
        "2 * turned(3)",
        "[turned(3)] in `turned`: `sin` takes an angle, not a plain number -- multiply by `1 rad` if it is in radians",
    );
    let model = rover();
    let problems = |name: &str| check_function(model.function(name).unwrap(), &model);
    assert_eq!(problems("clamp01"), []);
    assert_eq!(problems("nearest"), []);
    assert_eq!(problems("again").len(), 1);
}

#[test]
fn constants_are_written_out_and_folded() {
    check_text("wheel_base * 2 / 1 m", "5.34");
    check_text("plusminus(0.1 m) + dmin", "plusminus(0.1) + dmin");
    check_text("interval(0.9, 1.1) * load", "interval(0.9, 1.1) * load");
    check_text("sin(pi * 1 rad / 2)", "1");
    check_text("if(1 < 2, load, slip)", "load");
    check_text("dmin + plusminus(1 m) - plusminus(1 m) - dmin", "0 * dmin + plusminus(2)");
    check_problems("interval(2, 1)", "[interval(2, 1)] the first bound of this interval is above the second");
    check_problems(
        "plusminus(load)",
        "[load] `plusminus` takes a constant -- variables are not allowed here",
    );
}

#[test]
fn equal_terms_are_collected() {
    check_text("load - load", "0 * load");
    check_text("load * load", "load^2");
    check_text("load / load", "load^0");
    check_text("load * slip / load", "load^0 * slip");
    check_text("load^2 / load^3", "1 / load");
    check_text("load + slip + load", "2 * load + slip");
    check_text("3 * load - load * 2", "load");
    check_text("load + 1 + 2", "load + 3");
    check_text("load + 0", "load");
    check_text("1 * load / 1", "load");
    check_text("-(-load)", "load");
    check_text("sqrt(load^2)", "abs(load)");
    check_text("abs(-load)", "abs(load)");
    check_text("min(load, load)", "load");
    check_text("sin(heading)^2 + sin(heading)^2", "2 * sin(heading)^2");
    check_text("(load + plusminus(1)) - (load + plusminus(1))", "0 * load + plusminus(2)");
    check_text(
        "sqrt(load + plusminus(1)) * sqrt(load + plusminus(1))",
        "sqrt(load + plusminus(1)) * sqrt(load + plusminus(1))",
    );
}

#[test]
fn quantities_outside_formulas() {
    let check = |text: &str, value: f64, unit: &str| {
        let quantity = parse_quantity(text).unwrap_or_else(|problem| panic!("{text}: {problem}"));
        assert_eq!(
            (quantity.value, quantity.unit.map(|unit| unit.to_string()).unwrap_or_default()),
            (value, unit.to_string())
        );
    };
    check("2.67 m", 2.67, "m");
    check("-100 ms", -100.0, "ms");
    check("2 %", 2.0, "%");
    check("10 Hz", 10.0, "Hz");
    check("3", 3.0, "");
    assert_eq!(parse_quantity("m").unwrap_err().to_string(), "error at 0..1: a number is missing before `m`");
    assert!(
        parse_quantity("1 m 2").is_err() && parse_quantity("").is_err() && parse_quantity("1 foo").is_err()
    );
}

#[test]
fn heads_of_functions() {
    assert_eq!(parse_function_head("f(x, y)"), Ok(("f".to_string(), vec!["x".to_string(), "y".to_string()])));
    for head in ["f", "f()", "f(x", "f(x,)", "f(x, x)", "min(x)", "f(pi)", "f(x) y", "3(x)", ""] {
        assert!(parse_function_head(head).is_err(), "{head}");
    }
    assert!(is_reserved("min") && is_reserved("dt") && !is_reserved("speed"));
}

#[test]
fn formulas_are_bounded() {
    let model = rover();
    let deep =
        |open: &str, inner: &str, close: &str| [open.repeat(1500), inner.into(), close.repeat(1500)].concat();
    for text in [
        deep("(", "1", ")"),
        deep("-", "1", ""),
        deep("sin(", "1", ")"),
        deep("not ", "true", ""),
        deep("2^", "1", ""),
    ] {
        assert!(model.problems(&text).contains("nested deeper than 64 levels"), "{}", model.problems(&text));
    }
    assert!(model.problems(&deep("1+", "1", "")).contains("nested deeper"));
    assert_eq!(model.problems(&["load*2+".repeat(100), "1".to_string()].concat()), "");
    assert!(model.problems(&deep("distances[", "1", "]")).contains("nested deeper"));
    assert!(parse_expression(&"(".repeat(100_000)).unwrap_err().message.contains("more than 20000 bytes"));
    assert!(parse_expression(&"1 ".repeat(100_000)).is_err());
}

#[test]
fn functions_written_out_are_bounded() {
    let mut model = Model::new().variable("x", "", None);
    for level in 0..200 {
        let body = if level == 0 {
            "a * a + 1".to_string()
        } else {
            std::format!("f{0}(a) + f{0}(sin(a * 1 rad))", level - 1)
        };
        model = model.define(&std::format!("f{level}(a)"), &body);
    }
    let problems = model.problems("f199(x)");
    assert!(problems.contains("more than 10000 terms or 200 levels"), "{problems}");
    assert_eq!(problems.lines().count(), 1);
    assert!(model.problems("f25(x)").contains("more than 10000 terms"));
    assert_eq!(model.problems("f3(x)"), "");
}
