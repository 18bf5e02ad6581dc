//! Variables that relations learn: within bounds, while all that they rest on is trusted, over restarts and reloads.

use crate::cell;
use crate::driven::text;
use crate::models::{self, System};
use proptest::prelude::*;
use shsa_core::engine::{Engine, Event, EventKind, Input, LearnedNow, Options, Order, Output, Subject};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Id, KnowledgeBase, NeedDraft, RelationDraft, Severity, SignalDraft, SignalId,
    VariableDraft, build,
};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;

/// The run of a cell, and the events so far.
struct Run {
    system: System,
    engine: Engine,
    events: Vec<Event>,
}

impl Run {
    fn new() -> Run {
        let system = cell::cell();
        let engine = Engine::new(system.knowledge.clone(), Options::default());
        Run { system, engine, events: Vec::new() }
    }

    /// Drives some seconds with an offset on a signal.
    fn drive(&mut self, from_s: u32, seconds: u32, signal: usize, offset: f64) {
        for mut input in self.system.inputs(from_s, seconds) {
            if let Input::Observation(observation) = &mut input
                && observation.signal.index() == signal
                && let RawValue::Number(number) = &mut observation.value
            {
                *number += offset;
            }
            self.engine.handle(input);
            self.collect();
        }
    }

    fn collect(&mut self) {
        while let Some(output) = self.engine.poll() {
            if let Output::Event(event) = output {
                self.events.push(event);
            }
        }
    }

    fn learned(&self) -> LearnedNow {
        self.engine.learned().next().unwrap()
    }

    fn kinds(&mut self) -> Vec<EventKind> {
        core::mem::take(&mut self.events).iter().map(|event| event.kind).collect()
    }
}

/// Whether a set holds 30 mohm and is at most this wide.
fn is_found(set: Interval, width: f64) -> bool {
    set.contains(0.030) && set.width() <= width
}

#[test]
fn a_constant_is_learned_and_used_in_place_of_its_range() {
    let mut run = Run::new();
    assert_eq!(run.learned().set, Interval::new(0.015, 0.060));
    run.drive(0, 60, 0, 0.0);
    assert_eq!(run.kinds(), []);
    assert!(is_found(run.learned().set, 0.0025), "{:?}", run.learned());
    let knowledge = run.engine.knowledge();
    let used = knowledge.variables()[run.learned().variable].constant.unwrap();
    assert!(is_found(used, 0.0026), "{used:?}");
    // An offset that the range of 45 mohm would explain is found.
    run.drive(60, 10, 0, -0.1);
    let accused = run.events.iter().find(|event| event.kind == EventKind::Failed).unwrap();
    assert_eq!(accused.signal.map(Id::index), Some(0));
}

#[test]
fn a_fault_freezes_what_is_learned_and_takes_back_what_is_new() {
    let mut run = Run::new();
    run.drive(0, 60, 0, 0.0);
    // Both voltmeters could be wrong, so that none is named; the resistance would be 5 mohm more.
    run.drive(60, 20, 2, 0.15);
    assert!(run.learned().is_frozen);
    // Nothing was confirmed in the first minute.
    assert!(run.learned().set.width() > 0.044, "{:?}", run.learned());
    run.drive(80, 60, 2, 0.0);
    assert!(!run.learned().is_frozen);
    assert!(is_found(run.learned().set, 0.0025), "{:?}", run.learned());
    assert!(run.kinds().iter().all(|kind| *kind != EventKind::Ageing));
}

#[test]
fn a_restart_goes_on_with_what_was_learned() {
    let mut run = Run::new();
    run.drive(0, 60, 0, 0.0);
    let (before, snapshot) = (run.learned().set, run.engine.snapshot());
    run.engine = Engine::new(run.system.knowledge.clone(), Options::default());
    run.engine.handle(Input::Restore { time: Time::from_seconds(60.0), snapshot: Box::new(snapshot) });
    let after = run.learned().set;
    assert!(after.width() <= before.width() + 1e-6 && after.contains(0.030), "{before:?} {after:?}");
    run.drive(60, 5, 0, -0.1);
    assert!(run.events.iter().any(|event| event.kind == EventKind::Failed), "{:?}", run.events);
}

/// The cell with another range.
fn changed(high: &str) -> KnowledgeBase {
    let mut draft = cell::cell_draft();
    draft.variables[3].range = Some((models::text("15 mohm"), models::text(high)));
    build(&draft).0
}

#[test]
fn a_reload_keeps_what_is_learned_where_it_means_the_same() {
    for (high, is_kept) in [("60 mohm", true), ("61 mohm", false)] {
        let mut run = Run::new();
        run.drive(0, 60, 0, 0.0);
        run.engine.reload(changed(high), Time::from_seconds(60.0));
        assert_eq!(is_found(run.learned().set, 0.0025), is_kept, "{high}: {:?}", run.learned());
    }
}

#[test]
fn an_order_to_clear_the_relation_forgets_what_was_learned() {
    let mut run = Run::new();
    run.drive(0, 60, 0, 0.0);
    let clear = Order::Clear(Subject::Relation("terminal".to_owned()));
    run.engine.order(&clear, Time::from_seconds(60.0)).unwrap();
    run.drive(60, 1, 0, 0.0);
    assert!(run.learned().set.contains(0.030));
    run.drive(61, 60, 0, 0.0);
    assert!(is_found(run.learned().set, 0.0025), "{:?}", run.learned());
}

/// Two levels that differ by an offset, which is learned, and the rate of the first one.
fn levels(error: f64) -> KnowledgeBase {
    let variable = |name: &str, range: (&str, &str), max_rate: &str| VariableDraft {
        name: text(name),
        range: Some((text(range.0), text(range.1))),
        max_rate: Some(text(max_rate)),
        ..VariableDraft::default()
    };
    let signal = |name: &str, of: &str, error: f64| SignalDraft {
        name: text(name),
        variable: Some(text(of)),
        rate: Some(text("5 Hz")),
        value_error: Some(Bounds::One(text(format!("{error}")))),
        ..SignalDraft::default()
    };
    let relation =
        |name: &str, equation: &str| RelationDraft::new(text(name), BodyDraft::Equation(text(equation)));
    let climbing = RelationDraft {
        directions: Some(vec![text("climb")]),
        error: Some(Bounds::One(text("0.5"))),
        ..relation("climbing", "climb = derivative(height, 2 s)")
    };
    let place = RelationDraft { learn: vec![text("field")], ..relation("place", "asl = height + field") };
    let (knowledge, problems) = build(&Draft {
        variables: vec![
            variable("height", ("-1000", "5000"), "20"),
            variable("climb", ("-20", "20"), "10"),
            variable("asl", ("-1000", "9000"), "20"),
            variable("field", ("-50", "50"), "0.001"),
        ],
        relations: vec![climbing, place],
        signals: vec![
            signal("low", "height", 0.5),
            signal("high", "asl", error),
            signal("rate", "climb", 0.3),
        ],
        needs: vec![NeedDraft { variable: text("height"), ..NeedDraft::default() }],
        ..Draft::default()
    });
    assert!(problems.iter().all(|it| it.severity != Severity::Error), "{problems:?}");
    knowledge
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    /// A level that walks off is accused by its rate, which is right again once the level stands still. What was learned before
    /// contradicts it: the accusation does not erase that.
    #[test]
    fn an_accusation_does_not_erase_its_witness(
        error in 4.0..10.0_f64,
        size in 26.0..45.0_f64,
        slope in 1.2..3.0_f64,
        is_up in any::<bool>(),
        seed in any::<u32>(),
    ) {
        let mut engine = Engine::new(levels(error), Options::default());
        let (from, until) = (90.0, 90.0 + size / slope + 60.0);
        let mut noise = seed | 1;
        let mut draw = || {
            noise ^= noise << 13;
            noise ^= noise >> 17;
            noise ^= noise << 5;
            f64::from(noise) / f64::from(u32::MAX) * 2.0 - 1.0
        };
        let mut restored = Vec::new();
        for step in 0..(until * 5.0) as i64 {
            let seconds = step as f64 * 0.2;
            let (height, climb) = (20.0 * (0.1 * seconds).sin(), 2.0 * (0.1 * seconds).cos());
            let off = ((seconds - from).max(0.0) * slope).min(size) * if is_up { 1.0 } else { -1.0 };
            let all = [height + off + 0.4 * draw(), height - 7.0 + error * draw(), climb + 0.2 * draw()];
            for (at, value) in all.into_iter().enumerate() {
                engine.handle(Input::Observation(Observation {
                    signal: SignalId::from_index(at),
                    stamp: Time::from_seconds(seconds),
                    received: Time::from_seconds(seconds),
                    value: RawValue::Number(value),
                }));
                restored.extend(core::iter::from_fn(|| engine.poll()).filter_map(|output| match output {
                    Output::Event(event) if event.kind == EventKind::Restored => Some(event),
                    _ => None,
                }));
            }
        }
        let low = Some(SignalId::from_index(0));
        let wrong = restored.iter().find(|it| it.signal == low && it.time > Time::from_seconds(from + size / slope));
        prop_assert!(wrong.is_none(), "{wrong:?}");
        prop_assert!(engine.verdict(SignalId::from_index(0)) > shsa_core::trust::Verdict::Healthy);
    }
}
