//! Loading of models: the knowledge bases and the reports.

mod contracts;
mod fusion;
mod hostile;
mod json;
mod layout;
mod patch;
mod problems;
mod right;
mod schema;
mod specifications;

use super::{Loaded, Report, load};

/// A model with every key.
const EVERYTHING: &str = r#"
shsa: 1
variables:
  distances: { unit: m, shape: vector }
  dmin:      { unit: m, shape: scalar }
  speed:     { unit: m/s, range: [-3, 3 m/s], max_rate: 12 }
  heavy:     { properties: { accuracy: 0.9 } }
  curve_radius: { unit: m, range: [-.inf, .inf] }
  lateral_acceleration: { unit: m/s^2, max_rate: 30 m/s^3 }
constants:
  wheel_base: 2.67 m
  slip: [0.9, 1.1]
functions:
  clamp01(x): min(max(x, 0), 1)
relations:
  nearest: dmin = min(distances)
  shifted: dmin = speed * 1 s + wheel_base                      # usable for every variable it can be solved for
  turn:
    equation: curve_radius = speed^2 / lateral_acceleration
    for: [curve_radius, speed]
    when: abs(lateral_acceleration) > 0.2 m/s^2
    error: 0.1 + 2 %
    properties: { cost: 2 }
  travelled: dmin = previous(dmin) - speed * dt * slip
  opaque: { output: heavy, inputs: [distances, speed], properties: { cost: 3 } }
  either: { outputs: [dmin, heavy], inputs: [dmin, heavy, speed] }
signals:
  /scan:
    variable: distances
    source: scan#ranges
    unit: cm
    rate: 10 Hz
    value_error: [-10, 15 cm]
    time_error: [-100 ms, 0 ms]
    delay: 0 ms
    timeout: 1 s
    max_delay: 50 ms
    properties: { accuracy: 0.99, prior: 1 % }
  /odom/speed: { variable: speed, source: odom#twist.linear.x, rate: 20 Hz, value_error: 2 %, range: [-12 km/h, 2],
                 max_rate: 20, delay: 10 ms, derived_from: [/scan] }
  s1: { variable: heavy }
  accelerometer: { variable: lateral_acceleration, delay: 1 s }
  gyroscope: { variable: lateral_acceleration, rate: 20 Hz, delay: 0 s, max_rate: none, max_delay: none }
  s2: { variable: heavy, rate: 1000 Hz, time_error: 5 ms, timeout: none, derived_from: s1 }
needs:
  dmin: { signal: /emergency_stop/dmin, max_age: 250 ms, max_width: 50 cm, integrity: B, hold: 0 s,
          probation: 1 min, blend: 10 ms, hysteresis: 5 %, isolation: process }
  speed:
  curve_radius: {}
platform:
  host: { evidence: { spare: value of s1 at least 20 % }, gives: { time: { time: at least 5 ms, level: SIL 2, when: spare } } }
contracts:
  curve_radius: { runs_on: host, policy: warn, asks: { time: { of: platform, time: at least 2 ms, level: SIL 2 } } }
utility: norm
"#;

/// Loads a text as a model from its second line on.
fn loaded(text: &str) -> Loaded {
    load(&format!("shsa: 1\n{text}"), "m.yaml")
}

/// One line per problem: `line:column severity: message (help)`.
fn brief(loaded: &Loaded) -> String {
    lines(&loaded.report)
}

/// The same without notes.
fn serious(loaded: &Loaded) -> String {
    lines(&loaded.report.without_notes())
}

fn lines(report: &Report) -> String {
    let lines = report.diagnostics.iter().map(|found| {
        let json = serde_json::to_value(found).unwrap();
        let severity = json["severity"].as_str().unwrap().to_owned();
        let help = found.help.as_ref().map(|help| format!(" ({help})")).unwrap_or_default();
        format!("{}:{} {severity}: {}{help}", found.line, found.column, found.message)
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Compares the problems of a model, whose first line is added, with the expected ones, one per line.
#[track_caller]
fn check(text: &str, expected: &str) {
    let found = brief(&loaded(text));
    let expected = expected.trim().lines().map(str::trim).collect::<Vec<_>>().join("\n");
    assert!(found == expected, "found:\n{found}\nexpected:\n{expected}");
}
