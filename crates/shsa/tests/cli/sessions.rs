//! Several recordings, clocks that are set, and skipped stretches: each session starts anew.

use crate::folder::Folder;
use serde_json::Value;
use std::fmt::Write;
use std::ops::Range;

/// Two sensors of one variable, and a need.
const MODEL: &str = "shsa: 1
variables: { x: { range: [-100, 100] } }
signals:
  a: { variable: x, source: r#a, rate: 1 Hz, value_error: 0.1, timeout: 3 s }
  b: { variable: x, source: r#b, rate: 1 Hz, value_error: 0.1, timeout: 3 s }
needs: { x: { signal: /x, max_age: 5 s } }
";

/// Both signals have the same values, except for `b` in a stretch.
fn rows(seconds: impl IntoIterator<Item = i64>, wrong: Range<i64>) -> String {
    let mut text = "time [s],a,b\n".to_owned();
    for second in seconds {
        let off = if wrong.contains(&second) { 5.0 } else { 0.0 };
        let noise = 0.04 * ((second * 7 % 5) as f64 / 2.0 - 1.0);
        writeln!(text, "{second},{:.3},{:.3}", 1.0 + noise, 1.0 + off - noise).unwrap();
    }
    text
}

/// One folder for each day, each with a file of the same name.
fn days(days: &[(&str, String)]) -> Folder {
    let folder = Folder::with(&[("m.yaml", MODEL.as_bytes())]);
    for (day, text) in days {
        std::fs::create_dir_all(folder.path(day)).unwrap();
        folder.write(&format!("{day}/r.csv"), text);
    }
    folder
}

/// The report of a replay, whether the need is met or not.
#[track_caller]
fn replayed(folder: &Folder, arguments: &str) -> Value {
    let ended = folder.run(&format!("replay m.yaml {arguments} --json"));
    assert!(ended.status <= 1, "{}", ended.stderr);
    serde_json::from_str(&ended.stdout).unwrap()
}

/// The session, the time and the signal of each accusation.
fn accused(report: &Value) -> Vec<(u64, f64, &str)> {
    let events = report["events"].as_array().unwrap().iter();
    events
        .filter(|event| ["suspected", "failed", "silent"].contains(&event["kind"].as_str().unwrap()))
        .map(|event| {
            let (session, signal) = (event["session"].as_u64(), event["signal"].as_str());
            (session.unwrap_or(0), event["time_s"].as_f64().unwrap(), signal.unwrap_or_default())
        })
        .collect()
}

#[test]
fn sessions_that_are_streamed_give_the_same() {
    // The rows of the second day are in no order.
    let mixed = rows((0..100).map(|second| second ^ 1), 50..100);
    let folder = days(&[("1", rows(0..100, 0..0)), ("2", mixed), ("3", rows(0..100, 20..90))]);
    let play = |more: &str| {
        let mut report = replayed(&folder, more);
        report.as_object_mut().unwrap().remove("elapsed_s");
        report
    };
    for which in ["1 2 3", "1 2 3 --session 2"] {
        let whole = play(&format!("{which} --output a.jsonl --report a.html"));
        let streamed = play(&format!("{which} --output b.jsonl --report b.html --stream"));
        assert!(!accused(&whole).is_empty());
        assert_eq!(whole, streamed);
        assert_eq!(folder.read("a.jsonl"), folder.read("b.jsonl"));
        assert!(folder.read("a.jsonl").len() > 1_000);
    }
    folder.refuses(
        "replay m.yaml 1 2 3 --stream --journal j",
        &["these are 3; say which with --session NUMBER"],
    );
    folder.refuses("replay m.yaml 1 2 3 --stream --session 4", &["there is no session 4: there are 3"]);
}

#[test]
fn a_fault_of_the_second_day_is_seen_beside_a_sound_first() {
    let folder = days(&[("1", rows(0..100, 0..0)), ("2", rows(0..100, 50..100)), ("3", rows(0..100, 0..0))]);
    let alone = replayed(&folder, "2");
    let both = replayed(&folder, "1 2 3");
    assert!(!accused(&alone).is_empty(), "{alone}");
    let of_second: Vec<_> = accused(&alone).into_iter().map(|(_, time, signal)| (2, time, signal)).collect();
    assert_eq!(accused(&both), of_second, "the second day as when it is replayed alone, and no other");
    assert_eq!(both["observations"], 600);
    assert_eq!(both["duration_s"], 297.0);
    assert_eq!(both["signals"]["a"]["accepted"], 300);
    let sessions = both["sessions"].as_array().unwrap();
    assert_eq!(sessions.len(), 3);
    assert_eq!(sessions[1]["signals"]["b"], alone["signals"]["b"]);
    assert_eq!((&sessions[0]["because"], &sessions[0]["needs"]["x"]["met"]), (&Value::Null, &true.into()));
    assert_eq!((&sessions[1]["files"][0], &sessions[1]["session"]), (&"2/r.csv".into(), &2.into()));
    assert!(sessions[1]["because"].as_str().unwrap().contains("overlaps in time with 1/r.csv"));
    assert!(alone.get("sessions").is_none());
}

#[test]
fn each_session_is_reported_and_can_be_chosen() {
    let folder = days(&[("1", rows(0..100, 0..0)), ("2", rows(0..100, 50..100))]);
    let ended = folder.run("replay m.yaml 1 2 --output out.jsonl");
    assert!(ended.stderr.contains("2/r.csv: a session of its own"), "{}", ended.stderr);
    assert!(ended.stdout.starts_with("400 observations over 198.0 s in 2 sessions"), "{}", ended.stdout);
    assert!(ended.stdout.contains("\nSession 2: 2/r.csv, 0.0 s to 99.0 s; it overlaps"), "{}", ended.stdout);
    let lines = folder.read("out.jsonl");
    let of = |number: u64| {
        let session = |line: &&str| serde_json::from_str::<Value>(line).unwrap()["session"] == number;
        lines.lines().filter(session).count()
    };
    assert!(of(1) > 50 && of(2) > 30 && of(1) + of(2) == lines.lines().count(), "{} {}", of(1), of(2));
    let second = replayed(&folder, "1 2 --session 2 --journal j.jsonl");
    assert_eq!(accused(&second), accused(&replayed(&folder, "2")));
    folder.refuses("replay m.yaml 1 2 --journal k.jsonl", &["2", "--session"]);
    folder.refuses("replay m.yaml 1 2 --session 3", &["no session 3"]);
    folder.refuses("explain m.yaml 1 2 b", &["2 sessions", "--session"]);
    folder.ends("explain m.yaml 1 2 b --session 2", 0);
}

#[test]
fn a_clock_that_is_set_begins_a_session() {
    let epoch = 1_760_000_000;
    let folder = days(&[("boot", rows((0..30).chain(epoch..epoch + 100), epoch + 50..epoch + 100))]);
    let ended = folder.run("replay m.yaml boot --json");
    assert!(ended.stderr.contains("its clock was set forward by 20370.4 d"), "{}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(report["duration_s"], 29.0 + 99.0);
    let accused = accused(&report);
    assert!(
        !accused.is_empty() && accused.iter().all(|it| it.0 == 2 && (50.0..60.0).contains(&it.1)),
        "{accused:?}"
    );
    // The clock is set back by ten minutes. Sorted by time, the values after the step would lie between those before it.
    let folder = days(&[("back", rows((0..900).chain(300..600), 0..0))]);
    let report = replayed(&folder, "back");
    assert_eq!(report["sessions"].as_array().unwrap().len(), 2);
    assert_eq!(report["signals"]["a"]["out_of_order"], 0);
}

#[test]
fn rows_that_come_a_little_late_are_no_session() {
    let late = (0..50).chain([48, 47]).chain(50..100);
    let report = replayed(&days(&[("1", rows(late, 0..0))]), "1");
    assert!(report.get("sessions").is_none(), "{report}");
}

#[test]
fn what_is_left_out_counts_for_nothing() {
    let folder = days(&[("1", rows(0..100, 40..50))]);
    assert!(!accused(&replayed(&folder, "1")).is_empty());
    let report = replayed(&folder, "1 --skip 38s..52s");
    assert!(report["events"].as_array().unwrap().is_empty(), "neither the fault nor a time-out: {report}");
    assert_eq!(report["sessions"].as_array().unwrap().len(), 2);
    let because = report["sessions"][1]["because"].as_str().unwrap();
    assert!(because.contains("15.000 s before it are left out"), "{because}");
    let report = replayed(&folder, "1 --from 52s");
    assert!(report["events"].as_array().unwrap().is_empty() && report.get("sessions").is_none(), "{report}");
    assert_eq!(report["observations"], 2 * 48);
    assert_eq!(replayed(&folder, "1 --until 40s")["observations"], 2 * 40);
    // Times count from the first observation, even if it is skipped.
    let late = replayed(&folder, "1 --from 52s --skip 60s..70s --inject bias=5:a@80s..");
    let accused = accused(&late);
    assert!(
        !accused.is_empty() && accused.iter().all(|it| it.0 == 2 && (80.0..90.0).contains(&it.1)),
        "{accused:?}"
    );
    folder.refuses("replay m.yaml 1 --skip 30s", &["20s..30s"]);
    folder.refuses("replay m.yaml 1 --from 500s", &["nothing is left"]);
    let beyond = folder.run("replay m.yaml 1 --skip 500s..600s");
    assert!(beyond.stderr.contains("the recording ends before"), "{}", beyond.stderr);
}

#[test]
fn a_change_of_the_model_holds_in_every_session() {
    let folder = days(&[("1", rows(0..100, 50..100)), ("2", rows(0..100, 50..100))]);
    folder.write("wide.yaml", "signals: { b: { variable: x, source: r#b, rate: 1 Hz, value_error: 90 } }\n");
    for cut in ["", " --skip 20s..30s", " --from 20s"] {
        let report = replayed(&folder, &format!("1 2 --reload wide.yaml@0s{cut}"));
        assert_eq!(accused(&report), [], "{cut}");
    }
}

#[test]
fn a_campaign_runs_in_every_session_and_in_none_that_is_left_out() {
    let folder = days(&[("1", rows(0..100, 0..0)), ("2", rows(0..100, 0..0))]);
    let run = |arguments: &str| -> Value {
        let ended =
            folder.ends(&format!("campaign m.yaml {arguments} --kinds bias --amounts 40 --json -"), 0);
        serde_json::from_str(&ended.stdout).unwrap()
    };
    let both = run("1 2 --onsets 4 --duration 20s");
    assert_eq!(both["settings"]["onsets_session"], serde_json::json!([1, 1, 2, 2]), "{}", both["settings"]);
    assert_eq!((&both["all"]["runs"], &both["all"]["detected"]), (&8.into(), &8.into()), "{}", both["all"]);
    let cut = run("1 --skip 40s..60s --onsets 4 --duration 20s");
    for onset in cut["settings"]["onsets_s"].as_array().unwrap() {
        let onset = onset.as_f64().unwrap();
        assert!((0.0..=20.0).contains(&onset) || (60.0..=80.0).contains(&onset), "{onset}");
    }
    assert_eq!(cut["all"]["detected"], 8, "{}", cut["all"]);
    assert_eq!(cut["clean_alarms"], 0);
}

#[test]
fn a_campaign_takes_a_patch() {
    let folder = days(&[("1", rows(0..100, 0..0))]);
    folder.write("wide.yaml", "signals: { b: { variable: x, source: r#b, rate: 1 Hz, value_error: 90 } }\n");
    folder.write("bad.yaml", "signals: { b: { variable: z } }\n");
    let detected = |patch: &str| {
        let faults = "--kinds bias --amounts 20 --signals a --onsets 2 --markdown c.md --json -";
        let ended = folder.ends(&format!("campaign m.yaml 1 {faults}{patch}"), 0);
        serde_json::from_str::<Value>(&ended.stdout).unwrap()["all"]["detected"].as_u64().unwrap()
    };
    assert_eq!((detected(""), detected(" --patch wide.yaml")), (2, 0));
    assert!(folder.read("c.md").contains(" --patch wide.yaml"));
    let ended = folder.ends("campaign m.yaml 1 --patch bad.yaml", 2);
    assert!(ended.stderr.contains("bad.yaml has errors"), "{}", ended.stderr);
}

#[test]
fn a_signal_whose_tolerance_is_at_a_relation_is_broken_by_what_is_seen() {
    let model = "shsa: 1
variables: { x: {}, y: {} }
relations: { twice: { equation: y = 2 * x, for: [y], error: 0.5 } }
signals:
  a: { variable: x, source: r#a, rate: 1 Hz, timeout: 3 s }
  b: { variable: y, source: r#b, rate: 1 Hz, timeout: 3 s }
";
    let mut text = "time [s],a,b\n".to_owned();
    for second in 0..200 {
        let value = (f64::from(second) / 9.0).sin();
        writeln!(text, "{second},{value:.4},{:.4}", 2.0 * value).unwrap();
    }
    let folder = Folder::with(&[("m.yaml", model.as_bytes()), ("r.csv", text.as_bytes())]);
    let ended = folder.ends("campaign m.yaml r.csv --kinds bias --amounts 1,4 --json -", 0);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let cells = report["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 4, "{report}");
    for cell in cells {
        // The relation hides 0.25 of `a` and 0.5 of `b` from one comparison; twice the smallest amount is just detected.
        let hidden = if cell["signal"] == "a" { 0.25 } else { 0.5 };
        let one = cell["amount"].as_f64().unwrap() / cell["multiple"].as_f64().unwrap();
        assert!((0.1 * hidden..0.6 * hidden).contains(&one), "{cell}");
        assert_eq!(cell["runs"], 3, "{cell}");
        assert!(cell["multiple"] == 1.0 || cell["detected"] == 3, "{cell}");
    }
}

#[test]
fn a_campaign_says_what_is_in_no_share_and_counts_what_was_accused() {
    // From 40 s on `b` is wrong: it is accused before the injected fault begins, and no further event follows.
    let folder = days(&[("1", rows(0..200, 40..200))]);
    let faults = "--kinds bias,stuck,drop --amounts 0.5 --signals b --onsets 1 --duration 50s";
    let ended =
        folder.ends(&format!("campaign m.yaml 1 {faults} --html p.html --markdown c.md --json c.json"), 0);
    let report: Value = serde_json::from_str(&folder.read("c.json")).unwrap();
    let of_b = &report["not_counted"]["signals"]["b"];
    assert_eq!(of_b["accused_before"], report["all"]["accused"]);
    assert!(report["all"]["accused"].as_u64().unwrap() >= 2, "{report}");
    let bias = report["cells"].as_array().unwrap().iter().find(|cell| cell["kind"] == "bias").unwrap();
    assert_eq!((&bias["runs"], &bias["detected"]), (&1.into(), &0.into()), "a miss, not left out: {bias}");
    for text in [&ended.stdout, &folder.read("p.html"), &folder.read("c.md")] {
        assert!(text.contains("whose signal was accused before"), "{text}");
    }
    // A constant value does not change when it is stuck, and this is reported.
    let still: String = (0..100).map(|second| format!("{second},1,1\n")).collect();
    let folder = days(&[("1", format!("time [s],a,b\n{still}"))]);
    let ended = folder.ends("campaign m.yaml 1 --kinds stuck,drop --onsets 2", 0);
    assert!(ended.stdout.contains("left out 4: 4 that changed no value"), "{}", ended.stdout);
}
