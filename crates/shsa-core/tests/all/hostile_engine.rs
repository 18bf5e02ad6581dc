//! The engine under inputs that no sensor sends: it does not panic, comes to rest, is reproducible, and does not grow.

use crate::models::System;
use proptest::prelude::*;
use shsa_core::engine::{Engine, Input, Options, Output};
use shsa_core::knowledge::{Id, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::reason::ServedBy;
use shsa_core::time::Time;

fn observation(signal: usize, stamp: i64, received: i64, value: RawValue) -> Input {
    let (stamp, received) = (Time(stamp), Time(received));
    Input::Observation(Observation { signal: SignalId::from_index(signal), stamp, received, value })
}

/// The outputs of the engine; after each input, the number of due ticks is bounded.
fn stated(engine: &mut Engine, inputs: impl IntoIterator<Item = Input>) -> Vec<Output> {
    let (mut outputs, mut now) = (Vec::new(), Time::MIN);
    for input in inputs {
        now = now.max(input.time());
        engine.handle(input);
        for ticks in 0.. {
            outputs.extend(core::iter::from_fn(|| engine.poll()));
            let Some(due) = engine.next_deadline().filter(|due| *due <= now || ticks < 3) else { break };
            assert!(ticks < 64, "still due at {due:?}, it is {now:?}");
            now = now.max(due);
            engine.handle(Input::Tick(due));
        }
    }
    outputs
}

fn times() -> impl Strategy<Value = i64> {
    let usual = 0..10_000_000_000_i64;
    prop_oneof![4 => usual, 1 => any::<i64>(), 1 => prop::sample::select(vec![i64::MIN, -1, 0, i64::MAX - 1, i64::MAX])]
}

fn values() -> impl Strategy<Value = RawValue> {
    let number = || prop_oneof![Just(14.0), any::<f64>(), Just(f64::NAN), Just(f64::INFINITY)];
    prop_oneof![
        3 => number().prop_map(RawValue::Number),
        1 => (number(), number()).prop_map(|(lo, hi)| RawValue::Interval { lo, hi }),
        2 => prop::collection::vec(number(), 0..300).prop_map(RawValue::Vector),
    ]
}

fn inputs() -> impl Strategy<Value = Vec<Input>> {
    let observed = (0..8_usize, times(), times(), any::<bool>(), values()).prop_map(
        |(signal, stamp, received, is_live, value)| {
            observation(signal, if is_live { received } else { stamp }, received, value)
        },
    );
    prop::collection::vec(
        prop_oneof![6 => observed, 1 => times().prop_map(|time| Input::Tick(Time(time)))],
        1..60,
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_inputs_repeat_and_come_to_rest(inputs in inputs(), seconds in 0..3_u32) {
        for system in [crate::models::car(), crate::models::climber(), crate::models::rover()] {
            let inputs = || system.inputs(0, seconds).into_iter().chain(inputs.clone());
            let run = || stated(&mut Engine::new(system.knowledge.clone(), Options::default()), inputs());
            prop_assert_eq!(format!("{:?}", run()), format!("{:?}", run()));
        }
    }
}

/// Values of every kind, in and out of order, with conflicts and silences, for ten seconds.
fn mess(system: &System, round: u32) -> Vec<Input> {
    let count = system.knowledge.signals().len();
    let from_ns = i64::from(round) * 10_000_000_000;
    let one = |step: i64| {
        let received = from_ns + step * 1_000_000;
        let phases = [14.0, 14.0, -3.0, f64::NAN, 1e300];
        let number = phases.get(step as usize / 700 % 5).copied().unwrap_or(14.0);
        let value = match step % 7 {
            0 => RawValue::Vector(vec![number; 40 + step as usize % 50]),
            1 => RawValue::Interval { lo: number, hi: 15.0 },
            2 => RawValue::Vector(vec![number; 480]),
            _ => RawValue::Number(number),
        };
        observation(step as usize % (count + 1), received - step * 7919 % 300_000_000, received, value)
    };
    (0..10_000).filter(|step| step / 1_000 % 4 != 3).map(one).collect()
}

#[test]
fn memory_does_not_grow() {
    for system in [crate::models::car(), crate::models::climber(), crate::models::rover()] {
        let mut engine = Engine::new(system.knowledge.clone(), Options::default());
        let (mut kept, mut events) = (Vec::new(), 0);
        for round in 0..6 {
            let inputs = mess(&system, round);
            let counted = allocation_counter::measure(|| {
                for input in inputs.iter().cloned() {
                    engine.handle(input);
                    while let Some(output) = engine.poll() {
                        events += usize::from(matches!(output, Output::Event(_)));
                    }
                }
            });
            kept.push(counted.bytes_current);
        }
        assert!(events > 0, "a mess without an event");
        let grown: i64 = kept.iter().skip(2).sum();
        assert!(grown.abs() < 4_096, "bytes kept of each round: {kept:?}");
    }
}

#[test]
fn a_vector_of_a_million_elements_is_no_value() {
    let system = crate::models::rover();
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    stated(&mut engine, system.inputs(0, 2));
    let long = observation(0, 2_000_000_000, 2_000_000_000, RawValue::Vector(vec![1.0; 1_000_000]));
    let counted = allocation_counter::measure(|| engine.handle(long));
    assert!(counted.bytes_max < 1 << 20, "{counted:?}");
    assert_eq!(engine.monitor().ports()[SignalId::from_index(0)].counts().invalid, 1);
}

#[test]
fn memory_is_as_large_as_the_vectors() {
    let counted = allocation_counter::measure(|| {
        let system = crate::models::rover();
        let mut engine = Engine::new(system.knowledge.clone(), Options::default());
        stated(&mut engine, system.inputs(0, 2));
    });
    assert!(counted.bytes_max < 1 << 20, "{counted:?}");
}

#[test]
fn a_source_that_falls_silent_again_in_its_probation_is_left() {
    let system = crate::models::car();
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    let mut source = |inputs: Vec<Input>| {
        inputs.into_iter().for_each(|input| engine.handle(input));
        system.knowledge.needs().ids().find_map(|need| engine.need_status(need).source)
    };
    let tick = |seconds| vec![Input::Tick(Time::from_seconds(seconds))];
    let is_first = |input: &Input| match input {
        Input::Observation(observation) => observation.signal.index() == 0,
        _ => false,
    };
    assert!(source(system.inputs(0, 2)).is_some());
    assert_eq!(source(tick(4.0)), None);
    let again = system.inputs(4, 1).into_iter().filter(is_first);
    assert_eq!(source(again.chain(tick(5.0)).collect()).as_ref().and_then(ServedBy::way), Some("wheel_1"));
    assert_eq!(source(tick(7.0)), None);
}
