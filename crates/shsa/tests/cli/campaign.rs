//! `shsa campaign`: a grid of faults on recordings.

use crate::folder::{Folder, keys};
use crate::tank;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fmt::Write;

/// Two minutes without a fault; the level always changes.
fn clean() -> String {
    let mut text = "t [s],/level,/pressure,/volume\n".to_owned();
    for second in 0..=120 {
        let level = 2.0 + 0.5 * (f64::from(second) / 10.0).sin();
        writeln!(text, "{second},{level:.4},{:.4},{:.4}", 9.81 * level, 1000.0 * level).unwrap();
    }
    text
}

fn folder() -> Folder {
    Folder::with(&[
        ("tank.yaml", tank::MODEL.as_bytes()),
        ("clean.csv", clean().as_bytes()),
        ("lie.csv", tank::csv().as_bytes()),
    ])
}

#[track_caller]
fn campaign(folder: &Folder, arguments: &str) -> Value {
    let ended = folder.ends(&format!("campaign tank.yaml {arguments} --json -"), 0);
    assert_eq!(ended.stdout.lines().count(), 1, "{}", ended.stdout);
    serde_json::from_str(&ended.stdout).unwrap()
}

#[track_caller]
fn cells(campaign: &Value) -> &[Value] {
    campaign["cells"].as_array().unwrap()
}

/// The result of a replay with the fault of a cell: latency, isolated, wrong blame.
fn replayed(folder: &Folder, cell: &Value, onset: f64) -> (Option<f64>, bool, bool) {
    let (kind, signal) = (cell["kind"].as_str().unwrap(), cell["signal"].as_str().unwrap());
    let amount = cell["amount"].as_f64().map_or(String::new(), |amount| format!("={amount}"));
    let unit = if kind == "delay" { "s" } else { "" };
    let ended = folder
        .run(&format!("replay tank.yaml clean.csv --inject {kind}{amount}{unit}:{signal}@{onset}s.. --json"));
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let events_of = |kinds: &[&str]| -> Vec<&Value> {
        let events = report["events"].as_array().unwrap().iter();
        events.filter(|event| kinds.contains(&event["kind"].as_str().unwrap())).collect()
    };
    let first =
        events_of(&["suspected", "failed", "silent"]).first().map(|event| event["time_s"].as_f64().unwrap());
    let named: BTreeSet<&str> =
        events_of(&["failed", "silent"]).iter().map(|event| event["signal"].as_str().unwrap()).collect();
    let only = named.len() == 1 && named.contains(signal);
    (first.map(|first| first - onset), only, named.iter().any(|one| *one != signal))
}

#[test]
fn a_cell_says_what_a_replay_with_its_fault_says() {
    let folder = folder();
    let campaign =
        campaign(&folder, "clean.csv --onsets 1 --kinds stuck,bias,drop,noise,drift,spike,scale,delay");
    assert_eq!(keys(&campaign)[..4], ["settings", "observations", "clean_alarms", "left_out"]);
    assert_eq!(campaign["settings"]["onsets_s"], serde_json::json!([90.0]));
    assert_eq!(cells(&campaign).len(), 3 * (2 + 6 * 3));
    let mut verdicts = BTreeSet::new();
    for cell in cells(&campaign) {
        let (latency, isolated, wrong) = replayed(&folder, cell, 90.0);
        assert_eq!(cell["detected"], u64::from(latency.is_some()), "{cell}");
        assert_eq!(cell["not_told"], u64::from(latency.is_none()), "{cell}");
        assert_eq!(cell["isolated"], u64::from(isolated), "{cell}");
        assert_eq!(cell["wrong_blame"], u64::from(wrong), "{cell}");
        let reported = cell["latency_median_s"].as_f64();
        assert_eq!(reported.is_some(), latency.is_some());
        assert!((reported.unwrap_or(0.0) - latency.unwrap_or(0.0)).abs() < 1e-6, "{cell}: {latency:?}");
        verdicts.insert((latency.is_some(), isolated));
    }
    assert!(verdicts.len() > 1, "nothing differs: {verdicts:?}");
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let folder = folder();
    let run = |threads| {
        let files = format!("--threads {threads} --json {threads}.json --html {threads}.html");
        folder.ends(&format!("campaign tank.yaml clean.csv --seeds 2 {files}"), 0).stdout
    };
    assert_eq!(run(1), run(3));
    assert_eq!(folder.read("1.json"), folder.read("3.json"));
    assert_eq!(folder.read("1.html"), folder.read("3.html"));
}

#[test]
fn large_drifts_are_isolated_and_healed_and_seeds_count_where_there_is_chance() {
    let report = campaign(&folder(), "clean.csv --kinds drift,noise --amounts 16 --seeds 4 --signals /level");
    let [drift, noise] = cells(&report) else { panic!("{report}") };
    assert_eq!((&drift["runs"], &noise["runs"]), (&3.into(), &12.into()));
    assert_eq!(
        (&drift["detected"], &drift["isolated"], &drift["wrong_blame"]),
        (&3.into(), &3.into(), &0.into())
    );
    assert_eq!(drift["needs"]["/healed/level"]["unmet"], 0);
    assert_eq!(report["all"]["runs"], 15);
}

#[test]
fn what_nobody_contradicts_is_published_with_its_error_and_what_nothing_replaces_is_unmet() {
    let folder = folder();
    let alone: Vec<&str> = tank::MODEL.lines().filter(|line| !line.starts_with("  /pressure")).collect();
    let alone: Vec<&str> = alone.into_iter().filter(|line| !line.starts_with("  /volume")).collect();
    folder.write("tank.yaml", alone.join("\n"));
    let report = campaign(&folder, "clean.csv --kinds bias,drop --amounts 8");
    let [bias, drop] = cells(&report) else { panic!("{report}") };
    assert_eq!((&bias["detected"], &bias["unmet"], &bias["amount"]), (&0.into(), &0.into(), &0.4.into()));
    // The bias is 0.4 m, and both intervals have a half width of 0.05 m.
    let error = bias["needs"]["/healed/level"]["max_error"].as_f64().unwrap();
    assert!((error - 0.3).abs() < 1e-9, "{error}");
    assert_eq!((&drop["isolated"], &drop["needs"]["/healed/level"]["unmet"]), (&3.into(), &3.into()));
}

#[test]
fn alarms_before_the_fault_are_false_and_those_of_the_clean_run_are_no_detection() {
    let report = campaign(&folder(), "lie.csv --kinds drop --signals /volume --onsets 1 --duration 10s");
    assert!(report["clean_alarms"].as_u64().unwrap() > 0, "{report}");
    assert!(cells(&report)[0]["false_alarms"].as_u64().unwrap() > 0, "{report}");
    // The recording's own fault at 30 s falls into this bias, which is far too small to be detected.
    let small = "lie.csv --kinds bias --amounts 0.001 --signals /volume --onsets 1 --duration 35s";
    let report = campaign(&folder(), small);
    assert!(report["clean_alarms"].as_u64().unwrap() > 0, "{report}");
    let cell = &cells(&report)[0];
    assert_eq!((&cell["runs"], &cell["detected"], &cell["false_alarms"]), (&1.into(), &0.into(), &0.into()));
}

#[test]
fn a_fault_that_changes_nothing_is_no_run() {
    let folder = folder();
    let still: String = (0..60).map(|second| format!("{second},2.0,19.62,2000\n")).collect();
    folder.write("still.csv", format!("t [s],/level,/pressure,/volume\n{still}"));
    let report = campaign(&folder, "still.csv --kinds stuck,drop");
    for cell in cells(&report) {
        let none = if cell["kind"] == "stuck" { 3 } else { 0 };
        assert_eq!((&cell["without_effect"], &cell["runs"]), (&none.into(), &(3 - none).into()), "{cell}");
        assert_eq!(cell["detection_rate"].is_null(), none == 3, "{cell}");
    }
}

#[test]
fn what_declares_no_error_is_tried_with_amounts_that_are_seen_unless_it_stands_still() {
    let folder = folder();
    folder.write("tank.yaml", tank::MODEL.replace(", value_error: 0.5", ""));
    let kinds = |arguments: &str| -> BTreeSet<String> {
        let cells = campaign(&folder, arguments)["cells"].clone();
        let kind = |cell: &Value| cell["kind"].as_str().unwrap().to_owned();
        cells.as_array().unwrap().iter().map(kind).collect()
    };
    assert_eq!(kinds("clean.csv --signals /pressure").len(), 9);
    let still: String = (0..60).map(|second| format!("{second},2.0,19.62,2000\n")).collect();
    folder.write("still.csv", format!("t [s],/level,/pressure,/volume\n{still}"));
    let bare = ["delay", "drop", "stuck"].map(str::to_owned);
    assert_eq!(kinds("still.csv --signals /pressure"), BTreeSet::from(bare));
}

#[test]
fn a_worse_model_is_reported_by_status_and_cell() {
    let folder = folder();
    folder.ends("campaign tank.yaml clean.csv -o before.json", 0);
    let same = folder.ends("campaign tank.yaml clean.csv --compare before.json", 0);
    assert!(same.stdout.contains("counts better 0, worse 0"), "{}", same.stdout);
    let cylinder = "  cylinder:    { equation: volume = 1000 l/m * level, for: [level] }\n";
    assert!(tank::MODEL.contains(cylinder));
    folder.write("tank.yaml", tank::MODEL.replace(cylinder, ""));
    let worse =
        folder.ends("campaign tank.yaml clean.csv --compare before.json -o now.json --html now.html", 1);
    assert!(worse.stdout.contains("isolated"), "{}", worse.stdout);
    let now: Value = serde_json::from_str(&folder.read("now.json")).unwrap();
    assert_eq!(now["comparison"]["worse"], true);
    assert!(folder.read("now.html").contains("What has changed"));
    folder.write("tank.yaml", tank::MODEL);
    let better = folder.ends("campaign tank.yaml clean.csv --compare now.json", 0);
    assert!(better.stdout.contains("worse 0;"), "{}", better.stdout);
}

#[test]
fn the_page_stands_alone() {
    let folder = folder();
    folder.write("tank.yaml", tank::MODEL.replace("/volume:", "\"<b>&volume\":"));
    folder.write("clean.csv", clean().replace("/volume", "<b>&volume"));
    folder.ends("campaign tank.yaml clean.csv --kinds bias,drop --html page.html", 0);
    let page = folder.read("page.html");
    assert!(page.matches("<svg").count() >= 5, "{}", page.matches("<svg").count());
    assert!(page.contains("&lt;b&gt;&amp;volume") && !page.contains("<b>&volume"));
    for outside in ["src=", "href=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn bad_wishes_are_refused_before_anything_is_written() {
    let folder = folder();
    // The option by its earlier name.
    let noted = folder.ends("campaign tank.yaml clean.csv --json stored.json", 0).stderr;
    assert!(noted.contains("note: `shsa campaign --json FILE` is now `shsa campaign -o FILE`"), "{noted}");
    let stored = folder.read("stored.json");
    folder.write("other.json", "{}");
    folder.ends("replay tank.yaml clean.csv --journal run.journal", 0);
    let refuse = |arguments: &str, words: &[&str]| {
        folder.refuses(&format!("campaign tank.yaml {arguments}"), words);
    };
    refuse("clean.csv --duration 200s", &["lasts 120 s", "200 s"]);
    refuse("clean.csv --signals /levle", &["no signal '/levle'", "did you mean '/level'"]);
    refuse("clean.csv --kinds bent", &["bent", "possible values"]);
    refuse("clean.csv --amounts 0", &["other than 0"]);
    refuse("clean.csv --onsets 0", &["from 1 on"]);
    refuse("clean.csv --compare other.json", &["other.json is no campaign"]);
    refuse("clean.csv --compare absent.json", &["absent.json cannot be read"]);
    refuse("clean.csv --onsets 2 --compare stored.json --html page.html", &["not comparable", "onsets_s"]);
    refuse("clean.csv --compare stored.json --json stored.json", &["stored.json is in use"]);
    refuse("run.journal", &["is a journal"]);
    assert_eq!(folder.read("stored.json"), stored);
    assert!(!folder.names().contains(&"page.html".to_owned()));
}

/// Ten minutes of three healthy thermometers in one room, with reproducible noise.
fn room() -> String {
    let mut text = "t [s],/a,/b,/c\n".to_owned();
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.2 * ((state >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5)
    };
    for second in 0..600 {
        let true_value = 20.0 + 3.0 * (f64::from(second) / 20.0).sin();
        let values = [(); 3].map(|()| true_value + noise());
        writeln!(text, "{second},{:.4},{:.4},{:.4}", values[0], values[1], values[2]).unwrap();
    }
    text
}

const ROOM: &str = "\
shsa: 1
variables:
  warmth: { unit: K }
signals:
  /a: { variable: warmth, unit: K, rate: 1 Hz, value_error: 5 }
  /b: { variable: warmth, unit: K, rate: 1 Hz, value_error: 5 }
  /c: { variable: warmth, unit: K, rate: 1 Hz, value_error: 5 }
needs:
  warmth: { max_age: 5 s }
";

#[test]
fn detectable_amounts_follow_calibrate_and_begin_in_the_second_half() {
    let folder = Folder::with(&[("room.yaml", ROOM.as_bytes()), ("room.csv", room().as_bytes())]);
    let ended = folder.ends("calibrate room.yaml room.csv --faults=60s --patch patch.yaml --json", 0);
    let calibrated: Value = serde_json::from_str(&ended.stdout).unwrap();
    let smallest = &calibrated["smallest_faults"]["signals"];
    assert!(folder.read("patch.yaml").contains("smallest faults that give an alarm: bias "));
    let grid = "room.csv --detectable=3 --kinds bias,drift,drop --onsets 5 --seeds 3 --duration 60s";
    let ended = folder.ends(&format!("campaign room.yaml {grid} --markdown room.md --json -"), 0);
    let campaign: Value = serde_json::from_str(&ended.stdout).unwrap();
    for onset in campaign["settings"]["onsets_s"].as_array().unwrap() {
        assert!(onset.as_f64().unwrap() > 599.0 / 2.0, "{onset}");
    }
    assert_eq!(cells(&campaign).len(), 3 * 3);
    for cell in cells(&campaign).iter().filter(|cell| cell["kind"] != "drop") {
        let seen = |kind: &str| smallest[cell["signal"].as_str().unwrap()][kind]["amount"].as_f64().unwrap();
        let bias = seen("bias");
        assert!((0.1..2.0).contains(&bias), "{bias} although the noise is 0.1");
        // The drift reaches at least three times the bias in the 60 s of the fault.
        let amount = if cell["kind"] == "drift" { 3.0 * seen("drift").max(bias / 60.0) } else { 3.0 * bias };
        assert!((cell["amount"].as_f64().unwrap() - amount).abs() < 1e-9 * amount, "{cell}: {bias}");
        assert_eq!(cell["detected"], 5, "{cell}");
        assert_eq!(cell["wrong_blame"], 0, "{cell}");
    }
    let markdown = folder.read("room.md");
    assert!(markdown.contains("shsa campaign room.yaml room.csv --detectable=3"), "{markdown}");
    assert!(markdown.contains("| bias 3× | 15 | 0 | 0 | 15 | 15 of 15 | 0 | 0 |"), "{markdown}");
    assert!(markdown.contains("| `/a` | "), "{markdown}");
}

#[test]
fn of_several_sessions_each_is_fitted_in_its_first_half() {
    let folder = Folder::with(&[
        ("room.yaml", ROOM.as_bytes()),
        ("monday.csv", room().as_bytes()),
        ("tuesday.csv", room().as_bytes()),
    ]);
    let grid =
        "monday.csv tuesday.csv --detectable=3 --kinds bias --onsets 4 --seeds 1 --duration 60s --json -";
    let ended = folder.ends(&format!("campaign room.yaml {grid}"), 0);
    let campaign: Value = serde_json::from_str(&ended.stdout).unwrap();
    let onsets = campaign["settings"]["onsets_s"].as_array().unwrap();
    assert!(onsets.iter().all(|onset| onset.as_f64().unwrap() > 599.0 / 2.0), "{onsets:?}");
    for cell in cells(&campaign) {
        assert_eq!((&cell["detected"], &cell["wrong_blame"]), (&4.into(), &0.into()), "{cell}");
    }
}

#[test]
fn declared_and_detectable_amounts_exclude_each_other() {
    let ended = folder().ends("campaign tank.yaml clean.csv --detectable --amounts 2", 2);
    assert!(ended.stderr.contains("--amounts"), "{}", ended.stderr);
}
