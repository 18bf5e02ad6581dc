//! The integrity level goes out beside the quality of every value, and on the status of the need.

use crate::broker::Broker;
use crate::car::{client_of, router};
use crate::real::{self, Script};
use crate::running::{Folder, Running};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// A lidar that is worth SIL 2 while it is cool, and SIL 1 else.
const MODEL: &str = "
shsa: 1
variables: { near: { unit: m, range: [0, 30] }, heat: {} }
signals:
  lidar: { variable: near, source: robot/lidar, rate: 20 Hz, value_error: 0.1 }
  heat: { variable: heat, source: robot/heat, rate: 20 Hz, value_error: 0.5 }
needs:
  near: { signal: stop/near, max_age: 2 s }
contracts:
  lidar:
    evidence: { cool: value of heat at most 60 no older than 2 s, bearable: value of heat at most 100 no older than 2 s }
    gives:
      best: { error: at most 0.2 m, level: SIL 2, when: cool }
      hot: { error: at most 0.2 m, level: SIL 1, when: bearable }
  near:
    asks: { near: { of: near, error: at most 0.2 m, level: SIL 2 } }
    policy: degrade
";

fn text(hex: &Value) -> String {
    let hex = hex.as_str().unwrap();
    let byte = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
    String::from_utf8((0..hex.len()).step_by(2).map(byte).collect()).unwrap()
}

/// The level that a consumer receives: on the value's message within and beside it, and on the status.
#[derive(Debug, PartialEq)]
struct Heard {
    is_status: bool,
    within: Value,
    beside: Value,
}

fn level(object: &Value) -> Value {
    json!([object["admitted"], object["level"], object["rank"]])
}

fn received(message: &Value) -> Heard {
    let name = message.get("topic").or(message.get("key")).and_then(Value::as_str).unwrap();
    let payload: Value = serde_json::from_str(&text(&message["hex"])).unwrap();
    let beside = match message.get("properties") {
        Some(properties) => properties.clone(),
        None if message["attachment"].is_string() => {
            serde_json::from_str(&text(&message["attachment"])).unwrap()
        }
        None => Value::Null,
    };
    Heard { is_status: name.starts_with("shsa/"), within: level(&payload), beside: level(&beside) }
}

#[track_caller]
fn wait_for(consumer: &mut Script, what: &str, is_it: impl Fn(&Heard) -> bool) {
    let end = Instant::now() + real::PATIENCE;
    let mut last = None;
    while Instant::now() < end {
        let Some(message) = consumer.poll("hex", Duration::from_secs(5)) else { continue };
        let received = received(&message);
        if is_it(&received) {
            return;
        }
        last = Some(received);
    }
    panic!("never came: {what}; last {last:?}");
}

/// The rank is a number in JSON, and a word in a user property.
#[track_caller]
fn wait_for_level(consumer: &mut Script, admitted: &str, level: &str, rank: u32) {
    let within = json!([admitted, level, rank]);
    let in_words = json!([admitted, level, rank.to_string()]);
    let is_value =
        |it: &Heard| !it.is_status && it.within == within && (it.beside == within || it.beside == in_words);
    wait_for(consumer, &format!("a value that is {within}"), is_value);
    wait_for(consumer, &format!("a status that is {within}"), |it| it.is_status && it.within == within);
}

#[track_caller]
fn check(python: &Path, bus: &str, port: u16, mut consumer: Script) {
    let sensor = |name: &str| {
        let topic = format!("robot/{name}");
        let order = json!({ "bus": bus, "port": port, "name": name, "topic": topic, "text": "VALUE", "period": 0.05 });
        Script::start(python, "sensor.py", &order)
    };
    let (_lidar, mut heat) = (sensor("lidar"), sensor("heat"));
    let folder = Folder::new();
    let path = folder.path("model.yaml");
    fs::write(&path, MODEL).unwrap();
    let address = format!("{bus}://127.0.0.1:{port}");
    let run =
        Running::start([path.to_str().unwrap(), "--bus", &address, "--name", "robot", "--form", "json"]);
    consumer.order(&json!({ "subscribe": "stop/near" }));
    consumer.order(&json!({ "subscribe": "shsa/robot/need/near" }));
    wait_for_level(&mut consumer, "met", "SIL 2", 2);
    heat.order(&json!({ "value": 80.0 }));
    wait_for_level(&mut consumer, "degraded", "SIL 1", 1);
    let (_, state) = run.get("/state");
    assert_eq!(level(&state["models"]["model"]["needs"]["near"]), json!(["degraded", "SIL 1", 1]), "{state}");
    heat.order(&json!({ "value": 20.0 }));
    wait_for_level(&mut consumer, "met", "SIL 2", 2);
}

#[test]
fn the_level_goes_out_over_mqtt() {
    let Some(python) = real::python() else { return };
    let broker = Broker::start(&[]);
    let argument = json!({ "port": broker.port(), "name": "consumer" });
    let consumer = Script::start(&python, "../../../shsa-bridge/tests/python/mqtt_client.py", &argument);
    check(&python, "mqtt", broker.port(), consumer);
}

#[test]
fn the_level_goes_out_over_zenoh() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    let consumer =
        Script::start(&python, "../../../shsa-bridge/tests/python/zenoh_client.py", &client_of(port));
    check(&python, "zenoh", port, consumer);
}
