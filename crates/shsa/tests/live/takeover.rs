//! A failed sensor is silenced and its name taken over, on real buses; sensors and consumers are independent of `shsa`.

mod secured;

use crate::broker::Broker;
use crate::car::router;
use crate::real::{self, Script};
use crate::running::{Folder, Running, TOKEN};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// Three witnesses of one speed, each under its own name.
const MODEL: &str = "
shsa: 1
variables: { speed: { unit: m/s, range: [-100, 100] } }
signals:
  wheel: { variable: speed, source: WHEEL, rate: 20 Hz, value_error: 0.3, timeout: 1500 ms, properties: { accuracy: 0.95 } }
  radar: { variable: speed, source: RADAR, rate: 20 Hz, value_error: 0.3, timeout: 1500 ms, properties: { accuracy: 0.9 } }
  optic: { variable: speed, source: OPTIC, rate: 20 Hz, value_error: 0.3, timeout: 1500 ms, properties: { accuracy: 0.8 } }
needs:
  speed: { signal: /healed/speed, max_age: 1 s }
";
/// The wheel's message, with other fields beside its value.
const WHEEL: &str = r#"{"unit": "front left", "speed": VALUE}"#;
const NAME: &str = "robot/wheel";

/// The sensors on a bus, and the files for `shsa`.
struct Scene {
    folder: Folder,
    bus: &'static str,
    python: PathBuf,
    port: u16,
    wheel: Script,
    _others: Vec<Script>,
}

impl Scene {
    /// Starts the sensors; `wheel` holds settings for the wheel only.
    fn new(python: &Path, bus: &'static str, port: u16, wheel: &Value) -> Scene {
        let sensor = |name: &str, more: &Value| {
            let text = if name == "wheel" { WHEEL } else { "VALUE" };
            let topic = format!("robot/{name}");
            let mut order = json!({
                "bus": bus, "port": port, "name": name, "topic": topic, "text": text, "period": 0.05,
            });
            order.as_object_mut().unwrap().extend(more.as_object().cloned().unwrap_or_default());
            Script::start(python, "sensor.py", &order)
        };
        let mut of_others = wheel.clone();
        of_others.as_object_mut().unwrap().remove("obeys");
        if of_others.get("user").is_some() {
            of_others["user"] = json!("others");
        }
        let others = ["radar", "optic"].map(|name| sensor(name, &of_others)).into();
        let folder = Folder::new();
        let field = if bus == "ros2" { "#twist.linear.x" } else { "" };
        let wheel_field = if bus == "ros2" { field } else { "#speed" };
        let model = MODEL.replace("WHEEL", &format!("{NAME}{wheel_field}"));
        let model = model.replace("RADAR", &format!("robot/radar{field}"));
        let model = model.replace("OPTIC", &format!("robot/optic{field}"));
        fs::write(folder.path("model.yaml"), model).unwrap();
        Scene { folder, bus, python: python.into(), port, wheel: sensor("wheel", wheel), _others: others }
    }

    /// Starts `shsa` with this wiring, and waits until the wheel serves the need.
    fn run(&self, wiring: &str, more: &[&str]) -> Running {
        let path = |name: &str| self.folder.path(name).display().to_string();
        fs::write(self.folder.path("wiring.yaml"), format!("wiring: {{ speed: {{ {wiring} }} }}")).unwrap();
        let (model, wiring) = (path("model.yaml"), path("wiring.yaml"));
        let address = format!("{}://127.0.0.1:{}", self.bus, self.port);
        let bus = ["--bus", address.as_str()];
        // A `--bus` in `more` replaces the scene's bus.
        let bus: &[&str] = if more.contains(&"--bus") { &[] } else { &bus };
        let run = Running::start([&[model.as_str(), "--wiring", wiring.as_str()], bus, more].concat());
        run.until("all have come", |state| {
            let signals = &state["models"]["model"]["signals"];
            ["wheel", "radar", "optic"].iter().all(|name| signals[*name]["accepted"].as_u64() > Some(10))
        });
        run
    }

    /// From now on, the wheel's value is wrong.
    fn lie(&mut self) {
        self.wheel.order(&json!({ "value": 13.0 }));
    }

    fn wheel_pid(&mut self) -> String {
        self.wheel.answer(&json!({ "who": true }), "pid")["pid"].to_string()
    }

    /// A consumer of the wheel's name.
    fn consumer(&self, user: Option<&str>) -> Script {
        let path = |name: &str| format!("../../../shsa-bridge/tests/python/{name}");
        if self.bus == "mqtt" {
            let mut argument = json!({ "port": self.port, "name": "consumer" });
            if let Some(user) = user {
                argument["user"] = json!(user);
                argument["password"] = json!(secured::PASSWORD);
            }
            let mut script = Script::start(&self.python, &path("mqtt_client.py"), &argument);
            script.order(&json!({ "subscribe": NAME, "qos": 0 }));
            return script;
        }
        let endpoint = format!("tcp/127.0.0.1:{}", self.port);
        let config =
            json!({ "mode": "client", "scouting/multicast/enabled": false, "connect/endpoints": [endpoint] });
        if self.bus == "zenoh" {
            let mut script = Script::start(&self.python, &path("zenoh_client.py"), &config);
            script.order(&json!({ "subscribe": NAME }));
            return script;
        }
        let argument = json!({ "zenoh": config, "domain": 0 });
        Script::start(&self.python, &path("ros2_node.py"), &argument)
    }
}

/// The state of the takeover.
fn takeover(state: &Value) -> &Value {
    &state["models"]["model"]["needs"]["speed"]["takeover"]
}

fn text(hex: &Value) -> String {
    let hex = hex.as_str().unwrap();
    let byte = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
    String::from_utf8((0..hex.len()).step_by(2).map(byte).collect()).unwrap()
}

/// Quality and content of a message over MQTT or Zenoh; the source's own messages have no quality.
fn read(message: &Value) -> (String, String) {
    let quality = match message.get("properties") {
        Some(properties) => properties["quality"].as_str().unwrap_or_default().to_owned(),
        None if message["attachment"].is_string() => {
            let beside: Value = serde_json::from_str(&text(&message["attachment"])).unwrap();
            beside["quality"].as_str().unwrap_or_default().to_owned()
        }
        None => String::new(),
    };
    (quality, text(&message["hex"]))
}

/// Waits for a message that meets a condition; earlier ones are passed to `before`.
#[track_caller]
fn wait_for(
    consumer: &mut Script,
    what: &str,
    is_it: impl Fn(&str, &str) -> bool,
    mut before: impl FnMut(&str, &str),
) -> (String, String) {
    let end = Instant::now() + real::PATIENCE;
    while Instant::now() < end {
        let Some(message) = consumer.poll("hex", Duration::from_secs(5)) else { continue };
        let (quality, text) = read(&message);
        if is_it(&quality, &text) {
            return (quality, text);
        }
        before(&quality, &text);
    }
    panic!("never came: {what}");
}

const SUBSTITUTE: &str = "UncertainSubstituteValue";

/// Checks that a consumer of the wheel's name gets the substitute in the wheel's own form, without messages of the wheel in
/// between.
#[track_caller]
fn check_taken(consumer: &mut Script) {
    let (_, text) = wait_for(consumer, "a substitute", |quality, _| quality == SUBSTITUTE, |_, _| {});
    let content: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(content["unit"], "front left", "{text}");
    assert!((content["speed"].as_f64().unwrap() - 10.0).abs() < 0.5, "{text}");
    for _ in 0..10 {
        let message = consumer.poll("hex", real::PATIENCE).unwrap();
        assert_eq!(read(&message).0, SUBSTITUTE, "there are two publishers: {message}");
    }
}

#[test]
fn who_is_stopped_by_a_command_is_replaced_and_left_alone_when_it_comes_back() {
    let Some(python) = real::python() else { return };
    let broker = Broker::start(&[]);
    let mut scene = Scene::new(&python, "mqtt", broker.port(), &json!({}));
    let pid = scene.wheel_pid();
    let wiring = format!(
        "silence: {{ command: [kill, -STOP, '{pid}'] }}, restore: {{ command: [kill, -CONT, '{pid}'] }}"
    );
    let state = scene.folder.path("state").display().to_string();
    let run = scene.run(&wiring, &["--state", &state]);
    let mut consumer = scene.consumer(None);
    assert_eq!(run.get("/health").0, 200);

    scene.lie();
    run.decision("failed");
    run.decision("substituted");
    let silenced = run.decision("silenced");
    assert!(silenced["because"].as_str().unwrap().contains("by the command kill"), "{silenced}");
    check_taken(&mut consumer);
    let taken = run.until("the state tells", |state| takeover(state)["stage"] == "taken");
    assert_eq!(takeover(&taken)["quality"], SUBSTITUTE);
    assert_eq!(takeover(&taken)["silenced_by"], "the command kill");
    let (_, metrics) = run.get("/metrics");
    let line = r#"shsa_takeover_events_total{model="model",name="robot/wheel",kind="silenced"} 1"#;
    assert!(metrics.as_str().unwrap().contains(line), "{metrics}");

    // A restarted instance continues the takeover, although the silenced wheel no longer shows the form of its messages.
    run.kill();
    let path = |name: &str| scene.folder.path(name).display().to_string();
    let address = format!("mqtt://127.0.0.1:{}", broker.port());
    let (model, wiring) = (path("model.yaml"), path("wiring.yaml"));
    let run = Running::start([model.as_str(), "--wiring", &wiring, "--bus", &address, "--state", &state]);
    run.decision("silenced");
    check_taken(&mut consumer);

    // The wheel comes back by itself, and is the only publisher at once.
    scene.wheel.signal("CONT");
    run.decision("returned");
    while consumer.poll("hex", Duration::from_millis(1)).is_some() {}
    for _ in 0..20 {
        let message = consumer.poll("hex", real::PATIENCE).unwrap();
        assert_eq!(read(&message).0, "", "there are two publishers: {message}");
    }
    run.until("it waits", |state| takeover(state)["stage"] == "waiting");
}

#[test]
fn who_does_not_obey_is_not_replaced_and_it_is_reported() {
    let Some(python) = real::python() else { return };
    let broker = Broker::start(&[]);
    let mut scene = Scene::new(&python, "mqtt", broker.port(), &json!({}));
    let run = scene.run("silence: { command: ['true'] }, retry: 2 s", &[]);
    let mut consumer = scene.consumer(None);
    scene.lie();
    let refused = run.decision("refused");
    let because = refused["because"].as_str().unwrap();
    assert!(because.contains("it goes on after the command true"), "{because}");
    let state = run.until("the state tells", |state| takeover(state)["stage"] == "waiting");
    assert_eq!(takeover(&state)["quality"], "Bad", "{state}");
    let (status, health) = run.get("/health");
    assert_eq!((status, &health["needs"][NAME]), (503, &json!("Bad")), "{health}");
    // The takeover is tried again, and no message of ours was in between.
    run.decision("refused");
    while let Some(message) = consumer.poll("hex", Duration::from_millis(1)) {
        assert_eq!(read(&message).0, "", "{message}");
    }
}

#[test]
fn over_mqtt_3_there_is_no_takeover() {
    let Some(python) = real::python() else { return };
    let broker = Broker::start(&[]);
    let scene = Scene::new(&python, "mqtt", broker.port(), &json!({}));
    let path = |name: &str| scene.folder.path(name).display().to_string();
    fs::write(scene.folder.path("wiring.yaml"), "wiring: { speed: { silence: { command: ['true'] } } }")
        .unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_shsa"))
        .args(["run", &path("model.yaml"), "--wiring", &path("wiring.yaml"), "--http", "off", "--bus"])
        .arg(format!("mqtt://127.0.0.1:{}?version=3.1.1", broker.port()))
        .output()
        .unwrap();
    let reported = String::from_utf8_lossy(&run.stderr);
    assert!(!run.status.success() && reported.contains("a takeover needs MQTT 5"), "{reported}");
}

#[test]
fn who_answers_a_request_over_zenoh_is_replaced() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    let mut scene = Scene::new(&python, "zenoh", port, &json!({ "obeys": "robot/wheel/control" }));
    let request = |word: &str| format!("request: {{ to: robot/wheel/control, payload: {word}, expect: ok }}");
    let wiring = format!("silence: {{ {} }}, restore: {{ {} }}", request("silence"), request("publish"));
    let run = scene.run(&wiring, &[]);
    let mut consumer = scene.consumer(None);
    scene.lie();
    let silenced = run.decision("silenced");
    assert!(silenced["because"].as_str().unwrap().contains("a request to robot/wheel/control"), "{silenced}");
    check_taken(&mut consumer);
    scene.wheel.order(&json!({ "value": 10.1 }));
    assert_eq!(run.order(Some(TOKEN), r#"{"order": "clear", "signal": "wheel"}"#).0, 200);
    run.decision("returned");
    run.until("it is trusted again", |state| takeover(state)["stage"] == "watching");
}

#[test]
fn another_instance_goes_on_when_the_one_that_has_silenced_is_gone() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    let mut scene = Scene::new(&python, "zenoh", port, &json!({ "obeys": "robot/wheel/control" }));
    let wiring = "silence: { request: { to: robot/wheel/control, payload: silence, expect: ok } }";
    let mut runs: Vec<(&str, Running)> =
        ["a", "b"].map(|name| (name, scene.run(wiring, &["--name", name]))).into();
    let mut consumer = scene.consumer(None);
    let state = runs[0].1.until("both can serve", |state| {
        state["instances"]["/healed/speed"].as_array().is_some_and(|able| able.len() == 2)
    });
    let first = state["instances"]["/healed/speed"][0].as_str().unwrap().to_owned();
    scene.lie();
    let at = runs.iter().position(|(name, _)| first.starts_with(name)).unwrap();
    let (_, responsible) = runs.remove(at);
    let (_, other) = runs.remove(0);
    responsible.decision("silenced");
    check_taken(&mut consumer);
    assert_eq!(takeover(&other.get("/state").1)["silenced"], 0, "it leaves that to the other one");
    // The other instance's publications under the wheel's name are no sign of the wheel.
    let (_, state) = other.get("/state");
    assert_ne!(state["models"]["model"]["signals"]["wheel"]["verdict"], "healthy", "{state}");
    responsible.kill();
    other.decision("silenced");
    check_taken(&mut consumer);
}

#[test]
fn a_request_that_nobody_answers_is_refused() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    let mut scene = Scene::new(&python, "zenoh", port, &json!({}));
    let run = scene.run("silence: { request: { to: robot/nobody, payload: a }, within: 1 s }", &[]);
    scene.lie();
    let refused = run.decision("refused");
    assert!(
        refused["because"].as_str().unwrap().contains("nobody answers under `robot/nobody`"),
        "{refused}"
    );
}

#[test]
fn a_node_of_ros_2_that_is_switched_off_is_replaced_by_messages_of_its_type() {
    let Some(python) = real::python() else { return };
    let (_router, port) = router(&python);
    let mut scene = Scene::new(&python, "ros2", port, &json!({ "obeys": "/robot/wheel/enable" }));
    let call = |data: bool| {
        format!("service: {{ name: /robot/wheel/enable, type: std_srvs/srv/SetBool, data: {data} }}")
    };
    let wiring = format!("form: like, silence: {{ {} }}, restore: {{ {} }}", call(false), call(true));
    let run = scene.run(&wiring, &[]);
    let mut consumer = scene.consumer(None);
    // The gate's messages have the form of the wheel's, too.
    let gate = json!({ "subscribe": "/healed/speed", "type": "geometry_msgs/msg/TwistStamped", "get": "twist.linear.y" });
    consumer.order(&gate);
    let received = consumer.next_with("heard");
    assert_eq!((&received["heard"], &received["value"]), (&json!("/healed/speed"), &json!(0.25)));
    let order =
        |path: &str| json!({ "subscribe": NAME, "type": "geometry_msgs/msg/TwistStamped", "get": path });
    scene.lie();
    let silenced = run.decision("silenced");
    assert!(silenced["because"].as_str().unwrap().contains("the service /robot/wheel/enable"), "{silenced}");
    for (path, expected) in [("header.frame_id", json!("front axle")), ("twist.linear.y", json!(0.25))] {
        consumer.order(&order(path));
        let received = real::eventually("a message like the wheel's", || {
            let received = consumer.poll("heard", Duration::from_secs(1))?;
            (received["heard"] == NAME && received["value"] == expected).then_some(received)
        });
        assert!(received["header"].as_i64() > Some(1_000_000_000), "{received}");
    }
    // The tools of ROS show the need, and the wheel behind it.
    let all = "diagnostic_msgs/msg/DiagnosticArray";
    consumer.order(&json!({ "subscribe": "/diagnostics", "type": all, "get": "status.0.message" }));
    real::eventually("the state of the need", || {
        let received = consumer.poll("heard", Duration::from_secs(1))?;
        received["value"].as_str().filter(|state| state.starts_with("substituted by ")).map(drop)
    });
    consumer.order(&order("twist.linear.x"));
    let speed = real::eventually("a speed", || {
        let received =
            consumer.poll("heard", Duration::from_secs(1)).filter(|received| received["heard"] == NAME);
        received?["value"].as_f64().filter(|speed| *speed > 1.0)
    });
    assert!((speed - 10.0).abs() < 0.5, "{speed}");
    scene.wheel.order(&json!({ "value": 10.1 }));
    assert_eq!(run.order(Some(TOKEN), r#"{"order": "clear", "signal": "wheel"}"#).0, 200);
    run.decision("returned");
    run.until("it is trusted again", |state| takeover(state)["stage"] == "watching");
}
