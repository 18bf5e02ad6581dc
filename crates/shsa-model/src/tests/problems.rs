//! One wrong model for each kind of problem.

mod commas;
mod units;
mod vague;

use super::{check, loaded};
use crate::load;

#[test]
fn keys_must_be_known() {
    check(
        "variabels: {}\nutility: norm\nsignls:\n  a: 1",
        "2:1 error: unknown key `variabels` (did you mean `variables`? known keys here: shsa, variables, constants, functions, relations, specifications, signals, fusion, needs, platform, contracts, utility)
         4:1 error: unknown key `signls` (did you mean `signals`? known keys here: shsa, variables, constants, functions, relations, specifications, signals, fusion, needs, platform, contracts, utility)",
    );
    check(
        "variables: { x: { qqq: 1 } }\nrelations: { r: { equation: x = 1, fro: x } }",
        "2:19 error: unknown key `qqq` (known keys here: unit, shape, range, max_rate, wraps, properties)
         3:36 error: unknown key `fro` (did you mean `for`? known keys here: equation, for, when, error, learn, output, outputs, inputs, properties)",
    );
}

#[test]
fn the_version_must_be_known() {
    let brief = |text: &str| super::brief(&load(text, "m.yaml"));
    assert_eq!(
        brief("utility: norm"),
        "1:1 warning: the version of the model's shape is missing (write `shsa: 1` in the first line)"
    );
    assert!(load("utility: norm", "m.yaml").report.ok());
    assert_eq!(
        brief("shsa: 2\nutility: norm"),
        "1:7 error: this version of the model's shape is not known (write `shsa: 1`)"
    );
}

#[test]
fn keys_are_given_once() {
    check(
        "variables:\n  x:\n  y:\n  x: { unit: m }\nrelations: { r: x = y }",
        "5:3 error: `x` is given twice (it is given in line 3 already: keep one)",
    );
}

#[test]
fn values_have_the_expected_shape() {
    check(
        "variables:\n  x: 3\n  y: [1]\n  z: { unit: [m], range: 3, properties: high }\nrelations: [x = y]\nneeds: { x: { max_age: { s: 1 } } }",
        "3:6 error: expected a variable's keys, found one value (write it like `speed: { unit: m/s, range: [-3, 3] }`)
         4:3 warning: nothing uses `y`
         4:6 error: expected a variable's keys, found a list (write it like `speed: { unit: m/s, range: [-3, 3] }`)
         5:3 warning: nothing uses `z`
         5:14 error: expected a unit, found a list (write it like `unit: m/s`)
         5:26 error: expected the lowest and the highest value, found one value (write it like `range: [-3, 3]`)
         5:41 error: expected named numbers, found one value (write it like `{ accuracy: 0.9 }`)
         6:12 error: expected names with their values, found a list (write it like `nearest: dmin = min(distances)`)
         7:10 error: nothing can provide `x` (add a signal that carries it, or a relation whose inputs are provided)
         7:24 error: expected a time, found a mapping (write it like `max_age: 300 ms`)",
    );
}

#[test]
fn names_are_free() {
    check(
        "variables: { if: , 2x: , a b: , dt: , c: , f: }\nconstants: { c: 1 }\nfunctions: { f(x): x, g(: x, min(x): x, h(x): h(x) }",
        "2:14 error: `if` cannot be a name (a name has letters, digits and `_`, begins with a letter, and means nothing else)
         2:20 error: `2x` cannot be a name (a name has letters, digits and `_`, begins with a letter, and means nothing else)
         2:26 error: `a b` cannot be a name (a name has letters, digits and `_`, begins with a letter, and means nothing else)
         2:33 error: `dt` cannot be a name (a name has letters, digits and `_`, begins with a letter, and means nothing else)
         2:39 warning: nothing uses `c`
         2:44 warning: nothing uses `f`
         3:14 error: `c` is a variable and a constant (keep one, or rename one)
         4:14 error: `f` is a variable and a function (keep one, or rename one)
         4:25 error: a parameter is missing at the end
         4:30 error: `min` has a meaning already
         4:47 error: the function `h` uses itself (a function cannot use itself, not by way of others either)",
    );
}

#[test]
fn formulas_are_checked_in_their_place() {
    check(
        "variables: { x: { unit: m }, t: { unit: s }, v: { shape: vector } }
relations:
  a: x = t + 1 m
  b: { equation: x = t * 1 m/s, when: t }
  c: 'x = (t'
  d: x = v[0] * nothing
  e: { equation: x = t * 1 m/s, when: t > x or }
  f: x + t
signals: { s: { variable: v } }",
        "4:10 error: `+` of s and m (both sides must have the same unit)
         5:39 error: this is no condition (write a comparison like `abs(speed) > 0.2`)
         6:13 error: a `)` is missing at the end
         7:17 error: `nothing` is not defined
         8:47 error: a number, a variable or a `(` is missing at the end
         9:11 error: an `=` is missing at the end (an equation is written `variable = formula`)",
    );
}

#[test]
fn relations_are_solved_for_something() {
    check(
        "variables: { x: , y: , z: , v: { shape: vector } }\nconstants: { c: 3, d: 4 }
relations:
  a: x^2 + x = sum(v) * sum(v)
  b: { equation: x = y, for: [z, y, c, q] }
  c: c = d
  d: { equation: x = y, for: [] }
  f: { outputs: [c, x], inputs: [x, q] }
  g: { output: x, inputs: [x] }
  h: { inputs: x }
  i: { equation: x = y, output: x }
  j: { output: z, inputs: [x], when: x > 0, error: 1, for: z }
  k: { equation: x = y, error: 1 s }
  l: [x]",
        "5:6 error: this relation can be solved for nothing (not for `x`: it occurs 2 times; not for `v`: a function of a vector has no inverse)
         6:31 error: `for` names `z`, but this cannot be solved for it: it does not occur (only `previous(..)` of it, or nothing, is in this equation)
         6:37 error: `c` is a constant (a constant is never computed)
         6:40 error: there is no variable `q` (declare it under `variables`)
         7:6 error: the constants of this relation contradict each other (the two sides have different values: correct one of them)
         8:3 error: relation `d` is to be solved for 0 variables (name 1 to 100 variables after `for`, or leave `for` away)
         9:18 error: `c` is a constant (a constant is never computed)
         9:37 error: there is no variable `q` (declare it under `variables`)
         10:3 error: relation `g` reads only what it produces (name other inputs)
         11:3 error: relation `h` says nothing (give it an `equation`, or `outputs` and `inputs` for structure only)
         12:3 error: relation `i` has an equation and a structure (keep `equation`, or `outputs` and `inputs`)
         13:3 error: `for` has no meaning in relation `j`, which has no equation (give an `equation`, or leave it away)
         13:3 error: `when` has no meaning in relation `j`, which has no equation (give an `equation`, or leave it away)
         13:3 error: `error` has no meaning in relation `j`, which has no equation (give an `equation`, or leave it away)
         15:6 error: expected an equation or a relation's keys, found a list (write it like `nearest: dmin = min(distances)`)",
    );
}

#[test]
fn noise_without_a_bound_is_a_warning() {
    check(
        "variables: { speed: { unit: m/s } }
signals: { a: { variable: speed, noise: 0.1 }, b: { variable: speed, noise: 0.1, value_error: 0 } }",
        "3:41 warning: `a` has noise, but no `value_error`: its values count as exact, and every difference as a contradiction (give the bound that a sound value keeps, several times its noise; where the relations carry the error, `value_error: 0`)",
    );
}

#[test]
fn the_sign_of_the_first_lopsided_errors_is_noted() {
    check(
        "variables: { speed: { unit: m/s } }
signals:
  a: { variable: speed, value_error: [-0.1, 0.1], time_error: [-5 ms, 5 ms] }
  b: { variable: speed, value_error: [-0.1, 50 cm/s] }
  c: { variable: speed, value_error: [0, 1], time_error: [-100 ms, 0 ms] }",
        "5:39 note: the lopsided `value_error` of `b` is added to a reading: the truth is a reading plus -0.1 to 50 cm/s (where a reading minus the truth is meant, as in metrology, write `value_error: [-50 cm/s, 0.1]`)
         6:59 note: the lopsided `time_error` of `c` is added to a time stamp: the truth is a time stamp plus -100 ms to 0 ms (where a time stamp minus the truth is meant, as in metrology, write `time_error: [0 ms, 100 ms]`)",
    );
}

#[test]
fn signals_carry_variables() {
    check(
        "variables: { speed: { unit: m/s } }
signals:
  a: { rate: 10 }
  b: { variable: sped, rate: 10 s }
  c: { variable: speed, value_error: -1, delay: 100, timeout: 0 s }
  d: { variable: speed, time_error: [1 s, -1 s], derived_from: [e, b, zzz] }
  e: { variable: speed, derived_from: d, value_error: [2, 1], rate: 0 Hz }
  f: { variable: speed, time_error: -5 ms, value_error: 100 %, mean_over: -1 s, rate: 1e300 Hz }
  g: { variable: speed, properties: { cost: 0.5, accuracy: 2, prior: 0, foo: bar } }",
        "4:3 error: signal `a` carries no variable (say which: `variable: speed`)
         4:14 error: `10` is no frequency (write it like `10 Hz` or `2 1/min`)
         5:18 error: there is no variable `sped` (did you mean `speed`?)
         5:30 error: `10 s` is no frequency (write it like `10 Hz` or `2 1/min`)
         6:38 error: `-1` is no plus-minus error (write `0.15`, `5 cm`, `2 %`, `0.3 + 1 %`, or the lowest and highest error `[-0.1, 0.2]`)
         6:49 error: `100` has no unit (write a time like `300 ms` or `2 s`)
         6:63 error: a signal that may never be silent (write a time, or `timeout: none`)
         7:38 error: the lowest value is above the highest (write `[lowest, highest]`)
         7:65 error: signal `d` is derived from itself (name only the signals that it is computed from)
         7:71 error: there is no signal `zzz` (declare it under `signals`)
         8:56 error: the lowest value is above the highest (write `[lowest, highest]`)
         8:69 error: `0 Hz` is no frequency (write it like `10 Hz` or `2 1/min`)
         9:37 error: `-5 ms` is negative (write a time like `300 ms`)
         9:57 error: `100 %` is no plus-minus error (write `0.15`, `5 cm`, `2 %`, `0.3 + 1 %`, or the lowest and highest error `[-0.1, 0.2]`)
         9:75 error: `-1 s` is negative (write a time like `300 ms`)
         9:87 error: `1e300 Hz` is no frequency (write it like `10 Hz` or `2 1/min`)
         10:60 error: `accuracy: 2` makes no sense (an accuracy lies between 0 and 1)
         10:70 error: `prior: 0` makes no sense (a prior is the probability of a fault, more than 0 and less than 1)
         10:78 error: a number is missing before `bar`",
    );
}

#[test]
fn what_signals_share_is_checked() {
    check(
        "variables: { speed: { unit: m/s } }
signals:
  a: { variable: speed, shares: { imu: 0.001 } }
  b: { variable: speed, shares: { imu: 0.002, clock: 2 } }
  c: { variable: speed, shares: [imu, imu, clock] }
  d: { variable: speed, shares: { clock: [1] } }
  e: { variable: speed, shares: supply }",
        "5:40 error: `imu` has the prior 0.001 elsewhere (write the same number everywhere)
         5:54 error: `clock: 2` makes no sense (a prior is the probability of a fault, more than 0 and less than 1)
         6:39 error: `imu` is given twice (keep one)
         7:42 error: expected the probability of a fault, found a list (write it like `shares: [imu], or shares: { imu: 0.001 }`)
         8:33 warning: only one signal shares `supply` (a common cause is shared by two signals or more)",
    );
}

#[test]
fn readings_have_limits() {
    check(
        "variables: { speed: { unit: m/s, range: [0, 50] }, scan: { unit: m, shape: vector } }
signals:
  a: { variable: speed, range: [60, 70], max_rate: 0 }
  b: { variable: speed, range: [20, 10], max_rate: 3 m/s, max_delay: 3 }
  c: { variable: speed, range: 10, max_delay: -1 s, maxrate: 3 }
  d: { variable: scan, range: [0, 5], max_rate: none }
  e: { variable: scan, max_delay: none, mean_over: 1 s }
  f: { variable: speed, mean_over: -1 s }
  g: { variable: scan, hold: true }
  h: { variable: speed, hold: always }
needs: { scan: {} }",
        "4:33 error: nothing in this range is possible for `speed` (give readings within the `range` of the variable)
         4:52 error: a largest rate of change is above 0 (leave `max_rate` away when it is not known)
         5:33 error: the lowest value is above the highest (write `[lowest, highest]`)
         5:52 error: `3 m/s` does not count in `m/s/s` (write a number, which counts in `m/s/s`, or a unit like it)
         5:70 error: `3` has no unit (write a time like `300 ms` or `2 s`)
         6:32 error: expected the lowest and the highest reading, found one value (write it like `range: [0, 5 V]`)
         6:47 error: `-1 s` is negative (write a time like `300 ms`)
         6:53 error: unknown key `maxrate` (did you mean `max_rate`? known keys here: variable, source, unit, scale, offset, rate, value_error, change_error, noise, time_error, delay, mean_over, timeout, range, saturates, max_rate, max_delay, frozen_after, rests_at, rests_for, counter, hold, access, derived_from, shares, properties)
         7:32 error: `range` has no meaning for `scan`, which is a vector (leave it away)
         7:49 error: `max_rate` has no meaning for `scan`, which is a vector (leave it away)
         8:52 error: `mean_over` has no meaning for `scan`, which is a vector (leave it away)
         9:36 error: `-1 s` is negative (write a time like `300 ms`)
         10:30 error: `hold` has no meaning for `scan`, which is a vector (leave it away)
         11:31 error: `always` does not say whether a value stands until the next one (write `hold: true`, or the change at which the signal is sent again: `hold: 0.2 K`)",
    );
}

#[test]
fn a_need_says_what_goes_out_when_it_is_not_known_which_source_lies() {
    check(
        "variables: { x: }
signals: { a: { variable: x } }
needs:
  x: [{ signal: /x, when_unsure: mean, min_rate: 5 }, { signal: /x }]",
        "5:34 error: `mean` is nothing that can be done when it is not known which source lies (write `hull`, `last` or `withhold`)
         5:50 error: `5` is no frequency (write it like `10 Hz` or `2 1/min`)
         5:65 error: two needs are published as `/x` (give each need a name of its own)",
    );
}

#[test]
fn needs_can_be_met() {
    check(
        "variables: { x: { unit: m }, y: , z: , w: }\nrelations: { r: z = w }
signals: { a: { variable: x } }
needs:
  y: { max_age: 3, integrity: E, hold: -1 s }
  spede:
  z:
  x: { signal: a, max_width: 3 V, hysteresis: -5 %, blend: 1, probation: soon, isolation: moon }
utility: nrom",
        "6:3 error: nothing can provide `y` (add a signal that carries it, or a relation whose inputs are provided)
         6:17 error: `3` has no unit (write a time like `300 ms` or `2 s`)
         6:31 error: `E` is no integrity level (write `A`, `B`, `C` or `D`, the highest)
         6:40 error: `-1 s` is negative (write a time like `300 ms`)
         7:3 error: there is no variable `spede` (declare it under `variables`)
         8:3 error: nothing can provide `z` (add a signal that carries it, or a relation whose inputs are provided)
         9:16 warning: `a` is also the name of a signal (where the failed source may still speak, publish under another name)
         9:30 error: `3 V` does not count in `m` (write a number, which counts in `m`, or a unit like it)
         9:47 error: `-5 %` is negative (write a share like `5 %` or `0.05`)
         9:60 error: `1` has no unit (write a time like `300 ms` or `2 s`)
         9:74 error: a number is missing before `soon`
         9:91 error: `moon` is no place where substitutes are computed (write `process` or `engine`, which is usual)
         10:10 error: there is no utility `nrom` (write `norm`, or formulas of your own: `{ aggregate: product, relation: 1 / cost }`)",
    );
}

#[test]
fn a_utility_gets_no_better_with_more_relations() {
    let model = |utility: &str| {
        let elements = "variables: { x: , y: , z: }\nsignals: { a: { variable: y, rate: 10 Hz, properties: { trust: 0.9 } }, b: { variable: z } }";
        let relations = "relations: { r: { output: x, inputs: [y, z], properties: { cost: 0.5 } }, s: { output: x, inputs: [y] } }";
        format!("{elements}\n{relations}\n{utility}")
    };
    check(
        &model("utility: norm"),
        "4:66 error: the cost 0.5 of relation `r` is below 1 (a cost is at least 1)",
    );
    check(&model("utility: { aggregate: sum, relation: cost, defaults: { cost: 1 } }"), "");
    check(&model("utility: { aggregate: minimum, signal: trust * 1, defaults: { trust: 0.5 } }"), "");
    check(&model("utility: { relation: 1 / (1 + unprovided) }"), "");
    check(&model("utility: { way: agreement * availability }"), "");
    check(&model("utility: { way: exp(-error / width), defaults: { error: 1, width: 1 } }"), "");
    check(&model("utility: { way: agreement * availability * speed }"), "5:44 error: `speed` is not defined");
    check(
        &model("utility: { way: 1 / (1 + error) }"),
        "5:17 error: what `error` is of a way that has not been compared is not said (name what counts until it is known under `defaults`: `{ error: 1 }`)",
    );
    check(
        &model("utility: { way: 2 * agreement, defaults: { agreement: 3 } }"),
        "5:17 error: `agreement` is never 3, which stands under `defaults` (a share lies between 0 and 1, a distance is not below 0)
         5:17 error: the utility of a way may be 0 to 2 (it must lie between 0 and 1 whichever inputs are provided, so that no relation makes a substitution better)",
    );
    check(
        &model("utility: { aggregate: sum, relation: cost }"),
        "4:75 error: relation `s` has no `cost`, which the utility reads (give it or its outputs one, or name a value for all without it under `defaults`)",
    );
    check(
        &model("utility: { relation: inputs / 2 - unprovided }"),
        "4:14 error: the utility of relation `r` may be -1 (it must lie between 0 and 1 whichever inputs are provided, so that no relation makes a substitution better)
         4:75 error: the utility of relation `s` may be -0.5 (it must lie between 0 and 1 whichever inputs are provided, so that no relation makes a substitution better)",
    );
    check(
        &model("utility: { relation: sqrt(1.5 - unprovided) / 2 }"),
        "4:14 error: the utility of relation `r` may be without a value (it must lie between 0 and 1 whichever inputs are provided, so that no relation makes a substitution better)",
    );
    check(
        &model("utility: { aggregate: sum, signal: rate / 2 Hz - 6 }"),
        "3:12 error: the utility of signal `a` is -1 (costs lie between 0 and 1e9, so that no relation makes a substitution better)
         3:73 error: the utility of signal `b` has no value (give it or its variable every property that the formula reads, or name values under `defaults`)",
    );
    check(
        &model("utility: { relation: 1 m, signal: 2 }"),
        "5:22 error: a utility is a plain number, and this is in m (divide it by a constant of that unit)",
    );
    check(
        &model("utility: { aggregat: sum, relation: previous(inputs) + prise, agregate: 3 }"),
        "5:12 error: unknown key `aggregat` (did you mean `aggregate`? known keys here: aggregate, relation, signal, way, defaults)
         5:56 error: `prise` is not defined
         5:63 error: unknown key `agregate` (did you mean `aggregate`? known keys here: aggregate, relation, signal, way, defaults)",
    );
    check(
        &model("utility: { aggregate: max, defaults: { cost: 1 } }"),
        "5:10 error: this utility rates nothing (give it a formula: `relation: 1 / cost`)
         5:23 error: there is no aggregate `max` (write `product`, `sum` or `minimum`)",
    );
}

#[test]
fn people_see_the_line_and_programs_the_place() {
    let report = loaded("variables:\n  speed: { unit: m/s }\nrelations:\n  r: speed = 2 * spede\n").report;
    let expected = "\
error: `spede` is not defined
 --> m.yaml:5:18
  |
5 |   r: speed = 2 * spede
  |                  ^^^^^
  |
  = help: did you mean `speed`?
";
    assert_eq!(report.render(false), expected);
    assert!(report.render(true).contains("\u{1b}["));
    let json = r#"[{"severity":"error","message":"`spede` is not defined","file":"m.yaml","line":5,"column":18,"help":"did you mean `speed`?"}]"#;
    assert_eq!(serde_json::to_string(&report).unwrap(), json);
    assert_eq!(
        load("", "m.yaml").report.render(false),
        "error: the model is empty\n--> m.yaml\n = help: begin with `shsa: 1` and `variables:`\n"
    );
}

#[test]
fn places_inside_quotes_and_folded_texts_are_near() {
    check(
        "variables: { x: }\nrelations:\n  a: \"x = q\"\n  b: >\n    x =\n    q\n  c: 'x = ''q'\n  d: |\n    x = q",
        "4:11 error: `q` is not defined
         6:5 error: `q` is not defined
         8:6 error: `\\'` has no meaning in a formula
         10:9 error: `q` is not defined",
    );
}

#[test]
fn equations_are_solved_for_a_bounded_number_of_variables() {
    let model = |count: usize, relation: &str| {
        let names: Vec<String> = (0..count).map(|i| format!("x{i}")).collect();
        let equation = format!("x0 = mean({})", names[1..].join(", "));
        let declared = names.iter().map(|name| format!("{name}: ")).collect::<Vec<_>>().join(", ");
        format!("variables: {{ {declared} }}\nrelations:\n  r: {}", relation.replace("EQUATION", &equation))
    };
    check(
        &model(120, "EQUATION"),
        "4:6 error: this relation holds 120 variables (name those to solve for with `for`, at most 100)",
    );
    check(&model(120, "{ equation: 'EQUATION', for: x0 }"), "");
}
