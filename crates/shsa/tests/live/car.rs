//! A recorded drive, played in real time by a Python client over a real bus. A sensor fails, and the consumer of the speed still
//! gets values. Both are independent of `shsa`.

use crate::broker::Broker;
use crate::real::{self, Script, free_port};
use crate::running::{Folder, Running};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The part of the recording, seconds: the car accelerates.
const SKIP: f64 = 20.0;
const SECONDS: f64 = 12.0;
/// When the sensor fails.
const BREAKS: f64 = 6.0;
/// The largest acceleration and deceleration of the car, m/s^2.
const FASTEST: f64 = 6.0;
const NEED: &str = "/car/speed";

pub(crate) const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/car.yaml");

/// The consumer's messages.
pub(crate) struct Seen {
    /// Time, value and quality.
    pub(crate) values: Vec<(f64, f64, String)>,
    pub(crate) statuses: Vec<(f64, Value)>,
}

fn recording() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/comma2k19");
    if folder.exists() {
        return Some(folder);
    }
    let _ = writeln!(std::io::stderr(), "SKIPPED: {} is absent", folder.display());
    None
}

/// A car that plays the recording over a bus, and the consumer of its speed.
pub(crate) struct Drive {
    script: Script,
    begun: Instant,
}

impl Drive {
    /// Begins to play the recording with this fault, for this time in seconds.
    #[track_caller]
    pub(crate) fn begin(bus: &str, port: u16, seconds: f64, fault: &Value) -> Option<Drive> {
        let (python, data) = (real::python()?, recording()?);
        let order = json!({
            "bus": bus, "port": port, "data": data, "skip": SKIP, "seconds": seconds, "need": NEED, "fault": fault,
        });
        Some(Drive { script: Script::start(&python, "car.py", &order), begun: Instant::now() })
    }

    /// The time in seconds since the begin, as in the consumer's messages.
    pub(crate) fn now(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// Ends the drive now, and returns the consumer's messages.
    #[track_caller]
    pub(crate) fn end(mut self) -> Seen {
        read(&self.script.answer(&json!("end"), "values"))
    }

    /// The consumer's messages, at the end of the drive.
    #[track_caller]
    pub(crate) fn seen(mut self) -> Seen {
        let end = Duration::from_secs(80);
        read(&self.script.poll("values", end).unwrap_or_else(|| panic!("the drive does not end")))
    }
}

fn read(answer: &Value) -> Seen {
    let number = |value: &Value| value.as_f64().unwrap();
    let value = |it: &Value| (number(&it[0]), number(&it[1]), it[2].as_str().unwrap_or_default().to_owned());
    Seen {
        values: answer["values"].as_array().unwrap().iter().map(value).collect(),
        statuses: answer["statuses"]
            .as_array()
            .unwrap()
            .iter()
            .map(|it| (number(&it[0]), it[1].clone()))
            .collect(),
    }
}

impl Seen {
    /// The values from a time on.
    pub(crate) fn since(&self, from: f64) -> impl Iterator<Item = &(f64, f64, String)> + Clone {
        self.values.iter().filter(move |value| value.0 > from)
    }

    /// The beginning and the length of the longest time between two values from a time on.
    fn longest_pause(&self, from: f64) -> (f64, f64) {
        let times: Vec<f64> = self.values.iter().map(|value| value.0).filter(|at| *at >= from).collect();
        let pauses = times.windows(2).map(|pair| (pair[0], pair[1] - pair[0]));
        pauses.fold((0.0, 0.0), |most, pause| if pause.1 > most.1 { pause } else { most })
    }

    /// The largest step between two values from a time on, minus the change that the car can make in the time between them.
    fn largest_step(&self, from: f64) -> f64 {
        let values: Vec<&(f64, f64, String)> = self.values.iter().filter(|value| value.0 >= from).collect();
        let step =
            |pair: &[&(f64, f64, String)]| (pair[1].1 - pair[0].1).abs() - FASTEST * (pair[1].0 - pair[0].0);
        values.windows(2).map(step).fold(0.0, f64::max)
    }

    fn quality_at_the_end(&self) -> &str {
        &self.values.last().unwrap().2
    }
}

/// A failing sensor, and the expected decision.
struct Case {
    topic: &'static str,
    column: &'static str,
    /// `stop`, or `bias` by an amount.
    kind: &'static str,
    amount: f64,
    signal: &'static str,
    decision: &'static str,
    /// Whether the sensor serves the need.
    serves: bool,
}

const WHEEL_STOPS: Case = Case {
    topic: "wheel_speed",
    column: "wheel_1",
    kind: "stop",
    amount: 0.0,
    signal: "wheel_1",
    // A row without the field is an unreadable value.
    decision: "failed",
    serves: true,
};
const WHEEL_LIES: Case = Case { kind: "bias", amount: 3.0, ..WHEEL_STOPS };
const GNSS_STOPS: Case = Case {
    topic: "gnss_ublox",
    column: "speed",
    kind: "stop",
    amount: 0.0,
    signal: "gnss_ublox",
    decision: "silent",
    serves: false,
};
const GNSS_LIES: Case = Case { kind: "bias", amount: 3.0, decision: "failed", ..GNSS_STOPS };

/// Serves the speed of the car's model over a bus while this fault begins, and checks the promises that hold on every bus.
#[track_caller]
fn check(model: &str, bus: &str, address: &str, port: u16, case: &Case) {
    let Case { topic, column, kind, amount, signal, decision, serves } = *case;
    let run = Running::start([model, "--bus", address]);
    let fault = json!({ "topic": topic, "column": column, "kind": kind, "amount": amount, "at": BREAKS });
    let Some(drive) = Drive::begin(bus, port, SECONDS, &fault) else { return };
    let seen = drive.seen();

    let decision = run.decision(decision);
    assert_eq!(decision["signal"], signal, "{decision}");
    let before = seen.values.iter().filter(|value| value.0 < BREAKS && value.0 > 2.0);
    assert!(before.clone().count() > 150, "{}", before.count());
    let (_, state) = run.get("/state");
    let qualities = |from: f64, to: f64| {
        let between = seen.statuses.iter().filter(move |(at, _)| (from..to).contains(at));
        between.map(|(_, status)| status["quality"].as_str().unwrap_or_default().to_owned())
    };
    // On a busy machine the drive's messages are late now and then, and other qualities come between.
    let expected = if serves { "UncertainSubstituteValue" } else { "Good" };
    let is_wrong = |quality: &str| serves && quality == "Good";
    assert!(qualities(2.0, SECONDS).any(|it| it == expected), "{:?}", seen.statuses);
    assert!(qualities(2.0, SECONDS).next_back().is_some_and(|it| !is_wrong(&it)), "{:?}", seen.statuses);
    // A message of ROS carries no quality.
    if !bus.starts_with("ros2") {
        let good = before.clone().filter(|value| value.2 == "Good").count();
        assert!(2 * good > before.count(), "{good}: {state}");
        assert!(!is_wrong(seen.quality_at_the_end()), "{state}");
        assert!(seen.since(BREAKS).any(|value| value.2 == expected), "{state}");
    }
    // Values arrive until the end. The pause depends on the machine, so it is printed, not checked.
    eprintln!("longest pause {:?} s", seen.longest_pause(2.0));
    assert!(seen.values.last().is_some_and(|value| value.0 > SECONDS - 1.5), "{:?}", seen.values.last());
    // Both sources are within their errors: 0.6 m/s each.
    assert!(seen.largest_step(2.0) < 1.2, "{}", seen.largest_step(2.0));
}

/// An independent router of Zenoh, and its port.
pub(crate) fn router(python: &Path) -> (Script, u16) {
    let port = free_port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let config =
        json!({ "mode": "router", "scouting/multicast/enabled": false, "listen/endpoints": [endpoint] });
    let script = "../../../shsa-bridge/tests/python/zenoh_client.py";
    (Script::start(python, script, &config), port)
}

/// The configuration of a Python client of a router of Zenoh.
pub(crate) fn client_of(port: u16) -> Value {
    json!({
        "mode": "client", "scouting/multicast/enabled": false, "listen/endpoints": [],
        "connect/endpoints": [format!("tcp/127.0.0.1:{port}")],
    })
}

fn over_mqtt(case: &Case) {
    let broker = Broker::start(&[]);
    let address = format!("mqtt://127.0.0.1:{}", broker.port());
    check(MODEL, "mqtt", &address, broker.port(), case);
}

fn over_zenoh(case: &Case) {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    check(MODEL, "zenoh", &format!("zenoh://127.0.0.1:{port}"), port, case);
}

/// The car as nodes of ROS 2: a message for each wheel, with the time in its header.
fn of_nodes(folder: &Folder) -> String {
    let sources = [
        ("wheel_speed#wheel_1", "/wheel_1/twist#twist.linear.x"),
        ("wheel_speed#wheel_2", "/wheel_2/twist#twist.linear.x"),
        ("wheel_speed#wheel_3", "/wheel_3/twist#twist.linear.x"),
        ("wheel_speed#wheel_4", "/wheel_4/twist#twist.linear.x"),
        ("gnss_ublox#speed", "/gnss/twist#twist.twist.linear.x"),
        ("gyro#gyro_z", "/imu#angular_velocity.z"),
        ("steering_angle#steering_angle", "/steering_angle#data"),
    ];
    let mut model = std::fs::read_to_string(MODEL).unwrap();
    for (recorded, live) in sources {
        assert_eq!(model.matches(recorded).count(), 1, "{recorded}");
        model = model.replace(recorded, live);
    }
    let path = folder.path("car.yaml");
    std::fs::write(&path, model).unwrap();
    path.to_str().unwrap().to_owned()
}

fn over_ros2(case: &Case) {
    let Some(python) = real::python() else { return };
    let folder = Folder::new();
    let (_router, port) = router(&python);
    check(&of_nodes(&folder), "ros2", &format!("ros2://127.0.0.1:{port}"), port, case);
}

/// In a network of its own, as DDS cannot be kept to a port.
#[cfg(feature = "ros2-dds")]
fn over_ros2_dds(test: &str, case: &Case) {
    use crate::real::network::{Multicast, alone};
    if real::python().is_some() {
        alone(&format!("car::{test}"), Multicast::On, || {
            let folder = Folder::new();
            check(&of_nodes(&folder), "ros2-dds", "ros2-dds", 0, case);
        });
    }
}

#[test]
fn a_wheel_that_falls_silent_is_replaced_over_mqtt() {
    over_mqtt(&WHEEL_STOPS);
}

#[test]
fn a_wheel_that_lies_is_replaced_over_mqtt() {
    over_mqtt(&WHEEL_LIES);
}

#[test]
fn a_receiver_that_falls_silent_is_reported_over_mqtt() {
    over_mqtt(&GNSS_STOPS);
}

#[test]
fn a_receiver_that_lies_is_reported_over_mqtt() {
    over_mqtt(&GNSS_LIES);
}

#[test]
fn a_wheel_that_falls_silent_is_replaced_over_zenoh() {
    over_zenoh(&WHEEL_STOPS);
}

#[test]
fn a_wheel_that_lies_is_replaced_over_zenoh() {
    over_zenoh(&WHEEL_LIES);
}

#[test]
fn a_receiver_that_falls_silent_is_reported_over_zenoh() {
    over_zenoh(&GNSS_STOPS);
}

#[test]
fn a_receiver_that_lies_is_reported_over_zenoh() {
    over_zenoh(&GNSS_LIES);
}

/// A node that stops publishes nothing, unlike a recording with missing rows.
#[test]
fn a_wheel_that_falls_silent_is_replaced_over_ros2() {
    over_ros2(&Case { decision: "silent", ..WHEEL_STOPS });
}

#[test]
fn a_wheel_that_lies_is_replaced_over_ros2() {
    over_ros2(&WHEEL_LIES);
}

#[test]
fn a_receiver_that_falls_silent_is_reported_over_ros2() {
    over_ros2(&GNSS_STOPS);
}

#[test]
fn a_receiver_that_lies_is_reported_over_ros2() {
    over_ros2(&GNSS_LIES);
}

#[cfg(feature = "ros2-dds")]
#[test]
fn a_wheel_that_falls_silent_is_replaced_over_ros2_dds() {
    let case = Case { decision: "silent", ..WHEEL_STOPS };
    over_ros2_dds("a_wheel_that_falls_silent_is_replaced_over_ros2_dds", &case);
}

#[cfg(feature = "ros2-dds")]
#[test]
fn a_wheel_that_lies_is_replaced_over_ros2_dds() {
    over_ros2_dds("a_wheel_that_lies_is_replaced_over_ros2_dds", &WHEEL_LIES);
}
