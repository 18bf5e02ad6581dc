//! Operators' orders: a forbidden element serves nothing, a forced source is not replaced, an impossible order changes nothing; a
//! restart in between changes none of that.

use crate::models::System;
use proptest::prelude::*;
use shsa_core::engine::{Engine, EventKind, Input, Options, Order, Output, Subject};
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::reason::{Reason, ServedBy};
use shsa_core::time::{Span, Time};
use shsa_core::trust::Verdict;

/// An event in a second of a run.
#[derive(Clone, Debug)]
enum Step {
    /// No fault.
    Well,
    /// A signal has an offset.
    Shifted(usize, f64),
    /// A signal is silent.
    Silent(usize),
    /// An operator's order: its kind, and its subject.
    Order(u8, usize, usize),
    /// The process is killed, and goes on from its last state.
    Restart,
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        2 => Just(Step::Well),
        2 => (0..5_usize, -9.0..9.0).prop_map(|(signal, shift)| Step::Shifted(signal, shift)),
        1 => (0..5_usize).prop_map(Step::Silent),
        6 => (0..8_u8, 0..12_usize, 0..3_usize).prop_map(|(kind, about, need)| Step::Order(kind, about, need)),
        1 => Just(Step::Restart),
    ];
    prop::collection::vec(step, 1..16)
}

/// An order of a kind: about each signal, each relation, and an unknown name.
fn order(knowledge: &KnowledgeBase, kind: u8, about: usize, need: usize) -> Order {
    let signals = knowledge.signals().iter().map(|signal| Subject::Signal(signal.name.clone()));
    let relations = knowledge.relations().iter().map(|relation| Subject::Relation(relation.name.clone()));
    let subjects: Vec<Subject> = signals.chain(relations).collect();
    let nobody = Subject::Signal("nobody".to_owned());
    let subject = subjects.get(about % (subjects.len() + 1)).unwrap_or(&nobody).clone();
    let first = knowledge.signals().iter().next().map_or("nobody", |signal| &signal.name);
    let names: Vec<&String> = knowledge.needs().iter().map(|need| &need.signal).collect();
    let need = names.get(need).map_or("nothing", |name| name.as_str()).to_owned();
    match kind {
        0..=2 => Order::Forbid(subject),
        3 => Order::Allow(subject),
        4 | 5 => {
            let source = match &subject {
                Subject::Signal(name) | Subject::Cause(name) => name.clone(),
                Subject::Relation(name) => {
                    format!("{first} by {name}")
                }
            };
            Order::Force { need, source }
        }
        6 => Order::Release(need),
        _ => Order::Clear(subject),
    }
}

struct Stage<'a> {
    knowledge: &'a KnowledgeBase,
    engine: Engine,
    reported: Vec<Output>,
}

impl Stage<'_> {
    fn give(&mut self, input: Input) {
        while let Some(due) = self.engine.next_deadline().filter(|due| *due < input.time()) {
            self.engine.handle(Input::Tick(due));
            self.check();
        }
        self.engine.handle(input);
        self.check();
    }

    fn obey(&mut self, order: &Order, at: Time) {
        let before = (self.engine.standing_orders(), self.engine.snapshot());
        let done = self.engine.order(order, at);
        let outputs: Vec<Output> = core::iter::from_fn(|| self.engine.poll()).collect();
        let refused = outputs.iter().find_map(|output| match output {
            Output::Event(event) if event.kind == EventKind::Refused => Some(event.because.clone()),
            _ => None,
        });
        assert_eq!(refused.is_some(), done.is_err(), "{order}: {done:?} {refused:?}");
        if let Err(refusal) = done {
            let reported = refused.expect("a refusal");
            let reported: Vec<&Reason> = reported.iter().collect();
            let why: Vec<&Reason> = refusal.reason.iter().chain(refusal.help.iter()).collect();
            assert_eq!(
                reported.split_first(),
                Some((&&Reason::CannotObey { order: order.clone() }, &why[..]))
            );
            assert_eq!(
                self.engine.standing_orders(),
                before.0,
                "`{order}` was refused and changed something"
            );
        } else if matches!(order, Order::Forbid(_) | Order::Force { .. }) {
            assert_ne!(self.engine.standing_orders(), before.0, "`{order}` was obeyed and is not in force");
            assert!(self.engine.order(order, at).is_err(), "`{order}` can be given twice");
            while self.engine.poll().is_some() {}
        }
        self.reported.extend(outputs);
        self.check();
    }

    fn restart(&mut self, at: Time) {
        let snapshot = self.engine.snapshot();
        let mut engine = Engine::new(self.knowledge.clone(), Options::default());
        engine.restore(&snapshot, at);
        let after = engine.snapshot();
        assert_eq!(after.orders, snapshot.orders);
        let verdicts = |snapshot: &shsa_core::engine::Snapshot| -> Vec<_> {
            snapshot
                .verdicts
                .iter()
                .map(|it| (it.subject.clone(), it.record, it.accusation.clone()))
                .collect()
        };
        assert_eq!(verdicts(&after), verdicts(&snapshot));
        // A source without values may be replaced at once by one that has come back meanwhile.
        for (before, after) in snapshot.needs.iter().zip(&after.needs).filter(|(before, _)| !before.unserved)
        {
            assert_eq!(before.source, after.source, "{snapshot:#?}");
        }
        self.engine = engine;
        self.check();
    }

    /// Checks that no source uses a forbidden element, and that no other source replaces a forced one.
    fn check(&mut self) {
        self.reported.extend(core::iter::from_fn(|| self.engine.poll()));
        let orders = self.engine.standing_orders();
        for need in self.knowledge.needs().ids() {
            let status = self.engine.need_status(need);
            let Some(source) = status.source.as_ref().and_then(ServedBy::way) else { continue };
            let (signals, relations) = source.split_once(" by ").unwrap_or((source, ""));
            for name in signals.split(", ") {
                assert!(
                    !orders.contains(&Order::Forbid(Subject::Signal(name.to_owned()))),
                    "{source}: {orders:?}"
                );
                let signal = self.knowledge.signal(name).expect("the model has it");
                let verdict = self.engine.verdict(signal);
                let is_accused = matches!(verdict, Verdict::Suspect | Verdict::Failed);
                assert!(!is_accused || status.forced.is_some(), "{source} is {verdict:?}");
            }
            for name in relations.split(", ") {
                assert!(
                    !orders.contains(&Order::Forbid(Subject::Relation(name.to_owned()))),
                    "{source}: {orders:?}"
                );
            }
            assert!(status.forced.is_none_or(|forced| forced == source), "{orders:?}");
        }
    }
}

fn run(system: &System, steps: &[Step]) -> Vec<Output> {
    let engine = Engine::new(system.knowledge.clone(), Options::default());
    let mut stage = Stage { knowledge: &system.knowledge, engine, reported: Vec::new() };
    for (second, step) in steps.iter().enumerate() {
        let at = Time(0) + Span::from_millis(1_000 * second as i64);
        match step {
            Step::Order(kind, about, need) => stage.obey(&order(&system.knowledge, *kind, *about, *need), at),
            Step::Restart => stage.restart(at),
            _ => {}
        }
        for mut input in system.inputs(second as u32, 1) {
            if let Input::Observation(Observation { signal, value, .. }) = &mut input {
                let is = |other: &usize| system.knowledge.signals().ids().nth(*other) == Some(*signal);
                match step {
                    Step::Silent(other) if is(other) => continue,
                    Step::Shifted(other, shift) if is(other) => match value {
                        RawValue::Number(number) => *number += shift,
                        RawValue::Vector(numbers) => numbers.iter_mut().for_each(|number| *number += shift),
                        RawValue::Interval { .. } => {}
                    },
                    _ => {}
                }
            }
            stage.give(input);
        }
    }
    stage.reported
}

proptest! {
    #[test]
    fn no_order_lets_a_need_rest_on_what_is_forbidden(which in 0..3_usize, steps in steps()) {
        let system = [crate::models::car, crate::models::climber, crate::models::rover][which]();
        let (one, other) = (run(&system, &steps), run(&system, &steps));
        prop_assert_eq!(one, other);
    }
}

/// The car after some seconds with an offset on a wheel's values.
fn car(seconds: u32, shift: f64) -> (System, Engine) {
    let system = crate::models::car();
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    for mut input in system.inputs(0, seconds) {
        if let Input::Observation(Observation { signal, value: RawValue::Number(number), received, .. }) =
            &mut input
            && *signal == wheel(&system)
            && *received >= Time::from_seconds(1.0)
        {
            *number += shift;
        }
        engine.handle(input);
    }
    while engine.poll().is_some() {}
    (system, engine)
}

fn wheel(system: &System) -> SignalId {
    system.knowledge.signal("wheel_1").expect("the car has a first wheel")
}

#[test]
fn a_restart_is_no_evidence_for_health() {
    let (system, engine) = car(3, 4.0);
    assert_eq!(engine.verdict(wheel(&system)), Verdict::Failed);
    let accusation = engine.accusation(wheel(&system)).unwrap().clone();
    let mut restored = Engine::new(system.knowledge.clone(), Options::default());
    restored.restore(&engine.snapshot(), Time::from_seconds(60.0));
    assert_eq!(restored.verdict(wheel(&system)), Verdict::Failed);
    assert_eq!(restored.accusation(wheel(&system)), Some(&accusation));
    // The wheel is silent, and the others prove nothing about it.
    for input in system.inputs(60, 30) {
        if !matches!(&input, Input::Observation(it) if it.signal == wheel(&system)) {
            restored.handle(input);
        }
    }
    assert_eq!(restored.verdict(wheel(&system)), Verdict::Failed);
    // The wheel agrees with the others for its probation.
    for input in system.inputs(90, 10) {
        restored.handle(input);
    }
    assert_eq!(restored.verdict(wheel(&system)), Verdict::Healthy);
}

#[test]
fn a_clock_that_was_set_back_harms_nobody() {
    let (system, engine) = car(3, 4.0);
    let mut restored = Engine::new(system.knowledge.clone(), Options::default());
    restored.restore(&engine.snapshot(), Time::from_seconds(-3_600.0));
    assert_eq!(restored.verdict(wheel(&system)), Verdict::Failed);
    let needs = restored.snapshot().needs;
    assert!(needs.iter().all(|need| need.switched.is_none_or(|at| at <= Time::from_seconds(-3_600.0))));
}
