//! Our edge node, as an independent consumer sees it.

use super::{Plant, metric};
use serde_json::{Value, json};
use shsa_bridge::{Bridge, Offered, Outgoing, Payload, Provenance, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_core::unit::Unit;

const BIRTH: &str = "spBv1.0/Plant/NBIRTH/healer";
const DATA: &str = "spBv1.0/Plant/NDATA/healer";
const DEATH: &str = "spBv1.0/Plant/NDEATH/healer";

/// Opens the bridge, and announces a need.
fn open(plant: &mut Plant) {
    let unit = Unit::parse("m").unwrap();
    let bridge = plant.open();
    bridge.offer("model", &[Offered { topic: "/stop/dmin", unit: Some(&unit) }]);
    bridge.flush();
}

/// Publishes a value with this quality.
fn publish(plant: &mut Plant, value: RawValue, quality: Quality) {
    let provenance = Provenance::new(quality, "sonar");
    let message = Outgoing::new("/stop/dmin", Time(1_700_000_000_123_000_000), Payload::Value(value));
    let bridge = plant.bridge();
    let expires = Some(bridge.inbox().clock().now() + Span::from_millis(60_000));
    bridge.publish(Outgoing { provenance: Some(&provenance), expires, ..message }).unwrap();
    bridge.flush();
}

/// The number of a message, and the number that relates births and deaths.
fn numbers(message: &Value) -> (Option<u64>, Option<u64>) {
    let payload = &message["payload"];
    let metrics = payload["metrics"].as_array().unwrap();
    let bd_seq = metrics.iter().find(|metric| metric["name"] == "bdSeq");
    (payload["seq"].as_u64(), bd_seq.and_then(|metric| metric["value"].as_u64()))
}

/// The birth that has the need's metric.
fn full_birth(plant: &mut Plant) -> Value {
    loop {
        let birth = plant.seen(BIRTH);
        if birth["payload"]["metrics"].as_array().unwrap().iter().any(|it| it["name"] == "stop/dmin") {
            return birth;
        }
    }
}

#[test]
fn the_birth_tells_all_metrics_and_data_the_changes() {
    let Some(mut plant) = Plant::new("") else { return };
    open(&mut plant);
    let birth = full_birth(&mut plant);
    assert_eq!(numbers(&birth), (Some(0), Some(0)));
    assert_eq!((&birth["qos"], &birth["retain"]), (&json!(0), &json!(false)));
    assert!(birth["payload"]["timestamp"].as_u64().unwrap() > 1_700_000_000_000);
    let rebirth = metric(&birth, "Node Control/Rebirth");
    assert_eq!((&rebirth["value"], &rebirth["datatype"]), (&json!(false), &json!(11)));
    for it in birth["payload"]["metrics"].as_array().unwrap() {
        let is_whole = it["name"].is_string() && it["datatype"].is_u64() && it["timestamp"].is_u64();
        assert!(is_whole && it["alias"].is_null(), "{it}");
    }
    let need = metric(&birth, "stop/dmin");
    assert_eq!((&need["null"], &need["datatype"]), (&json!(true), &json!(10)));
    assert_eq!(need["properties"]["Quality"], json!({ "type": 3, "value": 0 }));
    assert_eq!(need["properties"]["engUnit"]["value"], "m");

    publish(&mut plant, RawValue::Interval { lo: 1.0, hi: 2.0 }, Quality::Good);
    let data = plant.seen(DATA);
    assert_eq!((numbers(&data), &data["qos"], &data["retain"]), ((Some(1), None), &json!(0), &json!(false)));
    let need = metric(&data, "stop/dmin");
    assert_eq!((&need["value"], &need["timestamp"]), (&json!(1.5), &json!(1_700_000_000_123_u64)));
    assert!(need["datatype"].is_null());
    let properties = &need["properties"];
    assert_eq!(properties["Quality"], json!({ "type": 3, "value": 192 }));
    let shown = ["status", "source", "lo", "hi"].map(|key| properties[key]["value"].clone());
    assert_eq!(shown, [json!("Good"), json!("sonar"), json!(1.0), json!(2.0)]);

    // The same again is no change; another quality is one.
    publish(&mut plant, RawValue::Interval { lo: 1.0, hi: 2.0 }, Quality::Good);
    publish(&mut plant, RawValue::Interval { lo: 1.0, hi: 2.0 }, Quality::Substitute);
    let data = plant.seen(DATA);
    assert_eq!(numbers(&data).0, Some(2));
    let status = &metric(&data, "stop/dmin")["properties"]["status"];
    assert_eq!(status["value"], "UncertainSubstituteValue");
    plant.bridge().rate("/stop/dmin", Time(0), Quality::Bad);
    plant.bridge().flush();
    let data = plant.seen(DATA);
    assert_eq!(metric(&data, "stop/dmin")["properties"]["Quality"]["value"], 0);
}

#[test]
fn a_rebirth_is_sent_when_it_is_asked_for() {
    let Some(mut plant) = Plant::new("") else { return };
    open(&mut plant);
    full_birth(&mut plant);
    publish(&mut plant, RawValue::Number(3.0), Quality::Good);
    plant.seen(DATA);
    let order = |value: bool| {
        let rebirth = json!({ "name": "Node Control/Rebirth", "type": "Boolean", "value": value });
        json!({ "command": "Plant/healer", "metrics": [rebirth] })
    };
    plant.order(&order(true));
    let birth = plant.seen(BIRTH);
    assert_eq!(numbers(&birth), (Some(0), Some(0)), "the same number: the connection is the same");
    assert_eq!(metric(&birth, "stop/dmin")["value"], 3.0, "the present value");
    publish(&mut plant, RawValue::Number(4.0), Quality::Good);
    assert_eq!(numbers(&plant.seen(DATA)).0, Some(1));
    // Neither a writing of false nor garbage is a request.
    plant.order(&order(false));
    plant.order(&json!({ "raw": "spBv1.0/Plant/NCMD/healer", "hex": "ff00" }));
    plant.order(&json!({ "raw": "spBv1.0/Plant/NCMD/healer", "hex": "12070a0141700120" }));
    assert!(!plant.sees(BIRTH));
    // A new metric needs a birth.
    let other = Outgoing::new("other", Time(0), Payload::Value(RawValue::Vector(vec![1.0, 2.0])));
    plant.bridge().publish(other).unwrap();
    plant.bridge().flush();
    let birth = plant.seen(BIRTH);
    let list = metric(&birth, "other");
    assert_eq!((&list["value"], &list["datatype"]), (&json!([1.0, 2.0]), &json!(31)));
}

#[test]
fn the_sequence_goes_to_255_and_begins_anew() {
    let Some(mut plant) = Plant::new("") else { return };
    open(&mut plant);
    full_birth(&mut plant);
    for number in 0..300_u32 {
        publish(&mut plant, RawValue::Number(number.into()), Quality::Good);
    }
    let (mut expected, mut values) = (1, 0);
    while values < 300 {
        let data = plant.seen(DATA);
        assert_eq!(numbers(&data).0, Some(expected));
        expected = (expected + 1) % 256;
        for it in data["payload"]["metrics"].as_array().unwrap() {
            assert_eq!(it["value"], f64::from(values), "every value, in order");
            values += 1;
        }
    }
}

#[test]
fn the_will_tells_the_death_and_each_connection_has_a_number() {
    let Some(mut plant) = Plant::frail("") else { return };
    open(&mut plant);
    full_birth(&mut plant);
    publish(&mut plant, RawValue::Number(3.0), Quality::Good);
    plant.seen(DATA);
    plant.cut();
    let death = plant.seen(DEATH);
    assert_eq!(
        (numbers(&death), &death["qos"], &death["retain"]),
        ((None, Some(0)), &json!(1), &json!(false))
    );
    assert_eq!(death["payload"]["metrics"].as_array().unwrap().len(), 1);
    let birth = plant.seen(BIRTH);
    assert_eq!(numbers(&birth), (Some(0), Some(1)));
    assert_eq!(metric(&birth, "stop/dmin")["value"], 3.0);
    publish(&mut plant, RawValue::Number(4.0), Quality::Good);
    assert_eq!(numbers(&plant.seen(DATA)).0, Some(1));
    // The end in order: a death of its own, and the broker sends no will.
    drop(plant.bridge.take());
    assert_eq!(numbers(&plant.seen(DEATH)), (None, Some(1)));
    assert!(!plant.sees(DEATH));
}

#[test]
fn what_is_said_without_a_broker_is_in_the_next_birth() {
    let Some(mut plant) = Plant::new("") else { return };
    plant.broker.kill();
    let mut options = plant.options();
    options.mqtt.first_attempt = std::time::Duration::ZERO;
    let inbox = shsa_bridge::Inbox::new(8, shsa_bridge::Clock::running());
    let bridge = shsa_bridge::mqtt::sparkplug::SparkplugBridge::open(&options, inbox).unwrap();
    plant.bridge = Some(bridge);
    for number in 0..10 {
        publish(&mut plant, RawValue::Number(number.into()), Quality::Good);
    }
    plant.broker.restart();
    plant.peer = super::Script::start(
        &super::python().unwrap(),
        "sparkplug.py",
        &json!({ "port": plant.broker.port() }),
    );
    plant.order(&json!({ "follow": "spBv1.0/#" }));
    // The birth may have been sent before the consumer was there.
    let rebirth = json!({ "name": "Node Control/Rebirth", "type": "Boolean", "value": true });
    let birth = super::eventually("the birth", || {
        plant.peer.order(&json!({ "command": "Plant/healer", "metrics": [rebirth] }));
        plant.peer.poll("topic", std::time::Duration::from_millis(200)).filter(|it| it["topic"] == BIRTH)
    });
    assert_eq!(metric(&birth, "stop/dmin")["value"], 9.0);
}
