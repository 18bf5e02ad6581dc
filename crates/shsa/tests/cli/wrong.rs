//! Bad input: refused with its position and a reason, without partial results.

use crate::tank;

const BAD: &str = "shsa: 1\nvariables:\n  level: { unti: m }\nsignals:\n  /level: { variable: level }\n";

#[test]
fn a_bad_model_is_refused_by_every_command() {
    let folder = tank::folder();
    folder.write("bad.yaml", BAD);
    let place = ["bad.yaml:3:12", "did you mean `unit`?"];
    folder.refuses("plan bad.yaml level", &place);
    folder.refuses("plan bad.yaml level --json", &place);
    folder.refuses("replay bad.yaml run.csv --compare level", &place);
    folder.refuses("replay bad.yaml run.csv --journal j.jsonl --output o.jsonl", &place);
    assert_eq!(folder.names(), ["bad.yaml", "run.bag", "run.csv", "run.jsonl", "tank.yaml"]);
}

#[test]
fn a_plain_connection_is_refused_where_a_contract_asks_for_more() {
    let folder = tank::folder();
    let text = folder.read("tank.yaml");
    for name in ["encrypted", "authenticated"] {
        let asked = format!("contracts: {{ level: {{ asks: {{ wire: {{ of: level, {name}: yes }} }} }} }}\n");
        folder.write("asks.yaml", format!("{text}{asked}"));
        let asks = format!("the contract of level asks for `{name}`");
        folder.refuses("run asks.yaml --http off --bus mqtt://127.0.0.1:1", &[&asks, "mqtts://"]);
    }
}

#[test]
fn missing_files_are_named() {
    let folder = tank::folder();
    folder.refuses("plan nothing.yaml level", &["nothing.yaml", "No such file"]);
    folder.refuses("replay nothing.yaml run.csv", &["nothing.yaml", "No such file"]);
    folder.refuses("replay tank.yaml nothing.csv", &["nothing.csv", "No such file"]);
    folder.refuses("replay tank.yaml run.csv nothing.csv", &["nothing.csv", "No such file"]);
    folder.refuses("replay tank.yaml", &["<RECORDINGS>"]);
}

#[test]
fn files_of_the_wrong_kind_are_reported() {
    let folder = tank::folder();
    folder.write("empty.csv", "");
    folder.write("fake.bag", "this is no bag");
    folder.write("numbers.csv", "1,2,3\n4,5,6\n");
    folder.write("timeless.csv", "/level,/pressure\n1,2\n");
    folder.refuses("replay run.csv tank.yaml", &["run.csv:1:1", "expected a model"]);
    folder.refuses("replay tank.yaml tank.yaml", &["tank.yaml: not a recording", "table of text (.csv"]);
    folder.refuses("replay tank.yaml fake.bag", &["fake.bag: not a recording"]);
    folder.refuses("replay tank.yaml empty.csv", &["empty.csv: the file is empty"]);
    folder.refuses("replay tank.yaml numbers.csv", &["numbers.csv: the first line holds numbers"]);
    folder.refuses("replay tank.yaml timeless.csv", &["timeless.csv", "--time-column"]);
    let timed = folder.run("replay tank.yaml timeless.csv --time-column /pressure --time-unit 1s");
    assert!(timed.stdout.starts_with("2 observations over 0.0 s"), "{}{}", timed.stdout, timed.stderr);
}

#[test]
fn a_recording_of_something_else_is_reported() {
    let folder = tank::folder();
    folder.write("other.csv", "t [s],/levels,/x\n0,1,2\n1,1,2\n");
    folder.refuses(
        "replay tank.yaml other.csv",
        &["no '/level' in the recording", "/levels", "none of the model's"],
    );
}

#[test]
fn files_to_write_are_opened_before_anything_is_done() {
    let folder = tank::folder();
    folder.write("old.jsonl", "old\n");
    let refused = |arguments: &str, words: &str| {
        folder.refuses(&format!("replay tank.yaml run.csv {arguments}"), &[words]);
        assert_eq!(folder.names(), ["old.jsonl", "run.bag", "run.csv", "run.jsonl", "tank.yaml"]);
        assert_eq!(folder.read("old.jsonl"), "old\n");
    };
    refused("--journal missing/j.jsonl", "missing/j.jsonl cannot be written");
    refused("--journal new.jsonl --output missing/o.jsonl", "missing/o.jsonl cannot be written");
    refused("--journal old.jsonl --output missing/o.jsonl", "missing/o.jsonl cannot be written");
    refused("--output old.jsonl --journal ./old.jsonl", "in use by this run");
    refused("--output run.csv", "in use by this run");
    refused("--journal ./tank.yaml", "in use by this run");
    assert_eq!(folder.read("run.csv"), tank::csv());
    folder.ends("replay tank.yaml run.csv --output old.jsonl", 0);
    assert!(folder.read("old.jsonl").starts_with('{'));
}

#[test]
fn what_is_read_is_not_written_over() {
    let folder = tank::folder();
    let words = "is in use by this run already; name another file to write to";
    for arguments in [
        "analyze tank.yaml --html tank.yaml",
        "assure tank.yaml -o ./tank.yaml",
        "assure tank.yaml --over run.csv -o run.csv",
        "draft run.csv -o run.csv",
        "learn run.csv --patch run.csv",
        "learn run.csv -o run.csv",
        "replay tank.yaml run.csv --report run.csv",
    ] {
        folder.refuses(arguments, &[words]);
    }
    folder.refuses("draft run.csv -o missing/model.yaml", &["missing/model.yaml cannot be written"]);
    assert_eq!(folder.read("run.csv"), tank::csv());
}

#[test]
fn a_journal_of_another_model_is_refused() {
    let folder = tank::folder();
    folder.ends("replay tank.yaml run.csv --journal j.jsonl", 0);
    folder.write("other.yaml", "shsa: 1\nvariables: { x: {} }\nsignals: { /x: { variable: x } }\n");
    folder.refuses("replay other.yaml j.jsonl", &["j.jsonl cannot be replayed", "'/level'"]);
}
