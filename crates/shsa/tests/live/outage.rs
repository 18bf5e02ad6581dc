//! The connection to a broker is lost and restored, or the broker refuses what is published: the messages about it.

use crate::broker::{Broker, Cut};
use crate::real::{self, Script};
use crate::running::{Folder, Running};
use serde_json::{Value, json};
use std::path::Path;
use std::thread;
use std::time::Duration;

const MODEL: &str = "
shsa: 1
variables: { level: { unit: m } }
signals: { gauge: { variable: level, source: tank/gauge, unit: m, value_error: 0.1, timeout: none } }
needs: { level: { signal: tank/level, max_age: 1 h } }
";

fn run(folder: &Folder, port: u16) -> Running {
    let model = folder.path("tank.yaml");
    std::fs::write(&model, MODEL).unwrap();
    Running::start([model.to_str().unwrap(), "--bus", &format!("mqtt://127.0.0.1:{port}"), "--name", "tank"])
}

/// A client that receives the status of the need.
fn reader(python: &Path, broker: &Broker) -> Script {
    let options = json!({ "name": "reader", "port": broker.port() });
    let mut reader = Script::start(python, "../../../shsa-bridge/tests/python/mqtt_client.py", &options);
    reader.order(&json!({ "subscribe": "shsa/tank/need/level" }));
    reader
}

/// The last outage in the first status whose outage meets a condition.
#[track_caller]
fn last_outage(reader: &mut Script, is_wanted: impl Fn(&Value) -> bool) -> Value {
    for _ in 0..200 {
        let message = reader.next_with("topic");
        let hex = message["hex"].as_str().unwrap();
        let bytes = (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap());
        let status: Value = serde_json::from_slice(&bytes.collect::<Vec<u8>>()).unwrap();
        if is_wanted(&status["last_outage"]) {
            return status["last_outage"].clone();
        }
    }
    panic!("no status tells of the outage");
}

#[test]
fn after_an_outage_the_status_says_since_when_and_for_how_long() {
    let Some(python) = real::python() else { return };
    let (mut broker, folder) = (Broker::start(&[]), Folder::new());
    let run = run(&folder, broker.port());
    let before =
        run.until("no outage yet", |state| state["link"] == json!({ "up": true, "last_outage": null }));
    broker.kill();
    let lost = run.decision("disconnected");
    assert!(lost["because"].as_str().unwrap().starts_with("the bus is gone: "), "{lost}");
    run.until("it knows", |state| {
        state["link"]["last_outage"]["for_s"].is_null() && state["link"]["up"] == false
    });
    thread::sleep(Duration::from_millis(1_500));
    broker.restart();
    let found = run.decision("connected");
    let because = found["because"].as_str().unwrap();
    let seconds =
        because.strip_prefix("the bus is there again after ").and_then(|rest| rest.strip_suffix(" s"));
    let seconds: f64 = seconds.unwrap().parse().unwrap();
    assert!(seconds >= 1.5, "{because}");

    let outage = last_outage(&mut reader(&python, &broker), |outage| {
        // Statuses published before the reader subscribed arrive first.
        outage["number"] == 1 && outage["for_s"].is_f64()
    });
    assert!((outage["for_s"].as_f64().unwrap() - seconds).abs() < 0.001, "{outage} {because}");
    let (began, told_at) = (&before["time_ns"], &lost["time_ns"]);
    let lost_ns = outage["lost_ns"].as_i64().unwrap();
    assert!((began.as_i64().unwrap()..=told_at.as_i64().unwrap()).contains(&lost_ns), "{outage}");
    let state = run.until("it is over", |state| state["link"]["up"] == true);
    assert_eq!(state["link"]["last_outage"], outage);
    assert_eq!(state["figures"]["disconnections"], 1);
    assert_eq!(state["figures"]["disconnected_s"], outage["for_s"]);
    let (_, metrics) = run.get("/metrics");
    let metrics = metrics.as_str().unwrap();
    let counted = metrics.lines().find_map(|line| line.strip_prefix("shsa_disconnected_seconds_total "));
    assert!((counted.unwrap().parse::<f64>().unwrap() - seconds).abs() < 0.001, "{metrics}");
    assert!(metrics.contains("shsa_disconnections_total 1"), "{metrics}");
}

/// A connection that is cut and restored at once, between two checks.
#[test]
fn the_shortest_outage_is_reported() {
    let broker = Broker::start(&[]);
    let (folder, cut) = (Folder::new(), Cut::before(broker.port()));
    let run = run(&folder, cut.port);
    run.until("it is connected", |state| state["link"]["up"] == true);
    for number in 1..=3_u64 {
        cut.cut();
        run.decision("disconnected");
        run.decision("connected");
        let state = run.until("it is counted", |state| state["link"]["last_outage"]["number"] == number);
        assert!(state["link"]["last_outage"]["for_s"].as_f64().unwrap() < 60.0);
        assert_eq!(state["figures"]["disconnections"], number);
    }
}

/// The broker takes the claims of an instance and refuses its values: it says so, gives up its claim, and another instance serves.
#[test]
fn a_need_that_the_broker_refuses_is_bad_and_another_instance_serves_it() {
    let Some(python) = real::python() else { return };
    let rights = "topic readwrite #\nuser barred\ntopic read #\ntopic readwrite shsa/#\n";
    let lines = ["acl_file FOLDER/rights"];
    let broker = Broker::start_with(&lines, |folder| std::fs::write(folder.join("rights"), rights).unwrap());
    let folder = Folder::new();
    let model = folder.path("tank.yaml");
    std::fs::write(&model, MODEL).unwrap();
    let address = format!("mqtt://127.0.0.1:{}", broker.port());
    let options = json!({ "name": "reader", "port": broker.port() });
    let mut client = Script::start(&python, "../../../shsa-bridge/tests/python/mqtt_client.py", &options);
    client.order(&json!({ "subscribe": "tank/level" }));
    let reading = json!({ "publish": "tank/gauge", "text": "1.5" });

    let user = ["env", "SHSA_MQTT_USER=barred", "SHSA_MQTT_PASSWORD=any"];
    let of = |name: &'static str| [model.to_str().unwrap(), "--bus", &address, "--name", name];
    let barred = Running::start_under(&user, of("barred"));
    // A run that is connected need not have subscribed yet.
    barred.until("it has been refused", |state| {
        client.order(&reading);
        thread::sleep(Duration::from_millis(100));
        !state["undelivered"]["tank/level"].is_null()
    });
    let undelivered = barred.decision("undelivered");
    assert!(undelivered["because"].as_str().unwrap().contains("NotAuthorized"), "{undelivered}");
    let state = barred.until("it is bad", |state| {
        state["models"]["tank"]["needs"]["level"]["quality"] == "Bad"
            && state["undelivered"]["tank/level"]["refused"]["count"].as_u64() >= Some(1)
    });
    assert_eq!(barred.get("/health").0, 503, "{state}");

    let allowed = Running::start(of("allowed"));
    allowed.until("it has published", |state| {
        client.order(&reading);
        thread::sleep(Duration::from_millis(100));
        state["models"]["tank"]["needs"]["level"]["quality"] == "Good"
    });
    let message = client.next_with("topic");
    assert_eq!(message["topic"], "tank/level", "{message}");
    allowed.until("it is good", |state| state["models"]["tank"]["needs"]["level"]["quality"] == "Good");
    assert_eq!(allowed.get("/health").0, 200);
}
