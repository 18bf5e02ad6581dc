//! `shsa` is killed while it serves a substitute.

use crate::broker::Broker;
use crate::plant::{Plant, longest_gap};
use crate::real::{self, free_port};
use crate::row::{Scenario, beside_others, shown};
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, model, router, settle, text, verdict, wait};
use serde_json::json;

const ALONE: Scenario = Scenario {
    number: 2,
    name: "killed while substituting, alone",
    done: "`kill -9` of the only instance while a substitute serves; started again with the same `--state` (MQTT)",
    promised: "goes on with the substitute; the wheel that lied is not trusted, and no value of it passes",
};
const WITH_ANOTHER: Scenario = Scenario {
    number: 3,
    name: "killed while substituting, one of two",
    done: "`kill -9` of the instance that serves, beside another (Zenoh)",
    promised: "the other one serves the substitute, without an order; told",
};

#[test]
fn what_had_failed_before_a_crash_serves_nothing_after_it() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let (model, address) = (model(&folder), format!("mqtt://127.0.0.1:{}", broker.port()));
    let state = text(&folder.path("state"));
    let start = || Running::start([&*model, "--bus", &address, "--state", &state]);
    let run = start();
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    settle(&run, &mut plant);

    let broken = plant.fault("wheel_1", "bias", 3.0);
    run.decision("failed");
    plant.first(broken, "a substitute", |seen| seen.is_substitute());
    wait(0.5);
    let killed = plant.now();
    run.kill();
    let started = plant.now();
    let run = start();
    let back = plant.first(started, "a substitute after the crash", |seen| seen.is_substitute());
    wait(2.0);

    let end = plant.now();
    let (_, state) = run.get("/state");
    assert_eq!(verdict(&state, "wheel_1"), "failed", "{state}");
    let after: Vec<_> = plant.seen().iter().filter(|seen| seen.at > started).cloned().collect();
    let of_the_broken = after.iter().filter(|seen| !seen.is_substitute() || seen.error() > 1.5).count();
    assert_eq!((of_the_broken, after.len() > 50), (0, true), "{after:?}");
    let gap = longest_gap(plant.seen(), killed - 0.5, end);
    ALONE.seen(&format!(
        "longest gap {}, of it {} from the new start; of {} values after it none was of the wheel that lied; it was `failed` \
         from the first moment on",
        shown(gap),
        shown(back.at - started),
        after.len(),
    ));
}

#[test]
fn another_instance_goes_on_with_the_substitute() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let (folder, port) = (Folder::new(), free_port());
    let (model, address) = (model(&folder), format!("zenoh://127.0.0.1:{port}"));
    let _router = router(&python, &json!({ "listen/endpoints": [format!("tcp/127.0.0.1:{port}")] }));
    let start = |name: &str| Running::start([&*model, "--bus", &address, "--name", name]);
    let mut runs = vec![start("one"), start("two")];
    let mut plant = Plant::start(&python, "zenoh", port, &WHEELS);
    runs.iter().for_each(|run| settle(run, &mut plant));
    let broken = plant.fault("wheel_1", "bias", 3.0);
    runs.iter().for_each(|run| assert_eq!(run.decision("failed")["signal"], "wheel_1"));
    let first = plant.first(broken, "a substitute", |seen| seen.is_substitute());
    wait(0.5);

    // The state of each instance lists the serving one first.
    let (_, state) = runs[0].get("/state");
    let serving =
        state["instances"]["chaos/speed"][0].as_str().unwrap().split('.').next().unwrap().to_owned();
    let at = usize::from(serving == "two");
    let killed = plant.now();
    runs.remove(at).kill();
    runs[0].decision("responsible");
    let other = plant.first(killed, "the other one", |seen| seen.publisher != first.publisher);
    wait(2.0);
    let end = plant.now();
    let gap = longest_gap(plant.seen(), killed - 0.5, end);
    assert!(other.is_substitute(), "{other:?}");
    let after: Vec<_> = plant.seen().iter().filter(|seen| seen.at > killed).cloned().collect();
    assert!(after.iter().all(|seen| seen.is_substitute() && seen.error() < 1.5), "{after:?}");
    WITH_ANOTHER.seen(&format!(
        "longest gap {}; the other one's first value {} after the kill; of {} values none was of the wheel that lied; \
         `responsible` told",
        shown(gap),
        shown(other.at - killed),
        after.len(),
    ));
}
