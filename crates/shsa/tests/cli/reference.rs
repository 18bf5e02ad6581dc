//! Compares `docs/json.md` and `docs/events.md` with the output of the commands, and `shsa help` with the pages of the reference.

#[path = "../described/mod.rs"]
mod described;

use crate::doctor;
use crate::folder::Folder;
use crate::journal;
use crate::learn;
use crate::tank;
use described::check;
use described::document::Document;
use serde_json::Value;
use std::collections::BTreeSet;

/// Contracts for the tank.
const CERTIFIED: &str = "contracts: { level: { asks: { right: { error: at most 1 m, level: SIL 1 } } }, \
    /level: { gives: { right: { error: at most 0.5 m, level: SIL 2 } } } }\n";

/// Runs a command in the project, and returns each object of its output.
fn objects(folder: &Folder, arguments: &str) -> Vec<Value> {
    let project = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let arguments = arguments.replace("PROJECT", project);
    let printed = folder.run(&format!("{arguments} --json"));
    let lines = printed.stdout.lines();
    let objects: Vec<Value> = lines.map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(!objects.is_empty(), "shsa {arguments} printed nothing: {}", printed.stderr);
    objects
}

#[test]
fn fields_of_models() {
    let folder = tank::folder();
    let bad = "shsa: 1\nvariables:\n  level: { unti: m }\nsignals:\n  /level: { variable: level }\n";
    folder.write("bad.yaml", bad);
    let of = |commands: &[&str]| -> Vec<Value> {
        commands.iter().flat_map(|command| objects(&folder, command)).collect()
    };
    check("check", &of(&["check tank.yaml", "check bad.yaml"]));
    check("plan", &of(&["plan tank.yaml level --all", "plan tank.yaml level --max-width 0.001 --why"]));
    check(
        "plan --contingency",
        &of(&["plan tank.yaml --contingency --pairs", "plan PROJECT/models/stop.yaml --contingency"]),
    );
    let models = ["car", "quad", "husky", "cell", "watertank"]
        .map(|name| format!("analyze PROJECT/models/{name}.yaml"));
    let analyses = models
        .iter()
        .map(String::as_str)
        .chain(["analyze tank.yaml", "analyze PROJECT/models/radars.yaml --liars"])
        .collect::<Vec<_>>();
    check("analyze", &of(&analyses));
    folder.write("none.yaml", "computer: { spare: 1 % }\n");
    let certificate = "guarantees: [{ id: G, dimensions: [{ Binary: { type: T } }] }]\nevidence: []\n\
        demands: [{ id: D, dimensions: [{ Binary: { type: T } }] }]\ngates: []\ntree_propagations: []\n\
        required_services: [{ id: R, functional_service_type: S, demands: [D] }]\n\
        provided_services: [{ id: P, functional_service_type: S, guarantees: [G] }]\n";
    folder.write("certificate.yaml", certificate);
    folder.write("certified.yaml", format!("{}{CERTIFIED}", tank::MODEL));
    check(
        "assure",
        &of(&[
            "assure certified.yaml --over run.csv",
            "assure PROJECT/models/stop.yaml",
            "assure PROJECT/models/stop.yaml --with none.yaml",
            "assure certificate.yaml",
        ]),
    );
}

#[test]
fn fields_of_recordings() {
    let folder = tank::folder();
    let of = |commands: &[&str]| -> Vec<Value> {
        commands.iter().flat_map(|command| objects(&folder, command)).collect()
    };
    folder.write("change.yaml", "properties: { signals: { /level: { accuracy: 0.5 } } }\n");
    check("info", &of(&["info run.csv", "info run.jsonl"]));
    let fusion = "fusion:\n  tank: { method: kalman, states: { level: { spread: 5, noise: 0.1 } }, inputs: { level: level }, outputs: { fused: level } }\n";
    folder.write("fused.yaml", format!("{}{fusion}", tank::MODEL));
    check("replay --compare", &of(&["replay tank.yaml run.jsonl --compare level"]));
    check(
        "replay",
        &of(&[
            "replay tank.yaml run.csv --inject drop:/volume@40s.. --reload change.yaml@10s",
            "replay tank.yaml run.csv --skip 10s..20s",
            "replay fused.yaml run.csv",
        ]),
    );
    let values = |command: &str| -> Vec<Value> {
        let ended = folder.run(&format!("{command} --output out.jsonl"));
        assert!(ended.stderr.is_empty() || !ended.stdout.is_empty(), "{}", ended.stderr);
        folder.read("out.jsonl").lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    folder.write("certified.yaml", format!("{}{CERTIFIED}", tank::MODEL));
    let certified = values("replay certified.yaml run.csv");
    assert!(certified.iter().any(|it| it["level"] == "SIL 2" && it["rank"] == 2), "{:?}", certified.first());
    check("replay --output", &[values("replay tank.yaml run.csv"), certified].concat());
    check(
        "explain",
        &of(&["explain tank.yaml run.csv", "explain PROJECT/stories/02-fallback-by-value.yaml"]),
    );
    check(
        "explain SIGNAL",
        &of(&["explain tank.yaml run.csv /level", "explain tank.yaml run.csv /pressure@5s"]),
    );
}

#[test]
fn fields_of_what_is_simulated() {
    let folder = Folder::new();
    check("demo", &objects(&folder, "demo rover --fast"));
    check("scan", &objects(&folder, "scan PROJECT/models/rover.yaml --for 2s"));
}

#[test]
fn fields_of_what_is_found_out_from_recordings() {
    let folder = Folder::new();
    let car = "PROJECT/examples/car.yaml PROJECT/examples/tuesday";
    check("calibrate", &objects(&folder, &format!("calibrate {car} --faults --false-alarms 20")));
    let learned = [
        "learn PROJECT/examples/tuesday",
        "learn PROJECT/examples/tuesday --model PROJECT/examples/car.yaml",
    ];
    let learned: Vec<Value> = learned.iter().flat_map(|it| objects(&folder, it)).collect();
    folder.write("power.csv", learn::power(2_000));
    folder.write("need.yaml", learn::with_need(&folder, "power.csv"));
    let serving = objects(&folder, "learn power.csv --model need.yaml --for power");
    check("learn", &[learned, objects(&folder, "learn power.csv"), serving].concat());
    folder.write("hall.csv", doctor::hall(Some(2.0)));
    check(
        "doctor",
        &[objects(&folder, "doctor hall.csv"), objects(&folder, "doctor PROJECT/examples/tuesday")].concat(),
    );
    let campaign = format!("campaign {car} --kinds bias --signals /gnss/speed --onsets 1 --json");
    let project = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let printed = |arguments: &str| -> Value {
        let ended = folder.run(&format!("{campaign} {arguments}").replace("PROJECT", project));
        serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{}", ended.stderr))
    };
    let mut before = printed("-");
    before["cells"][0]["detected"] = 0.into();
    folder.write("before.json", before.to_string());
    check("campaign", &[printed("- --detectable"), printed("- --compare before.json")]);
}

/// The fields of events, collected from stories that contain all of them.
#[test]
fn fields_of_events() {
    let folder = tank::folder();
    let printed = objects(&folder, "replay tank.yaml run.csv --inject drop:/volume@40s..");
    let mut found = BTreeSet::new();
    for event in printed.iter().flat_map(|value| value["events"].as_array().unwrap()) {
        found.extend(event.as_object().unwrap().keys().cloned());
    }
    found.remove("time_s");
    let described_fields: BTreeSet<String> =
        Document::read("events.md").section("Fields").named("field").into_iter().collect();
    assert!(found.is_subset(&described_fields), "{found:?}");
    let of_replay: BTreeSet<String> = described::rows("replay")
        .into_iter()
        .filter(|(path, _)| path.len() == 3 && path[0] == "events")
        .map(|(path, _)| path[2].clone())
        .filter(|name| name != "time_s" && name != "session")
        .collect();
    assert_eq!(described_fields, of_replay);
}

#[test]
fn fields_of_journals() {
    let (folder, verify) = (journal::signed(), format!("journal verify {}", journal::FILES));
    let whole = objects(&folder, &format!("{verify} --key public.pem"));
    let text = folder.read("j/rover.jsonl");
    folder.write("j/rover.jsonl", &text[..text.len() - 9]);
    let cut = objects(&folder, &verify);
    folder.write("j/rover.1.jsonl", &text[2..]);
    check("journal verify", &[whole, cut, objects(&folder, &verify)].concat());
}

/// The exit statuses of the commands are those of `docs/json.md`.
#[test]
fn exit_statuses() {
    let folder = tank::folder();
    folder.write("cut.jsonl", &tank::json_lines()[..500]);
    let rows = Document::read("json.md").section("Exit statuses").rows("status");
    let described_fields: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    assert_eq!(described_fields, ["0", "1", "2", "3", "4"]);
    folder.ends("check tank.yaml", 0);
    folder.ends("plan tank.yaml pressure --exclude /level --exclude /pressure --exclude /volume", 1);
    folder.ends("check none.yaml", 2);
    folder.ends("replay tank.yaml cut.jsonl", 3);
    folder.ends("scan --bus mqtt://127.0.0.1:1", 4);
}

#[test]
fn help_prints_the_reference_and_the_help_of_commands() {
    let folder = Folder::new();
    for page in ["model", "formulas", "recordings", "events", "json", "cookbook", "learning", "needs"] {
        let path = format!("{}/../../docs/{page}.md", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).unwrap();
        assert_eq!(folder.ends(&format!("help {page}"), 0).stdout, text);
    }
    assert_eq!(folder.ends("help", 0).stdout, folder.ends("--help", 0).stdout);
    for command in ["replay", "check", "model convert"] {
        assert_eq!(
            folder.ends(&format!("help {command}"), 0).stdout,
            folder.ends(&format!("{command} --help"), 0).stdout
        );
    }
    folder.refuses("help modle", &["modle", "formulas"]);
}

/// Every model of the cookbook and of the recipes is valid, and the command shown below it gives that output.
#[test]
fn the_cookbook_and_the_recipes_are_true() {
    for name in ["cookbook.md", "recipes.md"] {
        let page = Document::read(name);
        let (models, shown) = (page.blocks("yaml"), page.blocks("console"));
        assert!(models.len() >= 6 && models.len() == shown.len(), "{name}");
        models.iter().zip(&shown).for_each(|(model, shown)| is_true(model, shown));
    }
}

/// Checks a model, and runs the command that is shown below it.
#[track_caller]
fn is_true(model: &str, shown: &str) {
    let (command, lines) = shown.split_once('\n').unwrap();
    let (asked, file) = command.strip_prefix("$ shsa ").unwrap().split_once(' ').unwrap();
    let folder = Folder::with(&[(file, model.as_bytes())]);
    let found = folder.json(&format!("check {file}"), 0);
    let problems = found["diagnostics"].as_array().unwrap();
    assert!(problems.iter().all(|problem| problem["severity"] == "note"), "{file}: {problems:?}");
    let printed = folder.ends(&format!("{asked} {file}"), 0).stdout;
    let mut printed = printed.lines();
    for line in lines.lines().filter(|line| *line != "...") {
        assert!(
            printed.any(|printed| printed.trim_end() == line),
            "{file}: not printed, or not there: {line}"
        );
    }
}

/// The output of `calibrate` can be put into the model's file, whose comments stay.
#[test]
fn a_change_is_put_into_the_file() {
    let folder = Folder::with(&[(
        "change.yaml",
        b"signals:\n  /level: { variable: level, rate: 1 Hz, value_error: 7 cm }\n",
    )]);
    folder.write("tank.yaml", tank::MODEL.replace("signals:\n", "signals:\n  # As it came.\n"));
    assert_eq!(folder.ends("model patch tank.yaml change.yaml -o new.yaml", 0).stdout, "");
    let new = folder.read("new.yaml");
    assert!(
        new.contains("  # As it came.\n  /level:    { variable: level, rate: 1 Hz, value_error: 7 cm }\n"),
        "{new}"
    );
    assert_eq!(new.lines().count(), folder.read("tank.yaml").lines().count());
    folder.ends("check new.yaml", 0);
    folder.write("bad.yaml", "signals:\n  /level: { variabel: level }\n");
    folder.refuses("model patch tank.yaml bad.yaml -o never.yaml", &["did you mean `variable`?"]);
    assert!(!folder.path("never.yaml").exists());
}

#[test]
fn the_schema_is_that_of_the_documents() {
    let stored =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/model.schema.json"))
            .unwrap();
    assert_eq!(Folder::new().ends("model schema", 0).stdout, stored);
}
