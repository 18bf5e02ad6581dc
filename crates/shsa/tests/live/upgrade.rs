//! Files of earlier versions can be read: states and journals of the first form, in `tests/live/earlier`.

use crate::running::{Folder, Running};
use serde_json::Value;
use std::fs;
use std::process::Command;

const STATE: &str = include_str!("earlier/rover.json");
const JOURNAL: &str = include_str!("earlier/tank.jsonl");
const MODEL: &str = "shsa: 1
variables: { level: { unit: m } }
signals:
  a: { variable: level, value_error: 0.1 }
  b: { variable: level, value_error: 0.1 }
  c: { variable: level, value_error: 0.1 }
needs: { level: { max_age: 1 s } }
";

#[test]
fn a_run_goes_on_from_a_state_of_an_earlier_version() {
    let folder = Folder::new();
    let state = folder.path("state");
    fs::create_dir_all(&state).unwrap();
    fs::write(state.join("rover.json"), STATE).unwrap();
    let run = Running::start(["--state", state.to_str().unwrap()]);
    let known = run.until("what was known is known", |state| {
        state["models"]["rover"]["signals"]["/lidar/scan"]["verdict"] == "failed"
    });
    let need = &known["models"]["rover"]["needs"]["v_dmin"];
    assert_ne!(need["source"], "/lidar/scan", "{need}");
    assert_eq!(run.stop().code(), Some(0));
    let saved = fs::read_to_string(state.join("rover.json")).unwrap();
    assert!(saved.contains("shsa-state-") && saved.contains("/sonar/ranges"), "{saved}");
}

#[test]
fn a_state_of_another_form_is_refused_and_left_as_it_is() {
    let folder = Folder::new();
    let state = folder.path("state");
    fs::create_dir_all(&state).unwrap();
    let later = STATE.replace("shsa-state-1", "shsa-state-9");
    fs::write(state.join("rover.json"), &later).unwrap();
    let ended = Running::ended(["--state", state.to_str().unwrap()]);
    assert_eq!(ended.status.code(), Some(2));
    let stated = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(stated.contains("shsa-state-9") && stated.contains("move it away to begin without"), "{stated}");
    assert_eq!(fs::read_to_string(state.join("rover.json")).unwrap(), later);
}

#[test]
fn a_journal_of_an_earlier_version_replays() {
    let folder = Folder::new();
    fs::write(folder.path("tank.yaml"), MODEL).unwrap();
    fs::write(folder.path("tank.jsonl"), JOURNAL).unwrap();
    let replay = Command::new(env!("CARGO_BIN_EXE_shsa"))
        .args(["replay", "--json"])
        .args(["tank.yaml", "tank.jsonl"].map(|name| folder.path(name)))
        .output()
        .unwrap();
    assert_eq!(replay.status.code(), Some(0), "{}", String::from_utf8_lossy(&replay.stderr));
    let report: Value = serde_json::from_slice(&replay.stdout).unwrap();
    assert_eq!(report["observations"], 6, "{report}");
    let of = |signal: &str, what: &str| report["signals"][signal][what].as_u64().unwrap();
    assert_eq!(
        [of("a", "accepted"), of("a", "invalid"), of("b", "accepted"), of("c", "accepted")],
        [2, 1, 2, 1]
    );
}
