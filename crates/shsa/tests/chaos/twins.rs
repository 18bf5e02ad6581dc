//! Two instances are started at the same time.

use crate::plant::{Plant, Seen};
use crate::real::{self, free_port};
use crate::row::{Scenario, beside_others};
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, model, router, wait};
use serde_json::json;
use std::collections::BTreeSet;

const SCENARIO: Scenario = Scenario {
    number: 9,
    name: "two instances started at once",
    done: "the same model twice at the same moment on one Zenoh router; under two names, and under the same name",
    promised: "after settling exactly one serves, and no value comes twice",
};

#[test]
fn of_two_that_start_at_once_exactly_one_serves() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let rows = [["one", "two"], ["same", "same"]].map(|names| {
        let (doubles, count) = started(&python, names);
        format!(
            "`{}` and `{}`: {doubles} values of the other one while they settled, then {count} of one alone, none twice",
            names[0], names[1]
        )
    });
    SCENARIO.seen(&rows.join("; "));
}

/// The number of values of the instance that stops serving, and the number of values of the other one afterwards.
fn started(python: &std::path::Path, names: [&str; 2]) -> (usize, usize) {
    let (folder, port) = (Folder::new(), free_port());
    let (model, address) = (model(&folder), format!("zenoh://127.0.0.1:{port}"));
    let _router = router(python, &json!({ "listen/endpoints": [format!("tcp/127.0.0.1:{port}")] }));
    let mut plant = Plant::start(python, "zenoh", port, &WHEELS);
    let runs = std::thread::scope(|scope| {
        names
            .map(|name| scope.spawn(|| Running::start([&*model, "--bus", &address, "--name", name])))
            .map(|run| run.join().unwrap())
    });
    for run in &runs {
        run.until("both know of each other", |state| {
            state["instances"]["chaos/speed"].as_array().is_some_and(|able| able.len() == 2)
        });
    }
    let known = plant.now();
    wait(3.0);
    let seen = plant.seen();
    let publishers = |from: f64| -> BTreeSet<&str> {
        seen.iter().filter(|seen| seen.at > from).map(|seen| &*seen.publisher).collect()
    };
    let last = &*seen.last().unwrap().publisher;
    let first = seen.first().unwrap().at;
    let settled = seen.iter().rev().find(|seen| seen.publisher != last).map_or(first, |seen| seen.at);
    // Messages under way when they learnt of each other may still arrive.
    assert!(publishers(known + 0.5).len() == 1, "{:?}", publishers(known + 0.5));
    let after: Vec<&Seen> = seen.iter().filter(|seen| seen.at > settled).collect();
    let stamps: BTreeSet<u64> = after.iter().map(|seen| seen.stamp_s.to_bits()).collect();
    assert_eq!(stamps.len(), after.len(), "a value came twice");
    assert!(after.len() > 100, "{}", after.len());
    let doubles = seen.iter().filter(|seen| seen.publisher != last).count();
    (doubles, after.len())
}
