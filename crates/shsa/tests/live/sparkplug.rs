//! A plant that speaks Sparkplug B: edge nodes and a consumer in Python that know nothing of `shsa`, with Mosquitto between them.

use crate::broker::Broker;
use crate::real::{self, Script};
use crate::running::{Folder, Running};
use serde_json::{Value, json};

/// Three witnesses of one speed: two devices and an edge node itself.
const MODEL: &str = "
shsa: 1
variables: { speed: { unit: rpm, range: [-5000, 5000] } }
signals:
  drive: { variable: speed, source: Plant/Press/Drive#Motor/Speed, rate: 20 Hz, value_error: 2, timeout: 10 s, properties: { accuracy: 0.95 } }
  shaft: { variable: speed, source: Plant/Gauges#Shaft, rate: 20 Hz, value_error: 2, timeout: 10 s, properties: { accuracy: 0.9 } }
  belt: { variable: speed, source: Plant/Gauges/Belt#rpm, rate: 20 Hz, value_error: 2, timeout: 10 s, properties: { accuracy: 0.8 } }
needs:
  speed: { signal: /Press/Speed, max_age: 10 s, probation: 500 ms, hold: 0 s }
";
/// Two of the witnesses, so that nobody can tell which one is wrong.
const PAIR: &str = "
shsa: 1
variables: { speed: { unit: rpm, range: [-5000, 5000] } }
signals:
  shaft: { variable: speed, source: Plant/Gauges#Shaft, rate: 20 Hz, value_error: 2, timeout: 10 s }
  belt: { variable: speed, source: Plant/Gauges/Belt#rpm, rate: 20 Hz, value_error: 2, timeout: 10 s }
needs:
  speed: { signal: /Press/Speed, max_age: 10 s, max_width: 100 rpm, hold: 0 s }
";
/// The edge node, the device and the metric of each signal.
const SIGNALS: [(&str, Option<&str>, &str); 3] =
    [("Press", Some("Drive"), "Motor/Speed"), ("Gauges", None, "Shaft"), ("Gauges", Some("Belt"), "rpm")];
const TRUTH: f64 = 1000.0;
const LIE: f64 = 1300.0;
const DATA: &str = "spBv1.0/Plant/NDATA/healer";

/// The plant with its consumer, and the files for `shsa`.
struct Plant {
    script: Script,
    broker: Broker,
    folder: Folder,
}

/// A value of the need as the consumer sees it.
#[derive(Debug)]
struct Seen {
    value: f64,
    timestamp: u64,
    status: String,
    quality: i64,
    /// Where the truth is.
    bounds: Option<(f64, f64)>,
}

impl Plant {
    fn new() -> Option<Plant> {
        let python = real::python()?;
        let broker = Broker::start(&[]);
        let script = "../../../shsa-bridge/tests/python/sparkplug.py";
        let mut script = Script::start(&python, script, &json!({ "port": broker.port() }));
        script.order(&json!({ "follow": "spBv1.0/Plant/+/healer/#" }));
        let folder = Folder::new();
        std::fs::write(folder.path("model.yaml"), MODEL).unwrap();
        let mut plant = Plant { script, broker, folder };
        ["Press", "Gauges"].iter().for_each(|node| plant.connect(node, 0));
        Some(plant)
    }

    /// Connects an edge node, which sends its births and then its values, and answers requests for births.
    fn connect(&mut self, node: &str, bd_seq: u64) {
        let name = format!("Plant/{node}");
        self.script.order(&json!({ "connect": name, "bd_seq": bd_seq, "answers": true }));
        let metric = |name: &str| json!({ "name": name, "type": "Double", "value": TRUTH });
        let own = || SIGNALS.iter().filter(|(of, ..)| *of == node);
        let of_node: Vec<Value> = own().filter(|it| it.1.is_none()).map(|it| metric(it.2)).collect();
        self.script.order(&json!({ "birth": of_node, "node": name }));
        for (_, device, metric_name) in own() {
            if device.is_some() {
                self.script.order(&json!({ "birth": [metric(metric_name)], "node": name, "device": device }));
            }
            let order =
                json!({ "play": metric(metric_name), "node": name, "device": device, "period": 0.05 });
            self.script.order(&order);
        }
    }

    fn set(&mut self, name: &str, value: f64) {
        self.script.order(&json!({ "set": name, "value": value }));
    }

    fn run(&self) -> Running {
        let model = self.folder.path("model.yaml").display().to_string();
        let bus = format!("sparkplug://127.0.0.1:{}/Plant/healer", self.broker.port());
        Running::start([model.as_str(), "--bus", bus.as_str()])
    }

    /// The values of the need up to the next one of this status. At most the first lie is one of them, where the witnesses are late on a
    /// busy machine.
    #[track_caller]
    fn until(&mut self, status: &str) -> Vec<Seen> {
        let mut seen = Vec::new();
        loop {
            let message = self.script.next_with("topic");
            if message["topic"] == DATA {
                for metric in message["payload"]["metrics"].as_array().unwrap() {
                    assert_eq!(metric["name"], "Press/Speed");
                    let property = |name: &str| &metric["properties"][name]["value"];
                    seen.push(Seen {
                        value: metric["value"].as_f64().unwrap(),
                        timestamp: metric["timestamp"].as_u64().unwrap(),
                        status: property("status").as_str().unwrap().to_owned(),
                        quality: property("Quality").as_i64().unwrap(),
                        bounds: property("lo").as_f64().zip(property("hi").as_f64()),
                    });
                }
            }
            let is_lie = |it: &&Seen| (it.value - TRUTH).abs() >= 50.0;
            assert!(seen.iter().filter(is_lie).count() < 2, "lies: {seen:?}");
            if seen.last().is_some_and(|last| last.status == status) {
                return seen;
            }
        }
    }

    /// The next message of our edge node of this kind.
    #[track_caller]
    fn of_node(&mut self, kind: &str) -> Value {
        let topic = format!("spBv1.0/Plant/{kind}/healer");
        loop {
            let message = self.script.next_with("topic");
            if message["topic"] == *topic {
                return message["payload"].clone();
            }
        }
    }
}

const SUBSTITUTE: &str = "UncertainSubstituteValue";

#[test]
fn a_source_lies_and_the_substitute_arrives_with_its_quality() {
    let Some(mut plant) = Plant::new() else { return };
    let run = plant.run();
    run.until("all have come", |state| {
        let signals = &state["models"]["model"]["signals"];
        ["drive", "shaft", "belt"].iter().all(|name| signals[*name]["accepted"].as_u64() > Some(10))
    });
    let mut seen = plant.until("Good");
    plant.set("Motor/Speed", LIE);
    seen.extend(plant.until(SUBSTITUTE));
    assert_eq!(run.decision("failed")["signal"], "drive");
    let [.., last, first] = &seen[..] else { panic!("{seen:?}") };
    assert_eq!((last.status.as_str(), first.quality), ("Good", 192));
    // The gap, counted in values of the plant.
    let times = plant.script.answer(&json!({ "sent": "Shaft" }), "times");
    let times = times["times"].as_array().unwrap().iter().filter_map(Value::as_u64);
    let gap = times.filter(|at| (last.timestamp + 1..first.timestamp).contains(at)).count();
    assert!(gap <= 3, "{gap} values of the shaft, and none of the need");
    plant.set("Motor/Speed", TRUTH);
    plant.until("Good");
    assert!(run.stop().success());
}

#[test]
fn of_an_uncertain_value_the_bounds_arrive() {
    let Some(mut plant) = Plant::new() else { return };
    std::fs::write(plant.folder.path("model.yaml"), PAIR).unwrap();
    let run = plant.run();
    plant.until("Good");
    plant.set("rpm", TRUTH + 40.0);
    let seen = plant.until("UncertainSubNormal");
    let last = seen.last().unwrap();
    let (lo, hi) = last.bounds.unwrap();
    // What is played alternates between its value and one more.
    let is_about = |bound: f64, least: f64| (least - 0.1..least + 1.1).contains(&bound);
    let are_right = is_about(lo, TRUTH - 2.0) && is_about(hi, TRUTH + 42.0);
    assert!(last.quality == 0 && are_right, "{last:?}");
    assert!(run.stop().success());
}

#[test]
fn an_edge_node_dies_and_comes_back() {
    let Some(mut plant) = Plant::new() else { return };
    let run = plant.run();
    plant.until("Good");
    plant.script.order(&json!({ "cut": "Plant/Press" }));
    plant.until(SUBSTITUTE);
    // Its time-out is 10 s: the death is why.
    run.until("its death, and the substitute", |state| {
        let model = &state["models"]["model"];
        let drive = &model["signals"]["drive"];
        assert_ne!(drive["symptom"], "silent", "{state}");
        let because = drive["unreadable_because"].as_str();
        because.is_some_and(|because| because.contains("NDEATH"))
            && model["needs"]["speed"]["quality"] == SUBSTITUTE
    });
    plant.connect("Press", 1);
    plant.until("Good");
    assert!(run.stop().success());
    assert_eq!(plant.of_node("NDEATH")["metrics"][0]["value"], 0);
}

#[test]
fn the_will_of_a_killed_run_is_its_death_and_the_next_run_is_its_birth() {
    let Some(mut plant) = Plant::new() else { return };
    let run = plant.run();
    let birth = plant.of_node("NBIRTH");
    assert_eq!(birth["seq"], 0);
    plant.until("Good");
    run.kill();
    let death = plant.of_node("NDEATH");
    assert_eq!((&death["metrics"][0]["name"], &death["seq"]), (&json!("bdSeq"), &Value::Null));
    let run = plant.run();
    let birth = plant.of_node("NBIRTH");
    let unit = |metric: &Value| metric["properties"]["engUnit"]["value"] == "rpm";
    assert!(birth["metrics"].as_array().unwrap().iter().any(unit), "{birth}");
    plant.until("Good");
    assert!(run.stop().success());
}
