//! The saved state: any text as one; a state that was read can be written and read again, and an engine that continues from it
//! keeps its promises.

use crate::engine::{MODELS, Run, inputs};
use shsa_core::engine::{Engine, Options};
use shsa_core::time::Time;
use shsa_format::state::{read_state, write_state};

/// After the restart: healthy, one wrong, healthy.
const STEPS: [[u8; 4]; 3] = [[255, 5, 144, 144], [160, 5, 144, 240], [255, 5, 144, 144]];

/// Reads the text as a state of a model of all corner cases, then of a car.
///
/// # Panics
/// When a written state is read differently, or the engine breaks a promise.
pub fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(snapshot) = read_state(text) else { return };
    let written = write_state(&snapshot);
    let again = read_state(&written).expect("it was written by us");
    assert_eq!(write_state(&again), written, "another state after it was written");
    for knowledge in &MODELS[..2] {
        let mut engine = Engine::new(knowledge.clone(), Options::default());
        engine.restore(&snapshot, Time::default());
        assert!(read_state(&write_state(&engine.snapshot())).is_ok(), "a state that cannot be read");
        Run::new(knowledge, engine, Time::default()).through(&inputs(knowledge, STEPS.as_flattened()));
    }
}

/// States of engines: at the beginning, after a wrong value, and after an order.
#[must_use]
pub fn seeds() -> Vec<Vec<u8>> {
    let well = [255, 5, 144, 144];
    let steps: [&[[u8; 4]]; 3] =
        [&[], &[well, [160, 5, 144, 240], [160, 5, 144, 240]], &[well, [128, 5, 0, 2], [129, 5, 3, 0]]];
    let state = |knowledge: &shsa_core::knowledge::KnowledgeBase, steps: &[[u8; 4]]| {
        let mut engine = Engine::new(knowledge.clone(), Options::default());
        inputs(knowledge, steps.as_flattened()).into_iter().for_each(|input| engine.handle(input));
        write_state(&engine.snapshot()).into_bytes()
    };
    MODELS[..2].iter().flat_map(|knowledge| steps.map(|steps| state(knowledge, steps))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seeds_are_states_that_say_something() {
        let states: Vec<_> =
            seeds().iter().map(|seed| read_state(std::str::from_utf8(seed).unwrap()).unwrap()).collect();
        assert!(states.iter().any(|state| state.verdicts.iter().any(|verdict| verdict.accusation.is_some())));
        assert!(states.iter().any(|state| !state.orders.is_empty()));
        assert!(states.iter().all(|state| !state.needs.is_empty()));
    }
}
