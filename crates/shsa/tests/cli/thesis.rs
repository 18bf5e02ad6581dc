//! `shsa replay --compare VARIABLE --mode thesis`, compared step by step with the recorded experiments of the published program.
//!
//! The recorded runs lie outside the project; without them the test prints SKIPPED. The only difference concerns ties: they name
//! nobody here, while the published program names the lowest index.

use crate::folder::Folder;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::Write as _;

const REFERENCE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/monitor_experiments.json");
const TOLERANCE: f64 = 1e-9;

/// Run and step of the experiments in which two substitutions tie.
const TIES: [(usize, usize); 8] = [(2, 6), (3, 2), (4, 2), (5, 2), (8, 6), (9, 2), (10, 2), (11, 2)];

#[test]
fn the_command_reproduces_the_experiments() {
    let Ok(text) = std::fs::read_to_string(REFERENCE) else {
        let _ = writeln!(std::io::stderr(), "SKIPPED: the recorded experiments are not at {REFERENCE}");
        return;
    };
    let reference: Value = serde_json::from_str(&text).unwrap();
    let mut ties = Vec::new();
    for (number, experiment) in reference["experiments"].as_array().unwrap().iter().enumerate() {
        let expected = experiment["steps"].as_array().unwrap();
        let found = run(experiment);
        assert_eq!(found.len(), expected.len(), "run {number}");
        for (at, (found, expected)) in found.iter().zip(expected).enumerate() {
            if compare(found, expected, &format!("run {number}, step {at}")) {
                ties.push((number, at));
            }
        }
    }
    assert_eq!(ties, TIES);
}

/// The steps that the command prints for an experiment's inputs.
fn run(experiment: &Value) -> Vec<Value> {
    let folder = Folder::with(&[
        ("model.yaml", model(experiment).as_bytes()),
        ("inputs.jsonl", inputs(experiment).as_bytes()),
    ]);
    let buffer = &experiment["buffer_size"];
    let ended = folder.ends(
        &format!(
            "replay model.yaml inputs.jsonl --compare x --period 1s --buffer {buffer} --mode thesis --json"
        ),
        0,
    );
    assert_eq!(ended.stderr, "");
    ended.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn model(experiment: &Value) -> String {
    let mut text = "shsa: 1\nvariables: { x: {} }\nsignals:\n".to_owned();
    for (name, error) in experiment["uncertainty"].as_object().unwrap() {
        writeln!(
            text,
            "  {name}: {{ variable: x, value_error: [{}, {}], time_error: [{} ns, {} ns] }}",
            error["verr_low"], error["verr_high"], error["terr_low"], error["terr_high"]
        )
        .unwrap();
    }
    text
}

/// The inputs in the order of reception, including those after the last step.
fn inputs(experiment: &Value) -> String {
    let steps = experiment["steps"].as_array().unwrap().iter();
    let lists = steps.map(|step| &step["inputs"]).chain([&experiment["itoms_never_used"]]);
    let nanoseconds = |time: &Value| time.as_f64().unwrap() as i64;
    let mut text = String::new();
    for input in lists.flat_map(|list| list.as_array().unwrap()) {
        let line = json!({
            "signal": input["name"],
            "time_ns": nanoseconds(&input["t"]),
            "received_ns": nanoseconds(&input["t_reception"]),
            "value": input["v"],
        });
        writeln!(text, "{line}").unwrap();
    }
    text
}

/// Compares a step; returns whether it is a tie.
#[track_caller]
fn compare(found: &Value, expected: &Value, step: &str) -> bool {
    assert_eq!(found["time_ns"].as_f64(), expected["tm"].as_f64(), "{step}");
    assert_eq!(
        outputs(found, "substitution", "value", "time").len(),
        expected["outputs"].as_array().unwrap().len()
    );
    let pairs =
        outputs(found, "substitution", "value", "time").into_iter().zip(outputs(expected, "sidx", "v", "t"));
    for (found, expected) in pairs {
        assert!(close(&found, &expected), "{step}: {found:?}, not {expected:?}");
    }
    let (errors, expected_errors) = (numbers(&found["errors"]), numbers(&expected["error"]));
    assert!(close(&errors, &expected_errors), "{step}: {errors:?}, not {expected_errors:?}");
    let highest = errors.iter().copied().fold(0.0, f64::max);
    let tied = highest > 0.0 && errors.iter().filter(|error| highest - **error < TOLERANCE).count() > 1;
    let named = if tied { &json!(-1) } else { &expected["failed"] };
    assert_eq!(&found["failed"], named, "{step}");
    tied
}

/// The outputs of a step as substitution, value and time.
fn outputs(step: &Value, substitution: &str, value: &str, time: &str) -> Vec<Vec<f64>> {
    let flat = |output: &Value| {
        let mut flat = vec![output[substitution].as_f64().unwrap()];
        flat.extend(numbers(&output[value]));
        flat.extend(numbers(&output[time]));
        flat
    };
    step["outputs"].as_array().unwrap().iter().map(flat).collect()
}

/// The numbers of a list, or of a list in a list.
fn numbers(list: &Value) -> Vec<f64> {
    let list = if list[0].is_array() { &list[0] } else { list };
    list.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn close(found: &[f64], expected: &[f64]) -> bool {
    found.len() == expected.len()
        && found.iter().zip(expected).all(|(one, other)| (one - other).abs() <= TOLERANCE)
}
