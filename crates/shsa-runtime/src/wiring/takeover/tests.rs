//! The stages of a takeover, on a bus in memory with real commands.

use super::*;
use shsa_bridge::memory::{MemoryBridge, MemoryBus};
use shsa_bridge::{Clock, Payload, Quality};
use shsa_core::engine::PublishedValue;
use shsa_core::interval::Interval;
use shsa_core::observation::RawValue;
use shsa_core::time::Validity;
use std::thread;
use std::time::Duration;

const MODEL: &str = "
shsa: 1
variables: { speed: { unit: m/s } }
signals:
  wheel: { variable: speed, source: robot/wheel#speed, unit: km/h, rate: 20 Hz }
  radar: { variable: speed, source: robot/radar }
needs:
  speed: { signal: /healed/speed, max_age: 1 s }
";

/// A takeover on a bus in memory, with a source and a consumer.
struct Bench {
    takeover: Takeover,
    bus: MemoryBus,
    healer: MemoryBridge,
    consumer: MemoryBridge,
    now: Time,
    is_bad: bool,
    is_served: bool,
    is_ours: bool,
}

impl Bench {
    fn new(wiring: &str) -> Bench {
        let loaded = shsa_model::load(MODEL, "model.yaml");
        let knowledge = loaded.knowledge;
        let text = format!("wiring: {{ speed: {{ {wiring} }} }}");
        let wiring = wiring::Wiring::read(&text, "wiring.yaml", &[&knowledge]);
        let wiring = wiring.unwrap_or_else(|report| panic!("{}", report.render(false)));
        let settings = wiring.needs[0].takeover.clone().unwrap();
        let need = knowledge.needs().ids().next().unwrap();
        let wheel = knowledge.signal("wheel").unwrap();
        let takeover = Takeover::new(&knowledge, need, wheel, &settings).unwrap();
        let bus = MemoryBus::new(Clock::manual());
        let (healer, mut consumer) = (bus.join(8), bus.join(8));
        consumer.subscribe("robot/wheel", None).unwrap();
        Bench { takeover, bus, healer, consumer, now: Time(0), is_bad: true, is_served: true, is_ours: true }
    }

    /// A bench whose takeover knows the source's messages.
    fn taught(wiring: &str) -> Bench {
        let mut bench = Bench::new(wiring);
        let message = bench.message(r#"{"id": 7, "speed": 36.0}"#);
        bench.takeover.template().learn(&message);
        bench
    }

    fn message(&self, text: &str) -> Message {
        let payload = Payload::Bytes(text.to_owned().into());
        Message::new("robot/wheel".into(), self.now, payload)
    }

    /// Advances the time in steps of 10 ms.
    fn pass(&mut self, milliseconds: i64) {
        for _ in 0..milliseconds / 10 {
            self.now = self.now + Span::from_millis(10);
            self.bus.clock().set(self.now);
            self.step();
        }
    }

    fn step(&mut self) {
        let Bench { now, is_bad, is_served, is_ours, .. } = *self;
        let situation = Situation { now, is_bad, is_served, is_ours, source: "radar" };
        self.takeover.step(&situation, &mut self.healer, None);
    }

    /// Waits in real time until an action has ended.
    fn settle(&mut self) -> &'static str {
        for _ in 0..2_000 {
            self.step();
            if !["silencing", "restoring"].contains(&self.takeover.stage()) {
                break;
            }
            thread::sleep(Duration::from_millis(5));
        }
        self.takeover.stage()
    }

    /// Takes the name.
    fn take(&mut self) {
        self.step();
        assert_eq!(self.settle(), "checking");
        self.pass(300);
        assert_eq!(self.takeover.stage(), "taken", "{:?}", self.takeover.last);
    }

    /// The message that a consumer of the name gets when the need is served with 5 m/s.
    fn serve(&mut self) -> Option<String> {
        let validity = Validity { from: self.now, to: self.now };
        let publication = Publication {
            need: self.takeover.need(),
            time: self.now,
            validity,
            value: PublishedValue::Scalar(Interval::point(5.0)),
            quality: shsa_core::engine::Quality::Substitute,
            source: std::sync::Arc::new(shsa_core::reason::ServedBy::Way("radar".into())),
            admitted: Default::default(),
            delegated: false,
        };
        let provenance = Provenance::new(Quality::Substitute, "radar");
        self.takeover.send(&publication, self.now, &provenance, &mut self.healer).unwrap();
        let message = self.consumer.receive()?;
        match message.payload {
            Payload::Bytes(bytes) => Some(String::from_utf8_lossy(&bytes).into_owned()),
            Payload::Value(value) => Some(format!("{value:?}")),
        }
    }

    fn notes(&mut self) -> Vec<(&'static str, String)> {
        std::iter::from_fn(|| self.takeover.note()).map(|note| (note.kind, note.because)).collect()
    }

    #[track_caller]
    fn check_note(&mut self, kind: &str, words: &str) {
        let notes = self.notes();
        assert!(notes.iter().any(|(of, why)| *of == kind && why.contains(words)), "{notes:?}");
    }
}

const OBEYS: &str = "silence: { command: ['true'] }, restore: { command: ['true'] }";

#[test]
fn a_silenced_source_is_replaced_by_messages_like_its_own() {
    let mut bench = Bench::taught(OBEYS);
    assert_eq!(bench.takeover.stage(), "watching");
    assert_eq!(bench.serve(), None);
    bench.take();
    bench.check_note("silenced", "wheel was silenced by the command true");
    // The value is in the unit of the source; the other fields are kept.
    assert_eq!(bench.serve().unwrap(), r#"{"id": 7, "speed": 18}"#);
    assert_eq!(bench.takeover.counts().silenced, 1);
}

#[test]
fn who_does_not_obey_is_refused_and_tried_again_later() {
    let mut bench = Bench::taught("silence: { command: ['true'] }, retry: 1 s");
    bench.step();
    assert_eq!(bench.settle(), "checking");
    for _ in 0..15 {
        bench.pass(50);
        let message = bench.message("1");
        bench.takeover.note_message(&message);
    }
    assert_eq!(bench.takeover.stage(), "waiting");
    bench.check_note("refused", "it goes on after the command true");
    assert_eq!(bench.serve(), None);
    let quality = |bench: &Bench| bench.takeover.quality(Quality::Substitute, bench.is_bad);
    assert_eq!(quality(&bench), Quality::Bad);
    bench.pass(1_000);
    assert_eq!(bench.settle(), "checking", "it was tried again");
    bench.pass(300);
    assert_eq!(bench.takeover.stage(), "taken");
    assert_eq!(quality(&bench), Quality::Substitute);
}

#[test]
fn an_action_that_fails_is_reported_with_its_reason_and_the_pause_doubles() {
    let mut bench = Bench::taught("silence: { command: [sh, -c, 'echo no such unit; exit 5'] }, retry: 1 s");
    bench.step();
    assert_eq!(bench.settle(), "waiting");
    bench.check_note("refused", "sh ended with status 5: no such unit; tried again in 1.0 s");
    bench.pass(1_000);
    assert_eq!(bench.settle(), "waiting");
    bench.check_note("refused", "tried again in 2.0 s");
    // A source that is trusted again is not silenced.
    bench.is_bad = false;
    bench.pass(10);
    assert_eq!(bench.takeover.stage(), "watching");
    bench.is_bad = true;
    bench.step();
    assert_eq!(bench.settle(), "waiting");
    bench.check_note("refused", "tried again in 1.0 s");
}

#[test]
fn nobody_writes_what_was_never_seen() {
    let mut bench = Bench::new(OBEYS);
    bench.step();
    bench.check_note("refused", "no message of it was heard yet");
}

#[test]
fn there_are_never_two() {
    let mut bench = Bench::taught(OBEYS);
    bench.take();
    let mut other = bench.message("1");
    other.quality = Some(Quality::Substitute);
    bench.takeover.note_message(&other);
    let kept = Message { retained: true, ..bench.message("1") };
    bench.takeover.note_message(&kept);
    assert_eq!(bench.takeover.stage(), "taken", "these are not of the source");
    let back = bench.message("1");
    bench.takeover.note_message(&back);
    assert_eq!(bench.serve(), None, "at once");
    bench.check_note("returned", "its name is left to it at once");
    assert_eq!(bench.takeover.counts().returned, 1);
    // The source is still not trusted: after the pause it is silenced again.
    bench.pass(30_000);
    assert_eq!(bench.settle(), "checking");
}

#[test]
fn a_name_that_is_given_back_is_served_until_its_source_is_heard() {
    let mut bench = Bench::taught(OBEYS);
    assert!(!bench.takeover.order_back(), "nothing is taken");
    bench.take();
    assert!(bench.takeover.order_back());
    bench.step();
    bench.check_note("returning", "by the command true (by order of the operator)");
    assert!(bench.serve().is_some());
    assert_eq!(bench.settle(), "taken");
    bench.pass(100);
    assert_eq!(bench.notes(), []);
    assert!(bench.serve().is_some());
    let back = bench.message("1");
    bench.takeover.note_message(&back);
    assert_eq!(bench.serve(), None);
}

#[test]
fn a_source_that_cannot_be_let_back_is_reported_and_tried_again() {
    let mut bench =
        Bench::taught("silence: { command: ['true'] }, restore: { command: ['false'] }, retry: 1 s");
    bench.take();
    bench.is_bad = false;
    bench.step();
    assert_eq!(bench.settle(), "taken");
    bench.check_note("refused", "wheel cannot be let publish again: false ended with status 1");
    bench.pass(500);
    assert_eq!(bench.notes(), []);
    bench.pass(600);
    bench.check_note("returning", "no evidence is against it any more");
}

#[test]
fn a_source_gets_another_chance_after_a_time_where_that_is_set() {
    let mut bench = Bench::taught(&format!("{OBEYS}, probe: 10 s"));
    bench.take();
    bench.pass(9_000);
    assert_eq!(bench.takeover.stage(), "taken");
    assert!(bench.takeover.due(bench.now).is_some());
    bench.pass(1_000);
    bench.check_note("returning", "it gets another chance");
}

#[test]
fn a_source_stays_silent_while_nothing_can_serve_the_need() {
    let mut bench = Bench::taught(OBEYS);
    bench.is_served = false;
    bench.pass(100);
    assert_eq!(bench.takeover.stage(), "watching", "there is nothing to publish in its place");
    bench.is_served = true;
    bench.take();
    bench.notes();
    bench.is_served = false;
    bench.pass(10_000);
    assert_eq!((bench.takeover.stage(), bench.notes()), ("taken", Vec::new()));
}

#[test]
fn who_is_not_responsible_any_more_stops_at_once() {
    let mut bench = Bench::taught(OBEYS);
    bench.take();
    bench.is_ours = false;
    bench.step();
    assert_eq!(bench.takeover.stage(), "watching");
    assert_eq!(bench.serve(), None);
}

#[test]
fn what_shares_its_messages_with_others_is_not_silenced() {
    let loaded = shsa_model::load(&MODEL.replace("robot/radar", "robot/wheel#radar"), "model.yaml");
    let text = format!("wiring: {{ speed: {{ {OBEYS} }} }}");
    let wiring = wiring::Wiring::read(&text, "wiring.yaml", &[&loaded.knowledge]).unwrap();
    let settings = wiring.needs[0].takeover.clone().unwrap();
    let (need, wheel) = (loaded.knowledge.needs().ids().next(), loaded.knowledge.signal("wheel"));
    let error = Takeover::new(&loaded.knowledge, need.unwrap(), wheel.unwrap(), &settings).unwrap_err();
    assert!(error.to_string().contains("radar comes under the name robot/wheel, too"), "{error}");
}

#[test]
fn values_are_values_within_one_process() {
    let mut bench = Bench::new(OBEYS);
    let payload = Payload::Value(RawValue::Number(36.0));
    let message = Message::new("robot/wheel".into(), bench.now, payload);
    bench.takeover.template().learn(&message);
    bench.take();
    assert_eq!(bench.serve().unwrap(), "Interval { lo: 18.0, hi: 18.0 }");
}
