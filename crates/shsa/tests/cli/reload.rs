//! `shsa replay --reload`: changes the model in the middle of a recording.

use crate::tank;

/// The tank without the sensor of its pressure.
const WITHOUT_PRESSURE: &str = "signals: { /pressure: null }\n";

#[test]
fn what_is_decided_after_the_change_rests_on_the_new_model() {
    let folder = tank::folder();
    folder.write("change.yaml", WITHOUT_PRESSURE);
    // The two remaining sensors do not tell which one is faulty.
    let report = folder.json("replay tank.yaml run.csv --reload change.yaml@10s", 1);
    let kinds: Vec<&str> =
        report["events"].as_array().unwrap().iter().map(|it| it["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["suspected", "suspected", "unhealable"]);
    assert_eq!(report["reloads"], serde_json::json!([{ "time_s": 10.0, "file": "change.yaml" }]));
    assert_eq!(report["observations"], 180 - 50);
    assert!(report["signals"].get("/pressure").is_none());
    let ended = folder.ends("replay tank.yaml run.csv --reload change.yaml@10s", 1);
    assert!(ended.stdout.contains("10.000 s  reloaded    change.yaml\n"), "{}", ended.stdout);
}

#[test]
fn a_source_that_is_taken_away_is_replaced_at_once() {
    let folder = tank::folder();
    folder.write("change.yaml", "signals: { /level: null }\n");
    let report = folder.json("replay tank.yaml run.csv --reload change.yaml@10s", 0);
    let event = &report["events"][0];
    assert_eq!((event["kind"].as_str(), event["time_s"].as_f64()), (Some("substituted"), Some(10.0)));
    assert!(event["because"].as_str().unwrap().starts_with("the changed model has no /level any more; "));
    assert_eq!(report["events"].as_array().unwrap().len(), 1);
    assert_eq!(report["needs"]["level"]["longest_gap_s"], 1.0);
}

#[test]
fn a_change_back_and_forth_leaves_the_decisions_alone() {
    let folder = tank::folder();
    folder.write("whole.yaml", tank::MODEL);
    let plain = folder.json("replay tank.yaml run.csv --output a.jsonl", 0);
    let reloads = (1..55).map(|second| format!(" --reload whole.yaml@{second}s")).collect::<String>();
    let changed = folder.json(&format!("replay tank.yaml run.csv --output b.jsonl{reloads}"), 0);
    for key in ["events", "needs", "signals", "observations"] {
        assert_eq!(plain[key], changed[key]);
    }
    assert_eq!(folder.read("a.jsonl"), folder.read("b.jsonl"));
}

#[test]
fn the_journal_of_a_changed_run_replays_byte_for_byte() {
    let folder = tank::folder();
    folder.write("change.yaml", WITHOUT_PRESSURE);
    folder.write("back.yaml", tank::MODEL);
    let reloads = "--reload back.yaml@40s --reload change.yaml@10s";
    folder.ends(&format!("replay tank.yaml run.csv {reloads} --journal a.journal --output a.jsonl"), 1);
    std::fs::remove_file(folder.path("change.yaml")).unwrap();
    let report = folder.json("replay tank.yaml a.journal --journal b.journal --output b.jsonl", 1);
    assert_eq!(folder.read("a.journal"), folder.read("b.journal"));
    assert_eq!(folder.read("a.jsonl"), folder.read("b.jsonl"));
    assert_eq!(report["reloads"].as_array().unwrap().len(), 2);
    folder.write("other.yaml", tank::MODEL.replace("/pressure", "/druck"));
    folder.refuses("replay other.yaml a.journal", &["does not have; replay it with the model of its run"]);
    folder.refuses("replay tank.yaml a.journal --reload back.yaml@1s", &["a journal is replayed as it was"]);
}

#[test]
fn a_file_with_errors_changes_nothing() {
    let folder = tank::folder();
    let plain = folder.json("replay tank.yaml run.csv", 0);
    folder.write("wrong.yaml", "signals:\n  /level: { variable: levl }\n  /presure: null\n");
    let ended = folder.ends("replay tank.yaml run.csv --reload wrong.yaml@10s --json", 3);
    for problem in [
        "there is no variable `levl`",
        "wrong.yaml:2:23",
        "there is no signal `/presure` to change",
        "did you mean `/pressure`?",
        "warning: wrong.yaml has errors: the model before it goes on",
    ] {
        assert!(ended.stderr.contains(problem), "{problem}: {}", ended.stderr);
    }
    let report: serde_json::Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!((&report["events"], &report["needs"]), (&plain["events"], &plain["needs"]));
}

#[test]
fn wrong_arguments_are_reported() {
    let folder = tank::folder();
    folder.refuses("replay tank.yaml run.csv --reload none.yaml@10s", &["none.yaml cannot be read"]);
    folder.refuses("replay tank.yaml run.csv --reload tank.yaml", &["write it like new.yaml@20s"]);
    folder.refuses("replay tank.yaml run.csv --reload @20s", &["the file's name is missing"]);
    folder.refuses("replay tank.yaml run.csv --reload tank.yaml@soon", &["'soon' has no unit of time"]);
    let ended = folder.ends("replay tank.yaml run.csv --reload tank.yaml@100s", 0);
    assert!(
        ended.stderr.contains("tank.yaml changes nothing: the recording ends before that"),
        "{}",
        ended.stderr
    );
}
