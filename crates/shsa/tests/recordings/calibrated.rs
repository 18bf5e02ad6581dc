//! Models calibrated on recordings detect faults nearly as small as those that a plain script detects.

use super::{Case, GNSS, car, case, cell, husky, quad, report, turtlebot};
use serde_json::Value;
use std::process::Command;

/// The smallest detected step is at most this multiple of the plain script's. The script gives one alarm an hour for each pair,
/// and knows the offsets of this recording. Here the whole model gives at most one alarm in two hours, other recordings may have
/// other offsets, and means hold what `max_rate` allows between two samples: a seventh more for the gyro, at most.
const TIMES: f64 = 5.2;

/// A signal of a model, and the smallest bias that a plain script detects in its recording, in the signal's unit.
type Goal = (&'static str, f64);

/// The result of fitting a part; no signal may fail in the rest.
#[track_caller]
fn calibrated(case: &Case, more: &[&str]) -> Value {
    // The command ends with status 1 when a signal fails.
    let mut command = Command::new(env!("CARGO_BIN_EXE_shsa"));
    let found = report(command.arg("calibrate").arg(&case.model).arg(&case.recording).args(more)).0;
    assert_eq!(found["after"]["failed"], 0, "{}", found["after"]);
    assert!(found["after"]["suspected"].as_u64() <= Some(1), "{}", found["after"]);
    found
}

/// Checks that after calibration on the first half no signal fails in the second half, and that small biases are detected.
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
    // The gyro never repeats a reading for long; the wheels were never seen standing still.
    let frozen_after = |signal: &str| found["signals"][signal]["frozen_after_s"].as_f64();
    assert!(frozen_after("gyro").is_some_and(|seconds| seconds < 0.5), "{:?}", frozen_after("gyro"));
    assert_eq!(frozen_after("wheel_1"), None);
}

/// The wheels are stamped unevenly: if two readings are 5 ms apart, the second one seems to change faster than a car can.
#[test]
fn a_car_that_is_calibrated_on_a_calm_third_is_not_too_fast_later() {
    let Some(case) = car() else { return };
    calibrated(&case, &["--split", "20s"]);
}

#[test]
fn a_calibrated_flight_sees_what_a_plain_script_sees() {
    let others = [("ySpeed", 0.34), ("zSpeed", 0.94), ("voltage", 0.83), ("battery", 3.1)];
    // The northern position has a long tail in turns (1.8 m/s with a deviation of 0.19), and was seen for eight minutes only. One
    // alarm in two hours with a confidence of 95 % needs 2.7 times the tolerance of the script's one alarm an hour for each pair.
    check_calibrated(quad(), &[&others[..], &[("xSpeed", 2.7 * 0.23)]].concat());
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
    // The yaw rate is known by noise, which needs a larger reserve for a drive of minutes: 2.0 instead of 1.4.
    check_calibrated(
        turtlebot(),
        &[("imu", 0.0545), ("odom_yaw_rate", 1.43 * 0.0223), ("odom_speed", 0.0332)],
    );
}

#[test]
fn a_calibrated_cell_sees_what_a_plain_script_sees() {
    // A single cycle of the charge cannot be halved, because the test part would be another part of the curve than the fitted
    // part. This recording has four charges and discharges, so each half has two whole cycles. The pulse test beside it cannot be
    // the other half: its count of the charge begins anew with each pulse, which the model does not express.
    check_calibrated(cell(), &[("voltage", 0.20), ("power", 0.75)]);
}
