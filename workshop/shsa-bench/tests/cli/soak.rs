//! A short soak of what `shsa-bench live --soak '1 h'` does for an hour: nothing is lost, and memory does not grow.

use serde_json::Value;
use std::process::Command;

/// Messages a second that an unoptimised build takes on a busy machine.
const RATE: &str = "1000";
const SECONDS: f64 = 24.0;
/// More than memory scatters by, and less than 70 bytes for each message of the second half.
const GROWTH_MAX: f64 = 786_432.0;

#[track_caller]
fn check(bus: &str) {
    let length = format!("{SECONDS} s");
    let ended = Command::new(crate::PROGRAM)
        .args(["live", "--bus", bus, "--soak", &length, "--rate", RATE, "--json"])
        .output()
        .unwrap();
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    let found: Value = serde_json::from_slice(&ended.stdout).unwrap();
    let number = |name: &str| found["messages"][name].as_f64().unwrap();
    assert_eq!(found["decisions"], 0, "{found}");
    assert!(number("said") >= 0.95 * SECONDS * 1_000.0, "{found}");
    assert_eq!((number("heard"), number("lost")), (number("said"), 0.0), "{found}");
    assert_eq!(number("published"), number("consumed"), "{found}");

    let windows = found["windows"].as_array().unwrap();
    let mean = |windows: &[Value]| {
        let all = windows.iter().map(|window| window["memory_bytes"].as_f64().unwrap());
        all.sum::<f64>() / windows.len() as f64
    };
    let quarter = windows.len() / 4;
    let (second, last) = (mean(&windows[quarter..2 * quarter]), mean(&windows[3 * quarter..]));
    assert!(last - second < GROWTH_MAX, "from {second} to {last}: {found}");
}

#[test]
fn nothing_is_lost_and_memory_does_not_grow_over_mqtt() {
    crate::with_shsa();
    check("mqtt");
}

#[test]
fn nothing_is_lost_and_memory_does_not_grow_in_memory() {
    check("memory");
}
