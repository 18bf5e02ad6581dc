//! `shsa run --record`: a live run as a file of MCAP.

use crate::real::eventually;
use crate::running::{Folder, Running};
use serde_json::Value;
use std::process::Command;

const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/models/rover.yaml");

/// The decisions of a replay of this file, and its warnings.
fn replayed(file: &str) -> (Vec<Value>, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_shsa")).args(["replay", MODEL, file, "--json"]).output().unwrap();
    let report: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let events = report["events"].as_array().cloned().unwrap_or_default();
    (events, String::from_utf8_lossy(&output.stderr).into_owned())
}

/// What a decision is about, and why it was made.
fn decided(decision: &Value) -> [&Value; 4] {
    ["kind", "signal", "variable", "because"].map(|field| &decision[field])
}

#[test]
fn a_record_replays_to_the_same_decisions() {
    let folder = Folder::new();
    let (file, state) = (folder.path("run.mcap"), folder.path("state"));
    let (file, state) = (file.to_str().unwrap(), state.to_str().unwrap());
    // The first run leaves a state, with which the second one begins.
    for _ in 0..2 {
        let run = Running::start([MODEL, "--record", file, "--state", state]);
        let first = run.decision("substituted");
        let (status, mut reported) = run.stop_and_tell();
        assert!(status.success());
        reported.insert(0, first);
        let (events, warnings) = replayed(file);
        assert_eq!(warnings, "");
        let at = events.iter().position(|event| decided(event) == decided(&reported[0]));
        let same = at.map(|at| &events[at..]).unwrap_or_else(|| panic!("{reported:?} not in {events:?}"));
        let known: Vec<_> = reported.iter().filter(|it| it["variable"].is_string()).map(decided).collect();
        assert_eq!(same.iter().map(decided).collect::<Vec<_>>(), known);
    }
}

#[test]
fn a_run_that_is_killed_leaves_a_record_up_to_seconds_before() {
    let folder = Folder::new();
    let file = folder.path("run.mcap");
    let file = file.to_str().unwrap();
    let run = Running::start([MODEL, "--record", file]);
    run.decision("substituted");
    // What is written can be read while the run goes on.
    let written = eventually("the decision is written", || {
        let (events, warnings) = replayed(file);
        let is_cut = warnings.contains("the file ends");
        events.iter().any(|event| event["kind"] == "substituted").then_some((events, is_cut))
    });
    assert!(written.1);
    run.kill();
    let (events, warnings) = replayed(file);
    assert!(events.starts_with(&written.0) && warnings.contains("the file ends"), "{warnings}");
}

#[test]
fn a_record_is_of_one_model() {
    let folder = Folder::new();
    let file = folder.path("run.mcap");
    let ended = Running::ended([MODEL, MODEL, "--record", file.to_str().unwrap()]);
    let words = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.code() == Some(2) && words.contains("a record is of one model"), "{words}");
}
