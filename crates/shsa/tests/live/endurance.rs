//! After an instance is killed, another instance serves the need, and the restarted instance keeps its state.

use crate::broker::Broker;
use crate::car::{Drive, MODEL, router};
use crate::real;
use crate::running::{Folder, Running};
use serde_json::{Value, json};
use std::thread;
use std::time::Duration;

/// Time of the drive, in seconds: more than a test takes, which ends it.
const LONG: f64 = 40.0;

/// The instances that can serve the speed, the serving one first.
fn instances(state: &Value) -> Vec<String> {
    let able = state["instances"]["/car/speed"].as_array().into_iter().flatten();
    able.map(|instance| instance.as_str().unwrap().split('.').next().unwrap().to_owned()).collect()
}

#[test]
fn another_instance_takes_over_and_gives_back() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    let address = format!("zenoh://127.0.0.1:{port}");
    let start = |name: &str| Running::start([MODEL, "--bus", &address, "--name", name]);
    let mut runs: Vec<(&str, Running)> = ["a", "b"].map(|name| (name, start(name))).into();
    let Some(drive) = Drive::begin("zenoh", port, LONG, &Value::Null) else { return };

    let state = runs[0].1.until("both can serve", |state| instances(state).len() == 2);
    let first = instances(&state)[0].clone();
    let at = runs.iter().position(|(name, _)| *name == first).unwrap();
    let (name, run) = runs.remove(at);
    run.decision("responsible");
    thread::sleep(Duration::from_secs(3));
    run.kill();
    let (_, other) = &runs[0];
    other.decision("responsible");
    let taken_over = drive.now();
    thread::sleep(Duration::from_secs(2));
    let again = start(name);
    again.decision("responsible");
    let released = other.decision("released");
    assert!(released["because"].as_str().unwrap().contains(name), "{released}");

    let given_back = drive.now();
    thread::sleep(Duration::from_secs(2));

    let seen = drive.end();
    let of_the_other = seen.since(taken_over).filter(|value| value.0 < given_back);
    let again = seen.since(given_back);
    // The need's sources have 10 values a second and more.
    assert!(of_the_other.count() > 10 && again.count() > 10, "{taken_over} {given_back}: {:?}", seen.values);
}

#[test]
fn what_was_known_before_a_crash_is_known_after_it() {
    let broker = Broker::start(&[]);
    let (folder, port) = (Folder::new(), broker.port());
    let address = format!("mqtt://127.0.0.1:{port}");
    let state = folder.path("state");
    let start = || Running::start([MODEL, "--bus", &address, "--state", state.to_str().unwrap()]);
    let run = start();
    let fault =
        json!({ "topic": "wheel_speed", "column": "wheel_1", "kind": "bias", "amount": 3.0, "at": 4.0 });
    let Some(drive) = Drive::begin("mqtt", port, LONG, &fault) else { return };

    assert_eq!(run.decision("failed")["signal"], "wheel_1");
    run.decision("substituted");
    run.kill();
    let run = start();
    let (_, state) = run.get("/state");
    assert_eq!(state["models"]["car"]["signals"]["wheel_1"]["verdict"], "failed", "{state}");
    let back = drive.now();
    thread::sleep(Duration::from_secs(4));
    let seen = drive.end();

    let (_, events) = run.get("/events");
    // No signal is judged anew; the need may lack a value for a moment, until the first message.
    let is_of_signal = |event: &&Value| event["signal"].is_string();
    let mut of_signals = events.as_array().unwrap().iter().filter(is_of_signal);
    assert!(of_signals.all(|event| event["kind"] != "failed" && event["kind"] != "restored"), "{events}");
    let mut after = seen.since(back);
    // The slowest source that may serve it has 10 values a second.
    assert!(after.clone().count() > 10, "{}", after.count());
    assert!(after.all(|value| value.2 == "UncertainSubstituteValue"));
}
