//! The disk under journal and state is full, and then it is not.

use crate::broker::Broker;
use crate::plant::{Plant, longest_gap};
use crate::real;
use crate::row::{Scenario, beside_others, shown};
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, model, settle, system, text, wait};
use serde_json::Value;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

const SCENARIO: Scenario = Scenario {
    number: 8,
    name: "full disk under journal and state",
    done: "a file system of 1 MiB filled to the last byte for 5 s; meanwhile a wheel lies; then there is space again",
    promised: "nothing is delayed; what is missing is counted and told; no half state, no older journal lost; goes on by itself",
};
/// Longer than it takes to push out every older file, if each attempt took a place.
const FULL: f64 = 5.0;

/// A file system of 1 MiB in memory; gone with this value.
struct Disk(PathBuf);

impl Disk {
    fn mount(place: &Path) -> Result<Disk, String> {
        fs::create_dir_all(place).unwrap();
        system(&format!("mount -t tmpfs -o size=1m tmpfs {}", place.display()))?;
        Ok(Disk(place.to_owned()))
    }

    /// Leaves not a byte.
    fn fill(&self) {
        let mut ballast = File::create(self.0.join("ballast")).unwrap();
        for size in [4096, 1] {
            while ballast.write(&vec![0; size]).is_ok_and(|written| written > 0) {}
        }
    }

    fn free(&self) {
        fs::remove_file(self.0.join("ballast")).unwrap();
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_full_disk_delays_nothing_and_costs_only_what_is_told() {
    let Some(python) = real::python() else { return };
    let _turn = beside_others();
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let disk = match Disk::mount(&folder.path("disk")) {
        Ok(disk) => disk,
        Err(why) => return SCENARIO.skipped(&why),
    };
    let (model, address) = (model(&folder), format!("mqtt://127.0.0.1:{}", broker.port()));
    let (journal, state) = (text(&disk.0.join("journal")), text(&disk.0.join("state")));
    let kept = ["--journal-keep", "2"];
    let kept = kept.into_iter().chain(["--journal", &journal, "--state", &state]);
    let run = Running::start([&*model, "--bus", &address].into_iter().chain(kept));
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    settle(&run, &mut plant);
    // The journal that must not be lost.
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
    let heard = run.get("/state").1["figures"]["messages"].as_u64().unwrap();
    wait(1.5);
    let (_, events) = run.get("/events");
    let missing: u64 = events.as_array().unwrap().iter().filter_map(missing).sum();
    assert_eq!(run.stop().code(), Some(0));

    let gap = longest_gap(plant.seen(), begun, end);
    let reaction = healed.at - broken;
    let journals: Vec<String> = ["chaos.1.jsonl", "chaos.jsonl"]
        .map(|name| fs::read_to_string(format!("{journal}/{name}")).unwrap())
        .into();
    assert!(journals[0].starts_with(&older), "the older journal is there");
    let written: usize =
        journals.iter().map(|text| text.lines().filter(|line| line.contains("\"signal\"")).count()).sum();
    journals.iter().for_each(|text| assert!(is_whole(text), "{}", &text[text.len() - 200..]));
    assert!(written as u64 + missing >= heard, "{written} written, {missing} missing, {heard} heard");
    SCENARIO.seen(&format!(
        "longest gap {}; first substitute {} after the first false value; {missing} inputs told as missing, {written} in the \
         journals, none of {heard} messages unaccounted for; the older journal is there, each ends with a whole line; the state \
         was whole all the time, and saved {} after there was space",
        shown(gap),
        shown(reaction),
        shown(recovered),
    ));
}

/// Whether the state on the disk knows of the wheel that lies.
fn saved(folder: &str) -> bool {
    let text = fs::read_to_string(format!("{folder}/chaos.json")).unwrap();
    let state: Value = serde_json::from_str(&text).expect("the state is whole whenever it is read");
    state.to_string().contains("failed")
}

/// How many inputs an event tells as missing.
fn missing(event: &Value) -> Option<u64> {
    let because = event["because"].as_str().filter(|_| event["kind"] == "disk")?;
    because.split(' ').next()?.parse().ok()
}

fn is_whole(journal: &str) -> bool {
    journal.ends_with('\n') && journal.lines().all(|line| serde_json::from_str::<Value>(line).is_ok())
}
