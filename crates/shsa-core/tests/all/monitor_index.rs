//! The monitor's indices give the same pairs as a search of all of them.

use crate::models::System;
use proptest::prelude::*;
use shsa_core::engine::{Engine, Input, Options};
use shsa_core::knowledge::Id;
use shsa_core::monitor::{Monitor, Residual, ResidualState};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;

fn check(monitor: &Monitor, now: Time, signals: usize) {
    let is_open = |pair: &&Residual| {
        matches!(pair.residual_state(now), ResidualState::Undecided | ResidualState::Conflict)
            || pair.is_building()
    };
    let key = |pair: &Residual| (pair.way, pair.other);
    let open: Vec<_> = monitor.residuals().iter().filter(is_open).map(key).collect();
    let found: Vec<_> = monitor.restless().filter(is_open).map(key).collect();
    assert_eq!(open, found);
    for signal in (0..signals).map(Id::from_index) {
        let of = monitor.residuals().iter().filter(|pair| pair.signals.contains(signal));
        assert!(of.map(key).eq(monitor.pairs_of(signal).map(key)));
    }
}

/// Adds an offset to the values of a signal in some of the seconds.
fn disturbed(system: &System, signal: usize, shift: f64, seconds: &[u32]) -> Vec<Input> {
    let mut inputs = system.inputs(0, 12);
    for input in &mut inputs {
        let Input::Observation(observation) = input else { continue };
        let is_hit = seconds.contains(&((observation.stamp.0 / 1_000_000_000) as u32));
        if let (true, RawValue::Number(number)) =
            (is_hit && observation.signal.index() == signal, &mut observation.value)
        {
            *number += shift;
        }
    }
    inputs
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn nothing_that_disagrees_is_missed(
        which in 0..3_usize,
        signal in 0..5_usize,
        shift in -6.0..6.0_f64,
        seconds in prop::collection::vec(0..12_u32, 0..6),
    ) {
        let system = [crate::models::car, crate::models::climber, crate::models::rover][which]();
        let signals = system.knowledge.signals().len();
        let mut engine = Engine::new(system.knowledge.clone(), Options::default());
        for (number, input) in disturbed(&system, signal, shift, &seconds).into_iter().enumerate() {
            let now = input.time();
            engine.handle(input);
            while engine.poll().is_some() {}
            if number % 7 == 0 {
                check(engine.monitor(), now, signals);
            }
        }
    }
}
