//! `shsa draft` with questions: it takes its proposals, or the answers of a person, and writes a valid model.

use crate::folder::{Ended, Folder};
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

/// Two temperatures that roughly agree, and a voltage and a fill level whose headers have no units.
fn folder() -> Folder {
    let mut text = "t [s],probe_1,probe_2,battery_voltage,fill\n".to_owned();
    for row in 0..1_500 {
        let time = f64::from(row) * 0.1;
        let heat = 20.0 + 5.0 * (0.2 * time).sin() + 3.0 * (0.031 * time).cos();
        let volts = 12.0 + (0.3 * time).sin() + 0.2 * (1.1 * time).cos();
        let level = 3.0 + (0.17 * time).sin() - (0.05 * time).cos();
        let beside = heat + 1.2 * (0.05 * time + 1.0).sin();
        writeln!(text, "{time:.1},{heat:.3},{beside:.3},{volts:.3},{level:.3}").unwrap();
    }
    Folder::with(&[("log.csv", text.as_bytes())])
}

fn answered(folder: &Folder, arguments: &str, answers: &str) -> Ended {
    let mut command = folder.command(arguments);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(answers.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let status = output.status.code().unwrap_or(-1);
    Ended { status, stdout: text(output.stdout), stderr: text(output.stderr) }
}

#[test]
fn proposals_are_taken_without_a_question() {
    let folder = folder();
    let ended = folder.ends("draft log.csv -o m.yaml --yes", 0);
    assert!(!ended.stderr.contains('?'), "{}", ended.stderr);
    let model = folder.read("m.yaml");
    folder.ends("check m.yaml", 0);
    for words in ["unit: V", "\nneeds:\n  probe: { signal: /served/probe, max_age: 500 ms }\n"] {
        assert!(model.contains(words), "no {words} in {model}");
    }
    let report = folder.json("replay m.yaml log.csv", 0);
    assert!(report["needs"]["probe"].is_object(), "{report}");
    // The end of the input is an answer to all that is left.
    assert_eq!(answered(&folder, "init log.csv -o same.yaml", "").status, 0);
    assert_eq!(folder.read("same.yaml"), model);
    // Without a terminal and without --yes, nothing is asked and nothing that is not certain is written.
    let ended = answered(&folder, "draft log.csv -o careful.yaml", "yes\n");
    assert_eq!((ended.status, &*ended.stderr), (0, ""));
    assert!(!folder.read("careful.yaml").contains("\nneeds:"), "{}", folder.read("careful.yaml"));
}

#[test]
fn what_a_person_answers_is_in_the_model() {
    let folder = folder();
    // Units of the names no, then one by one with a wrong one; not the same; needs with a wrong one.
    let answers = "maybe\nno\ndegC\ndegC\nvolts\nV\nm\nno\nfll\nfill, battery_voltage\n2\n2 s\n\n";
    let ended = answered(&folder, "init log.csv -o m.yaml", answers);
    assert_eq!(ended.status, 0, "{}", ended.stderr);
    for words in [
        "answer yes or no",
        "In which unit is probe_1?",
        "there is no variable fll: fill?",
        "'2' has no unit of time",
        "4 variables, 4 signals, 2 needs",
        "next: shsa learn log.csv --model m.yaml -o learned.yaml",
    ] {
        assert!(ended.stderr.contains(words), "no {words} in {}", ended.stderr);
    }
    let model = folder.read("m.yaml");
    for words in [
        "  probe_1: { unit: degC,",
        "  probe_2: { unit: degC,",
        "  fill: { unit: m,",
        "  fill: { signal: /served/fill, max_age: 2 s }\n",
        "  battery_voltage: { signal: /served/battery_voltage, max_age: 500 ms }\n",
    ] {
        assert!(model.contains(words), "no {words} in {model}");
    }
    folder.ends("check m.yaml", 0);
    folder.refuses("init log.csv -o m.yaml --yes", &["m.yaml exists"]);
    assert_eq!(folder.read("m.yaml"), model);
}

/// `script` gives the command a terminal, and types the answers.
#[test]
fn a_person_at_a_terminal_is_asked() {
    let folder = folder();
    let at_terminal = |answers: &str| {
        let line = format!("{} draft log.csv -o m.yaml", crate::PROGRAM);
        let mut script = Command::new("script");
        script.current_dir(folder.path("")).args(["-qec", &line, "/dev/null"]);
        let child = script.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let Ok(mut child) = child else { return None };
        child.stdin.take().unwrap().write_all(answers.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        Some((output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned()))
    };
    let Some((status, shown)) = at_terminal("yes\nnone\nnone\nnone\nyes\nbattery_voltage\n2 s\n") else {
        eprintln!("NOT TESTED AT A TERMINAL: script (util-linux) is not installed");
        return;
    };
    assert_eq!(status, Some(0), "{shown}");
    assert!(shown.contains("Are these the units?"), "{shown}");
    let need = "\nneeds:\n  battery_voltage: { signal: /served/battery_voltage, max_age: 2 s }\n";
    assert!(folder.read("m.yaml").contains(need), "{}", folder.read("m.yaml"));
    // A model that somebody may have edited is not replaced.
    let (status, shown) = at_terminal("yes\n").unwrap();
    assert!(status == Some(2) && shown.contains("m.yaml exists"), "{shown}");
}
