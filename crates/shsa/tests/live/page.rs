//! The live page: its files as they are served, its stream, and the page itself in Chromium.

use crate::broker::Broker;
use crate::real::{PATIENCE, Script, eventually, free_port, python};
use crate::running::{Folder, Running, TOKEN};
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

const ROVER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/models/rover.yaml");

/// Longer than all that is looked at in the browser takes on a busy machine.
const LOOKING: Duration = Duration::from_secs(600);

/// What is asked for, with these headers: the answer with its own.
fn get(run: &Running, path: &str, headers: &str) -> String {
    let mut stream = TcpStream::connect(run.address()).unwrap();
    let host = run.address();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{headers}\r\n").unwrap();
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// The parts of a stream, as they come.
struct Parts(std::io::Lines<BufReader<TcpStream>>);

impl Parts {
    fn of(run: &Running) -> Parts {
        let mut stream = TcpStream::connect(run.address()).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        write!(stream, "GET /changes HTTP/1.1\r\nHost: {}\r\n\r\n", run.address()).unwrap();
        Parts(BufReader::new(stream).lines())
    }

    /// The next part of this kind.
    #[track_caller]
    fn next(&mut self, kind: &str) -> Value {
        let mut lines = self.0.by_ref().map(Result::unwrap);
        assert!(lines.any(|line| line == format!("event: {kind}")), "no {kind}");
        let data = lines.next().unwrap();
        serde_json::from_str(data.strip_prefix("data: ").unwrap()).unwrap()
    }
}

#[test]
fn the_page_is_served_with_its_policy_and_kept_by_who_has_it() {
    let run = Running::start([]);
    for path in ["/", "/web/page.css", "/web/page.js", "/web/needs.js"] {
        let answer = get(&run, path, "");
        assert!(answer.starts_with("HTTP/1.1 200"), "{path}: {answer}");
        let header = |name: &str| {
            let line = answer.lines().find(|line| line.starts_with(&format!("{name}: ")));
            line.unwrap_or_else(|| panic!("{path}: no {name} in {answer}")).to_owned()
        };
        let policy = header("content-security-policy");
        assert!(policy.contains("default-src 'none'") && !policy.contains("unsafe"), "{policy}");
        let tag = header("etag").replace("etag: ", "If-None-Match: ");
        let again = get(&run, path, &format!("{tag}\r\n"));
        assert!(again.starts_with("HTTP/1.1 304") && again.ends_with("\r\n\r\n"), "{path}: {again}");
    }
    assert!(get(&run, "/web/nothing.js", "").starts_with("HTTP/1.1 404"));
}

#[test]
fn the_stream_tells_everything_once_and_then_what_changes() {
    let run = Running::start([]);
    run.until("the need is served", |state| {
        state["models"]["rover"]["needs"]["v_dmin"]["published"].as_u64() > Some(3)
    });
    let mut parts = Parts::of(&run);
    let first = parts.next("state");
    let rover = &first["models"]["rover"];
    assert_eq!(rover["needs"]["v_dmin"]["unit"], "m", "{rover}");
    assert!(rover["values"]["v_dmin"][0].as_f64() <= rover["values"]["v_dmin"][1].as_f64(), "{rover}");
    assert!(rover["signals"]["/lidar/scan"]["verdict"].is_string(), "{rover}");
    assert!(rover["ahead"]["v_dmin"][0]["words"].is_string(), "{rover}");
    let (mut time, mut survives) = (first["head"]["time_ns"].as_i64(), Value::Null);
    // It is known a while later.
    for _ in 0..100 {
        let change = parts.next("change");
        let later = change["head"]["time_ns"].as_i64();
        assert!(later > time, "{change}");
        time = later;
        let rover = &change["models"]["rover"];
        assert!(rover["ahead"].is_null() || !change["events"].as_array().unwrap().is_empty(), "{change}");
        let tolerance = &rover["tolerance"]["v_dmin"];
        if tolerance["known"] == true {
            survives = tolerance["survives"].clone();
            break;
        }
    }
    assert!(survives.as_u64() >= Some(1), "{survives}");
}

#[test]
fn vectors_of_signals_and_needs_are_streamed_as_profiles() {
    let folder = Folder::new();
    let model = folder.path("rover.yaml");
    let need = "\nneeds:\n  v_2D: { signal: /scan/healed, max_age: 5 s }";
    fs::write(&model, fs::read_to_string(ROVER).unwrap().replace("\nneeds:", need)).unwrap();
    let run = Running::start([model.to_str().unwrap()]);
    run.until("the need is served", |state| {
        state["models"]["rover"]["needs"]["v_2D"]["published"].as_u64() > Some(3)
    });
    let first = Parts::of(&run).next("state");
    let rover = &first["models"]["rover"];
    for (table, name, count, bins) in [
        ("signal_profiles", "/lidar/scan", 121, 121),
        ("signal_profiles", "/sonar/ranges", 12, 12),
        ("signal_profiles", "/depth/image", 480, 181),
        ("need_profiles", "v_2D", 121, 121),
    ] {
        let profile = &rover[table][name];
        assert_eq!((&profile["count"], &profile["known"]), (&json!(count), &json!(count)), "{name}: {rover}");
        assert_eq!(profile["bins"].as_array().unwrap().len(), bins, "{profile}");
        assert!(profile["min"][0].as_f64() < profile["max"][0].as_f64(), "{profile}");
    }
    assert_eq!(rover["signal_profiles"].as_object().unwrap().len(), 3, "{rover}");
}

#[test]
fn what_would_be_lost_is_reported_before_it_is() {
    let run = Running::start([]);
    run.until("a model is there", |state| state["models"]["rover"].is_object());
    Parts::of(&run).next("state");
    let (status, model) = run.get("/model?model=rover");
    assert_eq!((status, &model["needs"][0]["variable"]), (200, &json!("v_dmin")));
    let (status, needs) = run.get("/what-if?model=rover&lost=%5B%22/lidar/scan%22%5D");
    assert_eq!(status, 200, "{needs}");
    let need = &needs["v_dmin"];
    assert_eq!(need["whole"]["words"], "/lidar/scan by nearest");
    assert_eq!(need["now"]["words"], "/sonar/ranges by nearest");
    assert!(need["now"]["utility"].as_f64() < need["whole"]["utility"].as_f64(), "{need}");
    let further = need["further"].as_array().unwrap();
    let sonar = further.iter().find(|loss| loss["signal"] == "/sonar/ranges").unwrap();
    assert_eq!(sonar["then"]["words"], "/depth/image by row, nearest");
    assert_eq!(run.get("/what-if?model=rover&lost=%5B%22/none%22%5D").0, 422);
    assert_eq!(run.get("/what-if?model=rover&lost=none").0, 400);
    assert_eq!(run.get("/model?model=none").0, 404);
}

#[test]
fn an_accusation_has_its_evidence_and_the_page_leads_to_other_instances() {
    let run = Running::start(["--other-page", "truck=http://10.0.0.2:7410/"]);
    let silent = run.decision("silent");
    let (status, sections) = run.get(&format!("/evidence?number={}", silent["number"]));
    assert_eq!(status, 200, "{sections}");
    let sections = sections.as_array().unwrap();
    let titles: Vec<&str> = sections.iter().map(|section| section["title"].as_str().unwrap()).collect();
    assert!(
        titles.contains(&"In plain words") && titles.contains(&"What would have cleared it"),
        "{titles:?}"
    );
    let cleared = &sections.last().unwrap()["items"][0]["text"];
    assert_eq!(cleared, "Possible values of /lidar/scan, in time.");
    // A decision about a need accuses nobody.
    let substituted = run.decision("substituted");
    assert_eq!(run.get(&format!("/evidence?number={}", substituted["number"])), (200, Value::Null));
    let state = Parts::of(&run).next("state");
    assert_eq!(state["head"]["others"], json!([["truck", "http://10.0.0.2:7410/"]]));
    // A vector of a silent signal is not drawn.
    let profiles = state["models"]["rover"]["signal_profiles"].as_object().unwrap();
    assert_eq!(profiles.keys().collect::<Vec<_>>(), ["/depth/image", "/sonar/ranges"]);
    let ended = Running::ended(["--other-page", "truck=javascript:alert(1)"]);
    assert_eq!(ended.status.code(), Some(2), "{ended:?}");
}

#[test]
fn instances_on_one_bus_lead_to_each_other() {
    let broker = Broker::start(&[]);
    let bus = format!("mqtt://127.0.0.1:{}", broker.port());
    let start = |name: &str| Running::start([ROVER, "--bus", &bus, "--name", name]);
    let (one, other) = (start("one"), start("other"));
    let page = json!(["other", format!("http://{}/", other.address())]);
    let mut parts = Parts::of(&one);
    let mut wait_for = |what: &str, others: &Value| {
        eventually(what, || (parts.next("change")["head"]["others"] == *others).then_some(()));
    };
    wait_for("the other one comes", &json!([page]));
    assert!(other.stop().success());
    wait_for("the other one goes", &json!([]));
}

#[test]
fn a_need_under_contract_tells_its_level_or_what_it_lacks() {
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/stop.yaml");
    let run = Running::start([model, "--bus", "memory"]);
    run.until("a model is there", |state| state["models"]["stop"].is_object());
    let first = Parts::of(&run).next("state");
    // Nothing is heard on this bus.
    let assurance = &first["models"]["stop"]["needs"]["dmin"]["assurance"];
    assert_eq!((&assurance["level"], &assurance["verdict"]), (&Value::Null, &json!("open")), "{first}");
    assert!(assurance["lacking"][0].as_array().unwrap().contains(&json!("computer: spare")), "{first}");
    let (status, needs) = run.get("/what-if?model=stop&lost=%5B%22/lidar/nearest%22%5D");
    assert_eq!((status, &needs["dmin"]["now"]["level"]), (200, &json!("SIL 2")), "{needs}");
    let (_, needs) = run.get("/what-if?model=stop&lost=%5B%22/computer/idle%22%5D");
    assert_eq!(needs["dmin"]["now"]["refused"], true, "{needs}");
}

#[test]
fn who_does_not_read_holds_nobody_up() {
    let run = Running::start([]);
    let sleepers: Vec<Parts> = (0..5).map(|_| Parts::of(&run)).collect();
    let mut parts = Parts::of(&run);
    let mut times: Vec<i64> = vec![parts.next("state")["head"]["time_ns"].as_i64().unwrap()];
    times.extend((0..20).map(|_| parts.next("change")["head"]["time_ns"].as_i64().unwrap()));
    assert!(times.is_sorted());
    // A page that wakes up gets the rest of the last part, and then the present state.
    for mut sleeper in sleepers {
        let mut time = sleeper.next("state")["head"]["time_ns"].as_i64().unwrap();
        for _ in 0..1_000 {
            if time >= times[20] {
                break;
            }
            time = sleeper.next("change")["head"]["time_ns"].as_i64().unwrap();
        }
        assert!(time >= times[20]);
    }
}

#[test]
fn people_see_the_switch_and_order_with_the_token_only() {
    let Some(python) = python() else { return };
    if Command::new("chromium").arg("--version").output().is_err() {
        let _ = writeln!(std::io::stderr(), "SKIPPED: chromium is absent; `cargo xtask test` installs it");
        return;
    }
    let axe = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/npm/package/axe.min.js");
    assert!(axe.is_file(), "axe-core is absent: `cargo xtask test` fetches it");
    let address = format!("127.0.0.1:{}", free_port());
    let run = Running::start(["--http", &address]);
    let mut script =
        Script::start(&python, "page.py", &json!({ "address": address, "token": TOKEN, "axe": axe }));
    script.poll("restart", LOOKING).expect("it was as it should be until the restart");
    assert!(run.stop().success());
    // It shows that what it shows is old before there is something new.
    std::thread::sleep(Duration::from_secs(3));
    let _again = Running::start(["--http", &address]);
    script.order(&json!({ "restarted": true }));
    let seen = script.poll("seen", LOOKING).expect("it was as it should be");
    let _ = writeln!(std::io::stderr(), "the page: {}", seen["seen"]);
}
