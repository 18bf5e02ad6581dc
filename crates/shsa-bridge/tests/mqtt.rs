//! The MQTT bridge against Mosquitto, and against independent Python clients.

#[macro_use]
mod contract;
mod broker;
mod real;
#[path = "mqtt/claims.rs"]
mod claims;
#[path = "mqtt/tls.rs"]
mod tls;

use broker::{Broker, Cut};
use contract::{Asking, Middleware, until};
use real::{Script, python};
use serde_json::json;
use shsa_bridge::mqtt::{MqttBridge, Options, Presence, Version};
use shsa_bridge::{
    Admission, Bridge, BridgeError, Channel, Inbox, Link, Outgoing, Payload, Provenance, Quality,
};
use shsa_core::assurance::Ground;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// A broker, and bridges to it with one version of the protocol.
struct Mosquitto {
    broker: Broker,
    version: Version,
}

impl Mosquitto {
    fn new(version: Version) -> Mosquitto {
        Mosquitto { broker: Broker::start(&[]), version }
    }
}

impl Middleware for Mosquitto {
    fn bridge(&mut self, name: &str, inbox: Inbox) -> Box<dyn Bridge> {
        let options = Options { version: self.version, ..self.broker.options(name) };
        let bridge = MqttBridge::open(&options, inbox).unwrap();
        until("the connection", || bridge.link() == Link::Up);
        Box::new(bridge)
    }

    fn break_it(&mut self) -> bool {
        self.broker.kill();
        true
    }

    fn mend_it(&mut self) {
        self.broker.restart();
    }

    fn asking(&self) -> Asking {
        Asking::Messages
    }

    fn knows_own(&self) -> bool {
        self.version == Version::V5
    }
}

contract!(version_5, Mosquitto::new(Version::V5));
contract!(version_3, Mosquitto::new(Version::V311));

const VERSIONS: [Version; 2] = [Version::V5, Version::V311];

fn open(options: &Options) -> MqttBridge {
    let bridge = MqttBridge::open(options, contract::inbox(100_000)).unwrap();
    until("the connection", || bridge.link() == Link::Up);
    bridge
}

fn versioned(broker: &Broker, name: &str, version: Version) -> Options {
    Options { version, ..broker.options(name) }
}

fn client(python: &Path, broker: &Broker, name: &str) -> Script {
    Script::start(python, "mqtt_client.py", &json!({ "name": name, "port": broker.port() }))
}

fn hex(text: &str) -> String {
    text.bytes().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn a_client_that_is_not_ours_is_heard_and_hears() {
    let Some(python) = python() else { return };
    for version in VERSIONS {
        let broker = Broker::start(&[]);
        let mut bridge = open(&versioned(&broker, "healer", version));
        let mut other = client(&python, &broker, "other");
        other.order(&json!({"subscribe": "healed"}));
        bridge.subscribe("source", None).unwrap();
        until("the subscription", || {
            other.order(&json!({"publish": "source", "text": "21.5", "properties": {"quality": "Bad", "stamp_ns": "7"}}));
            !bridge.inbox().is_empty()
        });
        let message = contract::next(&mut bridge);
        assert_eq!(
            (&*message.topic, &*contract::text(&message), message.retained),
            ("source", "21.5", false)
        );
        let beside = (message.quality, message.stamp.map(|stamp| stamp.0));
        assert_eq!(beside, if version == Version::V5 { (Some(Quality::Bad), Some(7)) } else { (None, None) });
        let level = Some("SIL 2".to_owned());
        let admission = Some(Admission { ground: Ground::Met, level, rank: 2 });
        let provenance = Provenance { admission, ..Provenance::new(Quality::Substitute, "wheel_2, turn") };
        let value = Payload::Value(RawValue::Interval { lo: 1.0, hi: 2.0 });
        let outgoing = Outgoing { provenance: Some(&provenance), ..Outgoing::new("healed", Time(5), value) };
        bridge.publish(outgoing).unwrap();
        let received = other.next_with("topic");
        assert_eq!((&received["topic"], &received["hex"]), (&json!("healed"), &json!(hex("1.5"))));
        let expected = json!({
            "publisher": bridge.publisher().to_string(), "stamp_ns": "5",
            "quality": "UncertainSubstituteValue", "status": "1083244544", "source": "wheel_2, turn",
            "admitted": "met", "level": "SIL 2", "rank": "2",
        });
        assert_eq!(received["properties"], if version == Version::V5 { expected } else { json!({}) });
    }
}

/// The broker keeps messages for this client while it is away.
fn kept(broker: &Broker, name: &str, version: Version) -> Options {
    Options { session: Duration::from_secs(60), ..versioned(broker, name, version) }
}

#[test]
fn what_the_broker_kept_is_marked_and_what_is_new_is_not() {
    let Some(python) = python() else { return };
    for version in VERSIONS {
        let broker = Broker::start(&[]);
        let options = kept(&broker, "healer", version);
        let mut other = client(&python, &broker, "other");
        let mut bridge = open(&options);
        bridge.subscribe("a", None).unwrap();
        until("the subscription", || {
            other.order(&json!({"publish": "a", "text": "probe"}));
            bridge.receive().is_some()
        });
        drop(bridge);
        other.order(&json!({"publish": "a", "text": "old"}));
        let mut bridge = open(&options);
        bridge.subscribe("a", None).unwrap();
        let mut is_marked = |text: &str| loop {
            let message = contract::next(&mut bridge);
            if matches!(&message.payload, Payload::Bytes(bytes) if bytes == text.as_bytes()) {
                return message.retained;
            }
        };
        assert!(is_marked("old"), "{version:?}");
        // After an absence, kept messages may arrive for some seconds; this pause is longer.
        std::thread::sleep(Duration::from_secs(6));
        other.order(&json!({"publish": "a", "text": "new"}));
        assert!(!is_marked("new"), "{version:?}");
    }
}

#[test]
fn nothing_is_lost_that_the_broker_kept() {
    let Some(python) = python() else { return };
    for version in VERSIONS {
        let mut broker = Broker::start(&[]);
        let options = kept(&broker, "healer", version);
        let mut bridge = open(&options);
        let mut other = client(&python, &broker, "other");
        bridge.subscribe("a", None).unwrap();
        until("the subscription", || {
            other.order(&json!({"publish": "a", "text": "probe"}));
            bridge.receive().is_some()
        });
        drop(bridge);
        for number in 0..200 {
            other.order(&json!({"publish": "a", "text": number.to_string()}));
        }
        broker.end();
        broker.restart();
        let mut bridge = open(&options);
        bridge.subscribe("a", None).unwrap();
        let mut got = contract::until_payload(&mut bridge, "a", "199");
        got.retain(|text| text != "probe");
        let expected: Vec<String> = (0..200).map(|number| number.to_string()).collect();
        assert_eq!(got, expected, "{version:?}");
    }
}

#[test]
fn what_is_published_without_a_broker_waits_the_newest_of_each_topic() {
    for version in VERSIONS {
        let mut broker = Broker::start(&[]);
        let mut source = open(&versioned(&broker, "source", version));
        let mut sink = open(&kept(&broker, "sink", version));
        for topic in ["a", "b"] {
            contract::join_up(&mut source, &mut sink, topic);
        }
        broker.end();
        until("the end is noticed", || matches!(source.link(), Link::Down(_)));
        for number in 0..100 {
            contract::send(&mut source, if number % 2 == 0 { "a" } else { "b" }, &number.to_string());
        }
        broker.restart();
        assert_eq!(contract::until_payload(&mut sink, "a", "98").pop().as_deref(), Some("98"));
        assert_eq!(contract::until_payload(&mut sink, "b", "99").pop().as_deref(), Some("99"));
        assert!(source.troubles().is_empty());
    }
}

#[test]
fn what_has_expired_is_not_sent() {
    for version in VERSIONS {
        let broker = Broker::start(&[]);
        let mut source = open(&versioned(&broker, "source", version));
        let mut sink = open(&versioned(&broker, "sink", version));
        contract::join_up(&mut source, &mut sink, "a");
        let now = source.inbox().clock().now();
        let of = |text: &str, expires| {
            let message = Outgoing::new("a", now, Payload::Bytes(text.to_owned().into()));
            Outgoing { expires: Some(expires), ..message }
        };
        source.publish(of("over", now)).unwrap();
        source.publish(of("in time", now + Span::from_millis(60_000))).unwrap();
        source.flush();
        let got = contract::until_payload(&mut sink, "a", "in time");
        assert!(!got.iter().any(|text| text == "over"), "{version:?}: {got:?}");
    }
}

#[test]
fn a_broker_that_comes_later_is_found() {
    let mut broker = Broker::start(&[]);
    broker.kill();
    let mut options = broker.options("healer");
    options.first_attempt = Duration::from_secs(1);
    let mut bridge = MqttBridge::open(&options, contract::inbox(16)).unwrap();
    bridge.subscribe("a", None).unwrap();
    assert!(matches!(bridge.link(), Link::Down(reason) if reason.contains("refused")), "{:?}", bridge.link());
    contract::send(&mut bridge, "b", "kept");
    broker.restart();
    let mut other = open(&broker.options("other"));
    until("the connection", || bridge.link() == Link::Up);
    contract::join_up(&mut other, &mut bridge, "a");
}

#[test]
fn kept_messages_are_marked_and_come_once() {
    for version in VERSIONS {
        let mut broker = Broker::start(&[]);
        let mut source = open(&versioned(&broker, "source", version));
        let kept = Outgoing { retain: true, ..Outgoing::new("a", Time(1), Payload::Bytes("old".into())) };
        source.publish(kept).unwrap();
        // When the witness has the message, the broker has it, too.
        let mut witness = open(&versioned(&broker, "witness", version));
        witness.subscribe("a", None).unwrap();
        contract::next(&mut witness);
        let mut sink = open(&versioned(&broker, "sink", version));
        sink.subscribe("a", None).unwrap();
        let message = contract::next(&mut sink);
        assert_eq!((contract::text(&message).as_str(), message.retained), ("old", true));
        contract::send(&mut source, "a", "new");
        let message = contract::next(&mut sink);
        assert_eq!((contract::text(&message).as_str(), message.retained), ("new", false));
        broker.end();
    }
}

#[test]
fn others_learn_whether_a_client_is_there() {
    let Some(python) = python() else { return };
    for version in VERSIONS {
        let broker = Broker::start(&[]);
        let mut other = client(&python, &broker, "other");
        other.order(&json!({"subscribe": "status"}));
        let mut expect =
            |text: &str| assert_eq!(other.next_with("topic")["hex"], json!(hex(text)), "{version:?}");
        let presence = Presence { topic: "status".into(), here: "here".into(), gone: "gone".into() };
        let cut = Cut::before(broker.port());
        let options = versioned(&broker, "healer", version);
        let bridge = open(&Options { presence: Some(presence), port: cut.port, ..options });
        expect("here");
        cut.cut();
        expect("gone");
        expect("here");
        drop(bridge);
        expect("gone");
    }
}

#[test]
fn two_clients_of_one_name_are_reported() {
    let broker = Broker::start(&[]);
    let bridge = open(&broker.options("healer"));
    let _thief = open(&broker.options("healer"));
    until("the reason", || matches!(bridge.link(), Link::Down(reason) if reason.contains("same identifier")));
}

#[test]
fn the_password_comes_from_a_file_and_a_wrong_one_is_refused() {
    let lines = ["allow_anonymous false", "password_file FOLDER/users", "acl_file FOLDER/rights"];
    let broker = Broker::start_with(&lines, |folder| {
        let users = folder.join("users");
        let made = Command::new("mosquitto_passwd")
            .arg("-b")
            .arg("-c")
            .arg(&users)
            .args(["ann", "right-word"])
            .status();
        assert!(made.unwrap().success());
        std::fs::write(folder.join("rights"), "user ann\ntopic readwrite a/#\n").unwrap();
        std::fs::write(folder.join("right"), "right-word\n").unwrap();
        std::fs::write(folder.join("wrong"), "wrong-word\n").unwrap();
    });
    for version in ["5", "3.1.1"] {
        let with = |file: &str| {
            let settings =
                format!("version={version}&user=ann&password-file={}", broker.folder().join(file).display());
            Options::parse(&format!("mqtt://127.0.0.1:{}?{settings}", broker.port()), "healer").unwrap()
        };
        let error = MqttBridge::open(&with("wrong"), contract::inbox(4)).err().unwrap();
        assert!(
            matches!(&error, BridgeError::Refused(reason) if reason.contains("NotAuthorized")),
            "{error}"
        );
        assert!(!format!("{error:?} {:?}", with("wrong")).contains("wrong-word"));
        let mut bridge = open(&with("right"));
        assert_eq!(bridge.channel(), Channel { encrypted: false, authenticated: true });
        contract::send(&mut bridge, "forbidden", "1");
        if version == "5" {
            let mut refusals = Vec::new();
            until("the broker's answer", || {
                refusals.extend(bridge.refusals());
                !refusals.is_empty()
            });
            let (topic, error) = &refusals[0];
            let expected = ("forbidden", "refused: the broker says NotAuthorized".to_owned());
            assert_eq!((&**topic, error.to_string()), expected);
        }
        // Mosquitto 2.0.11 disconnects the client then.
        until("the connection", || bridge.link() == Link::Up);
    }
}
