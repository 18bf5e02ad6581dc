//! A recorded drive, played in real time by a Python client over a real bus; a sensor breaks, and the consumer of the speed
//! goes on. Neither knows of `shsa`.

use crate::broker::Broker;
use crate::real::{self, Script, free_port};
use crate::running::Running;
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Of the recording, seconds: the car speeds up.
const SKIP: f64 = 20.0;
const SECONDS: f64 = 12.0;
/// When the sensor breaks.
const BREAKS: f64 = 6.0;
const NEED: &str = "/car/speed";

pub(crate) const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/car.yaml");

/// What a consumer saw.
pub(crate) struct Seen {
    /// When, the value, and how far it can be trusted.
    pub(crate) values: Vec<(f64, f64, String)>,
    pub(crate) statuses: Vec<(f64, Value)>,
}

pub(crate) fn recording() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/comma2k19");
    if folder.exists() {
        return Some(folder);
    }
    let _ = writeln!(std::io::stderr(), "SKIPPED: {} is absent", folder.display());
    None
}

/// Plays the recording with this fault over a bus, and listens.
pub(crate) fn seen(python: &Path, data: &Path, bus: &str, port: u16, fault: &Value) -> Seen {
    let order = json!({
        "bus": bus, "port": port, "data": data, "skip": SKIP, "seconds": SECONDS, "need": NEED, "fault": fault,
    });
    let answer = Script::start_and_keep(python, "car.py", &order);
    let number = |value: &Value| value.as_f64().unwrap();
    let value = |it: &Value| (number(&it[0]), number(&it[1]), it[2].as_str().unwrap_or_default().to_owned());
    Seen {
        values: answer["values"].as_array().unwrap().iter().map(value).collect(),
        statuses: answer["statuses"]
            .as_array()
            .unwrap()
            .iter()
            .map(|it| (number(&it[0]), it[1].clone()))
            .collect(),
    }
}

impl Seen {
    /// The longest time between two values from a moment on, until the recording ends.
    pub(crate) fn longest_gap(&self, from: f64) -> f64 {
        let times: Vec<f64> = self.values.iter().map(|value| value.0).filter(|at| *at >= from).collect();
        times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
    }

    /// The largest step from one value to the next, from a moment on.
    fn largest_step(&self, from: f64) -> f64 {
        let values: Vec<f64> =
            self.values.iter().filter(|value| value.0 >= from).map(|value| value.1).collect();
        values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
    }

    fn quality_at_the_end(&self) -> &str {
        &self.values.last().unwrap().2
    }
}

/// The car's model serves its speed over a bus while this fault comes up; what has to hold on every bus.
#[track_caller]
fn check(bus: &str, address: &str, port: u16, fault: &Value, kind: &str, signal: &str) {
    let (Some(python), Some(data)) = (real::python(), recording()) else { return };
    let run = Running::start([MODEL, "--bus", address]);
    let seen = seen(&python, &data, bus, port, fault);

    let decision = run.decision(kind);
    assert_eq!(decision["signal"], signal, "{decision}");
    let before = seen.values.iter().filter(|value| value.0 < BREAKS && value.0 > 2.0);
    assert!(before.clone().count() > 150, "{}", before.count());
    let (_, state) = run.get("/state");
    assert!(before.clone().all(|value| value.2 == "Good"), "{state}");
    assert_eq!(seen.quality_at_the_end(), "UncertainSubstituteValue", "{state}");
    let told = seen.statuses.iter().filter(|(at, _)| *at > BREAKS).map(|(_, status)| &status["quality"]);
    assert!(told.clone().any(|quality| quality == "UncertainSubstituteValue"), "{:?}", seen.statuses);
    // 200 ms is how old a value may be; a busy machine may add to it.
    assert!(seen.longest_gap(2.0) < 0.4, "{}", seen.longest_gap(2.0));
    // Both sources are right within their errors: 0.6 m/s each.
    assert!(seen.largest_step(2.0) < 1.2, "{}", seen.largest_step(2.0));
}

/// A router of Zenoh that is not ours, and its port.
pub(crate) fn router(python: &Path) -> (Script, u16) {
    let port = free_port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let config =
        json!({ "mode": "router", "scouting/multicast/enabled": false, "listen/endpoints": [endpoint] });
    let script = "../../../shsa-bridge/tests/python/zenoh_client.py";
    (Script::start(python, script, &config), port)
}

#[test]
fn a_wheel_that_falls_silent_is_replaced_over_mqtt() {
    let broker = Broker::start(&[]);
    let address = format!("mqtt://127.0.0.1:{}", broker.port());
    let fault = json!({ "topic": "wheel_speed", "column": "wheel_1", "kind": "stop", "at": BREAKS });
    check("mqtt", &address, broker.port(), &fault, "failed", "wheel_1");
}

#[test]
fn a_wheel_that_lies_is_replaced_over_mqtt() {
    let broker = Broker::start(&[]);
    let address = format!("mqtt://127.0.0.1:{}", broker.port());
    let fault =
        json!({ "topic": "wheel_speed", "column": "wheel_1", "kind": "bias", "amount": 3.0, "at": BREAKS });
    check("mqtt", &address, broker.port(), &fault, "failed", "wheel_1");
}

#[test]
fn a_wheel_that_lies_is_replaced_over_zenoh() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    let address = format!("zenoh://127.0.0.1:{port}");
    let fault =
        json!({ "topic": "wheel_speed", "column": "wheel_1", "kind": "bias", "amount": 3.0, "at": BREAKS });
    check("zenoh", &address, port, &fault, "failed", "wheel_1");
}
