//! The claims of clients, as seen by others.

use super::{VERSIONS, client, open, versioned};
use crate::broker::{Broker, Cut};
use crate::contract::until;
use crate::real::python;
use serde_json::{Value, json};
use shsa_bridge::mqtt::{MqttBridge, Options, Presence, Version};
use shsa_bridge::{Attendance, Bridge, Link, Outgoing, Payload, Presence as Seen};
use shsa_core::time::Time;

/// A client with claims, on this port.
fn claiming(broker: &Broker, name: &str, version: Version, port: u16) -> MqttBridge {
    let (here, gone) = ("online".into(), "offline".into());
    let presence = Some(Presence { topic: format!("shsa/{name}/status"), here, gone });
    let claims = Some(name.to_owned());
    open(&Options { presence, claims, port, ..versioned(broker, name, version) })
}

#[track_caller]
fn next(attendance: &mut Attendance) -> Seen {
    let mut seen = None;
    until("a change", || {
        seen = attendance();
        seen.is_some()
    });
    seen.unwrap()
}

#[test]
fn a_claim_is_heard_of_until_it_is_dropped_or_its_client_is_gone() {
    for version in VERSIONS {
        let broker = Broker::start(&[]);
        let cut = Cut::before(broker.port());
        let one = claiming(&broker, "one", version, cut.port);
        let (first, _second) = (one.attend("a/first").unwrap(), one.attend("b/second").unwrap());
        let mut own = one.attendance("a/**").unwrap().unwrap();
        assert_eq!(next(&mut own), Seen::Alive("a/first".into()), "{version:?}");
        // A later client receives them, too.
        let two = claiming(&broker, "two", version, broker.port());
        let mut attendance = two.attendance("a/**").unwrap().unwrap();
        assert_eq!(next(&mut attendance), Seen::Alive("a/first".into()));
        let third = one.attend("a/third").unwrap();
        assert_eq!(next(&mut attendance), Seen::Alive("a/third".into()));
        drop(first);
        assert_eq!(next(&mut attendance), Seen::Gone("a/first".into()));
        // The broker reports that the client is gone; then the client comes back.
        cut.cut();
        assert_eq!(next(&mut attendance), Seen::Gone("a/third".into()));
        assert_eq!(next(&mut attendance), Seen::Alive("a/third".into()));
        drop(one);
        assert_eq!(next(&mut attendance), Seen::Gone("a/third".into()));
        drop(third);
        // Nothing was left behind: a new client receives only the present claims.
        let three = claiming(&broker, "three", version, broker.port());
        let mut attendance = three.attendance("a/**").unwrap().unwrap();
        let _only = two.attend("a/only").unwrap();
        assert_eq!(next(&mut attendance), Seen::Alive("a/only".into()), "{version:?}");
    }
}

#[test]
fn a_claim_is_kept_by_the_broker_for_seconds_only_and_taken_back_at_the_end() {
    let Some(python) = python() else { return };
    let broker = Broker::start(&[]);
    let one = claiming(&broker, "one", Version::V5, broker.port());
    let _held = (one.attend("a/first").unwrap(), one.attend("b/second").unwrap());
    let claims = |name: &str, is_wanted: &dyn Fn(&Value) -> bool| {
        let mut other = client(&python, &broker, name);
        other.order(&json!({"subscribe": "shsa/one/claims"}));
        let mut received = Value::Null;
        until("the claims", || {
            received = other.next_with("topic");
            is_wanted(&received)
        });
        received
    };
    let both: String = "a/first\nb/second".bytes().map(|byte| format!("{byte:02x}")).collect();
    let kept = claims("early", &|received| received["retain"] == true && received["hex"] == json!(both));
    let expiry = kept["expiry"].as_u64().unwrap();
    assert!((1..=8).contains(&expiry), "{kept}");
    let again = claims("renewed", &|received| received["retain"] == false);
    assert_eq!((&again["hex"], &again["expiry"]), (&json!(both), &json!(8)));
    let mut other = client(&python, &broker, "late");
    other.order(&json!({"subscribe": "shsa/one/claims"}));
    drop(one);
    until("taken back", || other.next_with("topic")["hex"] == "");
}

/// A broker that stops publishes the last will of a client to the client itself.
#[test]
fn the_own_last_will_is_no_forged_status_and_the_same_words_of_a_stranger_are() {
    for version in VERSIONS {
        let mut broker = Broker::start(&[]);
        let mut one = claiming(&broker, "one", version, broker.port());
        let (_claims, _held) = (one.attendance("a/**").unwrap(), one.attend("a/first").unwrap());
        // Who hears the claims knows that the status came before them.
        let watch = |broker: &Broker, name: &str| {
            let watcher = claiming(broker, name, version, broker.port());
            let mut claims = watcher.attendance("a/**").unwrap().unwrap();
            assert_eq!(next(&mut claims), Seen::Alive("a/first".into()), "{version:?}");
            watcher
        };
        let mut forged = Vec::new();
        for _stop in 0..3 {
            drop(watch(&broker, "watcher"));
            broker.end();
            until("the end", || one.link() != Link::Up);
            broker.restart();
            until("the connection", || one.link() == Link::Up);
            forged.extend(troubles(&mut one));
        }
        let mut stranger = watch(&broker, "stranger");
        forged.extend(troubles(&mut one));
        assert!(forged.is_empty(), "{version:?}: {forged:?}");
        let payload = Payload::Bytes("offline".into());
        stranger.publish(Outgoing::new("shsa/one/status", Time(0), payload)).unwrap();
        stranger.flush();
        until("the report", || {
            forged.extend(troubles(&mut one));
            !forged.is_empty()
        });
    }
}

/// What a client reports of forged words about itself.
fn troubles(client: &mut MqttBridge) -> Vec<String> {
    let all = client.troubles().into_iter().map(|trouble| trouble.to_string());
    all.filter(|trouble| trouble.contains("somebody else has published")).collect()
}
