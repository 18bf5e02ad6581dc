//! 100,000 invalid payloads.

use crate::broker::Broker;
use crate::plant::{Plant, longest_gap};
use crate::real;
use crate::row::{Scenario, alone, shown};
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, kinds_of, model, settle, verdict};
use serde_json::{Value, json};
use std::collections::BTreeSet;

const SCENARIO: Scenario = Scenario {
    number: 6,
    name: "100,000 garbage payloads",
    done: "random bytes, cut JSON, huge numbers, deep nesting, wrong UTF-8 at 10 kHz on the topics of two wheels and of a \
           counter, between their healthy values",
    promised: "each is counted as invalid; the healthy wheel serves on; no crash; flat memory; trusted again afterwards",
};
const COUNT: u64 = 100_000;
/// The signals whose topics get the payloads.
const HIT: [&str; 3] = ["wheel_1", "wheel_2", "counter"];
/// Room for the payloads of a second, so that none is dropped and each can be counted.
const QUEUE: &str = "10000";

#[test]
fn garbage_is_counted_and_healthy_values_are_served_on() {
    let Some(python) = real::python() else { return };
    let _turn = alone();
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let (model, address) = (model(&folder), format!("mqtt://127.0.0.1:{}", broker.port()));
    let run = Running::start([&*model, "--bus", &address, "--queue", QUEUE]);
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    let mut vandal = Plant::start(&python, "mqtt", broker.port(), &[]);
    settle(&run, &mut plant);
    let garbage = |count: u64, seed: u64| json!({ "garbage": HIT.map(|signal| format!("chaos/{signal}")), "count": count, "rate": 10_000, "seed": seed });
    // The first tenth allocates all memory that is ever needed.
    vandal.order(&garbage(COUNT / 10, 1));
    run.until("the first tenth is counted", |state| counted(state) >= COUNT / 10);
    let (before, begun) = (memory(&run), plant.now());
    vandal.order(&garbage(COUNT - COUNT / 10, 2));
    let state = run.until("all is counted", |state| counted(state) >= COUNT);
    let (after, end) = (memory(&run), plant.now());

    assert_eq!(counted(&state), COUNT, "{state}");
    run.until("all are trusted again", |state| WHEELS.iter().all(|wheel| verdict(state, wheel) == "healthy"));
    let decisions = run.decisions();
    let gap = longest_gap(plant.seen(), begun, end);
    let wrong = plant.seen().iter().filter(|seen| seen.error() > 1.0).count();
    assert_eq!(wrong, 0, "{decisions:?}");
    let grown = after.saturating_sub(before);
    assert!(grown < 8 << 10, "{before} KiB, then {after} KiB");
    SCENARIO.seen(&format!(
        "{} counted; longest gap {}, no wrong value; memory {:.0} MiB, grown by {:.1} MiB; told: {}",
        counted(&state),
        shown(gap),
        after as f64 / 1024.0,
        grown as f64 / 1024.0,
        kinds_of(&decisions).into_iter().collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>().join(", "),
    ));
}

/// The number of payloads without a value, and of dropped ones.
fn counted(state: &Value) -> u64 {
    let of = |name: &str| {
        let signal = &state["models"]["chaos"]["signals"][name];
        let invalid = signal["invalid"].as_u64().unwrap() + signal["out_of_range"].as_u64().unwrap();
        invalid + state["dropped"][format!("chaos/{name}")].as_u64().unwrap_or(0)
    };
    HIT.iter().map(|name| of(name)).sum()
}

/// The process's memory in KiB.
fn memory(run: &Running) -> u64 {
    let status = run.process("status");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}
