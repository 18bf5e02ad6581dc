//! What outlasts a change of the model: verdicts with their evidence, silence, and orders.

use super::super::drafts::{need, relation, remove, signal, two_patient_systems, two_systems, variable};
use super::{Fault, Stage, fault, halves, records, rows, truth};
use proptest::prelude::*;
use shsa_core::diagnosis::Verdict;
use shsa_core::engine::{Engine, Event, EventKind, Input, Options, Order, Output, Subject};
use shsa_core::knowledge::{Bounds, Draft, Edit, KnowledgeBase, Model, Section, SignalDraft};
use shsa_core::monitor::{WatchedWay, WayIndex};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;

#[test]
fn verdicts_stay_with_their_evidence_and_go_with_it() {
    let fault = Fault { signal: "gnss", from: 2.0, to: 60.0, added: Some(5.0) };
    let (before, after): (Vec<Row>, Vec<Row>) = rows(20.0, &[fault]).into_iter().partition(|row| row.1 < 5.0);
    // Only the others can tell that it is wrong.
    let mut compared = two_systems();
    compared.signals.iter_mut().for_each(|signal| signal.max_rate = Some(super::drafts::text("none")));
    let mut stage = Stage::new(compared.clone());
    stage.run(&before);
    assert_eq!(stage.verdict("gnss"), Verdict::Failed);
    let failures =
        |stage: &Stage| stage.events.iter().filter(|event| event.kind == EventKind::Failed).count();
    stage.change(5.0, &[remove(Section::Relations, "gaining"), remove(Section::Needs, "gain")]);
    assert_eq!(stage.verdict("gnss"), Verdict::Failed);
    stage.change(5.0, &[remove(Section::Signals, "wheel_1")]);
    assert_eq!((stage.verdict("gnss"), failures(&stage)), (Verdict::Failed, 1));
    // Without a witness nothing could ever clear it.
    let mut alone = Stage::new(compared);
    alone.run(&before);
    let witnesses = [remove(Section::Signals, "wheel_1"), remove(Section::Signals, "wheel_2")];
    alone.change(5.0, &witnesses);
    assert_eq!(alone.verdict("gnss"), Verdict::Unknown);
    assert!(alone.last_event(EventKind::Restored).because.contains("are gone with the changed model"));
    // What its own readings have shown stays; where the comparisons that spoke against it are gone, nobody knows.
    let mut jumped = Stage::new(two_systems());
    jumped.run(&before);
    jumped.change(5.0, &witnesses);
    assert_eq!((jumped.verdict("gnss"), failures(&jumped)), (Verdict::Failed, 1));
    jumped.run(&after);
    assert_eq!(jumped.verdict("gnss"), Verdict::Unknown);
    let is_unproven =
        |event: &Event| event.kind == EventKind::Suspected && event.because.contains("nothing for it");
    assert!(jumped.events.iter().any(is_unproven), "{:?}", jumped.events);
    let is_cleared = |event: &Event| event.kind == EventKind::Restored && event.signal.is_some();
    assert!(!jumped.events.iter().any(is_cleared), "{:?}", jumped.events);
    // Described anew, it is judged anew, and found again.
    stage.change(5.0, &[Edit::Signal(signal("gnss", "speed", "10 Hz", "0.4"))]);
    assert!(stage.last_event(EventKind::Restored).because.contains("describes it anew"));
    stage.run(&after);
    assert_ne!(stage.verdict("gnss"), Verdict::Healthy);
}

#[test]
fn silence_is_remembered_and_what_is_new_has_time_to_speak() {
    let silent = Fault { signal: "lidar", from: 2.0, to: 60.0, added: None };
    let (before, after): (Vec<Row>, Vec<Row>) =
        rows(10.0, &[silent]).into_iter().partition(|row| row.1 < 5.0);
    let mut stage = Stage::new(two_systems());
    stage.run(&before);
    let silences =
        |stage: &Stage| stage.events.iter().filter(|event| event.kind == EventKind::Silent).count();
    assert_eq!(silences(&stage), 1);
    let new = ["never", "wheel_3"].map(|name| Edit::Signal(signal(name, "speed", "20 Hz", "0.5")));
    stage.change(5.0, &new);
    stage.run(&after);
    assert_eq!(silences(&stage), 2, "the new signal that never speaks");
    let event = stage.last_event(EventKind::Silent);
    assert!(event.time > Time::from_seconds(5.2) && event.because.contains("none ever"), "{event:?}");
}

#[test]
fn orders_outlast_a_change_as_long_as_what_they_name_does() {
    let (before, after) = halves();
    let mut stage = Stage::new(two_patient_systems());
    stage.run(&before);
    let forbid = Order::Forbid(Subject::Signal("gnss".to_owned()));
    let force = Order::Force { need: "climb".to_owned(), source: "barometer by climbing".to_owned() };
    for order in [&forbid, &force] {
        stage.engine.order(order, Time::from_seconds(5.0)).unwrap();
    }
    stage.listen();
    let refusals = |stage: &Stage| -> Vec<String> {
        let refused = stage.events.iter().filter(|event| event.kind == EventKind::Refused);
        refused.map(|event| event.because.clone()).collect()
    };
    assert_eq!(stage.source(2).as_deref(), Some("barometer by climbing"));
    // The forbidden signal is described anew and means the same to the operator.
    let anew = Edit::Signal(signal("gnss", "speed", "10 Hz", "0.4"));
    stage.change(5.0, &[anew, remove(Section::Signals, "wheel_2")]);
    assert_eq!(stage.engine.standing_orders().len(), 2);
    assert_eq!(stage.source(2).as_deref(), Some("barometer by climbing"));
    assert!(refusals(&stage).is_empty());
    let (soon, later): (Vec<Row>, Vec<Row>) = after.into_iter().partition(|row| row.1 < 7.0);
    stage.run(&soon);
    assert_ne!(stage.source(0).as_deref(), Some("gnss"));
    // What they name is gone: told, and the need chooses for itself.
    stage.change(7.0, &[remove(Section::Signals, "gnss"), remove(Section::Signals, "barometer")]);
    stage.run(&later);
    assert_eq!(stage.engine.standing_orders(), []);
    assert_eq!(stage.source(2).as_deref(), Some("vario"));
    let [signal, source] = &refusals(&stage)[..] else { panic!("{:?}", refusals(&stage)) };
    assert!(
        signal.starts_with("`forbid gnss` is not in force any more: there is no signal `gnss`"),
        "{signal}"
    );
    assert!(source.contains("there is no source of /healed/climb that could run now"), "{source}");
}
