//! The DDS bridge among nodes of ROS 2 that are cyclonedds's, each test in a network of its own.

#[macro_use]
mod contract;
mod real;
mod texts;
#[path = "dds/surroundings.rs"]
mod surroundings;

use contract::{Asking, Middleware};
use real::network::{Multicast, alone};
use real::{Script, eventually, python};
use serde_json::{Value, json};
use shsa_bridge::dds::{DdsBridge, Interfaces, Options};
use shsa_bridge::payload::{Reader, SIZE_LIMIT};
use shsa_bridge::{
    Bridge, BridgeError, Clock, Diagnostic, Inbox, Level, Message, Outgoing, Payload, PublisherId,
};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::source::Field;
use std::time::Duration;
use texts::Texts;

/// The domain of all, which is not the usual one.
const DOMAIN: u32 = 5;

fn open(inbox: Inbox) -> DdsBridge {
    DdsBridge::open(&Options { domain: DOMAIN, ..Options::default() }, inbox).unwrap()
}

fn bridge() -> DdsBridge {
    open(Inbox::new(4096, Clock::running()))
}

fn with_multicast(test: &str, body: impl FnOnce()) {
    alone(test, Multicast::On, body);
}

/// A node of cyclonedds and a bridge, in a network with multicast or without.
fn among_nodes(test: &str, multicast: Multicast, body: impl FnOnce(&mut Script, &mut DdsBridge)) {
    let Some(python) = python() else { return };
    alone(test, multicast, || {
        let given = json!({"multicast": multicast == Multicast::On, "domain": DOMAIN});
        let mut node = Script::start(&python, "dds_node.py", &given);
        body(&mut node, &mut bridge());
    });
}

/// Lets the node publish until a message arrives.
#[track_caller]
fn observe(node: &mut Script, bridge: &mut DdsBridge, order: &Value) -> Message {
    eventually("the node's message", || {
        node.order(order);
        bridge.inbox().wait(Duration::from_millis(50));
        bridge.receive()
    })
}

fn number(message: &Message, path: &str) -> (RawValue, Option<Time>) {
    let field = Field { path: path.into(), stamp: None };
    let mut found = None;
    Reader::new(&[field], SIZE_LIMIT).unwrap().read(message, |_, reading| found = Some(reading));
    let reading = found.unwrap().unwrap();
    (reading.value, reading.stamp)
}

#[test]
fn nodes_are_heard_whether_reliable_or_not() {
    among_nodes("nodes_are_heard_whether_reliable_or_not", Multicast::On, |node, bridge| {
        // With the type of who publishes, with one that is given, and with another than is published.
        bridge.subscribe("/front", None).unwrap();
        bridge.subscribe("speed", Some("std_msgs/Float64")).unwrap();
        bridge.subscribe("/other", Some("std_msgs/msg/Float64")).unwrap();
        let set = json!({"range": 1.25, "header.stamp.sec": 9});
        let order = json!({"publish": "/front", "type": "sensor_msgs/msg/Range", "set": set, "stamp": 7_000_000_001_u64, "reliable": false});
        let range = observe(node, bridge, &order);
        assert_eq!(
            (&*range.topic, range.message_type.as_deref(), range.stamp),
            ("/front", Some("sensor_msgs/msg/Range"), Some(Time(7_000_000_001)))
        );
        assert_eq!(number(&range, "range"), (RawValue::Number(1.25), Some(Time(9_000_000_000))));
        assert_ne!(range.publisher, Some(bridge.publisher()));

        let speed = json!({"publish": "/speed", "type": "std_msgs/msg/Float64", "set": {"data": -0.5}});
        let speed = eventually("the speed", || {
            node.order(&speed);
            node.order(&json!({"publish": "/other", "type": "std_msgs/msg/Float32", "set": {"data": 1.0}}));
            bridge.inbox().wait(Duration::from_millis(50));
            std::iter::from_fn(|| bridge.receive()).find(|message| &*message.topic == "speed")
        });
        assert_eq!(number(&speed, "").0, RawValue::Number(-0.5));
        std::thread::sleep(Duration::from_millis(300));
        let others = std::iter::from_fn(|| bridge.receive()).filter(|message| &*message.topic == "/other");
        assert_eq!(others.count(), 0, "a message of another type than subscribed is not received");
    });
}

#[test]
fn nodes_hear_and_list_us() {
    among_nodes("nodes_hear_and_list_us", Multicast::On, |node, bridge| {
        bridge.subscribe("/front", Some("sensor_msgs/msg/Range")).unwrap();
        bridge.advertise("/cmd_vel", "geometry_msgs/msg/TwistStamped#twist.angular.z").unwrap();
        let mut check = |topic: &str, order: Value, payload: Payload, expected: Value| {
            node.order(&order);
            let heard = eventually("our message", || {
                bridge.publish(Outgoing::new(topic, Time(3_000_000_007), payload.clone())).unwrap();
                node.poll("heard", Duration::from_millis(200)).filter(|heard| heard["heard"] == topic)
            });
            assert_eq!((&heard["value"], &heard["stamp"]), (&expected, &json!(3_000_000_007_u64)));
            // The writers of one participant have its identity but for the last four bytes.
            let ours: String =
                bridge.publisher().0.to_le_bytes().iter().map(|it| format!("{it:02x}")).collect();
            assert_eq!(heard["gid"].as_str().unwrap()[..24], ours[..24]);
            heard
        };
        let order = |topic: &str, name: &str, get: &str, reliable: bool| json!({"subscribe": topic, "type": name, "get": get, "reliable": reliable});
        let value = |number: f64| Payload::Value(RawValue::Number(number));
        check("/dmin", order("/dmin", "std_msgs/msg/Float64", "data", true), value(0.1), json!(0.1));
        check("/loose", order("/loose", "std_msgs/msg/Float64", "data", false), value(0.2), json!(0.2));
        let twist = order("/cmd_vel", "geometry_msgs/msg/TwistStamped", "twist.angular.z", true);
        assert_eq!(check("/cmd_vel", twist, value(1.5), json!(1.5))["header"], json!(3));
        let text = Payload::Bytes("{\"state\":\"\u{fc}\"}".into());
        let order = order("/status", "std_msgs/msg/String", "data", true);
        check("/status", order, text, json!("{\"state\":\"\u{fc}\"}"));
        let listed = node.answer(&json!({"list": true}), "listed");
        for entry in [
            json!(["publisher", "rt/dmin", "std_msgs::msg::dds_::Float64_"]),
            json!(["publisher", "rt/cmd_vel", "geometry_msgs::msg::dds_::TwistStamped_"]),
            json!(["subscription", "rt/front", "sensor_msgs::msg::dds_::Range_"]),
        ] {
            assert!(listed["listed"].as_array().unwrap().contains(&entry), "{entry} in {listed}");
        }
    });
}

#[test]
fn nodes_are_found_without_multicast() {
    among_nodes("nodes_are_found_without_multicast", Multicast::Off, |node, bridge| {
        bridge.subscribe("/speed", None).unwrap();
        let order = json!({"publish": "/speed", "type": "std_msgs/msg/Float32", "set": {"data": 2.0}});
        assert_eq!(number(&observe(node, bridge, &order), "").0, RawValue::Number(2.0));
        // A substitute goes out as the type that others publish.
        node.order(&json!({"subscribe": "/speed", "type": "std_msgs/msg/Float32", "get": "data"}));
        eventually("the substitute", || {
            bridge.publish(Outgoing::new("/speed", Time(1), Payload::Value(RawValue::Number(0.5)))).unwrap();
            node.poll("heard", Duration::from_millis(200)).filter(|heard| heard["value"] == json!(0.5))
        });
    });
}

#[test]
fn diagnostics_are_those_of_ros() {
    among_nodes("diagnostics_are_those_of_ros", Multicast::On, |node, bridge| {
        let state = |level, name: &str, details| Diagnostic {
            level,
            name: name.into(),
            message: "none".into(),
            reporter: "shsa".into(),
            details,
        };
        let all = [
            state(Level::Ok, "a", Vec::new()),
            state(Level::Stale, "gr\u{fc}n", vec![("verdict", "silent".into()), ("symptom", "12".into())]),
        ];
        for (path, expected) in [
            ("status.1.level", json!(3)),
            ("status.1.name", json!("gr\u{fc}n")),
            ("status.1.values.1.value", json!("12")),
        ] {
            let kind = "diagnostic_msgs/msg/DiagnosticArray";
            node.order(&json!({"subscribe": "/diagnostics", "type": kind, "get": path}));
            let heard = eventually("the states", || {
                bridge.diagnose(Time(3_000_000_007), &mut || all.to_vec()).unwrap();
                node.poll("heard", Duration::from_millis(200)).filter(|heard| heard["value"] == expected)
            });
            assert_eq!(heard["header"], json!(3), "{path}");
        }
    });
}

#[test]
fn everything_is_heard_under_its_name() {
    among_nodes("everything_is_heard_under_its_name", Multicast::On, |node, bridge| {
        bridge.subscribe("named", None).unwrap();
        bridge.subscribe_all().unwrap();
        for topic in ["named", "/a/b"] {
            let order = json!({"publish": topic, "type": "std_msgs/msg/Float64", "set": {"data": 1.0}});
            let received = eventually("the message", || {
                node.order(&order);
                bridge.inbox().wait(Duration::from_millis(50));
                bridge.receive().filter(|message| &*message.topic == topic)
            });
            assert_eq!(received.message_type.as_deref(), Some("std_msgs/msg/Float64"));
        }
    });
}

/// RustDDS sends to whoever subscribes under the name, whatever the type.
#[test]
fn a_message_of_another_type_is_not_received_from_our_own_kind() {
    with_multicast("a_message_of_another_type_is_not_received_from_our_own_kind", || {
        let (mut source, mut sink) = (bridge(), bridge());
        source.advertise("/other", "std_msgs/msg/Float32").unwrap();
        sink.subscribe("/other", Some("std_msgs/msg/Float64")).unwrap();
        sink.subscribe("/speed", Some("std_msgs/msg/Float64")).unwrap();
        let mut send = |topic: &str| {
            source.publish(Outgoing::new(topic, Time(1), Payload::Value(RawValue::Number(1.0)))).unwrap();
        };
        for _ in 0..5 {
            let received = eventually("the speed", || {
                send("/other");
                send("/speed");
                sink.inbox().wait(Duration::from_millis(50));
                sink.receive()
            });
            assert_eq!(&*received.topic, "/speed");
        }
    });
}

/// A subscriber that is stopped in its tracks acknowledges nothing; others go on being served.
#[test]
fn a_frozen_subscriber_keeps_nobody_else_waiting() {
    among_nodes("a_frozen_subscriber_keeps_nobody_else_waiting", Multicast::On, |node, bridge| {
        node.order(&json!({"subscribe": "/dmin", "type": "std_msgs/msg/Float64", "get": "data"}));
        let mut sink = self::bridge();
        sink.subscribe("/dmin", None).unwrap();
        let mut send = |value: f64| {
            bridge.publish(Outgoing::new("/dmin", Time(1), Payload::Value(RawValue::Number(value)))).unwrap();
        };
        eventually("both hear", || {
            send(0.0);
            node.poll("heard", Duration::from_millis(50)).and(sink.receive())
        });
        node.signal("STOP");
        // More than may wait for its acknowledgement, and less than a time after which it counts as gone.
        let began = std::time::Instant::now();
        (1..10_000).for_each(|value| send(f64::from(value)));
        assert!(began.elapsed() < Duration::from_secs(8), "{:?}", began.elapsed());
        eventually("the newest value", || {
            send(10_000.0);
            let newest = std::iter::from_fn(|| sink.receive()).last();
            newest.filter(|message| number(message, "").0 == RawValue::Number(10_000.0))
        });
        node.signal("CONT");
    });
}

#[test]
fn what_ros_and_dds_do_not_know_is_refused_with_help() {
    with_multicast("what_ros_and_dds_do_not_know_is_refused_with_help", || {
        let mut bridge = bridge();
        let check = |refused: Result<(), BridgeError>, expected: &str| {
            assert!(
                matches!(&refused, Err(BridgeError::Configuration(why)) if why.contains(expected)),
                "{refused:?}"
            );
        };
        check(bridge.subscribe("/a b", None), "topic '/a b' is no name for ROS 2: letters, digits");
        check(bridge.advertise("/x", "bot_msgs/msg/Robot"), "is not known; give its .msg files");
        check(
            bridge.advertise("/x", "std_msgs/msg/Float64#value"),
            "no field 'value' in std_msgs/msg/Float64",
        );
        let raw = |bytes: &'static [u8]| Payload::Bytes(bytes::Bytes::from_static(bytes));
        check(
            bridge.publish(Outgoing::new("/raw", Time(0), raw(&[0, 1, 0, 0, 1]))),
            "advertise it with the type",
        );
        bridge.advertise("/big", "std_msgs/msg/UInt8").unwrap();
        check(
            bridge.publish(Outgoing::new("/big", Time(0), raw(&[0, 0, 0, 0, 1]))),
            "byte order of big machines",
        );
        let nowhere =
            Options { interfaces: Interfaces::Named(vec!["nowhere0".into()]), ..Options::default() };
        check(DdsBridge::open(&nowhere, contract::inbox(1)).map(|_| ()), "there are: lo (127.0.0.1)");
        assert_ne!(bridge.publisher(), PublisherId(0));
    });
}

/// Participants in one network.
struct Participants;

impl Middleware for Participants {
    fn bridge(&mut self, _: &str, inbox: Inbox) -> Box<dyn Bridge> {
        Box::new(Texts(open(inbox)))
    }

    fn break_it(&mut self) -> bool {
        false
    }

    fn mend_it(&mut self) {}

    fn asking(&self) -> Asking {
        Asking::Never
    }
}

contract!(participants, Participants, with_multicast);
