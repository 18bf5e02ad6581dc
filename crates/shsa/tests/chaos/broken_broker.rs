//! The broker is killed and started again.

use crate::broker::Broker;
use crate::plant::Plant;
use crate::real;
use crate::row::{Scenario, beside_others, shown};
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, model, settle, text, wait};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

const SCENARIO: Scenario = Scenario {
    number: 1,
    name: "broker killed and restarted",
    done: "Mosquitto killed with -9 while it keeps 200 messages for an instance that does not read; started again after 2 s",
    promised: "nothing is lost that the broker has confirmed; served again by itself; told",
};
/// Messages confirmed by the broker when it is killed.
const KEPT: u64 = 200;

#[test]
fn a_broker_that_is_killed_costs_nothing_that_it_had_confirmed() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let (mut broker, folder) = (Broker::start(&[]), Folder::new());
    let (address, journal) =
        (format!("mqtt://127.0.0.1:{}?session=60", broker.port()), folder.path("journal"));
    let run = Running::start([&*model(&folder), "--bus", &address, "--journal", &text(&journal)]);
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    settle(&run, &mut plant);

    run.signal("-STOP");
    plant.order(&json!({ "burst": "chaos/counter", "count": KEPT }));
    // Mosquitto writes its store once a second.
    wait(1.5);
    let killed = plant.now();
    broker.kill();
    run.signal("-CONT");
    run.decision("disconnected");
    wait(2.0);
    let restarted = plant.now();
    broker.restart();
    run.decision("connected");
    let back = plant.first(restarted, "a good value after the restart", |seen| seen.is_good());
    let state = run.until("all that was kept has come", |state| counted(state) >= KEPT);
    run.stop();

    let received = numbers(&journal.join("chaos.jsonl"));
    let lost = (0..KEPT).filter(|number| !received.contains(number)).count();
    assert_eq!(lost, 0, "{received:?}");
    let recovery = back.at - restarted;
    assert!(recovery < 5.0, "{recovery}");
    let twice = counted(&state) - KEPT;
    SCENARIO.seen(&format!(
        "{lost} of {KEPT} lost, {twice} came twice; the broker was away for {}, {} after its start the consumer had a good \
         value again; `disconnected`, `connected` told",
        shown(restarted - killed),
        shown(recovery),
    ));
}

/// The number of the counter's messages taken in, valid or not.
fn counted(state: &Value) -> u64 {
    let counter = &state["models"]["chaos"]["signals"]["counter"];
    ["accepted", "dropped", "late", "out_of_order"].iter().map(|kind| counter[kind].as_u64().unwrap()).sum()
}

/// The values of the counter in a journal; the counter is its fourth signal.
fn numbers(journal: &Path) -> BTreeSet<u64> {
    let text = fs::read_to_string(journal).unwrap();
    let lines = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    lines.filter(|line| line["signal"] == 3).map(|line| line["value"].as_f64().unwrap() as u64).collect()
}
