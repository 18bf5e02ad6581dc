//! Events are true when they are reported: no silent signal is restored, no need goes back to a silent source, and no event
//! claims an order that nobody gave.

use crate::models::System;
use proptest::prelude::*;
use shsa_core::engine::{Engine, Event, EventKind, Input, Options, Order, Output, Subject};
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::reason::{Reason, ServedBy};
use shsa_core::time::{Span, Time};

/// A part of a run: its length in steps of 100 ms, and the signals that are silent, invalid, or offset, one bit for each.
#[derive(Clone, Debug)]
struct Phase {
    steps: u8,
    silent: u8,
    invalid: u8,
    shifted: u8,
    by: f64,
    /// An operator's order about this signal: forbid, allow, force, or release.
    order: Option<(usize, u8)>,
    /// Whether the process is killed first, and goes on from its last state.
    is_restart: bool,
}

/// The reasons that name an operator's order.
const ORDERED: [&str; 9] = [
    "better-allowed",
    "chooses-itself",
    "cleared",
    "cleared-with",
    "may-be-used",
    "must-not-be-used",
    "no-value-from",
    "only-by-order",
    "was-cleared",
];

const STEP: Span = Span::from_millis(100);

fn phases(are_orders: bool) -> impl Strategy<Value = Vec<Phase>> {
    // No signal, all signals, or some.
    let who = || prop_oneof![4 => Just(0_u8), 2 => Just(u8::MAX), 3 => any::<u8>()];
    let order = prop::option::weighted(0.3, (0..5_usize, 0..4_u8));
    let order = order.prop_map(move |order| order.filter(|_| are_orders));
    let invalid = prop_oneof![6 => Just(0_u8), 1 => any::<u8>()];
    let restart = prop::bool::weighted(0.1);
    let phase = (1..60_u8, who(), invalid, who(), -9.0..9.0, order, restart).prop_map(
        |(steps, silent, invalid, shifted, by, order, is_restart)| Phase {
            steps,
            silent,
            invalid,
            shifted,
            by,
            order,
            is_restart,
        },
    );
    prop::collection::vec(phase, 1..10)
}

struct Run<'s> {
    knowledge: &'s KnowledgeBase,
    engine: Engine,
    reported: Vec<Event>,
}

impl Run<'_> {
    fn give(&mut self, input: Input) {
        while let Some(due) = self.engine.next_deadline().filter(|due| *due < input.time()) {
            self.engine.handle(Input::Tick(due));
            self.receive();
        }
        self.engine.handle(input);
        self.receive();
    }

    fn receive(&mut self) {
        while let Some(output) = self.engine.poll() {
            if let Output::Event(event) = output {
                self.check(&event);
                self.reported.push(event);
            }
        }
    }

    fn check(&self, event: &Event) {
        if event.kind != EventKind::Restored {
            return;
        }
        let silent = |signal: &SignalId| self.engine.absence(*signal).is_some();
        let name = |signal: SignalId| &self.knowledge.signals()[signal].name;
        if let Some(signal) = event.signal.filter(silent) {
            panic!("{} is restored and silent: {event:?} after {:#?}", name(signal), self.reported);
        }
        let Some(source) = event.substitution.as_ref().and_then(ServedBy::way) else { return };
        let signals = source.split_once(" by ").map_or(source, |(signals, _)| signals);
        let mut signals = signals.split(", ").filter_map(|name| self.knowledge.signal(name));
        if let Some(signal) = signals.find(silent) {
            let reported = &self.reported;
            panic!("a need is restored to {}, which is silent: {event:?} after {reported:#?}", name(signal));
        }
    }
}

fn run(system: &System, phases: &[Phase]) -> Vec<Event> {
    let engine = Engine::new(system.knowledge.clone(), Options::default());
    let mut run = Run { knowledge: &system.knowledge, engine, reported: Vec::new() };
    let steps: u32 = phases.iter().map(|phase| u32::from(phase.steps)).sum();
    let mut inputs = system.inputs(0, steps / 10 + 1).into_iter().peekable();
    let mut until = Time(0);
    for phase in phases {
        if phase.is_restart {
            let snapshot = run.engine.snapshot();
            run.engine = Engine::new(system.knowledge.clone(), Options::default());
            run.engine.restore(&snapshot, until);
            run.receive();
        }
        if let Some((signal, kind)) = phase.order {
            let names: Vec<_> = system.knowledge.signals().iter().map(|signal| signal.name.clone()).collect();
            let name = names[signal % names.len()].clone();
            let need = system.knowledge.needs().iter().next().unwrap().signal.clone();
            let order = match kind {
                0 => Order::Forbid(Subject::Signal(name)),
                1 => Order::Allow(Subject::Signal(name)),
                2 => Order::Force { need, source: name },
                _ => Order::Release(need),
            };
            // Some orders are refused.
            let _ = run.engine.order(&order, until);
            run.receive();
        }
        until = until + STEP.times(i64::from(phase.steps));
        while let Some(mut input) = inputs.next_if(|input| input.time() < until) {
            let Input::Observation(Observation { signal, value, .. }) = &mut input else { continue };
            let at = system.knowledge.signals().ids().position(|id| id == *signal).unwrap();
            let is = |who: u8| who >> (at % 8) & 1 == 1;
            if is(phase.silent) {
                continue;
            }
            match value {
                RawValue::Number(number) => {
                    *number += if is(phase.shifted) { phase.by } else { 0.0 };
                    *number = if is(phase.invalid) { f64::NAN } else { *number };
                }
                RawValue::Vector(numbers) if is(phase.shifted) => {
                    numbers.iter_mut().for_each(|number| *number += phase.by);
                }
                _ => {}
            }
            run.give(input);
        }
        run.give(Input::Tick(until));
    }
    run.reported
}

fn system(which: usize) -> System {
    [crate::models::car, crate::models::climber, crate::models::rover][which]()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn nobody_is_restored_who_is_silent(which in 0..3_usize, phases in phases(true)) {
        drop(run(&system(which), &phases));
    }

    #[test]
    fn nobody_has_ordered_what_nobody_has_ordered(which in 0..3_usize, phases in phases(false)) {
        for event in run(&system(which), &phases) {
            let codes: Vec<&str> = event.because.iter().map(Reason::code).collect();
            prop_assert!(!codes.iter().any(|code| ORDERED.contains(code)), "{:?}", event);
        }
    }
}

/// An operator may tie a need to a silent signal: the need is not served, and this is reported.
#[test]
fn a_need_that_is_tied_to_a_silent_signal_is_not_restored() {
    let system = crate::models::car();
    let engine = Engine::new(system.knowledge.clone(), Options::default());
    let mut run = Run { knowledge: &system.knowledge, engine, reported: Vec::new() };
    for input in system.inputs(0, 4) {
        let is_silent = |signal| system.knowledge.signals()[signal].name == "wheel_1";
        let is_over = input.time() > Time::from_seconds(1.0);
        if !matches!(&input, Input::Observation(it) if is_over && is_silent(it.signal)) {
            run.give(input);
        }
    }
    run.reported.clear();
    let need = system.knowledge.needs().iter().next().unwrap().signal.clone();
    let order = Order::Force { need, source: "wheel_1".to_owned() };
    run.engine.order(&order, Time::from_seconds(4.0)).unwrap();
    run.receive();
    let codes = |event: &Event| event.because.iter().map(Reason::code).collect::<Vec<_>>();
    let reported: Vec<_> = run.reported.iter().map(|event| (event.kind, codes(event))).collect();
    assert_eq!(reported, [(EventKind::Unhealable, vec!["only-by-order", "before", "inputs-absent"])]);
}
