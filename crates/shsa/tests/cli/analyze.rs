//! `shsa analyze`: which faults a model can detect, isolate and heal.

use crate::folder::{Folder, keys};
use crate::tank;
use serde_json::{Value, json};

const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models");

fn analysis(model: &str) -> Value {
    Folder::new().json(&format!("analyze {MODELS}/{model}.yaml"), 0)
}

/// One key of all signals, in file order.
fn of_signals<'a>(answer: &'a Value, key: &str) -> Vec<&'a Value> {
    answer["signals"].as_array().unwrap().iter().map(|signal| &signal[key]).collect()
}

#[test]
fn the_tank_as_json() {
    let answer = tank::folder().json("analyze tank.yaml", 0);
    let found = [
        "signals",
        "relations",
        "needs",
        "comparisons",
        "watch",
        "watched",
        "undetectable",
        "not_told_apart",
        "gaps",
        "unhealed",
        "additions",
        "structure",
        "only_runnable",
        "without_formula",
        "limited",
        "left_out",
    ];
    assert_eq!(keys(&answer), found);
    let level = json!({
        "signal": "/level", "variable": "level", "detectable": true, "shown_by": 2,
        "isolable_from": ["/pressure", "/volume"], "isolable_from_relations": ["hydrostatic", "cylinder"], "substitutable": true, "tolerates": 2, "exact": true,
        "isolable_in_part_from": [], "in_part": [], "needs_lost": [],
    });
    assert_eq!(answer["signals"][0], level);
    // A component that is in every comparison of the relation cannot be told from it.
    let hydrostatic = json!({
        "relation": "hydrostatic", "prior": null, "detectable": true, "shown_by": 2,
        "isolable_from": ["/level", "/volume", "cylinder"], "isolable_in_part_from": [], "in_part": [],
    });
    assert_eq!(answer["relations"][0], hydrostatic);
    let need = json!({
        "need": "/healed/level", "variable": "level", "served": true, "survives": 2, "exact": true,
        "single_points": [], "taken_by": ["/level", "/pressure", "/volume"],
    });
    assert_eq!(answer["needs"], json!([need]));
    assert_eq!((&answer["comparisons"], &answer["unhealed"]), (&json!(3), &json!(["/volume"])));
    assert_eq!(answer["watch"], json!({ "ways": 32, "cost_per_second": 10_000_000 }));
    let watched: Vec<Value> =
        answer["watched"].as_array().unwrap().iter().map(|watch| watch["variable"].clone()).collect();
    assert_eq!(watched, ["level", "pressure"]);
    assert_eq!((&answer["watched"][0]["ways"], &answer["watched"][0]["possible"]), (&json!(3), &json!(3)));
    let first = json!({
        "kind": "sensor", "relation": null, "variables": ["volume"], "detectable": [], "isolable_pairs": 0,
        "substitutable": ["/volume"], "survives": [{ "need": "/healed/level", "from": 2, "to": 3 }],
    });
    assert_eq!(answer["additions"][0], first);
}

#[test]
fn the_tank_as_text() {
    let reported = tank::folder().ends("analyze tank.yaml", 0).stdout;
    let expected = "\
signal     carries   detectable  isolable  substitutable  tolerates  its loss takes
/level     level     yes         2 of 2    yes            2
/pressure  pressure  yes         2 of 2    yes            2
/volume    volume    yes         2 of 2    no             0

relation     detectable  isolable
hydrostatic  yes         3 of 4
cylinder     yes         3 of 4

need           variable  survives losses  single points of failure
/healed/level  level     2                -

Signals that nothing replaces:
  /volume

what would help most         detectable  isolable pairs  substitutable  needs survive losses
one more sensor of volume    -           -               +1             2 to 3 for /healed/level
one more sensor of level     -           -               -              2 to 3 for /healed/level
one more sensor of pressure  -           -               -              2 to 3 for /healed/level

watched variable  ways of knowing  operations a second
level             3 of 3           39
pressure          2 of 2           15

structure
degree of redundancy               2
overdetermined part                5 equations over 3 variables
just-determined part               -
underdetermined part               -
minimal overdetermined sets (MSO)  3
minimal test supports (MTES)       3
";
    assert_eq!(reported, expected);
}

#[test]
fn five_witnesses_of_a_car_tell_every_fault_and_survive_four_losses() {
    let answer = analysis("car");
    let (speeds, turns) = answer["signals"].as_array().unwrap().split_at(5);
    for signal in speeds {
        assert_eq!((&signal["detectable"], &signal["tolerates"]), (&json!(true), &json!(4)));
        assert_eq!(signal["isolable_from"].as_array().unwrap().len(), 6);
    }
    // The gyroscope and the steering wheel have only each other as witness.
    for signal in turns {
        assert_eq!((&signal["detectable"], &signal["tolerates"]), (&json!(true), &json!(0)));
    }
    let not_told_apart = json!([["gyro", "steering_angle"]]);
    assert_eq!((&answer["needs"][0]["survives"], &answer["not_told_apart"]), (&json!(4), &not_told_apart));
}

#[test]
fn two_motes_in_a_room_cannot_tell_which_one_lies() {
    let answer = analysis("motes");
    assert!(of_signals(&answer, "detectable").iter().all(|detectable| **detectable == json!(true)));
    assert_eq!(answer["not_told_apart"][0], json!(["mote_1_temperature", "mote_2_temperature"]));
    assert_eq!(answer["not_told_apart"].as_array().unwrap().len(), 4);
    // A third witness tells the two apart: another sensor, or the other room if a relation connects it.
    let first = &answer["additions"][0];
    assert_eq!((&first["kind"], &first["isolable_pairs"]), (&json!("relation"), &json!(4)));
}

#[test]
fn the_rovers_speed_has_no_witness_as_reckoning_is_none() {
    let answer = analysis("rover");
    assert_eq!(answer["undetectable"], json!(["/odom/speed"]));
    assert_eq!(of_signals(&answer, "tolerates"), [2, 2, 0, 0]);
    assert_eq!(answer["needs"][0]["survives"], 2);
    let first = &answer["additions"][0];
    assert_eq!((&first["variables"], &first["detectable"]), (&json!(["speed"]), &json!(["/odom/speed"])));
}

#[test]
fn a_height_without_a_second_source_is_a_single_point_of_failure() {
    let answer = analysis("quad");
    let needs = answer["needs"].as_array().unwrap();
    let height = needs.iter().find(|need| need["variable"] == "height").unwrap();
    assert_eq!((&height["survives"], &height["single_points"]), (&json!(0), &json!(["height"])));
}

#[test]
fn a_need_that_nothing_serves_is_the_answer_no() {
    let model = "\
shsa: 1
variables: { a: {}, b: {} }
relations: { r: { output: b, inputs: [a] } }
signals: { s: { variable: a } }
needs: { b: { signal: /b, max_age: 1 s } }
";
    let folder = Folder::with(&[("m.yaml", model.as_bytes())]);
    let answer = folder.json("analyze m.yaml", 0);
    assert_eq!(
        (&answer["needs"][0]["single_points"], &answer["without_formula"]),
        (&json!(["s"]), &json!(["r"]))
    );
    let reported = folder.ends("analyze m.yaml", 0).stdout;
    assert!(
        reported.ends_with(
            "1 relation has no formula and counts as if it had one (not so with --only-runnable).\n"
        )
    );
    let answer = folder.json("analyze m.yaml --only-runnable", 1);
    assert_eq!(
        (&answer["needs"][0]["served"], &answer["needs"][0]["survives"]),
        (&json!(false), &Value::Null)
    );
}

/// The published figures of the Fault Diagnosis Toolbox (Frisk, Krysander, Jung 2017).
#[test]
fn the_water_tank_of_the_toolbox_has_its_figures() {
    let structure = &analysis("watertank")["structure"];
    assert_eq!(structure["mso"], json!({ "count": 17, "stop": "complete" }));
    assert_eq!(structure["mtes"], json!({ "count": 10, "stop": "complete" }));
}

#[test]
fn the_engine_of_the_toolbox_has_its_figures() {
    assert_eq!(analysis("engine")["structure"]["mso"], json!({ "count": 4496, "stop": "complete" }));
}

#[test]
fn as_many_additions_as_asked_for() {
    let folder = tank::folder();
    let count = |arguments: &str| {
        let answer = folder.json(&format!("analyze tank.yaml {arguments}"), 0);
        answer["additions"].as_array().unwrap().len()
    };
    assert_eq!([count(""), count("--additions 1"), count("--additions 0")], [3, 1, 0]);
}

/// Five sensors of one number, the last two of which have a common source.
const FIVE: &str = "\
shsa: 1
variables: { x: { unit: m } }
signals:
  a: { variable: x, rate: 10 Hz }
  b: { variable: x, rate: 10 Hz }
  c: { variable: x, rate: 10 Hz }
  d: { variable: x, rate: 10 Hz, source: gps#x }
  e: { variable: x, rate: 10 Hz, source: /gps#x, unit: cm }
";

#[test]
fn what_the_budget_leaves_out_is_reported() {
    let folder = Folder::with(&[("m.yaml", FIVE.as_bytes())]);
    let watched = |flags: &str| {
        let answer = folder.json(&format!("analyze m.yaml {flags}"), 0);
        let watch = &answer["watched"][0];
        (watch["ways"].clone(), watch["possible"].clone(), watch["hidden"].as_array().unwrap().len())
    };
    assert_eq!(watched(""), (json!(4), json!(4), 0));
    // The number limits computed ways; signals are never left out.
    assert_eq!(watched("--watch 2"), (json!(4), json!(4), 0));
    // With two ways, a difference is detected but not isolated, and the two others are not compared.
    assert_eq!(watched("--watch-cost 200"), (json!(2), json!(4), 4));
    assert_eq!(watched("--watch-cost 0"), (json!(0), json!(4), 4));
    let reported = folder.ends("analyze m.yaml --watch-cost 400", 0).stdout;
    assert!(
        reported.contains(
            "Faults that only more ways would tell (--watch, --watch-cost):\n  x: d does not show\n"
        )
    );
    assert!(reported.contains("x                 3 of 4"), "{reported}");
    folder.refuses("analyze m.yaml --watch 1", &["from 2 on"]);
    let html = "analyze m.yaml --watch-cost 400 --html page.html";
    folder.ends(html, 0);
    assert!(folder.read("page.html").contains("d does not show"));
}

#[test]
fn signals_from_one_source_are_a_note_of_check_only() {
    let folder = Folder::with(&[("m.yaml", FIVE.as_bytes())]);
    let answer = folder.json("check m.yaml", 0);
    let note = &answer["diagnostics"][0];
    assert_eq!((&note["severity"], &note["line"]), (&json!("note"), &json!(8)));
    let reported = folder.ends("check m.yaml", 0).stdout;
    assert!(
        reported.starts_with("note: `e` has the same source as `d`: it bears no witness for it\n"),
        "{reported}"
    );
    assert_eq!(folder.ends("analyze m.yaml", 0).stderr, "");
}

/// Signals and needs may have any name; variables cannot.
const HOSTILE: &str = "\
shsa: 1
variables: { a: { unit: m }, b: { unit: m } }
relations: { r: a = b }
signals:
  \"</td>&amp;\\\"' onmouseover='x\": { variable: a }
  \"-->\\u202e<b>\": { variable: a }
  \"</style><img src=x>\": { variable: b }
needs:
  a: { signal: \"</title><script>\", max_age: 1 s }
";

/// The page has no external resources and no scripts, and escapes names.
#[test]
fn the_page_stands_alone_and_names_are_only_shown() {
    let folder = Folder::with(&[("h.yaml", HOSTILE.as_bytes()), ("tank.yaml", tank::MODEL.as_bytes())]);
    for model in ["h.yaml", "tank.yaml"] {
        folder.ends(&format!("analyze {model} --html page.html"), 0);
        let page = folder.read("page.html");
        assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
        for foreign in
            ["<script", "<img", "-->", "http:", "https:", "' onmouseover", "url(", "@import", "\u{202e}"]
        {
            let found = page.replace("http://www.w3.org/2000/svg", "").contains(foreign);
            assert!(!found, "{model}: {foreign}");
        }
        assert_eq!(page.matches("</style>").count(), page.matches("<style>").count());
        assert_eq!(page.matches("<td").count(), page.matches("</td>").count());
        for reported in ["Isolable from", "What would help most", "class=\"matrix\"", "<svg"] {
            assert!(page.contains(reported), "{model}: {reported}");
        }
    }
}

#[test]
fn a_page_that_cannot_be_written_is_an_error() {
    tank::folder().refuses("analyze tank.yaml --html no/such/folder.html", &["no/such/folder.html"]);
}

/// A thousand signals in a hundred robots take seconds, and limits that were reached are reported.
#[test]
fn a_thousand_signals_come_back() {
    let mut model = "shsa: 1\nvariables:\n".to_owned();
    let names: Vec<String> =
        (0..100).flat_map(|robot| (0..10).map(move |at| format!("x{robot}_{at}"))).collect();
    names.iter().for_each(|name| model += &format!("  {name}: {{ unit: m }}\n"));
    model += "relations:\n";
    for pair in names.chunks(10).flat_map(|robot| robot.windows(2)) {
        let [one, other] = pair else { unreachable!() };
        model += &format!("  {one}_{other}: {{ outputs: [{one}, {other}], inputs: [{one}, {other}] }}\n");
    }
    model += "signals:\n";
    names.iter().for_each(|name| model += &format!("  /{name}: {{ variable: {name} }}\n"));
    let folder = Folder::with(&[("large.yaml", model.as_bytes())]);
    let answer = folder.json("analyze large.yaml", 0);
    assert!(of_signals(&answer, "detectable").iter().all(|detectable| **detectable == json!(true)));
    assert!(of_signals(&answer, "tolerates").iter().all(|tolerates| **tolerates == json!(9)));
    let limited = answer["limited"].as_array().unwrap();
    assert!(limited.iter().any(|limit| limit["what"] == "additions"), "{limited:?}");
}

/// A model of 100,000 signals within a memory limit of 768 MiB (`ulimit -v`).
#[test]
fn a_huge_model_is_analysed_in_part_and_that_is_reported() {
    const SIGNALS: usize = 100_000;
    let folder = Folder::new();
    let mut text = String::from("shsa: 1\nvariables:\n");
    (0..SIGNALS / 4).for_each(|at| text += &format!("  v{at}: {{ unit: m }}\n"));
    text += "signals:\n";
    (0..SIGNALS).for_each(|at| {
        text += &format!("  s{at}: {{ variable: v{}, unit: m, value_error: 0.1 }}\n", at / 4);
    });
    text += "needs: { v0: { max_age: 1 s } }\n";
    folder.write("huge.yaml", &text);
    let run = |line: &str| {
        let line = format!("ulimit -v 786432 && exec {} {line}", crate::PROGRAM);
        let mut command = std::process::Command::new("sh");
        command.args(["-c", &line]).current_dir(folder.path(".")).output().unwrap()
    };
    let analysed = run("analyze huge.yaml --additions 0");
    let reported = String::from_utf8_lossy(&analysed.stderr);
    assert!(analysed.status.success(), "{:?} {reported}", analysed.status);
    let expected =
        "100000 signals, more than 4000 (--signals): the last 96000 are left out, as if they were not there";
    assert!(reported.contains(expected), "{reported}");
    let checked = run("check huge.yaml");
    let reported = String::from_utf8_lossy(&checked.stdout);
    assert!(checked.status.success(), "{:?} {reported}", checked.status);
    assert!(reported.contains("which faults no comparison shows was not looked for"), "{reported}");
}

#[test]
fn what_is_left_out_is_as_if_it_was_not_there() {
    let text = "
shsa: 1
variables: { x: { unit: m } }
signals:
  a: { variable: x, unit: m, value_error: 0.1 }
  b: { variable: x, unit: m, value_error: 0.1, derived_from: [c] }
  c: { variable: x, unit: m, value_error: 0.1 }
needs: { x: { max_age: 1 s } }
";
    let folder = Folder::with(&[("three.yaml", text.as_bytes())]);
    let whole = folder.json("analyze three.yaml", 0);
    assert_eq!((&whole["left_out"], of_signals(&whole, "signal").len()), (&json!(0), 3));
    let part = folder.json("analyze three.yaml --signals 2", 0);
    assert_eq!((&part["left_out"], of_signals(&part, "signal")), (&json!(1), vec![&json!("a"), &json!("b")]));
    assert_eq!(part["needs"][0]["survives"], 1);
}

#[test]
fn squares_and_derivatives_show_a_fault_only_in_part() {
    let folder = Folder::new();
    let model = "shsa: 1\nvariables: { v: {}, z: {}, x: {}, r: {} }\nrelations:\n  square: { equation: \"z = v^2\" }\n  \
                 rate: { equation: \"r = derivative(x, 1 s)\", for: r }\nsignals:\n  /v: { variable: v, rate: 1 Hz }\n  \
                 /z: { variable: z, rate: 1 Hz }\n  /x: { variable: x, rate: 9 Hz }\n  /r: { variable: r, rate: 1 Hz }\n";
    folder.write("m.yaml", model);
    let answer = folder.json("analyze m.yaml", 0);
    let square = "square has several solutions: it hides a fault that leads to another one of them";
    let rate = "rate takes only a derivative: it shows a change, and an offset only for the window of the derivative";
    let in_part = [json!([square]), json!([]), json!([rate]), json!([])];
    assert_eq!(of_signals(&answer, "in_part"), in_part.iter().collect::<Vec<_>>());
    assert!(of_signals(&answer, "detectable").iter().all(|detectable| **detectable == json!(true)));
}

/// Three of the tank's sensors know each variable: one may lie.
#[test]
fn the_liars_that_a_need_withstands() {
    let folder = tank::folder();
    let answer = folder.json("analyze tank.yaml --liars", 0);
    let found = &answer["liars"]["signals"][0];
    let expected = json!({
        "need": "/healed/level", "withstands": 1, "exact": true, "coalition": found["coalition"], "is_tie": false,
        "more_signals_for_one_more": 2,
    });
    assert_eq!(*found, expected, "{answer}");
    assert_eq!(found["coalition"].as_array().unwrap().len(), 2);
    assert_eq!(answer["liars"]["causes"], Value::Null);
    let text = folder.run("analyze tank.yaml --liars").stdout;
    assert!(text.contains("withstands lying signals") && text.contains("Where too many lie"), "{text}");
    assert!(!folder.run("analyze tank.yaml").stdout.contains("lying"));
}
