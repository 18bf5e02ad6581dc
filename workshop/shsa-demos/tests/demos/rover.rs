//! The rover as separate programs over a real bus, as in Fig. 1.9 of the thesis.

use crate::broker::Broker;
use crate::real::{self, Script, free_port};
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

/// The slowest source that is left without the lidar is the sonar ring: two of its periods are 160 ms. The time-out of the lidar, 350 ms,
/// comes before them.
const LONGEST_S: f64 = 0.35 + 2.0 * 0.08;
/// How often the rover is started, at most: a machine that stands still for a moment lengthens a gap, healing that is too slow
/// lengthens each.
const STARTS: usize = 3;

/// An independent router of Zenoh, and its port.
fn router(python: &Path) -> (Script, u16) {
    let port = free_port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let config =
        json!({ "mode": "router", "scouting/multicast/enabled": false, "listen/endpoints": [endpoint] });
    let script =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../crates/shsa-bridge/tests/python/zenoh_client.py");
    (Script::start(python, script, &config), port)
}

fn figures(bus: &str) -> Value {
    let arguments = ["rover", "--brisk", "--json", "--seed", "2", "--bus", bus];
    let output = Command::new(env!("CARGO_BIN_EXE_shsa-demos")).args(arguments).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{printed}\n{errors}");
    serde_json::from_str(&printed).unwrap()
}

/// Whether the consumer never waits too long, in figures of a rover that was healed.
#[track_caller]
fn has_short_gaps(figures: &Value) -> bool {
    assert_eq!((&figures["collisions"], &figures["is_served"]), (&0.into(), &true.into()), "{figures}");
    let [killed, again, attack, _] = &figures["effects"].as_array().unwrap()[..] else { panic!("{figures}") };
    assert_eq!(killed["decision"], "silent /lidar/scan", "{figures}");
    assert_eq!(again["decision"], "restored /lidar/scan", "{figures}");
    let decided = attack["decision"].as_str().unwrap_or_default();
    assert!(decided.ends_with("/lidar/scan"), "{figures}");
    [killed, again, attack].iter().all(|effect| effect["longest_gap_s"].as_f64().unwrap() < LONGEST_S)
}

#[track_caller]
fn check_healed(bus: &str) {
    let mut all = Vec::new();
    while all.len() < STARTS {
        all.push(figures(bus));
        if all.last().is_some_and(has_short_gaps) {
            return;
        }
    }
    panic!("the consumer waits too long: {all:?}");
}

#[test]
fn the_programs_of_the_rover_are_healed_over_mqtt() {
    // The broker of other tests writes each change to the disk before the next message.
    let broker = Broker::start(&["persistence false"]);
    check_healed(&format!("mqtt://127.0.0.1:{}", broker.port()));
}

#[test]
fn the_programs_of_the_rover_are_healed_over_zenoh() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    check_healed(&format!("zenoh://127.0.0.1:{port}"));
}

#[test]
fn the_programs_of_the_rover_are_healed_over_ros2() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    check_healed(&format!("ros2://127.0.0.1:{port}"));
}

/// In a network of its own, as DDS cannot be kept to a port.
#[cfg(feature = "ros2-dds")]
#[test]
fn the_programs_of_the_rover_are_healed_over_ros2_dds() {
    use crate::real::network::{Multicast, alone};
    alone("rover::the_programs_of_the_rover_are_healed_over_ros2_dds", Multicast::On, || {
        check_healed("ros2-dds");
    });
}
