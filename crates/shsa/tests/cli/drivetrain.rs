//! The drivetrain of the thesis: a minute in a curve, replayed with faults.

use crate::folder::Folder;
use std::fmt::Write;

const MODEL: &str = include_str!("../../../../models/drivetrain.yaml");

/// A left curve with a radius of 33 to 50 m at 10 m/s, by the kinematics of a car without slip.
fn drive() -> Folder {
    let files = ["steering.csv", "wheels.csv", "gearbox.csv", "inertial.csv"];
    let heads =
        ["angle [deg]", "left [rad/s],right [rad/s]", "speed [m/s]", "lateral [m/s^2],longitudinal [m/s^2]"];
    let mut texts = heads.map(|head| format!("t [s],{head}\n"));
    for step in 0..3_000 {
        let time = f64::from(step) / 50.0;
        let (speed, curvature) = (10.0, 0.025 + 0.005 * (0.42 * time).sin());
        let (wheel, share) = (speed / 0.305, 0.76 * curvature);
        let angle = 16.0 * (2.64_f64 * curvature).atan().to_degrees();
        let rows = [
            format!("{angle:.2}"),
            format!("{:.3},{:.3}", wheel * (1.0 - share), wheel * (1.0 + share)),
            format!("{speed:.2}"),
            format!("{:.3},0.00", speed * speed * curvature),
        ];
        for (text, row) in texts.iter_mut().zip(rows) {
            writeln!(text, "{time:.2},{row}").unwrap();
        }
    }
    let folder = Folder::with(&[("drivetrain.yaml", MODEL.as_bytes())]);
    std::fs::create_dir(folder.path("drive")).unwrap();
    files.iter().zip(texts).for_each(|(file, text)| folder.write(&format!("drive/{file}"), text));
    folder
}

#[test]
fn a_sound_drive_has_no_event() {
    let report = drive().json("replay drivetrain.yaml drive", 0);
    assert_eq!(report["events"], serde_json::json!([]));
}

#[test]
fn a_shifted_steering_angle_is_named_and_computed() {
    let report = drive().json("replay drivetrain.yaml drive --inject bias=20:/steering/angle@10s..", 0);
    let events = report["events"].to_string();
    assert!(events.contains("/steering/angle") && events.contains("failed"), "{events}");
    let substituted = report["events"].as_array().unwrap().iter().any(|event| {
        event["kind"] == "substituted"
            && event["variable"] == "steering_angle"
            && event.to_string().contains("/wheels/left")
    });
    assert!(substituted, "{events}");
    for healthy in ["/wheels/left", "/wheels/right", "/inertial/lateral", "/gearbox/speed"] {
        let failed = report["events"]
            .as_array()
            .unwrap()
            .iter()
            .any(|event| event["kind"] == "failed" && event["signal"] == healthy);
        assert!(!failed, "{events}");
    }
}

#[test]
fn the_angle_has_the_two_substitutions_of_the_ontology() {
    let answer = drive().json("plan drivetrain.yaml steering_angle --all --exclude /steering/angle", 0);
    let relations: Vec<String> = answer["substitutions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|found| found["relations"].to_string())
        .collect();
    assert_eq!(relations, [r#"["r1","r2","r4"]"#, r#"["r1","r2","r3"]"#]);
}
