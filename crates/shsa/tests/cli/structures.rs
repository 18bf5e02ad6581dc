//! `shsa analyze` on small systems of the literature on fault diagnosis with published isolability.
//!
//! Three tanks, an electric motor and an induction motor are example models of the Fault Diagnosis Toolbox (Frisk, Krysander and
//! Jung 2017, doi:10.1016/j.ifacol.2017.08.504); the linear system with disturbances is by Commault, Dion, Sename and Motyeian
//! 2002 (doi:10.1109/TAC.2002.806662). Here they are in this project's language, with derivatives usable as derivatives.

use crate::folder::Folder;
use serde_json::{Value, json};
use std::collections::BTreeSet;

fn analysis(model: &str) -> Value {
    Folder::with(&[("m.yaml", model.as_bytes())]).json("analyze m.yaml --additions 0", 0)
}

/// Whether a fault of a signal or relation is detectable, and the signals and relations that it is told from.
fn found<'a>(answer: &'a Value, name: &str) -> (bool, BTreeSet<&'a str>) {
    let of = |list: &str, key: &str| {
        answer[list].as_array().unwrap().iter().find(|it| it[key] == name).map(|it| {
            let names = ["isolable_from", "isolable_from_relations"].into_iter();
            let names = names.filter_map(|key| it[key].as_array()).flatten();
            (it["detectable"] == true, names.map(|name| name.as_str().unwrap()).collect())
        })
    };
    of("signals", "signal").or_else(|| of("relations", "relation")).unwrap()
}

/// Checks which faults each fault cannot be told from.
#[track_caller]
fn check(answer: &Value, expected: &[(&str, &[&str])]) {
    for (fault, taken_for) in expected {
        let (detectable, others) = found(answer, fault);
        assert!(detectable, "{fault} does not show");
        let all = expected.iter().map(|(fault, _)| *fault);
        let taken: Vec<&str> = all.filter(|other| !others.contains(other)).collect();
        assert_eq!(taken, *taken_for, "{fault}");
    }
}

/// The obstacle to telling a fault from another one, or to detecting it.
#[track_caller]
fn gap<'a>(answer: &'a Value, fault: &str, from: &Value) -> &'a Value {
    let gaps = answer["gaps"].as_array().unwrap();
    gaps.iter().find(|gap| gap["fault"] == fault && gap["from"] == *from).unwrap()
}

const TANKS: &str = "\
shsa: 1
variables: { level_1: {}, level_2: {}, level_3: {}, inflow: {}, flow_1: {}, flow_2: {}, flow_3: {}, rise_1: {}, rise_2: {}, rise_3: {} }
relations:
  valve_1: { equation: flow_1 = level_1 - level_2, properties: { prior: 0.01 } }
  valve_2: { equation: flow_2 = level_2 - level_3, properties: { prior: 0.01 } }
  valve_3: { equation: flow_3 = 2 * level_3, properties: { prior: 0.01 } }
  tank_1: { equation: rise_1 = inflow - flow_1, properties: { prior: 0.01 } }
  tank_2: { equation: rise_2 = flow_1 - flow_2, properties: { prior: 0.01 } }
  tank_3: { equation: rise_3 = flow_2 - flow_3, properties: { prior: 0.01 } }
  change_1: { output: rise_1, inputs: [level_1] }
  change_2: { output: rise_2, inputs: [level_2] }
  change_3: { output: rise_3, inputs: [level_3] }
signals:
  level:  { variable: level_1, rate: 1 Hz, properties: { prior: 1e-9 } }
  middle: { variable: flow_2, rate: 1 Hz, properties: { prior: 1e-9 } }
  pump:   { variable: inflow, rate: 1 Hz, properties: { prior: 1e-9 } }
";

/// Six faults of relations: isolated as published for derivative causality; the obstacles to more are named.
#[test]
fn three_tanks_leak() {
    let answer = analysis(TANKS);
    let many: &[&str] = &["valve_1", "valve_2", "valve_3", "tank_1", "tank_3"];
    check(
        &answer,
        &[
            ("valve_1", &["valve_1", "tank_1"]),
            ("valve_2", many),
            ("valve_3", many),
            ("tank_1", &["valve_1", "tank_1"]),
            ("tank_2", &["valve_1", "tank_1", "tank_2"]),
            ("tank_3", many),
        ],
    );
    // Published for mixed causality: only valve_2, valve_3 and tank_3 cannot be told apart.
    let named = gap(&answer, "valve_1", &json!("tank_1"));
    assert_eq!(named["obstacles"][0]["what"], "loop", "{named}");
    let turned = gap(&answer, "tank_1", &json!("valve_1"));
    assert_eq!(turned["because"], "change_2 is not solved for level_2");
    let pairs: BTreeSet<(&str, &str)> = [
        ("valve_1", "tank_1"),
        ("valve_2", "valve_1"),
        ("valve_2", "tank_1"),
        ("valve_3", "valve_1"),
        ("valve_3", "tank_1"),
        ("tank_1", "valve_1"),
        ("tank_2", "valve_1"),
        ("tank_2", "tank_1"),
        ("tank_3", "valve_1"),
        ("tank_3", "tank_1"),
    ]
    .into();
    let gaps = answer["gaps"].as_array().unwrap().iter();
    let found: BTreeSet<(&str, &str)> =
        gaps.map(|gap| (gap["fault"].as_str().unwrap(), gap["from"].as_str().unwrap())).collect();
    assert_eq!(pairs, found);
}

/// The speed is measured; to isolate the current from it, the speed is eliminated.
#[test]
fn the_sensors_of_an_electric_motor_are_told_apart_by_looking_behind_one() {
    let model = "\
shsa: 1
variables: { current: {}, current_rate: {}, speed: {}, speed_rate: {}, angle: {}, angle_rate: {}, torque: {}, load: {}, driving: {}, voltage: {} }
relations:
  winding: { equation: voltage = 2 * current + current_rate + 3 * speed, properties: { prior: 0.01 } }
  magnet: { equation: driving = 4 * current }
  inertia: { equation: torque = speed_rate + 5 * speed }
  balance: { equation: torque = driving - load }
  turning: { equation: angle_rate = speed }
  current_change: { output: current_rate, inputs: [current] }
  speed_change: { output: speed_rate, inputs: [speed] }
  angle_change: { output: angle_rate, inputs: [angle] }
signals:
  supply: { variable: voltage, rate: 1 Hz, properties: { prior: 1e-9 } }
  ammeter: { variable: current, rate: 1 Hz }
  tachometer: { variable: speed, rate: 1 Hz }
  brake: { variable: torque, rate: 1 Hz }
";
    let answer = analysis(model);
    let winding: &[&str] = &["winding", "ammeter"];
    let expected: [(&str, &[&str]); 4] =
        [("winding", winding), ("ammeter", winding), ("tachometer", &["tachometer"]), ("brake", &["brake"])];
    check(&answer, &expected);
    assert_eq!(answer["gaps"], json!([]));
    // If the winding only gives the voltage, it cannot be solved for the speed.
    let one_way = model.replace("3 * speed, properties", "3 * speed, for: [voltage], properties");
    let answer = analysis(&one_way);
    assert_eq!(gap(&answer, "ammeter", &json!("tachometer"))["because"], "winding is not solved for speed");
}

/// Flux and speed voltage of each phase determine each other: nothing is compared, and this is reported.
#[test]
fn the_loops_of_an_induction_motor_are_reported_as_such() {
    let model = "\
shsa: 1
variables: { i_a: {}, i_b: {}, flux_a: {}, flux_b: {}, speed: {}, i_a_rate: {}, i_b_rate: {}, flux_a_rate: {}, flux_b_rate: {}, turned_a: {}, turned_b: {}, u_a: {}, u_b: {} }
relations:
  turn_a: turned_a = speed * flux_a
  turn_b: turned_b = speed * flux_b
  stator_a: i_a_rate = u_a - i_a + 2 * flux_a + turned_b
  stator_b: i_b_rate = u_b - i_b + 2 * flux_b - turned_a
  rotor_a: flux_a_rate = 3 * i_a - flux_a - turned_b
  rotor_b: flux_b_rate = 3 * i_b - flux_b + turned_a
  i_a_change: { output: i_a_rate, inputs: [i_a] }
  i_b_change: { output: i_b_rate, inputs: [i_b] }
  flux_a_change: { output: flux_a_rate, inputs: [flux_a] }
  flux_b_change: { output: flux_b_rate, inputs: [flux_b] }
signals:
  supply_a: { variable: u_a, rate: 1 Hz, properties: { prior: 1e-9 } }
  supply_b: { variable: u_b, rate: 1 Hz, properties: { prior: 1e-9 } }
  sensor_a: { variable: i_a, rate: 1 Hz }
  sensor_b: { variable: i_b, rate: 1 Hz }
  tachometer: { variable: speed, rate: 1 Hz, properties: { prior: 1e-9 } }
";
    let folder = Folder::with(&[("m.yaml", model.as_bytes())]);
    let answer = folder.json("analyze m.yaml --additions 0", 0);
    for sensor in ["sensor_a", "sensor_b"] {
        assert!(!found(&answer, sensor).0, "{sensor}");
        let obstacle = &gap(&answer, sensor, &Value::Null)["obstacles"][0];
        assert_eq!((&obstacle["what"], &obstacle["dynamic"]), (&json!("loop"), &json!(false)), "{obstacle}");
        let variables = obstacle["variables"].as_array().unwrap();
        let is_unmeasured = |name: &Value| {
            name.as_str().unwrap().contains("flux") || name == "turned_a" || name == "turned_b"
        };
        assert!(variables.len() > 1 && variables.iter().all(is_unmeasured), "{obstacle}");
    }
    let output = folder.ends("analyze m.yaml --additions 0", 0).stdout;
    for words in [
        "Faults that the structure would tell and no comparison does:",
        "sensor_a at all",
        "solved together",
        "algebraic",
    ] {
        assert!(output.contains(words), "no '{words}' in {output}");
    }
}

/// A variable that has to be integrated is no algebraic loop.
#[test]
fn a_differential_equation_is_reported_as_such() {
    let answer = analysis(
        "\
shsa: 1
variables: { level: {}, rate: {}, inflow: {}, shown: {} }
relations:
  law: rate = inflow - level
  change: { equation: \"rate = derivative(level, 1 s) * 1 s\", for: [rate] }
  display: shown = level + 2 * rate
signals:
  pump: { variable: inflow, rate: 1 Hz }
  gauge: { variable: shown, rate: 1 Hz }
",
    );
    let named = gap(&answer, "pump", &Value::Null);
    assert_eq!(named["obstacles"][0]["relations"], json!(["change", "display"]));
    let reason =
        "change and display would have to be solved together for level and rate (a differential equation)";
    assert_eq!(named["because"], reason);
}

/// Of four disturbances, two pairs cannot be told apart.
#[test]
fn a_linear_system_with_disturbances() {
    let answer = analysis(
        "\
shsa: 1
variables: { x1: {}, x2: {}, x3: {}, x4: {}, x5: {}, x6: {}, x7: {}, difference: {} }
constants: { nothing: 0 }
relations:
  f1: { equation: x5 = nothing, properties: { prior: 0.01 } }
  f2: { equation: x7 = nothing, properties: { prior: 0.01 } }
  f4: { equation: x6 = nothing, properties: { prior: 0.01 } }
  first: { equation: x1 = 2 * x5 + x7 }
  f3: { equation: x2 = 3 * x6, properties: { prior: 0.01 } }
  third: { equation: x3 = x1 + x2 }
  fourth: { equation: x4 = x1 - 2 * x2 }
  output: { equation: difference = x3 - x4 }
signals:
  z1: { variable: x3, rate: 1 Hz, properties: { prior: 1e-9 } }
  z2: { variable: difference, rate: 1 Hz, properties: { prior: 1e-9 } }
  z3: { variable: x4, rate: 1 Hz, properties: { prior: 1e-9 } }
",
    );
    let (one, other): (&[&str], &[&str]) = (&["f1", "f2"], &["f3", "f4"]);
    check(&answer, &[("f1", one), ("f2", one), ("f3", other), ("f4", other)]);
}

/// With as many equations as unknowns nothing is detectable, and nothing is missing.
#[test]
fn without_redundancy_nothing_shows() {
    let answer = analysis(
        "\
shsa: 1
variables: { x1: {}, x2: {}, x3: {} }
relations:
  a: { equation: x1 = x2 + x3, properties: { prior: 0.01 } }
  b: { equation: x2 = 2 * x3, properties: { prior: 0.01 } }
signals:
  s: { variable: x3, rate: 1 Hz }
",
    );
    for fault in ["a", "b", "s"] {
        assert_eq!(found(&answer, fault), (false, BTreeSet::new()));
    }
    assert_eq!(answer["gaps"], json!([]));
}
