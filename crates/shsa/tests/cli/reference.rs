//! `docs/json.md` and `docs/events.md` against what the commands print, and `shsa help` for the pages of the reference.

#[allow(dead_code, reason = "the tests of the formats use all of it")]
#[path = "../../../shsa-format/tests/all/reference/document.rs"]
mod document;

use crate::folder::Folder;
use crate::tank;
use document::{Document, code};
use serde_json::Value;
use std::collections::BTreeSet;

/// Runs a command in the project and gives each object that it prints.
fn objects(folder: &Folder, arguments: &str) -> Vec<Value> {
    let project = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let arguments = arguments.replace("PROJECT", project);
    let printed = folder.run(&format!("{arguments} --json"));
    let lines = printed.stdout.lines();
    let objects: Vec<Value> = lines.map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(!objects.is_empty(), "shsa {arguments} printed nothing: {}", printed.stderr);
    objects
}

/// The rows of a section of `docs/json.md`: the parts of a path, and when it comes.
fn told(section: &str) -> Vec<(Vec<String>, String)> {
    let rows = Document::read("json.md").section(section).rows("field");
    rows.iter().map(|row| (parts(&code(&row[0]).remove(0)), row[2].clone())).collect()
}

/// `a[].b.*` as `a`, `[]`, `b`, `*`.
fn parts(path: &str) -> Vec<String> {
    path.replace("[]", ".[]").split('.').map(str::to_owned).collect()
}

/// Every path in a value, but that of the value itself.
fn walk(value: &Value, path: &[String], found: &mut BTreeSet<Vec<String>>) {
    let below = |name: &str| [path, &[name.to_owned()]].concat();
    let children: Vec<(Vec<String>, &Value)> = match value {
        Value::Object(fields) => fields.iter().map(|(name, value)| (below(name), value)).collect(),
        Value::Array(items) => items.iter().map(|value| (below("[]"), value)).collect(),
        _ => Vec::new(),
    };
    for (path, value) in children {
        walk(value, &path, found);
        found.insert(path);
    }
}

fn matches(told: &[String], path: &[String]) -> bool {
    told.len() == path.len() && told.iter().zip(path).all(|(told, name)| told == "*" || told == name)
}

/// Every field of what is printed is described, and every field that always comes has come.
#[track_caller]
fn check(section: &str, printed: &[Value]) {
    let told = told(section);
    let mut found = BTreeSet::new();
    printed.iter().for_each(|value| walk(value, &[], &mut found));
    for path in &found {
        let is_told = |path: &[String]| told.iter().any(|(told, _)| matches(told, path));
        // The elements of a list have no row where the list has one, nor has what is described by its parts.
        let is_element = path.last().is_some_and(|last| last == "[]") && is_told(&path[..path.len() - 1]);
        let has_parts =
            told.iter().any(|(told, _)| told.len() > path.len() && matches(&told[..path.len()], path));
        assert!(is_told(path) || is_element || has_parts, "{section}: not described: {}", path.join("."));
    }
    for (told, _) in told.iter().filter(|(_, comes)| comes.is_empty()) {
        // A field of the elements of a list, or of a mapping, comes where these do.
        let free = told.iter().rposition(|part| part == "[]" || part == "*").map_or(0, |at| at + 1);
        let is_there = |told: &[String]| told.is_empty() || found.iter().any(|path| matches(told, path));
        assert!(!is_there(&told[..free]) || is_there(told), "{section}: has not come: {}", told.join("."));
    }
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
    check("plan --contingency", &of(&["plan tank.yaml --contingency --pairs"]));
    let models = ["car", "quad", "husky", "cell", "watertank"]
        .map(|name| format!("analyze PROJECT/models/{name}.yaml"));
    let analyses = models.iter().map(String::as_str).chain(["analyze tank.yaml"]).collect::<Vec<_>>();
    check("analyze", &of(&analyses));
}

#[test]
fn fields_of_recordings() {
    let folder = tank::folder();
    let of = |commands: &[&str]| -> Vec<Value> {
        commands.iter().flat_map(|command| objects(&folder, command)).collect()
    };
    folder.write("change.yaml", "properties: { signals: { /level: { accuracy: 0.5 } } }\n");
    check("monitor", &of(&["monitor tank.yaml level --observations run.jsonl"]));
    check(
        "replay",
        &of(&[
            "replay tank.yaml run.csv --inject drop:/volume@40s.. --reload change.yaml@10s",
            "replay tank.yaml run.csv --skip 10s..20s",
        ]),
    );
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

/// The fields of events, as they come from stories that show all of them.
#[test]
fn fields_of_events() {
    let folder = tank::folder();
    let printed = objects(&folder, "replay tank.yaml run.csv --inject drop:/volume@40s..");
    let mut found = BTreeSet::new();
    for event in printed.iter().flat_map(|value| value["events"].as_array().unwrap()) {
        found.extend(event.as_object().unwrap().keys().cloned());
    }
    found.remove("time_s");
    let told: BTreeSet<String> =
        Document::read("events.md").section("Fields").named("field").into_iter().collect();
    assert!(found.is_subset(&told), "{found:?}");
    let of_replay: BTreeSet<String> = self::told("replay")
        .into_iter()
        .filter(|(path, _)| path.len() == 3 && path[0] == "events")
        .map(|(path, _)| path[2].clone())
        .filter(|name| name != "time_s" && name != "session")
        .collect();
    assert_eq!(told, of_replay);
}

/// The statuses of `docs/json.md` are those that commands end with.
#[test]
fn exit_statuses() {
    let folder = tank::folder();
    folder.write("cut.jsonl", &tank::json_lines()[..500]);
    let rows = Document::read("json.md").section("Exit statuses").rows("status");
    let told: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    assert_eq!(told, ["0", "1", "2", "3"]);
    folder.ends("check tank.yaml", 0);
    folder.ends("plan tank.yaml pressure --exclude /level --exclude /pressure --exclude /volume", 1);
    folder.ends("check none.yaml", 2);
    folder.ends("replay tank.yaml cut.jsonl", 3);
}

#[test]
fn help_prints_the_reference_and_the_help_of_commands() {
    let folder = Folder::new();
    for page in ["model", "formulas", "recordings", "events", "json"] {
        let path = format!("{}/../../docs/{page}.md", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).unwrap();
        assert_eq!(folder.ends(&format!("help {page}"), 0).stdout, text);
    }
    assert_eq!(folder.ends("help", 0).stdout, folder.ends("--help", 0).stdout);
    for command in ["replay", "check"] {
        assert_eq!(
            folder.ends(&format!("help {command}"), 0).stdout,
            folder.ends(&format!("{command} --help"), 0).stdout
        );
    }
    folder.refuses("help modle", &["modle", "formulas"]);
}

/// Every model of the cookbook is right, and `shsa analyze` says of it what stands below it.
#[test]
fn the_cookbook_is_true() {
    let page = Document::read("cookbook.md");
    let (models, shown) = (page.blocks("yaml"), page.blocks("console"));
    assert!(models.len() >= 6 && models.len() == shown.len());
    for (model, shown) in models.iter().zip(&shown) {
        let (command, lines) = shown.split_once('\n').unwrap();
        let file = command.strip_prefix("$ shsa analyze ").unwrap();
        let folder = Folder::with(&[(file, model.as_bytes())]);
        let found = folder.json(&format!("check {file}"), 0);
        let problems = found["diagnostics"].as_array().unwrap();
        assert!(problems.iter().all(|problem| problem["severity"] == "note"), "{file}: {problems:?}");
        let printed = folder.ends(&format!("analyze {file}"), 0).stdout;
        let mut printed = printed.lines();
        for line in lines.lines().filter(|line| *line != "...") {
            assert!(printed.any(|printed| printed == line), "{file}: not printed, or not there: {line}");
        }
    }
}

/// What `calibrate` writes goes into the model's file, and the comments stay.
#[test]
fn a_change_is_put_into_the_file() {
    let folder = Folder::with(&[(
        "change.yaml",
        b"signals:\n  /level: { variable: level, rate: 1 Hz, value_error: 7 cm }\n",
    )]);
    folder.write("tank.yaml", tank::MODEL.replace("signals:\n", "signals:\n  # As it came.\n"));
    assert_eq!(folder.ends("patch tank.yaml change.yaml -o new.yaml", 0).stdout, "");
    let new = folder.read("new.yaml");
    assert!(
        new.contains("  # As it came.\n  /level:    { variable: level, rate: 1 Hz, value_error: 7 cm }\n"),
        "{new}"
    );
    assert_eq!(new.lines().count(), folder.read("tank.yaml").lines().count());
    folder.ends("check new.yaml", 0);
    folder.write("bad.yaml", "signals:\n  /level: { variabel: level }\n");
    folder.refuses("patch tank.yaml bad.yaml -o never.yaml", &["did you mean `variable`?"]);
    assert!(!folder.path("never.yaml").exists());
}

#[test]
fn the_schema_is_that_of_the_documents() {
    let stored =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/model.schema.json"))
            .unwrap();
    assert_eq!(Folder::new().ends("schema", 0).stdout, stored);
}
