//! The embedded default: a simulated robot in the same process.

use crate::running::{Folder, Running, TOKEN};
use serde_json::Value;
use std::process::Command;
use std::time::{Duration, Instant};

/// Starts the embedded default, and waits until every signal was received and the need's own source serves it.
fn settled(arguments: &[&str]) -> Running {
    let run = Running::start(arguments.iter().copied());
    run.until("dmin is served by the lidar", |state| {
        let rover = &state["models"]["rover"];
        let has_come = |signal: &Value| signal["accepted"].as_u64() > Some(5);
        rover["signals"].as_object().is_some_and(|signals| signals.values().all(has_come))
            && rover["needs"]["v_dmin"]["quality"] == "Good"
    });
    run
}

#[test]
fn it_always_starts_and_serves_the_need() {
    let run = settled(&[]);
    let (_, state) = run.get("/state");
    assert_eq!(state["models"]["rover"]["needs"]["v_dmin"]["source"], "/lidar/scan by nearest");
    assert_eq!(run.get("/health").0, 200);
    let (status, metrics) = run.get("/metrics");
    assert_eq!(status, 200);
    let quality = r#"shsa_need_quality{model="rover",need="v_dmin",quality="Good"} 1"#;
    assert!(metrics.as_str().unwrap().contains(quality), "{metrics}");
    assert_eq!(run.get("/nothing").0, 404);
    assert_eq!(run.stop().code(), Some(0));
}

#[test]
fn a_terminal_that_nobody_reads_delays_nothing() {
    let run = Running::start_unread([]);
    let served = |state: &Value| {
        let need = &state["models"]["rover"]["needs"]["v_dmin"];
        (need["source"].clone(), need["published"].as_u64().unwrap_or(0))
    };
    run.until("it is served by the lidar", |state| served(state).0 == "/lidar/scan by nearest");
    // Much more than the 64 KiB of a pipe.
    let begun = Instant::now();
    for _ in 0..450 {
        for order in ["forbid", "allow"] {
            let order = format!(r#"{{"order": "{order}", "signal": "/lidar/scan"}}"#);
            assert_eq!(run.order(Some(TOKEN), &order).0, 200);
        }
    }
    let (_, events) = run.get("/events");
    assert!(events.to_string().len() > 75_000, "{}", events.to_string().len());
    let (_, before) = served(&run.get("/state").1);
    run.until("it goes on", |state| served(state).1 > before + 10);
    assert!(begun.elapsed() < Duration::from_secs(60));
    let ending = Instant::now();
    assert_eq!(run.stop().code(), Some(0));
    assert!(ending.elapsed() < Duration::from_secs(10));
}

#[test]
fn a_change_by_order_is_healed_at_once_and_reported() {
    let run = settled(&[]);
    let order = r#"{"order": "change", "text": "available: { /lidar/scan: false }"}"#;
    let (status, answer) = run.order(Some(TOKEN), order);
    assert_eq!(status, 200, "{answer}");
    let decision = run.decision("substituted");
    assert_eq!(decision["substitution"], "/sonar/ranges by nearest");
    run.until("the new source is told", |state| {
        state["models"]["rover"]["needs"]["v_dmin"]["source"] == "/sonar/ranges by nearest"
    });
    let (_, events) = run.get("/events?since=0");
    let kinds: Vec<&str> = events.as_array().unwrap().iter().map(|it| it["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["ordered", "substituted"]);
    let number = events[1]["number"].as_u64().unwrap();
    assert_eq!(run.get(&format!("/events?since={number}")).1.as_array().unwrap().len(), 1);
}

#[test]
fn what_is_wrong_with_an_order_is_reported_and_changes_nothing() {
    let run = Running::start([]);
    let wrong = [
        (400, r#"{"order": "explode"}"#, "there is no order `explode`"),
        (422, r#"{"order": "change", "text": "relations: { nearest: 7 }"}"#, "nearest"),
        (422, r#"{"order": "change", "text": "{}", "model": "car"}"#, "no model 'car'; there are: rover"),
    ];
    for (expected, order, words) in wrong {
        let (status, answer) = run.order(Some(TOKEN), order);
        assert_eq!(status, expected, "{answer}");
        assert!(answer["error"].as_str().unwrap().contains(words), "{answer}");
    }
    assert_eq!(run.get("/events").1.as_array().unwrap().len(), 0);
}

#[test]
fn without_the_token_nothing_is_changed_and_guessing_is_limited() {
    let run = Running::start([]);
    assert_eq!(run.order(None, r#"{"order": "reload"}"#).0, 401);
    let guesses: Vec<u16> = (0..7).map(|_| run.order(Some("a guess"), r#"{"order": "reload"}"#).0).collect();
    assert_eq!(guesses, [401, 401, 401, 401, 401, 429, 429]);
    assert_eq!(run.order(Some(TOKEN), r#"{"order": "reload"}"#).0, 429);
    let (_, events) = run.get("/events");
    assert!(events.as_array().unwrap().iter().all(|event| event["kind"] == "denied"), "{events}");
    let (_, state) = run.get("/state");
    assert!(!state.to_string().contains(TOKEN));
}

#[test]
fn its_journal_replays_to_the_same_decisions() {
    let folder = Folder::new();
    let journal = folder.path("journal");
    let run = settled(&["--journal", journal.to_str().unwrap()]);
    run.order(Some(TOKEN), r#"{"order": "change", "text": "available: { /lidar/scan: false }"}"#);
    run.decision("ordered");
    run.decision("substituted");
    run.until("more has come", |state| state["figures"]["messages"].as_u64() > Some(200));
    let (_, reported) = run.get("/events");
    assert_eq!(run.stop().code(), Some(0));

    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/rover.yaml");
    let replay = Command::new(env!("CARGO_BIN_EXE_shsa"))
        .args(["replay", "--json", model])
        .arg(journal.join("rover.jsonl"))
        .output()
        .unwrap();
    let report: serde_json::Value = serde_json::from_slice(&replay.stdout).unwrap();
    let because = |events: &Value| {
        let events = events.as_array().unwrap().iter().filter(|event| event["kind"] != "ordered");
        events.map(|event| event["because"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(because(&report["events"]), because(&reported));
}

/// Two needs of the same distance; only the lidar is exact enough for the second one. Without the lidar, the sonar serves one
/// need, and the other has no source.
#[test]
fn several_needs_of_one_variable_have_each_their_own_source() {
    let run = settled(&[]);
    let needs = "{ signal: /display/dmin, max_age: 300 ms, max_width: 0.5 m }, \
                 { signal: /brake/dmin, max_age: 300 ms, max_width: 0.1 m }";
    let order = format!(r#"{{"order": "change", "text": "needs: {{ v_dmin: [{needs}] }}"}}"#);
    let (status, answer) = run.order(Some(TOKEN), &order);
    assert_eq!(status, 200, "{answer}");
    let served =
        |state: &Value, need: &str, source: &str| state["models"]["rover"]["needs"][need]["source"] == source;
    run.until("both are served by the lidar", |state| {
        ["/display/dmin", "/brake/dmin"].iter().all(|need| served(state, need, "/lidar/scan by nearest"))
    });
    run.order(Some(TOKEN), r#"{"order": "forbid", "signal": "/lidar/scan"}"#);
    let unhealable = run.decision("unhealable");
    assert_eq!(unhealable["need"], "/brake/dmin", "{unhealable}");
    run.until("each has its own", |state| {
        served(state, "/display/dmin", "/sonar/ranges by nearest")
            && state["models"]["rover"]["needs"]["/brake/dmin"]["source"].is_null()
    });
    run.order(Some(TOKEN), r#"{"order": "allow", "signal": "/lidar/scan"}"#);
    run.until("both are back", |state| {
        ["/display/dmin", "/brake/dmin"].iter().all(|need| served(state, need, "/lidar/scan by nearest"))
    });
}
