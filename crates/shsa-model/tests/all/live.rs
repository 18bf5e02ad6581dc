//! Models that are changed by further texts: the reports and their places.

use shsa_core::knowledge::KnowledgeBase;
use shsa_model::Report;
use shsa_model::live::{Live, Written, join};

const MODEL: &str = "\
shsa: 1
variables:
  speed: { unit: m/s }
  twice: { unit: m/s }
relations:
  doubled: twice = 2 * speed
signals:
  /a: { variable: speed, rate: 10 Hz, properties: { accuracy: 0.9 } }
  /b: { variable: speed, rate: 10 Hz }
needs:
  twice: { max_age: 1 s }
";

fn written<'t>(name: &'t str, text: &'t str) -> Written<'t> {
    Written { name, text }
}

fn live() -> Live {
    let (live, report) = Live::load(written("model.yaml", MODEL)).unwrap();
    assert_eq!(report, Report::default());
    live
}

/// All that is known, but for the version.
fn knowledge_text(knowledge: &KnowledgeBase) -> String {
    format!(
        "{:?} {:?} {:?} {:?}",
        knowledge.variables(),
        knowledge.relations(),
        knowledge.signals(),
        knowledge.needs()
    )
}

/// The problems with their places; the model is unchanged afterwards.
#[track_caller]
fn check_wrong(change: &str, expected: &[&str]) {
    let mut live = live();
    let before = format!("{live:?}");
    let report = live.change(written("change.yaml", change)).unwrap_err();
    let found: Vec<String> = report
        .diagnostics
        .iter()
        .map(|found| format!("{}:{}:{}: {}", found.file, found.line, found.column, found.message))
        .collect();
    assert_eq!(found, expected);
    assert_eq!(format!("{live:?}"), before);
}

#[test]
fn specifications_come_and_go() {
    let mut live = live();
    let before = knowledge_text(live.knowledge());
    let calm =
        "specifications: { calm: speed < 50 m/s, lively: { eventually: speed > 1 m/s, within: 1 min } }\n";
    assert_eq!(live.change(written("change.yaml", calm)).unwrap(), Report::default());
    assert_eq!(live.knowledge().specifications().len(), 2);
    live.change(written("change.yaml", "specifications: { calm: null, lively: null }\n")).unwrap();
    assert_eq!(live.knowledge().specifications().len(), 0);
    assert_eq!(knowledge_text(live.knowledge()), before);
}

#[test]
fn entries_are_added_replaced_and_removed() {
    let mut live = live();
    let change = "\
relations: { doubled: null, halved: speed = twice / 2 }
signals:
  /b: { variable: twice, rate: 5 Hz }
needs: { speed: {} }
available: { /a: false }
properties: { signals: { /a: { accuracy: null, cost: 2 } } }
";
    let report = live.change(written("change.yaml", change)).unwrap();
    assert_eq!(report, Report::default());
    let at_once = MODEL
        .replace("doubled: twice = 2 * speed", "halved: speed = twice / 2")
        .replace("accuracy: 0.9", "cost: 2")
        .replace("/b: { variable: speed, rate: 10 Hz }", "/b: { variable: twice, rate: 5 Hz }")
        + "  speed: {}\n";
    assert_eq!(
        knowledge_text(live.knowledge()),
        knowledge_text(&shsa_model::load(&at_once, "at once").knowledge)
    );
    let a = live.knowledge().signal("/a").unwrap();
    assert!(!live.knowledge().is_available(a) && live.knowledge().version() > 0);
    // A whole model replaces all of it; a withdrawn signal stays withdrawn.
    live.change(written("model.yaml", MODEL)).unwrap();
    assert_eq!(
        knowledge_text(live.knowledge()),
        knowledge_text(&shsa_model::load(MODEL, "model.yaml").knowledge)
    );
    assert!(!live.knowledge().is_available(live.knowledge().signal("/a").unwrap()));
}

#[test]
fn problems_are_reported_where_they_come_from() {
    check_wrong(
        "variables: { twice: null }\n",
        &["model.yaml:6:12: `twice` is not defined", "model.yaml:11:3: there is no variable `twice`"],
    );
    check_wrong(
        "signals: { /c: { variable: spede }, /d: null }\nneeds: { twice: null, speed: { max_aeg: 1 s } }\n",
        &[
            "change.yaml:1:28: there is no variable `spede`",
            "change.yaml:1:37: there is no signal `/d` to change",
            "change.yaml:2:32: unknown key `max_aeg`",
        ],
    );
    check_wrong(
        "properties: { signals: { /a: { accuracy: 2 } }, needs: {} }\navailable: { /b: perhaps }\n",
        &[
            "change.yaml:1:42: `accuracy: 2` makes no sense",
            "change.yaml:1:49: unknown key `needs`",
            "change.yaml:2:18: a signal is available or not",
        ],
    );
    check_wrong("", &["change.yaml:0:0: there is nothing in it"]);
    check_wrong("shsa: 1\nsignals: { /a: null }\n", &["change.yaml:2:12: signal `/a` carries no variable"]);
    check_wrong("relations: [", &["change.yaml:1:12: this is no YAML: unclosed bracket '['"]);
}

#[test]
fn a_thousand_changes_keep_no_texts() {
    let mut live = live();
    let size = |live: &Live| format!("{live:?}").len();
    let add = format!("# {}\nsignals: {{ /c: {{ variable: twice }} }}\n", "x".repeat(1_000));
    let remove = "signals: { /c: null }\n";
    let mut change = |text: &str| {
        live.change(written("change.yaml", text)).unwrap();
        size(&live)
    };
    let (with, without) = (change(&add), change(remove));
    for _ in 0..500 {
        // The version grows by digits, and a report still finds its file.
        assert!(change(&add) <= with + 8 && change(remove) <= without + 8);
    }
    let report = live.change(written("change.yaml", "variables: { speed: null }")).unwrap_err();
    assert!(
        report.diagnostics.iter().all(|found| found.file == "model.yaml" && found.line > 0),
        "{report:?}"
    );
}

#[test]
fn joined_files_are_both_named() {
    let other =
        "shsa: 1\nvariables:\n  speed: { unit: km/h, range: [0, 9] }\nsignals:\n  /c: { variable: speed }\n";
    let report = join(&[written("a.yaml", MODEL), written("b.yaml", other)]).unwrap_err();
    let found = &report.diagnostics[0];
    assert_eq!((found.file.as_str(), found.line, found.column), ("b.yaml", 3, 3));
    assert_eq!(found.message, "two parts describe variable `speed` differently: unit: `m/s` and `km/h`");
    let help = "it is described at a.yaml:3:3 already: make both the same, or keep one";
    assert_eq!(found.help.as_deref(), Some(help));
    let right = other.replace("km/h", "m/s");
    let (live, report) = join(&[written("a.yaml", MODEL), written("b.yaml", &right)]).unwrap();
    assert_eq!((report, live.knowledge().signals().len()), (Report::default(), 3));
    // What is wrong with the whole is reported in the part that it stands in.
    let broken = right.replace("variable: speed", "variable: spede");
    let report = join(&[written("a.yaml", MODEL), written("b.yaml", &broken)]).unwrap_err();
    assert_eq!((report.diagnostics[0].file.as_str(), report.diagnostics[0].line), ("b.yaml", 5));
}
