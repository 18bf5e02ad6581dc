//! Tests of temperatures on a scale with its own zero: temperatures, differences, and values that are neither.

use super::*;

fn weather() -> Model {
    let mut model = Model::new()
        .variable("t", "degC", None)
        .variable("u", "degC", None)
        .variable("f", "degF", None)
        .variable("k", "K", None)
        .variable("ratio", "1", None)
        .variable("bare", "", None)
        .variable("heat", "W", None)
        .variable("pressure", "Pa", None)
        .variable("slope", "K/s", None)
        .vector("all", "degC")
        .constant("b_kelvin", "243.12 K")
        .constant("a", "17.62")
        .define("celsius(x)", "x - 0 degC")
        .define("magnus(x)", "a * celsius(x) / (b_kelvin + celsius(x))")
        .define("blend(x, y)", "0.3 * x + 0.7 * y")
        .define("both(x, y)", "x + y")
        .variable("b", "degC", None);
    let value = Constant::exact(243.12 + 273.15);
    model.variables.last_mut().unwrap().1.constant = Some(value);
    model
}

/// The message of an equation's first problem, up to its colon; empty when there is none.
#[track_caller]
fn check(text: &str, expected: &str) {
    let equation = parse_equation(text).unwrap();
    let problems = check_equation(&equation, &weather()).problems;
    let worst = problems.iter().map(|problem| problem.severity).max();
    let first = problems.iter().find(|problem| Some(problem.severity) == worst);
    let message = first.map_or("", |problem| problem.message.split(':').next().unwrap());
    let mark = first.map_or("", |problem| &text[problem.span.clone()]);
    let found = if message.is_empty() { String::new() } else { std::format!("{mark} -> {message}") };
    assert_eq!(found, expected, "of {text}: {problems:?}");
    assert!(problems.iter().all(|problem| problem.help.is_some()), "of {text}: no help");
}

#[test]
fn differences_means_and_weighted_sums_are_allowed() {
    for text in [
        "k = t - b",
        "k = t - u",
        "k = t - f",
        "t = u + k",
        "t = k + u",
        "t = u + 2 K",
        "t = u - 2 K",
        "t = u - (b - t)",
        "t = u",
        "t = f",
        "k = t",
        "t = k",
        "t = 20 degC",
        "t = -5 degC",
        "t = (u + b) / 2",
        "t = 0.5 * (u + b)",
        "t = mean(u, b)",
        "t = mean(u, b, f)",
        "t = median(u, b, 20 degC)",
        "t = min(u, max(b, f))",
        "t = 0.3 * u + 0.7 * b",
        "t = 0.1 * u + 0.2 * b + 0.7 * f",
        "t = u / 3 + b / 3 + f / 3",
        "t = 2 * u - b",
        "t = u + ratio * (b - u)",
        "t = blend(u, f)",
        "t = moving_mean(u, 60 s)",
        "t = previous(u)",
        "t = previous(t) + slope * dt",
        "t = delay(u, 2 s)",
        "t = if(u > 5 degC, u, b)",
        "t = if(u > f, u, b)",
        "t = within(u, -20 degC, 50 degC)",
        "t = within(u, -inf, 50 degC)",
        "t = either(u, f)",
        "t = mean(all)",
        "t = min(all[1..3])",
        "t = all[0] + 1 K",
        "t = interval(19 degC, 21 degC)",
        "t = u + plusminus(0.5 K)",
        "t + b = u + f",
        "slope = derivative(t, 60 s)",
        "k = abs(t - u)",
        "k = 2 * (t - u)",
        "k = max(t, u) - min(t, u)",
        "k = hypot(t - u, t - f)",
        "heat = 300 W/K * (t - u)",
        "ratio = magnus(t)",
        "magnus(t) = ln(ratio) + magnus(u)",
        "derivative(t, 60 s) * 400 kJ/K = heat - (300 W/K + 400 W/K * ratio) * (t - 5 degC)",
        "ratio = (t - 0 degC) / (b_kelvin + (t - 0 degC))",
        "ratio = (t - 0 K) / 300 K",
        "ratio = (t - 273.15 K) / 1 K",
        "ratio = exp((t - u) / 10 K)",
        "ratio = sum(all - 0 degC) / 1 K",
        "bare = t",
        "t = bare + u",
    ] {
        check(text, "");
    }
}

#[test]
fn what_counts_in_kelvin_is_as_it_was() {
    for text in [
        "ratio = k / 300 K",
        "pressure = 1.2 kg/m^3 * 287 J/kg/K * k",
        "t = pressure / (1.2 kg/m^3 * 287 J/kg/K)",
        "t = k * ratio^0.28",
        "k = 2 * b_kelvin",
        "ratio = (k / 300 K)^4",
        "k = k + b_kelvin",
        "ratio = exp(k / b_kelvin)",
        "ratio = 1 + log10(abs(k) / 1 K)",
    ] {
        check(text, "");
    }
}

#[test]
fn sums_and_multiples_of_temperatures_are_errors() {
    let none = "this is no temperature";
    for (text, at) in [
        ("t = b + u", "b + u"),
        ("t = 2 * u", "2 * u"),
        ("t = u * 2", "u * 2"),
        ("t = u / 2", "u / 2"),
        ("t = -u", "-u"),
        ("k = b + t", "b + t"),
        ("k = 2 * t", "2 * t"),
        ("t = 0.3 * u + 0.6 * b", "0.3 * u + 0.6 * b"),
        ("t = sum(u, b)", "sum(u, b)"),
        ("t = both(u, b)", "both(u, b)"),
        ("t = u + 2 degC", "u + 2 degC"),
        ("bare = t + u", "t + u"),
        ("ratio = k / (b + t)", "b + t"),
        ("t = min(2 * u, b)", "2 * u"),
        ("t = if(2 * u > b, u, b)", "2 * u"),
        ("k = abs(t + u)", "t + u"),
        ("t = 20 degC + 5 degC", "20 degC + 5 degC"),
    ] {
        check(text, &std::format!("{at} -> {none}"));
    }
}

#[test]
fn a_temperature_is_no_amount() {
    let takes = |at: &str, what: &str| {
        std::format!("{at} -> {what} takes a difference of temperatures, not a temperature in degC or degF")
    };
    for (text, at, what) in [
        ("ratio = t / u", "t", "`/`"),
        ("ratio = t / 300 K", "t", "`/`"),
        ("ratio = k / t", "t", "`/`"),
        ("bare = t * u", "t", "`*`"),
        ("t = ratio * u", "u", "`*`"),
        ("t = bare * u", "u", "`*`"),
        ("t = u * interval(0.9, 1.1)", "u", "`*`"),
        ("t = u / interval(0.9, 1.1)", "u", "`/`"),
        ("heat = 300 W/K * t", "t", "`*`"),
        ("bare = t^2", "t", "`^`"),
        ("bare = sqrt(t)", "t", "`sqrt`"),
        ("bare = root(t, 3)", "t", "`root`"),
        ("k = abs(t)", "t", "`abs`"),
        ("k = hypot(t, u)", "t", "`hypot`"),
        ("k = norm(all)", "all", "`norm`"),
        ("k = sum(all)", "all", "`sum`"),
        ("bare = integral(t)", "t", "`integral`"),
        ("t = u + plusminus(0.5 degC)", "0.5 degC", "`plusminus`"),
        ("ratio = exp(t / 10 K)", "t", "`/`"),
    ] {
        check(text, &takes(at, what));
    }
    check("ratio = magnus(heat)", "magnus(heat) -> in `magnus`");
}

#[test]
fn a_temperature_is_no_difference() {
    let mixed = |at: &str, what: &str| {
        std::format!("{at} -> `{what}` of a temperature and a difference of temperatures")
    };
    check("t = u - b", &mixed("t = u - b", "="));
    check("t = if(u - b > 2 degC, u, b)", &mixed("u - b > 2 degC", ">"));
    check("t = max(u, u - b)", &mixed("max(u, u - b)", "max"));
    check("t = interval(b - b, 21 degC)", &mixed("interval(b - b, 21 degC)", "interval"));
    check("t = if(u > 0, u, b)", "0 -> `0` without a unit is 0 K here");
}
