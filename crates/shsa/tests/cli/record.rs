//! `shsa replay --record`: a run as a file of MCAP.

use crate::folder::keys;
use crate::real::python;
use crate::tank;
use serde_json::Value;
use std::process::Command;

#[test]
fn a_record_is_read_by_others_and_replays_to_the_same_decisions() {
    let folder = tank::folder();
    let run = "replay tank.yaml run.csv --inject drop:/pressure@40s..50s --record run.mcap --layout run.layout.json";
    let first = folder.json(run, 0);
    let again = folder.json("replay tank.yaml run.mcap --record again.mcap", 0);
    for field in ["observations", "events", "signals"] {
        assert_eq!(first[field], again[field], "{field}");
    }
    let listed = folder.json("info run.mcap", 0).to_string();
    for topic in [
        "/shsa/journal",
        "/shsa/graph",
        "/shsa/needs/",
        "/shsa/ways/level/",
        "/shsa/verdicts/pressure",
        "/shsa/decisions",
    ] {
        assert!(listed.contains(topic), "no {topic} in {listed}");
    }
    let layout: Value = serde_json::from_str(&folder.read("run.layout.json")).unwrap();
    let panels = keys(&layout["configById"]);
    assert!(panels.contains(&"Plot!need0") && panels.contains(&"RosOut!decisions"), "{panels:?}");
    assert!(layout["layout"].to_string().contains("StateTransitions!verdicts"));

    let bytes = std::fs::read(folder.path("run.mcap")).unwrap();
    folder.write("cut.mcap", &bytes[..bytes.len() * 2 / 3]);
    // The cut takes the index at the end: all inputs are replayed.
    let ended = folder.ends("replay tank.yaml cut.mcap", 3);
    assert_eq!(folder.json("replay tank.yaml cut.mcap", 3)["events"], first["events"]);
    assert!(ended.stderr.contains("warning: cut.mcap:251: the file ends"), "{}", ended.stderr);
    folder.refuses("replay tank.yaml run.mcap --inject drop:/level", &["a journal is replayed as it was"]);
    folder.refuses("replay tank.yaml run.csv --layout l.json", &["--record"]);
}

#[test]
fn the_python_library_reads_a_record() {
    let Some(python) = python() else { return };
    let folder = tank::folder();
    folder.ends("replay tank.yaml run.csv --record run.mcap", 0);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/record.py");
    let output = Command::new(python).arg(script).arg(folder.path("run.mcap")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read: Value = serde_json::from_slice(&output.stdout).unwrap();
    let counts = read["counts"].as_object().unwrap();
    let all: u64 = counts.values().filter_map(Value::as_u64).sum();
    assert_eq!(read["stated"], all, "{read}");
    assert_eq!(counts["/shsa/signals/level"], 60, "{read}");
    assert_eq!(read["attached"], serde_json::json!(["tank.yaml", "foxglove-layout.json"]));
}
