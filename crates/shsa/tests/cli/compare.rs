//! `shsa replay --compare`: one line a step.

use crate::folder::{Ended, Folder, keys};
use crate::tank;
use serde_json::Value;

fn steps(ended: &Ended) -> Vec<Value> {
    ended.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn the_default_names_the_signal() {
    let folder = tank::folder();
    let steps = steps(&folder.ends("replay tank.yaml run.jsonl --compare level --json", 0));
    assert_eq!(steps.len(), 59);
    for (second, step) in steps.iter().enumerate() {
        assert_eq!(keys(step), ["time_ns", "outputs", "errors", "failed", "verdicts"]);
        assert_eq!(step["time_ns"], second as i64 * 1_000_000_000);
        assert_eq!(step["outputs"].as_array().unwrap().len(), 3);
        assert_eq!(keys(&step["outputs"][0]), ["substitution", "value", "time"]);
    }
    let verdict = |second: usize| steps[second]["verdicts"]["/level"].as_str().unwrap();
    assert_eq!([verdict(tank::LIE - 1), verdict(tank::LIE + 5)], ["healthy", "failed"]);
    assert_eq!(steps[tank::LIE - 1]["failed"], -1);
    assert_eq!(steps[58]["failed"], 0);
    assert_eq!(steps[58]["verdicts"]["/volume"], "healthy");
}

#[test]
fn thesis_mode_names_the_way() {
    let folder = tank::folder();
    let steps = steps(&folder.ends("replay tank.yaml run.csv --compare level --mode thesis --json", 0));
    for step in &steps {
        assert_eq!(keys(step), ["time_ns", "outputs", "errors", "failed"]);
    }
    let failed: Vec<i64> = steps.iter().map(|step| step["failed"].as_i64().unwrap()).collect();
    let expected: Vec<i64> = (0..59).map(|second| if second < tank::LIE { -1 } else { 0 }).collect();
    assert_eq!(failed, expected);
    // 0.5 m minus the half widths: 0.05 m of the level, 0.5 kPa of the pressure, 2 % of the volume
    let errors: Vec<f64> =
        steps[tank::LIE]["errors"].as_array().unwrap().iter().map(|error| error.as_f64().unwrap()).collect();
    let level = 2.0 + 0.01 * tank::LIE as f64;
    let expected = [0.5 - 0.05 - 0.5 / 9.81, 0.5 - 0.05 - 0.02 * level];
    assert!((errors[1] - expected[0]).abs() < 1e-3 && (errors[2] - expected[1]).abs() < 1e-3, "{errors:?}");
    assert!((errors[0] - errors[1] - errors[2]).abs() < 1e-9, "{errors:?}");
}

#[test]
fn text_has_a_head_rows_and_a_sum() {
    let folder = tank::folder();
    let output =
        folder.ends("replay tank.yaml run.jsonl --compare level --mode thesis --period 10s", 0).stdout;
    let expected = "\
level is known in 3 ways:
   0  /level
   1  /pressure by hydrostatic
   2  /volume by cylinder
Errors: how far a way is from each other one, summed in m.

        time     way 0     way 1     way 2
     0.000 s     0.000     0.000     0.000
";
    assert!(output.starts_with(expected), "{output}");
    assert!(output.contains("way 0 failed\n"), "{output}");
    assert!(output.ends_with("\n6 steps\nway 0 (/level) failed in 3 of them\n"), "{output}");
    let output = folder.ends("replay tank.yaml run.jsonl --compare level", 0).stdout;
    assert!(output.contains("/level failed\n") && output.contains("\n59 steps\n"), "{output}");
}

#[test]
fn steps_follow_the_period() {
    let folder = tank::folder();
    let count = |period: &str| {
        let arguments = format!("replay tank.yaml run.csv --compare level --json --period {period}");
        steps(&folder.ends(&arguments, 0)).len()
    };
    assert_eq!([count("1s"), count("500ms"), count("7s"), count("5min")], [59, 118, 9, 1]);
    for (period, words) in [("0s", "positive"), ("5", "unit of time"), ("1ns", "too many"), ("abc", "'abc'")]
    {
        let arguments = format!("replay tank.yaml run.csv --compare level --period {period}");
        folder.refuses(&arguments, &[words]);
    }
}

#[test]
fn options_of_thesis_mode() {
    let folder = tank::folder();
    let compare = "replay tank.yaml run.csv --compare level";
    for option in ["--buffer 0", "--average x", "--median -1"] {
        folder.ends(&format!("{compare} --mode thesis {option}"), 2);
    }
    let ended = folder.ends(&format!("{compare} --buffer 2"), 0);
    assert!(ended.stderr.contains("are for --mode thesis"), "{}", ended.stderr);
    let lone = |options: &str| {
        let steps = steps(&folder.ends(&format!("{compare} --mode thesis --json {options}"), 0));
        steps[tank::LIE]["failed"].clone()
    };
    assert_eq!([lone(""), lone("--average 3"), lone("--median 5")], [0, 0, -1]);
}

#[test]
fn nothing_to_compare_is_reported() {
    let folder = tank::folder();
    let one = folder.ends("replay tank.yaml run.csv --compare volume", 0);
    assert!(one.stderr.contains("volume is known in one way only"), "{}", one.stderr);
    let model =
        tank::MODEL.replace("  volume:   { unit: l }", "  volume:   { unit: l }\n  spare:    { unit: m }");
    folder.write("spare.yaml", model);
    let none = folder.ends("replay spare.yaml run.csv --compare spare", 1);
    assert!(none.stderr.contains("nothing in the model knows spare"), "{}", none.stderr);
}

#[test]
fn vectors_journals_and_strangers_are_refused() {
    let model = "\
shsa: 1
variables: { scan: { unit: m, shape: vector }, near: { unit: m } }
relations: { nearest: { equation: near = min(scan), for: [near] } }
signals: { /scan: { variable: scan }, /near: { variable: near } }
needs: { near: { max_age: 1 s } }
";
    let lines = "{\"signal\":\"/scan\",\"time_ns\":0,\"received_ns\":0,\"value\":[1,2]}\n";
    let folder = Folder::with(&[("m.yaml", model.as_bytes()), ("a.jsonl", lines.as_bytes())]);
    folder.refuses("replay m.yaml a.jsonl --compare scan", &["'scan' is a vector"]);
    folder.refuses("replay m.yaml a.jsonl --compare naer", &["did you mean 'near'?"]);
    folder.refuses("replay m.yaml b.jsonl --compare near", &["b.jsonl"]);
    folder.refuses("replay m.yaml a.jsonl --period 2s", &["--compare <VARIABLE>"]);
    folder.refuses("replay m.yaml a.jsonl --compare near --inject drop:/scan", &["cannot be used with"]);
    folder.write("other.csv", "t [s],other\n0,1\n");
    folder.refuses("replay m.yaml other.csv --compare near", &["none of the model's signals"]);
    folder.run("replay m.yaml a.jsonl --journal j.jsonl");
    folder.refuses("replay m.yaml j.jsonl --compare near", &["is the journal of a run"]);
}
