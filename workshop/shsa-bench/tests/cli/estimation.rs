//! `shsa-bench navigation`, `charge` and `alignment`: the methods of estimation compared.
//!
//! The recordings lie outside the project; tests without their recording print SKIPPED.

use crate::folder::Folder;
use serde_json::Value;
use std::path::PathBuf;

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");

fn lines(arguments: &str) -> Vec<Value> {
    let ended = Folder::new().ends(&format!("{arguments} --json"), 0);
    ended.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The path of a recording; prints SKIPPED and returns `None` where it is missing.
fn recorded(file: &str) -> Option<PathBuf> {
    let path = PathBuf::from(DATA).join(file);
    let path = path.canonicalize().ok();
    if path.is_none() {
        eprintln!("SKIPPED: {DATA}/{file} is not there");
    }
    path
}

#[test]
fn a_filter_is_better_than_its_sensors_and_a_gate_than_a_liar() {
    let turtlebot3 = recorded("turtlebot3/turtlebot3.bag");
    let formats = recorded("formats");
    let option = |name: &str, file: &Option<PathBuf>| {
        file.as_ref().map_or(String::new(), |file| format!("--{name} {}", file.display()))
    };
    let options = [option("turtlebot3", &turtlebot3), option("formats", &formats)].join(" ");
    let lines = lines(&format!("navigation --runs 1 --particles 200 {options}"));
    if turtlebot3.is_some() {
        check_turtlebot3(&lines);
    }
    if formats.is_some() {
        check_formats(&lines);
    }
    let error = |scenario: &str, method: &str, what: &str| {
        let found = lines.iter().find(|line| line["scenario"] == scenario && line["method"] == method);
        found.and_then(|line| line[what].as_f64()).unwrap_or_else(|| panic!("no {scenario} {method} {what}"))
    };
    let position = |scenario: &str, method: &str| error(scenario, method, "position_mse_m2");
    for filter in ["EKF", "EKF, gated", "UKF", "particles"] {
        assert!(position("all is well", filter) < 0.2 * position("all is well", "by confidence"), "{filter}");
    }
    assert!(position("wheel 1 slips", "EKF, gated") < 0.1 * position("wheel 1 slips", "EKF"));
    assert!(position("outliers", "EKF, gated") < position("outliers", "EKF"));
    let speed = |method: &str| error("wheel 1 slips", method, "speed_mse_m2_s2");
    assert!(speed("Marzullo") < 0.1 * speed("by confidence"));
}

/// Where the speed that is measured is that of the motion, a filter carries fixes on better than the last fix does.
#[track_caller]
fn check_formats(lines: &[Value]) {
    let error = |recording: &str, method: &str| {
        let found = lines.iter().find(|line| line["recording"] == recording && line["method"] == method);
        found.and_then(|line| line["position_mse_m2"].as_f64()).unwrap_or_else(|| panic!("no {recording}"))
    };
    for recording in ["Car", "Copter", "Boat"] {
        for filter in ["EKF", "UKF"] {
            assert!(
                error(recording, filter) < 0.5 * error(recording, "by confidence"),
                "{recording}, {filter}"
            );
        }
    }
    assert!(error("Vehicle", "by confidence") < error("Vehicle", "dead reckoning"));
}

/// Over 25 m, the filters stay within centimetres of the simulator's truth; no method invents a position without fixes.
#[track_caller]
fn check_turtlebot3(lines: &[Value]) {
    let error = |method: &str, what: &str| {
        let found = lines.iter().find(|line| line["recording"] == "TurtleBot3" && line["method"] == method);
        found.map_or(&Value::Null, |line| &line[what]).as_f64()
    };
    for method in ["dead reckoning", "EKF", "EKF, gated", "EKF, Huber", "EKF, Student", "UKF"] {
        assert!(error(method, "position_mse_m2").is_some_and(|it| it < 0.02), "{method}");
    }
    assert_eq!(error("Marzullo", "position_mse_m2"), None);
    assert!(error("EKF", "speed_mse_m2_s2") < error("dead reckoning", "speed_mse_m2_s2"));
}

/// Without a fault, the error stays below 1 % of the capacity, and below 2 % with one sensor lost.
fn check_methods(lines: &[Value]) {
    for (scenario, limit) in [
        ("all is well", 0.01),
        ("begins at half, wrongly", 0.01),
        ("current 0.1 A too high", 0.02),
        ("current lost half-way", 0.02),
        ("voltage lost half-way", 0.02),
    ] {
        for method in ["EKF", "UKF"] {
            let line =
                lines.iter().find(|line| line["scenario"] == scenario && line["method"] == method).unwrap();
            assert!(line["greatest"].as_f64().unwrap() < limit, "{line}");
            // The resistance began 20 % too high.
            assert!((line["resistance_ohm"].as_f64().unwrap() - 0.002_72).abs() < 0.000_15, "{line}");
        }
    }
}

#[test]
fn the_charge_is_right_with_a_sensor_lost_or_a_wrong_beginning() {
    let Some(file) = recorded("battery/discharge_1c.csv") else { return };
    check_methods(&lines(&format!("charge {}", file.display())));
}

#[test]
fn what_moves_evenly_is_better_extrapolated() {
    let Some(folder) = recorded("") else { return };
    let lines = lines(&format!("alignment {}", folder.display()));
    let position = lines.iter().find(|line| line["signal"] == "husky, position");
    let Some(position) = position else { return eprintln!("SKIPPED: no husky") };
    let rms = |place: usize| position["rms"][place].as_f64().unwrap();
    assert!(rms(1) < 0.5 * rms(0), "{position}");
}
