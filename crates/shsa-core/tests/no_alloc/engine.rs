//! The engine allocates nothing for an observation without faults, whatever the model.

use crate::models::{self, System};
use shsa_core::engine::{Engine, EventKind, Input, Options, Output};
use shsa_core::knowledge::Id;
use shsa_core::observation::RawValue;

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

#[test]
fn outliers_that_are_no_fault() {
    let system = models::car();
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    handle(&mut engine, system.inputs(0, 10));
    let cost = handle(&mut engine, shifted(system.inputs(10, 30), 1, 50, 100, 5.0));
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
    assert_eq!(found.events, [EventKind::Failed]);
    assert!(found.allocations > 0, "a decision has words");
    let cost = handle(&mut engine, shifted(system.inputs(20, 30), 1, 0, 1, 5.0));
    assert_eq!((cost.allocations, cost.events), (0, vec![]));
    assert!(cost.publications > 2_000);
}
