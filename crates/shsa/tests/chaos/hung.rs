//! Of two instances, the one that serves is suspended: it still holds its tokens. And strangers claim a need, publish under its name and
//! declare the instance to be gone.

use crate::broker::Broker;
use crate::plant::{Plant, Seen};
use crate::real::{self, Script, free_port};
use crate::row::beside_others;
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, model, router, settle};
use serde_json::{Value, json};
use std::path::Path;

/// The next decision of this kind whose reason contains some words.
#[track_caller]
fn decision(run: &Running, kind: &str, words: &str) -> Value {
    for _ in 0..100 {
        let decision = run.decision(kind);
        if decision["because"].as_str().unwrap().contains(words) {
            return decision;
        }
    }
    panic!("no `{kind}` with `{words}`")
}

/// The owner hangs for longer than the age of the need, and goes on.
fn an_owner_hangs(python: &Path, bus: &str, port: u16) {
    let folder = Folder::new();
    let (model, address) = (model(&folder), format!("{bus}://127.0.0.1:{port}"));
    let runs = ["first", "second"].map(|name| Running::start([&*model, "--bus", &address, "--name", name]));
    let mut plant = Plant::start(python, bus, port, &WHEELS);
    for run in &runs {
        settle(run, &mut plant);
        // After the probation, both hold the second token.
        run.until("it has had values for the probation", |state| {
            state["models"]["chaos"]["needs"]["speed"]["published"].as_u64() > Some(350)
                && state["instances"]["chaos/speed"].as_array().is_some_and(|able| able.len() == 2)
        });
    }
    let state = runs[0].get("/state").1;
    let owns = |name: &str| state["instances"]["chaos/speed"][0].as_str().unwrap().starts_with(name);
    let [owner, other] = if owns("first.") { [&runs[0], &runs[1]] } else { [&runs[1], &runs[0]] };
    let from = plant.now();
    let before = plant.first(from, "the owner's value", |_| true).publisher;

    let stopped = plant.now();
    owner.signal("-STOP");
    let is_other = |seen: &Seen| seen.publisher != before;
    decision(other, "responsible", "no value has arrived here");
    let after = plant.first(stopped, "a value of the other one", is_other);
    plant.first(after.at + 1.0, "more of it", is_other);
    assert_eq!(other.get("/health").0, 200);

    // Who comes back knows less than the one that serves; after its probation it gets the need back.
    owner.signal("-CONT");
    decision(owner, "released", "is served by");
    decision(owner, "responsible", "is served by this instance from now on");
    decision(other, "released", "is served by");
    let last = plant.now();
    plant.first(last + 0.5, "a good value of the first owner", |seen| {
        seen.publisher == before && seen.is_good()
    });
    let wrong = plant.seen().iter().filter(|seen| seen.is_good() && seen.error() > 1.5).count();
    assert_eq!(wrong, 0);
}

#[test]
fn an_owner_that_hangs_is_replaced_over_mqtt() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let broker = Broker::start(&[]);
    an_owner_hangs(&python, "mqtt", broker.port());
}

#[test]
fn an_owner_that_hangs_is_replaced_over_zenoh() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let port = free_port();
    let _router = router(&python, &json!({ "listen/endpoints": [format!("tcp/127.0.0.1:{port}")] }));
    an_owner_hangs(&python, "zenoh", port);
}

#[test]
fn strangers_stop_no_need_and_are_told() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let (model, address) = (model(&folder), format!("mqtt://127.0.0.1:{}", broker.port()));
    let run = Running::start([&*model, "--bus", &address, "--name", "healer"]);
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    settle(&run, &mut plant);
    let stranger = json!({ "name": "stranger", "port": broker.port() });
    let mut stranger = Script::start(&python, "../../../shsa-bridge/tests/python/mqtt_client.py", &stranger);

    // One of ten names has a higher rank than the instance, but for one time in a thousand.
    for at in 0..10 {
        let claims = ["healer", "settled"].map(|token| format!("shsa/{token}/x{at}.0000000{at}/chaos/speed"));
        stranger.order(&json!({ "publish": format!("shsa/x{at}/claims"), "text": claims.join("\n") }));
    }
    run.until("it knows of the claims", |state| {
        state["instances"]["chaos/speed"].as_array().is_some_and(|able| able.len() == 11)
    });
    let claimed = plant.now();
    plant.first(claimed + 2.0, "a value in spite of the claims", Seen::is_good);
    assert!(run.decisions().iter().all(|it| it["kind"] != "released"));

    stranger.order(&json!({ "publish": "chaos/speed", "text": "77" }));
    let told = run.decision("stranger");
    assert!(told["because"].as_str().unwrap().contains("publishes under chaos/speed"), "{told}");
    assert_eq!(run.get("/state").1["strangers"], json!({ "chaos/speed": 1 }));

    let hex = |text: &str| text.bytes().map(|byte| format!("{byte:02x}")).collect::<String>();
    stranger.order(&json!({ "subscribe": "shsa/healer/status" }));
    assert_eq!(stranger.next_with("topic")["hex"], json!(hex("online")));
    stranger.order(&json!({ "publish": "shsa/healer/status", "text": "offline", "retain": true }));
    for expected in ["offline", "online"] {
        assert_eq!(stranger.next_with("topic")["hex"], json!(hex(expected)));
    }
    decision(&run, "trouble", "somebody else has published \"offline\" on `shsa/healer/status`");
}
