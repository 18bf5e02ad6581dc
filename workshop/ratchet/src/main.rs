//! Gives an engine a fixed number of observations, or makes a fixed number of searches, so that the instructions for each can be
//! counted from outside: `tests/ceilings.rs` runs it under valgrind. The counted part is in functions whose names begin with
//! `drive`.

#[path = "../../../crates/shsa-core/tests/models/mod.rs"]
mod models;
#[path = "../../../crates/shsa-core/tests/models/plant.rs"]
mod plant;
#[path = "../../../crates/shsa-core/tests/plan_support/generated.rs"]
#[allow(dead_code, clippy::indexing_slicing, reason = "what tests and benchmarks use")]
mod generated;
mod planning;

use models::{Sensor, System};
use shsa_core::engine::{Engine, Input, Options};
use shsa_core::knowledge::Draft;
use shsa_core::observation::RawValue;
use std::hint::black_box;
use std::io::Write;

/// Feeds all and takes what comes out, as a bridge does.
#[inline(never)]
fn drive(engine: &mut Engine, inputs: Vec<Input>) {
    for input in inputs {
        engine.handle(input);
        while let Some(output) = engine.poll() {
            black_box(output);
        }
    }
}

/// One variable that is carried by this many signals.
fn many(count: usize) -> System {
    let names: &'static [String] = (0..count).map(|at| format!("s{at}")).collect::<Vec<_>>().leak();
    let sensor = |name: &'static String| -> Sensor<'static> { (name, "x", "10 Hz", "0.1", "0 ms") };
    let draft = Draft {
        variables: vec![models::variable("x", "1", "scalar", "1")],
        signals: models::sensors(&names.iter().map(sensor).collect::<Vec<_>>()),
        ..Draft::default()
    };
    let truth = |_: usize, seconds: f64| RawValue::Number(1.0 + 0.5 * (seconds / 8.0).sin());
    System { knowledge: models::built(&draft), truth }
}

/// A system, the seconds before the count, and those that are counted.
fn case(name: &str) -> Option<(System, u32, u32)> {
    Some(match name {
        "generic" => (plant::generic(), 20, 500),
        "car" => (models::car(), 5, 5),
        "climber" => (models::climber(), 10, 20),
        "rover" => (models::rover(), 2, 2),
        "plant" => (plant::plant(), 1, 1),
        "many" => (many(10_000), 2, 1),
        _ => return None,
    })
}

fn main() -> std::io::Result<()> {
    let name = std::env::args().nth(1).unwrap_or_default();
    if let Some(count) = name.strip_prefix("plan ").and_then(planning::run) {
        return writeln!(std::io::stdout(), "{count}");
    }
    let Some((system, before_s, counted_s)) = case(&name) else {
        return writeln!(
            std::io::stderr(),
            "usage: instructions generic|car|climber|rover|plant|many|'plan MODEL COUNT bare|without|under'"
        );
    };
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    for input in system.inputs(0, before_s) {
        engine.handle(input);
        while engine.poll().is_some() {}
    }
    let inputs = system.inputs(before_s, counted_s);
    let count = inputs.len();
    drive(&mut engine, inputs);
    writeln!(std::io::stdout(), "{count}")
}
