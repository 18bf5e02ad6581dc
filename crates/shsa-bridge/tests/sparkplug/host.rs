//! The host application, as edge nodes see it.

use super::{Plant, eventually};
use serde_json::{Value, json};
use shsa_bridge::Bridge;
use std::time::Duration;

const STATE: &str = "spBv1.0/STATE/scada";

/// Whether the state says online, and its time.
fn state(message: &Value) -> (bool, u64) {
    let text: Value = serde_json::from_str(message["text"].as_str().unwrap()).unwrap();
    assert_eq!(text.as_object().unwrap().len(), 2, "{text}");
    (text["online"].as_bool().unwrap(), text["timestamp"].as_u64().unwrap())
}

#[test]
fn its_state_tells_whether_it_is_here() {
    let Some(mut plant) = Plant::frail("host=scada") else { return };
    plant.open();
    let here = plant.seen(STATE);
    assert_eq!((&here["qos"], state(&here).0), (&json!(1), true));
    plant.cut();
    let gone = plant.seen(STATE);
    assert_eq!((&gone["qos"], state(&gone)), (&json!(1), (false, state(&here).1)), "the time of its birth");
    let back = plant.seen(STATE);
    assert!(state(&back).0 && state(&back).1 > state(&here).1);
    // The broker may send the will of an earlier connection late.
    let late = json!({ "online": false, "timestamp": 1 }).to_string();
    let hex: String = late.bytes().map(|byte| format!("{byte:02x}")).collect();
    plant.order(&json!({ "raw": STATE, "hex": hex, "retain": true }));
    assert_eq!(state(&plant.seen(STATE)), (false, 1));
    assert_eq!(state(&plant.seen(STATE)), state(&back), "it corrects that");
    // The end in order; later clients get it, too.
    drop(plant.bridge.take());
    assert_eq!(state(&plant.seen(STATE)), (false, state(&back).1));
    plant.order(&json!({ "follow": STATE }));
    let kept = plant.seen(STATE);
    assert_eq!((&kept["retain"], state(&kept).0), (&json!(true), false));
}

/// The request for births that an edge node gets.
#[track_caller]
fn check_request(command: &Value, node: &str) {
    assert_eq!(
        (&command["command"], &command["qos"], &command["retain"]),
        (&json!(node), &json!(0), &json!(false))
    );
    let payload = &command["payload"];
    assert!(payload["timestamp"].is_u64() && payload["seq"].is_null(), "{payload}");
    let metric = &payload["metrics"][0];
    let expected = (&json!("Node Control/Rebirth"), &json!(true), &json!(11));
    assert_eq!((&metric["name"], &metric["value"], &metric["datatype"]), expected);
}

#[test]
fn it_asks_edge_nodes_that_it_does_not_know_for_their_births() {
    let Some(mut plant) = Plant::frail("") else { return };
    plant.order(&json!({ "connect": "Plant/Press", "bd_seq": 0 }));
    plant.open().subscribe("Plant/Press", None).unwrap();
    check_request(&plant.command(), "Plant/Press");
    let speed = json!({ "name": "Speed", "type": "Double", "value": 1.0 });
    plant.order(&json!({ "birth": [speed], "node": "Plant/Press" }));
    plant.order(&json!({ "data": [speed], "node": "Plant/Press" }));
    assert!(plant.peer.poll("command", Duration::from_millis(300)).is_none());
    // A message is missing: births are requested, and once is enough.
    plant.order(&json!({ "skip": "Plant/Press" }));
    plant.order(&json!({ "data": [speed], "node": "Plant/Press" }));
    check_request(&plant.command(), "Plant/Press");
    plant.order(&json!({ "birth": [speed], "node": "Plant/Press" }));
    // So they are after a break of our connection.
    plant.cut();
    check_request(&plant.command(), "Plant/Press");
}

#[test]
fn it_waits_for_a_missing_message_as_long_as_it_is_told_to() {
    let Some(mut plant) = Plant::new("reorder=1") else { return };
    plant.order(&json!({ "connect": "Plant/Press", "bd_seq": 0 }));
    plant.open().subscribe("Plant/Press", None).unwrap();
    plant.command();
    let speed = json!({ "name": "Speed", "type": "Double", "value": 1.0 });
    plant.order(&json!({ "birth": [speed], "node": "Plant/Press" }));
    plant.order(&json!({ "skip": "Plant/Press" }));
    let began = std::time::Instant::now();
    plant.order(&json!({ "data": [speed], "node": "Plant/Press" }));
    let command = eventually("the request", || {
        plant.bridge().receive();
        plant.peer.poll("command", Duration::from_millis(20))
    });
    check_request(&command, "Plant/Press");
    assert!(began.elapsed() >= Duration::from_secs(1));
}
