//! The knowledge of one instance serves a need of another one while both are present.

use crate::car::{client_of, router};
use crate::real::{self, Script};
use crate::running::{Folder, Running};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

/// A model with the need and one wheel.
const FRONT: &str = "
shsa: 1
variables:
  speed: { unit: m/s, range: [-10, 90] }
signals:
  wheel: { variable: speed, source: wheel#v, unit: m/s, rate: 20 Hz, value_error: 0.5, timeout: 400 ms }
needs:
  speed: { signal: /car/speed, max_age: 1 s, max_width: 5 m/s }
";

/// A model with the receiver, and the relation from its value to the speed.
const REAR: &str = "
shsa: 1
variables:
  speed: { unit: m/s, range: [-10, 90] }
  ground: { unit: km/h }
relations:
  on_ground: { equation: speed = ground, error: 0.2 m/s }
signals:
  gnss: { variable: ground, source: gnss#v, unit: km/h, rate: 20 Hz, value_error: 1, timeout: 900 ms }
";

/// A model that contradicts the others about the wheel.
const LIAR: &str = "
shsa: 1
variables:
  speed: { unit: m/s }
signals:
  wheel: { variable: speed, source: other#v, unit: m/s, rate: 1 Hz }
";

/// A client that publishes both values 20 times a second until it is ended.
fn drive(python: &Path, port: u16, wheel: &'static AtomicBool, is_over: &'static AtomicBool) {
    let mut client =
        Script::start(python, "../../../shsa-bridge/tests/python/zenoh_client.py", &client_of(port));
    for step in 0..3_000 {
        if is_over.load(Ordering::Acquire) {
            return;
        }
        let speed = 10.0 + f64::from(step % 7) * 0.01;
        if wheel.load(Ordering::Acquire) {
            client.order(&json!({ "put": "wheel", "text": json!({ "v": speed }).to_string() }));
        }
        client.order(&json!({ "put": "gnss", "text": json!({ "v": speed * 3.6 }).to_string() }));
        thread::sleep(Duration::from_millis(45));
    }
}

fn need(state: &Value) -> (String, String) {
    let need = &state["models"]["front"]["needs"]["speed"];
    let text = |key: &str| need[key].as_str().unwrap_or_default().to_owned();
    (text("quality"), text("source"))
}

#[test]
fn a_need_is_served_from_what_another_instance_knows_while_that_is_there() {
    static WHEEL: AtomicBool = AtomicBool::new(true);
    static IS_OVER: AtomicBool = AtomicBool::new(false);
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    let (folder, address) = (Folder::new(), format!("zenoh://127.0.0.1:{port}"));
    let start = |name: &str, model: &str, further: &[&str]| {
        let path = folder.path(&format!("{name}.yaml"));
        fs::write(&path, model).unwrap();
        let all = [&[path.to_str().unwrap(), "--bus", &address, "--name", name], further].concat();
        Running::start(all)
    };
    let front = start("front", FRONT, &["--join"]);
    let alone = start("alone", FRONT, &[]);
    let driver = thread::spawn(move || drive(&python, port, &WHEEL, &IS_OVER));
    front.until("the wheel serves the speed", |state| need(state).0 == "Good");
    let rear = start("rear", REAR, &["--join"]);

    let joined = front.decision("joined");
    let because = joined["because"].as_str().unwrap();
    assert!(
        because.starts_with("signal gnss, relation on_ground, variable ground is known from rear."),
        "{because}"
    );
    let liar = start("liar", LIAR, &["--join"]);
    let refused = front.decision("refused");
    assert!(
        refused["because"].as_str().unwrap().contains("describe signal `wheel` differently"),
        "{refused}"
    );
    liar.kill();
    let state = front.until("the receiver is heard", |state| {
        state["models"]["front"]["signals"]["gnss"]["accepted"].as_u64() > Some(10)
    });
    assert_eq!(need(&state).0, "Good", "{state}");
    assert_eq!(state["parts"].as_object().unwrap().len(), 1, "{state}");

    WHEEL.store(false, Ordering::Release);
    assert_eq!(front.decision("substituted")["substitution"], "gnss by on_ground");
    front.until("the receiver serves the speed", |state| {
        need(state) == ("UncertainSubstituteValue".into(), "gnss by on_ground".into())
    });
    let (_, state) = alone.get("/state");
    assert!(state["parts"].is_null() && state["models"]["alone"]["signals"]["gnss"].is_null(), "{state}");

    rear.kill();
    let parted = front.decision("parted");
    assert!(parted["because"].as_str().unwrap().contains("signal gnss"), "{parted}");
    let state = front.until("nothing serves the speed", |state| need(state).0 == "Bad");
    assert!(state["models"]["front"]["signals"]["gnss"].is_null(), "{state}");

    // The instance comes back, and its knowledge is joined again.
    let _rear = start("rear", REAR, &["--join"]);
    front.decision("joined");
    front.until("the receiver serves the speed again", |state| need(state).0 == "UncertainSubstituteValue");
    IS_OVER.store(true, Ordering::Release);
    driver.join().unwrap();
}

#[test]
fn joining_is_refused_where_the_bus_does_not_tell_who_is_there() {
    for bus in ["memory", "mqtt://127.0.0.1:9"] {
        let run = Command::new(env!("CARGO_BIN_EXE_shsa"))
            .args(["run", "--http", "off", "--for", "1 s", "--join", "--bus", bus])
            .output()
            .unwrap();
        let stated = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && stated.contains("--join is not possible on this bus"), "{stated}");
        assert!(stated.contains("zenoh://") && stated.contains("shsa model join"), "{stated}");
    }
}
