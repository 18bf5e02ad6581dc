//! `shsa replay`: the whole loop over recordings.

use crate::folder::{Folder, keys};
use crate::tank;
use serde_json::{Value, json};

/// A report without its elapsed time.
fn without_elapsed(mut report: Value) -> Value {
    report.as_object_mut().unwrap().remove("elapsed_s").unwrap();
    report
}

/// Kind and subject of each event.
fn kinds(report: &Value) -> Vec<(&str, &str)> {
    fn kind(event: &Value) -> (&str, &str) {
        let subject = event["signal"].as_str().or(event["variable"].as_str());
        (event["kind"].as_str().unwrap(), subject.unwrap())
    }
    report["events"].as_array().unwrap().iter().map(kind).collect()
}

#[test]
fn a_lie_is_found_and_healed() {
    let report = tank::folder().json("replay tank.yaml run.csv", 0);
    assert_eq!(
        keys(&report),
        [
            "observations",
            "duration_s",
            "elapsed_s",
            "events",
            "needs",
            "signals",
            "ways",
            "comparisons",
            "warnings",
            "notes",
            "outliers"
        ]
    );
    assert_eq!(kinds(&json!({ "events": report["outliers"] })), [("outlier", "/level")]);
    assert_eq!(report["observations"], 180);
    assert!((report["duration_s"].as_f64().unwrap() - 59.0).abs() < 1e-9);
    assert_eq!(kinds(&report), [("failed", "/level"), ("substituted", "level")]);
    let failed = &report["events"][0];
    let usual = ["time_s", "kind", "signal", "variable", "symptom", "because", "substitution"];
    assert_eq!(keys(failed), [&usual[..], &["probability"]].concat());
    assert!((0.9..1.0).contains(&failed["probability"].as_f64().unwrap()), "{failed}");
    assert_eq!(keys(&report["events"][1]), usual);
    let time = failed["time_s"].as_f64().unwrap();
    assert!((30.0..35.0).contains(&time), "{time}");
    assert_eq!(report["events"][1]["substitution"], "/pressure by hydrostatic");
    let need = &report["needs"]["level"];
    assert_eq!(need["met"], true);
    assert_eq!(need["signal"], "/healed/level");
    assert_eq!(report["signals"]["/level"]["verdict"], "failed");
    assert_eq!(report["signals"]["/volume"]["verdict"], "healthy");
    let way = |name: &str| report["ways"].as_array().unwrap().iter().find(|way| way["way"] == name).unwrap();
    let proven = way("/pressure by hydrostatic");
    assert_eq!(keys(proven), ["variable", "way", "agreement", "error", "width", "availability"]);
    assert_eq!((&proven["variable"], &proven["agreement"]), (&"level".into(), &1.0.into()));
    assert!(way("/level")["agreement"].as_f64().unwrap() < 0.8, "{report}");
}

#[test]
fn what_is_declared_and_never_compared_is_a_warning_by_name() {
    let model = "shsa: 1
variables: { x: {} }
signals:
  a: { variable: x, source: a#a, rate: 1 Hz, value_error: 0.5, timeout: 1 h }
  b: { variable: x, source: b#b, rate: 1 Hz, value_error: 0.5, timeout: 1 h }
  c: { variable: x, source: c#c, rate: 1 Hz, value_error: 0.5, timeout: 1 h }
";
    let rows = |name: &str, seconds: std::ops::Range<u32>| {
        let lines: Vec<String> = seconds.map(|second| format!("{second},5\n")).collect();
        format!("t [s],{name}\n{}", lines.concat())
    };
    // The second signal begins when the first has ended.
    let [a, b, c] = [rows("a", 0..60), rows("b", 100..160), rows("c", 0..160)];
    let files = [("m.yaml", model), ("a.csv", &a), ("b.csv", &b), ("c.csv", &c)];
    let folder = Folder::with(&files.map(|(name, text)| (name, text.as_bytes())));
    let report = folder.json("replay m.yaml a.csv b.csv c.csv", 0);
    let pairs = report["comparisons"].as_array().unwrap();
    let of = |one: &str, other: &str| {
        let is_it = |pair: &&Value| {
            let names = [&pair["one"], &pair["other"]];
            names.contains(&&json!(one)) && names.contains(&&json!(other))
        };
        pairs.iter().find(is_it).unwrap()
    };
    assert_eq!((&of("a", "b")["made"], &of("a", "b")["possible"]), (&json!(0), &json!(60)));
    assert!(of("a", "c")["made"].as_u64().unwrap() >= 58, "{pairs:?}");
    let warnings = report["warnings"].as_array().unwrap();
    let [warning] = warnings.as_slice() else { panic!("{warnings:?}") };
    let warning = warning.as_str().unwrap();
    assert!(warning.starts_with("x: ") && warning.contains("were never compared"), "{warning}");
    assert!(warning.contains("a") && warning.ends_with("(0 times of 60)"), "{warning}");
    let output = folder.ends("replay m.yaml a.csv b.csv c.csv", 0).stdout;
    assert!(output.contains(&format!("warning: {warning}")), "{output}");
    // There is no warning when every declared comparison is made.
    assert_eq!(tank::folder().json("replay tank.yaml run.csv", 0)["warnings"], json!([]));
}

/// Three signals of `a`, three of `b`; from 2 s on, `b` is not the value that `a` implies.
const SLIP: &str = "shsa: 1
variables: { a: { range: [-1000, 1000] }, b: { range: [-1000, 1000] } }
relations: { twice: b = 2 * a }
signals:
  a1: { variable: a, rate: 10 Hz, value_error: 0.5, shares: [board] }
  a2: { variable: a, rate: 10 Hz, value_error: 0.5, shares: [board] }
  a3: { variable: a, rate: 10 Hz, value_error: 0.5 }
  b1: { variable: b, rate: 10 Hz, value_error: 0.5 }
  b2: { variable: b, rate: 10 Hz, value_error: 0.5 }
  b3: { variable: b, rate: 10 Hz, value_error: 0.5 }
";

#[test]
fn a_relation_that_no_longer_holds_is_reported_with_its_name_and_no_signal() {
    let folder = Folder::new();
    folder.write("slip.yaml", SLIP);
    let mut lines = String::new();
    for step in 0..40_u64 {
        let (time, b) = (step * 100_000_000, if step < 20 { 20.0 } else { 60.0 });
        for (signal, value) in [("a1", 10.0), ("a2", 10.0), ("a3", 10.0), ("b1", b), ("b2", b), ("b3", b)] {
            let row = json!({ "signal": signal, "time_ns": time, "received_ns": time, "value": value });
            lines += &format!("{row}\n");
        }
    }
    folder.write("slip.jsonl", lines);
    let report = folder.json("replay slip.yaml slip.jsonl", 0);
    assert_eq!(kinds(&report), [("failed", "a")]);
    let failed = &report["events"][0];
    assert_eq!((&failed["signal"], &failed["relation"]), (&Value::Null, &json!("twice")));
    assert!(failed["because"].as_str().unwrap().contains("relation twice no longer holds"), "{failed}");
}

#[test]
fn every_format_gives_the_same_events() {
    let folder = tank::folder();
    let events = |file: &str| folder.json(&format!("replay tank.yaml {file}"), 0)["events"].clone();
    let strip = |events: Value| -> Vec<(f64, String)> {
        let of = |event: &Value| (event["time_s"].as_f64().unwrap(), event["kind"].to_string());
        events.as_array().unwrap().iter().map(of).collect()
    };
    let csv = strip(events("run.csv"));
    assert_eq!(csv, strip(events("run.jsonl")));
    assert_eq!(csv, strip(events("run.bag")));
}

#[test]
fn a_streamed_recording_gives_the_same() {
    let folder = tank::folder();
    let whole = folder.json("replay tank.yaml run.csv --journal a.journal --output a.jsonl", 0);
    let streamed = folder.json("replay tank.yaml run.csv --stream --journal b.journal --output b.jsonl", 0);
    assert_eq!(without_elapsed(whole), without_elapsed(streamed));
    assert_eq!(folder.read("a.journal"), folder.read("b.journal"));
    assert!(folder.read("a.jsonl").len() > 1_000);
    assert_eq!(folder.read("a.jsonl"), folder.read("b.jsonl"));
    let both = "the argument '--stream' cannot be used with '--reload <FILE@TIME>'";
    folder.refuses("replay tank.yaml run.csv --stream --reload tank.yaml@9s", &[both]);
}

#[test]
fn a_streamed_recording_with_faults_and_parts_gives_the_same() {
    let folder = tank::folder();
    for changes in [
        "--inject bias=0.2:/level@30s..60s",
        "--inject drop:/level@..40s --inject noise=0.1:/volume --inject delay=3s:/volume@20s..",
        "--inject stuck:/level@30s.. --from 20s --skip 40s..45s --until 55s",
        "--skip 20s..40s --session 2 --inject drop:/volume@..10s",
    ] {
        let replayed = |output: &str, stream: &str| {
            let ended =
                folder.run(&format!("replay tank.yaml run.csv --json --output {output} {changes} {stream}"));
            let report: Value = serde_json::from_str(&ended.stdout).unwrap();
            (without_elapsed(report), ended.stderr, ended.status)
        };
        assert_eq!(replayed("a.jsonl", ""), replayed("b.jsonl", "--stream"), "{changes}");
        assert_eq!(folder.read("a.jsonl"), folder.read("b.jsonl"), "{changes}");
    }
}

#[test]
fn windows_line_ends_marks_and_semicolons() {
    let folder = tank::folder();
    folder.write("windows.csv", tank::csv().replace('\n', "\r\n"));
    folder.write("marked.csv", format!("\u{feff}{}", tank::csv()));
    folder.write("semicolons.csv", tank::csv().replace(',', ";"));
    folder.write("marked.jsonl", format!("\u{feff}{}", tank::json_lines().replace('\n', "\r\n")));
    for file in ["windows.csv", "marked.csv", "semicolons.csv", "marked.jsonl"] {
        let ended = folder.ends(&format!("replay tank.yaml {file}"), 0);
        assert!(ended.stdout.starts_with("180 observations over 59.0 s"), "{file}: {}", ended.stdout);
        assert_eq!(ended.stderr, "");
    }
}

#[test]
fn folders_are_read() {
    let folder = tank::folder();
    std::fs::create_dir(folder.path("drive")).unwrap();
    folder.write("drive/part.csv", tank::csv());
    folder.write("drive/notes.md", "not a recording");
    assert_eq!(folder.json("replay tank.yaml drive", 0)["observations"], 180);
    std::fs::create_dir(folder.path("empty")).unwrap();
    folder.refuses("replay tank.yaml empty", &["empty: no recording in this folder"]);
}

#[test]
fn a_run_repeats() {
    let folder = tank::folder();
    let arguments = "replay tank.yaml run.csv --inject noise=0.3:/pressure@5s.. --seed 7";
    let (one, other) =
        (folder.run(&format!("{arguments} --json")), folder.run(&format!("{arguments} --json")));
    assert_eq!(one.status, other.status);
    let report = |ended: &crate::folder::Ended| without_elapsed(serde_json::from_str(&ended.stdout).unwrap());
    assert_eq!(report(&one).to_string(), report(&other).to_string());
    let another_seed =
        folder.run("replay tank.yaml run.csv --inject noise=0.3:/pressure@5s.. --seed 8 --json");
    assert_ne!(report(&one)["needs"], report(&another_seed)["needs"]);
}

#[test]
fn a_journal_repeats_its_run() {
    let folder = tank::folder();
    let run = "replay tank.yaml run.csv --inject drop:/pressure@40s..50s --journal run.journal.jsonl --output out.jsonl";
    let first = folder.json(run, 0);
    let journal = folder.read("run.journal.jsonl");
    let again =
        folder.json("replay tank.yaml run.journal.jsonl --journal again.jsonl --output out2.jsonl", 0);
    assert_eq!(first["events"].to_string(), again["events"].to_string());
    assert_eq!(folder.read("out.jsonl"), folder.read("out2.jsonl"));
    assert_eq!(journal, folder.read("again.jsonl"));
    folder.refuses("replay tank.yaml again.jsonl --inject drop:/level", &["a journal is replayed as it was"]);
}

#[test]
fn what_is_served_is_written() {
    let folder = tank::folder();
    let report = folder.json("replay tank.yaml run.csv --output out.jsonl", 0);
    let served = folder.read("out.jsonl");
    assert_eq!(served.lines().count() as u64, report["needs"]["level"]["published"].as_u64().unwrap());
    for line in served.lines() {
        let value: Value = serde_json::from_str(line).unwrap();
        assert_eq!(keys(&value), ["signal", "time_ns", "received_ns", "value", "quality", "source"]);
        assert_eq!(value["signal"], "/healed/level");
        let (lo, hi) = (value["value"]["lo"].as_f64().unwrap(), value["value"]["hi"].as_f64().unwrap());
        let level = 2.0 + 0.01 * value["time_ns"].as_f64().unwrap() * 1e-9;
        let settled = value["time_ns"].as_i64().unwrap() > 35_000_000_000;
        assert!(!settled || (lo <= level && level <= hi), "{line}");
    }
}

#[test]
fn an_uncertain_time_is_written_by_its_middle() {
    let model = "shsa: 1
variables: { x: { range: [-100, 100] } }
signals: { a: { variable: x, source: r#a, rate: 1 Hz, value_error: 0.1, time_error: 200 ms } }
needs: { x: { signal: /x, max_age: 5 s } }
";
    let folder =
        Folder::with(&[("m.yaml", model.as_bytes()), ("r.csv", b"time [s],a\n0,1\n1,1.01\n2,1\n3,1.01\n")]);
    folder.ends("replay m.yaml r.csv --output out.jsonl", 0);
    let lines = folder.read("out.jsonl");
    let values: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let times: Vec<i64> = values.iter().map(|value| value["time_ns"].as_i64().unwrap()).collect();
    assert_eq!(times, [0, 1_000_000_000, 2_000_000_000, 3_000_000_000]);
}

#[test]
fn injected_faults_are_compared_with_the_run_without() {
    let report = tank::folder().json("replay tank.yaml run.csv --inject bias=1:/level@10s..20s", 0);
    let need = &report["needs"]["level"];
    assert!(need["max_error"].as_f64().unwrap() >= need["rmse"].as_f64().unwrap(), "{need}");
    assert_eq!(kinds(&report)[0], ("failed", "/level"));
    assert!(report["events"][0]["time_s"].as_f64().unwrap() < 15.0);
}

#[test]
fn an_unmet_need_is_the_answer_no() {
    let folder = tank::folder();
    let drops = "--inject drop:/level@5s.. --inject drop:/pressure@5s.. --inject drop:/volume@5s..";
    let report = folder.json(&format!("replay tank.yaml run.csv {drops}"), 1);
    assert_eq!(report["needs"]["level"]["met"], false);
    assert!(kinds(&report).contains(&("unhealable", "level")), "{report}");
    let output = folder.ends(&format!("replay tank.yaml run.csv {drops}"), 1).stdout;
    assert!(output.contains("\nlevel  no "), "{output}");
}

#[test]
fn wrong_faults_are_refused() {
    let folder = tank::folder();
    for (fault, words) in [
        ("drop:/levl", &["no signal '/levl'", "did you mean '/level'?"][..]),
        ("drop:/level@10s", &["no '..'"]),
        ("stuk:/level", &["unknown kind 'stuk'", "stuck"]),
        ("bias:/level", &["bias needs an amount"]),
        ("delay=1:/level", &["no unit of time"]),
        ("drop:/level@20s..10s", &["ends before it starts"]),
        ("bias=1", &["KIND[=AMOUNT]:SIGNAL@FROM..TO"]),
    ] {
        folder.refuses(&format!("replay tank.yaml run.csv --inject {fault}"), words);
    }
    let late = folder.ends("replay tank.yaml run.csv --inject drop:/level@100s..", 0);
    assert!(late.stderr.contains("the fault of /level changes nothing"), "{}", late.stderr);
}

#[test]
fn cut_recordings_give_what_they_hold() {
    let folder = tank::folder();
    let cut = |name: &str| {
        let bytes = std::fs::read(folder.path(name)).unwrap();
        let middle = bytes.len() * 9 / 20;
        // within a row, line or record, whatever its length
        let start =
            bytes[middle..].iter().position(|byte| *byte == b'\n').map_or(middle, |at| middle + at + 1);
        folder.write(&name.replace("run", "cut"), &bytes[..start + 9]);
    };
    for (name, place) in
        [("run.csv", "cut.csv:"), ("run.jsonl", "cut.jsonl:"), ("run.bag", "cut.bag: at byte ")]
    {
        cut(name);
        let file = place.split(':').next().unwrap();
        let ended = folder.ends(&format!("replay tank.yaml {file} --json"), 3);
        assert!(ended.stderr.contains(&format!("warning: {place}")), "{}", ended.stderr);
        let place: String =
            ended.stderr.split(place).nth(1).unwrap().chars().take_while(char::is_ascii_digit).collect();
        assert!(place.parse::<u64>().unwrap() > 20, "{}", ended.stderr);
        let report: Value = serde_json::from_str(&ended.stdout).unwrap();
        let observations = report["observations"].as_u64().unwrap();
        assert!((75..=90).contains(&observations), "{file}: {observations}");
        folder.ends(&format!("replay tank.yaml {file} --compare level"), 3);
    }
    let cut_journal = |lines: usize| {
        let journal = folder.read("j.jsonl");
        let kept: String = journal.split_inclusive('\n').take(lines).collect();
        folder.write("cut.journal", &kept[..kept.len() - 9]);
    };
    folder.ends("replay tank.yaml run.csv --journal j.jsonl", 0);
    cut_journal(80);
    let ended = folder.ends("replay tank.yaml cut.journal", 3);
    assert!(ended.stderr.contains("warning: cut.journal:80: "), "{}", ended.stderr);
}

#[test]
fn text_tells_events_needs_and_signals() {
    let output = tank::folder().ends("replay tank.yaml run.csv", 0).stdout;
    let blocks: Vec<&str> = output.trim_end().split("\n\n").collect();
    let [sum, events, needs, signals, ways] = blocks[..] else { panic!("{output}") };
    assert!(sum.starts_with("180 observations over 59.0 s, replayed in "), "{sum}");
    assert!(events.contains("  failed      /level\n             /pressure by hydrostatic says "), "{events}");
    assert!(events.contains("  substituted level <- /pressure by hydrostatic\n"), "{events}");
    assert!(
        needs.starts_with("need   met  published  longest gap  source at the end\nlevel  yes  "),
        "{needs}"
    );
    assert!(
        signals.contains("\n/level     failed   60        0        0     0             0        0 "),
        "{signals}"
    );
    assert!(ways.contains("\nlevel  /pressure by hydrostatic  100.0 %  0.001 m "), "{ways}");
    let quiet = tank::folder().ends("replay tank.yaml run.csv --inject bias=-0.5:/level@30s..", 0).stdout;
    assert!(quiet.contains("No events: nothing failed, nothing was substituted."), "{quiet}");
}

#[test]
fn a_model_without_needs_is_replayed() {
    let model = tank::MODEL.split("needs:").next().unwrap().to_owned();
    let folder = Folder::with(&[("m.yaml", model.as_bytes()), ("run.csv", tank::csv().as_bytes())]);
    let report = folder.json("replay m.yaml run.csv", 0);
    assert_eq!(report["needs"], serde_json::json!({}));
    assert_eq!(kinds(&report), [("failed", "/level")]);
}

/// Two thermometers drift apart slowly within their errors: nobody is accused, and a note tells when they will disagree.
#[test]
fn a_drift_within_the_errors_is_a_note_with_the_time_until_they_part() {
    let model = "shsa: 1
variables: { t: { unit: degC } }
signals:
  a: { variable: t, source: r#a, unit: degC, rate: 2 Hz, value_error: 1 }
  b: { variable: t, source: r#b, unit: degC, rate: 2 Hz, value_error: 1 }
needs: { t: { signal: /t, max_age: 5 s } }
";
    let line = |at: u32| format!("{},{},20\n", f64::from(at) * 0.5, 20.0 + 4e-4 * f64::from(at));
    let recording: String =
        std::iter::once("time [s],a,b\n".to_owned()).chain((0..4_000).map(line)).collect();
    let folder = Folder::with(&[("m.yaml", model.as_bytes()), ("r.csv", recording.as_bytes())]);
    let found = folder.json("replay m.yaml r.csv", 0);
    assert!(found["events"].as_array().unwrap().iter().all(|it| it["event"] == "substituted"), "{found}");
    let note = &found["notes"][0];
    assert_eq!((note["shows"].as_str(), note["variable"].as_str()), (Some("drift"), Some("t")), "{note}");
    let (mean, parts_in) = (note["mean"].as_f64().unwrap().abs(), note["parts_in_s"].as_f64().unwrap());
    // At the end they are 1.6 K apart, and the distance grows by 0.8 mK a second; the mean lags behind.
    assert!((1.4..1.6).contains(&mean) && (350.0..750.0).contains(&parts_in), "{note}");
}
