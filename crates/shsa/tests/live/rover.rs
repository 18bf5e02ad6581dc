//! The rover as separate programs over a real bus, as in Fig. 1.9 of the thesis.

use crate::broker::Broker;
use crate::car::router;
use crate::real;
use serde_json::Value;
use std::process::Command;

/// The slowest source that is left without the lidar is the sonar ring: two of its periods are 160 ms. The time-out of the lidar, 350 ms,
/// comes before them.
const LONGEST_S: f64 = 0.35 + 2.0 * 0.08;

fn figures(bus: &str, more: &[&str]) -> Value {
    let arguments = ["demo", "rover", "--processes", "--json", "--seed", "2", "--bus", bus];
    let output = Command::new(env!("CARGO_BIN_EXE_shsa")).args(arguments).args(more).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{printed}\n{errors}");
    serde_json::from_str(&printed).unwrap()
}

#[track_caller]
fn check_healed(figures: &Value) {
    assert_eq!((&figures["collisions"], &figures["is_served"]), (&0.into(), &true.into()), "{figures}");
    let [killed, again, attack, _] = &figures["effects"].as_array().unwrap()[..] else { panic!("{figures}") };
    assert_eq!(killed["decision"], "silent /lidar/scan", "{figures}");
    assert_eq!(again["decision"], "restored /lidar/scan", "{figures}");
    let decided = attack["decision"].as_str().unwrap_or_default();
    assert!(decided.ends_with("/lidar/scan"), "{figures}");
    for effect in [killed, again, attack] {
        assert!(effect["longest_gap_s"].as_f64().unwrap() < LONGEST_S, "{figures}");
    }
}

#[test]
fn the_programs_of_the_rover_are_healed_over_mqtt() {
    let broker = Broker::start(&[]);
    check_healed(&figures(&format!("mqtt://127.0.0.1:{}", broker.port()), &[]));
}

#[test]
fn the_programs_of_the_rover_are_healed_over_zenoh() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    check_healed(&figures(&format!("zenoh://127.0.0.1:{port}"), &[]));
}
