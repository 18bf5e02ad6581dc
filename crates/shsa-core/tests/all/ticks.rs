//! Recorded and live runs give an engine the same ticks, so that their outputs are equal.

use crate::models::System;
use proptest::prelude::*;
use shsa_core::engine::{Engine, Input, Options, Ticks};
use shsa_core::knowledge::Id;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};

/// An engine and all its outputs.
struct Driven {
    engine: Engine,
    output: Vec<String>,
}

impl Driven {
    fn new(system: &System) -> Driven {
        Driven { engine: Engine::new(system.knowledge.clone(), Options::default()), output: Vec::new() }
    }

    fn pass(&mut self, mut ticks: Ticks) {
        while let Some(due) = ticks.next(&self.engine) {
            self.give(Input::Tick(due));
        }
    }

    fn give(&mut self, input: Input) {
        self.engine.handle(input);
        self.output.extend(core::iter::from_fn(|| self.engine.poll()).map(|it| format!("{it:?}")));
    }
}

/// Eight seconds, in which one signal falls silent and another one has an offset.
fn inputs(system: &System, silent: usize, wrong: usize, shift: f64) -> Vec<Input> {
    let mut inputs = system.inputs(0, 8);
    let breaks = Time::from_seconds(3.0);
    inputs.retain(|input| match input {
        Input::Observation(it) => it.signal.index() != silent || it.received < breaks,
        _ => true,
    });
    for input in &mut inputs {
        let Input::Observation(it) = input else { continue };
        if it.signal.index() == wrong && it.received >= breaks {
            match &mut it.value {
                RawValue::Number(value) => *value += shift,
                RawValue::Interval { lo, hi } => (*lo, *hi) = (*lo + shift, *hi + shift),
                RawValue::Vector(values) => values.iter_mut().for_each(|value| *value += shift),
            }
        }
    }
    inputs
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn whenever_a_run_wakes_it_says_the_same(
        which in 0..3_usize,
        (silent, wrong) in (0..8_usize, 0..8_usize),
        shift in -6.0..6.0_f64,
        wakes in prop::collection::vec(0..8_000_i64, 0..40),
    ) {
        let system = [crate::models::car, crate::models::climber, crate::models::rover][which]();
        let inputs = inputs(&system, silent, wrong, shift);
        let end = Time::from_seconds(10.0);
        let mut recorded = Driven::new(&system);
        for input in inputs.clone() {
            recorded.pass(Ticks::before(input.time()));
            recorded.give(input);
        }
        recorded.pass(Ticks::before(end));

        // A live run handles the inputs so far, and wakes in between, on time or too late.
        let mut wakes: Vec<Time> = wakes.into_iter().map(|ms| Time(ms * 1_000_000 + 7)).collect();
        wakes.sort_unstable();
        let mut live = Driven::new(&system);
        for together in inputs.chunk_by(|one, next| one.time() == next.time()) {
            let now = together[0].time();
            for wake in wakes.iter().filter(|wake| **wake < now && **wake > now - Span::from_millis(5)) {
                live.pass(Ticks::up_to(*wake));
            }
            for input in together {
                live.pass(Ticks::before(now));
                live.give(input.clone());
            }
        }
        live.pass(Ticks::before(end));
        prop_assert_eq!(recorded.output, live.output);
    }
}
