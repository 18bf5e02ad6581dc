//! Injected faults: each one is named or suspected, and healed; no healthy signal fails.

use super::{Case, GNSS, NAMING, WHEELS, car, cell, husky, quad, set, turtlebot};

/// Checks that the signal is named, no other one is even suspected, and the speed stays available and correct.
#[track_caller]
fn check_car(case: &Case, kind: &str, signal: &str, seed: u32, start_s: f64, within_s: f64) {
    let fault = format!("{kind}:{signal}@{start_s}s..");
    let report = case.replay_with(&[&fault], &["--seed", &seed.to_string()]);
    let accused = report.signals(&["failed", "silent", "suspected"]);
    assert_eq!(accused, set(&[signal]), "{fault}, seed {seed}: {:?}", report.events());
    let after = report.named_after(signal, start_s);
    assert!(after.is_some_and(|after| (0.0..=within_s).contains(&after)), "{fault}, seed {seed}: {after:?}");
    let (gap_s, rmse) = (report.need("speed", "longest_gap_s"), report.need("speed", "rmse"));
    // The recording itself pauses for 26 ms. With noise of this size, every source is contradicted for some rows.
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
    // The car brakes at 30 s; before, standing still is possible for a healthy wheel.
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

/// Checks that both faulty signals are named or suspected, and no healthy one is failed or silent.
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

/// Checks all pairs of wheels with these two kinds of fault; the second fault begins `later_s` later.
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
        // Each kind with three others, on one of the pairs, with one of the delays.
        for (other_number, other) in kinds.iter().enumerate().skip(number % 3).step_by(3) {
            let (first, second) = pairs[(number + other_number) % pairs.len()];
            let later_s = [0.0, 0.1, 0.5, 10.0][(number + 2 * other_number) % 4];
            check_two(&case, [(one, first, 20.0), (other, second, 20.0 + later_s)]);
        }
    }
}

/// The GNSS has the smallest tolerance, and contradicts both wheels while the other wheels only just agree with them.
#[test]
fn two_wheels_that_come_to_err_alike_do_not_make_the_gnss_fail() {
    let Some(case) = car() else { return };
    check_two(&case, [("drift=0.2", "wheel_1", 20.0), ("stuck", "wheel_4", 20.5)]);
    check_two(&case, [("stuck", "wheel_1", 20.0), ("stuck", "wheel_4", 20.0)]);
}

/// Checks that the signal is named or suspected, and no healthy one is failed or silent.
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
    // Of a climb over 3 s, the model leaves 1.5 m/s open, and its greatest acceleration 0.3 m/s between two rows.
    for (kind, signal) in
        [("bias=2", "xSpeed"), ("bias=0.2", "cell_2"), ("bias=6", "height"), ("bias=2", "voltage")]
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
