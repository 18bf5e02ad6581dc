//! The process is suspended, and what the sensors say meanwhile waits for it.

use crate::broker::Broker;
use crate::plant::Plant;
use crate::real;
use crate::row::{Scenario, beside_others, shown};
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, model, settle, wait};
use std::fs;

const SCENARIO: Scenario = Scenario {
    number: 10,
    name: "suspended",
    done: "`shsa run` suspended for 6 s, while 900 messages without stamps wait in the connection to Mosquitto",
    promised: "none of them is taken for one of now; served again by itself; told",
};
/// The sensors' speed changes by so much within a second at most, and a value is on its way for less than half of one.
const MOST_OFF: f64 = 0.05;

#[test]
fn what_has_waited_while_nobody_was_there_is_not_taken_for_new() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let model = model(&folder);
    let stamped = fs::read_to_string(&model).unwrap();
    fs::write(&model, stamped.replace("@at", "")).unwrap();
    let address = format!("mqtt://127.0.0.1:{}", broker.port());
    let run = Running::start([&*model, "--bus", &address]);
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    settle(&run, &mut plant);

    run.signal("-STOP");
    wait(6.0);
    let resumed = plant.now();
    run.signal("-CONT");
    let told = run.decision("absent");
    let because = told["because"].as_str().unwrap();
    let back = plant.first(resumed, "a good value afterwards", |seen| seen.is_good());
    wait(1.0);
    let now = plant.now();
    let seen: Vec<_> = plant.seen().iter().filter(|seen| (resumed..now).contains(&seen.at)).collect();
    let wrong = seen.iter().filter(|seen| seen.error() > MOST_OFF).count();
    assert_eq!(wrong, 0, "of {} values: {seen:?}", seen.len());
    assert!(because.starts_with("nobody was here for") && !because.contains(": 0 messages"), "{because}");
    SCENARIO.seen(&format!(
        "{wrong} of {} values were of earlier; {} after its end the consumer had a good value again; told: {because}",
        seen.len(),
        shown(back.at - resumed),
    ));
}
