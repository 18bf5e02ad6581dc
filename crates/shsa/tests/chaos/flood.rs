//! A publisher floods its topic.

use crate::broker::Broker;
use crate::plant::Plant;
use crate::real;
use crate::row::{Scenario, alone, shown};
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, is_trusted, model, settle, wait};
use serde_json::{Value, json};
use std::thread;

const SCENARIO: Scenario = Scenario {
    number: 7,
    name: "a publisher at 100 kHz",
    done: "one wheel published at 100 kHz for 4 s (MQTT); meanwhile another wheel lies",
    promised: "healing is not delayed; every message is heard or counted as dropped, and that is told",
};
const RATE: u64 = 100_000;
const SECONDS: u64 = 4;
/// More messages than the wheel itself sends while a part is waited for.
const PART: u64 = 20_000;

#[test]
fn a_flood_of_one_signal_does_not_delay_the_healing_of_others() {
    let Some(python) = real::python() else { return };
    let _turn = alone();
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let (model, address) = (model(&folder), format!("mqtt://127.0.0.1:{}", broker.port()));
    let run = Running::start([&*model, "--bus", &address]);
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    let mut wild = Plant::start(&python, "mqtt", broker.port(), &[]);
    settle(&run, &mut plant);
    let calm = reaction(&run, &mut plant);
    plant.fault("wheel_1", "none", 0.0);
    run.until("the wheel is trusted again", |state| is_trusted(state, "wheel_1"));
    settle(&run, &mut plant);
    run.decisions();
    let before = taken(&run.get("/state").1);

    let order = json!({ "flood": "chaos/wheel_3", "rate": RATE, "seconds": SECONDS });
    let flood = thread::spawn(move || wild.answer(&order, "sent"));
    wait(2.0);
    let wild = reaction(&run, &mut plant);
    let flood = flood.join().unwrap();
    let sent = flood["sent"].as_u64().unwrap();
    let state = all(&run, before, sent);
    let dropped = state["dropped"]["chaos/wheel_3"].as_u64().unwrap_or(0);
    wait(1.5);
    let (_, events) = run.get("/events");
    let is_reported = events.as_array().unwrap().iter().any(|event| event["kind"] == "overload");
    assert_eq!(is_reported, dropped > 0, "{state}");
    SCENARIO.seen(&format!(
        "{:.0} messages a second were sent; from the first false value to the first substitute {}, without the flood {}; of \
         {sent} messages {} were heard, {dropped} dropped{}",
        sent as f64 / flood["seconds"].as_f64().unwrap(),
        shown(wild),
        shown(calm),
        sent - dropped,
        if is_reported { " and told" } else { "" },
    ));
}

/// From the first false value of a wheel to the first substitute at the consumer, seconds.
fn reaction(run: &Running, plant: &mut Plant) -> f64 {
    let broken = plant.fault("wheel_1", "bias", 3.0);
    let healed = plant.first(broken, "a substitute", |seen| seen.is_substitute());
    // The flood itself may be detected as a fault, too.
    while run.decision("failed")["signal"] != "wheel_1" {}
    healed.at - broken
}

/// The number of the flooding wheel's messages so far, received or dropped.
fn taken(state: &Value) -> u64 {
    let signal = &state["models"]["chaos"]["signals"]["wheel_3"];
    let kinds = ["accepted", "dropped", "late", "out_of_order", "invalid", "out_of_range"];
    let received: u64 = kinds.iter().map(|kind| signal[*kind].as_u64().unwrap()).sum();
    received + state["dropped"]["chaos/wheel_3"].as_u64().unwrap_or(0)
}

/// The state after everything sent has arrived. A slow machine may take long for all, but not for each part.
fn all(run: &Running, before: u64, sent: u64) -> Value {
    let mut heard = before;
    loop {
        let goal = (before + sent).min(heard + PART);
        let state = run.until("what was sent is heard or dropped", |state| taken(state) >= goal);
        heard = taken(&state);
        if heard >= before + sent {
            return state;
        }
    }
}
