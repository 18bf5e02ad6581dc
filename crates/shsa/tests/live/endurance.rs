//! After an instance is killed, another instance serves the need, and the restarted instance keeps its state.

use crate::broker::Broker;
use crate::car::{MODEL, recording, router, seen};
use crate::real;
use crate::running::{Folder, Running};
use serde_json::{Value, json};
use std::thread;
use std::time::Duration;

/// The instances that can serve the speed, the serving one first.
fn instances(state: &Value) -> Vec<String> {
    let able = state["instances"]["/car/speed"].as_array().into_iter().flatten();
    able.map(|instance| instance.as_str().unwrap().split('.').next().unwrap().to_owned()).collect()
}

#[test]
fn another_instance_takes_over_and_gives_back() {
    let (Some(python), Some(data)) = (real::python(), recording()) else { return };
    let (_router, port) = router(&python);
    let address = format!("zenoh://127.0.0.1:{port}");
    let start = |name: &str| Running::start([MODEL, "--bus", &address, "--name", name]);
    let mut runs: Vec<(&str, Running)> = ["a", "b"].map(|name| (name, start(name))).into();
    let consumer = thread::spawn(move || seen(&python, &data, "zenoh", port, &Value::Null));

    let state = runs[0].1.until("both can serve", |state| instances(state).len() == 2);
    let first = instances(&state)[0].clone();
    let at = runs.iter().position(|(name, _)| *name == first).unwrap();
    let (name, run) = runs.remove(at);
    run.decision("responsible");
    thread::sleep(Duration::from_secs(3));
    run.kill();
    let (_, other) = &runs[0];
    other.decision("responsible");
    thread::sleep(Duration::from_secs(2));
    let again = start(name);
    again.decision("responsible");
    let released = other.decision("released");
    assert!(released["because"].as_str().unwrap().contains(name), "{released}");

    let seen = consumer.join().unwrap();
    let last = seen.values.last().unwrap().0;
    assert!(last > 11.0, "{last}");
    assert!(seen.values.iter().filter(|value| value.0 > 9.0).count() > 50, "{:?}", seen.longest_pause(3.0));
}

#[test]
fn what_was_known_before_a_crash_is_known_after_it() {
    let (Some(python), Some(data)) = (real::python(), recording()) else { return };
    let broker = Broker::start(&[]);
    let (folder, port) = (Folder::new(), broker.port());
    let address = format!("mqtt://127.0.0.1:{port}");
    let state = folder.path("state");
    let start = || Running::start([MODEL, "--bus", &address, "--state", state.to_str().unwrap()]);
    let run = start();
    let fault =
        json!({ "topic": "wheel_speed", "column": "wheel_1", "kind": "bias", "amount": 3.0, "at": 4.0 });
    let consumer = thread::spawn(move || seen(&python, &data, "mqtt", port, &fault));

    assert_eq!(run.decision("failed")["signal"], "wheel_1");
    run.decision("substituted");
    run.kill();
    let run = start();
    let (_, state) = run.get("/state");
    assert_eq!(state["models"]["car"]["signals"]["wheel_1"]["verdict"], "failed", "{state}");
    let seen = consumer.join().unwrap();

    let (_, events) = run.get("/events");
    // No signal is judged anew; the need may lack a value for a moment, until the first message.
    let is_of_signal = |event: &&Value| event["signal"].is_string();
    let mut of_signals = events.as_array().unwrap().iter().filter(is_of_signal);
    assert!(of_signals.all(|event| event["kind"] != "failed" && event["kind"] != "restored"), "{events}");
    let after = seen.values.iter().filter(|value| value.0 > 8.0);
    // The slowest source that may serve it has 10 values a second.
    assert!(after.clone().count() > 30, "{}", after.count());
    assert!(after.clone().all(|value| value.2 == "UncertainSubstituteValue"));
}
