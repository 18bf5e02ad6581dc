//! The cost of sealing a record of a journal: less than 1 us, also where the processor has no instructions for the hash.
#![allow(missing_docs, reason = "criterion_group! makes a public function without documentation")]

use core::hint::black_box;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use shsa_format::journal::seal::Seal;

/// A record as of a drive with time stamps of the wall clock.
const RECORD: &str =
    r#"{"signal":12,"time_ns":1700000000123456789,"received_ns":1700000000123556789,"value":12.375}"#;

fn write(c: &mut Criterion) {
    let mut group = c.benchmark_group("seal");
    for records in [1, 16, 1024] {
        let lines = format!("{RECORD}\n").repeat(records).into_bytes();
        group.throughput(Throughput::Elements(records as u64));
        group.bench_with_input(BenchmarkId::from_parameter(records), &lines, |b, lines| {
            let (mut seal, mut written) = (Seal::default(), Vec::new());
            b.iter(|| {
                written.clear();
                seal = black_box(seal).write(black_box(lines), &mut written);
            });
        });
    }
}

criterion_group!(seal, write);
criterion_main!(seal);
