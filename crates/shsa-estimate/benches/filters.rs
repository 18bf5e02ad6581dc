//! The time of a filter's step and of the same step written by hand, in one run: only the ratios are meaningful.
#![allow(missing_docs, reason = "criterion_group! makes a public function without documentation")]

mod steps;

use criterion::{Criterion, criterion_group, criterion_main};

fn filters(c: &mut Criterion) {
    let names = steps::STEPS.into_iter().flat_map(|(ours, by_hand)| [Some(ours), by_hand]);
    for name in names.flatten() {
        if let Some(mut step) = steps::step(name) {
            c.bench_function(name, |b| b.iter(&mut step));
        }
    }
}

criterion_group!(benches, filters);
criterion_main!(benches);
