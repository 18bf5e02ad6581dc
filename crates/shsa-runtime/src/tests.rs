//! Whole runs within this process, on a bus that can be made to fail.

mod channel;
mod journal;
mod takeover;

use super::{Ending, Handle, Model, Options, Order, Runtime, RuntimeError};
use serde_json::Value;
use shsa_bridge::memory::{MemoryBridge, MemoryBus};
use shsa_bridge::{
    Bridge, BridgeError, Clock, Inbox, Link, Message, Outgoing, Payload, PublisherId, payload,
};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_format::wiring::Wiring;
use shsa_model::live::{Live, Written};
use std::collections::BTreeMap;
use std::slice::from_ref;
use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

const MODEL: &str = "
shsa: 1
variables: { speed: { unit: m/s }, height: { unit: m } }
signals:
  wheel: { variable: speed, source: robot/wheel }
  baro:  { variable: height, source: robot/baro }
needs:
  speed:  { signal: healed/speed, max_age: 1 s }
  height: { signal: healed/height, max_age: 1 s }
";
/// A time limit that no step reaches, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(30);

/// The errors of the bus for messages of some names.
type Refusals = Arc<Mutex<BTreeMap<&'static str, BridgeError>>>;

/// A bus that refuses some messages.
struct Faulty {
    bus: MemoryBridge,
    refusals: Refusals,
}

impl Bridge for Faulty {
    fn publisher(&self) -> PublisherId {
        self.bus.publisher()
    }
    fn inbox(&self) -> &Inbox {
        self.bus.inbox()
    }
    fn subscribe(&mut self, topic: &str, message_type: Option<&str>) -> Result<(), BridgeError> {
        if topic == "REFUSED" {
            return Err(BridgeError::Refused("no such name".into()));
        }
        self.bus.subscribe(topic, message_type)
    }
    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        self.bus.subscribe_all()
    }
    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        match self.refusals.lock().unwrap().get(message.topic) {
            Some(refusal) => Err(refusal.clone()),
            None => self.bus.publish(message),
        }
    }
    fn link(&self) -> Link {
        Link::Up
    }
}

/// A run, a publisher, and a subscriber to everything.
struct Bench {
    refusals: Refusals,
    sensors: MemoryBridge,
    listener: MemoryBridge,
    handle: Handle,
    run: Option<JoinHandle<Result<Ending, RuntimeError>>>,
}

impl Bench {
    fn new(refusals: &[(&'static str, BridgeError)]) -> Bench {
        Bench::wired(MODEL, "{ form: plain }", refusals)
    }

    /// A bench whose need for the speed has this wiring.
    fn wired(model: &str, wiring: &str, refusals: &[(&'static str, BridgeError)]) -> Bench {
        let bus = MemoryBus::new(Clock::running());
        let (sensors, mut listener) = (bus.join(64), bus.join(4096));
        listener.subscribe_all().unwrap();
        let refusals: Refusals = Arc::new(Mutex::new(refusals.iter().cloned().collect()));
        let faulty = Faulty { bus: bus.join(64), refusals: refusals.clone() };
        let (live, _) = Live::load(Written { name: "model", text: model })
            .unwrap_or_else(|report| panic!("{}", report.render(false)));
        let wiring = format!("wiring: {{ speed: {wiring} }}");
        let wiring = Wiring::read(&wiring, "wiring", &[live.knowledge()])
            .unwrap_or_else(|report| panic!("{}", report.render(false)));
        let runtime = Runtime::new(vec![named(live)], options(wiring), Box::new(faulty)).unwrap();
        let handle = runtime.handle();
        Bench { refusals, sensors, listener, handle, run: Some(spawn(move || runtime.run())) }
    }

    fn say(&mut self, topic: &str, value: f64) {
        let clock = self.sensors.inbox().clock();
        let stamp = clock.by_wall(clock.now());
        let payload = Payload::Value(RawValue::Number(value));
        self.sensors.publish(Outgoing::new(topic, stamp, payload)).unwrap();
    }

    fn state(&self) -> Value {
        self.handle.state().unwrap()
    }

    #[track_caller]
    fn order(&self, order: &str) {
        self.handle.order(Order::read(order).unwrap()).unwrap();
    }

    /// Orders this change of the model.
    #[track_caller]
    fn change(&self, text: &str) -> Result<(), String> {
        match self.handle.order(Order::Change { model: None, text: text.to_owned() }) {
            Ok(_) => Ok(()),
            Err(RuntimeError::Refused(why)) => Err(why),
            Err(other) => panic!("the run goes on, and says {other}"),
        }
    }

    /// Loses the wheel; the radar takes its name.
    #[track_caller]
    fn lose_the_wheel(&mut self) {
        self.say("robot/wheel", 5.0);
        self.say("robot/radar", 5.0);
        self.await_message("healed/speed", "5");
        self.order(r#"{"order": "forbid", "signal": "wheel"}"#);
        self.say("robot/radar", 6.0);
        self.await_message("healed/speed", "6");
        self.await_message("shsa/model/events", "\"kind\":\"silenced\"");
    }

    /// Waits for the next message with this topic and these words.
    #[track_caller]
    fn await_message(&mut self, topic: &str, words: &str) -> Message {
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            let Some(message) = self.listener.receive() else {
                sleep(Duration::from_millis(1));
                continue;
            };
            if &*message.topic == topic && text(&message).contains(words) {
                return message;
            }
        }
        panic!("on {topic} never came: {words}");
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.handle.stop();
        let ended_well = self.run.take().is_some_and(|run| run.join().is_ok_and(|ended| ended.is_ok()));
        assert!(ended_well || std::thread::panicking());
    }
}

fn named(live: Live) -> Model {
    Model { name: "model".to_owned(), path: None, live }
}

fn options(wiring: Wiring) -> Options {
    Options { name: "model".to_owned(), wiring, ..Options::default() }
}

fn text(message: &Message) -> String {
    match &message.payload {
        Payload::Bytes(bytes) => String::from_utf8_lossy(bytes).into_owned(),
        Payload::Value(value) => payload::plain(value),
    }
}

#[test]
fn what_the_bus_refuses_ends_no_run_and_is_reported_once_with_its_count() {
    let refused = BridgeError::Refused("no such name".into());
    let mut bench = Bench::new(&[("healed/speed", refused)]);
    for at in 0..25_u32 {
        bench.say("robot/wheel", 5.0);
        // The other need is still served.
        bench.say("robot/baro", f64::from(at));
        bench.await_message("healed/height", &at.to_string());
    }
    let state = bench.state();
    assert_eq!(state["undelivered"]["healed/speed"]["refused"]["count"], 25, "{state}");
    let needs = &state["models"]["model"]["needs"];
    assert_eq!((&needs["speed"]["quality"], &needs["height"]["quality"]), (&"Bad".into(), &"Good".into()));
    assert_eq!(needs["speed"]["unwritten"], "refused: no such name");
    bench.refusals.lock().unwrap().clear();
    bench.say("robot/wheel", 6.0);
    bench.await_message("healed/speed", "6");
    let needs = bench.state()["models"]["model"]["needs"].clone();
    assert_eq!((&needs["speed"]["quality"], &needs["speed"]["unwritten"]), (&"Good".into(), &Value::Null));
}

#[test]
fn a_refusal_is_reported_when_it_begins_and_when_it_has_grown_tenfold() {
    let mut bench = Bench::new(&[("healed/speed", BridgeError::Refused("no such name".into()))]);
    bench.say("robot/wheel", 5.0);
    bench.await_message("shsa/model/events", "a message on healed/speed was not sent: refused: no such name");
    for _ in 0..9 {
        bench.say("robot/wheel", 5.0);
        sleep(Duration::from_millis(5));
    }
    bench.await_message(
        "shsa/model/events",
        "10 messages on healed/speed were not sent: refused: no such name",
    );
}

#[test]
fn a_value_that_was_lost_on_its_way_is_sent_again() {
    let lost = BridgeError::Lost("nobody there".into());
    let mut bench = Bench::new(&[("healed/speed", lost)]);
    bench.say("robot/wheel", 5.0);
    bench.await_message("shsa/model/events", "a message on healed/speed was not sent: connection lost");
    bench.refusals.lock().unwrap().clear();
    // No further observation is needed.
    bench.await_message("healed/speed", "5");
    assert_eq!(bench.state()["models"]["model"]["needs"]["speed"]["quality"], "Good");
}

#[test]
fn a_run_whose_events_nobody_takes_goes_on() {
    let refused = BridgeError::Refused("no rights".into());
    let of_status = ("shsa/model/need/speed", refused.clone());
    let mut bench = Bench::new(&[("shsa/model/events", refused.clone()), of_status]);
    bench.say("robot/wheel", 5.0);
    bench.await_message("healed/speed", "5");
    bench.await_message("shsa/model/need/height", "Bad");
    let state = bench.state();
    assert!(state["undelivered"]["shsa/model/events"]["refused"]["count"].as_u64() >= Some(1), "{state}");
    assert!(state["undelivered"]["shsa/model/need/speed"]["refused"]["count"].as_u64() >= Some(1), "{state}");
}

const TWO: &str = "
shsa: 1
variables: { speed: { unit: m/s }, height: { unit: m } }
signals:
  wheel: { variable: speed, source: robot/wheel, properties: { accuracy: 0.9 } }
  radar: { variable: speed, source: robot/radar, properties: { accuracy: 0.8 } }
  baro:  { variable: height, source: robot/baro }
needs:
  speed:  { signal: healed/speed, max_age: 20 s }
  height: { signal: healed/height, max_age: 1 s }
";

#[test]
fn a_model_that_does_not_fit_the_bus_is_refused_and_the_run_goes_on() {
    let mut bench = Bench::wired(TWO, "{ silence: { command: ['true'] } }", &[]);
    // With this change, the wheel's topic would carry the radar, too.
    let why = bench.change("signals: { radar: { variable: speed, source: robot/wheel } }").unwrap_err();
    assert!(why.contains("wire the need as a gate"), "{why}");
    // The bus refuses the topic.
    bench.change("signals: { optic: { variable: speed, source: REFUSED } }").unwrap();
    bench.await_message("shsa/model/events", "subscribing to REFUSED: refused: no such name");
    bench.say("robot/wheel", 5.0);
    bench.await_message("healed/speed", "5");
}

/// The allocations for observations of each signal after the run has been under way for two seconds, between the reports that
/// come once a second; and the number of observations.
#[track_caller]
fn allocations(model: &str, says: &[(&str, Payload)], consumes: &str) -> (u64, usize) {
    let bus = MemoryBus::new(Clock::manual());
    let (mut sensors, mut consumer) = (bus.join(8), bus.join(8));
    consumer.subscribe(consumes, None).unwrap();
    let (live, _) = Live::load(Written { name: "model", text: model })
        .unwrap_or_else(|report| panic!("{}", report.render(false)));
    let options = options(Wiring::default());
    let mut run = Runtime::new(vec![named(live)], options, Box::new(bus.join(8))).unwrap().session;
    let mut consumed = 0;
    let mut drive = |milliseconds: std::ops::Range<i64>| {
        for at in milliseconds {
            bus.clock().set(Time(at * 1_000_000));
            for (topic, payload) in says {
                let stamp = bus.clock().by_wall(bus.clock().now());
                sensors.publish(Outgoing::new(topic, stamp, payload.clone())).unwrap();
            }
            run.turn().unwrap();
            consumed += std::iter::from_fn(|| consumer.receive()).count();
        }
    };
    drive(0..2_020);
    let counted = allocation_counter::measure(|| drive(2_020..2_990)).count_total;
    (counted, consumed)
}

#[test]
fn an_observation_allocates_nothing_on_its_way_through_the_run() {
    let number = |value: f64| Payload::Value(RawValue::Number(value));
    let json = |text: &'static str| Payload::Bytes(text.into());
    let height = ("robot/baro", number(7.0));
    let check = |model: &str, says: &[(&str, Payload)]| {
        let (counted, consumed) = allocations(model, &[says, from_ref(&height)].concat(), "healed/speed");
        assert_eq!(counted, 0);
        assert!(consumed >= 2_900, "{consumed}");
    };
    // The inputs as values, as JSON, and with a second way.
    check(MODEL, &[("robot/wheel", number(5.0))]);
    let json_model = MODEL.replace("robot/wheel", "'robot/wheel#v'");
    check(&json_model, &[("robot/wheel", json(r#"{"t": 12.5, "v": 5.25}"#))]);
    check(TWO, &[("robot/wheel", number(5.0)), ("robot/radar", number(5.0))]);
}

#[test]
fn a_subscriber_hears_every_decision_and_the_end() {
    let mut bench = Bench::wired(TWO, "{ form: plain }", &[]);
    let mut events = bench.handle.subscribe();
    bench.say("robot/wheel", 5.0);
    bench.say("robot/radar", 5.0);
    bench.await_message("healed/speed", "5");
    bench.order(r#"{"order": "forbid", "signal": "wheel"}"#);
    bench.say("robot/radar", 6.0);
    bench.await_message("healed/speed", "6");
    let state = bench.state();
    let kinds: Vec<Value> = std::iter::from_fn(|| events.poll()).map(|event| event["kind"].clone()).collect();
    assert!(kinds.contains(&"ordered".into()) && kinds.contains(&"substituted".into()), "{kinds:?}");
    assert_eq!(state["figures"]["events"]["substituted"], 1, "{state}");
    bench.handle.stop();
    assert!(events.all(|event| event["number"].is_u64()));
}

#[test]
fn a_question_after_the_end_has_no_answer() {
    let handle = {
        let bench = Bench::new(&[]);
        bench.handle.health().unwrap();
        bench.handle.clone()
    };
    assert!(matches!(handle.state(), Err(RuntimeError::NoAnswer)));
    assert!(handle.subscribe().next().is_none());
}
