//! Random systems whose truth is known: a sensor within its declared error is never accused, and no need is lost; a sensor whose
//! error is too large to hide is accused, and no other sensor is called failed.
//!
//! A few systems of every kind run with each test. `SHSA_SEEDS=0..1000` runs others, and more.

use shsa_core::engine::{EventKind, Input};
use shsa_core::knowledge::SignalId;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_format::drive::Run;
use shsa_format::words;
use std::fmt::Write;
use std::ops::Range;

const SECONDS: f64 = 120.0;
/// The time from which the faulty sensor is wrong.
const LIES_FROM: f64 = 60.0;
/// A sound value uses at most this share of its declared error.
const USED: f64 = 0.9;

/// Numbers from a simple generator (SplitMix64, Steele, Lea and Flood 2014, doi:10.1145/2660193.2660195).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.next() * all.len() as f64) as usize]
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Alone,
    Product,
    Rate,
    Sum,
}

#[derive(Clone, Copy, Debug)]
enum Noise {
    Uniform,
    TwoPoints,
    Constant,
    Wandering,
}

#[derive(Clone, Copy, Debug)]
struct Kind {
    rated: bool,
    delayed: bool,
    shape: Shape,
    noise: Noise,
    /// Whether stamps are wrong, too, by up to 0.2 s.
    stamped: bool,
}

/// The plant: what the variables are, by time.
#[derive(Clone, Copy)]
struct Plant {
    mean: f64,
    amplitude: f64,
    period: f64,
}

impl Plant {
    fn v(self, time: f64) -> f64 {
        self.mean + self.amplitude * (time / self.period).sin()
    }
    fn x(self, time: f64) -> f64 {
        self.mean * time - self.amplitude * self.period * (time / self.period).cos()
    }
    fn k(self, time: f64) -> f64 {
        3.0 + 1.5 * (time / (1.7 * self.period) + 1.0).sin()
    }
    /// The most that `v` and `k` change in a second.
    fn rates(self) -> (f64, f64) {
        (self.amplitude / self.period, 1.5 / (1.7 * self.period))
    }
}

struct Sensor {
    name: String,
    variable: &'static str,
    truth: Box<dyn Fn(f64) -> f64>,
    rate: f64,
    error: f64,
    delay: f64,
}

struct System {
    text: String,
    sensors: Vec<Sensor>,
    plant: Plant,
}

fn system(random: &mut Random, kind: Kind) -> System {
    let plant = Plant {
        amplitude: random.between(1.0, 5.0),
        period: random.between(3.0, 15.0),
        mean: random.between(5.0, 20.0),
    };
    let mut sensors = Vec::new();
    let mut sensor = |name: String, variable, truth: fn(Plant, f64) -> f64, rate, error, delay| {
        let truth = Box::new(move |time| truth(plant, time));
        sensors.push(Sensor { name, variable, truth, rate, error, delay });
    };
    let count = 2 + (random.next() * 3.0) as usize;
    for at in 0..count {
        let rate = random.one_of(&[0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0]);
        let delay = if kind.delayed { random.one_of(&[0.0, 0.05, 0.2, 0.5]) } else { 0.0 };
        sensor(format!("s{at}"), "v", Plant::v, rate, 0.2, delay);
    }
    let slow = |random: &mut Random| random.one_of(&[1.0, 5.0, 10.0]);
    let (of_v, of_k) = plant.rates();
    let rate = |rate: f64| if kind.rated { format!(", max_rate: {:.4}", 1.2 * rate) } else { String::new() };
    let mut text = format!("shsa: 1\nvariables:\n  v: {{ range: [-100, 100]{} }}\n", rate(of_v));
    match kind.shape {
        Shape::Alone => {}
        Shape::Product => {
            let of_p = of_v * 4.5 + (plant.mean + plant.amplitude) * of_k;
            let _ = writeln!(
                text,
                "  k: {{ range: [0.1, 100]{} }}\n  p: {{ range: [-1000, 1000]{} }}",
                rate(of_k),
                rate(of_p)
            );
            text += "relations:\n  product: { equation: p = v * k, error: 0.5 }\n";
            sensor("k".into(), "k", Plant::k, slow(random), 0.05, 0.0);
            sensor("p".into(), "p", |plant, time| plant.v(time) * plant.k(time), slow(random), 0.5, 0.0);
        }
        Shape::Sum => {
            let _ = writeln!(
                text,
                "  k: {{ range: [-100, 100]{} }}\n  z: {{ range: [-1000, 1000]{} }}",
                rate(of_k),
                rate(of_v + of_k)
            );
            text += "relations:\n  sum: { equation: z = v + k }\n";
            sensor("k".into(), "k", Plant::k, slow(random), 0.05, 0.0);
            sensor("z".into(), "z", |plant, time| plant.v(time) + plant.k(time), slow(random), 0.2, 0.0);
        }
        Shape::Rate => {
            text += "  x: { }\n";
            let _ = writeln!(
                text,
                "relations:\n  rate: {{ equation: \"v = derivative(x, 1 s) * 1 s\", for: [v], error: {:.2} }}",
                of_v + 0.3
            );
            sensor("x".into(), "x", Plant::x, random.one_of(&[5.0, 10.0, 20.0]), 0.05, 0.0);
        }
    }
    text += "signals:\n";
    for Sensor { name, variable, rate, error, delay, .. } in &sensors {
        let delay = if *delay > 0.0 { format!(", delay: {:.0} ms", 1000.0 * delay) } else { String::new() };
        let stamps = if kind.stamped { ", time_error: 200 ms" } else { "" };
        let _ = writeln!(
            text,
            "  {name}: {{ variable: {variable}, rate: {rate} Hz, value_error: {error}{delay}{stamps} }}"
        );
    }
    let fastest =
        sensors.iter().filter(|sensor| sensor.variable == "v").map(|sensor| sensor.rate).fold(0.0, f64::max);
    let age = (3.0_f64 / fastest).max(0.5) + if kind.delayed { 0.6 } else { 0.0 };
    let _ = writeln!(text, "needs: {{ v: {{ signal: /v, max_age: {:.0} ms }} }}", 1000.0 * age);
    System { text, sensors, plant }
}

/// The error of a sensor, within the declared bound.
fn error(random: &mut Random, noise: Noise, bound: f64) -> impl FnMut(f64, &mut Random) -> f64 + use<> {
    let bound = USED * bound;
    let (phase, period) = (random.between(0.0, 6.0), random.between(20.0, 60.0));
    let side = random.one_of(&[-1.0, 1.0]);
    move |time, random| match noise {
        Noise::Uniform => random.between(-bound, bound),
        Noise::TwoPoints => bound * random.one_of(&[-1.0, 1.0]),
        Noise::Constant => bound * side,
        Noise::Wandering => bound * (time / period + phase).sin(),
    }
}

/// Name, time and value of all observations, in their order.
fn observations(random: &mut Random, kind: Kind, sensors: &[Sensor]) -> Vec<(f64, f64, usize, f64)> {
    let mut rows = Vec::new();
    for (at, sensor) in sensors.iter().enumerate() {
        let mut off = error(random, kind.noise, sensor.error);
        for number in 0..(SECONDS * sensor.rate) as usize {
            let time = (number as f64 + 0.2 * random.next()) / sensor.rate;
            let stamp = if kind.stamped { time + random.between(-0.2, 0.2) * USED } else { time };
            rows.push((time, stamp, at, (sensor.truth)(time - sensor.delay) + off(time, random)));
        }
    }
    rows.sort_by(|one, other| one.0.total_cmp(&other.0));
    rows
}

/// The mistakes in the events of a system; empty when there are none.
fn wrong(kind: Kind, seed: u64, with_fault: bool) -> Vec<String> {
    let mut random = Random(
        seed.wrapping_mul(7919)
            ^ (kind.shape as u64) << 40
            ^ (kind.noise as u64) << 44
            ^ u64::from(kind.rated) << 48
            ^ u64::from(kind.delayed) << 49
            ^ u64::from(kind.stamped) << 50,
    );
    let System { text, sensors, plant } = system(&mut random, kind);
    let loaded = shsa_model::load(&text, "model.yaml");
    assert!(loaded.report.ok(), "{:?}\n{text}", loaded.report.diagnostics);
    let knowledge = loaded.knowledge;
    let rows = observations(&mut random, kind, &sensors);
    let of_v = sensors.iter().filter(|sensor| sensor.variable == "v").count();
    let liar = (random.next() * of_v as f64) as usize;
    let hidden = 0.4 + if kind.shape == Shape::Rate { plant.rates().0 + 0.3 } else { 0.0 };
    let lie = if with_fault { 4.0 * hidden * random.one_of(&[-1.0, 1.0]) } else { 0.0 };
    let ids: Vec<SignalId> =
        sensors.iter().map(|sensor| knowledge.signal(&sensor.name).expect("a signal")).collect();
    let mut run = Run::new(&knowledge, Time::from_seconds(1000.0));
    let mut keep = |_: shsa_format::drive::Given<'_>| Ok::<(), ()>(());
    for (time, stamp, at, value) in rows {
        let lies = at == liar && time >= LIES_FROM;
        let received = Time::from_seconds(1000.003 + time);
        let value = RawValue::Number(value + if lies { lie } else { 0.0 });
        let stamp = Time::from_seconds(1000.0 + stamp);
        run.pass_until(received, &mut keep).unwrap();
        run.take(&Input::Observation(Observation { signal: ids[at], stamp, received, value }), &mut keep)
            .unwrap();
    }
    let name = |signal: Option<SignalId>| signal.map_or("", |id| knowledge.signals()[id].name.as_str());
    let is_wrong = |event: &&shsa_core::engine::Event| {
        let is_early = event.time < Time::from_seconds(1000.0 + LIES_FROM - 1.0);
        match event.kind {
            EventKind::Failed => !with_fault || event.signal != Some(ids[liar]),
            EventKind::Suspected | EventKind::Unhealable => !with_fault || is_early,
            _ => false,
        }
    };
    let mut wrong: Vec<String> = run
        .events
        .iter()
        .filter(is_wrong)
        .map(|event| {
            format!(
                "{:?} {} at {:.1}: {}",
                event.kind,
                name(event.signal),
                event.time.seconds() - 1000.0,
                words::reasons(&event.because)
            )
        })
        .collect();
    wrong.truncate(2);
    let is_accused = |event: &shsa_core::engine::Event| {
        event.signal == Some(ids[liar]) && matches!(event.kind, EventKind::Failed | EventKind::Suspected)
    };
    if with_fault && !run.events.iter().any(is_accused) {
        wrong.push(format!("missed: {} lies by {lie:.2}", sensors[liar].name));
    }
    if !wrong.is_empty() && std::env::var("SHSA_SHOW").is_ok() {
        wrong.push(text);
    }
    wrong
}

fn seeds(usual: Range<u64>) -> Range<u64> {
    let Ok(text) = std::env::var("SHSA_SEEDS") else { return usual };
    let (first, last) = text.split_once("..").expect("SHSA_SEEDS=0..100");
    first.parse().expect("a number")..last.parse().expect("a number")
}

#[track_caller]
fn check(with_fault: bool, is_stamped: &[bool]) {
    let (mut count, mut all) = (0, Vec::new());
    for rated in [false, true] {
        for delayed in [false, true] {
            for shape in [Shape::Alone, Shape::Product, Shape::Rate, Shape::Sum] {
                for noise in [Noise::Uniform, Noise::TwoPoints, Noise::Constant, Noise::Wandering] {
                    for &stamped in is_stamped {
                        let kind = Kind { rated, delayed, shape, noise, stamped };
                        for seed in seeds(0..3) {
                            count += 1;
                            let wrong = wrong(kind, seed, with_fault);
                            if !wrong.is_empty() {
                                all.push(format!("{kind:?} seed {seed}:\n    {}", wrong.join("\n    ")));
                            }
                        }
                    }
                }
            }
        }
    }
    assert!(all.is_empty(), "{} of {count} systems wrong:\n{}", all.len(), all.join("\n"));
}

#[test]
fn what_is_sound_is_never_accused() {
    check(false, &[false]);
}

#[test]
fn what_is_sound_but_for_its_stamps_is_never_accused() {
    check(false, &[true]);
}

#[test]
fn one_that_lies_is_reported_and_no_other_has_failed() {
    check(true, &[false]);
}
