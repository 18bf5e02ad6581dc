//! From a recording to a watching model in three commands, without an edit; and the relations that recordings show.

use super::{Case, WORKSPACE, car, case, quad};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder for the files of one test. Dropping it removes the folder.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path =
            Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("drafted-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn run(&self, words: &[&str], recording: &Path) -> String {
        let mut command = Command::new(env!("CARGO_BIN_EXE_shsa"));
        command.current_dir(&self.0);
        for word in words {
            match *word {
                "RECORDING" => command.arg(recording),
                word => command.arg(word),
            };
        }
        let output = command.output().unwrap();
        let reported = String::from_utf8_lossy(&output.stderr);
        assert!(matches!(output.status.code(), Some(0 | 1)), "{command:?}: {}\n{reported}", output.status);
        String::from_utf8(output.stdout).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Drafts and calibrates with the first half, and replays the rest: nothing fails.
#[track_caller]
fn check(name: &str, recorded: Option<Case>, arguments: &str, rest: &str) {
    let Some(Case { recording, .. }) = recorded else { return };
    let recording = Path::new(WORKSPACE).join(recording).canonicalize().unwrap();
    let folder = Folder::new(name);
    let run = |words: &str| folder.run(&words.split_whitespace().collect::<Vec<_>>(), &recording);
    run(&format!("draft RECORDING {arguments} -o m.yaml"));
    run("check m.yaml");
    run("calibrate m.yaml RECORDING --patch tuned.yaml");
    run("model patch m.yaml tuned.yaml -o m.yaml");
    let report: Value =
        serde_json::from_str(&run(&format!("replay m.yaml RECORDING {rest} --json"))).unwrap();
    let failed: Vec<&Value> =
        report["events"].as_array().unwrap().iter().filter(|it| it["kind"] == "failed").collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn nothing_fails_in_the_rest_of_the_drive() {
    check("car", case("car.yaml", "comma2k19"), "", "--from 30s");
}

#[test]
fn nothing_fails_in_the_rest_of_the_flight() {
    check("quad", case("quad.yaml", "quad"), "", "--from 490s");
}

/// Both events with a label lie in the first half.
#[test]
fn nothing_fails_in_the_rest_of_the_rooms() {
    let time = "--by mote_id --time-column reading --time-unit 5s";
    check("motes", case("motes.yaml", "suthaharan/motes.csv"), time, "--from 13000s");
}

/// The draft of a recording has each of these pairs of a quantity and its rate, as a comment.
#[track_caller]
fn has_rates(name: &str, recorded: Option<Case>, pairs: &[(&str, &str)]) {
    let Some(Case { recording, .. }) = recorded else { return };
    let draft = Folder::new(&format!("rates-{name}"))
        .run(&["draft", "RECORDING"], &recording.canonicalize().unwrap());
    let candidates: Vec<&str> = draft.lines().filter(|line| line.starts_with("#   rate_")).collect();
    let is_pair = |line: &&str, (rate, of): &(&str, &str)| {
        line.contains(&format!(": {rate} = ")) && line.contains(&format!("derivative({of}, "))
    };
    for pair in pairs {
        assert!(candidates.iter().any(|line| is_pair(line, pair)), "{pair:?}: {candidates:#?}");
    }
    assert_eq!(candidates.len(), pairs.len(), "{candidates:#?}");
}

#[test]
fn drafts_name_what_is_the_rate_of_something() {
    let flight = [
        ("xspeed", "latitude"),
        ("yspeed", "longitude"),
        ("zspeed", "height_above_takeoff"),
        ("speed", "mileage"),
    ];
    has_rates("quad", quad(), &flight);
    // With the slope of the road in it.
    has_rates("car", car(), &[("acc_x", "wheel")]);
}

fn equations(name: &str, recording: &str, arguments: &[&str]) -> Option<Vec<String>> {
    let Case { recording, .. } = case(&format!("{name}.yaml"), recording)?;
    let words = [&["learn", "RECORDING", "--json"], arguments].concat();
    let recording = Path::new(WORKSPACE).join(recording).canonicalize().unwrap();
    let found: Value =
        serde_json::from_str(&Folder::new(&format!("learn-{name}")).run(&words, &recording)).unwrap();
    let relations = found["relations"].as_array().unwrap().iter();
    Some(relations.map(|it| it["equation"].as_str().unwrap().to_owned()).collect())
}

#[test]
fn the_speeds_of_a_flight_are_the_rates_of_its_position() {
    let Some(found) = equations("quad", "quad", &[]) else { return };
    for (speed, position) in [("xspeed", "latitude"), ("yspeed", "longitude")] {
        let is_it = |it: &&String| {
            it.starts_with(&format!("{speed} = ")) && it.contains(&format!("derivative({position}, "))
        };
        assert!(found.iter().any(|it| is_it(&it)), "{found:?}");
    }
}

#[test]
fn what_a_straight_road_and_a_day_bring_together_is_not_related() {
    if let Some(found) = equations("car", "comma2k19", &[]) {
        let is_friend = |it: &&String| it.contains("latitude") && it.contains("longitude");
        assert_eq!(found.iter().find(is_friend), None);
    }
    let time = ["--by", "mote_id", "--time-column", "reading", "--time-unit", "5s"];
    assert_eq!(equations("motes", "suthaharan/motes.csv", &time).unwrap_or_default(), Vec::<String>::new());
}
