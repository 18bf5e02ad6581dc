//! A run that is killed and continues from its state: the restart makes no signal trusted or accused.

use proptest::prelude::*;
use shsa_core::engine::{
    Engine, Event, EventKind, Input, Options, Order, Output, PublishedValue, Report, Snapshot, Subject,
};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::reason::{Clause, Reason, Reasons};
use shsa_core::time::{Span, Time, Validity};
use shsa_core::trust::Verdict;
use shsa_format::drive::Given;
use shsa_format::journal::{JournalWriter, read_journal};
use shsa_format::state::{read_state, write_state};
use shsa_format::story;
use shsa_format::words;
use shsa_model::live::{Live, Written};
use std::collections::BTreeSet;
use std::path::Path;

/// Stories with faults of all kinds, and with orders.
const STORIES: [&str; 12] = [
    "01-dead-but-looks-alive",
    "02-fallback-by-value",
    "04-a-drift-is-found-before-values-disagree",
    "06-a-device-fails-as-a-whole",
    "07-fail-back-after-probation",
    "08-no-flapping",
    "12-several-faults-at-once",
    "18-a-relation-no-longer-holds",
    "20-invalid-is-not-missing",
    "26-forbidden-is-not-used",
    "26-forced-is-never-replaced",
    "26-cleared-by-the-operator",
];

/// The observations and orders of a story.
fn story(name: &str) -> (KnowledgeBase, Vec<Input>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../stories").join(format!("{name}.yaml"));
    let story = story::load_file(&path).story.expect("a story without problems");
    let inputs = story.journal().into_iter().flat_map(|era| era.inputs);
    (story.knowledge.clone(), inputs.filter(|input| !matches!(input, Input::Tick(_))).collect())
}

struct Stage {
    engine: Engine,
    events: Vec<Event>,
    /// Accused signals that have not been restored.
    accused: BTreeSet<SignalId>,
}

impl Stage {
    fn new(engine: Engine, accused: BTreeSet<SignalId>) -> Stage {
        Stage { engine, events: Vec::new(), accused }
    }

    fn give(&mut self, input: &Input) {
        while let Some(due) = self.engine.next_deadline().filter(|due| *due < input.time()) {
            self.engine.handle(Input::Tick(due));
            self.listen();
        }
        self.engine.handle(input.clone());
        self.listen();
    }

    fn listen(&mut self) {
        while let Some(output) = self.engine.poll() {
            let Output::Event(event) = output else { continue };
            if let Some(signal) = event.signal {
                match event.kind {
                    EventKind::Failed | EventKind::Suspected => _ = self.accused.insert(signal),
                    EventKind::Restored => _ = self.accused.remove(&signal),
                    _ => {}
                }
            }
            self.events.push(event);
        }
        let knowledge = self.engine.knowledge();
        for need in knowledge.needs().ids() {
            let status = self.engine.need_status(need);
            let source = status.source.filter(|_| status.forced.is_none());
            let source = source.as_ref().map(words::served_by).unwrap_or_default();
            let signals = source.split(" by ").next().unwrap_or_default().split(", ");
            for signal in signals.filter_map(|name| knowledge.signal(name)) {
                assert!(
                    !self.accused.contains(&signal),
                    "{source} serves and is accused: {:#?}",
                    self.events
                );
            }
        }
    }

    /// The signals that are suspect or failed now.
    fn untrusted(&self) -> BTreeSet<SignalId> {
        let is_accused =
            |signal: &SignalId| matches!(self.engine.verdict(*signal), Verdict::Suspect | Verdict::Failed);
        self.engine.knowledge().signals().ids().filter(is_accused).collect()
    }
}

/// All signals that are accused in an uninterrupted run.
fn ever_accused(knowledge: &KnowledgeBase, inputs: &[Input]) -> BTreeSet<SignalId> {
    let mut stage = Stage::new(Engine::new(knowledge.clone(), Options::default()), BTreeSet::new());
    inputs.iter().for_each(|input| stage.give(input));
    let accuses = |event: &&Event| matches!(event.kind, EventKind::Failed | EventKind::Suspected);
    stage.events.iter().filter(accuses).filter_map(|event| event.signal).collect()
}

fn restored(knowledge: &KnowledgeBase, snapshot: &Snapshot, at: Time) -> Engine {
    let text = write_state(snapshot);
    let read = read_state(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(read, *snapshot);
    let mut engine = Engine::new(knowledge.clone(), Options::default());
    engine.restore(&read, at);
    engine
}

fn check(name: &str, cut: f64, down: Span) {
    let (knowledge, inputs) = story(name);
    let known = ever_accused(&knowledge, &inputs);
    let at = ((inputs.len() - 1) as f64 * cut) as usize;
    let mut stage = Stage::new(Engine::new(knowledge.clone(), Options::default()), BTreeSet::new());
    inputs[..at].iter().for_each(|input| stage.give(input));
    let snapshot = stage.engine.snapshot();
    let untrusted = stage.untrusted();
    let killed = snapshot.time;
    let began = killed + down;

    let mut after = Stage::new(restored(&knowledge, &snapshot, began), untrusted.clone());
    after.listen();
    assert_eq!(after.untrusted(), untrusted, "{name} at {killed:?}");
    assert_eq!(after.engine.standing_orders(), snapshot.orders, "{name} at {killed:?}");
    // What the engine would still have decided at the moment of its end, the restored one decides as it begins.
    while let Some(due) = stage.engine.next_deadline().filter(|due| *due <= killed) {
        stage.engine.handle(Input::Tick(due));
        stage.listen();
    }
    let decided = stage.engine.snapshot();
    let both = snapshot.needs.iter().zip(&decided.needs);
    for ((before, decided), now) in both.zip(&after.engine.snapshot().needs) {
        let is_one = now.source == before.source || now.source == decided.source;
        assert!(is_one, "{name} at {killed:?}: {before:?}, then {now:?}: {:#?}", after.events);
    }
    let later = |input: &&Input| input.time() > began || matches!(input, Input::Order { .. });
    inputs[at..].iter().filter(later).for_each(|input| after.give(input));
    // A comparison that waited when the run ended is lost. So one witness may speak a value later than the other, and be a suspect
    // beside the culprit until then.
    let accuses = |event: &Event, kind: EventKind, is_known: bool| {
        event.kind == kind && event.signal.is_some_and(|signal| known.contains(&signal) == is_known)
    };
    for event in &after.events {
        assert!(!accuses(event, EventKind::Failed, false), "{name} at {killed:?}: {event:?}");
        let is_beside =
            |other: &Event| other.time == event.time && accuses(other, EventKind::Suspected, true);
        assert!(
            !accuses(event, EventKind::Suspected, false) || after.events.iter().any(is_beside),
            "{name} at {killed:?}: {event:?}"
        );
    }
    assert!(after.untrusted().is_subset(&known), "{name} at {killed:?}: {:#?}", after.events);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn a_restart_trusts_and_accuses_nobody(
        which in 0..STORIES.len(),
        cut in 0.0..1.0_f64,
        down_ms in prop_oneof![Just(0), 0..5_000_i64],
    ) {
        check(STORIES[which], cut, Span::from_millis(down_ms));
    }
}

#[track_caller]
fn check_error(from: &str, to: &str, expected: &str) {
    let (knowledge, inputs) = story("01-dead-but-looks-alive");
    let mut stage = Stage::new(Engine::new(knowledge.clone(), Options::default()), BTreeSet::new());
    inputs.iter().for_each(|input| stage.give(input));
    let text = write_state(&stage.engine.snapshot());
    assert!(text.contains(from), "{text}");
    let error = read_state(&text.replacen(from, to, 1)).unwrap_err().to_string();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn a_state_that_is_wrong_says_where() {
    check_error("shsa-state-2", "shsa-state-9", "this says it is `shsa-state-9`, and only `shsa-state-2`");
    let unknown = "`because`: reason `moon`: there is no such reason";
    check_error("\"code\": \"most-probable\"", "\"code\": \"moon\"", unknown);
    check_error("\"own\"", "\"of\"", "reason `probability-and-next`: `own`: ");
    check_error(
        "\"own\"",
        "\"also\": 1, \"own\"",
        "reason `probability-and-next`: it has no argument `also`",
    );
    let joint = "\"joint\": \"moon\", \"code\": \"most-probable\"";
    check_error("\"code\": \"most-probable\"", joint, "`joint` cannot be `moon`: known are `next`, `namely`");
    check_error("\"failed\"", "\"broken\"", "`verdict` cannot be `broken`: known are `suspect`, `failed`");
    check_error("\"alone\"", "\"lonely\"", "unknown field `lonely`");
    check_error("\"relapses\": ", "\"relapses\": -", "at line");
    check_error("\"signal\"", "\"relation\": \"r\", \"signal\"", "here it is about both");
}

/// Earlier versions wrote the reasons of an accusation as a sentence, which is reported and kept as written.
#[test]
fn reasons_that_an_earlier_version_wrote_in_words_are_read() {
    let (knowledge, inputs) = story("01-dead-but-looks-alive");
    let mut stage = Stage::new(Engine::new(knowledge.clone(), Options::default()), BTreeSet::new());
    inputs.iter().for_each(|input| stage.give(input));
    let snapshot = stage.engine.snapshot();
    let accusations = || snapshot.verdicts.iter().filter_map(|it| it.accusation.as_ref());
    let reported: Vec<String> = accusations().map(|it| words::reasons(&it.because)).collect();
    assert!(!reported.is_empty() && reported.iter().all(|text| !text.is_empty()), "{reported:?}");

    let mut state: serde_json::Value = serde_json::from_str(&write_state(&snapshot)).unwrap();
    state["state"] = "shsa-state-1".into();
    let verdicts = state["verdicts"].as_array_mut().unwrap();
    let charges = verdicts.iter_mut().filter_map(|verdict| verdict.get_mut("charge"));
    for (charge, text) in charges.zip(&reported) {
        charge["because"] = text.as_str().into();
    }
    let read = read_state(&state.to_string()).unwrap();
    let engine = restored(&knowledge, &read, snapshot.time);
    let again = engine.snapshot();
    let again: Vec<_> = again.verdicts.iter().filter_map(|it| it.accusation.as_ref()).collect();
    assert_eq!(again.iter().map(|it| words::reasons(&it.because)).collect::<Vec<_>>(), reported);
    let is_reported =
        |because: &Reasons| matches!(because.clauses(), [Clause { reason: Reason::Text { .. }, .. }]);
    assert!(again.iter().all(|it| is_reported(&it.because)), "{again:?}");
    assert!(!accusations().any(|it| is_reported(&it.because)), "the engine tells no words of its own");
}

/// Earlier versions did not write the comparisons that have disagreed with a component.
#[test]
fn the_comparisons_behind_an_accusation_are_kept_and_may_be_absent() {
    let (knowledge, inputs) = story("01-dead-but-looks-alive");
    let mut stage = Stage::new(Engine::new(knowledge.clone(), Options::default()), BTreeSet::new());
    let has_conflicts = |snapshot: &Snapshot| snapshot.verdicts.iter().any(|it| !it.conflicts.is_empty());
    let accused = inputs.iter().find_map(|input| {
        stage.give(input);
        Some(stage.engine.snapshot()).filter(has_conflicts)
    });
    let accused = accused.expect("somebody is accused");
    let again = restored(&knowledge, &accused, accused.time).snapshot();
    let conflicts = |snapshot: &Snapshot| -> Vec<_> {
        snapshot.verdicts.iter().map(|it| (it.subject.clone(), it.conflicts.clone())).collect()
    };
    assert_eq!(conflicts(&again), conflicts(&accused));

    let mut state: serde_json::Value = serde_json::from_str(&write_state(&accused)).unwrap();
    for verdict in state["verdicts"].as_array_mut().unwrap() {
        verdict.as_object_mut().unwrap().remove("conflicts");
    }
    let earlier = read_state(&state.to_string()).unwrap();
    assert!(!has_conflicts(&earlier) && earlier.verdicts.len() == accused.verdicts.len());
}

#[test]
fn what_a_changed_model_does_not_have_is_reported_and_dropped() {
    let (knowledge, inputs) = story("01-dead-but-looks-alive");
    let mut stage = Stage::new(Engine::new(knowledge.clone(), Options::default()), BTreeSet::new());
    inputs.iter().for_each(|input| stage.give(input));
    let mut snapshot = stage.engine.snapshot();
    let name = snapshot.verdicts.iter().find(|it| it.record.verdict.is_some()).map(|it| it.subject.clone());
    let Some(Subject::Signal(name)) = name else { panic!("{snapshot:?}") };
    snapshot.verdicts.iter_mut().for_each(|it| it.subject = Subject::Signal(format!("{name}/gone")));
    let engine = restored(&knowledge, &snapshot, snapshot.time);
    let mut stage = Stage::new(engine, BTreeSet::new());
    stage.listen();
    let refused = stage.events.iter().find(|event| event.kind == EventKind::Refused).expect("a refusal");
    let reported = words::reasons(&refused.because);
    assert!(reported.contains("is forgotten: there is no signal"), "{reported}");
}

#[test]
fn a_journal_holds_orders_and_what_a_run_goes_on_from() {
    const MODEL: &str = "shsa: 1\nvariables: { v: {} }\nsignals: { /a: { variable: v }, /b: { variable: v } }\nneeds: { v: { signal: /v } }\n";
    let (live, _) = Live::load(Written { name: "m.yaml", text: MODEL }).expect("a model");
    let knowledge = live.knowledge().clone();
    let (_, inputs) = story("12-several-faults-at-once");
    let mut stage = {
        let (knowledge, _) = story("12-several-faults-at-once");
        Stage::new(Engine::new(knowledge, Options::default()), BTreeSet::new())
    };
    inputs.iter().for_each(|input| stage.give(input));
    let snapshot = Box::new(stage.engine.snapshot());
    assert!(!snapshot.verdicts.is_empty() && !snapshot.trends.is_empty());
    let observed = |at: i64, value: f64| {
        let (signal, time) = (knowledge.signal("/b").expect("a signal"), Time(at));
        Input::Observation(Observation {
            signal,
            stamp: time,
            received: time,
            value: RawValue::Number(value),
        })
    };
    let order = |at: i64, order: Order| Input::Order { time: Time(at), order };
    let need = knowledge.needs().ids().next().expect("a need");
    let stated = |at: i64, report: Report| Input::Report { time: Time(at), need, report };
    let (within, open) = (Interval::new(-0.1, 0.3), Interval::new(f64::MAX, f64::INFINITY));
    let valid = Validity { from: Time(1), to: Time(2) };
    let given = vec![
        Input::Restore { time: Time(1), snapshot },
        order(2, Order::Forbid(Subject::Signal("/a".to_owned()))),
        observed(3, 18.956_780_598_122_858),
        order(4, Order::Force { need: "/v".to_owned(), source: "/b".to_owned() }),
        order(5, Order::Clear(Subject::Cause("imu".to_owned()))),
        Input::Tick(Time(6)),
        stated(7, Report::Ready { era: 3 }),
        stated(8, Report::Answer { number: 4, result: Some((PublishedValue::Scalar(within), valid)) }),
        stated(
            9,
            Report::Answer { number: 5, result: Some((PublishedValue::Vector(vec![within, open]), valid)) },
        ),
        stated(10, Report::Answer { number: 6, result: None }),
        stated(11, Report::Gone),
    ];
    let mut journal = JournalWriter::new(Vec::new(), &knowledge).expect("a journal");
    given.iter().for_each(|input| journal.record(Given::Input(input)).expect("a line"));
    let bytes = journal.into_output();
    let read = read_journal(&bytes[..], live).expect("a journal");
    assert_eq!(read.damage, None);
    assert_eq!(read.eras[0].inputs, given);
    let broken = String::from_utf8_lossy(&bytes).replacen("forbid", "frobid", 1);
    let (live, _) = Live::load(Written { name: "m.yaml", text: MODEL }).expect("a model");
    let damage = read_journal(broken.as_bytes(), live).expect("a journal").damage;
    assert!(damage.is_some_and(|(line, why)| line == 3 && why.contains("there is no order `frobid`")));
}
