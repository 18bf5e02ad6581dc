//! What arrives from edge nodes: metrics with their times, and their ends.

use super::{Plant, eventually};
use serde_json::{Value, json};
use shsa_bridge::payload::{METRICS, Reader, SIZE_LIMIT};
use shsa_bridge::{Bridge, BridgeError, Payload};
use shsa_core::observation::RawValue;
use shsa_message::source::Field;
use std::time::Duration;

/// The next reading of this metric of a node or device: a number with its time in milliseconds, or why there is none.
#[track_caller]
fn next(plant: &mut Plant, topic: &str, name: &str) -> String {
    let mut reader = Reader::new(&[Field { path: name.into(), stamp: None }], SIZE_LIMIT).unwrap();
    let mut found = None;
    eventually(&format!("{name} of {topic}"), || {
        let bridge = plant.bridge();
        bridge.inbox().wait(Duration::from_millis(20));
        while let Some(message) = bridge.receive() {
            if *message.topic == *topic {
                reader.read(&message, |_, reading| {
                    found = Some(match reading {
                        Err(why) => format!("? {why}"),
                        Ok(reading) => {
                            let RawValue::Number(number) = reading.value else { panic!("only numbers") };
                            format!("{number} at {}", reading.stamp.map_or(-1, |stamp| stamp.0 / 1_000_000))
                        }
                    });
                });
            }
            if found.is_some() {
                break;
            }
        }
        found.take()
    })
}

fn temperature(value: i32) -> Value {
    json!({ "name": "Temp", "alias": 7, "type": "Int16", "value": value, "timestamp": 1_700_000_000_001_u64 })
}

/// The temperature as data has it: by its alias, without its type.
fn by_alias(value: i32) -> Value {
    json!({ "alias": 7, "type": "Int16", "untyped": true, "value": value, "timestamp": 1_700_000_000_002_u64 })
}

/// A press with a drive, connected, whose metrics are wanted: the broker knows our subscription when the request has come.
fn connected() -> Option<Plant> {
    let mut plant = Plant::new("")?;
    plant.order(&json!({ "connect": "Plant/Press", "bd_seq": 4 }));
    let bridge = plant.open();
    bridge.subscribe("Plant/Press", None).unwrap();
    bridge.subscribe("Plant/Press/Drive", None).unwrap();
    plant.command();
    Some(plant)
}

/// As [`connected`], and born.
fn born() -> Option<Plant> {
    let mut plant = connected()?;
    plant.order(&json!({ "birth": [temperature(-5)], "node": "Plant/Press" }));
    let speed = json!({ "name": "Motor/Speed", "alias": 8, "type": "Float", "value": 1.5, "timestamp": 1 });
    plant.order(&json!({ "birth": [speed], "node": "Plant/Press", "device": "Drive" }));
    Some(plant)
}

#[test]
fn metrics_come_by_name_and_by_alias() {
    let Some(mut plant) = born() else { return };
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "-5 at 1700000000001");
    assert_eq!(next(&mut plant, "Plant/Press/Drive", "Motor/Speed"), "1.5 at 1");
    plant.order(&json!({ "data": [by_alias(-6)], "node": "Plant/Press" }));
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "-6 at 1700000000002");
    let speed = json!({ "alias": 8, "type": "Float", "untyped": true, "value": 2.5, "timestamp": 2 });
    plant.order(&json!({ "data": [speed], "node": "Plant/Press", "device": "Drive" }));
    assert_eq!(next(&mut plant, "Plant/Press/Drive", "Motor/Speed"), "2.5 at 2");
    let with = |key: &str, value: Value| {
        let mut metric = by_alias(3);
        metric[key] = value;
        json!({ "data": [metric], "node": "Plant/Press" })
    };
    plant.order(&with("historical", json!(true)));
    plant.order(&with("quality", json!(500)));
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "? `Temp` is stale (500), no number");
    plant.order(&with("null", json!(true)));
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "? `Temp` is null, no number");
    assert!(plant.bridge().troubles().is_empty());
}

#[test]
fn deaths_end_the_values_at_once() {
    let Some(mut plant) = born() else { return };
    next(&mut plant, "Plant/Press/Drive", "Motor/Speed");
    plant.order(&json!({ "death": "Plant/Press", "device": "Drive" }));
    assert_eq!(next(&mut plant, "Plant/Press/Drive", "Motor/Speed"), "? the device has died (DDEATH)");
    plant.order(&json!({ "data": [by_alias(1)], "node": "Plant/Press" }));
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "1 at 1700000000002", "the node itself lives");
    // The broker sends the will; it comes again, and the death of its earlier connection comes late.
    plant.order(&json!({ "cut": "Plant/Press" }));
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "? the edge node has died (NDEATH)");
    plant.order(&json!({ "connect": "Plant/Press", "bd_seq": 5 }));
    plant.order(&json!({ "birth": [temperature(9)], "node": "Plant/Press" }));
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "9 at 1700000000001");
    let late = "08011210 0a0562645365711801 2008 5804".replace(' ', "");
    plant.order(&json!({ "raw": "spBv1.0/Plant/NDEATH/Press", "hex": late }));
    plant.order(&json!({ "data": [by_alias(10)], "node": "Plant/Press" }));
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "10 at 1700000000002");
    plant.order(&json!({ "death": "Plant/Press" }));
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "? the edge node has died (NDEATH)");
}

#[test]
fn after_a_gap_aliases_wait_for_the_next_birth() {
    let Some(mut plant) = born() else { return };
    next(&mut plant, "Plant/Press", "Temp");
    plant.order(&json!({ "skip": "Plant/Press" }));
    plant.order(&json!({ "data": [by_alias(1)], "node": "Plant/Press" }));
    let named = json!({ "name": "Temp", "type": "Int16", "untyped": true, "value": -2, "timestamp": 3 });
    plant.order(&json!({ "data": [named], "node": "Plant/Press" }));
    assert_eq!(
        next(&mut plant, "Plant/Press", "Temp"),
        "-2 at 3",
        "the one by alias may be of another metric"
    );
    plant.order(&json!({ "birth": [temperature(3)], "node": "Plant/Press" }));
    plant.order(&json!({ "data": [by_alias(4)], "node": "Plant/Press" }));
    let both = [next(&mut plant, "Plant/Press", "Temp"), next(&mut plant, "Plant/Press", "Temp")];
    assert_eq!(both, ["3 at 1700000000001", "4 at 1700000000002"]);
}

#[test]
fn strangers_messages_do_no_harm() {
    let Some(mut plant) = born() else { return };
    next(&mut plant, "Plant/Press", "Temp");
    let topics =
        ["NBIRTH/Press", "NDATA/Press", "NDEATH/Press", "DBIRTH/Press/Drive", "DDATA/Press", "NDATA"];
    for topic in topics {
        for hex in ["", "ff", "0a", "12ffffffff7f", "1201", "ffffffffffffffffffffff"] {
            let topic = format!("spBv1.0/Plant/{topic}");
            // Nothing is a payload without metrics; a birth or a death of nothing is one.
            if !(hex.is_empty() && topic.contains("Press")) {
                plant.order(&json!({ "raw": topic, "hex": hex }));
            }
        }
    }
    plant.order(&json!({ "data": [by_alias(1)], "node": "Plant/Press" }));
    assert_eq!(next(&mut plant, "Plant/Press", "Temp"), "1 at 1700000000002");
    let troubles: Vec<String> = plant.bridge().troubles().iter().map(ToString::to_string).collect();
    let expected = "refused: a message on `spBv1.0/Plant/NDATA/Press`: its payload is none of Sparkplug B";
    assert!(troubles.iter().any(|trouble| trouble == expected) && troubles.len() <= 6, "{troubles:?}");
}

#[test]
fn a_retained_birth_says_nothing_about_the_present() {
    let Some(mut plant) = Plant::new("") else { return };
    plant.order(&json!({ "raw": "spBv1.0/Plant/NBIRTH/Press", "hex": "0801", "retain": true }));
    plant.order(&json!({ "connect": "Plant/Press", "bd_seq": 0 }));
    plant.open().subscribe("Plant/Press", None).unwrap();
    plant.command();
    plant.order(&json!({ "birth": [temperature(2)], "node": "Plant/Press" }));
    let message = eventually("the birth", || plant.bridge().receive());
    assert_eq!(message.message_type.as_deref(), Some(METRICS));
    assert!(matches!(message.payload, Payload::Bytes(bytes) if bytes.len() > 2));
}

#[test]
fn names_that_are_none_are_refused() {
    let Some(mut plant) = Plant::new("") else { return };
    let bridge = plant.open();
    for (topic, problem) in [
        ("speed", "a source is GROUP/NODE#METRIC"),
        ("a/b/c/d", "a source is GROUP/NODE#METRIC"),
        ("Plant/healer", "this instance's own edge node"),
    ] {
        let refused = bridge.subscribe(topic, None);
        assert!(matches!(&refused, Err(BridgeError::Refused(why)) if why.contains(problem)), "{refused:?}");
    }
    assert_eq!(bridge.subscribe("shsa/other/answer", None), Ok(()));
}
