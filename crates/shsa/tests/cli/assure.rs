//! `shsa assure` on the case studies: who may serve, at which level, and why not.

use crate::folder::Folder;
use serde_json::{Value, json};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const STOP: &str = include_str!("../../../../models/stop.yaml");
const STABILITY: &str = include_str!("../../../../models/stability.yaml");

/// All evidence holds, except that of the computer.
const BUSY: &str = "
/lidar/nearest: { fresh: 40 ms, sound: true }
/sonar/nearest: { fresh: [20 ms, 60 ms], sound: true }
/camera/nearest: { fresh: 40 ms, sound: true }
computer: { spare: 5 % }
";

pub(crate) fn folder() -> Folder {
    Folder::with(&[
        ("stop.yaml", STOP.as_bytes()),
        ("stability.yaml", STABILITY.as_bytes()),
        ("busy.yaml", BUSY.as_bytes()),
    ])
}

/// Way, verdict and level of each way of the first need.
fn ways(answer: &Value) -> Vec<String> {
    let text = |value: &Value| value.as_str().unwrap_or("-").to_owned();
    let ways = answer["needs"][0]["ways"].as_array().unwrap().iter();
    ways.map(|way| format!("{}: {}, {}", text(&way["way"]), text(&way["verdict"]), text(&way["level"])))
        .collect()
}

#[test]
fn the_stop_takes_lidar_or_sonar_and_camera_together_and_neither_alone() {
    let answer = folder().json("assure stop.yaml", 0);
    assert_eq!(
        ways(&answer),
        [
            "/lidar/nearest: given, SIL 2",
            "/sonar/nearest by by_sonar: refused, SIL 1",
            "/camera/nearest by by_camera: refused, SIL 1",
            "/sonar/nearest, /camera/nearest by together: given, SIL 2",
        ]
    );
    let lost: Vec<&Value> = answer["needs"][0]["losses"].as_array().unwrap().iter().collect();
    let left = |signal: &str| lost.iter().find(|loss| loss["signal"] == signal).unwrap()["way"].clone();
    assert_eq!(left("/lidar/nearest"), json!("/sonar/nearest, /camera/nearest by together"));
    assert_eq!(left("/computer/idle"), Value::Null);
}

#[test]
fn a_platform_without_time_takes_the_stop_away() {
    let answer = folder().json("assure stop.yaml --with busy.yaml", 1);
    assert_eq!(answer["needs"][0]["given"], json!(false));
    let lidar = &answer["needs"][0]["ways"][0];
    assert_eq!(lidar["lacks"], json!([[{ "of": "computer", "evidence": "spare" }]]));
    let claim = &answer["needs"][0]["case"][0];
    assert_eq!((&claim["kind"], &claim["verdict"]), (&json!("claim"), &json!("refused")));
    let both = &answer["needs"][0]["ways"][3];
    assert_eq!((&both["verdict"], &both["level"]), (&json!("refused"), &json!("SIL 2")));
}

#[test]
fn a_moment_that_names_nobody_is_reported() {
    let folder = folder();
    folder.write("wrong.yaml", "computr: { spare: 5 % }\n/lidar/nearest: { frsh: 3 ms }\n");
    folder.refuses(
        "assure stop.yaml --with wrong.yaml",
        &[
            "there is no evidence `computr`",
            "did you mean `computer`?",
            "did you mean `fresh`?",
            "wrong.yaml:2",
        ],
    );
}

#[test]
fn the_speed_of_the_car_is_had_at_a_lower_level_from_the_wheels() {
    let answer = folder().json("assure stability.yaml", 0);
    assert_eq!(
        ways(&answer),
        ["/gearbox/speed: given, ASIL B", "/wheels/left, /wheels/right by rolling: given, ASIL A"]
    );
    assert_eq!(answer["needs"][0]["ways"][1]["gives"], json!("gentle"));
}

/// An upgrade brings a new service with its contract, which gives full control without the gearbox.
#[test]
fn a_new_service_gives_what_was_missing() {
    let folder = folder();
    folder.write(
        "upgrade.yaml",
        "signals: { /radar/speed: { variable: speed, rate: 10 Hz, value_error: 0.3 } }\n\
         contracts: { /radar/speed: { evidence: { fresh: age at most 300 ms }, gives: { exact: { error: at most 0.8 m/s, level: ASIL B } } } }\n",
    );
    folder.ends("model patch stability.yaml upgrade.yaml -o upgraded.yaml", 0);
    let after = |model: &str| {
        let answer = folder.json(&format!("assure {model}"), 0);
        let losses = answer["needs"][0]["losses"].as_array().unwrap().clone();
        losses.into_iter().find(|loss| loss["signal"] == "/gearbox/speed").unwrap()["level"].clone()
    };
    assert_eq!((after("stability.yaml"), after("upgraded.yaml")), (json!("ASIL A"), json!("ASIL B")));
}

#[test]
fn the_page_tells_each_node_as_it_stands() {
    let folder = folder();
    folder.ends("assure stop.yaml --with busy.yaml --format html -o case.html", 1);
    let page = folder.read("case.html");
    for words in ["<svg", "spare of computer", "refused", "what each loss takes", "\u{2717}"] {
        assert!(page.contains(words), "{words}");
    }
    assert!(!page.contains("<script"));
}

/// The models with contracts that come with the program.
pub(crate) fn contracted() -> Vec<(String, String)> {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let paths = std::fs::read_dir(models).unwrap().map(|entry| entry.unwrap().path());
    let read = |path: PathBuf| {
        (path.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read_to_string(path).unwrap())
    };
    let all: Vec<_> = paths
        .filter(|path| path.is_file())
        .map(read)
        .filter(|(_, text)| text.contains("\ncontracts:"))
        .collect();
    assert!(all.len() >= 4, "{} models with contracts", all.len());
    all
}

/// Whether SWI-Prolog derives the claim of a program; `None`, told loudly, where there is no SWI-Prolog.
fn is_derived(program: &str) -> Option<bool> {
    let goal = "load_files(user, [stream(user_input)]), (claim -> write(yes) ; write(no)), halt";
    let swipl =
        Command::new("swipl").args(["-q", "-g", goal]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let Ok(mut swipl) = swipl else {
        let _ = writeln!(std::io::stderr(), "SKIPPED: swipl: install SWI-Prolog (swi-prolog-nox)");
        return None;
    };
    swipl.stdin.take().unwrap().write_all(program.as_bytes()).unwrap();
    Some(String::from_utf8(swipl.wait_with_output().unwrap().stdout).unwrap() == "yes")
}

/// SWI-Prolog derives the same verdicts from the program alone.
#[test]
fn prolog_says_the_same() {
    let folder = folder();
    folder.write("nothing.yaml", "");
    let mut asked = vec![("stop.yaml --with busy.yaml".to_owned(), 1)];
    for (name, text) in contracted() {
        folder.write(&name, text);
        asked.extend([(name.clone(), 0), (format!("{name} --with nothing.yaml"), 1)]);
    }
    for (arguments, status) in asked {
        let program = folder.ends(&format!("assure {arguments} --format prolog"), status).stdout;
        let Some(is_derived) = is_derived(&program) else { return };
        assert_eq!(is_derived, status == 0, "{arguments}\n{program}");
    }
}

const WHEEL: &str = "
guarantees: [ { id: SpeedGood, dimensions: [ { Binary: { type: Speed } } ] } ]
evidence: [ { id: Cool, dimension: { Binary: { type: Cool } } } ]
demands: []
gates: []
tree_propagations: [ { from: Cool, to: SpeedGood } ]
required_services: []
provided_services: [ { id: Wheel, functional_service_type: Speed, guarantees: [SpeedGood] } ]
";
const USER: &str = "
guarantees: [ { id: Control, dimensions: [ { Binary: { type: Control } } ] } ]
evidence: []
demands: [ { id: Speed, dimensions: [ { Binary: { type: Speed } } ] } ]
gates: []
tree_propagations: [ { from: Speed, to: Control } ]
required_services: [ { id: S, functional_service_type: Speed, demands: [Speed] } ]
provided_services: [ { id: C, functional_service_type: Control, guarantees: [Control] } ]
";

#[test]
fn certificates_of_others_are_composed_in_any_order() {
    let folder = Folder::with(&[("wheel.yaml", WHEEL.as_bytes()), ("user.yaml", USER.as_bytes())]);
    for files in ["wheel.yaml user.yaml", "user.yaml wheel.yaml"] {
        assert_eq!(folder.json(&format!("assure {files}"), 0)["given"], json!(true));
    }
    let alone = folder.json("assure user.yaml", 1);
    assert_eq!(alone["guarantees"][0]["verdict"], json!("refused"));
}
