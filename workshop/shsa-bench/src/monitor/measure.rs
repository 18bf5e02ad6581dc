//! Runs a system and takes the time.

use super::model::System;
use crate::processor::Stopwatch;
use serde_json::{Value, json};
use shsa_core::engine::{Engine, Options};
use shsa_core::knowledge::VariableId;
use shsa_core::monitor::thesis::{ThesisOptions, ThesisRun};
use shsa_core::plan::Graph;
use shsa_core::time::Time;
use std::hint::black_box;

/// Seconds of data before the first measured turn: afterwards all buffers have their full size.
const WARM_UP_S: f64 = 10.0;
/// The number of turns. The fastest counts, as other work on the machine only slows down.
const TURNS: usize = 5;

/// The results for one system.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    /// The name of the system.
    pub(super) case: String,
    /// Ways under comparison, and pairs of them.
    pub(super) ways: usize,
    pub(super) pairs: usize,
    /// Of the fastest turn: observations, their processor time, and the duration of the data.
    pub(super) observations: usize,
    pub(super) seconds: f64,
    pub(super) data_seconds: f64,
}

impl Measured {
    /// Observations a second on one core.
    pub(super) fn rate(&self) -> f64 {
        self.observations as f64 / self.seconds
    }

    /// The load of a core when the data come in real time.
    pub(super) fn share(&self) -> f64 {
        self.seconds / self.data_seconds
    }

    pub(super) fn to_json(&self) -> Value {
        json!({
            "case": self.case,
            "ways": self.ways,
            "pairs": self.pairs,
            "observations": self.observations,
            "seconds": self.seconds,
            "data_seconds": self.data_seconds,
            "observations_per_second": self.rate(),
            "share_of_core": self.share(),
        })
    }
}

/// Runs the engine on a system: takes in every observation, takes out every output. A turn lasts this many seconds of processor
/// time.
pub(super) fn default_mode(case: &str, system: &System, turn_s: f64) -> Measured {
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    let (ways, pairs) = (engine.monitor().ways().len(), engine.monitor().residuals().len());
    let run = |cycle: i64| {
        for input in system.inputs(cycle) {
            engine.handle(input);
            while let Some(output) = engine.poll() {
                black_box(output);
            }
        }
    };
    Measured { case: case.to_owned(), ways, pairs, ..turns(system, turn_s, run) }
}

/// Runs the published method on the first variable of a system, one step a cycle.
pub(super) fn thesis_mode(case: &str, system: &System, turn_s: f64) -> Measured {
    let graph = Graph::new(&system.knowledge);
    let variable = <VariableId as shsa_core::knowledge::Id>::from_index(0);
    let ways = shsa_core::engine::witnesses(&system.knowledge, &graph, variable, 32, |_| true).ways;
    let count = ways.len();
    let mut run = ThesisRun::new(&system.knowledge, ways, ThesisOptions::default());
    let step = |cycle: i64| {
        for sender in &system.senders {
            run.observe(&system.knowledge, &system.observation(sender, cycle));
        }
        black_box(run.step(Time((cycle + 1) * system.cycle.0)));
    };
    let pairs = count * count.saturating_sub(1) / 2;
    Measured { case: case.to_owned(), ways: count, pairs, ..turns(system, turn_s, step) }
}

/// Runs cycles for `turn_s` seconds, several times.
fn turns(system: &System, turn_s: f64, mut run: impl FnMut(i64)) -> Measured {
    let cycle_s = system.cycle.seconds();
    let mut cycle = 0;
    let mut next = || {
        run(cycle);
        cycle += 1;
    };
    (0..(WARM_UP_S / cycle_s).ceil() as u64).for_each(|_| next());
    // A batch has so many cycles that reading the clock does not matter.
    let batch = (2_000 / system.senders.len()).max(1);
    let mut turn = || {
        let (watch, mut cycles) = (Stopwatch::start(), 0);
        while watch.seconds() < turn_s {
            (0..batch).for_each(|_| next());
            cycles += batch;
        }
        (watch.seconds() / cycles as f64, cycles)
    };
    let fastest = (0..TURNS).map(|_| turn()).min_by(|one, other| one.0.total_cmp(&other.0));
    let (each_s, cycles) = fastest.unwrap_or((f64::NAN, 0));
    Measured {
        case: String::new(),
        ways: 0,
        pairs: 0,
        observations: cycles * system.senders.len(),
        seconds: each_s * cycles as f64,
        data_seconds: cycle_s * cycles as f64,
    }
}
