//! The suite of `workshop/conformance/`: this program answers every case rightly, the judge rejects wrong answers of every kind, and the
//! cases are those that their scripts write.
//!
//! Without `python3` these tests print SKIPPED.

use std::io::Write as _;
use std::process::{Command, Output};

const SUITE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../workshop/conformance");

/// One case of each kind, and the topics in which a wrong answer is easily taken for a right one.
const SAMPLE: [&str; 9] = [
    "search/shared-02",
    "search/large-tree-01",
    "enclosure/random-03",
    "monitor/ties-01",
    "trace/sound-01",
    "trace/not-isolable-01",
    "switching/silent-01",
    "assurance/circular-01",
    "fusion/random-walk-01",
];

/// The outcome of a script of the suite; `None` where there is no Python.
fn script(arguments: &[&str]) -> Option<Output> {
    let mut command = Command::new("python3");
    command.current_dir(SUITE).args(arguments).env("PYTHONDONTWRITEBYTECODE", "1");
    match command.output() {
        Ok(output) => Some(output),
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "SKIPPED: python3 cannot be run: {error}");
            None
        }
    }
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

#[test]
fn every_case_is_answered_rightly() {
    let Some(output) = script(&["judge.py", "--", "python3", "runners/shsa.py", super::PROGRAM]) else {
        return;
    };
    let text = text(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("| all | | 285 | 0 | 0 |"), "{text}");
}

#[test]
fn a_wrong_answer_is_judged_as_wrong() {
    let chosen = SAMPLE.iter().flat_map(|case| ["--case", case]);
    let runner = ["--", "python3", "runners/spoiled.py", "python3", "runners/shsa.py", super::PROGRAM];
    let arguments: Vec<&str> = ["judge.py"].into_iter().chain(chosen).chain(runner).collect();
    let Some(output) = script(&arguments) else { return };
    let text = text(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("| all | | 0 | 9 | 0 |"), "{text}");
}

#[test]
fn the_cases_are_those_that_the_scripts_write() {
    let Some(output) = script(&["make/make.py", "--check"]) else { return };
    assert!(output.status.success(), "{}", text(&output));
}
