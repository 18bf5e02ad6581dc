//! Fusions of a model: what has become of their measurements, and their method by one word.

use crate::folder::Folder;
use std::fmt::Write;

const MODEL: &str = "\
shsa: 1
variables: { level: { unit: m } }
signals:
  /float: { variable: level, rate: 10 Hz, value_error: 0.1 }
  /sonar: { variable: level, rate: 5 Hz, value_error: 0.2 }
fusion:
  tank:
    method: METHOD
    states: { level: { initial: 2, spread: 2, noise: 0.05 } }
    inputs: { level: level }
    outputs: { fused/level: { value: level, properties: { accuracy: 1 } } }
    period: 100 ms
    unknown_after: 2 s
    particles: 100
needs: { level: { signal: /tank/level, max_age: 500 ms } }
";

/// 20 s of both sensors; one message of the sonar is said twice, one is a second late, and both are silent from 10 to 15 s.
fn recording() -> String {
    let mut lines: Vec<(i64, String)> = Vec::new();
    let mut say = |signal: &str, at_ms: i64, received_ms: i64| {
        let value = 3.0 + 0.02 * ((at_ms / 100 * 7) % 5 - 2) as f64;
        let line = format!(
            "{{\"signal\": \"{signal}\", \"time_ns\": {}, \"received_ns\": {}, \"value\": {value}}}",
            at_ms * 1_000_000,
            received_ms * 1_000_000
        );
        lines.push((received_ms, line));
    };
    for at_ms in (100..20_000).step_by(100).filter(|at_ms| !(10_000..15_000).contains(at_ms)) {
        say("/float", at_ms, at_ms);
        if at_ms % 200 == 0 {
            say("/sonar", at_ms, if at_ms == 5_000 { 6_000 } else { at_ms });
        }
        if at_ms == 8_000 {
            say("/sonar", at_ms, at_ms + 1);
        }
    }
    lines.sort_by_key(|(received_ms, _)| *received_ms);
    lines.into_iter().fold(String::new(), |mut text, (_, line)| {
        writeln!(text, "{line}").unwrap();
        text
    })
}

fn folder(method: &str) -> Folder {
    let model = MODEL.replace("METHOD", method);
    Folder::with(&[("tank.yaml", model.as_bytes()), ("run.jsonl", recording().as_bytes())])
}

#[test]
fn a_replay_says_what_has_become_of_the_measurements() {
    let folder = folder("kalman");
    let report = folder.json("replay tank.yaml run.jsonl", 1);
    let sonar = &report["fusion"]["tank"]["/sonar"];
    assert_eq!((&sonar["duplicate"], &sonar["too_late"]), (&1.into(), &1.into()), "{sonar}");
    let text = folder.ends("replay tank.yaml run.jsonl", 1).stdout;
    let used = format!("tank    /sonar  {:<4}  1          1         0", sonar["used"].as_u64().unwrap());
    assert!(text.contains(&used), "{used}\n{text}");
}

/// Without any input an estimate goes out for as long as the model says, and then none.
#[test]
fn every_method_goes_on_for_as_long_as_declared() {
    for method in ["average", "confidence", "marzullo", "kalman", "unscented_kalman", "student", "particle"] {
        let folder = folder(method);
        folder.ends("replay tank.yaml run.jsonl --output out.jsonl", 1);
        let times: Vec<f64> = folder
            .read("out.jsonl")
            .lines()
            .map(|line| {
                serde_json::from_str::<serde_json::Value>(line).unwrap()["time_ns"].as_f64().unwrap() / 1e9
            })
            .collect();
        let last = times.iter().copied().filter(|at| *at < 14.9).fold(0.0, f64::max);
        assert!((11.5..12.1).contains(&last), "{method}: {last}");
        assert!(times.iter().filter(|at| **at >= 15.0).count() > 30, "{method}");
    }
}
