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
    run("patch m.yaml tuned.yaml -o m.yaml");
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
    let flight = [("xspeed", "latitude"), ("yspeed", "longitude"), ("zspeed", "height_above_takeoff")];
    has_rates("quad", quad(), &flight);
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

/// The model of the cell without the relation of its voltage, beside the first half of its recording.
fn cell_to_learn(folder: &Folder) -> Option<Case> {
    let case = case("cell.yaml", "battery/discharge_1c.csv")?;
    let text = std::fs::read_to_string(&case.model).unwrap();
    let (before, rest) = text.split_once("  # While charging, discharging and resting").unwrap();
    let (_, after) = rest.split_once("error: 0.07 V\n").unwrap();
    std::fs::write(folder.0.join("cell.yaml"), format!("{before}{after}")).unwrap();
    let recorded = std::fs::read_to_string(&case.recording).unwrap();
    let is_early = |line: &&str| line.split(',').nth(1).unwrap().parse().unwrap_or(0.0) < HALF_S;
    let early: Vec<&str> = recorded.lines().filter(is_early).collect();
    std::fs::write(folder.0.join("discharge_1c.csv"), early.join("\n")).unwrap();
    Some(case)
}

/// Half of the cell's recording.
const HALF_S: f64 = 33_000.0;

/// The rows of the cell's recording: seconds, current, voltage, and the charge above empty.
fn rows(recording: &Path) -> Vec<[f64; 4]> {
    let text = std::fs::read_to_string(recording).unwrap();
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let field = |at: usize| fields.get(at)?.parse::<f64>().ok();
        let (current, counted) = (field(8)?, field(11)?);
        let charge = if current < -1.0 || counted < -0.01 { 30.34 + counted } else { counted };
        Some([field(1)?, current, field(9)?, charge])
    };
    text.lines().skip(1).filter_map(row).collect()
}

/// The points of a table in an equation, such as `table(charge, [1 Ah, 3.4 V], ..)`, and the factor of the current.
fn curve(equation: &str) -> (Vec<(f64, f64)>, f64) {
    let number = |text: &str| text.split_whitespace().next().unwrap().parse::<f64>().unwrap();
    let points =
        equation.split('[').skip(1).map(|it| it.split(']').next().unwrap().split_once(", ").unwrap());
    let points = points.map(|(at, value)| (number(at), number(value))).collect();
    (points, number(equation.rsplit_once(") + ").unwrap().1))
}

/// The value of the lines through points, of which the outer ones go on.
fn value(points: &[(f64, f64)], at: f64) -> f64 {
    let place = points[1..points.len() - 1].partition_point(|it| it.0 <= at);
    let ((low, start), (high, end)) = (points[place], points[place + 1]);
    start + (at - low) / (high - low) * (end - start)
}

/// The curve of `models/cell.yaml` and its resistance in ohm.
const BY_HAND: [(f64, f64); 9] = [
    (-5.0, 1.771),
    (1.0, 3.445),
    (2.0, 3.605),
    (4.0, 3.7),
    (8.0, 3.803),
    (14.0, 3.901),
    (20.0, 3.986),
    (25.0, 4.034),
    (40.0, 4.512),
];
const RESISTANCE: f64 = 0.004;

#[test]
fn the_curve_and_the_resistance_of_a_cell_are_found_again() {
    let folder = Folder::new("cell");
    let Some(Case { recording, .. }) = cell_to_learn(&folder) else { return };
    let early = Path::new("discharge_1c.csv");
    let words = ["learn", "RECORDING", "--model", "cell.yaml", "--json"];
    let found: Value = serde_json::from_str(&folder.run(&words, early)).unwrap();
    let relations = found["relations"].as_array().unwrap();
    let is_terminal = |it: &&Value| it["variables"] == serde_json::json!(["voltage", "current", "charge"]);
    let terminal = relations.iter().find(is_terminal).unwrap_or_else(|| panic!("{found:#}"));
    let (points, resistance) = curve(terminal["equation"].as_str().unwrap());
    assert!((resistance / RESISTANCE - 1.0).abs() < 0.05, "{terminal:#}");
    for (charge, voltage) in &BY_HAND[1..8] {
        assert!((value(&points, *charge) / voltage - 1.0).abs() < 0.05, "{charge} Ah: {terminal:#}");
    }
    let rows = rows(&recording);
    let unseen = &rows[rows.partition_point(|it| it[0] < HALF_S)..];
    let error = |points: &[(f64, f64)], resistance: f64| {
        let error = |[_, current, voltage, charge]: &[f64; 4]| {
            (voltage - value(points, *charge) - resistance * current).powi(2)
        };
        (unseen.iter().map(error).sum::<f64>() / unseen.len() as f64).sqrt()
    };
    let (learned, by_hand) = (error(&points, resistance), error(&BY_HAND, RESISTANCE));
    assert!(learned < 1.2 * by_hand, "{learned} V against {by_hand} V: {terminal:#}");
    assert_eq!((&terminal["statistical"], &terminal["refused"]), (&false.into(), &Value::Null));
}
