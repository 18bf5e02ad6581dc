//! Files of earlier versions can be read: states and journals of the first form, in `tests/live/earlier`.

use crate::running::{Folder, Running, TOKEN};
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
fn a_state_of_another_form_is_told_and_left_as_it_is_and_the_run_heals_without() {
    let folder = Folder::new();
    let state = folder.path("state");
    fs::create_dir_all(&state).unwrap();
    let later = STATE.replace("shsa-state-1", "shsa-state-9");
    fs::write(state.join("rover.json"), &later).unwrap();
    let run = Running::start(["--state", state.to_str().unwrap()]);
    let told = run.decision("degraded");
    let because = told["because"].as_str().unwrap();
    assert!(because.contains("shsa-state-9") && because.contains("begins without a state"), "{told}");
    run.until("it heals", |state| state["models"]["rover"]["needs"]["v_dmin"]["quality"] == "Good");
    assert_eq!(run.stop().code(), Some(0));
    assert_eq!(fs::read_to_string(state.join("rover.broken.json")).unwrap(), later);
}

#[test]
fn a_run_heals_without_the_files_that_the_disk_refuses() {
    let folder = Folder::new();
    // Nothing can be in a folder whose name is that of a file.
    let place = folder.path("place");
    fs::write(&place, "").unwrap();
    let path = place.to_str().unwrap();
    let run = Running::start(["--state", path, "--journal", path]);
    run.until("it heals", |state| state["models"]["rover"]["needs"]["v_dmin"]["quality"] == "Good");
    let (status, health) = run.get("/health");
    assert_eq!((status, health["degraded"].as_array().unwrap().len()), (200, 2), "{health}");
    let told = [run.decision("degraded"), run.decision("degraded")];
    assert!(told[0]["because"].as_str().unwrap().starts_with("there is no journal in "), "{told:?}");
    assert!(told[1]["because"].as_str().unwrap().starts_with("the state is not saved in "), "{told:?}");
    fs::remove_file(&place).unwrap();
    let is_there = |file: &str| place.join(file).exists();
    run.until("the files are there", |_| is_there("rover.json") && is_there("rover.jsonl"));
    run.until("nothing is missing", |_| run.get("/health").1["degraded"] == serde_json::json!([]));
    // The run writes into it at the same time: its name is taken away at once.
    fs::rename(&place, folder.path("gone")).unwrap();
    run.until("they are made anew", |_| is_there("rover.json") && is_there("rover.jsonl"));
    assert_eq!(run.stop().code(), Some(0));
}

#[test]
fn a_model_that_is_cut_off_takes_no_need_away() {
    let folder = Folder::new();
    let path = folder.path("tank.yaml");
    fs::write(&path, MODEL).unwrap();
    let run = Running::start([path.to_str().unwrap(), "--bus", "memory"]);
    let needs = |run: &Running| run.get("/health").1["needs"].clone();
    let before = needs(&run);
    assert!(before["/healed/level"].is_string(), "{before}");
    fs::write(&path, &MODEL[..MODEL.find("needs:").unwrap()]).unwrap();
    let (status, refused) = run.order(Some(TOKEN), r#"{"order": "reload"}"#);
    assert!(status != 200 && refused.to_string().contains("has no need /healed/level any more"), "{refused}");
    assert_eq!(needs(&run), before);
    let (status, done) = run.order(Some(TOKEN), r#"{"order": "reload", "force": true}"#);
    assert!(status == 200 && done.to_string().contains("nothing serves /healed/level any more"), "{done}");
    assert_eq!(needs(&run), serde_json::json!({}));
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
