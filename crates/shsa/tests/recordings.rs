//! The command over real recordings: clean ones stay silent, injected faults are named, nothing healthy is.
//!
//! Recordings of others are not part of this project; without them these tests say that they were skipped.

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

/// A model with the recording that it is about.
struct Case {
    model: PathBuf,
    recording: PathBuf,
}

/// The case of a model, or `None`, told loudly, where its recording is not there.
fn case(model: &str, recording: &str) -> Option<Case> {
    let recording = Path::new(WORKSPACE).join("../shared/data").join(recording);
    if !recording.exists() {
        // Written past the test harness, which would keep it to itself.
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

/// What a replay told about one signal or need.
#[derive(Debug)]
struct Event {
    time_s: f64,
    kind: String,
    signal: Option<String>,
}

/// The JSON object that a replay prints.
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

/// Runs a replay with `--json`; a need that was unmet (status 1) is an answer, too.
fn report(command: &mut Command) -> Report {
    let output = command.arg("--json").output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{command:?}: {}\n{told}", output.status);
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
        let told = self.events().into_iter().filter(|event| kinds.contains(&&*event.kind));
        told.filter_map(|event| event.signal).collect()
    }

    /// Seconds from a moment to the first event that names the signal for certain.
    fn named_after(&self, signal: &str, start_s: f64) -> Option<f64> {
        let names =
            |event: &&Event| NAMING.contains(&&*event.kind) && event.signal.as_deref() == Some(signal);
        self.events().iter().find(names).map(|event| event.time_s - start_s)
    }

    fn need(&self, variable: &str, figure: &str) -> f64 {
        self.0["needs"][variable][figure].as_f64().unwrap_or(f64::INFINITY)
    }

    /// The report but for the time that it took.
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

/// A labelled event: the readings in which something was introduced at a mote, the motes of its room, the others.
struct Introduced {
    readings: std::ops::RangeInclusive<u64>,
    mote: &'static str,
    neighbour: &'static str,
}

const INTRODUCED: [Introduced; 2] = [
    Introduced { readings: 2344..=2460, mote: "mote_1", neighbour: "mote_2" },
    Introduced { readings: 2362..=2393, mote: "mote_4", neighbour: "mote_3" },
];

/// The number of the reading at a time: one every 5 s, the first one is number 1.
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

/// The signal is named, no other is even suspected, and the speed stays available and right.
#[track_caller]
fn check_car(case: &Case, kind: &str, signal: &str, seed: u32, start_s: f64, within_s: f64) {
    let fault = format!("{kind}:{signal}@{start_s}s..");
    let report = case.replay_with(&[&fault], &["--seed", &seed.to_string()]);
    let accused = report.signals(&["failed", "silent", "suspected"]);
    assert_eq!(accused, set(&[signal]), "{fault}, seed {seed}: {:?}", report.events());
    let after = report.named_after(signal, start_s);
    assert!(after.is_some_and(|after| (0.0..=within_s).contains(&after)), "{fault}, seed {seed}: {after:?}");
    let (gap_s, rmse) = (report.need("speed", "longest_gap_s"), report.need("speed", "rmse"));
    // The recording itself pauses for 26 ms. Noise of this size leaves nobody uncontradicted for some rows.
    let longest = if kind.starts_with("noise") { 0.06 } else { 0.03 };
    assert!(gap_s <= longest, "{fault}, seed {seed}: a gap of {gap_s} s");
    assert!(rmse < 0.25, "{fault}, seed {seed}: rmse {rmse} m/s");
}

#[track_caller]
fn check_all_faults_of(signal: &str) {
    let Some(case) = car() else { return };
    for kind in ["bias=2", "spoof=0", "drop", "noise=3", "scale=1.3"] {
        check_car(&case, kind, signal, 1, 20.0, 1.0);
    }
    // The car brakes at 30 s: before, standing still is what a healthy wheel may do.
    check_car(&case, "stuck", signal, 1, 30.0, 3.0);
}

#[test]
fn each_fault_of_wheel_1_is_named_and_healed() {
    check_all_faults_of("wheel_1");
}

#[test]
fn each_fault_of_wheel_2_is_named_and_healed() {
    check_all_faults_of("wheel_2");
}

#[test]
fn each_fault_of_wheel_3_is_named_and_healed() {
    check_all_faults_of("wheel_3");
}

#[test]
fn each_fault_of_wheel_4_is_named_and_healed() {
    check_all_faults_of("wheel_4");
}

#[test]
fn each_fault_of_the_gnss_is_named_and_healed() {
    check_all_faults_of(GNSS);
}

#[test]
fn noise_is_named_whatever_its_seed() {
    let Some(case) = car() else { return };
    for seed in 2..8 {
        for signal in ["wheel_1", "wheel_4", GNSS] {
            check_car(&case, "noise=3", signal, seed, 20.0, 1.0);
        }
    }
}

/// Both faulty signals are named or suspected, and no healthy one is called failed or silent.
#[track_caller]
fn check_two(case: &Case, faults: [(&str, &str, f64); 2]) {
    let texts = faults.map(|(kind, signal, start_s)| format!("{kind}:{signal}@{start_s}s.."));
    let report = case.replay(&[&texts[0], &texts[1]]);
    let faulty = set(&faults.map(|(_, signal, _)| signal));
    let named = report.signals(&NAMING);
    assert!(named.is_subset(&faulty), "{texts:?}: {named:?} named\n{:?}", report.events());
    let accused = report.signals(&["failed", "silent", "suspected"]);
    assert!(faulty.is_subset(&accused), "{texts:?}: only {accused:?} accused\n{:?}", report.events());
}

/// All pairs of wheels, each with these two kinds of fault, the second one this much later.
fn check_wheels(one: &str, other: &str, later_s: f64) {
    let Some(case) = car() else { return };
    for (at, first) in WHEELS.iter().enumerate() {
        for second in WHEELS.iter().skip(at + 1) {
            check_two(&case, [(one, first, 20.0), (other, second, 20.0 + later_s)]);
        }
    }
}

#[test]
fn two_wheels_with_the_same_bias() {
    check_wheels("bias=2", "bias=2", 0.0);
}

#[test]
fn two_wheels_with_different_biases() {
    check_wheels("bias=2", "bias=3", 0.0);
    check_wheels("bias=2", "bias=-2", 0.0);
}

#[test]
fn two_wheels_one_soon_after_the_other() {
    check_wheels("bias=2", "bias=2", 0.1);
}

#[test]
fn a_wheel_and_the_gnss() {
    let Some(case) = car() else { return };
    for wheel in WHEELS {
        check_two(&case, [("bias=2", wheel, 20.0), ("bias=2", GNSS, 20.0)]);
        check_two(&case, [("bias=2", wheel, 20.0), ("bias=-3", GNSS, 20.0)]);
        check_two(&case, [("stuck", wheel, 25.0), ("drop", GNSS, 20.0)]);
        check_two(&case, [("spoof=0", wheel, 30.0), ("noise=3", GNSS, 20.0)]);
    }
}

#[test]
fn no_healthy_signal_is_called_failed_whatever_two_faults_there_are() {
    let Some(case) = car() else { return };
    let kinds =
        ["bias=2", "bias=-2", "spoof=0", "scale=1.3", "noise=3", "stuck", "drop", "drift=0.2", "bias=1.2"];
    let pairs = [("wheel_1", "wheel_2"), ("wheel_3", "wheel_1"), ("wheel_4", GNSS), (GNSS, "wheel_2")];
    for (number, one) in kinds.iter().enumerate() {
        for (other_number, other) in kinds.iter().enumerate() {
            // Every combination of kinds on one of the pairs, with one of the differences in time.
            let (first, second) = pairs[(number + other_number) % pairs.len()];
            let later_s = [0.0, 0.1, 0.5, 10.0][(number + 2 * other_number) % 4];
            check_two(&case, [(one, first, 20.0), (other, second, 20.0 + later_s)]);
        }
    }
}

/// The GNSS has the least tolerance, and contradicts both while the other wheels only just agree yet.
#[test]
fn two_wheels_that_come_to_err_alike_do_not_make_the_gnss_fail() {
    let Some(case) = car() else { return };
    check_two(&case, [("drift=0.2", "wheel_1", 20.0), ("stuck", "wheel_4", 20.5)]);
    check_two(&case, [("stuck", "wheel_1", 20.0), ("stuck", "wheel_4", 20.0)]);
}

/// The signal is named or suspected, and no healthy one is called failed or silent.
#[track_caller]
fn check_honest(case: &Case, kind: &str, signal: &str, start_s: f64) {
    let fault = format!("{kind}:{signal}@{start_s}s..");
    let report = case.replay(&[&fault]);
    assert!(report.signals(&NAMING).is_subset(&set(&[signal])), "{fault}: {:?}", report.events());
    assert!(
        report.signals(&["failed", "silent", "suspected"]).contains(signal),
        "{fault}: {:?}",
        report.events()
    );
}

#[test]
fn faults_of_a_flight_are_named_or_suspected() {
    let Some(case) = quad() else { return };
    for (kind, signal) in
        [("bias=2", "xSpeed"), ("bias=0.2", "cell_2"), ("bias=5", "height"), ("bias=2", "voltage")]
    {
        check_honest(&case, kind, signal, 200.0);
    }
}

#[test]
fn faults_of_a_rover_are_named_or_suspected() {
    let Some(case) = husky() else { return };
    for (kind, signal) in [
        ("bias=0.5", "imu"),
        ("noise=1", "imu"),
        ("drop", "imu"),
        ("bias=1", "odom_yaw_rate"),
        ("bias=1", "odom_speed"),
        ("drop", "odom_speed"),
        ("stuck", "odom_x"),
        ("drift=2e-5", "gps_latitude"),
    ] {
        check_honest(&case, kind, signal, 100.0);
    }
}

#[test]
fn faults_of_a_turtlebot_are_named_or_suspected() {
    let Some(case) = turtlebot() else { return };
    for (kind, signal) in [
        ("bias=0.3", "imu"),
        ("stuck", "imu"),
        ("bias=0.3", "odom_yaw_rate"),
        ("bias=0.2", "odom_speed"),
        ("drop", "left_wheel"),
        ("stuck", "left_wheel"),
    ] {
        check_honest(&case, kind, signal, 40.0);
    }
}

#[test]
fn faults_of_a_cell_are_suspected() {
    let Some(case) = cell() else { return };
    for (kind, signal) in [
        ("bias=0.3", "voltage"),
        ("drop", "voltage"),
        ("bias=3", "current"),
        ("bias=-3", "power"),
        ("bias=8", "capacity"),
    ] {
        check_honest(&case, kind, signal, 35_000.0);
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

/// A journal holds all that went in, injected faults included, so its replay gives the same events.
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

/// The first accusation of a signal, as `shsa explain` tells it.
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

/// A signal of a model, and the smallest bias that a plain script sees in its recording, in the signal's unit.
type Goal = (&'static str, f64);

/// A step is told that is at most so many times as large as what a plain script sees. The script gives an alarm an hour and pair and
/// knows the offsets of this recording; here the whole model gives one in two hours at most, and another recording may have
/// other offsets.
const TIMES: f64 = 4.5;

/// What is found by fitting a part, after which no signal may be called failed in the rest.
#[track_caller]
fn calibrated(case: &Case, more: &[&str]) -> Value {
    // It ends with 1 when a signal is called failed.
    let mut command = Command::new(env!("CARGO_BIN_EXE_shsa"));
    let found = report(command.arg("calibrate").arg(&case.model).arg(&case.recording).args(more)).0;
    assert_eq!(found["after"]["failed"], 0, "{}", found["after"]);
    assert!(found["after"]["suspected"].as_u64() <= Some(1), "{}", found["after"]);
    found
}

/// Calibrated on the first half, no signal is called failed in the second, and small biases are seen.
#[track_caller]
fn check_calibrated(case: Option<Case>, goals: &[Goal]) -> Option<Value> {
    let case = case?;
    let found = calibrated(&case, &[]);
    assert!(found["pairs"].as_array().unwrap().iter().all(|pair| pair["compared_later"].as_u64() > Some(0)));
    for (signal, plain) in goals {
        let fitted = found["fitted"].as_array().unwrap().iter().find(|it| it["name"] == *signal).unwrap();
        let smallest = fitted["smallest_bias"].as_f64().unwrap_or(f64::INFINITY);
        assert!(smallest <= TIMES * plain, "{signal}: {smallest} is more than {TIMES} times {plain}");
    }
    Some(found)
}

#[test]
fn a_calibrated_car_sees_what_a_plain_script_sees() {
    let wheels = [("wheel_1", 0.56), ("wheel_2", 0.40), ("wheel_3", 0.62), ("wheel_4", 0.38)];
    let Some(found) = check_calibrated(car(), &[&wheels[..], &[(GNSS, 0.66), ("gyro", 0.006)]].concat())
    else {
        return;
    };
    // Of the gyro no two readings are equal for long; the wheels have not been seen standing still.
    let frozen_after = |signal: &str| found["signals"][signal]["frozen_after_s"].as_f64();
    assert!(frozen_after("gyro").is_some_and(|seconds| seconds < 0.5), "{:?}", frozen_after("gyro"));
    assert_eq!(frozen_after("wheel_1"), None);
}

/// Its wheels are stamped unevenly: of two readings 5 ms apart, the second one seems to have come faster than a car can go.
#[test]
fn a_car_that_is_calibrated_on_a_calm_third_is_not_too_fast_later() {
    let Some(case) = car() else { return };
    calibrated(&case, &["--split", "20s"]);
}

#[test]
fn a_calibrated_flight_sees_what_a_plain_script_sees() {
    check_calibrated(quad(), &[("ySpeed", 0.34), ("zSpeed", 0.94), ("voltage", 0.83), ("battery", 3.1)]);
}

#[test]
#[ignore = "not yet so: its relation is wrong by more than the script allows for, and a step is told from ten times as much on"]
fn a_calibrated_flight_sees_a_step_to_the_north() {
    check_calibrated(quad(), &[("xSpeed", 0.23)]);
}

#[test]
fn a_calibrated_rover_sees_what_a_plain_script_sees() {
    check_calibrated(husky(), &[("imu", 0.066)]);
}

#[test]
fn calibrated_motes_see_what_a_plain_script_sees_although_events_are_among_what_is_fitted() {
    let inside = [("mote_1_temperature", 0.46), ("mote_1_humidity", 2.1)];
    let outside = [("mote_4_temperature", 1.15), ("mote_4_humidity", 2.3)];
    check_calibrated(case("motes.yaml", "suthaharan"), &[inside, outside].concat());
}

#[test]
fn a_calibrated_turtlebot_sees_what_a_plain_script_sees() {
    // Its yaw rate is known by noise, whose reserve is larger for a drive of minutes: 2.0 for 1.4.
    check_calibrated(
        turtlebot(),
        &[("imu", 0.0545), ("odom_yaw_rate", 1.43 * 0.0223), ("odom_speed", 0.0332)],
    );
}

#[test]
fn a_calibrated_cell_sees_what_a_plain_script_sees() {
    // One pass through the charge could not be halved: another part of the curve would be tested than was fitted. This recording
    // is four times charged and discharged, so each half has two whole cycles. The pulse test beside it cannot be the other
    // half: its count of the charge begins anew with each pulse, which the model does not say.
    check_calibrated(cell(), &[("voltage", 0.20), ("power", 0.75)]);
}
