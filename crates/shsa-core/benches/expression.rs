//! The cost of a compiled formula compared with the same formula in Rust: `sqrt(x^2 + y^2) / z` over 10,000 argument triples.
#![allow(missing_docs, reason = "criterion_group! makes a public function without documentation")]

use core::hint::black_box;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use shsa_core::expression::{
    Assignment, Function, Kind, Number, Program, Scope, Shape, Symbol, Value, check, parse_expression,
};
use shsa_core::interval::Interval;
use shsa_core::time::{Time, Validity};

const COUNT: usize = 10_000;
const NAMES: [&str; 4] = ["x", "y", "z", "v"];

struct Letters;

impl Scope for Letters {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        NAMES.iter().position(|known| *known == name).map(|place| Symbol(place as u32))
    }

    fn kind(&self, symbol: Symbol) -> Kind {
        let shape = if symbol.0 < 3 { Shape::Scalar } else { Shape::Vector };
        Kind { shape, unit: None, range: None, constant: None }
    }

    fn function(&self, _: &str) -> Option<&Function> {
        None
    }

    fn names(&self) -> Vec<&str> {
        NAMES.to_vec()
    }

    fn function_names(&self) -> Vec<&str> {
        Vec::new()
    }
}

fn compiled(text: &str) -> Program {
    let formula = parse_expression(text).ok().and_then(|expression| check(&expression, &Letters).formula);
    let program = formula.and_then(|formula| {
        Program::compile(&[Assignment { symbol: Symbol(9), formula: &formula, condition: None }]).ok()
    });
    program.unwrap_or_else(|| std::process::exit(1))
}

fn numbers() -> Vec<[f64; 3]> {
    let part = |k: usize, step: f64| (k as f64 * step).fract();
    (0..COUNT).map(|k| [part(k, 0.618) * 6.0 - 3.0, 1.0 + part(k, 0.414), 1.0 + part(k, 0.732)]).collect()
}

fn run<N: Number>(c: &mut Criterion, kind: &str, arguments: &[[N; 3]], native: impl Fn(N, N, N) -> N) {
    let program = compiled("sqrt(x^2 + y^2) / z");
    let mut state = program.new_state(0, 1.0);
    let mut group = c.benchmark_group("sqrt(x^2 + y^2) / z");
    group.throughput(Throughput::Elements(COUNT as u64));
    group.bench_function(format!("{kind}, native"), |b| {
        b.iter(|| {
            for &[x, y, z] in black_box(arguments) {
                black_box(native(x, y, z));
            }
        })
    });
    group.bench_function(format!("{kind}, program"), |b| {
        b.iter(|| {
            for &numbers in black_box(arguments) {
                let inputs = numbers.map(Value::Scalar);
                black_box(program.evaluate(&mut state, &inputs, Validity::at(Time(0)), None));
            }
        })
    });
    group.finish();
}

fn formulas(c: &mut Criterion) {
    let numbers = numbers();
    run(c, "f64", &numbers, |x, y, z| (x * x + y * y).sqrt() / z);
    let intervals: Vec<_> =
        numbers.iter().map(|values| values.map(|x| Interval::point(x).widened(0.013))).collect();
    run(c, "intervals", &intervals, |x, y, z| (x.sqr() + y.sqr()).sqrt() / z);
}

/// The minimum and the median of a scan of 640 distances.
fn vectors(c: &mut Criterion) {
    let scan: Vec<Interval> =
        (0..640).map(|k| Interval::point((f64::from(k) * 0.618).fract()).widened(0.01)).collect();
    for text in ["min(v)", "median(v)", "min(2 * v + 1)"] {
        let program = compiled(text);
        let mut state = program.new_state(640, 1.0);
        c.bench_function(&format!("{text} of 640 intervals"), |b| {
            b.iter(|| {
                let inputs = [Value::Vector(black_box(&scan))];
                black_box(program.evaluate(&mut state, &inputs, Validity::at(Time(0)), None));
            })
        });
    }
}

criterion_group!(benches, formulas, vectors);
criterion_main!(benches);
