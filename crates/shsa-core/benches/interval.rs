//! The cost of intervals compared with plain numbers: three formulas over 10,000 argument triples, too many for branch prediction
//! to learn the rounding of each.
#![allow(missing_docs, reason = "criterion_group! makes a public function without documentation")]

use core::hint::black_box;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use shsa_core::interval::Interval;

const COUNT: usize = 10_000;

/// Arguments around 1 to 3, of both signs in `x`, none of them round.
fn numbers() -> Vec<[f64; 3]> {
    let part = |k: usize, step: f64| (k as f64 * step).fract();
    (0..COUNT).map(|k| [part(k, 0.618) * 6.0 - 3.0, 1.0 + part(k, 0.414), 1.0 + part(k, 0.732)]).collect()
}

fn compare(
    c: &mut Criterion,
    name: &str,
    plain: impl Fn(f64, f64, f64) -> f64,
    interval: impl Fn(Interval, Interval, Interval) -> Interval,
) {
    let numbers = numbers();
    let points: Vec<_> = numbers.iter().map(|values| values.map(Interval::point)).collect();
    let wide: Vec<_> = points.iter().map(|values| values.map(|x| x.widened(0.013))).collect();
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Elements(COUNT as u64));
    group.bench_function("f64", |b| {
        b.iter(|| {
            for &[x, y, z] in black_box(&numbers) {
                black_box(plain(x, y, z));
            }
        })
    });
    for (kind, arguments) in [("points", &points), ("intervals", &wide)] {
        group.bench_function(kind, |b| {
            b.iter(|| {
                for &[x, y, z] in black_box(arguments) {
                    black_box(interval(x, y, z));
                }
            })
        });
    }
    group.finish();
}

fn formulas(c: &mut Criterion) {
    let two = Interval::point(2.0);
    compare(c, "x*2 + y/z", |x, y, z| x * 2.0 + y / z, |x, y, z| x * two + y / z);
    compare(c, "sin x", |x, _, _| x.sin(), |x, _, _| x.sin());
    compare(
        c,
        "sqrt(x^2 + y^2)/z",
        |x, y, z| (x * x + y * y).sqrt() / z,
        |x, y, z| (x.sqr() + y.sqr()).sqrt() / z,
    );
}

criterion_group!(benches, formulas);
criterion_main!(benches);
