//! The disk of journal and state is full for a while.

use crate::broker::Broker;
use crate::disk::Disk;
use crate::plant::{Plant, longest_gap};
use crate::real;
use crate::row::{Scenario, beside_others, shown};
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, model, settle, text, wait};
use serde_json::Value;
use std::fs;

const SCENARIO: Scenario = Scenario {
    number: 8,
    name: "full disk under journal and state",
    done: "a file system of 1 MiB filled to the last byte for 5 s; meanwhile a wheel lies; then there is space again",
    promised: "nothing is delayed; the journal waits in memory, and nothing of it is lost; no half state; told; goes on by itself",
};
/// Long enough to replace every older file, if each attempt replaced one.
const FULL: f64 = 5.0;

#[test]
fn a_full_disk_delays_nothing_and_costs_only_what_is_reported() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let disk = match Disk::mount(&folder.path("disk"), 1) {
        Ok(disk) => disk,
        Err(why) => return SCENARIO.skipped(&why),
    };
    let (model, address) = (model(&folder), format!("mqtt://127.0.0.1:{}", broker.port()));
    let (journal, state) = (text(&disk.path().join("journal")), text(&disk.path().join("state")));
    let kept = ["--journal-keep", "2"];
    let kept = kept.into_iter().chain(["--journal", &journal, "--state", &state]);
    let run = Running::start([&*model, "--bus", &address].into_iter().chain(kept));
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    settle(&run, &mut plant);
    // The journal that must be kept.
    wait(3.0);
    let whole = fs::read_to_string(format!("{state}/chaos.json")).unwrap();

    let older = fs::read_to_string(format!("{journal}/chaos.jsonl")).unwrap();
    let begun = plant.now();
    disk.fill();
    assert_eq!(run.decision("disk")["kind"], "disk");
    let broken = plant.fault("wheel_1", "bias", 3.0);
    let healed = plant.first(broken, "a substitute", |seen| seen.is_substitute());
    run.decision("failed");
    assert_eq!(fs::read_to_string(format!("{state}/chaos.json")).unwrap(), whole, "the state is as it was");
    wait(FULL);
    let end = plant.now();
    disk.free();
    let freed = plant.now();
    while !saved(&state) {
        assert!(plant.now() - freed < 10.0, "the state is never saved");
        wait(0.05);
    }
    let recovered = plant.now() - freed;
    wait(2.5);
    let received = run.get("/state").1["figures"]["messages"].as_u64().unwrap();
    wait(1.5);
    let (_, events) = run.get("/events");
    assert_eq!(run.stop().code(), Some(0));

    let gap = longest_gap(plant.seen(), begun, end);
    let reaction = healed.at - broken;
    let text = fs::read_to_string(format!("{journal}/chaos.jsonl")).unwrap();
    assert!(text.starts_with(&older), "what was written before is there");
    assert!(is_whole(&text), "{}", &text[text.len() - 200..]);
    let written = text.lines().filter(|line| line.contains("\"signal\"")).count() as u64;
    assert!(written >= received, "{written} written, {received} heard");
    // Saving the state failed once, and no input was lost.
    let of_state = ["the state could not be saved in ", "the state is saved again in "];
    assert_eq!(of_state.map(|words| told(&events, words)), [1, 1], "{events}");
    assert_eq!(told(&events, "what waited of the journal is written"), 1, "{events}");
    assert!(!events.to_string().contains("missing in the journal"), "{events}");
    SCENARIO.seen(&format!(
        "longest gap {}; first substitute {} after the first false value; all {received} messages are in the journal, which is one \
         whole file; the state was whole all the time, and saved {} after there was space; told: `disk` when it was full and when \
         what had waited was written",
        shown(gap),
        shown(reaction),
        shown(recovered),
    ));
}

/// Whether the saved state contains the verdict about the faulty wheel.
fn saved(folder: &str) -> bool {
    let text = fs::read_to_string(format!("{folder}/chaos.json")).unwrap();
    let state: Value = serde_json::from_str(&text).expect("the state is whole whenever it is read");
    state.to_string().contains("failed")
}

/// The number of events about the disk whose words begin so.
fn told(events: &Value, words: &str) -> usize {
    let is_it = |event: &&Value| {
        event["kind"] == "disk" && event["because"].as_str().is_some_and(|because| because.starts_with(words))
    };
    events.as_array().unwrap().iter().filter(is_it).count()
}

fn is_whole(journal: &str) -> bool {
    journal.ends_with('\n') && journal.lines().all(|line| serde_json::from_str::<Value>(line).is_ok())
}
