//! `shsa scan` on the bus in memory: receives the simulated robot, matches it with its model; `shsa draft --bus` drafts a model of it.

use crate::folder::Folder;
use serde_json::Value;

const ROVER: &str = include_str!("../../../../models/rover.yaml");

#[test]
fn the_simulated_robot_is_heard_and_matched() {
    let folder = Folder::with(&[("rover.yaml", ROVER.as_bytes())]);
    let ended = folder.run("scan rover.yaml --for 1500ms --json");
    assert_eq!(ended.status, 0, "{}", ended.stderr);
    let output: Value = serde_json::from_str(&ended.stdout).unwrap();
    let topics: Vec<&str> =
        output["topics"].as_array().unwrap().iter().map(|it| it["topic"].as_str().unwrap()).collect();
    assert_eq!(topics, ["/depth/image", "/lidar/scan", "/odom/speed", "/sonar/ranges"]);
    let rate = output["topics"][2]["rate_hz"].as_f64().unwrap();
    assert!((10.0..30.0).contains(&rate), "{rate}");
    assert_eq!(output["topics"][0]["fields"][0]["kind"], "list");
    for signal in output["signals"].as_array().unwrap() {
        assert_eq!(signal["missing"], Value::Null, "{signal}");
    }
}

#[test]
fn a_signal_that_is_not_there_is_missing_with_its_reason() {
    let folder = Folder::new();
    let model =
        "shsa: 1\nvariables: { v: { unit: m/s } }\nsignals:\n  speed: { variable: v, source: /odom/sped }\n";
    folder.write("model.yaml", model);
    let ended = folder.run("scan model.yaml --for 500ms");
    assert_eq!(ended.status, 1, "{}", ended.stderr);
    for words in ["Missing: 1 of 1 signal", "nothing on /odom/sped; did you mean /odom/speed?"] {
        assert!(ended.stdout.contains(words), "{}", ended.stdout);
    }
}

#[test]
fn a_draft_is_a_model_that_hears_what_it_was_drafted_from() {
    let folder = Folder::new();
    let draft = folder.ends("draft --bus memory --for 700ms", 0).stdout;
    folder.write("draft.yaml", &draft);
    assert_eq!(folder.run("check draft.yaml").status, 0, "{draft}");
    // What moves has the figures of a recording's draft; lists have none.
    let speed = draft.lines().find(|line| line.contains("source: \"/odom/speed\"")).unwrap_or_default();
    for key in ["rate: ", "value_error: ", "timeout: ", " values, noise "] {
        assert!(speed.contains(key), "no {key}: {draft}");
    }
    assert!(draft.contains("lidar_scan: { shape: vector }"), "{draft}");
    let again = folder.run("scan draft.yaml --for 700ms");
    assert_eq!(again.status, 0, "{}", again.stdout);
    assert!(again.stdout.contains("All 4 signals are there."), "{}", again.stdout);
    folder.ends("draft --bus memory --for 700ms --model draft.yaml -o rest.yaml", 0);
    assert!(folder.read("rest.yaml").contains("Nothing new was heard."));
    // As it was called before.
    let earlier = folder.ends("scan draft.yaml --for 700ms --draft", 0);
    assert_eq!(earlier.stdout, folder.read("rest.yaml"));
    assert!(
        earlier.stderr.contains("`shsa scan --draft` is now `shsa draft --bus BUS`"),
        "{}",
        earlier.stderr
    );
}

#[test]
fn a_bus_that_is_not_there_is_reported() {
    let folder = Folder::new();
    folder.refuses("scan --for 1s --bus nonsense", &["is no bus"]);
    folder.refuses("scan --for 1", &["has no unit of time"]);
    // The error comes at once, not after an hour.
    let ended = folder.run("scan --for 1h --bus mqtt://127.0.0.1:1");
    assert_eq!((ended.status, &*ended.stdout), (4, ""), "{}", ended.stderr);
    for words in ["mqtt://127.0.0.1:1 cannot be reached", "refused"] {
        assert!(ended.stderr.contains(words), "{}", ended.stderr);
    }
}
