//! The costs of reading payloads, and of writing a substitute in the form of its source.
#![allow(missing_docs, reason = "criterion_group! makes a public function without documentation")]

use core::hint::black_box;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use shsa_bridge::payload::{Reader, SIZE_LIMIT, Writer};
use shsa_bridge::{Provenance, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::source::{Field, StampField};

const OBJECT: &str = r#"{"id": "wheel-1", "battery": 87, "speed": {"value": 12.375, "unit": "m/s"}, "stamp": 1700000000.25, "ok": true, "temperature": 21.5}"#;

fn field(path: &str) -> Field {
    Field { path: path.into(), stamp: Some(StampField { path: "stamp".into(), step: None }) }
}

fn scan() -> String {
    let ranges: Vec<String> = (0..1000).map(|k| format!("{:.3}", 1.0 + f64::from(k) * 0.01)).collect();
    format!(r#"{{"stamp": 1.5, "ranges": [{}]}}"#, ranges.join(", "))
}

fn read(c: &mut Criterion) {
    let scan = scan();
    let cases = [
        ("number", "21.5", vec![Field::default()]),
        ("object, one field", OBJECT, vec![field("speed.value")]),
        ("object, three fields", OBJECT, vec![field("speed.value"), field("temperature"), field("ok")]),
        ("scan of 1000", &scan, vec![field("ranges")]),
    ];
    let mut group = c.benchmark_group("read");
    for (name, payload, fields) in cases {
        let mut reader = Reader::new(&fields, SIZE_LIMIT).expect("good paths");
        group.throughput(Throughput::Bytes(payload.len() as u64));
        group.bench_with_input(BenchmarkId::from_parameter(name), payload, |b, payload| {
            b.iter(|| {
                reader.read_bytes(black_box(payload.as_bytes()), |_, reading| {
                    drop(black_box(reading.expect("readable")))
                })
            });
        });
    }
}

fn write(c: &mut Criterion) {
    let provenance = Provenance::new(Quality::Substitute, "wheel_2, turn");
    let value = RawValue::Interval { lo: 11.9, hi: 12.4 };
    let mut group = c.benchmark_group("write");
    let like = Writer::like(field("speed.value"), SIZE_LIMIT).expect("good path");
    for (name, mut writer) in [("plain", Writer::plain()), ("json", Writer::envelope()), ("like", like)] {
        writer.learn(&OBJECT.into());
        group
            .bench_function(name, |b| b.iter(|| writer.write(black_box(Some(&value)), Time(5), &provenance)));
    }
}

criterion_group!(payload, read, write);
criterion_main!(payload);
