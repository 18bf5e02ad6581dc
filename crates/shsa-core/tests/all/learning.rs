//! Variables that relations learn: within bounds, while all that they rest on is trusted, over restarts and reloads.

use crate::cell;
use crate::models::{self, System};
use shsa_core::engine::{Engine, Event, EventKind, Input, LearnedNow, Options, Order, Output, Subject};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, KnowledgeBase, build};
use shsa_core::observation::RawValue;
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
