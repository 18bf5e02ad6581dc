//! `shsa calibrate`: finds known errors, offsets and delays in healthy recordings, and writes a patch that works.

use crate::folder::{Folder, keys};
use crate::tank;
use serde_json::Value;
use std::fmt::Write;
use std::sync::OnceLock;

const MODEL: &str = "\
shsa: 1
variables:
  speed: { unit: m/s }
  way:   { unit: km }
relations:
  going: { equation: \"speed = derivative(way, 2 s)\", for: [speed], error: 5 m/s }
signals:
  a: { variable: speed, unit: m/s, rate: 10 Hz, value_error: 5 }
  b: { variable: speed, unit: km/h, rate: 10 Hz, value_error: 20 }
  c: { variable: speed, unit: m/s, rate: 10 Hz, value_error: 5, derived_from: [] }
  d: { variable: way, unit: km, rate: 10 Hz }
needs:
  speed: { max_age: 1 s }
";

/// So many alarms are accepted that minutes of surrogate recordings are enough, where hours add nothing to what a test looks at.
const QUICK: &str = "--false-alarms 20";

/// Oscillating speeds: `b` is 3.6 km/h too high, `c` is 0.4 s late, and all have reproducible noise.
fn drive(rows: usize) -> String {
    let mut text = "t [s],a,b,c,d\n".to_owned();
    let speed = |time: f64| 10.0 + 3.0 * (0.5 * time).sin() + (1.3 * time).cos();
    let way = |time: f64| 10.0 * time - 6.0 * (0.5 * time).cos() + (1.3 * time).sin() / 1.3;
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5
    };
    for row in 0..rows {
        let time = row as f64 * 0.1;
        let (a, b, c) =
            (speed(time) + 0.1 * noise(), speed(time) + 0.1 * noise(), speed(time - 0.4) + 0.1 * noise());
        writeln!(text, "{time:.1},{a:.4},{:.4},{c:.4},{:.7}", 3.6 * b + 3.6, way(time) / 1e3).unwrap();
    }
    text
}

fn folder() -> Folder {
    Folder::with(&[("m.yaml", MODEL.as_bytes()), ("drive.csv", drive(3000).as_bytes())])
}

/// The folder with all that a calibration writes, and its report; made once, as it takes some seconds.
fn calibrated() -> &'static (Folder, Value) {
    static CALIBRATED: OnceLock<(Folder, Value)> = OnceLock::new();
    CALIBRATED.get_or_init(|| {
        let folder = folder();
        let written = "--patch patch.yaml --output tuned.yaml --html page.html";
        let report = folder.json(&format!("calibrate m.yaml drive.csv {written}"), 0);
        (folder, report)
    })
}

fn fitted<'r>(report: &'r Value, name: &str) -> &'r Value {
    report["fitted"].as_array().unwrap().iter().find(|it| it["name"] == name).unwrap()
}

#[track_caller]
fn near(value: &Value, expected: f64, within: f64) {
    let found = value.as_f64().unwrap();
    assert!((found - expected).abs() <= within, "{found} is not {expected} +- {within}");
}

#[test]
fn offsets_delays_and_errors_are_found() {
    let (_, report) = calibrated();
    assert_eq!(
        keys(report),
        [
            "split_s",
            "duration_s",
            "signals",
            "pairs",
            "fitted",
            "smallest_faults",
            "unhealthy",
            "before",
            "after",
            "promise",
            "refused"
        ]
    );
    near(&fitted(report, "c")["delay_s"], 0.4, 0.03);
    near(&fitted(report, "a")["delay_s"], 0.0, 0.0);
    // b is 1 m/s above a and c: two thirds above the mean of the three, while a and c are one third below.
    let offset = |name: &str| fitted(report, name)["offset"].as_f64().unwrap();
    let apart = offset("b") / 3.6 + offset("a");
    assert!((apart - 1.0).abs() < 0.05, "{apart}");
    // The noise is 0.05 m/s at most, instead of 5.
    near(&fitted(report, "a")["noise"], 0.1 / 12.0_f64.sqrt(), 0.01);
    for name in ["a", "c"] {
        let error = fitted(report, name)["error"].as_f64().unwrap();
        assert!((0.03..1.0).contains(&error), "{name}: {error}");
    }
    assert_eq!((&report["after"]["failed"], &report["after"]["suspected"]), (&0.into(), &0.into()));
    near(&report["signals"]["a"]["rate_hz"], 10.0, 1e-6);
    // The part that is not fitted is not counted.
    assert_eq!(report["signals"]["a"]["count"], 1500);
    assert_eq!((&report["promise"]["alarms_per_hour"], &report["refused"]), (&0.5.into(), &Value::Null));
}

#[test]
fn what_is_written_changes_the_model_and_finds_smaller_faults() {
    let (folder, report) = calibrated();
    let patch = folder.read("patch.yaml");
    assert!(patch.starts_with("# Fitted to the first 150 s of a recording of 300 s"), "{patch}");
    assert!(patch.contains("\n  # a step of ") && patch.contains("it tells 4"), "{patch}");
    let bias = 2.5;
    near(&fitted(report, "a")["smallest_bias"], bias / 2.0, bias / 2.0);
    let fault = format!("replay m.yaml drive.csv --inject bias={bias}:a@200s..");
    let events = |arguments: &str| folder.json(arguments, 0)["events"].as_array().unwrap().clone();
    assert_eq!(events(&fault), Vec::<Value>::new());
    let found = events(&format!("{fault} --reload patch.yaml@0s"));
    assert!(found.iter().any(|event| event["kind"] == "failed" && event["signal"] == "a"), "{found:?}");
    // At 0 s the needs go over to the changed model, which is no fault.
    let mut faults = found.iter().filter(|event| event["kind"] == "failed" || event["kind"] == "suspected");
    assert!(faults.all(|event| event["time_s"].as_f64().unwrap() >= 200.0), "{found:?}");
}

#[test]
fn the_page_has_what_the_text_says_and_the_patch() {
    let page = calibrated().0.read("page.html");
    assert!(page.starts_with("<!DOCTYPE html>") && !page.contains("<script"), "{page}");
    for words in ["What was fitted", "Comparisons", "going", "value_error", " h that were not fitted"] {
        assert!(page.contains(words), "no '{words}'");
    }
}

#[test]
fn the_calibrated_model_is_the_model_with_the_patch() {
    let (folder, _) = calibrated();
    let patched = folder.ends("model patch m.yaml patch.yaml", 0).stdout;
    assert_eq!(folder.read("tuned.yaml"), patched);
    assert_ne!(patched, folder.read("m.yaml"));
    let refused = folder.ends("calibrate m.yaml drive.csv --output m.yaml", 2);
    assert!(refused.stderr.contains("m.yaml"), "{}", refused.stderr);
    // Before any work: there is not even a recording.
    let twice = ["twice.yaml is in use by this run already"];
    folder.refuses("calibrate m.yaml missing.csv --patch twice.yaml --output ./twice.yaml", &twice);
    folder
        .refuses("calibrate m.yaml missing.csv --html missing/a.html", &["missing/a.html cannot be written"]);
    assert!(!folder.path("twice.yaml").exists());
}

#[test]
fn a_relation_that_does_not_hold_is_reported() {
    let folder = folder();
    // The relation's error is so wide that it accuses nobody.
    let wrong = MODEL.replace("derivative(way, 2 s)", "3 * derivative(way, 20 s)");
    folder.write("wrong.yaml", wrong.replace("error: 5 m/s", "error: 80 m/s"));
    let output = folder.ends(&format!("calibrate wrong.yaml drive.csv {QUICK}"), 0).stdout;
    assert!(output.contains("going of d and a: not shown to hold"), "{output}");
    let output = folder.ends(&format!("calibrate m.yaml drive.csv {QUICK}"), 0).stdout;
    assert!(!output.contains("not shown to hold"), "{output}");
    assert!(output.contains("of the spread is left"), "{output}");
    assert!(output.contains(" h that were not fitted"), "{output}");
}

#[test]
fn a_later_fault_is_the_answer_no_unless_it_is_left_out() {
    let folder = tank::folder();
    // The level's sensor is faulty from 30 s on, so the test part is not healthy.
    let report = folder.json(&format!("calibrate tank.yaml run.csv {QUICK}"), 1);
    assert_eq!(report["after"]["failed"], 1);
    folder.ends(&format!("calibrate tank.yaml run.csv --skip 30s..70s --split 15s {QUICK}"), 0);
}

/// Two sensors agree in the fitted half, and differ in the other one by an amount that the given model allows.
#[test]
fn numbers_that_do_worse_than_the_model_are_not_written() {
    let mut text = "t [s],a,b\n".to_owned();
    for row in 0..600 {
        let (time, late) = (f64::from(row), row >= 400);
        let noise = |by: i32| 0.01 * f64::from((row * by) % 17 - 8);
        let more = if late { 2.0 } else { 0.0 };
        writeln!(
            text,
            "{time},{:.4},{:.4}",
            (0.1 * time).sin() + noise(7) + more,
            (0.1 * time).sin() + noise(5)
        )
        .unwrap();
    }
    let model = "shsa: 1\nvariables: { x: {} }\nsignals:\n  a: { variable: x, rate: 1 Hz, value_error: 3 }\n  \
                 b: { variable: x, rate: 1 Hz, value_error: 3 }\n";
    let folder = Folder::with(&[("m.yaml", model.as_bytes()), ("run.csv", text.as_bytes())]);
    let report = folder.json(&format!("calibrate m.yaml run.csv --patch tuned.yaml {QUICK}"), 1);
    assert!(report["refused"].as_str().unwrap().contains("in the part that it has not seen"), "{report}");
    assert_eq!(report["before"]["suspected"], 0);
    assert!(!folder.path("tuned.yaml").exists());
}

/// Calibration expects no values in a gap that it shall skip.
#[test]
fn a_stretch_that_is_left_out_makes_no_time_out() {
    let mut text = "t [s],a,b\n".to_owned();
    for row in 0..600 {
        let time = f64::from(row);
        let noise = |by: i32| 0.01 * f64::from((row * by) % 17 - 8);
        writeln!(text, "{time},{:.4},{:.4}", (0.1 * time).sin() + noise(7), (0.1 * time).sin() + noise(5))
            .unwrap();
    }
    let model = "shsa: 1\nvariables: { x: {} }\nsignals:\n  a: { variable: x, rate: 1 Hz, value_error: 3, timeout: 2 s }\n  \
                 b: { variable: x, rate: 1 Hz, value_error: 3, timeout: 2 s }\n";
    let folder = Folder::with(&[("m.yaml", model.as_bytes()), ("run.csv", text.as_bytes())]);
    folder.json(&format!("calibrate m.yaml run.csv --skip 50s..90s --patch tuned.yaml {QUICK}"), 0);
    let patch = folder.read("tuned.yaml");
    assert!(patch.contains("timeout: 2 s") && !patch.contains("timeout: 8"), "{patch}");
}

#[test]
fn wrong_arguments_are_reported() {
    let folder = tank::folder();
    folder.refuses("calibrate tank.yaml run.csv --false-alarms 0", &["expected a number above 0"]);
    folder.refuses("calibrate tank.yaml run.csv --split 100s", &["outside of the recording of 59 s"]);
    folder.refuses("calibrate tank.yaml run.csv --skip 5s", &["write it like 20s..30s"]);
    folder.refuses("calibrate tank.yaml run.csv --patch tank.yaml", &["is in use by this run already"]);
    folder.refuses("calibrate tank.yaml run.csv --skip 0s..80s", &["has a comparison before the split"]);
    folder.write(
        "one.yaml",
        "shsa: 1\nvariables: { level: { unit: m } }\nsignals: { /level: { variable: level } }\n",
    );
    folder.refuses("calibrate one.yaml run.csv", &["no variable of the model is known in two ways"]);
}

/// Three compasses of a ship that keeps turning: one counts the other way in tenths, one from 0 to 360 degrees.
#[test]
fn what_wraps_and_what_is_scaled_is_fitted_in_its_unit() {
    let model = "shsa: 1
variables: { h: { unit: deg, range: [-180, 180], wraps: 360 deg } }
signals:
  a: { variable: h, source: r#a, unit: deg, rate: 1 Hz, value_error: 12 }
  b: { variable: h, source: r#b, unit: deg, rate: 1 Hz, value_error: 12, scale: -0.1, offset: 0.5 }
  c: { variable: h, source: r#c, unit: deg, rate: 1 Hz, value_error: 12 }
needs: { h: { signal: /h, max_age: 5 s } }
";
    let mut state = 1_u64;
    // Uniform within 2 degrees: the standard deviation is 1.15.
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        4.0 * ((state >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5)
    };
    let mut recording = "time [s],a,b,c\n".to_owned();
    for second in 0..2_400 {
        let heading = 170.0 + 0.9 * f64::from(second) + 40.0 * (f64::from(second) / 60.0).sin();
        let wrapped = |heading: f64| (heading + 180.0).rem_euclid(360.0) - 180.0;
        let (a, b, c) = (heading + noise(), heading + noise(), heading + noise());
        let line =
            format!("{second},{:.3},{:.3},{:.3}\n", wrapped(a), 5.0 - 10.0 * wrapped(b), c.rem_euclid(360.0));
        recording.push_str(&line);
    }
    let folder = Folder::with(&[("m.yaml", model.as_bytes()), ("r.csv", recording.as_bytes())]);
    let found = folder.json(&format!("calibrate m.yaml r.csv {QUICK}"), 0);
    for fitted in found["fitted"].as_array().unwrap() {
        let of = |key: &str| fitted[key].as_f64().unwrap_or(f64::INFINITY);
        assert!((0.8..1.4).contains(&of("noise")), "{fitted}");
        assert!((2.0..10.0).contains(&of("error")) && of("smallest_bias") < 6.0, "{fitted}");
    }
}

/// Set points of some levels, in the unit of the model, with a witness that follows them at once.
fn commanded(levels: &[f64], noise: f64, stands: usize, seed: u64) -> String {
    let mut state = seed;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        2.0 * noise * ((state >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5)
    };
    let mut text = "t [s],command,seen\n".to_owned();
    for row in 0..1_200 {
        let level = levels[row / stands % levels.len()];
        writeln!(text, "{},{level},{:.3}", row * 60, level + noise()).unwrap();
    }
    text
}

#[test]
fn a_set_point_is_exact_and_its_witness_has_all_of_the_error() {
    let cases: [(&[f64], f64, usize); 5] = [
        (&[55.0, 65.0], 0.2, 300),
        (&[18.5, 21.0, 23.5], 0.3, 90),
        (&[0.0, 1.0], 0.05, 47),
        (&[-12.0, 7.0, 40.0, 41.0], 0.1, 130),
        (&[20.0], 0.2, 100),
    ];
    for (seed, (levels, noise, stands)) in (1..).zip(cases) {
        let model = "shsa: 1
variables: { x: { unit: degC } }
signals:
  command: { variable: x, source: \"c#command\", rate: 1 1/min }
  seen: { variable: x, source: \"c#seen\", rate: 1 1/min, value_error: 3 K }
";
        let recording = commanded(levels, noise, stands, seed);
        let folder = Folder::with(&[("m.yaml", model.as_bytes()), ("c.csv", recording.as_bytes())]);
        let report = folder.json("calibrate m.yaml c.csv -o tuned.yaml", 0);
        let of = |name: &str| fitted(&report, name)["error"].as_f64();
        assert_eq!(of("command"), None, "{levels:?}: {report}");
        let error = of("seen").unwrap();
        assert!((noise..8.0 * noise).contains(&error), "{levels:?}: {error}");
        let command = folder.read("tuned.yaml");
        let command = command.lines().find(|line| line.contains("command:")).unwrap();
        assert!(!command.contains("value_error") && !command.contains("noise"), "{command}");
        assert_eq!(folder.json("replay tuned.yaml c.csv", 0)["events"], serde_json::json!([]), "{levels:?}");
    }
}

#[test]
fn a_thermometer_with_coarse_steps_is_not_exact() {
    let mut text = "t [s],command,seen\n".to_owned();
    for row in 0..1_200 {
        let (slow, fast) = (f64::from(row) / 97.0, f64::from(row) / 13.0);
        let value = 20.0 + 2.1 * slow.sin() + 0.4 * fast.cos();
        writeln!(text, "{},{value:.0},{value:.3}", row * 60).unwrap();
    }
    let model = "shsa: 1
variables: { x: { unit: degC } }
signals:
  command: { variable: x, source: \"c#command\", rate: 1 1/min }
  seen: { variable: x, source: \"c#seen\", rate: 1 1/min, value_error: 3 K }
";
    let folder = Folder::with(&[("m.yaml", model.as_bytes()), ("c.csv", text.as_bytes())]);
    let report = folder.json("calibrate m.yaml c.csv", 0);
    let error = fitted(&report, "command")["error"].as_f64().unwrap();
    assert!(error >= 0.4, "{report}");
}
