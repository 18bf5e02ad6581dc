//! The wall clock of the instance and the sensors is set by an hour, both ways.

use crate::broker::Broker;
use crate::plant::{Plant, Seen, longest_gap};
use crate::real;
use crate::row::{Scenario, alone, shown};
use crate::running::{Folder, Running};
use crate::scene::{WHEELS, kinds_of, model, settle, under, wait};
use serde_json::Value;
use std::fs;
use std::path::Path;

const SCENARIO: Scenario = Scenario {
    number: 5,
    name: "clock stepped by an hour, both ways",
    done: "the wall clock of instance, sensors and consumer set an hour ahead, then an hour behind (libfaketime), with \
           stamps in every message",
    promised: "no false fault, no gap; told; stamps of what is published follow the wall clock",
};
const HOUR: f64 = 3600.0;
/// This many values in a row, or fewer, are no step of the clock.
const GLITCH: usize = 5;
/// The folder in which Debian has a folder for each architecture.
const LIBRARIES: &str = "/usr/lib";

#[test]
fn a_step_of_the_wall_clock_is_no_fault() {
    let Some(python) = real::python() else { return };
    let Some(library) = library() else {
        return SCENARIO.skipped("libfaketime is absent; `cargo xtask test` installs it");
    };
    let _turn = alone();
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let offset = folder.path("offset");
    let settings = settings(&library, &offset);
    let env: Vec<&str> = ["env"].into_iter().chain(settings.iter().map(String::as_str)).collect();
    let python = under(&folder, "python", &env, &python);
    let (model, address) = (model(&folder), format!("mqtt://127.0.0.1:{}", broker.port()));
    let run = Running::start_under(&env, [&*model, "--bus", &address]);
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    settle(&run, &mut plant);
    run.decisions();

    let begun = plant.now();
    wait(1.0);
    for step in ["+3600", "-3600"] {
        set(&offset, step);
        wait(2.5);
    }
    let end = plant.now();
    // A busy machine can delay the sensors, which makes them silent; besides this silence, only the steps of the clock may be
    // told.
    let mut decisions = run.decisions();
    decisions.retain(|decision| !is_of_silence(decision));
    let kinds = kinds_of(&decisions);
    assert_eq!(kinds, ["clock", "clock"], "{decisions:?}");
    let seen: Vec<_> = plant.seen().iter().filter(|seen| seen.at > begun).cloned().collect();
    let wall = |seen: &Seen| seen.wall_s - seen.at;
    let hours: Vec<f64> = seen.iter().map(|it| ((wall(it) - wall(&seen[0])) / HOUR).round()).collect();
    // libfaketime sometimes misses the file for a moment.
    let lasting =
        hours.chunk_by(|one, next| one == next).filter(|hour| hour.len() > GLITCH).map(|hour| hour[0]);
    let mut lasting: Vec<f64> = lasting.collect();
    lasting.dedup();
    assert_eq!(lasting, [0.0, 1.0, -1.0]);
    // When a busy machine delays a sensor, another one stands in.
    let good = seen.iter().filter(|seen| seen.is_good()).count();
    let stood_in = seen.iter().filter(|seen| seen.is_substitute()).count();
    let gap = longest_gap(&seen, begun, end);
    // There are 50 values a second for six seconds.
    assert!(seen.len() > 100, "{} values", seen.len());
    assert_eq!(good + stood_in, seen.len());
    // A message takes some milliseconds to the consumer, on a busy machine a second; the clock may step meanwhile.
    let strange: Vec<_> =
        seen.iter().filter(|seen| (seen.wall_s - seen.stamp_s).abs() > HOUR / 2.0).collect();
    let stepped = |pair: &&[Seen]| (wall(&pair[1]) - wall(&pair[0])).abs() > HOUR - 1.0;
    let stepped: Vec<f64> = seen.windows(2).filter(stepped).map(|pair| pair[1].at).collect();
    let was_on_its_way = |seen: &Seen| stepped.iter().any(|step| (0.0..2.0).contains(&(seen.at - step)));
    assert!(strange.iter().all(|seen| was_on_its_way(seen)), "{stepped:?} {strange:?}");
    SCENARIO.seen(&format!(
        "longest gap {}; {good} values `Good`, {stood_in} of who stood in for a late sensor, no event but `clock` twice; {} \
         values on their way at a step have the stamp of before, the others follow the wall clock",
        shown(gap),
        strange.len(),
    ));
}

/// The clock of the instance is set, as after a boot without a network, and those of the sensors are not.
#[test]
fn a_step_of_the_own_clock_alone_accuses_nobody() {
    let Some(python) = real::python() else { return };
    let Some(library) = library() else {
        return SCENARIO.skipped("libfaketime is absent; `cargo xtask test` installs it");
    };
    let _turn = alone();
    let (broker, folder) = (Broker::start(&[]), Folder::new());
    let offset = folder.path("offset");
    let settings = settings(&library, &offset);
    let env: Vec<&str> = ["env"].into_iter().chain(settings.iter().map(String::as_str)).collect();
    let (model, address) = (model(&folder), format!("mqtt://127.0.0.1:{}", broker.port()));
    let run = Running::start_under(&env, [&*model, "--bus", &address]);
    let mut plant = Plant::start(&python, "mqtt", broker.port(), &WHEELS);
    settle(&run, &mut plant);
    run.decisions();
    for step in ["+3", "-3"] {
        let before = plant.now();
        set(&offset, step);
        run.decision("clock");
        // Stamps of before the step may be on their way for two seconds.
        plant.first(before + 4.0, "a value after the step", |seen| seen.error() < 1.5);
    }
    let mut decisions = run.decisions();
    decisions.retain(|decision| !is_of_silence(decision));
    assert_eq!(kinds_of(&decisions), [""; 0], "{decisions:?}");
}

/// The environment in which the file has the wall clock's offset.
fn settings(library: &str, offset: &Path) -> [String; 4] {
    fs::write(offset, "+0").unwrap();
    [
        format!("LD_PRELOAD={library}"),
        format!("FAKETIME_TIMESTAMP_FILE={}", offset.display()),
        "FAKETIME_DONT_FAKE_MONOTONIC=1".to_owned(),
        "FAKETIME_NO_CACHE=1".to_owned(),
    ]
}

/// Whether a decision reports that a sensor became silent, published again, or was replaced meanwhile; or that all sensors were
/// delayed.
fn is_of_silence(decision: &Value) -> bool {
    let because = decision["because"].as_str().unwrap_or_default();
    decision["symptom"] == "silent"
        || because.starts_with("it has given values again")
        || because.starts_with("no value for")
        || because == "it is served again"
        || because.starts_with("its source gives values again")
        || decision["kind"] == "substituted"
}

/// Replaces the file at once, because it is read all the time.
fn set(offset: &Path, step: &str) {
    let beside = offset.with_extension("new");
    fs::write(&beside, step).unwrap();
    fs::rename(&beside, offset).unwrap();
}

fn library() -> Option<String> {
    let folders = fs::read_dir(LIBRARIES).ok()?.flatten();
    let mut places = folders.map(|folder| folder.path().join("faketime/libfaketime.so.1"));
    places.find(|place| place.exists()).map(|place| place.display().to_string())
}
