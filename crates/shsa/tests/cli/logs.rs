//! The log of a run: wall-clock times, levels, verbosity.

use crate::folder::{Ended, Folder};
use serde_json::Value;
use shsa_message::stamp;

/// The simulated robot publishes one of its signals, but never the one that the need asks for.
const MODEL: &str = "shsa: 1
variables: { speed: { unit: m/s }, level: { unit: m } }
signals:
  /odom/speed: { variable: speed }
  /level: { variable: level, timeout: 500 ms }
needs: { level: { max_age: 1 s } }
";

fn run(options: &str) -> Ended {
    let folder = Folder::with(&[("tank.yaml", MODEL.as_bytes())]);
    folder.run(&format!("run tank.yaml --http off --for 2s {options}"))
}

/// Kind and level of each line.
fn levels(output: &str) -> Vec<(String, String)> {
    let read = |line: &str| -> Value { serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}")) };
    let words = |line: Value| {
        let time = line["time"].as_str().unwrap().to_owned();
        let (at, _) = stamp::text(&time, None).unwrap();
        assert!(at.seconds() > 1.7e9 && time.ends_with('Z'), "{time}");
        ["kind", "level"].map(|name| line[name].as_str().unwrap().to_owned()).into()
    };
    output.lines().map(|line| words(read(line))).collect()
}

#[test]
fn every_line_has_its_time_and_level_as_json() {
    let ended = run("--log-format json");
    let reported = levels(&ended.stdout);
    let has = |kind: &str, level: &str| reported.contains(&(kind.to_owned(), level.to_owned()));
    assert!(has("silent", "error") && has("unhealable", "error"), "{reported:?}");
    let notes = levels(&ended.stderr);
    assert!(notes.contains(&("note".to_owned(), "info".to_owned())), "{notes:?}");
}

#[test]
fn every_line_has_its_time_and_level_as_text() {
    let ended = run("--log-format text");
    for line in ended.stdout.lines().chain(ended.stderr.lines()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        assert!(stamp::text(words[0], None).is_some() && words[0].ends_with('Z'), "{line}");
        assert!(["error", "warning", "info"].contains(&words[1]), "{line}");
    }
    let silent = ended.stdout.lines().find(|line| line.contains(" silent "));
    assert!(
        silent.unwrap().contains("error   silent /level nothing received within 500 ms"),
        "{}",
        ended.stdout
    );
}

#[test]
fn less_and_more_is_reported_as_wanted() {
    let kinds = |options: &str| {
        let ended = run(&format!("--log-format json {options}"));
        let mut levels: Vec<String> = [&ended.stdout, &ended.stderr]
            .into_iter()
            .flat_map(|output| levels(output))
            .map(|(_, level)| level)
            .collect();
        levels.sort();
        levels.dedup();
        levels
    };
    assert_eq!(kinds(""), ["error", "info"]);
    assert_eq!(kinds("-q"), ["error"]);
    assert_eq!(kinds("-qq"), ["error"]);
    assert_eq!(kinds("-v"), ["debug", "error", "info"]);
    let folder = Folder::new();
    folder.refuses("run -q -v", &["cannot be used with"]);
    folder.refuses("run --json --log-format json", &["cannot be used with"]);
}
