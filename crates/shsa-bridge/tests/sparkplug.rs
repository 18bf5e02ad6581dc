//! Sparkplug B with Mosquitto, among edge nodes and a consumer in Python that encode and decode payloads by themselves.
//!
//! The rules are those of Eclipse Sparkplug 3.0.0 that its test suite checks (`tck-id-..`); the table of them is in
//! `docs/sparkplug.md`.

#[allow(dead_code, reason = "the tests of MQTT use all of it")]
mod broker;
mod real;
#[path = "sparkplug/edge.rs"]
mod edge;
#[path = "sparkplug/host.rs"]
mod host;
#[path = "sparkplug/inputs.rs"]
mod inputs;

use broker::{Broker, Cut};
use real::{Script, eventually, python};
use serde_json::{Value, json};
use shsa_bridge::mqtt::sparkplug::{Options, SparkplugBridge};
use shsa_bridge::{Bridge, Clock, Inbox, Link};
use std::time::Duration;

/// A broker, a consumer of everything that is sent by Sparkplug, and a bridge whose connections can be cut.
struct Plant {
    // Dropped in this order.
    bridge: Option<SparkplugBridge>,
    peer: Script,
    broker: Broker,
    /// Between the bridge and the broker, where its connections are to break.
    cut: Option<Cut>,
    settings: String,
}

impl Plant {
    /// `None`: there is no Python.
    fn new(settings: &str) -> Option<Plant> {
        let python = python()?;
        let broker = Broker::start(&[]);
        let mut peer = Script::start(&python, "sparkplug.py", &json!({ "port": broker.port() }));
        peer.order(&json!({ "follow": "spBv1.0/#" }));
        let settings = settings.to_owned();
        Some(Plant { bridge: None, peer, broker, cut: None, settings })
    }

    /// As [`Plant::new`], with connections that can be cut.
    fn frail(settings: &str) -> Option<Plant> {
        let plant = Plant::new(settings)?;
        let cut = Some(Cut::before(plant.broker.port()));
        Some(Plant { cut, ..plant })
    }

    /// Breaks the bridge's connections.
    fn cut(&self) {
        self.cut.as_ref().unwrap().cut();
    }

    fn options(&self) -> Options {
        let port = self.cut.as_ref().map_or_else(|| self.broker.port(), |cut| cut.port);
        let address = format!("sparkplug://127.0.0.1:{port}/Plant/healer?{}", self.settings);
        Options::parse(&address, "shsa").unwrap()
    }

    /// Opens the bridge.
    fn open(&mut self) -> &mut SparkplugBridge {
        let inbox = Inbox::new(1000, Clock::running());
        let bridge = self.bridge.insert(SparkplugBridge::open(&self.options(), inbox).unwrap());
        eventually("the connection", || (bridge.link() == Link::Up).then_some(()));
        bridge
    }

    fn bridge(&mut self) -> &mut SparkplugBridge {
        self.bridge.as_mut().unwrap()
    }

    /// The next message that the consumer sees on this topic.
    #[track_caller]
    fn seen(&mut self, topic: &str) -> Value {
        loop {
            let message = self.peer.next_with("topic");
            if message["topic"] == topic {
                return message;
            }
        }
    }

    /// Whether the consumer sees a message on this topic within a time that suffices for one.
    fn sees(&mut self, topic: &str) -> bool {
        let patience = Duration::from_millis(300);
        std::iter::from_fn(|| self.peer.poll("topic", patience)).any(|message| message["topic"] == topic)
    }

    /// The next command that an edge node gets.
    #[track_caller]
    fn command(&mut self) -> Value {
        self.peer.next_with("command")
    }

    fn order(&mut self, order: &Value) {
        self.peer.order(order);
    }
}

/// The metric of this name in a message.
#[track_caller]
fn metric<'m>(message: &'m Value, name: &str) -> &'m Value {
    let metrics = message["payload"]["metrics"].as_array().unwrap();
    metrics.iter().find(|metric| metric["name"] == name).unwrap_or_else(|| panic!("{name} in {message}"))
}
