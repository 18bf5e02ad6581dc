//! The engine allocates nothing for an observation without faults, whatever the model.

use crate::models::{self, System};
use shsa_core::engine::{Engine, EventKind, Input, Options, Output};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{
    Asked, Condition, Contract, Contracts, EvidenceSource, Given, Id, IdVec, Measure, Party, Policy, Subject,
    Watched,
};
use shsa_core::observation::RawValue;
use shsa_core::statement::{Level, Statement};

/// The cost and the outputs of a run.
#[derive(Debug, Default, PartialEq)]
struct Cost {
    observations: usize,
    allocations: u64,
    publications: usize,
    events: Vec<EventKind>,
}

fn handle(engine: &mut Engine, inputs: Vec<Input>) -> Cost {
    let mut cost = Cost { observations: inputs.len(), ..Cost::default() };
    let counted = allocation_counter::measure(|| {
        for input in inputs {
            engine.handle(input);
            while let Some(output) = engine.poll() {
                match output {
                    Output::Publication(_) => cost.publications += 1,
                    Output::Event(event) => cost.events.push(event.kind),
                    Output::Task { .. } | Output::Reloaded(_) => {}
                }
            }
        }
    });
    cost.allocations = counted.count_total;
    cost
}

/// Adds an offset to the `n`th of every `of` values of a signal.
fn shifted(mut inputs: Vec<Input>, signal: usize, n: usize, of: usize, shift: f64) -> Vec<Input> {
    let own = inputs.iter_mut().filter_map(|input| match input {
        Input::Observation(observation) if observation.signal.index() == signal => {
            Some(&mut observation.value)
        }
        _ => None,
    });
    for value in own.skip(n).step_by(of) {
        if let RawValue::Number(number) = value {
            *number += shift;
        }
    }
    inputs
}

/// Half a minute after ten seconds: the number of observations, the least number of publications, no allocation, no event.
#[track_caller]
fn check(system: &System, observations: usize, publications: usize) {
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    let start = handle(&mut engine, system.inputs(0, 10));
    assert_eq!(start.events, []);
    let cost = handle(&mut engine, system.inputs(10, 30));
    assert!(cost.publications >= publications, "{cost:?}");
    let publications = cost.publications;
    assert_eq!(cost, Cost { observations, allocations: 0, publications, events: vec![] });
}

#[test]
fn a_car() {
    check(&models::car(), 10_260, 2_000);
}

#[test]
fn derivatives_and_last_values() {
    check(&models::climber(), 2_400, 1_000);
}

#[test]
fn vectors() {
    check(&models::rover(), 1_725, 290);
}

#[test]
fn a_variable_that_is_learned() {
    check(&crate::cell::cell(), 810, 290);
}

#[test]
fn three_signals_of_one_variable() {
    check(&crate::plant::generic(), 90, 0);
}

/// A tenth of the time of the others, because of the number of signals.
#[test]
fn ten_thousand_signals() {
    let system = crate::plant::plant();
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    assert_eq!(handle(&mut engine, system.inputs(0, 2)).events, []);
    let cost = handle(&mut engine, system.inputs(2, 3));
    assert_eq!(cost, Cost { observations: 300_000, ..Cost::default() });
}

/// A contract that demands nothing and guarantees nothing yet.
fn contract(name: &str, subject: Subject) -> Contract {
    Contract {
        name: name.to_owned(),
        subject,
        runs_on: None,
        gives: Vec::new(),
        asks: Vec::new(),
        evidence: Vec::new(),
        policy: Policy::default(),
    }
}

/// The car under contract: each sensor gives its speed at ASIL B while its newest value is at most 0.3 s old, and the need
/// demands that.
fn car_under_contract() -> System {
    let car = models::car();
    let scale = Contracts::default().scales().named("asil").unwrap();
    let speed = || Statement {
        service: "speed".to_owned(),
        level: Some(Level { scale, rank: 3 }),
        properties: Vec::new(),
    };
    let fresh = |signal| Watched {
        name: "fresh".to_owned(),
        source: EvidenceSource::Signal(signal, Measure::Age),
        within: Some(Interval::new(0.0, 0.3)),
        max_age: None,
    };
    let mut rows = IdVec::new();
    for (id, signal) in car.knowledge.signals().enumerate() {
        rows.push(Contract {
            evidence: vec![fresh(id)],
            gives: vec![Given {
                name: "speed".to_owned(),
                statement: speed(),
                when: Condition::Watched(0),
                redundant: None,
            }],
            ..contract(&signal.name, Subject::Signal(id))
        });
    }
    let need = car.knowledge.needs().ids().next().unwrap();
    let of = Party::Provider(car.knowledge.variable("speed").unwrap());
    let asks = vec![Asked { name: "speed".to_owned(), statement: speed(), of }];
    rows.push(Contract { asks, ..contract("display", Subject::Need(need)) });
    System { knowledge: car.knowledge.clone().with_contracts(Contracts::new(rows)), ..car }
}

#[test]
fn a_car_under_contract() {
    check(&car_under_contract(), 10_260, 2_000);
}

#[test]
fn outliers_that_are_no_fault() {
    let system = models::car();
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    handle(&mut engine, system.inputs(0, 10));
    let found = handle(&mut engine, shifted(system.inputs(10, 30), 1, 50, 100, 5.0));
    assert_eq!(found.events, [EventKind::Outlier; 4], "then no more than one a minute");
    let cost = handle(&mut engine, shifted(system.inputs(40, 15), 1, 50, 100, 5.0));
    assert_eq!((cost.allocations, cost.events), (0, vec![]));
}

#[test]
fn a_need_that_nothing_serves() {
    let mut draft = models::car_draft();
    draft.needs[0].max_width = Some(models::text("1 mm/s"));
    let system = System { knowledge: models::built(&draft), ..models::car() };
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    assert_eq!(handle(&mut engine, system.inputs(0, 10)).events, [EventKind::Refused, EventKind::Unhealable]);
    let cost = handle(&mut engine, system.inputs(10, 30));
    assert_eq!((cost.allocations, cost.publications, cost.events), (0, 0, vec![]));
}

#[test]
fn a_fault_that_is_known() {
    let system = models::car();
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    handle(&mut engine, system.inputs(0, 10));
    let found = handle(&mut engine, shifted(system.inputs(10, 10), 1, 0, 1, 5.0));
    assert_eq!(found.events, [EventKind::Outlier, EventKind::Failed]);
    assert!(found.allocations > 0, "a decision has words");
    let cost = handle(&mut engine, shifted(system.inputs(20, 30), 1, 0, 1, 5.0));
    assert_eq!((cost.allocations, cost.events), (0, vec![]));
    assert!(cost.publications > 2_000);
}
