//! `shsa check`: problems with their positions.

use crate::folder::{Folder, keys};
use crate::tank;

const TYPOS: &str = "\
shsa: 1
variables:
  level: { unti: m }
signals:
  /level: { variable: level }
  /other: { variable: levl }
";

#[test]
fn a_right_model_is_ok() {
    let folder = tank::folder();
    let output = folder.ends("check tank.yaml", 0);
    assert_eq!(output.stdout, "tank.yaml: ok: 3 variables, 2 relations, 3 signals, 1 need\n");
    assert_eq!(output.stderr, "");
    let answer = folder.json("check tank.yaml", 0);
    let expected = r#"{"ok":true,"variables":3,"relations":2,"signals":3,"needs":1,"diagnostics":[]}"#;
    assert_eq!(answer.to_string(), expected);
}

/// A need that rests on one signal, which nothing confirms, is noted; the model is right all the same.
#[test]
fn what_nothing_confirms_is_noted() {
    let two = "shsa: 1\nvariables: { v: { unit: m/s } }\nsignals: { a: { variable: v }, b: { variable: v } }\nneeds: { v: { signal: out } }\n";
    let one = two.replace(", b: { variable: v }", "");
    let folder = Folder::with(&[("two.yaml", two.as_bytes()), ("one.yaml", one.as_bytes())]);
    let noted = folder.ends("check one.yaml", 0).stdout;
    assert!(noted.contains("note: out rests on a alone, and nothing confirms it"), "{noted}");
    assert!(!folder.ends("check two.yaml", 0).stdout.contains("confirms"));
}

#[test]
fn problems_have_places_and_help() {
    let folder = Folder::with(&[("bad.yaml", TYPOS.as_bytes())]);
    let output = folder.ends("check bad.yaml", 2).stdout;
    for words in ["bad.yaml:3:12", "did you mean `unit`?", "bad.yaml:6:23", "did you mean `level`?"] {
        assert!(output.contains(words), "no '{words}' in {output}");
    }
    assert!(output.ends_with("\n\nbad.yaml: 2 errors\n"), "{output}");
}

#[test]
fn problems_as_json() {
    let folder = Folder::with(&[("bad.yaml", TYPOS.as_bytes())]);
    let answer = folder.json("check bad.yaml", 2);
    assert_eq!(keys(&answer), ["ok", "variables", "relations", "signals", "needs", "diagnostics"]);
    assert_eq!(answer["ok"], false);
    let first = &answer["diagnostics"][0];
    assert_eq!(keys(first), ["severity", "message", "file", "line", "column", "help"]);
    assert_eq!((&first["line"], &first["column"]), (&3.into(), &12.into()));
    assert_eq!(answer["diagnostics"].as_array().unwrap().len(), 2);
}

#[test]
fn warnings_do_not_make_a_model_bad() {
    let model =
        tank::MODEL.replace("  volume:   { unit: l }", "  volume:   { unit: l }\n  spare:    { unit: m }");
    let folder = Folder::with(&[("tank.yaml", model.as_bytes())]);
    let output = folder.ends("check tank.yaml", 0).stdout;
    assert!(
        output.contains("warning: nothing uses `spare`") && output.contains("tank.yaml: ok: 4"),
        "{output}"
    );
    let answer = folder.json("check tank.yaml", 0);
    assert_eq!(answer["diagnostics"][0]["severity"], "warning");
}

#[test]
fn a_relation_that_serves_one_variable_of_three_is_noted() {
    let model = "\
shsa: 1
variables:
  temperature: { range: [-20, 60] }
  humidity: { range: [0, 100] }
  dew_point: { range: [-30, 50] }
functions:
  slope(t): 17.62 * t / (243.12 + t)
relations:
  magnus: { equation: slope(dew_point) = ln(humidity / 100) + slope(temperature), error: 0.1 }
  alone: { equation: humidity = floor(dew_point), for: [humidity], error: 1 }
  guarded: { equation: temperature = 2 * dew_point, when: humidity > 50 }
signals:
  t: { variable: temperature }
  h: { variable: humidity }
  d: { variable: dew_point }
";
    let folder = Folder::with(&[("m.yaml", model.as_bytes())]);
    let answer = folder.json("check m.yaml", 0);
    let notes: Vec<_> = answer["diagnostics"].as_array().unwrap().iter().collect();
    // `for` restricts the directions on purpose, and a variable that only a condition reads needs no direction.
    let [note] = notes.as_slice() else { panic!("{notes:?}") };
    assert_eq!((&note["severity"], &note["line"], &note["column"]), (&"note".into(), &9.into(), &69.into()));
    let message = "this relation is not solved for `temperature`, `dew_point`: it occurs 2 times";
    assert_eq!(note["message"], message);
    assert!(
        note["help"].as_str().unwrap().starts_with("write the equation so that it occurs once"),
        "{note}"
    );
    assert!(folder.ends("check m.yaml", 0).stdout.starts_with(&format!("note: {message}\n")));
    assert_eq!(folder.ends("plan m.yaml humidity", 0).stderr, "");
}

#[test]
fn what_the_budget_leaves_out_is_a_warning() {
    let signals: String = (0..40).map(|at| format!("  s{at}: {{ variable: x, rate: 10 kHz }}\n")).collect();
    let model = format!("shsa: 1\nvariables: {{ x: {{}} }}\nsignals:\n{signals}");
    let folder = Folder::with(&[("m.yaml", model.as_bytes())]);
    let answer = folder.json("check m.yaml", 0);
    let warning = &answer["diagnostics"][0];
    assert_eq!((&warning["severity"], &answer["ok"]), (&"warning".into(), &true.into()));
    let message = warning["message"].as_str().unwrap();
    assert!(message.contains(" of 40 ways of knowing x are watched"), "{message}");
    assert!(message.contains("no comparison shows a fault of s"), "{message}");
    assert!(folder.ends("check m.yaml", 0).stdout.contains(" of 40 ways"));
}

#[test]
fn json_models_windows_line_ends_and_byte_order_marks() {
    let json = r#"{"shsa": 1, "variables": {"x": {"unit": "m"}}, "signals": {"/a": {"variable": "x"}}}"#;
    let folder = Folder::with(&[
        ("model.json", json.as_bytes()),
        ("windows.yaml", tank::MODEL.replace('\n', "\r\n").as_bytes()),
        ("marked.yaml", format!("\u{feff}{}", tank::MODEL).as_bytes()),
    ]);
    for model in ["model.json", "windows.yaml", "marked.yaml"] {
        folder.ends(&format!("check {model}"), 0);
    }
}

#[test]
fn what_is_no_model_is_reported() {
    let folder = Folder::with(&[
        ("empty.yaml", b""),
        ("run.csv", b"t [s],/level\n0,1\n"),
        ("binary.yaml", b"\x7fELF\xff\xfe\x00"),
    ]);
    std::fs::create_dir(folder.path("folder")).unwrap();
    for (file, words) in [
        ("empty.yaml", "the model is empty"),
        ("run.csv", "expected a model"),
        ("binary.yaml", "not UTF-8"),
        ("folder", "cannot read the model"),
        ("nothing.yaml", "cannot read the model"),
    ] {
        let output = folder.ends(&format!("check {file}"), 2).stdout;
        assert!(output.contains(words) && output.ends_with(&format!("{file}: 1 error\n")), "{output}");
        let answer = folder.json(&format!("check {file}"), 2);
        assert_eq!(answer["diagnostics"].as_array().unwrap().len(), 1);
    }
}

#[test]
fn a_need_that_nothing_meets_is_reported_beforehand() {
    let needs = "needs:\n  v:\n    - { signal: /all, max_age: 1 s }\n    - { signal: /fast, min_rate: 20 Hz }\n    - { signal: /safe, integrity: B }\n";
    let model = "shsa: 1\nvariables: { v: { unit: m } }\nsignals:\n  a: { variable: v, rate: 10 Hz, value_error: 0.2 }\n";
    let folder = Folder::with(&[("model.yaml", format!("{model}{needs}").as_bytes())]);
    let output = folder.ends("check model.yaml", 0).stdout;
    assert!(
        output.contains("nothing meets what the need /fast demands: signals of v come 10 times a second"),
        "{output}"
    );
    assert!(output.contains("the need /safe demands") && !output.contains("the need /all"), "{output}");
}

#[test]
fn an_input_that_stands_without_a_limit_is_reported() {
    let model = |voltage: &str| {
        format!(
            "shsa: 1\nvariables: {{ power: {{ unit: W }}, voltage: {{ unit: V{voltage} }}, current: {{ unit: A }} }}\n\
             relations:\n  ohm: {{ equation: power = voltage * current }}\nsignals:\n  /p: {{ variable: power, rate: 10 Hz }}\n  \
             /u: {{ variable: voltage, rate: 1 Hz }}\n  /i: {{ variable: current, rate: 10 Hz }}\nneeds: {{ power: {{ max_age: 1 s }} }}\n"
        )
    };
    let folder = Folder::new();
    folder.write("m.yaml", model(""));
    let output = folder.ends("check m.yaml", 0).stdout;
    let words = "warning: substitutes of power hold /u between two values as if nothing changed: give voltage a `max_rate`";
    assert!(output.starts_with(words), "{output}");
    folder.write("m.yaml", model(", max_rate: 2 V/s"));
    assert!(!folder.ends("check m.yaml", 0).stdout.contains("warning"));
}

/// A cell whose resistance is learned, with one more key.
fn cell(more: &str) -> String {
    format!(
        "\
shsa: 1
variables:
  voltage: {{ unit: V, range: [2, 5] }}
  rest: {{ unit: V, range: [2, 5] }}
  current: {{ unit: A, range: [0, 60] }}
  resistance: {{ unit: mohm, range: [15, 60], max_rate: 0.1 mohm/h }}
relations:
  terminal: {{ equation: voltage = rest - resistance * current, learn: resistance }}
signals:
  /voltage: {{ variable: voltage, rate: 1 Hz, value_error: 0.005 }}
  /current: {{ variable: current, rate: 1 Hz, value_error: 0.1 }}
{more}"
    )
}

#[test]
fn what_is_learned_is_not_needed_and_needs_values_of_its_relation() {
    let rest = "  /rest: { variable: rest, rate: 1 Hz, value_error: 0.005 }\n";
    let folder = Folder::new();
    let check = |more: &str, status: i32, words: &str| {
        std::fs::write(folder.path("cell.yaml"), cell(more)).unwrap();
        let output = folder.ends("check cell.yaml", status).stdout;
        assert!(output.contains(words), "no '{words}' in {output}");
    };
    check(rest, 0, "cell.yaml: ok");
    check("", 0, "warning: `resistance` is never learned: nothing can provide `rest`");
    let need = format!("{rest}needs:\n  resistance: {{ max_age: 1 s }}\n");
    check(&need, 2, "`resistance` is learned, and what is learned is not published");
}
