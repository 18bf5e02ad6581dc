//! `shsa run --home-assistant`: what a broker has for Home Assistant, by the topics and fields that its documentation names.

use crate::broker::Broker;
use crate::real::{self, Script};
use crate::running::{Folder, Running, TOKEN};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

const MODEL: &str = "
shsa: 1
variables:
  room: { unit: degC, range: [-40, 60], max_rate: 1 K/s }
  doors: {}
signals:
  left: { variable: room, source: home/left, rate: 10 Hz, value_error: 0.5, timeout: 1 min }
  right: { variable: room, source: home/right, rate: 10 Hz, value_error: 0.5, timeout: 1 min }
  attic: { variable: room, source: home/attic, rate: 10 Hz, value_error: 0.5, timeout: 1 min }
  door: { variable: doors, source: home/door, timeout: none }
needs: { room: { signal: healed/room, max_age: 1 min }, doors: { signal: healed/doors, max_age: 1 min } }
";

/// A model in which the door is neither a signal nor needed.
fn without_door() -> String {
    let kept = MODEL.lines().filter(|line| !line.contains("source: home/door"));
    let kept: Vec<&str> = kept.filter(|line| !line.contains("doors: {}")).collect();
    kept.join("\n").replace(", doors: { signal: healed/doors, max_age: 1 min }", "")
}

/// A client in the place of Home Assistant and of the thermometers.
struct Home {
    client: Script,
    /// The newest message of each topic, and whether it was kept for later subscribers.
    heard: BTreeMap<String, (String, bool)>,
    /// What the left thermometer adds.
    bias: f64,
}

impl Home {
    fn new(python: &Path, broker: &Broker) -> Home {
        let options = json!({ "name": "home", "port": broker.port() });
        let mut client = Script::start(python, "../../../shsa-bridge/tests/python/mqtt_client.py", &options);
        client.order(&json!({ "subscribe": "homeassistant/#" }));
        client.order(&json!({ "subscribe": "shsa/#" }));
        Home { client, heard: BTreeMap::new(), bias: 0.0 }
    }

    fn publish(&mut self, topic: &str, text: &str) {
        self.client.order(&json!({ "publish": topic, "text": text }));
    }

    /// Measures, and listens, until what was heard meets a condition.
    #[track_caller]
    fn until(&mut self, what: &str, is_so: impl Fn(&Home) -> bool) {
        let end = Instant::now() + real::PATIENCE;
        while !is_so(self) {
            assert!(Instant::now() < end, "not so: {what}: {:#?}", self.heard);
            for (place, value) in
                [("left", 20.0 + self.bias), ("right", 20.1), ("attic", 20.0), ("door", 1.0)]
            {
                self.publish(&format!("home/{place}"), &value.to_string());
            }
            while let Some(message) = self.client.poll("topic", Duration::from_millis(100)) {
                let hex = message["hex"].as_str().unwrap();
                let byte = |at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
                let bytes: Vec<u8> = (0..hex.len()).step_by(2).map(byte).collect();
                let text = String::from_utf8(bytes).unwrap();
                let retained = message["retain"] == true;
                self.heard.insert(message["topic"].as_str().unwrap().to_owned(), (text, retained));
            }
        }
    }

    fn text(&self, topic: &str) -> &str {
        self.heard.get(topic).map_or("", |(text, _)| text)
    }

    fn json(&self, topic: &str) -> Value {
        serde_json::from_str(self.text(topic)).unwrap_or_default()
    }
}

const ROOM: &str = "homeassistant/sensor/cellar-2d1/house_need_room/config";
const LEFT: &str = "homeassistant/binary_sensor/cellar-2d1/house_signal_left/config";
const DOORS: &str = "homeassistant/sensor/cellar-2d1/house_need_doors/config";
const DOOR: &str = "homeassistant/binary_sensor/cellar-2d1/house_signal_door/config";
const ROOM_STATE: &str = "shsa/cellar-1/homeassistant/house_need_room";
const LEFT_STATE: &str = "shsa/cellar-1/homeassistant/house_signal_left";

fn start(folder: &Folder, broker: &Broker, more: &[&str]) -> Running {
    let model = folder.path("house.yaml");
    std::fs::write(&model, MODEL).unwrap();
    let bus = format!("mqtt://127.0.0.1:{}", broker.port());
    Running::start([model.to_str().unwrap(), "--bus", &bus].iter().chain(more).copied())
}

/// A configuration: what all entities have, and the own fields of one.
fn entity(state: &str, own: Value) -> Value {
    let mut all = json!({
        "state_topic": state,
        "json_attributes_topic": state,
        "json_attributes_template": "{{ value_json.attributes | tojson }}",
        "availability": [
            { "topic": "shsa/cellar-1/status" },
            { "topic": state, "value_template": "{{ value_json.availability }}" },
        ],
        "availability_mode": "all",
        "payload_available": "online",
        "payload_not_available": "offline",
        "device": {
            "identifiers": ["shsa_cellar-2d1"],
            "name": "cellar-1",
            "manufacturer": "shsa",
            "sw_version": env!("CARGO_PKG_VERSION"),
        },
        "origin": { "name": "shsa", "sw_version": env!("CARGO_PKG_VERSION") },
    });
    let Value::Object(own) = own else { panic!("an object: {own}") };
    all.as_object_mut().unwrap().extend(own);
    all
}

#[test]
fn needs_are_sensors_and_verdicts_are_binary_sensors() {
    let Some(python) = real::python() else { return };
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let mut home = Home::new(&python, &broker);
    let run = start(&folder, &broker, &["--name", "cellar-1", "--home-assistant"]);
    home.until("the room is served", |home| home.json(ROOM_STATE)["value"].is_f64());

    let room = json!({
        "name": "room",
        "unique_id": "shsa_cellar-2d1_house_need_room",
        "default_entity_id": "sensor.cellar_1_room",
        "value_template": "{{ value_json.value }}",
        "unit_of_measurement": "°C",
        "device_class": "temperature",
        "state_class": "measurement",
    });
    assert_eq!(home.json(ROOM), entity(ROOM_STATE, room));
    let left = json!({
        "name": "left",
        "unique_id": "shsa_cellar-2d1_house_signal_left",
        "default_entity_id": "binary_sensor.cellar_1_left",
        "value_template": "{{ value_json.problem }}",
        "device_class": "problem",
        "entity_category": "diagnostic",
        "payload_on": "ON",
        "payload_off": "OFF",
    });
    assert_eq!(home.json(LEFT), entity(LEFT_STATE, left));
    assert_eq!(home.text("shsa/cellar-1/status"), "online");

    home.until("left is trusted", |home| home.json(LEFT_STATE)["problem"] == "OFF");
    home.bias = 12.0;
    home.until("left is named", |home| home.json(LEFT_STATE)["attributes"]["verdict"] == "failed");
    let state = home.json(LEFT_STATE);
    assert_eq!((&state["problem"], &state["availability"]), (&json!("ON"), &json!("online")));
    assert_eq!(state["attributes"]["decision"], "failed", "{state}");
    assert!(!state["attributes"]["reason"].as_str().unwrap().is_empty(), "{state}");
    home.until("the room has another source", |home| {
        home.json(ROOM_STATE)["attributes"]["decision"] == "substituted"
    });
    let state = home.json(ROOM_STATE);
    let attributes = &state["attributes"];
    let (lowest, highest) = (attributes["lowest"].as_f64().unwrap(), attributes["highest"].as_f64().unwrap());
    let value = state["value"].as_f64().unwrap();
    assert!(lowest <= value && value <= highest && (value - 20.0).abs() < 1.0, "{state}");
    assert_ne!(attributes["source"], "left", "{state}");
    assert_eq!(state["availability"], "online", "{state}");
    run.stop();
    home.until("the will is there", |home| home.text("shsa/cellar-1/status") == "offline");
}

#[test]
fn entities_follow_the_model_and_come_again_when_home_assistant_starts() {
    let Some(python) = real::python() else { return };
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let mut home = Home::new(&python, &broker);
    let run = start(&folder, &broker, &["--name", "cellar-1", "--home-assistant"]);
    home.until("the door is announced", |home| [DOOR, DOORS].iter().all(|it| home.json(it).is_object()));

    home.heard.clear();
    home.publish("homeassistant/status", "offline");
    home.publish("homeassistant/status", "online");
    home.until("everything comes again", |home| {
        [ROOM, LEFT, DOORS, DOOR, ROOM_STATE, LEFT_STATE].iter().all(|it| home.json(it).is_object())
    });

    // A client that comes later gets what the broker has kept.
    home = Home::new(&python, &broker);
    home.until("it is kept", |home| home.heard.get(DOOR).is_some_and(|(_, retained)| *retained));
    std::fs::write(folder.path("house.yaml"), without_door()).unwrap();
    let (status, answer) = run.order(Some(TOKEN), r#"{"order": "reload", "force": true}"#);
    assert_eq!(status, 200, "{answer}");
    let states = [DOOR, DOORS].map(|topic| {
        let id = topic.split('/').nth(3).unwrap();
        format!("shsa/cellar-1/homeassistant/{id}")
    });
    home.until("the door is removed", |home| {
        let mut gone = [DOOR, DOORS].into_iter().chain(states.iter().map(String::as_str));
        gone.all(|it| home.heard.get(it).is_some_and(|(text, _)| text.is_empty()))
    });
    home = Home::new(&python, &broker);
    home.until("the room is there", |home| home.json(ROOM).is_object());
    let left: Vec<&String> = home.heard.keys().filter(|topic| topic.contains("_door")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn nothing_is_announced_unasked_or_without_a_broker() {
    let Some(python) = real::python() else { return };
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let mut home = Home::new(&python, &broker);
    let run = start(&folder, &broker, &["--name", "quiet"]);
    home.until("the room is served", |home| home.json("shsa/quiet/need/room")["quality"] == "Good");
    assert!(!home.heard.keys().any(|topic| topic.contains("homeassistant")), "{:?}", home.heard);
    drop(run);
    let output = Running::ended(["--home-assistant"]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && error.contains("use --bus mqtt://HOST:PORT"), "{error}");
}
