//! The content of a wiring, and its errors.

use super::read::{RETRY, WITHIN};
use super::*;

const MODEL: &str = "
shsa: 1
variables: { speed: { unit: m/s }, place: { unit: m } }
signals:
  left:  { variable: speed }
  right: { variable: speed }
  where: { variable: place }
needs:
  speed: { signal: /car/speed, max_age: 1 s }
";

fn read(text: &str) -> Result<Wiring, Report> {
    let loaded = shsa_model::load(MODEL, "model.yaml");
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    Wiring::read(text, "wiring.yaml", &[&loaded.knowledge])
}

fn action(text: &str) -> Action {
    let wiring = read(&format!("wiring: {{ speed: {{ silence: {text} }} }}"));
    let wiring = wiring.unwrap_or_else(|report| panic!("{}", report.render(false)));
    wiring.of("speed", "").unwrap().takeover.clone().unwrap().silence
}

/// The first problem: where, what, and the help.
#[track_caller]
fn check_wrong(text: &str, expected: &str) {
    let report = read(text).unwrap_err();
    let first = &report.diagnostics[0];
    let help = first.help.clone().unwrap_or_default();
    let found = format!("{}:{} {}; {help}", first.line, first.column, first.message);
    assert!(found.starts_with(expected), "{found}");
}

#[test]
fn a_need_is_wired_by_its_variable_or_its_name() {
    let text = "
wiring:
  /car/speed:
    form: like
    takeover: right
    silence: { command: [systemctl, stop, 'wheel driver'], within: 2 s }
    restore: { publish: { topic: on, payload: 1 } }
    check: 500 ms
    probe: 10 min
";
    let wiring = read(text).unwrap();
    let need = wiring.of("speed", "/car/speed").unwrap();
    assert_eq!(need.form, Some(Form::Like));
    let takeover = need.takeover.clone().unwrap();
    let words = ["systemctl", "stop", "wheel driver"].map(String::from).into();
    let silence = Action { kind: ActionKind::Command(words), within: Span::from_millis(2_000) };
    let restore =
        Action { kind: ActionKind::Publish { topic: "on".into(), payload: "1".into() }, within: WITHIN };
    let expected = Takeover {
        signal: Some("right".into()),
        silence,
        restore: Some(restore),
        check: Some(Span::from_millis(500)),
        retry: RETRY,
        probe: Some(Span::from_millis(600_000)),
    };
    assert_eq!(takeover, expected);
    assert_eq!(read("").unwrap(), Wiring::default());
    assert!(read("wiring: { speed: { form: plain } }").unwrap().needs[0].takeover.is_none());
}

#[test]
fn payloads_are_texts_or_json() {
    let payload = |text: &str| match action(text).kind {
        ActionKind::Request { payload, .. } | ActionKind::Publish { payload, .. } => payload,
        other => panic!("{other:?}"),
    };
    assert_eq!(payload("{ request: { to: a, payload: off } }"), "off");
    assert_eq!(payload("{ request: { to: a } }"), "");
    let nested = "{ publish: { topic: a, payload: { commands: [{ do: it, times: 2, now: true }] } } }";
    assert_eq!(payload(nested), r#"{"commands":[{"do":"it","times":2,"now":true}]}"#);
}

#[test]
fn services_and_clients_are_named() {
    let service = |name: &str, call| ActionKind::Service { name: name.into(), call };
    let set = "{ service: { name: /wheel/enable, type: std_srvs/srv/SetBool, data: false } }";
    assert_eq!(action(set).kind, service("/wheel/enable", Call::SetBool(false)));
    let change =
        "{ service: { name: /w/change_state, type: lifecycle_msgs/srv/ChangeState, data: deactivate } }";
    assert_eq!(action(change).kind, service("/w/change_state", Call::ChangeState(4)));
    let client = |enabled| ActionKind::DynamicSecurity { client: "w".into(), enabled };
    assert_eq!(action("{ dynamic_security: { client: w } }").kind, client(false));
    let wiring = read("wiring: { speed: { silence: { dynamic_security: { client: w } } } }").unwrap();
    let takeover = wiring.needs[0].takeover.clone().unwrap();
    assert_eq!(takeover.restore.unwrap().kind, client(true));
}

#[test]
fn what_is_wrong_has_a_place_and_help() {
    let silence = |text: &str| format!("wiring:\n  speed:\n    silence: {text}");
    for (text, expected) in [
        ("wirings: {}", "1:1 unknown key `wirings`; did you mean `wiring`?"),
        ("wiring:\n  sped: { form: json }", "2:3 there is no need `sped`; did you mean `speed`?"),
        ("wiring:\n  speed: { form: jsn }", "2:18 there is no form `jsn`; write plain"),
        ("wiring:\n  speed: { shape: json }", "2:12 unknown key `shape`"),
        ("wiring:\n  speed: { takeover: left }", "2:3 `speed` does not say how the source is silenced"),
        (
            "wiring:\n  speed: { takeover: where, silence: { command: [a] } }",
            "2:22 `where` is no signal of the needed variable; its signals are: left, right",
        ),
        (
            "wiring:\n  speed: { probe: 1 min, silence: { command: [a] } }",
            "2:3 `speed` has `probe`, and no action",
        ),
        (&silence("{ command: systemctl stop it }"), "3:25 a program and its arguments are expected"),
        (&silence("{ command: [] }"), "3:25 the program is missing"),
        (&silence("{ command: [a], publish: { topic: b } }"), "3:14 an action is one thing, found 2"),
        (&silence("{}"), "3:14 an action is one thing, found 0"),
        (&silence("{ command: [a], within: soon }"), "3:38 "),
        (&silence("{ command: [a], within: 1 h }"), "3:14 an action takes at most 5 min"),
        (&silence("{ request: { payload: 1 } }"), "3:25 `to` is missing"),
        (&silence("{ service: { name: /a, type: b/srv/C } }"), "3:25 `b/srv/C` cannot be called"),
        (&silence("{ dynamic_security: { client: a, user: a } }"), "3:47 unknown key `user`"),
    ] {
        check_wrong(text, expected);
    }
}
