//! The command on real recordings: no alarm on clean ones; injected faults are named, and healthy signals are not.
//!
//! Recordings of others are not part of this project; without them these tests print SKIPPED.

mod faults;
mod calibrated;
mod drafted;

use serde_json::Value;
use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

const WORKSPACE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

const WHEELS: [&str; 4] = ["wheel_1", "wheel_2", "wheel_3", "wheel_4"];
const GNSS: &str = "gnss_ublox";

/// Kinds of events that accuse a signal for certain.
const NAMING: [&str; 2] = ["failed", "silent"];

/// A model with its recording.
struct Case {
    model: PathBuf,
    recording: PathBuf,
}

/// The case of a model; prints SKIPPED and returns `None` if the recording is missing.
fn case(model: &str, recording: &str) -> Option<Case> {
    let recording = Path::new(WORKSPACE).join("../shared/data").join(recording);
    if !recording.exists() {
        // The test harness would suppress its own output, so this is written directly.
        let _ = writeln!(std::io::stderr(), "SKIPPED: {model}: no recording at {}", recording.display());
        return None;
    }
    Some(Case { model: Path::new(WORKSPACE).join("models").join(model), recording })
}

fn car() -> Option<Case> {
    case("car.yaml", "comma2k19")
}

fn quad() -> Option<Case> {
    case("quad.yaml", "quad")
}

fn husky() -> Option<Case> {
    case("husky.yaml", "husky")
}

fn turtlebot() -> Option<Case> {
    case("turtlebot.yaml", "turtlebot3")
}

fn cell() -> Option<Case> {
    case("cell.yaml", "battery")
}

/// An event of a replay about a signal or need.
#[derive(Debug)]
struct Event {
    time_s: f64,
    kind: String,
    signal: Option<String>,
}

/// The JSON object of a replay.
struct Report(Value);

impl Case {
    fn replay(&self, faults: &[&str]) -> Report {
        self.replay_with(faults, &[])
    }

    fn replay_with(&self, faults: &[&str], more: &[&str]) -> Report {
        let injected = faults.iter().flat_map(|fault| ["--inject", fault]);
        report(
            Command::new(env!("CARGO_BIN_EXE_shsa"))
                .arg("replay")
                .arg(&self.model)
                .arg(&self.recording)
                .args(injected)
                .args(more),
        )
    }
}

/// Runs a replay with `--json`; an unmet need (status 1) is a valid answer, too.
fn report(command: &mut Command) -> Report {
    let output = command.arg("--json").output().unwrap();
    let reported = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{command:?}: {}\n{reported}", output.status);
    Report(serde_json::from_slice(&output.stdout).unwrap())
}

impl Report {
    fn events(&self) -> Vec<Event> {
        let text = |value: &Value| value.as_str().map(str::to_owned);
        let event = |event: &Value| Event {
            time_s: event["time_s"].as_f64().unwrap(),
            kind: text(&event["kind"]).unwrap(),
            signal: text(&event["signal"]),
        };
        self.0["events"].as_array().unwrap().iter().map(event).collect()
    }

    /// Signals with an event of one of these kinds.
    fn signals(&self, kinds: &[&str]) -> BTreeSet<String> {
        let reported = self.events().into_iter().filter(|event| kinds.contains(&&*event.kind));
        reported.filter_map(|event| event.signal).collect()
    }

    /// Seconds from a time to the first event that names the signal for certain.
    fn named_after(&self, signal: &str, start_s: f64) -> Option<f64> {
        let names =
            |event: &&Event| NAMING.contains(&&*event.kind) && event.signal.as_deref() == Some(signal);
        self.events().iter().find(names).map(|event| event.time_s - start_s)
    }

    fn need(&self, variable: &str, figure: &str) -> f64 {
        self.0["needs"][variable][figure].as_f64().unwrap_or(f64::INFINITY)
    }

    /// The report without the elapsed time.
    fn timeless(mut self) -> Value {
        self.0.as_object_mut().unwrap().remove("elapsed_s").unwrap();
        self.0
    }
}

fn set(signals: &[&str]) -> BTreeSet<String> {
    signals.iter().map(|&signal| signal.to_owned()).collect()
}

#[track_caller]
fn check_silent(case: Option<Case>) {
    let Some(case) = case else { return };
    let events = case.replay(&[]).events();
    let loud = |event: &&Event| ["failed", "silent", "substituted"].contains(&&*event.kind);
    assert_eq!(events.iter().filter(loud).count(), 0, "{events:?}");
}

#[test]
fn a_clean_drive_gives_no_alarm() {
    check_silent(car());
}

#[test]
fn a_clean_flight_gives_no_alarm() {
    check_silent(quad());
}

#[test]
fn a_clean_rover_gives_no_alarm() {
    check_silent(husky());
}

#[test]
fn a_clean_turtlebot_gives_no_alarm() {
    check_silent(turtlebot());
}

#[test]
fn a_clean_cell_gives_no_alarm() {
    check_silent(cell());
}

/// A labelled event: the readings in which a change was made at a mote, the motes of its room, the other motes.
struct Introduced {
    readings: std::ops::RangeInclusive<u64>,
    mote: &'static str,
    neighbour: &'static str,
}

const INTRODUCED: [Introduced; 2] = [
    Introduced { readings: 2344..=2460, mote: "mote_1", neighbour: "mote_2" },
    Introduced { readings: 2362..=2393, mote: "mote_4", neighbour: "mote_3" },
];

/// The number of the reading at a time: one every 5 s, from 1.
fn reading(event: &Event) -> u64 {
    (event.time_s / 5.0).round() as u64 + 1
}

#[test]
fn both_labelled_events_of_the_motes_are_found_and_nothing_else() {
    let Some(case) = case("motes.yaml", "suthaharan") else { return };
    let events = case.replay(&[]).events();
    for Introduced { readings, mote, neighbour } in &INTRODUCED {
        let of = |event: &&Event, mote: &str| {
            event.signal.as_deref().is_some_and(|signal| signal.starts_with(mote))
        };
        let accused = |event: &&Event| {
            ["suspected", "failed"].contains(&&*event.kind) && (of(event, mote) || of(event, neighbour))
        };
        let first = events.iter().find(accused).map(reading).unwrap();
        assert!(
            (*readings.start()..readings.start() + 3).contains(&first),
            "{mote} found at reading {first}"
        );
        let blamed = events.iter().find(|event| event.kind == "failed" && of(event, neighbour));
        assert!(blamed.is_none(), "{blamed:?}");
    }
    for event in &events {
        let belongs = |introduced: &Introduced| {
            (*introduced.readings.start()..=introduced.readings.end() + 10).contains(&reading(event))
        };
        assert!(INTRODUCED.iter().any(belongs), "reading {}: {event:?}", reading(event));
    }
}

#[track_caller]
fn check_repeats(case: &Case, faults: &[&str]) {
    let once = case.replay(faults).timeless();
    assert_eq!(once.to_string(), case.replay(faults).timeless().to_string());
}

#[test]
fn a_replay_repeats_byte_for_byte() {
    if let Some(case) = car() {
        check_repeats(&case, &["noise=3:wheel_1@20s..", "spike=5:gnss_ublox@30s.."]);
    }
    if let Some(case) = husky() {
        check_repeats(&case, &["noise=1:imu@100s.."]);
    }
}

/// A journal holds all inputs including injected faults, so its replay gives the same events.
#[track_caller]
fn check_journal(case: &Case, faults: &[&str], name: &str) {
    let journal = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let written = case.replay_with(faults, &["--journal", &journal.to_string_lossy()]);
    let replayed =
        report(Command::new(env!("CARGO_BIN_EXE_shsa")).arg("replay").arg(&case.model).arg(&journal));
    assert!(!written.events().is_empty());
    assert_eq!(written.0["events"].to_string(), replayed.0["events"].to_string());
    assert_eq!(written.0["observations"], replayed.0["observations"]);
}

#[test]
fn a_journal_replays_to_the_same_events() {
    if let Some(case) = car() {
        check_journal(&case, &["noise=3:wheel_1@20s..", "drop:gnss_ublox@30s.."], "car.journal");
    }
    if let Some(case) = husky() {
        check_journal(&case, &["drop:imu@100s.."], "husky.journal");
    }
}

/// The first accusation of a signal, as explained by `shsa explain`.
fn explained(case: &Case, signal: &str, fault: &str) -> Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_shsa"));
    command.arg("explain").arg(&case.model).arg(&case.recording).args([signal, "--inject", fault]);
    report(&mut command).0
}

#[test]
fn a_faulty_wheel_is_explained_by_the_others() {
    let Some(case) = car() else { return };
    let object = explained(&case, "wheel_1", "drift=1:wheel_1@20s..");
    assert_eq!(object["decision"], "failed", "{object}");
    let against = object["against"].as_array().unwrap();
    assert!(against.len() >= 2, "{object}");
    for comparison in against.iter().filter(|it| it["disagree"] == it["of"]) {
        let (own, other) = (&comparison["own"], &comparison["other"]);
        assert!(own["lo"].as_f64() > other["hi"].as_f64(), "{comparison}");
    }
    assert!(against.iter().all(|it| it["since_s"].as_f64() >= Some(20.0)), "{object}");
    let rivals = object["rivals"].as_array().unwrap();
    assert!(rivals.iter().all(|rival| rival["ruled_out"] == true), "{object}");
}

#[test]
fn what_a_rover_cannot_tell_apart_stays_open() {
    let Some(case) = husky() else { return };
    let object = explained(&case, "imu", "bias=0.5:imu@100s..");
    assert!(object["time_s"].as_f64() >= Some(100.0), "{object}");
    let open = object["rivals"].as_array().unwrap().iter().any(|rival| rival["ruled_out"] == false);
    assert_eq!(open, object["decision"] == "suspected", "{object}");
}
