//! Fusions: errors are reported at their place, and the origins of states are found.

use super::{brief, check, loaded};
use shsa_core::knowledge::{FusionMethod, KnowledgeBase};

const PLANT: &str = "variables: { position: { unit: m }, speed: { unit: m/s } }
signals:
  /gps: { variable: position, rate: 5 Hz, value_error: 2, noise: 0.5 }
  /odom: { variable: speed, rate: 20 Hz, value_error: 0.1 }
fusion:
  motion:
    method: kalman
    states:
      position: { spread: 10, transition: position + speed * dt }
      speed: { spread: 3, noise: 0.5 }
    inputs: { /gps: position, /odom: speed }
    outputs: { fused/position: position, fused/speed: speed }";

fn plant(from: &str, to: &str) -> String {
    assert!(PLANT.contains(from), "{from}");
    PLANT.replace(from, to)
}

fn knowledge(text: &str) -> KnowledgeBase {
    let loaded = loaded(text);
    assert!(loaded.report.ok(), "{}", brief(&loaded));
    loaded.knowledge
}

#[test]
fn what_a_lost_input_takes_is_reported() {
    check(
        PLANT,
        "12:15 note: without `/gps` nothing observes `position` (its uncertainty grows then: a second input that measures it would hold it)",
    );
}

#[test]
fn what_nothing_observes_is_reported() {
    let text = plant("    inputs: { /gps: position, /odom: speed }", "    inputs: { /odom: speed }");
    check(
        &text,
        "10:7 warning: nothing observes `position`: it stays as uncertain as it was at first, or becomes more so (add an input that it shows in, or leave the state away)
         12:15 note: without `/odom` nothing observes `speed` (its uncertainty grows then: a second input that measures it would hold it)",
    );
}

/// Particles that nothing tells apart get fewer and fewer ancestors.
#[test]
fn particles_that_nothing_observes_are_reported() {
    let text = plant("    inputs: { /gps: position, /odom: speed }", "    inputs: { /odom: speed }");
    let found = brief(&loaded(&text.replace("method: kalman", "method: particle")));
    assert!(found.contains("nothing observes `position`: its particles get fewer ancestors"), "{found}");
}

#[test]
fn units_of_formulas_are_checked() {
    check(&plant("/gps: position", "/gps: speed"), "12:21 error: this counts in `m/s`, and `m` is wanted");
    check(
        &plant("position + speed * dt", "position + speed"),
        "10:43 error: `+` of m and m/s (both sides must have the same unit)",
    );
    check(
        &plant("noise: 0.5 }\n    inputs", "noise: 1 m }\n    inputs"),
        "11:34 error: `1 m` does not count in `m/s` (write a number, which counts in `m/s`, or a unit like it)",
    );
}

#[test]
fn names_must_be_known() {
    check(&plant("speed * dt", "sped * dt"), "10:54 error: `sped` is not defined (did you mean `speed`?)");
    check(
        &plant("/odom: speed }", "/odo: speed }"),
        "12:31 error: there is no signal `/odo` (did you mean `/odom`?)",
    );
    check(
        &plant("method: kalman", "method: calman"),
        "8:13 error: `calman` is no method of fusion (did you mean `kalman`?)",
    );
    check(
        &plant("fused/speed: speed", "/odom: speed"),
        "13:42 error: there is a signal `/odom` already (give the output another name)",
    );
}

#[test]
fn what_has_no_model_combines_what_measures_the_same() {
    let text = plant("method: kalman", "method: median").replace("/odom: speed", "/odom: 2 * speed");
    check(
        &text,
        "7:3 error: fusion `motion` cannot be set up: the formula of /odom is no state by itself, and `median` combines what measures the same (choose another method, or change its model)
         10:43 warning: `median` has no model of the states, and ignores the transition of `position` (choose a filter such as `kalman`, or leave it away)",
    );
}

#[test]
fn one_word_changes_the_method() {
    for (word, method) in FusionMethod::NAMES {
        let knowledge = knowledge(&plant("method: kalman", &format!("method: {word}")));
        assert_eq!(knowledge.fusions()[0].method, method);
    }
}

/// Parts of the model that do not count are warnings, settings are notes, and a filter uses all parts.
#[test]
fn what_a_method_does_not_use_is_reported() {
    let without_model = plant("method: kalman", "method: median")
        .replace("noise: 0.5 }\n    inputs", "noise: 2 % * speed + push }\n    inputs");
    let text = format!(
        "{}\n    controls: {{ push: /odom }}\n    gate: 99 %\n    window: 3\n    seed: 2",
        without_model
    );
    check(
        &text,
        "10:43 warning: `median` has no model of the states, and ignores the transition of `position` (choose a filter such as `kalman`, or leave it away)
         11:7 warning: the noise of `speed` can be below 0, and a standard deviation cannot (write `abs(..)`, or `max(.., 0.1)` with the least noise, or give its variables a `range`; below 0 its magnitude counts)
         11:34 warning: `median` has no model of the states, and takes this noise of `speed` for 0 (write a number, or choose a filter such as `kalman`)
         12:15 note: without `/gps` nothing observes `position` (its uncertainty grows then: a second input that measures it would hold it)
         14:17 warning: `median` has no model of the states, and ignores the control input `push` (choose a filter such as `kalman`, or leave it away)
         15:11 note: `median` does not use `gate` (Kalman and particle filters use it)
         17:11 note: `median` does not use `seed` (`particle` uses it)",
    );
}

#[test]
fn noise_that_can_be_below_zero_is_reported() {
    let warned = |formula: &str| {
        let text = plant("noise: 0.5 }\n    inputs", &format!("noise: {formula} }}\n    inputs"));
        let text = text.replace("unit: m/s }", "unit: m/s, range: [-3, 3] }");
        let found = brief(&loaded(&text));
        found.lines().find(|line| line.contains("below 0")).map(str::to_owned)
    };
    let expected = "11:7 warning: the noise of `speed` can be below 0, down to -0.75 in SI, and a standard deviation cannot (write `abs(..)`, or `max(.., 0.1)` with the least noise, or give its variables a `range`; below 0 its magnitude counts)";
    assert_eq!(warned("0.25 * speed").as_deref(), Some(expected));
    assert_eq!(warned("0.1 m/s + 0.2 * abs(speed)"), None);
    assert_eq!(warned("1 m/s + 0.25 * speed"), None);
}

#[test]
fn what_is_computed_is_derived_from_its_inputs() {
    let knowledge = knowledge(PLANT);
    let origins = |name: &str| -> Vec<&str> {
        let signal = knowledge.signal(name).unwrap_or_else(|| panic!("no {name}"));
        let origins = knowledge.signals()[signal].derived_from.iter();
        origins.map(|origin| knowledge.signals()[*origin].name.as_str()).collect()
    };
    assert_eq!(origins("fused/position"), ["/gps", "/odom"]);
    assert_eq!(origins("motion without /odom"), ["/gps"]);
    // Odometry gives only changes of the position: the prediction begins from a position known by satellite.
    assert_eq!(origins("motion without /gps"), ["/gps", "/odom"]);
    let prediction = knowledge.fusions()[0].predictions.iter().find(|it| it.input == 0).unwrap();
    assert!(prediction.is_anchored);
}
