//! An instance is started beside one that serves, over MQTT and over Zenoh; then the serving one is killed, then the last one
//! ended. And one is started while only the sensor that lies is left.

use crate::broker::Broker;
use crate::plant::{Plant, Seen};
use crate::real::{self, Script, free_port};
use crate::row::beside_others;
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, model, router, settle, verdict};
use serde_json::json;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// The greatest age of a published value, seconds: the need's `max_age`.
const MAX_AGE: f64 = 0.3;

/// The consumer's values from a time on.
fn since(plant: &mut Plant, from: f64) -> Vec<Seen> {
    plant.seen().iter().filter(|seen| seen.at > from).cloned().collect()
}

/// The wall clock, seconds.
fn wall_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs_f64()
}

/// The longest time between two stamps; unlike times of reception, stamps do not depend on how busy the machine is.
fn longest_hole(seen: &[Seen]) -> f64 {
    let mut stamps: Vec<f64> = seen.iter().map(|seen| seen.stamp_s).collect();
    stamps.sort_by(f64::total_cmp);
    stamps.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
}

/// `first` serves a substitute for a faulty wheel. `second`, whose name has the higher rank, is started, takes over and is
/// killed.
fn a_newcomer(python: &Path, bus: &str, port: u16) -> (Running, Plant) {
    let folder = Folder::new();
    let (model, address) = (model(&folder), format!("{bus}://127.0.0.1:{port}"));
    let start = |name: &str| Running::start([&*model, "--bus", &address, "--name", name]);
    let first = start("first");
    let mut plant = Plant::start(python, bus, port, &WHEELS);
    settle(&first, &mut plant);
    first.until("it has served for its probation", |state| {
        state["models"]["chaos"]["needs"]["speed"]["published"].as_u64() > Some(300)
    });
    let broken = plant.fault("wheel_1", "bias", 3.0);
    assert_eq!(first.decision("failed")["signal"], "wheel_1");
    let substitute = plant.first(broken, "a substitute", Seen::is_substitute);

    // A newcomer without evidence would take the faulty wheel first.
    let started = plant.now();
    let second = start("second");
    let taken = second.decision("responsible");
    assert_eq!(taken["because"], "chaos/speed is served by this instance from now on");
    let (_, state) = second.get("/state");
    assert_eq!(verdict(&state, "wheel_1"), "failed", "it took the need before it knew who lies: {state}");
    assert!(first.decision("released")["because"].as_str().unwrap().contains(" is served by second."));
    let released = wall_s();
    let other = plant.first(started, "the newcomer's", |seen| seen.publisher != substitute.publisher);
    plant.first(other.at + 0.5, "more of it", |_| true);
    let seen = since(&mut plant, substitute.at);
    assert!(seen.iter().all(|seen| seen.is_substitute() && seen.error() < 1.5), "{seen:?}");
    // Both serve until the first one has heard of the second; how long that takes depends on how busy the machine is.
    let late = |seen: &&Seen| seen.publisher == substitute.publisher && seen.stamp_s > released;
    assert!(seen.iter().find(late).is_none(), "{seen:?}");
    assert!(longest_hole(&seen) < MAX_AGE, "{}: {seen:?}", longest_hole(&seen));

    let killed = plant.now();
    second.kill();
    first.decision("responsible");
    let back = plant.first(killed, "the first one's", |seen| seen.publisher == substitute.publisher);
    plant.first(back.at + 0.5, "more of it", |_| true);
    let seen = since(&mut plant, other.at);
    assert!(seen.iter().all(|seen| seen.is_substitute() && seen.error() < 1.5), "{seen:?}");
    assert!(longest_hole(&seen) < MAX_AGE, "{}: {seen:?}", longest_hole(&seen));
    (first, plant)
}

/// A spare is started while only the wheel that lies is left: it knows from the other instance that the wheel lies.
fn a_spare_without_witnesses(python: &Path, bus: &str, port: u16) {
    let folder = Folder::new();
    let (model, address) = (model(&folder), format!("{bus}://127.0.0.1:{port}"));
    let start = |name: &str| Running::start([&*model, "--bus", &address, "--name", name]);
    let first = start("first");
    let mut plant = Plant::start(python, bus, port, &WHEELS);
    settle(&first, &mut plant);
    plant.fault("wheel_1", "bias", 6.0);
    assert_eq!(first.decision("failed")["signal"], "wheel_1");
    for witness in &WHEELS[1..] {
        plant.fault(witness, "stop", 0.0);
        first.decision("silent");
    }

    let started = plant.now();
    let second = start("second");
    let accused = second.decision("accused");
    assert_eq!(accused["because"], "wheel_1 is failed by the evidence of first; there is none here yet");
    second.until("it hears the wheel", |state| {
        state["models"]["chaos"]["signals"]["wheel_1"]["accepted"].as_u64() > Some(100)
    });
    assert_eq!(verdict(&second.get("/state").1, "wheel_1"), "failed");
    let trusted = |seen: &Seen| seen.is_good() || seen.is_substitute();
    let wrong: Vec<Seen> = since(&mut plant, started).into_iter().filter(trusted).collect();
    assert!(wrong.is_empty(), "{wrong:?}");

    // The accusation ends by evidence, as one of its own does.
    let repaired = WHEELS.map(|wheel| plant.fault(wheel, "none", 0.0))[2];
    plant.first(repaired, "a right value", |seen| trusted(seen) && seen.error() < 1.5);
    second.until("the wheel is trusted again", |state| verdict(state, "wheel_1") == "healthy");
    first.stop();
    second.stop();
}

#[test]
fn a_spare_knows_who_lies_without_witnesses_over_zenoh() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let port = free_port();
    let _router = router(&python, &json!({ "listen/endpoints": [format!("tcp/127.0.0.1:{port}")] }));
    a_spare_without_witnesses(&python, "zenoh", port);
}

#[test]
fn a_spare_knows_who_lies_without_witnesses_over_mqtt() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let broker = Broker::start(&[]);
    a_spare_without_witnesses(&python, "mqtt", broker.port());
}

#[test]
fn a_newcomer_takes_a_need_when_it_knows_who_lies_over_zenoh() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let port = free_port();
    let _router = router(&python, &json!({ "listen/endpoints": [format!("tcp/127.0.0.1:{port}")] }));
    a_newcomer(&python, "zenoh", port).0.stop();
}

#[test]
fn a_newcomer_takes_a_need_when_it_knows_who_lies_over_mqtt() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let broker = Broker::start(&[]);
    let (last, _plant) = a_newcomer(&python, "mqtt", broker.port());
    // An instance that ends in order ends its claims.
    let visitor = json!({ "name": "visitor", "port": broker.port() });
    let mut visitor = Script::start(&python, "../../../shsa-bridge/tests/python/mqtt_client.py", &visitor);
    visitor.order(&json!({ "subscribe": "shsa/first/claims" }));
    let claims = visitor.next_with("topic");
    let text = |claims: &serde_json::Value| -> String {
        let hex = claims["hex"].as_str().unwrap();
        let bytes = (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap());
        String::from_utf8(bytes.collect()).unwrap()
    };
    let output = text(&claims);
    assert!(output.lines().any(|line| line.starts_with("shsa/healer/first.")), "{output}");
    assert!(output.lines().any(|line| line.starts_with("shsa/settled/first.")), "{output}");
    last.stop();
    while !text(&visitor.next_with("topic")).is_empty() {}
}
