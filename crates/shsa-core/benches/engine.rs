//! The cost of an observation in the engine without faults, on three systems.
//!
//! Instructions: `valgrind --tool=callgrind --toggle-collect='engine::drive' BENCH --bench --test car`.
#![allow(missing_docs, reason = "criterion_group! makes a public function without documentation")]

#[path = "../tests/models/mod.rs"]
mod models;

use core::hint::black_box;
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use models::System;
use shsa_core::engine::{Engine, Input, Options};

/// How many seconds each system is driven at once.
const SECONDS: u32 = 10;

/// Handles all inputs and takes the outputs, as a bridge does.
#[inline(never)]
fn drive(engine: &mut Engine, inputs: Vec<Input>) {
    for input in inputs {
        engine.handle(input);
        while let Some(output) = engine.poll() {
            black_box(output);
        }
    }
}

fn observations(c: &mut Criterion, name: &str, system: &System) {
    let mut engine = Engine::new(system.knowledge.clone(), Options::default());
    system.inputs(0, SECONDS).into_iter().for_each(|input| engine.handle(input));
    let mut from_s = 0;
    let mut next = || {
        from_s += SECONDS;
        system.inputs(from_s, SECONDS)
    };
    let mut group = c.benchmark_group("observations");
    group.throughput(Throughput::Elements(system.inputs(0, SECONDS).len() as u64));
    group.bench_function(name, |b| {
        b.iter_batched(&mut next, |inputs| drive(&mut engine, inputs), BatchSize::LargeInput)
    });
    group.finish();
}

fn engines(c: &mut Criterion) {
    observations(c, "car", &models::car());
    observations(c, "climber", &models::climber());
    observations(c, "rover", &models::rover());
}

criterion_group!(benches, engines);
criterion_main!(benches);
