//! Assurance cases as GSN: the rules that `gsn2x -c` checks (version 4.3), by their numbers there.

use crate::assure::{contracted, folder};
use crate::folder::Folder;
use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::process::Command;

pub(crate) type Case = BTreeMap<String, Map<String, Value>>;

/// What an element may say: any other key is a layer to `gsn2x`, and a slip of ours.
const KEYS: [&str; 7] =
    ["text", "supportedBy", "undeveloped", "defeated", "classes", "challenges", "over_time"];

/// The elements of a module: a line for its name, then an element a line, in YAML's flow style with texts as in JSON.
#[track_caller]
fn read(text: &str) -> Case {
    let mut case = Case::new();
    assert!(text.starts_with("module: { name: "), "C06: {text}");
    for line in text.lines().skip(1) {
        let (id, element) = line.split_once(": ").unwrap_or_else(|| panic!("{line}"));
        let was = case.insert(id.to_owned(), element_of(element));
        assert!(was.is_none(), "C07: {id} is there twice");
    }
    case
}

fn element_of(text: &str) -> Map<String, Value> {
    let inner =
        text.strip_prefix("{ ").and_then(|text| text.strip_suffix(" }")).unwrap_or_else(|| panic!("{text}"));
    let mut element = Map::new();
    let mut rest = inner;
    while let Some((key, after)) = rest.split_once(": ") {
        let (value, after) = value_of(after);
        element.insert(key.to_owned(), value);
        rest = after.strip_prefix(", ").unwrap_or(after);
    }
    assert!(rest.is_empty(), "{rest} of {text}");
    element
}

/// A text, a list of words, or a word; and what follows it.
fn value_of(text: &str) -> (Value, &str) {
    if text.starts_with('"') {
        let mut values = serde_json::Deserializer::from_str(text).into_iter::<String>();
        let value = values.next().unwrap().unwrap();
        return (Value::from(value), &text[values.byte_offset()..]);
    }
    if let Some((list, after)) = text.strip_prefix('[').and_then(|text| text.split_once(']')) {
        return (list.split(", ").map(str::to_owned).collect(), after);
    }
    let (word, _) = text.split_once(", ").unwrap_or((text, ""));
    (Value::from(word), &text[word.len()..])
}

/// All elements of a folder's case, from its index on.
#[track_caller]
fn read_all(folder: &Folder, case: &str) -> Case {
    let file = |name: &str| folder.read(&format!("{case}/{name}"));
    let index = file("index.gsn.yaml");
    let module = element_of(index.lines().next().unwrap().strip_prefix("module: ").unwrap());
    let mut all = read(&index);
    for used in module["uses"].as_array().unwrap() {
        let used: String = serde_json::from_str(used.as_str().unwrap()).unwrap();
        for (id, element) in read(&file(&used)) {
            assert!(all.insert(id.clone(), element).is_none(), "C07: {id} of {used} is there twice");
        }
    }
    all
}

/// What `gsn2x -c` says of the case in a folder: `None` where there is no `gsn2x`. Its exit status is 0 where it only warns.
fn said(folder: &Folder, case: &str) -> Option<String> {
    let mut command = Command::new("gsn2x");
    match command.args(["-c", "--extended-check"]).current_dir(folder.path(case)).output() {
        Ok(output) => Some(String::from_utf8_lossy(&output.stderr).into_owned()),
        Err(error) => {
            let from = "https://github.com/jonasthewolf/gsn2x";
            _ = writeln!(
                std::io::stderr(),
                "SKIPPED: gsn2x: {error}: the checks by the program itself ({from})"
            );
            None
        }
    }
}

/// Holds a folder's case against the rules, and against `gsn2x` itself where there is one.
#[track_caller]
pub(crate) fn passes(folder: &Folder, case: &str) -> Case {
    let all = read_all(folder, case);
    assert_eq!(problems(&all), [""; 0], "{all:?}");
    assert_eq!(said(folder, case).unwrap_or_default(), "", "{all:?}");
    all
}

fn is_goal_or_strategy(id: &str) -> bool {
    id.starts_with("G-") || id.starts_with("S-")
}

/// What `gsn2x -c` would say.
fn problems(case: &Case) -> Vec<String> {
    let mut found = Vec::new();
    let list = |element: &Map<String, Value>, key: &str| -> Vec<String> {
        let ids = element.get(key).and_then(Value::as_array).into_iter().flatten();
        ids.map(|id| id.as_str().unwrap().to_owned()).collect()
    };
    let is_set = |element: &Map<String, Value>, key: &str| element.get(key).is_some_and(|it| it == "true");
    let mut supporting = BTreeSet::new();
    for (id, element) in case {
        let by = list(element, "supportedBy");
        let mut say = |rule: &str, holds: bool| {
            if !holds {
                found.push(format!("{rule}: {id}"));
            }
        };
        say("a key that is a layer", element.keys().all(|key| KEYS.contains(&key.as_str())));
        say("V01", ["G-", "S-", "Sn-", "CSn-"].iter().any(|prefix| id.starts_with(prefix)));
        say("V02", !is_goal_or_strategy(id) || !by.is_empty() || is_set(element, "undeveloped"));
        say("V03", by.is_empty() || !is_set(element, "undeveloped"));
        say("V04", by.is_empty() || is_goal_or_strategy(id));
        say("V04", by.iter().all(|by| is_goal_or_strategy(by) || by.starts_with("Sn-")));
        say("V05", by.iter().collect::<BTreeSet<_>>().len() == by.len());
        say("V06", !by.contains(id));
        say("C03", by.iter().all(|by| case.contains_key(by)));
        let challengers = case.values().filter(|it| it.get("challenges").is_some_and(|it| it == id.as_str()));
        say("V10", is_set(element, "defeated") == (challengers.count() > 0));
        let challenged = element.get("challenges").and_then(Value::as_str);
        say("V12", challenged.is_none() || id.starts_with("CSn-"));
        say("C13, C14", challenged.is_none_or(|other| other != id && case.contains_key(other)));
        say("text", element.get("text").and_then(Value::as_str).is_some_and(|text| !text.is_empty()));
        supporting.extend(by);
    }
    let roots: Vec<&String> =
        case.keys().filter(|id| !id.starts_with("CSn-") && !supporting.contains(*id)).collect();
    if roots.len() != 1 || !roots.iter().all(|root| root.starts_with("G-")) {
        found.push(format!("C01, C02: {roots:?}"));
    }
    let mut reached = BTreeSet::new();
    for root in roots {
        found.extend(walk(case, root, &mut Vec::new(), &mut reached));
    }
    let is_lost = |id: &&String| !id.starts_with("CSn-") && !reached.contains(*id);
    found.extend(case.keys().filter(is_lost).map(|id| format!("C08: {id}")));
    found
}

/// The cycles below an element.
fn walk(case: &Case, id: &str, above: &mut Vec<String>, reached: &mut BTreeSet<String>) -> Option<String> {
    if above.iter().any(|it| it == id) {
        return Some(format!("C04: {id}"));
    }
    reached.insert(id.to_owned());
    above.push(id.to_owned());
    let by = case.get(id).and_then(|element| element.get("supportedBy")?.as_array());
    let found = by.into_iter().flatten().find_map(|by| walk(case, by.as_str().unwrap(), above, reached));
    above.pop();
    found
}

#[track_caller]
pub(crate) fn check(text: &str) -> Case {
    let case = read(text);
    assert_eq!(problems(&case), [""; 0], "{text}");
    case
}

#[test]
fn the_rules_find_what_is_wrong() {
    let sound = "module: { name: a }\nG-a-0: { text: \"a, \\\"b\\\": c\", supportedBy: [Sn-a-1], classes: [given] }\nSn-a-1: { text: \"b\" }\n";
    check(sound);
    let wrong =
        [("supportedBy: [Sn-a-1], ", "V02"), ("Sn-a-1], classes", "C03"), ("classes: [given]", "V03")];
    let changed = [
        sound.replace(wrong[0].0, ""),
        sound.replace(wrong[1].0, "Sn-a-2], classes"),
        sound.replace(wrong[2].0, "undeveloped: true"),
    ];
    for ((_, rule), text) in wrong.iter().zip(changed) {
        let found = problems(&read(&text));
        assert!(found.iter().any(|problem| problem.starts_with(rule)), "{rule}: {found:?}");
    }
    let round = "module: { name: a }\nG-a-0: { text: \"a\", supportedBy: [G-a-1] }\nG-a-1: { text: \"b\", supportedBy: [G-a-2] }\n\
                 G-a-2: { text: \"c\", supportedBy: [G-a-1] }\n";
    assert_eq!(problems(&read(round)), ["C04: G-a-1"]);
}

#[test]
fn every_case_keeps_the_rules() {
    let folder = folder();
    for (arguments, status) in [
        ("assure stop.yaml", 0),
        ("assure stop.yaml --with busy.yaml", 1),
        ("assure stability.yaml", 0),
        ("assure stability.yaml --with nothing.yaml", 1),
    ] {
        folder.write("nothing.yaml", "");
        let printed = folder.ends(&format!("{arguments} --format gsn"), status).stdout;
        let case = check(&printed);
        assert_eq!(case.values().any(|element| element.contains_key("defeated")), arguments.contains("busy"));
        let drawn = folder.ends(&format!("{arguments} --format svg"), status).stdout;
        assert!(drawn.starts_with("<svg") && drawn.trim_end().ends_with("</svg>"), "{drawn}");
    }
}

/// Several needs are several modules, whose elements are told apart.
#[test]
fn a_module_a_need() {
    let folder = folder();
    let two = folder.read("stop.yaml").replace(
        "  dmin: { signal: /stop/dmin, max_age: 500 ms, max_width: 1 m }",
        "  dmin:\n    - { signal: /stop/dmin, max_age: 500 ms }\n    - { signal: stop_dmin, max_age: 500 ms }",
    );
    let other = "  stop_dmin: { asks: { near: { of: dmin, error: at most 0.3 m, level: SIL 2 } } }\n";
    folder.write("two.yaml", two.replace("  dmin:\n    runs_on", "  /stop/dmin:\n    runs_on") + other);
    folder.ends("assure two.yaml --format gsn -o case", 0);
    let cases =
        ["stop_dmin", "stop_dmin_2"].map(|name| check(&folder.read(&format!("case/{name}.gsn.yaml"))));
    assert!(cases[0].keys().all(|id| !cases[1].contains_key(id)), "C07");
    let all = passes(&folder, "case");
    assert_eq!(all["G-index-0"]["supportedBy"], serde_json::json!(["G-stop_dmin-0", "G-stop_dmin_2-0"]));
}

/// The models with contracts that come with the program, whatever stands: the rules, and `gsn2x` itself where there is one.
#[test]
fn every_shipped_model_passes() {
    let folder = Folder::with(&[("nothing.yaml", b"")]);
    for (model, text) in contracted() {
        folder.write(&model, text);
        for (with, status) in [("", 0), (" --with nothing.yaml", 1)] {
            let case = format!("{model}.{status}");
            std::fs::create_dir(folder.path(&case)).unwrap();
            folder.ends(&format!("assure {model}{with} --format gsn -o {case}"), status);
            let all = passes(&folder, &case);
            let is_given = all["G-index-0"]["classes"] == serde_json::json!(["given"]);
            assert_eq!(is_given, status == 0, "{all:?}");
        }
    }
}

/// A service gives one of its guarantees: they are alternatives under one claim.
#[test]
fn certificates_of_others_pass() {
    let guarantee = |id: &str| format!("{{ id: {id}, dimensions: [ {{ Binary: {{ type: {id} }} }} ] }}");
    let text = format!(
        "guarantees: [ {}, {} ]\nevidence: [ {{ id: Cool, dimension: {{ Binary: {{ type: Cool }} }} }} ]\ndemands: []\ngates: []\n\
         tree_propagations: [ {{ from: Cool, to: Good }} ]\nrequired_services: []\n\
         provided_services: [ {{ id: W, functional_service_type: Speed, guarantees: [Good, Poor] }} ]\n",
        guarantee("Good"),
        guarantee("Poor"),
    );
    let folder =
        Folder::with(&[("wheel.yaml", text.as_bytes()), ("hot.yaml", b"wheel.yaml: { Cool: false }")]);
    folder.ends("assure wheel.yaml --with hot.yaml --format gsn -o case", 0);
    let all = passes(&folder, "case");
    let states =
        ["G-wheel_yaml_Good-0", "G-wheel_yaml_Poor-0", "G-index-0"].map(|id| all[id]["classes"][0].clone());
    assert_eq!(states, ["refused", "given", "given"]);
    folder.refuses("assure wheel.yaml --format gsn", &["2 files are written", "-o"]);
    folder.refuses("assure wheel.yaml --format gsn -o case.yaml", &["2 files are written", "case.yaml"]);
}
